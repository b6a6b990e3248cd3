"""Tables of models beside a full one, and of errors of outputs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from ..core.values.display import DisplayUnits, largest_of
from ..core.values.units import add_unit
from . import kinds
from .result import ReportTable

if TYPE_CHECKING:
    from ..reduction.accuracy.comparison import Comparison, ModelRecord


def compared(study: Comparison, display: DisplayUnits) -> list[ReportTable | str]:
    """Time beside error, errors of all outputs, and what went wrong."""
    shown: list[ReportTable | str] = [overview(study, display), *errors_of_outputs(study, display)]
    shown += [
        f"{record.name}: {record.status}" for record in study.records if record.status != "done"
    ]
    if finer := [
        record.name for record in study.records if record.finer and record.status == "done"
    ]:
        shown.append(
            f"({', '.join(finer)}): finer than the full model; what they differ by is the error of that"
        )
    return shown


def excitation(facts: Mapping[str, Any]) -> list[str]:
    """What the inputs of a plant have in a comparison."""
    return [
        f"All models move under {kinds.signals(facts)}; so do the runs that reduced models are trained on."
    ]


def errors_of_outputs(study: Comparison, display: DisplayUnits) -> list[ReportTable]:
    """Largest errors of all output columns, and those as parts of their ranges, with a column a
    model.
    """

    found = {
        record.name: {name: asdict(one) for name, one in record.outputs.items()}
        for record in main(study)
        if record.outputs
    }
    if not found:
        return []
    first = next(iter(found.values()))
    titles = {
        "error": "Largest errors of the outputs",
        "relative": "Largest errors of the outputs as parts of their ranges",
    }
    shown = []
    for key, title in titles.items():
        rows = []
        for name, one in first.items():
            head, size = display.head(add_unit(name, one["unit"]), [one["range"]])
            errors = (
                kinds.part(columns[name][key], size if key == "error" else 1.0)
                for columns in found.values()
            )
            rows.append((head, f"{one['range'] / size:.3g}", *errors))
        shown.append(ReportTable(title, ("output", "range", *found), rows, names=True))
    return shown


def length_unit(study: Comparison, display: DisplayUnits) -> tuple[str, float]:
    """The unit of distances from the full model, of many orders: one that was typed, or metres."""
    found = [record.position_error for record in study.records if record.status == "done"]
    return display.find("m", largest_of(found), prefixes=False)


def main(study: Comparison) -> list[ModelRecord]:
    """The reduced models of the scene's own eps and eta."""
    return [record for record in study.records if record.main and record.modes]


def overview(study: Comparison, display: DisplayUnits) -> ReportTable:
    """Time beside error, without the other eps and eta (they are in the figure and in the JSON
    object).
    """
    rows = []
    (unit, size) = length_unit(study, display)
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
        rows.append(
            (
                record.name,
                record.dofs,
                f"{record.cpu_s:.3g}",
                f"{full / record.cpu_s:.1f}",
                *distances,
                pays,
            )
        )
    columns = (
        "model",
        "dofs",
        "CPU [s]",
        "speed-up",
        "max error",
        "mean error",
        f"position error [{unit}]",
        "pays after runs",
    )
    return ReportTable("Time beside error", columns, rows, names=True)


def tell(error: float, finer: bool = False) -> str:
    """An error; what a finer model differs by is that of the reference, and stands in brackets."""
    text = f"{error:.2e}" if error else "reference"
    return f"({text})" if finer else text
