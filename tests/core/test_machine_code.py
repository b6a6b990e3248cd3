"""Machine code on disk: another process loads it without numba, and only what was compiled for the
same.
"""

from __future__ import annotations

import ctypes
import importlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.core.compiling import jit, machine_code

SIGNATURE = "int64(CPointer(int64), int64)"
LOAD = """
import ctypes, sys
from pathlib import Path
from fmbs_skfem.core.compiling import machine_code
numbers = (ctypes.c_int64 * 3)(4, 5, 6)
kind = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)
found = kind(machine_code.read(Path(sys.argv[1])).address)
assert [found(ctypes.addressof(numbers), n) for n in (1, 2, 3)] == [4, 11, 27]
assert not any(name.split(".")[0] == "numba" and name not in machine_code.HELPERS for name in sys.modules)
found(ctypes.addressof(numbers), -1)
import numba
assert numba.njit(lambda n: (numba.carray, n + 1)[1])(2) == 3
assert found(ctypes.addressof(numbers), 3) == 27
"""


def summed(numbers: np.ndarray, count: int) -> int:
    """Allocates, calls what numba has for arrays, and raises an error."""
    if count < 0:
        raise ValueError("nothing to add up")
    kept = np.empty(count, dtype=np.int64)
    for k in range(count):
        kept[k] = k * numbers[k]
    return np.sum(kept) + numbers[0] + kept[-1] // 2


def enclosing(offset: int) -> Callable[[np.ndarray, int], int]:
    def shifted(numbers: np.ndarray, count: int) -> int:
        return numbers[count] + offset

    return shifted


@ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)
def double(number: int) -> int:
    return 2 * number


def calling(numbers: np.ndarray, count: int) -> int:
    """Calls a function of ctypes, which is elsewhere in every process."""
    return double(count)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    jit.kept.cache_clear()
    return tmp_path


def test_another_process_loads_it_without_numba(folder: Path) -> None:
    """Code that allocates arrays and raises errors; what is compiled there later works as well."""
    jit.addressed(SIGNATURE, summed)
    (file,) = folder.glob("test_machine_code.summed-*.code")
    ended = subprocess.run(
        [sys.executable, "-c", LOAD, str(file)], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    assert "ValueError: nothing to add up" in ended.stderr


def test_a_damaged_file_is_compiled_again(folder: Path) -> None:
    function = enclosing(7)
    numbers = (ctypes.c_int64 * 2)(1, 2)
    call = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)
    for damage in (None, lambda data: data[:-40], lambda data: data[:-1] + b"?", lambda data: b""):
        if damage is not None:
            (file,) = folder.glob("*.code")
            good = file.read_bytes()
            file.write_bytes(damage(good))
            assert machine_code.read(file) is None
        found = jit.addressed(SIGNATURE, function)
        assert call(found.address)(ctypes.addressof(numbers), 1) == 9
    assert [path.suffix for path in folder.iterdir() if path.suffix != ".lock"] == [".code"]
    assert isinstance(jit.addressed(SIGNATURE, function), machine_code.Code)


def test_code_with_addresses_of_this_process_is_not_kept(folder: Path) -> None:
    found = jit.addressed(SIGNATURE, calling)
    call = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)
    assert call(found.address)(0, 21) == 42
    assert not list(folder.glob("*.code"))


def test_code_is_found_by_what_the_functions_enclose_that_it_encloses(folder: Path) -> None:
    def adding(offset: int) -> Callable[[np.ndarray, int], int]:
        @jit.jit
        def shift(number: int) -> int:
            return number + offset

        def shifted(numbers: np.ndarray, count: int) -> int:
            return shift(numbers[count])

        return shifted

    numbers, call = (
        (ctypes.c_int64 * 2)(1, 2),
        ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64),
    )
    kept = [jit.addressed(SIGNATURE, adding(offset)) for offset in (7, 8)]
    assert [call(one.address)(ctypes.addressof(numbers), 1) for one in kept] == [9, 10]


def test_code_is_found_only_for_what_it_was_compiled_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The signature, what the function encloses, its file, the processor and the settings that
    change code make different names.
    """

    def name(function: Callable[..., int], *given: object) -> Path | None:
        machine_code.machine.cache_clear()
        return machine_code.place(tmp_path, "f", function, given)

    written = tmp_path / "written.py"
    written.write_text("def f(x):\n    return x\n")
    space: dict[str, Callable[..., int]] = {}
    exec(compile(written.read_text(), str(written), "exec"), space)
    first = name(space["f"], SIGNATURE, False)
    names = {first, name(space["f"], SIGNATURE, True), name(enclosing(1)), name(enclosing(2))}
    assert name(space["f"], SIGNATURE, False) == first
    os.utime(written, (0.0, 0.0))
    assert name(space["f"], SIGNATURE, False) == first  # the text counts, not when it was written
    written.write_text("def f(x):\n    return x  #\n")
    names.add(name(space["f"], SIGNATURE, False))
    last = name(space["f"], SIGNATURE, False)
    # as in the processes of a sweep, which load what was compiled before
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    assert name(space["f"], SIGNATURE, False) == last
    monkeypatch.setenv("NUMBA_OPT", "1")
    names.add(name(space["f"], SIGNATURE, False))
    monkeypatch.setattr("llvmlite.binding.get_host_cpu_name", lambda: "another")
    names.add(name(space["f"], SIGNATURE, False))
    assert len(names) == 7
    assert None not in names
    assert name(enclosing(lambda: 1)) is None  # type: ignore[arg-type]
    machine_code.machine.cache_clear()


def test_code_of_own_modules_is_found_by_the_texts_of_all_that_they_import(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An extension may call functions and use constants of another file of its author's."""
    monkeypatch.syspath_prepend(tmp_path)
    first, second = tmp_path / "my_kernel.py", tmp_path / "my_numbers.py"
    first.write_text(
        "from my_numbers import OFFSET, TABLE, shift\n\ndef kernel(x):\n    return shift(x) + OFFSET + TABLE[0]\n"
    )

    def name(numbers: str) -> Path | None:
        second.write_text(numbers)
        for imported in ("my_kernel", "my_numbers"):
            sys.modules.pop(imported, None)
        importlib.invalidate_caches()
        return machine_code.place(tmp_path, "f", importlib.import_module("my_kernel").kernel, ())

    texts = ["import numpy as np\nOFFSET = 1\nTABLE = np.ones(2)\ndef shift(x): return x\n"]
    texts += [
        texts[0].replace("OFFSET = 1", "OFFSET = 20"),
        texts[0].replace("ones", "zeros"),
        texts[0] + "\n\n",
    ]
    assert len({name(text) for text in texts}) == 4
    assert name(texts[0]) == name(texts[0])
    for imported in ("my_kernel", "my_numbers"):
        del sys.modules[imported]
