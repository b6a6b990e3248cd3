"""Tables by name: straight lines or a smooth curve through points, constant before and behind them.

    torque: "Kp * (goal(t) - hinge.angle)"          Table("goal(t)", "rad", times, values)
    force: "-pull(stretch) - c * rate"              Table("pull", "N", stretches, forces, of="m")

A smooth one is the monotone cubic of Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300-304, doi 10.1137/0905021:
it overshoots nowhere. Files are texts of comma-separated numbers below a line of titles with their units, `time [ms], angle [deg]`.
"""

from __future__ import annotations

import contextlib
import csv
import io
import itertools
import re
from functools import cached_property
from pathlib import Path

import numpy as np

from ..errors import InputError, closest, listed, say
from ..storage.container import storable
from ..storage.records import dataclass
from . import quantities, units
from .inputs import Source
from .problems import Problem, shown

TITLE = re.compile(r"\s*(.*?)\s*(?:\[\s*([^\[\]]*?)\s*\])?\s*", re.DOTALL)  #: its unit, where it has one, is in the last brackets
#: a title that ends with a unit as in `F (kN)`, `F / kN`, `F in kN`, `F_kN`
UNBRACKETED = re.compile(r".*(?:\(\s*([^()]+?)\s*\)|(?:/|_|\bin\s)\s*(\S+?))\s*", re.DOTALL)
LARGEST = 50_000_000  #: size of a file [bytes]
TITLES = "a first line of titles, such as 'time [s], angle [deg]'"


@dataclass(frozen=True)
class Table(Source):
    """Points of a function; its name is how expressions call it, `goal` or, as a function of time, `goal(t)`.

    Beyond its points it is constant: motions that get there with an argument that is no time end with a warning, unless it is to
    `hold` the values at its ends.
    """

    times: tuple[float, ...] = ()  #: (s,) growing arguments
    values: tuple[float, ...] = ()  #: (s,)
    smooth: bool = False
    of: str = "s"  #: SI unit of its argument
    hold: bool = False

    def __post_init__(self) -> None:
        if not self.name.endswith("(t)"):
            object.__setattr__(self, "name", f"{self.name}(t)")
        points = np.array([self.times, self.values]) if len(self.times) == len(self.values) else np.full((2, 1), np.nan)
        if points.shape[1] < 2 or not np.isfinite(points).all():
            got = f"{len(self.times)} places and {len(self.values)} values"
            raise InputError(
                say(f"table '{self.name}'", "two points of finite numbers at least, a value for each time or place", got)
            )
        for k, (a, b) in enumerate(itertools.pairwise(self.times)):
            if b <= a:
                got = f"{b:g} {self.of} as point {k + 2} behind {a:g} {self.of}"
                raise InputError(say(f"table '{self.name}'", "growing times or places", got))

    @property
    def call(self) -> str:
        return self.name.removesuffix("t)") + ")"

    @property
    def units_of_call(self) -> tuple[str, str]:
        return self.of, self.unit

    @cached_property
    def cubics(self) -> np.ndarray:
        """Coefficients (s - 1, 4) of powers 3 to 0 of the distance from the point before."""
        x, y = np.array(self.times), np.array(self.values)
        if self.smooth:
            from scipy.interpolate import PchipInterpolator

            return np.asarray(PchipInterpolator(x, y).c.T)
        none = np.zeros(len(x) - 1)
        return np.stack([none, none, np.diff(y) / np.diff(x), y[:-1]], axis=1)

    @property
    def numbers(self) -> np.ndarray:
        """The table for compiled code, see `curves`."""
        return np.concatenate([[float(self.hold), float(len(self.times))], self.times, self.cubics.ravel()])

    def __call__(self, t: np.ndarray) -> np.ndarray:
        places, x = np.array(self.times), np.clip(t, self.times[0], self.times[-1])
        i = np.clip(np.searchsorted(places, x, side="right") - 1, 0, len(places) - 2)
        s, c = x - places[i], np.moveaxis(self.cubics[i], -1, 0)
        return np.asarray(c[3] + s * (c[2] + s * (c[1] + s * c[0])))


storable(Table, of=lambda values: "s", hold=lambda values: False)


