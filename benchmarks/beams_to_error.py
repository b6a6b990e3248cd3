"""CPU time to a true error of frames of beams with torsion and shear: the cheapest mesh and step
here and of Exudyn.

    python benchmarks/beams_to_error.py [repetitions] [NAMES]

Full models of `type: beam` beside Exudyn's geometrically exact beam
(`ObjectBeamGeometricallyExact`, two nodes, on SE(3)), which is no dependency
(`pip install exudyn`). Both have the same stiffnesses and masses and converge to the same motion,
which is checked. Errors are the largest ones of a coordinate at 200 instants over its range, each
code against a run of its own: fine, and extrapolated in cells and steps to the limit, as errors
fall with the square of the step, and Exudyn's with that of its elements.

Both try all their meshes and steps, and what meets an error soonest counts. Before, settings are
chosen on one mesh, by the least time among those of the least error: here tolerances of Newton's
iteration; in Exudyn nodes with Euler parameters or with rotation vectors on the Lie group, a loose
and a tight tolerance, modified or full Newton, the dense or the sparse solver. CPU seconds of one
thread: the call of the integration, with its outputs; the codes alternate, and the best of the
repetitions counts.
"""

from __future__ import annotations

import importlib
import itertools
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits
from time_to_error import INSTANTS, SAME, WANTED, apart, drive, exudyn_version, keep

from fmbs_skfem import dynamics, systems
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.core.errors import SolverError
from fmbs_skfem.dynamics import outputs
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, joints, loads, probes

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
RHO = 0.9
CELLS = (3, 4, 5, 6, 8, 10, 12, 16)  #: ours a beam
ELEMENTS = (4, 8, 16, 32, 48, 64, 128)  #: Exudyn's
STEPS = tuple(INSTANTS * n for n in (1, 2, 3, 4, 6, 8, 12, 16))
OURS, THEIRS = (12, 3200), (32, 3200)  #: cells and steps of the references
NEWTON = (2e-12, 1e-8, 1e-6)  #: our tolerances
PROBE, AS_GOOD = 800, 1.1  #: steps by which settings are chosen, and errors that count as the least
EACH = 8  #: cells and elements then

Ends = tuple[tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True)
class Frame:
    """Beams from point to point, each welded to the end of the one before; its first end clamped,
    or on a driven hinge.
    """

    duration: float  #: [s]
    beams: tuple[Ends, ...]
    stiffness: tuple[float, ...]  #: EA, GA_y, GA_z [N], GJ, EI_y, EI_z [N m2]
    mass: tuple[float, float]  #: [kg/m] and [kg m], the inertia about each axis of the section
    axis: tuple[float, float, float] | None = None  #: of the driven hinge
    turns: float = 1.0  #: times `drive`
    push: float = 0.0  #: largest force along z at the end of the first beam, up in 1 s and down in another one [N]
    supported: bool = False  #: whether the end of the first beam may only slide along x


def round_bar(diameter: float, E: float, density: float) -> dict[str, tuple[float, ...]]:
    """Stiffness and mass of a round bar, without Poisson's ratio but for GA and GJ = E / 2.6 times
    area and polar moment.
    """
    A, I = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    return {
        "stiffness": (E * A, E / 2.6 * A, E / 2.6 * A, E / 1.3 * I, E * I, E * I),
        "mass": (density * A, density * I),
    }


