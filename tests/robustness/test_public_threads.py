"""Questions that people asked in public about other programs, as small inputs of our own.

Each has an exact or independent number, or the words of a refusal; the thread stands in its
docstring.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipk

from fmbs_skfem.dynamics import GeneralizedAlpha, start
from fmbs_skfem.scenes import build, reading
from tests.cli.calls import fmbs

from .inputs import lines, msh, quads, refused

G = 9.81  #: [m/s2]
ENDS = '$PhysicalNames\n2\n0 1 "left"\n0 2 "right"\n$EndPhysicalNames\n'


def solved(folder: Path, scene: str, mesh: str = "", name: str = "m.msh") -> dict[str, float]:
    """The last row of the table of a run, by column."""
    (folder / name).write_text(mesh)
    (folder / "scene.yaml").write_text("schema: 1\n" + scene)
    done = fmbs("run", folder / "scene.yaml", "--no-plots", "--out", folder / "out")
    assert done.code == 0, done.err
    table = np.genfromtxt(next((folder / "out").glob("*.csv")), delimiter=",", names=True)
    last = np.atleast_1d(table)[-1]
    return {column: float(last[column]) for column in table.dtype.names}


def segment(cells: int, end: Sequence[float]) -> str:
    """A line from the origin with its points left and right."""
    points = [tuple(i / cells * float(x) for x in end) for i in range(cells + 1)]
    return msh(
        points,
        ["15 2 1 1 1", f"15 2 2 2 {cells + 1}", *lines(*((i, i + 1) for i in range(1, cells + 1)))],
        ENDS,
    )


def sheet(
    columns: int,
    rows: int,
    size: tuple[float, float],
    names: str,
    edges: list[str],
    height: Sequence[float],
) -> str:
    """Even quadrilaterals over a rectangle, and edges of one's own; `height` of every column of
    nodes.
    """
    width = columns + 1
    points = [
        (size[0] * i / columns, size[1] * j / rows, float(height[i]))
        for j in range(rows + 1)
        for i in range(width)
    ]
    corners = [1 + i + width * j for j in range(rows) for i in range(columns)]
    return msh(
        points, [*edges, *quads(*((k, k + 1, k + 1 + width, k + width) for k in corners))], names
    )


# ------------------------------------------------------------------------------------------------------------------------ beams
def test_a_cable_on_a_hub_turns_with_it(tmp_path: Path) -> None:
    """w = M t / (J + rhoA L^3 / 3) = 3/16 rad/s. https://github.com/jgerstmayr/EXUDYN/issues/1"""
    scene = """
dimension: 2
bodies:
  hub: {type: rigid, mass: 1 kg, inertia: 5 kg m^2, center: [0, 0]}
  b: {type: cable, mesh: m.msh, section: {shape: given, EA: 1e7, EI: 1e6, rhoA: 1}}
joints: {pin: {type: pin, at: hub.center}, grip: {type: weld, at: b.left, to: hub.frame}}
loads: {t: {type: torque, at: hub.frame, torque: 1 N m}}
analysis: {type: dynamic, duration: 1 s, step: 5 ms}
outputs: {w: {type: angular_velocity, at: hub.frame}}
"""
    assert solved(tmp_path, scene, segment(4, (1, 0)))["w"] == pytest.approx(3 / 16, rel=1e-6)


def test_reactions_of_a_small_oblique_beam(tmp_path: Path) -> None:
    """Opposite to the load. https://github.com/Dhondtguido/CalculiX/issues/16"""
    scene = """
dimension: 2
bodies:
  b: {type: cable, mesh: m.msh, section: {shape: given, EA: 1e5, EI: 8e-3, rhoA: 1e-3}}
joints: {c: {type: clamp, at: b.left}}
loads: {f: {type: point_force, at: b.right, force: [1 N, 1 N]}}
analysis: {type: static, load_steps: 1}
outputs: {r: {type: reaction, joint: c}}
"""
    found = solved(tmp_path, scene, segment(2, (2e-3, 2e-3)))
    assert [found["r_x"], found["r_y"]] == pytest.approx([-1, -1], abs=1e-10)


