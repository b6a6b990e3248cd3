r"""Margins of conditions: how far a comparison is from its change, as an expression that is
continuous where its sides are.

    a < b, a <= b:   m = b - a        and (product, min):   min(m, n)
    a > b, a >= b:   m = a - b        or (sum, max):        max(m, n)

A condition holds where its margin is positive. It jumps from 0 to 1 and back between two instants
at which nobody looks; its margin shows by its rate that it does.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from .expressions import ARITY, BINARY, LENGTH, is_call
from .problems import Problem
from .responses import OfState, of_state

ABOVE = (">", ">=")
BELOW = ("<", "<=")
COMPARISONS = ABOVE + BELOW
BOTH = ("*", "min")
EITHER = ("+", "max")  #: of two conditions


class ComparedSide(NamedTuple):
    """An operand as a text, and its margin; none where it is no condition."""

    text: str
    margin: str = ""


def margin_of(value: OfState) -> OfState | None:
    """The margin of an expression that is a condition; None for any other one, or where it would be
    too long an expression.

    Its dimension is not checked: conditions of a length and of an angle may hold at once.
    """
    text = margin(value)
    if not text or len(text) > LENGTH:
        return None
    try:
        found = of_state(text, parameters=dict(value.parameters))
    except Problem:  # parentheses nested too deep
        return None
    return replace(found, known=value.known)


def margin(value: OfState) -> str:
    """The same as a text, of a program in postfix order."""
    stack: list[ComparedSide] = []
    for step in value.program:
        count = 1 if is_call(step) else ARITY.get(step, 0) if isinstance(step, str) else 0
        parts = stack[len(stack) - count :]
        stack[len(stack) - count :] = [joined(step, parts)]
    return stack[0].margin


def joined(step: float | str, parts: list[ComparedSide]) -> ComparedSide:
    """What a step makes of its operands."""
    texts = [one.text for one in parts]
    if step in COMPARISONS:
        a, b = texts if step in ABOVE else texts[::-1]
        return ComparedSide(f"({texts[0]} {step} {texts[1]})", f"({a} - {b})")
    if step in BINARY:
        text = f"({texts[0]} {step} {texts[1]})"
    elif parts:
        text = f"{str(step).removesuffix('()') if step != 'neg' else '-'}({', '.join(texts)})"
    else:
        return ComparedSide(str(step) if isinstance(step, str) else repr(step))
    if step in BOTH + EITHER and all(one.margin for one in parts):
        return ComparedSide(
            text, f"{'min' if step in BOTH else 'max'}({', '.join(one.margin for one in parts)})"
        )
    return ComparedSide(f"({text})" if step == "neg" else text)
