"""Where the section of a beam points along its line: pre-twist, fields of directions, lines that
are curved in the reference.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike
from scipy.integrate import quad_vec
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import ISection, Material, Rectangular, Section, Tube
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body, director, locate
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import outputs, solve_statics
from fmbs_skfem.scenes import reading
from fmbs_skfem.shapes import curves, line
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures import probes

ROOT, TIP = At("beam", "left"), At("beam", "right")
SECTION = BeamSection(np.diag([1e6, 4e5, 4e5, 60.0, 80.0, 20.0]), np.diag([1.0, 1e-4, 4e-4]))
# MacNeal and Harder 1985: L 12, width 1.1, depth 0.32, E 29e6, nu 0.22, 90 degrees from the root to
# the tip
STRIP, LENGTH = Rectangular(1.1, 0.32).of_beam(Material(29e6, 1.0, 0.22)), 12.0


def straight(
    section: BeamSection, length: float, cells: int, **axes: ArrayLike | Mapping[float, ArrayLike]
) -> Body:
    """A beam along x."""
    curve = curves.Straight(np.zeros(3), np.array([length, 0.0, 0.0]), length)
    ends = curves.Line(
        np.linspace(0.0, length, cells + 1), curve, {"left": 0.0, "right": length}, None
    )
    return beam("beam", ends, section, **axes)  # type: ignore[arg-type]


def tip(part: Body, force: tuple[float, ...]) -> np.ndarray:
    """How far the free end of a cantilever goes under a force there (3,)."""
    held, load = joints.Clamp("root", ROOT), loads.PointForce("F", TIP, force)
    found = outputs(
        solve_statics(
            eliminate(assemble([part], [held], [load], outputs={"tip": probes.Position(TIP)})), 1
        )
    )
    return (
        np.array([found[f"tip_{c}"][-1] for c in "xyz"]) - part.reference[part.constant > 0.5][-1]
    )


def frame(part: Body, s: float) -> np.ndarray:
    """d_1, d_2, d_3 (3, 3) at an arc length in the reference."""
    here = line.sample(part.space, np.array([float(locate(part, s))]))
    return np.concatenate([here @ director(part, k) @ part.reference for k in (1, 2, 3)])


def exact(force: np.ndarray) -> np.ndarray:
    """Tip of the twisted strip by its flexibility: bending by (L - x) e_x x F and shear, in axes
    that turn with x (3,).
    """
    flexible = np.linalg.inv(STRIP.stiffness)

    def rate(x: float) -> np.ndarray:
        a = 0.5 * np.pi * x / LENGTH
        T = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(a), np.sin(a)], [0.0, -np.sin(a), np.cos(a)]])
        arm = np.array([LENGTH - x, 0.0, 0.0])
        gamma, kappa = np.split(flexible @ np.concatenate([T @ force, T @ np.cross(arm, force)]), 2)
        return T.T @ gamma + np.cross(T.T @ kappa, arm)

    return np.asarray(quad_vec(rate, 0.0, LENGTH, epsrel=1e-12)[0])


def test_the_twisted_strip_of_macneal() -> None:
    """0.005424 and 0.001754 under unit tip forces, as published; by the beam's own flexibility,
    with 12 cells.
    """
    part = straight(STRIP, LENGTH, 12, direction=(0.0, 1.0, 0.0), twist=0.5 * np.pi)
    for force, published in (((0.0, 1e-3, 0.0), 0.001754), ((0.0, 0.0, 1e-3), 0.005424)):
        found = 1e3 * tip(part, force)
        assert_allclose(found, exact(1e3 * np.array(force)), atol=1e-5 * np.abs(found).max())
        assert found @ force / np.linalg.norm(force) == pytest.approx(published, rel=3e-3)


def test_axes_are_orthonormal_to_the_fifth_power_of_the_cells() -> None:
    errors = []
    for cells in (4, 8, 16):
        part = straight(SECTION, 1.0, cells, direction=(0.0, 1.0, 0.0), twist=0.5 * np.pi)
        frames = np.stack([frame(part, s) for s in np.linspace(0.0, 1.0, 101)])
        errors.append(np.abs(frames @ frames.transpose(0, 2, 1) - np.eye(3)).max())
    assert (np.log2(np.divide(errors[:-1], errors[1:])) > 4.9).all()
    assert errors[-1] < 1e-8


def test_turns_and_directions_at_fractions() -> None:
    """A twist that rises as a parabola; directions that turn as it does; a point that the y axis
    points to.
    """
    y = (0.0, 1.0, 0.0)
    turned = lambda a: [0.0, np.cos(a), np.sin(a)]  # noqa: E731
    even = straight(SECTION, 2.0, 8, direction=y, twist={0.0: 0.1, 0.5: 0.3, 1.0: 0.7})
    for s in (0.0, 0.7, 1.0, 2.0):
        assert_allclose(
            frame(even, s)[1], turned(0.1 + 0.2 * s / 2 + 0.4 * (s / 2) ** 2), atol=1e-7
        )
    field = straight(SECTION, 2.0, 8, direction={0.0: y, 1.0: (1.0, 1.0, 1.0)})
    for s in (0.0, 1.0, 2.0):
        assert_allclose(frame(field, s)[1], turned(np.arctan2(s / 2, 1.0)), atol=1e-6)
    point = straight(SECTION, 2.0, 8, towards=(5.0, 0.0, -3.0))
    assert_allclose(frame(point, 1.3)[1], [0.0, 0.0, -1.0], atol=1e-12)


@pytest.mark.parametrize(
    "axes",
    [
        {"direction": (0.0, 1.0, 0.3), "twist": 0.4},
        {"direction": {0.0: (0.0, 1.0, 0.0), 1.0: (1.0, 1.0, 1.0)}},
        {"towards": (5.0, 1.0, -3.0)},
        {},
    ],
)
def test_a_beam_turns_with_its_section(axes: dict[str, Any]) -> None:
    """Placed, x -> origin + rotation x, all that its mesh and its axes make: line and directors."""
    turn = Rotation.from_rotvec([0.9, -0.3, 0.6]).as_matrix()
    origin = np.array([3.0, -1.0, 2.0])
    there = straight(SECTION, 2.0, 4, **axes)
    here = straight(SECTION, 2.0, 4, origin=origin, rotation=turn, **axes)
    line, moved = there.reference[::4], here.reference[::4]
    assert_allclose(moved, origin + line @ turn.T, atol=1e-12)
    for k in (1, 2, 3):
        assert_allclose(here.reference[k::4], there.reference[k::4] @ turn.T, atol=1e-12)


def test_twist_of_many_turns_is_told() -> None:
    """90 degrees a cell: a notice with the cells that do; more is refused; with these cells there
    is none.
    """
    with pytest.warns(
        Notice,
        match=r"its axes turn so far in a cell that they are off by 1\.\d %, .* take 14 cells",
    ):
        straight(SECTION, 1.0, 8, direction=(0.0, 1.0, 0.0), twist=4.0 * np.pi)
    for turns, cells in ((3, 25), (300, 1964)):
        with pytest.raises(
            InputError, match=rf"body 'beam': expected {cells} cells or more, got 8"
        ):
            straight(SECTION, 1.0, 8, direction=(0.0, 1.0, 0.0), twist=turns * 2.0 * np.pi)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        straight(SECTION, 1.0, 14, direction=(0.0, 1.0, 0.0), twist=4.0 * np.pi)


@pytest.mark.parametrize(
    "axes, named",
    [
        (
            {"direction": (1.0, 0.0, 0.0)},
            r"body 'beam'\.direction: expected a direction across the line, got one along it at \(",
        ),
        (
            {"towards": (5.0, 0.0, 0.0)},
            r"body 'beam'\.towards: expected a point across the line, got one along it at \(",
        ),
        (
            {"direction": {0.0: (0.0, 1.0, 0.0), 1.0: (0.0, -1.0, 0.0)}},
            "its axes turn so far in a cell",
        ),
        (
            {"direction": (0.0, 1.0, 0.0), "towards": (5.0, 1.0, 0.0)},
            "towards: expected a direction or a point, got both",
        ),
        ({"twist": {0.0: 1.0}}, r"twist: expected two or more at fractions"),
    ],
)
def test_axes_that_are_none(axes: dict[str, ArrayLike], named: str) -> None:
    with pytest.raises(InputError, match=named):
        straight(SECTION, 1.0, 8, **axes)


@pytest.mark.parametrize("soft", [(80.0, 8e4), (8e4, 80.0)])
def test_a_section_a_thousand_times_stiffer_one_way(soft: tuple[float, float]) -> None:
    """P L^3 / (3 EI) both ways of a force at 45 degrees, in one beam."""
    section = BeamSection(np.diag([1e8, 4e7, 4e7, 60.0, *soft]), np.diag([1.0, 1e-4, 4e-4]))
    found = tip(straight(section, 1.0, 8, direction=(0.0, 1.0, 0.0)), (0.0, 1e-3, 1e-3))
    assert_allclose(found[[2, 1]], 1e-3 / (3.0 * np.array(soft)) + 1e-3 / 4e7, rtol=1e-5)


def test_a_curved_beam_unrolls() -> None:
    """A quarter of a ring is straight under an end moment EI / R, wherever its section points."""
    R, EI = 1.0, 80.0

    def arc(xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        a, zero = np.asarray(xi) / R, np.zeros(len(xi))
        point = np.stack([R * np.sin(a), R * (1.0 - np.cos(a)), zero], axis=1)
        return point if derivative == 0 else np.stack([np.cos(a), np.sin(a), zero], axis=1)

    section = BeamSection(np.diag([1e6, 4e5, 4e5, 60.0, EI, EI]), np.diag([1.0, 1e-4, 1e-4]))
    length = 0.5 * np.pi * R
    ends = curves.Line(np.linspace(0.0, length, 9), arc, {"left": 0.0, "right": length}, None)
    part = beam("beam", ends, section, direction=(0.0, 0.0, 1.0), twist=0.4)
    moment, sensed = loads.Moment("M", TIP, (0.0, 0.0, -EI / R)), {"tip": probes.Position(TIP)}
    found = outputs(
        solve_statics(
            eliminate(assemble([part], [joints.Clamp("root", ROOT)], [moment], outputs=sensed)), 4
        )
    )
    assert_allclose([found[f"tip_{c}"][-1] for c in "xyz"], [length, 0.0, 0.0], atol=1e-4)


SCENE = """
schema: 1
bodies:
  bar: {type: point_mass, mass: 1 kg, position: [0, 0, 0]}
  arm: {type: beam, mesh: none.msh, section: {shape: circular, diameter: 1 cm}, AXES,
    material: {young_modulus: 210 GPa, density: 7850}}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
