"""Histories on the disk: what is closed survives kills and full disks, and every byte of it is
verified.
"""

from __future__ import annotations

import itertools
import os
import resource
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from fmbs_skfem.bodies import point_mass
from fmbs_skfem.contact.contacts import ContactPlane
from fmbs_skfem.contact.states import ContactState
from fmbs_skfem.core.errors import CorruptFile, InputError, NoRoom
from fmbs_skfem.core.storage import container, durable, locks
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, integrate, integration, outputs
from fmbs_skfem.dynamics.checkpoint import RunState
from fmbs_skfem.dynamics.trajectory import COLUMNS
from fmbs_skfem.results import segments
from fmbs_skfem.results.segments import HistoryState, Recorder
from fmbs_skfem.systems import At, assemble
from fmbs_skfem.systems.forces import loads

from .. import models
from ..hard_cases import child, ended

SCHEME, STEPS, EVERY = GeneralizedAlpha(5e-4), 20_000, 20
KILLS = 25
SYSTEM = models.spin_up(3)
JOB = {"scene": "spin-up", "changes": {"E": "2 GPa"}}


@pytest.fixture(autouse=True)
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs are looked at often beside their length, rarely beside what a look costs."""
    monkeypatch.setattr(integration, "PACE", 2e-2)


@pytest.fixture(scope="module")
def unbroken() -> Trajectory:
    return integrate(SYSTEM, SCHEME, STEPS * SCHEME.step, every=EVERY)


def go_on(folder: Path, every: float = 0.0) -> Trajectory:
    """The run in a folder from where it is to its end; a segment whenever it is looked at."""
    if segments.exists(folder):
        found = segments.manifest(folder)
        record, resume = Recorder(folder, JOB, every, found), segments.read(folder)
    else:
        record, resume = Recorder(folder, JOB, every), None
    return integrate(SYSTEM, SCHEME, STEPS * SCHEME.step, every=EVERY, record=record, resume=resume)


def done(folder: Path) -> int:
    return segments.manifest(folder).done if segments.exists(folder) else 0


def same(one: Trajectory, other: Trajectory) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("times", "x", "v", "a", "multipliers")
    )


def closed(folder: Path, whole: Trajectory) -> int:
    """Steps in the closed segments of a folder, which are verified and have the bits of the whole
    run.
    """
    found = segments.read(folder)
    for name in COLUMNS:
        np.testing.assert_array_equal(
            getattr(found.rows, name), getattr(whole, name)[: found.checkpoint.kept]
        )
    return found.checkpoint.done


def test_kills_lose_the_open_segment_at_most(tmp_path: Path, unbroken: Trajectory) -> None:
    """A child is killed at a random moment of its second or third segment, the next one goes on; in
    the end nothing is missing.
    """
    random, folders = np.random.default_rng(5), (tmp_path / str(k) for k in itertools.count())
    folder, finished = next(folders), list[Path]()
    folder.mkdir()
    for _ in range(KILLS):
        before, number = done(folder), child(lambda where=folder: go_on(where))
        while done(folder) == before:
            assert (
                os.waitid(os.P_PID, number, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None
                or done(folder) > before
            )
            time.sleep(1e-3)
        time.sleep(random.uniform(0.0, 0.02))
        seen = done(folder)
        os.kill(number, signal.SIGKILL)
        assert ended(number) in (-signal.SIGKILL, 0)
        assert before < seen <= closed(folder, unbroken)
        if done(folder) == STEPS:
            finished.append(folder)
            folder = next(folders)
            folder.mkdir()
    for where in (folder, *finished):
        assert same(go_on(where), unbroken)
        assert segments.manifest(where).state is HistoryState.DONE
        assert [path.name for path in (where / "history").glob("*.part")] == []
        assert len(list((where / "history").glob("checkpoint-*"))) == 1


def test_a_resumed_run_remembers_what_sticks(tmp_path: Path) -> None:
    """Friction drags a mass to and fro; states in between, of which only some are stored, decide
    where it sticks.
    """
    floor = ContactPlane(
        "floor",
        at=At("ball"),
        radius=0.0,
        point=(0.0, 0.0),
        normal=(0.0, 1.0),
        stiffness=1e5,
        friction=0.5,
    )
    push = loads.PointForce("push", At("ball"), (6.0, 0.0), lambda t: np.sin(30.0 * t))
    ball = point_mass("ball", 1.0, np.array([0.0, -9.81e-5]))
    reading = {"floor": ContactState("floor")}
    system = assemble([ball], [], [floor, push, loads.Gravity((0.0, -9.81))], outputs=reading)
    scheme = GeneralizedAlpha(1e-3)
    whole = integrate(system, scheme, 1.0, every=7)
    with pytest.raises(KeyboardInterrupt):
        integrate(
            system,
            scheme,
            1.0,
            every=7,
            record=Recorder(tmp_path, JOB, 0.0),
            progress=interrupt_at(0.5),
        )
    found = segments.manifest(tmp_path)
    assert 0 < found.done < 1000
    gone_on = integrate(
        system,
        scheme,
        1.0,
        every=7,
        record=Recorder(tmp_path, JOB, 0.0, found),
        resume=segments.read(tmp_path),
    )
    assert same(gone_on, whole)
    assert np.ptp(outputs(whole)["floor_friction"]) > 1.0
    for name, values in outputs(whole).items():
        np.testing.assert_array_equal(outputs(gone_on)[name], values)


def interrupt_at(share: float) -> Callable[[float], None]:
    """A listener that stops the run after a share of it."""

    def listen(done: float) -> None:
        if done >= share:
            raise KeyboardInterrupt

    return listen


def test_a_full_disk_ends_the_run_and_leaves_what_was_closed(
    tmp_path: Path, unbroken: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files of more than 40 kB are refused by the system; segments grow up to that and beyond."""
    monkeypatch.setattr(integration, "PACE", 10.0)

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, resource.RLIM_INFINITY))
        go_on(tmp_path)

    assert ended(child(limited)) == 6
    files = list((tmp_path / "history").iterdir())
    assert all(path.suffix != ".part" and path.stat().st_size <= 40_000 for path in files)
    assert 0 < closed(tmp_path, unbroken) < STEPS
    assert same(go_on(tmp_path), unbroken)


