"""What stands beside bodies, joints, loads and outputs in an assembly: inputs, and whatever
registers, each all of one kind.

    assemble(bodies, joints, loads, controllers=[...], events={...})

A kind of additions is a class that registers for a keyword of `assemble` (`adds`), which goes over
all of them: what they read of outputs is sorted, they tell the names that expressions know, and,
once all loads are there, put themselves into the draft.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from ..core.errors import InputError, closest, listed, say
from ..core.values.inputs import Source
from ..core.values.responses import OfState
from .connections.constraint_functions import Joint
from .places import Draft


class Addition:
    """Additions of one kind, such as all controllers; every method may be left out.

    A kind registers with `adds`; `assemble` calls the methods in the order in which they stand
    here.
    """

    def __init__(self, given: Any, draft: Draft) -> None:
        """Of what `assemble` was given for its keyword."""

    def reads(self) -> Iterable[tuple[str, OfState]]:
        """Expressions of outputs that it reads while a motion goes on, each with the place that
        messages name.
        """
        return ()

    def sources(self, numbers: Sequence[int]) -> Sequence[Source]:
        """Names that expressions of loads know, as sources of values.

        `numbers` are those of what it reads, in the order of `reads`: see `measures.readings`.
        """
        return ()

    def add(
        self, draft: Draft, joints: Sequence[Joint], numbers: Sequence[int]
    ) -> Mapping[str, Any]:
        """Put itself into the draft, behind all joints and loads: fields of the system that are its
        own, by name.

        `joints` are those of the assembly, `numbers` as in `sources`.
        """
        return {}

    def gains(self) -> Iterable[tuple[str, OfState]]:
        """Expressions of outputs that have to have a dimension, each with the place that messages
        name.
        """
        return ()


Kind = TypeVar("Kind", bound=type[Addition])
KINDS: dict[str, type[Addition]] = {}


def adds(keyword: str) -> Callable[[Kind], Kind]:
    """Register a kind of additions, a class, for a keyword of `assemble`; it replaces one that has
    the keyword.
    """

    def register(kind: Kind) -> Kind:
        KINDS[keyword] = kind
        return kind

    return register


def additions_of(given: Mapping[str, Any], draft: Draft) -> list[Addition]:
    """The additions that an assembly was given, one object a keyword, in the order in which the
    kinds registered.

    Keywords with None are left out. InputError for a keyword that nothing registers, with the
    nearest known one.
    """
    for keyword in given:
        if keyword not in KINDS:
            raise InputError(
                say("assemble", f"one of the keywords {listed(KINDS, keyword)}", keyword)
                + closest(keyword, KINDS)
            )
    return [
        kind(given[keyword], draft)
        for keyword, kind in KINDS.items()
        if given.get(keyword) is not None
    ]


@adds("inputs")
class Inputs(Addition):
    """What is given from outside, and tables."""

    def __init__(self, given: Iterable[Source], draft: Draft) -> None:
        self.given = list(given)

    def sources(self, numbers: Sequence[int]) -> Sequence[Source]:
        return self.given
