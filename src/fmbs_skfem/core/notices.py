"""What a user should know but what stops nothing."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from typing import Any, TypeAlias

from .storage.records import dataclass

#: is called with the finished part of some work, 0 to 1
Progress: TypeAlias = Callable[[float], None]


@dataclass(frozen=True)
class Labelled:
    """Progress of work with a name, as a screen shows it."""

    show: Callable[[str, float], None]  #: takes the name and the finished part
    label: str

    def __call__(self, fraction: float) -> None:
        self.show(self.label, fraction)


def follow_up(progress: Progress | None, label: str) -> Progress | None:
    """The progress of what is done after some work; none where that has no name, which would seem
    to begin again.
    """
    return replace(progress, label=label) if isinstance(progress, Labelled) else None


class Notice(UserWarning):
    """A warning; the command prints it on stderr, `--json` lists it under `notices`.

    Where it is raised, `partial` is the trajectory up to it, None where there is none.
    """

    partial: Any = None

    def __init__(self, text: str, about: str = "") -> None:
        super().__init__(text)
        self.about = about  #: a command shows the first of its warnings about one thing, those about nothing by their text


class CoarseStep(Notice):
    """A warning that the step is too large for what it reads of time, which a smaller one cures:
    such a run is no pilot.
    """


class Remark(Notice):
    """A warning of what is as it should be: `--strict` does not treat it as an error."""


RECORD: ContextVar[list[Notice] | None] = ContextVar("RECORD", default=None)


def notify(*found: str | Notice) -> None:
    """Show warnings to the caller of the library, as those that a rule yields; none without any."""
    for one in found:
        show(one if isinstance(one, Notice) else Notice(one), 4)


def show(notice: Notice, stacklevel: int = 3) -> None:
    """Show a warning, which is new or was recorded."""
    if (record := RECORD.get()) is not None:
        record.append(notice)
    warnings.warn(notice, stacklevel=stacklevel)


def remark(text: str) -> None:
    """Show a remark to the caller of the library."""
    show(Remark(text), 4)


@contextmanager
def recorded() -> Iterator[list[Notice]]:
    """The warnings that are shown within, which are shown all the same."""
    found = list[Notice]()
    outer = RECORD.set(found)
    try:
        yield found
    finally:
        RECORD.reset(outer)
        if (record := RECORD.get()) is not None:
            record.extend(found)
