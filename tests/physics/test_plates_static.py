"""Static deflections of plates: both corners of a cantilever move alike, very thin plates do not
lock.

Set-ups, references and sources: `verification.statics_shells`.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.dynamics import Trajectory, outputs
from verification.statics_shells import CELLS, THIN, rolled, sheared, square


def corners_move_alike(path: Trajectory) -> None:
    found = outputs(path)
    np.testing.assert_allclose(found["b_z"], found["c_z"], atol=3e-5)
    np.testing.assert_allclose(found["b_x"], found["c_x"], atol=3e-5)
    assert found["b_z"][-2] > 1.0


@pytest.mark.parametrize("kind", CELLS)
def test_cantilever_under_end_shear_does_not_twist(kind: str) -> None:
    corners_move_alike(sheared(kind))


def test_rolled_cantilever_does_not_twist() -> None:
    """Nor does it take many iterations: steps grow behind one that has followed the path (1012 with
    steps of equal length).
    """
    path = rolled("ancf", (24, 3), 4)
    corners_move_alike(path)
    assert path.statistics.iterations < 400


@pytest.mark.parametrize("kind", THIN)
def test_very_thin_clamped_square(kind: str) -> None:
    """t/a = 1e-4 under a uniform load gives the same as t/a = 1e-2: no locking."""
    assert square(kind, THIN[kind], 1e-2, "z") == pytest.approx(
        square(kind, THIN[kind], 1e-4, "z"), rel=1e-7
    )
