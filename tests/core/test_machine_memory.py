"""Memory of this machine, and that of a machine with Windows, of which there is a stand-in here."""

from __future__ import annotations

import ctypes
from types import SimpleNamespace
from typing import Any

import pytest

from fmbs_skfem.core import machine_memory


def test_memory_of_this_machine() -> None:
    assert 1e6 < machine_memory.free() < machine_memory.built_in() < 1e14


def test_windows_fills_a_struct_of_64_bytes() -> None:
    """MEMORYSTATUSEX of its documentation: two numbers of 4 bytes and seven of 8; the caller writes
    the size of it.
    """

    def answer(pointer: Any) -> int:
        filled = ctypes.cast(pointer, ctypes.POINTER(ctypes.c_uint64 * 8)).contents
        assert filled[0] & 0xFFFFFFFF == 64
        filled[1], filled[2] = 24 * 2**30, 5 * 2**30
        return 1

    kernel: Any = SimpleNamespace(GlobalMemoryStatusEx=answer)
    found = machine_memory.ask_windows(kernel)
    assert (found.built_in, found.free) == (24 * 2**30, 5 * 2**30)
    kernel.GlobalMemoryStatusEx = lambda pointer: 0
    with pytest.raises(OSError, match="how much memory"):
        machine_memory.ask_windows(kernel)
