r"""The error that a saved parametric model predicts for itself within its trained ranges, without
the full model.

    log10 I(mu) ~ m(mu) +- 2 s(mu)     surrogate of the indicator (49) of the reduced runs of the last iteration; s of a further one
    log10 e(mu) = calibration of m(mu),  its band widened by that of the surrogate:  d^2 = d_calibration^2 + d_surrogate^2

e is the error in the measure of the training: of the outputs, or of the displacements. Both bands
hold about 95 % each. What speaks against promising it, in words (`doubts`):

    one full run                   nothing shows how the error depends on the parameters
    high > WIDE low                indicator and error do not go together, or nothing shows how they do
    hold-out e(mu) > high(mu)      the band has been seen to fail
    high > tolerance, e > tolerance, e >= 1,  no full motion
    a step too large for a full motion    what the models follow depends on the numbers of Newton's iteration

A band of 95 % is left by one hold-out point in twenty: it is held to have failed where more than
LEFT of them lie above it.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, equation (49), doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import extras
from ..core.errors import CorruptFile, say
from ..core.notices import notify
from ..reduction import parameters as boxes
from . import calibration, kriging
from .calibration import NOTHING, Prediction
from .parametric_model import ParametricModel

if TYPE_CHECKING:
    from .training import FinishedTraining

KEY = "prediction"  #: of the record in the notes of a model
DOUBTS = "doubts"  #: in the notes of a model, why its training cannot promise the prediction
BAND = 2.0  #: standard deviations of the surrogate
FEWEST = 2  #: indicators away from full runs that are enough
WIDE = 2.5  #: widest band that says anything [decades]
PROOFS = 4  #: hold-out points that show an error, where all of them keep what was aimed at
PARTS = 1e-2  #: error that reduced parts make in the full model, from which errors against it are none of the bodies
LEFT = 0.1  #: part of the hold-out points that may lie above their bands
WHOLE = 1.0  #: error of the size of what is predicted


Predictor = Callable[[Mapping[str, float]], Prediction]


def record(training: FinishedTraining) -> dict[str, Any]:
    """What the prediction of a trained model needs, for its notes.

    Indicators at full runs are left out where others are enough: they dip to what truncation
    leaves.
    """
    last = training.last
    runs = set(training.outcome.points)
    away = [k for k, point in enumerate(last.samples) if point not in runs]
    chosen = away if len(away) >= FEWEST else list(range(len(last.samples)))
    points = training.search.candidates[[last.samples[k] for k in chosen]]
    return {
        "samples": boxes.to_box(training.task.parameters, points),
        "indicators": np.array([last.indicators[k] for k in chosen]),
        "pairs": np.array([(pair.indicator, pair.error) for pair in training.pairs]).reshape(-1, 2),
    }


def predictor(rom: ParametricModel) -> Predictor | None:
    """The prediction of a model as a function of parameters; None where its notes have no record of
    a training, or where the packages of the surrogate are missing, with a notice.
    """
    if KEY in rom.notes and not extras.there("families"):
        notify(f"no error is predicted: the surrogate needs {extras.install('families')}")
        return None
    known = read_record(rom)
    return None if known is None else functools.partial(predict, rom, *known)


def read_record(rom: ParametricModel) -> tuple[kriging.Surrogate, calibration.Calibration] | None:
    """Surrogate of the indicator (49) over the unit box, and calibration, from the notes; None
    without a record of a training.
    """
    if KEY not in rom.notes:
        return None
    try:
        samples, indicators, pairs = (
            np.asarray(rom.notes[KEY][name], float) for name in ("samples", "indicators", "pairs")
        )
        return kriging.fit(samples, indicators), calibration.fit(pairs[:, 0], pairs[:, 1])
    except (LookupError, TypeError, ValueError) as problem:
        raise CorruptFile(
            say(
                "record of the training",
                "samples, indicators and pairs",
                problem,
                "train the model anew",
            )
        ) from problem


def predict(
    rom: ParametricModel,
    surrogate: kriging.Surrogate,
    calibrated: calibration.Calibration,
    values: Mapping[str, float],
) -> Prediction:
    """The predicted error at values of the parameters, nominal where none is given; NaN outside of
    the trained ranges.
    """
    known = rom.model.parameters
    whole = boxes.completed(known, values)
    if boxes.outside(known, whole):
        return NOTHING
    point = boxes.to_box(known, [boxes.row_of(known, whole)])
    mean, std = (
        float(kriging.predict(surrogate, point)[0][0]),
        float(kriging.deviation(surrogate, point)[0]),
    )
    error, *ends = calibration.predict(calibrated, 10.0**mean)
    wide = [
        calibration.predict(calibrated, 10.0 ** (mean + sign * BAND * std)).error
        for sign in (-1.0, 1.0)
    ]
    down, up = (
        math.hypot(math.log10(end / error), math.log10(other / error))
        for end, other in zip(ends, wide, strict=True)
    )
    return Prediction(error, error * 10.0**-down, error * 10.0**up)


def predicted_error(rom: ParametricModel, **values: float) -> Prediction | None:
    """The predicted error at values of the parameters, nominal where none is given.

    NaN outside of the trained ranges; None for a model without a record of a training.
    """
    found = predictor(rom)
    return None if found is None else found(values)


def doubts(
    full_runs: int,
    predicted: Prediction,
    true: Sequence[float] | np.ndarray,
    high: Sequence[float] | np.ndarray,
    tolerance: float | None = None,
    unresolved: int = 0,
    part_error: float = 0.0,
    aim: float = 1.0,
) -> list[str]:
    """Why the predicted error of a training cannot be promised; empty where it can.

    `full_runs` counts checks, too, and `unresolved` those of them in which the iteration often
    failed. `predicted` is the largest error over the candidates with its band, `true` (k,) are
    errors at hold-out points, NaN where the full model has no motion, `high` (k,) the upper ends of
    their bands, `part_error` the largest one that reduced parts in the full model make. A band may
    reach beyond the wanted error where four hold-out points or more all keep what was aimed at,
    `aim` of it.
    """
    e, top = np.asarray(true, dtype=float), np.asarray(high, dtype=float)
    known = ~np.isnan(e)
    found = list[str]()
    if full_runs == 1:
        found.append(
            "there is one full run only, which does not show how the error depends on the parameters"
        )
    if unresolved:
        found.append(
            f"{unresolved} of {full_runs} full motions are not resolved by their steps: take a smaller time step"
        )
    if part_error > (PARTS if tolerance is None else tolerance):
        found.append(
            f"it is one against the mechanism with its parts, which err by up to {part_error:.2g} of an output: train these"
        )
    if math.isfinite(predicted[2]) and predicted[2] > 10.0**WIDE * predicted[1] > 0.0:
        found.append(f"it is uncertain by a factor of {predicted[2] / predicted[1]:.1g}")
    above = int(np.sum(e[known] > top[known])) if len(top) else 0
    if above > LEFT * known.sum():
        found.append(f"{above} of {int(known.sum())} hold-out points lie above the predicted band")
    if len(e) > known.sum():
        found.append(
            f"the full model has no motion at {int(len(e) - known.sum())} of {len(e)} hold-out points"
        )
    if tolerance is not None:
        return found + doubts_of_wanted(predicted, e[known], tolerance, aim)
    worst = max(
        [value for value in (predicted[0], *e[known]) if not math.isnan(value)], default=math.nan
    )
    if worst >= WHOLE:
        found.append(f"errors reach {worst:.2g} of what is predicted")
    return found


def doubts_of_wanted(
    predicted: Prediction, true: np.ndarray, tolerance: float, aim: float
) -> list[str]:
    """Why a wanted error cannot be promised, by the predicted one and the errors (k,) at hold-out
    points, see `doubts`.
    """
    found = list[str]()
    # a band that few pairs make says less than many full runs that the model has not seen
    kept = len(true) >= PROOFS and np.all(true <= aim * tolerance)
    if not (predicted[2] <= tolerance or kept):
        found.append(
            f"the predicted error reaches {predicted[2]:.2g} with its band, the wanted one is {tolerance:.2g}"
        )
    missed = int(np.sum(true > tolerance))
    if missed:
        found.append(
            f"{missed} of {len(true)} hold-out points are above the wanted error {tolerance:.2g}"
        )
    return found
