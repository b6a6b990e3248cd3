"""Figures of a training: real files with their samples, curves and bands in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.families import kriging
from fmbs_skfem.reduction.parameters import Parameter, Scale
from fmbs_skfem.results import palette, plots, training_plots
from fmbs_skfem.results.training_plots import SurrogatePanel

from .test_plots import count, overprinted

X = np.linspace(40.0, 70.0, 101)


def panel(d: int, chosen: int | None = 100) -> tuple[dict[str, np.ndarray], SurrogatePanel]:
    """A surrogate of I = 10^(-6 + |u|^2) over d parameters of the unit box, exact at its samples."""
    rng = np.random.default_rng(1)
    unit = np.linspace(0.0, 1.0, 101)[:, None] if d == 1 else rng.random((101, d))
    mean = -6.0 + (unit**2).sum(axis=1)
    samples = np.array([0, 25, 50, 75, 100])
    names = ("E [GPa]", "d [mm]", "g [m/s^2]", "t [s]")[:d]
    columns = {name: 40.0 + 30.0 * unit[:, k] for k, name in enumerate(names)}
    return columns, SurrogatePanel(
        "after 1 full run", mean, np.full(101, 0.1), samples, 10 ** mean[samples], chosen
    )


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_surrogate_shows_the_next_full_run(d: int, tmp_path: Path) -> None:
    columns, found = panel(d)
    path = plots.save(training_plots.surrogate(columns, [found, found]), tmp_path / "next.png")
    without = plots.save(
        training_plots.surrogate(columns, [panel(d, None)[1]]), tmp_path / "none.png"
    )
    assert count(path, palette.VERMILLION) > 40
    assert count(without, palette.VERMILLION) == 0


def test_a_curve_stays_one_where_the_surrogate_is_constant_and_a_run_failed(tmp_path: Path) -> None:
    columns, found = panel(1)
    flat = SurrogatePanel(
        "flat",
        np.full(101, -5.0),
        np.zeros(101),
        found.samples,
        np.array([1e-5, 1e-5, np.inf, 0.0, 1e-5]),
    )
    assert (
        count(
            plots.save(training_plots.surrogate(columns, [flat]), tmp_path / "flat.png"),
            palette.BLUE,
        )
        > 300
    )


def test_candidates_on_a_line_have_a_surface_without_triangles(tmp_path: Path) -> None:
    _, found = panel(2)
    line = {"E [GPa]": X, "d [mm]": X - 30.0}
    assert (
        count(
            plots.save(training_plots.surrogate(line, [found]), tmp_path / "line.png"),
            palette.VERMILLION,
        )
        > 40
    )


@pytest.mark.parametrize("d", [1, 2, 3])
def test_slices_of_a_surrogate_have_its_samples(d: int, tmp_path: Path) -> None:
    """A curve with its band, a surface, or curves and surfaces through the centre; a logarithmic
    axis among them.
    """
    unit = qmc.Sobol(d, rng=1).random(8)
    known = (
        Parameter("E", 2e9, 6e10, Scale.LOG, "Pa"),
        Parameter("d", 8e-3, 12e-3, unit="m"),
        Parameter("g", 5.0, 12.0),
    )[:d]
    model = kriging.fit(unit, 10 ** (-6.0 + (unit**2).sum(axis=1)))
    figure = training_plots.slices(known, model, title="pendulum")
    path = plots.save(figure, tmp_path / "slices.png")
    assert overprinted(figure) == []
    assert (count(path, palette.BLUE) > 300) == (d != 2)
    assert (count(path, "#440154") > 50) == (d > 1)  # the lowest colour of the surfaces


def test_a_slice_is_the_surrogate_at_the_centre_of_the_others() -> None:
    unit = qmc.Sobol(3, rng=2).random(8)
    known = tuple(Parameter(name, 1.0, 3.0) for name in "abc")
    model = kriging.fit(unit, 10 ** (-6.0 + unit[:, 1]))
    (values,), found = training_plots._cut(known, model, (1,))
    line = np.linspace(1.0, 3.0, training_plots.FINE[1])
    np.testing.assert_allclose(values, np.r_[line, 1.0 + 2.0 * model.points[:, 1]], rtol=1e-12)
    middle = np.column_stack([np.full(len(line), 0.5), (line - 1.0) / 2.0, np.full(len(line), 0.5)])
    np.testing.assert_allclose(found.mean, kriging.predict(model, middle)[0], atol=1e-9)
    np.testing.assert_allclose(found.std, kriging.deviation(model, middle), rtol=1e-9)
    np.testing.assert_allclose(values[found.samples], 1.0 + 2.0 * model.points[:, 1], rtol=1e-12)


def test_errors_over_a_parameter_are_sorted_by_it(tmp_path: Path) -> None:
    """Values in any order give the same picture."""
    errors = 1e-6 * (1 + ((X - 55) / 5) ** 2)
    models = {"2 full runs": errors, "fast to slow": 30 * errors}
    path = plots.save(
        plots.errors(X, models, across="E [GPa]", level=1e-5, named="tolerance"), tmp_path / "a.png"
    )
    mixed = np.random.default_rng(0).permutation(101)
    shuffled = {name: values[mixed] for name, values in models.items()}
    other = plots.save(
        plots.errors(X[mixed], shuffled, across="E [GPa]", level=1e-5, named="tolerance"),
        tmp_path / "b.png",
    )
    assert path.read_bytes() == other.read_bytes()
    assert count(path, palette.BLUE) > 300
    assert count(path, palette.VERMILLION) > 300


def test_points_outside_the_band_are_told_apart(tmp_path: Path) -> None:
    true = np.geomspace(1e-7, 1e-4, 20)
    inside = plots.save(
        training_plots.predicted(true, true * 1.2, true / 2, true * 2, goal=1e-4),
        tmp_path / "in.png",
    )
    predicted = true * np.where(np.arange(20) == 4, 5.0, 1.2)
    outside = plots.save(
        training_plots.predicted(true, predicted, predicted / 2, predicted * 2),
        tmp_path / "out.png",
    )
    assert count(inside, palette.BLUE) > 300
    assert count(inside, palette.VERMILLION) == 0
    assert count(outside, palette.VERMILLION) > 30


def test_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.png"
    with pytest.raises(InputError, match="candidates and at least one iteration"):
        plots.save(training_plots.surrogate(panel(1)[0], []), path)
    with pytest.raises(InputError, match="at least one point with errors above zero"):
        plots.save(training_plots.predicted(np.zeros(3), np.ones(3), np.ones(3), np.ones(3)), path)
    assert not path.exists()
