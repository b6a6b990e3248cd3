"""Where the runs of a training may be made: candidates in the box of the parameters, and samples among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist

from . import parameters as boxes
from .parameters import Parameter

NEAR = 1e-9  #: distance in the unit box at which points are the same


@dataclass(frozen=True)
class Search:
    """Where runs may be made."""

    candidates: np.ndarray  #: (c, d) values of the parameters
    samples: tuple[int, ...]  #: candidates with a reduced run in every iteration
    first: int  #: candidate of the first full run


def search(parameters: Sequence[Parameter], candidates: ArrayLike, samples: ArrayLike, first: ArrayLike | None = None) -> Search:
    """Candidates (c, d), the samples (k, d) among them and the first point (d,), by default the candidate nearest to the middle.

    Samples and first point that are no candidates become some.
    """
    rows = boxes.table(parameters, candidates)
    wanted = boxes.table(parameters, samples)
    start = None if first is None else boxes.table(parameters, np.reshape(np.asarray(first, dtype=float), (1, -1)))
    for extra in (wanted, start):
        if extra is not None:
            away = distances(parameters, rows, extra).min(axis=1)
            rows = np.concatenate([rows, extra[away > NEAR]])
    if start is None:
        middle = np.full((1, len(parameters)), 0.5)
        start = rows[[int(np.argmin(np.linalg.norm(boxes.to_box(parameters, rows) - middle, axis=1)))]]
    numbers = distances(parameters, rows, wanted).argmin(axis=1)
    return Search(rows, tuple(dict.fromkeys(int(k) for k in numbers)), int(distances(parameters, rows, start).argmin(axis=1)[0]))


def distances(parameters: Sequence[Parameter], rows: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distances (k, c) in the unit box."""
    return np.asarray(cdist(boxes.to_box(parameters, points), boxes.to_box(parameters, rows)))
