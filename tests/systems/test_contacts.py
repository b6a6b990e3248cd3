"""Contact and friction against exact motions, and where they are hard."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq
from scipy.sparse import csr_array
from scipy.special import gamma

from fmbs_skfem.bodies import Body, cable, point_mass, rigid, sections
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.contact.contacts import (
    Contact,
    ContactBox,
    ContactCylinder,
    ContactHeights,
    ContactPlane,
    ContactSphere,
)
from fmbs_skfem.contact.points import once
from fmbs_skfem.contact.shapes import FAR, distances, measure
from fmbs_skfem.contact.states import ContactState
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    energies,
    integrate,
    outputs,
    solve_statics,
)
from fmbs_skfem.results import motion as pictures
from fmbs_skfem.scenes import build
from fmbs_skfem.scenes import reading as scenes
from fmbs_skfem.systems import (
    At,
    Motion,
    Rayleigh,
    System,
    assemble,
    check_force,
    compiled,
    eliminate,
    work,
)
from fmbs_skfem.systems import force as sum_of
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import models
from ..bodies.test_plate import rectangle
from ..forms import forms
from ..shapes.test_nurbs import halves
from .parts import A1, BOB, C1, beams

TIGHT = Newton(tolerance=1e-12)
BALL, DISC = At("ball", "center"), At("disc")
G = 9.81
EXAMPLES = Path(__file__).parents[2] / "examples"
LAW: dict[str, Any] = {
    "stiffness": 20.0,
    "damping": 0.4,
    "dissipation": 0.3,
    "smoothing": 0.05,
    "friction": 0.3,
}


def every_contact(dim: int) -> list[Contact]:
    """Of every shape, from outside and inside, with shapes that stand still and such as bodies
    carry.
    """
    x, up, wave = (
        (1.0, 0.1, 0.05)[:dim],
        (0.1, 1.0, 0.2)[:dim],
        [[0.3 * np.sin(i + 0.5 * j) for j in range(9)] for i in range(9)],
    )
    heights = [row[0] for row in wave] if dim == 2 else wave
    corner = (-1.0, 0.0) if dim == 2 else (-1.0, -1.0, 0.0)
    round_one: dict[str, Any] = {"diameter": 0.6, **LAW}
    axis = {} if dim == 2 else {"axis": (0.1, 0.2, 1.0)}
    return [
        ContactPlane("plane", at=A1, point=x, normal=up, **LAW),
        ContactPlane(
            "plane under a beam",
            body="c",
            radius=0.1,
            points=5,
            point=(0.0, 0.3, 0.0)[:dim],
            normal=up,
            **LAW,
        ),
        ContactPlane(
            "shared",
            body="c",
            radius=0.1,
            points=5,
            point=(0.0, 0.3, 0.0)[:dim],
            normal=up,
            shared=True,
            **LAW,
        ),
        ContactPlane(
            "carried plane", at=BOB, on=At("disc"), point=(2.0, 1.05, 0.0)[:dim], normal=up, **LAW
        ),
        ContactSphere(
            "sphere", at=A1, center=(0.9, -0.1, 0.1)[:dim], exponent=1.5, depth=0.2, **round_one
        ),
        ContactSphere(
            "around a point",
            at=C1,
            on=BOB,
            diameter=1.2,
            exponent=2.2,
            depth=0.1,
            **LAW | {"smoothing": 0.5},
        ),
        ContactSphere(
            "within", at=A1, radius=0.1, center=(0.85, -0.1, 0.1)[:dim], inside=True, **round_one
        ),
        ContactSphere("two discs", at=At("disc"), on=At("other"), radius=0.2, **round_one),
        ContactCylinder(
            "cylinder",
            body="a",
            points=5,
            center=(0.9, -0.1, 0.1)[:dim],
            length=3.0,
            **round_one,
            **axis,
        ),
        ContactBox("box", at=A1, sides=(0.8, 0.4, 0.5)[:dim], center=(0.7, -0.1, 0.1)[:dim], **LAW),
        ContactBox(
            "corner",
            at=A1,
            radius=0.3,
            sides=(0.8, 0.4, 0.5)[:dim],
            center=(0.5, -0.3, 0.2)[:dim],
            **LAW,
        ),
        ContactHeights(
            "heights",
            at=A1,
            corner=corner,
            step=(0.37,) * (dim - 1),
            heights=heights,
            radius=0.2,
            **LAW,
        ),
    ]


def parts(dim: int) -> list[Body]:
    """Beams, a mass point, and two rigid discs beside each other."""
    inertia = np.array(0.02) if dim == 2 else 0.02 * np.eye(3)
    discs = [
        rigid.rigid(
            name, 1.0, inertia, (x, 0.9, 0.1)[:dim], dim=dim, places={"rim": (x, 1.1, 0.1)[:dim]}
        )
        for name, x in (("disc", 2.1), ("other", 2.5))
    ]
    return [*beams(dim), *discs]


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("number", range(11))
def test_contract(dim: int, number: int) -> None:
    check_force(parts(dim), every_contact(dim)[number])


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("dim", [2, 3])
def test_tangents_of_what_sticks_and_slides(dim: int) -> None:
    """With all of them at once, after an accepted state: derivatives by x and 0.3 times those by v."""
    system = replace(assemble(parts(dim), loads=every_contact(dim)), elastic=())
    model, random = compiled.compile_system(system), np.random.default_rng(1)
    memory, none = compiled.accepted(model, system.x0), np.zeros(len(system.constraints.names))
    for size in (1e-4, 1e-1):  # in which they stick, and slide
        d, way, v = random.normal(size=(3, system.size))
        x = system.x0 + size * way
        K = compiled.tangent(model, x, none, 0.0, 0.3, memory, 0.1 * v)
        ends = [
            compiled.forces(model, x + k * 1e-6 * d, 0.1 * v + 3e-7 * k * d, 0.0, memory)
            for k in (1, -1)
        ]
        assert_allclose(K @ d, (ends[0] - ends[1]) / 2e-6, atol=1e-5 * np.abs(K @ d).max())


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("dim", [2, 3])
def test_points_that_are_not_looked_at_are_away(dim: int) -> None:
    """After leaps of any size, over accepted states between, forces are those of a model that knows
    of no earlier state.
    """
    system = replace(assemble(parts(dim), loads=every_contact(dim)), elastic=())
    random, met = np.random.default_rng(2), 0
    for size in (0.01, 0.1, 0.3, 1.0):
        model, x = compiled.compile_system(replace(system)), system.x0
        memory = compiled.accepted(model, x)
        for _ in range(5):
            x = x + size * random.normal(size=system.size)
            known = compiled.forces(model, x, 0.0 * x, 0.0, memory)
            expected = compiled.forces(
                compiled.compile_system(replace(system)), x, 0.0 * x, 0.0, memory
            )
            assert_allclose(known, expected, rtol=1e-14, atol=1e-14)
            met += bool(np.any(expected))
            memory = compiled.accepted(model, x, memory=memory)
    assert met > 5


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    "shape, sizes",
    [
        (0, ()),
        (1, (0.5, 1.0)),
        (1, (0.5, -1.0)),
        (2, (0.5, 1.0, 9.0)),
        (2, (0.9, 1.0, 0.6)),
        (3, (0.4, 0.3, 0.2)),
        (4, (0.4, 0.4)),
    ],
)
def test_normals_are_gradients_of_the_distance(
    dim: int, shape: int, sizes: tuple[float, ...]
) -> None:
    random, n, unused = np.random.default_rng(0), np.zeros(3), np.zeros(3)
    heights = random.normal(size=(9, 1 if dim == 2 else 9))
    for z in random.uniform(0.2, 1.0, (20, 3)):
        args = shape, np.array(sizes), heights, dim
        measure(*args, z, n)
        slope = [
            (measure(*args, z + d, unused) - measure(*args, z - d, unused)) / 2e-6
            for d in 1e-6 * np.eye(3)[:dim]
        ]
        assert_allclose(n[:dim], slope, atol=1e-8)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_ends_of_a_cylinder(side: float) -> None:
    """A solid one is flat there, a tube is open: distances of points beside, beyond and in it, of
    radius 0.5 and half length 2.
    """
    points = np.array(
        [
            [0.9, 0.0, 1.0],
            [0.0, 0.3, 2.1],
            [0.8, 0.0, -2.4],
            [0.2, 0.0, 1.9],
            [0.45, 0.0, 1.9],
            [0.0, 0.0, -1.9],
        ]
    )
    found = distances(
        2, np.array([0.5, side, 2.0]), np.zeros((1, 1)), points, np.zeros_like(points)
    )
    solid, tube = [0.4, 0.1, 0.5, -0.1, -0.05, -0.1], [-0.4, FAR, FAR, 0.3, 0.05, 0.5]
    assert_allclose(found, solid if side > 0 else tube, atol=1e-15)


def test_heights_follow_a_parabola() -> None:
    """The cubic holds parabolas: y = x^2 / 2 with steps of 0.1, its normal at 0.53 and what is away
    along that.
    """
    heights, n = 0.5 * np.linspace(0, 1, 11)[:, None] ** 2, np.zeros(2)
    expected = np.array([-0.53, 1.0]) / np.hypot(1.0, 0.53)
    for distance in (0.2, -0.3):
        gap = measure(
            4, np.array([0.1]), heights, 2, np.array([0.53, 0.5 * 0.53**2]) + distance * expected, n
        )
        assert gap == pytest.approx(distance, rel=1e-12)
        assert_allclose(n, expected, rtol=1e-12)


@pytest.mark.parametrize("x", [0.0, 0.03, 0.13, 0.5, 0.97, 1.0 - 1e-12])
@pytest.mark.parametrize("count", [2, 3, 4, 11])
def test_heights_follow_lines_and_parabolas_up_to_their_border(count: int, x: float) -> None:
    """Along x and y alike: f = 1 - 0.4 x + 0.3 y + b (x^2 + x y - y^2) with b = 0 where only two
    heights are known.
    """
    grid, n, bend = np.linspace(0.0, 1.0, count), np.zeros(3), 0.2 * (count > 2)
    for y in (0.01, 0.6, 0.99):
        heights = np.array(
            [[1 - 0.4 * i + 0.3 * j + bend * (i * i + i * j - j * j) for j in grid] for i in grid]
        )
        slopes = -0.4 + bend * (2 * x + y), 0.3 + bend * (x - 2 * y)
        place = np.array([x, y, 1 - 0.4 * x + 0.3 * y + bend * (x * x + x * y - y * y)])
        step = np.full(2, grid[1])
        assert measure(4, step, heights, 3, place, n) == pytest.approx(0.0, abs=1e-14)
        assert_allclose(
            n,
            np.array([-slopes[0], -slopes[1], 1.0]) / np.hypot(1.0, np.hypot(*slopes)),
            atol=1e-13,
        )
        profile = heights[:, [0]]
        measure(4, step[:1], profile, 2, np.array([x, np.interp(x, grid, profile[:, 0])]), n)
        along = -0.4 + 2 * bend * x
        assert_allclose(n[:2], np.array([-along, 1.0]) / np.hypot(1.0, along), atol=2e-2 * bend)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("number", range(12))
def test_nothing_but_a_potential_acts_without_friction_and_damping(dim: int, number: int) -> None:
    """What is stored takes all forces out of those that work, in any state: also such as turn what
    carries a shape.
    """
    bare = replace(every_contact(dim)[number], friction=0.0, damping=0.0, dissipation=0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        system = replace(assemble(parts(dim), loads=[bare]), elastic=())
    model, random, met = compiled.compile_system(system), np.random.default_rng(3), 0.0
    for _ in range(20):
        x = system.x0 + 0.1 * random.normal(size=system.size)
        largest = np.abs(compiled.forces(model, x, 0.0 * x)).max()
        placed, table = compiled.place(model, x, 0.0 * x)
        work.forces(table)
        assert np.abs(placed.space.f).max() <= 1e-12 * largest
        met = max(met, largest)
    assert met > 0.0


@pytest.mark.parametrize("count", [3, 9])
def test_sticking_damping_is_by_default_that_of_the_points_together(count: int) -> None:
    """ct = sqrt(kt m / t) in every one of t points of a beam of m = 2 kg that lies on a floor and
    is pushed along it by 1 um/s.
    """
    beam = cable(
        "beam", models.segment(4), sections.Given(EA=1e6, EI=1.0, rhoA=2.0, radius=0.01), dim=2
    )
    law: dict[str, Any] = {"stiffness": 50.0, "friction": 0.3, "points": count, "radius": 0.0}
    rests = ContactPlane("floor", body="beam", point=(0.0, 1e-2), normal=(0.0, 1.0), **law)
    with pytest.warns(Notice, match="points overlap"):
        system = replace(assemble([beam], loads=[rests]), elastic=())
    model, v = (
        compiled.compile_system(system),
        1e-6 * np.tile([1.0, 0.0], system.size // 2) * np.repeat(beam.constant, 2),
    )
    memory = compiled.accepted(model, system.x0)
    pulled = compiled.forces(model, system.x0, v, 0.0, memory).reshape(-1, 2).T @ beam.constant
    assert pulled[0] == pytest.approx(count * np.sqrt(50.0 * 2.0 / count) * 1e-6, rel=1e-9)


def test_round_off_is_no_overlap() -> None:
    """A point that stands on a slope of a valley, in a scene without another size."""
    heights = [0.2 * x * x for x in np.linspace(-1.0, 1.0, 41)]
    valley = ContactHeights(
        "valley",
        at=BALL,
        radius=0.2,
        corner=(-1.0, 0.0),
        step=(0.05,),
        heights=heights,
        stiffness=1.0,
    )
    normal = np.array([-0.24, 1.0]) / np.hypot(0.24, 1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for below in (0.0, 1e-12):
            ball(valley, at=np.array([0.6, 0.072]) + (0.2 - below) * normal)
    with pytest.warns(
        Notice, match="1 of 1 points overlap the shape at the start, by up to 1e-06 m"
    ):
        ball(valley, at=np.array([0.6, 0.072]) + (0.2 - 1e-6) * normal)


@pytest.mark.parametrize("below", [1e-15, 1e-9])
def test_what_has_come_in_pushes_where_it_is(below: float) -> None:
    """What is known of who cannot touch is that of the place of a point, not of its way in."""
    model = compiled.compile_system(ball(floor(stiffness=4e3, damping=8.0), at=(0.0, 0.3)))
    v = np.array([0.0, -2.0])
    above, inside = np.array([0.0, 0.3]), np.array([0.0, -below])
    memory = compiled.accepted(model, inside, v, compiled.accepted(model, above, v))
    found = compiled.forces(model, inside, v, 0.0, memory)
    assert_allclose(found, [0.0, -16.0 - 4e3 * below], rtol=1e-12)


def ball(
    *forces: loads.Load, at: Any = (0.0, 0.0, 0.0), speed: Any = (0.0, 0.0, 0.0), dim: int = 2
) -> System:
    """A mass point of 1 kg with contacts."""
    known = {f.name: ContactState(f.name) for f in forces if isinstance(f, Contact)}
    return assemble(
        [point_mass("ball", 1.0, np.array(at[:dim], float))],
        loads=forces,
        outputs={"x": probes.Position(BALL), "E": probes.Energy(), **known},
        initial={"ball": Motion(velocity=tuple(speed[:dim]))},
    )


def run(
    system: System, step: float, duration: float, rho_inf: float = 1.0
) -> tuple[Trajectory, dict[str, np.ndarray]]:
    motion = integrate(system, GeneralizedAlpha(step, rho_inf), duration, TIGHT)
    return motion, outputs(motion)


def floor(dim: int = 2, **more: Any) -> ContactPlane:
    return ContactPlane("floor", at=BALL, point=(0.0,) * dim, normal=(0.0, 1.0, 0.0)[:dim], **more)


@pytest.mark.parametrize("step", [2e-3, 5e-4])
def test_a_mass_dropped_on_a_floor(step: float) -> None:
    """As on a stop: sqrt(2 h / g), 2 (pi - atan(w v / g)) / w, period and depth to 1e-4, whose
    steps shorten and recover.
    """
    system = ball(floor(stiffness=1e5, resolution=0.02), loads.Gravity((0.0, -G)), at=(0.0, 1.0))
    motion, found = run(system, step, 1.4)
    t, y, v = motion.times, found["x_y"], motion.v[:, 1]

    def flight(time: float) -> tuple[float, float]:
        """When the flight began and ends."""
        k = round(time / step)
        root = np.sqrt(v[k] ** 2 + 2 * G * y[k])
        return t[k] + (v[k] - root) / G, t[k] + (v[k] + root) / G

    touch, (leave, again) = flight(0.2)[1], flight(0.9)
    assert touch == pytest.approx(0.4515236409857309, rel=1e-4)
    assert leave - touch == pytest.approx(0.00997888201078354, rel=1e-4)
    assert again - touch == pytest.approx(0.9130261639822453, rel=1e-4)
    assert np.ptp(found["E_balance"]) < 2e-3
    if step < 1e-3:
        path = CubicHermiteSpline(t, y, v)
        low = path(path.derivative().roots(extrapolate=False)).min()
        assert -low == pytest.approx(0.014105584556836033, rel=1e-4)
    assert found["floor_force"].max() == pytest.approx(-1e5 * y.min())
    assert_allclose(found["floor_gap"], y, atol=1e-12)
    assert motion.statistics.halved == 0  # Newton's iteration never failed


@pytest.mark.parametrize("zeta", [0.05, 0.5])
def test_restitution_of_kelvin_and_voigt(zeta: float) -> None:
    """exp(-pi zeta / sqrt(1 - zeta^2)), its last phase pulling."""
    law = floor(
        stiffness=1e5, damping=2 * zeta * np.sqrt(1e5), smoothing=1e-6, cut=False, resolution=0.02
    )
    motion, _ = run(ball(law, at=(0.0, 1e-3), speed=(0.0, -1.0)), 1e-4, 0.016)
    assert motion.v[-1, 1] == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-3)


def test_restitution_of_hunt_and_crossley() -> None:
    """u du / (1 + lambda u) = - w^2 s ds: u - ln(1 + lambda u) / lambda is the same before and
    after, whatever the stiffness.
    """
    rate = 0.5
    motion, _ = run(
        ball(
            floor(stiffness=1e5, dissipation=rate, resolution=0.02),
            at=(0.0, 1e-3),
            speed=(0.0, -1.0),
        ),
        1e-4,
        0.016,
    )

    def level(u: float) -> float:
        return float(u - np.log(1 + rate * u) / rate)

    exact = brentq(lambda e: level(-e) - level(1.0), 0.1, 1.0)
    assert motion.v[-1, 1] == pytest.approx(exact, rel=1e-3)


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("touching", ["beam", "plate"])
def test_a_shared_stiffness_is_that_of_the_whole_body(touching: str) -> None:
    """A uniform overlap d of a body with uneven cells is k d on any number of points, and the
    energy k d^2 / 2.
    """
    if touching == "beam":
        x = np.array([0.0, 0.1, 0.5, 0.7, 1.0])
        body = cable(
            "body",
            models.polyline(np.outer(x, [1.0, 0.0, 0.0])),
            sections.Circular(0.02),
            sections.Material(1e9, 1e3),
        )
    else:
        body = plate(
            "body", rectangle("ancf", 2, 3, skew=0.2), 0.02, sections.Material(1e9, 1e3, 0.3)
        )
    law: dict[str, Any] = {
        "point": (0.0, 0.0, -0.009),
        "normal": (0.0, 0.0, 1.0),
        "stiffness": 2e4,
        "shared": True,
    }
    for points in (2, 3, 7):
        term = ContactPlane("floor", body="body", points=points, **law)
        system = assemble(
            [body], loads=[term], outputs={"floor": ContactState("floor"), "E": probes.Energy()}
        )
        still = integrate(system, GeneralizedAlpha(1e-9, 1.0), 1e-9)
        found = outputs(still)
        assert found["floor_force"][0] == pytest.approx(20.0, rel=1e-9)
        assert found["E_strain"][0] == pytest.approx(0.01, rel=1e-6)
    with pytest.raises(InputError, match="shared: expected points all over a beam or a plate"):
        ball(floor(stiffness=1.0, shared=True))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", ["ancf", "argyris", "nurbs"])
def test_plates_touch_with_their_edges(kind: str, dim: int) -> None:
    """Points of 2 x 3 cells that are halved: each once, on the boundary alone in the plane, where a
    plate has no thickness.
    """
    body = plate(
        "body", rectangle(kind, 2, 3, 2.0, 1.0), 0.02, sections.Material(1e9, 1e3, 0.3), dim=dim
    )
    plane = ContactPlane(
        "floor",
        body="body",
        point=(0.0, -0.1, 0.0)[:dim],
        normal=(0.0, 1.0, 0.0)[:dim],
        shared=True,
    )
    system = assemble([body], loads=[plane])
    (term,) = system.loads.forces
    y = system.probes(system.x0)[term.rows] + system.origin
    corners = np.array([y[:, :2].min(axis=0), y[:, :2].max(axis=0)])
    assert_allclose(corners, [[0.0, 0.0], [2.0, 1.0]], atol=1e-12)
    assert_allclose(term.radius, 0.0 if dim == 2 else 0.01)
    assert len(y) == (20 if dim == 2 else 35)
    assert_allclose(term.weights @ y[:, :2] / term.weights.sum(), [1.0, 0.5], atol=1e-12)


def test_impact_of_hertz() -> None:
    """N = K s^(3/2): depth (5/4 m v^2 / K)^(2/5), duration 4/5 sqrt(pi) Gamma(2/5) / Gamma(9/10)
    depth / v = 2.9432 depth / v.

    Johnson, Contact Mechanics, Cambridge University Press 1985, doi 10.1017/CBO9781139171731,
    (11.23) and (11.24).
    """
    v, K, R = 2.0, 3e7, 0.05
    law = floor(stiffness=K * np.sqrt(R), exponent=1.5, depth=R, resolution=0.01)
    motion, found = run(ball(law, at=(0.0, 1e-3), speed=(0.0, -v)), 2e-5, 6e-3)
    depth = (1.25 * v**2 / K) ** 0.4
    y, t = found["x_y"], motion.times
    touch, leave = 1e-3 / v, t[-1] - y[-1] / motion.v[-1, 1]
    assert -y.min() == pytest.approx(depth, rel=1e-4)
    assert leave - touch == pytest.approx(
        0.8 * np.sqrt(np.pi) * gamma(0.4) / gamma(0.9) * depth / v, rel=1e-4
    )
    assert leave - touch == pytest.approx(3.2181 * (1.0 / (K**2 * v)) ** 0.2, rel=1e-4)
    assert found["floor_force"].max() == pytest.approx(K * (-y.min()) ** 1.5)
    assert motion.v[-1, 1] == pytest.approx(v, rel=1e-4)
    assert np.ptp(found["E_balance"]) < 1e-3 * 0.5 * v**2


def test_what_is_chosen_where_nothing_is_said_bears_the_weight() -> None:
    """Of 3 kg and 2 m at a ten-thousandth of the size, whatever the exponent."""
    law = floor(exponent=1.5)
    (exponent, depth), k = law.power(2.0), law.law(2.0, 3.0, 1)[0]
    assert (exponent, depth) == (1.5, 2e-4)
    assert k * depth == pytest.approx(3.0 * G)


@pytest.mark.parametrize(
    "more, message",
    [
        (
            {"stiffness": 1e4, "exponent": 1.5},
            "floor.*depth: expected stiffness and depth, .* got one alone; of spheres of Hertz",
        ),
        ({"stiffness": 1e4, "depth": 0.1}, "floor.*depth: expected no depth without an exponent"),
        (
            {"stiffness": 1e4, "exponent": 0.5, "depth": 0.1},
            "floor.*exponent: expected a number >= 1",
        ),
    ],
)
def test_exponents_need_a_depth(more: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        ball(floor(**more))


def block(
    slope: float, mu: float, speed: float, dim: int = 2, k: float = 1e6, **more: Any
) -> System:
    """A mass on an incline at rest in its normal direction, which slides down along x, in space
    askew.
    """
    down = np.array([1.0, 0.0]) if dim == 2 else np.array([0.6, 0.0, 0.8])
    up = np.eye(dim)[1]
    law = floor(dim, stiffness=k, friction=mu, **more)
    weight = loads.Gravity(tuple(G * (np.sin(slope) * down - np.cos(slope) * up)))
    with pytest.warns(
        match="1 of 1 points overlap the shape at the start, by up to .* they are pushed apart"
    ):
        return ball(
            law, weight, at=tuple(-np.cos(slope) * G / k * up), speed=tuple(speed * down), dim=dim
        )


@pytest.mark.parametrize("dim", [2, 3])
def test_a_sliding_block(dim: int) -> None:
    """It stops after v^2 / (2 mu g), and stays there."""
    motion, found = run(block(0.0, 0.3, 2.0, dim, sticking=1e7), 5e-3, 1.2, 0.8)
    way = np.linalg.norm(motion.x[:, [0, dim - 1]] if dim == 3 else motion.x[:, :1], axis=1)
    assert way[-1] == pytest.approx(4.0 / (2 * 0.3 * G), rel=1e-4)
    assert_allclose(found["floor_friction"][:130], 0.3 * G, rtol=1e-9)
    assert_allclose(found["floor_slip"][:130], 2.0 - 0.3 * G * motion.times[:130], atol=1e-4)
    assert np.ptp(way[-20:]) < 1e-9
    assert abs(found["floor_friction"][-1]) < 1e-3


def test_an_incline_beyond_and_below_the_friction_angle() -> None:
    """g (sin a - mu cos a); and rest for 100 s with steps of 0.1 s."""
    motion, _ = run(block(0.5, 0.3, 0.0), 1e-3, 0.5, 0.8)
    v = motion.v[:, 0]
    assert (v[-1] - v[100]) / 0.4 == pytest.approx(G * (np.sin(0.5) - 0.3 * np.cos(0.5)), rel=1e-4)
    motion, found = run(block(0.25, 0.3, 0.0), 0.1, 100.0, 0.8)
    assert_allclose(motion.x[10:, 0], G * np.sin(0.25) / 1e6, atol=1e-9)
    assert np.ptp(motion.x[100:, 0]) < 1e-15
    assert_allclose(found["floor_friction"][10:], G * np.sin(0.25), rtol=2e-5)


def test_friction_turns_round() -> None:
    """A shaken block: amplitude and mean of a mass under F sin(w t) with friction from solve_ivp,
    in which it never sticks.
    """
    from scipy.integrate import solve_ivp

    shake = loads.PointForce("shake", BALL, (30.0, 0.0), lambda t: np.sin(10.0 * t))
    law = floor(stiffness=1e6, friction=0.3, sticking=1e7)
    with pytest.warns(match="overlap"):
        system = ball(law, loads.Gravity((0.0, -G)), shake, at=(0.0, -G / 1e6), speed=(0.5, 0.0))
    motion, _ = run(system, 2e-4, 1.0, 0.8)

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], 30.0 * np.sin(10.0 * t) - 0.3 * G * np.tanh(y[1] / 1e-5)]

    exact = solve_ivp(
        rates, (0.0, 1.0), [0.0, 0.5], "Radau", rtol=1e-8, atol=1e-10, t_eval=motion.times
    ).y
    assert_allclose(motion.x[:, 0], exact[0], atol=3e-4)


def test_a_disc_slides_until_it_rolls() -> None:
    """v falls to 2/3 v0 after v0 / (3 mu g), and a disc that rolls goes on for ever: its friction
    is zero.
    """
    disc = rigid.rigid("disc", 2.0, np.array(0.5 * 2.0 * 0.2**2), (0.0, 0.2 - 2.0 * G / 1e6), dim=2)
    law = ContactPlane(
        "floor",
        at=DISC,
        radius=0.2,
        point=(0.0, 0.0),
        normal=(0.0, 1.0),
        stiffness=1e6,
        friction=0.2,
    )
    measured = {
        "x": probes.Position(DISC),
        "turn": probes.Angle(DISC),
        "floor": ContactState("floor"),
    }
    with pytest.warns(match="overlap"):
        system = assemble(
            [disc],
            [],
            [law, loads.Gravity((0.0, -G))],
            outputs=measured,
            initial={"disc": Motion(velocity=(3.0, 0.0))},
        )
    motion, found = run(system, 1e-3, 1.0, 0.8)
    rolling = motion.times > 3.0 / (3 * 0.2 * G) + 0.05
    assert_allclose(motion.v[rolling, 0], 2.0, rtol=1e-3)
    assert_allclose(np.gradient(found["turn"], motion.times)[rolling][5:-5], -10.0, rtol=2e-3)
    assert_allclose(
        found["floor_slip"][~rolling][:300], 3.0 - 3 * 0.2 * G * motion.times[:300], atol=3e-3
    )
    assert found["floor_slip"][rolling].max() < 1e-3


def test_a_ball_rolls_down_an_incline_in_space() -> None:
    """5/7 g sin a, askew to the axes, with a friction of 2/7 m g sin a; what rolls loses nothing."""
    slope, m, radius = 0.3, 2.0, 0.1
    sphere = rigid.rigid("ball", m, 0.4 * m * radius**2 * np.eye(3), (0.0, 0.0, 0.0))
    law = {
        "stiffness": 1e6,
        "damping": 500.0,
        "smoothing": 1e-7,
        "friction": 0.4,
        "overlap": "keep",
    }
    at = At("ball", "center")
    incline = ContactPlane(
        "floor", at=at, radius=radius, point=(0.0, 0.0, -radius), normal=(0.0, 0.0, 1.0), **law
    )
    weight = loads.Gravity((0.6 * G * np.sin(slope), 0.8 * G * np.sin(slope), -G * np.cos(slope)))
    measured = {"x": probes.Position(at), "floor": ContactState("floor"), "E": probes.Energy()}
    motion, found = run(
        eliminate(assemble([sphere], [], [incline, weight], outputs=measured)), 1e-3, 0.6, 0.8
    )
    way, late = 0.6 * found["x_x"] + 0.8 * found["x_y"], motion.times > 0.2
    assert 2 * np.polyfit(motion.times[late], way[late], 2)[0] == pytest.approx(
        5 / 7 * G * np.sin(slope), rel=3e-4
    )
    assert found["floor_friction"][-1] == pytest.approx(2 / 7 * m * G * np.sin(slope), rel=1e-3)
    assert np.ptp(found["E_balance"]) < 2e-4 * found["E_kinetic"][-1]


def thin(shape: str, **law: Any) -> Contact:
    """A box or a sphere of 2 cm about the origin, which meets the ball."""
    law = {"name": "wall", "at": BALL, "center": (0.0, 0.0), **law}
    return (
        ContactBox(**law, sides=(1.0, 0.02))
        if shape == "box"
        else ContactSphere(**law, diameter=0.02)
    )


@pytest.mark.parametrize("shape", ["box", "sphere"])
def test_what_is_thin_is_not_leapt_over(shape: str) -> None:
    """A mass that moves five times the thickness of what it meets in a step is thrown back as fast
    as it came.
    """
    motion, _ = run(
        ball(thin(shape, stiffness=2e8), at=(0.0, 0.951), speed=(0.0, -100.0)), 1e-3, 0.015
    )
    assert motion.v[-1, 1] == pytest.approx(100.0, rel=1e-2)
    assert motion.statistics.halved == 0


@pytest.mark.parametrize("shape", ["box", "sphere"])
def test_what_is_thin_is_not_left_on_the_other_side_without_a_word(shape: str) -> None:
    """Faster than its thickness in a 64th of a step; through its middle by a weight; where no other
    steps are divided, too.
    """
    fast = ball(thin(shape, stiffness=2e8), at=(0.0, 0.951), speed=(0.0, -1e4))
    soft = ball(thin(shape, stiffness=1e3), loads.Gravity((0.0, -20.0)), at=(0.0, 0.0101))
    for system, duration, end in ((fast, 1e-3, -9.049), (soft, 0.1, -0.1)):
        with pytest.warns(match="went through to the other side"):
            motion, _ = run(system, 1e-3, duration)
        assert motion.x[-1, 1] == pytest.approx(end, abs=0.02)
    motion, _ = run(
        ball(thin(shape, stiffness=2e8, resolution=0.0), at=(0.0, 0.951), speed=(0.0, -100.0)),
        1e-3,
        0.015,
    )
    assert motion.v[-1, 1] > 90.0


@pytest.mark.parametrize("damping", [0.0, 5.0])
@pytest.mark.parametrize("part", [0.2, 0.5, 0.9])
def test_what_goes_through_off_the_middle_is_told(part: float, damping: float) -> None:
    """A mass that a soft ball turns aside by less than half of what a hard one does; off it a hard
    one throws it unsaid.
    """
    for stiffness, speed, told in ((1e3, 10.0, True), (1e4, 1.0, True), (1e6, 1.0, False)):
        law = {"stiffness": stiffness, "damping": damping}
        system = ball(thin("sphere", **law), at=(0.01 * part, 0.0301), speed=(0.0, -speed))
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            run(system, 1e-3 / speed, 0.05 / speed)
        assert any("went through to the other side" in str(one.message) for one in found) == told, (
            stiffness
        )


@pytest.mark.filterwarnings("error")
def test_what_slides_off_a_soft_ball_has_not_gone_through_it() -> None:
    """Pressed in by 5 % of its radius and more, it follows the surface until it leaves it."""
    hill = ContactSphere(
        "hill", at=BALL, center=(0.0, -1.0), diameter=2.0, stiffness=200.0, damping=8.5
    )
    motion, _ = run(
        ball(hill, loads.Gravity((0.0, -9.81)), at=(0.05, 0.0), speed=(0.3, 0.0)), 1e-2, 2.0
    )
    assert motion.x[-1, 1] < -2.0


@pytest.mark.parametrize("x", [0.4, 0.499])
def test_what_goes_through_a_box_near_its_end_is_told(x: float) -> None:
    with pytest.warns(match="went through to the other side"):
        run(ball(thin("box", stiffness=1e3), at=(x, 0.0301), speed=(0.0, -10.0)), 1e-4, 0.006)


def drop(speed: float, at: float, **more: Any) -> System:
    """A cable of 1 m with a radius of 1 mm over a round rod of 20 mm about the origin, of which it
    moves across or along.
    """
    line = cable(
        "b",
        models.segment(8, (-0.4625, at, 0.0), (0.5375, at, 0.0)),
        sections.Given(EA=1e5, EI=1.0, rhoA=0.2, radius=1e-3),
        dim=2,
    )
    rod = ContactCylinder("rod", body="b", center=(0.0, 0.0), diameter=0.02, **more)
    way = (0.0, -speed) if at > 0.011 else (speed, 0.0)
    return assemble([line], loads=[rod], initial={"b": Motion(velocity=way)})


def test_a_fast_cable_that_passes_a_rod_off_its_middle_is_told() -> None:
    """No point of it goes through the middle, and no normal turns round within a step."""
    with pytest.warns(match="went through to the other side"):
        integrate(drop(20.0, 0.015, stiffness=2e4), GeneralizedAlpha(1e-4), 2.5e-3)


@pytest.mark.filterwarnings("error", "ignore:.*overlap")
def test_a_cable_that_is_drawn_over_a_soft_rod_stays_over_it() -> None:
    """Its points go in on the left and come out on the right of what is pressed in by 0.4 of its
    radius, in a step or in ten.

    No step is divided for that.
    """
    for step in (2e-3, 2e-4):
        motion = integrate(drop(10.0, 0.0066, stiffness=1.0), GeneralizedAlpha(step), 1e-2)
        assert motion.statistics.factorisations == 1


def test_a_plate_that_falls_through_a_ball_off_its_points_is_told() -> None:
    body = plate("b", rectangle("ancf", 2, 2), 1e-3, sections.Material(7e10, 2700.0, 0.3))
    under = ContactSphere("ball", body="b", center=(0.27, 0.31, -0.06), diameter=0.1, stiffness=1e3)
    system = assemble([body], loads=[under], initial={"b": Motion(velocity=(0.0, 0.0, -50.0))})
    with pytest.warns(match="went through to the other side"):
        integrate(system, GeneralizedAlpha(2e-4), 3e-3)


def test_points_on_a_border_stand_once() -> None:
    """Rows of both sides that differ by round-off, wherever they are rounded to."""
    rows = np.random.default_rng(1).uniform(size=(4000, 2))
    both = csr_array(np.concatenate([rows, rows * (1.0 + 1e-12)]))
    found, shares, beside = once(both, np.ones(8000), np.arange(8000)[:, None])
    assert found.shape[0] == 4000
    assert_allclose(shares, 1.0 / 4000)
    assert_allclose(beside[:, 0], np.arange(4000))


def test_what_is_grazed_is_not_gone_through() -> None:
    """A mass that cuts a nanometre off a ball, in less than a 64th of a step: nothing is said, and
    it goes on as it came.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        motion, _ = run(
            ball(thin("sphere", stiffness=1e5), at=(-0.0105, 0.01 - 1e-9), speed=(1.0, 0.0)),
            1e-3,
            0.02,
        )
    assert_allclose(motion.v[-1], [1.0, 0.0], atol=1e-6)


