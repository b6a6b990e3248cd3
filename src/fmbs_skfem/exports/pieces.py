"""What a part of a system is in C: arrays, functions, and the calls by which the step reaches it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import field

import numpy as np

from ..core.storage.records import dataclass

#: what calls a part: elastic forces, tangents and energies, forces on rows, their derivatives, what
#: they keep, functions of time
HOOKS = "force", "tangent", "energy", "push", "slopes", "accept", "signals"


@dataclass(frozen=True)
class Array:
    """A constant array of numbers; where they follow from a leaf of the case that parameters
    change, `make` gives them from it.
    """

    values: np.ndarray
    place: tuple[str | int, ...] = ()  #: of the leaf
    make: Callable[[np.ndarray], np.ndarray] = np.asarray  #: linear


@dataclass(frozen=True)
class CodePiece:
    """Arrays and functions by their names, and calls, statements of C, by hook."""

    arrays: Mapping[str, Array] = field(default_factory=dict)
    functions: Mapping[str, str] = field(default_factory=dict)
    calls: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    room: int = 0  #: numbers of each of the three rooms that it needs
    moduli: int = 0  #: and of the one of moduli
    kept: int = 0  #: numbers that it keeps of accepted states
    holds: bool = False  #: whether its tangents take strains of the state before


def joined(pieces: Iterable[CodePiece]) -> CodePiece:
    """All of them as one; functions of one name are one."""
    arrays: dict[str, Array] = {}
    functions: dict[str, str] = {}
    calls: dict[str, tuple[str, ...]] = dict.fromkeys(HOOKS, ())
    room = moduli = kept = 0
    holds = False
    for piece in pieces:
        arrays |= piece.arrays
        functions |= piece.functions
        for hook, found in piece.calls.items():
            calls[hook] += found
        room = max(room, piece.room)
        moduli = max(moduli, piece.moduli)
        kept = kept + piece.kept
        holds = holds or piece.holds
    return CodePiece(arrays, functions, calls, room, moduli, kept, holds)
