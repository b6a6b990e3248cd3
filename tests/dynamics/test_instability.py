"""Static analyses say where what they found does not stand."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.notices import Notice

from .test_state_space import MESHES

COLUMN = """
schema: 1
dimension: DIM
bodies:
  beam:
    type: cable
    mesh: beam_20.msh
    section: {shape: circular, diameter: 10 mm}
    material: {young_modulus: 1 GPa, density: 1800}
joints: {root: {type: clamp, at: beam.left}}
loads: {push: {type: point_force, at: beam.right, force: FORCE}}
analysis: {type: static, load_steps: 4}
outputs: {tip: {type: position, at: beam.right}}
"""
MAST = """
schema: 1
dimension: 2
bodies: {ball: {type: point_mass, mass: 2, position: [0, HEIGHT]}}
joints: {rod: {type: distance, at: ball, to: [0, 0]}}
loads:
  weight: {type: gravity, acceleration: [0, -9.81]}
  stay: {type: bushing, at: ball, stiffness: [STAY, 0]}
analysis: {type: static, load_steps: 4}
outputs: {ball: {type: position, at: ball}}
"""


def warned(text: str) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", Notice)
        scenes.loads(text, MESHES).run()
    return [str(one.message) for one in caught if "unstable" in str(one.message)]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("part", [0.99, 1.01, 2.5])
def test_columns_beyond_the_load_of_euler(part: float, dim: int) -> None:
    """P = pi^2 EI / (4 l^2); in space two motions pass zero at once: a small load to the side shows
    where the stable path goes.
    """
    load = part * np.pi**2 / 4 * 1e9 * np.pi * 0.01**4 / 64
    force = [-load, 0.0] if dim == 2 else [-load, 1e-7, 0.0]
    assert len(warned(COLUMN.replace("FORCE", str(force)).replace("DIM", str(dim)))) == (
        part > 1 and dim == 2
    )


def test_a_mast_on_its_spring() -> None:
    """Standing on a hinge it falls at sqrt((m g / l - k) / m) unless its spring is stiffer than m g
    / l; hanging it never does.
    """
    load = 2 * 9.81 / 0.5
    assert (
        f"{np.sqrt(0.3 * load / 2):.3g} 1/s"
        in warned(MAST.replace("HEIGHT", "0.5").replace("STAY", f"{0.7 * load}"))[0]
    )
    assert not warned(MAST.replace("HEIGHT", "0.5").replace("STAY", f"{1.1 * load}"))
    assert not warned(MAST.replace("HEIGHT", "-0.5").replace("STAY", f"{0.1 * load}"))
