"""Static deflections of plates and shells, small and large, and load paths of roofs that snap
through.

Sources: Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, doi 10.1016/j.finel.2003.11.001,
whose shell has shear (its tables; limits without shear are recomputed by an independent
Kirchhoff-Love solver, that of the cantilever by a rod with EI = E b t^3/12); Scordelis and Lo, ACI
J. 61 (1964) 539-561 (roof; 0.3006, more digits recomputed); Lindberg, Olson and Cowper, Q. Bull.
Div. Mech. Eng. Natl. Aeronaut. Establ. Ottawa 4 (1969) (pinched cylinder, 164.24 P/(E t));
Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, 2nd ed. 1959, art. 30 and 44
(squares; more digits by Navier and Ritz series).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    ArcLength,
    Trajectory,
    at_load_factor,
    follow_path,
    limit_points,
    outputs,
    solve_statics,
)
from fmbs_skfem.shapes import nurbs
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .beams import TIGHT
from .plates import rectangle
from .plots import LoadPath
from .registry import CheckedNumber, case, farthest, pairs, refined

SZE = "Sze, Liu, Lo (2004), doi 10.1016/j.finel.2003.11.001"
SQUARES = "Timoshenko and Woinowsky-Krieger (1959), art. 30 and 44; more digits by series"
#: interpolation: cells along a quarter of a square
THIN = {
    "ancf": 24,
    "nurbs": 8,
    "bfs": 8,
    "argyris": 4,
}
#: interpolation: cells along a cantilever
CELLS = {
    "ancf": 16,
    "nurbs": 16,
    "bfs": 16,
    "argyris": 8,
}
END_SHEAR = {  #: load factor: -U, W without shear
    0.05: (0.02646439, 0.663645), 0.1: (0.103535, 1.309754), 0.15: (0.2248678, 1.923507), 0.2: (0.3816417, 2.494525),
    0.25: (0.5643119, 3.017224), 0.3: (0.7639769, 3.490126), 0.35: (0.9731361, 3.914693), 0.4: (1.185924, 4.294175),
    0.45: (1.398013, 4.6327), 0.5: (1.606371, 4.934649), 0.55: (1.808983, 5.20429), 0.6: (2.00459, 5.445572),
    0.65: (2.192488, 5.662045), 0.7: (2.372356, 5.856838), 0.75: (2.544141, 6.032681), 0.8: (2.707968, 6.191936),
    0.85: (2.864076, 6.336644), 0.9: (3.012772, 6.468559), 0.95: (3.154406, 6.589197), 1.0: (3.289343, 6.699863),
}  # fmt: skip
SZE_END_SHEAR = {  #: -U, W; its table 1
    0.05: (0.026, 0.663), 0.1: (0.103, 1.309), 0.15: (0.224, 1.922), 0.2: (0.381, 2.493), 0.25: (0.563, 3.015),
    0.3: (0.763, 3.488), 0.35: (0.971, 3.912), 0.4: (1.184, 4.292), 0.45: (1.396, 4.631), 0.5: (1.604, 4.933),
    0.55: (1.807, 5.202), 0.6: (2.002, 5.444), 0.65: (2.19, 5.66), 0.7: (2.37, 5.855), 0.75: (2.541, 6.031),
    0.8: (2.705, 6.19), 0.85: (2.861, 6.335), 0.9: (3.01, 6.467), 0.95: (3.151, 6.588), 1.0: (3.286, 6.698),
}  # fmt: skip
#: -U, W; its exact columns
SZE_ROLL_UP = {
    0.25: (4.361, 7.639),
    0.5: (12.0, 7.639),
    0.75: (14.546, 2.546),
    1.0: (12.0, 0.0),
}
SZE_ROOF = {  #: thickness: P/3000 and deflection of the centre, tables of 3.8, isotropic
    12.7: (
        (0.3473, 3.087),
        (0.6381, 7.057),
        (0.7412, 10.358),
        (0.6182, 14.188),
        (0.2272, 17.657),
        (0.1729, 19.852),
        (0.9643, 28.663),
    ),
    6.35: (
        (0.1182, 5.271),
        (0.1837, 10.799),
        (0.1671, 15.501),
        (0.0083, 17.008),
        (-0.1001, 14.52),
        (-0.1288, 15.778),
        (0.1427, 28.302),
    ),
}
#: largest P/3000, then the least
SZE_ROOF_LIMITS = {
    12.7: (0.7421, 0.1729),
    6.35: (0.1953, -0.1288),
}
HEMISPHERE = {  #: load factor: outwards, inwards, without shear
    0.1: (1.49853, 1.82601), 0.2: (2.32064, 3.23414), 0.3: (2.81834, 4.30457), 0.4: (3.15778, 5.15835),
    0.5: (3.40722, 5.86282), 0.6: (3.59971, 6.45763), 0.7: (3.75343, 6.96833), 0.8: (3.87938, 7.4125), 0.9: (3.98467, 7.80287),
    1.0: (4.07411, 8.14895),
}  # fmt: skip
SZE_HEMISPHERE = {  #: the same, its table
    0.05: (0.855, 0.955), 0.1: (1.499, 1.84), 0.15: (1.969, 2.604), 0.2: (2.321, 3.261), 0.25: (2.596, 3.833),
    0.3: (2.819, 4.339), 0.35: (3.002, 4.79), 0.4: (3.158, 5.196), 0.45: (3.291, 5.565), 0.5: (3.406, 5.902),
    0.55: (3.508, 6.212), 0.6: (3.598, 6.497), 0.65: (3.678, 6.761), 0.7: (3.75, 7.006), 0.75: (3.816, 7.234),
    0.8: (3.875, 7.448), 0.85: (3.929, 7.647), 0.9: (3.979, 7.835), 0.95: (4.025, 8.011), 1.0: (4.067, 8.178),
}  # fmt: skip
SEMI_CYLINDER = {0.1: 15.77627, 0.2: 37.36476}  #: deflection under the load, without shear
SZE_SEMI_CYLINDER = {0.1: 16.1, 0.2: 37.582}
ROOF_FREE, ROOF_CROWN = 0.30059246, -0.04507416  #: Scordelis-Lo, without shear, converged
#: w D/(q a^4) under a uniform load
CLAMPED, HINGED, CANTILEVER = (
    0.0012653191,
    0.00406235266,
    0.1290742231,
)
CLAMPED_POINT, HINGED_POINT = 0.0056121, 0.0116008  #: w D/(P a^2) under a force at the centre
PINCHED = 1.8248e-5  #: deflection under a unit force


# --------------------------------------------------------------------------------------------------------------- surfaces
def spaced(end: float, cells: int, growth: float = 0.0) -> np.ndarray:
    """Knots (cells + 1,) from 0 to `end`, the last span e^growth times as long as the first."""
    s = np.linspace(0.0, 1.0, cells + 1)
    return end * (np.expm1(growth * s) / np.expm1(growth) if growth else s)


def interpolated(
    position: Callable[[np.ndarray, np.ndarray], np.ndarray], knots: tuple[np.ndarray, np.ndarray]
) -> Surface:
    """The quartic spline surface through position(xi1, xi2) at the Greville points; edges that
    coincide are not joined.
    """
    p = 4
    first, second = lines = [
        np.concatenate([np.full(p, one[0]), one, np.full(p, one[-1])]) for one in knots
    ]
    at = [
        np.array([line[k + 1 : k + p + 1].mean() for k in range(len(line) - p - 1)])
        for line in lines
    ]
    control = position(*np.meshgrid(*at, indexing="ij"))
    for axis in (0, 1):
        control = np.moveaxis(
            make_interp_spline(at[axis], np.moveaxis(control, axis, 0), p, lines[axis]).c, 0, axis
        )
    return nurbs.surface({"": nurbs.Patch(first, second, p, p)}, {"": control}, join=False)


def cylinder(radius: float, knots: tuple[np.ndarray, np.ndarray]) -> Surface:
    """(R sin phi, y, R cos phi) over knots (i,), (j,) of phi and y, the load at phi = y = 0."""
    return interpolated(
        lambda phi, y: np.stack([radius * np.sin(phi), y, radius * np.cos(phi)], -1), knots
    )


def mirror(axis: str, *edges: str) -> joints.Edge:
    """Edges in a plane of symmetry normal to an axis."""
    return joints.Edge(f"mirror {axis}", "plate", edges, axis, "xyz".replace(axis, ""))


DIAPHRAGM = joints.Edge("diaphragm", "plate", ("xi2_max",), "xz")
EIGHTH = [mirror("x", "xi1_min"), mirror("z", "xi1_max"), mirror("y", "xi2_min")]  #: of a cylinder


def loaded(
    shape: Surface,
    t: float,
    E: float,
    nu: float,
    held: list[Any],
    load: list[Any],
    rims: dict[str, Rim] | None = None,
    **sensed: str,
) -> System:
    """A plate of thickness t under loads, with the positions of named points as outputs."""
    body = plate("plate", shape, t, Material(E, 1.0, nu), rims=rims)
    sensors = {name: probes.Position(At("plate", place)) for name, place in sensed.items()}
    with warnings.catch_warnings():
        # corners belong to two edges: rows left out there are no surprise
        warnings.simplefilter("ignore", Notice)
        return eliminate(assemble([body], held, load, outputs=sensors))


# ------------------------------------------------------------------------------------------------------------- cantilevers
def cantilever(
    kind: str,
    cells: tuple[int, int],
    length: float,
    load: list[Any],
    rims: dict[str, Rim] | None = None,
) -> System:
    """Sze's cantilevers: b = 1, t = 0.1, E = 1.2e6, nu = 0."""
    held = [joints.Edge("clamp", "plate", ("left",), slope="z")]
    return loaded(rectangle(kind, *cells, length), 0.1, 1.2e6, 0.0, held, load, rims, b="b", c="c")


