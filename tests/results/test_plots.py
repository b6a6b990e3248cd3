"""Plots: real files with the curves in them; the front of speed against error exactly."""

from __future__ import annotations

import io
import itertools
import math
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.display import DisplayUnits
from fmbs_skfem.results import palette, plots, response_plots, speed
from fmbs_skfem.results.speed import Point

TIMES = np.linspace(0.0, 3.0, 301)
SWING = np.exp(-TIMES) * np.cos(4 * TIMES)
POINTS = (
    Point("full, 100 elements", "full", 1.6, 0.0),
    Point("full, 20 elements", "coarse", 0.4, 4e-5),
    Point("full, h 1e-3", "step", 0.8, 1.4e-3),
    Point("component, 23 + 23", "component", 0.6, 9.6e-5),
    Point("points, 23 + 23", "component+ecsw-points", 0.14, 1.1e-4),
    Point("too few modes", "system", 0.1, math.nan),
)


def count(path: Path, tint: str) -> int:
    """Pixels of this colour."""
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert min(pixels.shape[:2]) >= 500
    return int(
        (np.abs(pixels - [int(tint[i : i + 2], 16) for i in (1, 3, 5)]).max(axis=2) <= 12).sum()
    )


def overprinted(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of numbers and offsets along level axes that lie over each other; an axis has two
    numbers at least, or none.
    """
    figure.canvas.draw()
    shown: list[Text] = []
    for axis in (one.xaxis for one in figure.axes if one.axison):
        low, high = sorted(axis.get_view_interval())
        ticks = [
            text
            for text in axis.get_ticklabels(which="both")
            if text.get_visible() and text.get_text()
        ]
        numbers = [text for text in ticks if low <= text.get_position()[0] <= high]
        assert len(numbers) != 1
        shown += (
            [*numbers, axis.get_offset_text()]
            if axis.get_offset_text().get_text() and numbers
            else numbers
        )
    assert shown
    boxes = [text.get_window_extent() for text in shown]
    pairs = itertools.combinations(zip(shown, boxes, strict=True), 2)
    return [(one.get_text(), other.get_text()) for (one, a), (other, b) in pairs if a.overlaps(b)]


def test_histories_show_every_model(tmp_path: Path) -> None:
    models = {"full": SWING, "component": SWING + 0.1, "ffrf": 2 * SWING}
    path = plots.save(
        plots.history_grid(TIMES, {"tip deflection [m]": models}, "Spin-up"),
        tmp_path / "new" / "h.png",
    )
    assert path == tmp_path / "new" / "h.png"
    assert count(path, palette.BLUE) > 500
    assert count(path, palette.VERMILLION) > 500
    assert count(path, palette.GREEN) == 0


def test_a_saved_figure_has_the_pixels_of_savefig(tmp_path: Path) -> None:
    outputs = {"x [m]": {"full": SWING}, "y [m]": {"full": 2 * SWING}}
    path = plots.save(plots.history_grid(TIMES, outputs), tmp_path / "a.png")
    plots.history_grid(TIMES, outputs).savefig(tmp_path / "b.png")
    with Image.open(path) as one, Image.open(tmp_path / "b.png") as other:
        assert one.info["dpi"] == other.info["dpi"]
        np.testing.assert_array_equal(np.asarray(one), np.asarray(other))


def test_slider_from_rest_and_turns_a_minute(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """x - x(0) starts at zero, and 200 pi rad/s are 6000 turns a minute."""
    drawn: dict[str, Mapping[str, np.ndarray]] = {}
    monkeypatch.setattr(
        plots, "history_grid", lambda _, outputs, __, display: drawn.update(outputs)
    )
    plots.slider(TIMES, {"full": 0.3 + 0.1 * TIMES}, {"full": 200 * np.pi / 3 * TIMES})
    (displacement, speed_) = drawn.values()
    np.testing.assert_allclose(displacement["full"][[0, -1]], [0.0, 0.3], atol=1e-15)
    np.testing.assert_allclose(speed_["full"][[0, -1]], [0.0, 6000.0], rtol=1e-14)
    monkeypatch.undo()
    models = {"full": 0.3 * SWING, "system": 0.31 * SWING, "component": 0.32 * SWING}
    path = plots.save(plots.slider(TIMES, models, models, title="Fig. 11"), tmp_path / "fig11.png")
    assert count(path, palette.BLUE) > 500


@pytest.mark.parametrize("count_", [1, 3, 5])
def test_small_multiples(count_: int, tmp_path: Path) -> None:
    """Up to three panels below each other, more of them in two columns; the lowest of each has the
    label of the axis.
    """
    figure = plots.history_grid(
        TIMES, {f"C_{i} [m]": {"full": SWING, "system": SWING * (1 + i)} for i in range(count_)}
    )
    assert count(plots.save(figure, tmp_path / "g.png"), palette.BLUE) > 300
    assert [axes.get_xlabel() for axes in figure.axes].count("time [s]") == (2 if count_ > 3 else 1)


def test_errors_leave_gaps_where_there_is_no_logarithm(tmp_path: Path) -> None:
    error = 1e-5 * (1 + TIMES)
    broken = np.where(TIMES < 1, 10 * error, np.nan)
    path = plots.save(
        plots.errors(TIMES, {"component": error, "diverged": broken}, level=3.5e-4),
        tmp_path / "e.png",
    )
    assert count(path, palette.BLUE) > 2 * count(path, palette.VERMILLION) > 300
    with_floor = count(path, palette.BLACK)
    assert (
        with_floor
        > count(
            plots.save(
                plots.errors(TIMES, {"component": error, "diverged": broken}), tmp_path / "f.png"
            ),
            palette.BLACK,
        )
        + 200
    )
    plots.save(plots.errors(TIMES, {"the same": np.zeros_like(TIMES)}), tmp_path / "zero.png")


def test_norms_and_singular_values(tmp_path: Path) -> None:
    curves = {
        "two-norm": 1.63e-7 + 0 * TIMES,
        "constraint force": 1.62e-7 + 0 * TIMES,
        "gappy norm": 5.1e-9 + 0 * TIMES,
    }
    assert count(plots.save(plots.errors(TIMES, curves), tmp_path / "n.png"), palette.GREEN) > 500
    spectra = {"I": 10.0 ** -np.arange(20), "II": np.r_[10.0 ** -np.arange(10), 0.0]}
    marked = count(
        plots.save(plots.singular_values(spectra, {"I": 6, "II": 7}, 1e-12), tmp_path / "s.png"),
        palette.BLUE,
    )
    assert (
        marked
        > count(plots.save(plots.singular_values(spectra), tmp_path / "t.png"), palette.BLUE) + 300
    )
    with pytest.raises(InputError, match="singular values of 'I'"):
        plots.save(plots.singular_values({"I": np.zeros(4)}), tmp_path / "u.png")


def test_a_model_without_error_stands_on_the_edge_that_is_marked_as_zero() -> None:
    """No ordinate is invented: the reference is at the lower end of the axis, below all powers of
    ten.
    """
    axes = plots.speed_error(
        [Point("full", "full", 1.0, 0.0), Point("coarse-10", "coarse", 0.2, 3e-5)]
    ).axes[0]
    (star,) = [one for one in axes.collections if one.get_label() == "full model"]
    assert float(star.get_offsets()[0][1]) == axes.get_ylim()[0] < 1e-5
    assert [text.get_text() for text in axes.texts if text.get_position() == (-7, 0)] == ["0"]


def test_speed_error_has_one_colour_a_family(tmp_path: Path) -> None:
    path = plots.save(
        plots.speed_error(POINTS, floor=3.5e-4, title="Double pendulum"), tmp_path / "s.png"
    )
    for family in ("coarse", "step", "component", "component+ecsw-points"):
        assert count(path, plots.FAMILIES[family][0]) > 60, family
    assert count(path, plots.FAMILIES["system"][0]) == 0
    plots.save(
        plots.speed_error((*POINTS, Point("mine", "my own reduction", 0.2, 1e-3))),
        tmp_path / "t.pdf",
    )
    assert (tmp_path / "t.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(InputError, match="at least one finished model"):
        plots.save(plots.speed_error(POINTS[-1:]), tmp_path / "u.png")


@pytest.mark.parametrize("floor", [1e-9, 3.5e-4, 50.0])
def test_the_error_of_the_step_is_drawn_inside_of_the_axes(floor: float) -> None:
    axes = plots.speed_error(POINTS, floor=floor).axes[0]
    low, high = axes.get_ylim()
    (line,) = [line for line in axes.lines if line.get_label() == "time discretisation"]
    assert low < line.get_ydata()[0] < high


def test_numbers_at_an_axis_are_whole(tmp_path: Path) -> None:
    """A force that hardly changes stands as 19.62 N at its axis, not as what is to be added to
    1.962e1.
    """
    figure = plots.panel_grid(TIMES, [plots.Panel("pin [N]", {"z": 19.62 + 3e-4 * SWING})])
    plots.save(figure, tmp_path / "whole.png")
    axis = figure.axes[0].yaxis
    assert axis.get_offset_text().get_text() == ""
    assert all(label.get_text().startswith("19.6") for label in axis.get_ticklabels())


@pytest.mark.parametrize("size", [1.0, 1e7])
def test_a_key_is_above_the_power_of_ten(size: float) -> None:
    figure = plots.panel_grid(
        TIMES,
        [
            plots.Panel(
                "torsion [1/m]", {"11": size * SWING, "second principal value": -size * SWING}
            )
        ],
    )
    figure.canvas.draw()
    (axes,), power = figure.axes, figure.axes[0].yaxis.get_offset_text()
    assert power.get_text() == ("" if size == 1.0 else "1e7")
    key = axes.get_legend().get_window_extent()
    assert not (power.get_text() and key.overlaps(power.get_window_extent()))
    assert key.y0 - axes.bbox.y1 < 25.0 * figure.dpi / 72


def test_long_keys_leave_panels_their_width(tmp_path: Path) -> None:
    """Keys of a clamp in space, three of them beside each other, had made its panels a quarter as
    wide.
    """
    long = {f"moment about ({k}, {k}, {k}), round-off": SWING for k in range(3)}
    figure = plots.panel_grid(
        TIMES,
        [plots.Panel(f"r{k} [N m]", curves) for k, curves in enumerate([long, {"x": SWING}] * 2)],
    )
    plots.save(figure, tmp_path / "keys.png")
    for axes in figure.axes:
        assert axes.get_position().width > 0.35
        if key := axes.get_legend():
            assert key.get_window_extent().x1 < axes.get_window_extent().x1


def test_notebooks_show_figures() -> None:
    """IPython takes the PNG that a figure gives; one without pyplot had been a line of text."""
    figure = plots.history_grid(TIMES, {"y [m]": {"full": SWING}})
    image = Image.open(io.BytesIO(figure._repr_png_()))
    assert image.size == tuple(round(90 * side) for side in figure.get_size_inches())


def test_a_grid_has_no_more_panels_than_can_be_read() -> None:
    outputs = {f"force {k}": {"full": SWING} for k in range(plots.PANELS + 1)}
    with pytest.raises(InputError, match="1 to 24, got 25"):
        plots.history_grid(TIMES, outputs)
    figure = plots.history_grid(TIMES, dict(list(outputs.items())[1:]), across="load factor")
    assert figure.axes[-1].get_xlabel() == "load factor"


def test_the_key_names_the_models_of_the_front() -> None:
    """Fastest first, by the numbers beside them, long names cut; what failed is counted."""
    figure = plots.speed_error(
        (*POINTS, Point("a name of " + 9 * "many words ", "system", 0.05, 1e-2))
    )
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    start = shown.index("Pareto front, fastest first:")
    assert shown[start + 1].startswith("a name of many words")
    assert len(shown[start + 1].split(":")[0]) <= plots.LONGEST
    assert shown[start + 2] == "points, 23 + 23: 0.14 s, error 1.1e-04"
    assert shown[-1] == "(1 failed, not shown)"
    marks = [
        handle.get_marker()
        for handle in figure.axes[0].lines
        if str(handle.get_label()) in shown[start + 1 : start + 5]
    ]
    assert marks == ["$1$", "$2$", "$3$", "$4$"]


def test_front_exactly() -> None:
    assert [point.name for point in speed.front(POINTS)] == [
        "points, 23 + 23",
        "full, 20 elements",
        "full, 100 elements",
    ]
    assert speed.front(POINTS[-1:]) == ()
    twins = (
        Point("first", "full", 1.0, 1e-3),
        Point("second", "full", 1.0, 1e-3),
        Point("slower", "full", 2.0, 1e-3),
    )
    assert [point.name for point in speed.front(twins)] == ["first"]


def test_the_cheapest_at_an_error() -> None:
    """A failed run, whose error is no number, never is; of equal times the most exact."""
    bounds = (1e-5, 5e-5, 1.1e-4, 1.0)
    found = [speed.cheapest(POINTS, bound) for bound in bounds]
    names = [point.name if point else None for point in found]
    assert names == [
        "full, 100 elements",
        "full, 20 elements",
        "points, 23 + 23",
        "points, 23 + 23",
    ]
    assert speed.cheapest(POINTS[1:], 1e-5) is None
    twins = (Point("first", "full", 1.0, 1e-3), Point("second", "full", 1.0, 1e-4))
    assert speed.cheapest(twins, 1e-2) == twins[1]


def test_front_in_words() -> None:
    assert speed.front_in_words(POINTS) == (
        "Of 6 models 3 are on the Pareto front, 1 of them reduced; fastest first: points, 23 + 23 (0.14 s, error 1.1e-04), "
        "full, 20 elements (0.4 s, error 4.0e-05), full, 100 elements (1.6 s, the reference). "
        "Reduced models are on it at errors from 1.1e-04 to 1.1e-04. Failed: too few modes."
    )
    assert speed.front_in_words(POINTS[-1:]) == "No model finished, so there is no Pareto front."
    assert "1 is on the Pareto front, none of them reduced" in speed.front_in_words(POINTS[:1])


@given(
    st.lists(
        st.tuples(
            st.sampled_from([0.1, 0.2, 0.5, 1.0]), st.sampled_from([0.0, 1e-6, 1e-3, 1.0, math.inf])
        ),
        max_size=12,
    )
)
def test_nobody_beats_the_front_and_it_beats_everybody_else(
    rows: list[tuple[float, float]],
) -> None:
    points = [Point(str(i), "component", cpu, error) for i, (cpu, error) in enumerate(rows)]
    best = speed.front(points)

    def beats(a: Point, b: Point) -> bool:
        return (
            a.cpu_s <= b.cpu_s and a.error <= b.error and (a.cpu_s, a.error) != (b.cpu_s, b.error)
        )

    assert not any(beats(a, b) for a in points for b in best)
    same = {(point.cpu_s, point.error) for point in best}
    finished = [point for point in points if math.isfinite(point.error)]
    assert all(any(beats(a, b) for a in best) for b in finished if (b.cpu_s, b.error) not in same)


def test_refused(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"'short': expected values at the 301 instants, got shape \(3,\)"
    ):
        plots.save(plots.history_grid(TIMES, {"x [m]": {"short": np.zeros(3)}}), tmp_path / "h.png")
    with pytest.raises(InputError, match="at least one curve"):
        plots.save(plots.errors(TIMES, {}), tmp_path / "n.png")
    with pytest.raises(InputError, match=r"\.png, \.pdf, \.svg"):
        plots.save(plots.history_grid(TIMES, {"x [m]": {"full": SWING}}), tmp_path / "h.txt")
    with pytest.raises(InputError, match="CPU time above 0"):
        Point("free", "full", 0.0, 0.0)
    assert list(tmp_path.iterdir()) == []


def test_no_global_state(tmp_path: Path) -> None:
    code = (
        "import sys, numpy as np; from fmbs_skfem.results import plots; "
        f"plots.save(plots.errors(np.arange(3.0), {{'a': np.ones(3)}}), {str(tmp_path / 'n.png')!r}); "
        "print('matplotlib.pyplot' in sys.modules)"
    )
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.strip()
        == "False"
    )


def test_orders_stand_beside_the_axes_of_a_campbell_diagram() -> None:
    """Orders 1, 2 and 3 leave at the right and above, where no curve runs through their names;
    crosses have their own colour.
    """
    speeds = np.linspace(0.0, 400.0, 33)
    frequencies = np.stack([6.0 + 0.15 * speeds, 40.0 + 0.0 * speeds], axis=1)
    figure = response_plots.campbell(
        speeds, frequencies, frequencies > 60.0, "speed [rad/s]", 3, "rotor"
    )
    figure.canvas.draw()
    axes = figure.axes[0]
    inside = axes.get_window_extent()
    names = {text.get_text(): text.get_window_extent() for text in axes.texts}
    assert list(names) == ["1 x", "2 x", "3 x"]
    assert names["1 x"].x0 > inside.x1
    assert min(names["2 x"].y0, names["3 x"].y0) > inside.y1
    tints = [
        line.get_color()
        for line in axes.lines
        if str(line.get_label()).startswith(("mode", "unstable"))
    ]
    assert len(set(tints)) == 3


def test_a_long_title_meets_no_key_and_numbers_of_short_times_meet_no_others() -> None:
    """A run of 3 ms beside one of 84 ms: the room of the axis is that of a log scale, whose lower
    end is no negative number.
    """
    cloud = [
        Point("full", "full", 0.084, 0.0),
        Point("coarse-20", "coarse", 0.016, 5e-8),
        Point("small", "system", 0.003, 3e-6),
    ]
    figure = plots.speed_error(
        cloud,
        None,
        "largest position error [m]",
        "double-pendulum; off the chart (error > 100 %): ffrf, others",
    )
    assert overprinted(figure) == []
    (key,), heading = (
        figure.legends,
        figure.findobj(
            lambda one: isinstance(one, Text) and one.get_text() == figure.get_suptitle()
        )[0],
    )
    assert not key.get_window_extent().overlaps(heading.get_window_extent())


def test_a_campbell_diagram_in_turns_a_minute() -> None:
    """The line of the first order is n / 60 Hz at n rpm; frequencies stay in hertz."""
    speeds = np.linspace(0.0, 200.0 * np.pi, 11)
    frequencies = np.stack([40.0 + 0.01 * speeds, 80.0 - 0.02 * speeds], axis=1)
    figure = response_plots.campbell(
        speeds, frequencies, frequencies > 1e3, "W [rad/s]", 1, display=DisplayUnits((), ("rpm",))
    )
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("W [rpm]", "frequency [Hz]")
    assert axes.get_xlim() == pytest.approx((0.0, 6000.0))
    first, *_, order = (np.asarray(line.get_data()) for line in axes.lines)
    np.testing.assert_allclose(first[1], 40.0 + 0.01 * first[0] * np.pi / 30.0, rtol=1e-14)
    np.testing.assert_allclose(order[1], order[0] / 60.0, rtol=1e-14, atol=1e-15)
