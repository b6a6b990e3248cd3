"""Who hears of functions that are compiled, by name, as they begin: a first model waits for them, and its user should know."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

COMPILES = (
    "compiling {} and what else this model needs, once after installation (about half a minute); `fmbs warm` compiles all ahead"
)
_BEGUN: set[str] = set()  #: functions whose compilation has begun
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
    """Say that the compilation of a function begins: to listeners, or once in a process where there are none."""
    for listener in _LISTENERS:
        listener(name)
    if not _LISTENERS and not _BEGUN:
        log(COMPILES.format(name))
    _BEGUN.add(name)


def log(text: str) -> None:
    """A line in the log of this package, which Python shows on stderr; helpers that a process has started say nothing."""
    import logging
    import multiprocessing

    if multiprocessing.parent_process() is None:
        logging.getLogger("fmbs_skfem").warning(text)
