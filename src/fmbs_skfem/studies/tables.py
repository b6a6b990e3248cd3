"""Tables of `fmbs compare`, in the layout of those of doi 10.1016/j.cma.2019.112690, with the published figures beside ours."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from .result import Table

if TYPE_CHECKING:
    from ..reduction.comparison import Comparison, ModelRecord
    from ..scenes import Scene

PAPER = "  paper"  #: name of the rows with published figures


@cache
def read_published() -> dict[str, Any]:
    """Figures of the literature, by name of the scene; coarse meshes are compared with those of the scene itself."""
    text = resources.files(__package__).joinpath("published.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def tables(scene: Scene, study: Comparison) -> list[Any]:
    """An overview, then products, reduced tangents and training as in Tables 1 to 3 of the source; for plates its Table 4."""
    paper = read_published().get(scene.name.removesuffix("-coarse"), {})
    known = paper.get("models", {})
    if any(record.hyper == "exact" for record in study.records):
        shown: list[Any] = [sizes(study, known), shares(study, known), accuracy(study)]
    else:
        shown = [overview(study), products(study, known), tangents(study, known)]
        if any(record.snnls_s for record in main(study)):
            shown.append(searches(study, known))
    shown += errors_of_outputs(study)
    shown += [f"{record.name}: {record.status}" for record in study.records if record.status != "done"]
    return [*shown, f"paper: {paper['source']}"] if paper else shown


def table_4(study: Comparison) -> list[ModelRecord]:
    """The models of Table 4: the full one, its other steps, and the reduced ones of the scene's eps and eta."""
    return [record for record in study.records if record.main or record.family in ("full", "step")]


def sizes(study: Comparison, known: Mapping[str, Any]) -> Table:
    """Table 4, sizes: unknowns, modes, what is left of cells, points and coordinates; below every model the paper's figures."""
    rows = []
    for record in table_4(study):
        kept = (counts(record.elements), counts(record.points), counts(record.dofs_kept))
        rows.append((record.name, str(record.dofs or "none"), join(record.modes.values()), *kept))
        if paper := known.get(record.name):
            kept = (join(paper.get("elements", ())), "", join(paper.get("kept", ())))
            rows.append((PAPER, join(paper["dofs"]), join(paper.get("r", ())), *kept))
    heads = ("model", "dofs", "modes", "cells", "cubature points", "dofs kept")
    return Table("Table 4: sizes", heads, rows, names=True)


def shares(study: Comparison, known: Mapping[str, Any]) -> Table:
    """Table 4, CPU seconds by kind of work, training and largest error; below every model the paper's figures."""
    rows = []
    for record in [record for record in table_4(study) if record.status == "done"]:
        seconds = (record.force_s, record.solve_s, record.product_s, record.cpu_s)
        found, trained = join(record.snnls_s.values(), ".2g"), clock(record.training_s)
        rows.append((record.name, *map(clock, seconds), found, trained, tell(record.coordinates_error)))
        if paper := known.get(record.name):
            published_seconds = (str(paper.get(key, "")) for key in ("force_s", "solve_s", "product_s", "total_s"))
            error = f"{paper['max_error']:.2e}" if "max_error" in paper else ""
            rows.append((PAPER, *published_seconds, join(paper.get("snnls_s", ())), "", error))
    heads = ("model", "force+tangent", "solves", "products", "total", "sNNLS", "training", "max error (53)")
    return Table("Table 4: CPU time [s]", heads, rows, names=True)


def accuracy(study: Comparison) -> Table:
    """Errors of all kinds beside Newton's tolerance and what is left of the joints."""
    rows = []
    for record in [record for record in study.records if record.status == "done" and record.family != "full"]:
        published = (record.coordinates_error, record.coordinates_mean)
        errors = (
            record.max_error,
            record.median_error,
            record.mean_error,
            record.distance_error,
            record.position_error,
            *published,
        )
        sizes = (str(record.constraints), f"{record.newton:.0e}", str(record.iterations), str(record.factorisations))
        rows.append((record.name, *map(tell, errors), *sizes))
    if study.time_error:
        times = study.time_error
        rows.append((f"step {times.step:g} s", tell(times.relative), "", "", tell(times.distance), tell(times.position), *[""] * 6))
    columns = ("model", "max error", "median", "mean", "RMS [m]", "position [m]", "(53)", "(48)")
    heads = (*columns, "constraints", "Newton", "iterations", "factors")
    return Table("Errors against the full model, and of its own step", heads, rows, names=True)


def output_errors(found: Mapping[str, Mapping[str, Any]]) -> list[Table]:
    """Largest error of every output column of one model, in its unit and as a part of its range; nothing without outputs."""
    from ..results import sweep_files

    rows = [
        (sweep_files.add_unit(column, one["unit"]), part(one["error"]), f"{one['range']:.3g}", part(one["relative"]))
        for column, one in found.items()
    ]
    heads = ("output", "largest error", "range", "part of the range")
    return [Table("Errors of the outputs", heads, rows, names=True)] if rows else []


