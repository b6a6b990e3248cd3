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

from ...core.errors import InputError, say
from ...core.storage import container, validation
from ...core.storage.records import dataclass

Arrays: TypeAlias = dict[str, np.ndarray]

ORDER = "order.h5"
KIND = container.FileKind("fmbs_skfem picture", "the order of a picture", 1, "draw it again")


@dataclass(frozen=True)
class Look:
    """What a picture shows and how large."""

    field: str | None = None  #: coloured by this field; None: by body
    label: str = ""  #: text beside the colour scale; empty: name and unit of well-known fields
    limits: tuple[float, float] | None = None  #: of the colour scale, SI units; None: those of the drawn instants
    logarithmic: bool = False  #: colour scale by decades
    title: str = ""
    clock: str = "s"  #: unit of the times; "load factor" of equilibria
    size: tuple[int, int] = (1120, 800)  #: width, height [pixel]
    captions: tuple[str, ...] = ()  #: of the drawn instants, in place of their times
    behind: bool = False  #: the first instant is drawn as an outline with each of the others

    def __post_init__(self) -> None:
        if min(self.size) < 200 or max(self.size) > 8000:
            raise InputError(say("pictures: size", "200 to 8000 pixels each way", self.size))
        if self.limits is not None and not self.limits[0] < self.limits[1]:
            raise InputError(say("pictures: limits", "a lower and a larger upper one", self.limits))
        if self.logarithmic and self.limits is not None and self.limits[0] <= 0:
            raise InputError(say("pictures: limits", "positive ones for a logarithmic scale", self.limits))


@dataclass(frozen=True)
class PictureJob:
    """Everything about a picture that is not an array."""

    layout: str  #: "overlay", "multiples" or "animation"
    planar: bool
    bodies: tuple[str, ...]
    radii: tuple[float, ...]  #: of lines; half the thickness of surfaces [m]
    kinds: tuple[str, ...]  #: of the joints
    arrows: tuple[str, ...]  #: kinds of the arrows
    look: Look  #: with the label of its field, empty where every body has its own colour, and limits in the unit of that
    colours: str  #: colour map of matplotlib for fields of one sign; empty: viridis without its palest end
    rate: float  #: frames a second
    target: str  #: file name of the picture in the folder

    @property
    def limits(self) -> tuple[float, float]:
        """Of the colour scale."""
        return self.look.limits or (0.0, 1.0)

    @property
    def diverging(self) -> bool:
        """True where the scale runs to both sides of zero."""
        return not self.look.logarithmic and self.limits[0] < 0 < self.limits[1]


def save(folder: Path, job: PictureJob, arrays: Arrays) -> None:
    """Write the order into `folder`."""
    container.write(folder / ORDER, KIND, job=asdict(job), arrays=arrays)


def load(folder: Path) -> tuple[PictureJob, Arrays]:
    """Read the order from `folder`."""
    found = container.read(folder / ORDER, KIND, job=dict, arrays=dict)
    return validation.build(PictureJob, found["job"], "job"), found["arrays"]
