"""What control costs: a step that is told an input beside one of `integrate`, and a controlled
flexible arm, reduced and full.

    python benchmarks/control.py

The first table is example 2 of Hou, Liu, Hu (doi 10.1016/j.cma.2019.112690), reduced at component
level with eps = 1e-12 and ECSW at points, 2000 steps of 5e-4 s: microseconds of CPU time a step,
the least of several runs that alternate. `run.step` is told the value of its input in every step.
The second one is examples/controlled_arm.yaml, a beam of 50 cells and more under PD control,
reduced as far as an error of 1e-3 allows: the largest distance of the tip from the full one over
the stroke.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fmbs_skfem import dynamics, reduction, scenes, systems
from fmbs_skfem.scenes import Scene, build
from fmbs_skfem.systems import System

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
STEPS, TIMES = 2000, 7  #: steps of the first table, and runs of which the fastest counts
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


def main() -> str:
    """Measure, and write control.md."""
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
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "control.md").write_text(text, encoding="utf-8")
    return text


if __name__ == "__main__":
    print(main())
