"""CPU time to a true error: the run that an accuracy chooses beside the best mesh and step of
Exudyn, for six mechanisms of beams.

    python benchmarks/time_to_error.py [repetitions] [NAMES]

Both codes measure curvature by |r' x r''| / |r'|^2 and converge to the same motion, which is
checked. Errors are the largest ones of a coordinate at 200 instants over its range, each code
against a run of its own: ours of four times the cells and the steps that are chosen, Exudyn's of
MESHES[-1] elements and STEPS[-1] steps, so that neither code pays for what the limits differ by.

Exudyn (which is no dependency: `pip install exudyn`) runs without range checks, with modified
Newton and the same rho_inf. Full and reduced integration, a loose and a tight tolerance of Newton,
its dense and its sparse solver: what errs least on one mesh, soonest, is taken; then all of MESHES
x STEPS are tried, and what meets the error soonest counts. Ours is the run that `accuracy` chooses,
and its pilots stand beside it: they are what trying all of Exudyn's is. In hindsight the same grid
is tried for ours, and held against its own limit as Exudyn's runs are. CPU seconds of one thread:
the call of the integration, with its outputs; the codes alternate, and the best of the repetitions
counts.
"""

from __future__ import annotations

import importlib
import itertools
import json
import statistics
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from accuracy import timed, wanting
from mechanisms import (
    GRAVITY,
    HELD,
    IN_SPACE,
    PINNED,
    STRIP,
    TIP,
    beam,
    in_space,
    mechanism,
    pin,
    written,
)
from threadpoolctl import threadpool_limits

from fmbs_skfem.scenes.schema import Scene
from fmbs_skfem.studies.planning import planned
from fmbs_skfem.studies.planning.pilots import ScenePilots

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
WANTED = (1e-2, 1e-3, 1e-4)
INSTANTS, RHO = 200, 0.8
MESHES = (2, 3, 4, 6, 8, 10, 12, 16, 20, 32, 64)  #: elements a beam, the last one for the reference
STEPS = tuple(INSTANTS * n for n in (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 256))
TOLERANCES = (1e-3, 1e-6)  #: absolute tolerances of its Newton iteration
#: elements and steps by which its other settings are chosen, and errors that count as the least
PROBE, AS_GOOD = (
    (8, 1600),
    1.1,
)
SAME = 3e-4  #: of a range, by which the limits of both codes may differ
WEIGHT = 9.81  #: [m/s^2]
CURVATURE = {"curvature": "material"}
DRIVE = "1.2 * (t - sin(2 * pi * t) / (2 * pi))"  #: an angle that begins without a jump [rad]
FOUR_BAR = 53.13010235415598  #: of its coupler [deg]

ROUND = {
    "mass": 1800.0 * np.pi * 0.005**2,
    "axial": 1e9 * np.pi * 0.005**2,
    "bending": 1e9 * np.pi * 0.01**4 / 64,
}
#: of the strip
FLAT = {
    "mass": 1800.0 * 6e-5,
    "axial": 1e9 * 6e-5,
    "bending": 1e9 * 0.02 * 0.003**3 / 12,
}


def drive(t: Any, sine: Callable[[Any], Any] = np.sin) -> Any:
    """The driven angle [rad] at a time [s]."""
    return 1.2 * (t - sine(2.0 * np.pi * t) / (2.0 * np.pi))


