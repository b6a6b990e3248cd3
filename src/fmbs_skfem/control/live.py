"""A motion that is taken step by step, with inputs that are given from outside: control and
co-simulation from Python.

    run = dynamics.start(system, GeneralizedAlpha(1e-3))
    while run.time < 2.0:
        run.step({"u": -40.0 * run.outputs()["hinge"]})

A step is that of `integrate`, bit for bit, with histories that have the same values at the ends of
steps. An input that drives a joint is the cubic through its last four values; any other one acts
with the value that it is given for the step.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..core.errors import InputError, say
from ..core.notices import Notice
from ..core.values import arguments
from ..core.values.arguments import checked
from ..core.values.inputs import Held
from ..core.values.problems import shown
from ..dynamics.checkpoint import Checkpoint
from ..dynamics.compiled_step import stepping
from ..dynamics.initial import begin_steps
from ..dynamics.integration import begun, restart, take_filtered, take_step
from ..dynamics.measuring import Meter, RowMeter, motion_of
from ..dynamics.observers import Observer, RunSetting
from ..dynamics.outputs import require_known
from ..dynamics.perturbed_starts import perturbed_start
from ..dynamics.run import cost_of, moment, restore
from ..dynamics.scheme import GeneralizedAlpha, Newton
from ..dynamics.trajectory import Happening, Trajectory
from ..parts import finer_parts
from ..systems.measures.probes import formula_of, kind_of
from ..systems.system import System
from .beside import TWICE, Beside, Other, parts_beside, step_beside
from .feed import Feed

DOUBTFUL = ".* too far apart to count the turns"  #: a warning of a meter that is read seldom, while turns are counted beside it
OFTEN = 64  #: steps after which turns are counted, at most
# a wheel at rest that is driven by 4000 rad/s2 turns by 33 rad in OFTEN steps of 2 ms, of which
# rates before and behind tell no turn for certain
FEW = 8  #: the same behind a change of an input


@checked
def start(
    system: System,
    scheme: GeneralizedAlpha,
    newton: Newton | None = None,
    observers: Sequence[Observer] = (),
    accuracy: Mapping[str, float] | float | None = None,
) -> LiveRun:
    """A run at its consistent start, whose steps are taken one by one; errors as those of
    `integrate`, and observers.

    Parts are held against finer ones, which take the same steps. With an `accuracy`, largest errors
    as parts of the ranges of all outputs or of some by name, the step is watched by a run with
    steps twice as long, for half as much again: a warning says where it errs by more. InputError
    for an output that there is not, or none, and for a part that is not between 0 and 1; see
    `beside`.

        >>> from fmbs_skfem import scenes
        >>> from fmbs_skfem.control.live import start
        >>> from fmbs_skfem.dynamics import GeneralizedAlpha
        >>> from fmbs_skfem.scenes import build
        >>> cart = '''
        ... schema: 1
        ... dimension: 2
        ... inputs: {u: {unit: N}}
        ... bodies: {cart: {type: point_mass, mass: 2 kg, position: [0, 0]}}
        ... analysis: {type: dynamic, duration: 1 s, step: 10 ms}
        ... loads: {push: {type: control_force, at: cart, direction: [1, 0], force: u}}
        ... outputs: {speed: {type: velocity, at: cart, component: x}}
        ... '''
        >>> run = start(build.system(scenes.loads(cart)), GeneralizedAlpha(0.01))
        >>> run.step({"u": 4.0}, 100)
        >>> f"{run.outputs()['speed']:.3f} m/s after {run.time:.1f} s"  # u (t - h / 2) / m
        '1.990 m/s after 1.0 s'
    """
    iteration = newton or Newton()
    run = LiveRun(system, scheme, iteration, observers)
    finer = finer_parts.finer(system)
    finer_parts.warn_unknown(system)
    with finer_parts.quietly():
        if finer is not None:
            run.beside.append(parts_beside(other_of(LiveRun(finer, scheme, iteration))))
        if accuracy is not None:
            require_accuracy(accuracy, system)
            run.beside.append(
                step_beside(
                    other_of(LiveRun(system, replace(scheme, step=TWICE * scheme.step), iteration)),
                    accuracy,
                )
            )
    return run


def other_of(run: LiveRun) -> Other:
    """A run as one beside another."""
    return Other(run.run, run.step)


def is_count(value: object) -> bool:
    """Whether a value is a whole number, 1 or more."""
    return isinstance(value, int | np.integer) and bool(value > 0)


def require_accuracy(accuracy: Mapping[str, float] | float, system: System) -> None:
    """InputError for errors that outputs cannot have."""
    where, expected = "start: accuracy", "errors of outputs, parts of their ranges between 0 and 1"
    wanted = accuracy if isinstance(accuracy, Mapping) else dict.fromkeys(system.outputs, accuracy)
    if not wanted:
        raise InputError(
            say(where, expected, f"{accuracy} of a system without outputs", "add outputs")
        )
    require_known(where, system.outputs, wanted)
    for name, one in wanted.items():
        if not isinstance(one, int | float) or not 0.0 < one < 1.0:
            raise InputError(say(where, expected, f"{one!r} for '{name}'"))


class LiveRun:
    """A run between two steps; see `start`.

    `step(inputs)` takes one step of the scheme, `outputs()` reads the present state, `state` keeps
    it and goes back to it.
    """

    def __init__(
        self,
        system: System,
        scheme: GeneralizedAlpha,
        newton: Newton,
        observers: Sequence[Observer] = (),
    ) -> None:
        self.run = begun(
            RunSetting(system, scheme, newton, 0, system, live=True),
            np.zeros(1, np.int64),
            observers,
        )
        self.feed = self.run.find(Feed)
        self.repeats = self.feed.holds(self.run)  #: whether steps with the same inputs are alike
        self.meter, self.begin = Meter(), motion_of(self.run, 0.0)
        self.meters: dict[tuple[str, ...], Meter | RowMeter] = {}  #: of outputs by name
        self.turns = self.counter()
        self.due: int = sys.maxsize  #: number of the step after which turns are counted
        self.plan_count()
        #: of the state that was put back last, for meters that are made later
        self.held: Mapping[str, np.ndarray] = {}
        self.beside: list[Beside] = []  #: runs that say how good this one is

    @property
    def time(self) -> float:
        """Of the present state [s]."""
        return self.run.time

    @property
    def ended(self) -> bool:
        """Whether an event has stopped the run."""
        return self.run.ended

    @property
    def events(self) -> tuple[Happening, ...]:
        """What has happened so far."""
        return tuple(self.run.happened)

    @property
    def inputs(self) -> dict[str, float]:
        """Values of all inputs in the last step."""
        return {
            name: one.values[-1]
            for name, one in self.feed.given.items()
            if not isinstance(self.feed.inputs[name], Held)
        }

    def perturb(
        self, random: np.random.Generator, spread: tuple[float, float], time: float
    ) -> None:
        """Put a run that is at its start to one near it, see `perturbed_starts`."""
        v = self.run.step.job.out[1, 0]  # of the start of the system
        restart(self.run, *perturbed_start(self.run.model, v, random, spread, time))
        self.begin = motion_of(self.run, 0.0)
        self.turns.angles.clear()
        self.read(self.turns)
        self.plan_count()

    def step(self, inputs: Mapping[str, float] | None = None, count: int = 1) -> None:
        """Take a step, or `count` of them, fewer where an event stops the run; inputs that are not
        named keep their values.

        `inputs` by name, in the SI unit of each. Several steps are the same to the bit as one by
        one, and where nothing else looks at them one call of compiled code, beside which other
        threads run. SolverError where a step cannot be taken; InputError for an unknown name, a
        value that is not finite, and after an event has stopped the run.
        """
        if self.run.ended:
            raise InputError(
                say(
                    "run.step",
                    "a run that goes on",
                    f"one that an event has stopped at t = {self.time:g} s",
                )
            )
        if not is_count(count):
            raise InputError(say("run.step: count", "a whole number of steps, 1 or more", count))
        if not isinstance(inputs or {}, Mapping):
            raise InputError(
                say("run.step: inputs", "numbers by the names of inputs", repr(inputs))
            )
        self.feed.next = inputs or {}
        if self.turns.angles and self.feed.is_changed():
            if self.age > FEW:
                self.read(self.turns)
            self.due = min(self.due, self.run.done + FEW)
        end = self.run.done + count
        while self.run.done < end and not self.run.ended:
            if self.is_held:
                self.take_held(end - self.run.done)
                continue
            take_step(self.run)
            self.count_turns()
            for one in self.beside:
                one.step(self.run, inputs or {})

    @property
    def is_held(self) -> bool:
        """Whether steps with the same inputs are one call of compiled code."""
        return self.repeats and not self.beside

    def take_held(self, left: int) -> None:
        """Take steps with the same inputs, so many or fewer."""
        many = min(left, self.reach)
        self.feed.tell()
        self.begin_held()
        self.end_held(self.run.packed.call(stepping.repeat, many), many)

    def begin_held(self) -> None:
        """Give what steps with the same inputs read."""
        run = self.run
        begin_steps(run.step.state)
        self.feed.write()
        run.packed.give(self.feed.row, self.feed.stored)
        run.packed.start(run.scheme.step * run.done)

    def end_held(self, status: int, many: int) -> None:
        """Go on where so many steps with the same inputs have ended with a status; SolverError where
        one cannot be taken.
        """
        run = self.run
        status = run.packed.go_on(status, run.done, many)
        run.packed.check()
        taken = int(run.step.job.done[0])
        run.done += taken
        # the first one was told when it began
        if (more := taken if status != stepping.DONE else taken - 1) > 0:
            self.feed.keep({}, more)
        if status != stepping.DONE:
            take_filtered(run, status)
        self.count_turns()

    @property
    def state(self) -> Checkpoint:
        """All that the next step reads: set it to go on from there, here or in another run of the
        same system and scheme.
        """
        held = moment(self.run).checkpoint()
        meters = [
            self.meter,
            *(meter for meter in self.meters.values() if isinstance(meter, Meter)),
        ]
        shown = self.turns.kept() | {
            key: value for meter in meters for key, value in meter.kept().items()
        }
        return replace(held, arrays=held.arrays | shown)

    @state.setter
    def state(self, held: Checkpoint) -> None:
        arguments.require("run.state", held, Checkpoint)
        restore(self.run, held)
        if not held.done:
            self.begin = motion_of(self.run, 0.0)
        self.beside = []  # which stand elsewhere
        self.meter.take_up(self.run, held.arrays)
        self.turns.take_up(held.arrays)
        self.plan_count()
        self.meters = {}
        self.held = held.arrays

    def outputs(self, names: Sequence[str] | None = None) -> dict[str, float]:
        """Named outputs of the present state, all or those of some names, which costs less: by
        column, in SI units.

        Angles count their turns from the start on, whoever reads them and how often, and so do
        energies. Positions, velocities and angles alone cost less than a step. InputError for a
        name that is none.
        """
        if names is None:
            return self.measured(self.meter)
        given = names if isinstance(names, Iterable) and not isinstance(names, str) else (names,)
        key = (*given,)
        if not all(isinstance(name, str) for name in key):
            raise InputError(say("run.outputs", "names of outputs", shown(names)))
        meter = self.reader(key)
        if isinstance(meter, Meter):
            return self.measured(meter)
        return self.read(meter)

    def counter(self) -> RowMeter:
        """What counts the turns of all angles whose formulas are known, beside the steps."""
        system = self.run.model.system
        angles = [(name, one) for name, one in system.outputs.items() if kind_of(one).counted]
        known = [
            (name, one, found)
            for name, one in angles
            if (found := formula_of(one, system.dim)) is not None
        ]
        return RowMeter(self.run, known)

    def count_turns(self) -> None:
        """Count them where an angle may have changed by much since it was read last."""
        if self.run.done >= self.due:
            step = self.run.scheme.step
            # who reads angles counts their turns
            if self.age > FEW - 0.5 or self.turns.due(OFTEN * step) <= self.time + 1e-6 * step:
                self.read(self.turns)
            self.plan_count()

    @property
    def age(self) -> float:
        """Steps since turns were counted."""
        first = min(one[0] for one in self.turns.angles.values())
        return (self.time - first) / self.run.scheme.step

    def plan_count(self) -> None:
        """Find after which step turns are counted again, if there are any: OFTEN steps at most."""
        self.due = sys.maxsize
        if self.turns.angles:
            step = self.run.scheme.step
            reach = int((self.turns.due(OFTEN * step) - self.time) / step + 1e-6)
            self.due = self.run.done + max(reach, 1)

    @property
    def reach(self) -> int:
        """Steps that may be taken before turns are counted again."""
        return self.due - self.run.done

    def read(self, meter: RowMeter) -> dict[str, float]:
        """Columns of the present state by formulas."""
        return meter.columns(self.time)

    def measured(self, meter: Meter) -> dict[str, float]:
        """Columns of the present state by a meter, which counts from the begin of the run; turns
        are those that were counted.
        """
        now = motion_of(self.run, self.time)
        with warnings.catch_warnings():
            if self.turns.angles:
                warnings.filterwarnings("ignore", DOUBTFUL, Notice)
            if meter.seen is None:
                meter.columns(self.begin)
                meter.keep()
            if meter.seen is not None and meter.seen[0].times[0] == now.times[0]:
                return dict(meter.seen[1])
            found = meter.columns(now)
        found |= {name: value for name, value in self.read(self.turns).items() if name in found}
        meter.last = now, found
        meter.keep()
        return dict(found)

    def reader(self, names: tuple[str, ...]) -> Meter | RowMeter:
        """What reads outputs of some names, made when they are first asked for."""
        if names not in self.meters:
            self.meters[names] = self.meter_of(names)
        return self.meters[names]

    def meter_of(self, names: tuple[str, ...]) -> Meter | RowMeter:
        """What reads outputs of some names."""
        system = self.run.model.system
        require_known("run.outputs", system.outputs, names)
        formulas = [formula_of(system.outputs[name], system.dim) for name in names]
        known = [
            (name, system.outputs[name], one)
            for name, one in zip(names, formulas, strict=True)
            if one is not None
        ]
        if len(known) == len(names):
            return RowMeter(self.run, known, self.turns)
        meter = Meter(names)
        meter.word = f"shown of {', '.join(names)}:"
        meter.take_up(self.run, self.held)
        return meter

    def motion(self) -> Trajectory:
        """The present state as a trajectory of one instant.

        States (1, n), without the events so far.
        """
        return replace(
            motion_of(self.run, self.time), statistics=cost_of(self.run), events=(), work=None
        )
