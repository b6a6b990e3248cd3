"""The history of a run on the disk while it runs: closed files, so that what kills the process loses the open one at most.

    run.lock                    who writes into the output folder, as long as it does
    history/segment-00001.h5    HDF5: times (s,), x, v, a (s, n), multipliers (s, m) of some stored states
    history/checkpoint-00001.h5 HDF5: all that the next step reads (`dynamics.checkpoint`), of the newest segment only
    history/manifest.json       the job, segments and checkpoint with sizes and SHA-256, and a SHA-256 of all that

A file is written under another name, flushed to the disk, renamed into its place, and then its folder is flushed. The manifest
comes last: what it lists is there, what it does not list is written again. Files hold numbers and texts only; nothing in them is
executed. Other programs read the segments as plain HDF5.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import io
import json
import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from enum import Enum
from pathlib import Path
from typing import IO, Any

import numpy as np

from ..core import durable, hdf5
from ..core.errors import CorruptFile, InputError, say
from ..core.notices import notify
from ..dynamics.checkpoint import Checkpoint, Moment, Resumed, Rows

FOLDER, MANIFEST, LOCK = "history", "manifest.json", "run.lock"
FORMAT, VERSION = "fmbs_skfem history", 1
EVERY = 10.0  #: time between two segments of a run [s]
SHARE = 0.02  #: of the time of a run that segments may take
LARGEST = 2**28  #: states that wait for the next segment [bytes]
COLUMNS = ("times", "x", "v", "a", "multipliers")


class State(Enum):
    """How far the run of a history is."""

    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"


@dataclass(frozen=True)
class Entry:
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
    state: State = State.RUNNING
    done: int = 0  #: steps
    steps: int = 0  #: of the whole run
    time: float = 0.0  #: [s]
    segments: tuple[Entry, ...] = ()
    checkpoint: Entry | None = None


class Recorder:
    """Keeps a run in `folder`: a segment and a checkpoint every so many seconds; see `dynamics.integrate`.

    Without `every` the first one is written after EVERY seconds, so that short runs write nothing; with it, also at the end.
    """

    def __init__(self, folder: Path, job: Mapping[str, Any], every: float | None = None, manifest: Manifest | None = None) -> None:
        self.folder = folder / FOLDER
        self.every = every
        self.manifest = manifest or Manifest(dict(job))
        self.last, self.took = time.perf_counter(), 0.0

    def __call__(self, moment: Moment) -> None:
        if self.due(moment):
            self.write(moment)

    def due(self, moment: Moment) -> bool:
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

    def write(self, moment: Moment) -> None:
        """Close a segment with all states since the last one, and a checkpoint."""
        begin = time.perf_counter()
        self.folder.mkdir(exist_ok=True)
        segments, old = self.manifest.segments, self.manifest.checkpoint
        if moment.kept > self.kept:
            rows = moment.rows(self.kept, moment.kept)
            name = f"segment-{len(segments) + 1:05d}.h5"
            columns = {column: getattr(rows, column) for column in COLUMNS}
            entry = close(self.folder / name, image(columns), self.folder.parent)
            segments = (*segments, replace(entry, first=self.kept, last=moment.kept))
        number = 1 if old is None else int(old.name.split("-")[1].split(".")[0]) + 1
        held = moment.checkpoint()
        facts = {"done": held.done, "kept": held.kept, "cpu_s": held.cpu_s, "wall_s": held.wall_s, **prefixed(held.facts)}
        checkpoint = close(self.folder / f"checkpoint-{number:05d}.h5", image(held.arrays, facts), self.folder.parent)
        state = State.DONE if moment.done == moment.steps else State.RUNNING
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
            self.manifest = replace(self.manifest, state=State.FAILED)
            write_manifest(self.folder, self.manifest)


def prefixed(facts: Mapping[str, str]) -> dict[str, str]:
    """Names that cannot be taken for those of numbers beside them."""
    return {f"fact {name}": text for name, text in facts.items()}


def image(arrays: Mapping[str, np.ndarray], facts: Mapping[str, Any] | None = None) -> memoryview:
    """The bytes of an HDF5 file of arrays, with facts as its attributes."""
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        for name, array in arrays.items():
            file[name] = array
        file.attrs.update(facts or {})
    return buffer.getbuffer()


def close(path: Path, data: memoryview | bytes, folder: Path | None = None) -> Entry:
    """Put a complete file into its place; NoRoom where the disk is full. `folder`: of the run that it belongs to."""
    with room(path, folder), durable.place(path) as part:
        part.write_bytes(data)
    return Entry(path.name, len(data), hashlib.sha256(data).hexdigest())


@contextlib.contextmanager
def room(path: Path, folder: Path | None = None) -> Iterator[None]:
    """A full disk as an error that says so, and whether the run in `folder` has closed what it can go on from."""
    remedy = "everything closed before is intact: make room, then go on with fmbs resume"
    with durable.room(path, remedy if folder is not None and exists(folder) else "make room, then run it again"):
        yield


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """The manifest, with a checksum of itself."""
    content = {"format": FORMAT, "version": VERSION, **asdict(manifest), "state": manifest.state.value}
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
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        told = content.pop("sha256")
        kind, version = content.pop("format"), content.pop("version")
    except hdf5.DAMAGE as problem:
        raise corrupt(path, "a manifest", str(problem)) from problem
    if kind == FORMAT and version != VERSION:
        remedy = "go on with the release that wrote it, or run the scene anew"
        raise CorruptFile(say(f"{path}", f"version {VERSION} of the format", f"version {version}", remedy))
    if told != checksum({"format": kind, "version": version, **content}):
        raise corrupt(path, f"sha256 {told}", "another one")
    checkpoint = content["checkpoint"]
    return Manifest(
        **{
            **content,
            "state": State(content["state"]),
            "segments": tuple(Entry(**entry) for entry in content["segments"]),
            "checkpoint": None if checkpoint is None else Entry(**checkpoint),
        }
    )


def read(folder: Path, found: Manifest | None = None) -> Resumed:
    """All states of the history in a folder and its checkpoint; CorruptFile where a byte is not as it was written."""
    found = found or manifest(folder)
    if found.checkpoint is None:
        raise corrupt(folder / FOLDER / MANIFEST, "a checkpoint", "none")
    parts = [read_arrays(folder / FOLDER, entry)[0] for entry in found.segments]
    columns = (np.concatenate([part[column] for part in parts]) for column in COLUMNS)
    arrays, facts = read_arrays(folder / FOLDER, found.checkpoint)
    named = {name.removeprefix("fact "): str(text) for name, text in facts.items() if name.startswith("fact ")}
    held = Checkpoint(int(facts["done"]), int(facts["kept"]), named, arrays, float(facts["cpu_s"]), float(facts["wall_s"]))
    return Resumed(held, Rows(*columns))


def read_arrays(folder: Path, entry: Entry) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Arrays and facts of a closed file, its size and checksum verified."""
    import h5py

    path = folder / entry.name
    if not path.is_file():
        raise corrupt(path, "the file", "none")
    data = path.read_bytes()
    if len(data) != entry.size:
        raise corrupt(path, f"{entry.size} bytes", f"{len(data)}")
    if (got := hashlib.sha256(data).hexdigest()) != entry.sha256:
        raise corrupt(path, f"sha256 {entry.sha256}", got)
    try:
        with h5py.File(io.BytesIO(data), "r") as file:
            return {name: hdf5.array(file, name) for name in file}, dict(file.attrs)
    except hdf5.DAMAGE as problem:
        raise corrupt(path, "arrays", str(problem)) from problem


def corrupt(path: Path, expected: str, got: str) -> CorruptFile:
    return CorruptFile(say(f"{path}", expected, got, "restore the file from a copy, or run the scene anew with --force"))


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """The folder belongs to this process; a lock left by one that is gone is taken over with a notice.

    The lock is that of the system on `run.lock`, which ends with the process; the file says who holds it.
    """
    path = folder / LOCK
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
            notify(f"{folder}: the lock of {left}, which is gone, is taken over")
        yield
    finally:
        path.unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            file.close()


def grab(path: Path) -> IO[str]:
    """The lock file, opened and locked; InputError where another process has it."""
    while True:
        file = path.open("a+", encoding="utf-8")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
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
