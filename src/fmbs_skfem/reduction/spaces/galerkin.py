r"""Bases per component, Galerkin projection, and the reduction of constraints.

    q^b = U^b xi^b + qbar^b,    sum_b U^bT (F + M q'' + Q + Phi_q^T lambda) = 0                                          (18), (21)

A component is one body or several that share a basis; one component with all bodies is the system
level. Constraints fall into three classes (section 3.3 of the source), decided by structure and by
the motion, never by the size of a number:

1. linear, independent of time, inside one component: every snapshot satisfies them, they vanish and are dropped;          (24)-(28)
2. linear, independent of time, between components: eliminated, xi = T y + d, or kept with multipliers;                    (29)-(36)
3. all others are kept but those that depend on others in the reduced space, and those that lock it
(`kept_rows`).

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from ...core.algebra.linalg import as_dense
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values import arrays
from ...core.values.arguments import checked
from ...dynamics.outputs import body_coordinates
from ...dynamics.trajectory import Trajectory
from ...systems.affine import Matrix
from ...systems.connections.redundancy import scale_of
from ...systems.system import (
    System,
    change_coordinates,
    is_linear,
    keep_constraints,
    linear_part,
    loose_rows,
)
from ..plan import ModeCounts, modes_of
from . import component, kept_rows, pivots, pod
from . import invariant as vectors
from .component import (
    all_directions,
    any_motion,
    check_components,
    inner_constraints,
    is_resting,
    is_rigid,
    mass_of,
    metric_of,
    refuse_rest,
    rigid_directions,
    rows_of,
    satisfy,
)
from .pod import Basis

COARSEST = 0.5  #: eps of components at rest: the fewest modes that there are
OPENED = 1e-8  #: of the largest entries of a row and of the modes, from which these open it; of rows that they keep it is 1e-14
ROUND = 1e-13  #: entry beside the diagonal, relative to the largest of all, that is round-off
APART = 1e-9  #: part of a mode that is none of rigid bodies alone, from which it is a direction of its own


@dataclass(frozen=True)
@checked
class Snapshots:
    """States of a full model at training times.

    q (s, q) are all coordinates of the full bodies, before joints are eliminated: positions [m],
    slopes and axes [-].
    """

    times: np.ndarray  #: (s,)
    q: np.ndarray  #: (s, q) body coordinates


@checked
def snapshots(trajectory: Trajectory, interval: float | np.ndarray | None = None) -> Snapshots:
    """Body coordinates (s, q) every `interval` [s], or at the times (s,) [s] listed there; all
    stored ones by default.

    InputError where states were not stored at these times.

        >>> import numpy as np
        >>> from fmbs_skfem import dynamics, reduction, systems
        >>> from fmbs_skfem.bodies import point_mass
        >>> rest = systems.assemble([point_mass("ball", 2.0, np.ones(2))])
        >>> motion = dynamics.integrate(rest, dynamics.GeneralizedAlpha(0.01), 0.1)
        >>> reduction.snapshots(motion, 0.05).q.tolist()
        [[1.0, 1.0], [1.0, 1.0], [1.0, 1.0]]
    """
    times = trajectory.times
    if interval is None:
        picked = np.arange(len(times))
    elif isinstance(interval, np.ndarray):
        picked = find_places(times, interval)
    else:
        step = times[1] - times[0]
        stride = round(interval / step)
        if not 1 <= stride < max(2, len(times)) or abs(stride * step - interval) > 1e-6 * interval:
            raise InputError(
                say(
                    "reduction.snapshots",
                    f"a multiple of the stored interval {step:.6g} s",
                    f"{interval} s",
                )
            )
        picked = np.arange(0, len(times), stride)
        # the last state may stand closer
        picked = picked[np.abs(times[picked] - interval * np.arange(len(picked))) <= 1e-3 * step]
    return Snapshots(times[picked], body_coordinates(trajectory.part(picked)))


def find_places(times: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Where (k,) wanted times [s] stand among stored ones (s,) [s]; the interval between them tells
    round-off from a wrong time.

    InputError for no times, and for one at which no state is stored.
    """
    near = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    near = near - (wanted - times[near - 1] < times[near] - wanted)
    apart = np.abs(times[near] - wanted)
    if len(wanted) == 0 or apart.max() > 1e-3 * np.diff(times).min():
        got = "none" if len(wanted) == 0 else f"{wanted[apart.argmax()]:.6g} s"
        raise InputError(
            say(
                "reduction.snapshots",
                "times of stored states",
                got,
                "store the states after these steps",
            )
        )
    return np.asarray(near)


