"""Contact of a beam with itself: loops, folds and rings, open and closed, against an exact
elastica.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import root

from fmbs_skfem.bodies import Body, Given, cable
from fmbs_skfem.contact.beams import ContactBeam
from fmbs_skfem.contact.states import ContactState
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs, solve_statics
from fmbs_skfem.systems import (
    At,
    Motion,
    Rayleigh,
    System,
    assemble,
    check_force,
    compiled,
    eliminate,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from ..forms import forms
from ..models import polyline
from .test_contact_beams import SOFT, TIGHT, momenta

RADIUS = 0.05


def touch(**more: Any) -> ContactBeam:
    return ContactBeam(
        "touch", body="c", other="c", **{"radius": RADIUS, "stiffness": 500.0, **more}
    )


def curve(x: np.ndarray, y: np.ndarray, z: np.ndarray, dim: int = 3, section: Given = SOFT) -> Body:
    return cable("c", polyline(np.column_stack([x, y, z])), section, dim=dim)


def loop(up: float = 0.09, cells: int = 40) -> Body:
    """A line that crosses itself at right angles about the origin, `up` apart."""
    t = np.linspace(-1.3, 1.3, cells + 1)
    return curve(t**2 - 1.0, t * (t**2 - 1.0), 0.5 * up * t)


def eight(seam: float, cells: int = 48, up: float = 0.09) -> Body:
    """A closed line like an eight, from an angle on, whose strands meet about the origin, `up`
    apart.
    """
    a = seam + np.linspace(0.0, 2 * np.pi, cells + 1)
    return curve(np.sin(a), np.sin(a) * np.cos(a), -0.5 * up * np.cos(a))


def fold(cells: int = 16, dim: int = 2) -> Body:
    """A hairpin, whose strands overlap from the middle on."""
    straight, turn, R = np.linspace(0.5, 0.0, cells + 1), np.linspace(0.0, np.pi, 9)[1:-1], 0.06
    lean = 0.04 * straight
    x = np.concatenate([straight, -R * np.sin(turn), straight[::-1]])
    y = np.concatenate([-R + lean, -R * np.cos(turn), R - lean[::-1]])
    return curve(x, y, 0.0 * x, dim)


BODIES = {
    "loop": (loop(), {}),
    "closed": (eight(-0.02), {}),
    "fold": (fold(), {}),
    "fold in space": (fold(dim=3), {"along": True}),
}


@pytest.mark.filterwarnings("ignore:.*(overlap|curved in space)")
@pytest.mark.parametrize("name", BODIES)
def test_contract(name: str) -> None:
    """Tangents of a smooth law, those of what sticks and slides, and symmetric ones of forces with
    a potential.
    """
    part, more = BODIES[name]
    smooth = {"stiffness": 50.0, "damping": 0.4, "dissipation": 0.3, "smoothing": 0.002, **more}
    check_force([part], touch(**smooth))
    system, random = (
        replace(assemble([part], loads=[touch(friction=0.3, **smooth)]), elastic=()),
        np.random.default_rng(1),
    )
    model = compiled.compile_system(system)
    memory, none = compiled.accepted(model, system.x0), np.zeros(0)
    d, way, v = random.normal(size=(3, system.size))
    x = system.x0 + 1e-4 * way
    K = compiled.tangent(model, x, none, 0.0, 0.3, memory, 0.1 * v)
    ends = [
        compiled.forces(model, x + k * 1e-7 * d, 0.1 * v + 3e-8 * k * d, 0.0, memory)
        for k in (1, -1)
    ]
    assert np.abs(K @ d).max() > 0.0
    assert_allclose(K @ d, (ends[0] - ends[1]) / 2e-7, atol=1e-5 * np.abs(K @ d).max())
    plain = compiled.compile_system(replace(assemble([part], loads=[touch(**more)]), elastic=()))
    K = compiled.tangent(plain, x, none).toarray()
    assert_allclose(K, K.T, atol=1e-11 * np.abs(K).max())


def pinched_force(a: float, EI: float, gap: float) -> float:
    """The force that presses opposite points of a ring to a gap: EI t'' = - P / 2 cos t, t from 0
    to pi / 2 over pi a / 2.
    """

    def miss(guess: np.ndarray) -> np.ndarray:
        bend, P = guess
        end = solve_ivp(
            lambda s, y: [y[1], -0.5 * P * np.cos(y[0]), np.sin(y[0])],
            (0.0, np.pi / 2),
            [0.0, bend, 0.0],
            rtol=1e-10,
            atol=1e-12,
        ).y[:, -1]
        return np.array([end[0] - np.pi / 2, end[2] - 0.5 * gap / a])

    found = root(miss, [-0.5, -4.0])
    assert found.success
    return float(abs(found.x[1]) * EI / a**2)


def ring(P: float, cells: int = 60, EA: float = 1e6, **more: Any) -> System:
    """A closed ring, held below, whose top is pressed down by a force."""
    a, s = 0.5, np.linspace(0.0, 2 * np.pi, cells + 1)
    part = curve(a * np.sin(s), -a * np.cos(s), 0.0 * s, 2, Given(EA=EA, EI=3.0, rhoA=0.5))
    top = At("c", np.pi * a)
    held = [
        joints.Weld("seam", At("c", "left"), At("c", "right")),
        joints.Clamp("foot", At("c", "left")),
        joints.Slider("guide", top, direction=(0.0, 1.0)),
    ]
    out = {"touch": ContactState("touch"), "top": probes.Position(top)}
    press = loads.PointForce("press", top, (0.0, -P))
    return assemble([part], held, [press, touch(**more)], Rayleigh(stiffness=2e-3), out)


def test_a_ring_pressed_flat() -> None:
    """What presses more than it takes to bring opposite points together goes through where they
    touch: N = P - P_c (elastica).
    """
    k, P = 2e4, 120.0
    found = {
        name: column[-1]
        for name, column in outputs(solve_statics(ring(P, stiffness=k), 10)).items()
    }

    assert found["touch_force"] > 5.0
    assert found["touch_gap"] == pytest.approx(-found["touch_force"] / k, rel=1e-6)
    exact = P - pinched_force(0.5, 3.0, 2 * RADIUS + found["touch_gap"])
    assert found["touch_force"] == pytest.approx(exact, rel=1e-3)


@pytest.mark.filterwarnings("ignore:.*(overlap|curved in space)")
@pytest.mark.parametrize("name", ["loop", "closed", "fold"])
def test_momentum_and_energy_stay(name: str) -> None:
    """Strands that overlap at the start push one another apart, in flight; friction in the plane
    acts where they touch.
    """
    part, more = BODIES[name]
    law = touch(friction=0.3 if part.dim == 2 else 0.0, **more)
    start = {"c": Motion(velocity=(1.0, 0.5, -0.3)[: part.dim])}
    system = assemble(
        [part],
        loads=[law],
        outputs={"E": probes.Energy(), "touch": ContactState("touch")},
        initial=start,
    )
    motion = integrate(system, GeneralizedAlpha(2e-4, 1.0), 0.02, TIGHT)
    found, (P, L) = outputs(motion), momenta(motion)
    assert found["touch_force"][0] > 1.0 > found["touch_force"][-1]
    assert np.ptp(P, axis=0).max() < 1e-12 * np.abs(P).max() + 1e-12
    assert np.ptp(L, axis=0).max() < 1e-5


@pytest.mark.filterwarnings("ignore:.*(overlap|curved in space)")
def test_nothing_is_felt_of_the_seam_of_a_closed_line() -> None:
    """Strands that cross beside the seam, on it, or far from it touch with the same force, once."""
    found = []
    for seam in (1.0, -0.02, 0.02, np.pi - 0.03, np.pi / 2):
        system = assemble(
            [eight(seam, 200)], loads=[touch()], outputs={"touch": ContactState("touch")}
        )
        found.append(outputs(integrate(system, GeneralizedAlpha(1e-4), 1e-4))["touch_force"][0])
    assert_allclose(found, 500.0 * 0.01, rtol=1e-3)


@pytest.mark.filterwarnings("ignore:.*(projected|overlap)")
def test_every_form(tmp_path: Path) -> None:
    """Full, reduced, hyper-reduced and saved models of a loop whose strands push one another apart."""
    out = {"touch": ContactState("touch"), "end": probes.Position(At("c", "right"))}
    raw = assemble(
        [loop()],
        [],
        [touch(friction=0.2)],
        Rayleigh(stiffness=2e-3),
        out,
        {"c": Motion(velocity=(0.5, 0.0, 0.0))},
    )
    scheme, duration = GeneralizedAlpha(1e-3, 0.8), 0.1
    full = integrate(eliminate(raw), scheme, duration, TIGHT)
    expected = outputs(full)
    for system in forms(raw, full, 1e-12, tmp_path / "model.h5"):
        found = outputs(integrate(system, scheme, duration, TIGHT))
        assert_allclose(found["touch_force"], expected["touch_force"], atol=0.05)
        assert_allclose(found["end_z"], expected["end_z"], atol=1e-4)


@pytest.mark.parametrize(
    "more, message",
    [
        (
            {"apart": 3.0},
            "load 'touch'.apart: expected less than half of the beam, 1.5.* m, .*got 3 m",
        ),
        ({"radius": 0.6}, "load 'touch'.apart: expected less than half of the beam, .*got 1.88"),
    ],
)
def test_stocky_beams_do_not_touch_themselves(more: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        ring(1.0, **more)
