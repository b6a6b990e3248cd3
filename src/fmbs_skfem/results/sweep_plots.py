"""Figures of a sweep: responses over each parameter, a matrix of scatter plots, histories as a fan
of quantiles, fitted surfaces.

Only members that ran are drawn as points; where members failed, crosses mark their parameters in
the matrix.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, closest, say
from ..core.values.display import SI, DisplayUnits, largest_of
from ..core.values.ranges import Parameter
from ..core.values.units import add_unit
from ..families.members import Status
from ..families.response_surfaces import ResponseSurface
from ..reduction.parameters import from_box
from . import charts, palette
from .frames import Array
from .sweep_files import Sweep, statistics

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_OUTPUTS = 6  #: outputs in one figure, unless they are named
MOST_ROWS = 4  #: outputs over the parameters, unless they are named
MOST_SIDES = 6  #: parameters and outputs in a matrix, unless the outputs are named
GRID = 61  #: points of a curve, and along a side of a surface
MARKS = 14  #: area of the marks of a response [point^2]: on half of it a triangle looks like a disc
BINS = 24  #: of the histograms in the matrix
#: low, high, name, alpha
BANDS = (
    (0.0, 1.0, "all", 0.14),
    (0.05, 0.95, "5 to 95 %", 0.26),
    (0.25, 0.75, "25 to 75 %", 0.42),
)
KINDS = {
    "max": (palette.VERMILLION, "^"),
    "final": (palette.BLACK, "o"),
    "min": (palette.BLUE, "v"),
    "range": (palette.GREEN, "D"),
    "mean": (palette.PURPLE, "s"),
    "rms": (palette.ORANGE, "P"),
}


def response(
    sweep: Sweep, outputs: Sequence[str] = (), title: str = "", display: DisplayUnits = SI
) -> Figure:
    """Largest, last and smallest value of outputs over every parameter: a row an output, a column a
    parameter.
    """
    chosen = choose_outputs(sweep, outputs, MOST_ROWS)
    shown = dict.fromkeys(chosen, ("max", "final", "min"))
    return over_parameters(sweep, shown, headed(title, chosen, sweep.columns), display)


def over_parameters(
    sweep: Sweep,
    shown: Mapping[str, Sequence[str]],
    title: str = "",
    display: DisplayUnits = SI,
) -> Figure:
    """Statistics of outputs, by `sweep_files.STATISTICS`, over every parameter: a row an output, a
    column a parameter.
    """
    sweep = read_in(sweep, display)
    choose_outputs(sweep, list(shown), MOST_ROWS)
    width, height = 3.1 * len(sweep.parameters) + 1.2, 2.2 * len(shown) + 0.8
    figure = charts.figure(width, height, title)
    grid = figure.subplots(
        len(shown), len(sweep.parameters), squeeze=False, sharex="col", sharey="row"
    )
    for row, (output, kinds) in zip(grid, shown.items(), strict=True):
        values = statistics(sweep, output)
        for axes, parameter, points in zip(row, sweep.parameters, sweep.points.T, strict=True):
            for kind in kinds:
                tint, marker = KINDS[kind]
                axes.scatter(
                    points,
                    values[kind],
                    s=MARKS,
                    c=tint,
                    marker=marker,
                    alpha=0.55,
                    linewidths=0,
                    label=kind,
                )
            charts.over_parameter(axes, "x", parameter)
            charts.rule(axes)
            axes.label_outer()
        row[0].set_ylabel(add_unit(output, sweep.units.get(output, "")))
    charts.legend_below(figure)
    return figure


def scatter_matrix(
    sweep: Sweep,
    outputs: Sequence[str] = (),
    kind: str = "final",
    title: str = "",
    display: DisplayUnits = SI,
) -> Figure:
    """Every parameter and output against those before it, with histograms on the diagonal; outputs
    by one of `statistics`.
    """
    if kind not in KINDS:
        raise InputError(
            say(
                "scatter matrix: kind",
                f"one of {', '.join(KINDS)}",
                f"'{kind}'{closest(kind, KINDS)}",
            )
        )
    sweep = read_in(sweep, display)
    chosen = choose_outputs(sweep, outputs, max(1, MOST_SIDES - len(sweep.parameters)))
    sides = [(add_unit(p.name, p.unit), sweep.points[:, k]) for k, p in enumerate(sweep.parameters)]
    sides += [
        (add_unit(f"{name} {kind}", sweep.units.get(name, "")), statistics(sweep, name)[kind])
        for name in chosen
    ]
    good = np.array([status is Status.OK for status in sweep.status])
    bad = np.array([status not in (Status.OK, None) for status in sweep.status])
    figure = charts.figure(
        1.9 * len(sides) + 0.8, 1.8 * len(sides) + 0.8, headed(title, chosen, sweep.columns)
    )
    grid = figure.subplots(len(sides), len(sides), squeeze=False, sharex="col")
    for i, (below, y) in enumerate(sides):
        for j, (left, x) in enumerate(sides):
            axes = grid[i, j]
            if i < j:
                axes.set_axis_off()
            elif i == j:
                axes.hist(x[good & np.isfinite(x)], bins=BINS, color=palette.SKY)
            else:
                axes.scatter(x[good], y[good], s=5, c=palette.BLUE, alpha=0.5, linewidths=0)
                axes.scatter(x[bad], y[bad], s=22, c=palette.VERMILLION, marker="x", label="failed")
            charts.fit_numbers(axes.xaxis)
            axes.tick_params(
                labelsize=7, labelbottom=i == len(sides) - 1, labelleft=j == 0 and i > 0
            )
            axes.set_xlabel(left if i == len(sides) - 1 else "", fontsize=8)
            axes.set_ylabel(below if j == 0 else "", fontsize=8)
    return figure


def fan(
    sweep: Sweep,
    outputs: Sequence[str] = (),
    title: str = "",
    across: str = "time [s]",
    display: DisplayUnits = SI,
) -> Figure:
    """Histories of outputs over all members: the median, and bands that hold half, nine tenths and
    all of them.

    `across` is the label of their common axis, along which the times of every member have to rise.
    """
    across, clock = display.head(across, sweep.times)
    sweep = replace(read_in(sweep, display), times=sweep.times / clock)
    chosen = choose_outputs(sweep, outputs, MOST_OUTPUTS)
    figure, grid = charts.stack(len(chosen), headed(title, chosen, sweep.columns), across)
    for axes, output in zip(grid.flat, chosen, strict=False):
        times, values = align(sweep.times, sweep.columns[output])
        for low, high, name, alpha in BANDS:
            edges = np.quantile(values, [low, high], axis=0)
            axes.fill_between(
                times, *edges, color=palette.BLUE, alpha=alpha, linewidth=0, label=name
            )
        axes.plot(
            times, np.quantile(values, 0.5, axis=0), color=palette.BLACK, lw=1.2, label="median"
        )
        axes.set_ylabel(add_unit(output, sweep.units.get(output, "")))
        charts.rule(axes)
        axes.margins(x=0.0)
    charts.legend_below(figure)
    return figure


def read_in(sweep: Sweep, display: DisplayUnits) -> Sweep:
    """The sweep with parameters and outputs in the units in which people read them."""
    known = [charts.read_parameter(one, display) for one in sweep.parameters]
    found = {
        name: display.find(sweep.units.get(name, ""), largest_of(values))
        for name, values in sweep.columns.items()
    }
    return replace(
        sweep,
        parameters=tuple(one for one, _ in known),
        points=sweep.points / np.array([size for _, size in known]),
        columns={name: values / found[name][1] for name, values in sweep.columns.items()},
        ends={name: values / found[name][1] for name, values in sweep.ends.items()},
        units={name: unit for name, (unit, _) in found.items()},
    )


def choose_kind(output: str, kinds: Mapping[str, Any]) -> tuple[str, Any]:
    """What is known of the last value of an output, or of another one, which is named, where that
    does not vary.
    """
    kind = "final" if "final" in kinds else next(iter(kinds))
    return output if kind == "final" else f"{output} {kind}", kinds[kind]


def sensitivity(indices: Mapping[str, Any], title: str = "") -> Figure:
    """Sobol indices of last values of outputs, or of those named, alone and with all other
    parameters, with two standard errors.
    """
    chosen = dict(choose_kind(name, kinds) for name, kinds in indices.items())
    shown = dict(list(chosen.items())[:MOST_OUTPUTS])
    names = list(next(iter(shown.values()))["first"])
    figure = charts.figure(7.2, 1.5 * len(shown) + 1.2, headed(title, shown, chosen))
    grid = figure.subplots(len(shown), 1, squeeze=False, sharex=True)
    places = np.arange(len(names))
    for axes, (name, one) in zip(grid[:, 0], shown.items(), strict=True):
        for shift, kind, tint, label in (
            (-0.2, "first", palette.BLUE, "alone"),
            (0.2, "total", palette.ORANGE, "with all others"),
        ):
            errors = 2.0 * np.array(list(one[f"{kind}_error"].values()))
            axes.bar(
                places + shift,
                list(one[kind].values()),
                0.38,
                yerr=errors,
                color=tint,
                label=label,
                capsize=2,
            )
        axes.set_ylabel(name)
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        charts.rule(axes, axis="y")
    grid[-1, 0].set_xticks(places, names)
    charts.legend_below(figure)
    return figure


def surfaces(
    found: Mapping[str, Mapping[str, ResponseSurface]],
    units: Mapping[str, str],
    title: str = "",
    display: DisplayUnits = SI,
) -> Figure:
    """Response surfaces of last values (largest ones of outputs that end alike) with their samples
    and errors, an output a row.

    Two parameters have a surface, others curves over each of them, all others in the middle of
    their range.
    """
    shown = {
        name: next((kind, kinds[kind]) for kind in ("final", "max", "min") if kind in kinds)
        for name, kinds in found.items()
    }
    chosen = list(shown.items())[:MOST_ROWS]
    parameters = chosen[0][1][1].parameters
    known = [charts.read_parameter(one, display) for one in parameters]
    flat = len(parameters) == 2
    columns = 1 if flat else len(parameters)
    width = 5.6 if flat else 3.1 * columns + 1.2
    height = (3.4 if flat else 2.4) * len(chosen) + 0.8
    figure = charts.figure(width, height, headed(title, chosen, shown))
    grid = figure.subplots(len(chosen), columns, squeeze=False)
    for row, (name, (kind, one)) in zip(grid, chosen, strict=True):
        label, size = display.head(add_unit(f"{name} {kind}", units.get(name, "")), one.values)
        row[0].set_title(
            f"{label}, error of unseen samples {one.rms_error / size:.2g} (q2 {one.q2:.3f})",
            fontsize=8,
            loc="left",
        )
        for number, axes in enumerate(row):
            if flat:
                draw_map(figure, axes, one, known, size)
            else:
                draw_curve(axes, one, number, known[number][1], size)
            charts.over_parameter(axes, "x", known[number][0])
            charts.rule(axes)
        if not flat:
            row[0].set_ylabel(label)
    charts.legend_below(figure)
    return figure


def draw_map(
    figure: Figure,
    axes: Axes,
    one: ResponseSurface,
    known: Sequence[tuple[Parameter, float]],
    size: float,
) -> None:
    """A surface over two parameters as colours, its samples as points in theirs; `size` is that of
    the unit of its values.
    """
    from matplotlib.ticker import MaxNLocator

    points = from_box(one.parameters, charts.through_centre(2, (0, 1), GRID))
    sizes = np.array([own for _, own in known])
    found = one.values / size
    x, y, mean = (
        values.reshape(GRID, GRID)
        for values in (*(points / sizes).T, one.predict(points)[0] / size)
    )
    low = min(mean.min(), found.min())
    high = max(mean.max(), found.max())
    shown = axes.contourf(x, y, mean, levels=np.linspace(low, high, 15), cmap="viridis")
    coloured: dict[str, Any] = {"c": found, "vmin": low, "vmax": high, "cmap": "viridis"}
    axes.scatter(
        one.points[:, 0] / sizes[0],
        one.points[:, 1] / sizes[1],
        s=14,
        edgecolors="white",
        linewidths=0.5,
        **coloured,
    )
    figure.colorbar(shown, ax=axes, ticks=MaxNLocator(charts.MOST))
    charts.over_parameter(axes, "y", known[1][0])


def draw_curve(axes: Axes, one: ResponseSurface, number: int, across: float, size: float) -> None:
    """A surface over one parameter, the others in the middle of their range, with all samples.

    `across` and `size` are those of the units of the parameter and of the values.
    """
    points = from_box(one.parameters, charts.through_centre(len(one.parameters), [number], GRID))
    mean, deviation = (values / size for values in one.predict(points))
    edges = (mean - 2 * deviation, mean + 2 * deviation)
    charts.band(
        axes, points[:, number] / across, edges, mean, ("surface", "two standard deviations")
    )
    axes.scatter(
        one.points[:, number] / across,
        one.values / size,
        s=7,
        c=palette.BLACK,
        alpha=0.4,
        linewidths=0,
        label="samples",
    )


def align(times: Array, values: Array) -> tuple[Array, Array]:
    """Histories (k, s) of all members that ran at the same instants, up to the end of the shortest."""
    there = np.isfinite(times).any(axis=1) & np.isfinite(values).any(axis=1)
    clocks = times[there]
    found = values[there]
    if np.array_equal(clocks, np.broadcast_to(clocks[0], clocks.shape)):
        return clocks[0], found
    end = np.nanmax(clocks, axis=1).min()
    common = np.linspace(0.0, end, clocks.shape[1])
    each = [
        np.interp(common, own[np.isfinite(own)], line[np.isfinite(own)])
        for own, line in zip(clocks, found, strict=True)
    ]
    return common, np.array(each)


def choose_outputs(sweep: Sweep, outputs: Sequence[str], most: int) -> list[str]:
    """The outputs to draw: those that are wanted, or the first ones that every member which ran
    has.
    """
    ran = np.array([status is Status.OK for status in sweep.status])
    for name in outputs:
        if name not in sweep.columns:
            known = ", ".join(sweep.columns) or "(there are none)"
            raise InputError(
                say(
                    "plots of a sweep",
                    f"outputs among {known}",
                    f"'{name}'{closest(name, sweep.columns)}",
                )
            )
    whole = [
        name for name, values in sweep.columns.items() if np.isfinite(values[ran]).any(axis=1).all()
    ]
    found = list(outputs) or whole[:most]
    if not found or not ran.any():
        raise InputError(
            say(
                "plots of a sweep",
                "samples that ran, with an output",
                f"{ran.sum()} with {len(whole)} outputs",
            )
        )
    return found


def headed(title: str, chosen: Sized, outputs: Sized) -> str:
    """A title that says how many of the outputs are drawn, if not all."""
    some = f"{len(chosen)} of {len(outputs)} outputs"
    return title if len(chosen) == len(outputs) else f"{title}, {some}" if title else some
