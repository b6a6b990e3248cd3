"""Tables of `fmbs compare`, in the layout of those of doi 10.1016/j.cma.2019.112690, with the published figures beside ours."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any, NamedTuple

from ..core.values.display import DisplayUnits, largest_of
from ..core.values.units import add_unit
from . import reports
from .result import ReportTable

if TYPE_CHECKING:
    from ..reduction.accuracy.comparison import Comparison, ModelRecord
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
        shown: list[Any] = [below("Table 4: sizes", table_4(study), SIZES, known)]
        done = [record for record in table_4(study) if record.status == "done"]
        shown += [below("Table 4: CPU time [s]", done, SHARES, known), accuracy(study, scene.display)]
    else:
        counted = beside("Table 1: scalar multiplications for the reduced tangent K_r", main(study), PRODUCTS, known)
        shown = [overview(study, scene.display), counted, tangents(study, known)]
        if trained := [record for record in main(study) if record.snnls_s]:
            shown.append(searches(trained, known))
    shown += errors_of_outputs(study, scene.display)
    shown += [f"{record.name}: {record.status}" for record in study.records if record.status != "done"]
    if finer := [record.name for record in study.records if record.finer and record.status == "done"]:
        shown.append(f"({', '.join(finer)}): finer than the full model; what they differ by is the error of that")
    return [*shown, origin_of(paper, study)] if paper else shown


def origin_of(paper: Mapping[str, Any], study: Comparison) -> str:
    """Where published figures are from, and in what models and machine differ here."""
    theirs = {name: sum(one["dofs"]) for name, one in paper["models"].items() if name in ("full", "system")}
    ours, size = study["full"].dofs, next(iter(theirs.values()))
    scene = f"{ours} coordinates in the full model" + (f", {size} there" if size != ours else ", as there")
    return f"paper: {paper['source']}; here: {scene}, compiled Python on {reports.processor()}"


class Column(NamedTuple):
    """A column of a table of models."""

    head: str
    ours: Callable[[ModelRecord], object]
    paper: Callable[[Mapping[str, Any]], str] | None = None  #: the same of the published figures of a model


def figure(key: str, form: str = "", scale: float = 1) -> Callable[[Mapping[str, Any]], str]:
    """What reads a published figure, one or a list; nothing where there is none."""

    def read(paper: Mapping[str, Any]) -> str:
        found = paper.get(key, ())
        return join((scale * value for value in (found if isinstance(found, list | tuple) else [found])), form)

    return read


def beside(title: str, records: Sequence[ModelRecord], columns: Sequence[Column], known: Mapping[str, Any]) -> ReportTable:
    """A row a model; published figures, where there are any, in a column beside ours."""
    heads, rows = ["model"], [[record.name] for record in records]
    for column in columns:
        heads += [column.head, *(["paper"] if known and column.paper else [])]
        for row, record in zip(rows, records, strict=True):
            row.append(str(column.ours(record)))
            row += [column.paper(known.get(record.name, {}))] if known and column.paper else []
    return ReportTable(title, heads, rows, names=True)


def below(title: str, records: Sequence[ModelRecord], columns: Sequence[Column], known: Mapping[str, Any]) -> ReportTable:
    """A row a model, below it the published figures."""
    rows = []
    for record in records:
        rows.append([record.name, *(column.ours(record) for column in columns)])
        if paper := known.get(record.name):
            rows.append([PAPER, *(column.paper(paper) if column.paper else "" for column in columns)])
    return ReportTable(title, ["model", *(column.head for column in columns)], rows, names=True)


def table_4(study: Comparison) -> list[ModelRecord]:
    """The models of Table 4: the full one, its other steps, and the reduced ones of the scene's eps and eta."""
    return [record for record in study.records if record.main or record.family in ("full", "step")]


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
    Column("max error (53)", lambda record: tell(record.coordinates_error, record.finer), figure("max_error", ".2e")),
)
PRODUCTS = (
    Column("r modes", lambda record: join(record.modes.values()), figure("r")),
    Column("kept", lambda record: join((record.kept or record.elements).values()), figure("elements")),
    Column("dofs", lambda record: join(record.dofs_kept.values()), figure("dofs")),
    Column("w", lambda record: record.bandwidth, figure("w")),
    Column("p [1e6]", lambda record: f"{1e-6 * record.multiplications:.3f}", figure("p", ".3f", 1e-6)),
    Column("s", lambda record: f"{record.speed_up:.2f}", figure("s", ".2f")),
)


