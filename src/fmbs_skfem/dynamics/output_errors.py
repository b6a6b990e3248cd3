r"""Errors of outputs, column by column, over the ranges that count.

e = max_t |y(t) - y_ref(t)| / range,    range = max(range of the column, `still` times the largest one of its output and unit)

A column that is zero up to round-off counts with `still` times the largest range of its unit in all
outputs: a force that is 1e-9 N beside one of 10 N is as wrong as what another model gives in its
place is to the 10 N.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from ..core.errors import InputError, say
from ..core.notices import Notice
from ..core.storage.records import dataclass
from ..systems.measures import probes
from ..systems.system import Output, System
from .outputs import outputs as histories
from .trajectory import Trajectory

SHOWN = 3  #: errors that a sentence lists
TOLD = 1e-2  #: error over the range of an output, or of a frequency, from which a warning is shown
STILL = 1e-2  #: least part of the range of its output that a column counts with
ROUND = 1e-12  #: range, over the largest number, of an output that stands still
#: range, over the largest of its unit or what a mechanism of this size and mass does in its time,
#: that is round-off of the motion: 1e-10 of the forces at Newton's usual tolerance, 100 times more
#: where joints fight a stiff body
NOTHING = 1e-8


@dataclass(frozen=True)
class OutputError:
    """The error of one column.

        error = max_t |y - y_ref|,    relative = error / range that counts

    The former is in the unit of the output; see the module.
    """

    output: str
    unit: str
    error: float  #: largest over time [unit]; NaN where a model does not know the column
    range: float  #: of the reference [unit]
    relative: float  #: error over the range that counts; NaN where the output stands still


def common_times(where: str, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices (s,) in both of the times a and b [s] that two trajectories share; InputError where
    these are fewer than two.

    Two times are one where they differ by at most 1e-9 of the last of `b`; a and b (s,) each,
    rising.
    """
    slack = 1e-9 * float(b[-1])
    near = np.clip(np.searchsorted(b, a - slack), 0, len(b) - 1)
    same = np.abs(b[near] - a) <= slack
    if same.sum() < 2:
        raise InputError(
            say(where, "two trajectories with common times", f"{same.sum()} common times")
        )
    return np.flatnonzero(same), near[same]


