"""A run that is stopped and taken up again ends in the same bits as one that was never stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.core import machine_memory
from fmbs_skfem.core.errors import CorruptFile, SolverError
from fmbs_skfem.core.values.profiles import MotionLimits, Move, motion
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.dynamics.checkpoint import Checkpoint, Resumed, Rows, RunState
from fmbs_skfem.systems import At, System, eliminate
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.system import change_coordinates

from .. import models
from .test_large import hanging

SCHEME = GeneralizedAlpha(1e-3)
STEPS = 200


class Enough(Exception):
    """Raised by a record that has what it wants."""


def stopped(
    system: System, after: int, scheme: GeneralizedAlpha = SCHEME, steps: int = STEPS, **more: Any
) -> Resumed:
    """What is known of a run at the first look at it after so many steps; the run ends there."""
    found: list[tuple[Rows, Checkpoint]] = []

    def record(moment: RunState) -> None:
        if moment.done >= after:
            found.append((moment.rows(0, moment.kept), moment.checkpoint()))
            raise Enough

    with pytest.raises(Enough):
        integrate(system, scheme, steps * scheme.step, record=record, **more)
    rows, checkpoint = found[0]
    assert after <= checkpoint.done < steps
    assert checkpoint.kept == len(rows.x)
    return Resumed(checkpoint, rows)


def assert_same(one: Trajectory, other: Trajectory) -> None:
    """The same bits in all states, and the same work for them."""
    for name in ("times", "x", "v", "a", "multipliers", "work"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    counts = [
        (
            t.statistics.steps,
            t.statistics.iterations,
            t.statistics.factorisations,
            t.statistics.halved,
        )
        for t in (one, other)
    ]
    assert counts[0] == counts[1]
    assert one.statistics.solver == other.statistics.solver


def all_modes(system: System) -> System:
    """The same in dense coordinates, as a reduced model: its factors take up secants."""
    return change_coordinates(system, np.eye(system.size), np.zeros(system.size))


SYSTEMS: dict[str, Callable[[], System]] = {
    "band": lambda: models.double_pendulum(12),
    "band with multipliers": lambda: models.double_pendulum(12, all_multipliers=True),
    "dense": lambda: models.spin_up(4),
    "driven": lambda: models.spin_up(20, all_multipliers=True),
    "corners of a drive": lambda: models.turned_by(
        motion("trapezoidal", [Move(0.6)], start=0.0603, limits=MotionLimits(6.0, 60.0))
    ),
    "secants": lambda: all_modes(models.double_pendulum(4)),
    "turned tangents": models.thrown_plate_part,
    "one mass": lambda: models.mass_pendulum((-1.0, 0.0)),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_split_run_has_the_bits_of_an_unbroken_one(name: str) -> None:
    """Two splits, one of them in the second part of the other; the unbroken run is not watched at
    all.
    """
    system = SYSTEMS[name]()
    whole = integrate(system, SCHEME, STEPS * SCHEME.step, every=3)
    first = stopped(system, 1, every=3)
    assert_same(integrate(system, SCHEME, STEPS * SCHEME.step, every=3, resume=first), whole)
    second = stopped(system, 60, every=3, resume=first)
    assert first.checkpoint.done < second.checkpoint.done
    assert_same(integrate(system, SCHEME, STEPS * SCHEME.step, every=3, resume=second), whole)


@pytest.mark.parametrize(
    "form", [eliminate, lambda system: system], ids=["eliminated", "multipliers"]
)
def test_a_split_between_re_used_factors_keeps_them(form: Callable[[System], System]) -> None:
    """Factors of example 2 serve several steps: they are kept, and no new ones are made because of
    a split.
    """
    system = form(models.double_pendulum(12, all_multipliers=True))
    whole = integrate(system, SCHEME, STEPS * SCHEME.step)
    assert whole.statistics.factorisations < STEPS / 2
    part = stopped(system, 60)
    assert part.checkpoint.arrays["kind"][0] in (1, 2)
    bare = {
        name: array
        for name, array in part.checkpoint.arrays.items()
        if not name.startswith("factors")
    }
    bare["kind"] = np.zeros_like(bare["kind"])
    assert_same(integrate(system, SCHEME, STEPS * SCHEME.step, resume=part), whole)
    fresh = integrate(
        system,
        SCHEME,
        STEPS * SCHEME.step,
        resume=replace(part, checkpoint=replace(part.checkpoint, arrays=bare)),
    )
    assert not np.array_equal(fresh.x, whole.x)


@pytest.mark.parametrize("memory", [1e12, 1e5], ids=["direct", "multigrid"])
def test_large_models_make_their_factors_again(
    memory: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plate on two corners turns: its factors of an earlier configuration serve on both sides of
    the split.
    """
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)
    monkeypatch.setattr(machine_memory, "free", lambda: memory)
    system, scheme, steps = hanging(), GeneralizedAlpha(1e-3), 40
    whole = integrate(system, scheme, steps * scheme.step)
    assert whole.statistics.solver.startswith(
        "sparse LDL^T" if memory > 1e6 else "conjugate gradients"
    )
    part = stopped(system, 9, scheme, steps)
    held = part.checkpoint.arrays
    assert np.abs(held["factored at"] - held["state x"]).max() > 1e-3
    assert_same(integrate(system, scheme, steps * scheme.step, resume=part), whole)


