"""Functions that the trace on an edge determines: the sparse test of independence agrees with the
dense factorisation.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csr_array

from fmbs_skfem.bodies import plate
from fmbs_skfem.core.algebra import ranks
from fmbs_skfem.systems.connections import edge_slopes
from verification.plates import rectangle


def by_qr(
    A: csr_array, monkeypatch: pytest.MonkeyPatch
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    with monkeypatch.context() as patch:
        patch.setattr(ranks, "regular_columns", lambda columns: False)
        return ranks.determined(A)


@pytest.mark.parametrize("kind", ["ancf", "nurbs", "bfs", "argyris"])
@pytest.mark.parametrize("slope", [False, True])
@pytest.mark.parametrize("names", [("bottom",), ("bottom", "right", "top", "left")])
def test_sparse_and_dense_find_the_same(
    kind: str, slope: bool, names: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    shape = rectangle(kind, 12, 3, 1.0, 0.25)
    A = plate.trace(shape, plate.edge("edge", shape, names), slope)
    for one, other in zip(ranks.determined(A), by_qr(A, monkeypatch), strict=True):
        assert_array_equal(one, other)


def test_dependent_columns_are_found() -> None:
    """The third column is the sum of the others: the trace cannot tell them apart."""
    random = np.random.default_rng(0)
    columns = random.normal(size=(8, 2))
    A = csr_array(np.column_stack([columns, columns.sum(axis=1), np.zeros(8)]))
    assert not ranks.regular_columns(csr_array(A[:, :3]))
    first, second, X = ranks.determined(A)
    assert (len(first), len(second)) == (2, 1)
    assert_allclose(A[:, second].toarray(), A[:, first] @ X, atol=1e-12)
    assert_array_equal(np.sort(np.concatenate([first, second])), [0, 1, 2])


@pytest.mark.parametrize("close", [1e-3, 1e-8])
def test_nearly_dependent_columns_are_left_to_the_dense_factorisation(close: float) -> None:
    A = csr_array(np.array([[1.0, 1.0], [0.0, close], [0.0, 0.0]]))
    assert ranks.regular_columns(A) is (close > 1e-5)
    assert len(ranks.determined(A)[0]) == 2


@pytest.mark.parametrize("kind", ["ancf", "nurbs", "bfs", "argyris"])
@pytest.mark.parametrize("slope", [False, True])
def test_what_an_edge_holds_does_not_depend_on_the_unit(kind: str, slope: bool) -> None:
    """Of plates of a micrometre and of 10 km, whose slopes and curvatures are numbers of other
    sizes.
    """
    found = []
    for size in (1.0, 1e-2, 1e-6, 1e4):
        shape = rectangle(kind, 4, 3, size, 0.5 * size)
        sides = plate.edge("edge", shape, ("left", "top"))
        first, second, X = ranks.determined(plate.trace(shape, sides, slope))
        found.append((len(first), len(second), np.linalg.matrix_rank(X)))
        assert len(edge_slopes.across(shape, sides)[0]) == len(
            edge_slopes.across(rectangle(kind, 4, 3, 1.0, 0.5), sides)[0]
        )
    assert len(set(found)) == 1
