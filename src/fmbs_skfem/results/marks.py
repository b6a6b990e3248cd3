"""Symbols of joints, loads and axes: one table for the key of a picture, for its scene, and for
pages.
"""

from __future__ import annotations

from ..core.storage.records import dataclass

THIN = 0.0045  #: radius of the thinnest tube, over the longest side of what is shown
RADIUS = 3.1  #: of a joint, over that of the thinnest tube
REACH = 22.0  #: length of an arrow, over the radius of the thinnest tube
DARK, PALE, DRIVEN, VIOLET, BRASS, LOAD = (
    "#303030",
    "#7F7F7F",
    "#A83200",
    "#8A63D2",
    "#8C6D1F",
    "#B00058",
)


@dataclass(frozen=True)
class Symbol:
    """A kind of marks, and how it is drawn.

    Forms with their sizes: `ball` radius; `box` half its sides along x, y, z; `cone` radius,
    height; `prism` radius, half its height, sides; `cross` half the length and half the width of
    its bars; `arrow`, `ring` and `axis` of arrows have none.
    """

    kind: str  #: in the key
    marker: str  #: of matplotlib, in the key
    colour: str
    form: str
    sizes: tuple[float, ...] = ()  #: over the radius of a joint
    axis: int = 2  #: of a cone or prism: 0, 1, 2 for x, y, z
    layer: int = 3  #: of a joint in planar scenes, from the back


def make_cube(kind: str, marker: str, colour: str, side: float = 1.4) -> Symbol:
    """The symbol of what ties frames."""
    return Symbol(kind, marker, colour, "box", (side / 2.0,) * 3)


BAR = (2.1, 1.1, 0.65)  #: of what slides
#: markers of a system -> symbol. No two joints look alike, driven ones stand out. A gear is wide
#: and flat, so that it is seen around the ball of the joint that its wheel turns on. The key turns
#: the marker of gravity as it points in the picture
MARKERS = {
    "pin": Symbol("revolute joint", "o", DARK, "ball", (1.0,)),
    "spherical": Symbol("spherical joint", "o", VIOLET, "ball", (1.0,)),
    "universal": Symbol("universal joint", "P", DARK, "cross", (1.7, 0.5)),
    "gear": Symbol("gear", "h", DARK, "prism", (1.6, 0.4, 6), layer=2),
    "own": Symbol("joint", "p", DARK, "prism", (1.3, 0.4, 5)),
    "clamp": make_cube("clamp", "s", DARK, 1.9),
    "weld": make_cube("weld", "D", DARK),
    "edge": make_cube("held edge", "s", VIOLET),
    "prismatic": Symbol("prismatic joint", "d", DARK, "box", BAR),
    "cylindrical": Symbol("cylindrical joint", "d", VIOLET, "box", BAR),
    "bushing": make_cube("bushing", "D", PALE),
    "latch": make_cube("latch", "D", DRIVEN),
    "distance": Symbol("distance", "o", PALE, "ball", (0.7,)),
    "slider": Symbol("slider", "d", PALE, "box", BAR, layer=1),
    "driven_angle": Symbol("driven angle", "^", DRIVEN, "cone", (1.3, 2.6), axis=1),
    "driven_position": Symbol("driven position", ">", DRIVEN, "cone", (1.3, 2.6), axis=0),
    "mass": Symbol("point mass", "o", BRASS, "ball", (1.5,), layer=2),
    "force": Symbol("force", r"$\rightarrow$", LOAD, "arrow"),
    "moment": Symbol("moment", r"$\circlearrowleft$", LOAD, "ring"),
    "gravity": Symbol("gravity", r"$\rightarrow$", "#1F6FA8", "arrow"),
    "axis": Symbol("joint axis", "_", "#5A5A5A", "axis"),
}
SYMBOLS = {one.kind: one for one in MARKERS.values()}
