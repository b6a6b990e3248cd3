"""Forces of one's own, in symbols and of Python, against exact motions: full, reduced, sampled,
saved, large, at rest.
"""

from __future__ import annotations

import pickle
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose
from sympy import atan2, symbols

from fmbs_skfem.bodies import cable, point_mass, rigid, sections
from fmbs_skfem.core.errors import CorruptFile, InputError
from fmbs_skfem.core.notices import Remark
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    energies,
    integrate,
    outputs,
    solve_statics,
    vibration_modes,
)
from fmbs_skfem.reduction import files
from fmbs_skfem.systems import (
    At,
    Motion,
    System,
    assemble,
    check_force,
    check_system,
    eliminate,
    fields,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.evaluation import space_of
from fmbs_skfem.systems.forces import built_in_forces, force_laws, force_symbols, loads
from fmbs_skfem.systems.forces import on_rows as forces
from fmbs_skfem.systems.forces.force_laws import ForceLaw
from fmbs_skfem.systems.forces.on_rows import OfPython
from fmbs_skfem.systems.forces.own_forces import OwnForce, norm, turned
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.places import Draft

from .. import models
from ..forms import forms
from .parts import A1, B1, BOB, beams, every_load

TIGHT = Newton(tolerance=1e-12)
BALL = At("ball", "center")


@pytest.fixture(autouse=True)
def _apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """What this module declares is known to its tests alone."""
    monkeypatch.setattr(
        loads.Load, "known", {**loads.Load.known, **{kind.word: kind for kind in KINDS}}
    )


@dataclass(frozen=True)
class SpringDamper(OwnForce, word="test_spring_damper"):
    name: str
    at: fields.Place
    to: fields.End
    stiffness: Annotated[float, fields.quantity("N/m", ">= 0")]
    damping: Annotated[float, fields.quantity("N s/m", ">= 0")] = 0.0
    length: Annotated[float, fields.quantity("m", ">= 0")] = 0.0

    @staticmethod
    def act(at: Any, to: Any, stiffness: Any, damping: Any, length: Any) -> Any:
        apart = at.position - to.position
        distance = norm(apart)
        along = apart / distance
        pull = stiffness * (distance - length) + damping * along.dot(at.velocity - to.velocity)
        return [(at.position, -pull * along), (to.position, pull * along)]


@dataclass(frozen=True)
class Drag(OwnForce, word="test_drag"):
    name: str
    at: fields.Place
    factor: Annotated[float, fields.quantity("kg/m", ">= 0")]

    @staticmethod
    def act(at: Any, factor: Any) -> Any:
        return [(at.position, -factor * norm(at.velocity) * at.velocity)]


@dataclass(frozen=True)
class GroundSpring(OwnForce, word="test_ground_spring"):
    """A cubic spring to where the place is in the reference."""

    name: str
    at: fields.Place
    stiffness: Annotated[float, fields.quantity("N/m", ">= 0")]
    cubic: Annotated[float, fields.quantity("N/m^3")] = 0.0
    to: fields.End = None

    @staticmethod
    def energy(at: Any, to: Any, stiffness: Any, cubic: Any) -> Any:
        square = (at.position - to.position).dot(at.position - to.position)
        return stiffness / 2 * square + cubic / 4 * square**2


@dataclass(frozen=True)
class Clock(OwnForce, word="test_clock"):
    """A torque - k theta about z on the first axis of a place, its turns counted, times a history,
    and t in the energy.
    """

    name: str
    at: fields.Place
    stiffness: Annotated[float, fields.quantity("N m/rad", ">= 0")]
    history: fields.History | None = None

    @staticmethod
    def act(at: Any, stiffness: Any, history: Any) -> Any:
        x, y, *_ = at.axes[0]
        torque = -stiffness * history * turned(atan2(y, x))
        return [(at.axes[0], type(at.axes[0])([-y, x, *(0 for _ in _)]) * torque / (x**2 + y**2))]


@dataclass(frozen=True)
class Wind(loads.Load, word="test_wind"):
    """Drag by a function of Python, in a wind along x that grows with t."""

    name: str
    at: fields.Place
    factor: Annotated[float, fields.quantity("kg/m", ">= 0")]

    def push(self, draft: Draft) -> None:
        dim = draft.layout.dim
        first = draft.probes.add(draft.layout.read(f"load '{self.name}'", self.at))

        def force(y: np.ndarray, rates: np.ndarray, h: np.ndarray) -> np.ndarray:
            v = rates - h[0] * np.eye(dim)[0]
            return -self.factor * np.linalg.norm(v) * v

        draft.forces.terms.append(
            OfPython(first + np.arange(dim), force, (draft.signal(lambda t: 0.5 * t),))
        )


KINDS = (SpringDamper, Drag, GroundSpring, Clock, Wind)
for one in KINDS:
    del loads.Load.known[one.word]


def every_own_force(dim: int) -> list[loads.Load]:
    return [
        SpringDamper("between", A1, BOB, 10.0, 0.3, 0.1),
        SpringDamper("to a point", A1, (0.3, 0.4, 0.5)[:dim], 10.0, 0.2),
        Drag("drag", B1, 2.0),
        GroundSpring("ground", B1, 3.0, 500.0),
        Clock("clock", A1, 0.7, np.cos),
        Wind("wind", B1, 0.7),
    ]


EVERY = [
    (dim, load) for dim in (2, 3) for load in [*every_load(dim, np.cos), *every_own_force(dim)]
]
CASES = [pytest.param(dim, load, id=f"{dim}-{load.name}") for dim, load in EVERY]


@pytest.mark.parametrize("dim, load", CASES)
def test_contract(dim: int, load: loads.Load) -> None:
    check_force(beams(dim), load)


@pytest.mark.parametrize("dim", [2, 3])
def test_systems_with_own_forces(dim: int) -> None:
    check_system(assemble(beams(dim), loads=every_own_force(dim)))


def ball(dim: int, *forces: loads.Load, speed: float = 0.0, at: float = 0.0) -> System:
    """A point of 2 kg at x = `at`, moving along x."""
    part = point_mass("ball", 2.0, np.array([at, 0.0, 0.0][:dim]))
    moving = {"ball": Motion(velocity=(speed, 0.0, 0.0)[:dim])}
    return assemble([part], loads=forces, outputs={"x": probes.Position(BALL)}, initial=moving)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_damped_oscillator(dim: int) -> None:
    """x'' + 2 zeta w x' + w^2 x = 0, with w = 3 and zeta = 0.1, about the free length of 1 m."""
    spring = SpringDamper("spring", BALL, (0.0,) * dim, 18.0, 1.2, 1.0)
    motion = integrate(ball(dim, spring, speed=0.5, at=1.0), GeneralizedAlpha(1e-3), 3.0, TIGHT)
    t, wd = motion.times, 3.0 * np.sqrt(1 - 0.01)
    assert_allclose(
        outputs(motion)["x_x"] - 1.0, 0.5 / wd * np.exp(-0.3 * t) * np.sin(wd * t), atol=2e-6
    )


@pytest.mark.parametrize("kind", [Drag, Wind])
def test_drag(kind: Any) -> None:
    """m v' = - c v^2: x = m / c log(1 + c v0 t / m); the wind is slow enough to be left out of 1
    ms.
    """
    span = 2.0 if kind is Drag else 1e-3
    motion = integrate(
        ball(2, kind("drag", BALL, 3.0), speed=4.0), GeneralizedAlpha(span / 1000), span, TIGHT
    )
    assert_allclose(outputs(motion)["x_x"], 2.0 / 3.0 * np.log(1 + 6.0 * motion.times), atol=2e-5)
    balance = energies(motion)[:, 3]
    assert_allclose(balance, 16.0, rtol=1e-4)


def test_a_cubic_spring_at_rest_and_its_modes() -> None:
    """k d + c d^3 = F; omega = sqrt(k / m) in the reference."""
    system = ball(
        2, GroundSpring("spring", BALL, 8.0, 3.0), loads.PointForce("F", BALL, (5.0, 0.0))
    )
    d = outputs(solve_statics(system, 4, TIGHT))["x_x"][-1]
    assert 8.0 * d + 3.0 * d**3 == pytest.approx(5.0, rel=1e-9)
    assert_allclose(vibration_modes(system, 2).angular_frequencies, 2.0, rtol=1e-9)


@pytest.mark.parametrize("far", [0.0, 1e6])
def test_places_count_from_the_origin_of_the_scene(far: float) -> None:
    """A spring to a point and one that reads absolute positions, near and far from it."""

    spring = SpringDamper("spring", BALL, (far - 1.0, 0.0), 18.0)
    motion = integrate(ball(2, spring, at=far), GeneralizedAlpha(1e-2), 0.5, TIGHT)
    assert_allclose(outputs(motion)["x_x"] - far, np.cos(3.0 * motion.times) - 1.0, atol=1e-3)


def test_turns_are_counted() -> None:
    """A disc of inertia 0.01 on 0.01 N m/rad, 10 sin t: more than a turn and a half to either side."""
    system = assemble(
        [rigid.rigid("disc", 1.0, 0.01, (0.0, 0.0), dim=2)],
        [joints.Revolute("pin", At("disc", "frame"))],
        [Clock("clock", At("disc", "frame"), 0.01)],
        outputs={"angle": probes.Angle(At("disc", "frame"))},
        initial={"disc": Motion(angular_velocity=10.0)},
    )
    motion = integrate(eliminate(system), GeneralizedAlpha(2e-3), 6.0, TIGHT)
    assert_allclose(outputs(motion)["angle"], 10.0 * np.sin(motion.times), atol=5e-3)
    assert_allclose(energies(motion)[:, 3], 0.5, atol=1e-4)


def swinging(dim: int) -> System:
    """A beam on a pin, held by a spring and damper and a cubic spring, in drag."""
    beam = cable(
        "beam", models.segment(4), sections.Circular(0.01), sections.Material(1e9, 2300.0), dim=dim
    )
    tip, push = At("beam", "right"), (3.0, -0.2, 0.1)
    return assemble(
        [beam],
        [joints.Pin("pin", At("beam", "left"))],
        [
            loads.Gravity((0.0, -9.81, 0.0)[:dim]),
            SpringDamper("spring", tip, (1.2, 0.4, 0.3)[:dim], 60.0, 0.5, 0.2),
            GroundSpring("cubic", At("beam", 0.5), 5.0, 200.0),
            Drag("drag", tip, 0.3),
            loads.Moment("moment", tip, 0.1 if dim == 2 else (0.0, 0.1, 0.1)),
        ],
        outputs={"tip": probes.Position(tip)},
        initial={"beam": Motion(angular_velocity=push[0] if dim == 2 else (0.0, 0.3, push[0]))},
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_reduced_hyper_reduced_and_saved_models(dim: int, tmp_path: Path) -> None:
    raw, scheme = swinging(dim), GeneralizedAlpha(1e-3)
    full = integrate(eliminate(raw), scheme, 0.3, TIGHT)
    path = tmp_path / "model.h5"
    every = forms(raw, full, 1e-14, path)
    expected = outputs(full)
    for system in (*every, pickle.loads(pickle.dumps(every.hyper_reduced))):
        found = outputs(integrate(system, scheme, 0.3, TIGHT))
        for name in expected:
            assert_allclose(found[name], expected[name], atol=2e-4)
    maker = ForceLaw.makers.pop("test_drag")
    try:
        with pytest.raises(
            CorruptFile, match="'test_drag'; import the file that declares it first"
        ):
            files.load(path)
    finally:
        ForceLaw.makers["test_drag"] = maker


def test_large_models(monkeypatch: pytest.MonkeyPatch) -> None:
    raw, scheme = swinging(2), GeneralizedAlpha(1e-3)
    expected = outputs(integrate(raw, scheme, 0.1, TIGHT))
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 1)
    monkeypatch.setattr("fmbs_skfem.systems.layouts.DENSE", 1)
    motion = integrate(raw, scheme, 0.1, TIGHT)
    assert motion.statistics.solver.startswith("sparse")
    for name, values in outputs(motion).items():
        assert_allclose(values, expected[name], atol=1e-6)


def ramp(s: Any, e: Any) -> Any:
    return sympy.Piecewise((0, s <= 0), (s**2 / (2 * e), s < e), (s - e / 2, True))


def one_sided(
    sign: Any, c: Any, r: Any, k: Any, d: Any, rest: Any, e: Any, cut: Any
) -> tuple[Any, Any]:
    """f and the potential of a side whose transition is as long as `s` can be."""
    s, z = sign * (c - rest), symbols("z", real=True)
    force = k * ramp(s, e) + d * sympy.diff(ramp(z, e), z).subs(z, s) * sign * r
    lift = sympy.Piecewise(
        (0, s <= 0), (s**3 / (6 * e), s < e), ((s - e / 2) ** 2 / 2 + e**2 / 24, True)
    )
    return -sign * sympy.Piecewise((0, (force < 0) & (cut > 0)), (force, True)), k * lift


def coordinate(law: ForceLaw, y: Any) -> Any:
    """The coordinate c of the rows y: an angle, the part along a vector, or a distance."""
    if law.name == "spatial_torsion_spring":
        u, p, q = y[:3], y[3:6], y[6:]
        return sympy.atan2(
            sum(a * b for a, b in zip(u, q, strict=True)),
            sum(a * b for a, b in zip(u, p, strict=True)),
        )
    if "torsion" in law.name:
        return sum((1 - k) * sympy.atan2(y[k + 1], y[k]) for k in range(0, law.rows, 2))
    if law.name.startswith("slide"):
        half = law.rows // 2
        return sum(a * b for a, b in zip(y[:half], y[half:], strict=True))
    return y[0] if law.rows == 1 else sympy.sqrt(y.dot(y))


def in_symbols(law: ForceLaw) -> tuple[list[Any], Any]:
    """F and its potential, from what the law is."""
    y, v, p = (
        part(count) for part, count in zip(PARTS, (law.rows, law.rows, law.numbers), strict=True)
    )
    kind, _, last = law.name.rpartition("_")
    h = force_symbols.history() if law.histories else 1
    if kind in ("moment", "follower"):
        dim, x = int(last), [*y[: int(last)], 0, 0][:3]
        a, m = {"moment": (0, [0, 0, *p][-3:]), "follower": (p[0], [0, 0, [*p, 0][1]])}[kind]
        size = sympy.sqrt(sum(one**2 for one in x)) ** (2 if kind == "moment" else 1)
        F = h * (a * sympy.Matrix(x) + sympy.Matrix(m).cross(sympy.Matrix(x))) / size
        return [0] * (law.rows - dim) + list(F)[:dim], 0
    if law.name == "dead":
        return [h * p[0]], 0
    c = coordinate(law, y)
    along = c + TURNS if law.memory else c
    r = sum(sympy.diff(c, one) * rate for one, rate in zip(y, v, strict=True))
    if law.name == "constant_pull":
        f, potential = -h * p[0], h * p[0] * c
    elif law.name.startswith(("one_sided", "impact")):
        p = p[:-1] if law.judge else p  # whose last number is no part of the force
        f, potential = one_sided(*([p[0], c, r, *p[1:]] if len(p) == 6 else [-1, c, r, *p]))
    else:
        f, potential = -p[0] * (along - p[2]) - p[1] * r, p[0] * (along - p[2]) ** 2 / 2
    return [f * sympy.diff(c, one) for one in y], potential


TURNS = 6.0 * np.pi  #: that springs about an axis have made
PARTS = (force_symbols.rows, force_symbols.rates, force_symbols.numbers)


@pytest.mark.parametrize("name", built_in_forces.LAWS)
def test_forces_of_the_package_are_what_their_symbols_say(name: str) -> None:
    law, rng = built_in_forces.LAWS[name], np.random.default_rng(3)
    y, v, p = (
        part(count) for part, count in zip(PARTS, (law.rows, law.rows, law.numbers), strict=True)
    )
    (F, potential), gh = in_symbols(law), force_symbols.RATE
    slopes = [sympy.diff(F[i], y[j]) + gh * sympy.diff(F[i], v[j]) for i, j in law.pairs]
    gradient = [sympy.diff(potential, one) for one in y]
    given = [*y, *v, *p, force_symbols.history(), gh]
    value = sympy.lambdify(
        [given], [[*F, 0], [*slopes, 0], [*gradient, potential]], "math", cse=True
    )
    turned = sympy.lambdify([list(y)], coordinate(law, y) if law.memory else 0, "math")
    for _ in range(20):
        rows, rates, numbers = (
            rng.normal(size=law.rows),
            rng.normal(size=law.rows),
            rng.uniform(0.3, 1.5, law.numbers),
        )
        if name in ("one_sided", "impact"):
            numbers[0] = rng.choice([-1.0, 1.0])
        h, H, g, energy = (
            rng.normal(size=1),
            np.zeros(len(law.pairs)),
            np.zeros((2, law.rows)),
            np.zeros(1),
        )
        memory = np.full(law.memory, turned(list(rows)) + TURNS)
        piece = forces.compile_force(
            force_laws.one(law, range(law.rows), numbers, [0] * law.histories),
            forces.Place(0, 0, 0),
        )
        shared = {
            "y": rows,
            "rates": rates,
            "signals": h,
            "memory": memory,
            "H": H,
            "c": np.full(1, 0.7),
            "gh": np.full(1, 0.2),
        }
        law.force(space_of(g=g[0], **shared), piece.address)
        if law.slopes is not None:
            law.slopes(space_of(g=g[0], **shared), piece.address)
        if law.energy is not None:
            law.energy(space_of(g=g[1], energy=energy, **shared), piece.address)
        found = value([*rows, *rates, *numbers, *h, 0.2])
        assert_allclose(g[0], found[0][:-1], rtol=1e-11, atol=1e-13)
        assert_allclose(H, -0.7 * np.array(found[1][:-1]), rtol=1e-11, atol=1e-13)
        assert_allclose([*g[1], *energy], found[2], rtol=1e-11, atol=1e-13)


def test_wrong_classes_are_named() -> None:
    @dataclass(frozen=True)
    class Nothing(OwnForce, word=None):
        name: str
        at: fields.Place

    @dataclass(frozen=True)
    class Strange(OwnForce, word=None):
        name: str
        at: fields.Place

        @staticmethod
        def act(at: Any, mass: Any) -> Any:
            return []

    @dataclass(frozen=True)
    class Open(OwnForce, word=None):
        name: str
        at: fields.Place

        @staticmethod
        def energy(at: Any) -> Any:
            return symbols("k") * at.position[0]

    @dataclass(frozen=True)
    class Aside(OwnForce, word=None):
        name: str
        at: fields.Place

        @staticmethod
        def act(at: Any) -> Any:
            return [(2 * at.position, at.velocity)]

    for kind, message in (
        (Nothing, "expected a method act or energy, got none"),
        (Strange, "expected arguments that are fields, or t, got 'mass'"),
        (Open, "expected expressions of its arguments, got k in them"),
        (Aside, "expected pairs of a vector of a place and a force on it"),
    ):
        with pytest.raises(InputError, match=message):
            ball(2, kind("one", BALL))


def test_what_functions_of_python_cost_is_told() -> None:
    """One call a residual, and eight for each row and rate of a tangent; forces in symbols have
    nothing to tell.
    """
    ball = [point_mass("ball", 1.0, np.zeros(2))]
    system = assemble(ball, loads=[Wind("wind", BALL, 0.7)])
    with pytest.warns(
        Remark,
        match=r"functions of Python were called \d+ times for forces, \S+ s beside \S+ s of the run",
    ) as told:
        integrate(system, GeneralizedAlpha(1e-2), 0.5)
    assert int(str(told[-1].message).split(" called ")[1].split()[0]) > 50
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrate(assemble(ball, loads=[Drag("drag", BALL, 0.7)]), GeneralizedAlpha(1e-2), 0.1)
