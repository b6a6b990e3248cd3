"""Every table and figure of the paper beside ours: Tables 1 to 4, speed against error, Figs 13 and
14.

    python benchmarks/paper.py [spin_up] [double_pendulum] [crank_slider] [crank_slider_coarse] [young] [torque] ...

Examples are compared by `fmbs compare` with all variants; CPU and wall seconds are with one BLAS
thread, the best of several runs where they are short, training excluded; errors stand beside.
`crank_slider` is Table 4 at full size and takes the better part of an hour; both crank-sliders are
also run with as many modes as were published. `young` and `torque` are the trainings of Figs 13 and
14 on coarse meshes, `young_fine` and `torque_fine` on those of the paper, see `greedy.py`. By
default the beams, Table 4 on coarse meshes and both trainings. Writes compare_*.json, compare_*.md,
pictures, and what `greedy.py` writes, into benchmarks/results.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import greedy

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.values.display import DisplayUnits
from fmbs_skfem.reduction import Exact, cases, full_runs, reduced_models
from fmbs_skfem.reduction.accuracy import errors
from fmbs_skfem.reduction.accuracy.comparison import Comparison, ModelRecord
from fmbs_skfem.reduction.accuracy.runs import kept_steps
from fmbs_skfem.results import plots
from fmbs_skfem.scenes import Scene, build
from fmbs_skfem.studies import comparison, plans, reports, tables
from fmbs_skfem.studies.result import ReportTable

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
DEFAULT = ("spin_up", "double_pendulum", "crank_slider_coarse", "young", "torque")
TRAININGS = tuple(greedy.FIGURES)
PAPER = "  paper"  #: name of the rows with published figures


def main(names: list[str]) -> dict[str, dict[str, Any]]:
    """Run the studies and write compare_*.json, compare_*.md and the picture of speed against
    error; the reports by scene.
    """
    written = {}
    RESULTS.mkdir(parents=True, exist_ok=True)
    for name in names:
        scene = scenes.read(ROOT / "examples" / f"{name}.yaml")
        found = studies.compare(scene)
        written[name] = report = {**found.report, "provenance": provenance(scene)}
        reports.write_json(RESULTS / f"compare_{name}.json", report)
        shown = [
            part if isinstance(part, str) else f"```\n{part}\n```"
            for part in (
                *tables_of(scene, found.study),
                *tables.compared(found.study, scene.display),
            )
        ]
        text = page(report, [*shown, *gap_with_published_modes(scene, found.study)])
        (RESULTS / f"compare_{name}.md").write_text(text, encoding="utf-8")
        plots.save(found.figures["speed_error"], RESULTS / f"compare_{name}.png")
        print(text)
    return written


def provenance(scene: Scene) -> dict[str, Any]:
    """What the numbers depend on, files by their place in the repository."""
    found = reports.provenance(scene)
    files = {str(Path(name).relative_to(ROOT)): mark for name, mark in found["files"].items()}
    return {**found, "file": str(Path(found["file"]).relative_to(ROOT)), "files": files}


def gap_with_published_modes(scene: Scene, study: Comparison) -> list[str]:
    """The largest error of the exact polynomial with the numbers of modes that were published, at
    both levels.
    """
    known = read_published().get(scene.name.removesuffix("-coarse"), {}).get("models", {})
    found = {}
    for level in ("system", "component"):
        if (model := study.models.get(f"{level}+exact")) is not None:
            counts = dict(zip(model.bases, known[level]["r"], strict=True))
            found[level] = counts, error_of(scene, study, model, counts)
    told = [
        f"{' + '.join(map(str, counts.values()))} modes by {level}: {error:.1e}"
        for level, (counts, error) in found.items()
    ]
    return (
        [f"Largest errors with as many modes as were published: {'; '.join(told)}."] if told else []
    )


def error_of(
    scene: Scene, study: Comparison, model: reduced_models.ReducedModel, counts: Mapping[str, int]
) -> float:
    """The largest error of the exact polynomial with so many modes of every basis."""
    plan = replace(
        plans.plan(scene), components=model.components, modes=dict(counts), hyper=Exact()
    )
    task = plans.task(scene, build.system(scene), plan)
    made = reduced_models.make_model(task, [full_runs.run_of_motion(task, study.full)])
    motion = cases.run(made.cases({}), kept_steps(task.family({}), task.interval))
    return errors.compare(study.full, motion).maximum


def page(report: dict[str, Any], parts: list[str]) -> str:
    """All models as a Markdown table, who is on the front, the outputs of the full model, then
    further parts.
    """
    head = (
        "model",
        "dofs",
        "modes",
        "cells",
        "points",
        "force, tangent [s]",
        "solves [s]",
        "products [s]",
        "CPU [s]",
        "wall [s]",
        "sNNLS [s]",
        "training [s]",
        "K_r [us]",
        "max error",
        "median error",
        "mean error",
        "position [m]",
        "pays after",
    )
    lines = [
        f"# {report['scene']}: time beside error",
        "",
        "| " + " | ".join(head) + " |",
        "|---" + "|---:" * (len(head) - 1) + "|",
    ]
    lines += ["| " + " | ".join(row(model)) + " |" for model in report["models"]]
    ends = "; ".join(
        f"{name} {found['final']:.7g}, largest {found['max']:.7g}"
        for name, found in report["outputs"].items()
    )
    words = [
        *comparison.summarise(report),
        f"Outputs of the full model at the end, SI units: {ends}.",
        *parts,
    ]
    return "\n".join([*lines, "", *(f"{text}\n" for text in words)])


def row(model: dict[str, Any]) -> list[str]:
    """One model; where it failed, the reason."""
    sizes = [" + ".join(map(str, model[key].values())) for key in ("modes", "elements", "points")]
    if model["status"] != "done":
        return [model["name"], str(model["dofs"]), *sizes, model["status"], *[""] * 12]
    seconds = [
        f"{model[key]:.3g}" for key in ("force_s", "solve_s", "product_s", "cpu_s", "wall_s")
    ]
    trained = [
        " + ".join(f"{value:.2g}" for value in model["snnls_s"].values()),
        f"{model['training_s']:.3g}",
    ]
    errors = ("kr_us", "max_error", "median_error", "mean_error", "position_error")
    numbers = [*seconds, *trained, *(f"{model[key]:.3g}" for key in errors)]
    pays = "" if model["pays_after_runs"] is None else f"{model['pays_after_runs']:.1f}"
    return [model["name"], str(model["dofs"]), *sizes, *numbers, pays]


@cache
def read_published() -> dict[str, Any]:
    """Figures of the literature, by name of the scene; coarse meshes are compared with those of the
    scene itself.
    """
    text = Path(__file__).with_name("published.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def tables_of(scene: Scene, study: Comparison) -> list[Any]:
    """Products, reduced tangents and training as in Tables 1 to 3 of the source; for plates its
    Table 4.
    """
    paper = read_published().get(scene.name.removesuffix("-coarse"), {})
    known = paper.get("models", {})
    if any(record.hyper == "exact" for record in study.records):
        shown: list[Any] = [below("Table 4: sizes", table_4(study), SIZES, known)]
        done = [record for record in table_4(study) if record.status == "done"]
        shown += [
            below("Table 4: CPU time [s]", done, SHARES, known),
            accuracy(study, scene.display),
        ]
    else:
        counted = beside(
            "Table 1: scalar multiplications for the reduced tangent K_r",
            reduced(study),
            PRODUCTS,
            known,
        )
        shown = [counted, tangents(study, known)]
        if trained := [record for record in reduced(study) if record.snnls_s]:
            shown.append(searches(trained, known))
    return [*shown, origin_of(paper, study)] if paper else shown


def origin_of(paper: Mapping[str, Any], study: Comparison) -> str:
    """Where published figures are from, and in what models and machine differ here."""
    theirs = {
        name: sum(one["dofs"])
        for name, one in paper["models"].items()
        if name in ("full", "system")
    }
    ours, size = study["full"].dofs, next(iter(theirs.values()))
    scene = f"{ours} coordinates in the full model" + (
        f", {size} there" if size != ours else ", as there"
    )
    return f"paper: {paper['source']}; here: {scene}, compiled Python on {reports.processor()}"


class Column(NamedTuple):
    """A column of a table of models."""

    head: str
    ours: Callable[[ModelRecord], object]
    #: the same of the published figures of a model
    paper: Callable[[Mapping[str, Any]], str] | None = None


def figure(key: str, form: str = "", scale: float = 1) -> Callable[[Mapping[str, Any]], str]:
    """What reads a published figure, one or a list; nothing where there is none."""

    def read(paper: Mapping[str, Any]) -> str:
        found = paper.get(key, ())
        return join(
            (scale * value for value in (found if isinstance(found, list | tuple) else [found])),
            form,
        )

    return read


def beside(
    title: str, records: Sequence[ModelRecord], columns: Sequence[Column], known: Mapping[str, Any]
) -> ReportTable:
    """A row a model; published figures, where there are any, in a column beside ours."""
    heads, rows = ["model"], [[record.name] for record in records]
    for column in columns:
        heads += [column.head, *(["paper"] if known and column.paper else [])]
        for row, record in zip(rows, records, strict=True):
            row.append(str(column.ours(record)))
            row += [column.paper(known.get(record.name, {}))] if known and column.paper else []
    return ReportTable(title, heads, rows, names=True)


def below(
    title: str, records: Sequence[ModelRecord], columns: Sequence[Column], known: Mapping[str, Any]
) -> ReportTable:
    """A row a model, below it the published figures."""
    rows = []
    for record in records:
        rows.append([record.name, *(column.ours(record) for column in columns)])
        if paper := known.get(record.name):
            rows.append(
                [PAPER, *(column.paper(paper) if column.paper else "" for column in columns)]
            )
    return ReportTable(title, ["model", *(column.head for column in columns)], rows, names=True)


def table_4(study: Comparison) -> list[ModelRecord]:
    """The models of Table 4: the full one, its other steps, and the reduced ones of the scene's eps
    and eta.
    """
    return [record for record in study.records if record.main or record.family in ("full", "step")]


def reduced(study: Comparison) -> list[ModelRecord]:
    """The reduced models of the scene's own eps and eta."""
    return [record for record in study.records if record.main and record.modes]


