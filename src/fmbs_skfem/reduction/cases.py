"""Cases: a system with the way it is integrated; families: cases as functions of parameters; the
numbers of a case, its leaves.

A case is a struct of structs, tuples and dicts. Its leaves are arrays, sparse arrays and
floating-point numbers; every leaf has a place, the fields, keys and positions on the way to it. Two
cases of one structure differ in leaves only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, fields, is_dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import csr_array

from ..core.algebra.linalg import is_sparse
from ..core.errors import InputError, say
from ..core.notices import Progress, notify
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.expressions import Expression
from ..dynamics.checkpoint import Record, Resumed
from ..dynamics.integration import integrate
from ..dynamics.scheme import GeneralizedAlpha, Newton
from ..dynamics.trajectory import Trajectory
from ..systems import finer_systems
from ..systems.system import System
from ..systems.terms import quartic

#: fields that are no leaves
APART: dict[type, tuple[str, ...]] = {
    Expression: ("text",),
    System: ("metric", "weight", "scale"),
}
STEPS = 10_000_000  #: most steps of a run, as of the analysis of a scene
ROUND = 1e-9  #: relative difference of times that is round-off
Place: TypeAlias = tuple[str | int, ...]
Leaf: TypeAlias = float | np.ndarray | csr_array
Leaves: TypeAlias = dict[Place, Leaf]  #: leaves that differ from those of another case


@storable
@dataclass(frozen=True)
@checked
class Case:
    """One member of a family.

    All that `run` needs: the equations, the method with its step [s], the end [s] and the tolerance
    of the iteration.
    """

    system: System  #: full, with all multipliers, or reduced
    scheme: GeneralizedAlpha
    duration: float  #: [s]
    newton: Newton = field(default_factory=Newton)


#: the case of a value for every parameter
Family: TypeAlias = Callable[[Mapping[str, float]], Case]


def run(
    case: Case,
    every: int | np.ndarray = 1,
    progress: Progress | None = None,
    record: Record | None = None,
    resume: Resumed | None = None,
) -> Trajectory:
    """The motion of a case; arguments and errors are those of `dynamics.integrate`.

    `every` says which steps are stored: each so many, or their numbers (s,). SolverError where the
    motion fails carries the part found so far.
    """
    return integrate(
        case.system, case.scheme, case.duration, case.newton, every, progress, record, resume
    )


def with_step(case: Case, step: float) -> Case:
    """The case with another step [s].

    All else stays, the start as well.
    """
    return replace(case, scheme=replace(case.scheme, step=step))


def unchecked(case: Case) -> Case:
    """The case for one more run, which finds no errors of parts: another run of it has found them.

    Errors of parts (`parts.finer_parts`) take a second run of a finer system, which is left out
    then.
    """
    return replace(case, system=finer_systems.unchecked(case.system))


def at_times(
    trained: Case,
    duration: float | None,
    step: float | None,
    where: str,
    beyond: Sequence[str] = (),
) -> tuple[Case, list[str]]:
    """A trained case with another duration or step [s], None for its own, and in words where it
    leaves the training.

    A basis holds the states of the full runs that it was made of. What a reduced model does beyond
    them may look as sound as before, and be far from the full model; its predicted error is that of
    the training.

    A shorter run does not. A notice lists these places behind those in `beyond`, which are known
    already.
    """
    step = trained.scheme.step if step is None else step
    duration = trained.duration if duration is None else duration
    if not 0 < step <= duration <= STEPS * step:
        raise InputError(
            say(
                where,
                f"a positive step, and a duration of 1 to {STEPS} of them",
                f"{step} s and {duration} s",
            )
        )
    found = [*beyond]
    if duration > trained.duration * (1.0 + ROUND):
        found.append(f"runs for {duration:g} s, trained for {trained.duration:g} s")
    if abs(step - trained.scheme.step) > ROUND * trained.scheme.step:
        found.append(f"a step of {step:g} s, trained with {trained.scheme.step:g} s")
    if found:
        notify(
            f"the reduced model runs outside its training: {'; '.join(found)}; check its error against a full run"
        )
    if (duration, step) == (trained.duration, trained.scheme.step):
        return trained, found
    return with_step(replace(trained, duration=duration), step), found


class Change(Exception):
    """Two cases differ by more than numbers.

    Its text is the place where they do, `system.elastic[0].gather.section`.
    """


def with_float_times(case: Case) -> Case:
    """The case with its times as floating-point numbers.

    Duration and step alone, so that a case with `duration=1` differs from another in numbers only.
    """
    return replace(
        case,
        duration=float(case.duration),
        scheme=replace(case.scheme, step=float(case.scheme.step)),
    )


def collect(base: Any, other: Any, place: Place, found: Leaves) -> None:
    """Add the leaves of `other` that differ from those of `base`; raise Change where there is more
    than numbers.

    Leaves are arrays, sparse arrays and floating-point numbers, by their place; they are added to
    `found`. Arrays of another shape or type, other texts and integers are more than numbers.
    """
    if base is other:
        return
    if (
        is_number(base)
        and is_number(other)
        and (isinstance(base, float) or isinstance(other, float))
    ):
        if base != other:
            found[place] = float(other)
    elif type(base) is not type(other):
        raise Change(label(place))
    elif isinstance(base, np.ndarray | csr_array):
        collect_array(base, other, place, found)
    elif is_dataclass(base) or isinstance(base, dict | list | tuple):
        one, two = dict(items(base)), dict(items(other))
        if list(one) != list(two):
            raise Change(label(place))
        for key, value in one.items():
            collect(value, two[key], (*place, key), found)
    elif base != other:
        raise Change(label(place))


def collect_array(base: Any, other: Any, place: Place, found: Leaves) -> None:
    if base.shape != other.shape or base.dtype != other.dtype:
        raise Change(label(place))
    if is_sparse(base):
        if not (
            same_pattern(base, other) and np.array_equal(base.data, other.data, equal_nan=True)
        ):
            found[place] = other
    elif base.dtype.kind != "f":
        if not np.array_equal(base, other):
            raise Change(label(place))
    elif not np.array_equal(base, other, equal_nan=True):
        found[place] = other


def is_number(value: Any) -> bool:
    return type(value) in (float, int) or isinstance(value, np.floating)


def items(value: Any) -> Iterator[tuple[str | int, Any]]:
    """Parts of a struct by field, key or position.

    The text of an expression is only what its program is called; the lengths of a system are no
    numbers of its motion.
    """
    if is_dataclass(value):
        apart = APART.get(type(value), ())
        yield from (
            (part.name, getattr(value, part.name))
            for part in fields(value)
            if part.name not in apart
        )
    elif isinstance(value, dict):
        yield from value.items()
    else:
        yield from enumerate(value)


def label(place: Place) -> str:
    """A place as a text, `system.elastic[0].gather.section`."""
    return (
        "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place).lstrip(".")
        or "case"
    )


def leaf_at(value: Any, place: Place) -> Any:
    for key in place:
        value = getattr(value, str(key)) if is_dataclass(value) else value[key]
    return value


def insert(tree: dict[str | int, Any], place: Place, leaf: Leaf) -> None:
    """Add a leaf to nested dicts of changes.

    `tree` is changed in place.
    """
    for key in place[:-1]:
        tree = tree.setdefault(key, {})
    tree[place[-1]] = leaf


def rebuild(value: Any, tree: Any) -> Any:
    """The struct with some leaves changed; all other parts are the same objects.

    `tree` are nested dicts of new leaves, by field, key or position, as `insert` makes them.
    """
    if not isinstance(tree, dict):
        return tree
    if is_dataclass(value) and not isinstance(value, type):
        return replace(
            value,
            **{str(key): rebuild(getattr(value, str(key)), part) for key, part in tree.items()},
        )
    if isinstance(value, dict):
        return {
            key: rebuild(part, tree.get(key, part)) if key in tree else part
            for key, part in value.items()
        }
    return type(value)(
        rebuild(part, tree[key]) if key in tree else part for key, part in enumerate(value)
    )


def same_pattern(a: csr_array, b: csr_array) -> bool:
    return np.array_equal(a.indptr, b.indptr) and np.array_equal(a.indices, b.indices)


def spread_over(matrix: csr_array, pattern: csr_array) -> csr_array:
    """The same matrix with a number, zero perhaps, for every place of a sorted pattern that
    contains its own.

    Both (m, n); the new one has the pattern of the second, and the values of the first.
    """
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    width = matrix.shape[1]
    keys = np.repeat(np.arange(matrix.shape[0]), np.diff(pattern.indptr)) * width + pattern.indices
    data = np.zeros(len(keys))
    np.add.at(data, np.searchsorted(keys, rows * width + matrix.indices), matrix.data)
    return csr_array((data, pattern.indices, pattern.indptr), shape=matrix.shape)


def numbers_of(leaf: Leaf, base: Leaf) -> np.ndarray:
    """All numbers of a leaf (n,), in the memory order of `base`.

    Of a sparse array those that it stores. Arrays that are stored by columns are listed by columns.
    """
    if isinstance(leaf, np.ndarray) and isinstance(base, np.ndarray):
        return leaf.T.ravel() if by_columns(base) else leaf.ravel()
    return np.array([leaf], dtype=float) if isinstance(leaf, float) else np.asarray(leaf.data)


def by_columns(array: np.ndarray) -> bool:
    return array.ndim > 1 and array.flags.f_contiguous and not array.flags.c_contiguous


def fill(leaf: Leaf, positions: np.ndarray, numbers: np.ndarray) -> Leaf:
    """The leaf with other numbers at some positions; vectors start at a whole cache line, where
    polynomials are read fastest.

    `positions` (k,) count numbers as `numbers_of` lists them, `numbers` (k,) take their places. A
    float is replaced.
    """
    if isinstance(leaf, float):
        return float(numbers[0])
    if isinstance(leaf, csr_array):
        return csr_array(
            (fill(leaf.data, positions, numbers), leaf.indices, leaf.indptr), shape=leaf.shape
        )
    out = (
        quartic.aligned(len(leaf))
        if leaf.ndim == 1 and leaf.dtype == np.float64
        else np.empty_like(leaf, order="K")
    )
    out[...] = leaf
    (out.T if by_columns(out) else out).reshape(-1)[positions] = numbers
    return out
