"""Forces of one's own that feel the motion, written in symbols.

    @dataclass(frozen=True)
    class Drag(OwnForce):                                             "type: drag" in a scene
        name: str
        at: fields.Place
        factor: Annotated[float, fields.quantity("N s^2/m^2", ">= 0")]

        @staticmethod
        def act(at, factor):                                          fields by their names, and t
            return [(at.position, -factor * norm(at.velocity) * at.velocity)]

    energy(at, to, stiffness)                                         besides, or in its place: F = - d energy / d vectors

A field that is a place comes as `PlaceSymbols`, a number as a symbol, a vector as a matrix of symbols, a history as its value.
`act` gives pairs of a vector of a place and the force on it, whose power is force . d vector / dt. Tangents follow, exact;
functions are compiled when a model uses them, and kept in the cache folder. `checks.check_force` tests any load.
"""

from __future__ import annotations

import inspect
from abc import ABC
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, ClassVar, get_args, get_type_hints

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import InputError, say
from ..core.expressions import of_time
from ..core.fields import HISTORY
from . import fields, force_laws
from .force_laws import ForceLaw
from .loads import Load, where
from .places import At, Draft

PLACES = (fields.PLACE, fields.END, fields.CARRIER)
TIME = "t"
SMALLEST = 1e-60  #: of the square of a length


@dataclass(frozen=True)
class PlaceSymbols:
    """What a place is in symbols; matrices (c,) of coordinates."""

    position: Any  #: from the origin of the scene [m]
    velocity: Any
    axes: tuple[Any, ...] = ()  #: vectors that it carries: axes of a frame, tangents of a surface, slope of a line [and its normal]
    rates: tuple[Any, ...] = ()  #: their rates

    def turn(self, moment: Any) -> list[tuple[Any, Any]]:
        """Forces on the axes of a rigid frame that are a moment [N m], a vector in space and a number in the plane.

        On all axes they do the work 1/2 sum_k (m x e_k) . (w x e_k) = m . w.
        """
        import sympy

        if len(self.axes[0]) == 2:
            return [(e, moment / 2 * sympy.Matrix([-e[1], e[0]])) for e in self.axes]
        return [(e, moment.cross(e) / 2) for e in self.axes]


def norm(vector: Any) -> Any:
    """|vector| in symbols, whose derivatives are numbers where it is zero, too."""
    import sympy

    return sympy.sqrt(vector.dot(vector) + SMALLEST)


def turned(angle: Any) -> Any:
    """An angle, as of atan2, that counts its turns: of less than half a turn a step."""
    from . import force_symbols

    return force_symbols.turned(angle)


