"""Subspaces against exact facts of the Grassmann manifold (Edelman, Arias, Smith 1998, doi
10.1137/S0895479895290954).
"""

from __future__ import annotations

import grassmann
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from fmbs_skfem.core.errors import InputError

ROUND_OFF = 1e-13


def plane(n: int, r: int, seed: int) -> np.ndarray:
    return grassmann.orthonormal(np.random.default_rng(seed).standard_normal((n, r)))


def rotation(n: int, seed: int) -> np.ndarray:
    """A skew matrix (n, n): exp(t S) turns."""
    a = np.random.default_rng(seed).standard_normal((n, n))
    return a - a.T


def horizontal(base: np.ndarray, size: float, seed: int) -> np.ndarray:
    """A tangent vector whose largest angle is `size`."""
    a = np.random.default_rng(seed).standard_normal(base.shape)
    tangent = a - base @ (base.T @ a)
    return np.asarray(size * tangent / np.linalg.norm(tangent, 2))


def projector(y: np.ndarray) -> np.ndarray:
    return np.asarray(y @ y.T)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 6), st.integers(0, 14), st.floats(1e-12, 1.55), st.integers(0, 10**6))
def test_log_and_exp_are_inverse(r: int, more: int, size: float, seed: int) -> None:
    base = plane(r + more, r, seed)
    tangent = horizontal(base, size, seed + 1) if more else np.zeros_like(base)
    other = grassmann.exp(base, tangent)
    assert np.abs(base.T @ tangent).max() < ROUND_OFF
    assert np.abs(other.T @ other - np.eye(r)).max() < ROUND_OFF
    back = grassmann.log(base, other)
    # cosines carry round-off, so that angles near a right one are known to 1e-16 / cos of the
    # largest one
    assert np.abs(back - tangent).max() < 10 * ROUND_OFF / np.cos(size)
    assert np.abs(projector(grassmann.exp(base, back)) - projector(other)).max() < 10 * ROUND_OFF
    assert grassmann.distance(base, other) == pytest.approx(
        np.linalg.norm(tangent), rel=1e-7, abs=1e-13
    )


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.3, np.pi / 4, 1.5])
def test_distance_of_known_planes(angle: float) -> None:
    e = np.eye(4)
    one = e[:, :2]
    both = np.column_stack(
        [
            np.cos(angle) * e[:, 0] + np.sin(angle) * e[:, 2],
            np.cos(angle) * e[:, 1] + np.sin(angle) * e[:, 3],
        ]
    )
    single = np.column_stack([np.cos(angle) * e[:, 0] + np.sin(angle) * e[:, 2], e[:, 1]])
    assert grassmann.distance(one, both) == pytest.approx(np.sqrt(2) * angle, abs=1e-15)
    assert grassmann.distance(one, single) == pytest.approx(angle, abs=1e-15)
    exact = np.zeros((4, 2))
    exact[2, 0] = angle
    assert np.abs(grassmann.log(one, single) - exact).max() < 1e-15
    exact[3, 1] = angle
    assert np.abs(grassmann.log(one, both) - exact).max() < 1e-15


def test_geodesic_has_constant_speed() -> None:
    base = plane(12, 4, 1)
    tangent = horizontal(base, 1.2, 2)
    for t in (0.25, 0.5, 1.0):
        assert grassmann.distance(base, grassmann.exp(base, t * tangent)) == pytest.approx(
            t * np.linalg.norm(tangent), rel=1e-13
        )


@pytest.mark.parametrize("reference", [None, 0, 1, 2])
@pytest.mark.parametrize("count", [2, 3])
def test_a_plane_that_turns_evenly_is_interpolated_exactly(
    reference: int | None, count: int
) -> None:
    if reference is not None and reference >= count:
        reference = count - 1
    base = plane(9, 3, 5)
    tangent = horizontal(base, 1.4, 6)
    nodes = np.linspace(0.0, 1.0, count)
    spaces = grassmann.chart(
        [nodes], [grassmann.exp(base, mu * tangent) for mu in nodes], reference
    )
    for mu in (0.0, 0.123, 0.5, 0.91, 1.0):
        exact = grassmann.exp(base, mu * tangent)
        assert grassmann.distance(grassmann.interpolate(spaces, [mu]), exact) < 1e-13


def test_two_parameters_that_turn_different_planes() -> None:
    # span(cos a e1 + sin a e3, cos b e2 + sin b e4): the tangent at a = b = 0 is linear in a and b
    def exact(a: float, b: float) -> np.ndarray:
        return np.array([[np.cos(a), 0], [0, np.cos(b)], [np.sin(a), 0], [0, np.sin(b)]])

    one, two = np.array([0.0, 0.7]), np.array([0.0, 0.5, 1.2])
    spaces = grassmann.chart([one, two], [exact(a, b) for a in one for b in two], 0)
    for a, b in ((0.0, 0.0), (0.7, 1.2), (0.2, 0.9), (0.35, 0.1)):
        assert grassmann.distance(grassmann.interpolate(spaces, [a, b]), exact(a, b)) < 1e-14