def accuracy(study: Comparison, display: DisplayUnits) -> ReportTable:
    """Errors of all kinds beside Newton's tolerance and what is left of the joints."""
    rows, (unit, size) = [], length_unit(study, display)
    for record in [record for record in study.records if record.status == "done" and record.family != "full"]:
        published = (record.coordinates_error, record.coordinates_mean)
        lengths = (record.distance_error / size, record.position_error / size)
        errors = (record.max_error, record.median_error, record.mean_error, *lengths)
        distances = (tell(value, record.finer) for value in (*errors, *published))
        sizes = (str(record.constraints), f"{record.newton:.0e}", str(record.iterations), str(record.factorisations))
        rows.append((record.name, *distances, *sizes))
    if study.time_error:
        times = study.time_error
        rows.append(
            (
                f"step {times.step:g} s",
                tell(times.relative),
                "",
                "",
                tell(times.distance / size),
                tell(times.position / size),
                *[""] * 6,
            )
        )
    columns = ("model", "max error", "median", "mean", f"RMS [{unit}]", f"position [{unit}]", "(53)", "(48)")
    heads = (*columns, "constraints", "Newton", "iterations", "factors")
    return ReportTable("Errors against the full model, and of its own step", heads, rows, names=True)


def output_errors(found: Mapping[str, Mapping[str, Any]], display: DisplayUnits) -> list[ReportTable]:
    """Largest error of every output column of one model, in its unit and as a part of its range; nothing without outputs."""
    rows = []
    for column, one in found.items():
        head, size = display.head(add_unit(column, one["unit"]), [one["range"]])
        rows.append((head, part(one["error"], size), f"{one['range'] / size:.3g}", part(one["relative"])))
    heads = ("output", "largest error", "range", "part of the range")
    return [ReportTable("Errors of the outputs", heads, rows, names=True)] if rows else []


def training_signals(facts: Mapping[str, Any]) -> list[ReportTable | str]:
    """How the inputs of a plant were excited in its training, and that its errors are those under other signals."""
    where = f"trained on {facts['runs']} runs" if "runs" in facts else "trained at every point on a run"
    return [f"{where} with {signals(facts)}; errors are those under a random signal that it was not trained on"]


def excitation(facts: Mapping[str, Any]) -> list[str]:
    """What the inputs of a plant have in a comparison."""
    return [f"All models move under {signals(facts)}; so do the runs that reduced models are trained on."]


def signals(facts: Mapping[str, Any]) -> str:
    """Signals, ranges and frequencies in words."""
    ranges = [f"{name} from {low:g} to {high:g}" for name, (low, high) in facts["ranges"].items()]
    band = f"from {facts['slowest']:.3g} to {facts['fastest']:.3g} Hz (seed {facts['seed']})"
    return f"chirps, steps and noise in {', '.join(ranges)} [SI], {band}"


def left_out(found: Mapping[str, str]) -> list[ReportTable]:
    """Constraint equations that a reduced model leaves out, and what that does; nothing where there are none."""
    rows = [(name, why) for name, why in found.items()]
    return [ReportTable("Equations left out", ("equation", "what that does"), rows)] if rows else []


