"""What is kept and shown of work that failed.

    failure.json            of a solve: why, with what is likely the cause
    failure.h5              HDF5: x, v, a (n,) of the last good state with the names `unknowns` (n,), multipliers (m,) with the
                            names `constraints` (m,), attribute time
    failure.png             a picture of it
    internal_error.json     of an internal error: traceback, call, libraries, machine, notices
    states.h5               HDF5: times (s,), x, v, a (s, n), multipliers (s, m) of the motion, where one was computed
    outputs.csv             its outputs, where they can be computed

The last three go to the output folder, or to the folder of the call where the study has none yet.
"""

from __future__ import annotations

import contextlib
import json
import sys
import traceback
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import dynamics
from ...core.errors import FmbsError, SolverError
from ...core.notices import notify
from ...core.storage import container, durable
from ...dynamics import names
from ...dynamics.diagnoses import diagnosis
from ...dynamics.trajectory import COLUMNS
from .. import reports
from ..job import Job
from .outcome import OUTPUTS

if TYPE_CHECKING:
    from ...dynamics import Trajectory
    from ...dynamics.diagnoses.diagnosis import Diagnosis

FAILURE, STATE, PICTURE = "failure.json", "failure.h5", "failure.png"
NAMES = (FAILURE, STATE, PICTURE)
ERROR, STATES = "internal_error.json", "states.h5"


def write_failure(
    out: Path | None, error: FmbsError | None, provenance: Mapping[str, Any], picture: bool = True
) -> tuple[dict[str, Any], list[Path]]:
    """What explains a solve that failed, with the files of it in the folder; nothing without a
    folder, and of other errors.

    Beside it stands the last good state. Files of an earlier failure are removed.
    """
    own = out is not None and clear_earlier(out)
    if out is None or not isinstance(error, SolverError):
        return {}, []
    from . import pictures

    facts = explain(error)
    files = [reports.write_json(out / FAILURE, {**facts, "provenance": provenance})] if own else []
    if own and error.partial is not None:
        files += [
            write_state(out / STATE, error.partial),
            *(pictures.last(error.partial, out / PICTURE, facts["unit"]) if picture else ()),
        ]
    return {"failure": facts}, files


def clear_earlier(out: Path) -> bool:
    """Remove the files of an earlier failure; False with a warning where the names are taken by
    files of other origin.
    """
    taken = [name for name in NAMES if (out / name).exists()]
    if not taken:
        return True
    with contextlib.suppress(OSError, ValueError):
        if "causes" in json.loads((out / FAILURE).read_text(encoding="utf-8")):
            for name in taken:
                (out / name).unlink()
            return True
    notify(f"{out}: {', '.join(taken)} did not come from here and are kept")
    return False


def write_state(path: Path, trajectory: Trajectory) -> Path:
    """The last state of a trajectory, with the names of its unknowns and constraints."""
    trajectory = trajectory.states
    system = trajectory.system
    state = {name: getattr(trajectory, name)[-1] for name in ("x", "v", "a", "multipliers")}
    named = {
        "unknowns": names.coordinate_names(system),
        "constraints": names.row_names(system)[system.size :],
    }
    return durable.write(path, container.image({**state, **named, "time": trajectory.times[-1]}))


def write_failed_start(job: Job, error: SolverError, provenance: Mapping[str, Any]) -> None:
    """What is known of a solve that never started, into its folder and to the listener."""
    found, files = write_failure(job.made, error, provenance)
    for cause in found["failure"]["causes"] if found else ():
        job.listener.tell(f"likely cause: {cause['what']}; {cause['remedy']}")
    for path in files:
        job.listener.tell(f"written: {path}")


def explain(error: SolverError) -> dict[str, Any]:
    """The diagnosis as a JSON object."""
    return plain(diagnosis.explain(error))


def plain(found: Diagnosis) -> dict[str, Any]:
    """A diagnosis whose reasons are texts and whose pairs are objects."""
    facts = asdict(found)
    for name in ("residuals", "by_body", "multipliers", "null"):
        facts[name] = [{"name": label, "value": value} for label, value in facts[name]]
    for attempt in facts["attempts"]:
        attempt["outcome"] = attempt["outcome"].value if attempt["outcome"] else "taken"
    return {**facts, "reason": found.reason.value}


def rescue(job: Job, error: Exception) -> list[Path]:
    """Everything that can be written, one file after the other; their names, the record of the
    error first.
    """
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
    if job.made is not None and job.trajectory is not None:
        columns = {name: getattr(job.trajectory, name) for name in COLUMNS}
        yield durable.write(job.made / STATES, container.image(columns))


def outputs(job: Job, error: Exception) -> Iterator[Path]:
    """The outputs of the motion."""
    if job.made is not None and job.trajectory is not None:
        yield reports.write_csv(
            job.made / OUTPUTS, {"t": job.trajectory.times, **dynamics.outputs(job.trajectory)}
        )
