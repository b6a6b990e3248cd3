"""Comparators on example 1 of Hou, Liu, Hu (2020), doi 10.1016/j.cma.2019.112690, two pendulums and
a plate, with few cells.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import comparators
import grassmann
import numpy as np
import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integration, run
from fmbs_skfem.families import training, trials
from fmbs_skfem.families.greedy import Options
from fmbs_skfem.families.trials import Comparator, Row
from fmbs_skfem.reduction import Elements, Exact
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.full_runs import Full, FullRun, TrainingTask
from fmbs_skfem.reduction.parameters import Parameter
from fmbs_skfem.reduction.plan import Plan
from fmbs_skfem.reduction.spaces import component
from fmbs_skfem.systems import At, Motion, assemble
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from tests import models
from tests.clocks import wind
from tests.reduction.hold_out import share_runs

from ..bodies.test_plate import rectangle

YOUNG = Parameter("E", 0.7e9, 1.3e9, unit="Pa")  #: the range of example 1
SOFT, STIFF = {"E": 0.7e9}, {"E": 1.3e9}
POINTS = np.linspace(0.7e9, 1.3e9, 7)[:, None]
SHARP = Newton(tolerance=1e-12)
BEAM = {"beam": ("beam",)}


def spin_up(values: Mapping[str, float]) -> Case:
    """Example 1 with 12 cells over its first second; the hinge is at x [m], where that is given."""
    x, root = values.get("x", 0.0), At("beam", "left")
    shape = models.segment(12, (x, 0.0, 0.0), (x + 1.0, 0.0, 0.0))
    beam = body.cable("beam", shape, models.SECTION, sections.Material(values["E"], 1800.0), dim=2)
    drive = joints.DrivenAngle("drive", root, models.spin_angle)
    return Case(
        assemble([beam], [joints.Pin("hinge", root, (x, 0.0)), drive]),
        GeneralizedAlpha(1e-3),
        1.0,
        SHARP,
    )


def pendulum(values: Mapping[str, float]) -> Case:
    """Example 2 with 6 cells a beam over its first 0.3 s."""
    material = sections.Material(values["E"], 1800.0)
    first = body.cable("I", models.segment(6), models.SECTION, material)
    second = body.cable("II", models.segment(6, (1, 0, 0), (1, 1, 0)), models.SECTION, material)
    pins = [joints.Pin("A", At("I", "left")), joints.Pin("B", At("I", "right"), At("II", "left"))]
    system = assemble([first, second], pins, [loads.Gravity((0, 0, -values["g"]))])
    return Case(system, GeneralizedAlpha(1e-3), 0.3, SHARP)


def thrown(values: Mapping[str, float]) -> Case:
    """A soft plate that spins in its plane."""
    shape = rectangle("ancf", 4, 2, 1.0, 0.5)
    free = plate("plate", shape, 0.02, sections.Material(values["E"], 1000.0, 0.3), dim=2)
    system = assemble([free], initial={"plate": Motion((1.0, 0.0), 5.0)})
    return Case(system, GeneralizedAlpha(1e-3), 0.3, SHARP)


@pytest.fixture(scope="module")
def task() -> TrainingTask:
    return TrainingTask(spin_up, (YOUNG,), Plan(BEAM, 1e-12), 5e-3)


@pytest.fixture(scope="module")
def full(task: TrainingTask) -> Full:
    return share_runs(task)


@pytest.fixture(scope="module")
def rows(task: TrainingTask, full: Full) -> dict[str, Row]:
    """All comparators without hyper-reduction at seven values of E, of which the first and the last
    are nodes.
    """
    search = training.search(
        (YOUNG,), np.linspace(0.7e9, 1.3e9, 61)[:, None], np.linspace(0.7e9, 1.3e9, 5)[:, None]
    )
    several = [
        comparators.fast_to_slow(task, full, STIFF),
        *(comparators.uniform(task, full, [count]) for count in (2, 3)),
        *(comparators.nearest(task, full, [count]) for count in (2, 3)),
        *(comparators.interpolated(task, full, [count]) for count in (2, 3, 4)),
        comparators.greedy(task, search, Options(iterations=2)),
    ]
    return {row.name: row for row in trials.compare(task, several, full, POINTS)}


def errors(row: Row) -> np.ndarray:
    return np.array([trial.error for trial in row.trials])


def space(case: Case) -> np.ndarray:
    """Columns of the reduced space in body coordinates."""
    return as_dense(case.system.lift.matrix)


def at_node(task: TrainingTask, full: Full, values: Mapping[str, float], modes: int) -> np.ndarray:
    """The space of the run at a point alone."""
    alone = replace(task, plan=replace(task.plan, modes=modes))
    return space(comparators.fixed(alone, "", [full(values)]).family(values))


def test_interpolated_and_nearest_bases_are_exact_at_the_nodes(
    task: TrainingTask, full: Full, rows: dict[str, Row]
) -> None:
    for make in (comparators.interpolated, comparators.nearest):
        family = make(task, full, [3]).family
        for E in (0.7e9, 1.0e9, 1.3e9):
            here = space(family({"E": E}))
            assert grassmann.distance(here, at_node(task, full, {"E": E}, here.shape[1])) < 1e-9
    for name in ("nearest basis 2", "nearest basis 3", "Grassmann 2", "Grassmann 3", "Grassmann 4"):
        found = errors(rows[name])
        # truncation of eps = 1e-12 is all that is left there, and a small part of the error between
        # the nodes
        assert max(found[0], found[-1]) < 4e-5
        assert found.max() > 3 * max(found[0], found[-1])


def test_errors_between_the_nodes(rows: dict[str, Row]) -> None:
    """More nodes are better; of equal nodes an interpolated basis is better than the nearest one,
    one of all runs than both.
    """
    largest = {name: row.max_error for name, row in rows.items()}
    assert largest["Grassmann 2"] < largest["nearest basis 2"] / 2
    assert largest["Grassmann 3"] < largest["nearest basis 3"] / 2
    assert largest["uniform grid 2"] < largest["Grassmann 2"] / 5
    assert largest["uniform grid 3"] < largest["Grassmann 3"] / 5
    assert largest["nearest basis 3"] < largest["nearest basis 2"] / 2
    assert largest["uniform grid 3"] < largest["uniform grid 2"] / 2
    assert largest["Grassmann 4"] < largest["Grassmann 3"] / 2 < largest["Grassmann 2"] / 4
    assert all(np.array_equal(np.isfinite(errors(row)), np.ones(7)) for row in rows.values())


def test_fast_to_slow_is_worse_than_greedy_at_the_far_end(rows: dict[str, Row]) -> None:
    """Figs 13 and 14: the basis of one run is as good as any where it was made, and fails towards
    the other end of the range.
    """
    one, greedy = errors(rows["fast to slow"]), errors(rows["greedy"])
    assert one[-1] < 4e-5
    assert np.all(np.diff(one) < 0.0)
    assert one[0] > 100 * one[-1]
    assert one[0] > 5 * greedy[0]
    assert rows["greedy"].max_error < rows["fast to slow"].max_error / 5
    assert (rows["fast to slow"].full_runs, rows["greedy"].full_runs) == (1, 2)
    assert rows["fast to slow"].reduced_runs == 0 < 5 <= rows["greedy"].reduced_runs


@pytest.mark.parametrize("count", [2, 3])
def test_interpolated_spaces_converge_with_the_order_of_their_nodes(
    task: TrainingTask, count: int
) -> None:
    """Halving the range divides the distance to the space of a run between the nodes by 2 to the
    number of nodes.
    """
    apart = []
    for half in (2e-2, 1e-2):
        narrow = replace(
            task,
            parameters=(Parameter("E", 1e9 * (1 - half), 1e9 * (1 + half)),),
            plan=Plan(BEAM, modes=4),
        )
        runs, place = share_runs(narrow), {"E": 1e9 * (1 + 0.4 * half)}
        here = space(comparators.interpolated(narrow, runs, [count]).family(place))
        apart.append(grassmann.distance(here, at_node(narrow, runs, place, 4)))
    assert np.log2(apart[0] / apart[1]) == pytest.approx(count, abs=0.15)


def test_initial_state_and_linear_constraints_are_exact_everywhere(task: TrainingTask) -> None:
    """With a hinge that moves with a parameter: no comparator interpolates the start or loosens the
    hinge.
    """
    wide = replace(task, parameters=(YOUNG, Parameter("x", 0.0, 2.0)))
    runs = share_runs(wide)
    several = [
        comparators.fast_to_slow(wide, runs, {"E": 1.3e9, "x": 0.0}),
        comparators.uniform(wide, runs, [1, 2]),
        comparators.nearest(wide, runs, [1, 2]),
        comparators.interpolated(wide, runs, [1, 2]),
    ]
    for values in ({"E": 0.8e9, "x": 0.0}, {"E": 0.9e9, "x": 1.7}):
        raw = spin_up(values).system
        A, _ = component.inner_constraints(raw, component.rows_of(raw, ["beam"]))
        assert A.shape == (2, raw.size)
        for comparator in several:
            system = comparator.family(values).system
            assert np.abs(system.lift(system.x0) - raw.lift(raw.x0)).max() < 1e-14
            assert np.abs(A @ space(comparator.family(values))).max() < 1e-14
            assert system.constraints.names == (("drive", "angle"),) == raw.constraints.names[2:]


def test_two_parameters_and_two_components() -> None:
    """The nodes of a tensor grid belong to the runs that were made there; the joint between the
    components is kept.
    """
    both = (Parameter("E", 0.7e9, 1.3e9), Parameter("g", 5.0, 12.0))
    task = TrainingTask(pendulum, both, Plan({"I": ("I",), "II": ("II",)}, 1e-10), 5e-3)
    runs = share_runs(task)
    for make in (comparators.interpolated, comparators.nearest):
        family = make(task, runs, [1, 3]).family
        for g in (5.0, 8.5, 12.0):
            values = {"E": 1.0e9, "g": g}
            case, own = family(values), comparators.fixed(task, "", [runs(values)]).family(values)
            first, last = case.system.components[0][1:]
            # the equal number of modes is the largest of the nodes': the space of the run alone is
            # in it
            mine, wanted = grassmann.orthonormal(space(case)), space(own)
            assert np.abs(wanted - mine @ (mine.T @ wanted)).max() < 1e-9
            assert [name for name, _, _ in case.system.components] == ["I", "II"]
            assert 0 < first + last < case.system.size
            assert {joint for joint, _ in case.system.constraints.names} == {"B"}
    coarse = comparators.at_system_level(task)
    assert coarse.plan.components == {"system": ("I", "II")}
    (row,) = trials.compare(
        coarse,
        [comparators.uniform(coarse, share_runs(coarse), [2, 2])],
        share_runs(coarse),
        [[1e9, 9.0]],
    )
    assert (row.name, row.full_runs, list(row.modes), row.elements) == (
        "uniform grid 2 x 2",
        4,
        ["system"],
        12,
    )
    assert row.max_error == row.mean_error < 2e-4


def test_hyper_reduction_of_fixed_bases_only(
    task: TrainingTask, full: Full, rows: dict[str, Row]
) -> None:
    """Weights are trained over all runs of a basis; an interpolated one keeps all cells."""
    sampled = replace(task, plan=replace(task.plan, hyper=Elements(1e-4)))
    several = [
        comparators.uniform(sampled, full, [2]),
        comparators.interpolated(sampled, full, [2]),
    ]
    weighted, plain = trials.compare(sampled, several, full, POINTS[::3])
    assert 0 < weighted.elements < 12 == plain.elements == rows["uniform grid 2"].elements
    assert 0 < weighted.points < plain.points == rows["uniform grid 2"].points
    assert errors(weighted) == pytest.approx(errors(rows["uniform grid 2"])[::3], rel=0.2)
    assert errors(plain) == pytest.approx(errors(rows["Grassmann 2"])[::3], rel=1e-6)


def test_exact_polynomials_of_interpolated_bases() -> None:
    """A planar plate without a single point in use moves as with all of them."""
    task = TrainingTask(
        thrown, (Parameter("E", 1e6, 2e6),), Plan({"plate": ("plate",)}, 1e-10), 5e-3
    )
    exact, runs = replace(task, plan=replace(task.plan, hyper=Exact())), share_runs(task)
    (all_points,) = trials.compare(
        task, [comparators.interpolated(task, runs, [2])], runs, [[1e6], [1.3e6]]
    )
    (none,) = trials.compare(
        exact, [comparators.interpolated(exact, runs, [2])], runs, [[1e6], [1.3e6]]
    )
    assert (all_points.elements, none.elements, none.points) == (8, 0, 0)
    assert errors(none) == pytest.approx(errors(all_points), rel=1e-3)
    assert 0.0 < all_points.max_error < 1e-4


def test_full_runs_are_shared_and_counted(
    task: TrainingTask, full: Full, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Offline are the full runs, and one second for each basis, by a clock that every look at it
    moves on by as much.
    """
    wind(monkeypatch, comparators)
    made: list[float] = []

    def counted(values: Mapping[str, float]) -> Case:
        made.append(values["E"])
        return spin_up(values)

    runs = share_runs(replace(task, family=counted))
    assert runs(SOFT) is runs(dict(SOFT))
    several = [comparators.uniform(task, runs, [2]), comparators.nearest(task, runs, [2])]
    assert made == [0.7e9, 1.3e9]
    assert [one.full_runs for one in several] == [2, 2]
    spent = runs(SOFT).cpu_s + runs(STIFF).cpu_s
    assert [one.offline_s for one in several] == pytest.approx(
        [spent + 1.0, spent + 2.0], rel=1e-12
    )
    trials.compare(task, several, runs, np.array([[0.7e9], [1.3e9]]))
    assert made == [0.7e9, 1.3e9]


