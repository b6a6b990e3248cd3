"""Steps in parts: of second order, with what was known before them, and at the cost of some steps."""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, dividing, energies, integrate, outputs
from fmbs_skfem.dynamics.compiled_step import packing, parts, stepping
from fmbs_skfem.dynamics.integration import begun, kept_steps
from fmbs_skfem.dynamics.observers import Observer, PauseCall, RunSetting
from fmbs_skfem.dynamics.run import OpenRun
from fmbs_skfem.dynamics.scheme import Newton
from fmbs_skfem.systems import System

from .. import models


class Divide(Observer):
    """Every so many steps the next one is taken in 2^k parts; `known` has the accelerations known
    behind each step.
    """

    looks = "step"
    reads_states = False

    def __init__(self, every: int, halvings: int) -> None:
        self.every, self.halvings, self.known = every, halvings, list[int]()

    def after(self, run: OpenRun) -> None:
        self.known.append(int(run.step.state.known[0]))
        if run.done % self.every == 0:
            run.shorten(self.halvings)


def motion(system: System, steps: int, duration: float, *observers: Observer) -> Trajectory:
    """The motion of a run, at ten instants."""
    return integrate(
        system, GeneralizedAlpha(duration / steps), duration, every=steps // 10, observers=observers
    )


@pytest.mark.parametrize("every,halvings", [(10, 1), (2, 1), (10, 4)])
def test_divided_steps_are_of_second_order(every: int, halvings: int) -> None:
    """A pendulum of one mass: errors are below those of whole steps, positions and velocities of
    second order.

    Without the shift of the algorithmic acceleration the orders are 1.97, 1.41 and 1.71 of
    positions, 2.05, 1.28 and 1.61 of velocities.
    """
    system, counts = models.mass_pendulum((0.6, -0.8)), (500, 1000, 2000)
    exact = motion(system, 16_000, 2.0)
    errors, whole = [], motion(system, counts[-1], 2.0)
    for steps in counts:
        found = motion(system, steps, 2.0, Divide(every, halvings))
        errors.append([np.abs(found.x - exact.x).max(), np.abs(found.v - exact.v).max()])
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates.min() > 1.98
    assert errors[-1][0] < np.abs(whole.x - exact.x).max()
    assert errors[-1][1] < np.abs(whole.v - exact.v).max()


def test_what_is_known_goes_on_behind_a_divided_step() -> None:
    """The three latest accelerations of whole steps, as without parts."""
    observer = Divide(4, 2)
    motion(models.mass_pendulum((0.6, -0.8)), 40, 0.4, observer)
    assert observer.known == [2, *[3] * 39]


@pytest.mark.parametrize("ratio", [1.0, 0.5, 0.3, 1 / 64])
def test_known_values_at_another_distance(ratio: float) -> None:
    """A parabola is met, with two values the line through them, and one stays alone."""
    times = -np.arange(3.0)[:, None]
    values = 1.0 + times * np.array([2.0, -3.0]) + times**2 * np.array([0.5, 4.0])
    wanted = (
        1.0 + ratio * times * np.array([2.0, -3.0]) + (ratio * times) ** 2 * np.array([0.5, 4.0])
    )
    rows = values.copy()
    parts.resample(rows, 3, ratio)
    np.testing.assert_allclose(rows, wanted, rtol=1e-14, atol=1e-14)
    rows = values.copy()
    parts.resample(rows, 2, ratio)
    np.testing.assert_allclose(rows[1], values[0] + ratio * (values[1] - values[0]), rtol=1e-14)
    rows = values.copy()
    parts.resample(rows, 1, ratio)
    np.testing.assert_array_equal(rows, values)


def test_a_step_that_fails_in_all_lengths_leaves_the_state_before_it() -> None:
    """Every array of it, bit for bit, and the next run of the same step fails alike."""
    system = models.double_pendulum(4)
    run = begun(
        RunSetting(system, GeneralizedAlpha(0.4), Newton(iterations=1), 10, system),
        kept_steps(1, 10),
    )
    random = np.random.default_rng(5)
    for array in (run.step.state.work, run.step.state.signals, run.step.state.memory):
        array[:] = random.normal(size=array.shape)
    before = [array.copy() for array in run.step.state]
    statuses = {run.take(np.zeros((1, 0)), run.rows_from(1))[0] for _ in range(2)}
    assert len(statuses) == 1
    assert statuses != {0}
    for name, array, old in zip(run.step.state._fields, run.step.state, before, strict=True):
        if name != "speed":  # the largest so far
            np.testing.assert_array_equal(array, old, err_msg=name)


