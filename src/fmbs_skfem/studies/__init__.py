"""Whole studies as functions: plain options in, a result with arrays and figures out; the commands
of `fmbs` call them.

    found = studies.run("examples/spin_up.yaml", duration=0.1)
    found.outputs["tip_deflection"]         (s,) at found.times
    found.figures["outputs"]                a figure of matplotlib
    print(found)                            what `fmbs run` prints

Nothing is written without a folder `out`. What all studies take is `Shared`, who hears of their
progress a `Listener`. Work that fails raises an error whose `result` holds what there is all the
same.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from .commands import (
    cases,
    check,
    checksums,
    compare,
    demo,
    describe_scenes,
    export,
    new,
    reduce,
    render,
    report,
    resume,
    run,
    sweep,
    train,
    verify,
    view,
    warm,
)
from .job import Job, Listener
from .model_commands import check_part, describe_part, export_model, info, run_model, train_part
from .options import Shared
from .result import Figures, ReportTable, Result

if TYPE_CHECKING:
    from .checking import Check
    from .comparison import ComparisonResult
    from .greedy_training import TrainingResult
    from .parts import PartResult
    from .reducing import ReductionResult
    from .running.outcome import Run
    from .sweeping import SweepResult

#: result -> module that has it; loaded when it is first used
RESULTS = {
    "Run": "running.outcome",
    "Check": "checking",
    "ReductionResult": "reducing",
    "PartResult": "parts",
    "ComparisonResult": "comparison",
    "TrainingResult": "greedy_training",
    "SweepResult": "sweeping",
}

__all__ = [
    "Listener",
    "Shared",
    "Job",
    "Result",
    "Figures",
    "ReportTable",
    "Run",
    "run",
    "render",
    "view",
    "report",
    "export",
    "resume",
    "Check",
    "check",
    "checksums",
    "ReductionResult",
    "reduce",
    "info",
    "run_model",
    "export_model",
    "PartResult",
    "train_part",
    "describe_part",
    "check_part",
    "ComparisonResult",
    "compare",
    "demo",
    "new",
    "warm",
    "TrainingResult",
    "train",
    "SweepResult",
    "sweep",
    "cases",
    "verify",
    "describe_scenes",
]


def __getattr__(name: str) -> Any:
    if name not in RESULTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{RESULTS[name]}"), name)
