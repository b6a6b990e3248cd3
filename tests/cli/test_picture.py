"""From trajectories to frames, and the commands that draw and export them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import meshio
import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes, systems
from fmbs_skfem.cli import picture
from fmbs_skfem.core.errors import InputError, MissingFeature
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.results import pictures
from fmbs_skfem.results.frames import Kind
from fmbs_skfem.scenes import build

from ..models import cantilever, mass_pendulum, spin_up
from .calls import EXAMPLES, fmbs, scene

SHORT = "{type: dynamic, duration: 10 ms, step: 1 ms}"


def opengl() -> bool:
    try:
        pictures.probe()
    except MissingFeature:
        return False
    return True


def test_fields_of_a_stretched_beam_and_of_an_arc() -> None:
    """A stretch of 1 + e has the strain ((1 + e)^2 - 1) / 2, an arc of radius R the curvature 1 / R; a beam at rest has none."""
    system = cantilever(cells=20, dim=3)
    motion = dynamics.integrate(systems.eliminate(system), GeneralizedAlpha(1e-3), 2e-3)
    start = picture.frames(motion).bodies["beam"]
    assert start.points.shape == (3, 201, 3)
    assert np.abs(start.fields["strain"]).max() < 1e-10
    assert np.abs(start.fields["velocity"]).max() < 1e-8
    jets = np.zeros((1, 3, 201, 2))
    angle = np.linspace(0, 1, 201) / 0.5
    jets[0, 0] = 0.5 * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    jets[0, 1] = 1.1 * np.column_stack([np.cos(angle), np.sin(angle)])
    jets[0, 2] = 1.21 / 0.5 * np.column_stack([-np.sin(angle), np.cos(angle)])
    arc = picture.lines(jets, jets, jets, 0.01)
    assert arc.fields["curvature"] == pytest.approx(np.full((1, 201), 2.0), rel=1e-12)
    assert arc.fields["strain"] == pytest.approx(np.full((1, 201), 0.5 * (1.21 - 1)), rel=1e-12)
    assert np.all(arc.points[..., 2] == 0)


def test_points_follow_the_outputs_of_a_planar_system() -> None:
    motion = dynamics.integrate(spin_up(cells=10), GeneralizedAlpha(1e-3), 0.05)
    found, outputs = picture.frames(motion), dynamics.outputs(motion)
    tip = found.bodies["beam"].points[:, -1]
    assert tip[:, 0] == pytest.approx(outputs["tip_x"], abs=1e-12)
    assert tip[:, 1] == pytest.approx(outputs["tip_y"], abs=1e-12)
    rate = np.gradient(tip[:, 1], found.times)
    assert found.bodies["beam"].fields["velocity"][1:-1, -1, 1] == pytest.approx(rate[1:-1], abs=1e-4)
    assert found.joints["hinge"][0] == Kind.PIN
    assert found.joints["drive"][0] == Kind.DRIVEN_ANGLE
    assert picture.frames(motion, picture.spread(motion, 3)).times == pytest.approx([0, 0.025, 0.05])


def test_masses_and_driven_supports_are_told_apart() -> None:
    system = systems.eliminate(build.system(scenes.read(EXAMPLES / "hanging_mass.yaml")))
    found = picture.frames(dynamics.integrate(system, GeneralizedAlpha(1e-3), 2e-3))
    kinds = {name: kind for name, (kind, _) in found.joints.items()}
    assert kinds == {"left": Kind.DRIVEN_POSITION, "right": Kind.SPHERICAL, "hook": Kind.SPHERICAL, "mass": Kind.MASS}
    assert found.joints["mass"][1][0] == pytest.approx([1, 0, 0])


def test_a_scene_of_mass_points_has_no_lines() -> None:
    motion = dynamics.integrate(mass_pendulum((1.0, 0.0)), GeneralizedAlpha(1e-3), 2e-3)
    with pytest.raises(InputError, match="at least one cable"):
        picture.frames(motion)


def test_export_writes_a_series_with_all_fields(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = fmbs("export", EXAMPLES / "four_bar.yaml", "--out", out, "--duration", "0.05", "--frames", "6", "--json")
    assert done.code == 0
    assert str(out / "motion.pvd") in done.json["files"]
    parts = sorted((out / "motion").glob("*.vtu"))
    assert len(parts) == 6
    data = meshio.read(parts[-1]).point_data
    assert {"displacement", "strain", "curvature", "velocity"} <= set(data)
    assert np.linalg.norm(data["displacement"], axis=1).max() > 1e-3
    assert np.abs(data["displacement"][:, 2]).max() == 0


@pytest.mark.skipif(not opengl(), reason="no off-screen OpenGL here")
def test_render_draws_a_picture_and_an_animation(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = fmbs("render", EXAMPLES / "four_bar.yaml", "--out", out, "--duration", "0.05", "--frames", "3", "--json")
    assert done.code == 0
    assert (out / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "animation.gif").read_bytes().startswith(b"GIF8")
    assert "instants after the end" in done.json["notices"][0]


def test_without_opengl_the_numbers_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The process that draws dies by a signal, as VTK does where there is no OpenGL."""
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: subprocess.CompletedProcess([], -11, "", ""))
    out = tmp_path / "out"
    done = fmbs("render", scene(tmp_path, SHORT), "--out", out, "--json")
    assert done.code == 7
    assert "apt-get install" in done.json["message"]
    assert done.json["reason"] == "missing feature"
    assert done.json["outputs"]["tip_y"]["max"] > 0
    assert (out / "outputs.csv").is_file()
