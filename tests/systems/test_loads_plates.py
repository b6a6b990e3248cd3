"""Loads on plates, frames and rigid bodies do the work they should, and their forces have the
tangent they should.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import outputs, solve_statics
from fmbs_skfem.shapes import skfem_surface
from fmbs_skfem.systems import (
    At,
    System,
    assemble,
    check_system,
    compile_system,
    compiled,
    eliminate,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import line_stresses, probes
from fmbs_skfem.systems.system import Signal

from . import parts
from .rigid_parts import A1, B1, B2, BEAM, RIM, SPATIAL_AXIS, bodies, grid


def every_load(dim: int, history: Signal | None = None) -> list[loads.Load]:
    """Loads of every type that frames, rigid bodies and plates take."""
    axis = {} if dim == 2 else {"axis": SPATIAL_AXIS}
    both: list[loads.Load] = [
        loads.PointForce("force on a rim", RIM, (3.0, 1.0, 2.0)[:dim], history),
        loads.Moment("torque on a rim", RIM, 0.3 if dim == 2 else (0.1, -0.2, 0.3), history),
        loads.Moment("torque on a body", A1, 0.3 if dim == 2 else (0.1, -0.2, 0.3), history),
        loads.Follower("gradient", B2, (1.0, 2.0, 3.0)[:dim], history),
        loads.SurfaceLoad("wind", "plate", (1.0, -2.0, 3.0)[:dim], history),
        loads.EdgeLoad("line load", "plate", ("right", "top"), (1.0, -2.0, 3.0)[:dim], history),
        loads.TorsionSpring("spring", A1, None, 3.0, 0.2, 0.1, **axis),
    ]
    if dim == 2:
        return [
            *both,
            loads.TorsionSpring("spring of bodies", A1, B1, 3.0, 0.2, 0.1),
            loads.TorsionSpring("on a beam", BEAM, A1, 3.0),
        ]
    return [*both, loads.Pressure("pressure", "plate", 2.0, history)]


CASES = [
    pytest.param(dim, load, id=f"{dim}-{load.name}")
    for dim in (2, 3)
    for load in every_load(dim, np.cos)
]  # type: ignore[union-attr]


def test_every_type_is_tested() -> None:
    tested = {type(load) for load in [*every_load(3), *parts.every_load(3)]}
    # `test_loads_that_follow`, `test_a_torque_is_a_moment`
    elsewhere = {
        loads.NormalEdgeLoad,
        loads.Torque,
    }
    assert tested | elsewhere == {
        kind for kind in loads.Load.known.values() if kind.__module__ == loads.__name__
    }


@pytest.mark.parametrize("dim, load", CASES)
def test_contract(dim: int, load: loads.Load) -> None:
    check_system(assemble(bodies(dim), loads=[load]))


def force(
    dim: int, load: loads.Load, x: np.ndarray | None = None, v: np.ndarray | None = None
) -> np.ndarray:
    """Generalised force of one load at t = 0, (n,)."""
    bare, system = assemble(bodies(dim)), assemble(bodies(dim), loads=[load])
    x = system.x0 if x is None else x
    v = np.zeros_like(x) if v is None else v
    return compiled.forces(compile_system(bare), x, v) - compiled.forces(
        compile_system(system), x, v
    )


def turned(dim: int, turn: np.ndarray) -> np.ndarray:
    return np.concatenate([(part.reference @ turn.T).ravel() for part in bodies(dim)])


def spin(dim: int, x: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Velocity omega x r of all coordinates."""
    matrix = np.array(
        [[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]]
    )[:dim, :dim]
    return (x.reshape(-1, dim) @ matrix.T).ravel()


@pytest.mark.parametrize("at", [RIM, A1])
def test_the_power_of_a_torque(at: At) -> None:
    """m . omega on a body turned by any rotation, in space for all three components; no resultant
    force.
    """
    m, omega, turn = (
        np.array([0.1, -0.2, 0.3]),
        np.array([0.7, 0.4, -0.5]),
        Rotation.from_rotvec([0.4, 1.0, -0.3]).as_matrix(),
    )
    x = turned(3, turn)
    f = force(3, loads.Moment("torque", at, tuple(m)), x)
    assert f @ spin(3, x, omega) == pytest.approx(m @ omega, rel=1e-9)
    shift = np.concatenate([np.outer(part.constant, [1.0, 2.0, 3.0]).ravel() for part in bodies(3)])
    assert f @ shift == pytest.approx(0.0, abs=1e-12)
    flat = turned(2, np.array([[0.6, -0.8], [0.8, 0.6]]))
    assert force(2, loads.Moment("torque", at, 0.3), flat) @ spin(2, flat, omega) == pytest.approx(
        0.3 * -0.5, rel=1e-9
    )


