"""The process that draws; see `painter` for how it is asked and what it answers."""

from __future__ import annotations

import math
import os
import pickle
import signal
import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from PIL import Image

from ...core import imports
from .. import frames as frames_
from .. import video
from ..frames import Array, Frames, Indices
from ..marks import REACH, THIN
from . import camera as camera_
from . import decor, drawing
from .camera import Camera
from .decor import Pixels, Text
from .job import PictureJob

MISSING, FAILED = 7, 1  #: answers where nothing can be drawn, and where this picture cannot
#: height of a sheet of small scenes over that which was asked for, at least, for the key
SHORTEST = 0.45
PALEST = 0.28  #: strength of the first instant of an overlay
#: of a text about what it marks, the first choice first
TURNS = np.exp(1j * np.radians([0, 45, -45, 90, -90, 135, -135, 180]))
#: distances of a text from what it marks, over the usual one, the first choice first
FARTHER = np.array([1.0, 1.5, 2.0, 3.0])
LEAST = 12.0  #: width of a small scene, over the height of its letters
TAKEN = 10  #: pixels of a body that a pixel of a text counts for


def main() -> None:
    """Probe, then answer the orders on the input until it ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever libraries print is no answer
    # who stops a run wants the picture of what it has reached
    signal.signal(signal.SIGINT, signal.SIG_IGN)
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


def view(job: PictureJob, size: tuple[int, int], height: int) -> Camera:
    """The camera that serves all instants, with arrows and room for a line of letters above."""
    frames = job.frames
    seen = frames_.points(job.frames)
    reach = REACH * THIN * float(np.ptp(seen, axis=0).max())
    found = [seen]
    for mark in frames.marks.values():
        if mark.points.size and not mark.is_joint:
            length = np.linalg.norm(mark.directions, axis=1, keepdims=True)
            aim = reach * mark.directions / np.where(length > 0.0, length, 1.0)
            found += [mark.points - aim, mark.points + aim]
    return camera_.fit(np.concatenate(found), job.planar, size, margins(job, height))


def margins(job: PictureJob, height: int) -> camera_.Margins:
    """Left, right, top, bottom [pixel] for letters of a height; an overlay has times around it."""
    beside = (4.0 if job.layout == "overlay" else 2.0) * height
    return beside, beside, 3.5 * height, 2.0 * height


def crop(job: PictureJob, camera: Camera, height: int) -> Camera:
    """The part of a small scene that what it shows, with letters of a height above, fills."""
    left, right, top, bottom = margins(job, height)
    across, along, _ = camera.extent / camera.metres_per_pixel
    wanted = max(across + left + right, LEAST * height), along + top + bottom
    return replace(
        camera,
        size=(min(camera.size[0], math.ceil(wanted[0])), min(camera.size[1], math.ceil(wanted[1]))),
    )


def stamps(job: PictureJob, times: Array) -> list[str]:
    """Instants (s,) as text: `t = 0.25 s`, `load factor 0.25`, or captions of their own."""
    if job.options.captions:
        return list(job.options.captions)
    return [
        f"t = {number} s" if job.options.clock == "s" else f"{job.options.clock} {number}"
        for number in _numbers(times)
    ]


def _numbers(times: Array) -> list[str]:
    """Times or load factors as text, all with the decimals that tell them apart."""
    gap = float(np.abs(np.diff(times)).min()) if times.size > 1 else float(abs(times[0])) or 1.0
    decimals = min(max(2 - math.floor(math.log10(gap)) - 1, 2), 7)
    return [f"{time:.{decimals}f}" for time in times]


def drawn(job: PictureJob) -> Indices:
    """Numbers of the instants that are drawn one by one."""
    return np.arange(int(job.options.behind), job.frames.times.size, dtype=np.int64)


def letters(job: PictureJob) -> int:
    return max(11, round(job.options.size[1] / 52))


def overlay(job: PictureJob) -> list[Pixels]:
    """All instants in one scene, the earlier ones paler, each marked with its time at the point
    that moves farthest.
    """
    height = letters(job)
    count = job.frames.times.size
    camera = view(job, (job.options.size[0] - decor.width(job), job.options.size[1]), height)
    stage = drawing.stage(job, camera)
    for sample, strength in enumerate(np.linspace(PALEST, 1.0, count) if count > 1 else np.ones(1)):
        drawing.instant(stage, sample, float(strength), slot=sample)
    image = drawing.shot(stage.plotter)
    stage.plotter.close()
    texts = (
        [Text(job.options.title, (height, height), "la", round(1.2 * height))]
        if job.options.title
        else []
    )
    if job.frames.bodies:
        words = [
            one.removeprefix("t = ").replace("load factor", "load x")
            for one in stamps(job, job.frames.times)
        ]
        texts += place_marks(
            words, *_farthest(camera, job.frames), np.any(image < 255, axis=2), height
        )
    return _with_key([decor.letter(image, texts)], job, camera)


def place_marks(
    words: list[str], tips: Array, inner: Array, ink: np.ndarray, height: int
) -> list[Text]:
    """Texts beside pixels `tips` (s,2), the last first: each where it covers least of the `ink`
    (height, width) and of the others.

    The first choice is the place away from the points `inner` (s,2); all are inside of the picture,
    below a line for its title.
    """
    taken = ink.astype(np.int64)
    found = list[Text]()
    # half of it
    room = (
        np.array([max(decor.measure(word, height) for word in words) + height, 1.7 * height]) / 2.0
    )
    low = room + np.array([0.0, 2.0 * height])
    high = np.array(ink.shape[::-1]) - room
    away = np.maximum(room + 0.2 * height, (2.4 * height, 1.5 * height))
    for word, tip, outward in list(zip(words, tips, tips - inner, strict=True))[::-1]:
        way = float(np.linalg.norm(outward))
        unit = complex(*outward / way) if way > 1.0 else 1.0  # less than a pixel has no direction
        turned = np.outer(FARTHER, unit * TURNS).ravel()
        places = np.clip(tip + np.column_stack([turned.real, turned.imag]) * away, low, high)
        corners = np.concatenate([places - room, places + room], axis=1).round().astype(int)
        under = [taken[top:bottom, left:right] for left, top, right, bottom in corners]
        best = int(np.argmin([one.sum() for one in under]))
        under[best] += TAKEN
        found.append(Text(word, (float(places[best, 0]), float(places[best, 1])), "mm", height))
    return found


def _farthest(camera: Camera, frames: Frames) -> tuple[Array, Array]:
    """Pixels (s,2) of that point of all bodies which moves farthest, also from its reference, and
    of the middle of its body.
    """
    bodies = list(frames.bodies.values())
    paths = [
        camera_.project(camera, np.concatenate([body.points, body.reference[None]]))
        for body in bodies
    ]
    ways = [np.ptp(path, axis=0).sum(axis=1) for path in paths]
    most = int(np.argmax([way.max() for way in ways]))
    found = paths[most][:-1]
    return found[:, ways[most].argmax()], found.mean(axis=1)


def multiples(job: PictureJob) -> list[Pixels]:
    """One scene an instant, side by side, all with the same camera and colours; the sheet ends
    where they end.
    """
    columns, camera = arrange(job)
    across, along = camera.size
    title = head(job)
    height = small(job)
    tall = max(
        title + math.ceil(len(drawn(job)) / columns) * along, round(SHORTEST * job.options.size[1])
    )
    canvas = np.full((tall, columns * across, 3), 255, dtype=np.uint8)
    for sample, image in enumerate(_instants(job, camera, height)):
        top = title + sample // columns * along
        left = sample % columns * across
        canvas[top : top + along, left : left + across] = image
    if job.options.title:
        canvas = decor.letter(
            canvas, [Text(job.options.title, (height, title / 2), "lm", round(1.2 * letters(job)))]
        )
    return _with_key([canvas], job, camera)


def arrange(job: PictureJob) -> tuple[int, Camera]:
    """Columns of small scenes that show them largest, among equals the squarest grid, and the
    camera of each scene.
    """
    count = len(drawn(job))
    room = (job.options.size[0] - decor.width(job), job.options.size[1] - head(job))

    def camera(columns: int) -> Camera:
        return view(job, (room[0] // columns, room[1] // math.ceil(count / columns)), small(job))

    def smallness(columns: int) -> tuple[float, int]:
        return round(math.log(camera(columns).metres_per_pixel), 2), abs(
            columns - math.ceil(count / columns)
        )

    best = min(range(1, count + 1), key=smallness)
    return best, crop(job, camera(best), small(job))


def head(job: PictureJob) -> int:
    """Height of the line for the title above small scenes [pixel]."""
    return round(2.2 * letters(job)) if job.options.title else 0


def small(job: PictureJob) -> int:
    """Height of letters in small scenes [pixel]."""
    return max(11, round(0.75 * letters(job)))


def animation(job: PictureJob) -> list[Pixels]:
    """One picture an instant, the time written on it."""
    camera = view(job, (job.options.size[0] - decor.width(job), job.options.size[1]), letters(job))
    return _with_key(list(_instants(job, camera, letters(job), job.options.title)), job, camera)


def _instants(job: PictureJob, camera: Camera, height: int, title: str = "") -> Iterator[Pixels]:
    samples = drawn(job)
    stage = drawing.stage(job, camera)
    if job.options.behind:
        drawing.outline(stage)
    for sample, stamp in zip(samples, stamps(job, job.frames.times[samples]), strict=True):
        drawing.instant(stage, int(sample), slot=int(job.options.behind))
        head = Text(
            stamp + (f"   {title}" if title else ""), (height, height), "la", round(1.15 * height)
        )
        yield decor.letter(drawing.shot(stage.plotter), [head])
    stage.plotter.close()


def _with_key(images: list[Pixels], job: PictureJob, camera: Camera) -> list[Pixels]:
    """Pictures of one size, and the key on the right of each."""
    key = decor.key(job, camera, len(images[0]))
    return [np.concatenate([image, key], axis=1) for image in images]


LAYOUTS = {"overlay": overlay, "multiples": multiples, "animation": animation}


def _save(images: list[Pixels], job: PictureJob) -> None:
    """A PNG, an MP4, or a GIF that loops for ever, all its frames in one palette so that colours do
    not flicker.
    """
    if job.suffix == video.SUFFIX:
        video.write(images, job.target, job.rate)
        return
    pictures = [Image.fromarray(image) for image in images]
    if job.suffix == ".png":
        pictures[0].save(job.target, "PNG")
        return
    some = np.concatenate(
        [
            images[i][::2, ::2]
            for i in np.unique(np.linspace(0, len(images) - 1, 8).round().astype(int))
        ]
    )
    shared = Image.fromarray(some).quantize(256, method=Image.Quantize.MEDIANCUT)
    table = np.array(shared.getpalette()).reshape(-1, 3)
    # Pillow matches in boxes of 8 levels; the ground stays white
    table[table.min(axis=1) >= 248] = 255
    shared.putpalette(table.ravel().tolist())
    flat = [picture.quantize(palette=shared, dither=Image.Dither.NONE) for picture in pictures]
    settings: dict[str, Any] = {
        "duration": round(1000 / job.rate),
        "loop": 0,
        "optimize": False,
        "disposal": 1,
    }
    flat[0].save(job.target, "GIF", save_all=True, append_images=flat[1:], **settings)
