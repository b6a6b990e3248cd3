"""Imports that cost a command less time."""

from __future__ import annotations

import gc
import importlib

UNUSED = (
    "f2py",
    "testing",
)  #: parts of numpy that scipy would load by listing names of numpy, which loads them: a tenth of all imports
YOUNG = 20_000  #: new objects between two searches for garbage; imports make a million that stay


def prepare() -> None:
    """Search for garbage less often, and import scipy without UNUSED parts of numpy, which stay as they are for all others."""
    gc.set_threshold(YOUNG)
    numpy = importlib.import_module("numpy")
    hidden = [name for name in UNUSED if name not in vars(numpy)]
    for name in hidden:
        setattr(numpy, name, None)
    importlib.import_module("scipy.sparse")
    for name in hidden:
        if getattr(numpy, name) is None:
            delattr(numpy, name)
