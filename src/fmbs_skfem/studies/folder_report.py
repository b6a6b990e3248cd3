"""One page of HTML of a folder of results: what was solved, how to repeat it, warnings, plots,
tables, pictures, provenance.

A report is a view of the files in a folder: of every JSON file that a study wrote, of its columns
(CSV) and its pictures.
"""

from __future__ import annotations

import csv
import math
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..core.errors import FmbsError, InputError, say
from ..core.notices import Notice
from ..core.storage import durable
from ..core.values.display import KEY, SI, DisplayUnits
from ..core.values.units import add_unit
from ..pages import content, report, writing
from ..pages.writing import Page
from ..reduction import files
from ..results.plots import Panel
from . import kinds, models, reports
from .job import MODELS, Job
from .result import ReportTable, Result
from .running import viewing, webpages
from .running.outcome import OUTPUTS, UNITS

NAME = "report.html"
#: shown in sections of their own
APART = (
    "provenance",
    "notices",
    "files",
    "units",
    "labels",
    "round_off",
    "parameter_units",
    KEY,
    "fingerprint",
    reports.CHECKSUMS,
)
LARGEST = 8_000_000  #: of a picture that is put in [bytes]
#: record of a study -> the command that makes it; `report.json` is of several
COMMANDS = {
    "compare.json": "compare",
    "check.json": "check",
    "verification.json": "verify",
    "info.json": "rom info",
}


def write(job: Job, html: Path | None, bodies: bool, instants: int) -> Result:
    """The report of a folder as a page; one that exists is kept without --force."""
    folder = job.path
    if not folder.is_dir():
        raise InputError(
            say(f"{folder}", "a folder of results", "none", "run a scene first: fmbs run SCENE")
        )
    path = html or folder / NAME
    if path.exists() and not job.force:
        raise InputError(
            say(
                f"--html {path}", "a new file", "one that exists", "choose another name, or --force"
            )
        )
    reports.verify_checksums(folder)
    records = {
        one.name: found
        for one in sorted(folder.glob("*.json"))
        if (found := reports.read_record(one)) is not None
    }
    saved, made = models_of(folder)
    if not records and not saved:
        raise InputError(
            say(
                f"{folder}",
                "a folder with results of fmbs",
                "no report in it",
                "name the folder of --out",
            )
        )
    display = next((DisplayUnits.of(one) for one in records.values() if KEY in one), SI)
    title = next(
        (str(one[key]) for one in records.values() for key in ("scene", "name") if one.get(key)),
        folder.resolve().name,
    )
    told, block = scene_of(job, folder, title, records, instants) if bodies else (None, None)
    if told is None or block is None:
        told, block = plots_of(folder, title, display)
    root = path.parent.absolute()
    records, made = named_from(root, records), named_from(root, made)
    body = "\n".join(sections(folder, records, saved, made, display))
    durable.write(path, writing.text(Page(title, told, block, body)).encode())
    size = path.stat().st_size
    shown = {
        "status": "ok",
        "source": folder,
        "records": list(records),
        "files": [path],
        "bytes": size,
        "notices": job.notices,
    }
    return Result(
        about=f"{title}: {path}", report=shown, lines=[f"written: {path} ({size / 1e6:.2g} MB)"]
    )


def models_of(folder: Path) -> tuple[dict[str, list[ReportTable]], dict[str, dict[str, Any]]]:
    """What the saved reduced models in a folder are, and how those were made that no record tells
    of, by their names.
    """
    found, made = {}, {}
    for path in sorted(one for one in folder.iterdir() if one.suffix in MODELS):
        try:
            if models.parametric(path):
                found[path.name] = models.views(models.describe_box(path))
                continue
            found[path.name] = models.views(models.describe_point(path))
            notes = files.read(path).notes
        except FmbsError:
            continue  # a file of another kind, such as the samples of a sweep
        made[path.name] = {
            **notes.get("report", {}),
            "parameters": notes.get("training"),
            "provenance": notes.get("provenance"),
        }
    return found, made


def scene_of(
    job: Job, folder: Path, title: str, records: Mapping[str, Any], instants: int
) -> tuple[Any, Any]:
    """The bodies of a motion, from its history or run again; nothing, with a warning, where neither
    can be.
    """
    if "end" not in records.get(reports.REPORT, {}):
        return None, None
    try:
        scene, task, trajectory = viewing.motion(job)
    except (FmbsError, OSError) as error:
        if isinstance(error, Notice):
            raise
        job.notices.append(f"{folder}: the bodies are not shown: {error}")
        job.listener.tell(f"warning: {job.notices[-1]}")
        return None, None
    film = webpages.film_of(title, trajectory, instants)
    shade, clock = webpages.look(scene, trajectory)
    return content.describe(
        title, [film], shade, clock, webpages.about(trajectory, task.remarks), task.display
    )


