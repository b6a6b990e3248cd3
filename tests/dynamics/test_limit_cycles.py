"""Limit cycles are named, with period and amplitude; motions that decay, swing without loss, are
driven or are not periodic are not.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.dynamics.diagnoses import limit_cycles
from fmbs_skfem.dynamics.diagnoses.limit_cycles import LimitCycle

# a mass that a force expression moves floats, as a warning says
pytestmark = pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")

OSCILLATOR = """
schema: 1
dimension: 2
bodies: {{ball: {{type: point_mass, mass: 1 kg, position: [{x0} m, 0]}}}}
loads: {{f: {{type: control_force, at: ball, direction: [1, 1e-12], force: "{force}"}}}}
outputs: {{x: {{type: position, at: ball, component: x}}, all: {{type: position, at: ball}}, v: {{type: velocity, at: ball, component: x}}}}
analysis: {{type: dynamic, duration: {end} s, step: {step} ms}}
"""
VAN_DER_POL = "-1 N/m * x + 1 N s/m * (1 - (x / 1 m)**2) * x.rate"
SPRING = "-1 N/m * x"


def ends_in(
    force: str, x0: float = 0.1, end: float = 80.0, step: float = 10.0
) -> LimitCycle | None:
    run = studies.run(scenes.loads(OSCILLATOR.format(force=force, x0=x0, end=end, step=step)))
    assert run.motion is not None
    found = limit_cycles.find(run.motion, run.outputs)
    assert ("limit cycle" in str(run)) == (found is not None)
    return found


@pytest.mark.parametrize("x0", [0.1, 4.0])
def test_the_oscillator_of_van_der_pol(x0: float) -> None:
    """mu = 1: T = 6.66328686, amplitude 2.00861986, from inside and from outside. C. M. Andersen, J.
    F. Geer, SIAM J. Appl. Math. 42 (1982) 678-693, doi:10.1137/0142047.
    """
    found = ends_in(VAN_DER_POL, x0)
    assert found is not None
    assert (found.column, found.unit) == ("x", "m")
    assert found.period == pytest.approx(6.66328686, rel=5e-5)
    assert found.amplitude == pytest.approx(2.00861986, rel=1e-4)
    assert 3.0 < found.since < 25.0


def test_the_summary_says_so() -> None:
    run = studies.run(scenes.loads(OSCILLATOR.format(force=VAN_DER_POL, x0=0.1, end=80, step=10)))
    assert "x repeats every 6.663 s with an amplitude of 2.009 m; a limit cycle since t = " in str(
        run
    )
    assert run.report["limit_cycle"]["column"] == "x"


def test_stick_slip_of_a_mass_on_a_belt() -> None:
    """Friction that falls with the speed of slip, F = 2 N (1 + 1 / (1 + 20 |v|)), on a belt of 0.1
    m/s: it sticks until the spring pulls 4 N, so that the largest force is that.
    """
    friction = "2 N * (1 + 1 / (1 + 20 * abs(x.rate / (1 m/s) - 0.1))) * tanh((0.1 m/s - x.rate) / (1 mm/s))"
    force = f"-10 N/m * x + {friction}"
    run = studies.run(scenes.loads(OSCILLATOR.format(force=force, x0=0.0, end=60, step=2)))
    found = run.report["limit_cycle"]
    x = run.outputs["x"][run.times > 30.0]
    assert x.max() == pytest.approx(0.4, rel=1e-2)
    assert found["amplitude"] == pytest.approx(0.5 * np.ptp(x), rel=1e-4)


def test_stick_slip_on_a_belt_that_a_drive_moves() -> None:
    """The same by the speed of the mass against that of a body that goes on evenly, which an output
    shows, too.
    """
    text = OSCILLATOR.format(force="-10 N/m * x + {}", x0=0.0, end=60, step=2)
    slip = "(belt.rate - x.rate) / (1 m/s)"
    text = text.replace("{}", f"2 N * (1 + 1 / (1 + 20 * abs({slip}))) * tanh({slip} * 1000)")
    second = "b: {type: point_mass, mass: 1 kg, position: [0 m, 1 m]}"
    drive = 'joints: {go: {type: driven_position, at: b, displacement: ["0.1 m/s * t", "0 m"]}}'
    text = text.replace("position: [0.0 m, 0]}}", f"position: [0.0 m, 0]}}, {second}}}\n{drive}")
    text = text.replace("outputs: {", "outputs: {belt: {type: position, at: b, component: x}, ")
    found = studies.run(scenes.loads(text))
    cycle = found.report["limit_cycle"]
    assert (cycle["column"], cycle["unit"]) == ("x", "m")
    assert found.outputs["x"].max() == pytest.approx(0.4, rel=1e-2)


SILENT = {
    "too short": (VAN_DER_POL, 0.1, 35.0),
    "driven": (f"{VAN_DER_POL} + 2 N * cos(t)", 0.1, 80.0),
    "driven and damped": (f"{SPRING} - 0.3 N s/m * x.rate + 2 N * cos(t)", 0.1, 80.0),
    "a spring": (SPRING, 1.0, 80.0),
    "a hard spring": (f"{SPRING} - 3 N/m**3 * x**3", 1.0, 80.0),
    "decay": (f"{SPRING} - 0.05 N s/m * x.rate", 1.0, 80.0),
    "slow decay": (f"{SPRING} - 1e-3 N s/m * x.rate", 1.0, 4000.0, 50.0),
    "decay by drag": (f"{SPRING} - 0.05 N s**2/m**2 * x.rate * abs(x.rate)", 1.0, 600.0),
    "dry friction": (f"{SPRING} - 0.01 N * tanh(x.rate / (1 mm/s))", 1.0, 60.0),
    "a spring after a push": (f"{SPRING} + 1 N * where(t < 5, sin(t), 0)", 0.0, 80.0),
    "at rest": (f"{SPRING} - 3 N s/m * x.rate", 1.0, 80.0),
}


@pytest.mark.parametrize("name", SILENT)
def test_of_other_motions_nothing_is_said(name: str) -> None:
    assert ends_in(*SILENT[name]) is None


PENDULUM = """
schema: 1
dimension: 2
bodies:
  one: {{type: rigid, mass: 1, inertia: 0.01, center: [1, 0], points: {{A: [0, 0]}}}}
  two: {{type: rigid, mass: 1, inertia: 0.01, center: [2, 0], points: {{A: [1, 0]}}}}