SIZES = (
    Column("dofs", lambda record: record.dofs or "none", figure("dofs")),
    Column("modes", lambda record: join(record.modes.values()), figure("r")),
    Column("cells", lambda record: counts(record.elements), figure("elements")),
    Column("cubature points", lambda record: counts(record.points)),
    Column("dofs kept", lambda record: counts(record.dofs_kept), figure("kept")),
)


SHARES = (
    Column("force+tangent", lambda record: clock(record.force_s), figure("force_s")),
    Column("solves", lambda record: clock(record.solve_s), figure("solve_s")),
    Column("products", lambda record: clock(record.product_s), figure("product_s")),
    Column("total", lambda record: clock(record.cpu_s), figure("total_s")),
    Column("sNNLS", lambda record: join(record.snnls_s.values(), ".2g"), figure("snnls_s")),
    Column("training", lambda record: clock(record.training_s)),
    Column(
        "max error (53)",
        lambda record: tables.tell(record.coordinates_error, record.finer),
        figure("max_error", ".2e"),
    ),
)


PRODUCTS = (
    Column("r modes", lambda record: join(record.modes.values()), figure("r")),
    Column(
        "kept", lambda record: join((record.kept or record.elements).values()), figure("elements")
    ),
    Column("dofs", lambda record: join(record.dofs_kept.values()), figure("dofs")),
    Column("w", lambda record: record.bandwidth, figure("w")),
    Column(
        "p [1e6]", lambda record: f"{1e-6 * record.multiplications:.3f}", figure("p", ".3f", 1e-6)
    ),
    Column("s", lambda record: f"{record.speed_up:.2f}", figure("s", ".2f")),
)


