"""Factors that rotate with beams: exact for beams that move as rigid bodies, whatever joins them,
and worth it in motions.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import cable
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.dynamics.compiled_step import beam_points, rotated
from fmbs_skfem.dynamics.compiled_step.packing import PackedStep
from fmbs_skfem.dynamics.compiled_step.step import Step
from fmbs_skfem.dynamics.initial import first_step, start_of, start_step
from fmbs_skfem.dynamics.scheme import method_of
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate, evaluation, joints, loads
from fmbs_skfem.systems.compiled import Compiled, compile_system, signal_table

from .. import models

SCHEME = GeneralizedAlpha(1e-3)


def chain(count: int) -> System:
    """Beams of a metre behind each other in the plane, the first one on a driven hinge."""
    beams = [
        cable(
            f"b{k}",
            models.segment(5, (k, 0, 0), (k + 1, 0, 0)),
            models.SECTION,
            models.MATERIAL,
            dim=2,
        )
        for k in range(count)
    ]
    pins = [
        joints.Pin(f"p{k}", At(f"b{k}", "right"), At(f"b{k + 1}", "left")) for k in range(count - 1)
    ]
    held = [
        joints.Pin("hinge", At("b0", "left")),
        joints.DrivenAngle("drive", At("b0", "left"), lambda t: 3.0 * t),
    ]
    return eliminate(assemble(beams, [*held, *pins], [loads.Gravity((0.0, -9.81))]))


def bars(*joined: joints.Joint) -> System:
    """Beams with torsion of a metre, the second one on the end of the first, upwards."""
    section = BeamSection(np.diag([1e5, 4e4, 4e4, 5.0, 9.0, 7.0]), np.diag([0.5, 1e-4, 2e-4]))
    ends = ((0, 0, 0), (1, 0, 0), (1, 0, 1))
    beams = [
        beam(f"b{k}", models.segment(5, *ends[k : k + 2]), section, direction=(0.0, 1.0, 0.0))
        for k in range(2)
    ]
    return eliminate(assemble(beams, list(joined), [loads.Gravity((0.0, 0.0, -9.81))]))


def turned(system: System, angles: list[float], axis: ArrayLike = (0.0, 0.6, 0.8)) -> np.ndarray:
    """Unknowns of a chain of straight beams, each of which has turned by an angle of its own and
    hangs on the one before.
    """
    dim, q, end = system.dim, system.lift(system.x0).reshape(-1, system.dim).copy(), None
    for (_, first, last), angle in zip(system.coordinates, angles, strict=True):
        part = slice(first // dim, last // dim)
        places = system.unit[part] != 0.0
        Q = Rotation.from_rotvec(
            angle * np.asarray(axis) if dim == 3 else [0.0, 0.0, angle]
        ).as_matrix()[:dim, :dim]
        begin = np.outer(places, q[part][places][0])
        q[part] = (q[part] - begin) @ Q.T + (begin if end is None else np.outer(places, end))
        end = q[part][places][-1].copy()
    x = np.linalg.lstsq(system.lift.matrix.toarray(), q.ravel() - system.lift.offset, rcond=None)[0]
    np.testing.assert_allclose(system.lift(x), q.ravel(), atol=1e-12)
    return x


def begun(system: System) -> tuple[Compiled, Step]:
    """A step at the start of a motion."""
    model = compile_system(system)
    method = method_of(SCHEME, Newton(), SCHEME.step, model)
    step = first_step(model, system.x0, system.v0, method)
    start_step(PackedStep(model, step, None), SCHEME, start_of(model))
    return model, step


def place(model: Compiled, step: Step, x: np.ndarray) -> None:
    """Put a state at rest into the space of a step."""
    for name in ("v", "acceleration", "multipliers"):
        getattr(step.space, name)[:] = 0.0
    step.space.x[:], step.space.c[0] = x[model.order], step.method.c
    signals = signal_table(model.system, np.zeros(1))[0]
    step.space.signals[: len(signals)] = signals
    evaluation.evaluate(step, 0)


def solution(step: Step, r: np.ndarray) -> np.ndarray:
    """W'^-1 r (n,)."""
    step.space.rhs[0, : len(r)] = r
    rotated.apply(step, 0)
    return step.space.rhs[0, : len(r)].copy()


