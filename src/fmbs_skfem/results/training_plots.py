"""Figures of a greedy training: the surrogate of the indicator with its samples, errors over the
parameters, predicted errors.

Arrays in, one figure out; letters: c candidates, k samples or hold-out points. Only `slices` takes
a surrogate as it is.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..core.algebra import ranks
from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.display import SI, DisplayUnits
from ..core.values.ranges import Parameter
from ..families import kriging
from ..families.kriging import Surrogate
from ..reduction import parameters as boxes
from . import charts, palette
from .frames import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEVELS = 14  #: colours of a surface
FINE = {1: 201, 2: 61}  #: points along an axis of a curve and of a surface
BAND = ("surrogate", "two standard deviations of a run")


@dataclass(frozen=True)
class SurrogatePanel:
    """The surrogate of one iteration over the candidates, as log10 of the indicator, and the
    samples it was fitted to.
    """

    title: str
    mean: Array  #: (c,)
    std: Array  #: (c,) of a further run from it
    samples: NDArray[np.intp]  #: (k,) numbers of candidates, or of places after them
    indicators: Array  #: (k,)
    chosen: int | None = None  #: candidate of the next full run
    runs: tuple[int, ...] = ()  #: candidates with a full run, where the surrogate is not fitted


def surrogate(
    candidates: Mapping[str, Array], panels: Sequence[SurrogatePanel], label: str = "indicator"
) -> Figure:
    """The surrogate over one parameter (a curve an iteration), two (a surface an iteration) or more
    (the last, pair by pair).

    `candidates` holds the values (c,) of every parameter by its name with unit.
    """
    if not panels or not candidates:
        raise InputError(
            say(
                "plots: surrogate",
                "candidates and at least one iteration",
                f"{len(panels)} iterations",
            )
        )
    if len(candidates) > 2:
        return _pairs(candidates, panels[-1], label)
    columns = min(len(panels), 3)
    figure = charts.figure(max(4.4 * columns, 6.4), 3.6 * math.ceil(len(panels) / columns) + 0.4)
    grid = charts.panels(figure, len(panels), columns, sharex=True, sharey=True)
    draw = _curve if len(candidates) == 1 else _surface
    limits = _limits(panels)
    for axes, panel in zip(grid.flat, panels, strict=False):
        draw(axes, list(candidates.values()), panel, limits)
        axes.set_title(panel.title, fontsize=10)
    names = list(candidates)
    for axes in grid[-1]:
        axes.set_xlabel(names[0])
    for axes in grid[:, 0]:
        axes.set_ylabel(label if len(names) == 1 else names[1])
    if len(names) == 2:
        _bar(figure, list(grid.flat[: len(panels)]), limits, label)
    charts.legend_below(figure)
    return figure


def slices(
    known: Sequence[Parameter],
    model: Surrogate,
    label: str = "indicator (49)",
    title: str = "",
    display: DisplayUnits = SI,
) -> Figure:
    """A surrogate with its samples: one parameter a curve with its band, two a surface, more slices
    through the centre.

    Of more than two, curves stand on the diagonal and surfaces below; samples, which lie beside the
    slices, are projected on them.
    """
    sides = [0] if len(known) == 1 else range(len(known))
    alone = len(known) == 2
    size = 1 if alone else len(sides)
    figure = charts.figure(max(6.4, 3.2 * size + 0.8), max(4.4, 2.7 * size + 0.6), title)
    grid = figure.subplots(size, size, squeeze=False)
    pairs = [(1, 0)] if alone else [(i, j) for i in sides for j in sides if j <= i]
    cuts = {(i, j): _cut(known, model, (j,) if i == j else (j, i)) for i, j in pairs}
    limits = _limits([panel for _, panel in cuts.values()])
    read = [charts.read_parameter(one, display) for one in known]
    for (i, j), (values, panel) in cuts.items():
        axes = grid[0, 0] if alone else grid[i, j]
        shown = [
            one / read[k][1] for one, k in zip(values, (j,) if i == j else (j, i), strict=True)
        ]
        (_curve if i == j else _surface)(axes, shown, panel, limits)
        charts.over_parameter(axes, "x", read[j][0])
        if i == j:
            axes.set_ylabel(label)
        else:
            charts.over_parameter(axes, "y", read[i][0])
    for i, j in itertools.combinations(range(size), 2):
        grid[i, j].set_axis_off()
    if len(known) > 1:
        _bar(figure, list(grid.flat), limits, label)
    charts.legend_below(figure)
    return figure


def predicted(
    true: Array,
    prediction: Array,
    low: Array,
    high: Array,
    goal: float | None = None,
    label: str = "mean error",
) -> Figure:
    """True errors (k,) of hold-out points against predicted ones with their bands, log scales;
    points outside are marked.
    """
    true, prediction, low, high = (
        np.asarray(values, float) for values in (true, prediction, low, high)
    )
    usable = np.isfinite(true) & np.isfinite(prediction) & (true > 0) & (prediction > 0)
    if not usable.any():
        raise InputError(
            say(
                "plots: predicted errors",
                "at least one point with errors above zero",
                f"{len(true)} points",
            )
        )
    true = true[usable]
    prediction = prediction[usable]
    low = low[usable]
    high = high[usable]
    inside = (low <= true) & (true <= high)
    figure = charts.figure(6.2, 5.6)
    axes = figure.subplots()
    for chosen, tint, marker, text in (
        (inside, palette.BLUE, "o", "inside"),
        (~inside, palette.VERMILLION, "D", "outside"),
    ):
        if chosen.any():
            bars = np.array([true[chosen], true[chosen]])
            spans = np.clip(np.array([prediction - low, high - prediction])[:, chosen], 0.0, None)
            axes.errorbar(
                bars[0], prediction[chosen], yerr=spans, fmt=marker, ms=5, color=tint, ecolor=tint, elinewidth=0.7, capsize=2,
                label=f"{text} the stated band ({int(chosen.sum())} of {len(true)})",
            )  # fmt: skip
    ends = np.array([min(true.min(), prediction.min()), max(true.max(), prediction.max())]) * [
        0.5,
        2.0,
    ]
    axes.plot(ends, ends, color=palette.BLACK, lw=1.0, label="predicted = true")
    axes.set(xscale="log", yscale="log", xlabel=f"true {label}", ylabel=f"predicted {label}")
    charts.level(axes, goal, "tolerance")
    charts.rule(axes)
    axes.legend(fontsize=9, frameon=False)
    return figure


def _cut(
    known: Sequence[Parameter], model: Surrogate, axes: tuple[int, ...]
) -> tuple[list[Array], SurrogatePanel]:
    """The surrogate along some axes, the others at the middle of the box, and the samples there."""
    unit = charts.through_centre(len(known), axes, FINE[len(axes)])
    (mean, _) = kriging.predict(model, unit)
    std = kriging.deviation(model, unit)
    values = boxes.from_box(tuple(known), np.concatenate([unit, model.points]))
    samples = np.arange(len(unit), len(values))
    return [values[:, k] for k in axes], SurrogatePanel("", mean, std, samples, 10**model.values)


def _limits(panels: Sequence[SurrogatePanel]) -> tuple[float, float]:
    """Lowest and highest mean of all iterations, apart."""
    low = min(float(panel.mean.min()) for panel in panels)
    high = max(float(panel.mean.max()) for panel in panels)
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _curve(
    axes: Axes, values: Sequence[Array], panel: SurrogatePanel, limits: tuple[float, float]
) -> None:
    order = np.argsort(values[0][: len(panel.mean)], kind="stable")
    x = np.asarray(values[0])[order]
    mean = panel.mean[order]
    std = panel.std[order]
    edges = (10 ** (mean - 2 * std), 10 ** (mean + 2 * std))
    charts.band(axes, x, edges, 10**mean, BAND)
    found = np.isfinite(panel.indicators) & (panel.indicators > 0)
    there = np.isin(panel.samples, panel.runs)
    for mask, fill, text in (
        (found & ~there, palette.BLACK, "reduced runs"),
        (found & there, "white", "reduced runs at full runs"),
    ):
        if mask.any():
            x = values[0][np.asarray(panel.samples)[mask]]
            axes.plot(x, panel.indicators[mask], "o", mec=palette.BLACK, mfc=fill, ms=5, label=text)
    if panel.chosen is not None:
        axes.axvline(
            values[0][panel.chosen],
            color=palette.VERMILLION,
            lw=1.3,
            ls=charts.dashes(1),
            label="next full run",
        )
    if np.ptp(np.concatenate(edges)) == 0.0:
        axes.set_ylim(10 ** limits[0], 10 ** limits[1])
    axes.set_yscale("log")
    charts.rule(axes)


def _surface(
    axes: Axes,
    values: Sequence[Array],
    panel: SurrogatePanel,
    limits: tuple[float, float],
    joined: bool = True,
) -> None:
    """The mean over two parameters: a surface where points can be joined, otherwise dots, the
    largest in front.
    """
    x, y = values
    shown = slice(len(panel.mean))
    if joined and _spreads(x, y):
        axes.tricontourf(
            x[shown],
            y[shown],
            panel.mean,
            levels=np.linspace(*limits, LEVELS + 1),
            cmap="viridis",
            extend="both",
        )
    else:
        order = np.argsort(panel.mean, kind="stable")
        axes.scatter(
            x[order],
            y[order],
            c=panel.mean[order],
            vmin=limits[0],
            vmax=limits[1],
            cmap="viridis",
            s=14,
        )
    axes.plot(
        x[panel.samples],
        y[panel.samples],
        "o",
        mfc="white",
        mec=palette.BLACK,
        ms=5,
        label="reduced runs",
    )
    if panel.chosen is not None:
        axes.plot(
            x[[panel.chosen]],
            y[[panel.chosen]],
            "*",
            color=palette.VERMILLION,
            ms=15,
            mec="white",
            label="next full run",
        )


def _spreads(x: Array, y: Array) -> bool:
    """Whether points span an area, so that they can be joined to triangles."""
    return (
        len(x) >= 3 and ranks.rank(np.stack([x / np.ptp(x), y / np.ptp(y), np.ones(len(x))])) == 3
    )


def _pairs(candidates: Mapping[str, Array], panel: SurrogatePanel, label: str) -> Figure:
    """Every pair of parameters: candidates coloured by the surrogate, samples and the next full run
    marked.
    """
    names = list(candidates)
    size = len(names) - 1
    figure = charts.figure(3.0 * size + 1.2, 2.7 * size + 0.6, panel.title)
    grid = figure.subplots(size, size, squeeze=False, sharex="col", sharey="row")
    limits = _limits([panel])
    for (i, first), (j, second) in itertools.product(enumerate(names[:-1]), enumerate(names[1:])):
        axes = grid[j, i]
        if j < i:
            axes.set_axis_off()
            continue
        x, y = candidates[first], candidates[second]
        _surface(axes, (x, y), panel, limits, joined=False)
        if i == 0:
            axes.set_ylabel(second)
        if j == size - 1:
            axes.set_xlabel(first)
    _bar(figure, list(grid.flat), limits, label)
    charts.legend_below(figure)
    return figure


def _bar(figure: Figure, many: list[Axes], limits: tuple[float, float], label: str) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    colours: Any = ScalarMappable(Normalize(*limits), cmap="viridis")
    figure.colorbar(colours, ax=many, label=f"log10 of the {label}", shrink=0.9)
