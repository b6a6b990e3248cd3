r"""Lines: hanging cables, and manufactured solutions for every law and interpolation of cables.

Manufactured: a motion r*(S) of our own with r*'' = 0 at the free end solves the equations under the
dead force

    f_b = int n* . dN_b/dS dS,   n* = P1(r*) - dP2(r*)/dS,   P1 = dW/dr', P2 = dW/dr''

(16 Gauss points a cell, dP2/dS by Chebyshev interpolation). The quadratic law is one of fourth
order in every component:
||r_h - r*|| ~ h^(p + 1) for degree p >= 3 (Strang and Fix, An Analysis of the Finite Element Method, 1973, ch. 2). Material and
exact curvature bend across the tangent only; along it the equation is of second order and coupled
through M r'', and the duality argument of the same source gives h^p. That is what C1 interpolations
show; those with p - 1 continuous derivatives keep h^(p + 1).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss
from scipy.optimize import brentq, fsolve

from fmbs_skfem.bodies import body, laws, sections
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.storage.records import dataclass
from fmbs_skfem.dynamics import Newton, outputs, solve_statics
from fmbs_skfem.shapes import line
from fmbs_skfem.shapes.meshes import polyline, segment
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .registry import CheckedNumber, case, farthest, order, refined

GRAVITY = 9.81  #: [m/s2]
TIGHT = Newton(tolerance=1e-12)


# ------------------------------------------------------------------------------------------------------ hanging cables
@dataclass(frozen=True)
class Hanging:
    """A cable between (0, 0) and (span, -drop); H, V and the points of the published form T = EA (l
    - 1).
    """

    span: float  #: [m]
    drop: float  #: [m]
    length: float  #: unstretched [m]
    weight: float  #: w [N/m]
    EA: float  #: [N]
    H: float  #: horizontal force [N]
    V: float  #: vertical force at the start [N]
    #: x, z of a quarter, half, three quarters of the cable [m]
    points: tuple[tuple[float, float], ...]


IRVINE = "Irvine, Cable Structures, MIT Press 1981, ISBN 978-0262090230 (digits recomputed)"
HANGING = (
    Hanging(
        1.0,
        0.0,
        1.2,
        9.81,
        1e4,
        4.59646568756,
        5.886,
        (
            (0.217302711467, -0.205044934005),
            (0.5, -0.29290162103),
            (0.782697288533, -0.205044934005),
        ),
    ),
    Hanging(
        1.0,
        0.0,
        1.0,
        9.81,
        1e3,
        15.6629582638,
        4.905,
        (
            (0.247094700755, -0.0579248344583),
            (0.5, -0.0776853321711),
            (0.752905299245, -0.0579248344583),
        ),
    ),
    Hanging(
        8.0,
        0.0,
        10.0,
        9.81,
        5e3,
        32.3023321296,
        49.05,
        ((1.67718801647, -1.8709463918), (4.0, -2.71858991762), (6.32281198353, -1.8709463918)),
    ),
    Hanging(
        8.0,
        2.0,
        10.0,
        9.81,
        5e3,
        33.8109293791,
        60.9004569558,
        (
            (1.45420854031, -2.06246687927),
            (3.50568875073, -3.4848040068),
            (5.97064423359, -3.45595843727),
        ),
    ),
)
INEXTENSIBLE = Hanging(
    1.0,
    0.0,
    1.5,
    1.0,
    1e12,
    0.308236469736,
    0.75,
    ((0.183578014122, -0.325447522091), (0.5, -0.502633261649), (0.816421985878, -0.325447522091)),
)
PARTS = {"a": 0.25, "b": 0.5, "c": 0.75}


def stretch(T: np.ndarray, EA: float, green: bool) -> np.ndarray:
    """Stretch l (x,) of tensions T (x,) [N]: T/EA = l - 1, or T/EA = l (l^2 - 1)/2, the law of this
    package, by iteration.
    """
    l = 1 + T / EA
    for _ in range(20 if green else 0):
        l = l - (l * (l**2 - 1) / 2 - T / EA) / ((3 * l**2 - 1) / 2)
    return l


def catenary(cable: Hanging, green: bool) -> tuple[np.ndarray, np.ndarray]:
    """H and V, and the positions (3, 2): dx/ds = l H/T, dz/ds = -l (V - w s)/T, T^2 = H^2 + (V - w
    s)^2.
    """
    nodes, weights = leggauss(60)

    def position(force: np.ndarray, s: float) -> np.ndarray:
        vertical = force[1] - cable.weight * s * (nodes + 1) / 2
        T = np.hypot(force[0], vertical)
        l = stretch(T, cable.EA, green)
        return 0.5 * s * np.array([weights @ (l * force[0] / T), -weights @ (l * vertical / T)])

    force = fsolve(
        lambda f: position(f, cable.length) - [cable.span, -cable.drop],
        [cable.H, cable.V],
        xtol=1e-12,
    )
    return force, np.array([position(force, part * cable.length) for part in PARTS.values()])


def sagging_arc(cable: Hanging, cells: int) -> np.ndarray:
    """Points (cells + 1, 3) of a circular arc of the cable's length between its ends."""
    s, chord = np.linspace(-1.0, 1.0, cells + 1), float(np.hypot(cable.span, cable.drop))
    along, down = (
        np.array([cable.span, -cable.drop]) / chord,
        np.array([-cable.drop, -cable.span]) / chord,
    )
    x, y = 0.5 * chord * (s + 1), 0.0 * s
    if cable.length > chord:
        half = brentq(lambda a: np.sin(a) / a - chord / cable.length, 1e-3, 3.0)
        radius = 0.5 * cable.length / half
        x, y = 0.5 * chord + radius * np.sin(half * s), radius * (np.cos(half * s) - np.cos(half))
    return np.column_stack([np.outer(x, along) + np.outer(y, down), 0.0 * s])


