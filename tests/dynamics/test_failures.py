"""What stops a run, and what a user gets then: a reason, the time, names, and the motion up to
there.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable

import numpy as np
import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.core import machine_memory
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    buckling,
    energies,
    energy_errors,
    explain,
    follow_path,
    integrate,
    outputs,
    reactions,
    solve_equilibria,
    solve_statics,
)
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.springs import SpringDamper
from fmbs_skfem.systems.measures import probes

from .. import models
from ..systems.parts import displaced

END = At("beam", "left")
STEP = GeneralizedAlpha(1e-3)
FORMS = pytest.mark.parametrize(
    "form", [eliminate, lambda system: system], ids=["eliminated", "multipliers"]
)


def beam() -> body.Body:
    return body.cable("beam", models.segment(8), models.SECTION, models.MATERIAL, dim=2)


def loaded(history: Callable[[np.ndarray], np.ndarray]) -> System:
    """Cantilever of example 1's section under a transverse force of 1 N times `history` at its tip."""
    push = [loads.PointForce("push", At("beam", "right"), (0.0, 1.0), history)]
    return eliminate(assemble([beam()], [joints.Clamp("clamp", END)], push))


def test_a_load_beyond_all_bounds_ends_the_run() -> None:
    """The force grows e-fold every 17 ms: the error carries what was computed, the same as a
    shorter run.
    """
    system = loaded(lambda t: np.exp(60 * t))
    with pytest.raises(SolverError) as caught:
        integrate(system, STEP, 4.0)
    error, partial = caught.value, caught.value.partial
    assert error.reason in (
        Reason.DIVERGED,
        Reason.NOT_CONVERGED,
        Reason.NOT_FINITE,
        Reason.SINGULAR_TANGENT,
    )
    assert error.exit_code == 4
    assert partial.times[-1] <= error.time <= partial.times[-1] + 1e-3
    assert error.time > 0.05  # 20 N, which it takes
    assert error.worst[0][0].startswith("beam at s = ")
    assert [value for _, value in error.worst] == sorted(
        (value for _, value in error.worst), reverse=True
    )
    assert f"{error.time:.6g} s" in str(error)
    shorter = integrate(system, STEP, float(partial.times[-1]))
    np.testing.assert_array_equal(partial.x, shorter.x)
    assert np.isfinite(energies(partial)).all()


def test_an_infinite_force_ends_the_run() -> None:
    with pytest.raises(SolverError) as caught:
        integrate(loaded(lambda t: np.where(t > 0.1005, 1e305, 0.0)), STEP, 1.0)
    assert caught.value.reason is Reason.NOT_FINITE
    assert len(caught.value.partial.times) == 101


@pytest.mark.parametrize("every,rows", [(1, 101), (7, 15)])
def test_a_load_that_is_no_number_ends_the_run(every: int, rows: int) -> None:
    with pytest.raises(SolverError, match=r"load on beam is nan at t = 0\.101 s") as caught:
        integrate(loaded(lambda t: np.where(t > 0.1005, np.nan, 1.0)), STEP, 1.0, every=every)
    assert caught.value.reason is Reason.NOT_FINITE
    assert caught.value.time == pytest.approx(0.101)
    assert len(caught.value.partial.times) == rows
    assert np.abs(caught.value.partial.x[-1] - caught.value.partial.x[0]).max() > 1e-6


def driven(angle: Callable[[np.ndarray], np.ndarray]) -> System:
    """A beam that turns by `angle` about a pin at its end."""
    return assemble([beam()], [joints.Pin("pin", END), joints.DrivenAngle("drive", END, angle)])


@FORMS
@pytest.mark.parametrize("start", [np.nan, np.inf])
def test_a_drive_that_is_no_number_at_the_start_is_named(
    form: Callable[[System], System], start: float
) -> None:
    """The cosine of an infinite angle is no number either."""
    system = form(driven(lambda t: np.where(t > 0.0, t, start)))
    with (
        np.errstate(invalid="ignore"),
        pytest.raises(SolverError, match=r"joint drive is nan at t = 0 s") as caught,
    ):
        integrate(system, STEP, 0.01)
    error = caught.value
    assert (error.reason, error.time, error.partial) == (Reason.NOT_FINITE, 0.0, None)
    assert [name for name, _ in error.worst] == ["joint drive"]
    (cause,) = explain(error).causes
    assert cause.name == "signal"
    assert "joint drive" in cause.what


