r"""Solutions with large sparse symmetric positive definite matrices whose factors do not fit into
memory.

    S A S y = S b,    x = S y,    S = diag(A)^-1/2

by conjugate gradients with one W-cycle of smoothed aggregation as preconditioner. The columns of B
span what costs (almost) no energy, A B = 0 but for supports: the rigid motions of a body. The
coarse spaces reproduce S^-1 B exactly, and S makes unknowns of different units (positions, slopes)
comparable, so that the iterations hardly grow with the mesh.

Sources: P. Vanek, J. Mandel, M. Brezina, Computing 56, 1996, doi:10.1007/BF02238511 (smoothed
aggregation); N. Bell, L. N. Olson, J. Schroder, B. Southworth, J. Open Source Softw. 8, 2023,
doi:10.21105/joss.05495 (PyAMG).
"""

from __future__ import annotations

import warnings
from typing import Any, Literal

import numpy as np
from scipy.sparse import bsr_array, csr_array
from scipy.sparse.linalg import LinearOperator, cg, lobpcg

from ..errors import InputError, Reason, SolverError, say
from ..storage.records import dataclass
from .linalg import scaled

SPARE = 0.8  #: share of the free memory that factors may take
SHIFT = 1e-8  #: of the mass beside the stiffness of a free body, over the mean of their diagonals
# a bar of 33 075 unknowns: frequencies to 3e-6 after 15 rounds, 4e-8 after 20, 1e-9 after 25
ROUNDS, TRIES = 16, 4  #: of block conjugate gradients, and how often they are
SPARES = 4  #: vectors beside those wanted, which make these contract faster
ALMOST = 0.3  #: residual of a mode, over its inertia, that is small in the norm of the inverse: 0.2 is 3e-6 of the frequency
COARSEST = 100  #: nodes of the coarsest level, which is solved densely
BYTES_PER_UNKNOWN = 200.0  #: analysis and vectors of the direct solver [B]


@dataclass(frozen=True)
class Report:
    """What a preconditioner is made of."""

    unknowns: tuple[int, ...]  #: of each level, the finest first
    complexity: float  #: numbers of the matrices of all levels, over those of the finest
    memory: int  #: matrices, restrictions and prolongations of all levels [B]


@dataclass(frozen=True)
class Preconditioned:
    """A scaled matrix with its multigrid hierarchy; see `solve`."""

    matrix: csr_array | bsr_array  #: S A S
    scale: np.ndarray  #: (n,) diagonal of S
    cycle: LinearOperator  #: one W-cycle
    report: Report


def _describe(hierarchy: Any) -> Report:
    """Levels, complexity and memory of a PyAMG hierarchy."""
    levels = hierarchy.levels
    parts = [
        part
        for level in levels
        for part in (level.A, getattr(level, "P", None), getattr(level, "R", None))
        if part is not None
    ]
    return Report(
        unknowns=tuple(int(level.A.shape[0]) for level in levels),
        complexity=sum(level.A.nnz for level in levels) / levels[0].A.nnz,
        memory=sum(
            int(part.data.nbytes + part.indices.nbytes + part.indptr.nbytes) for part in parts
        ),
    )


def _check(matrix: csr_array, near_null: np.ndarray, block: int) -> None:
    """Refuse what the hierarchy could not be built from."""
    n = matrix.shape[0]
    if matrix.format != "csr" or matrix.shape != (n, n) or n == 0:
        raise InputError(say("krylov", "a square csr_array", f"{matrix.format} {matrix.shape}"))
    if near_null.ndim != 2 or near_null.shape[0] != n or not np.isfinite(near_null).all():
        raise InputError(
            say(
                "krylov: near null space", f"finite columns ({n}, k)", f"an array {near_null.shape}"
            )
        )
    if block < 1 or n % block:
        raise InputError(
            say(
                "krylov: block",
                f"a divisor of {n}",
                block,
                "use 1 where nodes differ in their unknowns",
            )
        )
    diagonal = matrix.diagonal()
    if not (diagonal > 0.0).all():
        worst = int(np.argmin(diagonal))
        expected = "a positive definite matrix"
        raise InputError(
            say(
                "krylov",
                expected,
                f"{diagonal[worst]} on the diagonal, row {worst}",
                "use the direct solver",
            )
        )


