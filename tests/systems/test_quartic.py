"""Quartic polynomials against full tensors and polynomials with known derivatives."""

from __future__ import annotations

from itertools import combinations_with_replacement, permutations
from math import comb

import numpy as np
import pytest

from fmbs_skfem.systems.terms import quartic

SIZES = (1, 2, 6, 9, 16)


def place(modes: int, a: int, b: int, c: int, d: int) -> int:
    """Where the coefficient of z_a z_b z_c z_d stands, a <= b <= c <= d."""
    widths = [(c + 1) * (c + 2) // 2 + (-((c + 1) * (c + 2) // 2)) % 8 for c in range(modes + 1)]
    return (
        sum((modes + 1 - k) * widths[k] for k in range(c))
        + (d - c) * widths[c]
        + b * (b + 1) // 2
        + a
    )


def random_polynomial(modes: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients, and the symmetric tensor A with W = A z z z z."""
    rng = np.random.default_rng(seed)
    T, A = quartic.aligned(quartic.length(modes)), np.zeros((modes + 1,) * 4)
    for monomial in combinations_with_replacement(range(modes + 1), 4):
        T[place(modes, *monomial)] = value = rng.normal()
        orders = set(permutations(monomial))
        for order in orders:
            A[order] = value / len(orders)
    return T, A


def work_of(modes: int) -> np.ndarray:
    return np.full(quartic.work_length(modes), np.nan)


@pytest.mark.parametrize("modes", SIZES)
def test_energy_force_and_tangent_are_those_of_the_full_tensor(modes: int) -> None:
    T, A = random_polynomial(modes)
    x = np.random.default_rng(1).normal(size=modes)
    z = np.concatenate([[1.0], x])
    H = np.einsum("abcd,c,d->ab", A, z, z)
    size = np.einsum("abcd,b,c,d->a", np.abs(A), np.abs(z), np.abs(z), np.abs(z)).max()
    f, W = np.zeros(modes), np.zeros((modes, modes))
    quartic.add_force(T, x, work_of(modes), f)
    quartic.add_tangent(T, x, work_of(modes), W)
    assert quartic.energy(T, x, work_of(modes)) == pytest.approx(
        z @ H @ z, abs=1e-14 * size * np.abs(z).sum()
    )
    np.testing.assert_allclose(f, 4.0 * (H @ z)[1:], rtol=0, atol=4e-14 * size)
    np.testing.assert_allclose(W, 12.0 * H[1:, 1:], rtol=0, atol=12e-14 * size)
    assert np.array_equal(W, W.T)


def test_single_monomials_have_exact_derivatives() -> None:
    """W = z_a z_b z_c z_d at small integers, for every monomial in 1, x1, x2, x3."""
    x = np.array([2.0, -3.0, 5.0])
    z = np.concatenate([[1.0], x])
    for monomial in combinations_with_replacement(range(4), 4):
        T = np.zeros(quartic.length(3))
        T[place(3, *monomial)] = 1.0
        power = np.array([monomial.count(k) for k in range(4)])
        f, W = np.zeros(3), np.zeros((3, 3))
        quartic.add_force(T, x, work_of(3), f)
        quartic.add_tangent(T, x, work_of(3), W)
        assert quartic.energy(T, x, work_of(3)) == np.prod(z**power)
        for i in range(1, 4):
            first = power - np.eye(4, dtype=int)[i]
            assert f[i - 1] == (power[i] * np.prod(z**first) if power[i] else 0.0)
            for j in range(1, 4):
                second = first - np.eye(4, dtype=int)[j]
                factor = power[i] * first[j]
                assert W[i - 1, j - 1] == (factor * np.prod(z**second) if factor else 0.0)


def test_results_are_added() -> None:
    T, _ = random_polynomial(6)
    x, work = np.linspace(-1.0, 1.0, 6), work_of(6)
    f, W = np.zeros(6), np.zeros((6, 6))
    quartic.add_force(T, x, work, f)
    quartic.add_tangent(T, x, work, W)
    more, K = np.full(6, 0.5), np.full((6, 6), -2.0)
    quartic.add_force(T, x, work, more)
    quartic.add_tangent(T, x, work, K)
    np.testing.assert_allclose(more, f + 0.5, rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(K, W - 2.0, rtol=0, atol=1e-14 * np.abs(W).max())


@pytest.mark.parametrize("rows", range(1, 20))
def test_blocks_of_any_height_are_two_products(rows: int) -> None:
    rng = np.random.default_rng(rows)
    B, weights, y, g, products = (
        rng.normal(size=(rows, 24)),
        rng.normal(size=rows),
        rng.normal(size=24),
        np.ones(24),
        np.zeros(rows),
    )
    quartic.add_block(B, weights, y, g, products)
    np.testing.assert_allclose(products, B @ y, rtol=0, atol=1e-14)
    np.testing.assert_allclose(g, 1.0 + weights @ B, rtol=0, atol=2e-14)


@pytest.mark.parametrize("bad", (np.nan, np.inf))
def test_what_is_not_finite_is_seen(bad: float) -> None:
    T, _ = random_polynomial(9)
    x = np.zeros(9)
    x[4] = bad
    f = np.zeros(9)
    quartic.add_force(T, x, work_of(9), f)
    assert not np.isfinite(f).any()


def test_every_monomial_is_stored_once_in_aligned_rows() -> None:
    for modes in (6, 31, 44):
        places = {
            place(modes, *monomial)
            for monomial in combinations_with_replacement(range(min(modes, 9) + 1), 4)
        }
        assert len(places) == comb(min(modes, 9) + 4, 4)
    assert quartic.length(31) == 54320  # 52360 monomials
    assert quartic.length(44) == 198360  # 194580 monomials
    assert quartic.aligned(7).ctypes.data % 64 == 0
    assert quartic.Quartic(quartic.aligned(quartic.length(3)), slice(4, 7)).modes == 3
