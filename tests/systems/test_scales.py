"""Joints, ranks and gaps of systems of a picometre and of thousands of kilometres: the same as
those of a metre.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.bodies import Given, cable, point_mass
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints, mechanism, redundancy

from ..models import segment
from .test_mechanism import FOUR_BAR, Z, counts, hinge, link, loop

#: a parallelogram with all bars in one line
FLAT = [
    (0, 0, 0),
    (0.5, 0, 0),
    (1.5, 0, 0),
    (1.0, 0, 0),
]
SIZES = [1e-12, 1e-9, 1e-3, 1e6]


def facts(system: System) -> tuple[Any, ...]:
    """Unknowns, multipliers, rows left out, degrees of freedom, whether the start is singular."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        free = eliminate(system)
        kept = redundancy.without_redundant(free)
    singular = bool(len(kept.constraints.names)) and redundancy.singular_start(kept)
    return (
        free.size,
        len(kept.constraints.names),
        len(mechanism.redundant(system)),
        counts(system),
        singular,
    )


def held_beam(size: float, ancf: bool) -> System:
    section = Given(EA=1.0, EI=size**2, rhoA=1.0)
    body = cable("b", segment(10, (0, 0, 0), (size, 0, 0)), section, dim=2, ancf=ancf)
    return assemble(
        [body], [joints.Clamp("clamp", At("b", "left")), joints.Pin("pin", At("b", "right"))]
    )


def chain(size: float, points: list[tuple[float, float, float]], dim: int) -> System:
    return loop(
        [tuple(size * x for x in point) for point in points], dim, [Z if dim == 3 else None] * 4
    )


def twice_held(size: float) -> System:
    """One of two pins of a rigid bar follows from the other along it."""
    return assemble(
        [link("bar", (0, 0, 0), (size, 0, 0), 2)],
        [hinge("one", At("bar", "A")), hinge("two", At("bar", "B"))],
    )


SYSTEMS = {
    "spline": lambda size: held_beam(size, False),
    "ancf": lambda size: held_beam(size, True),
    "four-bar": lambda size: chain(size, FOUR_BAR, 2),
    "four-bar in space": lambda size: chain(size, FOUR_BAR, 3),
    "dead centre": lambda size: chain(size, FLAT, 2),
    "two pins": twice_held,
}


@pytest.mark.parametrize("name", list(SYSTEMS))
def test_joints_are_the_same_at_every_size(name: str) -> None:
    """Clamps of cells below a nanometre were left out as redundant."""
    wanted = facts(SYSTEMS[name](1.0))
    for size in SIZES:
        assert facts(SYSTEMS[name](size)) == wanted, size


def pinned(size: float, gap: float, to_body: bool, dim: int = 2, origin: float = 0.0) -> System:
    """A beam of a length, pinned at a distance from its end to a fixed point or to another beam."""
    section, rest = Given(EA=1.0, EI=size**2, rhoA=1.0), (0.0,) * (dim - 2)
    first = cable("a", segment(4, (origin, 0, 0), (origin + size, 0, 0)), section, dim=dim)
    start = origin + size + gap
    second = cable("b", segment(4, (start, 0, 0), (start + size, 0, 0)), section, dim=dim)
    other: Any = At("b", "left") if to_body else (start, 0.0, *rest)
    return assemble([first, second], [joints.Pin("pin", At("a", "right"), other)])


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e5])
@pytest.mark.parametrize("to_body", [True, False], ids=["body", "point"])
def test_gaps_of_all_kinds_have_one_rule(size: float, to_body: bool) -> None:
    """A gap to a fixed point was closed by tearing the cell beside it, one of a micrometre between
    bodies was refused.
    """
    with pytest.raises(
        InputError,
        match=r"joint 'pin': expected a\.right and .* at one point, got a gap of .*; move",
    ):
        pinned(size, 5e-3 * size, to_body)
    with pytest.raises(InputError, match="at one point"):
        pinned(size, 2e-6 * size, to_body)
    with pytest.warns(
        Notice,
        match=r"joint 'pin' closes a gap of .* m between a\.right and .*: give their coordinates more",
    ):
        pinned(size, 3e-7 * size, to_body)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pinned(size, 1e-11 * size, to_body)


@pytest.mark.parametrize("to_body", [True, False], ids=["body", "point"])
def test_round_off_far_from_the_origin_is_no_gap(to_body: bool) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pinned(1e-3, 0.0, to_body, dim=3, origin=1e4 / 3)


def test_a_point_that_meets_another_is_measured_by_all_bodies() -> None:
    masses = [
        point_mass("a", 1.0, np.array([0.0, 0.0])),
        point_mass("b", 1.0, np.array([1e-4, 0.0])),
    ]
    masses.append(point_mass("c", 1.0, np.array([1.0, 0.0])))
    with pytest.raises(
        InputError,
        match=r"joint 'pin': expected a\.center and b\.center at one point, got a gap of 0\.0001 m",
    ):
        assemble(masses, [joints.Pin("pin", At("a", "center"), At("b", "center"))])
