r"""What a reduced model costs: products of matrices by count, and the reduced tangent by the clock.

    p = sum_b N_b (w r_b + r_b^2),    s = p_system / p                                                          (46), (47)

Scalar multiplications p of the products U^T K U in the reduced tangent K_r, for components b with r_b modes and N_b coordinates
that the kept cells touch, where K has at most w non-zeros a row.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690, section 3.4.2 and Table 1.
"""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import csr_array

from ..bodies.body import Cells
from ..core.jit import jit
from ..systems import kernels
from ..systems.compiled import compile_system
from ..systems.kernels import Arrays
from ..systems.system import Sampled, System

BURST = 0.01  #: CPU time of one measurement of the tangent [s]


def bandwidth(full: System) -> int:
    """w: most non-zeros in a row of the elastic tangent of a body."""
    return max((_row_width(e.gather) for e in full.elastic if isinstance(e.gather, Cells)), default=0)


def _row_width(cells: Cells) -> int:
    basis, count = cells.nodes.shape
    nodes = cells.nodes.T.ravel() // cells.dim
    nodes -= nodes.min()
    rows = np.repeat(np.arange(count), basis)
    incidence = csr_array((np.ones(nodes.size), (rows, nodes)), shape=(count, int(nodes.max()) + 1))
    return int(np.diff((incidence.T @ incidence).tocsr().indptr).max()) * cells.dim


def touched(full: System, kept: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Coordinates touched by the kept cells (i,) of every body."""
    gathers = {e.name: e.gather for e in full.elastic}
    found = {}
    for name, numbers in kept.items():
        cells = gathers[name]
        found[name] = len(np.unique(cells.nodes[:, numbers])) * cells.dim if isinstance(cells, Cells) else 0
    return found


def kept_cells(reduced: System) -> dict[str, np.ndarray]:
    """Numbers (i,) of the cells with points in use, by body."""
    return {e.name: np.unique(e.gather.cell) for e in reduced.elastic if isinstance(e.gather, Sampled)}


def kept_points(reduced: System) -> dict[str, int]:
    """Points in use, by body."""
    return {e.name: len(e.gather.cell) for e in reduced.elastic if isinstance(e.gather, Sampled)}


def by_component(values: Mapping[str, int], components: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Sums over the bodies of every component."""
    return {name: sum(values.get(body, 0) for body in members) for name, members in components.items()}


def multiplications(dofs: Mapping[str, int], modes: Mapping[str, int], width: int) -> int:
    """p from the coordinates touched and the modes of every component."""
    return sum(dofs[name] * (width * modes[name] + modes[name] ** 2) for name in modes if name in dofs)


def tangent_seconds(system: System, repeat: int = 5) -> float:
    """CPU time [s] of one evaluation of the elastic tangent in the unknowns of the system at x0, the best of several bursts."""
    model = compile_system(system)
    if not len(system.elastic):
        return 0.0
    body, work = model.buffers()
    x, W = np.ascontiguousarray(system.x0[model.order]), np.zeros_like(model.arrays.mass_band)
    _tangents(model.arrays, x, body[0], work, W, 1)
    start = clock.process_time()
    _tangents(model.arrays, x, body[0], work, W, 20)
    times = max(20, int(20 * BURST / max(clock.process_time() - start, 1e-6)))
    best = np.inf
    for _ in range(repeat):
        start = clock.process_time()
        _tangents(model.arrays, x, body[0], work, W, times)
        best = min(best, (clock.process_time() - start) / times)
    return float(best)


@jit
def _tangents(A: Arrays, x: np.ndarray, q: np.ndarray, work: np.ndarray, W: np.ndarray, times: int) -> None:
    """W = K_r(x), again and again."""
    for _ in range(times):
        kernels.clear(W.reshape(-1))
        kernels.add_elastic_tangent(A.groups, A.scatter, A.lift, A.lift_offset, x, q, 0.0, work, W)