@pytest.mark.parametrize("every", [1, 40])
@pytest.mark.parametrize(("dissipation", "mu"), [(0.0, 0.3), (0.5, 0.1)])
def test_an_oblique_impact(dissipation: float, mu: float, every: int) -> None:
    """While it slides, friction takes mu times the impulse of the normal force; its work is what
    the impact loses.
    """
    law = floor(stiffness=1e5, dissipation=dissipation, friction=mu, resolution=0.02)
    motion = integrate(
        ball(law, at=(0.0, 1e-3), speed=(2.0, -1.0)),
        GeneralizedAlpha(1e-4, 1.0),
        0.016,
        TIGHT,
        every,
    )
    v = motion.v[-1]
    assert v[0] == pytest.approx(2.0 - mu * (1.0 + v[1]), rel=1e-9)
    assert motion.work is not None
    assert -motion.work[-1] == pytest.approx(2.5 - 0.5 * v @ v, abs=2e-4)


def test_discs_that_meet_keep_their_momentum() -> None:
    """A spinning disc meets another one askew, with friction: momentum and its moment stay; so does
    the energy without friction.
    """
    for mu in (0.0, 0.4):
        found = [
            rigid.rigid(name, m, np.array(0.5 * m * 0.04), at, dim=2)
            for name, m, at in (("disc", 1.0, (0.0, 0.0)), ("other", 2.0, (0.5, 0.1)))
        ]
        law = ContactSphere(
            "touch", at=At("other"), on=DISC, radius=0.2, diameter=0.4, stiffness=1e5, friction=mu
        )
        start = {"disc": Motion(velocity=(1.0, 0.0), angular_velocity=6.0)}
        names = {
            f"{p}{n}": kind(At(n))
            for p, kind in (("x", probes.Position), ("w", probes.Angle))
            for n in ("disc", "other")
        }
        motion, out = run(
            assemble(found, [], [law], outputs=names | {"E": probes.Energy()}, initial=start),
            1e-3,
            0.4,
        )
        rate = {name: np.gradient(values, motion.times) for name, values in out.items()}
        for axis in "xy":
            assert_allclose(
                (rate[f"xdisc_{axis}"] + 2 * rate[f"xother_{axis}"])[[2, -3]],
                1.0 if axis == "x" else 0.0,
                atol=1e-7,
            )
        moment = 0.02 * rate["wdisc"] + 0.04 * rate["wother"]
        for m, n in ((1.0, "disc"), (2.0, "other")):
            moment = moment + m * (
                out[f"x{n}_x"] * rate[f"x{n}_y"] - out[f"x{n}_y"] * rate[f"x{n}_x"]
            )
        assert moment[-3] == pytest.approx(moment[2], abs=2e-6)
        turned = abs(rate["wother"][-3])
        assert turned < 1e-9 if mu == 0.0 else turned > 0.1
        lost = out["E_kinetic"][0] - out["E_kinetic"][-1]
        assert abs(lost) < 1e-4 if mu == 0.0 else lost > 1e-3


