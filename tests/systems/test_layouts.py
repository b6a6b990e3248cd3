"""Iteration matrices in blocks: the same matrix, the same motion and the same resumed run as in a
dense matrix or a band.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csr_array

from fmbs_skfem.bodies import Body, cable
from fmbs_skfem.control.events import Event
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts.excitation import Excitation, excite
from fmbs_skfem.systems import (
    At,
    System,
    assemble,
    check_system,
    compile_system,
    eliminate,
    layouts,
    matrices,
)
from fmbs_skfem.systems.compiled import elastic_tangent, storage
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads, springs
from tests import models
from tests.dynamics.test_checkpoint import stopped

DROP = Event(when=of_state("t - 0.05 s"), release=("pin1",))
SCHEME, SHARP = GeneralizedAlpha(1e-3), Newton(tolerance=1e-13)


@cache
def arm() -> Body:
    """A beam of 8 cells with five functions."""
    full = cable("arm", models.segment(8), models.SECTION, models.MATERIAL)
    states = excite(full, Excitation(runs=1, duration=0.1, step=1e-3))
    return parts.reduced_body(full, parts.shape_functions(full, states, None, 5))


def star(open_joints: bool, events: Mapping[str, Event] | None = None) -> System:
    """Six arms from one hub, hung at a tip, the fourth welded to the first; a spring between two
    tips.
    """
    angles = np.pi / 3.0 * np.arange(6)
    turns = [
        np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        for c, s in zip(np.cos(angles), np.sin(angles), strict=True)
    ]
    bodies = [parts.placed(arm(), f"arm{k}", rotation=R) for k, R in enumerate(turns)]
    held: list[joints.Joint] = [joints.Pin("tip", At("arm0", "right"))]
    held += [joints.Pin(f"pin{k}", At("arm0", "left"), At(f"arm{k}", "left")) for k in (1, 2, 4, 5)]
    held += [joints.Weld("weld", At("arm0", "left"), At("arm3", "left"))]
    pull = springs.SpringDamper("spring", At("arm1", "right"), At("arm2", "right"), 50.0, 1.0, 0.5)
    system = assemble(bodies, held, [loads.Gravity((0.0, 0.0, -9.81)), pull], events=events)
    return system if open_joints else eliminate(system)


def run(system: System) -> Trajectory:
    return integrate(system, SCHEME, 0.1, SHARP)


@pytest.fixture
def always(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(layouts, "WORTH", 10.0)


@pytest.mark.parametrize("open_joints, events", [(False, {}), (True, {}), (False, {"drop": DROP})])
def test_blocks_move_as_other_storages(
    open_joints: bool, events: Mapping[str, Event], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(layouts, "WORTH", 0.0)
    other = run(star(open_joints, events))
    monkeypatch.setattr(layouts, "WORTH", 10.0)
    blocks = run(star(open_joints, events))
    assert len(blocks.events) == len(events)
    assert blocks.statistics.solver.startswith("LDL^T of blocks")
    assert not other.statistics.solver.startswith("LDL^T of blocks")
    assert np.abs(blocks.x[-1] - blocks.x[0]).max() > 0.03
    assert_allclose(blocks.x, other.x, atol=1e-10)
    assert_allclose(blocks.multipliers, other.multipliers, atol=1e-5)


@pytest.mark.usefixtures("always")
def test_the_matrix_in_blocks_is_that_of_the_system() -> None:
    system = star(False)
    check_system(system)
    model = compile_system(system)
    layout = model.layout
    assert layout.storage is layouts.Storage.BLOCKS
    x = system.x0 + 1e-3 * np.random.default_rng(0).normal(size=system.size)
    K = csr_array(elastic_tangent(model, x, 0.0)).toarray()
    assert_allclose(layout.matrix(layout.store(K)).toarray(), K, atol=1e-12 * np.abs(K).max())
    assert_allclose(
        layout.matrix(layout.store(system.mass)).toarray(),
        csr_array(system.mass).toarray(),
        atol=1e-15,
    )


@pytest.mark.usefixtures("always")
def test_a_run_in_blocks_is_resumed_bit_for_bit() -> None:
    system, steps = star(False), 48
    whole = integrate(system, SCHEME, steps * SCHEME.step)
    part = stopped(system, 16, SCHEME, steps)
    assert part.checkpoint.arrays["kind"][0] in (0, 4)
    assert_array_equal(integrate(system, SCHEME, steps * SCHEME.step, resume=part).x, whole.x)


def test_many_parts_are_in_blocks_and_one_is_dense() -> None:
    """Six arms of five functions fill a fifth of a dense matrix; a single one fills it."""
    assert storage(star(False)).storage is layouts.Storage.BLOCKS
    one = assemble([arm()], [joints.Pin("A", At("arm", "left"))])
    assert storage(eliminate(one)).storage is layouts.Storage.DENSE


@pytest.mark.parametrize("sparse", [True, False])
def test_matrices_alike_in_all_components_are_stored_once(sparse: bool) -> None:
    """B (x) I serves all components by B; one entry that differs, or couples two of them, makes it
    a plain matrix.
    """
    B = np.array([[2.0, 0.0, 1.0], [0.0, 3.0, 0.0], [1.0, 0.0, 4.0]])
    whole = np.kron(B, np.eye(2))
    form = csr_array if sparse else np.asarray
    found, components = matrices.vectorwise(form(whole), 2)
    assert components == 2
    assert_array_equal(
        csr_array((found.data, found.indices, found.indptr), shape=(3, 3)).toarray(), B
    )
    for i, j, value in ((2, 2, 3.5), (0, 5, 1e-30)):
        other = whole.copy()
        other[i, j] = value
        plain, components = matrices.vectorwise(form(other), 2)
        assert components == 1
        assert_array_equal(
            csr_array((plain.data, plain.indices, plain.indptr), shape=(6, 6)).toarray(), other
        )


def test_orders_of_unknowns_give_the_same_matrix() -> None:
    A = np.arange(20.0).reshape(4, 5) % 3
    order = np.array([3, 0, 4, 2, 1])
    given = csr_array(A)
    found = matrices.permuted(given, order)
    assert_array_equal(found.toarray(), A[:, order])
    found.sum_duplicates()
    assert_array_equal(given.toarray(), A)
    square, order = A[:, :4], np.array([3, 0, 2, 1])
    assert_array_equal(
        matrices.permuted(csr_array(square), order, True).toarray(), square[order][:, order]
    )


def test_bands_become_the_matrix_they_were_made_of() -> None:
    """In the order of the unknowns, without entries for zeros."""
    A = np.array(
        [[4.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 2.0], [0.0, 0.0, 3.0, -1.0], [0.0, 2.0, -1.0, 5.0]]
    )
    order = np.array([0, 1, 3, 2])
    found = matrices.from_lower_band(matrices.lower_band(csr_array(A), np.argsort(order), 1), order)
    assert_array_equal(found.toarray(), A)
    assert found.nnz == np.count_nonzero(A)
