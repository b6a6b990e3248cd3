"""Invariant bases: they hold every rotation of a state, their points keep the Kronecker form, and
they serve other directions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import comparators
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem import reduction
from fmbs_skfem.bodies import Body, Material, Rim, body, sections
from fmbs_skfem.bodies.body import ShapePoints
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.families import trials
from fmbs_skfem.reduction import Elements, Exact, HyperReduction, Plan, Points, files
from fmbs_skfem.reduction.accuracy import comparison
from fmbs_skfem.reduction.accuracy.comparison import ComparisonOptions
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.full_runs import TrainingTask, task_of
from fmbs_skfem.reduction.parameters import Parameter
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.systems import At, System, assemble, change_coordinates, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.system import linear_part
from tests import models
from tests.reduction.hold_out import share_runs
from verification.vibration import ring

SCHEME, SHARP, DURATION = GeneralizedAlpha(1e-3), Newton(tolerance=1e-12), 0.6
COMPONENTS = {"I": ("I",), "II": ("II",)}
DOWN, ASKEW = (0.0, 0.0, -9.81), (0.0, -6.937, 6.937)


def arms() -> list[Body]:
    first = body.cable("I", models.segment(16), models.SECTION, models.MATERIAL)
    return [
        first,
        body.cable("II", models.segment(16, (1, 0, 0), (1, 1, 0)), models.SECTION, models.MATERIAL),
    ]


def pendulum(weight: tuple[float, ...] = DOWN) -> System:
    """Two arms at right angles, hung at I.left."""
    held = [joints.Pin("A", At("I", "left")), joints.Pin("B", At("I", "right"), At("II", "left"))]
    return assemble(
        arms(), held, [loads.Gravity(weight)], outputs={"free": probes.Position(At("II", "right"))}
    )


@cache
def full(weight: tuple[float, ...] = DOWN) -> Trajectory:
    return integrate(eliminate(pendulum(weight)), SCHEME, DURATION, SHARP, 2)


def reduced(
    weight: tuple[float, ...] = DOWN,
    hyper: HyperReduction | None = None,
    invariant: bool = True,
    solve: bool = True,
) -> System:
    """Trained on the pendulum whose weight points down, used with another weight."""
    plan = Plan(
        COMPONENTS, 1e-12, hyper=hyper or reduction.NONE, eliminate=solve, invariant=invariant
    )
    model = reduction.train(
        task_of(Case(pendulum(), SCHEME, DURATION), plan, 2e-3), motion=full()
    ).model
    if weight == DOWN:
        return model.system
    modes = {
        name: replace(one, mean=one.mean + raw_start(name)) for name, one in model.bases.items()
    }
    return galerkin.reduce_system(pendulum(weight), COMPONENTS, modes, solve)


def raw_start(name: str) -> np.ndarray:
    raw = pendulum()
    return raw.lift(raw.x0)[component.rows_of(raw, (name,))]


def test_the_basis_holds_every_turned_state_and_keeps_the_joints() -> None:
    """A turned state is as near as the state itself where nothing is pinned, and pinned coordinates
    stay.
    """
    raw = assemble(arms())
    data = reduction.snapshots(full())
    found = reduction.bases(raw, data, COMPONENTS, 1e-10, invariant=True)["II"]
    rows = component.rows_of(raw, ("II",))
    states = data.q[::20, rows].reshape(-1, len(rows) // 3, 3)
    W = component.metric_of(raw, rows)

    def missed(values: np.ndarray) -> float:
        apart = (values.reshape(len(values), -1) - found.mean).T
        left = (
            apart
            - found.modes
            @ np.linalg.lstsq(
                found.modes.T @ (W @ found.modes), found.modes.T @ (W @ apart), rcond=None
            )[0]
        )
        return float(np.sqrt(np.sum(left * (W @ left))))

    R = Rotation.from_rotvec([0.4, -1.1, 2.0]).as_matrix()
    shift = np.outer(raw.unit[rows[::3] // 3], [3.0, -1.0, 2.0])
    assert missed(states) > 0.0
    assert missed(states @ R.T + shift) == pytest.approx(missed(states), rel=1e-3)
    held = reduction.bases(pendulum(), data, COMPONENTS, 1e-10, invariant=True)["I"]
    A = component.inner_constraints(pendulum(), component.rows_of(pendulum(), ("I",)))[0]
    assert np.abs(A @ held.modes).max() < 1e-12
    assert held.modes.shape[1] % 3 == 0


@pytest.mark.parametrize("solve", [False, True])
def test_points_keep_the_kronecker_form_and_are_consistent(solve: bool) -> None:
    system = reduced(solve=solve)
    assert all(isinstance(one.gather, ShapePoints) for one in system.elastic)
    assert not linear_part(system)[0].size or not solve
    check_system(system)
    dense = change_coordinates(system, np.eye(system.size), np.zeros(system.size))
    assert not any(isinstance(one.gather, ShapePoints) for one in dense.elastic)
    one, other = (integrate(each, SCHEME, 0.05, SHARP) for each in (system, dense))
    assert_allclose(one.x, other.x, atol=1e-8)


def test_it_serves_a_weight_in_another_direction_and_modes_of_coordinates_do_not() -> None:
    """The second row of the table: largest error of a motion of two metres."""
    wanted = full(ASKEW)
    mine, others = (
        integrate(reduced(ASKEW, invariant=kind), SCHEME, DURATION, SHARP, 2)
        for kind in (True, False)
    )
    errors = [reduction.compare(wanted, one).summary["position_error"] for one in (mine, others)]
    assert errors[0] < 1e-4
    assert errors[1] > 100.0 * errors[0]


@pytest.mark.parametrize(("hyper", "most"), [(Points(1e-2), 40), (Elements(1e-2), 96)])
def test_it_is_sampled(hyper: HyperReduction, most: int) -> None:
    system = reduced(hyper=hyper)
    assert all(isinstance(one.gather, ShapePoints) for one in system.elastic)
    assert sum(len(one.gather.cell) for one in system.elastic) <= most
    assert (
        reduction.compare(full(), integrate(system, SCHEME, DURATION, SHARP, 2)).summary[
            "position_error"
        ]
        < 1e-3
    )


def test_a_number_of_modes_is_the_largest() -> None:
    found = reduction.bases(
        pendulum(), reduction.snapshots(full()), COMPONENTS, modes=20, invariant=True
    )
    assert [found[name].modes.shape[1] for name in COMPONENTS] == [18, 18]


def test_a_file_holds_it(tmp_path: Path) -> None:
    system = reduced(hyper=Points(1e-4), solve=False)
    files.save(system, tmp_path / "model.h5")
    again = files.load(tmp_path / "model.h5")
    one, other = (integrate(each, SCHEME, 0.05, SHARP) for each in (system, again))
    np.testing.assert_array_equal(one.x, other.x)


def test_it_stands_beside_the_other_levels_in_a_comparison() -> None:
    raw = pendulum()
    plan = Plan(COMPONENTS, 1e-10, hyper=Points(1e-3), invariant=True)
    options = ComparisonOptions(repeat=1, expensive=True)
    found = comparison.run(task_of(Case(raw, SCHEME, 0.2), plan, 2e-3), options)
    names = {record.name for record in found.records if record.level == "invariant"}
    assert names == {"invariant", "invariant+ecsw-points"}
    assert {record.status for record in found.records} == {"done"}
    assert found["invariant"].max_error < 2.0 * found["component"].max_error


def young(values: Mapping[str, float]) -> Case:
    """The pendulum of another material."""
    material = sections.Material(values["E"], 1800.0)
    first = body.cable("I", models.segment(8), models.SECTION, material)
    second = body.cable("II", models.segment(8, (1, 0, 0), (1, 1, 0)), models.SECTION, material)
    pins = [joints.Pin("A", At("I", "left")), joints.Pin("B", At("I", "right"), At("II", "left"))]
    return Case(assemble([first, second], pins, [loads.Gravity(DOWN)]), SCHEME, 0.3, SHARP)


def test_families_and_comparators_take_it() -> None:
    """One basis of two full runs, as a polynomial of Young's modulus and at the corner of it;
    Grassmann interpolation as well.
    """
    task = TrainingTask(
        young,
        (Parameter("E", 0.7e9, 1.3e9, unit="Pa"),),
        Plan(COMPONENTS, 1e-11, invariant=True),
        3e-3,
    )
    runs = share_runs(task)
    given = [comparators.uniform(task, runs, (2,)), comparators.interpolated(task, runs, (2,))]
    rows = trials.compare(task, given, runs, np.array([[1.0e9]]))
    assert all(not row.trials[0].reason for row in rows), [row.trials[0].reason for row in rows]
    assert rows[0].max_error < 1e-4
    system = given[0].family({"E": 1.1e9}).system
    assert all(isinstance(one.gather, ShapePoints) for one in system.elastic)
    fresh = young({"E": 1.1e9}).system
    factor = system.elastic[0].gather.section[0].max() / 1.1e9
    assert factor == pytest.approx(fresh.elastic[0].gather.section[0].max() / 1.1e9)


def hinged_ring(duration: float) -> tuple[System, Trajectory]:
    """A ring in the plane turns about its inner rim, driven by a torque."""
    steel = Material(young_modulus=2e8, density=7800.0, poisson_ratio=0.3)
    shape = plate(
        "ring",
        ring(0.1, 0.3, 12),
        0.01,
        steel,
        dim=2,
        rims={"hub": Rim(("inner",)), "edge": Rim(("outer",))},
    )
    forces = [loads.Gravity((0.0, -9.81)), loads.Torque("motor", At("ring", "hub"), 800.0)]
    seen = {"angle": probes.Angle(At("ring", "hub"))}
    raw = assemble([shape], [joints.Pin("hinge", At("ring", "hub"))], forces, outputs=seen)
    return raw, integrate(eliminate(raw), SCHEME, duration, SHARP, 2)


@pytest.mark.parametrize("hyper", [reduction.NONE, Exact(), Points(1e-5)])
def test_in_the_plane_modes_are_closed_under_quarter_turns(hyper: HyperReduction) -> None:
    raw, wanted = hinged_ring(0.1)
    plan = Plan({"ring": ("ring",)}, 1e-14, hyper=hyper, invariant=True)
    model = reduction.train(task_of(Case(raw, SCHEME, 0.1), plan, 2e-3), motion=wanted).model
    modes = model.bases["ring"].modes
    turned = modes.reshape(-1, 2, modes.shape[1])[:, ::-1] * np.array([-1.0, 1.0])[None, :, None]
    left = (
        turned.reshape(modes.shape)
        - modes @ np.linalg.lstsq(modes, turned.reshape(modes.shape), rcond=None)[0]
    )
    assert np.abs(left).max() < 1e-9 * np.abs(modes).max()
    motion = integrate(model.system, SCHEME, 0.1, SHARP, 2)
    assert reduction.compare(wanted, motion).maximum < 1e-6
    assert as_dense(model.system.mass).shape[0] == 22
