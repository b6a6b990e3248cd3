"""Signals that end a process: what is taken when one comes, such as a lock, is given back before it
ends.

SIGTERM comes from batch systems and `kill`, SIGHUP from a terminal that is closed. Under `nohup`
SIGHUP is ignored, and stays so.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any

#: those of this system: Windows has no SIGHUP
SIGNALS: tuple[int, ...] = tuple(
    getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)
)
STOPS = (int(signal.SIGINT), *SIGNALS)  #: the same, and Ctrl-C


class Ended(KeyboardInterrupt):
    """A signal of this number ends the process."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


@contextlib.contextmanager
def raised() -> Iterator[None]:
    """SIGTERM and SIGHUP inside raise `Ended`, where they would end the process at once."""

    def end(number: int, frame: Any) -> None:
        raise Ended(number)

    main = threading.current_thread() is threading.main_thread()
    taken = [number for number in SIGNALS if main and signal.getsignal(number) is signal.SIG_DFL]
    for number in taken:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)


@contextlib.contextmanager
def noted(note: Callable[[int], object]) -> Iterator[Callable[[], None]]:
    """SIGINT, SIGTERM and SIGHUP inside call `note` with their number, but for those that are
    ignored; what is given ends that.
    """
    before: dict[int, Any] = {}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)

    if threading.current_thread() is threading.main_thread():
        heard = [number for number in STOPS if signal.getsignal(number) is not signal.SIG_IGN]
        before |= {
            number: signal.signal(number, lambda number, frame: note(number)) for number in heard
        }
    try:
        yield restore
    finally:
        restore()
