"""Bodies from meshes: mass, reference curvature, places, and energies against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Curvature, Given, cable, point_mass
from fmbs_skfem.bodies.body import Body, locate, probe
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes import line
from fmbs_skfem.systems import System, assemble, compile_system, compiled, kernels

from ..models import polyline, straight

SECTION = Given(EA=2000.0, EI=3.0, rhoA=0.5)
SPACES: list[dict[str, Any]] = [
    {"ancf": True},
    *({"degree": p, "continuity": k} for p in range(2, 6) for k in range(1, p)),
]
ROTATION = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()


def arc(cells: int, radius: float = 0.8) -> Any:
    """A quarter circle about the origin from the x axis to the y axis."""
    angle = np.linspace(0.0, np.pi / 2, cells + 1)
    return polyline(radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1))


def wave(cells: int) -> Any:
    """A line that curves in space without an inflection in its plane of bending."""
    s = np.linspace(0.0, 1.0, cells + 1)
    return polyline(np.stack([np.cos(2 * s), np.sin(2 * s), 0.5 * s**2], axis=1))


def energy(system: System, q: np.ndarray) -> float:
    model = compile_system(system)
    body, work = model.buffers()
    return float(kernels.elastic_energy(model.arrays, np.ascontiguousarray(q.ravel()[model.order]), body[0], work))


def force(system: System, q: np.ndarray) -> np.ndarray:
    return compiled.forces(compile_system(system), q.ravel(), np.zeros(q.size)).reshape(q.shape)


def moments(body: Body) -> tuple[float, np.ndarray]:
    """Mass [kg] and centre of mass [m]."""
    mass = body.constant @ (body.mass @ body.constant)
    return float(mass), np.asarray(body.constant @ (body.mass @ body.reference)) / mass


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("space", SPACES)
def test_mass_of_a_straight_beam_is_exact(space: dict[str, Any], dim: int) -> None:
    """m = rhoA L, centre in the middle, and int rhoA (x - a)^2 dS = rhoA L^3 / 3, from unequal cells."""
    mesh = polyline(np.outer([0.0, 0.5, 0.7, 2.0], [0.6, 0.8, 0.0]) + [1.0, 0.0, 0.0])
    body = cable("beam", mesh, SECTION, dim=dim, **space)
    mass, centre = moments(body)
    assert_allclose(mass, 1.0, rtol=1e-12)
    assert_allclose(centre, [1.6, 0.8, 0.0][:dim], atol=1e-12)
    away = body.reference - np.outer(body.constant, [1.0, 0.0, 0.0][:dim])
    assert_allclose(np.sum(away * (body.mass @ away)), 0.5 * 2.0**3 / 3, rtol=1e-12)
    assert abs(body.mass - body.mass.T).max() < 1e-15
    assert np.linalg.eigvalsh(body.mass.toarray())[0] > 0.0


def orders(error: Callable[[int], float], cells: tuple[int, ...]) -> list[float]:
    errors = [error(n) for n in cells]
    return [float(np.log2(a / b)) for a, b in pairwise(errors)]


@pytest.mark.parametrize("ancf", [False, True])
def test_mass_and_centre_of_an_arc_converge_with_order_four(ancf: bool) -> None:
    """m = rhoA R pi / 2, centre at 2 R / pi in x and y."""

    def error(cells: int) -> float:
        mass, centre = moments(cable("arc", arc(cells), SECTION, dim=2, ancf=ancf))
        return abs(mass - 0.2 * np.pi) + float(np.abs(centre - 1.6 / np.pi).max())

    assert min(orders(error, (8, 16, 32))) > 3.7
    assert error(32) < 1e-6


def test_reference_curvature_of_an_arc_converges_with_order_two() -> None:
    """kappa0 = 1 / R inside; planar curvature keeps the sense of the turn."""

    def curvature(cells: int, dim: int = 2) -> np.ndarray:
        body = cable("arc", arc(cells), SECTION, dim=dim)
        assert body.cells is not None
        return np.asarray(body.cells.section[2, :, cells // 4 : -cells // 4])

    assert min(orders(lambda cells: float(np.abs(curvature(cells) - 1.25).max()), (8, 16, 32))) > 1.8
    assert_allclose(curvature(16, 3), curvature(16, 2), rtol=1e-12)
    backwards = cable("arc", polyline(arc(16).points[::-1]), SECTION, dim=2)
    assert backwards.cells is not None
    assert backwards.cells.section[2].max() < 0.0


@pytest.mark.parametrize("curvature", [Curvature.EXACT, Curvature.MATERIAL])
@pytest.mark.parametrize("make", [arc, wave])
def test_ancf_and_splines_of_one_mesh_are_the_same_body(make: Callable[[int], Any], curvature: Curvature) -> None:
    """With q_spline = T q_ancf: equal energies, f_ancf = T^T f_spline, m_ancf = T^T m_spline T."""
    ancf = cable("body", make(6), SECTION, ancf=True, curvature=curvature)
    spline = cable("body", make(6), SECTION, curvature=curvature)
    assert isinstance(ancf.space, line.Hermite)
    T = line.hermite_to_bspline(ancf.space)
    # the two fits of a curve that lies in neither space differ: one reference for both
    same = replace(spline, reference=T @ ancf.reference)
    assert_allclose(same.reference, spline.reference, atol=2e-3)
    same = replace(same, mass=spline.mass, cells=ancf_cells(ancf, spline))
    q = ancf.reference + 0.02 * np.random.default_rng(3).normal(size=ancf.reference.shape)
    first, second = assemble([ancf]), assemble([same])
    assert energy(second, T @ q) == pytest.approx(energy(first, q), rel=1e-12)
    assert_allclose(T.T @ force(second, T @ q), force(first, q), atol=1e-10 * np.abs(force(first, q)).max())


def ancf_cells(ancf: Body, spline: Body) -> Any:
    return spline.cells
