"""Contact of beams with beams for compiled code: forces, derivatives, memory, and where nothing is
near.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compiling.jit import jit
from ..core.compiling.structs import routine
from ..systems import kernels
from ..systems.evaluation import add_change, evaluation
from ..systems.forces import on_rows as forces
from ..systems.forces.low_rank import Size
from ..systems.forces.on_rows import Force, ForceRoutines, Place
from ..systems.forces.one_sided import ramp
from .curves import correction, find_chord, piece, shares, trace
from .law import STEP, UNKNOWN, E, K, harden, stored
from .nearness import WAYS, ahead, is_active, read
from .pairs import (
    DEEPEST,
    NODE,
    ROOM,
    BeamContacts,
    extents,
    find,
    follow,
    limits_of,
    opened,
    pieces,
    press,
    read_rates,
    record_of,
    row_of,
    share_out,
    weigh,
)
from .passing import DEEP, GRAZED, LEAST, cosine_across, goes_through, lay_across, make_unit

SAME = 1e-9  #: distance in p and q of places that are one


@jit
def make_room(F: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rows and their rates (f,), forces (8 c,) and work."""
    return np.empty(len(F.rows)), np.empty(len(F.rows)), np.empty(8 * F.dim), np.empty((ROOM, 3))


@routine
def push(table: Any, record: Any) -> int:
    """g += F."""
    s = evaluation(table).space
    F = opened(record)
    way = ahead(s, F.room + len(F.spans) + 1)
    many = len(F.rows)
    dim = F.dim
    if not is_active(s, F.room, len(F.spans) + 1, way):
        return 0
    y, v, out, w = make_room(F)
    before = s.memory[F.memory : F.memory + many]
    read(table, F.rows, y)
    within = extents(F, y)
    for k in range(len(F.spans) + 1):
        # nodes that cannot have come near: a hoop that may touch itself takes 86 us a step for 335
        # us, 47 us without contact
        if s.room[F.room + k] > way:
            continue
        gap, p, q, _ = find(F, k, y, within, w)
        if gap < 0.0:
            places = pieces(F, p, q)
            first = F.memory + many + NODE * k
            read_rates(table, F, places, v)
            follow(F, v, before, p, q, w)
            press(F, k, before, s.memory[first : first + NODE], p, q, w, out)
            for j in range(8 * dim):
                s.g[F.rows[row_of(j, places, dim)]] += out[j]
    return 0


