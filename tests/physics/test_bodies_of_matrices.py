"""Mechanisms with bodies of matrices against the same with `type: beam`: a connecting rod, and a
shaft that is spun up under its load.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from fmbs_skfem.bodies import Body, Material, Rectangular, point_mass, rigid
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.from_matrices import Coupling, from_matrices
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    buckling,
    integrate,
    outputs,
    solve_statics,
)
from fmbs_skfem.parts.condensation import condense
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, Motion, Rayleigh, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification import solids

STEEL, ALUMINIUM = Material(210e9, 7850.0, 0.3), Material(70e9, 2700.0, 0.3)


def of_matrices(
    name: str, size: tuple[float, float, float], material: Material, start: float = 0.0
) -> Body:
    """A bar of tetrahedra along x with average interfaces at both ends, and its middle as a point."""
    cells = (16, 1, 2) if size[1] < size[2] else (12, 2, 2)
    E, nu, density = material.young_modulus, material.poisson_ratio, material.density
    nodes, K, M = solids.bar(cells, size, E, nu, density)
    ends = {"left": 0.0, "right": size[0]}
    middle = int(np.argmin(np.linalg.norm(nodes - [size[0] / 2, 0.0, 0.0], axis=1)))
    body = from_matrices(
        name,
        nodes,
        K,
        M,
        interfaces={key: Coupling(solids.at(nodes, x), rigid=False) for key, x in ends.items()},
        places={"middle": middle},
        origin=np.array([start, 0.0, 0.0]),
    )
    return condense(body, 6, checked=False)


def crank_slider(rod: Body, middle: str | float) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the piston (s,), and deflections of the middle of the rod from its chord (s,)
    [m], run up to 150 rad/s.
    """
    crank = rigid.rigid(
        "crank", 0.5, (1e-4, 4e-4, 4e-4), (0.03, 0, 0), places={"O": (0, 0, 0), "A": (0.06, 0, 0)}
    )
    piston = point_mass("piston", 0.4, np.array([0.36, 0.0, 0.0]))
    y = (0.0, 1.0, 0.0)
    held = [
        joints.Revolute("O", At("crank", "O"), axis=y),
        joints.Revolute("A", At("crank", "A"), At("rod", "left"), axis=y),
        joints.Pin("B", At("rod", "right"), At("piston")),
        joints.Slider("guide", At("piston"), (1.0, 0.0, 0.0)),
        joints.DrivenAngle(
            "drive", At("crank", "O"), axis=y, angle=of_time("-150*t + 1.5*(1-exp(-t/0.01))")
        ),
    ]
    seen = {
        "m": probes.Position(At("rod", middle)),
        "A": probes.Position(At("rod", "left")),
        "B": probes.Position(At("piston")),
    }
    system = eliminate(assemble([crank, rod, piston], held, outputs=seen, pictures=False))
    found = outputs(integrate(system, GeneralizedAlpha(1e-4), 0.05, Newton(tolerance=1e-10), 2))
    m, A, B = (np.stack([found[f"{key}_x"], found[f"{key}_z"]], axis=1) for key in "mAB")
    chord = (B - A) / np.linalg.norm(B - A, axis=1)[:, None]
    apart = m - A
    return B[:, 0], apart[:, 1] * chord[:, 0] - apart[:, 0] * chord[:, 1]


def test_a_connecting_rod_of_matrices_moves_as_a_beam() -> None:
    """1e-4 of the stroke, and 4 % of what it bends, of which coarse tetrahedra have 2.5 %."""
    line = beam(
        "rod",
        segment(6, (0.06, 0, 0), (0.36, 0, 0)),
        Rectangular(0.01, 0.02),
        STEEL,
        direction=(0, 1, 0),
    )
    stroke, bent = crank_slider(line, 0.15)
    x, d = crank_slider(of_matrices("rod", (0.3, 0.01, 0.02), STEEL, 0.06), "middle")
    assert np.abs(x - stroke).max() < 1e-4 * np.ptp(stroke)
    assert np.ptp(bent) > 2e-4
    assert np.abs(d - bent).max() < 0.04 * np.ptp(bent)


def shaft(body: Body, middle: str | float, speed: float) -> Trajectory:
    """A shaft on bearings under a force of 200 N, spun up by its left end."""
    x = (1.0, 0.0, 0.0)
    turn = of_time(f"{speed}*t - {speed}*0.02*(1-exp(-t/0.02))")
    held = [
        joints.Pin("A", At("shaft", "left")),
        joints.Slider("B", At("shaft", "right"), x),
        joints.DrivenAngle("drive", At("shaft", "left"), axis=x, angle=turn),
    ]
    push = loads.PointForce("F", At("shaft", middle), (0.0, 0.0, -200.0))
    seen = {"m": probes.Position(At("shaft", middle))}
    system = eliminate(assemble([body], held, [push], Rayleigh(20.0), outputs=seen, pictures=False))
    return integrate(system, GeneralizedAlpha(4e-4), 0.1, Newton(tolerance=1e-10))


