"""What `fmbs check` says first: what the model is, what is doubtful, what to do next.

    four-bar (dynamic): the scene is valid
      crank      0.03648 kg, 200 mm long, 10 cells, 44 coordinates
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
    joints = [
        f"{one['name']} (driven)" if one["driven"] else one["name"]
        for one in found["mechanism"]["joints"]
    ]
    yield "joints", shorten(joints, LISTED) or "none"
    yield "motion", describe_motion(found["mechanism"])
    if changed := list(initial_changes(found["initial"], display)):
        yield "start", "joints change it: " + ", ".join(changed)
    yield "solver", describe_solution(found["unknowns"], found["estimates"])


def describe(body: Mapping[str, Any], display: DisplayUnits) -> str:
    """Mass, size and cells of a body."""
    words = [quantity(body["mass"], "kg", display)]
    if body["length"]:
        words.append(f"{quantity(body['length'], 'm', display)} long")
    elif body["area"]:
        words.append(quantity(body["area"], "m^2", display))
    elif body["extent"]:
        words.append(f"{quantity(body['extent'], 'm', display)} in size")
    return ", ".join([*words, *([f"{body['cells']} cells"] if body["cells"] else ["rigid"])])


def describe_motion(found: Mapping[str, Any]) -> str:
    """Degrees of freedom by rank, those after drives with the motions that they are, and redundant
    constraints.
    """
    count = found["degrees_of_freedom"]
    text = f"{count} degree{'' if count == 1 else 's'} of freedom of rigid bodies"
    if found["left_by_drives"] != count:
        text += f", {found['left_by_drives']} after drives"
    if excess := len(found["overconstrained"]):
        text += f", {excess} redundant constraint{'' if excess == 1 else 's'}"
    motions = shorten(found["free_motions"], MOTIONS)
    return f"{text}: {motions}" if motions else text


def initial_changes(found: Mapping[str, Any], display: DisplayUnits) -> Iterator[str]:
    """What joints change of the given initial state."""
    for key, unit in (("position_change", "m"), ("velocity_change", "m/s")):
        if (value := found.get(key) or 0.0) > CHANGED:
            name = key.removesuffix("_change")
            yield f"{name} by {quantity(value, unit, display)}"
    if (lost := found.get("energy_lost") or 0.0) > CHANGED:
        yield f"{100 * lost:.2g} % of the kinetic energy is lost"


def describe_solution(unknowns: int, found: Mapping[str, Any]) -> str:
    """Unknowns, solver, steps, time and memory."""
    words = [f"{found['steps']} steps"] if "steps" in found else []
    memory = found["solver_memory_mb"] + found.get("memory_mb", 0.0)
    words += [f"about {found['wall_s']:g} s", f"{max(memory, 1.0):.0f} MB"]
    return f"{unknowns} unknowns, {found['solver']}; {', '.join(words)}"


def advice(
    found: Mapping[str, Any], source: str, changes: Mapping[str, str]
) -> Iterator[tuple[str, str]]:
    """How many warnings there were, and the next command."""
    options = [word for name, value in changes.items() for word in ("--set", f"{name}={value}")]
    run = shlex.join(["fmbs", "run", source, *options])
    ending = "" if (count := len(found["notices"])) == 1 else "s"
    yield "doubtful", f"{count} warning{ending}, shown before" if count else "nothing"
    first = f"settle the warning{ending}, then {run}" if count else run
    yield "next", f"{first}; all tables: fmbs check --all"


def quantity(value: float, unit: str, display: DisplayUnits) -> str:
    """A value in four digits, in the unit in which it is read."""
    return display.quantity(float(f"{value:.4g}"), unit)


def shorten(names: Sequence[str], count: int) -> str:
    """The first `count` names, and how many more there are."""
    rest = len(names) - count
    return ", ".join([*names[:count], *([f"and {rest} more"] if rest > 0 else [])])
