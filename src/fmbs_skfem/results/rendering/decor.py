"""What stands around a drawn scene: title and times by Pillow, and a key by matplotlib.

The key has the colour scale or the names of bodies, the kinds of joints and arrows, a bar of round
length, and the axes as they are seen. All of it is laid beside or over the pixels afterwards, so
that no text depends on OpenGL.
"""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import MarkerStyle
from matplotlib.transforms import Affine2D
from PIL import Image, ImageDraw, ImageFont

from ...core.storage.records import dataclass
from .. import frames as frames_
from .. import palette
from ..charts import plain
from ..colour_scales import STRESSES, ColourScale
from ..frames import Mark
from ..marks import SYMBOLS
from . import camera as camera_
from .camera import Camera
from .job import PictureJob

Pixels = np.ndarray[Any, np.dtype[np.uint8]]
INK = "#404040"  #: of the bar and the axes
ROW = 0.19  #: height of a row of the key [inch]
FOOT = 4.5  #: rows of the bar and the axes
TOP = 0.92  #: of the colour scale, over the height of the key


@dataclass(frozen=True)
class Text:
    """A piece of text; `anchor` as in Pillow (l, m, r; a, m, d)."""

    words: str
    place: tuple[float, float]  #: [pixel]
    anchor: str
    height: int  #: [pixel]


