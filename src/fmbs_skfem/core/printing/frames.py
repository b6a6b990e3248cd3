"""A kernel while it is printed: its lines, and what its names stand for."""

from __future__ import annotations

import ast
import functools
import inspect
import re
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ..compiling import jit, structs
from .memory import MARK, PackedMemory
from .values import (
    Array,
    Base,
    ChoiceError,
    Const,
    Number,
    Scalar,
    Several,
    UnknownError,
    Value,
    bare,
    is_simple,
    kind_of,
    text_of,
    widest,
)

INDENT = "    "
CALL = "\x03"  #: a mark in calls of kernels, see `printer`
#: words of C, and those of the program itself
WORDS = frozenset(
    [
        "auto",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
        "extern",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "while",
        "m",
        "whole",
        "pair",
        "least",
        "most",
    ]
)


class WiderError(Exception):
    """A variable takes numbers of a wider kind than its first one: the kernel is printed anew."""

    def __init__(self, name: str, kind: str) -> None:
        super().__init__(name)
        self.name, self.kind = name, kind


def source_of(function: Any) -> Any:
    """The function of Python of a kernel."""
    if isinstance(function, jit.InlinedFunction):
        return function.py_func
    return function.function if isinstance(function, structs.Routine) else function


@functools.cache
def tree_of(function: Any) -> ast.FunctionDef:
    """A function as a tree."""
    found = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    assert isinstance(found, ast.FunctionDef)
    return found


def enclosed_by(function: Any) -> dict[str, Any]:
    """What a function encloses, by its names."""
    cells = function.__closure__ or ()
    names = function.__code__.co_freevars
    return {name: cell.cell_contents for name, cell in zip(names, cells, strict=True)}


@functools.cache
def assignments(tree: ast.AST) -> dict[str, int]:
    """How often each name is assigned: loops and operations in place count twice."""
    found: dict[str, int] = {}

    def note(target: ast.AST, times: int) -> None:
        if isinstance(target, ast.Name):
            found[target.id] = found.get(target.id, 0) + times
        for one in getattr(target, "elts", ()):
            note(one, times)

    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                note(target, 1)
        elif isinstance(node, ast.AugAssign | ast.For):
            note(node.target, 2)
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            note(node.target, 1)
    return found


