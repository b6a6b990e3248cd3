"""What springs, ropes, stops and torques measure: their force, stretch and rate as an output.

    between places      s = |y| - l,    s' = y . y' / |y|,    N = - F . y / |y|        (a pull is positive)
    along a direction   s = y - l,      s' = y',              N = - F, of a control force F
    along an axis p     s = p . y - l,  s' = (p . y)',        N = - p . F, of a bushing that carries p
    about an axis       angle(y) - theta0, its rate, and the torque on the first place

F are the forces on the probe rows y of the load, which are its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np

from ...core.errors import InputError, closest, listed, say
from ...core.storage.records import dataclass
from ..measures.angles import angle_and_rates
from ..measures.probes import Argument, Probe, Sensed, Sizes, counted_angle
from ..places import Draft
from ..system import Output

KINDS = ("distance", "along", "push", "angle", "slide")
ANGLE = KINDS.index("angle")
LENGTHS = {"force": "N", "stretch": "m", "rate": "m/s"}
ANGLES = {"torque": "N m", "angle": "rad", "rate": "rad/s"}


@dataclass(frozen=True)
class LoadState(Probe, word="load"):
    """What a load between places does: force [N], a pull being positive, stretch [m] and its rate;
    or torque, angle and its rate.

    Those of torsion springs, motors and control torques act on the first place; a control force is
    that along its direction. Of a bushing one axis is measured, `mount.x` along it or
    `mount.about_x` about it, as far as it has a stiffness or damping there.

    {type: load, load: spring}
    """

    load: Annotated[str, "a name of a load"]
    calls = ("pushes",)
    known_to_all: ClassVar[bool] = True
    counted: ClassVar[tuple[int, ...]] = (1,)  # the angle about an axis

    def sense(self, name: str, draft: Draft) -> Output:
        gauge = draft.gauges.get(self.load)
        if gauge is None or gauge.kind not in KINDS:
            expected = f"one of the loads that measure {listed(draft.gauges, self.load, 'of which there are none')}"
            raise InputError(
                say(f"output '{name}'", expected, f"'{self.load}'")
                + closest(self.load, draft.gauges)
            )
        rows, offset = draft.probes.rows_of(gauge.rows)
        # sensors count from the origin of the scene
        first = draft.sensors.add(rows, offset - rows @ draft.layout.shift)
        columns = tuple(f"{name}_{part}" for part in (ANGLES if gauge.kind == "angle" else LENGTHS))
        numbers = (float(KINDS.index(gauge.kind)), gauge.free, *map(float, gauge.rows))
        return Output(
            self.word, tuple(range(first, first + len(offset))), columns, parameters=numbers
        )

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        kind, free, *rows = output.parameters
        force = sensed.pushes()[:, [int(row) for row in rows]]
        y, rate = sensed.values, sensed.rates
        if int(kind) == ANGLE:
            counted, speed = counted_angle(LoadState, output, sensed)
            return [torques(y, force), counted - free, speed]
        if KINDS[int(kind)] in ("along", "push"):
            return [
                force[:, 0] if KINDS[int(kind)] == "push" else -force[:, 0],
                y[:, 0] - free,
                rate[:, 0],
            ]
        if KINDS[int(kind)] == "slide":
            (p, apart), (change, speed) = (np.split(part, 2, axis=1) for part in (y, rate))
            pull = -np.sum(p * np.split(force, 2, axis=1)[1], axis=1)
            return [
                pull,
                np.sum(p * apart, axis=1) - free,
                np.sum(change * apart + p * speed, axis=1),
            ]
        distance = np.linalg.norm(y, axis=1)
        along = y / np.maximum(distance, np.finfo(float).tiny)[:, None]
        return [-np.sum(force * along, axis=1), distance - free, np.sum(rate * along, axis=1)]

    @classmethod
    def angle(
        cls, output: Output, y: np.ndarray, rate: np.ndarray, change: np.ndarray
    ) -> Argument | None:
        return angles(y, rate, change) if int(output.parameters[0]) == ANGLE else None

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        return tuple((ANGLES if int(output.parameters[0]) == ANGLE else LENGTHS).values())

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        angle, slide = (
            (own if (own := len(output.rows)) in known else known[0])
            for known in ((2, 4, 9), (4, 6))
        )
        count = (3, 1, 1, angle, slide)[int(output.parameters[0])]
        return count, 3, 2 + count


def angles(
    y: np.ndarray, rate: np.ndarray, change: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The angle (s,) [rad] of rows as in `responses.torque`, but for whole turns, and its two
    derivatives [rad/s, rad/s2].

    Rows y, their rates and second derivatives are (s, 2) of one arm, (s, 4) of two, whose
    difference it is, or (s, 9) of a vector u and of two vectors p and q normal to the axis that
    another place carries, with the angle atan2(u . q, u . p).
    """
    return angle_and_rates(y.T, rate.T, change.T)


def torques(y: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The torque (s,) [N m] on the first place of forces on the same rows y (s, 2), (s, 4) or (s,
    9) as of `angles`.

        y_0 F_1 - y_1 F_0 of an arm,    F_u . ((p x q) x u) of a vector u

    F are (s, i) as y.
    """
    if y.shape[1] < 9:
        return np.asarray(y[:, 0] * force[:, 1] - y[:, 1] * force[:, 0])
    axis = np.cross(y[:, 3:6], y[:, 6:9])
    return np.asarray(np.sum(force[:, :3] * np.cross(axis, y[:, :3]), axis=1))
