"""How numba compiles for this package: what functions become that others contain, and what those
become that Python calls.

A function that a compiled function calls becomes part of that one. Of its own it is only brought
into the form in which it can be: optimised, translated and kept on disk are whole functions alone,
those that Python calls and the routines of `structs`.

This module loads numba: `jit` imports it when the first function is compiled.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from numba.core import compiler, config, types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher, cpu_target

from ..errors import InputError, say
from . import jit, machine_code

if config.DISABLE_JIT:
    raise InputError(
        say(
            "environment: NUMBA_DISABLE_JIT",
            "0, or no such variable",
            "1",
            "FMBS_PLAIN=1 runs the kernels of this package in Python",
        )
    )


def remember(resolve: Callable[..., Any]) -> Callable[..., Any]:
    """What a built-in function returns for arguments of these types, found once in a process.

    Every sum of a function is looked for among all that "+" may stand for: a seventh of a
    compilation, of laws two fifths.
    """
    found: dict[tuple[Any, ...], Any] = {}

    @functools.wraps(resolve)
    def remembered(function: Any, context: Any, arguments: Any, named: Any) -> Any:
        if named:
            return resolve(function, context, arguments, named)
        key = function, context, *arguments
        if key not in found:
            found[key] = resolve(function, context, arguments, named)  # an error is not kept
        return found[key]

    return remembered


builtin: Any = types.Function
builtin.get_call_type = remember(builtin.get_call_type)


class Contained(JITCodeLibrary):
    """Code that callers take in as it is: they optimise and translate it with their own."""

    def _optimize_final_module(self) -> None:
        """Its callers do."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        return 0

    @property
    def codegen(self) -> Contained:
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """There is no code to pass it to."""


class Containing(compiler.Compiler):
    """Compiles into a Contained."""

    def define_pipelines(self) -> Any:
        self.state.library = Contained(
            self.state.targetctx.codegen(), self.state.func_id.func_qualname
        )
        return super().define_pipelines()


class ByText(_CacheLocator):
    """Where code of a function is kept: by the text of its module, as that behind addresses."""

    def __init__(self, function: Callable[..., Any], path: Path) -> None:
        text = "".join(
            (
                function.__module__,
                machine_code.digest_of(path),
                *machine_code.outside(function.__module__),
            )
        )
        self.folder = jit.cache_folder()
        self.line = function.__code__.co_firstlineno
        self.text = hashlib.sha256(text.encode()).hexdigest()[:24]

    def get_cache_path(self) -> str:
        return str(self.folder)

    def get_source_stamp(self) -> str:
        return self.text

    def get_disambiguator(self) -> str:
        return f"{self.line}-{self.text}"

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> ByText | None:
        path = Path(py_file)
        return cls(py_func, path) if path.exists() else None


class ImplementationByText(CompileResultCacheImpl):
    """What numba keeps of a function, where `ByText` says."""

    _locator_classes: ClassVar = [ByText]


class CacheByText(FunctionCache):
    """The cache of one function."""

    _impl_class = ImplementationByText


class WholeDispatcher(CPUDispatcher):
    """A function as Python calls it, compiled by this process or another one."""

    def enable_caching(self) -> None:
        self._cache = CacheByText(self.py_func)

    def compile(self, signature: Any) -> Any:
        name = f"{self.py_func.__module__}.{self.py_func.__qualname__}.whole"
        # numba's lock comes first, as where another function calls this one
        with global_compiler_lock, jit.alone(name), jit.without_collection():
            return super().compile(signature)


class Apart(compiler.Compiler):
    """Compiles functions whose pointers do not overlap where one is written: loops become vector
    instructions without checks.
    """

    def define_pipelines(self) -> Any:
        self.state.flags.noalias = True
        return super().define_pipelines()


def contained(function: Callable[..., Any], options: dict[str, Any]) -> CPUDispatcher:
    """A function for compiled callers alone."""
    return CPUDispatcher(
        function, {}, {"nopython": True, "no_cpython_wrapper": True, **options}, Containing
    )


def whole(function: Callable[..., Any], options: dict[str, Any]) -> WholeDispatcher:
    """A function for Python."""
    return WholeDispatcher(function, {}, {"nopython": True, **options})


def type_of(value: Any) -> Any:
    """Numba's type of a function that it knows, such as an intrinsic."""
    context = cpu_target.typing_context
    context.refresh()
    return context.resolve_value_type(value)