joints: {{h: {{type: revolute, at: one.A}}, g: {{type: {joint}, at: two.A, to: one.center}}}}
loads:
  weight: {{type: gravity, acceleration: [0, -9.81]}}
  drag: {{type: torsion_spring, at: one.A, stiffness: 0, damping: {damping}}}
outputs: {{a: {{type: angle, at: one.A}}, tip: {{type: position, at: two.center}}}}
analysis: {{type: dynamic, duration: 60 s, step: 5 ms}}
"""


@pytest.mark.parametrize(
    ("joint", "damping"), [("weld", 0.0), ("weld", 0.3), ("revolute", 0.0), ("revolute", 0.3)]
)
def test_of_pendulums_nothing_is_said(joint: str, damping: float) -> None:
    """Undamped (periodic, and of every amplitude), damped, chaotic."""
    run = studies.run(scenes.loads(PENDULUM.format(joint=joint, damping=damping)))
    assert "limit_cycle" not in run.report


def test_two_cycles_that_do_not_fit_are_none() -> None:
    """Quasi-periodic: frequencies 1 and sqrt(2)."""
    text = OSCILLATOR.format(force=VAN_DER_POL, x0=0.1, end=80, step=10)
    second = "b: {type: point_mass, mass: 0.5 kg, position: [0.1 m, 0]}"
    push = f'{{type: control_force, at: b, direction: [1, 0], force: "{VAN_DER_POL.replace("x", "y")}"}}'
    read = "y: {type: position, at: b, component: x}"
    text = text.replace("position: [0.1 m, 0]}}", f"position: [0.1 m, 0]}}, {second}}}")
    text = text.replace("}}\noutputs: {", f"}}, g: {push}}}\noutputs: {{{read}, ")
    run = studies.run(scenes.loads(text))
    assert np.ptp(run.outputs["y"][-1000:]) > 3.5
    assert "limit_cycle" not in run.report
