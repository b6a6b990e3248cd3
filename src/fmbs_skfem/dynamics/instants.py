r"""States at instants between the steps of a run, from those at the steps around them.

With t = t_n + s h, and cardinal polynomials P (of the fifth degree) and C (of the third) of
Hermite,

    q(t)   =  P(q, q', q'')          q'(t) = C(q', q'')         q''(t), lambda(t) = the cubic through four steps

on smooth pieces: errors of order 6, 4, 4 and 4 for motions that are exact at the steps, so that
what is left is the error of the method. Derivatives of P would bring in differences of q and q',
which both err by h^2, over h.

Nothing is interpolated across an instant at which loads jump, or an event happens: on both sides of
it within its step

    q(t) = q_k + q'_k d + q''_k d^2 / 2 + q'''_k d^3 / 6,     d = t - t_k,

q'_k and q''_k likewise, from the step k on that side and the difference of q'' from the one beyond
it. Where forces begin and end, or controllers hold what they give, q'' jumps anywhere: there q is
the cubic C(q, q'), and the rest is linear. What forces keep is that at the end of the step, the
work is linear.

Accelerations at the start of elastic bodies balance loads that begin there by waves that belong to
the mesh: where q''(0) is farther from the quadratic through the three steps behind it than these
are large, the first step has that of the quadratic. With its own a plate under a torque that begins
had 15 J of strain energy there, for 2e-4 J at both ends of the step.

Source: Hairer, Norsett, Wanner, Solving ordinary differential equations I, 2nd ed., Springer 1993,
section II.6 (dense output).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .compiled_step.single_steps import SingleSteps
from .observers import Looks, Observer
from .scheme import steps_in
from .trajectory import Trajectory

if TYPE_CHECKING:
    from .run import OpenRun
    from .scheme import GeneralizedAlpha

SAME = 1e-6  #: of a step, within which an instant is the end of one
#: steps that are stored around the one before an instant: cubics at ends of smooth pieces need
#: these
AROUND = np.arange(-2, 4)


class Instants(Observer):
    """Gives a motion at times (s,) [s] of its own in place of those of its steps; integrate `every`
    of `steps`.
    """

    looks: Looks = "end"

    def __init__(self, times: np.ndarray, scheme: GeneralizedAlpha, duration: float) -> None:
        self.times, last = times, steps_in(scheme, duration)
        before = np.floor(times / scheme.step + SAME).astype(np.int64)
        #: which it reads
        self.steps = np.unique(np.clip(np.append(before[:, None] + AROUND, [0, last]), 0, last))

    def finish(self, run: OpenRun, motion: Trajectory) -> Trajectory:
        end = float(motion.times[-1])
        times = self.times[self.times <= end - SAME * run.scheme.step]
        cuts = [one.behind for parts in run.jumps.values() for one in parts] + [
            one.time for one in run.happened
        ]
        forces = run.model.arrays.forces
        # by controllers, which hold what they give
        given = run.source is not None and not isinstance(run.source, SingleSteps)
        rough = given or len(forces.judged) > 0 or not forces.smooth
        return at(
            motion,
            np.append(times, end),
            np.array(run.kept),
            np.sort(cuts),
            rough,
            SAME * run.scheme.step,
        )


def at(
    motion: Trajectory,
    times: np.ndarray,
    steps: np.ndarray,
    cuts: np.ndarray,
    rough: bool,
    near: float,
) -> Trajectory:
    """A motion at times (i,) [s], from its states after `steps` (s,), not across `cuts` (c,) [s].

    Times that are `near` [s] one of a state have that state. `rough` motions have accelerations
    that may jump anywhere.
    """
    motion, begun = without_first_waves(motion, steps), motion
    known = motion.times
    row = np.clip(np.searchsorted(known, times + near) - 1, 0, max(len(known) - 2, 0))
    closest = np.where(
        np.abs(times - known[row]) <= near,
        row,
        np.where(times >= known[row + 1] - near, row + 1, -1),
    )
    first, last = known[:-1], known[1:]
    # of every interval: the first and the last cut behind its begin, none of intervals that have
    # none
    low, high = (
        np.searchsorted(cuts, first + near, "right"),
        np.searchsorted(cuts, last + near, "right"),
    )
    # loads that jump at the start do so behind the first state
    start = np.searchsorted(cuts, near, "right")
    low[0] = 0 if start else low[0]
    cut = high > low
    whole = ~cut & (np.diff(steps) == 1)
    piece = np.append(0, np.cumsum(~whole))  # of every state: which smooth piece it is in
    d = times - known[row]
    h = (last - first)[row]
    s = (d / h)[:, None]
    x, v, a = (part[row] for part in (motion.x, motion.v, motion.a))
    x1, v1, a1 = (part[row + 1] for part in (motion.x, motion.v, motion.a))
    h = h[:, None]
    if rough:
        found = [
            cubic(s, x, x1, h * v, h * v1),
            linear(s, v, v1),
            linear(s, a, a1),
            linear(s, *ends(motion.multipliers, row)),
        ]
    else:
        found = [
            quintic(s, x, x1, h * v, h * v1, h * h * a, h * h * a1),
            cubic(s, v, v1, h * a, h * a1),
        ]
        found += [
            through_four(part, known, piece, row, times) for part in (motion.a, motion.multipliers)
        ]
    for side, which in (
        (0, cut[row] & (times <= earliest(cuts, low, row))),
        (1, cut[row] & (times > latest(cuts, high, row))),
    ):
        for own, part in zip(
            found, from_one_side(motion, piece, row + side, 2 * side - 1, times), strict=True
        ):
            own[which] = part[which]
    exact = closest >= 0
    for own, part in zip(found, (motion.x, motion.v, begun.a, motion.multipliers), strict=True):
        own[exact] = part[closest[exact]]
    behind = np.where(exact, closest, row + 1)
    memory = None if motion.memory is None else motion.memory[behind]
    work = (
        None
        if motion.work is None
        else np.where(exact, motion.work[behind], linear(s[:, 0], *ends(motion.work, row)))
    )
    x, v, a, multipliers = found
    return replace(
        motion, times=times, x=x, v=v, a=a, multipliers=multipliers, memory=memory, work=work
    )


def without_first_waves(motion: Trajectory, steps: np.ndarray) -> Trajectory:
    """A motion from the start on with q'' of the first state from the three steps behind it, where
    it is farther from that than these are large.

        q''_0 = 3 q''_1 - 3 q''_2 + q''_3
    """
    if not np.array_equal(steps[:4], np.arange(4)):
        return motion
    a = motion.a.copy()
    a[0] = 3.0 * (a[1] - a[2]) + a[3]
    size = np.linalg.norm(a[1:4], axis=1).max(initial=0.0)
    return replace(motion, a=a) if np.linalg.norm(motion.a[0] - a[0]) > size else motion


def ends(part: np.ndarray, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What a part has at both ends of intervals."""
    return part[row], part[row + 1]


