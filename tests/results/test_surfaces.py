"""Surfaces in frames, pictures and VTK series: outlines and normals exactly, pixels where the plate
is, fields that come back.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.results import colour_scales, frames, pictures, series, surfaces
from fmbs_skfem.results.frames import Shown
from fmbs_skfem.results.pictures import PictureOptions
from fmbs_skfem.results.rendering import camera, render_child

from . import sheet
from .test_pictures import pixels, saturated


def plate() -> Shown:
    body = sheet.turning().bodies["plate"]
    assert body.is_surface
    return body


def test_cells_that_share_points_have_one_place() -> None:
    points, _ = sheet.holed()
    place = surfaces.places(points)
    assert place.max() + 1 == 16
    for number in range(16):
        assert np.ptp(points[place == number], axis=0).max() == 0.0


def test_the_outline_is_the_rim_and_the_hole() -> None:
    """12 + 4 edges of length 1/3; a cylinder of 4 x 24 cells is smooth inside; a box corner is a
    crease.
    """
    points, quads = sheet.holed()
    edges = surfaces.outline(points, quads, surfaces.places(points))
    assert edges.shape == (16, 2)
    np.testing.assert_allclose(
        np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1), 1 / 3, rtol=1e-14
    )
    points, quads = sheet.cylinder()
    assert len(surfaces.outline(points, quads, surfaces.places(points))) == 2 * (4 + 24)
    flat, quads = sheet.split(*sheet.grid(4, 1))
    angle = np.where(flat[:, :1] > 0.5, [[0.5, 0.0]], [[0.0, 0.0]])
    bent = np.where(
        flat[:, :1] > 0.5, np.column_stack([angle[:, 0], flat[:, 1], flat[:, 0] - 0.5]), flat
    )
    assert len(surfaces.outline(bent, quads, surfaces.places(bent))) == 2 * (4 + 1) + 1


def test_normals_of_a_cylinder_and_of_collapsed_quadrilaterals() -> None:
    """Away from its edges, equal facets on both sides make the normals of a cylinder exact: n = (0,
    y, z).
    """
    points, quads = sheet.cylinder()
    found = surfaces.normals(points, quads, surfaces.places(points))
    inside = points[:, 2] > 1e-9
    expected = points * [0, 1, 1]
    np.testing.assert_allclose(
        found[inside] * np.sign(found[inside][:, 2:]), expected[inside], atol=1e-12
    )
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_allclose(
        surfaces.normals(triangle, np.arange(4)[None], np.arange(4)), np.tile([0.0, 0, 1], (4, 1))
    )
    assert len(surfaces.outline(triangle, np.arange(4)[None], surfaces.places(triangle))) == 3


def test_bad_surfaces_are_refused() -> None:
    good = sheet.turning()
    with pytest.raises(
        InputError, match=r"body 'plate'\.cells: expected indices from 0 to 31, got 0 to 32"
    ):
        replace(good, bodies={"plate": replace(plate(), cells=np.array([[0, 1, 2, 32]]))})
    with pytest.raises(InputError, match="body 'plate'"):
        replace(good, bodies={"plate": replace(plate(), size=np.ones(3))})


def test_stresses_start_at_zero() -> None:
    assert colour_scales.limits([sheet.mixed()], "von_mises") == (0.0, 5e7)


def test_distance_of_two_plates() -> None:
    full = sheet.turning()
    shifted = replace(
        full,
        bodies={"plate": replace(plate(), points=plate().points + np.array([0.0, 3e-6, 4e-6]))},
    )
    np.testing.assert_allclose(
        frames.with_error(shifted, full).bodies["plate"].fields["error"], 5e-6, rtol=1e-9
    )


@pytest.mark.parametrize("whole", [True, False])
def test_lines_and_surfaces_in_one_vtk_series(whole: bool, tmp_path: Path) -> None:
    given = sheet.mixed()
    if whole:
        series.write(given, tmp_path, "run")
    else:
        series.write_each((frames.select(given, np.array([s])) for s in range(7)), tmp_path, "run")
    mesh = meshio.read(tmp_path / "run" / "00006.vtu")
    beam, roof = given.bodies["beam"], given.bodies["roof"]
    assert roof.is_surface
    assert [block.type for block in mesh.cells] == ["line", "quad"]
    np.testing.assert_array_equal(mesh.cells[1].data, roof.cells + 41)
    np.testing.assert_array_equal(mesh.points, np.concatenate([beam.points[6], roof.points[6]]))
    np.testing.assert_array_equal(
        np.concatenate(mesh.cell_data["body"]), np.repeat([0, 1], [40, 96])
    )
    np.testing.assert_array_equal(mesh.point_data["von_mises"][41:], 5e7)
    np.testing.assert_array_equal(mesh.point_data["thickness"][41:], 0.02)
    assert np.isnan(mesh.point_data["von_mises"][:41]).all()
    assert np.isnan(mesh.point_data["radius"][41:]).all()
    assert (tmp_path / "run.pvd").read_text().count("<DataSet") == 7


@pytest.mark.usefixtures("opengl")
def test_a_plate_is_drawn_where_it_is(tmp_path: Path) -> None:
    """All of the turned square is red at 100 MPa but for the hole, which shows the ground; stresses
    are scaled to MPa.
    """
    given = replace(sheet.turning(), marks={})
    options = PictureOptions("von_mises", size=(480, 360), limits=(0.0, 1e8))
    full = replace(
        given, bodies={"plate": replace(plate(), fields={"von_mises": np.full((5, 32), 1e8)})}
    )
    image = pixels(pictures.render(full, tmp_path / "plate.png", [1.0], options))
    job = pictures.make_job(
        frames.select(full, np.array([4])), options, "multiples", 1.0, tmp_path / "a.png.part"
    )
    assert (job.scale.label, job.scale.limits) == ("von Mises stress [MPa]", (0.0, 100.0))
    columns, view = render_child.arrange(job)
    assert columns == 1
    middles = full.bodies["plate"].points[4].reshape(-1, 4, 3).mean(axis=1)
    red = saturated(image)
    assert all(red[round(y), round(x)] for x, y in camera.project(view, middles))
    ((x, y),) = camera.project(view, np.array([[-0.5, 0.5, 0.0]]))
    assert (image[round(y), round(x)] > 200).all()


@pytest.mark.usefixtures("opengl")
def test_shells_and_beams_share_a_picture(tmp_path: Path) -> None:
    """Six instants, each with a shaded roof: its colour varies with the light although the stress
    does not.
    """
    path = pictures.render(
        sheet.mixed(),
        tmp_path / "both.png",
        options=PictureOptions("von_mises", size=(900, 640), limits=(0.0, 1e8)),
    )
    image = pixels(path)
    warm = (image[..., 0] > image[..., 2] + 60) & (np.arange(image.shape[1]) < image.shape[1] - 200)
    assert warm.sum() > 5000
    assert np.ptp(image[warm][:, 0]) > 20
