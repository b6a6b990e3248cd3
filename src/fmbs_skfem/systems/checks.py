r"""The contracts of joints, loads and systems, for every type of this package and for a user's own.

    joint     Phi(x0, 0) = 0,   Phi_x = dPhi/dx,   H_m = d2 Phi_m / dx2,   constant Phi_x for rows that call themselves linear
    load      K = - dF/dx,   C = - dF/dv,   v . (F(x, v) - F(x, 0)) <= 0 where it does not drive
    system    K = d(f + Phi_x^T lambda)/dx,   f_elastic = dU/dx,   v . (f(x, v) - f(x, 0)) >= 0,   M = M^T, semi-definite

Derivatives are compared with fourth-order differences along random directions at a random state
near the reference. Elastic forces and the forces of loads and joints are tested apart, because
stiff bodies would hide the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from scipy.linalg import eigvalsh
from scipy.sparse import csr_array

from ..bodies.body import Body
from ..core.algebra.linalg import as_dense
from ..core.errors import InputError, require, say
from ..core.values.arguments import checked
from . import compiled
from .assembly import assemble
from .compiled import Compiled, compile_system
from .connections.constraint_functions import Joint
from .forces.loads import Load
from .system import Constraints, Loads, System, is_linear, linear_part

AMPLITUDE = 1e-3  #: of the random state and of the directions, in units of the mean coordinate
STEP = 0.01  #: of the difference quotients, in units of the directions
RATES = 0.2  #: directions of velocities, in units of the mean coordinate a second
DIRECTIONS = 3

Function = Callable[[np.ndarray], np.ndarray]


@checked
def check_joint(
    bodies: Iterable[Body], joint: Joint, time: float = 0.3, tolerance: float = 1e-7, seed: int = 0
) -> None:
    """The contract of a joint between the given bodies; raises an InputError that names what fails.

        Phi(x0, 0) = 0,   Phi_x = dPhi/dx,   H_m = d2 Phi_m / dx2,   constant Phi_x for rows that call themselves linear

    Derivatives are compared with fourth-order differences at a random state (`seed`) at `time` [s];
    errors are relative, up to the `tolerance`.

        >>> import numpy as np
        >>> from fmbs_skfem.bodies import point_mass
        >>> from fmbs_skfem.systems import At, check_joint, joints
        >>> pair = [point_mass("a", 1.0, np.zeros(2)), point_mass("b", 1.0, np.ones(2))]
        >>> check_joint(pair, joints.RigidLink("link", At("a"), At("b")))  # silent: it holds
    """
    system = replace(assemble(bodies, [joint]), elastic=())
    random = generator(seed)
    where = f"check_joint({type(joint).__name__})"
    model = compile_system(system)
    count = len(system.constraints.names)
    require(
        where,
        "gap in the reference",
        float(np.abs(compiled.gap(model, system.x0)[0]).max()),
        1e-9 * system.scale,
    )
    x = random_state(system, random)
    for m in range(count):
        multipliers = np.eye(count)[m]
        label = f"row '{system.constraints.names[m][1]}'"
        for d in directions(system, random):
            J = compiled.gap(model, x, time)[1]
            slope = difference(lambda z: compiled.gap(model, z, time)[0], x, d)
            require(
                where,
                f"Jacobian of {label}",
                abs(float(slope[m] - J[m] @ d)) / row_size(J[m], d),
                tolerance,
            )
        check_tangent(
            where, f"second derivatives of {label}", model, x, multipliers, time, random, tolerance
        )
    rows, A, a = linear_part(system)
    error = np.abs(A @ x + a - compiled.gap(model, x, time)[0][rows]).max(initial=0.0)
    require(
        where,
        f"linear rows ({is_linear(system.constraints).sum()} of {count}) as A x + a",
        float(error),
        tolerance,
    )


@checked
def check_force(
    bodies: Iterable[Body], load: Load, time: float = 0.3, tolerance: float = 1e-7, seed: int = 0
) -> None:
    """The contract of a load on the given bodies; raises an InputError that names what fails.

    Derivatives by positions and velocities are those of its forces at a random state, and what
    reads velocities takes energy out, unless the load says that it `drives`.

        >>> import numpy as np
        >>> from fmbs_skfem.bodies import point_mass
        >>> from fmbs_skfem.systems import At, check_force, springs
        >>> spring = springs.SpringDamper("spring", At("a"), (0.0, 1.0), stiffness=20.0)
        >>> check_force([point_mass("a", 1.0, np.zeros(2))], spring)  # silent: it holds
    """
    system = assemble(bodies, loads=[load])
    random = generator(seed)
    system = replace(
        system, elastic=(), constraints=Constraints(), damping=csr_array(system.mass.shape)
    )
    where = f"check_force({type(load).__name__})"
    model = compile_system(system)
    none = np.zeros(0)
    x = random_state(system, random)
    v = directions(system, random)[0] / AMPLITUDE
    for rate, name in (
        (v, "derivative by positions"),
        (np.zeros_like(v), "derivative by positions at rest"),
    ):
        check_tangent(where, name, model, x, none, time, random, tolerance, rate)
    check_rates(where, model, x, v, time, random, tolerance)
    if not load.drives:
        check_loss(where, model, x, v, time, tolerance)


@checked
def check_system(system: System, time: float = 0.3, tolerance: float = 1e-7, seed: int = 0) -> None:
    """The contract of a system, full or reduced; raises an InputError that names what fails.

        K = d(f + Phi_x^T lambda)/dx,   f_elastic = dU/dx,   v . (f(x, v) - f(x, 0)) >= 0,   M = M^T, semi-definite

    Derivatives are compared with fourth-order differences at a random state (`seed`) at `time` [s];
    errors are relative, up to the `tolerance`. The mass becomes a dense matrix.
    """
    where = "check_system"
    random = generator(seed)
    x = random_state(system, random)
    v = directions(system, random)[0] / AMPLITUDE
    count = len(system.constraints.names)
    check_mass(where, system)
    elastic = compile_system(without_loads(system))
    check_energy(
        where, compile_system(without_pressures(without_loads(system))), x, random, tolerance
    )
    check_tangent(
        where, "tangent of the elastic forces", elastic, x, np.zeros(0), time, random, tolerance
    )
    rest = compile_system(replace(system, elastic=()))
    multipliers = random.normal(size=count)
    check_tangent(
        where, "tangent of loads and joints", rest, x, multipliers, time, random, tolerance
    )
    whole = compile_system(system)
    check_tangent(where, "tangent of all forces", whole, x, multipliers, time, random, tolerance)
    check_rates(where, whole, x, v, time, random, tolerance)
    check_loss(
        where,
        compile_system(replace(system, loads=Loads(system.loads.constant))),
        x,
        v,
        time,
        tolerance,
    )


def generator(seed: int) -> Generator:
    """Random numbers of a seed; InputError for a negative one."""
    if seed < 0:
        raise InputError(say("seed", "0 or more", seed))
    return np.random.default_rng(seed)


def random_state(system: System, random: Generator) -> np.ndarray:
    """The initial state with a small random change, (n,)."""
    return system.x0 + length(system) * random.normal(size=system.size)


def directions(system: System, random: Generator) -> np.ndarray:
    """Random directions (DIRECTIONS, n) as large as the change of the state."""
    return length(system) * random.normal(size=(DIRECTIONS, system.size))


def length(system: System) -> float:
    """Size of displacements by which states are changed [m].

        AMPLITUDE sqrt(mean(x^2))

    of the coordinates x (n,).
    """
    return AMPLITUDE * (float(np.sqrt(np.mean(system.lift(system.x0) ** 2))) or 1.0)


def difference(function: Function, x: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Derivative of a function of x (n,) along d (n,) by the fourth-order central difference with
    the step h = `STEP`.

        (f(x - 2 h d) - 8 f(x - h d) + 8 f(x + h d) - f(x + 2 h d)) / (12 h)
    """
    f = {k: function(x + k * STEP * d) for k in (-2, -1, 1, 2)}
    return (8 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12 * STEP)


