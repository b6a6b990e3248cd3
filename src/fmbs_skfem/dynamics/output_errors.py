r"""Errors of outputs, column by column, over the ranges that count.

e = max_t |y(t) - y_ref(t)| / range,    range = max(range of the column, `still` times the largest one of its output and unit)
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from ..core.errors import InputError, say
from ..core.notices import Notice
from ..core.records import dataclass
from ..systems import probes
from ..systems.system import Output
from .outputs import outputs as histories
from .trajectory import Trajectory

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


def common_times(where: str, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices (s,) in both of the times a and b [s] that two trajectories share; InputError where these are fewer than two."""
    slack = 1e-9 * float(b[-1])
    near = np.clip(np.searchsorted(b, a - slack), 0, len(b) - 1)
    same = np.abs(b[near] - a) <= slack
    if same.sum() < 2:
        raise InputError(say(where, "two trajectories with common times", f"{same.sum()} common times"))
    return np.flatnonzero(same), near[same]


def columns(motion: Trajectory) -> dict[str, np.ndarray]:
    """All outputs of a motion by column, (s,) each; NaN, without a notice, where it does not know one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        return histories(motion)


def between(
    reference: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray], outputs: Mapping[str, Output], still: float = STILL
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
                least = 1.0 if probes.kind_of(output).on_largest else still
                found[column] = single(name, unit, reference[column], other[column], group, least)
    return found


def single(
    output: str, unit: str, reference: np.ndarray, other: np.ndarray, group: Sequence[np.ndarray], least: float
) -> OutputError:
    """The error of one column; `group` are the columns of its output and unit, of whose range it counts with the `least` part."""
    error, span = float(np.abs(other - reference).max()), float(np.ptp(reference))
    widest, size = max(float(np.ptp(values)) for values in group), max(float(np.abs(values).max()) for values in group)
    scale = max(span, least * widest)
    return OutputError(output, unit, error, span, error / scale if scale > ROUND * size else math.nan)
