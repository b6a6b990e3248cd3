"""Static deflections of plates: a cantilever under shear and under an end moment, clamped and hinged squares, very thin plates.

Sources: Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, doi 10.1016/j.finel.2003.11.001 (cantilevers; their shell has
shear, the digits of the shear-free limit are recomputed: a rod with EI = E b t^3/12); Timoshenko and Woinowsky-Krieger, Theory of
Plates and Shells, 2nd ed. 1959, art. 30 and 44 (squares; more digits by Navier and Ritz series, recomputed).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.dynamics import Newton, Trajectory, outputs, solve_statics
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads, probes

from ..bodies.test_plate import rectangle

TIGHT = Newton(tolerance=1e-12)
CELLS = {"ancf": 16, "nurbs": 16, "bfs": 16, "argyris": 8}
END_SHEAR = {0.25: (0.5643119, 3.017224), 0.5: (1.606371, 4.934649), 0.75: (2.544141, 6.032681), 1.0: (3.289343, 6.699863)}
ABAQUS = {0.25: (0.563, 3.015), 0.5: (1.604, 4.933), 0.75: (2.541, 6.031), 1.0: (3.286, 6.698)}  #: Sze et al., table 1
ROLL_UP = {0.25: (4.361, 7.639), 0.5: (12.0, 7.639), 0.75: (14.546, 2.546), 1.0: (12.0, 0.0)}  #: Sze et al., table 2, exact columns


def cantilever(kind: str, cells: tuple[int, int], length: float, load: list[Any], rims: dict[str, Rim] | None = None) -> Trajectory:
    """Sze's cantilevers (b = 1, t = 0.1, E = 1.2e6, nu = 0) under a load in four steps."""
    body = plate("plate", rectangle(kind, *cells, length), 0.1, Material(1.2e6, 1.0, 0.0), rims=rims)
    sensed = {name: probes.Position(At("plate", name)) for name in ("b", "c")}
    held = [joints.Edge("clamp", "plate", ("left",), slope="z")]
    return solve_statics(eliminate(assemble([body], held, load, outputs=sensed)), 4, TIGHT)


def tip(found: Trajectory, length: float) -> dict[float, tuple[float, float]]:
    """-U and W of the end by load factor; both corners move alike."""
    columns = outputs(found)
    np.testing.assert_allclose(columns["b_z"], columns["c_z"], atol=3e-5)
    middle = [0.5 * (columns[f"b_{axis}"] + columns[f"c_{axis}"]) for axis in "xz"]
    return {float(f): (length - x, z) for f, x, z in zip(found.times, *middle, strict=True)}


@pytest.mark.parametrize("kind", CELLS)
def test_cantilever_under_end_shear(kind: str) -> None:
    """P = 4: W = 6.6999 and -U = 3.2895 within 3e-4 (Kirchhoff-Love), and Sze's table within its shear deformation."""
    path = tip(cantilever(kind, (CELLS[kind], 1), 10.0, [loads.EdgeLoad("P", "plate", ("right",), (0.0, 0.0, 4.0))]), 10.0)
    assert path[1.0][1] == pytest.approx(6.6999, abs=3e-4)
    assert path[1.0][0] == pytest.approx(3.2895, abs=3e-4)
    for factor, exact in END_SHEAR.items():
        np.testing.assert_allclose(path[factor], exact, atol=3e-4)
        np.testing.assert_allclose(path[factor], ABAQUS[factor], atol=4e-3)


