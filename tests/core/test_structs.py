"""Structs that compiled code opens from an address, and routines behind addresses."""

from __future__ import annotations

import sys
from typing import Any, NamedTuple

import numpy as np
import pytest

from fmbs_skfem.core.compiling.structs import (
    Callback,
    Integers,
    Matrix,
    Shorts,
    Vector,
    invoke,
    opener,
    packed,
    routine,
    unpacked,
)


class Inner(NamedTuple):
    matrix: Matrix
    count: int
    on: bool


class Outer(NamedTuple):
    x: Vector
    inner: Inner
    factor: float
    places: Integers
    shorts: Shorts


opened = opener(Outer)


@routine
def scale(table: Any, more: Any) -> int:
    """x = factor x + matrix[1, 0], and the number of what is counted."""
    p = opened(table)
    for i in range(len(p.x)):
        p.x[i] = p.factor * p.x[i] + p.inner.matrix[1, 0]
    return more + p.inner.count + p.places[2] + p.shorts[1] if p.inner.on else -1


@routine
def twice(table: Any, address: Any) -> int:
    """Another routine by its address, two times."""
    return invoke(address, table, 100) + invoke(address, table, 1000)


@routine
def by_name(table: Any, more: Any) -> int:
    """Another routine by its name."""
    return 2 * scale(table, more)


def outer(on: bool = True) -> Outer:
    inner = Inner(np.arange(6.0).reshape(2, 3), 5, on)
    return Outer(np.arange(4.0), inner, 0.5, np.array([1, 2, 30]), np.array([7, 8], np.int32))


def test_fields_are_where_they_were_packed() -> None:
    """Arrays are those of the caller, numbers keep all their bits."""
    struct = outer()
    assert scale(packed(struct), 10) == 10 + 5 + 30 + 8
    assert struct.x.tolist() == [3.0, 3.5, 4.0, 4.5]
    assert scale(packed(outer(on=False))) == -1
    exact = outer()._replace(factor=1.0 + 2.0**-52)
    scale(packed(exact))
    assert exact.x[1] == 1.0 + 2.0**-52 + 3.0


def test_a_struct_that_begins_with_another_is_read_as_it() -> None:
    class Longer(NamedTuple):
        outer: Outer
        rest: Matrix

    struct = Longer(outer(), np.zeros((2, 2)))
    scale(packed(struct))
    assert struct.outer.x.tolist() == [3.0, 3.5, 4.0, 4.5]


def test_routines_call_routines_and_functions_of_python() -> None:
    struct = outer()
    table = packed(struct)
    assert twice(table, scale.address) == 1100 + 2 * 43
    seen = list[int]()

    def note(address: int, more: int) -> None:
        found = unpacked(Outer, address)
        assert found.inner.on is True
        assert (found.inner.count, found.factor, found.shorts.tolist()) == (5, 0.5, [7, 8])
        assert found.inner.matrix.tolist() == struct.inner.matrix.tolist()
        found.x[0] += more
        seen.append(more)

    callback = Callback(note)
    before = struct.x[0]
    assert twice(table, callback.address) == 0
    assert seen == [100, 1000]
    assert struct.x[0] == before + 1100.0
    callback.check()


def test_the_first_exception_of_a_callback_is_kept() -> None:
    def fail(address: int, more: int) -> None:
        raise KeyError(more)

    callback = Callback(fail)
    assert twice(packed(outer()), callback.address) == 2
    with pytest.raises(KeyError, match="100"):
        callback.check()
    callback.check()


def test_nobody_counts_or_frees_the_arrays() -> None:
    struct = outer()
    before = [sys.getrefcount(array) for array in (struct.x, struct.inner.matrix)]
    for _ in range(100):
        scale(packed(struct))
    assert [sys.getrefcount(array) for array in (struct.x, struct.inner.matrix)] == before


@pytest.mark.parametrize(
    "wrong",
    [np.arange(4), np.arange(4.0)[::2], np.zeros((2, 2)), np.arange(4.0, dtype=np.float32)],
    ids=["integers", "steps", "matrix", "single"],
)
def test_other_arrays_are_refused(wrong: np.ndarray) -> None:
    """What compiled code would read as something else: the place, what was expected, and what came."""
    with pytest.raises(TypeError, match=r"Outer\.x: expected array.float64, 1d, C."):
        packed(outer()._replace(x=wrong))


def test_compiled_code_calls_routines_by_name() -> None:
    """What it calls becomes part of it."""
    struct = outer()
    assert by_name(struct, 10) == 2 * (10 + 5 + 30 + 8)
    assert struct.x.tolist() == [3.0, 3.5, 4.0, 4.5]