SCENES: dict[str, str] = {
    "double_pendulum": mechanism(
        3.0,
        [in_space("first", **CURVATURE), in_space("second", x=1.0, turn=90, **CURVATURE)],
        [
            "  O: {type: spherical, at: first.left}",
            "  A: {type: spherical, at: first.right, to: second.left}",
        ],
        [IN_SPACE],
        ["  tip: {type: position, at: second.right}"],
        3,
    ),
    "four_bar": mechanism(
        1.5,
        [
            beam("crank", 0.2, **STRIP, **CURVATURE),
            beam("coupler", 0.5, 0.2, turn=FOUR_BAR, **STRIP, **CURVATURE),
            beam("rocker", 0.4, 0.5, turn=90, **STRIP, **CURVATURE),
        ],
        [
            pin("O", "crank.left"),
            pin("A", "crank.right", "coupler.left"),
            pin("C", "coupler.right", "rocker.right"),
            pin("D", "rocker.left"),
            f"  motor: {{type: driven_angle, at: crank.left, angle: {DRIVE}}}",
        ],
        [GRAVITY],
        ["  tip: {type: position, at: rocker.right}"],
    ),
    "spin_up": mechanism(
        2.0,
        [beam("beam", **CURVATURE)],
        [PINNED, f"  d: {{type: driven_angle, at: beam.left, angle: {DRIVE}}}"],
        [],
        [TIP],
    ),
    "cantilever": mechanism(
        1.0,
        [beam("beam", **CURVATURE)],
        [HELD],
        ["  f: {type: point_force, at: beam.right, force: [0, -0.5 N]}"],
        [TIP],
    ),
    "tip_mass": mechanism(
        1.5,
        [beam("beam", **CURVATURE), "  bob: {type: point_mass, mass: 0.3 kg, position: [1 m, 0]}"],
        [PINNED, "  hook: {type: spherical, at: bob, to: beam.right}"],
        [GRAVITY],
        [TIP],
    ),
    "slider_crank": mechanism(
        1.5,
        [beam("crank", 0.15, **STRIP, **CURVATURE), beam("rod", 0.5, 0.15, **STRIP, **CURVATURE)],
        [
            pin("O", "crank.left"),
            pin("A", "crank.right", "rod.left"),
            "  S: {type: slider, at: rod.right, direction: [1, 0]}",
            f"  motor: {{type: driven_angle, at: crank.left, angle: {DRIVE}}}",
        ],
        [GRAVITY],
        ["  tip: {type: position, at: {body: rod, s: 0.25 m}}"],
    ),
}


@dataclass(frozen=True)
class Settings:
    """How Exudyn runs: elements a beam, steps, integration, tolerance and solver."""

    elements: int
    steps: int
    reduced: bool
    tolerance: float
    solver: str


@dataclass(frozen=True)
class Row:
    """One mechanism with one error: CPU seconds, true errors over what is wanted."""

    name: str
    wanted: float
    ours_s: float
    error: float
    cells: int
    steps: int
    pilots_s: float
    hindsight_s: float | None  #: of the cheapest mesh and step of ours
    hindsight: tuple[int, int] | None  #: its cells and steps
    why_not: str  #: what `accuracy` says where it does not promise the error
    exudyn_s: float | None
    exudyn_error: float | None
    settings: Settings | None

    @property
    def ratio(self) -> float:
        """Exudyn's time over ours."""
        return np.inf if self.exudyn_s is None else self.exudyn_s / self.ours_s

    @property
    def in_hindsight(self) -> str:
        """Cells, steps, time and ratio of our cheapest run, as cells of a table."""
        if self.hindsight is None or self.hindsight_s is None:
            return "none | | "
        ratio = "" if self.exudyn_s is None else f"{self.exudyn_s / self.hindsight_s:.1f}"
        cells, steps = self.hindsight
        return f"{cells} x {steps} | {1e3 * self.hindsight_s:.1f} | {ratio}"

    @property
    def words(self) -> str:
        """The cells of its line of a table."""
        said = f" ({self.why_not})" if self.why_not else ""
        ours = f"{self.cells} x {self.steps} | {self.error:.2f}{said} | {1e3 * self.ours_s:.1f} | {1e3 * self.pilots_s:.0f}"
        if (best := self.settings) is None or self.exudyn_s is None:
            return f"| {self.name} | {self.wanted:g} | {ours} | none | | | | {self.in_hindsight} |"
        how = f"{best.elements} x {best.steps}, {'reduced' if best.reduced else 'full'}, {best.tolerance:g}, {best.solver}"
        theirs = f"{how} | {self.exudyn_error:.2f} | {1e3 * self.exudyn_s:.1f} | {self.ratio:.1f}"
        return f"| {self.name} | {self.wanted:g} | {ours} | {theirs} | {self.in_hindsight} |"