class Frame:
    """Names and lines of a kernel; one that is written into its caller shares the lines of that."""

    def __init__(
        self,
        printer: Any,  # the `KernelPrinter` that asks for it
        function: Any,
        kinds: dict[str, str],
        caller: Frame | None = None,
        prefix: str = "",
    ) -> None:
        self.printer = printer
        self.memory: PackedMemory = printer.memory
        self.function, self.kinds = function, kinds
        self.enclosed, self.globals = enclosed_by(function), function.__globals__
        self.counts = assignments(tree_of(function))
        self.environment: dict[str, Value] = {}
        self.caller, self.prefix = caller, prefix
        self.root: Frame = caller.root if caller else self
        self.lazy = 0  #: choices, of which one side is not evaluated
        self.ended = False  #: whether the statements that follow are never reached
        if caller is None:
            self.lines: list[str] = []
            self.depth = 1
            self.variables: dict[str, str] = {}  #: kinds of the numbers that are declared
            self.arguments: dict[str, str] = {}  #: kinds of those that are given
            self.rooms: list[str] = []  #: declarations of arrays
            self.named = 0

    @property
    def is_lazy(self) -> bool:
        """Whether what is evaluated may be left out when the program runs."""
        return self.lazy > 0 or (self.caller is not None and self.caller.is_lazy)

    def emit(self, line: str, pure: bool = False) -> None:
        """A line of the kernel; one that is `pure` does nothing but name something."""
        if self.is_lazy and not pure:
            raise ChoiceError("a statement inside of a choice")
        self.root.lines.append(INDENT * self.root.depth + line)

    def word(self, name: str) -> str:
        """A name in C."""
        word = self.prefix + name
        return f"the_{word}" if word in WORDS or word.startswith("t_") else word

    def fresh(self, name: str) -> str:
        """A name that nothing else has."""
        self.root.named += 1
        return f"{name}_{self.root.named}"

    def hold(self, one: Any) -> Any:
        """A number under a name of its own, computed once; anything else as it is."""
        if not isinstance(one, Scalar) or is_simple(one):
            return one
        return self.copied(one)

    def copied(self, one: Scalar) -> Scalar:
        """A number that later assignments do not change."""
        name = self.fresh("t")
        # arithmetic may be done whether it is wanted or not, calls of kernels may not
        self.emit(f"{name} = {bare(one.text)};", pure=CALL not in one.text)
        self.root.variables[name] = one.kind
        return Scalar(name, one.kind)

    def is_variable(self, one: Any) -> bool:
        """Whether a value is that of a variable, or of several."""
        if isinstance(one, Several):
            return all(map(self.is_variable, one.parts))
        known = self.root.variables | self.root.arguments
        return isinstance(one, Scalar) and one.text in known

    def bind(self, name: str, value: Value) -> None:
        """Assign a value to a name; `_` is what nobody reads."""
        if name == "_":
            return
        changes = self.counts.get(name, 0) > 1
        number = isinstance(value, Const) and isinstance(value.value, bool | int | float)
        if isinstance(value, Scalar) or (number and changes):
            self.set_number(name, value)
            return
        if isinstance(value, Several):
            value = self.kept(value)
            if changes:
                self.environment[name] = self.set_several(self.word(name), value)
                return
        elif isinstance(value, Array):
            value = self.pointed(name, value)
        self.environment[name] = value

    def set_number(self, name: str, value: Any) -> None:
        """Assign a number to a variable of the program."""
        before = self.environment.get(name)
        word = before.text if self.is_variable(before) else self.word(name)  # type: ignore[union-attr]
        self.environment[name] = self.set_variable(word, value)

    def set_several(self, word: str, value: Several) -> Several:
        """Assign all numbers of a tuple to variables of the program."""
        parts = list[Any]()
        for k, part in enumerate(value.parts):
            if isinstance(part, Several):
                parts.append(self.set_several(f"{word}_{k}", part))
            elif isinstance(part, Const | Scalar):
                parts.append(self.set_variable(f"{word}_{k}", part))
            else:
                parts.append(part)
        return Several(tuple(parts), value.kind)

    def set_variable(self, word: str, value: Any) -> Scalar:
        """Assign a number to the variable of a name in C."""
        kind = kind_of(value)
        known = self.root.variables.get(word, self.root.arguments.get(word))
        if known is None:
            known = widest(kind, self.kinds.get(word, kind))
            self.root.variables[word] = known
        elif widest(known, kind) != known:
            raise WiderError(word, kind)
        self.emit(f"{word} = {bare(text_of(value, known))};")
        return Scalar(word, known)

    def kept(self, value: Several) -> Several:
        """A tuple whose numbers are computed once, and do not follow variables."""
        parts: list[Any] = []
        for part in value.parts:
            if isinstance(part, Several):
                parts.append(self.kept(part))
            elif (
                isinstance(part, Scalar)
                and self.is_variable(part)
                and not part.text.startswith("t_")
            ):
                parts.append(self.copied(part))
            else:
                parts.append(self.hold(part))
        return Several(tuple(parts), value.kind)

    def pointed(self, name: str, value: Array) -> Array:
        """An array whose pointer and sizes are computed once."""
        shape = tuple(self.hold(one) for one in value.shape)
        known = MARK in value.text and value.place is not None
        if known or re.fullmatch(r"\w+|\(\(\w+ \*\)0\)", value.text):
            return replace(value, shape=shape)
        word = self.fresh(self.word(name))
        mark = self.printer.mark_of(value.base)
        self.emit(f"{mark}{value.item} *const {word} = {bare(value.text)};", pure=True)
        return replace(value, text=word, shape=shape)

    def room(self, shape: Sequence[Number], item: str) -> Array:
        """An array of the kernel."""
        size = 1
        for one in shape:
            if not isinstance(one, Const):
                raise UnknownError("the size of an array")
            size *= one.value
        name = self.fresh("room")
        base = Base()
        base.written = True
        self.root.rooms.append(f"{item} {name}[{max(1, size)}];")
        return Array(base, name, item, tuple(shape))
