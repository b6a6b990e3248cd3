"""Proper orthogonal decomposition: the truncation identity, orthogonality, the kept state, merging
of runs.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array, diags_array

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.reduction.spaces import pod


def orthonormal(rng: np.random.Generator, n: int, r: int) -> np.ndarray:
    return np.linalg.qr(rng.standard_normal((n, r)))[0]


def decaying(seed: int, n: int, s: int, ratio: float = 0.3) -> np.ndarray:
    """Snapshots (n,s) about a mean of order one, whose singular values fall by `ratio` each."""
    rng = np.random.default_rng(seed)
    r = min(n, s)
    values = ratio ** np.arange(r)
    return (
        rng.standard_normal(n)[:, None] + orthonormal(rng, n, r) * values @ orthonormal(rng, s, r).T
    )


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    n=st.integers(2, 30),
    s=st.integers(2, 30),
    exponent=st.integers(1, 13),
    ratio=st.floats(0.1, 0.9),
)
def test_truncation_is_the_squared_relative_projection_error(
    seed: int, n: int, s: int, exponent: int, ratio: float
) -> None:
    x = decaying(seed, n, s, ratio)
    tolerance = 10.0**-exponent
    b = pod.basis(x, tolerance=tolerance)
    r = b.modes.shape[1]
    deviation = x - b.mean[:, None]
    error = np.sum((deviation - b.modes @ (b.modes.T @ deviation)) ** 2) / np.sum(deviation**2)
    discarded = np.sum(b.singular_values[r:] ** 2) / np.sum(b.singular_values**2)
    assert error == pytest.approx(discarded, rel=1e-6, abs=1e-28)
    assert error <= tolerance * (1.0 + 1e-6)
    assert np.allclose(b.modes.T @ b.modes, np.eye(r), atol=1e-13)
    if r > 1:  # one mode fewer would not do
        fewer = b.modes[:, : r - 1]
        assert np.sum((deviation - fewer @ (fewer.T @ deviation)) ** 2) > tolerance * np.sum(
            deviation**2
        ) * (1.0 - 1e-6)


def test_mean_and_singular_values_are_those_of_the_centred_snapshots() -> None:
    x = decaying(1, 12, 7)
    b = pod.basis(x, modes=3)
    assert np.allclose(b.mean, x.mean(axis=1), atol=1e-15)
    expected = np.linalg.svd(x - x.mean(axis=1)[:, None], compute_uv=False)
    assert np.allclose(b.singular_values, expected, rtol=1e-12, atol=1e-14)
    assert b.modes.shape == (12, 3)


def test_tiny_singular_values_survive() -> None:
    # a Gram matrix would drown everything below 1e-8 of the largest
    rng = np.random.default_rng(3)
    values = 10.0 ** -np.arange(12.0)
    u, v = orthonormal(rng, 50, 12), orthonormal(rng, 30, 12)
    b = pod.basis(u * values @ v.T, modes=12, mean=np.zeros(50))
    assert np.allclose(b.singular_values[:12] / values, 1.0, rtol=1e-3)
    assert np.allclose(np.abs(np.sum(b.modes[:, :12] * u, axis=0)), 1.0, atol=1e-3)


@pytest.mark.parametrize("shape", [(40, 9), (9, 40), (9, 9)])
def test_wide_and_tall_snapshots_agree_with_a_dense_svd(shape: tuple[int, int]) -> None:
    x = decaying(5, *shape, ratio=0.5)
    b = pod.basis(x, modes=4)
    u = np.linalg.svd(x - x.mean(axis=1)[:, None])[0][:, :4]
    assert np.allclose(b.modes @ b.modes.T, u @ u.T, atol=1e-12)


def test_truncation_by_hand() -> None:
    s = [2.0, 1.0, 1e-3, 1e-9]  # tails / total: 1, 1/5, 2e-7, 2e-19
    assert pod.truncation(s, 0.5) == 1
    assert pod.truncation(s, 0.20001) == 1
    assert pod.truncation(s, 0.1) == 2
    assert pod.truncation(s, 1e-6) == 2
    assert pod.truncation(s, 1e-7) == 3
    assert (
        pod.truncation(s, 1e-18) == 3
    )  # the tail 1e-18 of 5: lost when it is computed as total minus head
    assert pod.truncation(s, 1e-19) == 4
    assert pod.truncation([1.0, 1e-9, 1e-9, 1e-9], 2.5e-18) == 2
    assert pod.truncation([1e200, 1e190], 1e-19) == 1  # squares that overflow; the tail is 1e-20
    assert pod.truncation([1e200, 1e190], 1e-21) == 2


def missing(b: pod.Basis, q: np.ndarray) -> float:
    """Part of a state outside a basis."""
    d = q - b.mean
    return float(np.linalg.norm(d - b.modes @ (b.modes.T @ d)))


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    n=st.integers(3, 30),
    s=st.integers(3, 30),
    exponent=st.integers(1, 12),
    ratio=st.floats(0.1, 0.9),
)
def test_a_kept_state_is_exact_and_costs_at_most_one_mode(
    seed: int, n: int, s: int, exponent: int, ratio: float
) -> None:
    x = decaying(seed, n, s, ratio)
    q0 = x[:, 0] + 1e-3 * np.random.default_rng(seed).standard_normal(n)
    tolerance = 10.0**-exponent
    plain, kept = (pod.basis(x, tolerance=tolerance, keep=state) for state in (None, q0))
    r = kept.modes.shape[1]
    assert plain.modes.shape[1] <= r <= plain.modes.shape[1] + 1
    assert missing(kept, q0) < 1e-14 * max(1.0, np.linalg.norm(q0))
    assert np.allclose(kept.modes.T @ kept.modes, np.eye(r), atol=1e-14)
    assert np.array_equal(kept.singular_values, plain.singular_values)
    deviation = x - kept.mean[:, None]
    error = np.sum((deviation - kept.modes @ (kept.modes.T @ deviation)) ** 2)
    assert error <= tolerance * np.sum(deviation**2) * (1.0 + 1e-6)


def test_the_other_modes_are_those_of_the_remainder() -> None:
    x = decaying(7, 30, 20, 0.2)
    q0 = x[:, 0] + 1e-3 * np.random.default_rng(0).standard_normal(30)
    assert missing(pod.basis(x, modes=6), q0) > 1e-3
    b = pod.basis(x, modes=6, keep=q0)
    first = (q0 - b.mean) / np.linalg.norm(q0 - b.mean)
    assert np.allclose(b.modes[:, 0], first, atol=1e-15)
    remainder = (np.eye(30) - np.outer(first, first)) @ (x - b.mean[:, None])
    u = np.linalg.svd(remainder)[0][:, :5]
    assert np.allclose(b.modes[:, 1:] @ b.modes[:, 1:].T, u @ u.T, atol=1e-11)


def test_the_number_of_modes_counts_the_kept_state() -> None:
    x = decaying(8, 30, 20, 0.2)
    for count in (1, 2, 5):
        b = pod.basis(x, modes=count, keep=x[:, 0])
        assert b.modes.shape == (30, count)
        assert missing(b, x[:, 0]) < 1e-14


def test_a_state_nearly_in_the_span_still_gives_orthogonal_modes() -> None:
    x = decaying(8, 30, 20, 0.2)
    plain = pod.basis(x, modes=5)
    outside = orthonormal(np.random.default_rng(2), 30, 1)[:, 0]
    outside -= plain.modes @ (plain.modes.T @ outside)
    q0 = plain.mean + plain.modes @ np.ones(5) + 1e-9 * outside
    kept = pod.basis(x, modes=6, keep=q0)
    assert np.allclose(kept.modes.T @ kept.modes, np.eye(6), atol=1e-14)
    assert missing(kept, q0) < 1e-14


def test_a_state_in_the_span_or_at_the_mean_adds_nothing() -> None:
    rng = np.random.default_rng(9)
    x = orthonormal(rng, 30, 5) * [16.0, 8.0, 4.0, 2.0, 1.0] @ orthonormal(rng, 20, 5).T
    assert pod.basis(x, tolerance=1e-20, mean=np.zeros(30)).modes.shape == (30, 5)
    assert pod.basis(
        x, tolerance=1e-20, mean=np.zeros(30), keep=x @ np.arange(20.0)
    ).modes.shape == (30, 5)
    plain = pod.basis(decaying(9, 30, 20), modes=5)
    same = pod.basis(decaying(9, 30, 20), modes=5, keep=plain.mean * (1.0 + 1e-14))
    assert np.array_equal(same.modes, plain.modes)


@pytest.mark.parametrize("power", [-512, 512])
def test_the_basis_does_not_depend_on_the_unit(power: int) -> None:
    # powers of two scale without round-off; the squares of these snapshots overflow or vanish
    x, unit = decaying(4, 20, 12), 2.0**power
    with np.errstate(all="raise", under="ignore"):
        for tolerance in (1e-4, 1e-10):
            one = pod.basis(x, tolerance=tolerance, keep=x[:, 0])
            other = pod.basis(unit * x, tolerance=tolerance, keep=unit * x[:, 0])
            assert np.allclose(other.modes, one.modes, atol=1e-10)
            assert np.allclose(
                other.singular_values / unit, one.singular_values, rtol=1e-9, atol=1e-14
            )


def test_merged_factors_are_those_of_all_snapshots() -> None:
    first, second = decaying(11, 25, 15, 0.4), decaying(12, 25, 10, 0.4)
    mean = first.mean(axis=1)
    whole = pod.basis(np.hstack([first, second]), modes=8, mean=mean)
    parts = [pod.basis(x, tolerance=1e-24, mean=mean) for x in (first, second)]
    factors = [(p.modes, p.singular_values[: p.modes.shape[1]]) for p in parts]
    merged = pod.update(factors, mean, modes=8)
    assert np.allclose(
        merged.singular_values[:12], whole.singular_values[:12], rtol=1e-8, atol=1e-9
    )
    assert np.allclose(merged.modes @ merged.modes.T, whole.modes @ whole.modes.T, atol=1e-8)
    assert np.array_equal(merged.mean, mean)
    kept = pod.update(factors, mean, modes=8, keep=first[:, 0])
    assert kept.modes.shape[1] == 8
    assert missing(kept, first[:, 0]) < 1e-14


def test_one_factor_is_reproduced() -> None:
    b = pod.basis(decaying(13, 20, 12), tolerance=1e-10)
    r = b.modes.shape[1]
    again = pod.update([(b.modes, b.singular_values[:r])], b.mean, tolerance=1e-14)
    assert np.allclose(again.singular_values, b.singular_values[:r], rtol=1e-12)
    assert np.allclose(np.abs(np.sum(again.modes[:, :4] * b.modes[:, :4], axis=0)), 1.0, atol=1e-12)


def test_more_modes_than_the_snapshots_span_gives_a_notice() -> None:
    x = np.outer(np.arange(1.0, 6.0), [1.0, 2.0, 4.0]) + np.outer(
        [1.0, 0, 0, 0, 1.0], [1.0, 0.0, 0.0]
    )
    with pytest.warns(Notice, match="span only 2"):
        b = pod.basis(x, modes=4)
    assert b.modes.shape == (5, 2)


def test_noise_is_no_mode() -> None:
    x = np.outer(np.linspace(1.0, 2.0, 40), np.linspace(0.0, 1.0, 30)) + 1.0
    assert pod.basis(x, tolerance=1e-40).modes.shape[1] == 1


@pytest.mark.parametrize(
    "arguments, message",
    [
        (
            {"snapshots": np.ones((4, 3)), "modes": 1},
            "a component that moves in the training run, got one that stays",
        ),
        (
            {"snapshots": np.full((4, 7), 0.1), "tolerance": 1e-3},
            "a component that moves in the training run, got one that stays",
        ),
        ({"snapshots": np.array([[1.0, np.nan], [0.0, 1.0]]), "modes": 1}, "column 1"),
        ({"snapshots": np.zeros(3), "modes": 1}, "matrix"),
        ({"snapshots": np.zeros((3, 0)), "modes": 1}, "matrix"),
        ({"snapshots": np.eye(3)}, "neither"),
        ({"snapshots": np.eye(3), "modes": 1, "tolerance": 1e-3}, "either"),
        ({"snapshots": np.eye(3), "modes": 0}, "at least one mode"),
        ({"snapshots": np.eye(3), "modes": 0, "keep": np.ones(3)}, "at least one mode"),
        ({"snapshots": np.eye(3), "modes": -1, "keep": np.ones(3)}, "at least one mode"),
        ({"snapshots": np.eye(3), "tolerance": 0.0}, "0 < tolerance < 1"),
        ({"snapshots": np.eye(3), "tolerance": 1.0, "keep": np.ones(3)}, "0 < tolerance < 1"),
        ({"snapshots": np.eye(3), "tolerance": np.nan}, "0 < tolerance < 1"),
        ({"snapshots": np.eye(3), "modes": 1, "keep": np.zeros(2)}, "keep as 3"),
        ({"snapshots": np.eye(3), "modes": 1, "mean": np.full(3, np.inf)}, "mean as 3"),
    ],
)
def test_bad_input_is_refused(arguments: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        pod.basis(**arguments)


def test_bad_factors_are_refused() -> None:
    u = np.eye(4)[:, :2]
    with pytest.raises(InputError, match="at least one factor"):
        pod.update([], np.zeros(4), modes=1)
    with pytest.raises(InputError, match="2 non-negative singular values in factor 0"):
        pod.update([(u, [1.0, 0.5, 0.1])], np.zeros(4), modes=1)
    with pytest.raises(InputError, match="equally many rows"):
        pod.update([(u, [1.0, 0.5]), (np.eye(3), np.ones(3))], np.zeros(4), modes=1)
    with pytest.raises(InputError, match="not all zero"):
        pod.truncation(np.zeros(3), 1e-3)


@pytest.mark.parametrize("how", ["basis", "update", "of_vectors"])
def test_eps_holds_in_a_second_metric(how: str) -> None:
    """Of coordinates that hardly count in the first metric no more is left out than eps of them,
    with the same modes ahead.
    """
    n, eps = 20, 1e-6
    x = decaying(11, 2 * n, 30, 0.6)
    x = (x - x.mean(axis=1)[:, None]) * np.repeat([1.0, 1e-4], n)[:, None]
    second, none = csr_array(diags_array(np.repeat([0.0, 1.0], n))), np.zeros(2 * n)

    def found(also: csr_array | None) -> np.ndarray:
        if how == "basis":
            return pod.basis(x, eps, mean=none, second=also).modes
        if how == "update":
            return pod.update([(x, np.ones(30))], none, eps, second=also).modes
        return pod.of_vectors(x, np.eye(2 * n)[:, :1], eps, second=also).modes

    few, many = found(None), found(second)
    left = [(x - U @ (U.T @ x))[n:] for U in (few, many)]
    assert np.array_equal(many[:, : few.shape[1]], few)
    assert np.sum(left[1] ** 2) <= eps * np.sum(x[n:] ** 2) < 0.1 * np.sum(left[0] ** 2)
    assert many.shape[1] < 30
