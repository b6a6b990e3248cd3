"""Strains, stresses and section forces as outputs, against beams and plates with known sections;
their units and axes.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from skfem import MeshLine, MeshQuad

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes import meshes, plate_meshes
from fmbs_skfem.shapes.meshes import polyline
from fmbs_skfem.systems.measures.probes import column_labels, column_units

FOLDER = Path(__file__).parents[2] / "meshes"
BEAM = """\
schema: 1
dimension: {dim}
bodies:
  beam: {{type: cable, mesh: line.msh, section: {{shape: circular, diameter: 10 mm}}, rotation: {rotation},
         material: {{young_modulus: 1 GPa, density: 1000}}}}
joints: {{clamp: {{type: clamp, at: beam.left}}}}
loads: {{push: {{type: point_force, at: beam.right, force: {force}}}}}
analysis: {{type: static, load_steps: 1}}
outputs: {{root: {{type: section_forces, at: beam.left}}, middle: {{type: section_forces, at: {{body: beam, s: 0.25 m}}}}}}
"""
PLATE = """\
schema: 1
dimension: {dim}
bodies:
  strip: {{type: plate, mesh: strip.msh, interpolation: {kind}, thickness: 10 mm, rotation: {rotation},
          material: {{young_modulus: 1 GPa, density: 1000, poisson_ratio: {nu}}}}}
joints: {{left: {{type: edge, body: strip, edges: left{slope}}}}}
loads: {{tip: {{type: edge_load, body: strip, edges: right, force: {force}}}}}
analysis: {{type: static, load_steps: 1}}
outputs:
  stress: {{type: stress_tensor, at: strip.{at}}}
  below: {{type: stress_tensor, at: strip.{at}, face: bottom}}
  strain: {{type: strain_tensor, at: strip.{at}}}
  middle: {{type: strain_tensor, at: strip.{at}, face: middle}}
  forces: {{type: section_forces, at: strip.{at}}}
  mises: {{type: stress, at: strip.{at}}}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    line = MeshLine(np.linspace(0.0, 1.0, 5)).with_boundaries(
        {"left": lambda x: x[0] == 0.0, "right": lambda x: x[0] == 1.0}
    )
    meshes.write(meshes.from_skfem(line), tmp_path / "line.msh")
    quad = MeshQuad.init_tensor(np.linspace(0.0, 1.0, 5), np.linspace(0.0, 0.5, 3))
    quad = quad.with_boundaries({"left": lambda x: x[0] == 0.0, "right": lambda x: x[0] == 1.0})
    mesh = plate_meshes.from_skfem(quad)
    at = [
        np.flatnonzero(np.all(np.abs(mesh.points[:, :2] - place) < 1e-12, axis=1))
        for place in ([0.5, 0.25], [0.0, 0.0])
    ]
    named = {"middle": at[0], "root": at[1]}
    plate_meshes.write(
        type(mesh)(mesh.points, mesh.cells, named, mesh.edge_groups, mesh.face_groups),
        tmp_path / "strip.msh",
    )
    return tmp_path


def solved(text: str, folder: Path) -> dict[str, float]:
    """Last values of all columns."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        return {
            name: float(values[-1])
            for name, values in scenes.loads(text, folder).run().outputs.items()
        }


def test_sections_of_a_cantilever(folder: Path) -> None:
    """A tip load F: M = F (L - s), turning to the side of the force; in space about the axis e x F,
    however the beam lies.
    """
    found = solved(
        BEAM.format(dim=2, rotation="30 deg", force="[-0.5e-6, 0.8660254037844387e-6]"), folder
    )
    assert [found["root_M"], found["middle_M"]] == pytest.approx([1e-6, 0.75e-6], rel=1e-6)
    assert abs(found["root_N"]) < 1e-9
    found = solved(BEAM.format(dim=2, rotation="0 deg", force="[1 N, 0]"), folder)
    assert found["root_N"] == pytest.approx(1.0, rel=1e-4)
    space = BEAM.format(dim=3, rotation="{axis: [0, 0, 1], angle: 90 deg}", force="[0, 0, 1e-6 N]")
    found = solved(space, folder)
    assert [found[f"root_{word}"] for word in ("M", "Mx", "My", "Mz")] == pytest.approx(
        [1e-6, 1e-6, 0, 0], rel=1e-6, abs=1e-13
    )


FAR = """\
schema: 1
dimension: {dim}
bodies:
  beam: {{type: cable, mesh: line.msh, degree: 5, refine: 2, curvature: {curvature},
         section: {{shape: given, EA: 1e4, EI: 1, rhoA: 0.3}}}}
