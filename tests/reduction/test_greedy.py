"""The greedy loop on indicators that are formulas: counts, stopping rules, failures, resumption,
one to six parameters.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from scipy.stats import qmc

from fmbs_skfem.core.errors import InputError, NoModel, Reason, SolverError
from fmbs_skfem.families import greedy
from fmbs_skfem.families.greedy import Enrichment, GreedyProblem, Iteration, Options, StopReason

LINE = np.linspace(0.0, 1.0, 101)[:, None]  #: 101 candidates, as published
FIVE = (0, 25, 50, 75, 100)  #: the published first samples
Formula = Callable[[np.ndarray, np.ndarray], float]


@dataclasses.dataclass
class Model:
    """A reduced model in the place of a mechanical one: its indicator is a formula of the
    parameters and of the full runs made.
    """

    candidates: np.ndarray
    formula: Formula
    full_fails: tuple[int, ...] = ()
    points: list[int] = dataclasses.field(default_factory=list)  #: full runs
    evaluated: list[int] = dataclasses.field(default_factory=list)
    tried: list[int] = dataclasses.field(default_factory=list)
    kept: list[Iteration] = dataclasses.field(default_factory=list)

    def evaluate(self, i: int) -> float:
        self.evaluated.append(i)
        return self.formula(self.candidates[i], self.candidates[self.points])

    def extend(self, i: int) -> None:
        self.tried.append(i)
        if i in self.full_fails:
            raise SolverError(f"full run {i} diverged", Reason.DIVERGED)
        self.points.append(i)

    def run(
        self, samples: Sequence[int], first: int, done: Sequence[Iteration] = (), **options: object
    ) -> Enrichment:
        chosen = Options(**options)  # type: ignore[arg-type]
        return greedy.run(
            GreedyProblem(
                self.evaluate,
                self.extend,
                self.candidates,
                tuple(samples),
                first,
                chosen,
                self.kept.append,
            ),
            done,
        )


def interpolation(floor: float) -> Formula:
    """The error of an interpolation between the full runs, |mu - mu_1| |mu - mu_2| ..., above a
    floor of truncation.
    """

    def formula(mu: np.ndarray, full: np.ndarray) -> float:
        return (
            1e-4 * float(np.prod(np.linalg.norm(full - mu, axis=1))) * (1.0 + 0.3 * float(mu[0]))
            + floor
        )

    return formula


def test_the_published_case_takes_two_full_and_at_most_twelve_reduced_runs() -> None:
    """Hou, Liu, Hu (2020), section 5.3.3 (a): 101 candidates, five first samples, first full run at
    the middle: 2 and 12.
    """
    model = Model(
        LINE, lambda mu, full: 1e-9 * float(np.min(np.abs(full - mu))) / len(full) ** 12 + 6e-13
    )
    outcome = model.run(FIVE, 50)
    assert (outcome.extensions, outcome.stop) == (2, StopReason.FLOOR)
    assert outcome.evaluations == len(model.evaluated) <= 12
    assert outcome.points == tuple(model.points) == (50, 0)
    assert outcome.iterations[0].samples[:5] == outcome.iterations[1].samples[:5] == FIVE


def test_every_full_run_is_at_the_largest_indicator_found() -> None:
    model = Model(LINE, interpolation(0.0))
    outcome = model.run(FIVE, 50, iterations=4)
    assert outcome.stop is StopReason.ITERATIONS
    assert outcome.extensions == len(model.tried) == 4
    for now, after in zip(outcome.iterations, outcome.iterations[1:], strict=False):
        assert now.next == after.point == now.samples[int(np.argmax(now.indicators))]
    assert outcome.iterations[-1].next is None
    largest = [iteration.largest for iteration in outcome.iterations]
    assert largest == sorted(largest, reverse=True)
    assert largest[-1] < 0.1 * largest[0]


def test_tolerance_ends_the_loop() -> None:
    model = Model(LINE, interpolation(1e-12))
    outcome = model.run(FIVE, 50, iterations=20, tolerance=1e-6)
    assert outcome.stop is StopReason.TOLERANCE
    exact = [model.formula(mu, LINE[list(outcome.points)]) for mu in LINE]
    assert outcome.iterations[-1].largest <= 1e-6 < outcome.iterations[-2].largest
    assert max(exact) <= 1.2e-6  # also where no reduced run was made


def test_a_basis_as_large_as_the_full_model_ends_the_loop() -> None:
    """After its second full run here, and before any other one."""
    model = Model(LINE, interpolation(1e-12))
    problem = GreedyProblem(
        model.evaluate,
        model.extend,
        LINE,
        FIVE,
        50,
        Options(iterations=20),
        pays=lambda: len(model.points) < 2,
    )
    outcome = greedy.run(problem)
    assert outcome.stop is StopReason.LARGE
    assert len(model.tried) == 2


def test_a_maximiser_that_has_its_full_run_ends_the_loop() -> None:
    """Steps 20 to 22 of Algorithm 1: the largest indicator stays where a full run was made."""
    model = Model(LINE, lambda mu, full: 10.0 ** (-6.0 - 2.0 * float(mu[0])))
    outcome = model.run(FIVE, 50)
    assert outcome.points == (50, 0)
    assert outcome.stop is StopReason.REPEATED


def test_truncation_is_recognised_as_the_floor() -> None:
    """The indicator falls to 1e-8 everywhere, rising slightly off the full runs: more of them would
    change nothing.
    """

    def formula(mu: np.ndarray, full: np.ndarray) -> float:
        return 1e-8 * (1.0 + 0.5 * float(np.min(np.abs(full - mu)))) + (
            1e-5 if len(full) == 1 else 0.0
        ) * abs(float(mu[0]) - 0.5)

    model = Model(LINE, formula)
    outcome = model.run(FIVE, 50, iterations=10)
    assert (outcome.extensions, outcome.stop) == (2, StopReason.FLOOR)
    assert "eps" in outcome.stop.value
    assert outcome.evaluations <= 12


def test_the_floor_is_found_where_no_sample_has_a_full_run() -> None:
    """When the largest indicator has not fallen, the reduced run at the last full run tells whether
    it can.
    """

    def formula(mu: np.ndarray, full: np.ndarray) -> float:
        bump = 10.0 ** (0.5 - 6.0 * (float(mu[0]) - 0.5) ** 2)
        return 1e-8 * (bump if len(full) == 1 else 2.0 + 0.2 * float(np.min(np.abs(full - mu))))

    outcome = Model(LINE, formula).run((10, 30, 90), 0, iterations=10)
    first, second = outcome.iterations
    assert second.point in first.samples[3:]  # found by Kriging
    assert second.samples[-1] == second.point  # evaluated as the loop has stalled
    assert outcome.stop is StopReason.FLOOR


def test_the_floor_is_that_of_all_full_runs() -> None:
    """Example 3 (b): truncation grows with the torque, and of two full runs only the smaller torque
    is a sample.
    """

    def formula(mu: np.ndarray, full: np.ndarray) -> float:
        torque = 5.0 + 10.0 * float(mu[0])
        return 8e-13 * torque + (2e-10 if len(full) == 1 else 0.0) * abs(torque - 10.5) / 5.5

    model = Model(LINE, formula)
    outcome = model.run(FIVE, 55, iterations=10)
    assert (outcome.points, outcome.stop) == ((55, 0), StopReason.FLOOR)
    assert outcome.iterations[1].samples[-1] == 55  # no given sample
    assert outcome.evaluations <= 21  # as published


def test_bases_that_leave_nothing_out_have_no_floor() -> None:
    """One full run whose few snapshots are all kept: the indicator is as large there as elsewhere,
    and another run helps.
    """
    model = Model(LINE, lambda mu, full: 1e-7 if len(full) == 1 else 1e-9)
    leaves_out = lambda: len(model.points) > 1  # noqa: E731
    outcome = greedy.run(
        GreedyProblem(
            model.evaluate,
            model.extend,
            LINE,
            FIVE,
            50,
            Options(iterations=5),
            truncates=leaves_out,
        )
    )
    assert (outcome.extensions, outcome.stop) == (2, StopReason.FLOOR)
    assert outcome.iterations[-1].largest == 1e-9


def test_equal_corners_are_no_floor() -> None:
    """Four corners of a square are equally bad; a full run in one leaves the largest indicator as
    it was, and the loop goes on.
    """
    x = np.array([[a, b] for a in np.linspace(0, 1, 11) for b in np.linspace(0, 1, 11)])
    model = Model(
        x, lambda mu, full: 1e-10 + 1e-4 * float(np.min(np.linalg.norm(full - mu, axis=1))) ** 2
    )
    outcome = model.run((0, 10, 60, 110, 120), 60, iterations=5)
    assert set(outcome.points) == {60, 0, 10, 110, 120}
    assert outcome.stop is StopReason.ITERATIONS
    # all given samples have full runs now, the largest indicator is between them
    assert outcome.iterations[-1].largest == pytest.approx(1e-4 * 0.5**2, rel=0.1)


def test_a_constant_indicator_needs_no_second_full_run() -> None:
    model = Model(LINE, lambda mu, full: 1e-7)
    outcome = model.run(FIVE, 50)
    assert (outcome.extensions, outcome.evaluations, outcome.stop) == (1, 5, StopReason.FLOOR)


def test_zero_everywhere_ends_as_well() -> None:
    outcome = Model(LINE, lambda mu, full: 0.0).run(FIVE, 50)
    assert (outcome.extensions, outcome.evaluations, outcome.stop) == (1, 5, StopReason.FLOOR)


def test_one_candidate() -> None:
    outcome = Model(np.array([[0.3]]), lambda mu, full: 1e-5).run((0,), 0)
    assert (outcome.extensions, outcome.evaluations, outcome.stop) == (1, 1, StopReason.REPEATED)


def test_equal_samples_and_equal_candidates_are_run_once() -> None:
    x = np.vstack([LINE, LINE])
    model = Model(x, interpolation(1e-9))
    outcome = model.run((0, 0, 101, 50, 151, 100), 151, iterations=3)
    assert outcome.iterations[0].samples[:3] == (0, 50, 100)
    assert outcome.points[0] == 50
    assert max(model.evaluated + model.points) <= 100
    assert all(len(set(i.samples)) == len(i.samples) for i in outcome.iterations)


def test_a_parameter_without_influence() -> None:
    """An indicator of the first of two parameters, largest inside at 0.62 before the second full
    run.
    """
    x = qmc.Sobol(2, rng=1).random(256)
    model = Model(
        x, lambda mu, full: 10.0 ** (-4.0 - 30.0 * float(mu[0] - 0.62) ** 2) / len(full) ** 20
    )
    outcome = model.run(tuple(range(8)), 0, iterations=2, max_samples=25)
    assert abs(x[outcome.points[1], 0] - 0.62) < 0.03
    assert len(outcome.iterations[0].samples) <= 20


def test_an_indicator_over_ten_decades() -> None:
    model = Model(
        LINE,
        lambda mu, full: (
            10.0 ** (-12.0 + 10.0 * math.exp(-(((float(mu[0]) - 0.33) / 0.15) ** 2)))
            / len(full) ** 30
        ),
    )
    outcome = model.run(FIVE, 50, iterations=2)
    assert abs(LINE[outcome.points[1], 0] - 0.33) <= 0.01
    assert len(outcome.iterations[0].samples) <= 15


@pytest.mark.parametrize("dimension", [1, 2, 3, 6])
def test_an_interior_maximum_is_found_with_few_reduced_runs(dimension: int) -> None:
    """log10 I is -4 at a peak inside and falls to the sides; 512 candidates, at most 40 runs,
    within 0.15 decades of the best.
    """
    x = qmc.Sobol(dimension, rng=dimension).random(512)
    peak, width = np.linspace(0.35, 0.7, dimension), np.linspace(1.0, 0.4, dimension)

    def formula(mu: np.ndarray, full: np.ndarray) -> float:
        return 10.0 ** (-4.0 - 4.0 * float(width @ (mu - peak) ** 2)) / len(full) ** 20

    outcome = Model(x, formula).run(
        tuple(range(2 * dimension + 1)), 0, iterations=2, max_samples=40
    )
    largest = max(formula(mu, x[:1]) for mu in x)
    assert outcome.iterations[0].largest > 10**-0.15 * largest
    assert len(outcome.iterations[0].samples) <= 40


def test_a_reduced_run_that_fails_is_taken_next() -> None:
    model = Model(
        LINE,
        lambda mu, full: (
            math.inf if len(full) == 1 and mu[0] > 0.9 else interpolation(1e-9)(mu, full)
        ),
    )
    outcome = model.run(FIVE, 50, iterations=2)
    assert outcome.points == (50, 100)
    assert outcome.iterations[0].samples == FIVE  # the maximum is found, Kriging is not asked
    assert outcome.iterations[0].indicators[4] == math.inf
    assert np.all(np.isfinite(outcome.iterations[0].mean))


def test_exceptions_and_nan_of_a_reduced_run_are_failures() -> None:
    def formula(mu: np.ndarray, full: np.ndarray) -> float:
        if len(full) == 1 and mu[0] < 0.1:
            raise SolverError("the reduced run diverged", Reason.DIVERGED)
        return math.nan if len(full) == 1 and mu[0] > 0.9 else interpolation(1e-9)(mu, full)

    outcome = Model(LINE, formula).run(FIVE, 25, iterations=2)
    assert outcome.iterations[0].indicators[0] == outcome.iterations[0].indicators[4] == math.inf
    assert outcome.points == (25, 100)  # of two failed runs the one farther from the full run


def test_a_mistake_in_the_program_is_no_failure() -> None:
    def formula(mu: np.ndarray, full: np.ndarray) -> float:
        raise KeyError("E")

    with pytest.raises(KeyError):
        Model(LINE, formula).run(FIVE, 50)


def test_a_full_run_that_fails_in_the_corner_is_excluded() -> None:
    model = Model(LINE, interpolation(1e-9), full_fails=(100,))
    outcome = model.run(FIVE, 50, iterations=3)
    assert 100 in model.tried
    assert 100 not in outcome.points
    assert model.tried.count(100) == 1
    assert outcome.failed == ((100, "full run 100 diverged"),)
    assert outcome.extensions == 3


def test_a_first_full_run_that_fails_is_replaced_by_the_sample_next_to_it() -> None:
    model = Model(LINE, interpolation(1e-9), full_fails=(55,))
    assert model.run(FIVE, 55, iterations=1).points == (50,)


def test_too_many_failures_end_the_loop() -> None:
    model = Model(LINE, interpolation(1e-9), full_fails=tuple(k for k in range(101) if k != 50))
    outcome = model.run(FIVE, 50, iterations=2)
    assert outcome.stop is StopReason.FAILED
    assert (outcome.points, len(outcome.failed)) == ((50,), 3)
    assert model.kept[-1].failed == outcome.failed


def test_no_full_run_at_all_is_an_error_with_its_reasons() -> None:
    model = Model(LINE, interpolation(1e-9), full_fails=tuple(range(101)))
    with pytest.raises(NoModel, match="candidate 50: full run 50 diverged; candidate 25: "):
        model.run(FIVE, 50)
    assert model.evaluated == []


@pytest.mark.parametrize("complete", [0, 1, 2, 3])
def test_stored_iterations_are_not_run_again(complete: int) -> None:
    straight = Model(LINE, interpolation(1e-12))
    expected = straight.run(FIVE, 50, iterations=3)
    assert [i.number for i in straight.kept] == [1, 2, 3]
    later = Model(LINE, interpolation(1e-12), points=[i.point for i in straight.kept[:complete]])
    outcome = later.run(FIVE, 50, straight.kept[:complete], iterations=3)
    assert later.tried == list(expected.points[complete:])
    assert later.evaluated == [k for i in expected.iterations[complete:] for k in i.samples]
    assert (outcome.points, outcome.stop, outcome.evaluations) == (
        expected.points,
        expected.stop,
        expected.evaluations,
    )
    for one, two in zip(outcome.iterations, expected.iterations, strict=True):
        assert (one.samples, one.indicators, one.next) == (two.samples, two.indicators, two.next)
        assert np.array_equal(one.mean, two.mean)


def test_a_finished_loop_is_only_read_and_more_runs_continue_it() -> None:
    model = Model(LINE, interpolation(1e-12), full_fails=(100,))
    outcome = model.run(FIVE, 50, iterations=2)
    calls = len(model.tried), len(model.evaluated)
    again = model.run(FIVE, 50, outcome.iterations, iterations=2)
    assert (again.points, again.stop, again.failed) == (
        outcome.points,
        outcome.stop,
        outcome.failed,
    )
    assert (len(model.tried), len(model.evaluated)) == calls
    more = model.run(FIVE, 50, outcome.iterations, iterations=3)
    assert more.points[:2] == outcome.points
    assert len(model.tried) == calls[0] + 1


def test_iterations_of_other_candidates_are_refused() -> None:
    outcome = Model(LINE, interpolation(1e-12)).run(FIVE, 50, iterations=1)
    other = Model(LINE[:60], interpolation(1e-12))
    with pytest.raises(InputError, match="iteration 1"):
        other.run((0, 30, 59), 30, outcome.iterations)


@pytest.mark.parametrize(
    "samples,first,candidates",
    [
        ((), 0, LINE),
        ((0, 101), 0, LINE),
        ((0,), -1, LINE),
        ((0,), 0, 2.0 * LINE),
        ((0,), 0, LINE[:0]),
        ((0,), 0, LINE * np.nan),
    ],
)
def test_bad_problems_are_refused(
    samples: tuple[int, ...], first: int, candidates: np.ndarray
) -> None:
    with pytest.raises(InputError, match=r"greedy\.GreedyProblem"):
        Model(candidates, interpolation(0.0)).run(samples, first)


def test_bad_options_and_indicators_are_refused() -> None:
    for bad in ({"iterations": 0}, {"max_samples": 0}, {"tolerance": 0.0}):
        with pytest.raises(InputError, match=next(iter(bad))):
            Options(**bad)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="not negative"):
        Model(LINE, lambda mu, full: -1.0).run(FIVE, 50)
