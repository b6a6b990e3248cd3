"""Figures from plain arrays with matplotlib: histories, errors, norms, singular values, speed
against error.

Every function returns a figure; `save` writes it. Figures 3 to 5, 8, 9, 11 and 12 of doi
10.1016/j.cma.2019.112690 have this form.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.display import SI, DisplayUnits, largest_of
from . import charts, palette, speed
from .charts import plain
from .frames import Array
from .speed import Point

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".pdf", ".svg")
LONGEST = 34  #: letters of a name
PANELS = 24  #: most axes of one figure
LETTERS = 26  #: of a line of the label beside a small axes
MARGIN = 1.1  #: beside a small axes, for its numbers and its label [inch]
ABOVE = 1.7  #: distance of a key from its axes where a power of ten stands between them, over the size of its letters
BELOW = 0.5  #: decades from the power of ten below the least error to the edge that stands for none
CLOSE = 1e-9  #: range of an axis, relative to its numbers, below which they are written as differences from one

#: family -> (colour, marker, name in the legend)
FAMILIES = {
    "full": (palette.BLACK, "*", "full model"),
    "coarse": (palette.GREY, "s", "full model, coarser mesh"),
    "step": (palette.ORANGE, "D", "full model, other step"),
    "chosen": (palette.VERMILLION, "*", "full model that an accuracy chooses"),
    "system": (palette.SKY, "^", "system level"),
    "system+ecsw": (palette.BLUE, "v", "system level + ECSW"),
    "component": (palette.PURPLE, "P", "component level"),
    "component+ecsw": (palette.GREEN, "o", "component level + ECSW"),
    "component+ecsw-points": (palette.VERMILLION, "X", "component level + ECSW, points"),
    "ffrf": ("#8B5A2B", "d", "floating frame"),
}


@dataclass(frozen=True)
class Panel:
    """Curves (s,) of one unit that share axes, such as the components of a vector; the label has
    the unit, `tip [m]`.
    """

    label: str
    curves: Mapping[str, Array]
    #: errors of some of them, drawn as a band on both sides
    bands: Mapping[str, float] = field(default_factory=dict)
    #: columns of outputs that they are, where their names are others
    columns: Mapping[str, str] = field(default_factory=dict)

    def read_in(self, display: DisplayUnits) -> Panel:
        """The same in the unit in which people read it."""
        label, size = display.head(
            self.label, [largest_of(values) for values in self.curves.values()]
        )
        curves = {name: np.asarray(values) / size for name, values in self.curves.items()}
        return replace(
            self,
            label=label,
            curves=curves,
            bands={name: band / size for name, band in self.bands.items()},
        )


def panel_grid(
    times: Array,
    shown: Sequence[Panel],
    title: str = "",
    across: str = "time [s]",
    marks: Sequence[tuple[float, str]] = (),
    display: DisplayUnits = SI,
) -> Figure:
    """Panels over one axis of time or load factor `times` (s,), whose label is `across`; a key
    where a panel has several curves.

    `marks` are instants with names, such as those of events. Numbers and labels are in SI units,
    and drawn in those of `display`, else with prefixes. Raises InputError for more than PANELS
    panels, for none, and for curves that are not at `times`.
    """
    figure, grid, shown, times, clock = _grid(times, shown, title, across, display)
    for axes, panel in zip(grid.flat, shown, strict=False):
        for number, (name, values) in enumerate(panel.curves.items()):
            axes.plot(
                times,
                values,
                label=plain(name),
                color=palette.colour(number),
                ls=charts.dashes(number),
                lw=1.3,
            )
            if band := panel.bands.get(name):
                axes.fill_between(
                    times,
                    values - band,
                    values + band,
                    color=palette.colour(number),
                    alpha=0.25,
                    lw=0.0,
                )
        _mark(axes, [(time / clock, name) for time, name in marks])
        _finish(axes, panel.label)
        if len(panel.curves) > 1:
            pad = ABOVE if has_power(axes) else 0.1
            beside: dict[str, Any] = {
                "loc": "lower left",
                "bbox_to_anchor": (0.0, 1.0),
                "borderaxespad": pad,
            }
            room = figure.get_figwidth() / grid.shape[1] - MARGIN
            axes.legend(
                fontsize=8,
                frameon=False,
                ncols=charts.fitting(list(panel.curves), room, 8),
                **beside,
            )
    return figure


def history_grid(
    times: Array,
    outputs: Mapping[str, Mapping[str, Array]],
    title: str = "",
    across: str = "time [s]",
    display: DisplayUnits = SI,
) -> Figure:
    """Outputs of several models over `times` (s,), a panel each: label with unit -> {model: (s,)};
    errors as of `panel_grid`.

    One legend for all: the first model is drawn broad and pale, as the reference of the others.
    """
    figure, grid, shown, times, _ = _grid(
        times, [Panel(*one) for one in outputs.items()], title, across, display
    )
    for axes, panel in zip(grid.flat, shown, strict=False):
        for number, (name, values) in enumerate(panel.curves.items(), start=-1):
            if number < 0 and len(panel.curves) > 1:
                axes.plot(
                    times,
                    values,
                    color="#9A9A9A",
                    lw=4.0,
                    alpha=0.75,
                    label=plain(name),
                    zorder=1,
                    solid_capstyle="round",
                )
                continue
            every = charts.stagger(len(times), number + 1, len(panel.curves), 12)
            own = charts.style(max(number, 0), ls=charts.dashes(max(number, 0)), lw=1.3)
            axes.plot(times, values, markevery=every, label=plain(name), zorder=2, **own)
        _finish(axes, panel.label)
    charts.legend_below(figure)
    return figure


def _grid(
    times: Array, shown: Sequence[Panel], title: str, across: str, display: DisplayUnits
) -> tuple[Figure, np.ndarray, list[Panel], Array, float]:
    """A figure with axes for panels that fit; these and the times as they are read, and the size of
    the unit of times.
    """
    if not 0 < len(shown) <= PANELS:
        raise InputError(say("plots: outputs", f"1 to {PANELS}", len(shown)))
    for panel in shown:
        _check_curves(f"plots: {panel.label}", times, panel.curves)
    label, clock = display.head(across, times)
    return (
        *charts.stack(len(shown), title, label),
        [one.read_in(display) for one in shown],
        np.asarray(times) / clock,
        clock,
    )


def has_power(axes: Axes) -> bool:
    """Whether a power of ten, by which the numbers of its axis are shortened, stands above an axes."""
    shown = axes.yaxis.get_major_formatter()
    shown.set_locs(list(axes.yaxis.get_majorticklocs()))
    return bool(shown.get_offset())


def _mark(axes: Axes, marks: Sequence[tuple[float, str]]) -> None:
    """Lines at instants, with their names beside them."""
    for time, name in marks:
        axes.axvline(time, color=palette.GREY, lw=0.9, ls=(0, (4, 3)))
        beside: dict[str, Any] = {
            "xytext": (-2, -3),
            "textcoords": "offset points",
            "ha": "right",
            "va": "top",
            "rotation": 90,
        }
        axes.annotate(
            plain(name),
            (time, 1.0),
            xycoords=axes.get_xaxis_transform(),
            fontsize=7,
            color=palette.GREY,
            **beside,
        )


def _finish(axes: Axes, label: str) -> None:
    """The label beside an axes in short lines, pale lines at the ticks, whose numbers are whole but
    where they are too CLOSE.
    """
    axes.set_ylabel(
        "\n".join(
            part for line in plain(label).split(": ", 1) for part in textwrap.wrap(line, LETTERS)
        )
    )
    charts.rule(axes)
    axes.margins(x=0.01)
    low, high = axes.get_ylim()
    if high - low > CLOSE * max(abs(low), abs(high)):
        axes.ticklabel_format(axis="y", useOffset=False)


def errors(
    times: Array,
    models: Mapping[str, Array],
    label: str = "relative error",
    across: str = "time [s]",
    level: float | None = None,
    named: str = "time discretisation",
    display: DisplayUnits = SI,
) -> Figure:
    """Errors or norms (s,) by name over times or values of a parameter (s,), log scale, as Figs 4,
    5, 9 and 12 to 14.

    `level` is a line in the key as `named`: the error of the full model's own time discretisation,
    or a tolerance. Values that have no logarithm are gaps. The units of `display` are those of
    `across` alone: a log scale shows powers of ten. Raises InputError for other shapes.
    """
    _check_curves(f"plots: {label}", times, models)
    figure = charts.figure(7.2, 4.4)
    axes = figure.subplots()
    order = np.argsort(times, kind="stable")
    across, clock = display.head(across, times)
    for number, (name, values) in enumerate(models.items()):
        every = charts.stagger(len(times), number, len(models), 10)
        own = charts.style(number, ls=charts.dashes(number))
        axes.plot(
            times[order] / clock,
            charts.positive(values)[order],
            markevery=every,
            label=plain(name),
            **own,
        )
    if any((np.asarray(values) > 0).any() for values in models.values()):
        axes.set_yscale("log")
    charts.level(axes, level, named)
    axes.set(xlabel=across, ylabel=label)
    charts.rule(axes)
    axes.margins(x=0.01)
    charts.legend_below(figure)
    return figure


def slider(
    times: Array,
    position: Mapping[str, Array],
    speed: Mapping[str, Array],
    axis: str = "x",
    title: str = "",
    display: DisplayUnits = SI,
) -> Figure:
    """Displacement x(t) - x(0) [m] of a slider along an axis, and the crank's speed [rad/s] in
    turns a minute, as Fig. 11.

    Positions and speeds (s,) are those of models by name.
    """
    displacement = {name: np.asarray(x) - np.asarray(x)[0] for name, x in position.items()}
    turns = {name: np.asarray(w) * 30 / np.pi for name, w in speed.items()}
    outputs = {
        f"{axis}-displacement of the slider [m]": displacement,
        "speed of the crank [rpm]": turns,
    }
    return history_grid(times, outputs, title, display=display)


def singular_values(
    values: Mapping[str, Array], modes: Mapping[str, int] | None = None, eps: float | None = None
) -> Figure:
    """Singular values s_i / s_1 of every component (i,), marked where they are truncated; `eps` of
    eq. (14) as text.

    InputError for values that do not fall, or are not above 0.
    """
    figure = charts.figure(6.6, 4.4)
    axes = figure.subplots()
    for number, (name, spectrum) in enumerate(values.items()):
        spectrum = np.asarray(spectrum, float)
        if spectrum.ndim != 1 or spectrum.size == 0 or not spectrum[0] > 0:
            got = f"shape {spectrum.shape}"
            raise InputError(
                say(f"plots: singular values of '{name}'", "a falling sequence (i,) above 0", got)
            )
        scaled = charts.positive(spectrum / spectrum[0])
        kept = (modes or {}).get(name)
        text = plain(name) if kept is None else f"{plain(name)}: {kept} modes kept"
        axes.semilogy(
            np.arange(1, spectrum.size + 1),
            scaled,
            label=text,
            **charts.style(number, ms=3.5, lw=1),
        )
        if kept is not None and 1 <= kept <= spectrum.size:
            axes.axvline(
                kept + 0.5, color=palette.colour(number), lw=1.1, ls=charts.dashes(1 + number % 4)
            )
    axes.set(xlabel="number of the mode", ylabel="singular value / largest")
    axes.legend(
        fontsize=9,
        frameon=True,
        framealpha=0.9,
        title=None if eps is None else f"truncated at eps = {eps:g}",
    )
    charts.rule(axes)
    return figure


def speed_error(
    points: Sequence[Point],
    floor: float | None = None,
    label: str = "largest relative error",
    title: str = "",
) -> Figure:
    """CPU time against error, both log; numbered points are on the Pareto front, `floor` is the
    time-discretisation error.

    Models without any error (the reference itself) lie on the lower edge, which is marked as 0;
    failed ones are only counted, below the key.
    """
    finished = [point for point in points if math.isfinite(point.error)]
    if not finished:
        raise InputError(
            say(
                "plots: speed against error", "at least one finished model", f"{len(points)} points"
            )
        )
    figure = charts.figure(9.6, 5.6, title)
    axes = figure.subplots()
    positive = [point.error for point in finished if point.error > 0] or [1.0]
    edge = 10.0 ** (math.floor(math.log10(min(positive))) - BELOW)
    _scatter(axes, finished, edge)
    _staircase(axes, speed.front(finished), edge, max(positive))
    axes.set(xscale="log", yscale="log", xlabel="CPU time of one run [s]", ylabel=label)
    charts.set_log(axes, "x", *axes.get_xlim())
    if any(point.error <= 0 for point in finished):
        axes.set_ylim(bottom=edge)
        beside: dict[str, Any] = {"textcoords": "offset points", "ha": "right", "va": "center"}
        axes.annotate("0", (0.0, 0.0), xycoords="axes fraction", xytext=(-7, 0), **beside)
    charts.level(axes, floor or None, "time discretisation")
    charts.rule(axes, which="major")
    if failed := len(points) - len(finished):
        axes.plot([], [], ls="", label=f"({failed} failed, not shown)")
    # higher it would meet a long title
    figure.legend(loc="outside right center", frameon=False, fontsize=9)
    return figure


def _scatter(axes: Axes, points: Sequence[Point], edge: float) -> None:
    others = [
        name for name in dict.fromkeys(point.family for point in points) if name not in FAMILIES
    ]
    for name in (*FAMILIES, *others):
        members = sorted(
            (point for point in points if point.family == name), key=lambda point: point.cpu_s
        )
        if not members:
            continue
        number = others.index(name) if name in others else 0
        tint, marker, text = FAMILIES.get(
            name, (palette.colour(number), charts.MARKERS[-1 - number % 10], name)
        )
        cpu = [point.cpu_s for point in members]
        error = [max(point.error, edge) for point in members]
        drawn: dict[str, Any] = {
            "c": tint,
            "marker": marker,
            "edgecolors": "white",
            "linewidths": 0.6,
            "label": text,
        }
        axes.scatter(cpu, error, s=110 if marker == "*" else 42, clip_on=False, zorder=3, **drawn)


def _staircase(axes: Axes, best: Sequence[Point], edge: float, top: float) -> None:
    """The front as a staircase, its models numbered and named in the key, fastest first."""
    cpu = [point.cpu_s for point in best]
    error = [max(point.error, edge) for point in best]
    broad: dict[str, Any] = {"color": "#B0B0B0", "lw": 5, "alpha": 0.45, "zorder": 1}
    axes.step(
        [cpu[0], *cpu],
        [max(top, error[0]) * 1.5, *error],
        where="post",
        label="Pareto front, fastest first:",
        **broad,
    )
    beside: dict[str, Any] = {
        "textcoords": "offset points",
        "ha": "right",
        "fontsize": 9,
        "fontweight": "bold",
        "zorder": 4,
    }
    for number, (point, place) in enumerate(
        zip(best, zip(cpu, error, strict=True), strict=True), start=1
    ):
        low = place[1] > edge  # below the edge are the numbers of the axis
        axes.annotate(
            str(number),
            place,
            xytext=(-5, -5 if low else 5),
            va="top" if low else "bottom",
            **beside,
        )
        name = f"{textwrap.shorten(point.name, LONGEST, placeholder='…')}: {point.cpu_s:.2g} s, {speed.accuracy(point)}"
        axes.plot(
            [],
            [],
            ls="",
            marker=f"${number}$",
            color="black",
            ms=5 * len(str(number)),
            label=plain(name),
        )


def _check_curves(where: str, times: Array, models: Mapping[str, Array]) -> None:
    if not models:
        raise InputError(say(where, "at least one curve", "none"))
    for name, values in models.items():
        if np.shape(values) != np.shape(times) or np.ndim(times) != 1:
            expected = f"values at the {np.size(times)} instants"
            raise InputError(say(f"{where}, '{name}'", expected, f"shape {np.shape(values)}"))


@checked
def save(figure: Figure, path: Path | str) -> Path:
    """Write a figure to a file. As PNG it is drawn by the canvas itself: `savefig` would lay it out
    twice, for the same pixels.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(
            say(
                f"plots: {target}",
                "a file name ending in " + ", ".join(SUFFIXES),
                f"'{target.suffix}'",
            )
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    canvas: Any = figure.canvas
    if target.suffix.lower() == ".png" and hasattr(canvas, "print_png"):
        # half the time of the usual 6, files 1.1 times as large
        canvas.print_png(target, pil_kwargs={"compress_level": 3})
    else:
        figure.savefig(target)
    return target
