"""Slender and stiff beams, small and large steps: full models finish, and their error stays what
the step explains.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import pytest

from fmbs_skfem.bodies import sections
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Trajectory,
    energies,
    energy_drift,
    integrate,
    outputs,
)
from fmbs_skfem.systems import System

from .. import models

NORMAL = models.SECTION.of_cable(models.MATERIAL)
SECTIONS: dict[str, object] = {
    "thin": sections.Circular(0.003),
    "stiff": sections.Given(100 * NORMAL.EA, NORMAL.EI, NORMAL.rhoA),
    "normal": models.SECTION,
}
EXAMPLES: dict[str, Callable[..., System]] = {
    "spin_up": models.spin_up,
    "double_pendulum": models.double_pendulum,
}


@functools.cache
def run(example: str, section: str, h: float) -> Trajectory:
    return integrate(EXAMPLES[example](12, section=SECTIONS[section]), GeneralizedAlpha(h), 3.0)


def path(found: Trajectory, h: float) -> np.ndarray:
    """Position of the free end every 2.5 ms, (s, c)."""
    columns = outputs(found)
    names = [name for name in columns if name.startswith("C_")] or ["tip_x", "tip_y"]
    return np.stack([columns[name] for name in names], axis=1)[:: round(2.5e-3 / h)]


@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize("example", EXAMPLES)
def test_every_step_size_finishes(example: str, section: str) -> None:
    fine = run(example, section, 5e-4)
    assert fine.statistics.steps == 6000
    assert fine.statistics.halved == 0
    assert energy_drift(fine) < 1e-3 * energies(fine)[:, 0].max()
    coarse = run(example, section, 2.5e-3)
    assert coarse.statistics.steps == 1200
    assert energy_drift(coarse) < 2e-2 * energies(coarse)[:, 0].max()
    apart = np.linalg.norm(path(coarse, 2.5e-3) - path(fine, 5e-4), axis=1).max()
    assert apart < 0.03


def test_thin_beams_bend_more() -> None:
    """The same motion with a hundredth of the bending stiffness: the cases are not one and the
    same.
    """
    bend = {
        name: float(energies(run("double_pendulum", name, 5e-4))[:, 1].max()) for name in SECTIONS
    }
    mass = {
        name: float(section.of_cable(models.MATERIAL).rhoA) for name, section in SECTIONS.items()
    }
    assert mass["thin"] == pytest.approx(0.09 * mass["normal"])
    thin = outputs(run("double_pendulum", "thin", 5e-4))["C_z"]
    normal = outputs(run("double_pendulum", "normal", 5e-4))["C_z"]
    assert np.abs(thin - normal).max() > 0.1
    assert bend["normal"] > 0.0
