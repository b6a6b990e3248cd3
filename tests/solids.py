"""Solids of tests: bars and what scikit-fem makes, as meshes of this package."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import skfem

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.from_matrices import Coupling
from fmbs_skfem.bodies.solids.materials import Orthotropic
from fmbs_skfem.bodies.solids.solid_body import solid_body
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes.solids import solid, solid_meshes
from fmbs_skfem.shapes.solids.solid import Solid

SOFT = Material(200e6, 1000.0, 0.3)
TETRA, HEXA = skfem.MeshTet, skfem.MeshHex


def box(
    cells: tuple[int, int, int],
    size: tuple[float, float, float] = (1.0, 0.1, 0.1),
    kind: type = TETRA,
    order: int = 2,
    shape: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Solid:
    """A box from the origin on, its faces `left`, `right`, `front`, `back`, `bottom`, `top`; nodes of
    all orders by a shape.
    """
    axes = [np.linspace(0.0, length, n + 1) for length, n in zip(size, cells, strict=True)]
    names = ("left", "right", "front", "back", "bottom", "top")
    ends = [(k // 2, (0.0, size[k // 2])[k % 2]) for k in range(6)]
    faces = {
        name: lambda x, c=c, at=at: np.abs(x[c] - at) < 1e-9
        for name, (c, at) in zip(names, ends, strict=True)
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        found = solid_meshes.from_skfem(kind.init_tensor(*axes).with_boundaries(faces), order)
    return found if shape is None else replace(found, reference=shape(found.reference))


def coupling(mesh: Solid, name: str, rigid: bool = True) -> Coupling:
    """A face as a rim or an average."""
    nodes, weights = solid.coupled("test", mesh, name)
    return Coupling(tuple(nodes.tolist()), rigid, None, tuple(weights.tolist()))


def bar(
    mesh: Solid,
    rigid: str = "",
    average: str = "",
    material: Material | Orthotropic = SOFT,
    name: str = "bar",
    **more: object,
) -> Body:
    """A body with faces as rims and averages, which have their names."""
    rims = {one: coupling(mesh, one) for one in rigid.split()}
    rims |= {one: coupling(mesh, one, False) for one in average.split()}
    return solid_body(name, mesh, material, rims=rims, **more)  # type: ignore[arg-type]