@pytest.mark.parametrize("height", [0.0, 1e-3])
def test_rest_on_a_stiff_floor(height: float) -> None:
    """Ten seconds under weight, and a ball that bounces to rest: m g / k below the floor."""
    law = floor(stiffness=1e7, dissipation=1.0, damping=300.0, smoothing=1e-7)
    _, found = run(ball(law, loads.Gravity((0.0, -G)), at=(0.0, height)), 1e-2, 10.0, 0.8)
    assert_allclose(found["x_y"][-100:], -G / 1e7 - 0.5e-7, atol=1e-9)


def test_a_point_above_the_pole_of_a_sphere() -> None:
    """It rests there, unstable as it is, and a sphere that lies in a bowl lies at its bottom."""
    weight = loads.Gravity((0.0, 0.0, -G))
    top = ContactSphere(
        "top",
        at=BALL,
        center=(0.0, 0.0, 0.0),
        diameter=1.0,
        stiffness=1e6,
        damping=300.0,
        smoothing=1e-6,
    )
    motion, _ = run(ball(top, weight, at=(0.0, 0.0, 0.5 + 1e-4), dim=3), 1e-3, 0.5, 0.8)
    assert_allclose(motion.x[-1], [0.0, 0.0, 0.5 - G / 1e6 - 0.5e-6], atol=1e-9)
    bowl = replace(top, name="bowl", inside=True, radius=0.1)
    motion, _ = run(ball(bowl, weight, at=(0.0, 0.0, -0.4 + 1e-4), dim=3), 1e-3, 0.5, 0.8)
    assert_allclose(motion.x[-1], [0.0, 0.0, -0.4 - G / 1e6 - 0.5e-6], atol=1e-9)


