"""Pilot runs of a scene: with other cells of its lines and other steps, their outputs at common
instants.
"""

from __future__ import annotations

import copy
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from ...core.errors import InputError, Reason, SolverError, listed, say
from ...core.notices import CoarseStep, Notice
from ...dynamics import Trajectory, output_errors
from ...dynamics.checkpoint import Record, RunState
from ...dynamics.compiled_step.parts import FINEST
from ...dynamics.scheme import DYNAMIC
from ...parts import departures, finer_parts
from ...scenes import build
from ...scenes.schema import Scene
from ...systems import finer_systems
from ...systems.compiled import compile_system
from ...systems.system import System

#: at which runs are compared at least; with 25 of them 3 of 30 plans missed what 200 saw
INSTANTS = 200
COMMON = 100  #: instants that all numbers of steps have in common, half of them with a proof of half the steps, at least
DIVIDED = 20  #: steps that a run may divide to count as resolved
FEWEST = 2  #: cells with which a chain of meshes begins
FLOOR = 1.5e5  #: errors over a run beside Newton's tolerance: 2e-12 leaves 2e-7 of a double pendulum in 3 s, 1e-10 leaves 7e-7
FLOOR_AT_REST = 1e3  #: the same of an equilibrium, whose load steps do not add up
# four models in 60 numbers of steps: of positions 0.3 % of the accuracy is left at most, of
# reactions 3 % of the error of the step; with ten times of it as much, in equal times
LEFT = 0.02  #: of the accuracy, that Newton may leave of a motion where its tolerance is chosen
LOOSEST = 1e-8  #: tolerance that is chosen
TRUST = 0.5  #: of the accuracy, by which two runs of a sensitive motion may differ: the error of the finer may be twice as large
FACTOR = 4.0  #: corrections that a factorisation is worth, at least: 4 to 14 in small models
#: orders by which outputs of a unit converge slower than positions do, two where it is none of
#: these
LOST = {"m": 0, "m/s": 0, "m/s^2": 0, "J": 0, "W": 0, "rad": 1, "rad/s": 1}
GRID = 100_000  #: steps a duration may have at least because of other times of its scene


class PilotOutputs(NamedTuple):
    """Outputs of a pilot run."""

    times: np.ndarray  #: (s,) [s]
    columns: Mapping[str, np.ndarray]  #: (s,) each
    events: tuple[float, ...] = ()  #: when they happened [s]
    stopped: bool = False  #: whether the last of them ended the motion
    work: float = 0.0  #: corrections that it took, or that its factorisations would have been


