"""Large static deflections of cantilevers against closed forms and published numbers.

    A1 roll-up under an end moment    A2 elastica under a dead tip force    A4 follower force    A2b Gerstmayr-Irschik cantilever

Sources: Mattiasson, Int. J. Numer. Meth. Engng 17 (1981) 145-153, doi 10.1002/nme.1620170113 (A2;
digits from elliptic integrals, recomputed); Gerstmayr and Irschik, J. Sound Vib. 318 (2008)
461-487, doi 10.1016/j.jsv.2008.04.019 (A2b; digits of the converged rod with strain |r'| - 1); A4
from the initial value problem of the inextensible rod, recomputed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fmbs_skfem.bodies.laws import Law
from verification.statics import ELASTICA, FINE, circle, gerstmayr_irschik, pushed, rolled


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("turns", [0.25, 0.5, 1.0, 2.0])
def test_roll_up_with_material_curvature(turns: float, dim: int) -> None:
    """M = EI theta' and no stretch: a circle of exactly the reference length."""
    np.testing.assert_allclose(rolled(turns, dim, Law.MATERIAL), circle(turns), atol=2e-8)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("turns", [0.25, 0.5, 1.0, 2.0])
def test_roll_up_with_exact_curvature(turns: float, dim: int) -> None:
    """kappa = theta'/l stretches too: l^2 = 1 + 2 M^2/(EA EI), theta' = M l^2/EI, tip = l (sin
    theta', 1 - cos theta')/theta'.
    """
    np.testing.assert_allclose(rolled(turns, dim, Law.EXACT), circle(turns, 1e4), atol=2e-8)


def test_elastica_in_space() -> None:
    u, v = ELASTICA[5.0]
    np.testing.assert_allclose(pushed(5.0, dim=3, **FINE), [1 - u, v], atol=3e-7)


def test_the_inextensible_limit() -> None:
    """The reference is inextensible: the difference is proportional to EI/(EA L^2)."""
    u, v = ELASTICA[5.0]
    soft, stiff = (
        np.linalg.norm(pushed(5.0, stiffness=EA, **FINE) - [1 - u, v]) for EA in (1e4, 1e5)
    )
    assert soft / stiff == pytest.approx(10.0, rel=0.02)


def test_gerstmayr_irschik_cantilever() -> None:
    """The published rod has the strain |r'| - 1 where the cable here has (r'.r' - 1)/2: they differ
    by eps^2/2 with eps = 6e-4.
    """
    converged = gerstmayr_irschik(64, law=Law.MATERIAL)
    # stored figure of this package
    np.testing.assert_allclose(converged[:2], [-0.508537480605, -1.207239353373], atol=1e-9)
    np.testing.assert_allclose(
        gerstmayr_irschik(64, law=Law.MATERIAL, ancf=True), converged, atol=1e-8
    )
    assert (
        np.abs(gerstmayr_irschik(64) - converged).max() > 1e-4
    )  # the geometric curvature is another law


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
    coarse, fine = (
        np.linalg.norm(pushed(2.0, n, 100.0, **options) - exact) for n in (cells, 2 * cells)
    )
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.35)
