"""Wishes for an accuracy and what is promised for them: whether it is kept, and in how many columns
`+-` holds.

    python benchmarks/promises.py [--accuracy 1e-2,1e-3] [--part 1/4] [NAMES or SCENE.yaml]

Motions that are let go, struck, driven, of steps that are given, and equilibria of cables, beams
and joints. Every wish is planned and run as `fmbs run --accuracy` does it, and held, at the ends of
all its steps, against a run of four times its cells and of four times the steps of all its pilots;
an equilibrium against one of four times the cells. `excess` is the largest true error of a column
over its `+-`, of columns of which something is wanted; errors below ROUND of the range of a column
are round-off. Costs are CPU seconds of plans with all their builds.
"""

from __future__ import annotations

import argparse
import itertools
import math
import tempfile
import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from mechanisms import (
    CRANK_SLIDER,
    GRAVITY,
    HELD,
    IN_SPACE,
    PINNED,
    SCENES,
    STRIP,
    TIP,
    beam,
    block,
    in_space,
    mechanism,
    pin,
    written,
)
from threadpoolctl import threadpool_limits

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import FmbsError
from fmbs_skfem.dynamics import output_errors
from fmbs_skfem.scenes.accuracy import Accuracy, Bound
from fmbs_skfem.scenes.schema import Scene
from fmbs_skfem.studies.planning import planned
from fmbs_skfem.studies.planning.pilots import PilotOutputs, ScenePilots, until

ROUND = 1e-6  #: of the range of a column, below which true errors are not judged
RESULTS = Path(__file__).resolve().parents[1] / "benchmarks" / "results"
ROOT_FORCES = "  M: {type: section_forces, at: beam.left}"
DAMPED = "damping: {stiffness: 3 ms}\n"
ROD = "{shape: circular, diameter: 10 mm}"


def rod(name: str, length: float, x: float, y: float, turn: float = 0.0) -> str:
    """A beam with torsion of a length [m] in the plane of x and y."""
    return (
        in_space(
            name,
            x,
            y,
            turn,
            material="{young_modulus: 1 GPa, poisson_ratio: 0.3, density: 1800 kg/m^3}",
        )
        .replace("type: cable", "type: beam")
        .replace("unit: 1.0 m", f"unit: {length} m")
    )


def at_rest(text: str) -> str:
    """The equilibrium of a mechanism."""
    return text[: text.index("analysis:")] + "analysis: {type: static}\n"


def starting_loaded(text: str) -> str:
    return text.replace("step: auto", "step: auto, start: equilibrium")


def stepping(text: str, step: str) -> str:
    """A mechanism with a step that is given."""
    return text.replace("step: auto", f"step: {step}")


def force(at: str, components: str, history: str = "") -> str:
    return f"  f: {{type: point_force, at: {at}, force: [{components}]" + (
        f', history: "{history}"}}' if history else "}"
    )


