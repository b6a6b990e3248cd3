"""What contact costs, and what reduction saves of it: a double pendulum with 50 points that may touch a floor.

    python benchmarks/contacts.py [cells]

Example 2 of Hou, Liu, Hu (doi 10.1016/j.cma.2019.112690), 100 cells a beam, 3000 steps of 5e-4 s, with 25 points on each beam above
a floor with friction: 9 m below the hinge, where nothing touches, and 1.2 m below it, where the lower beam lands and slides. The
reduced model is trained on that motion (component level, ECSW at quadrature points). All rows in one process with one BLAS thread,
the fastest of a few runs; CPU seconds. The difference is that of the free end C from the full model, over its way.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import dynamics, reduction, scenes, systems
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import assembly
from fmbs_skfem.systems.contacts import ContactPlane

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
SCHEME, DURATION, POINTS, REPEATS = dynamics.GeneralizedAlpha(5e-4, 0.8), 1.5, 25, 3
SHARP, FAR, NEAR = dynamics.Newton(tolerance=1e-12), -9.0, -1.2
EPS, ETA = 1e-10, 1e-4


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
        ContactPlane(f"floor {name}", body=name, points=POINTS, point=(0.0, 0.0, floor), normal=(0.0, 0.0, 1.0), **law)
        for name in scene.bodies
        if floor is not None
    ]
    loads = [*scene.loads.values(), *found]
    return assembly.assemble(build.parts(scene, cells), scene.joints.values(), loads, scene.damping, scene.outputs)


def end(motion: dynamics.Trajectory) -> np.ndarray:
    """Positions of C (s, c)."""
    found = dynamics.outputs(motion)
    return np.column_stack([found[f"C_{axis}"] for axis in "xyz"])


def timed(name: str, system: systems.System, other: np.ndarray | None = None) -> tuple[Row, dynamics.Trajectory]:
    """The fastest of a few runs."""
    runs = [dynamics.integrate(system, SCHEME, DURATION, SHARP) for _ in range(REPEATS)]
    best = min(runs, key=lambda run: run.statistics.cpu_s)
    cost, way = best.statistics, end(best)
    off = 0.0 if other is None else float(np.abs(way - other).max() / np.ptp(other, axis=0).max())
    return Row(name, system.size, cost.cpu_s, cost.iterations, cost.factorisations, off), best


def main(cells: int | None = None) -> list[Row]:
    """Run all, and write the table."""
    with threadpool_limits(limits=1):
        rows = [
            timed(name, systems.eliminate(pendulum(floor, cells)))[0]
            for name, floor in (("full, without contact", None), ("full, floor far below", FAR))
        ]
        raw = pendulum(NEAR, cells)
        row, full = timed("full, landing", systems.eliminate(raw))
        rows.append(row)
        plan = reduction.Plan(reduction.body_level(raw), EPS, hyper=reduction.Points(ETA))
        task = reduction.task_of(reduction.Case(raw, SCHEME, DURATION), plan, float(full.times[1]))
        model = reduction.train(task, motion=full).model.system
        rows.append(timed("reduced, landing", model, end(full))[0])
    write(rows)
    return rows


def shown(value: str | float) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def write(rows: Sequence[Row]) -> None:
    """The table as Markdown."""
    first, _, landing, reduced = rows
    lines = [
        f"# Contact of {2 * POINTS} points",
        "",
        "| model | unknowns | CPU [s] | iterations | factorisations | difference |",
        "|---|---|---|---|---|---|",
        *(f"| {' | '.join(map(shown, astuple(row)))} |" for row in rows),
        "",
        f"Far away contact takes {rows[1].cpu_s / first.cpu_s:.2f} times the time without it,",
        f"landing {landing.cpu_s / first.cpu_s:.2f} times;",
        f"reduced {landing.cpu_s / reduced.cpu_s:.1f} times faster than in full.",
        "",
    ]
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "contacts.md").write_text("\n".join(lines), encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main(*(int(count) for count in sys.argv[1:2]))