def accuracy(study: Comparison, display: DisplayUnits) -> ReportTable:
    """Errors of all kinds beside Newton's tolerance and what is left of the joints."""
    rows, (unit, size) = [], tables.length_unit(study, display)
    for record in [
        record for record in study.records if record.status == "done" and record.family != "full"
    ]:
        published = (record.coordinates_error, record.coordinates_mean)
        lengths = (record.distance_error / size, record.position_error / size)
        errors = (record.max_error, record.median_error, record.mean_error, *lengths)
        distances = (tables.tell(value, record.finer) for value in (*errors, *published))
        sizes = (
            str(record.constraints),
            f"{record.newton:.0e}",
            str(record.iterations),
            str(record.factorisations),
        )
        rows.append((record.name, *distances, *sizes))
    if study.time_error:
        times = study.time_error
        rows.append(
            (
                f"step {times.step:g} s",
                tables.tell(times.relative),
                "",
                "",
                tables.tell(times.distance / size),
                tables.tell(times.position / size),
                *[""] * 6,
            )
        )
    columns = (
        "model",
        "max error",
        "median",
        "mean",
        f"RMS [{unit}]",
        f"position [{unit}]",
        "(53)",
        "(48)",
    )
    heads = (*columns, "constraints", "Newton", "iterations", "factors")
    return ReportTable(
        "Errors against the full model, and of its own step", heads, rows, names=True
    )


