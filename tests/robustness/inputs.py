"""Small right inputs that tests damage, and what every refusal has in common."""

from __future__ import annotations

import copy
import json
import re
from pathlib import Path
from typing import Any

from tests.cli.calls import ROOT, Call, fmbs

MESHES = ROOT / "meshes"

BEAM = """\
schema: 1
dimension: 2
parameters: {load: 0.5 N}
bodies:
  beam:
    type: cable
    mesh: beam_5.msh
    line: beam
    section: {shape: circular, diameter: 10 mm}
    material:
      young_modulus: 1 GPa
      density: 1800 kg/m^3
joints:
  clamp: {type: clamp, at: beam.left}
loads:
  tip: {type: point_force, at: beam.right, force: [0, load], history: "1"}
analysis: {type: dynamic, duration: 10 ms, step: 1 ms}
outputs:
  tip: {type: position, at: beam.right}
"""

PLATE = """\
schema: 1
dimension: 2
bodies:
  plate:
    type: plate
    mesh: a.msh
    thickness: 10 mm
    material: {young_modulus: 70 GPa, density: 2700 kg/m^3, poisson_ratio: 0.3}
joints:
  left: {type: edge, body: plate, edges: left}
analysis: {type: dynamic, duration: 1 ms, step: 0.1 ms}
"""

SHELL = """\
schema: 1
bodies:
  roof:
    type: shell
    nurbs: roof.json
    thickness: 10 mm
    material: {young_modulus: 70 GPa, density: 2700 kg/m^3}
joints:
  held: {type: edge, body: roof, edges: xi1_min}
analysis: {type: modes, count: 1}
"""

#: a strip of 2 m x 1 m, two spans along and one across
STRIP: dict[str, Any] = {
    "format": "fmbs-nurbs",
    "version": 1,
    "patches": [
        {
            "degree": [2, 1],
            "knots": [[0, 0, 0, 0.5, 1, 1, 1], [0, 0, 1, 1]],
            "control": [[[x, y, 0] for y in (0, 1)] for x in (0, 0.5, 1.5, 2)],
        }
    ],
}

HOUSE = re.compile(r".+: expected .+, got .+", re.DOTALL)


def msh(points: list[tuple[float, ...]], cells: list[str], names: str = "") -> str:
    """A gmsh 2.2 text file; cells are rows without their number: code tags ... nodes."""
    nodes = "\n".join(
        f"{i} {' '.join(str(x) for x in (*p, 0)[:3])}" for i, p in enumerate(points, 1)
    )
    rows = "\n".join(f"{i} {cell}" for i, cell in enumerate(cells, 1))
    counts = f"$Nodes\n{len(points)}\n{nodes}\n$EndNodes\n$Elements\n{len(cells)}\n{rows}\n$EndElements\n"
    return f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{names}{counts}"


def quads(*cells: tuple[int, ...]) -> list[str]:
    return [f"3 2 7 7 {' '.join(map(str, cell))}" for cell in cells]


def lines(*cells: tuple[int, ...], tag: int = 7) -> list[str]:
    return [f"1 2 {tag} {tag} {' '.join(map(str, cell))}" for cell in cells]


def changed(text: str, before: str, after: str) -> str:
    """The text with its one `before` replaced."""
    assert text.count(before) == 1, before
    return text.replace(before, after)


def strip(path: str, value: Any) -> dict[str, Any]:
    """The strip with one entry of its patch replaced."""
    data = copy.deepcopy(STRIP)
    place: Any = data["patches"][0]
    *keys, last = [int(key) if key.isdigit() else key for key in path.split("/")]
    for key in keys:
        place = place[key]
    place[last] = value
    return data


def beam(folder: Path, text: str = BEAM, mesh: str | bytes | None = None) -> Path:
    """The beam's scene with its mesh beside it, a delivered one by default."""
    content = (MESHES / "beam_5.msh").read_bytes() if mesh is None else mesh
    return written(folder, text, "beam_5.msh", content)


def plate(folder: Path, mesh: str | bytes, text: str = PLATE) -> Path:
    """The plate's scene with its mesh beside it."""
    return written(folder, text, "a.msh", mesh)


def shell(folder: Path, data: Any, text: str = SHELL) -> Path:
    """The shell's scene with its NURBS file beside it."""
    return written(folder, text, "roof.json", json.dumps(data))


def written(folder: Path, text: str, name: str, content: str | bytes) -> Path:
    (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    path = folder / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def state(folder: Path) -> dict[str, bytes]:
    """Every file below a folder with its bytes."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def refused(
    path: Path,
    *words: str,
    code: int = 3,
    command: tuple[str, ...] = ("check",),
    options: tuple[str, ...] = (),
) -> Call:
    """The call ends with the code and a message in the house form that holds the words; no file is
    changed, none run.

    Files are made by failed solves only (code 4), in the folder of the run.
    """
    before = state(path.parent)
    done = fmbs(*command, path, *options)
    assert done.code == code, done.err or done.out
    after = state(path.parent)
    assert {name: after.get(name) for name in before} == before
    assert all(code == 4 and name.startswith("fmbs-") for name in after.keys() - before.keys()), (
        after.keys()
    )
    message = done.err[done.err.index("error: ") :]
    assert HOUSE.match(message) or code == 4, message
    for word in words:
        assert word in message, f"{word!r} not in {message}"
    assert "Traceback" not in done.err + done.out
    return done


def noticed(path: Path, *words: str, command: tuple[str, ...] = ("check",)) -> Call:
    """The call succeeds with a notice that holds the words, and with --strict the notice is an
    error of code 3.
    """
    done = fmbs(*command, path)
    assert done.code == 0, done.err
    strict = fmbs(*command, path, "--strict")
    assert strict.code == 3, strict.err
    assert "(an error by --strict)" in strict.err
    for word in words:
        assert word in done.err, f"{word!r} not in {done.err}"
        assert word in strict.err, f"{word!r} not in {strict.err}"
    return done
