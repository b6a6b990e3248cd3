"""What a contact does, as an output: its normal and friction force, the smallest gap, and how fast
it slides.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from ..core.errors import InputError, closest, listed, say
from ..core.storage.records import dataclass
from ..systems.measures.probes import Probe, Sensed, Sizes
from ..systems.places import Draft
from ..systems.system import Output
from .contacts import ContactGauge
from .facet_forces import measures
from .facet_pairs import FacetContacts
from .forces import ContactForces
from .shapes import distances

PARTS = {"force": "N", "friction": "N", "gap": "m", "slip": "m/s"}


@dataclass(frozen=True)
class ContactState(Probe, word="contact"):
    """What a contact does: sums of its normal and its friction forces [N], its smallest gap [m],
    and how fast it slides [m/s].

    Friction is that of all points together, sliding that of the point which is pressed most, 0
    where none touches.

    {type: contact, load: floor}
    """

    load: Annotated[str, "a name of a contact"]
    calls = ("pushes",)
    pausing: ClassVar[tuple[int, ...]] = (3,)

    def sense(self, name: str, draft: Draft) -> Output:
        gauge = draft.gauges.get(self.load)
        if not isinstance(gauge, ContactGauge):
            known = [key for key, one in draft.gauges.items() if isinstance(one, ContactGauge)]
            expected = f"one of the contacts {listed(known, self.load, 'of which there are none')}"
            raise InputError(
                say(f"output '{name}'", expected, f"'{self.load}'") + closest(self.load, known)
            )
        read = [row for term in gauge.terms for row in rows_of(term)]
        rows, offset = draft.probes.rows_of(read)
        # sensors count from the origin of the scene
        first = draft.sensors.add(rows, offset - rows @ draft.layout.shift)
        columns = tuple(f"{name}_{part}" for part in PARTS)
        return Output(
            self.word,
            tuple(range(first, first + len(offset))),
            columns,
            parameters=tuple(float(rows_of(term)[0]) for term in gauge.terms),
        )

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        found = list[ContactColumns]()
        first = 0
        pushes = sensed.pushes()
        for row in output.parameters:
            term = next(one for one in sensed.forces if rows_of(one)[:1] == [int(row)])
            part = slice(first, first + len(rows_of(term)))
            found.append(find_columns(term, sensed.values[:, part], sensed.rates[:, part], pushes))
            first = part.stop
        force, friction, gap, most, slip = (
            np.array(columns) for columns in zip(*found, strict=True)
        )
        sliding = slip[np.argmax(most, axis=0), np.arange(slip.shape[1])]
        return [
            force.sum(axis=0),
            np.linalg.norm(friction.sum(axis=0), axis=1),
            gap.min(axis=0),
            sliding,
        ]

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        return tuple(PARTS.values())

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        return None, len(PARTS), None


class ContactColumns(NamedTuple):
    """What a term does: columns (s,) and vectors (s, c) over samples of a motion."""

    force: np.ndarray  #: (s,) sum of normal forces [N]
    friction: np.ndarray  #: (s, c) sum of those of friction on what touches [N]
    gap: np.ndarray  #: (s,) the smallest one [m]
    most: np.ndarray  #: (s,) normal force of the point that is pressed most [N]
    slip: np.ndarray  #: (s,) how fast that slides, 0 where none touches [m/s]


@singledispatch
def rows_of(term: Any) -> list[int]:
    """Probe rows that a contact reads; none of other forces. The first one is its own."""
    return []


@rows_of.register
def _(term: ContactForces) -> list[int]:
    return [int(row) for row in (*term.rows.ravel(), *term.frame)]


@singledispatch
def find_columns(term: Any, y: np.ndarray, rate: np.ndarray, pushes: np.ndarray) -> ContactColumns:
    """Columns from the rows of a contact (s, i), their rates, and the forces on all probe rows (s,
    j).
    """
    raise TypeError(type(term))


@find_columns.register
def _(term: ContactForces, y: np.ndarray, rate: np.ndarray, pushes: np.ndarray) -> ContactColumns:
    count, wide = term.rows.shape
    dim = term.placed.shape[1]
    samples = len(y)
    points, moves = (part[:, : count * wide].reshape(samples, count, -1, dim) for part in (y, rate))
    frame, turns = (
        shape_of(term, part[:, count * wide :], still) for part, still in ((y, 1.0), (rate, 0.0))
    )
    z = np.einsum("stc,sic->sti", points[:, :, 0] - frame[:, None, 0], frame[:, 1:])
    flat = np.ascontiguousarray(z.reshape(-1, dim))
    n = np.zeros((samples * count, dim))
    away = distances(term.shape, term.sizes, term.heights, flat, n).reshape(samples, count)
    local = n.reshape(z.shape)
    normal = np.einsum("sti,sic->stc", local, frame[:, 1:])
    force = pushes[:, term.rows[:, :dim]]
    pressed = np.sum(force * normal, axis=2)
    friction = np.sum(force - pressed[:, :, None] * normal, axis=1)
    s = np.arange(samples)
    k = np.argmax(pressed, axis=1)
    normal = normal[s, k]
    radius = term.radius[k]
    axes = points[s, k, 1:]
    arms = -radius[:, None] * np.einsum("sjc,sc->sj", axes, normal) / np.sum(axes**2, axis=2)
    places = z[s, k] - radius[:, None] * local[s, k]
    speed = (
        moves[s, k, 0]
        - turns[:, 0]
        + np.einsum("sj,sjc->sc", arms, moves[s, k, 1:])
        - np.einsum("si,sic->sc", places, turns[:, 1:])
    )
    speed -= np.sum(speed * normal, axis=1)[:, None] * normal
    slip = np.where(pressed[s, k] > 0.0, np.linalg.norm(speed, axis=1), 0.0)
    return ContactColumns(
        pressed.sum(axis=1), friction, (away - term.radius).min(axis=1), pressed[s, k], slip
    )


@rows_of.register
def _(term: FacetContacts) -> list[int]:
    return [int(row) for row in term.rows]


@find_columns.register
def _(term: FacetContacts, y: np.ndarray, rate: np.ndarray, pushes: np.ndarray) -> ContactColumns:
    found = measures(term, y, rate)
    gap, slip, normal = found[..., 0], found[..., 2], found[..., 3:]
    force = pushes[:, term.rows[-3 * len(term) :]].reshape(len(y), len(term), 3)
    pressed = np.einsum("stc,stc->st", force, normal)
    beyond = pressed < 0.0  # the middle of the surface, which the rows of one state do not say
    gap = np.where(beyond, -gap - 2.0 * term.radius, gap)
    friction = np.einsum("st,stc->sc", pressed, normal) - force.sum(axis=1)
    pressed = np.abs(pressed)
    s = np.arange(len(y))
    k = np.argmax(pressed, axis=1)
    sliding = np.where(pressed[s, k] > 0.0, slip[s, k], 0.0)
    return ContactColumns(pressed.sum(axis=1), friction, gap.min(axis=1), pressed[s, k], sliding)


def shape_of(term: ContactForces, rows: np.ndarray, still: float) -> np.ndarray:
    """Origin and axes (s, 1 + c, c) of the shape from its rows (s, f), those that stand still times
    `still`.
    """
    found = np.tile(still * term.placed, (len(rows), 1, 1))
    moving = rows.reshape(len(rows), -1, term.placed.shape[1])
    found[:, : moving.shape[1]] = moving
    return found
