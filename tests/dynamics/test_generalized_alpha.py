"""The time integrator against an independent implementation of the same scheme, exact pendulums, and its linear theory.

Method: Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0. The golden steps, the error table
of the pendulum and the spectral radii were computed by a separate implementation; the pendulum motions are elliptic functions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.sparse import csr_array

from fmbs_skfem.bodies import body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.systems import assemble

from .. import models

TIGHT = Newton(tolerance=1e-13)

COEFFICIENTS = {  # rho_inf: alpha_m, alpha_f, gamma, beta
    0.0: (-1.0, 0.0, 1.5, 1.0),
    0.2: (-0.5, 0.1666666667, 1.166666667, 0.6944444444),
    0.4: (-0.1428571429, 0.2857142857, 0.9285714286, 0.5102040816),
    0.5: (0.0, 0.3333333333, 0.8333333333, 0.4444444444),
    0.6: (0.125, 0.375, 0.75, 0.390625),
    0.7: (0.2352941176, 0.4117647059, 0.6764705882, 0.3460207612),
    0.8: (0.3333333333, 0.4444444444, 0.6111111111, 0.3086419753),
    0.9: (0.4210526316, 0.4736842105, 0.5526315789, 0.2770083102),
    0.95: (0.4615384615, 0.4871794872, 0.5256410256, 0.2629848784),
    1.0: (0.5, 0.5, 0.5, 0.25),
}

GOLDEN = {  # rho_inf: (step, q, v, lambda) of the pendulum L = m = 1 that starts at (-1, 0) at rest, h = 0.05, a0 = q''(0)
    1.0: (
        (1, (-0.999924824, -0.01226157815), (0.003007039005, -0.4904631262), 0.1202906032),
        (2, (-0.9987986742, -0.04900212715), (0.04203895496, -0.9791588335), 1.442728265),
        (5, (-0.9539454615, -0.2999800934), (0.7124266372, -2.312420165), 8.587063471),
        (10, (-0.4016445603, -0.9157956361), (3.845497243, -1.69718361), 27.01359039),
    ),
    0.9: (
        (1, (-0.999924824, -0.01226157815), (0.002999521408, -0.4904632184), 0.1194184963),
        (2, (-0.9987986779, -0.04900205195), (0.04196227724, -0.9791600858), 1.435523153),
        (5, (-0.9539487465, -0.2999696468), (0.7122906314, -2.312259238), 8.616866596),
        (10, (-0.4017693176, -0.9157409107), (3.844812374, -1.697853057), 26.90527786),
    ),
    0.8: (
        (1, (-0.999924824, -0.01226157815), (0.002976968615, -0.4904634949), 0.1169224663),
        (2, (-0.9987986877, -0.04900185143), (0.04172628314, -0.9791649991), 1.414016221),
        (5, (-0.9539587846, -0.2999377223), (0.711771695, -2.311872269), 8.667000411),
        (10, (-0.4021883884, -0.9155569345), (3.841957912, -1.699232931), 26.80053031),
    ),
    0.5: (
        (1, (-0.999924824, -0.01226157815), (0.002819099068, -0.4904654308), 0.1014951964),
        (2, (-0.9987987418, -0.04900074858), (0.03997280385, -0.9792152963), 1.268015289),
        (5, (-0.9540357393, -0.2996928564), (0.7064091613, -2.309708731), 8.675216651),
        (10, (-0.4059968236, -0.9138744877), (3.813072884, -1.709432016), 26.68536266),
    ),
    0.0: (
        (1, (-0.999924824, -0.01226157815), (0.002255279254, -0.4904723446), 0.06014530159),
        (2, (-0.9987988771, -0.04899799175), (0.03302664938, -0.9794766264), 0.8115211433),
        (5, (-0.9543646929, -0.2986436554), (0.670678698, -2.303204304), 8.140972163),
        (10, (-0.4281930762, -0.9036872742), (3.622586028, -1.770668682), 25.66500599),
    ),
}

START = ((0.9053428509, -0.4246814362), (-1.225870002, -2.613329776))  #: position and velocity of the moving pendulum
ERRORS = {  # (rho_inf, h): largest error over 2 s of q, v, and of lambda after 0.2 s
    (0.8, 0.01): (0.002288672408, 0.01006051212, 0.3571348565),
    (0.8, 0.005): (0.0005726310119, 0.002517303782, 0.01186733978),
    (0.8, 0.0025): (0.0001432078841, 0.000629563796, 0.002967993492),
    (0.5, 0.01): (0.00320503876, 0.01413758422, 0.0658046351),
    (0.5, 0.005): (0.0008070228745, 0.003557351839, 0.01660843738),
    (0.5, 0.0025): (0.0002023999412, 0.0008919878465, 0.004170508249),
    (0.0, 0.01): (0.01073552189, 0.04801358313, 0.2112290681),
    (0.0, 0.005): (0.002828856645, 0.01258585603, 0.05676801058),
    (0.0, 0.0025): (0.0007245384781, 0.003214848834, 0.01468464422),
}

RADIUS = {  # rho_inf: spectral radius at omega h = 0.1, 1, 10, 100, 1e4
    0.0: (0.9999519177, 0.9065633333, 0.242535625, 0.04783128168, 0.002157527397),
    0.5: (0.9999981604, 0.989312786, 0.6825284215, 0.5371736239, 0.5016827188),
    0.8: (0.9999999316, 0.999474614, 0.9297917672, 0.8346376088, 0.8016748334),
    0.9: (0.9999999927, 0.9999422589, 0.9837630771, 0.928448671, 0.9014511757),
    1.0: (1.0, 1.0, 1.0, 1.0, 1.0),
}
PERIOD = {0.0: 0.4582476573, 0.5: 0.1249980809, 0.8: 0.08796235632, 0.9: 0.08437155561, 1.0: 0.08333277779}  #: error / (omega h)^2
DAMPING = {0.0: 0.4998229725, 0.5: 0.01851754137, 0.8: 0.0006859351249, 0.9: 7.289785884e-05}  #: damping ratio / (omega h)^3


@pytest.mark.parametrize("rho_inf", COEFFICIENTS)
def test_coefficients(rho_inf: float) -> None:
    np.testing.assert_allclose(GeneralizedAlpha(1e-3, rho_inf).coefficients, COEFFICIENTS[rho_inf], atol=1e-9)


@pytest.mark.parametrize("rho_inf", GOLDEN)
def test_golden_steps(rho_inf: float) -> None:
    found = integrate(models.mass_pendulum((-1, 0)), GeneralizedAlpha(0.05, rho_inf), 0.5, TIGHT)
    for n, q, v, multiplier in GOLDEN[rho_inf]:
        np.testing.assert_allclose(found.x[n], q, atol=2e-10)
        np.testing.assert_allclose(found.v[n], v, atol=2e-9)
        np.testing.assert_allclose(found.multipliers[n], multiplier, atol=2e-8)


def exact_pendulum(times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (s, 2), v (s, 2) and multiplier (s,) = v.v - g y of the pendulum from START, from theta'' = - g sin theta."""
    (x, y), (vx, vy) = START
    angle = np.arctan2(x, -y)
    rate = vx * np.cos(angle) + vy * np.sin(angle)

    def motion(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -models.GRAVITY * np.sin(state[0])]

    span = (0.0, times[-1] + 1e-9)
    theta, omega = solve_ivp(motion, span, [angle, rate], method="DOP853", rtol=1e-13, atol=1e-13, t_eval=times).y
    q, v = np.stack([np.sin(theta), -np.cos(theta)], 1), omega[:, None] * np.stack([np.cos(theta), np.sin(theta)], 1)
    return q, v, (v**2).sum(axis=1) - models.GRAVITY * q[:, 1]


