r"""Errors of the outputs that a user reads: of every column its largest error, in its unit and as a part of its range.

    error_c = max_t |y_c - r_c|,     range_c = max_t r_c - min_t r_c,     relative_c = error_c / max(range_c, STILL range_o)
    e = max_c relative_c,    or    e = max_c error_c / tolerance_o    over the outputs o that have tolerances

r_c is a column of the reference, y_c that of another motion at the same times, range_o the largest range of the columns of one
output and unit: a column that hardly moves beside the others of its vector counts relative to them, and energies, the balance
among them, count relative to the largest. A column whose output stands
still has no relative error, one that a model does not know (a reaction whose constraint it has dropped) no error at all: NaN.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from ..core.notices import Notice
from ..core.records import dataclass
from ..dynamics.outputs import outputs as histories
from ..dynamics.trajectory import Trajectory
from ..systems import probes
from ..systems.system import Output
from .errors import common_times

STILL = 1e-2  #: least part of the range of its output that a column counts with
ROUND = 1e-12  #: range, over the largest number, of an output that stands still


@dataclass(frozen=True)
class OutputError:
    """The error of one column."""

    output: str
    unit: str
    error: float  #: largest over time [unit]; NaN where a model does not know the column
    range: float  #: of the reference [unit]
    relative: float  #: error over the range that counts; NaN where the output stands still


def compare(reference: Trajectory, other: Trajectory, known: Mapping[str, np.ndarray] | None = None) -> dict[str, OutputError]:
    """Errors of the outputs of `other` against `reference` by column, at the times that both have stored.

    `known` are the columns (s,) of the reference, where they are at hand.
    """
    i, j = common_times("output_errors.compare", reference.times, other.times)
    mine, others = columns(reference) if known is None else known, columns(other)
    mine, others = ({name: values[k] for name, values in found.items()} for found, k in ((mine, i), (others, j)))
    return between(mine, others, reference.system.outputs)


def columns(motion: Trajectory) -> dict[str, np.ndarray]:
    """All outputs of a motion by column, (s,) each; NaN, without a notice, where it does not know one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        return histories(motion)


def between(
    reference: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray], outputs: Mapping[str, Output]
) -> dict[str, OutputError]:
    """Errors of columns (s,) at common times, of those that both have."""
    found: dict[str, OutputError] = {}
    for name, output in outputs.items():
        mine = [
            (column, unit) for column, unit in zip(output.columns, probes.units(name, output), strict=True) if column in reference
        ]
        for column, unit in mine:
            if column in other:
                group = [reference[sister] for sister, same in mine if same == unit]
                least = 1.0 if probes.kind_of(output).on_largest else STILL
                found[column] = single(name, unit, reference[column], other[column], group, least)
    return found


def single(
    output: str, unit: str, reference: np.ndarray, other: np.ndarray, group: Sequence[np.ndarray], least: float = STILL
) -> OutputError:
    """The error of one column; `group` are the columns of its output and unit, of whose range it counts with the `least` part."""
    error, span = float(np.abs(other - reference).max()), float(np.ptp(reference))
    widest, size = max(float(np.ptp(values)) for values in group), max(float(np.abs(values).max()) for values in group)
    scale = max(span, least * widest)
    return OutputError(output, unit, error, span, error / scale if scale > ROUND * size else math.nan)


def measure(found: Mapping[str, OutputError], tolerances: Mapping[str, float] | None = None) -> float:
    """e: the largest relative error; with tolerances [unit of the output] the largest error over its own; NaN without any."""
    known = parts(found, tolerances)
    return float(np.max(list(known.values()))) if known else math.nan


def parts(found: Mapping[str, OutputError], tolerances: Mapping[str, float] | None = None) -> dict[str, float]:
    """What `measure` is the largest of, by column; those that have none are left out."""
    if tolerances:
        return {column: one.error / tolerances[one.output] for column, one in found.items() if one.output in tolerances}
    return {column: one.relative for column, one in found.items() if not math.isnan(one.relative)}
