r"""Diagrams of section forces, as in textbooks: drawn on the undeformed lines, filled, with their
extreme values.

    p(s) = r0(s) + a f(s) d(s),    a = HEIGHT L / max |f|

of a force f with its direction d across the line (`measures.section_diagrams`), in one panel for
each force; L is the size of all lines. Moments are on the side that they stretch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, say
from ..core.values.display import SI, DisplayUnits, largest_of
from ..core.values.units import add_unit
from ..systems.measures.section_diagrams import UNITS, LineForces
from . import charts, palette
from .frames import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT = 0.16  #: of the largest force, over the size of the frame
NOTHING = 1e-6  #: of the largest force of all, by which one is drawn as zero
ALIKE = 1e-3  #: of the largest value, by which two are one number in a diagram
FAINT = 0.01  #: of the largest value, below which one is not written
APART = (0.12, 0.04)  #: of the size of the frame, across and upwards, that a number takes
FLAT = 1e-6  #: of its size, by which a frame is in a plane
ORDINATES = 9  #: lines across a filled diagram
WIDE = 2.0  #: times its height, from which the panels of a frame stand in fewer columns
MOST = 40  #: numbers in a panel
#: axes of a picture in space: x to the right, y behind it, seen from 25 degrees above
VIEW = np.array([[0.8, 0.6, 0.0], [-0.2536, 0.3381, 0.9063]])


def figure(forces: Mapping[str, LineForces], title: str = "", display: DisplayUnits = SI) -> Figure:
    """The diagrams of lines by name, a panel for each force that one of them has; InputError for no
    line.
    """
    if not forces:
        expected = "a scene with a cable or a beam"
        raise InputError(say("diagram", expected, "none", "draw plates with fmbs render alone"))
    names = [name for name in UNITS if any(name in one.diagrams for one in forces.values())]
    every = np.concatenate([one.points for one in forces.values()])
    size = float(np.linalg.norm(np.ptp(every, axis=0)))
    large = {name: largest(forces, name) for name in names}
    # moments beside forces by the size of the frame
    strongest = max(large[name] / (1.0 if UNITS[name] == "N" else size) for name in names)
    flat = flat_view([(one.points, np.zeros_like(one.points)) for one in forces.values()])
    wide, high = np.ptp(every @ flat.T, axis=0) + 2.5 * HEIGHT * size
    many = len(names)
    columns = min(many, 3 if wide < WIDE * high else 2 if many > 3 else 1)
    height = float(np.clip(4.6 * high / wide, 1.5, 5.5))
    found = charts.figure(4.6 * columns, height * -(-many // columns) + 0.4, title)
    for axes, name in zip(charts.panels(found, len(names), columns).flat, names, strict=False):
        size_of_force = strongest * (1.0 if UNITS[name] == "N" else size)
        silent = large[name] <= NOTHING * size_of_force
        panel(axes, forces, name, 0.0 if silent else HEIGHT * size / large[name], size, display)
    return found


def largest(forces: Mapping[str, LineForces], name: str) -> float:
    """The largest size of a force on all lines."""
    return max(largest_of(one.diagrams[name].values) for one in having(forces, name).values())


def having(forces: Mapping[str, LineForces], name: str) -> dict[str, LineForces]:
    """The lines that have a force."""
    return {line: one for line, one in forces.items() if name in one.diagrams}


def panel(
    axes: Axes,
    forces: Mapping[str, LineForces],
    name: str,
    scale: float,
    size: float,
    display: DisplayUnits,
) -> None:
    """One force on all lines, in a `scale` [m/N, 1/N]; 0 where it is nothing."""
    own = having(forces, name)
    tips = {line: scale * ordinates(one, name) for line, one in own.items()}
    view = flat_view(
        [(one.points, tips.get(line, 0.0 * one.points)) for line, one in forces.items()]
    )
    unit, measure = display.find(UNITS[name], largest(forces, name))
    for one in forces.values():
        axes.plot(*(one.points @ view.T).T, color=palette.BLACK, lw=1.6, zorder=3)
    numbers: list[tuple[Array, Array, float]] = []
    for line, one in own.items() if scale else ():
        fill(
            axes, one.points @ view.T, (one.points + tips[line]) @ view.T, one.diagrams[name].values
        )
        numbers += extremes(one, name, tips[line], view)
    write(axes, numbers, measure, size)
    axes.set_title(add_unit(name, unit) if scale else f"{name} = 0", fontsize=11, pad=12)
    axes.set_aspect("equal")
    axes.margins(0.08, 0.1)
    axes.set_axis_off()


def ordinates(one: LineForces, name: str) -> Array:
    """f d (x, 3) of a line."""
    diagram = one.diagrams[name]
    return diagram.values[:, None] * diagram.directions


def flat_view(shown: Sequence[tuple[Array, Array]]) -> Array:
    """Axes (2, 3) of the picture of points and what is drawn beside them: those of their plane where
    they are in one, upright in it; else a view from above.
    """
    points = np.concatenate([part for at, beside in shown for part in (at, at + beside)])
    _, spread, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if spread[2] > FLAT * spread[0]:
        return VIEW
    # of a straight line any plane through it; that of x, y, else of x, z, else of y, z
    straight = spread[1] <= FLAT * spread[0]
    for normal in np.eye(3)[[2, 1, 0]]:
        tilt = normal @ axes[0] if straight else np.linalg.norm(axes[:2] @ normal)
        if abs(tilt) < FLAT:
            return np.eye(3)[np.flatnonzero(normal == 0.0)]
    return VIEW


def fill(axes: Axes, line: Array, tips: Array, values: Array) -> None:
    """The area between a line and its tips (x, 2), coloured by the sign of its values (x,), with
    some ordinates.
    """
    from matplotlib.collections import LineCollection

    positive = values[:-1] + values[1:] >= 0.0
    turns = np.flatnonzero(np.diff(positive)) + 1
    for part in np.split(np.arange(len(positive)), turns):
        own = slice(part[0], part[-1] + 2)
        tint = palette.BLUE if positive[part[0]] else palette.VERMILLION
        area = np.concatenate([line[own], tips[own][::-1]])
        axes.fill(*area.T, color=tint, alpha=0.25, lw=0.0)
        axes.plot(*tips[own].T, color=tint, lw=1.3)
    some = np.unique(np.linspace(0, len(line) - 1, ORDINATES).round().astype(int))
    across = np.stack([line[some], tips[some]], axis=1)
    axes.add_collection(LineCollection(list(across), colors=palette.GREY, linewidths=0.5))


def extremes(
    one: LineForces, name: str, tips: Array, view: Array
) -> list[tuple[Array, Array, float]]:
    """Tips, their ordinates (2,) and values of the largest and the smallest value of a line; where
    all are alike, of its middle.
    """
    values = one.diagrams[name].values
    if np.ptp(values) <= ALIKE * largest_of(values):
        chosen = [len(values) // 2]
    else:
        chosen = [int(values.argmax()), int(values.argmin())]
    across = tips @ view.T
    at = one.points @ view.T + across
    return [(at[k], across[k], float(values[k])) for k in chosen]


def write(
    axes: Axes, numbers: Sequence[tuple[Array, Array, float]], measure: float, size: float
) -> None:
    """Values beside their tips, the largest first; one that is nothing beside it, and one that is
    written close by, is left out.
    """
    ordered = sorted(numbers, key=lambda one: -abs(one[2]))
    shown: list[tuple[Array, float]] = []
    for at, across, value in ordered[:MOST]:
        most = abs(ordered[0][2])
        again = any(
            np.all(np.abs(at - other) < np.array(APART) * size)
            or (
                abs(abs(value) - abs(number)) < ALIKE * most
                and np.linalg.norm(at - other) < 2.0 * HEIGHT * size
            )
            for other, number in shown
        )
        if again or abs(value) <= FAINT * most:
            continue
        shown.append((at, value))
        length = float(np.linalg.norm(across))
        aim = across / length if length else np.array([0.0, 1.0])
        beside: dict[str, Any] = {
            "textcoords": "offset points",
            "ha": "left" if aim[0] > 0.5 else "right" if aim[0] < -0.5 else "center",
            "va": "bottom" if aim[1] > 0.5 else "top" if aim[1] < -0.5 else "center",
        }
        beside["bbox"] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
        (x, y), (right, above) = at.tolist(), (5.0 * aim).tolist()
        axes.annotate(f"{value / measure:.4g}", (x, y), xytext=(right, above), fontsize=9, **beside)
