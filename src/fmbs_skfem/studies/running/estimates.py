"""Solver, memory and order of magnitude of the time of an analysis, by counts of numbers read and
written.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...core import machine_memory
from ...core.algebra import krylov, supernodes
from ...systems import compiled
from ...systems.layouts import Storage
from ...systems.terms import elastic as terms
from ...systems.terms import sparse

if TYPE_CHECKING:
    from ...scenes import Scene
    from ...systems import System

#: orders of magnitude of a usual computer: seconds a number read, solved with, factored, factored
#: by SuperLU, and seconds a call
FORCE_S, SOLVE_S, FACTOR_S, LU_S, CALL_S = 1.2e-9, 1e-9, 5e-10, 1.5e-7, 2e-6
CYCLES = 150.0  #: products with the matrix in a solution by multigrid


def estimates(scene: Scene, raw: System, reduced: System) -> dict[str, Any]:
    """Solver, steps, memory [MB] and order of magnitude of the time [s] of an analysis, by counts
    of numbers read and written.
    """
    work = scene.analysis.work()
    (label, fill, once, each) = solver(scene, raw, reduced)
    numbers = sum(terms.numbers_read(part.gather) for part in reduced.elastic)
    tables = 8e-6 * numbers / max(reduced.dim, 1)
    seconds = (
        work.forces * FORCE_S * numbers
        + work.factors * once
        + work.solutions * each
        + work.calls * CALL_S
    )
    found: dict[str, Any] = {
        "solver": label,
        "solver_memory_mb": round(fill + tables, 3),
        **work.counts,
    }
    if work.steps:
        memory = round(3 * 8e-6 * work.states * reduced.size, 3)
        found |= {"memory_mb": memory, "step_s": float(f"{seconds / work.steps:.1g}")}
    return {**found, "wall_s": float(f"{seconds:.1g}")}


def solver(scene: Scene, raw: System, reduced: System) -> tuple[str, float, float, float]:
    """Name, memory [MB], and seconds of a factorisation and of a solution of the linear systems of
    an analysis.
    """
    n = reduced.size
    m = len(reduced.constraints.names)
    layout = compiled.storage(reduced)
    form = layout.storage
    width = layout.width
    fill = float(layout.numbers)
    if form is Storage.SPARSE:
        fill, label, memory, each = sparse_solver(raw)
    elif form is Storage.BLOCKS:
        label = "blocks of parts"
        memory = 16e-6 * fill
        each = 4 * SOLVE_S * fill
        width = round(fill / n)
    elif form is Storage.DENSE:
        label = "dense Cholesky or LU"
        memory = 16e-6 * (n + m) ** 2
        each = 2 * SOLVE_S * (n + m) ** 2
    else:
        label = f"band of half width {width}"
        memory = 32e-6 * n * (width + 1)
        each = 4 * SOLVE_S * fill
    if not scene.analysis.moves:
        return "sparse LU", 16e-6 * fill, LU_S * fill, 4 * SOLVE_S * fill
    sparse = form is Storage.SPARSE
    once = (
        FACTOR_S
        * fill
        * (np.sqrt(fill / n) * 8 if sparse else n if form is Storage.DENSE else width)
    )
    return label, memory, once / (20 if sparse else 1), each


def sparse_solver(raw: System) -> tuple[float, str, float, float]:
    """Numbers in the factors of a large model, and name, memory [MB] and seconds a solution of what
    solves it.

    Factors of the pattern of functions, each of which stands for a vector of unknowns.
    """
    W = sparse.function_pattern(raw)
    dim = raw.dim
    n = dim * W.shape[0]
    fill = float(dim**2 * supernodes.entries(supernodes.analyse(W)))
    if krylov.choose(n, fill, machine_memory.free(), 4.0) == "direct":
        return (
            fill,
            f"sparse LDL^T with {fill:.3g} numbers",
            1e-6 * (5.2 * fill + krylov.BYTES_PER_UNKNOWN * n),
            SOLVE_S * fill,
        )
    return (
        fill,
        "conjugate gradients with multigrid",
        36e-6 * dim**2 * W.nnz,
        CYCLES * SOLVE_S * dim**2 * W.nnz,
    )
