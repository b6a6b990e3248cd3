"""The process that draws; see `painter` for how it is asked and what it answers."""

from __future__ import annotations

import math
import os
import pickle
import signal
import sys
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from ...core import imports
from .. import video
from ..frames import Array, Frames, Indices
from . import camera as camera_
from . import decor, drawing
from .camera import Camera
from .decor import Pixels, Text
from .job import PictureJob

MISSING, FAILED = 7, 1  #: answers where nothing can be drawn, and where this picture cannot
SHORTEST = 0.45  #: height of a sheet of small scenes over that which was asked for, at least, for the key
PALEST = 0.28  #: strength of the first instant of an overlay
#: (k, 2, 2) by which the place of a text is turned about what it marks, the first choice first
TURNS = np.array(
    [[[c, -s], [s, c]] for c, s in ((np.cos(a), np.sin(a)) for a in np.radians([0, 45, -45, 90, -90, 135, -135, 180]))]
)
FARTHER = np.array([1.0, 1.5, 2.0, 3.0])  #: distances of a text from what it marks, over the usual one, the first choice first
TAKEN = 10  #: pixels of a body that a pixel of a text counts for


def main() -> None:
    """Probe, then answer the orders on the input until it ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever libraries print is no answer
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who stops a run wants the picture of what it has reached
    ready = _probe()
    while True:
        try:
            job = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        answers.write((ready if job is None or ready != "0" else _draw(job)) + "\n")
        answers.flush()


def _probe() -> str:
    """Draw a black square over a white ground and look at the pixels."""
    try:
        imports.prepare()
        import pyvista

        plotter: Any = pyvista.Plotter(off_screen=True, window_size=[32, 32])
        plotter.set_background("white")
        plotter.add_mesh(pyvista.Plane(), color="black", lighting=False)
        image = drawing.shot(plotter)
        plotter.close()
    except (ImportError, RuntimeError) as error:
        return f"{MISSING} {_line(error)}"
    return "0" if np.ptp(image) > 200 else f"{MISSING} an empty picture"


def _draw(job: PictureJob) -> str:
    try:
        _save(LAYOUTS[job.layout](job), job)
    except Exception as error:  # whatever it is, it is said where the picture was asked for
        return f"{FAILED} {_line(error)}"
    return "0"


def _line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


def view(job: PictureJob, size: tuple[int, int], height: int, room: int = 0) -> Camera:
    """The camera that serves all instants; `room` is the width there was for the scene, its own by default [pixel]."""
    frames = job.frames
    points = [body.points.reshape(-1, 3) for body in frames.bodies.values()] + [points for _, points in frames.joints.values()]
    box = camera_.box(
        np.concatenate(points), job.planar, cells=4 if (room or size[0]) > 35 * height else 2, display=job.look.display
    )
    return camera_.fit(box, job.planar, size, _margins(job, height))


def _margins(job: PictureJob, height: int) -> camera_.Margins:
    """Left, right, top, bottom [pixel] for letters of a height; small scenes have narrow ones."""
    left, right, top, bottom = (4.2, 3.6, 5.2, 4.2) if job.planar else (4.0, 3.6, 3.6, 2.4)
    if job.planar and job.layout == "multiples":
        left, right, top, bottom = 3.6, 1.4, 5.0, 3.8
    return left * height, right * height, top * height, bottom * height


def _fill(job: PictureJob, size: tuple[int, int]) -> tuple[int, int]:
    """The part of a small scene of this size that its box and its letters fill [pixel]."""
    height = _small(job, size)
    camera = view(job, size, height)
    left, right, top, bottom = _margins(job, height)
    across, along = np.ptp(camera_.project(camera, camera.box.corners), axis=0)
    return min(size[0], math.ceil(across + left + right)), min(size[1], math.ceil(along + top + bottom))


def strip_width(job: PictureJob) -> int:
    """Width of the key beside the scene [pixel]; nothing to explain, no key."""
    frames = job.frames
    explained = job.look.label or frames.joints or frames.arrows or len(frames.bodies) > 1
    return round(0.21 * job.look.size[1]) + 24 if explained else 0


def marks(job: PictureJob, times: Array) -> list[str]:
    """Instants (s,) beside a body: `0.25 s`, or `load x 0.25` at a load factor."""
    return [f"{number} s" if job.look.clock == "s" else f"load x {number}" for number in _numbers(times)]


def stamps(job: PictureJob, times: Array) -> list[str]:
    """Instants (s,) at the head of a picture: `t = 0.25 s`, `load factor 0.25`, or captions of their own."""
    if job.look.captions:
        return list(job.look.captions)
    return [f"t = {number} s" if job.look.clock == "s" else f"{job.look.clock} {number}" for number in _numbers(times)]


def _numbers(times: Array) -> list[str]:
    """Times or load factors as text, all with the decimals that tell them apart."""
    gap = float(np.abs(np.diff(times)).min()) if times.size > 1 else float(abs(times[0])) or 1.0
    decimals = min(max(2 - math.floor(math.log10(gap)) - 1, 2), 7)
    return [f"{time:.{decimals}f}" for time in times]


def drawn(job: PictureJob) -> Indices:
    """Numbers of the instants that are drawn one by one."""
    return np.arange(int(job.look.behind), job.frames.times.size, dtype=np.int64)


def letters(job: PictureJob) -> int:
    return max(11, round(job.look.size[1] / 52))


def overlay(job: PictureJob) -> list[Pixels]:
    """All instants in one scene, the earlier ones paler, each marked with its time at the point that moves farthest."""
    height, width, count = letters(job), strip_width(job), job.frames.times.size
    camera = view(job, (job.look.size[0] - width, job.look.size[1]), height)
    stage = drawing.stage(job, camera)
    empty = drawing.shot(stage.plotter)
    for sample, strength in enumerate(np.linspace(PALEST, 1.0, count) if count > 1 else np.ones(1)):
        drawing.instant(stage, sample, float(strength), slot=sample)
    image = drawing.shot(stage.plotter)
    stage.plotter.close()
    titles = [Text(job.look.title, (height, height), "la", round(1.2 * height), "#000000")] if job.look.title else []
    axes, times = decor.axis_texts(camera, job.planar, height), list[Text]()
    if job.frames.bodies:
        ink = (image != empty).any(axis=2).astype(np.int64)
        for text in titles + axes:
            ink[_under(text)] += TAKEN
        times = place_marks(marks(job, job.frames.times), *_farthest(camera, job.frames), ink, height)
    return _beside([decor.letter(image, titles + times + axes)], job, width)


def place_marks(words: list[str], tips: Array, inner: Array, ink: Indices, height: int) -> list[Text]:
    """Texts beside pixels `tips` (s,2), the last first: each where it covers least of the `ink` (height, width) and of the others.

    The first choice is the place away from the points `inner` (s,2); all are inside of the picture, if any is.
    """
    ink, found = ink.copy(), list[Text]()
    for word, tip, outward in list(zip(words, tips, tips - inner, strict=True))[::-1]:
        left, _, right, _ = decor.extent(Text(word, (0.0, 0.0), "mm", height))
        away = np.array([max(2.4 * height, (right - left) / 2 + 0.7 * height), 1.5 * height])
        way = float(np.linalg.norm(outward))
        unit = outward / way if way > 1.0 else np.array([1.0, 0.0])  # less than a pixel has no direction
        around = tip + np.einsum("d,kij,j->dki", FARTHER, TURNS, unit).reshape(-1, 2) * away
        best = min((Text(word, (float(x), float(y)), "mm", height, "#000000") for x, y in around), key=partial(covered, ink))
        ink[_under(best)] += TAKEN
        found.append(best)
    return found


def covered(ink: Indices, text: Text) -> float:
    """How much a text covers, infinite outside of the picture."""
    left, top, right, bottom = decor.extent(text)
    inside = min(left, top) >= 0 and right <= ink.shape[1] and bottom <= ink.shape[0]
    return float(ink[_under(text)].sum()) if inside else math.inf


def _under(text: Text) -> tuple[slice, slice]:
    """Rows and columns of a text with half a letter around it."""
    grown = np.add(decor.extent(text), 0.5 * text.height * np.array([-1, -1, 1, 1]))
    left, top, right, bottom = np.maximum(grown.round().astype(int), 0)
    return slice(top, bottom), slice(left, right)


def _farthest(camera: Camera, frames: Frames) -> tuple[Array, Array]:
    """Pixels (s,2) of that point of all bodies which moves farthest, also from its reference, and of the middle of its body."""
    bodies = list(frames.bodies.values())
    paths = [camera_.project(camera, np.concatenate([body.points, body.reference[None]])) for body in bodies]
    ways = [np.ptp(path, axis=0).sum(axis=1) for path in paths]
    most = int(np.argmax([way.max() for way in ways]))
    found = paths[most][:-1]
    return found[:, ways[most].argmax()], found.mean(axis=1)


def _columns(job: PictureJob, size: tuple[int, int]) -> int:
    """Columns of small scenes that show them largest; among equals the squarest grid."""
    count = len(drawn(job))

    def metres(columns: int) -> tuple[float, int]:
        rows = math.ceil(count / columns)
        cell = (size[0] // columns, size[1] // rows)
        if min(cell) < 8 * _small(job, cell):
            return math.inf, columns
        return round(math.log(view(job, cell, _small(job, cell)).metres_per_pixel), 2), abs(columns - rows)

    return min(range(1, count + 1), key=metres)


def _small(job: PictureJob, size: tuple[int, int]) -> int:
    """Height of letters in a scene of this size [pixel]."""
    return max(11, min(letters(job), round(min(size[0] / 32, size[1] / 22))))


def multiples(job: PictureJob) -> list[Pixels]:
    """One scene an instant, side by side, all with the same camera and colours; the sheet ends where they end."""
    count, width = len(drawn(job)), strip_width(job)
    title = round(2.2 * letters(job)) if job.look.title else 0
    room = (job.look.size[0] - width, job.look.size[1] - title)
    columns = _columns(job, room)
    rows = math.ceil(count / columns)
    cell = (room[0] // columns, room[1] // rows)
    height, size = _small(job, cell), _fill(job, cell)
    tall = max(title + rows * size[1], round(SHORTEST * job.look.size[1]))
    canvas = np.full((tall, columns * size[0], 3), 255, dtype=np.uint8)
    for sample, image in enumerate(_instants(job, size, height, room=cell[0])):
        top, left = title + sample // columns * size[1], sample % columns * size[0]
        canvas[top : top + size[1], left : left + size[0]] = image
    if job.look.title:
        canvas = decor.letter(canvas, [Text(job.look.title, (height, title / 2), "lm", round(1.2 * letters(job)), "#000000")])
    return _beside([canvas], job, width)


def animation(job: PictureJob) -> list[Pixels]:
    """One picture an instant, the time written on it."""
    width = strip_width(job)
    images = _instants(job, (job.look.size[0] - width, job.look.size[1]), letters(job), job.look.title)
    return _beside(list(images), job, width)


def _instants(job: PictureJob, size: tuple[int, int], height: int, title: str = "", room: int = 0) -> Iterator[Pixels]:
    camera, samples = view(job, size, height, room), drawn(job)
    stage, axes = drawing.stage(job, camera), decor.axis_texts(camera, job.planar, height)
    if job.look.behind:
        drawing.outline(stage)
    for sample, stamp in zip(samples, stamps(job, job.frames.times[samples]), strict=True):
        drawing.instant(stage, int(sample), slot=int(job.look.behind))
        head = Text(stamp + (f"   {title}" if title else ""), (height, height), "la", round(1.15 * height), "#000000")
        yield decor.letter(drawing.shot(stage.plotter), [head, *axes])
    stage.plotter.close()


def _beside(images: list[Pixels], job: PictureJob, width: int) -> list[Pixels]:
    """Pictures of one size with the key beside each."""
    if not width:
        return images
    key = decor.strip(job, width, len(images[0]))
    return [np.concatenate([image, key], axis=1) for image in images]


LAYOUTS = {"overlay": overlay, "multiples": multiples, "animation": animation}


def _save(images: list[Pixels], job: PictureJob) -> None:
    """A PNG, an MP4, or a GIF that loops for ever, all its frames in one palette so that colours do not flicker."""
    from PIL import Image

    if job.suffix == video.SUFFIX:
        video.write(images, job.target, job.rate)
        return
    pictures = [Image.fromarray(image) for image in images]
    if job.suffix == ".png":
        pictures[0].save(job.target, "PNG")
        return
    some = np.concatenate([images[i][::2, ::2] for i in np.unique(np.linspace(0, len(images) - 1, 8).round().astype(int))])
    shared = Image.fromarray(some).quantize(256, method=Image.Quantize.MEDIANCUT)
    table = np.array(shared.getpalette()).reshape(-1, 3)
    table[table.min(axis=1) >= 248] = 255  # Pillow matches in boxes of 8 levels; the ground stays white
    shared.putpalette(table.ravel().tolist())
    flat = [picture.quantize(palette=shared, dither=Image.Dither.NONE) for picture in pictures]
    settings: dict[str, Any] = {"duration": round(1000 / job.rate), "loop": 0, "optimize": False, "disposal": 1}
    flat[0].save(job.target, "GIF", save_all=True, append_images=flat[1:], **settings)
