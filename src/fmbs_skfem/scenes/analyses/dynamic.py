"""Motions by time integration."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np

from ... import dynamics
from ...core.errors import InputError, say
from ...core.notices import Progress
from ...core.storage.records import dataclass
from ...core.values.fields import Takes, Time, quantity
from ...core.values.problems import Found, Keys, Problem
from ...dynamics import GeneralizedAlpha, Newton, Trajectory, rest
from ...dynamics.instants import Instants
from ...dynamics.observers import Observer
from ...dynamics.scheme import DYNAMIC, Start
from ...dynamics.tracing import FEW
from ...systems.free_motions import unsupported
from .. import field_kinds as fields
from .. import times
from ..accuracy import Wanted, of_outputs
from ..field_kinds import Spans
from ..yamlfile import Oddity
from . import static as statics
from .analysis import Form, History, Work, refuse_unsupported

if TYPE_CHECKING:
    from ...dynamics.checkpoint import Record, Resumed
    from ...systems import System
    from ..schema import Scene

ITERATIONS, FACTORED = 2.5, 0.2  #: of a time step, usually
LEFT_OUT = 0.0
AUTO = math.inf  #: steps that are found for the accuracy
FIRST = 500  #: steps that are counted with where none is known yet
# 32 MB of x, v and accelerations
ROOM = 1.4e6  #: numbers of x up to which all states of a run that is compared are kept
STEP = Takes(
    lambda value, context: AUTO if value == "auto" else float(fields.TIME.read(value, context)),
    fields.TIME.schema | {"description": "a time [s] > 0, or auto: found for the accuracy"},
    show=lambda value: "auto" if value in (LEFT_OUT, AUTO) else value,
)


@dataclass(frozen=True, kw_only=True)
class Dynamic(History):
    """Time integration by generalized-alpha; every `every`-th step is kept, or states every so many
    seconds, span by span.

    States at times that are no multiples of the step are interpolated within steps, with the order
    of the method.

    The motion starts as the scene is drawn, or in the equilibrium of its loads at t = 0, with the
    initial motion put on top of it.

    Without `constraints`, linear ones are eliminated, except where plates are large: sparse factors
    need them as multipliers. `solver` is that of large models: this package's, or PARDISO (the
    extra `pardiso`).

    In place of the step an `accuracy` may be given: a part of the range of every output (1e-3, 0.1
    %), an error (1 mm), or errors by output ({C: 1 mm, motor: 2 %}). Then the step, and the cells
    of lines that have none, are found by pilot runs, and every number comes with its error. A step
    that stands beside it stays.

    Newton's `tolerance` is 2e-12 of the size of the mechanism, or looser where an accuracy leaves
    it out and allows that.

    With a `local_error` the step is the longest one: it is taken in 2 to 32 parts where it errs by
    more than that.

    {type: dynamic, duration: 2 s, step: 1 ms}
    """

    constraints: Form = None
    duration: Time
    step: Annotated[float, STEP] = LEFT_OUT
    accuracy: Wanted | None = None
    rho_inf: Annotated[
        float,
        quantity("", ">= 0", "<= 1"),
        "spectral radius at infinite frequency, from 0 (damps most) to 1 (damps nothing)",
    ] = 0.8
    every: fields.Every = 1
    start: Start = "reference"
    local_error: Annotated[
        float,
        quantity("", ">= 0", "< 1"),
        "error of a step over the size of the mechanism, above which it is divided; 0 for none",
    ] = 0.0
    tolerance: fields.NewtonTolerance | None = None
    solver: Literal["own", "pardiso"] = "own"
    moves: ClassVar[bool] = True
    label: ClassVar[str] = "integrating"

    @property
    def drawn(self) -> bool:
        return self.start == "reference"

    @property
    def open(self) -> bool:
        """Whether its step is to be found."""
        return self.step in (LEFT_OUT, AUTO)

    @property
    def scheme(self) -> GeneralizedAlpha:
        return GeneralizedAlpha(self.step, self.rho_inf, self.start, self.local_error)

    @property
    def newton(self) -> Newton:
        """How every step is iterated."""
        return Newton(self.tolerance or DYNAMIC, solver=self.solver)

    @property
    def kept(self) -> int | np.ndarray:
        """What `dynamics.integrate` takes as `every`: states to be kept."""
        return times.kept(self.every, self.step, self.duration)

    @property
    def within(self) -> np.ndarray | None:
        """Instants (s,) [s] of states within steps; None where all are at ends of steps."""
        return (
            times.instants(self.every, self.step, self.duration)
            if isinstance(self.every, tuple)
            else None
        )

    def sampled(self) -> tuple[int | np.ndarray, list[Observer]]:
        """What `dynamics.integrate` takes as `every`, and who gives states within steps."""
        if (asked := self.within) is None:
            return self.kept, []
        found = Instants(asked, self.scheme, self.duration)
        return found.steps, [found]

    def settled(
        self, step: float | None, local_error: float = 0.0, tolerance: float | None = None
    ) -> Dynamic:
        if step is None:
            return replace(self.counted(), accuracy=None)
        local = local_error or self.local_error
        own = self.tolerance or tolerance
        return replace(self, step=step, local_error=local, tolerance=own, accuracy=None)

    def piloted(
        self, steps: int, every: int, local_error: float = 0.0, tolerance: float | None = None
    ) -> Dynamic:
        return replace(
            self.settled(self.duration / steps, local_error, tolerance),
            every=every,
            accuracy=self.accuracy,
        )

    def halved(self) -> Dynamic:
        """The analysis in half the steps, with states at the same times."""
        every = 2 * self.every if isinstance(self.every, int) else self.every
        return replace(self, step=0.5 * self.step, every=every)

    def counted(self) -> Dynamic:
        """The analysis with some step, for what is said of it before one is found."""
        return self if not self.open else replace(self, step=self.duration / FIRST)

    def instants(self) -> np.ndarray:
        if self.open:
            return self.counted().instants()
        if self.duration > times.STEPS * self.step:
            got = f"{self.duration:g} s in steps of {self.step:g} s"
            raise InputError(
                say(
                    "duration",
                    f"at most {times.STEPS} steps",
                    got,
                    "shorten it, or lengthen the step",
                )
            )
        return np.minimum(
            np.arange(int(np.ceil(self.duration / self.step)) + 1) * self.step, self.duration
        )

    def work(self) -> Work:
        steps = round(self.duration / self.step)
        kept = self.sampled()[0]
        stored = len(kept) if isinstance(kept, np.ndarray) else steps // kept + 1
        counts = {"steps": steps, "stored_states": stored}
        forces = ITERATIONS + 4 * FACTORED
        factors = FACTORED
        before = 0.0 if self.drawn else rest.LOAD_STEPS * statics.ITERATIONS
        totals = (
            steps * forces + 4 * before,
            steps * factors + before,
            steps * ITERATIONS,
            steps * ITERATIONS,
        )
        return Work(*totals, counts, steps, stored)

    def solve(
        self,
        system: System,
        advance: Progress | None = None,
        watch: Record | None = None,
        resume: Resumed | None = None,
    ) -> Trajectory:
        return self.integrate(system, progress=advance, record=watch, resume=resume)

    def solve_for_outputs(
        self,
        system: System,
        advance: Progress | None = None,
        watch: Record | None = None,
        resume: Resumed | None = None,
    ) -> Trajectory:
        return self.integrate(system, progress=advance, record=watch, resume=resume, states=FEW)

    def solve_to_compare(self, system: System, watch: Record | None = None) -> Trajectory:
        few = self.duration / self.step * system.size > ROOM
        return self.integrate(system, record=watch, states=FEW if few else None, judged=False)

    def integrate(self, system: System, **how: Any) -> Trajectory:
        """A motion in the steps of the analysis, see `dynamics.integrate`."""
        every, observers = self.sampled()
        chosen = self.duration, self.newton, every
        return dynamics.integrate(system, self.scheme, *chosen, observers=observers, **how)

    def examine(self, scene: Scene, raw: System) -> None:
        # a spring that a weight pulls resists across, too: its equilibrium says so
        if not self.drawn and unsupported(raw)[0] and not rest.has_equilibrium(raw, self.newton):
            refuse_unsupported(scene, raw, f"\n{rest.FREE}")

    def problems_in(self, scene: Scene) -> Iterator[Found]:
        """Steps that fit into the duration, spans of time that fit to the steps, and an accuracy of
        outputs that there are.
        """
        key = ("analysis", "step")
        if self.accuracy is not None:
            yield from of_outputs(self.accuracy, scene.outputs, ("analysis", "accuracy"))
        for i, span in enumerate(self.every if isinstance(self.every, tuple) else ()):
            if self.duration > times.STEPS * span.every:
                got = f"{span.every:g} s for {self.duration:g} s"
                yield (
                    ("analysis", "every", i, "every"),
                    Problem(f"at most {times.STEPS} states", got, "keep fewer"),
                )
        if self.open:
            if self.accuracy is None and self.step == LEFT_OUT:
                remedy = "add step: 1 ms or accuracy: 1e-3, or step: auto where --accuracy is given"
                yield (
                    key,
                    Problem("a step, or an accuracy for which one is found", "neither", remedy),
                )
            return
        if self.step > self.duration:
            yield (
                key,
                Problem(f"a step of at most the duration {self.duration:g} s", f"{self.step:g} s"),
            )
        if self.duration > times.STEPS * self.step:
            got = f"{self.step:g} s for {self.duration:g} s"
            yield (
                key,
                Problem(
                    f"at most {times.STEPS} steps",
                    got,
                    "shorten the duration, or lengthen the step",
                ),
            )
        if scene.reduction is not None:
            yield from self.uneven(("reduction", "snapshots"), scene.reduction.snapshots)

    def uneven(self, key: Keys, spans: float | Spans) -> Iterator[Found]:
        """Times that are no whole numbers of steps."""
        counted: list[tuple[Keys, float | None]] = (
            [(key, spans)] if isinstance(spans, float) else []
        )
        for i, span in enumerate(spans if isinstance(spans, tuple) else ()):
            counted += [((*key, i, "every"), span.every), ((*key, i, "until"), span.until)]
        for place, time in counted:
            if time is not None and times.count_steps(time, self.step) is None:
                yield place, Problem(f"a multiple of the step {self.step:g} s", f"{time:g} s")

    def idle(self, scene: Scene) -> Iterator[Oddity]:
        key = ("reduction", "snapshots")
        if self.open and isinstance(self.every, int) and self.every > 1:
            yield (
                ("analysis", "every"),
                f"{self.every} steps are a time that nobody knows before the step is found: give a time",
            )
        yield from self.ends(("analysis", "every"), self.every)
        for name, controller in scene.controllers.items():
            if controller.sample > self.duration * (1.0 + times.NEAR):
                text = f"is longer than the motion of {self.duration:g} s, in which the controller holds its first sample"
                yield ("controllers", name, "sample"), text
        if scene.reduction is None:
            return
        interval = scene.reduction.snapshots
        yield from self.ends(key, interval)
        if isinstance(interval, float) and interval > self.duration * (1.0 + times.NEAR):
            yield (
                key,
                f"{interval:g} s leave no snapshot but the start of a motion of {self.duration:g} s",
            )

    def ends(self, key: Keys, spans: float | Spans) -> Iterator[Oddity]:
        """The last span lasts to the end of the motion."""
        last = spans[-1].until if isinstance(spans, tuple) else None
        if last is not None and last < self.duration:
            yield (
                key,
                f"'until: {last:g} s' of the last span does nothing, it lasts to the end at {self.duration:g} s",
            )
