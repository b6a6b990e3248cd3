"""Corners and edges of boxes against plates in space, also between the points of these."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Body, Material, rigid
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.contact.contacts import ContactBox
from fmbs_skfem.contact.facet_points import ACROSS, box_points, narrowest, triangles
from fmbs_skfem.contact.facets import extents, meet_flat, meet_triangle
from fmbs_skfem.contact.points import gap_of_surface
from fmbs_skfem.contact.states import ContactState
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs, solve_statics
from fmbs_skfem.systems import (
    At,
    Motion,
    Rayleigh,
    System,
    assemble,
    check_force,
    compiled,
    eliminate,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.connections.frame_joints import Prismatic
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification.plates import rectangle

from ..forms import forms
from ..tangents import check_tangent_behind
from .test_contact_beams import momenta

TIGHT = Newton(tolerance=1e-12)
THICK, SIDE = 0.02, 0.1  #: of the plate, and sides of the box [m]
SOFT = Material(1e6, 1e3, 0.3)
TURNED = Rotation.align_vectors([[0.0, 0.0, 1.0]], [[1.0, 1.1, 0.9]])[
    0
].as_matrix()  #: a corner up, and one down
SMOOTH: dict[str, Any] = {
    "stiffness": 50.0,
    "damping": 0.004,
    "dissipation": 0.003,
    "smoothing": 0.002,
}

#: of the box from its centre
CORNERS = 0.5 * SIDE * np.array(list(product((-1.0, 1.0), repeat=3))) @ TURNED.T
FOOT = CORNERS[np.argmin(CORNERS[:, 2])]
AXES: dict[str, Any] = {"along": tuple(TURNED[:, 0]), "across": tuple(TURNED[:, 1])}


def over(at: tuple[float, float], height: float) -> np.ndarray:
    """The centre of a box with its lowest corner so high over a place of the plate."""
    return np.array([*at, 0.5 * THICK + height]) - FOOT


def sheet(kind: str = "fvs", cells: int = 2, material: Material = SOFT, **more: Any) -> Body:
    """A square of 1 m in the plane z = 0."""
    return plate("b", rectangle(kind, cells, cells), THICK, material, **more)


def corner_at(at: Any, up: bool = True, **more: Any) -> ContactBox:
    """A box that stands still with its highest or lowest corner somewhere."""
    center = np.array(at) + (FOOT if up else -FOOT)
    return ContactBox("c", body="b", sides=(SIDE,) * 3, center=tuple(center), **AXES, **more)


#: between points, at a node, on a side, beyond the rim
PLACES = [
    (0.31, 0.37),
    (0.5, 0.5),
    (0.25, 0.1),
    (1.003, 0.4),
]


@pytest.mark.parametrize("off", [0.0, 3e-13, 1e-12, 3e-12, 1e-11, 1e-9])
def test_the_closest_place_of_what_is_over_a_border(off: float) -> None:
    """Of bent triangles, turned and far away, from points over their sides but for `off`: that from
    a start within.
    """
    rng, body = np.random.default_rng(3), sheet()
    rows, at, corners = triangles(body, body.space)
    for k in range(4):
        bent = (rows @ body.reference.ravel()).reshape(-1, 3) @ Rotation.random(
            random_state=k
        ).as_matrix().T
        bent = (
            bent
            + 0.01 * rng.normal(size=bent.shape)
            + 100.0 * (np.arange(len(bent)) % 3 == 0)[:, None]
        )
        for corner, side in product(corners[::4], range(3)):
            y, places = bent.ravel(), np.ascontiguousarray(at[corner])
            x = bent[3 * corner]
            normal, l = np.cross(x[1] - x[0], x[2] - x[0]), np.zeros(3)
            l[side], l[side - 1], l[side - 2] = off, 0.3, 0.7 - off
            p = l @ x + 0.01 * normal / np.linalg.norm(normal)
            w, W = np.zeros((7, 3)), np.zeros((6, 9))
            ways = []
            for start in (meet_flat(y, corner, p)[1:], (0.3, 0.3), (0.5, 0.2), (0.2, 0.5)):
                meet_triangle(y, corner, places, p, *start, w, W)
                ways.append(np.linalg.norm(w[6]))
            assert ways[0] < min(ways) + 1e-9


@pytest.mark.parametrize("kind", ["fvs", "argyris"])
@pytest.mark.parametrize("width", [0.1, 0.02])
def test_points_on_edges_of_a_box_stand_closer_than_a_strip_is_wide(
    kind: str, width: float
) -> None:
    """Two on it or more wherever it crosses an edge, whatever cells it has; a square has its own
    width.
    """
    square = sheet(kind, 4)
    assert narrowest(square, square.space) == pytest.approx(1.0)
    strip = plate("b", rectangle(kind, 11, 2, 1.0, width), 3e-3, SOFT)
    turn = Rotation.from_euler("xyz", [0.3, 0.2, 0.5])
    body = replace(
        strip, reference=turn.apply(strip.reference.reshape(-1, 3)).reshape(strip.reference.shape)
    )
    assert narrowest(body, strip.space) == pytest.approx(width)
    found, apart = box_points(
        np.array([0.1, 0.17, 0.1]),
        2.0 * gap_of_surface(strip, strip.space, False)[0],
        width / ACROSS,
    )
    assert apart <= width / 2
    for edge in np.linspace(-0.17, 0.17 - width, 7):
        on = (
            (found[:, 0] > 0.099)
            & (found[:, 2] > 0.099)
            & (found[:, 1] >= edge - 1e-9)
            & (found[:, 1] <= edge + width + 1e-9)
        )
        assert on.sum() >= 2


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("kind", ["ancf", "nurbs", "fvs"])
@pytest.mark.parametrize("at", PLACES)
def test_contract(kind: str, at: tuple[float, float]) -> None:
    """Tangents of a smooth law, and after an accepted state of all of it, where corners stick and
    slide.
    """
    check_force([sheet(kind)], corner_at((*at, -0.002), **SMOOTH))
    check_force([sheet(kind)], corner_at((*at, 0.002), False, **SMOOTH, exponent=1.5, depth=0.003))
    system = replace(
        assemble([sheet(kind)], loads=[corner_at((*at, -0.006), friction=0.3, **SMOOTH)]),
        elastic=(),
    )
    check_tangent_behind(system, (1e-5, 1e-3))


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("at", PLACES)
def test_forces_have_a_potential(at: tuple[float, float]) -> None:
    """Without friction and damping the tangent is symmetric, whatever moves where they touch."""
    system = replace(
        assemble([sheet(), crate(over(at, -0.006))], loads=[carried(stiffness=500.0)]), elastic=()
    )
    # without points of the plate
    system = replace(system, loads=replace(system.loads, forces=system.loads.forces[1:]))
    x = system.x0 + 1e-3 * np.random.default_rng(2).normal(size=system.size)
    K = compiled.tangent(
        compiled.compile_system(system), x, np.zeros(len(system.constraints.names))
    ).toarray()
    assert np.abs(K).max() > 0.0
    assert_allclose(K, K.T, atol=1e-10 * np.abs(K).max())


def crate(center: np.ndarray, mass: float = 1.0) -> Body:
    """A rigid box."""
    return rigid.rigid(
        "box",
        mass,
        mass * SIDE**2 / 6.0 * np.ones(3),
        center,
        rotation=TURNED,
        places={"foot": center + FOOT},
    )


def carried(**more: Any) -> ContactBox:
    return ContactBox("c", body="b", on=At("box", "center"), sides=(SIDE,) * 3, **AXES, **more)


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("up", [True, False])
@pytest.mark.parametrize("at", np.random.default_rng(5).uniform(0.2, 0.8, (4, 2)).tolist())
def test_a_corner_is_found_wherever_it_is(at: list[float], up: bool) -> None:
    """k times the overlap, from below and above; between the points of the plate, too."""
    read = {"c": ContactState("c")}
    law = corner_at((*at, -0.008 if up else 0.008), up, stiffness=500.0)
    found = outputs(
        integrate(assemble([sheet()], loads=[law], outputs=read), GeneralizedAlpha(1e-9), 1e-9)
    )
    assert found["c_force"][0] == pytest.approx(1.0, rel=1e-6)
    assert found["c_gap"][0] == pytest.approx(-0.002, rel=1e-6)


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("y", [0.25, 0.31])
def test_an_edge_along_the_grid_is_found(y: float) -> None:
    """Of which n points push, each with k times the overlap; y is on a line of points of the plate,
    and between two.
    """
    axes = Rotation.from_euler("x", 45.0, degrees=True).as_matrix()
    center = (0.5, y, -0.5 * SIDE * np.sqrt(2.0) - 0.008)
    law = ContactBox(
        "c",
        body="b",
        sides=(0.8, SIDE, SIDE),
        center=center,
        along=(1.0, 0.0, 0.0),
        across=tuple(axes[:, 1]),
        stiffness=500.0,
    )
    system = assemble([sheet(cells=3)], loads=[law], outputs={"c": ContactState("c")})
    found = outputs(integrate(system, GeneralizedAlpha(1e-9), 1e-9))
    assert found["c_gap"][0] == pytest.approx(-0.002, rel=1e-6)
    assert found["c_force"][0] >= 3 * 0.9999  # of both ends and one point between


def test_the_surface_between_points_is_of_fourth_order() -> None:
    """Triangles of a cylinder of 1 m from its points and tangents: distances of its axis are wrong
    by h^4.
    """
    errors = []
    for h in (0.4, 0.2, 0.1):
        at = np.array([[0.0, 0.0], [h, 0.1 * h], [0.2 * h, h]])
        y = np.concatenate(
            [[np.sin(a), b, np.cos(a), np.cos(a), 0.0, -np.sin(a), 0.0, 1.0, 0.0] for a, b in at]
        )
        corners, w, W = np.arange(3), np.zeros((27, 3)), np.empty((6, 9))
        a, b = at.mean(axis=0)
        p = np.array([1.1 * np.sin(a), b, 1.1 * np.cos(a)])
        flat, u, v = meet_flat(y, corners, p)
        long, bulge = extents(y, corners[None], at)
        meet_triangle(y, corners, at, p, u, v, w, W)
        away = np.linalg.norm(w[6])
        assert flat - bulge < away < flat + bulge
        assert long == pytest.approx(
            max(np.linalg.norm(y[a : a + 3] - y[b : b + 3]) for a, b in ((0, 9), (9, 18), (0, 18)))
        )
        errors.append(abs(away - 0.1))
    assert errors[0] < 1e-4
    assert np.log2(errors[0] / errors[1]) > 3.9
    assert np.log2(errors[1] / errors[2]) > 3.9


def clamped(cells: int = 4) -> tuple[Body, joints.Joint]:
    """A square all rims of which are clamped."""
    rims = {"rim": Rim(("left", "right", "bottom", "top"), slopes=True)}
    return sheet("fvs", cells, Material(2e8, 1e3, 0.3), rims=rims), joints.Clamp(
        "clamp", At("b", "rim")
    )


def falling(
    speed: float,
    at: tuple[float, float],
    height: float = 0.003,
    stiffness: float = 5e4,
    **more: Any,
) -> System:
    """A box falls on a clamped plate, corner first, or lies on it."""
    body, clamp = clamped()
    read = {
        "c": ContactState("c"),
        "E": probes.Energy(),
        "foot": probes.Position(At("box", "foot")),
    }
    forces = [carried(stiffness=stiffness, **more), loads.Gravity((0.0, 0.0, -9.81))]
    held = (
        [clamp]
        if speed
        else [clamp, Prismatic("rail", At("box", "center"), direction=(0.0, 0.0, 1.0))]
    )
    start = {"box": Motion(velocity=(0.0, 0.0, -speed))}
    return assemble([body, crate(over(at, height), 0.5)], held, forces, Rayleigh(), read, start)


@pytest.mark.parametrize("speed", [2.0, 20.0])
@pytest.mark.parametrize("at", [(0.43, 0.56), (0.5, 0.5), (0.3125, 0.47)])
def test_a_box_that_falls_on_a_corner_bounces_off_with_its_energy(
    speed: float, at: tuple[float, float]
) -> None:
    """Its corner comes in by F / k and no more, also beyond the middle of the plate, and goes up
    again.
    """
    found = outputs(
        integrate(eliminate(falling(speed, at)), GeneralizedAlpha(2e-4, 1.0), 0.06, TIGHT)
    )
    assert found["c_force"].max() > 100.0
    assert -found["c_gap"].min() < 1.01 * found["c_force"].max() / 5e4
    assert np.ptp(found["E_balance"]) < 0.02 * found["E_kinetic"][0]
    assert found["foot_z"][-1] > 0.05


@pytest.mark.parametrize("speed", [200.0])
def test_a_box_does_not_leap_through_a_plate(speed: float) -> None:
    """Where it would move by twice the thickness in a step."""
    found = outputs(
        integrate(eliminate(falling(speed, (0.3, 0.4))), GeneralizedAlpha(2e-4, 1.0), 0.03, TIGHT)
    )
    assert -found["c_gap"].min() > THICK
    assert found["foot_z"][-1] > 0.0
    assert np.ptp(found["E_balance"]) < 0.03 * found["E_kinetic"][0]


def fly_into(step: float, duration: float, forces: list[Any]) -> dict[str, np.ndarray]:
    """Outputs of a box of 10 m/s that flies into a plate with all unknowns held."""
    body = sheet(cells=1, rims={"rim": Rim(("left", "right", "bottom", "top"), slopes=True)})
    read = {"c": ContactState("c"), "foot": probes.Position(At("box", "foot"))}
    parts, clamp = [body, crate(over((0.37, 0.37), 0.003))], joints.Clamp("clamp", At("b", "rim"))
    system = assemble(
        parts, [clamp], forces, outputs=read, initial={"box": Motion(velocity=(0.0, 0.0, -10.0))}
    )
    return outputs(integrate(eliminate(system), GeneralizedAlpha(step), duration))


@pytest.mark.filterwarnings("error")
def test_a_corner_keeps_its_side_however_deep_it_is() -> None:
    """A box that goes in with hardly a force, by 100 steps of half a millimetre, is pressed back by
    k times its depth at least.
    """
    found = fly_into(5e-5, 5e-3, [carried(stiffness=1e-3)])
    depth = 0.5 * THICK - found["foot_z"][-1]
    assert depth > 2.0 * THICK
    assert found["c_gap"][-1] == pytest.approx(-depth, rel=1e-6)
    assert found["c_force"][-1] > 0.999e-3 * depth


@pytest.mark.filterwarnings("error")
def test_a_corner_that_leaves_faster_than_it_is_pushed_keeps_its_side() -> None:
    """Damping leaves no force to push it back from below: nothing stands in its way up again."""
    found = fly_into(
        2e-4, 0.025, [carried(stiffness=1.0, damping=0.1), loads.Gravity((0.0, 0.0, 1e3))]
    )
    lowest = np.argmin(found["foot_z"])
    assert found["foot_z"][lowest] < -1.5 * THICK
    assert found["c_force"][: lowest - 1].max() > 0.9
    assert found["c_force"][lowest + 1 :].max() < 0.05
    assert found["foot_z"][-1] > THICK


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("at, springs", [((0.43, 0.56), 1), ((0.3125, 0.47), 1), ((0.5, 0.5), 2)])
def test_a_corner_that_stands_on_a_plate(at: tuple[float, float], springs: int) -> None:
    """The weight m g of a box that is guided presses its corner in by m g / k; a point of the plate
    right there pushes, too.
    """
    state = solve_statics(eliminate(falling(0.0, at, -1e-4, 2e4)))
    assert outputs(state)["c_gap"][-1] == pytest.approx(-0.5 * 9.81 / 2e4 / springs, rel=1e-3)
    assert outputs(state)["c_force"][-1] == pytest.approx(0.5 * 9.81, rel=1e-4)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_a_plate_and_a_box_that_meet_keep_momentum_and_its_moment(friction: float) -> None:
    """Both are free; the box comes askew and spins, with a corner or beyond the rim."""
    for at, velocity in (((0.43, 0.56), (0.5, 0.2, -2.0)), ((0.98, 0.4), (-0.5, 0.2, -2.0))):
        start = {"box": Motion(velocity=velocity)}
        read = {"c": ContactState("c"), "E": probes.Energy()}
        body, law = (
            sheet(cells=3, material=Material(1e8, 1e3, 0.3)),
            carried(stiffness=2e4, friction=friction),
        )
        system = assemble([body, crate(over(at, 0.003))], loads=[law], outputs=read, initial=start)
        motion = integrate(system, GeneralizedAlpha(2e-4, 1.0), 0.03, TIGHT)
        found, (P, L) = outputs(motion), momenta(motion)
        assert found["c_force"].max() > 50.0
        assert np.ptp(P, axis=0).max() < 1e-10
        assert np.ptp(L, axis=0).max() < 1e-5
        if friction:
            pressed = found["c_force"] > 50.0
            assert found["c_friction"].max() > 1.0
            assert np.all(found["c_friction"][pressed] <= 0.401 * found["c_force"][pressed])
        else:
            assert np.ptp(found["E_balance"]) < 0.01 * found["E_kinetic"][0]


@pytest.mark.filterwarnings("ignore:load .* overlap")
def test_points_that_are_not_looked_at_are_away() -> None:
    """After leaps of any size, over accepted states between, forces are those of a model that knows
    of no earlier state.
    """
    system, met = (
        replace(
            assemble([sheet(), crate(over((0.4, 0.5), -0.002))], loads=[carried(stiffness=500.0)]),
            elastic=(),
        ),
        0,
    )
    random = np.random.default_rng(4)
    for size in (3e-4, 1e-3, 3e-3):
        model, x = compiled.compile_system(replace(system)), system.x0
        memory = compiled.accepted(model, x)
        for _ in range(10):
            x = x + size * random.normal(size=system.size)
            expected = compiled.forces(
                compiled.compile_system(replace(system)), x, 0.0 * x, 0.0, memory
            )
            assert_allclose(
                compiled.forces(model, x, 0.0 * x, 0.0, memory), expected, rtol=1e-12, atol=1e-12
            )
            met += bool(np.any(expected))
            memory = compiled.accepted(model, x, memory=memory)
    assert met > 3


@pytest.mark.filterwarnings("ignore:.*projected")
def test_every_form(tmp_path: Path) -> None:
    """Full, reduced, hyper-reduced and saved models meet alike."""
    raw, scheme = (
        falling(2.0, (0.43, 0.56), stiffness=2e4, friction=0.2),
        GeneralizedAlpha(2e-4, 0.8),
    )
    full = integrate(eliminate(raw), scheme, 0.02, TIGHT)
    expected = outputs(full)
    assert expected["c_force"].max() > 100.0
    for system in forms(raw, full, 1e-10, tmp_path / "model.h5"):
        found = outputs(integrate(system, scheme, 0.02, TIGHT))
        assert_allclose(found["foot_z"], expected["foot_z"], atol=1e-3)
        assert found["c_force"].max() == pytest.approx(expected["c_force"].max(), rel=0.1)
