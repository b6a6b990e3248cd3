"""The start of a motion: velocities that joints permit, with compiled code and without."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, initial
from fmbs_skfem.systems import System
from fmbs_skfem.systems.compiled import compile_system

from .. import models


def driven() -> System:
    """A beam at rest whose drive turns at 3 rad/s from the start."""
    system = models.spin_up(4, all_multipliers=True)
    return replace(system, signals=[lambda t: np.cos(3.0 * t), lambda t: np.sin(3.0 * t)][: len(system.signals)])


def thrown() -> System:
    system = models.double_pendulum(4, all_multipliers=True)
    return replace(system, v0=np.random.default_rng(3).normal(size=system.size))


@pytest.mark.parametrize("make", [driven, thrown])
def test_velocities_without_compiled_code_are_those_of_a_run(make: Callable[[], System]) -> None:
    system, scheme = make(), GeneralizedAlpha(1e-3)
    assert not system.loads.forces  # then nothing of it is compiled
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        x, v = initial.admissible(system, scheme)
        start = initial.consistent_start(compile_system(system), scheme)
    assert np.abs(v - system.v0).max() > 0.1
    np.testing.assert_array_equal(x, start.x)
    np.testing.assert_allclose(v, start.v, rtol=0, atol=1e-11 * np.abs(start.v).max())
