"""Large plates: static membrane and bending solves by sparse factors and by multigrid, and time
steps of a free plate.

    python benchmarks/large_plates.py [CELLS ...] [--steps CELLS] [--direct]

A square ANCF plate of CELLS x CELLS, clamped along one edge, under a shear force (membrane) and a
transverse force (bending) along the other. CPU seconds with one BLAS thread, relative residual
1e-10. `--steps 330` takes three time steps of a free plate of a million unknowns. Results go to
benchmarks/results/large_plates.md.

`--direct` compares factors of this package, of SuperLU (symmetric ordering, no pivoting) and of
PARDISO, where the extra `pardiso` is installed, in place of all that; to
benchmarks/results/direct_solvers.md.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu
from threadpoolctl import threadpool_limits

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.algebra import direct, krylov, pardiso
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.shapes import ancf_plate
from fmbs_skfem.systems import At, assemble, compile_system, compiled, free_motions
from fmbs_skfem.systems.forces import loads

RESULTS = Path(__file__).parent / "results"
FUNCTIONS = 3  #: r, r_x, r_y at every node


def square(cells: int) -> Body:
    """A square of 1 m, 10 mm of aluminium, in space."""
    x = np.linspace(0.0, 1.0, cells + 1)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    ids = np.arange(len(points)).reshape(cells + 1, cells + 1)
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], -1).reshape(-1, 4)
    shape = ancf_plate.surface(points, quads, (), {"corner": [int(ids[-1, -1])]})
    return plate("plate", shape, 0.01, Material(7e10, 2700.0, 0.3))


def clamped(cells: int) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Stiffness (n, n) without the nodes of the clamped edge, rigid motions (n, 6), and right-hand
    sides (2, n).
    """
    system = assemble([square(cells)])
    model = compile_system(system)
    held = FUNCTIONS * 3 * (cells + 1)
    K = csr_array(compiled.tangent(model, system.x0, np.zeros(0))[held:, held:])
    K.sum_duplicates()
    B = free_motions.rigid_motions(model.system)[held:]
    tip = np.arange(system.size - held, system.size, FUNCTIONS * 3) - held
    rhs = np.zeros((2, K.shape[0]))
    rhs[0, tip + 1] = rhs[1, tip + 2] = 1.0 / len(tip)
    return K, B, rhs


def peak() -> float:
    """Largest memory of the process so far [GiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def statics(cells: int) -> list[str]:
    """One row of the table a load."""
    K, B, rhs = clamped(cells)
    start = time.process_time()
    factors = direct.factor(K)
    set_up = time.process_time() - start
    start = time.process_time()
    exact = direct.solve(factors, rhs.copy())
    solve = (time.process_time() - start) / 2
    start = time.process_time()
    hierarchy = krylov.multigrid(K, B, FUNCTIONS * 3)
    grid = time.process_time() - start
    rows = []
    for name, b, x in zip(("membrane", "bending"), rhs, exact, strict=True):
        start = time.process_time()
        found, taken = krylov.solve(hierarchy, b, 1e-10)
        seconds = time.process_time() - start
        gap = float(np.linalg.norm(found - x) / np.linalg.norm(x))
        memory = factors.lower.nbytes / 2**20, hierarchy.report.memory / 2**20
        rows.append(
            f"| {K.shape[0]} | {name} | {set_up:.2f} + {solve:.3f} | {memory[0]:.0f} "
            f"| {grid:.2f} + {seconds:.2f} | {taken} | {memory[1]:.0f} | {gap:.1e} |"
        )
    return rows


@dataclass(frozen=True)
class Solver:
    """A direct solver: factors of a matrix, numbers in them, solution for rows (k, n)."""

    name: str
    factor: Callable[[csr_array], Any]
    numbers: Callable[[Any], int]
    solve: Callable[[Any, np.ndarray], np.ndarray]


def superlu(K: csr_array) -> Any:
    return splu(
        K.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def direct_solvers(cells: int) -> list[str]:
    """One row a solver: the better of two runs."""
    K, _, rhs = clamped(cells)
    solvers = [
        Solver(
            "own", direct.factor, lambda f: len(f.lower), lambda f, b: direct.solve(f, b.copy())
        ),
        Solver("SuperLU", superlu, lambda f: f.L.nnz + f.U.nnz, lambda f, b: f.solve(b.T).T),
        Solver("PARDISO", pardiso.factor, lambda f: f.numbers, pardiso.solve),
    ]
    rows = []
    for solver in solvers if find_spec("pypardiso") else solvers[:2]:
        set_up, solve = np.inf, np.inf
        for _ in range(2):
            start = time.process_time()
            factors = solver.factor(K)
            set_up, start = min(set_up, time.process_time() - start), time.process_time()
            x = solver.solve(factors, rhs)
            solve = min(solve, (time.process_time() - start) / len(rhs))
        left = np.linalg.norm(direct.residual(K, x, rhs)) / np.linalg.norm(rhs)
        memory = solver.numbers(factors) * 8 / 2**20
        rows.append(
            f"| {K.shape[0]} | {solver.name} | {set_up:.2f} | {1e3 * solve:.1f} | {memory:.0f} | {left:.0e} |"
        )
    return rows


def steps(cells: int) -> str:
    """Three time steps of a free plate that a force at its corner starts."""
    start = time.process_time()
    system = assemble(
        [square(cells)], [], [loads.PointForce("push", At("plate", "corner"), (0.0, 0.0, 100.0))]
    )
    built = time.process_time() - start
    found = integrate(system, GeneralizedAlpha(1e-4), 3e-4, Newton(1e-8)).statistics
    return (
        f"{system.size} unknowns: assembled in {built:.1f} s, {found.steps} steps with {found.iterations} iterations and "
        f"{found.factorisations} factorisation in {found.cpu_s:.1f} s CPU, peak {peak():.1f} GiB, {found.solver}"
    )


def main(sizes: list[int], moving: int | None) -> str:
    """The table as Markdown."""
    head = "| unknowns | load | factors + solve [s] | [MiB] | multigrid + solve [s] | iterations | [MiB] | difference |"
    with threadpool_limits(limits=1, user_api="blas"):
        statics(4)  # compiled before the clock starts
        lines = [
            head,
            "|---|---|---|---|---|---|---|---|",
            *(row for cells in sizes for row in statics(cells)),
        ]
        if moving:
            lines += ["", steps(moving)]
    text = "\n".join(lines) + "\n"
    (RESULTS / "large_plates.md").write_text(text, encoding="utf-8")
    return text


def compare_direct(sizes: list[int]) -> str:
    """The table of direct solvers as Markdown."""
    head = "| unknowns | solver | order and factors [s] | solve [ms] | numbers of the factors [MiB] | residual |"
    with threadpool_limits(limits=1):
        direct_solvers(4)  # compiled before the clock starts
        lines = [
            head,
            "|---|---|---|---|---|---|",
            *(row for cells in sizes for row in direct_solvers(cells)),
        ]
    text = "\n".join(lines) + "\n"
    (RESULTS / "direct_solvers.md").write_text(text, encoding="utf-8")
    return text


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "cells", nargs="*", type=int, default=[20, 40, 80], help="cells along a side"
    )
    parser.add_argument(
        "--steps", type=int, help="cells along a side of a free plate that takes time steps"
    )
    parser.add_argument("--direct", action="store_true", help="compare direct solvers instead")
    given = parser.parse_args()
    print(compare_direct(given.cells) if given.direct else main(given.cells, given.steps))