def read_columns(path: Path, names: tuple[str, str], unit: str, of: str = "s") -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Arguments and values in SI units of two columns of a file, by their titles, or the first two where names are empty.

    Numbers are in the units of the titles, or of `of` and `unit` under titles without one.
    """
    where = f"table {path}"
    titles, rows = read_rows(where, path)
    if len(titles) < 2:
        raise InputError(say(where, TITLES, shown(",".join(title for title, _ in titles))))
    columns = list[tuple[float, ...]]()
    places = [find_column(where, titles, name) if name else k for k, name in enumerate(names)]
    for place, given in zip(places, (of, unit), strict=True):
        scale = size_of(where, titles[place], given)
        columns.append(tuple(scale * number(where, row, place, line) for line, row in enumerate(rows, 2)))
    return columns[0], columns[1]


def find_column(where: str, titles: list[tuple[str, str | None]], name: str) -> int:
    """The place of the one column of a title; InputError where there is none or more than one."""
    known = [title for title, _ in titles]
    if known.count(name) != 1:
        got = f"'{name}' {known.count(name)} times" if name in known else f"'{name}'{closest(name, known)}"
        raise InputError(say(where, f"one of the columns {listed(known, name)}", got))
    return known.index(name)


def size_of(where: str, title: tuple[str, str | None], given: str) -> float:
    """The size of a column's unit in SI: that of its title, or where that has none the unit `given`, whose dimension it has.

    InputError for a unit of another dimension, and for a title such as `F (kN)`, whose unit would not be read.
    """
    name, own = title
    dimension = units.find_dimension(given) if given else units.NUMBER
    try:
        scale = quantities.convert(f"1 {own or given}", dimension)
    except Problem as problem:
        raise InputError(problem.at(f"{where}, column '{name}'")) from problem
    if own is None and (found := UNBRACKETED.fullmatch(name)):
        meant = found[1] or found[2]
        with contextlib.suppress(Problem):
            if quantities.convert(f"1 {meant}", dimension) not in (1.0, scale):
                raise InputError(say(where, f"the unit of a title in brackets, such as '... [{meant}]'", f"'{name}'"))
    return scale


def read_rows(where: str, path: Path) -> tuple[list[tuple[str, str | None]], list[list[str]]]:
    """Titles, each with its unit, and rows of a file of comma-separated values; empty lines are left out.

    InputError where there is no such file, or whose titles are one text with semicolons or tabs, as of spreadsheets that write 1,5
    for 1.5; and where a row has more cells than there are titles, as with numbers such as 1,5.
    """
    if not path.is_file() or path.stat().st_size > LARGEST:
        got = "a larger one" if path.is_file() else "none"
        raise InputError(say(where, f"a CSV file of at most {LARGEST:g} bytes", got))
    lines = csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig", errors="replace")))
    try:
        head, *rows = [row for row in lines if any(cell.strip() for cell in row)] or [[]]
    except csv.Error as problem:
        remedy = "close every quote"
        raise InputError(say(f"{where}, line {lines.line_num}", "cells of comma-separated values", problem, remedy)) from problem
    for sign, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(head) == 1 and sign in head[0]:
            remedy = "write the file again as CSV with commas, and with points in numbers"
            raise InputError(say(where, "columns separated by commas", f"{name} in '{head[0].strip()}'", remedy))
    titles = [(found[1], found[2]) for cell in head if (found := TITLE.fullmatch(cell))]
    if titles and all(units.starts_with_number(title) for title, _ in titles):
        raise InputError(say(where, TITLES, shown(",".join(title for title, _ in titles))))
    for line, row in enumerate(rows, 2):
        if any(cell.strip() for cell in row[len(head) :]):
            remedy = "numbers are written with points, 1.5 and not 1,5"
            raise InputError(say(f"{where}, row {line}", f"{len(head)} cells, one under each title", len(row), remedy))
    return titles, rows


def number(where: str, row: list[str], place: int, line: int) -> float:
    """The number in a column of a row."""
    try:
        return float(row[place])
    except (IndexError, ValueError) as problem:
        got = shown(row[place]) if place < len(row) else "nothing"
        raise InputError(say(f"{where}, row {line}", f"a number in column {place + 1}", got)) from problem
