"""Calls in kernels: of other kernels by their names and by address, of structs and arrays, of functions."""

from __future__ import annotations

import ast
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..compiling import jit, structs
from .expressions import Expressions
from .frames import source_of, tree_of
from .values import (
    NONE,
    Array,
    Base,
    Callee,
    Const,
    HostFunctions,
    Number,
    OutsideError,
    Pointer,
    Scalar,
    Several,
    Struct,
    UnknownError,
    Value,
    bare,
    kind_of,
    text_of,
    widest,
)

#: functions of numbers by their names in numpy and `math`, as those of the program
MATHS = {
    name: f"math_{name}"
    for name in ("sqrt", "sin", "cos", "tan", "exp", "log", "tanh", "sinh", "cosh", "floor", "erf")
} | {
    "asinh": "math_asinh", "acosh": "math_acosh", "atanh": "math_atanh", "arcsinh": "math_asinh", "arccosh": "math_acosh",
    "arctanh": "math_atanh", "arcsin": "math_asin", "arccos": "math_acos", "arctan": "math_atan", "arctan2": "math_atan2",
    "asin": "math_asin", "acos": "math_acos", "atan": "math_atan", "atan2": "math_atan2", "rint": "math_round",
    "fabs": "size_of", "absolute": "size_of",
}  # fmt: skip


class InlineError(Exception):
    """A kernel that returns arrays is written into its callers."""


