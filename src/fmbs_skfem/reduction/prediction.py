r"""The error that a saved parametric model predicts for itself within its trained ranges, without the full model.

    log10 I(mu) ~ m(mu) +- 2 s(mu)     surrogate of the indicator (49) of the reduced runs of the last iteration; s of a further one
    log10 e(mu) = calibration of m(mu),  its band widened by that of the surrogate:  d^2 = d_calibration^2 + d_surrogate^2

e is the error in the measure of the training: of the outputs, or of the displacements. Both bands hold about 95 % each.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, equation (49), doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import CorruptFile, say
from . import calibration, kriging
from . import parameters as boxes
from .product import Product

if TYPE_CHECKING:
    from .campaign import Campaign

KEY = "prediction"  #: of the record in the notes of a model
DOUBTS = "doubts"  #: in the notes of a model, why its training cannot promise the prediction
BAND = 2.0  #: standard deviations of the surrogate
FEWEST = 2  #: indicators away from full runs that are enough


@dataclass(frozen=True)
class Prediction:
    """A predicted error, in the measure of the training, and its band; NaN where nothing can be said."""

    error: float
    low: float
    high: float


Predictor = Callable[[Mapping[str, float]], Prediction]


def record(campaign: Campaign) -> dict[str, Any]:
    """What the prediction of a trained model needs, for its notes.

    Indicators at full runs are left out where others are enough: they dip to what truncation leaves.
    """
    last, runs = campaign.last, set(campaign.outcome.points)
    away = [k for k, point in enumerate(last.samples) if point not in runs]
    chosen = away if len(away) >= FEWEST else list(range(len(last.samples)))
    points = campaign.search.candidates[[last.samples[k] for k in chosen]]
    return {
        "samples": boxes.to_box(campaign.setting.parameters, points),
        "indicators": np.array([last.indicators[k] for k in chosen]),
        "pairs": np.array([(pair.indicator, pair.error) for pair in campaign.pairs]).reshape(-1, 2),
    }


def predictor(product: Product) -> Predictor | None:
    """The prediction of a model as a function of parameters; None where its notes have no record of a training."""
    known = trained(product)
    return None if known is None else functools.partial(predict, product, *known)


def surrogate_of(product: Product) -> kriging.Surrogate | None:
    """The surrogate of the indicator (49) over the unit box of the trained ranges; None without a record of a training."""
    known = trained(product)
    return None if known is None else known[0]


def trained(product: Product) -> tuple[kriging.Surrogate, calibration.Calibration] | None:
    """Surrogate and calibration of the record in the notes; None where there is none."""
    if KEY not in product.notes:
        return None
    try:
        samples, indicators, pairs = (np.asarray(product.notes[KEY][name], float) for name in ("samples", "indicators", "pairs"))
        return kriging.fit(samples, indicators), calibration.fit(pairs[:, 0], pairs[:, 1])
    except (LookupError, TypeError, ValueError) as problem:
        raise CorruptFile(
            say("record of the training", "samples, indicators and pairs", problem, "train the model anew")
        ) from problem


def predict(
    product: Product, surrogate: kriging.Surrogate, calibrated: calibration.Calibration, values: Mapping[str, float]
) -> Prediction:
    """The predicted error at values of the parameters, nominal where none is given; NaN outside of the trained ranges."""
    known = product.model.parameters
    whole = boxes.completed(known, values)
    if boxes.outside(known, whole):
        return Prediction(math.nan, math.nan, math.nan)
    point = boxes.to_box(known, [boxes.row_of(known, whole)])
    mean, std = float(kriging.predict(surrogate, point)[0][0]), float(kriging.deviation(surrogate, point)[0])
    error, low, high = calibration.predict(calibrated, 10.0**mean)
    wide = [calibration.predict(calibrated, 10.0 ** (mean + sign * BAND * std))[0] for sign in (-1.0, 1.0)]
    down, up = (
        math.hypot(math.log10(end / error), math.log10(other / error)) for end, other in zip((low, high), wide, strict=True)
    )
    return Prediction(error, error * 10.0**-down, error * 10.0**up)


def predicted_error(product: Product, **values: float) -> Prediction | None:
    """The predicted error at values of the parameters, nominal where none is given.

    NaN outside of the trained ranges; None for a model without a record of a training.
    """
    found = predictor(product)
    return None if found is None else found(values)
