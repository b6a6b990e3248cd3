"""What kernels that were printed need in C: constants, fields of the memory of a program, structs.

    program = PrintedProgram(printer, own)      own: the program's own functions, which name regions by `region`

Arrays that kernels write, and those that the program itself writes, are fields of NAME_memory; their
numbers at the start are those that are there now.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .memory import MARK
from .printer import KernelPrinter
from .values import plain, written

WIDTH = 130  #: of a line
ZEROS = 8  #: numbers at the start from which on they are cleared in a loop


def region(name: str) -> str:
    """The place in C of the numbers of an array, in functions of a program."""
    return f"{MARK}{name}{MARK}"


class PrintedProgram:
    """Texts of C of all kernels, and of a program around them."""

    def __init__(self, printer: KernelPrinter, own: str = "") -> None:
        self.printer = printer
        printer.finish()
        code = printer.text()
        names = set(re.findall(f"{MARK}(\\w+){MARK}", code + own))
        memory = printer.memory
        found = sorted(memory.regions, key=lambda one: one.number)
        known = [one for one in found if one.name in names]
        missing = sorted(names - {one.name for one in known})
        self.fields = [one for one in known if memory.is_field(one)]
        self.places = {one.name: f"m->{one.name}" for one in self.fields} | {
            one: f"m->{one}" for one in missing
        }
        fixed = [one for one in known if one.name not in self.places]
        self.places |= {one.name: f"the_{one.name}" for one in fixed}
        self.constants = "\n".join(
            [
                *(array(f"the_{one.name}", one.item, one.numbers()) for one in fixed),
                *(
                    array(name, kind, values)
                    for name, (kind, values) in memory.tables.items()
                    if re.search(rf"\b{name}\b", code)
                ),
            ]
        )
        #: empty arrays that the program names have a number that nothing reads
        self.declared = "\n".join(
            [
                *(f"    {one.item} {one.name}[{one.size}];" for one in self.fields),
                *(f"    double {name}[1];" for name in missing),
                *(f"    double {name}[{len(values)}];" for name, values in memory.fields.items()),
            ]
        ).replace("whole ", "long long ")
        self.structs = "\n".join(
            f"{name} {{ {' '.join(f'{kind} n{k};' for k, kind in enumerate(kinds))} }};"
            for name, kinds in printer.structs.items()
        )
        self.code = self.resolved(code)
        self.own = self.resolved(own)

    def resolved(self, text: str) -> str:
        """A text with all regions at their places."""
        return re.sub(f"{MARK}(\\w+){MARK}", lambda found: self.places[found[1]], text)

    def starts(self, found: Sequence[str] = ()) -> tuple[str, str]:
        """Constants, and statements that give all fields of the memory `m` their start, but for those
        whose names begin as some that the program `found` itself.
        """
        constants, lines = [], []
        for one in self.fields:
            if one.name.startswith(tuple(found)):
                continue
            numbers = one.numbers()
            name = f"m->{one.name}"
            if one.size >= ZEROS and not numbers.any():
                lines.append(f"for (int i = 0; i < {one.size}; i++)\n        {name}[i] = 0;")
            elif one.size >= ZEROS:
                constants.append(array(f"start_{one.name}", one.item, numbers))
                lines.append(
                    f"for (int i = 0; i < {one.size}; i++)\n        {name}[i] = start_{one.name}[i];"
                )
            else:
                lines += [
                    f"{name}[{k}] = {text(value, one.item)};" for k, value in enumerate(numbers)
                ]
        for name, values in self.printer.memory.fields.items():
            lines += [f"m->{name}[{k}] = {text(one, 'double')};" for k, one in enumerate(values)]
        return "\n".join(constants), "\n".join(f"    {line}" for line in lines)


def text(value: object, item: str) -> str:
    """A number of an array in C, in as few letters as there are for it."""
    found = written(plain(value), "double" if item == "double" else "whole").strip("()")
    return found if found == "-0.0" else found.removesuffix(".0").replace("e-0", "e-")


def array(name: str, item: str, values: ArrayLike) -> str:
    """A constant array, row by row; of no numbers one that nothing reads."""
    numbers = np.asarray(values).ravel()
    head = f"static const {item} {name}[{max(1, numbers.size)}] = {{"
    if not numbers.any() and not np.signbit(numbers).any():
        return f"{head}0}};"
    inside = ", ".join(text(one, item) for one in numbers) or "0"
    if len(head) + len(inside) + 2 <= WIDTH:
        return f"{head}{inside}}};"
    lines = textwrap.wrap(inside, WIDTH - 1, break_long_words=False, break_on_hyphens=False)
    return "\n".join([head, *lines, "};"])
