r"""Which constraint rows a reduced model keeps: those that are independent in its space, but for
those that lock it.

    rank [G_1 V, G_2 V, ...]  over states of the training      a row that is one combination of others in all of them follows there
    e(with a row) > LOCKS e(without it)                        a row that locks: e is the error of the reduced motion

A row of a joint or of a frame inside one component, which neither time nor events drive, holds in
every snapshot. As an equation of few modes it may still forbid them what the motion needs: that the
axes of a rim stay orthonormal is the stiffness of its plate, and forbids modes whose strain is
smaller than what the basis misses. No number of the row tells the two apart: rows that are closed
by a fiftieth of the distance of the basis lock the crank-slider of example 3 (error 9e-3 with, 4e-4
without them at eps = 1e-8), others that need nine times that distance guide a bead on its wire
(8e-5 with, 1e-2 without at 1e-12). So the reduced model is run over its own training with and
without all such rows, which settles nearly all models, and only where it errs much less without
them once more with each. Rows between components, of drives and of rigid bodies are always kept.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from ...core.errors import SolverError
from ...core.notices import Notice, notify
from ...core.storage.records import dataclass
from ...systems import compiled
from ...systems.compiled import compile_system
from ...systems.connections import redundancy
from ...systems.connections.mechanism import FRAME
from ...systems.system import System, driven_rows, is_linear, loose_rows
from . import pivots
from .component import projected

Names: TypeAlias = frozenset[tuple[str, str]]
#: of the reduced motion without some rows; infinite where it has none
Error: TypeAlias = Callable[[Names], float]

NONE: Names = frozenset()
FEW = 8  #: states, at least, at which dependent rows are looked for
# rows between components are never left out: without that of a weld a beam came off its hub, with
# an error of 3.8 times its range, 1.4e-6 with it
SEEN = 1e-6  #: part of a row in a component, of that in another one, that is round-off
LOCKS = 2.0  #: error with a row over that without it, from which it locks; those of rows that lock are 3 to 100 000 times larger
FAR = 1e3  #: error over what the basis misses, from which single rows are tried; of motions that nothing locks it is 1 to 300
MANY = 24  #: rows up to which each is tried by itself


@dataclass(frozen=True)
class RowSamples:
    """Constraint rows of a reduced system at states of the full one, each over its length there:
    their units do not matter.

    s states, m rows and n reduced unknowns; `jacobians` are rows G V of the joints in the reduced
    space.
    """

    jacobians: np.ndarray  #: (s, m, n) [1/m]
    gaps: np.ndarray  #: (s, m) in the units of the rows
    loose: np.ndarray  #: (m,) bool, of joints that events release or lock: always kept
    may_go: np.ndarray  #: (m,) bool, of joints and frames inside a component, which nothing drives


@dataclass(frozen=True)
class KeptRows:
    """The rows of a reduced model, and why others of the full one are not among them.

    A row is known as (joint, label). `left_out` says of rows that follow from others how far they
    open, and of rows that lock what they cost.
    """

    rows: Names
    #: `joint.row` -> what leaving it out does; without linear rows inside components, which hold
    left_out: Mapping[str, str]


def sample_rows(
    system: System, reduced: System, q: np.ndarray, times: np.ndarray | None = None
) -> RowSamples:
    """Constraint rows at the projections of states q (s, q) of the full system.

        x = argmin |V x + qbar - q|

    at each of `times` (s,) [s], 0 by default; rows are divided by their lengths in the full system.
    """
    x = projected(reduced, q)
    model = compile_system(reduced)
    terms = reduced.constraints
    found = [
        compiled.gap(model, state, float(t))
        for state, t in zip(x, np.zeros(len(q)) if times is None else times, strict=True)
    ]
    jacobians = (
        np.array([jacobian for _, jacobian in found]) / row_lengths(system, reduced)[:, None]
    )
    largest = np.array(
        [
            np.abs(jacobians[:, :, first:last]).max(axis=(0, 2), initial=0.0)
            for _, first, last in reduced.components
        ]
    )
    linking = (largest > SEEN * largest.max(axis=0, initial=0.0)).sum(axis=0) > 1
    loose = loose_rows(terms)
    fixed = (
        is_linear(terms) | driven_rows(terms) | loose | linking | of_rigid_bodies(system, reduced)
    )
    return RowSamples(jacobians, np.array([gap for gap, _ in found]), loose, ~fixed)


def row_lengths(system: System, reduced: System) -> np.ndarray:
    """Lengths (m,) in the full system of the constraint rows that a reduced one has, in the unit of
    their gaps.

    Rows are found by their names (joint, label).
    """
    known = dict(zip(system.constraints.names, redundancy.row_lengths(system), strict=True))
    return np.array([known[name] for name in reduced.constraints.names])


def of_rigid_bodies(system: System, reduced: System) -> np.ndarray:
    """Rows (m,) bool that keep the axes of rigid bodies orthonormal; every basis has all directions
    of those.
    """
    deforming = {elastic.name for elastic in system.elastic}
    rigid = {name for name, _, _ in system.coordinates} - deforming
    return np.array(
        [
            is_frame(name) and name[0].partition(".")[0] in rigid
            for name in reduced.constraints.names
        ],
        dtype=bool,
    )


def is_frame(name: tuple[str, str]) -> bool:
    """Whether a row keeps the axes of a frame orthonormal."""
    return FRAME.fullmatch(name[1]) is not None


def independent_rows(samples: Sequence[RowSamples]) -> np.ndarray:
    """Numbers (k,) of the constraint rows that are independent in the reduced space, at the states
    of all samples.

    A row follows where one and the same combination of others gives it in all states. Rows that
    events release or lock always stay.
    """
    jacobians = np.concatenate([sample.jacobians for sample in samples])
    loose = samples[0].loose
    ahead = ~samples[0].may_go
    lasting, always = np.flatnonzero(~loose), np.flatnonzero(loose)
    kept = pivots.independent_rows(list(jacobians[:, lasting]), first=ahead[lasting])
    return np.union1d(lasting[kept], always)


def choose(
    names: Sequence[tuple[str, str]],
    samples: Sequence[RowSamples],
    error: Error,
    missed: Callable[[], float],
) -> KeptRows:
    """The rows to keep of a reduced system with rows of these names.

    `error` is that of its motion without some of them, `missed` gives the part of the motion that
    its basis misses.
    """
    independent = {names[k] for k in independent_rows(samples)}
    largest = np.abs(np.concatenate([sample.gaps for sample in samples])).max(axis=0, initial=0.0)
    told = {
        ".".join(
            name
        ): f"follows from other equations, open by {size:.1e} at most in states of the training"
        for name, size in zip(names, largest, strict=True)
        if name not in independent
    }
    strength = np.linalg.norm(
        np.concatenate([sample.jacobians for sample in samples]), axis=2
    ).mean(axis=0)
    doubtful = [
        names[k]
        for k in np.argsort(-strength, kind="stable")
        if samples[0].may_go[k] and names[k] in independent
    ]
    left, with_all, least = find_locking(doubtful, error, missed) if doubtful else (NONE, 0.0, 0.0)
    why = f"locks the motion: with all such rows it errs by {with_all:.1e} of the largest displacement, as it is by {least:.1e}"
    told |= {".".join(name): why for name in sorted(left)}
    if joints := sorted(".".join(name) for name in left if not is_frame(name)):
        cost = f"its modes cannot follow them (error {with_all:.1e} of the largest displacement with them, {least:.1e} without)"
        notify(
            f"the reduced model leaves out {', '.join(joints)}: {cost}; take more modes (a smaller eps) where they matter"
        )
    return KeptRows(frozenset(independent - left), told)


def find_locking(
    rows: Sequence[tuple[str, str]], error: Error, missed: Callable[[], float]
) -> tuple[Names, float, float]:
    """Which of some rows, the strongest first, lock the motion together, and its error with all of
    them and without these.
    """
    frames = frozenset(filter(is_frame, rows))
    with_all = now = error(NONE)
    out = NONE
    for some in dict.fromkeys((frames, frozenset(rows))):
        if some and (found := error(some)) < min(now, with_all / LOCKS):
            out, now = some, found
    if len(rows) <= MANY and (out or with_all > FAR * missed()):
        out, now = refine(rows, out, now, error)
    return (out, with_all, now) if with_all > LOCKS * now else (NONE, with_all, with_all)


def refine(
    rows: Sequence[tuple[str, str]], out: Names, now: float, error: Error
) -> tuple[Names, float]:
    """The rows left out, and the error without them: joint by joint what makes it smaller, then
    those back that do not lock.
    """
    for joint in dict.fromkeys(joint for joint, _ in rows):
        mine = out | {row for row in rows if row[0] == joint}
        if mine != out and (found := error(mine)) < now:
            out, now = mine, found
    least = now
    for row in rows:
        # frames are held by the stiffness of their rims as well
        limit = least if is_frame(row) else LOCKS * least
        if row in out and len(out) > 1 and (found := error(out - {row})) <= limit:
            out = out - {row}
            now = found
            least = min(least, found)
    return out, now


def try_rows(run: Callable[[Names], float]) -> Error:
    """The error of runs that are made to choose rows: none of their notices is one of the model,
    and a run may fail.

    Infinite where the run ends with a SolverError.
    """

    def error(out: Names) -> float:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Notice)
            try:
                return run(out)
            except SolverError:
                return math.inf

    return error
