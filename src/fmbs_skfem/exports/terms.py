"""Elastic terms in C. Storages of reduced bodies become points, whose laws are written from their
symbols, or polynomials.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError, say
from ..systems.affine import Affine
from ..systems.terms import elastic as storages
from ..systems.terms import points as sampled
from ..systems.terms.points import Sampled
from ..systems.terms.quartic import Quartic, length, padded
from . import laws
from .pieces import Array, CodePiece
from .text import number, replaced, template


class TermPlace(NamedTuple):
    """Where a term stands in its system."""

    number: int
    name: str  #: of the body
    dim: int
    beta: float  #: stiffness-proportional damping time [s]
    lift: Affine
    place: Any  #: (first unknown) -> (first entry in W, size of its block)
    #: of the elastic part in the case; empty where its storage is none of it
    leaf: tuple[str | int, ...]
    varied: bool  #: whether parameters change the damping time


@singledispatch
def write_term(storage: Any, setting: TermPlace) -> CodePiece:
    """A term in C. Types of storages register here; InputError for one that has not and has no
    points.
    """
    found = sampled.dense_rows(storages.multiply_out(storage, setting.lift))
    if found is None:
        raise InputError(
            say(f"body '{setting.name}'", "points or a polynomial", type(storage).__name__)
        )
    return write_term(found, setting._replace(leaf=()))


@write_term.register
def _(points: Sampled, setting: TermPlace) -> CodePiece:
    count = points.section.shape[2]
    modes = points.rows.shape[1]
    rows = len(points.rows) // count
    k = setting.number
    zeros = [i for i, row in enumerate(points.section[:-1]) if not row.any()]
    law, functions = laws.functions(
        points.law, setting.dim, setting.beta > 0.0, zeros, f"body '{setting.name}'"
    )
    first = points.columns.start
    at, size = setting.place(first)
    arrays = {
        f"MODES_OF_{k}": array_of(
            points.rows, (*setting.leaf, "gather", "rows"), np.transpose, setting
        ),
        f"SECTION_{k}": array_of(
            points.section, (*setting.leaf, "gather", "section"), np.asarray, setting
        ),
    }
    if setting.varied:
        arrays[f"DAMPING_TIME_{k}"] = Array(
            np.array([setting.beta]), (*setting.leaf, "beta"), np.atleast_1d
        )
    if points.offset.any():
        arrays[f"OFFSET_{k}"] = array_of(
            points.offset, (*setting.leaf, "gather", "offset"), np.asarray, setting
        )
    holds = laws.holds(points.law, setting.dim)
    words = {
        "NUMBER": k, "@POINTS@": count, "@ROWS@": rows, "@MODES@": modes, "@FIRST@": first, "LAW": law,
        "HOLDS_NUMBER": int(holds),
        "BETA_NUMBER": f"DAMPING_TIME_{k}[0]" if setting.varied else number(setting.beta),
        "PLACE_NUMBER": at, "SIZE_NUMBER": size,
    }  # fmt: skip
    if not points.offset.any():
        words |= {"OFFSET_NUMBER": 0}
    text = replaced(template("points.c"), words)
    calls = {
        "force": (f"force_{k}(m);",),
        "tangent": (f"tangent_{k}(m, held);",),
        "energy": (f"energy += energy_{k}(m);",),
    }
    return CodePiece(
        arrays,
        {**functions, f"term_{k}": text},
        calls,
        rows * count,
        rows * (rows + 1) // 2 * count,
        holds=holds,
    )


def array_of(
    values: np.ndarray, place: Sequence[str | int], make: Any, setting: TermPlace
) -> Array:
    """An array that follows from a leaf of the case, where the term is one."""
    return Array(np.asarray(make(values)), tuple(place) if setting.leaf else (), make)


@write_term.register
def _(polynomial: Quartic, setting: TermPlace) -> CodePiece:
    k = setting.number
    modes = polynomial.modes
    at, size = setting.place(polynomial.columns.start)
    n = modes + 1
    words = {
        "NUMBER": k, "@MODES@": modes, "@FIRST@": polynomial.columns.start, "PLACE_NUMBER": at, "SIZE_NUMBER": size,
        "@PAIRS@": n * (n + 1) // 2,
    }  # fmt: skip
    arrays = {
        f"COEFFICIENTS_{k}": array_of(
            polynomial.coefficients,
            (*setting.leaf, "gather", "coefficients"),
            without_padding(modes),
            setting,
        )
    }
    calls = {
        "force": (f"force_{k}(m);",),
        "tangent": (f"tangent_{k}(m, held);",),
        "energy": (f"energy += energy_{k}(m);",),
    }
    return CodePiece(
        arrays,
        {f"term_{k}": replaced(template("polynomial.c"), words)},
        calls,
        n * (n + 1) // 2 + n,
    )


def without_padding(modes: int) -> Any:
    """Coefficients of a polynomial in so many unknowns without the zeros at the ends of their rows."""
    kept = np.zeros(length(modes), bool)
    at = 0
    for c in range(modes + 1):
        size = (c + 1) * (c + 2) // 2
        for _ in range(c, modes + 1):
            kept[at : at + size] = True
            at += padded(size)
    return lambda values: np.asarray(values)[kept]