def test_a_beam_under_tension_is_a_string(tmp_path: Path) -> None:
    """f = sqrt(T / (rhoA l L)) / 2 of the length l under T, and EI pi^2 / (T l^2) of it more:
    49.9750 Hz.

    https://github.com/karamba3d/K3D_NightlyBuilds/issues/18
    """
    scene = """
dimension: 2
bodies: {b: {type: cable, mesh: m.msh, section: {shape: given, EA: 1e5, EI: 1e-6, rhoA: 0.01}}}
joints: {a: {type: pin, at: b.left}, s: {type: slider, at: b.right, direction: [1, 0]}}
loads: {t: {type: point_force, at: b.right, force: [100 N, 0]}}
analysis: {type: modes, count: 1}
"""
    found = solved(tmp_path, scene, segment(20, (1, 0)))
    assert found["frequency_hz"] == pytest.approx(0.5 * np.sqrt(1e4 / 1.001), rel=1e-5)


@pytest.mark.parametrize("along", [(1, 0, 0), (0, 0, 1), (2 / 7, 3 / 7, 6 / 7)])
def test_a_cantilever_bends_alike_in_every_direction(
    along: tuple[float, ...], tmp_path: Path
) -> None:
    """P L^3 / (3 EI). https://github.com/KratosMultiphysics/Kratos/issues/14657"""
    L, across = 4.0, np.cross(along, (0.6, 0.8, 0))
    across /= np.linalg.norm(across)
    scene = f"""
bodies: {{b: {{type: cable, mesh: m.msh, section: {{shape: given, EA: 1e9, EI: 1e6, rhoA: 10}}}}}}
joints: {{c: {{type: clamp, at: b.left}}}}
loads: {{f: {{type: point_force, at: b.right, force: {across.tolist()}}}}}
analysis: {{type: static, load_steps: 1}}
outputs: {{p: {{type: position, at: b.right}}}}
"""
    found = solved(tmp_path, scene, segment(4, L * np.array(along)))
    moved = np.array([found["p_x"], found["p_y"], found["p_z"]]) - L * np.array(along)
    np.testing.assert_allclose(moved, L**3 / 3e6 * across, rtol=1e-6, atol=1e-9)


def test_signs_of_a_tip_moment(tmp_path: Path) -> None:
    """Inside both components are those of the load, also that about z.
    https://github.com/KratosMultiphysics/Kratos/issues/9181
    """
    scene = """
bodies: {b: {type: cable, mesh: m.msh, section: {shape: given, EA: 1e9, EI: 1e7, rhoA: 10}}}
joints: {c: {type: clamp, at: b.left}}
loads: {f: {type: moment, at: b.right, moment: [0, 1000, 1000]}}
analysis: {type: static, load_steps: 1}
outputs: {s: {type: section_forces, at: {body: b, s: 5 m}}, p: {type: position, at: b.right}}
"""
    found = solved(tmp_path, scene, segment(10, (10, 0, 0)))
    assert [found["s_Mx"], found["s_My"], found["s_Mz"]] == pytest.approx([0, 1000, 1000], abs=1e-4)
    assert [found["p_y"], found["p_z"]] == pytest.approx([5e-3, -5e-3], rel=1e-6)


