"""Load paths by arc length: exact truss, Lee's frame, follower forces, histories, the same path in
any form of the system.

Sources: von Mises, ZAMM 3 (1923) 406-422, doi 10.1002/zamm.19230030602 (truss, closed form);
`verification.statics` for the others.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.bodies import sections
from fmbs_skfem.core.errors import InputError, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    ArcLength,
    Newton,
    at_load_factor,
    follow_path,
    limit_points,
    outputs,
    solve_statics,
)
from fmbs_skfem.systems import System
from fmbs_skfem.systems.forces import loads
from verification.statics import FINE, cantilever, lee_frame, lee_path, truss, truss_load

from ..cli.calls import fmbs, scene

TIGHT = Newton(tolerance=1e-12)
HEIGHT = 0.1


def deflection(trajectory: Any) -> np.ndarray:
    return np.asarray(HEIGHT - outputs(trajectory)["apex_y"])


@pytest.mark.parametrize("first,wanted", [(0.02, 3), (0.1, 5), (0.4, 8)])
def test_the_path_of_a_truss_is_exact_with_any_steps(first: float, wanted: int) -> None:
    """P(w) is a cubic: up to the limit load, down to its negative, up again beyond the first limit
    load.
    """
    path = follow_path(truss(load=8.0), ArcLength(first, wanted=wanted), TIGHT)
    w = deflection(path)
    np.testing.assert_allclose(truss_load(w), 8.0 * path.times, atol=1e-11)
    assert np.all(np.diff(w) > 0)
    assert path.times[-1] == 1.0
    limits = limit_points(path)
    np.testing.assert_allclose(w[limits], HEIGHT * (1 - np.array([1, -1]) / np.sqrt(3)), rtol=1e-5)
    assert path.times[limits[0]] == path.times[:-1].max()


def test_all_equilibria_at_one_load() -> None:
    """The roots of the cubic that lie on the path, which starts at w = 0."""
    path = follow_path(truss(load=8.0), ArcLength(0.1), TIGHT)
    for factor in (0.3, -0.2, 0.0):
        c = 8.0 * factor * (1 + HEIGHT**2) ** 1.5 / 1e4  # (H - w)(2 H w - w^2) = c
        roots = np.sort(np.roots([1.0, -3 * HEIGHT, 2 * HEIGHT**2, -c]).real)
        np.testing.assert_allclose(
            deflection(at_load_factor(path, factor, TIGHT)), roots[roots > -1e-12], atol=1e-10
        )
    assert len(at_load_factor(path, 0.9).times) == 1
    with pytest.raises(
        InputError,
        match=r"load factor: expected one from -0\.47.* to 1, which the path passes, got 2",
    ):
        at_load_factor(path, 2.0)


def test_load_control_jumps_where_the_path_goes_on() -> None:
    """Load control ends on the far branch of the path as well, and finds none of what lies between."""
    path = follow_path(truss(), ArcLength(0.1), TIGHT)
    with pytest.warns(
        Notice,
        match=r"the equilibrium jumps by 0\.17\d m .* between 0\.47\d+ and 0\.47\d+: .* `method: arc_length`",
    ):
        jumped = solve_statics(truss(), 10, TIGHT)
    np.testing.assert_allclose(jumped.x[-1], path.x[-1], atol=1e-10)
    assert np.all(np.diff(jumped.times) > 0)
    middle = (deflection(path) > 0.05) & (deflection(path) < 0.15)
    assert middle.sum() >= 2
    assert not np.any((deflection(jumped) > 0.05) & (deflection(jumped) < 0.15))


def test_a_path_ends_where_it_first_meets_the_full_load() -> None:
    """The limit load is 3.792: below it the path ends on the near branch, above it on the far one."""
    near, far = (follow_path(truss(load=load), ArcLength(0.1), TIGHT) for load in (3.79, 3.8))
    assert near.times[-1] == far.times[-1] == 1.0
    assert deflection(near)[-1] < 0.0423
    assert len(limit_points(near)) == 0
    assert deflection(far)[-1] > 0.2
    assert len(limit_points(far)) == 2


def test_reactions_follow_the_load_factor() -> None:
    """Sum of the reactions = load, all along, whether constraints are eliminated or kept; both give
    the same path.
    """
    control = ArcLength(0.1, wanted=8, turn=0.6)
    eliminated, kept = (
        follow_path(lee_frame(4, 2.0, form), control, TIGHT) for form in (False, True)
    )
    np.testing.assert_allclose(kept.times, eliminated.times, atol=1e-7)
    for path in (eliminated, kept):
        found = outputs(path)
        np.testing.assert_allclose(found["foot_y"] + found["end_y"], lee_path(path)[0], atol=1e-8)
        np.testing.assert_allclose(found["foot_x"] + found["end_x"], 0.0, atol=1e-8)


def test_load_steps_report_the_reaction_of_their_load() -> None:
    system = cantilever(
        4, lambda end: loads.PointForce("P", end, (0.0, 2.0)), sections.Given(1e4, 1.0, 1.0)
    )
    path = solve_statics(system, 4, TIGHT)
    np.testing.assert_allclose(outputs(path)["clamp_y"], -2.0 * path.times, atol=1e-8)


def growing(t: np.ndarray) -> np.ndarray:
    return 3.0 * t


def test_follower_forces_and_histories() -> None:
    """The force depends on the configuration, and its history is taken at the time asked for."""

    def bent(force: float, history: Any = None) -> System:
        follower = lambda end: loads.Follower("P", end, (0.0, force), history)  # noqa: E731
        return cantilever(8, follower, sections.Given(1e8, 1.0, 1.0), **FINE)

    exact = solve_statics(bent(6.0), 8, TIGHT).x[-1]
    np.testing.assert_allclose(
        follow_path(bent(6.0), ArcLength(0.2), TIGHT).x[-1], exact, atol=1e-9
    )
    np.testing.assert_allclose(
        follow_path(bent(1.0, growing), ArcLength(0.2), TIGHT, time=2.0).x[-1], exact, atol=1e-9
    )
    np.testing.assert_allclose(
        solve_statics(bent(1.0, growing), 8, TIGHT, time=2.0).x[-1], exact, atol=1e-9
    )


def test_progress_and_statistics() -> None:
    seen: list[float] = []
    path = follow_path(truss(), progress=seen.append)
    assert path.statistics.steps == len(path.times) - 1
    assert seen
    assert 0.0 <= min(seen) <= max(seen) <= 1.0


def test_a_path_cut_short_keeps_what_was_found() -> None:
    with pytest.raises(
        SolverError, match=r"load factor 0\.\d+ after 3 points of the path; allow more points"
    ) as caught:
        follow_path(truss(), ArcLength(0.05, points=3), TIGHT)
    partial = caught.value.partial
    assert len(partial.times) == 5
    np.testing.assert_allclose(truss_load(deflection(partial)), 8.0 * partial.times, atol=1e-11)


def test_a_path_needs_a_load() -> None:
    system = cantilever(
        2, lambda end: loads.PointForce("P", end, (0.0, 0.0)), sections.Given(1e4, 1.0, 1.0)
    )
    with pytest.raises(InputError, match="loads: expected loads that move a mass, got none"):
        follow_path(system)


@pytest.mark.parametrize(
    "wrong",
    [
        {"first": 0.0},
        {"first": 1.5},
        {"points": 0},
        {"wanted": 1},
        {"turn": 2.0},
        {"branch": "left"},
    ],
)
def test_wrong_controls(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="arc length"):
        ArcLength(**wrong)


TRUSS = """\
schema: 1
name: truss
dimension: 2
bodies:
  a:
    type: cable
    mesh: {mesh}
    section: &bar {{shape: given, EA: 10 kN, EI: 100, rhoA: 1 kg/m}}
    rotation: 6 deg
  b:
    type: cable
    mesh: {mesh}
    section: *bar
    rotation: -6 deg
    origin: [0.9945218953682733, 0.10452846326765347]
