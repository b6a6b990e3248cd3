r"""The time integrator: coefficients, steps of a separate implementation, exact pendulums, linear theory.

Scheme: generalized-alpha for constrained systems, Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202. The golden steps and
the error table were computed by a separate implementation of it; the moving pendulum is theta'' = - g sin theta, to 1e-13.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.sparse import csr_array

from ..bodies import body
from ..dynamics import GeneralizedAlpha, Newton, integrate
from ..dynamics.scheme import method_of
from ..dynamics.stepping import Method
from ..systems import At, Motion, System, assemble, compile_system, compiled, joints, loads, probes
from .beams import GRAVITY
from .registry import Quantity, case, farthest, order, pairs, slope

TIGHT = Newton(tolerance=1e-13)
ARNOLD = "Arnold, Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0"
CHUNG = "Chung, Hulbert, J. Appl. Mech. 60 (1993) 371-375, doi 10.1115/1.2900803"


def mass_pendulum(
    position: Sequence[float], velocity: Sequence[float] = (), *, mass: float = 1.0, gravity: float = GRAVITY
) -> System:
    """Mass point on a massless rigid link to the origin; gravity along the last axis; output `mass`."""
    dim = len(position)
    down = (0.0,) * (dim - 1) + (-gravity,)
    return assemble(
        [body.point_mass("mass", mass, np.asarray(position, dtype=float))],
        [joints.Distance("link", At("mass", "center"), (0.0,) * dim)],
        [loads.Gravity(down)],
        outputs={"mass": probes.Position(At("mass", "center"))},
        initial={"mass": Motion(velocity=tuple(velocity))} if len(velocity) else None,
    )


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


@case("coefficients", group="integrator", source=ARNOLD)
def coefficients() -> list[Quantity]:
    """alpha_m, alpha_f, gamma, beta of spectral radii from 0 to 1."""
    return [
        farthest(f"rho_inf = {rho}", exact, GeneralizedAlpha(1e-3, rho).coefficients, 1e-9) for rho, exact in COEFFICIENTS.items()
    ]


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


@case("golden-steps", group="integrator", source=ARNOLD + " (steps by a separate implementation)")
def golden_steps() -> list[Quantity]:
    """Steps 1, 2, 5 and 10 of a pendulum from the horizontal: position, velocity, multiplier."""
    found = []
    for rho, rows in GOLDEN.items():
        run = integrate(mass_pendulum((-1, 0)), GeneralizedAlpha(0.05, rho), 0.5, TIGHT)
        steps = [n for n, *_ in rows]
        q, v, multiplier = (np.array([row[k] for row in rows]) for k in (1, 2, 3))
        found += [
            farthest(f"q, rho_inf = {rho}", q, run.x[steps], 2e-10, "m"),
            farthest(f"v, rho_inf = {rho}", v, run.v[steps], 2e-9, "m/s"),
            farthest(f"lambda, rho_inf = {rho}", multiplier, run.multipliers[steps, 0], 2e-9, "N"),
        ]
    return found


START = ((0.9053428509, -0.4246814362), (-1.225870002, -2.613329776))  #: position and velocity of the moving pendulum
ERRORS = {  # (rho_inf, h): largest error over 2 s of q, v, of lambda after 0.2 s, and of lambda from the start
    (0.8, 0.04): (0.03625234231, 0.159267775, 6.791507323, 6.791507323),
    (0.8, 0.02): (0.009128679604, 0.04014950697, 1.980302153, 2.083784306),
    (0.8, 0.01): (0.002288672408, 0.01006051212, 0.3571348565, 1.003076647),
    (0.8, 0.005): (0.0005726310119, 0.002517303782, 0.01186733978, 0.4974238273),
    (0.8, 0.0025): (0.0001432078841, 0.000629563796, 0.002967993492, 0.2482277229),
    (0.5, 0.04): (0.04857346649, 0.2139367648, 1.0120006, 1.572204406),
    (0.5, 0.02): (0.01262598878, 0.0556941546, 0.2577687296, 0.7918566087),
    (0.5, 0.01): (0.00320503876, 0.01413758422, 0.0658046351, 0.4026606639),
    (0.5, 0.005): (0.0008070228745, 0.003557351839, 0.01660843738, 0.2028578797),
    (0.5, 0.0025): (0.0002023999412, 0.0008919878465, 0.004170508249, 0.1017931926),
    (0.0, 0.04): (0.126404973, 0.5390742967, 2.181007918, 2.181007918),
    (0.0, 0.02): (0.03809037295, 0.1721815058, 0.7209795646, 1.056592215),
    (0.0, 0.01): (0.01073552189, 0.04801358313, 0.2112290681, 0.5206936376),
    (0.0, 0.005): (0.002828856645, 0.01258585603, 0.05676801058, 0.2583783402),
    (0.0, 0.0025): (0.0007245384781, 0.003214848834, 0.01468464422, 0.1286890676),
}


def exact_pendulum(times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (s, 2), v (s, 2) and multiplier (s,) = v.v - g y of the pendulum from START, from theta'' = - g sin theta."""
    (x, y), (vx, vy) = START
    angle = np.arctan2(x, -y)
    rate = vx * np.cos(angle) + vy * np.sin(angle)

    def motion(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -GRAVITY * np.sin(state[0])]

    span = (0.0, times[-1] + 1e-9)
    theta, omega = solve_ivp(motion, span, [angle, rate], method="DOP853", rtol=1e-13, atol=1e-13, t_eval=times).y
    q, v = np.stack([np.sin(theta), -np.cos(theta)], 1), omega[:, None] * np.stack([np.cos(theta), np.sin(theta)], 1)
    return q, v, (v**2).sum(axis=1) - GRAVITY * q[:, 1]


