"""Contact of points with a surface for compiled code: forces, derivatives, memory, and where
nothing is near.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..core.compiling.jit import jit
from ..core.compiling.structs import Cube, Matrix, opener, routine
from ..systems import kernels
from ..systems.evaluation import add_change, evaluation
from ..systems.forces import on_rows as forces
from ..systems.forces.low_rank import Size
from ..systems.forces.on_rows import Force, ForceRoutines, Place
from ..systems.forces.one_sided import ramp
from .facet_pairs import (
    BRISTLE,
    DISTANCE,
    NORMAL,
    POINT,
    POINT_RATE,
    PULL,
    RATES,
    READ,
    ROOM,
    SPEED,
    D,
    FacetContacts,
    FacetsRecord,
    at_corners,
    find,
    find_flat,
    follow,
    gap_of,
    limit_of,
    measure_extents,
    opened,
    overlapped,
    passed,
    place_of,
    point,
    press,
    read_rates,
    record_of,
    share_out,
)
from .facets import NINE, correction, trace, weigh_vectors
from .law import STEP, UNKNOWN, E, K, harden, size, stored
from .nearness import WAYS, ahead, is_active, read

RANK = 9  #: of the derivatives of a point: by d, X,u and X,v
# as `forces.DISTANT`: what is ten steps away meets nothing in the next
SOON = 10.0  #: steps like the last one that a point is away, at least, whose side is not looked for


@jit
def make_room(F: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rows and their rates (f,), forces (READ,), work and weights."""
    return (
        np.empty(len(F.rows)),
        np.zeros(len(F.rows)),
        np.empty(READ),
        np.zeros((ROOM, 3)),
        np.empty((6, NINE)),
    )


@jit
def memory_of(s: Any, F: Any, k: int) -> np.ndarray:
    """The memory (POINT,) of a point."""
    first = F.memory + len(F.rows) + POINT * k
    return s.memory[first : first + POINT]


@jit
def meet(
    s: Any,
    F: Any,
    k: int,
    y: np.ndarray,
    within: tuple[float, float],
    way: float,
    w: np.ndarray,
    W: np.ndarray,
) -> tuple[float, int, float, float, int, bool]:
    """Gap of a point, the triangle and u, v of its closest place, where it is held, and whether the
    point is beyond the middle.

    The gap is infinite where nothing is as near as `limit_of` asks; else w[1:7] and W are current.
    """
    last = memory_of(s, F, k)
    away, f, at_u, at_v, held = find(F, k, y, within, limit_of(F, k, last, way), w, W)
    if away == np.inf:
        return np.inf, f, at_u, at_v, held, False
    beyond = passed(F, k, last, w, way)
    return gap_of(F.radius[k], held, beyond, w), f, at_u, at_v, held, beyond


@jit
def press_on(
    table: Any,
    F: Any,
    k: int,
    f: int,
    held: int,
    beyond: bool,
    v: np.ndarray,
    w: np.ndarray,
    W: np.ndarray,
    out: np.ndarray,
) -> float:
    """out (READ,) = forces of a point that `meet` has found to touch a triangle; its normal force
    times its weight.
    """
    s = evaluation(table).space
    read_rates(table, F, f, k, v)
    follow(F, f, k, v, s.memory[F.memory : F.memory + len(F.rows)], w, W)
    return press(F, k, held, beyond, memory_of(s, F, k), w, W, out)


@routine
def push(table: Any, record: Any) -> int:
    """g += F."""
    s = evaluation(table).space
    F = opened(record)
    way = ahead(s, F.room + len(F.radius))
    if not is_active(s, F.room, len(F.radius), way):
        return 0
    y, v, out, w, W = make_room(F)
    read(table, F.rows, y)
    within = measure_extents(F, y)
    for k in range(len(F.radius)):
        if s.room[F.room + k] > way:
            continue
        gap, f, _, _, held, beyond = meet(s, F, k, y, within, way, w, W)
        if gap < 0.0:
            press_on(table, F, k, f, held, beyond, v, w, W, out)
            for j in range(READ):
                s.g[F.rows[place_of(F, f, k, j)]] += out[j]
    return 0


