"""Tables by name: straight lines or a smooth curve through points, constant before and behind them.

    torque: "Kp * (goal(t) - hinge.angle)"          Table("goal(t)", "rad", times, values)
    force: "-pull(stretch) - c * rate"              Table("pull", "N", stretches, forces, of="m")

A smooth one is the monotone cubic of Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984)
300-304, doi 10.1137/0905021: it overshoots nowhere, but its second derivative jumps at every point.
Where it drives a joint, forces follow q'', and it is the cubic spline, whose q'' is continuous,
with an error of (3/8) h^2 max |q''''| at most for intervals h (C. A. Hall, W. W. Meyer, J. Approx.
Theory 16 (1976) 105-122, doi 10.1016/0021-9045(76)90040-X). That may overshoot, and errors e of its
values that alternate give q'' of 12 e / h^2, random ones of 6 e / h^2 (both root mean square).
Files are texts of comma-separated numbers below a line of titles with their units,
`time [ms], angle [deg]`.
"""

from __future__ import annotations

import contextlib
import csv
import io
import itertools
import re
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from ..errors import InputError, closest, listed, say
from ..storage.container import storable
from ..storage.records import dataclass
from . import quantities, units
from .inputs import Source
from .problems import Problem, shown

#: its unit, where it has one, is in the last brackets
TITLE = re.compile(r"\s*(.*?)\s*(?:\[\s*([^\[\]]*?)\s*\])?\s*", re.DOTALL)
#: a title that ends with a unit as in `F (kN)`, `F / kN`, `F in kN`, `F_kN`
UNBRACKETED = re.compile(r".*(?:\(\s*([^()]+?)\s*\)|(?:/|_|\bin\s)\s*(\S+?))\s*", re.DOTALL)
#: of a spline: third derivative continuous at the points next to them, q'' = 0, or q' = 0;
#: `automatic` is clamped where the rate at an end is zero as far as the points say, else not-a-knot
Ends: TypeAlias = Literal["automatic", "not-a-knot", "natural", "clamped"]
# rates at ends at rest fall by 8 with twice as many points, so that half of them are off by 7 of
# what all give
UNSURE = 0.5  #: difference of the rates at an end by all points and by every second one, over which the rate is none
FEW = 5  #: points below which half of them say nothing
OVERSHOT = 0.01  #: of the range of the values, by which a curve that drives may leave those beside it without a word
#: points from which noise is looked for, share of second differences that change their sign from
#: which there is some (of 1000 tables of noise in 32 points the least had 0.52), and q'' over that
#: of fewer points from which it is worth a word
NOISY = 32, 0.5, 10.0
EIGHTH = 8  #: of the points are those of a smooth curve, whose q'' noise makes 64 times smaller
LARGEST = 50_000_000  #: size of a file [bytes]
TITLES = "a first line of titles, such as 'time [s], angle [deg]'"


