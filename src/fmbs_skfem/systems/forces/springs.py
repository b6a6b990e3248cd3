r"""Springs, ropes and stops between two places, or a place and a fixed point: forces along the line
that joins them.

    F = - N(d, d') u,    d = |r_at - r_to|,    u = (r_at - r_to) / d,    d' = u . (v_at - v_to)      on `at`, - F on `to`

    spring_damper    N = k (d - l) + c d'                              energy k (d - l)^2 / 2
    rope             N = max(0, k ramp(s) + c touch(s) s'),            s = d - l,       energy k lift(s), see `one_sided`
    stop             N = - max(0, k ramp(s) + c touch(s) s'),          s = gap - d,     or s = gap - n . (r_at - r_to)
    constant_force   N = f h(t)                                        energy f h(t) d

A force that is not zero at d = 0 has no direction there: such places are refused at the start;
later it is zero there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar

import numpy as np
from scipy.sparse import csr_array, vstack

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.problems import Problem
from .. import fields
from ..connections.constraint_functions import mark, needs_other_side, unit
from ..places import At, Draft, Gauge, vector
from .loads import Load, where

Stiffness = Annotated[float, fields.quantity("N/m", ">= 0")]
Damping = Annotated[float, fields.quantity("N s/m", ">= 0")]
Length = Annotated[float, fields.quantity("m", ">= 0")]
Resolution = Annotated[
    float,
    fields.quantity("", ">= 0"),
    "radians of its vibration per divided step; with 0 steps are not divided",
]
Smoothing = Annotated[float, fields.quantity("m", ">= 0"), "over which it begins, 0 for at once"]
SPACE = 3  #: rows of these laws; in the plane the last one is zero
# 126 steps a period: at half twice as many and a quarter of the error of a touch, at twice half as
# many and four times of it
RESOLUTION = 0.05  #: rad of a vibration on what is one-sided a step, by default
MEETING = 1e-12  #: distance of places at one point, over the size of the bodies


@dataclass(frozen=True)
class Between(Load, ABC):
    """What acts along the line between two places, or a place and a fixed point.

        F = - N(d, d') u on `at`, - F on `to`,    d = |r_at - r_to|,    u = (r_at - r_to) / d

    InputError, when it is added to a system, where a number is not finite.
    """

    name: str
    at: fields.Place
    to: fields.OtherEnd
    drawn: ClassVar[str] = "spring"
    resists: ClassVar[bool] = True

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_other_side(self.to)

    def push(self, draft: Draft) -> None:
        for key, value in vars(self).items():
            if isinstance(value, float) and not np.isfinite(value):
                raise InputError(say(f"{where(self)}.{key}", "a finite number", value))
        mark(self, draft, self.drawn, self.at, self.to)
        self.act(draft)

    @abstractmethod
    def act(self, draft: Draft) -> None:
        """Add its law to the draft, on the rows of `along`."""


def along(load: Between, draft: Draft, length: float | None) -> tuple[range, float]:
    """Probe rows of r_at - r_to [m], three ones, and a free length [m], by default that of the
    reference.

    In the plane the third row is zero. The rows are noted as the load's gauge, which outputs read.
    """
    matrix, offset = draft.layout.apart(where(load), load.at, load.to)
    missing = SPACE - len(offset)
    first = draft.probes.add(
        csr_array(vstack([matrix, csr_array((missing, matrix.shape[1]))])),
        np.pad(offset, (0, missing)),
    )
    free = distance(load, draft) if length is None else length
    draft.gauges[load.name] = Gauge("distance", tuple(range(first, first + SPACE)), free)
    return range(first, first + SPACE), free


def act_on_one_side(
    load: Rope | Stop, draft: Draft, kind: str, rows: Sequence[int], law: tuple[float, ...]
) -> None:
    """Add a law that acts on one side; steps in which it begins or ends are divided as those of
    contact, see `contacts`.

    The change of a force N is to change no speed by more than resolution^2 times the largest so
    far, of the mass of the body at one end, and of both together where there are two:

        m_A m_B / (m_A + m_B)
    """
    if not load.resolution:
        return draft.forces.act(f"one_sided{kind}", rows, law)
    masses = [
        draft.layout.body(where(load), end).total_mass
        for end in (load.at, load.to)
        if isinstance(end, At)
    ]
    mass = 1.0 / sum(1.0 / one for one in masses)
    return draft.forces.act(f"impact{kind}", rows, (*law, 1.0 / (mass * load.resolution**2)))


def distance(load: Between, draft: Draft) -> float:
    """Distance of the places in the reference.

        |r_at - r_to|

    [m].
    """
    layout = draft.layout
    name = where(load)
    ends = [layout.reference(name, end) for end in (load.at, load.to)]
    return float(np.linalg.norm(ends[0] - ends[1]))


def need_direction(load: Between, draft: Draft) -> None:
    """InputError where both places are at one point in the reference, where what acts between them
    has no direction.

    One point is a distance below 1e-12 of the size of the bodies.
    """
    points = np.concatenate([part.reference for part in draft.layout.bodies.values()])
    if distance(load, draft) <= MEETING * float(np.abs(points).max(initial=0.0)):
        remedy = "place them apart, or give a length of 0 to a spring"
        raise InputError(
            say(
                where(load),
                "places apart, which give its force a direction",
                "both at one point",
                remedy,
            )
        )


@dataclass(frozen=True)
class SpringDamper(Between):
    """Pulls two places at a distance d together.

        stiffness (d - length) + damping d'

    `length` is the distance without force, by default that of the reference.

    {type: spring_damper, at: beam.right, to: [1 m, 0.3 m], stiffness: 20 N/m, damping: 0.1 N s/m}
    """

    stiffness: Stiffness = 0.0
    damping: Damping = 0.0
    length: Length | None = None
    strengths: ClassVar[tuple[str, ...]] = ("stiffness", "damping")

    @property
    def rests(self) -> bool:
        return self.length is None

    def act(self, draft: Draft) -> None:
        if self.length != 0.0:
            need_direction(self, draft)
        rows, free = along(self, draft, self.length)
        draft.forces.act("spring", rows, (self.stiffness, self.damping, free))


@dataclass(frozen=True)
class Rope(Between):
    """Pulls where it is longer than `length`, by default its length in the reference, and never
    pushes.

        N = stiffness s + damping s' >= 0    where s = d - length > 0

    {type: rope, at: beam.right, to: [1 m, 0.5 m], stiffness: 1 kN/m, length: 0.6 m}
    """

    stiffness: Stiffness = 0.0
    damping: Damping = 0.0
    length: Length | None = None
    smoothing: Smoothing = 0.0
    resolution: Resolution = RESOLUTION
    drawn: ClassVar[str] = "line"
    strengths: ClassVar[tuple[str, ...]] = ("stiffness", "damping")

    @property
    def rests(self) -> bool:
        return self.length is None

    def act(self, draft: Draft) -> None:
        rows, free = along(self, draft, self.length)
        act_on_one_side(
            self, draft, "", rows, (1.0, self.stiffness, self.damping, free, self.smoothing, 1.0)
        )


@dataclass(frozen=True)
class Stop(Between):
    """Pushes two places apart that are nearer than `gap`: in distance or, with `direction`, as seen
    along it from `to` to `at`.

        N = stiffness s + damping s' >= 0    where s = gap - d > 0

    Damping acts while they touch, from the first instant on: a `smoothing` takes the jump out of
    it. It stops where it would pull; with `cut: false` it may (the law of Kelvin and Voigt). Steps
    in which it begins or ends are divided as those of contact.

    {type: stop, at: beam.right, to: [1 m, -0.2 m], direction: [0, 1], stiffness: 1 kN/m}
    """

    stiffness: Stiffness = 0.0
    damping: Damping = 0.0
    gap: Annotated[float, fields.quantity("m")] = 0.0
    direction: fields.Direction | None = None
    smoothing: Smoothing = 0.0
    cut: Annotated[bool, "whether it never pulls"] = True
    resolution: Resolution = RESOLUTION
    drawn: ClassVar[str] = "line"
    strengths: ClassVar[tuple[str, ...]] = ("stiffness", "damping")

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from super().problems(dim)
        if self.direction is None and self.gap <= 0.0:
            yield (
                "gap",
                Problem(
                    "a length > 0 without a direction",
                    f"{self.gap:g}",
                    "distances are never below 0",
                ),
            )

    def act(self, draft: Draft) -> None:
        law = (self.stiffness, self.damping, self.gap, self.smoothing, float(self.cut))
        if self.direction is None:
            rows, _ = along(self, draft, self.gap)
            return act_on_one_side(self, draft, "", rows, (-1.0, *law))
        name = f"{where(self)}.direction"
        normal = unit(name, vector(name, self.direction, draft.layout.dim), draft.layout.dim)
        matrix, offset = draft.layout.apart(where(self), self.at, self.to)
        row = draft.probes.add(csr_array(normal[None, :] @ matrix), normal[None, :] @ offset)
        draft.gauges[self.name] = Gauge("along", (row,), self.gap)
        return act_on_one_side(self, draft, "_plane", [row], law)


@dataclass(frozen=True)
class ConstantForce(Between):
    """Pulls two places together at any distance; a negative force pushes.

        force history(t)

    {type: constant_force, at: beam.right, to: [1 m, 1 m], force: 20 N}
    """

    force: Annotated[float, fields.quantity("N")] = 0.0
    history: fields.History | None = None
    resists: ClassVar[bool] = False
    drawn: ClassVar[str] = "line"
    strengths: ClassVar[tuple[str, ...]] = ("force",)

    def act(self, draft: Draft) -> None:
        need_direction(self, draft)
        rows, _ = along(self, draft, 0.0)
        draft.forces.act("constant_pull", rows, (self.force,), [draft.signal(self.history)])
