"""A problem in a text or value: what was expected, what was found, a remedy. The reader, who knows
it, adds the place.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from typing import Any, TypeAlias

from ..errors import InputError, closest, listed, say

Keys: TypeAlias = tuple[str | int, ...]  #: path of keys and indices


class Problem(InputError):
    """Bad input without its place; `at` gives the message its file, line and key path."""

    def __init__(self, expected: str, got: str, remedy: str = "") -> None:
        super().__init__(say("value", expected, got, remedy))
        self.expected, self.got, self.remedy = expected, got, remedy

    def at(self, where: str) -> str:
        """The message in the house form at a place."""
        return say(where, self.expected, self.got, self.remedy)


Found: TypeAlias = tuple[Keys, Problem]


class Problems(InputError):
    """Several problems, each with its path of keys below the value that was read."""

    def __init__(self, found: Sequence[Found]) -> None:
        super().__init__("\n".join(problem.at(".".join(map(str, keys))) for keys, problem in found))
        self.found = tuple(found)


def located(error: InputError) -> tuple[Found, ...]:
    """The problems of an error."""
    if isinstance(error, Problems):
        return error.found
    return (
        (
            (),
            error
            if isinstance(error, Problem)
            else Problem("values that fit together", str(error)),
        ),
    )


def read_all(
    parts: Iterable[tuple[str | int, Callable[[], Any]]], found: Sequence[Found] = ()
) -> list[Any]:
    """What is read by every function of its key; `Problems` where any of them fails, after those
    that are `found` already.
    """
    values = list[Any]()
    wrong = list(found)
    for key, read in parts:
        try:
            values.append(read())
        except InputError as error:
            wrong += [((key, *keys), problem) for keys, problem in located(error)]
    if wrong:
        raise Problems(wrong)
    return values


def unknown(kind: str, many: str, name: str, known: Collection[str]) -> Problem:
    """The problem of a name that is none of those known."""
    hint = closest(name, known).removeprefix("; ")
    return Problem(
        f"one of the {many} {listed(sorted(known), name)}", f"the {kind} {shown(name)}", hint
    )


def printable(text: str) -> str:
    """A text on one line, whose control characters are written out: names in a file may hold any."""
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode()
        for letter in text
    )


def shown(value: object, limit: int = 60) -> str:
    """A value as it appears in a message: its repr, cut at `limit` characters."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    text = "nothing" if value is None else repr(value)
    return text if len(text) <= limit else f"{text[:limit]}... ({len(text)} characters)"
