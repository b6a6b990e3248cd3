"""The history of a run on the disk while it runs: closed files, so that what kills the process
loses the open one at most.

    history/segment-00001.h5    HDF5: times (s,), x, v, a (s, n), multipliers (s, m), memory (s, l), work (s,)
                                of a run that keeps few states x, v, a (k, n), ..., their numbers `kept` (k,), and in `trace` what
                                was read of all
    history/checkpoint-00001.h5 all that the next step reads (`dynamics.checkpoint`), of the newest segment only
    history/manifest.h5         the job, and how far it is

The manifest comes last: what it counts is there, what it does not count is written again. Other
programs read the segments as plain HDF5.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, say
from ..core.storage import container
from ..core.storage.container import FileKind
from ..core.storage.records import dataclass
from ..core.storage.store import Store
from ..dynamics.checkpoint import Checkpoint, Resumed, Rows, RunState
from ..dynamics.trajectory import COLUMNS, Trace, joined_traces

FOLDER = "history"
SEGMENT, CHECKPOINT, MANIFEST = "segment-", "checkpoint-", "manifest"
REMEDY = "restore the file from a copy, or run the scene anew with --force"
KIND = FileKind("fmbs_skfem history", "a history", REMEDY, "run the scene anew")
EVERY = 10.0  #: time between two segments of a run [s]
SHARE = 0.02  #: of the time of a run that segments may take
LARGEST = 2**28  #: states that wait for the next segment [bytes]
MEMORY = "memory"  #: column without which what forces keep follows from the states
TRACE = "trace"  #: group of what was read of states that are gone


class HistoryState(Enum):
    """How far the run of a history is."""

    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"


@dataclass(frozen=True)
class Manifest:
    """What a history holds."""

    job: dict[str, Any]  #: what is run, in the words of who runs it
    state: HistoryState = HistoryState.RUNNING
    done: int = 0  #: steps
    steps: int = 0  #: of the whole run
    time: float = 0.0  #: [s]
    segments: tuple[int, ...] = ()  #: stored states up to the end of each
    checkpoint: int = 0  #: its number; 0 where there is none


class Recorder:
    """Keeps a run in `folder`: a segment and a checkpoint every so many seconds; see
    `dynamics.integrate`.

    Without `every` the first one is written after EVERY seconds, so that short runs write nothing;
    with it, also at the end.
    """

    def __init__(
        self,
        folder: Path,
        job: Mapping[str, Any],
        every: float | None = None,
        manifest: Manifest | None = None,
    ) -> None:
        self.folder = folder
        self.every = every
        self.manifest = manifest or Manifest(dict(job))
        self.last = time.perf_counter()
        self.took = 0.0

    def __call__(self, moment: RunState) -> None:
        if self.due(moment):
            self.write(moment)

    def due(self, moment: RunState) -> bool:
        """Whether the next segment is to be written now."""
        if moment.done == moment.steps:
            return self.every is not None or bool(self.manifest.segments)
        waiting = moment.kept - self.kept
        if waiting and waiting * moment.bytes_a_state >= LARGEST:
            return True
        rest = max(EVERY, self.took / SHARE) if self.every is None else self.every
        return time.perf_counter() - self.last >= rest

    @property
    def kept(self) -> int:
        """Number of states in closed segments."""
        return self.manifest.segments[-1] if self.manifest.segments else 0

    def write(self, moment: RunState) -> None:
        """Close a segment with all states since the last one, and a checkpoint."""
        begin = time.perf_counter()
        files = store_of(self.folder)
        segments = self.manifest.segments
        if moment.kept > self.kept:
            files.append(
                SEGMENT, len(segments) + 1, columns_of(moment.rows(self.kept, moment.kept))
            )
            segments = (*segments, moment.kept)
        number = self.manifest.checkpoint + 1
        files.append(CHECKPOINT, number, moment.checkpoint())
        state = HistoryState.DONE if moment.done == moment.steps else HistoryState.RUNNING
        found = replace(
            self.manifest, state=state, done=moment.done, steps=moment.steps, time=moment.time
        )
        self.manifest = replace(found, segments=segments, checkpoint=number)
        files.append(MANIFEST, None, self.manifest)
        files.forget(CHECKPOINT, but=number)
        self.last, self.took = time.perf_counter(), time.perf_counter() - begin

    def fail(self) -> None:
        """Note that the run cannot go on: it would fail again."""
        if self.manifest.checkpoint:
            self.manifest = replace(self.manifest, state=HistoryState.FAILED)
            store_of(self.folder).append(MANIFEST, None, self.manifest)


def columns_of(rows: Rows) -> dict[str, Any]:
    """Arrays of a segment by name."""
    found = {name: value for name, value in vars(rows).items() if value is not None}
    return found if rows.trace is None else found | {TRACE: vars(rows.trace)}


def joined(parts: Sequence[Mapping[str, Any]], firsts: Sequence[int]) -> Rows:
    """The arrays of segments behind each other, of which the first states have these numbers."""
    columns: dict[str, Any] = {
        column: np.concatenate([part[column] for part in parts]) for column in COLUMNS
    }
    least = min(part[MEMORY].shape[1] if MEMORY in part else 0 for part in parts)
    memory = np.concatenate(
        [part[MEMORY] if least else np.zeros((len(part["x"]), 0)) for part in parts]
    )
    work = np.concatenate([part["work"] for part in parts])
    if TRACE not in parts[0]:
        return Rows(**columns, memory=memory, work=work)
    trace = joined_traces([Trace(**part[TRACE]) for part in parts])
    kept = np.concatenate([part["kept"] + first for part, first in zip(parts, firsts, strict=True)])
    return Rows(**columns, memory=memory, work=work, trace=trace, kept=kept)


def store_of(folder: Path) -> Store:
    """The files of the history in a folder."""
    return Store(folder / FOLDER, KIND, remedy=remedy(folder))


def remedy(folder: Path) -> str:
    """What helps where the disk is full: whether the run in a folder has closed what it can go on
    from.
    """
    closed = exists(folder)
    return (
        "everything closed before is intact: make room, then go on with fmbs resume"
        if closed
        else "make room, then run it again"
    )


def exists(folder: Path) -> bool:
    """Whether a folder holds a history."""
    return Store(folder / FOLDER, KIND).there(MANIFEST, None)


def manifest(folder: Path) -> Manifest:
    """The manifest of the history in a folder."""
    files = store_of(folder)
    found: Manifest | None = files.read(MANIFEST, None, Manifest)
    if found is None:
        remedy = f"a run writes its first segment after {EVERY:g} s, or earlier with --checkpoint"
        raise InputError(
            say(
                f"{folder}",
                f"a folder with {FOLDER}/{files.path(MANIFEST, None).name}",
                "none",
                remedy,
            )
        )
    return found


def read(folder: Path) -> Resumed:
    """All states of the history in a folder and its checkpoint; CorruptFile where a byte is not as
    it was written.
    """
    found = manifest(folder)
    files = store_of(folder)
    parts = [
        files.read(SEGMENT, number, needed=True) for number in range(1, len(found.segments) + 1)
    ]
    with container.reading(files.path(MANIFEST, None), KIND):
        rows = joined(parts, (0, *found.segments[:-1]))
    return Resumed(files.read(CHECKPOINT, found.checkpoint, Checkpoint, needed=True), rows)
