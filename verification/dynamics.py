r"""Flexible beams in motion: published tables, an independent solver, and what free bodies
conserve.

The independent solver is one global Legendre-spectral rod without shear and rotary inertia,
integrated by Gauss's method of order 6 and converged to the digits given. Its strain is |r'| - 1;
the cable here has (r'.r' - 1)/2, which differs by eps^2/2.
"""

from __future__ import annotations

from functools import cache, partial

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.integrate import solve_ivp

from fmbs_skfem.bodies import Body, body, sections
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    energies,
    energy_drift,
    integrate,
    outputs,
)
from fmbs_skfem.shapes.meshes import polyline, segment
from fmbs_skfem.systems import At, Motion, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .beams import GRAVITY
from .registry import CheckedNumber, case, farthest, order

TIGHT = Newton(tolerance=1e-11)
SPECTRAL = "independent Legendre-spectral rod (recomputed)"

# ------------------------------------------------------------------------------------------------------------- spin-up
SPIN_UP = {  # t: tip displacement relative to the rotating undeformed beam, along and across it
    1.0: (-2.4363043e-05, -0.020543108),
    2.0: (-0.0006058201, -0.10237244),
    4.0: (-0.0067652026, -0.34225384),
    5.0: (-0.012653128, -0.46844198),
    7.0: (-0.018615576, -0.57126171),
    10.0: (-0.0070706628, -0.36276537),
    13.0: (0.00023348777, -0.069196943),
    15.0: (0.00051399181, 0.0012902676),
    18.0: (0.00051387204, -0.0020769846),
    20.0: (0.00051453029, 0.00074332282),
}


def spun_up(end: float, rate: float, time: np.ndarray) -> np.ndarray:
    """Driven angle (s,) [rad]: spun up to the rate [rad/s] until the end [s]."""
    rising = (
        rate / end * (time**2 / 2 + (end / (2 * np.pi)) ** 2 * (np.cos(2 * np.pi * time / end) - 1))
    )
    return np.where(time < end, rising, rate * (time - end / 2))


hub_angle = partial(spun_up, 15.0, 6.0)