def solve_hanging(cable: Hanging, bending: float, cells: int = 30) -> tuple[np.ndarray, np.ndarray]:
    """Reaction (2,) of the first end and positions (3, 2), with EI = bending w L^3."""
    section = sections.Given(
        cable.EA, bending * cable.weight * cable.length**3, cable.weight / GRAVITY
    )
    part = body.cable("cable", polyline(sagging_arc(cable, cells)), section, dim=2)
    length = float(part.mass.sum()) / section.rhoA
    system = assemble(
        [part],
        [joints.Pin("start", At("cable", "left")), joints.Pin("end", At("cable", "right"))],
        [loads.Gravity((0.0, -GRAVITY))],
        outputs={
            name: probes.Position(At("cable", share * length)) for name, share in PARTS.items()
        }
        | {"R": probes.Reaction("start")},
    )
    found = {
        name: values[-1]
        for name, values in outputs(
            solve_statics(eliminate(system), 5, Newton(tolerance=1e-11))
        ).items()
    }
    return np.array([-found["R_x"], found["R_y"]]), np.array(
        [[found[f"{name}_x"], found[f"{name}_y"]] for name in PARTS]
    )


@case("catenary-equations", group="statics", source=IRVINE)
def catenary_equations() -> list[CheckedNumber]:
    """The equations of the elastic catenary that the next case is held against give the published
    digits.
    """
    found = []
    for number, cable in enumerate((INEXTENSIBLE, *HANGING), 1):
        force, points = catenary(cable, green=False)
        found += [
            farthest(f"forces, cable {number}", [cable.H, cable.V], force, 1e-10, "N"),
            farthest(f"positions, cable {number}", cable.points, points, 1e-10, "m"),
        ]
    return found


@case("hanging-chain", group="statics", source=IRVINE)
def hanging_chain() -> list[CheckedNumber]:
    """Cables with next to no bending stiffness (EI = 1e-5 w L^3) hang as elastic catenaries; the
    rest falls with EI.
    """
    found = []
    for number, cable in enumerate(HANGING, 2):
        force, points = catenary(cable, green=True)
        soft = solve_hanging(cable, 1e-5)
        found.append(farthest(f"positions, cable {number}", points, soft[1], 5e-5, "m"))
        found.append(farthest(f"forces, cable {number}", force, soft[0], 1e-4, "N"))
    cable = HANGING[0]
    exact = catenary(cable, green=True)[1]
    errors = [
        float(np.abs(solve_hanging(cable, stiffness)[1] - exact).max())
        for stiffness in (1e-4, 1e-5)
    ]
    return [*found, order("order in EI", (1e-4, 1e-5), errors, 1.0, 0.05)]


@case("inextensible-chain", group="statics", source=IRVINE)
def inextensible_chain() -> list[CheckedNumber]:
    """Cables of EA = 100 and 1000 N (EI = 1e-7 w L^3) hang lower than an inextensible one by what
    they stretch.
    """
    rigid, found, errors = np.array(INEXTENSIBLE.points), [], []
    for EA, tolerance in ((1e2, 1e-3), (1e3, 1e-2)):
        cable = replace(INEXTENSIBLE, EA=EA)
        lower = solve_hanging(cable, 1e-7)[1] - rigid
        found.append(
            farthest(
                f"distance from it, EA = {EA:g} N",
                catenary(cable, green=True)[1] - rigid,
                lower,
                tolerance,
                "m",
            )
        )
        errors.append(float(np.abs(lower).max()))
    return [*found, order("order in 1/EA", (1e-2, 1e-3), errors, 1.0, 0.01)]


# ------------------------------------------------------------------------------------------------ manufactured solutions
POINTS = 16  #: Gauss points a cell of the manufactured load
DEGREE = 40  #: of the Chebyshev interpolation
MANUFACTURED = sections.Given(EA=20.0, EI=1.0, rhoA=1.0)
SPACES: dict[
    str, tuple[dict[str, Any], int, bool, tuple[int, int]]
] = {  # options, degree p, whether C(p-1), cells
    "C1 cubic": ({}, 3, False, (16, 32)),
    "C2 cubic": ({"continuity": 2}, 3, True, (12, 24)),
    "ANCF cubic": ({"ancf": True}, 3, False, (16, 32)),
    "C1 quartic": ({"degree": 4}, 4, False, (8, 16)),
    "C3 quartic": ({"degree": 4, "continuity": 3}, 4, True, (12, 24)),
    "C1 quintic": ({"degree": 5}, 5, False, (4, 8)),
    "C4 quintic": ({"degree": 5, "continuity": 4}, 5, True, (12, 16)),
}


