"""Held edges of meshes in any direction, from every file: deflection, frequency and reactions do
not depend on the digits.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fmbs_skfem import scenes
from fmbs_skfem.shapes.plate_meshes import PlateMesh

from ..bodies.test_edge_directions import mesh

# one scene serves statics and modes
pytestmark = pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
SUPPORTS = {
    "hinged": "{hold: {type: edge, body: plate, edges: rim, fixed: xyz}}",
    "clamped": "{hold: {type: edge, body: plate, edges: rim, fixed: xyz, slope: xyz}}",
    "cantilever": "{hold: {type: edge, body: plate, edges: left, fixed: xyz, slope: xyz}}",
    "quarter": (
        "{hold: {type: edge, body: plate, edges: corner, fixed: xyz}, "
        "plane: {type: edge, body: plate, edges: planes, fixed: '', slope: xyz}}"
    ),
    "rim": "{hold: {type: clamp, at: plate.grip}}",
}
SCENE = """
schema: 1
dimension: 3
bodies:
  plate: {type: TYPE, mesh: FILE, thickness: 10 mm, RIMSmaterial: {young_modulus: 210 GPa, density: 7850, poisson_ratio: 0.3}}
joints: JOINTS
loads: {p: {type: surface_load, body: plate, force: FORCE}}
analysis: {type: static, load_steps: 1}
outputs: {u: {type: position, at: plate.middle}, r: {type: reaction, joint: hold}}
"""
LOAD = 100.0  #: [Pa], under which the hinged plate deflects by 2e-3 of its thickness
MODES = "{type: modes, count: 1, about: reference}"
RIGIDITY = 210e9 * 0.01**3 / (12 * (1 - 0.3**2))
#: Timoshenko, Woinowsky-Krieger: w / (q a^4); a quarter has half of the side
EXACT = {
    "hinged": 0.00406235 / RIGIDITY,
    "clamped": 0.00126532 / RIGIDITY,
    "quarter": 16 * 0.00406235 / RIGIDITY,
}
#: sides of the square in one group, as most meshes have them, whose corners are those of no single
#: side
GROUPS = {
    "hinged": {"rim": ("left", "top", "right", "bottom")},
    "clamped": {"rim": ("left", "top", "right", "bottom")},
    "cantilever": {"left": ("left",)},
    "quarter": {"corner": ("left", "bottom"), "planes": ("top", "right")},
    "rim": {"left": ("left",)},
}


def square(cells: int, triangles: bool, support: str) -> PlateMesh:
    """A unit square with the groups of sides that a support needs."""
    given = mesh(cells, triangles)
    groups = {
        name: np.concatenate([given.edge_groups[side] for side in sides])
        for name, sides in GROUPS[support].items()
    }
    return replace(given, edge_groups=groups)


def written(path: Path, points: np.ndarray, given: PlateMesh, middle: int, digits: int) -> None:
    """A mesh with its nodes at points (n, 3) as `.msh` or `.inp` with some digits, or as `.vtk` in
    single precision.
    """
    triangles = given.cells.shape[1] == 3
    rows = [" ".join(f"{x:.{digits}g}" for x in point) for point in points]
    if path.suffix == ".inp":
        lines = ["*NODE", *(f"{k}, {row.replace(' ', ', ')}" for k, row in enumerate(rows, 1))]
        lines += [f"*ELEMENT, TYPE={'S3' if triangles else 'S4'}, ELSET=all"]
        lines += [f"{k}, {', '.join(map(str, cell + 1))}" for k, cell in enumerate(given.cells, 1)]
        for name, pairs in given.edge_groups.items():
            lines += [f"*NSET, NSET={name}", *(f"{node + 1}," for node in np.unique(pairs))]
        lines += ["*NSET, NSET=middle", f"{middle + 1},"]
        path.write_text("\n".join([*lines, ""]), encoding="utf-8")
        return
    names = {name: np.array([tag, 1]) for tag, name in enumerate(given.edge_groups, 1)} | {
        "middle": np.array([9, 0])
    }
    cells = [("line", pairs) for pairs in given.edge_groups.values()] + [
        ("vertex", np.array([[middle]]))
    ]
    cells = [("triangle" if triangles else "quad", given.cells), *cells]
    if path.suffix == ".vtk":
        flags = {
            name: [
                np.full(len(part), name == own, dtype=np.int32)
                for (_, part), own in zip(cells[:-1], ["", *names], strict=False)
            ]
            for name in given.edge_groups
        }
        marks = {"middle": (np.arange(len(points)) == middle).astype(np.int32)}
        meshio.Mesh(points.astype(np.float32), cells[:-1], marks, flags).write(path)
        return
    rounded = np.array([[float(word) for word in row.split()] for row in rows])
    numbers = [8, *range(1, len(cells) - 1), 9]
    tags = [np.full(len(part), tag) for (_, part), tag in zip(cells, numbers, strict=True)]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(
        path,
        meshio.Mesh(rounded, cells, cell_data=data, field_data=names | {"all": np.array([8, 2])}),
        "gmsh22",
    )


def solved(
    folder: Path,
    support: str,
    axis: str,
    triangles: bool,
    file: str,
    digits: int = 17,
    moved: float = 0.0,
    far: float = 0.0,
    cells: int = 4,
) -> tuple[float, float, np.ndarray]:
    """Deflection over the load [m/Pa], lowest frequency [Hz], and reactions without and with the
    load over it, (2, k).
    """
    turn = Rotation.from_euler(axis, 30.0, degrees=True).as_matrix()
    flat = axis == "z"
    noise = (
        moved
        * np.random.default_rng(3).uniform(-1.0, 1.0, ((cells + 1) ** 2, 3))
        * [1.0, 1.0, not flat]
    )
    normal = turn[:, 2]
    given = square(cells, triangles, support)
    # the middle of a quarter is where both planes meet
    middle = len(given.points) - 1 if support == "quarter" else len(given.points) // 2
    written(
        folder / file,
        (given.points + noise) @ turn.T + far * np.array([1.0, 1.0, 0.0]),
        given,
        middle,
        digits,
    )
    force = "[" + ", ".join(f"{-LOAD * float(x)!r}" for x in normal) + "]"
    rims = "rims: {grip: {edges: left, slopes: true, center: CENTER}}, " if support == "rim" else ""
    text = (
        SCENE.replace("TYPE", "plate" if flat else "shell")
        .replace("FILE", file)
        .replace("RIMS", rims)
    )
    centre = turn @ [0.0, 0.5, 0.0] + far * np.array([1.0, 1.0, 0.0])
    text = (
        text.replace("CENTER", str([float(x) for x in centre]))
        .replace("JOINTS", SUPPORTS[support])
        .replace("FORCE", force)
    )
    found = scenes.loads(text, folder).run().outputs
    lowered = sum(
        float(found[f"u_{c}"][0] - found[f"u_{c}"][-1]) * normal[k] for k, c in enumerate("xyz")
    )
    held = (
        [f"r_{c}" for c in (*"xyz", "mx", "my", "mz")]
        if support != "rim"
        else sorted(name for name in found if name[0] == "r")
    )
    forces = np.array([[float(found[name][k]) for name in held] for k in (0, -1)])
    if (
        support == "quarter"
    ):  # its planes hold the same in its own plane: how both share that hangs on membrane forces
        forces[:, 3:] -= np.outer(forces[:, 3:] @ normal, normal)
    return lowered / LOAD, frequency(text, folder), forces / LOAD


def frequency(text: str, folder: Path) -> float:
    modes = text.replace("{type: static, load_steps: 1}", MODES)
    return float(scenes.loads(modes, folder).run().frequencies[0])


#: what the numbers of a file may say, and by how much deflection and frequency change: nodes moved
#: by d over sides of a quarter turn these by 8 d, and bend a plate of 1/100 of its size by 100 d
DOORS = {
    "8 digits": ({"file": "plate.msh", "digits": 8}, 2e-6),
    "5 digits": ({"file": "plate.msh", "digits": 5}, 2e-3),
    "Abaqus": ({"file": "plate.inp", "digits": 7}, 2e-5),
    "single precision": ({"file": "plate.vtk"}, 2e-5),
    "moved by 1e-12": ({"file": "plate.msh", "moved": 1e-12}, 1e-6),
    "moved by 1e-7": ({"file": "plate.msh", "moved": 1e-7}, 2e-5),
    "at 10 km": ({"file": "plate.msh", "far": 1e4}, 1e-6),
}


def compare(folder: Path, support: str, axis: str, triangles: bool, doors: list[str]) -> None:
    """The plate with all digits beside others; the exact deflection to what four cells a side can
    (clamped: 17 % less).
    """
    w, f, forces = solved(folder, support, axis, triangles, "plate.msh")
    if support in EXACT:
        assert w == pytest.approx(EXACT[support], rel=0.2)
    for door in doors:
        options, change = DOORS[door]
        other = solved(folder, support, axis, triangles, **options)
        assert other[:2] == pytest.approx((w, f), rel=change), door
        assert np.abs(other[2][1] - forces[1]).max() < change, door
        assert np.abs(other[2][0]).max() < 1e-6, door  # of the load, without it


@pytest.mark.parametrize(
    ("support", "axis", "triangles", "door"),
    [
        ("hinged", "z", False, "8 digits"),
        ("hinged", "z", False, "single precision"),
        ("hinged", "z", True, "Abaqus"),
        ("hinged", "z", True, "5 digits"),
        ("hinged", "x", True, "moved by 1e-7"),
        ("hinged", "y", False, "8 digits"),
        ("clamped", "z", True, "8 digits"),
        ("clamped", "y", True, "at 10 km"),
        ("cantilever", "z", False, "at 10 km"),
        ("cantilever", "x", False, "moved by 1e-12"),
        ("quarter", "z", False, "8 digits"),
        ("quarter", "z", True, "Abaqus"),
        ("quarter", "x", False, "single precision"),
        ("quarter", "x", False, "moved by 1e-7"),
        ("rim", "z", True, "8 digits"),
        ("rim", "y", True, "single precision"),
    ],
)
def test_digits_do_not_clamp(
    support: str, axis: str, triangles: bool, door: str, tmp_path: Path
) -> None:
    compare(tmp_path, support, axis, triangles, [door])


@pytest.mark.parametrize("triangles", [False, True])
def test_all_supports_directions_and_files(triangles: bool, tmp_path: Path) -> None:
    for support in SUPPORTS:
        for axis in "xyz":
            compare(tmp_path, support, axis, triangles, list(DOORS))
