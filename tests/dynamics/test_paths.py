"""Which equilibrium is shown: load steps against their path, negative pivots, branches of paths by
arc length.

Sources: Euler's column (exact elastica, by elliptic integrals, Timoshenko and Gere, Theory of
Elastic Stability, 2nd ed., ch. 2.7); von Mises truss (closed form).
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.sparse import csr_array
from scipy.sparse import random as random_array
from scipy.special import ellipe, ellipk

from fmbs_skfem.bodies import sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import cable
from fmbs_skfem.core.algebra import inertia, ranks, saddle
from fmbs_skfem.core.errors import SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import ArcLength, Newton, Trajectory, follow_path, outputs, solve_statics
from fmbs_skfem.dynamics.equilibria import equilibrium
from fmbs_skfem.dynamics.equilibria.loading import ramp
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.compiled import compile_system
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification.statics import truss

from ..models import segment

EULER = np.pi**2 / 4.0  #: of a clamped column of length and bending stiffness 1
ALONG = np.array([np.cos(0.5), 0.0, -np.sin(0.5)])  #: where one is turned to


def elastica(part: float) -> tuple[float, float]:
    """End (x, y) of a column of length 1 at P = part times Euler's load: K(k) = pi/2 sqrt(part), y
    = 2 k / sqrt(P).
    """
    P = part * EULER
    m = brentq(lambda m: ellipk(m) - np.sqrt(P), 1e-9, 1.0 - 1e-9)
    return float(2.0 * ellipe(m) / np.sqrt(P) - 1.0), float(2.0 * np.sqrt(m) / np.sqrt(P))


def column(push: float, part: float = 1.5, cells: int = 20) -> System:
    body = cable("beam", segment(cells), sections.Given(1e6, 1.0, 1.0), dim=2, degree=5)
    end = At("beam", "right")
    load = loads.PointForce("P", end, (-part * EULER, push))
    seen = {"end": probes.Position(end), "angle": probes.Angle(end)}
    return eliminate(
        assemble([body], [joints.Clamp("clamp", At("beam", "left"))], [load], outputs=seen)
    )


def beam_column(EA: float, part: float) -> System:
    """The column as a beam with torsion and shear, turned in space."""
    section = sections.BeamSection(
        np.diag([EA, EA, EA, 0.5, 1.0, 10.0]), np.diag([1.0, 1e-6, 1e-6])
    )
    body, end = (
        beam("beam", segment(4, end=ALONG), section, direction=[0.0, 1.0, 0.0]),
        At("beam", "right"),
    )
    load = loads.PointForce("P", end, tuple(-part * EULER * ALONG))
    seen = {"end": probes.Position(end)}
    return eliminate(
        assemble([body], [joints.Clamp("clamp", At("beam", "left"))], [load], outputs=seen)
    )


def told(system: System, steps: int) -> tuple[Trajectory, list[str]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", Notice)
        return solve_statics(system, steps), [str(one.message) for one in caught]


@pytest.mark.parametrize("push", [1e-2, -1e-2, 1e-4])
@pytest.mark.parametrize("steps", [1, 2, 5, 10])
def test_a_column_goes_the_way_it_is_pushed(steps: int, push: float) -> None:
    """At 1.5 Euler loads: the end lies on the exact elastica, to the side of the push, without a
    warning, and it is stable.
    """
    path, said = told(column(push), steps)
    found = outputs(path)
    x, y = elastica(1.5)
    assert not said
    assert (found["end_x"][-1], found["end_y"][-1]) == pytest.approx(
        (x, np.sign(push) * y), abs=2e-3
    )
    assert path.negative[-1] == 0.0
    assert not path.crossings


@pytest.mark.parametrize("steps", [1, 4, 10])
@pytest.mark.parametrize("load", [4.0, 8.0, 40.0])
def test_a_truss_that_snaps_through_is_told(steps: int, load: float) -> None:
    """Beyond the limit load 3.792 the state leaps between two load factors that enclose it, from no
    negative pivot to none.
    """
    path, said = told(truss(load=load), steps)
    (leap,) = path.crossings
    assert leap.kind == "leap"
    assert leap.before <= 3.7921 / load <= leap.after < leap.before + 0.1
    assert len(said) == 1
    assert "the equilibrium jumps by" in said[0]
    assert "`method: arc_length`" in said[0]


@pytest.mark.parametrize("steps", [1, 4, 10])
def test_a_truss_below_its_limit_load_is_silent(steps: int) -> None:
    path, said = told(truss(load=3.78), steps)
    assert not said
    assert not path.crossings
    assert (path.negative[1:] == 0.0).all()


@pytest.mark.parametrize("reach", [0.05, 0.2, 1.0])
def test_what_leaves_its_path_goes_downhill(reach: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """A truss at 1.05 of its limit load comes to the far root of its cubic, which is stable, with
    corrections of any length.
    """
    monkeypatch.setattr(equilibrium, "DOWNHILL", reach)
    model = compile_system(ramp(truss(load=4.0), 1.0))
    found = equilibrium.settle(
        model, replace(equilibrium.unloaded(model), negative=0), Newton(1e-12), 1.0, "load factor"
    )
    assert found is not None
    assert found.negative == 0
    (w,) = (
        root for root in np.roots([1.0, -0.3, 0.02, -4.0 * 1.01**1.5 / 1e4]) if root.imag == 0.0
    )
    height = (model.system.sensors.matrix @ found.x + model.system.sensors.offset)[
        model.system.outputs["apex"].rows[1]
    ]
    assert height == pytest.approx(0.1 - w.real, abs=1e-10)


def test_downhill_of_what_is_not_known_to_be_stable_there_is_nothing() -> None:
    model = compile_system(ramp(truss(load=4.0), 1.0))
    for negative in (None, 1):
        start = replace(equilibrium.unloaded(model), negative=negative)
        assert equilibrium.settle(model, start, Newton(1e-12), 1.0, "load factor") is None


def test_a_straight_column_passes_its_branch_point() -> None:
    """Without a push it stays straight: one negative pivot from Euler's load on, two from nine
    times that.
    """
    path, _ = told(column(0.0, 12.0), 24)
    expected = (path.times[1:] * 12.0 > 1.0).astype(float) + (path.times[1:] * 12.0 > 9.0)
    np.testing.assert_array_equal(path.negative[1:], expected)
    assert [one.kind for one in path.crossings] == ["branch point"] * 2
    for one, part in zip(path.crossings, (1.0, 9.0), strict=True):
        assert one.before <= part / 12.0 * (1 + 1e-5)
        assert part / 12.0 * (1 - 1e-5) <= one.after


@pytest.mark.parametrize("first", [0.3, 0.1, 0.03])
@pytest.mark.parametrize("branch", ["straight", "other"])
def test_arc_length_takes_the_branch_that_is_asked_for(branch: Any, first: float) -> None:
    """Euler's load is a branch point: straight on, or along the elastica, whatever the number of
    steps.
    """
    path = follow_path(column(0.0), ArcLength(first, branch=branch), Newton(1e-10))
    found, (point,) = outputs(path), path.crossings
    assert path.times[-1] == 1.0
    assert point.kind == "branch point"
    assert point.before - 1e-5 <= 1.0 / 1.5 <= point.after + 1e-5 < point.before + 2e-3
    wanted = elastica(1.5) if branch == "other" else (1.0, 0.0)
    assert (found["end_x"][-1], found["end_y"][-1]) == pytest.approx(wanted, abs=1e-4)
    assert path.negative[-1] == (branch == "straight")


@pytest.mark.parametrize("first", [0.5, 0.1, 0.02])
@pytest.mark.parametrize("push", [1e-2, -1e-5])
def test_arc_length_turns_with_its_path(push: float, first: float) -> None:
    """A small push to the side makes a sharp bend of the branch point, which steps must not pass."""
    path = follow_path(column(push), ArcLength(first), Newton(1e-10))
    x, y = elastica(1.5)
    found = outputs(path)
    assert (found["end_x"][-1], found["end_y"][-1]) == pytest.approx(
        (x, np.sign(push) * y), abs=2e-3
    )
    assert not path.crossings


@pytest.mark.parametrize("EA", [1e4, 1e7])
def test_beams_with_torsion_take_the_branch_that_is_asked_for(EA: float) -> None:
    """Directors count as rotations; round-off near the branch point turns the tangent of a thin one
    towards its other branch.
    """
    path = follow_path(beam_column(EA, 1.1), ArcLength(0.4, branch="other", wanted=10, turn=1.2))
    found, (point,) = outputs(path), path.crossings
    end = np.array([found[f"end_{axis}"][-1] for axis in "xyz"])
    assert (end @ ALONG, np.linalg.norm(np.cross(end, ALONG))) == pytest.approx(
        elastica(1.1), abs=1e-2
    )
    assert point.kind == "branch point"


def test_branch_points_are_found_where_round_off_moves_states() -> None:
    """No correction near the branch point of what is 0.3 mm thick and 1 m long is below the
    tolerance.
    """
    (point,) = follow_path(beam_column(1e8, 1.1), ArcLength(0.3)).crossings
    assert point.before - 1e-4 <= 1.0 / 1.1 <= point.after + 1e-4 <= point.before + 3e-3


def test_other_branches_that_are_not_there() -> None:
    with pytest.warns(
        Notice, match="no branch point lies on the way to the load: `branch: other` does nothing"
    ):
        follow_path(truss(load=2.0), ArcLength(0.2, branch="other"))


def test_a_limit_that_load_steps_cannot_pass_names_arc_length() -> None:
    """A cable pulled apart by what it cannot bear has no equilibrium; the message says how to look
    for one.
    """
    with pytest.raises(SolverError, match="`method: arc_length`"):
        solve_statics(column(1e-2, 1e12), 1)


def test_negative_pivots_are_negative_eigenvalues_on_the_null_space() -> None:
    """Dense, by pivots on the diagonal of sparse factors, and by Haynsworth's complement, of random
    saddle points.
    """
    rng, seen = np.random.default_rng(0), 0
    for trial in range(60):
        n, m = int(rng.integers(3, 50)), int(rng.integers(0, 3))
        A = random_array(n, n, 0.1, rng=rng).toarray()
        K = A + A.T + np.diag(4.0 * (trial % 3) + rng.normal(size=n))
        J = rng.normal(size=(m, n)) * (rng.random((m, n)) < 0.3)
        J[:, :m] += 2.0 * np.eye(m)
        Z = ranks.null_space(J) if m else np.eye(n)
        expected = int((np.linalg.eigvalsh(Z.T @ K @ Z) < 0.0).sum())
        factors = saddle.factor(saddle.matrix(csr_array(K), J))
        assert factors is not None
        assert inertia.count_negative(csr_array(K), J, factors) == expected
        assert inertia.by_complement(csr_array(K), J) in (expected, None)
        seen += inertia.by_complement(csr_array(K), J) is not None
    assert seen > 50


def test_what_has_no_potential_has_no_number() -> None:
    K = csr_array(np.array([[2.0, 1.0], [0.0, 2.0]]))
    factors = saddle.factor(K)
    assert factors is not None
    assert inertia.count_negative(K, np.zeros((0, 2)), factors) is None
