"""Bodies, joints and loads of every type: two beams in line, a third at an angle to them, and a
mass point.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fmbs_skfem.bodies import Body, Given, Law, cable, point_mass
from fmbs_skfem.systems import At, System
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.system import Signal

from ..models import segment

SECTION = Given(EA=2000.0, EI=3.0, rhoA=0.5)
A0, A1, B0, B1, C0, C1 = (At(name, end) for name in "abc" for end in ("left", "right"))
BOB = At("bob", "center")


def beams(dim: int, cells: int = 4, law: Law = Law.EXACT, **options: Any) -> list[Body]:
    """a from (0, 0) to (1, 0), b in line to (2, 0), c from (1, 0) to (1.8, 0.6), and the point mass
    bob at (2, 1).
    """
    ends = {
        "a": ((0, 0, 0), (1, 0, 0)),
        "b": ((1, 0, 0), (2, 0, 0)),
        "c": ((1, 0, 0), (1.8, 0.6, 0)),
    }
    lines = [
        cable(name, segment(cells, *points), SECTION, dim=dim, law=law, **options)
        for name, points in ends.items()
    ]
    return [*lines, point_mass("bob", 0.7, np.array([2.0, 1.0, 0.0][:dim]))]


def swing(t: np.ndarray) -> np.ndarray:
    return np.asarray(0.4 * np.sin(3.0 * t))


def every_joint(dim: int) -> list[joints.Joint]:
    """Joints of every type and kind of end, all satisfied in the reference."""
    axis = {} if dim == 2 else {"axis": (0.0, 0.6, 0.8)}
    both: list[joints.Joint] = [
        joints.Pin("pin to ground", A0),
        joints.Pin("pin inside", At("a", 0.37)),
        joints.Pin("pin to a point", A1, (1.0, 0.0, 0.0)[:dim]),
        joints.Pin("pin between beams", A1, C0),
        joints.Clamp("clamp", C0),
        joints.Clamp("clamp inside", At("c", 0.41)),
        joints.Weld("weld in line", A1, B0),
        joints.RigidLink("distance to a body", C1, BOB),
        joints.RigidLink("distance inside", At("a", 0.3), At("c", 0.7)),
        joints.RigidLink("distance to ground", BOB, (0.0, 0.0, 0.0)[:dim]),
        joints.Slider("slider", BOB, (1.0, -2.0, 0.5)[:dim]),
        joints.DrivenAngle("driven angle", C0, swing, **axis),
        joints.DrivenPosition("driven position", C1, (swing,) * dim),
    ]
    return [*both, joints.Weld("weld at an angle", A1, C0)] if dim == 2 else both


def every_load(dim: int, history: Signal | None = None) -> list[loads.Load]:
    """Loads of every type."""
    return [
        loads.Gravity((1.0, -9.81, 2.0)[:dim]),
        loads.PointForce("force", C1, (3.0, 1.0, 2.0)[:dim], history),
        loads.Follower("follower", At("c", 0.33), (2.0, 1.5) if dim == 2 else (2.0,), history),
        loads.Moment("moment", B1, 0.3 if dim == 2 else (0.1, -0.2, 0.3), history),
    ]


def displaced(system: System, row: tuple[str, str], gap: float) -> System:
    """The system with a constraint row that the reference misses by `gap` [m], as no joint of a
    scene does.
    """
    terms = system.constraints
    added = {"row": terms.names.index(row), "coefficient": gap, "signal": -1, "i": -1, "j": -1}
    columns = {key: np.append(getattr(terms, key), value) for key, value in added.items()}
    return replace(system, constraints=replace(terms, **columns))
