"""Figures of what a mechanism does near a state: magnitudes of transfer functions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import InputError, say
from . import charts
from .decor import plain
from .frames import Array
from .plots import PANELS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def magnitudes(frequencies: Array, curves: Mapping[str, Mapping[str, Array]], title: str = "") -> Figure:
    """|H| over frequencies (s,) [Hz], both by decades, a panel each: label with unit -> {input: (s,) complex}."""
    if not 0 < len(curves) <= PANELS:
        raise InputError(say("plots: transfer functions", f"1 to {PANELS} outputs", len(curves)))
    columns = 1 if len(curves) < 4 else 2
    rows = math.ceil(len(curves) / columns)
    figure = charts.figure(7.2 if columns == 1 else 9.2, 4.2 if rows == 1 else 2.3 * rows + 0.6, title)
    grid = charts.panels(figure, len(curves), columns, sharex=True)
    order = [plain(name) for name in dict.fromkeys(name for found in curves.values() for name in found)]
    for axes, (label, found) in zip(grid.flat, curves.items(), strict=False):
        for number, values in enumerate(found.values()):
            axes.loglog(frequencies, charts.positive(np.abs(values)), label=order[number], **charts.style(number, marker=""))
        axes.set_ylabel(plain(label))
        charts.rule(axes, which="both")
    for column in range(columns):
        shown = grid[(len(curves) - 1 - column) // columns, column]
        shown.set_xlabel("frequency [Hz]")
        shown.tick_params(labelbottom=True)
    charts.legend_below(figure, order, list(grid.flat[: len(curves)]))
    return figure
