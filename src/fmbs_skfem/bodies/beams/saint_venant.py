r"""Saint-Venant's torsion and flexure of a prismatic bar: Neumann problems on its cross-section,
for all Poisson's ratios at once.

Section axes y, z, beam axis x; rho = (y, z) from the centroid, I = int rho rho^T dA, a = y, z. With
the warping w and the flexure functions f_a, g_a,

    lap w = 0,          dw/dn = (z, -y).n           torsion:    tau = T/J (grad w + (-z, y)),   J = int |grad w + (-z, y)|^2
    lap f_a = -2 a,     df_a/dn = 0                 flexure:    tau = sum_a (I^-1 V)_a (1/2 grad f_a + mu/2 (grad g_a - h_a))
    lap g_a = 2 a,      dg_a/dn = h_a.n             mu = nu/(1 + nu),    h_y = ((y^2 - z^2)/2, yz),   h_z = (yz, (z^2 - y^2)/2)

where h_a are the displacements by Poisson's ratio that go with bending.

Circles and tubes have closed forms; polygons are solved by scikit-fem on the mesh of
`section_shapes`. All integrals are quadratic in gradients, which doubles the order of their errors;
the degree of the polynomials rises until they are right to 1e-5.

A. E. H. Love, A Treatise on the Mathematical Theory of Elasticity, 4th ed. 1927, ch. XIV-XV; S. P.
Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd ed. 1970, ch. 10-11; T. Gustafsson, G. D.
McBain, J. Open Source Softw. 5 (2020) 2369, doi:10.21105/joss.02369.
"""

from __future__ import annotations

import math
from functools import lru_cache, singledispatch
from typing import Any

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...shapes.surface import VERTICES, Parent
from ...shapes.table import Floats, Ints
from . import section_shapes
from .section_shapes import Outline, Polygon, Ring

ERROR = 2e-5  #: change of the integrals from one degree to the next that is small enough: half of it or less is left
DEGREES = range(4, 9)  #: of the polynomials; most sections end with 5


@dataclass(frozen=True, eq=False)
class Integrals:
    """Over a section, about its centroid, in the axes of its drawing; a, b = y, z."""

    area: float  #: [m2]
    centroid: Floats  #: (2,) in the drawing [m]
    inertia: Floats  #: (2, 2) int rho rho^T dA: Izz, Iyz; Iyz, Iyy [m4]
    torsion: float  #: J [m4]
    torque: Floats  #: (2, a) int rho x grad f_a and int rho x (grad g_a - h_a) [m5]
    energy: Floats  #: (a, b) int grad f_a . grad f_b [m6]
    bulge: Floats  #: (a, b) int grad f_a . (h_b - mean h_b) [m6]
    #: (5, 5) int f f^T dA of f = (1, y, z, omega, s^2/2): warping about the shear centre, which bends
    #: and stretches nothing, and the distance s from it
    fibres: Floats


@dataclass(frozen=True, eq=False)
class Solution:
    """Torsion and flexure of one outline."""

    over: Integrals
    #: (n, 2) outline in the drawing, the outer loop first, with the material on the left [m]
    loops: tuple[Floats, ...]
    twisted: Floats  #: (2, n) grad w + (-z, y) at all points of the outline [m]
    flexed: Floats  #: (2, a, 2, n) grad f_a and grad g_a - h_a there [m2]
    warped: Floats  #: (2, n) omega and s^2/2 there [m2]
    error: float  #: the last change of the integrals, relative


@dataclass(frozen=True, eq=False)
class Fields:
    """Polynomials w, f_y, f_z, g_y, g_z on a mesh, and their integrals."""

    over: Integrals
    basis: Any  #: scikit-fem's `CellBasis`
    coefficients: Floats  #: (n, 5)
    centre: Floats  #: (2,) shear centre, from the centroid [m]
    plane: Floats  #: (3,) part of w that is linear, a + b y + c z


