"""What systems of one structure share: the same bits as without it, found once, anew where a part
is another one, and bounded.
"""

from __future__ import annotations

import gc
import weakref
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, histories, integrate
from fmbs_skfem.dynamics.diagnoses import step_size
from fmbs_skfem.reduction import affine
from fmbs_skfem.reduction.affine import ParametricCase
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.parameters import Parameter
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.compiled import compile_system
from fmbs_skfem.systems.connections import joints, redundancy
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.prepared import Prepared, alike, prepare
from fmbs_skfem.systems.terms import turning
from tests import models
from tests.systems.test_corotation import complete

SCHEME, DURATION = GeneralizedAlpha(1e-3), 0.1
BOX = (
    Parameter("E", 5e8, 2e9, unit="Pa", value=1e9),
    Parameter("rho", 1000.0, 3000.0, unit="kg/m^3", value=1800.0),
)
POINTS = [
    {"E": 6e8, "rho": 1100.0},
    {"E": 1e9, "rho": 1800.0},
    {"E": 1.7e9, "rho": 1100.0},
    {"E": 6e8, "rho": 2900.0},
]
REST = {"E": 1e9, "rho": 1800.0}
RISING = of_time("3 * t**2")
Angle = Callable[[np.ndarray], np.ndarray]


def driven(values: Mapping[str, float] = REST, angle: Angle = RISING, *more: Any) -> System:
    """A beam driven about its end under its weight, in all its coordinates as a dense basis;
    further joints and loads.
    """
    beam = body.cable(
        "beam",
        models.segment(4),
        models.SECTION,
        sections.Material(values["E"], values["rho"]),
        dim=2,
    )
    root, tip = At("beam", "left"), At("beam", "right")
    held = [joints.Pin("hinge", root), joints.DrivenAngle("drive", root, angle)]
    pushes = [loads.Gravity((0.0, -9.81)), *more]
    return complete(
        assemble([beam], held, pushes, outputs={"tip": probes.Position(tip), "E": probes.Energy()})
    )


@pytest.fixture(scope="module")
def family() -> ParametricCase:
    return affine.fit(lambda values: Case(driven(values), SCHEME, DURATION), BOX)


def alone(system: System) -> System:
    """A copy, which shares nothing with any other system."""
    return replace(system)


def same_bits(one: Trajectory, two: Trajectory) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(two, name))
        for name in ("times", "x", "v", "a", "multipliers")
    )


def test_members_share_what_they_have_in_common_and_move_to_the_bit_as_alone(
    family: ParametricCase,
) -> None:
    assert len(compile_system(family.nominal.system).arrays.corotation.table) == 1
    for values in (*POINTS, POINTS[0]):
        system = family(values).system
        assert prepare(system) is prepare(family.nominal.system)
        assert prepare(alone(system)) is not prepare(system)
        assert same_bits(
            integrate(system, SCHEME, DURATION), integrate(alone(system), SCHEME, DURATION)
        )