class Beams:
    """A model of Exudyn in the plane, or in space."""

    def __init__(self, settings: Settings, space: bool = False) -> None:
        sys.exudynFast = True  # type: ignore[attr-defined]
        self.exudyn, self.items = (
            importlib.import_module(name) for name in ("exudyn", "exudyn.itemInterface")
        )
        self.settings, self.space = settings, space
        self.mbs = self.exudyn.SystemContainer().AddSystem()
        self.ground = self.mbs.AddObject(self.items.ObjectGround())

    def beam(
        self,
        law: dict[str, float],
        length: float,
        start: Sequence[float],
        turn: float = 0.0,
        weight: bool = True,
    ) -> list[int]:
        """Nodes of a straight beam from a point, turned by an angle [deg]."""
        angle, count = np.radians(turn), self.settings.elements
        along = np.array([np.cos(angle), np.sin(angle), 0.0][: 3 if self.space else 2])
        node = self.items.NodePointSlope1 if self.space else self.items.NodePoint2DSlope1
        cable = self.items.ObjectANCFCable if self.space else self.items.ObjectANCFCable2D
        points = np.array(start) + length * np.linspace(0.0, 1.0, count + 1)[:, None] * along
        nodes = [self.mbs.AddNode(node(referenceCoordinates=[*point, *along])) for point in points]
        numbers = {
            "massPerLength": law["mass"],
            "axialStiffness": law["axial"],
            "bendingStiffness": law["bending"],
        }
        for pair in itertools.pairwise(nodes):
            more = {
                "useReducedOrderIntegration": int(self.settings.reduced),
                "length": length / count,
            }
            body = self.mbs.AddObject(cable(nodeNumbers=list(pair), **numbers, **more))
            if weight:
                marker = self.mbs.AddMarker(self.items.MarkerBodyMass(bodyNumber=body))
                pull = [0.0, 0.0, -WEIGHT] if self.space else [0.0, -WEIGHT, 0.0]
                self.mbs.AddLoad(
                    self.items.LoadMassProportional(markerNumber=marker, loadVector=pull)
                )
        return nodes

    def place(self, node: int) -> int:
        """A marker at a node."""
        return int(self.mbs.AddMarker(self.items.MarkerNodePosition(nodeNumber=node)))

    def fixed(self, point: Sequence[float]) -> int:
        """A marker at a point of the ground."""
        kind = self.items.MarkerBodyPosition
        return int(
            self.mbs.AddMarker(kind(bodyNumber=self.ground, localPosition=[*point, 0.0, 0.0][:3]))
        )

    def pin(self, one: int, other: int) -> None:
        """Two markers coincide."""
        joint = self.items.SphericalJoint if self.space else self.items.ObjectJointRevolute2D
        self.mbs.AddObject(joint(markerNumbers=[one, other]))

    def hold(self, node: int, coordinate: int) -> None:
        """A coordinate of a node stays as it is."""
        marker = self.mbs.AddMarker(
            self.items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate)
        )
        point = self.mbs.AddNode(self.items.NodePointGround())
        still = self.mbs.AddMarker(self.items.MarkerNodeCoordinate(nodeNumber=point, coordinate=0))
        self.mbs.AddObject(self.items.CoordinateConstraint(markerNumbers=[still, marker]))

    def turned(self, body: int) -> None:
        """The left end of an element is pinned, and turns by the driven angle, a compiled function."""
        utilities, symbolic = importlib.import_module("exudyn.utilities"), self.exudyn.symbolic
        base = self.mbs.AddMarker(self.items.MarkerBodyRigid(bodyNumber=self.ground))
        root = self.mbs.AddMarker(
            self.items.MarkerBodyRigid(bodyNumber=body, localPosition=[0, 0, 0])
        )
        joint = self.mbs.AddObject(
            self.items.GenericJoint(markerNumbers=[base, root], constrainedAxes=[1, 1, 0, 0, 0, 1])
        )

        def offset(mbs: Any, t: Any, item: Any, parameters: Any) -> Any:
            return symbolic.Vector([*(symbolic.Real(0) for _ in range(5)), drive(t, symbolic.sin)])

        compiled = utilities.CreateSymbolicUserFunction(
            self.mbs, offset, "offsetUserFunction", joint
        )
        self.mbs.SetObjectParameter(joint, "offsetUserFunction", compiled)

    def run(self, node: int, duration: float) -> tuple[float, np.ndarray | None]:
        """CPU seconds, and positions (s, c) of a node at the instants; None where it fails."""
        kind = self.exudyn.OutputVariableType.Position
        sensor = self.mbs.AddSensor(
            self.items.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind)
        )
        self.mbs.Assemble()
        asked = self.exudyn.SimulationSettings()
        steps = asked.timeIntegration
        steps.numberOfSteps, steps.endTime, steps.verboseMode = self.settings.steps, duration, 0
        steps.generalizedAlpha.spectralRadius = RHO
        steps.newton.useModifiedNewton, steps.newton.absoluteTolerance = (
            True,
            self.settings.tolerance,
        )
        asked.linearSolverType = getattr(self.exudyn.LinearSolverType, self.settings.solver)
        asked.solutionSettings.writeSolutionToFile = False
        asked.solutionSettings.sensorsWritePeriod = duration / INSTANTS
        asked.parallel.numberOfThreads = 1
        self.exudyn.SuppressWarnings(True)
        begin = time.process_time()
        try:
            self.mbs.SolveDynamic(asked, showHints=False)
        except (RuntimeError, ValueError):
            return time.process_time() - begin, None
        spent = time.process_time() - begin
        data = self.mbs.GetSensorStoredData(sensor)[:, 1 : 4 if self.space else 3]
        return spent, data if len(data) == INSTANTS + 1 and np.isfinite(data).all() else None


