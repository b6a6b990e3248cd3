"""Floating frame with linear modes: its frequencies, where it is right, and where and why it is
wrong.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem import reduction
from fmbs_skfem.bodies import body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.reduction.spaces import ffrf
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.measures import probes
from tests import models
from tests.reduction.conftest import SCHEME, Full

SPIN_UP = "where(t < Ts, ws/Ts*(t**2/2 + (Ts/(2*pi))**2*(cos(2*pi*t/Ts) - 1)), ws*(t - Ts/2))"


def spun(rate: float, cells: int = 32) -> System:
    """Example 1 with another final rate [rad/s]."""
    beam = body.cable("beam", models.segment(cells), models.SECTION, models.MATERIAL, dim=2)
    root, tip = At("beam", "left"), At("beam", "right")
    drive = joints.DrivenAngle(
        "drive", root, of_time(SPIN_UP, {"Ts": models.SPIN_TIME, "ws": rate})
    )
    return assemble(
        [beam], [joints.Pin("hinge", root), drive], outputs={"tip": probes.Deflection(tip, root)}
    )


def test_frequencies_are_those_of_the_clamped_beam(example_1: Full) -> None:
    # Euler and Bernoulli: omega_i = (beta_i L)^2 sqrt(EI / (rhoA L^4)), beta_i L = 1.87510,
    # 4.69409, 7.85476
    cells = example_1.raw.elastic[0].gather
    _, squares = ffrf.floating_fields(example_1.raw, "beam", cells, 3)  # type: ignore[arg-type]
    expected = np.array([1.875104069, 4.694091133, 7.854757438]) ** 2 * np.sqrt(
        1e9 * 0.01**2 / 16 / 1800
    )
    assert np.allclose(np.sqrt(squares), expected, rtol=3e-6)


def test_fast_spin_up_is_wrong_without_centrifugal_stiffening(example_1: Full) -> None:
    # figure 3 of Hou, Liu, Hu (2020); the full model gives -0.3176 m
    run = integrate(reduction.reduce_floating(example_1.raw, 10), SCHEME, 3.0)
    assert outputs(run)["tip_deflection"].min() == pytest.approx(-0.556, abs=2e-3)
    assert outputs(example_1.run)["tip_deflection"].min() == pytest.approx(-0.3176, abs=5e-4)


def test_slow_spin_up_is_right() -> None:
    raw = spun(models.SPIN_RATE / 50)
    floating, full = (
        outputs(integrate(system, GeneralizedAlpha(1e-3), 3.0))["tip"]
        for system in (reduction.reduce_floating(raw), eliminate(raw))
    )
    assert np.abs(full).max() > 1e-3
    assert np.abs(floating - full).max() < 0.01 * np.abs(full).max()


def test_frame_and_modes_stay_orthonormal(example_1: Full) -> None:
    system = reduction.reduce_floating(example_1.raw, 4)
    assert system.size == 4 + 2 * 4
    run = integrate(system, SCHEME, 1.0, every=20)
    axis, amplitudes = run.x[:, 2:4], run.x[:, 4:].reshape(len(run.times), 4, 2)
    assert np.abs(np.linalg.norm(axis, axis=1) - 1.0).max() < 1e-9
    assert np.abs(np.einsum("sic,sc->si", amplitudes, axis)).max() < 1e-9


def test_a_curved_beam_is_refused() -> None:
    angles = np.linspace(0.0, 1.0, 9)
    mesh = models.polyline(np.column_stack([np.sin(angles), 1 - np.cos(angles), 0 * angles]))
    raw = assemble(
        [body.cable("arc", mesh, models.SECTION, models.MATERIAL, dim=2)],
        [joints.Clamp("c", At("arc", "left"))],
    )
    with pytest.raises(
        InputError,
        match="body 'arc': expected a straight reference line for a floating frame, got a curved one",
    ):
        reduction.reduce_floating(raw)
