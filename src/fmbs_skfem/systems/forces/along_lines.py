r"""What acts along a line on a joint that slides there: forces, friction, stops at its ends.

    force       F = f(s, s', t, ...)                                          on s, of an expression
    friction    F = - (mu |N| tanh(v / v_0) + c v) |r'|,    v = |r'| s'       N the part of the joint's force across the line
    stop        F = k (s_0 - s) - c s'    where  s < s_0,   and from s_1 on to the other side

A force F on the coordinate s is one along the slope r' on what slides, and its opposite on the
line: it does the work F s'. N is that of the same state, which the iteration finds; its matrix has
no derivative of F by N, which costs a correction or two.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from scipy.sparse import csr_array

from ...core.compiling.jit import jit
from ...core.compiling.structs import routine
from ...core.storage.records import dataclass
from ...core.values.fields import AXES
from ...core.values.responses import OfState
from .. import fields
from ..connections import along_lines
from ..connections.sliding import coordinate_in
from ..evaluation import evaluation
from ..places import Draft, Gauge
from . import responses
from .force_laws import ForceLaw, ForceRecord, opened
from .loads import Load, where

WORD = "line_friction"


@jit
def held(F: ForceRecord, k: int, w: Any, c: int) -> float:
    """Component c of the force [N] of the rows that hold the point of group k: the only ones that
    read it.
    """
    total = 0.0
    row = F.rows[k, 2 + c]
    for m in range(len(w.multipliers)):
        total += w.Jy[m, row] * w.multipliers[m]
    return total / w.c[0]


@jit
def resistance(F: ForceRecord, k: int, w: Any) -> tuple[float, float]:
    """Friction of group k along its line, and its derivative by the rate of s.

        F = - (mu N tanh(v / v_0) + c v) |r'|,    v = |r'| s'

    on the coordinate s, with the force N across the line.
    """
    dim, _, _, cells = along_lines.layout(F, k)
    s = w.y[F.rows[k, 0]]
    rate = w.rates[F.rows[k, 0]]
    mu, v0, c = F.numbers[k, -3], F.numbers[k, -2], F.numbers[k, -1]
    e = along_lines.cell_of(F, k, s, cells)
    square = 0.0
    along = 0.0
    push = 0.0
    for i in range(dim):
        slope = along_lines.value(F, k, e, w.y, i, s, 1)
        force = held(F, k, w, i)
        square, along, push = square + slope * slope, along + slope * force, push + force * force
    size = math.sqrt(square)
    N = math.sqrt(max(push - along * along / square, 0.0))
    rough = math.tanh(size * rate / v0)
    return -(mu * N * rough + c * size * rate) * size, -(
        mu * N * (1.0 - rough * rough) / v0 + c
    ) * square


@routine
def force(table: Any, record: Any) -> int:
    w = evaluation(table).space
    F = opened(record)
    for k in range(len(F.rows)):
        w.g[F.rows[k, 0]] += resistance(F, k, w)[0]
    return 0


@routine
def slopes(table: Any, record: Any) -> int:
    w = evaluation(table).space
    F = opened(record)
    for k in range(len(F.rows)):
        w.H[F.pair + k] -= w.c[0] * w.gh[0] * resistance(F, k, w)[1]
    return 0


def friction(name: str) -> ForceLaw:
    """The law `line_friction|rows|numbers`: rows s, s, the point, coefficients of the line; their
    numbers, then mu, v_0 and c.
    """
    rows, numbers = map(int, name.split("|")[1:])
    more: dict[str, Any] = {
        "memory": 0,
        "damped": True,
        "smooth": True,
        "reacts": True,
        "maker": friction,
    }
    return ForceLaw(name, rows, numbers, 0, ((0, 0),), force=force, slopes=slopes, **more)


ForceLaw.makers[WORD] = friction


def coordinate(load: Any, draft: Draft) -> csr_array:
    """The row (1, q) of the coordinate s of the joint that a load names; InputError where no joint
    of that name slides.
    """
    return csr_array(
        draft.layout.read(where(load), coordinate_in(f"{where(load)}.joint", draft, load.joint))[
            [0]
        ]
    )


@dataclass(frozen=True)
class SlidingForce(Load):
    """A force along the line on what slides on it, and its opposite on the line.

    It is an expression of `place` (s), its `rate`, outputs and t.

    {type: sliding_force, joint: trolley, force: 20 N/m * (3 m - place) - 5 N s/m * rate}
    """

    name: str
    joint: fields.JointName
    force: Annotated[OfState, fields.response("N")]
    drives: ClassVar[bool] = True
    own: ClassVar[Mapping[str, str]] = responses.PLACES

    def push(self, draft: Draft) -> None:
        row = draft.probes.add(coordinate(self, draft))
        gauge = draft.gauges[self.name] = Gauge("push", (row,), 0.0)
        responses.act(draft, where(self), gauge, "along a line", self.force)


@dataclass(frozen=True)
class SlidingFriction(Load):
    """Coulomb's friction of what slides along a line at v, by its force N across the line, and
    viscous `damping`.

        F = - (coefficient |N| tanh(v / speed) + damping v)

    From a sliding `speed` of 0.76 of its own on the force is within a quarter of `coefficient` N,
    from 2 on within 4 %; below it falls to zero, so that what sticks creeps. In equilibria it is
    zero.

    {type: sliding_friction, joint: trolley, coefficient: 0.2}
    """

    name: str
    joint: fields.JointName
    coefficient: Annotated[float, fields.quantity("", ">= 0")] = 0.0
    speed: Annotated[float, fields.quantity("m/s", "> 0")] = 1e-3
    damping: Annotated[float, fields.quantity("N s/m", ">= 0")] = 0.0
    resists: ClassVar[bool] = True
    strengths: ClassVar[tuple[str, ...]] = ("coefficient", "damping")

    @property
    def rests(self) -> bool:
        return True

    def push(self, draft: Draft) -> None:
        coordinate(self, draft)
        held = [
            one
            for one in draft.constraints.laws
            if draft.constraints.names[one.row[0]] in self.rows(draft)
        ]
        along = int(held[0].rows[0, 0])
        dim = draft.layout.dim
        points = [int(one.rows[0, 1]) for one in held]
        coefficients = np.stack([one.rows[0, 3:] for one in held], axis=1).ravel().tolist()
        rows = [along, along, *points, *coefficients]
        numbers = [dim, *held[0].numbers[0, 1:], self.coefficient, self.speed, self.damping]
        draft.gauges[self.name] = Gauge("push", (along,), 0.0)
        draft.forces.act(friction(f"{WORD}|{len(rows)}|{len(numbers)}"), rows, numbers)

    def rows(self, draft: Draft) -> list[tuple[str, str]]:
        """Names of the rows that hold the point."""
        return [(self.joint, axis) for axis in AXES[: draft.layout.dim]]


@dataclass(frozen=True)
class SlidingStop(Load):
    """Stops of what slides along a line, springs that push back from `low` and `high`, by default
    the ends of the line.

    {type: sliding_stop, joint: trolley, stiffness: 100 kN/m, damping: 100 N s/m}
    """

    name: str
    joint: fields.JointName
    stiffness: Annotated[float, fields.quantity("N/m", ">= 0")] = 0.0
    damping: Annotated[float, fields.quantity("N s/m", ">= 0")] = 0.0
    low: Annotated[
        float | None, fields.quantity("m", ">= 0"), "by default the start of the line"
    ] = None
    high: Annotated[float | None, fields.quantity("m", ">= 0"), "by default its end"] = None
    smoothing: Annotated[float, fields.quantity("m", ">= 0"), "over which they begin"] = 0.0
    resists: ClassVar[bool] = True
    strengths: ClassVar[tuple[str, ...]] = ("stiffness", "damping")

    @property
    def rests(self) -> bool:
        return True

    def push(self, draft: Draft) -> None:
        row = coordinate(self, draft)
        own = next(
            one
            for one in draft.constraints.laws
            if draft.constraints.names[one.row[0]][0] == self.joint
        )
        high = along_lines.end_of(own.numbers[0]) if self.high is None else self.high
        for sign, gap in ((1.0, self.low or 0.0), (-1.0, -high)):
            law = self.stiffness, self.damping, gap, self.smoothing, 1.0
            draft.forces.act("one_sided_plane", [draft.probes.add(csr_array(sign * row))], law)
