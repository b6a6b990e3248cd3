r"""From an error indicator to a predicted error, calibrated at the full runs that exist anyway.

    log10 e = a + b (log10 I - m) +- t_(k-p) s sqrt(1 + 1/k + (log10 I - m)^2 / S),   m = mean log10 I,   S = sum (log10 I - m)^2

e is the true error in any measure that follows the indicator, of outputs or of displacements, I the
indicator (49), k the pairs (I, e), p the constants fitted. The slope b is 1 where an indicator is
proportional to the error; it is fitted, within SLOPES, from three pairs on where they span SPAN
decades, and is 1 otherwise. The band is that of Student's t for one further observation. With few
pairs their own scatter says little: s^2 joins it to a scatter of PRIOR decades that counts as
BELIEF pairs, and the degrees of freedom are k - p + BELIEF. A slope that is not fitted is known to
SLOPE only, a standard deviation from which SLOPES are two away: S = (s / SLOPE)^2, so that the band
of one full run opens where the indicator is far from the one at which it was calibrated.

Source: regression and its prediction band: N. R. Draper, H. Smith, Applied Regression Analysis, 3rd
ed., Wiley 1998, section 1.4, doi 10.1002/9781118625590; error and indicator: Hou, Liu, Hu, CMAME
361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InputError, say
from ..core.storage.records import dataclass

#: a fitted slope beyond these is cut: it comes from scatter, not from the indicator
SLOPES = (
    0.5,
    1.5,
)
SLOPE = 0.25  #: standard deviation of a slope that is not fitted
SPAN = 1.0  #: least range of log10 I over which a slope is fitted [decades]
#: scatter of log10 e about the line that is expected before any pair is seen [decades]
PRIOR = 0.25
BELIEF = 3  #: pairs that this expectation is worth
NARROWEST = 0.1  #: half the width of the narrowest band [decades]
LEVEL = 0.95  #: part of further errors that the band is to hold; the scatter is not exactly normal
FEW = 3  #: pairs below which no slope is fitted and the band is wide


@dataclass(frozen=True)
class Calibration:
    """log10 e = offset + slope log10 I, with what its band needs.

    Half the width of its band is, 0.1 decades at least,

        t s sqrt(1 + 1/count + (log10 I - centre)^2 / moment),    t of Student's distribution with `freedom` degrees, at `level`

    Source: Draper and Smith 1998, section 1.4, doi 10.1002/9781118625590.
    """

    slope: float
    offset: float  #: [decades]
    spread: float  #: s, standard deviation of log10 e about the line [decades]
    count: int  #: pairs
    freedom: int  #: degrees of freedom of the band
    centre: float  #: m, mean of log10 I
    moment: float  #: S, sum of squares of log10 I about m, or what stands for it where the slope is not fitted
    level: float = LEVEL

    @property
    def wide(self) -> bool:
        """Whether there are so few pairs that the band is mostly an expectation."""
        return self.count < FEW


class Prediction(NamedTuple):
    """A predicted error, in the measure of the training, and the ends of its band; NaN where
    nothing can be said.

        low <= error <= high

    A 95 % band, unless the calibration has another `level`.
    """

    error: float
    low: float
    high: float


NOTHING = Prediction(math.nan, math.nan, math.nan)


def fit(indicators: ArrayLike, errors: ArrayLike, level: float = LEVEL) -> Calibration:
    """Regression of errors e on indicators I over pairs (k,); those that are not finite and
    positive, as of failed runs, are left out.

        log10 e = a + b (log10 I - m)

    `level` is the part of further errors that the band is to hold. InputError without a usable
    pair, or for arrays of other shapes.
    """
    i, e = np.asarray(indicators, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if i.shape != e.shape or i.ndim != 1:
        raise InputError(
            say(
                "calibration.fit", "as many errors as indicators", f"shapes {i.shape} and {e.shape}"
            )
        )
    if not 0.0 < level < 1.0:
        raise InputError(say("calibration.fit: level", "a part between 0 and 1", level))
    usable = np.isfinite(i) & np.isfinite(e) & (i > 0.0) & (e > 0.0)
    if not np.any(usable):
        remedy = "compare one reduced run with a full run"
        raise InputError(
            say(
                "calibration.fit",
                "a pair of positive indicator and error",
                f"{len(i)} pairs",
                remedy,
            )
        )
    x, y = np.log10(i[usable]), np.log10(e[usable])
    count = len(x)
    centre = float(x.mean())
    fitted = count >= FEW and float(np.ptp(x)) >= SPAN
    squares = float(np.sum((x - centre) ** 2))
    slope = float(np.clip((x - centre) @ y / squares, *SLOPES)) if fitted else 1.0
    offset = float(y.mean()) - slope * centre
    freedom = count - (2 if fitted else 1) + BELIEF
    scatter = float(np.sum((y - offset - slope * x) ** 2))
    spread = math.sqrt((scatter + BELIEF * PRIOR**2) / freedom)
    moment = squares if fitted else (spread / SLOPE) ** 2
    return Calibration(slope, offset, spread, count, freedom, centre, moment, level)


def half_width(calibration: Calibration, indicator: float) -> float:
    """Half the width of the band at an indicator [decades].

        t s sqrt(1 + 1 / k + (log10 I - m)^2 / moment)

    with Student's t of the level, the spread s and the number k of pairs, at least 0.1 decades;
    `indicator` I is positive and finite.
    """
    from scipy.special import stdtrit

    away = (math.log10(indicator) - calibration.centre) ** 2 / calibration.moment
    factor = float(stdtrit(calibration.freedom, 0.5 * (1.0 + calibration.level)))
    return max(
        NARROWEST, factor * calibration.spread * math.sqrt(1.0 + 1.0 / calibration.count + away)
    )


def predict(calibration: Calibration, indicator: float) -> Prediction:
    """Predicted error and the ends of its band, in the unit of the errors that calibrated.

        10^(a + b (log10 I - m))

    All are infinite for the infinite indicator of a failed run, and 0 for 0. InputError for NaN or
    a negative indicator.
    """
    if math.isnan(indicator) or indicator < 0.0:
        raise InputError(say("calibration.predict", "an indicator that is not negative", indicator))
    if indicator == 0.0 or math.isinf(indicator):
        return Prediction(indicator, indicator, indicator)
    middle = calibration.offset + calibration.slope * math.log10(indicator)
    half = half_width(calibration, indicator)
    return Prediction(10.0**middle, 10.0 ** (middle - half), 10.0 ** (middle + half))