class Calls(Expressions):
    """What calls give."""

    def of_Call(self, one: ast.Call) -> Value:
        callee = self.value(one.func)
        if not isinstance(callee, Callee):
            raise OutsideError("a call of what is no function")
        arguments = list(self.parts(self.of_Tuple(ast.Tuple(one.args))))
        named = {part.arg: self.value(part.value) for part in one.keywords if part.arg}
        return self.called(callee.value, arguments, named)

    def called(self, function: Any, arguments: list[Value], named: dict[str, Value]) -> Value:
        """A call of a function of Python."""
        if isinstance(function, tuple):
            name, owner = function
            return self.method(name, owner, arguments)
        if isinstance(function, jit.Deferred):
            return self.deferred(function, arguments)
        if isinstance(function, type) and hasattr(function, "_fields"):
            rest = (named[name] for name in function._fields[len(arguments) :])
            return Several((*arguments, *rest), function)
        if function in BUILT_IN:
            if named:
                raise OutsideError(f"'{next(iter(named))}' by its name")
            return BUILT_IN[function](self, arguments)
        if isinstance(function, jit.InlinedFunction | structs.Routine | types.FunctionType):
            return self.kernel(function, arguments, named)
        if isinstance(function, np.ufunc) or getattr(function, "__module__", "") == "math":
            return self.of_number(function, arguments)
        raise OutsideError(f"{getattr(function, '__name__', function)} has no C")

    def of_number(self, function: Any, arguments: Sequence[Any]) -> Value:
        """A function of numbers."""
        name = function.__name__
        if all(isinstance(one, Const) for one in arguments):
            return Const(float(function(*(one.value for one in arguments))))
        if any(kind_of(one) == "pair" for one in arguments):
            if name != "sqrt":
                raise OutsideError(f"{name} of complex numbers has no C")
            return Scalar(f"pair_sqrt({bare(text_of(arguments[0]))})", "pair")
        texts = [bare(text_of(one, "double")) for one in arguments]
        if name == "isfinite":
            return Scalar(f"is_finite({texts[0]})", "whole")
        if name not in MATHS:
            raise OutsideError(f"{name} has no C")
        return Scalar(f"{MATHS[name]}({', '.join(texts)})", "double")

    def method(self, name: str, array: Any, arguments: Sequence[Any]) -> Value:
        """A method of an array, or of a complex number; a function of the program."""
        if isinstance(array, HostFunctions):
            return self.asked(f"{name}({', '.join(['m', *map(text_of, arguments)])})", name, array)
        if name == "conjugate" and isinstance(array, Scalar):
            return Scalar(f"pair_conjugate({bare(text_of(array, 'pair'))})", "pair")
        if name == "reshape":
            first, *_ = arguments
            shape = first.parts if isinstance(first, Several) else tuple(arguments)
            return self.viewed(array, shape)
        if name == "copy":
            found = self.room(array.shape, array.item)
            self.fill(found, array)
            return found
        raise OutsideError(f"'{name}' of an array")

    def asked(self, call: str, name: str, program: HostFunctions) -> Value:
        """What a function of the program gives."""
        kind = dict(program.kinds)[name]
        if not kind:
            self.emit(f"{call};")
            return NONE
        found = self.fresh("t")
        self.emit(f"{found} = {call};")
        self.root.variables[found] = kind
        return Scalar(found, kind)

    def viewed(self, array: Array, shape: Sequence[Any]) -> Array:
        """The numbers of an array in another shape, of which one size may be left to find (-1)."""
        if Const(-1) in shape:
            known: Number = Const(1)
            for one in shape:
                known = known if one == Const(-1) else self.operation(ast.Mult, known, one)
            rest = self.operation(ast.FloorDiv, self.size_of(array), known)
            shape = [rest if one == Const(-1) else one for one in shape]
        return replace(array, shape=tuple(shape), strides=None)

    def fill(self, target: Array, value: Value) -> None:
        """Assign all numbers of an array, one of them or those of another array."""
        target.base.written = True
        places = [Scalar(self.fresh("k"), "whole") for _ in target.shape]
        for place, size in zip(places, target.shape, strict=True):
            k = place.text
            self.emit(f"for (whole {k} = 0; {k} < {text_of(size)}; {k}++) {{")
            self.root.depth += 1
        one = self.element(value, places) if isinstance(value, Array) else value
        kind = "whole" if target.item == "int" else target.item
        self.emit(f"{self.target_of(target, places)} = {bare(text_of(one, kind))};")
        for _ in places:
            self.root.depth -= 1
            self.emit("}")

    def deferred(self, function: jit.Deferred, arguments: list[Value]) -> Value:
        """What compiled functions can do beside Python."""
        make: Any = function.make
        if make.func is structs.make_opener:
            found = self.pointer(arguments[0])
            return Struct(make.args[0], found.starts, found.number)
        if make.func is jit.optimised:
            return self.kernel(make.args[0], arguments, {})
        call = getattr(self, f"call_{make.args[1]}", None)
        if call is None:
            raise OutsideError(f"{make.args[1]} has no C")
        found_of: Value = call(*arguments)
        return found_of

    def pointer(self, place: Value) -> Pointer:
        """The address that a value is."""
        if isinstance(place, Pointer):
            return place
        if isinstance(place, Const):
            return self.memory.pointer(place.value)
        if not isinstance(place, Scalar) or place.element is None:
            raise UnknownError("the address of a struct")
        starts = self.memory.numbers_of(place.element[0])
        if not starts:
            raise UnknownError("the address of a struct")
        found = [self.memory.pointer(one) for one in starts]
        if len({one.starts for one in found}) > 1:
            raise UnknownError("the address of a struct")
        numbers = [one.number.value for one in found if isinstance(one.number, Const)]
        return Pointer(found[0].starts, self.memory.choose(numbers, place.element[1], "number"))

    def addressed(self, one: Value) -> Value:
        """A number of a table of addresses of structs that are alike, as one of them."""
        if not isinstance(one, Scalar) or one.element is None:
            return one
        starts = self.memory.numbers_of(one.element[0])
        if not starts or not all(start in self.memory.groups for start in starts):
            return one
        found = self.pointer(one)
        number = self.copied(found.number) if isinstance(found.number, Scalar) else found.number
        return replace(found, number=number)

    def bind(self, name: str, value: Value) -> None:
        super().bind(name, self.addressed(value))

    def call_invoke(self, address: Value, table: Value, more: Value) -> Value:
        function = self.behind(address)
        if isinstance(function, str):
            return Scalar(f"{function}(m, {bare(text_of(more))})", "whole")
        return self.kernel(function, [self.pointer(table), more], {})

    def call_call(self, address: Value, arrays: Value, numbers: Value, number: Value) -> Value:
        function = self.behind(address)
        self.printer.apart.add(source_of(function))
        arguments = [*self.parts(arrays), *self.parts(numbers), number]
        return self.kernel(function, arguments, {})

    def behind(self, address: Value) -> Any:
        """The kernel at an address, or the name of a function of the program itself."""
        if not isinstance(address, Const):
            raise UnknownError("an address")
        if address.value not in self.printer.functions:
            raise OutsideError("a function of Python")
        return self.printer.functions[address.value]

    def call_view(self, array: Array, start: Number, shape: Several) -> Value:
        flat = self.viewed(array, [self.size_of(array)])
        part = self.element(flat, [(start, None)])
        assert isinstance(part, Array)
        return self.viewed(part, shape.parts)

    def call_carray(self, array: Array, shape: Value) -> Value:
        return self.viewed(array, shape.parts if isinstance(shape, Several) else [shape])

    def call_add_product(self, total: Value, a: Value, b: Value) -> Value:
        return self.operation(ast.Add, total, self.operation(ast.Mult, a, b))

    def call_dot(self, a: Array, b: Array) -> Value:
        if a.strides is not None or b.strides is not None:
            raise OutsideError("vectors of numbers side by side")
        count = bare(text_of(a.shape[0]))
        return Scalar(f"dot({bare(a.text)}, {bare(b.text)}, {count})", "double")

    def call_dot_four(self, *rows: Array) -> Value:
        return Several(tuple(self.call_dot(row, rows[-1]) for row in rows[:-1]))

    def kernel(self, called: Any, arguments: Sequence[Value], named: Mapping[str, Value]) -> Value:
        """A call of another kernel."""
        function = source_of(called)
        if isinstance(called, jit.InlinedFunction) and called.options.get("inline"):
            self.printer.inlined.add(function)
        function = source_of(self.printer.stands.get(function, function))
        tree = tree_of(function)
        names = [one.arg for one in tree.args.args]
        given: dict[str, Any] = dict(zip(names, arguments, strict=False)) | dict(named)
        for name, default in zip(reversed(names), reversed(tree.args.defaults), strict=False):
            given.setdefault(name, self.value(default))
        values = [self.addressed(given[name]) for name in names]
        try:
            found = self.printer.printed(function, values)
        except InlineError:
            return self.written_out(function, dict(zip(names, values, strict=True)))
        if found.silent:
            return found.result
        bases = iter(found.bases)
        texts = [
            text
            for one, whole in zip(values, found.taken, strict=True)
            if whole is not None
            for text in self.given(one, whole, bases)
        ]
        text = (
            f"{found.name}({self.printer.memory_mark(found.name, bool(texts))}{', '.join(texts)})"
        )
        return self.result(found, text)

    def result(self, found: Any, text: str) -> Value:
        """What a call gives, under a name."""
        kind = found.result
        if kind is None or isinstance(kind, Const):
            self.emit(f"{text};")
            return kind or NONE
        if isinstance(kind, str):
            one = Scalar(text, kind)
            return one if self.is_lazy else self.copied(one)
        name = self.fresh("found")
        self.emit(f"const {kind.struct} {name} = {text};")
        leaves = iter(Scalar(f"{name}.n{k}", one) for k, one in enumerate(kind.kinds))
        return rebuilt(kind.shape, leaves)

    def given(self, one: Value, whole: bool, bases: Iterator[Base]) -> list[str]:
        """An argument in C; `whole` numbers are given though they are known."""
        if isinstance(one, Const):
            given = isinstance(one.value, float) or (whole and isinstance(one.value, int))
            return [bare(text_of(one))] if given else []
        if isinstance(one, Scalar):
            return [bare(one.text)]
        if isinstance(one, Pointer | Struct):
            return [bare(text_of(one.number))] if len(one.starts) > 1 else []
        if isinstance(one, Several):
            return [text for part in one.parts for text in self.given(part, whole, bases)]
        if not isinstance(one, Array):
            return []
        self.printer.link(next(bases), one.base)
        sizes = [size for size in one.shape if not isinstance(size, Const)]
        return [bare(one.text), *(bare(text_of(size)) for size in (*sizes, *(one.strides or ())))]

    def written_out(self, function: Any, given: Mapping[str, Value]) -> Value:
        """The result of a kernel whose statements are written here."""
        raise NotImplementedError


