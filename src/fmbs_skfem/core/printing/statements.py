"""Statements of kernels as lines of C."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .calls import Calls, InlineError, Results, leaves_of, shape_of
from .expressions import SIGNS
from .frames import WiderError, assignments, tree_of
from .values import (
    KINDS,
    NONE,
    ONE,
    ZERO,
    Array,
    Callee,
    ChoiceError,
    Const,
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


class KernelBody(Calls):
    """The statements of a kernel, and what it returns."""

    results: list[Any]

    def run(self) -> Any:
        """Print all statements; what the kernel returns: nothing, a known number, a kind, several."""
        self.results = []
        self.block(tree_of(self.function).body)
        if not self.results:
            return None
        first = self.results[0]
        if isinstance(first, Results):
            return first
        known = {repr(one) for one in self.results if isinstance(one, Const)}
        if len(known) == 1 and all(isinstance(one, Const) for one in self.results):
            return first
        return widest(*map(kind_of, self.results), self.kinds.get("return", KINDS[0]))

    def block(self, statements: Sequence[ast.stmt]) -> None:
        for one in statements:
            if self.ended:
                return
            try:
                getattr(self, f"do_{type(one).__name__}", self.refuse)(one)
            except OutsideError as error:
                self.place(error, one)
                raise

    def place(self, error: OutsideError, one: ast.stmt) -> None:
        """Say where in the text of a kernel an error is, once."""
        if not hasattr(error, "placed"):
            code = self.function.__code__
            line = code.co_firstlineno + one.lineno - 1
            error.args = (f"{code.co_filename}:{line}: {error}",)
            error.placed = True  # type: ignore[attr-defined]

    def do_Pass(self, one: ast.Pass) -> None:
        """Nothing."""

    def do_Expr(self, one: ast.Expr) -> None:
        if not isinstance(one.value, ast.Constant):
            self.value(one.value)

    # results

    def do_Return(self, one: ast.Return) -> None:
        self.finish(NONE if one.value is None else self.value(one.value))
        self.ended = True

    def finish(self, found: Value) -> None:
        """Return a value."""
        if found == NONE:
            self.emit("return;")
            return
        leaves = leaves_of(found)
        if any(isinstance(one, Array | Pointer | Struct | Callee) for one in leaves):
            raise InlineError
        if isinstance(found, Several):
            self.finish_several(found, leaves)
            return
        self.results.append(found)
        kinds = [kind_of(one) for one in self.results]
        wide = self.kinds.get("return", kinds[0])
        if widest(wide, *kinds) != wide:
            raise WiderError("return", widest(*kinds))
        self.emit(f"return {bare(text_of(found, wide))};")

    def finish_several(self, found: Several, leaves: Sequence[Any]) -> None:
        """Return several numbers."""
        kinds = [kind_of(one) for one in leaves]
        if self.results:
            before = self.results[0].kinds
            kinds = [widest(*both) for both in zip(kinds, before, strict=True)]
        shape = Results(kinds, shape_of(found))
        self.results = [shape]
        self.printer.structs[shape.struct] = shape.kinds
        name = self.fresh("result")
        texts = (bare(text_of(one, kind)) for one, kind in zip(leaves, kinds, strict=True))
        self.emit(f"const {shape.struct} {name} = {{{', '.join(texts)}}};")
        self.emit(f"return {name};")

    # assignments

    def do_AnnAssign(self, one: ast.AnnAssign) -> None:
        if one.value is not None:
            self.assign(one.target, self.value(one.value))

    def do_Assign(self, one: ast.Assign) -> None:
        if (
            len(one.targets) == 1
            and isinstance(one.targets[0], ast.Tuple)
            and isinstance(one.value, ast.Tuple)
            and not any(isinstance(part, ast.Starred) for part in one.value.elts)
        ):
            self.assign_side_by_side(one.targets[0].elts, one.value.elts)
            return
        before = self.snapshot()
        try:
            found = self.value(one.value)
        except ChoiceError:
            if not isinstance(one.value, ast.IfExp):
                raise
            self.restore(before)
            self.choose(one.targets, one.value)
            return
        found = self.hold(found) if len(one.targets) > 1 else found
        for target in reversed(one.targets):
            self.assign(target, found)

    def choose(self, targets: list[ast.expr], one: ast.IfExp) -> None:
        """A choice whose sides need statements, as branches."""
        sides = [ast.Assign(targets, side, lineno=one.lineno) for side in (one.body, one.orelse)]
        for target in targets:
            for name in assignments(ast.Assign([target], one)):
                self.counts = {**self.counts, name: 2}
        self.do_If(ast.If(one.test, [sides[0]], [sides[1]]))

    def snapshot(self) -> tuple[Any, ...]:
        """What is printed so far."""
        root = self.root
        return (
            len(root.lines),
            len(root.rooms),
            root.depth,
            dict(root.variables),
            dict(self.environment),
        )

    def restore(self, before: tuple[Any, ...]) -> None:
        """Take back all that was printed since."""
        root = self.root
        lines, rooms, root.depth, root.variables, self.environment = before
        del root.lines[lines:]
        del root.rooms[rooms:]
        self.ended = False

    def assign_side_by_side(self, targets: Sequence[ast.expr], values: Sequence[ast.expr]) -> None:
        """Several values to as many targets: all are read before any is written."""
        names = {one.id for one in targets if isinstance(one, ast.Name)}
        read = {
            node.id for value in values for node in ast.walk(value) if isinstance(node, ast.Name)
        }
        if len(names) == len(targets) and not names & read:
            for target, value in zip(targets, values, strict=True):
                self.assign(target, self.value(value))
            return
        found = [self.value(value) for value in values]
        found = [self.copied(one) if isinstance(one, Scalar) else one for one in found]
        for target, one in zip(targets, found, strict=True):
            self.assign(target, one)

    def assign(self, target: ast.expr, found: Value) -> None:
        """A value to a name, a place in an array, or several to a tuple."""
        if isinstance(target, ast.Name):
            self.bind(target.id, found)
        elif isinstance(target, ast.Tuple):
            for one, part in zip(target.elts, self.parts(found), strict=True):
                self.assign(one, part)
        elif isinstance(target, ast.Subscript):
            self.store(target, found)
        else:
            self.refuse(target)

    def array_of(self, target: ast.Subscript) -> tuple[Array, list[Any]]:
        """The array and the indices of a place that is written."""
        array = self.value(target.value)
        if not isinstance(array, Array):
            raise OutsideError("a place that is none of an array")
        array.base.written = True
        return array, self.places(target.slice)

    def store(self, target: ast.Subscript, found: Value) -> None:
        """A number to a place in an array, or to all places of a part of it."""
        array, places = self.array_of(target)
        some = self.element(array, places)
        if isinstance(some, Array):
            self.fill(some, found)
            return
        kind = "whole" if array.item == "int" else array.item
        if widest(kind_of(found), kind) != kind:
            raise OutsideError(f"a number of kind {kind_of(found)} in an array of {kind}")
        self.emit(f"{self.target_of(array, places)} = {bare(text_of(found, kind))};")

    def do_AugAssign(self, one: ast.AugAssign) -> None:
        if isinstance(one.target, ast.Name):
            before = self.value(ast.Name(one.target.id))
            self.assign(one.target, self.operation(type(one.op), before, self.value(one.value)))
            return
        assert isinstance(one.target, ast.Subscript)
        array, places = self.array_of(one.target)
        target = self.target_of(array, places)
        kind = "whole" if array.item == "int" else array.item
        value = self.value(one.value)
        if kind == "pair" or type(one.op) not in SIGNS:
            found = self.operation(type(one.op), Scalar(target, kind), value)
            self.emit(f"{target} = {bare(text_of(found, kind))};")
            return
        self.emit(f"{target} {SIGNS[type(one.op)]}= {bare(text_of(value, kind))};")

    # flow

    def do_If(self, one: ast.If) -> None:
        condition = self.value(one.test)
        if isinstance(condition, Const):
            self.block(one.body if condition.value else one.orelse)
            return
        self.emit(f"if ({bare(text_of(condition))}) {{")
        ended = self.branch(one.body)
        if one.orelse:
            self.emit("} else {")
            ended = self.branch(one.orelse) and ended
            self.ended = ended
        self.emit("}")

    def branch(self, statements: Sequence[ast.stmt]) -> bool:
        """Statements that may not run; whether those behind them are never reached."""
        before = dict(self.environment)
        self.root.depth += 1
        self.block(statements)
        self.root.depth -= 1
        ended, self.ended = self.ended, False
        self.forget(before)
        return ended

    def forget(self, before: Mapping[str, Value]) -> None:
        """Behind such statements only variables of the program keep what they made of names."""
        after, self.environment = self.environment, dict(before)
        for name, value in after.items():
            if self.is_variable(value):
                self.environment[name] = value
            elif name in before and before[name] != value:
                self.environment.pop(name)

    def enter(self, statements: Sequence[ast.stmt]) -> None:
        """What a loop assigns is not known in it, but for variables of the program."""
        for name in {name for one in statements for name in assignments(one)}:
            found = self.environment.get(name)
            if found is not None and not self.is_variable(found):
                self.environment.pop(name)

    def do_While(self, one: ast.While) -> None:
        self.refuse_else(one)
        self.enter([one])
        lines = len(self.root.lines)
        condition = self.value(one.test)
        if condition == Const(False):
            return
        if len(self.root.lines) > lines:
            raise OutsideError("a condition of a loop that needs statements")
        self.emit(f"while ({bare(text_of(condition))}) {{")
        self.branch(one.body)
        self.emit("}")

    def refuse_else(self, one: ast.For | ast.While) -> None:
        if one.orelse:
            raise OutsideError("what follows a loop that nothing left")

    def do_Break(self, one: ast.Break) -> None:
        self.emit("break;")
        self.ended = True

    def do_Continue(self, one: ast.Continue) -> None:
        self.emit("continue;")
        self.ended = True

    def do_For(self, one: ast.For) -> None:
        self.refuse_else(one)
        if isinstance(one.iter, ast.Call) and getattr(one.iter.func, "id", "") == "range":
            self.count(one, [self.value(part) for part in one.iter.args])
            return
        found = self.value(one.iter)
        if isinstance(found, Several):
            self.write_out(one, found.parts, "it goes over a tuple")
        elif isinstance(found, Array) and isinstance(found.shape[0], Const):
            self.attempt(one, self.parts(found), lambda: self.go_over(one, found))
        elif isinstance(found, Array):
            self.go_over(one, found)
        else:
            raise OutsideError("a loop over what is no range and no array")

    def count(self, one: ast.For, limits: Sequence[Any]) -> None:
        """A loop over a range."""
        begin, end, step = (ZERO, *limits, ONE) if len(limits) == 1 else (*limits, ONE)[:3]
        spelled = self.function in self.printer.spelled
        if all(isinstance(part, Const) for part in (begin, end, step)):
            numbers = range(begin.value, end.value, step.value)
            parts = [Const(k) for k in numbers]
            if spelled:
                self.write_out(one, parts, "it is to be")
            elif numbers:
                self.attempt(one, parts, lambda: self.loop(one, begin, end, step))
        else:
            self.loop(one, begin, end, step)

    def attempt(self, one: ast.For, parts: Sequence[Value], loop: Callable[[], None]) -> None:
        """A loop; where its body has to know what it goes over, written out."""
        before = self.snapshot()
        try:
            loop()
        except UnknownError as error:
            self.restore(before)
            self.write_out(one, parts, str(error))

    def write_out(self, one: ast.For, parts: Sequence[Value], why: str) -> None:
        """A loop as the statements of all its rounds."""
        if any(isinstance(node, ast.Break | ast.Continue) for node in ast.walk(one)):
            raise OutsideError(f"a break in a loop that is written out, since {why}")
        for part in parts:
            if isinstance(one.target, ast.Name):
                self.environment[one.target.id] = part
            else:
                self.assign(one.target, part)
            self.block(one.body)
            if self.ended:
                return

    def loop(self, one: ast.For, begin: Number, end: Number, step: Number) -> None:
        """A loop that counts."""
        if not isinstance(one.target, ast.Name):
            raise OutsideError("a loop with several names")
        self.enter(one.body)
        end = self.hold(end)
        # `_` may count loops inside of each other, which share nothing
        k = self.fresh("k") if one.target.id == "_" else self.word(one.target.id)
        if self.kinds.get(k, "whole") != "whole":
            raise OutsideError(f"'{k}' counts a loop, and is a {self.kinds[k]}")
        self.root.variables[k] = "whole"
        self.environment[one.target.id] = Scalar(k, "whole")
        down = isinstance(step, Const) and step.value < 0
        by = {ONE: f"{k}++", Const(-1): f"{k}--"}.get(step, f"{k} += {text_of(step)}")  # type: ignore[arg-type]
        head = f"{k} = {bare(text_of(begin))}; {k} {'>' if down else '<'} {text_of(end)}; {by}"
        self.emit(f"for ({head}) {{")
        self.branch(one.body)
        self.emit("}")

    def go_over(self, one: ast.For, found: Array) -> None:
        """A loop over the numbers or rows of an array."""
        self.enter(one.body)
        k = Scalar(self.fresh("k"), "whole")
        self.emit(f"for (whole {k.text} = 0; {k.text} < {text_of(found.shape[0])}; {k.text}++) {{")
        before = dict(self.environment)
        self.root.depth += 1
        self.assign(one.target, self.element(found, [k]))
        self.block(one.body)
        self.root.depth -= 1
        self.ended = False
        self.forget(before)
        self.emit("}")

    # kernels in their callers

    def written_out(self, function: Any, given: Mapping[str, Value]) -> Value:
        body = WrittenOut(self.printer, function, self.kinds, self, self.fresh("in") + "_")
        for name, one in given.items():
            body.environment[name] = self.kept(one) if isinstance(one, Several) else self.hold(one)
        body.block(tree_of(function).body)
        return body.found


class WrittenOut(KernelBody):
    """A kernel that is written into its caller."""

    found: Value = NONE

    def finish(self, found: Value) -> None:
        assert self.caller is not None
        if self.is_nested:
            raise OutsideError("a return inside of a branch of a kernel that returns arrays")
        self.found = self.pointed("result", found) if isinstance(found, Array) else found

    @property
    def is_nested(self) -> bool:
        """Whether statements of a branch are printed."""
        return self.root.depth != self.begun

    def block(self, statements: Sequence[ast.stmt]) -> None:
        if not hasattr(self, "begun"):
            self.begun = self.root.depth
        super().block(statements)
