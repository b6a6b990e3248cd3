r"""Limit cycles: motions that end in a periodic one which keeps itself up, as stick-slip and other
self-excited vibrations do.

    |x(t + T) - x(t)| <= SAME range        over the last CYCLES periods, for one output, and for none of the others much more
    L = max_s |W(t0 + s) - W(t0 - s)| > FED max E,   |W(t + T) - W(t)| <= EVEN L       in a period: what is fed is dissipated
    |x(t + T) - x(t)| > AWAY range         or a range so different, before: the cycle was approached from another motion

W is the work of all that has no potential, E the kinetic energy, t0 where x is largest. What swings
without loss has an even W; what decays loses all of L; what is driven has histories that change. A
motion of which this cannot be said with certainty is not spoken of.

S. H. Strogatz, Nonlinear Dynamics and Chaos, CRC Press 2015, ch. 7.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...core.storage.records import dataclass
from ...systems.compiled import signal_table
from ...systems.measures import probes
from ...systems.system import System
from ..outputs import energies
from ..trajectory import Trajectory

UNITS = ("m", "rad", "m/s", "rad/s")  #: of outputs that tell a motion
CYCLES = 6  #: periods that have to be alike
MOST = 4  #: crossings of the middle, upwards, in a period
FINE = 20  #: stored instants in a period, at least; the shape between them is not known
#: difference over the range: half as much is met by the interpolation of 60 instants a period
SAME = 2e-3
STILL = 1e-6  #: range over the largest one of its unit, up to which a column is at rest
ON = 0.01  #: by which a motion has reached its cycle
AWAY = 0.1  #: by which it was elsewhere before
#: of a change when the cycle was reached, that is left at the end; of a decay most is
SETTLED = 0.2
FED = 2e-3  #: work within a period that is not even, over the largest kinetic energy
EVEN = 0.05  #: what of it is left behind a period; of a decay it is all
BENT = 1e-9  #: second difference of a history, over its largest value, by which it changes
INSTANTS = 2000  #: at which histories are looked at
WHOLE = 0.02  #: of a turn, by which a steady drive is in step with the motion


@dataclass(frozen=True)
class LimitCycle:
    """A limit cycle, as an output shows it."""

    column: str
    unit: str
    period: float  #: [s]
    amplitude: float  #: half of its range, in its unit
    since: float  #: [s]


def find(motion: Trajectory, outputs: Mapping[str, np.ndarray]) -> LimitCycle | None:
    """The limit cycle in which a motion with these output columns (s,) ends, of the column with the
    longest period; None where there is none for certain.
    """
    times = motion.times
    if motion.work is None or len(times) < FINE * CYCLES or (np.diff(times) <= 0.0).any():
        return None
    start = max([quiet_since(motion.system, times), *(one.time for one in motion.events)])
    units = probes.column_units(motion.system.outputs)
    ranges = {
        name: float(np.ptp(values))
        for name, values in outputs.items()
        if units.get(name) in UNITS and np.isfinite(values).all()
    }
    known = {
        name: outputs[name]
        for name in ranges
        if ranges[name] > STILL * max(ranges[one] for one in ranges if units[one] == units[name])
    }
    found = {name: period_of(times, values, start) for name, values in known.items()}
    period = max(found.values(), default=0.0)
    if not period or in_step(motion.system, times, period):
        return None
    end = times[-1] - (CYCLES + 1) * period
    if any(change(times, values, period, end)[1].max() > ON for values in known.values()):
        return None
    name = next(name for name, one in found.items() if one > (1.0 - SAME) * period)
    column = known[name]
    if not keeps_itself_up(motion, column, period):
        return None
    since, amplitude = settled_since(times, column, period, start)
    return LimitCycle(name, units[name], period, amplitude, since) if since > start else None


def settled_since(
    times: np.ndarray, values: np.ndarray, period: float, start: float
) -> tuple[float, float]:
    """When a column (s,) has reached its cycle, `start` where it has not come from elsewhere or
    still changes as it did [s]; half of its range then.
    """
    grid, apart = change(times, values, period, start)
    begins = np.arange(times[-1] - period, start, -period)
    inside = [values[(times >= one) & (times <= one + period)] for one in begins]
    ranges = np.array([np.ptp(one) for one in inside])
    amplitude = 0.5 * float(ranges[0])
    unlike = np.abs(ranges / ranges[0] - 1.0)
    late = [*grid[apart > ON][-1:], *begins[unlike > 2.0 * ON][:1]]
    since = float(max(late, default=start))
    before = apart[(grid <= since) & (grid >= since - period)].max()
    ended = apart[grid >= times[-1] - CYCLES * period].max()
    approached = max(unlike.max(), apart.max()) > AWAY and ended <= SETTLED * before
    return (since if approached else start), amplitude


def quiet_since(system: System, times: np.ndarray) -> float:
    """When the last history of a run stops to change other than at a constant rate [s]."""
    grid = np.linspace(times[0], times[-1], INSTANTS)
    table = signal_table(system, grid)
    bends = np.abs(np.diff(table, 2, axis=0)) > BENT * np.abs(table).max(axis=0, initial=0.0)
    moving = np.flatnonzero(bends.any(axis=1))
    return float(grid[moving[-1] + 2]) if len(moving) else float(grid[0])


def in_step(system: System, times: np.ndarray, period: float) -> bool:
    """Whether a history that changes at a constant rate may make the period: an angle, whose turns
    fit.
    """
    table = signal_table(system, times[-1] - np.array([period, 0.0]))
    turns = np.abs(table[1] - table[0]) / (2.0 * np.pi)
    return bool((np.abs(turns - np.round(turns)) < WHOLE)[turns > 0.0].any())


def period_of(times: np.ndarray, values: np.ndarray, start: float) -> float:
    """The period of the end of a column (s,) [s]; 0 where it has none."""
    late = times >= 0.5 * (start + times[-1])
    low, high = values[late].min(), values[late].max()
    middle = 0.5 * (low + high)
    if not high - low > ON * np.abs(values - middle).max():
        return 0.0
    t, x = times[times >= start], values[times >= start]
    up = np.flatnonzero((x[:-1] < middle) & (x[1:] >= middle))
    share = (middle - x[up]) / (x[up + 1] - x[up])
    crossings = t[up] + share * (t[up + 1] - t[up])
    for count in range(1, MOST + 1):
        if len(crossings) <= count * CYCLES:
            return 0.0
        period = float(crossings[-1] - crossings[-1 - count * CYCLES]) / CYCLES
        end = times[-1] - (CYCLES + 1) * period
        fine = period > FINE * float(np.diff(t).max())
        if fine and end >= start and change(times, values, period, end)[1].max() <= SAME:
            return period
    return 0.0


def change(
    times: np.ndarray, values: np.ndarray, period: float, start: float
) -> tuple[np.ndarray, np.ndarray]:
    """Even instants (i,) from `start` on, and |x(t + T) - x(t)| there over the range of the last
    period, without a shift a period as of an angle that grows.
    """
    from scipy.interpolate import CubicSpline

    curve = CubicSpline(times, values)  # straight lines err by 4e-3 of a sine of 35 instants
    end = times[-1] - period
    grid = np.linspace(start, end, max(2, round((end - start) / float(np.diff(times).max()))) + 1)
    apart = curve(grid + period) - curve(grid)
    shift = float(np.median(apart[grid >= end - period]))
    late = times >= end
    size = float(np.ptp(values[late] - shift / period * times[late]))
    # what moves on evenly, as a belt, has no range of its own
    return grid, np.abs(apart - shift) / max(size, STILL * float(np.ptp(values)))


def keeps_itself_up(motion: Trajectory, values: np.ndarray, period: float) -> bool:
    """Whether forces without potential take as much as they give in a period, and not nothing.

    The work W of forces whose potential is not known is even about the instant at which a column
    (s,) is largest, W of what feeds and dissipates is not.
    """
    assert motion.work is not None
    times, W = motion.times, motion.work
    near = np.flatnonzero((times >= times[-1] - 1.5 * period) & (times <= times[-1] - 0.5 * period))
    top = times[near[values[near].argmax()]]
    aside = np.linspace(0.0, 0.5 * period, FINE * 5)
    loop = np.abs(np.interp(top + aside, times, W) - np.interp(top - aside, times, W)).max()
    net = abs(W[-1] - np.interp(times[-1] - CYCLES * period, times, W)) / CYCLES
    largest = energies(motion)[times >= times[-1] - period, 0].max()
    return bool(loop > FED * largest and net <= EVEN * loop)