def plots_of(folder: Path, title: str, display: DisplayUnits) -> tuple[Any, Any]:
    """The columns of a run over time: those of one output and unit share a panel."""
    about = [f"fmbs_skfem {__version__}"]
    if not (folder / OUTPUTS).is_file():
        return content.describe_plots(title, np.zeros(0), [], "s", about, display)
    heads, rows = columns(folder / OUTPUTS)
    if not heads:
        raise reports.corrupt(folder / OUTPUTS, "a table with titles", "an empty file")
    units = read_units(folder)
    names = [head.partition(" [")[0] for head in heads]
    try:
        values = np.array(rows, dtype=float).reshape(len(rows), len(heads))
    except ValueError as problem:
        raise reports.corrupt(
            folder / OUTPUTS, "rows of numbers, one under each title", problem
        ) from problem
    grouped: dict[tuple[str, str], dict[str, np.ndarray]] = {}
    for name, column in zip(names[1:], values.T[1:], strict=True):
        output = name.rpartition("_")[0] or name
        grouped.setdefault((output, units.get(name, "")), {})[name] = column
    panels = [
        Panel(add_unit(next(iter(one)) if len(one) == 1 else output, unit), one)
        for (output, unit), one in grouped.items()
    ]
    clock = units.get("t", "s") or "load factor"
    return content.describe_plots(
        title, values[:, 0], panels if len(rows) > 1 else [], clock, about, display
    )


def read_units(folder: Path) -> dict[str, str]:
    """The units of columns; none where their file is not there."""
    path = folder / UNITS
    found = reports.read_json(path) if path.is_file() else {}
    reports.require_shape(path, found, {reports.ALL: str})
    return dict(found)


def columns(path: Path) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of a table; lines without any cell are left out."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            heads, *rows = [cells for cells in csv.reader(file) if cells] or [[]]
    except (UnicodeDecodeError, csv.Error, OSError) as problem:
        raise unread(path, "a table of text in UTF-8", problem, "save it in UTF-8") from problem
    return heads, rows


def beside(path: Path, display: DisplayUnits) -> str:
    """The section of a table other than that of the outputs, whoever has written it."""
    heads, rows = columns(path)
    for k, cells in enumerate(rows, start=1):
        if len(cells) != len(heads):
            expected = f"{len(heads)} cells in every row, as there are titles"
            raise unread(path, expected, f"{len(cells)} in row {k}", "mend it")
    numbers = [[number(text) for text in cells] for cells in rows]
    return report.section(path.name, report.table("", *display.columns(heads, numbers)))


def unread(path: Path, expected: str, got: object, remedy: str) -> InputError:
    """A table in the folder that is none."""
    return InputError(say(f"{path}", expected, got, f"{remedy}, or move it out of the folder"))


def sections(
    folder: Path,
    records: Mapping[str, Any],
    saved: Mapping[str, list[ReportTable]],
    made: Mapping[str, Any],
    display: DisplayUnits,
) -> Iterator[str]:
    """The page below the bodies and plots, the most wanted first."""
    yield report.section(
        "Warnings",
        report.notices([text for one in records.values() for text in one.get("notices", [])]),
    )
    origins = {**records, **made}
    calls = dict[str, None]()
    for name, one in origins.items():
        with reports.reading(folder / name):
            calls[repeat(name, one)] = None
    yield report.section("How to repeat it", *map(report.code, filter(None, calls)))
    for name, one in records.items():
        with reports.reading(folder / name):
            told = solved(name, one, display)
        yield told
    for name, tables in saved.items():
        yield report.section(
            name, *(report.table(one.title, one.columns, one.rows) for one in tables)
        )
    yield report.section("Pictures", *pictures(folder))
    for path in sorted(folder.glob("*.csv")):
        if path.name != OUTPUTS:
            yield beside(path, display)
    for name, one in origins.items():
        with reports.reading(folder / name):
            told = report.section(f"Provenance of {name}", *origin(one))
        yield told


def named_from(root: Path, records: Mapping[str, Any]) -> dict[str, Any]:
    """Records for whoever gets the page, and has other folders: files that they name are named from
    the folder `root` of the page.

    They also stand in warnings, with the folders that were typed.
    """
    places = {text: reports.name_from(root, text) for text in absolute_in(records)}
    longest = sorted(places, key=len, reverse=True)

    def named(value: Any) -> Any:
        if isinstance(value, str):
            for text in longest:
                value = value.replace(text, places[text])
            return value
        if isinstance(value, Mapping):
            return {named(key): named(one) for key, one in value.items()}
        return [named(one) for one in value] if isinstance(value, list | tuple) else value

    return {name: named(one) for name, one in records.items()}


