"""The subset of Python that kernels are in (`docs/architecture.md`), checked over all of them."""

from __future__ import annotations

import ast
import builtins
import functools
import importlib
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fmbs_skfem
from fmbs_skfem.core.compiling import jit, structs
from fmbs_skfem.core.compiling.kernels import MODULES
from fmbs_skfem.core.printing import calls, expressions
from fmbs_skfem.core.printing.frames import source_of
from fmbs_skfem.core.printing.statements import KernelBody

PACKAGE = Path(fmbs_skfem.__file__).parent
COMPILERS = frozenset({"jit", "inlined", "regrouped", "routine", "unlocked", "entry"})
OPERATIONS = {*expressions.SIGNS, *expressions.WHOLE, ast.Pow}
RELATIONS = {*expressions.RELATIONS, ast.In, ast.NotIn}
METHODS = frozenset({"reshape", "copy", "conjugate"})
#: what kernels read of their modules, beside what they call
KNOWN = bool | int | float | str | tuple | np.generic | np.ndarray | types.ModuleType
FIELDS = frozenset({"shape", "size", "real", "imag"})  #: of arrays and complex numbers
MANY = 99  #: axes of an array that may have any number of them
ADDRESSED = frozenset({"invoke", "call"})  #: calls by address

SPARSE = "factors of sparse matrices of large models, which no step in C has"
LAPACK = "LAPACK at an address; `core.algebra.small` stands in its place"
#: kernels outside of the subset, and why they may be
OUTSIDE = {
    "core/algebra/direct.py": (
        SPARSE,
        {"_update", "eliminate", "eliminate_range", "_up", "substitute"},
    ),
    "core/algebra/supernodes.py": (
        SPARSE,
        {"_merge_equal", "_tree", "_postorder", "_counts", "_patterns", "nested_dissection"},
    ),
    "core/compiling/lapack.py": (LAPACK, {"pbtrf", "potrf", "gbtrf", "gbtrs", "getrf", "getrs"}),
    "reduction/hyper/ecsw.py": ("training, no part of a step: np.hypot", {"_remove"}),
}


def name_of(one: ast.expr) -> str:
    """The last name of what is called."""
    return getattr(one, "id", getattr(one, "attr", ""))


