"""Observed order of the flexible systems in all unknowns, velocities and multipliers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, initial, integrate, integration, outputs
from fmbs_skfem.dynamics.compiled_step.packing import PackedStep
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import Rayleigh, System

from .. import models

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def example_1() -> System:
    return models.spin_up(5, all_multipliers=True)


def example_2() -> System:
    """Damped a little: the axial waves of the sudden start die out, so that steps of this size
    resolve what is left.
    """
    return models.double_pendulum(5, damping=Rayleigh(stiffness=1e-4), all_multipliers=True)


def states(
    make: Callable[[], System], h: float, coarsest: float, duration: float
) -> list[np.ndarray]:
    """x, v and multipliers after 0.2 s at the times of the coarsest run."""
    found = integrate(make(), GeneralizedAlpha(h), duration, Newton(tolerance=1e-12))
    every = round(coarsest / h)
    late = found.times[::every] >= 0.2
    return [part[::every][late] for part in (found.x, found.v, found.multipliers)]


@pytest.mark.parametrize("make,h,duration", [(example_1, 2e-3, 1.0), (example_2, 5e-4, 0.5)])
def test_second_order_in_position_velocity_and_multipliers(
    make: Callable[[], System], h: float, duration: float
) -> None:
    coarse, fine, reference = (states(make, step, h, duration) for step in (h, h / 2, h / 16))
    for a, b, exact in zip(coarse, fine, reference, strict=True):
        order = np.log2(np.abs(a - exact).max() / np.abs(b - exact).max())
        assert order == pytest.approx(2.0, abs=0.1)


def test_a_torque_that_starts_as_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plates spun up by a torque that is there at once: accelerations of the step's own matrix
    beside a start without any.

    The slider's place in the first 2 ms is 15 times as near and more to that of an eighth of the
    step.
    """
    scene = scenes.read(EXAMPLES / "crank_slider_coarse.yaml")
    full = build.chosen_form(scene, build.system(scene))

    def place(h: float) -> np.ndarray:
        motion = integrate(
            full, GeneralizedAlpha(h), 0.002, Newton(tolerance=1e-12), every=round(2e-5 / h)
        )
        return outputs(motion)["x_C"]

    def at_rest(packed: PackedStep, *more: Any) -> np.ndarray:
        v = initial.start_step(packed, *more)
        state = packed.step.state
        state.history[0], state.a[:] = 0.0, 0.0
        return v

    reference, found = place(2.5e-6), place(2e-5)
    monkeypatch.setattr(integration, "start_step", at_rest)
    error, without = (np.abs(x - reference).max() for x in (found, place(2e-5)))
    assert error < 1e-8
    assert without > 15 * error
