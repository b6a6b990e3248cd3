"""Rolled sections of steel by their names: IPE, HEA and HEB, with the fillets between web and
flanges.

Source: EN 10365:2017, dimensions in mm.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from ...core.errors import closest
from ...core.storage.records import dataclass
from ...core.values.fields import Context, Takes
from ...core.values.problems import Problem, shown
from . import section_shapes
from .drawn_sections import Drawn
from .section_shapes import Outline

ARC = 5  #: points of a fillet
KNOWN = {
    "IPE80": (80, 46, 3.8, 5.2, 5),
    "IPE100": (100, 55, 4.1, 5.7, 7),
    "IPE120": (120, 64, 4.4, 6.3, 7),
    "IPE140": (140, 73, 4.7, 6.9, 7),
    "IPE160": (160, 82, 5.0, 7.4, 9),
    "IPE180": (180, 91, 5.3, 8.0, 9),
    "IPE200": (200, 100, 5.6, 8.5, 12),
    "IPE220": (220, 110, 5.9, 9.2, 12),
    "IPE240": (240, 120, 6.2, 9.8, 15),
    "IPE270": (270, 135, 6.6, 10.2, 15),
    "IPE300": (300, 150, 7.1, 10.7, 15),
    "IPE330": (330, 160, 7.5, 11.5, 18),
    "IPE360": (360, 170, 8.0, 12.7, 18),
    "IPE400": (400, 180, 8.6, 13.5, 21),
    "HEA100": (96, 100, 5.0, 8.0, 12),
    "HEA120": (114, 120, 5.0, 8.0, 12),
    "HEA140": (133, 140, 5.5, 8.5, 12),
    "HEA160": (152, 160, 6.0, 9.0, 15),
    "HEA180": (171, 180, 6.0, 9.5, 15),
    "HEA200": (190, 200, 6.5, 10.0, 18),
    "HEA220": (210, 220, 7.0, 11.0, 18),
    "HEA240": (230, 240, 7.5, 12.0, 21),
    "HEA260": (250, 260, 7.5, 12.5, 24),
    "HEA280": (270, 280, 8.0, 13.0, 24),
    "HEA300": (290, 300, 8.5, 14.0, 27),
    "HEB100": (100, 100, 6.0, 10.0, 12),
    "HEB120": (120, 120, 6.5, 11.0, 12),
    "HEB140": (140, 140, 7.0, 12.0, 12),
    "HEB160": (160, 160, 8.0, 13.0, 15),
    "HEB180": (180, 180, 8.5, 14.0, 15),
    "HEB200": (200, 200, 9.0, 15.0, 18),
    "HEB220": (220, 220, 9.5, 16.0, 18),
    "HEB240": (240, 240, 10.0, 17.0, 21),
    "HEB260": (260, 260, 10.0, 17.5, 24),
    "HEB280": (280, 280, 10.5, 18.0, 24),
    "HEB300": (300, 300, 11.0, 19.0, 27),
}  #: height, width, web, flange, fillet


def read_name(value: object, context: Context) -> str:
    """The name of a rolled section, with spaces or without."""
    name = str(value).replace(" ", "").upper()
    if not isinstance(value, str) or name not in KNOWN:
        series = "IPE 80 to 400, HEA and HEB 100 to 300"
        raise Problem(series, shown(value) + closest(name, KNOWN))
    return name


@dataclass(frozen=True)
class RolledSection(Drawn, word="rolled"):
    """A rolled I section of EN 10365 by its name, IPE, HEA or HEB, y along its flanges.

    {shape: rolled, profile: IPE 200}
    """

    profile: Annotated[str, Takes(read_name, {"type": "string", "minLength": 1})]

    def outline(self) -> Outline:
        h, b, web, flange, fillet = (1e-3 * one for one in KNOWN[self.profile])
        inner = 0.5 * h - flange
        angle = np.linspace(np.pi, 0.5 * np.pi, ARC)
        y = 0.5 * web + fillet * (1.0 + np.cos(angle))
        z = inner - fillet * (1.0 - np.sin(angle))
        upper = [*zip(y.tolist(), z.tolist(), strict=True), (0.5 * b, inner), (0.5 * b, 0.5 * h)]
        right = [*((y, -z) for y, z in reversed(upper)), *upper]
        left = [(-y, z) for y, z in reversed(right)]
        return section_shapes.Polygon((*right, *left), ())
