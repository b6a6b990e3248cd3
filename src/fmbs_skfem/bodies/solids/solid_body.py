r"""Solids: tetrahedra or hexahedra of an elastic material, at any rotation.

    W = int w(F) dX,    m_ij = int rho N_i N_j dX,    F = sum_b q_b N_b,X

X are the axes of the mesh, in which a material has its directions and stresses are told. Nodes of
a rim are slaved to a rigid frame, an average follows its nodes, see `from_matrices`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.sparse import csr_array

from ...core.algebra.linalg import as_csr, selection
from ...core.errors import InputError, closest, listed, require_positive, say
from ...core.notices import notify
from ...shapes.solids import elements, solid
from ...shapes.solids.solid import Solid
from ..body import Body, Cells, own, scatter_blocks
from ..from_matrices import Coupling, axes_of, check_interface, mean_axes, tie
from ..laws import STIFFNESS, Law
from ..sections import Material
from ..values import MASS, Value, monomials
from .materials import Orthotropic, stiffness
from .solid_law import REFERENCE

NEARLY_INCOMPRESSIBLE = 0.49  #: Poisson's ratio up to which bending is right to 2 %


def solid_body(
    name: str,
    shape: Solid,
    material: Material | Orthotropic,
    *,
    axes: np.ndarray | None = None,
    law: Law = Law.SOLID,
    numbers: Mapping[str, float] | None = None,
    rims: Mapping[str, Coupling] | None = None,
    places: Mapping[str, int] | None = None,
    origin: np.ndarray | None = None,
    rotation: np.ndarray | None = None,
) -> Body:
    """Elastic body of a solid mesh.

    `axes` (3, 3) has the directions of an orthotropic material in its columns. `law` is one of F,
    W(r,1, r,2, r,3), with its `numbers` in place of a stiffness. `rims` make frames of nodes, rigid
    or averages; `places` are single nodes by name, beside sets of one node. `origin` (3,) [m] and
    `rotation` (3, 3) place the mesh, x <- origin + rotation X. InputError for nodes of two rigid
    rims, for a rim of nodes on a line, and for a law that is none of three vectors.
    """
    where = f"body '{name}'"
    require_law(where, law, numbers or {})
    tell_incompressible(where, material)
    middle = shape.reference.mean(axis=0)
    nodes = shape.reference - middle  # far from the middle of the mesh digits are lost
    unit = np.ones(shape.count)
    found = shifted(rims or {}, middle)
    for key, one in found.items():
        check_interface(f"{where}: rim '{key}'", one, nodes, unit)
    known = {key: int(ids[0]) for key, ids in shape.sets.items() if len(ids) == 1}
    known |= places or {}
    if both := sorted(set(found) & set(known)):
        got = f"the rim '{both[0]}' beside a point of that name"
        raise InputError(say(where, "names of rims and points that differ", got, "rename the rim"))
    spread, reference, constant = tie(where, nodes, unit, found)
    turn = np.eye(3) if rotation is None else rotation
    place = turn @ middle + (0.0 if origin is None else np.asarray(origin, dtype=float))
    mass = mass_matrix(shape, material.density)
    return Body(
        name,
        reference @ turn.T + np.outer(constant, place),
        as_csr(spread.T @ mass @ spread),
        constant,
        {key: selection([node], shape.count) for key, node in known.items()},
        shape,
        cells(shape, material, axes, law, numbers or {}),
        radius=0.0,
        frames={key: 4 * k for k, key in enumerate(found)},
        axes=axes_of(found, spread, nodes, unit) if found else None,
        spread=spread if found else None,
        values=values_of(material, law),
        fits={key: mean_axes(one, nodes, unit) for key, one in found.items() if not one.rigid},
        yield_strength=(isinstance(material, Material) and material.yield_strength) or 0.0,
    )


def node_rows(part: Body, nodes: np.ndarray) -> csr_array:
    """Rows (i, b) of the positions of nodes (i,) of the mesh on the functions of a solid."""
    shape = part.space
    assert isinstance(shape, Solid)
    return own(part, selection(nodes, shape.count))


def shifted(rims: Mapping[str, Coupling], center: np.ndarray) -> dict[str, Coupling]:
    """Rims of a mesh whose nodes are counted from its middle (3,) [m]."""
    return {
        key: one
        if one.center is None
        else replace(one, center=tuple((np.array(one.center) - center).tolist()))
        for key, one in rims.items()
    }


def require_law(where: str, law: Law, numbers: Mapping[str, float]) -> None:
    """InputError for a law that is none of solids, or whose numbers are not those given."""
    if law.vectors != 3 or law.fields != 1 or law.follows or 3 not in law.dims:
        expected = "a law of r,1, r,2 and r,3 (own_laws.define with vectors=3)"
        raise InputError(say(f"{where}.law", expected, law.name))
    wanted = [] if law is Law.SOLID else [row for row in law.section if row != "weight"]
    if missing := [row for row in wanted if row not in numbers]:
        expected = f"the numbers of the law: {listed(missing)}"
        raise InputError(say(f"{where}.numbers", expected, sorted(numbers) or "none"))
    if unread := [row for row in numbers if row not in wanted]:
        expected = f"numbers of the law {law.name} ({', '.join(wanted) or 'it has none'})"
        raise InputError(
            say(f"{where}.numbers", expected, f"'{unread[0]}'") + closest(unread[0], wanted)
        )


def tell_incompressible(where: str, material: Material | Orthotropic) -> None:
    """A notice of a Poisson's ratio whose volume changes cells cannot follow."""
    if isinstance(material, Material) and material.poisson_ratio > NEARLY_INCOMPRESSIBLE:
        text = f"Poisson's ratio {material.poisson_ratio:g} lies above {NEARLY_INCOMPRESSIBLE}: held all around, it may be too stiff"
        remedy = "compare with a finer mesh, or with 0.49"
        notify(f"{where}: {text}; {remedy}")