SOFT, THIN = round_bar(0.01, 1e9, 1800.0), round_bar(0.005, 1e9, 1800.0)
FRAMES: dict[str, Frame] = {
    # Simo and Vu-Quoc, Comput. Methods Appl. Mech. Eng. 66 (1988) 125-161
    "elbow": Frame(
        10.0,
        (((0, 0, 0), (10, 0, 0)), ((10, 0, 0), (10, 10, 0))),
        (1e6, 1e6, 1e6, 1e3, 1e3, 1e3),
        (1.0, 10.0),
        push=50.0,
    ),
    "spun_frame": Frame(
        2.0,
        (((0, 0, 0), (0.4, 0, 0)), ((0.4, 0, 0), (0.4, 0.3, 0)), ((0.4, 0.3, 0), (0.4, 0.3, 0.3))),
        axis=(0.0, 0.0, 1.0),
        **SOFT,  # type: ignore[arg-type]
    ),
    "driven_shaft": Frame(
        1.0,
        (((0, 0, 0), (0.6, 0, 0)), ((0.6, 0, 0), (0.6, 0.3, 0))),
        axis=(1.0, 0.0, 0.0),
        turns=2.0,
        supported=True,
        **THIN,  # type: ignore[arg-type]
    ),
}


def hat(t: Any) -> Any:
    """The push over its largest value at a time [s]."""
    return np.interp(t, [0.0, 1.0, 2.0], [0.0, 1.0, 0.0])


def watched(frame: Frame) -> list[int]:
    """Numbers of the beams whose ends are compared: all but one that is supported."""
    return list(range(int(frame.supported), len(frame.beams)))


def across(start: Sequence[float], end: Sequence[float]) -> np.ndarray:
    """Axes of a section, one a row: along the beam, y, z."""
    along = np.subtract(end, start, dtype=float)
    along /= np.linalg.norm(along)
    y = np.cross([0.0, 0.0, 1.0] if abs(along[2]) < 0.5 else [1.0, 0.0, 0.0], along)
    return np.stack([along, y, np.cross(along, y)])


def ours(frame: Frame, cells: int) -> systems.System:
    """The frame here."""
    section, bodies = (
        BeamSection(
            np.diag(frame.stiffness), np.diag([frame.mass[0], frame.mass[1], frame.mass[1]])
        ),
        [],
    )
    for k, (start, end) in enumerate(frame.beams):
        length = float(np.linalg.norm(np.subtract(end, start)))
        curve = curves.Straight(np.array(start, dtype=float), np.array(end, dtype=float), length)
        line = curves.Line(
            np.linspace(0.0, length, cells + 1), curve, {"left": 0.0, "right": length}, None
        )
        bodies.append(beam(f"b{k}", line, section, direction=across(start, end)[1]))
    root, ends = At("b0", "left"), [At(f"b{k}", "right") for k in range(len(bodies))]
    held: list[joints.Joint] = [
        joints.Weld(f"w{k}", At(f"b{k}", "left"), ends[k - 1]) for k in range(1, len(bodies))
    ]
    if frame.axis is None:
        held.append(joints.Clamp("root", root))
    else:
        turn = lambda t: frame.turns * drive(t)  # noqa: E731
        held += [
            joints.Revolute("root", root, axis=frame.axis),
            joints.DrivenAngle("drive", root, turn, axis=frame.axis),
        ]
    if frame.supported:
        held.append(joints.Slider("bearing", ends[0], (1.0, 0.0, 0.0)))
    pushes = (
        [loads.PointForce("push", ends[0], (0.0, 0.0, frame.push), history=hat)]
        if frame.push
        else []
    )
    sensed = {f"end{k}": probes.Position(ends[k]) for k in watched(frame)}
    return systems.eliminate(systems.assemble(bodies, held, pushes, outputs=sensed))


def our_run(frame: Frame, cells: int, steps: int, newton: float) -> tuple[float, np.ndarray | None]:
    """CPU seconds, and positions (s, c) at the instants; None where it fails."""
    system = ours(frame, cells)
    begin = time.process_time()
    scheme = dynamics.GeneralizedAlpha(frame.duration / steps, RHO)
    try:
        motion = dynamics.integrate(
            system, scheme, frame.duration, dynamics.Newton(newton), every=steps // INSTANTS
        )
    except SolverError:
        return time.process_time() - begin, None
    columns = outputs(motion)
    return time.process_time() - begin, np.stack(
        [columns[f"end{k}_{c}"] for k in watched(frame) for c in "xyz"], axis=1
    )


