r"""Factors of large sparse symmetric matrices by PARDISO of Intel's oneMKL, through the optional
package pypardiso.

    A = P^T L D L^T P,  D with blocks of 1 and 2, in float64

An alternative to `direct` for those who ask for it: it pivots, and it uses the threads that MKL is
allowed (MKL_NUM_THREADS). The upper triangle is factored as real, symmetric and indefinite. A pivot
that had to be replaced means a matrix without an inverse.

Source: O. Schenk, K. Gartner, Future Gener. Comput. Syst. 20, 2004,
doi:10.1016/j.future.2003.07.011.
"""

from __future__ import annotations

import importlib.util
import weakref
from typing import Any

import numpy as np
from scipy.sparse import csr_array, triu

from ..errors import MissingFeature, Reason, SolverError, say
from ..storage.records import dataclass

SYMMETRIC = -2  #: PARDISO's number of real, symmetric, indefinite matrices
#: PARDISO's parameters that count replaced pivots, and numbers in the factors
REPLACED, NUMBERS = (
    14,
    18,
)


@dataclass(frozen=True)
class PardisoFactors:
    """Factors inside MKL, freed with this object."""

    upper: csr_array  #: upper triangle of A
    solver: Any  #: pypardiso.PyPardisoSolver
    numbers: int  #: in the factors


def require() -> None:
    """Refuse to go on without the package."""
    if importlib.util.find_spec("pypardiso") is None:
        remedy = "pip install 'fmbs_skfem[pardiso]' (BSD; it brings Intel's MKL), or leave out the option"
        raise MissingFeature(say("solver: pardiso", "the package pypardiso", "none", remedy))


def factor(matrix: csr_array) -> PardisoFactors:
    """Factors of a symmetric matrix; one without an inverse raises SolverError (SINGULAR_TANGENT)."""
    require()
    from pypardiso import PyPardisoSolver
    from pypardiso.pardiso_wrapper import PyPardisoError

    upper = csr_array(triu(matrix, format="csr"))
    upper.sort_indices()
    solver = PyPardisoSolver(mtype=SYMMETRIC)
    try:
        solver.factorize(upper)
    except (PyPardisoError, ValueError) as error:
        raise SolverError(f"pardiso: {error}", Reason.SINGULAR_TANGENT) from error
    found = PardisoFactors(upper, solver, int(solver.get_iparm(NUMBERS)))
    weakref.finalize(found, solver.free_memory, everything=True)
    if solver.get_iparm(REPLACED) > 0:
        raise SolverError(
            f"pardiso: {solver.get_iparm(REPLACED)} pivots without a digit left",
            Reason.SINGULAR_TANGENT,
        )
    return found


def solve(factors: PardisoFactors, b: np.ndarray) -> np.ndarray:
    """Solve with the factors of A.

        A^-1 b

    for every row of b (k, n).
    """
    return np.ascontiguousarray(factors.solver.solve(factors.upper, b.T).T)
