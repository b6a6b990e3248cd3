r"""What a part meets in a motion, as the options of a training alone that covers it.

    M z'' + C z' + f(z) - M 1 g = sum_k rows_k^T f_k,    rows_k of positions, slopes and axes at places                        (1)

f_k of positions are forces [N], those of unit vectors moments [N m], by least squares. The
frequency is that of their changes,
|f'| / |f - mean f| / 2 pi.
"""

from __future__ import annotations

import numpy as np

from ..bodies import laws
from ..bodies.body import ShapePoints
from ..core.algebra.linalg import as_dense
from ..dynamics.outputs import lifted
from ..dynamics.trajectory import Trajectory
from ..systems.system import System
from . import departures

MOST = 2000  #: states that are read, at most
SLOWER = 0.7  #: part of the last frequency that a sweep of a training reaches at least, see `parts.excitation`
#: [m/s2], and pull of a turn over the weight, beyond what trainings by weight meet, from which they
#: turn
GRAVITY, FAST = (
    9.81,
    10.0,
)


def find(motion: Trajectory) -> str:
    """Options `--push .. --moment .. --fastest ..` (and `--spin ..`) for the largest of all parts
    in a motion, or in equilibria.

    Values in SI units [N, N m, Hz, rad/s], rounded to two digits; of up to 2000 stored states. An
    empty text where no part knows shapes that it lacks.
    """
    motion = motion.part(slice(0, MOST))
    states = lifted(motion)
    found = []
    for part in departures.trained_parts(motion.system):
        points: ShapePoints = part.gather
        z, v, a = (x[:, points.columns].reshape(len(x), -1, points.dim) for x in states)
        if points.missing is not None:
            forces, moments = at_places(motion.system, points, z, v, a)
            found.append(
                (
                    largest(forces),
                    largest(moments),
                    pace(motion.times, forces) if v.any() else 0.0,
                    turning(motion.system, points, z, v),
                )
            )
    if not found:
        return ""
    options = zip(
        ("push", "moment", "fastest", "spin"), np.max(found, axis=0).tolist(), strict=True
    )
    return " ".join(
        f"--{name} {np.format_float_positional(value, 2, fractional=False, trim='-')}"
        for name, value in options
        if value
    )


def at_places(
    system: System, points: ShapePoints, z: np.ndarray, v: np.ndarray, a: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forces (s, i, c) [N] and moments (s, j, c) [N m] of (1) at the places of a part, of states
    (s, b, c) with rates.
    """
    whole = system.full or system
    missing = points.missing
    b = z.shape[1]
    assert missing is not None
    u = departures.gradients(points.table, z)
    columns = points.columns
    S = np.empty_like(u)
    laws.stress(points.law, u, u, 0.0, np.repeat(points.section, len(z), axis=1), S)
    (K, P, _) = points.table.shape
    dim = points.dim
    inner = np.einsum(
        "kcsp,kpb->sbc", S.reshape(K, dim, len(z), P), points.table, optimize=True
    ).reshape(len(z), -1)
    M, C = (as_dense(A[columns, columns]) for A in (whole.mass, whole.damping))
    total = (
        a.reshape(len(z), -1) @ M.T
        + v.reshape(len(z), -1) @ C.T
        + inner
        - whole.loads.constant[columns]
    )
    rows = missing.rows[:, :b]
    along = total.reshape(len(z), b, dim).transpose(1, 0, 2).reshape(b, -1)
    found = (
        np.linalg.lstsq(rows.T, along, rcond=None)[0]
        .reshape(len(rows), len(z), dim)
        .transpose(1, 0, 2)
    )
    first = np.zeros(len(rows), dtype=bool)
    first[np.unique(missing.place, return_index=True)[1]] = True
    vectors = np.einsum("jb,sbc->sjc", rows[~first], z)
    turning = found[:, ~first]
    return found[:, first], turning - vectors * np.sum(turning * vectors, axis=2, keepdims=True)


def largest(vectors: np.ndarray) -> float:
    """Largest size of vectors (s, j, c)."""
    return float(np.linalg.norm(vectors, axis=2).max(initial=0.0))


def pace(times: np.ndarray, forces: np.ndarray) -> float:
    """Frequency of forces (s, j, c) [Hz], so large that sweeps up to it reach them."""
    spread = float(np.sum((forces - forces.mean(axis=0)) ** 2))
    rates = np.diff(forces, axis=0) / np.diff(times)[:, None, None]
    return (
        float(np.sqrt(np.sum(rates**2) / spread) / (2.0 * np.pi * SLOWER)) if spread > 0.0 else 0.0
    )


def turning(system: System, points: ShapePoints, z: np.ndarray, v: np.ndarray) -> float:
    """Largest rate at which a part turns [rad/s], 0 where its pull is less than FAST times its
    weight.

        max |v| / |z|    about the means
    """
    dim, columns, missing = points.dim, points.columns, points.missing
    assert missing is not None
    W = as_dense((system.full or system).mass[columns, columns])[::dim, ::dim]
    one = system.unit[columns.start // dim : columns.stop // dim]
    weight = W @ one / (one @ W @ one)
    x, rate = (part - one[:, None] * (weight @ part)[:, None] for part in (z, v))
    found = np.sqrt(
        float((np.sum(rate * (W @ rate), axis=(1, 2)) / np.sum(x * (W @ x), axis=(1, 2))).max())
    )
    size = float(np.linalg.norm(np.ptp(missing.positions, axis=0)))
    return float(found) if found**2 * size > FAST * GRAVITY else 0.0
