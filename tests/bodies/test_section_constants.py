"""Constants of sections against closed forms, published numbers, bounds from both sides and
thin-walled theory.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from fmbs_skfem.bodies.beams import saint_venant, section_constants, section_shapes
from fmbs_skfem.bodies.beams.section_constants import constants
from fmbs_skfem.bodies.beams.section_shapes import (
    Outline,
    Polygon,
    Shear,
    c_shape,
    circle,
    i_shape,
    l_shape,
    polygon,
    rectangle,
    tube,
)
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes.table import Floats

L = l_shape(0.10, 0.06, 0.004, 0.006)


def regular(count: int, radius: float = 1.0) -> Floats:
    angles = 2.0 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def turned(shape: Polygon, angle: float) -> Polygon:
    """A polygon turned about the origin of its drawing."""
    return polygon(*(np.array(loop) @ rotation(angle).T for loop in (shape.points, *shape.holes)))


def rotation(angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def series(long: float, short: float) -> float:
    """J of a rectangle: a b^3 (1/3 - 64 b / (pi^5 a) sum tanh(n pi a / 2 b) / n^5), Timoshenko and
    Goodier 1970, art. 109.
    """
    n = np.arange(1.0, 100.0, 2.0)
    return (
        long
        * short**3
        * (
            1 / 3
            - 64
            * short
            / (math.pi**5 * long)
            * float(np.sum(np.tanh(n * np.pi * long / (2 * short)) / n**5))
        )
    )


# -------------------------------------------------------------------------------------------------------- closed forms
@pytest.mark.parametrize("ratio", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_circles_and_tubes_have_cowpers_coefficients(ratio: float, nu: float) -> None:
    """Cowper 1966, doi 10.1115/1.3625046, table 1: m is the ratio of the radii; 0.88636 of circles
    at nu = 0.3.
    """
    d = 0.03008
    found = constants(tube(d, d / 2 * (1 - ratio)) if ratio else circle(d), nu)
    second = math.pi / 64 * d**4 * (1 - ratio**4)
    m = (1 + ratio**2) ** 2
    k = 6 * (1 + nu) * m / ((7 + 6 * nu) * m + (20 + 12 * nu) * ratio**2)
    assert_allclose(found.area, math.pi / 4 * d**2 * (1 - ratio**2), rtol=1e-13)
    assert_allclose(
        [found.Iyy, found.Izz, found.Iyz, found.torsion / 2],
        second * np.array([1, 1, 0, 1]),
        rtol=1e-13,
    )
    assert_allclose(found.shear_area, k * found.area * np.eye(2), rtol=1e-12)
    assert ratio or nu != 0.3 or round(k, 5) == 0.88636


@pytest.mark.parametrize("width,height", [(1.0, 1.0), (0.5, 1.0), (1.0, 0.1), (100.0, 1.0)])
def test_rectangles(width: float, height: float) -> None:
    """The series of torsion; Cowper 1966: (10 + 10 nu) / (12 + 11 nu) whatever the sides are; 5/6
    by the energy.
    """
    found = constants(rectangle(width, height), 0.3)
    assert_allclose(found.torsion, series(max(width, height), min(width, height)), rtol=3e-6)
    assert_allclose(
        [found.area, found.Izz, found.Iyy],
        width * height / 12 * np.array([12, width**2, height**2]),
        rtol=1e-12,
    )
    assert_allclose(
        found.shear_area, 13 / 15.3 * found.area * np.eye(2), rtol=1e-9, atol=1e-8 * found.area
    )
    assert_allclose(found.shear_centre, 0.0, atol=1e-9 * width)
    energy = constants(replace(rectangle(width, height), shear=Shear.ENERGY), 0.3)
    assert_allclose(np.diag(energy.shear_area), 5 / 6 * found.area, rtol=1e-9)


def test_equilateral_triangle() -> None:
    """J = sqrt(3)/80 a^4 and 20 T/a^3 in the middle of a side, Timoshenko and Goodier 1970, art.
    106; its warping is a cubic.
    """
    found = constants(polygon([(0.0, 0.0), (2.0, 0.0), (1.0, math.sqrt(3.0))]), 0.3)
    assert_allclose(found.torsion, math.sqrt(3.0) / 80 * 2.0**4, rtol=1e-12)
    stress = section_constants.stresses(found, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    assert_allclose(
        section_constants.von_mises(stress).max(), math.sqrt(3.0) * 20 / 2.0**3, rtol=1e-9
    )
    assert_allclose(found.shear_centre, 0.0, atol=1e-12)


def test_polygons_of_many_sides_are_circles() -> None:
    """Meshes with a hole against the closed form of a tube: all constants and stresses, but for
    what 96 sides cut off.
    """
    found = constants(replace(polygon(regular(96), regular(96, 0.6)), shear=Shear.COWPER), 0.3)
    exact = constants(tube(2.0, 0.4), 0.3)
    assert_allclose(found.shear_area / found.area, exact.shear_area / exact.area, atol=5e-4)
    assert_allclose(found.torsion / found.Iyy, 2.0, rtol=5e-4)
    forces, top = [3.0, 1.0, 2.0, 0.5, 0.4, 0.3], []
    for one in (found, exact):
        points = np.concatenate(one.outline)
        top.append(section_constants.stresses(one, forces)[:, np.argmax(points[:, 1])])
    assert_allclose(top[0], top[1], rtol=0.02, atol=0.01)


def test_flexure_of_a_circle() -> None:
    """(1 + 2 nu) / (4 + 4 nu) V R^2 / I where the neutral axis ends, Timoshenko and Goodier 1970,
    art. 122; none at the top.
    """
    found = constants(circle(2.0), 0.3)
    y, z = found.outline[0].T
    stress = section_constants.stresses(found, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    assert_allclose(stress[1:, np.argmax(y)], [0.0, 1.6 / 5.2 / found.Iyy], atol=1e-12)
    assert_allclose(stress[:, np.argmax(z)], 0.0, atol=1e-12)


def test_semicircle() -> None:
    """Its shear centre is 8/(5 pi) of the radius from the centre, Timoshenko and Goodier 1970, art.
    128, at nu = 0.
    """
    half = np.pi * (np.arange(97) / 96 - 0.5)
    found = constants(
        polygon(np.column_stack([np.cos(half), np.sin(half)])), 0.3, origin=(0.0, 0.0)
    )
    assert_allclose(found.shear_centre, [8 / (5 * math.pi), 0.0], atol=3e-4)
    assert_allclose(found.centroid, [4 / (3 * math.pi), 0.0], atol=3e-4)


# --------------------------------------------------------------------------------------------------------- other numbers
def prandtl(shape: Polygon, degree: int) -> float:
    """J = 2 int phi, of the stress function phi = 0 on the border, lap phi = -2: from below, where
    warping has it from above.
    """
    import skfem
    from skfem.models.poisson import laplace, unit_load

    points, quads = section_shapes.mesh(shape)
    basis = skfem.CellBasis(
        skfem.MeshQuad1(points.T.copy(), quads.T.copy()), skfem.ElementQuadP(degree)
    )
    load = unit_load.assemble(basis)
    return 4.0 * float(
        load @ skfem.solve(*skfem.condense(laplace.assemble(basis), load, D=basis.get_dofs()))
    )


@pytest.mark.parametrize("shape", [l_shape(1.0, 1.0, 0.5, 0.5), c_shape(0.4, 1.0, 0.03, 0.05)])
def test_torsion_is_between_its_bounds(shape: Polygon) -> None:
    """Both principles of energy bound J, and `error` is no less than what is left of it."""
    found = constants(shape, 0.3)
    lower = prandtl(shape, 4)
    assert lower < found.torsion < lower * (1 + 3e-5)
    points, quads = section_shapes.mesh(shape)
    best = saint_venant.fields(points, quads, 8).over
    assert lower < best.torsion < found.torsion < best.torsion * (1 + found.error)
    assert 0.0 < found.error < saint_venant.ERROR


def test_the_l_shaped_domain() -> None:
    """int |grad u|^2 = 0.2140758 of -lap u = 1 with u = 0 on three squares of side 1, a benchmark
    of adaptive methods.

    C. Carstensen, C. Merdon, J. Comput. Appl. Math. 249 (2013) 74-94,
    doi:10.1016/j.cam.2012.12.021. J is four times that.
    """
    assert_allclose(constants(l_shape(2.0, 2.0, 1.0, 1.0), 0.3).torsion, 4 * 0.2140758, rtol=5e-6)


def test_i_section_of_steel() -> None:
    """J within 0.1 % of a fit to finite differences: I. A. El Darwish, B. G. Johnston, J. Struct.
    Div. ASCE 91 (1965) 203-227.
    """
    b, h, w, t = 0.2, 0.4, 0.01, 0.016
    alpha, diameter = -0.042 + 0.2204 * w / t - 0.0725 * (w / t) ** 2, (t**2 + w**2 / 4) / t
    fit = 2 / 3 * b * t**3 + (h - 2 * t) * w**3 / 3 + 2 * alpha * diameter**4 - 0.42 * t**4
    assert_allclose(constants(i_shape(b, h, w, t), 0.3).torsion, fit, rtol=1e-3)


@pytest.mark.parametrize("height,factor", [(2.0, 1.033), (1.0, 1.126), (0.5, 1.396), (0.25, 1.988)])
def test_flexure_of_rectangles(height: float, factor: float) -> None:
    """Shear stress in the middle of the sides over 3 V / 2 A, at nu = 0.25: Timoshenko and Goodier
    1970, art. 124.
    """
    found = constants(rectangle(1.0, height), 0.25)
    middle = np.argmin(np.hypot(*(found.outline[0] - [0.5, 0.0]).T))
    stress = section_constants.stresses(found, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])[:, middle]
    assert_allclose(stress * found.area / 1.5, [0.0, 0.0, factor], atol=2e-3)


def test_torsion_stress_of_a_square() -> None:
    """T / (0.2082 a^3) in the middle of a side, Timoshenko and Goodier 1970, art. 109; none at
    corners.
    """
    found = constants(rectangle(1.0, 1.0), 0.3)
    shear = np.hypot(*section_constants.stresses(found, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0])[1:])
    assert_allclose(shear.max(), 1 / 0.2082, rtol=2e-3)
    assert_allclose(
        shear[np.abs(found.outline[0]).min(axis=1) > 0.49], 0.0, atol=0.02 * shear.max()
    )


# --------------------------------------------------------------------------------------------------------- thin walls
def walls(*legs: tuple[tuple[float, float], tuple[float, float]]) -> tuple[Floats, Floats]:
    """Centroid (2,) and F t (2, 2) of walls of one small thickness t: V.F V = int q^2 / t ds, q =
    -(I^-1 V) . int rho t ds.

    Each leg runs from a free end.
    """
    s, weights = np.polynomial.legendre.leggauss(8)
    s, weights = (s + 1) / 2, weights / 2
    ends = np.array(legs)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    centre = np.sum(lengths[:, None] * ends.mean(axis=1), axis=0) / lengths.sum()
    inertia, shared = np.zeros((2, 2)), np.zeros((2, 2))
    for (a, b), length in zip(ends - centre, lengths, strict=True):
        place = a + s[:, None] * (b - a)
        inertia += length * (weights[:, None] * place).T @ place
        flow = length * (s[:, None] * a + s[:, None] ** 2 / 2 * (b - a))
        shared += length * (weights[:, None] * flow).T @ flow
    inverse = np.linalg.inv(inertia)
    return centre, inverse @ shared @ inverse


def test_thin_angle() -> None:
    """Shear centre where the middle lines meet, and F with its coupling: flows from both free ends
    end at the corner.
    """
    errors = []
    for t in (0.01, 0.005):
        centre, flexibility = walls(((1.0, 0.0), (0.0, 0.0)), ((0.0, 0.6), (0.0, 0.0)))
        found = constants(l_shape(1.0 + t / 2, 0.6 + t / 2, t, t), 0.3, origin=(t / 2, t / 2))
        assert_allclose(found.shear_centre, 0.0, atol=2e-2 * t)
        assert_allclose(found.centroid, centre, atol=t)
        errors.append(
            np.abs(t * np.linalg.inv(found.shear_area) - flexibility).max()
            / np.abs(flexibility).max()
        )
        assert abs(flexibility[0, 1]) > 0.02 * flexibility[0, 0]  # so that a missing coupling shows
    assert errors[1] < 3e-3
    assert_allclose(errors[0] / errors[1], 2.0, atol=0.2)


def test_thin_channel() -> None:
    """Shear centre 3 b^2 / (h + 6 b) behind the web's middle line, all walls of one thickness; its
    error falls with t^2.
    """
    h, b, errors = 1.0, 0.4, []
    for t in (0.02, 0.01, 0.005):
        found = constants(c_shape(b + t / 2, h + t, t, t), 0.3, origin=(t / 2, 0.0))
        errors.append(found.shear_centre[0] / (-3 * b**2 / (h + 6 * b)) - 1)
        assert_allclose(found.shear_centre[1], 0.0, atol=1e-9)
    assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.01)
    assert abs(errors[-1]) < 2e-4


def test_thin_i_section_by_cowper() -> None:
    """Cowper 1966, table 1, along the web: m = 2 b t_f / (h t_w), n = b / h; the error falls with
    the thickness.
    """
    h, b, nu, errors = 1.0, 0.5, 0.3, []
    for t in (0.01, 0.005):
        m, n = 2 * b / h, b / h
        solid = 12 + 72 * m + 150 * m**2 + 90 * m**3 + nu * (11 + 66 * m + 135 * m**2 + 90 * m**3)
        k = (
            10
            * (1 + nu)
            * (1 + 3 * m) ** 2
            / (solid + 30 * n**2 * (m + m**2) + 5 * nu * n**2 * (8 * m + 9 * m**2))
        )
        found = constants(replace(i_shape(b, h + t, t, t), shear=Shear.COWPER), nu)
        errors.append(found.shear_area[1, 1] / found.area / k - 1)
    assert abs(errors[1]) < 0.005
    assert_allclose(errors[0] / errors[1], 2.0, atol=0.1)


# ---------------------------------------------------------------------------------------------------------- convergence
@pytest.mark.parametrize(
    "shape,degree,order", [("square", 1, 2.0), ("square", 3, 4.0), ("angle", 3, 4 / 3)]
)
def test_orders_on_even_meshes(shape: str, degree: int, order: float) -> None:
    """The energy's error falls with h^2 of bilinear functions, h^4 by r^2 log r at right angles,
    h^(4/3) by r^(2/3) at others.
    """
    found = []
    for many in (2, 4, 8):
        lines = np.linspace(0.0, 1.0, 2 * many + 1)
        y, z = np.meshgrid(lines, lines, indexing="ij")
        node = np.arange(y.size).reshape(y.shape)
        quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1)
        inside = np.ones(quads.shape[:2], bool)
        inside[many:, many:] = shape == "square"
        points, used = np.column_stack([y.ravel(), z.ravel()]), quads[inside]
        kept = np.unique(used)
        number = np.searchsorted(kept, used)
        found.append(saint_venant.fields(points[kept], number, degree).over.torsion)
    exact = series(1.0, 1.0) if shape == "square" else 4 * 0.2140758 / 16
    errors = np.array(found) / exact - 1
    assert (errors > 0.0).all()
    assert_allclose(np.log2(errors[:-1] / errors[1:]), order, atol=0.25)


def test_graded_meshes_converge_exponentially() -> None:
    """A degree more leaves a quarter of the error or less, where even meshes are held up at the
    corner.
    """
    points, quads = section_shapes.mesh(l_shape(1.0, 1.0, 0.5, 0.5))
    found = [saint_venant.fields(points, quads, degree).over.torsion for degree in (3, 4, 5, 6, 9)]
    errors = np.array(found[:-1]) - found[-1]
    assert (errors[1:] < errors[:-1] / 4).all()


# -------------------------------------------------------------------------------------------------- stiffness and stresses
def test_a_cantilever_loaded_anywhere_has_one_energy() -> None:
    """S . K^-1 S and all stresses are the same about every origin, of forces and moments moved with
    it.
    """
    at = np.array([0.03, -0.02])
    here, there = (
        constants(L, 0.3),
        constants(L, 0.3, origin=at + constants(L, 0.3, origin=(0, 0)).centroid),
    )
    forces = np.array([3.0, 1.0, -2.0, 0.1, 0.2, 0.3])
    y, z = -at  # where the centroid is, seen from the other origin
    N, Vy, Vz, T, My, Mz = forces
    moved = np.array([N, Vy, Vz, T + y * Vz - z * Vy, My + z * N, Mz - y * N])
    energies = [
        S @ np.linalg.solve(section_constants.stiffness(one, 210e9), S)
        for one, S in ((here, forces), (there, moved))
    ]
    assert_allclose(energies[0], energies[1], rtol=1e-11)
    stresses = [section_constants.stresses(one, S) for one, S in ((here, forces), (there, moved))]
    assert_allclose(stresses[0], stresses[1], rtol=1e-9, atol=1e-9 * np.abs(stresses[0]).max())


def test_stiffness_of_a_channel() -> None:
    """By hand: a force through the shear centre does not twist, an axial force through the centroid
    does not bend.
    """
    E, nu = 70e9, 0.33
    found = constants(c_shape(0.04, 0.1, 0.003, 0.005), nu, origin=(0.0, 0.0))
    K, (yc, _), (ys, _) = section_constants.stiffness(found, E), found.centroid, found.shear_centre
    G = E / (2 * (1 + nu))
    assert yc > 0.0 > ys
    strain = np.linalg.solve(K, [1.0, 0.0, 0.0, 0.0, 0.0, -yc])
    assert_allclose(strain, [1 / (E * found.area), 0, 0, 0, 0, 0], atol=1e-9 / (E * found.area))
    strain = np.linalg.solve(K, [0.0, 0.0, 1.0, ys, 0.0, 0.0])
    assert_allclose(strain[[2, 3]], [1 / (G * found.shear_area[1, 1]), 0.0], rtol=1e-9, atol=1e-16)
    strain = np.linalg.solve(K, [0.0, 0.0, 0.0, 1.0, 1.0, 0.0])
    assert_allclose(strain[[3, 4]], [1 / (G * found.torsion), 1 / (E * found.Iyy)], rtol=1e-9)
    assert_allclose(K, K.T, rtol=1e-12, atol=1e-9 * K.max())


def test_mass_matrix() -> None:
    """int rho (1, y, z)^T (1, y, z) of a rectangle beside its corner."""
    found = section_constants.mass(
        constants(rectangle(0.2, 0.1), 0.3, origin=(-0.1, -0.05)), 1000.0
    )
    expected = [[20.0, 2.0, 1.0], [2.0, 0.8 / 3, 0.1], [1.0, 0.1, 0.2 / 3]]
    assert_allclose(found, expected, rtol=1e-12)


def test_axial_stresses() -> None:
    """N/A + M_y z / Iyy - M_z y / Izz at the corners of a rectangle, and those of an angle balance
    their forces' strains.
    """
    found = constants(rectangle(0.2, 0.1), 0.3)
    y, z = found.outline[0].T
    stress = section_constants.stresses(found, [5.0, 0.0, 0.0, 0.0, 2.0, 3.0])
    assert_allclose(stress[0], 5.0 / 0.02 + 2.0 * z / found.Iyy - 3.0 * y / found.Izz, rtol=1e-12)
    assert_allclose(section_constants.von_mises(stress), np.abs(stress[0]), rtol=1e-12)
    forces, E = np.array([5.0, 0.0, 0.0, 0.0, 2.0, 3.0]), 210e9
    angle = constants(L, 0.3, origin=(0.0, 0.0))
    gamma, *_, ky, kz = np.linalg.solve(section_constants.stiffness(angle, E), forces)
    y, z = angle.outline[0].T
    assert_allclose(
        section_constants.stresses(angle, forces)[0], E * (gamma + z * ky - y * kz), rtol=1e-9
    )


def test_shear_stresses_run_along_the_outline() -> None:
    """No traction on the surface, of each of V_y, V_z, T and in many states at once; next to inward
    corners it is not looked at.
    """
    found = constants(c_shape(0.04, 0.1, 0.003, 0.005), 0.3)
    states = np.eye(6)[:, 1:4]
    shear = section_constants.stresses(found, states)[1:]
    assert shear.shape == (2, len(found.outline[0]), 3)
    points = found.outline[0]
    step, before = np.roll(points, -1, axis=0) - points, points - np.roll(points, 1, axis=0)
    straight = np.abs(step[:, 0] * before[:, 1] - step[:, 1] * before[:, 0]) < 1e-12
    normal = np.stack([step[:, 1], -step[:, 0]]) / np.linalg.norm(step, axis=1)
    across = np.einsum("cn,cns->ns", normal, shear)[straight]
    assert np.abs(across).max(axis=0) / np.abs(shear).max(axis=(0, 1)) == pytest.approx(
        0.0, abs=3e-3
    )


def test_directions_of_the_drawing_do_not_matter() -> None:
    """A section turned by 30 degrees and drawn clockwise has turned constants; another scale gives
    powers of it.
    """
    plain, R = constants(L, 0.3, origin=(0.0, 0.0)), rotation(math.pi / 6)
    shape = turned(L, math.pi / 6)
    found = constants(Polygon(shape.points[::-1]), 0.3, origin=(0.0, 0.0))
    assert_allclose(found.torsion, plain.torsion, rtol=1e-5)
    assert_allclose(found.centroid, R @ plain.centroid, rtol=1e-10)
    assert_allclose(found.shear_centre, R @ plain.shear_centre, rtol=1e-4)
    for turned_one, one in ((found.inertia, plain.inertia), (found.shear_area, plain.shear_area)):
        assert_allclose(turned_one, R @ one @ R.T, rtol=1e-5, atol=1e-5 * np.abs(one).max())
    large = constants(polygon(1000.0 * np.array(L.points)), 0.3)
    assert_allclose(
        [large.torsion, large.shear_area[0, 1]],
        [1e12 * plain.torsion, 1e6 * plain.shear_area[0, 1]],
        rtol=1e-6,
    )


@settings(max_examples=8, deadline=None)
@given(st.lists(st.floats(0.2, 1.0), min_size=4, max_size=9), st.floats(0.2, 1.0))
def test_any_polygon(radii: list[float], flat: float) -> None:
    """The mesh covers it, K is positive, and all constants are right to the wanted 1e-5."""
    shape = polygon(regular(len(radii)) * np.array(radii)[:, None] * [1.0, flat])
    found = constants(shape, 0.3)
    (y, z), (y1, z1) = np.array(shape.points).T, np.roll(shape.points, -1, axis=0).T
    assert_allclose(found.area, 0.5 * np.sum(y * z1 - y1 * z), rtol=1e-10)
    assert np.linalg.eigvalsh(section_constants.stiffness(found, 1.0)).min() > 0.0
    assert np.linalg.eigvalsh(np.eye(2) - found.shear_area / found.area).min() > 0.0
    best = saint_venant.fields(*section_shapes.mesh(shape), 8).over
    assert_allclose(found.torsion, best.torsion, rtol=1e-5)


def test_equal_sections_are_solved_once() -> None:
    assert saint_venant.solve(c_shape(0.4, 1.0, 0.02, 0.02)) is saint_venant.solve(
        c_shape(0.4, 1.0, 0.02, 0.02)
    )
    with pytest.raises(ValueError, match="read-only"):
        saint_venant.solve(circle(1.0)).over.inertia[0, 0] = 0.0


# -------------------------------------------------------------------------------------------------------- what is refused
SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


@pytest.mark.parametrize(
    "make, named",
    [
        (lambda: circle(-1.0), r"section\.diameter: expected a positive and finite number, got -1"),
        (
            lambda: tube(0.02, 0.011),
            r"section\.wall: expected at most the radius, 0\.01 m, got 0\.011 m",
        ),
        (lambda: rectangle(1.0, 0.0), r"section\.height"),
        (
            lambda: i_shape(0.1, 0.2, 0.1, 0.01),
            r"section\.web: expected less than the width",
        ),
        (
            lambda: c_shape(0.1, 0.2, 0.01, 0.1),
            r"section\.flange: expected less than half the height",
        ),
        (
            lambda: l_shape(0.1, 0.2, 0.01, 0.2),
            r"section\.flange: expected less than the height",
        ),
        (lambda: polygon(SQUARE[:2]), r"section\.points: expected three or more points"),
        (lambda: polygon([*SQUARE[:3], (math.nan, 1.0)]), r"section\.points: .* finite"),
        (
            lambda: polygon([SQUARE[k] for k in (0, 2, 1, 3)]),
            r"\(0\.0, 0\.0\) to \(1\.0, 1\.0\) and \(1\.0, 0\.0\) to \(0\.0, 1\.0\)",
        ),
        (
            lambda: polygon(regular(1001)),
            r"section\.points: expected at most 1000 points, got 1001",
        ),
        (lambda: polygon([*SQUARE, SQUARE[0]]), "leave out points that repeat one"),
        (lambda: polygon([(0, 0), (2, 0), (1, 0), (1, 1)]), "sides meet at their ends alone"),
        (lambda: polygon([(0, 0), (1, 0), (1, 1e-5), (0, 1e-5)]), "sides meet at their ends alone"),
        (lambda: polygon(SQUARE, np.array(SQUARE) + 0.5), "sides meet at their ends alone"),
        (
            lambda: polygon(SQUARE, np.array(SQUARE) + 3.0),
            r"section\.holes: expected holes within the polygon",
        ),
        (
            lambda: polygon(SQUARE, 0.1 + 0.8 * np.array(SQUARE), 0.2 + 0.5 * np.array(SQUARE)),
            r"section\.holes: .* none within another",
        ),
        (
            lambda: constants(circle(1.0), 0.6),
            r"section\.poisson_ratio: expected a number above -1 and up to 0\.5, got 0\.6",
        ),
        (
            lambda: constants(circle(1.0), 0.3, origin=(1.0, 2.0, 3.0)),
            r"section\.origin: expected a point",
        ),
        (
            lambda: constants(replace(L, shear=Shear.COWPER), 0.3),
            "an axis of symmetry .* take Shear.ENERGY",
        ),
        (
            lambda: constants(replace(i_shape(0.2, 1.0, 0.01, 0.02), shear=Shear.COWPER), 0.3),
            "positive shear coefficients by Cowper",
        ),
        (lambda: constants("round", 0.3), "section: expected an outline of section_shapes"),  # type: ignore[arg-type]
    ],
)
def test_bad_values_are_named(make: Callable[[], Outline], named: str) -> None:
    with pytest.raises(InputError, match=named):
        make()


def test_sides_that_take_too_many_pieces_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(section_shapes, "PIECES", 20)
    with pytest.raises(
        InputError,
        match=r"section\.points: expected an outline that 20 pieces .* narrower than 0\.001 m",
    ):
        section_shapes.mesh(c_shape(0.4, 1.0, 0.001, 0.001))
