r"""Natural frequencies of beams, plates, and of a beam that rotates.

beams     omega = (beta L)^2 sqrt(EI/(rhoA L^4))           plates    omega a^2 sqrt(rho t/D),  D = E t^3/(12 (1 - nu^2))
rotating  M z'' + K(x_s) z = 0 about the stretched state x_s in the rotating frame, f(x_s) = Omega^2
M P x_s,
          P the plane of rotation; in the plane omega_lag^2 = omega_flap^2 - Omega^2 for an axis through the root
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fmbs_skfem.bodies import Material, body, sections
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.dynamics import Spin, in_rotating_frame, solve_statics, vibration_modes
from fmbs_skfem.shapes import ancf_plate
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints

from .beams import TIGHT
from .plates import rectangle
from .registry import CheckedNumber, case, farthest, refined


# ------------------------------------------------------------------------------------------------------------- beams
def roots(first: float, equation: Callable[[float], float]) -> np.ndarray:
    """The eight smallest roots beta L > 0 (8,), near (first + k) pi."""
    return np.array(
        [
            brentq(equation, np.pi * (first + k) - 0.5, np.pi * (first + k) + 0.5, xtol=1e-14)
            for k in range(8)
        ]
    )


ROOTS = {  # characteristic equations of Blevins' table, divided by cosh
    "clamped-free": roots(0.5, lambda x: np.cos(x) + 1 / np.cosh(x)),
    "free-free": roots(1.5, lambda x: np.cos(x) - 1 / np.cosh(x)),
    "clamped-clamped": roots(1.5, lambda x: np.cos(x) - 1 / np.cosh(x)),
    "pinned-pinned": roots(1.0, np.sin),
    "clamped-pinned": roots(1.25, lambda x: np.sin(x) - np.cos(x) * np.tanh(x)),
    "free-pinned": roots(1.25, lambda x: np.sin(x) - np.cos(x) * np.tanh(x)),
    "clamped-guided": roots(0.75, lambda x: np.sin(x) + np.cos(x) * np.tanh(x)),
}
RIGID = {"free-free": 3, "free-pinned": 1}  #: rigid motions in the plane
ENDS: dict[str, Callable[[str], list[joints.Joint]]] = {
    "clamped": lambda end: [joints.Clamp(end, At("beam", end))],
    "pinned": lambda end: [joints.Pin(end, At("beam", end))],
    "guided": lambda end: [joints.DrivenAngle(end, At("beam", end), np.zeros_like)],
    "free": lambda end: [],
}
BLEVINS = "Blevins, Formulas for Natural Frequency and Mode Shape (1979), ISBN 978-0442207106, table 8-1 (roots recomputed)"


def beam(supports: str, cells: int, dim: int = 2, EA: float = 1e6, **options: Any) -> System:
    """Beam with EI = rhoA = L = 1; its axial frequencies are above the bending ones of the table."""
    part = body.cable(
        "beam", segment(cells), sections.Given(EA=EA, EI=1.0, rhoA=1.0), dim=dim, **options
    )
    kinds = zip(supports.split("-"), ("left", "right"), strict=True)
    return assemble([part], [joint for kind, end in kinds for joint in ENDS[kind](end)])


def frequencies(supports: str, cells: int, count: int = 5, **options: Any) -> np.ndarray:
    """The first elastic angular frequencies (count,) [rad/s] in the plane."""
    rigid = RIGID.get(supports, 0)
    return vibration_modes(beam(supports, cells, **options), count + rigid).angular_frequencies[
        rigid:
    ]


@case("beam-frequencies", group="vibration", source=BLEVINS)
def beam_frequencies() -> list[CheckedNumber]:
    """Eight bending frequencies of beams with all pairs of supports, quintic cells."""
    return [
        farthest(
            supports,
            np.square(roots),
            frequencies(supports, 24, 8, degree=5),
            1e-6,
            "rad/s",
            each=True,
        )
        for supports, roots in ROOTS.items()
    ]


@case(
    "beam-frequency-error",
    group="vibration",
    source=BLEVINS + "; (beta h)^4/1440: Strang and Fix (1973), sect. 6.3",
)
def beam_frequency_error() -> list[CheckedNumber]:
    """The excess of cubic cells is (beta h)^4/1440, for C1 splines and ANCF alike: third mode, 20
    cells.
    """
    root = ROOTS["clamped-free"][2]
    return [
        CheckedNumber(
            name,
            (root / 20) ** 4 / 1440,
            float(frequencies("clamped-free", 20, **options)[2] / root**2 - 1),
            0.1,
        )
        for name, options in (("C1 cubic", {}), ("ANCF", {"ancf": True}))
    ]


@case(
    "beam-frequency-order",
    group="vibration",
    source="order 2 (p - 1): Strang and Fix, An Analysis of the Finite Element Method (1973)",
)
def beam_frequency_order() -> list[CheckedNumber]:
    """The third frequency of a cantilever converges with order 2 (p - 1)."""
    found, exact = [], ROOTS["clamped-free"][2] ** 2
    rows: tuple[tuple[str, dict[str, Any], int], ...] = (
        ("C1 cubic", {}, 4),
        ("C2 cubic", {"continuity": 2}, 4),
        ("ANCF", {"ancf": True}, 4),
        ("C1 quartic", {"degree": 4}, 6),
        ("C1 quintic", {"degree": 5}, 8),
    )
    for name, options, expected in rows:
        error = partial(
            lambda options, n: frequencies("clamped-free", n, **options)[2] / exact - 1, options
        )
        found.append(refined(name, (8, 16) if expected == 4 else (6, 12), error, expected, 0.08))
    return found


@case("beam-frequencies-space", group="vibration", source=BLEVINS)
def beam_frequencies_space() -> list[CheckedNumber]:
    """In space the bending frequencies of a cantilever come in pairs; the first axial one is pi/2
    sqrt(EA/rhoA)/L.
    """
    found = vibration_modes(beam("clamped-free", 20, dim=3, degree=5), 6).angular_frequencies
    axial = body.cable("bar", segment(10), sections.Given(EA=1.0, EI=1e3, rhoA=1.0), dim=2)
    system = assemble([axial], [joints.Clamp("clamp", At("bar", "left"))])
    exact = np.repeat(np.square(ROOTS["clamped-free"][:3]), 2)
    return [
        farthest("pairs", exact, found, 1e-7, "rad/s", each=True),
        CheckedNumber(
            "axial",
            np.pi / 2,
            float(vibration_modes(system, 1).angular_frequencies[0]),
            1e-6,
            "rad/s",
        ),
    ]


# --------------------------------------------------------------------------------------------------------- rotating
WRIGHT = {  # Omega sqrt(rhoA L^4/EI): first three flapping frequencies, hub radius 0
    0: (3.5160, 22.0345, 61.6972),
    1: (3.6817, 22.1810, 61.8418),
    2: (4.1373, 22.6149, 62.2732),
    3: (4.7973, 23.3203, 62.9850),
    4: (5.5850, 24.2733, 63.9668),
    5: (6.4495, 25.4461, 65.2050),
    6: (7.3604, 26.8091, 66.6839),
    8: (9.2568, 29.9954, 70.2930),
    10: (11.2023, 33.6404, 74.6493),
}


def rotating(spin: float, count: int = 8) -> np.ndarray:
    """Frequencies of a cantilever (EA = 1e9, EI = rhoA = L = 1) along x that rotates about z; (flap
    or lag, mode).
    """
    turning = eliminate(
        in_rotating_frame(beam("clamped-free", 16, dim=3, EA=1e9, degree=5), Spin(spin))
    )
    modes = vibration_modes(turning, count, solve_statics(turning, 1, TIGHT).x[-1])
    share = np.abs((turning.lift.matrix @ modes.shapes).reshape(-1, 3, count)).max(axis=0)
    flap = share[2] > share[1]
    return np.stack([modes.angular_frequencies[flap][:3], modes.angular_frequencies[~flap][:3]])


@case(
    "rotating-beam",
    group="vibration",
    source="Wright, Smith, Thresher, Wang, J. Appl. Mech. 49 (March 1982), hub radius 0; as in Bir, AIAA 2009-1035, table 3a",
)
def rotating_beam() -> list[CheckedNumber]:
    """Flapping and lagging frequencies of a cantilever that rotates about its root (centrifugal
    stiffening).
    """
    found = []
    for spin, exact in WRIGHT.items():
        flap, lag = rotating(float(spin))
        found.append(farthest(f"flap, Omega = {spin}", exact, flap, 3e-5, each=True))
        if spin in (2, 10):
            exact_lag = np.sqrt(flap**2 - spin**2)
            found.append(farthest(f"lag, Omega = {spin}", exact_lag, lag, 1e-6, each=True))
    return found


# ------------------------------------------------------------------------------------------------------------ plates
PLATES = {  # omega a^2 sqrt(rho t/D), nu = 0.3
    "FFFF": (
        13.468197, 19.596137, 24.270201, 34.800889, 34.800891, 61.093234, 61.093234, 63.68613, 69.265399, 77.171694, 105.46038,
        105.46038, 117.10867,
    ),
    "CCCC": (
        35.985191, 73.393846, 73.393846, 108.2165, 131.58077, 132.20479, 165.00041, 165.00041, 210.52184, 210.52184, 220.03268,
        242.15394, 243.14435, 296.33599, 296.33599, 308.90231,
    ),
    "CFFF": (
        3.471005, 8.506202, 21.28392, 27.19869, 30.95424, 54.18368, 61.25349, 64.14204, 70.96101, 92.92685,
    ),
    "SSSS": tuple(np.sort(np.pi**2 * np.add.outer(np.arange(1, 9) ** 2, np.arange(1, 9) ** 2).ravel())[:16]),
    "SSFF": (
        9.6313852, 16.134777, 36.725642, 38.944959, 46.738147, 70.740108, 75.283382, 87.986695, 96.040505, 111.02538,
        122.03999, 133.70458, 156.75249, 164.69591, 164.78661, 169.53772,
    ),
    "SSCC": (
        28.95085, 54.74307, 69.32701, 94.58528, 102.2162, 129.0955, 140.2045, 154.7757, 170.3465, 199.8105, 206.6971, 208.3917,
        234.5855, 258.6136,
    ),
    "CSFF": (
        15.19169, 20.58259, 39.73389, 49.44653, 56.27489, 77.32268, 78.52762, 103.4229, 110.709, 117.2531, 134.8827, 135.2702,
        174.5371, 175.7942,
    ),
    "CCFF": (
        22.16566, 26.40266, 43.59128, 61.1704, 67.16693, 79.81304, 87.58738, 120.0941, 124.4521, 126.7031, 136.8901, 149.3006,
        180.2298, 188.1302,
    ),
    "SFSF": (
        3.367049, 17.31635, 19.29292, 38.21122, 51.03535, 53.48671, 72.96616, 74.62962, 104.7187, 107.2358, 112.5495, 126.8152,
        128.7539, 167.3572,
    ),
}  # fmt: skip
SIDES = ("left", "right", "bottom", "top")  #: of the letters F free, S hinged, C clamped
REGULAR = {"ancf": 24, "fvs": 24, "nurbs": 20, "bfs": 16, "argyris": 8}  #: cells a side
LOWEST = 6  #: modes of plates with slopes at nodes alone, whose relative error grows with the frequency (second order)
THIN = 1e-3  #: t/a, at which rotary inertia and membrane motions play no part
LEISSA = "Leissa, J. Sound Vib. 31 (1973) 257-293, doi 10.1016/S0022-460X(73)80371-2 (Ritz series continued to 7 digits)"


def plate_frequencies(
    kind: str, cells: int, letters: str, count: int, width: float = 1.0, t: float = THIN
) -> np.ndarray:
    """omega a^2 sqrt(rho t/D) (count,) of a plate a = 1 along x by `width`, without rigid motions."""
    across = max(2, round(cells * width))
    part = plate("plate", rectangle(kind, cells, across, 1.0, width), t, Material(1.0, 1.0, 0.3))
    held = [side for side, letter in zip(SIDES, letters, strict=True) if letter != "F"]
    clamped = [side for side, letter in zip(SIDES, letters, strict=True) if letter == "C"]
    edges = [
        joints.Edge(side, "plate", (side,), slope="z" if side in clamped else "") for side in held
    ]
    rigid = {"FFFF": 6, "SFFF": 1}.get(letters, 0)
    found = vibration_modes(eliminate(assemble([part], edges)), count + rigid).angular_frequencies[
        rigid:
    ]
    return found * np.sqrt(12 * (1 - 0.3**2)) / t


@case("plate-frequencies", group="vibration", source=LEISSA)
def square_plates() -> list[CheckedNumber]:
    """Square plates with free (F), hinged (S) and clamped (C) sides x = 0, x = a, y = 0, y = a,
    five interpolations.
    """
    found = []
    for letters, exact in PLATES.items():
        for kind in REGULAR if letters in ("FFFF", "CCCC", "CFFF", "SSSS") else ("nurbs",):
            count, tolerance = (LOWEST, 6e-3) if kind in ("ancf", "fvs") else (len(exact), 1e-3)
            ours = plate_frequencies(kind, REGULAR[kind], letters, count)
            found.append(
                farthest(
                    f"{letters}, {kind}, {count} modes", exact[:count], ours, tolerance, each=True
                )
            )
    return found


ASPECTS = {  # (sides, a/b): omega a^2 sqrt(rho t/D)
    ("FFFF", 0.4): (
        3.432631, 5.27824, 9.540597, 11.32851, 18.62733, 18.9229, 22.44702, 24.44396, 28.749, 31.44949, 31.62937,
    ),
    ("FFFF", 2 / 3): (
        8.931349, 9.517006, 20.59866, 22.1822, 25.65043, 29.79099, 38.1577, 43.92608, 53.3458, 60.04616, 64.919,
    ),
    ("FFFF", 1.5): (
        20.09554, 21.41326, 46.34697, 49.90994, 57.71348, 67.02974, 85.85482, 98.83368, 120.0281, 135.1039, 146.0678,
    ),
    ("FFFF", 2.5): (
        21.45394, 32.989, 59.62873, 70.80316, 116.4208, 118.2681, 140.2939, 152.7748, 179.6813, 196.5593, 197.6835,
    ),
    ("CFFF", 0.4): (
        3.49754, 4.76739, 8.06711, 13.8035, 21.52, 23.0458, 23.5686, 28.7302, 34.6603, 36.6799,
    ),
    ("CFFF", 2 / 3): (
        3.48507, 6.38807, 14.466, 21.9148, 25.9109, 31.448, 38.3798, 56.3801, 56.7043, 61.5816,
    ),
    ("CFFF", 1.5): (
        3.4534, 11.6561, 21.4655, 39.3254, 53.5414, 61.6135, 80.2144, 85.3215, 119.585, 133.862,
    ),
    ("CFFF", 2.5): (
        3.42802, 17.9622, 21.3961, 57.2173, 60.1226, 105.929, 117.841, 143.708, 168.811, 176.321,
    ),
}  # fmt: skip


@case("plate-frequencies-rectangles", group="vibration", source=LEISSA)
def rectangular_plates() -> list[CheckedNumber]:
    """Free and cantilever rectangles a by b."""
    found = []
    for (letters, aspect), exact in ASPECTS.items():
        ours = plate_frequencies("nurbs", 16, letters, len(exact), 1 / aspect)
        found.append(
            farthest(
                f"{letters}, a/b = {aspect:.3g}, {len(exact)} modes", exact, ours, 1e-3, each=True
            )
        )
    return found


@case(
    "plate-frequency-order",
    group="vibration",
    source=LEISSA + "; order 2 (p - 1), 2 for slopes at nodes only",
)
def plate_frequency_order() -> list[CheckedNumber]:
    """The third frequency of the free square."""
    found = []
    for kind, cells, expected in (("ancf", 8, 2), ("fvs", 12, 2), ("nurbs", 6, 4), ("bfs", 4, 4)):
        error = partial(
            lambda kind, n: plate_frequencies(kind, n, "FFFF", 3)[2] / PLATES["FFFF"][2] - 1, kind
        )
        found.append(refined(kind, (cells, 2 * cells), error, expected, 0.1))
    return found


@case(
    "plate-thickness",
    group="vibration",
    source="omega ~ t of Kirchhoff's plate, Timoshenko and Woinowsky-Krieger (1959)",
)
def thickness() -> list[CheckedNumber]:
    """The scaled frequency of a cantilever does not change from t/a = 1e-2 to 1e-4: no locking."""
    found = []
    for kind, cells in REGULAR.items():
        thick, thin = (plate_frequencies(kind, cells, "CFFF", 2, t=t) for t in (1e-2, 1e-4))
        found.append(farthest(kind, np.ones(2), thin / thick, 1e-6))
    return found


def ring(inner: float, outer: float, around: int = 24, across: int = 2) -> Surface:
    """A circular ring of curved ANCF cells with the edges `inner` and `outer`."""
    radii, angles = np.linspace(inner, outer, across + 1), 2 * np.pi * np.arange(around) / around
    points = (radii[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], -1)).reshape(-1, 2)
    ids = np.arange(len(points)).reshape(across + 1, around)
    after = np.roll(ids, -1, axis=1)
    quads = np.stack([ids[:-1], ids[1:], after[1:], after[:-1]], -1).reshape(-1, 4)
    circles = [np.column_stack([ids[k], after[k]]) for k in range(across + 1)]
    arcs = [
        ancf_plate.Arc(np.zeros(2), float(r), circle)
        for r, circle in zip(radii, circles, strict=True)
    ]
    return ancf_plate.surface(points, quads, arcs, {}, {"inner": circles[0], "outer": circles[-1]})


def breathing(cells: int) -> float:
    """Frequency [rad/s] of the mode of a thin free ring in which its radius changes."""
    t, width, E, rho = 0.01, 0.01, 70e9, 2700.0
    part = plate(
        "ring", ring(1.0 - width / 2, 1.0 + width / 2, cells, 1), t, Material(E, rho, 0.0), dim=2
    )
    found = vibration_modes(assemble([part]), 40)
    x = part.reference[::3] / np.linalg.norm(part.reference[::3], axis=1, keepdims=True)
    radial = np.einsum("nc,ncr->r", x, found.shapes.reshape(-1, 3, 2, 40)[:, 0])
    return float(found.angular_frequencies[np.argmax(np.abs(radial))])


@case(
    "breathing-ring",
    group="vibration",
    source="closed formula omega = sqrt(E/rho)/R of a thin ring",
)
def breathing_ring() -> list[CheckedNumber]:
    """A thin ring of curved ANCF cells breathes with omega = sqrt(E/rho)/R, up to (width/R)^2/12."""
    return [CheckedNumber("omega", float(np.sqrt(70e9 / 2700.0)), breathing(48), 2e-5, "rad/s")]
