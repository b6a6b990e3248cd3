"""Modes in rotating frames: roots of unstable states in pairs, what grows beyond those asked for,
free motions in equilibrium.

A bead on a hoop of radius R that turns at W about its vertical diameter: s = +-sqrt(W^2 - g / R) at
the bottom (Greenwood, Principles of Dynamics, 2nd ed., Prentice-Hall 1988, ch. 4).
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice

BEAD = """
  {name}:
    type: rigid
    mass: 1.0
    inertia: [1e-6, 1e-6, 1e-6]
    center: [0, 0, {depth}]
    points: {{o: [0, 0, 0]}}
"""
SCENE = """
schema: 1
dimension: 3
bodies:{bodies}
joints: {{{joints}}}
loads: {{g: {{type: gravity, acceleration: [0, 0, {gravity}]}}}}
analysis: {{type: modes, spin: {{rate: {rate}}}, count: {count}}}
"""
JOINT = "j_{name}: {{type: revolute, at: {name}.o, axis: [0, 1, 0]}}"


def hoops(
    depths: dict[str, float], rate: float, count: int, gravity: float = -9.81
) -> scenes.Scene:
    bodies = "".join(BEAD.format(name=name, depth=-depth) for name, depth in depths.items())
    joints = ", ".join(JOINT.format(name=name) for name in depths)
    return scenes.loads(
        SCENE.format(bodies=bodies, joints=joints, rate=rate, count=count, gravity=gravity)
    )


def roots(radius: float, rate: float) -> float:
    return float(np.sqrt(rate**2 - 9.81 / radius))


@pytest.mark.parametrize("count", [1, 2])
def test_the_roots_of_a_bead_beyond_its_limit_come_in_a_pair(count: int) -> None:
    scene = hoops({"bead": 0.5}, 7.0, count)
    found = scene.analysis.find(scene)
    assert "the equilibrium is unstable (divergence): mode 2 by 5.42 1/s" in found.doubts
    s = roots(0.5, 7.0)
    np.testing.assert_allclose(found.facts["growth_per_s"], [-s, s], rtol=1e-4)


def test_a_motion_that_grows_beyond_those_asked_for_is_named() -> None:
    """The slower bead swings; that on the larger hoop leaves it at more than the frequency of the
    first.
    """
    scene = hoops({"near": 0.19, "far": 3.0}, 7.0, 1)
    found = scene.analysis.find(scene)
    text = r"[12] of the motions that are not listed grow \(divergence\), most by 6\.76 1/s"
    assert re.search(text, found.doubts[0])
    assert found.facts["growth_per_s"] == pytest.approx([0.0], abs=1e-9)
    assert roots(3.0, 7.0) == pytest.approx(6.76, abs=5e-3)


def test_free_motions_in_equilibrium_are_no_error() -> None:
    """A rotor that turns freely about the axis of its frame: its turning is a mode of frequency 0;
    one that falls is refused.
    """
    text = """
schema: 1
dimension: 3
bodies: {disc: {type: rigid, mass: 2.0, inertia: [0.1, 0.1, 0.2], center: [0, 0, 0]}}
joints: {axle: {type: revolute, at: disc, axis: AXIS}}
loads: {g: {type: gravity, acceleration: [0, 0, -9.81]}}
analysis: {type: modes, spin: {rate: 3.0}, count: 1}
"""
    scene = scenes.loads(text.replace("AXIS", "[0, 0, 1]"))
    with pytest.warns(Notice, match="free motions without stiffness: disc turns about the axis"):
        found = scene.analysis.find(scene)
    assert found.facts["frequencies_hz"] == pytest.approx([0.0])
    falling = scenes.loads(text.replace("{axle: {type: revolute, at: disc, axis: AXIS}}", "{}"))
    with pytest.raises(InputError, match="free motions: disc moves along"):
        falling.analysis.find(falling)


def test_what_the_spin_holds_where_it_is_drawn_is_not_free() -> None:
    """A bead where cos(theta) = g / (rate^2 R), which weight alone would push: it vibrates by rate
    sin(theta).
    """
    cosine = 9.81 / (49.0 * 0.5)
    sine = np.sqrt(1.0 - cosine**2)
    center = f"[{0.5 * sine}, 0, {-0.5 * cosine}]"
    body = f"{{type: rigid, mass: 1, inertia: [1e-6, 1e-6, 1e-6], center: {center}, points: {{o: [0, 0, 0]}}}}"
    joint = "{type: revolute, at: arm.o, axis: [0, 1, 0]}"
    scene = scenes.loads(
        SCENE.format(
            bodies=f"\n  arm: {body}", joints=f"arm: {joint}", rate=7.0, count=1, gravity=-9.81
        )
    )
    found = scene.analysis.find(scene)
    assert found.columns["omega_rad_per_s"] == pytest.approx([7.0 * sine], rel=1e-5)
    still = scenes.loads(
        SCENE.format(
            bodies=f"\n  arm: {body}", joints=f"arm: {joint}", rate=0.0, count=1, gravity=-9.81
        )
    )
    with pytest.raises(
        InputError, match=r"free motions: arm turns about .*draw what weight holds as it hangs"
    ):
        still.analysis.find(still)
