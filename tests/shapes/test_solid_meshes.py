"""Meshes of tetrahedra and hexahedra: what is read, put right, refused, and cut finer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes import surface, table
from fmbs_skfem.shapes.msh import MshCells, Raw
from fmbs_skfem.shapes.solids import elements, recovery, skin, solid, solid_meshes
from fmbs_skfem.shapes.solids.elements import Kind
from fmbs_skfem.shapes.solids.solid import Solid

from ..solids import HEXA, TETRA, box

KINDS = [(TETRA, 1), (TETRA, 2), (HEXA, 1), (HEXA, 2)]


def volume(mesh: Solid) -> float:
    """By the quadrature of the stiffness."""
    return float(solid.tabulate(mesh, elements.STIFFNESS_DEGREE[mesh.kind])[2].sum())


def raw_of(mesh: Solid, order: np.ndarray | None = None) -> Raw:
    """A mesh as a file has it, the nodes of its cells in an order of the file's."""
    word = next(word for word, one in solid_meshes.KINDS.items() if one is mesh.kind)
    cells = mesh.nodes if order is None else mesh.nodes[:, order]
    none = MshCells(np.zeros((0, 2), np.int64), np.zeros(0, np.int64), {})
    part = MshCells(cells, np.arange(len(cells)), {})
    numbers = np.arange(mesh.count)
    return Raw(mesh.reference, numbers, {}, none, none, none, {word: len(cells)}, 0.0, {word: part})


@pytest.mark.parametrize("kind", list(Kind))
def test_functions_belong_to_nodes(kind: Kind) -> None:
    values = elements.basis(kind, elements.positions(kind))
    assert_allclose(values[:, 0], np.eye(int(kind)), atol=1e-12)
    xi, weights = elements.quadrature(kind, elements.MASS_DEGREE[kind])
    assert (weights > 0.0).all()
    h = 1e-6
    for k in range(3):
        step = h * np.eye(3)[k]
        slope = elements.basis(kind, xi + step) - elements.basis(kind, xi - step)
        assert_allclose(elements.basis(kind, xi)[:, 1 + k], slope[:, 0] / (2 * h), atol=1e-8)


@pytest.mark.parametrize("kind, order", KINDS)
def test_the_skin_is_a_surface_whose_normal_points_inwards(kind: type, order: int) -> None:
    shape, _ = skin.of(box((3, 2, 1), kind=kind, order=order))
    table.check_table(shape)
    found = surface.tabulate(shape)
    x, one, two = np.einsum("epkb,ebc->kepc", found.values[:, :, :3], shape.reference[shape.nodes])
    flux = np.einsum("epc,epc,ep->", x, np.cross(one, two), found.weights)
    assert flux / 3.0 == pytest.approx(-0.01, rel=1e-12)


@pytest.mark.parametrize("suffix", [".msh", ".vtu"])
@pytest.mark.parametrize("kind, order", KINDS)
def test_files_give_back_what_was_written(
    tmp_path: Path, kind: type, order: int, suffix: str
) -> None:
    mesh = replace(box((3, 2, 1), kind=kind, order=order), sets={"tip": np.array([7])})
    centre = solid.corner_rows(mesh, np.arange(len(mesh.nodes)))
    first = np.flatnonzero(centre[:, 0] < 1.0 / 3.0)
    mesh = replace(mesh, volumes={"first": first})
    path = tmp_path / f"box{suffix}"
    solid_meshes.write(mesh, path)
    found = solid_meshes.read(path, order=order)
    assert found.kind is mesh.kind
    assert sorted(found.nodes.tolist()) == sorted(mesh.nodes.tolist())  # by groups in .msh
    assert_array_equal(found.reference, mesh.reference)
    assert sorted(found.faces) == sorted(mesh.faces)
    for name, faces in mesh.faces.items():
        own, given = (solid.face_nodes(*one) for one in ((found, found.faces[name]), (mesh, faces)))
        assert sorted(own.tolist()) == sorted(given.tolist())
    assert_array_equal(found.sets["tip"], [7])
    assert len(found.volumes["first"]) == len(first)
    part = solid_meshes.read(path, volume="first", order=order)
    assert volume(part) == pytest.approx(0.01 / 3.0)
    assert "left" in part.faces
    assert "right" not in part.faces


@pytest.mark.parametrize("kind", [TETRA, HEXA])
def test_nodes_of_edges_are_known_by_where_they_are(kind: type) -> None:
    bent = lambda x: x + 0.1 * np.column_stack([0 * x[:, 0], x[:, 0] ** 2, 0 * x[:, 0]])  # noqa: E731
    mesh = box((3, 2, 2), kind=kind, shape=bent)
    corners = mesh.kind.corners
    order = np.random.default_rng(2).permutation(int(mesh.kind) - corners) + corners
    found = solid_meshes.made(raw_of(mesh, np.append(np.arange(corners), order)), "it", None, 2)
    assert_array_equal(found.nodes, mesh.nodes)


@pytest.mark.parametrize("kind, order", KINDS)
def test_cells_turned_inside_out_are_turned_back(kind: type, order: int) -> None:
    mesh = box((2, 1, 1), kind=kind, order=order)
    mirror = solid_meshes.mirrored(mesh.kind)
    mixed = mesh.nodes.copy()
    mixed[::2] = mixed[::2, mirror]
    found = solid_meshes.made(raw_of(replace(mesh, nodes=mixed)), "it", None, order)
    assert volume(found) == pytest.approx(0.01)