def test_one_element_in_pure_bending(tmp_path: Path) -> None:
    """An arc of the angle a = M L / EI: the tip at L (sin a, 1 - cos a) / a.
    https://github.com/KratosMultiphysics/Kratos/issues/2346
    """
    scene = """
dimension: 2
bodies: {b: {type: cable, mesh: m.msh, section: {shape: given, EA: 1e6, EI: 1, rhoA: 1}}}
joints: {c: {type: clamp, at: b.left}}
loads: {f: {type: moment, at: b.right, moment: 0.1}}
analysis: {type: static, load_steps: 1}
outputs: {p: {type: position, at: b.right}, a: {type: angle, at: b.right}}
"""
    found = solved(tmp_path, scene, segment(1, (1, 0)))
    assert [found["p_x"], found["p_y"]] == pytest.approx(
        [np.sin(0.1) / 0.1, (1 - np.cos(0.1)) / 0.1], rel=1e-6
    )
    assert found["a"] == pytest.approx(0.1, rel=1e-6)


def test_an_arm_on_a_turned_shaft(tmp_path: Path) -> None:
    """Its tip turns as the shaft does, by 0.01 rad.
    https://github.com/Dhondtguido/CalculiX/issues/42
    """
    scene = """
bodies:
  b: {type: cable, mesh: m.msh, section: {shape: given, EA: 20 MN, EI: 170 N m^2, rhoA: 0.8 kg/m}}
  hub: {type: rigid, mass: 0.01 kg, inertia: [1e-4, 1e-4, 1e-4], center: [0, 0, 0]}
joints:
  w: {type: weld, at: b.left, to: hub.frame}
  h: {type: revolute, at: hub.frame, axis: [1, 0, 0]}
  d: {type: driven_angle, at: hub.frame, axis: [1, 0, 0], angle: 0.01 * (t - sin(2*pi*t) / (2*pi))}
analysis: {type: dynamic, duration: 1 s, step: 10 ms}
outputs: {p: {type: position, at: b.right}}
"""
    assert solved(tmp_path, scene, segment(2, (0, 1, 0)))["p_z"] == pytest.approx(
        np.sin(0.01), rel=1e-3
    )


# ---------------------------------------------------------------------------------------------------------------- plates, shells
@pytest.mark.parametrize("kind,wave", [("plate", 0.0), ("shell", 0.01)])
def test_a_sheet_on_two_edges_flat_and_wavy(kind: str, wave: float, tmp_path: Path) -> None:
    """Its own weight between planes of symmetry: int M m / D ds along z = a sin(4 pi x / L), flat 5
    q L^4 / (384 D).

    https://github.com/Dhondtguido/CalculiX/issues/64
    """
    E, nu, t, rho, L, n = 210e9, 0.3, 1e-3, 7850.0, 0.4, 32
    # a thousandth of the weight: small displacements
    D, q = (
        E * t**3 / 12 / (1 - nu**2),
        rho * t * G * 1e-3,
    )
    names = (
        '$PhysicalNames\n4\n1 1 "left"\n1 2 "right"\n1 3 "sides"\n0 5 "mid"\n$EndPhysicalNames\n'
    )
    edges = [
        *(
            f"1 2 {tag} {tag} {k} {k + n + 1}"
            for j in range(2)
            for tag, k in ((1, 1 + j * (n + 1)), (2, (j + 1) * (n + 1)))
        )
    ]
    edges += [
        f"1 2 3 3 {k} {k + 1}" for j in (0, 2) for k in range(1 + j * (n + 1), n + 1 + j * (n + 1))
    ]
    edges += [f"15 2 5 5 {n + 2 + n // 2}"]
    x = np.linspace(0, L, n + 1)
    mesh = sheet(n, 2, (L, 0.05), names, edges, wave * np.sin(4 * np.pi * x / L))
    scene = f"""
bodies:
  p: {{type: {kind}, mesh: m.msh, thickness: {t}, material: {{young_modulus: {E}, density: {rho}, poisson_ratio: {nu}}}}}
joints:
  a: {{type: edge, body: p, edges: left, fixed: xz}}
  b: {{type: edge, body: p, edges: right, fixed: z}}
  s: {{type: edge, body: p, edges: sides, fixed: y, slope: xz}}
loads: {{w: {{type: gravity, acceleration: [0, 0, {-G * 1e-3}]}}}}
analysis: {{type: static, load_steps: 1}}
outputs: {{p: {{type: position, at: p.mid, component: z}}}}
"""

    def length(x: float) -> float:
        return float(np.hypot(1, wave * 4 * np.pi / L * np.cos(4 * np.pi * x / L)))

    support = quad(lambda s: q * length(s) * (L - s) / L, 0, L)[0]

    def product(x: float) -> float:
        """Moment of the weight times that of a unit load in the middle, whose left half is that of
        the right.
        """
        return float(
            (support * x - quad(lambda s: q * length(s) * (x - s), 0, x)[0]) * x / 2 * length(x) / D
        )

    assert solved(tmp_path, scene, mesh)["p"] == pytest.approx(
        -2 * quad(product, 0, L / 2)[0], rel=1e-3
    )


