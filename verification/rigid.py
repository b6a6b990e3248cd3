r"""Rigid bodies, mass points and stiff beams against the exact motions of pendulums, a top and a
slider-crank.

simple and spherical pendulum     elliptic functions              slider-crank   x = r cos phi + sqrt(l^2 - r^2 sin^2 phi)
double pendulum, heavy top        minimal coordinates, to 1e-12   compound rod   T = 4 sqrt(2 L/(3 g)) K(sin 45 deg)
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from fmbs_skfem.bodies import Body, body, sections
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    energies,
    energy_drift,
    integrate,
    outputs,
)
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .beams import GRAVITY
from .integrator import mass_pendulum
from .registry import CheckedNumber, case, farthest, order

TIGHT = Newton(tolerance=1e-13)
RECOMPUTED = "(recomputed to 12 digits)"


def rod(
    name: str,
    start: Sequence[float] | np.ndarray,
    end: Sequence[float] | np.ndarray,
    mass: float,
    dim: int = 2,
) -> Body:
    """Uniform rod with places `s` and `e` at start (c,) and end (c,) [m]; in space with a tenth of
    the moment about itself.
    """
    a, b = np.array(start, dtype=float), np.array(end, dtype=float)
    u, inertia = (b - a) / np.linalg.norm(b - a), mass * float((b - a) @ (b - a)) / 12
    turn = np.eye(dim)
    turn[:2, :2] = [[u[0], -u[1]], [u[1], u[0]]]
    rest = (0.0,) * (dim - 2)
    moments = inertia if dim == 2 else np.array([0.1 * inertia, inertia, inertia])
    places = {"s": (*a, *rest), "e": (*b, *rest)}
    return rigid(name, mass, moments, (*(a + b) / 2, *rest), dim=dim, rotation=turn, places=places)


def run(
    system: System, h: float, duration: float, rho: float = 0.8, every: int = 1
) -> dict[str, np.ndarray]:
    """Outputs (s,) of a run by column."""
    return outputs(integrate(system, GeneralizedAlpha(h, rho), duration, every=every))


# ------------------------------------------------------------------------------------------------------------ pendulums
SIMPLE = {  # t: x, y, vx, vy, tension
    0.5: (-0.391048791551, -0.920369948785, 3.91104800396, -1.66173460755, 27.0864875927),
    1.0: (0.986291751132, -0.165010853126, 0.296905515916, 1.77464364111, 4.85626940748),
    2.0: (-0.793566195343, -0.608483930444, -2.10243787444, 2.74193539301, 17.907682073),
    5.0: (-0.942305435044, -0.334754338414, 0.857904256886, -2.41492865437, 9.85182017952),
    10.0: (-0.275087462576, -0.961419205099, 4.17559810095, -1.19474905456, 28.2945672061),
}
IFTOMM = (
    "IFToMM multibody benchmark A01 (simple pendulum), https://www.iftomm-multibody.org/benchmark/; elliptic functions "
    + RECOMPUTED
)


@case("simple-pendulum", group="rigid", source=IFTOMM)
def simple_pendulum() -> list[CheckedNumber]:
    """Mass on a massless link, from the horizontal at rest: position, velocity and tension over 10
    s.
    """
    times = np.array(list(SIMPLE))

    def states(h: float) -> np.ndarray:
        found = integrate(mass_pendulum((-1, 0)), GeneralizedAlpha(h, 0.9), 10.0, TIGHT)
        return np.column_stack([found.x, found.v, found.multipliers])[
            np.round(times / h).astype(int)
        ]

    exact = np.array(list(SIMPLE.values()))
    runs = {h: states(h) for h in (5e-4, 2.5e-4)}
    fine = runs[2.5e-4]
    return [
        farthest("position", exact[:, :2], fine[:, :2], 5e-5, "m"),
        farthest("velocity", exact[:, 2:4], fine[:, 2:4], 5e-5, "m/s"),
        farthest("tension", exact[:, 4], fine[:, 4], 5e-5, "N"),
        order(
            "order",
            list(runs),
            [float(np.abs(values - exact).max()) for values in runs.values()],
            2.0,
            0.02,
        ),
    ]


FACTORS = {
    10: 1.00190718814,
    45: 1.0399733432,
    90: 1.18034059902,
    135: 1.52794758823,
    170: 2.43936271967,
}


def period(amplitude: float, h: float) -> float:
    """Time [s] of two passes of a mass pendulum from its amplitude [deg] through the vertical in
    the same direction.
    """
    angle = np.radians(amplitude)
    about = 2 * np.pi * np.sqrt(1 / GRAVITY) * 3.0
    found = integrate(
        mass_pendulum((np.sin(angle), -np.cos(angle))), GeneralizedAlpha(h, 0.9), 1.5 * about, TIGHT
    )
    x, v = found.x[:, 0], found.v[:, 0]
    down = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))[:2]
    s = x[down] / (x[down] - x[down + 1])
    for _ in range(4):  # the cubic through positions and velocities at both ends of the step
        value, slope = hermite(s, h, x, v, down)
        s = s - value / slope
    first, second = found.times[down] + s * h
    return float(second - first)


def hermite(
    s: np.ndarray, h: float, x: np.ndarray, v: np.ndarray, k: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cubic interpolation of x (s,), rates v (s,), in the steps k (i,) at the fractions s (i,):
    value (i,) and derivative by s.
    """
    a, b, c, d = x[k], h * v[k], x[k + 1], h * v[k + 1]
    value = (
        a * (1 + 2 * s) * (1 - s) ** 2
        + b * s * (1 - s) ** 2
        + c * s**2 * (3 - 2 * s)
        + d * s**2 * (s - 1)
    )
    slope = (c - a) * 6 * s * (1 - s) + b * (1 - s) * (1 - 3 * s) + d * s * (3 * s - 2)
    return value, slope


