"""Build the meshes of solids of this folder by gmsh: a connecting rod with fillets.

    big eye at the origin, small eye at (length, 0, 0), axes along z; shank with rounded corners

Usage: python meshes/build_solids.py [size [file]]. Lengths in metres; the size of cells is 12 mm by default,
2.8 mm makes some 1e5 unknowns. Needs the package gmsh.
"""

from __future__ import annotations

import sys
from pathlib import Path

import gmsh

LENGTH = 0.16  #: between the axes of both eyes [m]
EYES = {
    "big": (0.0, 0.034, 0.024),
    "small": (LENGTH, 0.02, 0.011),
}  #: x, outer and inner radius [m]
WIDTH, HEIGHT = 0.016, 0.022  #: of the rod along z, of the shank along y [m]
ROUND = 0.006  #: radius of the fillets between shank and eyes [m]


def build(size: float, path: Path) -> None:
    """The rod with cells of a size [m], of second order."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    cad = gmsh.model.occ
    eyes = [
        (3, cad.addCylinder(x, 0, -WIDTH / 2, 0, 0, WIDTH, outer)) for x, outer, _ in EYES.values()
    ]
    shank = (3, cad.addBox(0, -HEIGHT / 2, -WIDTH / 2, LENGTH, HEIGHT, WIDTH))
    body, _ = cad.fuse(eyes, [shank])
    cad.synchronize()
    corners = [tag for dim, tag in gmsh.model.getEntities(1) if is_corner(dim, tag)]
    body = cad.fillet([tag for _, tag in body], corners, [ROUND])
    holes = [
        (3, cad.addCylinder(x, 0, -WIDTH, 0, 0, 2 * WIDTH, inner)) for x, _, inner in EYES.values()
    ]
    cad.cut(body, holes)
    cad.synchronize()
    for dim, tag in gmsh.model.getEntities(2):
        if name := name_of(dim, tag):
            faces.setdefault(name, []).append(tag)
    for name, tags in faces.items():
        gmsh.model.addPhysicalGroup(2, tags, name=name)
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="rod")
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 8)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(str(path))
    gmsh.finalize()


faces: dict[str, list[int]] = {}  #: tags by name


def is_corner(dim: int, tag: int) -> bool:
    """Whether an edge is one along z between shank and eye."""
    box = gmsh.model.getBoundingBox(dim, tag)
    upright = box[3] - box[0] < 1e-5 and box[4] - box[1] < 1e-5
    return upright and abs(abs(box[1]) - HEIGHT / 2) < 1e-5 and 0.001 < box[0] < LENGTH - 0.001


def name_of(dim: int, tag: int) -> str:
    """The name of a face: a bore, a fillet, or none."""
    x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(dim, tag)
    if z1 - z0 < 0.9 * WIDTH:
        return ""
    for name, (x, _, inner) in EYES.items():
        if abs(x0 - x + inner) < 1e-5 and abs(x1 - x - inner) < 1e-5:
            return name
    small = max(x1 - x0, y1 - y0) < 2.5 * ROUND
    return "fillet" if small and max(abs(y0), abs(y1)) > HEIGHT / 2 - 1e-5 else ""


if __name__ == "__main__":
    size = float(sys.argv[1]) if len(sys.argv) > 1 else 12e-3
    file = sys.argv[2] if len(sys.argv) > 2 else Path(__file__).with_name("con_rod_solid.msh")
    build(size, Path(file))