@lru_cache(maxsize=512)  # beams of a scene share their sections, and tapered ones have many
def solve(outline: Outline) -> Solution:
    """Torsion and flexure of an outline; nobody may write into the arrays."""
    found = _solve(outline)
    shared = (
        found.over.centroid,
        found.over.inertia,
        found.over.torque,
        found.over.energy,
        found.over.bulge,
    )
    for array in (
        *shared,
        found.over.fibres,
        found.twisted,
        found.flexed,
        found.warped,
        *found.loops,
    ):
        array.setflags(write=False)
    return found


@singledispatch
def _solve(outline: Any) -> Solution:
    raise InputError(
        say("section", "an outline of section_shapes, a Ring or a Polygon", type(outline).__name__)
    )


# ------------------------------------------------------------------------------------------------------ circles and tubes
@_solve.register
def _(ring: Ring) -> Solution:
    """With m = R^2 + r^2 and n = R^2 r^2 of both radii, at the radius s and the angle t from y:

        w = 0,    f_z = (3/4 (m s + n/s) - s^3/4) sin t,    g_z = (s^3 - m s - n/s)/4 sin t

    and cos t for y.
    """
    inner, outer = ring.radii
    m = outer**2 + inner**2
    n = outer**2 * inner**2

    def integral(powers: dict[int, float]) -> float:
        """Sum of c s^k from r to R."""
        return sum(c * (outer**k - inner**k) for k, c in powers.items())

    energy = math.pi * integral({2: 3 / 4 * n, 4: 3 / 8 * m, 6: -1 / 12})  # 2 int z f_z
    # int f_z h_z.n along both circles
    border = math.pi * integral({2: 3 / 8 * n, 4: 3 / 8 * m, 6: -1 / 8})
    area = math.pi * integral({2: 1.0})
    second = math.pi * integral({4: 0.25})
    one = np.eye(2)
    over = Integrals(
        area,
        np.zeros(2),
        second * one,
        2.0 * second,
        np.zeros((2, 2)),
        energy * one,
        (border - energy) * one,
        np.diag([area, second, second, 0.0, math.pi / 12.0 * (outer**6 - inner**6)]),
    )
    over.fibres[0, 4] = over.fibres[4, 0] = second
    loops = [outer * section_shapes.unit_circle()] + (
        [inner * section_shapes.unit_circle()[::-1]] if inner else []
    )
    y, z = place = np.concatenate(loops).T
    s2 = y**2 + z**2
    radial = place[:, None] * place / s2

    def gradients(over_s: Floats, slope: Floats) -> Floats:
        """Gradients (a, 2, n) of u cos t and u sin t, of u/s and u'."""
        return over_s * one[..., None] + (slope - over_s) * radial

    f = gradients(3 / 4 * (m + n / s2) - s2 / 4, 3 / 4 * (m - n / s2) - 3 / 4 * s2)
    g = gradients((s2 - m - n / s2) / 4, (3 * s2 - m + n / s2) / 4)
    return Solution(
        over,
        tuple(loops),
        np.stack([-z, y]),
        np.stack([f, g - anticlastic(y, z)]),
        np.stack([0.0 * s2, 0.5 * s2]),
        0.0,
    )


def anticlastic(y: Floats, z: Floats) -> Floats:
    """Fields (a, 2, ...) by which bending about a = y, z moves a section sideways.

        h_y = ((y^2 - z^2) / 2, y z),    h_z = (y z, - (y^2 - z^2) / 2)

    at points y and z (...).
    """
    half = 0.5 * (y**2 - z**2)
    return np.stack([np.stack([half, y * z]), np.stack([y * z, -half])])


# --------------------------------------------------------------------------------------------------------------- polygons
@_solve.register
def _(shape: Polygon) -> Solution:
    points, quads = section_shapes.mesh(shape)
    found = fields(points, quads, DEGREES[0])
    error = math.inf
    for degree in DEGREES[1:]:
        if error < ERROR:
            break
        last = found
        found = fields(points, quads, degree)
        error = _change(last.over, found.over)
    return _with_outline(found, shape, error)


