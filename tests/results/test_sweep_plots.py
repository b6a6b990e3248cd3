"""Plots of a sweep: real files with the points, bands and crosses in them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.families import response_surfaces
from fmbs_skfem.families.members import Status
from fmbs_skfem.reduction import parameters
from fmbs_skfem.reduction.parameters import Parameter, Scale
from fmbs_skfem.results import palette, plots, sweep_plots
from fmbs_skfem.results.sweep_files import STATISTICS, Sweep, statistics
from fmbs_skfem.studies.sweeping import sobol_table

from .test_plots import count, overprinted

TIMES = np.linspace(0.0, 2.0, 81)
U = np.linspace(0.0, 1.0, 60)
SWEEP = Sweep(
    (Parameter("E", 1e8, 1e10, Scale.LOG, "Pa"), Parameter("d", 8e-3, 12e-3, unit="m")),
    np.column_stack([1e8 * 100**U, 8e-3 + 4e-3 * (0.5 + 0.5 * np.sin(40 * U))]),
    (Status.OK,) * 60,
    ("",) * 60,
    ("",) * 60,
    np.full(60, 0.1),
    np.tile(TIMES, (60, 1)),
    {"C_z": np.sin(3 * TIMES) * (1 + U[:, None]), "speed": np.cos(TIMES) + U[:, None]},
    {"speed": "m/s"},
    {},
)


def some_failed() -> Sweep:
    """Every sixth member failed."""
    bad = np.arange(60) % 6 == 0
    columns = {
        name: np.where(bad[:, None], np.nan, values) for name, values in SWEEP.columns.items()
    }
    status = tuple(Status.KILLED if failed else Status.OK for failed in bad)
    return replace(
        SWEEP, columns=columns, status=status, times=np.where(bad[:, None], np.nan, SWEEP.times)
    )


def test_the_response_shows_extremes_over_each_parameter(tmp_path: Path) -> None:
    path = plots.save(
        sweep_plots.response(SWEEP, title="pendulum"), tmp_path / "new" / "response.png"
    )
    assert count(path, palette.BLACK) > 200
    tinted = plots.save(sweep_plots.response(SWEEP, outputs=["speed"]), tmp_path / "one.pdf")
    assert tinted.read_bytes().startswith(b"%PDF")


def test_statistics_of_histories_are_exact_for_straight_lines() -> None:
    """x = a t from 0 to 2 at uneven instants, the second one cut off at 1: mean a T / 2, rms
    a T / sqrt(3), range a T; a member without result has none, and its own picture shows them.
    """
    times = np.array([[0.0, 0.1, 1.0, 2.0], [0.0, 0.5, 1.0, np.nan], [np.nan] * 4])
    a, T = np.array([-3.0, 4.0]), np.array([2.0, 1.0])
    sweep = replace(
        SWEEP,
        points=SWEEP.points[:3],
        status=(Status.OK, Status.OK, Status.FAILED),
        times=times,
        columns={"x": np.vstack([a[:, None] * times[:2], times[2:]])},
    )
    found = statistics(sweep, "x")
    assert list(found) == list(STATISTICS)
    assert_allclose(found["mean"][:2], a * T / 2)
    assert_allclose(found["rms"][:2], np.abs(a) * T / np.sqrt(3.0))
    assert_allclose(found["range"][:2], np.abs(a) * T)
    assert all(np.isnan(values[2]) for values in found.values())
    drawn = sweep_plots.over_parameters(sweep, {"x": ["rms", "range"]})
    rms = drawn.axes[0].collections[0].get_offsets()
    assert_allclose(np.asarray(rms)[:2, 1], found["rms"][:2])
    assert [axes.get_xlabel() for axes in drawn.axes] == ["E [GPa]", "d [mm]"]


BOXES = {
    "decades": (
        Parameter("E", 2e9, 6e10, Scale.LOG, "Pa"),
        Parameter("d", 1e-5, 3e-4, Scale.LOG, "m"),
        Parameter("m", 1e4, 2e4),
    ),
    "one decade": (
        Parameter("E", 7e8, 1.3e9, Scale.LOG, "Pa"),
        Parameter("density", 1100.0, 1300.0, unit="kg/m^3"),
    ),
    "long numbers": (
        Parameter("E", 7e8, 1.3e9, unit="Pa"),
        Parameter("length", 0.0999, 0.1001, unit="m"),
    ),
}


@pytest.mark.parametrize("box", BOXES)
def test_numbers_along_the_parameters_have_room(box: str) -> None:
    """Outputs of 1, 1e-4 and 1e-8, whose numbers are long in the matrix of scatter plots."""
    unit = np.stack([U, (7.0 * U) % 1.0, (11.0 * U) % 1.0], axis=1)[:, : len(BOXES[box])]
    y = (unit.sum(axis=1) ** 2)[:, None] * np.sin(3 * TIMES)
    sweep = replace(SWEEP, parameters=BOXES[box], points=parameters.from_box(BOXES[box], unit))
    sweep = replace(sweep, columns={"a": y, "energy": 1e-4 * y, "b": 1e-8 * y})
    fitted = response_surfaces.fit(sweep.parameters, sweep.points, y[:, -1])
    assert fitted is not None
    surfaces = sweep_plots.surfaces({"a": {"final": fitted}}, {})
    for figure in (sweep_plots.response(sweep), sweep_plots.scatter_matrix(sweep), surfaces):
        assert overprinted(figure) == []


def test_figures_say_that_outputs_are_left_out() -> None:
    many = replace(
        SWEEP,
        columns={f"{name}{k}": values for k in range(7) for name, values in SWEEP.columns.items()},
    )
    count = len(many.columns)
    assert (
        sweep_plots.response(many, title="pendulum").get_suptitle()
        == f"pendulum, 4 of {count} outputs"
    )
    assert sweep_plots.fan(many).get_suptitle() == f"6 of {count} outputs"
    assert sweep_plots.response(SWEEP, title="pendulum").get_suptitle() == "pendulum"


def test_the_matrix_marks_parameters_of_members_that_failed(tmp_path: Path) -> None:
    whole = plots.save(sweep_plots.scatter_matrix(SWEEP), tmp_path / "whole.png")
    parts = plots.save(sweep_plots.scatter_matrix(some_failed()), tmp_path / "parts.png")
    assert count(whole, palette.VERMILLION) == 0
    assert count(parts, palette.VERMILLION) > 50
    assert count(whole, palette.SKY) > 1000


def test_the_fan_has_a_median_between_its_bands(tmp_path: Path) -> None:
    for number, table in enumerate((SWEEP, some_failed())):
        path = plots.save(sweep_plots.fan(table), tmp_path / f"fan{number}.png")
        assert count(path, palette.BLACK) > 500


def test_histories_of_other_durations_are_drawn_up_to_the_shortest() -> None:
    """Members are linear in time, so that they can be interpolated exactly."""
    times = np.array([[0.0, 1.0, 2.0], [0.0, 2.0, 4.0], [0.0, 1.5, np.nan], [np.nan] * 3])
    common, values = sweep_plots.align(times, 3 * times)
    np.testing.assert_allclose(common, [0.0, 0.75, 1.5])
    np.testing.assert_allclose(values, np.tile(3 * common, (3, 1)))
    same, all_values = sweep_plots.align(SWEEP.times, SWEEP.columns["speed"])
    assert same is SWEEP.times[0] or np.array_equal(same, TIMES)
    np.testing.assert_array_equal(all_values, SWEEP.columns["speed"])


def test_what_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'speed'"):
        plots.save(sweep_plots.fan(SWEEP, outputs=["sped"]), tmp_path / "a.png")
    with pytest.raises(InputError, match="did you mean 'final'"):
        plots.save(sweep_plots.scatter_matrix(SWEEP, kind="finale"), tmp_path / "a.png")
    nothing = replace(SWEEP, status=(Status.FAILED,) * 60)
    for rule in (sweep_plots.response, sweep_plots.scatter_matrix, sweep_plots.fan):
        with pytest.raises(InputError, match="samples that ran"):
            rule(nothing)
    with pytest.raises(InputError, match=r"\.png"):
        plots.save(sweep_plots.fan(SWEEP), tmp_path / "a.gif")


def test_indices_name_the_value_that_they_are_of() -> None:
    """Of an output whose last value does not vary, those of another one, which stands beside its
    name.
    """
    part = {"E": 0.7, "d": 0.3}
    one = {"first": part, "total": part, "first_error": part, "total_error": part, "rows": 8}
    found = {"tip": {"min": one, "final": one}, "stop": {"max": one}}
    figure = sweep_plots.sensitivity(found)
    assert [axes.get_ylabel() for axes in figure.axes] == ["tip", "stop max"]
    assert [row[0] for row in sobol_table(found).rows] == ["tip", "stop max"]
