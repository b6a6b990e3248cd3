"""Laws in symbols that act on groups of probe rows, known by their names: what those of constraints
and of forces have in common.

Laws of this package are in the module that their class names (`loops`); a user's own are made by
`own_joints` and `own_forces` of the words that their names begin with. Routines of a law are
compiled when a model uses it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field, fields, replace
from importlib import import_module
from typing import Annotated, Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InputError, closest, listed, say
from ..core.storage.container import ENUMS, Arrays, encode
from ..core.storage.records import dataclass
from ..core.storage.validation import Attributes, Indices, Reals
from .row_programs import Action

L = TypeVar("L", bound="RowLaw")
G = TypeVar("G", bound="Groups")


@dataclass(frozen=True)
class RowLaw:
    """A law, known by its name; `find` of its class gives it back, and copies and files are made by
    the name.

    `rows`, `numbers` and `histories` are how many of each it reads; `pairs` are pairs of places
    among its rows.
    """

    name: str
    rows: int  #: probe rows that it reads
    numbers: int
    histories: int  #: functions of time
    #: of its rows, in which it has derivatives that the iteration needs
    pairs: tuple[tuple[int, int], ...]
    maker: Any = field(default=None, kw_only=True)  #: makes one of one's own of its name
    #: of one in symbols, one for each of its routines
    actions: tuple[Action, ...] = field(default=(), kw_only=True)
    kind: ClassVar[str]  #: in messages
    loops: ClassVar[str]  #: module with LAWS of this package
    #: of laws of one's own, by the first word of their names
    makers: ClassVar[dict[str, Callable[[str], Any]]]

    def __init_subclass__(cls) -> None:
        cls.makers = {}
        ENUMS[cls.__name__] = cls.find

    def __reduce__(self) -> Any:
        return self.maker or type(self).find, (self.name,)

    @classmethod
    def find(cls: type[L], name: str) -> L:
        """The law of this name; those of one's own from the classes that have been declared.

        InputError for a name of neither, with the nearest word of a declared class.
        """
        known: dict[str, L] = import_module(cls.loops, __package__).LAWS
        if name in known:
            return known[name]
        word = name.split("|")[0]
        if word not in cls.makers:
            expected = f"one of {listed([*known, *cls.makers], word)}"
            remedy = "import the file that declares it first"
            raise InputError(
                say(cls.kind, expected, f"'{word}'", remedy) + closest(word, cls.makers)
            )
        found: L = cls.makers[word](name)
        return found


@encode.register
def _(law: RowLaw, arrays: Arrays, where: str) -> Any:
    return {"enum": type(law).__name__, "value": law.name}


@dataclass(frozen=True)
class Groups:
    """t groups of r probe rows on which one law acts, each with its p numbers and h histories."""

    law: Annotated[RowLaw, Attributes("r=rows p=numbers h=histories")]
    rows: Annotated[np.ndarray, Indices("t r", end="y")]
    numbers: Annotated[np.ndarray, Reals("t p")]
    #: histories, -1 for the constant 1
    signals: Annotated[np.ndarray, Indices("t h", end="k", low=-1)]

    def __len__(self) -> int:
        return len(self.rows)


def group(
    kind: type[L], law: str | L, rows: Sequence[int], numbers: ArrayLike, signals: Sequence[int]
) -> tuple[L, Any, Any, Any]:
    """The fields of one group by a law or its name: law, rows (1, r), numbers (1, p), signals (1,
    h).

    Of probe rows (r,), numbers (p,) and histories (h,); `kind` is the class of the law. InputError
    where no law has that name.
    """
    first, last = (np.array([part], np.int64).reshape(1, -1) for part in (rows, signals))
    return (
        kind.find(law) if isinstance(law, str) else law,
        first,
        np.asarray(numbers, float).reshape(1, -1),
        last,
    )


def join(found: Sequence[G]) -> tuple[G, ...]:
    """Groups of rows in one for every law, in the order in which the laws first come; arrays are
    put one below the other.
    """
    laws: dict[str, list[G]] = {}
    for item in found:
        laws.setdefault(item.law.name, []).append(item)

    def joined(same: Sequence[G]) -> G:
        names = [part.name for part in fields(same[0]) if part.name != "law"]
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(one, name) for one in same]) for name in names
        }
        return replace(same[0], **columns)

    return tuple(map(joined, laws.values()))
