r"""Stresses of bodies of matrices, by the rows that their program has for them.

sigma = S d,    d_b = R^T (q_b - t_b c) - X_b        in the axes of the body, see `terms.corotated`
s_v^2 = ((xx - yy)^2 + (yy - zz)^2 + (zz - xx)^2) / 2 + 3 (xy^2 + yz^2 + zx^2)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from scipy.sparse import csr_array

from ...core.algebra.linalg import as_dense
from ...core.errors import InputError, closest, listed, say
from ...core.storage.records import dataclass
from .. import fields
from ..places import At, Draft
from ..system import Output
from ..terms import corotated
from .probes import Probe, Sensed, Sizes

TENSOR = ("xx", "yy", "zz", "xy", "yz", "zx")
MEASURE = "von_mises"


@dataclass(frozen=True)
class RecoveredStress(Probe):
    """Stress [Pa] of a body of matrices at the points of one of its `recovery` files.

    Of one point NAME_xx, NAME_yy, NAME_zz, NAME_xy, NAME_yz, NAME_zx in the axes of the body, and
    NAME_von_mises; of several the largest von Mises stress among them alone.

    {type: recovered_stress, of: rod, group: fillet}
    """

    of: fields.BodyName
    group: Annotated[str, "a name among the `recovery` of the body"]
    unit: ClassVar[str] = "Pa"
    calls = ()

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        body = draft.layout.body(where, At(self.of))
        if body.linear is None or self.group not in body.recovery:
            expected = f"one of the recovery files of a body of matrices ({listed(sorted(body.recovery), self.group, 'none')})"
            raise InputError(
                say(where, expected, f"'{self.group}'") + closest(self.group, body.recovery)
            )
        S = as_dense(body.recovery[self.group])
        own = corotated.of_body(body.linear, body.mass, body.reference, body.constant)
        by_component = S.reshape(len(S), -1, 3).transpose(0, 2, 1)
        # without the stress of a translation, which a file may have by its digits
        by_component = by_component - (by_component @ own.unit)[..., None] * own.weights
        rows = np.vstack([own.moments.T, by_component.reshape(3 * len(S), -1)])
        columns = (*TENSOR, MEASURE) if len(S) == len(TENSOR) else (MEASURE,)
        return self.output(
            draft,
            tuple(f"{name}_{one}" for one in columns),
            [draft.layout.spread(body, csr_array(rows))],
            parameters=tuple((S @ own.reference.ravel()).tolist()),
        )

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        count = len(output.parameters)
        rows = sensed.values.reshape(len(sensed.values), count + 1, 3, 3)
        R = corotated.rotations(rows[:, 0].transpose(0, 2, 1))
        stress = np.einsum("skcg,sgc->sk", rows[:, 1:], R) - np.array(output.parameters)
        stress = stress.reshape(len(stress), -1, len(TENSOR))
        measure = von_mises(stress).max(axis=1)
        return [*stress[:, 0].T, measure] if count == len(TENSOR) else [measure]

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        count = len(output.parameters)
        return 9 * (count + 1), len(TENSOR) + 1 if count == len(TENSOR) else 1, None


def von_mises(stress: np.ndarray) -> np.ndarray:
    """The von Mises stress (...) of tensors (..., 6), xx, yy, zz, xy, yz, zx."""
    xx, yy, zz, *shear = np.moveaxis(stress, -1, 0)
    normal = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
    return np.asarray(np.sqrt(normal + 3.0 * sum(one**2 for one in shear)))
