"""True errors of scenes that ask for an accuracy, and what finding step and mesh costs.

    python benchmarks/accuracy.py [--accuracy 1e-2,1e-3] [--log] [NAMES]
    python benchmarks/accuracy.py --front NAMES

Thirty-odd mechanisms of beams, rigid bodies, stops, contact, tables and drives. Every one is planned for every accuracy, run so,
and held against a run of four times the cells of its finest plan and four times the steps. Costs are CPU seconds of one BLAS
thread within one process, pilots with their builds over the run that was chosen; a second plan is timed, so that nothing compiles.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import FmbsError
from fmbs_skfem.scenes.accuracy import Accuracy, Bound
from fmbs_skfem.scenes.schema import Scene
from fmbs_skfem.studies.planning import planned
from fmbs_skfem.studies.planning.pilots import ScenePilots

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
DOCS = ROOT / "docs"
MESH = ROOT / "meshes" / "beam_20.msh"  #: one metre along x, left to right
PLASTIC = "{young_modulus: 1 GPa, density: 1800 kg/m^3}"
STEEL = "{young_modulus: 210 GPa, density: 7850 kg/m^3}"
GRAVITY = "  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}"
IN_SPACE = "  weight: {type: gravity, acceleration: [0, 0, -9.81 m/s^2]}"


def beam(name: str, length: float = 1.0, x: float = 0.0, y: float = 0.0, turn: float = 0.0, **more: str) -> str:
    """A cable of a length [m] from (x, y), turned by an angle [deg]."""
    shape = {"section": "{shape: circular, diameter: 10 mm}", "material": PLASTIC} | more
    place = f"origin: [{x}, {y}], rotation: {turn} deg"
    return (
        f"  {name}: {{type: cable, mesh: {MESH.name}, unit: {length} m, {place}, "
        + ", ".join(f"{k}: {v}" for k, v in shape.items())
        + "}"
    )


def in_space(name: str, x: float = 0.0, y: float = 0.0, turn: float = 0.0, **more: str) -> str:
    """The same in space, in the plane of x and y."""
    return (
        beam(name, x=x, y=y, turn=turn, **more)
        .replace(f"[{x}, {y}]", f"[{x}, {y}, 0]")
        .replace(f"rotation: {turn} deg", f"rotation: {{axis: [0, 0, 1], angle: {turn} deg}}")
    )


def mechanism(
    duration: float, bodies: list[str], joints: list[str], loads: list[str], outputs: list[str], dim: int = 2, more: str = ""
) -> str:
    """The text of a scene."""
    parts = {"bodies": bodies, "joints": joints, "loads": loads, "outputs": outputs}
    text = "".join(f"{key}:\n" + "\n".join(lines) + "\n" for key, lines in parts.items() if lines)
    return f"schema: 1\ndimension: {dim}\n{text}{more}analysis: {{type: dynamic, duration: {duration} s, step: auto}}\n"


def pin(name: str, at: str, to: str = "ground") -> str:
    return f"  {name}: {{type: pin, at: {at}, to: {to}}}"


TIP = "  tip: {type: position, at: beam.right}"
HELD = "  O: {type: clamp, at: beam.left}"
PINNED = pin("O", "beam.left")
STRIP = {"section": "{shape: rectangular, width: 20 mm, height: 3 mm}"}
RUN_UP = "where(t < 0.5, 4 * t**2 * (1.5 - t), 1 + 3 * (t - 0.5))"

SCENES: dict[str, str] = {
    "cantilever_step": mechanism(
        1.0, [beam("beam")], [HELD], ["  f: {type: point_force, at: beam.right, force: [0, -0.5 N]}"], [TIP]
    ),
    "cantilever_ramp": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        ["  f: {type: point_force, at: beam.right, force: [0, -1 N], history: sin(pi * t / 1)**2}"],
        [TIP],
    ),
    "follower": mechanism(
        0.6, [beam("beam")], [HELD], ["  f: {type: follower, at: beam.right, force: [0, 0.4 N], history: sin(3 * t)}"], [TIP]
    ),
    "pendulum": mechanism(1.5, [beam("beam")], [PINNED], [GRAVITY], [TIP]),
    "stiff_pendulum": mechanism(1.5, [beam("beam", material=STEEL)], [PINNED], [GRAVITY], [TIP]),
    "rope_swing": mechanism(
        1.5,
        [beam("beam", section="{shape: circular, diameter: 3 mm}", turn=-30)],
        [PINNED],
        [GRAVITY],
        [TIP],
        more="damping: {mass: 0.5 1/s, stiffness: 0.2 ms}\n",
    ),
    "double_plane": mechanism(
        1.5,
        [beam("first"), beam("second", x=1.0)],
        [pin("O", "first.left"), pin("A", "first.right", "second.left")],
        [GRAVITY],
        ["  tip: {type: position, at: second.right}"],
    ),
    "double_reaction": mechanism(
        1.0,
        [beam("first"), beam("second", x=1.0)],
        [pin("O", "first.left"), pin("A", "first.right", "second.left")],
        [GRAVITY],
        ["  tip: {type: position, at: second.right}", "  O: {type: reaction, joint: O}"],
    ),
    "double_space": mechanism(
        1.5,
        [in_space("first"), in_space("second", x=1.0, turn=90)],
        ["  O: {type: spherical, at: first.left}", "  A: {type: spherical, at: first.right, to: second.left}"],
        [IN_SPACE],
        ["  tip: {type: position, at: second.right}"],
        3,
    ),
    "chain_of_three": mechanism(
        1.2,
        [beam("a"), beam("b", x=1.0), beam("c", x=2.0)],
        [pin("O", "a.left"), pin("A", "a.right", "b.left"), pin("B", "b.right", "c.left")],
        [GRAVITY],
        ["  tip: {type: position, at: c.right}"],
    ),
    "chain_of_five": mechanism(
        4.0,
        [beam(n, length=0.4, x=0.4 * k) for k, n in enumerate("abcde")],
        [pin("O", "a.left"), *(pin(p.upper(), f"{p}.right", f"{q}.left") for p, q in zip("abcd", "bcde", strict=True))],
        [GRAVITY],
        ["  tip: {type: position, at: e.right}"],
    ),
    "spin_up": mechanism(
        2.0,
        [beam("beam")],
        [PINNED, f'  drive: {{type: driven_angle, at: beam.left, angle: "{RUN_UP}"}}'],
        [],
        ["  deflection: {type: deflection, tip: beam.right, root: beam.left}"],
    ),
    "spin_position": mechanism(
        2.0, [beam("beam")], [PINNED, f'  drive: {{type: driven_angle, at: beam.left, angle: "{RUN_UP}"}}'], [], [TIP]
    ),
    "four_bar": mechanism(
        1.5,
        [
            beam("crank", 0.2, **STRIP),
            beam("coupler", 0.5, 0.2, turn=53.13010235415598, **STRIP),
            beam("rocker", 0.4, 0.5, turn=90, **STRIP),
        ],
        [
            pin("O", "crank.left"),
            pin("A", "crank.right", "coupler.left"),
            pin("C", "coupler.right", "rocker.right"),
            pin("D", "rocker.left"),
            '  motor: {type: driven_angle, at: crank.left, angle: "where(t < 0.5, 8 * t**2 * (1.5 - t), 2 + 6 * (t - 0.5))"}',
        ],
        [GRAVITY],
        ["  C: {type: position, at: coupler.right}"],
        more="damping: {stiffness: 1 ms}\n",
    ),
    "crank_slider": mechanism(
        1.0,
        [beam("crank", 0.15, **STRIP), beam("rod", 0.5, 0.15, **STRIP)],
        [
            pin("O", "crank.left"),
            pin("A", "crank.right", "rod.left"),
            "  S: {type: slider, at: rod.right, direction: [1, 0]}",
            "  motor: {type: driven_angle, at: crank.left, angle: 10 * t**2}",
        ],
        [],
        ["  middle: {type: position, at: {body: rod, s: 0.25 m}}", "  S: {type: position, at: rod.right}"],
    ),
    "sprung": mechanism(
        1.0,
        [beam("beam")],
        [PINNED],
        [GRAVITY, "  s: {type: spring_damper, at: beam.right, to: [1 m, 0.3 m], stiffness: 40 N/m, damping: 0.4 N s/m}"],
        [TIP],
    ),
    "with_a_mass": mechanism(
        1.5,
        [beam("beam"), "  bob: {type: point_mass, mass: 0.3 kg, position: [1 m, 0]}"],
        [PINNED, "  hook: {type: spherical, at: bob, to: beam.right}"],
        [GRAVITY],
        [TIP],
    ),
    "rigid_pendulum": mechanism(
        1.5,
        ["  rod: {type: rigid, mass: 1 kg, inertia: 0.08 kg m^2, center: [0.5 m, 0], points: {left: [0, 0], right: [1 m, 0]}}"],
        [pin("O", "rod.left")],
        [GRAVITY],
        ["  tip: {type: position, at: rod.right}"],
    ),
    "arm_regulated": mechanism(
        1.0,
        [beam("beam", **STRIP)],
        [PINNED],
        ["  m: {type: control_torque, at: beam.left, torque: -8 N m * (angle - 0.5) - 0.8 N m s * rate}"],
        [TIP],
    ),
    "arm_jump": mechanism(
        1.0,
        [beam("beam", **STRIP)],
        [PINNED],
        ["  m: {type: torsion_spring, at: beam.left, stiffness: 10 N m/rad, rest_angle: 1 rad, damping: 0.05 N m s/rad}"],
        [TIP],
    ),
    "stop": mechanism(
        1.0,
        [beam("beam")],
        [PINNED],
        [GRAVITY, "  s: {type: stop, at: beam.right, to: [1 m, -0.4 m], direction: [0, 1], stiffness: 1 kN/m}"],
        [TIP],
    ),
    "floor": mechanism(
        0.8,
        [beam("beam", y=0.3)],
        [],
        [GRAVITY, "  f: {type: contact_plane, body: beam, point: [0, 0], normal: [0, 1], stiffness: 5 kN/m, damping: 5 N s/m}"],
        [TIP],
    ),
    "rope_taut": mechanism(
        1.0,
        [beam("beam")],
        [PINNED],
        [GRAVITY, "  r: {type: rope, at: beam.right, to: [1 m, 0.5 m], stiffness: 1 kN/m, length: 0.7 m}"],
        [TIP],
    ),
    "switched_off": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        ['  f: {type: point_force, at: beam.right, force: [0, -0.5 N], history: "where(t < 0.3337, 1, 0)"}'],
        [TIP],
    ),
    "corners": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        ['  f: {type: point_force, at: beam.right, force: [0, -1 N], history: "max(0, 1 - abs(t / 0.3 - 1))"}'],
        [TIP],
    ),
    "corner_drive": mechanism(
        1.0,
        [beam("beam", **STRIP)],
        [PINNED, '  d: {type: driven_angle, at: beam.left, angle: "where(t < 0.4, 2 * t**2, 0.32 + 1.6 * (t - 0.4))"}'],
        [],
        [TIP],
    ),
    "motor": mechanism(
        1.5,
        [beam("beam", 0.5, **STRIP)],
        [PINNED],
        ["  m: {type: motor, at: beam.left, stall_torque: 0.3 N m, no_load_speed: 120 rpm}"],
        [TIP],
    ),
    "resting": mechanism(1.0, [beam("beam")], [HELD], ["  f: {type: point_force, at: beam.right, force: [0, 0 N]}"], [TIP]),
    "velocity": mechanism(1.0, [beam("beam")], [PINNED], [GRAVITY], ["  v: {type: velocity, at: beam.right}"]),
    "section": mechanism(1.0, [beam("beam")], [PINNED], [GRAVITY], ["  s: {type: section_forces, at: {body: beam, s: 0.5 m}}"]),
    "energy": mechanism(1.5, [beam("beam")], [PINNED], [GRAVITY], ["  e: {type: energy}"]),
    "free_flight": mechanism(
        1.0,
        [beam("beam")],
        [],
        [GRAVITY],
        [TIP],
        more="initial:\n  bodies:\n    beam: {velocity: [2 m/s, 5 m/s], angular_velocity: 8 rad/s}\n",
    ),
    "swing_fast": mechanism(
        1.0,
        [beam("beam", material=STEEL)],
        [PINNED],
        [],
        [TIP],
        more="initial:\n  bodies:\n    beam: {angular_velocity: 10 rad/s}\n",
    ),
    "quintic": mechanism(1.5, [beam("beam", degree="5", continuity="4")], [PINNED], [GRAVITY], [TIP]),
    "smooth_cubic": mechanism(1.5, [beam("beam", degree="3", continuity="2")], [PINNED], [GRAVITY], [TIP]),
}
EXAMPLES = (
    "spin_up",
    "double_pendulum",
    "four_bar",
    "hanging_mass",
    "crossing_beams",
    "heavy_top",
    "controlled_arm",
    "geared_arm",
    "sampled_arm",
    "trapeze",
)


def of_names(names: Sequence[str], folder: Path) -> Iterator[tuple[str, Scene]]:
    """Scenes by name."""
    (folder / MESH.name).write_bytes(MESH.read_bytes())
    for name, text in SCENES.items():
        if not names or name in names:
            path = folder / f"{name}.yaml"
            path.write_text(text)
            yield name, scenes.read(path)
    for name in EXAMPLES:
        if not names or f"example_{name}" in names:
            found = scenes.read(ROOT / "examples" / f"{name}.yaml")
            yield f"example_{name}", replace(found, reduction=None, compare=None)


def wanting(scene: Scene, accuracy: float) -> Scene:
    """The scene with an accuracy, and no step."""
    return replace(scene, analysis=replace(scene.analysis, step=np.inf, every=1, accuracy=Accuracy({"": Bound(accuracy)})))


def timed(pilots: ScenePilots, cells: int, steps: int) -> tuple[float, object]:
    begin = time.process_time()
    found = pilots.run(cells, steps)
    return time.process_time() - begin, found


@dataclass(frozen=True)
class Row:
    """One scene with one accuracy."""

    name: str
    accuracy: float
    cells: int | None
    steps: int
    true: float  #: error over what is wanted
    estimated: float  #: the same, foretold
    why_not: str
    trusted: float | None  #: time [s]
    pilots: int
    run_s: float  #: CPU of the run that was chosen
    plan_s: float  #: CPU of the plan, with all builds
    log: list[dict[str, Any]]

    @property
    def words(self) -> str:
        """The cells of its line of a table."""
        told = self.why_not + (f", trusted to {self.trusted:.3g} s" if self.trusted is not None else "")
        numbers = (
            f"{self.true:.2f} | {self.estimated:.2f} | {told} | {self.pilots} | {1e3 * self.run_s:.1f} | {1e3 * self.plan_s:.0f}"
        )
        return f"| {self.name} | {self.accuracy:g} | {self.cells or ''} | {self.steps} | {numbers} |"


def judged(name: str, scene: Scene, wanted: Sequence[float]) -> Iterator[Row]:
    """A row for every accuracy."""
    runs = []
    for accuracy in wanted:
        mine = wanting(scene, accuracy)
        planned.find(mine)
        begin = time.process_time()
        plan = planned.find(mine)
        spent, pilots = time.process_time() - begin, ScenePilots(mine)
        level = plan.cells or (1 if pilots.refined else 0)
        pilots.run(level, plan.steps)
        chosen, found = timed(pilots, level, plan.steps)
        runs.append((accuracy, plan, level, found, spent, chosen, pilots))
    for accuracy, plan, _, found, spent, chosen, pilots in runs:
        # of its own steps four times as many, so that all of its instants are compared
        reference = pilots.run(4 * max(run[2] for run in runs), 4 * plan.steps)
        error = pilots.differ(found, reference)[0].max() if reference is not None and found is not None else np.nan
        foretold = plan.of_step + (plan.of_mesh or 0.0)
        costs = len(plan.pilots), chosen, spent, plan.pilots
        yield Row(name, accuracy, plan.cells, plan.steps, float(error), foretold, plan.why_not, plan.trusted_until, *costs)


HEADS = ("scene", "accuracy", "cells", "steps", "true error over wanted", "foretold", "told", "pilots", "run [ms]", "plan [ms]")


def main(names: Sequence[str] = (), wanted: Sequence[float] = (1e-2, 1e-3), log: bool = False) -> list[Row]:
    """Rows of scenes by name, all without, and what they amount to."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(limits=1, user_api="blas"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, scene in of_names(names, Path(folder)):
            try:
                for row in judged(name, scene, wanted):
                    rows.append(row)
                    print(row.words, flush=True)
                    if log:
                        print("   ", [(one["cells"], one["steps"], one["difference"]) for one in row.log])
            except FmbsError as error:
                print(f"| {name} | {type(error).__name__}: {str(error)[:150]} |", flush=True)
    text = page(rows)
    print(text.splitlines()[2])
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "accuracy.md").write_text(text, encoding="utf-8")
    return rows