def row_size(row: np.ndarray, d: np.ndarray) -> float:
    """Size of a product of a row (n,) and d (n,) without cancellation.

        |row| . |d|

    1 for a row of zeros.
    """
    return float(np.abs(row) @ np.abs(d)) or 1.0


def check_tangent(
    where: str,
    name: str,
    model: Compiled,
    x: np.ndarray,
    multipliers: np.ndarray,
    time: float,
    random: Generator,
    tolerance: float,
    v: np.ndarray | None = None,
) -> None:
    """K d against differences, relative to |K d| and to the change of a force that turns with d.

        K d = d/ds (f + Phi_x^T lambda)(x + s d)

    x and v (n,), multipliers (m,), `time` [s]; InputError where an error is above the `tolerance`.
    """
    v = np.zeros_like(x) if v is None else v

    def force(z: np.ndarray) -> np.ndarray:
        return compiled.evaluate(model, z, v, time, None, multipliers)[0]

    K = compiled.tangent(model, x, multipliers, time, v=v)
    size = AMPLITUDE * np.linalg.norm(force(x)) / length(model.system)
    for d in directions(model.system, random):
        product = K @ d
        scale = np.linalg.norm(product) + size * np.linalg.norm(d)
        require(
            where,
            name,
            float(np.linalg.norm(product - difference(force, x, d)) / (scale or 1.0)),
            tolerance,
        )


