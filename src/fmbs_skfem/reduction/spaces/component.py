"""Components, one body or several that share a basis: their coordinates, mass, and the linear
constraints inside them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import csr_array, diags_array

from ...core.algebra import ranks
from ...core.algebra.linalg import distinct
from ...core.errors import InputError, say
from ...core.notices import notify
from ...core.values.arguments import checked
from ...systems import lengths
from ...systems.system import System, linear_part, project
from ...systems.terms import elastic as terms
from . import pod

REST = 1e-11  #: displacement, over the size of the mechanism, up to which it is at rest: snapshots are known to 1e-12 and better


def require_body_coordinates(where: str, system: System) -> None:
    """InputError for a system that is in other unknowns than the coordinates of its bodies."""
    last = max((last for _, _, last in system.coordinates), default=0)
    if last != system.size:
        remedy = "give the one of `assemble`, before `eliminate`"
        raise InputError(
            say(
                where,
                f"a system in its {last} body coordinates",
                f"one in {system.size} unknowns",
                remedy,
            )
        )


@checked
def system_level(system: System) -> dict[str, tuple[str, ...]]:
    """One component, `system`, that holds all bodies: {component: names of bodies}.

    All bodies share one basis, so that linear joints between them are constraints inside of a
    component, which vanish.
    """
    return {"system": tuple(name for name, _, _ in system.coordinates)}


@checked
def body_level(system: System) -> dict[str, tuple[str, ...]]:
    """Every body a component of its own: {component: names of bodies}.

    Joints between bodies then keep their rows in the reduced model, or are eliminated where they
    are linear and the plan says so.

        >>> import numpy as np
        >>> from fmbs_skfem import reduction, systems
        >>> from fmbs_skfem.bodies import point_mass
        >>> pair = systems.assemble([point_mass(name, 1.0, np.zeros(2)) for name in "ab"])
        >>> reduction.body_level(pair), reduction.system_level(pair)
        ({'a': ('a',), 'b': ('b',)}, {'system': ('a', 'b')})
    """
    return {name: (name,) for name, _, _ in system.coordinates}


def rows_of(system: System, bodies: Sequence[str]) -> np.ndarray:
    """Numbers (n,) in q of the coordinates of some bodies; InputError for none and for bodies that
    are not there.

    In the order in which the bodies are named, those of each body together.
    """
    spans = {name: np.arange(first, last) for name, first, last in system.coordinates}
    missing = [name for name in bodies if name not in spans]
    if missing or not bodies:
        raise InputError(
            say("reduction.components", f"bodies among {', '.join(spans)}", missing or "none")
        )
    return np.concatenate([spans[name] for name in bodies])


def check_components(system: System, components: Mapping[str, Sequence[str]]) -> None:
    """Every body belongs to exactly one component.

    InputError for bodies that are missing, unknown, or in several components.
    """
    members = [name for part in components.values() for name in part]
    known = [name for name, _, _ in system.coordinates]
    if sorted(members) != sorted(known):
        raise InputError(
            say(
                "reduction.components",
                f"every body of {', '.join(known)} in exactly one",
                f"{', '.join(members)}",
            )
        )


def is_rigid(system: System, members: Sequence[str]) -> bool:
    """Whether none of these bodies deforms.

    A body deforms where the system has an elastic term of its name.
    """
    return not {elastic.name for elastic in system.elastic} & set(members)


def metric_of(system: System, rows: np.ndarray) -> csr_array:
    """The metric of some coordinates (n, n): modes are orthonormal in it, singular values lengths.

        u^T W_bb u / w

    is a mean square displacement [m2], with the metric W and the mass w of a full system. `rows`
    are numbers (n,) in q. Directors of a beam hold its section and its shear, however thin it is,
    and their small mass says nothing of them: the n coefficients of each count together as a
    displacement of the beam by its size, as in `parts.bodies.metric`.
    """
    added = director_masses(system)
    if not added.any():
        return csr_array(csr_array(system.metric)[rows][:, rows] / system.weight)
    lone = csr_array(system.metric - system.mass).diagonal()  # of what has no mass
    mass = csr_array(system.mass)[rows][:, rows]
    return csr_array((mass + diags_array(np.where(added > 0.0, added, lone)[rows])) / system.weight)


def mass_of(system: System, rows: np.ndarray) -> csr_array | None:
    """The mass of some coordinates over that of all bodies (n, n), where `metric_of` is another
    one; None elsewhere.

    eps holds in both, since a bar that is twisted far may bend little: what is small to the size of
    its turns is not to be lost.
    """
    return (
        csr_array(csr_array(system.mass)[rows][:, rows] / system.weight)
        if director_masses(system)[rows].any()
        else None
    )


def director_masses(system: System) -> np.ndarray:
    """What directors of full beams weigh, a diagonal (q,) [kg m2].

        m L^2 / n

    of a beam of mass m, size L and n functions; else 0.
    """
    found = np.zeros((len(system.unit), system.dim))
    dim = system.dim
    beams = [one for one in system.elastic if one.gather.law.fields > 1]
    if not beams:
        return found.ravel()
    mass = csr_array(system.mass)[::dim, ::dim]
    places = system.x0.reshape(-1, dim)
    for elastic in beams:
        mine = np.asarray(terms.functions_read(elastic.gather, len(found)).sum(axis=0)) > 0.0
        centre = mine & (system.unit != 0.0)
        size = lengths.spread(places[centre])
        found[mine & ~centre] = (
            float(centre @ (mass @ centre)) * size**2 / max(1, int(centre.sum()))
        )
    return found.ravel()


def inner_constraints(system: System, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear constraints that touch the given coordinates only: A (m, rows), a (m,).

        A q + a = 0

    Nonlinear rows, and those of time, are not among them.
    """
    _, A, a = linear_part(system)
    mine = np.setdiff1d(np.arange(A.shape[0]), touched_outside(A, rows))
    return A[mine][:, rows].toarray(), a[mine]