CELLS, STEPS = (2, 3, 4, 6, 8, 12, 16, 24), (200, 400, 800, 1600, 3200, 6400)  #: full models of a picture


def front(name: str, wanted: Sequence[float] = (1e-2, 1e-3, 1e-4), repeats: int = 3) -> Path:
    """A picture of full models with all cells and steps, and of what plans choose: CPU beside true error, parts of the ranges.

    The reference has 48 cells and four times the steps of the finest one. CPU seconds are the least of `repeats` calls of the
    integration and its outputs.
    """
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.2, 4.6), layout="constrained")
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(limits=1, user_api="blas"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        _, scene = next(of_names([name], Path(folder)))
        pilots = ScenePilots(wanting(scene, 1.0 - 1e-9))
        pilots.system(4)
        plans = [planned.find(wanting(scene, accuracy)) for accuracy in wanted]
        finest = max([*STEPS, *(plan.steps for plan in plans)])
        reference = pilots.run(48, 4 * finest)

        def point(cells: int, steps: int) -> tuple[float, float] | None:
            tries = [timed(pilots, cells, steps) for _ in range(repeats)]
            found = tries[0][1]
            return (
                None if found is None else (min(seconds for seconds, _ in tries), float(pilots.differ(found, reference)[0].max()))
            )

        for number, cells in enumerate(CELLS):
            known = [one for steps in STEPS if (one := point(cells, steps)) is not None]
            if known:
                axes.loglog(
                    *zip(*known, strict=True), "o-", ms=3, lw=0.8, color=plt.cm.viridis(number / len(CELLS)), label=f"{cells} cells"
                )
        for accuracy, plan in zip(wanted, plans, strict=True):
            if (one := point(plan.cells or 0, plan.steps)) is not None:
                axes.axhline(accuracy, color="0.8", lw=0.8, zorder=0)
                axes.loglog(
                    *one, "*", ms=13, color="#D55E00", zorder=5, label="chosen for an accuracy" if accuracy == wanted[0] else None
                )
                axes.annotate(
                    f"{accuracy:g}: {plan.cells} cells, {plan.steps} steps",
                    one,
                    xytext=(8, 6),
                    textcoords="offset points",
                    fontsize=8,
                )
    axes.set_xlabel("CPU of a run [s]")
    axes.set_ylabel("largest true error of an output, part of its range")
    axes.set_title(
        f"{name.removeprefix('example_')}: full models of 200 to 6400 steps, and those that accuracies choose", fontsize=10
    )
    axes.legend(fontsize=8, ncols=2, frameon=False)
    axes.grid(alpha=0.3)
    path = DOCS / f"accuracy_{name.removeprefix('example_')}.png"
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path


def page(rows: Sequence[Row]) -> str:
    """All rows as a table, below a sentence."""
    told = [row for row in rows if not row.why_not]
    met, worst = sum(row.true <= 1.0 for row in told), max((row.true for row in told), default=0.0)
    ratio = statistics.median(row.plan_s / row.run_s for row in told) if told else 0.0
    text = f"{len(rows)} plans, {len(told)} of which promise their accuracy: {met} keep it, the worst errs by {worst:.2f} of it. "
    text += f"A plan costs {ratio:.1f} times the run that it chooses, in the median."
    lines = ["# Accuracies that were asked for", "", text, "", f"| {' | '.join(HEADS)} |", "|" + "---|" * len(HEADS)]
    return "\n".join([*lines, *(row.words for row in rows)]) + "\n"


if __name__ == "__main__":
    asked = argparse.ArgumentParser()
    asked.add_argument("names", nargs="*")
    asked.add_argument("--accuracy", default="1e-2,1e-3")
    asked.add_argument("--log", action="store_true")
    asked.add_argument("--front", action="store_true", help="draw full models and plans of the scenes named")
    given = asked.parse_args()
    if given.front:
        print(*(front(name) for name in given.names), sep="\n")
        raise SystemExit
    main(given.names, [float(one) for one in given.accuracy.split(",")], given.log)
