"""What environments need of gymnasium where that is not installed: boxes of numbers, and classes
without anything.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

NEXT_STEP: Any = "NextStep"  #: how `gymnasium.vector.AutoresetMode` calls it that an episode begins anew with the next action


class Box:
    """Arrays of a shape between two bounds, as `gymnasium.spaces.Box`."""

    def __init__(
        self,
        low: ArrayLike,
        high: ArrayLike,
        shape: tuple[int, ...] | None = None,
        dtype: Any = np.float64,
    ) -> None:
        self.shape = np.broadcast(low, high).shape if shape is None else shape
        self.dtype = np.dtype(dtype)
        self.low, self.high = (
            np.broadcast_to(np.asarray(one, dtype), self.shape).copy() for one in (low, high)
        )
        self.random = np.random.default_rng()

    def seed(self, seed: int | None = None) -> int | None:
        """Begin random numbers anew."""
        self.random = np.random.default_rng(seed)
        return seed

    def sample(self) -> np.ndarray:
        """A random array: evenly between finite bounds, normal where there are none."""
        bounded = np.isfinite(self.low) & np.isfinite(self.high)
        even = self.random.uniform(
            np.where(bounded, self.low, 0.0), np.where(bounded, self.high, 1.0)
        )
        return np.asarray(np.where(bounded, even, self.random.normal(size=self.shape)), self.dtype)

    def contains(self, x: ArrayLike) -> bool:
        """Whether an array has the shape and is within the bounds."""
        found = np.asarray(x)
        return found.shape == self.shape and bool(
            ((self.low <= found) & (found <= self.high)).all()
        )


class Env:
    """As `gymnasium.Env`, as far as it is needed."""

    np_random = np.random.default_rng()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin random numbers anew."""
        if seed is not None:
            self.np_random = np.random.default_rng(seed)


class VectorEnv:
    """As `gymnasium.vector.VectorEnv`, as far as it is needed."""
