r"""Contact as forces on probe rows: points with a radius against a shape, with a penalty, damping
and Coulomb friction.

    d = r - o,    z_k = d . E_k,    g = g(z) - R,    n = sum_k dg/dz_k E_k,    s = - g        o, E_k: place and axes of the shape
    v = r' + sum_j s_j a_j' - o' - sum_k w_k E_k',    s_j = - R n . a_j / |a_j|^2,    w_k = z_k - R dg/dz_k    (material points)
    N of s and s' = - n . v,    T of N, v_T and b = (b0 + change of the material points since the last accepted state), across n,
    (r1 - r0) + sum_j <s_j> (a_j1 - a_j0) - (o1 - o0) - sum_k <w_k> (E_k1 - E_k0),    <s> = (s_0 + 4 s_1/2 + s_1) / 6  (Simpson)

on r: N n + T, on the axes a_j of the place that carries the point: s_j T, on o: - N n - T, on E_k:
- w_k (N n + T). The law is that of `contact_law`; derivatives are those of a complex step, exact to
round-off. The memory of a point is its last normal force, whether it was ever free, the bristle in
the axes of the shape, the rows that it read, and how deep it has been since it came in with which
normal (`contact_passing`). Points that all changes of the motion together cannot have brought near
are not looked at.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from ..core.compiling.jit import jit
from ..core.compiling.structs import IntegerMatrix, Integers, Matrix, Vector, opener, routine
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.storage.validation import Indices, Number, Reals, Sizes, also, require
from ..systems import kernels
from ..systems.evaluation import add_change, evaluation
from ..systems.forces import on_rows as forces
from ..systems.forces.on_rows import Force, ForceRoutines, Place
from ..systems.forces.one_sided import ramp
from .law import (
    BEFORE,
    MU,
    STEP,
    UNKNOWN,
    E,
    K,
    Scalar,
    harden,
    normal_force,
    require_law,
    resist,
    stored,
)
from .passing import came_through, deepest, passed, remember_entry, turned
from .shapes import HEIGHTS, NUMBERS, clearance
from .slip import WORK, component, place, recall, slip, weigh

# what is ten steps away cannot touch in the next, whose friction would read its rows: a rolling
# hoop reads 1313 rows of points in 50 steps, as with 1, 5 and 20, and 6262 where all rows are kept
DISTANT = 10.0  #: steps like the last one that a point is away, at least, whose rows are not kept: only what touches reads them
SEEN = 4  #: numbers of a point: clearance, distance from the origin of the shape, ways a unit of |dx| and of max |dx_n| at most


@storable
@dataclass(frozen=True)
class ContactForces:
    """Contact of t points with one shape."""

    shape: Annotated[int, Number()]  #: see `contact_shapes`
    sizes: Annotated[np.ndarray, Reals("i")]
    heights: Annotated[np.ndarray, Reals("a b")]
    #: origin and axes of the shape where it stands still, (1 + c, c)
    placed: Annotated[np.ndarray, Reals("d c")]
    #: rows of its origin, and of its axes, where a body carries them
    frame: Annotated[np.ndarray, Indices("f", end="y")]
    #: rows of points, then of the axes that carry them
    rows: Annotated[np.ndarray, Indices("t r", end="y")]
    radius: Annotated[np.ndarray, Reals("t")]  #: [m]
    law: Annotated[np.ndarray, Reals("l")]  #: numbers in the order of LAW
    #: change of speed that a change of force makes in a second, over the one allowed a step
    share: Annotated[float, Number()]
    power: Annotated[np.ndarray, Reals("p")]  #: numbers in the order of POWER
    weights: Annotated[np.ndarray, Reals("t")]  #: factors of the forces of a point
    #: pairs of points on tangents of the body: one of lines, two of surfaces
    beside: Annotated[np.ndarray, Indices("t n", end="t")]

    def __len__(self) -> int:
        return len(self.rows)


@also.register(ContactForces)
def check_contact(term: ContactForces, name: str, sizes: Sizes) -> None:
    """Numbers that compiled code reads without looking are there."""
    dim = term.placed.shape[1]
    wide = term.rows.shape[1]
    carried = len(term.frame)
    require(
        dim in (2, 3) and len(term.placed) == 1 + dim,
        f"{name}.placed",
        "an origin and axes",
        term.placed.shape,
    )
    require(
        wide in (dim, dim * (1 + dim)), f"{name}.rows", "rows of a point, or of that and axes", wide
    )
    require(
        carried in (0, dim, dim * (1 + dim)),
        f"{name}.frame",
        "rows of an origin, or of that and axes",
        carried,
    )
    require_law(term.law, term.power, name)
    require(
        term.beside.shape[1] in (0, 2, 4),
        f"{name}.beside",
        "pairs of points, two at most",
        term.beside.shape,
    )
    known = NUMBERS[dim].get(term.shape)
    require(
        len(term.sizes) == known,
        f"{name}.sizes",
        "a known shape with its sizes",
        f"{term.shape} with {len(term.sizes)}",
    )
    enough = term.shape != HEIGHTS or min(term.heights.shape[: dim - 1]) > 1
    require(enough, f"{name}.heights", "two heights or more", term.heights.shape)


class ContactRecord(NamedTuple):
    """The same for compiled code."""

    shape: int
    sizes: Vector
    heights: Matrix
    placed: Matrix
    frame: Integers
    rows: IntegerMatrix
    beside: IntegerMatrix
    radius: Vector
    weights: Vector
    law: Vector
    share: float
    pair: int  #: first place in H
    memory: int  #: first place in the memory
    room: int  #: first place in the room: SEEN numbers a point, then the rows of the shape


opened = opener(ContactRecord)


@jit
def press(
    F: Any, k: int, y: np.ndarray, v: np.ndarray, last: np.ndarray, w: np.ndarray, out: np.ndarray
) -> Scalar:
    """out (r + f,) = forces of the point k on its rows y with the rates v; the normal force.

    `last` is its memory, which w (WORK, r + f) has to `recall`: w[5] becomes the bristle in the
    axes of the shape, w[3] the speed of sliding.
    """
    dim = F.placed.shape[1]
    arms = F.rows.shape[1] // F.placed.shape[1]
    # generic in real and complex numbers, as derivatives are complex steps through this very code
    gap = weigh(F, k, y, w)
    rate = 0.0 * y[0]
    for c in range(dim):
        w[3, c] = w[4, c] = w[5, c] = 0.0 * y[0]
    for j in range(len(y)):
        w[3, j % dim] += w[7, j // dim] * v[j]
    for c in range(dim):
        rate -= w[2, c] * w[3, c]
    # only the real part decides: a complex step must not change sides
    N = normal_force(F.law, -gap, rate) if gap.real < 0.0 else 0.0 * gap
    for c in range(dim):
        w[3, c] += w[2, c] * rate
    if N.real > 0.0 and F.law[MU] > 0.0:
        stick(F, k, y, N, last, w)
    for b in range(len(y) // dim):
        for c in range(dim):
            # forces on points and on the frame that carries the shape have the same weights, so
            # that they balance
            out[dim * b + c] = (
                F.weights[k] * w[7, b] * (w[4, c] if 0 < b < arms else w[4, c] + N * w[2, c])
            )
    return F.weights[k] * N


@jit
def stick(F: Any, k: int, y: np.ndarray, N: Scalar, last: np.ndarray, w: np.ndarray) -> None:
    """w[4] = T of the normal force N and the speed w[3] of material points; w[5] becomes the
    bristle.
    """
    dim = F.placed.shape[1]
    law = F.law
    along = 0.0 * y[0]
    # what touches at the start has no state before: it counts as having moved so for BEFORE
    if last[0] >= 0.0:
        slip(F, k, y, last, w)
    else:
        for c in range(dim):
            w[6, c] = BEFORE * w[3, c]
    for c in range(dim):
        for i in range(dim):
            w[6, c] += last[2 + i] * component(F, y, i, c)
        along += w[2, c] * w[6, c]
    for c in range(dim):
        w[6, c] -= along * w[2, c]
    resist(law, N, w[6], w[3], w[4], dim)
    for c in range(dim):
        for i in range(dim):
            w[5, i] += w[6, c] * component(F, y, i, c)


@jit
def read(table: Any, F: Any, k: int, y: np.ndarray) -> None:
    """y (r + f,) = the rows of a point."""
    E = evaluation(table)
    own = F.rows.shape[1]
    A, s = E.arrays, E.space
    for j in range(own):
        i = F.rows[k, j]
        # row by row, of points that are near: the product of a step leaves these rows out
        y[j] = A.probes_offset[i] + kernels.row_value(A.probes, i, s.x)
    for j in range(own, len(y)):
        y[j] = s.y[F.frame[j - own]]


@jit
def read_rates(table: Any, F: Any, k: int, v: np.ndarray) -> None:
    """v (r + f,) = their rates."""
    E = evaluation(table)
    own = F.rows.shape[1]
    A, s = E.arrays, E.space
    for j in range(own):
        v[j] = kernels.row_value(A.probes, F.rows[k, j], s.v)
    for j in range(own, len(v)):
        v[j] = s.rates[F.frame[j - own]]


@jit
def near(table: Any, F: Any, k: int, y: np.ndarray, v: np.ndarray, w: np.ndarray) -> bool:
    """Whether a point touches; y and v become its rows and their rates."""
    read(table, F, k, y)
    # rates are a second product, which open points are spared
    if place(F, k, y, w) >= 0.0:
        return False
    read_rates(table, F, k, v)
    return True


@jit
def memory_of(s: Any, F: Any, k: int) -> np.ndarray:
    """The memory of a point."""
    count = deepest(F) + 1 + F.placed.shape[1]
    return s.memory[F.memory + k * count : F.memory + (k + 1) * count]


@jit
def carry(s: Any, F: Any) -> tuple[float, float, float]:
    """How a shape has moved since the room was filled: size of its axes, shift of its origin,
    change of its axes.
    """
    dim = F.placed.shape[1]
    first = F.room + SEEN * len(F.rows)
    wide = 0.0
    shift = 0.0
    change = 0.0
    # a shape that a body carries comes nearer by itself: once for all of its points
    for j in range(dim * (1 + dim)):
        now = F.placed[j // dim, j % dim]
        moved = 0.0
        if j < len(F.frame):
            now = s.y[F.frame[j]]
            moved = now - s.room[first + j]
        if j < dim:
            shift += moved * moved
        else:
            wide += now * now / dim
            change += moved * moved
    return np.sqrt(wide + change), np.sqrt(shift), np.sqrt(change)


@jit
def approach(s: Any, F: Any, k: int, moved: tuple[float, float, float]) -> tuple[float, float]:
    """By how much a point may have come nearer since the room was filled, and its distance from the
    origin of the shape grown.
    """
    first = F.room + SEEN * k
    # the smaller of two bounds: few unknowns that move far, or many that move a little
    way = min(s.room[first + 2] * s.moved[0], s.room[first + 3] * s.moved[1]) + moved[1]
    return moved[0] * way + moved[2] * s.room[first + 1], way


@jit
def is_inactive(s: Any, F: Any, k: int, moved: tuple[float, float, float]) -> bool:
    """Whether a point cannot have come near since the room was filled, by how much all has moved;
    without looking at it.
    """
    # one comparison a point in place of its rows: contact that is far takes 1.17 times the time of
    # none
    return s.room[F.room + SEEN * k] > approach(s, F, k, moved)[0]


@jit
def look_around(table: Any, F: Any, k: int, y: np.ndarray, w: np.ndarray) -> None:
    """Fill the room of a point with rows y whose place is w[0]."""
    E = evaluation(table)
    dim = F.placed.shape[1]
    far = 0.0
    room = E.space.room
    first = F.room + SEEN * k
    for c in range(dim):
        far += (y[c] - component(F, y, -1, c)) ** 2
    room[first] = clearance(F.shape, F.sizes, F.heights, dim, w[0], w[1]) - F.radius[k]
    room[first + 1] = np.sqrt(far)
    # bounds of the rows are constants, made at the first look
    if not room[first + 2] > 0.0:
        room[first + 2], room[first + 3] = kernels.row_sizes(E.arrays.probes, F.rows[k], 0, dim)


@routine
def push(table: Any, record: Any) -> int:
    """g += F."""
    s = evaluation(table).space
    F = opened(record)
    many = F.rows.shape[1] + len(F.frame)
    own = F.rows.shape[1]
    y, v, out, w = np.empty(many), np.empty(many), np.empty(many), np.empty((WORK, many))
    # bounds first: of hundreds of points a few are near
    moved = carry(s, F)
    for k in range(len(F.rows)):
        if not is_inactive(s, F, k, moved) and near(table, F, k, y, v, w):
            last = memory_of(s, F, k)
            recall(F, k, last, w)
            press(F, k, y, v, last, w, out)
            for j in range(many):
                s.g[F.rows[k, j] if j < own else F.frame[j - own]] += out[j]
    return 0


@routine
def slopes(table: Any, record: Any) -> int:
    """Derivatives of the contact forces by complex steps.

        H += - c (dF/dy + gh dF/dy')

    along y_j + gh y_j', exact to round-off.
    """
    s = evaluation(table).space
    F = opened(record)
    many = F.rows.shape[1] + len(F.frame)
    c = s.c[0]
    gh = s.gh[0]
    y, v, real = np.empty(many), np.empty(many), np.empty((WORK, many))
    yc, vc, out = (
        np.empty(many, np.complex128),
        np.empty(many, np.complex128),
        np.empty(many, np.complex128),
    )
    w = np.empty((WORK, many), np.complex128)
    moved = carry(s, F)
    for k in range(len(F.rows)):
        if not is_inactive(s, F, k, moved) and near(table, F, k, y, v, real):
            last = memory_of(s, F, k)
            recall(F, k, last, w)
            for j in range(many):
                yc[j], vc[j] = y[j], v[j]
            for j in range(many):
                yc[j], vc[j] = complex(y[j], STEP), complex(v[j], STEP * gh)
                # derivatives to round-off from the force itself: no second formula that could
                # differ from it
                press(F, k, yc, vc, last, w, out)
                yc[j], vc[j] = y[j], v[j]
                for i in range(many):
                    s.H[F.pair + (k * many + i) * many + j] -= c * out[i].imag / STEP
    return 0


@routine
def accept(table: Any, record: Any) -> int:
    """The memory of all points, and the room: who cannot have come near is not looked at, and has
    come nearer by all that moved.
    """
    s = evaluation(table).space
    F = opened(record)
    many = F.rows.shape[1] + len(F.frame)
    dim = F.placed.shape[1]
    y = np.empty(many)
    v = np.empty(many)
    out = np.empty(many)
    w = np.empty((WORK, many))
    moved = carry(s, F)
    for k in range(len(F.rows)):
        seen = F.room + SEEN * k
        N = 0.0
        deep = 0.0
        last = memory_of(s, F, k)
        inactive = is_inactive(s, F, k, moved)
        # the bound shrinks by what may have come nearer: a look is needed only when it is used up
        if inactive:
            nearer, farther = approach(s, F, k, moved)
            s.room[seen] -= nearer
            s.room[seen + 1] += farther
            if s.room[seen] > DISTANT * nearer:
                last[0], last[1], last[2 : 2 + dim], last[deepest(F)] = UNKNOWN, 1.0, 0.0, 0.0
                continue
            read(table, F, k, y)
        else:
            touches = near(table, F, k, y, v, w)
            # before places on the way in take that of the point
            look_around(table, F, k, y, w)
            if touches:
                recall(F, k, last, w)
                N = press(F, k, y, v, last, w, out)
                deep = remember_entry(F, k, last, y, w)
        for i in range(dim):
            last[2 + i] = w[5, i] if N != 0.0 else 0.0
        last[0], last[1], last[deepest(F)] = max(N, 0.0), 1.0 if N <= 0.0 else last[1], deep
        for j in range(many):
            last[2 + dim + j] = y[j]
    for j in range(len(F.frame)):
        s.room[F.room + SEEN * len(F.rows) + j] = s.y[F.frame[j]]
    return 0


@routine
def judge(table: Any, record: Any) -> int:
    """impulse += how fast the change of normal forces since the last accepted state changes speeds,
    over the change allowed.

    What has touched from the start on never came: its vibration is no impact. What passed through
    the shape in between, or through its middle, or came out behind it, is infinite.
    """
    s = evaluation(table).space
    F = opened(record)
    many = F.rows.shape[1] + len(F.frame)
    dim = F.placed.shape[1]
    y, v, out, w = np.empty(many), np.empty(many), np.empty(many), np.empty((WORK, many))
    moved = carry(s, F)
    for k in range(len(F.rows)):
        last = memory_of(s, F, k)
        touches = not is_inactive(s, F, k, moved) and near(table, F, k, y, v, w)
        through = not touches and last[deepest(F)] > 0.0 and came_through(table, F, k, last, y, w)
        if through or (
            touches and last[0] > 0.0 and turned(table, F, k, last[2 + dim :], y, w) < 0.0
        ):
            s.impulse[0] = np.inf
        elif last[1] > 0.0 and (touches or last[0] > 0.0):
            N = 0.0
            if touches:
                recall(F, k, last, w)
                N = press(F, k, y, v, last, w, out)
            add_change(s, N, last[0], F.share)
        elif (
            not touches
            and last[0] == 0.0
            and not is_inactive(s, F, k, moved)
            and passed(table, F, k, last[2 + dim :], y, w)
        ):
            s.impulse[0] = np.inf
    return 0


@routine
def store(table: Any, record: Any) -> int:
    """energy += what is stored, and the elastic forces out of g."""
    s = evaluation(table).space
    F = opened(record)
    many = F.rows.shape[1] + len(F.frame)
    own = F.rows.shape[1]
    dim = F.placed.shape[1]
    y = np.empty(many)
    w = np.empty((WORK, many))
    moved = carry(s, F)
    for k in range(len(F.rows)):
        # potentials skip what is far, as forces do
        if is_inactive(s, F, k, moved):
            continue
        read(table, F, k, y)
        overlap = -place(F, k, y, w)
        if overlap > 0.0:
            N = F.weights[k] * F.law[K] * harden(F.law, ramp(overlap, F.law[E]))
            s.energy[0] += F.weights[k] * stored(F.law, overlap)
            for c in range(dim):
                n = 0.0
                for i in range(dim):
                    n += w[1, i] * component(F, y, i, c)
                s.g[F.rows[k, c]] -= N * n
                if many > own:
                    s.g[F.frame[c]] += N * n
                if many - own > dim:
                    for i in range(dim):
                        s.g[F.frame[dim * (1 + i) + c]] += (w[0, i] - F.radius[k] * w[1, i]) * N * n
    return 0


@forces.compile_force.register
def _(found: ContactForces, place: Place) -> Force:
    count = len(found)
    many = found.rows.shape[1] + len(found.frame)
    rows = np.concatenate([found.rows, np.tile(found.frame, (count, 1))], axis=1)
    pairs = np.stack([np.repeat(rows, many, axis=1), np.tile(rows, (1, many))], axis=2).reshape(
        -1, 2
    )
    memory = np.zeros((count, 3 + 2 * found.placed.shape[1] + many))
    memory[:, 0] = UNKNOWN
    numbers = (
        found.placed,
        found.frame,
        found.rows,
        found.beside,
        found.radius,
        found.weights,
        np.concatenate([found.law, found.power]),
    )
    arrays = [np.ascontiguousarray(part) for part in (found.sizes, found.heights, *numbers)]
    record = ContactRecord._make((found.shape, *arrays, found.share, *place))
    routines = ForceRoutines(push, slopes, accept, store, judge)
    room = SEEN * count + len(found.frame)
    alone = found.rows.ravel()
    skew = bool(found.law[MU] > 0.0)
    single = 1 if count == 1 else 0
    more: dict[str, Any] = {
        "damped": True,
        "skew": skew,
        "room": room,
        "alone": alone,
        "places": single,
    }
    return Force(record, routines, "contact", pairs, memory.ravel(), **more)