@routine
def slopes(table: Any, record: Any) -> int:
    """Derivatives of the contact forces by complex steps along d, A_p, B_q and their rates, with
    one correction of the closest points.

        H += - c (dF/dy + gh dF/dy')

    Nodes beside a crossing meet at one place, and share one term of low rank.
    """
    s = evaluation(table).space
    F = opened(record)
    way = ahead(s, F.room + len(F.spans) + 1)
    many = len(F.rows)
    dim = F.dim
    second = 2 * F.dim * (len(F.spans) + 1)
    if not is_active(s, F.room, len(F.spans) + 1, way):
        return 0
    y = np.empty(many)
    v = np.empty(many)
    w = np.empty((ROOM, 3))
    before = s.memory[F.memory : F.memory + many]
    out, wc = np.empty(8 * dim, np.complex128), np.empty((ROOM, 3), np.complex128)
    read(table, F.rows, y)
    within = extents(F, y)
    latest = (-1.0, -1.0)
    for k in range(len(F.spans) + 1):
        if s.room[F.room + k] > way:
            continue
        gap, p, q, held = find(F, k, y, within, w)
        if gap >= 0.0:
            continue
        places = pieces(F, p, q)
        first = F.memory + many + NODE * k
        read_rates(table, F, places, v)
        # nodes beside a crossing meet at one place: one term of low rank serves them
        known = pieces(F, latest[0], latest[1])
        if (
            abs(p - latest[0]) > SAME
            or abs(q - latest[1]) > SAME
            or places[0] != known[0]
            or places[1] != known[1]
        ):
            begin_term(s.low, F, places, p, q)
            latest = p, q
        left = s.low.left[s.low.used[0] - 1]
        for f in range(3 * dim):
            trace(y, 0, F.spans, complex(p, 0.0), 3, dim, wc, 0)
            trace(y, second, F.others, complex(q, 0.0), 3, dim, wc, 3)
            wc[(0, 1, 4)[f // dim], f % dim] += complex(0.0, STEP)
            # one exact correction moves the closest points with the complex step: no iteration in
            # complex numbers
            dp, dq = correction(dim, wc, held, True)
            pc, qc = complex(p, dp.imag), complex(q, dq.imag)
            trace(y, 0, F.spans, pc, 2, dim, wc, 0)
            trace(y, second, F.others, qc, 2, dim, wc, 3)
            follow(F, v, before, pc, qc, wc)
            wc[(0, 1, 4)[f // dim], f % dim] += complex(0.0, STEP)
            wc[(14, 15, 17)[f // dim], f % dim] += complex(0.0, STEP * s.gh[0])
            press(F, k, before, s.memory[first : first + NODE], pc, qc, wc, out)
            for j in range(8 * dim):
                left[f, j] -= s.c[0] * out[j].imag / STEP
    return 0


@jit
def begin_term(low: Any, F: Any, places: tuple[int, int], p: float, q: float) -> None:
    """The next term of low rank: d, A_p and B_q from the rows of two pieces, and no forces yet."""
    dim = F.dim
    t = low.used[0]
    low.used[0] += 1
    low.left[t] = 0.0  # all of it, as other forces have more rows
    low.right[t] = 0.0
    for j in range(8 * dim):
        low.rows[t, j] = F.rows[row_of(j, places, dim)]
    i, j = piece(p, F.spans), piece(q, F.others)
    at, by, other, along = (
        shares(p - i, 0, F.spans[i]),
        shares(p - i, 1, F.spans[i]),
        shares(q - j, 0, F.others[j]),
        shares(q - j, 1, F.others[j]),
    )
    for k in range(4):
        for c in range(dim):
            low.right[t, c, dim * k + c], low.right[t, c, dim * (4 + k) + c] = at[k], -other[k]
            low.right[t, dim + c, dim * k + c], low.right[t, 2 * dim + c, dim * (4 + k) + c] = (
                by[k],
                along[k],
            )


@jit
def find_ways(table: Any, F: Any, first: int, spans: np.ndarray) -> tuple[float, float]:
    """Bounds of the way of a curve a unit of |dx| and of max |dx_n|: those of its nodes and 8 / 27
    of those of its tangents.
    """
    P = evaluation(table).arrays.probes
    dim = F.dim
    way = np.zeros(2)
    most = np.zeros((2, 2))
    for j in range(2 * (len(spans) + 1)):
        of_x, of_largest = kernels.row_sizes(P, F.rows, first + dim * j, dim)
        most[j % 2, 0], most[j % 2, 1] = max(most[j % 2, 0], of_x), max(most[j % 2, 1], of_largest)
    longest_span = 0.0
    for k in range(len(spans)):
        longest_span = max(longest_span, spans[k])
    for i in range(2):
        way[i] = most[0, i] + 8.0 / 27.0 * longest_span * most[1, i]
    return way[0], way[1]


@routine
def accept(table: Any, record: Any) -> int:
    """The memory of rows and nodes, and the room: nodes that cannot have come near are not looked
    at.
    """
    s = evaluation(table).space
    F = opened(record)
    ways = F.room + len(F.spans) + 1
    way = ahead(s, ways)
    many = len(F.rows)
    dim = F.dim
    second = 2 * F.dim * (len(F.spans) + 1)
    y, v, out, w = make_room(F)
    before = s.memory[F.memory : F.memory + many]
    read(table, F.rows, y)
    if not s.room[ways] > 0.0:
        s.room[ways], s.room[ways + 1] = find_ways(table, F, 0, F.spans)
        s.room[ways + 2], s.room[ways + 3] = find_ways(table, F, second, F.others)
    within = extents(F, y)
    for k in range(len(F.spans) + 1):
        first = F.memory + many + NODE * k
        seen = F.room + k
        N = 0.0
        met = (-1.0, -1.0)
        deep = 0.0
        last = s.memory[first : first + NODE]
        if s.room[seen] > way:
            s.room[seen] -= way
        else:
            s.room[seen] = (
                find_chord(y, 2 * dim * k, second, limits_of(F, k), within[0], dim)[0] - within[1]
            )
        if not s.room[seen] > 0.0:
            gap, p, q, _ = find(F, k, y, within, w)
            if gap < np.inf:
                met = p, q
            if gap < 0.0:
                read_rates(table, F, pieces(F, p, q), v)
                follow(F, v, before, p, q, w)
                N = press(F, k, before, last, p, q, w, out)
                deep = max(last[DEEPEST], -gap)
                for c in range(dim):
                    last[DEEPEST + 1 + c] = (
                        w[6, c] if last[DEEPEST] == 0.0 else last[DEEPEST + 1 + c]
                    )
        last[4], last[5], last[DEEPEST] = met[0], met[1], deep
        for i in range(2):
            last[2 + i] = w[12, i] if N > 0.0 else 0.0
        last[0], last[1] = max(N, 0.0), 1.0 if N <= 0.0 else last[1]
    for j in range(many):
        s.memory[F.memory + j] = y[j]
    return 0


@routine
def judge(table: Any, record: Any) -> int:
    """impulse += as of contact with shapes; infinite where beams passed through one another."""
    s = evaluation(table).space
    F = opened(record)
    way = ahead(s, F.room + len(F.spans) + 1)
    many = len(F.rows)
    y, v, out, w = make_room(F)
    before = s.memory[F.memory : F.memory + many]
    read_now = False
    within = (0.0, 0.0)
    for k in range(len(F.spans) + 1):
        first = F.memory + many + NODE * k
        N = 0.0
        last = s.memory[first : first + NODE]
        if s.room[F.room + k] > way and last[0] <= 0.0:
            continue
        if not read_now:
            read(table, F.rows, y)
            far, reach = extents(F, y)
            within = (far, reach + way)
            read_now = True
        gap, p, q, held = find(F, k, y, within, w)
        if not (
            gap + F.radii[0] + F.radii[1] >= way or loose(F, held)
        ):  # in the first step the way is not a number
            if crossed(F, k, w, before):
                s.impulse[0] = np.inf
                return 0
            find(F, k, y, within, w)
        if (
            F.along
            and last[DEEPEST] > 0.0
            and 0.0 <= gap < np.inf
            and came_through(F, k, w, last, before)
        ):
            s.impulse[0] = np.inf
            return 0
        if gap < 0.0:
            read_rates(table, F, pieces(F, p, q), v)
            follow(F, v, before, p, q, w)
            N = press(F, k, before, last, p, q, w, out)
        if last[1] > 0.0:
            add_change(s, N, last[0], F.share)
    return 0


@jit
def loose(F: Any, held: tuple[bool, bool]) -> bool:
    """Whether closest points are ends, about which beams may go."""
    return held[1] or (held[0] and not F.along)


@jit
def crossed(F: Any, k: int, w: np.ndarray, before: np.ndarray) -> bool:
    """Whether the closest points in w[0:6] of a node are on other sides than those with the rows
    `before`; w[0:6] become these.

    Nodes of beams along one another go around these as well: they have crossed where the straight
    way between both states does.
    """
    dim = F.dim
    reach = F.radii[0] + F.radii[1]
    d = np.zeros((2, 3))
    tangents = np.zeros((2, 3))
    read_normal(w, d[1], tangents, dim)
    gap, _, _, held = find(F, k, before, (extents(F, before)[0], np.inf), w)
    if not gap < np.inf or loose(F, held):
        return False
    read_normal(w, d[0], tangents, dim)
    along, squares, ways, near, square = 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(dim):
        square += d[1, c] * d[1, c]
        along += d[0, c] * d[1, c]
        ways += d[0, c] * (d[0, c] - d[1, c])
        squares += (d[0, c] - d[1, c]) ** 2
    if not F.along:
        return along < 0.0
    t = min(max(ways / squares, 0.0), 1.0) if squares > 0.0 else 0.0
    for c in range(dim):
        near += (d[0, c] + t * (d[1, c] - d[0, c])) ** 2
    # what grazes cuts off a nanometre: of ways from outside to outside only those count that turn
    # the normal
    least = GRAZED if gap >= 0.0 and square >= reach * reach else 0.0
    if near >= reach * reach or not (make_unit(d[0], 0.0) and make_unit(d[1], 0.0)):
        return False
    return cosine_across(d[0], d[1], tangents, 2) < least


@jit
def read_normal(w: np.ndarray, d: np.ndarray, tangents: np.ndarray, dim: int) -> None:
    """d (c,) = the way between the closest points in w[0:6], tangents (2, c) = those of both beams,
    B first.
    """
    for c in range(dim):
        d[c], tangents[0, c], tangents[1, c] = w[0, c] - w[3, c], w[4, c], w[1, c]


@jit
def came_through(F: Any, k: int, w: np.ndarray, last: np.ndarray, before: np.ndarray) -> bool:
    """Whether a node whose closest points in w[0:6] do not touch any more has gone through the
    other beam since it came in.
    """
    dim = F.dim
    reach = F.radii[0] + F.radii[1]
    d = np.zeros((2, 3))
    tangents = np.zeros((2, 3))
    if last[DEEPEST] < DEEP * reach:
        return False
    n0, v = np.zeros(3), np.zeros(3)
    second = 2 * dim * (len(F.spans) + 1)
    read_normal(w, d[1], tangents, dim)
    trace(before, 0, F.spans, last[4], 1, dim, w, 7)
    trace(before, second, F.others, last[5], 1, dim, w, 8)
    for c in range(dim):
        n0[c], v[c] = last[DEEPEST + 1 + c], d[1, c] - (w[7, c] - w[8, c])
    sided = make_unit(d[1], 0.0) and lay_across(n0, d[1], tangents, 2)
    return sided and goes_through(n0, d[1], v, last[DEEPEST], reach, LEAST)


@routine
def store(table: Any, record: Any) -> int:
    """energy += W times what is stored, and the elastic forces out of g."""
    s = evaluation(table).space
    F = opened(record)
    way = ahead(s, F.room + len(F.spans) + 1)
    many = len(F.rows)
    dim = F.dim
    if not is_active(s, F.room, len(F.spans) + 1, way):
        return 0
    y, out, w = np.empty(many), np.empty(8 * dim), np.empty((ROOM, 3))
    read(table, F.rows, y)
    within = extents(F, y)
    for k in range(len(F.spans) + 1):
        if s.room[F.room + k] > way:
            continue
        gap, p, q, _ = find(F, k, y, within, w)
        if gap < 0.0:
            places = pieces(F, p, q)
            weight = weigh(F, k, p)
            long = gap + F.radii[0] + F.radii[1]
            s.energy[0] += weight * stored(F.law, -gap)
            N = weight * F.law[K] * harden(F.law, ramp(-gap, F.law[E]))
            for c in range(dim):
                w[6, c], w[9, c] = (w[0, c] - w[3, c]) / long, 0.0
            share_out(F.spans, p, 1, 0.0, 0.0, N, w, out[: 4 * dim], dim)
            share_out(F.others, q, 4, 0.0, 0.0, -N, w, out[4 * dim :], dim)
            for j in range(8 * dim):
                s.g[F.rows[row_of(j, places, dim)]] -= out[j]
    return 0


@forces.compile_force.register
def _(found: BeamContacts, place: Place) -> Force:
    record = record_of(found, place)
    count = len(found.rows)
    memory = np.zeros(count + NODE * len(found))
    memory[count::NODE] = UNKNOWN
    routines = ForceRoutines(push, slopes, accept, store, judge)
    low = Size(len(found), 8 * found.dim, 3 * found.dim)
    return Force(
        record,
        routines,
        "contact of beams",
        memory=memory,
        damped=True,
        room=len(found) + WAYS,
        alone=record.rows,
        low=low,
    )
