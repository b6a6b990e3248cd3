"""Training over parameters: factors and bases of several runs, reduced families, indicators, stored
and interrupted trainings.
"""

from __future__ import annotations

import dataclasses
import hashlib
import resource
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import subspace_angles

from fmbs_skfem import scenes
from fmbs_skfem.bodies import body, sections
from fmbs_skfem.core.errors import CorruptFile, InputError, NoModel, NoRoom, Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values import expressions
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.dynamics.outputs import lifted
from fmbs_skfem.families import calibration, greedy, training, training_work
from fmbs_skfem.families import training_store as store
from fmbs_skfem.reduction import NONE, Elements, Level, Points, affine, full_runs, reduced_models
from fmbs_skfem.reduction import parameters as boxes
from fmbs_skfem.reduction.accuracy import error_budget, errors
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.full_runs import FullRun, TrainingTask
from fmbs_skfem.reduction.hyper import polynomial, sampling
from fmbs_skfem.reduction.parameters import Parameter, Search
from fmbs_skfem.reduction.plan import Plan
from fmbs_skfem.reduction.spaces import component, galerkin, pod
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import At, System, assemble, compile_system
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.force_laws import ForceLaw
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.system import sizes
from fmbs_skfem.systems.terms.quartic import Quartic
from tests import models
from tests.reduction.hold_out import hold_out, share_runs

SPIN = expressions.of_time("4*(t - sin(pi*t)/pi)")  #: a driven angle that starts smoothly [rad]
YOUNG = Parameter("E", 0.7e9, 1.3e9, unit="Pa")
LENGTH = Parameter("L", 0.8, 1.2, unit="m")
PLAN = Plan({"beam": ("beam",)}, 1e-10, hyper=Elements(1e-3))
INTERVAL = 5e-3


def spun(values: Mapping[str, float]) -> Case:
    """A beam on a driven hinge over 0.5 s: Young's modulus E and length L."""
    material = sections.Material(values.get("E", 1e9), 1800.0)
    mesh = models.segment(10, end=(values.get("L", 1.0), 0.0, 0.0))
    root = At("beam", "left")
    drives = [joints.Pin("hinge", root), joints.DrivenAngle("drive", root, SPIN)]
    part, tip = (
        body.cable("beam", mesh, models.SECTION, material, dim=2),
        probes.Position(At("beam", "right")),
    )
    return Case(assemble([part], drives, outputs={"tip": tip}), GeneralizedAlpha(1e-3), 0.5)


def falling(values: Mapping[str, float]) -> Case:
    """Two beams, the second one hinged to the first, over 0.3 s under gravity g; the constraint
    between them is linear.
    """
    one = body.cable("I", models.segment(6), models.SECTION, models.MATERIAL)
    two = body.cable("II", models.segment(6, (1, 0, 0), (1, 1, 0)), models.SECTION, models.MATERIAL)
    pins = [joints.Pin("A", At("I", "left")), joints.Pin("B", At("I", "right"), At("II", "left"))]
    return Case(
        assemble([one, two], pins, [loads.Gravity((0, 0, -values["g"]))]),
        GeneralizedAlpha(1e-3),
        0.3,
    )


def task_of_family(
    family: Callable[[Mapping[str, float]], Case], parameter: Parameter, plan: Plan = PLAN
) -> TrainingTask:
    return TrainingTask(family, (parameter,), plan, INTERVAL)


@pytest.fixture(scope="module")
def spin() -> TrainingTask:
    return task_of_family(spun, YOUNG)


@pytest.fixture(scope="module")
def two(spin: TrainingTask) -> tuple[FullRun, ...]:
    return tuple(full_runs.full_run(spin, {"E": E}) for E in (0.7e9, 1.3e9))


def snapshots(task: TrainingTask, values: Mapping[str, float]) -> tuple[System, Trajectory]:
    case = task.family(values)
    return case.system, full_runs.run_case(task, case)


def places(task: TrainingTask) -> Search:
    return training.search(
        task.parameters, boxes.grid(task.parameters, 21), boxes.grid(task.parameters, 3)
    )


# Factors and bases


def test_factors_hold_the_snapshots(spin: TrainingTask) -> None:
    """What is cut is FINER of what the bases leave, and nothing of the initial state."""
    raw, motion = snapshots(spin, {"E": 1e9})
    run = full_runs.keep_factors(spin, {"E": 1e9}, raw, motion)
    q = full_runs.states(spin, raw, run)
    X = lifted(motion)[0] - raw.lift(raw.x0)
    cut, whole = (np.linalg.norm(sizes(raw, u)) for u in (q - lifted(motion)[0], X))
    assert cut <= np.sqrt(full_runs.FINER * spin.plan.tolerance) * whole
    np.testing.assert_array_equal(q[0], raw.x0)
    assert np.array_equal(run.times, motion.times)
    few = np.array([3, 7])
    assert np.array_equal(full_runs.states(spin, raw, run, few), q[few])


