"""Beams with torsion in contact: with a floor, and with one another as cables of the same stiffness
are.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Body, Tapered, cable
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.beams.drawn_sections import ISection, Tube
from fmbs_skfem.bodies.sections import Circular, Material, Rectangular, Section
from fmbs_skfem.contact.beams import ContactBeam
from fmbs_skfem.contact.contacts import ContactPlane
from fmbs_skfem.contact.states import ContactState
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs, solve_statics
from fmbs_skfem.systems import At, Motion, Rayleigh, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures import probes

from ..models import segment

MADE = Material(2e9, 1000.0, 0.0)


@pytest.mark.parametrize(
    ("shape", "radius"),
    [
        (Circular(0.04), 0.02),
        (Tube(diameter=0.04, wall=5e-3), 0.02),
        (Rectangular(0.03, 0.02), np.sqrt(6e-4 / np.pi)),
        (ISection(width=0.06, height=0.12, web=0.006, flange=0.008), np.sqrt(0.06 * 0.12 / np.pi)),
    ],
)
def test_a_section_is_round_to_others(shape: Section, radius: float) -> None:
    """Of the radius of the circle with the area of its convex hull, wherever the line passes
    through it.
    """
    assert shape.of_beam(MADE).radius == pytest.approx(radius)
    assert shape.of_beam(MADE, (0.1, 0.2)).radius == pytest.approx(radius)


def test_a_beam_comes_to_rest_on_a_floor() -> None:
    """Its weight is the force of the floor, and the line is as high as the radius of its section,
    less what the floor gives way.
    """
    section = Rectangular(0.03, 0.02).of_beam(MADE)
    part = beam("b", segment(6, (0.0, 0.0, 0.05), (0.5, 0.0, 0.05)), section)
    weight = 9.81 * 1000.0 * 6e-4 * 0.5
    floor = ContactPlane(
        "floor",
        body="b",
        point=(0.0, 0.0, 0.0),
        normal=(0.0, 0.0, 1.0),
        stiffness=2e4,
        dissipation=2.0,
    )
    sensed = {"on": ContactState("floor"), "end": probes.Position(At("b", "right"), "z")}
    pushing = [loads.Gravity((0.0, 0.0, -9.81)), floor]
    system = eliminate(assemble([part], [], pushing, Rayleigh(stiffness=1e-3), sensed))
    found = outputs(integrate(system, GeneralizedAlpha(1e-3, 0.6), 3.0))
    assert found["on_force"][-1] == pytest.approx(weight, rel=2e-2)
    assert 0.9 * section.radius < found["end"][-1] < section.radius


def crossing(kind: str) -> list[Body]:
    """Cantilevers of a metre along x and y, the first one above the second, that cross half a metre
    from both roots.
    """
    ends = {
        "upper": ((0.0, 0.0, 0.0405), (1.0, 0.0, 0.0405)),
        "lower": ((0.5, -0.5, 0.0), (0.5, 0.5, 0.0)),
    }
    if kind == "cable":
        return [
            cable(name, segment(10, *both), Circular(0.04), MADE) for name, both in ends.items()
        ]
    return [
        beam(name, segment(10, *both), Circular(0.04).of_beam(MADE)) for name, both in ends.items()
    ]


def test_beams_press_on_one_another_as_cables_do() -> None:
    """A tip force lays one on the other, a gap of half a millimetre before: force and deflections
    are those of slender cables.
    """
    found = []
    for kind in ("cable", "beam"):
        held = [joints.Clamp(name, At(name, "left")) for name in ("upper", "lower")]
        pushing = [
            loads.PointForce("F", At("upper", "right"), (0.0, 0.0, -20.0)),
            ContactBeam("touch", body="upper", other="lower", stiffness=1e5),
        ]
        sensed = {
            "on": ContactState("touch"),
            "a": probes.Position(At("upper", "right")),
            "b": probes.Position(At("lower", "right")),
        }
        system = eliminate(assemble(crossing(kind), held, pushing, outputs=sensed))
        last = outputs(solve_statics(system, 10))
        found.append(np.array([last[column][-1] for column in ("on_force", "a_z", "b_z")]))
    assert found[0][0] > 5.0
    assert_allclose(found[1], found[0], rtol=5e-3)


def test_momentum_is_kept_where_two_free_beams_meet() -> None:
    a, b = crossing("beam")
    start = {"upper": Motion((0.0, 0.0, -1.0))}
    touch = ContactBeam("touch", body="upper", other="lower", stiffness=1e5)
    system = eliminate(
        assemble(
            [a, b],
            [],
            [touch],
            initial=start,
            outputs={"on": ContactState("touch"), "E": probes.Energy()},
        )
    )
    motion = integrate(system, GeneralizedAlpha(1e-4, 1.0), 0.02)
    momentum = motion.v @ system.mass @ np.kron(system.unit[:, None], np.eye(3))
    assert outputs(motion)["on_force"].max() > 1.0
    assert_allclose(
        momentum, np.tile(momentum[0], (len(momentum), 1)), atol=1e-9 * np.abs(momentum[0]).max()
    )
    assert np.ptp(outputs(motion)["E_balance"]) < 1e-2 * outputs(motion)["E_kinetic"][0]


@pytest.mark.parametrize("kind", ["beam", "cable"])
def test_tapered_lines_touch_with_the_radius_of_their_place(kind: str) -> None:
    """A cone whose underside is level, 1 mm above a floor: all of it, and its thin end alone."""
    cone, ends = (
        Tapered({0.0: Circular(0.04), 1.0: Circular(0.02)}),
        ((0.0, 0.0, 0.02), (0.5, 0.0, 0.01)),
    )
    part = (
        cable("b", segment(6, *ends), cone, MADE)
        if kind == "cable"
        else beam("b", segment(6, *ends), cone, MADE)
    )
    below: dict[str, object] = {
        "point": (0.0, 0.0, -1e-3),
        "normal": (0.0, 0.0, 1.0),
        "stiffness": 1.0,
    }
    floors = [
        ContactPlane("all", body="b", **below),
        ContactPlane("end", at=At("b", "right"), **below),
    ]  # type: ignore[arg-type]
    system = eliminate(
        assemble([part], [], floors, outputs={one: ContactState(one) for one in ("all", "end")})
    )
    found = outputs(integrate(system, GeneralizedAlpha(1e-3), 1e-3))
    assert_allclose([found["all_gap"][0], found["end_gap"][0]], 1e-3, atol=1e-9)


def test_tapered_beams_touch_others_with_their_largest_radius() -> None:
    cone = Tapered({0.0: Circular(0.04), 1.0: Circular(0.02)})
    one, two = (
        cable(name, segment(6, (0.0, y, 0.0), (1.0, y, 0.0)), cone, MADE)
        for name, y in (("a", 0.0), ("b", 1.0))
    )
    with pytest.warns(
        Notice, match="load 'c': 'a' tapers, and touches with its largest radius, 0.02 m, all along"
    ):
        assemble([one, two], [], [ContactBeam("c", body="a", other="b")])


@pytest.mark.parametrize(
    "shape", [Circular(0.04), Tube(diameter=0.04, wall=4e-3)], ids=["solid", "tube"]
)
@pytest.mark.parametrize("slope", [0.0, 0.2])
def test_a_bar_rolls(shape: Section, slope: float) -> None:
    """a = g sin(slope) / (1 + I / (m R^2)) from rest; one that slides on a level floor by v ends
    with v / (1 + I / (m R^2)).
    """
    section, stiffness, g = shape.of_beam(MADE), 2e4, 9.81
    inertia = (section.mass[1, 1] + section.mass[2, 2]) / (section.mass[0, 0] * section.radius**2)
    # it has sunk in by its weight
    height = section.radius - 0.5 * section.mass[0, 0] * g * np.cos(slope) / stiffness
    part = beam("b", segment(4, (0.0, 0.0, height), (0.0, 0.5, height)), section)
    floor = ContactPlane(
        "floor",
        body="b",
        point=(0.0, 0.0, 0.0),
        normal=(0.0, 0.0, 1.0),
        stiffness=stiffness,
        friction=0.4,
        shared=True,
    )
    weight, start = (
        loads.Gravity((g * np.sin(slope), 0.0, -g * np.cos(slope))),
        {"b": Motion((0.0 if slope else 1.0, 0.0, 0.0))},
    )
    middle = At("b", 0.25)
    sensed = {
        "at": probes.Position(middle),
        "spin": probes.AngularVelocity(middle, axis=(0.0, 1.0, 0.0)),
    }
    system = eliminate(assemble([part], [], [weight, floor], initial=start, outputs=sensed))
    found = outputs(integrate(system, GeneralizedAlpha(1e-3, 0.9), 0.4))
    if slope:
        assert found["at_x"][-1] == pytest.approx(
            0.5 * g * np.sin(slope) / (1.0 + inertia) * 0.4**2, rel=2e-4
        )
    else:
        assert (found["at_x"][-1] - found["at_x"][-101]) / 0.1 == pytest.approx(
            1.0 / (1.0 + inertia), rel=1e-3
        )
    speed = (found["at_x"][-1] - found["at_x"][-3]) / 2e-3
    assert found["spin"][-2] * section.radius == pytest.approx(speed, rel=2e-3)
