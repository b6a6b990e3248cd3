"""First runs compile one after the other."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from fmbs_skfem.core import jit
from fmbs_skfem.studies import Job, Listener, compiling


def test_first_runs_that_begin_together_compile_one_after_the_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second one waits, and finds in the cache what the first has compiled; afterwards nobody waits."""
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    waits, found = threading.Event(), list[bool]()
    job = Job(listener=Listener(tell=lambda text: waits.set() if text.startswith("waiting") else None))

    def second() -> None:
        with compiling.alone(job) as cold:
            found.append(cold)

    with compiling.alone(job) as cold:
        assert cold
        other = threading.Thread(target=second)
        other.start()
        assert waits.wait(10.0)
        assert not found
        (tmp_path / "stepping.advance-1.py311.1.nbc").touch()
    other.join(10.0)
    assert found == [False]
    waits.clear()
    second()
    assert found == [False, False]
    assert not waits.is_set()
