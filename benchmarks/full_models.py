"""Full models of both examples beside Exudyn: CPU and wall seconds of 6000 steps with one thread,
the error beside.

    python benchmarks/full_models.py [repetitions]

Runs alternate between the codes, and the best of several counts; building the models and the first,
compiling call are not timed. The largest error over the run is

    |w(t) - w_ref(t)|   deflection of the tip in the frame of the root's slope     (example 1)
    |C(t) - C_ref(t)|   position of the free end                                   (example 2)

against runs of our own with a step of h / 8 and Newton's tolerance 1e-12. Exudyn's cables measure
curvature by
|r' x r''| / |r'|^2, and so does the reference that they are compared with. Exudyn (the extra `benchmark`) has 100 ANCF cable
elements a beam, generalized-alpha with the same rho_inf, modified Newton and EigenSparse, at a
loose and a tight absolute tolerance; its driven angle is a compiled (symbolic) function. Without
Exudyn its rows are left out.

Model of both: Y. Hou, C. Liu, H. Hu, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import math
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import dynamics, scenes, systems
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.scenes import build

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
STEP, STEPS, FINER, RHO = 5e-4, 6000, 8, 0.8
TOLERANCES = {"loose": 1e-3, "tight": 1e-6}  #: absolute tolerances of Exudyn's Newton iteration
CELLS, LENGTH = 100, 1.0
#: [kg/m], [N], [N m2]
MASS, STIFFNESS, BENDING = (
    1800.0 * math.pi * 0.005**2,
    1e9 * math.pi * 0.005**2,
    1e9 * math.pi * 0.01**4 / 64,
)
SPIN_TIME, SPIN_RATE = 1.5, 2.0 * math.pi  #: [s], [rad/s]


@dataclass(frozen=True)
class Run:
    """Best seconds, and the history of the output (s, c): w [m], or C [m]."""

    cpu_s: float
    wall_s: float
    history: np.ndarray


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    example: str
    code: str
    cpu_s: float
    wall_s: float
    error: float
    ratio: float  #: CPU time over ours


def model(example: str, law: Law = Law.EXACT) -> systems.System:
    """The scene's system with its linear constraints eliminated, at a chosen measure of curvature."""
    system = systems.eliminate(build.system(scenes.read(ROOT / "examples" / f"{example}.yaml")))
    elastic = tuple(replace(part, gather=replace(part.gather, law=law)) for part in system.elastic)
    return replace(system, elastic=elastic)


def ours(
    example: str, law: Law = Law.EXACT, finer: int = 1, newton: dynamics.Newton | None = None
) -> Callable[[], Run]:
    """A run of the full model with the step h / finer, sampled every h."""
    system = model(example, law)

    def run() -> Run:
        scheme = dynamics.GeneralizedAlpha(STEP / finer, RHO)
        motion = dynamics.integrate(system, scheme, STEP * STEPS, newton, every=finer)
        columns = dynamics.outputs(motion)
        names = ["tip_deflection"] if example == "spin_up" else ["C_x", "C_y", "C_z"]
        history = np.stack([columns[name] for name in names], axis=1)
        return Run(motion.statistics.cpu_s, motion.statistics.wall_s, history)

    return run


def spin(t: Any, cosine: Callable[[Any], Any]) -> Any:
    """Driven angle of example 1 during the spin-up [rad]."""
    return (
        SPIN_RATE
        / SPIN_TIME
        * (
            t * t / 2.0
            + (SPIN_TIME / (2.0 * math.pi)) ** 2 * (cosine(2.0 * math.pi / SPIN_TIME * t) - 1.0)
        )
    )


def angle(t: np.ndarray) -> np.ndarray:
    """Driven angle of example 1 [rad]."""
    return np.where(t > SPIN_TIME, SPIN_RATE * (t - SPIN_TIME / 2.0), spin(t, np.cos))


def untyped(name: str) -> Any:
    """A module of the optional Exudyn, whose stubs do not fit its own examples."""
    return importlib.import_module(name)


