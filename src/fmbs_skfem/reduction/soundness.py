"""Whether arrays that come from a file fit each other: types, shapes, finite numbers, and indices that stay inside.

    system of n unknowns, q body coordinates, y probe rows, s sensor rows, m constraint rows, k signals

    lift (q, n)    mass, damping, stiffness (n, n)    probes (y, n)    sensors (s, n)    x0, v0, constant load (n,)
    constraint terms: row < m,  -1 <= i, j < y,  signal < k        load terms: row < y,  signal < k

Compiled code follows indices without looking, so that one of them out of range reads or writes foreign memory. `check` raises
`Misfit` with the name of the part, what was expected of it and what was found.
"""

from __future__ import annotations

import math
import re
from functools import singledispatch
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from ..bodies.body import Cells
from ..bodies.laws import NUMBERS
from ..core.validation import Misfit, check, indices, listed, numbers, rank, require, shown, span, types
from ..systems import quartic
from ..systems.quartic import Quartic
from ..systems.springs import ANGLE
from ..systems.system import Affine, Constraints, Line, LoadKind, Loads, Output, PointLaw, Sampled, Skin, System
from . import cases
from .affine import ParametricCase, Varying
from .cases import Case

STEPS = 10_000_000  #: most steps of a run, as of the analysis of a scene
TITLE = re.compile(r"[^\W\d][^,;\"'\x00-\x1f\x7f]*")  #: of a column
SIZES = {  #: kind of an output: rows and columns by dimension, None where others decide
    "position": lambda dim: (None, None),
    "slope": lambda dim: (None, None),
    "velocity": lambda dim: (None, None),
    "angle": lambda dim: (2, 1),
    "angular velocity": lambda dim: (2, 1),
    "spin": lambda dim: (None, 1),
    "stress": lambda dim: (None, 2),
    "deflection": lambda dim: (3 * dim, 1),
    "energy": lambda dim: (0, 4),
    "reaction": lambda dim: (0, None),
}
EACH = ("position", "slope", "velocity")  #: kinds with a column for every row


def affine(part: Affine, name: str, columns: int) -> int:
    """The number of rows of an affine function of so many unknowns."""
    (rows,) = rank(part.offset, f"{name}.offset", 1)
    numbers(part.offset, f"{name}.offset", rows)
    numbers(part.matrix, f"{name}.matrix", rows, columns)
    return rows


# ----------------------------------------------------------------------------------------------------------------- systems
@check.register
def _(part: System, name: str) -> None:
    types(part, name)
    system(part, name)


@check.register
def _(part: Case, name: str) -> None:
    types(part, name)
    case(part, name)


@check.register
def _(part: ParametricCase, name: str) -> None:
    types(part, name)
    case(part.nominal, f"{name}.nominal")
    count = len(part.parameters)
    require(len(part.nodes) == count, f"{name}.nodes", f"{count} array(s)", len(part.nodes))
    for k, nodes in enumerate(part.nodes):
        where = f"{name}.nodes[{k}]"
        numbers(nodes, where, *rank(nodes, where, 1))
        require(len(np.unique(nodes)) == len(nodes), where, "nodes that differ", "equal ones")
    for k, varying in enumerate(part.varying):
        polynomial(part, varying, f"{name}.varying[{k}]")


def case(part: Case, name: str) -> None:
    """A system with times that make sense."""
    system(part.system, f"{name}.system")
    duration, step = part.duration, part.scheme.step
    require(step <= duration < STEPS * step, f"{name}.duration", f"1 to {STEPS:g} steps of {step:g} s", f"{duration:g} s")


