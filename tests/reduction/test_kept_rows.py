"""Which constraint rows a reduced model keeps: a bead on a helix, and what is decided of any
errors; what is said of bases.
"""

from __future__ import annotations

import functools
import math
import warnings
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import pytest
import sympy

from fmbs_skfem import reduction
from fmbs_skfem.bodies import Circular, Material, body
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.ranges import Parameter
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.reduction import Plan, TrainingTask, cases, full_runs, reduced_models, task_of
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.spaces import kept_rows
from fmbs_skfem.reduction.spaces.kept_rows import Names
from fmbs_skfem.systems import At, System, assemble, eliminate, fields
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.connections.joints import Joint
from fmbs_skfem.systems.connections.own_joints import OwnJoint
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import models

STEP, TIGHT = GeneralizedAlpha(1e-3), Newton(tolerance=2e-12)


@dataclass(frozen=True)
class Helix(OwnJoint, word="helix_of_tests"):
    """A point stays on the helix (R cos a, R sin a, p a / 2 pi) about z."""

    name: str
    at: fields.Place
    radius: Annotated[float, fields.quantity("m", "> 0")]
    pitch: Annotated[float, fields.quantity("m", "> 0")]

    @staticmethod
    def equations(at, radius, pitch):  # type: ignore[no-untyped-def,override]
        x, y, z = at.position
        a = 2 * sympy.pi * z / pitch
        return {
            "radius": (x**2 + y**2 - radius**2) / (2 * radius),
            "angle": y * sympy.cos(a) - x * sympy.sin(a),
        }


# scenes of other tests do not know it, whichever of these run in the same process
joints.Joint.known.pop(Helix.word)


def pendulum() -> System:
    """A beam of 20 cells whose one end slides down a helix."""
    section, material = Circular(0.02), Material(young_modulus=1e9, density=1800.0)
    beam = body.cable(
        "arm", models.segment(20), section, material, origin=np.array([0.5, 0.0, 0.0])
    )
    tip = {"root": probes.Position(At("arm", "left"))}
    return assemble(
        [beam],
        [Helix("rail", At("arm", "left"), 0.5, 0.8)],
        [loads.Gravity((0.0, 0.0, -9.81))],
        outputs=tip,
    )


@functools.cache
def sliding() -> tuple[System, Trajectory]:
    """Its motion over 0.3 s."""
    raw = pendulum()
    return raw, integrate(eliminate(raw), STEP, 0.3, TIGHT)


@pytest.mark.parametrize("eps,bound", [(1e-8, 1e-3), (1e-10, 3e-4), (1e-12, 2e-4), (1e-14, 1e-4)])
def test_no_row_of_a_joint_is_left_out_by_noise(eps: float, bound: float) -> None:
    """Closing the gap of `angle` takes 6 and 9 times the distance of the basis at 1e-10 and 1e-12;
    without it errors are 1e-2.
    """
    raw, full = sliding()
    model = reduction.train(
        task_of(Case(raw, STEP, 0.3, TIGHT), Plan({"arm": ("arm",)}, eps), 5e-3), motion=full
    ).model
    assert model.left_out == {}
    assert set(model.system.constraints.names) == {("rail", "radius"), ("rail", "angle")}
    assert reduction.compare(full, cases.run(model.cases({}))).maximum < bound


def test_rows_of_joints_that_lock_are_named() -> None:
    """Three modes of a basis of eps = 1e-4 cannot follow the helix: a warning says what is left
    out, and what that does.
    """
    raw, full = sliding()
    task = task_of(Case(raw, STEP, 0.3, TIGHT), Plan({"arm": ("arm",)}, 1e-4), 5e-3)
    with pytest.warns(
        Notice,
        match=r"leaves out rail\.angle, rail\.radius: its modes cannot follow them \(error .* with them",
    ):
        model = reduction.train(task, motion=full).model
    assert set(model.left_out) == {"rail.angle", "rail.radius"}
    assert all(
        why.startswith("locks the motion: with all such rows it errs by")
        for why in model.left_out.values()
    )


FRAMES = ("a.A", "e1.e1"), ("b.B", "e1.e1"), ("b.C", "e1.e1")
JOINTS = ("rail", "angle"), ("rail", "radius"), ("screw", "x")


