"""Steps of several lengths in a run, by the error of each: of second order, fewer where motions are
uneven, and the same again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.bodies import body, point_mass, sections
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, integrate, outputs
from fmbs_skfem.dynamics.checkpoint import Resumed
from fmbs_skfem.dynamics.many import integrate_many
from fmbs_skfem.dynamics.observers import Observer
from fmbs_skfem.dynamics.run import OpenRun
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import nurbs
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads, springs
from fmbs_skfem.systems.measures import probes

from .. import models

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


class Parts(Observer):
    """Halvings that the error of every step asks for in the next one."""

    looks, reads_states = "step", False

    def __init__(self) -> None:
        self.halvings = list[int]()

    def after(self, run: OpenRun) -> None:
        self.halvings.append(int(run.step.state.parts[0]))


def blown() -> System:
    """A mass on a soft spring, and a blow."""
    spring = springs.SpringDamper("s", At("m"), (0.0, 0.0), stiffness=1.0, damping=0.0, length=0.0)
    push = loads.PointForce("p", At("m"), (0.0, 3.0), lambda t: np.exp(-(((t - 1.0) / 0.03) ** 2)))
    return assemble(
        [point_mass("m", 1.0, np.array([1.0, 0.1]))],
        [],
        [spring, push],
        outputs={"m": probes.Position(At("m"))},
    )


def motion(
    system: System, local: float, steps: int = 40, *observers: Observer, **more: Any
) -> Trajectory:
    return integrate(
        system, GeneralizedAlpha(2.0 / steps, local_error=local), 2.0, observers=observers, **more
    )


def test_a_quarter_of_the_error_of_steps_is_a_quarter_of_that_of_the_motion() -> None:
    """Steps of half the length everywhere: positions and velocities are of second order in it."""
    system = models.mass_pendulum((0.6, -0.8))
    exact = integrate(system, GeneralizedAlpha(2.0 / 40_960), 2.0, every=1024)
    found = [motion(system, local) for local in (4e-5, 1e-5)]
    errors = np.array(
        [[np.abs(one.x - exact.x).max(), np.abs(one.v - exact.v).max()] for one in found]
    )
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_steps_are_short_where_something_happens() -> None:
    """A blow of 0.06 s in a slow motion; the step that meets it is taken again, and steps behind it
    grow back one by one.
    """
    parts = Parts()
    motion(blown(), 3e-5, 80, parts)
    halvings = np.array(parts.halvings)
    assert halvings[:36].max() == 0
    assert halvings[37:43].max() >= 3
    assert halvings[50:].max() <= 1
    assert np.diff(halvings).min() == -1
    assert np.diff(halvings).max() >= 2


def test_the_gripper_takes_half_of_the_work() -> None:
    """Against equal steps with as large an error: between touches they could be ten times as long."""
    scene = scenes.read(EXAMPLES / "gripper.yaml")
    system, height = build.system(scene), lambda run: outputs(run)["ball_y"]
    exact, equal = (
        integrate(system, GeneralizedAlpha(1 / n), 1.0, every=n // 200) for n in (32_000, 4000)
    )
    levels = integrate(system, GeneralizedAlpha(1 / 400, local_error=2e-6), 1.0, every=2)
    assert (
        np.abs(height(levels) - height(exact)).max()
        < 1.5 * np.abs(height(equal) - height(exact)).max()
    )
    work = [
        one.statistics.iterations + 4 * one.statistics.factorisations for one in (levels, equal)
    ]
    assert work[0] < 0.6 * work[1]


def test_waves_that_no_step_resolves_do_not_shorten_it() -> None:
    """A stiff beam under a gentle load: axial waves have accelerations of their own size, and
    displacements of nothing.
    """
    history = lambda t: np.sin(3.0 * t)  # noqa: E731
    stiff, soft = (
        models.cantilever(
            4,
            lambda tip: [loads.PointForce("p", tip, (1.0, 1.0), history)],
            section=sections.Given(EA, 1.0, 1.0),
        )
        for EA in (1e7, 1e3)
    )
    found = []
    for system in (stiff, soft):
        parts = Parts()
        motion(system, 1e-4, 200, parts)
        found.append(2.0 ** np.array(parts.halvings))
    assert found[0].mean() < 1.5 * found[1].mean()


def stopped() -> System:
    beam = body.cable("beam", models.segment(4), models.SECTION, models.MATERIAL, dim=2)
    stop = springs.Stop("s", At("beam", "right"), (1.0, -0.4), direction=(0.0, 1.0), stiffness=1e3)
    return eliminate(
        assemble([beam], [joints.Pin("O", At("beam", "left"))], [loads.Gravity((0.0, -9.81)), stop])
    )


def test_pieces_between_touches_have_the_error_asked_for() -> None:
    """Two masses on rods swing onto stops: what is left of a step behind a touch is taken in as
    short parts as whole steps are.
    """
    masses = [
        point_mass("a", 1.0, np.array([1.0, 0.0])),
        point_mass("b", 1.0, np.array([1.0, 0.5])),
    ]
    a, b = At("a", "center"), At("b", "center")
    rods = [joints.RigidLink("r", a, (0.0, 0.0)), joints.RigidLink("s", b, a)]
    side = springs.Stop("side", a, (0.2, 0.0), direction=(1.0, 0.0), stiffness=1e4)
    floor = springs.Stop("floor", b, (0.0, -1.0), direction=(0.0, 1.0), stiffness=1e4)
    system = assemble(masses, rods, [loads.Gravity((0.0, -9.81)), side, floor])
    exact = integrate(system, GeneralizedAlpha(0.9 / 12_800), 0.9, every=512)
    found = integrate(system, GeneralizedAlpha(0.9 / 50, local_error=1e-6), 0.9, every=2)
    assert np.abs(found.x - exact.x).max() < 6e-5


def driven() -> System:
    return models.spin_up(4)


def jumping() -> System:
    push = loads.PointForce("p", At("m"), (2.0, 0.0), lambda t: 1.0 * (t < 0.7123))
    spring = springs.SpringDamper("s", At("m"), (0.0, 0.0), stiffness=9.0, damping=0.0, length=0.0)
    return assemble([point_mass("m", 1.0, np.array([1.0, 0.1]))], [], [push, spring])


@pytest.mark.parametrize("make", [blown, stopped, driven, jumping])
@pytest.mark.parametrize("done", [16, 64, 120])
def test_a_run_that_is_resumed_has_the_same_bits(make: Callable[[], System], done: int) -> None:
    kept = list[Resumed]()

    def record(state: Any) -> None:
        if state.done >= done and not kept:
            kept.append(Resumed(state.checkpoint(), state.rows(0, state.kept)))

    system, scheme = make(), GeneralizedAlpha(0.01, local_error=1e-5)
    whole = integrate(system, scheme, 1.6, record=record)
    again = integrate(system, scheme, 1.6, resume=kept[0])
    for name in ("x", "v", "a", "multipliers", "work"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(again, name))
    assert again.statistics.iterations == whole.statistics.iterations > 2 * 160


def test_two_threads_give_the_same() -> None:
    system, scheme = stopped(), GeneralizedAlpha(0.01, local_error=1e-5)
    alone, *both = (
        integrate(system, scheme, 1.0),
        *integrate_many([system, stopped()], scheme, 1.0, threads=2),
    )
    for one in both:
        assert isinstance(one, Trajectory)
        np.testing.assert_array_equal(one.x, alone.x)


def test_large_models_do_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sparse factors, which live outside of the compiled step."""
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)
    shape = nurbs.surface(*nurbs.rectangle(1.0, 0.5, 6, 4, 2))
    sheet = plate(
        "sheet",
        replace(shape, points={"c": nurbs.place(shape, 1.0, 0.5)}),
        1e-2,
        sections.Material(1e7, 1000.0, 0.3),
    )
    push = loads.PointForce(
        "push", At("sheet", "c"), (0.0, 0.0, 1.0), lambda t: np.exp(-(((t - 0.1) / 0.005) ** 2))
    )
    system = assemble([sheet], [], [push])
    exact, equal = (
        integrate(system, GeneralizedAlpha(0.2 / n), 0.2, every=n // 20) for n in (1280, 40)
    )
    levels = integrate(system, GeneralizedAlpha(0.2 / 40, local_error=1e-5), 0.2, every=2)
    assert levels.statistics.solver.startswith("sparse")
    assert np.abs(levels.x - exact.x).max() < 0.25 * np.abs(equal.x - exact.x).max()


@pytest.mark.parametrize("local", [-1e-3, 1.0, np.nan])
def test_an_error_of_a_step_is_a_small_number(local: float) -> None:
    with pytest.raises(InputError, match="local_error: expected a number between 0 and 1"):
        GeneralizedAlpha(1e-3, local_error=local)
