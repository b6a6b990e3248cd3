r"""Errors of reduced models against the full one, and residual norms that indicate them.

    e(t) = |q - p|_M,   |u|_M = sqrt(u^T W u / w) [m],   max_t e / max_t |q - q0|_M,   int e dt / int |q - q0|_M dt

Distances are root mean squares over the mass (`systems.lengths`), and refer to the motion: neither
the origin nor the mesh stands in them, and a small motion of a large machine is not hidden. Beside
them the published measures of all coordinates, and the norms of the residual R of the full model on
the reduced motion:

    |q - p| / |q|   (53),     int |q - p| dt / int |q| dt   (48),     I = int |R|_g dt,   <u, v>_g = sum_i g_i u_i v_i   (39), (49)

The multipliers of dropped constraints are unknown to the reduced model, so the rows they touch are
masked, g_i = 0. The indicator of trainings divides every row by its mass, <u, v>_g = sum_i g_i u_i
v_i / (w W_ii): c |R|_g is then a displacement in a step [m], the same on every mesh.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import qr
from scipy.sparse import csr_array

from ...core.algebra import ranks
from ...core.algebra.linalg import distinct, is_identity
from ...core.notices import notify
from ...core.storage.records import dataclass
from ...core.values.arguments import checked
from ...dynamics.output_errors import common_times
from ...dynamics.outputs import body_coordinates, distances, lifted, positions, residual_samples
from ...dynamics.scheme import GeneralizedAlpha
from ...dynamics.trajectory import Trajectory
from ...systems import compiled
from ...systems.compiled import Compiled, compile_system
from ...systems.system import System, is_linear, reads, sizes

BLOCK = 4_000_000  #: numbers in a block of residuals
ANOTHER_END = 0.01  #: part of its duration by which a motion may end elsewhere than the full one without a warning


@dataclass(frozen=True)
class Errors:
    """Differences of two motions at their common times.

    Motions of different coordinates, as on another mesh, are compared along the centre lines of the
    bodies.
    """

    times: np.ndarray  #: (s,)
    distance: np.ndarray  #: (s,) root mean square over the mass [m]
    motion: np.ndarray  #: (s,) the same of the displacement from the start [m]
    relative: np.ndarray  #: (s,), eq. (53) of all coordinates
    position: np.ndarray  #: (s,) largest distance of centre lines and middle surfaces [m]
    coordinates_mean: float  #: eq. (48)

    @property
    def maximum(self) -> float:
        """Largest distance over the largest displacement.

            max_t |q - p| / max_t |q - q0|

        0 without an error, also where nothing moves.
        """
        return over(float(self.distance.max()), float(self.motion.max()))

    @property
    def median(self) -> float:
        """Median distance over the largest displacement.

            median_t |q - p| / max_t |q - q0|

        0 without an error.
        """
        return over(float(np.median(self.distance)), float(self.motion.max()))

    @property
    def mean(self) -> float:
        """Integral of the distance over that of the displacement.

            int |q - p| dt / int |q - q0| dt

        See `mean_error`.
        """
        return mean_error(self.times, self.distance, self.motion)

    @property
    def summary(self) -> dict[str, Any]:
        """All that is reported of them by name; lengths in metres, `coordinates_error` the largest
        of eq. (53).
        """
        return {
            "max_error": self.maximum,
            "median_error": self.median,
            "mean_error": self.mean,
            "position_error": float(self.position.max()),
            "distance_error": float(self.distance.max()),
            "coordinates_error": float(self.relative.max()),
            "coordinates_mean": self.coordinates_mean,
        }


def mean_error(times: np.ndarray, distance: np.ndarray, motion: np.ndarray) -> float:
    """Integral of a distance (s,) over that of the displacement (s,).

        int |q - p| dt / int |q - q0| dt

    by the trapezoidal rule, at times (s,) [s]; 0 without an error, infinite for an error of what
    does not move.
    """
    return over(float(np.trapezoid(distance, times)), float(np.trapezoid(motion, times)))


def over(error: float, size: float) -> float:
    """A part of a size; 0 for no error whatever the size.

    Infinite for an error of a size of 0.
    """
    return error / size if size > 0.0 else math.inf if error > 0.0 else 0.0


def notify_other_end(full: np.ndarray, other: np.ndarray) -> None:
    """A warning where a motion with times `other` (s,) [s] ends elsewhere than the full one (s,),
    as where an event stops one.

    That is, by more than 1 % of the later end.
    """
    ends = float(full[-1]), float(other[-1])
    if abs(ends[0] - ends[1]) > ANOTHER_END * max(ends):
        notify(
            f"a compared motion ends at {ends[1]:g} s, the full one at {ends[0]:g} s: errors are those until the earlier end"
        )


@checked
def compare(full: Trajectory, other: Trajectory) -> Errors:
    """Errors over time of the motion p of `other` (reduced, coarser, or with another step) against
    q of `full`, at the times both have stored.

        |q - p|_M = sqrt((q - p)^T W (q - p) / w)    [m]

    InputError where they share fewer than two times; a warning where they end at different times.
    """
    notify_other_end(full.times, other.times)
    i, j = common_times("errors.compare", full.times, other.times)
    q, p = (body_coordinates(replace(one, x=one.x[rows])) for one, rows in ((full, i), (other, j)))
    system = full.system
    position = distances(system, q, other.system, p)
    times = full.times[i]
    start = system.lift(system.x0)
    if q.shape == p.shape:
        raw = with_mass(system, other.system, q.shape[1])
        distance, motion = (
            sizes(raw, u) if raw else plain_sizes(system, u) for u in (q - p, q - start)
        )
    else:
        q, p, start = (
            all_positions(*one) for one in ((system, q), (other.system, p), (system, start[None]))
        )
        distance, motion = (line_sizes(apart, system.dim) for apart in (q - p, q - start))
    apart, size = np.linalg.norm(q - p, axis=1), np.linalg.norm(q, axis=1)
    mean = float(np.trapezoid(apart, times) / np.trapezoid(size, times))
    return Errors(times, distance, motion, apart / size, position, mean)


def with_mass(one: System, other: System, size: int) -> System | None:
    """A form of one of two systems whose unknowns are the `size` body coordinates; there the mass
    is known.
    """
    forms = (
        system
        for system in (one.full, one, other.full, other)
        if system is not None and system.size == size
    )
    return next((system for system in forms if is_identity(csr_array(system.lift.matrix))), None)


def plain_sizes(system: System, displacements: np.ndarray) -> np.ndarray:
    """Root mean squares (s,) [m] over the positions among displacements (s, q): of two reduced
    models, which know no mass of q.
    """
    vectors = displacements.reshape(len(displacements), -1, system.dim)[:, system.unit != 0.0]
    return line_sizes(vectors.reshape(len(displacements), -1), system.dim)


def all_positions(system: System, q: np.ndarray) -> np.ndarray:
    """Positions of all centre lines at states q (s, q), (s, x c)."""
    return np.hstack([positions(line, q, system.dim).reshape(len(q), -1) for line in system.lines])


def line_sizes(displacements: np.ndarray, dim: int) -> np.ndarray:
    """Root mean squares (s,) [m] of displacements u (s, x c) along centre lines.

        sqrt(mean_x |u|^2)

    over their x samples.
    """
    return np.sqrt(dim * np.mean(displacements**2, axis=1))


@dataclass(frozen=True)
class Norms:
    """Norms of the full residual on a reduced motion over time, (s,) each.

        c |R| for `plain`,    c |R|_g for `gappy`,    c = h^2 beta

    These are residual forces as far as unknowns move by them in a step. `constraint` is the part of
    the forces of constraints that the reduced model has dropped.
    """

    times: np.ndarray
    plain: np.ndarray
    constraint: np.ndarray  #: of the unknown constraint forces alone, by least squares
    gappy: np.ndarray
    indicator: float  #: int gappy dt, eq. (49)


def mask(full: System, reduced: System) -> np.ndarray:
    """g (q,): 0 for the rows touched by constraints whose multipliers the reduced model does not
    know.

    These are the constraints it has dropped. Where nonlinear or driven ones are among them, because
    they depend on others in the reduced space, the multipliers of all that are left stand for
    theirs, too: then every row that a constraint touches is masked.
    """
    names = set(reduced.constraints.names)
    dropped = np.array([name not in names for name in full.constraints.names], dtype=bool)
    if np.any(dropped & ~is_linear(full.constraints)):
        dropped[:] = True
    return np.where(touched(full, np.flatnonzero(dropped)), 0.0, 1.0)


def touched(full: System, rows: np.ndarray) -> np.ndarray:
    """Whether the constraints `rows` depend on the unknowns, in any position (n,).

    (n,) bool for the numbers `rows` (k,) of constraints of the full system.
    """
    read = distinct(reads(full.constraints, len(full.probes.offset))[rows].indices)
    entries = csr_array(full.probes.matrix)[read]
    return np.asarray(abs(entries).sum(axis=0)).ravel() > 0.0


@checked
def residual_norms(full: System, motion: Trajectory, scheme: GeneralizedAlpha) -> Norms:
    """Norms (s,) of the residual for a motion of a reduced system over its stored states; `full` is
    the form with all multipliers.

        c R,    c = h^2 beta

    R [force per unknown] is the residual of (2), h and beta are those of the `scheme`. Of the
    unknown forces of dropped constraints those that make R smallest are taken, by least squares.
    """
    c = scaling(scheme)
    R = full_residual(compile_system(full), motion)
    names = motion.system.constraints.names
    dropped = np.array(
        [k for k, name in enumerate(full.constraints.names) if name not in names], dtype=np.int64
    )
    constraint = unknown_forces(full, motion, R, dropped)
    gappy = c * np.linalg.norm(R * mask(full, motion.system), axis=1)
    return Norms(
        motion.times,
        c * np.linalg.norm(R, axis=1),
        c * constraint,
        gappy,
        float(np.trapezoid(gappy, motion.times)),
    )


def unknown_forces(full: System, motion: Trajectory, R: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Norms (s,) of the projections of residuals R (s, q) of a full system on the forces of some
    constraints, its `rows`.
    """
    model = compile_system(full)
    q = body_coordinates(motion)
    found = np.zeros(len(R))
    # directions of linear constraints are the same in all states
    step = len(R) if is_linear(full.constraints)[rows].all() else 1
    for first in range(0, len(R) if len(rows) else 0, step):
        J = compiled.gap(model, q[first], motion.times[first])[1][rows]
        some = slice(first, first + step)
        used = np.flatnonzero(np.abs(J).max(axis=0))
        independent = J[np.ix_(ranks.independent_rows(J), used)]
        found[some] = np.linalg.norm(R[some, used] @ qr(independent.T, mode="economic")[0], axis=1)
    return found


