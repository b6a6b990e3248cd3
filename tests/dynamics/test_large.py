"""Large models: the sparse step, direct or with multigrid, gives what the band gives; massless axes
are no obstacle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_array, diags_array

from fmbs_skfem.bodies import Body, Material, cable
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.contact.contacts import ContactSphere
from fmbs_skfem.core import machine_memory
from fmbs_skfem.core.errors import Reason, SolverError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.dynamics.compiled_step import large
from fmbs_skfem.systems import (
    At,
    System,
    assemble,
    compile_system,
    compiled,
    eliminate,
    free_motions,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from .. import models
from ..bodies.test_plate import rectangle

SCHEME, TIGHT = GeneralizedAlpha(2e-4), Newton(tolerance=1e-14)


def hanging(cells: int = 6) -> System:
    """A plate in space that hangs on two corners and falls under gravity and a follower force of
    its third corner.
    """
    body = plate("plate", rectangle("ancf", cells, cells), 0.01, Material(2e9, 1000.0, 0.3))
    pins = [joints.Pin(name, At("plate", name)) for name in ("a", "b")]
    return assemble(
        [body],
        pins,
        [
            loads.Gravity((0.0, 0.0, -9.81)),
            loads.PointForce("push", At("plate", "c"), (0.0, 0.0, 5.0)),
        ],
    )


def run(system: System, steps: int = 40) -> Trajectory:
    return integrate(system, SCHEME, steps * SCHEME.step, TIGHT)


@pytest.fixture
def sparse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)


def test_sparse_and_band_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    system = hanging()
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 10_000)
    band = run(system)
    assert band.statistics.solver.startswith(("band", "dense"))
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)
    found = run(system)
    assert found.statistics.solver.startswith("sparse LDL^T")
    assert_allclose(found.x, band.x, atol=1e-10 * np.linalg.norm(system.x0))
    assert_allclose(found.multipliers[1:], band.multipliers[1:], rtol=1e-5, atol=1e-5)


def test_points_that_touch_and_such_as_do_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plate that falls on a ball under one of its nodes, with friction, and turns about it."""
    body = plate("plate", rectangle("ancf", 3, 3), 0.01, Material(2e9, 1000.0, 0.3))
    under = ContactSphere(
        "ball",
        body="plate",
        points=5,
        center=(0.66, 0.67, -0.11),
        diameter=0.2,
        stiffness=1e4,
        friction=0.3,
    )
    system = assemble(
        [body], [joints.Pin("a", At("plate", "a"))], [loads.Gravity((0.0, 0.0, -9.81)), under]
    )
    found = []
    for width in (10_000, 20):
        monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", width)
        found.append(integrate(system, GeneralizedAlpha(2e-3), 0.08, TIGHT))
    band, sparse = found
    assert [motion.statistics.solver.startswith("sparse") for motion in found] == [False, True]
    assert sparse.memory is not None
    touching = (sparse.memory.reshape(len(sparse.times), 256, -1)[..., 0] > 0.0).sum(axis=1)
    assert 0 < touching.max() < 5
    assert_allclose(sparse.x, band.x, atol=1e-9)


@pytest.mark.usefixtures("sparse")
def test_multigrid_is_taken_where_factors_do_not_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    system = hanging()
    direct = run(system, 10)
    monkeypatch.setattr(machine_memory, "free", lambda: 1e5)
    found = run(system, 10)
    assert "multigrid" in found.statistics.solver
    assert_allclose(found.x, direct.x, atol=1e-9 * np.linalg.norm(system.x0))


@pytest.mark.usefixtures("sparse")
def test_sparse_tangent_is_that_of_the_band(monkeypatch: pytest.MonkeyPatch) -> None:
    """The assembled tangent of blocks of cells equals the band at a random state, damping included."""
    system = hanging()
    x = system.x0 + 1e-3 * np.random.default_rng(0).normal(size=system.size)
    none = np.zeros(len(system.constraints.names))
    one = compiled.tangent(compile_system(system), x, none, gh=3.0).toarray()
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 10_000)
    two = compiled.tangent(compile_system(system), x, none, gh=3.0).toarray()
    assert_allclose(one, two, atol=1e-12 * np.abs(two).max())


def test_a_straight_line_has_no_rigid_motion_about_itself() -> None:
    line = cable("line", models.segment(4), models.SECTION, models.MATERIAL)
    found = free_motions.rigid_motions(assemble([line]))
    assert found.shape[1] == 5
    assert_allclose(np.linalg.norm(found, axis=0), 1.0)


def test_rigid_motions_cost_no_energy() -> None:
    system = assemble(
        [
            plate(
                "plate",
                rectangle("ancf", 3, 3),
                0.01,
                Material(2e9, 1000.0, 0.3),
                origin=np.array([3.0, 1.0, -2.0]),
            )
        ]
    )
    model = compile_system(system)
    B, K = free_motions.rigid_motions(system), compiled.tangent(model, system.x0, np.zeros(0))
    assert B.shape == (system.size, 6)
    assert np.linalg.matrix_rank(B) == 6
    assert np.abs(K @ B).max() < 1e-10 * abs(K).max()