joints: {{clamp: {{type: clamp, at: beam.left}}}}
loads:
  weight: {{type: gravity, acceleration: [0, -10 m/s^2{zero}]}}
  pull: {{type: point_force, at: beam.right, force: [0.5 N, 1 N{zero}]}}
  turn: {{type: moment, at: beam.right, moment: {moment}}}
analysis: {{type: static, load_steps: 20}}
outputs:
  at: {{type: slope, at: {{body: beam, s: 0.3 m}}}}
  inside: {{type: section_forces, at: {{body: beam, s: 0.3 m}}}}
  end: {{type: slope, at: beam.right}}
  tip: {{type: section_forces, at: beam.right}}
  root: {{type: section_forces, at: beam.left}}
  clamp: {{type: reaction, joint: clamp}}
"""


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("curvature", ["exact", "material", "quadratic"])
def test_section_forces_balance_the_loads_of_a_beam_bent_far(
    curvature: str, dim: int, folder: Path
) -> None:
    """N = F.t of the loads beyond the section, and M at the tip is the moment there, whatever the
    law counts as curvature.

    EI (kappa - kappa0) kappa, 0.5 N at the tip, is what EA times the strain differs by from the
    force along the line. The quadratic law has a third part of N, - EI (d/dS)^2 |r'|, next to the
    ends: within some sqrt(EI/EA), 1 cm, nothing fixes the stretch there.
    """
    zero, moment = ("", "0.7 N m") if dim == 2 else (", 0", "[0, 0, 0.7 N m]")
    found = solved(FAR.format(dim=dim, zero=zero, moment=moment, curvature=curvature), folder)
    for place, slope, beyond in (("inside", "at", 0.7), ("tip", "end", 0.0))[
        : 1 if curvature == "quadratic" else 2
    ]:
        tangent = np.array([found[f"{slope}_x"], found[f"{slope}_y"]])
        force = np.array([0.5, 1.0 - 3.0 * beyond])
        assert found[f"{place}_N"] == pytest.approx(
            force @ tangent / np.linalg.norm(tangent), abs=5e-3
        )
    assert found["tip_M"] == pytest.approx(0.7, rel=2e-4)
    if curvature != "quadratic":
        assert found["root_N"] == pytest.approx(-found["clamp_x"], abs=5e-3)


HOW = {
    "ancf": "interpolation: ancf",
    "C1": "degree: 3",
    "C2": "continuity: 2",
    "quartic": "degree: 4, continuity: 3",
}


@pytest.mark.parametrize("how", HOW.values(), ids=HOW)
def test_the_axial_force_of_a_slender_arc_is_that_of_equilibrium(how: str, folder: Path) -> None:
    """A quarter of a circle, clamped, and pushed by P along the tangent of its root: N = -P cos(a)
    at the angle a from there.

    Ten cells of R sqrt(EA/EI) = 1000 lock, so that EA times the strain at a place is up to a
    hundred times as large.
    """
    angles = np.linspace(0.0, 0.5 * np.pi, 11)
    meshes.write(
        polyline(np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])),
        folder / "arc.msh",
    )
    places = ", ".join(
        f"a{a}: {{type: section_forces, at: {{body: arc, s: 0.{a}}}}}" for a in (2, 5, 8)
    )
    text = f"""
