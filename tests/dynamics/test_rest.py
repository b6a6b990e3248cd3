"""Motions that start in the equilibrium of their loads: they stay there, and forces are those of
statics from the first instant.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from fmbs_skfem import reduction
from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    energies,
    explain,
    integrate,
    integrate_many,
    outputs,
    solve_statics,
    start,
)
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.controls import ControlTorque
from fmbs_skfem.systems.forces.gauges import LoadState
from fmbs_skfem.systems.forces.springs import SpringDamper
from fmbs_skfem.systems.measures import probes
from tests import models
from tests.dynamics.test_checkpoint import assert_same, stopped
from tests.reduction.conftest import Full, full_of, reduced

FROM_REST = GeneralizedAlpha(1e-3, start="equilibrium")
TIGHT = Newton(1e-12)
G = 9.81  #: [m/s2]
Z = (0.0, 0.0, 1.0)


def sagging(shape: Callable[[body.Body], body.Body] = lambda beam: beam) -> System:
    """A cantilever of 1 kg, EI = 1 N m2, that bends by more than half of its length under 4 N at
    its end and its weight.
    """
    beam = shape(
        body.cable("beam", models.segment(8), sections.Given(EA=1e6, EI=1.0, rhoA=1.0), dim=2)
    )
    tip, root = At("beam", "right"), At("beam", "left")
    down = [loads.PointForce("end", tip, (0.0, -4.0)), loads.Gravity((0.0, -G))]
    watched = {"tip": probes.Position(tip), "clamp": probes.Reaction("clamp")}
    return assemble([beam], [joints.Clamp("clamp", root)], down, outputs=watched)


@functools.cache
def drop() -> Full:
    """The motion from the reference, which passes the equilibrium."""
    return full_of(sagging(), GeneralizedAlpha(1e-3), 1.0, 5e-3)


def by_modes() -> System:
    return reduced(drop(), reduction.body_level(drop().raw), 1e-13).system


def by_part() -> System:
    states = drop().data.q.reshape(len(drop().data.q), -1, 2)
    return eliminate(
        sagging(lambda beam: parts.reduced_body(beam, parts.shape_functions(beam, states, 1e-12)))
    )


@pytest.mark.parametrize(
    "make",
    [sagging, lambda: eliminate(sagging()), by_modes, by_part],
    ids=["full", "eliminated", "modes", "part"],
)
def test_a_cantilever_under_its_weight_stays(make: Callable[[], System]) -> None:
    """Over a second, where statics bends it; the clamp carries 1 kg and 4 N from the first instant."""
    system = make()
    motion, path = integrate(system, FROM_REST, 1.0, TIGHT), solve_statics(system, 10, TIGHT)
    found, bent, energy = (
        outputs(motion),
        outputs(solve_statics(sagging(), 10, TIGHT))["tip_y"][-1],
        energies(motion),
    )
    assert bent < -0.5
    assert_allclose(found["tip_y"], bent, rtol=0, atol=5e-6)
    assert_allclose(motion.x - path.x[-1], 0.0, rtol=0, atol=1e-11)
    assert_allclose(motion.v, 0.0, rtol=0, atol=1e-9)
    assert_allclose(
        found["clamp_y"][np.isfinite(found["clamp_y"])],
        G + 4.0,
        rtol=0,
        atol=1e-5 if system.components else 1e-8,
    )
    assert np.ptp(energy[:, 3]) < 1e-12
    assert energy[:, 0].max() < 1e-20


def hung(speed: float = 0.0) -> System:
    """2 kg on a spring of 500 N/m that has no force in the reference, and another one that keeps it
    from moving aside.
    """
    at = At("mass", "center")
    spring = SpringDamper("spring", at, (0.0, 1.0), stiffness=500.0)
    return assemble(
        [body.point_mass("mass", 2.0, (0.0, 0.0))],
        [joints.Slider("guide", at, (0.0, 1.0))],
        [spring, loads.Gravity((0.0, -G))],
        outputs={"place": probes.Position(at, "y"), "guide": probes.Reaction("guide")},
        initial={"mass": Motion(velocity=(0.0, speed))},
    )


@pytest.mark.parametrize("speed", [0.0, 1.5])
def test_a_mass_on_a_spring(speed: float) -> None:
    """y = - m g / k + v / w sin w t, w^2 = k / m."""
    motion = integrate(
        eliminate(hung(speed)), GeneralizedAlpha(1e-4, start="equilibrium"), 1.0, TIGHT
    )
    w, t = np.sqrt(500.0 / 2.0), motion.times
    assert_allclose(
        outputs(motion)["place"],
        -2.0 * G / 500.0 + speed / w * np.sin(w * t),
        rtol=0,
        atol=1e-11 + 1e-5 * speed,
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_turns_and_initial_velocities_at_the_equilibrium(dim: int) -> None:
    """A disc on a torsion spring that a moment turns by 5 rad: theta = 5 + 2 sin t, the velocity
    that of the turned disc.
    """
    at, axis = At("disc", "frame"), {} if dim == 2 else {"axis": Z}
    inertia: Any = 0.01 if dim == 2 else (0.008, 0.009, 0.01)
    system = assemble(
        [rigid("disc", 1.0, inertia, (0.0,) * dim, dim=dim)],
        [joints.Revolute("pin", at, **axis)],
        [
            loads.TorsionSpring("spring", at, None, 0.01, **axis),
            loads.Moment("push", at, 0.05 if dim == 2 else (0.0, 0.0, 0.05)),
        ],
        outputs={"rate": probes.AngularVelocity(at, **axis), "slope": probes.Slope(at)},
        initial={"disc": Motion(angular_velocity=2.0 if dim == 2 else (0.0, 0.0, 2.0))},
    )
    for form in (system, eliminate(system)):
        motion = integrate(form, FROM_REST, 6.0, TIGHT)
        found, t = outputs(motion), motion.times
        assert_allclose(found["rate"], 2.0 * np.cos(t), rtol=0, atol=1e-5)
        assert_allclose(np.ptp(energies(motion)[:, 3]), 0.0, rtol=0, atol=1e-6)


def arm() -> System:
    """A rod of 3 kg and 0.8 m that a motor with a stiffness of 20 N m/rad holds against its weight;
    outputs `angle`, `hold`.
    """
    at = At("rod", "pin")
    rod = rigid(
        "rod", 3.0, np.array(3.0 * 0.8**2 / 12), (0.4, 0.0), dim=2, places={"pin": (0.0, 0.0)}
    )
    hold = ControlTorque("hold", at, torque=of_state("-20.0 * angle - 2.0 * rate", "N m", {}))
    measured = {"angle": probes.Angle(at), "hold": LoadState("hold"), "pin": probes.Reaction("pin")}
    return assemble(
        [rod], [joints.Pin("pin", at)], [hold, loads.Gravity((0.0, -G))], outputs=measured
    )


def test_the_torque_of_a_motor_is_that_of_statics_from_the_first_step() -> None:
    """k theta = - m g l / 2 cos theta, and the pin carries the weight."""
    weight = 3.0 * G
    theta = brentq(lambda a: 20.0 * a + 0.4 * weight * np.cos(a), -1.5, 0.0, xtol=1e-15)
    found = outputs(integrate(eliminate(arm()), FROM_REST, 0.5, TIGHT))
    assert_allclose(found["angle"], theta, rtol=0, atol=1e-11)
    assert_allclose(found["hold_torque"], 0.4 * weight * np.cos(theta), rtol=0, atol=1e-9)
    assert_allclose(found["pin_y"], weight, rtol=0, atol=1e-5)
    drop = outputs(integrate(eliminate(arm()), GeneralizedAlpha(1e-3), 0.5, TIGHT))
    assert np.ptp(drop["hold_torque"]) > weight * 0.4


def test_drives_and_histories_have_their_values_at_the_start() -> None:
    """A driven end begins 0.1 m from where it is drawn, at 0.3 m/s; 2 N pull at the other one: EA
    (s^2 - 1) s / 2 = 2 N.
    """
    left, right = At("beam", "left"), At("beam", "right")
    beam = body.cable("beam", models.segment(4), sections.Given(EA=100.0, EI=1.0, rhoA=0.01), dim=2)
    pull = joints.DrivenPosition("pull", left, (lambda t: 0.1 + 0.3 * t, lambda t: 0.0 * t))
    push = loads.PointForce("push", right, (1.0, 0.0), history=lambda t: 2.0 * np.cos(t))
    system = assemble(
        [beam],
        [pull],
        [push],
        outputs={"left": probes.Position(left, "x"), "right": probes.Position(right, "x")},
    )
    with pytest.warns(Notice, match="initial velocities are projected"):
        motion = integrate(eliminate(system), GeneralizedAlpha(1e-5, start="equilibrium"), 1e-4)
    found = outputs(motion)
    assert_allclose(found["left"], 0.1 + 0.3 * motion.times, rtol=0, atol=1e-12)
    stretch = brentq(lambda s: 50.0 * (s * s - 1.0) * s - 2.0, 1.0, 1.1, xtol=1e-15)
    assert found["right"][0] == pytest.approx(0.1 + stretch, abs=1e-9)


def test_runs_side_by_side_and_step_by_step_start_there() -> None:
    system = eliminate(arm())
    alone = integrate(system, FROM_REST, 0.01)
    (beside,) = integrate_many([system], FROM_REST, 0.01)
    assert np.array_equal(beside.x, alone.x)  # type: ignore[union-attr]
    live = start(system, FROM_REST)
    assert live.outputs()["angle"] == outputs(alone)["angle"][0]


def test_a_run_that_was_stopped_goes_on_in_the_same_digits() -> None:
    system = eliminate(hung(1.5))
    whole = integrate(system, FROM_REST, 0.4)
    assert_same(
        integrate(system, FROM_REST, 0.4, resume=stopped(system, 100, FROM_REST, 400)), whole
    )


def standing(stiffness: float) -> System:
    """A rod of 1 kg and 1 m that stands on a pin with a torsion spring, m g / 2 = 4.905 N m/rad."""
    at = At("rod", "pin")
    rod = rigid("rod", 1.0, np.array(1 / 12), (0.0, 0.5), dim=2, places={"pin": (0.0, 0.0)})
    spring = loads.TorsionSpring("spring", at, None, stiffness)
    return eliminate(assemble([rod], [joints.Pin("pin", at)], [spring, loads.Gravity((0.0, -G))]))


def test_an_unstable_equilibrium() -> None:
    """I theta'' = (m g / 2 - k) theta, I = 1/3."""
    with pytest.warns(
        Notice,
        match=f"the equilibrium is unstable, a small push grows by {np.sqrt(3 * 1.905):.3g} 1/s",
    ):
        integrate(standing(3.0), FROM_REST, 0.01)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        integrate(standing(6.0), FROM_REST, 0.01)


@pytest.mark.parametrize("form", [lambda system: system, eliminate], ids=["full", "eliminated"])
@pytest.mark.parametrize("down", [0.0, -G], ids=["idle", "pushed"])
def test_a_body_that_is_free_to_move(form: Callable[[System], System], down: float) -> None:
    rod = rigid("rod", 1.0, np.array(0.1), (0.5, 0.0), dim=2, places={"pin": (0.0, 0.0)})
    hinged = assemble([rod], [joints.Pin("pin", At("rod", "pin"))], [loads.Gravity((0.0, down))])
    with pytest.raises(
        InputError,
        match=r"rod turns about \(0, 0\).*; hold them by joints, or start from the reference",
    ):
        integrate(form(hinged), FROM_REST, 0.1)


def test_no_equilibrium() -> None:
    """A beam that 1 GN pushes together; no equilibria over the load factor stand for a motion."""
    ends = At("beam", "left"), At("beam", "right")
    beam = body.cable("beam", models.segment(4), sections.Given(EA=100.0, EI=1.0, rhoA=0.01), dim=2)
    pull = loads.PointForce("push", ends[1], (-1e9, 1.0))
    with pytest.raises(
        SolverError,
        match=r"no equilibrium with the loads at t = 0 was found.*or use `start: reference`",
    ) as caught:
        integrate(assemble([beam], [joints.Clamp("clamp", ends[0])], [pull]), FROM_REST, 0.1)
    assert caught.value.partial is None
    assert caught.value.reason is Reason.NO_EQUILIBRIUM
    assert explain(caught.value).causes[0].name == "equilibrium"


def test_what_is_no_start() -> None:
    with pytest.raises(
        InputError, match=r"analysis\.start: expected reference or equilibrium, got rest"
    ):
        GeneralizedAlpha(1e-3, start="rest")  # type: ignore[arg-type]


def test_the_way_to_the_equilibrium_shows_progress() -> None:
    """No part of the motion is done on it, but who watches hears of every load step."""
    heard: list[float] = []
    integrate(eliminate(sagging()), FROM_REST, 2e-3, progress=heard.append)
    assert heard.count(0.0) >= 10
    assert heard[-1] == 1.0
