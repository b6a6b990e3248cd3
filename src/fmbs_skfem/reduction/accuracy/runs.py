r"""Runs that can be compared: which steps are stored, the fastest of several runs, and the error of
the step itself.

error of h from halving the step:  e_h = 4/3 |q_h - q_h/2|,   order = log2 |q_h - q_h/2| / |q_h/2 - q_h/4|
or from doubling it:  e_h = 1/3 |q_h - q_2h|
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...core.storage.records import dataclass
from ...dynamics.trajectory import Trajectory
from .. import cases
from ..cases import Case
from .errors import compare

SAMPLES = 2000  #: instants that are compared, at least, where a run has as many steps
PATIENCE = 1.5  #: runs that cost more are not repeated [s]
START = 10  #: samples in the first interval between listed snapshots
NEAR = 1e-6  #: part of a step that is round-off


@dataclass(frozen=True)
class TimeError:
    """Error of the full model's own step, from halving or doubling it.

        e_h = 4/3 |q_h - q_h/2|    or    1/3 |q_h - q_2h|

    for a method of second order: `position`, `distance` and `relative` are of the step h itself.
    """

    step: float  #: [s]
    difference: float  #: largest distance of the motions with h and h/2, or h and 2h [m]
    position: float  #: error of h, 4/3 or 1/3 of it [m]
    distance: float  #: the same as root mean square over the mass [m]
    relative: float  #: and over the largest displacement
    order: float | None  #: observed, with h/4


def kept_steps(case: Case, interval: float | np.ndarray) -> np.ndarray:
    """Numbers of the steps whose states are stored: those of the snapshots, or so many that there
    are enough samples.

    The first interval between listed snapshots is divided further, so that errors in a transient at
    the start are seen.
    """
    steps = round(case.duration / case.scheme.step)
    if isinstance(interval, np.ndarray):
        numbers = np.round(interval / case.scheme.step).astype(np.int64)
        first = int(numbers[numbers > 0].min(initial=steps))
        return np.union1d(numbers, [*range(0, first, max(1, first // START)), steps])
    return np.arange(0, steps + 1, stride(case, interval))


def stride(case: Case, interval: float) -> int:
    """Steps between stored states: as many as leave enough samples and divide the interval of the
    snapshots.
    """
    between = max(1, round(interval / case.scheme.step))
    steps = case.duration / case.scheme.step
    return max(
        d for d in range(1, between + 1) if between % d == 0 and (d == 1 or steps / d >= SAMPLES)
    )


def run_fastest(case: Case, kept: np.ndarray, repeat: int) -> Trajectory:
    """The motion, stored after the steps `kept`, with the least CPU and wall time of several runs.

    Runs are repeated only where the first costs less than 1.5 s. The motion is that of the first,
    CPU and wall time are the least of all.
    """
    best = cases.run(case, kept)
    for _ in range(repeat - 1 if best.statistics.cpu_s < PATIENCE else 0):
        again = cases.run(cases.unchecked(case), kept).statistics
        cpu, wall = (
            min(again.cpu_s, best.statistics.cpu_s),
            min(again.wall_s, best.statistics.wall_s),
        )
        best = replace(best, statistics=replace(best.statistics, cpu_s=cpu, wall_s=wall))
    return best


def run_other_steps(
    case: Case, kept: np.ndarray, steps: Sequence[float], order: bool, expensive: bool
) -> dict[float, Trajectory]:
    """The full model with h/2 and, for the order, h/4; where it is expensive, with those of the
    wanted steps that are h/2 or 2h.

    The motions by their step [s], stored at the instants of the steps `kept` (s,) of h that they
    reach.
    """
    h = case.scheme.step
    case = cases.unchecked(case)
    ratios: tuple[float, ...] = (2.0, 4.0) if order else (2.0,)
    if expensive:
        ratios = tuple(
            ratio for ratio in (2.0, 0.5) if any(math.isclose(step, h / ratio) for step in steps)
        )
    return {
        h / ratio: cases.run(cases.with_step(case, h / ratio), common_steps(h / ratio, h, kept))
        for ratio in ratios
    }


def step_error(
    full: Trajectory, others: Mapping[float, Trajectory], step: float
) -> TimeError | None:
    """Error of the step from runs with h/2 and, for the order, h/4; or from a run with 2h.

    `others` are motions by their step [s], as `run_other_steps` gives them; None where there are
    none.
    """
    if not others:
        return None
    near, *further = others
    first = compare(full, others[near])
    factor = 4 / 3 if near < step else 1 / 3
    apart = first.summary["position_error"]
    order = None
    if further and further[0] < near:
        second = compare(others[near], others[further[0]]).summary["position_error"]
        order = math.log2(apart / second) if apart * second > 0.0 else None
    distance = first.summary["distance_error"]
    return TimeError(step, apart, factor * apart, factor * distance, factor * first.maximum, order)


def common_steps(step: float, h: float, kept: np.ndarray) -> np.ndarray:
    """Numbers of the steps of another size at those instants of the full run's stored states that
    they reach.

    `kept` (s,) are numbers of steps of length h [s], the result (k,) those of steps of length
    `step` [s].
    """
    numbers = kept * (h / step)
    return np.round(numbers[np.abs(numbers - np.round(numbers)) < NEAR]).astype(np.int64)
