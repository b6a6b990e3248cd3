"""What all charts share: figures, grids of panels, pale lines at the ticks, levels, legends.

Only matplotlib's object interface on its Agg canvas: no global state, no window.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import extras
from . import palette
from .decor import plain
from .frames import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DASHES: tuple[str | tuple[int, tuple[float, ...]], ...] = (
    "-",
    (0, (6, 2)),
    (0, (2, 1.5)),
    (0, (7, 2, 1.5, 2)),
    (0, (4, 1, 1, 1, 1, 1)),
)
MARKERS = "osD^vPX*<>"
SCREEN = 90  #: dots an inch in notebooks
LETTERS = 103  #: on a line of one inch, if they are of one point; a key is as wide as seven of them


def figure(width: float, height: float, title: str = "") -> Figure:
    """An empty figure [inch], which notebooks show as they do those of pyplot."""
    extras.need("viz", "plots")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    found = Figure(figsize=(width, height), dpi=150, layout="constrained")
    FigureCanvasAgg(found)
    if title:
        found.suptitle(plain(title), fontsize=12)
    found._repr_png_ = partial(_image, found)  # type: ignore[attr-defined]
    return found


def _image(figure: Figure) -> bytes:
    """A figure as PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=SCREEN)
    return buffer.getvalue()


def panels(figure: Figure, count: int, columns: int, **shared: Any) -> np.ndarray:
    """Axes (rows, columns) for `count` panels, row by row; those after the last one are blank."""
    grid: np.ndarray = figure.subplots(math.ceil(count / columns), columns, squeeze=False, **shared)
    for axes in grid.flat[count:]:
        axes.set_axis_off()
    return grid


def stack(count: int, columns: int, title: str, across: str) -> tuple[Figure, np.ndarray]:
    """A figure with `count` panels over one axis, whose label `across` is below the lowest panel of every column."""
    rows = math.ceil(count / columns)
    found = figure(7.2 if columns == 1 else 4.6 * columns, 4.2 if count == 1 else 2.3 * rows + 0.6, title)
    grid = panels(found, count, columns, sharex=True)
    for column in range(columns):
        lowest = grid[(count - 1 - column) // columns, column] if column < count else grid[0, column]
        lowest.set_xlabel(across)
        lowest.tick_params(labelbottom=True)
    return found, grid


def rule(axes: Axes, **chosen: Any) -> None:
    """Pale lines at the ticks, behind everything."""
    axes.grid(True, color="#E4E4E4", lw=0.6, **chosen)
    axes.set_axisbelow(True)


def style(number: int, **chosen: Any) -> dict[str, Any]:
    """Colour, mark and width of the curve `number` among several; what is chosen replaces it."""
    return {"color": palette.colour(number), "marker": MARKERS[number % len(MARKERS)], "ms": 4, "lw": 1.2} | chosen


def stagger(samples: int, number: int, many: int, marks: int) -> tuple[int, int]:
    """First sample and distance of some `marks` on the curve `number` of `many`, beside those of the others."""
    pace = max(samples // marks, 1)
    return pace * number // max(many, 1), pace


def level(axes: Axes, value: float | None, label: str, tint: str = palette.GREY) -> None:
    """A dotted line at a value, inside of the axes; none for None."""
    if value is None:
        return
    axes.axhline(value, color=tint, lw=1.1, ls=(0, (1, 1.5)), label=label, zorder=1)
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, value / 2), max(high, value * 2))


def set_log(axes: Axes, side: str, low: float, high: float) -> None:
    """A log scale of the side `x` or `y` for values from low to high; below two decades with plain numbers at 1, 2, 3 and 5."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axes.set(**{f"{side}scale": "log"})
    if high < 100.0 * low:
        axis = axes.xaxis if side == "x" else axes.yaxis
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())


def positive(values: Array) -> Array:
    """Values that a log scale can show; gaps elsewhere."""
    values = np.asarray(values, float)
    return np.where(np.isfinite(values) & (values > 0), values, np.nan)


def legend_below(figure: Figure, order: Sequence[str], many: Sequence[Axes]) -> None:
    """One legend for all axes, below them, as many columns as fit."""
    found = {label: handle for axes in many for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    names = [name for name in order if name in found]
    columns = fitting(names, figure.get_figwidth(), 9)
    figure.legend([found[name] for name in names], names, loc="outside lower center", ncols=columns, fontsize=9, frameon=False)


def fitting(names: Sequence[str], width: float, size: float) -> int:
    """Columns of a legend of `names`, in letters of `size` [point], that fit into a `width` [inch]: one at least."""
    widest = max(len(name) for name in names)
    return max(1, min(len(names), int(width * LETTERS / size / (widest + 7))))