def absolute_in(value: Any) -> set[str]:
    """The absolute paths among the texts of a record."""
    if isinstance(value, str):
        return {value} if Path(value).is_absolute() else set()
    inside = (
        [*value, *value.values()]
        if isinstance(value, Mapping)
        else value
        if isinstance(value, list | tuple)
        else ()
    )
    return {text for one in inside for text in absolute_in(one)}


def parameters_of(one: Mapping[str, Any], display: DisplayUnits) -> dict[str, Any]:
    """The parameters of a record as they are read, with their units, where these are known; nothing
    of other records.
    """
    units = one.get("parameter_units") or {}
    return (
        {
            "parameters": {
                name: display.quantity(one["parameters"][name], unit)
                for name, unit in units.items()
            }
        }
        if units
        else {}
    )


def solved(name: str, one: Mapping[str, Any], display: DisplayUnits) -> str:
    """The section of a record: its facts, and results of all kinds as they are read."""
    heading = "What was solved" if name == reports.REPORT else name
    shown = {key: value for key, value in one.items() if key not in (*APART, *kinds.KINDS)}
    shown.pop("outputs" if "output_columns" in one else "", None)
    views = [
        report.text(view)
        if isinstance(view, str)
        else report.table(view.title, view.columns, view.rows)
        for view in kinds.views(one, display)
    ]
    return report.section(heading, report.facts("", shown | parameters_of(one, display)), *views)


def number(text: str) -> object:
    """A number of a table where it is one."""
    try:
        value = float(text)
    except ValueError:
        return text
    return value if math.isfinite(value) else text


def pictures(folder: Path) -> Iterator[str]:
    """Every picture of the folder, unless it is too large."""
    for path in sorted(folder.iterdir()):
        if path.suffix in report.KINDS and path.stat().st_size <= LARGEST:
            yield report.picture(path.name, path.suffix, path.read_bytes())


def origin(one: Mapping[str, Any]) -> Iterator[str]:
    """What the numbers of a record depend on, and its files."""
    found = dict(one.get("provenance") or {})
    scene = found.pop("scene", None)
    files = found.pop("files", None) or {}
    yield report.facts("", found)
    yield report.table("files that were read", ("file", "sha256"), list(files.items()))
    yield report.table(
        "files that were written",
        ("file", "sha256"),
        list((one.get(reports.CHECKSUMS) or {}).items()),
    )
    if scene is not None:
        yield report.hidden("the scene with all values", reports.dumps(scene))


def command_of(name: str, one: Mapping[str, Any]) -> str:
    """The command that makes a record, or a file of a model."""
    if Path(name).suffix in MODELS:
        return "reduce"
    return COMMANDS.get(name) or (
        "rom run" if one.get("model") else "train" if "candidates" in one else "run"
    )


def repeat(name: str, one: Mapping[str, Any]) -> str:
    """The command that makes a record again; empty where it does not say of what it is, and for
    samples, which stand in a table.
    """
    origin = one.get("provenance") or {}
    source = one.get("model") or one.get("file") or origin.get("file")
    command = command_of(name, one)
    if command == "verify":
        return "fmbs verify"
    if not source or "members" in one:
        return ""
    words = [
        "fmbs",
        *command.split(),
        str(source),
        *(["--quick"] if one.get("quick") else []),
        *(["--true"] if one.get("truth") else []),
    ]
    if command != "train":
        values = {
            key: value
            for key, value in (one.get("parameters") or {}).items()
            if isinstance(value, int | float)
        }
        words += [part for key, value in values.items() for part in ("--set", f"{key}={value!r}")]
    duration = (
        one.get("end")
        if one.get("model")
        else ((origin.get("scene") or {}).get("analysis") or {}).get("duration")
    )
    if duration and name == reports.REPORT and command != "train":
        words += ["--duration", repr(duration)]
    if isinstance(plan := one.get("accuracy"), Mapping) and "wanted" in plan:
        words += ["--accuracy", plan["wanted"].replace(" of the range", "").replace(": ", "=")]
    elif command == "train" and isinstance(wanted := one.get("tolerance"), float):
        words += ["--tolerance", repr(wanted)]
    elif command == "reduce":
        options = {"--tolerance": one.get("tolerance"), "--hyper": one.get("hyper_tolerance")}
        words += [part for key, value in options.items() if value for part in (key, repr(value))]
    return shlex.join(words)