@pytest.mark.parametrize("kind, order", KINDS)
def test_cells_are_cut_in_eight(kind: type, order: int) -> None:
    curve = lambda x: np.column_stack([x[:, 0], x[:, 1] + 0.2 * x[:, 0] ** 2, x[:, 2]])  # noqa: E731
    mesh = replace(box((3, 2, 2), kind=kind, order=order, shape=curve), sets={"tip": np.array([5])})
    fine = solid_meshes.halve(mesh)
    assert len(fine.nodes) == 8 * len(mesh.nodes)
    assert volume(fine) == pytest.approx(volume(mesh), rel=1e-12)
    quality = np.concatenate([solid.quality(fine, part) for part in solid.parts(fine)])
    assert quality.min() > 0.005
    whole, cut = (len(solid.boundary(one.kind, one.nodes)) for one in (mesh, fine))
    assert cut == 4 * whole  # cells that meet share all nodes
    for name, faces in mesh.faces.items():
        _, before = solid.face_weights(mesh, faces)
        _, after = solid.face_weights(fine, fine.faces[name])
        assert after.sum() == pytest.approx(before.sum(), rel=1e-6)
    assert_array_equal(fine.reference[fine.sets["tip"]], mesh.reference[[5]])
    again = Solid(fine.kind, fine.nodes, fine.reference)
    solid_meshes.made(raw_of(again), "it", None, order)  # all that is asked of a file holds


@pytest.mark.parametrize("kind", [TETRA, HEXA])
def test_gradients_at_nodes_are_those_of_the_functions(kind: type) -> None:
    """Exact for what the cells hold; a rotation stays one."""
    mesh = box((3, 2, 2), kind=kind)
    X = mesh.reference
    rows = recovery.mean_gradients(mesh, np.arange(mesh.count))
    found = (rows @ (X[:, 0] * X[:, 1] + X[:, 2] ** 2)).reshape(-1, 3)
    assert_allclose(found, np.column_stack([X[:, 1], X[:, 0], 2 * X[:, 2]]), atol=1e-12)


def test_first_order_gets_middle_nodes_and_says_so() -> None:
    mesh = box((2, 1, 1), order=1)
    with pytest.warns(Notice, match="nodes in the middle of their edges: 135 unknowns in place"):
        found = solid_meshes.made(raw_of(mesh), "it", None, 2)
    assert found.kind is Kind.TETRA10


def wedges(mesh: Solid) -> Raw:
    raw = raw_of(mesh)
    wedge = MshCells(mesh.nodes[:1, [0, 1, 2, 3, 0, 1]], np.array([77]), {})
    return replace(raw, others={**raw.others, "wedge": wedge})


def apart(mesh: Solid) -> Solid:
    moved = mesh.reference + np.array([0.0, 5.0, 0.0])
    return replace(
        mesh,
        nodes=np.vstack([mesh.nodes, mesh.nodes + mesh.count]),
        reference=np.vstack([mesh.reference, moved]),
    )


def by_an_edge(mesh: Solid) -> Solid:
    """Two boxes that share the nodes of one edge, about which one turns."""
    turned = mesh.reference * [1.0, -1.0, -1.0]
    both = np.vstack([mesh.reference, turned])
    points, same = np.unique(np.round(both, 9), axis=0, return_inverse=True)
    nodes = same.ravel()[np.vstack([mesh.nodes, mesh.nodes + mesh.count])]
    return replace(mesh, nodes=nodes, reference=points)


def flat(mesh: Solid) -> Solid:
    X = mesh.reference.copy()
    cell = mesh.nodes[3]
    X[cell[3]] = X[cell[:3]].mean(axis=0)
    return replace(mesh, reference=X)


def folded(mesh: Solid) -> Solid:
    fine = solid_meshes.second_order(mesh)
    X = fine.reference.copy()
    X[fine.nodes[0, 4]] += [0.9, 0.0, 0.0]
    return replace(fine, reference=X)


@pytest.mark.parametrize(
    "raw, text",
    [
        (lambda m: wedges(m), "all tetrahedra or all hexahedra.*wedge is cell 77 at"),
        (lambda m: raw_of(apart(m)), "hangs together by faces.*2 parts: 12 cells from cell"),
        (lambda m: raw_of(by_an_edge(m)), "share nodes but no face"),
        (lambda m: raw_of(flat(m)), "cells with a volume"),
        (lambda m: raw_of(folded(m)), "nowhere turned inside out.*1 of 12: cell"),
        (lambda m: raw_of(replace(m, nodes=m.nodes[[*range(12), 3]])), "repeated cell 3 at"),
        (
            lambda m: raw_of(replace(m, reference=np.vstack([m.reference[:-1], m.reference[:1]]))),
            "one node a place.*coincide",
        ),
        (lambda m: raw_of(replace(m, reference=np.nan * m.reference)), "finite coordinates"),
    ],
)
def test_what_is_wrong_is_named(raw: object, text: str) -> None:
    with pytest.raises(InputError, match=text):
        solid_meshes.made(raw(box((2, 1, 1), order=1)), "mesh x", None, 1)  # type: ignore[operator]


def test_names_that_are_not_there() -> None:
    mesh = box((2, 1, 1), order=1)
    with pytest.raises(
        InputError, match=r"one of its faces and sets .*'letf'; did you mean 'left'"
    ):
        solid.nodes_of("rim", mesh, "letf")
    with pytest.raises(InputError, match="one of its groups of solid cells"):
        solid_meshes.made(raw_of(mesh), "mesh x", "rod", 1)
