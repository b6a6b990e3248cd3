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
    speeds = [np.sqrt(one.young_modulus / one.density) for one in KNOWN.values()]
    assert 1e3 < min(speeds) < max(speeds) < 5.3e3


def test_a_name_that_nobody_knows() -> None:
    with pytest.raises(InputError, match=r"got 'Steel'; did you mean 'steel'\?"):
        scenes.loads(SCENE.replace("NAME", "Steel"))
