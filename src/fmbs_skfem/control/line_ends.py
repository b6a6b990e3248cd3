"""Joints that slide come to the end of their line: a run stops there, and equilibria beyond it are
refused.

Beyond an end the line would go on as the polynomials of its last cell do. A `sliding_stop` takes up
to LEAVE of the length of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import Reason, SolverError
from ..core.notices import notify
from ..dynamics.observers import FoundEquilibria, Observer, RunSetting, offered, reviews
from ..dynamics.trajectory import Trajectory
from ..systems.connections import along_lines
from ..systems.forces.force_laws import LawForces
from ..systems.system import System

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun

# on half of a cell of 50 a quartic is as good as on it; a stop that gives way by twice as much is
# one of a stiffness too small
LEAVE = 1e-2  #: part of the length of a line by which a joint with a stop may be beyond its end
EXACT = 1e-9  #: the same of one without, by round-off
STOP = "one_sided_plane"  #: law of stops
REMEDIES = (
    "let an event release the joint before, or give it a `sliding_stop`",
    "give its `sliding_stop` a larger stiffness",
)


class SlideEnd(NamedTuple):
    """A joint that slides: its name, a row of it, and its place on a line.

        s = read @ x + offset

    The line has some length [m].
    """

    joint: str
    row: int
    read: csr_array
    offset: float
    length: float
    stopped: bool  #: by a stop


def slides(system: System) -> Iterator[SlideEnd]:
    """The joints of a system that slide."""
    seen = set[str]()
    for laws in system.constraints.laws:
        if not laws.law.name.startswith(f"{along_lines.WORD}|"):
            continue
        for row, rows, numbers in zip(laws.row, laws.rows, laws.numbers, strict=True):
            joint = system.constraints.names[row][0]
            if joint not in seen:
                seen.add(joint)
                P = csr_array(system.probes.matrix)
                read = P[[rows[0]]]
                offset = float(system.probes.offset[rows[0]])
                length = along_lines.end_of(numbers)
                yield SlideEnd(
                    joint,
                    int(row),
                    read,
                    offset,
                    length,
                    any(not (P[[k]] - read).count_nonzero() for k in stops(system)),
                )


def stops(system: System) -> Iterator[int]:
    """Probe rows that stops push."""
    for one in system.loads.forces:
        if isinstance(one, LawForces) and one.law.name == STOP:
            yield from one.rows[:, 0]


def beyond(one: SlideEnd, x: np.ndarray) -> float:
    """How far a joint is beyond an end of its line of the length l [m], more than it may be.

        max(-s, s - l) - allowed part of l

    Zero or below on it.
    """
    s = float((one.read @ x)[0]) + one.offset
    return max(-s, s - one.length) - (LEAVE if one.stopped else EXACT) * one.length


@offered
def _(setting: RunSetting) -> Iterator[Observer]:
    for one in slides(setting.system):
        yield LineEnd(one)


class LineEnd(Observer):
    """Stops a run at the end of the line of a joint that holds."""

    reads_states = False

    def __init__(self, slide: SlideEnd) -> None:
        self.slide = slide
        self.name = f"end of the line of {slide.joint}"

    def after(self, run: OpenRun) -> None:
        x = run.step.state.x[np.argsort(run.model.order)]
        one = self.slide
        if run.step.space.off[one.row] == 0.0 and beyond(one, x) > 0.0 and not run.ended:
            text = f"joint '{one.joint}' leaves its line at the end of the step to t = {run.time:.6g} s, where the run stops"
            notify(f"{text}; {REMEDIES[one.stopped]}")
            run.stop(self)


@reviews
def _(found: FoundEquilibria) -> Trajectory:
    for one in slides(found.motion.system):
        far = max(beyond(one, x) for x in found.motion.x)
        if far > 0.0:
            text = (
                f"joint '{one.joint}' is beyond the end of its line in equilibrium; {REMEDIES[1]}"
            )
            raise SolverError(text, Reason.NO_EQUILIBRIUM, 0.0, ((one.joint, far),))
    return found.motion