@cache
def spin_up(h: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (s,) and tip displacement in the rotating frame (s, 2): L = 10, EA = 2.8e7, EI = 1.4e4,
    rhoA = 1.2.
    """
    section = sections.Given(2.8e7, 1.4e4, 1.2)
    part = body.cable("rod", segment(16, end=(10, 0, 0)), section, dim=2, law=Law.MATERIAL)
    root = At("rod", "left")
    driven: list[joints.Joint] = [
        joints.Pin("hub", root),
        joints.DrivenAngle("motor", root, hub_angle),
    ]
    system = eliminate(
        assemble([part], driven, outputs={"tip": probes.Position(At("rod", "right"))})
    )
    found = integrate(system, GeneralizedAlpha(h), 20.0, TIGHT)
    columns, c, s = outputs(found), np.cos(hub_angle(found.times)), np.sin(hub_angle(found.times))
    x, y = columns["tip_x"], columns["tip_y"]
    return found.times, np.stack([c * x + s * y - 10, c * y - s * x], axis=1)


@case(
    "spin-up",
    group="dynamics",
    source="Simo, Vu-Quoc, J. Appl. Mech. 53 (1986) 855-863, doi 10.1115/1.3171871; digits: "
    + SPECTRAL,
)
def spin_up_of_simo_and_vu_quoc() -> list[CheckedNumber]:
    """A beam spun up to 6 rad/s: tip over 20 s, largest lag, steady extension L (tan(kL)/(kL) - 1),
    k^2 = rhoA w^2/EA.
    """
    exact, runs = np.array(list(SPIN_UP.values())), {}
    for h in (2.5e-3, 1.25e-3):
        runs[h] = spin_up(h)[1][[round(t / h) for t in SPIN_UP]]
    times, tip = spin_up(1.25e-3)
    late, k = tip[times > 16, 0].mean(), 6.0 * np.sqrt(1.2 / 2.8e7) * 10
    errors = [float(np.abs(values - exact).max()) for values in runs.values()]
    return [
        farthest("displacement along", exact[:, 0], runs[1.25e-3][:, 0], 5e-5, "m"),
        farthest("displacement across", exact[:, 1], runs[1.25e-3][:, 1], 5e-5, "m"),
        CheckedNumber("largest lag", -0.5737868, float(tip[:, 1].min()), 1e-5, "m"),
        CheckedNumber(
            "time of the largest lag", 6.761849, float(times[tip[:, 1].argmin()]), 3e-4, "s"
        ),
        CheckedNumber("mean extension after 16 s", 0.00051395446, float(late), 5e-4, "m"),
        CheckedNumber("steady extension", float(10 * (np.tan(k) / k - 1)), float(late), 1e-3, "m"),
        order("order", list(runs), errors, 2.0, 0.05),
    ]


# ------------------------------------------------------------------------------------- the examples of Hou, Liu and Hu
SECTION, MATERIAL = sections.Circular(0.01), sections.Material(1e9, 1800.0)
HOU = "Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690"


spin_angle = partial(spun_up, 1.5, 2 * np.pi)  #: of example 1


@case(
    "rotating-cantilever", group="dynamics", source=HOU + ", example 1; longer digits are our own"
)
def rotating_cantilever() -> list[CheckedNumber]:
    """A planar cantilever on a driven hinge, 100 cells, h = 5e-4 s: largest tip deflection in the
    rotating frame.
    """

    def deflection(cells: int, h: float) -> np.ndarray:
        part, root = (
            body.cable("beam", segment(cells), SECTION, MATERIAL, dim=2),
            At("beam", "left"),
        )
        held: list[joints.Joint] = [
            joints.Pin("hinge", root),
            joints.DrivenAngle("drive", root, spin_angle),
        ]
        system = eliminate(
            assemble([part], held, outputs={"d": probes.Deflection(At("beam", "right"), root)})
        )
        return outputs(integrate(system, GeneralizedAlpha(h), 0.9, TIGHT))["d"]

    found, fine = deflection(100, 5e-4), deflection(25, 6.25e-5)
    errors = [
        float(np.abs(deflection(25, h) - fine[:: round(h / 6.25e-5)]).max()) for h in (1e-3, 5e-4)
    ]
    return [
        CheckedNumber("largest deflection", -0.3176, float(found.min()), 1.6e-4, "m"),
        CheckedNumber(
            "deflection at 0.83 s, converged", -0.3176188, float(fine[13280]), 1e-6, "m", kind="own"
        ),
        order("order", (1e-3, 5e-4), errors, 2.0, 0.05),
    ]


EXUDYN = {1.0: (-1.39851478, -0.31858691, -1.17197463), 2.0: (0.73923065, -0.14984121, -1.42125200)}
CONVERGED = {
    1.0: (-1.39851319, -0.31859187, -1.17197751),
    2.0: (0.7392188, -0.14986117, -1.42123747),
}


@case(
    "double-pendulum-beams",
    group="dynamics",
    source=HOU + ", example 2; digits: Exudyn 1.13.6 (100 ANCF cables a beam, h = 5e-4 s)",
)
def beams_double_pendulum() -> list[CheckedNumber]:
    """Spatial double pendulum of two beams: free end at 1 s and 2 s beside another code, drift of
    the energy.
    """

    def motion(cells: int, h: float, law: Law) -> Trajectory:
        first = body.cable("I", segment(cells), SECTION, MATERIAL, law=law)
        second = body.cable("II", segment(cells, (1, 0, 0), (1, 1, 0)), SECTION, MATERIAL, law=law)
        held = [
            joints.Pin("A", At("I", "left")),
            joints.Pin("B", At("I", "right"), At("II", "left")),
        ]
        sensed = {"C": probes.Position(At("II", "right"))}
        system = eliminate(
            assemble([first, second], held, [loads.Gravity((0, 0, -GRAVITY))], outputs=sensed)
        )
        return integrate(system, GeneralizedAlpha(h), 2.0, Newton(tolerance=1e-10))

    def free_end(found: Trajectory, h: float) -> np.ndarray:
        columns = outputs(found)
        return np.column_stack(
            [columns[f"C_{axis}"][[round(t / h) for t in EXUDYN]] for axis in "xyz"]
        )

    runs = {h: motion(20, h, Law.EXACT) for h in (1e-3, 5e-4)}
    other, exact = (
        free_end(motion(100, 5e-4, Law.MATERIAL), 5e-4),
        np.array(list(CONVERGED.values())),
    )
    drifts = [energy_drift(found) for found in runs.values()]
    return [
        farthest("free end, |r'|^2 in the curvature", list(EXUDYN.values()), other, 2e-6, "m"),
        farthest(
            "free end, exact curvature", exact, free_end(runs[5e-4], 5e-4), 5e-5, "m", kind="own"
        ),
        order("order of the energy", list(runs), drifts, 2.0, 0.05),
    ]


# ------------------------------------------------------------------------------------------------- flexible pendulum
PENDULUM = {  # t: tip, middle, velocity of the tip, energies (kinetic, strain, potential)
    0.3: (
        (0.79648727, -0.60606829),
        (0.39579868, -0.30649088),
        (-2.9186185, -3.8714963),
        (2.986872, 0.0079792796, -2.9948513),
    ),
    0.6: (
        (-0.58428658, -0.81153564),
        (-0.27452156, -0.41859674),
        (-4.4667716, 3.3185722),
        (4.0379857, 0.022424234, -4.06041),
    ),
    1.0: (
        (-0.98763551, 0.051959316),
        (-0.4968163, -0.04010132),
        (0.072239837, -0.21120657),
        (0.044490407, 0.1125422, -0.15703261),
    ),
    1.5: (
        (0.27824094, -0.95948662),
        (0.10971517, -0.48843154),
        (5.5238764, 1.6846436),
        (4.7249607, 0.03507268, -4.7600334),
    ),
    2.0: (
        (0.99894057, -0.011816383),
        (0.49917082, -0.026752179),
        (0.029864174, -1.3315197),
        (0.17630737, 0.011771113, -0.18807848),
    ),
}


@case("flexible-pendulum", group="dynamics", source=SPECTRAL)
def flexible_pendulum() -> list[CheckedNumber]:
    """Planar pendulum L = rhoA = EI = 1, EA = 1e4 from the horizontal: tip, middle, velocity and
    energies over 2 s.
    """
    found, h = [], 2.5e-4
    for name, ancf in (("B-spline", False), ("ANCF", True)):
        section = sections.Given(1e4, 1.0, 1.0)
        part = body.cable("rod", segment(20), section, dim=2, law=Law.MATERIAL, ancf=ancf)
        tip, middle = At("rod", "right"), At("rod", 0.5)
        sensed: dict[str, probes.Probe] = {
            "tip": probes.Position(tip),
            "middle": probes.Position(middle),
        }
        sensed |= {"v": probes.Velocity(tip), "E": probes.Energy()}
        held = [joints.Pin("hinge", At("rod", "left"))]
        system = eliminate(assemble([part], held, [loads.Gravity((0.0, -GRAVITY))], outputs=sensed))
        columns, at = (
            outputs(integrate(system, GeneralizedAlpha(h), 2.0, TIGHT)),
            [round(t / h) for t in PENDULUM],
        )
        names = [
            ("tip_x", "tip_y"),
            ("middle_x", "middle_y"),
            ("v_x", "v_y"),
            ("E_kinetic", "E_strain", "E_potential"),
        ]
        labels = (
            ("tip", 4e-5, "m"),
            ("middle", 8e-5, "m"),
            ("velocity of the tip", 1e-3, "m/s"),
            ("energies", 6e-5, "J"),
        )
        for k, ((label, tolerance, unit), keys) in enumerate(zip(labels, names, strict=True)):
            exact = np.array([row[k] for row in PENDULUM.values()])
            ours = np.column_stack([columns[key][at] for key in keys])
            found.append(farthest(f"{label}, {name}", exact, ours, tolerance, unit))
    return found


# ---------------------------------------------------------------------------------------------------------- free bodies
def momenta(found: Trajectory, part: Body) -> tuple[np.ndarray, np.ndarray]:
    """Linear momentum (s, c) = 1^T M v and angular momentum about the origin (s, 1 or 3) = sum q_i
    x (M v)_i of one body.
    """
    shape = (len(found.times), -1, part.dim)
    x, p = found.x.reshape(shape), np.asarray((found.system.mass @ found.v.T).T).reshape(shape)
    if part.dim == 2:
        spin = (x[:, :, 0] * p[:, :, 1] - x[:, :, 1] * p[:, :, 0]).sum(axis=1)[:, None]
    else:
        spin = np.cross(x, p).sum(axis=1)
    return np.einsum("b,sbc->sc", part.constant, p), spin


def center_of(found: Trajectory, part: Body) -> np.ndarray:
    """Centre of mass (s, c) of one body."""
    weights = part.constant @ part.mass
    return np.einsum(
        "b,sbc->sc",
        weights / (weights @ part.constant),
        found.x.reshape(len(found.times), -1, part.dim),
    )


FLYING = {  # name: EI, M0, ends at t = 2.5, 5, 10, angular momentum and energy after the pulse
    "EI = 500": (500.0, 80.0, 114.20885, 252.4104),
    "EI = 100": (100.0, 30.0, 1.2999822, 108.2132),
}
ENDS = {  # name: t: both ends
    "EI = 500": {
        2.5: (1.9659226, 7.5656396, 8.88621, 0.28939675),
        5.0: (9.5255607, 8.8972606, 12.186863, -0.69896401),
        10.0: (23.831092, 7.7576445, 17.27624, 0.1454443),
    },
    "EI = 100": {
        2.5: (9.5086032, 6.3190078, 2.6544354, 0.066119597),
        5.0: (6.3575294, 1.194796, 14.644156, 6.8134264),
    },
}


def pulse(time: np.ndarray) -> np.ndarray:
    """2 sin^2(pi t/2.5) for 2.5 s, at times (s,) [s]."""
    return np.where(time < 2.5, 2 * np.sin(np.pi * time / 2.5) ** 2, 0.0)


@cache
def flown(
    stiffness: float, moment: float, h: float, duration: float = 10.0
) -> tuple[Trajectory, Body]:
    """Free rod L = 10, EA = 1e4, rhoA = 1 from (6, 0) to (0, 8): force 8 and a moment at its first
    end, a smooth pulse of 2.5 s.
    """
    section = sections.Given(1e4, stiffness, 1.0)
    part = body.cable("rod", segment(20, (6, 0, 0), (0, 8, 0)), section, dim=2, law=Law.MATERIAL)
    end = At("rod", "left")
    pushes: list[loads.Load] = [
        loads.PointForce("F", end, (8.0, 0.0), pulse),
        loads.Moment("M", end, moment, pulse),
    ]
    system = assemble(
        [part],
        [],
        pushes,
        outputs={"a": probes.Position(end), "b": probes.Position(At("rod", "right"))},
    )
    return integrate(system, GeneralizedAlpha(h), duration, TIGHT), part


@case(
    "flying-rod",
    group="dynamics",
    source="after Simo, Vu-Quoc, J. Appl. Mech. 53 (1986) 855-863, doi 10.1115/1.3171871; digits: "
    + SPECTRAL,
)
def flying_rod() -> list[CheckedNumber]:
    """A free rod pushed and turned by a pulse: momenta, centre 3 + 2 (t - 1.25), energy, ends (to
    strains of 1 %).
    """
    found, h = [], 1e-3
    for name, (stiffness, moment, spin, energy) in FLYING.items():
        motion, part = flown(stiffness, moment, h)
        after = motion.times > 2.5 + 0.5 * h
        linear, turning = momenta(motion, part)
        centre = center_of(motion, part)[after]
        line = np.column_stack([3 + 2 * (motion.times[after] - 1.25), np.full(after.sum(), 4.0)])
        total = energies(motion)[:, :2].sum(axis=1)[after]
        columns, at = outputs(motion), [round(t / h) for t in ENDS[name]]
        ends = np.column_stack([columns[key][at] for key in ("a_x", "a_y", "b_x", "b_y")])
        found += [
            farthest(f"linear momentum, {name}", [20.0, 0.0], linear[after], 1e-11, "N s"),
            farthest(f"centre of mass, {name}", line, centre, 1e-7, "m"),
            farthest(f"angular momentum, {name}", spin, turning[after, 0], 8e-4, "N m s"),
            farthest(f"energy, {name}", energy, total, 1e-3, "J"),
            farthest(f"ends, {name}", list(ENDS[name].values()), ends, 2e-3, "m"),
        ]
    return [*found, *flying_orders()]


def flying_orders() -> list[CheckedNumber]:
    """Drift of angular momentum and energy after the pulse."""

    def drift(h: float) -> np.ndarray:
        motion, part = flown(500.0, 80.0, h, 5.0)
        after = motion.times > 2.5 + 0.5 * h
        total = energies(motion)[:, :2].sum(axis=1)
        return np.array([np.ptp(momenta(motion, part)[1][after]), np.ptp(total[after])])

    steps = (2e-3, 1e-3)
    errors = np.array([drift(h) for h in steps])
    return [
        order(f"order of {name}", steps, errors[:, k], 2.0, 0.05)
        for k, name in enumerate(("angular momentum", "energy"))
    ]


@case(
    "free-flight", group="dynamics", source="Conservation of momentum, angular momentum and energy"
)
def free_flight() -> list[CheckedNumber]:
    """A bent rod thrown with spin in space."""
    arc = np.linspace(0.0, np.pi / 2, 7)
    mesh = polyline(np.stack([np.sin(arc), 1 - np.cos(arc), 0.2 * arc], axis=1))
    part = body.cable("rod", mesh, sections.Given(1e3, 1.0, 1.0))
    system = assemble(
        [part], initial={"rod": Motion(velocity=(1.0, -2.0, 0.5), angular_velocity=(0.5, 1.0, 3.0))}
    )
    steps, drifts = (1e-3, 5e-4), []
    for h in steps:
        motion = integrate(system, GeneralizedAlpha(h), 1.0, TIGHT)
        linear, spin = momenta(motion, part)
        drifts.append(float(np.abs(spin - spin[0]).max()))
    return [
        farthest("linear momentum", linear[0], linear, 1e-11, "N s"),
        farthest("angular momentum", spin[0], spin, 2e-6, "N m s"),
        CheckedNumber(
            "change of energy",
            0.0,
            energy_drift(motion),
            3e-4,
            "J",
            scale=float(energies(motion)[0, 0]),
        ),
        order("order of angular momentum", steps, drifts, 2.0, 0.05),
    ]


# -------------------------------------------------------------------------------------------------- flexible slider-crank
CRANK, ROD, RATE = 0.15, 0.3, 150.0  #: r [m], l [m], crank rate [rad/s]
BENDING, DENSITY = 1200.0, 1.0  #: EI [N m2], rhoA [kg/m]
MODES = 4


def linkage(t: float) -> tuple[float, float, float, np.ndarray]:
    """Angle of the chord with its first two derivatives, sin b = -(r/l) sin(w t), and the
    acceleration (2,) of its driven end.
    """
    s, c, ratio = np.sin(RATE * t), np.cos(RATE * t), CRANK / ROD
    b = np.arcsin(-ratio * s)
    rate = -ratio * RATE * c / np.cos(b)
    turn = (ratio * RATE**2 * s + rate**2 * np.sin(b)) / np.cos(b)
    return float(b), float(rate), float(turn), -CRANK * RATE**2 * np.array([c, s])


def modal_rod(times: np.ndarray) -> np.ndarray:
    """Deflection (s,) of the middle from the chord, v = sum_k q_k sin(k pi x/l): N is the axial
    force of the rigid rod,

    rhoA (d2v/dt2 - (db/dt)^2 v + a . n + x d2b/dt2) + EI d4v/dx4 - d/dx (N dv/dx) = 0.
    """
    x, w = (part * ROD / 2 for part in leggauss(30))
    x = x + ROD / 2
    k = np.arange(1, MODES + 1) * np.pi / ROD
    shape, slope = np.sin(np.outer(x, k)), k * np.cos(np.outer(x, k))
    mass, bending, lever = DENSITY * ROD / 2, BENDING * k**4 * ROD / 2, shape.T @ (w * x)

    def motion(t: float, state: np.ndarray) -> np.ndarray:
        b, rate, turn, a = linkage(t)
        along, across = a @ [np.cos(b), np.sin(b)], a @ [-np.sin(b), np.cos(b)]
        q, p = state[:MODES], state[MODES:]
        support = DENSITY * (ROD * across / 2 + ROD**2 * turn / 3 - rate**2 * (lever @ q) / ROD)
        N = support * np.tan(b) - DENSITY * (along * (ROD - x) - rate**2 * (ROD**2 - x**2) / 2)
        force = (
            -DENSITY * (shape.T @ (w * (across + x * turn)))
            - bending * q
            - slope.T @ (w * N * (slope @ q))
        )
        tight = DENSITY * np.tan(b) / ROD * (slope.T @ (w * (slope @ q)))
        return np.concatenate(
            [
                p,
                np.linalg.solve(
                    mass * np.eye(MODES) + np.outer(tight, lever), force + mass * rate**2 * q
                ),
            ]
        )

    span = (0.0, float(times[-1]) + 1e-12)
    found = solve_ivp(
        motion, span, np.zeros(2 * MODES), method="DOP853", rtol=1e-9, atol=1e-12, t_eval=times
    )
    return np.asarray(np.sin(k * ROD / 2) @ found.y[:MODES])


def flexible_rod(h: float, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (s,) and deflection (s,) of the middle of the connecting rod from its chord."""
    part = body.cable(
        "rod",
        segment(12, (CRANK, 0, 0), (CRANK + ROD, 0, 0)),
        sections.Given(1e9, BENDING, DENSITY),
        dim=2,
    )
    ends = {"B": At("rod", "left"), "M": At("rod", ROD / 2), "C": At("rod", "right")}
    circle = (lambda t: CRANK * (np.cos(RATE * t) - 1), lambda t: CRANK * np.sin(RATE * t))
    held: list[joints.Joint] = [
        joints.DrivenPosition("crank", ends["B"], circle),
        joints.Slider("guide", ends["C"], (1.0, 0.0)),
    ]
    turn = -CRANK / ROD * RATE
    start = {"rod": Motion((0.0, CRANK * RATE - CRANK * turn), turn)}
    sensed: dict[str, probes.Probe] = {name: probes.Position(at) for name, at in ends.items()}
    motion = integrate(
        eliminate(assemble([part], held, outputs=sensed, initial=start)),
        GeneralizedAlpha(h),
        duration,
        TIGHT,
    )
    columns = outputs(motion)
    B, M, C = (np.column_stack([columns[f"{name}_x"], columns[f"{name}_y"]]) for name in "BMC")
    chord = (C - B) / np.linalg.norm(C - B, axis=1)[:, None]
    return motion.times, (M - B)[:, 1] * chord[:, 0] - (M - B)[:, 0] * chord[:, 1]


@case(
    "flexible-slider-crank",
    group="dynamics",
    source="Equations: Viscomi, Ayre, J. Eng. Ind. 93 (1971) 251-262; solved by four sine modes with scipy's DOP853",
)
def flexible_slider_crank() -> list[CheckedNumber]:
    """A flexible connecting rod driven at 150 rad/s, two turns: its middle beside linear beam
    theory with axial force.
    """
    times, ours = flexible_rod(1e-5, 4 * np.pi / RATE)
    times, ours = times[::20], ours[::20]
    exact = modal_rod(times)
    return [
        farthest("deflection of the middle", exact, ours, 2e-3, "m"),
        CheckedNumber("largest deflection", float(exact.max()), float(ours.max()), 1e-3, "m"),
    ]
