r"""What a reduced part misses in a run: the displacement along shapes that it lacks, from the residual there with inertia.

    e = |K_N|^-1 R_N,    R_N = N^T (f(S z) + M S (z'' + alpha z') - M 1 g),    K_N = N^T f'(S z) N,    N^T W N = 1     (1)

N are combinations of the functions F = [S, T] of the part (`bodies.missing_shapes`) that vanish where joints and loads act, so that
no force of theirs is in R_N, and are orthogonal in the mass to those of S that vanish there, on which the part is in equilibrium.
|e| [m] is the root mean square of the displacement that is missing, to first order; a part is outside where it is larger than
BAND times what its shape functions left out of its training. It is the gappy norm (39) of the residual, as the indicator (49) has
it, on few functions. Stiffness-proportional damping acts on e as on S z, beta (f' z' + K_N e'), and is left out of both.

In motions |K_N| is that of the start, turned with the part, where it says less than SURE of the limit: it costs nothing there, and
makes e too large by a few times rather than too small.

A displacement can be small and stiff: a plate that bends by its thickness stretches where functions cannot follow it, and hardly
bends any more. The measure of that is the part of itself by which a part bends too little, at least,

    sum R_N^T |K_N|^-1 (2 f_N - R_N) / (2 sum U),    f_N = N^T f(S z),    U the strain energy,                                  (4)

sums over the looks of a motion: the strain energy that the missing displacement sets free. What loads would do along it instead,
as weight does along an arm, adds to the energy, and moves the part by e alone. In equilibria R_N^T |K_N|^-1 R_N stands above, of
small displacements the work of the loads that is missing. A motion feels (4) where this share of the deflection, the distance from
where it began up to a rigid motion, is more than FELT of the size of the part.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, equations (39), (49), doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csc_array, csr_array

from ..bodies import laws
from ..bodies.body import Body, ShapePoints
from ..bodies.laws import Law
from ..core import ranks
from ..core.linalg import as_dense, evenly
from ..core.notices import notify, remark
from ..core.records import dataclass
from ..core.rotations import nearest
from ..systems.shape_points import modulus_times_functions
from ..systems.system import Elastic, Matrix, System, remembered

if TYPE_CHECKING:
    from .buckling import BucklingModes

KIND = "missing displacement [m]"
BAND = 2.0  #: displacement that is missing, over what the training left out, from which a part is outside
SURE = 0.25  #: part of the limit up to which the stiffness of the start is good enough to say what is missing
LOOKS = 6  #: states of a run that are looked at, evenly in time
LIMP = 1e-9  #: least stiffness that counts, over the largest one: a cable without tension has none across
COARSE = 1e-2  #: part of itself by which a frequency or load factor is too high, or (4), from which a warning is shown
FELT = 5e-5  #: (4) of the deflection of a motion, over the size of the part, from which it counts
REST = 1e-12  #: displacement over the size of a body, with which its energy is round-off
HOLD = "hold the mechanism once against full bodies (fmbs part check)"
SHOWN = 3  #: names of parts that a message lists
REMEDY = "train them on such motions, or with moments where they are clamped (fmbs part train --alone)"
FINER = "or take more of their shape functions (a smaller tolerance)"
UNKNOWN = "they know none, `fmbs part info` says why"
REDUCED, FORCED = "they are reduced further", "forces act along them that are no weight"
APART, HELD = "joints or loads act elsewhere than at their places", "joints and loads act on all shapes that they know"
TURNED = 1e-6  #: part of a row by which it reads directions of a place
ELSEWHERE = 1e-8  #: part of a row, over its size, by which a joint or load acts elsewhere than at a place


@dataclass(frozen=True)
class Tests:
    """The test functions N (t) of a part in a system, with its law, loads and damping; copies that are held alike share them."""

    law: Law
    own: np.ndarray  #: (k, g, b) derivatives of S at all points
    table: np.ndarray  #: (k, g, t) derivatives of N
    section: np.ndarray  #: (i, 1, g)
    size: float  #: of the body, the diagonal of its box [m]
    mass: np.ndarray  #: (t, b) N^T M S [kg]
    weight: np.ndarray  #: (t, c) N^T M 1 g [N]
    alpha: float  #: damping by mass [1/s]
    metric: np.ndarray  #: (b, b) S^T W S
    constant: np.ndarray  #: (b,) coordinates of the constant field 1
    begin: np.ndarray  #: (b, c) coordinates where the system begins, about their mean
    start: np.ndarray  #: (k c, 1, g) gradients there
    limit: float  #: of |e|, from which the part is outside [m]

    @cached_property
    def held(self) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues and vectors of |K_N| where the system begins."""
        return stiffness(self, self.start)


