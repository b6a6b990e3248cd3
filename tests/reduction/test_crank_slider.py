"""Example 3 on coarse meshes over its first 4 ms: all reduced models of its Table 4, the exact
polynomial, files, tolerances.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import reduction, scenes
from fmbs_skfem.core.errors import CorruptFile
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.reduction import Elements, Plan, TrainingTask, files, task_of
from fmbs_skfem.reduction.accuracy import comparison, costs
from fmbs_skfem.reduction.accuracy.comparison import Comparison, ComparisonOptions
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.full_runs import run_of_motion
from fmbs_skfem.reduction.hyper import polynomial
from fmbs_skfem.reduction.reduced_models import ReducedModel, make_model
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import System, compile_system, compiled
from fmbs_skfem.systems.terms.quartic import Quartic
from tests.clocks import PRICES, set_prices

SCENE = scenes.read(Path(__file__).resolve().parents[2] / "examples" / "crank_slider_coarse.yaml")
SCHEME, DURATION = GeneralizedAlpha(1e-5), 0.004
TIMES = 1e-5 * np.arange(0, 401, 10)
COMPONENTS = {"crank": ("crank",), "linkage": ("linkage", "slider")}
LEVELS = ("system", "component")
KINDS = ("", "+ecsw", "+ecsw-points", "+exact")
MODELS = tuple(f"{level}{kind}" for kind in KINDS for level in LEVELS)


@pytest.fixture(scope="module")
def raw() -> System:
    return build.system(SCENE)


@pytest.fixture(scope="module")
def found(raw: System) -> Iterator[Comparison]:
    task = task_for(raw, Plan(COMPONENTS, 1e-16, hyper=Elements(1e-5)))
    with pytest.MonkeyPatch.context() as patch:
        set_prices(patch)
        yield comparison.run(task, ComparisonOptions(steps=(2e-5,), repeat=1, expensive=True))


@pytest.fixture(scope="module")
def sharp(raw: System) -> Trajectory:
    return integrate(raw, SCHEME, DURATION, Newton(1e-13), np.arange(0, 401, 5))


def task_for(raw: System, plan: Plan) -> TrainingTask:
    return task_of(
        Case(raw, SCHEME, DURATION, Newton(1e-12)), plan, TIMES, partial(build.chosen_form, SCENE)
    )


def component(raw: System, run: Trajectory, eps: float) -> ReducedModel:
    task = task_for(raw, Plan(COMPONENTS, eps))
    return make_model(task, [run_of_motion(task, run)])


def test_all_models_are_run(found: Comparison) -> None:
    assert {record.name for record in found.records} == {"full", *MODELS, "step-2e-5"}
    assert {record.status for record in found.records} == {"done"}
    assert set(found.motions) == set(MODELS)


def test_dependent_rows_are_dropped(found: Comparison) -> None:
    """12 rows of orthonormal axes and 7 of joints; 6 are independent by component and 4 for the
    system (paper: 550 in full).
    """
    assert found["full"].constraints == 19
    assert [found[level].constraints for level in LEVELS] == [4, 6]


@pytest.mark.parametrize("level", LEVELS)
def test_the_exact_polynomial_is_the_reduced_model(found: Comparison, level: str) -> None:
    plain, exact = found.motions[level], found.motions[f"{level}+exact"]
    assert reduction.compare(plain, exact).summary["coordinates_error"] < 1e-9
    assert found[f"{level}+exact"].max_error == pytest.approx(found[level].max_error, rel=1e-3)
    assert found[f"{level}+exact"].points == dict.fromkeys(found[level].points, 0)


@pytest.mark.parametrize("name", MODELS)
def test_errors_are_those_of_truncation(found: Comparison, name: str) -> None:
    """37 modes for all and 30 + 31 by component at eps = 1e-16, errors (53) 1.3e-5 and 8.1e-7 (our
    own figures).
    """
    record = found[name]
    modes, bound = (
        ({"system": 37}, 1.5e-5)
        if name.startswith("system")
        else ({"crank": 30, "linkage": 31}, 9e-7)
    )
    assert record.modes == pytest.approx(modes, abs=1)
    assert record.coordinates_error < bound
    assert record.median_error < record.max_error
    assert record.position_error < 0.15 * bound


def test_newton_below_truncation_changes_nothing(raw: System, sharp: Trajectory) -> None:
    """The error falls with eps; at one eps it is the same for every tolerance below it."""
    last = np.inf
    for eps in (1e-12, 1e-14, 1e-16):
        model = component(raw, sharp, eps).system
        runs = [
            integrate(model, SCHEME, DURATION, Newton(tolerance), np.arange(0, 401, 5))
            for tolerance in (1e-12, 1e-13)
        ]
        rough, fine = (reduction.compare(sharp, run).maximum for run in runs)
        assert rough == pytest.approx(fine, rel=0.01)
        assert fine < 0.5 * last
        last = fine


@pytest.mark.parametrize("level", LEVELS)
def test_sampling_keeps_the_error(found: Comparison, level: str) -> None:
    plain, cells, points = (
        found[name] for name in (level, f"{level}+ecsw", f"{level}+ecsw-points")
    )
    assert sum(plain.elements.values()) == 192 + 288
    assert sum(plain.points.values()) == 9 * (192 + 288)
    assert sum(cells.elements.values()) < 192 + 288
    assert sum(points.points.values()) < 0.25 * sum(plain.points.values())
    assert [cells.max_error, points.max_error] == pytest.approx([plain.max_error] * 2, rel=0.05)


def test_parts_of_the_time_are_calls_times_the_time_of_one(found: Comparison) -> None:
    """Tangents are turned at no cost, but that of one polynomial for two bodies, which turn by
    different angles.
    """
    for record in found.records:
        calls, factored = record.iterations, record.factorisations
        tangents = factored if record.name == "system+exact" else 0
        assert (
            record.force_s + record.product_s
            == calls * PRICES["force"] + tangents * PRICES["tangent"]
        )
        assert (
            record.solve_s
            == calls * PRICES["solution"]
            + factored * PRICES["factor"]
            - tangents * PRICES["tangent"]
        )
        products, rest = divmod(record.product_s, calls * PRICES["product"])
        assert rest == 0.0
        assert (products % 2, products > 0) == (
            0,
            record.family in found.models and record.hyper != "exact",
        )  # gather and scatter


def test_the_step_has_an_error_of_its_own(found: Comparison) -> None:
    """Second order: e_h = |q_h - q_2h| / 3."""
    own = found.time_error
    assert own is not None
    assert own.position == pytest.approx(found["step-2e-5"].position_error / 3, rel=1e-12)
    assert own.relative == pytest.approx(found["step-2e-5"].max_error / 3, rel=1e-12)
    assert own.position > 10 * found["component"].position_error


def test_coordinates_behind_rims_are_those_of_their_frames(raw: System) -> None:
    """All cells touch all coordinates of the plates: 3134 less the 2 of the slider, which has no
    cells.
    """
    everything = {
        e.name: np.arange(count) for e, count in zip(raw.elastic, (192, 288), strict=True)
    }
    assert sum(costs.touched(raw, everything).values()) == raw.size - 2


def test_bodies_with_one_basis_share_a_polynomial(found: Comparison) -> None:
    plain, exact = found.models["system"].system, found.models["system+exact"].system
    assert [e.name for e in exact.elastic] == ["crank+linkage"]
    x = found.motions["system"].x[-1]
    one, two = (compiled.strain_energy(compile_system(system), x) for system in (plain, exact))
    assert two == pytest.approx(one, rel=1e-8)


@pytest.mark.parametrize(
    "name", ["component+exact", "system+exact", "component+ecsw", "component+ecsw-points"]
)
def test_saved_models_run_without_meshes(found: Comparison, name: str, tmp_path: Path) -> None:
    path = files.save(found.models[name].system, tmp_path / "model.h5")
    alone = integrate(files.load(path), SCHEME, 0.001, Newton(1e-12))
    here = integrate(found.models[name].system, SCHEME, 0.001, Newton(1e-12))
    np.testing.assert_array_equal(alone.x, here.x)
    assert [skin.name for skin in alone.system.skins] == ["crank", "linkage"]
    for elastic in alone.system.elastic:
        if isinstance(elastic.gather, Quartic):
            assert elastic.gather.coefficients.ctypes.data % 64 == 0


def test_a_polynomial_of_another_length_is_damage(found: Comparison, tmp_path: Path) -> None:
    system = found.models["component+exact"].system
    first, *others = system.elastic
    assert isinstance(first.gather, Quartic)
    short = dataclasses.replace(
        first,
        gather=dataclasses.replace(
            first.gather, coefficients=first.gather.coefficients[:-8].copy()
        ),
    )
    path = files.save(dataclasses.replace(system, elastic=(short, *others)), tmp_path / "model.h5")
    with pytest.raises(CorruptFile, match=r"coefficients: expected an array"):
        files.load(path)


def test_exact_polynomials_are_for_planar_plates(raw: System) -> None:
    assert polynomial.possible(raw)
    damped = tuple(dataclasses.replace(e, beta=1e-6) for e in raw.elastic)
    assert not polynomial.possible(dataclasses.replace(raw, elastic=damped))