@pytest.mark.filterwarnings("ignore:initial velocities are projected")
def test_a_shaft_that_is_spun_up_bends_as_a_beam() -> None:
    """To a fifth of its first frequency (725 rad/s): 3 % of what it bends, of which coarse
    tetrahedra have 2 %; a spin about its own axis strains it by next to nothing, and is silent.
    """
    line = beam("shaft", segment(6), Rectangular(0.05, 0.05), ALUMINIUM)
    body = of_matrices("shaft", (1.0, 0.05, 0.05), ALUMINIUM)
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*stresses of loads")
        found = [outputs(shaft(one, at, 145.0)) for one, at in ((line, 0.5), (body, "middle"))]
    size = np.ptp(found[0]["m_z"])
    for axis in "yz":
        assert np.abs(found[1][f"m_{axis}"] - found[0][f"m_{axis}"]).max() < 0.03 * size


@cache
def arm() -> Body:
    nodes, K, M = solids.bar((6, 1, 1))
    ends = {"hub": Coupling(solids.at(nodes, 0.0)), "tip": Coupling(solids.at(nodes, 1.0), False)}
    return condense(from_matrices("arm", nodes, K, M, interfaces=ends), 3, checked=False)


def said(motion: Callable[[], object]) -> list[str]:
    """Warnings about stresses and bending."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        motion()
    return [
        str(one.message)
        for one in found
        if re.search("stresses of loads|deforms by", str(one.message))
    ]


@pytest.mark.parametrize(("part", "share"), [(0.2, ""), (0.5, "0.2"), (2.0, "3.")])
def test_a_blade_that_spins_fast_is_told(part: float, share: str) -> None:
    """By parts of its first frequency at the hub, 261 rad/s."""
    spin = part * 261.0
    given = {"arm": Motion(angular_velocity=(0.0, 0.0, spin), center=(0.0, 0.0, 0.0))}
    held = [
        joints.Revolute("axle", At("arm", "hub"), axis=(0.0, 0.0, 1.0)),
        joints.DrivenAngle(
            "drive", At("arm", "hub"), axis=(0.0, 0.0, 1.0), angle=of_time(f"{spin}*t")
        ),
    ]
    system = eliminate(assemble([arm()], held, initial=given, pictures=False))
    found = said(lambda: integrate(system, GeneralizedAlpha(2e-4), 0.02, Newton(tolerance=1e-9)))
    assert len(found) == bool(share)
    assert not share or f"by about {share}" in found[0]


@pytest.mark.parametrize(("load", "told"), [(0.02, ""), (0.2, "by about 0.19")])
def test_a_column_between_hinges_is_told_before_it_buckles(load: float, told: str) -> None:
    """By parts of Euler's load, pi^2 E I / L^2; a buckling load of it is refused."""
    euler = np.pi**2 * 70e9 * 0.05**4 / 12.0
    held = [
        joints.Pin("a", At("arm", "hub")),
        joints.Slider("b", At("arm", "tip"), (1.0, 0.0, 0.0)),
        joints.DrivenAngle("c", At("arm", "hub"), axis=(1.0, 0.0, 0.0), angle=of_time("0*t")),
    ]
    push = loads.PointForce("N", At("arm", "tip"), (-load * euler, 0.0, 0.0))
    system = eliminate(assemble([arm()], held, [push], pictures=False))
    found = said(lambda: solve_statics(system))
    assert len(found) == bool(told)
    assert not told or told in found[0]
    with pytest.raises(
        InputError, match="bodies that know what buckles them, got 'arm' of matrices"
    ):
        buckling(system)


@pytest.mark.parametrize(("deflection", "told"), [(0.04, False), (0.15, True)])
def test_a_cantilever_that_bends_far_is_told(deflection: float, told: bool) -> None:
    """Parts of its length: 0.1 of the square of that are missing where it draws its end in."""
    force = 3.0 * 70e9 * 0.05**4 / 12.0 * deflection
    push = loads.PointForce("P", At("arm", "tip"), (0.0, 0.0, force))
    weld = joints.Weld("root", At("arm", "hub"))
    system = eliminate(assemble([arm()], [weld], [push], pictures=False))
    found = [one for one in said(lambda: solve_statics(system)) if "deforms" in one]
    assert len(found) == told