def exudyn_settings(tolerance: float) -> Any:
    exudyn = untyped("exudyn")

    settings = exudyn.SimulationSettings()
    integration = settings.timeIntegration
    integration.numberOfSteps, integration.endTime = STEPS, STEP * STEPS
    integration.generalizedAlpha.spectralRadius = RHO
    integration.newton.useModifiedNewton = True
    integration.newton.absoluteTolerance = tolerance
    integration.verboseMode = 0
    settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = STEP
    settings.parallel.numberOfThreads = 1
    return settings


def exudyn_spin_up(mbs: Any) -> int:
    """Example 1 in Exudyn; the sensor of the tip."""
    exudyn, items, utilities = (
        untyped(name) for name in ("exudyn", "exudyn.itemInterface", "exudyn.utilities")
    )

    nodes = [
        mbs.AddNode(items.NodePoint2DSlope1(referenceCoordinates=[LENGTH * k / CELLS, 0, 1, 0]))
        for k in range(CELLS + 1)
    ]
    law = {
        "length": LENGTH / CELLS,
        "massPerLength": MASS,
        "axialStiffness": STIFFNESS,
        "bendingStiffness": BENDING,
    }
    cables = [
        mbs.AddObject(items.ObjectANCFCable2D(nodeNumbers=nodes[k : k + 2], **law))
        for k in range(CELLS)
    ]
    ground = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=mbs.AddObject(items.ObjectGround())))
    root = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=cables[0], localPosition=[0, 0, 0]))

    joint = mbs.AddObject(
        items.GenericJoint(markerNumbers=[ground, root], constrainedAxes=[1, 1, 0, 0, 0, 1])
    )
    symbolic = exudyn.symbolic

    def turned(mbs: Any, t: Any, item: Any, parameters: Any) -> Any:
        rising = spin(t, symbolic.cos)
        none = [symbolic.Real(0) for _ in range(5)]
        return symbolic.Vector(
            [*none, symbolic.IfThenElse(t > SPIN_TIME, SPIN_RATE * (t - SPIN_TIME / 2.0), rising)]
        )

    compiled = utilities.CreateSymbolicUserFunction(mbs, turned, "offsetUserFunction", joint)
    mbs.SetObjectParameter(joint, "offsetUserFunction", compiled)
    return position_sensor(mbs, nodes[-1], exudyn.OutputVariableType.Position)


def exudyn_double_pendulum(mbs: Any) -> int:
    """Example 2 in Exudyn; the sensor of C."""
    exudyn, items = untyped("exudyn"), untyped("exudyn.itemInterface")

    law = {
        "length": LENGTH / CELLS,
        "massPerLength": MASS,
        "axialStiffness": STIFFNESS,
        "bendingStiffness": BENDING,
    }
    ends = []
    for start, direction in (
        ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ):
        points = np.array(start) + LENGTH * np.linspace(0.0, 1.0, CELLS + 1)[:, None] * np.array(
            direction
        )
        nodes = [
            mbs.AddNode(items.NodePointSlope1(referenceCoordinates=[*point, *direction]))
            for point in points
        ]
        for k in range(CELLS):
            cable = mbs.AddObject(items.ObjectANCFCable(nodeNumbers=nodes[k : k + 2], **law))
            weight = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=cable))
            mbs.AddLoad(items.LoadMassProportional(markerNumber=weight, loadVector=[0, 0, -9.81]))
        ends.append(
            [
                mbs.AddMarker(items.MarkerNodePosition(nodeNumber=node))
                for node in (nodes[0], nodes[-1])
            ]
        )
    ground = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=mbs.AddObject(items.ObjectGround())))
    for pair in ([ground, ends[0][0]], [ends[0][1], ends[1][0]]):
        mbs.AddObject(items.SphericalJoint(markerNumbers=pair))
    return position_sensor(mbs, nodes[-1], exudyn.OutputVariableType.Position)


def position_sensor(mbs: Any, node: int, kind: Any) -> int:
    items = untyped("exudyn.itemInterface")

    sensor: int = mbs.AddSensor(
        items.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind)
    )
    return sensor


