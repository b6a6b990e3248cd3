"""One picture a group of verification cases: differences of all quantities, errors of convergence
studies, load paths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fmbs_skfem.core.errors import InputError, say
from fmbs_skfem.results import charts, palette

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 3  #: axes a row
FLOOR = 1e-16  #: a smaller difference is drawn here
KEYS = 3  #: keys that need a decade of room

Dots = Sequence[tuple[float, float]]  #: (difference, tolerance), both relative
Curve = tuple[tuple[float, float], ...]  #: (mesh size or step, error)


class LoadPath(NamedTuple):
    """Equilibria of growing and falling loads beside those of a table: (displacement, load)."""

    ours: Curve
    table: Curve
    displacement: str  #: label with unit
    load: str


def group(
    title: str,
    differences: Mapping[str, Dots],
    curves: Mapping[str, Mapping[str, Curve | LoadPath]],
) -> Figure:
    """Differences of every case, then axes for every case with curves: errors log-log with the
    observed orders, or load paths.
    """
    if not differences:
        raise InputError(say("verification plots", "at least one case", "none"))
    panels: list[Callable[[Axes], None]] = []
    for name, found in curves.items():
        errors = {label: curve for label, curve in found.items() if not isinstance(curve, LoadPath)}
        paths = {label: curve for label, curve in found.items() if isinstance(curve, LoadPath)}
        panels += [partial(_orders, name=name, curves=errors)] if errors else []
        panels += [partial(_paths, name=name, paths=paths)] if paths else []
    rows, top = math.ceil(len(panels) / COLUMNS), 0.27 * len(differences) + 0.9
    figure = charts.figure(12.0, top + 3.1 * rows + 0.4, title)
    grid = figure.add_gridspec(1 + rows, COLUMNS, height_ratios=[top, *[3.1] * rows])
    _differences(figure.add_subplot(grid[0, :]), differences)
    for number, draw in enumerate(panels):
        draw(figure.add_subplot(grid[1 + number // COLUMNS, number % COLUMNS]))
    return figure


def _differences(axes: Axes, differences: Mapping[str, Dots]) -> None:
    """A row for every case: a dot for the difference of every quantity, a bar for its tolerance."""
    for row, dots in enumerate(differences.values()):
        inside = [(max(gap, FLOOR), limit) for gap, limit in dots if math.isfinite(gap)]
        for gap, limit in inside:
            good = gap <= limit
            axes.plot([limit], [row], marker="|", ms=9, color=palette.GREY, zorder=2)
            axes.plot(
                [gap],
                [row],
                marker="o" if good else "X",
                ms=5,
                color=palette.BLUE if good else palette.VERMILLION,
                zorder=3,
            )
    axes.set_yticks(range(len(differences)), list(differences), fontsize=9)
    axes.set_ylim(len(differences) - 0.4, -0.6)
    axes.set_xscale("log")
    axes.set_xlim(FLOOR / 2, 2.0)
    axes.set_xlabel("relative difference (dot) and tolerance (bar)")
    charts.rule(axes, axis="both")


def _plain(axes: Axes, sizes: Sequence[float], below: int) -> None:
    """Whole decades of the error with some room below, and the sizes themselves (every other one of
    many) on the other axis.
    """
    low, high = axes.get_ylim()
    axes.set_ylim(
        10.0 ** (math.floor(math.log10(low)) - below), 10.0 ** math.ceil(math.log10(high))
    )
    axes.margins(x=0.2)
    axes.set_xticks(
        sizes[:: 1 + len(sizes) // 5], [f"{size:.3g}" for size in sizes[:: 1 + len(sizes) // 5]]
    )
    axes.minorticks_off()
    axes.tick_params(labelsize=8)


def _orders(axes: Axes, name: str, curves: Mapping[str, Curve]) -> None:
    """Errors over mesh size or step, log-log; the key shows the observed order."""
    for number, (label, curve) in enumerate(curves.items()):
        sizes, errors = [size for size, _ in curve], [error for _, error in curve]
        observed = math.log(errors[-2] / errors[-1]) / math.log(sizes[-2] / sizes[-1])
        key = f"{label}: {observed:.2f}"
        axes.loglog(sizes, errors, label=key, **charts.style(number))
    axes.set_title(name, fontsize=10)
    axes.set_xlabel("mesh size or step", fontsize=9)
    axes.set_ylabel("error", fontsize=9)
    _plain(
        axes, sorted({size for curve in curves.values() for size, _ in curve}), len(curves) // KEYS
    )
    axes.legend(fontsize=7, frameon=True, framealpha=0.85)
    charts.rule(axes, which="major")


def _paths(axes: Axes, name: str, paths: Mapping[str, LoadPath]) -> None:
    """Load over displacement: a line through the equilibria, rings for the table's points, the key
    above them.
    """
    first = next(iter(paths.values()))
    for number, (label, path) in enumerate(paths.items()):
        colour = palette.colour(number)
        axes.plot(*np.array(path.ours).T, color=colour, lw=1.2, label=label)
        axes.plot(
            *np.array(path.table).T, color=colour, ls="", marker="o", ms=4, mfc="white", mew=0.9
        )
    axes.plot(
        [], [], color=palette.GREY, ls="", marker="o", ms=4, mfc="white", mew=0.9, label="table"
    )
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.25 * (high - low))
    axes.set_title(name, fontsize=10)
    axes.set_xlabel(first.displacement, fontsize=9)
    axes.set_ylabel(first.load, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.legend(loc="upper center", ncols=2, fontsize=7, frameon=True, framealpha=0.85)
    charts.rule(axes)