@dataclass(frozen=True)
class Way:
    """How Exudyn runs."""

    node: str
    tolerance: float
    modified: bool
    solver: str


WAYS = [
    Way(*one)
    for one in itertools.product(
        ("EP", "RotVecLG"), (1e-3, 1e-6), (True, False), ("EigenSparse", "EXUdense")
    )
]


def exudyn_run(
    frame: Frame, elements: int, steps: int, way: Way
) -> tuple[float, np.ndarray | None]:
    """The same of Exudyn; None where it fails."""
    sys.exudynFast = True  # type: ignore[attr-defined]
    exudyn, items, utilities = (
        importlib.import_module(f"exudyn{name}") for name in ("", ".itemInterface", ".utilities")
    )
    mbs, symbolic = exudyn.SystemContainer().AddSystem(), exudyn.symbolic
    section = exudyn.BeamSection()
    section.stiffnessMatrix, section.massPerLength = np.diag(frame.stiffness), frame.mass[0]
    section.inertia = np.diag([2.0 * frame.mass[1], frame.mass[1], frame.mass[1]])
    node = getattr(items, f"NodeRigidBody{way.node}")
    kind = (
        utilities.RotationMatrix2EulerParameters
        if way.node == "EP"
        else utilities.RotationMatrix2RotationVector
    )

    def marker(number: int, turned: np.ndarray | None = None) -> Any:
        more = {} if turned is None else {"localHT": exudyn.HT(rotation=turned)}
        return mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=number, **more))

    ground = mbs.AddNode(items.NodePointGround())
    nodes: list[list[int]] = []
    for k, (start, end) in enumerate(frame.beams):
        turned = across(start, end).T
        points = np.linspace(start, end, elements + 1)
        own = [mbs.AddNode(node(referenceCoordinates=[*point, *kind(turned)])) for point in points]
        length = float(np.linalg.norm(points[1] - points[0]))
        for pair in itertools.pairwise(own):
            mbs.AddObject(
                items.ObjectBeamGeometricallyExact(
                    nodeNumbers=list(pair), length=length, sectionData=section
                )
            )
        if k > 0:
            before = across(*frame.beams[k - 1]).T
            mbs.AddObject(
                items.GenericJoint(
                    markerNumbers=[marker(nodes[-1][-1], before.T @ turned), marker(own[0])]
                )
            )
        nodes.append(own)
    rows = [marker(ground), marker(nodes[0][0], across(*frame.beams[0]))]
    root = mbs.AddObject(items.GenericJoint(markerNumbers=rows))
    if frame.axis is not None:
        place = 3 + int(np.argmax(frame.axis))

        def offset(mbs: Any, t: Any, item: Any, parameters: Any) -> Any:
            found = [symbolic.Real(0) for _ in range(6)]
            found[place] = frame.turns * drive(t, symbolic.sin)
            return symbolic.Vector(found)

        function = utilities.CreateSymbolicUserFunction(mbs, offset, "offsetUserFunction", root)
        mbs.SetObjectParameter(root, "offsetUserFunction", function)
    if frame.supported:
        # of the ground at the bearing: positions of the two markers agree but along x
        here = mbs.AddNode(items.NodePointGround(referenceCoordinates=list(frame.beams[0][1])))
        bearing = items.GenericJoint(
            markerNumbers=[marker(here), marker(nodes[0][-1])], constrainedAxes=[0, 1, 1, 0, 0, 0]
        )
        mbs.AddObject(bearing)
    if frame.push:
        place_of = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=nodes[0][-1]))
        load = mbs.AddLoad(items.LoadForceVector(markerNumber=place_of, loadVector=[0, 0, 0]))

        def force(mbs: Any, t: Any, vector: Any) -> Any:
            down = symbolic.IfThenElse(t < 2.0, frame.push * (2.0 - t), symbolic.Real(0))
            return symbolic.Vector(
                [
                    symbolic.Real(0),
                    symbolic.Real(0),
                    symbolic.IfThenElse(t < 1.0, frame.push * t, down),
                ]
            )

        function = utilities.CreateSymbolicUserFunction(mbs, force, "loadVectorUserFunction", load)
        mbs.SetLoadParameter(load, "loadVectorUserFunction", function)
    position = exudyn.OutputVariableType.Position
    sensors = [
        mbs.AddSensor(
            items.SensorNode(
                nodeNumber=nodes[k][-1], outputVariableType=position, storeInternal=True
            )
        )
        for k in watched(frame)
    ]
    mbs.Assemble()
    asked = exudyn.SimulationSettings()
    integration = asked.timeIntegration
    integration.numberOfSteps, integration.endTime, integration.verboseMode = (
        steps,
        frame.duration,
        0,
    )
    integration.generalizedAlpha.spectralRadius = RHO
    integration.newton.useModifiedNewton, integration.newton.absoluteTolerance = (
        way.modified,
        way.tolerance,
    )
    asked.linearSolver.solverType = getattr(exudyn.LinearSolverType, way.solver)
    asked.solution.file.write = False
    asked.solution.sensors.writePeriod = frame.duration / INSTANTS
    asked.parallel.numberOfThreads = 1
    exudyn.config.suppressWarnings = True
    begin = time.process_time()
    try:
        mbs.SolveDynamic(asked, showHints=False)
    except (RuntimeError, ValueError):
        return time.process_time() - begin, None
    spent = time.process_time() - begin
    found = np.hstack([mbs.GetSensorStoredData(sensor)[:, 1:4] for sensor in sensors])
    return spent, found if len(found) == INSTANTS + 1 and np.isfinite(found).all() else None


