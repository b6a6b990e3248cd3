"""`fmbs resume`: stopped, killed and full-disk runs go on to the same bytes; what has changed is
refused by name.
"""

from __future__ import annotations

import json
import math
import os
import resource
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fmbs_skfem.core.storage import endings, locks
from fmbs_skfem.dynamics import integration
from fmbs_skfem.dynamics.checkpoint import RunState
from fmbs_skfem.results import segments
from fmbs_skfem.results.segments import HistoryState, Recorder
from fmbs_skfem.studies import reports
from fmbs_skfem.studies.running import recording, solving

from ..hard_cases import child, ended
from .calls import Call, fmbs, scene

MOTION = "{type: dynamic, duration: 0.4 s, step: 1 ms}"
LONG = "{type: dynamic, duration: 5 s, step: 1 ms, every: 20}"
HISTORY = "1 + sin(40 * t)"
STOPS = [
    (signal.SIGINT, 130, "interrupted"),
    (signal.SIGTERM, 143, "terminated"),
    (signal.SIGHUP, 129, "terminal closed"),
]


@pytest.fixture(autouse=True)
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs are looked at every few milliseconds, and write no segment of their own on a machine
    that compiles slowly.
    """
    monkeypatch.setattr(integration, "PACE", 2e-3)
    monkeypatch.setattr(segments, "EVERY", 3600.0)


def run(path: Path, out: Path, *more: str) -> Call:
    return fmbs("run", path, "--out", out, "--no-plots", "--json", *more)


def stop(monkeypatch: pytest.MonkeyPatch, number: int, looks: int = 3) -> None:
    """A signal arrives in this process at a look at the run, which writes no segment of its own."""
    seen: list[int] = []

    def due(self: Recorder, moment: RunState) -> bool:
        seen.append(moment.done)
        if len(seen) == looks:
            os.kill(os.getpid(), number)
        return False

    monkeypatch.setattr(Recorder, "due", due)


@pytest.fixture(autouse=True)
def heard() -> Iterator[None]:
    """Signals that are ignored where the tests run in the background, as by nohup, are heard."""
    before = {number: signal.getsignal(number) for number in endings.STOPS}
    for number, handler in before.items():
        if handler is signal.SIG_IGN:
            signal.signal(
                number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
            )
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    """The output folder of a run of `tmp_path / cantilever.yaml` that SIGTERM stopped."""
    with pytest.MonkeyPatch.context() as patch:
        stop(patch, signal.SIGTERM)
        assert run(scene(tmp_path, MOTION, HISTORY), tmp_path / "out").code == 143
    return tmp_path / "out"


@pytest.mark.parametrize(("number", "code", "reason"), STOPS)
def test_a_stopped_run_goes_on_to_the_same_bytes(
    number: int, code: int, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, out, handlers = (
        scene(tmp_path, MOTION, HISTORY),
        tmp_path / "out",
        [signal.getsignal(k) for k in endings.STOPS],
    )
    assert run(path, tmp_path / "whole").code == 0
    with monkeypatch.context() as patch:
        stop(patch, number)
        done = run(path, out)
    assert done.code == code
    assert done.json["reason"] == reason
    assert "of 400 steps; go on with: fmbs resume" in done.json["message"]
    assert sorted(item.name for item in out.iterdir()) == ["history"]
    assert [signal.getsignal(k) for k in endings.STOPS] == handlers
    again = fmbs("resume", out, "--no-plots", "--json")
    assert again.code == 0
    assert (out / "outputs.csv").read_bytes() == (tmp_path / "whole" / "outputs.csv").read_bytes()
    whole = json.loads((tmp_path / "whole" / "report.json").read_text())
    for key in (
        "steps",
        "newton_iterations",
        "factorisations",
        "energy_drift",
        "outputs",
        "fingerprint",
        "provenance",
    ):
        assert again.json[key] == whole[key]
    assert again.json["segments"] == 2
    assert whole["segments"] == 0
    assert segments.manifest(out).state is HistoryState.DONE


def test_a_run_whose_time_is_over_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    path, out = scene(tmp_path, LONG, HISTORY), tmp_path / "out"
    assert run(path, tmp_path / "whole", "--time-limit", "1000").code == 0
    done = run(path, out, "--time-limit", "0.01")
    assert done.code == 6
    assert done.json["reason"] == "limit reached"
    assert "stopped by --time-limit 0.01 at t = " in done.json["message"]
    assert "of 5000 steps; go on with: fmbs resume" in done.json["message"]
    assert segments.manifest(out).state is HistoryState.RUNNING
    assert fmbs("resume", out, "--time-limit", "0.01").code == 6
    assert fmbs("resume", out, "--no-plots").code == 0
    assert (out / "outputs.csv").read_bytes() == (tmp_path / "whole" / "outputs.csv").read_bytes()
    assert (
        run(
            scene(tmp_path, "{type: static, load_steps: 2}"),
            tmp_path / "static",
            "--time-limit",
            "1",
        ).code
        == 3
    )


def test_a_run_is_stopped_and_goes_on_many_times(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, out = scene(tmp_path, MOTION, HISTORY), tmp_path / "out"
    assert run(path, tmp_path / "whole").code == 0
    with monkeypatch.context() as patch:
        stop(patch, signal.SIGINT, 1)
        assert run(path, out).code == 130
        for _ in range(5):
            stop(patch, signal.SIGINT, 1)
            assert fmbs("resume", out, "--no-plots").code == 130
    assert len(segments.manifest(out).segments) == 6
    assert fmbs("resume", out, "--no-plots").code == 0
    assert fmbs("resume", out, "--no-plots").code == 0  # what is done is written once more
    assert (out / "outputs.csv").read_bytes() == (tmp_path / "whole" / "outputs.csv").read_bytes()


def ended_with(done: Call) -> int:
    """The exit code of a call in a child, what it wrote on stdout."""
    os.write(1, (done.out + done.err).encode())
    return done.code


def test_a_killed_run_goes_on_to_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While it is there, though it stands still, its folder is taken; it stands still from its
    first segment on.
    """
    path, out, write = scene(tmp_path, LONG, HISTORY), tmp_path / "out", Recorder.write

    def stopped_run() -> int:
        def stop(self: Recorder, moment: RunState) -> None:
            write(self, moment)
            os.kill(os.getpid(), signal.SIGSTOP)

        monkeypatch.setattr(Recorder, "write", stop)
        return ended_with(run(path, out, "--checkpoint", "0"))

    number = child(stopped_run)
    assert os.WIFSTOPPED(os.waitpid(number, os.WUNTRACED)[1])
    busy = fmbs("resume", out)
    os.kill(number, signal.SIGKILL)
    assert ended(number) == -signal.SIGKILL
    assert busy.code == 3
    assert f"a folder no other run writes into, got process {number}" in busy.err
    assert 0 < segments.manifest(out).done < 5000
    monkeypatch.setattr(integration, "PACE", 10.0)
    again = fmbs("resume", out, "--no-plots", "--json")
    assert again.code == 0
    assert run(path, tmp_path / "whole").code == 0
    assert (out / "outputs.csv").read_bytes() == (tmp_path / "whole" / "outputs.csv").read_bytes()


