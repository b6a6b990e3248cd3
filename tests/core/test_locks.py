"""Locks of files: held until the file is closed, and on Windows by one byte, of which the machine
here has a stand-in.
"""

from __future__ import annotations

import errno
import importlib
from pathlib import Path
from types import SimpleNamespace

import pytest

from fmbs_skfem.core.storage import locks


def test_a_lock_is_held_by_one_file_until_it_is_closed(tmp_path: Path) -> None:
    with (tmp_path / "lock").open("a+") as other:
        with (tmp_path / "lock").open("a+") as first:
            locks.take(first)
            with pytest.raises(BlockingIOError):
                locks.take(other)
        locks.take(other)


def test_on_windows_a_byte_beyond_the_text_is_locked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first call of those that wait gives up after some seconds there, as if the byte were
    taken: it is tried again.
    """
    calls: list[tuple[int, str]] = []

    def locking(number: int, mode: str, count: int) -> None:
        calls.append((file.tell(), mode))
        if len(calls) < 3:
            raise OSError(errno.EACCES if mode == "at once" else errno.EDEADLK, "taken")

    windows = SimpleNamespace(locking=locking, LK_NBLCK="at once", LK_LOCK="some seconds")
    monkeypatch.setattr(importlib, "import_module", {"msvcrt": windows}.__getitem__)
    with (tmp_path / "lock").open("a+") as file:
        file.write("process 7")
        with pytest.raises(BlockingIOError, match="another process"):
            locks.take_byte(file, wait=False)
        locks.take_byte(file, wait=True)
        assert calls == [(locks.BYTE, "at once"), *[(locks.BYTE, "some seconds")] * 2]
        assert file.tell() == len("process 7")
