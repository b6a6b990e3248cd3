"""Motions with inputs that are moved by 1e-15 of themselves: no solve hangs on the last digit, and
results move by as little.

What other processors or libraries change is of that size, so that this shows on one machine what
would fail on another one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.exports import part_ports
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, assemble, eliminate, joints, signals
from fmbs_skfem.systems.measures import probes
from tests.exports.test_part_ports import PUSHED, SHARP, bent
from tests.systems.test_contact_facets import TIGHT, falling

MOVED = 1e-15  #: of an input, 5 times the round-off of a number
#: EA, GA, GA [N], GJ, EI, EI [N m2] of a bar of 5 mm, E = 1 GPa
THIN = (
    2e4,
    7.5e3,
    7.5e3,
    0.024,
    0.03,
    0.03,
)


def shaft(moved: float, cells: int, steps: int) -> Trajectory:
    """An elbow of two thin beams of 0.6 and 0.3 m whose first one turns about its axis by more than
    a third of a turn in 1 s.
    """
    section = BeamSection((1.0 + moved) * np.diag(THIN), np.diag([0.035, 5e-8, 5e-8]))
    bodies = []
    for name, start, end in (
        ("a", (0.0, 0.0, 0.0), (0.6, 0.0, 0.0)),
        ("b", (0.6, 0.0, 0.0), (0.6, 0.3, 0.0)),
    ):
        length = float(np.linalg.norm(np.subtract(end, start)))
        curve = curves.Straight(np.array(start), np.array(end), length)
        line = curves.Line(
            np.linspace(0.0, length, cells + 1), curve, {"left": 0.0, "right": length}, None
        )
        bodies.append(beam(name, line, section, direction=np.array([0.0, 0.0, 1.0])))
    root, elbow, axis = At("a", "left"), At("a", "right"), (1.0, 0.0, 0.0)
    held = [
        joints.Weld("weld", At("b", "left"), elbow),
        joints.Revolute("root", root, axis=axis),
        joints.DrivenAngle(
            "drive", root, lambda t: 2.4 * (t - np.sin(2.0 * np.pi * t) / (2.0 * np.pi)), axis=axis
        ),
        joints.Slider("bearing", elbow, axis),
    ]
    system = eliminate(assemble(bodies, held, outputs={"tip": probes.Position(At("b", "right"))}))
    return integrate(
        system, GeneralizedAlpha(1.0 / steps, 0.9), 1.0, Newton(1e-8), every=steps // 50
    )


def tip(motion: Trajectory) -> np.ndarray:
    """Positions (s, 3) of the tip [m]."""
    found = outputs(motion)
    return np.stack([found[f"tip_{c}"] for c in "xyz"], axis=1)


def test_coarse_steps_of_a_thin_shaft_converge_on_every_processor() -> None:
    """Factors of the step before made corrections of 75 m of guesses that were wrong by 6 um: one
    of three such runs failed.

    Others of them had 5 to 70 corrections a step, by the last digit.
    """
    first, *others = (shaft(k * MOVED, 6, 200) for k in (0, 1, -2))

    for motion in (first, *others):
        assert motion.statistics.halved == 0
        assert motion.statistics.iterations < 4 * 200
    for motion in others:
        assert np.abs(tip(motion) - tip(first)).max() < 1e-6


def test_shorter_steps_bring_a_thin_shaft_to_the_same_places() -> None:
    """Errors fall with the square of the step."""
    coarse, fine, finest = (tip(shaft(0.0, 4, steps)) for steps in (200, 400, 800))
    assert np.abs(coarse - finest).max() < 0.02
    assert np.abs(coarse - fine).max() > 3.0 * np.abs(fine - finest).max()


def test_steps_are_not_divided_by_the_round_off_of_a_beam_with_torsion() -> None:
    """A tolerance of 1e-14: at 1e-15 steps were divided in vain, which changed the motion by 1e-5."""
    case = part_ports.case_of(bent(), GeneralizedAlpha(4e-4), 0.3)
    found = []
    for moved in (0.0, MOVED, -2.0 * MOVED):
        forces = {key: of_time((1.0 + moved) * value) for key, value in PUSHED.items()}
        motion = integrate(signals.with_inputs(case.system, forces), case.scheme, 0.08, SHARP, 10)
        assert motion.statistics.halved == 0
        found.append(outputs(motion)["right.position_y"])

    assert np.ptp(found[0]) > 0.02
    for one in found[1:]:
        assert np.abs(one - found[0]).max() < 1e-9 * np.ptp(found[0])


@pytest.mark.filterwarnings("ignore:.*projected")
def test_a_reduced_box_meets_a_plate_whatever_the_last_digit_of_its_training() -> None:
    """Five modes of a box that tumbles left its rigidity none or one to move in, by round-off:
    bases of it have all directions.
    """
    raw, scheme = (
        falling(2.0, (0.43, 0.56), stiffness=2e4, friction=0.2),
        GeneralizedAlpha(2e-4, 0.8),
    )
    full = integrate(eliminate(raw), scheme, 6e-3, TIGHT)
    data, level = galerkin.snapshots(full), component.body_level(raw)
    random, expected = np.random.default_rng(0), outputs(full)["foot_z"]
    for _ in range(2):
        moved = replace(data, q=data.q * (1.0 + MOVED * random.normal(size=data.q.shape)))
        bases = galerkin.bases(raw, moved, level, 1e-10)
        assert bases["box"].modes.shape == (12, 12)
        reduced = integrate(galerkin.reduce_system(raw, level, bases), scheme, 6e-3, TIGHT)
        assert reduced.statistics.halved == 0
        np.testing.assert_allclose(outputs(reduced)["foot_z"], expected, atol=1e-4)
