r"""Stresses of groups of points: of solids by their law, of bodies of matrices by the rows that their
program has for them.

sigma = S d,    d_b = R^T (q_b - t_b c) - X_b        in the axes of the body, see `terms.corotated`
s_v^2 = ((xx - yy)^2 + (yy - zz)^2 + (zz - xx)^2) / 2 + 3 (xy^2 + yz^2 + zx^2)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from scipy.sparse import csr_array

from ...bodies.solids import solid_law
from ...core.algebra.linalg import as_dense
from ...core.errors import InputError, closest, listed, say
from ...core.storage.records import dataclass
from ...shapes.solids.solid import Solid
from .. import fields
from ..places import At, Draft
from ..system import Output
from ..terms import corotated
from . import solid_points
from .probes import Probe, Sensed, Sizes
from .solid_points import MEASURE, TENSOR


@dataclass(frozen=True)
class RecoveredStress(Probe):
    """Stress [Pa] of a solid at a group of its nodes, or of a body of matrices at the points of one of
    its `recovery` files.

    Of a solid the largest von Mises stress NAME_von_mises of faces, a set of nodes or a point, the
    largest principal stress NAME_1 and the smallest NAME_3 there, each the mean of the cells at a
    node. Of matrices with one point NAME_xx, NAME_yy, NAME_zz, NAME_xy, NAME_yz, NAME_zx in the axes of the body, and
    NAME_von_mises; of several the largest von Mises stress among them alone.

    {type: recovered_stress, of: rod, group: fillet}
    """

    of: fields.BodyName
    group: Annotated[
        str, "faces or a set of nodes of a solid, or a name among the `recovery` of matrices"
    ]
    unit: ClassVar[str] = "Pa"
    calls = ()

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        body = draft.layout.body(where, At(self.of))
        if isinstance(body.space, Solid):
            found = solid_points.facts(
                where, draft, body, solid_points.group(where, body, self.group)
            )
            largest = (f"{name}_{MEASURE}", f"{name}_1", f"{name}_3")
            return self.output(draft, largest, **found)
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
        if output.law is not None:
            u = solid_points.gradients(sensed)
            return solid_points.largest(solid_points.stresses(output, u))
        count = len(output.parameters)
        rows = sensed.values.reshape(len(sensed.values), count + 1, 3, 3)
        R = corotated.rotations(rows[:, 0].transpose(0, 2, 1))
        stress = np.einsum("skcg,sgc->sk", rows[:, 1:], R) - np.array(output.parameters)
        stress = stress.reshape(len(stress), -1, len(TENSOR))
        measure = solid_law.von_mises(np.moveaxis(stress, -1, 0)).max(axis=1)
        return [*stress[:, 0].T, measure] if count == len(TENSOR) else [measure]

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        if output.law is not None:
            return 3 * len(output.place), 3, output.law.rows - 1
        count = len(output.parameters)
        return 9 * (count + 1), len(TENSOR) + 1 if count == len(TENSOR) else 1, None
