"""Signals c(t) = cos(angle(t)) and s(t) = sin(angle(t)) of driven angles [rad]; files can hold them where `angle` is data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..core.container import storable


@storable
@dataclass(frozen=True)
class Cosine:
    """cos(angle(t))."""

    angle: Callable[[np.ndarray], np.ndarray]

    def __call__(self, t: np.ndarray) -> np.ndarray:
        return np.asarray(np.cos(self.angle(t)))


@storable
@dataclass(frozen=True)
class Sine:
    """sin(angle(t))."""

    angle: Callable[[np.ndarray], np.ndarray]

    def __call__(self, t: np.ndarray) -> np.ndarray:
        return np.asarray(np.sin(self.angle(t)))