def earliest(cuts: np.ndarray, low: np.ndarray, row: np.ndarray) -> np.ndarray:
    """The first cut (i,) in the intervals of some rows [s]."""
    return cuts[np.minimum(low[row], len(cuts) - 1)] if len(cuts) else np.zeros(len(row))


def latest(cuts: np.ndarray, high: np.ndarray, row: np.ndarray) -> np.ndarray:
    """The last one."""
    return cuts[np.maximum(high[row] - 1, 0)] if len(cuts) else np.zeros(len(row))


def linear(s: np.ndarray, y: np.ndarray, y1: np.ndarray) -> np.ndarray:
    """The line through y at 0 and y1 at 1.

        y + s (y1 - y)

    s in [0, 1].
    """
    return np.asarray(y + s * (y1 - y))


def cubic(
    s: np.ndarray, y: np.ndarray, y1: np.ndarray, d: np.ndarray, d1: np.ndarray
) -> np.ndarray:
    """The cubic with y, y1 and slopes d, d1 at 0 and 1.

        (1 - s)^2 ((1 + 2 s) y + s d) + s^2 ((3 - 2 s) y1 - (1 - s) d1)

    s in [0, 1].
    """
    r = 1.0 - s
    return np.asarray(
        r * r * ((1.0 + 2.0 * s) * y + s * d) + s * s * ((1.0 + 2.0 * r) * y1 - r * d1)
    )


def quintic(
    s: np.ndarray,
    y: np.ndarray,
    y1: np.ndarray,
    d: np.ndarray,
    d1: np.ndarray,
    c: np.ndarray,
    c1: np.ndarray,
) -> np.ndarray:
    """The quintic with y, y1, slopes d, d1 and second derivatives c, c1 at 0 and 1.

        H(s, y, d, c) + H(1 - s, y1, - d1, c1),    H = (1 - s)^3 ((1 + 3 s + 6 s^2) y + s (1 + 3 s) d + s^2 c / 2)

    s in [0, 1].
    """
    r = 1.0 - s

    def half(
        s: np.ndarray, r: np.ndarray, y: np.ndarray, d: np.ndarray, c: np.ndarray
    ) -> np.ndarray:
        return np.asarray(
            r**3 * ((1.0 + 3.0 * s + 6.0 * s * s) * y + s * (1.0 + 3.0 * s) * d + 0.5 * s * s * c)
        )

    return half(s, r, y, d, c) + half(r, s, y1, -d1, c1)


def through_four(
    part: np.ndarray, known: np.ndarray, piece: np.ndarray, row: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """The cubic at times (i,) through four rows (s, n) of one piece about an interval, or the line
    through its ends.
    """
    found = linear(
        ((times - known[row]) / (known[row + 1] - known[row]))[:, None], *ends(part, row)
    )
    done = np.zeros(len(row), bool)
    for begin in (-1, 0, -2):  # about the middle, where that is possible
        first = row + begin
        there = ~done & (first >= 0) & (first + 3 < len(known))
        there[there] = piece[first[there]] == piece[first[there] + 3]
        rows = first[there, None] + np.arange(4)
        nodes = known[rows]
        own = np.zeros((int(there.sum()), part.shape[1]))
        for k in range(4):
            others = [j for j in range(4) if j != k]
            weight = np.prod(
                (times[there, None] - nodes[:, others]) / (nodes[:, [k]] - nodes[:, others]), axis=1
            )
            own += weight[:, None] * part[rows[:, k]]
        found[there], done = own, done | there
    return found


def from_one_side(
    motion: Trajectory, piece: np.ndarray, row: np.ndarray, beyond: int, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """x, v, a and multipliers at times (i,) from the states of some rows, and those `beyond` them
    (-1 or 1) in the same piece.
    """
    other = np.clip(row + beyond, 0, len(motion.times) - 1)
    same = (piece[other] == piece[row]) & (other != row)
    span = np.where(same, motion.times[row] - motion.times[other], 1.0)[:, None]
    x, v, a, held = (part[row] for part in (motion.x, motion.v, motion.a, motion.multipliers))
    change, pull = (
        np.where(same[:, None], (part[row] - part[other]) / span, 0.0)
        for part in (motion.a, motion.multipliers)
    )
    d = (times - motion.times[row])[:, None]
    moved = x + d * (v + d * (0.5 * a + d * change / 6.0)), v + d * (a + 0.5 * d * change)
    return *moved, a + d * change, held + d * pull
