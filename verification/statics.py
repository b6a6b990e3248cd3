"""Large static deflections of beams: closed forms, published numbers, load paths through limit
points.

    roll-up       theta' = M/EI, no stretch (material curvature);  l^2 = 1 + 2 M^2/(EA EI), theta' = M l^2/EI (exact curvature)
    elastica      EI theta'' = -P cos theta under a dead force, EI theta'' = -P cos(theta(L) - theta) under one that follows
    truss         P = EA (H - w)(2 H w - w^2)/L^3,   largest at w = H (1 - 1/sqrt 3)

Cantilevers have L = EI = 1 unless stated. Sources: Mattiasson, Int. J. Numer. Meth. Engng 17 (1981)
145-153, doi 10.1002/nme.1620170113; Gerstmayr and Irschik, J. Sound Vib. 318 (2008) 461-487, doi
10.1016/j.jsv.2008.04.019. More digits than these print come from elliptic integrals; those of Lee's
frame from shooting for the rod with the strain |r'| - 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.dynamics import (
    ArcLength,
    Trajectory,
    at_load_factor,
    follow_path,
    limit_points,
    outputs,
    solve_statics,
)
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .beams import TIGHT
from .plots import LoadPath
from .registry import CheckedNumber, case, farthest, pairs, refined

FINE: dict[str, Any] = {"degree": 5, "continuity": 2}
TURNS = (0.25, 0.5, 1.0, 2.0)  #: end moments over 2 pi EI/L
ELASTICA = {  #: P L^2/EI: shortening and transverse displacement over L
    0.2: (0.002646548341, 0.06636448214),
    1.0: (0.05643323628, 0.3017207738),
    2.0: (0.1606417208, 0.4934574804),
    5.0: (0.3876283607, 0.7137915236),
    10.0: (0.5549955978, 0.8106090249),
    20.0: (0.6838855676, 0.8686958983),
}
FOLLOWER = {  #: P L^2/EI: shortening and transverse displacement over L
    1: (0.0643543305, 0.320641995), 2: (0.232637808, 0.573839063), 3: (0.448335261, 0.72668495), 4: (0.657254214, 0.786168426),
    5: (0.827722125, 0.780690143), 6: (0.950497772, 0.740274364), 8: (1.07386298, 0.633592114), 10: (1.09212318, 0.546983265),
    12: (1.05587006, 0.490320307), 14: (0.990790373, 0.452851019), 15: (0.951498883, 0.437073142),
    16: (0.909038438, 0.421151499), 18: (0.817887156, 0.383359751), 20: (0.724289877, 0.33015766),
    25: (0.538414444, 0.102962763),
}  # fmt: skip
#: displacement [m] and angle [rad] of the tip
GERSTMAYR_IRSCHIK = (
    -0.5085373043259,
    -1.2072398545498,
    -0.98623733026563,
)
#: load P and deflection v below it, at the limit loads
LEE_LIMITS = (
    (1.855673, 48.736987),
    (-0.9414442, 58.213344),
)
LEE_TURNS = ((61.002978, 1.1944075), (50.746251, -0.43804916))  #: v and P where v turns
LEE_PATH = (  #: P, u, v on all branches
    (0.0075189401, 6.3693488e-05, 0.046094441), (0.12044667, 0.014304866, 0.76992725), (0.23366929, 0.057107336, 1.563135),
    (0.3472293, 0.13495062, 2.4415854), (0.46117704, 0.25642916, 3.4271071), (0.57557108, 0.433294, 4.5500215),
    (0.69047786, 0.6820758, 5.8525213), (0.80597003, 1.0265571, 7.3926545), (0.92212514, 1.501338, 9.2477109),
    (1.0390298, 2.1564531, 11.513959), (1.1567975, 3.0622909, 14.297843), (1.2755918, 4.3134658, 17.695707),
    (1.3955858, 6.0319056, 21.769307), (1.5166867, 8.3763319, 26.537539), (1.6376636, 11.580158, 32.004845),
    (1.7531833, 16.067772, 38.223244), (1.8406107, 22.582619, 45.160273), (1.8460117, 30.479927, 51.247537),
    (1.7800128, 37.383141, 55.07591), (1.6842063, 43.265004, 57.505716), (1.5740204, 48.510485, 59.131069),
    (1.4549307, 53.291587, 60.194626), (1.3294236, 57.660855, 60.800898), (1.1989726, 61.618782, 61.002762),
    (1.0646956, 65.151893, 60.838374), (0.92756346, 68.25324, 60.346904), (0.78843727, 70.929431, 59.573428),
    (0.64805995, 73.198993, 58.569156), (0.50705736, 75.087696, 57.391016), (0.36595975, 76.624997, 56.102427),
    (0.22523799, 77.843678, 54.775477), (0.08534916, 78.783716, 53.493728), (-0.053206376, 79.501095, 52.353544),
    (-0.18980757, 80.080228, 51.459189), (-0.32361535, 80.640931, 50.90521), (-0.45351305, 81.322193, 50.749264),
    (-0.57814394, 82.242885, 51.003158), (-0.6958198, 83.48107, 51.669127), (-0.80370639, 85.104318, 52.813181),
    (-0.89471968, 87.247618, 54.702058), (-0.94143629, 90.229828, 58.266361), (-0.87073449, 93.200317, 64.219808),
    (-0.74013874, 94.285995, 69.545809), (-0.60093366, 94.213828, 73.95653), (-0.45868516, 93.498782, 77.649354),
    (-0.3141459, 92.458603, 80.687148), (-0.16775109, 91.323751, 83.127031), (-0.020025906, 90.243618, 85.052969),
    (0.12853856, 89.294108, 86.563421), (0.27758272, 88.49915, 87.751916), (0.4268825, 87.853795, 88.6963),
    (0.57631211, 87.340634, 89.456732), (0.72580595, 86.938972, 90.078008), (0.87533192, 86.629085, 90.593003),
    (1.0248755, 86.393802, 91.025811), (1.1744309, 86.218813, 91.3942), (1.3239965, 86.092458, 91.711404),
    (1.4735724, 86.00533, 91.987397), (1.6231593, 85.949879, 92.229797), (1.772758, 85.920044, 92.444491),
)  # fmt: skip


def tip(system: System, steps: int = 4) -> np.ndarray:
    """Position of the tip in x and y under the full load, (2,)."""
    found = outputs(solve_statics(system, steps, TIGHT))
    return np.array([found["tip_x"][-1], found["tip_y"][-1]])


def cantilever(
    cells: int,
    load: Callable[[At], Any],
    section: sections.Section,
    length: float = 1.0,
    dim: int = 2,
    **options: Any,
) -> System:
    """A beam along x, clamped at its start, with a load on its end; outputs `tip`, `slope` of the
    end, `clamp`, the reaction.
    """
    beam, end = (
        body.cable("beam", segment(cells, end=(length, 0.0, 0.0)), section, dim=dim, **options),
        At("beam", "right"),
    )
    sensed: dict[str, probes.Probe] = {
        "tip": probes.Position(end),
        "slope": probes.Slope(end),
        "clamp": probes.Reaction("clamp"),
    }
    return eliminate(
        assemble([beam], [joints.Clamp("clamp", At("beam", "left"))], [load(end)], outputs=sensed)
    )


def rolled(
    turns: float, dim: int, law: Law, stiffness: float = 1e4, cells: int = 24, **options: Any
) -> np.ndarray:
    """Tip (2,) under the end moment 2 pi turns; EA = `stiffness`."""
    moment = 2 * np.pi * turns
    section = sections.Given(stiffness, 1.0, 1.0)
    options = {**(options or FINE), "law": law}
    value = moment if dim == 2 else (0.0, 0.0, moment)
    return tip(
        cantilever(cells, lambda end: loads.Moment("M", end, value), section, dim=dim, **options),
        max(3, round(10 * turns)),
    )


def circle(turns: float, stiffness: float = np.inf) -> np.ndarray:
    """Tip (2,) of the beam rolled up with EA = `stiffness` and the exact curvature; with infinite
    EA that of material curvature.
    """
    moment = 2 * np.pi * turns
    square = 1 + 2 * moment**2 / stiffness
    k = moment * square
    return np.asarray(np.sqrt(square) / k * np.array([np.sin(k), 1 - np.cos(k)]))


def pushed(
    alpha: float, cells: int = 40, stiffness: float = 1e8, dim: int = 2, **options: Any
) -> np.ndarray:
    """Tip (2,) under a dead transverse force alpha."""
    force = (0.0, alpha, 0.0)[:dim]
    section = sections.Given(stiffness, 1.0, 1.0)
    return tip(
        cantilever(
            cells, lambda end: loads.PointForce("P", end, force), section, dim=dim, **options
        )
    )


def followed(most: int, cells: int = 40) -> np.ndarray:
    """Tips (s, 2) under the transverse forces 0, 1 ... `most` that turn with the end."""
    section = sections.Given(1e8, 1.0, 1.0)
    found = outputs(
        solve_statics(
            cantilever(cells, lambda end: loads.Follower("P", end, (0.0, most)), section, **FINE),
            most,
            TIGHT,
        )
    )
    return np.column_stack([found["tip_x"], found["tip_y"]])


def gerstmayr_irschik(cells: int, **options: Any) -> np.ndarray:
    """Displacement (2,) and angle of the tip of the extensible cantilever L = 2 m, 0.1 m x 0.1 m, E
    = 2.07e11 Pa, F = 3 EI/L^2.
    """
    length, modulus = 2.0, 2.07e11
    force = 3 * modulus * 0.1**4 / 12 / length**2
    options |= {"material": sections.Material(modulus, 7800.0)}
    push = loads.PointForce("F", At("beam", "right"), (0.0, -force))
    system = cantilever(cells, lambda end: push, sections.Rectangular(0.1, 0.1), length, **options)
    found = {
        name: float(values[-1]) for name, values in outputs(solve_statics(system, 4, TIGHT)).items()
    }
    return np.array(
        [found["tip_x"] - length, found["tip_y"], np.arctan2(found["slope_y"], found["slope_x"])]
    )


def lee_frame(cells: int = 20, load: float = 2.0, all_multipliers: bool = False) -> System:
    """Lee's frame: two legs of 120 cm with a rigid corner, hinged at both ends, a force down at 24
    cm from the corner.
    """
    section = sections.Given(720.0 * 6.0, 720.0 * 2.0, 1.0)
    options: dict[str, Any] = {**FINE, "dim": 2, "law": Law.MATERIAL}
    beam = segment(cells, (0.0, 120.0, 0.0), (120.0, 120.0, 0.0))
    beam = replace(beam, point_groups={**beam.point_groups, "loaded": np.array([cells // 5])})
    parts = [
        body.cable("column", segment(cells, end=(0.0, 120.0, 0.0)), section, **options),
        body.cable("beam", beam, section, **options),
    ]
    held: list[joints.Joint] = [
        joints.Pin("foot", At("column", "left")),
        joints.Pin("end", At("beam", "right")),
        joints.Weld("corner", At("column", "right"), At("beam", "left")),
    ]
    at = At("beam", "loaded")
    sensed: dict[str, probes.Probe] = {
        "loaded": probes.Position(at),
        "foot": probes.Reaction("foot"),
        "end": probes.Reaction("end"),
    }
    system = assemble(parts, held, [loads.PointForce("P", at, (0.0, -load))], outputs=sensed)
    return system if all_multipliers else eliminate(system)


def lee_path(
    trajectory: Trajectory, load: float = 2.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """P, u and v of the loaded point along a path, (s,) each."""
    found = outputs(trajectory)
    return load * trajectory.times, found["loaded_x"] - 24.0, 120.0 - found["loaded_y"]


def truss(height: float = 0.1, stiffness: float = 1e4, load: float = 8.0) -> System:
    """Two bars from (-1, 0) and (1, 0), hinged to each other at (0, height), under a force down
    there; they do not buckle.
    """
    apex, section = (0.0, height, 0.0), sections.Given(stiffness, 100.0, 1.0)
    bars = [
        body.cable(name, segment(1, (x, 0.0, 0.0), apex), section, dim=2)
        for name, x in (("a", -1.0), ("b", 1.0))
    ]
    top = At("a", "right")
    held = [
        joints.Pin("foot a", At("a", "left")),
        joints.Pin("foot b", At("b", "left")),
        joints.Pin("apex", top, At("b", "right")),
    ]
    force = loads.PointForce("P", top, (0.0, -load))
    return eliminate(assemble(bars, held, [force], outputs={"apex": probes.Position(top)}))


def truss_load(w: np.ndarray, height: float = 0.1, stiffness: float = 1e4) -> np.ndarray:
    """P (s,) [N] for deflections w (s,) [m] of the truss."""
    return np.asarray(stiffness * (height - w) * (2 * height * w - w**2) / (1 + height**2) ** 1.5)


@case(
    "roll-up", group="statics", source="closed form; Mattiasson (1981), doi 10.1002/nme.1620170113"
)
def roll_up() -> list[CheckedNumber]:
    """A cantilever is rolled up, once and twice, by an end moment."""
    material = [rolled(turns, 2, Law.MATERIAL) for turns in TURNS]
    exact = [rolled(turns, 3, Law.EXACT) for turns in TURNS]

    def error(cells: int) -> float:
        return float(
            np.linalg.norm(rolled(0.5, 2, Law.MATERIAL, cells=cells, degree=3) - circle(0.5))
        )

    return [
        farthest(
            "tip, material curvature", [circle(turns) for turns in TURNS], material, 3e-8, "L"
        ),
        farthest(
            "tip, exact curvature, in space",
            [circle(turns, 1e4) for turns in TURNS],
            exact,
            3e-8,
            "L",
        ),
        refined("order of cubics, half a turn", (8, 16, 32), error, 4.0, 0.05),
    ]


@case(
    "elastica",
    group="statics",
    source="elliptic integrals; Mattiasson (1981), doi 10.1002/nme.1620170113",
)
def elastica() -> list[CheckedNumber]:
    """A cantilever under a dead transverse force, P L^2/EI = 0.2 to 20."""
    wanted = [(1 - u, v) for u, v in ELASTICA.values()]
    return [farthest("tip", wanted, [pushed(alpha, **FINE) for alpha in ELASTICA], 3e-7, "L")]


@case("follower-force", group="statics", source="initial value problem of the inextensible rod")
def follower_force() -> list[CheckedNumber]:
    """A cantilever under a transverse force that turns with its end, P L^2/EI = 1 to 25."""
    wanted = [(1 - u, v) for u, v in FOLLOWER.values()]
    return [farthest("tip", wanted, followed(max(FOLLOWER))[list(FOLLOWER)], 1e-6, "L")]


@case(
    "gerstmayr-irschik",
    group="statics",
    source="Gerstmayr and Irschik (2008), doi 10.1016/j.jsv.2008.04.019, converged",
)
def extensible_cantilever() -> list[CheckedNumber]:
    """A thick cantilever whose stretch counts; its strain |r'| - 1 and ours, (r'.r' - 1)/2, differ
    by 2e-7.
    """
    found = gerstmayr_irschik(64, law=Law.MATERIAL)
    names = (("tip, x", "m"), ("tip, y", "m"), ("angle of the tip", "rad"))
    return [
        CheckedNumber(name, wanted, float(got), 1e-6, unit)
        for (name, unit), wanted, got in zip(names, GERSTMAYR_IRSCHIK, found, strict=True)
    ]


@case("lee-frame", group="statics", source="rod with the strain |r'| - 1, by shooting")
def lee() -> list[CheckedNumber]:
    """A hinged frame snaps through and back: the path of its equilibria, by arc length."""
    path = follow_path(lee_frame(), ArcLength(0.05, wanted=4), TIGHT)
    P, u, v = lee_path(path)
    limits = limit_points(path)
    spline = CubicSpline(
        np.append(0.0, np.cumsum(np.linalg.norm(np.diff(np.stack([u, v])), axis=0))),
        np.stack([v, P], 1),
    )
    turns = spline(np.sort(spline.derivative().roots(extrapolate=False)[0]))[:2]
    rows = []
    for load, *wanted in LEE_PATH:
        _, at_u, at_v = lee_path(at_load_factor(path, load / 2.0, TIGHT))
        rows.append(
            np.array([at_u, at_v])[:, np.argmin(np.hypot(at_u - wanted[0], at_v - wanted[1]))]
        )
    table, paths = np.array(LEE_PATH), {"horizontal": u, "downward": v}
    return [
        CheckedNumber("first limit load", LEE_LIMITS[0][0], float(P[limits[0]]), 1e-6, "N"),
        CheckedNumber("second limit load", LEE_LIMITS[1][0], float(P[limits[1]]), 3e-6, "N"),
        farthest(
            "deflections at the limit loads", [v for _, v in LEE_LIMITS], v[limits], 1e-4, "cm"
        ),
        farthest(
            "deflections where they turn, interpolated",
            [v for v, _ in LEE_TURNS],
            turns[:, 0],
            1e-4,
            "cm",
        ),
        farthest("loads there, interpolated", [P for _, P in LEE_TURNS], turns[:, 1], 3e-3, "N"),
        *(
            farthest(
                f"{name} displacement, {len(table)} points",
                table[:, k],
                np.array(rows)[:, k - 1],
                1e-5,
                "cm",
                curve=LoadPath(
                    pairs(ours, P),
                    pairs(table[:, k], table[:, 0]),
                    "displacement of the load [cm]",
                    "load P [N]",
                ),
            )
            for k, (name, ours) in enumerate(paths.items(), 1)
        ),
    ]


@case("von-mises-truss", group="statics", source="closed form, P = EA (H - w)(2 H w - w^2)/L^3")
def von_mises_truss() -> list[CheckedNumber]:
    """Two shallow bars snap through: the whole path has a closed form."""
    height, load = 0.1, 8.0
    path = follow_path(truss(height, load=load), ArcLength(0.1), TIGHT)
    w = height - outputs(path)["apex_y"]
    summit = height * (1 - np.array([1, -1]) / np.sqrt(3))
    limits = limit_points(path)
    return [
        farthest("limit loads", truss_load(summit, height), load * path.times[limits], 1e-9, "N"),
        farthest("deflections there", summit, w[limits], 1e-5, "m"),
        farthest("loads along the path", truss_load(w, height), load * path.times, 1e-9, "N"),
    ]
