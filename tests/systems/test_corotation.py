"""Turned tangents of planar bodies against the assembled ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem.bodies import body
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.reduction.spaces.pod import Basis
from fmbs_skfem.systems import (
    At,
    Rayleigh,
    System,
    assemble,
    compile_system,
    compiled,
    evaluation,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.system import multiply_out
from fmbs_skfem.systems.terms import cells, points
from fmbs_skfem.systems.terms.corotation import add_rotated_tangent

from .. import models

SCHEME, NEWTON, DURATION = GeneralizedAlpha(1e-3), Newton(tolerance=1e-12), 0.5


def complete(raw: System) -> System:
    """The system in all its coordinates as a dense basis."""
    components = component.body_level(raw)
    rows = {name: component.rows_of(raw, members) for name, members in components.items()}
    found = {name: Basis(np.eye(len(row)), raw.x0[row], np.zeros(0)) for name, row in rows.items()}
    return galerkin.reduce_system(raw, components, found)


def spun(dim: int = 2, beta: float = 0.0, torque: float = 0.2, cells: int = 4) -> System:
    """Two beams hinged to each other and to the ground, driven by a moment."""
    one = body.cable("one", models.segment(cells), models.SECTION, models.MATERIAL, dim=dim)
    two = body.cable(
        "two", models.segment(3, (1, 0, 0), (1.7, 0, 0)), models.SECTION, models.MATERIAL, dim=dim
    )
    held = [
        joints.Pin("A", At("one", "left")),
        joints.Pin("B", At("one", "right"), At("two", "left")),
    ]
    pushes = (
        [loads.Moment("motor", At("one", "left"), torque)]
        if dim == 2
        else [loads.Gravity((0.0, 0.0, -9.81))]
    )
    return complete(assemble([one, two], held, pushes, Rayleigh(0.0, beta) if beta else None))


def turned(system: System, angles: tuple[float, ...], shift: float = 0.0) -> np.ndarray:
    """Unknowns with the bodies turned about the origin and shifted."""
    q = system.lift(system.x0).reshape(-1, 2).copy()
    for (_, first, last), theta in zip(system.coordinates, angles, strict=True):
        R = np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]])
        q[first // 2 : last // 2] = q[first // 2 : last // 2] @ R + shift * system.unit[
            first // 2 : last // 2, None
        ] * [1.0, -2.0]
    return np.linalg.lstsq(
        np.asarray(system.lift.matrix), q.ravel() - system.lift.offset, rcond=None
    )[0]


def part_tangent(system: System, number: int, x: np.ndarray) -> np.ndarray:
    """Assembled tangent of one body."""
    model = compile_system(system)
    found, table = model.evaluation
    found.space.x[:], found.space.gh[0] = x[model.order], 0.0
    assert evaluation.part_tangent(table, number) == 0
    return found.space.W.copy()


@pytest.mark.parametrize("angles", [(0.0, 0.0), (0.4, -2.5), (3.1, 9.0)])
def test_exact_for_rigid_motion(angles: tuple[float, float]) -> None:
    """K(theta) is the tangent at any turned and shifted reference shape, every body with its own
    angle, to round-off.
    """
    system = spun()
    model = compile_system(system)
    A, x = model.arrays, turned(system, angles, 0.3)
    W, K = np.zeros((system.size, system.size)), sum(part_tangent(system, k, x) for k in range(2))
    add_rotated_tangent(A.corotation, x, 0.0, W)
    np.testing.assert_allclose(W, K, rtol=0, atol=1e-9 * np.abs(K).max())


def test_damping_times() -> None:
    """With stiffness-proportional damping the tangent carries the factor 1 + gh beta."""
    system = spun(beta=0.02)
    model = compile_system(system)
    A, x, W = model.arrays, turned(system, (0.4, -2.5)), np.zeros((system.size, system.size))
    add_rotated_tangent(A.corotation, x, 50.0, W)
    K = compiled.elastic_tangent(model, x, 50.0)
    assert np.abs(K).max() > 1.9 * max(np.abs(part_tangent(system, k, x)).max() for k in range(2))
    np.testing.assert_allclose(W, K, rtol=0, atol=1e-9 * np.abs(K).max())


def test_the_same_motion_as_with_assembled_tangents() -> None:
    """The tangent decides how fast the iteration contracts, not where it ends: several turns, equal
    to the Newton tolerance.
    """
    system = spun()
    fast = integrate(system, SCHEME, DURATION, NEWTON)
    slow = integrate(spun_without_turning(system), SCHEME, DURATION, NEWTON)
    assert len(compile_system(fast.system).arrays.corotation.table) == 2
    assert np.abs(fast.x - slow.x).max() < 1e-7 * np.abs(slow.x).max()
    assert np.abs(fast.x[-1] - fast.x[0]).max() > 0.1


def spun_without_turning(system: System) -> System:
    """The same system with its bodies under other names, which no tangent can be turned for."""
    return replace(
        system, elastic=tuple(replace(part, name=f"{part.name} alone") for part in system.elastic)
    )


def test_systems_in_space_and_full_systems_assemble() -> None:
    assert len(compile_system(spun(dim=3)).arrays.corotation.table) == 0
    beam = body.cable("beam", models.segment(3), models.SECTION, models.MATERIAL, dim=2)
    assert (
        len(
            compile_system(
                assemble([beam], [joints.Pin("A", At("beam", "left"))], [])
            ).arrays.corotation.table
        )
        == 0
    )


def test_a_space_without_the_turned_shapes_assembles() -> None:
    """Small motions of a clamped beam: a basis that cannot turn the beam has no turned tangents."""
    raw = assemble(
        [body.cable("beam", models.segment(4), models.SECTION, models.MATERIAL, dim=2)],
        [joints.Clamp("A", At("beam", "left"))],
        [],
    )
    bend = np.zeros((raw.size, 1))
    bend[1::2, 0] = np.linspace(0.0, 1.0, raw.size // 2) ** 2
    bend /= np.linalg.norm(bend)
    system = galerkin.reduce_system(
        raw, {"beam": ("beam",)}, {"beam": Basis(bend, raw.x0, np.zeros(0))}
    )
    assert len(compile_system(system).arrays.corotation.table) == 0


@pytest.mark.parametrize("sampled", [True, False])
def test_points_and_cells_in_blocks(sampled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that are handled in blocks have the energy, forces, tangents and turned tangents of all
    at once.
    """
    system = multiply_out(spun(beta=0.02)) if sampled else spun(beta=0.02, cells=9)
    x, v = np.random.default_rng(1).standard_normal((2, system.size))
    whole = compile_system(system)
    monkeypatch.setattr(points, "ROOM", 500)
    monkeypatch.setattr(cells, "BLOCK", 2)
    parts = compile_system(replace(system))
    assert len(parts.terms) > len(whole.terms) == 2
    found = [
        (
            compiled.strain_energy(model, x),
            compiled.forces(model, x, v),
            compiled.tangent(model, x, np.zeros(model.constraints), 0.0, 5.0).toarray(),
            model.arrays.corotation.numbers,
        )
        for model in (whole, parts)
    ]
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-12 * np.abs(one).max())