@case(
    "pendulum-period",
    group="rigid",
    source="T = 4 sqrt(L/g) K(sin(A/2)), Abramowitz and Stegun (1964) 17.3, " + RECOMPUTED,
)
def pendulum_period() -> list[CheckedNumber]:
    """Period of a mass pendulum over that of small swings, amplitudes of 10 to 170 degrees."""
    small = 2 * np.pi / np.sqrt(GRAVITY)
    found = [
        CheckedNumber(f"{amplitude} deg", exact, period(amplitude, 1e-3) / small, 1e-5)
        for amplitude, exact in FACTORS.items()
    ]
    return [
        *found,
        order(
            "order, 90 deg",
            (4e-3, 2e-3),
            lambda h: abs(period(90, h) / small - FACTORS[90]),
            2.0,
            0.05,
        ),
    ]


SPHERICAL = {
    0.5: (-0.0799111643573, 0.527284584517, -0.845922675392),
    1.0: (-0.699775404235, -0.492896379466, -0.517075954514),
    2.0: (0.284933682825, 0.773873273722, -0.565626159766),
    5.0: (0.577520942644, -0.195802118017, -0.792547217135),
    10.0: (0.0457825634003, -0.73774860447, -0.673521308861),
}


@case(
    "spherical-pendulum",
    group="rigid",
    source="Landau and Lifshitz, Mechanics, sect. 14; elliptic functions " + RECOMPUTED,
)
def spherical_pendulum() -> list[CheckedNumber]:
    """Mass on a link in space, 30 degrees below the horizontal, 2 m/s across: positions and
    invariants over 10 s.
    """
    times, exact = np.array(list(SPHERICAL)), np.array(list(SPHERICAL.values()))

    def motion(h: float) -> Trajectory:
        start = mass_pendulum((np.sqrt(0.75), 0.0, -0.5), (0.0, 2.0, 0.0))
        return integrate(start, GeneralizedAlpha(h, 0.9), 10.0, TIGHT)

    def error(h: float) -> float:
        return float(np.abs(motion(h).x[np.round(times / h).astype(int)] - exact).max())

    fine = motion(5e-4)
    spin = fine.x[:, 0] * fine.v[:, 1] - fine.x[:, 1] * fine.v[:, 0]
    energy = 0.5 * (fine.v**2).sum(axis=1) + GRAVITY * fine.x[:, 2]
    return [
        farthest("position", exact, fine.x[np.round(times / 5e-4).astype(int)], 2e-5, "m"),
        farthest("angular momentum about z", 1.73205080757, spin, 1e-5, "kg m2/s"),
        farthest("energy", -2.905, energy, 1e-5, "J"),
        order("order", (2e-3, 1e-3), error, 2.0, 0.05),
    ]


