"""Forces by a decorator, in symbols and as functions of Python: exact motions, tangents, reduced
and saved models, scenes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import cable, point_mass, rigid, sections
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    energies,
    integrate,
    linearise,
    outputs,
    real_modes,
)
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import At, Motion, System, assemble, check_force, eliminate, fields
from fmbs_skfem.systems import force as sum_of
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.force_functions import force
from fmbs_skfem.systems.forces.own_forces import norm
from fmbs_skfem.systems.measures import probes

from .. import models
from ..forms import forms
from .parts import A1, B1, BOB, beams

TIGHT = Newton(tolerance=1e-12)
BALL = At("ball", "center")
Factor = Annotated[float, fields.quantity("kg/m", ">= 0")]
Stiffness = Annotated[float, fields.quantity("N/m", ">= 0")]


@pytest.fixture(autouse=True)
def _apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """What this module declares is known to its tests alone."""
    monkeypatch.setattr(
        loads.Load, "known", {**loads.Load.known, **{kind.word: kind for kind in KINDS}}
    )


@force
def decorated_drag(at: fields.Place, factor: Factor) -> Any:
    """Drag of the square of the speed."""
    return [(at.position, -factor * norm(at.velocity) * at.velocity)]


@force(compiled=False)
def called_drag(at: fields.Place, factor: Factor) -> Any:
    return [(at.position, -factor * np.linalg.norm(at.velocity) * at.velocity)]


@force(energy=True)
def cubic(
    at: fields.Place, stiffness: Stiffness, hardening: float = 0.0, to: fields.End = None
) -> Any:
    square = (at.position - to.position).dot(at.position - to.position)
    return stiffness / 2 * square + hardening / 4 * square**2


@force(compiled=False)
def called_cubic(
    at: fields.Place, stiffness: Stiffness, hardening: float = 0.0, to: fields.End = None
) -> Any:
    """By a loop with a branch, as no symbols can be."""
    apart = at.position - to.position
    push = np.zeros(len(apart))
    for k, part in enumerate(apart):
        push[k] -= (stiffness + hardening * apart @ apart) * part if part != 0.0 else 0.0
    return [(at.position, push), (to.position, -push)]


@force(drives=True)
def swirl(
    t: Any,
    at: fields.Place,
    other: fields.Place,
    size: Annotated[tuple[float, float], fields.vector("N")],
) -> Any:
    """A force that turns with t, against one on another place, and one on the slope of the first."""
    push = type(at.position)([size[0] * t, size[1], 0][: len(at.position)])
    return [(at.position, push), (other.position, -push), (at.axes[0], t * other.velocity)]


@force(compiled=False, drives=True)
def called_swirl(
    t: float,
    at: fields.Place,
    other: fields.Place,
    size: Annotated[tuple[float, float], fields.vector("N")],
) -> Any:
    push = np.array([size[0] * t, size[1], 0.0])[: len(at.position)]
    return [(at.position, push), (other.position, -push), (at.axes[0], t * other.velocity)]


@force(drives=True)
def twist(at: fields.Place, moment: Annotated[tuple[float, ...], fields.vector("N m")]) -> Any:
    return at.turn(moment if len(at.position) == 3 else moment[2])


@force(compiled=False, drives=True)
def called_twist(
    at: fields.Place, moment: Annotated[tuple[float, ...], fields.vector("N m")]
) -> Any:
    return at.turn(moment if len(at.position) == 3 else moment[2])


@force(compiled=False)
def soft(
    at: fields.Place,
    stiffness: Stiffness,
    length: Annotated[float, fields.quantity("m")],
    to: fields.End = None,
) -> Any:
    apart = at.position - to.position
    return [(at.position, -stiffness * length * np.tanh(apart / length))]


KINDS = (
    decorated_drag,
    called_drag,
    cubic,
    called_cubic,
    swirl,
    called_swirl,
    twist,
    called_twist,
    soft,
)
for one in KINDS:
    del loads.Load.known[one.word]


def pairs(dim: int) -> list[tuple[loads.Load, loads.Load]]:
    given: list[tuple[Any, Any, tuple[Any, ...]]] = [
        (decorated_drag, called_drag, (B1, 0.7)),
        (cubic, called_cubic, (A1, 10.0, 30.0, BOB)),
        (swirl, called_swirl, (A1, B1, (0.3, 0.2))),
    ]
    return [
        (kind(f"{kind.word} {dim}", *rest), called(f"{called.word} {dim}", *rest))
        for kind, called, rest in given
    ]


@pytest.mark.parametrize("dim", [2, 3])
def test_contract_and_the_same_by_both_ways(dim: int) -> None:
    for both in pairs(dim):
        for load in both:
            check_force(beams(dim), load)
        x = np.random.default_rng(0).normal(size=assemble(beams(dim)).size)
        found = [sum_of(assemble(beams(dim), loads=[load]), x, 0.3 * x, 0.4) for load in both]
        assert_allclose(found[1], found[0], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", [twist, called_twist])
@pytest.mark.parametrize("dim", [2, 3])
def test_turn_is_the_moment_of_the_package(dim: int, kind: Any) -> None:
    """On stretched slopes and on frames."""
    bodies = [
        *beams(dim),
        rigid.rigid("disc", 1.0, np.eye(3) if dim == 3 else np.array(1.0), np.zeros(dim), dim=dim),
    ]
    moment = np.array([0.4, -0.2, 0.3])
    for at in (A1, At("disc", "frame")):
        plain = loads.Moment("m", at, moment if dim == 3 else 0.3)
        both = [assemble(bodies, loads=[load]) for load in (kind("m", at, moment), plain)]
        x = both[0].x0 + (
            0.3 * np.random.default_rng(0).normal(size=both[0].size) if at is A1 else 0.0
        )
        found, expected = (sum_of(system, x) for system in both)
        assert_allclose(found, expected, atol=1e-12 * abs(expected).max())


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_differences_are_small_beside_bodies_of_any_size(size: float) -> None:
    """Vibration on a spring of Python that is soft beyond a tenth of the body."""
    places = {"a": (-size, 0.0), "b": (size, 0.0)}
    body = rigid.rigid("b", 2.0, np.array(0.1 * size**2), (0.0, 0.0), dim=2, places=places)
    system = assemble([body], loads=[soft("spring", At("b", "frame"), 50.0, 0.1 * size)])
    assert_allclose(
        real_modes(linearise(eliminate(system)), 3).squares, [0.0, 25.0, 25.0], rtol=1e-7, atol=1e-7
    )


@pytest.mark.parametrize("kind", [decorated_drag, called_drag])
def test_drag(kind: Any) -> None:
    """m v' = - c v^2: x = m / c log(1 + c v0 t / m)."""
    system = assemble(
        [point_mass("ball", 2.0, np.zeros(2))],
        loads=[kind("drag", BALL, 3.0)],
        outputs={"x": probes.Position(BALL)},
        initial={"ball": Motion(velocity=(4.0, 0.0))},
    )
    motion = integrate(system, GeneralizedAlpha(2e-3), 1.0, TIGHT)
    assert_allclose(outputs(motion)["x_x"], 2.0 / 3.0 * np.log(1 + 6.0 * motion.times), atol=2e-5)
    assert_allclose(energies(motion)[:, 3], 16.0, rtol=1e-4)


