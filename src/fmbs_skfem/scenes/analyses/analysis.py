"""Analyses of a scene: what is asked of its system, each a declaration in a file of its own, which
says what it needs and does.

    analysis: {type: dynamic, ...}      class Dynamic(History), a motion or a path of equilibria: outputs, figures, pictures
    analysis: {type: modes, ...}        class Modes(States), a table of what is found about one state

An own one is a class of the family in a file that the scene names: nothing asks for its word,
studies ask for what it says.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self, TypeAlias, cast

import numpy as np

from ...core.declared import Declared
from ...core.errors import InputError, say
from ...core.notices import Progress
from ...core.storage.records import dataclass
from ...core.values.problems import Found
from ...dynamics import initial
from ...systems import free_motions
from ...systems.connections import hinged_rims
from ..accuracy import Accuracy
from ..yamlfile import Oddity, where

if TYPE_CHECKING:
    from ...dynamics import CampbellDiagram, GeneralizedAlpha, Trajectory
    from ...dynamics.checkpoint import Record, Resumed
    from ...dynamics.near_state.shapes import Shapes
    from ...dynamics.near_state.statespace import StateSpace
    from ...systems import System
    from ..schema import Scene

HOLD = "\nhold them by joints"
#: of linear constraints; None for the one that suits
Form: TypeAlias = Literal["eliminate", "multipliers"] | None


@dataclass(frozen=True)
class Work:
    """How much an analysis computes, for estimates of its time: how often each is done, and counts
    for the report.
    """

    forces: float = 0.0  #: evaluations of elastic forces
    factors: float = 0.0  #: factorisations
    solutions: float = 0.0
    calls: float = 0.0  #: of a compiled step
    counts: Mapping[str, int] = field(default_factory=dict)
    steps: int = 0  #: of a motion, whose time a step is estimated
    states: int = 0  #: that it stores


class Analysis(Declared, ABC):
    """What is asked of a system: a frozen dataclass, see `core.declared`."""

    constraints: Form
    clock: ClassVar[bool] = True  #: whether t is a time; otherwise it stands for the load factor
    #: whether it is a motion by steps of time, with `duration`, `step` and an initial motion
    moves: ClassVar[bool] = False
    masses: ClassVar[bool] = True  #: whether masses count where nothing weighs
    floats: ClassVar[bool] = True  #: whether bodies may move freely, which is a warning only
    has_outputs: ClassVar[bool] = True

    @property
    def drawn(self) -> bool:
        """Whether its first state is that in which the scene is drawn."""
        return True

    @abstractmethod
    def instants(self) -> np.ndarray:
        """Times (i,) [s] at which histories and drives are taken."""

    @abstractmethod
    def work(self) -> Work:
        """How much it computes."""

    def problems_in(self, scene: Scene) -> Iterator[Found]:
        """What does not fit in the scene around it."""
        return iter(())

    def idle(self, scene: Scene) -> Iterator[Oddity]:
        """What the scene says without effect on it."""
        return iter(())

    def examine(self, scene: Scene, raw: System) -> None:
        """Refuse, before anything is solved, a system with all coordinates of which it has no
        solution.
        """

    def require(self, scene: Scene, raw: System) -> None:
        """Refuse, before it is run as well, what would have another solution than is meant."""

    def require_joints(self, system: System) -> None:
        """Refuse joints that no state fulfils at its begin."""
        initial.jacobian_at_start(system)


class History(Analysis, ABC):
    """States over time or over the load factor, with outputs."""

    tolerance: float | None
    accuracy: Accuracy | None = None  #: for which cells are found, and the step of a motion
    label: ClassVar[str]  #: what is done while it is solved

    @property
    def open(self) -> bool:
        """Whether its step is to be found."""
        return False

    def settled(
        self, step: float | None, local_error: float = 0.0, tolerance: float | None = None
    ) -> Self:
        """The analysis with what was found for an accuracy.

        Of a motion: a step [s], the error above which one is divided, and Newton's tolerance where
        it has none of its own.
        """
        own: Any = self
        return cast("Self", replace(own, accuracy=None))

    def piloted(
        self, steps: int, every: int, local_error: float = 0.0, tolerance: float | None = None
    ) -> Self:
        """The analysis in so many steps, of which every so many are kept, the rest as `settled` has
        it; equilibria have none.
        """
        return self

    @property
    def scheme(self) -> GeneralizedAlpha | None:
        """The scheme of steps of time; None of equilibria."""
        return None

    @abstractmethod
    def solve(
        self,
        system: System,
        advance: Progress | None = None,
        watch: Record | None = None,
        resume: Resumed | None = None,
    ) -> Trajectory:
        """The states; those of a motion are watched, and go on from where it was stopped."""

    def solve_for_outputs(
        self,
        system: System,
        advance: Progress | None = None,
        watch: Record | None = None,
        resume: Resumed | None = None,
    ) -> Trajectory:
        """The same for who asks for outputs: few states may be kept."""
        return self.solve(system, advance, watch, resume)

    def solve_to_compare(self, system: System, watch: Record | None = None) -> Trajectory:
        """The same for who compares outputs of runs: nothing is said of the motion."""
        return self.solve(system, watch=watch)


@dataclass(frozen=True)
class StateTable:
    """What is found about one state, a row each."""

    raw: System  #: with all coordinates
    reduced: System  #: in the form that was solved
    about: str  #: in a few words
    title: str  #: of the table
    heads: Sequence[str]  #: of its columns for people
    columns: Mapping[str, np.ndarray]  #: column -> (i,)
    facts: Mapping[str, Any]  #: the same in the report
    frequencies: np.ndarray = field(default_factory=lambda: np.empty(0))  #: (i,) [Hz]
    shapes: Shapes | None = None  #: what moves in every row, for pictures
    moves: Sequence[str] = ()  #: the same in words, the last column for people
    linear: StateSpace | None = None  #: from inputs to outputs
    diagram: CampbellDiagram | None = None  #: frequencies over a parameter
    doubts: Sequence[str] = ()  #: what speaks against it, which is shown as warnings


class States(Analysis, ABC):
    """A table of what is found about one state; there are no outputs."""

    table: ClassVar[str]  #: name of its file
    files: ClassVar[tuple[str, ...]] = ()  #: of a linear system
    has_outputs: ClassVar[bool] = False

    @abstractmethod
    def find(self, scene: Scene, allow_outside: bool = False) -> StateTable:
        """What is found of the system of a scene."""


def motion_only(scene: Scene, what: str, remedy: str = "") -> Iterator[Oddity]:
    """What in a scene belongs to motions alone, where `what` is asked for."""
    undamped = f"does nothing, {what} is not damped" + (f"; {remedy}" if remedy else "")
    if scene.initial.bodies:
        yield ("initial",), f"does nothing, {what} has no initial motion"
    if scene.damping.mass or scene.damping.stiffness:
        yield ("damping",), undamped
    for name, load in scene.loads.items():
        yield from ((("loads", name, key), text) for key, text in load.idle(undamped) if key)


def refuse_unsupported(scene: Scene, raw: System, remedy: str = HOLD) -> None:
    """Refuse rigid motions that nothing resists where an equilibrium is asked for; weight may hold
    one, as of a chain.
    """
    refuse_motions(scene, list(map(str, free_motions.unsupported(raw)[0])), remedy)


def refuse_swings(scene: Scene, raw: System, time: float) -> None:
    """Refuse motions about rims that loads at a time [s] push: an equilibrium far away would be
    taken for that of a plate.
    """
    refuse_motions(
        scene, list(map(str, hinged_rims.pushed(raw, time))), "`slopes: true` of the rim clamps it"
    )


def refuse_motions(scene: Scene, found: list[str], remedy: str) -> None:
    """Refuse rigid motions, if there are any."""
    if found:
        listed = "".join(f"\n  {number}. {motion}" for number, motion in enumerate(found, start=1))
        got = f"{len(found)} rigid motion{'s' if len(found) > 1 else ''} that nothing resists:{listed}"
        refuse_free(scene, got, remedy)


def refuse_free(scene: Scene, free: str, remedy: str) -> None:
    """Refuse motions that nothing resists."""
    raise InputError(
        say(where(scene, "analysis"), "bodies that joints and springs hold", free, remedy)
    )
