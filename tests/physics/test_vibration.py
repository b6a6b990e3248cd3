"""Vibration modes of beams: error of cubic cells, shapes, refusals; frequencies are in
`verification.vibration`.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.dynamics import vibration_modes
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from verification.vibration import ROOTS, beam, frequencies

CLASSICAL = [supports for supports in ROOTS if supports != "clamped-guided"]


@pytest.mark.parametrize("supports", CLASSICAL)
def test_error_of_cubic_cells(supports: str) -> None:
    """Cubic Hermite functions: omega is too large by the factor 1 + (beta h)^4/1440, for C1 splines
    and ANCF alike.
    """
    roots = np.array(ROOTS[supports])[:4]
    for options in ({}, {"ancf": True}):
        excess = frequencies(supports, 20, **options)[:4] / roots**2 - 1
        np.testing.assert_allclose(excess, (roots / 20) ** 4 / 1440, rtol=0.1)


def test_shapes_are_normalised_and_satisfy_the_joints() -> None:
    system = eliminate(beam("clamped-pinned", 10))
    modes = vibration_modes(system, 4)
    np.testing.assert_allclose(modes.shapes.T @ system.mass @ modes.shapes, np.eye(4), atol=1e-10)
    kept = vibration_modes(beam("clamped-pinned", 10), 4)
    np.testing.assert_allclose(kept.angular_frequencies, modes.angular_frequencies, rtol=1e-8)


def test_there_are_as_many_modes_as_motions() -> None:
    held = beam("clamped-free", 4)
    assert vibration_modes(held, 1000).shapes.shape == (
        held.size,
        held.size - len(held.constraints.names),
    )


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_frequencies_do_not_depend_on_the_unit_of_length(size: float) -> None:
    """A clamped beam whose rows hold positions and slopes, in another unit: EI L^-4 / rhoA is the
    same.
    """
    section = sections.Given(EA=1e6 * size**2, EI=size**4, rhoA=1.0)
    held = [joints.Clamp("left", At("beam", "left")), joints.Pin("pin", At("beam", "left"))]
    part = body.cable("beam", segment(16, end=(size, 0.0, 0.0)), section, dim=2, ancf=True)
    found = vibration_modes(assemble([part], held), 3).angular_frequencies
    np.testing.assert_allclose(found, np.square(ROOTS["clamped-free"][:3]), rtol=1e-3)