def cells(
    shape: Solid,
    material: Material | Orthotropic,
    axes: np.ndarray | None,
    law: Law,
    numbers: Mapping[str, float],
) -> Cells:
    """Cells of the law of a solid, with numbers that are made when they are needed."""
    points = len(elements.quadrature(shape.kind, elements.STIFFNESS_DEGREE[shape.kind])[1])
    rows = rows_of(material, axes, law, numbers)
    return Cells.later(
        law,
        np.ascontiguousarray(3 * shape.nodes.T),
        3,
        points,
        partial(numbers_of, shape, rows),
    )


def rows_of(
    material: Material | Orthotropic,
    axes: np.ndarray | None,
    law: Law,
    numbers: Mapping[str, float],
) -> np.ndarray:
    """Numbers (i - 1,) of the section of a law without the weight."""
    if law is not Law.SOLID:
        return np.array([numbers[row] for row in law.section[:-1]])
    C = stiffness(material, axes)
    return np.concatenate([C[np.triu_indices(6)], [0.0], REFERENCE])


def numbers_of(shape: Solid, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Table (3, p, b, e) of the gradients [1/m] and section (i, p, e) of the cells of a solid, of the
    numbers (i - 1,) of its law.
    """
    degree = elements.STIFFNESS_DEGREE[shape.kind]
    points = len(elements.quadrature(shape.kind, degree)[1])
    count, basis = shape.nodes.shape
    table = np.empty((3, points, basis, count))
    section = np.empty((len(rows) + 1, points, count))
    section[:-1] = rows[:, None, None]
    for part in solid.parts(shape):
        _, gradients, weights = solid.tabulate(shape, degree, part)
        table[..., part] = gradients.transpose(2, 1, 3, 0)
        section[-1, :, part] = weights.T
    return table, section


def mass_matrix(shape: Solid, density: float) -> csr_array:
    """Mass matrix (n, n) [kg] over the nodes of a solid.

        m_ij = int rho N_i N_j dX

    `density` rho [kg/m3].
    """
    count, basis = shape.nodes.shape
    blocks = np.empty((count, basis, basis))
    for part in solid.parts(shape):
        N, _, weights = solid.tabulate(shape, elements.MASS_DEGREE[shape.kind], part)
        blocks[part] = density * np.einsum("pb,pd,ep->ebd", N, N, weights, optimize=True)
    return scatter_blocks(blocks, shape.nodes.astype(np.int32), shape.count)


def values_of(material: Material | Orthotropic, law: Law) -> dict[str, Value]:
    """Young's modulus [Pa] and density [kg/m3] of a solid, each with its powers."""
    require_positive("material", density=material.density)

    def make(numbers: Mapping[str, float]) -> dict[str, float]:
        E = numbers.get("young_modulus", 1.0)
        return {MASS: numbers["density"], **dict.fromkeys(STIFFNESS, E)}

    scaled = {"density": material.density}
    if isinstance(material, Material) and law is Law.SOLID:
        scaled["young_modulus"] = material.young_modulus
    return monomials(make, scaled)
