"""DEIM: its rows and error bound (Chaturantabut and Sorensen 2010, doi 10.1137/090766498), its
limit, and its instability.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array

from examples import deim
from fmbs_skfem import reduction
from fmbs_skfem.core.errors import InputError, SolverError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, energies, integrate
from fmbs_skfem.systems import System, compile_system, compiled

from .conftest import Full, Reduced, hyper_reduced

SCHEME, NEWTON = GeneralizedAlpha(5e-4), Newton(1e-10)


def modes() -> np.ndarray:
    return np.linalg.qr(np.random.default_rng(1).normal(size=(40, 7)))[0]


def interpolated(system: System) -> deim.Interpolated:
    """The one elastic term."""
    (part,) = system.elastic
    assert isinstance(part.gather, deim.Interpolated)
    return part.gather


def test_rows_follow_algorithm_1() -> None:
    """The largest entry first; every further one is where the residual of interpolation is largest,
    so no row comes twice.
    """
    Z = modes()
    found = deim.interpolation(Z)
    assert found.rows[0] == np.abs(Z[:, 0]).argmax()
    assert len(set(found.rows)) == 7
    for k in range(1, 7):
        c = np.linalg.solve(Z[found.rows[:k], :k], Z[found.rows[:k], k])
        assert found.rows[k] == np.abs(Z[:, k] - Z[:, :k] @ c).argmax()


def test_what_lies_in_the_modes_is_interpolated_exactly() -> None:
    found = deim.interpolation(modes())
    f = found.modes @ np.arange(1.0, 8.0)
    np.testing.assert_allclose(found(f[found.rows]), f, atol=1e-12)


def test_the_error_stays_below_its_bound() -> None:
    """Lemma 3.2: |f - f'| <= ||(P^T Z)^-1|| |(I - Z Z^T) f|, and f' agrees with f in the rows."""
    found, random = deim.interpolation(modes()), np.random.default_rng(2)
    for f in random.normal(size=(20, 40)):
        near = found(f[found.rows])
        best = np.linalg.norm(f - found.modes @ (found.modes.T @ f))
        assert best <= np.linalg.norm(f - near) <= found.amplification * best
        np.testing.assert_allclose(near[found.rows], f[found.rows], atol=1e-12)


def test_the_tangent_is_the_derivative_of_the_force_and_not_symmetric(
    coarse: Full, small: Reduced
) -> None:
    model = interpolated(deim.train(coarse.raw, small.system, small.components, coarse.data, 1e-12))
    x, d = small.states[200], np.random.default_rng(3).normal(size=small.system.size)
    K, e, still = model.tangent(x, 0.0), 1e-6, 0 * x
    slope = (model.force(x + e * d, still) - model.force(x - e * d, still)) / (2 * e)
    np.testing.assert_allclose(K @ d, slope, rtol=1e-5, atol=1e-5 * np.abs(K).max())
    assert np.abs(K - K.T).max() > 1e-3 * np.abs(K).max()


def test_all_modes_give_the_projected_force_and_springs_act_once(
    coarse: Full, small: Reduced
) -> None:
    springs, V = 3.0 * eye_array(coarse.raw.size), np.asarray(small.system.lift.matrix)
    raw, reduced = (
        replace(coarse.raw, stiffness=csr_array(springs)),
        replace(small.system, stiffness=V.T @ (springs @ V)),
    )
    system, x = deim.train(raw, reduced, small.components, coarse.data, 1e-24), small.states[300]
    found, exact = (compiled.forces(compile_system(one), x, 0 * x) for one in (system, reduced))
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-7 * np.abs(exact).max())


def test_deim_is_unstable_where_ecsw_is_not(coarse: Full, small: Reduced) -> None:
    """Of 102 + 102 rows DEIM reads 41 + 40 and breaks down at 0.052 s with any step; ECSW of 16 +
    16 cells keeps its energy.
    """
    system = deim.train(coarse.raw, small.system, small.components, coarse.data, 1e-8)
    assert [len(part.rows) for part in interpolated(system).parts.values()] == [41, 40]
    for step in (5e-4, 2.5e-4):
        with pytest.raises(SolverError) as caught:
            integrate(system, GeneralizedAlpha(step), 0.5, NEWTON, 10)
        assert caught.value.time == pytest.approx(0.0517, abs=5e-4)
    sampled, _ = hyper_reduced(small)
    found = energies(integrate(sampled, SCHEME, 0.5, NEWTON, 10))[:, 3]
    assert np.abs(found - found[0]).max() < 1e-4


def test_the_example_breaks_down_there() -> None:
    assert deim.main() == {"rows": 81, "of": 204, "end": pytest.approx(0.0517, abs=5e-4)}


def test_with_nearly_all_rows_it_moves_as_the_reduced_model(coarse: Full, small: Reduced) -> None:
    """Force modes to round-off: both integrate the same equations."""
    system = deim.train(coarse.raw, small.system, small.components, coarse.data, 1e-24)
    found = integrate(system, SCHEME, 0.2, NEWTON, 10)
    wanted = integrate(small.system, SCHEME, 0.2, NEWTON, 10)
    assert reduction.compare(wanted, found).maximum < 1e-6


def test_what_makes_no_sense_is_refused(coarse: Full, small: Reduced) -> None:
    with pytest.raises(InputError, match=r"deim\.train: expected a reduced system"):
        deim.train(coarse.raw, coarse.raw, small.components, coarse.data)