def functions_in(node: ast.AST, before: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    """All functions, with the names of what they are in before their own."""
    for part in ast.iter_child_nodes(node):
        inner = before
        if isinstance(part, ast.FunctionDef | ast.ClassDef):
            inner = f"{before}{part.name}."
        if isinstance(part, ast.FunctionDef):
            yield inner[:-1], part
        if isinstance(part, ast.stmt):
            yield from functions_in(part, inner)


def passed(node: ast.AST) -> Iterator[tuple[ast.Call, str]]:
    """Calls of what compiles, with the names of the functions that are given to it."""
    for part in ast.walk(node):
        if isinstance(part, ast.Call) and name_of(part.func) in COMPILERS and len(part.args) == 1:
            (function,) = part.args
            if isinstance(function, ast.Name):
                yield part, function.id


@functools.cache
def kernels_of(module: str) -> dict[str, ast.FunctionDef]:
    """The kernels of a module: decorated, or passed to what compiles, by a decorator perhaps."""
    tree = ast.parse((PACKAGE / module).read_text(encoding="utf-8"))
    found = dict(functions_in(tree))
    compilers, names = set(COMPILERS), set[str]()
    inside = {call: "" for call, _ in passed(tree)}
    for scope, one in found.items() if inside else ():
        inside |= {call: scope for call, _ in passed(one)}  # the innermost one comes last
    for call, name in passed(tree):
        scope = inside[call]
        if scope and name in {arg.arg for arg in found[scope].args.args}:
            compilers.add(found[scope].name)
        while scope and f"{scope}.{name}" not in found:
            scope = scope.rpartition(".")[0]
        names.add(f"{scope}.{name}".lstrip("."))
    return {
        name: one
        for name, one in found.items()
        if name in names or compilers & set(map(name_of, one.decorator_list))
    }


def shared(module: str) -> dict[str, Any]:
    """The global names of a module."""
    word = module.removesuffix(".py").replace("/", ".")
    return vars(importlib.import_module(f"fmbs_skfem.{word}"))


class Check:
    """What of one kernel is outside of the subset."""

    def __init__(self, kernel: ast.FunctionDef, known: dict[str, Any]) -> None:
        self.known = known
        self.faults: list[str] = []
        self.arrays = {
            one.arg: MANY
            for one in kernel.args.args
            if one.annotation is not None and ast.unparse(one.annotation).endswith("ndarray")
        }
        self.local = {one.arg for one in kernel.args.args} | {
            node.id
            for node in ast.walk(kernel)
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
        }
        if kernel.args.kwonlyargs or kernel.args.vararg or kernel.args.kwarg:
            self.tell(kernel, "arguments by name alone, or any number of them")
        for one in kernel.body:
            self.statement(one, 0)

    def tell(self, node: ast.AST, what: str) -> None:
        self.faults.append(f"{node.lineno}: {what}")  # type: ignore[attr-defined]

    def resolved(self, one: ast.expr) -> Any:
        """What a name stands for that is no local one; None where it is not known here."""
        if isinstance(one, ast.Name) and one.id not in self.local:
            return self.known.get(one.id, getattr(builtins, one.id, None))
        if isinstance(one, ast.Attribute):
            owner = self.resolved(one.value)
            return getattr(owner, one.attr) if isinstance(owner, types.ModuleType) else None
        return None

    # arrays

    def axes(self, one: ast.expr) -> int | None:
        """How many axes an array has, MANY where that is not known; None of what may be no array."""
        if isinstance(one, ast.Name):
            return self.arrays.get(one.id)
        if isinstance(one, ast.Attribute):
            return axes_of_fields().get(one.attr)
        if isinstance(one, ast.IfExp):
            return self.axes(one.body)
        if isinstance(one, ast.Subscript):
            return self.axes_of_part(one)
        return self.axes_of_result(one) if isinstance(one, ast.Call) else None

    def axes_of_part(self, one: ast.Subscript) -> int | None:
        """The same of what indices leave."""
        places = one.slice.elts if isinstance(one.slice, ast.Tuple) else [one.slice]
        sliced = any(isinstance(part, ast.Slice) for part in places)
        whole = self.axes(one.value)
        if whole is None or whole == MANY:
            return MANY if sliced else None
        return whole - sum(not isinstance(part, ast.Slice) for part in places) or None

    def axes_of_result(self, one: ast.Call) -> int | None:
        """The same of what a call gives."""
        found, word = self.resolved(one.func), name_of(one.func)
        if word == "copy" and isinstance(one.func, ast.Attribute):
            return self.axes(one.func.value)
        if word == "reshape" or found is np.dot:
            return MANY
        if found in (np.empty, np.zeros):
            shape = one.args[0]
        elif word in ("view", "carray"):
            shape = one.args[-1]
        else:
            return MANY if gives_array(found) else None
        return len(shape.elts) if isinstance(shape, ast.Tuple) else MANY

    def is_array(self, one: ast.expr) -> bool:
        """Whether an expression is an array for certain."""
        return self.axes(one) is not None

    # statements

    def statement(self, one: ast.stmt, depth: int) -> None:
        if not hasattr(KernelBody, f"do_{type(one).__name__}"):
            self.tell(one, type(one).__name__)
            return
        if getattr(one, "orelse", ()) and not isinstance(one, ast.If):
            self.tell(one, "else of a loop")
        if (
            isinstance(one, ast.Return)
            and one.value is not None
            and depth
            and self.is_array(one.value)
        ):
            self.tell(one, "an array that is returned inside of a branch")
        if isinstance(one, ast.AugAssign):
            if type(one.op) not in OPERATIONS:
                self.tell(one, type(one.op).__name__)
            if self.is_array(one.target):
                self.tell(one, "an array that is changed as a whole")
        if isinstance(one, ast.Assign):
            for target in one.targets:
                self.note(target, one.value)
        if isinstance(one, ast.For):
            self.loop(one)
        if isinstance(one, ast.While) and any(map(self.is_kernel, ast.walk(one.test))):
            self.tell(one, "a kernel in the condition of a loop")
        deeper = depth + isinstance(one, ast.If | ast.For | ast.While)
        for name, part in ast.iter_fields(one):
            if name in ("annotation", "iter") and isinstance(one, ast.AnnAssign | ast.For):
                continue
            for inner in part if isinstance(part, list) else [part]:
                if isinstance(inner, ast.stmt):
                    self.statement(inner, deeper)
                elif isinstance(inner, ast.expr):
                    self.expression(inner)

    def note(self, target: ast.expr, value: ast.expr) -> None:
        """Remember names of arrays."""
        if isinstance(target, ast.Name) and (axes := self.axes(value)) is not None:
            self.arrays[target.id] = axes
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            for one, part in zip(target.elts, value.elts, strict=False):
                self.note(one, part)

    def loop(self, one: ast.For) -> None:
        """What a loop goes over, and whether one that has to be written out can be left."""
        counts = isinstance(one.iter, ast.Call) and self.resolved(one.iter.func) is range
        for part in one.iter.args if counts else [one.iter]:  # type: ignore[attr-defined]
            self.expression(part)
        axes = self.axes(one.iter)
        if isinstance(one.target, ast.Name) and axes is not None and 1 < axes < MANY:
            self.arrays[one.target.id] = axes - 1
        inside = list(ast.walk(one))
        if not any(isinstance(node, ast.Break | ast.Continue) for node in inside):
            return
        changed = {
            node.id
            for node in inside
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
        }
        addresses = (
            node.args[0]
            for node in inside
            if isinstance(node, ast.Call) and name_of(node.func) in ADDRESSED and node.args
        )
        by_address = any(
            isinstance(part, ast.Name) and part.id in changed
            for address in addresses
            for part in ast.walk(address)
        )
        if by_address or isinstance(one.iter, ast.Tuple):
            self.tell(one, "a break in a loop over addresses or over a tuple")

    # expressions

    def expression(self, one: ast.expr) -> None:
        if isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Store):
            self.tell(one, "a field that is assigned")
        if isinstance(one, ast.Slice):
            if one.step is not None:
                self.tell(one, "a slice with a step")
        elif not isinstance(one, ast.Starred) and not hasattr(
            KernelBody, f"of_{type(one).__name__}"
        ):
            self.tell(one, type(one).__name__)
            return
        check = getattr(self, f"check_{type(one).__name__}", None)
        if check is not None:
            check(one)
        for part in ast.iter_child_nodes(one):
            if isinstance(part, ast.keyword):
                self.expression(part.value)
            elif isinstance(part, ast.expr):
                self.expression(part)

    def check_BinOp(self, one: ast.BinOp) -> None:
        if type(one.op) not in OPERATIONS:
            self.tell(one, type(one.op).__name__)
        if self.is_array(one.left) or self.is_array(one.right):
            self.tell(one, f"arithmetic of arrays: {ast.unparse(one)}")

    def check_UnaryOp(self, one: ast.UnaryOp) -> None:
        if not isinstance(one.op, ast.Not | ast.USub):
            self.tell(one, type(one.op).__name__)
        if self.is_array(one.operand):
            self.tell(one, "arithmetic of arrays")

    def check_Compare(self, one: ast.Compare) -> None:
        for relation in one.ops:
            if type(relation) not in RELATIONS:
                self.tell(one, type(relation).__name__)
        if any(map(self.is_array, (one.left, *one.comparators))) and not isinstance(
            one.ops[0], ast.In | ast.NotIn
        ):
            self.tell(one, "a comparison of arrays")

    def check_Constant(self, one: ast.Constant) -> None:
        if isinstance(one.value, bytes | complex):
            self.tell(one, repr(one.value))

    def check_Name(self, one: ast.Name) -> None:
        found = self.resolved(one)
        if not (found is None or callable(found) or isinstance(found, KNOWN)):
            self.tell(one, f"'{one.id}', a {type(found).__name__}")

    def check_Subscript(self, one: ast.Subscript) -> None:
        if isinstance(one.slice, ast.Tuple):
            found = any(map(self.is_array, one.slice.elts))
        else:
            found = self.is_array(one.slice)
        if found:
            self.tell(one, "an array of indices")

    def check_Attribute(self, one: ast.Attribute) -> None:
        if self.is_array(one.value) and one.attr not in FIELDS | METHODS | {"T"}:
            self.tell(one, f"'{one.attr}' of an array")

    def is_kernel(self, one: ast.AST) -> bool:
        """Whether a kernel is called."""
        if not isinstance(one, ast.Call):
            return False
        found = self.resolved(one.func)
        return isinstance(found, jit.InlinedFunction | structs.Routine)

    def check_Call(self, one: ast.Call) -> None:
        found = self.resolved(one.func)
        word = ast.unparse(one.func)
        if any(part.arg is None for part in one.keywords):
            self.tell(one, f"{word}(**)")
        if found is None:
            inner = isinstance(one.func, ast.Name) and one.func.id not in self.known
            if not inner and name_of(one.func) not in METHODS:
                self.tell(one, f"a call of {word}")
        elif isinstance(found, jit.Deferred):
            if not is_deferred_known(found):
                self.tell(one, word)
        elif isinstance(found, type) and hasattr(found, "_fields"):
            pass
        elif found in calls.BUILT_IN:
            if one.keywords:
                self.tell(one, f"{word} with arguments by name")
            self.built_in(one, found)
        elif not isinstance(found, jit.InlinedFunction | structs.Routine):
            if getattr(found, "__name__", "") not in {*calls.MATHS, "isfinite"}:
                self.tell(one, word)
            elif any(map(self.is_array, one.args)):
                self.tell(one, f"{word} of an array")

    def built_in(self, one: ast.Call, found: Any) -> None:
        """Functions of arrays: what they are given."""
        if found in (np.empty, np.zeros) and any(
            self.resolved(part) not in calls.ITEM_OF for part in one.args[1:]
        ):
            self.tell(one, "an array of other numbers")
        if found in (min, max, abs, int, float, bool, complex) and any(
            isinstance(part, ast.Subscript) and self.is_array(part) for part in one.args
        ):
            self.tell(one, f"{found.__name__} of an array")


