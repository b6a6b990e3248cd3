"""A motion that is taken step by step, with inputs that are told from outside: control and co-simulation from Python.

    run = dynamics.start(system, GeneralizedAlpha(1e-3))
    while run.time < 2.0:
        run.step({"u": -40.0 * run.outputs()["hinge"]})

A step is that of `integrate`, bit for bit, with histories that have the same values at the ends of steps. An input that drives a
joint is the cubic through its last four values; any other one acts with the value that it is told for the step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..core.errors import InputError, closest, listed, say
from ..core.inputs import KEPT, Input, Told
from ..core.structs import address_of, packed
from ..systems.signals import inputs_of, read_inputs, with_inputs
from ..systems.system import System, driven_rows, driving
from . import checkpoint as checkpoints
from . import stepping
from .checkpoint import Checkpoint
from .histories import leading_signals
from .initial import startable
from .integration import begun, divide
from .outputs import outputs
from .scheme import GeneralizedAlpha, Newton
from .trajectory import Statistics, Trajectory

MOTION = ("times", "x", "v", "a", "multipliers")  #: of a trajectory
AHEAD = 64  #: steps for which functions of time are tabulated at once


def start(system: System, scheme: GeneralizedAlpha, newton: Newton | None = None) -> LiveRun:
    """A run at its consistent start, whose steps are taken one by one; errors as those of `integrate`."""
    return LiveRun(startable(system, scheme), scheme, newton or Newton())


class LiveRun:
    """A run between two steps; see `start`."""

    def __init__(self, system: System, scheme: GeneralizedAlpha, newton: Newton) -> None:
        self.system, self.inputs = system, inputs_of(system)
        driven = {signal for _, signal in driving(system.constraints)}
        smooth = {one.name for k in driven for one in read_inputs(system.signals[k])}
        self.told = {name: Told(scheme.step, [one.start] * KEPT, 1 - KEPT, name in smooth) for name, one in self.inputs.items()}
        self.run = begun(with_inputs(system, self.told), scheme, newton, np.zeros(1, np.int64), 0)
        reading = [k for k, signal in enumerate(system.signals) if read_inputs(signal)]
        #: columns of inputs that are signals as they are; None where others read them, which are evaluated in every step
        self.columns: list[tuple[int, Told]] | None = [
            (k, self.told[one.name]) for k in reading if isinstance(one := system.signals[k], Input) and k not in driven
        ]
        if len(self.columns) < len(reading):
            self.columns = None
        self.ahead, self.broken, self.first = np.zeros((0, 0)), None, 0
        self.seen: tuple[Trajectory, dict[str, float]] | None = None
        self.row = np.zeros((1, len(system.signals) * (4 if driven_rows(system.constraints).any() else 1)))
        job = self.run.step.job._replace(signals=self.row, rows=np.array([-1]))
        self.run.step = self.run.step._replace(job=job)
        self.table = packed(self.run.step)
        self.address = address_of(self.table)

    @property
    def time(self) -> float:
        """[s]"""
        return self.run.scheme.step * self.run.done

    def step(self, inputs: Mapping[str, float] | None = None) -> None:
        """Take a step; inputs that are not named keep their values. SolverError where it cannot be taken."""
        run = self.run
        self.tell(inputs or {})
        if self.columns is None or run.large:
            signals, broken = leading_signals(run.model.system, np.array([run.scheme.step * (run.done + 1)]), run.scheme.step)
            if broken is not None:
                raise broken
            self.row[0] = signals[0]
        else:
            self.row[0] = self.tabulated(run.done)
            for column, one in self.columns:
                self.row[0, column] = one.values[-1]
        if run.step.state.parts[0] > 0:
            status = stepping.TOO_LONG
        elif run.large:
            status = run.take(run.step.method, self.row, run.step.job.rows)[0]
        else:
            status = stepping.advance.call(self.address, 0)
        if status == stepping.DONE:
            run.done += 1
        else:
            run.model.check()
            divide(run, status)

    def tell(self, inputs: Mapping[str, float]) -> None:
        """New values of all inputs."""
        for name, value in inputs.items():
            if name not in self.told:
                expected = f"one of the inputs {listed(self.told, name, 'of which there are none')}"
                raise InputError(say("run.step", expected, f"'{name}'") + closest(name, self.told))
            if not math.isfinite(value):
                raise InputError(say(f"run.step: input '{name}'", "a finite number", value))
        for name, one in self.told.items():
            values = one.values
            values.append(float(inputs[name]) if name in inputs else values[-1])
            del values[0]
            one.first += 1

    def tabulated(self, number: int) -> np.ndarray:
        """Signals at the end of a step, without inputs."""
        k = number - self.first
        if not 0 <= k < len(self.ahead):
            h = self.run.scheme.step
            self.ahead, broken = leading_signals(self.system, h * (number + 1 + np.arange(AHEAD)), h)
            self.first, k = number, 0
            if broken is not None and not len(self.ahead):
                raise broken
        return self.ahead[k]

    @property
    def state(self) -> Checkpoint:
        """All that the next step reads: set it to go on from there, here or in another run of the same system and scheme."""
        run = self.run
        arrays = checkpoints.arrays(run.step, run.large)
        arrays["inputs"] = np.array([one.values for one in self.told.values()]).reshape(len(self.told), KEPT)
        return Checkpoint(run.done, 0, self.facts, arrays, 0.0, 0.0)

    @state.setter
    def state(self, held: Checkpoint) -> None:
        checkpoints.restore(held, self.facts, self.run.step, self.run.large)
        given = checkpoints.fitting(held.arrays, "inputs", np.zeros((len(self.told), KEPT)))
        for one, values in zip(self.told.values(), given, strict=True):
            one.values, one.first = values.tolist(), held.done + 1 - KEPT
        self.run.done, self.seen = held.done, None

    @property
    def facts(self) -> dict[str, str]:
        """What the model and the method are."""
        run = self.run
        if not run.facts:
            run.facts = checkpoints.facts(replace(run.model, system=self.system), run.step.method, 0, run.kept)
        return run.facts

    def outputs(self) -> dict[str, float]:
        """All named outputs of the present state; angles count their turns from call to call."""
        now = self.motion()
        if self.seen is None:
            found = {name: float(column[0]) for name, column in outputs(now).items()}
        else:
            before, values = self.seen
            if before.times[0] == now.times[0]:
                return dict(values)
            columns = outputs(joined(before, now))
            found = {name: float(b if values[name] == a else values[name] + (b - a)) for name, (a, b) in columns.items()}
        self.seen = now, found
        return dict(found)

    def motion(self) -> Trajectory:
        """The present state as a trajectory of one instant."""
        run, state = self.run, self.run.step.state
        back = np.argsort(run.model.order)
        x, v, a = (part[back][None] for part in (state.x, state.v, state.acceleration))
        held = state.multipliers[None] / run.step.method.c
        steps, iterations, factorisations, halved = (int(k) for k in run.step.job.counters)
        cost = Statistics(steps, iterations, factorisations, halved, 0.0, 0.0)
        return Trajectory(run.model.system, np.array([self.time]), x, v, a, held, cost, state.memory[None].copy())


def joined(one: Trajectory, other: Trajectory) -> Trajectory:
    """A motion and its continuation."""
    times, x, v, a, held = (np.concatenate([getattr(part, key) for part in (one, other)]) for key in MOTION)
    memory = None if one.memory is None or other.memory is None else np.concatenate([one.memory, other.memory])
    return Trajectory(other.system, times, x, v, a, held, other.statistics, memory)
