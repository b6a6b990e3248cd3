"""Models saved before lengths were measured by the mass load, and run as then to the tolerance of Newton's iteration then."""

from __future__ import annotations

from pathlib import Path

import pytest

from fmbs_skfem import dynamics
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.reduction import files, product

DATA = Path(__file__).parent / "data"


def test_a_single_model() -> None:
    system = files.load(DATA / "single_version_1.h5")
    motion = dynamics.integrate(system, GeneralizedAlpha(1e-3), 0.01)
    found = dynamics.outputs(motion)
    assert found["tip_x"][-1] == pytest.approx(0.999977920139542, abs=1e-9)
    assert found["tip_y"][-1] == pytest.approx(0.00273363847352872, abs=5e-8)


def test_a_model_of_a_family() -> None:
    model = product.load(DATA / "family_version_1.h5")
    found = dynamics.outputs(product.run(model, E=1e9))
    assert found["tip_x"][-1] == pytest.approx(0.998949919966806, abs=1e-8)
    assert found["tip_y"][-1] == pytest.approx(0.00271925634469862, abs=1e-8)
