"""What a run is asked for: the method with its step, and the control of Newton's iteration.

Source: Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0.
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from ..core.algebra import pardiso
from ..core.algebra.linalg import is_sparse
from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..systems.compiled import Compiled
from ..systems.lengths import DIGITS
from ..systems.system import System
from ..systems.terms import elastic as terms
from .compiled_step.step import LEAST, Method

LEAST_STEP = 1e-100  #: [s], whose square is a number
WHOLE = 1e-6  #: part of a duration by which whole steps may miss it: round-off
# double pendulums, full and in 30 modes, in steps of 0.05 to 1 ms: two corrections leave less, so
# that half, twice and none of it take the same
SHARP = 0.03  #: part of the method's own error in q'' that the iteration may leave
# BRISK, 2004 corrections and 185 factorisations of a double pendulum (20 cells, 1000 steps of 0.5
# ms): half 2000 and 269, twice 2182 and 211, in equal time. LAZY, 255 and 33 in 30 modes (50 steps
# of 4 ms): half 211 and 45, twice 305 and 19; a crank-slider of full size has one factorisation
# with any
#: contractions above which new factors pay, where they cost little and much
BRISK, LAZY = (
    0.005,
    0.05,
)
# below it a sharper iteration is bought: steps of a double pendulum take 16 us with BRISK and 12 us
# with LAZY in 12 unknowns, 37 and 27 in 24, 70 and 45 in 40
FEW = 24  #: unknowns of reduced models whose factors cost little
# 2e-12 leaves 2.9e-8 of the motion of a reduced double pendulum over 3 s; half of it 1.3e-8, 50
# times of it 7e-7. Positions then are within 1 % of the error of the step in all verification cases
#: default tolerances: errors of steps add up, those of equilibria do not
DYNAMIC, STATIC = (
    2e-12,
    1e-10,
)
# the spectral radius of guess, iteration and step is 1 + 6e-6 at most with it, 1 + 1e-4 with twice
# and 1.02 with three times of it, for rho_inf from 0 to 0.95; with four times of it single spin-ups
# (8 cells, 4500 to 4800 steps) err by 2e-7 to 8e-6 m for 1e-11
SHARE = 0.0055  #: part of the error of a guess that an iteration may leave, over (1 - rho_inf)^2
#: parts of a step up to which a touch is resolved the better the shorter the step is
FALLING = 16.0
OF_LENGTH = "h", "bh", "gh", "c", "sharp"  #: numbers of a method that `coefficients` gives
# each may begin by itself, in a step that ends there: many that do so in every step would cost more
# than they are worth
FEW_PLACES = 16  #: places that may touch, in whose impacts errors fall with the step
Solver: TypeAlias = Literal["own", "pardiso"]
Start: TypeAlias = Literal["reference", "equilibrium"]  #: where a motion does so


@storable
@dataclass(frozen=True)
@checked
class GeneralizedAlpha:
    """Generalised-alpha method with the step h [s], and the spectral radius rho_inf at infinite
    frequency, 0 (asymptotic annihilation) to 1 (no damping).

        M q1'' + f1 - Q1 + Phi_q^T lambda1 = 0,    Phi(q1, t1) = 0
        (1 - alpha_m) a1 + alpha_m a0 = (1 - alpha_f) q1'' + alpha_f q0''
        q1 = q0 + h v0 + h^2 ((1/2 - beta) a0 + beta a1),    v1 = v0 + h ((1 - gamma) a0 + gamma a1)

    A scheme of one's own is a frozen dataclass with this base and its own `coefficients`, all that
    a step reads of it.

    Motions start in the reference, or in the equilibrium of the loads at t = 0, see `rest`. With a
    `local_error` a step is taken in 1, 2, 4, ... or 32 parts, as few as keep its error below that,
    see `compiled_step.parts`.

        >>> from fmbs_skfem.dynamics import GeneralizedAlpha
        >>> GeneralizedAlpha(1e-3, rho_inf=1.0).coefficients  # alpha_m, alpha_f, gamma, beta
        (0.5, 0.5, 0.5, 0.25)
    """

    step: float
    rho_inf: float = 0.8
    start: Start = "reference"
    local_error: float = 0.0  #: of a step over the size of the mechanism, from which it is taken in parts; 0 for equal steps

    def __init_subclass__(cls, **more: Any) -> None:
        """Files hold schemes of one's own, too: whoever loads one imports its class first."""
        super().__init_subclass__(**more)
        storable(cls)

    def __post_init__(self) -> None:
        if not LEAST_STEP <= self.step <= 1.0 / LEAST_STEP:
            raise InputError(
                say("analysis.step", f"a positive time [s], {LEAST_STEP:g} at least", self.step)
            )
        if not 0 <= self.rho_inf <= 1:
            raise InputError(say("analysis.rho_inf", "a number between 0 and 1", self.rho_inf))
        if not 0 <= self.local_error < 1:
            raise InputError(
                say("analysis.local_error", "a number between 0 and 1", self.local_error)
            )
        if self.start not in get_args(Start):
            raise InputError(say("analysis.start", " or ".join(get_args(Start)), self.start))
        found: Any = self.coefficients  # of one's own may be anything
        four = (
            isinstance(found, tuple)
            and len(found) == 4
            and all(isinstance(one, int | float) for one in found)
        )
        if not (four and np.isfinite(found).all() and max(found[:2]) < 1 and min(found[2:]) > 0):
            expected = "four finite numbers alpha_m < 1, alpha_f < 1, gamma > 0, beta > 0"
            raise InputError(say(f"class {type(self).__qualname__}.coefficients", expected, found))

    @property
    def coefficients(self) -> tuple[float, float, float, float]:
        """alpha_m, alpha_f, gamma, beta of Arnold and Bruels.

            alpha_m = (2 rho - 1) / (rho + 1),    alpha_f = rho / (rho + 1)
            gamma = 1/2 + alpha_f - alpha_m,    beta = (gamma + 1/2)^2 / 4

        with rho = `rho_inf`.
        """
        rho = self.rho_inf
        am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + af - am
        return am, af, gamma, (gamma + 0.5) ** 2 / 4


