"""Forces of one's own that feel the motion, written in symbols.

    @dataclass(frozen=True)
    class Drag(OwnForce):                                             "type: drag" in a scene
        name: str
        at: fields.Place
        factor: Annotated[float, fields.quantity("N s^2/m^2", ">= 0")]

        @staticmethod
        def act(at, factor):                                          fields by their names, and t, see `own_symbols`
            return [(at.position, -factor * norm(at.velocity) * at.velocity)]

    energy(at, to, stiffness)                                         besides, or in its place: F = - d energy / d vectors

`act` gives pairs of a vector of a place and the force on it, whose power is force . d vector / dt.
Tangents follow, exact. Nothing is compiled for them: a program of operations runs in compiled code.
`checks.check_force` tests any load.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from functools import cache, partial
from typing import Any, ClassVar

from ...core import extras
from ...core.errors import InputError, say
from .. import own_symbols
from ..own_symbols import norm, turned
from ..places import Draft
from .force_laws import ForceLaw
from .loads import Load, where

__all__ = ["OwnForce", "norm", "turned"]


class OwnForce(Load, ABC, word=None):
    """Base of forces in symbols: frozen dataclasses with `act`, `energy`, or both; derivatives
    follow.

        F = act - d energy / d vectors

    InputError, when a force is used, where it has neither, a function reads what is no field, or
    pairs are not of a vector of a place and a force on it.
    """

    resists: ClassVar[bool] = True  #: acts in modes about the unloaded reference, too

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if cls.word:
            ForceLaw.makers[cls.word] = partial(law_of, cls)

    @staticmethod
    def act(*known: Any) -> Sequence[tuple[Any, Any]]:
        """Pairs of a vector of a place and the force on it [N], both matrices (c,) of symbols; the
        power is force . d vector / dt.

        Arguments are fields of the class by their names, and `t`: places come as `PlaceSymbols`,
        numbers and histories as symbols.
        """
        return ()

    @staticmethod
    def energy(*known: Any) -> Any:
        """A potential [J] in symbols, whose negative gradient acts besides; arguments as of `act`.

        It counts as stored energy in the balance.
        """
        return 0

    def push(self, draft: Draft) -> None:
        read = own_symbols.read(where(self), self, draft, arguments_of(type(self)))
        law, used = made(type(self), f"{type(self).word}|{read.sizes}")
        draft.forces.act(law, [read.rows[k] for k in used], read.numbers, read.signals)


@cache
def arguments_of(kind: type[OwnForce]) -> dict[str, str]:
    """What `act` and `energy` read."""
    own = tuple(
        function
        for function, base in ((kind.act, OwnForce.act), (kind.energy, OwnForce.energy))
        if function is not base
    )
    if not own:
        raise InputError(say(f"class {kind.__qualname__}", "a method act or energy", "none"))
    return own_symbols.arguments_of(kind, own)


def law_of(kind: type[OwnForce], name: str) -> ForceLaw:
    """The law of a class for a dimension and sizes of its arguments, `word|dimension|sizes`."""
    return made(kind, name)[0]


@cache
def made(kind: type[OwnForce], name: str) -> tuple[ForceLaw, tuple[int, ...]]:
    """The same, and which of the rows of its places it reads or pushes."""
    extras.need("symbols", f"force law '{name}'")
    import sympy

    from ...core.compiling import symbols
    from . import force_symbols as written

    place = f"force law '{name}'"
    known = own_symbols.symbols_of(arguments_of(kind), name.partition("|")[2])
    potential = symbols.scalar(f"{place}: energy", known.call(kind.energy))
    F = [-sympy.diff(potential, one) for one in written.rows(len(known.vectors))]
    for vector, force in known.call(kind.act):
        if len(vector) != len(force) or not set(vector) <= set(known.vectors):
            raise InputError(
                say(
                    f"{place}: act",
                    "pairs of a vector of a place and a force on it",
                    f"{vector} and {force}",
                )
            )
        for symbol, part in zip(vector, force, strict=True):
            F[known.vectors.index(symbol)] += symbols.scalar(f"{place}: act", part)
    law, used = written.pruned(written.ForceSymbols(F, known.numbers, known.histories, potential))
    if unknown := law.unknown():
        raise InputError(
            say(
                place,
                "expressions of its arguments",
                f"{', '.join(sorted(map(str, unknown)))} in them",
            )
        )
    return written.law(name, law, partial(law_of, kind)), used