@pytest.mark.parametrize("names", ['1 2 "in"\n1 3 "in"', '1 2 "in"\n1 3 "more"'])
def test_an_edge_of_two_tags(names: str, tmp_path: Path) -> None:
    """One name of two tags of a gmsh file is one edge.
    https://github.com/HiFiLES/HiFiLES-solver/issues/4
    """
    edges = ["1 2 2 2 1 2", "1 2 2 2 2 3", "1 2 3 3 1 4", "1 2 3 3 4 7"]
    mesh = sheet(
        2, 2, (1, 1), f"$PhysicalNames\n2\n{names}\n$EndPhysicalNames\n", edges, np.zeros(3)
    )
    held = "in" if "more" not in names else "[in, more]"
    scene = f"""
bodies: {{p: {{type: plate, mesh: m.msh, thickness: 10 mm, material: {{young_modulus: 70 GPa, density: 2700}}}}}}
joints: {{c: {{type: edge, body: p, edges: {held}, slope: z}}}}
loads: {{w: {{type: gravity, acceleration: [1, 2, 0]}}}}
analysis: {{type: static, load_steps: 1}}
outputs: {{r: {{type: reaction, joint: c}}}}
"""
    found = solved(tmp_path, scene, mesh)
    assert [found["r_x"], found["r_y"]] == pytest.approx([-27, -54], rel=1e-7)


SURFACE = (
    "*NODE\n1, 0., 0.\n2, 2., 0.\n3, 0., 1.\n4, 2., 1.\n*ELEMENT, TYPE=CPS4, ELSET=all\n1, 1, 2, 4, 3\n"
    "*SURFACE, NAME=left, TYPE=ELEMENT\nleft, S4\n*ELSET, ELSET=left\n1\n"
)
GRID = (
    "# vtk DataFile Version 5.1\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 1\nORIGIN 0 0 0\nSPACING 1 1 1\n"
    "POINT_DATA 6\nSCALARS left int 1\nLOOKUP_TABLE default\n1 0 0 1 0 0\n"
)
HELD = """
dimension: 2
bodies: {{p: {{type: plate, mesh: {mesh}, thickness: 10 mm, material: {{young_modulus: 70 GPa, density: 2700}}}}}}
joints: {{c: {{type: {joint}}}}}
loads: {{w: {{type: gravity, acceleration: [0, -1]}}}}
analysis: {{type: static, load_steps: 1}}
outputs: {{r: {{type: reaction, joint: c}}}}
"""


def test_a_side_of_elements_is_an_edge(tmp_path: Path) -> None:
    """Of an Abaqus file with *SURFACE alone, of a set of its name that comes later.

    https://github.com/libMesh/libmesh/issues/2315 https://github.com/Luecx/FEMaster/issues/27
    """
    scene = HELD.format(mesh="m.inp", joint="edge, body: p, edges: left")
    assert solved(tmp_path, scene, SURFACE, "m.inp")["r_y"] == pytest.approx(54, rel=1e-9)


