"""Joints that slide along cables and beams: their contract, exact motions, friction, drives, ends
of lines, reduced models.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Body, Given, cable, point_mass
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.control.events import Event
from fmbs_skfem.core.errors import InputError, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs, solve_statics
from fmbs_skfem.reduction import files
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import (
    At,
    Motion,
    Rayleigh,
    System,
    assemble,
    check_force,
    check_joint,
    eliminate,
)
from fmbs_skfem.systems.connections import along_lines, constraint_laws, joints, mechanism
from fmbs_skfem.systems.evaluation import space_of
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.along_lines import SlidingForce, SlidingFriction, SlidingStop
from fmbs_skfem.systems.forces.gauges import LoadState
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.measures.line_places import Slide

from ..models import segment
from .test_beam_joints import leg

G = 9.81
STIFF = Given(EA=1e7, EI=1e6, rhoA=10.0)
SOFT = Given(EA=2000.0, EI=3.0, rhoA=0.5)
BEAD, BOX = At("bead"), At("box")


def bead(at: Any, mass: float = 0.1) -> Body:
    return point_mass("bead", mass, np.array(at, dtype=float))


def box(at: Any, dim: int, mass: float = 1.0) -> Body:
    return rigid("box", mass, 0.3 if dim == 2 else (0.2, 0.25, 0.3), at, dim=dim)


def slide(at: Any = BEAD, line: str = "line", **more: Any) -> joints.Sliding:
    return joints.Sliding("slide", at, line, **more)


# ------------------------------------------------------------------------------------------------------------- contract
def contracts() -> list[Any]:
    found = []
    for dim in (2, 3):
        at, ends = np.array([0.4, 0.2, 0.0])[:dim], segment(4, (0, 0, 0), (1, 0.5, 0))
        lines = {
            "C1": {},
            "C2": {"continuity": 2},
            "quintic": {"degree": 5, "continuity": 4},
            "Hermite": {"ancf": True},
        }
        for label, more in lines.items():
            part = cable("line", ends, SOFT, dim=dim, **more)
            found.append(pytest.param([part, bead(at)], slide(), id=f"{dim}-{label}"))
        turning = "none" if dim == 2 else "about_line"
        part = cable("line", ends, SOFT, dim=dim)
        found.append(pytest.param([part], slide(tuple(at)), id=f"{dim}-ring"))
        found.append(
            pytest.param([part, box(at, dim)], slide(BOX, rotation=turning), id=f"{dim}-{turning}")
        )
        found.append(
            pytest.param(
                [part, cable("rope", segment(2, at, at + 1.0), SOFT, dim=dim)],
                slide(At("rope", "left")),
                id=f"{dim}-lines",
            )
        )
    for rotation in ("free", "about_line", "none"):
        part = leg("line", (0, 0, 0), (1, 0, 0), (0, 0, 1))
        found.append(
            pytest.param(
                [part, box((0.37, 0, 0), 3)], slide(BOX, rotation=rotation), id=f"beam-{rotation}"
            )
        )
    return found


@pytest.mark.parametrize("parts, joint", contracts())
def test_contract(parts: list[Body], joint: joints.Sliding) -> None:
    check_joint(parts, joint)


@pytest.mark.parametrize(
    "load",
    [SlidingForce("f", "slide", of_state("-k * place - c * rate", "N", {"k": 3.0, "c": 2.0}))],
)
def test_contract_of_loads(load: loads.Load, monkeypatch: pytest.MonkeyPatch) -> None:
    part, mass = cable("line", segment(4), SOFT, dim=2), bead((0.4, 0.0))
    monkeypatch.setattr(
        "fmbs_skfem.systems.checks.assemble",
        lambda bodies, joints=(), loads=(): assemble(bodies, [slide()], loads),
    )
    check_force([part, mass], load)


@pytest.mark.parametrize("derivative", [0, 1])
def test_drift_of_the_law(derivative: int) -> None:
    """Second and third derivatives by time along paths without a third derivative, against those of
    the polynomial that phi is.
    """
    part, rng = cable("line", segment(4), SOFT, dim=2), np.random.default_rng(derivative)
    law = along_lines.law_on(part.space, 2)  # type: ignore[arg-type]
    numbers = along_lines.numbers_of(part.space, 1.0, 2, derivative)  # type: ignore[arg-type]
    y, z, v, a = (0.1 * rng.normal(size=law.rows) for _ in range(4))
    y[0], v[0], a[0] = 0.37, 0.1, 0.2
    found = constraint_laws.one(law, 0, range(law.rows), numbers)
    record = constraint_laws.compile_rows(found, 0)
    t = 0.5 * np.cos(np.pi * (np.arange(15) + 0.5) / 15)
    phi = [
        constraint_laws.evaluate(found, y + v * s + 0.5 * a * s**2, np.zeros(0))[0][0] for s in t
    ]
    path = np.polynomial.Polynomial.fit(t, phi, 12)
    slopes = constraint_laws.evaluate(found, y, np.zeros(0))[1][0]
    for leads, expected in (
        ((1.0, 0.0), path.deriv(2)(0.0) - slopes @ a),
        ((0.0, 1.0), path.deriv(3)(0.0)),
    ):
        drift = np.zeros((1, 1))
        space = space_of(
            paths=np.stack([y, z, v, a]), leads=np.array(leads), multipliers=np.zeros(1), rhs=drift
        )
        law.routines.drift(space, record.address)
        assert drift[0, 0] == pytest.approx(slopes @ z + expected, rel=1e-8)


# -------------------------------------------------------------------------------------------------------------- motions
def incline(
    dim: int = 2, more: Any = (), start: float = 0.0, length: float = 4.0, **others: Any
) -> System:
    """A bead of 0.1 kg on a stiff line that falls at 30 degrees, 0.5 m from its start."""
    down = np.array([np.cos(np.pi / 6), -0.5, 0.0])[:dim]
    line = cable(
        "line", segment(5, (0, 0, 0), tuple(length * np.pad(down, (0, 3 - dim)))), STIFF, dim=dim
    )
    held = [joints.Clamp("a", At("line", "left")), joints.Clamp("b", At("line", "right")), slide()]
    weight = loads.PointForce("w", BEAD, (0.0, -0.1 * G, 0.0)[:dim])
    sensed = {
        "r": probes.Position(BEAD),
        "R": probes.Reaction("slide"),
        "E": probes.Energy(),
        "place": Slide("slide"),
    } | others.pop("outputs", {})
    parts, initial = (
        [line, bead(0.5 * down)],
        {"bead": Motion(tuple(start * down))} if start else {},
    )
    return assemble(parts, held, [weight, *more], outputs=sensed, initial=initial, **others)


@pytest.mark.parametrize("form", [eliminate, lambda system: system])
@pytest.mark.parametrize("dim", [2, 3])
def test_down_an_incline(dim: int, form: Any) -> None:
    """s = s0 + g sin(a) t^2 / 2 over four cells; the line pushes with m g cos(a) across, and
    nothing along.
    """
    system = incline(dim)
    assert mechanism.analyse(system).mobility == 1
    motion = integrate(form(system), GeneralizedAlpha(2e-3), 1.0)
    found = outputs(motion)
    assert_allclose(found["place"], 0.5 + 0.25 * G * motion.times**2, atol=2e-5)
    assert_allclose(found["place_rate"], 0.5 * G * motion.times, atol=2e-4)
    push = np.column_stack([found["R_x"], found["R_y"]])[30:]
    # the line vibrates
    assert_allclose(push @ (0.5, np.cos(np.pi / 6)), 0.1 * G * np.cos(np.pi / 6), rtol=5e-3)
    assert np.abs(push @ (np.cos(np.pi / 6), -0.5)).max() < 1e-5
    assert np.ptp(found["E_balance"]) < 1e-6 * found["E_kinetic"].max()


def test_it_begins_with_its_bead() -> None:
    """The rate along the line follows from the motion of bodies: nothing is projected, and no
    warning says so.
    """
    system = eliminate(incline(start=1.0))
    found = outputs(integrate(system, GeneralizedAlpha(2e-3), 0.1))
    assert found["place_rate"][0] == pytest.approx(1.0, rel=1e-12)
    assert found["place"][-1] == pytest.approx(0.5 + 0.1 + 0.25 * G * 0.01, abs=1e-6)


def arc(cells: int = 24) -> tuple[np.ndarray, curves.Curve]:
    angle = np.linspace(-np.pi, 0.0, cells + 1)
    return curves.through(np.column_stack([np.cos(angle), np.sin(angle)]))


def test_pendulum_on_an_arc() -> None:
    """A bead on a stiff half circle of 1 m swings as a mathematical pendulum, to the second order
    in the step.
    """
    breaks, curve = arc()
    line = curves.Line(breaks, curve, {"left": 0.0, "right": float(breaks[-1])}, None)
    ring = cable("line", line, Given(EA=1e8, EI=1e7, rhoA=1000.0), dim=2, continuity=2)
    theta0 = np.radians(50.0)
    held = [joints.Clamp("a", At("line", "left")), joints.Clamp("b", At("line", "right")), slide()]
    push = [loads.PointForce("w", BEAD, (0.0, -0.1 * G))]
    parts = [ring, bead(curve(np.array([breaks[12] + theta0 * breaks[-1] / np.pi]), 0)[0])]
    system = eliminate(
        assemble(parts, held, push, outputs={"r": probes.Position(BEAD), "place": Slide("slide")})
    )
    exact = solve_ivp(
        lambda t, y: [y[1], -G * np.sin(y[0])],
        (0.0, 1.5),
        [theta0, 0.0],
        rtol=1e-10,
        atol=1e-12,
        dense_output=True,
    ).sol

    def error(h: float) -> float:
        motion = integrate(system, GeneralizedAlpha(h), 1.5)
        found = outputs(motion)
        return float(np.abs(np.arctan2(found["r_x"], -found["r_y"]) - exact(motion.times)[0]).max())

    errors = [error(h) for h in (1.2e-2, 6e-3)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.25)
    assert error(1.5e-3) < 2e-4


def test_a_force_that_moves_over_a_beam() -> None:
    """Deflection at mid-span under a constant force that moves at constant speed, by the series of
    a simply supported beam.

    L. Fryba, Vibration of Solids and Structures under Moving Loads, 3rd ed., 1999, ch. 1.
    """
    L, EI, rhoA, P, speed = 10.0, 1e6, 20.0, 100.0, 8.0
    beam = cable("line", segment(10, (0, 0, 0), (L, 0, 0)), Given(EA=1e9, EI=EI, rhoA=rhoA), dim=2)
    held = [
        joints.Pin("a", At("line", "left")),
        joints.Slider("b", At("line", "right"), (1.0, 0.0)),
        slide(),
    ]
    held.append(joints.DrivenSlide("drive", "slide", lambda t: speed * t))
    push = [loads.PointForce("P", BEAD, (0.0, -P))]
    sensed = {"mid": probes.Position(At("line", 5.0), "y"), "drive": probes.Reaction("drive")}
    parts, start = [beam, bead((0.0, 0.0), 1e-4)], {"bead": Motion((speed, 0.0))}
    motion = integrate(
        eliminate(assemble(parts, held, push, outputs=sensed, initial=start)),
        GeneralizedAlpha(1e-3, 0.9),
        1.2,
    )
    found, t, exact = outputs(motion), motion.times, 0.0
    for j in range(1, 40):
        own, w = (j * np.pi / L) ** 2 * np.sqrt(EI / rhoA), j * np.pi * speed / L
        exact = exact + np.sin(j * np.pi / 2) * 2 * P / (rhoA * L * (own**2 - w**2)) * (
            np.sin(w * t) - w / own * np.sin(own * t)
        )
    assert np.abs(exact).max() == pytest.approx(P * L**3 / (48 * EI), rel=0.25)
    assert_allclose(found["mid"], -exact, atol=5e-3 * np.abs(exact).max())
    assert np.abs(found["drive_thrust"]).max() < 0.1 * P


def test_a_mass_on_a_line_that_flies() -> None:
    """Bead and cable in free flight: momentum is kept to round-off, energy to the second order,
    over breaks of cells.
    """
    line = cable("line", segment(6), SOFT, dim=2, continuity=2)
    start = {"line": Motion((0.0, 0.0), 3.0, (0.5, 0.0)), "bead": Motion((2.0, -0.6))}
    sensed = {"r": probes.Position(BEAD), "place": Slide("slide"), "E": probes.Energy()}
    system = eliminate(assemble([line, bead((0.3, 0.0))], [slide()], outputs=sensed, initial=start))
    drop = []
    for h in (2e-3, 1e-3):
        motion = integrate(system, GeneralizedAlpha(h, 1.0), 0.25, Newton(tolerance=1e-11))
        found = outputs(motion)
        momentum = (system.lift.matrix @ motion.v.T).T @ (
            system.full.mass @ np.kron(system.unit, np.eye(2)).T
        )  # type: ignore[union-attr]
        assert_allclose(momentum, np.tile(momentum[0], (len(momentum), 1)), atol=1e-9)
        drop.append(np.ptp(found["E_balance"]))
    assert np.ptp(found["place"]) > 1.5 / 6.0
    assert drop[1] < 2e-4 * found["E_kinetic"][0]
    assert drop[0] / drop[1] > 3.0


def test_a_section_takes_its_body_along() -> None:
    """A box on the section of a beam that a torque twists turns by T s / GJ, wherever it is driven."""
    line, T = leg("line", (0, 0, 0), (1, 0, 0), (0, 0, 1)), 3.0
    held = [
        joints.Clamp("a", At("line", "left")),
        slide(BOX, rotation="none"),
        joints.DrivenSlide("drive", "slide", lambda t: 0.5 * t),
    ]
    sensed = {
        "place": Slide("slide"),
        "turn": probes.Angle(BOX, (1.0, 0.0, 0.0)),
        "R": probes.Reaction("slide"),
    }
    system = assemble(
        [line, box((0.25, 0, 0), 3)],
        held,
        [loads.Moment("T", At("line", "right"), (T, 0.0, 0.0))],
        outputs=sensed,
    )
    assert (mechanism.analyse(system).mobility, mechanism.analyse(system).free) == (1, 0)
    motion = solve_statics(eliminate(system), 5)
    found = outputs(motion)
    assert_allclose(found["turn"], T / 60.0 * motion.times * found["place"], atol=1e-6)
    assert_allclose(found["place"], 0.25 + 0.5 * motion.times, atol=1e-9)
    assert max(np.abs(found[name]).max() for name in found if name.startswith("R_")) < 1e-6


# ---------------------------------------------------------------------------------------------- loads, ends, other forms
def test_friction() -> None:
    """s = s0 + v t + g (sin a - mu cos a) t^2 / 2, the force mu m g cos a, and what it takes from
    the energy.
    """
    mu = 0.2
    system = incline(
        more=[SlidingFriction("rub", "slide", mu)], start=1.0, outputs={"rub": LoadState("rub")}
    )
    motion = integrate(eliminate(system), GeneralizedAlpha(2e-3), 0.5)
    found, down = outputs(motion), G * (0.5 - mu * np.cos(np.pi / 6))
    assert_allclose(found["place"], 0.5 + motion.times + 0.5 * down * motion.times**2, atol=1e-5)
    assert_allclose(found["rub_force"], -mu * 0.1 * G * np.cos(np.pi / 6), rtol=3e-2)
    assert np.ptp(found["E_balance"]) < 1e-5 * found["E_kinetic"].max()


def test_a_rope_over_rings() -> None:
    """A cable pulled through ten rings on a quarter turn: tensions are as e^(mu alpha), of n rings
    as those of n bends.

        T2 / T1 = ((1 + mu tan) / (1 - mu tan))^n,    tan = tan(alpha / 2 n)

    L. Euler, Hist. Acad. Berlin 18 (1762) 265-278; J. A. Eytelwein, Handbuch der Statik fester
    Koerper, 1808.
    """
    R, straight, mu, count, pull = 0.1, 0.15, 0.3, 10, 20.0
    length = 2 * straight + R * np.pi / 2
    s = np.linspace(0.0, length, 49)
    angle = np.clip((s - straight) / R, 0.0, np.pi / 2)
    points = R * np.column_stack([np.sin(angle), np.cos(angle)])
    points[:, 0] -= np.maximum(straight - s, 0.0)
    points[:, 1] -= np.maximum(s - straight - R * np.pi / 2, 0.0)
    breaks, curve = curves.through(points)
    line = curves.Line(breaks, curve, {"left": 0.0, "right": float(breaks[-1])}, None)
    rope = cable("line", line, Given(EA=5e3, EI=2e-4, rhoA=0.05), dim=2, continuity=2)
    places = straight + (np.arange(count) + 0.5) / count * R * np.pi / 2
    rings = [tuple(curve(np.array([breaks[-1] * one / length]), 0)[0]) for one in places]
    held: list[joints.Joint] = [
        joints.Sliding(f"ring {k}", one, "line") for k, one in enumerate(rings)
    ]
    held += [joints.Slider("guide", At("line", "left"), (1.0, 0.0))]
    down = lambda t: -0.02 * np.where(t < 0.1, 5 * t**2, t - 0.05)  # noqa: E731
    held += [joints.DrivenPosition("winch", At("line", "right"), (lambda t: 0 * t, down))]
    push: list[loads.Load] = [
        loads.PointForce("T", At("line", "left"), (-pull, 0.0), lambda t: np.minimum(1.0, 20 * t))
    ]
    push += [SlidingFriction(f"rub {k}", f"ring {k}", mu) for k in range(count)]
    system = assemble(
        [rope], held, push, Rayleigh(20.0, 1e-3), outputs={"T": probes.Reaction("winch")}
    )
    found = outputs(integrate(eliminate(system), GeneralizedAlpha(1e-3, 0.5), 0.5))
    bend = mu * np.tan(np.pi / 4 / count)
    assert abs(found["T_y"][-1]) / pull == pytest.approx(
        ((1 + bend) / (1 - bend)) ** count, rel=5e-3
    )
    assert abs(found["T_y"][-1]) / pull == pytest.approx(np.exp(mu * np.pi / 2), rel=5e-3)


def test_friction_holds() -> None:
    """Below the angle of friction it sticks: it creeps with the part of the speed at which friction
    begins that balances.
    """
    mu, v0 = 1.0, 1e-4
    system = incline(more=[SlidingFriction("rub", "slide", mu, v0)])
    found = outputs(integrate(eliminate(system), GeneralizedAlpha(1e-3), 0.5))
    assert found["place_rate"][-1] == pytest.approx(
        v0 * np.arctanh(np.tan(np.pi / 6) / mu), rel=1e-3
    )


def test_drag_and_springs_along_the_line() -> None:
    law = of_state("-k * (place - middle) - c * rate", "N", {"k": 20.0, "middle": 1.0, "c": 3.0})
    system = incline(more=[SlidingForce("hold", "slide", law)])
    found = outputs(integrate(eliminate(system), GeneralizedAlpha(2e-3), 3.0))
    assert found["place"][-1] == pytest.approx(1.0 + 0.1 * G * 0.5 / 20.0, abs=1e-5)
    drag = incline(more=[SlidingFriction("rub", "slide", damping=0.5)], length=6.0)
    motion = integrate(eliminate(drag), GeneralizedAlpha(2e-3), 1.0)
    limit, rate = 0.1 * G * 0.5 / 0.5, 0.5 / 0.1
    assert_allclose(
        outputs(motion)["place_rate"], limit * (1 - np.exp(-rate * motion.times)), atol=2e-4
    )


def test_a_run_stops_at_the_end_of_the_line() -> None:
    with pytest.warns(
        Notice,
        match=r"joint 'slide' leaves its line at the end of the step to t = 1\.19.* let an event release",
    ):
        motion = integrate(eliminate(incline()), GeneralizedAlpha(2e-3), 2.0)
    late = np.sqrt(3.5 / (0.25 * G))
    assert late <= motion.times[-1] < late + 4e-3
    assert [one.stop for one in motion.events] == [True]


def test_a_joint_that_is_released_lets_its_bead_fall() -> None:
    off = Event(when=of_state("place - 3.5 * one", "", {"one": 1.0}), release=("slide",))
    system = incline(events={"off": off})
    motion = integrate(eliminate(system), GeneralizedAlpha(2e-3), 1.6)
    found, t = outputs(motion), motion.events[0].time
    assert t == pytest.approx(np.sqrt(3.0 / (0.25 * G)), abs=1e-4)
    v, rest = 0.5 * G * t, 1.6 - t
    down = np.array([np.cos(np.pi / 6), -0.5])
    expected = 3.5 * down + v * down * rest + (0.0, -0.5 * G * rest**2)
    assert_allclose([found["r_x"][-1], found["r_y"][-1]], expected, atol=1e-3)


def test_what_acts_along_the_line_ends_with_the_joint() -> None:
    """A rope that is pulled through a ring falls free once the ring has let go; its place there
    stays, also where a force acts.
    """
    off, push = (
        Event(when=of_state("place - 2 * one", "", {"one": 0.4}), release=("slide",)),
        of_state("F", "N", {"F": 1.0}),
    )
    loose = [SlidingForce("f", "slide", push), SlidingFriction("rub", "slide", 0.1)]
    sensed = {"place": Slide("slide"), "E": probes.Energy()}
    parts, rest = (
        [cable("line", segment(8), Given(EA=2000.0, EI=0.01, rhoA=0.05), dim=2)],
        Rayleigh(0.0, 1e-3),
    )
    for form in (eliminate, lambda system: system):
        system = form(
            assemble(parts, [slide((0.4, 0.0))], loose, rest, outputs=sensed, events={"off": off})
        )
        motion = integrate(system, GeneralizedAlpha(1e-3), 0.4)
        found = outputs(motion)
        assert len(motion.events) == 1
        assert found["place"][-1] == pytest.approx(0.8, abs=1e-3)
        late = motion.times > motion.events[0].time + 5e-3
        assert late.sum() > 50
        assert (
            np.ptp((found["E_kinetic"] + found["E_strain"])[late]) < 0.05 * found["E_kinetic"][-1]
        )


def test_a_stop_at_the_end() -> None:
    stop = SlidingStop("stop", "slide", 1e4)
    found = outputs(integrate(eliminate(incline(more=[stop])), GeneralizedAlpha(5e-4), 2.0))
    assert found["place"].max() == pytest.approx(4.0 + np.sqrt(0.1 / 1e4 * 3.5 * G), rel=1e-3)
    assert found["place"][-1] < 2.0
    weak = incline(more=[SlidingStop("stop", "slide", 10.0)])
    with pytest.warns(Notice, match="give its `sliding_stop` a larger stiffness"):
        integrate(eliminate(weak), GeneralizedAlpha(5e-4), 2.0)


def test_equilibria() -> None:
    """A bead on a cable that hangs in the middle of a symmetric one; beyond the end there is none."""
    line = cable("line", segment(8), Given(EA=2000.0, EI=0.3, rhoA=0.5), dim=2)
    held = [joints.Pin("a", At("line", "left")), joints.Pin("b", At("line", "right")), slide()]
    sensed = {"place": Slide("slide"), "r": probes.Position(BEAD)}
    system = eliminate(
        assemble(
            [line, bead((0.45, 0.0), 2.0)],
            held,
            [loads.PointForce("w", BEAD, (0.0, -20.0))],
            outputs=sensed,
        )
    )
    found = outputs(solve_statics(system, 10))
    assert found["place"][-1] == pytest.approx(0.5, abs=1e-6)
    out = SlidingForce("f", "slide", of_state("k * (8 - place / one)", "N", {"k": 1.0, "one": 1.0}))
    with pytest.raises(
        SolverError, match="joint 'slide' is beyond the end of its line in equilibrium"
    ):
        solve_statics(eliminate(incline(more=[out])), 1)


def test_reduced_models(tmp_path: Any) -> None:
    """A girder under a bead that rolls over it, by its modes, from a file too."""
    line = cable("line", segment(8, (0, 0, 0), (4, 0, 0)), Given(EA=1e6, EI=4e3, rhoA=4.0), dim=2)
    held = [
        joints.Pin("a", At("line", "left")),
        joints.Slider("b", At("line", "right"), (1.0, 0.0)),
        slide(),
    ]
    push = [loads.PointForce("w", BEAD, (0.0, -20.0))]
    sensed = {
        "mid": probes.Position(At("line", 2.0), "y"),
        "place": Slide("slide"),
        "R": probes.Reaction("slide"),
    }
    raw = assemble(
        [line, bead((0.5, 0.0), 2.0)],
        held,
        push,
        outputs=sensed,
        initial={"bead": Motion((3.0, 0.0))},
    )
    scheme = GeneralizedAlpha(2e-3)
    motion = integrate(raw, scheme, 1.0)
    parts = component.body_level(raw)
    assert parts["slide.s"] == ("slide.s",)
    bases = galerkin.bases(raw, galerkin.snapshots(motion, 0.01), parts, 1e-9)
    small = galerkin.reduce_system(raw, parts, bases)
    assert small.size < raw.size / 2
    files.save(small, tmp_path / "small.h5")
    full = outputs(motion)
    for system in (small, files.load(tmp_path / "small.h5")):
        found = outputs(integrate(system, scheme, 1.0))
        assert np.abs(found["mid"] - full["mid"]).max() < 1e-3 * np.ptp(full["mid"])
        assert np.abs(found["place"] - full["place"]).max() < 1e-4
        assert np.abs(found["R_y"] - full["R_y"])[20:].max() < 0.05 * np.abs(full["R_y"]).max()


def test_large_models(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = outputs(integrate(incline(), GeneralizedAlpha(2e-3), 0.1))
    for name in ("BAND", "DENSE"):
        monkeypatch.setattr(f"fmbs_skfem.systems.layouts.{name}", 1)
    system = incline()
    motion = integrate(replace(system), GeneralizedAlpha(2e-3), 0.1)
    assert motion.statistics.solver.startswith("sparse")
    assert_allclose(outputs(motion)["place"], expected["place"], atol=1e-8)


@pytest.mark.parametrize(
    "dim, parts, joint, named",
    [
        (
            2,
            [bead((0.4, 0.1))],
            slide(),
            r"bead on the line of 'line', got 0\.1 m away from it: the nearest point is \(0\.4, 0\), at s = 0\.4 m; move",
        ),
        (
            2,
            [],
            slide((0.4, 0.1)),
            r"the fixed point \(0\.4, 0\.1\) on the line of 'line', got 0\.1 m away",
        ),
        (
            2,
            [bead((0.4, 0.0))],
            slide(line="bead"),
            r"'slide'\.line: expected a cable or a beam, got 'bead', which is none",
        ),
        (
            2,
            [bead((0.4, 0.0))],
            slide(line="lime"),
            r"'slide'\.line: expected one of the bodies .* got 'lime'",
        ),
        (2, [], slide(), "expected one of the bodies line, got 'bead'"),
        (
            2,
            [box((0.4, 0.0), 2)],
            slide(BOX, rotation="about_line"),
            r"'slide'\.rotation: expected free or none in the plane",
        ),
        (
            3,
            [box((0.4, 0.0, 0.0), 3)],
            slide(BOX, rotation="none"),
            "free or about_line on a cable, which has no torsion",
        ),
        (
            2,
            [],
            slide((0.4, 0.0), rotation="none"),
            r"'slide'\.rotation: expected free at a fixed point",
        ),
        (2, [bead((0.4, 0.0))], slide(rotation="none"), "carries the direction"),
    ],
)
def test_what_does_not_fit_is_named(
    dim: int, parts: list[Body], joint: joints.Sliding, named: str
) -> None:
    with pytest.raises(InputError, match=named):
        assemble([cable("line", segment(4), SOFT, dim=dim), *parts], [joint])


@pytest.mark.parametrize(
    "load", [SlidingFriction("rub", "slid", 0.1), SlidingStop("stop", "slid", 1.0)]
)
def test_loads_name_a_joint_that_slides(load: loads.Load) -> None:
    with pytest.raises(
        InputError,
        match=rf"'{load.name}'\.joint: expected one of the joints that slide \(slide\), got 'slid'",
    ):
        incline(more=[load])


def test_a_line_that_something_slides_on_beside_a_body_without_extent() -> None:
    """The place of what slides is an unknown that has no points."""
    meshes = Path(__file__).parents[2] / "meshes"
    text = f"""
schema: 1
dimension: 2
bodies:
  girder:
    type: cable
    mesh: {meshes / "beam_20.msh"}
    section: {{shape: circular, diameter: 30 mm}}
    material: {{young_modulus: 5 GPa, density: 1800 kg/m^3}}
  trolley: {{type: point_mass, mass: 1 kg, position: [0.3 m, 0]}}
  drum: {{type: rigid, mass: 2 kg, inertia: 0.05 kg m^2, center: [0, -2 m]}}
joints:
  left: {{type: clamp, at: girder.left}}
  wheels: {{type: sliding, at: trolley, line: girder}}
  spin: {{type: revolute, at: drum}}
analysis: {{type: dynamic, duration: 0.1 s, step: 1 ms}}
"""
    found = build.system(scenes.loads(text), allow_outside=True)
    assert "spin" in {joint for joint, _ in found.constraints.names}