def looked_at(states: int) -> np.ndarray:
    """Numbers of the states that are looked at, of so many: evenly, without the first one, whose acceleration no step has found."""
    return evenly(min(1, states - 1), states - 1, LOOKS)


def shape_points(elastic: Elastic) -> ShapePoints | None:
    """The points of a body that is reduced by shape functions; None of others."""
    return elastic.gather if isinstance(elastic.gather, ShapePoints) else None


def trained_parts(system: System) -> list[Elastic]:
    """The reduced bodies that know the strains of their training."""
    return [one for one in system.elastic if (points := shape_points(one)) is not None and points.trained.size]


def tests(system: System, elastic: Elastic) -> Tests | None:
    """Those of a part that knows shapes that it lacks; None of others, and where something acts elsewhere than at its places."""
    found = examined(system, elastic)
    return found if isinstance(found, Tests) else None


def examined(system: System, elastic: Elastic) -> Tests | str:
    """The test functions of a part, or why there are none."""
    if shape_points(elastic) is None:
        return UNKNOWN
    return remembered(system, (KIND, elastic.name), lambda: find_tests(system, elastic))


def tell_unknown(system: System) -> None:
    """A remark of trained parts of which nothing can be said, by the reason."""
    silent: dict[str, list[str]] = {}
    for one in trained_parts(system):
        if isinstance(why := examined(system, one), str):
            silent.setdefault(why, []).append(f"'{one.name}'")
    for why, names in silent.items():
        remark(f"parts {first_of(names)}: nothing can be said of shapes that they lack, as {why}; {HOLD}")


def first_of(names: list[str]) -> str:
    """The first names of a list, and how many there are."""
    return ", ".join(names[:SHOWN]) + (f" ... ({len(names)} in all)" if len(names) > SHOWN else "")


def lacking(system: System) -> list[tuple[ShapePoints, str, Tests]]:
    """Parts that know shapes that they lack, by their points, names and test functions."""
    known = ((one.gather, one.name, tests(system, one)) for one in system.elastic)
    return [(points, name, functions) for points, name, functions in known if functions is not None]


