"""What an iteration leaves is no part of the motion: guess, iteration and step together are stable,
at every step size.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs
from fmbs_skfem.dynamics.scheme import largest_share

from .. import models

FREQUENCIES = np.geomspace(0.05, 1e5, 120)  #: times the step
DURATION = 8.0  #: [s]; as far as a wave needs to grow


def radius(scheme: GeneralizedAlpha, frequency: float, share: float, order: int) -> float:
    """Spectral radius of a step h = 1 of an oscillator, q'' left at a share of the way from its
    solution to the guess.
    """
    am, af, gamma, beta = scheme.coefficients
    q, v, a, now, before, first = np.eye(6)
    guess = (now, 2.0 * now - before, 3.0 * now - 3.0 * before + first)[order]
    known = q + v + (0.5 - beta) * a + beta * (af * now - am * a) / (1.0 - am)
    exact = -(frequency**2) * known / (1.0 + frequency**2 * beta * (1.0 - af) / (1.0 - am))
    new = exact + share * (guess - exact)
    a1 = ((1.0 - af) * new + af * now - am * a) / (1.0 - am)
    moved = q + v + (0.5 - beta) * a + beta * a1, v + (1.0 - gamma) * a + gamma * a1, a1
    return float(np.abs(np.linalg.eigvals(np.stack([*moved, new, now, before]))).max())


@pytest.mark.parametrize("rho_inf", [0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95])
def test_what_is_left_does_not_grow(rho_inf: float) -> None:
    """Of guesses of all orders and shares of both signs; of four times the share stiff waves grow
    by half a percent a step.
    """
    scheme = GeneralizedAlpha(1.0, rho_inf)
    largest = [
        max(
            radius(scheme, w, sign * many * largest_share(scheme), order)
            for w in FREQUENCIES
            for order in range(3)
            for sign in (-1, 1)
        )
        for many in (1.0, 4.0)
    ]
    assert largest[0] < 1.0 + 1e-5
    assert largest[1] > 1.005


def test_a_scheme_without_damping_leaves_nothing() -> None:
    assert largest_share(GeneralizedAlpha(1.0, 1.0)) < 1e-12


def test_no_single_step_size_is_wrong() -> None:
    """Spin-ups of eight cells at 14 step sizes, with a tolerance that decides nothing: the default
    one gives the same motion.

    4124 steps erred by 1.3e-3 m of 0.14 m, others by 1e-4 to 1e-6: a wave along the beam grew from
    step to step.
    """
    system = models.spin_up(8, continuity=1)
    counts = np.unique([3234, 4124, 4656, *np.geomspace(1600, 4800, 11).astype(int)])
    errors = []
    for steps in counts:
        default, loose = (
            integrate(
                system, GeneralizedAlpha(DURATION / steps), DURATION, newton, every=steps // 50
            )
            for newton in (None, Newton(1e-6))
        )
        errors.append(
            np.abs(outputs(loose)["tip_deflection"] - outputs(default)["tip_deflection"]).max()
        )
    assert max(errors) < 1e-7


def test_a_loose_tolerance_saves_corrections_and_adds_little_to_the_error_of_the_step() -> None:
    """A double pendulum in steps of 2 ms: what Newton leaves is below a twentieth of what the step
    errs by.
    """
    system, duration, steps = models.double_pendulum(4), 1.5, 750
    default, loose, finer = (
        integrate(system, GeneralizedAlpha(duration / n), duration, newton, every=n // 50)
        for n, newton in ((steps, None), (steps, Newton(1e-6)), (2 * steps, None))
    )
    assert loose.statistics.iterations < 0.95 * default.statistics.iterations
    left, step = (np.abs(one.x - default.x).max() for one in (loose, finer))
    assert left < 0.05 * step
