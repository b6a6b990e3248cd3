"""Lettering around a drawn scene: axis numbers, times and title by Pillow, colour scale and key by matplotlib.

All of it is laid over the pixels afterwards, at places that `camera.project` gives, so that no text depends on OpenGL.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.storage.records import dataclass
from .. import palette
from ..frames import Array
from . import camera as camera_
from .camera import Box, Camera
from .job import PictureJob

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from PIL.ImageFont import FreeTypeFont

Pixels = np.ndarray[Any, np.dtype[np.uint8]]

DARK, PALE, DRIVEN, VIOLET, BRASS = "#303030", "#7F7F7F", "#A83200", "#8A63D2", "#8C6D1F"
#: joint kind -> (marker of the key, colour), no two alike; driven joints stand out
GLYPHS = {
    "revolute joint": ("o", DARK),
    "spherical joint": ("o", VIOLET),
    "universal joint": ("P", DARK),
    "gear": ("h", DARK),
    "joint": ("p", DARK),
    "clamp": ("s", DARK),
    "weld": ("D", DARK),
    "held edge": ("s", VIOLET),
    "prismatic joint": ("d", DARK),
    "cylindrical joint": ("d", VIOLET),
    "bushing": ("D", PALE),
    "latch": ("D", DRIVEN),
    "distance": ("o", PALE),
    "slider": ("d", PALE),
    "driven angle": ("^", DRIVEN),
    "driven position": (">", DRIVEN),
    "point mass": ("o", BRASS),
}
#: arrow kind -> (marker of the key, colour)
ARROWS = {
    "force": (r"$\rightarrow$", "#B00058"),
    "moment": (r"$\circlearrowleft$", "#B00058"),
    "gravity": (r"$\downarrow$", "#1F6FA8"),
    "axis": ("_", "#5A5A5A"),
}
WORDS = {"axis": "joint axis"}  #: kinds of arrows that have another name in the key


@dataclass(frozen=True)
class Text:
    """A piece of text; `anchor` as in Pillow (l, m, r; a, m, d)."""

    words: str
    place: tuple[float, float]  #: [pixel]
    anchor: str
    height: int  #: [pixel]
    tint: str = "#404040"


@lru_cache(maxsize=16)
def _font(height: int) -> FreeTypeFont:
    import matplotlib
    from PIL import ImageFont

    return ImageFont.truetype(str(Path(matplotlib.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")), height)


def plain(text: str) -> str:
    """A text from outside as matplotlib draws it letter by letter: no formula, and no label that is hidden for its underscore."""
    text = text.replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text


def extent(text: Text) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of a text as it is drawn [pixel], without what shifts it into the picture."""
    from PIL import Image, ImageDraw

    return ImageDraw.Draw(Image.new("L", (1, 1))).textbbox(text.place, text.words, font=_font(text.height), anchor=text.anchor)


