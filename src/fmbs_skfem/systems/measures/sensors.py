r"""What sensors read beside positions and velocities: accelerations, and the power of loads and
drives.

    a = r'',    a_k = (a - g) . e_k / |e_k|    of an accelerometer in the axes e_k of its place
    P = F . y'  of a load with forces F on its probe rows y,    P = - lambda . (Phi_y y')  of a drive with rows Phi(y, t) = 0

r'' are from the accelerations of the equations of motion, of second order in the step as positions
are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from ...core.errors import InputError, closest, listed, say
from ...core.storage.records import dataclass
from ...core.values.fields import AXES
from ...core.values.problems import Problem
from ..places import Draft
from ..signals import read_inputs
from ..system import Output
from .probes import PointProbe, Probe, Sensed, Sizes, notify_unknown

#: numbers of a term of a drive: row of the joint, coefficient, signal, and two sensor rows
EACH = 5


@dataclass(frozen=True)
class Acceleration(PointProbe):
    """Acceleration of a point [m/s^2], along the axes of the scene or of the place, as an
    accelerometer reads it if wanted.

    One `component` along an axis of the scene has the output's own name. With `axes: place` there
    are NAME_e1, NAME_e2 (, NAME_e3) along the vectors that the place carries, as they turn: axes of
    a frame or of a beam's section, the slope of a line in the plane and its normal. An
    `accelerometer` feels no gravity: it reads 0 in free fall, and 9.81 m/s^2 upwards at rest.

    {type: acceleration, at: arm.right, axes: place, accelerometer: true}
    """

    axes: Annotated[Literal["scene", "place"], "along which its components are"] = "scene"
    accelerometer: Annotated[bool, "whether gravity is left out, as such a sensor does"] = False
    unit: ClassVar[str] = "m/s^2"

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from super().problems(dim)
        if self.component is not None and self.axes == "place":
            yield (
                "component",
                Problem(
                    "no component beside `axes: place`",
                    f"'{self.component}'",
                    "take NAME_e1, NAME_e2, ...",
                ),
            )

    def variables(self, dim: int) -> Mapping[str, str]:
        return {}

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        layout = draft.layout
        rows = [layout.read(where, self.at)]
        dim = layout.dim
        if self.component is not None and self.component not in tuple(AXES[:dim]):
            raise InputError(
                say(where, f"one of the components {', '.join(AXES[:dim])}", self.component)
            )
        gravity = sum(draft.forces.field, np.zeros(dim)) if self.accelerometer else np.zeros(dim)
        words = tuple(AXES[:dim])
        if self.axes == "place":
            carried = layout.vectors(where, self.at)
            if len(carried) < dim:
                got = ("a mere point", "one vector", "two tangents")[len(carried)]
                raise InputError(
                    say(
                        f"{where}.axes",
                        f"a place with {dim} vectors",
                        f"{self.at} with {got}",
                        "name a frame",
                    )
                )
            rows += carried
            words = tuple(f"e{k + 1}" for k in range(dim))
        if self.component is not None:
            axis = AXES.index(self.component)
            return self.output(
                draft, (name,), [rows[0][[axis]]], parameters=(float(gravity[axis]),)
            )
        return self.output(
            draft,
            tuple(f"{name}_{word}" for word in words),
            rows,
            parameters=tuple(gravity.tolist()),
        )

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        """Nothing: it is no function of positions and velocities."""
        return ()

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        dim = len(output.parameters)
        found = sensed.accelerations[:, :dim] - np.array(output.parameters)
        if len(output.rows) > dim:
            e = sensed.values[:, dim:].reshape(len(found), dim, dim)
            found = np.einsum("skc,sc->sk", e / np.linalg.norm(e, axis=2, keepdims=True), found)
        return list(found.T)

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        own = len(output.columns)
        return own if len(output.rows) == own else dim * (1 + dim), own, own


@dataclass(frozen=True)
class Power(Probe):
    """Power [W] that a load or a drive gives to the bodies, what a spring stores or a damper takes
    being negative.

    Of loads at places, such as forces, moments, motors, springs and contacts, and of driven angles
    and positions; gravity and pressures that follow a surface are in the output `energy`.

    {type: power, of: motor}
    """

    of: Annotated[str, "a name of a load, or of a driven joint"]
    unit: ClassVar[str] = "W"
    known_to_all: ClassVar[bool] = False
    calls = ("reactions", "pushes")

    def sense(self, name: str, draft: Draft) -> Output:
        drive = drive_terms(draft, self.of)
        rows = (
            sorted({row for _, _, _, *pair in drive for row in pair if row >= 0})
            if drive
            else list(draft.pushed.get(self.of, ()))
        )
        if not rows:
            known = [*(load for load, own in draft.pushed.items() if own), *driven(draft)]
            expected = f"one of the loads at places, or of the driven joints {listed(known, self.of, 'of which there are none')}"
            raise InputError(
                say(f"output '{name}'.of", expected, f"'{self.of}'") + closest(self.of, known)
            )
        if any(read_inputs(draft.signals[signal]) for _, _, signal, _, _ in drive if signal >= 0):
            raise InputError(
                say(
                    f"output '{name}'.of",
                    "a drive by a function of time",
                    f"'{self.of}', which reads an input",
                )
            )
        block, offset = draft.probes.rows_of(rows)
        # sensors count from the origin of the scene
        first = draft.sensors.add(block, offset - block @ draft.layout.shift)
        place = {row: k for k, row in enumerate(rows)} | {-1: len(rows)}
        terms = [
            (float(k), factor, float(signal), float(place[i]), float(place[j]))
            for k, factor, signal, i, j in drive
        ]
        numbers = (
            tuple(value for term in terms for value in term) if drive else tuple(map(float, rows))
        )
        own = tuple(range(first, first + len(rows)))
        return Output(self.word, own, (name,), joint=self.of if drive else "", parameters=numbers)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        y, rate = sensed.values, sensed.rates
        if not output.joint:
            return [
                np.sum(sensed.pushes()[:, np.array(output.parameters, dtype=int)] * rate, axis=1)
            ]
        mine = [
            values for (joint, _), values in sensed.reactions().items() if joint == output.joint
        ]
        if not mine or any(np.isnan(part).all() for part in mine):
            notify_unknown(f"the power of joint '{output.joint}'")
            return [np.full(len(y), np.nan)]
        held = np.stack(mine, axis=1)
        one = np.ones((len(y), 1))
        none = np.zeros((len(y), 1))
        y, rate, signals = (
            np.hstack([y, one]),
            np.hstack([rate, none]),
            np.hstack([sensed.signals(), one]),
        )
        row, factor, signal, i, j = np.reshape(output.parameters, (-1, EACH)).T
        row, signal, i, j = (part.astype(int) for part in (row, signal, i, j))
        return [
            np.sum(
                factor
                * held[:, row]
                * signals[:, signal]
                * (rate[:, i] * y[:, j] + y[:, i] * rate[:, j]),
                axis=1,
            )
        ]

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        return None, 1, None if output.joint else len(output.rows)


def driven(draft: Draft) -> list[str]:
    """Names of joints that drive by functions of time, in polynomials."""
    rows = {k for k, _, signal, _, _ in draft.constraints.terms if signal >= 0}
    return list(dict.fromkeys(draft.constraints.names[k][0] for k in sorted(rows)))


def drive_terms(draft: Draft, name: str) -> list[tuple[int, float, int, int, int]]:
    """Terms (row of the joint, coefficient, signal, i, j) of the rows of a drive, none where it is
    none.
    """
    if name not in driven(draft):
        return []
    mine = {
        k: number
        for number, k in enumerate(
            k for k, (joint, _) in enumerate(draft.constraints.names) if joint == name
        )
    }
    return [
        (mine[k], factor, signal, i, j)
        for k, factor, signal, i, j in draft.constraints.terms
        if k in mine
    ]
