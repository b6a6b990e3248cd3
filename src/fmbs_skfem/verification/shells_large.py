"""Shells in very large deflections: a slit ring that is wound up, cylinders that are pulled apart and pinched.

Source of the tables: Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, doi 10.1016/j.finel.2003.11.001, sections 3.3, 3.5
and 3.6, shells with shear (10 x 80, 24 x 36 and 48 x 48 elements). Under a point force such a shell deflects without bounds as its
mesh is refined, by an amount that grows with its thickness; a Kirchhoff-Love shell does not. Both agree away from the force.
"""

from __future__ import annotations

import numpy as np

from ..dynamics import outputs, solve_statics
from ..systems import At, System, joints, loads
from .registry import Quantity, case, farthest
from .statics_shells import SZE, cylinder, interpolated, loaded, spaced

SLIT_RING = {  #: load factor: W of the inner and of the outer corner
    0.1: (4.277, 5.876),
    0.2: (6.725, 9.160),
    0.3: (8.340, 11.213),
    0.4: (9.529, 12.661),
    0.5: (10.468, 13.768),
    0.6: (11.257, 14.674),
    0.7: (11.970, 15.469),
    0.8: (12.642, 16.202),
    0.9: (13.282, 16.886),
    1.0: (13.891, 17.528),
}
PULLOUT = {  #: load factor: W under the force, -U at the side of the middle, -U at the side of the free end
    0.025: (0.819, 0.864, 0.872),
    0.1: (1.707, 2.217, 2.293),
    0.2: (2.079, 2.904, 3.106),
    0.3: (2.257, 3.227, 3.452),
    0.4: (2.376, 3.443, 3.632),
    0.5: (2.473, 3.653, 3.718),
    0.525: (2.543, 4.061, 3.580),
    0.6: (2.618, 4.274, 3.452),
    0.8: (2.710, 4.455, 3.332),
    1.0: (2.768, 4.551, 3.269),
}
PINCHED = {0.05: (9.561, -0.233), 0.075: (15.648, -0.922)}  #: load factor: -W under the force, U at the side
RADIUS = 4.953  #: of the cylinder that is pulled apart


def slit_ring(cells: tuple[int, int]) -> System:
    """Radii 6 and 10, t = 0.03, E = 2.1e7, nu = 0; one side of the slit clamped, 0.8 a length across the other."""
    shape = interpolated(
        lambda phi, r: np.stack([r * np.cos(phi), r * np.sin(phi), 0.0 * phi], -1),
        (spaced(2 * np.pi, cells[0]), 6.0 + spaced(4.0, cells[1])),
    )
    held = [joints.Edge("clamp", "plate", ("xi1_min",), slope="z")]
    lift = [loads.EdgeLoad("P", "plate", ("xi1_max",), (0.0, 0.0, 0.8))]
    return loaded(shape, 0.03, 2.1e7, 0.0, held, lift, inner="corner_10", outer="corner_11")


def pulled(cells: int) -> System:
    """An open cylinder of length 10.35, t = 0.094, E = 1.05e7, nu = 0.3125, pulled apart by two forces of 4e4; an eighth of it."""
    shape = cylinder(RADIUS, (spaced(np.pi / 2, cells, 1.0), spaced(10.35 / 2, cells, 1.0)))
    held = [
        joints.Edge("top", "plate", ("xi1_min",), "x", "yz"),
        joints.Edge("side", "plate", ("xi1_max",), "z", "xy"),
        joints.Edge("middle", "plate", ("xi2_min",), "y", "xz"),
    ]
    force = [loads.PointForce("P", At("plate", "corner_00"), (0.0, 0.0, 1e4))]
    return loaded(shape, 0.094, 1.05e7, 0.3125, held, force, top="corner_00", side="corner_10", end="corner_11")


def pinched(cells: int) -> System:
    """R = 100, L = 200, t = 1, E = 3e4, nu = 0.3, rigid diaphragms, 0.075 of two forces of 1.2e4 inwards; an eighth of it."""
    shape = cylinder(100.0, (spaced(np.pi / 2, cells, 1.0), spaced(100.0, cells, 0.7)))
    held = [
        joints.Edge("top", "plate", ("xi1_min",), "x", "yz"),
        joints.Edge("side", "plate", ("xi1_max",), "z", "xy"),
        joints.Edge("middle", "plate", ("xi2_min",), "y", "xz"),
        joints.Edge("diaphragm", "plate", ("xi2_max",), "xz"),
    ]
    force = [loads.PointForce("P", At("plate", "corner_00"), (0.0, 0.0, -0.075 * 3e3))]
    return loaded(shape, 1.0, 3e4, 0.3, held, force, top="corner_00", side="corner_10")


@case("slit-ring", group="statics", source=f"{SZE}, 3.3")
def wound_up() -> list[Quantity]:
    """A ring is slit, clamped on one side and lifted on the other by more than its outer radius."""
    found = outputs(solve_statics(slit_ring((30, 4)), 10))
    wanted = np.array(list(SLIT_RING.values()))
    return [farthest(f"{place} corner", wanted[:, k], found[f"{place}_z"][1:], 0.01) for k, place in enumerate(("inner", "outer"))]


@case("pullout", group="statics", source=f"{SZE}, 3.5")
def pulled_apart() -> list[Quantity]:
    """An open cylinder is pulled apart by two forces; near half of them its sides snap through."""
    path = solve_statics(pulled(8), 40)
    found = outputs(path)
    at = [int(np.argmin(np.abs(path.times - factor))) for factor in PULLOUT]
    wanted = np.array(list(PULLOUT.values()))
    return [
        farthest("side of the middle", wanted[:, 1], RADIUS - found["side_x"][at], 5e-3),
        farthest("side of the free end", wanted[:, 2], RADIUS - found["end_x"][at], 5e-3),
        farthest("under the force", wanted[:, 0], found["top_z"][at] - RADIUS, 0.03),
    ]


@case("pinched-cylinder-large", group="statics", source=f"{SZE}, 3.6")
def pinched_far() -> list[Quantity]:
    """A cylinder on diaphragms is pinched by 16 times its thickness, before its folds begin to travel."""
    found = outputs(solve_statics(pinched(20), 3))
    at, wanted = [2, 3], np.array(list(PINCHED.values()))
    return [
        farthest("under the force", wanted[:, 0], 100.0 - found["top_z"][at], 0.01),
        farthest("side", wanted[:, 1], found["side_x"][at] - 100.0, 0.03),
    ]
