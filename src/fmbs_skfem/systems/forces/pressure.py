r"""Pressure that follows plates, shells and edges: cells of their own beside those of the body, on
the same coordinates.

    surface   Q_b = p int N_b r,1 x r,2 dxi                edge   Q_b = p int N_b J^T r,s ds,   J^T (x, y) = (y, -x)

The integrals run over parent cells and sides, so that the normal carries the area of the deformed
configuration. On an edge the normal points away from the plate. `bodies.pressure_law` says what the
tangent holds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...bodies.body import Body, Cells
from ...bodies.laws import Law
from ...shapes import surface
from ...shapes.surface import Surface
from ..compiled import Compiled, sum_of
from ..system import System
from ..terms.elastic import Term


def finer(shape: Surface) -> int:
    """Gauss points a direction that integrate r . (r,1 x r,2) of splines exactly: degree 3 p - 1,
    where p points serve bending.
    """
    return -(-3 * shape.order // 2)


def surface_cells(part: Body, shape: Surface, chosen: np.ndarray, pressure: float) -> Cells:
    """Cells of a pressure [Pa] along r,1 x r,2 on some cells (i,) of a surface in space, for the
    law PRESSURE.

    Quadrature is fine enough for the volume of splines, see `finer`.
    """
    table = surface.tabulate(shape, finer(shape))
    nodes = shape.nodes[chosen]
    values = table.values[chosen][:, :, :3]
    weights = table.weights[chosen]
    gradients = np.einsum("epkb,ebc->epkc", values, part.shape_reference[nodes])
    volume = np.einsum(
        "epc,epc->ep", gradients[:, :, 0], np.cross(gradients[:, :, 1], gradients[:, :, 2])
    )
    return loaded(Law.PRESSURE, 3, nodes, values, pressure, volume, weights)


def edge_cells(part: Body, shape: Surface, sides: np.ndarray, load: float) -> Cells:
    """Cells of a line load [N/m] along the outward normal of sides (i, 2) of a planar surface, for
    the law EDGE_PRESSURE.

    Each side is a cell of its own.
    """
    points, weights = np.polynomial.legendre.leggauss(shape.order)
    cell, side = np.repeat(sides, len(points), axis=0).T
    xi = surface.side_points(shape.parent, side, np.tile(0.5 + 0.5 * points, len(sides)))
    basis = surface.basis(shape.space, cell, xi)
    first, second = np.einsum(
        "xkb,xbc->kxc", basis[:, 1:3], part.shape_reference[shape.nodes[cell]]
    )
    slope = np.einsum("xk,xkb->xb", surface.along(shape, first, second, side), basis[:, 1:3])
    values = np.stack([basis[:, 0], slope], axis=1).reshape(len(sides), len(points), 2, -1)
    ends = np.einsum("epkb,ebc->epkc", values, part.shape_reference[shape.nodes[sides[:, 0]]])
    area = ends[:, :, 0, 0] * ends[:, :, 1, 1] - ends[:, :, 0, 1] * ends[:, :, 1, 0]
    return loaded(
        Law.EDGE_PRESSURE,
        2,
        shape.nodes[sides[:, 0]],
        values,
        load,
        area,
        np.tile(0.5 * weights, (len(sides), 1)),
    )


def loaded(
    law: Law,
    dim: int,
    nodes: np.ndarray,
    values: np.ndarray,
    load: float,
    size: np.ndarray,
    weights: np.ndarray,
) -> Cells:
    """Cells of a law of `pressure_law` from values (e, p, k, b), with the cell axis last."""
    section = np.stack([np.full_like(weights, load), size, weights])
    return Cells(
        law,
        np.ascontiguousarray(values.transpose(2, 1, 3, 0)),
        np.ascontiguousarray(nodes.T * dim),
        dim,
        np.ascontiguousarray(section.transpose(0, 2, 1)),
    )


def at_load_factor(model: Compiled, factor: float) -> Compiled:
    """The model with its pressures that follow times a load factor [-]; without any it is the model
    itself.
    """
    if not present(model.system):
        return model

    def scaled(term: Term, owner: int) -> Term:
        if not model.system.elastic[owner].gather.law.follows:
            return term
        section = term.record.section.copy()
        section[0] *= factor
        return replace(term, record=term.record._replace(section=section))

    terms = tuple(
        scaled(term, owner) for term, owner in zip(model.terms, model.owners, strict=True)
    )
    elastic = sum_of(terms, model.owners)
    return replace(model, terms=terms, arrays=model.arrays._replace(elastic=elastic))


def present(system: System) -> list[str]:
    """Names of the loads that follow surfaces or edges, which stand among the elastic terms of a
    system.
    """
    return [part.name for part in system.elastic if part.gather.law.follows]