@routine
def slopes(table: Any, record: Any) -> int:
    """Derivatives of the contact forces by complex steps along d, X,u, X,v and their rates, with
    one correction of the closest place.

        H += - c (dF/dy + gh dF/dy')
    """
    s = evaluation(table).space
    F = opened(record)
    way = ahead(s, F.room + len(F.radius))
    before = s.memory[F.memory : F.memory + len(F.rows)]
    if not is_active(s, F.room, len(F.radius), way):
        return 0
    y, v, _, w, W = make_room(F)
    out = np.empty(READ, np.complex128)
    wc = np.zeros((ROOM, 3), np.complex128)
    Wc = np.empty((6, NINE), np.complex128)
    read(table, F.rows, y)
    within = measure_extents(F, y)
    for k in range(len(F.radius)):
        if s.room[F.room + k] > way:
            continue
        gap, f, at_u, at_v, held, beyond = meet(s, F, k, y, within, way, w, W)
        if gap >= 0.0:
            continue
        last = memory_of(s, F, k)
        read_rates(table, F, f, k, v)
        begin_term(s.low, F, f, k, W)
        left = s.low.left[s.low.used[0] - 1]
        at = at_corners(F, f)
        for i in range(RANK):
            vector = (D, 1, 2)[i // 3]
            c = i % 3
            for m in range(7):
                for b in range(3):
                    wc[m, b] = w[m, b]
            wc[vector, c] += complex(0.0, STEP)
            du, dv = correction(wc, held)
            weigh_vectors(complex(at_u, du.imag), complex(at_v, dv.imag), at, Wc)
            trace(y, F.corners[f], Wc, 6, wc, 0)
            p = point(F, k, y)
            for b in range(3):
                wc[D, b] = p[b] - wc[0, b]
            follow(F, f, k, v, before, wc, Wc)
            wc[vector, c] += complex(0.0, STEP)
            step_rate(wc, i // 3, c, STEP * s.gh[0])
            press(F, k, held, beyond, last, wc, Wc, out)
            for j in range(READ):
                left[i, j] -= s.c[0] * out[j].imag / STEP
    return 0


@jit
def step_rate(wc: np.ndarray, vector: int, c: int, step: float) -> None:
    """A complex step of a component of the rate of d, X,u or X,v."""
    wc[(POINT_RATE, RATES + 1, RATES + 2)[vector], c] += complex(0.0, step)


@jit
def begin_term(low: Any, F: Any, f: int, k: int, W: np.ndarray) -> None:
    """The next term of low rank: d, X,u and X,v from the rows of a triangle and of a point, and no
    forces yet.
    """
    t = low.used[0]
    low.used[0] += 1
    low.left[t] = 0.0
    low.right[t] = 0.0
    for j in range(READ):
        low.rows[t, j] = F.rows[place_of(F, f, k, j)]
    for c in range(3):
        for j in range(NINE):
            low.right[t, c, 3 * j + c] = -W[0, j]
            low.right[t, 3 + c, 3 * j + c], low.right[t, 6 + c, 3 * j + c] = W[1, j], W[2, j]
        low.right[t, c, 3 * NINE + c] = 1.0


@jit
def find_ways(table: Any, F: Any, ways: np.ndarray) -> None:
    """Bounds of the ways a unit of |dx| and of max |dx_n|: of the surface those of vertices and a
    third of those of tangents.
    """
    P = evaluation(table).arrays.probes
    most = np.zeros((3, 2))
    count = len(F.at)
    wide = 0.0
    for f in range(len(F.corners)):
        for i in range(3):
            a, b = F.corners[f, i], F.corners[f, (i + 1) % 3]
            wide = max(wide, abs(F.at[b, 0] - F.at[a, 0]), abs(F.at[b, 1] - F.at[a, 1]))
    for j in range(3 * count + len(F.radius)):
        kind = 2 if j >= 3 * count else min(j % 3, 1)
        of_x, of_largest = kernels.row_sizes(P, F.rows, 3 * j, 3)
        most[kind, 0], most[kind, 1] = max(most[kind, 0], of_x), max(most[kind, 1], of_largest)
    for i in range(2):
        ways[i] = most[0, i] + 2.0 / 3.0 * wide * most[1, i]
        ways[2 + i] = most[2, i]


@jit
def remember(N: float, distance: float, w: np.ndarray, last: np.ndarray) -> None:
    """The force of a point, whether it was ever without one, its bristle and its distance as its
    memory.
    """
    for c in range(3):
        last[2 + c] = w[BRISTLE, c] if N > 0.0 else 0.0
    last[0] = max(N, 0.0)
    last[1] = 1.0 if N <= 0.0 else last[1]
    last[DISTANCE] = distance


@routine
def accept(table: Any, record: Any) -> int:
    """The memory of rows and points, and the room: points that cannot have come near are not looked
    at.
    """
    s = evaluation(table).space
    F = opened(record)
    way = ahead(s, F.room + len(F.radius))
    ways = F.room + len(F.radius)
    y, v, out, w, W = make_room(F)
    read(table, F.rows, y)
    if not s.room[ways] > 0.0:
        find_ways(table, F, s.room[ways : ways + WAYS])
    within = measure_extents(F, y)
    for k in range(len(F.radius)):
        seen = F.room + k
        last = memory_of(s, F, k)
        N = 0.0
        away = np.inf
        gap = np.inf
        if s.room[seen] > way:
            s.room[seen] -= way
        elif not overlapped(F, k, last):
            s.room[seen] = find_flat(F, k, y, within[0], np.inf) - within[1] - F.radius[k]
        if not s.room[seen] > SOON * way:
            away, f, _, _, held = find(F, k, y, within, np.inf, w, W)
        if away < np.inf:
            beyond = passed(F, k, last, w, way)
            gap = gap_of(F.radius[k], held, beyond, w)
            if gap < 0.0:
                N = press_on(table, F, k, f, held, beyond, v, w, W, out)
                # its distance grows beyond the middle: taken for far away by that, it would lose
                # its side
                s.room[seen] = 0.0
            for c in range(3):
                last[5 + c] = w[NORMAL, c]
        remember(N, gap + F.radius[k], w, last)
    for j in range(len(F.rows)):
        s.memory[F.memory + j] = y[j]
    return 0


@routine
def judge(table: Any, record: Any) -> int:
    """impulse += as of contact with shapes; infinite where a point passed through the middle of the
    surface.
    """
    s = evaluation(table).space
    F = opened(record)
    way = ahead(s, F.room + len(F.radius))
    y, v, out, w, W = make_room(F)
    read_now = False
    within = (0.0, 0.0)
    for k in range(len(F.radius)):
        last = memory_of(s, F, k)
        N = 0.0
        if s.room[F.room + k] > way:
            continue
        if not read_now:
            read(table, F.rows, y)
            within = measure_extents(F, y)
            read_now = True
        gap, f, _, _, held, beyond = meet(s, F, k, y, within, way, w, W)
        if beyond and not overlapped(F, k, last):
            s.impulse[0] = np.inf
            return 0
        if gap < 0.0:
            N = press_on(table, F, k, f, held, beyond, v, w, W, out)
        if last[1] > 0.0:
            add_change(s, N, last[0], F.share)
    return 0


@routine
def store(table: Any, record: Any) -> int:
    """energy += what is stored, and the elastic forces out of g."""
    s = evaluation(table).space
    F = opened(record)
    way = ahead(s, F.room + len(F.radius))
    if not is_active(s, F.room, len(F.radius), way):
        return 0
    y, _, out, w, W = make_room(F)
    read(table, F.rows, y)
    within = measure_extents(F, y)
    for k in range(len(F.radius)):
        if s.room[F.room + k] > way:
            continue
        gap, f, _, _, _, _ = meet(s, F, k, y, within, way, w, W)
        if gap < 0.0:
            s.energy[0] += F.weights[k] * stored(F.law, -gap)
            for c in range(3):
                w[PULL, c] = 0.0
            share_out(
                (0.0, 0.0, 0.0),
                F.weights[k],
                F.law[K] * harden(F.law, ramp(-gap, F.law[E])),
                w,
                W,
                out,
            )
            for j in range(READ):
                s.g[F.rows[place_of(F, f, k, j)]] -= out[j]
    return 0


@forces.compile_force.register
def _(found: FacetContacts, place: Place) -> Force:
    record = record_of(found, place)
    count = len(found.rows)
    memory = np.zeros(count + POINT * len(found))
    memory[count::POINT], memory[count + DISTANCE :: POINT] = UNKNOWN, np.inf
    routines = ForceRoutines(push, slopes, accept, store, judge)
    low = Size(len(found), READ, RANK)
    room = len(found) + WAYS
    return Force(
        record,
        routines,
        "contact with a plate",
        memory=memory,
        damped=True,
        room=room,
        alone=record.rows,
        low=low,
    )


@routine
def measure(table: Any, _: Any) -> int:
    """out (s, t, 6) = gap, normal force, speed of sliding, normal of all points for samples of y
    and y' (s, f).
    """
    S = samples_of(table)
    F = S.record
    _, _, out, w, W = make_room(F)
    new = np.zeros(POINT)
    new[0] = UNKNOWN
    for i in range(len(S.y)):
        within = measure_extents(F, S.y[i])
        for k in range(len(F.radius)):
            _, f, _, _, held = find(F, k, S.y[i], within, np.inf, w, W)
            S.out[i, k, 0] = gap_of(F.radius[k], held, False, w)
            follow(F, f, k, S.v[i], S.y[i], w, W)
            S.out[i, k, 1] = press(F, k, held, False, new, w, W, out)
            S.out[i, k, 2] = size(w[SPEED], 3)
            for c in range(3):
                S.out[i, k, 3 + c] = w[NORMAL, c]
    return 0


class FacetSamples(NamedTuple):
    """Rows of a contact over time."""

    record: FacetsRecord
    y: Matrix
    v: Matrix
    out: Cube


samples_of = opener(FacetSamples)


def measures(term: FacetContacts, y: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Gap [m], normal force [N], speed of sliding [m/s], and normal of points (s, t, 6) from rows
    (s, f) and their rates.
    """
    y, v = map(np.ascontiguousarray, (y, v))
    samples = FacetSamples(record_of(term, Place(0, 0, 0)), y, v, np.zeros((len(y), len(term), 6)))
    measure(samples)
    return samples.out
