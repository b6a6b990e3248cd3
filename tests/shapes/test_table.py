"""The contract of spaces holds for every registered space, and finds each kind of fault."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike
from scipy import sparse

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes import line, table
from fmbs_skfem.shapes.table import BasisTable, check_table


def _name(space: Any) -> str:
    kind = type(space).__name__ if getattr(space, "weights", None) is None else "NURBS"
    return f"{kind}-{getattr(space, 'degree', 3)}-{space.count}"


@pytest.mark.parametrize("space", line.REGISTRY, ids=_name)
def test_contract(space: line.BSpline | line.Hermite) -> None:
    check_table(space)


@dataclass(frozen=True, eq=False)
class Faulty:
    """A good space whose table, samples or coefficients are spoilt."""

    space: line.BSpline | line.Hermite
    table: Callable[[BasisTable], BasisTable] = lambda good: good
    rows: Callable[[sparse.csr_array, int], sparse.csr_array] = lambda good, derivative: good
    coefficients: Callable[[np.ndarray], np.ndarray] = lambda good: good


@line.breaks.register
def _(space: Faulty) -> np.ndarray:
    return line.breaks(space.space)


@line.tabulate.register
def _(space: Faulty, points: int = 4) -> BasisTable:
    return space.table(line.tabulate(space.space, points))


@line.sample.register
def _(space: Faulty, xi: ArrayLike, derivative: int = 0) -> sparse.csr_array:
    return space.rows(line.sample(space.space, xi, derivative), derivative)


@line.fit.register
def _(space: Faulty, curve: table.Curve) -> np.ndarray:
    return space.coefficients(line.fit(space.space, curve))


@line.sample_field.register
def _(space: Faulty) -> np.ndarray:
    return line.sample_field(space.space)


@line.reproduce.register
def _(space: Faulty, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
    return line.reproduce(space.space, xi, derivative)


def _scaled(
    factors: tuple[float, float, float], functions: slice = slice(None)
) -> Callable[[BasisTable], BasisTable]:
    def change(good: BasisTable) -> BasisTable:
        values = good.values.copy()
        values[..., functions] *= np.array(factors)[:, None]
        return replace(good, values=values)

    return change


SPLINE, CABLE = line.uniform(4), line.Hermite(np.array([0.0, 0.5, 1.2, 2.0]))


def test_sound_wrapper_passes() -> None:
    check_table(Faulty(SPLINE))
    check_table(Faulty(CABLE))


@pytest.mark.parametrize(
    "space, property_",
    [
        (Faulty(SPLINE, table=lambda good: replace(good, nodes=good.nodes + 1)), "nodes in range"),
        (Faulty(SPLINE, table=lambda good: replace(good, nodes=good.nodes - 1)), "nodes in range"),
        (
            Faulty(SPLINE, table=lambda good: replace(good, points=good.points + 0.1)),
            "quadrature points inside",
        ),
        (
            Faulty(SPLINE, table=lambda good: replace(good, weights=-good.weights)),
            "positive weights",
        ),
        (
            Faulty(SPLINE, table=lambda good: replace(good, weights=2.0 * good.weights)),
            "sum to the cell's length",
        ),
        (
            Faulty(SPLINE, table=_scaled((1.0, 1.0 + 1e-6, 1.0))),
            "table equals sample, derivative 1",
        ),
        (
            Faulty(
                SPLINE,
                table=_scaled((1.01, 1.0, 1.0)),
                rows=lambda good, d: 1.01 * good if d == 0 else good,
            ),
            "partition of unity",
        ),
        (
            Faulty(
                CABLE,
                table=_scaled((2.0,) * 3, slice(1, None, 2)),
                rows=lambda good, d: good @ _slopes(2.0),
            ),
            "linear reproduction",
        ),
        (Faulty(SPLINE, coefficients=lambda good: good[::-1]), "polynomial reproduction"),
        (
            Faulty(SPLINE, rows=lambda good, d: 1.1 * good if d == 3 else good),
            "derivative 3 against differences",
        ),
    ],
)
def test_faults_are_named(space: Faulty, property_: str) -> None:
    with pytest.raises(ValueError, match=property_):
        check_table(space)


def _slopes(factor: float) -> sparse.dia_array:
    return sparse.diags_array(np.tile([1.0, factor], CABLE.count // 2))


@pytest.mark.parametrize("derivative", [1, 2])
def test_wrong_derivative_is_named(derivative: int) -> None:
    """A parameter stretched in the derivatives alone: sums and tables agree, the constant is kept,
    linear functions are not.
    """
    factors = tuple(1.1 if k == derivative else 1.0 for k in range(3))
    space = Faulty(
        SPLINE, table=_scaled(factors), rows=lambda good, d: 1.1 * good if d == derivative else good
    )
    with pytest.raises(ValueError, match=f"derivative {derivative}"):
        check_table(space)
    with pytest.raises(ValueError, match=f"derivative {derivative} against differences"):
        table._check_derivatives(space, line.tabulate(space), 1e-5)


def test_matrix_gathers_the_table() -> None:
    basis = line.tabulate(SPLINE)
    coefficients = np.arange(float(SPLINE.count))
    for k in range(3):
        direct = np.einsum("epb,eb->ep", basis.values[:, :, k], coefficients[basis.nodes])
        assert_allclose(
            (table.matrix(basis, k) @ coefficients).reshape(direct.shape),
            direct,
            rtol=1e-14,
            atol=1e-13,
        )


def test_table_refuses_arrays_that_do_not_match() -> None:
    good = line.tabulate(SPLINE)
    for change in (
        {"nodes": good.nodes[:-1]},
        {"weights": good.weights[:, :-1]},
        {"points": good.points[:, :-1]},
        {"values": good.values[0]},
    ):
        with pytest.raises(InputError, match=r"BasisTable\.(nodes|weights|points)"):
            replace(good, **change)


@pytest.mark.parametrize("verb", [line.breaks, line.tabulate, line.sample_field])
def test_unknown_space(verb: Callable[[Any], Any]) -> None:
    with pytest.raises(InputError, match=r"got dict; register a rule with"):
        verb({})
    with pytest.raises(InputError, match="got dict"):
        line.sample({}, 0.0)