def tip(found: Trajectory, length: float) -> np.ndarray:
    """-U and W (s, 2) of the end after every step, the mean of both corners."""
    columns = outputs(found)
    x, z = (0.5 * (columns[f"b_{axis}"] + columns[f"c_{axis}"])[1:] for axis in "xz")
    return np.column_stack([length - x, z])


def sheared(kind: str) -> Trajectory:
    """The cantilever of 10 x 1 under an end shear of 4 in twenty steps."""
    load = [loads.EdgeLoad("P", "plate", ("right",), (0.0, 0.0, 4.0))]
    return solve_statics(cantilever(kind, (CELLS[kind], 1), 10.0, load), 20, TIGHT)


def rolled(kind: str, cells: tuple[int, int], steps: int) -> Trajectory:
    """The cantilever of 12 x 1 under an end moment of 50 pi/3 on a rigid edge, which turns by 2 pi."""
    load = [loads.Moment("M", At("plate", "grip"), (0.0, -50 * np.pi / 3, 0.0))]
    return solve_statics(
        cantilever(kind, cells, 12.0, load, {"grip": Rim(("right",), slopes=True)}), steps, TIGHT
    )


def circle(factor: float) -> tuple[float, float]:
    """-U and W of a Kirchhoff-Love strip: theta' = M/(EI l^2), l^2 = 1 - t^2/6 theta'^2, tip at
    l/theta' (sin, 1 - cos).

    Both follow from the energy E t/2 ((l^2 - 1)/2)^2 + E t^3/24 (l theta')^2 a width.
    """
    length, t = 12.0, 0.1
    bend = turn = factor * 50 * np.pi / 3 / (1.2e6 * t**3 / 12)
    for _ in range(50):
        turn = bend / (1 - t**2 / 6 * turn**2)
    radius = np.sqrt(1 - t**2 / 6 * turn**2) / turn
    return float(length - radius * np.sin(turn * length)), float(
        radius * (1 - np.cos(turn * length))
    )