def exudyn_run(example: str, tolerance: float) -> Callable[[], Run]:
    """A run of Exudyn's model; the deflection follows the prescribed angle of the root."""
    exudyn = untyped("exudyn")

    def run() -> Run:
        container = exudyn.SystemContainer()
        mbs = container.AddSystem()
        sensor = exudyn_spin_up(mbs) if example == "spin_up" else exudyn_double_pendulum(mbs)
        mbs.Assemble()
        settings = exudyn_settings(tolerance)
        cpu, wall = time.process_time(), time.perf_counter()
        mbs.SolveDynamic(settings)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        data = mbs.GetSensorStoredData(sensor)
        if example != "spin_up":
            return Run(cpu, wall, data[:, 1:4])
        turn = angle(data[:, 0])
        return Run(cpu, wall, (np.cos(turn) * data[:, 2] - np.sin(turn) * data[:, 1])[:, None])

    return run


def best(runs: dict[str, Callable[[], Run]], repetitions: int) -> dict[str, Run]:
    """The best of alternating repetitions."""
    found: dict[str, Run] = {}
    for _ in range(repetitions):
        for name, run in runs.items():
            now = run()
            old = found.get(name, now)
            found[name] = Run(min(now.cpu_s, old.cpu_s), min(now.wall_s, old.wall_s), now.history)
    return found


def measure(example: str, repetitions: int) -> tuple[list[Row], dict[str, float]]:
    """Rows of one example, and its key numbers."""
    fine = dynamics.Newton(tolerance=1e-12)
    exact = ours(example, finer=FINER, newton=fine)().history
    runs = {"fmbs_skfem": ours(example)}
    references = {"fmbs_skfem": exact}
    if importlib.util.find_spec("exudyn"):
        same = ours(example, Law.MATERIAL, FINER, fine)().history
        for name, tolerance in TOLERANCES.items():
            label = f"Exudyn {version('exudyn')}, {name} ({tolerance:.0e})"
            runs[label], references[label] = exudyn_run(example, tolerance), same
    found = best(runs, repetitions)
    base = found["fmbs_skfem"]
    rows = []
    for name, run in found.items():
        error = float(np.linalg.norm(run.history - references[name], axis=1).max())
        rows.append(Row(example, name, run.cpu_s, run.wall_s, error, run.cpu_s / base.cpu_s))
    if example != "spin_up":
        return rows, {}
    w = base.history[:, 0]
    at = round(0.83 / STEP)
    return rows, {
        "deflection at 0.83 s": float(w[at]),
        "smallest deflection": float(w.min()),
        "smallest, h / 8": float(exact.min()),
    }


def page(rows: list[Row], numbers: dict[str, float]) -> str:
    """The figures as Markdown."""
    lines = [
        "| example | code | CPU [s] | wall [s] | largest error [m] | CPU time over ours |",
        "|---|---|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {r.example} | {r.code} | {r.cpu_s:.3f} | {r.wall_s:.3f} | {r.error:.2e} | {r.ratio:.2f} |"
        for r in rows
    ]
    listed = "; ".join(f"{name} {value:.7f} m" for name, value in numbers.items())
    title = "# Full models of 100 elements a beam: 6000 steps of 5e-4 s, one thread"
    return "\n".join([title, "", *lines, "", f"Example 1: {listed}.", ""])


def main(repetitions: int = 3) -> list[Row]:
    """Measure both examples, print the table, and write full_models.json and full_models.md into
    benchmarks/results.
    """
    rows: list[Row] = []
    numbers: dict[str, float] = {}
    with threadpool_limits(limits=1):
        for example in ("spin_up", "double_pendulum"):
            more, found = measure(example, repetitions)
            rows += more
            numbers |= found
    text = page(rows, numbers)
    machine = {
        "processor": platform.machine(),
        "python": platform.python_version(),
        "repetitions": repetitions,
    }
    RESULTS.mkdir(parents=True, exist_ok=True)
    report = {"machine": machine, "rows": [asdict(row) for row in rows], "numbers": numbers}
    (RESULTS / "full_models.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    (RESULTS / "full_models.md").write_text(text, encoding="utf-8")
    print(text)
    return rows


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:2]))
