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
#: axes of a picture in space: x to the right, y behind it, seen from 25 degrees above
VIEW = np.array([[0.8, 0.6, 0.0], [-0.2536, 0.3381, 0.9063]])


def figure(forces: Mapping[str, LineForces], title: str = "", display: DisplayUnits = SI) -> Figure:
    """The diagrams of lines by name, a panel for each force that one of them has; InputError for no
    line.
    """
    if not forces:
        raise InputError(say("diagram", "a scene with a cable or a beam", "none"))
    every = np.concatenate([one.points for one in forces.values()])
    size = float(np.linalg.norm(np.ptp(every, axis=0)))
    large = {
        name: max(largest_of(one.diagrams[name].values) for one in having)
        for name in UNITS
        if (having := [one for one in forces.values() if name in one.diagrams])
    }
    # moments beside forces by the size of the frame
    arms = {name: 1.0 if UNITS[name] == "N" else size for name in large}
    least = NOTHING * max(large[name] / arms[name] for name in large)
    wide, high = np.ptp(every @ view_of(every).T, axis=0) + 2.5 * HEIGHT * size
    many = len(large)
    columns = min(many, 3 if wide < WIDE * high else 2 if many > 3 else 1)
    height = float(np.clip(4.6 * high / wide, 1.5, 5.5))
    found = charts.figure(4.6 * columns, height * -(-many // columns) + 0.4, title)
    grid = charts.panels(found, many, columns).flat
    for axes, (name, largest) in zip(grid, large.items(), strict=False):
        unit, measure = display.find(UNITS[name], largest)
        drawn = largest > least * arms[name]
        panel(axes, forces, name, HEIGHT * size / largest if drawn else 0.0, measure, size)
        axes.set_title(add_unit(name, unit) if drawn else f"{name} = 0", fontsize=11, pad=12)
    return found


def panel(
    axes: Axes,
    forces: Mapping[str, LineForces],
    name: str,
    scale: float,
    measure: float,
    size: float,
) -> None:
    """One force on all lines, in a `scale` [m/N, 1/N], 0 where it is nothing; numbers in a unit of
    the size `measure`.
    """
    lines = [one.points for one in forces.values()]
    drawn = [one for one in forces.values() if scale and name in one.diagrams]
    across = [
        scale * found.values[:, None] * found.directions
        for found in (one.diagrams[name] for one in drawn)
    ]
    tips = [one.points + own for one, own in zip(drawn, across, strict=True)]
    view = view_of(np.concatenate([*lines, *tips]))
    for points in lines:
        axes.plot(*(points @ view.T).T, color=palette.BLACK, lw=1.6, zorder=3)
    numbers = []
    for one, tip, own in zip(drawn, tips, across, strict=True):
        values = one.diagrams[name].values
        fill(axes, one.points @ view.T, tip @ view.T, values)
        alike = np.ptp(values) <= ALIKE * largest_of(values)
        chosen = [len(values) // 2] if alike else [int(values.argmax()), int(values.argmin())]
        numbers += [(float(values[k]), tip[k] @ view.T, own[k] @ view.T) for k in chosen]
    write(axes, numbers, measure, size)
    axes.set_aspect("equal")
    axes.margins(0.08, 0.1)
    axes.set_axis_off()


def view_of(points: Array) -> Array:
    """Axes (2, 3) of the picture of points (i, 3): x, y, else x, z, else y, z where all are in such
    a plane, else those from above.
    """
    thick = np.ptp(points, axis=0) <= FLAT * np.linalg.norm(np.ptp(points, axis=0))
    normal = next((k for k in (2, 1, 0) if thick[k]), None)
    return VIEW if normal is None else np.delete(np.eye(3), normal, axis=0)


def fill(axes: Axes, line: Array, tips: Array, values: Array) -> None:
    """The area between a line and its tips (x, 2), coloured by the sign of its values (x,), with
    some ordinates.
    """
    positive = values[:-1] + values[1:] >= 0.0
    for part in np.split(np.arange(len(positive)), np.flatnonzero(np.diff(positive)) + 1):
        own = slice(part[0], part[-1] + 2)
        tint = palette.BLUE if positive[part[0]] else palette.VERMILLION
        axes.fill(*np.concatenate([line[own], tips[own][::-1]]).T, color=tint, alpha=0.25, lw=0.0)
        axes.plot(*tips[own].T, color=tint, lw=1.3)
    for k in np.linspace(0, len(line) - 1, ORDINATES).round().astype(int):
        axes.plot(*np.stack([line[k], tips[k]]).T, color=palette.GREY, lw=0.5)


def write(
    axes: Axes, numbers: Sequence[tuple[float, Array, Array]], measure: float, size: float
) -> None:
    """Values beside their tips and along their ordinates (2,), the largest first; not those that
    are small beside it, that stand on others, or say what one close by says.
    """
    shown: list[tuple[float, Array]] = []
    ordered = sorted(numbers, key=lambda one: -abs(one[0]))
    for value, at, across in ordered:
        most = abs(ordered[0][0])
        apart = [(abs(value) - abs(other), np.abs(at - there)) for other, there in shown]
        if abs(value) <= FAINT * most or any(
            (gap < np.array(APART) * size).all()
            or (abs(less) < ALIKE * most and np.linalg.norm(gap) < 2.0 * HEIGHT * size)
            for less, gap in apart
        ):
            continue
        shown.append((value, at))
        right, up = across / (np.linalg.norm(across) or 1.0)
        beside: dict[str, Any] = {
            "textcoords": "offset points",
            "ha": "left" if right > 0.5 else "right" if right < -0.5 else "center",
            "va": "bottom" if up > 0.5 else "top" if up < -0.5 else "center",
            "bbox": {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5},
        }
        x, y = at.tolist()
        axes.annotate(
            f"{value / measure:.4g}", (x, y), (5.0 * right, 5.0 * up), fontsize=9, **beside
        )
