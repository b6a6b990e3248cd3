"""Rigid motions cost no energy; stiff chains of beams that move like rigid bodies are in
`verification.rigid`.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.bodies import body
from fmbs_skfem.systems import assemble, compile_system
from fmbs_skfem.systems.compiled import forces

from .. import models


@pytest.mark.parametrize("ancf", [False, True])
def test_no_force_in_a_rotated_and_shifted_beam(ancf: bool) -> None:
    beam = body.cable("beam", models.segment(8), models.SECTION, models.MATERIAL, ancf=ancf)
    system = assemble([beam])
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    q = beam.reference @ turn.T + np.outer(beam.constant, [3.0, -2.0, 1.0])
    model = compile_system(system)
    largest = np.abs(
        forces(model, 1.001 * system.x0, np.zeros(system.size))
    ).max()  # of a stretch by 0.1 %
    assert np.abs(forces(model, q.ravel(), np.zeros(system.size))).max() < 1e-9 * largest
