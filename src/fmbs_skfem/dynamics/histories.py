"""Histories of loads and driven joints over time: their values, their names, and the error where
one is no number.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from scipy.sparse import csr_array

from ..core.algebra.linalg import as_dense
from ..core.errors import Reason, SolverError
from ..systems.compiled import repeatable, signal_table
from ..systems.forces import on_rows as forces
from ..systems.prepared import prepare
from ..systems.signals import BEND, RATE, exact_path, jet
from ..systems.system import System, driven_rows, driving
from .names import owners

Found = TypeVar("Found")
# first derivatives divide round-off by d, second and third ones by d^2 and d^3, which asks for
# longer ways: accelerations of a heavy top differ by 2e-12 at half and 5e-13 at twice of CURVATURE,
# third derivatives by 3e-9 and 5e-10, at 0.01 by 5e-6
#: distance d of the five instants of the differences for first derivatives where motions start, and
#: for second and third ones, in steps
DRIFT, CURVATURE = (
    1e-3,
    0.25,
)
SIDE = 1e-6  #: of a step, beside which derivatives are taken at corners
JERK = np.array([-5.0, 18.0, -24.0, 14.0, -3.0])  #: third, times 2 d^3
# six megabytes with their derivatives; a run of twice as many takes a second, beside which finding
# them is nothing
ROOM = 200_000  #: values of signals in a run, up to which they are found at once, and kept for other runs


def signal_names(system: System) -> list[str]:
    """What every signal drives: joints by name, loads by the body that they act on.

    One text for every signal of the system, in their order; several owners are separated by commas.
    """
    names: list[list[str]] = [[] for _ in system.signals]
    for row, signal in driving(system.constraints):
        names[signal].append(f"joint {system.constraints.names[row][0]}")
    for signal, row in (
        pushed for force in system.loads.forces for pushed in forces.histories(force)
    ):
        names[signal].append(pushed_body(system, row))
    return [", ".join(dict.fromkeys(found)) or f"signal {k}" for k, found in enumerate(names)]


def pushed_body(system: System, row: int) -> str:
    """The load on a probe row, by the body or component that it acts on.

    The body whose unknown has the largest weight in the row; `a load` for a row that reads nothing.
    """
    weights = np.abs(as_dense(csr_array(system.probes.matrix)[[row]])[0])
    return f"a load on {owners(system)[int(weights.argmax())]}" if weights.any() else "a load"


def leading_signals(
    system: System, times: np.ndarray, step: float
) -> tuple[np.ndarray, SolverError | None]:
    """Signals at the ends of steps of length `step` [s] up to the first one where a value is not
    finite, and the error of it.

    Where constraints read signals their first three derivatives stand beside the values, (s, 4 k).
    """
    table, broken = leading_values(system, times)
    if not driven_rows(system.constraints).any():
        return table, broken
    return np.hstack([table, *derivatives(system, times[: len(table)], table, step)]), broken


def signals_at_start(system: System, time: float, step: float) -> np.ndarray:
    """Signals (1, k), or (1, 4 k) as `leading_signals`, where a motion starts or goes on at a time
    [s] by steps [s]; SolverError where a value is not finite.

    Derivatives are those of what comes: a history may bend there. Those of texts and tables are
    exact, so that they know nothing of a corner within the step.
    """
    table = finite_signals(system, np.array([time]))
    if not driven_rows(system.constraints).any():
        return table
    near, far = (d * step for d in (DRIFT, CURVATURE))
    first, later = (signal_table(system, time + d * np.arange(5.0)) for d in (near, far))
    rates = np.stack(
        [RATE @ first / (12 * near), BEND @ later / (12 * far**2), JERK @ later / (2 * far**3)]
    )
    for k, signal in enumerate(system.signals):
        if exact_path(signal) is not None:
            _, v, a = jet(signal, np.array([time, time + near]), SIDE * step)
            rates[:, k] = v[0], a[0], (a[1] - a[0]) / near
    return np.hstack([table, *rates[:, None]])


def signals_of_steps(
    system: System, step: float, steps: int, first: int, many: int
) -> tuple[np.ndarray, SolverError | None]:
    """`leading_signals` at the ends of some of the steps of a run, from the number `first` on.

    `many` steps of length `step` [s] of a run of `steps`; the values (s, k), or (s, 4 k) with
    derivatives, and the error as there.
    """
    # long tables are made as they are needed, or a run would begin with as much memory as it
    # stores; so is what is not remembered
    if steps * len(system.signals) > ROOM or not repeatable(system):
        return leading_signals(system, step * (first + 1 + np.arange(many)), step)
    all_of_them = lambda: leading_signals(system, step * (1 + np.arange(steps)), step)[0]  # noqa: E731
    table = of_histories(system, "steps", step, steps, all_of_them)[first : first + many]
    return table, None if len(table) == many else leading_values(
        system, step * (first + 1 + np.arange(many))
    )[1]


def of_histories(
    system: System, name: str, step: float, steps: int, make: Callable[[], Found]
) -> Found:
    """What follows from the histories of a system in a run, and from nothing else: of data it is
    found once for all its numbers.

    `make` finds it; `name` says what it is. Histories that are functions of Python are asked anew
    each time. Where loads act is no part of it, nor are names: a member of a family may have other
    probes.
    """
    if not repeatable(system):
        return make()
    parts = system.signals, system.constraints, system.loads.forces, step, steps
    return prepare(system).find(name, parts, make)


def derivatives(
    system: System, times: np.ndarray, table: np.ndarray, step: float
) -> list[np.ndarray]:
    """First three derivatives (s, k) of the cubics through the values at the ends and at two points
    inside of every step.

    They read the step alone, so that what a history does before and after it is left out; 0 where a
    value inside is not finite.
    """
    d = step / 3
    # inside the step: a history that bends at its end has two derivatives there, and this step goes
    # by the one before
    a, b, c = (signal_table(system, times - k * d) for k in (1, 2, 3))
    with np.errstate(invalid="ignore", over="ignore"):
        first = (11 * table - 18 * a + 9 * b - 2 * c) / (6 * d)
        second = (2 * table - 5 * a + 4 * b - c) / d**2
        third = (table - 3 * a + 3 * b - c) / d**3
    # a value inside of a step stops no run: steps read histories at their ends
    return [np.where(np.isfinite(part), part, 0.0) for part in (first, second, third)]


def leading_values(system: System, times: np.ndarray) -> tuple[np.ndarray, SolverError | None]:
    """Values of all signals (s, k) at the given times up to the first one where one is not finite,
    and the error of it.

    The error is returned, not raised: None where all values are finite, else it has the reason
    NOT_FINITE, the time [s] and the names.
    """
    table = signal_table(system, times)
    if np.isfinite(table).all():
        return table, None
    bad = np.argwhere(~np.isfinite(table))
    s = int(bad[0, 0])
    time = float(times[bad[0, 0]])
    broken = {
        name: float(value)
        for name, value in zip(signal_names(system), table[s], strict=True)
        if not np.isfinite(value)
    }
    listed = ", ".join(f"{name} is {value}" for name, value in broken.items())
    text = f"the history of {listed} at t = {time:.6g} s; guard it with where(...)"
    return table[:s], SolverError(text, Reason.NOT_FINITE, time, tuple(broken.items()))


def finite_signals(system: System, times: np.ndarray) -> np.ndarray:
    """Signals at the given times; a value that is not finite stops the run with its place.

    Values (s, k) of k signals at times (s,) [s]. SolverError with the reason NOT_FINITE and the
    names of the signals.
    """
    table, broken = leading_values(system, times)
    if broken is not None:
        raise broken
    return table
