r"""Stresses of bodies of matrices, by the rows that their program has for them.

sigma = S d,    d_b = R^T (q_b - t_b c) - X_b        in the axes of the body, see `terms.corotated`
s_v^2 = ((xx - yy)^2 + (yy - zz)^2 + (zz - xx)^2) / 2 + 3 (xy^2 + yz^2 + zx^2)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from scipy.sparse import eye_array

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
        numbers = [S, own.reference, own.moments, own.unit, own.weights]
        size = body.reference.size
        rows = draft.layout.widen(self.of, eye_array(size, format="csr"))
        columns = (*TENSOR, MEASURE) if len(S) == len(TENSOR) else (MEASURE,)
        parameters = (float(len(S)), *(float(x) for one in numbers for x in one.ravel()))
        return self.output(
            draft, tuple(f"{name}_{one}" for one in columns), [rows], parameters=parameters
        )

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        q = sensed.values.reshape(len(sensed.values), -1, 3)
        b = q.shape[1]
        count = int(output.parameters[0])
        sizes = np.cumsum([3 * b * count, 3 * b, 3 * b, b])
        S, X, moments, unit, weights = np.split(np.array(output.parameters[1:]), sizes)
        center = np.einsum("b,sbc->sc", weights, q)
        x = q - np.einsum("b,sc->sbc", unit, center)
        R = corotated.rotations(x, moments.reshape(b, 3))
        d = np.einsum("sbc,scg->sbg", x, R).reshape(len(q), -1) - X
        stress = (d @ S.reshape(count, -1).T).reshape(len(q), -1, len(TENSOR))
        measure = von_mises(stress).max(axis=1)
        return [*stress[:, 0].T, measure] if count == len(TENSOR) else [measure]

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        b = len(output.rows) // dim
        count = int(output.parameters[0])
        several = count > len(TENSOR)
        return dim * b, 1 if several else len(TENSOR) + 1, 1 + dim * b * (count + 2) + 2 * b


def von_mises(stress: np.ndarray) -> np.ndarray:
    """The von Mises stress (...) of tensors (..., 6), xx, yy, zz, xy, yz, zx."""
    xx, yy, zz, *shear = np.moveaxis(stress, -1, 0)
    normal = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
    return np.asarray(np.sqrt(normal + 3.0 * sum(one**2 for one in shear)))
