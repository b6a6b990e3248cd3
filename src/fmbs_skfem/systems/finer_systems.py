"""The finer system of one with parts: the same bodies, joints and loads, with all shapes that its
parts know (`bodies.finer`).

It is made when it is asked for, of what the assembly was given, and what is done to a system is
done to it as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..bodies.body import ShapePoints
from .prepared import COMPILED, remembered
from .system import System
from .terms.corotated import Corotated

KEY = "finer system"


def note(system: System, make: Callable[[], System]) -> None:
    """Remember how the finer system of one with all multipliers is made: `make` is called when it
    is asked for.
    """
    remembered(system, KEY, lambda: make)


def carry(system: System, changed: System, change: Callable[[System], System]) -> System:
    """The system `changed`, which remembers that its finer one is that of `system` with the same
    change.

    `change` takes and gives a system; nothing happens where `system` has no finer one.
    """
    if (make := maker(system)) is not None:
        note(changed, lambda: change(make()))
    return changed


def maker(system: System) -> Callable[[], System] | None:
    """How the finer system of one with all multipliers is made; None of one without parts, and of
    reduced ones.
    """
    found: Callable[[], System] | None = system.__dict__.get(COMPILED, {}).get(KEY)
    return found


def unchecked(system: System) -> System:
    """The system with parts that are not held against finer ones: for runs whose errors of parts
    another run has found.

    So is `full`; a system without a finer one stays as it is.
    """
    if maker(system.full or system) is None:
        return system
    elastic = tuple(
        replace(one, gather=replace(one.gather, checked=False))
        if isinstance(one.gather, ShapePoints | Corotated)
        else one
        for one in system.elastic
    )
    return replace(
        system, elastic=elastic, full=None if system.full is None else unchecked(system.full)
    )
