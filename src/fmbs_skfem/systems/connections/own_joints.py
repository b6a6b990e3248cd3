"""Joints of one's own by constraint functions in symbols.

    @dataclass(frozen=True)
    class EllipseGuide(OwnJoint):                                     "type: ellipse_guide" in a scene
        name: str
        at: fields.Place
        a: Annotated[float, fields.quantity("m", "> 0")]
        b: Annotated[float, fields.quantity("m", "> 0")]

        @staticmethod
        def equations(at, a, b):                                      fields by their names, and t, see `own_symbols`
            x, y = at.position
            return {"ellipse": (x**2 / a**2 + y**2 / b**2 - 1) / 2 * a}

Each is zero, at the start too, and reads no velocities. Its Jacobian, second derivatives and drift
follow, exact. Nothing is compiled for them: a program of operations runs in compiled code.
`checks.check_joint` tests any joint.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cache, partial
from typing import Any

from ...core import extras
from ...core.errors import InputError, say
from .. import own_symbols
from ..own_symbols import norm
from ..places import At, Draft
from .constraint_functions import Joint, mark, where
from .constraint_laws import ConstraintLaw

__all__ = ["OwnJoint", "norm"]


class OwnJoint(Joint, ABC, word=None):
    """Base of joints in symbols: frozen dataclasses with `equations`, which become constraint
    functions with exact derivatives.

    InputError, when a joint is used, where `equations` reads what is no field, or gives other
    symbols than those of its arguments.
    """

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if cls.word:
            ConstraintLaw.makers[cls.word] = partial(law_of, cls)

    @staticmethod
    @abstractmethod
    def equations(*known: Any) -> Mapping[str, Any]:
        """Functions that are zero, by the names of their rows: lengths [m] or numbers of that size,
        in symbols.

        Arguments are fields of the class by their names, and `t`: places come as `PlaceSymbols`,
        numbers and histories as symbols.
        """

    def constrain(self, draft: Draft) -> None:
        arguments = own_symbols.arguments_of(type(self), (type(self).equations,))
        read = own_symbols.read(where(self), self, draft, arguments)
        places = [getattr(self, name) for name, kind in arguments.items() if kind == "place"]
        mark(self, draft, "own", *(end for end in places if isinstance(end, At)))
        for name in functions_of(type(self), read.sizes):
            law, used = law_for(type(self), f"{type(self).word}|{read.sizes}|{name}")
            draft.constraints.law(
                self.name, name, law, [read.rows[k] for k in used], read.numbers, read.signals
            )


@cache
def functions_of(kind: type[OwnJoint], sizes: str) -> dict[str, tuple[Any, tuple[int, ...]]]:
    """Functions in symbols by name, and which of the rows of its places they read."""
    extras.need("symbols", f"class {kind.__qualname__}")
    from ...core.compiling import symbols
    from . import constraint_symbols as written

    known = own_symbols.symbols_of(own_symbols.arguments_of(kind, (kind.equations,)), sizes)
    found = {}
    for name, phi in known.call(kind.equations).items():
        phi = symbols.scalar(f"class {kind.__qualname__}: '{name}'", phi)
        law, used = written.pruned(
            written.RowSymbols(phi, len(known.vectors), known.numbers, known.histories)
        )
        if unknown := law.unknown():
            got = f"{', '.join(sorted(map(str, unknown)))} in '{name}'"
            raise InputError(
                say(
                    f"class {kind.__qualname__}",
                    "expressions of its arguments without velocities",
                    got,
                )
            )
        found[str(name)] = law, used
    return found


def law_of(kind: type[OwnJoint], name: str) -> ConstraintLaw:
    """The law of a class for a dimension, sizes of its arguments and a row,
    `word|dimension|sizes|row`.
    """
    return law_for(kind, name)[0]


@cache
def law_for(kind: type[OwnJoint], name: str) -> tuple[ConstraintLaw, tuple[int, ...]]:
    """The same, and which of the rows of its places it reads."""
    from . import constraint_symbols as written

    sizes, _, row = name.partition("|")[2].rpartition("|")
    law, used = functions_of(kind, sizes)[row]
    return written.law(name, law, partial(law_of, kind)), used
