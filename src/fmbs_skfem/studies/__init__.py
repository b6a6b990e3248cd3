"""Whole studies as functions: plain options in, a result with arrays and figures out; the commands of `fmbs` call them.

    found = studies.run("examples/spin_up.yaml", duration=0.1)
    found.outputs["tip_deflection"]         (s,) at found.times
    found.figures["outputs"]                a figure of matplotlib
    print(found)                            what `fmbs run` prints

Nothing is written without a folder `out`. What all studies take is `Shared`, who hears of their progress a `Listener`. Work that
fails raises an error whose `result` holds what there is all the same.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from .job import Job, Listener, Shared
from .result import Figures, Result, Table

if TYPE_CHECKING:
    from .checking import Check, check, checksums
    from .comparison import ComparisonResult, compare, demo
    from .models import info, run_model
    from .reducing import ReductionResult, reduce
    from .resuming import resume
    from .runs import Run, export, render, run
    from .schema import describe_scenes
    from .sweeping import SweepResult, sweep
    from .training import TrainingResult, train
    from .verifying import Verification, cases, verify

#: module -> what it has; loaded when it is first used
HOMES = {
    "runs": ("Run", "run", "render", "export"),
    "resuming": ("resume",),
    "checking": ("Check", "check", "checksums"),
    "reducing": ("ReductionResult", "reduce"),
    "models": ("info", "run_model"),
    "comparison": ("ComparisonResult", "compare", "demo"),
    "training": ("TrainingResult", "train"),
    "sweeping": ("SweepResult", "sweep"),
    "verifying": ("Verification", "cases", "verify"),
    "schema": ("describe_scenes",),
}

__all__ = [
    "Listener",
    "Shared",
    "Job",
    "Result",
    "Figures",
    "Table",
    "Run",
    "run",
    "render",
    "export",
    "resume",
    "Check",
    "check",
    "checksums",
    "ReductionResult",
    "reduce",
    "info",
    "run_model",
    "ComparisonResult",
    "compare",
    "demo",
    "TrainingResult",
    "train",
    "SweepResult",
    "sweep",
    "Verification",
    "cases",
    "verify",
    "describe_scenes",
]


def __getattr__(name: str) -> Any:
    for home, names in HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
