"""Models whose joints hold everything: what is left to find are reactions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies.body import point_mass
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    buckling,
    integrate,
    outputs,
    solve_statics,
    vibration_modes,
)
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes


def held(dim: int, *more: joints.Joint) -> System:
    """Two points of 2 and 3 kg that are pinned to the ground."""
    parts = [
        point_mass(name, mass, np.array((0.3, -0.1, mass)[:dim]))
        for name, mass in (("a", 2.0), ("b", 3.0))
    ]
    pins = [joints.Pin("pin a", At("a")), joints.Pin("pin b", At("b")), *more]
    sensed = {
        "a": probes.Reaction("pin a"),
        "b": probes.Reaction("pin b"),
        "at": probes.Position(At("b")),
    }
    return eliminate(
        assemble(parts, pins, [loads.Gravity((0.0, -10.0, 0.0)[:dim])], outputs=sensed)
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_reactions_are_the_weight_in_motions_and_at_rest(dim: int) -> None:
    system = held(dim)
    for motion in (integrate(system, GeneralizedAlpha(1e-3), 3e-3), solve_statics(system, 2)):
        found = outputs(motion)
        assert_allclose([found["a_y"][-1], found["b_y"][-1]], [20.0, 30.0], rtol=1e-12)
        assert_allclose(
            [found[f"at_{c}"][-1] for c in "xyz"[:dim]], (0.3, -0.1, 3.0)[:dim], atol=1e-15
        )


def test_nothing_vibrates_or_buckles() -> None:
    with pytest.raises(
        InputError, match="expected motions that the joints leave, got none; release a joint"
    ):
        vibration_modes(held(2), 1)
    with pytest.raises(
        InputError, match="expected a system that can move, got one whose joints leave no motion"
    ):
        buckling(held(2), 1)


def test_rows_that_others_hold_are_left_out() -> None:
    """With the warning that other models have."""
    with pytest.warns(Notice, match="redundant constraint rows are left out .* again.x, again.y"):
        system = held(2, joints.Pin("again", At("b")))
    assert outputs(integrate(system, GeneralizedAlpha(1e-3), 1e-3))["b_y"][-1] == pytest.approx(
        30.0
    )
