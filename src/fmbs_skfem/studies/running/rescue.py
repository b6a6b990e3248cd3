"""What a study that ends in an internal error leaves: the traceback, and the results that there are.

    internal_error.json     traceback, call, libraries, machine, notices
    states.h5               HDF5: times (s,), x, v, a (s, n), multipliers (s, m) of the motion, where one was computed
    outputs.csv             its outputs, where they can be computed

They go to the output folder, or to the folder of the call where the study has none yet.
"""

from __future__ import annotations

import contextlib
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

from ...core.storage import container, durable
from .. import reports
from ..job import Job

ERROR, STATES = "internal_error.json", "states.h5"


def write(job: Job, error: Exception) -> list[Path]:
    """Everything that can be written, one file after the other; their names, the record of the error first."""
    found: list[Path] = []
    for make in (record, states, outputs):
        with contextlib.suppress(Exception):  # the error at hand is the one to report
            found.extend(make(job, error))
    return found


def record(job: Job, error: Exception) -> Iterator[Path]:
    """What went wrong, and where."""
    facts = {
        "status": "error",
        "reason": "internal error",
        "message": f"{type(error).__name__}: {error}",
        "traceback": traceback.format_exception(error),
        "call": sys.argv,
        **reports.environment(),
        "notices": job.notices,
    }
    folder = job.made or Path()
    folder.mkdir(parents=True, exist_ok=True)
    yield reports.write_json(folder / ERROR, facts)


def states(job: Job, error: Exception) -> Iterator[Path]:
    """The motion as arrays."""
    from ...dynamics.trajectory import COLUMNS

    if job.made is not None and job.trajectory is not None:
        columns = {name: getattr(job.trajectory, name) for name in COLUMNS}
        yield durable.write(job.made / STATES, container.image(columns))


def outputs(job: Job, error: Exception) -> Iterator[Path]:
    """The outputs of the motion."""
    from ... import dynamics

    if job.made is not None and job.trajectory is not None:
        yield reports.write_csv(job.made / "outputs.csv", {"t": job.trajectory.times, **dynamics.outputs(job.trajectory)})
