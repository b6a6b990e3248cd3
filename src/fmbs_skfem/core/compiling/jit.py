"""Compiled functions whose cache can never be stale.

    cache folder = <user's cache>/<hash of the numba version and of name and text of every module with compiled functions>

Numba looks only at the file of the compiled function itself: code of other modules that was
compiled into it would survive their change. Here any change in a module with compiled functions
leads to another folder; copies of the package with the same text share one, wherever and whenever
they were written. `NUMBA_CACHE_DIR` in the environment replaces the user's cache.

A function that a compiled function calls becomes part of that one (`dispatchers`). Numba is
imported when the first function is compiled, or called by Python through its wrapper
(`InlinedFunction`); what stands behind an address is loaded without it (`machine_code`).

With FMBS_PLAIN=1 in the environment before the first import nothing is compiled (`PLAIN`):
decorators return the function that they are given, an address stands for a function of Python, and
`plain` has what kernels call beside each other. A debugger then enters a time step, which is some
hundred times slower.
"""

from __future__ import annotations

import contextlib
import functools
import gc
import hashlib
import importlib
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from fmbs_skfem.core import caches, installed
from fmbs_skfem.core.compiling import compilation, machine_code
from fmbs_skfem.core.compiling.kernels import MODULES
from fmbs_skfem.core.compiling.machine_code import SUFFIX
from fmbs_skfem.core.notices import notify
from fmbs_skfem.core.storage import locks

F = TypeVar("F", bound=Callable[..., Any])

BEHIND: dict[int, Callable[..., Any]] = {}  #: functions by their addresses in this process
#: whether nothing is compiled: with FMBS_PLAIN=1 in the environment kernels are functions of
#: Python, with `plain` in place of numba
PLAIN = os.environ.get("FMBS_PLAIN", "0") not in ("", "0")
OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}
KEEP_DAYS = 30.0  #: folders of other versions are removed after so long without use [d]

BEGIN = time.time()  #: of this process, as far as modules with compiled functions matter [s]

_PACKAGE = Path(__file__).resolve().parents[2]