DOUBLE = {  # t: x and y of the joint and of the end
    0.5: (0.433292317695, -0.901253442394, 1.29668853623, -1.40577992319),
    1.0: (-0.934807350144, -0.355155202857, -1.66211513582, -1.04146663719),
    2.0: (-0.0826638714224, -0.996577485378, 0.31352477645, -1.91474661756),
    3.0: (0.854758835196, -0.51902536899, 1.33043682514, -1.39864486052),
}


def double_pendulum(parts: Sequence[Body], ends: tuple[str, str]) -> System:
    """Two rods of 1 kg and 1 m pinned to the origin and to each other; outputs B and C."""
    start, end = ends
    a, b = (part.name for part in parts)
    held = [joints.Pin("A", At(a, start)), joints.Pin("B", At(a, end), At(b, start))]
    sensed = {"B": probes.Position(At(a, end)), "C": probes.Position(At(b, end))}
    return eliminate(assemble(parts, held, [loads.Gravity((0, -GRAVITY))], outputs=sensed))


def tips(system: System, h: float, duration: float) -> np.ndarray:
    """B and C (s, 4) [m] at the times of the table up to the duration [s]."""
    found = run(system, h, duration)
    at = [round(t / h) for t in DOUBLE if t <= duration + 1e-9]
    return np.column_stack([found[key][at] for key in ("B_x", "B_y", "C_x", "C_y")])


@case(
    "double-pendulum",
    group="rigid",
    source="Lagrange's equations in two angles, e.g. Goldstein, Classical Mechanics, ch. 1; "
    + RECOMPUTED,
)
def rigid_double_pendulum() -> list[CheckedNumber]:
    """Two rigid rods from the horizontal at rest: joint and end over 3 s."""
    system = double_pendulum(
        [rod("a", (0, 0), (1, 0), 1.0), rod("b", (1, 0), (2, 0), 1.0)], ("s", "e")
    )
    exact = np.array(list(DOUBLE.values()))
    runs = {h: tips(system, h, 3.0) for h in (5e-4, 2.5e-4)}
    errors = [float(np.abs(values - exact).max()) for values in runs.values()]
    return [
        farthest("positions", exact, runs[2.5e-4], 2e-4, "m"),
        order("order", list(runs), errors, 2.0, 0.02),
    ]


@case(
    "stiff-double-pendulum",
    group="rigid",
    source="Lagrange's equations in two angles, e.g. Goldstein, Classical Mechanics, ch. 1; "
    + RECOMPUTED,
)
def stiff_double_pendulum() -> list[CheckedNumber]:
    """Two beams stiff as rods (EA = 1e6 N, EI = 1e5 N m2): the rigid double pendulum over 1 s."""
    section = sections.Given(1e6, 1e5, 1.0)
    parts = [
        body.cable("I", segment(3), section, dim=2),
        body.cable("II", segment(3, (1, 0, 0), (2, 0, 0)), section, dim=2),
    ]
    found = tips(double_pendulum(parts, ("left", "right")), 2.5e-4, 1.0)
    return [farthest("positions", np.array(list(DOUBLE.values())[:2]), found, 1e-4, "m")]


