"""Beams with torsion in pictures and VTK: sections swept along the line, closed, of the right size,
with forces and stresses.
"""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import studies
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.beams.drawn_sections import ISection, Tube
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.sections import BeamSection, Material, Rectangular
from fmbs_skfem.core.errors import MissingFeature
from fmbs_skfem.dynamics import Trajectory, outputs, solve_statics
from fmbs_skfem.results import motion, pictures, series
from fmbs_skfem.results.frames import Shown
from fmbs_skfem.results.rendering.drawing import thickened
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures.line_stresses import Stress

E, G = 2e9, 2e9 / 2.6
MADE = Material(E, 1800.0, 0.3)
MESHES = Path(__file__).parents[2] / "meshes"


def along_x(section: BeamSection, cells: int = 12) -> Body:
    line = curves.Line(
        np.linspace(0.0, 1.0, cells + 1),
        curves.Straight(np.zeros(3), np.eye(3)[0], 1.0),
        {"a": 0.0, "b": 1.0},
        None,
    )
    return beam("beam", line, section, direction=np.array([0.0, 1.0, 0.0]))


def bent(section: BeamSection, *acting: loads.Load, steps: int = 1) -> Trajectory:
    system = assemble([along_x(section)], [joints.Clamp("root", At("beam", "a"))], acting)
    return solve_statics(eliminate(system), steps)


def shown(motion_: Trajectory) -> Shown:
    return motion.frames(motion_).bodies["beam"]


def volume(body: Shown, sample: int) -> float:
    """Enclosed by the skin: sum of r . n dA / 3 over triangles, positive where all facets look
    outwards.
    """
    points = body.points[sample]
    a, b, c, d = (points[body.cells[:, k]] for k in range(4))
    return float(
        sum(np.einsum("fc,fc->", p, np.cross(q, r)) for p, q, r in ((a, b, c), (a, c, d))) / 6.0
    )


def edge_uses(body: Shown) -> np.ndarray:
    """How many facets meet in each edge between points that coincide."""
    _, place = np.unique(np.round(body.reference, 9), axis=0, return_inverse=True)
    edges = np.sort(
        place.ravel()[np.stack([body.cells, np.roll(body.cells, -1, axis=1)], axis=-1)].reshape(
            -1, 2
        ),
        axis=1,
    )
    return np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)[1]


SHAPES = {
    "rectangle": (Rectangular(0.06, 0.01), 6e-4),
    "tube": (Tube(diameter=0.06, wall=0.01), np.pi * (0.03**2 - 0.02**2)),
    "i": (
        ISection(width=0.06, height=0.12, web=0.006, flange=0.008),
        2 * 0.06 * 0.008 + 0.104 * 0.006,
    ),
}


@pytest.mark.parametrize("name", SHAPES)
def test_the_skin_is_closed_and_as_large_as_the_beam(name: str) -> None:
    """Area times length, also when bent far: circles are 64-gons, 0.16 % smaller."""
    shape, area = SHAPES[name]
    section = shape.of_beam(MADE)
    EI = float(section.stiffness[4, 4])
    found = shown(bent(section, loads.Moment("M", At("beam", "b"), (0.0, 2.0 * EI, 0.0)), steps=2))
    assert [volume(found, k) for k in (0, -1)] == pytest.approx([area, area], rel=3e-3)
    assert set(edge_uses(found)) == {2}


def test_a_strip_that_is_twisted_keeps_its_width_and_shows_its_stress() -> None:
    """Half a turn: d_2 turns with it, corners stay 3 cm from the line; torque T = GJ/2 pi and von
    Mises sqrt(3) tau.
    """
    section = Rectangular(0.06, 0.004).of_beam(MADE)
    T = np.pi * float(section.stiffness[3, 3])
    found = shown(bent(section, loads.Moment("T", At("beam", "b"), (T, 0.0, 0.0)), steps=4))
    count, around = found.sections
    corners = found.points[-1][: count * around].reshape(count, around, 3)
    far = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    assert_allclose(far, np.hypot(0.03, 0.002), rtol=1e-6)
    assert_allclose(found.fields["axis_2"][-1][(count - 1) * around], [0.0, -1.0, 0.0], atol=1e-3)
    assert_allclose(found.fields["torque"][-1], T, rtol=1e-3)
    assert_allclose(found.fields["torsion"][-1], np.pi, rtol=1e-3)
    # Timoshenko and Goodier: largest tau = k G theta t of a narrow rectangle, 0.9998 of a ratio of
    # 15 and more
    assert found.fields["von_mises"][-1].max() == pytest.approx(
        np.sqrt(3.0) * G * np.pi * 0.004, rel=1e-3
    )


def test_forces_and_stresses_along_a_cantilever() -> None:
    section, F = Rectangular(0.02, 0.03).of_beam(MADE), 0.5
    found = shown(bent(section, loads.PointForce("F", At("beam", "b"), (0.0, 0.0, -F))))
    count, around = found.sections
    x = np.linspace(0.0, 1.0, count)

    def of(name: str) -> np.ndarray:
        return found.fields[name][-1][: count * around].reshape(count, around)

    assert_allclose(of("shear_force"), F, rtol=1e-4)
    assert_allclose(of("bending_moment")[:, 0], F * (1.0 - x), atol=2e-3 * F)
    assert_allclose(
        of("normal_stress").max(axis=1),
        F * (1.0 - x) * 0.015 / (0.02 * 0.03**3 / 12),
        atol=2e-3 * F * 0.015 / 4.5e-8,
    )
    assert_allclose(of("normal_stress").min(axis=1), -of("normal_stress").max(axis=1), atol=10.0)


