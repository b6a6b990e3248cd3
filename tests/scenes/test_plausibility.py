"""What is hardly meant in a scene: units, sizes, slenderness, sag and the shape of cells, against
figures found by hand.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from skfem import MeshQuad

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Material, body
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.scenes import build, figures, plausibility
from fmbs_skfem.scenes.figures import BodyFigures, CellShapes
from fmbs_skfem.shapes import ancf_plate, plate_meshes, skfem_surface

from ..systems.rigid_parts import grid

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.yaml"))

SCENE = """\
schema: 1
dimension: 2
bodies:
  beam:
    type: cable
    mesh: beam_20.msh
    section: {section}
    material: {{young_modulus: {E}, density: {rho}}}
joints: {{pin: {{type: pin, at: beam.left}}}}
loads:
  weight: {{type: gravity, acceleration: [0, {g}]}}
  spring: {{type: torsion_spring, at: beam.left, stiffness: 1, rest_angle: {rest}}}
analysis: {{type: {analysis}}}
"""
DYNAMIC, STATIC = "dynamic, duration: 1, step: 1e-3", "static"


def judged(
    E: str = "210 GPa",
    rho: str = "7850 kg/m^3",
    section: str = "{shape: circular, diameter: 10 mm}",
    g: str = "-9.81",
    rest: str = "0",
    analysis: str = DYNAMIC,
) -> tuple[BodyFigures, dict[tuple[str, ...], str]]:
    """Figures of the beam of a scene, and its findings by their keys."""
    text = SCENE.format(E=E, rho=rho, section=section, g=g, rest=rest, analysis=analysis)
    scene = scenes.loads(
        text if g != "0" else text.replace("  weight: {type: gravity, acceleration: [0, 0]}\n", ""),
        ROOT / "meshes",
    )
    parts = {name: model.build(scene, None, False) for name, model in scene.bodies.items()}
    known = plausibility.figures(scene, parts)
    return known["beam"], {
        finding.keys: str(finding) for finding in plausibility.findings(scene, known)
    }


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_are_plausible(name: str) -> None:
    scene = scenes.read(ROOT / "examples" / f"{name}.yaml")
    parts = {name: model.build(scene, None, False) for name, model in scene.bodies.items()}
    assert list(plausibility.findings(scene, plausibility.figures(scene, parts))) == []


def test_figures_of_a_steel_rod_of_one_metre() -> None:
    """c = sqrt(E / rho), L / i = 4 L / d, sag = w L^3 / (8 EI) and strain rho g L / E of a circular
    rod.
    """
    found, odd = judged()
    assert odd == {}
    assert found.mass == pytest.approx(7850 * math.pi * 0.01**2 / 4, rel=1e-12)
    assert found.wave_speed == pytest.approx(math.sqrt(210e9 / 7850), rel=1e-12)
    assert found.slenderness == pytest.approx(400.0, rel=1e-12)
    assert found.sag == pytest.approx(7850 * 9.81 * 16 / (8 * 210e9 * 0.01**2), rel=1e-12)
    assert found.weight_strain == pytest.approx(7850 * 9.81 / 210e9, rel=1e-12)
    assert found.extent == pytest.approx(1.0, rel=1e-12)
    assert found.cells is not None
    assert found.cells.count == 20
    assert found.cells.size_ratio == pytest.approx(1.0, rel=1e-9)


def test_weight_counts_only_where_there_is_gravity() -> None:
    found, odd = judged(g="0")
    assert (found.sag, found.weight_strain, odd) == (None, None, {})


@pytest.mark.filterwarnings("ignore:.*the wave speed")
def test_tonnes_and_millimetres_are_told_from_si() -> None:
    """7.85e-9 t/mm3 and 2.1e5 MPa are steel; one of them in SI units is not."""
    _, odd = judged(rho="7.85e-9")
    assert "is it 7850 kg/m3, given in t/mm3?" in odd["bodies", "beam", "material", "density"]
    assert "is the density given in t/mm3?" in odd["bodies", "beam", "material"]
    assert "6.17e-13 kg" in odd["bodies", "beam"]


@pytest.mark.filterwarnings("ignore:.*the wave speed")
@pytest.mark.parametrize(
    ("E", "rho", "hint"),
    [
        ("2.1e5", "7850", "Young's modulus given in MPa"),
        ("210", "7850", "Young's modulus given in GPa"),
        ("2.1e11", "7.85", "the density given in g/cm3"),
        ("2.1e11", "7.85e-9", "the density given in t/mm3"),
        ("2.1e5", "7.85e-9", "the scene given in t, mm and MPa"),
    ],
)
def test_a_wave_speed_off_says_which_unit_would_explain_it(E: str, rho: str, hint: str) -> None:
    scene = scenes.loads(
        SCENE.format(
            E=E,
            rho=rho,
            section="{shape: circular, diameter: 10 mm}",
            g=-1,
            rest=0,
            analysis=DYNAMIC,
        )
    )
    texts = [
        str(finding)
        for finding in plausibility._material(
            scene.bodies["beam"], "beam", math.sqrt(float(E) / float(rho)), True
        )
    ]
    assert any(hint in text for text in texts)


@pytest.mark.filterwarnings("ignore:.*the wave speed")
@pytest.mark.parametrize(
    ("E", "rho", "inside"),
    [(2.5e6, 1e3, False), (2.6e6, 1e3, True), (3.9e11, 1e3, True), (4.1e11, 1e3, False)],
)
def test_wave_speeds_between_50_and_20000_metres_a_second_are_plausible(
    E: float, rho: float, inside: bool
) -> None:
    """sqrt(2.5e6 / 1e3) = 50 and sqrt(4e11 / 1e3) = 20 000 m/s."""
    _, odd = judged(f"{E * (1 - 1e-9):.12g}", f"{rho}", g="0")
    assert (odd == {}) is inside


@pytest.mark.filterwarnings("ignore:.*the wave speed")
def test_without_motion_and_weight_only_what_no_solid_has_is_told() -> None:
    """10 m/s is soft rubber, where 50 m/s is the bound of what moves."""
    assert judged("1e5", "1e3", g="0", analysis=STATIC)[1] == {}
    assert ("bodies", "beam", "material") in judged("1e5", "1e3", g="-1e-3", analysis=STATIC)[1]
    assert (
        "outside 10 to 30000 m/s"
        in judged("0.99e5", "1e3", g="0", analysis=STATIC)[1]["bodies", "beam", "material"]
    )


def test_thick_and_thin_rods_are_told() -> None:
    """4 L / d = 10 below the bound 15 where shear counts; 4e7 above any wire."""
    assert (
        "is below 15" in judged(section="{shape: circular, diameter: 400 mm}")[1]["bodies", "beam"]
    )
    assert (
        "is above 4e+06"
        in judged(section="{shape: circular, diameter: 0.1 um}", g="0")[1]["bodies", "beam"]
    )


def test_given_sections_have_a_wave_speed_and_a_slenderness_too() -> None:
    """sqrt(EA / rhoA) and L sqrt(EA / EI)."""
    found, _ = judged(section="{shape: given, EA: 1e6, EI: 4, rhoA: 0.25}")
    assert found.wave_speed == pytest.approx(2000.0, rel=1e-12)
    assert found.slenderness == pytest.approx(500.0, rel=1e-12)


def test_quadratic_cells_of_a_slender_line_are_told() -> None:
    """EA h^2 / EI = (4 h / d)^2 = 1.6e5 for 20 cells of a wire of 0.5 mm; a cubic or a thicker rod
    is silent.
    """
    thin = "{shape: circular, diameter: 0.5 mm}"
    quadratic = thin + "\n    degree: 2"
    assert (
        "quadratic cells with EA h^2 / EI = 1.6e+05"
        in judged(section=quadratic, g="0")[1]["bodies", "beam", "degree"]
    )
    assert ("bodies", "beam", "degree") not in judged(section=thin, g="0")[1]
    assert ("bodies", "beam", "degree") not in judged(
        section="{shape: circular, diameter: 10 mm}\n    degree: 2", g="0"
    )[1]


@pytest.mark.filterwarnings("ignore:.*the wave speed")
def test_a_body_that_its_weight_crushes_is_told() -> None:
    """rho g L / E = 1e3 * 9.81 / 1e5 = 9.81 %."""
    assert "strains it by 9.81 %" in judged("1e5", "1e3")[1]["bodies", "beam"]


def test_a_body_without_bending_stiffness_is_told() -> None:
    """sag / L = 2 rho g L^3 / (E d^2) = 2e4 for d = 1 um."""
    _, odd = judged("9.81e9", "1e3", section="{shape: circular, diameter: 10 um}")
    assert "as a cantilever it would sag by 2e+04 times its length" in odd["bodies", "beam"]


def test_gravity_in_millimetres_and_angles_in_degrees_are_told() -> None:
    with pytest.warns(Notice) as told:
        judged(g="-9810", rest="90")
    texts = " ".join(str(one.message) for one in told)
    assert "an angle of 90 rad is more than one turn: write '90 deg'" in texts
    assert "write '9810 mm/s^2'" in texts
    assert judged(rest="90 deg")[1] == {}


def test_rigid_bodies_are_as_large_as_their_places_are_apart() -> None:
    """A box of 4 m by 3 m has a diagonal of 5 m; millimetres read as metres are told."""
    part = rigid(
        "r",
        1.0,
        1.0,
        (100.0, 0.0),
        dim=2,
        rotation=np.array([[0.0, -1.0], [1.0, 0.0]]),
        places={"A": (98.0, -1.0), "B": (102.0, 2.0)},
    )
    assert body.extent(part) == pytest.approx(5.0, rel=1e-12)
    (finding,) = plausibility._sizes("r", BodyFigures("r", 1.0, 5e3))
    assert "the size 5e+03 m is outside 1e-06 to 1000 m: is the mesh in metres?" in str(finding)


def shape_of(surface: object) -> CellShapes:
    return figures.plate_cells(plate("plate", surface, 0.1, Material(1e5, 500.0)))[0]  # type: ignore[arg-type]


def test_squares_and_equilateral_triangles_are_perfect() -> None:
    square = shape_of(grid(2, 2))
    assert (square.count, square.angle) == (4, pytest.approx(90.0))
    triangle = shape_of(
        skfem_surface.argyris(
            np.array([[0, 0], [1, 0], [0.5, math.sqrt(0.75)]]), np.array([[0, 1, 2]])
        )
    )
    assert triangle.angle == pytest.approx(60.0, rel=1e-10)
    for cells in (square, triangle):
        assert (cells.size_ratio, cells.aspect, cells.jacobian) == pytest.approx(
            (1.0, 1.0, 1.0), rel=1e-10
        )


def test_rectangles_have_the_aspect_of_their_sides() -> None:
    cells = shape_of(grid(5, 1, 1.0, 2.0))
    assert (cells.aspect, cells.angle, cells.jacobian) == pytest.approx((10.0, 90.0, 1.0), rel=1e-9)


def test_parallelograms_have_their_angle_and_the_aspect_of_the_shear() -> None:
    """Shear s = 1: 45 deg, and singular values of [[1, 1], [0, 1]] in the golden ratio squared."""
    cells = shape_of(grid(1, 1, skew=1.0))
    assert (cells.aspect, cells.angle) == pytest.approx(((3 + math.sqrt(5)) / 2, 45.0), rel=1e-9)


def test_a_trapezoid_has_the_ratio_of_its_widths() -> None:
    """J is linear in the height: 1 - x / 2 at the Gauss points x of three a direction."""
    x = 0.5 + 0.5 * np.polynomial.legendre.leggauss(3)[0]
    points = np.array([[0, 0], [1, 0], [0.75, 1], [0.25, 1]])
    cells = shape_of(ancf_plate.surface(points, np.array([[0, 1, 2, 3]])))
    assert cells.jacobian == pytest.approx((1 - x[2] / 2) / (1 - x[0] / 2), rel=1e-12)


def test_right_triangles_have_their_smallest_angle() -> None:
    """Legs 1 and 10: arctan(1 / 10) = 5.71 deg."""
    cells = shape_of(
        skfem_surface.argyris(np.array([[0, 0], [10, 0], [0, 1]]), np.array([[0, 1, 2]]))
    )
    assert cells.angle == pytest.approx(math.degrees(math.atan(0.1)), rel=1e-9)


def test_bad_cells_are_told_with_their_number_and_place() -> None:
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [1.03, 0], [1.03, 1]])
    cells = shape_of(ancf_plate.surface(points, np.array([[0, 1, 2, 3], [1, 4, 5, 2]])))
    assert cells.size_ratio == pytest.approx(1 / 0.03, rel=1e-9)
    assert (cells.worst, cells.place) == (1, pytest.approx((1.015, 0.5, 0.0), rel=1e-9))
    (text,) = [str(finding) for finding in plausibility._cells("plate", cells)]
    assert "an aspect ratio of 33.3, above 20 (cell 1 at (1.015, 0.5, 0.0))" in text


@pytest.mark.parametrize(
    ("cells", "words"),
    [
        (CellShapes(9, 1.0, angle=10.0), "an angle of 10 deg, below 15 deg"),
        (CellShapes(9, 1.0, jacobian=0.05), "a ratio of Jacobians in one cell of 0.05, below 0.1"),
        (CellShapes(9, 2e3), "sizes that differ by 2e+03, above 1000"),
    ],
)
def test_each_measure_of_cells_has_its_bound(cells: CellShapes, words: str) -> None:
    assert [words in str(finding) for finding in plausibility._cells("plate", cells)] == [True]


@pytest.mark.parametrize(
    "mesh,interpolation,across",
    [("plate_16x1", "ancf", 16), ("plate_16x1", "bfs", 16), ("plate_8x8", "ancf", 0)],
)
def test_strips_of_one_cell_across_are_told(mesh: str, interpolation: str, across: int) -> None:
    """Bent by an end force, nu = 0.3 and b/t = 100, they are 0.8 % off; silent in the plane, and
    without Poisson's ratio.
    """
    for dimension, ratio in ((3, 0.3), (2, 0.3), (3, 0.0)):
        text = f"""\