@case(
    "compound-pendulum",
    group="rigid",
    source="T = 4 sqrt(2 L/(3 g)) K(sin 45 deg), Abramowitz and Stegun (1964) 17.3",
)
def compound_pendulum() -> list[CheckedNumber]:
    """A rod from the horizontal, rigid and as a stiff beam: time and kinetic energy at the
    vertical.
    """
    quarter = float(np.sqrt(2 / (3 * GRAVITY)) * 1.8540746773013719)
    beam = body.cable("rod", segment(4), sections.Given(1e6, 1e4, 1.0), dim=2)
    found = []
    for name, part, start, end in (
        ("rigid", rod("rod", (0, 0), (1, 0), 1.0), "s", "e"),
        ("stiff beam", beam, "left", "right"),
    ):
        tip: dict[str, probes.Probe] = {
            "tip": probes.Position(At("rod", end)),
            "v": probes.Velocity(At("rod", end)),
        }
        system = eliminate(
            assemble(
                [part],
                [joints.Pin("pin", At("rod", start))],
                [loads.Gravity((0.0, -GRAVITY))],
                outputs=tip,
            )
        )
        motion = integrate(system, GeneralizedAlpha(2.5e-4), 0.6)
        columns = outputs(motion)
        x, v = columns["tip_x"], columns["v_x"]
        first = int(np.argmax(x < 0))
        crossing = motion.times[first - 1] + 2.5e-4 * x[first - 1] / (x[first - 1] - x[first])
        kinetic = np.interp(
            crossing,
            motion.times,
            0.5 * np.einsum("sn,sn->s", motion.v, (system.mass @ motion.v.T).T),
        )
        found += [
            CheckedNumber(f"quarter period, {name}", quarter, float(crossing), 2e-5, "s"),
            CheckedNumber(f"kinetic energy, {name}", GRAVITY / 2, float(kinetic), 1e-4, "J"),
            CheckedNumber(
                f"speed of the end, {name}",
                float(np.sqrt(3 * GRAVITY)),
                float(np.abs(np.interp(crossing, motion.times, v))),
                1e-3,
                "m/s",
            ),
        ]
    return found


# --------------------------------------------------------------------------------------------------------- heavy top
TOP = {  # t: centre, its velocity, angular velocity in axes of the body, force on the ground
    0.1: (
        (0.421296658925, 0.894571974346, -0.149164700562),
        (3.40853746334, -2.08343795058, -2.86783504501),
        (4.80894133173, 150.0, 1.02830075672),
        (361.056004787, 295.393173011, 212.267171855),
    ),
    0.2: (
        (0.605550561377, 0.598957681795, -0.52398302743),
        (-0.0401630336101, -3.66782378821, -4.23905329885),
        (-2.69159091214, 150.0, 4.91726098989),
        (640.236407992, 148.627711347, -136.929313038),
    ),
    0.5: (
        (-0.702468297057, -0.0211651847018, -0.711400257652),
        (-4.04498189258, 1.77428847936, 3.94140762274),
        (-0.471053101744, 150.0, 5.90108304833),
        (-523.281243514, -404.20617832, -357.336176453),
    ),
    1.0: (
        (0.173343964098, 0.64008859207, -0.748490791134),
        (0.570825303424, -4.58872829634, -3.79195515471),
        (-0.822078101685, 150.0, -5.92329134812),
        (517.600739477, 396.843101489, -404.574925163),
    ),
    1.5: (
        (-0.968165715638, 0.250306062133, -0.00142208385118),
        (1.15402541478, 4.46200160687, -0.296600035943),
        (0.346213784346, 150.0, 4.60535998534),
        (-305.252096349, 100.127795553, 316.352796114),
    ),
    2.0: (
        (-0.150416822746, -0.724165591637, -0.67302226956),
        (-2.74918631258, -3.20271863557, 4.06052314976),
        (0.122233219493, 150.0, -5.8556245892),
        (260.735211311, -613.612698983, -309.716631391),
    ),
}


