"""Campbell diagrams: vibration modes over a parameter of the scene, such as the speed at which it
turns.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np

from ... import dynamics
from ...core.errors import InputError, listed, say
from ...core.storage.records import dataclass
from ...core.values.fields import Count, name_in
from ...core.values.ranges import Parameter
from ...dynamics.near_state.campbell import MotionsAt
from ...parts import finer_parts
from ..yamlfile import Oddity, where
from .analysis import StateTable, Work
from .near_state import NearState
from .vibration import LANCZOS, Modes

if TYPE_CHECKING:
    from ..schema import Scene


@dataclass(frozen=True, kw_only=True)
class Campbell(NearState):
    """Vibration modes over a parameter that has a range, each frequency along one motion; of `spin`
    usually: {rate: speed}.

    `steps` values are taken evenly over the range. Frequencies are those in the rotating frame.
    `orders` draws the lines of so many multiples of the parameter, and lists where frequencies
    cross them.

    {type: campbell, parameter: speed, spin: {rate: speed}, orders: 1}
    """

    parameter: Annotated[str, name_in("parameters", "a parameter with a range")] | None = None
    count: Count = 6
    damped: bool = False
    steps: Count = 21
    orders: Count | None = None
    table: ClassVar[str] = "campbell.csv"

    def work(self) -> Work:
        return Work(
            4.0 * self.steps,
            self.steps,
            LANCZOS * self.steps,
            counts={"modes": self.count, "values": self.steps},
        )

    def idle(self, scene: Scene) -> Iterator[Oddity]:
        return self.modes(self.count).idle(scene)

    def modes(self, count: int) -> Modes:
        """The analysis at one value."""
        shared = {one.name: getattr(self, one.name) for one in fields(NearState)}
        return Modes(count=count, damped=self.damped, **shared)

    def over(self, scene: Scene) -> Parameter:
        """The parameter with its range."""
        name = self.parameter or next(iter(scene.ranges), "")
        if name not in scene.ranges:
            expected = (
                f"a parameter with a range: {listed(scene.ranges, name, 'of which there are none')}"
            )
            remedy = f"write {name or 'speed'}: {{value: ..., range: [low, high]}}"
            raise InputError(
                say(where(scene, "analysis", "parameter"), expected, f"'{name}'", remedy)
            )
        return scene.ranges[name]

    def find(self, scene: Scene, allow_outside: bool = False) -> StateTable:
        limits = self.over(scene)
        name = limits.name
        last: list[StateTable] = []
        off = dict[str, float]()

        def modes_at(value: float, count: int) -> MotionsAt:
            one = scene.again({name: value})
            assert isinstance(one.analysis, Campbell)
            modes = one.analysis.modes(count)
            raw, reduced, about = modes.model(one, allow_outside)
            linear = modes.equations(reduced, about)
            found = modes.motions(reduced, linear)
            last[:] = [StateTable(raw, reduced, about, "", (), {}, {})]
            high = modes.too_high(found, reduced, about)
            if high is not None:
                off.update(
                    {
                        f"mode {k + 1} at {name} = {value:.4g}": error
                        for k, error in enumerate(high[: self.count].tolist())
                    }
                )
            return MotionsAt(found.omega, found.growth, found.vectors, linear.mass)

        values = np.linspace(limits.low, limits.high, max(self.steps, 2))
        found = dynamics.campbell(values, modes_at, self.count)
        hertz = found.omega / (2.0 * np.pi)
        numbers = range(1, found.omega.shape[1] + 1)
        columns = {"step": np.arange(1, len(values) + 1), name: values}
        columns |= {f"frequency_{k}_hz": hertz[:, k - 1] for k in numbers}
        columns |= {f"growth_{k}_per_s": found.growth[:, k - 1] for k in numbers}
        crossed = [
            {
                "order": order,
                "mode": mode + 1,
                name: value,
                "frequency_hz": order * value / (2.0 * np.pi),
            }
            for order in range(1, (self.orders or 0) + 1)
            for mode, value in found.crossings(order)
        ]
        facts = {
            "about": last[0].about,
            "parameter": name,
            "unit": limits.unit,
            "values": values,
            "crossings": crossed,
        }
        facts |= {"frequencies_hz": hertz.T, "growth_per_s": found.growth.T}
        return StateTable(
            last[0].raw,
            last[0].reduced,
            f"{len(numbers)} frequencies at {len(values)} values of {name}",
            f"frequencies over {name}",
            (
                "",
                f"{name} [{limits.unit}]",
                *(f"f{k} [Hz]" for k in numbers),
                *(f"growth {k} [1/s]" for k in numbers),
            ),
            columns,
            facts,
            diagram=found,
            doubts=[*find_growing(name, found), *finer_parts.find_off("frequencies", off)],
        )


def find_growing(name: str, found: dynamics.CampbellDiagram) -> Iterator[str]:
    """Motions that grow somewhere, with the first value at which they do."""
    for k in np.flatnonzero(found.unstable.any(axis=0)):
        first = found.values[found.unstable[:, k].argmax()]
        yield f"mode {k + 1} is unstable from {name} = {first:.4g} on"
    if (at := np.flatnonzero(found.others)).size:
        listed = f"a motion beside the {found.omega.shape[1]} listed is unstable"
        yield f"{listed} from {name} = {found.values[at[0]]:.4g} on; raise the count"