def errors_of_outputs(study: Comparison) -> list[Table]:
    """Largest errors of all output columns, and those as parts of their ranges, with a column a model."""
    from ..results import sweep_files

    found = {record.name: {name: asdict(one) for name, one in record.outputs.items()} for record in main(study) if record.outputs}
    if not found:
        return []
    first = next(iter(found.values()))
    titles = {"error": "Largest errors of the outputs", "relative": "Largest errors of the outputs as parts of their ranges"}
    shown = []
    for key, title in titles.items():
        rows = [
            (
                sweep_files.add_unit(name, one["unit"]),
                f"{one['range']:.3g}",
                *(part(columns[name][key]) for columns in found.values()),
            )
            for name, one in first.items()
        ]
        shown.append(Table(title, ("output", "range", *found), rows, names=True))
    return shown


def part(error: float | None) -> str:
    """An error; nothing where it is unknown or has no range to refer to."""
    return "-" if error is None or not math.isfinite(error) else f"{error:.2e}"


def clock(seconds: float) -> str:
    return f"{seconds:.3g}" if math.isfinite(seconds) and seconds > 0 else ""


def counts(values: Mapping[str, int]) -> str:
    """Sizes by component; nothing where none is evaluated."""
    return join(values.values()) if any(values.values()) else ""


def main(study: Comparison) -> list[ModelRecord]:
    """The reduced models of the scene's own eps and eta."""
    return [record for record in study.records if record.main and record.modes]


def overview(study: Comparison) -> Table:
    """Time beside error, without the other eps and eta (they are in the figure and in the JSON object)."""
    rows = []
    full = study["full"].cpu_s
    for record in study.records:
        if not record.main and record.family not in ("full", "coarse", "step"):
            continue
        if record.status != "done":
            rows.append((record.name, record.dofs or "none", *[""] * 6))
            continue
        pays = "" if record.pays_after_runs is None else str(math.ceil(record.pays_after_runs))
        error = (tell(record.max_error), tell(record.mean_error), tell(record.position_error))
        rows.append((record.name, record.dofs, f"{record.cpu_s:.3g}", f"{full / record.cpu_s:.1f}", *error, pays))
    columns = ("model", "dofs", "CPU [s]", "speed-up", "max error", "mean error", "position error [m]", "pays after runs")
    return Table("Time beside error", columns, rows, names=True)


def tell(error: float) -> str:
    return f"{error:.2e}" if error else "reference"


def products(study: Comparison, known: Mapping[str, Any]) -> Table:
    """Table 1: scalar multiplications in the reduced tangent."""
    rows = []
    for record in main(study):
        paper = known.get(record.name, {})
        pairs = (
            (join(record.modes.values()), join(paper.get("r", ()))),
            (join((record.kept or record.elements).values()), join(paper.get("elements", ()))),
            (join(record.dofs_kept.values()), join(paper.get("dofs", ()))),
            (str(record.bandwidth), str(paper.get("w", ""))),
            (f"{1e-6 * record.multiplications:.3f}", f"{1e-6 * paper['p']:.3f}" if paper else ""),
            (f"{record.speed_up:.2f}", f"{paper['s']:.2f}" if paper else ""),
        )
        rows.append((record.name, *pick(pairs, known)))
    heads = head_columns(("r modes", "kept", "dofs", "w", "p [1e6]", "s"), known)
    return Table("Table 1: scalar multiplications for the reduced tangent K_r", ("model", *heads), rows, names=True)


def tangents(study: Comparison, known: Mapping[str, Any]) -> Table:
    """Table 2: CPU time of the reduced tangent."""
    first, rows = study["system"].kr_us, []
    for record in main(study):
        paper = known.get(record.name, {})
        pairs = (
            (f"{1e-6 * record.kr_us:.3e}", f"{paper['kr_s']:.3e}" if paper else ""),
            (f"{first / record.kr_us:.2f}" if record.kr_us else "", f"{paper['kr_ratio']:.2f}" if paper else ""),
        )
        rows.append((record.name, *pick(pairs, known)))
    return Table("Table 2: time of one reduced tangent", ("model", *head_columns(("K_r [s]", "ratio"), known)), rows, names=True)


def searches(study: Comparison, known: Mapping[str, Any]) -> Table:
    """Table 3: CPU time of the sparse non-negative least squares, and of the whole training."""
    trained = [record for record in main(study) if record.snnls_s]
    first, rows = sum(trained[0].snnls_s.values()), []
    for record in trained:
        paper, own = known.get(record.name, {}), list(record.snnls_s.values())
        total = f"={sum(own):.3g}" if len(own) > 1 else ""
        published_total = f"={sum(paper['snnls_s']):.4g}" if len(paper.get("snnls_s", ())) > 1 else ""
        pairs = (
            (join(own, ".2g") + total, join(paper.get("snnls_s", ())) + published_total),
            (f"{first / sum(own):.2f}", f"{paper['snnls_ratio']:.2f}" if paper else ""),
        )
        rows.append((record.name, *pick(pairs, known), f"{record.training_s:.3g}"))
    heads = head_columns(("sNNLS [s]", "ratio"), known)
    return Table(
        "Table 3: time of the sparse non-negative least squares", ("model", *heads, "whole training [s]"), rows, names=True
    )


def join(values: Any, form: str = "") -> str:
    return "+".join(format(value, form) for value in values)


def head_columns(names: Sequence[str], known: Mapping[str, Any]) -> list[str]:
    """Every heading, followed by that of the paper's column where there is one."""
    return [text for name in names for text in ((name, "paper") if known else (name,))]


def pick(pairs: Sequence[tuple[str, str]], known: Mapping[str, Any]) -> list[str]:
    return [text for pair in pairs for text in (pair if known else pair[:1])]