def pendulum_errors(rho_inf: float, h: float) -> tuple[float, float, float]:
    found = integrate(models.mass_pendulum(*START), GeneralizedAlpha(h, rho_inf), 2.0, Newton(tolerance=1e-12))
    q, v, multiplier = exact_pendulum(found.times)
    late = found.times >= 0.2
    wrong = np.abs(found.multipliers[:, 0] - multiplier)[late].max()
    return float(np.abs(found.x - q).max()), float(np.abs(found.v - v).max()), float(wrong)


@pytest.mark.parametrize("rho_inf,h", ERRORS)
def test_errors_of_the_moving_pendulum(rho_inf: float, h: float) -> None:
    np.testing.assert_allclose(pendulum_errors(rho_inf, h), ERRORS[rho_inf, h], rtol=2e-4)


@pytest.mark.parametrize("rho_inf", [0.8, 0.5])
def test_second_order_in_position_velocity_and_multipliers(rho_inf: float) -> None:
    coarse, fine = np.array(pendulum_errors(rho_inf, 0.0025)), np.array(pendulum_errors(rho_inf, 0.00125))
    np.testing.assert_allclose(np.log2(coarse / fine), 2.0, atol=0.02)


def test_pendulum_of_large_swings() -> None:
    """Position, velocity and tension of the rigid pendulum from the horizontal; exact by elliptic functions."""
    exact = {
        0.5: (-0.391048791551, -0.920369948785, 3.91104800396, -1.66173460755, 27.0864875927),
        1.0: (0.986291751132, -0.165010853126, 0.296905515916, 1.77464364111, 4.85626940748),
        2.0: (-0.793566195343, -0.608483930444, -2.10243787444, 2.74193539301, 17.907682073),
    }

    def error(h: float) -> float:
        found = integrate(models.mass_pendulum((-1, 0)), GeneralizedAlpha(h, 0.9), 2.0, TIGHT)
        states = np.column_stack([found.x, found.v, found.multipliers])
        return max(float(np.abs(states[round(t / h)] - values).max()) for t, values in exact.items())

    coarse, fine = error(1e-3), error(5e-4)
    assert fine < 2e-4
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.02)