def fields(points: Floats, quads: Ints, degree: int) -> Fields:
    """Torsion and flexure by polynomials of a degree on quads (e, 4) of points (n, 2)."""
    import skfem

    grid = skfem.MeshQuad1(np.ascontiguousarray(points.T), np.ascontiguousarray(quads.T))
    basis = skfem.CellBasis(
        grid, skfem.ElementQuadP(degree), intorder=2 * degree + 1, disable_doflocs=True
    )
    dx = basis.dx
    place = np.asarray(basis.global_coordinates())
    area = float(dx.sum())
    centroid = np.einsum("cep,ep->c", place, dx) / area
    y, z = rho = place - centroid[:, None, None]
    arm = np.stack([-z, y])
    h = anticlastic(y, z)
    none = np.zeros((2, *rho.shape))
    gradients = np.stack([one[0].grad for one in basis.basis])
    sources = np.concatenate([none[0, :1], 2.0 * rho, none[0]])
    coefficients = _potentials(basis, gradients, sources, np.concatenate([-arm[None], none, h]))
    flows = np.einsum(
        "bcep,ebf->fcep", gradients, coefficients[basis.element_dofs.T], optimize=True
    )
    twist = flows[:1] + arm
    f = flows[1:3]
    g = flows[3:] - h

    def product(one: Floats, two: Floats) -> Floats:
        """Integrals (i, j) of the products of vector fields (i, 2, e, p) and (j, 2, e, p)."""
        return np.asarray((one * dx).reshape(len(one), -1) @ two.reshape(len(two), -1).T)

    values = np.stack([np.broadcast_to(one[0], dx.shape) for one in basis.basis])
    w = np.einsum("bep,eb->ep", values, coefficients[basis.element_dofs.T][..., 0])
    linear = np.stack([np.ones_like(y), y, z])
    plane = np.linalg.solve(
        np.einsum("iep,jep,ep->ij", linear, linear, dx), np.einsum("iep,ep,ep->i", linear, w, dx)
    )
    # w of a pole c is w - c_y z + c_z y but for a constant, and that of the shear centre bends nothing
    centre = np.array([plane[2], -plane[1]])
    omega = w - np.tensordot(plane, linear, 1)
    square = 0.5 * ((rho - centre[:, None, None]) ** 2).sum(axis=0)
    own = np.stack([*linear, omega, square])
    torque = np.concatenate([product(arm[None], f), product(arm[None], g)])
    bulge = product(f, h - np.einsum("acep,ep->ac", h, dx)[..., None, None] / area)
    over = Integrals(
        area,
        centroid,
        product(rho[:, None], rho[:, None]),
        float(product(twist, twist)[0, 0]),
        torque,
        product(f, f),
        bulge,
        np.einsum("iep,jep,ep->ij", own, own, dx),
    )
    return Fields(over, basis, coefficients, centre, plane)