def test_a_member_that_fails_is_listed_with_its_reason(
    task: TrainingTask, full: Full, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Newton's iteration with too few steps at one point: that run ends with a reason, the others
    go on.
    """
    wind(monkeypatch, integration, run)
    model = comparators.fast_to_slow(task, full, STIFF)

    def family(values: Mapping[str, float]) -> Case:
        case = model.family(values)
        return replace(case, newton=Newton(1e-12, iterations=1)) if values["E"] < 0.8e9 else case

    (row,) = trials.compare(
        task, [Comparator("few iterations", family, 1, 0.0)], full, np.array([[0.7e9], [1.3e9]])
    )
    assert row.trials[0].error == row.max_error == np.inf
    assert "Newton iteration did not converge" in row.trials[0].reason
    assert row.trials[1].error < 4e-5
    assert row.trials[1].reason == ""
    assert row.run_s == row.trials[1].run_s > 0.0


def test_a_point_without_a_full_run_is_marked(task: TrainingTask, full: Full) -> None:
    """The full model fails at one point: that point has no error, with the reason, and the others
    count.
    """

    def failing(values: Mapping[str, float]) -> FullRun:
        if values["E"] < 0.8e9:
            raise SolverError("no motion", Reason.DIVERGED)
        return full(values)

    model, points = (
        comparators.fast_to_slow(task, full, STIFF),
        np.array([[0.7e9], [1.0e9], [1.3e9]]),
    )
    with pytest.warns(Notice, match="the full model has no motion at E = 7e"):
        (row,) = trials.compare(task, [model], failing, points)
    (all_of_them,) = trials.compare(task, [model], full, points)
    assert (np.isnan(row.trials[0].error), row.trials[0].reason) == (True, "no motion")
    assert errors(row)[1:].tolist() == errors(all_of_them)[1:].tolist()
    assert row.max_error == errors(all_of_them)[1:].max() < all_of_them.max_error
    with pytest.warns(Notice):
        assert np.isnan(trials.compare(task, [model], failing, points[:1])[0].max_error)


def test_warm_up_changes_nothing(task: TrainingTask, full: Full) -> None:
    before = space(comparators.fast_to_slow(task, full, STIFF).family(SOFT))
    trials.compile_training(task)
    assert np.array_equal(space(comparators.fast_to_slow(task, full, STIFF).family(SOFT)), before)


def test_refusals(task: TrainingTask, full: Full) -> None:
    with pytest.raises(InputError, match="comparators and hold-out points"):
        trials.compare(task, [], full, POINTS)
    with pytest.raises(InputError, match=r"1 number\(s\) of values from 1 on"):
        comparators.uniform(task, full, [2, 2])
    with pytest.raises(InputError, match="expected one of E, got 'Young'"):
        comparators.fast_to_slow(task, full, {"Young": 1e9})
