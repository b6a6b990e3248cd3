r"""Plates and shells under pressure that follows them: a cylinder that grows, a strip that becomes
an arc, a cantilever.

    ring          p R lambda = A lambda (lambda^2 - 1)/2 + B (lambda - 1)/R^2           energy A/2 E^2 + B/2 k^2 an area, exact
    arc           p a = A lambda (lambda^2 - 1)/2 sin(phi),   lambda = phi/sin(phi)     hinged strip of 2 a without bending
    cantilever    N' = k V,  V' = -k N - q,  M' = -V,  theta' = k = M/(E I)             inextensible rod, nothing at its free end

with E = (lambda^2 - 1)/2 and k = (lambda - 1)/R in a section of a long shell, A = E t/(1 - nu^2), B
= A t^2/12; the formula of the arc follows from the tension A lambda E = p r of a circle of radius
r. The equations of the rod run from the free end to the clamp.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from fmbs_skfem.dynamics import outputs, solve_statics
from fmbs_skfem.shapes import nurbs
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from .beams import TIGHT
from .plates import rectangle
from .registry import CheckedNumber, case
from .statics_shells import loaded, mirror

RADIUS, THICK, YOUNG, POISSON = 1.0, 0.05, 1e6, 0.3  #: of the ring [m, m, Pa, 1]
GROWTH = 1.5  #: lambda of the ring
#: half width and thickness of the strip [m], and half the angle of its arc [rad]
HALF, FOIL, RISE = (
    0.5,
    1e-3,
    0.8,
)
LENGTH, SHEET, PUSH = 10.0, 0.05, 0.1  #: of the cantilever [m, m, Pa]


def grown(cells: int) -> float:
    """Radius over R of a quarter of a long cylinder under the pressure that makes it GROWTH."""
    A = YOUNG * THICK / (1 - POISSON**2)
    p = (A * GROWTH * (GROWTH**2 - 1) / 2 + A * THICK**2 / 12 * (GROWTH - 1) / RADIUS**2) / (
        RADIUS * GROWTH
    )
    shape = nurbs.surface(*nurbs.cylinder_panel(RADIUS, 0.5, 0.0, np.pi / 2, cells, 1, 3))
    held = [mirror("y", "xi2_min", "xi2_max"), mirror("x", "xi1_min"), mirror("z", "xi1_max")]
    inside = [loads.Pressure("p", "plate", p, follower=True)]
    found = outputs(
        solve_statics(
            loaded(shape, THICK, YOUNG, POISSON, held, inside, top="corner_00"), 10, TIGHT
        )
    )
    return float(found["top_z"][-1]) / RADIUS


def arched(cells: int) -> float:
    """Rise over half the width of a long hinged strip, half of it in the model, under the pressure
    that bends it to RISE.
    """
    stretch = RISE / np.sin(RISE)
    p = YOUNG * FOIL / (1 - POISSON**2) * stretch * (stretch**2 - 1) / 2 * np.sin(RISE) / HALF
    held = [
        joints.Edge("hinge", "plate", ("left",)),
        mirror("x", "right"),
        mirror("y", "bottom", "top"),
    ]
    push = [loads.Pressure("p", "plate", p, follower=True)]
    system = loaded(
        rectangle("nurbs", cells, 1, HALF, HALF / cells),
        FOIL,
        YOUNG,
        POISSON,
        held,
        push,
        crown="b",
    )
    return float(outputs(solve_statics(system, 20, TIGHT))["crown_z"][-1]) / HALF


def rod(push: float) -> tuple[float, float]:
    """Tip of the cantilever by the equations of the rod, from the free end to the clamp."""
    stiffness = YOUNG * SHEET**3 / 12

    def slope(s: float, y: np.ndarray) -> list[float]:
        turn, _, _, normal, shear, moment = y
        bend = moment / stiffness
        return [bend, np.cos(turn), np.sin(turn), bend * shear, -bend * normal - push, -shear]

    turn, x, z = solve_ivp(slope, (0.0, -LENGTH), np.zeros(6), "DOP853", rtol=1e-12, atol=1e-14).y[
        :3, -1
    ]
    return float(-np.cos(turn) * x - np.sin(turn) * z), float(np.sin(turn) * x - np.cos(turn) * z)


def pushed(cells: int) -> tuple[float, float]:
    """Tip of the cantilever, a strip without Poisson's ratio."""
    held = [joints.Edge("clamp", "plate", ("left",), slope="z")]
    load = [loads.Pressure("p", "plate", PUSH, follower=True)]
    system = loaded(
        rectangle("nurbs", cells, 1, LENGTH, 1.0), SHEET, YOUNG, 0.0, held, load, tip="b"
    )
    found = outputs(solve_statics(system, 20, TIGHT))
    return float(found["tip_x"][-1]), float(found["tip_z"][-1])


# ------------------------------------------------------------------------------------------------------------------- cases
RING = "closed formula of the energy A/2 E^2 + B/2 k^2 of a ring"
ARC = "closed formula of a circular membrane, p r = A lambda E"
ROD = "equations of equilibrium of an inextensible planar rod, integrated to 1e-12"


@case("pressure-ring", group="statics", source=RING)
def ring() -> list[CheckedNumber]:
    """A pressure inside a long cylinder, in the deformed area, makes it half as wide again."""
    return [CheckedNumber("radius", GROWTH, grown(8), 1e-9)]


@case("pressure-arc", group="statics", source=ARC)
def arc() -> list[CheckedNumber]:
    """A pressure that follows a hinged foil makes an arc of it; its bending is what is left (t/a =
    0.002).
    """
    return [CheckedNumber("rise of the arc", float(np.tan(0.5 * RISE)), arched(16), 1e-6)]


@case("pressure-cantilever", group="statics", source=ROD)
def cantilever() -> list[CheckedNumber]:
    """A pressure that follows a cantilever strip turns its end past a right angle; the strip
    stretches by p/E.
    """
    (x, z), reference = pushed(24), rod(PUSH)
    return [
        CheckedNumber("x of the tip", reference[0], x, 1e-4, "m", scale=LENGTH),
        CheckedNumber("z of the tip", reference[1], z, 1e-4, "m", scale=LENGTH),
    ]
