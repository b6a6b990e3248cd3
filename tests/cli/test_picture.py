"""From trajectories to frames, and the commands that draw and export them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import meshio
import numpy as np
import pytest
from matplotlib import image

from fmbs_skfem import dynamics, scenes, systems
from fmbs_skfem.bodies import plate, sections
from fmbs_skfem.cli import picture
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory
from fmbs_skfem.dynamics.outputs import distances
from fmbs_skfem.dynamics.trajectory import Statistics
from fmbs_skfem.results import series
from fmbs_skfem.results.frames import Kind, Skins
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import ancf_plate

from ..models import cantilever, mass_pendulum, spin_up
from .calls import EXAMPLES, ROOT, fmbs, scene

SHORT = "{type: dynamic, duration: 10 ms, step: 1 ms}"


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


def plate_motion(dim: int, states: np.ndarray, rates: np.ndarray) -> Trajectory:
    """A steel plate of 2 m x 1 m x 1 cm and 4 x 2 cells, whose reference is moved by the linear maps `states` (s, c, c)."""
    x, y = np.meshgrid(np.linspace(0, 2, 5), np.linspace(0, 1, 3), indexing="ij")
    number = np.arange(15).reshape(5, 3)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    shape = ancf_plate.surface(np.column_stack([x.ravel(), y.ravel()]), quads)
    system = systems.assemble([plate.plate("plate", shape, 0.01, sections.Material(*STEEL), dim=dim)])
    reference = system.x0.reshape(-1, dim)
    moved, moving = (np.stack([reference @ A.T for A in part]).reshape(len(part), -1) for part in (states, rates))
    times = np.arange(len(moved), dtype=float)
    return Trajectory(system, times, moved, moving, 0 * moved, np.zeros((len(moved), 0)), Statistics(0, 0, 0, 0, 0.0, 0.0))


STEEL = (200e9, 7800.0, 0.3)  #: E [Pa], rho [kg/m3], nu


@pytest.mark.parametrize("dim", [2, 3])
def test_fields_of_a_stretched_plate(dim: int) -> None:
    """r = F r0 with F = diag(1 + e, 1): E11 = e + e^2/2, S11 = E E11 / (1 - nu^2), S22 = nu S11, turned by 30 degrees at t = 1."""
    e, nu = 1e-3, 0.3
    stretch = np.diag([1 + e, 1.0, 1.0])[:dim, :dim]
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(np.pi / 6), -0.5], [0.5, np.cos(np.pi / 6)]]
    motion = plate_motion(dim, np.stack([stretch, turn[:dim, :dim] @ stretch]), np.stack([0 * stretch, 3.0 * np.eye(dim)]))
    body = picture.frames(motion).bodies["plate"]
    assert isinstance(body, Skins)
    green = e + e**2 / 2
    stress = 200e9 * green / (1 - nu**2) * np.sqrt(1 - nu + nu**2)
    assert body.points.shape == (2, 8 * 9, 3)
    assert body.fields["strain"] == pytest.approx(np.full((2, 72), green), rel=1e-9)
    assert body.fields["membrane_strain"][1] == pytest.approx(np.tile([green, 0, 0], (72, 1)), abs=1e-12)
    for name in ("von_mises", "von_mises_top", "von_mises_bottom"):
        assert body.fields[name] == pytest.approx(np.full((2, 72), stress), rel=1e-7), name
    assert np.abs(body.fields["curvature"]).max() < 1e-9
    assert body.fields["velocity"][1] == pytest.approx(3.0 * body.reference, abs=1e-12)
    assert body.reference[:, 0].max() == pytest.approx(2.0)
    assert np.all(body.thickness == 0.01)
    assert picture.usual_color(motion.system) == "von_mises"


def test_only_wanted_fields_are_kept_and_instants_come_one_by_one() -> None:
    motion = plate_motion(3, np.stack([(1 + 0.1 * s) * np.eye(3) for s in range(3)]), np.zeros((3, 3, 3)))
    some = picture.frames(motion, np.array([0, 2]), ("von_mises",))
    assert list(some.bodies["plate"].fields) == ["von_mises"]
    assert [piece.times.tolist() for piece in picture.pieces(motion, np.array([0, 2]))] == [[0.0], [2.0]]
    whole = picture.frames(motion).bodies["plate"]
    assert np.array_equal(whole.points[[2]], next(picture.pieces(motion, np.array([2]))).bodies["plate"].points)


def test_distance_of_two_motions_of_a_plate() -> None:
    """A plate 0.1 % larger is farthest away at its corner, 1e-3 sqrt(5) m."""
    one, other = (plate_motion(2, (1 + e) * np.stack([np.eye(2)] * 2), np.zeros((2, 2, 2))) for e in (0.0, 1e-3))
    found = picture.errors(one, other, [1.0]).bodies["plate"].fields["error"]
    assert found.max() == pytest.approx(1e-3 * np.sqrt(5), rel=1e-9)
    assert distances(one.system, one.x, other.system, other.x) == pytest.approx([1e-3 * np.sqrt(5)] * 2, rel=1e-9)


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


def test_a_scene_of_mass_points_has_no_lines(tmp_path: Path) -> None:
    motion = dynamics.integrate(mass_pendulum((1.0, 0.0)), GeneralizedAlpha(1e-3), 2e-3)
    found = picture.frames(motion)
    assert found.bodies == {}
    assert Kind.MASS in {kind for kind, _ in found.joints.values()}
    with pytest.raises(InputError, match="at least one cable, plate, shell or rigid body"):
        series.write(found, tmp_path, "motion")


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
    (tmp_path / "plate_linkage_coarse.msh").write_bytes((ROOT / "meshes" / "plate_linkage_coarse.msh").read_bytes())
    path = tmp_path / "rigid.yaml"
    path.write_text(RIGID)
    return path


def test_rigid_bodies_are_lines_that_keep_their_shape(rigid_scene: Path) -> None:
    """A rod through its centre, a triangle, the outline of a plate with two holes; the wheel has no places and stays a point."""
    system = systems.eliminate(build.system(scenes.read(rigid_scene)))
    found = picture.frames(dynamics.integrate(system, GeneralizedAlpha(1e-3), 0.01))
    crank, rod, shown = (found.bodies[name] for name in ("crank", "rod", "plate"))
    assert crank.reference[:, :2] == pytest.approx(np.array([[0, 0], [0.05, 0], [0.1, 0]]), abs=1e-15)
    assert rod.reference[:, :2] == pytest.approx(np.array([[0.1, 0], [0.3, 0], [0.2, 0.1], [0.1, 0]]), abs=1e-15)
    assert found.joints["wheel"][0] == Kind.MASS
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
    assert {"displacement", "velocity"} <= set(meshio.read(tmp_path / "out" / "motion" / "00001.vtu").point_data)


@pytest.mark.usefixtures("opengl")
def test_a_rigid_mechanism_is_drawn(rigid_scene: Path, tmp_path: Path) -> None:
    done = fmbs("render", rigid_scene, "--out", tmp_path / "out", "--no-gif")
    assert done.code == 0, done.err
    shown = image.imread(tmp_path / "out" / "picture.png")
    assert (np.ptp(shown[..., :3], axis=-1) > 0.3).mean() > 0.002


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


@pytest.mark.usefixtures("opengl")
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
