"""Lettering around a drawn scene: axis numbers, times and title by Pillow, colour scale and key by matplotlib.

All of it is laid over the pixels afterwards, at places that `camera.project` gives, so that no text depends on OpenGL.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.storage.records import dataclass
from .. import palette
from . import camera as camera_
from .camera import Camera
from .job import PictureJob

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from matplotlib.markers import MarkerStyle
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
    "axis": ("_", "#5A5A5A"),
}
GRAVITY = "#1F6FA8"
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


def axis_texts(camera: Camera, planar: bool, height: int) -> list[Text]:
    """Numbers along the axes and their names with the unit, those a line below the numbers in the middle, above upright axes."""
    lower, upper, gap = camera.box.lower, camera.box.upper, 0.6 * height
    if planar:
        edges = [(0, lower, (0.0, gap), "ma"), (1, lower, (-gap, 0.0), "rm")]
    else:
        front = np.array([upper[0], lower[1], lower[2]])
        edges = [(0, front, (-gap, gap), "ra"), (1, front, (gap, gap), "la"), (2, lower, (-gap, 0.0), "rm")]
    texts: list[Text] = []
    for axis, corner, shift, anchor in edges:
        values = np.linspace(lower[axis], upper[axis], camera.box.cells[axis] + 1)
        places = np.repeat(corner[None], values.size, axis=0)
        places[:, axis] = values
        pixels = camera_.project(camera, places) + shift
        (x, y), place = (pixels[-1], "rd") if anchor == "rm" else (pixels[[0, -1]].mean(axis=0), anchor)
        texts.append(
            Text(
                f"{'xyz'[axis]} [{camera.box.unit}]",
                (float(x), float(y + (-1.1 if place == "rd" else 1.6) * height)),
                place,
                height,
            )
        )
        numbers = np.round(values / camera.box.step) * camera.box.step / camera.box.scale + 0.0  # without the sign of -0
        texts += [Text(f"{number:g}", (float(x), float(y)), anchor, height) for number, (x, y) in zip(numbers, pixels, strict=True)]
    return texts


def strip(job: PictureJob, width: int, height: int) -> Pixels:
    """The key beside the scene, (height, width, 3): colour scale or names of bodies, then the kinds of joints and arrows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    dpi = job.look.size[1] / 7.0
    figure = Figure(figsize=(width / dpi, height / dpi), dpi=dpi, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    if job.look.label:
        below = 0.36 * job.look.size[1] / height  # the key has its room below the scale, however low the picture is
        _scale(figure.add_axes((0.10, below, 0.16, 0.92 - below)), job)
    top = 0.04 + (0.26 * job.look.size[1] / height if job.look.label else 0.9)
    if handles := _handles(job):
        style: dict[str, Any] = {"frameon": False, "fontsize": 9, "handlelength": 1.2, "borderaxespad": 0.2}
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, top), **style)
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


def _handles(job: PictureJob) -> list[Line2D]:
    """Bodies that have colours of their own, joints, arrows, and gravity as it points in the picture."""
    from matplotlib.lines import Line2D

    names = () if job.look.label else job.frames.bodies
    found = [Line2D([], [], color=palette.colour(i), lw=4, label=plain(name)) for i, name in enumerate(names)]
    joints, arrows = (kind for kind, _ in job.frames.joints.values()), (arrow.kind for arrow in job.frames.arrows.values())
    for kind in dict.fromkeys([*joints, *arrows]):
        if kind != "gravity":
            symbol, tint = (GLYPHS | ARROWS)[kind]
            size = 8 if kind in GLYPHS else 10
            found.append(Line2D([], [], color=tint, marker=symbol, ls="", ms=size, label=WORDS.get(kind, kind)))
    shown: dict[str, Any] = {"color": GRAVITY, "ls": "", "ms": 13, "label": "gravity"}
    found += [Line2D([], [], marker=marker, **shown) for marker in _falling(job)]
    return found


def _falling(job: PictureJob) -> Iterator[MarkerStyle]:
    """Markers of the gravities that act: arrows along their directions in the picture, a dot along the line of sight."""
    from matplotlib.markers import MarkerStyle
    from matplotlib.transforms import Affine2D

    for arrow in job.frames.arrows.values():
        size = np.linalg.norm(arrow.directions, axis=1)
        if arrow.kind == "gravity" and size.any():
            across, along = (float(arrow.directions[size.argmax()] @ axis / size.max()) for axis in camera_.axes(job.planar))
            seen = math.hypot(across, along) > 0.1
            yield MarkerStyle(r"$\rightarrow$" if seen else r"$\odot$", transform=Affine2D().rotate(math.atan2(along, across)))


def norm(job: PictureJob) -> Any:
    """From values to [0, 1]."""
    from matplotlib.colors import LogNorm, Normalize

    return LogNorm(*job.limits, clip=True) if job.look.logarithmic else Normalize(*job.limits, clip=True)


def cmap(job: PictureJob) -> Any:
    """The colour map without its palest end, where that is yellow."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps[job.colours](np.linspace(0.0, 0.93 if job.colours == "viridis" else 1.0, 256)))
