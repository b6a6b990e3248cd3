"""Kernels as C99: what numba compiles, written for the numbers and the sizes of one packed model.

    printer = KernelPrinter(memory, functions)      functions: what stands behind the addresses of routines and entries
    found = printer.printed(kernel, values)   a kernel with all that it calls; `found.name` is its name in C
    printer.text()                            all of them

Every struct is known when a kernel is printed, and with it all sizes, switches and addresses:
branches on them are decided, loops over addresses are written out, and what is behind an address is
called by its name. A kernel is printed once for each kind and size of its arguments.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping, Sequence
from typing import Any

from .calls import InlineError, Results
from .frames import CALL, INDENT, WiderError, assignments, source_of, tree_of
from .memory import MARK, PackedMemory
from .statements import KernelBody
from .values import (
    Array,
    Base,
    Const,
    HostFunctions,
    Number,
    Pointer,
    Scalar,
    Several,
    Struct,
    Value,
    text_of,
)

#: marks of what is known once everything is printed: constants, the memory that is given and taken
CONSTANT, GIVEN, TAKEN = "\x02", CALL, "\x04"
CALLED = f"{GIVEN}(\\w+)(?: \\+)?{GIVEN}"  #: a kernel in a text


class Printed:
    """A kernel in C."""

    def __init__(self, name: str, result: Any, text: str) -> None:
        self.name, self.text = name, text
        self.result = result  #: None, a known number, a kind, or a `Results`
        self.bases: list[Base] = []  #: of the arrays that it is given
        #: of every argument whether whole numbers are given though they are known; None of those
        #: that are none in C
        self.taken: list[bool | None] = []

    @property
    def silent(self) -> bool:
        """Whether it does nothing but return what is known."""
        return not self.text


class KernelPrinter:
    """Prints kernels, each with all that it calls.

    `functions` are kernels by their addresses, or names of the program's own functions; `stands`
    are kernels in place of others, which have no C; `products` those of A B and A^T B; loops of `spelled` ones over what is known are
    written out.
    """

    def __init__(
        self,
        memory: PackedMemory,
        functions: Mapping[int, Any],
        stands: Mapping[Any, Any],
        products: Sequence[Any],
        spelled: Sequence[Any] = (),
    ) -> None:
        self.memory, self.functions = memory, functions
        self.stands = {source_of(one): other for one, other in stands.items()}
        self.products = products
        self.spelled = frozenset(map(source_of, spelled))
        self.known: dict[Any, Printed | InlineError] = {}
        self.kernels: list[Printed] = []
        self.entries: list[str] = []  #: names of those that the program calls
        self.structs: dict[str, tuple[str, ...]] = {}
        self.inlined = set[Any]()  #: kernels that are part of their callers in compiled code
        self.apart = set[Any]()  #: those whose arrays do not overlap where one is written
        self.marked: dict[Base, int] = {}  #: memories by their marks
        self.links: list[tuple[Base, Base]] = []

    def mark_of(self, base: Base) -> str:
        """Where `const` stands if nobody writes to a memory."""
        return f"{CONSTANT}{self.marked.setdefault(base, len(self.marked))}{CONSTANT}"

    def memory_mark(self, name: str, more: bool, mark: str = GIVEN) -> str:
        """Where the memory of the program stands if a kernel needs it."""
        return f"{mark}{name}{' +' if more else ''}{mark}"

    def link(self, inner: Base, outer: Base) -> None:
        """What is written in one memory is written in another."""
        self.links.append((inner, outer))

    def printed(self, kernel: Any, values: Sequence[Value]) -> Printed:
        """A kernel for arguments like these; InlineError for one that has to be in its caller."""
        function = source_of(kernel)
        written = assignments(tree_of(function))
        names = [one.arg for one in tree_of(function).args.args]
        changed = [name in written for name in names]
        keys = (self.key_of(one, both) for one, both in zip(values, changed, strict=True))
        key = function, tuple(keys)
        if key not in self.known:
            try:
                self.known[key] = self.print(function, names, values, changed)
            except InlineError as error:
                self.known[key] = error
        found = self.known[key]
        if isinstance(found, InlineError):
            raise found
        return found

    def key_of(self, one: Value, changes: bool) -> Any:
        """What arguments have in common that one text serves."""
        if self.memory.is_fixed(one):
            assert isinstance(one, Array)
            return "fixed", one.base, one.place, one.shape
        if isinstance(one, Const):
            if isinstance(one.value, float) or (changes and isinstance(one.value, int)):
                return type(one.value).__name__
            return "known", one.value
        if isinstance(one, Scalar):
            return one.kind if one.kind != "whole" else "int"
        if isinstance(one, Array):
            sizes = tuple(size.value if isinstance(size, Const) else None for size in one.shape)
            return "array", one.item, sizes, one.strides is not None
        if isinstance(one, Pointer | Struct):
            number = text_of(one.number) if len(one.starts) == 1 else ""
            return getattr(one, "kind", None), one.starts, number
        if isinstance(one, Several):
            return "several", *(self.key_of(part, changes) for part in one.parts)
        return one if isinstance(one, HostFunctions) else source_of(one.value)

    def print(
        self, function: Any, names: Sequence[str], values: Sequence[Value], changed: Sequence[bool]
    ) -> Printed:
        """A kernel, once more where a variable takes a wider kind of number."""
        kinds: dict[str, str] = {}
        while True:
            try:
                return Signature(self, function, kinds).print(names, values, changed)
            except WiderError as error:
                kinds[error.name] = error.kind

    def finish(self) -> None:
        """What is written in memories that kernels are given is written in those that they are."""
        changed = True
        while changed:
            changed = False
            for inner, outer in self.links:
                if inner.written and not outer.written:
                    outer.written = changed = True

    def text(self) -> str:
        """All kernels, with marks of regions."""
        whole = "\n\n".join(one.text for one in self.called())
        marked = list(self.marked)
        whole = re.sub(
            f"{CONSTANT}(\\d+){CONSTANT}",
            lambda found: "" if marked[int(found[1])].written else "const ",
            whole,
        )
        using = self.using_memory()

        def replaced(mark: str, word: str, none: str) -> None:
            nonlocal whole
            whole = re.sub(
                f"{mark}(\\w+)( \\+)?{mark}",
                lambda found: (
                    word + (", " if found[2] else "")
                    if found[1] in using
                    else ("" if found[2] else none)
                ),
                whole,
            )

        replaced(GIVEN, "m", "")
        replaced(TAKEN, "NAME_memory *m", "void")
        return whole

    def called(self) -> list[Printed]:
        """Kernels that others or the program call, those that are called first."""
        by_name = {one.name: one for one in self.kernels if one.text}
        waiting, found = list(self.entries), set[str]()
        while waiting:
            name = waiting.pop()
            if name not in found:
                found.add(name)
                waiting += re.findall(CALLED, by_name[name].text)
        return [one for name, one in by_name.items() if name in found]

    def entry(self, kernel: Any, values: Sequence[Value]) -> Printed:
        """A kernel that the program calls."""
        found = self.printed(kernel, values)
        self.entries.append(found.name)
        return found

    def using_memory(self) -> set[str]:
        """Names of the kernels that need the memory of the program."""
        written = {one.name for one in self.memory.regions if self.memory.is_field(one)}
        direct, calls = set[str](), dict[str, set[str]]()
        for one in self.kernels:
            regions = set(re.findall(f"{MARK}(\\w+){MARK}", one.text))
            code = re.sub(r"/\*.*?\*/", "", one.text)
            if regions & written or "m->" in code or re.search(r"\(m\b", code):
                direct.add(one.name)
            calls[one.name] = set(re.findall(CALLED, one.text))
        found = direct
        while more := {name for name, called in calls.items() if called & found} - found:
            found = found | more
        return found


class Signature:
    """What a kernel is given in C, and its text."""

    def __init__(self, printer: KernelPrinter, function: Any, kinds: Mapping[str, str]) -> None:
        self.printer, self.function = printer, function
        self.body = KernelBody(printer, function, dict(kinds))
        self.heads: list[str] = []
        self.bases: list[Base] = []

    def print(
        self, names: Sequence[str], values: Sequence[Value], changed: Sequence[bool]
    ) -> Printed:
        """The kernel for these values of its arguments."""
        body, printer = self.body, self.printer
        taken = list[bool | None]()
        for name, value, changes in zip(names, values, changed, strict=True):
            fixed = printer.memory.is_fixed(value)
            taken.append(None if fixed else changes)
            body.environment[name] = value if fixed else self.take(body.word(name), value, changes)
        result = body.run()
        found = Printed("", result, "")
        if not (isinstance(result, Const) and self.is_silent):
            found = Printed(printer.memory.unique(self.label), result, "")
            found.text = self.text(found)
        found.bases, found.taken = self.bases, taken
        printer.kernels.append(found)
        return found

    @property
    def is_silent(self) -> bool:
        """Whether nothing is done but to return."""
        return all(line.lstrip().startswith("return") for line in self.body.lines)

    @property
    def label(self) -> str:
        """A name that tells where the kernel is from."""
        return f"{self.function.__module__.rpartition('.')[2]}_{self.function.__name__}"

    def take(self, word: str, one: Value, changes: bool) -> Value:
        """An argument as the kernel knows it."""
        if isinstance(one, Const):
            kind = {float: "double", int: "whole"}.get(type(one.value))
            return self.number(word, kind) if kind == "double" or (kind and changes) else one
        if isinstance(one, Scalar):
            return self.number(word, one.kind)
        if isinstance(one, Array):
            return self.array(word, one)
        if isinstance(one, Pointer | Struct):
            return one if len(one.starts) == 1 else self.several_structs(word, one)
        if isinstance(one, Several):
            parts = (self.take(f"{word}_{k}", part, changes) for k, part in enumerate(one.parts))
            return Several(tuple(parts), one.kind)
        return one

    def number(self, word: str, kind: str) -> Scalar:
        """A number that is given."""
        kind = self.body.kinds.get(word, kind)
        self.body.arguments[word] = kind
        self.heads.append(f"{kind} {word}")
        return Scalar(word, kind)

    def array(self, word: str, one: Array) -> Array:
        """An array that is given, with what is not known of its sizes."""
        base = Base()
        self.bases.append(base)
        apart = "restrict " if self.function in self.printer.apart else ""
        self.heads.append(f"{self.printer.mark_of(base)}{one.item} *{apart}{word}")
        shape = [
            size if isinstance(size, Const) else self.number(f"{word}_{k}", "whole")
            for k, size in enumerate(one.shape)
        ]
        strides: tuple[Number, ...] | None = None
        if one.strides is not None:
            strides = tuple(self.number(f"{word}_by_{k}", "whole") for k in range(len(shape)))
        return Array(base, word, one.item, tuple(shape), strides)

    def several_structs(self, word: str, one: Any) -> Value:
        """One of several structs, by its number."""
        number = self.number(f"{word}_number", "whole")
        if isinstance(one, Pointer):
            return Pointer(one.starts, number)
        return Struct(one.kind, one.starts, number)

    def text(self, found: Printed) -> str:
        """The kernel in C, behind the first line of what it says of itself."""
        body = self.body
        result = found.result
        if isinstance(result, Const):
            kind = "double" if isinstance(result.value, float) else "whole"
        else:
            kind = result.struct if isinstance(result, Results) else result or "void"
        static = "INLINED" if self.function in self.printer.inlined else "static"
        memory = self.printer.memory_mark(found.name, bool(self.heads), TAKEN)
        about = (ast.get_docstring(tree_of(self.function)) or "").partition("\n\n")[0]
        about = " ".join(about.replace("*/", "* /").split())
        head = f"{static} {kind} {found.name}({memory}{', '.join(self.heads)})"
        lines = [*([f"/* {about} */"] if about else []), head, "{"]
        lines += [INDENT + room for room in body.rooms]
        for kind in ("double", "whole", "pair"):
            names = [name for name, one in body.variables.items() if one == kind]
            lines += [f"{INDENT}{kind} {', '.join(sorted(names))};"] if names else []
        inside = read_alone(body.lines)
        words = [re.findall(r"\w+", one)[-1] for one in self.heads]
        unread = [word for word in (*words, *body.variables) if not is_read(word, inside)]
        lines += [f"{INDENT}(void){word};" for word in unread]
        return "\n".join([*lines, inside, "}"])


def read_alone(lines: Sequence[str]) -> str:
    """Lines without names of pointers and of results that nothing reads."""
    found = "\n".join(lines)
    for line in reversed(lines):
        named = re.search(r"^( *)(?:.*\*const|const struct \w+) (\w+) = (.*;)$", line)
        if named and len(re.findall(rf"\b{named[2]}\b", found)) == 1:
            left = f"{named[1]}(void){named[3]}\n" if "struct" in line else ""
            found = found.replace(f"{line}\n", left)
    return found


def is_read(word: str, text: str) -> bool:
    """Whether a variable is read anywhere, not written alone."""
    return re.search(rf"\b{word}\b(?! = )", text) is not None
