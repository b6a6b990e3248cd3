"""Plans for runs whose errors are known: a / n^4 of the mesh and b / m^2 of the step, beside a
truth that nobody sees.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from fmbs_skfem.studies.planning.planner import (
    ROACHE,
    SAFETY,
    SHARE,
    Limits,
    Unresolved,
    plan,
    size,
)

SHAPE = np.sin(np.linspace(0.0, 3.0, 50))


class Known:
    """Runs of two columns: a shape in which both errors add, and one with a tenth of them of which
    nothing is wanted.
    """

    order = 4

    def __init__(
        self,
        mesh: float,
        step: float,
        rough: bool = False,
        least: int = 0,
        noise: float = 0.0,
        power: float = 2.0,
    ) -> None:
        self.mesh, self.step, self.rough, self.least, self.noise, self.power = (
            mesh,
            step,
            rough,
            least,
            noise,
            power,
        )
        self.runs: list[tuple[int, int]] = []

    def error(self, cells: int, steps: int) -> float:
        return (self.mesh / cells**4 if cells else 0.0) + self.step / steps**self.power

    def run(self, cells: int, steps: int) -> np.ndarray | None:
        self.runs.append((cells, steps))
        if steps < self.least:
            return None
        wild = self.noise * np.random.default_rng([cells, steps]).uniform(-1.0, 1.0, len(SHAPE))
        return self.error(cells, steps) * SHAPE + wild

    def differ(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        found = float(np.abs(one - other).max())
        return np.array([[found, 0.0], [found, 0.1 * found]])


@pytest.mark.parametrize("mesh", [1.0, 1e3, 1e6])
@pytest.mark.parametrize("step", [1e3, 1e6, 1e9])
def test_known_errors_are_met_and_not_overdone(mesh: float, step: float) -> None:
    runs = Known(mesh, step)
    found = plan(runs, 4, 200)
    assert found.met
    true = runs.error(found.cells, found.steps)
    assert true <= 1.0
    assert float(found.errors[0].max()) >= true * 0.99  # what it foretells is never less
    cheaper = [(found.cells - 1, found.steps // 2), (found.cells // 2, found.steps // 2)]
    if found.cells > 2 and found.steps > 200:
        assert min(runs.error(*one) for one in cheaper) > 0.5 * SAFETY
    assert found.errors[1, 1] == pytest.approx(0.1 * found.errors[1, 0])


def test_every_run_is_made_once_and_the_last_one_is_chosen() -> None:
    runs = Known(1e3, 1e6)
    found = plan(runs, 4, 200)
    assert len(runs.runs) == len(set(runs.runs)) == len(found.pilots) <= 8
    assert runs.runs[-2:] == [
        (found.cells, found.steps),
        (found.cells, (found.steps + 1) // 2),
    ]  # what is chosen, and its proof
    again = plan(Known(1e3, 1e6), 4, 200)
    assert again.pilots == found.pilots


def test_steps_that_resolve_nothing_are_doubled() -> None:
    found = plan(Known(1.0, 1e4, least=1500), 4, 200)
    assert [one.resolved for one in found.pilots[:4]] == [False, False, False, True]
    assert found.met
    assert found.steps >= 1600
    with pytest.raises(Unresolved):
        plan(Known(1.0, 1e4, least=10**9), 4, 200, limits=Limits(steps=10_000))


@pytest.mark.parametrize("step", [1e6, 2e6, 4e6])
def test_differences_that_fall_late_foretell_no_steps(step: float) -> None:
    """Errors b / (m^2 + 600^2): the first ratios are 0.6 and 1.4, and foretold five times the
    steps that are enough.
    """

    class Late(Known):
        def error(self, cells: int, steps: int) -> float:
            return self.mesh / cells**4 + self.step / (steps**2 + 600.0**2)

    runs = Late(1.0, step)
    found = plan(runs, 4, 200)
    enough = math.sqrt(step / (SAFETY * SHARE) - 600.0**2)
    assert found.met
    assert runs.error(found.cells, found.steps) <= 1.0
    assert enough / 2 <= found.steps <= 1.5 * enough


def test_a_cheaper_run_is_chosen_where_the_one_that_is_proved_shows_its_error() -> None:
    """Two cells err by 0.1 with all steps, and by another kind of error with few of them: the chain
    asks for more cells, and a run of the plan has shown that these are not needed.
    """

    class Unlike(Known):
        def error(self, cells: int, steps: int) -> float:
            return (20.0 if steps < 300 and cells < 4 else 0.1) / cells + self.step / steps**2

    runs = Unlike(0.0, 1e5)
    found = plan(runs, 4, 200)
    assert found.met
    others = [(one.cells, one.steps) for one in found.pilots]
    dearest = max(others, key=lambda one: one[0] * one[1])
    assert (found.cells, found.steps) in others
    assert found.cells * found.steps < dearest[0] * dearest[1]
    assert found.steps >= 200
    true = runs.error(found.cells, found.steps)
    assert true <= float(found.errors[0].max()) <= SAFETY


def test_what_is_given_stays() -> None:
    runs = Known(1e3, 1e6)
    fixed = plan(runs, 4, 500, free_steps=False)
    assert fixed.steps == 500
    assert not fixed.met
    assert float(fixed.time[0, 0]) == pytest.approx(ROACHE * 1e6 / 500**2, rel=0.05)
    runs = Known(1e3, 1e6)
    fixed = plan(runs, 1, 200, free_cells=False)
    assert fixed.cells == 1
    assert not fixed.met
    assert float(fixed.mesh[0, 0]) >= 1e3
    assert (
        SAFETY * 1e6 / fixed.steps**2 > 0.5
    )  # steps that bring more are not taken for the sake of the mesh
    assert plan(Known(0.0, 1e6), 0, 200).met


def test_meshes_are_compared_with_few_steps_however_many_are_given() -> None:
    """A run of a mesh once finer costs four of one, and its difference hardly depends on the step."""
    found = plan(
        Known(0.1, 1e6), 1, 20_000, free_cells=False, free_steps=False, limits=Limits(usual=200)
    )
    assert {(one.cells, one.steps) for one in found.pilots} == {
        (1, 10_000),
        (1, 20_000),
        (1, 40_000),
        (1, 200),
        (2, 200),
    }
    assert float(found.mesh[0, 0]) >= 0.1


@pytest.mark.parametrize("noise", [30.0, 100.0, 1000.0])
def test_a_motion_that_more_steps_do_not_settle_is_named(noise: float) -> None:
    found = plan(Known(1.0, 1e6, noise=noise), 4, 200, limits=Limits(steps=10**6))
    assert found.why == "sensitive"
    assert not found.met
    assert len(found.pairs) == 2  # of steps, and of meshes
    assert found.cells == 32
    assert len(found.pilots) <= 4 * 8  # chains of four meshes


def test_rough_forces_are_met_by_the_larger_of_two_differences() -> None:
    runs = Known(1.0, 3e3, rough=True, power=1.0)
    found = plan(runs, 4, 200)
    assert found.met
    assert runs.error(found.cells, found.steps) <= 1.0
    smooth = plan(Known(1.0, 1e6, rough=True), 4, 200)
    assert smooth.steps <= 2.5 * plan(Known(1.0, 1e6), 4, 200).steps


def test_limits_are_said() -> None:
    found = plan(Known(1.0, 1e12), 4, 200, limits=Limits(steps=3200))
    assert found.why == "steps"
    assert found.steps <= 3200
    assert not found.met
    found = plan(Known(1e12, 1e4), 4, 200, limits=Limits(cells=64))
    assert found.why == "cells"
    assert found.cells <= 64
    assert not found.met


def test_numbers_of_steps_are_multiples_of_a_unit() -> None:
    found = plan(Known(1.0, 3.3e6), 4, 240, limits=Limits(unit=40))
    assert found.steps % 40 == 0
    assert found.met


class Late(Known):
    """Errors of waves, which no step up to 6400 of them resolves; then they fall."""

    def error(self, cells: int, steps: int) -> float:
        late = 50.0 * (-1.0) ** round(np.log2(steps / 200)) if steps < 6400 else 1e8 / steps**2
        return self.mesh / cells**4 + late


def test_differences_that_begin_to_fall_late_are_no_chaos() -> None:
    runs = Late(1.0, 0.0)
    found = plan(runs, 4, 200)
    assert found.why == ""
    assert abs(runs.error(found.cells, found.steps)) <= 1.0


class Waves(Known):
    """Meshes whose errors show with many steps alone: 30 / cells^2 of them from 5000 steps on."""

    def error(self, cells: int, steps: int) -> float:
        return super().error(cells, steps) + 300.0 / cells**2 * (steps > 5000)


def test_the_mesh_is_proved_with_the_steps_of_the_run() -> None:
    runs = Waves(1e3, 5e7)
    found = plan(runs, 4, 200)
    assert found.steps > 5000
    assert abs(runs.error(found.cells, found.steps)) <= 1.0


class Stiff(Known):
    """Fine meshes move faster than few steps resolve: differences of meshes grow up to 800 steps."""

    def error(self, cells: int, steps: int) -> float:
        return super().error(cells, steps) + (5.0 * cells if steps < 800 else 0.0)


def test_meshes_are_told_apart_with_steps_that_resolve_them() -> None:
    found = plan(Stiff(1e3, 1e7), 4, 200)
    assert found.why == ""
    assert found.met


def test_a_small_difference_of_meshes_after_a_large_one_is_not_believed() -> None:
    """Differences of 500, 13, 3, 0.7, as a moment inside of cells has them: an even fall by 38
    would have ended with nine cells.
    """

    class Moment(Known):
        def error(self, cells: int, steps: int) -> float:
            return 200.0 / cells**2 + (500.0 if cells < 4 else 0.0) + self.step / steps**2

    runs = Moment(0.0, 1e3)
    found = plan(runs, 4, 200)
    assert runs.error(found.cells, found.steps) <= 1.0


class Unsettled(Known):
    """Few steps do not resolve what fine meshes do: differences of meshes neither grow nor fall up
    to 800 steps.
    """

    def error(self, cells: int, steps: int) -> float:
        return super().error(cells, steps) + (
            40.0 * (9.0 - math.log2(cells)) if steps < 800 else 0.0
        )


def test_meshes_whose_differences_do_not_fall_are_compared_with_more_steps() -> None:
    found = plan(Unsettled(1e3, 1e7), 4, 200)
    assert found.why == ""
    assert found.met


def test_a_mesh_is_judged_by_coarser_ones_with_as_many_steps() -> None:
    """Errors of 168, 20, 3.5 fall by 9, and differences foretell 0.9 with 21 cells, which err by
    1.9: 1.6 beside 16 cells.
    """

    class Slower(Known):
        def error(self, cells: int, steps: int) -> float:
            return 768.0 / cells**2 + 30720.0 / cells**4

    runs = Slower(0.0, 0.0)
    found = plan(runs, 8, 200)
    assert found.met
    assert found.cells > 21
    assert runs.error(found.cells, found.steps) <= 1.0


class Touching(Known):
    """Forces that jump, which settle late on a mesh of 4 cells and soon on finer ones."""

    def error(self, cells: int, steps: int) -> float:
        return self.mesh / cells**4 + (
            self.step / steps if cells <= 4 else 0.1 * self.step * 1e3 / steps**2
        )


def test_half_of_the_steps_is_taken_where_runs_show_that_it_is_enough() -> None:
    runs = Touching(1e3, 5e3, rough=True)
    found = plan(runs, 4, 200)
    assert found.met
    assert runs.error(found.cells, found.steps) <= 1.0
    assert (
        found.steps < 5e3 / SAFETY / SHARE / 1.9
    )  # over what the coarse mesh needs, of which its chain foretells twice as much
    assert float(found.time[0, 0]) >= runs.error(found.cells, found.steps) - 1e3 / found.cells**4


class Columns(Known):
    """Two wanted columns: one errs by b / m^2, and one less than that, at first, with b / m^power."""

    def run(self, cells: int, steps: int) -> np.ndarray:
        self.runs.append((cells, steps))
        return np.stack([self.error(cells, steps) * SHAPE, 1e3 / steps**self.power * SHAPE])

    def error(self, cells: int, steps: int) -> float:
        return self.mesh / cells**4 + self.step / steps**2

    def differ(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        found = np.abs(one - other).max(axis=1)
        return np.stack([found * [1.0, 1e-3], found])


@pytest.mark.parametrize("power", [0.8, 1.0, 1.5])
def test_a_column_falls_by_its_own_ratio(power: float) -> None:
    runs = Columns(1.0, 1e6, power=power)
    found = plan(runs, 4, 200)
    assert found.met
    assert float(found.errors[1, 1]) >= 1e3 / found.steps**power * SHAPE.max()


class Places(Known):
    """Equilibria whose moment is read inside of cells: three times as wrong with meshes that are
    not twice those before.
    """

    def error(self, cells: int, steps: int) -> float:
        return self.mesh / cells**2 * (1.0 if cells in (2, 4, 8, 16, 32, 64) else 3.0)


@pytest.mark.parametrize("mesh", [10.0, 100.0])
def test_equilibria_are_proved(mesh: float) -> None:
    runs = Places(mesh, 0.0)
    found = plan(runs, 4, 0, free_steps=False, limits=Limits(1))
    assert found.met
    assert runs.error(found.cells, 1) <= size(found.mesh) * 1.001


class Wobbling(Known):
    """Up to so many cells nothing settles; finer meshes do."""

    wild = 4

    def run(self, cells: int, steps: int) -> np.ndarray | None:
        found = super().run(cells, steps)
        assert found is not None
        noise = np.random.default_rng([cells, steps]).uniform(-1.0, 1.0, len(SHAPE))
        return found + 100.0 * noise * (cells <= self.wild)


def test_what_few_cells_do_is_the_mesh_and_no_motion() -> None:
    runs = Wobbling(1e3, 1e6)
    found = plan(runs, 4, 200)
    assert found.why == ""
    assert runs.error(found.cells, found.steps) <= 1.0


def test_another_mesh_tells_its_error_where_nothing_settles() -> None:
    found = plan(Known(1e6, 1e6, noise=30.0), 4, 200)
    assert found.why == "sensitive"
    assert size(found.mesh) >= 1e6 / found.cells**4


def test_a_given_step_stays_where_meshes_do_not_settle() -> None:
    runs = Wobbling(0.0, 1e6)
    runs.wild = 10**6
    found = plan(runs, 4, 3000, free_steps=False, limits=Limits(usual=200))
    assert found.why == "sensitive"
    assert found.steps == 3000


@pytest.mark.parametrize("power", [1.0, 2.0])
@pytest.mark.parametrize("steps", [500, 501])
def test_given_steps_are_proved_by_runs_that_have_all_their_instants(
    steps: int, power: float
) -> None:
    runs = Known(1.0, 1e3, power=power)
    found = plan(runs, 4, steps, free_steps=False)
    assert size(found.time) >= 1e3 / steps**power
    assert all(
        steps % other == 0 or other % steps == 0
        for cells, other in runs.runs
        if cells == found.cells
    )


@pytest.mark.parametrize("mesh", [1e-3, 1.0, 30.0])
def test_no_mesh_has_fewer_cells_than_a_body_can_have(mesh: float) -> None:
    """Many steps ask for a mesh of half the cells beside the one that is chosen."""
    runs = Known(mesh, 1e9)
    found = plan(runs, 6, 200, limits=Limits(fewest=3))
    assert found.met
    assert min(cells for cells, _ in runs.runs) == 3
