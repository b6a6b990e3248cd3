"""Comparisons and choices of expressions for compiled code: both sides of a choice are computed, one of them counts."""

from __future__ import annotations

import math

from .jit import jit


@jit
def less(a: float, b: float) -> float:
    """1 where a < b, else 0."""
    return 1.0 if a < b else 0.0


@jit
def not_more(a: float, b: float) -> float:
    """1 where a <= b, else 0."""
    return 1.0 if a <= b else 0.0


@jit
def chosen(c: float, a: float, b: float) -> float:
    """a where c is not 0, else b."""
    return a if c != 0.0 else b


@jit
def sign_of(x: float) -> float:
    """-1, 0 or 1."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


@jit
def floor_of(x: float) -> float:
    """The largest whole number that is not above x."""
    return float(math.floor(x))