def test_matrices_are_drawn_as_a_line_with_forces() -> None:
    section = BeamSection(
        np.diag([1e6, 4e5, 4e5, 60.0, 80.0, 20.0]), np.diag([1.0, 1e-4, 4e-4]), radius=0.02
    )
    pulled = bent(section, loads.PointForce("F", At("beam", "b"), (2.0, 0.0, 0.0)))
    found = shown(pulled)
    assert not found.is_surface
    assert motion.derivatives(pulled) == {}  # of cables alone, whose strain they tell
    assert_allclose(found.fields["axial_force"][-1], 2.0, rtol=1e-6)
    assert "von_mises" not in found.fields


def test_thin_sections_are_drawn_thicker_about_their_line() -> None:
    found = shown(
        bent(
            Rectangular(2e-3, 1e-3).of_beam(MADE),
            loads.PointForce("F", At("beam", "b"), (0.0, 0.0, 0.0)),
        )
    )
    wide = thickened(found, found.points[0], 0.05)
    assert_allclose(
        np.ptp(wide, axis=0),
        np.array([1.0, 2e-3, 1e-3]) * [1.0, *[0.05 / np.sqrt(2e-6 / np.pi)] * 2],
        rtol=1e-9,
    )
    assert_allclose(thickened(found, found.points[0], 1e-4), found.points[0])


def test_vtk_holds_the_skin(tmp_path: Path) -> None:
    section, shape = SHAPES["i"][0].of_beam(MADE), At("beam", "b")
    frames = motion.frames(bent(section, loads.PointForce("F", shape, (0.0, 0.0, -5.0))))
    series.write(frames, tmp_path, "m")
    mesh = meshio.read(tmp_path / "m" / "00001.vtu")
    assert len(mesh.get_cells_type("quad")) == len(frames.bodies["beam"].cells)
    assert mesh.point_data["axis_1"].shape == (len(mesh.points), 3)
    assert np.isnan(mesh.point_data.get("thickness", np.array([np.nan]))).all()
    assert_allclose(mesh.point_data["radius"], section.radius)


@pytest.mark.parametrize("name", SHAPES)
def test_the_highest_colours_are_the_stresses_of_the_outputs(name: str, tmp_path: Path) -> None:
    """Under N, V, M and T at once, far bent, in frames and in VTK: 1 % at most, and the same to the
    digits of the law, since the clamp is one of the places that are drawn.
    """
    section, end = SHAPES[name][0].of_beam(MADE), At("beam", "b")
    EI = float(section.stiffness[[4, 5], [4, 5]].min())
    push = loads.PointForce("F", end, (0.3 * EI, 0.2 * EI, -0.5 * EI))
    turn = loads.Moment("T", end, (0.05 * EI, 0.0, 0.0))
    read = {"s": Stress(At("beam", "a"))}
    system = assemble(
        [along_x(section)], [joints.Clamp("root", At("beam", "a"))], [push, turn], outputs=read
    )
    path = solve_statics(eliminate(system), 2)
    known = {key: values[-1] for key, values in outputs(path).items()}
    frames = motion.frames(path)
    series.write(frames, tmp_path, "m")
    mesh = meshio.read(tmp_path / "m" / "00002.vtu")
    for fields in (
        {key: values[-1] for key, values in frames.bodies["beam"].fields.items()},
        mesh.point_data,
    ):
        got = [
            fields["normal_stress"].max(),
            fields["normal_stress"].min(),
            fields["von_mises"].max(),
        ]
        assert_allclose(got, [known["s_max"], known["s_min"], known["s_von_mises"]], rtol=1e-6)


SCENE = """\
schema: 1
bodies:
  beam: {{type: beam, mesh: {mesh}, cells: 6, direction: [0, 1, 0], section: {{shape: rectangular, width: 40 mm, height: 8 mm}},
         material: {{young_modulus: 2 GPa, density: 1800 kg/m^3}}}}
joints: {{root: {{type: clamp, at: beam.left}}}}
loads: {{F: {{type: point_force, at: beam.right, force: [0, 0, -4 N], history: "1 - cos(12*t)"}}}}
analysis: {{type: dynamic, duration: 0.2 s, step: 4 ms}}
outputs: {{tip: {{type: position, at: beam.right}}}}
reduction: {{snapshots: 4 ms, tolerance: 1e-12, hyper_reduction: {{sample: none}}}}
pictures: {{instants: [0 s, 0.2 s], color: von_mises}}
"""


def test_a_saved_reduced_model_draws_it_without_the_mesh(tmp_path: Path) -> None:
    path = tmp_path / "b.yaml"
    path.write_text(SCENE.format(mesh=MESHES / "beam_20.msh"))
    full = studies.run(path, allow_outside=True)
    studies.reduce(path, out=tmp_path / "b.h5", allow_outside=True)
    small = studies.run(tmp_path / "b.h5")
    one, two = (motion.frames(found.trajectory).bodies["beam"] for found in (full, small))
    assert (
        np.abs(one.points[-1] - two.points[-1]).max() < 1e-3 * np.ptp(one.points, axis=(0, 1)).max()
    )
    largest = one.fields["von_mises"].max()
    assert np.abs(one.fields["von_mises"][-1] - two.fields["von_mises"][-1]).max() < 0.05 * largest


def test_a_picture_is_drawn(tmp_path: Path) -> None:
    section = SHAPES["i"][0].of_beam(MADE)
    frames = motion.frames(
        bent(section, loads.PointForce("F", At("beam", "b"), (0.0, 30.0, -300.0)))
    )
    try:
        pictures.render(
            frames, tmp_path / "i.png", options=pictures.PictureOptions(field="von_mises")
        )
    except MissingFeature:
        pytest.skip("no OpenGL")
    assert (tmp_path / "i.png").stat().st_size > 10_000