def body_rates(motion: Trajectory) -> np.ndarray:
    """Angular velocity (s, 3) of a single body in its own axes A: Omega_1 = e_3 . e_2' and
    cyclically.
    """
    lift = motion.system.lift
    axes, rates = (
        np.asarray((lift.matrix @ part.T).T).reshape(-1, 4, 3)[:, 1:]
        for part in (motion.x, motion.v)
    )
    axes = axes + lift.offset.reshape(4, 3)[1:]
    S = np.einsum("skc,slc->skl", axes, rates)
    return np.stack([S[:, 2, 1], S[:, 0, 2], S[:, 1, 0]], axis=1)


@case(
    "heavy-top",
    group="rigid",
    source="Bruels, Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002, doi 10.1115/1.4001370 (digits recomputed)",
)
def heavy_top() -> list[CheckedNumber]:
    """A top of 15 kg with 150 rad/s about its axis, which starts horizontal: centre, velocities and
    reaction over 2 s, energy.
    """
    centre = At("top", "center")
    top = rigid("top", 15.0, (0.234375, 0.46875, 0.234375), (0, 1, 0), places={"foot": (0, 0, 0)})
    system = eliminate(
        assemble(
            [top],
            [joints.Spherical("foot", At("top", "foot"))],
            [loads.Gravity((0, 0, -GRAVITY))],
            outputs={
                "c": probes.Position(centre),
                "v": probes.Velocity(centre),
                "R": probes.Reaction("foot"),
            },
            initial={"top": Motion(angular_velocity=(0, 150, -4.61538))},
        )
    )
    exact = np.array(list(TOP.values())).swapaxes(0, 1)

    def motion(h: float) -> Trajectory:
        return integrate(system, GeneralizedAlpha(h, 0.9), 2.0, TIGHT, every=round(1e-3 / h))

    def states(found: Trajectory) -> np.ndarray:
        columns, at = outputs(found), [round(t / 1e-3) for t in TOP]
        c, v, R = (
            np.column_stack([columns[f"{name}_{axis}"][at] for axis in "xyz"]) for name in "cvR"
        )
        return np.stack([c, v, body_rates(found)[at], -R])

    runs = {h: motion(h) for h in (1e-4, 5e-5)}
    fine = states(runs[5e-5])
    errors = [float(np.abs(states(found)[0] - exact[0]).max()) for found in runs.values()]
    energy = energies(runs[5e-5])[:, 0] + 15 * GRAVITY * outputs(runs[5e-5])["c_z"]
    return [
        farthest("centre", exact[0], fine[0], 1e-4, "m"),
        farthest("velocity of the centre", exact[1], fine[1], 2e-4, "m/s"),
        farthest(
            "angular velocity across the axis",
            exact[2][:, [0, 2]],
            fine[2][:, [0, 2]],
            2e-3,
            "rad/s",
        ),
        farthest("angular velocity about the axis", exact[2][:, 1], fine[2][:, 1], 1e-5, "rad/s"),
        farthest("force on the ground", exact[3], fine[3], 2e-4, "N"),
        farthest("energy", 5435.69679087, energy, 1e-5, "J"),
        order("order", list(runs), errors, 2.0, 0.05),
    ]


@case(
    "free-top",
    group="rigid",
    source="Euler's equations: energy is constant, Goldstein, Classical Mechanics, ch. 5",
)
def free_top() -> list[CheckedNumber]:
    """A free box that spins about its unstable middle axis keeps its energy to second order of the
    step.
    """
    box = rigid("box", 1.0, (0.1, 0.2, 0.25), (0, 0, 0))
    system = assemble([box], initial={"box": Motion(angular_velocity=(0.01, 5.0, 0.0))})
    drift = {
        h: energy_drift(integrate(system, GeneralizedAlpha(h, 0.9), 4.0)) for h in (1e-2, 5e-3)
    }
    return [
        CheckedNumber("change of energy", 0.0, drift[5e-3], 1e-3, "J", scale=2.5),
        order("order", list(drift), list(drift.values()), 2.0, 0.1),
    ]


