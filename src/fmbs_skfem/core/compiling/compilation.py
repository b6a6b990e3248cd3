"""Who hears of functions that are compiled, by name, as they begin: a first model waits for them,
and its user should know.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Collection, Iterator

COMPILES = "first run: compiling {} and the like (about 30 s, kept for later); `fmbs warm` compiles everything in advance"
EXPRESSIONS = "compiling expressions of this model (some seconds, kept for later)"
LAW = "law_"  #: of names of functions that are made from expressions, see `symbols.import_text`
_BEGUN: set[str] = set()  #: functions whose compilation has begun
_LISTENERS: list[Callable[[str], None]] = []


@contextlib.contextmanager
def heard_by(listener: Callable[[str], None]) -> Iterator[None]:
    """Call `listener` with the name of every function whose compilation begins inside, such as
    `stepping.advance`.
    """
    _LISTENERS.append(listener)
    try:
        yield
    finally:
        _LISTENERS.remove(listener)


def begin(name: str) -> None:
    """Say that the compilation of a function begins: to listeners, or once in a process where there
    are none.
    """
    for listener in _LISTENERS:
        listener(name)
    if not _LISTENERS and (text := news(name, _BEGUN)):
        log(text)
    _BEGUN.add(name)


def news(name: str, begun: Collection[str]) -> str:
    """What is said when the compilation of a function begins after those of others; expressions
    take less than all the rest.
    """
    own = name.startswith(LAW)
    if begun and (own or not all(one.startswith(LAW) for one in begun)):
        return ""
    return EXPRESSIONS if own else COMPILES.format(name)


def log(text: str) -> None:
    """A line in the log of this package, which Python shows on stderr; helpers that a process has
    started say nothing.
    """
    import logging
    import multiprocessing

    if multiprocessing.parent_process() is None:
        logging.getLogger("fmbs_skfem").warning(text)
