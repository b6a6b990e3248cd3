r"""Starts of a motion near that of its system, drawn at random.

    u = (M + T^2 K)^-1 (M xi - Phi_x^T mu),    Phi_x u = 0,    xi ~ N(0, 1)
    x = x0 + a s u / |u|,    Phi(x, 0) = 0,    a ~ U(0, 1)

and the same for velocities, with |u| of `systems.sizes` and the sizes s [m] and [m/s]. Of what
vibrates by w [rad/s] the draw has 1 / (1 + (w T)^2): a displacement that were as large in the
stiffest mode as in the softest one would break the model.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import InputError, say
from ..systems import compiled as compilation
from ..systems.compiled import Compiled
from ..systems.prepared import remembered
from ..systems.system import sizes
from .initial import Inversion, augmented, change_of, kkt_solver

ITERATIONS = 50  #: onto the joints, with the factors of the start: a tenth of the size of the system takes about ten
CLOSED = 1e-12  #: gaps that are round-off, over the size of the system


def perturbed_start(
    model: Compiled,
    v: np.ndarray,
    random: np.random.Generator,
    spread: tuple[float, float],
    time: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (n,) drawn near the start of a system, whose velocities v (n,) are
    consistent.

    `spread` are the largest displacement [m] and speed [m/s], root mean squares; `time` [s] is T.
    InputError where the joints do not hold near by.
    """
    system = model.system
    solve, J = remembered(system, ("start noise", time), lambda: smoothing(model, time))

    def draw(size: float) -> np.ndarray:
        u = solve(system.mass @ random.normal(size=system.size), np.zeros(len(J)))[0]
        length = float(sizes(system, u)[0])
        return size * random.uniform() / length * u if length else u

    displacement, change = (draw(size) for size in spread)
    gap = lambda x: compilation.gap(model, x)  # noqa: E731
    x = onto_joints(solve, lambda x: gap(x)[0], system.x0 + displacement, CLOSED * system.scale)
    # as fast as drives ask for, which the start has been
    now, rates = gap(x)[1], J @ v
    least = CLOSED * max(1.0, float(np.abs(v + change).max(initial=0.0)))
    return x, onto_joints(solve, lambda v: now @ v - rates, v + change, least)


def smoothing(model: Compiled, time: float) -> tuple[Inversion, np.ndarray]:
    """What solves with M + T^2 K and the joints at the start, and Phi_x (m, n) there."""
    system = model.system
    J = compilation.gap(model, system.x0)[1]
    K = compilation.tangent(model, system.x0, np.zeros(model.constraints))
    invert = partial(augmented, model) if model.pattern else None
    return kkt_solver(system, csr_array(system.mass) + time**2 * K, J, invert), J


def onto_joints(
    solve: Inversion, gap: Callable[[np.ndarray], np.ndarray], x: np.ndarray, least: float
) -> np.ndarray:
    """x (n,), put to where a gap (m,) is at most `least` by the joints of the start."""
    for _ in range(ITERATIONS):
        left = gap(x)
        if np.abs(left).max(initial=0.0) <= least:
            return x
        x = x + change_of(solve, np.zeros(len(x)), left)
    got = f"gaps of {np.abs(left).max():.3g}"
    raise InputError(say("start noise", "starts on the joints", got, "take less"))