def double_pendulum(model: Beams) -> int:
    first = model.beam(ROUND, 1.0, (0.0, 0.0, 0.0))
    second = model.beam(ROUND, 1.0, (1.0, 0.0, 0.0), 90.0)
    model.pin(model.fixed((0, 0, 0)), model.place(first[0]))
    model.pin(model.place(first[-1]), model.place(second[0]))
    return second[-1]


def four_bar(model: Beams) -> int:
    first = model.mbs.systemData.NumberOfObjects()
    crank = model.beam(FLAT, 0.2, (0.0, 0.0))
    coupler = model.beam(FLAT, 0.5, (0.2, 0.0), FOUR_BAR)
    rocker = model.beam(FLAT, 0.4, (0.5, 0.0), 90.0)
    model.turned(first)
    model.pin(model.place(crank[-1]), model.place(coupler[0]))
    model.pin(model.place(coupler[-1]), model.place(rocker[-1]))
    model.pin(model.fixed((0.5, 0.0)), model.place(rocker[0]))
    return rocker[-1]


def spin_up(model: Beams) -> int:
    first = model.mbs.systemData.NumberOfObjects()
    nodes = model.beam(ROUND, 1.0, (0.0, 0.0), weight=False)
    model.turned(first)
    return nodes[-1]


def cantilever(model: Beams) -> int:
    nodes = model.beam(ROUND, 1.0, (0.0, 0.0), weight=False)
    for coordinate in (0, 1, 3):
        model.hold(nodes[0], coordinate)
    model.mbs.AddLoad(
        model.items.LoadForceVector(
            markerNumber=model.place(nodes[-1]), loadVector=[0.0, -0.5, 0.0]
        )
    )
    return nodes[-1]


def tip_mass(model: Beams) -> int:
    nodes = model.beam(ROUND, 1.0, (0.0, 0.0))
    model.pin(model.fixed((0, 0)), model.place(nodes[0]))
    bob = model.mbs.AddNode(model.items.NodePoint2D(referenceCoordinates=[1.0, 0.0]))
    mass = model.mbs.AddObject(model.items.MassPoint2D(physicsMass=0.3, nodeNumber=bob))
    marker = model.mbs.AddMarker(model.items.MarkerBodyMass(bodyNumber=mass))
    model.mbs.AddLoad(
        model.items.LoadMassProportional(markerNumber=marker, loadVector=[0.0, -WEIGHT, 0.0])
    )
    model.pin(model.place(nodes[-1]), model.place(bob))
    return nodes[-1]


