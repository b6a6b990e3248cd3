r"""Runs that can be compared: which steps are stored, how sharply Newton iterates, and the error of the step itself.

error of h from halving the step:  e_h = 4/3 |q_h - q_h/2|,   order = log2 |q_h - q_h/2| / |q_h/2 - q_h/4|
or from doubling it:  e_h = 1/3 |q_h - q_2h|
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..dynamics.integration import integrate
from ..dynamics.scheme import GeneralizedAlpha, Newton
from ..dynamics.trajectory import Trajectory
from ..systems.system import System
from .errors import compare
from .training import Plan, newton_for

SAMPLES = 2000  #: instants that are compared, at least, where a run has as many steps
PATIENCE = 1.5  #: runs that cost more are not repeated [s]
START = 10  #: samples in the first interval between listed snapshots
NEAR = 1e-6  #: part of a step that is round-off


@dataclass(frozen=True)
class Options:
    """What is run and compared."""

    scheme: GeneralizedAlpha
    duration: float  #: [s]
    interval: float | np.ndarray  #: between snapshots, or their times (s,) [s]
    plan: Plan  #: component level; its eta and eps are those of the main models
    newton: Newton = field(default_factory=Newton)
    tolerances: tuple[float, ...] = ()  #: further eps
    hyper_tolerances: tuple[float, ...] = ()  #: further eta
    steps: tuple[float, ...] = ()  #: other steps of the full model [s]
    ffrf_modes: int | None = None
    repeat: int = 2  #: runs of which the fastest counts
    order: bool = True  #: observe the order in time by a quarter of the step
    expensive: bool = False  #: only the steps in `steps` tell the error of the step, which is not halved twice
    plain: bool = True  #: also run models without hyper-reduction where there is an exact polynomial


@dataclass(frozen=True)
class TimeError:
    """Error of the full model's own step, from halving or doubling it."""

    step: float  #: [s]
    difference: float  #: largest distance of the motions with h and h/2, or h and 2h [m]
    position: float  #: error of h, 4/3 or 1/3 of it [m]
    distance: float  #: the same as root mean square over the mass [m]
    relative: float  #: and over the largest displacement
    order: float | None  #: observed, with h/4


def sharp_newton(options: Options) -> Newton:
    """Newton's iteration of the run that gives the snapshots."""
    return newton_for(options.newton, min((options.plan.tolerance, *options.tolerances)))


def kept_steps(options: Options) -> np.ndarray:
    """Numbers of the steps whose states are stored: those of the snapshots, or so many that there are enough samples.

    The first interval between listed snapshots is divided further, so that errors in a transient at the start are seen.
    """
    steps = round(options.duration / options.scheme.step)
    if isinstance(options.interval, np.ndarray):
        numbers = np.round(options.interval / options.scheme.step).astype(np.int64)
        first = int(numbers[numbers > 0].min(initial=steps))
        return np.union1d(numbers, [*range(0, first, max(1, first // START)), steps])
    return np.arange(0, steps + 1, stride(options))


def stride(options: Options) -> int:
    """Steps between stored states: as many as leave enough samples and divide the interval of the snapshots."""
    between = max(1, round(float(options.interval) / options.scheme.step))
    steps = options.duration / options.scheme.step
    return max(d for d in range(1, between + 1) if between % d == 0 and (d == 1 or steps / d >= SAMPLES))


def timed(system: System, options: Options, step: float, kept: np.ndarray, newton: Newton | None = None) -> Trajectory:
    """The motion, with the least CPU and wall time of several runs; `kept` are numbers of steps of the size `step`."""
    scheme, newton = replace(options.scheme, step=step), newton or options.newton
    best = integrate(system, scheme, options.duration, newton, kept)
    for _ in range(options.repeat - 1 if best.statistics.cpu_s < PATIENCE else 0):
        again = integrate(system, scheme, options.duration, newton, kept).statistics
        cpu, wall = min(again.cpu_s, best.statistics.cpu_s), min(again.wall_s, best.statistics.wall_s)
        best = replace(best, statistics=replace(best.statistics, cpu_s=cpu, wall_s=wall))
    return best


def other_steps(system: System, options: Options, kept: np.ndarray) -> dict[float, Trajectory]:
    """The full model with h/2 and h/4; where that is expensive, with those of the wanted steps that are h/2 or 2h."""
    h = options.scheme.step
    ratios: tuple[float, ...] = (2.0, 4.0) if options.order else (2.0,)
    if options.expensive:
        ratios = tuple(ratio for ratio in (2.0, 0.5) if any(math.isclose(step, h / ratio) for step in options.steps))
    options = replace(options, repeat=1)
    return {h / ratio: timed(system, options, h / ratio, stored(h / ratio, h, kept)) for ratio in ratios}


def step_error(full: Trajectory, others: Mapping[float, Trajectory], step: float) -> TimeError | None:
    """Error of the step from runs with h/2 and, for the order, h/4; or from a run with 2h."""
    if not others:
        return None
    near, *further = others
    first, factor = compare(full, others[near]), 4 / 3 if near < step else 1 / 3
    order = None
    if further and further[0] < near:
        second = compare(others[near], others[further[0]]).position_maximum
        order = math.log2(first.position_maximum / second) if first.position_maximum * second > 0.0 else None
    position, distance, relative = (factor * one for one in (first.position_maximum, first.distance_maximum, first.maximum))
    return TimeError(step, first.position_maximum, position, distance, relative, order)


def stored(step: float, h: float, kept: np.ndarray) -> np.ndarray:
    """Numbers of the steps of another size at those instants of the full run's stored states that they reach."""
    numbers = kept * (h / step)
    return np.round(numbers[np.abs(numbers - np.round(numbers)) < NEAR]).astype(np.int64)
