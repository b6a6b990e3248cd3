r"""Signals that excite the inputs of a plant within their ranges, so that its reduced model meets
what a controller may ask of it.

    u(t) = u_0 + w(t) (m + a s(t) - u_0),    m = (low + high) / 2,   a = (high - low) / 2,   |s| <= 1

    chirp    s = c(f) sin(phi),    phi' = 2 pi f,   f from f_0 to f_1 or back, as fast in every octave
    steps    s is held at random heights, for times from 1/(2 f_1) to 1/(2 f_0)
    noise    s = sum_k c(f_k) sin(2 pi f_k t + phi_k) / max|.|,   f_k as many in every octave, phases at random

u_0 is the start of the input, m and a are the middle of its range and half of it, w rises smoothly
from 0 to 1. In the runs of a training the inputs of a plant have different kinds at once, each of
its own random numbers; in the run that checks the model they have the mean of new steps and new
noise. Over a box of parameters all runs of the training have the same mean of all kinds.
Frequencies go from one period in a run to the first vibration modes about the start, as far as the
step follows them. What drives a joint prescribes its acceleration: its chirps and noise fall beyond
a corner f_c by c = 1/(1 + (f/f_c)^2), its steps and the rise w take 1/f_c.

Source: Pintelon and Schoukens, System Identification, 2nd ed., Wiley 2012, chapter 5 (chirps and
multisines).
"""

from __future__ import annotations

import functools
import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, NamedTuple

import numpy as np

from ..core.errors import InputError, SolverError
from ..core.notices import Progress
from ..core.storage.records import dataclass
from ..core.values.fields import quantity, whole
from ..core.values.inputs import GivenInput, Input
from ..dynamics import rest
from ..dynamics.near_state.linear import linearise
from ..dynamics.near_state.modes import real_modes
from ..dynamics.scheme import steps_in
from ..systems.signals import driving_inputs, inputs_of, with_inputs
from ..systems.system import System, sizes
from . import parameters as boxes
from .cases import Case
from .full_runs import FullRun, TrainingTask, full_run
from .spaces.component import is_resting

RUN = "training signal"  #: the value of a task that says which signals its inputs have
MODES = 3  #: vibration modes that are excited
LISTED = 10  #: modes of which they are the first that vibrate
VIBRATES = 1e-6  #: of the largest omega^2 listed, below which it is that of a free motion
# a period of 20 steps errs by 1 % of itself; what is faster is that of the method and not of the
# plant
PERIOD = 20.0  #: steps of the fastest period
WIDEST = 30.0  #: fastest frequency over the slowest one where nothing vibrates
RISE = 0.05  #: part of a run over which signals rise
LINES = 40  #: frequencies of noise
SPAN = 2.0  #: periods in a run, of the corner of what drives joints


@dataclass(frozen=True)
class TrainingSignals:
    """Runs in which `fmbs reduce` excites inputs with ranges: chirps, steps and noise in turn, up
    to a frequency of the modes.

    `fmbs train` and `fmbs compare` have all kinds at once, in every run alike.
    """

    runs: Annotated[int, whole(1, 100)] = 3
    seed: int = 0
    fastest: (
        Annotated[float, quantity("Hz", "> 0"), "the first vibration modes by default"] | None
    ) = None


class Band(NamedTuple):
    """Frequencies of signals [Hz]."""

    slow: float
    fast: float


@dataclass(frozen=True)
class Signals:
    """What the inputs of a plant have in one of its runs: calling it gives them to a case, full or
    reduced.
    """

    wanted: TrainingSignals
    band: Band
    run: int  #: 0, 1, ... of the training, then `check` and `box`

    def __call__(self, case: Case) -> Case:
        return replace(case, system=with_inputs(case.system, self.histories(case)))

    @property
    def check(self) -> Signals:
        """Those that no training has."""
        return replace(self, run=self.wanted.runs)

    @property
    def box(self) -> Signals:
        """Those of all full and reduced runs of a training over parameters."""
        return replace(self, run=self.wanted.runs + 1)

    def histories(self, case: Case) -> dict[str, GivenInput]:
        """The values of inputs of a case."""
        return signals(case, self.wanted, self.band, self.run)

    def facts(self, system: System) -> dict[str, object]:
        """What a report says of them and of the inputs of a system that have them."""
        ranges = {name: one.range for name, one in ranged(system).items()}
        return {
            "seed": self.wanted.seed,
            "slowest": self.band.slow,
            "fastest": self.band.fast,
            "ranges": ranges,
        }


