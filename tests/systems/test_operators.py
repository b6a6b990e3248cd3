"""Operators of a system as numbers: the page that shows them, forms of one system, and what is
refused.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem import systems
from fmbs_skfem.core.errors import InputError

from .. import models, pages


def test_the_page_of_operators_runs() -> None:
    """docs/operators.md: projections by numpy are those of the package, and a model with the cells
    of weights moves.
    """
    names = pages.run("docs/operators.md", __name__="operators")
    assert np.count_nonzero(names["w"]) < 0.5 * len(names["w"])
    assert names["residual"] <= 1e-3


def test_tangents_are_derivatives_of_forces_and_constraints() -> None:
    """Central differences of f + Phi_x^T lambda, with multipliers, and of f by the rates."""
    system = models.spin_up(3)
    random = np.random.default_rng(1)
    x, v = system.x0 + 1e-3 * random.normal(size=system.size), random.normal(size=system.size)
    multipliers, d = (
        random.normal(size=len(system.constraints.names)),
        random.normal(size=system.size),
    )

    def whole(z: np.ndarray) -> np.ndarray:
        return (
            systems.force(system, z, v, 0.2)
            + systems.constraints(system, z, 0.2)[1].T @ multipliers
        )

    product = systems.tangent(system, x, v, 0.2, multipliers) @ d
    np.testing.assert_allclose(
        (whole(x + 1e-6 * d) - whole(x - 1e-6 * d)) / 2e-6,
        product,
        atol=1e-5 * np.abs(product).max(),
    )
    damping = systems.tangent(system, x, v, 0.2, multipliers, rate=1.0) @ d - product
    rates = systems.force(system, x, v + d, 0.2) - systems.force(system, x, v, 0.2)
    np.testing.assert_allclose(rates, damping, atol=1e-9 * np.abs(product).max())


def test_wrong_shapes_are_refused() -> None:
    system = models.spin_up(2)
    with pytest.raises(
        InputError, match=r"x: expected one finite number an unknown, \(\d+,\), got shape \(3,\)"
    ):
        systems.force(system, np.zeros(3))
    with pytest.raises(InputError, match="multipliers: expected one finite number a constraint"):
        systems.tangent(system, system.x0, multipliers=np.zeros(99))
