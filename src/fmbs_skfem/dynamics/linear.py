r"""Equations in a turning frame, and linear equations about an equilibrium.

    in a frame that turns at W about an axis, p = R(t)^T q, J = axis x:
    M p'' + (C + 2 W M J) p' + (K + W C J + W^2 M J^2) p + f(p) - Q + Phi_q^T lambda = 0                                    (1)

    about an equilibrium:    M u'' + C u' + K u = 0,   Phi_x u = 0,   K = d(f - Q + Phi_x^T lambda)/dx,   C = d(f - Q)/dx'      (2)

A steadily turning mechanism is an equilibrium of (1), whose 2 W M J is gyroscopic and W^2 M J^2 centrifugal: (1) is a System
again, so that statics and modes take it. Damping against the surroundings (C, mass-proportional) acts on the velocity in space,
that of strains on the one in the frame: where it outweighs the other, a shaft whirls above its critical speed.

Source: Geradin and Rixen, Mechanical Vibrations, 3rd ed., Wiley 2015, ch. 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array, eye_array, kron

from ..core import ranks
from ..core.errors import InputError, say
from ..core.linalg import is_sparse
from ..systems import compiled
from ..systems.compiled import compile_system
from ..systems.redundancy import scale_of
from ..systems.system import System


def in_turning_frame(system: System, rate: float, axis: np.ndarray | None = None, center: np.ndarray | None = None) -> System:
    """The equations (1) of a system that turns at `rate` [rad/s] about `axis` (c,) through `center` (c,) [m].

    By default about z through the origin of the scene. Joints and loads are those of the frame and turn with it: a clamp holds a
    blade to its hub. The motion begins at rest in the frame. InputError unless the unknowns are all coordinates of full bodies,
    which are vectors: take the system before `eliminate`.
    """
    spin, d = skew(system.dim, rate, axis), system.dim
    whole = is_sparse(system.mass) and len(system.x0) == len(system.unit) * d
    if not whole or compiled.vectorwise(csr_array(system.mass), d)[1] != d:
        got = f"{system.size} unknowns of {len(system.unit) * d} coordinates"
        raise InputError(say("in_turning_frame", "all coordinates of full bodies", got, "take the system before `eliminate`"))
    place = np.zeros(d) if center is None else np.asarray(center, dtype=float)
    turn = csr_array(kron(eye_array(system.size // d), spin))
    M, C = csr_array(system.mass), csr_array(system.damping)
    pull = csr_array(C @ turn + M @ turn @ turn)
    middle = np.kron(system.unit, system.origin - place)
    return replace(
        system,
        damping=csr_array(C + 2.0 * M @ turn),
        stiffness=csr_array(system.stiffness + pull),
        loads=replace(system.loads, constant=system.loads.constant - pull @ middle),
        v0=np.zeros(system.size),
        full=None,
    )


def skew(dim: int, rate: float, axis: np.ndarray | None) -> np.ndarray:
    """Matrix (c, c) of u -> rate axis x u [1/s]."""
    if dim == 2:
        return rate * np.array([[0.0, -1.0], [1.0, 0.0]])
    e = np.array([0.0, 0.0, 1.0]) if axis is None else np.asarray(axis, dtype=float)
    if e.shape != (3,) or not np.linalg.norm(e) > 0:
        raise InputError(say("in_turning_frame, axis", "a vector of three components that is not zero", axis))
    return rate * np.cross(np.eye(3), -e / np.linalg.norm(e))


@dataclass(frozen=True)
class Linear:
    """The linear equations (2) about an equilibrium."""

    x: np.ndarray  #: (n,) the equilibrium
    mass: csr_array  #: (n, n)
    damping: csr_array  #: (n, n), with gyroscopic terms
    stiffness: csr_array  #: (n, n)
    rows: np.ndarray  #: (m, n) independent rows of Phi_x


def linearise(
    system: System,
    x: np.ndarray | None = None,
    multipliers: np.ndarray | None = None,
    t: float = 0.0,
    angles: np.ndarray | None = None,
) -> Linear:
    """Equations (2) of a system about an equilibrium x (n,) with multipliers (m,) at time t, by default about the reference.

    `angles` (l,) are those of springs that have turned by more than half a turn. A state of `solve_statics` belongs to the system
    at the load factor t of `loading.ramp`.
    """
    model = compile_system(system)
    x = system.x0 if x is None else x
    multipliers = np.zeros(model.constraints) if multipliers is None else multipliers
    J = compiled.gap(model, x, t)[1]
    K = compiled.tangent(model, x, multipliers, t, 0.0, angles)
    C = compiled.tangent(model, x, multipliers, t, 1.0, angles) - K
    independent = J[ranks.independent_rows(J, units=scale_of(system))]
    return Linear(x, csr_array(system.mass), csr_array(C), csr_array(K), independent)
