"""What holds in saved models beside the declarations of their types (`core.storage.validation`).

system of n unknowns, c components, q body coordinates, y probe rows, s sensor rows, m constraint
rows, k signals
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import InputError
from ..core.storage.validation import Misfit, Sizes, also, describe, require
from ..systems.measures import probes
from ..systems.system import Constraints, Output, System
from . import cases
from .affine import ParametricCase, Varying
from .cases import Case

TITLE = re.compile(r"[^\W\d][^,;\"'\x00-\x1f\x7f]*")  #: of a column


@also.register
def _(part: System, name: str, sizes: Sizes) -> None:
    length = sizes["q"] // part.dim
    require(
        sizes["u"] == length,
        f"{name}.unit",
        f"an array ({length},) of float64",
        describe(part.unit),
    )
    require(
        bool((part.metric.diagonal() > 0.0).all()),
        f"{name}.metric",
        "a positive diagonal",
        "another",
    )
    for k, signal in enumerate(part.signals):
        history(signal, f"{name}.signals[{k}]")
    for key, spans, end in (
        ("components", part.components, sizes["n"]),
        ("coordinates", part.coordinates, sizes["q"]),
    ):
        for k, (_, first, last) in enumerate(spans):
            require(
                0 <= first <= last <= end,
                f"{name}.{key}[{k}]",
                f"a range within 0 to {end}",
                (first, last),
            )
    for key, output in part.outputs.items():
        for title in (key, *output.columns):
            headed(title, f"{name}.outputs")
    for k, (_, _, rows) in enumerate(part.markers):
        listed(rows, f"{name}.markers[{k}]", sizes["s"])


def history(signal: Any, name: str) -> None:
    """A function of time that gives a number for every time."""
    try:
        values = np.asarray(signal(np.zeros(1)), dtype=float)
    except (LookupError, TypeError, ValueError, AttributeError) as problem:
        raise Misfit(name, "a function of time", problem) from problem
    require(values.shape in ((), (1,)), name, "one number for one time", describe(values))


@also.register
def _(part: Constraints, name: str, sizes: Sizes) -> None:
    alone = np.flatnonzero((part.i < 0) & (part.j >= 0))
    require(
        not len(alone), name, "terms with their first factor", f"another one as term {alone[:1]}"
    )


def headed(title: str, name: str) -> None:
    """A text that may head a column of a table, where others begin a formula of a spreadsheet or
    end the column.
    """
    fine = isinstance(title, str) and TITLE.fullmatch(title) is not None
    require(
        fine,
        name,
        "names that begin with a letter, without commas, semicolons, quotes and line breaks",
        describe(title),
    )


def listed(rows: tuple[int, ...], name: str, end: int) -> None:
    require(
        all(0 <= row < end for row in rows), name, f"indices from 0 to {end - 1}", describe(rows)
    )


@also.register
def _(part: Output, name: str, sizes: Sizes) -> None:
    """A known kind of output with the rows that it reads."""
    dim, sensors = sizes["c"], sizes["s"]
    listed(part.rows, f"{name}.rows", sensors)
    try:
        kind = probes.kind_of(part)
    except InputError as problem:
        raise Misfit(
            f"{name}.kind", f"one of {', '.join(probes.Probe.known)}", describe(part.kind)
        ) from problem
    try:
        wanted = kind.sizes(part, dim)
    except (LookupError, ValueError, OverflowError) as problem:
        raise Misfit(
            f"{name}.parameters", "numbers of such an output", describe(part.parameters)
        ) from problem
    for key, count in zip(("rows", "columns", "parameters"), wanted, strict=True):
        got = len(getattr(part, key))
        require(count in (None, got), f"{name}.{key}", f"{count} of them", got)


# ------------------------------------------------------------------------------------------------------------- polynomials
@also.register
def _(part: Case, name: str, sizes: Sizes) -> None:
    duration = part.duration
    step = part.scheme.step
    require(
        step <= duration < cases.STEPS * step,
        f"{name}.duration",
        f"1 to {cases.STEPS:g} steps of {step:g} s",
        f"{duration:g} s",
    )


@also.register
def _(part: ParametricCase, name: str, sizes: Sizes) -> None:
    count = len(part.parameters)
    require(len(part.nodes) == count, f"{name}.nodes", f"{count} array(s)", len(part.nodes))
    for k, nodes in enumerate(part.nodes):
        require(
            len(np.unique(nodes)) == len(nodes),
            f"{name}.nodes[{k}]",
            "nodes that differ",
            "equal ones",
        )
    for k, varying in enumerate(part.varying):
        polynomial(part, varying, f"{name}.varying[{k}]")


def polynomial(model: ParametricCase, part: Varying, name: str) -> None:
    """The numbers of one leaf at the nodes of its grid."""
    degrees, logarithms = part.order.degrees, part.order.logarithmic
    known = len(degrees) == len(logarithms) == len(model.nodes)
    require(
        known,
        f"{name}.order",
        f"a degree for each of {len(model.nodes)} parameters",
        describe(degrees),
    )
    for degree, logarithm, nodes in zip(degrees, logarithms, model.nodes, strict=True):
        require(
            0 <= degree < len(nodes), f"{name}.order", f"degrees from 0 to {len(nodes) - 1}", degree
        )
        require(
            not logarithm or bool((nodes > 0.0).all()),
            f"{name}.order",
            "positive nodes on a logarithmic scale",
            describe(nodes),
        )
    leaf = leaf_at(model.nominal, part, name)
    last = (leaf.data.size if isinstance(leaf, csr_array) else np.size(leaf)) - 1
    largest = int(part.positions.max(initial=0))
    require(largest <= last, f"{name}.positions", f"indices from 0 to {last}", f"up to {largest}")
    grid = math.prod(degree + 1 for degree in degrees)
    require(
        len(part.mixture) == grid,
        f"{name}.mixture",
        f"an array of {grid} rows",
        describe(part.mixture),
    )


def leaf_at(nominal: Case, part: Varying, name: str) -> Any:
    """The leaf of a case that a polynomial changes."""
    try:
        leaf = cases.leaf_at(nominal, part.place)
    except (LookupError, AttributeError, TypeError) as problem:
        raise Misfit(
            f"{name}.place", "a number or an array of the case", describe(part.place)
        ) from problem
    whole = isinstance(leaf, np.ndarray | csr_array) and leaf.dtype == np.float64
    require(
        type(leaf) is float or whole,
        f"{name}.place",
        "a number or an array of numbers",
        describe(part.place),
    )
    return leaf
