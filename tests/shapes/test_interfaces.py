"""Common edges of NURBS patches: quadrature along them, springs against folding, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes import interfaces, nurbs

from .test_nurbs import LEISSA, frequencies, halves


def test_interface_of_a_slanted_edge() -> None:
    """Length sqrt(1 + 4 slant^2); normals across it; every coordinate differentiates to the normal
    and the tangent.
    """
    shape = halves(2, slant=0.15)
    common = interfaces.between(shape, "left.xi1_max", "right.xi1_min")
    length = np.hypot(0.3, 1.0)
    assert_allclose(common.weights.sum(), length, rtol=1e-14)
    assert_allclose(
        common.normal_a @ shape.reference,
        np.tile([1.0 / length, -0.3 / length], (len(common.weights), 1)),
        atol=1e-13,
    )
    assert_allclose(
        common.normal_b @ shape.reference,
        np.tile([-1.0 / length, 0.3 / length], (len(common.weights), 1)),
        atol=1e-13,
    )
    assert_allclose(
        common.tangent @ shape.reference,
        np.tile([0.3 / length, 1.0 / length], (len(common.weights), 1)),
        atol=1e-13,
    )
    # two columns of half a unit square
    assert_allclose(np.sum(common.weights * common.sizes), 0.25, rtol=1e-14)


def test_penalty_leaves_rigid_motions_free() -> None:
    shape = halves(3, slant=0.15)
    stiffness = interfaces.penalty_stiffness(shape, interfaces.common_edges(shape), 2.0)
    assert_allclose(stiffness.toarray(), stiffness.toarray().T, atol=1e-9)
    angle = 2.5
    turned = shape.reference @ np.array(
        [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    ) + [3.0, -4.0]
    assert_allclose(stiffness @ turned, 0.0, atol=1e-8 * abs(stiffness).max() / 1e3)
    assert np.linalg.eigvalsh(stiffness.toarray()).min() > -1e-10 * abs(stiffness).max()


def test_penalty_energy_of_a_fold() -> None:
    """z = phi |x - 1/2|: the outward derivatives sum to 2 phi, the energy is alpha D / h (2 phi)^2
    / 2 per length.
    """
    shape = halves(4)
    stiffness = interfaces.penalty_stiffness(
        shape, interfaces.common_edges(shape), bending=3.0, alpha=50.0
    )
    z = 0.01 * np.abs(shape.reference[:, 0] - 0.5)
    assert_allclose(0.5 * z @ stiffness @ z, 50.0 * 3.0 / 0.125 * (0.02) ** 2 / 2.0, rtol=1e-12)


@pytest.mark.parametrize("slant", [0.0, 0.15])
def test_penalty_holds_a_plate_of_two_patches_together(slant: float) -> None:
    """Without springs a fourth motion costs nothing; with them Leissa's frequencies to 0.1 %, on a
    slanted edge too.
    """
    shape = halves(4, slant)
    loose = frequencies(shape)
    assert loose[3] < 1e-3
    stiffness = interfaces.penalty_stiffness(shape, interfaces.common_edges(shape), 1.0).toarray()
    assert_allclose(frequencies(shape, stiffness)[3:9], LEISSA, rtol=1e-3)


def test_interfaces_that_are_none() -> None:
    shape = halves(2)
    with pytest.raises(InputError, match=r"got 'left\.xi1_mux'; did you mean 'left\.xi1_max'"):
        interfaces.between(shape, "left.xi1_mux", "right.xi1_min")
    with pytest.raises(
        InputError, match=r"expected edges of the same cells \(4 and 4\), got a gap of 1 m"
    ):
        interfaces.between(shape, "left.xi1_min", "right.xi1_max")
    with pytest.raises(InputError, match=r"expected edges of the same cells \(4 and 2\)"):
        interfaces.between(shape, "left.xi1_max", "right.xi2_min")
    with pytest.raises(
        InputError, match=r"penalty_stiffness, bending: expected a positive number, got nan"
    ):
        interfaces.penalty_stiffness(shape, interfaces.common_edges(shape), np.nan)


def test_a_fold_of_the_reference_shape_has_no_spring() -> None:
    patch, control = nurbs.rectangle(1.0, 1.0, 2, 2, 2)
    upright = control[..., [2, 1, 0]]
    shape = nurbs.surface({"a": patch, "b": patch}, {"a": control, "b": upright})
    with pytest.raises(
        InputError, match="expected a surface without a kink, got outward normals that differ by 1"
    ):
        interfaces.penalty_stiffness(shape, interfaces.common_edges(shape), 1.0)
