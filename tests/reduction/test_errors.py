"""Errors and residual norms: exact values on made-up motions, and the norms of example 1."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fmbs_skfem import reduction
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate
from fmbs_skfem.reduction.accuracy import errors
from tests import models
from tests.reduction.conftest import NEWTON, SCHEME, Full, Reduced


def norms(full: Full, modes: int) -> errors.Norms:
    components = reduction.system_level(full.raw)
    bases = reduction.bases(full.raw, full.data, components, modes=modes)
    run = integrate(
        reduction.reduce_system(full.raw, components, bases), SCHEME, 3.0, NEWTON, every=10
    )
    return reduction.residual_norms(full.raw, run, SCHEME)


def test_norms_of_example_1_with_ten_modes(example_1: Full) -> None:
    # figure 4 of Hou, Liu, Hu (2020): the unknown constraint force hides the error; 1.63e-7 and
    # 1.62e-7 in another implementation
    found = norms(example_1, 10)
    assert found.plain.mean() == pytest.approx(1.63e-7, rel=0.02)
    assert found.constraint.mean() == pytest.approx(1.62e-7, rel=0.02)
    assert found.plain.mean() / found.gappy.mean() > 20


def test_the_indicator_falls_with_the_number_of_modes(example_1: Full) -> None:
    found = [norms(example_1, modes).indicator for modes in (4, 8, 12, 20)]
    assert all(later < earlier / 5 for earlier, later in pairwise(found)), found
    assert found[0] / found[-1] > 1e6


def test_rows_of_dropped_constraints_are_masked(coarse: Full, small: Reduced) -> None:
    g = errors.mask(coarse.raw, small.system)
    assert np.flatnonzero(g == 0.0).tolist() == [
        0,
        1,
        2,
    ]  # the pin A holds the first control point of beam I
    assert np.all(errors.mask(coarse.raw, coarse.raw) == 1.0)


def test_a_known_difference(coarse: Full) -> None:
    run = coarse.run
    shifted = replace(run, x=run.x * 1.0)
    shifted.x[200:] += 1e-3
    found = reduction.compare(run, shifted)
    gap = np.linalg.norm(run.system.lift.matrix @ np.full(run.system.size, 1e-3))
    size = np.linalg.norm(run.x @ run.system.lift.matrix.T + run.system.lift.offset, axis=1)
    expected = np.where(np.arange(len(run.times)) < 200, 0.0, gap / size)
    assert np.allclose(found.relative, expected, rtol=1e-9, atol=1e-15)
    assert found.summary["coordinates_error"] == pytest.approx(expected.max())
    assert found.coordinates_mean == pytest.approx(
        np.trapezoid(expected * size, run.times) / np.trapezoid(size, run.times)
    )
    far = 1e-3 * np.sqrt(3)  # of all but the control point that is pinned
    assert found.summary["distance_error"] == pytest.approx(far, rel=0.02)
    assert np.all(found.distance[:200] == 0.0)
    assert found.maximum == pytest.approx(
        found.summary["distance_error"] / found.motion.max(), rel=1e-12
    )
    assert found.mean == pytest.approx(
        np.trapezoid(found.distance, run.times) / np.trapezoid(found.motion, run.times)
    )
    assert np.all(found.position[:200] == 0.0)
    assert found.summary["position_error"] == pytest.approx(np.sqrt(3) * 1e-3, rel=1e-6)


def test_only_common_times_are_compared(coarse: Full) -> None:
    other = integrate(coarse.run.system, GeneralizedAlpha(1e-3), 1.0, NEWTON, every=10)
    found = reduction.compare(coarse.run, other)
    assert np.allclose(found.times, np.arange(101) * 0.01)
    assert 1e-6 < found.maximum < 1e-2
    once = replace(other, times=other.times + 1e-3)
    with pytest.raises(InputError, match="two trajectories with common times, got 0 common times"):
        reduction.compare(coarse.run, once)


def test_other_meshes_are_compared_by_position(coarse: Full) -> None:
    other = integrate(models.double_pendulum(8), SCHEME, 1.0, NEWTON, every=10)
    found = reduction.compare(coarse.run, other)
    assert 1e-7 < found.summary["distance_error"] < found.summary["position_error"] < 1e-2
