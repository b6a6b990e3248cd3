"""What systems of one structure share: what follows from parts that they have in common is found
once.

    prepare(system).find("probes", (system.probes.matrix,), make)      what `make` gives, or gave for the same parts before

A member of a family is a system with other numbers in some arrays; all its other parts are the same
objects (`alike`). A part is known by its identity, as arrays of a system never change: nothing is
compared, no structure is guessed, and whatever a number may change is found anew where the part
that holds it is another one. There is one entry a name, which keeps its parts alive: the memory
goes with the systems, and calls do not let it grow. What is found is read by many threads, and
written by none.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from ..core.errors import InputError, say
from ..core.values.arguments import checked
from ..core.values.problems import shown

Found = TypeVar("Found")
S = TypeVar("S")  #: a system: any object that does not change
COMPILED = "compiled"  #: where a system remembers what was found of it
NAME = "prepared"  #: and of its parts
VALUES = (bool, int, float, str, bytes)  #: parts that are known by their value


class Prepared:
    """What was found of parts of systems, by name: one entry a name, for the parts of the last
    time.
    """

    def __init__(self) -> None:
        self.known: dict[str, tuple[tuple[Any, ...], Any]] = {}

    def find(self, name: str, parts: tuple[Any, ...], make: Callable[[], Found]) -> Found:
        """What is made of some parts, the same as the last time where these are the same; numbers
        count by value.

        Parts are compared by identity, as arrays of a system never change; numbers and texts by
        value. `make` is called without arguments.
        """
        known = self.known.get(name)
        if known is None or len(known[0]) != len(parts) or not all(map(same, known[0], parts)):
            known = self.known[name] = parts, make()
        found: Found = known[1]
        return found


def same(a: object, b: object) -> bool:
    """Whether two parts are one object, or equal numbers."""
    return a is b or (type(a) is type(b) and isinstance(a, VALUES) and a == b)


def remembered(system: object, key: Hashable, find: Callable[[], Found]) -> Found:
    """What is found of a system, by a key, the first time; it goes with the system, and copies
    begin without it.

    `find` is called without arguments where nothing is known under the key.
    """
    known: dict[Hashable, Found] = memory(system)
    if key not in known:
        known[key] = find()
    return known[key]


def memory(system: object) -> dict[Hashable, Any]:
    """What was found of a system, by keys."""
    try:
        found: dict[Hashable, Any] = system.__dict__.setdefault(COMPILED, {})
    except AttributeError:
        raise InputError(say("system", "a System", shown(system))) from None
    return found


def prepare(system: object) -> Prepared:
    """What is found of the parts of a system, which it remembers.

    Copies by `replace` begin without it, see `alike`.
    """
    return remembered(system, NAME, Prepared)


def share(known: Prepared, system: object) -> None:
    """Let a system of which nothing is known share what is known of the parts of another one."""
    memory(system).setdefault(NAME, known)


@checked
def alike(known: Prepared, system: S) -> S:
    """A system that shares what is known of the parts of another one, as `replace(other, ...)` has
    them: `prepare(other)`.

    The system itself is given back; it forgets what it knew of its parts.
    """
    memory(system)[NAME] = known
    return system
