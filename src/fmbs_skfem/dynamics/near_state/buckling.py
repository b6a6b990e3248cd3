r"""Buckling loads predicted from the stiffness that loads add.

    (K0 + k K1) v = 0,   K1 = dK/dfactor at no load

with K the tangent of forces and joints along the equilibria of small loads. Source: de Borst,
Crisfield, Remmers and Verhoosel, Non-Linear Finite Element Analysis of Solids and Structures, Wiley
2012, ch. 4.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eig
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigs

from ...bodies.laws import Law
from ...bodies.vectors import ALL
from ...core.algebra import ranks, saddle
from ...core.algebra.linalg import Array
from ...core.errors import InputError, listed, say
from ...core.storage.records import dataclass
from ...core.values.arguments import checked
from ...systems import compiled
from ...systems.compiled import Compiled, compile_system
from ...systems.connections.redundancy import scale_of, without_redundant
from ...systems.forces import pressure
from ...systems.signals import Cosine, Sine
from ...systems.system import System
from ..equilibria.equilibrium import Equilibrium, newton_statics, unloaded
from ..equilibria.loading import INSTANTS, ramp
from ..histories import signal_names
from ..scheme import STATIC, Newton
from .linear import linearise
from .modes import SMALL, largest_one
from .shapes import find_free

# three factors of a strip agree to 3e-8 with half, twice and ten times of either: K1 is a
# difference of what is nearly linear
#: loads of the difference quotient: a part of those given, then of those that buckle
FIRST, PROBE = (
    1e-3,
    1e-2,
)
# factors of an arch that a hundredth of its load moves by 1e-6 agree to 1e-6 with 1e-4 to 0.1, to
# 4e-4 with its own movement
WIDE = 1e-2  #: displacement over the size of the system, or turn, by which stresses are told from round-off
POTENTIAL = 1e-6  #: part of K1 that is not symmetric, on a motion that the joints allow, of loads with a potential
PROPORTIONAL = 1e-9  #: of a history: how far one may be from a multiple of t that is one
# Beck's column has no factor: what two probes gave for it were 3.3e6 and -380
AGREE = 1e-2  #: by which a factor of loads without a potential may change with the probe: others are round-off
# of loads without a potential double factors part into pairs: those of a shaft under thrust and
# twist by 7e-7 at L/h = 1000, by 6e-4 at 10 000; with 1e-6 its factor of 1 was lost, and one of 155
# 000 found
REAL = 1e-3  #: imaginary parts of load factors, relative to their size, that are round-off
FOUND = 1e-10  #: of the largest inverse of a factor: smaller ones are round-off (1e-14 to 1e-17 of it) of motions that no load softens


@dataclass(frozen=True)
class BucklingModes:
    """Where the predicted stiffness is singular, for load factors k (i,) and shapes v (n, i).

        (K0 + k K1) v = 0

    A structure buckles at `factors[0]` times its loads, as far as its equilibria are on a straight
    path up to there.
    """

    #: (i,) of the loads of the system, by their size; negative ones for reversed loads
    factors: np.ndarray
    shapes: np.ndarray  #: (n, i) of largest entry 1
    stiffness: np.ndarray  #: (i,) v^T K0 v of the shapes
    path: np.ndarray  #: (n,) by which the state changes with the load factor, of small loads
    conservative: bool  #: whether the loads have a potential: others may let motions grow before


@checked
def buckling(system: System, count: int = 1, time: float = 1.0) -> BucklingModes:
    """The `count` load factors k of least size at which the stiffness is singular.

        (K0 + k K1) v = 0

    The factor 1 stands for the loads at `time` [s] as in `solve_statics`; K1 is taken from loads of
    a hundredth of the least one. Loads without a potential may have no factor: theirs count only
    where loads of twice the size predict the same, as do those of laws of one's own and of
    polynomials. Exact where equilibria lie on a straight path, as in a column; what a structure
    bends before is left out, as small beside its size; `follow_path` finds what happens. InputError
    where loads never take the stiffness away, do not change it or not grow in proportion, or the
    system is free to move.

        >>> import numpy as np
        >>> from fmbs_skfem import bodies, dynamics, systems
        >>> from fmbs_skfem.shapes.meshes import segment
        >>> from fmbs_skfem.systems import At
        >>> beam = bodies.cable("beam", segment(4), bodies.Given(1e5, 0.5, 0.1), dim=2)
        >>> clamp = systems.joints.Clamp("clamp", At("beam", "left"))
        >>> force = systems.loads.PointForce("force", At("beam", "right"), (-1.0, 0.0))
        >>> column = systems.eliminate(systems.assemble([beam], [clamp], [force]))
        >>> f"{dynamics.buckling(column, 1).factors[0]:.3f}, {np.pi**2 * 0.5 / 4:.3f}"  # Euler
        '1.234, 1.234'
    """
    if uneven := uneven_histories(system, time):
        got = f"another history of {listed(uneven)} up to t = {time:g} s"
        raise InputError(
            say(
                "buckling",
                "loads and drives in proportion to t",
                got,
                "leave it out: they then grow with the factor",
            )
        )
    if names := [f"'{one.name}'" for one in system.elastic if one.gather.law is Law.LINEAR]:
        got = f"{', '.join(names)} of matrices, whose linear strains do not"
        remedy = "take a beam, a plate or a shell"
        raise InputError(say("buckling", "bodies that know what buckles them", got, remedy))
    model = compile_system(without_redundant(ramp(system, time)))
    probe = FIRST
    if free := find_free(model.system, linearise(model.system)).names:
        raise InputError(
            say("buckling", "a system that its joints hold", "; ".join(free), "hold it by joints")
        )
    for _ in range(2):
        found = predict_buckling(model, count, probe, WIDE)
        if not found.conservative or not holds(model):
            found = common(found, predict_buckling(model, count, 2.0 * probe, 2.0 * WIDE))
        if not len(found.factors):
            bends = found.conservative and not holds(model)
            none = (
                "it bends before: use `follow_path`"
                if bends
                else "look at `complex_modes` for flutter"
            )
            raise InputError(
                say("buckling", "loads at which the system loses its stiffness", "none", none)
            )
        probe = PROBE * float(abs(found.factors[0]))
    return found


def common(one: BucklingModes, other: BucklingModes) -> BucklingModes:
    """What `one` predicts and `other`, of loads of another size, too."""
    same = np.isclose(one.factors[:, None], other.factors, rtol=AGREE, atol=0.0).any(axis=1)
    return replace(
        one, factors=one.factors[same], shapes=one.shapes[:, same], stiffness=one.stiffness[same]
    )


def uneven_histories(system: System, time: float) -> list[str]:
    """What histories drive that is no multiple of the load factor over 0 to `time` [s]."""
    s = np.linspace(0.0, 1.0, INSTANTS)
    found = []
    for name, signal in zip(signal_names(system), ramp(system, time).signals, strict=False):
        grown = signal.angle if isinstance(signal, Cosine | Sine) else signal
        values = np.broadcast_to(grown(s), s.shape)
        if np.abs(values - s * values[-1]).max() > PROPORTIONAL * np.abs(values).max():
            found.append(name)
    return list(dict.fromkeys(found))


def holds(model: Compiled) -> bool:
    """Whether tangents of all bodies take stresses of another state."""
    return all(term.holds for term in model.terms if not term.follows)


def elastic(model: Compiled, state: np.ndarray) -> csr_array:
    """Elastic tangent K (n, n) of the reference with the stresses of a state (n,).

    What bends before it buckles turns its stiff directions: the tangent of the state has the first
    power of these turns, and without the second they look like a loss of stiffness. Where laws hold
    no stresses there is only that one.
    """
    x, held = (model.system.x0, (state, ALL)) if holds(model) else (state, None)
    return csr_array(compiled.elastic_tangent(model, x, 0.0, held))


def move(
    model: Compiled, at: Equilibrium, solved: saddle.Saddle, rows: np.ndarray, probe: float
) -> tuple[np.ndarray, np.ndarray]:
    """By how much an equilibrium moves with the load factor: u (n,) and multipliers (m,), from
    factors of its tangent.

        [K0 J^T; J 0] (u, l) = - dG/dfactor                  G of the forces and the independent `rows` of the joints

    The state stays: all that does not change with the loads is alike to the last digit on both
    sides of the quotient.
    """
    n = len(at.x)
    found = np.zeros(len(at.x) + len(at.multipliers))
    before, after = (
        compiled.residual(
            pressure.at_load_factor(model, factor), at.x, at.multipliers, factor, at.memory
        )
        for factor in (-probe, probe)
    )
    kept = np.append(np.arange(n), n + rows)
    found[kept] = saddle.solve(solved, (before - after)[kept] / (2.0 * probe))
    return found[:n], found[n:]


def soften(
    model: Compiled, at: Equilibrium, path: tuple[np.ndarray, np.ndarray], probe: float, wide: float
) -> csr_array:
    """K1 (n, n), by which the tangent changes with the load factor k along the path (n,), (m,) of
    an equilibrium.

        K1 = dK/dk

    Quotients of states up to `wide` away: loads of a hundredth of those that buckle move a stiff
    structure by a millionth of its size, and its strains then have six digits less than positions.
    Loads are `probe` of those given at most.
    """
    largest = float(np.abs(path[0] / scale_of(model.system)).max())
    way = wide / largest if largest else probe
    near = min(way, probe)
    far = max(way, probe)
    still = pressure.at_load_factor(model, 0.0)
    change = (elastic(still, at.x + far * path[0]) - elastic(still, at.x - far * path[0])) / (
        2.0 * far
    )
    if pressure.present(model.system):
        sides = [elastic(pressure.at_load_factor(model, factor), at.x) for factor in (near, -near)]
        change = change + (sides[0] - sides[1]) / (2.0 * near)
    forces = [
        compiled.probe_tangent(
            model, at.x + one * path[0], at.multipliers + one * path[1], one, 0.0, at.memory, None
        )
        for one in (near, -near)
    ]
    return csr_array(change + (forces[0] - forces[1]) / (2.0 * near))


def predict_buckling(model: Compiled, count: int, probe: float, wide: float) -> BucklingModes:
    """Buckling of a system over the load factor, with K1 from quotients over `probe` of the loads,
    or states `wide` away.
    """
    system = model.system
    n = model.system.size
    still = pressure.at_load_factor(model, 0.0)
    at = newton_statics(still, unloaded(model), Newton(STATIC), 0.0, "load factor")
    J = compiled.gap(model, system.x0, 0.0)[1]
    rows = ranks.independent_rows(J, units=scale_of(system))
    J = J[rows]
    others = csr_array(system.stiffness) + compiled.probe_tangent(
        model, at.x, at.multipliers, 0.0, 0.0, at.memory, None
    )
    K0 = csr_array(elastic(still, at.x) + others)
    # Arnoldi's method finds all but two
    most = n - len(J) if n <= SMALL else min(n - len(J), n - 2)
    if most < 1:
        raise InputError(
            say(
                "buckling",
                "a system that can move",
                "one whose joints leave no motion",
                "release a joint",
            )
        )
    if not 1 <= count <= most:
        raise InputError(say("buckling, count", f"1 to {most}", count))

    def factored(K: Array) -> saddle.Saddle:
        found = saddle.factor(saddle.matrix(csr_array(K), J), rows=len(J))
        if found is None:
            raise InputError(
                say(
                    "buckling",
                    "a system that its joints hold",
                    "one that is free to move",
                    "hold it by joints",
                )
            )
        return found

    factors = tangent = factored(K0)
    if not np.array_equal(at.x, system.x0) and holds(model):
        # stresses that are there without loads have moved the state: strains along the path are
        # those of its own tangent
        tangent = factored(csr_array(compiled.elastic_tangent(still, at.x, 0.0, None)) + others)
    path = move(model, at, tangent, rows, probe)
    K1 = soften(model, at, path, probe, wide)

    def solved(f: np.ndarray) -> np.ndarray:
        return saddle.solve(factors, np.append(f, np.zeros(len(J))))[:n]

    def product(v: np.ndarray) -> np.ndarray:
        return -solved(K1 @ v)

    first = product(np.cos(np.arange(n)))
    if not np.linalg.norm(first) > 0.0:
        raise InputError(say("buckling", "loads that change the stiffness", "none", "add a load"))
    if n <= SMALL:
        inverses, vectors = eig(np.array([product(column) for column in np.eye(n)]).T)
    else:
        inverses, vectors = eigs(
            LinearOperator((n, n), matvec=product, dtype=float), min(4 * count + 4, n - 2), v0=first
        )
    size = np.abs(inverses)
    real = np.flatnonzero((np.abs(inverses.imag) <= REAL * size) & (size > FOUND * size.max()))
    # of two factors that differ by their sign the positive one comes first
    order = np.abs(inverses[real]) * (1.0 + REAL * (inverses[real].real > 0.0))
    kept = real[np.argsort(-order, kind="stable")][:count]
    shapes = largest_one(vectors[:, kept].real)
    skew = np.linalg.norm(solved(K1 @ first - K1.T @ first)) > POTENTIAL * np.linalg.norm(
        product(first)
    )
    stiffness = np.einsum("ni,ni->i", shapes, np.asarray(K0 @ shapes))
    return BucklingModes(1.0 / inverses[kept].real, shapes, stiffness, path[0], not skew)
