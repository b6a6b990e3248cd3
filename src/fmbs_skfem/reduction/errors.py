r"""Errors of reduced models against the full one, and residual norms that indicate them.

    e(t) = |q - (qbar + U xi)| / |q|   (53),      e = int |q - (qbar + U xi)| dt / int |q| dt   (48)
    I = int |R|_g dt,   R = c (M q'' + F + Q) + Phi_q^T lambda,   <u, v>_g = sum_i g_i u_i v_i   (39), (49)

R is the residual of the full model on the reduced motion. The multipliers of dropped constraints are unknown to the reduced model,
so the rows they touch are masked, g_i = 0.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import trapezoid

from ..core.errors import InputError, say
from ..dynamics.integration import GeneralizedAlpha, Trajectory
from ..dynamics.outputs import distances, lifted, residual_samples
from ..systems import compiled
from ..systems.compiled import compile_system
from ..systems.system import System


@dataclass(frozen=True)
class Errors:
    """Differences of two motions at their common times."""

    times: np.ndarray  #: (s,)
    relative: np.ndarray  #: (s,), eq. (53) of all coordinates; NaN where the coordinates differ in kind
    position: np.ndarray  #: (s,) largest distance of centre lines and middle surfaces [m]
    maximum: float  #: of `relative`
    mean: float  #: eq. (48)
    position_maximum: float  #: [m]

    @property
    def median(self) -> float:
        """Of `relative` over the samples."""
        return float(np.median(self.relative))


def common_times(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the times that two trajectories share."""
    near = np.clip(np.searchsorted(b, a - 1e-9), 0, len(b) - 1)
    same = np.abs(b[near] - a) < 1e-9 * max(1.0, float(b[-1]))
    return np.flatnonzero(same), near[same]


def compare(full: Trajectory, other: Trajectory) -> Errors:
    """Errors of `other` (reduced, coarser, or with another step) against `full`, at the times both have stored."""
    i, j = common_times(full.times, other.times)
    if len(i) < 2:
        raise InputError(say("errors.compare", "two trajectories with common times", f"{len(i)} common times"))
    q, p = lifted(full)[0][i], lifted(other)[0][j]
    relative = np.linalg.norm(q - p, axis=1) / np.linalg.norm(q, axis=1) if q.shape == p.shape else np.full(len(i), np.nan)
    times = full.times[i]
    mean = np.nan
    if q.shape == p.shape:
        mean = float(trapezoid(np.linalg.norm(q - p, axis=1), times) / trapezoid(np.linalg.norm(q, axis=1), times))
    position = distances(full.system, q, other.system, p)
    return Errors(times, relative, position, float(relative.max()), mean, float(position.max()))


@dataclass(frozen=True)
class Norms:
    """Norms of the full residual on a reduced motion over time, (s,) each."""

    times: np.ndarray
    plain: np.ndarray
    constraint: np.ndarray  #: of the unknown constraint forces alone, by least squares
    gappy: np.ndarray
    indicator: float  #: int gappy dt, eq. (49)


def mask(full: System, reduced: System) -> np.ndarray:
    """g (q,): 0 for the rows touched by constraints whose multipliers the reduced model has dropped."""
    dropped = [k for k, name in enumerate(full.constraints.names) if name not in reduced.constraints.names]
    J = compiled.gap(compile_system(full), full.x0)[1]
    return np.where(np.abs(J[dropped]).max(axis=0, initial=0.0) > 0, 0.0, 1.0)


def residual_norms(full: System, motion: Trajectory, scheme: GeneralizedAlpha) -> Norms:
    """Norms of R for a motion of a reduced system; `full` is the form with all multipliers."""
    model, reduced = compile_system(full), motion.system
    q, v, a = lifted(motion)
    c = scheme.step**2 * scheme.coefficients[3]
    R = residual_samples(model, motion.times, q, v, a)
    known = [full.constraints.names.index(name) for name in reduced.constraints.names if name in full.constraints.names]
    dropped = np.setdiff1d(np.arange(len(full.constraints.names)), known)
    constraint = np.zeros(len(q))
    for s, t in enumerate(motion.times):
        J = compiled.gap(model, q[s], t)[1]
        R[s] += motion.multipliers[s, : len(known)] @ J[known]
        if len(dropped):
            used = np.flatnonzero(np.abs(J[dropped]).max(axis=0))
            unknown = np.linalg.lstsq(J[np.ix_(dropped, used)].T, -R[s, used], rcond=None)[0]
            constraint[s] = np.linalg.norm(J[dropped].T @ unknown)
    gappy = c * np.linalg.norm(R * mask(full, reduced), axis=1)
    return Norms(motion.times, c * np.linalg.norm(R, axis=1), c * constraint, gappy, float(trapezoid(gappy, motion.times)))
