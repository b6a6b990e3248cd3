r"""The time integrator: coefficients, steps of a separate implementation, exact pendulums, linear
theory.

Scheme: generalized-alpha for constrained systems, Arnold and Bruels, Multibody Syst. Dyn. 18 (2007)
185-202, with velocities that put the next q'' onto the joints, (4) of `compiled_step.stepping`. The
golden steps and the error table were computed by a separate implementation of it; the moving
pendulum is theta'' = - g sin theta, to 1e-13.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.sparse import csr_array

from fmbs_skfem.bodies import body
from fmbs_skfem.core.algebra import saddle
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.dynamics.compiled_step.step import Method
from fmbs_skfem.dynamics.scheme import method_of
from fmbs_skfem.systems import At, Motion, System, assemble, compile_system, compiled
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .beams import GRAVITY
from .registry import CheckedNumber, case, farthest, order, pairs, slope

TIGHT = Newton(tolerance=1e-13)
#: factors of every step, whose directions of the joints (4) takes
FRESH = Newton(tolerance=1e-13, slow=1e-12)
ARNOLD = "Arnold, Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0"
CHUNG = "Chung, Hulbert, J. Appl. Mech. 60 (1993) 371-375, doi 10.1115/1.2900803"


def mass_pendulum(
    position: Sequence[float],
    velocity: Sequence[float] = (),
    *,
    mass: float = 1.0,
    gravity: float = GRAVITY,
) -> System:
    """Mass point on a massless rigid link to the origin; gravity along the last axis; output
    `mass`.
    """
    dim = len(position)
    down = (0.0,) * (dim - 1) + (-gravity,)
    return assemble(
        [body.point_mass("mass", mass, np.asarray(position, dtype=float))],
        [joints.RigidLink("link", At("mass", "center"), (0.0,) * dim)],
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
def coefficients() -> list[CheckedNumber]:
    """alpha_m, alpha_f, gamma, beta of spectral radii from 0 to 1."""
    return [
        farthest(f"rho_inf = {rho}", exact, GeneralizedAlpha(1e-3, rho).coefficients, 1e-9)
        for rho, exact in COEFFICIENTS.items()
    ]


GOLDEN = {  # rho_inf: (step, q, v, lambda) of the pendulum L = m = 1 that starts at (-1, 0) at rest, h = 0.05, a0 = q''(0)
    1.0: (
        (1, (-0.999924824, -0.01226157815), (0.006013908468, -0.4904262544), 0.1202906032),
        (2, (-0.9987984036, -0.04900764214), (0.04503059381, -0.9791225097), 1.202323167),
        (5, (-0.9539373851, -0.3000057755), (0.7146480785, -2.311535646), 8.609339349),
        (10, (-0.4016652563, -0.9157865591), (3.843627068, -1.701284226), 26.96311829),
    ),
    0.9: (
        (1, (-0.999924824, -0.01226157815), (0.005371393069, -0.4904341333), 0.1194184963),
        (2, (-0.9987984644, -0.04900640212), (0.04436482194, -0.9791293385), 1.247262227),
        (5, (-0.9539421773, -0.299990537), (0.7140208603, -2.311610363), 8.612912037),
        (10, (-0.4017862338, -0.9157334887), (3.843208725, -1.700828739), 26.93878281),
    ),
    0.8: (
        (1, (-0.999924824, -0.01226157815), (0.004648772597, -0.4904429944), 0.1169224663),
        (2, (-0.9987985373, -0.04900491748), (0.0435574932, -0.9791365669), 1.284094806),
        (5, (-0.9539537347, -0.2999537832), (0.7129516635, -2.311492356), 8.625369183),
        (10, (-0.4022001658, -0.9155517608), (3.840761713, -1.701041757), 26.89333158),
    ),
    0.5: (
        (1, (-0.999924824, -0.01226157815), (0.002151051653, -0.4904736227), 0.1014951964),
        (2, (-0.9987988019, -0.04899952361), (0.04017590939, -0.9791807941), 1.313081418),
        (5, (-0.9540364031, -0.2996907431), (0.7060673934, -2.309858934), 8.645603842),
        (10, (-0.4059977438, -0.9138740789), (3.813390454, -1.708878387), 26.67789637),
    ),
    0.0: (
        (1, (-0.999924824, -0.01226157815), (0.003758615084, -0.49045391), 0.06014530159),
        (2, (-0.9987987418, -0.04900074824), (0.03376983747, -0.9794954003), 0.7514238103),
        (5, (-0.9543582655, -0.2986641945), (0.6708962222, -2.303222389), 8.120622966),
        (10, (-0.4283185624, -0.9036278045), (3.617794652, -1.777102398), 25.86483713),
    ),
}


@case("golden-steps", group="integrator", source=ARNOLD + " (steps by a separate implementation)")
def golden_steps() -> list[CheckedNumber]:
    """Steps 1, 2, 5 and 10 of a pendulum from the horizontal: position, velocity, multiplier."""
    found = []
    for rho, rows in GOLDEN.items():
        run = integrate(mass_pendulum((-1, 0)), GeneralizedAlpha(0.05, rho), 0.5, FRESH)
        steps = [n for n, *_ in rows]
        q, v, multiplier = (np.array([row[k] for row in rows]) for k in (1, 2, 3))
        found += [
            farthest(f"q, rho_inf = {rho}", q, run.x[steps], 2e-10, "m"),
            farthest(f"v, rho_inf = {rho}", v, run.v[steps], 2e-9, "m/s"),
            farthest(f"lambda, rho_inf = {rho}", multiplier, run.multipliers[steps, 0], 2e-9, "N"),
        ]
    return found


#: position and velocity of the moving pendulum
START = (
    (0.9053428509, -0.4246814362),
    (-1.225870002, -2.613329776),
)
ERRORS = {  # (rho_inf, h): largest error over 2 s of q, v, of lambda after 0.2 s, and of lambda from the start
    (0.8, 0.04): (0.03640111696, 0.1597905496, 0.763797264, 0.763797264),
    (0.8, 0.02): (0.009140182877, 0.04039384683, 0.1894393432, 0.1894393432),
    (0.8, 0.01): (0.002289409553, 0.01008800233, 0.0473042189, 0.0473042189),
    (0.8, 0.005): (0.0005726765352, 0.002520557331, 0.01180994694, 0.01180994694),
    (0.8, 0.0025): (0.0001432105806, 0.0006299557252, 0.002950618181, 0.002950618181),
    (0.5, 0.04): (0.04858409881, 0.213103843, 0.955411226, 0.955411226),
    (0.5, 0.02): (0.01262232297, 0.05556617184, 0.2533583772, 0.2533583772),
    (0.5, 0.01): (0.003204495749, 0.01412123865, 0.06495232356, 0.06495232356),
    (0.5, 0.005): (0.0008069524536, 0.003555324499, 0.01642374894, 0.01642374894),
    (0.5, 0.0025): (0.0002023913279, 0.0008917363815, 0.004128807305, 0.004128807305),
    (0.0, 0.04): (0.1289407686, 0.5435145945, 2.119210673, 2.119210673),
    (0.0, 0.02): (0.03800067032, 0.1730217849, 0.7422585158, 0.7422585158),
    (0.0, 0.01): (0.01072540615, 0.04810691384, 0.217378118, 0.217378118),
    (0.0, 0.005): (0.002827353851, 0.01259583415, 0.05835133672, 0.05835133672),
    (0.0, 0.0025): (0.0007243351114, 0.003215979601, 0.01508332375, 0.01508332375),
}


def exact_pendulum(times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (s, 2), v (s, 2) and multiplier (s,) = v.v - g y of the pendulum from START, from theta'' =
    - g sin theta.
    """
    (x, y), (vx, vy) = START
    angle = np.arctan2(x, -y)
    rate = vx * np.cos(angle) + vy * np.sin(angle)

    def motion(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -GRAVITY * np.sin(state[0])]

    span = (0.0, times[-1] + 1e-9)
    theta, omega = solve_ivp(
        motion, span, [angle, rate], method="DOP853", rtol=1e-13, atol=1e-13, t_eval=times
    ).y
    q, v = (
        np.stack([np.sin(theta), -np.cos(theta)], 1),
        omega[:, None] * np.stack([np.cos(theta), np.sin(theta)], 1),
    )
    return q, v, (v**2).sum(axis=1) - GRAVITY * q[:, 1]


