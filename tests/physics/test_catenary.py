"""What the cables of `verification.beams.hanging_chain` start from, and their weight."""

from __future__ import annotations

import numpy as np
import pytest

from verification.beams import HANGING, Hanging, sagging_arc, solve_hanging


@pytest.mark.parametrize("cable", HANGING)
def test_the_first_shape_has_the_ends_and_the_length(cable: Hanging) -> None:
    points = sagging_arc(cable, 400)
    np.testing.assert_allclose(
        points[[0, -1]], [[0, 0, 0], [cable.span, -cable.drop, 0]], atol=1e-12
    )
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(
        cable.length, rel=1e-5
    )


@pytest.mark.parametrize("cable", [cable for cable in HANGING if cable.drop == 0])
def test_each_end_carries_half_the_weight(cable: Hanging) -> None:
    assert solve_hanging(cable, 1e-5)[0][1] == pytest.approx(
        0.5 * cable.weight * cable.length, rel=1e-6
    )
