"""Joints of one's own in symbols: against those of the package, full, reduced and saved, driven,
and what is refused.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import cable, sections
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs, solve_statics
from fmbs_skfem.reduction import files
from fmbs_skfem.reduction.spaces import component, galerkin, pod
from fmbs_skfem.systems import At, System, assemble, check_joint, eliminate, fields
from fmbs_skfem.systems.connections import (
    constraint_laws,
    constraint_symbols,
    gears,
    joints,
    mechanism,
    redundancy,
)
from fmbs_skfem.systems.connections.own_joints import OwnJoint
from fmbs_skfem.systems.evaluation import space_of
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import models
from .parts import A1, B1, BOB, beams

TIGHT = Newton(tolerance=1e-12)


@dataclass(frozen=True)
class Link(OwnJoint, word="test_link"):
    """A rod of a length between two places, as `joints.RigidLink`, times a history."""

    name: str
    at: fields.Place
    to: fields.End
    length: Annotated[float, fields.quantity("m", "> 0")]
    history: fields.History | None = None

    @staticmethod
    def equations(at: Any, to: Any, length: Any, history: Any) -> Any:
        apart = at.position - to.position
        return {"length": (apart.dot(apart) - (length * history) ** 2) / (2 * length)}


@dataclass(frozen=True)
class Rail(OwnJoint, word="test_rail"):
    """A point on the graph y = c x^2 from the point `start`, and in space z = 0."""

    name: str
    at: fields.Place
    start: Annotated[tuple[float, ...], fields.vector("m")]
    c: Annotated[float, fields.quantity("1/m")]

    @staticmethod
    def equations(at: Any, start: Any, c: Any) -> Any:
        x, y, *z = at.position - start
        return {"rail": y - c * x**2} | dict(zip("z", z, strict=False))


for declared in (
    Link,
    Rail,
):  # scenes of other tests do not know them, whichever of these run in the same process
    joints.Joint.known.pop(declared.word)


def stretch(t: np.ndarray) -> np.ndarray:
    return np.asarray(1.0 + 0.1 * np.sin(2.0 * t) ** 2)


def every_own_joint(dim: int) -> list[OwnJoint]:
    return [
        Link("between", A1, BOB, np.sqrt(2.0)),
        Link("to a point", A1, (1.0, 0.3, 0.0)[:dim], 0.3),
        Link("driven", A1, BOB, np.sqrt(2.0), stretch),
        Rail("rail", B1, (1.0, -0.5, 0.0)[:dim], 0.5),
    ]


EVERY = [(dim, joint) for dim in (2, 3) for joint in every_own_joint(dim)]


@pytest.mark.parametrize(
    "dim, joint", [pytest.param(dim, joint, id=f"{dim}-{joint.name}") for dim, joint in EVERY]
)
def test_contract(dim: int, joint: OwnJoint) -> None:
    check_joint(beams(dim), joint)


def swinging(dim: int, *links: joints.Joint) -> System:
    beam = cable(
        "beam", models.segment(4), sections.Circular(0.01), sections.Material(1e9, 2300.0), dim=dim
    )
    return assemble(
        [beam],
        [joints.Pin("pin", At("beam", "left")), *links]
        if not isinstance(links[0], Rail)
        else links,
        [loads.Gravity((0.0, -9.81, 1.0)[:dim])],
        outputs={
            "tip": probes.Position(At("beam", "right")),
            "link": probes.Reaction(links[0].name),
        },
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_the_same_as_a_joint_of_the_package(dim: int) -> None:
    """Motion, reaction, equilibrium, degrees of freedom, and velocities that settle after every
    step.
    """
    end = (1.5, 0.5, 0.0)[:dim]
    own, given = (
        swinging(dim, kind("link", At("beam", "right"), end, np.sqrt(0.5)))
        for kind in (Link, joints.RigidLink)
    )
    one, two = (
        outputs(integrate(eliminate(system), GeneralizedAlpha(1e-3), 0.2, TIGHT))
        for system in (own, given)
    )
    for name in two:
        assert_allclose(one[name], two[name], rtol=1e-6, atol=1e-9)
    assert mechanism.analyse(own).mobility == mechanism.analyse(given).mobility
    if dim == 2:
        one, two = (outputs(solve_statics(eliminate(system), 4, TIGHT)) for system in (own, given))
        assert_allclose(one["tip_y"], two["tip_y"], atol=1e-10)


def test_redundant_ones_are_found() -> None:
    links = [Link(name, At("beam", "right"), (1.5, 0.5), np.sqrt(0.5)) for name in ("one", "two")]
    with pytest.warns(match="redundant constraint rows are left out"):
        left = redundancy.without_redundant(eliminate(swinging(2, *links)))
    assert len(left.constraints.names) == 1
    assert len(left.constraints.laws[0]) == 1


def test_a_drive_of_ones_own() -> None:
    """The length follows its history, and its derivatives enter the start and the velocities."""
    link = Link(
        "link", At("beam", "right"), (1.5, 0.5), np.sqrt(0.5), of_time("1 + 0.1 * sin(2 * t)")
    )
    motion = integrate(eliminate(swinging(2, link)), GeneralizedAlpha(1e-3), 0.5, TIGHT)
    found, t = outputs(motion), motion.times
    apart = np.hypot(found["tip_x"] - 1.5, found["tip_y"] - 0.5)
    assert_allclose(apart, np.sqrt(0.5) * (1 + 0.1 * np.sin(2 * t)), atol=1e-9)


def test_reduced_and_saved_models(tmp_path: Path) -> None:
    raw, scheme = (
        swinging(2, Link("link", At("beam", "right"), (1.5, 0.5), np.sqrt(0.5))),
        GeneralizedAlpha(1e-3),
    )
    full = integrate(eliminate(raw), scheme, 0.2, TIGHT)
    data, level = galerkin.snapshots(full), component.body_level(raw)
    bases = {
        name: pod.basis(data.q[:, component.rows_of(raw, part)].T, 1e-14)
        for name, part in level.items()
    }
    reduced = galerkin.reduce_system(raw, level, bases)
    saved, expected = files.load(files.save(reduced, tmp_path / "model.h5")), outputs(full)
    for system in (reduced, saved, pickle.loads(pickle.dumps(reduced))):
        found = outputs(integrate(system, scheme, 0.2, TIGHT))
        assert_allclose(found["tip_y"], expected["tip_y"], atol=1e-4)


def test_large_models(monkeypatch: pytest.MonkeyPatch) -> None:
    raw, scheme = (
        swinging(2, Link("link", At("beam", "right"), (1.5, 0.5), np.sqrt(0.5))),
        GeneralizedAlpha(1e-3),
    )
    expected = outputs(integrate(raw, scheme, 0.05, TIGHT))
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 1)
    monkeypatch.setattr("fmbs_skfem.systems.layouts.DENSE", 1)
    motion = integrate(raw, scheme, 0.05, TIGHT)
    assert motion.statistics.solver.startswith("sparse")
    assert_allclose(outputs(motion)["tip_y"], expected["tip_y"], atol=1e-8)


@pytest.mark.parametrize("wheels", gears.WHEELS)
def test_gears_are_what_their_symbols_say(wheels: int) -> None:
    rng, law, count = np.random.default_rng(wheels), gears.gear(wheels), 2 * wheels
    paths, p, multiplier, leads = (
        rng.normal(size=(4, count)),
        rng.normal(size=wheels),
        rng.normal(size=1),
        rng.normal(size=2),
    )
    y, own = constraint_symbols.rows(count), constraint_symbols.numbers(wheels)
    phi = sum(own[k] * sympy.atan2(y[2 * k + 1], y[2 * k]) for k in range(wheels))
    parts = (
        constraint_symbols.rows,
        constraint_symbols.steps,
        constraint_symbols.rates,
        constraint_symbols.accelerations,
    )
    values = {
        one: value
        for part, row in zip(parts, paths, strict=True)
        for one, value in zip(part(count), row, strict=True)
    }
    values |= dict(zip([*own, *sympy.symbols("second third")], [*p, *leads], strict=True))

    def value(expression: Any) -> float:
        return float(sympy.sympify(expression).subs(values))

    found = constraint_laws.compile_rows(constraint_laws.one(law, 0, range(count), [*p, 100.0]), 0)
    rhs, drift = np.zeros((1, 1)), np.zeros((1, 1))
    H, Jy = np.zeros(len(law.pairs)), np.zeros((1, count))
    space = space_of(y=paths[0], multipliers=multiplier, rhs=rhs, Jy=Jy, H=H)
    law.routines.constrain(space, found.address)
    law.routines.slopes(space, found.address)
    law.routines.drift(
        space_of(paths=paths, leads=leads, multipliers=multiplier, rhs=drift), found.address
    )
    slopes = constraint_symbols.drift(constraint_symbols.RowSymbols(phi, count, wheels))
    assert_allclose([rhs[0, 0], drift[0, 0]], [value(phi), value(slopes)], rtol=1e-12)
    assert_allclose(Jy[0], [value(sympy.diff(phi, one)) for one in y], rtol=1e-12)
    assert_allclose(
        H, [multiplier[0] * value(sympy.diff(phi, y[i], y[j])) for i, j in law.pairs], rtol=1e-11
    )


def test_wrong_classes_are_named() -> None:
    @dataclass(frozen=True)
    class Open(OwnJoint, word=None):
        name: str
        at: fields.Place

        @staticmethod
        def equations(at: Any) -> Any:
            return {"x": sympy.symbols("k") * at.position[0]}

    @dataclass(frozen=True)
    class Rolling(OwnJoint, word=None):
        name: str
        at: fields.Place

        @staticmethod
        def equations(at: Any) -> Any:
            return {"x": at.velocity[0]}

    for kind, got in ((Open, "k in 'x'"), (Rolling, "v0 in 'x'")):
        with pytest.raises(
            InputError, match=f"expected expressions of its arguments without velocities, got {got}"
        ):
            assemble(beams(2), [kind("one", A1)])
