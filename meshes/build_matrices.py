"""Build the finite-element parts of this folder that bodies of `type: matrices` are made of: elasticity by scikit-fem alone.

Usage: python meshes/build_matrices.py [folder]. Lengths in metres, K in N/m, M in kg, nodes from 1 on.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from fmbs_skfem.scenes.matrices import Bundle, write_bundle  # noqa: E402
from verification import solids  # noqa: E402


def con_rod() -> Bundle:
    """A connecting rod of steel, 0.3 m x 20 mm x 10 mm, of 48 ten-node tetrahedra; its ends are the sets A and B."""
    length = 0.3
    nodes, K, M = solids.bar((8, 1, 1), (length, 0.01, 0.02), 210e9, 0.3, 7850.0)
    ends = {"A": 0.0, "B": length}
    sets = {name: np.array(solids.at(nodes, x)) + 1 for name, x in ends.items()}
    return Bundle(nodes, np.arange(len(nodes)) + 1, sets, K, M, None, None)


def main(folder: Path) -> None:
    write_bundle(folder / "con_rod.npz", con_rod())


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
