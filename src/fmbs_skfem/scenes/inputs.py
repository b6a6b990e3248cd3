"""Inputs of a scene: names of numbers that a run from Python is told from step to step, and that others hold at their start.

    inputs: {u: {unit: N m, start: 0}}

They are known before all else of a scene is read: expressions of loads and joints use them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from ..core import expressions, units
from ..core.errors import InputError
from ..core.fields import ANY, Context, Takes
from ..core.inputs import Input
from ..core.mappings import inline
from ..core.problems import Found, Problem, located, shown
from ..systems.controllers import UNIT


@dataclass(frozen=True)
class InputModel:
    """A number that a run from Python is told from step to step; a run from the command holds it at its start."""

    unit: Annotated[str, UNIT] = ""
    start: Annotated[Any, Takes(lambda value, context: value, ANY.told)] = 0.0


MODEL = inline(InputModel)


def resolve(raw: Any, context: Context) -> tuple[dict[str, Input], list[Found]]:
    """The section `inputs`, and what is wrong with it."""
    if not isinstance(raw, dict | None):
        return {}, [(("inputs",), Problem("a mapping of names, each {unit: ..., start: ...}", shown(raw)))]
    known, found = dict[str, Input](), list[Found]()
    for name, entry in (raw or {}).items():
        try:
            check_name(name, context.parameters)
            known[name] = read_input(name, entry, context)
        except InputError as error:
            found += [(("inputs", name, *keys), problem) for keys, problem in located(error)]
    return known, found


def read_input(name: str, entry: object, context: Context) -> Input:
    """An input in SI units."""
    given: InputModel = MODEL.read(entry, context)
    dimension = units.find_dimension(given.unit) if given.unit else units.NUMBER
    return Input(name, given.unit, units.convert(given.start, dimension, context.parameters))


def steered(raw: Any, context: Context) -> tuple[dict[str, Input], list[Found]]:
    """What controllers will give, before they are read, and names that do not do."""
    known, found = dict[str, Input](), list[Found]()
    for name, entry in (raw if isinstance(raw, dict) else {}).items():
        try:
            check_name(name, context.parameters)
            unit = UNIT.read(entry.get("unit", ""), context) if isinstance(entry, dict) else ""
            known[name] = Input(name, unit)
        except InputError as error:
            found += [(("controllers", name), problem) for _, problem in located(error)]
    return known, found


def check_name(name: str, parameters: Mapping[str, Any]) -> None:
    """A name that stands for nothing else in expressions."""
    if not name.isascii() or not name.isidentifier() or name in expressions.RESERVED or name in units.UNITS or name in parameters:
        raise Problem("a name of letters, digits and _ that is no function, unit or parameter", shown(name))


INPUT = Takes(lambda value, context: value, MODEL.told)  #: one that has been resolved