def letter(image: Pixels, texts: list[Text]) -> Pixels:
    """`image` (height, width, 3) with the texts on it, each on a white halo.

    A text is shifted into the picture, and left out where it would cover an earlier one.
    """
    from PIL import Image, ImageDraw

    picture = Image.fromarray(image)
    draw = ImageDraw.Draw(picture)
    taken: list[tuple[float, float, float, float]] = []
    for text in texts:
        font, halo = _font(text.height), max(1, text.height // 8)
        x0, y0, x1, y1 = draw.textbbox(text.place, text.words, font=font, anchor=text.anchor)
        shift = min(picture.width - 2 - x1, 0.0) + max(2 - x0, 0.0)
        left, top, right, bottom = x0 + shift - 2 * halo, y0 - halo, x1 + shift + 2 * halo, y1 + halo
        if any(left < r and a < right and top < b and t < bottom for a, t, r, b in taken):
            continue
        taken.append((left, top, right, bottom))
        place = (text.place[0] + shift, text.place[1])
        draw.text(place, text.words, text.tint, font, text.anchor, stroke_width=halo, stroke_fill="white")
    return np.asarray(picture)


def axis_texts(camera: Camera, box: Box, planar: bool, height: int) -> list[Text]:
    """Numbers along the axes and their names with the unit."""
    lower, upper = box.lower, box.upper
    gap = 0.6 * height
    if planar:
        edges = [(0, lower, (0.0, gap), "ma"), (1, lower, (-gap, 0.0), "rm")]
    else:
        front = np.array([upper[0], lower[1], lower[2]])
        edges = [(0, front, (-gap, gap), "ra"), (1, front, (gap, gap), "la"), (2, lower, (-gap, 0.0), "rm")]
    texts: list[Text] = []
    for axis, corner, (dx, dy), anchor in edges:
        values = camera_.ticks(box, axis)
        places = np.repeat(corner[None], values.size, axis=0)
        places[:, axis] = values
        pixels = camera_.project(camera, places)
        texts.append(_axis_name(axis, pixels, (dx, dy), height))
        texts += [
            Text(f"{round(value / box.step) * box.step:g}", (x + dx, y + dy), anchor, height)
            for value, (x, y) in zip(values, pixels, strict=True)
        ]
    return texts


def _axis_name(axis: int, pixels: Array, gap: tuple[float, float], height: int) -> Text:
    """The name of an axis, outside its numbers: beside the middle of slanting and level axes, above upright ones."""
    name = f"{'xyz'[axis]} [m]"
    (x0, y0), (x1, y1) = pixels[0], pixels[-1]
    if abs(x1 - x0) < 1e-6 * abs(y1 - y0):
        return Text(name, (x1 + gap[0], min(y0, y1) - 1.1 * height), "rd", height)
    centre, sideways = ((x0 + x1) / 2, (y0 + y1) / 2), np.sign(gap[0])
    return Text(name, (centre[0] + 2.6 * height * sideways, centre[1] + 2.1 * height), "ma" if sideways == 0 else "mm", height)


def strip(job: PictureJob, width: int, height: int) -> Pixels:
    """The key beside the scene, (height, width, 3): colour scale or names of bodies, then the kinds of joints."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    dpi = job.look.size[1] / 7.0
    figure = Figure(figsize=(width / dpi, height / dpi), dpi=dpi, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    if job.look.label:
        below = 0.36 * job.look.size[1] / height  # the key has its room below the scale, however low the picture is
        _scale(figure.add_axes((0.10, below, 0.16, 0.92 - below)), job)
    _key(figure.add_axes((0.0, 0.04, 1.0, 0.26 * job.look.size[1] / height if job.look.label else 0.9)), job)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _scale(axes: Axes, job: PictureJob) -> None:
    from matplotlib.cm import ScalarMappable

    bar = axes.figure.colorbar(ScalarMappable(norm(job), cmap(job)), cax=axes)
    bar.ax.tick_params(labelsize=9)
    bar.set_label(plain(job.look.label), fontsize=10)
    if not job.look.logarithmic:
        bar.formatter.set_powerlimits((-3, 3))  # type: ignore[attr-defined]
        bar.ax.yaxis.get_offset_text().set(fontsize=9, horizontalalignment="left")


def _key(axes: Axes, job: PictureJob) -> None:
    from matplotlib.lines import Line2D

    axes.set_axis_off()
    names = () if job.look.label else job.bodies
    handles = [Line2D([], [], color=palette.colour(i), lw=4, label=plain(name)) for i, name in enumerate(names)]
    for kind in dict.fromkeys(job.kinds):
        marker, tint = GLYPHS[kind]
        handles.append(Line2D([], [], color=tint, marker=marker, ls="", ms=8, label=kind))
    for kind in dict.fromkeys(job.arrows):
        marker, tint = ARROWS[kind]
        handles.append(Line2D([], [], color=tint, marker=marker, ls="", ms=10, label=WORDS.get(kind, kind)))
    if handles:
        axes.legend(handles=handles, loc="upper left", frameon=False, fontsize=9, handlelength=1.2, borderaxespad=0.2)


def norm(job: PictureJob) -> Any:
    """From values to [0, 1]."""
    from matplotlib.colors import LogNorm, Normalize

    return LogNorm(*job.limits, clip=True) if job.look.logarithmic else Normalize(*job.limits, clip=True)


def cmap(job: PictureJob) -> Any:
    """Blue to red through grey for fields of both signs, for the others the order's own or viridis without its palest end."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    if job.diverging:
        return matplotlib.colormaps["coolwarm"]
    if job.colours:
        return matplotlib.colormaps[job.colours]
    return ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.0, 0.93, 256)))
