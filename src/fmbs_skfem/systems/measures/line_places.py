"""Where on its line a joint that slides is, as an output."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.storage.records import dataclass
from .. import fields
from ..connections.sliding import coordinate_in
from ..places import Draft
from ..system import Output
from .probes import Probe, Sensed, Sizes


@dataclass(frozen=True)
class Slide(Probe):
    """Place s [m] on its line of a joint that slides, and its rate [m/s] along the line, in the
    columns NAME and NAME_rate.

    s is the arc length from the start of the line in the reference.

    {type: slide, joint: trolley}
    """

    joint: fields.JointName
    calls = ()

    def sense(self, name: str, draft: Draft) -> Output:
        rows = draft.layout.read(
            f"output '{name}'", coordinate_in(f"output '{name}'.joint", draft, self.joint)
        )[[0]]
        return self.output(draft, (name, f"{name}_rate"), [rows])

    def variables(self, dim: int) -> Mapping[str, str]:
        return {"": "m", "rate": "m/s"}

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        return [y[0], v[0]]

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        return [sensed.values[:, 0], sensed.rates[:, 0]]

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        return "m", "m/s"

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        return 1, 2, 0