def test_a_full_disk_ends_a_run_that_goes_on_later(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The system refuses files of more than 100 kB: segments grow beyond that."""
    path, out = scene(tmp_path, LONG, HISTORY), tmp_path / "out"
    monkeypatch.setattr(integration, "PACE", 10.0)

    def limited() -> int:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, resource.RLIM_INFINITY))
        return ended_with(run(path, out, "--checkpoint", "0"))

    assert ended(child(limited)) == 6
    told = capfd.readouterr().out
    assert '"reason": "limit reached"' in told
    assert "expected room on the disk, got file too large" in told
    assert segments.read(out).checkpoint.done == segments.manifest(out).done > 0
    assert fmbs("resume", out, "--no-plots").code == 0
    assert run(path, tmp_path / "whole").code == 0
    assert (out / "outputs.csv").read_bytes() == (tmp_path / "whole" / "outputs.csv").read_bytes()


def test_short_runs_leave_results_only(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(scene(tmp_path, MOTION), out).code == 0
    assert sorted(item.name for item in out.iterdir()) == [
        "outputs.csv",
        "outputs.units.json",
        "report.json",
    ]
    assert fmbs("resume", out).code == 3
    assert run(tmp_path / "cantilever.yaml", out, "--checkpoint", "1000").code == 0
    assert len(segments.manifest(out).segments) == 1


def test_a_run_that_can_go_on_is_not_overwritten(stopped: Path) -> None:
    path = stopped.parent / "cantilever.yaml"
    before = segments.manifest(stopped)
    for more in ((), ("--set", "load=2 N")):
        refused = run(path, stopped, *more)
        assert refused.code == 3
        assert "a run that was stopped at t = " in refused.err
        assert "go on with: fmbs resume" in refused.err
    assert segments.manifest(stopped) == before
    assert run(path, stopped, "--force").code == 0
    assert not (stopped / "history").exists()


def test_the_history_of_another_run_is_kept(tmp_path: Path) -> None:
    path, out = scene(tmp_path, MOTION), tmp_path / "out"
    assert run(path, out, "--checkpoint", "1000").code == 0
    for name in ("outputs.csv", "outputs.units.json", "report.json"):
        (out / name).unlink()
    refused = run(path, out, "--set", "load=2 N")
    assert refused.code == 3
    assert "the history of another run" in refused.err
    assert segments.manifest(out).state is HistoryState.DONE
    assert run(path, out).code == 0
    assert not (out / "history").exists()


def test_a_folder_in_use_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    with locks.own(out):
        refused = run(scene(tmp_path, MOTION), out)
        assert refused.code == 3
        assert (
            f"a folder no other run writes into, got process {os.getpid()}; wait for it"
            in refused.err
        )
        assert [item.name for item in out.iterdir()] == [locks.LOCK]


def test_a_run_that_cannot_start_leaves_no_folder(tmp_path: Path) -> None:
    path = scene(tmp_path, MOTION)
    path.write_text(path.read_text().replace("at: beam.right, force", "at: beam.wrong, force"))
    assert run(path, tmp_path / "out").code == 3
    assert not (tmp_path / "out").exists()


def test_a_run_that_failed_may_be_repeated(tmp_path: Path) -> None:
    """A force of 1e12 N from 0.2 s on cannot be followed; the history says so, and resuming fails
    alike.
    """
    path, out = scene(tmp_path, MOTION, "where(t < 0.2, 1, 1e12)"), tmp_path / "out"
    first = run(path, out, "--checkpoint", "0")
    assert first.code == 4
    assert segments.manifest(out).state is HistoryState.FAILED
    outputs = (out / "outputs.csv").read_bytes()
    again = fmbs("resume", out, "--no-plots", "--json")
    assert again.code == 4
    assert again.json["message"] == first.json["message"]
    assert (out / "outputs.csv").read_bytes() == outputs
    assert run(path, out).code == 4


@pytest.mark.parametrize("name", ["segment-00001.h5", "checkpoint-00001.h5", "manifest.h5"])
def test_a_flipped_byte_is_found(name: str, stopped: Path) -> None:
    path = stopped / "history" / name
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4
    path.write_bytes(data)
    refused = fmbs("resume", stopped, "--json")
    assert refused.code == 8
    assert refused.json["reason"] == "corrupt file"
    assert name in refused.json["message"]
    assert not (stopped / "outputs.csv").exists()


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        (
            "1 GPa",
            "2 GPa",
            "scene.bodies.beam.material.young_modulus: 1000000000.0 then, 2000000000.0 now",
        ),
        ("step: 1 ms", "step: 2 ms", "scene.analysis.step: 0.001 then, 0.002 now"),
        ("0.5 N", "0.4 N", "scene.parameters.load: 0.5 then, 0.4 now"),
        (
            "1 + sin(40 * t)",
            "1 + sin(41 * t)",
            "scene.loads.tip.history: '1 + sin(40 * t)' then, '1 + sin(41 * t)' now",
        ),
    ],
)
def test_a_scene_that_has_changed_is_refused_by_name(
    old: str, new: str, named: str, stopped: Path
) -> None:
    path = stopped.parent / "cantilever.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    refused = fmbs("resume", stopped)
    assert refused.code == 8
    assert named in refused.err
    path.write_text(text + "# a remark changes nothing\n")
    assert fmbs("resume", stopped, "--no-plots").code == 0


def test_a_mesh_that_has_changed_is_refused(stopped: Path) -> None:
    mesh = stopped.parent / "beam_20.msh"
    shutil.copy(Path(__file__).parents[2] / "meshes" / "beam_100.msh", mesh)
    refused = fmbs("resume", stopped)
    assert refused.code == 8
    assert f"sha256 of {mesh}" in refused.err


def rewritten(folder: Path, key: str, values: Mapping[str, Any]) -> None:
    """Change what a manifest says of the origin of its run, with a right checksum."""
    found = segments.manifest(folder)
    origin = dict(found.job["provenance"])
    origin[key] = {**origin[key], **values}
    segments.store_of(folder).append(
        segments.MANIFEST, None, replace(found, job={**found.job, "provenance": origin})
    )


def test_another_release_is_refused_and_other_libraries_are_told(stopped: Path) -> None:
    own = segments.manifest(stopped).job["provenance"]["versions"]
    rewritten(stopped, "versions", {"fmbs_skfem": "0.0.9"})
    refused = fmbs("resume", stopped)
    assert refused.code == 8
    assert f"release of fmbs_skfem: 0.0.9 then, {own['fmbs_skfem']} now" in refused.err
    rewritten(stopped, "versions", {"fmbs_skfem": own["fmbs_skfem"], "numpy": "1.0"})
    assert fmbs("resume", stopped, "--strict").code == 3
    done = fmbs("resume", stopped, "--no-plots", "--json")
    assert done.code == 0
    assert (
        f"versions.numpy: '1.0' then, '{own['numpy']}' now; the numbers may differ in their last digits"
        in done.json["notices"][0]
    )


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    assert fmbs("resume", tmp_path / "nowhere").code == 3
    refused = fmbs("resume", tmp_path)
    assert refused.code == 3
    assert "expected a folder with history/manifest.h5, got none" in refused.err
    assert fmbs("resume", tmp_path, "--out", tmp_path / "other").code == 3
    assert (
        run(
            scene(tmp_path, "{type: static, load_steps: 2}"), tmp_path / "out", "--checkpoint", "1"
        ).code
        == 3
    )
    assert (
        "--checkpoint: expected a scene"
        in run(tmp_path / "model.h5", tmp_path / "out", "--checkpoint", "1").err
    )


def test_options_of_the_run_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, more = scene(tmp_path, MOTION, HISTORY), ("--set", "load=2 N", "--duration", "0.3")
    monkeypatch.chdir(tmp_path)
    assert run(path, tmp_path / "whole", *more).code == 0
    with monkeypatch.context() as patch:
        stop(patch, signal.SIGINT)
        assert run(Path("cantilever.yaml"), Path("out"), *more).code == 130
    monkeypatch.chdir("/")
    assert fmbs("resume", tmp_path / "out", "--no-plots").code == 0
    assert (tmp_path / "out" / "outputs.csv").read_bytes() == (
        tmp_path / "whole" / "outputs.csv"
    ).read_bytes()


def test_a_report_says_where_its_numbers_come_from(tmp_path: Path) -> None:
    path = scene(tmp_path, MOTION, HISTORY)
    found = run(path, tmp_path / "out", "--set", "load=0.25 N").json["provenance"]
    assert found["scene"]["parameters"] == {"load": 0.25}
    assert found["scene"]["bodies"]["beam"]["material"]["young_modulus"] == 1e9
    assert found["scene"]["loads"]["tip"]["history"] == HISTORY
    assert set(found["files"]) == {str(path), str(tmp_path / "beam_20.msh")}
    assert all(len(digest) == 64 for digest in found["files"].values())
    assert {"fmbs_skfem", "python", "numpy", "scipy", "numba"} <= set(found["versions"])
    assert found["machine"]["cores"] == os.cpu_count()
    assert found["machine"]["processor"]
    assert found["threads"] == {"blas": 1, "workers": 1}
    assert found["seeds"] == {"solver": 0}
    assert found == json.loads((tmp_path / "out" / "report.json").read_text())["provenance"]
    assert found == reports.plain(found)


def test_the_same_input_gives_the_same_bits_in_another_process(tmp_path: Path) -> None:
    path = scene(tmp_path, MOTION, HISTORY)
    assert run(path, tmp_path / "here").code == 0
    command = [
        Path(sys.executable).parent / "fmbs",
        "run",
        path,
        "--out",
        tmp_path / "there",
        "--no-plots",
        "--checkpoint",
        "0",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "here" / "outputs.csv").read_bytes() == (
        tmp_path / "there" / "outputs.csv"
    ).read_bytes()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_run_that_has_shown_no_state_yet_is_stopped_at_once(number: int, tmp_path: Path) -> None:
    """On the way to the equilibrium in which it starts there is nothing to keep: the signal acts as
    it does elsewhere.
    """
    heard: list[int] = []
    usual = signal.signal(number, lambda one, _: heard.append(one))
    try:
        with recording.stoppable(Recorder(tmp_path, {}), math.inf):
            signal.raise_signal(number)
            assert heard == [number]
    finally:
        signal.signal(number, usual)


@pytest.mark.parametrize(("number", "code", "reason"), STOPS[1:])
def test_a_run_that_is_stopped_on_the_way_to_its_start_leaves_nothing(
    number: int, code: int, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not its lock either, which the next run would say that it takes over; the process ends as by
    the signal.
    """
    path, out = scene(tmp_path, MOTION, HISTORY), tmp_path / "out"
    monkeypatch.setattr(solving, "warm_up", lambda task, cold: os.kill(os.getpid(), number))
    stopped = run(path, out)
    assert (stopped.code, stopped.json["reason"]) == (code, reason)
    assert not out.exists()
    assert signal.getsignal(number) is signal.SIG_DFL


def test_a_closed_terminal_is_ignored_where_it_was(tmp_path: Path) -> None:
    """As under nohup."""
    usual = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with endings.raised(), recording.stoppable(Recorder(tmp_path, {}), math.inf):
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, usual)
