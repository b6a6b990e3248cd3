"""Steps that are printed from their kernels against those that numba compiles: the same motion, by as
many corrections.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.bodies import point_mass
from fmbs_skfem.contact.contacts import ContactPlane
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import At, System, assemble
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.springs import Stop
from tests.dynamics import test_levels
from tests.exports import printed
from tests.exports.c_library import COMPILER, STRICT
from tests.exports.test_c_files import CASES, STEP

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK = "a rope", "a plate as a polynomial"
#: what goes from touch to touch, which is below and in models in C
TOUCHES = "a ball that bounces", "a box that slides", "a body that a rope catches"
#: full models with friction, contact of beams and shapes, gears, line joints
SCENES = "cable_over_drum", "geared_arm", "gripper", "heavy_top", "overhead_crane", "crossing_beams"


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
        for name in CASES
        if name not in TOUCHES
    ],
)
def test_a_printed_step_of_a_reduced_model_is_that_of_the_package(
    name: str, tmp_path: Path
) -> None:
    off, more = printed.compare(CASES[name](), STEP, 150, tmp_path, STRICT)
    assert off < 1e-11
    assert more == 0


@pytest.mark.slow  # compilers take 2 s each
@pytest.mark.parametrize("name", SCENES)
def test_a_printed_step_of_a_full_model_is_that_of_the_package(name: str, tmp_path: Path) -> None:
    system = build.system(scenes.read(EXAMPLES / f"{name}.yaml"))
    off, more = printed.compare(system, STEP, 100, tmp_path, STRICT)
    assert off < 1e-10
    assert abs(more) <= 2


BALL, BOB = At("ball"), At("bob")


def dropped() -> System:
    """A ball that falls onto a damped stop."""
    floor = Stop("f", BALL, (0.0, 0.0), 4e3, 8.0, 0.0, (0.0, 1.0))
    ball = point_mass("ball", 1.0, np.array([0.0, 0.3]))
    return assemble([ball], loads=[floor, loads.Gravity((0.0, -9.81))])


def pushed() -> System:
    """A ball that is pushed to and fro, and bounces on a plane with friction."""
    law = {"stiffness": 4e3, "damping": 8.0, "friction": 0.3}
    floor = ContactPlane("f", at=BALL, point=(0.0, 0.0), normal=(0.0, 1.0), **law)
    push = loads.PointForce("p", BALL, (1.0, 0.0), lambda t: np.sin(9.0 * t))
    ball = point_mass("ball", 1.0, np.array([0.0, 0.3]))
    return assemble([ball], loads=[floor, push, loads.Gravity((1.0, -9.81))])


def swinging() -> System:
    """Two masses on rods that swing onto stops, one of them pushed."""
    masses = [
        point_mass("ball", 1.0, np.array([1.0, 0.0])),
        point_mass("bob", 1.0, np.array([1.0, 0.5])),
    ]
    rods = [joints.RigidLink("r", BALL, (0.0, 0.0)), joints.RigidLink("s", BOB, BALL)]
    side = Stop("side", BALL, (0.2, 0.0), direction=(1.0, 0.0), stiffness=1e4)
    floor = Stop("floor", BOB, (0.0, -1.0), direction=(0.0, 1.0), stiffness=1e4)
    push = loads.PointForce("p", BOB, (0.0, 1.0), lambda t: np.sin(9.0 * t))
    return assemble(masses, rods, [loads.Gravity((0.0, -9.81)), side, floor, push])


SINE = "SIGNALS[k] = math_sin(9.0 * t)"
#: system, method, number of steps, and the history of its signal in C
TOUCHING: dict[str, tuple[Callable[[], System], GeneralizedAlpha, int, str]] = {
    "a ball on a stop": (dropped, GeneralizedAlpha(0.011), 40, ""),
    "friction": (pushed, GeneralizedAlpha(0.011), 60, SINE),
    "joints": (swinging, GeneralizedAlpha(0.018), 50, SINE),
    "steps by their error": (swinging, GeneralizedAlpha(0.018, local_error=1e-6), 50, SINE),
    "a beam": (test_levels.stopped, GeneralizedAlpha(0.001), 350, ""),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name == "a ball on a stop" else pytest.mark.slow)
        for name in TOUCHING
    ],
)
def test_printed_steps_go_from_touch_to_touch_as_those_of_the_package(
    name: str, tmp_path: Path
) -> None:
    make, method, steps, history = TOUCHING[name]
    off, more = printed.compare(make(), method, steps, tmp_path, STRICT, history)
    assert off < 1e-11
    assert more == 0
