"""Materials by their names."""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import build
from fmbs_skfem.scenes.known_materials import KNOWN

SCENE = """\
schema: 1
dimension: 3
bodies:
  b: {type: beam, line: {start: [0, 0, 0], end: [2 m, 0, 0]}, section: {shape: circular, diameter: 10 mm}, material: NAME}
joints: {hold: {type: clamp, at: b.left}}
analysis: {type: static}
"""


@pytest.mark.parametrize("name", ["S355", "aluminium_6061", "PLA"])
def test_a_body_has_the_mass_of_its_material(name: str) -> None:
    (body,) = build.parts(scenes.loads(SCENE.replace("NAME", name)))
    assert body.total_mass == pytest.approx(KNOWN[name].density * np.pi * 25e-6 * 2.0)


def test_numbers_are_those_of_standards() -> None:
    """Spring steel has G = 81.5 GPa (EN 13906-1); waves run as fast as in solids."""
    spring = KNOWN["spring_steel"]
    shear = spring.young_modulus / 2.0 / (1.0 + spring.poisson_ratio)
    assert shear == pytest.approx(81.5e9, rel=1e-3)
    speeds = {name: np.sqrt(one.young_modulus / one.density) for name, one in KNOWN.items()}
    assert speeds.pop("rubber") == pytest.approx(45.0, rel=0.02)
    assert 1e3 < min(speeds.values()) < max(speeds.values()) < 5.3e3


def test_yield_strengths_are_those_of_standards() -> None:
    """Strains at yield are below 1 % of all that have one; names of steels are their strengths."""
    known = {name: one for name, one in KNOWN.items() if one.yield_strength}
    assert known["S235"].yield_strength == 235e6
    assert known["S355"].yield_strength == 355e6
    assert known.keys() >= {
        "steel",
        "spring_steel",
        "stainless_steel",
        "aluminium_6061",
        "titanium",
    }
    strains = [(one.yield_strength or 0.0) / one.young_modulus for one in known.values()]
    assert 1e-3 < min(strains) < max(strains) < 1e-2


def test_rubber_keeps_its_shear_modulus() -> None:
    """G = 0.64 MPa at 50 IRHD (Lindley), within what its hardness says of E / 3 and G."""
    rubber = KNOWN["rubber"]
    shear = rubber.young_modulus / 2.0 / (1.0 + rubber.poisson_ratio)
    assert shear == pytest.approx(0.64e6, rel=0.16)


def test_a_name_that_nobody_knows() -> None:
    with pytest.raises(InputError, match=r"got 'Steel'; did you mean 'steel'\?"):
        scenes.loads(SCENE.replace("NAME", "Steel"))