"""


def test_axes_of_a_scene() -> None:
    body = reading.loads(
        SCENE.replace("AXES", "direction: {0: [0, 1, 0], 1: [0, 0, 1]}, twist: 30 deg")
    ).bodies["arm"]
    assert body.direction == {0.0: (0.0, 1.0, 0.0), 1.0: (0.0, 0.0, 1.0)}  # type: ignore[attr-defined]
    assert body.twist == pytest.approx(np.pi / 6)  # type: ignore[attr-defined]
    body = reading.loads(
        SCENE.replace("AXES", "towards: [1 m, 0, 0], twist: {0: 0, 0.5: 10 deg, 1: 1 rad}")
    ).bodies["arm"]
    assert body.twist == pytest.approx({0.0: 0.0, 0.5: np.pi / 18, 1.0: 1.0})  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "axes, named",
    [
        (
            "direction: [0, 1, 0], towards: [1, 1, 1]",
            "arm.towards: expected a direction or a point, got both",
        ),
        ("direction: [0, 1]", r"arm.direction: expected a list of 3"),
        ("twist: {0: 1 deg, 2: 3 deg}", r"arm.twist.2: expected a number"),
        ("twist: 3 m", r"arm.twist: expected an angle"),
    ],
)
def test_axes_of_a_scene_that_are_none(axes: str, named: str) -> None:
    with pytest.raises(InputError, match=named):
        reading.loads(SCENE.replace("AXES", axes))


@pytest.mark.parametrize(
    "section, push, left",
    [
        (ISection(0.1, 0.2, 0.006, 0.009), (10.0, 0.0, 0.0), "0.34"),
        (ISection(0.1, 0.2, 0.006, 0.009), (0.0, 10.0, 0.0), ""),
        (Tube(0.04, 0.002), (10.0, 0.0, 0.0), ""),
        (Rectangular(0.02, 0.04), (10.0, 0.0, 0.0), ""),
    ],
)
def test_open_sections_that_are_twisted_at_a_clamp(
    section: Section, push: tuple[float, ...], left: str
) -> None:
    """1 - tanh(L/l) / (L/l) of the twist is left where warping is held, l^2 = E h^2 b^3 t / (24 G
    J): nothing is said of others.
    """
    part = straight(
        section.of_beam(Material(210e9, 7850.0, 0.3)), 1.0, 4, direction=(0.0, 1.0, 0.0)
    )
    system = eliminate(
        assemble([part], [joints.Clamp("root", ROOT)], [loads.Torque("M", TIP, push)])
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solve_statics(system, 1)
    found = [str(one.message) for one in caught if "warping" in str(one.message)]
    assert len(found) == bool(left)
    if left:
        assert f"'beam' at joint 'root', (0, 0, 0) m, {left} of the twist" in found[0]
        GJ = 1.0 / np.linalg.inv(section.of_beam(Material(210e9, 7850.0, 0.3)).stiffness)[3, 3]
        x = np.sqrt(GJ / (210e9 * 0.191**2 * 0.1**3 * 0.009 / 24.0))
        assert 1.0 - np.tanh(x) / x == pytest.approx(float(left), abs=0.01)