@storable
@dataclass(frozen=True)
@checked
class Newton:
    """Iteration control; the tolerance is an error of the positions, root mean square, relative to
    the size of the mechanism.

    A correction d (n,) ends the iteration where

        |d|_M <= tolerance L,    |d|_M = sqrt(d^T W d / w)

    with the size L of the mechanism [m], the metric W and the mass w. InputError for a tolerance
    outside of 0 to 0.01 and an unknown solver, MissingFeature for `pardiso` where the extra is not
    installed.
    """

    tolerance: float = DYNAMIC
    iterations: int = 25
    #: contraction above which the iteration matrix is factored anew; by the cost of its factors
    slow: float | None = None
    solver: Solver = "own"  #: of large models: factors or multigrid of this package, or PARDISO (the extra `pardiso`)

    def __post_init__(self) -> None:
        if self.solver not in get_args(Solver):
            raise InputError(say("newton.solver", " or ".join(get_args(Solver)), self.solver))
        if self.solver == "pardiso":
            pardiso.require()
        if not 0 < self.tolerance < 1e-2:
            raise InputError(say("newton.tolerance", "a number between 0 and 0.01", self.tolerance))
        if self.iterations < 1 or (self.slow is not None and not self.slow >= 0):
            got = f"{self.iterations} and {self.slow}"
            raise InputError(
                say(
                    "newton: iterations and slow",
                    "1 or more, and a contraction that is not negative",
                    got,
                )
            )


def steps_in(scheme: GeneralizedAlpha, duration: float) -> int:
    """The number of steps of a run over `duration` [s], the nearest one; a notice where that is
    another duration.

    InputError for a duration of less than half a step, and one without an end.
    """
    if not 0.5 < duration / scheme.step < np.inf:
        raise InputError(
            say(
                "analysis.duration",
                f"at least one step of {scheme.step} s, and an end",
                f"{duration} s",
            )
        )
    steps = round(duration / scheme.step)
    if abs(steps * scheme.step - duration) > WHOLE * duration:
        end = f"{steps} steps of {scheme.step:.6g} s end at {steps * scheme.step:.6g} s"
        notify(
            f"the duration of {duration:.6g} s is no whole number of steps: {end}; choose a step that divides it"
        )
    return steps


def has_dear_factors(model: Compiled) -> bool:
    """Whether factors cost ten corrections or more: of reduced models and parts with more than FEW
    unknowns, and of large ones.

    Velocities settle on the joints along directions that follow from the factors: full models take
    those of newer ones.
    """
    return model.pattern is not None or are_factors_dear(model.system, model.arrays.dense)


def are_factors_dear(system: System, dense: bool) -> bool:
    """The same of a system that is no large one."""
    full = is_sparse(system.lift.matrix) and any(
        terms.numbers_read(one.gather) > 0.0 for one in system.elastic
    )
    return not full and (dense or len(system.elastic) > 0) and system.size > FEW