def swinging(*held: loads.Load) -> System:
    beam = cable(
        "beam", models.segment(4), sections.Circular(0.01), sections.Material(1e9, 2300.0), dim=2
    )
    pin = joints.Pin("pin", At("beam", "left"))
    tip = {"tip": probes.Position(At("beam", "right"))}
    return assemble([beam], [pin], [loads.Gravity((0.0, -9.81)), *held], outputs=tip)


def test_reduced_hyper_reduced_and_saved_models(tmp_path: Path) -> None:
    """Functions of Python as well, which files refuse."""
    tip, scheme = At("beam", "right"), GeneralizedAlpha(1e-3)
    raw = swinging(decorated_drag("drag", tip, 0.3), cubic("spring", tip, 20.0, 50.0))
    full = integrate(eliminate(raw), scheme, 0.2, TIGHT)
    expected = outputs(full)
    for system in forms(raw, full, 1e-14, tmp_path / "model.h5"):
        for name, values in outputs(integrate(system, scheme, 0.2, TIGHT)).items():
            assert_allclose(values, expected[name], atol=2e-4)
    called = eliminate(
        swinging(called_drag("drag", tip, 0.3), called_cubic("spring", tip, 20.0, 50.0))
    )
    found = outputs(integrate(called, scheme, 0.03, TIGHT))
    assert_allclose(found["tip_y"], expected["tip_y"][:31], atol=1e-9)
    with pytest.raises(InputError, match="got OfPython; no file holds its functions of Python"):
        files.save(called, tmp_path / "called.h5")


def test_scenes() -> None:
    """By the name of the function, with the units of its arguments."""
    text = (
        "schema: 1\ndimension: 2\nbodies: {ball: {type: point_mass, mass: 2 kg, position: [0, 0]}}\n"
        "loads: {spring: {type: cubic, at: ball, stiffness: 5 N/mm}}\nanalysis: {type: dynamic, duration: 1 s, step: 1 ms}\n"
    )
    (load,) = reading.loads(text).loads.values()
    assert load == cubic("spring", At("ball"), 5000.0)
    assert build.system(reading.loads(text)).loads.forces
    with pytest.raises(InputError, match=r"loads.spring.stiffness: expected"):
        reading.loads(text.replace("5 N/mm", "5 kg"))


def test_what_is_no_force_is_named() -> None:
    with pytest.raises(
        InputError,
        match=r"@force nothing: expected arguments that say what they are, .* got 'mass'",
    ):

        @force
        def nothing(at: fields.Place, mass) -> Any:  # type: ignore[no-untyped-def]
            return []

    with pytest.raises(InputError, match="leave out compiled=False"):
        force(lambda: 0, energy=True, compiled=False)

    @force(compiled=False)
    def strange(at: fields.Place) -> Any:
        return [(2 * at.position, at.velocity)]

    with pytest.raises(
        InputError,
        match=r"load 'one': strange: expected pairs of a vector of a place and 2 forces on it",
    ):
        integrate(
            assemble([point_mass("ball", 2.0, np.zeros(2))], loads=[strange("one", BALL)]),
            GeneralizedAlpha(1e-2),
            0.1,
        )
    del loads.Load.known["strange"]