@FORMS
def test_a_load_that_is_no_number_at_the_start_is_named(form: Callable[[System], System]) -> None:
    """sin(t) / t without its limit."""
    push = loads.Moment("twist", At("beam", "right"), 1.0, lambda t: np.sin(t) / t)
    system = form(assemble([beam()], [joints.Clamp("clamp", END)], [push]))
    with (
        np.errstate(invalid="ignore"),
        pytest.raises(SolverError, match="load on beam is nan at t = 0 s") as caught,
    ):
        integrate(system, STEP, 0.01)
    assert caught.value.reason is Reason.NOT_FINITE


def test_a_drive_that_stops_being_a_number_is_named() -> None:
    with pytest.raises(SolverError, match=r"joint drive is nan at t = 0\.013 s") as caught:
        integrate(eliminate(driven(lambda t: np.where(t > 0.0125, np.nan, t**2))), STEP, 0.1)
    assert caught.value.reason is Reason.NOT_FINITE
    np.testing.assert_allclose(caught.value.partial.times, 1e-3 * np.arange(13))


def test_a_load_that_is_no_number_within_a_halved_step_ends_the_run() -> None:
    """A step that fails is halved down to 1/64; after 7/64 of it the load is no number: the error
    keeps what was before.
    """
    held = loaded(lambda t: np.select([t > 0.0209, t > 0.0201], [1e305, np.nan], 1.0))
    with pytest.raises(SolverError, match=r"load on beam is nan at t = 0\.0201094 s") as caught:
        integrate(held, STEP, 0.1)
    assert caught.value.reason is Reason.NOT_FINITE
    np.testing.assert_allclose(caught.value.partial.times, 1e-3 * np.arange(21))
    np.testing.assert_array_equal(caught.value.partial.x, integrate(held, STEP, 0.02).x)


