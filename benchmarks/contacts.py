"""What contact costs, and what reduction saves of it: a double pendulum with 50 points that may
touch a floor, and crossing beams.

    python benchmarks/contacts.py [cells]

Example 2 of Hou, Liu, Hu (doi 10.1016/j.cma.2019.112690), 100 and 200 cells a beam, 3000 steps of
5e-4 s, with 25 points on each beam above a floor with friction: 9 m below the hinge, where nothing
touches, and 1.2 m below it, where the lower beam lands and slides. The reduced model is trained on
that motion (component level, ECSW at quadrature points). All rows in one process with one BLAS
thread, the fastest of a few runs; CPU seconds. The difference is that of the free end C from the
full model, over its way. No step is divided here (`resolution: 0`): landing takes more iterations
and factorisations of as many steps.

The second table is examples/crossing_beams.yaml with other numbers of cells, 400 steps of 1 ms:
without contact, with the upper beam so high that it touches nothing, and as it is, where it lands
after a tenth of them and slides. CPU microseconds a step.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import dynamics, reduction, scenes, systems
from fmbs_skfem.contact.contacts import ContactPlane
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import assembly

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
CELLS = (10, 25, 50, 100)  #: of the crossing beams
SCHEME, DURATION, POINTS, REPEATS = dynamics.GeneralizedAlpha(5e-4, 0.8), 1.5, 25, 5
#: 1e-12 moves the full model by 2e-5 of its way
SHARP, FAR, NEAR = (
    dynamics.Newton(tolerance=1e-9),
    -9.0,
    -1.2,
)
BEAMS = (100, 200)  #: cells of one of the pendulum's
#: as few as a difference of 1 % allows; the lower beam lands
MODES, ETA = (
    {"I": 30, "II": 38},
    1e-2,
)


@dataclass(frozen=True)
class Row:
    """One model."""

    model: str
    unknowns: int
    cpu_s: float
    iterations: int
    factorisations: int
    difference: float  #: of C over its way, from the full model with the same floor


def pendulum(floor: float | None, cells: int | None) -> systems.System:
    """Example 2 above a floor at a height [m]."""
    scene = scenes.read(ROOT / "examples" / "double_pendulum.yaml")
    law = {"stiffness": 2e3, "friction": 0.2, "dissipation": 1.0, "resolution": 0.0}
    found = [
        ContactPlane(
            f"floor {name}",
            body=name,
            points=POINTS,
            point=(0.0, 0.0, floor),
            normal=(0.0, 0.0, 1.0),
            **law,
        )
        for name in scene.bodies
        if floor is not None
    ]
    loads = [*scene.loads.values(), *found]
    return assembly.assemble(
        build.parts(scene, cells), scene.joints.values(), loads, scene.damping, scene.outputs
    )


def end(motion: dynamics.Trajectory) -> np.ndarray:
    """Positions of C (s, c)."""
    found = dynamics.outputs(motion)
    return np.column_stack([found[f"C_{axis}"] for axis in "xyz"])


def timed(
    models: Mapping[str, systems.System], other: np.ndarray | None = None
) -> list[tuple[Row, dynamics.Trajectory]]:
    """The fastest of a few runs of every model, which take turns."""
    runs = [
        [dynamics.integrate(system, SCHEME, DURATION, SHARP) for system in models.values()]
        for _ in range(REPEATS)
    ]
    found = []
    for (name, system), of_one in zip(models.items(), zip(*runs, strict=True), strict=True):
        best = min(of_one, key=lambda run: run.statistics.cpu_s)
        cost, way = best.statistics, end(best)
        off = (
            0.0 if other is None else float(np.abs(way - other).max() / np.ptp(other, axis=0).max())
        )
        found.append(
            (Row(name, system.size, cost.cpu_s, cost.iterations, cost.factorisations, off), best)
        )
    return found


def main(*cells: int) -> list[Row]:
    """Run all with so many cells a beam, and write the tables."""
    with threadpool_limits(limits=1):
        found = {count: landing(count) for count in cells or BEAMS}
        beams = crossings()
    write(found, beams)
    return [row for rows in found.values() for row in rows]


def landing(cells: int) -> list[Row]:
    """The pendulum of beams of so many cells: without contact, far from the floor, landing, and
    reduced.
    """
    raw = pendulum(NEAR, cells)
    floors = {
        "full, without contact": pendulum(None, cells),
        "full, floor far below": pendulum(FAR, cells),
        "full, landing": raw,
    }
    found = timed({name: systems.eliminate(one) for name, one in floors.items()})
    full = found[-1][1]
    plan = reduction.Plan(reduction.body_level(raw), modes=MODES, hyper=reduction.Points(ETA))
    task = reduction.task_of(reduction.Case(raw, SCHEME, DURATION), plan, float(full.times[1]))
    model = reduction.train(task, motion=full).model.system
    return [row for row, _ in found + timed({"reduced, landing": model}, end(full))]


def crossing(cells: int, high: str | None) -> systems.System:
    """The crossing beams, the upper one at a height, or without contact."""
    text = (
        (ROOT / "examples" / "crossing_beams.yaml")
        .read_text(encoding="utf-8")
        .replace("30 mm", high or "30 mm")
    )
    scene = scenes.loads(text, ROOT / "examples")
    loads = [load for name, load in scene.loads.items() if name != "cross"]
    loads += [replace(scene.loads["cross"], resolution=0.0)] if high else []
    measured = {name: output for name, output in scene.outputs.items() if name != "cross"}
    parts = build.parts(scene, cells)
    return systems.eliminate(
        assembly.assemble(parts, scene.joints.values(), loads, scene.damping, measured)
    )


def crossings() -> list[list[float]]:
    """Cells a beam, unknowns, and the least CPU time a step [us] without contact, far from it, and
    in it.
    """
    rows, scheme = [], dynamics.GeneralizedAlpha(1e-3, 0.8)
    for cells in CELLS:
        models = [crossing(cells, high) for high in (None, "5 m", "30 mm")]
        runs = [
            [dynamics.integrate(system, scheme, 0.4, SHARP) for system in models]
            for _ in range(REPEATS)
        ]
        best = [
            min(run.statistics.cpu_s / run.statistics.steps for run in of_one)
            for of_one in zip(*runs, strict=True)
        ]
        rows.append([cells, models[0].size, *(1e6 * time for time in best)])
    return rows


def shown(value: str | float) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def write(found: Mapping[int, Sequence[Row]], beams: Sequence[Sequence[float]]) -> None:
    """The tables as Markdown."""
    lines = [f"# Contact of {2 * POINTS} points", ""]
    for cells, rows in found.items():
        first, far, near, reduced = rows
        more = [
            getattr(near, name) / getattr(first, name)
            for name in ("cpu_s", "iterations", "factorisations")
        ]
        lines += [
            f"{cells} cells a beam:",
            "",
            "| model | unknowns | CPU [s] | iterations | factorisations | difference |",
            "|---|---|---|---|---|---|",
            *(f"| {' | '.join(map(shown, astuple(row)))} |" for row in rows),
            "",
            f"Far away contact takes {far.cpu_s / first.cpu_s:.2f} times the time without it,",
            f"landing {more[0]:.2f} times, with {more[1]:.2f} times the iterations and {more[2]:.1f} times the factorisations;",
            f"reduced {near.cpu_s / reduced.cpu_s:.1f} times faster than in full.",
            "",
        ]
    lines += [
        "# Two crossing beams",
        "",
        "| cells a beam | unknowns | without contact [us a step] | far from it | touching |",
        "|---|---|---|---|---|",
        *("| " + " | ".join(f"{value:.0f}" for value in row) + " |" for row in beams),
        "",
    ]
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "contacts.md").write_text("\n".join(lines), encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main(*(int(count) for count in sys.argv[1:2]))
