"""Errors that users meet: each says the place, what was expected, what was found, and a remedy;
each has an exit code.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable
from enum import Enum
from typing import Any

MOST, NEAREST = 12, 5  #: names that a message lists; of more the closest ones
DIGITS = re.compile(r"[0-9]+")


class FmbsError(Exception):
    """Base of all errors raised on purpose; `result` is that of a study as far as it came."""

    exit_code = 1
    result: Any = None


class InputError(FmbsError, ValueError):
    """Bad input: a scene, a mesh, an argument."""

    exit_code = 3


class Warned(FmbsError, RuntimeError):
    """A warning about a result, where warnings are to be errors; the result is kept."""

    exit_code = 3


class NoModel(FmbsError, RuntimeError):
    """A training can make no reduced model of the kind that was asked for."""

    exit_code = 4


class SweepFailure(FmbsError, RuntimeError):
    """Some members of a sweep failed; the others are kept."""

    exit_code = 5


class NoRoom(FmbsError, OSError):
    """The disk is full, or a limit of file sizes is reached."""

    exit_code = 6


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
    UNSTABLE = "the energy balance rises"
    GROWING = "the closed loop is unstable"
    INCONSISTENT = "the joints contradict each other or the initial state"
    NO_EQUILIBRIUM = "the loads have no equilibrium"


class SolverError(FmbsError, RuntimeError):
    """A solve failed.

    Attributes: `reason`; `time` [s] or load factor; `worst`, pairs (name of body, joint or
    coordinate, residual), largest first; `partial`, the trajectory up to the failure (None where
    there is none).
    """

    exit_code = 4

    def __init__(
        self,
        message: str,
        reason: Reason,
        time: float = 0.0,
        worst: tuple[tuple[str, float], ...] = (),
        partial: Any = None,
    ) -> None:
        super().__init__(message)
        self.reason, self.time, self.worst, self.partial = reason, time, worst, partial


class Contradiction(SolverError):
    """Bad input of a system: joints or drives that contradict each other, or the initial state.

    Attributes: `rows`, the constraint rows (JOINT.ROW) that it names, those of `worst` first;
    `place`, where they stand in the file of a scene, which the message begins with.
    """

    exit_code = InputError.exit_code

    def __init__(
        self, message: str, worst: tuple[tuple[str, float], ...] = (), others: Iterable[str] = ()
    ) -> None:
        super().__init__(message, Reason.INCONSISTENT, 0.0, worst)
        self.rows = (*dict.fromkeys([*(name for name, _ in worst), *others]),)
        self.place = ""

    def __str__(self) -> str:
        text = super().__str__()
        return f"{self.place}: {text}" if self.place else text


def say(where: str, expected: str, got: object, remedy: str = "") -> str:
    """The house form of an error message."""
    text = f"{where}: expected {expected}, got {got}"
    return f"{text}; {remedy}" if remedy else text


def closest(word: str, candidates: Iterable[str]) -> str:
    """`; did you mean 'x'?` for the candidate nearest to `word`, or nothing; of many such as b1,
    b2, ... none is nearest.
    """
    known = list(candidates)
    near = [name for name in known if name.casefold() == str(word).casefold()]
    near = near or difflib.get_close_matches(str(word), known, n=1, cutoff=0.6)
    series = [
        name
        for name in known
        if near and DIGITS.sub("", name) == DIGITS.sub("", str(word)) == DIGITS.sub("", near[0])
    ]
    return f"; did you mean '{near[0]}'?" if near and len(series) <= MOST else ""


def listed(candidates: Iterable[str], word: str = "", none: str = "(there are none)") -> str:
    """Names for a message: all of them, or of many the closest to `word` and how many there are."""
    known = list(candidates)
    if len(known) <= MOST:
        return ", ".join(known) or none
    near = difflib.get_close_matches(str(word), known, n=NEAREST, cutoff=0.0)
    return f"{', '.join(near)}, ... ({len(known)} in all)"


def require_positive(where: str, **values: float) -> None:
    """Refuse values that are not finite and positive: InputError with the place `where` and the
    name of the value.
    """
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise InputError(say(f"{where}.{name}", "a positive and finite number", value))


def require(where: str, name: str, error: float, tolerance: float) -> None:
    """Refuse an error of a contract check beyond the tolerance, or one that is not a number."""
    if not error <= tolerance:
        remedy = "correct the rules of this type"
        raise InputError(
            say(f"{where}: {name}", f"an error of at most {tolerance:.1e}", f"{error:.3e}", remedy)
        )
