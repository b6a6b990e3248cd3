"""Numbers of a model in C: constants, or polynomials of the parameters, evaluated at the start.

a(mu) = a_0 + sum_q w_q(mu) a_q,    w = P(mu)^T mixture,    P the Lagrange polynomials of `reduction.affine`
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..reduction import cases
from ..reduction.affine import Order, ParametricCase, Varying
from ..reduction.cases import Case, Place
from .pieces import Array
from .text import array, number, replaced, template

#: leaves of a system that a step reads; all others are for pictures, or fixed
READ = (
    "elastic",
    "mass",
    "damping",
    "stiffness",
    "probes",
    "constraints",
    "loads",
    "signals",
    "sensors",
    "x0",
    "v0",
)
UNREAD = ("loads", "springs"), ("near",)


@dataclass(frozen=True)
class Numbers:
    """A case, and which of its leaves depend on parameters."""

    case: Case
    model: ParametricCase | None = None

    @property
    def varying(self) -> dict[Place, Varying]:
        """The leaves that the step reads and parameters change."""
        if self.model is None:
            return {}
        return {one.place: one for one in self.model.varying if is_read(one.place)}

    def varies(self, place: Sequence[str | int]) -> bool:
        """Whether a leaf, or one below it, depends on parameters."""
        return any(one[: len(place)] == tuple(place) for one in self.varying)


def is_read(place: Place) -> bool:
    """Whether a step reads a leaf of a case."""
    if place[0] == "scheme":
        return True
    return (
        place[0] == "system"
        and place[1] in READ
        and not any(place[1 : 1 + len(one)] == one for one in UNREAD)
    )


def write(numbers: Numbers, arrays: Mapping[str, Array], where: str) -> tuple[str, str, str]:
    """Constants of C, fields of the memory for the numbers that vary, and the function
    `set_numbers`.

    InputError, after `where`, where parameters change what no array here holds.
    """
    varying = numbers.varying
    text = []
    fields = []
    if lost := set(varying) - {one.place for one in arrays.values()}:
        raise InputError(
            say(
                where,
                "parameters that change numbers of C files",
                cases.label(min(lost, key=str)),
                "fix it with --set",
            )
        )
    mixed: dict[Order, list[str]] = {}
    longest = 1
    for name, one in arrays.items():
        part = varying.get(one.place)
        if part is None:
            text.append(array(name, one.values))
            continue
        leaf = np.asarray(cases.leaf_at(numbers.case, part.place), dtype=float)
        base = leaf.copy().ravel()
        changes = []
        base[part.positions] = 0.0
        for values in part.values:
            other = np.zeros(leaf.size)
            other[part.positions] = values
            changes.append(np.asarray(one.make(other.reshape(leaf.shape)), dtype=float).ravel())
        start = np.asarray(one.make(base.reshape(leaf.shape)), dtype=float).ravel()
        t, q = part.mixture.shape
        longest = max(longest, t)
        size = max(1, start.size)
        text += [
            array(f"{name}_BASE", start),
            array(f"{name}_CHANGES", np.array(changes)),
            array(f"{name}_MIXTURE", part.mixture),
        ]
        text.append(f"#define {name} (m->numbers_{name})")
        fields.append(f"    double numbers_{name}[{size}];")
        arrays_of = f"{name}_BASE, {name}_CHANGES, {name}_MIXTURE, m->numbers_{name}"
        mixed.setdefault(part.order, []).append(f"    mix(weights, {t}, {q}, {size}, {arrays_of});")
    # polynomials of one order are evaluated once for all that have it
    lines = [
        line
        for k, found in enumerate(mixed.values())
        for line in (f"    weigh(m, {k}, weights);", *found)
    ]
    return (
        "\n".join([*text, *tables(numbers, list(mixed))]),
        "\n".join(fields),
        function(lines, longest),
    )


def tables(numbers: Numbers, orders: Sequence[Order]) -> list[str]:
    """Nodes of the parameters, and degrees of the polynomials."""
    if numbers.model is None or not orders:
        return []
    count = len(numbers.model.parameters)
    nodes = numbers.model.nodes
    most = max(len(one) for one in nodes)
    degrees = [[*one.degrees, *map(int, one.logarithmic)] for one in orders]
    listed = ",\n    ".join("{" + ", ".join(map(str, row)) + "}" for row in degrees)
    padded = np.array([[*one, *([0.0] * (most - len(one)))] for one in nodes])
    return [
        f"#define NODES {most}",
        array("NODE", padded),
        f"static const int ORDER[{len(orders)}][{2 * count}] = {{\n    {listed}}};",
    ]


def function(lines: Sequence[str], longest: int) -> str:
    """`set_numbers`, with what it calls."""
    if not lines:
        return "static void set_numbers(NAME_memory *m)\n{\n    (void)m;\n}\n"
    return replaced(template("numbers.c"), {"LONGEST": longest, "    LINES": "\n".join(lines)})


def parameters_of(numbers: Numbers) -> dict[str, tuple[str, float, float, float]]:
    """Unit, least, largest and nominal value of all parameters by name."""
    known = () if numbers.model is None else numbers.model.parameters
    return {one.name: (one.unit, one.low, one.high, one.nominal) for one in known}


def table_of(numbers: Numbers) -> str:
    """The ranges of the parameters as a table of C: least, largest, nominal."""
    rows = [", ".join(map(number, values[1:])) for values in parameters_of(numbers).values()] or [
        "0.0, 0.0, 0.0"
    ]
    return f"static const double PARAMETER[{len(rows)}][3] = {{{', '.join('{' + row + '}' for row in rows)}}};"
