r"""The law of contact between two material points: a penalty with damping along the normal, Coulomb
friction with a bristle across.

    N = k d (ramp(s) / d)^p (1 + lambda s') + c touch(s) s',    s' = - n . v,    never negative    (`one_sided`; Hunt, Crossley)
    T = - kt b - ct v_T,    |T| <= mu N

Spheres of Hertz have p = 3/2 and k d^(1 - p) = 4/3 E* sqrt(R): k = 4/3 E* R with d = R.

The bristle b is elastic and perfectly plastic: where kt |b| is more than mu N it is cut to that,
and so is T (a return mapping of plasticity). Forces are continuous, which Newton's iteration needs.
What sticks never creeps. All numbers may be complex.

Sources: Johnson, Contact Mechanics, Cambridge University Press 1985, doi 10.1017/CBO9781139171731,
(4.23); Hunt and Crossley, J. Appl. Mech. 42 (1975) 440-445, doi 10.1115/1.3423596; Giannakopoulos,
Comput. Struct. 32 (1989) 157-167, doi 10.1016/0045-7949(89)90080-4 (return mapping of friction);
Squire and Trapp, SIAM Rev. 40 (1998) 110-112, doi 10.1137/S003614459631241X (complex step).
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from ..core.compiling.jit import jit
from ..core.storage.validation import require
from ..systems.forces.one_sided import closing, keeps, kept, lift, ramp, touch

Scalar: TypeAlias = Any  #: a real or a complex number
# no difference is taken, so that nothing cancels: all from 1e-8 down give the same digits, as
# squares of it are lost
STEP = 1e-30  #: of complex derivatives
BEFORE = 1.0  #: how long points that touch at the start are taken to have moved as they do [s]
# below zero, which no normal force is: one number says both
UNKNOWN = -1.0  #: normal force of a point whose last state is not known
LAW = (
    "stiffness",
    "damping",
    "dissipation",
    "smoothing",
    "cut",
    "friction",
    "sticking",
    "sticking_damping",
)
POWER = ("exponent", "depth")  #: p and d [m], which stand behind
K, C, LAMBDA, E, CUT, MU, KT, CT, P, D = range(len(LAW) + len(POWER))


def require_law(law: np.ndarray, power: np.ndarray, name: str) -> None:
    """Refuse numbers of the law that compiled code would read without looking."""
    require(len(law) == len(LAW), f"{name}.law", f"{len(LAW)} numbers", len(law))
    sound = len(power) == len(POWER) and power[0] >= 1.0 and power[1] > 0.0
    require(sound, f"{name}.power", "an exponent from 1 on, and a depth", power)


@jit
def carried(x: Scalar, value: float, slope: float) -> Scalar:
    """A function of x, real or complex, with a value and a slope at its real part.

        value + slope (x - Re x)

    Branches of one-sided laws are taken once so.
    """
    # a function of the real part by its derivative: branches of one-sided laws are then taken once
    return value + slope * (x - x.real)


@jit
def normal_force(law: np.ndarray, s: Scalar, rate: Scalar) -> Scalar:
    """Normal force [N] of an overlap s [m] and its rate s' [m/s].

        N = k d (ramp(s) / d)^p (1 + lambda s') + c touch(s) s'

    and 0 below zero where the law is `cut`.
    """
    # over a transition e the slope begins at zero: Newton's iteration then meets no jump of
    # stiffness
    r = ramp(s.real, law[E])
    slope = touch(s.real, law[E])
    if law[P] != 1.0:
        slope *= law[P] * (r / law[D]) ** (law[P] - 1.0)
    soft = carried(s, harden(law, r), slope)
    hard = carried(s, touch(s.real, law[E]), closing(s.real, law[E]))
    N = law[K] * soft * (1.0 + law[LAMBDA] * rate) + law[C] * hard * rate
    return carried(N, kept(N.real, law[CUT]), keeps(N.real, law[CUT]))


@jit
def harden(law: np.ndarray, r: float) -> float:
    """d (r / d)^p."""
    return r if law[P] == 1.0 else law[D] * (r / law[D]) ** law[P]


@jit
def stored(law: np.ndarray, s: float) -> float:
    """Energy of an overlap s [m] without damping [J].

        int_0^s k d (ramp(x) / d)^p dx

    with k, d and p of the law.
    """
    p, e = law[P], law[E]
    if p == 1.0:
        return law[K] * lift(s, e)
    r = ramp(s, e)
    scale = law[K] * law[D] ** (1.0 - p)
    if s < e:
        return scale * s * r**p / (2.0 * p + 1.0)
    return scale * (
        r ** (p + 1.0) / (p + 1.0)
        + (0.5 * e) ** (p + 1.0) * (2.0 / (2.0 * p + 1.0) - 1.0 / (p + 1.0))
    )


@jit
def size(x: np.ndarray, dim: int) -> Scalar:
    """|x|; 0 with a derivative of 0 at 0."""
    square = 0.0 * x[0]
    for c in range(dim):
        square += x[c] * x[c]
    # a root has no derivative at zero: what does not slide has none to give
    return np.sqrt(square) if square.real > 0.0 else 0.0 * x[0]


@jit
def resist(
    law: np.ndarray, N: Scalar, b: np.ndarray, v: np.ndarray, T: np.ndarray, dim: int
) -> None:
    """Friction T (c,) [N] of a bristle b [m] and a speed v [m/s], both across the normal, under the
    normal force N.

        T = - kt b - ct v,    |T| <= mu N

    b is cut where its spring alone exceeds mu N.
    """
    most, pull = law[MU] * N, law[KT] * size(b, dim)
    # cut twice: the spring at mu N, then spring and damper together, so that T never exceeds it and
    # is continuous
    slides = pull.real > most.real
    for c in range(dim):
        if slides:
            b[c] *= most / pull
        T[c] = -law[KT] * b[c] - law[CT] * v[c]
    total = size(T, dim)
    if total.real > most.real:
        for c in range(dim):
            T[c] *= most / total
