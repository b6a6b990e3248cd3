"""Machine code on disk, loaded by LLVM alone: numba, whose import and set-up take a second, is
there where functions are compiled.

    path = place(folder, name, function, given)    its name has a hash of all that the code depends on
    write(path, compiled)                          what numba made of a function: an object file and the name of its entry
    read(path)                                     the same function again, behind an address; None where it is not there

A file is the SHA-256 of the rest, one line with the name of the entry and of all that the code
calls outside of itself, and the object file. One that is damaged counts as not there.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import importlib.machinery
import importlib.util
import os
import pickle
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ..storage.records import dataclass

SUFFIX = ".code"
#: extension modules of numba whose functions compiled code calls -> what their names begin with
HELPERS = {"numba._helperlib": "numba_", "numba.core.runtime._nrt_python": "NRT_"}
#: settings of numba that leave the code as it is: processes with one thread each, as those of
#: sweeps, load that of others
APART = {"NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS"}
INSTALLED = {
    sys.prefix,
    sys.base_prefix,
    os.path.realpath(sys.prefix),
    os.path.realpath(sys.base_prefix),
}
LOCK = threading.Lock()


@dataclass(frozen=True)
class Code:
    """A function that is loaded; its code lives as long as the process."""

    address: int


@functools.cache
def machine() -> tuple[str, ...]:
    """What all code of this process depends on: the processor, Python, and the settings of numba in
    the environment.
    """
    import llvmlite.binding as llvm

    settings = sorted(
        f"{key}={value}"
        for key, value in os.environ.items()
        if key.startswith("NUMBA_") and key not in APART
    )
    processor = (
        llvm.get_process_triple(),
        llvm.get_host_cpu_name(),
        llvm.get_host_cpu_features().flatten(),
    )
    return (*processor, str(sys.implementation.cache_tag), *settings)


def place(
    folder: Path, name: str, function: Callable[..., Any], given: tuple[object, ...]
) -> Path | None:
    """The file of a function compiled for what is `given`, such as its signature; None where its
    closure cannot be hashed.

    It looks at the text of the function's file, of which the bytecode tells what a factory made,
    and at what it encloses; of a function outside of this package also at what its module imports
    (`outside`): `folder` knows the modules of the package alone.
    """
    cells = function.__closure__ or ()
    try:
        text = digest_of(Path(function.__code__.co_filename))
        closure = pickle.dumps([identity(cell.cell_contents) for cell in cells])
    except (OSError, ValueError, TypeError, AttributeError, pickle.PicklingError):
        return None
    own = (
        function.__module__,
        function.__qualname__,
        function.__code__.co_firstlineno,
        function.__code__.co_code,
        closure,
    )
    parts = (*machine(), *own, text, *outside(function.__module__), *map(str, given))
    return folder / f"{name}-{hashlib.sha256(repr(parts).encode()).hexdigest()[:24]}{SUFFIX}"


def digest_of(path: Path) -> str:
    """SHA-256 of the text of a file; OSError where it cannot be read."""
    return digest(path, path.stat().st_mtime_ns)


@functools.cache
def digest(path: Path, changed: int) -> str:
    """As `digest_of`, of a file that changed at an instant: read once."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def outside(name: str) -> list[str]:
    """What compiled functions of a module outside of this package may depend on: texts of all
    modules that it and those that it imports name, but for installed ones, and their constants,
    which may come from anywhere.
    """
    found: dict[str, str] = {}
    left = [name]
    while left:
        name = left.pop()
        module = sys.modules.get(name)
        file = getattr(module, "__file__", None)
        if name in found or module is None or not file or is_installed(name, Path(file)):
            continue
        values = [value for key, value in vars(module).items() if not key.startswith("__")]
        found[name] = f"{digest_of(Path(file))} {sorted(map(constant, values))}"
        left += [
            value.__name__
            if isinstance(value, ModuleType)
            else str(getattr(value, "__module__", ""))
            for value in values
        ]
    return [found[name] for name in sorted(found)]


