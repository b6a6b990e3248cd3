"""Off-screen pictures of deformed configurations, as PNG, GIF or MP4.

VTK may kill the process that asks it for OpenGL where there is none. Therefore this module never imports it: a process of its own
(`painter`) first draws a probe, then the pictures; when it dies, this one says what to install.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from ..core import extras
from ..core.errors import FmbsError, InputError, MissingFeature, closest, say
from . import frames as frames_
from . import surfaces, video
from .frames import SILENT, Frames, Shown
from .rendering.job import Arrays, PictureJob, save
from .rendering.job import Look as Look
from .rendering.painter import TIME_LIMIT, Painter, hired

#: text beside the colour scale of well-known fields
LABELS = {
    "displacement": "displacement [m]",
    "velocity": "speed [m/s]",
    "strain": "axial strain [-]",
    "curvature": "curvature [1/m]",
    "error": "position error [m]",
    "von_mises": "von Mises stress [MPa]",
    "von_mises_recovered": "von Mises stress, recovered [MPa]",
    "von_mises_top": "von Mises stress, top [MPa]",
    "von_mises_bottom": "von Mises stress, bottom [MPa]",
    "axial_force": "axial force [N]",
    "bending_moment": "bending moment [N m]",
}
UNITS = dict.fromkeys(
    (name for name in LABELS if name.startswith("von_mises")), 1e6
)  #: of the colour scale, in SI units; 1 for the others
STRESS = "YlOrRd"  #: colour map of stresses, so that unloaded plates stay pale behind their outline
ADVICE = (
    "install an off-screen OpenGL (Debian, Ubuntu: `apt-get install libegl1 libgl1-mesa-dri` or `libosmesa6`; "
    "conda: `mesalib`) or set DISPLAY to a running X server"
)
DIGITS = 8.0 * float(np.finfo(np.float64).eps)  #: round-off of a position, relative to the largest coordinate


class Arrangement(StrEnum):
    """How several instants share one picture."""

    OVERLAY = "overlay"  #: in one scene, earlier instants paler
    MULTIPLES = "multiples"  #: one small scene an instant


def probe(command: Sequence[str] | None = None) -> None:
    """Raise `MissingFeature` where no picture can be drawn; `command` replaces the interpreter and module that draw."""
    extras.need("viz", "pictures")
    with hired(command) as painter:
        _run(painter, None)


def render(
    frames: Frames,
    path: Path | str,
    times: Sequence[float] | None = None,
    look: Look | None = None,
    layout: Arrangement | None = None,
    command: Sequence[str] | None = None,
) -> Path:
    """Draw the configurations nearest to `times` [s] (six evenly spread ones by default) into the PNG file `path`.

    Without a `layout`, lines share one scene and surfaces, which would hide each other, get one scene an instant.
    """
    flat = any(body.is_surface for body in frames.bodies.values())
    layout = layout or (Arrangement.MULTIPLES if flat else Arrangement.OVERLAY)
    indices = frames_.spread(frames.times, 6) if times is None else frames_.choose(frames.times, times)
    return _draw(
        frames_.select(frames, indices), _check_suffix(path, ".png"), look or Look(), Arrangement(layout).value, 1.0, command
    )


def animate(
    frames: Frames,
    path: Path | str,
    count: int = 60,
    rate: float = 15.0,
    look: Look | None = None,
    command: Sequence[str] | None = None,
) -> Path:
    """Draw `count` instants evenly spread in time into the GIF or MP4 file `path`, `rate` of them a second.

    MP4 takes ffmpeg; MissingFeature where there is none.
    """
    if not 0.5 <= rate <= 50:
        raise InputError(say("pictures: rate", "0.5 to 50 frames a second", rate))
    chosen = frames_.select(frames, frames_.spread(frames.times, count))
    target = _check_suffix(path, ".gif", video.SUFFIX)
    if target.suffix.lower() == video.SUFFIX:
        video.find_program(str(target))
    return _draw(chosen, target, look or Look(size=(800, 600)), "animation", rate, command)


def is_round_off(frames: Frames, name: str) -> bool:
    """Whether strains or curvatures, not all zero, are those that the round-off of positions makes of straight or flat bodies.

    Positions x are off by DIGITS |x|, strains [-] by that over the distance h of points, curvatures [1/m] by that over h^2.
    """
    power, found = {"strain": 1, "curvature": 2}.get(name, 0), False
    for body in frames.bodies.values():
        if power and name in body.fields:
            largest = float(np.abs(frames_.magnitude(body, name)).max())
            if largest * spacing(body) ** power > DIGITS * float(np.abs(body.points).max()):
                return False
            found |= largest > 0.0
    return found


def spacing(body: Shown) -> float:
    """Mean distance of the points of a cell in the reference [m]."""
    ends = body.reference[body.cells]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())


def limits(frames: Frames, name: str, logarithmic: bool = False) -> tuple[float, float]:
    """Limits of the colour scale over all instants and bodies: symmetric where the field has both signs, five decades at most.

    Stresses start at zero; what is round-off is zero, on a scale up to 1.
    """
    if is_round_off(frames, name):
        return 0.0, 1.0
    values = np.concatenate([frames_.magnitude(body, name).ravel() for body in frames.bodies.values()])
    values = values[np.isfinite(values) & ((values > 0) | (not logarithmic))]
    if values.size == 0:
        return (1e-5, 1.0) if logarithmic else (0.0, 1.0)
    low, high = float(values.min()), float(values.max())
    if logarithmic:
        return min(max(low, 1e-5 * high), 0.5 * high), high
    if name in UNITS and high > 0:
        return 0.0, high
    if low < 0 < high:
        largest = max(-low, high)
        return -largest, largest
    return (
        (low, high)
        if high - low > 1e-12 * max(abs(low), abs(high))
        else (low - 0.5 * (abs(low) or 1), high + 0.5 * (abs(low) or 1))
    )


def _check_suffix(path: Path | str, *suffixes: str) -> Path:
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        raise InputError(say(f"pictures: {target}", f"a file name ending in {' or '.join(suffixes)}", f"'{target.suffix}'"))
    return target


def _draw(frames: Frames, path: Path, look: Look, layout: str, rate: float, command: Sequence[str] | None) -> Path:
    if look.field is not None and look.field not in frames_.names(frames):
        known = frames_.names(frames)
        got = f"'{look.field}'{closest(look.field, known)}"
        raise InputError(say("pictures: field", "one of " + ", ".join(known), got))
    extras.need("viz", "pictures")
    with hired(command) as painter, tempfile.TemporaryDirectory(dir=painter.folder.name) as folder:
        job, arrays = _order(frames, look, layout, rate, "picture" + path.suffix.lower())
        save(Path(folder), job, arrays)
        _run(painter, Path(folder))
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(Path(folder) / job.target, path)
    return path


def _order(frames: Frames, look: Look, layout: str, rate: float, target: str) -> tuple[PictureJob, Arrays]:
    unit = UNITS.get(look.field or "", 1.0)
    low, high = (0.0, unit) if look.field is None else look.limits or limits(frames, look.field, look.logarithmic)
    silent = look.field is not None and is_round_off(frames, look.field)
    label = "" if look.field is None else (look.label or LABELS.get(look.field, look.field)) + SILENT * silent
    logarithmic = look.logarithmic and look.field is not None
    job = PictureJob(
        layout,
        frames_.planar(frames),
        tuple(frames.bodies),
        tuple(float(np.mean(body.size)) * (0.5 if body.is_surface else 1.0) for body in frames.bodies.values()),
        tuple(str(frames_.MarkKind(kind)) for kind, _ in frames.joints.values()),
        tuple(arrow.kind for arrow in frames.arrows.values()),
        replace(look, label=label, limits=(low / unit, high / unit), logarithmic=logarithmic),
        STRESS if look.field in UNITS else "",
        rate,
        target,
    )
    arrays: Arrays = {"times": frames.times}
    for i, body in enumerate(frames.bodies.values()):
        arrays[f"points_{i}"] = body.points
        blank = silent or not look.field
        arrays[f"values_{i}"] = np.zeros(body.points.shape[:2]) if blank else frames_.magnitude(body, look.field or "") / unit
        if body.is_surface:
            place = surfaces.places(body.reference)
            edges = surfaces.outline(body.reference, body.cells, place)
            arrays |= {f"quads_{i}": body.cells, f"edges_{i}": edges, f"place_{i}": place}
    for j, arrow in enumerate(frames.arrows.values()):
        arrays |= {f"place_of_{j}": arrow.points, f"aim_{j}": arrow.directions}
    arrays |= {f"joint_{j}": points for j, (_, points) in enumerate(frames.joints.values())}
    return job, arrays


def _run(painter: Painter, folder: Path | None) -> None:
    """Draw an order; the end of the process by a signal or by exit code 7 means that there is no usable OpenGL."""
    try:
        code, last = painter.draw(folder)
    except OSError as error:
        if isinstance(error, TimeoutError):
            text = say("pictures", f"a picture within {TIME_LIMIT:g} s", "none", "draw fewer instants or a smaller picture")
            raise FmbsError(text) from error
        raise MissingFeature(say("pictures", f"a program to draw with ({painter.command[0]})", error, ADVICE)) from error
    if code == 1:
        raise FmbsError(say("pictures", "a picture", last))
    if code != 0:
        got = last if code == 7 else f"a drawing process that died with code {code}"
        raise MissingFeature(say("pictures", "OpenGL that draws without a display", got, ADVICE))