def test_a_full_disk_says_so(tmp_path: Path, written: Path) -> None:
    """To go on is advised where there is something to go on from."""
    for folder, advice in ((tmp_path, "run it again"), (written, "fmbs resume")):
        with (
            pytest.raises(
                NoRoom, match=rf"/dev/full: expected room on the disk.*{advice}"
            ) as caught,
            durable.room(Path("/dev/full"), segments.remedy(folder)),
        ):
            Path("/dev/full").write_bytes(b"x")
        assert caught.value.exit_code == 6
    with pytest.raises(FileNotFoundError), durable.room(Path("nowhere")):
        Path("/nowhere/file").write_bytes(b"x")


def test_segments_are_plain_hdf5(written: Path) -> None:
    found = segments.manifest(written)
    assert found.job == JOB
    assert (found.state, found.done, found.steps) == (HistoryState.DONE, 400, 400)
    assert found.time == pytest.approx(0.2)
    whole, rows = integrate(SYSTEM, SCHEME, 0.2), list[np.ndarray]()
    for number, (first, last) in enumerate(itertools.pairwise((0, *found.segments)), 1):
        with h5py.File(written / "history" / f"segment-{number:05d}.h5") as file:
            rows.append(file["x"][()])
            np.testing.assert_array_equal(file["times"][()], whole.times[first:last])
    np.testing.assert_array_equal(np.concatenate(rows), whole.x)


def test_short_runs_write_nothing(tmp_path: Path) -> None:
    integrate(SYSTEM, SCHEME, 0.05, record=Recorder(tmp_path, JOB))
    assert list(tmp_path.iterdir()) == []
    integrate(SYSTEM, SCHEME, 0.05, record=Recorder(tmp_path, JOB, every=1000.0))
    assert len(segments.manifest(tmp_path).segments) == 1