def errors_of_outputs(study: Comparison, display: DisplayUnits) -> list[ReportTable]:
    """Largest errors of all output columns, and those as parts of their ranges, with a column a model."""

    found = {record.name: {name: asdict(one) for name, one in record.outputs.items()} for record in main(study) if record.outputs}
    if not found:
        return []
    first = next(iter(found.values()))
    titles = {"error": "Largest errors of the outputs", "relative": "Largest errors of the outputs as parts of their ranges"}
    shown = []
    for key, title in titles.items():
        rows = []
        for name, one in first.items():
            head, size = display.head(add_unit(name, one["unit"]), [one["range"]])
            errors = (part(columns[name][key], size if key == "error" else 1.0) for columns in found.values())
            rows.append((head, f"{one['range'] / size:.3g}", *errors))
        shown.append(ReportTable(title, ("output", "range", *found), rows, names=True))
    return shown


def part(error: float | None, size: float = 1.0) -> str:
    """An error in a unit of some size; nothing where it is unknown or has no range to refer to."""
    return "-" if error is None or not math.isfinite(error) else f"{error / size:.2e}"


def length_unit(study: Comparison, display: DisplayUnits) -> tuple[str, float]:
    """The unit of distances from the full model, of many orders: one that was typed, or metres."""
    found = [record.position_error for record in study.records if record.status == "done"]
    return display.find("m", largest_of(found), prefixes=False)


def clock(seconds: float) -> str:
    return f"{seconds:.3g}" if math.isfinite(seconds) and seconds > 0 else ""


def counts(values: Mapping[str, int]) -> str:
    """Sizes by component; nothing where none is evaluated."""
    return join(values.values()) if any(values.values()) else ""


def main(study: Comparison) -> list[ModelRecord]:
    """The reduced models of the scene's own eps and eta."""
    return [record for record in study.records if record.main and record.modes]


def overview(study: Comparison, display: DisplayUnits) -> ReportTable:
    """Time beside error, without the other eps and eta (they are in the figure and in the JSON object)."""
    rows, (unit, size) = [], length_unit(study, display)
    full = study["full"].cpu_s
    for record in study.records:
        if not record.main and record.family not in ("full", "coarse", "step"):
            continue
        if record.status != "done":
            rows.append((record.name, record.dofs or "none", *[""] * 6))
            continue
        pays = "" if record.pays_after_runs is None else str(math.ceil(record.pays_after_runs))
        errors = record.max_error, record.mean_error, record.position_error / size
        distances = (tell(value, record.finer) for value in errors)
        rows.append((record.name, record.dofs, f"{record.cpu_s:.3g}", f"{full / record.cpu_s:.1f}", *distances, pays))
    columns = ("model", "dofs", "CPU [s]", "speed-up", "max error", "mean error", f"position error [{unit}]", "pays after runs")
    return ReportTable("Time beside error", columns, rows, names=True)


def tell(error: float, finer: bool = False) -> str:
    """An error; what a finer model differs by is that of the reference, and stands in brackets."""
    text = f"{error:.2e}" if error else "reference"
    return f"({text})" if finer else text


def tangents(study: Comparison, known: Mapping[str, Any]) -> ReportTable:
    """Table 2: CPU time of the reduced tangent."""
    first = study["system"].kr_us
    columns = (
        Column("K_r [s]", lambda record: f"{1e-6 * record.kr_us:.3e}", figure("kr_s", ".3e")),
        Column("ratio", lambda record: f"{first / record.kr_us:.2f}" if record.kr_us else "", figure("kr_ratio", ".2f")),
    )
    return beside("Table 2: time of one reduced tangent", main(study), columns, known)


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
        Column("ratio", lambda record: f"{first / sum(record.snnls_s.values()):.2f}", figure("snnls_ratio", ".2f")),
        Column("whole training [s]", lambda record: f"{record.training_s:.3g}"),
    )
    return beside("Table 3: time of the sparse non-negative least squares", trained, columns, known)


def join(values: Iterable[Any], form: str = "") -> str:
    return "+".join(format(value, form) for value in values)
