"""Histories, drives and prescribed displacements over the load factor of statics, and the levels at
which equilibria are found.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.core.errors import SolverError
from fmbs_skfem.dynamics import (
    ArcLength,
    Newton,
    follow_path,
    outputs,
    solve_equilibria,
    solve_statics,
)
from fmbs_skfem.dynamics.equilibria import statics
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

TIGHT = Newton(tolerance=1e-12)
EA = 100.0  #: [N]
Function = Callable[[np.ndarray], np.ndarray]


def bar(history: Function | None = None, force: float = 2.0) -> System:
    """A bar of length 1 along x, pulled at its end: N = EA a (a^2 - 1) / 2 at the stretch a."""
    beam = body.cable("bar", segment(2, end=(1.0, 0.0, 0.0)), sections.Given(EA, 1.0, 1.0), dim=2)
    end = At("bar", "right")
    pull = loads.PointForce("P", end, (force, 0.0), history)
    held = [joints.Clamp("clamp", At("bar", "left"))]
    return eliminate(
        assemble(
            [beam],
            held,
            [pull],
            outputs={"end": probes.Position(end), "clamp": probes.Reaction("clamp")},
        )
    )


def pressed(displacement: Function) -> System:
    """The bar with a prescribed displacement of its end."""
    beam = body.cable("bar", segment(2, end=(1.0, 0.0, 0.0)), sections.Given(EA, 1.0, 1.0), dim=2)
    end = At("bar", "right")
    drive = joints.DrivenPosition("drive", end, (displacement, np.zeros_like))
    held = [joints.Clamp("clamp", At("bar", "left")), drive]
    return eliminate(
        assemble(
            [beam], held, outputs={"end": probes.Position(end), "drive": probes.Reaction("drive")}
        )
    )


def turned(angle: Function) -> System:
    """A beam on a pin whose root is turned."""
    beam, root = (
        body.cable("bar", segment(2, end=(1.0, 0.0, 0.0)), sections.Given(EA, 1.0, 1.0), dim=2),
        At("bar", "left"),
    )
    held = [joints.Pin("pin", root), joints.DrivenAngle("drive", root, angle)]
    return eliminate(
        assemble(
            [beam],
            held,
            outputs={"end": probes.Position(At("bar", "right")), "angle": probes.Angle(root)},
        )
    )


def squared(t: np.ndarray) -> np.ndarray:
    return t**2


def test_histories_run_over_the_load_factor() -> None:
    path = solve_statics(bar(squared), 5, TIGHT)
    assert_allclose(outputs(path)["clamp_x"], -2.0 * path.times**2, atol=1e-9)
    later = solve_statics(bar(squared), 5, TIGHT, time=3.0)
    assert_allclose(outputs(later)["clamp_x"], -18.0 * path.times**2, atol=1e-9)


def test_what_is_constant_grows() -> None:
    """A load without a history, and one whose history is a constant."""
    expected = outputs(solve_statics(bar(), 5, TIGHT))["end_x"]
    assert expected[-1] > 1.01
    assert_allclose(
        outputs(solve_statics(bar(lambda t: 0.5 + 0.0 * t, 4.0), 5, TIGHT))["end_x"],
        expected,
        atol=1e-12,
    )


@pytest.mark.parametrize(
    "displacement", [lambda t: 0.04 * t, lambda t: 0.04 + 0.0 * t], ids=["ramp", "constant"]
)
def test_prescribed_displacements(displacement: Function) -> None:
    path = solve_statics(pressed(displacement), 4, TIGHT)
    found = outputs(path)
    assert_allclose(found["end_x"], 1.0 + 0.04 * path.times, atol=1e-12)
    stretch = 1.0 + 0.04 * path.times
    assert_allclose(found["drive_x"], EA * stretch * (stretch**2 - 1.0) / 2.0, atol=1e-9)


@pytest.mark.parametrize("steps", [1, 4])
@pytest.mark.parametrize(
    "angle", [lambda t: 7.0 * t, lambda t: 7.0 + 0.0 * t], ids=["ramp", "constant"]
)
def test_driven_angles_of_more_than_a_turn(steps: int, angle: Function) -> None:
    """The sine of the angle alone is driven: long load steps are taken in parts, so that no half
    turn is lost.
    """
    path = solve_statics(turned(angle), steps, TIGHT)
    found = outputs(path)
    assert len(path.times) == steps + 1
    assert_allclose(found["end_x"], np.cos(7.0 * path.times), atol=1e-9)
    assert_allclose(found["end_y"], np.sin(7.0 * path.times), atol=1e-9)
    between = solve_equilibria(turned(lambda t: 7.0 * t), np.array([0.0, 1.0]), TIGHT)
    assert_allclose(outputs(between)["end_x"][-1], np.cos(7.0), atol=1e-9)


def test_an_arc_length_follows_histories() -> None:
    """The bar under a load of history s^2, and moved by a drive."""
    path = follow_path(bar(squared), ArcLength(0.2), TIGHT)
    assert path.times[-1] == 1.0
    assert_allclose(outputs(path)["clamp_x"], -2.0 * path.times**2, atol=1e-9)
    drive = follow_path(pressed(lambda t: 0.04 * t), ArcLength(0.2), TIGHT)
    assert_allclose(outputs(drive)["end_x"], 1.0 + 0.04 * drive.times, atol=1e-12)


def test_load_levels_stay_on_the_grid_after_a_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every second equilibrium is refused once: shorter steps come between, and the levels are
    those asked for.
    """
    asked: list[float] = []
    solve = statics.newton_statics

    def stubborn(
        model: object,
        start: statics.Equilibrium,
        newton: Newton,
        factor: float,
        unit: str,
        few: int | None,
    ) -> statics.Equilibrium:
        asked.append(factor)
        if factor - start.at > 0.15:
            raise SolverError("too far", None, factor)
        return solve(model, start, newton, factor, unit, few)  # type: ignore[arg-type]

    expected = outputs(solve_statics(bar(), 4, TIGHT))
    monkeypatch.setattr(statics, "newton_statics", stubborn)
    path = solve_statics(bar(), 4, TIGHT)
    assert len(asked) > 8
    assert_allclose(path.times, [0.0, 0.25, 0.5, 0.75, 1.0], rtol=0.0, atol=0.0)
    assert_allclose(outputs(path)["end_x"], expected["end_x"], atol=1e-12)


def test_a_cut_step_that_ends_in_failure_keeps_the_last_equilibrium(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solve = statics.newton_statics

    def up_to(
        model: object,
        start: statics.Equilibrium,
        newton: Newton,
        factor: float,
        unit: str,
        few: int | None,
    ) -> statics.Equilibrium:
        if factor > 0.4:
            raise SolverError("no further", None, factor)
        return solve(model, start, newton, factor, unit, few)  # type: ignore[arg-type]

    monkeypatch.setattr(statics, "newton_statics", up_to)
    monkeypatch.setattr(statics, "settle", lambda *_: None)
    with pytest.raises(SolverError, match="no further") as caught:
        solve_statics(bar(), 4, TIGHT)
    times = caught.value.partial.times
    assert times[1] == 0.25
    assert 0.35 < times[-1] <= 0.4
