"""How much memory this machine has, asked of its system."""

from __future__ import annotations

import ctypes
import os
import sys


class MemoryStatus(ctypes.Structure):
    """What Windows says of memory, its MEMORYSTATUSEX: sizes [B]."""

    _fields_ = (
        ("size", ctypes.c_uint32),
        ("load", ctypes.c_uint32),
        ("built_in", ctypes.c_uint64),
        ("free", ctypes.c_uint64),
        ("others", ctypes.c_uint64 * 5),
    )


def built_in() -> float:
    """Memory [B] that is built in."""
    if sys.platform == "win32":
        found = ask_windows(ctypes.windll.kernel32).built_in
    else:
        found = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return float(found)


def free() -> float:
    """Memory [B] that no process uses; half of what is built in where the system does not say."""
    if sys.platform == "win32":
        found = ask_windows(ctypes.windll.kernel32).free
    elif "SC_AVPHYS_PAGES" in os.sysconf_names:
        found = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_AVPHYS_PAGES")
    else:
        return 0.5 * built_in()
    return float(found)


def ask_windows(kernel: ctypes.CDLL) -> MemoryStatus:
    """What its library `kernel32` says."""
    status = MemoryStatus(size=ctypes.sizeof(MemoryStatus))
    if not kernel.GlobalMemoryStatusEx(ctypes.byref(status)):
        raise OSError("Windows does not say how much memory this machine has")
    return status
