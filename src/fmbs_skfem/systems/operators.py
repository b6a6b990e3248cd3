r"""The operators of a system as numbers, in the order of its unknowns, for analyses and reductions
of one's own.

    M x'' + f(x, x', t) + Phi_x^T lambda = 0,    Phi(x, t) = 0        M = system.mass,  q = system.lift(x)

Full, reduced and hyper-reduced systems alike. What is compiled of a system is kept with it. Forces
that remember, such as torsion springs that count turns, are those of the start: angles have turned
by less than half a turn.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from ..core.values import arrays
from ..core.values.arguments import checked
from . import compiled
from .system import System


@checked
def force(system: System, x: ArrayLike, v: ArrayLike | None = None, t: float = 0.0) -> np.ndarray:
    """Forces (n,) [N] at unknowns x (n,) and rates v (n,), zero by default, at time t [s].

        f = elastic forces + damping forces - loads

    InputError for arrays of another shape.
    """
    x, v = read(system, "x", x), read(system, "v", np.zeros(system.size) if v is None else v)
    return compiled.forces(compiled.compile_system(system), x, v, t)


@checked
def tangent(
    system: System,
    x: ArrayLike,
    v: ArrayLike | None = None,
    t: float = 0.0,
    multipliers: ArrayLike | None = None,
    rate: float = 0.0,
) -> csr_array:
    """Tangent (n, n) [N/m] of a system, exact; lambda (m,), zero by default, `rate` [1/s].

        d/dx (f + Phi_x^T lambda) + rate df/dv

    InputError for arrays of another shape.
    """
    model = compiled.compile_system(system)
    given = (
        np.zeros(model.constraints)
        if multipliers is None
        else read_multipliers(model.constraints, multipliers)
    )
    v = None if v is None else read(system, "v", v)
    return compiled.tangent(model, read(system, "x", x), given, t, rate, v=v)


@checked
def constraints(system: System, x: ArrayLike, t: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Constraints and their derivatives at unknowns x (n,) and time t [s], in the order of
    `system.constraints.names`.

        Phi (m,),    Phi_x (m, n)

    InputError for an array of another shape.
    """
    return compiled.gap(compiled.compile_system(system), read(system, "x", x), t)


@checked
def strain_energy(system: System, x: ArrayLike) -> float:
    """Strain energy of all bodies [J] at unknowns x (n,), without linear springs.

    InputError for an array of another shape.

        >>> from fmbs_skfem import bodies, systems
        >>> from fmbs_skfem.shapes.meshes import segment
        >>> rod = bodies.cable("rod", segment(2), bodies.Given(100.0, 1.0, 1.0), dim=2)
        >>> system = systems.assemble([rod])
        >>> f"{systems.strain_energy(system, 1.2 * system.x0):.3f} J"  # EA (1.2^2 - 1)^2 / 8
        '2.420 J'
    """
    return compiled.strain_energy(compiled.compile_system(system), read(system, "x", x))


def read(system: System, name: str, values: ArrayLike) -> np.ndarray:
    """Values (n,) of the unknowns; InputError for another shape."""
    wanted = f"one finite number an unknown, ({system.size},)"
    return np.ascontiguousarray(
        arrays.finite(values, name, wanted, system.size, remedy="as system.x0")
    )


def read_multipliers(count: int, values: ArrayLike) -> np.ndarray:
    """Values (m,) of the multipliers of as many constraints; InputError for another shape."""
    return arrays.finite(
        values, "multipliers", f"one finite number a constraint, ({count},)", count
    )