# ----------------------------------------------------------------------------------------------------------------- squares
def square(kind: str, cells: int, t: float, slope: str, load: str = "uniform") -> float:
    """w D/(q a^4) or w D/(P a^2) at the centre of a unit square, a quarter of it, clamped (slope z)
    or hinged ("").
    """
    E, nu = 1e9, 0.3
    D = E * t**3 / (12 * (1 - nu**2))
    size = 1e-6 * D
    held = [
        joints.Edge("support", "plate", ("left", "bottom"), slope=slope),
        mirror("x", "right"),
        mirror("y", "top"),
    ]
    push = (0.0, 0.0, size)
    force = (
        loads.SurfaceLoad("q", "plate", push)
        if load == "uniform"
        else loads.PointForce("P", At("plate", "c"), push)
    )
    system = loaded(rectangle(kind, cells, cells, 0.5, 0.5), t, E, nu, held, [force], centre="c")
    w = float(outputs(solve_statics(system, 1, TIGHT))["centre_z"][-1])
    return w * D / (size if load == "uniform" else 4 * size)


def held(kind: str, cells: int, t: float = 1e-3) -> float:
    """w D/(q a^4) in the middle of the end of a unit square clamped along the other end, half of
    it.
    """
    D = 1e9 * t**3 / (12 * (1 - 0.3**2))
    size = 1e-6 * D
    supports = [joints.Edge("clamp", "plate", ("left",), slope="z"), mirror("y", "top")]
    force = [loads.SurfaceLoad("q", "plate", (0.0, 0.0, size))]
    system = loaded(
        rectangle(kind, cells, cells // 2, 1.0, 0.5), t, 1e9, 0.3, supports, force, end="c"
    )
    return float(outputs(solve_statics(system, 1, TIGHT))["end_z"][-1]) * D / size


# ------------------------------------------------------------------------------------------------------------------ shells
def scordelis_lo(cells: int, degree: int = 3, t: float = 0.25) -> tuple[float, float]:
    """Downward deflections of the free edge and of the crown in the middle, a quarter of the roof,
    by a load of 1e-5.
    """
    small = 1e-5 * (t / 0.25) ** 2
    shape = nurbs.surface(
        *nurbs.cylinder_panel(25.0, 25.0, 0.0, np.radians(40.0), cells, cells, degree)
    )
    held = [
        joints.Edge("diaphragm", "plate", ("xi2_min",), "xz"),
        mirror("x", "xi1_min"),
        mirror("y", "xi2_max"),
    ]
    weight = loads.SurfaceLoad("weight", "plate", (0.0, 0.0, -90.0 * small))
    system = loaded(shape, t, 4.32e8, 0.0, held, [weight], free="corner_11", crown="corner_01")
    found = outputs(solve_statics(system, 1, TIGHT))
    free, crown = (
        float(found[name][0] - found[name][-1]) / small for name in ("free_z", "crown_z")
    )
    return free, crown


def pinched_cylinder(cells: int, growth: float = 2.0) -> float:
    """Deflection under a unit force of a cylinder with rigid diaphragms, an eighth of it."""
    knots = spaced(np.pi / 2, cells, growth), spaced(300.0, cells, growth)
    held, small = [*EIGHTH, DIAPHRAGM], 1e-3
    load = [loads.PointForce("P", At("plate", "corner_00"), (0.0, 0.0, -small / 4))]
    found = outputs(
        solve_statics(
            loaded(cylinder(300.0, knots), 3.0, 3e6, 0.3, held, load, top="corner_00"), 1, TIGHT
        )
    )["top_z"]
    return float(found[0] - found[-1]) / small


def hinged_roof(t: float, cells: int = 6) -> System:
    """R = 2540, 508 x 508, hinged straight edges, E = 3102.75, nu = 0.3, 3000 on the centre; a
    quarter of it.
    """
    shape = nurbs.surface(*nurbs.cylinder_panel(2540.0, 254.0, 0.0, 0.1, cells, cells, 4))
    held = [
        joints.Edge("hinge", "plate", ("xi1_max",)),
        mirror("x", "xi1_min"),
        mirror("y", "xi2_min"),
    ]
    load = [loads.PointForce("P", At("plate", "corner_00"), (0.0, 0.0, -750.0))]
    return loaded(shape, t, 3102.75, 0.3, held, load, centre="corner_00")


def hemisphere(cells: int = 12, growth: float = 1.5) -> System:
    """R = 10, t = 0.04, a hole of 18 degrees, two forces of 400 outwards, two inwards; a quarter of
    it.
    """
    half = spaced(np.pi / 4, cells // 2, growth)
    knots = (
        np.concatenate([half, (np.pi / 2 - half[::-1])[1:]]),
        spaced(np.radians(72.0), cells, growth),
    )
    shape = interpolated(
        lambda a, b: 10.0 * np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], -1),
        knots,
    )
    out, back = At("plate", "corner_00"), At("plate", "corner_10")
    held = [
        mirror("y", "xi1_min"),
        mirror("x", "xi1_max"),
        joints.Slider("height", out, (1.0, 0.0, 0.0)),
    ]
    load = [
        loads.PointForce("A", out, (200.0, 0.0, 0.0)),
        loads.PointForce("B", back, (0.0, -200.0, 0.0)),
    ]
    return loaded(shape, 0.04, 6.825e7, 0.3, held, load, out="corner_00", back="corner_10")


