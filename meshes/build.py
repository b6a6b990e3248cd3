"""Build the mesh files of this folder: scikit-fem makes the meshes, meshio exports them.

Usage: python meshes/build.py [folder]. Lengths in metres; every line starts at the origin.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from skfem import MeshLine

from fmbs_skfem.shapes import meshes


def quarter_circle(s: np.ndarray) -> np.ndarray:
    """Radius 1 m, from the origin along +x, turning towards +y; ends at (1, 1, 0) along +y."""
    return np.column_stack([np.sin(s), 1 - np.cos(s), 0 * s])


def corner(s: np.ndarray) -> np.ndarray:
    """1 m along +x, then 1 m along +y."""
    return np.column_stack([np.minimum(s, 1), np.maximum(s - 1, 0), 0 * s])


def circle(s: np.ndarray) -> np.ndarray:
    """Radius 0.2 m, from the origin along +x, turning towards +y, and back to the origin."""
    return np.column_stack([0.2 * np.sin(s / 0.2), 0.2 * (1 - np.cos(s / 0.2)), 0 * s])


def deep_arc(s: np.ndarray) -> np.ndarray:
    """Radius 1 m, 215 degrees from the origin over the crown to the other foot, (1.907, 0, 0)."""
    half = np.deg2rad(107.5)
    return np.column_stack(
        [np.sin(s - half) + np.sin(half), np.cos(s - half) - np.cos(half), 0 * s]
    )


def line(
    cells: int,
    length: float,
    points: dict[str, int],
    parts: dict[str, tuple[int, int]],
    curve: meshes.Curve,
) -> meshes.LineMesh:
    """A line of equal cells, laid along a curve; `points` name nodes, `parts` name ranges of cells, both counted from the start."""
    grid: Any = MeshLine(np.linspace(0.0, length, cells + 1))
    grid = grid.with_boundaries({name: np.array([node]) for name, node in points.items()})
    grid = grid.with_subdomains({name: np.arange(*part) for name, part in parts.items()})
    return meshes.from_skfem(grid, curve)


def beam(
    cells: int, length: float, name: str = "beam", curve: meshes.Curve = meshes.straight
) -> meshes.LineMesh:
    """One body with its two ends `left` and `right`."""
    return line(cells, length, {"left": 0, "right": cells}, {name: (0, cells)}, curve)


def everything() -> dict[str, meshes.LineMesh]:
    """File name -> mesh."""
    out = {f"beam_{cells}.msh": beam(cells, 1.0) for cells in (5, 10, 20, 50, 100)}
    out["beam_100.vtu"] = out["beam_100.msh"]
    out |= {
        "crank.msh": beam(10, 0.2, "crank"),
        "coupler.msh": beam(25, 0.5, "coupler"),
        "rocker.msh": beam(20, 0.4, "rocker"),
    }
    pendulum = line(
        200, 2.0, {"A": 0, "B": 100, "C": 200}, {"I": (0, 100), "II": (100, 200)}, corner
    )
    out["double_pendulum_100.msh"] = pendulum
    arc = beam(40, np.pi / 2, "arc", quarter_circle)
    out |= {"arc_40.msh": arc, "arc_40.vtu": arc}
    out["hoop_60.msh"] = beam(60, 0.4 * np.pi, "hoop", circle)
    out["deep_arc_60.msh"] = line(
        60, np.deg2rad(215.0), {"left": 0, "middle": 30, "right": 60}, {"arc": (0, 60)}, deep_arc
    )
    out["cable_40.msh"] = line(
        40, 2.0, {"left": 0, "middle": 20, "right": 40}, {"cable": (0, 40)}, meshes.straight
    )
    return out


def main(folder: Path = Path(__file__).parent) -> list[Path]:
    """Write every mesh; the paths written."""
    paths = []
    for name, mesh in everything().items():
        paths.append(folder / name)
        meshes.write(mesh, paths[-1])
    return paths


if __name__ == "__main__":
    for written in main(*(Path(folder) for folder in sys.argv[1:2])):
        print(written)
