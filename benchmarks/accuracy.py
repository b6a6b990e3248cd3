"""True errors of scenes that ask for an accuracy, what finding step and mesh costs, and what the
cheapest run would have cost.

    python benchmarks/accuracy.py [--accuracy 1e-2,1e-3,1e-4] [--cheapest] [--log] [--part 1/4] [NAMES]
    python benchmarks/accuracy.py --front NAMES

Mechanisms of `mechanisms.py` and examples. Every one is run as `fmbs run --accuracy` runs it, for
every accuracy, and held, at the ends of all its steps, against a run of four times its cells and
four times the steps of all pilots, and 12 800 steps at least, so that no short event is missed by
both. What is said to be sensitive is held against it up to the time that it is trusted to. Costs
are CPU seconds of one BLAS thread within one process, pilots with their builds over the run that
was chosen; a second plan is timed, so that nothing compiles.

With `--cheapest` all of CELLS x STEPS are tried that are cheaper than the run that was chosen, by
counted work: `work` below.
"""

from __future__ import annotations

import argparse
import itertools
import math
import statistics
import tempfile
import time
import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mechanisms import of_names
from threadpoolctl import threadpool_limits

from fmbs_skfem import studies
from fmbs_skfem.core.errors import FmbsError
from fmbs_skfem.dynamics import output_errors
from fmbs_skfem.scenes.accuracy import Accuracy, Bound
from fmbs_skfem.scenes.schema import Scene
from fmbs_skfem.studies.planning import planned
from fmbs_skfem.studies.planning.pilots import PilotOutputs, ScenePilots, until

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
DOCS = ROOT / "docs"
AT_LEAST = 12_800  #: steps of a reference
#: that are tried
CELLS, STEPS = (
    (2, 3, 4, 6, 8, 12, 16, 24, 32, 48),
    tuple(n * 2**k for k in range(10) for n in (200, 300)),
)


def wanting(scene: Scene, accuracy: float) -> Scene:
    """The scene with an accuracy, and no step."""
    return replace(
        scene,
        analysis=replace(
            scene.analysis, step=np.inf, every=1, accuracy=Accuracy({"": Bound(accuracy)})
        ),
    )


def timed(
    pilots: ScenePilots, cells: int, steps: int, local_error: float = 0.0
) -> tuple[float, PilotOutputs | None]:
    """CPU seconds of a run, and what it finds."""
    begin = time.process_time()
    found = pilots.run(cells, steps, local_error)
    return time.process_time() - begin, found


def work(pilots: ScenePilots, cells: int, steps: int, local_error: float = 0.0) -> float:
    """Counted work of a run: (iterations + 4 factorisations) (unknowns + 20).

    Fitted to CPU seconds of 78 runs of 13 mechanisms, which it meets within 0.6 to 1.2 for eight of
    ten.
    """
    cost = pilots.solve(cells, steps, local_error).statistics
    return (cost.iterations + 4 * cost.factorisations) * (pilots.system(cells).size + 20)


def largest(differences: np.ndarray) -> float:
    """The largest of differences (2, k) beside what is wanted."""
    return float(differences[0].max(initial=0.0))


@dataclass(frozen=True)
class Row:
    """One scene with one accuracy."""

    name: str
    accuracy: float
    cells: int | None
    steps: int
    true: float  #: error over what is wanted, up to the time that is trusted
    estimated: float  #: the same, foretold
    why_not: str
    trusted: float | None  #: time [s]
    pilots: int
    run_s: float  #: CPU of the run that was chosen
    plan_s: float  #: CPU of the plan, with all builds
    over_cheapest: float | None  #: counted work over that of the cheapest run
    cheapest: tuple[int, int] | None  #: its cells and steps
    log: list[dict[str, Any]]

    @property
    def words(self) -> str:
        """The cells of its line of a table."""
        told = self.why_not + (
            f", trusted to {self.trusted:.3g} s" if self.trusted is not None else ""
        )
        times = f"{1e3 * self.run_s:.1f} | {1e3 * self.plan_s:.0f}"
        best = (
            ""
            if self.cheapest is None
            else f"{self.over_cheapest:.2f} ({self.cheapest[0] or ''} x {self.cheapest[1]})"
        )
        numbers = (
            f"{self.true:.2f} | {self.estimated:.2f} | {told} | {self.pilots} | {times} | {best}"
        )
        return (
            f"| {self.name} | {self.accuracy:g} | {self.cells or ''} | {self.steps} | {numbers} |"
        )


