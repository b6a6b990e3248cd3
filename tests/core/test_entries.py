"""Functions called by address."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import carray
from numba.core.errors import TypingError

from fmbs_skfem.bodies import laws
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.compiling.entries import call, entry
from fmbs_skfem.core.compiling.jit import jit


@entry
def combine(
    a: Any, b: Any, c: Any, out: Any, n: int, shift: int, minus: int, _: int, factor: float
) -> None:
    """out = factor (a b + c) + shift - minus."""
    x, y, z, target = carray(a, n), carray(b, n), carray(c, n), carray(out, n)
    for i in range(n):
        target[i] = factor * (x[i] * y[i] + z[i]) + shift - minus


@jit
def through(address: int, a: np.ndarray, b: np.ndarray, c: np.ndarray, out: np.ndarray) -> None:
    call(address, (a, b, c, out), (len(a), 7, 2, 0), 0.5)


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


def test_only_what_is_called_has_addresses() -> None:
    """Of functions with and without damping a model has one, so that the other is not compiled."""
    for law, option in ((Law.MATERIAL, 2), (Law.EXACT, 3)):
        plain, damped = (laws.addresses(law, 2, damped=damped) for damped in (False, True))
        assert (plain == 0).nonzero()[0].tolist() == [laws.DISSIPATION]
        assert (plain != damped).nonzero()[0].tolist() == [laws.STRESS, laws.DISSIPATION]
        assert plain[laws.OPTION :].tolist() == [option, 2]
