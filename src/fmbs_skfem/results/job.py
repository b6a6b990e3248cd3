"""The order for a picture: a folder with a file of a `PictureJob` and of arrays, written by `pictures`, read by `render_child`.

Arrays: times (s,); points_i (s,x,3) and values_i (s,x) of body i; joint_j (s,3) of joint j; place_of_j (s,3), (s,0) of gravity, and
aim_j (s,3) of arrow j. A body that is a surface also has
quads_i (f,4), edges_i (i,2), the pairs of points between which its outline is drawn, and place_i (x,), see `surfaces`.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ..core import container
from ..core.records import dataclass

Arrays: TypeAlias = dict[str, np.ndarray]

ORDER = "order.h5"
KIND = container.FileKind("fmbs_skfem picture", "the order of a picture", 1, "draw it again")


@dataclass(frozen=True)
class PictureJob:
    """Everything about a picture that is not an array."""

    layout: str  #: "overlay", "multiples" or "animation"
    planar: bool
    bodies: tuple[str, ...]
    radii: tuple[float, ...]  #: of lines; half the thickness of surfaces [m]
    kinds: tuple[str, ...]  #: of the joints
    label: str  #: text beside the colour scale; empty: every body has its own colour
    limits: tuple[float, float]  #: of the colour scale
    logarithmic: bool
    colours: str  #: colour map of matplotlib for fields of one sign; empty: viridis without its palest end
    size: tuple[int, int]  #: width, height [pixel]
    title: str
    clock: str  #: unit of the times, or "load factor"
    rate: float  #: frames a second
    target: str  #: file name of the picture in the folder
    captions: tuple[str, ...] = ()  #: of the drawn instants, in place of their times
    behind: bool = False  #: the first instant is drawn pale behind each of the others
    arrows: tuple[str, ...] = ()  #: kinds of the arrows

    @property
    def diverging(self) -> bool:
        """True where the scale runs to both sides of zero."""
        return not self.logarithmic and self.limits[0] < 0 < self.limits[1]


def save(folder: Path, job: PictureJob, arrays: Arrays) -> None:
    """Write the order into `folder`."""
    container.write(folder / ORDER, KIND, job=asdict(job), arrays=arrays)


def load(folder: Path) -> tuple[PictureJob, Arrays]:
    """Read the order from `folder`."""
    found = container.read(folder / ORDER, KIND, job=dict, arrays=dict)
    return PictureJob(**found["job"]), found["arrays"]