def test_structured_points_are_a_mesh(tmp_path: Path) -> None:
    """Of VTK 5.1; two points have no edge of their own.
    https://github.com/nschloe/meshio/issues/1205
    """
    (tmp_path / "m.vtk").write_text(GRID)
    (tmp_path / "scene.yaml").write_text(
        "schema: 1\n" + HELD.format(mesh="m.vtk", joint="edge, body: p, edges: left")
    )
    refused(
        tmp_path / "scene.yaml",
        "joints.c.edges: body 'p': expected one of its edges (none), got the points 'left'; an edge is",
    )
    scene = HELD.format(
        mesh="m.vtk",
        joint="pin, at: 'p.left[0]'}, d: {type: slider, at: 'p.left[1]', direction: [0, 1]",
    )
    assert solved(tmp_path, scene, GRID, "m.vtk")["r_y"] == pytest.approx(54, rel=1e-9)


# ------------------------------------------------------------------------------------------------------------- rigid bodies, joints
def test_friction_on_a_slope(tmp_path: Path) -> None:
    """a = g (sin b - mu cos b) = 2.35629 m/s^2 at 30 degrees.
    https://github.com/projectchrono/chrono/issues/462
    """
    scene = """
dimension: 2
bodies: {blk: {type: point_mass, mass: 1 kg, position: [0, 0]}}
loads:
  w: {type: gravity, acceleration: [0, -9.81]}
  g: {type: contact_plane, at: blk, point: [0, 0], normal: [0.5, 0.8660254037844386], friction: 0.3, stiffness: 1e5, damping: 200}
analysis: {type: dynamic, duration: 0.5 s, step: 1 ms}
outputs: {v: {type: velocity, at: blk}}
"""
    found = solved(tmp_path, scene)
    a = G * (np.sin(np.pi / 6) - 0.3 * np.cos(np.pi / 6))
    assert np.hypot(found["v_x"], found["v_y"]) / 0.5 == pytest.approx(a, rel=1e-3)


def test_two_drives_in_a_row(tmp_path: Path) -> None:
    """r = R(z, 2) (c + R(n, 3) d) of a driven body on a driven carrier.
    https://github.com/projectchrono/chrono/issues/438
    """
    scene = """
bodies:
  sun: {type: rigid, mass: 1 kg, inertia: [1, 1, 1], center: [0, 0, 0], points: {arm: [2, 0, 0]}}
  earth: {type: rigid, mass: 1 kg, inertia: [0.1, 0.2, 0.3], center: [2, 0, 0], points: {city: [2.5, 0, 0]}}
joints:
  orbit: {type: revolute, at: sun.center, axis: [0, 0, 1]}
  day: {type: revolute, at: earth.center, to: sun.arm, axis: [0, 0.6, 0.8]}
  year: {type: driven_angle, at: sun.frame, axis: [0, 0, 1], angle: 2 * (t - sin(2*pi*t) / (2*pi))}
  turn: {type: driven_angle, at: earth.frame, to: sun.frame, axis: [0, 0.6, 0.8], angle: 3 * (t - sin(2*pi*t) / (2*pi))}
analysis: {type: dynamic, duration: 1 s, step: 10 ms}
outputs: {p: {type: position, at: earth.city}}
"""
    n, d = np.array([0, 0.6, 0.8]), np.array([0.5, 0, 0])
    x, y, z = np.array([2, 0, 0]) + np.cos(3) * d + np.sin(3) * np.cross(n, d)
    found = solved(tmp_path, scene)
    expected = [np.cos(2) * x - np.sin(2) * y, np.sin(2) * x + np.cos(2) * y, z]
    assert [found["p_x"], found["p_y"], found["p_z"]] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("L", [1.0, 4.0])
