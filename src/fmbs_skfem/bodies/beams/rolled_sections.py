"""Rolled sections of steel by their names, with their fillets, toes, tapers and rounded corners.

IPE, HEA, HEB, UPN: EN 10365:2017, flanges of UPN get thinner by 8 % towards their toes; angles: EN
10056-1:2017, toes with half the radius of the root; RHS, SHS, CHS of any size: EN 10210-2:2019, hot
finished, radii of corners 1.5 t outside and 1.0 t inside; CFRHS, CFSHS: EN 10219-2:2019, cold
formed, 2.0 t and 1.0 t, above 6 mm 2.5 t and 1.5 t, above 10 mm 3.0 t and 2.0 t. Dimensions in mm.
"""

from __future__ import annotations

import re
from typing import Annotated

from ...core.errors import closest
from ...core.storage.records import dataclass
from ...core.values.fields import Context, Takes
from ...core.values.problems import Problem, shown
from . import section_shapes
from .drawn_sections import Drawn
from .section_shapes import Outline

TAPER = 0.08  #: slope of the flanges of UPN up to 300
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
CHANNELS = {
    "UPN80": (80, 45, 6.0, 8.0, 4.0),
    "UPN100": (100, 50, 6.0, 8.5, 4.5),
    "UPN120": (120, 55, 7.0, 9.0, 4.5),
    "UPN140": (140, 60, 7.0, 10.0, 5.0),
    "UPN160": (160, 65, 7.5, 10.5, 5.5),
    "UPN180": (180, 70, 8.0, 11.0, 5.5),
    "UPN200": (200, 75, 8.5, 11.5, 6.0),
    "UPN220": (220, 80, 9.0, 12.5, 6.5),
    "UPN240": (240, 85, 9.5, 13.0, 6.5),
    "UPN260": (260, 90, 10.0, 14.0, 7.0),
    "UPN280": (280, 95, 10.0, 15.0, 7.5),
    "UPN300": (300, 100, 10.0, 16.0, 8.0),
}  #: height, width, web, flange in the middle of its width, radius of the toe
ANGLES = {
    (20, 20): (3.5, 3),
    (25, 25): (3.5, 3, 4),
    (30, 30): (5, 3, 4),
    (40, 40): (6, 4, 5),
    (50, 50): (7, 4, 5, 6),
    (60, 60): (8, 5, 6, 8),
    (70, 70): (9, 6, 7),
    (80, 80): (10, 8, 10),
    (90, 90): (11, 7, 8, 9, 10),
    (100, 100): (12, 8, 10, 12),
    (120, 120): (13, 10, 12),
    (150, 150): (16, 10, 12, 15),
    (200, 200): (18, 16, 18, 20, 24),
    (30, 20): (4, 3, 4),
    (40, 20): (4, 4),
    (50, 30): (5, 5),
    (60, 40): (6, 5, 6),
    (65, 50): (6, 5),
    (70, 50): (7, 6),
    (75, 50): (7, 6, 8),
    (80, 40): (7, 6, 8),
    (80, 60): (8, 7),
    (100, 50): (8, 6, 8),
    (100, 65): (10, 7, 8, 10),
    (100, 75): (10, 8, 10, 12),
    (120, 80): (11, 8, 10, 12),
    (150, 75): (12, 9, 10, 12, 15),
    (150, 100): (12, 10, 12),
    (200, 100): (15, 10, 12, 15),
    (200, 150): (15, 12, 15),
}  #: legs: fillet, thicknesses


NAMES = (
    *KNOWN,
    *CHANNELS,
    *(f"L{a}X{b}X{t}" for (a, b), (_, *walls) in ANGLES.items() for t in walls),
)
SERIES = "IPE 80 to 400, HEA and HEB 100 to 300, UPN 80 to 300, L 100x50x8, RHS 120x80x5, SHS 60x4, CHS 48.3x3.2 and the like"
NUMBER = r"(\d+(?:\.\d+)?)"
SIZES = re.compile(f"(L|CHS|(?:CF)?[RS]HS){NUMBER}X{NUMBER}(?:X{NUMBER})?")


def read_name(value: object, context: Context) -> str:
    """The name of a rolled section, with spaces or without; equal legs or sides may be given once."""
    name = str(value).replace(" ", "").replace("×", "X").upper()
    series, a, b, t = found.groups() if (found := SIZES.fullmatch(name)) else ("", "", "", "")
    if series.endswith(("L", "SHS")) and not t:
        t = b
        b = a
        name = f"{series}{a}X{a}X{t}"
    hollow = {"CHS": not t, "SHS": a == b, "RHS": bool(t)}.get(series.removeprefix("CF"), False)
    if not isinstance(value, str) or not (name in NAMES or hollow):
        legs = name.rpartition("X")[0]
        alike = ", ".join(one for one in NAMES if legs and one.startswith(f"{legs}X"))
        raise Problem(SERIES, shown(value) + closest(name, NAMES), alike and f"there are {alike}")
    return name


@dataclass(frozen=True)
class RolledSection(Drawn, word="rolled"):
    """A section of European standards by its name: IPE, HEA, HEB, UPN, L; RHS, SHS, CHS hot finished
    and CFRHS, CFSHS cold formed, of any size. Axes and origin are those of `i_section`, `c_section`,
    `l_section`, `hollow` and `tube`: the first number is along z, the second along y.

    {shape: rolled, profile: IPE 200}
    """

    profile: Annotated[str, Takes(read_name, {"type": "string", "minLength": 1})]

    def outline(self) -> Outline:
        if self.profile in KNOWN:
            h, b, web, flange, fillet = (1e-3 * one for one in KNOWN[self.profile])
            return section_shapes.i_shape(b, h, web, flange, fillet)
        if self.profile in CHANNELS:
            h, b, web, flange, toe = (1e-3 * one for one in CHANNELS[self.profile])
            return section_shapes.c_shape(b, h, web, flange, TAPER, flange, toe)
        found = SIZES.fullmatch(self.profile)
        assert found
        h, b, t = (1e-3 * float(one or 0.0) for one in found.groups()[1:])
        if found[1] == "CHS":
            return section_shapes.tube(h, b)
        if found[1] == "L":
            fillet = 1e-3 * ANGLES[int(found[2]), int(found[3])][0]
            return section_shapes.l_shape(b, h, t, t, fillet, 0.5 * fillet)
        outer, inner = 1.5, 1.0
        if found[1].startswith("CF"):
            outer = 2.0 + 0.5 * ((t > 6.0e-3) + (t > 10.0e-3))
            inner = outer - 1.0
        return section_shapes.hollow(b, h, t, t, outer * t, inner * t)