MOTIONS = {
    "released": starting_loaded(
        mechanism(
            0.6,
            [beam("beam")],
            [HELD],
            [GRAVITY, force("beam.right", "0, 1 N", "where(t < 0.2, 1, 0)")],
            [TIP, ROOT_FORCES],
            more=DAMPED,
        )
    ),
    "released_between": starting_loaded(
        mechanism(
            0.6,
            [beam("beam")],
            [HELD],
            [force("beam.right", "0, 0.7 N", "where(t < 0.17371, 1, 0)")],
            [TIP, ROOT_FORCES],
            more=DAMPED,
        )
    ),
    "stepped": mechanism(
        0.5,
        [beam("beam")],
        [HELD],
        [force("beam.right", "0, -0.5 N")],
        [TIP, ROOT_FORCES],
        more=DAMPED,
    ),
    "stairs": mechanism(
        0.8,
        [beam("beam")],
        [HELD],
        [force("beam.right", "0, -0.2 N", "floor(5 * t)")],
        [TIP, "  O: {type: reaction, joint: O}"],
        more=DAMPED,
    ),
    "kicked_arm": mechanism(
        0.5,
        [beam("beam", **STRIP)],
        [PINNED],
        [
            '  m: {type: torque, at: beam.left, torque: 20 mN m, history: "where(t < 0.1, 1, where(t < 0.2, -1, 0))"}'
        ],
        [TIP, "  a: {type: angle, at: beam.left}"],
        more=DAMPED,
    ),
    "driven_by_a_corner": mechanism(
        0.8,
        [beam("beam", **STRIP)],
        [
            PINNED,
            '  d: {type: driven_angle, at: beam.left, angle: "where(t < 0.4, 2 * t**2, 0.32 + 1.6 * (t - 0.4))"}',
        ],
        [],
        [TIP, "  d: {type: reaction, joint: d}"],
        more=DAMPED,
    ),
    "two_links": mechanism(
        1.0,
        [beam("first", 0.5), beam("second", 0.5, x=0.5)],
        [pin("O", "first.left"), pin("A", "first.right", "second.left")],
        [GRAVITY],
        ["  tip: {type: position, at: second.right}", "  O: {type: reaction, joint: O}"],
        more=DAMPED,
    ),
    "twisted": mechanism(
        0.4,
        [rod("a", 0.5, 0.0, 0.0), rod("b", 0.3, 0.5, 0.0, 90)],
        ["  C: {type: clamp, at: a.left}", "  W: {type: weld, at: b.left, to: a.right}"],
        [force("b.right", "0, 0, -0.5 N", "where(t < 0.15, sin(pi * t / 0.15)**2, 0)")],
        ["  tip: {type: position, at: b.right}", "  s: {type: section_forces, at: a.left}"],
        3,
        more="damping: {stiffness: 2 ms}\n",
    ),
    "struck_cable": mechanism(
        0.5,
        [
            in_space(
                "beam",
                section="{shape: circular, diameter: 6 mm}",
                material="{young_modulus: 0.5 GPa, density: 1150 kg/m^3}",
            )
        ],
        ["  l: {type: spherical, at: beam.left}", "  r: {type: spherical, at: beam.right}"],
        [
            IN_SPACE,
            force(
                "{body: beam, s: 0.5 m}", "0, 5 N, 0", "where(t < 0.02, sin(pi * t / 0.02)**2, 0)"
            ),
        ],
        ["  m: {type: position, at: {body: beam, s: 0.5 m}}"],
        3,
        more="damping: {mass: 0.5 1/s, stiffness: 0.5 ms}\n",
    ),
    "weight_on_a_wire": mechanism(
        1.0,
        [
            beam("beam", section="{shape: circular, diameter: 3 mm}"),
            "  bob: {type: point_mass, mass: 0.2 kg, position: [1 m, 0]}",
        ],
        [PINNED, "  hook: {type: spherical, at: bob, to: beam.right}"],
        [GRAVITY],
        ["  bob: {type: position, at: bob}", "  e: {type: energy}"],
        more="damping: {stiffness: 0.2 ms}\n",
    ),
    "slider_crank": mechanism(0.6, *CRANK_SLIDER, more="damping: {stiffness: 1 ms}\n"),
    "hub": mechanism(
        0.6,
        [block("hub", 0, 0, "", 1, 0.02), beam("arm", **STRIP)],
        [pin("O", "hub.center"), "  A: {type: weld, at: arm.left, to: hub.frame}"],
        [
            '  drive: {type: control_torque, at: hub.frame, torque: "5 N m * (0.4 - angle) - 0.5 N m s * rate"}'
        ],
        ["  a: {type: angle, at: hub.frame}", "  tip: {type: position, at: arm.right}"],
        more=DAMPED,
    ),
    "given_step": stepping(
        mechanism(0.6, [beam("beam")], [PINNED], [GRAVITY], [TIP], more=DAMPED), "0.5 ms"
    ),
    "given_uneven_step": stepping(
        mechanism(
            0.5,
            [beam("beam")],
            [HELD],
            [force("beam.right", "0, -0.5 N", "sin(3 * pi * t)**2")],
            [TIP, ROOT_FORCES],
            more=DAMPED,
        ),
        "0.3 ms",
    ),
}
EQUILIBRIA = {
    "bent": mechanism(1, [beam("beam")], [HELD], [force("beam.right", "0, -2 N")], [TIP]),
    "bent_moments": mechanism(
        1,
        [beam("beam")],
        [HELD],
        [force("beam.right", "0.5 N, -1 N")],
        [TIP, "  s: {type: section_forces, at: {body: beam, s: 0.3 m}}"],
    ),
    "elbow": mechanism(
        1,
        [rod("a", 0.5, 0.0, 0.0), rod("b", 0.4, 0.5, 0.0, 90)],
        ["  C: {type: clamp, at: a.left}", "  W: {type: weld, at: b.left, to: a.right}"],
        [force("b.right", "0, 0, -1 N")],
        [
            "  tip: {type: position, at: b.right}",
            "  s: {type: section_forces, at: {body: a, s: 0.2 m}}",
        ],
        3,
    ),
    "portal": mechanism(
        1,
        [beam("l", 0.5, turn=90), beam("t", 0.6, 0.0, 0.5), beam("r", 0.5, 0.6, 0.0, 90)],
        [
            "  L: {type: clamp, at: l.left}",
            "  R: {type: clamp, at: r.left}",
            "  A: {type: weld, at: t.left, to: l.right}",
            "  B: {type: weld, at: t.right, to: r.right}",
        ],
        [GRAVITY, force("l.right", "3 N, 0")],
        ["  corner: {type: position, at: l.right}", "  R: {type: reaction, joint: R}"],
    ),
    "hanging": mechanism(
        1,
        [beam("beam", section="{shape: circular, diameter: 3 mm}")],
        [PINNED, pin("P", "beam.right")],
        [GRAVITY],
        ["  m: {type: position, at: {body: beam, s: 0.5 m}}", "  O: {type: reaction, joint: O}"],
    ),
    "sprung_rest": mechanism(
        1,
        [beam("beam")],
        [HELD],
        [
            GRAVITY,
            "  s: {type: spring_damper, at: beam.right, to: [1 m, 0.3 m], stiffness: 20 N/m, damping: 0.4 N s/m}",
        ],
        [TIP, "  s: {type: load, load: s}"],
    ),
}
WISHES = MOTIONS | {name: at_rest(text) for name, text in EQUILIBRIA.items()}


