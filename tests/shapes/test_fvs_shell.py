"""Curved shells on free meshes: contract, orders of normals and geometry, creases, corners, what
scenes make of a mesh.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.scenes import surfaces
from fmbs_skfem.shapes import fvs_plate, fvs_shell, nurbs, plate_audit, plate_meshes, surface, table
from fmbs_skfem.shapes.plate_meshes import PlateMesh

from .test_fvs_plate import MESHES, Mesh, shaken

Shape = Callable[[np.ndarray], np.ndarray]
SIDES = {"left": (0, 0.0), "right": (0, 1.0), "bottom": (1, 0.0), "top": (1, 1.0)}
PLACES = {
    "crown": (0.0, 1.0),
    "tip": (1.0, 1.0),
    "out": (0.0, 0.0),
    "back": (1.0, 0.0),
    "middle": (0.5, 0.5),
}


def bent(mesh: Mesh, shape: Shape, closed: bool = False) -> PlateMesh:
    """The unit square laid onto a surface, the node next to its middle moved there; `closed` joins
    its sides left and right.
    """
    places, cells = mesh[0].copy(), mesh[1]
    places[np.argmin(np.linalg.norm(places - 0.5, axis=1))] = 0.5
    if closed:
        left, right = (np.flatnonzero(np.abs(places[:, 0] - x) < 1e-9) for x in (0.0, 1.0))
        same = np.arange(len(places))
        same[right] = left[
            np.argmin(np.abs(places[left, 1][None] - places[right, 1][:, None]), axis=1)
        ]
        used, cells = np.unique(same[cells], return_inverse=True)
        places, cells = places[used], cells.reshape(mesh[1].shape)
    pairs, _ = plate_audit.border(cells, len(places))
    on = {
        name: (np.abs(places[pairs][..., k] - x) < 1e-9).all(axis=1)
        for name, (k, x) in SIDES.items()
    }
    points = {
        name: np.array([int(np.argmin(np.linalg.norm(places - at, axis=1)))])
        for name, at in PLACES.items()
    }
    edges = {name: pairs[rows] for name, rows in on.items() if rows.any()}
    return plate_meshes.audit(
        PlateMesh(shape(places), cells, points, edges, {"all": np.arange(len(cells))}), False
    )


def mixed(n: int) -> tuple[Mesh, np.ndarray]:
    """A shaken grid, and its cells that are to be cut: those on the left."""
    points, quads = shaken(n)
    return (points, quads), points[quads].mean(axis=1)[:, 0] < 0.5


def cylinder(angle: float, radius: float = 1.0, length: float = 1.0) -> Shape:
    """About the y axis, from the crown on."""
    return lambda u: np.column_stack(
        [radius * np.sin(angle * u[:, 0]), length * u[:, 1], radius * np.cos(angle * u[:, 0])]
    )


def wave(u: np.ndarray) -> np.ndarray:
    x, y = u.T
    return np.column_stack([x, y, 0.3 * np.sin(2 * x + 0.5) * np.cos(1.5 * y - 0.3) + 0.1 * x**3])


def wave_normals(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    over_x = 0.6 * np.cos(2 * x + 0.5) * np.cos(1.5 * y - 0.3) + 0.3 * x**2
    over_y = -0.45 * np.sin(2 * x + 0.5) * np.sin(1.5 * y - 0.3)
    found = np.stack([-over_x, -over_y, np.ones_like(x)], axis=-1)
    return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("kind", ["free triangles", "free quads"])
def test_contract(kind: str, closed: bool) -> None:
    """Also continuity over sides, of a panel and of a closed tube."""
    angle = 2 * np.pi if closed else 1.0
    shape, _ = fvs_shell.surface(bent(MESHES[kind](14), cylinder(angle, 1.0, 3.0), closed))
    table.check_table(shape)


@pytest.mark.parametrize("kind", ["free triangles", "free quads", "distorted quads"])
def test_geometry_is_of_third_order(kind: str) -> None:
    """Heights; slopes between nodes have order 2, normals at nodes, rms, order 3; the estimate is
    on the safe side.
    """
    errors = []
    for n in (8, 16, 32):
        shape, estimate = fvs_shell.surface(bent(MESHES[kind](n), wave))
        nodes = shape.reference.reshape(-1, 3, 3)
        normal = np.cross(nodes[:, 1], nodes[:, 2])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        at_nodes = np.sqrt(np.mean((normal - wave_normals(*nodes[:, 0, :2].T)) ** 2))
        x, one, two = np.einsum(
            "epkb,ebc->kepc",
            surface.tabulate(shape, 5).values[:, :, :3],
            shape.reference[shape.nodes],
        )
        off = np.abs(x[..., 2] - wave(x[..., :2].reshape(-1, 2))[:, 2].reshape(x.shape[:2])).max()
        between = np.cross(one, two)
        between /= np.linalg.norm(between, axis=-1, keepdims=True)
        errors.append([off, np.abs(between - wave_normals(x[..., 0], x[..., 1])).max(), at_nodes])
        assert off < estimate < 12 * off
    orders = np.log2(np.divide(errors[:-1], errors[1:])).mean(axis=0)
    assert orders[0] > 2.8
    assert orders[1] > 1.9
    assert orders[2] > 2.7


def test_flat_meshes_are_those_of_plates() -> None:
    """The same functions, turned into the bases of the nodes."""
    mesh = bent(MESHES["free triangles"](6), lambda u: np.column_stack([u, 0 * u[:, 0]]))
    shape, estimate = fvs_shell.surface(mesh)
    plate = fvs_plate.surface(mesh.points[:, :2], mesh.cells)
    assert estimate == pytest.approx(0.0, abs=1e-14)
    bases = shape.reference.reshape(-1, 3, 3)[:, 1:, :2]
    xi = np.array([[0.2, 0.3], [0.6, 0.1]])
    ours, theirs = (
        surface.basis_in_cells(some.space, np.arange(len(mesh.cells)), xi)[:, :, 0]
        for some in (shape, plate)
    )
    ours, theirs = ours.reshape(*ours.shape[:2], 3, 3), theirs.reshape(*theirs.shape[:2], 3, 3)
    np.testing.assert_allclose(ours[..., 0], theirs[..., 0], atol=1e-13)
    turned = np.einsum("epvk,evkc->epvc", ours[..., 1:], bases[mesh.cells])
    np.testing.assert_allclose(turned, theirs[..., 1:], atol=1e-13)


def test_groups_of_cut_quads() -> None:
    mesh = bent(MESHES["free quads"](8), cylinder(1.0))
    some = {"some": np.arange(0, len(mesh.cells), 3)}
    shape, _ = fvs_shell.surface(
        PlateMesh(mesh.points, mesh.cells, mesh.point_groups, mesh.edge_groups, some)
    )
    corners = shape.nodes[shape.faces["some"]][:, ::3] // 3
    wanted = mesh.cells[some["some"]]
    assert len(corners) == 2 * len(wanted)
    assert all(
        set(row) <= set(quad) for row, quad in zip(corners, wanted.repeat(2, axis=0), strict=True)
    )
    sides = shape.edges["top"]
    xi = surface.side_points(shape.parent, sides[:, 1], np.full(len(sides), 0.3))
    assert (surface.sample(shape, sides[:, 0], xi) @ shape.reference)[:, 1] == pytest.approx(
        1.0, abs=1e-6
    )


@pytest.mark.parametrize("kind", ["free triangles", "free quads"])
def test_halved_meshes_stay_on_the_surface(kind: str) -> None:
    """New nodes err as the surface through the old ones does, by the third order; groups and the
    length of borders stay.
    """
    off = []
    for n in (8, 16, 32):
        mesh = bent(MESHES[kind](n), wave)
        fine = fvs_shell.halve(mesh, fvs_shell.surface(mesh)[0])
        assert len(fine.cells) == 4 * len(fvs_shell.triangles(mesh).cells)
        np.testing.assert_array_equal(fine.points[: len(mesh.points)], mesh.points)
        assert fine.point_groups.keys() == mesh.point_groups.keys()
        assert len(fine.face_groups["all"]) == len(fine.cells)
        for name, pairs in mesh.edge_groups.items():
            k, x = SIDES[name]
            found = fine.points[fine.edge_groups[name]]
            assert len(found) == 2 * len(pairs)
            assert np.abs(found[..., k] - x).max() < 0.1 / n**2
        plate_meshes.audit(fine, planar=False)
        off.append(np.abs(fine.points[:, 2] - wave(fine.points[:, :2])[:, 2]).max())
        fvs_shell.surface(fine)
    assert np.log2(np.divide(off[:-1], off[1:])).mean() > 2.8


def folded(angle: float) -> Shape:
    """A kink along u = 1/2."""

    def shape(u: np.ndarray) -> np.ndarray:
        beyond, a = np.maximum(u[:, 0] - 0.5, 0.0), np.radians(angle)
        return np.column_stack(
            [np.minimum(u[:, 0], 0.5) + beyond * np.cos(a), u[:, 1], beyond * np.sin(a)]
        )

    return shape


def test_kinks_are_told_or_refused() -> None:
    grid = shaken(8, 0.0)
    with pytest.raises(
        InputError,
        match=r"at most 50 degrees, got 90 degrees, at \(0.5, .* and 5 more; .* two bodies",
    ):
        fvs_shell.surface(bent(grid, folded(90.0)))
    with pytest.warns(
        Notice,
        match=r"a kink is made smooth, where cells meet at 20 degrees, at \(0.5, .*two bodies",
    ):
        fvs_shell.surface(bent(grid, folded(20.0)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fvs_shell.surface(bent(MESHES["free triangles"](12), cylinder(2.0)))


def test_nodal_slopes_run_along_the_border() -> None:
    """The hole of a disc: r_1 along its circle to fourth order; both sides at the corners of a
    rectangle.
    """
    angle = np.radians(15.0) * np.arange(24)
    ring = np.concatenate(
        [radius * np.column_stack([np.cos(angle), np.sin(angle)]) for radius in (1.0, 1.3, 1.6)]
    )
    i = np.arange(24)
    quads = np.concatenate(
        [np.column_stack([i, i + 24, (i + 1) % 24 + 24, (i + 1) % 24]) + 24 * k for k in (0, 1)]
    )
    points = np.column_stack([ring, 0.2 * (ring**2).sum(axis=1)])
    shape, _ = fvs_shell.surface(plate_meshes.audit(PlateMesh(points, quads), False))
    along = shape.reference.reshape(-1, 3, 3)[:24, 1]
    circle = np.column_stack([-np.sin(angle), np.cos(angle), 0 * angle])
    assert np.abs(np.abs(np.sum(along * circle, axis=1)) - 1.0).max() < 1e-9
    panel = bent(shaken(12), cylinder(1.0))
    corner = panel.point_groups["back"][0]
    shape, _ = fvs_shell.surface(panel)
    tangents = shape.reference.reshape(-1, 3, 3)[corner, 1:]
    exact = np.array([[0.0, 1.0, 0.0], [-np.cos(1.0), 0.0, np.sin(1.0)]])
    np.testing.assert_allclose(tangents, exact, atol=1e-3)


@pytest.mark.parametrize(
    ("mesh", "space"),
    [
        (shaken(8, 0.0), nurbs.Nurbs),
        (shaken(8, 0.05), fvs_plate.Conforming),
        (MESHES["free quads"](8), fvs_plate.Conforming),
        (MESHES["free triangles"](8), fvs_plate.Conforming),
    ],
)
def test_the_shell_that_converges_is_taken(mesh: Mesh, space: type) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)  # quads that are cut
        shape, _ = surfaces.curved(bent(mesh, cylinder(1.0)), 1, None)
    assert type(shape.space) is space


def test_splines_are_of_even_grids() -> None:
    with pytest.raises(
        InputError, match=r"structured quads for a shell.* without `degree` any mesh will do"
    ):
        surfaces.curved(bent(MESHES["free triangles"](8), cylinder(1.0)), 1, 4)
    with pytest.warns(Notice, match="an uneven grid does not converge"):
        surfaces.curved(bent(shaken(8), cylinder(1.0)), 1, 4)
    with pytest.warns(Notice, match="64 quads in no even grid: every quad is cut"):
        surfaces.curved(bent(shaken(8), cylinder(1.0)), 1, None)


def test_cells_of_free_meshes_are_halved() -> None:
    mesh = bent(MESHES["free triangles"](8), cylinder(1.0))
    shape, error = surfaces.curved(mesh, 4, None)
    assert len(shape.nodes) == 16 * len(mesh.cells)
    assert error == surfaces.curved(mesh, 1, None)[1]
    with pytest.raises(
        InputError,
        match="cells: expected 1, 2, 4, 8 or another power of two where quads are in no even grid, got 3",
    ):
        surfaces.curved(mesh, 3, None)


def test_digits_that_dent_a_surface_are_named() -> None:
    """Nodes to 5e-4 m of a shell of 2 mm; exact ones of few digits, and thick shells, are silent."""
    with pytest.warns(Notice, match="digits place nodes to about 0.0005 m, 25 % of the thickness"):
        surfaces.tell_rough("mesh m", 4e-5, 2e-3, 5e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surfaces.tell_rough("mesh m", 1e-16, 2e-3, 5e-4)
        surfaces.tell_rough("mesh m", 4e-5, 20e-3, 5e-4)