@storable
@dataclass(frozen=True)
class Table(Source):
    """Points of a function; its name is how expressions call it, `goal` or, as a function of time,
    `goal(t)`.

    Beyond its points it is constant: motions that get there with an argument that is no time end
    with a warning, unless it is to `hold` the values at its ends.
    """

    times: tuple[float, ...] = ()  #: (s,) growing arguments
    values: tuple[float, ...] = ()  #: (s,)
    smooth: bool = False
    of: str = "s"  #: SI unit of its argument
    hold: bool = False
    ends: Ends = "automatic"  #: of the spline
    drives: bool = False  #: whether a smooth one is the spline, by which joints are driven

    def __post_init__(self) -> None:
        if not self.name.endswith("(t)"):
            object.__setattr__(self, "name", f"{self.name}(t)")
        points = (
            np.array([self.times, self.values])
            if len(self.times) == len(self.values)
            else np.full((2, 1), np.nan)
        )
        if points.shape[1] < 2 or not np.isfinite(points).all():
            got = f"{len(self.times)} places and {len(self.values)} values"
            raise InputError(
                say(
                    f"table '{self.name}'",
                    "two points of finite numbers at least, a value for each time or place",
                    got,
                )
            )
        for k, (a, b) in enumerate(itertools.pairwise(self.times)):
            if b <= a:
                got = f"{b:g} {self.of} as point {k + 2} behind {a:g} {self.of}"
                raise InputError(say(f"table '{self.name}'", "growing times or places", got))
        with np.errstate(all="ignore"):
            lengths, rises = np.diff(points)
            slopes = rises / lengths
            bends = np.diff(slopes) / lengths[1:]
        if not (np.isfinite(slopes).all() and np.isfinite(bends).all()):
            raise InputError(
                say(
                    f"table '{self.name}'",
                    "points between which slopes are finite",
                    "values too large for that",
                )
            )

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

            return (
                spline(x, y, self.ends) if self.drives else np.asarray(PchipInterpolator(x, y).c.T)
            )
        none = np.zeros(len(x) - 1)
        return np.stack([none, none, np.diff(y) / np.diff(x), y[:-1]], axis=1)

    @property
    def numbers(self) -> np.ndarray:
        """The table for compiled code, see `curves`."""
        return np.concatenate(
            [[float(self.hold), float(len(self.times))], self.times, self.cubics.ravel()]
        )

    def __call__(self, t: np.ndarray) -> np.ndarray:
        places = np.array(self.times)
        x = np.clip(t, self.times[0], self.times[-1])
        i = np.clip(np.searchsorted(places, x, side="right") - 1, 0, len(places) - 2)
        s = x - places[i]
        c = np.moveaxis(self.cubics[i], -1, 0)
        return np.asarray(c[3] + s * (c[2] + s * (c[1] + s * c[0])))


def spline(x: np.ndarray, y: np.ndarray, ends: Ends) -> np.ndarray:
    """Coefficients (s - 1, 4) of the cubic spline through points (s,), (s,), as `Table.cubics`."""
    from scipy.interpolate import CubicSpline

    if ends != "automatic":
        return np.asarray(CubicSpline(x, y, bc_type=ends).c.T)
    plain = CubicSpline(x, y)
    if len(x) < FEW:
        return np.asarray(plain.c.T)
    kinds = list[str]()
    last = len(x) - 1
    for end, half in ((0, np.arange(0, last + 1, 2)), (last, np.arange(last % 2, last + 1, 2))):
        rate = plain(x[end], 1)
        other = CubicSpline(x[half], y[half])(x[end], 1)
        flat = y[end] == y[abs(end - 1)]  # beside the first point, or the last one
        kinds.append("clamped" if flat or abs(rate) <= UNSURE * abs(other - rate) else "not-a-knot")
    return np.asarray(CubicSpline(x, y, bc_type=tuple(kinds)).c.T)


def overshoot(table: Table) -> tuple[float, float]:
    """By how much a curve leaves the values of both points beside it at most, and where."""
    x = np.array(table.times)
    y = np.array(table.values)
    c = table.cubics
    length = np.diff(x)
    with np.errstate(all="ignore"):  # the two places where the slope is 0, nan where there is none
        half = -(c[:, 1] + np.copysign(np.sqrt(c[:, 1] ** 2 - 3.0 * c[:, 0] * c[:, 2]), c[:, 1]))
        s = np.stack([half / (3.0 * c[:, 0]), c[:, 2] / half])
        s = np.where((s > 0.0) & (s < length), s, 0.0)
    value = table(x[:-1] + s)
    low = np.minimum(y[:-1], y[1:])
    high = np.maximum(y[:-1], y[1:])
    beyond = np.maximum(low - value, value - high)
    side, k = np.unravel_index(int(beyond.argmax()), beyond.shape)
    return float(beyond[side, k]), float(x[k] + s[side, k])


