"""What a study found: numbers as arrays, the JSON object of its report, tables and sentences for
people, figures.

Work that fails all the same has results so far: the error that is raised carries them as
`error.result`.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

from ..core import extras
from ..core.errors import FmbsError, SolverError, Warned
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.problems import printable
from . import text_tables

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 132  #: characters of a line where there is no terminal
REASONS = {
    3: "bad input",
    4: "no reduced model",
    5: "failed samples",
    6: "limit reached",
    7: "missing feature",
    8: "corrupt file",
    129: "terminal closed",
    130: "interrupted",
    143: "terminated",
}


@dataclass(frozen=True)
class ReportTable:
    """A table whose first column is text and whose other columns are numbers; `names`: the first
    column is never wrapped.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]
    names: bool = False

    def __str__(self) -> str:
        return self.text(WIDTH).rstrip()

    def print(self, file: TextIO) -> None:
        """Write the table, in the letters that the file takes."""
        text = self.text(width_of(file), getattr(file, "encoding", None) or "utf-8")
        if file.isatty() and os.environ.get("TERM") != "dumb":
            text = "\x1b[1m" + text.replace("\n", "\x1b[0m\n", 1)
        file.write(text)

    def text(self, width: int, encoding: str = "utf-8") -> str:
        """The table in lines of at most `width` characters; letters that an encoding has not are
        written out.
        """

        def shown(value: object) -> str:
            return (
                printable(format_value(value)).encode(encoding, "backslashreplace").decode(encoding)
            )

        rows = [[shown(value) for value in row] for row in self.rows]
        rule = "─" if shown("─") == "─" else "-"
        lines = text_tables.draw(
            shown(self.title), list(map(shown, self.columns)), rows, width, self.names, rule
        )
        return "\n".join([*lines, ""])

    @property
    def markdown(self) -> str:
        """The rows as a table of Markdown, without the title."""
        lines = [
            self.columns,
            *([format_value(value).replace("|", "\\|") for value in row] for row in self.rows),
        ]
        head, *rest = (f"| {' | '.join(cells)} |" for cells in lines)
        return "\n".join([head, "|" + "---|" * len(self.columns), *rest]) + "\n"

    @property
    def html(self) -> str:
        """The same for notebooks."""
        head = "".join(f"<th>{escape(text)}</th>" for text in self.columns)
        rows = "".join(
            f"<tr>{''.join(f'<td>{escape(format_value(value))}</td>' for value in row)}</tr>"
            for row in self.rows
        )
        return f"<table><caption>{escape(self.title)}</caption><tr>{head}</tr>{rows}</table>"


def width_of(file: TextIO) -> int:
    """Characters of a line: those of a terminal; of the house's lines where there is none."""
    return shutil.get_terminal_size().columns if file.isatty() else WIDTH


def format_value(value: object) -> str:
    """A value of a table: numbers with six digits, zero without its sign, entries by component as
    `I 24, II 23`, else a dash.
    """
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {format_value(item)}" for name, item in value.items()) or "-"
    if isinstance(value, list | tuple):
        return "; ".join(format_value(item) for item in value) or "-"
    return (
        "-" if value is None else f"{value + 0.0:.6g}" if isinstance(value, float) else str(value)
    )


class Figures(Mapping[str, "Figure"]):
    """Figures by name, each drawn when it is asked for."""

    def __init__(self, rules: Mapping[str, Callable[[], Figure]] | None = None) -> None:
        self.rules = dict(rules or {})

    def __getitem__(self, name: str) -> Figure:
        return self.rules[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self.rules)

    def __len__(self) -> int:
        return len(self.rules)

    def __repr__(self) -> str:
        return f"<Figures {', '.join(self) or '(none)'}>"

    def save(self, out: Path) -> list[Path]:
        """Write all of them into a folder, as NAME.png; none, with a notice, where nothing can be
        drawn.
        """
        from ..results import plots

        if len(self) and not extras.there("viz"):
            notify(f"no plots are drawn: they need {extras.install('viz')}")
            return []

        return [plots.save(self[name], out / f"{name}.png") for name in self]


@dataclass(frozen=True, repr=False, kw_only=True)
class Result:
    """The result of a study."""

    about: str  #: in a few words
    report: Mapping[str, Any]  #: what `fmbs ... --json` prints
    lines: Sequence[ReportTable | str] = ()  #: the same for people
    figures: Figures = field(default_factory=Figures)
    error: FmbsError | None = None  #: why this is not all that was wanted

    @property
    def files(self) -> list[Path]:
        """What was written."""
        return [Path(path) for path in self.report.get("files", ())]

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.about}>"

    def __str__(self) -> str:
        return "\n".join(map(str, self.lines))

    def _repr_html_(self) -> str:
        return "".join(
            line.html if isinstance(line, ReportTable) else f"<p>{escape(line)}</p>"
            for line in self.lines
        )


def frame(columns: Mapping[str, Any]) -> Any:
    """Columns by their heads, as a pandas DataFrame where pandas is installed, else as they are."""
    if importlib.util.find_spec("pandas") is None:
        return columns
    return importlib.import_module("pandas").DataFrame(columns)


Kind = TypeVar("Kind", bound=Result)


def conclude(found: Kind) -> Kind:
    """The result of a study; its error is raised and carries it."""
    if found.error is not None:
        found.error.result = found
        raise found.error
    return found


def list_files(report: Mapping[str, Any]) -> list[str]:
    """The line that lists the files of a report; none without files."""
    files = report.get("files")
    return ["written: " + ", ".join(map(str, files))] if files else []


def reason(error: FmbsError) -> str:
    """What kind of error, as one short text."""
    if isinstance(error, Warned):
        return "notice"
    return (
        error.reason.value
        if isinstance(error, SolverError)
        else REASONS.get(error.exit_code, "error")
    )


def describe_error(error: FmbsError | None) -> dict[str, Any]:
    """Keys of a report that say how the work ended; what a failed solve knows beyond its message."""
    if error is None:
        return {"status": "ok"}
    found: dict[str, Any] = {"status": "error", "reason": reason(error), "message": str(error)}
    if isinstance(error, SolverError):
        found |= {
            "time": error.time,
            "worst": [{"name": name, "residual": value} for name, value in error.worst],
        }
    return found