class ScenePilots:
    """Runs of a scene, and their differences beside its accuracy.

    A level of cells is the number of them in every line that has none of its own; where all have
    theirs, how many times as many these become in every direction. States may be asked for `within`
    steps; lines of bodies are there where `pictures` or position errors are asked for.
    """

    def __init__(
        self,
        scene: Scene,
        allow_outside: bool = False,
        within: bool = False,
        pictures: bool = False,
    ) -> None:
        self.scene, self.allow_outside, self.pictures = scene, allow_outside, pictures
        self.analysis = build.history(scene)
        if self.analysis.accuracy is None:
            raise InputError(say("analysis.accuracy", "an accuracy", "none"))
        self.accuracy = self.analysis.accuracy
        bodies = scene.bodies.items()
        self.open = [name for name, body in bodies if body.open]
        fine = {name: body.finer(2) for name, body in bodies if not body.open}
        meshed = [name for name, found in fine.items() if found is not scene.bodies[name]]
        #: bodies whose cells stay as they are, but can be finer
        self.refined = [name for name in meshed if fine[name] is not None]
        self.unjudged = [name for name in meshed if fine[name] is None]
        self.grid = grid_of(scene, within) if scene.analysis.moves else 1
        self.systems: dict[int, System] = {}
        #: the same, with parts that can be held against finer ones
        self.checked: dict[int, System] = {}
        #: of a level and a number of steps, as far as somebody has kept them
        self.made: dict[tuple[int, int], PilotOutputs] = {}
        self.titles: tuple[str, ...] = ()  #: of the columns that are compared
        self.units: tuple[str, ...] = ()  #: theirs
        self.room = 0.0  #: what a motion may err by, over its size, as far as it is known

    @property
    def order(self) -> np.ndarray:
        """(k,): differences of meshes fall by 2^order at most, of positions by that of the finest
        splines.

        Moments are of second derivatives, and converge with two orders less; coarse meshes may fall
        faster, and are not believed.
        """
        finest = 1 + max(
            (
                getattr(self.scene.bodies[name], "degree", None) or 3
                for name in self.open or self.refined
            ),
            default=3,
        )
        return np.array([max(finest - LOST.get(unit, 2), 1) for unit in self.units])

    @property
    def rough(self) -> bool:
        """Whether forces jump: those that act on one side."""
        forces = compile_system(self.any_system).arrays.forces
        return len(forces.judged) > 0 or not forces.smooth

    @property
    def finest(self) -> float:
        """The finest bound, of a range or over the size of the mechanism: a first guess of what
        positions may err by.
        """
        length = self.any_system.scale
        return min(
            one.value / (length if one.unit == "m" else 1.0)
            for one in self.accuracy.bounds.values()
        )

    @property
    def any_system(self) -> System:
        """The system of some level, for what all have in common."""
        return next(iter(self.systems.values()))

    def scene_of(self, level: int) -> Scene:
        """The scene with a level of cells, without an accuracy."""
        scene = self.scene if self.open or level <= 1 else self.refined_by(level)
        return scene.chosen(level or None, None)

    def refined_by(self, times: int) -> Scene:
        """The scene with so many times the cells a direction in all meshes that are given and can
        be finer.
        """
        finer = {name: self.scene.bodies[name].finer(times) for name in self.refined}
        return replace(
            self.scene,
            bodies=self.scene.bodies
            | {name: body for name, body in finer.items() if body is not None},
        )

    @property
    def remedy(self) -> str:
        """What makes the meshes finer that are given; nothing where none is."""
        cut = [name for name in self.refined if self.scene.bodies[name].divisible]
        if cut == self.refined:
            return "leave cells and refine out to have that found" if cut else ""
        return f"give {listed([name for name in self.refined if name not in cut])} more cells (`refine` or `cells`)"

    def level_of(self, cells: int) -> int:
        """The level of some cells: 0 and 1 are the meshes that are given."""
        return cells if self.open else max(cells, 1)

    def system(self, cells: int) -> System:
        level = self.level_of(cells)
        if level not in self.systems:
            scene = self.scene_of(level)
            self.checked[level] = build.chosen_form(
                scene, build.system(scene, None, self.allow_outside, self.pictures)
            )
            self.systems[level] = finer_systems.unchecked(self.checked[level])
        return self.systems[level]

    def with_finer_parts(self, cells: int) -> ScenePilots | None:
        """The same with all shapes that parts know; None where none of them knows more."""
        self.system(cells)
        level = self.level_of(cells)
        if (
            not departures.trained_parts(self.checked[level])
            or (finer := finer_parts.finer(self.checked[level])) is None
        ):
            return None
        return self.with_system(cells, finer)

    def with_system(self, cells: int, system: System) -> ScenePilots:
        """The same with another system of a level."""
        found = copy.copy(self)
        found.systems = {self.level_of(cells): finer_systems.unchecked(system)}
        found.made = {}
        return found

    def run(self, cells: int, steps: int, local_error: float = 0.0) -> PilotOutputs | None:
        """Outputs at the ends of all steps.

        None where steps fail, many are divided, or are too large for a history.

        A force that repeats as often as the steps is the same at all their ends, and at those of
        half the steps.
        """
        if not local_error and (made := self.made.get((self.level_of(cells), steps))):
            return made
        tried = self.attempt(lambda: self.solve(cells, steps, local_error, give_up))
        return None if tried is None else tried[1]

    def attempt(self, solve: Callable[[], Trajectory]) -> tuple[Trajectory, PilotOutputs] | None:
        """The motion that is solved for, and its outputs; None where it fails, or its steps do not
        resolve it.
        """
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("ignore", Notice)
            warnings.simplefilter("always", CoarseStep)
            try:
                motion = solve()
            except SolverError:
                if not self.analysis.moves:
                    raise
                return None
            coarse = self.analysis.open and any(
                issubclass(one.category, CoarseStep) for one in warned
            )
            if coarse or motion.statistics.halved > DIVIDED:
                return None
            cost = motion.statistics
            found = PilotOutputs(
                motion.times,
                output_errors.columns(motion),
                tuple(one.time for one in motion.events),
                output_errors.stopped(motion),
                cost.iterations + FACTOR * cost.factorisations,
            )
        self.find_room(found)
        return motion, found

    def solve(
        self, cells: int, steps: int, local_error: float = 0.0, watch: Record | None = None
    ) -> Trajectory:
        """The motion at the ends of all its steps: forces have short peaks where loads, drives and
        contacts jump.
        """
        system = self.system(cells)
        tolerance = self.tolerance(steps, local_error)
        return self.analysis.piloted(steps, 1, local_error, tolerance).solve_to_compare(
            system, watch
        )

    def tolerance(self, steps: int, local_error: float = 0.0) -> float:
        """Newton's tolerance, over the size of the mechanism: that of the scene, or one that leaves
        LEFT of the accuracy.

        What d is left of q in a step changes q' by some d / (beta h), which takes q along to the
        end: with any signs over N steps

            e = d N^(3/2) / beta    of positions, and of velocities in units of the size over the duration.

        That is 2 to 30 times what is found. Accelerations and reactions err by d / (beta h^2),
        which the iteration keeps below a part of the method's own error in every step, see
        `compiled_step.stepping`, whatever the tolerance is.
        """
        scheme = self.analysis.piloted(max(steps, 1), 1, local_error).scheme
        if self.analysis.tolerance is not None or scheme is None:
            return self.analysis.tolerance or DYNAMIC
        most = steps * 2**FINEST if scheme.local_error else steps
        return float(
            np.clip(LEFT * self.room * scheme.coefficients[3] / most**1.5, DYNAMIC, LOOSEST)
        )

    @property
    def usual(self) -> int:
        """The number of steps with which a chain begins, INSTANTS or more."""
        return INSTANTS // COMMON * self.unit

    @property
    def unit(self) -> int:
        """All numbers of steps are multiples of it, and have a half."""
        return 2 * self.multiple(COMMON // 2)

    def find_room(self, found: PilotOutputs) -> None:
        """What a motion with these outputs may err by; an accuracy below what the iteration of
        every step leaves is refused.

        The room is the finest bound over what a mechanism of this size does in that time, or over
        the range where that is larger.
        """
        system = self.any_system
        tolerance = self.analysis.tolerance or DYNAMIC  # the least one that is chosen
        floor = (FLOOR if self.analysis.moves else FLOOR_AT_REST) * tolerance
        natural = output_errors.smallest_ranges(system, float(np.ptp(found.times)), 1.0)
        off = {name: values + 1.0 for name, values in found.columns.items()}  # in its unit
        for error in output_errors.between(found.columns, off, system.outputs).values():
            bound = self.accuracy.bound(error)
            least = 0.0 if bound is None else floor * error.range if bound.unit else floor
            if bound is not None and bound.value < least:
                expected = (
                    f"an error of {error.output} of at least {least:.1g} {bound.unit}".strip()
                )
                remedy = f"Newton's tolerance of {tolerance:g} leaves that"
                raise InputError(say("analysis.accuracy", expected, f"{bound.value:g}", remedy))
            if (
                bound is not None
                and (part := bound.part(error)) > 0.0
                and (size := max(natural.get(error.unit, 0.0), error.range))
            ):
                self.room = (
                    min(self.room, 1.0 / (part * size)) if self.room else 1.0 / (part * size)
                )

    def differ(self, one: PilotOutputs, other: PilotOutputs) -> np.ndarray:
        """(2, k): differences of columns from `other` over what is wanted, 0 where nothing is; and
        in their units.
        """
        first, second = output_errors.common_times("pilot runs", one.times, other.times)
        between = between_events(other.times[second], one.events, other.events)
        first = first[between]
        second = second[between]
        if one.stopped and other.stopped:
            first, second = output_errors.with_ends((first, second), one.times, other.times)
        system = self.any_system
        pick = lambda found, rows: {name: values[rows] for name, values in found.columns.items()}  # noqa: E731
        nothing = output_errors.round_off(system, other.times)
        errors = output_errors.between(
            pick(other, second), pick(one, first), system.outputs, nothing=nothing
        )
        self.titles, self.units = tuple(errors), tuple(one.unit for one in errors.values())
        # as parts of ranges over the whole motion, however few instants two runs have in common
        whole = {name: float(np.ptp(values)) for name, values in other.columns.items()}
        errors = {
            name: replace(one, relative=one.relative * shrunk(one.range, whole[name]))
            for name, one in errors.items()
        }
        wanted = self.accuracy.parts(errors)
        if not wanted:
            known = ", ".join(sorted({error.unit for error in errors.values()}))
            raise InputError(
                say("analysis.accuracy", f"an error of outputs in one of {known}", self.accuracy)
            )
        return np.array(
            [
                [wanted.get(column, 0.0) for column in errors],
                [error.error for error in errors.values()],
            ]
        )

    def multiple(self, least: int) -> int:
        """The fewest steps, at least so many, of which other times of the scene are whole numbers."""
        return self.grid * math.ceil(least / self.grid)

    @property
    def fewest(self) -> int:
        """Cells with which a chain of meshes begins: two, or as many as named points inside of
        lines ask for.
        """
        return max(
            FEWEST,
            *(self.scene.bodies[name].fewest(self.scene, self.allow_outside) for name in self.open),
        )

    def trusted(self, one: PilotOutputs, other: PilotOutputs) -> float:
        """The time [s] up to which two runs agree within the accuracy."""
        common = other.times[output_errors.common_times("pilot runs", one.times, other.times)[1]]
        low = 0
        high = len(common) - 1
        while low < high:  # differences never fall with more of the motion
            middle = (low + high + 1) // 2
            end = common[middle] * (1.0 + 1e-9)
            if self.differ(until(one, end), until(other, end))[0].max() > TRUST:
                high = middle - 1
            else:
                low = middle
        return float(common[low])


def give_up(state: RunState) -> None:
    """SolverError of a run that has divided too many of its steps to count as resolved: divided
    ones are the dearest.
    """
    if state.halved > DIVIDED:
        raise SolverError(
            f"{state.halved} divided steps up to t = {state.time:.6g} s", Reason.NOT_CONVERGED
        )


def shrunk(part: float, whole: float) -> float:
    """The range of some instants over that of all."""
    return part / whole if whole > part > 0.0 else 1.0


def between_events(times: np.ndarray, one: Sequence[float], other: Sequence[float]) -> np.ndarray:
    """Which times (s,) [s] lie on the same side of every event in both runs, which jump there at
    times of their own.
    """
    found = np.ones(len(times), bool)
    for a, b in zip(one, other, strict=False):
        found &= (times < min(a, b)) | (times > max(a, b))
    return found


def until(found: PilotOutputs, time: float) -> PilotOutputs:
    """A run up to a time [s]."""
    early = found.times <= time
    return found._replace(
        stopped=found.stopped and bool(early.all()),
        times=found.times[early],
        columns={name: values[early] for name, values in found.columns.items()},
    )


def grid_of(scene: Scene, within: bool = False) -> int:
    """The fewest equal steps of a motion of which all other times that count steps are whole
    numbers.

    Those of states are none where these may lie `within` steps.
    """
    analysis = build.dynamic(scene)
    spans = []
    for every in (
        (analysis.every, scene.reduction.snapshots if scene.reduction else None)
        if not within
        else ()
    ):
        spans += (
            [time for span in every for time in (span.every, span.until)]
            if isinstance(every, tuple)
            else []
        )
        spans += [every] if isinstance(every, float) else []
    spans += [one.sample for one in scene.controllers.values()]
    parts = [
        Fraction(time / analysis.duration).limit_denominator(GRID)
        for time in spans
        if time is not None
    ]
    grid = math.lcm(*(part.denominator for part in parts)) if parts else 1
    if grid > GRID:
        raise InputError(
            say(
                "analysis.accuracy",
                f"times of the scene that fit into {GRID} equal steps",
                f"{grid}",
                "round them",
            )
        )
    return grid
