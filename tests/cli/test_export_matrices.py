"""`fmbs export --matrices`: a plate of a scene by its matrices is the plate."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.io import mmread

from .calls import fmbs

PLATE = """\
schema: 1
dimension: 3
bodies:
  link:
    type: plate
    mesh: ../meshes/plate_linkage_coarse.msh
    thickness: 5 mm
    material: {young_modulus: 70 GPa, density: 2700, poisson_ratio: 0.3}
    rims: {B: {edges: B, slopes: true}, C: {edges: C, slopes: true}}
"""
MATRICES = """\
schema: 1
dimension: 3
bodies:
  link: {type: matrices, file: out/link.npz, interfaces: {B: {set: B}, C: {set: C}}, modes: 8}
"""
MODES = """\
joints: {root: {type: weld, at: link.B, to: ground}}
analysis: {type: modes, count: 2}
"""
BENT = """\
joints: {root: {type: weld, at: link.B, to: ground}}
loads: {push: {type: point_force, at: link.C, force: [0, 0, 200 N]}}
analysis: {type: static, load_steps: 4}
outputs: {C: {type: position, at: link.C}}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "scenes"
    made.mkdir()
    (tmp_path / "meshes").symlink_to(Path(__file__).parents[2] / "meshes")
    return made


def test_a_plate_as_matrices_is_the_plate(folder: Path) -> None:
    """Frequencies to 1e-3 (eight modes), and a deflection of 5 % of its length to 2 %."""
    found = {}
    for name, body in (("plate", PLATE), ("matrices", MATRICES)):
        for kind, more in (("modes", MODES), ("bent", BENT)):
            (folder / f"{name}_{kind}.yaml").write_text(body + more, encoding="utf-8")
        if name == "plate":
            scene = folder / "plate_modes.yaml"
            options = ("--matrices", "link", "--out", folder / "out", "--allow-outside", "--json")
            done = fmbs("export", scene, *options)
            assert done.code == 0, done.err
            assert {"B", "C"} <= done.json["sets"].keys()
        for kind in ("modes", "bent"):
            run = fmbs(
                "run",
                folder / f"{name}_{kind}.yaml",
                *("--allow-outside", "--json", "--no-plots", "--out", folder / f"{name}_{kind}"),
            )
            assert run.code == 0, run.err
            found[name, kind] = run.json
    hertz = []
    for name in ("plate", "matrices"):
        with (folder / f"{name}_modes" / "modes.csv").open(encoding="utf-8") as file:
            hertz.append([float(row[1]) for row in list(csv.reader(file))[1:]])
    assert hertz[1] == pytest.approx(hertz[0], rel=1e-3)
    z = [found[name, "bent"]["outputs"]["C_z"]["final"] for name in ("plate", "matrices")]
    assert 0.03 < z[0] / 0.2 < 0.2
    assert z[1] == pytest.approx(z[0], rel=0.02)
    K, M = (mmread(folder / "out" / f"link_{one}.mtx") for one in "KM")
    rows = np.loadtxt(folder / "out" / "link_nodes.csv", delimiter=",", skiprows=1)
    assert K.shape == M.shape == (3 * len(rows), 3 * len(rows))