@pytest.mark.parametrize("large", [False, True], ids=["band", "large"])
def test_halved_steps_before_and_after_a_split(
    large: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Eighty times the step of example 2, and a plate with a large step: some steps need halving,
    wherever they are looked at.
    """
    system, scheme, steps = models.double_pendulum(8), GeneralizedAlpha(0.04), 50
    if large:
        monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)
        system, scheme, steps = hanging(4), GeneralizedAlpha(6e-2), 20
    whole = integrate(system, scheme, steps * scheme.step)
    assert whole.statistics.halved > 0
    assert_same(integrate(system, scheme, steps * scheme.step, record=lambda moment: None), whole)
    for after in (1, 9):
        assert_same(
            integrate(
                system, scheme, steps * scheme.step, resume=stopped(system, after, scheme, steps)
            ),
            whole,
        )


def test_looking_at_a_run_changes_nothing() -> None:
    """Same input, same numbers: how often a run is looked at depends on the clock, what it finds
    does not.
    """
    system, seen = models.double_pendulum(12), list[int]()

    def record(moment: RunState) -> None:
        seen.append(moment.done)
        rows = moment.rows(moment.kept - 1, moment.kept)
        assert rows.x.shape == (1, system.size)
        moment.checkpoint()

    watched = integrate(system, SCHEME, STEPS * SCHEME.step, record=record)
    assert_same(watched, integrate(system, SCHEME, STEPS * SCHEME.step))
    assert seen[-1] == STEPS
    assert all(done % 8 == 0 for done in seen)


def test_a_run_that_is_done_is_only_read() -> None:
    found: list[Resumed] = []
    system = models.spin_up(4)

    def record(moment: RunState) -> None:
        found.append(Resumed(moment.checkpoint(), moment.rows(0, moment.kept)))

    whole = integrate(system, SCHEME, 0.05, record=record)
    assert_same(integrate(system, SCHEME, 0.05, resume=found[-1]), whole)


def test_a_resumed_run_that_fails_has_its_whole_motion() -> None:
    """The load is no number from 0.1505 s on."""
    push = [
        loads.PointForce(
            "push", At("beam", "right"), (0.0, 1.0), lambda t: np.where(t > 0.1505, np.nan, 1.0)
        )
    ]
    system = models.cantilever(8, lambda tip: push)
    with pytest.raises(SolverError) as whole:
        integrate(system, SCHEME, STEPS * SCHEME.step)
    with pytest.raises(SolverError) as resumed:
        integrate(system, SCHEME, STEPS * SCHEME.step, resume=stopped(system, 60))
    assert str(resumed.value) == str(whole.value)
    assert_same(resumed.value.partial, whole.value.partial)
    assert len(whole.value.partial.times) == 151


@pytest.mark.parametrize(
    "changed,named",
    [
        ({"system": models.double_pendulum(11)}, "unknowns: 150 then, 138 now"),
        (
            {"system": models.double_pendulum(12, all_multipliers=True)},
            "multipliers: 0 then, 6 now",
        ),
        ({"scheme": GeneralizedAlpha(2e-3)}, "step: 0.001 then, 0.002 now"),
        ({"scheme": GeneralizedAlpha(1e-3, 0.5)}, "rho_inf"),
        ({"newton": Newton(tolerance=1e-9)}, "tolerance"),
        ({"newton": Newton(slow=0.1)}, "contraction"),
        ({"every": 2}, "states to keep"),
        ({"duration": 0.3}, "steps: 200 then, 300 now"),
    ],
)
def test_another_model_or_method_is_refused_by_name(changed: dict[str, Any], named: str) -> None:
    system = models.double_pendulum(12)
    part = stopped(system, 1)
    call = {"system": system, "scheme": SCHEME, "duration": STEPS * SCHEME.step} | changed
    with pytest.raises(CorruptFile, match=named) as caught:
        integrate(**call, resume=part)
    assert caught.value.exit_code == 8


def test_one_other_number_of_the_model_is_refused() -> None:
    """The same sizes with another stiffness, or with another drive."""
    part = stopped(models.spin_up(4), 1)
    with pytest.raises(CorruptFile, match="arrays of the model"):
        integrate(thicker(), SCHEME, STEPS * SCHEME.step, resume=part)
    slower = replace(
        models.spin_up(4),
        signals=tuple(lambda t, f=f: f(0.99 * t) for f in models.spin_up(4).signals),
    )
    with pytest.raises(CorruptFile, match="signals"):
        integrate(slower, SCHEME, STEPS * SCHEME.step, resume=part)


def thicker() -> System:
    """Example 1 with a section that is a little thicker."""
    return models.spin_up(4, section=models.sections.Circular(0.0100001))


def test_arrays_of_another_shape_are_refused() -> None:
    system = models.spin_up(4)
    part = stopped(system, 1)
    arrays = part.checkpoint.arrays
    for bad in (
        arrays | {"state v": arrays["state v"][:-1]},
        {k: a for k, a in arrays.items() if k != "state a"},
    ):
        with pytest.raises(CorruptFile, match="checkpoint: state"):
            integrate(
                system,
                SCHEME,
                STEPS * SCHEME.step,
                resume=replace(part, checkpoint=replace(part.checkpoint, arrays=bad)),
            )
