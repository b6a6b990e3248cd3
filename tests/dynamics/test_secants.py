"""Secants of late corrections let the factors of reduced models serve longer, and change no motion."""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, initial, integrate
from fmbs_skfem.systems import System
from fmbs_skfem.systems.system import change_coordinates, sizes

from .. import models

SCHEME, DURATION = GeneralizedAlpha(5e-4), 0.5


@pytest.fixture
def dense() -> System:
    """A double pendulum of beams whose unknowns are all coupled, as those of a reduced model."""
    system = models.double_pendulum(4)
    modes = np.linalg.qr(np.random.default_rng(0).normal(size=(system.size, system.size)))[0]
    return change_coordinates(system, modes, np.zeros(system.size))


def test_secants_save_corrections(dense: System, monkeypatch: pytest.MonkeyPatch) -> None:
    """At one tolerance fewer, for about as many factors; positions within Newton's error of a run
    that iterates to round-off.
    """
    sharp = integrate(dense, SCHEME, DURATION, Newton(1e-15))
    own = integrate(dense, SCHEME, DURATION)
    monkeypatch.setattr(initial, "SECANTS", 0)
    plain = integrate(dense, SCHEME, DURATION)
    assert own.statistics.iterations < 0.97 * plain.statistics.iterations
    assert own.statistics.factorisations <= 1.1 * plain.statistics.factorisations
    errors = [sizes(dense, run.x - sharp.x).max() for run in (own, plain)]
    assert errors[0] < max(2.0 * errors[1], 1e-9)