@pytest.mark.parametrize(
    "locking,needed,left",
    [
        ([], [], []),  # nothing is better without
        (["a.A"], [], ["a.A"]),
        (["a.A", "b.B", "b.C"], [], ["a.A", "b.B", "b.C"]),
        (["a.A", "b.C"], ["b.B"], ["a.A", "b.C"]),
        (
            ["a.A", "b.B", "b.C"],
            ["rail", "screw"],
            ["a.A", "b.B", "b.C"],
        ),  # joints that guide beside frames that lock
        (["screw"], ["rail"], ["screw"]),  # what no step with all of a kind shows
        (["rail"], ["a.A", "b.B", "b.C", "screw"], ["rail"]),
    ],
)
def test_what_locks_is_found_among_what_is_needed(
    locking: list[str], needed: list[str], left: list[str]
) -> None:
    """Errors of a model: 1e-2 for every row that locks and is kept, or, if larger, 0.3 for every
    one that is needed and is not.
    """
    every = (*FRAMES, *JOINTS)

    def error(out: Names) -> float:
        kept, gone = ({joint for joint, _ in some} for some in (frozenset(every) - out, out))
        locks, misses = (
            1e-2 * sum(joint in kept for joint in locking),
            0.3 * sum(joint in gone for joint in needed),
        )
        return max(1e-5, locks, misses)

    out, with_all, now = kept_rows.find_locking(every, error, lambda: 1e-8)
    assert out == {name for name in every if name[0] in left}
    assert (with_all, now) == (
        error(frozenset()),
        error(frozenset(name for name in every if name[0] in left)),
    )


def test_a_run_that_fails_is_an_error_without_bound() -> None:
    """And what it says is not said of the model."""

    def run(out: Names) -> float:
        warnings.warn("of a trial", Notice, stacklevel=1)
        raise SolverError("no motion", Reason.DIVERGED, 0.0)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert kept_rows.try_rows(run)(frozenset()) == math.inf


def swinging(force: float, idle: bool) -> TrainingTask:
    """A pinned beam under a force at its end, and one that nothing moves; 0.1 s."""
    beams = [body.cable("arm", models.segment(8), models.SECTION, models.MATERIAL, dim=2)]
    held: list[Joint] = [joints.Pin("hinge", At("arm", "left"))]
    if idle:
        beams.append(
            body.cable(
                "idle",
                models.segment(8),
                models.SECTION,
                models.MATERIAL,
                dim=2,
                origin=np.array([0.0, 1.0]),
            )
        )
        held.append(joints.Clamp("wall", At("idle", "left")))
    raw = assemble(beams, held, [loads.PointForce("push", At("arm", "right"), (0.0, -force))])
    return task_of(
        Case(raw, STEP, 0.1, TIGHT), Plan({beam.name: (beam.name,) for beam in beams}, 1e-10), 2e-3
    )


@pytest.mark.parametrize("invariant", [False, True])
def test_components_at_rest_are_named(invariant: bool) -> None:
    """They have the fewest modes that there are; 81 were made of round-off."""
    task = swinging(1.0, True)
    with pytest.warns(
        Notice, match=r"at rest in the training, and in the reduced model: 'idle' \(moves by"
    ):
        model = reduction.train(replace(task, plan=replace(task.plan, invariant=invariant))).model
    assert model.modes["idle"] <= 3
    assert model.modes["arm"] > 5


def test_a_motion_at_rest_is_refused() -> None:
    """Also where there are parameters, whose training had an error of NaN."""
    task = swinging(0.0, False)
    family = replace(task, parameters=(Parameter("E", 1.0, 2.0),))
    for one in (task, family):
        run = full_runs.full_run(one, {"E": 1.0})
        with pytest.raises(
            InputError, match="expected a motion, got none: nothing moves in the training run"
        ):
            reduced_models.make_model(one, [run])


def test_a_rough_basis_is_said_to_be_one() -> None:
    """In Python too: 1 % of the motion outside of its basis makes an error of 0.6 of it."""
    task = swinging(1.0, False)
    with pytest.warns(Notice, match=r"component 'arm': its \d modes leave out .*% of the motion"):
        reduction.train(replace(task, plan=replace(task.plan, tolerance=1e-2)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        reduction.train(task)
