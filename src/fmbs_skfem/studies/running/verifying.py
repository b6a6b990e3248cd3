"""The cases of verification, which stand beside `src` in a clone of the project."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from ...core.errors import MissingFeature, say

NAME = "verification"
FOLDER = Path(__file__).resolve().parents[4] / NAME


def load() -> Any:
    """The module that solves the cases, by its own path and never from the current folder;
    MissingFeature without a clone.
    """
    if not (FOLDER / "report.py").is_file():
        remedy = "clone the project, which has them, and install it from there: pip install -e ."
        raise MissingFeature(
            say("verify", "the cases of verification", "a package without them", remedy)
        )
    if NAME not in sys.modules:
        spec = spec_from_file_location(
            NAME, FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)]
        )
        assert spec is not None
        assert spec.loader is not None
        sys.modules[NAME] = module_from_spec(spec)
        spec.loader.exec_module(sys.modules[NAME])
    return import_module(f"{NAME}.report")
