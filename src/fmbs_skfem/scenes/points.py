"""The points of a training: candidates, first samples, the first full run and hold-out points over
the ranges of a scene.

rows (k, d) of values in SI units, a column for every parameter with a range, in the order of the
file
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.errors import InputError
from ..core.storage.records import dataclass
from ..core.values.ranges import Parameter
from ..reduction import parameters as sets
from . import schema
from .training_options import Design, Grid, Listed, Spread, Training, without_ranges


@dataclass(frozen=True)
class TrainingPoints:
    """What a training runs over."""

    candidates: np.ndarray  #: (c, d)
    samples: np.ndarray  #: (k, d) first reduced runs of every iteration
    first: np.ndarray | None  #: (d,) first full run; None for the candidate nearest to the middle
    holdout: np.ndarray  #: (k, d)


def section(scene: schema.Scene) -> Training:
    """The section `training`, or its defaults; a scene without ranges is refused."""
    if not scene.ranges:
        raise InputError(without_ranges().at(f"{scene.path or 'scene'}: parameters"))
    return scene.training or Training()


def of(
    training: Training, parameters: Sequence[Parameter], holdout: int | None = None
) -> TrainingPoints:
    """The points of a training; `holdout` replaces the number of its hold-out points.

    Plain numbers of samples are spread evenly over one parameter, over several as a Latin
    hypercube, and moved to the nearest candidates. Candidates that are scattered over several
    parameters have the corners of their box beside them, where errors are largest as a rule and a
    surrogate of points inside would be extrapolated; not where there are more corners than points.
    Hold- out points over several parameters have a seed of their own: they are not those that
    trained.
    """
    candidates = spread(training.candidates, parameters, training.seed, "sobol")
    samples = spread(training.samples, parameters, training.seed, "latin_hypercube")
    if not isinstance(training.samples, Listed):
        samples = candidates[list(nearest(parameters, candidates, samples))]
    if is_scattered(training.candidates, parameters) and 2 ** len(parameters) <= len(candidates):
        candidates = np.concatenate([candidates, sets.grid(parameters, 2)])
    first = None if training.first is None else sets.listed(parameters, [training.first])[0]
    checked = training.holdout if holdout is None else Spread(holdout) if holdout else None
    if checked is None:
        return TrainingPoints(candidates, samples, first, np.empty((0, len(parameters))))
    return TrainingPoints(
        candidates,
        samples,
        first,
        spread(checked, parameters, training.seed + 1, "latin_hypercube"),
    )


def spread(design: Design, parameters: Sequence[Parameter], seed: int, several: str) -> np.ndarray:
    """The points (k, d) of a design; with several parameters a plain number of points is spread by
    the design `several`.
    """
    if isinstance(design, Listed):
        return sets.listed(parameters, design.rows)
    if isinstance(design, Grid):
        return sets.grid(parameters, design.counts)
    if not is_scattered(design, parameters):
        return sets.grid(parameters, design.count)
    chosen = {"sobol": sets.sobol, "latin_hypercube": sets.latin_hypercube}[
        design.design or several
    ]
    return chosen(parameters, design.count, seed)


def is_scattered(design: Design, parameters: Sequence[Parameter]) -> bool:
    """Whether a design draws its points: neither a list nor a grid, nor a plain number of points
    over one parameter.
    """
    return isinstance(design, Spread) and bool(design.design or len(parameters) > 1)


def nearest(
    parameters: Sequence[Parameter], candidates: np.ndarray, points: np.ndarray
) -> tuple[int, ...]:
    """Numbers of the candidates nearest to points, in the unit box; each once."""
    from scipy.spatial import cKDTree

    _, found = cKDTree(sets.to_box(parameters, candidates)).query(sets.to_box(parameters, points))
    return tuple(dict.fromkeys(int(number) for number in found))
