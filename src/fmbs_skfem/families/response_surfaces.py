r"""Response surfaces: outputs as smooth functions of the parameters, fitted to the samples of a
sweep.

    y(p) = m + s (z(u) + n)                                                                              (`gaussian`)

u (d,) are the parameters in the unit box, by their logarithm where their scale is that. The error
is that of samples that the surface has not seen: each in turn left out of at most MOST samples, or
of all samples beyond these.

    q2 = 1 - mean(e^2) / var(y)

1 for a surface that meets what it has not seen, 0 for one that is no better than the mean.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.ranges import Parameter, Scale
from ..reduction.parameters import check, row_of, to_box
from . import gaussian
from .gaussian import Process

MOST = 200  #: samples of a fit, whose cost grows with their third power; further ones are its test
LIKELY = 60  #: those of which amplitude, lengths and noise are found, which takes some hundred fits
FACTOR = 3  #: samples that are needed, a parameter
CONSTANT = 1e-9  #: of the largest value: outputs that vary less have no surface
ROUGH = 0.5  #: largest variance of n over that of the samples


@dataclass(frozen=True, eq=False)
class ResponseSurface:
    """A number over a box of parameters.

        y(p) = m + s (z(u) + n),    q2 = 1 - mean(e^2) / var(y)

    with u in the unit box of the parameters; q2 is that of samples that it has not seen.
    """

    parameters: tuple[Parameter, ...]
    points: np.ndarray  #: (k, d) values of the parameters [SI]
    values: np.ndarray  #: (k,)
    lengths: np.ndarray  #: (d,) correlation lengths, in sides of the box
    amplitude: float  #: a^2
    noise: float  #: variance of n over s^2
    rms_error: float  #: of samples that it has not seen, in the unit of the values
    largest_error: float
    q2: float

    @cached_property
    def process(self) -> Process:
        """The process over the unit box."""
        box = to_box(self.parameters, self.points)
        y = self.values
        return Process(
            box, y, float(y.mean()), float(y.std()), self.lengths, self.amplitude, self.noise
        )

    def predict(self, points: ArrayLike | Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation (i,) of the smooth part at values (i, d) of the parameters,
        or at one set of them by name.

        InputError for other parameters and another number of columns.
        """
        rows = (
            row_of(self.parameters, points)[None]
            if isinstance(points, Mapping)
            else np.atleast_2d(np.asarray(points, float))
        )
        return self.process.predict(to_box(self.parameters, rows))


def fit(
    parameters: Sequence[Parameter], points: ArrayLike, values: ArrayLike, seed: int = 0
) -> ResponseSurface | None:
    """The surface of values (k,) at values (k, d) of the parameters; failed samples (NaN) are left
    out. None of a constant.

    InputError for fewer than FACTOR samples a parameter that ran.
    """
    check(parameters)
    given, y = np.asarray(points, dtype=float), np.asarray(values, dtype=float)
    if given.shape != (len(y), len(parameters)):
        expected = f"points (k, {len(parameters)}) and as many values"
        raise InputError(
            say("response_surfaces.fit", expected, f"shapes {given.shape} and {y.shape}")
        )
    there = np.isfinite(y)
    given = given[there]
    y = y[there]
    check_count(parameters, len(y))
    if np.ptp(y) <= CONSTANT * np.abs(y).max():
        return None
    order = np.random.default_rng(seed).permutation(len(y))
    kept, rest = np.sort(order[:MOST]), np.sort(order[MOST:])
    mean = y[kept].mean()
    scale = y[kept].std()
    some = order[:LIKELY]
    found = gaussian.likeliest(
        to_box(parameters, given[some]), (y[some] - mean) / scale, ROUGH, seed
    )
    surface = ResponseSurface(tuple(parameters), given[kept], y[kept], *found, 0.0, 0.0, 0.0)
    missed = (
        surface.predict(given[rest])[0] - y[rest] if len(rest) else surface.process.left_out()[0]
    )
    numbers = (
        float(np.sqrt(np.mean(missed**2))),
        float(np.abs(missed).max()),
        float(1.0 - np.mean(missed**2) / y.var()),
    )
    return replace(surface, rms_error=numbers[0], largest_error=numbers[1], q2=numbers[2])


def check_count(parameters: Sequence[Parameter], count: int) -> None:
    """InputError for fewer samples than a surface takes.

    That is, fewer than 3 d + 1 for d parameters.
    """
    if count < FACTOR * len(parameters) + 1:
        needed = f"at least {FACTOR * len(parameters) + 1} samples that run, for {len(parameters)} parameters"
        raise InputError(say("response surfaces", needed, count, "take more samples"))


FIELDS = tuple(ResponseSurface.__dataclass_fields__)


def write(path: Path, surfaces: Mapping[str, Mapping[str, ResponseSurface]]) -> Path:
    """Surfaces by output and kind as JSON, with all that a prediction takes; `read` gives them
    back.

    {output: {kind: surface}}; numbers that are not finite are refused by ValueError.
    """
    text = {
        output: {
            kind: {"parameters": [_described(one) for one in found.parameters], **_numbers(found)}
            for kind, found in kinds.items()
        }
        for output, kinds in surfaces.items()
    }
    formula = "y = mean(values) + std(values) * k(u) (k(U) + noise 1)^-1 (values - mean) / std,  u in the unit box of the parameters"
    path.write_text(
        json.dumps({"formula": formula, "surfaces": text}, indent=1, allow_nan=False) + "\n",
        encoding="utf-8",
    )
    return path


def read(path: Path | str) -> dict[str, dict[str, ResponseSurface]]:
    """Surfaces by output and kind of a file of `write`; InputError where it is none."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))["surfaces"]
        return {
            output: {kind: _surface(found) for kind, found in kinds.items()}
            for output, kinds in content.items()
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            say(
                str(path),
                "response surfaces written by a sweep",
                repr(error),
                "run the sweep again",
            )
        ) from error


def _described(one: Parameter) -> dict[str, Any]:
    return {
        "name": one.name,
        "low": one.low,
        "high": one.high,
        "unit": one.unit,
        "scale": one.scale.value,
    }


def _numbers(found: ResponseSurface) -> dict[str, Any]:
    return {
        name: value.tolist() if isinstance(value := getattr(found, name), np.ndarray) else value
        for name in FIELDS[1:]
    }


def _surface(found: Mapping[str, Any]) -> ResponseSurface:
    parameters = tuple(
        Parameter(**{**one, "scale": Scale(one["scale"])}) for one in found["parameters"]
    )
    points, values, lengths = (np.array(found[name]) for name in FIELDS[1:4])
    amplitude, noise, rms_error, largest_error, q2 = (float(found[name]) for name in FIELDS[4:])
    return ResponseSurface(
        parameters, points, values, lengths, amplitude, noise, rms_error, largest_error, q2
    )