def test_a_segment_is_due_by_time_by_size_and_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def moment(done: int, kept: int) -> RunState:
        return RunState(done, 100, 0.0, kept, 1000, NotImplemented, NotImplemented)

    record = Recorder(tmp_path, JOB)
    assert not record.due(moment(8, 8))
    assert not record.due(moment(100, 100))
    assert record.due(moment(8, segments.LARGEST // 1000 + 1))
    record.last -= segments.EVERY
    assert record.due(moment(8, 8))
    record.took = 1.0  # s for the last one: the next may not take more than a fiftieth of the time
    assert not record.due(moment(8, 8))
    record.last -= 50.0
    assert record.due(moment(8, 8))
    assert Recorder(tmp_path, JOB, every=0.0).due(moment(8, 8))
    assert Recorder(tmp_path, JOB, every=60.0).due(moment(100, 100))


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A history of three segments and more."""
    folder = tmp_path_factory.mktemp("written")
    pace, integration.PACE = integration.PACE, 2e-3
    integrate(SYSTEM, SCHEME, 0.2, record=Recorder(folder, JOB, 0.0))
    integration.PACE = pace
    assert len(segments.manifest(folder).segments) >= 3
    return folder


@pytest.mark.parametrize(
    "name", ["segment-00001.h5", "segment-00003.h5", "checkpoint-*.h5", "manifest.h5"]
)
def test_every_flipped_byte_is_found(name: str, written: Path) -> None:
    """One bit in the first, the last and some random bytes of a file; and a file that is cut off,
    and one that is gone.
    """
    (path,) = (written / "history").glob(name)
    whole = path.read_bytes()
    places = {0, len(whole) - 1, *np.random.default_rng(1).integers(len(whole), size=12).tolist()}
    damaged = [whole[:k] + bytes([whole[k] ^ 1]) + whole[k + 1 :] for k in places]
    try:
        for data in (*damaged, whole[:-1], b""):
            path.write_bytes(data)
            with pytest.raises(CorruptFile, match=path.name) as caught:
                segments.read(written)
            assert caught.value.exit_code == 8
        path.unlink()
        with pytest.raises((CorruptFile, InputError), match=path.name):
            segments.read(written)
    finally:
        path.write_bytes(whole)
    assert segments.read(written).checkpoint.done == 400


def test_a_history_of_another_version_is_refused(
    written: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, found = written / "history" / "manifest.h5", segments.manifest(written)
    data = path.read_bytes()
    monkeypatch.setattr(segments, "KIND", replace(segments.KIND, version=5))
    segments.store_of(written).append(segments.MANIFEST, None, found)
    monkeypatch.undo()
    with pytest.raises(
        CorruptFile,
        match=r"expected version 4 of the format, got version 5; it was written by a newer release",
    ):
        segments.manifest(written)
    path.write_bytes(data)


def test_python_objects_cannot_be_written() -> None:
    """Files hold plain numbers, so that nothing in them could ever be made to run."""
    with pytest.raises(TypeError, match="Object dtype"):
        container.image({"x": np.array([object()])})


def test_a_folder_belongs_to_one_run(tmp_path: Path) -> None:
    with locks.own(tmp_path):
        with pytest.raises(
            InputError,
            match=f"expected a folder no other run writes into, got process {os.getpid()}",
        ):
            locks.own(tmp_path).__enter__()
        number = child(lambda: locks.own(tmp_path).__enter__())
        assert ended(number) == 99
    assert list(tmp_path.iterdir()) == []


def test_the_lock_of_a_killed_run_is_taken_over(tmp_path: Path) -> None:
    def hold() -> None:
        with locks.own(tmp_path):
            os.kill(os.getpid(), signal.SIGSTOP)

    number = child(hold)
    assert os.WIFSTOPPED(os.waitpid(number, os.WUNTRACED)[1])
    os.kill(number, signal.SIGKILL)
    assert ended(number) == -signal.SIGKILL
    with locks.own(tmp_path):
        assert (tmp_path / locks.LOCK).read_text() == f"process {os.getpid()}\n"
    assert list(tmp_path.iterdir()) == []


def test_a_folder_without_a_history(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a folder with history/manifest\.h5, got none"):
        segments.read(tmp_path)
