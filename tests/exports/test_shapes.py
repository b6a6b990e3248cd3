"""Points of bodies for viewers of an FMU, and their skins as binary glTF."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem import studies
from fmbs_skfem.bodies import body, rigid
from fmbs_skfem.bodies.body import Body, point_mass
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.bodies.sections import Material, Rectangular
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.display import SI
from fmbs_skfem.dynamics import GeneralizedAlpha, rest
from fmbs_skfem.exports import c_files, fmu, shapes
from fmbs_skfem.exports.shapes import ShownPoints
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.studies import exporting
from fmbs_skfem.systems import System, assemble, change_coordinates, compile_system
from fmbs_skfem.systems.forces import loads
from tests import models
from tests.results.test_gltf import POLYGON, Part, read
from tests.results.test_swept import along_x
from verification.plates import rectangle

STEP = GeneralizedAlpha(1e-3)
RADIUS = 0.005  #: of the cables of `models`


def shape_of(system: System) -> tuple[ShownPoints, np.ndarray, dict[str, Part]]:
    """The shape of a system, its points (x, 3) at the start, and what the file holds."""
    found = shapes.find_shape(Case(system, STEP, 0.1), system, "test")
    order = compile_system(system).order
    points = (found.offset + found.matrix @ system.x0[order]).reshape(-1, 3)
    return found, points, read(found.skin)


def turned(angle: float) -> np.ndarray:
    """A rotation about (1, 2, 3)."""
    x, y, z = np.array([1.0, 2.0, 3.0]) / 14.0**0.5
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K)


def test_a_plate_is_its_middle_surface() -> None:
    """Its area, and vertices that are its points, in the same order; z up is y of glTF."""
    made = plate("plate", rectangle("quads", 3, 2, 0.3, 0.2), 0.002, Material(7e10, 2700.0, 0.3))
    shape, points, parts = shape_of(assemble([made], []))
    one = parts["plate"]
    assert np.linalg.norm(one.areas, axis=1).sum() == pytest.approx(0.3 * 0.2, rel=1e-6)
    assert_array_equal(one.moved_by, np.arange(len(points)))
    assert_array_equal(one.points, np.float32(points))
    assert_allclose(np.abs(one.normals), np.tile([0, 0, 1], (len(points), 1)), atol=1e-6)
    assert_allclose(one.seen, points @ [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-6)
    assert one.extras == {"first": 0, "points": len(points)}
    # seven floats a vertex, three numbers of two bytes a triangle, and the text
    assert len(shape.skin) < 1300 + 28 * len(points) + 6 * len(one.cells)


def test_cables_in_space_are_tubes_around_their_points() -> None:
    _, points, parts = shape_of(models.double_pendulum(4))
    assert list(parts) == ["I", "II"]
    for one in parts.values():
        first, count = one.extras["first"], one.extras["points"]
        assert_array_equal(one.numbers(), np.arange(first, first + count))
        own = points[first : first + count]
        assert_allclose(one.centres(), own, atol=1e-6)
        assert np.linalg.norm(np.diff(own, axis=0), axis=1).sum() == pytest.approx(1.0)
        assert one.volume == pytest.approx(POLYGON * RADIUS**2, rel=1e-4)


def test_a_model_in_the_plane_is_not_turned() -> None:
    _, points, parts = shape_of(models.spin_up(4))
    one = parts["beam"]
    assert_array_equal(one.seen, one.points)
    assert_allclose(one.centres(), points, atol=1e-6)
    assert not points[:, 2].any()


def test_a_beam_in_space_has_its_section() -> None:
    """A bar of 60 mm x 10 mm: its volume, four sides and two ends, each place moved by a point."""
    made = along_x(Rectangular(0.06, 0.01).of_beam(Material(2e9, 1800.0, 0.3)))
    _, points, parts = shape_of(assemble([made], []))
    one = parts["beam"]
    assert one.volume == pytest.approx(6e-4, rel=1e-5)
    assert len(np.unique(one.normals.round(3), axis=0)) == 6
    assert one.moved_by.max() == len(points) - 1
    apart = one.points - points[one.moved_by]
    assert_allclose(apart[:, 0], 0.0, atol=1e-6)
    assert_allclose(np.abs(apart[:, 1:]).max(axis=0), [0.03, 0.005], atol=1e-6)


def test_a_turned_model_has_turned_points() -> None:
    R = turned(0.7)

    def arm(R: np.ndarray) -> Body:
        line = segment(4, tuple(R @ [0.1, 0.2, 0.3]), tuple(R @ [1.1, 0.2, 0.3]))
        return body.cable("arm", line, models.SECTION, models.MATERIAL)

    (_, first, parts), (_, second, other) = (
        shape_of(assemble([arm(one)], [])) for one in (np.eye(3), R)
    )
    assert_allclose(second, first @ R.T, atol=1e-12)
    assert_allclose(other["arm"].centres(), parts["arm"].centres() @ R.T, atol=1e-6)
    assert other["arm"].volume == pytest.approx(parts["arm"].volume, rel=1e-4)
    moved = follow(parts["arm"], first, second)
    assert_allclose(moved.centres(), second, atol=1e-6)
    assert moved.volume == pytest.approx(parts["arm"].volume, rel=1e-4)


def test_a_viewer_bends_a_tube_by_the_array() -> None:
    """To a quarter of a circle: of a tube of its radius about it, as Pappus has its volume."""
    _, points, parts = shape_of(models.spin_up(4))
    angle = 0.5 * np.pi * points[:, 0]
    bent = np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1) / (0.5 * np.pi)
    moved = follow(parts["beam"], points, bent)
    assert moved.volume == pytest.approx(POLYGON * RADIUS**2, rel=1e-4)
    apart = np.linalg.norm(moved.points - bent[moved.moved_by], axis=1)
    assert_allclose(apart, RADIUS, rtol=1e-3)


def follow(part: Part, start: np.ndarray, now: np.ndarray) -> Part:
    """A body moved by points (x, 3), as the documentation has it."""
    moved = part.points.astype(float)
    first, last = part.extras["first"], part.extras["first"] + part.extras["points"] - 1
    for v, k in enumerate(part.moved_by):
        low, high = max(k - 1, first), min(k + 1, last)
        a, b = (
            (one[high] - one[low]) / np.linalg.norm(one[high] - one[low]) for one in (start, now)
        )
        offset = part.points[v] - start[k]
        along = offset @ a
        offset = offset - along * a
        turned = offset - offset @ b / (1.0 + a @ b) * (a + b)
        moved[v] = now[k] + along * b + turned
    return part._replace(points=moved)


def test_rigid_bodies_and_points_are_there_too() -> None:
    """As the angle through its places that pictures draw, with names as they are."""
    ends = {"a": (0.0, 0.0, 0.0), "b": (0.4, 0.0, 0.3)}
    rod = rigid.rigid('rod <&> "ü"', 1.0, np.eye(3) * 0.01, (0.2, 0.0, 0.15), places=ends)
    ball = point_mass("ball", 1.0, np.array([0.5, 0.3, 0.1]))
    shape, points, parts = shape_of(assemble([rod, ball], []))
    assert list(parts) == ['rod <&> "ü"', "ball"] == list(shape.bodies)
    one = parts['rod <&> "ü"']
    assert_allclose(one.centres(), points[:-1], atol=1e-6)
    assert_allclose(points[[0, -2]], list(ends.values()), atol=1e-12)
    assert one.volume == pytest.approx(POLYGON * rigid.SLIM**2 * 0.4**2 * 0.5, rel=1e-4)
    assert_allclose(parts["ball"].centres(), [[0.5, 0.3, 0.1]], atol=1e-6)
    assert parts["ball"].extras == {"first": len(points) - 1, "points": 1}


def test_bodies_are_where_an_equilibrium_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That is solved once, and the archive has the file, which is the same whenever it is made."""
    sagging = models.cantilever(4, lambda tip: [loads.PointForce("tip", tip, (0.0, -0.5))])
    n = sagging.size
    dense = change_coordinates(sagging, np.eye(n), np.zeros(n))
    case = Case(dense, GeneralizedAlpha(1e-3, start="equilibrium"), 0.1)
    calls = []
    solve = rest.in_equilibrium

    def counted(*given: object) -> object:
        calls.append(given)
        return solve(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(rest, "in_equilibrium", counted)
    made = exporting.ExportedModel(c_files.write(case, "arm", "arm"), "arm", "", SI, case)
    shape = exporting.shape_of(made, True)
    assert len(calls) == 1
    assert shape is not None
    tip = read(shape.skin)["beam"].centres()[-1]
    assert -0.2 < tip[1] < -0.1  # of a stiffness of 1 N m2, 1 m long: F / 3 EI = 0.167 m by beams
    unit = fmu.write(made.model, 3, "arm", shape=shape)
    (tmp_path / "arm.fmu").write_bytes(fmu.pack(unit, ()))
    with zipfile.ZipFile(tmp_path / "arm.fmu") as archive:
        assert archive.read("resources/shape.glb") == shape.skin
    with pytest.raises(InputError, match="an FMU of a model, got one of a part"):
        exporting.shape_of(made._replace(case=None), True)
    again = exporting.shape_of(made, True)
    assert again is not None
    assert again.skin == shape.skin
    bare = fmu.write(made.model, 3, "arm")
    (tmp_path / "bare.fmu").write_bytes(fmu.pack(bare, ()))
    with zipfile.ZipFile(tmp_path / "bare.fmu") as archive:
        assert shapes.SKIN not in archive.namelist()


def test_a_shape_without_an_fmu_of_arrays_is_refused(tmp_path: Path) -> None:
    """Before anything is read or written."""
    for given, got in (
        ({"c": tmp_path / "c"}, "C files"),
        ({"fmu": tmp_path / "a.fmu"}, "one of FMI 2"),
    ):
        with pytest.raises(InputError, match=f"of FMI 3, which has arrays, got {got}.*--fmi 3"):
            studies.export_model(tmp_path / "none.h5", shape=True, **given)  # type: ignore[arg-type]
    assert not [*tmp_path.iterdir()]