def find_tests(system: System, elastic: Elastic) -> Tests | str:
    """As `examined`, found anew."""
    points: ShapePoints = elastic.gather
    missing, whole, dim = points.missing, system.full or system, points.dim
    if missing is None or whole.size != len(whole.lift.offset):
        return UNKNOWN if missing is None else REDUCED
    columns = points.columns
    mass, damping, springs = (block(A, columns) for A in (whole.mass, whole.damping, whole.stiffness))
    alpha = float(np.trace(damping) / np.trace(mass))
    one, constant = system.unit[columns.start // dim : columns.stop // dim], whole.loads.constant[columns].reshape(-1, dim)
    weight, total = mass[::dim, ::dim] @ one, float(one @ mass[::dim, ::dim] @ one)
    g = weight @ constant / (weight @ weight)
    others = (springs, damping - alpha * mass, constant - np.outer(weight, g))
    sizes = (mass, damping, constant)
    if any(np.abs(A).max() > ELSEWHERE * np.abs(B).max() for A, B in zip(others, sizes, strict=True)):
        return FORCED
    probes = rows_on(whole, columns)
    held = (KIND, id(missing.rows), probes.tobytes(), weight.tobytes())
    acting, _ = remembered(system, held, lambda: rows_that_act(points, probes, weight))
    if acting is None:
        return APART
    shared = (points.law, *(id(part) for part in (missing.functions, missing.section, missing.mass)), total, alpha)
    key = (KIND, shared, acting.tobytes(), g.tobytes())
    start = whole.lift(whole.x0)[columns].reshape(-1, dim)
    return remembered(system, key, lambda: functions_of(points, acting, total, alpha, g, one, start))


def block(A: Matrix, columns: slice) -> np.ndarray:
    """Rows and columns of a body (b c, b c) of a matrix (n, n); of sparse ones by their entries, as copies are many."""
    n, first = columns.stop - columns.start, columns.start
    if not isinstance(A, csr_array):
        return as_dense(A[columns, columns])
    found, (rows, at, values) = np.zeros((n, n)), entries_of(A, columns)
    inside = (at >= first) & (at < columns.stop)
    np.add.at(found, (rows[inside], at[inside] - first), values[inside])
    return found


def rows_on(system: System, columns: slice) -> np.ndarray:
    """Probe rows (j, b c) that read a body."""
    whole = remembered(system, "probes by columns", lambda: csc_array(system.probes.matrix))
    at, read, values = entries_of(whole, columns)
    rows, place = np.unique(read, return_inverse=True)
    found = np.zeros((len(rows), columns.stop - columns.start))
    np.add.at(found, (place, at), values)
    return found


def entries_of(A: csr_array | csc_array, lines: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Entries (k,) of some rows of a matrix, or columns of one stored by these: the lines, counted from their first one, the places
    on them, and the values."""
    ends = A.indptr[lines.start : lines.stop + 1]
    stored = slice(ends[0], ends[-1])
    return np.repeat(np.arange(len(ends) - 1), np.diff(ends)), A.indices[stored], A.data[stored]


def functions_of(
    points: ShapePoints, acting: np.ndarray, total: float, alpha: float, g: np.ndarray, one: np.ndarray, start: np.ndarray
) -> Tests | str:
    """Test functions of a part of which rows (j, f) act, of the mass `total` [kg] under gravity g (c,), `one` (b,) its constant.

    It begins at `start` (b, c).
    """
    missing = points.missing
    assert missing is not None
    b, f = missing.mass.shape[1], len(missing.mass)
    free = ranks.null_space(acting[:, :b])
    balanced = np.vstack([free, np.zeros((f - b, free.shape[1]))])
    N = ranks.null_space(np.vstack([acting, balanced.T @ missing.metric]))
    if not N.shape[1]:
        return HELD
    N = np.linalg.solve(np.linalg.cholesky(N.T @ missing.metric @ N), N.T).T
    own, table = (np.ascontiguousarray(part) for part in (missing.functions[:, :, :b], missing.functions @ N))
    inertia = total * (N.T @ missing.mass)
    weights = np.outer(inertia @ one, g)
    size = float(np.linalg.norm(np.ptp(missing.positions, axis=0)))
    metric, limit = missing.metric[:b, :b], BAND * missing.left_out
    begin, first = centred(metric, one, start[None])[0], gradients(own, start[None])
    return Tests(points.law, own, table, missing.section, size, inertia, weights, alpha, metric, one, begin, first, limit)


def rows_that_act(points: ShapePoints, probes: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray | None, set[int]]:
    """Rows (j, f) on the functions F along which joints and loads act, of their probes (y, b c), None where one acts elsewhere,
    and the numbers of the places on whose directions they act.

    Rows along the `weight` (b,) are not among them: by those constant loads grow to their whole size in statics.
    """
    missing = points.missing
    assert missing is not None
    b = missing.mass.shape[1]
    left = probes.reshape(len(probes), b, points.dim).transpose(0, 2, 1).reshape(-1, b)
    left = left[np.abs(left).max(axis=1) > ELSEWHERE * np.abs(left).max(initial=0.0)]
    across = left - np.outer(left @ weight, weight) / (weight @ weight)
    left = left[np.linalg.norm(across, axis=1) > ELSEWHERE * np.linalg.norm(left, axis=1)]
    found, turned = [np.zeros((0, len(missing.mass)))], set[int]()
    places = np.unique(missing.place)
    moved = places[np.argsort(np.isin(places, missing.unbent), kind="stable")]  # points of a rim move with its frame: that first
    for place in moved:
        rows = missing.rows[missing.place == place]
        weights = np.linalg.lstsq(rows[:, :b].T, left.T, rcond=None)[0].T
        here = np.linalg.norm(left - weights @ rows[:, :b], axis=1) <= ELSEWHERE * np.linalg.norm(left, axis=1)
        found.append(weights[here] @ rows)
        across = np.linalg.norm(weights[here][:, 1:] @ rows[1:, :b], axis=1)
        if (across > TURNED * np.linalg.norm(left[here], axis=1)).any():
            turned.add(int(place))
        left = left[~here]
    return None if len(left) else np.vstack(found), turned


def unbent_places(system: System, part: Body) -> list[str]:
    """Places of a part on whose directions joints or loads of a system with all multipliers act, without moments in training."""
    points = next((shape_points(one) for one in system.elastic if one.name == part.name), None)
    if points is None or points.missing is None or not points.missing.unbent.size:
        return []
    weight = as_dense(part.mass) @ part.constant
    _, turned = rows_that_act(points, rows_on(system, points.columns), weight)
    names = [*part.places, *part.frames]
    return [names[k] for k in sorted(turned & set(points.missing.unbent.tolist()))]


def tell_unbent(system: System, bodies: Iterable[Body]) -> None:
    """A remark of parts that are held or loaded in their direction at places where they were trained without moments."""
    for part in bodies:
        if names := unbent_places(system, part):
            text = f"part '{part.name}': joints or loads act on its direction at {', '.join(names)}"
            remark(f"{text}, where its training had no moments: it may lack shapes that bend there, a run says how much; {REMEDY}")


@dataclass(frozen=True)
class MissingDisplacements:
    """What a part misses in some states."""

    sizes: np.ndarray  #: (s,) |e| of (1) [m]
    shares: np.ndarray  #: (s,) of (4), one number for all states of a motion; 0 of parts that nothing strains
    missing: np.ndarray  #: (s, t, c) e of (1)
    gradients: np.ndarray  #: (k c, s, g)

    def of(self, states: slice) -> MissingDisplacements:
        """The same in some of the states."""
        return MissingDisplacements(self.sizes[states], self.shares[states], self.missing[states], self.gradients[:, states])


def look(
    system: System, x: np.ndarray, rates: tuple[np.ndarray, np.ndarray] | None = None, loads: np.ndarray | float = 1.0
) -> dict[str, MissingDisplacements]:
    """What the parts miss, by their names, in states x (s, n) with rates v and a (s, n), or at rest.

    `loads` are shares (s,) of their weight.

    Copies of a part with the same test functions are looked at together.
    """
    q, count = np.asarray(system.lift.matrix @ x.T).T + system.lift.offset, len(x)
    turns = None if rates is None else [np.asarray(system.lift.matrix @ part.T).T for part in rates]
    alike: dict[int, tuple[Tests, list[tuple[ShapePoints, str]]]] = {}
    for points, name, functions in lacking(system):
        alike.setdefault(id(functions), (functions, []))[1].append((points, name))

    def stacked(coordinates: np.ndarray, members: list[tuple[ShapePoints, str]]) -> np.ndarray:
        """Coordinates (i s, b, c) of all copies."""
        return np.concatenate([coordinates[:, one.columns].reshape(count, -1, one.dim) for one, _ in members])

    found = dict[str, MissingDisplacements]()
    for functions, members in alike.values():
        own = None if turns is None else (stacked(turns[0], members), stacked(turns[1], members))
        share = np.tile(np.broadcast_to(loads, count), len(members))
        seen = look_at(functions, stacked(q, members), own, share, len(members))
        found |= {name: seen.of(slice(k * count, (k + 1) * count)) for k, (_, name) in enumerate(members)}
    return found


def look_at(
    tests: Tests,
    z: np.ndarray,
    rates: tuple[np.ndarray, np.ndarray] | None = None,
    loads: np.ndarray | float = 1.0,
    copies: int = 1,
) -> MissingDisplacements:
    """What a part misses in states z (s, b, c) of its own with rates v and a, or at rest, under shares (s,) of its weight.

    The states of a motion are those of some `copies`, one after another.
    """
    u = gradients(tests.own, z)
    R = unbalanced(tests, u, np.broadcast_to(loads, len(z)))
    if rates is None:
        e = resolved(*stiffness(tests, u), R)
        return MissingDisplacements(np.linalg.norm(e, axis=(1, 2)), softer(tests, u, e, R, len(z)), e, u)
    f = R + np.broadcast_to(loads, len(z))[:, None, None] * tests.weight
    R += tests.mass @ (rates[1] + tests.alpha * rates[0])
    Q, deflection = deflected(tests, z)
    e = resolved(*tests.held, R @ Q) @ Q.transpose(0, 2, 1)
    stiff = felt(tests, deflection, softer(tests, u, e, 2.0 * f - R, copies))
    if (unsure := (np.linalg.norm(e, axis=(1, 2)) > SURE * tests.limit) | (stiff > COARSE)).any():
        e[unsure] = resolved(*stiffness(tests, u[:, unsure]), R[unsure])
        stiff = felt(tests, deflection, softer(tests, u, e, 2.0 * f - R, copies))
    return MissingDisplacements(np.linalg.norm(e, axis=(1, 2)), stiff, e, u)


def resolved(l: np.ndarray, V: np.ndarray, R: np.ndarray) -> np.ndarray:
    """|K_N|^-1 R (s, t, c) of forces R (s, t, c), with eigenvalues and vectors of |K_N|."""
    return np.asarray(np.einsum("sij,sj->si", V, along(V, R) / l).reshape(R.shape))


def softer(tests: Tests, u: np.ndarray, e: np.ndarray, R: np.ndarray, blocks: int) -> np.ndarray:
    """The part (4) of itself by which a part bends too little, one number for each of some blocks of states, as (s,).

    At gradients u (k c, s, g), of what is missing e (s, t, c) with the forces R (s, t, c) that work along it.
    """
    length, least = len(e) // blocks, tests.held[0].max() * (REST * tests.size) ** 2
    missed = (e * R).reshape(blocks, -1).sum(axis=1)
    section = np.repeat(tests.section, length, axis=1)
    some = (np.ascontiguousarray(u[:, k : k + length]) for k in range(0, len(e), length))
    energy = np.array([laws.energy(tests.law, one, section) for one in some])
    return np.repeat(np.divide(missed, 2.0 * energy, out=np.zeros(blocks), where=energy > length * least), length)


def deflected(tests: Tests, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations Q (s, c, c) that bring the start of a part nearest to its states z (s, b, c), and its deflection (s,) there [m]."""
    x = centred(tests.metric, tests.constant, z)
    Q = nearest(x.transpose(0, 2, 1) @ (tests.metric @ tests.begin))
    moved = x - tests.begin @ Q.transpose(0, 2, 1)
    return Q, np.sqrt(np.sum(moved * (tests.metric @ moved), axis=(1, 2)))


def felt(tests: Tests, deflection: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Parts (s,) of itself by which a part bends too little in motions, 0 where its deflection (s,) [m] is hardly any."""
    return np.where(shares * deflection > FELT * tests.size, shares, 0.0)


def centred(metric: np.ndarray, one: np.ndarray, z: np.ndarray) -> np.ndarray:
    """States z (s, b, c) about their mean; `one` (b,) is the constant field 1."""
    weight = metric @ one
    return z - one[:, None] * (weight @ z / (weight @ one))[:, None]


def place_of(points: ShapePoints, tests: Tests, found: MissingDisplacements, state: int) -> np.ndarray:
    """Where the strain energy of the displacement that is missing in a state is largest in the reference (c,) [m]."""
    e, moduli = found.missing[state], modulus(tests, np.ascontiguousarray(found.gradients[:, [state]]))
    (K, P, _), dim = tests.table.shape, e.shape[1]
    bent = (tests.table @ e).transpose(0, 2, 1).reshape(K * dim, P)
    density = np.sum(bent * np.matmul(moduli.transpose(2, 0, 1), bent.T[:, :, None])[:, :, 0].T, axis=0)
    assert points.missing is not None
    return np.asarray(points.missing.positions[int(density.argmax())])


def unbalanced(tests: Tests, u: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """N^T (f - M 1 g) (s, t, c) at gradients u (k c, s, g), under shares (s,) of the weight."""
    S = np.empty_like(u)
    laws.stress(tests.law, u, u, 0.0, np.repeat(tests.section, u.shape[1], axis=1), S)
    return scatter(tests, S) - loads[:, None, None] * tests.weight


def along(V: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Forces R (s, t, c) along the eigenvectors V (s, t c, t c) of |K_N|: (s, t c)."""
    return np.asarray(np.einsum("sij,si->sj", V, R.reshape(len(R), -1)))


def work(l: np.ndarray, V: np.ndarray, R: np.ndarray) -> np.ndarray:
    """R_N^T |K_N|^-1 R_N (s,) of forces R_N (s, t, c), with eigenvalues and vectors of |K_N|."""
    return np.asarray(np.sum(along(V, R) ** 2 / l, axis=1))


def gradients(table: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Gradients (k c, s, g) of coordinates z (s, b, c) at the points of a table (k, g, b)."""
    (K, P, b), (s, _, dim) = table.shape, z.shape
    return np.asarray(z.transpose(2, 0, 1).reshape(dim * s, b) @ table.transpose(0, 2, 1)).reshape(K * dim, s, P)


def scatter(tests: Tests, S: np.ndarray) -> np.ndarray:
    """Forces (s, t, c) on the test functions of stresses (k c, s, g)."""
    (K, P, t), s = tests.table.shape, S.shape[1]
    return np.ascontiguousarray(np.sum(S.reshape(K, -1, P) @ tests.table, axis=0).reshape(-1, s, t).transpose(1, 2, 0))


def modulus(tests: Tests, u: np.ndarray) -> np.ndarray:
    """Moduli (k c, k c, g) at the gradients (k c, 1, g) of one state."""
    D = np.empty((len(u), *u.shape))
    laws.modulus(tests.law, u, 0.0, tests.section, D)
    return D[:, :, 0]


def stiffness(tests: Tests, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues of |K_N| (s, t c) [N/m] and vectors (s, t c, t c), at gradients u (k c, s, g)."""
    (K, P, t), s, dim = tests.table.shape, u.shape[1], len(u) // len(tests.table)
    product, DT = np.empty((s, t, dim * (dim + 1) // 2 * t)), np.empty((K * P, dim * (dim + 1) // 2, t))
    for k in range(s):
        modulus_times_functions(modulus(tests, np.ascontiguousarray(u[:, [k]])), tests.table, dim, DT)
        product[k] = tests.table.reshape(K * P, t).T @ DT.reshape(K * P, -1)
    blocks, tangent, at = product.reshape(s, t, -1, t), np.empty((s, t, dim, t, dim)), 0
    for c in range(dim):
        for d in range(c + 1):
            tangent[:, :, c, :, d], tangent[:, :, d, :, c] = blocks[:, :, at], blocks[:, :, at].transpose(0, 2, 1)
            at += 1
    l, V = np.linalg.eigh(tangent.reshape(s, t * dim, t * dim))
    size = np.abs(l)
    return np.maximum(size, LIMP * size.max(axis=1, keepdims=True)), V


def too_high(system: System, x: np.ndarray, omega: np.ndarray, shapes: np.ndarray) -> np.ndarray | None:
    """By what part of themselves angular frequencies (i,) [rad/s] of undamped modes (n, i) about x (n,) are too high, at least.

        delta (omega^2) = - sum_parts R_N^T |K_N|^-1 R_N / (v^T M v),    R_N = N^T (K - omega^2 M) v                         (2)

    None where no part knows shapes that it lacks; zeros of motions that nothing resists.
    """
    if not lacking(system):
        return None
    size = np.einsum("ni,ni->i", shapes, np.asarray(system.mass @ shapes)) * omega**2
    found = np.array([taken_up(system, x, v, w**2) for v, w in zip(shapes.T, omega, strict=True)])
    return 0.5 * np.divide(found, size, out=np.zeros_like(found), where=size > 0.0)


def too_strong(system: System, found: BucklingModes) -> np.ndarray | None:
    """By what part of themselves load factors (i,) of buckling are too large, at least, as `too_high`.

    delta k / k = - sum_parts R_N^T |K_N|^-1 R_N / (v^T K0 v),    R_N = N^T f'(x0 + k x1) v                              (3)
    """
    if not lacking(system):
        return None
    states = [system.x0 + k * found.path for k in found.factors]
    return np.array([taken_up(system, x, v, 0.0) for x, v in zip(states, found.shapes.T, strict=True)]) / found.stiffness


def taken_up(system: System, x: np.ndarray, shape: np.ndarray, square: float) -> float:
    """Sum over parts of R_N^T |K_N|^-1 R_N with R_N = N^T (K - square M) v of a `shape` v (n,) about x (n,)."""
    q, vector, total = system.lift(x), np.asarray(system.lift.matrix @ shape), 0.0
    for points, _, functions in lacking(system):
        at, v = (part[points.columns].reshape(1, -1, points.dim) for part in (q, vector))
        u = gradients(functions.own, at)
        l, V = stiffness(functions, u)
        stress = np.einsum("abg,bg->ag", modulus(functions, u), gradients(functions.own, v)[:, 0])[:, None]
        R = scatter(functions, stress) - square * (functions.mass @ v)
        total += float(work(l, V, R)[0])
    return total


def warn_of_stiffness(seen: dict[str, MissingDisplacements]) -> None:
    """Say which parts bend too little, in one of some equilibria or in a motion."""
    for name, look in seen.items():
        if (most := look.shares.max()) > COARSE:
            notify(f"part '{name}': it bends too little, at least {most:.2g} of itself; {REMEDY}, {FINER}")


def warn_of_missing(where: str, what: str, high: np.ndarray) -> None:
    """Say which numbers of modes (i,) the shapes of parts make too high."""
    if listed := [f"mode {k + 1} by {high[k]:.2g}" for k in np.flatnonzero(high > COARSE)]:
        text = f"{what} of parts are too high, at least {', '.join(listed[:3])}{' ...' if len(listed) > 3 else ''} of themselves"
        notify(f"{where}: {text}; {REMEDY}")