def semi_cylinder(load: float, cells: int = 10, growth: float = 1.5) -> System:
    """R = 101.6, L = 304.8, t = 3, clamped at one end, a force down on the crown of the free end;
    half of it.
    """
    knots = spaced(np.pi / 2, cells, growth), spaced(304.8, cells, growth)
    held = [
        joints.Edge("clamp", "plate", ("xi2_max",), "xyz", "xz"),
        mirror("x", "xi1_min"),
        joints.Edge("ground", "plate", ("xi1_max",), "z", "x"),
    ]
    force = [loads.PointForce("P", At("plate", "corner_00"), (0.0, 0.0, -load / 2))]
    return loaded(cylinder(101.6, knots), 3.0, 2068.5, 0.3, held, force, top="corner_00")


# ------------------------------------------------------------------------------------------------------------------- cases
@case("sze-end-shear", group="statics", source=f"{SZE}, 3.1; rod limit recomputed")
def end_shear() -> list[CheckedNumber]:
    """A strip under end shear, U and W at twenty loads, with every interpolation."""
    found = []
    for kind in CELLS:
        got = tip(sheared(kind), 10.0)
        found.append(farthest(f"tip, {kind}, without shear", list(END_SHEAR.values()), got, 5e-5))
        found.append(farthest(f"tip, {kind}, table", list(SZE_END_SHEAR.values()), got, 6e-4))
    return found


