"""A motion whose energy balance rises tenfold is an error with its sound part; work of loads and
drives is no error.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.errors import Reason
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, explain, integrate, unstable
from fmbs_skfem.dynamics.diagnoses.stability import last_sound, rises
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

STEP = 1e-2


def wheel(*extra: object, speed: float = 3.0, every: int = 1) -> Trajectory:
    """A wheel of 0.2 kg m2 on a pin beside its centre, under gravity and what else there is, over 2
    s.
    """
    part = rigid("wheel", 1.0, 0.1, (0.3, 0.0), dim=2, places={"hub": (0.0, 0.0)})
    held = [
        joints.Revolute("hub", At("wheel", "hub")),
        *(one for one in extra if isinstance(one, joints.DrivenAngle)),
    ]
    pushes = [
        loads.Gravity((0.0, -9.81)),
        *(one for one in extra if not isinstance(one, joints.DrivenAngle)),
    ]
    initial = {"wheel": Motion(angular_velocity=speed)} if speed else {}
    system: System = eliminate(assemble([part], held, pushes, initial=initial))  # type: ignore[arg-type]
    return integrate(system, GeneralizedAlpha(STEP), 2.0, every=every)


def grown(motion: Trajectory, factor: float) -> Trajectory:
    """The same motion with velocities that grow from its middle on, by `factor` at the end."""
    late = np.clip((motion.times - 1.0) / 1.0, 0.0, 1.0)
    return replace(motion, v=motion.v * (1.0 + (factor - 1.0) * late)[:, None])


@pytest.mark.parametrize("every", [1, 10])
def test_a_tenfold_rise_is_an_error_with_the_sound_part(every: int) -> None:
    """Velocities that grow by ten have a hundred times the energy; the part up to 1.1 s, where it
    begins, is kept.
    """
    motion = wheel(every=every)
    assert unstable(motion, STEP) is None
    error = unstable(grown(motion, 10.0), STEP)
    assert error is not None
    assert error.exit_code == 4
    assert error.reason is Reason.UNSTABLE
    part = error.partial
    assert 0.8 <= part.times[-1] <= 1.1
    np.testing.assert_array_equal(part.x, motion.x[: len(part.times)])
    found = explain(error)
    assert found.good == part.times[-1]
    assert [cause.name for cause in found.causes] == ["unstable"]
    assert unstable(grown(motion, 1.5), STEP) is None
    assert last_sound(grown(motion, 1.5)) < len(motion.times) - 1


@pytest.mark.parametrize("every", [1, 100])
@pytest.mark.parametrize(
    "work",
    [
        loads.Moment("motor", At("wheel", "frame"), 5.0),
        loads.Moment(
            "hammer",
            At("wheel", "frame"),
            500.0,
            lambda t: np.where(np.abs(t - 0.505) < 0.012, 1.0, 0.0),
        ),
        joints.DrivenAngle("drive", At("wheel", "frame"), lambda t: 4.0 * t**3),
    ],
    ids=["torque", "blow", "drive"],
)
def test_work_of_loads_and_drives_is_no_rise(work: object, every: int) -> None:
    """A torque, a blow between two stored states and a drive, from rest, with up to a hundred times
    the energy of the swing.
    """
    motion = wheel(work, speed=0.0, every=every)
    assert 0.5 * np.einsum("sn,sn->s", motion.v, (motion.system.mass @ motion.v.T).T).max() > 100.0
    assert unstable(motion, STEP) is None
    assert rises(motion).max() < 0.2


def test_the_turn_that_is_advised_is_that_of_a_good_state() -> None:
    """A failed run reads its turns before the energy rose, so that the step advised is not that of
    the explosion.
    """
    motion = wheel()
    error = unstable(grown(motion, 100.0), STEP)
    assert error is not None
    turn = explain(error).turns["wheel"]
    speeds = np.abs(motion.x[:, -4:-2][:, 0] * motion.v[:, -3] - motion.x[:, -3] * motion.v[:, -4])
    assert turn <= STEP * speeds.max() * 1.2


def test_states_within_steps_are_not_judged() -> None:
    """Between steps, energies of stiff bodies are those of a polynomial, not of the motion."""
    motion = wheel()
    v = motion.v.copy()
    v[50] *= 10.0
    times = motion.times.copy()
    assert unstable(replace(motion, v=v), STEP) is not None
    times[50] += 0.3 * STEP
    assert unstable(replace(motion, v=v, times=times), STEP) is None
