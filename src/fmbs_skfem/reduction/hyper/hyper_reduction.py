r"""Hyper-reduction: how the elastic forces of a reduced system are evaluated at a cost that no
longer follows the full model.

    train(runs) -> rule,      rule.apply(reduced system) -> hyper-reduced system

A hyper-reduction is one file: a frozen dataclass of its options with a `name` and the verb `train`.
It is trained on one full run or on several, of other parameters each, and its rule serves the
reduced system of any parameters. Whatever is declared by `register` can stand in a `Plan`, and is
known by its name to scenes and to the command line.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import ClassVar, TypeVar

import numpy as np

from ...core import own_words
from ...core.errors import InputError, closest, say
from ...core.storage.records import dataclass
from ...core.values.arguments import checked
from ...systems.system import System, multiply_out
from ..spaces.component import projected
from .ecsw import Selection

USUAL = 1e-3  #: tolerance eta where none is given


@dataclass(frozen=True)
class TrainingRun:
    """A run of the full model that a hyper-reduction is trained on.

    `full` and `system` are at the same parameters; `motion` is called when its states are needed,
    and not before.
    """

    full: System  #: at the parameters of the run, with all multipliers
    system: System  #: the reduced system of the same parameters
    motion: Callable[[], np.ndarray]  #: body coordinates (s, q) of the training states

    def states(self) -> np.ndarray:
        """Training states (s, n) in the reduced unknowns: the projected motion."""
        return projected(self.system, self.motion())


@dataclass(frozen=True)
class Rule:
    """What training gives.

    `apply` takes the reduced system, at whatever parameters, and gives one whose elastic forces
    cost less; `selections` say at which cells or points.
    """

    #: from a reduced system, at any parameters, to the hyper-reduced one
    apply: Callable[[System], System]
    selections: tuple[Selection, ...] = ()  #: cells or points, by component, of rules that sample


@dataclass(frozen=True)
@checked
class HyperReduction(ABC):
    """A way to evaluate elastic forces; derive a frozen dataclass from it and `register` it.

    `train(runs)` gets the full runs with their reduced systems, and gives the Rule. It stands in
    `Plan.hyper`, is chosen in scenes by its `name`, and is trained to the tolerance eta.
    """

    name: ClassVar[str]  #: in scenes, on the command line, in files
    #: behind the level in the names of a comparison, "system+label"; empty for the plain reduced
    #: model
    label: ClassVar[str]
    #: among points: systems that it meets have the cells of their bodies multiplied out
    chooses: ClassVar[bool] = True
    tolerance: float | None = None  #: eta, relative; None where nothing is approximated

    @abstractmethod
    def train(self, runs: Sequence[TrainingRun]) -> Rule:
        """The rule for the reduced systems of all parameters, from one run or several."""


def train(hyper: HyperReduction, runs: Sequence[TrainingRun]) -> Rule:
    """The rule of a hyper-reduction for reduced systems as they are.

    Cells are multiplied out first, in training and wherever the rule is applied, if the
    hyper-reduction chooses among points. What the training raises is raised, as `ecsw.NotReached`.
    """
    if not hyper.chooses:
        return hyper.train(runs)
    rule = hyper.train([replace(run, system=multiply_out(run.system)) for run in runs])
    return replace(rule, apply=partial(apply_to_points, rule))


def apply_to_points(rule: Rule, system: System) -> System:
    """The hyper-reduced system of one whose cells are multiplied out first."""
    return rule.apply(multiply_out(system))


Kind = TypeVar("Kind", bound=type[HyperReduction])
KNOWN: dict[str, type[HyperReduction]] = {}


def register(kind: Kind) -> Kind:
    """Make a hyper-reduction known by its `name` to plans, scenes and the command line; a decorator
    of the class.

    It has to be made without arguments, which gives the usual options.
    """
    if not (isinstance(kind, type) and issubclass(kind, HyperReduction)):
        raise InputError(say("register", "a class with the base HyperReduction", repr(kind)))
    kind.name = own_words.free(KNOWN, kind.name, kind.__module__, lambda one: one.__module__)
    KNOWN[kind.name] = kind
    return kind


def named(name: str, tolerance: float | None = None) -> HyperReduction:
    """The hyper-reduction of a name, with the tolerance eta where one is given and it has one;
    InputError for an unknown name.

    `tolerance` is ignored by one that approximates nothing, as `none` and `exact`.
    """
    if name not in KNOWN:
        raise InputError(
            say("hyper-reduction", f"one of {', '.join(KNOWN)}", f"'{name}'{closest(name, KNOWN)}")
        )
    usual = KNOWN[name]()
    return (
        usual
        if tolerance is None or usual.tolerance is None
        else replace(usual, tolerance=tolerance)
    )


@register
@dataclass(frozen=True)
class Whole(HyperReduction):
    """None: every point is evaluated."""

    name: ClassVar[str] = "none"
    label: ClassVar[str] = ""
    chooses: ClassVar[bool] = False

    def train(self, runs: Sequence[TrainingRun]) -> Rule:
        return Rule(lambda system: system)


NONE = Whole()