def wanting(scene: Scene, accuracy: float) -> Scene:
    return replace(
        scene, analysis=replace(scene.analysis, accuracy=Accuracy({"": Bound(accuracy)}))
    )


@dataclass(frozen=True)
class Promise:
    """One wish, what was promised, and how true that is."""

    name: str
    accuracy: float
    cells: int | None
    steps: int | None
    why_not: str
    met: bool
    true: float  #: the largest error over what is wanted
    foretold: float
    held: int  #: columns whose `+-` is no smaller than their error
    columns: int  #: of which something is wanted
    excess: float  #: the largest true error over its `+-`
    worst: str  #: the column of it
    pilots: int
    plan_s: float

    @property
    def words(self) -> str:
        told = f"{'met' if self.met else self.why_not or 'not met'} | {self.true:.2f} | {self.foretold:.2f}"
        holds = f"{self.held}/{self.columns} | {self.excess:.2f} {self.worst if self.excess > 1.0 else ''}"
        chosen = f"{self.name} | {self.accuracy:g} | {self.cells or ''} | {self.steps or ''}"
        return f"| {chosen} | {told} | {holds} | {self.pilots} | {1e3 * self.plan_s:.0f} |"


def judge(name: str, scene: Scene, accuracy: float) -> Promise:
    """What a wish finds, beside a converged reference."""
    mine = wanting(scene, accuracy)
    begin = time.process_time()
    plan = planned.find(mine)
    spent, pilots = time.process_time() - begin, ScenePilots(mine)
    run = studies.run(mine, plots=False)
    level = plan.cells or (1 if pilots.refined else 0)
    if plan.steps:
        parts = math.ceil(4 * max(one["steps"] for one in plan.pilots) / plan.steps)
        finer = pilots.analysis.piloted(parts * plan.steps, parts).solve_for_outputs(
            pilots.system(4 * level)
        )
        every = pilots.analysis.piloted(
            plan.steps, 1, plan.local_error, plan.tolerance
        ).solve_for_outputs(pilots.system(level))
    else:
        finer, every = pilots.solve(4 * level, 0), run.motion
    if plan.trusted_until == 0.0:
        return Promise(
            name,
            accuracy,
            plan.cells,
            plan.steps,
            plan.why_not,
            False,
            math.nan,
            math.nan,
            0,
            0,
            0.0,
            "",
            len(plan.pilots),
            spent,
        )
    one, other = (
        PilotOutputs(
            motion.times, output_errors.columns(motion), tuple(at.time for at in motion.events)
        )
        for motion in (every, finer)
    )
    end = math.inf if plan.trusted_until is None else plan.trusted_until * (1.0 + 1e-9)
    errors = pilots.differ(until(one, end), until(other, end))
    ratios = {
        column: own / max(plan.errors.get(column, 0.0), 1e-300)
        for column, (wanted, own) in zip(pilots.titles, errors.T.tolist(), strict=True)
        if wanted > ROUND / accuracy
    }
    worst = max(ratios, key=lambda column: ratios[column], default="")
    judged = int((errors[0] > 0.0).sum())
    held = judged - sum(ratio > 1.0 for ratio in ratios.values())
    foretold = plan.of_step + (plan.of_mesh or 0.0)
    true = float(errors[0].max(initial=0.0))
    excess = ratios.get(worst, 0.0)
    told = plan.why_not, plan.met, true, foretold
    return Promise(
        name,
        accuracy,
        plan.cells,
        plan.steps,
        *told,
        held,
        judged,
        excess,
        worst,
        len(plan.pilots),
        spent,
    )


