"""The study of one system: every model against the full one, on a coarse mesh, and the published
counts of example 2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import paper
import pytest

from fmbs_skfem import reduction
from fmbs_skfem.bodies import body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.display import DisplayUnits
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, integration, run
from fmbs_skfem.reduction import (
    Elements,
    HyperReduction,
    Plan,
    Points,
    TrainingTask,
    files,
    plan,
    task_of,
)
from fmbs_skfem.reduction.accuracy import comparison, costs, runs
from fmbs_skfem.reduction.accuracy.comparison import Comparison, ComparisonOptions, ModelRecord
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.full_runs import FullRun
from fmbs_skfem.reduction.reduced_models import ReducedModel, make_model
from fmbs_skfem.studies import figures, tables
from fmbs_skfem.systems import At, System, assemble
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from tests import models
from tests.clocks import PRICES, set_prices, wind
from tests.reduction.conftest import Full, error

SCHEME = GeneralizedAlpha(5e-4)
MAIN = ("system", "component", "system+ecsw", "component+ecsw", "component+ecsw-points")
COMPONENTS = {"I": ("I",), "II": ("II",)}


def task_for(raw: System, duration: float, plan: Plan) -> TrainingTask:
    """Snapshots every 5 ms of steps of 0.5 ms."""
    return task_of(Case(raw, SCHEME, duration, Newton(1e-10)), plan, 5e-3)


def trained(full: Full, plan: Plan) -> ReducedModel:
    """The model of a plan from the snapshots of a full run."""
    return make_model(
        task_for(full.raw, 3.0, plan), [FullRun({}, full.data.times, {}, 0.0, q=full.data.q)]
    )


@pytest.fixture(scope="module")
def small() -> Iterator[Comparison]:
    """Example 2 with 24 cells a beam over 0.8 s."""
    task = task_for(
        models.double_pendulum(24, all_multipliers=True),
        0.8,
        Plan(COMPONENTS, 1e-9, hyper=Elements(1e-3)),
    )
    options = ComparisonOptions(
        tolerances=(1e-6,),
        hyper_tolerances=(1e-2,),
        steps=(2.5e-4, 1e-3),
        ffrf_modes=4,
        repeat=1,
    )
    coarse = {cells: models.double_pendulum(cells, all_multipliers=True) for cells in (4, 8)}
    with pytest.MonkeyPatch.context() as patch:
        set_prices(patch)
        wind(patch, integration, run)
        yield comparison.run(task, options, coarse)


def test_every_model_is_there_once_and_done(small: Comparison) -> None:
    names = [record.name for record in small.records]
    assert len(names) == len(set(names))
    assert {"full", *MAIN, "ffrf", "coarse-4", "coarse-8", "step-2.5e-4", "step-1e-3"} <= set(names)
    assert "component+ecsw-points 1e-6/1e-2" in names
    assert {record.status for record in small.records} == {"done"}
    assert all(
        record.cpu_s > 0 and record.wall_s > 0 and record.iterations > 0 for record in small.records
    )


def test_parts_of_the_time_are_calls_times_the_time_of_one(small: Comparison) -> None:
    """An iteration takes a force and a solution, a factorisation has a tangent inside; products are
    told apart from both.
    """
    for record in small.records:
        if record.name == "ffrf":  # no elastic terms
            continue
        calls, factored = record.iterations, record.factorisations
        assert (
            record.force_s + record.product_s
            == calls * PRICES["force"] + factored * PRICES["tangent"]
        )
        assert record.solve_s == calls * PRICES["solution"] + factored * (
            PRICES["factor"] - PRICES["tangent"]
        )
        assert record.kr_us == 1e6 * PRICES["tangent"]
    for level, terms in (
        ("system", 1),
        ("component", 2),
    ):  # each with a gather, a scatter, and U^T D U
        record = small[level]
        products = record.iterations * 2 + record.factorisations * (0.5 * 2 + 1)
        assert record.product_s == terms * products * PRICES["product"]
    assert small["full"].product_s == 0.0


def test_the_reference_has_no_error_and_all_coordinates(small: Comparison) -> None:
    full = small["full"]
    assert (full.max_error, full.mean_error, full.position_error) == (0.0, 0.0, 0.0)
    assert full.dofs == small["step-1e-3"].dofs == 2 * 50 * 3
    assert small["coarse-4"].dofs == 2 * 10 * 3


def test_error_falls_with_eps(small: Comparison) -> None:
    for name in ("system", "component"):
        fine, rough = small[name], small[f"{name} 1e-6"]
        assert fine.dofs > rough.dofs
        assert fine.max_error < 0.35 * rough.max_error
        assert fine.mean_error < 0.35 * rough.mean_error
        assert fine.max_error < 3e-3


def test_hyper_reduction_keeps_fewer_cells_and_the_error(small: Comparison) -> None:
    whole, cells, points = (
        small[name] for name in ("component", "component+ecsw", "component+ecsw-points")
    )
    assert whole.elements == {"I": 24, "II": 24}
    assert whole.points == {"I": 72, "II": 72}
    assert all(
        cells.elements[name] < 20 and points.points[name] < cells.points[name]
        for name in COMPONENTS
    )
    assert cells.max_error == pytest.approx(whole.max_error, rel=0.05)
    assert points.max_error == pytest.approx(whole.max_error, rel=0.05)
    assert set(cells.snnls_s) == set(COMPONENTS)
    assert not whole.snnls_s


def test_full_models_converge_with_the_mesh_and_the_step(small: Comparison) -> None:
    """Cubic elements: at least third order from 4 to 8 cells; |e(2h)| = 4 |e(h/2)| where e is the
    distance from the run with h.
    """
    assert small["coarse-8"].position_error < small["coarse-4"].position_error / 8
    assert small["coarse-8"].max_error > 0
    assert small["step-1e-3"].position_error == pytest.approx(
        4 * small["step-2.5e-4"].position_error, rel=0.3
    )


def test_what_is_finer_than_the_reference_is_no_worse(small: Comparison) -> None:
    """The distance of a finer step from the full model is the error of that: it stands in brackets,
    and in no front.
    """
    assert [record.name for record in small.records if record.finer] == ["step-2.5e-4"]
    assert {point.name for point in figures.points(small)} == {
        record.name for record in small.records
    } - {"step-2.5e-4"}
    rows = {row[0]: row for row in tables.overview(small, DisplayUnits()).rows}
    assert rows["step-2.5e-4"][4] == f"({small['step-2.5e-4'].max_error:.2e})"
    assert rows["step-1e-3"][4] == f"{small['step-1e-3'].max_error:.2e}"
    size = small["full"].dofs
    told = paper.origin_of({"source": "S", "models": {"full": {"dofs": [2 * size]}}}, small)
    assert told.startswith(
        f"paper: S; here: {size} coordinates in the full model, {2 * size} there, compiled Python on "
    )


def test_steps_that_meet_few_states_are_refused() -> None:
    """0.333 ms meets steps of 0.5 ms at multiples of 166.5 ms alone: an error at t = 0 and four
    later instants is none.
    """
    task = task_for(models.double_pendulum(4, all_multipliers=True), 0.8, Plan(COMPONENTS, 1e-9))
    with pytest.raises(
        InputError,
        match=r"steps: expected a step that meets at least 20 of the .* stored states .*, got 0.000333 s, which meets 5;",
    ):
        comparison.run(task, ComparisonOptions(steps=(1e-3, 3.33e-4)))


def test_time_error_is_second_order(small: Comparison) -> None:
    found = small.time_error
    assert found.order == pytest.approx(2.0, abs=0.2)
    assert found.position == pytest.approx(4 / 3 * found.difference, rel=1e-14)
    assert found.difference == pytest.approx(small["step-2.5e-4"].position_error, rel=1e-12)
    assert 0 < found.relative < 1e-2


def test_motions_of_the_main_models_are_kept(small: Comparison) -> None:
    assert set(small.motions) == {*MAIN, "ffrf"}
    assert small.errors["component"].maximum == small["component"].max_error
    assert small.models["component"].system.size == small["component"].dofs


def test_failures_are_records_with_their_reason() -> None:
    """One mode cannot meet three constraints at B; a curved beam has no floating frame."""
    arch = [[np.sin(a), 0.0, np.cos(a) - 1.0] for a in np.linspace(0, 1, 9)]
    parts = [
        body.cable("I", models.polyline(np.array(arch)), models.SECTION, models.MATERIAL),
        body.cable(
            "II",
            models.segment(8, arch[-1], (arch[-1][0], 1.0, arch[-1][2])),
            models.SECTION,
            models.MATERIAL,
        ),
    ]
    pins = [joints.Pin("A", At("I", "left")), joints.Pin("B", At("I", "right"), At("II", "left"))]
    raw = assemble(parts, pins, [loads.Gravity((0, 0, -9.81))])
    task = task_for(
        raw, 0.05, Plan(COMPONENTS, 1e-8, modes={"I": 1, "II": 6}, hyper=Elements(1e-3))
    )
    found = comparison.run(task, ComparisonOptions(ffrf_modes=4, repeat=1, order=False))
    assert "more than 3 modes" in found["component"].status
    assert "straight" in found["ffrf"].status
    assert math.isnan(found["ffrf"].max_error)
    assert found["system"].status == "done"
    assert found.time_error.order is None
    assert "component" not in found.motions


def test_products_are_those_of_the_source() -> None:
    """Table 1 of doi 10.1016/j.cma.2019.112690."""
    both = {"I": 33, "II": 32}
    assert costs.multiplications({"system": 1212}, {"system": 59}, 18) == 5_506_116
    assert costs.multiplications({"system": 432}, {"system": 59}, 18) == 1_962_576
    assert costs.multiplications({"I": 606, "II": 606}, both, 18) == 1_019_898 + 969_600
    assert costs.multiplications({"I": 216, "II": 216}, both, 18) == 709_128


def test_row_widths_and_touched_coordinates() -> None:
    """C1 cubics: two functions a node, so six of them meet in a row, and a cell has four."""
    spatial, planar = (
        models.double_pendulum(6, all_multipliers=True),
        models.spin_up(6, all_multipliers=True),
    )
    assert costs.bandwidth(spatial) == 18
    assert costs.bandwidth(planar) == 12
    assert costs.touched(spatial, {"I": np.array([0]), "II": np.array([2, 3])}) == {
        "I": 12,
        "II": 18,
    }


def test_ratios_of_two_records() -> None:
    """Training of 0.5 s on a run of 2 s, 1 s saved a run: pays after 2.5 runs."""
    records = [
        ModelRecord("full", "full", cpu_s=1.5),
        ModelRecord("system", "system", multiplications=600, cpu_s=2.0, training_s=0.1),
        ModelRecord("component", "component", multiplications=200, cpu_s=0.5, training_s=0.5),
    ]
    full, system, component = comparison.add_ratios(records, 2.0)
    assert (system.speed_up, component.speed_up) == (1.0, 3.0)
    assert component.pays_after_runs == 2.5
    assert system.pays_after_runs is None
    assert full.pays_after_runs is None


@pytest.mark.parametrize(
    "duration,interval,expected",
    [(3.0, 5e-3, 2), (0.4, 5e-3, 1), (30.0, 5e-3, 10), (3.0, 3.5e-3, 1)],
)
def test_stride_divides_the_interval_and_leaves_samples(
    duration: float, interval: float, expected: int
) -> None:
    assert (
        runs.stride(Case(models.cantilever(1), GeneralizedAlpha(5e-4), duration), interval)
        == expected
    )


@pytest.mark.parametrize(
    "number,text", [(1.25e-4, "1.25e-4"), (1e-12, "1e-12"), (0.02, "2e-2"), (5.0, "5e0")]
)
def test_short_numbers(number: float, text: str) -> None:
    assert comparison.short(number) == text


def test_listed_snapshots_are_stored_with_the_start() -> None:
    case = Case(models.cantilever(1), GeneralizedAlpha(1e-5), 0.01)
    kept = runs.kept_steps(case, 1e-5 * np.array([0, 30, 60, 500])).tolist()
    assert kept == [0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 60, 500, 1000]
    assert runs.common_steps(2e-5, 1e-5, np.array([0, 3, 6, 30])).tolist() == [0, 3, 15]
    assert runs.common_steps(5e-6, 1e-5, np.array([0, 3])).tolist() == [0, 6]


def test_reduced_models_iterate_below_their_truncation() -> None:
    assert plan.newton_of_reduced(Newton(1e-10), 1e-14).tolerance == pytest.approx(2e-12, rel=1e-12)
    assert plan.newton_of_reduced(Newton(1e-10), 1e-12).tolerance == pytest.approx(2e-11, rel=1e-12)
    assert plan.newton_of_reduced(Newton(1e-10), 1e-24).tolerance == plan.FINEST


def test_snapshots_are_sharper_than_the_modes_kept() -> None:
    assert plan.newton_for(Newton(1e-9), 1e-10).tolerance == pytest.approx(
        1e-11, rel=1e-12, abs=0.0
    )
    assert plan.newton_for(Newton(1e-9), 1e-4).tolerance == 1e-9
    assert plan.newton_for(Newton(1e-9), 1e-18).tolerance == plan.FINEST


@pytest.mark.parametrize("hyper,kept", [(Elements(1e-3), (18, 18)), (Points(1e-3), (18, 19))])
def test_example_2_at_component_level(
    example_2: Full, hyper: HyperReduction, kept: tuple[int, int]
) -> None:
    """eps 1e-12, eta 1e-3: the sizes of the source (18 + 18 elements) within three, the error below
    1.2e-4.
    """
    model = trained(example_2, Plan(COMPONENTS, 1e-12, None, hyper))
    assert [basis.modes.shape[1] for basis in model.bases.values()] == pytest.approx(
        [23, 23], abs=2
    )
    assert [len(selection.sample.indices) for selection in model.selections] == pytest.approx(
        kept, abs=3
    )
    assert error(example_2, model.system) < 1.2e-4


def test_a_saved_model_runs_alone(small: Comparison, tmp_path: Path) -> None:
    model = small.models["component+ecsw-points"].system
    path = files.save(model, tmp_path / "model.h5")
    alone, here = integrate(files.load(path), SCHEME, 0.1), integrate(model, SCHEME, 0.1)
    np.testing.assert_array_equal(alone.x, here.x)
    with pytest.raises(InputError, match="at least one step"):
        integrate(files.load(path), GeneralizedAlpha(1e-3), 1e-4)


def test_system_level_counts_every_body(example_2: Full) -> None:
    whole = Plan(reduction.system_level(example_2.raw), 1e-12)
    model = trained(example_2, whole)
    assert model.system.size == pytest.approx(42, abs=2)
    assert not model.selections
    few = trained(example_2, replace(whole, modes=10))
    assert few.system.size == 10


def test_motions_that_do_not_differ_have_no_order() -> None:
    """A cantilever at rest: every step gives the same motion."""
    full = integrate(models.cantilever(4), GeneralizedAlpha(1e-3), 4e-3)
    found = runs.step_error(full, {5e-4: full, 2.5e-4: full}, 1e-3)
    assert found is not None
    assert (found.position, found.order) == (0.0, None)
