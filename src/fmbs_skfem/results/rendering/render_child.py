"""The process that draws: `python -m` this module; see `painter` for how it is asked, `job` for an order.

Exit codes: 0 the input has ended, 7 no usable OpenGL or pyvista, 1 anything else; where VTK finds no OpenGL at all, a signal ends
the process.
"""

from __future__ import annotations

import math
import os
import signal
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...core import imports
from .. import video
from ..frames import Array, Indices
from . import camera as camera_
from . import decor, drawing
from .camera import Box, Camera
from .decor import Pixels, Text
from .job import Arrays, PictureJob, load

SHORTEST = 0.45  #: height of a sheet of small scenes over that which was asked for, at least, for the key
PALEST = 0.28  #: strength of the first instant of an overlay
#: (k, 2, 2) by which the place of a text is turned about what it marks, the first choice first
TURNS = np.array(
    [[[c, -s], [s, c]] for c, s in ((np.cos(a), np.sin(a)) for a in np.radians([0, 45, -45, 90, -90, 135, -135, 180]))]
)
FARTHER = np.array([1.0, 2.0, 3.0])  #: distances of a text from what it marks, over the usual one, the first choice first
RESTS = 0.1  #: way of the ends of bodies over the farthest of any point, below which times do not stand at an end
LARGEST = 1.5  #: radius of the largest joint that is drawn, over that of the others


