"""Thousands of constraints: what analyses them stays sparse, and finds what few dense rows show
too.
"""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem.bodies import Material, rigid
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.scenes.build import MANY
from fmbs_skfem.systems import At, System, assemble, compiled, free_motions, layouts
from fmbs_skfem.systems.connections import joints, mechanism, redundancy
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.system import change_coordinates, chosen, is_linear
from fmbs_skfem.systems.terms import sparse
from verification.plates import rectangle

EDGES = ("left", "right", "bottom", "top")


def clamped(cells: int, *held: joints.Joint) -> System:
    """A square plate in space under its weight."""
    body = plate("plate", rectangle("ancf", cells, cells), 0.01, Material(1e9, 1e3))
    return assemble([body], held, [loads.Gravity((0.0, 0.0, -9.81))])


def test_nothing_of_constraints_by_coordinates_is_dense() -> None:
    """2248 rows on as many coordinates: one such array has 40 MB."""
    system = clamped(80, joints.Edge("clamp", "plate", EDGES, slope="z"))
    rows = len(system.constraints.names)
    assert rows > 4 * MANY
    # compilation is not counted
    mechanism.analyse(clamped(2, joints.Edge("clamp", "plate", EDGES, slope="z")))
    tracemalloc.start()
    try:
        assert mechanism.redundant(system) == ()
        found = mechanism.analyse(system)
        assert free_motions.unsupported(system) == ((), ())
        assert redundancy.without_redundant(system) is system
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert found.mobility == 0
    assert peak < 0.6 * 8.0 * rows**2


def test_rows_in_doubt_are_found_among_many() -> None:
    """Edges of two joints share a corner, and a pin repeats another one."""
    held = [joints.Edge("a", "plate", ("left",)), joints.Edge("b", "plate", ("bottom",))]
    system = clamped(12, *held)
    near = redundancy.doubtful(*redundancy.rows_of(system))
    assert 0 < len(near) < 0.2 * len(system.constraints.names)
    found = mechanism.redundant(system)
    assert {one.row.partition(".")[0] for one in found} <= {"a", "b"}
    assert len(found) == 3
    assert all(one.gap == pytest.approx(0.0, abs=1e-12) for one in found)


def test_sparse_rows_are_the_dense_ones() -> None:
    """Also products and angles, away from the start."""
    body = plate("plate", rectangle("ancf", 3, 3), 0.01, Material(1e9, 1e3), dim=2)
    wheel = rigid.rigid("wheel", 1.0, np.array(1.0), (0.0, 0.0), dim=2)
    turned = [
        joints.Revolute("pin", At("wheel", "frame")),
        joints.DrivenAngle("drive", At("wheel", "frame"), lambda t: 0.3 + t),
    ]
    system = assemble([body, wheel], [joints.Edge("held", "plate", ("left",)), *turned])
    rows, _z = redundancy.rows_of(system)
    x = system.x0 + 0.1 * np.random.default_rng(0).normal(size=system.size)
    used = rows.used
    phi, J = rows(x[used])
    gap, dense = compiled.gap(compiled.compile_system(system), x)
    assert_allclose(phi, gap, atol=1e-15)
    assert_allclose(as_dense(J), dense[:, used], atol=1e-15)
    assert not is_linear(system.constraints).all()


def test_a_choice_of_unknowns_is_no_product() -> None:
    """Held coordinates leave the system's arrays as they were, row by row."""
    system = clamped(4, joints.Edge("clamp", "plate", ("left",), slope="z"))
    kept = np.setdiff1d(np.arange(system.size), [0, 4, 5])
    V = sparse.csr_array(
        (np.ones(len(kept)), (kept, np.arange(len(kept)))), shape=(system.size, len(kept))
    )
    assert_array_equal(chosen(V), kept)
    assert chosen(sparse.csr_array(2.0 * V)) is None
    free = change_coordinates(system, V, np.zeros(system.size))
    assert abs(free.mass - V.T @ system.mass @ V).max() == 0.0
    assert_array_equal(free.x0, system.x0[kept])
    assert abs(free.probes.matrix - system.probes.matrix @ V).max() == 0.0


def test_the_pattern_of_functions_is_that_of_the_tangent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)
    system = clamped(5, joints.Edge("clamp", "plate", ("left",)))
    model = compiled.compile_system(system)
    assert compiled.storage(system).storage is layouts.Storage.SPARSE
    x = system.x0 + 0.01 * np.random.default_rng(1).normal(size=system.size)
    W = abs(compiled.elastic_tangent(model, x, 0.0)) + abs(system.mass)
    blocks = sparse.csr_array(W)
    functions = sparse.function_pattern(system)
    touched = {(i // 3, j // 3) for i, j in zip(*blocks.nonzero(), strict=True)}
    assert touched <= set(zip(*(part.tolist() for part in functions.nonzero()), strict=True))
    assert functions.nnz < 1.3 * len(touched)
