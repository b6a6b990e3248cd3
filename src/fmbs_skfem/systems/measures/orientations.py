"""How a place has turned since the reference, as an output."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.sparse import vstack

from ...core.storage.records import dataclass
from ...core.values.fields import AXES
from .. import fields
from ..connections.constraint_functions import rows_of
from ..places import Draft
from ..system import Output
from .probes import Formula, Probe, Sensed, Sizes


@dataclass(frozen=True)
class Rotation(Probe):
    """Rotation matrix R of a place since the reference [-], row by row: NAME_xx, NAME_xy, ...,
    where NAME_xy is x of the y axis.

    Column j is the vector that was the axis j of the scene in the reference, as the place takes it
    along: a frame or a section of a beam turns it, R^T R = 1, the slope of a line in the plane
    stretches it as well.

    {type: rotation, at: rotor.frame}
    """

    at: fields.Place
    calls = ()

    def sense(self, name: str, draft: Draft) -> Output:
        layout = draft.layout
        axes = AXES[: draft.layout.dim]
        carried = vstack(
            [rows_of(f"output '{name}'", layout, self.at, axis) for axis in np.eye(layout.dim)],
            format="csr",
        )
        by_row = np.arange(len(axes) ** 2).reshape(len(axes), -1).T.ravel()
        return self.output(
            draft, tuple(f"{name}_{i}{j}" for i in axes for j in axes), [carried[by_row]]
        )

    def variables(self, dim: int) -> Mapping[str, str]:
        return {f"{i}{j}": self.unit for i in AXES[:dim] for j in AXES[:dim]}

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        return list(y)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        return list(sensed.values.T)

    @classmethod
    def formula(cls, output: Output, dim: int) -> Formula:
        return lambda values, rates, accelerations: list(values)

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        return dim**2, dim**2, 0
