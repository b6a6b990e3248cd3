"""From trajectories to frames, and the commands that draw and export them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from matplotlib import image
from numpy.testing import assert_allclose

from fmbs_skfem import dynamics, scenes, systems
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.results import motion as picture
from fmbs_skfem.results import series
from fmbs_skfem.results.pictures import PictureOptions
from fmbs_skfem.results.rendering import painter
from fmbs_skfem.scenes import build
from fmbs_skfem.studies import job
from fmbs_skfem.studies.running import pictures as study_pictures
from fmbs_skfem.studies.running import runs

from ..models import mass_pendulum
from .calls import EXAMPLES, ROOT, fmbs, scene

SHORT = "{type: dynamic, duration: 10 ms, step: 1 ms}"


def test_a_scene_of_mass_points_shows_the_rod_between_them(tmp_path: Path) -> None:
    motion = dynamics.integrate(mass_pendulum((1.0, 0.0)), GeneralizedAlpha(1e-3), 2e-3)
    found = picture.frames(motion)
    (rod,) = found.bodies.values()
    ends = rod.points
    assert_allclose(np.linalg.norm(ends[:, -1] - ends[:, 0], axis=1), 1.0, rtol=1e-9)
    assert "point mass" in {mark.kind for mark in found.marks.values()}
    assert series.write(found, tmp_path, "motion")


def test_a_scene_without_anything_to_draw_has_no_series(tmp_path: Path) -> None:
    motion = dynamics.integrate(mass_pendulum((1.0, 0.0)), GeneralizedAlpha(1e-3), 2e-3)
    bare = replace(picture.frames(motion), bodies={})
    with pytest.raises(InputError, match="at least one cable, plate, shell or rigid body"):
        series.write(bare, tmp_path, "motion")


RIGID = f"""\
schema: 1
name: rigid
dimension: 2
bodies:
  crank: {{type: rigid, mass: 1, inertia: 1e-3, center: [0.05, 0], points: {{A: [0, 0], B: [0.1, 0]}}, rotation: 30 deg}}
  rod: {{type: rigid, mass: 1, inertia: 1e-2, center: [0.2, 0.02], points: {{B: [0.1, 0], C: [0.3, 0], D: [0.2, 0.1]}}}}
  plate: {{type: rigid_plate, mesh: plate_linkage_coarse.msh, thickness: 1 cm, density: 10, origin: [0.2, 0]}}
  wheel: {{type: rigid, mass: 1, inertia: 1e-3, center: [0, 1]}}
joints:
  A: {{type: revolute, at: crank.A, to: ground}}
  B: {{type: revolute, at: crank.B, to: rod.B}}
  C: {{type: weld, at: rod.C, to: plate}}
loads:
  motor: {{type: torque, at: crank, torque: 1}}
