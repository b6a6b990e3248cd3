"""Bodies of matrices in scenes: files of other programs give the same body, and what is wrong with
one is said.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.io import mmwrite
from scipy.sparse import coo_array, csr_array, save_npz, tril

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import vibration_modes
from fmbs_skfem.scenes import build
from fmbs_skfem.scenes.matrices import Bundle, write_bundle
from fmbs_skfem.systems import assemble
from tests.cli.calls import fmbs
from verification import solids

SCENE = """\
schema: 1
dimension: 3
bodies:
  rod:
    type: matrices
    {files}
    interfaces: {{left: {{{left}}}, right: {{{right}, couple: average}}}}
    points: {{corner: {corner}}}
    modes: 3
    expected: {{mass: 6.75 kg, center: [0.5 m, 0, 0]}}
joints:
  hinge: {{type: revolute, at: rod.left, to: ground, axis: [0, 1, 0]}}
loads:
  weight: {{type: gravity, acceleration: [0, 0, -9.81]}}
analysis: {{type: dynamic, duration: 0.02 s, step: 2 ms}}
outputs:
  tip: {{type: position, at: rod.right}}
  corner: {{type: position, at: rod.corner}}
"""
NUMBERS = 10  #: times the number of a node, plus 7, in files


@cache
def matrices() -> tuple[np.ndarray, csr_array, csr_array]:
    return solids.bar((4, 1, 1))


def numbers() -> np.ndarray:
    return NUMBERS * np.arange(len(matrices()[0])) + 7


def scene(files: str, *, numbered: bool = True, sets: bool = False) -> str:
    """A scene of these files, its nodes by their numbers there."""
    nodes = matrices()[0]
    ids = numbers() if numbered else np.arange(len(nodes)) + 1
    ends = [f"nodes: {ids[list(solids.at(nodes, x))].tolist()}" for x in (0.0, 1.0)]
    ends = ["set: LEFT", "set: RIGHT"] if sets else ends
    return SCENE.format(files=files, left=ends[0], right=ends[1], corner=ids[0])


def read(folder: Path, text: str) -> Body:
    (folder / "scene.yaml").write_text(text, encoding="utf-8")
    return build.parts(scenes.read(folder / "scene.yaml"))[0]


def frequencies(body: Body) -> np.ndarray:
    return vibration_modes(assemble([body], pictures=False), 9).angular_frequencies[6:]


@cache
def wanted() -> tuple[float, ...]:
    """Of the body from Matrix Market."""
    import tempfile

    with tempfile.TemporaryDirectory() as made:
        return tuple(frequencies(read(Path(made), market(Path(made)))).tolist())


def table(folder: Path, ids: np.ndarray, unit: float = 1.0) -> None:
    rows = [
        f"{k}, {x / unit:.17g}, {y / unit:.17g}, {z / unit:.17g}"
        for k, (x, y, z) in zip(ids, matrices()[0], strict=True)
    ]
    (folder / "nodes.csv").write_text("number, x, y, z\n" + "\n".join(rows), encoding="utf-8")


def market(folder: Path) -> str:
    _, K, M = matrices()
    table(folder, numbers())
    for name, A in (("K", K), ("M", M)):
        mmwrite(folder / f"{name}.mtx", coo_array(A), symmetry="symmetric", precision=17)
    return scene("stiffness: K.mtx\n    mass: M.mtx\n    nodes: nodes.csv")


def in_millimetres(folder: Path) -> str:
    """N, mm, t and s, component by component."""
    _, K, M = matrices()
    n = len(numbers())
    order = np.arange(3 * n).reshape(n, 3).T.ravel()
    table(folder, numbers(), 1e-3)
    for name, A in (("K", K), ("M", M)):
        save_npz(folder / f"{name}.npz", csr_array(1e-3 * A[order][:, order]))
    files = "stiffness: K.npz\n    mass: M.npz\n    nodes: nodes.csv\n    unit: mm\n    order: components"
    return scene(files)


def entries(A: csr_array) -> list[tuple[int, int, int, int, float]]:
    """Of the lower half: node and unknown of rows and columns, and the value."""
    low = coo_array(tril(A))
    i, j = low.coords
    ids = numbers()
    return [
        (int(ids[r // 3]), r % 3 + 1, int(ids[c // 3]), c % 3 + 1, v)
        for r, c, v in zip(i.tolist(), j.tolist(), low.data.tolist(), strict=True)
    ]


def abaqus(folder: Path) -> str:
    """Text of *MATRIX OUTPUT, nodes and sets of an input file, and one node that nothing uses."""
    nodes, K, M = matrices()
    for name, A in (("K", K), ("M", M)):
        lines = [f"{a},{b},{c},{d},{v:.17e}" for a, b, c, d, v in entries(A)]
        head = "** Assembled nodal matrix\n*MATRIX INPUT, NAME=A, TYPE=SYMMETRIC\n"
        (folder / f"{name}.mtx").write_text(head + "\n".join(lines), encoding="utf-8")
    text = [
        "*NODE",
        *(f"{k}, {x}, {y}, {z}" for k, (x, y, z) in zip(numbers(), nodes.tolist(), strict=True)),
    ]
    text += ["99999, 5.0, 5.0, 5.0"]
    for name, x in (("LEFT", 0.0), ("RIGHT", 1.0)):
        text += [
            f"*NSET, NSET={name}",
            ",\n".join(str(k) for k in numbers()[list(solids.at(nodes, x))]),
        ]
    text += ["*ELEMENT, TYPE=T3D2, ELSET=E", f"1, {numbers()[0]}, {numbers()[1]}"]
    (folder / "rod.inp").write_text("\n".join(text) + "\n", encoding="utf-8")
    return scene("stiffness: K.mtx\n    mass: M.mtx\n    nodes: rod.inp", sets=True)


def nastran(folder: Path) -> str:
    """DMIG cards of wide fields, both matrices in one punch file."""
    _, K, M = matrices()
    lines = []
    for name, A in (("KAAX", K), ("MAAX", M)):
        lines.append(f"DMIG    {name:<8}{0:>8}{6:>8}{2:>8}{0:>8}")
        column = None
        for a, b, c, d, v in entries(A):
            if column != (c, d):
                lines.append(f"DMIG*   {name:<16}{c:>16}{d:>16}")
                column = (c, d)
            lines.append(f"*       {a:>16}{b:>16}{v:>16.9E}".replace("E", "D"))
    (folder / "rod.pch").write_text("\n".join(lines), encoding="utf-8")
    table(folder, numbers())
    names = "matrix_names: {stiffness: KAAX, mass: MAAX}"
    return scene(f"stiffness: rod.pch\n    mass: rod.pch\n    nodes: nodes.csv\n    {names}")


def calculix(folder: Path) -> str:
    """Upper halves by numbers, and what the unknowns are."""
    _, K, M = matrices()
    for name, A in (("sti", K), ("mas", M)):
        low = coo_array(tril(A))
        i, j = low.coords
        lines = [f"{c + 1} {r + 1} {v:.17e}" for r, c, v in zip(i, j, low.data, strict=True)]
        (folder / f"rod.{name}").write_text("\n".join(lines), encoding="utf-8")
    labels = [f"{k}.{c}" for k in numbers() for c in (1, 2, 3)]
    (folder / "rod.dof").write_text("\n".join(labels), encoding="utf-8")
    table(folder, numbers())
    return scene("stiffness: rod.sti\n    mass: rod.mas\n    nodes: nodes.csv")


def bundle(folder: Path) -> str:
    nodes, K, M = matrices()
    sets = {
        "LEFT": numbers()[list(solids.at(nodes, 0.0))],
        "RIGHT": numbers()[list(solids.at(nodes, 1.0))],
    }
    write_bundle(folder / "rod.npz", Bundle(nodes, numbers(), sets, K, M, None, None))
    return scene("file: rod.npz", sets=True)


@pytest.mark.parametrize("make", [in_millimetres, abaqus, nastran, calculix, bundle])
def test_files_of_all_programs_give_the_same_body(
    make: Callable[[Path], str], tmp_path: Path
) -> None:
    """To nine digits, of the ten that fields of Nastran hold."""
    body = read(tmp_path, make(tmp_path))
    assert_allclose(frequencies(body), wanted(), rtol=1e-5)
    assert_allclose(body.total_mass, 6.75, rtol=1e-8)
    assert list(body.frames) == ["left", "right"]


def test_a_scene_of_matrices_runs(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(market(tmp_path), encoding="utf-8")
    checked = fmbs("check", tmp_path / "scene.yaml", "--json").json
    assert checked["status"] == "ok"
    found = fmbs("run", tmp_path / "scene.yaml", "--json", "--no-plots", "--out", tmp_path / "out")
    assert found.code == 0, found.err
    assert found.json["part_errors"]["tip_z"] < 1e-3
    assert found.json["outputs"]["tip_z"]["final"] == pytest.approx(-0.5 * 14.7 * 0.02**2, rel=0.05)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("mass: 6.75 kg", "mass: 6.9 kg", r"expected mass \[kg\] 6.9, got 6.75"),
        ("center: [0.5 m", "center: [0.4 m", r"expected center \[m\]"),
        ("stiffness: K.mtx", "stiffness: N.mtx", "expected a file, got no such file"),
        ("K.mtx", "nodes.csv", "expected a file of a matrix"),
        ("corner: 7", "corner: 8", "expected nodes 7 to .* of its file, got 8"),
        ("left: {nodes", "left: {set: LEFT, nodes", "a set or numbers of nodes, got both"),
        ("nodes: nodes.csv", "nodes: K.mtx", "as .msh 4.1"),
        ("dimension: 3", "dimension: 2", "expected a list of 2"),
        ("    mass: M.mtx\n", "", "expected a file, got none"),
    ],
)
def test_what_is_wrong_with_a_body_of_matrices_is_said(
    tmp_path: Path, old: str, new: str, told: str
) -> None:
    text = market(tmp_path)
    assert old in text
    with pytest.raises(InputError, match=told):
        read(tmp_path, text.replace(old, new))


@pytest.mark.parametrize("make", [market, abaqus, nastran, calculix])
def test_a_file_that_ends_in_the_middle_is_refused(
    make: Callable[[Path], str], tmp_path: Path
) -> None:
    text = make(tmp_path)
    name = next(one for one in ("K.mtx", "rod.sti", "rod.pch") if (tmp_path / one).exists())
    whole = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(whole[: len(whole) // 2 + 3])
    with pytest.raises(InputError):
        read(tmp_path, text)


def test_rotations_and_held_unknowns_of_a_file_are_refused(tmp_path: Path) -> None:
    text = abaqus(tmp_path)
    path = tmp_path / "K.mtx"
    whole = path.read_text(encoding="utf-8")
    path.write_text(whole + "\n7,4,7,4,1.0", encoding="utf-8")
    with pytest.raises(InputError, match="rotations at 1 nodes, the first of them 7"):
        read(tmp_path, text)
    lines = [one for one in whole.splitlines() if not (one.startswith("7,2,") or ",7,2," in one)]
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match="node 7 lacks y"):
        read(tmp_path, text)