class Results:
    """Several numbers that a kernel returns."""

    def __init__(self, kinds: Sequence[str], shape: Any) -> None:
        self.kinds, self.shape = tuple(kinds), shape

    @property
    def struct(self) -> str:
        """Their struct in C."""
        return f"struct several_{''.join(one[0] for one in self.kinds)}"


def leaves_of(value: Value) -> list[Any]:
    """All numbers of a tuple of tuples."""
    if not isinstance(value, Several):
        return [value]
    return [leaf for part in value.parts for leaf in leaves_of(part)]


def shape_of(value: Value) -> Any:
    """How tuples are in each other; None of numbers."""
    if not isinstance(value, Several):
        return None
    return value.kind, tuple(map(shape_of, value.parts))


def rebuilt(shape: Any, leaves: Iterator[Any]) -> Value:
    """Tuples of such a shape from all their numbers."""
    if shape is None:
        return next(leaves)
    kind, parts = shape
    return Several(tuple(rebuilt(part, leaves) for part in parts), kind)


def length(body: Calls, arguments: Sequence[Any]) -> Value:
    (one,) = arguments
    return Const(len(one.parts)) if isinstance(one, Several) else one.shape[0]


def extreme(name: str, known: Callable[..., Any]) -> Callable[[Calls, Sequence[Any]], Value]:
    """`min` or `max`."""

    def found(body: Calls, arguments: Sequence[Any]) -> Value:
        parts = arguments if len(arguments) > 1 else body.parts(arguments[0])
        first, *others = parts
        for other in others:
            if isinstance(first, Const) and isinstance(other, Const):
                first = Const(known(first.value, other.value))
                continue
            kind = widest(kind_of(first), kind_of(other))
            word = f"{name}_whole" if kind == "whole" else name
            texts = (bare(text_of(one, kind)) for one in (first, other))
            first = Scalar(f"{word}({', '.join(texts)})", kind)
        return first

    return found


