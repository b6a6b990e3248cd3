"""Tangents with the axial forces of the accepted state: coarse steps of slender beams that turn far
need no parts.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.bodies.body import cable
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, integrate, outputs
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures import probes

from .. import models


def swing(dim: int, steps: int) -> tuple[Trajectory, np.ndarray]:
    """A double pendulum of two beams of a metre that falls for 1.5 s, and its free end (s, c) [m]."""
    beams = [
        cable(
            f"b{k}",
            models.segment(6, (k, 0, 0), (k + 1, 0, 0)),
            models.SECTION,
            models.MATERIAL,
            dim=dim,
        )
        for k in range(2)
    ]
    pins = [joints.Pin("O", At("b0", "left")), joints.Pin("A", At("b0", "right"), At("b1", "left"))]
    down = [0.0] * (dim - 1) + [-9.81]
    tip = {"tip": probes.Position(At("b1", "right"))}
    system = eliminate(assemble(beams, pins, [loads.Gravity(tuple(down))], outputs=tip))
    motion = integrate(system, GeneralizedAlpha(1.5 / steps), 1.5)
    return motion, np.stack(list(outputs(motion).values()), axis=1)


@pytest.mark.parametrize("dim", [2, 3])
def test_coarse_steps_need_no_parts(dim: int) -> None:
    """With the stresses of its guesses the motion in space is divided some 80 times, and takes 2300
    corrections.
    """
    coarse, tip = swing(dim, 60)
    _, fine = swing(dim, 1920)

    assert coarse.statistics.halved <= 2
    assert coarse.statistics.iterations <= 10 * 60
    assert np.abs(tip - fine[::32]).max() < 0.05