def constant(value: object) -> str:
    """A number, a text, an array or a tuple of these, which compiled code may contain; nothing of
    anything else.
    """
    if isinstance(value, np.ndarray):
        return repr((value.shape, value.dtype, value.tobytes())) if value.dtype != object else ""
    if isinstance(value, tuple):
        return "".join(map(constant, value))
    return repr(value) if isinstance(value, bool | int | float | complex | str) else ""


def is_installed(name: str, file: Path) -> bool:
    """Whether a module is of this package, which the folder of its code knows, or comes with Python
    or an installed package.
    """
    return name.partition(".")[0] == __name__.partition(".")[0] or any(
        map(file.is_relative_to, INSTALLED)
    )


def identity(enclosed: Any) -> Any:
    """What a function encloses; of another compiled one where it stands, its bytecode, and what it
    encloses in turn.
    """
    function = getattr(enclosed, "py_func", None)
    if function is None:
        return enclosed
    within = [identity(cell.cell_contents) for cell in function.__closure__ or ()]
    return function.__module__, function.__qualname__, function.__code__.co_code, within


def write(path: Path, compiled: Any) -> None:
    """Keep a C callback of numba, if it holds no addresses of this process, as of functions of
    ctypes; OSError without room.
    """
    library = compiled._library
    if library.has_dynamic_globals:
        return
    _, _, (code, _) = library.serialize_using_object_code()
    module = library._final_module
    named = [
        one.name for one in (*module.functions, *module.global_variables) if one.is_declaration
    ]
    called = [name for name in named if not name.startswith("llvm.")]
    data = "\t".join((compiled.native_name, *called)).encode() + b"\n" + code
    part = path.with_suffix(f".{os.getpid()}.{threading.get_ident()}.part")
    try:
        part.write_bytes(hashlib.sha256(data).digest() + data)
        part.replace(path)
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def read(path: Path) -> Code | None:
    """The function in a file; None where there is none."""
    try:
        found = path.read_bytes()
    except OSError:
        return None
    digest, data = found[:32], found[32:]
    if hashlib.sha256(data).digest() != digest:
        return None
    head, _, code = data.partition(b"\n")
    entry, *called = head.decode().split("\t")
    import llvmlite.binding as llvm

    with LOCK:
        linker = engine()  # with one, LLVM finds what this process has
        for introduce in (introduce_helpers, introduce_numba):
            if not all(map(llvm.address_of_symbol, called)):
                introduce()
        if not all(map(llvm.address_of_symbol, called)):
            return None  # LLVM would end the process
        linker.add_object_file(llvm.ObjectFileRef.from_data(code))
        linker.finalize_object()
        return Code(int(linker.get_function_address(entry)))


@functools.cache
def engine() -> Any:
    """What links object files into this process, as numba's own does."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), target)


def introduce_helpers() -> None:
    """Tell LLVM where the helpers of numba are, without its other modules, as numba does when it
    compiles.
    """
    import builtins

    import llvmlite.binding as llvm

    with contextlib.suppress(ImportError, AttributeError):  # another numba may have them elsewhere
        for name, prefix in HELPERS.items():
            for helper, address in helpers(name).items():
                llvm.add_symbol(helper if helper.startswith("_") else prefix + helper, address)
    for error in vars(builtins).values():
        if isinstance(error, type) and issubclass(error, BaseException):
            llvm.add_symbol(f"PyExc_{error.__name__}", id(error))


def introduce_numba() -> None:
    """Let numba tell LLVM where all is that its code calls."""
    from numba.core.registry import cpu_target

    cpu_target.target_context.refresh()


def helpers(name: str) -> dict[str, int]:
    """Addresses by name of a module of numba, whose packages are not imported for it."""
    root, *folders, _ = name.split(".")
    package = importlib.util.find_spec(root)
    if package is None or not package.submodule_search_locations:
        raise ImportError(root)
    module = sys.modules.get(name)
    if module is None:
        folder = Path(package.submodule_search_locations[0], *folders)
        spec = importlib.machinery.PathFinder.find_spec(name, [str(folder)])
        if spec is None or spec.loader is None:
            raise ImportError(name)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    found: dict[str, int] = module.c_helpers
    return found