def test_bases_of_factors_are_those_of_all_snapshots(
    spin: TrainingTask, two: tuple[FullRun, ...]
) -> None:
    """Equation (50): the SVD of [U_1 S_1, U_2 S_2] gives the modes and singular values of all
    snapshots together.
    """
    raw = spun({"E": 1e9}).system
    every = (
        np.hstack([lifted(snapshots(spin, run.values)[1])[0].T for run in two]) - raw.x0[:, None]
    )
    metric = component.metric_of(raw, np.arange(raw.size))
    direct = pod.basis(every, spin.plan.tolerance, mean=np.zeros(len(every)), metric=metric)
    found = reduced_models.bases(spin, raw, two)["beam"]
    r = found.modes.shape[1]
    assert r == direct.modes.shape[1]
    np.testing.assert_allclose(found.singular_values[:r], direct.singular_values[:r], rtol=1e-6)
    assert subspace_angles(found.modes, direct.modes).max() < 1e-5


def test_modes_keep_the_inner_constraints(spin: TrainingTask, two: tuple[FullRun, ...]) -> None:
    raw = spun({"E": 1e9}).system
    A, _ = component.inner_constraints(raw, np.arange(raw.size))
    assert len(A) == 2
    assert np.abs(A @ reduced_models.bases(spin, raw, two)["beam"].modes).max() < 1e-14


def test_snapshots_follow_a_step_that_depends_on_parameters() -> None:
    case = spun({"E": 1e9})
    assert full_runs.snapshot_steps(case, 5e-3).tolist() == list(range(0, 501, 5))
    finer = dataclasses.replace(case, scheme=GeneralizedAlpha(5e-4))
    assert full_runs.snapshot_steps(finer, 5e-3).tolist() == list(range(0, 1001, 10))
    assert full_runs.snapshot_steps(case, np.array([0.001, 0.25, 0.7])).tolist() == [0, 1, 250]
    with pytest.raises(
        InputError, match=r"snapshots: expected times within the duration of 0\.5 s"
    ):
        full_runs.snapshot_steps(case, 2.0)


def test_the_step_has_an_error_of_its_own(spin: TrainingTask) -> None:
    """|q_h - q_2h| / 3 against the distance to a step of h / 8."""
    values = {"E": 1e9}
    run = full_runs.full_run(spin, values)
    case = spun(values)
    fine = integrate(
        case.system, GeneralizedAlpha(1.25e-4), 0.5, Newton(1e-12), np.arange(0, 4001, 40)
    )
    own = full_runs.error(spin, case.system, run, fine) * 64 / 63
    assert full_runs.step_error(spin, values, run) == pytest.approx(own, rel=0.1)


# Reduced families


@pytest.mark.parametrize(
    ("family", "parameter", "plan"),
    [
        (spun, YOUNG, PLAN),
        (spun, YOUNG, dataclasses.replace(PLAN, hyper=Points(1e-7))),
        (falling, Parameter("g", 5.0, 12.0), Plan({"one": ("I",), "two": ("II",)}, 1e-10)),
        (
            falling,
            Parameter("g", 5.0, 12.0),
            Plan({"one": ("I",), "two": ("II",)}, 1e-10, eliminate=True),
        ),
        (
            falling,
            Parameter("g", 5.0, 12.0),
            Plan({"all": ("I", "II")}, modes=8, hyper=Elements(1e-3)),
        ),
    ],
    ids=["E", "E points", "g", "g eliminated", "g system"],
)
def test_a_reduced_family_is_the_reduction_of_every_member(
    family: Callable[[Mapping[str, float]], Case], parameter: Parameter, plan: Plan
) -> None:
    task = task_of_family(family, parameter, plan)
    runs = [
        full_runs.full_run(task, {parameter.name: value})
        for value in (parameter.low, parameter.high)
    ]
    model = reduced_models.make_model(reduced_models.with_polynomials(task), runs)
    reduction = reduced_models.train_reduction(task, runs)
    assert len(model.selections) == (0 if plan.hyper is NONE else 1)
    for value in np.linspace(parameter.low, parameter.high, 4):
        values = {parameter.name: float(value)}
        here, there = model.cases(values), reduced_models.reduced_case(task, reduction, values)
        assert here.system.constraints.names == there.system.constraints.names
        one, other = (lifted(full_runs.run_formed(task, case))[0] for case in (here, there))
        assert np.abs(one - other).max() < 1e-7
        raw = family(values).system
        np.testing.assert_allclose(here.system.lift(here.system.x0), raw.x0, rtol=0, atol=1e-12)


def test_members_of_other_shapes_start_in_their_reduced_space() -> None:
    """The length of the beam is the parameter: modes are deviations from the initial state of each
    member itself.
    """
    task = task_of_family(spun, LENGTH)
    runs = [full_runs.full_run(task, {"L": L}) for L in (0.8, 1.2)]
    reduction = reduced_models.train_reduction(task, runs)
    for L in (0.8, 0.9, 1.2):
        case, raw = reduced_models.reduced_case(task, reduction, {"L": L}), spun({"L": L}).system
        np.testing.assert_allclose(case.system.lift(case.system.x0), raw.x0, rtol=0, atol=1e-14)
        motion = full_runs.run_formed(task, case)
        assert full_runs.error(task, raw, full_runs.full_run(task, {"L": L}), motion) < 1e-3