joints:
  foot: {{type: pin, at: a.left, to: ground}}
  other: {{type: pin, at: b.right, to: ground}}
  apex: {{type: pin, at: a.right, to: b.left}}
loads:
  P: {{type: point_force, at: a.right, force: [0, -8 N], history: "{history}"}}
analysis: {analysis}
outputs:
  apex: {{type: position, at: a.right, component: y}}
  foot: {{type: reaction, joint: foot}}
"""


def test_scenes_follow_paths(tmp_path: Path) -> None:
    """`method: arc_length`: column t of outputs.csv is the load factor, which falls behind the
    limit load.
    """
    path = scene(tmp_path, "{type: static, method: arc_length, load_steps: 10}", text=TRUSS)
    call = fmbs("run", path, "--out", tmp_path / "out", "--json")
    assert call.code == 0, call.err
    assert call.json["end"] == 1.0
    t, y, _, foot = np.loadtxt(tmp_path / "out" / "outputs.csv", delimiter=",", skiprows=1).T
    height = np.sin(np.radians(6.0))
    np.testing.assert_allclose(8.0 * t, 1e4 * y * (height**2 - y**2), atol=1e-7)
    np.testing.assert_allclose(foot, 4.0 * t, atol=1e-7)
    assert 8.0 * t[:-1].max() == pytest.approx(1e4 * 2 * height**3 / np.sqrt(27), rel=1e-9)
    assert np.diff(t).min() < 0 < t[1]
