"""Who hears of functions that are compiled, by name, as they begin: a first model waits for them, and its user should know."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

_LISTENERS: list[Callable[[str], None]] = []


@contextlib.contextmanager
def heard_by(listener: Callable[[str], None]) -> Iterator[None]:
    """Call `listener` with the name of every function whose compilation begins inside, such as `stepping.advance`."""
    _LISTENERS.append(listener)
    try:
        yield
    finally:
        _LISTENERS.remove(listener)


def begin(name: str) -> None:
    """Say that the compilation of a function begins."""
    for listener in _LISTENERS:
        listener(name)