def noise(table: Table) -> tuple[float, float]:
    """The largest second derivative |q''| of a spline that follows noise, and that of one through
    every eighth point; zeros where it does not.

    Second differences of noise change their sign from point to point in 3 of 4 cases, those of a
    curve at its inflections alone.
    """
    x, y = np.array(table.times), np.array(table.values)
    few, share, worth = NOISY
    bends = np.diff(np.diff(y) / np.diff(x))
    if len(x) < few or np.mean(bends[1:] * bends[:-1] < 0.0) < share:
        return 0.0, 0.0
    smooth = replace(table, times=table.times[::EIGHTH], values=table.values[::EIGHTH])
    own, other = (2.0 * float(np.abs(one.cubics[:, 1]).max()) for one in (table, smooth))
    # beside which round-off is none
    least = float(np.ptp(y)) / (table.times[-1] - table.times[0]) ** 2
    return (own, other) if own > worth * max(other, least) else (0.0, 0.0)


def read_columns(
    path: Path, names: tuple[str, str], unit: str, of: str = "s"
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Arguments and values in SI units of two columns of a file, by their titles, or the first two
    where names are empty.

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
        columns.append(
            tuple(scale * number(where, row, place, line) for line, row in enumerate(rows, 2))
        )
    return columns[0], columns[1]


def find_column(where: str, titles: list[tuple[str, str | None]], name: str) -> int:
    """The place of the one column of a title; InputError where there is none or more than one."""
    known = [title for title, _ in titles]
    if known.count(name) != 1:
        got = (
            f"'{name}' {known.count(name)} times"
            if name in known
            else f"'{name}'{closest(name, known)}"
        )
        raise InputError(say(where, f"one of the columns {listed(known, name)}", got))
    return known.index(name)


def size_of(where: str, title: tuple[str, str | None], given: str) -> float:
    """The size of a column's unit in SI: that of its title, or where that has none the unit
    `given`, whose dimension it has.

    InputError for a unit of another dimension, and for a title such as `F (kN)`, whose unit would
    not be read.
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
                raise InputError(
                    say(
                        where,
                        f"the unit of a title in brackets, such as '... [{meant}]'",
                        f"'{name}'",
                    )
                )
    return scale


def read_rows(where: str, path: Path) -> tuple[list[tuple[str, str | None]], list[list[str]]]:
    """Titles, each with its unit, and rows of a file of comma-separated values; empty lines are
    left out.

    InputError where there is no such file, or whose titles are one text with semicolons or tabs, as
    of spreadsheets that write 1,5 for 1.5; and where a row has more cells than there are titles, as
    with numbers such as 1,5.
    """
    if not path.is_file() or path.stat().st_size > LARGEST:
        got = "a larger one" if path.is_file() else "none"
        raise InputError(say(where, f"a CSV file of at most {LARGEST:g} bytes", got))
    lines = csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig", errors="replace")))
    try:
        head, *rows = [row for row in lines if any(cell.strip() for cell in row)] or [[]]
    except csv.Error as problem:
        remedy = "close every quote"
        raise InputError(
            say(
                f"{where}, line {lines.line_num}",
                "cells of comma-separated values",
                problem,
                remedy,
            )
        ) from problem
    for sign, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(head) == 1 and sign in head[0]:
            remedy = "write the file again as CSV with commas, and with points in numbers"
            raise InputError(
                say(where, "columns separated by commas", f"{name} in '{head[0].strip()}'", remedy)
            )
    titles = [(found[1], found[2]) for cell in head if (found := TITLE.fullmatch(cell))]
    if titles and all(units.starts_with_number(title) for title, _ in titles):
        raise InputError(say(where, TITLES, shown(",".join(title for title, _ in titles))))
    for line, row in enumerate(rows, 2):
        if any(cell.strip() for cell in row[len(head) :]):
            remedy = "numbers are written with points, 1.5 and not 1,5"
            raise InputError(
                say(
                    f"{where}, row {line}",
                    f"{len(head)} cells, one under each title",
                    len(row),
                    remedy,
                )
            )
    return titles, rows


def number(where: str, row: list[str], place: int, line: int) -> float:
    """The number in a column of a row."""
    try:
        return float(row[place])
    except (IndexError, ValueError) as problem:
        got = shown(row[place]) if place < len(row) else "nothing"
        raise InputError(
            say(f"{where}, row {line}", f"a number in column {place + 1}", got)
        ) from problem
