"""Sparse non-negative least squares on training forces of a whirling string of bars: sizes,
seconds, cells kept.

    G[(s,i), e] = (U_e^T F_e(q_s))_i,   F_e from the energy EA/4 (|r'|^2 - 1)^2 of every bar, q_s a travelling wave that grows

`python benchmarks/snnls.py` prints one line a case, with one BLAS thread; `seconds_search` is what
follows the Gram matrix.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from threadpoolctl import threadpool_limits

from fmbs_skfem.reduction.hyper import ecsw
from fmbs_skfem.reduction.spaces import pod

Array = NDArray[np.float64]

CASES = (
    (100, 33, 600, 1e-3),
    (300, 23, 600, 1e-3),
    (200, 60, 600, 1e-3),
    (800, 60, 600, 1e-3),
    (300, 23, 600, 1e-8),
)


@dataclass(frozen=True)
class Figures:
    """One case; CPU seconds."""

    cells: int
    modes: int
    tolerance: float
    kept: int
    residual: float
    seconds_gram: float
    seconds_search: float
    seconds_weights: float  #: the whole of `ecsw.weights`, from G on


def string_states(cells: int, samples: int) -> Array:
    """q (n,s), n = 2 (cells + 1): positions (x, y) by node of a pulse on a growing wave, both
    travelling along a line.
    """
    xi, t = np.linspace(0.0, 1.0, cells + 1)[:, None], np.linspace(0.0, 1.0, samples)[None, :]
    y = 0.2 * t * xi * np.sin(2.0 * np.pi * (1.5 * xi - 3.0 * t)) + 0.03 * np.exp(
        -(((xi - t) / 0.06) ** 2)
    )
    x = xi * (1.0 - 0.3 * t**2) + 0.02 * np.sin(7.0 * np.pi * xi) * np.cos(11.0 * t)
    return np.stack([x, y], axis=1).reshape(2 * (cells + 1), samples)


def string_forces(q: Array) -> Array:
    """End forces (s,e,4) of every bar for the states q (n,s), at EA = 1 and unit length in all."""
    cells = q.shape[0] // 2 - 1
    slope = np.diff(q.T.reshape(-1, cells + 1, 2), axis=1) * cells
    stress = (np.sum(slope**2, axis=2) - 1.0)[:, :, None] * slope
    return np.concatenate([-stress, stress], axis=2)


def training(cells: int, modes: int, samples: int) -> Array:
    """G (s r, e) on the projected snapshots."""
    q = string_states(cells, samples)
    basis = pod.basis(q, modes=modes)
    projected = basis.mean[:, None] + basis.modes @ (basis.modes.T @ (q - basis.mean[:, None]))
    local = np.stack([basis.modes[2 * e : 2 * e + 4] for e in range(cells)])
    return np.einsum("ebr,seb->sre", local, string_forces(projected)).reshape(-1, cells)


def measure(cells: int, modes: int, samples: int, tolerance: float) -> Figures:
    """Figures of one case."""
    G = training(cells, modes, samples)
    ecsw.weights(G[: 2 * cells], 0.5)
    ecsw.weights(G[: 2 * cells], 1e-7)
    start = time.process_time()
    normal = ecsw.gram(G)
    middle = time.process_time()
    if tolerance >= ecsw.GRAM_FLOOR:
        ecsw.weights_from_gram(normal, tolerance)
    stop = time.process_time()
    sample = ecsw.weights(G, tolerance)
    whole = time.process_time() - stop
    search = stop - middle if tolerance >= ecsw.GRAM_FLOOR else float("nan")
    return Figures(
        cells,
        G.shape[0] // samples,
        tolerance,
        sample.indices.size,
        sample.residual,
        middle - start,
        search,
        whole,
    )


def against_scipy(
    cells: int = 100, modes: int = 20, samples: int = 100
) -> tuple[float, float, int, int]:
    """CPU seconds and cells kept: ours at 1e-3, then scipy.optimize.nnls, which has no tolerance."""
    G = training(cells, modes, samples)
    ecsw.weights(G, 1e-3)
    start = time.process_time()
    ours = ecsw.weights(G, 1e-3)
    middle = time.process_time()
    dense, _ = nnls(G, G.sum(axis=1), maxiter=100 * cells)
    return middle - start, time.process_time() - middle, ours.indices.size, int(np.sum(dense > 0.0))


def main() -> list[Figures]:
    """Run and print all cases."""
    print(
        f"{'cells':>6} {'modes':>6} {'eta':>8} {'kept':>6} {'residual':>10} {'gram s':>8} {'search s':>9} {'weights s':>10}"
    )
    with threadpool_limits(limits=1):
        figures = [measure(*case) for case in CASES]
        for f in figures:
            times = f"{f.seconds_gram:8.4f} {f.seconds_search:9.4f} {f.seconds_weights:10.4f}"
            print(
                f"{f.cells:6d} {f.modes:6d} {f.tolerance:8.0e} {f.kept:6d} {f.residual:10.2e} {times}"
            )
        own, other, kept, dense = against_scipy()
    print(
        f"100 cells, 2000 rows: ours {own:.4f} s, {kept} kept; scipy.optimize.nnls {other:.4f} s, {dense} kept"
    )
    return figures


if __name__ == "__main__":
    main()
