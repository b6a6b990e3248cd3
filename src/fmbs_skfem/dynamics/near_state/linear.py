r"""Equations in a rotating frame, and linear equations about an equilibrium.

    in a frame that turns at W about an axis, p = R(t)^T q, J = axis x:
    M p'' + (C + 2 W M J) p' + (K + W C J + W^2 M J^2) p + f(p) - Q + Phi_q^T lambda = 0                                    (1)

    about an equilibrium:    M u'' + C u' + K u = 0,   Phi_x u = 0,   K = d(f - Q + Phi_x^T lambda)/dx,   C = d(f - Q)/dx'      (2)

A steadily turning mechanism is an equilibrium of (1), whose 2 W M J is gyroscopic and W^2 M J^2
centrifugal: (1) is a System again, so that statics and modes take it. Damping against the
surroundings (C, mass-proportional) acts on the velocity in space, that of strains on the one in the
frame: where it outweighs the other, a shaft whirls above its critical speed.

Source: Geradin and Rixen, Mechanical Vibrations, 3rd ed., Wiley 2015, ch. 2.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from scipy.sparse import csr_array, eye_array, kron

from ...core.algebra import ranks
from ...core.algebra.linalg import as_dense, is_sparse
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values import arrays
from ...core.values.arguments import checked
from ...core.values.fields import AXIS, quantity, vector
from ...systems import compiled, finer_systems, matrices, operators
from ...systems.compiled import compile_system
from ...systems.connections.redundancy import scale_of
from ...systems.system import System, driven_rows
from ..scheme import round_off

#: difference of a matrix from its transposed one, relative to its size, that is round-off
ALIKE = 1e-9


@dataclass(frozen=True)
@checked
class Spin:
    """A frame that turns steadily: about z through the origin of the scene unless an axis and a
    point of it are given.

    `rate` [rad/s], `axis` (3,) of any length, `center` (c,) [m]. In the plane the axis is that of
    z, whatever `axis` says.
    """

    rate: Annotated[float, quantity("rad/s")]
    axis: Annotated[tuple[float, ...], AXIS] | None = None
    center: Annotated[tuple[float, ...], vector("m")] | None = None


@checked
def in_rotating_frame(system: System, spin: Spin) -> System:
    """The equations (1) of a system in a frame that turns.

    Joints and loads are those of the frame and turn with it: a clamp holds a blade to its hub. The
    motion begins at rest in the frame. InputError unless the unknowns are all coordinates of full
    bodies, which are vectors: take the system before `eliminate`. What it gives can be eliminated
    and reduced as every system.
    """
    d = system.dim
    whole = is_sparse(system.mass) and len(system.x0) == len(system.unit) * d
    if not whole or matrices.vectorwise(csr_array(system.mass), d)[1] != d:
        got = f"{system.size} unknowns of {len(system.unit) * d} coordinates"
        raise InputError(
            say(
                "in_rotating_frame",
                "all coordinates of full bodies",
                got,
                "take the system before `eliminate`, reduce it behind",
            )
        )
    center = (
        np.zeros(d)
        if spin.center is None
        else arrays.finite(spin.center, "Spin.center", f"{d} numbers [m]", d)
    )
    turn = csr_array(kron(eye_array(system.size // d), skew(d, spin)))
    M, C = csr_array(system.mass), csr_array(system.damping)
    pull = csr_array(C @ turn + M @ turn @ turn)
    turned = replace(
        system,
        damping=csr_array(C + 2.0 * M @ turn),
        stiffness=csr_array(system.stiffness + pull),
        loads=replace(
            system.loads,
            constant=system.loads.constant - pull @ np.kron(system.unit, system.origin - center),
        ),
        v0=np.zeros(system.size),
        full=None,
    )
    return finer_systems.carry(system, turned, lambda finer: in_rotating_frame(finer, spin))


def skew(dim: int, spin: Spin) -> np.ndarray:
    """Matrix (c, c) of a rotation rate [1/s].

        u -> rate axis x u,    in the plane    rate [[0, -1], [1, 0]]

    InputError in space for an `axis` that is zero or has other than three components.
    """
    if dim == 2:
        return spin.rate * np.array([[0.0, -1.0], [1.0, 0.0]])
    axis = np.array([0.0, 0.0, 1.0] if spin.axis is None else spin.axis, dtype=float)
    if axis.shape != (3,) or not np.linalg.norm(axis) > 0:
        raise InputError(
            say(
                "in_rotating_frame, axis",
                "a vector of three components that is not zero",
                spin.axis,
            )
        )
    return spin.rate * np.cross(np.eye(3), -axis / np.linalg.norm(axis))


@dataclass(frozen=True)
class Linear:
    """The linear equations (2) about an equilibrium, for small changes u (n,) of x.

        M u'' + C u' + K u = 0,    rows u = 0

    Forces are in newtons where an unknown is a length [m]; `large` says what change of each unknown
    counts as large.
    """

    x: np.ndarray  #: (n,) the equilibrium
    mass: csr_array  #: (n, n)
    damping: csr_array  #: (n, n), with gyroscopic terms
    stiffness: csr_array  #: (n, n)
    rows: np.ndarray  #: (m, n) independent rows of Phi_x
    large: np.ndarray | float = 1.0  #: (n,) changes of the unknowns that count as large
    multipliers: np.ndarray | float = 0.0  #: (m,) of the equilibrium


@checked
def linearise(
    system: System,
    x: np.ndarray | None = None,
    multipliers: np.ndarray | None = None,
    t: float = 0.0,
    memory: np.ndarray | None = None,
) -> Linear:
    """Equations (2) of a system about an equilibrium x (n,) with multipliers (m,) at time t, by
    default about the reference.

        M u'' + C u' + K u = 0,    K = d(f - Q + Phi_x^T lambda)/dx,    C = d(f - Q)/dv,    Phi_x u = 0

    `memory` (l,) is what forces keep of the equilibrium, such as turns of springs. A state of
    `solve_statics` belongs to the system at the load factor t of `loading.ramp`.
    """
    model = compile_system(system)
    x = system.x0 if x is None else operators.read(system, "x", x)
    multipliers = (
        np.zeros(model.constraints)
        if multipliers is None
        else operators.read_multipliers(model.constraints, multipliers)
    )
    if memory is not None:
        kept = len(model.memory)
        memory = arrays.finite(memory, "memory", f"what forces keep, ({kept},)", kept)
    J = compiled.gap(model, x, t)[1]
    K = compiled.tangent(model, x, multipliers, t, 0.0, memory)
    C = compiled.tangent(model, x, multipliers, t, 1.0, memory) - K
    if (
        abs(C).max() > 0.0 and abs(K).max() > 0.0
    ):  # as large as K, beside which a short damping time is round-off
        factor = float(abs(K).max() / abs(C).max())
        C = (compiled.tangent(model, x, multipliers, t, factor, memory) - K) / factor
    large = scale_of(system)
    independent = J[ranks.independent_rows(J, units=large)]
    return Linear(
        x, csr_array(system.mass), csr_array(C), csr_array(K), independent, large, multipliers
    )


def is_left(system: System, time: float) -> bool:
    """Whether joints do not hold in the reference at a time [s], which then is no equilibrium, even
    without loads.

        |Phi_k(x0, t)| > tolerance |Phi_x,k| large

    with round-off for what is driven, and the digits to which places are stated for all others.
    """
    if not system.constraints.names:
        return False
    gap, J = compiled.gap(compile_system(system), system.x0, time)
    large = np.abs(as_dense(J)) @ np.broadcast_to(scale_of(system), len(system.x0))
    tolerance = np.where(
        driven_rows(system.constraints), round_off(system) / system.scale, ranks.STATED
    )
    return bool((np.abs(gap) > tolerance * large).any())


@checked
def is_symmetric(linear: Linear) -> bool:
    """Whether undamped motions are vibrations: forces have a potential, and there are no gyroscopic
    terms.

        |A - A^T| <= 1e-9 max |A|

    for every entry of the stiffness and of the damping. Damping that is symmetric passes as well.
    """
    return all(
        abs(A - A.T).max() <= ALIKE * abs(A).max() for A in (linear.stiffness, linear.damping)
    )