@functools.cache
def axes_of_fields() -> dict[str, int]:
    """How many axes the arrays have that are fields of structs, those of a name that all have alike."""
    found: dict[str, set[int]] = {}
    for module in MODULES:
        for one in shared(module).values():
            if isinstance(one, type) and issubclass(one, tuple) and hasattr(one, "_fields"):
                hints = typing.get_type_hints(one, include_extras=True)
                for name, hint in hints.items():
                    kind = getattr(hint, "__metadata__", (None,))[0]
                    found.setdefault(name, set()).add(getattr(kind, "ndim", 0))
    return {name: min(axes) for name, axes in found.items() if len(axes) == 1 and 0 not in axes}


def gives_array(found: Any) -> bool:
    """Whether a kernel says that it returns an array."""
    if not isinstance(found, jit.InlinedFunction):
        return False
    said = found.py_func.__annotations__.get("return", "")
    return str(said).endswith("ndarray")


def is_deferred_known(one: jit.Deferred) -> bool:
    """Whether the printer has what numba makes."""
    make: Any = one.make
    return make.func in (structs.make_opener, jit.optimised) or hasattr(
        calls.Calls, f"call_{make.args[1]}"
    )


@pytest.mark.parametrize("module", MODULES)
def test_kernels_are_in_the_subset(module: str) -> None:
    faults = {
        name: found
        for name, kernel in kernels_of(module).items()
        if (found := Check(kernel, shared(module)).faults)
    }
    _, outside = OUTSIDE.get(module, ("", set[str]()))
    assert {name: found for name, found in faults.items() if name not in outside} == {}
    assert outside <= faults.keys()  # none of them is there in vain


