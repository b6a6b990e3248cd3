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
from ..core.values.display import DisplayUnits
from ..core.values.ranges import Parameter, Scale
from ..core.values.units import add_unit
from . import palette
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
MOST, FEWEST = 6, 2  #: even steps along an axis
ROOM = 0.75  #: of a number along an axis [inch]: seven digits and a gap
SCREEN = 90  #: dots an inch in notebooks
LETTERS = 103  #: on a line of one inch, if they are of one point; a key is as wide as seven of them


def plain(text: str) -> str:
    """A text from outside as matplotlib draws it letter by letter: no formula, and no label that is
    hidden for its underscore.
    """
    text = text.replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text


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


def stack(count: int, title: str, across: str) -> tuple[Figure, np.ndarray]:
    """A figure with `count` panels over one axis, whose label `across` is below the lowest panel of
    every column.
    """
    columns = 2 if count > 3 else 1
    rows = math.ceil(count / columns)
    found = figure(7.2 if columns == 1 else 9.2, 4.2 if count == 1 else 2.3 * rows + 0.6, title)
    grid = panels(found, count, columns, sharex=True)
    for lowest in grid.flat[count - columns : count]:
        lowest.set_xlabel(across)
        lowest.tick_params(labelbottom=True)
    return found, grid


def rule(axes: Axes, **chosen: Any) -> None:
    """Pale lines at the ticks, behind everything."""
    axes.grid(True, color="#E4E4E4", lw=0.6, **chosen)
    axes.set_axisbelow(True)


def style(number: int, **chosen: Any) -> dict[str, Any]:
    """Colour, mark and width of the curve `number` among several; what is chosen replaces it."""
    return {
        "color": palette.colour(number),
        "marker": MARKERS[number % len(MARKERS)],
        "ms": 4,
        "lw": 1.2,
    } | chosen


def dashes(number: int) -> Any:
    """The line of the curve `number` among several."""
    return DASHES[number % len(DASHES)]


def stagger(samples: int, number: int, many: int, marks: int) -> tuple[int, int]:
    """First sample and distance of some `marks` on the curve `number` of `many`, beside those of
    the others.
    """
    pace = max(samples // marks, 1)
    return pace * number // max(many, 1), pace


def level(axes: Axes, value: float | None, label: str) -> None:
    """A dotted line at a value, inside of the axes; none for None."""
    if value is None:
        return
    axes.axhline(value, color=palette.BLACK, lw=1.2, ls=(0, (1, 1.5)), label=label, zorder=1)
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, value / 2), max(high, value * 2))


def set_log(axes: Axes, side: str, low: float, high: float) -> None:
    """A log scale of the side `x` or `y` for values from low to high; below two decades with plain
    numbers that have room.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set(**{f"{side}scale": "log"})
    if high < 100.0 * low:
        axis = axes.xaxis if side == "x" else axes.yaxis
        most = fit_numbers(axis)
        for subs in ((1.0, 2.0, 3.0, 5.0), (1.0, 2.0, 5.0), (1.0, 3.0)):
            rule = LogLocator(subs=subs)
            if 1 < sum(low <= value <= high for value in rule.tick_values(low, high)) <= most:
                axis.set_major_locator(rule)
                break
        axis.set_major_formatter(FuncFormatter(lambda value, _: brief(value)))
        axis.set_minor_formatter(NullFormatter())


def read_parameter(own: Parameter, display: DisplayUnits) -> tuple[Parameter, float]:
    """A parameter in the unit in which people read it, and the size of that."""
    head, size = display.find(own.unit, max(abs(own.low), abs(own.high)))
    value = None if own.value is None else own.value / size
    return Parameter(own.name, own.low / size, own.high / size, own.scale, head, value), size


def over_parameter(axes: Axes, side: str, own: Parameter) -> None:
    """Name, unit, numbers and scale of a parameter, as it is read, along the side `x` or `y`."""
    axes.set(**{f"{side}label": add_unit(own.name, own.unit)})
    if side == "x":
        fit_numbers(axes.xaxis)
    if own.scale is Scale.LOG:
        set_log(axes, side, own.low, own.high)


def through_centre(count: int, sides: Sequence[int], along: int) -> Array:
    """Points (i, d) of the unit box of `count` parameters: a grid of `along` points a side, the
    others in the middle.
    """
    unit = np.full((along ** len(sides), count), 0.5)
    grid = np.meshgrid(*[np.linspace(0.0, 1.0, along)] * len(sides), indexing="ij")
    unit[:, list(sides)] = np.stack(grid, axis=-1).reshape(-1, len(sides))
    return unit


def band(
    axes: Axes, x: Array, edges: tuple[Array, Array], middle: Array, names: Sequence[str]
) -> None:
    """A curve within its band, over x (s,)."""
    axes.plot(x, middle, color=palette.BLUE, lw=1.4, label=names[0])
    axes.fill_between(x, *edges, color=palette.SKY, alpha=0.35, lw=0, label=names[1])


def brief(value: float) -> str:
    """A number as text, without the plus and the zeros of an exponent: 2e9."""
    digits, mark, power = f"{value:g}".partition("e")
    return digits + (f"e{int(power)}" if mark else "")


def fit_numbers(axis: Any) -> int:
    """Even steps along an axis, no more than have room beside each other; how many that are.

    Matplotlib's own rules take every number for three letters wide.
    """
    from matplotlib.ticker import MaxNLocator

    place = axis.axes.get_position()
    figure = axis.get_figure(root=True)
    length = (
        place.width * figure.get_figwidth()
        if axis.axis_name == "x"
        else place.height * figure.get_figheight()
    )
    most = min(max(FEWEST, int(length / ROOM)), MOST)
    axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]))
    return most


def positive(values: Array) -> Array:
    """Values that a log scale can show; gaps elsewhere."""
    values = np.asarray(values, float)
    return np.where(np.isfinite(values) & (values > 0), values, np.nan)


def legend_below(figure: Figure) -> None:
    """One legend for all axes, below them, as many columns as fit; a name that several have stands
    there once.
    """
    found = {
        label: handle
        for axes in figure.axes
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    if found:
        columns = fitting(list(found), figure.get_figwidth(), 9)
        figure.legend(
            found.values(),
            found,
            loc="outside lower center",
            ncols=columns,
            fontsize=9,
            frameon=False,
        )


def fitting(names: Sequence[str], width: float, size: float) -> int:
    """Columns of a legend of `names`, in letters of `size` [point], that fit into a `width` [inch]:
    one at least.
    """
    widest = max(len(name) for name in names)
    return max(1, min(len(names), int(width * LETTERS / size / (widest + 7))))
