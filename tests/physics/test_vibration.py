"""Natural frequencies of beams, omega = (beta L)^2 sqrt(EI/(rhoA L^4)) with beta L from the classical frequency equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import vibration_modes
from fmbs_skfem.systems import At, System, assemble, eliminate, joints

from .. import models

ROOTS = {
    "clamped-free": (1.8751040687, 4.694091133, 7.8547574382, 10.995540735, 14.137168391),
    "free-free": (4.7300407449, 7.8532046241, 10.995607838, 14.137165491, 17.278759657),
    "clamped-clamped": (4.7300407449, 7.8532046241, 10.995607838, 14.137165491, 17.278759657),
    "pinned-pinned": (3.1415926536, 6.2831853072, 9.4247779608, 12.566370614, 15.707963268),
    "clamped-pinned": (3.926602312, 7.0685827456, 10.210176123, 13.351768778, 16.493361431),
    "free-pinned": (3.926602312, 7.0685827456, 10.210176123, 13.351768778, 16.493361431),
}
RIGID = {"free-free": 3, "free-pinned": 1}  #: rigid motions in the plane
ENDS = {"clamped": joints.Clamp, "pinned": joints.Pin}


def beam(supports: str, cells: int, dim: int = 2, **options: Any) -> System:
    """Beam with EI = rhoA = L = 1 and axial frequencies above the bending ones of the table."""
    part = body.cable("beam", models.straight(cells), sections.Given(EA=1e5, EI=1.0, rhoA=1.0), dim=dim, **options)
    kinds = zip(supports.split("-"), ("left", "right"), strict=True)
    return assemble([part], [ENDS[kind](end, At("beam", end)) for kind, end in kinds if kind in ENDS])


def frequencies(supports: str, cells: int, **options: Any) -> np.ndarray:
    rigid = RIGID.get(supports, 0)
    found = vibration_modes(beam(supports, cells, **options), 5 + rigid).frequencies
    assert np.abs(found[:rigid]).max(initial=0.0) < 0.02
    return found[rigid:]


@pytest.mark.parametrize("supports", ROOTS)
def test_first_five_frequencies(supports: str) -> None:
    found = frequencies(supports, 40, degree=4)
    np.testing.assert_allclose(found, np.array(ROOTS[supports]) ** 2, rtol=1e-6)


@pytest.mark.parametrize("supports", ROOTS)
def test_error_of_cubic_cells(supports: str) -> None:
    """Cubic Hermite functions: omega is too large by the factor 1 + (beta h)^4/1440, for C1 splines and ANCF alike."""
    roots = np.array(ROOTS[supports])[:4]
    for options in ({}, {"ancf": True}):
        excess = frequencies(supports, 20, **options)[:4] / roots**2 - 1
        np.testing.assert_allclose(excess, (roots / 20) ** 4 / 1440, rtol=0.1)


@pytest.mark.parametrize("options,order", [({}, 4), ({"ancf": True}, 4), ({"degree": 4}, 6), ({"degree": 5}, 8)])
def test_order_of_the_mesh(options: dict[str, Any], order: int) -> None:
    """The third frequency of a cantilever converges with order 2 (p - 1)."""
    exact = ROOTS["clamped-free"][2] ** 2
    coarse, fine = (frequencies("clamped-free", n, **options)[2] / exact - 1 for n in (6, 12))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.3)


def test_frequencies_in_space_come_in_pairs() -> None:
    found = vibration_modes(beam("clamped-free", 20, dim=3), 6).frequencies
    np.testing.assert_allclose(found, np.repeat(np.array(ROOTS["clamped-free"][:3]) ** 2, 2), rtol=2e-5)


def test_axial_frequency() -> None:
    """omega = pi/2 sqrt(EA/rhoA)/L of a clamped bar so stiff in bending that it is the lowest."""
    bar = body.cable("bar", models.straight(10), sections.Given(EA=1.0, EI=1e3, rhoA=1.0), dim=2)
    system = assemble([bar], [joints.Clamp("clamp", At("bar", "left"))])
    assert vibration_modes(system, 1).frequencies[0] == pytest.approx(np.pi / 2, rel=1e-6)


def test_shapes_are_normalised_and_satisfy_the_joints() -> None:
    system = eliminate(beam("clamped-pinned", 10))
    modes = vibration_modes(system, 4)
    np.testing.assert_allclose(modes.shapes.T @ system.mass @ modes.shapes, np.eye(4), atol=1e-10)
    kept = vibration_modes(beam("clamped-pinned", 10), 4)
    np.testing.assert_allclose(kept.frequencies, modes.frequencies, rtol=1e-8)


def test_too_many_modes_are_refused() -> None:
    with pytest.raises(InputError, match="modes"):
        vibration_modes(beam("clamped-free", 4), 1000)