schema: 1
dimension: {dimension}
bodies:
  strip: {{type: plate, mesh: {mesh}.msh, interpolation: {interpolation}, thickness: 1 mm,
          material: {{young_modulus: 1 GPa, density: 1000, poisson_ratio: {ratio}}}}}
joints: {{clamp: {{type: edge, body: strip, edges: left}}}}
analysis: {{type: static}}
"""
        scene = scenes.loads(text, ROOT / "meshes")
        parts = {"strip": scene.bodies["strip"].build(scene, None, False)}
        known = plausibility.figures(scene, parts)
        assert known["strip"].cells is not None
        assert known["strip"].cells.across == (across if (dimension, ratio) == (3, 0.3) else 0)
        told = [str(finding) for finding in plausibility.findings(scene, known)]
        assert any("16 of 16 cells reach from edge to edge" in text for text in told) == (
            known["strip"].cells.across > 0
        )


@pytest.mark.parametrize("kind", ["plate", "shell"])
@pytest.mark.parametrize(
    ("unit", "asked"), [("", True), ("unit: mm, ", False), ("unit: m, ", False)]
)
def test_files_that_look_as_if_they_were_in_mm_are_asked_about(
    tmp_path: Path, kind: str, unit: str, asked: bool
) -> None:
    """A strip of 200 x 50 mm, 2 mm thick, as every CAD program writes it; what the scene says of
    the unit counts.
    """
    mesh = MeshQuad.init_tensor(
        np.linspace(0.0, 200.0, 9), np.linspace(0.0, 50.0, 3)
    ).with_boundaries({"left": lambda x: x[0] == 0})
    plate_meshes.write(plate_meshes.from_skfem(mesh), tmp_path / "strip.vtu")
    material = "{young_modulus: 210 GPa, density: 7850 kg/m^3}"
    text = f"schema: 1\nbodies: {{strip: {{type: {kind}, mesh: strip.vtu, {unit}thickness: 2 mm, material: {material}}}}}\n"
    text += "joints: {hold: {type: edge, body: strip, edges: left, slope: z}}\nanalysis: {type: static}\n"
    with warnings.catch_warnings(record=True) as shown:
        warnings.simplefilter("always")
        build.system(scenes.loads(text, tmp_path))
    found = [str(one.message) for one in shown]
    expected = "scene:2: bodies.strip: its size is 206.2 m, 1e+05 times its thickness: is the file in mm? write unit: mm"
    assert [text.startswith(expected) for text in found] == [True] * asked
