"""pyMOR on systems of this package, and its bases here: against the full models and a published
bound.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem import dynamics, systems
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, StateSpace
from fmbs_skfem.systems import System
from fmbs_skfem.systems.forces import loads

from .. import models

pytest.importorskip("pymor")
from pymor.algorithms.pod import pod as pymor_pod
from pymor.reductors.basic import StationaryRBReductor
from pymor.reductors.bt import BTReductor

from fmbs_skfem.reduction import pymor_models


def bent(cells: int = 8) -> System:
    """A cantilever bent far by a force at its tip that grows with t."""
    return models.cantilever(
        cells, lambda tip: [loads.PointForce("tip", tip, (0.0, 4.0), history=lambda t: t)]
    )


def test_equilibria_by_pymor_and_its_reduced_basis() -> None:
    """Newton's method of pyMOR finds the equilibria of `solve_statics`; a basis of five of them
    another one to 1e-4 of its size.
    """
    system = bent()
    model = pymor_models.statics(system)
    path = [model.solve(t) for t in np.linspace(0.2, 1.0, 5)]
    for k, t in enumerate(np.linspace(0.2, 1.0, 5)):
        exact = dynamics.solve_statics(system, 5).x[k + 1] - system.x0
        np.testing.assert_allclose(
            path[k].to_numpy()[:, 0], exact, atol=1e-7 * np.abs(exact).max(), err_msg=str(t)
        )
    snapshots = model.solution_space.empty()
    for one in path:
        snapshots.append(one)
    vectors = pymor_models.basis(snapshots, modes=5)
    reductor = StationaryRBReductor(model, vectors)
    small = reductor.reduce()
    full = model.solve(0.7)
    found = reductor.reconstruct(small.solve(0.7))
    assert ((found - full).norm() / full.norm())[0] < 1e-4
    mine = pymor_models.reduced(system, vectors)
    assert mine.size == 5
    z = np.linalg.lstsq(
        mine.lift.matrix, np.asarray(system.lift.matrix @ found.to_numpy()[:, 0]), rcond=None
    )[0]
    assert np.linalg.norm(systems.force(mine, z, t=0.7)) < 1e-6 * np.linalg.norm(
        systems.force(mine, 0 * z, t=0.7)
    )


def test_bases_of_both_sides_span_the_same_and_move_the_same_system() -> None:
    """POD of a motion: the largest principal angle is zero, and a System in the basis of pyMOR
    moves as the full one.
    """
    system = models.spin_up(6)
    scheme = GeneralizedAlpha(1e-3, rho_inf=0.8)
    full = dynamics.integrate(system, scheme, 0.3, every=5)
    vectors = pymor_models.NumpyVectorSpace(system.size).from_numpy((full.x - system.x0).T)
    theirs, _ = pymor_pod(vectors, modes=6)
    ours = pymor_models.basis(vectors, modes=6)
    cosines = np.linalg.svd(ours.to_numpy().T @ theirs.to_numpy(), compute_uv=False)
    np.testing.assert_allclose(cosines, 1.0, atol=1e-6)
    more, _ = pymor_pod(vectors, modes=14, rtol=1e-12)
    moved = dynamics.integrate(pymor_models.reduced(system, more), scheme, 0.3, every=5)
    q = [
        np.asarray(one.system.lift.matrix @ one.x.T).T + one.system.lift.offset
        for one in (full, moved)
    ]
    assert np.abs(q[0] - q[1]).max() < 1e-3


def test_balanced_truncation_keeps_its_bound() -> None:
    """|H - H_r| <= 2 (s_(r+1) + ...) at all frequencies; Glover, Int. J. Control 39 (1984),
    doi:10.1080/00207178408933239.
    """
    M, K = (
        np.diag([1.0, 2.0, 3.0]),
        np.array([[5.0, -2.0, 0.0], [-2.0, 4.0, -1.0], [0.0, -1.0, 3.0]]),
    )
    A = np.block(
        [[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(M, K), -0.1 * np.linalg.solve(M, K)]]
    )
    B, C = np.eye(6)[:, [3]], np.eye(6)[[2]]
    space = StateSpace(
        A, B, C, np.zeros((1, 1)), ("u",), ("y",), {}, np.zeros(3), np.eye(3), np.eye(3)
    )
    model = pymor_models.transfer(space)
    omega = np.geomspace(0.05, 20.0, 60)
    exact = space.transfer(omega)[:, 0, 0]
    np.testing.assert_allclose(
        [model.transfer_function.eval_tf(1j * w)[0, 0] for w in omega], exact, rtol=1e-9
    )
    small = BTReductor(model).reduce(4)
    bound = 2.0 * np.sum(model.hsv()[4:])
    error = np.abs([small.transfer_function.eval_tf(1j * w)[0, 0] for w in omega] - exact).max()
    assert 0.01 * bound < error <= bound


def test_what_does_not_fit_is_refused() -> None:
    pinned = models.double_pendulum(3)
    with pytest.raises(InputError, match="a system without multipliers"):
        pymor_models.statics(models.double_pendulum(3, all_multipliers=True))
    with pytest.raises(InputError, match=f"vectors of {pinned.size} numbers, got 4"):
        pymor_models.reduced(pinned, pymor_models.NumpyVectorSpace(4).ones(2))