def test_what_no_number_changes_is_found_once(
    family: ParametricCase, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls, fresh = (
        Counter[str](),
        replace(family, nominal=replace(family.nominal, system=alone(family.nominal.system))),
    )
    watched = (
        *(
            (redundancy, name)
            for name in ("redundant_rows", "redundant_linear_rows", "large_changes")
        ),
        (turning, "find_turning"),
        *(
            (histories, "leading_signals"),
            (step_size, "integrals"),
            (step_size, "drives_that_jump"),
        ),
    )

    def counted(name: str, call: Callable[..., Any], *args: Any) -> Any:
        calls[name] += 1
        return call(*args)

    for owner, name in watched:
        monkeypatch.setattr(owner, name, partial(counted, name, getattr(owner, name)))
    for values in POINTS:
        integrate(fresh(values).system, SCHEME, DURATION)
    assert calls == dict.fromkeys((name for _, name in watched), 1)


def test_histories_are_found_once_wherever_they_act(monkeypatch: pytest.MonkeyPatch) -> None:
    """A parameter that moves a place makes other probes, of which histories know nothing."""
    made = []
    for owner, name in (
        (histories, "leading_signals"),
        (step_size, "integrals"),
        (step_size, "drives_that_jump"),
    ):
        made.append(Mock(wraps=getattr(owner, name)))
        monkeypatch.setattr(owner, name, made[-1])
    system = driven()
    moved = alike(
        prepare(system),
        replace(system, probes=replace(system.probes, offset=system.probes.offset.copy())),
    )
    assert same_bits(integrate(system, SCHEME, DURATION), integrate(moved, SCHEME, DURATION))
    assert [one.call_count for one in made] == [1, 1, 1]


def test_another_step_and_duration_find_their_own_histories(family: ParametricCase) -> None:
    system = family(POINTS[0]).system
    for scheme, duration in (
        (SCHEME, DURATION),
        (GeneralizedAlpha(2e-3), DURATION),
        (SCHEME, 0.05),
        (SCHEME, DURATION),
    ):
        assert same_bits(
            integrate(system, scheme, duration), integrate(alone(system), scheme, duration)
        )


def test_another_structure_is_not_served_from_the_memory() -> None:
    """Another history, an added force, another start: each is that of the system, whatever it
    shares.
    """
    known = prepare(driven())
    others = [
        driven(),
        driven(REST, of_time("2 * t**2")),
        driven(REST, RISING, loads.PointForce("push", At("beam", "right"), (0.0, 5.0))),
        driven(REST, RISING, loads.TorsionSpring("spring", At("beam", "right"), stiffness=5.0)),
    ]
    others.append(replace(others[0], v0=others[0].v0 + 0.0, x0=others[0].x0.copy()))
    seen = list[np.ndarray]()
    for system in (*others, *others):
        found = integrate(alike(known, alone(system)), SCHEME, DURATION)
        assert same_bits(found, integrate(alone(system), SCHEME, DURATION))
        seen.append(found.x)
    assert all(np.abs(seen[0] - x).max() > 1e-6 for x in seen[1:4])


def linked(place: float) -> System:
    """A bar on two links of equal length and direction, the second from another place of the bar:
    one of them, if that is none.
    """
    bar = rigid("bar", 1.0, 0.1, (0.0, 0.0), dim=2, places={"a": (0.0, 0.0), "b": (place, 0.0)})
    held = [
        joints.RigidLink(name, At("bar", at), (x, 1.0), 1.0)
        for name, at, x in (("one", "a", 0.0), ("two", "b", place))
    ]
    return eliminate(assemble([bar], held, [loads.Gravity((1.0, -9.81))]))


def test_a_number_that_makes_a_joint_redundant() -> None:
    """Beside members where it is not, in both orders; what is left out is known of the next one,
    and a notice says it again.
    """
    apart, one = linked(0.5), linked(0.0)
    for first, second in ((apart, one), (one, apart)):
        known = Prepared()
        for system in (first, second, first):
            own = alike(known, alone(system))
            if system is apart:
                assert redundancy.without_redundant(own) is own
            else:
                with pytest.warns(Notice, match="redundant constraint rows are left out"):
                    left = redundancy.without_redundant(own)
                assert len(left.constraints.names) == len(own.constraints.names) - 1
    with pytest.warns(Notice, match="redundant"):
        left, again = (
            redundancy.without_redundant(alike(prepare(one), alone(one))) for _ in range(2)
        )
    assert left is not again
    assert left.constraints is again.constraints
    assert prepare(left) is prepare(again)
    with pytest.warns(Notice, match="redundant"):
        assert same_bits(
            integrate(alike(prepare(one), alone(one)), SCHEME, DURATION),
            integrate(alone(one), SCHEME, DURATION),
        )


def test_functions_of_python_are_read_again() -> None:
    """A file cannot hold them: they may give other values in another run, of the same system, too."""
    rate = [3.0]
    system = driven(REST, lambda t: rate[0] * t**2)
    before = integrate(system, SCHEME, DURATION)
    rate[0] = 2.0
    after = integrate(system, SCHEME, DURATION)
    assert np.abs(after.x - before.x).max() > 1e-3
    assert same_bits(after, integrate(driven(REST, lambda t: 2.0 * t**2), SCHEME, DURATION))


def test_memory_does_not_grow_with_calls(family: ParametricCase) -> None:
    """One entry a name, whose parts are those of the last member; members that nobody holds are
    gone.
    """

    def call(k: int) -> weakref.ref[System]:
        system = family({"E": 6e8 + 1e7 * k, "rho": 1100.0 + 10.0 * k}).system
        integrate(system, GeneralizedAlpha(DURATION / (60 + k)), DURATION)
        return weakref.ref(system)

    known = prepare(family.nominal.system)
    few = [call(k) for k in range(3)]
    size = len(known.known), len(known.known["signals"][1]) <= 32
    many = [call(k) for k in range(3, 12)]
    gc.collect()
    assert size == (len(known.known), len(known.known["signals"][1]) <= 32)
    assert size[1]
    assert [one() for one in (*few, *many)] == [None] * 12


def test_parts_are_known_by_identity_and_numbers_by_value() -> None:
    known, made, a, b = Prepared(), list[int](), np.zeros(2), np.zeros(2)

    def find(*parts: Any) -> int:
        return known.find("name", parts, lambda: made.append(len(made)) or made[-1])

    assert [
        find(a, 1.0),
        find(a, 1.0),
        find(b, 1.0),
        find(a, 1.0),
        find(a, 2.0),
        find(a, 2),
        find(a),
    ] == [0, 0, 1, 2, 3, 4, 5]