def slider_crank(model: Beams) -> int:
    first = model.mbs.systemData.NumberOfObjects()
    crank = model.beam(FLAT, 0.15, (0.0, 0.0))
    rod = model.beam(FLAT, 0.5, (0.15, 0.0))
    model.turned(first)
    model.pin(model.place(crank[-1]), model.place(rod[0]))
    model.hold(rod[-1], 1)
    return rod[len(rod) // 2]  # the middle of an even number of elements


MODELS: dict[str, Callable[[Beams], int]] = {
    one.__name__: one
    for one in (double_pendulum, four_bar, spin_up, cantilever, tip_mass, slider_crank)
}


def exudyn_run(name: str, settings: Settings, duration: float) -> tuple[float, np.ndarray | None]:
    """CPU seconds and positions of a run of Exudyn."""
    model = Beams(settings, space=name == "double_pendulum")
    return model.run(MODELS[name](model), duration)


def apart(found: np.ndarray, reference: np.ndarray) -> float:
    """The largest error of a coordinate over its range, which counts with a hundredth of the
    largest one at least.
    """
    ranges = np.ptp(reference, axis=0)
    return float(
        (np.abs(found - reference).max(axis=0) / np.maximum(ranges, 1e-2 * ranges.max())).max()
    )


def trials(
    name: str, duration: float, reference: np.ndarray
) -> Iterator[tuple[Settings, float, float]]:
    """Settings, CPU seconds and true error of all runs of Exudyn that could be the best of some
    error.

    Integration, tolerance and solver are those of the least error, and of the least time for it, on
    one mesh; meshes and steps are all tried but for those that take longer than the best run of the
    smallest error so far.
    """
    ways = itertools.product((True, False), TOLERANCES, ("EXUdense", "EigenSparse"))
    probes = [Settings(*PROBE, *way) for way in ways]
    runs = [
        (one, spent, apart(found, reference))
        for one in probes
        for spent, found in [exudyn_run(name, one, duration)]
        if found is not None
    ]
    least = min(error for _, _, error in runs)
    way = min((run for run in runs if run[2] <= AS_GOOD * least), key=lambda run: run[1])[0]
    meshes = [one for one in MESHES[:-1] if name != "slider_crank" or one % 2 == 0]
    run = lambda elements, steps: exudyn_run(  # noqa: E731
        name, replace(way, elements=elements, steps=steps), duration
    )
    for elements, steps, spent, error in tried(meshes, run, reference):
        yield replace(way, elements=elements, steps=steps), spent, error


def tried(
    meshes: Sequence[int],
    run: Callable[[int, int], tuple[float, np.ndarray | None]],
    reference: np.ndarray,
) -> Iterator[tuple[int, int, float, float]]:
    """Meshes, steps, CPU seconds and true errors of all runs of a grid but for those that take
    longer than the best run of the smallest error so far.
    """
    soonest = np.inf
    for mesh in meshes:
        last = np.inf
        for steps in STEPS[:-1]:
            spent, found = run(mesh, steps)
            if found is None:
                continue
            error = apart(found, reference)
            yield mesh, steps, spent, error
            if error <= min(WANTED):
                soonest = min(soonest, spent)
            settled = steps >= 1600 and error > 0.9 * last  # more steps help no more on this mesh
            if error <= min(WANTED) or settled or spent > 1.5 * soonest:
                break
            last = error


def own_run(pilots: ScenePilots, cells: int, steps: int) -> tuple[float, np.ndarray | None]:
    """CPU seconds and positions (s, c) at the instants of a run of ours."""
    spent, found = timed(pilots, cells, steps)
    if found is None:
        return spent, None
    values = np.stack(list(found.columns.values()), axis=1)
    return spent, values[:: (len(found.times) - 1) // INSTANTS]


def cheapest(
    pilots: ScenePilots, runs: Sequence[tuple[int, int, float]], wanted: float
) -> tuple[float | None, tuple[int, int] | None]:
    """The cheapest of our runs that meet an error: CPU seconds, the best of three, with its cells
    and steps.
    """
    fewest: dict[int, int] = {}
    for cells, steps, error in runs:
        if error <= wanted:
            fewest.setdefault(cells, steps)
    times = {one: min(timed(pilots, *one)[0] for _ in range(3)) for one in fewest.items()}
    best = min(times, key=lambda one: times[one], default=None)
    return (None, None) if best is None else (times[best], best)


def measure(name: str, scene: Scene, repetitions: int) -> list[Row]:
    """Rows of one mechanism."""
    duration = scene.analysis.duration
    limit = exudyn_run(name, Settings(MESHES[-1], STEPS[-1], True, 1e-8, "EigenSparse"), duration)[
        1
    ]
    ours = ScenePilots(wanting(scene, min(WANTED)))
    own = own_run(ours, MESHES[-1], STEPS[-1])[1]
    if limit is None or own is None or apart(own, limit) > SAME:
        raise RuntimeError(
            f"{name}: the limits of both codes differ by {apart(own, limit):.1e} of the range, expected {SAME:g}"
        )
    print(
        f"{name}: the limits of both codes differ by {apart(own, limit):.1e} of the range",
        flush=True,
    )
    others_tried = list(trials(name, duration, limit))
    run = partial(own_run, ours)
    ours_tried = [(one, steps, error) for one, steps, _, error in tried(MESHES[:-1], run, own)]
    rows = []
    for wanted in WANTED:
        mine = wanting(scene, wanted)
        planned.find(mine)
        begin = time.process_time()
        plan = planned.find(mine)
        pilots_s, pilots = time.process_time() - begin, ScenePilots(mine)
        cells = plan.cells or 0
        hindsight = cheapest(pilots, ours_tried, wanted)
        best = min(
            (one for one in others_tried if one[2] <= wanted), key=lambda one: one[1], default=None
        )
        times: list[float] = []
        others: list[float] = []
        found = None
        for _ in range(1 + repetitions):
            spent, found = timed(pilots, cells, plan.steps)
            times.append(spent)
            if best is not None:
                others.append(exudyn_run(name, best[0], duration)[0])
        # nothing is promised of others, and they would take minutes
        reference = None if plan.why_not else pilots.run(4 * cells, 4 * plan.steps)
        error = (
            float(pilots.differ(found, reference)[0].max())
            if found is not None and reference is not None
            else np.nan
        )
        rest = (None, None, None) if best is None else (min(others[1:]), best[2] / wanted, best[0])
        rows.append(
            Row(
                name,
                wanted,
                min(times[1:]),
                error,
                cells,
                plan.steps,
                pilots_s,
                *hindsight,
                plan.why_not,
                *rest,
            )
        )
        print(rows[-1].words, flush=True)
    return rows


HEADS = (
    "mechanism",
    "error wanted",
    "cells x steps",
    "true error over wanted",
    "CPU [ms]",
    "its pilots [ms]",
)
HEADS = (
    *HEADS,
    "Exudyn: elements x steps, integration, tolerance, solver",
    "true error over wanted",
    "CPU [ms]",
    "ratio",
    "ours in hindsight: cells x steps",
    "CPU [ms]",
    "ratio",
)


def exudyn_version() -> str:
    return str(importlib.import_module("exudyn").__version__)


def page(rows: Sequence[Row]) -> str:
    """All rows as a table, below a sentence."""
    ratios = [row.ratio for row in rows if row.exudyn_s is not None and not row.why_not]
    text = f"Exudyn {exudyn_version()} takes {statistics.median(ratios):.1f} times as long as the run that an accuracy chooses, "
    text += f"in the median of the {len(ratios)} errors that both promise and meet, and {min(ratios):.1f} to {max(ratios):.1f} times. "
    with_pilots = [
        row.exudyn_s / (row.ours_s + row.pilots_s)
        for row in rows
        if row.exudyn_s is not None and not row.why_not
    ]
    best = [
        row.exudyn_s / row.hindsight_s
        for row in rows
        if row.exudyn_s and row.hindsight_s is not None
    ]
    text += f"In hindsight for both: {statistics.median(best):.1f} times. "
    text += f"With all pilots, which nobody has made for Exudyn's best settings, {statistics.median(with_pilots):.1f} times."
    lines = ["# CPU time to a true error, beside Exudyn's best mesh and step", "", text, ""]
    return "\n".join(
        [
            *lines,
            f"| {' | '.join(HEADS)} |",
            "|" + "---|" * len(HEADS),
            *(row.words for row in rows),
            "",
        ]
    )


def keep(path: Path, page: str, rows: Sequence[Any]) -> None:
    """Write PATH.md and .json, and print the first sentence."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.with_suffix(".md").write_text(page, encoding="utf-8")
    path.with_suffix(".json").write_text(
        json.dumps([asdict(row) for row in rows], indent=2) + "\n", encoding="utf-8"
    )
    print(page.splitlines()[2])


def main(repetitions: int = 5, names: Sequence[str] = ()) -> list[Row]:
    """Measure mechanisms by name, all without, and write time_to_error.md and .json into
    benchmarks/results.
    """
    rows: list[Row] = []
    with (
        tempfile.TemporaryDirectory() as folder,
        threadpool_limits(limits=1),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")
        for name, scene in written(
            {key: text for key, text in SCENES.items() if not names or key in names}, Path(folder)
        ):
            rows += measure(
                name, replace(scene, analysis=replace(scene.analysis, rho_inf=RHO)), repetitions
            )
    keep(RESULTS / "time_to_error", page(rows), rows)
    return rows


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5, sys.argv[2:])