class OwnForce(Load, ABC, word=None):
    """Base of forces in symbols: frozen dataclasses with `act`, `energy`, or both."""

    resists: ClassVar[bool] = True  #: acts in modes about the unloaded reference, too

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if cls.word:
            force_laws.MAKERS[cls.word] = partial(law_of, cls)

    @staticmethod
    def act(*known: Any) -> Sequence[tuple[Any, Any]]:
        """Vectors of places and the forces [N] on them."""
        return ()

    @staticmethod
    def energy(*known: Any) -> Any:
        """A potential [J] whose negative gradient acts besides."""
        return 0

    def push(self, draft: Draft) -> None:
        arguments = arguments_of(type(self))
        values = {name: getattr(self, name) for name in arguments if name != TIME}
        rows, counts = list[int](), list[int]()
        anchor = next((value for value in values.values() if isinstance(value, At)), None)
        for name, kind in arguments.items():
            if kind == "place":
                added = place_rows(self, draft, values[name], anchor)
                rows += added
                counts.append(len(added) // draft.layout.dim - 1)
            else:
                counts.append(np.size(values[name]) if kind == "number" and np.ndim(values[name]) else 0)
        law, used = made(type(self), f"{type(self).word}|{draft.layout.dim}|{','.join(map(str, counts))}")
        numbers = [draft.layout.origin, *(np.ravel(values[name]) for name, kind in arguments.items() if kind == "number")]
        driven = [of_time(TIME) if name == TIME else values[name] for name, kind in arguments.items() if kind == "history"]
        signals = [draft.signal(function) for function in driven]
        draft.forces.act(law, [rows[k] for k in used], np.concatenate(numbers), signals)


def place_rows(force: OwnForce, draft: Draft, end: Any, anchor: At | None) -> list[int]:
    """Probe rows of the position and of the vectors of a place; a fixed point has its position alone.

    The ground is the point where the first place is in the reference.
    """
    layout, name = draft.layout, where(force)
    if isinstance(end, At):
        blocks = [layout.read(name, end), *layout.vectors(name, end)]
        first = [draft.probes.add(block) for block in blocks]
    elif end is None and anchor is None:
        raise InputError(say(name, "one place of a body at least", "none"))
    else:
        point = layout.reference(name, anchor) if end is None and anchor is not None else layout.fixed(name, end)
        first = [draft.probes.add(csr_array((layout.dim, layout.size)), point)]
    return [row + c for row in first for c in range(layout.dim)]


@cache
def arguments_of(kind: type[OwnForce]) -> dict[str, str]:
    """Names of what `act` and `energy` read, each a place, a number or a history."""
    hints, found = get_type_hints(kind, include_extras=True), dict[str, str]()
    own = [function for function, base in ((kind.act, OwnForce.act), (kind.energy, OwnForce.energy)) if function is not base]
    if not own:
        raise InputError(say(f"class {kind.__qualname__}", "a method act or energy", "none"))
    for name in dict.fromkeys(name for function in own for name in inspect.signature(function).parameters):
        if name != TIME and name not in hints:
            raise InputError(say(f"class {kind.__qualname__}", "arguments that are fields, or t", f"'{name}'"))
        notes = set(notes_of(hints.get(name, HISTORY)))
        found[name] = "place" if notes & set(PLACES) else "history" if HISTORY in notes or name == TIME else "number"
    return found


def notes_of(hint: Any) -> Iterator[Any]:
    """What is said of a type and of those in it."""
    yield from getattr(hint, "__metadata__", ())
    for part in get_args(hint):
        if not isinstance(part, str):
            yield from notes_of(part)


def law_of(kind: type[OwnForce], name: str) -> ForceLaw:
    """The law of a class for a dimension and sizes of its arguments, `word|dimension|sizes`."""
    return made(kind, name)[0]


@cache
def made(kind: type[OwnForce], name: str) -> tuple[ForceLaw, tuple[int, ...]]:
    """The same, and which of the rows of its places it reads or pushes."""
    import sympy

    from ..core import symbols
    from . import force_symbols as written

    place, dim, sizes = f"force law '{name}'", int(name.split("|")[1]), list(map(int, name.split("|")[2].split(",")))
    known, rows, numbers, histories = dict[str, Any](), 0, dim, 0
    origin, read = written.numbers(dim), list[Any]()  # coordinates count from there; it cancels where places are subtracted
    for (argument, sort), size in zip(arguments_of(kind).items(), sizes, strict=True):
        if sort == "place":
            y, v = ([part(dim, rows + dim * k) for k in range(size + 1)] for part in (written.rows, written.rates))
            known[argument] = PlaceSymbols(y[0] + origin, v[0], tuple(y[1:]), tuple(v[1:]))
            read += [*known[argument].position, *(part for axis in y[1:] for part in axis)]
            rows += dim * (size + 1)
        elif sort == "history":
            known[argument] = written.history(histories)
            histories += 1
        else:
            matrix = written.numbers(max(size, 1), numbers)
            known[argument] = matrix if size else matrix[0]
            numbers += max(size, 1)

    def called(function: Any) -> Any:
        return function(**{one: known[one] for one in inspect.signature(function).parameters if one in known})

    y = list(written.rows(rows))
    potential = sympy.sympify(called(kind.energy))
    F = [-sympy.diff(potential, one) for one in y]
    for vector, force in called(kind.act):
        if len(vector) != len(force) or not set(vector) <= set(read):
            raise InputError(say(f"{place}: act", "pairs of a vector of a place and a force on it", f"{vector} and {force}"))
        for symbol, part in zip(vector, force, strict=True):
            F[read.index(symbol)] += part
    law, used = written.pruned(written.Symbols(F, numbers, histories))
    unknown = law.unknown()
    if unknown:
        raise InputError(say(place, "expressions of its arguments", f"{', '.join(sorted(map(str, unknown)))} in them"))
    about = f"The force '{name}'."
    found: ForceLaw = symbols.import_text(written.source({"own": law}, about)).LAWS["own"]
    return force_laws.named(found, name, partial(law_of, kind)), used
