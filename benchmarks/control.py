"""What control costs: a step that is told an input beside one of `integrate`, and a controlled
flexible arm, reduced and full.

    python benchmarks/control.py [plants]

The first table is example 2 of Hou, Liu, Hu (doi 10.1016/j.cma.2019.112690), reduced at component
level with eps = 1e-12 and ECSW at points, 2000 steps of 5e-4 s: microseconds of CPU time a step,
the least of several runs that alternate. `run.step` is told the value of its input in every step.
The second one is examples/controlled_arm.yaml, a beam of 50 cells and more under PD control,
reduced as far as an error of 1e-3 allows: the largest distance of the tip from the full one over
the stroke. The last one, alone with `plants`, is examples/plant.yaml, reduced: plants of some 16
unknowns whose actions last for one step, of linear feedback or at random within their range. Steps
of all plants over wall time, which says something on an idle machine only, and microseconds of CPU
time a step; the best of several runs.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import dynamics, reduction, scenes, studies, systems
from fmbs_skfem.control.environments import Plant, Plants
from fmbs_skfem.reduction import Case, files
from fmbs_skfem.scenes import Scene, build
from fmbs_skfem.systems import System

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
STEPS, TIMES = 2000, 7  #: steps of the first table, and runs of which the fastest counts
PLANT_STEPS = 500  #: of every plant
CELLS, EPS = (50, 100, 200, 400), 1e-8  #: of the arm, and tolerance of its modes
PUSH = "inputs: {u: {unit: N}}\nloads:\n  push: {type: control_force, at: II.C, direction: [0, 0, 1], force: u}\n"


def reduced(
    scene: Scene, duration: float, cells: int | None = None, eps: float = 1e-12
) -> tuple[dynamics.Trajectory, System]:
    """The full motion of a scene, and the hyper-reduced system that is trained by it."""
    raw, scheme = build.system(scene, cells), build.dynamic(scene).scheme
    motion = dynamics.integrate(systems.eliminate(raw), scheme, duration)
    plan = reduction.Plan(reduction.body_level(raw), eps, hyper=reduction.Points())
    task = reduction.task_of(reduction.Case(raw, scheme, duration), plan, 10 * scheme.step)
    return motion, reduction.train(task, motion=motion).model.system


def least(ways: dict[str, Callable[[], object]]) -> dict[str, float]:
    """The least CPU time [s] of runs that alternate."""
    found = dict.fromkeys(ways, np.inf)
    for _ in range(TIMES):
        for name, way in ways.items():
            begin = time.process_time()
            way()
            found[name] = min(found[name], time.process_time() - begin)
    return found


def steps() -> dict[str, float]:
    """CPU time [s] of STEPS steps of the reduced double pendulum: by `integrate`, and told an input
    in every one.
    """
    text = (ROOT / "examples" / "double_pendulum.yaml").read_text(encoding="utf-8")
    scene = scenes.loads(text.replace("loads:\n", PUSH, 1), ROOT / "examples")
    scheme = build.dynamic(scene).scheme
    system = reduced(scene, STEPS * scheme.step)[1]
    values = [{"u": 0.0} for _ in range(STEPS)]  # other values would cost iterations

    run = dynamics.start(system, scheme)
    begin = run.state

    def stepped() -> None:
        run.state = begin
        for value in values:
            run.step(value)

    ways = {
        "integrate": lambda: dynamics.integrate(system, scheme, STEPS * scheme.step, every=STEPS),
        "run.step": stepped,
    }
    return least(ways)


def arm(cells: int) -> tuple[dict[str, float], float]:
    """CPU time [s] of the controlled arm in full and reduced, and the distance of the tips over the
    stroke.
    """
    scene = scenes.read(ROOT / "examples" / "controlled_arm.yaml")
    analysis = build.dynamic(scene)
    motion, small = reduced(scene, analysis.duration, cells, EPS)
    tips = [
        dynamics.outputs(one)
        for one in (motion, dynamics.integrate(small, analysis.scheme, analysis.duration))
    ]
    full, other = (np.stack([found["tip_x"], found["tip_y"]]) for found in tips)
    error = (
        np.linalg.norm(other - full, axis=0).max()
        / np.linalg.norm(full - full[:, :1], axis=0).max()
    )
    last = len(motion.times) - 1
    ways = {
        name: lambda one=one: dynamics.integrate(
            one, analysis.scheme, analysis.duration, every=last
        )
        for name, one in (("full", motion.system), ("reduced", small))
    }
    return least(ways), float(error)


def plants(case: Case, count: int, threads: int, random: bool) -> tuple[float, float]:
    """Steps of all plants a second of wall time, and CPU time of one [us]; the best of TIMES runs."""

    def make() -> Plant:
        reward = lambda outputs, inputs: -abs(outputs["tip"] - 0.1) - 0.01 * inputs["u"] ** 2  # noqa: E731
        return Plant(
            case.system, case.scheme, ["hinge", "tip"], reward, PLANT_STEPS * case.scheme.step
        )

    many, rng = Plants(make, count, threads), np.random.default_rng(1)
    gains, noise = (
        rng.uniform(0.1, 2.0, (count, 1)),
        rng.uniform(-1.0, 1.0, (PLANT_STEPS, count, 1)),
    )
    wall, cpu = np.inf, np.inf
    for _ in range(TIMES):
        seen, _ = many.reset()
        begin = time.perf_counter(), time.process_time()
        for actions in noise:
            seen, *_ = many.step(actions if random else gains * (0.1 - seen[:, :1]))
        wall = min(wall, (time.perf_counter() - begin[0]) / noise.size)
        cpu = min(cpu, (time.process_time() - begin[1]) / noise.size)
    many.close()
    return 1.0 / wall, 1e6 * cpu


def side_by_side() -> str:
    """The table of plants."""
    with tempfile.TemporaryDirectory() as name, threadpool_limits(limits=1):
        studies.reduce(ROOT / "examples" / "plant.yaml", out=Path(name) / "plant.h5")
        case, _ = files.case_of(files.read(Path(name) / "plant.h5"))
        rows = [
            f"| {count} | {threads} | {'random' if random else 'feedback'} | {steps:.0f} | {cpu:.1f} |"
            for random in (False, True)
            for count, threads in ((1, 1), (64, 1), (64, os.cpu_count() or 1))
            for steps, cpu in [plants(case, count, threads, random)]
        ]
    head = f"| plants of {case.system.size} unknowns | threads | actions | steps a second | CPU us a step |\n|---|---|---|---|---|\n"
    load = f"Load average at the start: {os.getloadavg()[0]:.1f}."
    return head + "\n".join(rows) + f"\n\n{load}\n"


def main(*only: str) -> str:
    """Measure, and write control.md; the table of plants alone is not written."""
    beside = side_by_side()
    if only:
        return beside
    told, arms = steps(), {cells: arm(cells) for cells in CELLS}
    rows = "\n".join(
        f"| {cells} | {1e3 * run['full']:.1f} | {1e3 * run['reduced']:.1f} | {run['full'] / run['reduced']:.1f} | {error:.2g} |"
        for cells, (run, error) in arms.items()
    )
    text = f"""# Control

| a step of the reduced double pendulum | us |
|---|---|
| `integrate` | {1e6 * told["integrate"] / STEPS:.1f} |
| `run.step` with an input | {1e6 * told["run.step"] / STEPS:.1f} |
| difference | {1e6 * (told["run.step"] - told["integrate"]) / STEPS:.1f} |

| cells of the PD-controlled arm | full, CPU ms | reduced and hyper-reduced | faster by | tip from the full one, over the stroke |
|---|---|---|---|---|
{rows}
"""
    text = f"{text}\n{beside}"
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "control.md").write_text(text, encoding="utf-8")
    return text


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