def main() -> int:
    """Probe, then draw what the lines of the input order; an empty one asks for the probe alone."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever libraries print is no answer
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who stops a run wants the picture of what it has reached
    try:
        imports.prepare()
        _probe()
    except (ImportError, RuntimeError) as error:
        sys.stderr.write(f"{error}\n")
        return 7
    for line in sys.stdin:
        if line.strip():
            draw(Path(line.rstrip("\n")))
        answers.write("drawn\n")
        answers.flush()
    return 0


def draw(folder: Path) -> None:
    """Draw the order in a folder."""
    job, arrays = load(folder)
    _save(LAYOUTS[job.layout](job, arrays), folder / job.target, job.rate)


def _probe() -> None:
    """Draw a black square over a white ground and look at the pixels."""
    import pyvista

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[32, 32])
    plotter.set_background("white")
    plotter.add_mesh(pyvista.Plane(), color="black", lighting=False)
    image = drawing.shot(plotter)
    plotter.close()
    if np.ptp(image) < 200:
        raise RuntimeError("an empty picture")


def view(job: PictureJob, arrays: Arrays, size: tuple[int, int], height: int, room: int = 0) -> tuple[Camera, Box]:
    """Camera and box that serve all instants; `room` is the width there was for the scene, its own by default [pixel]."""
    parts = [values.reshape(-1, 3) for key, values in arrays.items() if key.startswith(("points_", "joint_"))]
    box = camera_.box(np.concatenate(parts), job.planar, cells=4 if (room or size[0]) > 35 * height else 2)
    return camera_.fit(box.corners, job.planar, size, _margins(job, height)), box


def _margins(job: PictureJob, height: int) -> camera_.Margins:
    """Left, right, top, bottom [pixel] for letters of a height; small scenes have narrow ones."""
    sides = (4.2, 3.6, 5.2, 4.2) if job.planar else (4.0, 3.6, 3.6, 2.4)
    if job.planar and job.layout == "multiples":
        sides = (3.6, 1.4, 4.5, 3.8)
    return sides[0] * height, sides[1] * height, sides[2] * height, sides[3] * height


def _fill(job: PictureJob, arrays: Arrays, size: tuple[int, int]) -> tuple[int, int]:
    """The part of a small scene of this size that its box and its letters fill [pixel]."""
    height = _small(job, size)
    camera, box = view(job, arrays, size, height)
    left, right, top, bottom = _margins(job, height)
    across, along = np.ptp(camera_.project(camera, box.corners), axis=0)
    return min(size[0], math.ceil(across + left + right)), min(size[1], math.ceil(along + top + bottom))


def _thinnest(camera: Camera, box: Box) -> float:
    """Smallest radius of a tube that is still seen well [m]."""
    return max(0.0045 * float(np.max(box.upper - box.lower)), 1.7 * camera.metres_per_pixel)


def strip_width(job: PictureJob) -> int:
    """Width of the key beside the scene [pixel]; nothing to explain, no key."""
    return round(0.21 * job.look.size[1]) + 24 if job.look.label or job.kinds or job.arrows or len(job.bodies) > 1 else 0


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


def drawn(job: PictureJob, arrays: Arrays) -> Indices:
    """Numbers of the instants that are drawn one by one."""
    return np.arange(int(job.look.behind), arrays["times"].size, dtype=np.int64)


def letters(job: PictureJob) -> int:
    return max(11, round(job.look.size[1] / 52))


def overlay(job: PictureJob, arrays: Arrays) -> list[Pixels]:
    """All instants in one scene, the earlier ones paler, each marked with its time at the end of the last body."""
    height, width = letters(job), strip_width(job)
    camera, box = view(job, arrays, (job.look.size[0] - width, job.look.size[1]), height)
    texts = [Text(job.look.title, (height, height), "la", round(1.2 * height), "#000000")] if job.look.title else []
    if job.bodies:
        thinnest = _thinnest(camera, box)
        radius, shafts = LARGEST * drawing.GLYPH * thinnest / camera.metres_per_pixel, drawing.shafts(job, arrays, thinnest)
        shown = arrays | {f"points_of_arrow_{j}": shaft for j, shaft in enumerate(shafts)}
        texts += _marks(camera, shown, len(job.bodies), marks(job, arrays["times"]), height, radius)
    plotter = drawing.stage(camera, box, job.planar)
    drawing.gravity(plotter, job, arrays, box, _free_corner(job, arrays, camera, box, texts))
    count = arrays["times"].size
    strengths = np.linspace(PALEST, 1.0, count) if count > 1 else np.ones(1)
    for sample in range(count):
        drawing.configuration(plotter, job, arrays, sample, _thinnest(camera, box), float(strengths[sample]), slot=sample)
    image = drawing.shot(plotter)
    plotter.close()
    image = decor.letter(image, texts + decor.axis_texts(camera, box, job.planar, height))
    return _beside([image], job, width)


def _free_corner(job: PictureJob, arrays: Arrays, camera: Camera, box: Box, texts: list[Text]) -> tuple[int, int]:
    """The corner in which arrows of gravity cover fewest points of bodies and texts, the upper right one among equals."""
    taken = [camera_.project(camera, arrays[f"points_{i}"].reshape(-1, 3)) for i in range(len(job.bodies))]
    for text in texts:
        left, top, right, bottom = decor.extent(text)
        taken.append(np.array([(x, y) for x in np.linspace(left, right, 9) for y in (top, bottom)]))
    found = np.concatenate([np.empty((0, 2)), *taken])

    def covered(sides: tuple[int, int]) -> int:
        count = 0
        for aim in drawing.gravities(job, arrays):
            ends = camera_.project(camera, drawing.gravity_at(aim, box, sides))
            margin = 0.1 * float(np.abs(ends[1] - ends[0]).max())
            count += int(((found >= ends.min(axis=0) - margin) & (found <= ends.max(axis=0) + margin)).all(axis=1).sum())
        return count

    return min(((1, 1), (0, 1), (1, 0), (0, 0)), key=covered)


def _marks(camera: Camera, arrays: Arrays, bodies: int, words: list[str], height: int, radius: float = 0.0) -> list[Text]:
    """Times around that end of a body which moves farthest, latest first: ends that stay where they are have no room for all.

    Each stands where it covers least of bodies, arrows, joints of a `radius` [pixel] and the times before it, beyond the end of
    the body where that is free, and inside of the picture. Where all ends rest, they stand at the point that moves farthest.
    """
    ends, before = max((ends for i in range(bodies) for ends in _ends(camera, arrays, i)), key=_way)
    moving = max((_farthest(camera, arrays, i) for i in range(bodies)), key=_way)
    if _way((ends, before)) < RESTS * _way(moving):
        ends, before = moving
    outwards = (ends - before) / np.maximum(np.linalg.norm(ends - before, axis=1), 1e-9)[:, None]
    lines, joints = (_projected(camera, arrays, name) for name in ("points_", "joint_"))
    rims = joints[:, None] + radius * np.einsum("kij,j->ki", TURNS, [1.0, 0.0])
    pixels, found = np.concatenate([lines, joints, rims.reshape(-1, 2)]), list[Text]()
    for word, end, outward in zip(words[::-1], ends[::-1], outwards[::-1], strict=True):
        left, _, right, _ = decor.extent(Text(word, (0.0, 0.0), "mm", height))
        away = np.array([max(2.4 * height, (right - left) / 2 + 0.7 * height), 1.5 * height])
        away += radius * bool((np.linalg.norm(joints - end, axis=1) <= radius).any())
        around = np.einsum("d,kij,j->dki", FARTHER, TURNS, outward).reshape(-1, 2) * away
        places = [Text(word, (float(x), float(y)), "mm", height, "#000000") for x, y in end + around]
        inside = [one for one in places if _inside(one, camera.size)] or places
        found.append(min(inside, key=partial(_covered, pixels=pixels, texts=tuple(found))))
    return found


def _way(pair: tuple[Array, Array]) -> float:
    """How far a point comes over the instants [pixel]."""
    return float(np.ptp(pair[0], axis=0).sum())


def _inside(text: Text, size: tuple[int, int]) -> bool:
    """Whether a text lies in a picture of this size [pixel]."""
    left, top, right, bottom = decor.extent(text)
    return min(left, top) >= 0 and right <= size[0] and bottom <= size[1]


def _projected(camera: Camera, arrays: Arrays, name: str) -> Array:
    """Pixels (x, 2) of all points of arrays whose names begin with `name`."""
    found = [values.reshape(-1, 3) for key, values in arrays.items() if key.startswith(name)]
    return camera_.project(camera, np.concatenate([np.empty((0, 3)), *found]))


def _covered(text: Text, pixels: Array, texts: Sequence[Text]) -> int:
    """How many points (x, 2) and other texts a text covers, these counting most."""
    left, top, right, bottom = decor.extent(text)
    margin = 0.5 * text.height
    low, high = np.array([left, top]) - margin, np.array([right, bottom]) + margin
    boxes = np.array([decor.extent(other) for other in texts]).reshape(-1, 4)
    crossed = (boxes[:, :2] < high).all(axis=1) & (boxes[:, 2:] > low).all(axis=1)
    return int(((pixels > low) & (pixels < high)).all(axis=1).sum() + len(pixels) * crossed.sum())


def _ends(camera: Camera, arrays: Arrays, body: int) -> list[tuple[Array, Array]]:
    """Pixels (s, 2) of the ends of a line, or of the point of a surface farthest from its middle, and of points inside of them."""
    points = arrays[f"points_{body}"]
    pairs = [(points[:, -1], points[:, -2]), (points[:, 0], points[:, 1])]
    if f"quads_{body}" in arrays:
        middle = points.mean(axis=1)
        far = np.linalg.norm(points - middle[:, None], axis=2).argmax(axis=1)
        pairs = [(points[np.arange(len(far)), far], middle)]
    return [(camera_.project(camera, end), camera_.project(camera, inner)) for end, inner in pairs]


def _farthest(camera: Camera, arrays: Arrays, body: int) -> tuple[Array, Array]:
    """Pixels (s, 2) of that point of a body which moves farthest, and of its middle."""
    points = arrays[f"points_{body}"]
    most = np.ptp(points, axis=0).sum(axis=1).argmax()
    return camera_.project(camera, points[:, most]), camera_.project(camera, points.mean(axis=1))


def _columns(job: PictureJob, arrays: Arrays, size: tuple[int, int]) -> int:
    """Columns of small scenes that show them largest; among equals the squarest grid."""
    count = len(drawn(job, arrays))

    def metres(columns: int) -> tuple[float, int]:
        rows = math.ceil(count / columns)
        cell = (size[0] // columns, size[1] // rows)
        if min(cell) < 8 * _small(job, cell):
            return math.inf, columns
        camera, _ = view(job, arrays, cell, _small(job, cell))
        return round(math.log(camera.metres_per_pixel), 2), abs(columns - rows)

    return min(range(1, count + 1), key=metres)


def _small(job: PictureJob, size: tuple[int, int]) -> int:
    """Height of letters in a scene of this size [pixel]."""
    return max(11, min(letters(job), round(min(size[0] / 32, size[1] / 22))))


def multiples(job: PictureJob, arrays: Arrays) -> list[Pixels]:
    """One scene an instant, side by side, all with the same camera and colours; the sheet ends where they end."""
    count, width = len(drawn(job, arrays)), strip_width(job)
    title = round(2.2 * letters(job)) if job.look.title else 0
    room = (job.look.size[0] - width, job.look.size[1] - title)
    columns = _columns(job, arrays, room)
    rows = math.ceil(count / columns)
    size = _fill(job, arrays, (room[0] // columns, room[1] // rows))
    height = _small(job, (room[0] // columns, room[1] // rows))
    tall = max(title + rows * size[1], round(SHORTEST * job.look.size[1]))
    canvas = np.full((tall, columns * size[0], 3), 255, dtype=np.uint8)
    for sample, image in enumerate(_instants(job, arrays, size, height, room=room[0] // columns)):
        top, left = title + sample // columns * size[1], sample % columns * size[0]
        canvas[top : top + size[1], left : left + size[0]] = image
    if job.look.title:
        canvas = decor.letter(canvas, [Text(job.look.title, (height, title / 2), "lm", round(1.2 * letters(job)), "#000000")])
    return _beside([canvas], job, width)


def animation(job: PictureJob, arrays: Arrays) -> list[Pixels]:
    """One picture an instant, the time written on it."""
    width, height = strip_width(job), letters(job)
    images = _instants(job, arrays, (job.look.size[0] - width, job.look.size[1]), height, job.look.title)
    return _beside(images, job, width)


def _instants(job: PictureJob, arrays: Arrays, size: tuple[int, int], height: int, title: str = "", room: int = 0) -> list[Pixels]:
    camera, box = view(job, arrays, size, height, room)
    plotter = drawing.stage(camera, box, job.planar)
    drawing.gravity(plotter, job, arrays, box, _free_corner(job, arrays, camera, box, []))
    axes, images = decor.axis_texts(camera, box, job.planar, height), []
    thinnest, samples = _thinnest(camera, box), drawn(job, arrays)
    if job.look.behind:
        drawing.outline(plotter, job, arrays)
    for sample, stamp in zip(samples, stamps(job, arrays["times"][samples]), strict=True):
        drawing.configuration(plotter, job, arrays, int(sample), thinnest, slot=int(job.look.behind))
        head = Text(stamp + (f"   {title}" if title else ""), (height, height), "la", round(1.15 * height), "#000000")
        images.append(decor.letter(drawing.shot(plotter), [head, *axes]))
    plotter.close()
    return images


def _beside(images: list[Pixels], job: PictureJob, width: int) -> list[Pixels]:
    """Pictures of one size with the key beside each."""
    if not width:
        return images
    key = decor.strip(job, width, len(images[0]))
    return [np.concatenate([image, key], axis=1) for image in images]


LAYOUTS = {"overlay": overlay, "multiples": multiples, "animation": animation}


def _save(images: list[Pixels], path: Path, rate: float) -> None:
    """A PNG, an MP4, or a GIF that loops for ever, all its frames in one palette so that colours do not flicker."""
    from PIL import Image

    if path.suffix == video.SUFFIX:
        video.write(images, path, rate)
        return
    pictures = [Image.fromarray(image) for image in images]
    if path.suffix != ".gif":
        pictures[0].save(path)
        return
    some = np.concatenate([images[i][::2, ::2] for i in np.unique(np.linspace(0, len(images) - 1, 8).round().astype(int))])
    shared = Image.fromarray(some).quantize(256, method=Image.Quantize.MEDIANCUT)
    table = np.array(shared.getpalette()).reshape(-1, 3)
    table[table.min(axis=1) >= 248] = 255  # Pillow matches in boxes of 8 levels; the ground stays white
    shared.putpalette(table.ravel().tolist())
    flat = [picture.quantize(palette=shared, dither=Image.Dither.NONE) for picture in pictures]
    flat[0].save(path, save_all=True, append_images=flat[1:], duration=round(1000 / rate), loop=0, optimize=False, disposal=1)


if __name__ == "__main__":
    sys.exit(main())