def row(name: str, scene: Scene, accuracy: float, try_all: bool) -> Row:
    """What a run for an accuracy finds, and how true that is."""
    mine = wanting(scene, accuracy)
    run = studies.run(mine, plots=False)
    begin = time.process_time()
    plan = planned.find(mine)
    spent, pilots = time.process_time() - begin, ScenePilots(mine)
    assert asdict(plan) == run.report["accuracy"]
    level = plan.cells or (1 if pilots.refined else 0)
    chosen = min(timed(pilots, level, plan.steps, plan.local_error)[0] for _ in range(2))
    error = true_error(pilots, run, level, plan)
    best = (
        cheapest(pilots, level, plan.steps, plan.local_error)
        if try_all and not plan.why_not
        else None
    )
    foretold = plan.of_step + (plan.of_mesh or 0.0)
    told = plan.why_not, plan.trusted_until, len(plan.pilots), chosen, spent
    return Row(
        name,
        accuracy,
        plan.cells,
        plan.steps,
        error,
        foretold,
        *told,
        *(best or (None, None)),
        plan.pilots,
    )


def true_error(pilots: ScenePilots, run: studies.Run, level: int, plan: planned.Planned) -> float:
    """The largest error of a run over what is wanted, at the ends of its steps, up to the time that
    it is trusted to.

    The reference has four times the cells, and of the steps a whole number for each of the run. NaN
    where it fails.
    """
    parts = math.ceil(max(AT_LEAST, 4 * max(one["steps"] for one in plan.pilots)) / plan.steps)
    try:
        finer = pilots.analysis.piloted(parts * plan.steps, parts).solve_for_outputs(
            pilots.system(4 * level)
        )
    except FmbsError:
        return math.nan
    end = math.inf if plan.trusted_until is None else plan.trusted_until * (1.0 + 1e-9)
    if run.motion is None or end == 0.0:
        return math.nan
    mine, reference = (
        PilotOutputs(motion.times, columns, tuple(one.time for one in motion.events))
        for motion, columns in ((run.motion, run.outputs), (finer, output_errors.columns(finer)))
    )
    return largest(pilots.differ(until(mine, end), until(reference, end)))


def cheapest(
    pilots: ScenePilots, cells: int, steps: int, local_error: float = 0.0
) -> tuple[float, tuple[int, int]]:
    """Counted work of a run over that of the cheapest one that meets the accuracy, and which that
    is; 1 where it is the cheapest.

    Only runs with less work are looked at. The reference has 200 2^k steps, which every number of
    steps of STEPS has instants of.
    """
    mine = work(pilots, cells, steps, local_error)
    least, best = mine, (cells, steps)
    finest = 200 * 2 ** math.ceil(math.log2(max(AT_LEAST, 4 * steps) / 200))
    reference = pilots.run(4 * cells, finest)
    fewest = pilots.fewest if pilots.open else 0
    for level in [one for one in CELLS if fewest <= one <= 2 * cells] if pilots.open else [cells]:
        for number in STEPS:
            if (found := pilots.run(level, number)) is None:
                continue
            if (cost := work(pilots, level, number)) >= least:
                break
            if largest(pilots.differ(found, reference)) <= 1.0:
                least, best = cost, (level, number)
                break
    return mine / least, best


HEADS = (
    "scene",
    "accuracy",
    "cells",
    "steps",
    "true error over wanted",
    "foretold",
    "told",
    "pilots",
    "run [ms]",
    "plan [ms]",
)
HEADS = (*HEADS, "work over the cheapest (cells x steps)")


def main(
    names: Sequence[str] = (),
    wanted: Sequence[float] = (1e-2, 1e-3, 1e-4),
    log: bool = False,
    try_all: bool = False,
    part: tuple[int, int] = (1, 1),
) -> list[Row]:
    """Rows of scenes by name, all without, and what they amount to; of `part` (i, n) every n-th
    scene from the i-th on.
    """
    rows: list[Row] = []
    with (
        tempfile.TemporaryDirectory() as folder,
        threadpool_limits(limits=1, user_api="blas"),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")
        for name, scene in itertools.islice(
            of_names(names, Path(folder)), part[0] - 1, None, part[1]
        ):
            for accuracy in wanted:
                try:
                    rows.append(row(name, scene, accuracy, try_all))
                except FmbsError as error:
                    print(
                        f"| {name} | {accuracy:g} | {type(error).__name__}: {str(error)[:150]} |",
                        flush=True,
                    )
                    continue
                print(rows[-1].words, flush=True)
                if log:
                    print(
                        "   ",
                        [(one["cells"], one["steps"], one["difference"]) for one in rows[-1].log],
                    )
    text = page(rows)
    print(text.splitlines()[2])
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "accuracy.md").write_text(text, encoding="utf-8")
    return rows