def pendulum_errors(rho_inf: float, h: float) -> tuple[float, float, float, float]:
    """Largest errors over 2 s of q and v, of the multiplier after 0.2 s, and of the multiplier from the start."""
    found = integrate(mass_pendulum(*START), GeneralizedAlpha(h, rho_inf), 2.0, Newton(tolerance=1e-12))
    q, v, multiplier = exact_pendulum(found.times)
    late = found.times >= 0.2
    wrong = np.abs(found.multipliers[:, 0] - multiplier)
    return float(np.abs(found.x - q).max()), float(np.abs(found.v - v).max()), float(wrong[late].max()), float(wrong.max())


@case("pendulum-errors", group="integrator", source=ARNOLD + " (errors of a separate implementation)")
def moving_pendulum() -> list[Quantity]:
    """Errors of a moving pendulum over 2 s are those of a separate implementation: q, v, multiplier late and from the start."""
    return [
        farthest(f"rho_inf = {rho}, h = {h}", exact, pendulum_errors(rho, h), 2e-4, each=True) for (rho, h), exact in ERRORS.items()
    ]


@case("pendulum-order", group="integrator", source=ARNOLD + ", theorem 1")
def pendulum_order() -> list[Quantity]:
    """Second order in position, velocity and multipliers."""
    found = []
    for rho in (0.8, 0.5):
        steps = (0.0025, 0.00125)
        errors = np.array([pendulum_errors(rho, h) for h in steps])
        found += [
            order(f"{name}, rho_inf = {rho}", steps, errors[:, k], 2.0, 0.01) for k, name in enumerate(("q", "v", "multiplier"))
        ]
    return found


@case(
    "pendulum-first-steps",
    group="integrator",
    source="Arnold, Bruels, Cardona, Numer. Math. 129 (2015) 149-179, doi 10.1007/s00211-014-0633-1",
)
def pendulum_first_steps() -> list[Quantity]:
    """First order in the multipliers of the first steps, where the pendulum starts with a velocity."""
    steps = (0.0025, 0.00125)
    return [order(f"rho_inf = {rho}", steps, [pendulum_errors(rho, h)[3] for h in steps], 1.0, 0.01) for rho in (0.8, 0.5)]


CONDITION = {  # h: condition number of the iteration matrix, as it is and with the equations of motion scaled, rho_inf = 0.8
    1e-2: (1520341407.0, 2.624759384),
    1e-3: (15194127360000.0, 2.624040697),
    1e-4: (1.519403454e17, 2.624033511),
    1e-5: (1.519401779e21, 2.62403344),
}


def bordered(h: float, scale: Callable[[Method], float]) -> np.ndarray:
    """[ scale W  J^T; J  0 ],  W = bh M + K, of the pendulum at (0.9, -0.43) with the multiplier 12."""
    system = mass_pendulum((0.6, -0.8))
    x, model, method = np.array([0.9, -0.43]), compile_system(system), method_of(GeneralizedAlpha(h, 0.8), TIGHT, h, system.scale)
    W = (method.bh * csr_array(system.mass) + compiled.tangent(model, x, np.array([12.0]))).toarray()
    J = compiled.gap(model, x)[1]
    return np.block([[scale(method) * W, J.T], [J, np.zeros((1, 1))]])


def condition(A: np.ndarray) -> float:
    """|A| |A^-1|; the inverse keeps the digits of the smallest singular value."""
    return float(np.linalg.norm(A, 2) * np.linalg.norm(np.linalg.inv(A), 2))


