"""Tangents of shells in Kronecker form that turn with their body, against assembled ones."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.compiling.structs import packed
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.systems import change_coordinates, compile_system, compiled, evaluation
from fmbs_skfem.systems.terms import turned_tangents as turning

from ..models import thrown_plate_part

SCHEME = GeneralizedAlpha(1e-3)


def test_a_turned_matrix_is_that_of_turned_vectors() -> None:
    Q = Rotation.from_rotvec([0.4, -2.0, 1.1]).as_matrix()
    K = np.random.default_rng(0).normal(size=(15, 15))
    lower, found = np.tril_indices(15), np.zeros(120)
    turning.turn((K + K.T)[lower], Q, np.zeros((3, 3)), found)
    whole = np.kron(np.eye(5), Q)
    assert_allclose(found, (whole @ (K + K.T) @ whole.T)[lower], atol=1e-13)


@pytest.mark.parametrize("stretch", [(1.0, 0.6, 0.2), (2e-9, 1e-9, 0.0), (1e6, 3.0, 0.0)])
def test_the_nearest_rotation_is_that_of_the_polar_decomposition(
    stretch: tuple[float, ...],
) -> None:
    """Of a flat plate, too, whose third stretch is nothing."""
    Q = Rotation.from_rotvec([2.0, 1.0, -1.5]).as_matrix()
    axes = Rotation.from_rotvec([0.3, 0.2, 0.1]).as_matrix()
    found = Q @ axes @ np.diag(stretch) @ axes.T
    turning.to_rotation(found, np.zeros((3, 3)))
    assert_allclose(found, Q, atol=1e-10)
    nothing = np.zeros((3, 3))
    turning.to_rotation(nothing, np.zeros((3, 3)))
    assert_allclose(nothing, np.eye(3))


def test_a_turn_of_a_deformed_body_gives_the_tangent_assembled_there() -> None:
    """The tangent at a bent shape, turned, is the one assembled at the turned shape; without the
    turn it is not.
    """
    system = thrown_plate_part()
    model = compile_system(system)
    lift, found = (
        as_dense(system.lift.matrix),
        evaluation.Evaluation(compiled.space(model), model.arrays),
    )
    bent = system.x0 + 0.02 * np.random.default_rng(1).normal(size=system.size)
    R = Rotation.from_rotvec([1.0, -0.5, 2.0]).as_matrix()
    fixed = system.lift.offset.reshape(-1, 3)  # of the corner that is held
    turned = np.linalg.lstsq(
        lift, ((system.lift(bent).reshape(-1, 3) @ R.T) - fixed).ravel(), rcond=None
    )[0]
    space, wanted = found.space, as_dense(compiled.tangent(model, turned, np.zeros(0)))
    space.x[:] = bent[model.order]
    evaluation.sum_tangents(table := packed(found))
    space.x[:] = turned[model.order]
    space.turning[0] = 1
    space.W[:] = 0.0
    evaluation.sum_tangents(table)
    at = np.ix_(model.order, model.order)
    assert model.arrays.dense
    assert_allclose(space.W, wanted[at], atol=1e-11 * np.abs(wanted).max())
    assert (
        np.abs(wanted - as_dense(compiled.tangent(model, bent, np.zeros(0)))).max()
        > 0.1 * np.abs(wanted).max()
    )


def test_runs_with_turned_tangents_move_alike() -> None:
    """As the same body in dense coordinates, whose tangents are assembled, to the tolerance of the
    iteration.
    """
    system, sharp = thrown_plate_part(), Newton(tolerance=1e-12)
    dense = change_coordinates(system, np.eye(system.size), np.zeros(system.size))
    assert compiled.space(compile_system(system)).turned.size > 0
    assert compiled.space(compile_system(dense)).turned.size == 0
    one, other = (integrate(each, SCHEME, 0.2, sharp) for each in (system, dense))
    assert_allclose(one.x, other.x, atol=1e-9)
    assert_allclose(one.a, other.a, atol=1e-5 * np.abs(other.a).max())