@pytest.mark.parametrize("kind,cells", [("ancf", (24, 3)), ("nurbs", (24, 1)), ("bfs", (24, 1)), ("argyris", (12, 1))])
def test_cantilever_rolled_to_a_circle(kind: str, cells: tuple[int, int]) -> None:
    """An end moment M on a rigid edge: theta' = M/(EI l^2) and l^2 = 1 - t^2/6 theta'^2, the tip at l/theta' (sin, 1 - cos).

    Both follow from the energy E t/2 ((l^2 - 1)/2)^2 + E t^3/24 (l theta')^2 a width; without stretch it is Sze's exact table.
    ANCF plates need cells across the width too: their error there is of order 2.
    """
    length, t, moment = 12.0, 0.1, 50 * np.pi / 3
    load = [loads.Moment("M", At("plate", "grip"), (0.0, -moment, 0.0))]
    path = tip(cantilever(kind, cells, length, load, {"grip": Rim(("right",), slopes=True)}), length)
    for factor, published in ROLL_UP.items():
        bend = turn = factor * moment / (1.2e6 * t**3 / 12)
        for _ in range(50):
            turn = bend / (1 - t**2 / 6 * turn**2)
        stretch = np.sqrt(1 - t**2 / 6 * turn**2)
        exact = length - stretch / turn * np.sin(turn * length), stretch / turn * (1 - np.cos(turn * length))
        np.testing.assert_allclose(path[factor], exact, atol=3e-3)
        np.testing.assert_allclose(path[factor], published, atol=8e-3)


def square(kind: str, cells: int, t: float, slope: str, load: str = "uniform") -> float:
    """w D/(q a^4) or w D/(P a^2) at the centre of a unit square, a quarter of it, clamped (slope z) or hinged ("")."""
    E, nu = 1e9, 0.3
    D = E * t**3 / (12 * (1 - nu**2))
    size = 1e-6 * D
    body = plate("plate", rectangle(kind, cells, cells, 0.5, 0.5), t, Material(E, 1.0, nu))
    held = [
        joints.Edge("support", "plate", ("left", "bottom"), slope=slope),
        joints.Edge("mirror x", "plate", ("right",), "x", "yz"),
        joints.Edge("mirror y", "plate", ("top",), "y", "xz"),
    ]
    push = (0.0, 0.0, size)
    force = loads.SurfaceLoad("q", "plate", push) if load == "uniform" else loads.PointForce("P", At("plate", "c"), push)
    system = eliminate(assemble([body], held, [force], outputs={"centre": probes.Position(At("plate", "c"))}))
    w = float(outputs(solve_statics(system, 1, TIGHT))["centre_z"][-1])
    return w * D / (size if load == "uniform" else 4 * size)


THIN = [("ancf", 24), ("nurbs", 8), ("bfs", 8), ("argyris", 4)]


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
@pytest.mark.parametrize("kind,cells", THIN)
def test_very_thin_clamped_square(kind: str, cells: int) -> None:
    """t/a = 1e-4 under a uniform load: 0.0012653 q a^4/D (Timoshenko: 0.00126), the same as at t/a = 1e-2: no locking."""
    found = square(kind, cells, 1e-4, "z")
    assert found == pytest.approx(0.0012653191, rel=1e-3)
    assert square(kind, cells, 1e-2, "z") == pytest.approx(found, rel=1e-7)


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
@pytest.mark.parametrize("kind,cells", THIN)
def test_hinged_square(kind: str, cells: int) -> None:
    """0.00406235 q a^4/D (Navier's series)."""
    assert square(kind, cells, 1e-3, "") == pytest.approx(0.00406235266, rel=1e-3)


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
@pytest.mark.parametrize("kind,cells", [("nurbs", 12), ("bfs", 8), ("argyris", 6)])
def test_point_load_on_a_clamped_square(kind: str, cells: int) -> None:
    """0.0056121 P a^2/D (Timoshenko: 0.00560)."""
    assert square(kind, cells, 1e-3, "z", "point") == pytest.approx(0.0056121, rel=4e-3)


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
@pytest.mark.parametrize("kind,cells,order", [("ancf", 8, 2), ("nurbs", 4, 4), ("bfs", 4, 4)])
def test_order_of_the_mesh(kind: str, cells: int, order: int) -> None:
    exact = 0.0012653191
    coarse, fine = (abs(square(kind, n, 1e-2, "z") - exact) for n in (cells, 2 * cells))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.5)