def test_a_follower_turns_with_its_body() -> None:
    turn = Rotation.from_rotvec([0.4, 1.0, -0.3]).as_matrix()
    axes = bodies(3)[1].reference[1:]
    f = force(3, loads.Follower("gradient", B2, (1.0, 2.0, 3.0)), turned(3, turn))
    shifts = [
        np.concatenate([np.outer(part.constant, e).ravel() for part in bodies(3)])
        for e in np.eye(3)
    ]
    assert_allclose([f @ shift for shift in shifts], turn @ axes.T @ [1.0, 2.0, 3.0], rtol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_resultants_of_distributed_loads(dim: int) -> None:
    """1 m2 of surface and 2 m of edges; the moment about the origin is that of the centroid, with a
    rigid rim at one edge.
    """
    density = np.array([1.0, -2.0, 3.0])[:dim]
    x, omega = assemble(bodies(dim)).x0, np.array([0.0, 0.0, 1.0])
    for load, size, center in (
        (loads.SurfaceLoad("wind", "plate", tuple(density)), 1.0, np.array([1.5, 0.5])),
        (
            loads.SurfaceLoad("gust", "plate", tuple(density), faces=("first",)),
            0.25,
            np.array([1.25, 0.25]),
        ),
        (
            loads.EdgeLoad("line", "plate", ("right", "left"), tuple(density)),
            2.0,
            np.array([1.5, 0.5]),
        ),
    ):
        f = force(dim, load)
        for c, e in enumerate(np.eye(dim)):
            shift = np.concatenate([np.outer(part.constant, e).ravel() for part in bodies(dim)])
            assert f @ shift == pytest.approx(size * density[c], rel=1e-9)
        torque = center[0] * density[1] - center[1] * density[0]
        assert f @ spin(dim, x, omega) == pytest.approx(size * torque, rel=1e-9)


def test_pressure_on_a_tilted_plate() -> None:
    """2 Pa on 1 m2 along the normal of the reference."""
    turn = Rotation.from_rotvec([0.4, 1.0, -0.3]).as_matrix()
    body = plate("plate", grid(2, 3, skew=0.3), 0.02, Material(1e5, 500.0), rotation=turn)
    system = assemble([body], loads=[loads.Pressure("pressure", "plate", 2.0)])
    still = np.zeros(system.size)
    f = -compiled.forces(compile_system(system), system.x0, still)
    total = [f @ np.outer(body.constant, e).ravel() for e in np.eye(3)]
    assert_allclose(total, 2.0 * turn[:, 2], atol=1e-9)


def test_torque_of_a_spring_and_damper() -> None:
    """- 3 (0.7 - 0.1) - 0.2 * 1.5 on the body, the same with the other sign on its partner."""
    parts_ = bodies(2)
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    x = np.concatenate(
        [(p.reference @ (turn.T if p.name == "a" else np.eye(2))).ravel() for p in parts_]
    )
    only = np.concatenate([np.full(p.reference.size, p.name == "a") for p in parts_])
    rate = np.where(only, spin(2, x, np.array([0, 0, 1.0])), 0.0)
    other = np.concatenate([np.full(p.reference.size, p.name == "b") for p in parts_])
    back = np.where(other, spin(2, x, np.array([0, 0, 1.0])), 0.0)
    torque = -3.0 * (0.7 - 0.1) - 0.2 * 1.5
    assert force(
        2, loads.TorsionSpring("s", A1, None, 3.0, 0.2, 0.1), x, 1.5 * rate
    ) @ rate == pytest.approx(torque, rel=1e-9)
    f = force(2, loads.TorsionSpring("s", A1, B1, 3.0, 0.2, 0.1), x, 1.5 * rate)
    assert f @ rate == pytest.approx(torque, rel=1e-9)
    assert f @ back == pytest.approx(-torque, rel=1e-9)


def supported(load: loads.Load, slope: str = "") -> System:
    """Square plate of 1 m, 10 mm thick, E 200 GPa, nu 0.3, all edges held, 12 x 12
    Bogner-Fox-Schmit cells.
    """
    body = plate("plate", grid(12, 12, make=skfem_surface.bfs), 0.01, Material(2e11, 7800.0))
    edges = joints.Edge("hold", "plate", ("left", "right", "top", "bottom"), slope=slope)
    sensed = {
        "w": probes.Position(At("plate", "middle")),
        "s": line_stresses.Stress(At("plate", "middle")),
    }
    return eliminate(assemble([body], [edges], [load], outputs=sensed))


@pytest.mark.parametrize(
    "slope, deflection, moment", [("", 0.00406235, 0.0478864), ("z", 0.00126532, 0.0229051)]
)
def test_square_plate_under_pressure(slope: str, deflection: float, moment: float) -> None:
    """w D / (p a^4) and M / (p a^2) in the middle, hinged and clamped; the von Mises stress of
    equal moments is 6 M / t^2.

    Timoshenko, Woinowsky-Krieger, Theory of Plates and Shells, 2nd ed., tables 8 and 35; digits of
    the deflections from the double sine series and from Taylor, Govindjee, UCB/SEMM-2004/09.
    """
    found = outputs(solve_statics(supported(loads.Pressure("pressure", "plate", 1.0), slope), 1))
    rigidity = 2e11 * 0.01**3 / (12 * (1 - 0.09))
    assert found["w_z"][-1] * rigidity == pytest.approx(deflection, rel=1e-3)
    for face in ("s_bottom", "s_top"):
        assert found[face][-1] == pytest.approx(6 * moment / 0.01**2, rel=0.01)


def test_the_rows_of_an_edge_are_independent() -> None:
    """Elimination drops none of them; pressure on a flat plate is a surface load along z."""
    first = supported(loads.Pressure("pressure", "plate", 1.0))
    rows = len(first.full.constraints.names)  # type: ignore[union-attr]
    assert first.size == len(first.full.x0) - rows  # type: ignore[union-attr]
    second = supported(loads.SurfaceLoad("wind", "plate", (0.0, 0.0, 1.0)))
    one, other = (outputs(solve_statics(system, 1))["w_z"][-1] for system in (first, second))
    assert one == pytest.approx(other, rel=1e-9)


@pytest.mark.parametrize(
    "dim, load, named",
    [
        (
            2,
            loads.SurfaceLoad("wind", "beam", (1.0, 0.0)),
            "load 'wind': expected a plate, shell or solid, got 'beam'",
        ),
        (
            2,
            loads.SurfaceLoad("wind", "plate", (1.0, 0.0), faces=("second",)),
            r"one of its faces \(first\), got 'second'",
        ),
        (
            2,
            loads.Pressure("pressure", "plate", 1.0),
            "expected a pressure in a scene of dimension 3",
        ),
        (
            3,
            loads.Pressure("pressure", "plate", np.nan),
            "load 'pressure'.pressure: expected a finite number, got nan",
        ),
        (
            2,
            loads.Pressure("pressure", "plate", 1.0, follower=True),
            "expected a pressure in a scene of dimension 3",
        ),
        (
            3,
            loads.Pressure("pressure", "plate", np.inf, follower=True),
            "load 'pressure'.pressure: expected a finite number, got inf",
        ),
        (
            3,
            loads.Pressure("pressure", "beam", 1.0, follower=True),
            "load 'pressure': expected a plate, shell or solid, got 'beam'",
        ),
        (
            3,
            loads.NormalEdgeLoad("pull", "plate", ("right",), 1.0),
            "expected a planar scene, got a spatial one",
        ),
        (
            2,
            loads.NormalEdgeLoad("pull", "plate", ("rigt",), 1.0),
            "one of its edges .*did you mean 'right'",
        ),
        (
            3,
            loads.Moment("torque", At("plate", "corner"), (1.0, 0.0, 0.0)),
            "expected a slope or a frame, got plate.corner",
        ),
        (3, loads.Follower("gradient", B2, (1.0,)), "load 'gradient': expected 3 finite numbers"),
        (
            2,
            loads.TorsionSpring("spring", A1, None, -1.0),
            r"'spring'\.stiffness: expected a torsional stiffness .*>= 0",
        ),
        (
            3,
            loads.TorsionSpring("spring", A1, None, 1.0),
            r"'spring'.axis: expected the axis of rotation in space",
        ),
        (
            3,
            loads.TorsionSpring("spring", A1, B1, -1.0, axis=(0, 0, 1)),
            r"'spring'\.stiffness: expected a torsional stiffness .*>= 0",
        ),
        (
            2,
            loads.EdgeLoad("line", "plate", ("lft",), (1.0, 0.0)),
            "one of its edges .*did you mean 'left'",
        ),
    ],
)
def test_wrong_loads_are_named(dim: int, load: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        assemble(bodies(dim), loads=[load])


@pytest.mark.parametrize("dim", [2, 3])
def test_a_torque_is_a_moment(dim: int) -> None:
    """The word of scenes for a moment on a frame: the same laws, to the bit."""
    size = 0.3 if dim == 2 else (0.1, -0.2, 0.3)
    pair = [
        assemble(bodies(dim), loads=[kind("M", RIM, size)]).loads
        for kind in (loads.Moment, loads.Torque)
    ]
    for one, other in zip(pair[0].forces, pair[1].forces, strict=True):
        assert one.law is other.law
        assert all(
            np.array_equal(getattr(one, name), getattr(other, name))
            for name in ("rows", "numbers", "signals")
        )
