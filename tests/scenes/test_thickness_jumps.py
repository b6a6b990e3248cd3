"""Plates whose thickness jumps: slow convergence inside smooth surfaces, which a warning tells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from skfem import MeshQuad, MeshTri

from fmbs_skfem import studies
from fmbs_skfem.core.notices import Notice, Remark
from fmbs_skfem.shapes import plate_meshes

THICK, THIN = 10e-3, 5e-3
FORCE, WIDTH, YOUNG = 100.0, 0.1, 1e9
#: of two bars of 0.5 m one after the other
STRETCH = FORCE / (YOUNG * WIDTH) * (0.5 / THICK + 0.5 / THIN)
SCENE = """
schema: 1
dimension: 2
bodies:
  bar:
    type: plate
    mesh: bar.msh
    interpolation: {interpolation}
    thickness: {{left_half: {thick} m, right_half: 5 mm}}
    material: {{young_modulus: 1 GPa, density: 1000, poisson_ratio: 0}}
joints: {{wall: {{type: edge, body: bar, edges: left}}}}
loads: {{pull: {{type: edge_load, body: bar, edges: right, force: [1 kN/m, 0]}}}}
outputs: {{end: {{type: position, at: bar.corner, component: x}}}}
analysis: {{type: static, load_steps: 1}}
"""


def stretch(
    folder: Path, kind: type, interpolation: str, cells: int, thick: float = THICK
) -> float:
    """Displacement of the pulled end [m]."""
    mesh = kind.init_tensor(np.linspace(0.0, 1.0, cells + 1), np.linspace(0.0, WIDTH, 3))  # type: ignore[attr-defined]
    sides = {"left": lambda x: x[0] == 0.0, "right": lambda x: x[0] == 1.0}
    halves = {"left_half": lambda x: x[0] < 0.5, "right_half": lambda x: x[0] > 0.5}
    found = plate_meshes.from_skfem(mesh.with_boundaries(sides).with_subdomains(halves))
    corner = int(np.argmin(np.linalg.norm(found.points[:, :2] - [1.0, 0.0], axis=1)))
    found.point_groups["corner"] = np.array([corner])
    plate_meshes.write(found, folder / "bar.msh")
    (folder / "bar.yaml").write_text(SCENE.format(interpolation=interpolation, thick=thick))
    return float(studies.run(folder / "bar.yaml").outputs["end"][-1]) - 1.0


@pytest.mark.parametrize(
    "kind, interpolation", [(MeshQuad, "ancf"), (MeshQuad, "bfs"), (MeshTri, "argyris")]
)
def test_errors_fall_with_the_cells(tmp_path: Path, kind: type, interpolation: str) -> None:
    """A remark says so, as what is bent alone has no such error."""
    with pytest.warns(
        Remark,
        match=r"thickness: jumps from 0\.01 m to 0\.005 m inside a surface whose strains are continuous",
    ):
        errors = [
            abs(stretch(tmp_path, kind, interpolation, cells) / STRETCH - 1.0) for cells in (4, 16)
        ]
    assert errors[1] < 4e-3
    assert 0.6 < np.log2(errors[0] / errors[1]) / 2.0 < 1.4


@pytest.mark.filterwarnings("error::fmbs_skfem.core.notices.Notice")
def test_one_thickness_in_two_faces_is_exact(tmp_path: Path) -> None:
    assert stretch(tmp_path, MeshQuad, "ancf", 4, THIN) == pytest.approx(
        FORCE / (YOUNG * WIDTH * THIN), rel=1e-3
    )


def test_outputs_on_the_line_of_a_jump_are_warned_of(tmp_path: Path) -> None:
    """A bent strip of two thicknesses: the moment, which is the same on both sides, is shown with
    one of them on the line alone.
    """
    mesh = MeshQuad.init_tensor(np.linspace(0.0, 1.0, 9), np.linspace(0.0, WIDTH, 3))
    found = plate_meshes.from_skfem(
        mesh.with_boundaries(
            {"left": lambda x: x[0] == 0.0, "right": lambda x: x[0] == 1.0}
        ).with_subdomains({"left_half": lambda x: x[0] < 0.5, "right_half": lambda x: x[0] > 0.5})
    )
    for name, x in (("on", 0.5), ("beside", 0.75)):
        found.point_groups[name] = np.array(
            [int(np.argmin(np.linalg.norm(found.points[:, :2] - [x, 0.0], axis=1)))]
        )
    plate_meshes.write(found, tmp_path / "bar.msh")
    text = (
        SCENE.format(interpolation="ancf", thick=THICK)
        .replace("dimension: 2", "dimension: 3")
        .replace("[1 kN/m, 0]", "[0, 0, 1]")
    )
    for name in ("on", "beside"):
        read = f"{{at: {{type: section_forces, at: bar.{name}}}}}"
        (tmp_path / "bar.yaml").write_text(
            text.replace("{end: {type: position, at: bar.corner, component: x}}", read)
        )
        with pytest.warns(Notice) as caught:
            studies.run(tmp_path / "bar.yaml", plots=False)
        told = [
            str(one.message)
            for one in caught
            if "jumps at this point, from 0.01 m to 0.005 m" in str(one.message)
        ]
        assert bool(told) == (name == "on")