def front(name: str, wanted: Sequence[float] = (1e-2, 1e-3, 1e-4), repeats: int = 3) -> Path:
    """A picture of full models with all cells and steps, and of what plans choose: CPU beside true
    error, parts of the ranges.

    The reference has 48 cells and four times the steps of the finest one. CPU seconds are the least
    of `repeats` calls of the integration and its outputs.
    """
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.2, 4.6), layout="constrained")
    with (
        tempfile.TemporaryDirectory() as folder,
        threadpool_limits(limits=1, user_api="blas"),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")
        _, scene = next(of_names([name], Path(folder)))
        pilots = ScenePilots(wanting(scene, 1.0 - 1e-9))
        pilots.system(4)
        plans = [planned.find(wanting(scene, accuracy)) for accuracy in wanted]
        finest = max([*STEPS, *(plan.steps for plan in plans)])
        reference = pilots.run(48, 4 * finest)

        def point(cells: int, steps: int, local_error: float = 0.0) -> tuple[float, float] | None:
            tries = [timed(pilots, cells, steps, local_error) for _ in range(repeats)]
            found = tries[0][1]
            return (
                None
                if found is None
                else (
                    min(seconds for seconds, _ in tries),
                    float(pilots.differ(found, reference)[0].max()),
                )
            )

        for number, cells in enumerate(CELLS):
            known = [one for steps in STEPS if (one := point(cells, steps)) is not None]
            if known:
                axes.loglog(
                    *zip(*known, strict=True),
                    "o-",
                    ms=3,
                    lw=0.8,
                    color=plt.cm.viridis(number / len(CELLS)),
                    label=f"{cells} cells",
                )
        for accuracy, plan in zip(wanted, plans, strict=True):
            if (one := point(plan.cells or 0, plan.steps, plan.local_error)) is not None:
                axes.axhline(accuracy, color="0.8", lw=0.8, zorder=0)
                axes.loglog(
                    *one,
                    "*",
                    ms=13,
                    color="#D55E00",
                    zorder=5,
                    label="chosen for an accuracy" if accuracy == wanted[0] else None,
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
        f"{name.removeprefix('example_')}: full models of 200 to 6400 steps, and those that accuracies choose",
        fontsize=10,
    )
    axes.legend(fontsize=8, ncols=2, frameon=False)
    axes.grid(alpha=0.3)
    path = DOCS / f"accuracy_{name.removeprefix('example_')}.png"
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path


def page(rows: Sequence[Row]) -> str:
    """All rows as a table, below sentences."""
    told = [row for row in rows if not row.why_not]
    met, worst = sum(row.true <= 1.0 for row in told), max((row.true for row in told), default=0.0)
    ratio = statistics.median(row.plan_s / row.run_s for row in told) if told else 0.0
    cheap = sum(row.plan_s <= max(4.0 * row.run_s, 0.05) for row in told)
    text = f"{len(rows)} plans, {len(told)} of which promise their accuracy: {met} keep it, the worst errs by {worst:.2f} of it. "
    text += f"A plan costs {ratio:.1f} times the run that it chooses, in the median; {cheap} cost at most 4 times as much, or 50 ms. "
    if over := [row.over_cheapest for row in told if row.over_cheapest is not None]:
        text += f"The chosen run does {statistics.median(over):.2f} times the work of the cheapest one that meets the accuracy, "
        text += f"in the median, {np.percentile(over, 90):.2f} times in one of ten."
    lines = [
        "# Accuracies that were asked for",
        "",
        text,
        "",
        f"| {' | '.join(HEADS)} |",
        "|" + "---|" * len(HEADS),
    ]
    return "\n".join([*lines, *(row.words for row in rows)]) + "\n"


if __name__ == "__main__":
    asked = argparse.ArgumentParser()
    asked.add_argument("names", nargs="*")
    asked.add_argument("--accuracy", default="1e-2,1e-3,1e-4")
    asked.add_argument("--log", action="store_true")
    asked.add_argument(
        "--cheapest", action="store_true", help="try all cells and steps that are cheaper"
    )
    asked.add_argument("--part", default="1/1", help="i/n: every n-th scene, from the i-th on")
    asked.add_argument(
        "--front", action="store_true", help="draw full models and plans of the scenes named"
    )
    given = asked.parse_args()
    if given.front:
        print(*(front(name) for name in given.names), sep="\n")
        raise SystemExit
    first, every = map(int, given.part.split("/"))
    main(
        given.names,
        [float(one) for one in given.accuracy.split(",")],
        given.log,
        given.cheapest,
        (first, every),
    )