def wishes(names: Sequence[str], folder: Path) -> Iterator[tuple[str, Scene]]:
    known = WISHES | SCENES if names else WISHES
    yield from written(
        {name: text for name, text in known.items() if not names or name in names}, folder
    )
    for path in map(Path, names):
        if path.suffix == ".yaml":
            yield path.stem, scenes.read(path)


HEADS = (
    "wish",
    "accuracy",
    "cells",
    "steps",
    "told",
    "true error over wanted",
    "foretold",
    "`+-` that hold",
    "excess",
    "pilots",
    "plan [ms]",
)


def main(
    names: Sequence[str] = (),
    wanted: Sequence[float] = (1e-2, 1e-3),
    part: tuple[int, int] = (1, 1),
) -> list[Promise]:
    """All wishes by name, all without, and what they amount to; of `part` (i, n) every n-th scene
    from the i-th on.
    """
    found: list[Promise] = []
    with (
        tempfile.TemporaryDirectory() as folder,
        threadpool_limits(limits=1, user_api="blas"),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")
        for name, scene in itertools.islice(
            wishes(names, Path(folder)), part[0] - 1, None, part[1]
        ):
            for accuracy in wanted:
                try:
                    found.append(judge(name, scene, accuracy))
                except FmbsError as error:
                    print(
                        f"| {name} | {accuracy:g} | {type(error).__name__}: {str(error)[:150]} |",
                        flush=True,
                    )
                    continue
                print(found[-1].words, flush=True)
    text = page(found)
    print(text.splitlines()[2])
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "promises.md").write_text(text, encoding="utf-8")
    return found


def page(found: Sequence[Promise]) -> str:
    """All wishes as a table, below sentences."""
    promised = [one for one in found if one.met]
    kept = sum(one.true <= 1.0 for one in promised)
    columns, held = sum(one.columns for one in found), sum(one.held for one in found)
    text = f"{len(found)} wishes, {len(promised)} of which are promised: {kept} are kept, the worst errs by "
    text += f"{max((one.true for one in promised), default=0.0):.2f} of its accuracy. `+-` hold in {held} of {columns} columns; the "
    text += f"largest error is {max((one.excess for one in found), default=0.0):.2f} of its `+-`. Plans take "
    mean = math.exp(np.mean([math.log(one.plan_s) for one in found]))
    text += f"{sum(one.plan_s for one in found):.1f} s of CPU, {mean:.3f} s in the geometric mean."
    lines = [
        "# What is promised",
        "",
        text,
        "",
        f"| {' | '.join(HEADS)} |",
        "|" + "---|" * len(HEADS),
    ]
    return "\n".join([*lines, *(one.words for one in found)]) + "\n"


if __name__ == "__main__":
    asked = argparse.ArgumentParser()
    asked.add_argument("names", nargs="*")
    asked.add_argument("--accuracy", default="1e-2,1e-3")
    asked.add_argument("--part", default="1/1", help="i/n: every n-th scene, from the i-th on")
    given = asked.parse_args()
    first, every = map(int, given.part.split("/"))
    main(given.names, [float(one) for one in given.accuracy.split(",")], (first, every))