# ------------------------------------------------------------------------------------------------------ slider-crank
SLIDER = {  # crank angle [deg]: x, x', x'' of the slider: r = 0.15 m, l = 0.3 m, 150 rad/s
    0.0: (0.45, 0.0, -5062.5),
    30.0: (0.420377561533, -16.2811529494, -3881.39911596),
    60.0: (0.34541634566, -24.8898967761, -859.449947462),
    90.0: (0.259807621135, -22.5, 1948.55715851),
    120.0: (0.19541634566, -14.0812463942, 2515.55005254),
    180.0: (0.15, 0.0, 1687.5),
    270.0: (0.259807621135, 22.5, 1948.55715851),
}


def slider_crank(drive: list[joints.Joint], forces: list[Any]) -> System:
    """Crank of 0.15 m, rod of 0.3 m, slider of 0.5 kg on the x-axis; outputs C, phi."""
    pin, end = np.array([0.15, 0.0]), np.array([0.45, 0.0])
    block = rigid("block", 0.5, 1e-3, end, dim=2)
    system = assemble(
        [rod("crank", (0, 0), pin, 0.4), rod("rod", pin, end, 0.8), block],
        [
            joints.Revolute("A", At("crank", "s")),
            joints.Revolute("B", At("crank", "e"), At("rod", "s")),
            joints.Revolute("C", At("rod", "e"), At("block", "center")),
            joints.Prismatic("guide", At("block", "center"), (1, 0)),
            *drive,
        ],
        forces,
        outputs={
            "C": probes.Position(At("block", "frame")),
            "phi": probes.Angle(At("crank", "frame")),
        },
    )
    return eliminate(system)


@case(
    "slider-crank",
    group="rigid",
    source="x = r cos phi + sqrt(l^2 - r^2 sin^2 phi), e.g. Shabana, Dynamics of Multibody Systems, ch. 3",
)
def driven_slider_crank() -> list[CheckedNumber]:
    """A crank driven at 150 rad/s through both dead centres: position, velocity and acceleration of
    the slider.
    """
    system = slider_crank(
        [joints.DrivenAngle("drive", At("crank", "frame"), lambda t: 150 * t)], []
    )
    h = 2 * np.pi / 150 / 3600
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)  # the start at rest is projected onto the drive
        motion = integrate(system, GeneralizedAlpha(h), 4 * np.pi / 150)
    at = [3600 + round(10 * phi) for phi in SLIDER]
    row = system.sensors.matrix[list(system.outputs["C"].rows)[:1]]
    position = outputs(motion)["C_x"][at]
    velocity, acceleration = (np.asarray(row @ part[at].T).ravel() for part in (motion.v, motion.a))
    exact = np.array(list(SLIDER.values()))
    return [
        farthest("position", exact[:, 0], position, 1e-9, "m"),
        farthest("velocity", exact[:, 1], velocity, 1e-5, "m/s"),
        farthest("acceleration", exact[:, 2], acceleration, 1e-4, "m/s2"),
    ]


@case(
    "free-slider-crank",
    group="rigid",
    source="Work of a constant torque M phi is the kinetic energy",
)
def free_slider_crank() -> list[CheckedNumber]:
    """A torque of 5 N m from rest at dead centre over more than three turns."""
    system = slider_crank([], [loads.Moment("torque", At("crank", "frame"), 5.0)])
    motion = integrate(system, GeneralizedAlpha(1e-4), 0.4)
    phi = outputs(motion)["phi"]
    kinetic = 0.5 * np.einsum("sn,sn->s", motion.v, (system.mass @ motion.v.T).T)
    return [farthest("kinetic energy", 5.0 * phi, kinetic, 2e-3, "J")]