def test_a_motion_whose_steps_often_fail_is_doubted() -> None:
    """Example 2 with 80 times its step; nothing is said with ten times."""
    with pytest.warns(
        Notice,
        match=r"iteration failed \d+ times in 50 steps, which were divided: .* take a smaller step",
    ):
        integrate(models.double_pendulum(8), GeneralizedAlpha(0.04), 2.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        integrate(models.double_pendulum(8), GeneralizedAlpha(5e-3), 0.5)


def test_a_step_that_fails_is_halved() -> None:
    """Example 2 with 125 times its step: some steps need halving, and the motion stays near that of
    small steps.
    """
    coarse = integrate(models.double_pendulum(8), GeneralizedAlpha(0.0625), 1.0)
    assert coarse.statistics.halved > 0
    assert coarse.statistics.steps == 16
    np.testing.assert_allclose(np.diff(coarse.times), 0.0625)
    fine = integrate(models.double_pendulum(8), GeneralizedAlpha(5e-4), 1.0, every=125)
    for column in ("C_x", "C_y", "C_z"):
        np.testing.assert_allclose(outputs(coarse)[column], outputs(fine)[column], atol=0.2)


def test_newton_leaps_to_no_other_solution() -> None:
    """A spring turns a soft arm. Steps of 1 ms have another solution, too, of a crushed arm with
    100 times the energy.

    The tip goes where steps of 0.1 ms bring it.
    """
    arm = body.cable(
        "arm", models.segment(20), sections.Circular(0.01), sections.Material(195e6, 1800.0), dim=2
    )
    tip = At("arm", "right")
    spring = SpringDamper("spring", tip, (1.0, 0.3), stiffness=52.0, damping=0.36, length=0.1)
    hinge, sensed = joints.Pin("hinge", At("arm", "left")), {"tip": probes.Position(tip)}
    system = eliminate(assemble([arm], [hinge], [spring], outputs=sensed))
    coarse = integrate(system, GeneralizedAlpha(1e-3), 0.05)
    fine = integrate(system, GeneralizedAlpha(1e-4), 0.05, every=10)
    assert energy_errors(coarse).rise < 1e-3
    assert energy_errors(coarse).fall < 0.01
    for column in ("tip_x", "tip_y"):
        np.testing.assert_allclose(outputs(coarse)[column], outputs(fine)[column], atol=5e-3)


@FORMS
def test_contradictory_joints_are_named(form: Callable[[System], System]) -> None:
    system = displaced(
        assemble([beam()], [joints.Pin("one", END), joints.Pin("other", END)]), ("other", "y"), 0.1
    )
    with pytest.raises(SolverError, match=r"other\.y") as caught:
        integrate(form(system), STEP, 0.01)
    assert caught.value.reason is Reason.INCONSISTENT
    assert caught.value.worst[0][1] == pytest.approx(0.1)


def test_redundant_multipliers_are_left_out() -> None:
    """Two pins at one place, every row with its multiplier: the motion of one, and the notice that
    elimination gives.
    """
    once, twice = (
        assemble([beam()], held)
        for held in ([joints.Pin("one", END)], [joints.Pin("one", END), joints.Pin("other", END)])
    )
    with pytest.warns(
        Notice, match=r"redundant constraint rows are left out .*: (one|other)\.x, (one|other)\.y"
    ):
        motion = integrate(twice, STEP, 0.01)
    np.testing.assert_allclose(motion.x, integrate(once, STEP, 0.01).x, atol=1e-12)


@pytest.mark.parametrize(
    "solve",
    [
        lambda system: solve_statics(system, 2).x[-1],
        lambda system: solve_equilibria(system, np.array([0.5, 1.0])).x[-1],
        lambda system: follow_path(system).x[-1],
        lambda system: buckling(system).factors,
    ],
    ids=["load steps", "times", "arc length", "buckling"],
)
def test_equilibria_leave_redundant_multipliers_out(solve: Callable[[System], np.ndarray]) -> None:
    """Two clamps at one place, every row with its multiplier: the equilibria of one. Edges of
    plates share rows at corners so.
    """
    push = [loads.PointForce("push", At("beam", "right"), (-1.0, 0.01))]
    once, twice = (
        assemble([beam()], [joints.Clamp(name, END) for name in names], push)
        for names in (("clamp",), ("clamp", "spare"))
    )
    with pytest.warns(Notice, match="redundant constraint rows are left out"):
        found = solve(twice)
    np.testing.assert_allclose(found, solve(once), rtol=1e-9, atol=1e-9)


@FORMS
def test_a_drive_against_a_clamp_is_named(form: Callable[[System], System]) -> None:
    system = assemble(
        [beam()], [joints.Clamp("clamp", END), joints.DrivenAngle("drive", END, lambda t: t)]
    )
    with pytest.raises(
        SolverError, match=r"contradict each other: .*a driven motion must be free"
    ) as caught:
        integrate(form(system), STEP, 0.01)
    assert caught.value.reason is Reason.INCONSISTENT


def test_an_initial_state_off_the_joints_is_refused() -> None:
    system = assemble(
        [beam()], [joints.DrivenPosition("drive", END, (lambda t: 0.2 + 0 * t, lambda t: 0 * t))]
    )
    with pytest.raises(SolverError, match=r"drive\.x by 0\.2") as caught:
        integrate(system, STEP, 0.01)
    assert caught.value.reason is Reason.INCONSISTENT


def test_linear_joints_move_the_initial_state_with_a_notice() -> None:
    with pytest.warns(Notice, match=r"initial state is moved.*pin\.x by 0\.01"):
        system = eliminate(
            displaced(assemble([beam()], [joints.Pin("pin", END)]), ("pin", "x"), 0.01)
        )
    assert system.lift(system.x0)[0] == pytest.approx(-0.01, abs=1e-12)


def thrown() -> System:
    """A pinned and driven beam whose initial velocities fit neither the pin nor the drive."""
    held: list[joints.Joint] = [
        joints.Pin("pin", END),
        joints.DrivenAngle("drive", END, lambda t: t),
    ]
    return assemble(
        [beam()], held, initial={"beam": Motion(velocity=(1.0, 2.0), angular_velocity=3.0)}
    )


def test_initial_velocities_are_projected_alike_in_both_forms() -> None:
    """The projection changes velocities by the least kinetic energy, whether joints are eliminated
    or not.
    """
    velocities = []
    for form in (eliminate, lambda system: system):
        with pytest.warns(Notice, match="initial velocities are projected"):
            found = integrate(form(thrown()), STEP, 0.002)
        velocities.append(found.system.lift.matrix @ found.v[0])
        np.testing.assert_allclose(velocities[-1][:2], 0.0, atol=1e-12)
        assert (velocities[-1][3] - velocities[-1][1]) / (1 / 24) == pytest.approx(
            1.0, abs=1e-9
        )  # slope at 1 rad/s
    np.testing.assert_allclose(velocities[0], velocities[1], atol=1e-10)


def test_velocities_that_fit_are_kept_without_a_notice(recwarn: pytest.WarningsRecorder) -> None:
    spun = {"beam": Motion(angular_velocity=3.0)}
    system = assemble([beam()], [joints.Pin("pin", END)], initial=spun)
    found = integrate(eliminate(system), STEP, 0.002)
    np.testing.assert_allclose(found.system.lift.matrix @ found.v[0], system.v0, atol=1e-12)
    assert not [w for w in recwarn if issubclass(w.category, Notice)]


def test_a_free_body_has_no_equilibrium() -> None:
    system = assemble([beam()], [], [loads.Gravity((0.0, -9.81))])
    with pytest.raises(SolverError, match="hold it by joints") as caught:
        solve_statics(system)
    assert caught.value.reason is Reason.SINGULAR_TANGENT


@pytest.mark.parametrize(
    "solve",
    [solve_statics, follow_path, lambda system: solve_equilibria(system, np.array([0.0, 1.0]))],
)
def test_statics_name_a_load_that_is_no_number(solve: Callable[[System], object]) -> None:
    with pytest.raises(SolverError, match="load on beam is nan at t = 0 s") as caught:
        solve(loaded(lambda t: np.full_like(t, np.nan)))
    assert caught.value.reason is Reason.NOT_FINITE


def test_statics_keep_the_equilibria_found() -> None:
    """A follower force far beyond what the cells can resolve: the error holds the load factors that
    were reached.
    """
    cantilever = models.cantilever(
        4, lambda end: [loads.Follower("P", end, (0.0, 1e7))], section=sections.Given(1e4, 1.0, 1.0)
    )
    with pytest.raises(SolverError) as caught:
        solve_statics(cantilever, 4)
    assert caught.value.partial.times[0] == 0.0
    assert caught.value.partial.times[-1] < caught.value.time <= 1.0


def test_statics_name_the_load_of_every_state() -> None:
    found = solve_statics(
        models.cantilever(8, lambda end: [loads.PointForce("P", end, (0.0, 1.0))]), 5
    )
    np.testing.assert_allclose(found.times, np.linspace(0, 1, 6))
    np.testing.assert_allclose(reactions(found)["clamp", "y"], -found.times, atol=1e-8)


@pytest.mark.parametrize(("step", "every"), [(1e-12, 1), (1e-12, 10**9), (1e-3, 1)])
def test_more_states_than_memory_are_refused(
    step: float, every: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before anything is allocated: 745 GB of steps, and 1 MB of states where that is all there is."""
    monkeypatch.setattr(machine_memory, "built_in", lambda: 1e6)
    with pytest.raises(
        InputError, match=r"stored states that fit into the 0.001 GB of this machine"
    ):
        integrate(models.spin_up(20), GeneralizedAlpha(step), 1.0, every=every)


@pytest.mark.parametrize(
    "duration, told",
    [
        (math.inf, "duration: expected a finite number"),
        (math.nan, "a finite number"),
        (0.0, "at least one step"),
    ],
)
def test_durations_without_steps(duration: float, told: str) -> None:
    with pytest.raises(InputError, match=told):
        integrate(models.spin_up(2), GeneralizedAlpha(1e-3), duration)
