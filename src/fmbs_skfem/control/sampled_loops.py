r"""How much of what a controller gives comes back in its next sample: the gain of a sampled loop at
the start of a run.

    (M + T C + T^2 K) dv + Phi_x^T l = T Q_u,   Phi_x dv = 0,   dx = T dv         what a unit of u moves, held for a sample time T
    g = u(y(x + dx, v + dv)) - u(y(x, v))                                          what the controller answers, its limits left out

The answer of one sample, by an implicit step as long as it (exact for what moves without
stiffness). A loop through a mass alone, u = -k v, has g = -k T / M and diverges where |g| > 2, by
|1 + g| from sample to sample.

Source: Astrom and Wittenmark, Computer-Controlled Systems, 3rd ed., Prentice Hall 1997, section
2.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csr_array

from ..core.algebra import saddle
from ..core.values.inputs import GivenInput
from ..dynamics.near_state.statespace import slope
from ..systems import compiled
from ..systems.connections.redundancy import scale_of
from ..systems.signals import BoundExpression
from .controllers import Controlled
from .laws import FeedbackLaw, PidLaw

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun
    from ..systems.system import System

DIVERGING = 2.0  #: gain from which a loop diverges whatever else it does
HALVED = 10  #: sample times that are tried, each half of the one before: nobody samples a thousand times as often
#: of the range of an output, from which a change of it goes from one limit to the other
WHOLE = 0.9
CYCLES = 10  #: such changes of a limit cycle: a motion of least time has as many as it has modes
SMALL = 1e-6  #: largest change of an unknown in which answers are differentiated, over changes that count as large


def tell_diverging(
    run: OpenRun, controllers: Sequence[Controlled], record: Mapping[str, Sequence[float]]
) -> str:
    """What is said of the controller whose loop has the largest gain, where that is beyond
    DIVERGING; nothing of others. `record` holds what each has given, by name.

    DIVERGING is 2: from there on a loop through a mass alone diverges,

        u = -k v,    g = -k T / M
    """
    gains = [(gain(run, one, one.sample), one) for one in controllers]
    g, worst = max(gains, key=lambda one: abs(one[0]), default=(0.0, None))
    if worst is None or not abs(g) > DIVERGING:
        return ""
    given = record[worst.name][1:]
    back = f"{abs(g):.3g} times as large{' and reversed' if g < 0.0 else ''}"
    text = f"a change in the output of controller '{worst.name}' returns {back} at its next sample, {worst.sample:g} s later"
    grown = (
        f"it went from {given[0]:.3g} to {given[-1]:.3g} {worst.unit}".rstrip()
        if given
        else "it has not acted yet"
    )
    return f"{text} ({grown}); lower its gains, to {1.0 / abs(g):.1g} of these or less{shorter(run, worst)}"


def tell_limit_cycle(system: System) -> str:
    """What is said of a controller that jumps from one of its limits to the other again and again;
    nothing where none does.

    `system` has what controllers gave as histories. Each jump of a force excites vibrations of a
    body, as an impact does.
    """
    for one in (
        one
        for signal in system.signals
        for one in given_values(signal)
        if one.controller and not one.smooth
    ):
        low = min(one.values)
        high = max(one.values)
        jumps = int(np.sum(np.abs(np.diff(one.values)) > WHOLE * (high - low)))
        if jumps >= CYCLES:
            return f"controller '{one.controller}' jumps {jumps} times between {low:.3g} and {high:.3g}, a limit cycle"
    return ""


def given_values(signal: Any) -> Iterator[GivenInput]:
    """The inputs with values that a function of time reads."""
    if isinstance(signal, GivenInput):
        yield signal
    for function in signal.functions.values() if isinstance(signal, BoundExpression) else ():
        yield from given_values(function)


def shorter(run: OpenRun, one: Controlled) -> str:
    """A sample time with a gain below 1, as a remedy; none where none is found: in less time less
    mass is moved.
    """
    for sample in one.sample * 0.5 ** np.arange(1, HALVED):
        if abs(gain(run, one, sample)) < 1.0:
            return f", or take a sample time of {sample:.1g} s"
    return ""


def gain(run: OpenRun, one: Controlled, T: float) -> float:
    """g of a controller at the start for samples of T [s]; 0 where it reads what no force keeps, or
    nothing moves or holds it.
    """
    system = run.plain
    if any(number < 0 for number in one.reads) or not one.reads:
        return 0.0
    x = system.x0
    v = system.v0
    model = replace(run.model, system=system)  # with inputs as they start
    rows = compiled.gap(model, x, 0.0)[1]
    W = (
        compiled.tangent(model, x, np.zeros(len(rows)), 0.0, 1.0 / T)
        + csr_array(system.mass) / T**2
    )
    pushed = np.pad(slope(system, x, 0.0, one.name, one.start), (0, len(rows)))
    if (found := saddle.regular_solution(saddle.matrix(csr_array(W), rows), pushed)) is None:
        return 0.0
    dx = found[: system.size]
    if not (size := float(np.abs(dx / scale_of(system)).max(initial=0.0))) > 0.0:
        return 0.0
    part = SMALL / size
    law = (
        replace(one.law, low=-np.inf, high=np.inf)
        if isinstance(one.law, PidLaw | FeedbackLaw)
        else one.law
    )
    law = replace(law, sample=T) if isinstance(law, PidLaw) else law
    memory = list(law.memory)
    reads = [run.kept_values[number] for number in one.reads]

    def answer(by: float) -> float:
        kept = compiled.accepted(model, x + by * dx, v + by / T * dx)
        return float(law(T, kept[reads].tolist(), list(memory)))

    # which remembers its last error
    law(0.0, compiled.accepted(model, x, v)[reads].tolist(), memory)
    return (answer(part) - answer(-part)) / (2.0 * part)
