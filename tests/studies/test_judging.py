"""What is said of a motion's energy balance and of its round-off: in proportion, with a remedy that
helps, and nothing at rest.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.bodies import cable, point_mass, sections
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, energy_errors, integrate
from fmbs_skfem.studies import commands
from fmbs_skfem.studies.running import judging
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.springs import SpringDamper

from .. import models

AT = At("m")
MESHES = Path(__file__).resolve().parents[2] / "meshes"


def judged(motion: Trajectory, scheme: GeneralizedAlpha) -> list[str]:
    """What is said of a motion."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        judging.balances(scheme, motion)
    return [str(one.message) for one in caught]


def driven(history: str, step: float) -> list[str]:
    scheme = GeneralizedAlpha(step)
    drive = joints.DrivenPosition("d", AT, (of_time(history), of_time("0")))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        motion = integrate(assemble([point_mass("m", 1.0, np.zeros(2))], [drive]), scheme, 1.0)
    return judged(motion, scheme)


def test_a_drive_that_jumps_is_the_cause_and_no_step() -> None:
    """A mass that begins to move at once: half the step changes the impulse, and makes nothing
    right.
    """
    (told,) = driven("where(t < 0.503, 0, t - 0.503)", 0.01)
    assert told.endswith(
        "of the largest energy or work: a drive jumps within one step; let it change over many steps"
    )
    assert driven("where(t < 0.5, 0, (t - 0.5)**3)", 0.01) == []


def test_what_a_damper_takes_is_measured_by_the_work() -> None:
    """A load that pulls through a damper: 1 mJ moves, 80 J are done and taken, of which steps miss
    a little.
    """
    damper = SpringDamper("c", AT, (-10.0, 0.0), stiffness=0.0, damping=50.0)
    push = loads.PointForce("f", AT, (100.0, 0.0), of_time("sin(30 * t)"))
    scheme = GeneralizedAlpha(5e-3, 0.0)
    motion = integrate(
        assemble([point_mass("m", 1e-3, np.zeros(2))], [], [damper, push]), scheme, 1.0
    )
    found = energy_errors(motion)
    assert motion.work is not None
    assert found.fall <= found.drift / np.abs(motion.work).max()


@pytest.mark.parametrize("size, said", [(0.0, False), (1e-3, False), (0.1, True)])
def test_nothing_is_said_of_the_round_off_of_what_rests(size: float, said: bool) -> None:
    """A mass on a spring without and with pulls, which move it by 5e-12 and 5e-10 m."""
    hold = SpringDamper("s", AT, (1000.0, 1.0), stiffness=1e-2, length=1.0 + size)
    scheme = GeneralizedAlpha(1e-6, 1.0)
    motion = integrate(
        assemble([point_mass("m", 1.0, np.array([1000.0, 0.0]))], [], [hold]), scheme, 1e-3
    )
    assert any("round-off" in one for one in judged(motion, scheme)) == said


def test_nothing_is_said_of_a_beam_that_no_load_has_moved_yet() -> None:
    """Its strains have round-off of their own, which moves it by 1e-16 m."""
    beam = cable(
        "b", models.segment(10), sections.Circular(0.02), sections.Material(1e9, 1800.0), dim=2
    )
    pull = loads.PointForce("f", At("b", "right"), (0.0, 3.0), of_time("where(t < 0.1, 0, 1)"))
    scheme = GeneralizedAlpha(5e-4)
    motion = integrate(
        eliminate(assemble([beam], [joints.Clamp("c", At("b", "left"))], [pull])), scheme, 1.5e-3
    )
    assert motion.v.any()
    assert judged(motion, scheme) == []


RELAY = """
schema: 1
dimension: 2
bodies:
  arm:
    type: cable
    mesh: beam_20.msh
    section: {{shape: circular, diameter: 20 mm}}
    material: {{young_modulus: 3 GPa, density: 1800 kg/m^3}}
joints: {{axle: {{type: pin, at: arm.left}}}}
controllers:
  servo:
    type: pid
    unit: N m
    sample: 10 ms
    error: 0.5 rad - hinge.angle
    rate: -hinge.rate
    kp: 1e3 N m
    kd: 1e2 N m s
    limits: [-5 N m, 5 N m]
loads: {{drive: {{type: control_torque, at: arm.left, torque: servo}}}}
damping: {{stiffness: {damping}}}
analysis: {{type: dynamic, duration: 0.6 s, step: {step}}}
outputs: {{hinge: {{type: angle, at: arm.left}}}}
"""


@pytest.mark.parametrize(
    "damping, step, said", [("1 ms", "0.1 ms", ""), ("0 s", "1 ms", "controller 'servo' jumps ")]
)
def test_the_limit_cycle_of_a_relay_is_no_step_too_large(
    damping: str, step: str, said: str
) -> None:
    """A saturated controller puts in again and again what damping takes: 12 J pass through an arm
    that holds 0.8 J.

    At 0.1 ms the method takes 0.7 % of these, which is 9 % of what the arm holds. Without damping
    it takes most of what jumps excite.
    """
    scene = scenes.loads(RELAY.format(damping=damping, step=step), MESHES)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        found = commands.run(scene)
    told = [text for text in found.report["notices"] if "energy balance falls" in text]
    assert [said in text and "too large" not in text for text in told] == ([True] if said else [])
