r"""Samples of a family: the numbers of its cases at values of the parameters, and what is round-off
in them.

    noise(row) = SURE max_k |a(mu_k (1 + d)) - a(mu_k)|,    d a few units of round-off

Where a parameter moves geometry, its numbers carry the round-off of a rotation, of a length, of a
derivative over a short cell, more than that of their own size; and a gap of 1e-19 m is a constant
of a constraint in one case and none in another. So numbers are compared to what a change of the
parameters by round-off does to them, and constraints have every term that any case has.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.ranges import Parameter
from ..systems.affine import Affine
from ..systems.system import Constraints
from . import cases
from . import parameters as boxes
from .cases import Case, Family, Leaf, Leaves, Place

#: round-off of a sampled number, relative to the largest in its row
ROUND = 32 * np.finfo(float).eps
#: changes of the parameters that measure noise [units of round-off of the range]
NEIGHBOURS = (
    -7,
    -3,
    4,
    9,
)
SURE = 8.0  #: noise over the largest difference seen
NOISY = 1e-9  #: a difference above this, relative to the largest number, is no round-off
OFFSET = "offset"  #: of affine maps of the unknowns
HARD = "keep it out of the parameters, or take a smaller range"

Key = tuple[int, int, int, int, int]  #: row, signal, i, j, and which of those that are equal


@dataclass(frozen=True)
class FamilySamples:
    """A family with what is known of it.

    `found` has the leaves that differ from the nominal case, by values (d,) of the parameters;
    `nodes` are the points of every axis.
    """

    family: Family
    parameters: tuple[Parameter, ...]
    nominal: Case
    nodes: tuple[np.ndarray, ...]
    found: dict[tuple[float, ...], Leaves]
    noise: Mapping[Place, np.ndarray] = field(default_factory=dict)  #: by leaf, of every row


def sample_nominal(
    family: Family, parameters: Sequence[Parameter], nodes: tuple[np.ndarray, ...]
) -> FamilySamples:
    """The nominal case alone.

    `nodes` are the points (k,) of every parameter, at which more of it may be sampled.
    """
    row = nominal_row(parameters)
    nominal = cases.with_float_times(family(boxes.named(parameters, row)))
    return FamilySamples(family, tuple(parameters), nominal, nodes, {tuple(row.tolist()): {}})


def nominal_row(parameters: Sequence[Parameter]) -> np.ndarray:
    return np.array([parameter.nominal for parameter in parameters])


def sample(known: FamilySamples, row: np.ndarray) -> Leaves:
    """The leaves of the case at (d,) values that differ from the nominal ones.

    They are kept, so that a point is made once. InputError where the case has another structure
    than the nominal one, with its place.
    """
    key = tuple(row.tolist())
    if key not in known.found:
        values = boxes.named(known.parameters, row)
        found: Leaves = {}
        try:
            cases.collect(known.nominal, cases.with_float_times(known.family(values)), (), found)
        except cases.Change as change:
            moved = [p for p in known.parameters if values[p.name] != p.nominal]
            where = "parameter " + ", ".join(f"'{p.name}' = {values[p.name]:g}" for p in moved)
            raise InputError(
                say(
                    where,
                    "a case with other numbers, but of the same structure",
                    f"another {change}",
                    HARD,
                )
            ) from None
        known.found[key] = found
    return known.found[key]


def stack(known: FamilySamples, place: Place, rows: np.ndarray) -> tuple[Leaf, np.ndarray]:
    """The nominal leaf, of the pattern of all samples, and the leaf's numbers (k, n) at values (k,
    d).

    d parameters; sparse arrays are spread over one pattern, which has every place that any of the k
    cases or the nominal one fills.
    """
    base: Leaf = cases.leaf_at(known.nominal, place)
    leaves = [sample(known, row).get(place, base) for row in rows]
    if isinstance(base, csr_array) and not all(cases.same_pattern(base, leaf) for leaf in leaves):
        keys = [
            csr_array((np.ones(leaf.nnz), leaf.indices, leaf.indptr), shape=leaf.shape)
            for leaf in (base, *leaves)
        ]
        pattern = csr_array(sum(keys[1:], keys[0]))
        pattern.sum_duplicates()
        leaves = [cases.spread_over(leaf, pattern) for leaf in leaves]
        base = cases.spread_over(base, pattern)
    return base, np.stack([cases.numbers_of(leaf, base) for leaf in leaves])


def sizes_of(known: FamilySamples, place: Place, base: Leaf, values: np.ndarray) -> np.ndarray:
    """The size (k, n) to which round-off is relative: the largest magnitude in the row of a number,
    more where it is noisy.

    The offset of an affine map is in the row of its matrix, whose numbers, or 1, multiply
    coordinates of the size of the system.
    """
    owner = cases.leaf_at(known.nominal, place[:-1])
    rows = rows_in(base)
    if isinstance(owner, Affine) and place[-1] == OFFSET:
        rows = values.shape[1]
        least = known.nominal.system.scale * max(
            1.0, float(abs(owner.matrix).max()) if min(owner.matrix.shape) else 0.0
        )
        size = np.maximum(np.abs(values), least)
    else:
        size = by_row(rows, values)
    if place in known.noise:
        size = np.maximum(size, known.noise[place] / ROUND)
    return np.repeat(size, values.shape[1] // max(rows, 1), axis=1)


def rows_in(base: Leaf) -> int:
    """Number of rows of a leaf, in the order of its memory; vectors and sparse arrays are one row."""
    return (
        (base.T if cases.by_columns(base) else base).shape[0]
        if isinstance(base, np.ndarray) and base.ndim > 1
        else 1
    )


def by_row(rows: int, values: np.ndarray) -> np.ndarray:
    """The largest magnitude (k, j) in every row of numbers (k, n)."""
    return np.asarray(np.abs(values).reshape(len(values), rows, -1).max(axis=2, initial=0.0))


def measure_noise(known: FamilySamples, points: np.ndarray) -> FamilySamples:
    """The samples anew, with the noise that is measured at points (k, d) and with one set of
    constraint terms for all cases.

    The rows of every leaf have a noise each, 8 times the largest change that a few units of
    round-off of the parameters make.
    """
    keys = unite_keys(
        [
            known.family(boxes.named(known.parameters, row))
            for row in (nominal_row(known.parameters), *points)
        ]
    )
    whole = sample_nominal(
        lambda values: pad(known.family(values), keys), known.parameters, known.nodes
    )
    width = np.array([parameter.high - parameter.low for parameter in known.parameters])
    found: dict[Place, np.ndarray] = {}
    for point in points:
        near = [
            point + count * np.finfo(float).eps * np.maximum(width, np.abs(point))
            for count in NEIGHBOURS
        ]
        for place in dict.fromkeys(place for row in (point, *near) for place in sample(whole, row)):
            base, values = stack(whole, place, np.stack([point, *near]))
            apart = by_row(rows_in(base), values[1:] - values[0]).max(axis=0)
            limit = NOISY * max(float(np.abs(values).max(initial=0.0)), whole.nominal.system.scale)
            apart = np.where(apart <= limit, SURE * apart, 0.0)
            found[place] = np.maximum(found.get(place, 0.0), apart)
    return replace(whole, noise=found)


# ------------------------------------------------------------------------------------------------------------- constraint terms
def keys_of(terms: Constraints) -> list[Key]:
    """What tells the terms apart, in their order."""
    seen: dict[tuple[int, int, int, int], int] = {}
    found = []
    for one in zip(
        *(part.tolist() for part in (terms.row, terms.signal, terms.i, terms.j)), strict=True
    ):
        seen[one] = seen.get(one, -1) + 1
        found.append((*one, seen[one]))
    return found


def unite_keys(found: Sequence[Case]) -> list[Key]:
    """The terms of all cases by rows; those that the first case has not come first."""
    first, *others = (keys_of(case.system.constraints) for case in found)
    more = dict.fromkeys(key for keys in others for key in keys if key not in set(first))
    return sorted([*more, *first], key=lambda key: key[0])


def pad(case: Case, keys: Sequence[Key]) -> Case:
    """The case with terms of coefficient zero where it has none; unchanged where it has all, or
    others.
    """
    terms = case.system.constraints
    mine = keys_of(terms)
    if mine == list(keys) or not set(mine) <= set(keys):
        return case
    known = dict(zip(mine, terms.coefficient.tolist(), strict=True))
    row, signal, i, j, _ = np.array(keys, dtype=np.int64).T
    whole = replace(
        terms,
        row=row,
        signal=signal,
        i=i,
        j=j,
        coefficient=np.array([known.get(key, 0.0) for key in keys]),
    )
    return replace(case, system=replace(case.system, constraints=whole))
