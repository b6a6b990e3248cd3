"""Imports that cost a process less time: that of a command, and that which draws pictures."""

from __future__ import annotations

import atexit
import gc

YOUNG = 20_000  #: new objects between two searches for garbage; imports make a million that stay


def prepare() -> None:
    """Search for garbage less often, and not at the end, when Python would go through all that was imported before it stops."""
    gc.set_threshold(YOUNG)
    atexit.register(gc.freeze)
