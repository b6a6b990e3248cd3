"""The ground floor, which knows no mechanics: errors, notices, linear algebra, compiled functions,
LAPACK.

    errors.InputError, SolverError, MissingFeature, CorruptFile    what users meet, each with place, expectation, value, remedy
    notices.Notice                                                 what users should know but what stops nothing
    values.expressions.of_time                                     functions of time and parameters, written as texts
    algebra.linalg                                                 sparse or dense arrays
    algebra.ranks                                                  which rows are independent, null space, least norm
    algebra.pivoting                                               the same of rows in compiled code
    algebra.saddle                                                 matrices bordered by constraints, balanced and solved
    compiling.jit.jit                                              compiled functions with a cache that is never stale
    compiling.lapack                                               factorise and solve inside compiled functions

Modules are imported one by one, because `algebra` loads scipy. Numba is loaded when the first
function is compiled or called.

Axis letters, the same everywhere: `e` cell, `p` quadrature point, `k` derivative, `b` basis
function, `c` component, `n` unknown, `m` constraint, `s` time sample, `r` mode, `x` any sampling
point.
"""

__all__ = ["errors", "notices"]
