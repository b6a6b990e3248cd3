"""What a model cannot have where it leaves the house: the rules by which exports refuse it, which
can be asked before a training.

An FMU, and a model that runs in a page, are the same C: one answer serves all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from ..control import crossings
from ..control.events import with_locks
from ..core.compiling import structs
from ..core.values.problems import Problem
from ..dynamics import GeneralizedAlpha
from ..systems.assembly import origins_of
from ..systems.forces import on_rows
from ..systems.places import Origin
from ..systems.system import System
from . import controllers, signals

LEAVE_OUT = "leave it out of the scene"


class Refusal(NamedTuple):
    """Something of a model that has no C, and why."""

    subject: str  #: as messages name it, such as "joint 'gear'"; a place in the system where that does not know what it is of
    problem: Problem


def find(system: System, scheme: GeneralizedAlpha, ranged: bool = False) -> Iterator[Refusal]:
    """What of a system, full or reduced, has no C, and steps that have none; of full ones joints
    and loads are named.

    Models are `ranged` that have whole ranges of parameters. Reductions keep all of it. What
    depends on the basis, as rows that follow from others, shows when the model is written.
    """
    # reactions of joints that lock have columns of their own
    system = with_locks(system)
    if ranged and scheme.start == "equilibrium":
        remedy = "fix the parameters with --set, or start in the reference"
        yield Refusal(
            "analysis", Problem("a start that no parameter changes", "`start: equilibrium`", remedy)
        )
    for one in controllers.controlled_of(system):
        if (problem := controllers.refuse(system, one)) is not None:
            yield Refusal(f"controller '{one.name}'", problem)
    for event in system.triggers:
        numbers = crossings.numbers_read([event])
        if (problem := controllers.refuse_reading(system, numbers, "an event")) is not None:
            yield Refusal(f"event '{event.name}'", problem)
    known = origins_of(system) or [Origin("load", system.loads.forces, range(0))]
    for origin in known:
        wrong = map(refuse, origin.forces)
        yield from (Refusal(origin.subject, problem) for problem in wrong if problem is not None)
    maker = {k: origin.subject for origin in known for k in origin.signals}
    # once where a joint makes several of one, as the cosine and the sine of an angle
    of_time: dict[str, Problem] = {}
    for k, signal in enumerate(system.signals):
        if (problem := signals.refuse(signal)) is not None:
            of_time.setdefault(maker.get(k, f"function of time {k}"), problem)
    yield from (Refusal(subject, problem) for subject, problem in of_time.items())


def refuse(force: Any) -> Problem | None:
    """What speaks against a force in C: that it is a function of Python."""
    routines = on_rows.compile_force(force, on_rows.Place(0, 0, 0)).routines
    if any(isinstance(one, structs.Callback) for one in routines):
        return Problem("forces that are compiled", type(force).__name__, LEAVE_OUT)
    return None
