"""Expressions of kernels as text of C."""

from __future__ import annotations

import ast
import builtins
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .frames import Frame
from .values import (
    FALSE,
    ONE,
    TRUE,
    ZERO,
    Array,
    Base,
    Callee,
    Const,
    HostFunctions,
    Number,
    OutsideError,
    Scalar,
    Several,
    Struct,
    UnknownError,
    Value,
    bare,
    kind_of,
    plain,
    text_of,
    widest,
)

SIGNS: Mapping[type, str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
RELATIONS: Mapping[type, str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
#: of known numbers; divisions by zero follow IEEE, as in compiled code
KNOWN: Mapping[type, Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b, ast.Sub: lambda a, b: a - b, ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: np.float64(a) / np.float64(b) if b == 0 else a / b,
    ast.FloorDiv: lambda a, b: a // b, ast.Mod: lambda a, b: a % b, ast.Pow: lambda a, b: a**b,
    ast.Lt: lambda a, b: a < b, ast.LtE: lambda a, b: a <= b, ast.Gt: lambda a, b: a > b,
    ast.GtE: lambda a, b: a >= b, ast.Eq: lambda a, b: a == b, ast.NotEq: lambda a, b: a != b,
}  # fmt: skip
#: operations of whole numbers, and of complex ones, that are functions of the program
WHOLE: Mapping[type, str] = {ast.FloorDiv: "quotient", ast.Mod: "remainder_of"}
PAIR: Mapping[type, str] = {
    ast.Add: "pair_sum", ast.Sub: "pair_difference", ast.Mult: "pair_product", ast.Div: "pair_quotient",
}  # fmt: skip
SMALL = 4  #: powers up to which they are products


class Expressions(Frame):
    """What expressions are: known, or text of C."""

    def value(self, one: ast.expr) -> Value:
        """The value of an expression."""
        found: Value = getattr(self, f"of_{type(one).__name__}", self.refuse)(one)
        return found

    def refuse(self, one: ast.AST) -> Any:
        raise OutsideError(f"{type(one).__name__} has no C")

    def of_Constant(self, one: ast.Constant) -> Value:
        return Const(one.value)

    def of_Name(self, one: ast.Name) -> Value:
        name = one.id
        if name in self.environment:
            return self.environment[name]
        for place in (self.enclosed, self.globals, vars(builtins)):
            if name in place:
                return self.lifted(place[name], name)
        raise OutsideError(f"'{name}' has no value that is known here")

    def lifted(self, value: Any, name: str) -> Value:
        """A value of Python."""
        if isinstance(value, bool | int | float | str | np.generic) or value is None:
            return Const(plain(value))
        if isinstance(value, np.ndarray):
            return self.memory.enclose(value, f"{self.function.__name__}_{name}")
        if isinstance(value, tuple):
            return Several(tuple(self.lifted(part, name) for part in value))
        return Callee(value)

    def of_Attribute(self, one: ast.Attribute) -> Value:
        found = self.value(one.value)
        if isinstance(found, Struct):
            field: Value = self.memory.field(found, one.attr)
            return field
        if isinstance(found, Array):
            return self.of_array(found, one.attr)
        if isinstance(found, Several) and found.kind is not None:
            part: Value = found.parts[found.kind._fields.index(one.attr)]
            return part
        if isinstance(found, Callee) and isinstance(found.value, types.ModuleType):
            return self.lifted(getattr(found.value, one.attr), one.attr)
        if isinstance(found, Scalar):
            return self.part_of(found, one.attr)
        if isinstance(found, HostFunctions):
            return Callee((one.attr, found))
        raise OutsideError(f"'{one.attr}' of {type(found).__name__.lower()}")

    def of_array(self, array: Array, name: str) -> Value:
        """An attribute of an array."""
        if name == "shape":
            return Several(array.shape)
        if name == "size":
            return self.size_of(array)
        return Callee((name, array))

    def part_of(self, one: Scalar, name: str) -> Value:
        """The real or imaginary part of a number; `conjugate` is a method."""
        if name not in ("real", "imag"):
            return Callee((name, one))
        if one.kind != "pair":
            return one if name == "real" else Const(0.0)
        return Scalar(f"{self.hold(one).text}.{name}", "double")

    def size_of(self, array: Array) -> Number:
        """How many numbers an array has."""
        total: Number = ONE
        for one in array.shape:
            total = self.operation(ast.Mult, total, one)
        return total

    def of_Tuple(self, one: ast.Tuple | ast.List) -> Value:
        parts: list[Value] = []
        for part in one.elts:
            if isinstance(part, ast.Starred):
                parts += self.parts(self.value(part.value))
            else:
                parts.append(self.value(part))
        return Several(tuple(parts))

    of_List = of_Tuple

    def parts(self, found: Value) -> Sequence[Value]:
        """The values of a tuple, or of a short array."""
        if isinstance(found, Several):
            return found.parts
        if isinstance(found, Array) and isinstance(found.shape[0], Const):
            return [self.element(found, [Const(k)]) for k in range(found.shape[0].value)]
        raise OutsideError(f"a tuple in place of {type(found).__name__.lower()}")

    def of_UnaryOp(self, one: ast.UnaryOp) -> Value:
        found = self.value(one.operand)
        if isinstance(one.op, ast.Not):
            return Const(not found.value) if isinstance(found, Const) else self.denied(found)
        if not isinstance(one.op, ast.USub):
            return self.refuse(one.op)
        if isinstance(found, Const):
            return Const(-found.value)
        kind = kind_of(found)
        minus = f"pair_minus({text_of(found)})" if kind == "pair" else f"(-{text_of(found)})"
        return Scalar(minus, kind)

    def denied(self, found: Any) -> Number:
        return Scalar(f"!{text_of(found)}", "whole")

    def of_BinOp(self, one: ast.BinOp) -> Value:
        return self.operation(type(one.op), self.value(one.left), self.value(one.right))

    def operation(self, sign: type, a: Any, b: Any) -> Number:
        """A sum, a product, ... of two numbers."""
        if isinstance(a, Const) and isinstance(b, Const):
            return Const(plain(KNOWN[sign](a.value, b.value)))
        kind = widest(kind_of(a), kind_of(b))
        if kind == "whole" and (found := self.shortened(sign, a, b)) is not None:
            return found
        if sign is ast.Pow:
            return self.power(a, b)
        if kind == "pair":
            return Scalar(f"{PAIR[sign]}({text_of(a, kind)}, {text_of(b, kind)})", kind)
        if sign in WHOLE and kind == "whole":
            return Scalar(f"{WHOLE[sign]}({bare(text_of(a))}, {bare(text_of(b))})", kind)
        if sign not in SIGNS:
            raise OutsideError(f"{sign.__name__} has no C")
        if sign is ast.Div:
            kind = "double"
        return Scalar(f"({text_of(a, kind)} {SIGNS[sign]} {text_of(b, kind)})", kind)

    def shortened(self, sign: type, a: Any, b: Any) -> Number | None:
        """A sum or product of whole numbers of which one is 0 or 1; None of others."""
        if sign is ast.Mult and ZERO in (a, b):
            return ZERO
        if (sign in (ast.Add, ast.Sub) and b == ZERO) or (sign is ast.Mult and b == ONE):
            return a
        if (sign is ast.Add and a == ZERO) or (sign is ast.Mult and a == ONE):
            return b
        return None

    def power(self, a: Any, b: Any) -> Number:
        """Small whole powers as products."""
        if isinstance(b, Const) and b.value in range(1, SMALL + 1):
            base = self.hold(a)
            found: Number = base
            for _ in range(1, int(b.value)):
                found = self.operation(ast.Mult, found, base)
            return found
        return Scalar(f"math_pow({text_of(a, 'double')}, {text_of(b, 'double')})", "double")

    def of_BoolOp(self, one: ast.BoolOp) -> Value:
        every = isinstance(one.op, ast.And)
        parts: list[Any] = []
        for part in one.values:
            self.lazy += bool(parts)
            try:
                found = self.value(part)
            finally:
                self.lazy -= bool(parts)
            if not isinstance(found, Const):
                parts.append(found)
            elif bool(found.value) != every:
                # what stands before it does nothing
                return Const(not every)
        if not parts:
            return Const(every)
        text = (" && " if every else " || ").join(map(text_of, parts))
        return Scalar(f"({text})" if len(parts) > 1 else text, "whole")

    def of_Compare(self, one: ast.Compare) -> Value:
        if isinstance(one.ops[0], ast.In | ast.NotIn):
            return self.among(one)
        left = self.value(one.left)
        found: list[Number] = []
        for relation, operand in zip(one.ops, one.comparators, strict=True):
            right = self.value(operand)
            right = self.hold(right) if len(one.ops) > 1 else right
            found.append(self.compared(type(relation), left, right))
            left = right
        if any(part == FALSE for part in found):
            return FALSE
        open_ones = [text_of(part) for part in found if part != TRUE]
        if not open_ones:
            return TRUE
        text = " && ".join(open_ones)
        return Scalar(f"({text})" if len(open_ones) > 1 else text, "whole")

    def among(self, one: ast.Compare) -> Value:
        """Whether a number is one of several."""
        a = self.hold(self.value(one.left))
        equal = [self.compared(ast.Eq, a, b) for b in self.parts(self.value(one.comparators[0]))]
        negative = isinstance(one.ops[0], ast.NotIn)
        if TRUE in equal:
            return Const(not negative)
        open_ones = [text_of(part) for part in equal if part != FALSE]
        if not open_ones:
            return Const(negative)
        return Scalar(f"{'!' if negative else ''}({' || '.join(open_ones)})", "whole")

    def compared(self, relation: type, a: Any, b: Any) -> Number:
        """A comparison of two numbers."""
        if isinstance(a, Const) and isinstance(b, Const):
            return Const(bool(KNOWN[relation](a.value, b.value)))
        kind = widest(kind_of(a), kind_of(b))
        if kind == "pair":
            raise OutsideError("a comparison of complex numbers")
        return Scalar(f"({text_of(a, kind)} {RELATIONS[relation]} {text_of(b, kind)})", "whole")

    def of_IfExp(self, one: ast.IfExp) -> Value:
        condition = self.value(one.test)
        if isinstance(condition, Const):
            return self.value(one.body if condition.value else one.orelse)
        condition = self.hold(condition)
        self.lazy += 1
        try:
            a, b = self.value(one.body), self.value(one.orelse)
        finally:
            self.lazy -= 1
        return self.chosen(condition, a, b)

    def chosen(self, condition: Any, a: Value, b: Value) -> Value:
        """One of two numbers, or of two arrays that are alike."""
        test = text_of(condition)
        if isinstance(a, Array) and isinstance(b, Array):
            if (a.item, a.shape, a.strides) != (b.item, b.shape, b.strides):
                raise OutsideError("a choice between arrays of other sizes")
            base = Base()
            self.printer.link(base, a.base)
            self.printer.link(base, b.base)
            return replace(a, base=base, text=f"({test} ? {a.text} : {b.text})", place=None)
        if isinstance(a, Several) and isinstance(b, Several) and len(a.parts) == len(b.parts):
            pairs = zip(a.parts, b.parts, strict=True)
            return Several(
                tuple(self.chosen(condition, one, other) for one, other in pairs), a.kind
            )
        if a == b:
            return a
        kind = widest(kind_of(a), kind_of(b))
        return Scalar(f"({test} ? {text_of(a, kind)} : {text_of(b, kind)})", kind)

    # arrays

    def of_Subscript(self, one: ast.Subscript) -> Value:
        found = self.value(one.value)
        if isinstance(found, Array):
            return self.element(found, self.places(one.slice))
        if not isinstance(found, Several):
            raise OutsideError(f"a place in {type(found).__name__.lower()}")
        if isinstance(one.slice, ast.Slice):
            ends = (
                None if one is None else self.value(one)
                for one in (one.slice.lower, one.slice.upper)
            )
            return Several(
                found.parts[slice(*(None if end is None else self.known(end) for end in ends))]
            )
        part: Value = found.parts[self.known(self.value(one.slice))]
        return part

    def known(self, one: Value) -> Any:
        """A number that has to be known."""
        if not isinstance(one, Const):
            raise UnknownError("a place in a tuple")
        return one.value

    def places(self, one: ast.expr) -> list[Any]:
        """Indices, of which slices are pairs of their ends."""
        found: list[Any] = []
        for part in one.elts if isinstance(one, ast.Tuple) else [one]:
            if not isinstance(part, ast.Slice):
                found.append(self.value(part))
            elif part.step is not None:
                raise OutsideError("a slice with a step")
            else:
                ends = (part.lower, part.upper)
                found.append(tuple(None if end is None else self.value(end) for end in ends))
        return found

    def strides(self, array: Array) -> list[Number]:
        """How many numbers lie between those whose index differs by one."""
        if array.strides is not None:
            return list(array.strides)
        found: list[Number] = [ONE]
        for size in reversed(array.shape[1:]):
            found.insert(0, self.operation(ast.Mult, found[0], size))
        return found

    def element(self, array: Array, places: Sequence[Any]) -> Value:
        """A number of an array, or a part of it."""
        shape, strides, offset = self.part(array, places)
        if not shape:
            known = self.memory.number_at(array, offset)
            text = f"{array.text}[{bare(text_of(offset))}]"
            kind = "whole" if array.item == "int" else array.item
            return known or Scalar(text, kind, (array, offset))
        place = None
        if array.place is not None and isinstance(offset, Const):
            place = Const(array.place.value + offset.value)
        text = array.text if offset == ZERO else f"({array.text} + {bare(text_of(offset))})"
        found = Array(array.base, text, array.item, tuple(shape), None, place)
        plain = [text_of(one) for one in self.strides(found)]
        if plain != [text_of(one) for one in strides]:
            found = replace(found, strides=tuple(strides))
        return found

    def part(
        self, array: Array, places: Sequence[Any]
    ) -> tuple[list[Number], list[Number], Number]:
        """Results and strides of what indices leave of an array, and where it begins."""
        if len(places) > len(array.shape):
            raise OutsideError(f"{len(places)} indices of an array of {len(array.shape)}")
        offset: Number = ZERO
        shape: list[Number] = []
        kept: list[Number] = []
        for k, (size, stride) in enumerate(zip(array.shape, self.strides(array), strict=True)):
            place = places[k] if k < len(places) else (None, None)
            if isinstance(place, tuple):
                begin, end = place
                begin = ZERO if begin is None else self.counted(begin, size)
                end = size if end is None else self.counted(end, size)
                shape.append(self.operation(ast.Sub, end, begin))
                kept.append(stride)
                place = begin
            step = self.operation(ast.Mult, self.counted(place, size), stride)
            offset = self.operation(ast.Add, offset, step)
        return shape, kept, offset

    def counted(self, place: Any, size: Number) -> Number:
        """An index, of which known ones below zero count from the end."""
        kind_of(place)
        if isinstance(place, Const) and place.value < 0:
            return self.operation(ast.Add, size, place)
        return place

    def target_of(self, array: Array, places: Sequence[Any]) -> str:
        """A number of an array, to be assigned."""
        shape, _, offset = self.part(array, places)
        if shape:
            raise OutsideError("an array that is changed as a whole")
        return f"{array.text}[{bare(text_of(offset))}]"
