"""What a command that ends in an internal error leaves: the traceback, and the results that there are.

    internal_error.json     traceback, call, libraries, machine, notices
    states.h5               HDF5: times (s,), x, v, a (s, n), multipliers (s, m) of the motion, where one was computed
    outputs.csv             its outputs, where they can be computed

They go to the output folder, or to the folder of the call where the command has none yet.
"""

from __future__ import annotations

import contextlib
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

from . import reports
from .common import Session

ERROR, STATES = "internal_error.json", "states.h5"


def write(session: Session, error: Exception) -> list[Path]:
    """Everything that can be written, one file after the other; their names, the record of the error first."""
    return [path for make in (record, states, outputs) for path in attempt(make, session, error)]


def attempt(make: Callable[[Session, Exception], Iterator[Path]], session: Session, error: Exception) -> list[Path]:
    """The files of one kind; none where they cannot be made, for the error at hand is the one to be told."""
    found: list[Path] = []
    with contextlib.suppress(Exception):
        found.extend(make(session, error))
    return found


def record(session: Session, error: Exception) -> Iterator[Path]:
    """What went wrong, and where."""
    facts = {
        "status": "error",
        "reason": "internal error",
        "message": f"{type(error).__name__}: {error}",
        "traceback": traceback.format_exception(error),
        "call": sys.argv,
        **reports.environment(),
        "notices": session.notices,
    }
    folder = session.work.out or Path()
    folder.mkdir(parents=True, exist_ok=True)
    yield reports.write_json(folder / ERROR, facts)


def states(session: Session, error: Exception) -> Iterator[Path]:
    """The motion as arrays."""
    from ..core import container, durable
    from ..results import segments

    out, motion = session.work.out, session.work.trajectory
    if out is not None and motion is not None:
        yield durable.write(out / STATES, container.image({name: getattr(motion, name) for name in segments.COLUMNS}))


def outputs(session: Session, error: Exception) -> Iterator[Path]:
    """The outputs of the motion."""
    from .. import dynamics
    from . import solving

    out, motion = session.work.out, session.work.trajectory
    if out is not None and motion is not None:
        yield solving.write_outputs(out, motion.times, dynamics.outputs(motion))
