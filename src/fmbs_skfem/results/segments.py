"""The history of a run on the disk while it runs: closed files, so that what kills the process loses the open one at most.

    run.lock                    who writes into the output folder, as long as it does
    history/segment-00001.h5    HDF5: times (s,), x, v, a (s, n), multipliers (s, m), memory (s, l), work (s,)
                                of a run that keeps few states x, v, a (k, n), ..., their numbers `kept` (k,), and in `trace` what
                                was read of all
    history/checkpoint-00001.h5 HDF5: all that the next step reads (`dynamics.checkpoint`), of the newest segment only
    history/manifest.json       the job, segments and checkpoint with sizes and SHA-256, and a SHA-256 of all that

A file is written under another name, flushed to the disk, renamed into its place, and then its folder is flushed. The manifest
comes last: what it lists is there, what it does not list is written again. Files hold numbers and texts only; nothing in them is
executed. Other programs read the segments as plain HDF5.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from enum import Enum
from pathlib import Path
from typing import IO, Any

import numpy as np

from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage import container, durable, endings, locks, validation
from ..core.storage.container import FileKind
from ..core.storage.records import dataclass
from ..dynamics.checkpoint import Checkpoint, Resumed, Rows, RunState
from ..dynamics.trajectory import COLUMNS, Trace, joined_traces

FOLDER, MANIFEST, LOCK = "history", "manifest.json", "run.lock"
REMEDY = "restore the file from a copy, or run the scene anew with --force"
KIND = FileKind("fmbs_skfem history", "a history", REMEDY, "run the scene anew")
EVERY = 10.0  #: time between two segments of a run [s]
SHARE = 0.02  #: of the time of a run that segments may take
LARGEST = 2**28  #: states that wait for the next segment [bytes]
MEMORY = "memory"  #: column without which what forces keep follows from the states
TRACE = "trace"  #: group of what was read of states that are gone
FACT = "fact "  #: before the names of facts, which cannot be taken for those of numbers beside them


class HistoryState(Enum):
    """How far the run of a history is."""

    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"


@dataclass(frozen=True)
class ClosedFile:
    """A closed file."""

    name: str
    size: int  #: [bytes]
    sha256: str
    first: int = 0  #: stored states from this one
    last: int = 0  #: up to this one


@dataclass(frozen=True)
class Manifest:
    """What a history holds."""

    job: dict[str, Any]  #: what is run, in the words of who runs it
    state: HistoryState = HistoryState.RUNNING
    done: int = 0  #: steps
    steps: int = 0  #: of the whole run
    time: float = 0.0  #: [s]
    segments: tuple[ClosedFile, ...] = ()
    checkpoint: ClosedFile | None = None


class Recorder:
    """Keeps a run in `folder`: a segment and a checkpoint every so many seconds; see `dynamics.integrate`.

    Without `every` the first one is written after EVERY seconds, so that short runs write nothing; with it, also at the end.
    """

    def __init__(self, folder: Path, job: Mapping[str, Any], every: float | None = None, manifest: Manifest | None = None) -> None:
        self.folder = folder / FOLDER
        self.every = every
        self.manifest = manifest or Manifest(dict(job))
        self.last, self.took = time.perf_counter(), 0.0

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
        return self.manifest.segments[-1].last if self.manifest.segments else 0

    def write(self, moment: RunState) -> None:
        """Close a segment with all states since the last one, and a checkpoint."""
        begin = time.perf_counter()
        self.folder.mkdir(exist_ok=True)
        segments, old = self.manifest.segments, self.manifest.checkpoint
        if moment.kept > self.kept:
            rows = moment.rows(self.kept, moment.kept)
            name = f"segment-{len(segments) + 1:05d}.h5"
            entry = close(self.folder / name, container.image(columns_of(rows)), self.folder.parent)
            segments = (*segments, replace(entry, first=self.kept, last=moment.kept))
        number = 1 if old is None else int(old.name.split("-")[1].split(".")[0]) + 1
        held = moment.checkpoint()
        numbers = {"done": held.done, "kept": held.kept, "cpu_s": held.cpu_s, "wall_s": held.wall_s}
        content = {**held.arrays, **numbers, **{f"{FACT}{name}": text for name, text in held.facts.items()}}
        checkpoint = close(self.folder / f"checkpoint-{number:05d}.h5", container.image(content), self.folder.parent)
        state = HistoryState.DONE if moment.done == moment.steps else HistoryState.RUNNING
        found = replace(self.manifest, state=state, done=moment.done, steps=moment.steps, time=moment.time)
        self.manifest = replace(found, segments=segments, checkpoint=checkpoint)
        write_manifest(self.folder, self.manifest)
        for path in self.folder.glob("checkpoint-*"):
            if path.name != checkpoint.name:
                path.unlink()
        self.last, self.took = time.perf_counter(), time.perf_counter() - begin

    def fail(self) -> None:
        """Note that the run cannot go on: it would fail again."""
        if self.manifest.checkpoint is not None:
            self.manifest = replace(self.manifest, state=HistoryState.FAILED)
            write_manifest(self.folder, self.manifest)


def columns_of(rows: Rows) -> dict[str, Any]:
    """Arrays of a segment by name."""
    found = {name: value for name, value in vars(rows).items() if value is not None}
    return found if rows.trace is None else found | {TRACE: vars(rows.trace)}


def joined(parts: Sequence[Mapping[str, Any]], firsts: Sequence[int]) -> Rows:
    """The arrays of segments behind each other, of which the first states have these numbers."""
    columns: dict[str, Any] = {column: np.concatenate([part[column] for part in parts]) for column in COLUMNS}
    least = min(part[MEMORY].shape[1] if MEMORY in part else 0 for part in parts)
    memory = np.concatenate([part[MEMORY] if least else np.zeros((len(part["x"]), 0)) for part in parts])
    work = np.concatenate([part["work"] for part in parts])
    if TRACE not in parts[0]:
        return Rows(**columns, memory=memory, work=work)
    trace = joined_traces([Trace(**part[TRACE]) for part in parts])
    kept = np.concatenate([part["kept"] + first for part, first in zip(parts, firsts, strict=True)])
    return Rows(**columns, memory=memory, work=work, trace=trace, kept=kept)


def close(path: Path, data: memoryview | bytes, folder: Path) -> ClosedFile:
    """Put a complete file into its place; NoRoom where the disk is full. `folder`: of the run that it belongs to."""
    durable.write(path, data, remedy(folder))
    return ClosedFile(path.name, len(data), hashlib.sha256(data).hexdigest())


def remedy(folder: Path | None) -> str:
    """What helps where the disk is full: whether the run in a folder has closed what it can go on from."""
    closed = folder is not None and exists(folder)
    return (
        "everything closed before is intact: make room, then go on with fmbs resume" if closed else "make room, then run it again"
    )


def room(path: Path, folder: Path | None = None) -> contextlib.AbstractContextManager[None]:
    """A full disk as an error that says so."""
    return durable.room(path, remedy(folder))


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """The manifest, with a checksum of itself."""
    content = {"format": KIND.title, "version": KIND.version, **asdict(manifest), "state": manifest.state.value}
    close(folder / MANIFEST, json.dumps({**content, "sha256": checksum(content)}, indent=1).encode(), folder.parent)


def checksum(content: Mapping[str, Any]) -> str:
    """SHA-256 of a JSON object."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def exists(folder: Path) -> bool:
    """Whether a folder holds a history."""
    return (folder / FOLDER / MANIFEST).is_file()