def test_a_long_rod_on_a_ball_joint(L: float, tmp_path: Path) -> None:
    """From level to its lowest point in K(1/2) / w0, w0^2 = m g L / (2 J).
    https://github.com/dimforge/rapier/issues/86
    """
    m, r = 2.0, 0.05
    about = m * (3 * r**2 + L**2) / 12
    time = float(ellipk(0.5) / np.sqrt(m * G * L / 2 / (about + m * L**2 / 4)))
    scene = f"""
bodies:
  c: {{type: rigid, mass: {m}, inertia: [{m * r**2 / 2}, {about}, {about}], center: [{L / 2}, 0, 0], points: {{o: [0, 0, 0]}}}}
joints: {{s: {{type: spherical, at: c.o}}}}
loads: {{g: {{type: gravity, acceleration: [0, 0, {-G}]}}}}
analysis: {{type: dynamic, duration: {time}, step: {time / 400}}}
outputs: {{p: {{type: position, at: c.center}}}}
"""
    found = solved(tmp_path, scene)
    assert [found["p_x"], found["p_y"], found["p_z"]] == pytest.approx([0, 0, -L / 2], abs=1e-4 * L)


HUNG = """
bodies: {{a: {{type: rigid, mass: 1 kg, inertia: [1, 1, 1], center: [0, 0, 0]}}}}
joints: {{u: {{type: {joint}}}}}
loads: {{g: {{type: gravity, acceleration: [0, 0, -9.81]}}}}
analysis: {{type: dynamic, duration: 2 ms, step: 1 ms{start}}}
outputs: {{d: {{type: distance, at: a.center, to: [0, 0, 1]}}}}
"""


