"""Progress of long work in notebooks: one line below the cell, which changes, and goes when the
work ends.
"""

from __future__ import annotations

import contextlib
import html
import importlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

PATIENCE = 2.0  #: work that takes longer shows its progress [s]
PACE = 0.25  #: between two changes of the line [s]


def kernel() -> bool:
    """Whether this process is the kernel of a notebook; IPython is not imported for that."""
    found = sys.modules.get("IPython")
    shell = found.get_ipython() if found is not None and hasattr(found, "get_ipython") else None
    return getattr(shell, "kernel", None) is not None


@contextlib.contextmanager
def progress() -> Iterator[Callable[[str, float], None] | None]:
    """What shows progress while the work inside goes on; None where this is no notebook."""
    if not kernel():
        yield None
        return
    line = ProgressLine()
    try:
        yield line.progress
    finally:
        line.close()


class ProgressLine:
    """A display that says what is being done, how far it is, and how long it will still take."""

    def __init__(self) -> None:
        self.label, self.begin, self.shown = "", time.perf_counter(), 0.0
        self.handle: Any = None

    def progress(self, label: str, fraction: float) -> None:
        """The finished part of the work `label`."""
        now = time.perf_counter()
        if label != self.label:
            self.label, self.begin = label, now
        taken = now - self.begin
        if taken < PATIENCE or now - self.shown < PACE:
            return
        self.shown = now
        left = f", about {taken * (1.0 / fraction - 1.0):.0f} s left" if fraction > 0.0 else ""
        self.show(
            f'<progress max="1" value="{fraction:.3f}"></progress> {html.escape(label)}: {fraction:.0%} after {taken:.0f} s{left}'
        )

    def show(self, text: str) -> None:
        """Put a text in the place of the one before."""
        display = importlib.import_module("IPython.display")
        if self.handle is None:
            self.handle = display.display(display.HTML(text), display_id=True)
        else:
            self.handle.update(display.HTML(text))

    def close(self) -> None:
        """The line goes."""
        if self.handle is not None:
            self.show("")