@checked
def bases(
    system: System,
    data: Snapshots,
    components: Mapping[str, Sequence[str]],
    tolerance: float | None = 1e-12,
    modes: ModeCounts = None,
    invariant: bool = False,
) -> dict[str, Basis]:
    """POD basis U^b (n, r) of every component from snapshots (s, q) of `system`, truncated by eps =
    `tolerance` (14) or to `modes`.

        q^b = U^b xi^b + qbar^b,    U^bT W U^b = 1,    eps >= sum_{i>r} s_i^2 / sum_i s_i^2

    Modes are orthonormal in the mass of the component over that of all bodies; the initial state is
    kept in every basis. Snapshots are first projected onto the linear constraints inside the
    component, and modes onto the directions that keep them, so that these constraints vanish to
    round-off however small the last singular value is. Rigid bodies keep all directions of their
    own, also beside flexible ones in a component: there is nothing to save, and joints need them.
    InputError for unknown bodies and where nothing moves; components at rest beside others have the
    fewest modes that there are, and a notice.
    """
    component.require_body_coordinates("bases", system)
    q = arrays.finite(
        data.q, "snapshots", f"states (s, {system.size}) in body coordinates", None, system.size
    )
    found, moved = {}, {}
    for name, members in components.items():
        rows = rows_of(system, members)
        A, a = inner_constraints(system, rows)
        states = satisfy(q[:, rows], A, a)
        start = system.lift(system.x0)[rows]
        W = metric_of(system, rows)
        u = (states - start).T
        moved[name] = float(np.sqrt(np.maximum(np.sum(u * (W @ u), axis=0), 0.0)).max())
        count = modes_of(modes, name)
        wanted = (tolerance if count is None else None, count)
        if is_resting(system, moved[name]):
            u = any_motion(A)
            wanted = (COARSEST, None)
            states = np.vstack([start, start + u.T])
        if is_rigid(system, members):
            found[name] = Basis(all_directions(W, A), start, pod.left_singular(W, u)[1])
            continue
        if invariant:
            found[name] = vectors.basis(system, rows, u, *wanted)
            continue
        basis = pod.basis(states.T, *wanted, keep=start, metric=W, second=mass_of(system, rows))
        found[name] = keeping(system, rows, A, basis)
    refuse_rest(system, components, moved)
    return found


def keeping(system: System, rows: np.ndarray, A: np.ndarray, basis: Basis) -> Basis:
    """A basis of coordinates (n,) whose modes U keep rows A (m, n), and hold all that rigid bodies
    among them do by themselves.

        A U = 0

    Their axes turn far: modes of a training would let them deform, and their joints would not
    close.
    """
    W = metric_of(system, rows)
    modes = pod.orthonormal(W, satisfy(basis.modes.T, A, np.zeros(len(A))).T)
    alone = rigid_directions(system, rows, A)
    if alone.shape[1]:
        first = pod.left_singular(W, alone)[0]
        rest, sizes = pod.left_singular(W, pod.outside(W, modes, first))
        modes = np.ascontiguousarray(np.hstack([first, rest[:, sizes > APART]]))
    return replace(basis, modes=modes)


@dataclass(frozen=True)
class Classes:
    """Constraint rows of a full system by class.

    The numbers are those of the rows in `System.constraints`, of the classes 1 to 3 of the module.
    """

    inside: np.ndarray  #: (k,) linear inside a component, dropped
    linking: np.ndarray  #: (k,) linear between components
    others: np.ndarray  #: (k,) time-dependent or nonlinear


def classify(system: System, components: Mapping[str, Sequence[str]]) -> Classes:
    """The three classes of section 3.3."""
    rows, A, _ = linear_part(system)
    owner = np.zeros(system.size, dtype=int)
    for number, members in enumerate(components.values()):
        owner[rows_of(system, members)] = number
    inside = np.array(
        [len(np.unique(owner[A[[k]].indices])) == 1 for k in range(len(rows))], dtype=bool
    )
    return Classes(rows[inside], rows[~inside], np.flatnonzero(~is_linear(system.constraints)))


