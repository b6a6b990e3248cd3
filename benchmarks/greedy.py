"""Greedy training over parameters: full runs, reduced runs and errors at hold-out points, beside
the published counts.

    python benchmarks/greedy.py [--folder DIR] [--every K] [spin_up] [young] [torque] [two] [three] [young_fine] [torque_fine]

Example 1 over Young's modulus; example 3 over Young's modulus and torque, runs (a) and (b) of the
source, on coarse meshes; example 2 over two and three parameters with the tolerance 1e-4: these by
default. `young_fine` and `torque_fine` are runs (a) and (b) on the fine meshes: two hours each.
Writes greedy.md and greedy.json into benchmarks/results; those of earlier calls stay for the
trainings that are not run. Figs 13 and 14 are drawn of runs (a) and (b): errors after every full
run, and of the basis of one full run at the fastest parameter. Errors are those of the
displacements over their size; times are CPU seconds of one thread. With --folder full runs are
kept, so that a benchmark that was stopped goes on: `fmbs train SCENE --out DIR/young` makes the
same. With --every only every K-th hold-out point is run.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import argparse
import functools
import json
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import comparators
import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import scenes
from fmbs_skfem.families import greedy, prediction, training, trials
from fmbs_skfem.families import training_store as store
from fmbs_skfem.families.parametric_model import ParametricModel
from fmbs_skfem.families.training import FinishedTraining
from fmbs_skfem.families.trials import Full
from fmbs_skfem.families.trials import Row as Compared
from fmbs_skfem.reduction import Elements, Points
from fmbs_skfem.reduction import parameters as boxes
from fmbs_skfem.reduction.full_runs import TrainingTask
from fmbs_skfem.reduction.parameters import Parameter
from fmbs_skfem.reduction.plan import Plan
from fmbs_skfem.results import plots
from fmbs_skfem.scenes import build
from fmbs_skfem.studies import holdouts, plans

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
MEASURED = (
    "Errors are those of the displacements over their size, times are CPU seconds with one thread."
)
HELD = {1: 26, 2: 64, 3: 64}  #: hold-out points by number of parameters
FINE = "_fine"  #: end of the names of trainings on fine meshes; their hold-out runs iterate as the scene says
#: full runs, reduced runs, sparse least-squares problems
PUBLISHED = {
    "young": "2, 12, 2",
    "torque": "2, 21, 2",
}
FIGURES = {
    "young": "fig13_young.png",
    "torque": "fig14_torque.png",
    "young_fine": "fig13_young_fine.png",
    "torque_fine": "fig14_torque_fine.png",
}
TOLERANCE = 1e-4


@dataclass(frozen=True)
class Task:
    """A training and where it is checked."""

    task: TrainingTask
    search: training.Search
    options: greedy.Options
    tolerance: float | None = None


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    name: str
    parameters: str
    candidates: int
    tolerance: float | None
    full_runs: int
    reduced_runs: int
    problems: int  #: times that the sparse least-squares problems were solved
    published: str
    modes: dict[str, int]
    points: dict[str, int]  #: quadrature points or cells kept
    eps: float
    eta: float | None
    held: int  #: hold-out points
    max_error: float
    mean_error: float
    one_run: float | None  #: largest error of the basis of one full run at the fastest parameter
    predicted: float  #: largest error over the candidates
    inside: float  #: part of the hold-out points inside the predicted band
    reached: bool  #: whether the largest error keeps the tolerance, where one was asked for
    full_cpu_s: float
    model_cpu_s: float
    training_cpu_s: float  #: all of it
    reduced_cpu_s: float  #: a run, median
    stop: str


def trained(
    name: str, plan: Plan | None = None, changes: Mapping[str, str] | None = None
) -> tuple[TrainingTask, tuple[Parameter, ...]]:
    """The task of an example's scene, some of its text replaced, with another plan where it is
    given.
    """
    path = ROOT / "examples" / f"{name}.yaml"
    text = path.read_text(encoding="utf-8")
    for old, new in (changes or {}).items():
        text = text.replace(old, new)
    scene = scenes.loads(text, path.parent) if changes else scenes.read(path)
    known, family = scenes.family(scene)
    interval = build.dynamic(scene).step * build.snapshot_steps(scene)
    return TrainingTask(
        family,
        known,
        plan or plans.plan(scene),
        interval,
        functools.partial(build.chosen_form, scene),
    ), known


def one(
    found: tuple[TrainingTask, tuple[Parameter, ...]],
    samples: list[float] | None,
    first: float | None,
) -> Task:
    """A training over one parameter with 101 candidates."""
    made, known = found
    rows = boxes.grid(known, 5) if samples is None else boxes.listed(known, samples)
    return Task(
        made,
        training.search(known, boxes.grid(known, 101), rows, first),
        greedy.Options(iterations=4, max_samples=15),
    )


def several(names: tuple[str, ...]) -> Task:
    """Example 2 over some of its parameters, with a tolerance."""
    made, known = trained(
        "pendulum_family", Plan({"first": ("I",), "second": ("II",)}, hyper=Points())
    )
    chosen = tuple(parameter for parameter in known if parameter.name in names)
    made = TrainingTask(made.family, chosen, made.plan, made.interval, made.form)
    search = training.search(
        chosen, boxes.sobol(chosen, 256), boxes.sobol(chosen, 4 * len(chosen), seed=1)
    )
    return Task(made, search, greedy.Options(iterations=12, max_samples=24), TOLERANCE)


def tasks() -> dict[str, Callable[[], Task]]:
    """All trainings by name."""
    spin = {
        "parameters:\n": "parameters:\n  E: {value: 1 GPa, range: [0.7 GPa, 1.3 GPa]}\n",
        "young_modulus: 1 GPa": "young_modulus: E",
    }
    gpa, newton_metres, finer = (
        [40e9, 47.5e9, 55e9, 62.5e9, 70e9],
        [5.0, 7.5, 10.0, 12.5, 15.0],
        {"_coarse.msh": "_fine.msh"},
    )
    return {
        "spin_up": lambda: one(
            trained("spin_up", Plan({"beam": ("beam",)}, hyper=Elements()), spin), None, None
        ),
        "young": lambda: one(trained("crank_slider_young"), gpa, 55e9),
        "torque": lambda: one(trained("crank_slider_torque"), newton_metres, 10.5),
        "two": lambda: several(("E", "d")),
        "three": lambda: several(("E", "d", "g")),
        "young_fine": lambda: one(trained("crank_slider_young", changes=finer), gpa, 55e9),
        "torque_fine": lambda: one(
            trained("crank_slider_torque", changes=finer), newton_metres, 10.5
        ),
    }


def measure(name: str, task: Task, folder: Path, every: int) -> Row:
    """Train, check at every so many hold-out points, and tell."""
    known, begun = task.task.parameters, time.process_time()
    before = sum(
        stored.run.cpu_s
        for stored in store.store_of(folder / "training").series(store.RUN, store.StoredRun)
    )
    found = training.train(
        task.task, task.search, task.options, folder / "training", task.tolerance
    )
    spent = time.process_time() - begun + before
    count = HELD[len(known)]
    points = (
        boxes.grid(known, count) if len(known) == 1 else boxes.latin_hypercube(known, count, seed=7)
    )[::every]
    full = holdouts.read_or_run(found, found.task, folder)
    truth = holdouts.read_or_run(found, found.task, folder, sharp=not name.endswith(FINE))
    held = trials.compare(found.task, [*trials.stages(found)][-1:], truth, points)[0]
    predict = prediction.predictor(
        ParametricModel(found.model.parametric, {prediction.KEY: prediction.record(found)})
    )
    bands = [predict(boxes.named(known, row)) for row in points] if predict else []
    errors = [trial.error for trial in held.trials]
    rows = drawn(RESULTS / FIGURES[name], found, full, truth, points) if name in FIGURES else ()
    return Row(
        name,
        ", ".join(f"{p.name} {p.low:g} to {p.high:g} {p.unit}" for p in known),
        len(task.search.candidates),
        task.tolerance,
        len(found.runs),
        found.reduced_runs,
        sum(bool(model.selections) for model in found.models) + found.lowered,
        PUBLISHED.get(name.removesuffix(FINE), ""),
        dict(found.model.modes),
        {
            selection.component: len(selection.sample.indices)
            for selection in found.model.selections
        },
        found.task.plan.tolerance,
        found.task.plan.hyper.tolerance,
        len(points),
        held.max_error,
        held.mean_error,
        rows[-1].max_error if rows else None,
        found.predicted[0],
        float(
            np.mean(
                [band.low <= error <= band.high for band, error in zip(bands, errors, strict=True)]
            )
        ),
        task.tolerance is None or held.max_error <= task.tolerance,
        sum(run.cpu_s for run in found.runs),
        sum(model.training_s for model in found.models),
        spent,
        held.run_s,
        found.outcome.stop.value,
    )


def drawn(
    path: Path, found: FinishedTraining, full: Full, truth: Full, points: np.ndarray
) -> tuple[Compared, ...]:
    """Fig. 13 or 14: errors after every full run, and of the basis of one run at the fastest
    parameter, which is the last row.
    """
    (own,) = found.task.parameters
    others = [
        *trials.stages(found),
        comparators.fast_to_slow(found.task, full, comparators.fastest(found)),
    ]
    rows = trials.compare(found.task, others, truth, points)
    errors = {row.name: np.array([trial.error for trial in row.trials]) for row in rows}
    label = "error of the displacements over their size"
    plots.save(plots.errors(points[:, 0], errors, label, f"{own.name} [{own.unit}]"), path)
    return rows


def page(rows: list[Row]) -> str:
    """The figures as Markdown."""
    head = [
        "training",
        "parameters",
        "tolerance",
        "full, reduced runs, sNNLS",
        "paper",
        "modes",
        "kept",
        "eps, eta",
        "hold-out",
    ]
    head += [
        "max error",
        "mean error",
        "fast to slow, max",
        "in the band",
        "full runs [s]",
        "models [s]",
        "all [s]",
        "a reduced run [s]",
    ]
    lines = [
        "# Greedy training over parameters",
        "",
        f"| {' | '.join(head)} |",
        "|" + "---|" * len(head),
    ]
    for r in rows:
        cells = [
            r.name,
            r.parameters,
            f"{r.tolerance:.0e}" if r.tolerance else "",
            f"{r.full_runs}, {r.reduced_runs}, {r.problems}",
        ]
        cells += [
            r.published,
            " + ".join(map(str, r.modes.values())),
            " + ".join(map(str, r.points.values())),
        ]
        cells += [
            f"{r.eps:.1e}, {r.eta:.0e}" if r.eta else f"{r.eps:.1e}",
            str(r.held),
            f"{r.max_error:.2e}",
            f"{r.mean_error:.2e}",
            f"{r.one_run:.2e}" if r.one_run else "",
        ]
        cells += [
            f"{100 * r.inside:.0f} %",
            f"{r.full_cpu_s:.1f}",
            f"{r.model_cpu_s:.1f}",
            f"{r.training_cpu_s:.1f}",
        ]
        lines.append(f"| {' | '.join([*cells, f'{r.reduced_cpu_s:.3g}'])} |")
    ends = [f"{r.name}: {r.stop}." for r in rows]
    return "\n".join([*lines, "", MEASURED, "", *ends, ""])


def main(*names: str, folder: Path | None = None, every: int = 1) -> list[Row]:
    """Measure the trainings of these names, all on coarse meshes by default; write greedy.json and
    greedy.md.

    Full runs are kept in a folder, where it is given.
    """
    path, known = RESULTS / "greedy.json", tasks()
    rows = (
        {
            row["name"]: Row(**{"one_run": None, **row})
            for row in json.loads(path.read_text(encoding="utf-8"))
        }
        if path.is_file()
        else {}
    )
    RESULTS.mkdir(parents=True, exist_ok=True)
    with threadpool_limits(limits=1), tempfile.TemporaryDirectory() as scratch:
        for name in names or [name for name in known if not name.endswith(FINE)]:
            rows[name] = measure(name, known[name](), (folder or Path(scratch)) / name, every)
            kept = [rows[key] for key in known if key in rows]
            path.write_text(
                json.dumps([asdict(row) for row in kept], indent=2) + "\n", encoding="utf-8"
            )
            (RESULTS / "greedy.md").write_text(page(kept), encoding="utf-8")
    print(page([rows[key] for key in known if key in rows]))
    return list(rows.values())


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description="Greedy training over parameters.")
    arguments.add_argument("names", nargs="*")
    arguments.add_argument("--folder", type=Path)
    arguments.add_argument("--every", type=int, default=1)
    given = arguments.parse_args()
    main(*given.names, folder=given.folder, every=given.every)
