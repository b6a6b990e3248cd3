"""Section stiffnesses against their closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Circular, Given, Material, Rectangular, cable
from fmbs_skfem.core.errors import InputError

MATERIAL = Material(1e9, 1800.0)


def test_circular() -> None:
    """The section of Hou, Liu, Hu (2020), doi 10.1016/j.cma.2019.112690: d = 0.01 m, E = 1e9 Pa,
    rho = 1800 kg/m3.
    """
    data = Circular(0.01).of_cable(MATERIAL)
    assert_allclose(
        [data.EA, data.EI, data.rhoA, data.radius],
        [25000 * math.pi, 0.15625 * math.pi, 0.045 * math.pi, 0.005],
    )


def test_rectangular() -> None:
    """A = w h, I = w h^3 / 12: bending about the axis along the width."""
    data = Rectangular(width=0.06, height=0.02).of_cable(Material(210e9, 7850.0))
    assert_allclose([data.EA, data.EI, data.rhoA], [252e6, 8400.0, 9.42])
    upright = Rectangular(width=0.02, height=0.06).of_cable(Material(210e9, 7850.0))
    assert pytest.approx(9 * data.EI) == upright.EI


def test_given_is_taken_as_it_is() -> None:
    section = Given(EA=3.0, EI=2.0, rhoA=1.0, radius=0.5)
    assert section.of_cable(None) is section
    assert section.of_cable(MATERIAL) is section


@pytest.mark.parametrize(
    "make, named",
    [
        (lambda: Material(-1.0, 1.0), r"material\.young_modulus"),
        (lambda: Material(1.0, math.nan), r"material\.density"),
        (lambda: Circular(0.0), r"section\.diameter"),
        (lambda: Rectangular(1.0, math.inf), r"section\.height"),
        (lambda: Given(1.0, -1.0, 1.0), r"section\.EI"),
        (lambda: Circular(1.0).of_cable(None), "material: expected a Material"),
        (
            lambda: cable("beam", "none.msh", "round", MATERIAL),
            "cable: section: expected a Section, got 'round'",
        ),
    ],
)
def test_bad_values_are_named(make: Callable[[], object], named: str) -> None:
    with pytest.raises(InputError, match=named):
        make()