def pendulum_errors(rho_inf: float, h: float) -> tuple[float, float, float, float]:
    """Largest errors over 2 s of q and v, of the multiplier after 0.2 s, and of the multiplier from
    the start.
    """
    found = integrate(mass_pendulum(*START), GeneralizedAlpha(h, rho_inf), 2.0, FRESH)
    q, v, multiplier = exact_pendulum(found.times)
    late = found.times >= 0.2
    wrong = np.abs(found.multipliers[:, 0] - multiplier)
    return (
        float(np.abs(found.x - q).max()),
        float(np.abs(found.v - v).max()),
        float(wrong[late].max()),
        float(wrong.max()),
    )


@case(
    "pendulum-errors", group="integrator", source=ARNOLD + " (errors of a separate implementation)"
)
def moving_pendulum() -> list[CheckedNumber]:
    """Errors of a moving pendulum over 2 s are those of a separate implementation: q, v, multiplier
    late and from the start.
    """
    return [
        farthest(f"rho_inf = {rho}, h = {h}", exact, pendulum_errors(rho, h), 2e-4, each=True)
        for (rho, h), exact in ERRORS.items()
    ]


@case("pendulum-order", group="integrator", source=ARNOLD + ", theorem 1")
def pendulum_order() -> list[CheckedNumber]:
    """Second order in position, velocity and multipliers."""
    found = []
    for rho in (0.8, 0.5):
        steps = (0.0025, 0.00125)
        errors = np.array([pendulum_errors(rho, h) for h in steps])
        found += [
            order(f"{name}, rho_inf = {rho}", steps, errors[:, k], 2.0, 0.01)
            for k, name in enumerate(("q", "v", "multiplier"))
        ]
    return found


