r"""Buckling loads predicted from the stiffness that loads add.

    (K0 + k K1) v = 0,   K1 = dK/dfactor at no load

with K the tangent of forces and joints along the equilibria of small loads.
Source: de Borst, Crisfield, Remmers and Verhoosel, Non-Linear Finite Element Analysis of Solids and Structures, Wiley 2012, ch. 4.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eig
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigs

from ...bodies.vectors import ALL
from ...core.algebra import ranks, saddle
from ...core.errors import InputError, listed, say
from ...core.storage.records import dataclass
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

# three factors of a strip agree to 3e-8 with half, twice and ten times of either: K1 is a difference of what is nearly linear
FIRST, PROBE = 1e-3, 1e-2  #: loads of the difference quotient: a part of those given, then of those that buckle
POTENTIAL = 1e-6  #: part of K1 that is not symmetric, on a motion that the joints allow, of loads with a potential
PROPORTIONAL = 1e-9  #: of a history: how far one may be from a multiple of t that is one
# Beck's column has no factor: what two probes gave for it were 3.3e6 and -380
AGREE = 1e-2  #: by which a factor of loads without a potential may change with the probe: others are round-off
# of loads without a potential double factors part into pairs: those of a shaft under thrust and twist by 7e-7 at L/h = 1000, by
# 6e-4 at 10 000; with 1e-6 its factor of 1 was lost, and one of 155 000 found
REAL = 1e-3  #: imaginary parts of load factors, relative to their size, that are round-off
FOUND = (
    1e-10  #: of the largest inverse of a factor: smaller ones are round-off (1e-14 to 1e-17 of it) of motions that no load softens
)


@dataclass(frozen=True)
class BucklingModes:
    """Where the predicted stiffness is singular: (K0 + k K1) v = 0, for load factors k (i,) and shapes v (n, i).

    A structure buckles at `factors[0]` times its loads, as far as its equilibria are on a straight path up to there.
    """

    factors: np.ndarray  #: (i,) of the loads of the system, by their size; negative ones for reversed loads
    shapes: np.ndarray  #: (n, i) of largest entry 1
    stiffness: np.ndarray  #: (i,) v^T K0 v of the shapes
    path: np.ndarray  #: (n,) by which the state changes with the load factor, of small loads
    conservative: bool  #: whether the loads have a potential: others may let motions grow before


def buckling(system: System, count: int = 1, time: float = 1.0) -> BucklingModes:
    """The `count` load factors of least size at which K0 + k K1 is singular.

    The factor 1 stands for the loads at `time` [s] as in `solve_statics`; K1 is taken from loads of a hundredth of the least one.
    Loads without a potential may have no factor: theirs count only where loads of twice the size predict the same, as do those of
    laws of one's own and of polynomials. Exact where equilibria lie on a straight path, as in a column; what a structure bends
    before is left out, as small beside its size; `follow_path` finds what happens.
    InputError where loads never take the stiffness away, do not change it or not grow in proportion, or the system is free to move.
    """
    if uneven := uneven_histories(system, time):
        got = f"another history of {listed(uneven)} up to t = {time:g} s"
        raise InputError(
            say("buckling", "loads and drives in proportion to t", got, "leave it out: they then grow with the factor")
        )
    model, probe = compile_system(without_redundant(ramp(system, time))), FIRST
    if free := find_free(model.system, linearise(model.system)).names:
        raise InputError(say("buckling", "a system that its joints hold", "; ".join(free), "hold it by joints"))
    for _ in range(2):
        found = predict_buckling(model, count, probe)
        if not found.conservative or not holds(model):
            found = common(found, predict_buckling(model, count, 2.0 * probe))
        if not len(found.factors):
            bends = found.conservative and not holds(model)
            none = "it bends before: use `follow_path`" if bends else "look at `complex_modes` for flutter"
            raise InputError(say("buckling", "loads at which the system loses its stiffness", "none", none))
        probe = PROBE * float(abs(found.factors[0]))
    return found


def common(one: BucklingModes, other: BucklingModes) -> BucklingModes:
    """What `one` predicts and `other`, of loads of another size, too."""
    same = np.isclose(one.factors[:, None], other.factors, rtol=AGREE, atol=0.0).any(axis=1)
    return replace(one, factors=one.factors[same], shapes=one.shapes[:, same], stiffness=one.stiffness[same])


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


def stressed(model: Compiled, found: Equilibrium, factor: float) -> csr_array:
    """K (n, n) of the reference with the stresses of an equilibrium, and of all forces there.

    What bends before it buckles turns its stiff directions: the tangent of the equilibrium has the first power of these turns, and
    without the second they look like a loss of stiffness. Where laws hold no stresses there is only that one.
    """
    x, held = (model.system.x0, (found.x, ALL)) if holds(model) else (found.x, None)
    K = csr_array(compiled.elastic_tangent(model, x, 0.0, held)) + csr_array(model.system.stiffness)
    return csr_array(K + compiled.probe_tangent(model, found.x, found.multipliers, factor, 0.0, found.memory, None))


def predict_buckling(model: Compiled, count: int, probe: float) -> BucklingModes:
    """Buckling of a system over the load factor, with K1 from the equilibria at the factors `probe` and -`probe`."""
    system, n = model.system, model.system.size
    start, sides, states = unloaded(model), [], []
    for factor in (probe, -probe):
        loaded = pressure.at_load_factor(model, factor)
        found = newton_statics(loaded, start, Newton(STATIC), factor, "load factor")
        states.append(found.x)
        sides.append(stressed(loaded, found, factor))
    J = compiled.gap(model, system.x0, 0.0)[1]
    J = J[ranks.independent_rows(J, units=scale_of(system))]
    K0, K1 = 0.5 * (sides[0] + sides[1]), (sides[0] - sides[1]) / (2.0 * probe)
    most = n - len(J) if n <= SMALL else min(n - len(J), n - 2)  # Arnoldi's method finds all but two
    if most < 1:
        raise InputError(say("buckling", "a system that can move", "one whose joints leave no motion", "release a joint"))
    if not 1 <= count <= most:
        raise InputError(say("buckling, count", f"1 to {most}", count))
    if (solved := saddle.constrained(K0, J)) is None:
        raise InputError(say("buckling", "a system that its joints hold", "one that is free to move", "hold it by joints"))

    def product(v: np.ndarray) -> np.ndarray:
        return -solved(K1 @ v)

    first = product(np.cos(np.arange(n)))
    if not np.linalg.norm(first) > 0.0:
        raise InputError(say("buckling", "loads that change the stiffness", "none", "add a load"))
    if n <= SMALL:
        inverses, vectors = eig(np.array([product(column) for column in np.eye(n)]).T)
    else:
        inverses, vectors = eigs(LinearOperator((n, n), matvec=product, dtype=float), min(4 * count + 4, n - 2), v0=first)
    size = np.abs(inverses)
    real = np.flatnonzero((np.abs(inverses.imag) <= REAL * size) & (size > FOUND * size.max()))
    # of two factors that differ by their sign the positive one comes first
    order = np.abs(inverses[real]) * (1.0 + REAL * (inverses[real].real > 0.0))
    kept = real[np.argsort(-order, kind="stable")][:count]
    shapes, path = largest_one(vectors[:, kept].real), (states[0] - states[1]) / (2.0 * probe)
    skew = np.linalg.norm(solved(K1 @ first - K1.T @ first)) > POTENTIAL * np.linalg.norm(product(first))
    stiffness = np.einsum("ni,ni->i", shapes, np.asarray(K0 @ shapes))
    return BucklingModes(1.0 / inverses[kept].real, shapes, stiffness, path, not skew)