def with_ends(
    pairs: tuple[np.ndarray, np.ndarray], a: np.ndarray, b: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Indices (s,) of pairs of times a and b [s] of two motions that an event ends, each at its own
    time, with their last states.
    """
    ends = len(a) - 1, len(b) - 1
    if (pairs[0][-1], pairs[1][-1]) == ends:
        return pairs
    return np.append(pairs[0], ends[0]), np.append(pairs[1], ends[1])


def stopped(motion: Trajectory) -> bool:
    """Whether an event has ended a motion."""
    return bool(motion.events and motion.events[-1].stop)


def columns(motion: Trajectory) -> dict[str, np.ndarray]:
    """All outputs of a motion by column, (s,) each; NaN, without a notice, where it does not know
    one.

    A column is one component of an output, in its SI unit.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        return histories(motion)


def from_first_step(
    motion: Trajectory, mine: Mapping[str, np.ndarray], others: Mapping[str, np.ndarray]
) -> Mapping[str, np.ndarray]:
    """Columns of another model (s,), which begin as those of a motion of elastic bodies do.

    At its start accelerations and reactions balance forces that may begin at once: M^-1 f, in waves
    that no step resolves, and that belong to the mesh or the basis alone.
    """
    if not motion.system.elastic or motion.negative is not None:
        return others
    return {
        name: np.append(mine.get(name, values)[:1], values[1:]) for name, values in others.items()
    }


def between(
    reference: Mapping[str, np.ndarray],
    other: Mapping[str, np.ndarray],
    outputs: Mapping[str, Output],
    still: float = STILL,
    nothing: Mapping[str, float] | None = None,
) -> dict[str, OutputError]:
    """Errors of columns (s,) at common times, of those that both have; `nothing` are ranges by unit
    that are round-off.

    `still` is the least part of the largest range of its output that a column counts with; energies
    count with all of it. A column that hardly moves beside others of its unit, or whose range is
    below `nothing`, counts with `still` times the largest range of its unit. The relative error is
    NaN where nothing of that unit moves.
    """
    titles = {
        name: [
            (column, unit)
            for column, unit in zip(one.columns, probes.units(name, one), strict=True)
            if column in reference
        ]
        for name, one in outputs.items()
    }
    widest: dict[str, float] = {}
    for column, unit in (pair for mine in titles.values() for pair in mine):
        widest[unit] = float(np.fmax(widest.get(unit, 0.0), np.ptp(reference[column])))
    found: dict[str, OutputError] = {}
    for name, mine in titles.items():
        kind = probes.kind_of(outputs[name])
        for column, unit in mine:
            if column in other:
                group = [reference[sister] for sister, same in mine if same == unit]
                least = 1.0 if kind.on_largest else still
                zero = max((nothing or {}).get(unit, 0.0), NOTHING * widest[unit])
                theirs = other[column]
                if outputs[name].columns.index(column) in kind.pausing:
                    theirs = np.where(
                        (theirs == 0.0) | (reference[column] == 0.0), reference[column], theirs
                    )
                found[column] = single(
                    name, unit, reference[column], theirs, group, least, zero, still * widest[unit]
                )
    return found


def single(
    output: str,
    unit: str,
    reference: np.ndarray,
    other: np.ndarray,
    group: Sequence[np.ndarray],
    least: float,
    zero: float,
    elsewhere: float,
) -> OutputError:
    """The error of one column; `group` are the columns of its output and unit, of whose range it
    counts with the `least` part.

    Where that is no more than `zero` [unit], it counts with the range `elsewhere` [unit].
    """
    error, span = float(np.abs(other - reference).max()), float(np.ptp(reference))
    widest, size = (
        max(float(np.ptp(values)) for values in group),
        max(float(np.abs(values).max()) for values in group),
    )
    scale = max(span, least * widest)
    if scale <= max(ROUND * size, zero):
        scale = elsewhere if elsewhere > zero else 0.0
    return OutputError(output, unit, error, span, error / scale if scale > 0.0 else math.nan)


def smallest_ranges(system: System, span: float, part: float) -> dict[str, float]:
    """A part of what a mechanism of this size and mass does in a time `span` [s], by the unit.

        L, L/T, L/T^2, 1 rad, 1/T, w L/T^2, w L^2/T^2    times `part`

    with size L [m], mass w [kg] and time T. A span of 0 counts as 1 s.
    """
    s = system.scale
    w = system.weight
    t = span or 1.0
    sizes = {
        "m": s,
        "m/s": s / t,
        "m/s^2": s / t**2,
        "rad": 1.0,
        "rad/s": 1.0 / t,
        "N": w * s / t**2,
    }
    sizes |= {"N m": w * s**2 / t**2, "J": w * s**2 / t**2}
    return {unit: part * size for unit, size in sizes.items()}


def round_off(system: System, times: np.ndarray) -> dict[str, float]:
    """Ranges by unit that are round-off of a motion at times (s,) [s].

    1e-8 of `smallest_ranges` over the span of the times, by unit.
    """
    return smallest_ranges(system, float(np.ptp(times)), NOTHING)


def largest(found: Mapping[str, float]) -> str:
    """The largest errors of some by name, those that are told; nothing where there are none.

    Three at most, with the number of the others; errors up to 1 % are not told.
    """
    order = sorted(
        (name for name, error in found.items() if abs(error) > TOLD),
        key=lambda name: -abs(found[name]),
    )
    listed = ", ".join(f"{name} is off by {percent(found[name])}" for name in order[:SHOWN])
    return listed + (f" (and {len(order) - SHOWN} more)" if len(order) > SHOWN else "")


def percent(error: float) -> str:
    """A part in per cent."""
    return f"{100.0 * error:.2g} %" if abs(error) < 0.995 else f"{100.0 * error:.0f} %"