def _potentials(basis: Any, gradients: Floats, sources: Floats, fluxes: Floats) -> Floats:
    """Coefficients (n, f) of u with int grad u . grad v dA = int (s v + q . grad v) dA for all v,
    where u = 0 at one point.

    Of the gradients (b, 2, e, p) of the functions, sources s (f, e, p) and fluxes q (f, 2, e, p).
    """
    dx = basis.dx
    dofs = basis.element_dofs.T
    many = len(gradients)
    values = np.stack([np.broadcast_to(one[0], dx.shape) for one in basis.basis])
    by_cell = gradients.transpose(2, 0, 1, 3).reshape(len(dx), many, -1)
    # one product a cell; forms of scikit-fem pair the functions one after the other, here 36^2 or
    # more times
    entries = by_cell * np.tile(dx, 2)[:, None] @ by_cell.transpose(0, 2, 1)
    rows = np.repeat(dofs, many, axis=1).ravel()
    columns = np.tile(dofs, (1, many)).ravel()
    matrix = csc_array((entries.ravel(), (rows, columns)), shape=(basis.N, basis.N))[1:, 1:]
    loads = np.einsum("fep,bep->feb", sources * dx, values) + np.einsum(
        "fcep,bcep->feb", fluxes * dx, gradients
    )
    right = np.stack(
        [np.bincount(dofs.ravel(), one.ravel(), minlength=basis.N) for one in loads], axis=1
    )
    solver = splu(
        matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    return np.concatenate([np.zeros((1, len(loads))), solver.solve(right[1:])])


def _change(one: Integrals, two: Integrals) -> float:
    """Largest relative change of J, of both parts of the flexibility, and of the shear centre over
    the radius of gyration.
    """
    size, polar = float(np.abs(two.energy).max()), float(np.trace(two.inertia))
    pairs = [
        (one.torsion, two.torsion, two.torsion),
        (one.torque, two.torque, polar * math.sqrt(polar / two.area)),
    ]
    pairs += [(one.energy, two.energy, size), (one.bulge, two.bulge, size)]
    return max(float(np.max(np.abs(np.asarray(b) - a))) / scale for a, b, scale in pairs)


def _with_outline(found: Fields, shape: Polygon, error: float) -> Solution:
    """Solutions with their gradients along the outline; at corners without one the mean of those at
    both neighbours.
    """
    many = map(np.array, shape.pieces) if shape.pieces else map(section_shapes.pieces, shape.loops)
    traced, corners = zip(*map(section_shapes.drawn, shape.loops, many), strict=True)
    points = np.concatenate(traced)
    y, z = rho = (points - found.over.centroid).T
    flows, w = _fields_at(found, points)
    omega = w - np.tensordot(found.plane, np.stack([np.ones_like(y), y, z]), 1)
    square = 0.5 * ((rho - found.centre[:, None]) ** 2).sum(axis=0)
    flows[0] += np.stack([-z, y])
    flows[3:] -= anticlastic(y, z)
    for part, at in zip(
        np.split(flows, np.cumsum([len(loop) for loop in traced[:-1]]), axis=-1),
        corners,
        strict=True,
    ):
        part[..., at] = 0.5 * (np.roll(part, 1, axis=-1) + np.roll(part, -1, axis=-1))[..., at]
    warped = np.stack([omega, square])
    return Solution(found.over, traced, flows[0], flows[1:].reshape(2, 2, 2, -1), warped, error)


def _fields_at(found: Fields, points: Floats) -> tuple[Floats, Floats]:
    """Gradients (5, 2, n) of the fields at points (n, 2) of the outline, from the cell beside each,
    and the warping w (n,) there.
    """
    grid, element = found.basis.mesh, found.basis.elem
    facets = grid.boundary_facets()
    ends = grid.facets[:, facets]
    start, end = grid.p[:, ends].transpose(1, 2, 0)
    nearest = section_shapes.distances(points, start, end).argmin(axis=1)
    cells = grid.f2t[0, facets[nearest]]
    along = (end - start)[nearest]
    part = np.sum((points - start[nearest]) * along, axis=1) / np.sum(along**2, axis=1)
    first, second = (
        VERTICES[Parent.SQUARE][np.argmax(grid.t[:, cells] == ends[k, nearest], axis=0)]
        for k in (0, 1)
    )
    xi = (first + part.clip(0.0, 1.0)[:, None] * (second - first)).T[..., None]
    own = found.coefficients[found.basis.element_dofs[:, cells].T]
    functions = [
        element.gbasis(found.basis.mapping, xi, b, tind=cells)[0] for b in range(found.basis.Nbfun)
    ]
    gradients = np.stack([one.grad for one in functions])
    values = np.stack([np.broadcast_to(np.asarray(one), gradients.shape[2:]) for one in functions])
    return (
        np.asarray(np.einsum("bcn,nbf->fcn", gradients[..., 0], own)),
        np.asarray(np.einsum("bn,nb->n", values[..., 0], own[..., 0])),
    )