def clipped(body: Calls, arguments: Sequence[Any]) -> Value:
    """`np.clip` of a number."""
    one, least, most = arguments
    return BUILT_IN[min](body, [BUILT_IN[max](body, [least, one]), most])


def size(body: Calls, arguments: Sequence[Any]) -> Value:
    (one,) = arguments
    if isinstance(one, Const):
        return Const(abs(one.value))
    word = {"whole": "size_whole", "double": "size_of", "pair": "pair_size"}[one.kind]
    return Scalar(f"{word}({bare(one.text)})", "whole" if one.kind == "whole" else "double")


def converted(kind: str, known: Callable[..., Any]) -> Callable[[Calls, Sequence[Any]], Value]:
    """`int`, `float` or `bool`."""

    def found(body: Calls, arguments: Sequence[Any]) -> Value:
        (one,) = arguments
        if isinstance(one, Const):
            return Const(known(one.value))
        if known is bool:
            return Scalar(f"({one.text} != 0)", kind)
        return one if one.kind == kind else Scalar(f"({kind}){one.text}", kind)

    return found


def pair(body: Calls, arguments: Sequence[Any]) -> Value:
    texts = (bare(text_of(one, "double")) for one in arguments)
    return Scalar(f"pair_of({', '.join(texts)})", "pair")


def room(clear: bool) -> Callable[[Calls, Sequence[Any]], Value]:
    """`np.zeros` or `np.empty`."""

    def found(body: Calls, arguments: Sequence[Any]) -> Value:
        first, *others = arguments
        shape = first.parts if isinstance(first, Several) else (first,)
        item = ITEM_OF[others[0].value] if others else "double"
        array = body.room(shape, item)
        if clear:
            body.fill(array, Const(0) if item == "whole" else Const(0.0))
        return array

    return found


def product(body: Calls, arguments: Sequence[Any]) -> Value:
    """`np.dot` of two matrices, of which the first may be transposed."""
    a, b = arguments
    turned = isinstance(a, Callee)
    A = a.value[1] if turned else a
    found = body.room((A.shape[1 if turned else 0], b.shape[1]), "double")
    body.kernel(body.printer.products[turned], [A, b, found], {})
    return found


def search(body: Calls, arguments: Sequence[Any]) -> Value:
    """`np.searchsorted` of one number."""
    values, one, *side = arguments
    return body.kernel(
        body.printer.stands[np.searchsorted], [values, one, Const(side == [Const("right")])], {}
    )


ITEM_OF: Mapping[Any, str] = {
    np.int64: "whole",
    np.int32: "int",
    np.float64: "double",
    np.complex128: "pair",
}
BUILT_IN: Mapping[Any, Callable[[Calls, Sequence[Any]], Value]] = {
    len: length, min: extreme("least", min), max: extreme("most", max), abs: size, complex: pair,
    int: converted("whole", int), float: converted("double", float), bool: converted("whole", bool),
    np.empty: room(False), np.zeros: room(True), np.dot: product,
    np.searchsorted: search, np.clip: clipped,
}  # fmt: skip
