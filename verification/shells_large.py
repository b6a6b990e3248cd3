"""Shells in very large deflections: a slit ring that is wound up, cylinders that are pulled apart,
pinched and pushed flat.

Source of the tables: Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, doi
10.1016/j.finel.2003.11.001, sections 3.3 and 3.5 to 3.7, shells with shear (3.3 to 3.6: 10 x 80, 24
x 36 and 48 x 48 elements); the limit of 3.7 without shear is recomputed by an independent
Kirchhoff-Love solver (24 x 24 quartic cells). Under a point force such a shell deflects without
bounds as its mesh is refined, by an amount that grows with its thickness; a Kirchhoff-Love shell
does not. Both agree away from the force.
"""

from __future__ import annotations

import numpy as np

from fmbs_skfem.dynamics import outputs, solve_statics
from fmbs_skfem.shapes import nurbs
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import At, System
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from .registry import CheckedNumber, case, farthest
from .statics_shells import (
    DIAPHRAGM,
    EIGHTH,
    SZE,
    cylinder,
    interpolated,
    loaded,
    semi_cylinder,
    spaced,
)

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
#: load factor: -W under the force, U at the side
PINCHED = {
    0.05: (9.561, -0.233),
    0.075: (15.648, -0.922),
}
FLAT = {  #: load factor: deflection under the force, of the table and without shear
    0.05: (5.421, 5.304),
    0.1: (16.1, 15.776),
    0.15: (27.657, 27.307),
    0.2: (37.582, 37.365),
    0.25: (48.537, 48.658),
    0.3: (66.41, 66.737),
    0.35: (94.669, 95.321),
    0.4: (113.704, 114.123),
    0.45: (124.751, 125.026),
    0.5: (132.653, 133.098),
    0.6: (144.185, 144.485),
    0.7: (152.863, 153.192),
    0.8: (160.015, 158.671),
    0.9: (166.2, 165.531),
    1.0: (171.505, 171.487),
}
RADIUS = 4.953  #: of the cylinder that is pulled apart


def polar(cells: tuple[int, int]) -> Surface:
    """A ring of radii 6 and 10 as quartic splines in polar coordinates, slit along the x-axis."""
    return interpolated(
        lambda phi, r: np.stack([r * np.cos(phi), r * np.sin(phi), 0.0 * phi], -1),
        (spaced(2 * np.pi, cells[0]), 6.0 + spaced(4.0, cells[1])),
    )


def nine_points(cells: tuple[int, int]) -> Surface:
    """The same ring as one quartic patch of the standard NURBS circle: four arcs, `cells` in each."""
    turn = np.arange(9) * np.pi / 4
    size = np.where(np.arange(9) % 2, np.sqrt(2.0), 1.0)
    circle = size[:, None] * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    arcs = np.repeat(np.arange(5) / 4, [3, 2, 2, 2, 3])
    patch = nurbs.Patch(
        arcs, np.array([0.0, 0.0, 1.0, 1.0]), 2, 1, np.repeat(1 / size[:, None], 2, axis=1)
    )
    control = circle[:, None, :] * np.array([6.0, 10.0])[:, None]
    return nurbs.surface(*nurbs.refine(patch, control, *cells, degree=4), join=False)


def slit_ring(shape: Surface) -> System:
    """Radii 6 and 10, t = 0.03, E = 2.1e7, nu = 0; one side of the slit clamped, 0.8 a length
    across the other.
    """
    held = [joints.Edge("clamp", "plate", ("xi1_min",), slope="z")]
    lift = [loads.EdgeLoad("P", "plate", ("xi1_max",), (0.0, 0.0, 0.8))]
    return loaded(shape, 0.03, 2.1e7, 0.0, held, lift, inner="corner_10", outer="corner_11")


def pulled(cells: int) -> System:
    """An open cylinder of length 10.35, t = 0.094, E = 1.05e7, nu = 0.3125, pulled apart by two
    forces of 4e4; an eighth of it.
    """
    shape = cylinder(RADIUS, (spaced(np.pi / 2, cells, 1.0), spaced(10.35 / 2, cells, 1.0)))
    force = [loads.PointForce("P", At("plate", "corner_00"), (0.0, 0.0, 1e4))]
    return loaded(
        shape,
        0.094,
        1.05e7,
        0.3125,
        EIGHTH,
        force,
        top="corner_00",
        side="corner_10",
        end="corner_11",
    )


def pinched(cells: int) -> System:
    """R = 100, L = 200, t = 1, E = 3e4, nu = 0.3, rigid diaphragms, 0.075 of two forces of 1.2e4
    inwards; an eighth of it.
    """
    shape = cylinder(100.0, (spaced(np.pi / 2, cells, 1.0), spaced(100.0, cells, 0.7)))
    force = [loads.PointForce("P", At("plate", "corner_00"), (0.0, 0.0, -0.075 * 3e3))]
    return loaded(
        shape, 1.0, 3e4, 0.3, [*EIGHTH, DIAPHRAGM], force, top="corner_00", side="corner_10"
    )


@case("slit-ring", group="statics", source=f"{SZE}, 3.3")
def wound_up() -> list[CheckedNumber]:
    """A ring is slit, clamped on one side and lifted on the other by more than its outer radius."""
    wanted, found = np.array(list(SLIT_RING.values())), []
    for kind, shape in (("", polar((30, 4))), (", standard NURBS circles", nine_points((8, 4)))):
        got = outputs(solve_statics(slit_ring(shape), 10))
        for k, place in enumerate(("inner", "outer")):
            found.append(
                farthest(f"{place} corner{kind}", wanted[:, k], got[f"{place}_z"][1:], 0.01)
            )
    return found


@case("pullout", group="statics", source=f"{SZE}, 3.5")
def pulled_apart() -> list[CheckedNumber]:
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
def pinched_far() -> list[CheckedNumber]:
    """A cylinder on diaphragms is pinched by 16 times its thickness, before its folds begin to
    travel.
    """
    found = outputs(solve_statics(pinched(20), 3))
    at, wanted = [2, 3], np.array(list(PINCHED.values()))
    return [
        farthest("under the force", wanted[:, 0], 100.0 - found["top_z"][at], 0.01),
        farthest("side", wanted[:, 1], found["side_x"][at] - 100.0, 0.03),
    ]


@case(
    "semi-cylinder-large",
    group="statics",
    source=f"{SZE}, 3.7, isotropic; without shear, recomputed",
)
def pushed_flat() -> list[CheckedNumber]:
    """A clamped semi-cylinder is pushed down by 1.7 radii; its folds travel over the mesh and catch
    on its cells a little.
    """
    # two paths, of which only the first needs short steps: in the second they would meet leaps of
    # folds that catch on cells
    half, whole = (
        101.6 - outputs(solve_statics(semi_cylinder(load, 20, 1.0), 10))["top_z"]
        for load in (1000.0, 2000.0)
    )
    w = [
        half[round(20 * factor)] if factor <= 0.5 else whole[round(10 * factor)] for factor in FLAT
    ]
    wanted = np.array(list(FLAT.values()))
    return [
        farthest(f"deflections, {kind}", wanted[:, k], w, 0.02, "mm")
        for k, kind in enumerate(("table", "without shear"))
    ]
