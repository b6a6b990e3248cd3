"""Off-screen pictures of deformed configurations, as PNG, GIF or MP4.

VTK may kill the process that asks it for OpenGL where there is none. Therefore this module never imports it: a process of its own
(`painter`) first draws a probe, then the pictures; when it dies, this one says what to install.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from ..core import extras
from ..core.errors import FmbsError, InputError, MissingFeature, closest, say
from ..core.storage import durable
from . import frames as frames_
from . import video
from .frames import SILENT, Frames, Shown
from .rendering import painter
from .rendering.job import Look as Look
from .rendering.job import PictureJob

#: text beside the colour scale of well-known fields
LABELS = {
    "displacement": "displacement [m]",
    "velocity": "speed [m/s]",
    "strain": "axial strain [-]",
    "curvature": "curvature [1/m]",
    "error": "position error [m]",
    "von_mises": "von Mises stress [Pa]",
    "von_mises_recovered": "von Mises stress, recovered [Pa]",
    "von_mises_top": "von Mises stress, top [Pa]",
    "von_mises_bottom": "von Mises stress, bottom [Pa]",
    "axial_force": "axial force [N]",
    "bending_moment": "bending moment [N m]",
    "shear_force": "shear force [N]",
    "torque": "torque [N m]",
    "torsion": "torsion [1/m]",
    "normal_stress": "stress along the beam [Pa]",
}
STRESSES = frozenset(name for name, label in LABELS.items() if "[Pa]" in label)
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


def probe() -> None:
    """Raise `MissingFeature` where no picture can be drawn."""
    _order(None)


def render(
    frames: Frames,
    path: Path | str,
    times: Sequence[float] | None = None,
    look: Look | None = None,
    layout: Arrangement | None = None,
) -> Path:
    """Draw the configurations nearest to `times` [s] (six evenly spread ones by default) into the PNG file `path`.

    Without a `layout`, lines share one scene and surfaces, which would hide each other, get one scene an instant.
    """
    flat = any(body.is_shell for body in frames.bodies.values())
    layout = layout or (Arrangement.MULTIPLES if flat else Arrangement.OVERLAY)
    indices = frames_.spread(frames.times, 6) if times is None else frames_.choose(frames.times, times)
    return _draw(frames_.select(frames, indices), _check_suffix(path, ".png"), look or Look(), Arrangement(layout).value)


def animate(
    frames: Frames,
    path: Path | str,
    count: int = 60,
    rate: float = 15.0,
    look: Look | None = None,
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
    return _draw(chosen, target, look or Look(size=(800, 600)), "animation", rate)


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
    if name in STRESSES and low >= 0.0 < high:
        return 0.0, high
    if low < 0 < high:
        largest = max(-low, high)
        return -largest, largest
    pad = 0.5 * (abs(low) or 1.0) if high - low <= 1e-12 * max(abs(low), abs(high)) else 0.0
    return low - pad, high + pad


def _check_suffix(path: Path | str, *suffixes: str) -> Path:
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        raise InputError(say(f"pictures: {target}", f"a file name ending in {' or '.join(suffixes)}", f"'{target.suffix}'"))
    return target


def _draw(frames: Frames, path: Path, look: Look, layout: str, rate: float = 1.0) -> Path:
    known = frames_.names(frames)
    if look.field is not None and look.field not in known:
        got = f"'{look.field}'{closest(look.field, known)}"
        raise InputError(say("pictures: field", "one of " + ", ".join(known), got))
    path.parent.mkdir(parents=True, exist_ok=True)
    with durable.place(path) as part:
        _order(make_job(frames, look, layout, rate, part.absolute()))
    return path


def make_job(frames: Frames, look: Look, layout: str, rate: float, target: Path) -> PictureJob:
    """The order for a picture: of the fields that which is drawn, in the unit of the colour scale."""
    bodies, name, colours = dict(frames.bodies), look.field, "viridis"
    if name is None:
        look = replace(look, label="", limits=(0.0, 1.0), logarithmic=False)
        bodies = {key: replace(body, fields={}) for key, body in bodies.items()}
    else:
        silent = is_round_off(frames, name)
        low, high = look.limits or limits(frames, name, look.logarithmic)
        label, unit = look.display.head(look.label or LABELS.get(name, name), [0.0] if silent else [low, high])
        label += SILENT * silent
        look = replace(look, label=label, limits=(low / unit, high / unit))
        bodies = {
            key: replace(body, fields={name: frames_.magnitude(body, name) / unit * (not silent)}) for key, body in bodies.items()
        }
        colours = "coolwarm" if low < 0.0 < high else STRESS if name in STRESSES else "viridis"
    drawn = replace(frames, bodies=bodies)
    return PictureJob(layout, drawn, frames_.planar(frames), look, colours, rate, target.suffixes[-2].lower(), target)


def _order(job: PictureJob | None) -> None:
    """Let a job be drawn, or only probe; the end of the process by a signal or code 7 means that there is no usable OpenGL."""
    extras.need("viz", "pictures")
    with painter.hired() as one:
        try:
            code, reason = one.draw(job)
        except TimeoutError as error:
            text = say("pictures", f"a picture within {painter.TIME_LIMIT:g} s", "none", "draw fewer instants or a smaller picture")
            raise FmbsError(text) from error
        except OSError as error:
            raise MissingFeature(say("pictures", f"a program to draw with ({one.command[0]})", error, ADVICE)) from error
    if code and reason and code != 7:
        raise FmbsError(say("pictures", "a picture", reason))
    if code:
        got = reason or f"a drawing process that died with code {code}"
        raise MissingFeature(say("pictures", "OpenGL that draws without a display", got, ADVICE))