def bent(S: np.ndarray, dim: int) -> np.ndarray:
    """r*, r*' and r*'' (3, dim, ...) of a line on [0, 1] with r* = 0 and r*' = (1, 0, 0) at its
    start, r*'' = 0 at its end.
    """
    a, b = np.pi * S, 0.5 * np.pi * S
    bow = np.stack([(a - np.sin(a)) / np.pi**2, (1 - np.cos(a)) / np.pi, np.sin(a)])
    dip = np.stack([(1 - np.cos(b)) * (2 / np.pi) ** 2, np.sin(b) * 2 / np.pi, np.cos(b)])
    axial = np.stack([S, 1.0 + 0 * S, 0 * S]) + 0.05 * bow
    return np.stack([axial, 0.8 * bow, 0.5 * dip][:dim], axis=1)


def law_stress(law: Law, gradients: np.ndarray, section: np.ndarray) -> np.ndarray:
    """weight dW/du (k c, p, e) of a law."""
    gradients = np.ascontiguousarray(gradients)
    found = np.zeros_like(gradients)
    laws.stress(law, gradients, 0 * gradients, 0.0, np.ascontiguousarray(section), found)
    return found


def contact_force(S: np.ndarray, law: Law, dim: int) -> np.ndarray:
    """n* = P1 - dP2/dS (dim, ...) of `bent`."""

    def stress(at: np.ndarray) -> np.ndarray:
        flat = at.reshape(1, -1)
        section = np.stack(
            [np.full_like(flat, value) for value in (MANUFACTURED.EA, MANUFACTURED.EI, 0.0, 1.0)]
        )
        return law_stress(law, bent(flat, dim)[1:].reshape(2 * dim, *flat.shape), section).reshape(
            2, dim, *at.shape
        )

    nodes = chebyshev.chebpts1(DEGREE + 1)
    moments = np.linalg.solve(chebyshev.chebvander(nodes, DEGREE), stress(0.5 * (nodes + 1))[1].T)
    return stress(S)[0] - chebyshev.chebval(2 * S - 1, 2 * chebyshev.chebder(moments))


def manufactured(space: str, cells: int, law: Law, dim: int) -> float:
    """Error of the cantilever under the load of `bent`: the mean-square distance from r* [m]."""
    part = body.cable("line", segment(cells), MANUFACTURED, dim=dim, law=law, **SPACES[space][0])
    assert isinstance(part.space, line.BSpline | line.Hermite)
    table, values, weights = body.arc_length_table(part.space, part.reference, POINTS)
    S = np.einsum("epb,eb->ep", values[:, :, 0], part.reference[table.nodes][..., 0])
    load = np.zeros_like(part.reference)
    np.add.at(
        load,
        table.nodes,
        np.einsum("ep,cep,epb->ebc", weights, contact_force(S, law, dim), values[:, :, 1]),
    )
    system = assemble([part], [joints.Clamp("clamp", At("line", "left"))])
    system = eliminate(replace(system, loads=replace(system.loads, constant=load.ravel())))
    found = system.lift(solve_statics(system, 5, TIGHT).x[-1]).reshape(-1, dim)[table.nodes]
    gap = np.einsum("epb,ebc->cep", values[:, :, 0], found) - bent(S, dim)[0]
    return float(np.sqrt((weights * (gap**2).sum(axis=0)).sum()))


def law_orders(law: Law, dim: int) -> list[CheckedNumber]:
    """Observed order of every interpolation."""
    found = []
    for name, (_, degree, smooth, meshes) in SPACES.items():
        expected = degree + 1 if smooth or law is Law.QUADRATIC else degree
        found.append(
            refined(name, meshes, partial(manufactured, name, law=law, dim=dim), expected, 0.03)
        )
    return found


STRANG = "r* chosen; orders p + 1 and p: Strang and Fix, An Analysis of the Finite Element Method (1973), ISBN 978-0961408886"


PLANAR, SPATIAL = (
    "A planar cantilever bent into a given curve,",
    "A cantilever bent into a given curve in space,",
)
MANUFACTURED_CASES = {
    "manufactured-cable-exact": (
        Law.EXACT,
        2,
        f"{PLANAR} law of the exact curvature |r' x r''|/|r'|^3.",
    ),
    "manufactured-cable-exact-space": (Law.EXACT, 3, f"{SPATIAL} law of the exact curvature."),
    "manufactured-cable-material": (
        Law.MATERIAL,
        2,
        f"{PLANAR} law of the material curvature |r' x r''|/|r'|^2.",
    ),
    "manufactured-cable-quadratic": (Law.QUADRATIC, 3, f"{SPATIAL} quadratic law |r''|."),
}
for name, (law, dim, about) in MANUFACTURED_CASES.items():
    case(name, group="manufactured", source=STRANG, about=about)(partial(law_orders, law, dim))