def ranged(system: System) -> dict[str, Input]:
    """The inputs of a system that have ranges, by name."""
    return {name: one for name, one in inputs_of(system).items() if one.range is not None}


@dataclass(frozen=True)
class Excited:
    """A task without parameters with what its inputs are excited by: the value RUN of its family
    says which signals they have.

    Runs 0, 1, ... are those of the training; without a value inputs stay at their starts.
    """

    task: TrainingTask
    signals: Signals

    @property
    def check(self) -> dict[str, float]:
        """Values of the run that checks the model."""
        return {RUN: self.signals.check.run}

    @property
    def facts(self) -> dict[str, object]:
        """What a report says of it."""
        return {"runs": self.signals.wanted.runs, **self.signals.facts(self.task.family({}).system)}

    def checked(self, case: Case) -> Case:
        """A case of the same inputs, such as the reduced one, with the signals of the run that
        checks the model.
        """
        return self.signals.check(case)

    def runs(self, progress: Progress | None = None) -> list[FullRun]:
        """The full runs of the training, and that of the inputs at their starts where something
        moves in it.

        SolverError names the one that fails.
        """
        raw = self.task.family({}).system
        still = full_run(self.task, {})
        assert still.q is not None
        found = (
            [] if is_resting(raw, float(sizes(raw, still.q - raw.lift(raw.x0)).max())) else [still]
        )
        runs = self.signals.wanted.runs
        for run in range(runs):
            if progress:
                progress(run / runs)
            try:
                found.append(full_run(self.task, {RUN: run}))
            except SolverError as error:
                text = f"training signals {run + 1} of {runs}: {error}; take smaller ranges of inputs or a smaller step"
                raise SolverError(
                    text, error.reason, error.time, error.worst, error.partial
                ) from error
        return found


def excite(task: TrainingTask, wanted: TrainingSignals) -> Excited | None:
    """A task without parameters with signals for its inputs that have ranges; None where there are
    none.
    """
    case = task.family({})
    own = of_box(task, wanted)
    if own is None:
        return None

    @functools.cache
    def excited(run: int) -> Case:
        return replace(own, run=run)(case)

    return Excited(
        replace(task, family=lambda values: excited(int(values[RUN])) if RUN in values else case),
        own,
    )


def of_box(task: TrainingTask, wanted: TrainingSignals) -> Signals | None:
    """The signals of all runs of a task over parameters, the same ones, so that errors are smooth;
    None without such inputs.

    Their frequencies are those about the start at nominal parameters.
    """
    case = task.family(boxes.completed(task.parameters, {}))
    return (
        Signals(wanted, band(replace(case, system=task.form(case.system)), wanted), 0).box
        if ranged(case.system)
        else None
    )


def band(case: Case, wanted: TrainingSignals) -> Band:
    """Frequencies [Hz] from one period in the run to the MODES-th vibration mode about the start of
    a case, as the step allows.
    """
    slow, most = 1.0 / case.duration, 1.0 / (PERIOD * case.scheme.step)
    fast = wanted.fastest or vibrations(case) or WIDEST * slow
    return Band(slow, min(max(fast, 2.0 * slow), max(most, slow)))


def vibrations(case: Case) -> float:
    """Frequency [Hz] of the MODES-th vibration mode about the start, or of the last one; 0 where
    nothing vibrates.
    """
    try:
        x = (
            rest.in_equilibrium(case.system, case.newton).x
            if case.scheme.start == "equilibrium"
            else None
        )
        squares = real_modes(linearise(case.system, x), LISTED).squares
    except (InputError, SolverError):  # of what has no modes there the run says more
        return 0.0
    found = squares[squares > VIBRATES * squares.max(initial=0.0)]
    return float(np.sqrt(found[:MODES][-1]) / (2.0 * np.pi)) if len(found) else 0.0


