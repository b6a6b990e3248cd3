"""What a model cannot have where it leaves the house: the rules by which exports refuse it, which
can be asked before a training.

An FMU, and a model that runs in a page, are the same C: one answer serves all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from ..core.compiling import structs
from ..core.values.inputs import Input
from ..core.values.problems import Problem
from ..dynamics import GeneralizedAlpha
from ..systems.assembly import origins_of
from ..systems.forces import on_rows
from ..systems.places import Origin
from ..systems.signals import inputs_of
from ..systems.system import System, driving
from . import signals

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
    if scheme.local_error > 0.0:
        remedy = "train the model with steps of one length, `accuracy` left out"
        yield Refusal(
            "analysis",
            Problem("equal steps", f"steps in parts (local error {scheme.local_error:g})", remedy),
        )
    if ranged and scheme.start == "equilibrium":
        remedy = "fix the parameters with --set, or start in the reference"
        yield Refusal(
            "analysis", Problem("a start that no parameter changes", "`start: equilibrium`", remedy)
        )
    # inputs of a kind of their own are given by what runs beside the steps
    controlled = [one.name for one in inputs_of(system).values() if type(one) is not Input]
    parts = {
        "event": [one.name for one in system.triggers],
        "monitor": [one.name for one in system.monitors],
        "controller": controlled,
    }
    for kind, names in parts.items():
        yield from (
            Refusal(f"{kind} '{name}'", Problem(f"a model without {kind}s", f"'{name}'", LEAVE_OUT))
            for name in names
        )
    for joint in dict.fromkeys(one.joint for one in system.locks):
        yield Refusal(
            f"joint '{joint}'",
            Problem("a model without joints that are locked", f"'{joint}'", LEAVE_OUT),
        )
    known = origins_of(system) or [Origin("load", system.loads.forces, range(0))]
    for origin in known:
        wrong = map(refuse, origin.forces)
        yield from (Refusal(origin.subject, problem) for problem in wrong if problem is not None)
    maker = {k: origin.subject for origin in known for k in origin.signals}
    driven = {k for _, k in driving(system.constraints)}
    # once where a joint makes several of one, as the cosine and the sine of an angle
    of_time: dict[str, Problem] = {}
    for k, signal in enumerate(system.signals):
        if (problem := signals.refuse(signal, k in driven)) is not None:
            of_time.setdefault(maker.get(k, f"function of time {k}"), problem)
    yield from (Refusal(subject, problem) for subject, problem in of_time.items())


def refuse(force: Any) -> Problem | None:
    """What speaks against a force in C: that it is a function of Python, or begins and ends within
    steps.
    """
    routines = on_rows.compile_force(force, on_rows.Place(0, 0, 0)).routines
    if any(isinstance(one, structs.Callback) for one in routines):
        return Problem("forces that are compiled", type(force).__name__, LEAVE_OUT)
    if routines.judge is not None:
        return Problem("forces that begin and end nowhere", type(force).__name__, LEAVE_OUT)
    return None
