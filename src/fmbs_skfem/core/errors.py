"""Errors that users meet: each says the place, what was expected, what was found, and a remedy; each has an exit code."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from enum import Enum
from typing import Any


class FmbsError(Exception):
    """Base of all errors raised on purpose."""

    exit_code = 1


class InputError(FmbsError, ValueError):
    """Bad input: a scene, a mesh, an argument."""

    exit_code = 3


class SweepFailure(FmbsError, RuntimeError):
    """Some members of a sweep failed; the others are kept."""

    exit_code = 5


class MissingFeature(FmbsError, RuntimeError):
    """An optional feature (OpenGL, a video encoder, an extra package) is not there."""

    exit_code = 7


class CorruptFile(FmbsError, ValueError):
    """A result, reduced model or checkpoint is damaged or belongs to something else."""

    exit_code = 8


class Reason(Enum):
    """Why a solve failed."""

    DIVERGED = "Newton iteration diverged"
    NOT_CONVERGED = "Newton iteration did not converge"
    NOT_FINITE = "a residual or increment is not finite"
    SINGULAR_TANGENT = "the tangent is singular"
    INCONSISTENT = "the joints contradict each other or the initial state"


class SolverError(FmbsError, RuntimeError):
    """A solve failed.

    Attributes: `reason`; `time` [s] or load factor; `worst`, pairs (name of body, joint or coordinate, residual), largest first;
    `partial`, the trajectory up to the failure (None where there is none).
    """

    exit_code = 4

    def __init__(
        self, message: str, reason: Reason, time: float = 0.0, worst: tuple[tuple[str, float], ...] = (), partial: Any = None
    ) -> None:
        super().__init__(message)
        self.reason, self.time, self.worst, self.partial = reason, time, worst, partial


def say(where: str, expected: str, got: object, remedy: str = "") -> str:
    """The house form of an error message."""
    text = f"{where}: expected {expected}, got {got}"
    return f"{text}; {remedy}" if remedy else text


def closest(word: str, candidates: Iterable[str]) -> str:
    """`; did you mean 'x'?` for the candidate nearest to `word`, or nothing."""
    near = difflib.get_close_matches(str(word), list(candidates), n=1, cutoff=0.6)
    return f"; did you mean '{near[0]}'?" if near else ""


def require(where: str, name: str, error: float, tolerance: float) -> None:
    """Refuse an error of a contract check beyond the tolerance, or one that is not a number."""
    if not error <= tolerance:
        remedy = "correct the rules of this type"
        raise InputError(say(f"{where}: {name}", f"an error of at most {tolerance:.1e}", f"{error:.3e}", remedy))
