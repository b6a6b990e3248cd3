"""Example 3 beside a solver that shares no code with this package: 9-node quads, complex numbers,
meshes and integrator of its own.

Over the first 0.02 s (0.68 rad) with one step both codes differ by their meshes alone. The coarse
independent mesh (472 cells) is off by 2.9e-6 rad and 2.6e-7 m from one of 1888 cells, which is
itself off by about a sixteenth of that.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "crank_slider_independent.py"
STEP, DURATION = 4e-5, 0.02


@pytest.fixture(scope="module")
def other() -> ModuleType:
    """The independent solver."""
    spec = importlib.util.spec_from_file_location(SCRIPT.stem, SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[SCRIPT.stem] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def test_independent_solver_is_sound(other: ModuleType) -> None:
    """Area of a link to h^4; no force from a turn; the tangent is the derivative of the force, the
    force that of the energy.
    """
    ends, cuts = other.CRANK
    area = np.pi / 2 * (0.04**2 + 0.035**2) + 0.075 * 0.1 - np.pi * (0.015**2 + 0.01**2)
    errors = [
        abs(
            other.lagrange(other.curved(ends, cuts, other.Model(refinement=n))).dx.sum() / area
            - 1.0
        )
        for n in (1, 2)
    ]
    assert errors[0] < 1e-5
    assert np.log2(errors[0] / errors[1]) > 3.8

    link = other.part(ends, cuts, other.Model())
    K, turned = other.tangent(link), (link.start.view(complex) * np.exp(0.7j)).view(float)
    w = 1e-3 * np.random.default_rng(0).standard_normal(len(turned))
    assert np.abs(other.force(link, turned)).max() < 1e-9 * np.abs(K @ link.start).max() + 1e-6
    slope = (
        other.force(link, link.start + 1e-6 * w) - other.force(link, link.start - 1e-6 * w)
    ) / 2e-6
    np.testing.assert_allclose(slope, K @ w, rtol=0, atol=1e-6 * np.abs(slope).max())
    at = link.start + 0.01 * w
    power = (other.energy(link, at + 1e-6 * w) - other.energy(link, at - 1e-6 * w)) / 2e-6
    assert power == pytest.approx(other.force(link, at) @ w, rel=1e-8)


def test_both_codes_agree(other: ModuleType) -> None:
    """Angle to 5e-6 of 0.675 rad, x_C to 5e-7 m, speed to 1e-5; plates without flexibility are seen
    to be elsewhere.
    """
    theirs = other.independent("independent", other.Model(), STEP, DURATION)
    mine = other.ours("crank_slider_coarse", STEP, DURATION)
    assert mine.angle == pytest.approx(theirs.angle, abs=5e-6)
    assert mine.x_C == pytest.approx(theirs.x_C, abs=5e-7)
    assert mine.speed == pytest.approx(theirs.speed, rel=1e-5)
    rigid = other.figures(
        "rigid", STEP, other.rigid(other.Model(refinement=2), np.linspace(0.0, DURATION, 501))
    )
    assert abs(rigid.x_C - theirs.x_C) > 4 * abs(mine.x_C - theirs.x_C)


def test_rigid_limit(other: ModuleType) -> None:
    """Plates 1000 times as stiff turn as rigid ones: the waves that the step of the torque starts
    are of order 1/1000.
    """
    stiff = other.independent("stiff", other.Model(young=70e12), STEP, DURATION / 2)
    rigid = other.figures(
        "rigid", STEP, other.rigid(other.Model(), np.linspace(0.0, DURATION / 2, 251))
    )
    assert stiff.angle == pytest.approx(rigid.angle, abs=2e-6)
    assert stiff.x_C == pytest.approx(rigid.x_C, abs=2e-7)
