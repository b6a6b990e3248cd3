"""Starts of motions in compiled code against those of `initial`, and the same printed as C."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.compiling.structs import address_of, packed
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, initial
from fmbs_skfem.dynamics.compiled_step import starting
from fmbs_skfem.dynamics.compiled_step.step import State, Step
from fmbs_skfem.dynamics.histories import leading_signals
from fmbs_skfem.dynamics.scheme import method_of
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, Motion, Rayleigh, System, assemble, compile_system
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads, springs
from fmbs_skfem.systems.forces.along_lines import SlidingFriction
from tests import models
from tests.systems.test_corotation import complete
from tests.systems.test_sliding import incline

STEP = GeneralizedAlpha(1e-3)
ROOT, TIP = At("beam", "left"), At("beam", "right")
DOWN, DOWN_IN_SPACE = loads.Gravity((0.0, -9.81)), loads.Gravity((0.0, 0.0, -9.81))
SPIN = Motion(angular_velocity=(0.0, 0.0, 3.0))
pytestmark = pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")


def cable(dim: int = 2, cells: int = 2) -> body.Body:
    return body.cable("beam", segment(cells), models.SECTION, models.MATERIAL, dim=dim)


def arm(*push: loads.Load, **more: Any) -> System:
    """A beam on a hinge under loads."""
    return complete(assemble([cable()], [joints.Pin("hinge", ROOT)], [DOWN, *push], **more))


def turning(damping: Rayleigh | None = None) -> System:
    """A beam in space that turns on a revolute joint, with a rigid rod hung to it that turns in
    another plane.
    """
    rod = rigid("rod", 0.3, (0.01, 0.02, 0.02), (1.2, 0.0, 0.0), places={"end": (1.0, 0.0, 0.0)})
    held = [
        joints.Revolute("hinge", ROOT, axis=(0.0, 0.0, 1.0)),
        joints.Revolute("knee", At("rod", "end"), TIP, axis=(0.0, 1.0, 0.0)),
    ]
    spin = {"beam": SPIN, "rod": Motion((0.0, 3.0, 0.0), (0.0, 2.0, 3.0), (1.0, 0.0, 0.0))}
    return complete(assemble([cable(3), rod], held, [DOWN_IN_SPACE], damping, initial=spin))


def driven() -> System:
    """A beam whose angle at the root follows a history that begins with a rate and curved."""
    angle = of_time("0.3*t + 2*t**2 - t**3")
    held = [joints.Pin("hinge", ROOT), joints.DrivenAngle("drive", ROOT, angle)]
    return complete(assemble([cable()], held, [DOWN], initial={"beam": Motion(None, 0.3)}))


def twisted() -> System:
    """A beam with directors, the first of which have no mass."""
    section = sections.BeamSection(
        np.diag([2e4, 1e4, 1e4, 2.0, 3.0, 4.0]), np.diag([0.2, 1e-5, 1e-5])
    )
    part = beam("beam", segment(3), section, direction=(0.0, 0.0, 1.0))
    turn = loads.Moment("turn", TIP, (0.3, 0.2, 0.1))
    return complete(
        assemble([part], [joints.Clamp("wall", ROOT)], [turn], Rayleigh(stiffness=1e-4))
    )


def compressed() -> System:
    """A beam at half of its length, of which nothing holds what begins to move."""
    whole = arm()
    x = 0.5 * whole.lift(whole.x0)
    matrix = np.asarray(whole.lift.matrix)
    return initial.replace(whole, x0=np.linalg.lstsq(matrix, x - whole.lift.offset, rcond=None)[0])


def on_a_rope() -> System:
    """A beam that hangs on a rope that is taut."""
    rope = springs.Rope("rope", TIP, (0.8, 0.4), length=0.3, stiffness=200.0, damping=1.0)
    return arm(rope, initial={"beam": Motion(None, -0.2)})


CASES: dict[str, Callable[[], System]] = {
    "a force": lambda: arm(loads.PointForce("push", TIP, (0.3, 0.2), of_time("1 + sin(9*t)"))),
    "a spring and a damper": lambda: arm(
        springs.SpringDamper("spring", TIP, (0.5, 0.8), stiffness=40.0, damping=0.2),
        initial={"beam": Motion(None, 2.0)},
    ),
    "joints that turn in space": turning,
    "damped": lambda: turning(Rayleigh(stiffness=1e-4, mass=0.1)),
    "a driven angle": driven,
    "directors": twisted,
    "a free body": lambda: complete(
        assemble([cable(3)], [], [DOWN_IN_SPACE], initial={"beam": SPIN})
    ),
    "compressed": compressed,
    "a rope": on_a_rope,
    "friction in a joint": lambda: incline(more=[SlidingFriction("rub", "slide", 0.3)], start=1.0),
    "points": lambda: models.double_pendulum(2, all_multipliers=True),
}

#: what moves joints as functions of time or of a place on a line, whose derivatives `initial` has from differences
BY_DIFFERENCES, DIFFERENCES = ("a driven angle", "friction in a joint"), 2e-8


def begun(system: System, scheme: GeneralizedAlpha = STEP) -> tuple[Step, np.ndarray, State, int]:
    """A step in a state with x, v and what forces keep alone, its integers, the state that
    `initial` finds, and what `start` is told.
    """
    system = initial.startable(system, scheme)
    model = compile_system(system)
    assert model.arrays.dense
    found = initial.consistent_start(model, scheme)
    method = method_of(scheme, Newton(), scheme.step, model)
    step = initial.first_step(model, found, method, 1)
    signals, _ = leading_signals(system, np.zeros(1), scheme.step)
    step = step._replace(job=step.job._replace(signals=np.ascontiguousarray(signals)))
    exact = State(*(part.copy() for part in step.state))
    for part in step.state:
        part[...] = 7
    s = step.state
    s.x[:], s.v[:], s.memory[:] = exact.x, found.v[model.order], model.memory
    more = starting.FILTERED * initial.is_filtered(system)
    more += starting.MASSLESS * initial.has_massless_directors(system)
    more += starting.REACTS * any(one.reacts for one in model.forces)
    return step, packed(step), exact, more


@pytest.mark.parametrize("name", CASES)
def test_a_start_is_that_of_python(name: str) -> None:
    step, table, exact, more = begun(CASES[name]())
    kind = step.work.kind[1]
    assert starting.start.call(address_of(table), more) == 0
    assert step.work.kind[[0, 1, 3]].tolist() == [0, kind, 0]
    for field, got, wanted in zip(State._fields, step.state, exact, strict=True):
        size = float(np.abs(wanted).max(initial=0.0))
        off = DIFFERENCES if name in BY_DIFFERENCES else 1e-9
        np.testing.assert_allclose(got, wanted, rtol=0, atol=off * size, err_msg=field)
