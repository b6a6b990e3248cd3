"""Outputs in C, written from what they say of themselves in symbols; energies and forces of joints
beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import sympy

from ..systems.forces import force_symbols as written
from ..systems.measures.probes import Energy, Reaction, kind_of
from ..systems.system import Output, System
from .text import block, statements


class Column(NamedTuple):
    """A column of an output."""

    name: str
    unit: str
    value: str  #: in C
    lines: tuple[str, ...] = ()  #: before it
    turns: str = ""  #: the angle, of whose turns there is a count


def columns_of(system: System, name: str, output: Output) -> list[Column]:
    """The columns of an output that a C file has; none of an output that cannot be written."""
    kind = kind_of(output)
    units = kind.units(name, output)
    if kind is Energy:
        return [
            Column(output.columns[0], "J", "NAME_kinetic_energy(m)"),
            Column(output.columns[1], "J", "NAME_strain_energy(m)"),
        ]
    if kind is Reaction:
        rows = [k for k, (joint, _) in enumerate(system.constraints.names) if joint == output.joint]
        if output.rows or len(rows) != len(output.columns):
            return []
        texts = [f"-@state_multipliers@[{k}] / m->method_c[0]" for k in rows]
        return [Column(*one) for one in zip(output.columns, units, texts, strict=True)]
    count = len(output.rows)
    y = written.rows(count)
    v = written.rates(count)
    numbers = written.numbers(len(output.parameters))
    values = list(kind.write(y, v, numbers))
    if len(values) < len(output.columns):
        return []
    values = chosen(values, output)
    places = {one: f"m->sensed[{row}]" for one, row in zip(y, output.rows, strict=True)}
    places |= {one: f"m->sensed_rates[{row}]" for one, row in zip(v, output.rows, strict=True)}
    given = dict(zip(numbers, map(sympy.Float, output.parameters), strict=True))
    found = []
    for column, unit, value in zip(output.columns, units, values, strict=True):
        value = written.plain(sympy.sympify(value)).xreplace(given)
        angles = sorted(value.atoms(written.turned), key=str)
        lines, (text, *angle) = statements(
            [value.replace(written.turned, lambda one: one), *(one.args[0] for one in angles)],
            places,
        )
        if angles and len(angles) == 1 and value == angles[0]:
            found.append(Column(column, unit, text, tuple(lines), angle[0]))
        elif not angles:
            found.append(Column(column, unit, text, tuple(lines)))
        else:
            return []
    return found


def chosen(values: list[Any], output: Output) -> list[Any]:
    """Those of all values that are columns: the first ones, and of an angle against another place
    its rate.
    """
    if len(values) == 3 and len(output.columns) == 2:  # angle, angle once more, rate
        return [values[0], values[2]]
    return values[: len(output.columns)]


def write_outputs(
    system: System, more: Sequence[Column] = ()
) -> tuple[str, list[Column], list[str]]:
    """Functions of C, all columns with `more` behind those of the system, and names of those that
    are left out.
    """
    columns, left_out = [], []
    for name, output in system.outputs.items():
        found = columns_of(system, name, output)
        columns += found
        left_out += [one for one in output.columns if one not in {each.name for each in found}]
    columns += more
    turning = [(k, one) for k, one in enumerate(columns) if one.turns]
    lines, counts = [], []
    for k, one in enumerate(columns):
        place = next((n for n, (at, _) in enumerate(turning) if at == k), None)
        if place is None:
            lines.append(scoped(one.lines, f"out[{k}] = {one.value};"))
        else:
            lines.append(f"    out[{k}] = m->turned[{place}];")
            counts.append(
                scoped(
                    one.lines,
                    f"m->turned[{place}] = continued({one.turns}, m->turned[{place}]);",
                )
            )
    sense = "    sense(m);\n"
    text = (
        f"static void count_turns(NAME_memory *m)\n{{\n{sense if counts else '    (void)m;' + chr(10)}"
        + "\n".join(counts)
    )
    text += (
        "\n}\n\nvoid NAME_outputs(NAME_memory *m, double out[])\n{\n"
        + sense
        + "\n".join(lines)
        + "\n}\n"
    )
    return text, columns, left_out


def scoped(lines: tuple[str, ...], last: str) -> str:
    """Lines in braces where they name something."""
    return "    {\n" + block([*lines, last], 2) + "\n    }" if lines else block([last])
