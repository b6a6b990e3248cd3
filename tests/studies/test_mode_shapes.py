"""What moves in modes: shares of bodies, motions that nothing resists, pictures and fields of real
and complex shapes.
"""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from PIL import Image
from scipy.sparse import csr_array

from fmbs_skfem import dynamics, studies
from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.results import mode_shapes
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from verification.plates import rectangle

from ..models import segment

ROOT = Path(__file__).parents[2]
BARS = """\
schema: 1
name: bars
dimension: 2
bodies:
  crank: &bar {type: cable, mesh: ../crank.msh, section: {shape: given, EA: 1e5, EI: 1, rhoA: 1}}
  coupler: {<<: *bar, mesh: ../coupler.msh, origin: [0.2, 0], rotation: 53.13010235415598 deg}
  rocker: {<<: *bar, mesh: ../rocker.msh, origin: [0.5, 0], rotation: 90 deg}
joints:
  O: {type: pin, at: crank.left}
  A: {type: pin, at: crank.right, to: coupler.left}
  C: {type: pin, at: coupler.right, to: rocker.right}
  D: {type: pin, at: rocker.left}
damping: {stiffness: 1e-6}
analysis: {type: modes, count: 4, damped: DAMPED}
"""


def bars(folder: Path, damped: str = "false") -> Path:
    (folder / "scenes").mkdir(exist_ok=True)
    for name in ("crank", "coupler", "rocker"):
        (folder / f"{name}.msh").write_bytes((ROOT / "meshes" / f"{name}.msh").read_bytes())
    path = folder / "scenes" / "bars.yaml"
    path.write_text(BARS.replace("DAMPED", damped))
    return path


def test_shares_are_those_of_the_kinetic_energy() -> None:
    """Two wheels on a common axis with a spring between: J_a w_a + J_b w_b = 0, so that the share
    of a is J_b / (J_a + J_b).
    """
    parts = [
        rigid("a", 1.0, [0.1, 0.2, 0.3], (0.0, 0.0, 0.0)),
        rigid("b", 1.0, [0.4, 0.2, 0.3], (1.0, 0.0, 0.0)),
    ]
    a, b = At("a", "frame"), At("b", "frame")
    held = [
        joints.Revolute("left", a, axis=(1.0, 0.0, 0.0)),
        joints.Revolute("right", b, axis=(1.0, 0.0, 0.0)),
    ]
    system = assemble(parts, held, [loads.TorsionSpring("shaft", a, b, 5.0, axis=(1.0, 0.0, 0.0))])
    linear = dynamics.linearise(system)
    found = dynamics.complex_modes(linear, 2)
    assert found.angular_frequencies[-1] == pytest.approx(np.sqrt(5.0 / 0.1 + 5.0 / 0.4))
    shares = dynamics.shares(dynamics.Shapes(system, linear.x, found.shapes[:, -1:], ("torsion",)))
    assert (shares["a"], shares["b"]) == pytest.approx((0.8, 0.2))


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
def test_a_mechanism_has_its_motion_and_shares_of_bodies(tmp_path: Path) -> None:
    """The coupler of a four-bar linkage turns about the point where crank and rocker meet, (0.5,
    0).
    """
    found = studies.run(bars(tmp_path), out=tmp_path / "out")
    assert found.frequencies[0] == 0.0
    assert found.frequencies[1] > 1.0
    moves = found.report["moves"]
    assert (
        moves[0]
        == "crank turns about (0, 0); coupler turns about (0.5, 0); rocker turns about (0.5, 0)"
    )
    assert moves[1].startswith("coupler 9")
    parts = np.array(list(found.report["shares"].values()))
    np.testing.assert_allclose(parts.sum(axis=0), 1.0, rtol=1e-9)
    table = np.genfromtxt(tmp_path / "out" / "modes.csv", delimiter=",", names=True)
    np.testing.assert_allclose(table["share_coupler"], found.report["shares"]["coupler"])
    damped = studies.run(bars(tmp_path, "true"))
    assert damped.report["moves"][0] == moves[0]
    assert damped.report["damping_ratios"][1] > 1e-6
    np.testing.assert_allclose(damped.frequencies, found.frequencies, rtol=1e-4)
    assert damped.report["shares"]["coupler"][1] == pytest.approx(
        found.report["shares"]["coupler"][1], rel=1e-3
    )


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
def test_modes_are_drawn_and_exported(tmp_path: Path) -> None:
    done = studies.render(bars(tmp_path), gif=False, out=tmp_path / "out")
    assert [path.name for path in done.files] == ["modes.csv", "report.json", "modes.png"]
    image = np.asarray(Image.open(tmp_path / "out" / "modes.png").convert("RGB")).astype(int)
    assert (np.ptp(image, axis=2) > 60).sum() > 2000  # coloured bodies, not only the pale state
    studies.export(bars(tmp_path), out=tmp_path / "vtk")
    mesh = meshio.read(tmp_path / "vtk" / "modes" / "00000.vtu")
    sizes = [np.linalg.norm(mesh.point_data[f"mode_{k}"], axis=1).max() for k in (1, 2, 3, 4)]
    np.testing.assert_allclose(sizes, 1.0, rtol=1e-9)
    first = mesh.point_data["mode_1"]
    tip = np.linalg.norm(
        mesh.points - [0.5, 0.4, 0.0], axis=1
    ).argmin()  # on coupler and rocker, it moves across the rocker
    np.testing.assert_allclose(np.abs(first[tip]), [1.0, 0.0, 0.0], atol=1e-9)


