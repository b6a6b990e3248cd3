"""From a Scene to a family: its parameters with ranges, and the function from their values to a
case.

    mu -> (system with all multipliers, scheme, duration, Newton)      by reading the scene again with other values

Whatever the scene writes with a parameter depends on it: materials, sections, loads, drives, the
step, the duration.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ..core.values.arguments import checked
from ..core.values.fields import Count, Time
from . import schema

if TYPE_CHECKING:
    from ..core.values.ranges import Parameter
    from ..dynamics import Trajectory
    from ..reduction.cases import Case, Family


@checked
def family(
    scene: schema.Scene,
    *,
    cells: Count | None = None,
    allow_outside: bool = False,
    duration: Time | None = None,
) -> tuple[tuple[Parameter, ...], Family]:
    """The parameters of a scene that have a range, and the function from values of its parameters
    to a case.

    The function takes any of the scene's parameters; those not given keep the values of `scene`.
    `cells` remeshes cables with that many cells, `allow_outside` permits meshes outside the scene's
    project folder, `duration` [s] replaces the scene's. The function raises InputError where the
    scene with these values is none.
    """
    return parameters(scene), functools.partial(
        member, scene=scene, cells=cells, allow_outside=allow_outside, duration=duration
    )


def parameters(scene: schema.Scene) -> tuple[Parameter, ...]:
    """The parameters of a scene that have a range, in the order of the file."""
    return tuple(
        with_value(limits, scene.parameters[name]) for name, limits in scene.ranges.items()
    )


def with_value(limits: Parameter, value: float | None) -> Parameter:
    """A parameter whose nominal value is this one, or the middle of the range where it is outside."""
    return replace(
        limits, value=value if value is not None and limits.low <= value <= limits.high else None
    )


def member(
    values: Mapping[str, float],
    scene: schema.Scene,
    cells: int | None = None,
    allow_outside: bool = False,
    duration: float | None = None,
) -> Case:
    """The case of a scene with these values of its parameters."""
    from ..reduction.cases import Case
    from . import build

    found = with_values(scene, values)
    analysis = build.stepped(found)
    end = analysis.duration if duration is None else duration
    return Case(build.system(found, cells, allow_outside), analysis.scheme, end, analysis.newton)


def equilibria(
    values: Mapping[str, float], scene: schema.Scene, allow_outside: bool = False
) -> Trajectory:
    """The path of a static scene with these values of its parameters; SolverError where it has
    none.
    """
    from . import build

    found = with_values(scene, values)
    analysis = build.history(found)
    raw = build.system(found, None, allow_outside)
    analysis.require(found, raw)
    return analysis.solve(build.chosen_form(found, raw))


def with_values(scene: schema.Scene, values: Mapping[str, float]) -> schema.Scene:
    """The scene read again with other values of its parameters, SI."""
    return scene.again({name: float(value) for name, value in values.items()})
