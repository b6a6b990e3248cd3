"""Where this package keeps what it can make again: compiled code, and bytecode."""

from __future__ import annotations

import os
from pathlib import Path


def parent() -> Path:
    """The folder of folders: in the user's cache, or in `NUMBA_CACHE_DIR`."""
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(given).absolute() / "fmbs_skfem"
    import platformdirs

    return Path(platformdirs.user_cache_dir("fmbs_skfem", appauthor=False)) / "numba"