def test_overlap_at_the_start_is_kept_by_choice() -> None:
    """Pushed apart, 1 J flies up; kept, it stays where it is, m g / k lower."""
    weight = loads.Gravity((0.0, -G))
    with pytest.warns(
        match="1 of 1 points overlap the shape at the start, by up to 0.00447 m: they are pushed apart"
    ):
        pushed = ball(floor(stiffness=1e5, resolution=0.02), weight, at=(0.0, -np.sqrt(2e-5)))
    motion, _ = run(pushed, 1e-4, 0.2)
    assert 0.5 * motion.v[-1, 1] ** 2 + G * (motion.x[-1, 1] + np.sqrt(2e-5)) == pytest.approx(
        1.0, rel=1e-3
    )
    kept = ball(
        floor(stiffness=1e5, damping=60.0, smoothing=1e-6, overlap="keep"), weight, at=(0.0, -0.1)
    )
    motion, _ = run(kept, 1e-3, 1.0, 0.8)
    assert motion.x[-1, 1] == pytest.approx(-0.1 - G / 1e5 - 0.5e-6, abs=1e-9)


def test_a_touch_in_every_step() -> None:
    """A ball between walls 1 cm apart at 4 m/s meets one in every step of 2.5 ms: its energy stays,
    and it stays between them.
    """
    more = {"stiffness": 1e6, "resolution": 0.03}
    walls = [
        ContactPlane(n, at=BALL, point=(-5e-3 * s, 0.0), normal=(s, 0.0), **more)
        for n, s in (("a", 1.0), ("b", -1.0))
    ]
    motion, found = run(ball(*walls, speed=(4.0, 0.0)), 2.5e-3, 0.25)
    assert_allclose(found["E_balance"], 8.0, rtol=2e-4)
    assert np.abs(motion.x[:, 0]).max() < 5e-3 + 4.0 / np.sqrt(1e6)