def test_the_reduced_model_is_good_between_its_runs(
    spin: TrainingTask, two: tuple[FullRun, ...]
) -> None:
    """Truncation alone makes sqrt(eps) = 1e-5 of the motion; its dynamics and the parameters
    between the runs make more.
    """
    model = reduced_models.make_model(spin, two)
    middle = full_runs.full_run(spin, {"E": 1e9})
    for run in (*two, middle):
        motion = full_runs.run_formed(spin, model.cases(run.values))
        raw = spun(run.values).system
        found = full_runs.error(spin, raw, run, motion)
        assert found < 5e-4
        direct = errors.compare(full_runs.run_case(spin, spun(run.values)), motion)
        assert direct.coordinates_mean < 3e-4
        assert found == pytest.approx(direct.mean, rel=1e-2)


def pairs(task: TrainingTask, runs: tuple[FullRun, ...]) -> list[tuple[System, np.ndarray]]:
    return [(run.system, run.states()) for run in reduced_models.project_runs(task, runs).runs]


@pytest.mark.parametrize("eta", [1e-3, 1e-7])
def test_soft_and_stiff_runs_count_alike(
    spin: TrainingTask, two: tuple[FullRun, ...], eta: float
) -> None:
    """A second run with all forces times 1000 and the same states changes nothing: rows are divided
    by the norm of their run.
    """
    (system, states), _ = pairs(spin, two)
    stiff = dataclasses.replace(system, elastic=tuple(stiffer(e) for e in system.elastic))
    (alone,), (both,) = (
        sampling.train([(system, states)], eta),
        sampling.train([(system, states), (stiff, states)], eta),
    )
    assert np.array_equal(alone.sample.indices, both.sample.indices)
    np.testing.assert_allclose(alone.sample.weights, both.sample.weights, rtol=1e-4)


def stiffer(elastic: sampling.Elastic) -> sampling.Elastic:
    section = sampling.sampled_gather(elastic).section.copy()
    section[-1] *= 1000.0
    return dataclasses.replace(elastic, gather=dataclasses.replace(elastic.gather, section=section))


@pytest.mark.parametrize("level", list(Level))
@pytest.mark.parametrize("eta", [1e-3, 1e-7])
def test_every_run_keeps_eta(
    spin: TrainingTask, two: tuple[FullRun, ...], level: Level, eta: float
) -> None:
    """The residual of a run is at most eta sqrt(runs) of its own forces."""
    known = pairs(spin, two)
    (selection,) = sampling.train(known, eta, level)
    w = np.zeros(selection.total)
    w[selection.sample.indices] = selection.sample.weights
    for system, states in known:
        G = np.vstack(list(sampling.training_blocks(list(system.elastic), states, 0, level)))
        assert np.linalg.norm(G @ w - G.sum(axis=1)) <= eta * np.sqrt(2.0) * np.linalg.norm(
            G.sum(axis=1)
        ) * (1 + 1e-6)


def test_polynomials_that_differ_by_a_factor_are_made_once() -> None:
    """The exact polynomial is proportional to Young's modulus."""
    scene = scenes.read(
        Path(__file__).resolve().parents[2] / "examples" / "crank_slider_coarse.yaml"
    )
    raw = build.system(scene)
    rng = np.random.default_rng(0)
    rows = {
        name: component.rows_of(raw, members)
        for name, members in {"c": ["crank"], "l": ["linkage", "slider"]}.items()
    }
    found = {
        name: pod.Basis(np.linalg.qr(rng.normal(size=(len(r), 4)))[0], raw.x0[r], np.ones(4))
        for name, r in rows.items()
    }
    system = galerkin.reduce_system(raw, {"c": ["crank"], "l": ["linkage", "slider"]}, found)
    softer = dataclasses.replace(
        system, elastic=tuple(scaled_modulus(e, 0.6) for e in system.elastic)
    )
    mixed = dataclasses.replace(
        system, elastic=(system.elastic[0], scaled_modulus(system.elastic[1], 0.6))
    )
    known = polynomial.Polynomials()
    known.of(system)
    for other, made in ((softer, 1), (mixed, 2)):
        direct, memo = polynomial.exact(other), known.of(other)
        assert len(known.known) == made
        for one, two in zip(direct.elastic, memo.elastic, strict=True):
            assert isinstance(one.gather, Quartic)
            assert isinstance(two.gather, Quartic)
            size = np.abs(one.gather.coefficients).max()
            assert np.abs(one.gather.coefficients - two.gather.coefficients).max() < 1e-13 * size


def scaled_modulus(elastic: sampling.Elastic, factor: float) -> sampling.Elastic:
    section = sampling.sampled_gather(elastic).section.copy()
    section[0] *= factor
    return dataclasses.replace(elastic, gather=dataclasses.replace(elastic.gather, section=section))


# Indicators


def test_the_indicator_is_that_of_the_residual_by_mass(
    spin: TrainingTask, two: tuple[FullRun, ...]
) -> None:
    model, values = reduced_models.make_model(spin, two[:1]), two[0].values
    motion = full_runs.run_formed(spin, model.cases(values))
    case = spun(values)
    residual = errors.full_residual(compile_system(case.system), motion) * errors.mask(
        case.system, motion.system
    )
    accelerations = residual / (case.system.metric.diagonal() * case.system.weight) ** 0.5
    expected = errors.scaling(case.scheme) * np.trapezoid(
        np.linalg.norm(accelerations, axis=1), motion.times
    )
    assert reduced_models.indicator(spin, motion, values) == pytest.approx(expected, rel=1e-12)