def check_energy(
    where: str, model: Compiled, x: np.ndarray, random: Generator, tolerance: float
) -> None:
    """Elastic force against differences of the strain energy at x (n,); `model` has no loads.

        f . d = d/ds U(x + s d)

    InputError where an error is above the `tolerance`.
    """

    def energy(z: np.ndarray) -> np.ndarray:
        return np.array(compiled.strain_energy(model, z) + 0.5 * z @ (model.system.stiffness @ z))

    f = compiled.forces(model, x, np.zeros_like(x))
    for d in directions(model.system, random):
        error = abs(float(f @ d - difference(energy, x, d))) / row_size(f, d)
        require(where, "elastic forces against the strain energy", error, tolerance)


def check_rates(
    where: str,
    model: Compiled,
    x: np.ndarray,
    v: np.ndarray,
    time: float,
    random: Generator,
    tolerance: float,
) -> None:
    """The derivative by velocities that the tangent adds against differences of the forces, at x
    and v (n,) and `time` [s].

        C d = d/ds f(x, v + s d)

    InputError where an error is above the `tolerance`.
    """
    none = np.zeros(model.constraints)
    C = compiled.tangent(model, x, none, time, 1.0, v=v) - compiled.tangent(
        model, x, none, time, v=v
    )
    noise = 1e-12 * float(np.linalg.norm(compiled.forces(model, x, v, time)))
    for d in RATES * directions(model.system, random) / AMPLITUDE:
        change = difference(lambda z: compiled.forces(model, x, z, time), v, d)
        size = float(np.linalg.norm(C @ d)) or 1.0
        error = float(np.linalg.norm(change - C @ d))
        require(
            where, "derivative of the forces by velocities", error, tolerance * size + noise / STEP
        )


def check_loss(
    where: str, model: Compiled, x: np.ndarray, v: np.ndarray, time: float, tolerance: float
) -> None:
    """What reads velocities takes energy out, at x and v (n,) and `time` [s]; else InputError.

        v . (f(x, v) - f(x, 0)) >= 0

    to the `tolerance`, relative.
    """
    whole, still = (
        compiled.forces(model, x, v, time),
        compiled.forces(model, x, np.zeros_like(x), time),
    )
    damping = whole - still
    noise = 1e-12 * float(np.linalg.norm(whole))
    room = (tolerance * float(np.linalg.norm(damping)) + noise) * float(np.linalg.norm(v))
    require(where, "damping takes energy out (gain)", -float(v @ damping), room)


def check_mass(where: str, system: System) -> None:
    """Mass symmetric and without negative directions, relative to its largest entry; massless
    frames have none at all.

        M = M^T,    v^T M v >= 0
    """
    M = as_dense(system.mass)
    largest = float(np.abs(M).max())
    require(where, "symmetry of the mass", float(np.abs(M - M.T).max()) / largest, 1e-13)
    lowest = float(eigvalsh(M, subset_by_index=[0, 0])[0])
    require(where, "positive mass (lowest eigenvalue below zero)", -lowest / largest, 1e-14)


def without_pressures(system: System) -> System:
    """The system without loads that follow, whose work is no energy."""
    return replace(
        system, elastic=tuple(part for part in system.elastic if not part.gather.law.follows)
    )


def without_loads(system: System) -> System:
    """The elastic system alone, without damping."""
    loads = Loads(np.zeros(system.size))
    undamped = tuple(replace(part, beta=0.0) for part in system.elastic)
    return replace(
        system,
        elastic=undamped,
        damping=csr_array(system.mass.shape),
        loads=loads,
        constraints=Constraints(),
    )
