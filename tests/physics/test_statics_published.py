"""Load paths of roofs and frames that snap through: what their verification cases do not say.

Source of the table: Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, doi
10.1016/j.finel.2003.11.001, 3.8.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.dynamics import (
    ArcLength,
    Newton,
    Trajectory,
    at_load_factor,
    follow_path,
    limit_points,
    outputs,
    solve_statics,
)
from verification.statics import lee_frame, lee_path
from verification.statics_shells import hinged_roof

TIGHT = Newton(tolerance=1e-12)


def deflection(path: Trajectory) -> np.ndarray:
    return np.asarray(2540.0 - outputs(path)["centre_z"])


def test_the_thin_roof_snaps_back() -> None:
    """Load and deflection fall together between w = 17.008 and 14.451 of the table (largest and
    least of its turning part).
    """
    path = follow_path(hinged_roof(6.35, 4), ArcLength(0.05, wanted=4), TIGHT)
    w, first, second = deflection(path), *limit_points(path)
    falling = slice(first, second + 1)
    assert np.all(np.diff(path.times[falling]) < 0)
    back = w[falling]
    top = int(np.argmax(back[: len(back) // 2 + 1]))
    assert back[top] == pytest.approx(17.008, rel=0.01)
    assert back[top:].min() == pytest.approx(14.451, rel=0.01)
    assert np.diff(back[top:]).min() < 0 < np.diff(w[second:]).min()


def test_the_limit_load_does_not_depend_on_mesh_or_steps() -> None:
    limits = [
        follow_path(hinged_roof(12.7, cells), control, TIGHT)
        for cells, control in (
            (4, ArcLength(0.1)),
            (4, ArcLength(0.03, wanted=4)),
            (8, ArcLength(0.1)),
        )
    ]
    loads = [path.times[limit_points(path)] for path in limits]
    np.testing.assert_allclose(loads[1], loads[0], rtol=1e-9)
    np.testing.assert_allclose(loads[2], loads[0], rtol=1e-3)


def test_load_steps_and_arc_length_meet() -> None:
    """Below the limit load, and on the far branch, where load steps jump to."""
    path = follow_path(hinged_roof(12.7, 4), ArcLength(0.1), TIGHT)
    steps = solve_statics(hinged_roof(12.7, 4), 5, TIGHT)
    near = at_load_factor(path, steps.times[3], TIGHT)
    assert steps.times[3] == pytest.approx(0.6)
    assert len(near.times) == 3
    np.testing.assert_allclose(near.x[0], steps.x[3], rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(path.x[-1], steps.x[-1], rtol=1e-9, atol=1e-7)


def test_deflection_of_the_frame_turns_twice_between_its_limit_loads() -> None:
    path = follow_path(lee_frame(5), ArcLength(0.05), TIGHT)
    P, u, v = lee_path(path)
    first, second = limit_points(path)
    assert P[first] > 1.8 > 0 > -0.9 > P[second]
    assert np.all(np.diff(u[:first]) > 0)
    assert np.flatnonzero(np.diff(np.sign(np.diff(v)))).size == 2
    assert np.abs(np.diff(v[first : second + 1])).sum() > 2 * abs(v[second] - v[first])
