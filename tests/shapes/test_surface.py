"""Surfaces: quadrature, sides in common, and what the contract refuses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes import nurbs, surface
from fmbs_skfem.shapes.surface import Parent, Surface
from fmbs_skfem.shapes.table import check_table


@dataclass(frozen=True)
class Bilinear:
    """(1 - x)(1 - y), x (1 - y), x y, (1 - x) y; `noise` in the derivatives, and what else is wrong
    with them.
    """

    noise: float = 0.0
    first: float = 1.0
    mixed: float = 1.0
    lift: float = 0.0


@surface.basis.register
def _(space: Bilinear, cell: np.ndarray, xi: np.ndarray) -> np.ndarray:
    x, y = xi.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    values = np.array(
        [
            [(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y],
            [y - 1, 1 - y, y, -y],
            [x - 1, -x, x, 1 - x],
            [zero] * 4,
            [zero] * 4,
            [one, -one, one, -one],
        ]
    )
    values[1] *= space.first
    values[5] *= space.mixed
    values += space.noise * np.array([1.0, -1.0, 1.0, -1.0])[None, :, None]
    values[0, 0] += space.lift * x * (1 - x) * y * (1 - y)
    return np.moveaxis(values, 2, 0)


def grid(nx: int, ny: int, space: Bilinear | None = None) -> Surface:
    """nx by ny squares."""
    number = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    nodes = np.stack(
        [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1
    ).reshape(-1, 4)
    reference = np.indices((nx + 1, ny + 1)).reshape(2, -1).T.astype(float)
    return Surface(space or Bilinear(), Parent.SQUARE, nodes, reference, np.ones(number.size), 2)


@pytest.mark.parametrize("parent", list(Parent))
@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_quadrature_is_exact(parent: Parent, order: int) -> None:
    """int x^i y^j = 1/((i+1)(j+1)) on the square, i! j!/(i+j+2)! on the triangle, where the
    collapsed vertex costs a degree.
    """
    xi, weights = surface.quadrature(None, parent, order)
    factorial = np.cumprod([1.0, *range(1, 13)])
    for i in range(2 * order):
        for j in range(2 * order):
            if parent is Parent.SQUARE:
                exact = 1.0 / ((i + 1) * (j + 1))
            elif i + j <= 2 * order - 2:
                exact = factorial[i] * factorial[j] / factorial[i + j + 2]
            else:
                continue
            assert_allclose(weights @ (xi[:, 0] ** i * xi[:, 1] ** j), exact, rtol=1e-13)


def test_zero_derivatives_may_have_round_off() -> None:
    check_table(grid(3, 2, Bilinear(noise=1e-13)))


@pytest.mark.parametrize(
    ("space", "message"),
    [
        (Bilinear(first=1.001), r"check_table\(Bilinear\): derivative 1 against differences"),
        (Bilinear(mixed=1.001), "derivative 5 against differences"),
        (Bilinear(lift=1e-6), "partition of unity"),
        (Bilinear(noise=1e-3), "derivative 1 against differences"),
    ],
)
def test_wrong_rules_are_refused(space: Bilinear, message: str) -> None:
    with pytest.raises(InputError, match=message):
        check_table(grid(2, 2, space))


def test_sides_in_common() -> None:
    """A grid of 3 by 2 squares has 7 of them; cells of one orientation run along them in opposite
    directions.
    """
    a, b, against = surface.coincident_sides(grid(3, 2))
    assert len(a) == len(b) == 7
    assert against.all()
    found = {frozenset([tuple(i), tuple(j)]) for i, j in zip(a.tolist(), b.tolist(), strict=True)}
    assert frozenset([(0, 1), (2, 3)]) in found
    assert frozenset([(0, 2), (1, 0)]) in found


def test_cells_that_turn_the_other_way_share_sides_too() -> None:
    shape = grid(2, 1)
    nodes = shape.nodes.copy()
    nodes[1] = nodes[1, [0, 3, 2, 1]]
    shape = replace(shape, nodes=nodes)
    _, _, against = surface.coincident_sides(shape)
    assert not against.any()
    check_table(shape)


def test_cells_that_come_apart_are_refused() -> None:
    """Two squares at the same places that have no functions in common; two that share one function
    too few.
    """
    patch, control = nurbs.rectangle(1.0, 1.0, 2, 2, 2)
    apart = nurbs.surface(
        {"a": patch, "b": patch},
        {"a": control, "b": control + np.array([1.0, 0.0, 0.0])},
        join=False,
    )
    with pytest.raises(
        InputError,
        match=r"check_table\(Nurbs\): continuity over shared sides: expected an error of at most 1.0e-09",
    ):
        check_table(apart)
    shape = grid(2, 1)
    nodes = shape.nodes.copy()
    nodes[1, 0] = len(shape.reference)
    double = np.vstack([shape.reference, shape.reference[shape.nodes[1, 0]]])
    with pytest.raises(InputError, match="continuity over shared sides"):
        check_table(replace(shape, nodes=nodes, reference=double, unit=np.ones(len(double))))


def test_folded_cells_are_refused() -> None:
    shape = grid(2, 1)
    reference = shape.reference.copy()
    reference[:, 1] = 0.0
    with pytest.raises(InputError, match="tangent vectors that span a plane"):
        check_table(replace(shape, reference=reference))


def test_rules_and_functions_have_to_fit() -> None:
    with pytest.raises(
        InputError,
        match=r"surface\.basis: expected an interpolation of surfaces, got str.*register",
    ):
        surface.tabulate(replace(grid(1, 1), space="bilinear"))
    with pytest.raises(
        InputError, match="expected nodes, reference and unit of the same functions"
    ):
        replace(grid(1, 1), unit=np.ones(3))
