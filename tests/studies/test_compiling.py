"""First runs compile every function once, whoever begins, and the process beside one ends with it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from fmbs_skfem.core.compiling import jit
from fmbs_skfem.studies import Job, Listener
from fmbs_skfem.studies.running import compiling
from tests.hard_cases import alive

BEGIN = """
import signal
from fmbs_skfem.studies import Job
from fmbs_skfem.studies.running import compiling
compiling.announce(Job())
print(compiling._BESIDE[0].pid, flush=True)
signal.pause()
"""

PATIENT = 600.0  #: after which what hangs is given up; nothing waits for it that goes well [s]


def test_one_compiles_and_the_others_wait(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    events, begun = list[str](), threading.Event()

    def second() -> None:
        begun.set()
        with jit.alone("stepping.advance"):
            events.append("second")

    with jit.alone("stepping.advance"):
        other = threading.Thread(target=second)
        other.start()
        assert begun.wait(PATIENT)
        with jit.alone("settling.settle"):  # another function waits for nobody
            other.join(0.2)
        events.append("first")
    other.join(PATIENT)
    assert events == ["first", "second"]


def test_functions_that_python_calls_are_compiled_by_one_as_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)

    @jit.jit
    def double(x: float) -> float:
        return 2.0 * x

    events = list[str]()
    other = threading.Thread(target=lambda: events.append(f"{double(1.5)}"))
    with jit.alone(f"{double.__module__}.{double.__qualname__}.whole"):
        other.start()
        other.join(0.5)
        events.append("compiled elsewhere")
    other.join(PATIENT)
    assert events == ["compiled elsewhere", "3.0"]


def test_only_the_first_run_says_that_it_compiles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    said = list[str]()
    job = Job(listener=Listener(tell=said.append))
    (tmp_path / "begun").touch()  # another process compiles beside it
    assert compiling.announce(job)
    (tmp_path / "stepping.advance-1.code").touch()
    assert not compiling.announce(job)
    assert len(said) == 1
    (tmp_path / "begun").unlink()
    assert [compiling.first(tmp_path), compiling.first(tmp_path)] == [True, False]


def test_the_process_beside_a_run_ends_with_it(tmp_path: Path) -> None:
    """Also where the run is killed."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    with subprocess.Popen(
        [sys.executable, "-c", BEGIN], env=environment, stdout=subprocess.PIPE, text=True
    ) as run:
        assert run.stdout is not None
        beside = int(run.stdout.readline())
        assert alive(beside)
        run.send_signal(signal.SIGKILL)
    end = time.monotonic() + PATIENT
    while alive(beside) and time.monotonic() < end:
        time.sleep(0.05)
    assert not alive(beside)
