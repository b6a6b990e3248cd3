"""Planes of symmetry of splines whose lines meet the plane at an angle: halves and quarters move as
the whole does.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.algebra import ranks
from fmbs_skfem.dynamics import outputs, solve_statics
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification.statics_shells import CLAMPED, TIGHT, interpolated, loaded, mirror

# corners belong to two edges
pytestmark = pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")


def square(cells: int, oblique: float) -> float:
    """w D/(q a^4) at the centre of a clamped unit square, a quarter of it whose lines cross its
    planes of symmetry obliquely.
    """

    def position(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        y = v + oblique * np.sin(2 * np.pi * v) * u
        return np.stack([u + 0.7 * oblique * np.sin(2 * np.pi * u) * y, y, 0 * u], -1)

    knots = np.linspace(0.0, 0.5, cells + 1)
    t, E, nu = 1e-3, 1e9, 0.3
    D = E * t**3 / (12 * (1 - nu**2))
    held = [
        joints.Edge("clamp", "plate", ("xi1_min", "xi2_min"), slope="z"),
        mirror("x", "xi1_max"),
        mirror("y", "xi2_max"),
    ]
    push = [loads.SurfaceLoad("q", "plate", (0.0, 0.0, 1e-6 * D))]
    system = loaded(
        interpolated(position, (knots, knots)), t, E, nu, held, push, centre="corner_11"
    )
    return float(outputs(solve_statics(system, 1, TIGHT))["centre_z"][-1]) / 1e-6


@pytest.mark.parametrize("oblique", [1e-5, 0.2])
def test_a_quarter_of_a_square_with_oblique_lines(oblique: float) -> None:
    """Timoshenko and Woinowsky-Krieger, art. 44 (more digits by series); lines 0.001 deg and up to
    32 deg off the normal.
    """
    coarse, fine = (abs(square(n, oblique) / CLAMPED - 1) for n in (6, 12))
    assert fine < 5e-6
    assert np.log2(coarse / fine) > 3


def hypar(start: float, cells: int) -> Surface:
    """z = x^2 - y^2 over |x| < 0.5 and start < y < 0.5, its lines a little off the normal of y = 0."""
    knots = np.linspace(-0.5, 0.5, 9), np.linspace(start, 0.5, cells + 1)
    return interpolated(
        lambda x, y: np.stack(
            [x, y + 1e-5 * np.sin(9 * x), x**2 - (y + 1e-5 * np.sin(9 * x)) ** 2], -1
        ),
        knots,
    )


def bent(shape: Surface, *more: Any) -> dict[str, np.ndarray]:
    body = plate("plate", shape, 0.01, Material(2e11, 1.0, 0.3))
    held = [joints.Edge("clamp", "plate", ("xi1_min",), slope="xyz"), *more]
    weight = [loads.SurfaceLoad("weight", "plate", (0.0, 0.0, -80.0))]
    seen = {
        "tip": probes.Position(At("plate", "corner_11")),
        "R": probes.Reaction("clamp"),
        "e": probes.Energy(),
    }
    return outputs(solve_statics(eliminate(assemble([body], held, weight, outputs=seen)), 1, TIGHT))


def test_half_of_a_clamped_hyperbolic_paraboloid() -> None:
    """Both halves deflect as the whole: K.-J. Bathe, A. Iosilevich, D. Chapelle, Comput. Struct. 75
    (2000) 1-30, section 4.3.
    """
    whole, half = bent(hypar(-0.5, 8)), bent(hypar(0.0, 4), mirror("y", "xi2_min"))
    assert_allclose(half["tip_z"][-1], whole["tip_z"][-1], rtol=2e-3)
    assert_allclose(2 * half["e_strain"][-1], whole["e_strain"][-1], rtol=2e-3)
    assert_allclose(2 * half["R_my"][-1], whole["R_my"][-1], rtol=1e-3)
    assert (
        abs(half["R_mx"][-1]) < 0.01 * 80 * 50
    )  # an edge that is held beside the plane has no moments of any size


def test_the_derivative_across_vanishes_where_functions_allow_it() -> None:
    """Lines that cross the edge at right angles: zero at all points, of a warped field as well."""
    from fmbs_skfem.bodies.plate import edge, trace
    from fmbs_skfem.systems.connections import edge_slopes

    knots = np.linspace(0.0, 1.0, 5)
    shape = interpolated(lambda x, y: np.stack([x, y, 0 * x], -1), (knots, knots))
    sides = edge("edge", shape, ("xi2_min",))
    slopes = trace(shape, sides, normal=True)[len(sides) * 8 :]
    for one, other in zip(edge_slopes.across(shape, sides), ranks.determined(slopes), strict=True):
        assert_allclose(one, other)
