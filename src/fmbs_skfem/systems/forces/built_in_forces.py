r"""Forces of this package by a law: along a coordinate of probe rows, or with a vector that they
carry.

    F = f dc/dy,     dF/dy + gh dF/dv = f c'' + dc/dy ((f_c + gh f_r) dc/dy + f_r c'' v)^T,     r = dc/dt = dc/dy . v

    distance        c = |y|                                 row      c = y
    slide           c = p . d                               along a vector p that is carried
    angle           c = arg w [- arg of another arm]        w = y_0 + i y_1, with its turns counted
    angle in space  c = arg w                               w = u . p + i u . q

    spring          f = - k (c - c0) - d r                  potential k (c - c0)^2 / 2
    rope, stop      f = - sign N,  N = k ramp(s) + d touch(s) s',  s = sign (c - c0)        see `one_sided`
    constant pull   f = - p h(t)

    F = h (a x + m x x) / |x|^n                             moment  n = 2 on the slope or axis x,  follower  n = 1 on a position
    F = p h(t)                                              dead, whatever the state

arg gives an angle but for whole turns; its value is the one nearest to that of the last accepted
state, so that it may change by up to half a turn in a step.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiling.angles import continued
from ...core.compiling.jit import inlined, jit
from ...core.compiling.structs import Routine, routine
from ..connections.gears import inverse
from ..evaluation import Space, add_change, evaluation
from ..kernels import dot, factor
from .force_laws import IMPACT, ForceLaw, ForceRecord, opened
from .one_sided import closing, keeps, kept, lift, ramp, touch

SMALLEST = 1e-60  #: of the square of a length, whose derivatives are numbers where it is zero, too
#: rows of the room of a coordinate: y, v, dc/dy, and from there on c'' where that is wanted
Y, V, SLOPE, SECOND = range(4)


@jit
def distance(room: np.ndarray, last: float) -> float:
    """|y|."""
    y = room[Y]
    c = math.sqrt(dot(y, y) + SMALLEST)
    for i in range(len(y)):
        room[SLOPE, i] = y[i] / c
    for i in range(len(room) - SECOND):
        for j in range(len(y)):
            room[SECOND + i, j] = ((i == j) - room[SLOPE, i] * room[SLOPE, j]) / c
    return c


@jit
def row(room: np.ndarray, last: float) -> float:
    """y."""
    room[SLOPE, 0] = 1.0
    room[SECOND:] = 0.0
    return room[Y, 0]


@jit
def slide(room: np.ndarray, last: float) -> float:
    """A coordinate along a direction that turns.

        c = p . d

    of the rows p, then d.
    """
    c = 0.0
    half = room.shape[1] // 2
    room[SECOND:] = 0.0
    for i in range(half):
        c += room[Y, i] * room[Y, half + i]
        room[SLOPE, i], room[SLOPE, half + i] = room[Y, half + i], room[Y, i]
        if len(room) > SECOND:
            room[SECOND + i, half + i] = room[SECOND + half + i, i] = 1.0
    return c


@jit
def angle(room: np.ndarray, last: float) -> float:
    """arg w, or the difference of two."""
    c, sign = 0.0, 1.0
    room[SECOND:] = 0.0
    for i in range(0, room.shape[1], 2):
        w = complex(room[Y, i], room[Y, i + 1])
        by = sign * inverse(w)  # derivatives of log w
        twice = -by * inverse(w)
        room[SLOPE, i], room[SLOPE, i + 1] = by.imag, by.real
        if len(room) > SECOND:
            room[SECOND + i, i], room[SECOND + i + 1, i + 1] = twice.imag, -twice.imag
            room[SECOND + i, i + 1] = room[SECOND + i + 1, i] = twice.real
        c = c + sign * math.atan2(w.imag, w.real)
        sign = -sign
    return continued(c, last)


@jit
def angle_in_space(room: np.ndarray, last: float) -> float:
    """arg w of the rows u, p, q."""
    u = room[Y, :3]
    p = room[Y, 3:6]
    q = room[Y, 6:]
    s = np.empty(9, np.complex128)
    w = complex(dot(u, p), dot(u, q))
    by = inverse(w)
    for i in range(3):  # derivatives of log w
        s[i], s[3 + i], s[6 + i] = (
            by * complex(p[i], q[i]),
            by * u[i],
            complex(0.0, 1.0) * by * u[i],
        )
    for i in range(9):
        room[SLOPE, i] = s[i].imag
        for j in range(len(room) - SECOND):
            room[SECOND + j, i] = -(s[i] * s[j]).imag
    for i in range(3 if len(room) > SECOND else 0):
        for j, part in ((3 + i, by.imag), (6 + i, by.real)):
            room[SECOND + i, j] += part
            room[SECOND + j, i] += part
    return continued(math.atan2(w.imag, w.real), last)


@jit
def spring(c: float, r: float, p: np.ndarray, h: float) -> tuple[float, float, float, float, float]:
    """Force along a coordinate c with the rate r, its derivatives, its potential and the derivative
    of that.

        f = - k (c - c0) - d r,    df/dc = - k,    df/dr = - d,    k (c - c0)^2 / 2,    k (c - c0)

    p holds stiffness k, damping d and c0.
    """
    s = c - p[2]
    return -p[0] * s - p[1] * r, -p[0], -p[1], 0.5 * p[0] * s * s, p[0] * s


@jit
def side(
    sign: float, c: float, r: float, p: np.ndarray
) -> tuple[float, float, float, float, float]:
    """Force on one side of a coordinate c with the rate r, as of `spring`.

        f = - sign N,    N = k ramp(s) + d touch(s) s',    s = sign (c - c0)

    p holds stiffness k, damping d, c0, length of transition, and whether what is never negative is
    cut there.
    """
    s = sign * (c - p[2])
    N = p[0] * ramp(s, p[3]) + p[1] * touch(s, p[3]) * sign * r
    on = keeps(N, p[4])
    by = on * (p[0] * touch(s, p[3]) + p[1] * closing(s, p[3]) * sign * r)
    return (
        -sign * kept(N, p[4]),
        -by,
        -on * p[1] * touch(s, p[3]),
        p[0] * lift(s, p[3]),
        sign * p[0] * ramp(s, p[3]),
    )


@jit
def one_sided(
    c: float, r: float, p: np.ndarray, h: float
) -> tuple[float, float, float, float, float]:
    """A rope, or with the sign -1 a stop: p sign, then those of a side."""
    return side(p[0], c, r, p[1:])


@jit
def below(c: float, r: float, p: np.ndarray, h: float) -> tuple[float, float, float, float, float]:
    """A stop."""
    return side(-1.0, c, r, p)


@jit
def constant(
    c: float, r: float, p: np.ndarray, h: float
) -> tuple[float, float, float, float, float]:
    """A pull along a coordinate c.

        f = - p h(t),    with the potential p h c

    as of `spring`.
    """
    return -h * p[0], 0.0, 0.0, h * p[0] * c, h * p[0]


@jit
def read(s: Space, F: ForceRecord, k: int, room: np.ndarray) -> np.ndarray:
    """The room with the rows of group k and their rates."""
    for i in range(room.shape[1]):
        room[Y, i], room[V, i] = s.y[F.rows[k, i]], s.rates[F.rows[k, i]]
    return room


@jit
def history(s: Space, F: ForceRecord, k: int) -> float:
    """h(t) of group k, 1 without one."""
    return factor(s.signals, F.signals[k, 0]) if F.signals.shape[1] else 1.0


@jit
def push(s: Space, F: ForceRecord, k: int, f: float, room: np.ndarray) -> None:
    """g += f dc/dy."""
    for i in range(room.shape[1]):
        s.g[F.rows[k, i]] += f * room[SLOPE, i]


def along(
    name: str,
    rows: int,
    coordinate: Any,
    law: Any,
    numbers: int = 3,
    histories: int = 0,
    damped: bool = True,
    turns: int = 0,
    smooth: bool = True,
    judged: bool = False,
) -> ForceLaw:
    """A law along a coordinate of probe rows; the last number of one that is `judged` is the share
    of `contacts.Touch.share`.
    """

    # inlined, so that a routine computes no more than it reads of the law: 8 springs take 12.1 us a
    # step, 13.2 by a call
    @inlined
    def at(
        s: Space, F: ForceRecord, k: int, room: np.ndarray
    ) -> tuple[float, float, float, float, float]:
        """What the law says of group k, whose coordinate is in the room."""
        c = coordinate(read(s, F, k, room), s.memory[F.memory + k] if turns else 0.0)
        found: tuple[float, float, float, float, float] = law(
            c, dot(room[SLOPE], room[V]), F.numbers[k], history(s, F, k)
        )
        return found

    @routine
    def force(table: Any, record: Any) -> int:
        s = evaluation(table).space
        F = opened(record)
        room = np.empty((SECOND, rows))
        for k in range(len(F.rows)):
            push(s, F, k, at(s, F, k, room)[0], room)
        return 0

    @routine
    def slopes(table: Any, record: Any) -> int:
        s = evaluation(table).space
        F = opened(record)
        room = np.empty((SECOND + rows, rows))
        place = F.pair
        for k in range(len(F.rows)):
            f, by, of_rate, _, _ = at(s, F, k, room)
            for i in range(rows):
                for j in range(rows):
                    change = (by + s.gh[0] * of_rate) * room[SLOPE, j] + of_rate * dot(
                        room[SECOND + j], room[V]
                    )
                    s.H[place] -= s.c[0] * (f * room[SECOND + i, j] + room[SLOPE, i] * change)
                    place += 1
        return 0

    @routine
    def energy(table: Any, record: Any) -> int:
        s = evaluation(table).space
        F = opened(record)
        room = np.empty((SECOND, rows))
        for k in range(len(F.rows)):
            _, _, _, stored, by = at(s, F, k, room)
            s.energy[0] += stored
            push(s, F, k, by, room)
        return 0

    pairs = tuple((i, j) for i in range(rows) for j in range(rows))
    remember, judge = (
        impacts(at, rows, numbers)
        if judged
        else (
            keep_turns(coordinate, rows) if turns else None,
            None,
        )
    )
    return ForceLaw(
        name=name,
        rows=rows,
        numbers=numbers,
        histories=histories,
        pairs=pairs,
        memory=turns,
        damped=damped,
        force=force,
        slopes=slopes,
        accept=remember,
        energy=energy,
        judge=judge,
        smooth=smooth,
    )


def keep_turns(coordinate: Any, rows: int) -> Routine:
    """What keeps the angles of accepted states, by which the next ones know their turns."""

    @routine
    def remember(table: Any, record: Any) -> int:
        s = evaluation(table).space
        F = opened(record)
        room = np.empty((SECOND, rows))
        for k in range(len(F.rows)):
            s.memory[F.memory + k] = coordinate(read(s, F, k, room), s.memory[F.memory + k])
        return 0

    return remember


def impacts(at: Any, rows: int, numbers: int) -> tuple[Routine, Routine]:
    """What a law `at` (s, F, k, room) keeps of accepted states, and how it judges a change of its
    force since then.
    """

    @routine
    def remember(table: Any, record: Any) -> int:
        s = evaluation(table).space
        F = opened(record)
        room = np.empty((SECOND, rows))
        for k in range(len(F.rows)):
            first = F.memory + IMPACT * k
            s.memory[first] = abs(at(s, F, k, room)[0])
            if s.memory[first] == 0.0:
                s.memory[first + 1] = 1.0
        return 0

    @routine
    def judge(table: Any, record: Any) -> int:
        """As of contact: what has touched from the start on is no impact."""
        s = evaluation(table).space
        F = opened(record)
        room = np.empty((SECOND, rows))
        for k in range(len(F.rows)):
            first = F.memory + IMPACT * k
            if s.memory[first + 1] > 0.0:
                add_change(s, abs(at(s, F, k, room)[0]), s.memory[first], F.numbers[k, numbers - 1])
        return 0

    return remember, judge


@jit
def about(p: np.ndarray) -> tuple[float, float, float, float]:
    """a and m of a moment p, about z or in space."""
    return (0.0, 0.0, 0.0, p[0]) if len(p) == 1 else (0.0, p[0], p[1], p[2])


@jit
def follow(p: np.ndarray) -> tuple[float, float, float, float]:
    """a and m of a force p along a slope and, in the plane, its normal."""
    return p[0], 0.0, 0.0, p[1] if len(p) == 2 else 0.0


@jit
def carry(
    s: Space,
    F: ForceRecord,
    k: int,
    dim: int,
    power: int,
    parts: tuple[float, float, float, float],
    room: np.ndarray,
) -> float:
    """Force of a vector x of group k that turns with it, as a matrix; the square of its length.

        h (a 1 + [m x]) / |x|^n

    in `room` (4, 3), above x.
    """
    square = 0.0
    for i in range(dim):
        room[3, i] = s.y[F.rows[k, i]]
        square += room[3, i] ** 2
    scale = history(s, F, k) / (square if power == 2 else math.sqrt(square))
    a, m_x, m_y, m_z = scale * parts[0], scale * parts[1], scale * parts[2], scale * parts[3]
    room[0, 0], room[0, 1], room[0, 2] = a, -m_z, m_y
    room[1, 0], room[1, 1], room[1, 2] = m_z, a, -m_x
    room[2, 0], room[2, 1], room[2, 2] = -m_y, m_x, a
    return square


def carried(name: str, dim: int, numbers: int, rule: Any, power: int, first: int) -> ForceLaw:
    """A law with a vector in the first rows, which pushes those from `first` on."""

    @routine
    def force(table: Any, record: Any) -> int:
        s = evaluation(table).space
        F = opened(record)
        room = np.zeros((4, 3))
        for k in range(len(F.rows)):
            carry(s, F, k, dim, power, rule(F.numbers[k]), room)
            for i in range(dim):
                s.g[F.rows[k, first + i]] += dot(room[i], room[3])
        return 0

    @routine
    def slopes(table: Any, record: Any) -> int:
        s = evaluation(table).space
        F = opened(record)
        room = np.zeros((4, 3))
        place = F.pair
        for k in range(len(F.rows)):
            square = carry(s, F, k, dim, power, rule(F.numbers[k]), room)
            for i in range(dim):
                for j in range(dim):
                    s.H[place] -= s.c[0] * (
                        room[i, j] - power * dot(room[i], room[3]) * room[3, j] / square
                    )
                    place += 1
        return 0

    pairs = tuple((first + i, j) for i in range(dim) for j in range(dim))
    return ForceLaw(
        name,
        first + dim,
        numbers,
        1,
        pairs,
        memory=0,
        damped=False,
        force=force,
        slopes=slopes,
        smooth=True,
    )


@routine
def push_dead(table: Any, record: Any) -> int:
    s = evaluation(table).space
    F = opened(record)
    for k in range(len(F.rows)):
        s.g[F.rows[k, 0]] += F.numbers[k, 0] * history(s, F, k)
    return 0


KNOWN = (
    ForceLaw("dead", 1, 1, 1, (), memory=0, damped=False, force=push_dead, smooth=True),
    carried("moment_2", 2, 1, about, 2, 0),
    carried("moment_3", 3, 3, about, 2, 0),
    carried("follower_2", 2, 2, follow, 1, 2),
    carried("follower_3", 3, 1, follow, 1, 3),
    along("torsion_spring", 2, angle, spring, turns=1),
    along("relative_torsion_spring", 4, angle, spring, turns=1),
    along("spatial_torsion_spring", 9, angle_in_space, spring, turns=1),
    along("slide_2", 4, slide, spring),
    along("slide_3", 6, slide, spring),
    along("spring", 3, distance, spring),
    along("one_sided", 3, distance, one_sided, 6, smooth=False),
    along("one_sided_plane", 1, row, below, 5, smooth=False),
    along("impact", 3, distance, one_sided, 7, smooth=False, judged=True),
    along("impact_plane", 1, row, below, 6, smooth=False, judged=True),
    along("constant_pull", 3, distance, constant, 1, 1, False),
)
LAWS = {law.name: law for law in KNOWN}
