"""Histories of loads and driven joints over time: their values, their names, and the error where one is no number."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import Reason, SolverError
from ..core.linalg import as_dense
from ..core.notices import notify
from ..systems import forces
from ..systems.compiled import signal_table
from ..systems.signals import read_inputs
from ..systems.system import System, driven_rows, driving
from .names import owners

INSIDE = 4  #: instants inside of a step at which histories are looked at
MISSED = 0.05  #: of what a history gives over time, by the ends of steps alone, above which a warning is shown
AT_ONCE = 10_000  #: steps


def signal_names(system: System) -> list[str]:
    """What every signal drives: joints by name, loads by the body that they act on."""
    names: list[list[str]] = [[] for _ in system.signals]
    for row, signal in driving(system.constraints):
        names[signal].append(f"joint {system.constraints.names[row][0]}")
    mine = owners(system)
    probes = csr_array(system.probes.matrix)
    for signal, row in (pushed for force in system.loads.forces for pushed in forces.histories(force)):
        weights = np.abs(as_dense(probes[[row]])[0])
        names[signal].append(f"a load on {mine[int(weights.argmax())]}" if weights.any() else "a load")
    return [", ".join(dict.fromkeys(found)) or f"signal {k}" for k, found in enumerate(names)]


def leading_signals(system: System, times: np.ndarray, step: float) -> tuple[np.ndarray, SolverError | None]:
    """Signals at the ends of steps of length `step` [s] up to the first one where a value is not finite, and the error of it.

    Where constraints read signals their first three derivatives stand beside the values, (s, 4 k).
    """
    table, broken = leading_values(system, times)
    if not driven_rows(system.constraints).any():
        return table, broken
    return np.hstack([table, *derivatives(system, times[: len(table)], table, step)]), broken


def derivatives(system: System, times: np.ndarray, table: np.ndarray, step: float) -> list[np.ndarray]:
    """First three derivatives (s, k) of the cubics through the values at the ends and at two points inside of every step.

    They read the step alone, so that what a history does before and after it is left out; 0 where a value inside is not finite.
    """
    d = step / 3
    a, b, c = (signal_table(system, times - k * d) for k in (1, 2, 3))
    with np.errstate(invalid="ignore", over="ignore"):
        first = (11 * table - 18 * a + 9 * b - 2 * c) / (6 * d)
        second = (2 * table - 5 * a + 4 * b - c) / d**2
        third = (table - 3 * a + 3 * b - c) / d**3
    return [np.where(np.isfinite(part), part, 0.0) for part in (first, second, third)]


def leading_values(system: System, times: np.ndarray) -> tuple[np.ndarray, SolverError | None]:
    """Values of all signals (s, k) at the given times up to the first one where one is not finite, and the error of it."""
    table = signal_table(system, times)
    bad = np.argwhere(~np.isfinite(table))
    if len(bad) == 0:
        return table, None
    s, time = int(bad[0, 0]), float(times[bad[0, 0]])
    broken = {name: float(value) for name, value in zip(signal_names(system), table[s], strict=True) if not np.isfinite(value)}
    listed = ", ".join(f"{name} is {value}" for name, value in broken.items())
    text = f"the history of {listed} at t = {time:.6g} s; guard it with where(...)"
    return table[:s], SolverError(text, Reason.NOT_FINITE, time, tuple(broken.items()))


def finite_signals(system: System, times: np.ndarray) -> np.ndarray:
    """Signals at the given times; a value that is not finite stops the run with its place."""
    table, broken = leading_values(system, times)
    if broken is not None:
        raise broken
    return table


def warn_of_coarse_steps(system: System, step: float, steps: int) -> None:
    """A warning where histories change inside of steps [s], which read them at their ends alone.

    The integral S(t) of a history s, for a load its impulse, is max |S - S_h| / max |S| off where S_h is that of the straight lines
    between the ends of the steps.
    """
    known = [k for k, signal in enumerate(system.signals) if not read_inputs(signal)]
    if not known:
        return
    carried = np.zeros((2, 1, len(known)))
    largest = np.zeros((2, len(known)))  # of S and S_h together, of their difference
    for first in range(0, steps, AT_ONCE):
        number = np.arange(first, min(first + AT_ONCE, steps) + 1)
        inside = step * (number[:-1, None] + (np.arange(INSIDE) + 0.5) / INSIDE)
        with np.errstate(all="ignore"):
            ends, within = (signal_table(system, times.ravel())[:, known] for times in (step * number, inside))
            means = np.stack([within.reshape(*inside.shape, -1).mean(axis=1), 0.5 * (ends[1:] + ends[:-1])])
            sums = carried + np.cumsum(np.where(np.isfinite(means), means, 0.0), axis=1)
        carried = sums[:, -1:]
        found = np.abs(sums).max(axis=(0, 1)), np.abs(sums[1] - sums[0]).max(axis=0)
        largest = np.maximum(largest, found)
    wrong = np.flatnonzero(largest[1] > MISSED * largest[0])
    names = signal_names(system) if len(wrong) else []
    for k in wrong:
        where, share = f"the history of {names[known[k]]}", largest[1, k] / largest[0, k]
        text = f"{where} changes inside of steps of {step:g} s, which give it wrong by up to {share:.0%} over time"
        notify(f"{text}: take a smaller step")
