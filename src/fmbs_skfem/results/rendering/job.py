"""The order for a picture, which `pictures` makes and the process that draws gets whole."""

from __future__ import annotations

from pathlib import Path

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.display import SI, DisplayUnits
from ..colour_scales import ColourScale
from ..frames import Frames


@dataclass(frozen=True)
class PictureOptions:
    """What a picture shows and how large."""

    field: str | None = None  #: coloured by this field; None: by body
    label: str = ""  #: text beside the colour scale, with its SI unit; empty: name and unit of well-known fields
    #: of the colour scale, SI units; None: those of the drawn instants
    limits: tuple[float, float] | None = None
    logarithmic: bool = False  #: colour scale by decades
    title: str = ""
    clock: str = "s"  #: unit of the times; "load factor" of equilibria
    size: tuple[int, int] = (1120, 800)  #: width, height [pixel]
    captions: tuple[str, ...] = ()  #: of the drawn instants, in place of their times
    behind: bool = False  #: the first instant is drawn as an outline with each of the others
    display: DisplayUnits = SI  #: units of the numbers beside the scale bar and the colour scale

    def __post_init__(self) -> None:
        if min(self.size) < 200 or max(self.size) > 8000:
            raise InputError(say("pictures: size", "200 to 8000 pixels each way", self.size))
        if self.limits is not None and not self.limits[0] < self.limits[1]:
            raise InputError(say("pictures: limits", "a lower and a larger upper one", self.limits))
        if self.logarithmic and self.limits is not None and self.limits[0] <= 0:
            raise InputError(
                say("pictures: limits", "positive ones for a logarithmic scale", self.limits)
            )


@dataclass(frozen=True)
class PictureJob:
    """Everything about a picture."""

    layout: str  #: "overlay", "multiples" or "animation"
    frames: Frames  #: the drawn instants; bodies have at most the field that is drawn, (s,x) in the unit of its scale
    planar: bool
    options: PictureOptions
    scale: ColourScale | None  #: of the field; None where every body has its own colour
    rate: float  #: frames a second
    suffix: str  #: of the format, such as .png
    target: Path  #: the file to write
