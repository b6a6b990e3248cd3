"""Large static deflections of cantilevers against closed forms and published numbers.

    A1 roll-up under an end moment    A2 elastica under a dead tip force    A4 follower force    A2b Gerstmayr-Irschik cantilever

Sources: Mattiasson, Int. J. Numer. Meth. Engng 17 (1981) 145-153, doi 10.1002/nme.1620170113 (A2; digits from elliptic integrals,
recomputed); Gerstmayr and Irschik, J. Sound Vib. 318 (2008) 461-487, doi 10.1016/j.jsv.2008.04.019 (A2b; digits of the converged
rod with strain |r'| - 1); A4 from the initial value problem of the inextensible rod, recomputed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fmbs_skfem.bodies import sections
from fmbs_skfem.bodies.cable_law import Curvature
from fmbs_skfem.dynamics import Newton, outputs, solve_statics
from fmbs_skfem.systems import System, loads

from .. import models

TIGHT = Newton(tolerance=1e-12)
FINE: dict[str, Any] = {"degree": 5, "continuity": 2}


def tip(cantilever: System, steps: int = 4) -> np.ndarray:
    """Position of the tip under the full load, (2,); in space the third component must stay zero."""
    found = outputs(solve_statics(cantilever, steps, TIGHT))
    assert "tip_z" not in found or abs(found["tip_z"][-1]) < 1e-9
    return np.array([found["tip_x"][-1], found["tip_y"][-1]])


def rolled(turns: float, dim: int, curvature: Curvature, stiffness: float = 1e4) -> np.ndarray:
    """Tip of a cantilever with EI = L = 1 under the end moment 2 pi turns."""
    moment = 2 * np.pi * turns
    system = models.cantilever(
        24,
        lambda end: [loads.Moment("M", end, moment if dim == 2 else (0.0, 0.0, moment))],
        section=sections.Given(stiffness, 1.0, 1.0),
        dim=dim,
        curvature=curvature,
        **FINE,
    )
    return tip(system, max(3, round(10 * turns)))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("turns", [0.25, 0.5, 1.0, 2.0])
def test_roll_up_with_material_curvature(turns: float, dim: int) -> None:
    """M = EI theta' and no stretch: a circle of exactly the reference length."""
    k = 2 * np.pi * turns
    np.testing.assert_allclose(rolled(turns, dim, Curvature.MATERIAL), [np.sin(k) / k, (1 - np.cos(k)) / k], atol=2e-8)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("turns", [0.25, 0.5, 1.0, 2.0])
def test_roll_up_with_exact_curvature(turns: float, dim: int) -> None:
    """kappa = theta'/l stretches too: l^2 = 1 + 2 M^2/(EA EI), theta' = M l^2/EI, tip = l (sin theta', 1 - cos theta')/theta'."""
    stiffness, moment = 1e4, 2 * np.pi * turns
    square = 1 + 2 * moment**2 / stiffness
    k = moment * square
    exact = np.sqrt(square) / k * np.array([np.sin(k), 1 - np.cos(k)])
    np.testing.assert_allclose(rolled(turns, dim, Curvature.EXACT, stiffness), exact, atol=2e-8)


ELASTICA = {  # P L^2/EI: shortening and transverse displacement over L
    0.2: (0.002646548341, 0.06636448214),
    1.0: (0.05643323628, 0.3017207738),
    2.0: (0.1606417208, 0.4934574804),
    5.0: (0.3876283607, 0.7137915236),
    10.0: (0.5549955978, 0.8106090249),
    20.0: (0.6838855676, 0.8686958983),
}


def pushed(alpha: float, cells: int = 40, stiffness: float = 1e8, dim: int = 2, **options: Any) -> np.ndarray:
    """Tip of a cantilever with EI = L = 1 under a dead transverse force alpha."""
    force = (0.0, alpha, 0.0)[:dim]
    section = sections.Given(stiffness, 1.0, 1.0)
    return tip(models.cantilever(cells, lambda end: [loads.PointForce("P", end, force)], section=section, dim=dim, **options))