def test_other_columns_of_the_same_subspaces_change_nothing() -> None:
    nodes = np.array([0.0, 0.4, 1.0])
    S, base, rng = 0.2 * rotation(10, 3), plane(10, 4, 4), np.random.default_rng(5)
    spaces = [scipy.linalg.expm(mu * S) @ base for mu in nodes]
    mixed = [space @ (rng.standard_normal((4, 4)) + 4 * np.eye(4)) for space in spaces]
    one, two = grassmann.chart([nodes], spaces, 1), grassmann.chart([nodes], mixed, 1)
    for mu in (0.0, 0.2, 0.7, 1.0):
        assert (
            grassmann.distance(grassmann.interpolate(one, [mu]), grassmann.interpolate(two, [mu]))
            < 1e-13
        )


@pytest.mark.parametrize("count", [2, 3, 4])
def test_order_of_the_interpolation_is_the_number_of_nodes(count: int) -> None:
    # a smooth curve of subspaces that is no geodesic: the error at the middle of [0, h] falls as
    # h^count, the middle being no node
    S, base = 0.4 * rotation(8, 7), plane(8, 3, 8)

    def space(mu: float) -> np.ndarray:
        return np.asarray(scipy.linalg.expm(mu * S) @ base)

    errors = []
    for h in (0.2, 0.1):
        nodes = h * np.linspace(0.0, 1.0, count)
        middle = h * 0.37
        spaces = grassmann.chart([nodes], [space(mu) for mu in nodes])
        errors.append(grassmann.distance(grassmann.interpolate(spaces, [middle]), space(middle)))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(count, abs=0.35)


def test_nodes_are_met_and_linear_equations_kept() -> None:
    rng = np.random.default_rng(9)
    A = rng.standard_normal((3, 12))
    Z = scipy.linalg.null_space(A)
    nodes = np.linspace(-1.0, 1.0, 3)
    base, other = plane(9, 4, 10), rng.standard_normal((9, 4))
    spaces = [Z @ grassmann.orthonormal(base + 0.3 * mu * other) for mu in nodes]
    found = grassmann.chart([nodes], spaces)
    for mu, space in zip(nodes, spaces, strict=True):
        assert grassmann.distance(grassmann.interpolate(found, [mu]), space) < 1e-13
    assert np.abs(A @ grassmann.interpolate(found, [0.3])).max() < 1e-14 * np.abs(A).sum()


def test_the_reference_is_the_central_subspace() -> None:
    base = plane(7, 2, 11)
    tangent = horizontal(base, 1.0, 12)
    spaces = [grassmann.exp(base, mu * tangent) for mu in (0.0, 0.9, 0.2, 0.5)]
    assert grassmann.find_central(spaces) == 3
    found = grassmann.chart([np.array([0.0, 0.9, 0.2, 0.5])], spaces)
    assert grassmann.distance(found.base, spaces[3]) < ROUND_OFF
    assert np.abs(found.tangents[3]).max() < ROUND_OFF


def test_one_subspace_is_constant_and_the_whole_space_too() -> None:
    one = plane(5, 2, 13)
    assert (
        grassmann.distance(
            grassmann.interpolate(grassmann.chart([np.array([0.5])], [one]), [3.0]), one
        )
        < 1e-15
    )
    whole = grassmann.chart([np.array([0.0, 1.0])], [plane(4, 4, 14), plane(4, 4, 15)])
    assert np.abs(projector(grassmann.interpolate(whole, [0.3])) - np.eye(4)).max() < ROUND_OFF


def test_refusals() -> None:
    e = np.eye(4)
    with pytest.raises(InputError, match="principal angles below a right one"):
        grassmann.log(e[:, :2], e[:, 1:3])
    with pytest.raises(InputError, match=r"a subspace of shape \(4, 2\)"):
        grassmann.log(e[:, :2], e[:, :1])
    with pytest.raises(InputError, match="linearly independent columns"):
        grassmann.orthonormal(np.ones((4, 2)))
    with pytest.raises(InputError, match="finite columns"):
        grassmann.orthonormal(np.full((4, 1), np.nan))
    with pytest.raises(InputError, match="at most as many as rows"):
        grassmann.orthonormal(np.ones((2, 3)))
    with pytest.raises(InputError, match="one subspace for each of the 3"):
        grassmann.chart([np.arange(3.0)], [e[:, :2]] * 2)
    with pytest.raises(InputError, match="distinct nodes"):
        grassmann.chart([np.zeros(2)], [e[:, :2]] * 2)
    with pytest.raises(InputError, match="subspaces of one shape"):
        grassmann.chart([np.arange(2.0)], [e[:, :2], e[:, :1]])