@lru_cache(maxsize=16)
def _font(height: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(
        str(Path(matplotlib.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")), height
    )


def measure(words: str, height: int) -> float:
    """Width of a text of letters of a height [pixel]."""
    return _font(height).getlength(words)


def letter(image: Pixels, texts: list[Text]) -> Pixels:
    """`image` (height, width, 3) with the texts on it, each on a white halo."""
    picture = Image.fromarray(image)
    draw = ImageDraw.Draw(picture)
    for text in texts:
        halo: dict[str, Any] = {"stroke_width": max(1, text.height // 8), "stroke_fill": "white"}
        draw.text(text.place, text.words, "#000000", _font(text.height), text.anchor, **halo)
    return np.asarray(picture)


def width(job: PictureJob) -> int:
    """Width of the key [pixel]."""
    return round(0.21 * job.options.size[1]) + 24


def key(job: PictureJob, camera: Camera, height: int) -> Pixels:
    """The key beside a scene, (height, width, 3)."""
    dpi = job.options.size[1] / 7.0
    row = ROW * dpi / height
    figure = Figure(figsize=(width(job) / dpi, height / dpi), dpi=dpi, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    handles = _handles(job)
    top = TOP
    if job.scale:
        below = min(row * (FOOT + len(handles) + 2.5), 0.6)
        _draw_scale(figure.add_axes((0.10, below, 0.16, TOP - below)), job.scale)
        top = below - 1.5 * row
    if handles:
        # smaller where there are very many
        letters = 9.0 * min(1.0, (top / row - FOOT) / (len(handles) + 1))
        style: dict[str, Any] = {
            "frameon": False,
            "fontsize": letters,
            "handlelength": 1.2,
            "borderaxespad": 0.2,
        }
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, top), **style)
    foot = figure.add_axes(
        (0.0, 0.0, 1.0, FOOT * row), xlim=(0, width(job)), ylim=(0, FOOT * row * height)
    )
    foot.set_axis_off()
    _draw_foot(foot, job, camera)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _draw_scale(axes: Axes, scale: ColourScale) -> None:
    bar = axes.figure.colorbar(ScalarMappable(norm(scale), cmap(scale)), cax=axes)
    bar.ax.tick_params(labelsize=9)
    words = plain(scale.label)
    figure = bar.ax.figure
    room = 1.1 * bar.ax.get_position().height * figure.bbox.height
    letters = 10.0
    height = round(letters * figure.dpi / 72.0)
    if measure(words, height) > room:
        words = words.replace(", ", ",\n", 1)
        longest = max(measure(line, height) for line in words.split("\n"))
        letters *= min(1.0, room / longest)
    bar.set_label(words, fontsize=letters)
    if not scale.logarithmic:
        bar.formatter.set_powerlimits((-3, 3))  # type: ignore[attr-defined]
        bar.ax.yaxis.get_offset_text().set(fontsize=9, horizontalalignment="left")


def _draw_foot(axes: Axes, job: PictureJob, camera: Camera) -> None:
    """The axes as they are seen, and a bar as long as a round length along each of them, which all
    look equally long.
    """
    room = axes.get_xlim()[1]
    tall = axes.get_ylim()[1]
    arms = camera.axes[:2].T
    seen = np.linalg.norm(arms, axis=1)
    origin = np.array([0.05 * room, 0.12 * tall]) - 0.45 * tall * np.minimum(
        arms / seen.max(), 0.0
    ).min(axis=0)
    for name, arm in zip("xyz", arms[seen > 0.1] / seen.max(), strict=False):
        axes.annotate(
            "",
            origin + 0.45 * tall * arm,
            origin,
            arrowprops={"arrowstyle": "-|>", "color": INK, "shrinkA": 0, "shrinkB": 0},
        )
        x, y = origin + 0.6 * tall * arm
        axes.text(x, y, name, fontsize=9, color=INK, ha="center", va="center")
    length, text = bar(job, camera, 0.5 * room)
    axes.plot(
        [0.95 * room - length, 0.95 * room],
        [0.12 * tall] * 2,
        color=INK,
        lw=2.5,
        solid_capstyle="butt",
    )
    axes.text(0.97 * room, 0.2 * tall, text, fontsize=9, color=INK, ha="right", va="bottom")


def bar(job: PictureJob, camera: Camera, longest: float) -> tuple[float, str]:
    """Length [pixel] of the scale bar, and the round length along an axis that it stands for."""
    metres = camera.metres_per_pixel / float(np.linalg.norm(camera.axes[:2, 0]))
    unit, size = job.options.display.find("m", longest * metres)
    length = camera_.round_length(longest * metres / size)
    return length * size / metres, f"{length:g} {unit}" + "\nalong x, y, z" * (not job.planar)


def _handles(job: PictureJob) -> list[Line2D]:
    """Bodies that have colours of their own, joints, arrows, and gravity as it points in the
    picture.
    """
    names = () if job.scale else job.frames.bodies
    found = [
        Line2D([], [], color=palette.colour(i), lw=4, label=plain(name))
        for i, name in enumerate(names)
    ]
    for kind, mark in {mark.kind: mark for mark in frames_.acting(job.frames).values()}.items():
        marker: Any = SYMBOLS[kind].marker
        size = 8 if mark.is_joint else 10
        if kind == "gravity":
            marker = turned(marker, mark, job.planar)
            size = 13
        found.append(
            Line2D([], [], color=SYMBOLS[kind].colour, ms=size, marker=marker, ls="", label=kind)
        )
    return found


def turned(marker: str, mark: Mark, planar: bool) -> MarkerStyle:
    """The marker of an arrow to the right, along the largest direction of a mark in the picture; a
    dot along the line of sight.
    """
    size = np.linalg.norm(mark.directions, axis=1)
    across, along, _ = camera_.axes(planar) @ mark.directions[size.argmax()] / size.max()
    seen = math.hypot(across, along) > 0.1
    return MarkerStyle(
        marker if seen else r"$\odot$", transform=Affine2D().rotate(math.atan2(along, across))
    )


def norm(scale: ColourScale) -> Normalize:
    """From values to [0, 1]."""
    return (LogNorm if scale.logarithmic else Normalize)(*scale.limits, clip=True)


def cmap(scale: ColourScale) -> ListedColormap:
    """The colour map without its palest end, where that is yellow; unloaded plates stay pale behind
    their outline.
    """
    name = "coolwarm" if scale.diverges else "YlOrRd" if scale.field in STRESSES else "viridis"
    return ListedColormap(
        matplotlib.colormaps[name](np.linspace(0.0, 0.93 if name == "viridis" else 1.0, 256))
    )
