"""Every joint keeps its gap closed while the bodies move, eliminated or as multipliers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.systems import At, System, assemble, compile_system, eliminate
from fmbs_skfem.systems.compiled import gap
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from .. import models

SECTION = sections.Given(EA=1e4, EI=1.0, rhoA=1.0)
I, J = ("I", "left"), ("I", "right")


def first(dim: int) -> Body:
    return body.cable("I", models.segment(8), SECTION, dim=dim)


def second(dim: int, end: tuple[float, float, float] = (1.0, 1.0, 0.0)) -> Body:
    return body.cable("II", models.segment(8, (1, 0, 0), end), SECTION, dim=dim)


def pinned(dim: int, *more: joints.Joint) -> list[joints.Joint]:
    return [joints.Pin("pin", At(*I)), *more]


def padded(dim: int, *values: float) -> tuple[float, ...]:
    return (*values, *(0.0,) * (dim - len(values)))


Model = tuple[list[Body], list[joints.Joint]]


def shaken(dim: int) -> Model:
    moves = (lambda t: 0.1 * np.sin(5 * t) ** 2, lambda t: 0.1 * t**3, lambda t: 0.0 * t)
    return [first(dim)], [joints.DrivenPosition("driven", At(*I), moves[:dim])]


def turned(dim: int) -> Model:
    axis = None if dim == 2 else (0.0, 0.6, 0.8)
    return [first(dim)], pinned(dim, joints.DrivenAngle("driven", At(*I), lambda t: 3 * t**2, axis))


def tied(dim: int) -> Model:
    return [first(dim), second(dim)], pinned(
        dim, joints.RigidLink("link", At("I", 0.5), At("II", 0.5))
    )


MODELS: dict[str, Callable[[int], Model]] = {
    "pin": lambda dim: ([first(dim)], pinned(dim)),
    "pin inside": lambda dim: ([first(dim)], [joints.Pin("pin", At("I", 0.37))]),
    "pin of two": lambda dim: (
        [first(dim), second(dim)],
        pinned(dim, joints.Pin("q", At(*J), At("II", "left"))),
    ),
    "clamp": lambda dim: ([first(dim)], [joints.Clamp("clamp", At(*I))]),
    "weld": lambda dim: (
        [first(dim), second(dim, (2, 0, 0))],
        pinned(dim, joints.Weld("weld", At(*J), At("II", "left"))),
    ),
    "link to ground": lambda dim: (
        [first(dim)],
        [joints.RigidLink("link", At(*I), padded(dim, 0.0, 1.0))],
    ),
    "link of two": tied,
    "slider": lambda dim: ([first(dim)], [joints.Slider("slider", At(*I), padded(dim, 1.0, 1.0))]),
    "driven position": shaken,
    "driven angle": turned,
}


def corner(dim: int) -> Model:
    return [first(dim), second(dim)], pinned(dim, joints.Weld("weld", At(*J), At("II", "left")))


def largest_gap(found: Trajectory) -> float:
    """Largest |Phi| of all joints, those that were eliminated included."""
    full = found.system.full or found.system
    model = compile_system(full)
    assert len(full.constraints.names) > 0
    return max(
        float(np.abs(gap(model, found.system.lift(x), t)[0]).max())
        for x, t in zip(found.x, found.times, strict=True)
    )


FORMS = pytest.mark.parametrize(
    "form", [eliminate, lambda system: system], ids=["eliminated", "multipliers"]
)


def held(model: Model, dim: int, form: Callable[[System], System]) -> None:
    system = form(assemble(*model, [loads.Gravity((*padded(dim - 1, 0.0), -9.81))]))
    found = integrate(system, GeneralizedAlpha(1e-3), 0.1, Newton(tolerance=1e-12))
    assert found.statistics.steps == 100
    assert found.statistics.halved == 0
    assert np.abs(found.x[-1] - found.x[0]).max() > 1e-3
    assert largest_gap(found) < 1e-10


@FORMS
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", MODELS)
def test_joints_hold(name: str, dim: int, form: Callable[[System], System]) -> None:
    held(MODELS[name](dim), dim, form)


@FORMS
def test_welded_corner_holds(form: Callable[[System], System]) -> None:
    held(corner(2), 2, form)


def angle(slopes: np.ndarray) -> np.ndarray:
    return np.asarray(np.arctan2(slopes[:, 1], slopes[:, 0]))


@pytest.mark.parametrize("kind", [joints.Pin, joints.Weld])
def test_closed_loop_of_three_bars(kind: type[joints.Pin] | type[joints.Weld]) -> None:
    """Four-bar linkage, pinned or with one welded corner: closed over half a second of large
    motion.
    """
    crank = body.cable("crank", models.segment(6, (0, 0, 0), (0, 0.5, 0)), SECTION, dim=2)
    coupler = body.cable("coupler", models.segment(6, (0, 0.5, 0), (1, 0.5, 0)), SECTION, dim=2)
    rocker = body.cable("rocker", models.segment(6, (1, 0.5, 0), (1, 0, 0)), SECTION, dim=2)
    system = assemble(
        [crank, coupler, rocker],
        [
            joints.Pin("a", At("crank", "left")),
            kind("b", At("crank", "right"), At("coupler", "left")),
            joints.Pin("c", At("coupler", "right"), At("rocker", "left")),
            joints.Pin("d", At("rocker", "right")),
        ],
        [loads.PointForce("push", At("crank", "right"), (5.0, 0.0))],
    )
    found = integrate(eliminate(system), GeneralizedAlpha(1e-3), 0.5, Newton(tolerance=1e-13))
    assert largest_gap(found) < 1e-10
    q = np.array([found.system.lift(x) for x in found.x])
    moved = q.reshape(len(q), -1, 2)[-1] - q.reshape(len(q), -1, 2)[0]
    assert np.linalg.norm(moved, axis=1).max() > (0.3 if kind is joints.Pin else 0.1)
