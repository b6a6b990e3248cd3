"""A motion that changes between two models of one mechanism keeps its order, its joints and what it has gained and lost."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.dynamics.handover import Leg
from fmbs_skfem.dynamics.outputs import body_coordinates
from fmbs_skfem.scenes import build, read
from fmbs_skfem.systems import Rayleigh, System, eliminate
from fmbs_skfem.systems.system import sizes

from .. import models
from ..cli.calls import EXAMPLES

SHARP = Newton(tolerance=1e-12)


def swing(**options: bool) -> System:
    return models.double_pendulum(5, damping=Rayleigh(stiffness=1e-4), **options)


def spin(**options: bool) -> System:
    return models.spin_up(5, damping=Rayleigh(stiffness=1e-4), **options)


def changed(make: Callable[..., System], h: float, steps: int, every: int, consistent: bool) -> np.ndarray:
    """q at the end of a motion that goes to and fro, every so many steps, between the forms without and with all multipliers."""
    raw = make(all_multipliers=True)
    legs = [Leg(system, GeneralizedAlpha(h), SHARP, steps, every) for system in (eliminate(raw), raw)]
    here = legs[0].now
    for k in range(steps // every):
        if k:
            legs[k % 2].put(here, consistent)
        legs[k % 2].take(every)
        here = legs[k % 2].now
    assert here.done == steps
    return here.q


@pytest.mark.parametrize("consistent", [False, True])
@pytest.mark.parametrize("make", [swing, spin])
def test_changes_of_the_model_keep_the_second_order(make: Callable[..., System], consistent: bool) -> None:
    """Both forms have one motion: what changes cost is far below the error of the step, and falls with its square."""
    raw, duration, found = make(all_multipliers=True), 0.4, []
    for h in (1e-3, 5e-4):
        steps = round(duration / h)
        never = body_coordinates(integrate(eliminate(raw), GeneralizedAlpha(h), duration, SHARP, every=steps))[-1]
        found.append((changed(make, h, steps, steps // 8, consistent), never))
    exact = body_coordinates(integrate(eliminate(raw), GeneralizedAlpha(1e-3 / 16), duration, SHARP, every=6400))[-1]
    apart = [float(sizes(raw, (q - p)[None])[0]) for q, p in found]
    of_step = [float(sizes(raw, (p - exact)[None])[0]) for _, p in found]
    assert apart[1] < 0.2 * of_step[1]
    assert apart[0] > 3.0 * apart[1]


def test_states_of_another_model_are_put_onto_the_joints() -> None:
    """q off the joints, as a basis leaves it: positions and velocities hold at once, and the nearest in the mass is taken."""
    raw = swing(all_multipliers=True)
    leg = Leg(raw, GeneralizedAlpha(5e-4), SHARP, 100, 20)
    leg.take(20)
    here, rng = leg.now, np.random.default_rng(1)
    leg.put(here._replace(q=here.q + 1e-5 * rng.normal(size=len(here.q))), consistent=True)
    moved = leg.now
    A, free = raw.constraints, leg.take(5)
    assert len(A.names) == 6
    at_joints = raw.probes.matrix @ moved.q + raw.probes.offset
    pin = [float(np.abs(at_joints[i] - at_joints[j])) for i, j in zip(A.i, A.j, strict=True) if j >= 0]
    assert max(pin, default=0.0) < 1e-9
    assert float(sizes(raw, (moved.q - here.q)[None])[0]) < 1e-4
    assert np.isfinite(free.x).all()


def test_work_and_memory_go_along() -> None:
    """The energy balance of the second leg begins where that of the first has ended."""
    raw = spin(all_multipliers=True)
    one, other = (Leg(system, GeneralizedAlpha(1e-3), SHARP, 400, 200) for system in (eliminate(raw), raw))
    first = one.take(200)
    other.put(one.now)
    second = other.take(200)
    assert first.work is not None
    assert second.work is not None
    assert second.work[0] == first.work[-1] != 0.0
    whole = integrate(eliminate(raw), GeneralizedAlpha(1e-3), 0.4, SHARP)
    assert second.work[-1] == pytest.approx(whole.work[-1], rel=1e-4)
    assert (one.cost.steps, other.cost.steps) == (200, 200)


@pytest.mark.parametrize("name", ["sampled_arm", "trapeze"])
def test_controllers_and_events_are_refused(name: str) -> None:
    """What looks at every step belongs to one model."""
    scene = read(EXAMPLES / f"{name}.yaml")
    system, scheme = eliminate(build.system(scene)), build.dynamic(scene).scheme
    with pytest.raises(InputError, match="expected a scene without events and controllers"):
        Leg(system, scheme, SHARP, 10, 5)