@pytest.mark.parametrize(
    ("begin", "status", "held", "again"),
    [
        (0.0, stepping.DIVERGED, True, True),
        (-0.0, stepping.DIVERGED, True, True),
        (1e-9, stepping.DIVERGED, True, False),
        (-1e-9, stepping.DIVERGED, True, False),
        (0.0, stepping.DIVERGED, False, False),
        (0.5, stepping.DIVERGED, False, False),
        *[(0.0, status, True, False) for status in range(-1, 7) if status != stepping.DIVERGED],
    ],
)
def test_only_a_start_that_diverged_is_tried_again(
    begin: float, status: int, held: bool, again: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From filtered accelerations, where something holds what begins to move: in all other cases
    the status stays, and nothing is taken.
    """
    taken = list[int]()
    run = begun(
        RunSetting(
            models.mass_pendulum((0.6, -0.8)),
            GeneralizedAlpha(0.01),
            Newton(),
            10,
            models.mass_pendulum((0.6, -0.8)),
        ),
        kept_steps(1, 10),
    )
    state, shown = run.step.state, run.step.state.acceleration.copy()

    def divide(status: int) -> int:
        taken.append(status)
        return 99

    def start(packed: object, scheme: object, at: object, *, filtered: bool) -> None:
        assert filtered
        state.history[0] = shown + held
        state.acceleration[:] = shown

    monkeypatch.setattr(dividing, "start_step", start)
    run.packed.divide = divide  # type: ignore[method-assign]
    assert dividing.retry_filtered(run, status, begin) == (99 if again else status)
    assert taken == ([status] if again else [])
    np.testing.assert_array_equal(state.acceleration, shown + again)


def test_a_run_is_packed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever number of its steps is divided; of whole steps alone once as well, and no parts."""
    counts, original = [], packing.packed

    def packed(struct: object) -> np.ndarray:
        counts[-1] += 1
        return original(struct)

    monkeypatch.setattr(packing, "packed", packed)
    for every in (10, 2, 1000):
        counts.append(0)
        observer = Divide(every, 2)
        motion(models.spin_up(4), 100, 1.0, observer)
    assert counts[0] == counts[1] > counts[2]
    # the step, the signals of its start, and those of its steps
    assert counts[2] <= 3


def test_a_divided_step_ends_no_chunk() -> None:
    """A hundred times the step of example 2: some failures in every chunk."""
    looks = list[int]()
    run = integrate(
        models.double_pendulum(4),
        GeneralizedAlpha(0.05),
        2.0,
        observers=[PauseCall(lambda run: looks.append(run.done))],
    )
    assert run.statistics.halved > 20
    assert len(looks) <= 1 + 40 // 8


def test_large_steps_are_taken_whole() -> None:
    """A beam that turns by 0.16 rad a step, 40 steps a turn: none of 800 is divided, where half of
    them were.

    Errors then fall with the square of the step, 4.0 and 3.9 a halving; in 300 to 500 steps nothing
    comes to another solution.
    """
    system = models.spin_up(8, continuity=2)
    runs = [
        integrate(system, GeneralizedAlpha(20.0 / steps), 20.0, every=steps // 50)
        for steps in (800, 1600, 3200, 25_600)
    ]
    columns = [np.stack([outputs(run)["tip_x"], outputs(run)["tip_y"]]) for run in runs]
    errors = [np.abs(one - columns[-1]).max() for one in columns[:-1]]
    assert [run.statistics.halved for run in runs[:3]] == [0, 0, 0]
    assert 3.6 < errors[0] / errors[1] < 4.4
    assert 3.6 < errors[1] / errors[2] < 4.4


@pytest.mark.parametrize("steps", [360, 400, 439, 540])
def test_no_large_step_comes_to_another_solution(steps: int) -> None:
    """A cell that turns over costs 274 J, or 822 J; the strains of the motion have 0.09 J at most.
    Each of these ended so once.
    """
    motion = integrate(models.spin_up(8, continuity=2), GeneralizedAlpha(20.0 / steps), 20.0)
    assert energies(motion)[:, 1].max() < 0.1


@pytest.mark.parametrize(
    "system,settles",
    [(models.double_pendulum(4), False), (models.mass_pendulum((0.6, -0.8)), True)],
)
def test_a_run_compiles_what_it_needs(system: System, settles: bool) -> None:
    """What divides steps with the first one that is divided, what puts velocities onto joints where
    these are not steady.
    """
    divides = list[bool]()
    for every in (100, 2):
        seen = list[OpenRun]()
        motion(system, 20, 0.2, Divide(every, 1), PauseCall(seen.append))
        divides.append(bool(seen[-1].packed.table[packing.DIVIDE]))
        assert bool(seen[-1].step.doors.settle) == settles
    assert divides == [False, True]