@pytest.mark.parametrize("alpha", ELASTICA)
def test_elastica(alpha: float) -> None:
    u, v = ELASTICA[alpha]
    np.testing.assert_allclose(pushed(alpha, **FINE), [1 - u, v], atol=3e-7)


def test_elastica_in_space() -> None:
    u, v = ELASTICA[5.0]
    np.testing.assert_allclose(pushed(5.0, dim=3, **FINE), [1 - u, v], atol=3e-7)


def test_the_inextensible_limit() -> None:
    """The reference is inextensible: the difference is proportional to EI/(EA L^2)."""
    u, v = ELASTICA[5.0]
    soft, stiff = (np.linalg.norm(pushed(5.0, stiffness=EA, **FINE) - [1 - u, v]) for EA in (1e4, 1e5))
    assert soft / stiff == pytest.approx(10.0, rel=0.02)


FOLLOWER = {  # P L^2/EI: shortening and transverse displacement over L
    1: (0.0643543305, 0.320641995),
    4: (0.657254214, 0.786168426),
    10: (1.09212318, 0.546983265),
    20: (0.724289877, 0.33015766),
}


@pytest.mark.parametrize("alpha", FOLLOWER)
def test_follower_force(alpha: int) -> None:
    u, v = FOLLOWER[alpha]
    system = models.cantilever(
        40, lambda end: [loads.Follower("P", end, (0.0, float(alpha)))], section=sections.Given(1e8, 1.0, 1.0), **FINE
    )
    np.testing.assert_allclose(tip(system, 10), [1 - u, v], atol=1e-6)


def gerstmayr_irschik(cells: int, **options: Any) -> np.ndarray:
    """Tip displacement (2,) of the extensible cantilever L = 2 m, 0.1 m x 0.1 m, E = 2.07e11 Pa, F = 3 EI/L^2."""
    length, modulus = 2.0, 2.07e11
    force = 3 * modulus * 0.1**4 / 12 / length**2
    system = models.cantilever(
        cells,
        lambda end: [loads.PointForce("F", end, (0.0, -force))],
        length=length,
        section=sections.Rectangular(0.1, 0.1),
        material=sections.Material(modulus, 7800.0),
        **options,
    )
    return tip(system) - [length, 0.0]


def test_gerstmayr_irschik_cantilever() -> None:
    """The published rod has the strain |r'| - 1 where the cable here has (r'.r' - 1)/2: they differ by eps^2/2 with eps = 6e-4."""
    published = np.array([-0.5085373043259, -1.2072398545498])
    converged = gerstmayr_irschik(64, curvature=Curvature.MATERIAL)
    np.testing.assert_allclose(converged, published, atol=1e-6)
    np.testing.assert_allclose(converged, [-0.508537480605, -1.207239353373], atol=1e-9)  # stored figure of this package
    np.testing.assert_allclose(gerstmayr_irschik(64, curvature=Curvature.MATERIAL, ancf=True), converged, atol=1e-8)
    assert np.abs(gerstmayr_irschik(64) - converged).max() > 1e-4  # the geometric curvature is another law


ORDERS = [  # options, cells of the coarser mesh, order 2 (p - 1) of a tip displacement
    ({}, 8, 4),
    ({"continuity": 2}, 8, 4),
    ({"ancf": True}, 8, 4),
    ({"degree": 4}, 8, 6),
    ({"degree": 4, "continuity": 3}, 8, 6),
    ({"degree": 5}, 4, 8),
]


@pytest.mark.parametrize("options,cells,order", ORDERS)
def test_order_of_the_mesh(options: dict[str, Any], cells: int, order: int) -> None:
    exact = pushed(2.0, 40, 100.0, degree=5)
    coarse, fine = (np.linalg.norm(pushed(2.0, n, 100.0, **options) - exact) for n in (cells, 2 * cells))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.35)