def test_lobes_to_both_sides_are_seen_and_differ(tmp_path: Path) -> None:
    """A plate that moves up, down and along itself: two panels of as many red as blue pixels, one
    without colour.
    """
    part = plate(
        "sheet", rectangle("bfs", 2, 2, 0.5, 0.4), 2e-3, sections.Material(2e9, 1200.0, 0.3), dim=3
    )
    system = eliminate(assemble([part]))
    linear = dynamics.linearise(system)
    free = dynamics.find_free(system, linear)
    up, along = (
        free.vectors[:, free.names.index(f"sheet moves along {axis}")]
        for axis in ("(0, 0, 1)", "(1, 0, 0)")
    )
    shapes = dynamics.Shapes(
        system, linear.x, np.stack([up, -up, along], axis=1), ("up", "down", "along")
    )
    frames, look = mode_shapes.coloured(
        mode_shapes.moved(shapes, shapes.vectors.T), float(np.abs(up).max())
    )
    assert look.limits == (-1.0, 1.0)
    shown = frames.bodies["sheet"].fields[mode_shapes.DEFLECTION]
    np.testing.assert_allclose(
        shown, np.broadcast_to(np.array([[0.0], [1.0], [-1.0], [0.0]]), shown.shape), atol=1e-12
    )
    sheet = np.asarray(
        Image.open(mode_shapes.picture(shapes, tmp_path / "modes.png")).convert("RGB")
    ).astype(int)
    scenes = sheet[:, : int(0.8 * sheet.shape[1])]  # without the key
    red, blue = (
        (scenes[:, :, one] - scenes[:, :, other] > 80).sum() for one, other in ((0, 2), (2, 0))
    )
    assert red > 1000
    assert blue == pytest.approx(red, rel=0.05)


def test_the_state_behind_lines_is_a_line(tmp_path: Path) -> None:
    """A rod that is shifted across itself: a thin grey line where it was, no tube."""
    part = body.cable("rod", segment(2), sections.Given(EA=1e9, EI=1e3, rhoA=1.0), dim=2, degree=3)
    system = eliminate(assemble([part]))
    linear = dynamics.linearise(system)
    free = dynamics.find_free(system, linear)
    shapes = dynamics.Shapes(
        system, linear.x, free.vectors[:, [free.names.index("rod moves along (0, 1)")]], ("across",)
    )
    sheet = np.asarray(
        Image.open(mode_shapes.picture(shapes, tmp_path / "modes.png")).convert("RGB")
    ).astype(int)
    middle = sheet[:, int(0.45 * sheet.shape[1])]  # between two lines of the grid
    grey = (np.ptp(middle, axis=1) < 8) & (middle[:, 0] > 60) & (middle[:, 0] < 205)
    assert 1 <= grey.sum() <= 4


def shaft(spin: float) -> System:
    part = body.cable(
        "shaft", segment(8), sections.Given(EA=1e4, EI=1.0, rhoA=1.0), dim=3, degree=5
    )
    ends = [joints.Spherical("a", At("shaft", "left")), joints.Spherical("b", At("shaft", "right"))]
    raw = assemble([part], ends, [])
    return eliminate(dynamics.in_rotating_frame(raw, dynamics.Spin(spin, (1.0, 0.0, 0.0))))


def test_a_whirling_shaft_goes_round_in_a_circle() -> None:
    """Its largest displacement is REACH of its length at every phase, and an animation closes."""
    system = shaft(3.0)
    linear = dynamics.linearise(system)
    modes = dynamics.complex_modes(linear, 2)
    shapes = dynamics.Shapes(system, linear.x, modes.shapes, ("backward", "forward"))
    unit, size = mode_shapes.unit_vectors(shapes)
    assert size == pytest.approx(1.0)
    phases = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 7))[:, None]
    frames = mode_shapes.moved(shapes, np.real(phases * unit[:, 1]))
    apart = np.linalg.norm(
        frames.bodies["shaft"].points[1:] - frames.bodies["shaft"].points[:1], axis=2
    )
    np.testing.assert_allclose(apart.max(axis=1), 1.0, rtol=1e-6)
    assert dynamics.shares(shapes)["shaft"] == pytest.approx([1.0, 1.0])


def test_a_soft_spring_holds_a_stiff_rod() -> None:
    """A rod turns freely about its pin; a spring with a thousand-millionth of its stiffness holds
    it.
    """
    part = body.cable("rod", segment(2), sections.Given(EA=1e9, EI=1e3, rhoA=1.0), dim=2, degree=3)
    system = eliminate(assemble([part], [joints.Pin("top", At("rod", "left"))], []))
    linear = dynamics.linearise(system)
    assert dynamics.find_free(system, linear).names == ("rod turns about (0, 0)",)
    tip = csr_array(system.lift.matrix)[[2 * np.flatnonzero(system.unit > 0.5)[-1] + 1]]
    held = dynamics.Linear(
        linear.x, linear.mass, linear.damping, linear.stiffness + 1.0 * (tip.T @ tip), linear.rows
    )
    assert dynamics.find_free(system, held).names == ()


def test_one_of_several_motions_is_animated(tmp_path: Path) -> None:
    system = shaft(3.0)
    linear = dynamics.linearise(system)
    modes = dynamics.complex_modes(linear, 2)
    shapes = dynamics.Shapes(system, linear.x, modes.shapes, ("backward", "forward"))
    path = mode_shapes.animate(shapes, 1, tmp_path / "mode_2.gif", count=2)
    assert path.stat().st_size > 1000
