"""VTK series: what is written comes back through meshio and through pyvista, number by number."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.results import frames, series, temporal

from . import rollup


def test_meshio_reads_every_field(tmp_path: Path) -> None:
    given = rollup.spatial()
    pvd = series.write(given, tmp_path, "run")
    assert pvd == tmp_path / "run.pvd"
    rows = ET.parse(pvd).getroot().findall("Collection/DataSet")
    np.testing.assert_array_equal([float(row.attrib["timestep"]) for row in rows], given.times)
    for sample, row in enumerate(rows):
        mesh = meshio.read(tmp_path / row.attrib["file"])
        both = [lines.points[sample] for lines in given.bodies.values()]
        np.testing.assert_array_equal(mesh.points, np.concatenate(both))
        moved = np.concatenate(
            [frames.displacement(lines)[sample] for lines in given.bodies.values()]
        )
        np.testing.assert_array_equal(mesh.point_data["displacement"], moved)
        np.testing.assert_array_equal(
            mesh.point_data["curvature"], np.full(82, given.times[sample] * np.pi)
        )
        np.testing.assert_array_equal(
            mesh.point_data["velocity"][:41], given.bodies["I"].fields["velocity"][sample]
        )
    assert np.isnan(mesh.point_data["velocity"][41:]).all()
    assert np.isnan(mesh.point_data["strain"][41:]).all()
    np.testing.assert_array_equal(mesh.point_data["radius"], np.repeat([0.005, 0.01], 41))
    np.testing.assert_array_equal(mesh.cell_data["body"][0], np.repeat([0, 1], 40))
    assert [40, 41] not in mesh.cells[0].data.tolist()


def test_pyvista_reads_the_series(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    given = rollup.planar()
    reader = pyvista.get_reader(str(series.write(given, tmp_path / "new" / "folder", "roll-up")))
    np.testing.assert_array_equal(reader.time_values, given.times)
    reader.set_active_time_value(1.0)
    grid = reader.read()[0]
    assert grid.n_cells == 40
    np.testing.assert_array_equal(
        grid.point_data["displacement"], frames.displacement(given.bodies["beam"])[-1]
    )
    np.testing.assert_allclose(grid.points[-1], [0.0, 2 / np.pi, 0.0], atol=1e-15)
    lengths = grid.compute_cell_sizes(area=False, volume=False).cell_data["Length"]
    np.testing.assert_allclose(lengths.sum(), 80 / np.pi * np.sin(np.pi / 80), rtol=1e-12)


def test_files_are_binary_and_compressed(tmp_path: Path) -> None:
    series.write(rollup.planar(), tmp_path, "run")
    root = ET.parse(tmp_path / "run" / "00000.vtu").getroot()
    assert root.attrib["compressor"] == "vtkZLibDataCompressor"
    assert {array.attrib["format"] for array in root.iter("DataArray")} == {"binary"}


def test_a_shorter_series_replaces_a_longer_one(tmp_path: Path) -> None:
    given = rollup.planar()
    series.write(given, tmp_path, "run")
    (tmp_path / "run" / "notes.txt").write_text("kept", encoding="utf-8")
    series.write(frames.select(given, np.array([0, 6])), tmp_path, "run")
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == [
        "00000.vtu",
        "00001.vtu",
        "notes.txt",
    ]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run", "run.pvd"]


def test_refused(tmp_path: Path) -> None:
    given = rollup.spatial()
    with pytest.raises(InputError, match="series: name"):
        series.write(given, tmp_path, "../run")
    scalar = replace(given.bodies["II"], fields={"velocity": np.zeros((7, 41))})
    with pytest.raises(InputError, match="field 'velocity'"):
        series.write(replace(given, bodies={"I": given.bodies["I"], "II": scalar}), tmp_path, "run")


def test_one_file_has_the_mesh_once_and_all_fields_over_time(tmp_path: Path) -> None:
    """Read by VTK itself, at every step."""
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF")
    pyvista = pytest.importorskip("pyvista")
    given = rollup.spatial()
    path = temporal.write(
        (frames.select(given, np.array([k])) for k in range(given.times.size)),
        tmp_path / "run.vtkhdf",
    )
    reader = hdf.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == given.times.size
    for step in range(given.times.size):
        reader.SetStep(step)
        reader.Update()
        assert reader.GetTimeValue() == given.times[step]
        grid = pyvista.wrap(reader.GetOutputDataObject(0))
        moved = np.concatenate([body.points[step] for body in given.bodies.values()])
        np.testing.assert_allclose(grid.points + grid.point_data["displacement"], moved, atol=1e-15)
        np.testing.assert_array_equal(
            grid.point_data["curvature"], np.full(82, given.times[step] * np.pi)
        )
        np.testing.assert_array_equal(grid.cell_data["body"], np.repeat([0, 1], 40))
    assert grid.n_cells == 80
