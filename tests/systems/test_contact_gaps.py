"""Nothing passes between the points of a body: what overlaps it anywhere is found, or refused
before the run.
"""

from __future__ import annotations

import cProfile
import pstats
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.bodies import Body, Given, Material, cable, rigid
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.contact.beams import ContactBeam
from fmbs_skfem.contact.contacts import (
    Contact,
    ContactBox,
    ContactCylinder,
    ContactHeights,
    ContactSphere,
)
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.systems import At, Motion, assemble
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.measures import probes

from ..bodies.test_plate import rectangle
from ..models import segment

RADIUS = 1e-3  #: of the section
LAW: dict[str, Any] = {"name": "c", "body": "b", "stiffness": 2e4}
KINDS = ["sphere", "cylinder", "box", "heights"]
SOFT = Material(1e6, 100.0)


def beam(dim: int, EI: float = 1.0) -> Body:
    """1 m along x in five cells, the points of which are 100 mm apart by default."""
    return cable("b", segment(5), Given(EA=1e6, EI=EI, rhoA=0.2, radius=RADIUS), dim=dim)


def is_found(part: Body, contact: Contact, *others: Body) -> bool:
    """Whether a contact is seen to overlap at the start."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", Notice)
        assemble([part, *others], loads=[contact])
    return any("overlap" in str(one.message) for one in told)


def across(kind: str, x: float, dim: int, below: float = 0.0) -> Contact:
    """What is thinner than the cells of a beam, below its place x, and overlaps it by part of its
    radius, or is `below` that.
    """
    rest: tuple[float, ...] = (0.0,) * (dim - 2)
    if kind == "box":  # with a corner, or an edge, up
        turned: dict[str, Any] = {"along": (1.0, 1.0, *rest)} | (
            {} if dim == 2 else {"across": (1.0, -1.0, 0.0)}
        )
        center = (x, -0.01 * np.sqrt(2.0) - 0.5 * RADIUS - below, *rest)
        return ContactBox(**LAW, sides=(0.02, 0.02, 0.3)[:dim], center=center, **turned)
    if kind == "heights":  # which are along y in the plane, and along z in space
        ridge = (
            0.05 * np.exp(-(((np.arange(101) - round(100 * x)) / 1.2) ** 2))
            - 0.05
            - 0.5 * RADIUS
            - below
        )
        if dim == 2:
            return ContactHeights(**LAW, corner=(0.0, 0.0), step=(0.01,), heights=ridge.tolist())
        return ContactHeights(
            **LAW,
            corner=(0.0, -0.1, 0.0),
            step=(0.01, 0.1),
            heights=[[float(one)] * 3 for one in ridge],
        )
    center = (x, -0.95 * (0.01 + RADIUS) - below, *rest)
    if kind == "sphere":
        return ContactSphere(**LAW, center=center, diameter=0.02)
    return ContactCylinder(
        **LAW, center=center, diameter=0.02, **({} if dim == 2 else {"axis": (0.0, 0.0, 1.0)})
    )


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_thin_is_found_all_along_a_beam(kind: str, dim: int) -> None:
    for x in np.random.default_rng(1).uniform(0.02, 0.98, 3):
        assert is_found(beam(dim), across(kind, float(x), dim)), x
        assert not is_found(beam(dim), across(kind, float(x), dim, 1.1 * RADIUS)), x


@pytest.mark.parametrize("radius", [1e-3, 2e-4])
@pytest.mark.parametrize("dim", [2, 3])
def test_edges_are_found_between_points_of_a_slender_beam(dim: int, radius: float) -> None:
    """By a seventh of its radius, however large the box is."""
    thin = cable("b", segment(5), Given(EA=1e6, EI=1.0, rhoA=0.2, radius=radius), dim=dim)
    up: dict[str, Any] = {"along": (1.0, 1.0, 0.0)[:dim]} | (
        {} if dim == 2 else {"across": (1.0, -1.0, 0.0)}
    )
    for x in np.random.default_rng(4).uniform(0.02, 0.98, 5):
        for overlap, seen in ((radius / 7, True), (-1e-9, False)):
            center = (float(x), -0.05 * np.sqrt(2.0) - radius + overlap, 0.0)[:dim]
            assert (
                is_found(thin, ContactBox(**LAW, sides=(0.1, 0.1, 0.3)[:dim], center=center, **up))
                is seen
            ), x


def test_all_points_of_a_beam_are_read_at_once() -> None:
    """Five thousand of them take no more calls than five hundred."""
    calls = []
    for points in (500, 500, 5000):
        counted = cProfile.Profile()
        counted.runcall(is_found, beam(2), replace(across("sphere", 0.3, 2), points=points))
        calls.append(pstats.Stats(counted).total_calls)
    assert calls[2] < 1.2 * calls[1]


def of_beams(**more: Any) -> ContactBeam:
    return ContactBeam("c", body="b", other="o", stiffness=1e5, radius=0.005, **more)


def across_a_beam(dim: int, x: float, overlap: float) -> Body:
    """What touches the beam "b" at x: in the plane with its end, in space with a length that is
    hardly at an angle.
    """
    if dim == 2:
        return cable(
            "o",
            segment(5, (x, 0.01 - overlap, 0.0), (x + 0.02, 0.5, 0.0)),
            Given(EA=1e6, EI=1.0, rhoA=0.2),
            dim=2,
        )
    way = 0.4 * np.array([np.cos(0.15), np.sin(0.15), 0.0])
    ends = (tuple(np.array([x, 0.0, 0.01 - overlap]) + side * way) for side in (-0.9, 1.1))
    return cable("o", segment(5, *ends), Given(EA=1e6, EI=1.0, rhoA=0.2), dim=3)


@pytest.mark.parametrize("dim", [2, 3])
def test_beams_are_found_between_nodes(dim: int) -> None:
    for x in np.random.default_rng(5).uniform(0.02, 0.98, 5):
        for overlap, seen in ((0.0014, True), (-1e-9, False)):
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always", Notice)
                assemble([beam(dim), across_a_beam(dim, float(x), overlap)], loads=[of_beams()])
            assert any("overlap" in str(one.message) for one in told) is seen, x


def test_the_end_of_a_beam_is_caught_between_nodes() -> None:
    """A beam falls with its end between two cells of one that is held, whose centre line the end
    never reaches.
    """
    held = [joints.Clamp(name, At("b", name)) for name in ("left", "right")]
    start, measured = (
        {"o": Motion(velocity=(0.0, -1.0))},
        {"m": probes.Position(At("o", "left"), "y")},
    )
    system = assemble(
        [beam(2, 1e4), across_a_beam(2, 0.47, -0.005)],
        held,
        [of_beams()],
        outputs=measured,
        initial=start,
    )
    found = outputs(integrate(system, GeneralizedAlpha(1e-4), 0.02))
    assert found["m"].min() > 0.0, found["m"]


def test_too_few_nodes_of_beams_along_one_another_are_refused() -> None:
    with pytest.raises(
        InputError,
        match=r"'c'.points: expected .* of 0.01 m passes: 10\d parts .*, got gaps .* 10 parts",
    ):
        assemble([beam(2), across_a_beam(2, 0.5, -0.1)], loads=[of_beams(points=11)])


@pytest.mark.parametrize("size", [0.02, 0.1])
def test_what_a_body_carries_is_found_too(size: float) -> None:
    for x in np.random.default_rng(2).uniform(0.0, 1.0, 3):
        ball = rigid.rigid("ball", 1.0, 0.1, (float(x), 0.95 * (size / 2 + RADIUS)), dim=2)
        assert is_found(beam(2), ContactSphere(**LAW, diameter=size, on=At("ball")), ball)


@pytest.mark.parametrize("cells", [1, 3])
def test_what_is_thin_is_found_all_over_a_plate(cells: int) -> None:
    """A ball of 80 mm below the face of a square of 1 m, of whose radius 13 % may be missed, one at
    the edge of a planar one.
    """
    for x, y in np.random.default_rng(3).uniform(0.02, 0.98, (3, 2)):
        under = ContactSphere(**LAW, center=(float(x), float(y), -0.85 * 0.045), diameter=0.08)
        assert is_found(plate("b", rectangle("ancf", cells, cells), 0.01, SOFT), under), (x, y)
        beside = ContactSphere(**LAW, center=(float(x), -0.95 * 0.04), diameter=0.08)
        assert is_found(plate("b", rectangle("ancf", cells, cells), 0.01, SOFT, dim=2), beside), x


@pytest.mark.parametrize("speed", [2.0, 200.0])
@pytest.mark.parametrize("kind", KINDS)
def test_a_beam_that_comes_is_caught(kind: str, speed: float) -> None:
    """Between two nodes, also where it leaps by 100 mm in a step, over all that is thin."""
    rails = [joints.Slider(name, At("b", name), direction=(0.0, 1.0)) for name in ("left", "right")]
    start, hard = (
        {"b": Motion(velocity=(0.0, -speed))},
        replace(across(kind, 0.47, 2, 0.03), stiffness=1e8),
    )
    measured = {"m": probes.Position(At("b", 0.47), "y")}
    system = assemble([beam(2, 1e3)], rails, [hard], outputs=measured, initial=start)
    found = outputs(integrate(system, GeneralizedAlpha(5e-4), 0.02 if speed < 10.0 else 1e-3))
    assert found["m"].min() > -0.04, found["m"]


@pytest.mark.parametrize(
    "contact, message",
    [
        (
            ContactSphere(**LAW, center=(0.5, -0.02), diameter=0.02, points=21),
            r"'c'.points: expected .* of 0.011 m passes: 91 parts",
        ),
        (
            ContactBox(**LAW, sides=(1.0, 0.02), center=(0.5, -0.02), points=3),
            r"'c'.points: expected .* of 0.001 m passes: 1001 parts",
        ),
    ],
)
def test_too_few_points_are_refused(contact: Contact, message: str) -> None:
    with pytest.raises(InputError, match=message):
        assemble([beam(2)], loads=[contact])


def test_plates_that_would_need_too_many_points_are_refused() -> None:
    under = ContactSphere(**LAW, center=(0.5, 0.5, -0.01), diameter=0.002)
    with pytest.raises(
        InputError, match=r"'c'.points: expected .* take more points, or name the places that touch"
    ):
        assemble([plate("b", rectangle("ancf", 2, 2), 0.001, SOFT)], loads=[under])