schema: 1
dimension: 2
bodies: {{arc: {{type: cable, mesh: arc.msh, {how}, section: {{shape: given, EA: 1e6, EI: 1, rhoA: 1}}}}}}
joints: {{root: {{type: clamp, at: arc.left}}}}
loads: {{push: {{type: point_force, at: arc.right, force: [0, -1e-4]}}}}
analysis: {{type: static, load_steps: 1, tolerance: 1e-13}}
outputs: {{{places}, root: {{type: section_forces, at: arc.left}}}}
"""
    found = solved(text, folder)
    wanted = -1e-4 * np.cos([0.0, 0.2, 0.5, 0.8])
    assert [found[f"{name}_N"] for name in ("root", "a2", "a5", "a8")] == pytest.approx(
        wanted, rel=5e-3
    )


@pytest.mark.parametrize("how", HOW.values(), ids=HOW)
@pytest.mark.parametrize("dim", [2, 3])
def test_the_axial_force_of_a_slender_beam_bent_far_is_exact_on_any_mesh(
    dim: int, how: str, folder: Path
) -> None:
    """N = F.t at slopes t of four cells under their weight of 3 N a metre and a load at the tip; EA
    times the strain is 1e4 N.
    """
    zero = "" if dim == 2 else ", 0"
    places = ", ".join(
        f"n{s}: {{type: section_forces, at: {{body: beam, s: 0.{s}}}}}, t{s}: {{type: slope, at: {{body: beam, s: 0.{s}}}}}"
        for s in (1, 3, 4)
    )
    text = f"""
schema: 1
dimension: {dim}
bodies: {{beam: {{type: cable, mesh: line.msh, {how}, section: {{shape: given, EA: 1e6, EI: 1, rhoA: 0.3}}}}}}
joints: {{clamp: {{type: clamp, at: beam.left}}}}
loads:
  weight: {{type: gravity, acceleration: [0, -10 m/s^2{zero}]}}
  pull: {{type: point_force, at: beam.right, force: [-2 N, 8 N{zero}]}}
analysis: {{type: static, load_steps: 20}}
outputs: {{{places}}}
"""
    found = solved(text, folder)
    for s in (1, 3, 4):
        tangent = np.array([found[f"t{s}_x"], found[f"t{s}_y"]])
        force = np.array([-2.0, 8.0 - 3.0 * (1.0 - 0.1 * s)])
        assert found[f"n{s}_N"] == pytest.approx(
            force @ tangent / np.linalg.norm(tangent), abs=1e-4
        )


def test_membrane_of_a_turned_strip(folder: Path) -> None:
    """Uniaxial stress s along 30 degrees: S11 = s cos^2, S22 = s sin^2, S12 = s sin cos, principal
    values s and 0; E = S / E.
    """
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    text = PLATE.format(
        dim=2,
        kind="ancf",
        rotation="30 deg",
        nu=0,
        slope="",
        force=f"[{10 * c}, {10 * s}]",
        at="middle",
    )
    found = solved(text, folder)
    tensor = np.array([c * c, s * s, c * s, 1.0, 0.0])
    words = ("11", "22", "12", "1", "2")
    assert [found[f"stress_{word}"] for word in words] == pytest.approx(
        1e3 * tensor, rel=1e-5, abs=1e-6
    )
    assert [found[f"strain_{word}"] for word in words] == pytest.approx(
        1e-6 * tensor, rel=1e-5, abs=1e-15
    )
    assert [found[f"forces_N{word}"] for word in words] == pytest.approx(
        10 * tensor, rel=1e-5, abs=1e-8
    )
    assert found["stress_angle"] == pytest.approx(np.pi / 6, rel=1e-6)
    assert found["mises_top"] == pytest.approx(1e3, rel=1e-5)
    assert not any(name.startswith("forces_M") for name in found)


@pytest.mark.parametrize(
    "turn", ["{axis: [0, 0, 1], angle: 0 deg}", "{axis: [0, 0, 1], angle: 90 deg}"]
)
def test_bending_of_a_strip(folder: Path, turn: str) -> None:
    """A line load q down at the tip, no Poisson's ratio: M = q L at the root stretches the top, S =
    +-6 M / t^2, E = S / E.
    """
    text = PLATE.format(
        dim=3,
        kind="bfs",
        rotation=turn,
        nu=0,
        slope=", slope: xyz",
        force="[0, 0, -1e-3 N/m]",
        at="root",
    )
    found, along = solved(text, folder), "22" if "90" in turn else "11"
    assert found[f"forces_M{along}"] == pytest.approx(1e-3, rel=1e-6)
    assert [found["forces_M1"], found["forces_M2"]] == pytest.approx(
        [1e-3, 0.0], rel=1e-6, abs=1e-12
    )
    assert [found[f"stress_{along}"], found[f"below_{along}"]] == pytest.approx(
        [60.0, -60.0], rel=1e-5
    )
    assert [found[f"strain_{along}"], found[f"middle_{along}"]] == pytest.approx(
        [6e-8, 0.0], rel=1e-5, abs=1e-12
    )
    assert found["mises_bottom"] == pytest.approx(60.0, rel=1e-5)


def test_units_and_labels(folder: Path) -> None:
    text = PLATE.format(
        dim=3,
        kind="bfs",
        rotation="{axis: [0, 0, 1], angle: 0 deg}",
        nu=0.3,
        slope="",
        force="[0, 0, 1]",
        at="root",
    )
    outputs = scenes.build.system(scenes.loads(text, folder)).outputs
    units, labels = column_units(outputs), column_labels(outputs)
    assert (units["stress_11"], units["stress_angle"], units["strain_2"]) == ("Pa", "rad", "")
    assert (units["forces_N12"], units["forces_M12"], units["forces_M1"]) == ("N/m", "N", "N")
    assert labels["stress_11"] == "11, axis 1 (1, 0, 0), axis 2 (0, 1, 0) of the reference"


def test_places_without_a_section_are_refused(folder: Path) -> None:
    text = BEAM.format(dim=2, rotation="0 deg", force="[0, 0]")
    text = text.replace(
        "joints:", "  hub: {type: rigid, mass: 1, inertia: 1, center: [0, 0]}\njoints:"
    ).replace("beam.left}, m", "hub}, m")
    with pytest.raises(
        InputError,
        match="a place of a cable with a law of this package, or a named point of a plate",
    ):
        scenes.build.system(scenes.loads(text, folder))


@pytest.mark.filterwarnings("error::fmbs_skfem.core.notices.Notice")
def test_forces_that_jump_at_their_place_are_told(folder: Path) -> None:
    """F at the end of a rod and F in its middle: N = F and 2 F beside the middle, and the mean of
    both there.
    """
    rod = "{type: cable, mesh: line.msh, refine: 4, section: {shape: given, EA: 1e6, EI: 10, rhoA: 1}}"
    pull = "{type: point_force, at: rod.right, force: [100, 0]}"
    middle = "{type: point_force, at: {body: rod, s: 0.5}, force: [100, 0]}"
    places = ", ".join(
        f"n{s}: {{type: section_forces, at: {{body: rod, s: 0.{s}}}}}" for s in (2, 5, 8)
    )
    text = f"""