@case(
    "pendulum-first-steps",
    group="integrator",
    source="Arnold, Bruels, Cardona, Numer. Math. 129 (2015) 149-179, doi 10.1007/s00211-014-0633-1",
)
def pendulum_first_steps() -> list[CheckedNumber]:
    """Second order in the multipliers from the first step on, where the pendulum starts with a
    velocity.
    """
    steps = (0.0025, 0.00125)
    return [
        order(f"rho_inf = {rho}", steps, [pendulum_errors(rho, h)[3] for h in steps], 2.0, 0.01)
        for rho in (0.8, 0.5)
    ]


CONDITION = {  # h: condition number of the iteration matrix, as it is and with the equations of motion scaled, rho_inf = 0.8
    1e-2: (1520341407.0, 2.624759384),
    1e-3: (15194127360000.0, 2.624040697),
    1e-4: (1.519403454e17, 2.624033511),
    1e-5: (1.519401779e21, 2.62403344),
}


def bordered(h: float, scale: Callable[[Method], float]) -> np.ndarray:
    """The saddle point (3, 3) of scale W,  W = bh M + K, of the pendulum at (0.9, -0.43) with the
    multiplier 12.
    """
    system = mass_pendulum((0.6, -0.8))
    x, model = np.array([0.9, -0.43]), compile_system(system)
    method = method_of(GeneralizedAlpha(h, 0.8), TIGHT, h, model)
    W = method.bh * csr_array(system.mass) + compiled.tangent(model, x, np.array([12.0]))
    return as_dense(saddle.matrix(scale(method) * W, compiled.gap(model, x)[1]))


def condition(A: np.ndarray) -> float:
    """|A| |A^-1| of A (n, n); the inverse keeps the digits of the smallest singular value."""
    return float(np.linalg.norm(A, 2) * np.linalg.norm(np.linalg.inv(A), 2))


