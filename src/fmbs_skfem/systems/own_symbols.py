"""What forces and joints of one's own in symbols are given: their fields as places, numbers and
histories.

A class of such a family is a declaration (`core.declared`) whose functions name fields as their
arguments, and `t`. A field that is a place comes as `PlaceSymbols`, a number as a symbol, a vector
as a matrix of symbols, a history as its value.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any, NamedTuple, get_args, get_type_hints

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.expressions import of_time
from ..core.values.fields import HISTORY
from . import fields
from .places import At, Draft

PLACES = (fields.PLACE, fields.END, fields.CARRIER)
TIME = "t"


@dataclass(frozen=True)
class PlaceSymbols:
    """What a place is in symbols, for forces and joints of one's own: matrices (c,) of coordinates.

    Functions of Python have arrays (c,) in their place.
    """

    position: Any  #: from the origin of the scene [m]
    velocity: Any
    #: vectors that it carries: axes of a frame, tangents of a surface, slope of a line [and its
    #: normal]
    axes: tuple[Any, ...] = ()
    rates: tuple[Any, ...] = ()  #: their rates

    def turn(self, moment: Any) -> list[tuple[Any, Any]]:
        """Forces on the axes that are a moment [N m], a vector in space and a number in the plane;
        in symbols or numbers.

        On k axes e at right angles they do the work

            sum_e f (m x e) . (w x e) / |e|^2 = m . w

        f = 1 / k in the plane and 1/2 of a frame in space. Of a slope alone, which has no turn
        about itself, f = 1 and m counts across it.
        """
        dim = len(self.axes[0]) if self.axes else 0
        count = len(self.axes)
        if not count or (dim, count) == (3, 2):
            got, remedy = (
                ("a surface in space", "name a rim of the plate")
                if count
                else ("a point", "name another place")
            )
            raise InputError(say("turn", "a place with a slope or a frame", got, remedy))
        share = 1 if count == 1 else 2
        return [(e, _like(e, _across(moment, e)) / (share * e.dot(e))) for e in self.axes]


def _across(moment: Any, e: Any) -> list[Any]:
    """m x e."""
    if len(e) == 2:
        return [-moment * e[1], moment * e[0]]
    return [moment[i] * e[j] - moment[j] * e[i] for i, j in ((1, 2), (2, 0), (0, 1))]


def _like(vector: Any, values: list[Any]) -> Any:
    """Values as an array beside an array, as a matrix of symbols beside one."""
    if isinstance(vector, np.ndarray):
        return np.array(values)
    import sympy

    return sympy.Matrix(values)


def norm(vector: Any) -> Any:
    """|vector| of an array (c,) or of a matrix of symbols, in symbols one whose derivatives are
    numbers where it is zero, too.
    """
    if isinstance(vector, np.ndarray):
        return float(np.linalg.norm(vector))
    import sympy

    from .forces import force_symbols

    if not isinstance(vector, sympy.MatrixBase):
        raise InputError(say("norm", "an array or a matrix of symbols", repr(vector)))
    return force_symbols.norm(vector)


def turned(angle: Any) -> Any:
    """An angle in symbols [rad], as of atan2, that counts its turns: of less than half a turn a
    step.

    InputError for a number: functions of Python have to count turns themselves.
    """
    from .forces import force_symbols

    if isinstance(angle, float):
        remedy = "a function of Python counts turns itself, or leave out compiled=False"
        raise InputError(say("turned", "an angle in symbols", f"{angle:g}", remedy))
    return force_symbols.turned(angle)


class Read(NamedTuple):
    """What a declaration reads of a system."""

    sizes: str  #: of its arguments: vectors of places, lengths of vectors, 0 for what has none
    rows: list[int]  #: probe rows of all places
    numbers: np.ndarray
    signals: list[int]


@cache
def arguments_of(kind: type[Any], functions: tuple[Callable[..., Any], ...]) -> dict[str, str]:
    """Names of what functions of a class read, each a place, a number or a history, in the order in
    which they first come.

    InputError where an argument is neither a field of the class nor `t`.
    """
    hints = get_type_hints(kind, include_extras=True)
    found = dict[str, str]()
    for name in dict.fromkeys(
        name for function in functions for name in inspect.signature(function).parameters
    ):
        if name != TIME and name not in hints:
            raise InputError(
                say(f"class {kind.__qualname__}", "arguments that are fields, or t", f"'{name}'")
            )
        notes = set(notes_of(hints.get(name, HISTORY)))
        found[name] = (
            "place"
            if notes & set(PLACES)
            else "history"
            if HISTORY in notes or name == TIME
            else "number"
        )
    return found


def notes_of(hint: Any) -> Iterator[Any]:
    """What is said of a type and of those in it."""
    yield from getattr(hint, "__metadata__", ())
    for part in get_args(hint):
        if not isinstance(part, str):
            yield from notes_of(part)


def read(name: str, item: Any, draft: Draft, arguments: Mapping[str, str]) -> Read:
    """Probe rows, numbers and histories of a declaration called `name` in messages, for the
    `arguments` of `arguments_of`.

    They are added to the draft; the origin (c,) of the coordinates comes first among the numbers.
    InputError where none of the places is one of a body, and where a place does not exist.
    """
    values = {argument: getattr(item, argument) for argument in arguments if argument != TIME}
    anchor = next((value for value in values.values() if isinstance(value, At)), None)
    rows = list[int]()
    sizes = list[int]()
    numbers = [draft.layout.origin]
    signals = list[int]()
    for argument, kind in arguments.items():
        size = 0
        if kind == "place":
            added = place_rows(name, draft, values[argument], anchor)
            rows += added
            size = len(added) // draft.layout.dim - 1
        elif kind == "history":
            signals.append(draft.signal(of_time(TIME) if argument == TIME else values[argument]))
        else:
            numbers.append(np.ravel(values[argument]))
            size = np.size(values[argument]) if np.ndim(values[argument]) else 0
        sizes.append(size)
    return Read(
        f"{draft.layout.dim}|{','.join(map(str, sizes))}", rows, np.concatenate(numbers), signals
    )


def place_rows(name: str, draft: Draft, end: Any, anchor: At | None) -> list[int]:
    """Probe rows of the position and of the vectors of a place; a fixed point has its position
    alone.

    The ground is the point where the first place is in the reference.
    """
    layout = draft.layout
    if isinstance(end, At):
        first = [
            draft.probes.add(block)
            for block in (layout.read(name, end), *layout.vectors(name, end))
        ]
    elif end is None and anchor is None:
        raise InputError(say(name, "one place of a body at least", "none"))
    else:
        point = (
            layout.reference(name, anchor)
            if end is None and anchor is not None
            else layout.fixed(name, end)
        )
        first = [draft.probes.add(csr_array((layout.dim, layout.size)), point)]
    return [row + c for row in first for c in range(layout.dim)]


class Known(NamedTuple):
    """Arguments in symbols."""

    values: dict[str, Any]
    vectors: list[Any]  #: (r,) the places' vectors, row by row
    numbers: int
    histories: int

    def call(self, function: Callable[..., Any]) -> Any:
        """A function of the arguments that it names."""
        return function(
            **{
                name: self.values[name]
                for name in inspect.signature(function).parameters
                if name in self.values
            }
        )


def symbols_of(arguments: Mapping[str, str], sizes: str) -> Known:
    """Arguments of `sizes` (those of `read`) in symbols.

    Coordinates count from an origin, whose numbers come first: it cancels where places are
    subtracted.
    """
    from .forces import force_symbols as written

    dim = int(sizes.partition("|")[0])
    rows = 0
    histories = 0
    found = dict[str, Any]()
    vectors = list[Any]()
    numbers = dim
    origin = written.numbers(dim)
    for (argument, kind), size in zip(
        arguments.items(), map(int, sizes.partition("|")[2].split(",")), strict=True
    ):
        if kind == "place":
            y, v = (
                [part(dim, rows + dim * k) for k in range(size + 1)]
                for part in (written.rows, written.rates)
            )
            found[argument] = PlaceSymbols(y[0] + origin, v[0], tuple(y[1:]), tuple(v[1:]))
            vectors += [*found[argument].position, *(part for axis in y[1:] for part in axis)]
            rows += dim * (size + 1)
        elif kind == "history":
            found[argument] = written.history(histories)
            histories += 1
        else:
            matrix = written.numbers(max(size, 1), numbers)
            found[argument] = matrix if size else matrix[0]
            numbers += max(size, 1)
    return Known(found, vectors, numbers, histories)
