"""Every registered case meets its references; the registry refuses what is no case."""

from __future__ import annotations

import math

import pytest

import verification
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from verification import CASES, GROUPS, CheckedNumber, VerificationCase, farthest, order, registry


@pytest.mark.parametrize("name", CASES)
def test_case(name: str) -> None:
    outcome = verification.run(CASES[name])
    assert outcome.error == ""
    assert outcome.quantities
    off = [
        f"{q.name}: {q.value!r}, expected {q.reference!r} to {q.tolerance:g}"
        for q in outcome.quantities
        if not q.holds
    ]
    assert off == []


def test_every_group_has_cases_and_every_case_a_source() -> None:
    assert {case.group for case in CASES.values()} == set(GROUPS)
    assert all(len(case.source) > 10 and case.about.endswith(".") for case in CASES.values())


@pytest.mark.parametrize(
    "reference,value,scale,difference",
    [
        (2.0, 2.1, 0.0, 0.05),
        (0.0, 0.1, 4.0, 0.025),
        (0.0, 0.1, 0.0, 0.1),
        (-2.0, -1.0, 1.0, 0.5),
        (1.0, math.nan, 0.0, math.inf),
    ],
)
def test_difference_of_a_quantity(
    reference: float, value: float, scale: float, difference: float
) -> None:
    found = CheckedNumber("q", reference, value, 0.04, scale=scale)
    assert found.difference == pytest.approx(difference)
    assert found.holds == (difference <= 0.04)


def test_farthest_entry_of_a_table() -> None:
    whole = farthest("t", [1.0, 100.0], [1.1, 100.5], 1e-2)
    assert (whole.reference, whole.value) == (100.0, 100.5)
    assert whole.difference == pytest.approx(5e-3)
    each = farthest("t", [1.0, 100.0], [1.1, 100.5], 1e-2, each=True)
    assert (each.reference, each.value) == (1.0, 1.1)
    assert each.difference == pytest.approx(0.1)
    assert not farthest("t", [1.0, 2.0], [1.0, math.nan], 1.0).holds


def test_order_of_errors() -> None:
    found = order("o", (0.4, 0.2, 0.1), (9.0, 8e-3, 1e-3), 3.0, 1e-9)
    assert found.value == pytest.approx(3.0, rel=1e-12)
    assert found.holds
    assert found.order == found.value
    assert found.curve == ((0.4, 9.0), (0.2, 8e-3), (0.1, 1e-3))


def test_a_solver_that_fails_is_an_outcome() -> None:
    def fails() -> list[CheckedNumber]:
        raise SolverError("no equilibrium", Reason.DIVERGED)

    outcome = verification.run(VerificationCase("x", "statics", "none", "It fails.", fails))
    assert outcome.error == "no equilibrium"
    assert not outcome.holds


def test_bad_cases_are_refused() -> None:
    name = next(iter(CASES))
    with pytest.raises(InputError, match="one of the groups"):
        registry.case("new", group="optics", source="none")
    with pytest.raises(InputError, match="no other case has"):
        registry.case(name, group="statics", source="none")

    def silent() -> list[CheckedNumber]:
        return [CheckedNumber("q", 1.0, 1.0, 1.0)]

    with pytest.raises(InputError, match="docstring"):
        registry.case("new", group="statics", source="none")(silent)
    assert "new" not in CASES


def test_cases_are_found_by_name_and_group() -> None:
    assert len(verification.find()) == len(CASES)
    assert [case.name for case in verification.find(["coefficients"])] == ["coefficients"]
    assert {case.group for case in verification.find(groups=["rigid"])} == {"rigid"}
    with pytest.raises(InputError, match="did you mean 'coefficients'"):
        verification.find(["coeficients"])
    with pytest.raises(InputError, match="did you mean 'rigid'"):
        verification.find(groups=["rigit"])
