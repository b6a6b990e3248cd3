"""Rolled sections against the tables of EN 10365."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.beams import section_shapes
from fmbs_skfem.bodies.beams.rolled_sections import KNOWN, RolledSection
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import loads
from fmbs_skfem.scenes.build import parts

#: area [cm2], second moments about the strong and the weak axis [cm4]
TABLE = {
    "IPE80": (7.64, 80.1, 8.49),
    "IPE100": (10.3, 171, 15.9),
    "IPE200": (28.5, 1943, 142),
    "IPE300": (53.8, 8356, 604),
    "IPE400": (84.5, 23130, 1318),
    "HEA100": (21.2, 349, 134),
    "HEA200": (53.8, 3692, 1336),
    "HEA300": (112.5, 18260, 6310),
    "HEB100": (26.0, 450, 167),
    "HEB200": (78.1, 5696, 2003),
    "HEB300": (149, 25170, 8563),
}
SCENE = """\
schema: 1
dimension: 3
bodies:
  b: {type: beam, line: {start: [0, 0, 0], end: [2 m, 0, 0]}, section: {shape: rolled, profile: NAME}, material: S235}
joints: {hold: {type: clamp, at: b.left}}
analysis: {type: static}
"""


@pytest.mark.parametrize("name", TABLE)
def test_sections_are_those_of_the_standard(name: str) -> None:
    area, _, inertia = section_shapes.moments(RolledSection(name).outline())
    strong, weak = (float(one) for one in np.linalg.eigvalsh(inertia)[::-1])
    assert_allclose([1e4 * area, 1e8 * strong, 1e8 * weak], TABLE[name], rtol=0.01)


def test_every_section_is_drawn() -> None:
    """Of most, flanges are thicker than webs, and no fillet meets the other one."""
    for name, (h, b, web, flange, fillet) in KNOWN.items():
        assert flange > web, name
        assert h > 2.0 * (flange + fillet), name
        assert b > web + 2.0 * fillet, name


def test_a_beam_has_the_torsion_and_the_mass_of_the_standard() -> None:
    """18.8 kg/m of IPE 180, and I_t = 4.79 cm4, for which tables have a formula: within 5 %."""
    (body,) = parts(loads(SCENE.replace("NAME", "IPE 180")))
    assert body.total_mass == pytest.approx(2.0 * 18.8, rel=0.01)
    steel = Material(210e9, 7850.0, 0.3)
    stiffness = RolledSection("IPE180").of_beam(steel, None).stiffness
    assert stiffness[3, 3] / (210e9 / 2.6) == pytest.approx(4.79e-8, rel=0.05)


def test_a_name_that_no_mill_knows() -> None:
    with pytest.raises(
        InputError, match="expected IPE 80 to 400, HEA and HEB 100 to 300, got 'IPE 205'"
    ):
        loads(SCENE.replace("NAME", "IPE 205"))
