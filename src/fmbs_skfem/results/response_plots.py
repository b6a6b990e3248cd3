"""Figures of what a mechanism does near a state: magnitudes of transfer functions, Campbell
diagrams.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, say
from ..core.values.display import SI, DisplayUnits
from . import charts, palette
from .charts import plain
from .frames import Array
from .plots import PANELS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def magnitudes(
    frequencies: Array, curves: Mapping[str, Mapping[str, Array]], title: str = ""
) -> Figure:
    """|H| over frequencies (s,) [Hz], both by decades, a panel each: label with unit -> {input:
    (s,) complex}.
    """
    if not 0 < len(curves) <= PANELS:
        raise InputError(say("plots: transfer functions", f"1 to {PANELS} outputs", len(curves)))
    figure, grid = charts.stack(len(curves), title, "frequency [Hz]")
    for axes, (label, found) in zip(grid.flat, curves.items(), strict=False):
        for number, (name, values) in enumerate(found.items()):
            axes.loglog(
                frequencies,
                charts.positive(np.abs(values)),
                label=plain(name),
                **charts.style(number, marker=""),
            )
        axes.set_ylabel(plain(label))
        charts.rule(axes, which="both")
    charts.legend_below(figure)
    return figure


def campbell(
    values: Array,
    frequencies: Array,
    unstable: np.ndarray,
    label: str,
    orders: int = 0,
    title: str = "",
    display: DisplayUnits = SI,
) -> Figure:
    """Frequencies (s, i) [Hz] over a parameter (s,), `unstable` ones marked; lines of `orders`
    multiples of it [rad/s].
    """
    label, size = display.head(label, values)
    read = values / size
    figure = charts.figure(7.2, 4.8, title)
    axes = figure.subplots()
    for k, column in enumerate(frequencies.T):
        axes.plot(read, column, label=f"mode {k + 1}", **charts.style(k, marker=""))
    if unstable.any():
        across = np.broadcast_to(read[:, None], unstable.shape)
        axes.plot(
            across[unstable],
            frequencies[unstable],
            "x",
            color=palette.BLACK,
            ms=5,
            label="unstable",
            ls="",
        )
    top = 1.05 * float(frequencies.max())
    for order in range(1, orders + 1):
        axes.plot(
            read,
            order * values / (2.0 * np.pi),
            color=palette.GREY,
            lw=1.0,
            ls=(0, (4, 3)),
            zorder=1,
        )
        end = min(float(values[-1]), top * 2.0 * np.pi / order)
        over = end < float(values[-1])
        # outside of the axes, where no curve runs through it
        beside: dict[str, Any] = {
            "xytext": (0, 3) if over else (4, 0),
            "ha": "center" if over else "left",
        }
        beside |= {
            "va": "bottom" if over else "center",
            "textcoords": "offset points",
            "annotation_clip": False,
        }
        axes.annotate(
            f"{order} x",
            (end / size, order * end / (2.0 * np.pi)),
            color=palette.GREY,
            fontsize=9,
            **beside,
        )
    axes.set_ylim(0.0, top)
    axes.set_xlim(float(read[0]), float(read[-1]))
    axes.set_xlabel(plain(label))
    axes.set_ylabel("frequency [Hz]")
    charts.fit_numbers(axes.xaxis)
    charts.rule(axes)
    charts.legend_below(figure)
    return figure
