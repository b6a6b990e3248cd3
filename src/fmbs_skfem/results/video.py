"""Animations as MP4, through the program ffmpeg, which is found on the path or in the package
imageio-ffmpeg.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ..core.errors import FmbsError, MissingFeature, say

SUFFIX = ".mp4"
REMEDY = "install it (apt-get install ffmpeg, brew install ffmpeg, or pip install imageio-ffmpeg), or take the animation as GIF"
EVEN = "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white"  #: sizes that the usual codec takes


def find_program(what: str) -> str:
    """The path of ffmpeg; MissingFeature where there is none."""
    if found := shutil.which("ffmpeg"):
        return found
    if find_spec("imageio_ffmpeg") is not None:
        return str(import_module("imageio_ffmpeg").get_ffmpeg_exe())
    raise MissingFeature(
        say(what, "the program ffmpeg, which writes MP4", "none on the path", REMEDY)
    )


def write(images: Sequence[np.ndarray], path: Path, rate: float) -> None:
    """An MP4 file of images (height, width, 3) of one size, `rate` of them a second; FmbsError with
    the message of ffmpeg.
    """
    height, width = images[0].shape[:2]
    ends = [
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{width}x{height}",
        "-r",
        f"{rate:g}",
        "-i",
        "-",
    ]
    call = [
        find_program(str(path)),
        "-y",
        "-loglevel",
        "error",
        *ends,
        "-vf",
        EVEN,
        "-pix_fmt",
        "yuv420p",
        "-movflags",
        "+faststart",
        "-f",
        "mp4",
    ]
    done = subprocess.run(
        [*call, str(path)], input=b"".join(image.tobytes() for image in images), capture_output=True
    )
    if done.returncode or not path.is_file():
        last = (
            done.stderr.decode(errors="replace").strip().splitlines()
            or [f"exit code {done.returncode}"]
        )[-1]
        raise FmbsError(say(str(path), "a film written by ffmpeg", last, REMEDY))