def manifest(folder: Path) -> Manifest:
    """The manifest of the history in a folder, its checksum verified."""
    path = folder / FOLDER / MANIFEST
    if not path.is_file():
        remedy = f"a run writes its first segment after {EVERY:g} s, or earlier with --checkpoint"
        raise InputError(say(f"{folder}", f"a folder with {FOLDER}/{MANIFEST}", "none", remedy))
    data = path.read_bytes()
    with container.reading(path, KIND):
        content = json.loads(data)
        own = content.pop("sha256")
        if content["format"] == KIND.title:
            container.check_version(content["version"], KIND)
        validation.require(own == checksum(content), "", f"sha256 {own}", "another one")
        return validation.build(Manifest, content, "manifest")


def read(folder: Path, found: Manifest | None = None) -> Resumed:
    """All states of the history in a folder and its checkpoint; CorruptFile where a byte is not as it was written."""
    found = found or manifest(folder)
    parts = [unpack(folder / FOLDER, entry) for entry in found.segments]
    with container.reading(folder / FOLDER / MANIFEST, KIND):
        if found.checkpoint is None:
            raise validation.Misfit("", "a checkpoint", "none")
        rows = joined(parts, [entry.first for entry in found.segments])
    content = unpack(folder / FOLDER, found.checkpoint)
    with container.reading(folder / FOLDER / found.checkpoint.name, KIND):
        arrays = {name: value for name, value in content.items() if isinstance(value, np.ndarray)}
        facts = {name.removeprefix(FACT): str(text) for name, text in content.items() if name.startswith(FACT)}
        numbers = int(content["done"]), int(content["kept"]), facts, arrays, float(content["cpu_s"]), float(content["wall_s"])
    return Resumed(Checkpoint(*numbers), rows)


def unpack(folder: Path, entry: ClosedFile) -> dict[str, Any]:
    """Arrays and facts of a closed file, its size and checksum verified."""
    path = folder / entry.name
    with container.reading(path, KIND):
        validation.require(path.is_file(), "", "the file", "none")
        data = path.read_bytes()
        container.check_seal(data, {"bytes": str(entry.size), "sha256": entry.sha256})
        return container.unpack(data)


@contextlib.contextmanager
def lock(folder: Path) -> Iterator[None]:
    """The folder belongs to this process; a lock left by one that is gone is taken over with a warning.

    The lock is that of the system on `run.lock`, which ends with the process; the file says who holds it, and goes with it, also
    where a signal ends the process that can be taken.
    """
    path = folder / LOCK
    with endings.raised(), held(path):
        yield


@contextlib.contextmanager
def held(path: Path) -> Iterator[None]:
    """The lock of a file."""
    with room(path):
        file = grab(path)
    try:
        left = file.read().strip()
        file.seek(0)
        file.truncate()
        with room(path):
            file.write(f"process {os.getpid()}\n")
            file.flush()
        if left:
            notify(f"{path.parent}: the lock of {left}, which is gone, is taken over")
        yield
    finally:
        with contextlib.suppress(PermissionError):  # Windows keeps the name of an open file, which is left empty
            file.truncate(0)
            path.unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            file.close()


def grab(path: Path) -> IO[str]:
    """The lock file, opened and locked; InputError where another process has it."""
    while True:
        file = path.open("a+", encoding="utf-8")
        try:
            locks.take(file)
        except BlockingIOError as problem:
            file.seek(0)
            holder = file.read().strip() or "another process"
            file.close()
            remedy = "wait for it, or choose another folder"
            raise InputError(say(f"{path.parent}", "a folder no other run writes into", holder, remedy)) from problem
        file.seek(0)
        with contextlib.suppress(FileNotFoundError):
            if os.fstat(file.fileno()).st_ino == path.stat().st_ino:
                return file
        file.close()  # its holder removed it between opening and locking