def test_residuals_in_blocks_are_the_same(
    spin: TrainingTask, two: tuple[FullRun, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    model = reduced_models.make_model(spin, two)
    motion = full_runs.run_formed(spin, model.cases({"E": 1e9}))
    whole = reduced_models.indicator(spin, motion, {"E": 1e9})
    apart = full_runs.error(spin, spun(two[0].values).system, two[0], motion)
    for module in (errors, full_runs):
        monkeypatch.setattr(module, "BLOCK", 500)
    assert reduced_models.indicator(spin, motion, {"E": 1e9}) == pytest.approx(whole, rel=1e-12)
    assert full_runs.error(spin, spun(two[0].values).system, two[0], motion) == pytest.approx(
        apart, rel=1e-12
    )


def test_constraints_are_touched_in_every_position() -> None:
    """A driven angle reads both components of the slope, although its Jacobian is zero for one of
    them at the start.
    """
    raw = spun({"E": 1e9}).system
    drive = [k for k, name in enumerate(raw.constraints.names) if name[0] == "drive"]
    assert np.flatnonzero(errors.touched(raw, np.array(drive))).tolist() == [0, 1, 2, 3]
    hinge = [k for k, name in enumerate(raw.constraints.names) if name[0] == "hinge"]
    assert np.flatnonzero(errors.touched(raw, np.array(hinge))).tolist() == [0, 1]


def test_multipliers_that_stand_for_others_are_masked() -> None:
    """Where a driven row is dropped because it depends on others, the multipliers of those are not
    their own.
    """
    raw = spun({"E": 1e9}).system
    hinge, drive = (
        [name for name in raw.constraints.names if name[0] == joint] for joint in ("hinge", "drive")
    )
    without = {
        name: dataclasses.replace(
            raw, constraints=dataclasses.replace(raw.constraints, names=tuple(kept))
        )
        for name, kept in (("hinge", drive), ("drive", hinge))
    }
    assert np.flatnonzero(errors.mask(raw, without["hinge"]) == 0.0).tolist() == [0, 1]
    assert np.flatnonzero(errors.mask(raw, without["drive"]) == 0.0).tolist() == [0, 1, 2, 3]


# Trainings


class Counted:
    """A family of full systems that counts how often it is asked for each point, and may fail."""

    def __init__(self, fails: Callable[[float], bool] = lambda E: False) -> None:
        self.fails = fails
        self.full: list[float] = []

    def form(self, system: System) -> System:
        E = float(system.elastic[0].gather.section.ravel()[0] / models_area())
        self.full.append(round(E, -3))
        if self.fails(E):
            raise SolverError("a full run fails", Reason.NOT_CONVERGED)
        return full_runs.eliminate(system)


def models_area() -> float:
    return float(np.pi * 0.01**2 / 4)


def counted(fails: Callable[[float], bool] = lambda E: False) -> tuple[TrainingTask, Counted]:
    count = Counted(fails)
    return TrainingTask(spun, (YOUNG,), PLAN, INTERVAL, count.form), count


OPTIONS = greedy.Options(iterations=3, max_samples=6)


def test_one_system_is_the_task_without_parameters() -> None:
    """Its only full run is made, or is a motion that is there; a wanted error chooses eps and eta
    as for a box.
    """
    case = spun({"E": 1e9})
    task = full_runs.task_of(case, PLAN, INTERVAL)
    found = training.train(task)
    assert (len(found.runs), found.outcome.stop, found.reduced_runs) == (
        1,
        greedy.StopReason.ALONE,
        0,
    )
    assert np.isnan(found.predicted).all()
    given = training.train(task, motion=full_runs.run_case(task, case))
    one, other = (
        lifted(full_runs.run_formed(task, made.model.cases({})))[0] for made in (found, given)
    )
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)
    wanted = training.train(task, tolerance=1e-3)
    assert wanted.choice is not None
    assert wanted.task.plan.hyper == Elements(wanted.choice.eta)
    motion = full_runs.run_formed(task, wanted.model.cases({}))
    assert full_runs.error(task, case.system, wanted.runs[0], motion) < 1e-3
    with pytest.raises(InputError, match="train: expected candidates of the parameters, got none"):
        training.train(counted()[0])


def test_two_full_runs_are_enough_for_a_tolerance(tmp_path: Path) -> None:
    task, count = counted()
    found = training.train(task, places(task), OPTIONS, tolerance=1e-3)
    assert len(found.runs) == len(count.full) - 1 <= 2  # and one with twice the step
    assert found.predicted[2] <= 1e-3
    assert found.choice is not None
    assert found.choice.truncation <= error_budget.TRUNCATION * 1e-3
    assert found.choice.hyper_reduction <= error_budget.HYPER * 1e-3
    assert found.task.plan.tolerance == found.choice.eps
    assert "eps = " in found.choice.statement
    assert "time step" in found.choice.statement
    checked = hold_out(found, boxes.grid((YOUNG,), 7))
    assert checked.largest < 1e-3
    assert checked.inside >= 0.9


def test_smaller_tolerances_choose_smaller_eps() -> None:
    task, _ = counted()
    run = full_runs.full_run(
        dataclasses.replace(task, plan=dataclasses.replace(PLAN, tolerance=1e-16)), {"E": 1e9}
    )
    rough, fine = (error_budget.choose(task, run, tolerance) for tolerance in (1e-2, 1e-4))
    assert fine.eps < rough.eps
    assert (fine.truncation, rough.truncation) < (
        error_budget.TRUNCATION * 1e-4,
        error_budget.TRUNCATION * 1e-2,
    )
    with pytest.raises(InputError, match="an error between 0 and 1"):
        error_budget.choose(task, run, 0.0)
    measured = dataclasses.replace(task, measure=full_runs.OutputMeasure())
    with pytest.raises(
        NoModel,
        match=r"tolerance: expected at least .*, the best that the reduced model reaches \(\w+: .*, got 1e-14",
    ):
        error_budget.choose(measured, full_runs.full_run(measured, {"E": 1e9}), 1e-14)


def test_pairs_tell_the_error_before_and_after(tmp_path: Path) -> None:
    task, _ = counted()
    found = training.train(task, places(task), dataclasses.replace(OPTIONS, iterations=2))
    table = {(pair.run, pair.bases): pair for pair in found.pairs}
    assert set(table) == {(0, 1), (1, 1), (0, 2), (1, 2)}
    assert table[1, 2].error < 0.5 * table[1, 1].error
    assert table[1, 2].indicator < 0.5 * table[1, 1].indicator
    assert found.calibration == calibration.fit(
        [p.indicator for p in found.pairs], [p.error for p in found.pairs]
    )


class Interrupted(Exception):
    """Stands for a process that is killed."""


@pytest.mark.parametrize("after", [1, 2, 4, 6])
def test_an_interrupted_training_goes_on(after: int, tmp_path: Path) -> None:
    """Stopped anywhere, nothing complete is run again, and the result is that of a training in one
    go.
    """
    whole, count = counted()
    straight = training.train(whole, places(whole), OPTIONS, tmp_path / "straight")
    task, again = counted()
    seen: list[float] = []

    def stop(fraction: float) -> None:
        seen.append(fraction)
        if len(seen) == after:
            raise Interrupted

    with pytest.raises(Interrupted):
        training.train(task, places(task), OPTIONS, tmp_path / "parts", progress=stop)
    early = len(again.full)
    assert early >= 1
    found = training.train(task, places(task), OPTIONS, tmp_path / "parts")
    assert again.full == count.full
    assert found.outcome.stop is straight.outcome.stop
    for one, other in zip(found.outcome.iterations, straight.outcome.iterations, strict=True):
        assert (one.point, one.samples) == (other.point, other.samples)
        np.testing.assert_allclose(one.indicators, other.indicators, rtol=1e-6)
    assert found.reduced_runs == straight.reduced_runs
    for pair, same in zip(found.pairs, straight.pairs, strict=True):
        assert (pair.run, pair.bases) == (same.run, same.bases)
        assert pair.error == pytest.approx(same.error, rel=1e-6)
    third = training.train(task, places(task), OPTIONS, tmp_path / "parts")
    assert again.full == count.full
    assert third.calibration == found.calibration


def test_a_training_with_a_tolerance_goes_on(tmp_path: Path) -> None:
    task, count = counted()
    one = training.train(task, places(task), OPTIONS, tmp_path, tolerance=1e-3)
    made = list(count.full)
    other = training.train(task, places(task), OPTIONS, tmp_path, tolerance=1e-3)
    assert count.full == made
    assert other.choice == one.choice
    assert other.outcome.stop is one.outcome.stop is greedy.StopReason.TOLERANCE
    assert other.task.plan == one.task.plan


@pytest.mark.parametrize("tolerance", [None, 1e-3])
def test_checks_calibrate_the_last_model_without_being_in_it(
    tolerance: float | None, tmp_path: Path
) -> None:
    """Beside full runs that are the same without them; the same call again makes none of them anew."""
    task, count = counted()
    plain = training.train(task, places(task), OPTIONS, tolerance=tolerance)
    task, count = counted()
    found = training.train(task, places(task), OPTIONS, tmp_path, tolerance, checks=2)
    assert len(found.checks) == 2
    assert len(count.full) == len(found.runs) + 2 + (tolerance is not None)
    assert [run.values for run in found.runs[: len(plain.runs)]] == [
        run.values for run in plain.runs
    ]
    assert not {run.values["E"] for run in found.checks} & {run.values["E"] for run in found.runs}
    assert sum(pair.run == training_work.CHECK for pair in found.pairs) == 2
    assert {pair.bases for pair in found.pairs} == {len(found.runs)}
    assert len(found.last.samples) >= OPTIONS.max_samples
    assert set(found.last.samples) >= set(found.outcome.iterations[-1].samples)
    for run, pair in zip(found.checks, found.pairs[-2:], strict=True):
        seen = reduced_models.with_polynomials(found.task)
        motion = full_runs.run_formed(seen, found.model.cases(run.values))
        measured = (
            reduced_models.indicator(seen, motion, run.values),
            full_runs.wanted_error(seen, seen.family(run.values).system, run, motion),
        )
        assert measured == pytest.approx((pair.indicator, pair.error), rel=1e-6)
    made = list(count.full)
    again = training.train(task, places(task), OPTIONS, tmp_path, tolerance, checks=2)
    assert count.full == made
    assert again.predicted == pytest.approx(found.predicted, rel=1e-6)
    assert again.outcome.points == found.outcome.points


def test_runs_that_are_not_in_the_model_show_that_it_is_good_enough() -> None:
    """With `proofs` a training takes the first model that keeps its part of the wanted error there,
    also where it is largest.
    """
    task, _ = counted()
    found = training.train(task, places(task), OPTIONS, tolerance=1e-3, checks=2, proofs=2, aim=0.5)
    assert found.outcome.stop is greedy.StopReason.TOLERANCE
    assert len(found.checks) >= 2
    seen = reduced_models.with_polynomials(found.task)
    for run in found.checks:
        motion = full_runs.run_formed(seen, found.model.cases(run.values))
        assert full_runs.wanted_error(seen, seen.family(run.values).system, run, motion) <= 0.5e-3
    worst = max(
        (k for k in found.last.samples if k not in found.outcome.points),
        key=lambda k: found.last.found[k],
    )
    assert any(
        run.values["E"] == pytest.approx(found.search.candidates[worst, 0]) for run in found.checks
    )
    assert hold_out(found, boxes.grid((YOUNG,), 7)).largest < 1e-3


def test_the_coarsest_eps_is_found_within_a_decade() -> None:
    """Of a run with sharp factors: with ten times as much the model errs by more than its share."""
    task, _ = counted()
    run = full_runs.full_run(
        dataclasses.replace(task, plan=dataclasses.replace(PLAN, tolerance=1e-16)), {"E": 1e9}
    )
    found, usual = (
        error_budget.choose(task, run, 1e-3, coarsest=coarsest) for coarsest in (True, False)
    )
    assert found.eps > usual.eps
    assert found.truncation <= error_budget.SHOWN[0] * 1e-3
    rough = dataclasses.replace(task.plan, tolerance=10.0 * found.eps, hyper=NONE)
    assert error_budget.error_at(task, run, rough) > error_budget.SHOWN[0] * 1e-3


def test_own_runs_count_as_one_where_they_scatter_little() -> None:
    def pairs(*errors: float) -> list[store.Pair]:
        return [store.Pair(k, 2, 1e-5, error) for k, error in enumerate(errors)]

    (one,) = training_work.average_pairs(pairs(1e-3, 2.25e-3))
    assert (one.indicator, one.error) == pytest.approx((1e-5, 1.5e-3))
    assert training_work.average_pairs(pairs(1e-3, 1e-2)) == pairs(1e-3, 1e-2)
    assert training_work.average_pairs(pairs(0.0)) == []


def test_the_folder_of_another_training_is_refused(tmp_path: Path) -> None:
    task, _ = counted()
    training.train(task, places(task), dataclasses.replace(OPTIONS, iterations=1), tmp_path)
    wider = dataclasses.replace(task, parameters=(dataclasses.replace(YOUNG, high=1.4e9),))
    finer = dataclasses.replace(task, plan=dataclasses.replace(PLAN, tolerance=1e-11))
    longer = dataclasses.replace(
        task, family=lambda values: dataclasses.replace(spun(values), duration=0.6)
    )
    sampled = dataclasses.replace(task, plan=dataclasses.replace(PLAN, hyper=Points(1e-3)))
    for other in (wider, finer, longer, sampled):
        with pytest.raises(
            InputError,
            match="expected a folder of this training, got one of another training; take an empty folder",
        ):
            training.train(
                other, places(task), dataclasses.replace(OPTIONS, iterations=1), tmp_path
            )
    with pytest.raises(InputError, match="one of another training"):
        training.train(
            task, places(task), dataclasses.replace(OPTIONS, iterations=1, seed=1), tmp_path
        )
    (tmp_path / "training.h5").unlink()
    with pytest.raises(InputError, match=r"one without training\.h5"):
        training.train(task, places(task), OPTIONS, tmp_path)


def test_a_training_that_ended_goes_on_with_more_iterations(tmp_path: Path) -> None:
    """Full runs, samples and stop are those of one training with all iterations; fewer iterations
    read what is there.
    """
    task, count = counted()
    once = training.train(
        task, places(task), dataclasses.replace(OPTIONS, iterations=1), tmp_path / "parts"
    )
    assert once.outcome.stop is greedy.StopReason.ITERATIONS
    more = training.train(task, places(task), OPTIONS, tmp_path / "parts")
    whole, fresh = counted()
    straight = training.train(whole, places(whole), OPTIONS, tmp_path / "straight")
    assert count.full == fresh.full
    assert (more.outcome.points, more.outcome.stop) == (
        straight.outcome.points,
        straight.outcome.stop,
    )
    assert [i.samples for i in more.outcome.iterations] == [
        i.samples for i in straight.outcome.iterations
    ]
    again = training.train(
        task, places(task), dataclasses.replace(OPTIONS, iterations=1), tmp_path / "parts"
    )
    assert again.outcome.points == more.outcome.points
    assert count.full == fresh.full


def test_few_snapshots_that_are_all_kept_are_no_floor() -> None:
    """A short run has as many modes as snapshots: the indicator is flat, but more full runs lower
    it.
    """
    task = dataclasses.replace(
        counted()[0], interval=0.05, plan=dataclasses.replace(PLAN, tolerance=1e-20)
    )
    found = training.train(task, places(task), dataclasses.replace(OPTIONS, iterations=2))
    run = found.runs[0]
    assert found.models[0].modes["beam"] == len(run.times) - 1 == len(run.factors["beam"].values)
    assert len(found.runs) == 2


def test_eps_is_lowered_where_it_is_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An eps chosen too rough at the first full run: the runs that exist serve once more, and a
    stored training ends the same.
    """
    wanted, rough = 2e-4, 1e-7
    monkeypatch.setattr(
        error_budget,
        "choose",
        lambda *_: error_budget.BudgetChoice(wanted, rough, 1e-3, 1e-5, 1e-5, None),
    )
    task, count = counted()
    found = training.train(task, places(task), OPTIONS, tmp_path, tolerance=wanted)
    assert 1 <= found.lowered <= training_work.LOWERINGS
    assert found.task.plan.tolerance == pytest.approx(
        rough * training_work.LOWER_EPS**found.lowered, rel=1e-12
    )
    assert found.task.plan.hyper.tolerance == pytest.approx(
        1e-3 * training_work.LOWER_ETA**found.lowered, rel=1e-12
    )
    assert found.reduced_runs == found.outcome.evaluations + found.discarded
    assert found.discarded >= 3
    assert len({run.values["E"] for run in found.runs}) == len(found.runs)
    before, after = (
        reduced_models.make_model(
            reduced_models.with_polynomials(dataclasses.replace(found.task, plan=plan)), found.runs
        )
        for plan in (
            dataclasses.replace(found.task.plan, tolerance=rough, hyper=Elements(1e-3)),
            found.task.plan,
        )
    )
    points, full = boxes.grid((YOUNG,), 5), share_runs(found.task)
    assert (
        hold_out(found, points, after, full).largest
        < 0.3 * hold_out(found, points, before, full).largest
    )
    made = list(count.full)
    again = training.train(task, places(task), OPTIONS, tmp_path, tolerance=wanted)
    assert count.full == made
    assert (again.lowered, again.discarded, again.choice) == (
        found.lowered,
        found.discarded,
        found.choice,
    )


def kinked(values: Mapping[str, float]) -> Case:
    """A beam whose Young's modulus has a kink over its length."""
    return spun({"L": values["L"], "E": 1e9 * (1.0 + 0.1 * abs(values["L"] - 0.97))})


def test_a_family_of_lengths_is_a_polynomial_of_them() -> None:
    task = task_of_family(spun, LENGTH)
    model = reduced_models.make_model(task, [full_runs.full_run(task, {"L": 1.0})])
    assert model.obstacle == ""
    raw = spun({"L": 0.9}).system
    motion = full_runs.run_formed(task, model.cases({"L": 0.9}))
    assert full_runs.error(task, raw, full_runs.full_run(task, {"L": 0.9}), motion) < 2e-3


def test_a_family_that_is_no_polynomial_is_made_member_by_member(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The training goes on all the same; one whose model is to be saved ends with the reason at its
    first full run.

    Polynomials are sought once for the full systems and once for the reduced ones.
    """
    sought, fit = list[object](), affine.fit
    monkeypatch.setattr(affine, "fit", lambda *given: (sought.append(given), fit(*given))[1])
    task = task_of_family(kinked, LENGTH)
    search = training.search((LENGTH,), boxes.grid((LENGTH,), 5), boxes.grid((LENGTH,), 3))
    few = dataclasses.replace(OPTIONS, iterations=2, max_samples=3)
    with pytest.warns(Notice, match="no polynomial of its parameters"):
        found = training.train(task, search, few, tmp_path)
    assert (len(found.runs), len(sought)) == (2, 2)
    with pytest.raises(InputError, match="numbers that are polynomials of the parameters"):
        _ = found.model.parametric
    assert hold_out(found, np.array([[0.9]])).largest < 1e-3
    with pytest.warns(Notice):
        again = training.train(task, search, few, tmp_path)
    assert again.outcome.points == found.outcome.points
    assert again.pairs == found.pairs
    with (
        pytest.warns(Notice),
        pytest.raises(NoModel, match="it is no polynomial of its parameters: parameter 'L'"),
    ):
        training.train(task, search, few, tmp_path / "savable", savable=True)
    assert sorted(path.name for path in (tmp_path / "savable").glob("run-*")) == ["run-001.h5"]


def test_a_damaged_run_is_told(tmp_path: Path) -> None:
    task, _ = counted()
    once = dataclasses.replace(OPTIONS, iterations=1)
    training.train(task, places(task), once, tmp_path)
    path = tmp_path / "run-001.h5"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(CorruptFile, match=r"run-001\.h5: expected sha256"):
        training.train(task, places(task), once, tmp_path)


@pytest.mark.parametrize("room, made", [(100, 1), (30_000, 2)])
def test_a_full_disk_loses_nothing(room: int, made: int, tmp_path: Path) -> None:
    """The largest size of a file stands for the room left, for no file or for small ones; no full
    run is made twice.
    """
    task, count = counted()
    seen: list[int] = []
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)

    def fill(fraction: float) -> None:
        seen.append(len(count.full))
        if len(seen) == 2:
            resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))

    try:
        with pytest.raises(
            NoRoom,
            match=r"(?s)expected room on the disk.*make room, then (train|call the same) again",
        ):
            training.train(task, places(task), OPTIONS, tmp_path, progress=fill)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
    assert len(count.full) == made
    found = training.train(task, places(task), OPTIONS, tmp_path)
    assert len(count.full) == len(found.runs)


def test_a_full_run_that_fails_in_a_corner_is_left_out() -> None:
    task, _ = counted(lambda E: E > 1.29e9)
    found = training.train(task, places(task), OPTIONS)
    assert dict(found.outcome.failed) == {20: "a full run fails"}
    assert len(found.runs) >= 2
    assert all(run.values["E"] < 1.29e9 for run in found.runs)


def test_a_reduced_run_that_fails_is_infinite(spin: TrainingTask, two: tuple[FullRun, ...]) -> None:
    """A negative modulus has no motion."""
    work = training_work.TrainingState(
        spin, spin, Search(np.array([[1e9], [-1e9]]), (0,), 0), store.store_of(None), None
    )
    work.models = [reduced_models.make_model(spin, two)]
    assert 0.0 < training_work.evaluate(work, 0) < np.inf
    assert training_work.evaluate(work, 1) == np.inf


def test_a_family_that_never_runs_is_told() -> None:
    task, _ = counted(lambda E: True)
    with pytest.raises(
        NoModel,
        match=r"a first full run that succeeds, got E = 1e\+09 Pa: a full run fails; E = 7e\+08 Pa: ",
    ):
        training.train(task, places(task), OPTIONS)


# Searches


def test_samples_and_first_point_are_candidates() -> None:
    known = (YOUNG, Parameter("g", 5.0, 12.0))
    grid = boxes.grid(known, 3)
    found = training.search(known, grid, grid[[0, 4]], grid[8])
    assert (found.samples, found.first) == ((0, 4), 8)
    assert training.search(known, grid, grid[:1]).first == 4
    other = training.search(known, grid, [[0.8e9, 6.0]], [0.9e9, 7.0])
    np.testing.assert_array_equal(other.candidates[9:], [[0.8e9, 6.0], [0.9e9, 7.0]])
    assert (other.samples, other.first) == ((9,), 10)


def test_the_fingerprint_takes_laws_by_their_names() -> None:
    """Routines and makers of laws are no functions of time."""
    digests = []
    for name in ("torsion_spring", "torsion_spring", "moment_2"):
        digest = hashlib.sha256()
        law = dataclasses.replace(ForceLaw.find(name), maker=partial(ForceLaw.find))
        store.add_to_digest(law, digest)
        digests.append(digest.hexdigest())
    assert digests[0] == digests[1] != digests[2]


def test_the_fingerprint_takes_functions_of_time_by_values_and_others_by_name() -> None:
    """A function of Python that is no function of time is not called; what it has taken along tells
    it from another one.
    """

    def digest_of(value: object) -> str:
        digest = hashlib.sha256()
        store.add_to_digest(value, digest)
        return digest.hexdigest()

    def push(size: float) -> Callable[[object, object, object], float]:
        def force(x: object, v: object, t: object) -> float:
            raise AssertionError("called")

        return lambda x, v, t: size * force(x, v, t)

    assert digest_of(push(1.0)) == digest_of(push(1.0)) != digest_of(push(2.0))
    assert digest_of(partial(push, 1.0)) != digest_of(partial(push, 2.0))
    system = spun({"E": 1e9}).system
    moved = [dataclasses.replace(system, signals=(lambda t, k=k: k * t,)) for k in (1.0, 1.0, 2.0)]
    assert digest_of(moved[0]) == digest_of(moved[1]) != digest_of(moved[2])


@pytest.mark.parametrize("begin", [0.02, 1.5])
def test_the_fingerprint_sees_functions_of_time_over_the_whole_duration(begin: float) -> None:
    """A blow between two sixteenths of a second, and one that begins after the first second."""
    case = dataclasses.replace(spun({"E": 1e9}), duration=3.0)
    digests = []
    for k in (1.0, 1.0, 2.0):
        digest = hashlib.sha256()
        moved = dataclasses.replace(
            case.system, signals=(lambda t, k=k: np.where(np.abs(t - begin - 0.01) < 0.01, k, 0.0),)
        )
        store.add_to_digest(dataclasses.replace(case, system=moved), digest)
        digests.append(digest.hexdigest())
    assert digests[0] == digests[1] != digests[2]
