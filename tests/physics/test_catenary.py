r"""A hanging cable with hardly any bending stiffness against the elastic catenary.

    T cos = H,  T sin = V - w s,  dx/ds = l H/T,  dz/ds = -l (V - w s)/T,  stretch l from T

Published form: T = EA (l - 1) (Irvine, Cable Structures, MIT Press 1981). The cable here has the strain (l^2 - 1)/2, so that
T = EA l (l^2 - 1)/2; the same equations are integrated for both, and those of the published form give the reference digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.optimize import brentq, fsolve

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.dynamics import Newton, outputs, solve_statics
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads, probes

from .. import models


@dataclass(frozen=True)
class Hanging:
    """A cable between (0, 0) and (span, -drop)."""

    span: float  #: [m]
    drop: float  #: [m]
    length: float  #: unstretched [m]
    weight: float  #: w [N/m]
    EA: float  #: [N]
    H: float  #: horizontal force, published form [N]
    V: float  #: vertical force at the start, published form [N]
    middle: tuple[float, float]  #: x, z of half the cable, published form [m]


CABLES = [
    Hanging(1.0, 0.0, 1.2, 9.81, 1e4, 4.59646568756, 5.886, (0.5, -0.29290162103)),
    Hanging(1.0, 0.0, 1.0, 9.81, 1e3, 15.6629582638, 4.905, (0.5, -0.0776853321711)),
]


def stretch(T: np.ndarray, EA: float, green: bool) -> np.ndarray:
    """l from T/EA = l - 1, or from T/EA = l (l^2 - 1)/2 by Newton's iteration."""
    l = 1 + T / EA
    for _ in range(20 if green else 0):
        l = l - (l * (l**2 - 1) / 2 - T / EA) / ((3 * l**2 - 1) / 2)
    return l


def catenary(cable: Hanging, green: bool) -> tuple[np.ndarray, np.ndarray]:
    """H and V, and the positions (3, 2) at a quarter, half and three quarters of the cable."""
    nodes, weights = leggauss(60)

    def position(force: np.ndarray, s: float) -> np.ndarray:
        vertical = force[1] - cable.weight * s * (nodes + 1) / 2
        T = np.hypot(force[0], vertical)
        l = stretch(T, cable.EA, green)
        return 0.5 * s * np.array([weights @ (l * force[0] / T), -weights @ (l * vertical / T)])

    force = fsolve(lambda f: position(f, cable.length) - [cable.span, -cable.drop], [cable.H, cable.V], xtol=1e-12)
    return force, np.array([position(force, part * cable.length) for part in (0.25, 0.5, 0.75)])


def sagging_arc(cable: Hanging, cells: int) -> np.ndarray:
    """Points (cells + 1, 3) of a circular arc of the cable's length between its ends at one height."""
    s = np.linspace(-1.0, 1.0, cells + 1)
    if cable.length <= cable.span:
        return np.stack([0.5 * cable.span * (s + 1), 0 * s, 0 * s], 1)
    half = brentq(lambda a: np.sin(a) / a - cable.span / cable.length, 1e-3, 3.0)
    radius = 0.5 * cable.length / half
    return np.stack([0.5 * cable.span + radius * np.sin(half * s), radius * (np.cos(half) - np.cos(half * s)), 0 * s], 1)


@pytest.mark.parametrize("cable", CABLES)
def test_published_digits(cable: Hanging) -> None:
    force, points = catenary(cable, green=False)
    np.testing.assert_allclose(force, [cable.H, cable.V], rtol=1e-10)
    np.testing.assert_allclose(points[1], cable.middle, atol=1e-10)


def hung(cable: Hanging, bending: float) -> tuple[np.ndarray, np.ndarray]:
    """Reaction (2,) of the first end and positions (3, 2), with EI = bending w L^3."""
    section = sections.Given(cable.EA, bending * cable.weight * cable.length**3, cable.weight / models.GRAVITY)
    line = body.cable("cable", models.polyline(sagging_arc(cable, 30)), section, dim=2)
    length = float(line.mass.sum()) / section.rhoA
    assert length == pytest.approx(cable.length, rel=1e-7)
    system = assemble(
        [line],
        [joints.Pin("start", At("cable", "left")), joints.Pin("end", At("cable", "right"))],
        [loads.Gravity((0.0, -models.GRAVITY))],
        outputs={name: probes.Position(At("cable", part * length)) for name, part in (("a", 0.25), ("b", 0.5), ("c", 0.75))}
        | {"R": probes.Reaction("start")},
    )
    found = {name: values[-1] for name, values in outputs(solve_statics(eliminate(system), 5, Newton(tolerance=1e-11))).items()}
    return np.array([-found["R_x"], found["R_y"]]), np.array([[found[f"{name}_x"], found[f"{name}_y"]] for name in "abc"])


@pytest.mark.parametrize("cable", CABLES)
def test_cable_hangs_as_a_catenary(cable: Hanging) -> None:
    """The difference is proportional to EI, and vanishes with it."""
    force, points = catenary(cable, green=True)
    stiff, soft = hung(cable, 1e-4), hung(cable, 1e-5)
    for found, near, exact in ((stiff[1], soft[1], points), (stiff[0], soft[0], force)):
        assert 5 < np.abs(found - exact).max() / np.abs(near - exact).max() < 20
    np.testing.assert_allclose(soft[1], points, atol=2e-5)
    np.testing.assert_allclose(soft[0], force, atol=1e-3)
    assert soft[0][1] == pytest.approx(0.5 * cable.weight * cable.length, rel=1e-6)