@case(
    "conditioning",
    group="integrator",
    source="Bottasso, Bauchau, Cardona, SIAM J. Sci. Comput. 29 (2007) 397-414, doi 10.1137/050638503 (digits recomputed)",
)
def conditioning() -> list[Quantity]:
    """The iteration matrix of a pendulum as h falls to 1e-5: its condition grows as h^-4, and not at all with c = h^2 beta."""
    plain, scaled = np.array(list(CONDITION.values())).T
    steps = tuple(CONDITION)
    ours = [condition(bordered(h, lambda method: method.c)) for h in steps]
    raw = [condition(bordered(h, lambda method: 1.0)) for h in steps]
    return [
        farthest("unscaled", plain, raw, 2e-6, each=True),  # digits that the reference loses by round-off at h = 1e-5
        farthest("scaled by 1/bh", scaled, [condition(bordered(h, lambda method: 1 / method.bh)) for h in steps], 1e-9),
        Quantity("order of the unscaled matrix", -4.0, slope(pairs(steps, raw)), 1e-4),
        farthest("scaled by c, change over h", np.full(len(ours), ours[-1]), ours, 1e-3),
    ]


RADIUS = {  # rho_inf: spectral radius at omega h = 0.1, 0.5, 1, 2, 5, 10, 100, 1e4
    0.0: (0.9999519177, 0.9842429788, 0.9065633333, 0.7071067812, 0.398989281, 0.242535625, 0.04783128168, 0.002157527397),
    0.5: (0.9999981604, 0.9990113987, 0.989312786, 0.9371323065, 0.7864275521, 0.6825284215, 0.5371736239, 0.5016827188),
    0.8: (0.9999999316, 0.9999601108, 0.999474614, 0.995285863, 0.967909385, 0.9297917672, 0.8346376088, 0.8016748334),
    0.9: (0.9999999927, 0.9999957229, 0.9999422589, 0.9994378369, 0.9947922551, 0.9837630771, 0.928448671, 0.9014511757),
    1.0: (1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
}
PHASES = (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0, 1e4)
PERIOD = {0.0: 0.4582476573, 0.5: 0.1249980809, 0.8: 0.08796235632, 0.9: 0.08437155561, 1.0: 0.08333277779}  #: error / (omega h)^2
DAMPING = {0.0: 0.4998229725, 0.5: 0.01851754137, 0.8: 0.0006859351249, 0.9: 7.289785884e-05}  #: damping ratio / (omega h)^3


def amplification(rho_inf: float, phase: float) -> np.ndarray:
    """Roots of the recurrence x[n+3] = c2 x[n+2] + c1 x[n+1] + c0 x[n] that the scheme gives for x'' + x = 0 with h = `phase`."""
    mass = assemble([body.point_mass("mass", 1.0, np.array([1.0, 0.0]))])
    oscillator = replace(mass, stiffness=csr_array(np.eye(2)))
    x = integrate(oscillator, GeneralizedAlpha(phase, rho_inf), 8 * phase, TIGHT).x[:, 0]
    rows = np.array([x[k : k + 3][::-1] for k in range(len(x) - 3)])
    return np.asarray(np.roots([1.0, *-np.linalg.lstsq(rows, x[3:], rcond=None)[0]]))


@case("spectral-radius", group="integrator", source=CHUNG)
def spectral_radius() -> list[Quantity]:
    """Largest root of the amplification of a linear oscillator, from omega h = 0.1 to 1e4."""
    return [
        farthest(f"rho_inf = {rho}", exact, [np.abs(amplification(rho, phase)).max() for phase in PHASES], 3e-9)
        for rho, exact in RADIUS.items()
    ]


@case("period-and-damping", group="integrator", source=CHUNG)
def period_and_damping() -> list[Quantity]:
    """Relative period error over (omega h)^2 and algorithmic damping ratio over (omega h)^3 at omega h = 0.05."""
    found, phase = [], 0.05
    for rho, period in PERIOD.items():
        root = max((r for r in amplification(rho, phase) if r.imag > 0.5 * phase), key=abs)
        angle = np.angle(root)
        found.append(Quantity(f"period, rho_inf = {rho}", period, float((phase / angle - 1) / phase**2), 6e-3))
        ratio = float(-np.log(abs(root)) / angle / phase**3)
        found.append(Quantity(f"damping, rho_inf = {rho}", DAMPING.get(rho, 0.0), ratio, 1e-2, scale=1e-4))
    return found