def tangents(study: Comparison, known: Mapping[str, Any]) -> ReportTable:
    """Table 2: CPU time of the reduced tangent."""
    first = study["system"].kr_us
    columns = (
        Column("K_r [s]", lambda record: f"{1e-6 * record.kr_us:.3e}", figure("kr_s", ".3e")),
        Column(
            "ratio",
            lambda record: f"{first / record.kr_us:.2f}" if record.kr_us else "",
            figure("kr_ratio", ".2f"),
        ),
    )
    return beside("Table 2: time of one reduced tangent", reduced(study), columns, known)


def searches(trained: Sequence[ModelRecord], known: Mapping[str, Any]) -> ReportTable:
    """Table 3: CPU time of the sparse non-negative least squares, and of the whole training."""
    first = sum(trained[0].snnls_s.values())

    def spent(record: ModelRecord) -> str:
        own = list(record.snnls_s.values())
        return join(own, ".2g") + (f"={sum(own):.3g}" if len(own) > 1 else "")

    def published(paper: Mapping[str, Any]) -> str:
        own = paper.get("snnls_s", ())
        return join(own) + (f"={sum(own):.4g}" if len(own) > 1 else "")

    columns = (
        Column("sNNLS [s]", spent, published),
        Column(
            "ratio",
            lambda record: f"{first / sum(record.snnls_s.values()):.2f}",
            figure("snnls_ratio", ".2f"),
        ),
        Column("whole training [s]", lambda record: f"{record.training_s:.3g}"),
    )
    return beside("Table 3: time of the sparse non-negative least squares", trained, columns, known)


def clock(seconds: float) -> str:
    return f"{seconds:.3g}" if math.isfinite(seconds) and seconds > 0 else ""


def counts(values: Mapping[str, int]) -> str:
    """Sizes by component; nothing where none is evaluated."""
    return join(values.values()) if any(values.values()) else ""


def join(values: Iterable[Any], form: str = "") -> str:
    return "+".join(format(value, form) for value in values)


if __name__ == "__main__":
    wanted = sys.argv[1:] or list(DEFAULT)
    main([name for name in wanted if name not in TRAININGS])
    if trainings := [name for name in wanted if name in TRAININGS]:
        greedy.main(*trainings)
