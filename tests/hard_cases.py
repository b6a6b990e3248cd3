"""What tests of hard cases share: processes that are killed, files that are damaged."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fmbs_skfem.core.errors import CorruptFile, NoRoom
from fmbs_skfem.core.storage import container


def child(work: Callable[[], object]) -> int:
    """A process with all that this one has imported and compiled; its number. It ends with the code
    that `work` returns, else 0.
    """
    with warnings.catch_warnings():
        # other threads of the test runner do not matter there
        warnings.simplefilter("ignore", DeprecationWarning)
        number = os.fork()
    if number:
        return number
    code = 99
    try:
        found = work()
        code = found if isinstance(found, int) else 0
    except NoRoom as error:
        code = error.exit_code
    finally:
        os._exit(code)


def ended(number: int) -> int:
    """How a child ended: its exit code, or minus the signal that killed it."""
    return os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])


def alive(number: int) -> bool:
    """Whether a process runs, and is not only waiting for its parent to take notice of its end."""
    try:
        return "Z" not in Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False


def check_damage_is_found(path: Path, load: Callable[[Path], Any]) -> None:
    """`load` names every flipped bit and every cut of a file of `core.storage.container` as damage;
    half of the file stays.
    """
    data = path.read_bytes()
    for place in [
        0,
        40,
        60,
        90,
        *range(container.HEADER, len(data), len(data) // 40),
        len(data) - 1,
    ]:
        damaged = bytearray(data)
        damaged[place] ^= 1
        path.write_bytes(damaged)
        with pytest.raises(CorruptFile) as caught:
            load(path)
        assert caught.value.exit_code == 8
    for length in (0, 1, 100, container.HEADER, len(data) - 1, len(data) // 2):
        path.write_bytes(data[:length])
        with pytest.raises(CorruptFile):
            load(path)
