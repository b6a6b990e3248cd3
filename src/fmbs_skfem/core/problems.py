"""A problem in a text or value: what was expected, what was found, a remedy. The reader, who knows it, adds the place."""

from __future__ import annotations

from .errors import InputError, say


class Problem(InputError):
    """Bad input without its place; `at` gives the message its file, line and key path."""

    def __init__(self, expected: str, got: str, remedy: str = "") -> None:
        super().__init__(say("value", expected, got, remedy))
        self.expected, self.got, self.remedy = expected, got, remedy

    def at(self, where: str) -> str:
        """The message in the house form at a place."""
        return say(where, self.expected, self.got, self.remedy)


def printable(text: str) -> str:
    """A text on one line, whose control characters are written out: names in a file may hold any."""
    return "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in text)


def shown(value: object, limit: int = 60) -> str:
    """A value as it appears in a message: its repr, cut at `limit` characters."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    text = "nothing" if value is None else repr(value)
    return text if len(text) <= limit else f"{text[:limit]}... ({len(text)} characters)"
