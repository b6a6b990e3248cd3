"""Off-screen pictures of deformed configurations, as PNG, GIF or MP4.

VTK may kill the process that asks it for OpenGL where there is none. Therefore this module never
imports it: a process of its own (`painter`) first draws a probe, then the pictures; when it dies,
this one says what to install.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path

from ..core import extras
from ..core.errors import FmbsError, InputError, MissingFeature, closest, say
from ..core.storage import durable
from ..core.values.arguments import checked
from . import frames as frames_
from . import video
from .colour_scales import make_scale
from .frames import Frames
from .rendering import painter
from .rendering.job import PictureJob
from .rendering.job import PictureOptions as PictureOptions

ADVICE = (
    "install an off-screen OpenGL (Debian, Ubuntu: `apt-get install libegl1 libgl1-mesa-dri` or `libosmesa6`; "
    "conda: `mesalib`) or set DISPLAY to a running X server"
)


class Arrangement(StrEnum):
    """How several instants share one picture."""

    OVERLAY = "overlay"  #: in one scene, earlier instants paler
    MULTIPLES = "multiples"  #: one small scene an instant


def probe() -> None:
    """Raise `MissingFeature` where no picture can be drawn."""
    _order(None)


@checked
def render(
    frames: Frames,
    path: Path | str,
    times: Sequence[float] | None = None,
    options: PictureOptions | None = None,
    layout: Arrangement | None = None,
) -> Path:
    """Draw the configurations nearest to `times` [s] (six evenly spread ones by default) into the
    PNG file `path`.

    Without a `layout`, lines share one scene and surfaces, which would hide each other, get one
    scene an instant.
    """
    flat = any(body.is_shell for body in frames.bodies.values())
    layout = layout or (Arrangement.MULTIPLES if flat else Arrangement.OVERLAY)
    indices = (
        frames_.spread(frames.times, 6) if times is None else frames_.choose(frames.times, times)
    )
    return _draw(
        frames_.select(frames, indices),
        _check_suffix(path, ".png"),
        options or PictureOptions(),
        Arrangement(layout).value,
    )


@checked
def animate(
    frames: Frames,
    path: Path | str,
    count: int = 60,
    rate: float = 15.0,
    options: PictureOptions | None = None,
) -> Path:
    """Draw `count` instants evenly spread in time into the GIF or MP4 file `path`, `rate` of them a
    second.

    MP4 takes ffmpeg; MissingFeature where there is none.
    """
    if not 0.5 <= rate <= 50:
        raise InputError(say("pictures: rate", "0.5 to 50 frames a second", rate))
    chosen = frames_.select(frames, frames_.spread(frames.times, count))
    target = _check_suffix(path, ".gif", video.SUFFIX)
    if target.suffix.lower() == video.SUFFIX:
        video.find_program(str(target))
    return _draw(chosen, target, options or PictureOptions(size=(800, 600)), "animation", rate)


def _check_suffix(path: Path | str, *suffixes: str) -> Path:
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        raise InputError(
            say(
                f"pictures: {target}",
                f"a file name ending in {' or '.join(suffixes)}",
                f"'{target.suffix}'",
            )
        )
    return target


def _draw(
    frames: Frames, path: Path, options: PictureOptions, layout: str, rate: float = 1.0
) -> Path:
    known = frames_.names(frames)
    if options.field is not None and options.field not in known:
        got = f"'{options.field}'{closest(options.field, known)}"
        raise InputError(say("pictures: field", "one of " + ", ".join(known), got))
    path.parent.mkdir(parents=True, exist_ok=True)
    with durable.place(path) as part:
        _order(make_job(frames, options, layout, rate, part.absolute()))
    return path


def make_job(
    frames: Frames, options: PictureOptions, layout: str, rate: float, target: Path
) -> PictureJob:
    """The order for a picture: of the fields that which is drawn, in the unit of the colour scale."""
    scale = None
    if options.field is not None:
        scale = make_scale(
            [frames],
            options.field,
            options.display,
            options.label,
            options.limits,
            options.logarithmic,
        )
    bodies = {
        name: replace(body, fields={scale.field: scale.values(body)} if scale else {})
        for name, body in frames.bodies.items()
    }
    drawn = replace(frames, bodies=bodies)
    return PictureJob(
        layout,
        drawn,
        frames_.planar(frames),
        options,
        scale,
        rate,
        target.suffixes[-2].lower(),
        target,
    )


def _order(job: PictureJob | None) -> None:
    """Let a job be drawn, or only probe; the end of the process by a signal or code 7 means that
    there is no usable OpenGL.
    """
    extras.need("viz", "pictures")
    with painter.hired() as one:
        try:
            code, reason = one.draw(job)
        except TimeoutError as error:
            text = say(
                "pictures",
                f"a picture within {painter.TIME_LIMIT:g} s",
                "none",
                "draw fewer instants or a smaller picture",
            )
            raise FmbsError(text) from error
        except OSError as error:
            raise MissingFeature(
                say("pictures", f"a program to draw with ({one.command[0]})", error, ADVICE)
            ) from error
    if code and reason and code != 7:
        raise FmbsError(say("pictures", "a picture", reason))
    if code:
        got = reason or f"a drawing process that died with code {code}"
        raise MissingFeature(say("pictures", "OpenGL that draws without a display", got, ADVICE))
