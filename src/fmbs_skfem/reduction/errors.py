r"""Errors of reduced models against the full one, and residual norms that indicate them.

    e(t) = |q - (qbar + U xi)| / |q|   (53),      e = int |q - (qbar + U xi)| dt / int |q| dt   (48)
    I = int |R|_g dt,   R = c (M q'' + F + Q) + Phi_q^T lambda,   <u, v>_g = sum_i g_i u_i v_i   (39), (49)

R is the residual of the full model on the reduced motion. The multipliers of dropped constraints are unknown to the reduced model,
so the rows they touch are masked, g_i = 0.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import trapezoid
from scipy.sparse import csr_array

from ..core.errors import InputError, say
from ..dynamics.outputs import distances, lifted, residual_samples
from ..dynamics.scheme import GeneralizedAlpha
from ..dynamics.trajectory import Trajectory
from ..systems import compiled, kernels
from ..systems.compiled import Compiled, compile_system, signal_table
from ..systems.system import System, is_linear

BLOCK = 4_000_000  #: numbers in a block of residuals


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
    """g (q,): 0 for the rows touched by constraints whose multipliers the reduced model does not know.

    These are the constraints it has dropped. Where nonlinear or driven ones are among them, because they depend on others in the
    reduced space, the multipliers of all that are left stand for theirs, too: then every row that a constraint touches is masked.
    """
    names = set(reduced.constraints.names)
    dropped = np.array([name not in names for name in full.constraints.names], dtype=bool)
    if np.any(dropped & ~is_linear(full.constraints)):
        dropped[:] = True
    return np.where(touched(full, np.flatnonzero(dropped)), 0.0, 1.0)


def touched(full: System, rows: np.ndarray) -> np.ndarray:
    """Whether the constraints `rows` depend on the unknowns, in any position (n,)."""
    terms = full.constraints
    mine = np.isin(terms.row, rows)
    read = np.unique(np.concatenate([terms.i[mine], terms.j[mine]]))
    entries = csr_array(full.probes.matrix)[read[read >= 0]]
    return np.asarray(abs(entries).sum(axis=0)).ravel() > 0.0


def residual_norms(full: System, motion: Trajectory, scheme: GeneralizedAlpha) -> Norms:
    """Norms of R for a motion of a reduced system; `full` is the form with all multipliers."""
    model, c = compile_system(full), scaling(scheme)
    R = full_residual(model, motion)
    names = motion.system.constraints.names
    dropped = np.array([k for k, name in enumerate(full.constraints.names) if name not in names], dtype=np.int64)
    constraint, q = np.zeros(len(R)), lifted(motion)[0]
    for s, t in enumerate(motion.times if len(dropped) else []):
        J = compiled.gap(model, q[s], t)[1][dropped]
        used = np.flatnonzero(np.abs(J).max(axis=0))
        unknown = np.linalg.lstsq(J[:, used].T, -R[s, used], rcond=None)[0]
        constraint[s] = np.linalg.norm(J.T @ unknown)
    gappy = c * np.linalg.norm(R * mask(full, motion.system), axis=1)
    return Norms(motion.times, c * np.linalg.norm(R, axis=1), c * constraint, gappy, float(trapezoid(gappy, motion.times)))


def indicator(full: System, motion: Trajectory, scheme: GeneralizedAlpha) -> float:
    """I of equation (49) for a motion of a reduced system, over its stored states; `full` is the form with all multipliers."""
    model, g = compile_system(full), mask(full, motion.system)
    block = max(1, BLOCK // len(g))
    norms = [
        np.linalg.norm(full_residual(model, part(motion, slice(first, first + block))) * g, axis=1)
        for first in range(0, len(motion.times), block)
    ]
    return float(scaling(scheme) * trapezoid(np.concatenate(norms), motion.times))


def part(motion: Trajectory, samples: slice) -> Trajectory:
    """Some stored states of a motion."""
    arrays = {name: getattr(motion, name)[samples] for name in ("times", "x", "v", "a", "multipliers")}
    return replace(motion, **arrays)


def scaling(scheme: GeneralizedAlpha) -> float:
    """c = h^2 beta."""
    return scheme.step**2 * scheme.coefficients[3]


def full_residual(model: Compiled, motion: Trajectory) -> np.ndarray:
    """M q'' + F + Q + Phi_q^T lambda of a full system on a reduced motion (s, q), with the multipliers that the motion has."""
    q, v, a = lifted(motion)
    R, P = residual_samples(model, motion.times, q, v, a), model.system.probes
    place = {name: k for k, name in enumerate(model.system.constraints.names)}
    pairs = [(k, place[name]) for k, name in enumerate(motion.system.constraints.names) if name in place]
    if not pairs:
        return R
    here, there = np.array(pairs).T
    y, signals = np.asarray(P.matrix @ q.T).T + P.offset, signal_table(model.system, motion.times)
    gap, jacobian, forces = np.zeros(model.constraints), np.zeros((model.constraints, len(P.offset))), np.zeros(y.shape)
    for s in range(len(y)):
        kernels.constrain(model.arrays.terms, y[s], signals[s], gap, jacobian)
        forces[s] = motion.multipliers[s, here] @ jacobian[there]
    return R + np.asarray(P.matrix.T @ forces.T).T