@case(
    "conditioning",
    group="integrator",
    source="Bottasso, Bauchau, Cardona, SIAM J. Sci. Comput. 29 (2007) 397-414, doi 10.1137/050638503 (digits recomputed)",
)
def conditioning() -> list[CheckedNumber]:
    """The iteration matrix of a pendulum as h falls to 1e-5: its condition grows as h^-4, and not
    at all with c = h^2 beta.
    """
    plain, scaled = np.array(list(CONDITION.values())).T
    steps = tuple(CONDITION)
    ours = [condition(bordered(h, lambda method: method.c)) for h in steps]
    raw = [condition(bordered(h, lambda method: 1.0)) for h in steps]
    return [
        farthest(
            "unscaled", plain, raw, 2e-6, each=True
        ),  # digits that the reference loses by round-off at h = 1e-5
        farthest(
            "scaled by 1/bh",
            scaled,
            [condition(bordered(h, lambda method: 1 / method.bh)) for h in steps],
            1e-9,
        ),
        CheckedNumber("order of the unscaled matrix", -4.0, slope(pairs(steps, raw)), 1e-4),
        farthest("scaled by c, change over h", ours[-1], ours, 1e-3),
    ]


RADIUS = {  # rho_inf: spectral radius at omega h = 0.1, 0.5, 1, 2, 5, 10, 100, 1e4
    0.0: (
        0.9999519177,
        0.9842429788,
        0.9065633333,
        0.7071067812,
        0.398989281,
        0.242535625,
        0.04783128168,
        0.002157527397,
    ),
    0.5: (
        0.9999981604,
        0.9990113987,
        0.989312786,
        0.9371323065,
        0.7864275521,
        0.6825284215,
        0.5371736239,
        0.5016827188,
    ),
    0.8: (
        0.9999999316,
        0.9999601108,
        0.999474614,
        0.995285863,
        0.967909385,
        0.9297917672,
        0.8346376088,
        0.8016748334,
    ),
    0.9: (
        0.9999999927,
        0.9999957229,
        0.9999422589,
        0.9994378369,
        0.9947922551,
        0.9837630771,
        0.928448671,
        0.9014511757,
    ),
    1.0: (1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
}
PHASES = (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0, 1e4)
#: error / (omega h)^2
PERIOD = {
    0.0: 0.4582476573,
    0.5: 0.1249980809,
    0.8: 0.08796235632,
    0.9: 0.08437155561,
    1.0: 0.08333277779,
}
#: damping ratio / (omega h)^3
DAMPING = {
    0.0: 0.4998229725,
    0.5: 0.01851754137,
    0.8: 0.0006859351249,
    0.9: 7.289785884e-05,
}


def amplification(rho_inf: float, phase: float) -> np.ndarray:
    """Roots (3,) of the recurrence x[n+3] = c2 x[n+2] + c1 x[n+1] + c0 x[n] that the scheme gives
    x'' + x = 0 with h = `phase`.
    """
    mass = assemble([body.point_mass("mass", 1.0, np.array([1.0, 0.0]))])
    oscillator = replace(mass, stiffness=csr_array(np.eye(2)))
    x = integrate(oscillator, GeneralizedAlpha(phase, rho_inf), 8 * phase, TIGHT).x[:, 0]
    rows = np.array([x[k : k + 3][::-1] for k in range(len(x) - 3)])
    return np.asarray(np.roots([1.0, *-np.linalg.lstsq(rows, x[3:], rcond=None)[0]]))


@case("spectral-radius", group="integrator", source=CHUNG)
def spectral_radius() -> list[CheckedNumber]:
    """Largest root of the amplification of a linear oscillator, from omega h = 0.1 to 1e4."""
    return [
        farthest(
            f"rho_inf = {rho}",
            exact,
            [np.abs(amplification(rho, phase)).max() for phase in PHASES],
            3e-9,
        )
        for rho, exact in RADIUS.items()
    ]


@case("period-and-damping", group="integrator", source=CHUNG)
def period_and_damping() -> list[CheckedNumber]:
    """Relative period error over (omega h)^2 and algorithmic damping ratio over (omega h)^3 at
    omega h = 0.05.
    """
    found, phase = [], 0.05
    for rho, period in PERIOD.items():
        root = max((r for r in amplification(rho, phase) if r.imag > 0.5 * phase), key=abs)
        angle = np.angle(root)
        found.append(
            CheckedNumber(
                f"period, rho_inf = {rho}", period, float((phase / angle - 1) / phase**2), 6e-3
            )
        )
        ratio = float(-np.log(abs(root)) / angle / phase**3)
        found.append(
            CheckedNumber(
                f"damping, rho_inf = {rho}", DAMPING.get(rho, 0.0), ratio, 1e-2, scale=1e-4
            )
        )
    return found
