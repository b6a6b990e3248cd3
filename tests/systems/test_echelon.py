"""Linear constraints by blocks against their elimination all together; long edges keep independent
rows.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import block_diag, csr_array

from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import echelon, joints
from fmbs_skfem.systems.system import linear_part
from verification.plates import rectangle


def shuffled(seed: int) -> tuple[csr_array, np.ndarray]:
    """Blocks with a redundant and an empty row, rows and columns mixed; consistent."""
    random = np.random.default_rng(seed)
    parts = [random.normal(size=shape) for shape in ((2, 4), (1, 1), (3, 5), (1, 3))]
    parts[2][2] = parts[2][0] - 2.0 * parts[2][1]
    A = csr_array(block_diag([*parts, np.zeros((1, 2))]))
    A = csr_array(A[random.permutation(A.shape[0])][:, random.permutation(A.shape[1])])
    return A, -np.asarray(A @ random.normal(size=A.shape[1]))


@pytest.mark.parametrize("seed", range(4))
def test_blocks_have_the_pivots_of_the_whole(seed: int) -> None:
    A, a = shuffled(seed)
    found = echelon.solve(A, a, 1e-9)
    work = A.toarray()
    pivots, left, right = echelon.eliminated(work, -a, 1e-9, np.ones(A.shape[1]))
    rows, columns = np.array(pivots).T
    order, whole = np.argsort(found.dependent), np.argsort(columns)
    assert_array_equal(found.dependent[order], columns[whole])
    work[:, columns] = 0.0
    assert_allclose(found.solution.toarray()[order], -work[rows[whole]], atol=1e-12)
    assert_allclose(found.fixed[order], right[rows[whole]], atol=1e-12)
    assert_array_equal(np.sort(found.left), left)
    assert len(left) == 2
    assert_allclose(found.gap, 0.0, atol=1e-12)


def test_solutions_satisfy_the_rows() -> None:
    A, a = shuffled(7)
    found = echelon.solve(A, a, 1e-9)
    x = np.random.default_rng(8).normal(size=A.shape[1])
    x[found.dependent] = found.solution @ x + found.fixed
    assert_allclose(A @ x + a, 0.0, atol=1e-12)


@pytest.mark.parametrize("weight", [1e-7, 6e-10, 1e-13])
def test_small_weights_of_other_unknowns_stay(weight: float) -> None:
    """What one of them leaves out moves a plate by as much: 6e-10 m make 0.07 N in one of steel at
    rest.
    """
    A, a = csr_array(np.array([[1.0, weight, 0.0], [0.0, 1.0, 1.0]])), np.array([-1.0, 2.0])
    found = echelon.solve(A, a)
    x = np.array([3.0, -5.0, 7.0])
    x[found.dependent] = found.solution @ x + found.fixed
    assert_allclose(A @ x + a, 0.0, atol=1e-15)


def test_rows_that_contradict_are_told_by_what_they_miss() -> None:
    found = echelon.solve(
        csr_array(np.array([[1.0, 1.0], [2.0, 2.0]])), np.array([0.0, -1.0]), 1e-9
    )
    assert len(found.dependent) == len(found.left) == 1
    assert abs(found.gap[0]) == pytest.approx(1.0 if found.left[0] == 1 else 0.5)


@pytest.mark.parametrize("kind", ["ancf", "bfs", "nurbs"])
def test_a_long_clamped_edge(kind: str) -> None:
    """Every row takes one unknown away, and all rows hold for what is left."""
    body = plate("plate", rectangle(kind, 60, 2, 1.0, 1 / 30), 0.01, Material(1e9, 1e3))
    system = assemble([body], [joints.Edge("clamp", "plate", ("bottom",), slope="z")])
    free = eliminate(system)
    assert free.size == system.size - len(system.constraints.names)
    _, A, a = linear_part(system)
    x = free.lift(np.random.default_rng(0).normal(size=free.size))
    assert_allclose(A @ x + a, 0.0, atol=1e-12)


def test_unknowns_of_falling_weight_are_solved_for_the_leading_ones() -> None:
    """Two bases of falling weight at a joint: the dependent unknowns are among the first modes, and
    well conditioned.
    """
    rng = np.random.default_rng(6)
    D = np.hstack(
        [
            rng.standard_normal((3, 20)) * 0.4 ** np.arange(20.0),
            rng.standard_normal((3, 20)) * 0.4 ** np.arange(20.0),
        ]
    )
    x = rng.standard_normal(40)
    found = echelon.solve(csr_array(D), -D @ x)
    assert np.all(found.dependent % 20 < 5)
    assert np.linalg.cond(D[:, np.sort(found.dependent)]) < 20.0
    assert_allclose(found.solution @ x + found.fixed, x[found.dependent], atol=1e-9)


def test_round_off_of_a_row_makes_no_constraint() -> None:
    """Shape functions at a node are 1 and 0 to the last digit: a column of such zeros is no unknown
    that a row could take away.
    """
    A = csr_array(np.array([[1.0, 0.0, 0.0], [1.0, 1e-17, 0.0], [0.0, 0.0, 1e-9]]))
    found = echelon.solve(A, np.zeros(3))
    assert_array_equal(np.sort(found.dependent), [0, 2])
    assert len(found.left) == 1
    beside = echelon.solve(
        csr_array(np.array([[1.0, 1e-9], [1.0, 2e-9]])), np.zeros(2), units=np.array([1.0, 1e3])
    )
    assert len(beside.dependent) == 2  # slopes of small cells are as good as positions


@pytest.mark.parametrize("cells", [5, 8])
@pytest.mark.parametrize("kind", ["ancf", "bfs", "nurbs"])
def test_a_held_corner_of_a_held_edge_takes_nothing_away_twice(kind: str, cells: int) -> None:
    """A plate on two edges whose corner is pinned as well has lost as many unknowns as its rows
    have rank.

    Which of the two equal rows of the corner is left out is a matter of round-off, and so of the
    processor.
    """
    body = plate("plate", rectangle(kind, cells, cells), 0.01, Material(1e9, 1e3))
    system = assemble(
        [body],
        [
            joints.Edge("edges", "plate", ("left", "bottom"), fixed="z"),
            joints.Pin("pin", At("plate", "a")),
        ],
    )
    with pytest.warns(Notice, match=r"\(their reactions are not unique\): (pin\.z|edges\.z \d+)$"):
        free = eliminate(system)
    singular_values = np.linalg.svd(as_dense(linear_part(system)[1]), compute_uv=False)
    assert free.size == system.size - int((singular_values > 1e-6).sum())


def test_many_rows_of_one_kind_are_told_by_their_number() -> None:
    body = plate("plate", rectangle("bfs", 8, 1), 0.01, Material(1e9, 1e3))
    held = [joints.Edge(name, "plate", ("bottom",), fixed="z") for name in ("once", "twice")]
    with pytest.warns(
        Notice, match=r"\(their reactions are not unique\): (once|twice)\.z \(18 rows\)$"
    ):
        eliminate(assemble([body], held))
