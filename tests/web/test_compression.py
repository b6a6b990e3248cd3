"""Motions in few numbers: what is rigid costs no mode, and what is stored stands for the points to
what it says.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.pages import compression, packing

RNG = np.random.default_rng(5)


def rigid(count: int) -> np.ndarray:
    """Rotations about a slanted axis (s, 3, 3)."""
    angle = np.linspace(0.0, 7.0, count)
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    cross = np.cross(np.eye(3), axis)
    return (
        np.eye(3)
        + np.sin(angle)[:, None, None] * cross
        + (1.0 - np.cos(angle))[:, None, None] * (cross @ cross)
    )


def told(shape: compression.PageShape, reference: np.ndarray) -> np.ndarray:
    """Points (s, x, 3) as a page makes them: of single and half precision."""
    numbers = shape.coordinates.astype(np.float32).astype(float)
    affine = numbers[:, :12].reshape(-1, 3, 4)
    corner = np.column_stack([np.ones(len(reference)), reference.astype(np.float32)])
    return np.einsum("sck,xk->sxc", affine, corner) + np.einsum(
        "sm,mxc->sxc", numbers[:, 12:], shape.modes.astype(float)
    )


@pytest.mark.parametrize("rank", [1, 2, 3])
def test_a_rigid_motion_takes_no_mode(rank: int) -> None:
    """Of a straight line, a plane figure and a solid one."""
    reference = RNG.normal(size=(40, 3)) * (np.arange(3) < rank)
    points = np.einsum("sij,xj->sxi", rigid(50), reference) + RNG.normal(size=(50, 1, 3))
    shape = compression.of_points(points, reference, 1e-6)
    assert len(shape.modes) == 0
    assert np.abs(told(shape, reference) - points).max() <= 2e-6
    assert shape.error <= 1e-12


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-6])
def test_bent_motions_are_told_to_the_tolerance(tolerance: float) -> None:
    """A rod of 1 m that turns and bends by 0.3 m: also far below the 2.4e-4 of half floats, in
    further rounds.
    """
    x = np.linspace(0.0, 1.0, 81)
    reference = np.column_stack([x, 0.0 * x, 0.0 * x])
    bent = reference + 0.0 * np.zeros((90, 1, 1))
    phase = np.linspace(0.0, 6.0, 90)[:, None]
    bent[..., 1] += 0.3 * np.sin(phase) * x**2
    bent[..., 2] += 0.1 * np.cos(2.0 * phase) * np.sin(3.0 * x)
    points = np.einsum("sij,sxj->sxi", rigid(90), bent)
    shape = compression.of_points(points, reference, tolerance)
    assert shape.error <= tolerance
    assert np.abs(told(shape, reference) - points).max() <= tolerance + 1e-6
    assert len(shape.modes) <= 30


def test_fields_are_told_to_the_tolerance() -> None:
    values = np.sin(np.linspace(0.0, 5.0, 60))[:, None] * np.linspace(0.0, 1e7, 50) ** 1.2
    found = compression.of_values(values, 1e-3 * values.max())
    assert found.error <= 1e-3 * values.max()
    assert len(found.modes) <= 2


def test_what_does_not_move_takes_nothing() -> None:
    assert compression.of_values(np.zeros((5, 4)), 1e-3).modes.shape == (0, 4)
    assert compression.of_points(np.zeros((3, 2, 3)), np.zeros((2, 3)), 1e-3).coordinates.shape == (
        3,
        12,
    )


def test_texts_cannot_leave_their_element() -> None:
    text = packing.dumps({"name": '</script><!-- <script> &amp; \u2028 "quoted"'})
    assert not set("<>&\u2028") & set(text)
    block = packing.Block()
    first, second = block.put([1, 2, 3], "f2"), block.put([[1.0, 2.0]])
    assert (first["at"], second["at"], second["shape"]) == (0, 8, [1, 2])