@checked
def reduce_system(
    system: System,
    components: Mapping[str, Sequence[str]],
    found: Mapping[str, Basis],
    eliminate: bool = False,
    configurations: np.ndarray | None = None,
) -> System:
    """The reduced system of a full one (with all multipliers), a System again.

        q = V x + qbar,    V = diag(U^b),    V^T (M q'' + F + Q + Phi_q^T lambda) = 0    (21)

    `found` has the basis of every component, `components` names their bodies, each in exactly one.
    `eliminate` removes the linear constraints between components by pivoted columns (33); otherwise
    they keep multipliers. `configurations` (s, q) are states at which dependent rows are looked
    for. InputError where a component has too few modes for the constraints that link it to others,
    or a basis belongs to another model.

        >>> from fmbs_skfem import bodies, dynamics, reduction, systems
        >>> from fmbs_skfem.shapes.meshes import segment
        >>> from fmbs_skfem.systems import At, joints, loads
        >>> beam = bodies.cable("beam", segment(10), bodies.Given(1e5, 0.5, 0.1), dim=2)
        >>> hinge, weight = joints.Pin("hinge", At("beam", "left")), loads.Gravity((0.0, -9.81))
        >>> raw = systems.assemble([beam], [hinge], [weight])
        >>> full = dynamics.integrate(systems.eliminate(raw), dynamics.GeneralizedAlpha(5e-3), 0.5)
        >>> components = reduction.body_level(raw)
        >>> found = reduction.bases(raw, reduction.snapshots(full, 0.01), components, 1e-8)
        >>> small = reduction.reduce_system(raw, components, found)
        >>> small
        <System 6 unknowns, 0 constraints: beam>
        >>> motion = dynamics.integrate(small, dynamics.GeneralizedAlpha(5e-3), 0.5)
        >>> reduction.compare(full, motion).maximum < 1e-2
        True
    """
    component.require_body_coordinates("reduce_system", system)
    check_components(system, components)
    if missing := [name for name in components if name not in found]:
        raise InputError(
            say(
                "reduce_system: found",
                "a basis of every component",
                f"none of {', '.join(missing)}",
            )
        )
    classes = classify(system, components)
    V, mean, spans = block_basis(system, components, found)
    check_interfaces(system, components, found, classes)
    opened = opened_rows(system, V, classes.inside)
    kept = np.sort(
        np.concatenate([classes.linking, moving_rows(system, V, classes.others), opened])
    )
    reduced = replace(
        change_coordinates(keep_constraints(system, kept), V, mean), components=spans, full=None
    )
    reduced = vectors.with_shape_points(
        system, reduced, [(rows_of(system, one), found[k]) for k, one in components.items()]
    )
    reduced = replace(
        reduced, mass=clean_diagonal(reduced.mass), damping=clean_diagonal(reduced.damping)
    )
    if eliminate and len(classes.linking):
        numbers, D, d = linear_part(reduced)
        linking = ~np.isin(numbers, np.searchsorted(kept, opened))
        length = kept_rows.row_lengths(system, reduced)[numbers[linking]]
        D, d = as_dense(D)[linking] / length[:, None], d[linking] / length
        # others follow, or hold for every mode
        apart = pivots.independent_rows([np.column_stack([D, d / system.scale])])
        T, x0 = pivots.eliminate(D[apart], d[apart])
        rest = np.setdiff1d(np.arange(len(reduced.constraints.names)), numbers[linking])
        alike = any(basis.factors is not None for basis in found.values())
        free = change_coordinates(
            keep_constraints(reduced, rest), csr_array(vectors.rounded(T)) if alike else T, x0
        )
        reduced = replace(free, components=(("eliminated", 0, free.size),))
    if configurations is not None and len(reduced.constraints.names):
        samples = kept_rows.sample_rows(
            system, reduced, configurations[:: max(1, len(configurations) // kept_rows.FEW)]
        )
        reduced = keep_constraints(reduced, kept_rows.independent_rows([samples]))
    return reduced


def opened_rows(system: System, V: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Those of the linear rows `inside` (k,) of components that modes V (q, r) open, so that they
    are equations of the modes.
    """
    if not len(inside):
        return inside
    numbers, A, _ = linear_part(system)
    return np.asarray(
        np.sort(inside)[are_moved(system, V, A[np.flatnonzero(np.isin(numbers, inside))])]
    )


def moving_rows(system: System, V: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Those of constraint rows `some` (k,) that read anything which modes V (q, r) move.

    Of others, as of a drive that has not moved, round-off is left: as an equation it would hold
    some combination of all modes, another one on every processor. Rows that events release or lock
    always stay.
    """
    own = system.constraints
    # -1 reads nothing
    moves = np.append(are_moved(system, V, csr_array(system.probes.matrix)), False)
    read = own.row[moves[own.i] | moves[own.j]]
    return some[np.isin(some, read) | ~np.isin(some, own.row) | loose_rows(own)[some]]


def are_moved(system: System, V: np.ndarray, A: csr_array) -> np.ndarray:
    """Whether modes V (q, r) change the values of rows A (m, q) by more than round-off, (m,);
    unknowns count in their units.
    """
    unit = scale_of(system)
    least = (
        OPENED
        * np.abs(V / unit[:, None]).max(initial=0.0)
        * abs(A.multiply(unit)).max(axis=1).toarray().ravel()
    )
    return np.asarray(np.abs(A @ V).max(axis=1, initial=0.0) > least)


def clean_diagonal(A: Matrix) -> Matrix:
    """A matrix (n, n) without round-off beside its diagonal, as the mass of modes that are
    orthonormal in it.

    The diagonal alone where all else is below 1e-13 of its largest entry, else A as it is.
    """
    D = np.diag(np.diag(as_dense(A)))
    return D if np.abs(A - D).max(initial=0.0) <= ROUND * np.abs(D).max(initial=0.0) else A


def block_basis(
    system: System, components: Mapping[str, Sequence[str]], found: Mapping[str, Basis]
) -> tuple[np.ndarray, np.ndarray, tuple[tuple[str, int, int], ...]]:
    """Basis of all components, and where each component's unknowns stand.

        q = V x + mean,    V = diag(U^b)

    V (q, r), mean (q,).
    """
    total = sum(found[name].modes.shape[1] for name in components)
    V = np.zeros((system.size, total))
    mean = np.zeros(system.size)
    spans = []
    first = 0
    for name, members in components.items():
        rows = rows_of(system, members)
        basis = found[name]
        if basis.modes.shape[0] != len(rows):
            got = basis.modes.shape[0]
            raise InputError(
                say(
                    f"component '{name}'",
                    f"a basis with {len(rows)} rows",
                    got,
                    "train it on this model",
                )
            )
        last = first + basis.modes.shape[1]
        V[rows, first:last], mean[rows] = basis.modes, basis.mean
        spans.append((name, first, last))
        first = last
    return V, mean, tuple(spans)


def check_interfaces(
    system: System,
    components: Mapping[str, Sequence[str]],
    found: Mapping[str, Basis],
    classes: Classes,
) -> None:
    """A component needs more modes than constraints that link it to others; a rigid one with axes
    needs all that there are.

    Rows that keep axes orthonormal leave a few modes no way to move, or one that round-off makes:
    five modes of a box that tumbles went on or failed by the last digit of its training.
    """
    framed = {
        name.partition(".")[0]
        for name, label in system.constraints.names
        if kept_rows.is_frame((name, label))
    }
    rows, A, _ = linear_part(system)
    linking = A[np.flatnonzero(np.isin(rows, classes.linking))]
    for name, members in components.items():
        links = (
            int((abs(linking[:, rows_of(system, members)]).sum(axis=1) > 0).sum())
            if linking.shape[0]
            else 0
        )
        modes = found[name].modes.shape[1]
        if is_rigid(system, members) and framed & set(members):
            own = rows_of(system, members)
            wanted = all_directions(
                metric_of(system, own), inner_constraints(system, own)[0]
            ).shape[1]
            if modes < wanted:
                remedy = "take its basis from `reduction.bases`"
                raise InputError(
                    say(
                        f"component '{name}'",
                        f"all {wanted} directions of its rigid bodies",
                        f"{modes} modes",
                        remedy,
                    )
                )
        if links and modes <= links and not is_rigid(system, members):
            raise InputError(
                say(
                    f"component '{name}'",
                    f"more than {links} modes for its {links} constraints to other components",
                    f"{modes} modes",
                    "a basis too small for the interface constraints; lower the tolerance",
                )
            )