ROOT, TIP, NEXT = At("b0", "left"), At("b0", "right"), At("b1", "left")
HINGE, Z = joints.Revolute("hinge", ROOT, axis=(0.0, 0.0, 1.0)), (0.0, 0.0, 1.0)
CASES: dict[str, tuple[Callable[[], System], list[float], ArrayLike]] = {
    "one in the plane, dense": (lambda: models.spin_up(6), [0.9], Z),
    "two in space, a band": (lambda: models.double_pendulum(6), [0.7, -1.1], (0.0, 0.6, 0.8)),
    "three in the plane on a drive": (lambda: chain(3), [0.5, -0.8, 1.3], Z),
    "beams that are welded, on a hinge": (
        lambda: bars(HINGE, joints.Weld("weld", NEXT, TIP)),
        [0.9, 0.9],
        Z,
    ),
    "beams with torsion on pins": (
        lambda: bars(joints.Pin("p", ROOT), joints.Pin("q", TIP, NEXT)),
        [0.7, -1.1],
        (0.0, 0.6, 0.8),
    ),
    "beams with torsion on hinges": (
        lambda: bars(HINGE, joints.Revolute("q", TIP, NEXT, axis=Z)),
        [0.7, -1.1],
        Z,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_factors_of_beams_that_have_turned_are_exact(name: str) -> None:
    """Every beam by another angle: solutions and joints are those of new factors, where factors
    that stand still are wrong.
    """
    build, angles, axis = CASES[name]
    system = build()
    model, step = begun(system)
    r = np.random.default_rng(0).normal(size=system.size)
    place(model, step, turned(system, angles, axis))
    assert rotated.factorise(step, 0) == 0
    assert step.rotations.on[0] == 1
    exact, joined = solution(step, r), step.work.schur.copy()
    place(model, step, system.x0)
    assert rotated.factorise(step, 0) == 0
    still = solution(step, r)
    place(model, step, turned(system, angles, axis))
    rotated.follow(step, 0)
    found = solution(step, r)
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())
    np.testing.assert_allclose(
        step.work.schur, joined, rtol=1e-7, atol=1e-9 * np.abs(joined).max(initial=0.0)
    )
    assert np.abs(still - exact).max() > 0.1 * np.abs(exact).max()


def test_they_serve_many_steps_and_leave_the_motion_as_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A double pendulum in steps of 1 ms."""
    system = models.double_pendulum(8)
    own = integrate(system, SCHEME, 0.8)
    monkeypatch.setattr(
        beam_points,
        "rotations_of",
        lambda model: beam_points.nothing(model.system.dim, model.system.size),
    )
    plain, sharp = integrate(system, SCHEME, 0.8), integrate(system, SCHEME, 0.8, Newton(1e-15))
    assert own.statistics.factorisations < 0.25 * plain.statistics.factorisations
    assert own.statistics.iterations < 1.2 * plain.statistics.iterations
    assert np.abs(own.x - sharp.x).max() < 1e-7


def test_beams_that_are_slaved_to_others_do_not_rotate() -> None:
    """A point inside of a cell follows several points, and a rigid body's corner its place and its
    axes.
    """
    beam = cable("a", models.segment(4), models.SECTION, models.MATERIAL, dim=2)
    other = cable(
        "b", models.segment(4, (0.3, 0, 0), (0.3, 1, 0)), models.SECTION, models.MATERIAL, dim=2
    )
    held = [joints.Pin("p", At("a", "left")), joints.Pin("q", At("a", 0.3), At("b", "left"))]
    _, step = begun(eliminate(assemble([beam, other], held)))
    assert len(step.rotations.groups) == 0
    assert step.doors.follow == 0


def test_beams_that_nothing_holds_keep_their_momenta() -> None:
    """Two beams on a pin that is thrown turning, beside one that is held: momenta stay to round-off
    of 500 steps.
    """
    free = [
        cable(
            name,
            models.segment(4, (x, 1, 0), (x + 1.0, 1, 0)),
            models.SECTION,
            models.MATERIAL,
            dim=2,
        )
        for name, x in (("a", 0.0), ("b", 1.0))
    ]
    held = cable("held", models.segment(4), models.SECTION, models.MATERIAL, dim=2)
    pins = [joints.Pin("p", At("a", "right"), At("b", "left")), joints.Pin("q", At("held", "left"))]
    initial = {"a": Motion((1.0, 2.0), 4.0), "b": Motion((1.0, 6.0), -3.0)}
    system = eliminate(assemble([*free, held], pins, [loads.Gravity((0.0, 0.0))], initial=initial))
    _, step = begun(system)
    assert set(step.rotations.owners) == {2}
    motion = integrate(system, SCHEME, 0.5)
    total = (
        motion.v
        @ system.mass
        @ np.linalg.lstsq(
            system.lift.matrix.toarray(), np.kron(system.unit, [1.0, 0.0]), rcond=None
        )[0]
    )
    assert np.ptp(total) < 1e-10 * np.abs(total).max()


def test_the_kind_that_serves_longer_is_made() -> None:
    """Once in `TRIAL` factorisations the other one is, so that what a motion asks for may change."""
    R = beam_points.rotations_of(compile_system(models.spin_up(6)))
    kinds = []
    for lasting in (1, 6):
        for _ in range(4 * rotated.TRIAL):
            R.on[0] = rotated.choose(R, 0, 1, lasting if R.on[0] else 1)
            kinds.append(int(R.on[0]))
    few, many = np.split(np.array(kinds), 2)
    assert few[-rotated.TRIAL :].sum() == 1
    assert many[-rotated.TRIAL :].sum() == rotated.TRIAL - 1
