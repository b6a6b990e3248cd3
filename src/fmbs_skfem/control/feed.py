"""The inputs of a run: given from outside, from step to step, or by controllers at their sample
instants.

The steps of a run that is fed are taken one by one, see `single_steps`. An input that drives a
joint is the cubic through its last four values, any other one is held in the step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from ..core.errors import InputError, Reason, SolverError, closest, listed, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.inputs import KEPT, GivenInput, Held, Input
from ..dynamics import checkpoint as checkpoints
from ..dynamics.compiled_step import stepping
from ..dynamics.compiled_step.single_steps import SingleSteps, one_row
from ..dynamics.initial import begin_steps
from ..dynamics.measuring import Reader, motion_of
from ..dynamics.observers import Looks, Observer, RunSetting, offered
from ..dynamics.outputs import survey_of
from ..dynamics.run import trajectory
from ..dynamics.scheme import GeneralizedAlpha
from ..dynamics.trajectory import Trajectory
from ..systems.measures.probes import calls_of
from ..systems.signals import driving_inputs, given_by_name, read_inputs, with_inputs
from ..systems.system import System, driving
from . import sampled_loops
from .controllers import Controlled
from .events import with_locks
from .happenings import EventObserver
from .rising import FEW, Rising, rises

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun

LATE = 1e-6  #: part of a step after an instant where what is given for the step after it counts
NEAR = 1e-6  #: part of a sample time by which whole steps may miss it: round-off


@dataclass
class Sampler:
    """A controller in a run.

    It acts at the start and after every `every` steps, `memory` being what its law keeps.
    """

    of: Controlled
    every: int  #: steps
    memory: list[float]


class Feed(SingleSteps):
    """Inputs of a run; `system` reads them, `plain` their starts.

    Inputs that a caller gives (`free`), those that controllers set at their samples, and those of
    events. InputError for a value of another input, or one that is not finite.
    """

    looks: Looks = "step"

    def __init__(self, plain: System, scheme: GeneralizedAlpha) -> None:
        super().__init__(plain, scheme)
        self.inputs = given_by_name(plain)
        driven = {signal for _, signal in driving(plain.constraints)}
        smooth = driving_inputs(plain)
        self.given = {
            name: GivenInput(scheme.step, [one.start] * KEPT, 1 - KEPT, name in smooth)
            for name, one in self.inputs.items()
        }
        self.system = with_inputs(plain, self.given)
        # forces are found of compiled systems, of which every block has its own
        self.reads_states = bool(calls_of(plain.outputs))
        self.samplers = [
            sampler(one, scheme) for one in self.inputs.values() if isinstance(one, Controlled)
        ]
        held = [one for one in self.inputs.values() if isinstance(one, Held)]
        own = [one.of for one in self.samplers] + held
        self.record = {one.name: [one.start] for one in own}  #: what controllers gave, and events
        self.free = [name for name in self.given if name not in self.record]
        self.rising = {name: Rising() for name in self.free}
        self.told = False  #: whether a warning of one that rises was shown
        #: ranges of those that have not left them
        self.ranges = {
            name: ends for name in self.free if (ends := self.inputs[name].range) is not None
        }
        reading = [k for k, signal in enumerate(plain.signals) if read_inputs(signal)]
        #: columns of inputs that are signals as they are; None where others read them, which are
        #: evaluated in every step
        self.columns: list[tuple[int, str]] | None = [
            (k, one.name)
            for k in reading
            if isinstance(one := plain.signals[k], Input)
            and (k not in driven or isinstance(one, Held))
        ]
        if len(self.columns) < len(reading):
            self.columns = None
        #: whether there are others beside inputs
        self.histories = len(reading) < len(plain.signals)
        self.next: Mapping[str, float] = {}  #: new values for the next step

    def begin(self, run: OpenRun) -> None:
        """Know what reads values for controllers."""
        self.reader = run.find(Reader)

    def before(self, run: OpenRun) -> None:
        """Tell inputs what is given for the step, and let controllers act."""
        self.tell()
        self.sample(run)

    def holds(self, run: OpenRun) -> bool:
        """Whether steps with the same inputs differ in nothing else that is given, and nobody looks
        between them.
        """
        alone = all(one is self for one in run.close)
        return (
            alone
            and self.columns is not None
            and not (self.histories or self.record or run.jumps or run.steps)
        )

    def tell(self) -> None:
        """New values of inputs for the next step; those that are not named keep theirs."""
        values, self.next = self.next, {}
        for name, value in values.items():
            if name not in self.free or not is_finite(value):
                self.refuse(name, value)
            if name in self.ranges and not self.ranges[name][0] <= value <= self.ranges[name][1]:
                self.warn_outside(name, value)
        self.keep(values, 1)
        for name, levels in self.rising.items():
            if (
                name in values
                and levels.add(values[name])
                and not self.told
                and (text := self.unsteady(Rising.found))
            ):
                self.told = True
                notify(text)

    def is_changed(self) -> bool:
        """Whether the next step has another value of an input."""
        return any(
            name in self.given and self.given[name].values[-1] != value
            for name, value in self.next.items()
        )

    def keep(self, values: Mapping[str, float], count: int) -> None:
        """So many steps have these values of inputs, and those that are not named their last ones."""
        for name, one in self.given.items():
            kept = one.values
            kept.append(float(values[name]) if name in values else kept[-1])
            del kept[0]
            if count > 1:
                one.values = [*kept, *[kept[-1]] * (count - 1)][-KEPT:]
            one.first += count

    def refuse(self, name: str, value: float) -> NoReturn:
        """The error of a value that no input takes."""
        if name in self.free:
            raise InputError(say(f"run.step: input '{name}'", "a finite number", value))
        got = f"'{name}', which its controller sets" if name in self.record else f"'{name}'"
        expected = f"one of the inputs {listed(self.free, name, 'of which there are none')}"
        raise InputError(say("run.step", expected, got) + closest(name, self.free))

    def warn_outside(self, name: str, value: float) -> None:
        """A warning, once, of a value outside of the range of its input."""
        (low, high) = self.ranges.pop(name)
        unit = self.inputs[name].unit
        why = (
            "a reduced model was not trained there"
            if self.plain.components
            else "no reduced model is trained there"
        )
        text = f"run.step: input '{name}' is set to {value:.6g}, outside of its range from {low:g} to {high:g} {unit}".rstrip()
        notify(f"{text}: {why}; limit it, or train with a wider `range`")

    def set_input(self, one: Held, value: float) -> None:
        """Set an input from an event on."""
        self.given[one.name].values[:] = [value] * KEPT
        self.record[one.name][-1] = value

    def sample(self, run: OpenRun) -> None:
        """Let controllers act whose instant it is; the state jumps with what they give for the next
        step.
        """
        changed = False
        for one in self.samplers:
            if run.done % one.every == 0:
                told = self.given[one.of.name]
                new = self.value(run, one)
                changed = changed or new != told.values[-1]
                told.values[-1] = new
        self.reader.keep()
        for name, values in self.record.items():
            values.append(self.given[name].values[-1])
        if changed:
            self.jump(run)

    def value(self, run: OpenRun, one: Sampler) -> float:
        """The output of a controller."""
        time = self.scheme.step * run.done
        found = one.of.law(time, self.reader.read(run, one.of.reads, time), one.memory)
        if not math.isfinite(found):
            text = f"controller '{one.of.name}' gives {found} at t = {time:.6g} s; look at what it reads, guard it with where(...)"
            raise SolverError(
                text, Reason.NOT_FINITE, time, ((f"controller {one.of.name}", found),)
            )
        return found

    def jump(self, run: OpenRun) -> None:
        """Accelerations and reactions of the present state with the inputs as they are now."""
        begin_steps(run.step.state)
        # a step from jump to jump of loads fills no row: the last one has loads as they were before
        if self.columns is None or not run.done or run.done - 1 in run.jumps:
            self.row[0] = one_row(self.system, self.scheme, run.done + LATE)
        else:
            self.write()
        if run.large is None:
            # factors of another state, and turned tangents, miss a part of the jump, and which ones
            # there are depends on round-off: new ones take 8 % of an arm of 20 cells that is sampled
            # at every other step, and make C agree to 1e-14 where it did to 1e-9
            run.step.work.kind[:2] = 0
        status = self.call(run, stepping.jump)
        if status != stepping.DONE:
            run.model.check()
            run.step.work.kind[0] = 0

    def fill(self, number: int) -> None:
        if self.columns is None:
            self.row[0] = one_row(self.system, self.scheme, number + 1)
        else:
            if self.histories:
                super().fill(number)
            self.write()

    def write(self) -> None:
        """Columns of inputs that are signals as they are."""
        for column, name in self.columns or ():
            self.row[0, column] = self.given[name].values[-1]

    def recorded(self) -> System:
        """The system with what controllers gave so far as histories."""
        own = {one.of.name for one in self.samplers}
        told = {
            name: GivenInput(
                self.scheme.step,
                values,
                smooth=self.given[name].smooth,
                controller=name if name in own else "",
            )
            for name, values in self.record.items()
        }
        return with_inputs(self.plain, {**self.given, **told})

    def growing(self) -> str:
        """What is said of a controller whose output grows ever more, quarter by quarter of its
        samples; nothing of others.
        """
        for one in self.samplers:
            told = np.abs(self.record[one.of.name][1 :: one.every])
            # what has no more room to grow stays
            told = told[: int(np.argmax(told >= 0.5 * told.max(initial=0.0))) + 1]
            if len(told) < 4 * FEW:
                continue
            most = [float(part.max()) for part in np.array_split(told, 4)]
            if rises(most):
                rose = f"the output of controller '{one.of.name}' rose from {most[0]:.3g} to {most[3]:.3g} {one.of.unit}".rstrip()
                return f"{rose} in {len(told)} samples, quarter by quarter"
        return ""

    def unsteady(self, look: Callable[[Rising], tuple[float, float, int] | None]) -> str:
        """What is said of an input that a caller raises as an unstable loop does; nothing where
        none rises.
        """
        for name, one in self.rising.items():
            if found := look(one):
                low, high, steps = found
                rose = f"input '{name}' rose from {low:.3g} to {high:.3g} {self.inputs[name].unit}".rstrip()
                return f"{rose} in {steps} steps, ever faster: the loop that sets it is unstable; lower its gains, or limit it"
        return ""

    def explain(self, run: OpenRun) -> str:
        """That a loop is unstable."""
        if told := self.unsteady(Rising.before_failure):
            return f"{Reason.GROWING.value}: {told}"
        told = self.unstable(run)
        if told or not (told := self.diverging(run)):
            return told
        return f"{Reason.GROWING.value}: {told}"

    def diverging(self, run: OpenRun) -> str:
        """What is said of the loop of a controller that diverges; nothing where none does."""
        controllers = [one.of for one in self.samplers]
        return sampled_loops.tell_diverging(run, controllers, self.record)

    def finish(self, run: OpenRun, motion: Trajectory) -> Trajectory:
        """A warning of a controller whose output grows with the energy of the motion."""
        if text := self.unstable(run):
            notify(text)
        return motion

    def unstable(self, run: OpenRun) -> str:
        """What is said of a controller whose output grows with the energy of the motion; nothing
        where none does.
        """
        if not (told := self.growing()):
            return ""
        # a live run stores none
        motion = trajectory(run) if run.steps else motion_of(run, run.time)
        energy = survey_of(motion)[0][:, :2].sum(axis=1)
        rise = f"{told}, and the energy of the motion to {energy.max():.3g} J up to t = {motion.times[-1]:.6g} s"
        return f"{Reason.GROWING.value}: {rise}; lower its gains, take a shorter sample time, or limit it"

    def arrays(self, run: OpenRun) -> dict[str, np.ndarray]:
        found = {f"input {name}": np.array(one.values) for name, one in self.given.items()}
        found |= {f"controller {one.of.name}": np.array(one.memory) for one in self.samplers}
        return found | {f"told {name}": np.array(values) for name, values in self.record.items()}

    def put(self, run: OpenRun, arrays: Mapping[str, np.ndarray]) -> None:
        for name, one in self.given.items():
            one.values = checkpoints.fitting(arrays, f"input {name}", np.array(one.values)).tolist()
            one.first = run.done + 1 - KEPT
        for each in self.samplers:
            each.memory = checkpoints.fitting(
                arrays, f"controller {each.of.name}", np.array(each.memory)
            ).tolist()
        for name in self.record:
            self.record[name] = checkpoints.fitting(
                arrays, f"told {name}", np.zeros(run.done + 1)
            ).tolist()


@offered
def _(setting: RunSetting) -> Iterator[Observer]:
    if is_fed(setting):
        feed = Feed(with_locks(setting.system), setting.scheme)
        yield feed
        yield Reader(feed.system)
        if setting.system.triggers:
            yield EventObserver(feed.system, feed.plain, feed.set_input)


def is_fed(setting: RunSetting) -> bool:
    """Whether something is given while it runs: by a caller, by controllers or events."""
    system = setting.system
    return (
        setting.live
        or bool(system.triggers)
        or any(isinstance(one, Controlled) for one in system.signals)
    )


def sampler(one: Controlled, scheme: GeneralizedAlpha) -> Sampler:
    """A controller, sampled every so many steps.

    InputError where the sample time is no whole number of steps of the scheme.
    """
    every = round(one.sample / scheme.step)
    if every < 1 or abs(every * scheme.step - one.sample) > NEAR * one.sample:
        expected = f"a whole number of steps of {scheme.step:g} s"
        raise InputError(say(f"controller '{one.name}'.sample", expected, f"{one.sample:g} s"))
    return Sampler(one, every, list(one.law.memory))


def is_finite(value: Any) -> bool:
    """Whether something is a finite number."""
    return isinstance(value, float | Real) and math.isfinite(value)