def test_spherical_pendulum() -> None:
    """Spatial motion with conserved energy and vertical angular momentum; exact by elliptic functions."""
    exact = {
        0.5: (-0.0799111643573, 0.527284584517, -0.845922675392),
        1.0: (-0.699775404235, -0.492896379466, -0.517075954514),
        1.5: (0.286025501171, -0.518284649141, -0.805959325987),
        2.0: (0.284933682825, 0.773873273722, -0.565626159766),
    }

    def error(h: float) -> tuple[float, Trajectory]:
        pendulum = models.mass_pendulum((np.sqrt(0.75), 0.0, -0.5), (0.0, 2.0, 0.0))
        found = integrate(pendulum, GeneralizedAlpha(h, 0.9), 2.0, TIGHT)
        return max(float(np.abs(found.x[round(t / h)] - values).max()) for t, values in exact.items()), found

    (coarse, _), (fine, found) = error(2e-3), error(1e-3)
    assert fine < 1e-5
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.02)
    spin = found.x[:, 0] * found.v[:, 1] - found.x[:, 1] * found.v[:, 0]
    np.testing.assert_allclose(spin, 1.73205080757, atol=1e-5)
    energy = 0.5 * (found.v**2).sum(axis=1) + models.GRAVITY * found.x[:, 2]
    np.testing.assert_allclose(energy, -2.905, atol=4e-5)


def amplification(rho_inf: float, phase: float) -> np.ndarray:
    """Roots of the recurrence x[n+3] = c2 x[n+2] + c1 x[n+1] + c0 x[n] that the scheme gives for x'' + x = 0 with h = `phase`."""
    mass = assemble([body.point_mass("mass", 1.0, np.array([1.0, 0.0]))])
    oscillator = replace(mass, stiffness=csr_array(np.eye(2)))
    x = integrate(oscillator, GeneralizedAlpha(phase, rho_inf), 8 * phase, TIGHT).x[:, 0]
    rows = np.array([x[k : k + 3][::-1] for k in range(len(x) - 3)])
    return np.roots([1.0, *-np.linalg.lstsq(rows, x[3:], rcond=None)[0]])


@pytest.mark.parametrize("rho_inf", RADIUS)
def test_spectral_radius(rho_inf: float) -> None:
    found = [np.abs(amplification(rho_inf, phase)).max() for phase in (0.1, 1.0, 10.0, 100.0, 1e4)]
    np.testing.assert_allclose(found, RADIUS[rho_inf], atol=3e-9)


@pytest.mark.parametrize("rho_inf", PERIOD)
def test_period_and_damping_of_a_slow_oscillator(rho_inf: float) -> None:
    """Relative period error ~ (omega h)^2, algorithmic damping ratio ~ (omega h)^3."""
    phase = 0.05
    root = max((r for r in amplification(rho_inf, phase) if r.imag > 0.5 * phase), key=abs)
    angle = np.angle(root)
    assert (phase / angle - 1) / phase**2 == pytest.approx(PERIOD[rho_inf], rel=6e-3)
    ratio = -np.log(abs(root)) / angle / phase**3
    assert ratio == pytest.approx(DAMPING.get(rho_inf, 0.0), rel=1e-2, abs=1e-6)


def test_stored_states_are_every_kth_step() -> None:
    scheme, duration = GeneralizedAlpha(1e-3), 0.1
    seen: list[float] = []
    every = integrate(models.mass_pendulum((-1, 0)), scheme, duration)
    tenth = integrate(models.mass_pendulum((-1, 0)), scheme, duration, every=10, progress=seen.append)
    np.testing.assert_array_equal(tenth.times, every.times[::10])
    np.testing.assert_array_equal(tenth.x, every.x[::10])
    np.testing.assert_array_equal(tenth.multipliers, every.multipliers[::10])
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert every.statistics.steps == tenth.statistics.steps == 100


@pytest.mark.parametrize(
    "step,rho_inf,place", [(0.0, 0.8, "step"), (np.nan, 0.8, "step"), (1e-3, 1.2, "rho_inf"), (1e-3, -0.1, "rho_inf")]
)
def test_bad_schemes_are_refused(step: float, rho_inf: float, place: str) -> None:
    with pytest.raises(InputError, match=place):
        GeneralizedAlpha(step, rho_inf)


def test_bad_controls_are_refused() -> None:
    with pytest.raises(InputError, match="tolerance"):
        Newton(tolerance=0.0)
    with pytest.raises(InputError, match="duration"):
        integrate(models.mass_pendulum((-1, 0)), GeneralizedAlpha(1e-3), 1e-4)
