"""Runs in threads against single runs: the same motion bit by bit, and errors that stay with their
member.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fmbs_skfem.bodies import body
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, integrate, integrate_many
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.prepared import prepare

from .. import models

SCHEME = GeneralizedAlpha(5e-4)


def driven(rate: float, growth: float = 0.0, end: float = np.inf) -> System:
    """Planar beam on 4 cells, turned by a driven angle; the force at its tip may grow, and is no
    number after `end`.
    """
    beam = body.cable("beam", models.segment(4), models.SECTION, models.MATERIAL, dim=2)
    root, tip = At("beam", "left"), At("beam", "right")
    held: list[joints.Joint] = [
        joints.Pin("pin", root),
        joints.DrivenAngle("drive", root, lambda t: rate * t**3),
    ]

    def history(t: np.ndarray) -> np.ndarray:
        return np.where(t > end, np.nan, np.sin(rate * t) * np.exp(growth * t))

    push = loads.PointForce("push", tip, (0.0, 0.02), history)
    return eliminate(assemble([beam], held, [push]))


def test_numbers_that_differ_share_what_follows_from_the_others() -> None:
    """Members of a family, as `replace` makes them, are prepared together; one that was prepared
    before keeps what it knows.
    """
    first, own = driven(3.0), driven(4.0)
    known = prepare(own)
    loads_of = replace(first.loads, constant=2.0 * first.loads.constant)
    family = [first, replace(first, loads=loads_of), own]
    found = integrate_many(family, SCHEME, 0.01, threads=2)
    assert prepare(family[1]) is prepare(first)
    assert prepare(own) is known
    for one, system in zip(found, family, strict=True):
        assert_equal(one, integrate(replace(system), SCHEME, 0.01))


@cache
def systems() -> tuple[System, ...]:
    """Another structure, then one at four rates."""
    return eliminate(models.double_pendulum(3)), *(driven(rate) for rate in (3.0, 4.0, 5.0, 8.0))


def assert_equal(found: object, wanted: Trajectory) -> None:
    assert isinstance(found, Trajectory)
    for name in ("times", "x", "v", "multipliers"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))


@pytest.mark.parametrize("threads", [1, 3])
def test_members_move_as_if_they_were_alone(threads: int) -> None:
    done: list[float] = []
    found = integrate_many(systems(), SCHEME, 0.05, every=20, threads=threads, progress=done.append)
    for one, system in zip(found, systems(), strict=True):
        assert_equal(one, integrate(system, SCHEME, 0.05, every=20))
    assert done == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])


def test_every_member_may_have_its_own_scheme() -> None:
    schemes = [
        GeneralizedAlpha(1e-3, 0.8),
        GeneralizedAlpha(5e-4, 0.8),
        GeneralizedAlpha(1e-3, 0.2),
    ]
    found = integrate_many([driven(3.0)] * 3, schemes, 0.1, every=50, threads=2)
    for one, scheme in zip(found, schemes, strict=True):
        assert_equal(one, integrate(driven(3.0), scheme, 0.1, every=50))


def test_a_member_that_fails_does_not_hurt_the_others() -> None:
    """A force that grows e-fold every 0.5 ms ends its member with the error of a single run; the
    others do not notice.
    """
    members = [driven(3.0), driven(3.0, 2000.0), driven(5.0)]
    found = integrate_many(members, GeneralizedAlpha(1e-3), 0.4, every=10, threads=2)
    with np.errstate(over="ignore"), pytest.raises(SolverError) as caught:
        integrate(members[1], GeneralizedAlpha(1e-3), 0.4, every=10)
    error = found[1]
    assert isinstance(error, SolverError)
    assert str(error) == str(caught.value)
    np.testing.assert_array_equal(error.partial.x, caught.value.partial.x)
    for k in (0, 2):
        assert_equal(found[k], integrate(members[k], GeneralizedAlpha(1e-3), 0.4, every=10))


def test_a_history_that_is_no_number_ends_its_member() -> None:
    """From a time on, where the motion up to there is kept, or from the beginning, where there is
    no start.
    """
    members = [driven(3.0), driven(3.0, end=0.0305), driven(5.0), driven(np.nan)]
    found = integrate_many(members, GeneralizedAlpha(1e-3), 0.05)
    assert [type(one) for one in found] == [Trajectory, SolverError, Trajectory, SolverError]
    assert [found[k].reason for k in (1, 3)] == [Reason.NOT_FINITE] * 2  # type: ignore[union-attr]
    assert [len(motion.times) for motion in (found[0], found[1].partial, found[2])] == [51, 31, 51]  # type: ignore[union-attr]


def test_no_members_and_wrong_arguments() -> None:
    assert integrate_many([], SCHEME, 1.0) == []
    with pytest.raises(InputError, match="schemes"):
        integrate_many(systems(), [SCHEME], 0.1)
    with pytest.raises(InputError, match="at least one step"):
        integrate_many([driven(3.0)], SCHEME, 1e-5)
    with pytest.raises(InputError, match="threads"):
        integrate_many(systems(), SCHEME, 0.1, threads=0)
