"""Kinds of results: what a report holds under a key, and how people read it.

    @kind("events")
    def events(report, display): ...        tables and sentences of report["events"], an object of JSON

A study puts values into its report. What a terminal, a notebook and the page of a folder show of
them is made of the report alone, by the kinds that are declared here, in their order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from ..core.values.display import DisplayUnits, largest_of
from ..core.values.units import add_unit
from ..results.colour_scales import SILENT
from .result import ReportTable

Report: TypeAlias = Mapping[str, Any]
View: TypeAlias = ReportTable | str
Show: TypeAlias = Callable[[Report, DisplayUnits], Iterable[View]]

KINDS: dict[str, Show] = {}
#: of a value beside the largest of its column, below which it is shown as zero
DIGITS = float(np.finfo(np.float64).eps)
SHORT = 3  #: names of residuals and reactions that a table of a failure lists


def kind(key: str) -> Callable[[Show], Show]:
    """Register how a kind of result is read, by its key in reports."""

    def register(show: Show) -> Show:
        KINDS[key] = show
        return show

    return register


def views(report: Report, display: DisplayUnits) -> list[View]:
    """Tables and sentences of all kinds of results in a report."""
    return [
        view for key, show in KINDS.items() if report.get(key) for view in show(report, display)
    ]


def heading(units: Mapping[str, str], labels: Mapping[str, str], column: str) -> str:
    """`motor_torque: moment about z [N m]`."""
    label = labels.get(column)
    return add_unit(f"{column}: {label}" if label else column, units.get(column, ""))


@kind("events")
def events(report: Report, display: DisplayUnits) -> Iterable[View]:
    """When events happened, what they did, and the kinetic energy that they took."""
    rows = []
    for one in report["events"]:
        done = [f"releases {name}" for name in one["release"]]
        done += [
            f"locks {name}{apart(gap)}" for name, gap in zip(one["lock"], one["gaps"], strict=True)
        ]
        done += ["stops the run"] if one["stop"] else []
        rows.append((one["name"], one["time"], ", ".join(done), one["loss"]))
    yield ReportTable(
        "Events", *display.columns(("event", "time [s]", "what it does", "energy lost [J]"), rows)
    )


def apart(gap: Report) -> str:
    """How far apart the places of a joint are where it is locked; nothing where there is no second
    place.
    """
    parts = [(gap["distance"], "m"), (gap["angle"], "rad")]
    found = " and ".join(f"{value:.3g} {unit}" for value, unit in parts if value is not None)
    return f" {found} apart" if found else ""


@kind("equilibria")
def path(report: Report, display: DisplayUnits) -> Iterable[View]:
    """Whether equilibria are stable, in a line, and a table of what their path has passed."""
    states = report["equilibria"]
    judged = [one["stable"] for one in states if one["stable"] is not None]
    wrong = judged.count(False)
    count = (
        f"{len(judged)} of {len(states)} equilibria"
        if len(judged) < len(states)
        else "all equilibria"
    )
    if judged:
        yield f"stability (no negative pivots): {count} judged, {f'{wrong} unstable' if wrong else 'all stable'}"
    rows = []
    for one in report["crossings"]:
        pivots = " -> ".join("?" if number is None else str(number) for number in one["negative"])
        rows.append(
            (one["kind"], one["before"], one["after"], one["distance"], pivots, one["sign"])
        )
    if rows:
        heads = ("passed", "from", "to", "way [m]", "negative pivots", "known by")
        yield ReportTable("On the path", *display.columns(heads, rows))


@kind("crossings")
def crossings(report: Report, display: DisplayUnits) -> Iterable[View]:
    """Where frequencies of a Campbell diagram are a whole number of times its parameter."""
    if "equilibria" not in report:
        name = report["parameter"]
        heads = ("order", "mode", add_unit(name, report["unit"]), "frequency [Hz]")
        rows = [
            [str(one["order"]), one["mode"], one[name], one["frequency_hz"]]
            for one in report["crossings"]
        ]
        yield ReportTable("Crossings of orders", *display.columns(heads, rows))


def errors_of(report: Report) -> Mapping[str, float]:
    """Errors of outputs by column [SI]: those of an accuracy, or of the step where it was checked."""
    found = report.get("accuracy") or report.get("step_check") or {}
    return found.get("errors", {})


@kind("step_check")
def step_check(report: Report, display: DisplayUnits) -> Iterable[View]:
    """What the step makes wrong, by a run in half the steps."""
    found = report["step_check"]
    worst = found["largest"]
    text = f"by a run in steps of {found['step']:.4g} s"
    if worst is None:
        yield f"{text} no output moves"
    else:
        part = f"{100.0 * found['part']:.2g} % of its range"
        yield f"{text} the step makes {worst} wrong by {part}, and all else by less"


@kind("output_columns")
def outputs(report: Report, display: DisplayUnits) -> Iterable[View]:
    """Smallest, largest and last value of every column; zero where they are round-off, by
    themselves or beside others.

    Beside them stand errors, where a run was asked for an accuracy. Columns of one output and unit
    are read in the same one.
    """
    errors = errors_of(report)
    units = report["units"]
    silent = report["round_off"]
    rows = []
    for columns in report["output_columns"].values():
        for name in columns:
            ends = [finite(value) for value in report["outputs"][name].values()]
            alike = [
                value
                for one in columns
                if units[one] == units[name]
                for value in report["outputs"][one].values()
            ]
            head, size = display.head(heading(units, report["labels"], name), alike)
            least = math.inf if name in silent else DIGITS * largest_of(ends)
            shown = [as_read(value, size, least) for value in ends]
            error = [(math.nan if (e := errors.get(name)) is None else e) / size] if errors else []
            rows.append((head + SILENT * (name in silent), *shown, *error))
    yield ReportTable(
        "Outputs", ("output", "min", "max", "final", *(["+-"] if errors else [])), rows
    )


@kind("limit_cycle")
def limit_cycle(report: Report, display: DisplayUnits) -> Iterable[View]:
    """The self-excited motion in which a run ends."""
    found = report["limit_cycle"]
    size = display.quantity(float(f"{found['amplitude']:.4g}"), found["unit"])
    every, since = (f"{found[key]:.4g} s" for key in ("period", "since"))
    text = f"{found['column']} repeats every {every} with an amplitude of {size}"
    yield f"{text}; a limit cycle since t = {since}"


def finite(value: float | None) -> float | None:
    """A number; none where it is not finite, for which files have null: the balance of energy of an
    equilibrium.
    """
    return None if value is None or not math.isfinite(value) else value


def as_read(value: float | None, size: float, least: float) -> float | None:
    """A number in a unit of some size, zero where it is below the least that is told."""
    if value is None:
        return None
    return 0.0 if abs(value) < least else value / size


@kind("stress_errors")
def stress_errors(report: Report, display: DisplayUnits) -> Iterable[View]:
    """How far stresses are off by those recovered from cells around."""
    texts = [f"{name} {100.0 * part:.2g} %" for name, part in report["stress_errors"].items()]
    yield f"error of stresses by those of cells around, as a part of the stress there: {', '.join(texts)}"


@kind("training_signals")
def training_signals(report: Report, display: DisplayUnits) -> Iterable[View]:
    """How the inputs of a plant were excited in its training, and that its errors are those under
    other signals.
    """
    facts = report["training_signals"]
    where = (
        f"trained on {facts['runs']} runs" if "runs" in facts else "trained at every point on a run"
    )
    yield f"{where} with {signals(facts)}; errors are those under a random signal that it was not trained on"


def signals(facts: Report) -> str:
    """Signals, ranges and frequencies in words."""
    ranges = [f"{name} from {low:g} to {high:g}" for name, (low, high) in facts["ranges"].items()]
    band = f"from {facts['slowest']:.3g} to {facts['fastest']:.3g} Hz (seed {facts['seed']})"
    return f"chirps, steps and noise in {', '.join(ranges)} [SI], {band}"


@kind("left_out")
def left_out(report: Report, display: DisplayUnits) -> Iterable[View]:
    """Constraint equations that a reduced model leaves out, and what that does."""
    yield ReportTable(
        "Equations left out", ("equation", "what that does"), list(report["left_out"].items())
    )


@kind("output_errors")
def output_errors(report: Report, display: DisplayUnits) -> Iterable[View]:
    """Largest error of every output column of one model, in its unit and as a part of its range."""
    rows = []
    for column, one in report["output_errors"].items():
        head, size = display.head(add_unit(column, one["unit"]), [one["range"]])
        rows.append(
            (head, part(one["error"], size), f"{one['range'] / size:.3g}", part(one["relative"]))
        )
    yield ReportTable(
        "Errors of the outputs",
        ("output", "largest error", "range", "part of the range"),
        rows,
        names=True,
    )


def part(error: float | None, size: float = 1.0) -> str:
    """An error in a unit of some size; nothing where it is unknown or has no range to refer to."""
    return "-" if error is None or not math.isfinite(error) else f"{error / size:.2e}"


@kind("failure")
def failure(report: Report, display: DisplayUnits) -> Iterable[View]:
    """Why a solve ended: its facts, and causes with what to try."""
    facts = report["failure"]
    causes = [(cause["name"], cause["what"], cause["remedy"]) for cause in facts["causes"]]
    yield ReportTable("Failure", ("", "value"), facts_of_failure(facts))
    yield ReportTable("Likely causes", ("cause", "what", "try"), causes)


def facts_of_failure(facts: Report) -> Sequence[tuple[str, str]]:
    """The facts of a failure that fit into a table."""
    found = [("reason", facts["reason"]), (f"not reached [{facts['unit']}]", f"{facts['at']:.9g}")]
    if facts["good"] is not None:
        found.append((f"last good state [{facts['unit']}]", f"{facts['good']:.9g}"))
    if facts["step"] is not None:
        found.append(("step", str(facts["step"])))
    for name, label in (
        ("residuals", "worst residuals"),
        ("multipliers", "largest reactions"),
        ("null", "weakest direction"),
    ):
        if facts[name]:
            listed = [f"{one['name']}: {one['value']:.3g}" for one in facts[name][:SHORT]]
            found.append((label, ", ".join(listed)))
    for attempt in facts["attempts"][:1] + facts["attempts"][-1:]:
        course = " ".join(f"{value:.1e}" for value in attempt["residuals"][:5])
        found.append(
            (f"residuals with step {attempt['step']:.3g} s", f"{course} ({attempt['outcome']})")
        )
    return found