analysis: {SHORT}
"""


@pytest.fixture
def rigid_scene(tmp_path: Path) -> Path:
    (tmp_path / "plate_linkage_coarse.msh").write_bytes(
        (ROOT / "meshes" / "plate_linkage_coarse.msh").read_bytes()
    )
    path = tmp_path / "rigid.yaml"
    path.write_text(RIGID)
    return path


def test_rigid_bodies_are_lines_that_keep_their_shape(rigid_scene: Path) -> None:
    """A rod through its centre, a triangle, the outline of a plate with two holes; the wheel has no
    places and stays a point.
    """
    system = systems.eliminate(build.system(scenes.read(rigid_scene)))
    found = picture.frames(dynamics.integrate(system, GeneralizedAlpha(1e-3), 0.01))
    crank, rod, shown = (found.bodies[name] for name in ("crank", "rod", "plate"))
    assert crank.reference[:, :2] == pytest.approx(
        np.array([[0, 0], [0.05, 0], [0.1, 0]]), abs=1e-15
    )
    assert rod.reference[:, :2] == pytest.approx(
        np.array([[0.1, 0], [0.3, 0], [0.2, 0.1], [0.1, 0]]), abs=1e-15
    )
    assert found.marks["wheel"].kind == "point mass"
    assert shown.reference[0] == pytest.approx(shown.reference[-1])
    outline = np.linalg.norm(np.diff(shown.reference, axis=0), axis=1)
    assert outline.sum() == pytest.approx(2 * 0.2 + 2 * np.pi * 0.035, rel=5e-3)
    assert picture.usual_color(system) is None
    for body in (crank, rod, shown):
        assert body.fields.keys() == {"velocity"}
        sides = np.linalg.norm(np.diff(body.points, axis=1), axis=2)
        assert sides == pytest.approx(np.broadcast_to(sides[0], sides.shape), rel=1e-9)
    assert np.ptp(crank.points[:, -1, 1]) > 1e-5


def test_a_rigid_mechanism_is_exported(rigid_scene: Path, tmp_path: Path) -> None:
    done = fmbs("export", rigid_scene, "--out", tmp_path / "out", "--frames", "2")
    assert done.code == 0, done.err
    assert {"displacement", "velocity"} <= set(
        meshio.read(tmp_path / "out" / "motion" / "00001.vtu").point_data
    )


@pytest.mark.usefixtures("opengl")
def test_a_rigid_mechanism_is_drawn(rigid_scene: Path, tmp_path: Path) -> None:
    done = fmbs("render", rigid_scene, "--out", tmp_path / "out", "--no-gif")
    assert done.code == 0, done.err
    shown = image.imread(tmp_path / "out" / "picture.png")
    assert (np.ptp(shown[..., :3], axis=-1) > 0.3).mean() > 0.002


def test_export_writes_a_series_with_all_fields(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = fmbs(
        "export",
        EXAMPLES / "four_bar.yaml",
        "--out",
        out,
        "--duration",
        "0.05",
        "--frames",
        "6",
        "--json",
    )
    assert done.code == 0
    assert str(out / "motion.pvd") in done.json["files"]
    parts = sorted((out / "motion").glob("*.vtu"))
    assert len(parts) == 6
    data = meshio.read(parts[-1]).point_data
    assert {"displacement", "strain", "curvature", "velocity"} <= set(data)
    assert np.linalg.norm(data["displacement"], axis=1).max() > 1e-3
    assert np.abs(data["displacement"][:, 2]).max() == 0


def test_a_scene_without_a_name_has_that_of_its_file_in_every_title(
    rigid_scene: Path, tmp_path: Path
) -> None:
    rigid_scene.write_text(
        RIGID.replace("name: rigid\n", "").replace(
            "analysis:", "outputs: {B: {type: position, at: rod.B}}\nanalysis:"
        )
    )
    (path := rigid_scene.with_name("slow_crank.yaml")).write_text(rigid_scene.read_text())
    with job.begin(path) as work:
        task = runs.scene_task(work, one := job.read_scene(work))
    motion = dynamics.integrate(task.system, GeneralizedAlpha(1e-3), 2e-3)
    drawn = study_pictures.scene(one, motion, tmp_path)
    assert task.title == "slow_crank"
    assert {
        one.title for order in drawn for one in order.args if isinstance(one, PictureOptions)
    } == {"slow_crank"}
    assert len(drawn) == 2


@pytest.mark.usefixtures("opengl")
def test_render_draws_a_picture_and_an_animation(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = fmbs(
        "render",
        EXAMPLES / "four_bar.yaml",
        "--out",
        out,
        "--duration",
        "0.05",
        "--frames",
        "3",
        "--json",
    )
    assert done.code == 0
    assert (out / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "animation.gif").read_bytes().startswith(b"GIF8")
    assert "instants after the end" in done.json["notices"][0]


def test_without_opengl_the_numbers_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process that draws dies by a signal, as VTK does where there is no OpenGL."""
    monkeypatch.setattr(painter.Painter, "draw", lambda *_: (-11, ""))
    out = tmp_path / "out"
    done = fmbs("render", scene(tmp_path, SHORT), "--out", out, "--json")
    assert done.code == 7
    assert "apt-get install" in done.json["message"]
    assert done.json["reason"] == "missing feature"
    assert done.json["outputs"]["tip_y"]["max"] > 0
    assert (out / "outputs.csv").is_file()