def lamina(name: str, k: int) -> Body:
    """A thin rectangle in the plane z = 0: its axis e3 has no mass."""
    ends = {"left": (0.1 * k, 0.0, 0.0), "right": (0.1 * (k + 1), 0.0, 0.0)}
    return rigid(name, 1.0, np.diag([0.002, 0.003, 0.005]), (0.1 * k + 0.05, 0.0, 0.0), places=ends)


@pytest.mark.parametrize("count", [3, 40])
def test_chain_of_laminae(count: int) -> None:
    """Massless axes are determined by joints alone; a chain of hinges about y falls and stays in
    its plane, energy is kept.
    """
    bodies = [lamina(f"p{k}", k) for k in range(count)]
    hinges = [joints.Revolute("h0", At("p0", "left"), axis=(0.0, 1.0, 0.0))]
    hinges += [
        joints.Revolute(
            f"h{k}", At(f"p{k}", "left"), At(f"p{k - 1}", "right"), axis=(0.0, 1.0, 0.0)
        )
        for k in range(1, count)
    ]
    system = assemble(bodies, hinges, [loads.Gravity((0.0, 0.0, -9.81))])
    found = integrate(system, GeneralizedAlpha(1e-3, 1.0), 0.05, TIGHT)
    x, v = found.x[-1], found.v[-1]
    kinetic = 0.5 * v @ system.mass @ v
    assert kinetic > 0.01
    assert kinetic == pytest.approx(system.loads.constant @ (x - system.x0), rel=2e-3)
    assert np.abs(x.reshape(-1, 4, 3)[:, 0, 1]).max() < 1e-9


def carried(cells: int, corners: str, turn: float, thickness: float) -> Trajectory:
    """The platform of `models` falls; J is that of a lamina for thickness 0, turned about x."""
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    J = R @ np.diag([0.02, 0.02, 0.04 * (1 - thickness)]) @ R.T
    return integrate(
        eliminate(models.platform(cells, J, corners=corners)), GeneralizedAlpha(5e-4), 0.05
    )


@pytest.mark.parametrize(
    "cells,corners,turn", [(8, "abc", 0.0), (40, "abc", 0.0), (40, "abc", 0.5), (40, "a", 0.5)]
)
def test_a_lamina_on_cables(cells: int, corners: str, turn: float) -> None:
    """An axis without mass beside coordinates that are slaved to cables: the motion is that with
    almost none there.
    """
    thin, thick = (outputs(carried(cells, corners, turn, thickness)) for thickness in (0.0, 1e-6))
    assert thin["place_z"].min() < -1e-4
    for name in ("place_x", "place_y", "place_z"):
        assert_allclose(thin[name], thick[name], atol=1e-6 * np.abs(thin["place_z"]).max())


def test_constant_operators_of_sparse_systems_act(monkeypatch: pytest.MonkeyPatch) -> None:
    """Damping in proportion to mass and constant springs between the functions of a body: the same
    motion as with a band.
    """
    body = plate("plate", rectangle("ancf", 6, 6), 0.01, Material(2e9, 1000.0, 0.3))
    sprung = replace(body, stiffness=csr_array(50.0 * body.mass))
    free = assemble(
        [sprung], [joints.Pin("a", At("plate", "a"))], [loads.Gravity((0.0, 0.0, -9.81))]
    )
    damped = replace(free, damping=csr_array(30.0 * csr_array(free.mass)))
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 10_000)
    band, still = run(damped), run(replace(damped, damping=0.0 * csr_array(free.mass)))
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)
    found = run(damped)
    assert found.statistics.solver.startswith("sparse")
    assert np.abs(still.x - band.x).max() > 1e-6
    assert_allclose(found.x, band.x, atol=1e-10 * np.linalg.norm(damped.x0))


@pytest.mark.usefixtures("sparse")
@pytest.mark.parametrize("name", ["factorise", "solve"])
def test_errors_behind_the_doors_come_through(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """What goes wrong in Python inside the compiled step is raised as it is; only without factors
    the step is halved.
    """

    def fail(self: large.Large, step: object, table: int = 0) -> None:
        raise error

    monkeypatch.setattr(large.Large, name, fail)
    error: BaseException = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        run(hanging(3), 2)
    error = SolverError("no convergence", Reason.NOT_CONVERGED)
    with pytest.raises(SolverError, match="singular" if name == "factorise" else "no convergence"):
        run(hanging(3), 2)


def test_the_analysis_of_a_matrix_serves_others_of_its_pattern() -> None:
    """Not those of another pattern; both are solved."""
    n, none = 40, np.zeros((40, 0))
    b = np.ones((1, n))
    one = csr_array(
        diags_array(
            [np.full(n - 1, -1.0), np.full(n, 3.0), np.full(n - 1, -1.0)], offsets=(-1, 0, 1)
        )
    )
    wide = csr_array(one + diags_array([np.full(n - 5, 0.1)] * 2, offsets=(-5, 5)))
    first = large.inverse(one, none)
    again, other = (
        large.inverse(csr_array(2.0 * one), none, before=first),
        large.inverse(wide, none, before=first),
    )
    assert again.tree is first.tree
    assert other.tree is not first.tree
    for found, matrix in ((again, 2.0 * one), (other, wide)):
        assert_allclose(matrix @ found.solve(b)[0], b[0], rtol=1e-5)
