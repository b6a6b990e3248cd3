"""Closed loops with redundant joints, singular positions, massless axes and sliders, joints that
contradict each other.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.errors import Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, energy_drift, integrate, outputs, reactions
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.connections.redundancy import singular_start, without_redundant
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from ..systems.rigid_parts import grid

STEP = GeneralizedAlpha(1e-3)
OPEN = [(0, 0), (0, 0.5), (1.2, 0.9), (1, 0)]  #: joints of a four-bar
FLAT = [(0, 0), (0.5, 0), (1.5, 0), (1.0, 0)]  #: a parallelogram with all bars in one line


def bar(name: str, start: Sequence[float], end: Sequence[float], dim: int) -> Body:
    """Rod of 1 kg/m with the places `s` and `e`."""
    a, b, rest = np.array(start, float), np.array(end, float), (0.0,) * (dim - 2)
    mass = float(np.linalg.norm(b - a))
    u, inertia, turn = (b - a) / mass, mass**3 / 12, np.eye(dim)
    turn[:2, :2] = [[u[0], -u[1]], [u[1], u[0]]]
    moments = inertia if dim == 2 else (0.2 * inertia, inertia, inertia)
    places = {"s": (*a, *rest), "e": (*b, *rest)}
    return rigid(name, mass, moments, (*(a + b) / 2, *rest), dim=dim, rotation=turn, places=places)


def four_bar(dim: int, points: list[tuple[float, float]]) -> System:
    """Four revolute joints about z under gravity; outputs `B`, `angle`, `D`."""
    bars = [bar(name, points[k], points[k + 1], dim) for k, name in enumerate("abc")]
    axis = {} if dim == 2 else {"axis": (0, 0, 1)}
    pins = [
        joints.Revolute("A", At("a", "s"), **axis),
        joints.Revolute("B", At("a", "e"), At("b", "s"), **axis),
        joints.Revolute("C", At("b", "e"), At("c", "s"), **axis),
        joints.Revolute("D", At("c", "e"), **axis),
    ]
    down = loads.Gravity((0, -9.81, 0)[:dim])
    sensed = {
        "B": probes.Position(At("b", "s")),
        "angle": probes.Angle(At("a", "frame"), **axis),
        "D": probes.Reaction("D"),
    }
    return eliminate(assemble(bars, pins, [down], outputs=sensed))


@pytest.mark.parametrize("points", [OPEN, FLAT], ids=["open", "flat"])
def test_a_planar_four_bar_in_space(points: list[tuple[float, float]]) -> None:
    """Three rows of four revolute joints in space are redundant: motion and forces in the plane are
    those of the planar one.

    From the flat position, where the planar rows are singular and forces are without bound, only
    the motion is compared.
    """
    plane = integrate(four_bar(2, points), STEP, 0.5)
    with pytest.warns(Notice, match="redundant constraint rows are left out") as told:
        space = integrate(four_bar(3, points), STEP, 0.5)
    named = str(told[0].message).split(": ")[1].split(", ")
    assert len(named) == 3
    assert all("e3" in name or "axis" in name for name in named)
    flat, deep = outputs(plane), outputs(space)
    assert abs(flat["angle"][-1]) > 0.4
    for column in ("B_x", "B_y", "angle"):
        assert_allclose(deep[column], flat[column], atol=1e-7)
    for column in ("D_x", "D_y") if points is OPEN else ():
        assert_allclose(deep[column], flat[column], atol=1e-3)
    assert_allclose(deep["B_z"], 0.0, atol=1e-10)


def test_a_singular_position_is_no_redundancy() -> None:
    """All bars in one line: the rows depend on each other there and nowhere else; all of them are
    kept.
    """
    flat, apart = four_bar(2, FLAT), four_bar(2, OPEN)
    assert singular_start(flat)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert without_redundant(flat) is flat
        assert without_redundant(apart) is apart


def test_reactions_of_redundant_joints_hold_the_weight() -> None:
    """The four-bar at the start: forces of A and D in the plane balance weight and acceleration;
    dropped rows carry nothing.
    """
    with pytest.warns(Notice, match="redundant"):
        trajectory = integrate(four_bar(3, OPEN), STEP, 0.1)
    full, found = trajectory.system.full, reactions(trajectory)
    assert full is not None
    assert set(found) == set(full.constraints.names)
    lift = trajectory.system.lift.matrix
    a, q = np.asarray(lift @ trajectory.a[-1]), full.mass
    translation = np.concatenate([np.tile([0, 1, 0], 4) * np.repeat([1, 0, 0, 0], 3)] * 3)
    inertia = float(translation @ (q @ a))
    weight = -9.81 * sum(np.linalg.norm(np.subtract(OPEN[k + 1], OPEN[k])) for k in range(3))
    assert found["A", "y"][-1] + found["D", "y"][-1] == pytest.approx(inertia - weight, rel=1e-8)


def test_a_drive_against_a_weld_is_named() -> None:
    """A drive that a weld forbids is not a redundancy, although both hold at the start."""
    body = bar("a", (0, 0), (1, 0), 2)
    held = [
        joints.Weld("weld", At("a", "s")),
        joints.DrivenAngle("drive", At("a", "frame"), lambda t: t),
    ]
    with pytest.raises(
        SolverError, match=r"contradict each other: .*drive\.angle.*a driven motion must be free"
    ) as caught:
        integrate(eliminate(assemble([body], held)), STEP, 0.01)
    assert caught.value.reason is Reason.INCONSISTENT


def test_two_welds_are_one() -> None:
    body = bar("a", (0, 0), (1, 0), 2)
    held = [
        joints.Pin("pin", At("a", "s")),
        joints.Prismatic("guide", At("a", "s"), (1, 0)),
        joints.Weld("weld", At("a", "s")),
    ]
    with pytest.warns(Notice, match="redundant"):
        trajectory = integrate(
            eliminate(assemble([body], held, [loads.Gravity((0, -9.81))])), STEP, 0.01
        )
    assert_allclose(trajectory.x, trajectory.x[0] * np.ones_like(trajectory.x), atol=1e-12)


@pytest.mark.parametrize("inertia", [(0.0, 1 / 12, 1 / 12), (0.2, 0.3, 0.5)], ids=["rod", "lamina"])
def test_massless_axes(inertia: tuple[float, float, float]) -> None:
    """A chain of bodies with axes without mass swings and keeps its energy."""
    links = [
        rigid(f"{k}", 1.0, inertia, (k + 0.5, 0, 0), places={"s": (k, 0, 0), "e": (k + 1, 0, 0)})
        for k in range(3)
    ]
    pins = [joints.Revolute("0", At("0", "s"), None, (0, 1, 0))]
    pins += [
        joints.Revolute(f"{k}", At(f"{k}", "s"), At(f"{k - 1}", "e"), (0, 1, 0)) for k in (1, 2)
    ]
    system = eliminate(assemble(links, pins, [loads.Gravity((0, 0, -9.81))]))
    trajectory = integrate(system, STEP, 0.5)
    assert energy_drift(trajectory) < 1e-3 * 9.81 * 4.5


def test_a_slider_without_mass() -> None:
    """A rim of a plate pinned to a line: the plate falls about its free rim centre, whose
    horizontal momentum stays zero.
    """
    body = plate(
        "lug",
        grid(3, 3),
        0.01,
        Material(7e10, 2700.0),
        dim=2,
        rims={"rim": Rim(("left",), (0.0, 0.5))},
    )
    guide, rim = joints.Slider("guide", At("lug", "rim"), (1.0, 0.0)), At("lug", "rim")
    sensed = {"rim": probes.Position(rim), "angle": probes.Angle(rim)}
    system = eliminate(assemble([body], [guide], [loads.Gravity((0.0, -9.81))], outputs=sensed))
    trajectory = integrate(system, GeneralizedAlpha(5e-4), 0.3)
    found = outputs(trajectory)
    assert_allclose(found["rim_y"], 0.5, atol=1e-12)
    unit = np.outer(body.constant, [1.0, 0.0]).ravel()
    momentum = np.array(
        [unit @ (system.full.mass @ (system.lift.matrix @ v)) for v in trajectory.v]
    )  # type: ignore[union-attr]
    assert_allclose(momentum, 0.0, atol=1e-8)
    assert found["angle"][-1] < -0.2
    assert found["rim_x"][-1] > 0.01
