"""Functions called by address, and arrays without reference counts."""

from __future__ import annotations

import sys
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import carray
from numba.core.errors import TypingError

from fmbs_skfem.bodies import laws
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.entries import borrowed, call, entry
from fmbs_skfem.core.jit import jit


class Pair(NamedTuple):
    first: np.ndarray
    numbers: tuple[np.ndarray, int]


@entry
def combine(a: Any, b: Any, c: Any, out: Any, n: int, shift: int, minus: int, _: int, factor: float) -> None:
    """out = factor (a b + c) + shift - minus."""
    x, y, z, target = carray(a, n), carray(b, n), carray(c, n), carray(out, n)
    for i in range(n):
        target[i] = factor * (x[i] * y[i] + z[i]) + shift - minus


@jit
def through(address: int, a: np.ndarray, b: np.ndarray, c: np.ndarray, out: np.ndarray) -> None:
    call(address, (a, b, c, out), (len(a), 7, 2, 0), 0.5)


@jit
def sliced(pair: Pair) -> float:
    p = borrowed(pair)
    total = 0.0
    for i in range(len(p.first)):
        total += p.first[i:].sum() * p.numbers[1]
        p.numbers[0][:i] += 1.0
    return total


def test_an_entry_gets_pointers_integers_and_a_number() -> None:
    a, b, c, out = np.arange(5.0), np.full(5, 2.0), np.ones(5), np.zeros(5)
    assert combine() == combine() != 0
    through(combine(), a, b, c, out)
    assert out.tolist() == (0.5 * (a * b + c) + 5).tolist()


def test_an_entry_wants_four_integers() -> None:
    @jit
    def short(address: int, a: np.ndarray) -> None:
        call(address, (a, a, a, a), (1, 2), 0.0)

    with pytest.raises(TypingError):
        short(combine(), np.zeros(1))


def test_borrowed_arrays_are_the_same_arrays_and_nobody_frees_them() -> None:
    pair = Pair(np.arange(4.0), (np.zeros(4), 3))
    before = [sys.getrefcount(array) for array in (pair.first, pair.numbers[0])]
    for _ in range(1000):
        assert sliced(pair) == 3 * (6 + 6 + 5 + 3)
    assert pair.numbers[0].tolist() == [3000.0, 2000.0, 1000.0, 0.0]
    assert [sys.getrefcount(array) for array in (pair.first, pair.numbers[0])] == before


def test_only_what_is_called_has_addresses() -> None:
    """One row a law in use; functions with damping are not compiled where nothing is damped."""
    table = laws.addresses([Law.MATERIAL, Law.EXACT], 2, damped=False).reshape(2, laws.COLUMNS)
    assert table[:, : laws.MODULUS + 1].all()
    assert not table[:, laws.DAMPED_STRESS : laws.OPTION].any()
    assert table[:, laws.OPTION].tolist() == [2, 3]
    assert laws.addresses([], 3).size == 0
