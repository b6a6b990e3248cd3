"""What edges hold at nodes with slopes: a line, its normal, or everything at a corner, whatever
digits bend the edge.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem.bodies import Material, edge_directions
from fmbs_skfem.bodies.plate import edge, plate
from fmbs_skfem.shapes import ancf_plate, fvs_plate, fvs_shell, meshes, plate_meshes, skfem_surface
from fmbs_skfem.shapes.plate_meshes import PlateMesh
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems.connections import edges

from ..shapes.test_fvs_plate import shaken

KINDS = ["ancf", "fvs quads", "fvs triangles", "bfs", "argyris", "shell"]


def mesh(cells: int, triangles: bool = False) -> PlateMesh:
    """A unit square whose four sides have names."""
    x = np.linspace(0.0, 1.0, cells + 1)
    points = np.column_stack(
        [*(part.ravel() for part in np.meshgrid(x, x, indexing="ij")), np.zeros((cells + 1) ** 2)]
    )
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    quads = np.stack(corners, axis=-1).reshape(-1, 4)
    lines = {
        "left": number[0],
        "right": number[-1, ::-1],
        "bottom": number[:, 0],
        "top": number[::-1, -1],
    }
    sides = {name: np.column_stack([line[:-1], line[1:]]) for name, line in lines.items()}
    return PlateMesh(
        points,
        np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]) if triangles else quads,
        {},
        sides,
    )


def turned(degrees: float, digits: int, cells: int = 4, triangles: bool = False) -> PlateMesh:
    """The square turned about z, its coordinates rounded to some digits."""
    a, found = np.radians(degrees), mesh(cells, triangles)
    points = found.points @ np.array(
        [[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1]]
    )
    points = np.array([[float(f"{x:.{digits}g}") for x in row] for row in points])
    return replace(found, points=points, resolution=meshes.resolution(points))


def shape_of(kind: str, given: PlateMesh) -> Surface:
    if kind == "shell":
        return fvs_shell.surface(given)[0]
    make = {
        "ancf": ancf_plate.surface,
        "bfs": skfem_surface.bfs,
        "argyris": skfem_surface.argyris,
    }.get(kind, fvs_plate.surface)
    more = ((),) if kind in ("ancf", "fvs quads", "fvs triangles") else ()
    found = make(given.points[:, :2], given.cells, *more, {}, given.edge_groups, {})
    return replace(found, resolution=given.resolution)


def held(shape: Surface, names: tuple[str, ...], position: bool, slope: bool) -> np.ndarray:
    body = plate("plate", shape, 0.01, Material(1e9, 1.0, 0.3))
    return edges.held(body, body.space, edge("edge", shape, names), position, slope).toarray()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("position", "slope"), [(True, False), (False, True), (True, True)])
def test_digits_of_a_file_bend_no_edge(kind: str, position: bool, slope: bool) -> None:
    """As many rows as of a square along the axes, with 5 to 17 digits in any direction, and all of
    them are held by its lines.
    """
    triangles = kind in ("fvs triangles", "argyris")
    names = "left", "bottom"
    count = len(held(shape_of(kind, mesh(4, triangles)), names, position, slope))
    for digits in (17,) if kind == "bfs" else (17, 8, 5):  # that one takes rectangles alone
        for degrees in (30.0, 0.1, 45.0):
            assert (
                len(
                    held(
                        shape_of(kind, turned(degrees, digits, 4, triangles)),
                        names,
                        position,
                        slope,
                    )
                )
                == count
            )


def test_rows_agree_with_traces() -> None:
    """What is held vanishes along the edge, and nothing less does: rows span the trace of all
    functions at many points.
    """
    from fmbs_skfem.bodies.plate import trace

    for kind in ("ancf", "fvs triangles", "bfs", "argyris"):
        shape = shape_of(kind, turned(30.0, 17, 3, kind in ("fvs triangles", "argyris")))
        sides = edge("edge", shape, ("left", "bottom"))
        A, rows = trace(shape, sides).toarray(), held(shape, ("left", "bottom"), True, False)
        assert np.linalg.matrix_rank(A, 1e-8) == len(rows)
        assert np.linalg.matrix_rank(np.vstack([A, rows]), 1e-8) == len(rows)


@pytest.mark.parametrize(("bend", "corners"), [(0.5e-4, 0), (2e-4, 1), (0.2, 1)])
def test_a_corner_is_a_corner(bend: float, corners: int) -> None:
    """An edge that is bent at its middle node by an angle [rad]: beyond 1e-4 everything is held
    there.
    """
    found = mesh(4)
    x = found.points[:, 0]
    shape = shape_of(
        "ancf",
        replace(found, points=found.points - np.outer(bend * np.maximum(x - 0.5, 0.0), [0, 1, 0])),
    )
    assert edge_directions.corners(shape, edge("edge", shape, ("bottom",))) == (5, corners)
    assert len(held(shape, ("bottom",), True, False)) == 10 + corners


@pytest.mark.parametrize("kind", ["ancf", "fvs quads"])
def test_cells_of_any_shape_have_straight_edges(kind: str) -> None:
    """Cells beside the edge are distorted, so that in their parts the derivatives of the parent
    differ at a corner.
    """
    points, cells = shaken(6)
    left = np.flatnonzero(points[:, 0] < 1e-9)
    given = PlateMesh(
        np.column_stack([points, 0.0 * points[:, 0]]),
        cells,
        {},
        {"left": np.column_stack([left[:-1], left[1:]])},
    )
    shape = shape_of(kind, given)
    assert edge_directions.corners(shape, edge("edge", shape, ("left",))) == (7, 0)


@pytest.mark.parametrize("kind", ["ancf", "fvs triangles", "shell"])
def test_edges_that_meet_say_the_same(kind: str) -> None:
    """Rows of one edge and those across another are equal or clearly apart at their corner: no
    singular value near round-off.
    """
    shape = shape_of(kind, turned(30.0, 8, 4, kind != "ancf"))
    rows = np.vstack([held(shape, ("left",), True, False), held(shape, ("bottom",), False, True)])
    values = np.linalg.svd(rows, compute_uv=False)
    assert not ((values > 1e-14) & (values < 1e-2)).any()
    assert (values <= 1e-14).sum() == 1


def test_the_digits_of_coordinates() -> None:
    """Half a unit of the last digit of the largest; few digits, and all of them, are exact."""
    random = np.random.default_rng(0).uniform(-3.0, 3.0, (40, 3))
    for digits in (5, 6, 8, 10):
        assert meshes.resolution(
            np.array([[float(f"{x:.{digits}g}") for x in row] for row in random])
        ) == pytest.approx(0.5 * 10.0 ** (1 - digits))
    assert meshes.resolution(random.astype(np.float32).astype(float)) == pytest.approx(2.0**-23)
    for exact in (
        random,
        np.arange(30.0).reshape(10, 3),
        0.1 * np.arange(30.0).reshape(10, 3),
        np.zeros((3, 3)),
    ):
        assert meshes.resolution(exact) == 0.0


def test_circles_of_few_digits_are_circles() -> None:
    """Nodes of 5 digits miss their circle by 1e-5 of its radius; a line that is bent by 0.001 rad
    is none.
    """
    angle = np.linspace(0.0, 1.0, 9)
    points = np.round(np.column_stack([np.cos(angle), np.sin(angle)]), 5)
    pairs = {"rim": np.column_stack([np.arange(8), np.arange(1, 9)])}
    assert ancf_plate.arcs_of(points, pairs) == []
    (arc,) = ancf_plate.arcs_of(points, pairs, resolution=meshes.resolution(points))
    assert arc.radius == pytest.approx(1.0, abs=1e-4)
    bent = np.column_stack([angle, 1e-3 * np.maximum(angle - 0.5, 0.0)])
    assert ancf_plate.arcs_of(bent, pairs) == []


def test_finer_meshes_keep_the_digits() -> None:
    given = turned(30.0, 7)
    assert given.resolution == pytest.approx(0.5e-6)
    assert plate_meshes.halve(given).resolution == given.resolution