Runner = Callable[[int, int, Any], tuple[float, np.ndarray | None]]


def limit(run: Runner, mesh: int, steps: int, way: Any, in_mesh: bool) -> np.ndarray:
    """What a code converges to: its errors fall with the square of the step, and where said of the
    mesh.
    """
    fine, half = run(mesh, steps, way)[1], run(mesh, steps // 2, way)[1]
    if fine is None or half is None:
        raise RuntimeError(f"no reference with {mesh} cells and {steps} steps")
    found = fine + (fine - half) / 3.0
    if in_mesh:
        coarse = run(mesh // 2, steps // 2, way)[1]
        assert coarse is not None
        found = found + (half - coarse) / 3.0
    return found


def best_way(run: Runner, ways: Sequence[Any], reference: np.ndarray) -> Any:
    """Settings of the least time among those of the least error."""
    tried = [(way, *run(EACH, PROBE, way)) for way in ways]
    found = [(way, spent, apart(data, reference)) for way, spent, data in tried if data is not None]
    least = min(error for *_, error in found)
    return min((one for one in found if one[2] <= AS_GOOD * least), key=lambda one: one[1])[0]


def trials(
    run: Runner, meshes: Sequence[int], way: Any, reference: np.ndarray
) -> Iterator[tuple[int, int, float, float]]:
    """Mesh, steps, CPU seconds and error of all runs that may be the best of some error."""
    soonest = np.inf
    for mesh in meshes:
        last = np.inf
        for steps in STEPS:
            spent, found = run(mesh, steps, way)
            error = np.inf if found is None else apart(found, reference)
            yield mesh, steps, spent, error
            if error <= min(WANTED):
                soonest = min(soonest, spent)
            settled = error > 0.9 * last and error < 0.1  # more steps help no more on this mesh
            if error <= min(WANTED) or settled or spent > 1.5 * soonest:
                break
            last = error


@dataclass(frozen=True)
class Row:
    """One frame with one error: meshes, steps, CPU seconds and errors of both codes."""

    name: str
    wanted: float
    ours: tuple[int, int, float, float] | None
    theirs: tuple[int, int, float, float] | None
    our_way: float
    their_way: Way

    @property
    def ratio(self) -> float:
        """Exudyn's time over ours."""
        return np.nan if self.ours is None or self.theirs is None else self.theirs[2] / self.ours[2]

    @property
    def words(self) -> str:
        """The cells of its line of a table."""
        said = [
            "none | |"
            if one is None
            else f"{one[0]} x {one[1]} | {one[3]:.1e} | {1e3 * one[2]:.0f}"
            for one in (self.ours, self.theirs)
        ]
        way = self.their_way
        how = f"{way.node}, {way.tolerance:g}, {'modified' if way.modified else 'full'} Newton, {way.solver}"
        return (
            f"| {self.name} | {self.wanted:g} | {said[0]} | {said[1]} | {how} | {self.ratio:.1f} |"
        )


def measure(name: str, frame: Frame, repetitions: int) -> list[Row]:
    """Rows of one frame."""
    mine: Runner = lambda cells, steps, way: our_run(frame, cells, steps, way)  # noqa: E731
    other: Runner = lambda elements, steps, way: exudyn_run(frame, elements, steps, way)  # noqa: E731
    own = limit(mine, *OURS, NEWTON[0], False)
    reference = limit(other, *THEIRS, replace(WAYS[0], tolerance=1e-6), True)
    gap = apart(own, reference)
    print(f"{name}: the limits of both codes differ by {gap:.1e} of the range", flush=True)
    if gap > SAME:
        raise RuntimeError(
            f"{name}: the limits of both codes differ by {gap:.1e} of the range, expected {SAME:g}"
        )
    our_way, their_way = best_way(mine, NEWTON, own), best_way(other, WAYS, reference)
    tried = (
        list(trials(mine, CELLS, our_way, own)),
        list(trials(other, ELEMENTS, their_way, reference)),
    )
    rows = []
    for wanted in WANTED:
        found = [
            min((one for one in some if one[3] <= wanted), key=lambda one: one[2], default=None)
            for some in tried
        ]
        times: list[list[float]] = [[], []]
        for _ in range(repetitions):
            for k, (run, way) in enumerate(((mine, our_way), (other, their_way))):
                if (one := found[k]) is not None:
                    times[k].append(run(one[0], one[1], way)[0])
        best = [
            None if one is None else (one[0], one[1], min(spent), one[3])
            for one, spent in zip(found, times, strict=True)
        ]
        rows.append(Row(name, wanted, best[0], best[1], our_way, their_way))
        print(rows[-1].words, flush=True)
    return rows


HEADS = (
    "frame",
    "error wanted",
    "cells x steps",
    "error",
    "CPU [ms]",
    "Exudyn: elements x steps",
    "error",
    "CPU [ms]",
)
HEADS = (*HEADS, "node, tolerance, Newton, solver", "ratio")


def page(rows: Sequence[Row]) -> str:
    """All rows as a table, below a sentence."""
    ratios = [row.ratio for row in rows if np.isfinite(row.ratio)]
    text = f"Exudyn {exudyn_version()} takes {min(ratios):.1f} to {max(ratios):.1f} times as long where both reach an error."
    lines = [
        "# Frames of beams with torsion: CPU time to a true error, cheapest mesh and step of both codes",
        "",
        text,
        "",
    ]
    return "\n".join(
        [
            *lines,
            f"| {' | '.join(HEADS)} |",
            "|" + "---|" * len(HEADS),
            *(row.words for row in rows),
            "",
        ]
    )


def main(repetitions: int = 5, names: Sequence[str] = ()) -> list[Row]:
    """Measure frames by name, all without, and write beams_to_error.md and .json into
    benchmarks/results.
    """
    rows: list[Row] = []
    with threadpool_limits(limits=1), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, frame in FRAMES.items():
            if not names or name in names:
                rows += measure(name, frame, repetitions)
    keep(RESULTS / "beams_to_error", page(rows), rows)
    return rows


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5, sys.argv[2:])