@pytest.mark.parametrize(
    "joint,said,code",
    [
        pytest.param(
            "universal, at: a.frame, axis: [0, 0, 1], axis_to: [0, 0, 2]",
            "joints.u: joint 'u'.axis_to: expected an axis normal to the other, got an angle of 0 deg",
            3,
            id="https://github.com/zhuminjie/OpenSeesPy/issues/68",
        ),
        pytest.param(
            "revolute, at: a.frame, axis: [0, 0, 0]",
            "joints.u.axis: expected an axis that is not zero, got [0, 0, 0]",
            3,
            id="https://github.com/o3seespy/o3seespy/issues/5",
        ),
        pytest.param(
            "spherical, at: a.frame, to: node_ground",
            "joints.u.to: expected one of the bodies a, got the body 'node_ground'",
            3,
            id="https://github.com/gdbaldw/BlenderAndMBDyn/issues/14",
        ),
        pytest.param(
            "distance, at: a.center, to: [0, 0, 1], length: 0.4",
            "the initial state does not satisfy the joints: expected no gaps, got u.length by 1.05; draw the bodies where",
            3,
            id="https://github.com/FreeCAD/FreeCAD/issues/17556",
        ),
    ],
)
def test_joints_that_cannot_be(joint: str, said: str, code: int, tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("schema: 1\n" + HUNG.format(joint=joint, start=""))
    refused(tmp_path / "scene.yaml", said, code=code)


def test_a_link_of_another_length_than_drawn(tmp_path: Path) -> None:
    """Is met from the equilibrium. https://github.com/FreeCAD/FreeCAD/issues/17556"""
    scene = HUNG.format(
        joint="distance, at: a.center, to: [0, 0, 1], length: 0.4", start=", start: equilibrium"
    )
    assert solved(tmp_path, scene)["d"] == pytest.approx(0.4, rel=1e-9)


# -------------------------------------------------------------------------------------------------------------------------- units
BAR = """
dimension: 2
bodies:
  b:
    type: cable
    mesh: m.msh
    section: {{shape: rectangular, width: 10 mm, height: 10 mm}}
    material: {{young_modulus: {E}, density: 7850}}
joints: {{c: {{type: clamp, at: b.left}}}}
loads: {{f: {{type: point_force, at: b.right, force: [0, -1 N]}}}}
analysis: {{type: static, load_steps: 1}}
outputs: {{p: {{type: position, at: b.right, component: y}}}}
"""


@pytest.mark.parametrize("E", ["210 GPa", "210000 N/mm^2", "2.1e8 kg/mm/s^2"])
def test_one_modulus_in_three_units(E: str, tmp_path: Path) -> None:
    """F L^3 / (3 EI). https://github.com/FreeCAD/FreeCAD/issues/27486"""
    found = solved(tmp_path, BAR.format(E=E), segment(4, (1, 0)))
    assert found["p"] == pytest.approx(-4 / (210e9 * 0.01**4), rel=1e-5)


def test_a_modulus_a_thousand_times_too_small_is_noticed(tmp_path: Path) -> None:
    """https://github.com/FreeCAD/FreeCAD/issues/27486"""
    (tmp_path / "m.msh").write_text(segment(4, (1, 0)))
    (tmp_path / "scene.yaml").write_text("schema: 1\n" + BAR.format(E="210000"))
    assert "is Young's modulus given in MPa?" in fmbs("check", tmp_path / "scene.yaml").err
    (tmp_path / "scene.yaml").write_text("schema: 1\n" + BAR.format(E="2.1e8 kg/(mm*s^2)"))
    refused(
        tmp_path / "scene.yaml",
        "young_modulus: expected a unit such as",
        "'/(mm*s^2)' is not part of a unit",
    )


def test_angles_in_degrees_and_radians(tmp_path: Path) -> None:
    """Radians inside, degrees where they are written.
    https://github.com/opensim-org/opensim-core/issues/3936
    """
    scene = """
dimension: 2
parameters: {{goal: 90 deg}}
bodies: {{a: {{type: rigid, mass: 1 kg, inertia: 1 kg m^2, center: [0, 0]}}}}
joints: {{p: {{type: pin, at: a.center}}, d: {{type: driven_angle, at: a.frame, angle: {angle}}}}}
analysis: {{type: dynamic, duration: 1 s, step: 10 ms}}
outputs: {{a: {{type: angle, at: a.frame}}}}
"""
    found = solved(
        tmp_path, scene.format(angle="goal * (t / (1 s) - sin(2*pi*t / (1 s)) / (2*pi))")
    )
    assert found["a"] == pytest.approx(np.pi / 2, abs=1e-9)
    (tmp_path / "scene.yaml").write_text("schema: 1\n" + scene.format(angle="90 deg * t"))
    refused(
        tmp_path / "scene.yaml",
        "expected an angle [rad] as a function of t, got '90 deg * t' (s rad)",
    )


# -------------------------------------------------------------------------------------------------------------------------- steps
def test_inputs_act_once_and_on_time() -> None:
    """m v = h (u1 + u2 + u3), each from the middle of its step, and t = k h.

    https://github.com/CATIA-Systems/FMPy/issues/697
    https://github.com/CATIA-Systems/FMPy/issues/664
    """
    text = """
schema: 1
dimension: 2
inputs: {u: {unit: N}}
bodies: {cart: {type: point_mass, mass: 2 kg, position: [0, 0]}}
loads: {push: {type: control_force, at: cart, direction: [1, 0], force: u}}
outputs: {cart: {type: position, at: cart}, speed: {type: velocity, at: cart}}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
"""
    h, m = 1e-3, 2.0
    run = start(build.system(reading.loads(text)), GeneralizedAlpha(h, rho_inf=1.0))
    for k, u in enumerate((1.0, 5.0, -2.0, 0.0, 0.0, 0.0, 0.0), 1):
        run.step({"u": u})
        assert run.time == pytest.approx(k * h, rel=1e-14)
    found = run.outputs()
    assert found["speed_x"] == pytest.approx(h * (1 + 5 - 2) / m, rel=1e-12)
    assert found["cart_x"] == pytest.approx(h**2 * (1 * 6 + 5 * 5 - 2 * 4) / m, rel=1e-12)