@pytest.mark.parametrize("module", MODULES)
def test_all_kernels_are_looked_at(module: str) -> None:
    compiled = {
        one.__name__
        for one in shared(module).values()
        if isinstance(one, jit.InlinedFunction | structs.Routine)
        and source_of(one).__module__ == shared(module)["__name__"]
    }
    assert compiled <= {name.rpartition(".")[2] for name in kernels_of(module)}


KERNEL = """
def kernel(x: np.ndarray, A: np.ndarray, k: int) -> float:
    B = np.zeros((2, 3))
    {}
"""


@pytest.mark.parametrize(
    "statement",
    [
        "return sum([a for a in x])",
        "y = {}",
        "y = {1, 2}",
        "y = f'{k}'",
        "y = lambda: k",
        "y = 1j * k",
        "y = k @ k",
        "y = x if k is None else A",
        "x.fill(0.0)",
        "y = x.max()",
        "y = np.sum(x)",
        "y = np.sqrt(x)",
        "y = 2.0 * x",
        "y = B[0] - 1.0",
        "B[1] += 1.0",
        "x[:2] *= 2.0",
        "y = x[::2]",
        "y = B[x]",
        "y = np.zeros(3, dtype=np.int64)",
        "y = np.zeros(3, np.int8)",
        "k.field = 1",
        "y = kernel(**k)",
        "yield k",
        "assert k",
        "try: k = 1\n    finally: k = 2",
        "with k: k = 1",
        "if k: return x",
        "for i in range(3): k = i\n    else: k = 2",
        "for i in (1, 2):\n        if k: break",
        "for i in range(3):\n        if invoke(A[i], k, 0) > 0: break",
        "while clearance(k): k = 1",
        "def inner(): return k",
    ],
)
def test_what_is_outside_of_the_subset_is_found(statement: str) -> None:
    (kernel,) = ast.parse(KERNEL.replace("{}", statement, 1)).body
    assert isinstance(kernel, ast.FunctionDef)
    assert Check(kernel, shared("contact/shapes.py")).faults