def wrapped(phi: float, mu: float) -> System:
    """A limp cable on a drum of 0.1 m over an angle, held by 10 N, its other end drawn off slowly."""
    angle, ends, period = (
        np.linspace(0.0, phi, round(10 * phi) + 1),
        np.linspace(0.0, 0.1, 11)[1:, None],
        0.3,
    )
    arc, way = (
        0.1 * np.column_stack([np.sin(angle), -np.cos(angle)]),
        np.array([np.cos(phi), np.sin(phi)]),
    )
    points = np.concatenate([[0.0, -0.1] - ends[::-1] * [1.0, 0.0], arc, arc[-1] + ends * way])
    body = cable(
        "c",
        models.polyline(np.pad(points, ((0, 0), (0, 1)))),
        sections.Given(EA=2e4, EI=2e-5, rhoA=0.1),
        dim=2,
    )
    drum = ContactSphere(
        "drum",
        body="c",
        radius=0.0,
        center=(0.0, 0.0),
        diameter=0.2,
        stiffness=2e5,
        friction=mu,
        resolution=0.0,
        overlap="keep",
    )

    def drawn(t: np.ndarray) -> np.ndarray:
        return np.asarray(0.006 * (t / period - np.sin(2 * np.pi * t / period) / (2 * np.pi)))

    pull = joints.DrivenPosition(
        "pull", At("c", "right"), (lambda t: way[0] * drawn(t), lambda t: way[1] * drawn(t))
    )
    weight = loads.PointForce(
        "weight", At("c", "left"), (-10.0, 0.0), lambda t: np.minimum(t / 0.05, 1.0)
    )
    outs = {"pull": probes.Reaction("pull"), "drum": ContactState("drum")}
    return eliminate(
        assemble([body], [pull], [weight, drum], Rayleigh(mass=40.0, stiffness=1e-4), outputs=outs)
    )


