"""What `fmbs check` says first: what the model is, what is doubtful, what to do next.

    four-bar (dynamic): the scene is valid
      crank      0.03648 kg, 200 mm long, 10 cells
      joints     O, A, C, D, motor (driven)
      motion     1 degree of freedom of rigid bodies, 0 after drives
      solver     224 unknowns by a band of half width 7; 1500 steps, about 0.06 s, 8 MB
      doubtful   nothing
      next       fmbs run examples/four_bar.yaml; all tables: fmbs check --all

Every number stands in the report as well; warnings and errors are shown before, in full, whatever
is shown here.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...core.values.display import DisplayUnits

LISTED = 6  #: bodies and joints that are named
MOTIONS = 2  #: free motions that are named; each takes a line of 80 columns in space
STARTS = {"position": "m", "velocity": "m/s"}  #: what joints may change of the start
CHANGED = 1e-9  #: [m, m/s] that joints change at the start; what is less is round-off


def summarise(found: Mapping[str, Any], source: str, changes: Mapping[str, str]) -> list[str]:
    """The lines of the report `found` of a check of the scene file `source` with `changes` of its
    parameters.
    """
    rows = [*rows_of(found, DisplayUnits.of(found)), *advice(found, source, changes)]
    width = max(len(head) for head, _ in rows)
    title = f"{found['scene']} ({found['analysis']}): the scene is valid"
    return [title, *(f"  {head:<{width}}   {text}" for head, text in rows)]


def rows_of(found: Mapping[str, Any], display: DisplayUnits) -> Iterator[tuple[str, str]]:
    """What the model is: bodies, joints, degrees of freedom, size and time of the solution."""
    for body in found["bodies"][:LISTED]:
        yield body["name"], describe(body, display)
    if rest := found["bodies"][LISTED:]:
        mass = quantity(sum(body["mass"] for body in rest), "kg", display)
        yield f"{len(rest)} more", f"{mass}, {sum(body['cells'] for body in rest)} cells"
    mechanism = found["mechanism"]
    joints = [
        f"{one['name']} (driven)" if one["driven"] else one["name"] for one in mechanism["joints"]
    ]
    yield "joints", shorten(joints, LISTED) or "none"
    count, left = mechanism["degrees_of_freedom"], mechanism["left_by_drives"]
    text = f"{counted(count, 'degree')} of freedom of rigid bodies"
    text += f", {left} after drives" if left != count else ""
    if excess := len(mechanism["overconstrained"]):
        text += f", {counted(excess, 'redundant constraint')}"
    motions = shorten(mechanism["free_motions"], MOTIONS)
    yield "motion", f"{text}: {motions}" if motions else text
    changed = {name: found["initial"].get(f"{name}_change") or 0.0 for name in STARTS}
    if told := [
        f"{name} by {quantity(value, STARTS[name], display)}"
        for name, value in changed.items()
        if value > CHANGED
    ]:
        yield "start", f"joints change it: {', '.join(told)}"
    costs = found["estimates"]
    memory = max(costs["solver_memory_mb"] + costs.get("memory_mb", 0.0), 1.0)
    steps = f"{costs['steps']} steps, " if "steps" in costs else ""
    text = f"{found['unknowns']} unknowns, {costs['solver']}; {steps}"
    yield "solver", f"{text}about {costs['wall_s']:g} s, {memory:.0f} MB"


def describe(body: Mapping[str, Any], display: DisplayUnits) -> str:
    """Mass, size and cells of a body."""
    sizes = {"length": ("m", " long"), "area": ("m^2", ""), "extent": ("m", " in size")}
    known = next((key for key in sizes if body[key]), None)
    words = [quantity(body["mass"], "kg", display)]
    if known:
        unit, behind = sizes[known]
        words.append(quantity(body[known], unit, display) + behind)
    key, word = ("cells", "cells") if body["cells"] else ("dofs", "coordinates")
    return ", ".join([*words, f"{body[key]} {word}"])


def advice(
    found: Mapping[str, Any], source: str, changes: Mapping[str, str]
) -> Iterator[tuple[str, str]]:
    """How many warnings there were, and the next command."""
    options = [word for name, value in changes.items() for word in ("--set", f"{name}={value}")]
    run = f"{shlex.join(['fmbs', 'run', source, *options])}; all tables: fmbs check --all"
    count = len(found["notices"])
    yield "doubtful", f"{counted(count, 'warning')}, shown before" if count else "nothing"
    yield "next", f"settle what is doubtful, then {run}" if count else run


def counted(count: int, what: str) -> str:
    """A count with its word: 1 degree, 2 degrees."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def quantity(value: float, unit: str, display: DisplayUnits) -> str:
    """A value in four digits, in the unit in which it is read."""
    return display.quantity(float(f"{value:.4g}"), unit)


def shorten(names: Sequence[str], count: int) -> str:
    """The first `count` names, and how many more there are."""
    rest = len(names) - count
    return ", ".join([*names[:count], *([f"and {rest} more"] if rest > 0 else [])])