@case("sze-roll-up", group="statics", source=f"{SZE}, 3.2; closed form")
def strip_roll_up() -> list[CheckedNumber]:
    """A strip is rolled up by an end moment; plates stretch by t^2 theta'^2/12 as they bend."""
    found = []
    for kind, cells in (
        ("ancf", (24, 3)),
        ("nurbs", (24, 1)),
        ("bfs", (24, 1)),
        ("argyris", (12, 1)),
    ):
        # four loads; over a quarter turn a step would be shortened
        got = tip(rolled(kind, cells, 8), 12.0)[1::2]
        found.append(
            farthest(
                f"tip, {kind}, without shear", [circle(factor) for factor in SZE_ROLL_UP], got, 2e-4
            )
        )
        found.append(farthest(f"tip, {kind}, table", list(SZE_ROLL_UP.values()), got, 6e-4))
    return found


def squares(
    slope: str, thin: float, uniform: float, force: float, tolerance: float
) -> list[CheckedNumber]:
    """Squares under a uniform load, t/a = `thin`, and under a force at the centre."""
    points = (("nurbs", 12), ("bfs", 8), ("argyris", 6))
    return [
        *(
            CheckedNumber(
                f"uniform load, {kind}", uniform, square(kind, n, thin, slope), 1e-3, "q a^4/D"
            )
            for kind, n in THIN.items()
        ),
        *(
            CheckedNumber(
                f"force, {kind}", force, square(kind, n, 1e-3, slope, "point"), tolerance, "P a^2/D"
            )
            for kind, n in points
        ),
    ]


@case("clamped-squares", group="statics", source=SQUARES)
def clamped_squares() -> list[CheckedNumber]:
    """Clamped squares under a uniform load, t/a = 1e-4, and under a force at the centre."""
    return squares("z", 1e-4, CLAMPED, CLAMPED_POINT, 4e-3)


@case("hinged-squares", group="statics", source=SQUARES)
def hinged_squares() -> list[CheckedNumber]:
    """Hinged squares under a uniform load, and under a force at the centre."""
    return squares("", 1e-3, HINGED, HINGED_POINT, 1e-3)


@case("cantilever-squares", group="statics", source="Legendre-Ritz series (recomputed)")
def cantilever_squares() -> list[CheckedNumber]:
    """Squares clamped along one side under a uniform load, nu = 0.3; the moments at the ends of the
    clamp have no bounds.
    """
    return [
        CheckedNumber(f"middle of the end, {kind}", CANTILEVER, held(kind, n), 2e-3, "q a^4/D")
        for kind, n in THIN.items()
    ]


@case("square-orders", group="statics", source=SQUARES)
def square_orders() -> list[CheckedNumber]:
    """Orders of convergence of the clamped square, t/a = 1e-2."""
    found = []
    for kind, cells, expected in (("ancf", 8, 2.0), ("nurbs", 4, 4.0), ("bfs", 4, 4.0)):
        error = partial(lambda kind, n: abs(square(kind, n, 1e-2, "z") - CLAMPED), kind)
        found.append(refined(f"order, {kind}", (cells, 2 * cells), error, expected, 0.12))
    return found