def system(part: System, name: str) -> None:
    """All arrays of a system, and those of its form with all multipliers."""
    require(part.dim in (2, 3), f"{name}.dim", "2 or 3", part.dim)
    (n,) = rank(part.x0, f"{name}.x0", 1)
    for key in ("x0", "v0"):
        numbers(getattr(part, key), f"{name}.{key}", n)
    for key in ("mass", "damping", "stiffness", "metric"):
        numbers(getattr(part, key), f"{name}.{key}", n, n)
    q, probes, sensors = (affine(getattr(part, key), f"{name}.{key}", n) for key in ("lift", "probes", "sensors"))
    numbers(part.unit, f"{name}.unit", q // part.dim)
    numbers(part.origin, f"{name}.origin", part.dim)
    for key in ("scale", "weight"):
        value = getattr(part, key)
        require(math.isfinite(value) and value > 0.0, f"{name}.{key}", "a positive number", value)
    require(bool((part.metric.diagonal() > 0.0).all()), f"{name}.metric", "a positive diagonal", "another")
    for k, signal in enumerate(part.signals):
        history(signal, f"{name}.signals[{k}]")
    for k, elastic in enumerate(part.elastic):
        where = f"{name}.elastic[{k}]"
        require(math.isfinite(elastic.beta), f"{where}.beta", "a finite number", elastic.beta)
        gathered(elastic.gather, f"{where}.gather", part.dim, n, q)
    constraints(part.constraints, f"{name}.constraints", probes, len(part.signals))
    loads(part.loads, f"{name}.loads", part.dim, n, probes, len(part.signals))
    for key, spans, end in (("components", part.components, n), ("coordinates", part.coordinates, q)):
        for k, (_, first, last) in enumerate(spans):
            span(slice(first, last), f"{name}.{key}[{k}]", end)
    for key, output in part.outputs.items():
        for title in (key, *output.columns):
            headed(title, f"{name}.outputs")
        sensed(output, f"{name}.outputs.{key}", part.dim, sensors)
    for k, (_, _, rows) in enumerate(part.markers):
        listed(rows, f"{name}.markers[{k}]", sensors)
    for k, line in enumerate(part.lines):
        drawn(line, f"{name}.lines[{k}]", part.dim, q)
    for k, skin in enumerate(part.skins):
        drawn(skin, f"{name}.skins[{k}]", part.dim, q)
    if part.full is not None:
        system(part.full, f"{name}.full")


def history(signal: Any, name: str) -> None:
    """A function of time that gives a number for every time."""
    try:
        values = np.asarray(signal(np.zeros(1)), dtype=float)
    except (LookupError, TypeError, ValueError, AttributeError) as problem:
        raise Misfit(name, "a function of time", problem) from problem
    require(values.shape in ((), (1,)), name, "one number for one time", shown(values))


@singledispatch
def gathered(part: Any, name: str, dim: int, n: int, q: int) -> None:
    """The arrays of an elastic part."""
    raise Misfit(name, "cells, sampled points or a polynomial", shown(part))


@gathered.register
def _(part: Cells, name: str, dim: int, n: int, q: int) -> None:
    require(part.dim == dim, f"{name}.dim", str(dim), part.dim)
    _, points, functions, cells = rank(part.table, f"{name}.table", 4)
    numbers(part.table, f"{name}.table", part.law.vectors, points, functions, cells)
    numbers(part.section, f"{name}.section", part.law.rows, points, cells)
    width = q
    if part.spread is not None:
        width = part.spread.shape[0]
        numbers(part.spread, f"{name}.spread", width, q)
    indices(part.nodes, f"{name}.nodes", 0, width - dim + 1, functions, cells)


@gathered.register
def _(part: Sampled, name: str, dim: int, n: int, q: int) -> None:
    modes, (points,) = span(part.columns, f"{name}.columns", n), rank(part.cell, f"{name}.cell", 1)
    rows = part.law.vectors * dim * points
    numbers(part.jets, f"{name}.jets", rows, modes)
    numbers(part.offset, f"{name}.offset", rows)
    numbers(part.section, f"{name}.section", part.law.rows, 1, points)
    indices(part.cell, f"{name}.cell", 0, np.iinfo(np.int64).max, points)


@gathered.register
def _(part: Quartic, name: str, dim: int, n: int, q: int) -> None:
    modes = span(part.columns, f"{name}.columns", n)
    numbers(part.coefficients, f"{name}.coefficients", quartic.length(modes))


def constraints(part: Constraints, name: str, probes: int, signals: int) -> None:
    """Terms in rows that are there."""
    (count,) = rank(part.row, f"{name}.row", 1)
    indices(part.row, f"{name}.row", 0, len(part.names), count)
    numbers(part.coefficient, f"{name}.coefficient", count)
    indices(part.signal, f"{name}.signal", ANGLE, signals, count)
    for key in ("i", "j"):
        indices(getattr(part, key), f"{name}.{key}", -1, probes, count)
    alone = np.flatnonzero((part.i < 0) & (part.j >= 0) | (part.signal == ANGLE) & ((part.i < 0) != (part.j < 0)))
    require(not len(alone), name, "terms with their first factor, angles with both or none", f"another one as term {alone[:1]}")


def loads(part: Loads, name: str, dim: int, n: int, probes: int, signals: int) -> None:
    """Terms and point laws on probe rows that are there."""
    (count,) = rank(part.row, f"{name}.row", 1)
    numbers(part.constant, f"{name}.constant", n)
    indices(part.row, f"{name}.row", 0, probes, count)
    numbers(part.coefficient, f"{name}.coefficient", count)
    indices(part.signal, f"{name}.signal", -1, signals, count)
    for k, law in enumerate(part.laws):
        point_law(law, f"{name}.laws[{k}]", dim, probes, signals)


def point_law(law: PointLaw, name: str, dim: int, probes: int, signals: int) -> None:
    """A spring reads two rows of an arm or none of it, a moment slopes, a follower force slopes and positions."""
    spring = law.kind is LoadKind.SPRING
    end = probes - (2 if spring else dim)
    needed = {"slope": not spring, "position": law.kind is LoadKind.TANGENTIAL}
    for key, must in needed.items():
        first, low = getattr(law, key), 0 if must else -1
        require(low <= first <= end, f"{name}.{key}", f"a row from {low} to {end}", first)
    require(-1 <= law.signal < signals, f"{name}.signal", f"a signal from -1 to {signals - 1}", law.signal)
    numbers(law.vector, f"{name}.vector", 3)


def headed(title: str, name: str) -> None:
    """A text that may head a column of a table, where others begin a formula of a spreadsheet or end the column."""
    fine = isinstance(title, str) and TITLE.fullmatch(title) is not None
    require(fine, name, "names that begin with a letter, without commas, semicolons, quotes and line breaks", shown(title))


def sensed(part: Output, name: str, dim: int, sensors: int) -> None:
    """A known kind of output with the rows that it reads."""
    require(part.kind in SIZES, f"{name}.kind", f"one of {', '.join(SIZES)}", shown(part.kind))
    listed(part.rows, f"{name}.rows", sensors)
    rows, columns = SIZES[part.kind](dim)
    if part.kind == "stress":
        law = next(iter(part.parameters), -1.0)
        require(law in NUMBERS, f"{name}.parameters", "the number of a law first", law)
        rows, count = NUMBERS[int(law)].vectors * dim, 2 + NUMBERS[int(law)].rows
        require(len(part.parameters) == count, f"{name}.parameters", f"{count} numbers", len(part.parameters))
    if part.kind == "spin":
        require(dim == 3 and len(part.rows) in (3, 6, 9), f"{name}.rows", "one to three vectors in space", len(part.rows))
        require(len(part.parameters) == 3, f"{name}.parameters", "an axis", len(part.parameters))
    if part.kind in EACH:
        columns = len(part.rows)
    for key, wanted in (("rows", rows), ("columns", columns)):
        got = len(getattr(part, key))
        require(wanted in (None, got), f"{name}.{key}", f"{wanted} of them", got)


def drawn(part: Line | Skin, name: str, dim: int, q: int) -> None:
    """Samples of a line or of a surface for pictures."""
    rows, width = part.samples.shape
    numbers(part.samples, f"{name}.samples", rows, width)
    if isinstance(part, Line):
        expected = f"an array of {q} columns, its rows a multiple of {3 * dim}"
        require(width == q and rows % (3 * dim) == 0, f"{name}.samples", expected, shown(part.samples))
        return
    (samples,) = rank(part.thickness, f"{name}.thickness", 1)
    numbers(part.thickness, f"{name}.thickness", samples)
    numbers(part.section, f"{name}.section", part.law.rows, 1, samples)
    count, _ = rank(part.cells, f"{name}.cells", 2)
    indices(part.cells, f"{name}.cells", 0, samples, count, 4)
    size, height = span(part.columns, f"{name}.columns", q), (1 + part.law.vectors) * samples
    whole = (rows, width * dim) == (height, size)
    require(whole, f"{name}.samples", f"an array ({height}, {size // dim})", shown(part.samples))


# ------------------------------------------------------------------------------------------------------------- polynomials
def polynomial(model: ParametricCase, part: Varying, name: str) -> None:
    """The numbers of one leaf at the nodes of its grid."""
    degrees, logarithms = part.order.degrees, part.order.logarithmic
    known = len(degrees) == len(logarithms) == len(model.nodes)
    require(known, f"{name}.order", f"a degree for each of {len(model.nodes)} parameters", shown(degrees))
    for degree, logarithm, nodes in zip(degrees, logarithms, model.nodes, strict=True):
        require(0 <= degree < len(nodes), f"{name}.order", f"degrees from 0 to {len(nodes) - 1}", degree)
        require(not logarithm or bool((nodes > 0.0).all()), f"{name}.order", "positive nodes on a logarithmic scale", shown(nodes))
    leaf = leaf_at(model.nominal, part, name)
    size = leaf.data.size if isinstance(leaf, csr_array) else np.size(leaf)
    (count,) = rank(part.positions, f"{name}.positions", 1)
    indices(part.positions, f"{name}.positions", 0, size, count)
    kept, _ = rank(part.values, f"{name}.values", 2)
    numbers(part.values, f"{name}.values", kept, count)
    numbers(part.mixture, f"{name}.mixture", math.prod(degree + 1 for degree in degrees), kept)


def leaf_at(nominal: Case, part: Varying, name: str) -> Any:
    """The leaf of a case that a polynomial changes."""
    try:
        leaf = cases.leaf_at(nominal, part.place)
    except (LookupError, AttributeError, TypeError) as problem:
        raise Misfit(f"{name}.place", "a number or an array of the case", shown(part.place)) from problem
    whole = isinstance(leaf, np.ndarray | csr_array) and leaf.dtype == np.float64
    require(type(leaf) is float or whole, f"{name}.place", "a number or an array of numbers", shown(part.place))
    return leaf
