"""Forces and moments per length, against elastica, beams and a spinning top."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp, solve_ivp

from fmbs_skfem import dynamics
from fmbs_skfem.bodies import Body, Material, cable, point_mass
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.bodies.sections import Circular, Rectangular
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.line_loads import LineLoad
from fmbs_skfem.systems.measures import probes

SECTION, STEEL = Rectangular(0.02, 0.01), Material(210e9, 7850.0, 0.0)
EI = 210e9 * 0.02 * 0.01**3 / 12.0  #: of the strip of 1 m, in its soft direction
FIXED = joints.Clamp("hold", At("b", "left"))


def tip(body: Body, *load: loads.Load, steps: int = 1) -> np.ndarray:
    """Where the end (c,) of a cantilever goes."""
    out = {"r": probes.Displacement(At("b", "right"))}
    path = dynamics.solve_statics(eliminate(assemble([body], [FIXED], load, outputs=out)), steps)
    return np.array([found[-1] for name, found in dynamics.outputs(path).items() if "r_" in name])


def strip(dim: int = 2, cells: int = 16) -> Body:
    return cable("b", segment(cells), SECTION, STEEL, dim=dim)


def solved(slopes: Callable[[np.ndarray], np.ndarray], ends: Callable[..., np.ndarray], n: int):  # type: ignore[no-untyped-def]
    found = solve_bvp(
        lambda s, y: slopes(np.vstack([s, y])),
        ends,
        np.linspace(0, 1, 101),
        np.zeros((n, 101)),
        tol=1e-9,
    )
    return found.y[:, -1]


def test_a_strip_under_its_load_is_an_elastica() -> None:
    """EI theta'' = - q (L - s) cos theta, to 1e-6 of its length with 32 cells."""
    y = solved(
        lambda y: np.array([y[2], -(1.0 - y[0]) * np.cos(y[1]), np.cos(y[1]), np.sin(y[1])]),
        lambda a, b: np.array([a[0], b[1], a[2], a[3]]),
        4,
    )
    moved = tip(strip(cells=32), LineLoad("q", "b", (0.0, EI)), steps=4)
    assert_allclose(moved, [y[2] - 1.0, y[3]], atol=1e-6)


def test_a_load_that_turns_stays_normal_to_the_line() -> None:
    """n' = - q normal, M' = - t x n of the elastica, of a planar strip and of a beam in space."""
    y = solved(
        lambda y: np.array(
            [
                y[2],
                y[3] * np.sin(y[1]) - y[4] * np.cos(y[1]),
                np.sin(y[1]),
                -np.cos(y[1]),
                np.cos(y[1]),
                np.sin(y[1]),
            ]
        ),
        lambda a, b: np.array([a[0], b[1], b[2], b[3], a[4], a[5]]),
        6,
    )
    moved = tip(strip(), LineLoad("q", "b", (0.0, EI), follower=True), steps=4)
    assert_allclose(moved, [y[4] - 1.0, y[5]], atol=2e-6)
    body = beam("b", segment(8), SECTION, STEEL)
    found = tip(body, LineLoad("q", "b", (0.0, 0.0, EI), follower=True), steps=4)
    assert_allclose(found, [y[4] - 1.0, 0.0, y[5]], atol=3e-5)  # it shears


@pytest.mark.parametrize(("start", "end"), [(0.25, 0.75), (0.3, None), (0.0, 0.1)])
def test_a_load_between_two_lengths(start: float, end: float | None) -> None:
    """int q s^2 (3 L - s) / (6 EI) ds, wherever cells end."""
    q, last = 1e-4 * EI, 1.0 if end is None else end
    wanted = np.diff([q / EI * (s**3 / 6.0 - s**4 / 24.0) for s in (start, last)])[0]
    assert tip(strip(), LineLoad("q", "b", (0.0, q), start=start, end=end))[1] == pytest.approx(
        wanted, rel=1e-6
    )


def test_a_load_that_grows_and_a_moment_along_the_line() -> None:
    """11 q L^4 / 120 EI, and m L^3 / 3 EI."""
    q = 1e-4 * EI
    grown = LineLoad("q", "b", (0.0, 0.0), end_force=(0.0, q))
    assert tip(strip(), grown)[1] == pytest.approx(11.0 * q / 120.0 / EI, rel=1e-6)
    for follower in (False, True):
        turned = LineLoad("m", "b", moment=q, follower=follower)
        assert tip(strip(), turned)[1] == pytest.approx(q / 3.0 / EI, rel=1e-6)
        body = beam("b", segment(8), SECTION, STEEL)
        about = LineLoad("m", "b", moment=(0.0, -q, 0.0), follower=follower)
        assert tip(body, about)[2] == pytest.approx(q / 3.0 / EI, rel=1e-3)


def test_a_torque_that_follows_turns_a_top_as_euler_says() -> None:
    I, torque = np.array([1.0, 2.0, 2.5]), np.array([0.3, -0.2, 0.5])
    top = rigid("top", 1.0, tuple(I), (0.0, 0.0, 0.0), dim=3)
    motion = dynamics.integrate(
        assemble(
            [top],
            [],
            [loads.Torque("push", At("top", "frame"), tuple(torque), follower=True)],
            outputs={"w": probes.AngularVelocity(At("top", "frame"))},
        ),
        GeneralizedAlpha(1e-3),
        2.0,
    )
    found = dynamics.outputs(motion)

    def euler(t: float, y: np.ndarray) -> np.ndarray:
        R, w = y[:9].reshape(3, 3), y[9:]
        turned = R @ np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return np.append(turned.ravel(), (torque - np.cross(w, I * w)) / I)

    y = solve_ivp(euler, (0.0, 2.0), np.append(np.eye(3).ravel(), np.zeros(3)), rtol=1e-10).y[:, -1]
    wanted = y[:9].reshape(3, 3) @ y[9:]
    assert_allclose([found[f"w_{k}"][-1] for k in "xyz"], wanted, rtol=1e-5)


@pytest.mark.parametrize(
    ("load", "text"),
    [
        (LineLoad("q", "b", (0.0, 1.0), start=0.5, end=1.5), "lengths along 'b' up to 1 m"),
        (LineLoad("q", "m", (0.0, 1.0)), "expected a cable or beam, got 'm'"),
    ],
)
def test_lengths_that_are_not_there(load: LineLoad, text: str) -> None:
    with pytest.raises(InputError, match=text):
        assemble([strip(), point_mass("m", 1.0, (0.0, 0.0))], [FIXED], [load])


def test_a_cable_in_space_takes_no_moment() -> None:
    wire = cable("b", segment(4), Circular(0.01), STEEL, dim=3)
    with pytest.raises(InputError, match="none on a cable in space"):
        assemble([wire], [], [LineLoad("m", "b", moment=(0.0, 1.0, 0.0))])