def indicator(full: System, motion: Trajectory, scheme: GeneralizedAlpha) -> float:
    """Error indicator [m s] of a motion of a reduced system, over its stored states (s, n).

        I = c int |R|_g dt    (49)

    `full` is the form with all multipliers at the same parameters; rows of constraints that the
    reduced model does not know are masked, all others divided by their mass.
    """
    model = compile_system(full)
    g = mask(full, motion.system) / np.sqrt(full.weight * full.metric.diagonal())
    block = max(1, BLOCK // len(g))
    norms = [
        np.linalg.norm(full_residual(model, motion.part(slice(first, first + block))) * g, axis=1)
        for first in range(0, len(motion.times), block)
    ]
    return float(scaling(scheme) * np.trapezoid(np.concatenate(norms), motion.times))


def scaling(scheme: GeneralizedAlpha) -> float:
    """Factor of residuals by which they become displacements in a step.

        c = h^2 beta

    [s2] of the step h and beta of the scheme.
    """
    return scheme.step**2 * scheme.coefficients[3]


def full_residual(model: Compiled, motion: Trajectory) -> np.ndarray:
    """Residual (s, q) of a full system on a reduced motion, with the multipliers that the motion
    has.

        R = M q'' + F + Q + Phi_q^T lambda
    """
    here = {name: k for k, name in enumerate(motion.system.constraints.names)}
    multipliers = np.zeros((len(motion.times), model.constraints))
    for k, name in enumerate(model.system.constraints.names):
        if name in here:
            multipliers[:, k] = motion.multipliers[:, here[name]]
    return residual_samples(model, motion.times, *lifted(motion), multipliers)
