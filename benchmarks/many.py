"""Reduced runs a second: members of one reduced structure in threads against one by one.

    python benchmarks/many.py [members]

Example 2 of Hou, Liu, Hu (doi 10.1016/j.cma.2019.112690): 100 cells a beam, component level with
eps = 1e-12, ECSW at quadrature points with eta = 1e-3, 6000 steps of 5e-4 s. Members differ in
Young's modulus (0.7 to 1.3 GPa) and gravity (8 to 12 m/s2), at random with a fixed seed. All rows
take the same members in one process with one BLAS thread, after a short run that compiles. CPU
seconds are those of the process with all its threads; wall seconds appear only if the machine was
idle at the start. The difference is that of the free end C from the runs one by one.
"""

from __future__ import annotations

import json
import os
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import dynamics, reduction, scenes, systems
from fmbs_skfem.dynamics.many import Result
from fmbs_skfem.scenes import build
from fmbs_skfem.systems.system import Elastic
from fmbs_skfem.systems.terms.points import Sampled

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
SCHEME, DURATION, EVERY = dynamics.GeneralizedAlpha(5e-4, 0.8), 3.0, 10
SHARP, GRAVITY = dynamics.Newton(tolerance=1e-12), 9.81
IDLE = 0.5  #: load average of a machine on which wall seconds mean something


@dataclass(frozen=True)
class Row:
    """One way to run the members."""

    way: str
    members: int
    cpu_s: float  #: a run
    wall_s: float | None  #: a run
    ratio: float  #: CPU time of one by one over this
    iterations: float  #: a run
    factorisations: float
    difference: float  #: of C [m]


def reduced() -> systems.System:
    """Example 2, reduced and hyper-reduced."""
    raw = build.system(scenes.read(ROOT / "examples" / "double_pendulum.yaml"))
    motion = dynamics.integrate(systems.eliminate(raw), SCHEME, DURATION, SHARP, EVERY)
    plan = reduction.Plan(reduction.body_level(raw), 1e-12, hyper=reduction.Points())
    task = reduction.task_of(reduction.Case(raw, SCHEME, DURATION), plan, float(motion.times[1]))
    return reduction.train(task, motion=motion).model.system


def stiffened(part: Elastic, factor: float) -> Elastic:
    """A body with another Young's modulus."""
    assert isinstance(part.gather, Sampled)
    section = part.gather.section.copy()
    section[:2] *= factor
    return replace(part, gather=replace(part.gather, section=section))


def members(system: systems.System, count: int) -> list[systems.System]:
    """The structure at random parameters."""
    rng = np.random.default_rng(1)
    found = []
    for stiffness, gravity in zip(
        rng.uniform(0.7, 1.3, count), rng.uniform(8.0, 12.0, count) / GRAVITY, strict=True
    ):
        elastic = tuple(stiffened(part, stiffness) for part in system.elastic)
        found.append(
            replace(
                system,
                elastic=elastic,
                loads=replace(system.loads, constant=gravity * system.loads.constant),
            )
        )
    return found


def one_by_one(
    chosen: list[systems.System], newton: dynamics.Newton, duration: float
) -> list[Result]:
    return [dynamics.integrate(system, SCHEME, duration, newton, EVERY) for system in chosen]


def ways() -> dict[str, Callable[[list[systems.System], dynamics.Newton, float], list[Result]]]:
    """How the members are run."""
    return {
        "one by one": one_by_one,
        "2 threads": lambda s, newton, T: dynamics.integrate_many(
            s, SCHEME, T, newton, EVERY, threads=2
        ),
    }


def end_of(result: Result) -> np.ndarray:
    """Positions of C (s, c)."""
    assert isinstance(result, dynamics.Trajectory)
    columns = dynamics.outputs(result)
    return np.stack([columns[f"C_{axis}"] for axis in "xyz"], axis=1)


def measured(chosen: list[systems.System], idle: bool) -> list[Row]:
    rows: list[Row] = []
    newton, base = dynamics.Newton(), 0.0
    reference: list[Result] = []
    for way, run in ways().items():
        run(chosen[:2], newton, 2 * EVERY * SCHEME.step)
        cpu, wall = time.process_time(), time.perf_counter()
        found = run(chosen, newton, DURATION)
        cpu, wall = (
            (time.process_time() - cpu) / len(chosen),
            (time.perf_counter() - wall) / len(chosen),
        )
        reference, base = reference or found, base or cpu
        apart = max(
            float(np.abs(end_of(a) - end_of(b)).max())
            for a, b in zip(found, reference, strict=False)
        )
        iterations, factorisations = (
            float(
                np.mean(
                    [
                        getattr(one.statistics, name)
                        for one in found
                        if isinstance(one, dynamics.Trajectory)
                    ]
                )
            )
            for name in ("iterations", "factorisations")
        )
        rows.append(
            Row(
                way,
                len(chosen),
                cpu,
                wall if idle else None,
                base / cpu,
                iterations,
                factorisations,
                apart,
            )
        )
    return rows


def page(rows: list[Row], load: float) -> str:
    """The figures as Markdown."""
    head = "way | members | CPU a run [ms] | wall a run [ms] | runs a CPU second | ratio | iterations | factorisations | C apart [m]"
    lines = [f"| {head} |", "|---|---:|---:|---:|---:|---:|---:|---:|---:|"]
    for r in rows:
        wall = "" if r.wall_s is None else f"{1e3 * r.wall_s:.1f}"
        figures = f"{1e3 * r.cpu_s:.1f} | {wall} | {1 / r.cpu_s:.1f} | {r.ratio:.2f} | {r.iterations:.0f} | {r.factorisations:.0f}"
        lines.append(f"| {r.way} | {r.members} | {figures} | {r.difference:.1e} |")
    title = "# Reduced runs of example 2 (6000 steps) in threads and one by one"
    note = f"Load average of the machine at the start: {load:.1f}" + (
        "." if load < IDLE else ": others were running, no wall times."
    )
    return "\n".join(
        [title, "", *lines, "", "Ratio: CPU time of one by one over that of the row. " + note, ""]
    )


def main(count: int = 64) -> list[Row]:
    """Measure, print the table, and write many.json and many.md into benchmarks/results."""
    load = os.getloadavg()[0]
    with threadpool_limits(limits=1):
        rows = measured(members(reduced(), count), load < IDLE)
    machine = {
        "processor": platform.machine(),
        "python": platform.python_version(),
        "cores": os.cpu_count(),
        "load": load,
    }
    RESULTS.mkdir(parents=True, exist_ok=True)
    report = {"machine": machine, "rows": [asdict(row) for row in rows]}
    (RESULTS / "many.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    (RESULTS / "many.md").write_text(page(rows, load), encoding="utf-8")
    print(page(rows, load))
    return rows


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:2]))