@case(
    "scordelis-lo",
    group="statics",
    source="Scordelis and Lo, ACI J. 61 (1964) 539-561; without shear, recomputed",
)
def roof() -> list[CheckedNumber]:
    """A roof on diaphragms under its weight."""
    free, crown = scordelis_lo(16)
    return [
        CheckedNumber("free edge, published", 0.3006, free, 5e-4, "ft"),
        CheckedNumber("free edge, converged", ROOF_FREE, free, 1e-5, "ft"),
        CheckedNumber("crown, converged", ROOF_CROWN, crown, 2e-5, "ft"),
        CheckedNumber(
            "free edge, quartics on 8 x 8 cells", ROOF_FREE, scordelis_lo(8, 4)[0], 3e-6, "ft"
        ),
    ]


@case(
    "pinched-cylinder",
    group="statics",
    source="Lindberg, Olson and Cowper (1969): 164.24 P/(E t) = 1.8249e-5",
)
def pinched() -> list[CheckedNumber]:
    """A cylinder with rigid diaphragms under two opposite forces, linear."""
    return [CheckedNumber("deflection under a force", PINCHED, pinched_cylinder(12), 2e-3)]


def roof_path(t: float, tolerance: float) -> list[CheckedNumber]:
    """Deflections on all branches beside Sze's table, the equilibrium at the table's load that is
    nearest, and both limit loads.
    """
    path = follow_path(hinged_roof(t), ArcLength(0.05, wanted=3))
    found = []
    for load, deflection in SZE_ROOF[t]:
        w = 2540.0 - outputs(at_load_factor(path, load))["centre_z"]
        found.append(float(w[np.argmin(np.abs(w - deflection))]))
    table = np.array(SZE_ROOF[t])
    ours = pairs(2540.0 - outputs(path)["centre_z"], 3000 * path.times)
    shown = LoadPath(
        ours, pairs(table[:, 1], 3000 * table[:, 0]), "deflection of the centre [mm]", "load P [N]"
    )
    limits = 3000 * path.times[limit_points(path)]
    names = ("limit load, largest of the table", "second limit load, least of the table")
    return [
        farthest("deflections along the path", table[:, 1], found, 6e-3, "mm", curve=shown),
        *(
            CheckedNumber(name, 3000 * wanted, float(got), tolerance, "N")
            for name, wanted, got in zip(names, SZE_ROOF_LIMITS[t], limits, strict=True)
        ),
    ]


@case("hinged-roof", group="statics", source=f"{SZE}, 3.8, isotropic, t = 12.7")
def thick_roof() -> list[CheckedNumber]:
    """A hinged roof snaps through; the least load of the table is at one of its steps, beside the
    limit point.
    """
    return roof_path(12.7, 0.02)


@case("hinged-roof-thin", group="statics", source=f"{SZE}, 3.8, isotropic, t = 6.35")
def thin_roof() -> list[CheckedNumber]:
    """A thinner hinged roof snaps back too: load and deflection fall together."""
    return roof_path(6.35, 3e-3)


@case("hemisphere", group="statics", source=f"{SZE}, 3.4; without shear, recomputed")
def open_hemisphere() -> list[CheckedNumber]:
    """A hemisphere with a hole, pulled and pushed by four forces."""
    path = follow_path(hemisphere(), ArcLength(0.02, wanted=8, turn=0.6))
    got = {}
    for factor in SZE_HEMISPHERE:
        at = outputs(at_load_factor(path, factor))
        got[factor] = at["out_x"][0] - 10.0, 10.0 - at["back_y"][0]
    return [
        farthest(
            "outwards and inwards, without shear",
            list(HEMISPHERE.values()),
            [got[f] for f in HEMISPHERE],
            1.5e-3,
        ),
        farthest(
            "outwards and inwards, table", list(SZE_HEMISPHERE.values()), list(got.values()), 6e-3
        ),
    ]


@case("semi-cylinder", group="statics", source=f"{SZE}, 3.7, isotropic; without shear, recomputed")
def pinched_semi_cylinder() -> list[CheckedNumber]:
    """A clamped semi-cylinder with a force on its free end, up to a fifth of the table's largest
    load.
    """
    path = solve_statics(semi_cylinder(400.0), 2)
    w = 101.6 - outputs(path)["top_z"][1:]
    return [
        farthest("deflections, without shear", list(SEMI_CYLINDER.values()), w, 3e-3, "mm"),
        farthest("deflections, table", list(SZE_SEMI_CYLINDER.values()), w, 1e-2, "mm"),
    ]
