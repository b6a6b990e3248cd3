r"""Errors of the outputs that a user reads: of every column its largest error, in its unit and as a
part of its range.

    error_c = max_t |y_c - r_c|,     range_c = max_t r_c - min_t r_c,     relative_c = error_c / max(range_c, STILL range_o)
    e = max_c relative_c,    or    e = max_c error_c / tolerance_o    over the outputs o that have tolerances

r_c is a column of the reference, y_c that of another motion at the same times, range_o the largest
range of the columns of one output and unit: a column that hardly moves beside the others of its
vector counts relative to them, and energies, the balance among them, count relative to the largest,
and what is zero up to round-off relative to other outputs of its unit. A column whose output stands
still has no relative error where nothing of its unit moves, one that a model does not know (a
reaction whose constraint it has dropped) no error at all: NaN.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...core.notices import notify
from ...dynamics.output_errors import (
    OutputError,
    between,
    columns,
    common_times,
    from_first_step,
    largest,
    round_off,
    stopped,
    with_ends,
)
from ...dynamics.trajectory import Trajectory

__all__ = [
    "OutputError",
    "between",
    "columns",
    "compare",
    "from_first_step",
    "measure",
    "parts",
    "round_off",
    "stopped",
    "warn_of_wrong",
    "with_ends",
]

OFF = 0.1  #: error of an output over its range, above which a warning is shown: reactions err by ten times what positions do
# a bar that swings by 0.8 m while it turns by 0.01 rad about itself: its motion errs by 1e-4, its
# turn by up to 0.1 of its range
MOVED = 0.02  #: the same of positions and angles: a small one may be lost in a model whose motion as a whole is good
MOTIONS = ("m", "rad")  #: their units


def compare(
    reference: Trajectory, other: Trajectory, known: Mapping[str, np.ndarray] | None = None
) -> dict[str, OutputError]:
    """Errors of the outputs of `other` against `reference` by column, at the times that both have
    stored, and at their ends where an event makes them.

    `known` are the columns (s,) of the reference, where they are at hand.
    """
    pairs = common_times("output_errors.compare", reference.times, other.times)
    if stopped(reference) and stopped(other):
        pairs = with_ends(pairs, reference.times, other.times)
    i, j = pairs
    mine = columns(reference) if known is None else known
    others = columns(other)
    mine, others = (
        {name: values[k] for name, values in found.items()} for found, k in ((mine, i), (others, j))
    )
    nothing = round_off(reference.system, reference.times)
    begin = reference.times[i[0]] == 0.0
    theirs = from_first_step(reference, mine, others) if begin else others
    return between(mine, theirs, reference.system.outputs, nothing=nothing)


def warn_of_wrong(relative: Mapping[str, float], units: Mapping[str, str]) -> None:
    """A warning of columns that a reduced model gives wrong over its own training, by more than a
    part of their range.

    `relative` are errors over the ranges, by column, `units` theirs as far as they are known. The
    part is 0.02 of positions and angles, 0.1 of all else.
    """
    if off := {
        name: error
        for name, error in relative.items()
        if error > (MOVED if units.get(name) in MOTIONS else OFF)
    }:
        text = f"the reduced model gives outputs wrong over its own training: {largest(off)} of the range"
        notify(f"{text}; take a smaller eps, or leave them to the full model")


def measure(
    found: Mapping[str, OutputError], tolerances: Mapping[str, float] | None = None
) -> float:
    """e: the largest relative error; with tolerances [unit of the output] the largest error over
    its own; NaN without any.

        max_c relative_c    or    max_c error_c / tolerance_o

    over the columns of outputs that have a tolerance.
    """
    known = parts(found, tolerances)
    return float(np.max(list(known.values()))) if known else math.nan


def parts(
    found: Mapping[str, OutputError], tolerances: Mapping[str, float] | None = None
) -> dict[str, float]:
    """What `measure` is the largest of, by column; those that have none are left out.

    Without tolerances relative errors that are NaN are left out; with them columns of outputs that
    have none.
    """
    if tolerances:
        return {
            column: one.error / tolerances[one.output]
            for column, one in found.items()
            if one.output in tolerances
        }
    return {column: one.relative for column, one in found.items() if not math.isnan(one.relative)}