def signals(
    case: Case, wanted: TrainingSignals, frequencies: Band, run: int
) -> dict[str, GivenInput]:
    """Histories of the inputs with ranges in a run, as `control.live` gives them: values at the
    ends of steps.
    """
    h = case.scheme.step
    driving = driving_inputs(case.system)
    times = h * np.arange(steps_in(case.scheme, case.duration) + 1)
    found = {}
    for place, (name, one) in enumerate(ranged(case.system).items()):
        corner = SPAN / case.duration if name in driving else None
        kind = {wanted.runs: unseen, wanted.runs + 1: mixed}.get(
            run, KINDS[(run + place) % len(KINDS)]
        )
        # its own numbers, whatever other inputs there are
        random = np.random.default_rng((wanted.seed, run, zlib.crc32(name.encode())))
        # a run begins with drives at rest, which stand still in its first step
        rise = smooth_step((times - h) * (corner or 1.0 / (RISE * times[-1])))
        values = within(one, kind(times, frequencies, corner, random), rise)
        found[name] = GivenInput(h, values.tolist(), smooth=name in driving)
    return found


def within(one: Input, s: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Values (s,) of an input in its range that begin with its start, of a shape from -1 to 1 and a
    weight that rises to 1.
    """
    assert one.range is not None
    low, high = one.range
    return np.clip(
        one.start + w * (0.5 * (low + high) + 0.5 * (high - low) * s - one.start), low, high
    )


def smooth_step(place: np.ndarray) -> np.ndarray:
    """A step with two continuous derivatives.

        0,    10 p^3 - 15 p^4 + 6 p^5,    1

    for p = `place` up to 0, between 0 and 1, from 1 on.
    """
    p = np.clip(place, 0.0, 1.0)
    return np.asarray(p**3 * (10.0 + p * (6.0 * p - 15.0)))


def fall(frequency: np.ndarray, corner: float | None) -> np.ndarray:
    """c(f) of a corner, 1 without one."""
    return np.ones_like(frequency) if corner is None else 1.0 / (1.0 + (frequency / corner) ** 2)


def chirp(
    times: np.ndarray, of: Band, corner: float | None, random: np.random.Generator
) -> np.ndarray:
    """A sweep through all frequencies, up or down."""
    rate = np.log(of.fast / of.slow) / times[-1]
    back = random.random() < 0.5
    clock = times[-1] - times if back else times
    phase = (
        2.0 * np.pi * of.slow * (np.expm1(rate * clock) / rate if rate > 0.0 else clock)
        + 2.0 * np.pi * random.random()
    )
    return np.asarray(fall(of.slow * np.exp(rate * clock), corner) * np.sin(phase))


def steps(
    times: np.ndarray, of: Band, corner: float | None, random: np.random.Generator
) -> np.ndarray:
    """Random heights, held for random times."""
    at = 0.0
    s = np.full(times.shape, random.uniform(-1.0, 1.0))
    while (at := at + 0.5 / np.exp(random.uniform(np.log(of.slow), np.log(of.fast)))) < times[-1]:
        # those of what drives joints begin where the last one has ended
        at = at if corner is None else at + 1.0 / corner
        height = random.uniform(-1.0, 1.0)
        past = times - at
        s = s + (height - s[-1]) * (
            (past >= 0.0) if corner is None else smooth_step(1.0 + past * corner)
        )
    return s


def noise(
    times: np.ndarray, of: Band, corner: float | None, random: np.random.Generator
) -> np.ndarray:
    """Many frequencies at once, with random phases."""
    frequencies = np.exp(random.uniform(np.log(of.slow), np.log(of.fast), LINES))
    waves = np.sin(
        2.0 * np.pi * np.outer(times, frequencies) + random.uniform(0.0, 2.0 * np.pi, LINES)
    )
    found = waves @ fall(frequencies, corner)
    return np.asarray(found / np.abs(found).max())


def unseen(
    times: np.ndarray, of: Band, corner: float | None, random: np.random.Generator
) -> np.ndarray:
    """The mean of steps and noise, so that slow motions are as large as fast ones."""
    return mean(times, of, corner, random, (steps, noise))


def mixed(
    times: np.ndarray, of: Band, corner: float | None, random: np.random.Generator
) -> np.ndarray:
    """The mean of all kinds."""
    return mean(times, of, corner, random, KINDS)


def mean(
    times: np.ndarray,
    of: Band,
    corner: float | None,
    random: np.random.Generator,
    kinds: tuple[Kind, ...],
) -> np.ndarray:
    """The mean of signals, grown to the whole range."""
    found = np.sum([kind(times, of, corner, random) for kind in kinds], axis=0)
    return np.asarray(found / np.abs(found).max())


Kind = Callable[[np.ndarray, Band, float | None, np.random.Generator], np.ndarray]
KINDS = (chirp, steps, noise)