def stamp(package: Path = _PACKAGE, modules: Sequence[str] = MODULES) -> str:
    """Hash of the numba version and of name and text of the modules of `package` that compile
    functions.

    A text that changed since this process began may not be what it has imported: then no other
    process shares the code.
    """
    found = hashlib.sha256(f"numba {installed.version('numba')}\n".encode())
    for name in modules:
        path = package / name
        found.update(f"{name} {hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
        if BEGIN < path.stat().st_mtime <= time.time():
            found.update(f"process {os.getpid()} at {BEGIN}\n".encode())
    return found.hexdigest()[:16]


def remove_old(parent: Path, keep: Path) -> None:
    """Remove the folders in `parent` other than `keep` that nobody used for KEEP_DAYS; what cannot
    be removed stays.
    """
    limit = time.time() - 86400.0 * KEEP_DAYS
    for folder in parent.iterdir():
        with contextlib.suppress(OSError):  # another process may remove it at the same time
            if folder != keep and folder.is_dir() and folder.stat().st_mtime < limit:
                shutil.rmtree(folder, ignore_errors=True)


def prepare(parent: Path) -> Path | None:
    """The cache folder in `parent`, made and marked as used now; None with a notice where it cannot
    be written.
    """
    folder = parent / stamp()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            os.utime(folder)
        remove_old(parent, folder)
    except OSError as error:
        tell_uncached(error)
        return None
    return folder


def tell_uncached(error: OSError) -> None:
    """Say that code is compiled and not kept, as on a full disk."""
    notify(
        f"compiled code is not cached ({error}): every process compiles anew; set NUMBA_CACHE_DIR to a writable folder"
    )


@functools.cache
def cache_folder() -> Path | None:
    """The folder of the compiled code of this process; None where nothing can be cached."""
    return prepare(caches.parent())


@contextlib.contextmanager
def without_collection() -> Iterator[None]:
    """No search for garbage inside: a compilation makes a million objects that live until its end;
    searches take a sixth of it.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


class Deferred:
    """What numba makes for compiled functions, such as an intrinsic, made when one that names it is
    compiled.
    """

    def __init__(self, make: Callable[[], Any]) -> None:
        self.make = make

    @functools.cached_property
    def made(self) -> Any:
        """It is kept: its type does not keep it."""
        return self.make()

    @functools.cached_property
    def _numba_type_(self) -> Any:
        from . import dispatchers

        return dispatchers.type_of(self.made)

    def __reduce__(self) -> Any:
        return Deferred, (self.make,)

    def __call__(self, *arguments: Any) -> Any:
        """Compiled functions alone can call it, and those of Python where nothing is compiled."""
        if PLAIN:
            return self.made(*arguments)
        raise TypeError("only compiled functions can call this")


def deferred(module: str, name: str) -> Any:
    """What a module of numba's side calls `name`."""
    return Deferred(functools.partial(taken, module, name))


def taken(module: str, name: str) -> Any:
    """What a module of numba's side calls `name`, or `plain` where nothing is compiled."""
    return getattr(
        importlib.import_module("fmbs_skfem.core.compiling.plain" if PLAIN else module), name
    )


carray = deferred("numba", "carray")


class InlinedFunction:
    """A function for compiled callers, which contain its code; called from Python it becomes a
    function of its own.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func, self.options = function, options

    @functools.cached_property
    def contained(self) -> Any:
        """As compiled callers contain it."""
        from . import dispatchers

        return dispatchers.contained(self.py_func, self.options)

    @property
    def _numba_type_(self) -> Any:
        return self.contained._numba_type_

    @property
    def targetoptions(self) -> dict[str, Any]:
        """Where numba looks for `inline`."""
        options: dict[str, Any] = self.contained.targetoptions
        return options

    def __reduce__(self) -> Any:
        return InlinedFunction, (self.py_func, self.options)

    @functools.cached_property
    def whole(self) -> Any:
        """As Python calls it, cached on disk."""
        from . import dispatchers

        found = dispatchers.whole(self.py_func, self.options)
        if cache_folder() is not None:
            found.enable_caching()
        return found

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        try:
            return self.whole(*arguments, **named)
        except OSError as error:  # compiled code raises none itself: there was no room to keep it
            from . import dispatchers

            tell_uncached(error)
            self.whole = dispatchers.whole(self.py_func, self.options)
            return self.whole(*arguments, **named)


def decorated(function: F, **more: Any) -> F:
    """`function` compiled with the OPTIONS of this package and more; itself where nothing is
    compiled.
    """
    if PLAIN:
        return function
    compiled: Any = InlinedFunction(function, {**OPTIONS, **more})
    return compiled


def jit(function: F) -> F:
    """Compile `function` at its first call: no Python objects, IEEE results of divisions by zero,
    cached on disk.

    No wrapper for C, which nobody calls and which takes a tenth of the compilation. No `fastmath`:
    NaN and infinity have to survive until the solver sees them.
    """
    return decorated(function)


def inlined(function: F) -> F:
    """As `jit`, and compiled into its callers as well: a call that passes all arrays of a model
    costs a tenth of a step.
    """
    return decorated(function, inline="always")


def unlocked(function: F) -> F:
    """As `jit`, without the lock of the interpreter: calls from several threads run at the same time."""
    return decorated(function, nogil=True)


def regrouped(function: F) -> Any:
    """As `jit`, compiled by itself and not with its callers: for dot products, whose sums may be
    regrouped to use all lanes.
    """
    return function if PLAIN else Deferred(functools.partial(optimised, function))


def optimised(function: Callable[..., Any]) -> Any:
    """What numba makes for `regrouped`; NaN and infinity keep their meaning."""
    import numba

    return numba.njit(error_model="numpy", fastmath={"reassoc", "contract"})(function)


@contextlib.contextmanager
def alone(name: str) -> Iterator[None]:
    """One process at a time does what is inside: the others wait, and find in the cache what it has
    compiled.
    """
    folder = cache_folder()
    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError):  # file systems without locks: all compile
            if folder is not None:
                locks.take(held.enter_context((folder / f"{name}.lock").open("w")), wait=True)
        yield


@functools.cache
def kept() -> frozenset[str]:
    """Names of the functions, such as `stepping.advance`, that are in the cache when this process
    first asks.
    """
    folder = cache_folder()
    return (
        frozenset()
        if folder is None
        else frozenset(path.name.rpartition("-")[0] for path in folder.glob(f"*{SUFFIX}"))
    )


def addressed(signature: Any, function: Callable[..., Any], apart: bool = False) -> Any:
    """`function` behind an address that anything can call, which is known by it."""
    found = made(signature, function, apart)
    BEHIND[int(found.address)] = function
    return found


def made(signature: Any, function: Callable[..., Any], apart: bool) -> Any:
    """The same, compiled now by this process or another one, cached on disk.

    What its pointers point to does not overlap where one is written, if it says that they are
    `apart`. Where nothing is compiled only `call` and `invoke` of `plain` know what stands behind
    it.
    """
    if PLAIN:
        from . import plain

        return plain.register(function)
    name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
    folder = cache_folder()
    path = (
        None if folder is None else machine_code.place(folder, name, function, (signature, apart))
    )
    if path is None:
        return compile_callback(signature, function, apart, name)
    if found := machine_code.read(path):
        return found
    with alone(f"{function.__module__}.{function.__qualname__}"):
        if found := machine_code.read(path):
            return found
        compiled = compile_callback(signature, function, apart, name)
        try:
            machine_code.write(path, compiled)
        except OSError as error:
            tell_uncached(error)
        return compiled


def compile_callback(signature: Any, function: Callable[..., Any], apart: bool, name: str) -> Any:
    """As `addressed`, by this process."""
    import numba

    from . import dispatchers

    more = {"pipeline_class": dispatchers.Apart} if apart else {}
    with without_collection():
        if name not in kept():
            compilation.begin(name)
        return numba.cfunc(signature, error_model="numpy", **more)(function)