schema: 1
dimension: 2
bodies: {{rod: {rod}}}
joints: {{wall: {{type: clamp, at: rod.left}}}}
loads: {{end: {pull}, middle: {middle}}}
outputs: {{{places}, root: {{type: section_forces, at: rod.left}}}}
analysis: {{type: static, load_steps: 1}}
"""
    scene = scenes.loads(text, folder=folder)
    with pytest.warns(
        Notice,
        match=r"output 'n5': load 'middle' act at this place, where internal forces may jump",
    ) as told:
        found = scene.run().outputs
    assert len(told) == 1
    assert [found[f"{name}_N"][-1] for name in ("root", "n2", "n5", "n8")] == pytest.approx(
        [200.0, 200.0, 150.0, 100.0], rel=1e-3
    )


@pytest.mark.parametrize(("slopes", "told"), [("true", True), ("false", False)])
def test_membrane_forces_on_a_clamped_rim(slopes: str, told: bool, folder: Path) -> None:
    """A rim that holds slopes holds the stretch across its edge: N reads zero there, which a
    warning says, not beside it.
    """
    text = PLATE.format(
        dim=3,
        kind="ancf",
        rotation="{axis: [0, 0, 1], angle: 0}",
        nu=0.0,
        slope=", slope: z",
        force="[1, 0, 0]",
        at="root",
    )
    text = text.replace(
        "thickness: 10 mm", f"thickness: 10 mm, rims: {{hub: {{edges: left, slopes: {slopes}}}}}"
    )
    text = text.replace(
        "left: {type: edge, body: strip, edges: left, slope: z}",
        "left: {type: weld, at: strip.hub}",
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scenes.build.system(scenes.loads(text, folder))
        scenes.build.system(scenes.loads(text.replace("strip.root", "strip.middle"), folder))
    found = [
        str(one.message)
        for one in caught
        if "membrane strains and forces read zero" in str(one.message)
    ]
    assert [one.split(":")[0] for one in found] == [f"output '{name}'" for name in NAMES if told]


NAMES = ("stress", "below", "strain", "middle", "forces", "mises")  #: of the outputs of PLATE