@pytest.mark.parametrize("mu", [0.1, 0.3])
@pytest.mark.parametrize("part", [0.5, 1.0, 2.0])
def test_a_cable_on_a_drum(part: float, mu: float) -> None:
    """T2 / T1 = exp(mu phi) within 1 % while it slides (Euler and Eytelwein)."""
    motion = integrate(wrapped(part * np.pi, mu), GeneralizedAlpha(2e-3, 0.5), 0.22, Newton(1e-10))
    found = outputs(motion)
    tension = np.hypot(found["pull_x"], found["pull_y"])[-8:]
    assert found["drum_slip"][-8:].min() > 1e-3
    assert tension.mean() / 10.0 == pytest.approx(np.exp(mu * part * np.pi), rel=1e-2)


def lying(dim: int) -> System:
    """A pinned beam falls onto a ball and a floor, two contacts on it."""
    beam = cable(
        "beam", models.segment(8), sections.Circular(0.02), sections.Material(1e8, 1200.0), dim=dim
    )
    low = (0.0, -0.1, 0.0)[:dim]
    on_floor = ContactPlane(
        "floor",
        body="beam",
        points=17,
        point=low,
        normal=(0.0, 1.0, 0.0)[:dim],
        stiffness=2e3,
        friction=0.2,
        dissipation=1.0,
    )
    on_ball = ContactSphere(
        "ball",
        body="beam",
        center=(0.5, -0.13, 0.02)[:dim],
        diameter=0.2,
        stiffness=2e3,
        friction=0.2,
        dissipation=1.0,
    )
    out = {
        "tip": probes.Position(At("beam", "right")),
        "floor": ContactState("floor"),
        "ball": ContactState("ball"),
    }
    weight = loads.Gravity((0.0, -G, 0.0)[:dim])
    return assemble(
        [beam],
        [joints.Pin("pin", At("beam", "left"))],
        [weight, on_floor, on_ball],
        Rayleigh(stiffness=1e-3),
        outputs=out,
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_two_contacts_on_a_beam_in_full_reduced_hyper_reduced_and_saved(
    dim: int, tmp_path: Path
) -> None:
    raw, scheme = lying(dim), GeneralizedAlpha(1e-3)
    full = integrate(eliminate(raw), scheme, 0.4, TIGHT)
    expected = outputs(full)
    assert expected["floor_force"].max() > 0.5
    assert expected["ball_force"].max() > 0.5
    for system in forms(raw, full, 1e-12, tmp_path / "model.h5"):
        found = outputs(integrate(system, scheme, 0.4, TIGHT))
        for name in ("tip_x", "tip_y", "floor_gap"):
            assert_allclose(found[name], expected[name], atol=2e-3)
        assert found["ball_force"].max() == pytest.approx(expected["ball_force"].max(), rel=0.1)
    shown = pictures.frames(full).bodies
    assert set(shown) == {"beam", "floor", "ball"}
    assert_allclose(
        np.linalg.norm(shown["ball"].points[-1] - [0.5, -0.13, 0.02 if dim == 3 else 0.0], axis=1),
        0.1,
    )


@pytest.mark.parametrize("slant", [0.0, 0.15])
@pytest.mark.filterwarnings("ignore:.*overlap")
def test_points_on_the_seam_of_patches_stand_once(slant: float) -> None:
    """A square of two patches of 2 x 4 cells, each of 2 x 2 parts, 1 mm deep in a floor: 9 x 9
    points of 1 N each.
    """
    body = plate("plate", halves(2, slant), 1e-3, sections.Material(7e10, 2700.0, 0.3))
    floor = ContactPlane(
        "floor",
        body="plate",
        points=2,
        radius=0.0,
        point=(0.0, 0.0, 1e-3),
        normal=(0.0, 0.0, 1.0),
        stiffness=1e3,
    )
    system = assemble([body], loads=[floor])
    found = body.constant @ sum_of(system, system.x0, 0.0 * system.x0, 0.0).reshape(-1, 3)
    assert_allclose(np.abs(found), [0.0, 0.0, 81.0], atol=1e-7)


@pytest.mark.parametrize("dim", [2, 3])
def test_pictures_show_a_floor_as_far_as_bodies_go(dim: int) -> None:
    """A line, and in space a rectangle, at their height, beyond what flies away."""
    rest = (0.0,) * (dim - 2)
    balls = [point_mass(name, 1.0, (x, 1.0, *rest)) for name, x in (("a", 0.0), ("b", 0.1))]
    floor = ContactPlane(
        "floor", at=At("a", "center"), point=(0.0, 0.0, *rest), normal=(0.0, 1.0, *rest)
    )
    system = assemble(
        balls, loads=[floor], initial={"a": Motion((50.0, 0.0, *(-30.0,) * (dim - 2)))}
    )
    shown = pictures.frames(integrate(system, GeneralizedAlpha(1e-2), 0.1)).bodies["floor"].points
    assert_allclose(shown, np.broadcast_to(shown[0], shown.shape), atol=1e-12)
    assert_allclose(shown[..., 1], 0.0, atol=1e-12)
    assert -1.0 < shown[..., 0].min() < -0.1
    assert shown[..., 0].max() == pytest.approx(5.0)
    if dim == 3:
        assert shown[..., 2].min() == pytest.approx(-3.0)
        assert 0.1 < shown[..., 2].max() < 1.0


SCENE = """
schema: 1
dimension: 2
bodies:
  ball: {type: point_mass, mass: 500 g, position: [300 mm, 0 mm]}
loads:
  weight: {type: gravity, acceleration: [0, -9810 mm/s^2]}
  floor: {type: contact_plane, at: ball, point: [0, -1 mm], normal: [0, 1], stiffness: 1 kN/mm, friction: 0.2}
  wall: {type: contact_box, body: ball, center: [600 mm, 0], sides: [100 mm, 1 m], stiffness: 1 kN/mm}
  bowl: {type: contact_sphere, at: ball, center: [300 mm, 0], diameter: 2 m, inside: true, stiffness: 1 kN/mm}
  hill: {type: contact_heights, at: ball, corner: [0, -1 m], step: [200 mm], heights: [0, 10 mm, 0], stiffness: 1 kN/mm}
analysis: {type: dynamic, duration: 50 ms, step: 1 ms}
outputs:
  x: {type: position, at: ball}
  floor: {type: contact, load: floor}
"""


def test_scenes() -> None:
    scene = scenes.loads(SCENE)
    found = run(build.system(scene), scene.analysis.step, scene.analysis.duration)[1]
    assert found["x_y"].min() == pytest.approx(
        -1e-3 - 0.1401 * np.sqrt(0.5 / 1e6) - 0.5 * G / 1e6, rel=1e-2
    )
    assert found["floor_force"].max() > 50.0


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "load: floor}",
            "load: flor}",
            "output 'floor': expected one of the contacts floor, wall, bowl, .*did you mean 'floor'",
        ),
        (
            "at: ball, point",
            "at: ball, body: ball, point",
            r"loads.floor.at: expected one place \(at\) or one body \(body\), got both",
        ),
        ("body: ball", "body: bal", "loads.wall.body: expected .*did you mean 'ball'"),
        (
            "center: [300 mm, 0], ",
            "",
            "load 'bowl': expected the center of the shape, or a place that carries it, got neither",
        ),
        (
            "heights: [0, 10 mm, 0]",
            "heights: [0]",
            "loads.hill.heights: expected a list of two heights or more",
        ),
        (
            ", stiffness: 1 kN/mm, friction",
            ", friction",
            "load 'floor'.stiffness: expected a stiffness, as points have no size",
        ),
    ],
)
def test_wrong_scenes_are_named(old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        build.system(scenes.loads(SCENE.replace(old, new)))


def example(
    name: str, duration: float | None = None
) -> tuple[System, Trajectory, dict[str, np.ndarray]]:
    """A scene of the folder of examples, and its motion."""
    scene = scenes.read(EXAMPLES / f"{name}.yaml")
    system = build.chosen_form(scene, build.system(scene))
    motion = integrate(
        system, GeneralizedAlpha(scene.analysis.step), duration or scene.analysis.duration
    )
    return system, motion, outputs(motion)


def test_a_hoop_bounces_and_rolls() -> None:
    """Friction takes m R^2 w of its momentum: at half of its speed, it rolls, as a hoop thrown
    without spin does.
    """
    _, motion, found = example("rolling_hoop")
    middle = 0.5 * (found["low_x"] + found["high_x"]), 0.5 * (found["low_y"] + found["high_y"])
    late = motion.times > 1.3
    speed = np.gradient(middle[0], motion.times)[late]
    turned = np.unwrap(np.arctan2(found["high_y"] - middle[1], found["high_x"] - middle[0]))
    assert speed.mean() == pytest.approx(0.75, rel=0.05)
    assert -np.gradient(turned, motion.times)[late].mean() * 0.202 == pytest.approx(0.75, rel=0.05)
    assert found["floor_gap"][late].max() < 1e-3
    kinetic, _, _, balance = energies(motion).T
    assert motion.work is not None
    assert motion.work[-1] < -0.9 * kinetic[0]  # friction and damping take nearly all there is
    assert np.ptp(balance) < 0.01 * kinetic.max()


def test_a_gripper_lifts_a_ball() -> None:
    """After the lift it hangs still: friction and normal forces carry it, and it is 0.1 m higher."""
    _, _, found = example("gripper")
    assert found["ball_y"][-1] == pytest.approx(0.13, abs=5e-4)
    assert np.ptp(found["ball_y"][-200:]) < 1e-7
    assert np.abs(found["ball_x"]).max() < 1e-9
    assert found["left_friction"][-1] < 0.5 * found["left_force"][-1]
    assert found["left_slip"][-1] < 1e-9
    assert found["floor_force"][-1] == 0.0


def test_a_cable_falls_over_a_drum_and_is_held() -> None:
    """1.5 kg and 1 kg stay, as exp(0.3 pi) > 1.5."""
    _, motion, found = example("cable_over_drum", 2.0)
    late = motion.times > 1.0
    assert np.ptp(found["heavy_y"][late]) < 0.15
    assert found["drum_gap"].min() > -5e-4
    assert found["drum_slip"][-1] < 1e-2
    assert found["drum_force"][-1] > 25.0


def test_statics_report_the_friction_that_they_balance() -> None:
    """A cantilever is pressed onto a rough floor in load steps: its root carries what weight and
    floor leave.
    """
    part = cable("beam", models.segment(10), sections.Given(EA=1e5, EI=0.5, rhoA=0.1), dim=2)
    law = ContactPlane(
        "floor",
        at=At("beam", "right"),
        radius=0.0,
        point=(0.0, -0.05),
        normal=(0.0, 1.0),
        stiffness=1e4,
        friction=0.5,
    )
    names = {"floor": ContactState("floor"), "root": probes.Reaction("root")}
    push = loads.PointForce("push", At("beam", "right"), (0.0, -2.0))
    found = outputs(
        solve_statics(
            assemble(
                [part], [joints.Clamp("root", At("beam", "left"))], [law, push], outputs=names
            ),
            10,
        )
    )
    assert found["floor_friction"][-1] > 0.05
    assert_allclose(found["floor_friction"], -found["root_x"], atol=1e-9)
    assert_allclose(
        found["floor_force"], 2.0 * np.linspace(0.0, 1.0, 11) - found["root_y"], atol=1e-9
    )