def method_of(scheme: GeneralizedAlpha, newton: Newton, h: float, model: Compiled) -> Method:
    """Coefficients of a step h [s], and the tolerance of the iteration in metres.

    Where factors cost as much as a few corrections, new ones at a contraction of BRISK pay: what
    two corrections leave is then far below the tolerance. Where they cost ten, those of reduced and
    of large models, LAZY is faster.
    """
    method = method_for(scheme, newton, h, model.system, model.arrays.dense)
    if touches_in_few_places(model):
        method = method._replace(allowed=float(allowed_change(h, h)), locating=True)
    if model.pattern is None:
        return method
    return method._replace(trusting=True, slow=LAZY if newton.slow is None else newton.slow)


def touches_in_few_places(model: Compiled) -> bool:
    """Whether forces that begin and end are few, at single places: ropes, stops, and contacts of
    single points.
    """
    places = [one.places for one in model.forces if one.routines.judge is not None]
    return len(places) > 0 and all(place > 0 for place in places) and sum(places) <= FEW_PLACES


def method_for(
    scheme: GeneralizedAlpha, newton: Newton, h: float, system: System, dense: bool
) -> Method:
    """The same of a system that is no large one."""
    slow = (
        newton.slow
        if newton.slow is not None
        else LAZY
        if are_factors_dear(system, dense)
        else BRISK
    )
    am, af, gamma, beta = scheme.coefficients
    control = newton.tolerance * system.scale, newton.iterations, slow, round_off(system)
    left = 0.0, largest_share(scheme), DYNAMIC * system.scale
    whole = False, scheme.local_error * system.scale
    touching = 1.0, False
    return of_length(
        Method(
            0.0, am, af, gamma, beta, 0.0, 0.0, 0.0, *control, *left, True, True, *whole, *touching
        ),
        h,
    )


def largest_share(scheme: GeneralizedAlpha) -> float:
    """Part of the error of the guess of q'' that an iteration may leave without growing from step
    to step.

        0.0055 (1 - rho_inf)^2,    rho_inf the spectral radius of the scheme at infinite frequency

    With a part k left, a step takes an oscillator of frequency w from (q, v, a, q'', and two
    earlier q'') to

        q1'' = e + k (g - e),    e = - w^2 q1 of a step solved exactly,    g constant, linear or quadratic extrapolation of q'',

    a map with a spectral radius above 1 for larger k of either sign, the more so where the scheme
    itself damps little.
    """
    _, af, gamma, beta = scheme.coefficients
    # q stays 0 where the frequency is infinite: what is left of (v, a), and q'' by its own
    # recursion
    limit = np.array(
        [[1 - gamma / beta, 1 - gamma - gamma * (0.5 - beta) / beta], [-1 / beta, 1 - 0.5 / beta]]
    )
    radius = max(float(np.abs(np.linalg.eigvals(limit)).max()), abs(af / (1 - af)))
    return SHARE * max(0.0, 1.0 - radius) ** 2


def allowed_change(h: Any, whole: float) -> Any:
    """Change of speed by forces that begin or end in a step h [s], over the one that they allow, in
    a run with steps H [s].

        min(1, max(1 / 2048, (H / 16 h)^4))

    A vibration of frequency w on what is touched is resolved by min(r, r^(1/3) (w H / 16)^(2/3))
    rad a step, r the resolution, so that its error falls with H, faster than H: lengths are powers
    of two, and with H itself every second one could be as long as the one before. What is below 1 /
    2048, 0.001 rad, stands.
    """
    return np.clip((whole / (FALLING * h)) ** 4, LEAST, 1.0)


def coefficients(method: Method, h: Any) -> tuple[Any, Any, Any, Any, Any]:
    """What depends on the step h [s], or on several (t,), as OF_LENGTH names it."""
    c = h**2 * method.beta
    bh = (1 - method.am) / (c * (1 - method.af))
    gh = method.gamma / (h * method.beta)
    return h, bh, gh, c, SHARP * c


def of_length(method: Method, h: Any) -> Method:
    """The method with the coefficients of another step h [s], or of several (t,)."""
    return method._replace(**dict(zip(OF_LENGTH, coefficients(method, h), strict=True)))


def round_off(system: System) -> float:
    """Round-off of positions, which grows with the distance from the origin [m].

        DIGITS max(|r|, L)

    with the positions r of the reference and the size L of the system.
    """
    places = system.lift(system.x0).reshape(-1, system.dim)[system.unit != 0.0]
    return DIGITS * max(float(np.abs(places).max(initial=0.0)), system.scale)


@checked
def acceleration_noise(scheme: GeneralizedAlpha, system: System) -> float:
    """Noise of q'', and over the mass of reactions, that the round-off d of positions makes, root
    mean square [m/s2].

        d / (beta h^2)

    Velocities that settle on the joints after every step do not carry it on.
    """
    return round_off(system) / (scheme.step**2 * scheme.coefficients[3])