def multigrid(matrix: csr_array, near_null: np.ndarray, block: int = 1) -> Preconditioned:
    """The hierarchy of a matrix (n, n) whose nodes carry `block` unknowns each, from `near_null`
    (n, k), the columns of B.
    """
    from pyamg import smoothed_aggregation_solver

    _check(matrix, near_null, block)
    scale = 1.0 / np.sqrt(matrix.diagonal())
    balanced = scaled(matrix, scale, scale)
    balanced = balanced if block == 1 else bsr_array(balanced, blocksize=(block, block))
    smoother = ("block_gauss_seidel", {"sweep": "symmetric"})
    candidates = np.linalg.qr(near_null / scale[:, None])[0]
    with (
        warnings.catch_warnings()
    ):  # PyAMG would have as many columns as unknowns a node; a plate has 6 motions and 9 unknowns
        warnings.filterwarnings("ignore", message="Having less target vectors")
        hierarchy = smoothed_aggregation_solver(
            balanced, B=candidates, strength=("symmetric", {"theta": 0.0}), smooth=("energy", {"degree": 1, "maxiter": 4}),
            max_coarse=COARSEST, coarse_solver="pinv", presmoother=smoother, postsmoother=smoother,
        )  # fmt: skip
    return Preconditioned(
        balanced, scale, hierarchy.aspreconditioner(cycle="W"), _describe(hierarchy)
    )


def solve(
    preconditioned: Preconditioned,
    b: np.ndarray,
    tolerance: float,
    start: np.ndarray | None = None,
    most: int = 500,
) -> tuple[np.ndarray, int]:
    """The solution x (n,) to a tolerance, from `start` where one is known, and the iterations it
    took.

        A x = b,    |S (b - A x)| <= tolerance |S b|
    """
    matrix = preconditioned.matrix
    scale = preconditioned.scale
    taken = 0
    if b.shape != scale.shape or not np.isfinite(b).all():
        raise InputError(
            say(
                "krylov: right-hand side", f"finite numbers ({scale.size},)", f"{b.dtype} {b.shape}"
            )
        )

    def count(_: np.ndarray) -> None:
        nonlocal taken
        taken += 1

    rhs = scale * b
    guess = None if start is None else start / scale
    y, info = cg(
        matrix, rhs, guess, rtol=tolerance, maxiter=most, M=preconditioned.cycle, callback=count
    )
    if info != 0:
        left = np.linalg.norm(rhs - matrix @ y) / np.linalg.norm(rhs)
        reason = Reason.NOT_CONVERGED if np.isfinite(left) else Reason.NOT_FINITE
        raise SolverError(
            f"krylov: {left:.1e} of the residual are left after {taken} iterations, asked {tolerance:.1e}",
            reason,
        )
    return scale * y, taken


def lowest(
    K: csr_array, M: csr_array, free: np.ndarray, near_null: np.ndarray, count: int, block: int
) -> tuple[np.ndarray, np.ndarray]:
    """The `count` lowest eigenvalues and vectors (n, count) outside of motions `free` (n, j), which
    cost no energy; `near_null` (n, k) are those that cost little.

        K v = l M v,    v^T M v = 1

    By locally optimal block conjugate gradients, preconditioned by one cycle for K, of which each
    node has `block` unknowns; SolverError where residuals stay above `ALMOST`. Source: A. V.
    Knyazev, SIAM J. Sci. Comput. 23 (2001) 517-541, doi:10.1137/S1064827500366124.
    """
    n = K.shape[0]
    shifted = csr_array(K + SHIFT * (K.diagonal().sum() / M.diagonal().sum()) * M)
    found = multigrid(shifted, near_null, block)
    scale = found.scale[:, None]

    def cycle(r: np.ndarray) -> np.ndarray:
        columns = (scale * r.reshape(n, -1)).T
        return np.asarray(scale * np.stack([found.cycle @ one for one in columns], axis=1))

    P = LinearOperator((n, n), matvec=cycle, matmat=cycle, dtype=float)
    vectors = np.random.default_rng(0).standard_normal((n, count + SPARES))
    stiff = bsr_array(K, blocksize=(block, block))
    away = free if free.shape[1] else None
    for _ in range(TRIES):
        with warnings.catch_warnings():  # of vectors that are not there yet
            warnings.simplefilter("ignore", UserWarning)
            values, vectors = lobpcg(
                stiff, vectors, M, P, away, tol=None, maxiter=ROUNDS, largest=False
            )[:2]
        order = np.argsort(values)
        values, vectors = values[order], vectors[:, order]
        forces = M @ vectors[:, :count]
        left = np.linalg.norm(stiff @ vectors[:, :count] - forces * values[:count], axis=0)
        worst = float((left / (values[:count] * np.linalg.norm(forces, axis=0))).max())
        if worst < ALMOST:
            return values[:count], vectors[:, :count]
    text = f"krylov: modes have a residual of {worst:.1e} after {TRIES * ROUNDS} rounds"
    raise SolverError(f"{text}, wanted {ALMOST:.0e}", Reason.NOT_CONVERGED)


def choose(
    unknowns: int, fill: float, available: float, number: float = 8.0
) -> Literal["direct", "krylov"]:
    """The solver for a matrix whose factors have `fill` numbers of `number` bytes each, in
    `available` bytes of memory.

    The direct solver takes 1.3 times its factors (fronts and remainders that wait) and the arrays
    of its analysis.
    """
    needed = 1.3 * number * fill + BYTES_PER_UNKNOWN * unknowns
    return "direct" if needed <= SPARE * available else "krylov"