def touched_outside(A: object, rows: np.ndarray) -> np.ndarray:
    """Numbers (k,) of the rows of A (m, n) with entries outside the given coordinates (j,).

    A is sparse, `rows` are the numbers of the given coordinates.
    """
    entries = A.tocoo()  # type: ignore[attr-defined]
    return distinct(entries.row[~np.isin(entries.col, rows)])


def is_resting(system: System, displacement: float) -> bool:
    """Whether a displacement [m] is one of Newton's tolerance alone.

    That is, at most 1e-11 of the size of the system.
    """
    return displacement <= REST * system.scale


def any_motion(A: np.ndarray) -> np.ndarray:
    """A displacement (n, 1) of which bases of components at rest are made: they need a direction.

        A q = 0

    A (m, n); it is random, always the same.
    """
    return satisfy(np.random.default_rng(0).normal(size=(1, A.shape[1])), A, np.zeros(len(A))).T


def refuse_rest(
    system: System, components: Mapping[str, Sequence[str]], displacements: Mapping[str, float]
) -> None:
    """InputError where nothing moves, by the largest displacements [m] of components; a notice of
    flexible ones that do not.

    Rigid ones have all directions in their bases, and may move where they did not.
    """
    resting = [name for name, size in displacements.items() if is_resting(system, size)]
    flexible = [name for name in resting if not is_rigid(system, components[name])]
    if flexible and len(resting) == len(displacements):
        remedy = "give it loads, an initial motion or a longer duration; `fmbs reduce` excites inputs that have a `range`"
        raise InputError(
            say("training", "a motion", "none: nothing moves in the training run", remedy)
        )
    if flexible:
        listed = " and ".join(
            f"'{name}' (moves by {displacements[name]:.1g} m)" for name in flexible
        )
        notify(
            f"at rest in the training, and in the reduced model: {listed}; give it loads there if it is to move"
        )


def satisfy(q: np.ndarray, A: np.ndarray, a: np.ndarray) -> np.ndarray:
    """The states (s, n) nearest to q that satisfy linear constraints.

        q - A^+ (A q + a)

    with A (m, n), a (m,) and the pseudoinverse A^+: nearest in the Euclidean norm. Without rows q
    itself.
    """
    return q - ranks.least(A, (q @ A.T + a).T).T if len(a) else q


def all_directions(W: csr_array, A: np.ndarray) -> np.ndarray:
    """Modes U (n, r) of all q that A (m, n) allows, orthonormal in the metric W (n, n).

        A U = 0,    U^T W U = 1

    The null space of A, as many modes as unknowns n less its rank: of rigid bodies nothing is left
    out.
    """
    return np.ascontiguousarray(pod.left_singular(W, ranks.null_space(A))[0])


def rigid_directions(system: System, rows: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Directions (n, k) of the rigid bodies alone, among coordinates (n,), that A (m, n) allows.

        A q = 0

    `rows` (n,) are the numbers in q of the coordinates. Rows of A that read other bodies as well
    count with what they read of rigid ones.
    """
    deforming = {elastic.name for elastic in system.elastic}
    spans = [
        np.arange(first, last) for name, first, last in system.coordinates if name not in deforming
    ]
    mine = np.flatnonzero(np.isin(rows, np.concatenate([np.zeros(0, np.int64), *spans])))
    own = A[np.abs(A[:, mine]).any(axis=1)][:, mine]
    free = ranks.null_space(own) if len(own) else np.eye(len(mine))
    found = np.zeros((len(rows), free.shape[1]))
    found[mine] = free
    return found


def projected(system: System, q: np.ndarray) -> np.ndarray:
    """Unknowns x (s, n) of a reduced system nearest to body coordinates (s, q).

        x = argmin |V x + qbar - q|

    by `systems.project`, V and qbar being the lift of the system.
    """
    return np.ascontiguousarray(project(system.lift.matrix, (q - system.lift.offset).T).T)
