"""Forces as functions of places, numbers, histories and t: what `own_forces` declares by a class,
by a decorator.

    @force
    def drag(at: Place, factor: Annotated[float, quantity("kg/m", ">= 0")]):
        return [(at.position, -factor * norm(at.velocity) * at.velocity)]

    drag("wind", At("beam", "right"), 0.7)                            "type: drag" in a scene

The function is called once, with symbols: its tangent is exact, both run in compiled code, and
saved models know the force by its word. With `compiled=False` it is called in every iteration, with
arrays: it may do whatever Python can, costs about 0.1 ms a call beside its own time, has
differences for a tangent, and no file holds it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, field, make_dataclass
from typing import Any, get_type_hints

import numpy as np

from ...core.errors import InputError, say
from .. import own_symbols
from ..connections.constraint_functions import size_of
from ..places import Draft
from .loads import Load, where
from .on_rows import OfPython
from .own_forces import OwnForce

Function = Callable[..., Any]


def force(
    function: Function | None = None,
    *,
    energy: bool = False,
    compiled: bool = True,
    drives: bool = False,
    resists: bool = True,
) -> Any:
    """The class of loads that a function declares, with its name as their word; a name, then its
    arguments but t, make one.

    The function gives pairs of a vector of a place and the force on it [N], or with `energy` a
    potential [J]. It `drives` where it may give energy to a motion, and does not act in modes about
    the reference where it does not `resist`. InputError where an argument does not say what it is.
    """
    if function is None:
        return lambda one: force(
            one, energy=energy, compiled=compiled, drives=drives, resists=resists
        )
    if not inspect.isfunction(function):
        raise InputError(say("@force", "a function", repr(function)))
    own = function.__name__
    if energy and not compiled:
        raise InputError(
            say(f"@force {own}", "a function of forces", "an energy", "leave out compiled=False")
        )
    hints = get_type_hints(function, include_extras=True)
    found = list[Any]([("name", str)])
    for name, one in inspect.signature(function).parameters.items():
        if name == own_symbols.TIME:
            continue
        if name not in hints or name == "name":
            expected = "arguments that say what they are, such as 'at: fields.Place', and no 'name'"
            raise InputError(say(f"@force {own}", expected, f"'{name}'"))
        found.append(
            (name, hints[name], field(default=MISSING if one.default is one.empty else one.default))
        )
    place = {
        "__module__": function.__module__,
        "__qualname__": function.__qualname__,
        "__doc__": function.__doc__ or f"{own}.",
    }
    kind = OwnForce if compiled else Called
    more = {
        "energy" if energy else "act": staticmethod(function),
        "drives": drives,
        "resists": resists,
    }
    return make_dataclass(own, found, bases=(kind,), namespace=place | more, frozen=True)


class Called(Load, word=None):
    """Base of forces that are functions of Python."""

    @staticmethod
    def act(*known: Any) -> Sequence[tuple[Any, Any]]:
        """Vectors of places, as they are given, and the forces [N] on them."""
        return ()

    def push(self, draft: Draft) -> None:
        kind = type(self)
        dim = draft.layout.dim
        arguments = own_symbols.arguments_of(kind, (kind.act,))
        known = own_symbols.read(where(self), self, draft, arguments)
        sizes = [int(one) for one in known.sizes.partition("|")[2].split(",")]

        def found(y: np.ndarray, rates: np.ndarray, histories: np.ndarray) -> np.ndarray:
            values = values_of(arguments, sizes, dim, (y, rates, known.numbers, histories))
            places = [
                place for place in values.values() if isinstance(place, own_symbols.PlaceSymbols)
            ]
            given = [vector for place in places for vector in (place.position, *place.axes)]
            F = np.zeros((len(given), dim))
            for vector, push in kind.act(**values):
                mine = [k for k, one in enumerate(given) if one is vector]
                if not mine or np.shape(push) != (dim,) or np.asarray(push).dtype.kind not in "if":
                    expected = f"pairs of a vector of a place and {dim} forces on it"
                    raise InputError(
                        say(f"{where(self)}: {kind.__name__}", expected, f"{vector} and {push}")
                    )
                F[mine[0]] += push
            return F.ravel()

        length = size_of(draft.layout, set(draft.layout.bodies)) or 1.0
        counts = [
            size for one, size in zip(arguments.values(), sizes, strict=True) if one == "place"
        ]
        vectors = np.repeat([size for count in counts for size in (length, *[1.0] * count)], dim)
        draft.forces.terms.append(
            OfPython(np.array(known.rows, np.int64), found, tuple(known.signals), sizes=vectors)
        )


def values_of(
    arguments: Mapping[str, str],
    sizes: Sequence[int],
    dim: int,
    read: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> dict[str, Any]:
    """Arguments of sizes as of `own_symbols.read` as numbers, from rows y (r,), their rates (r,),
    numbers and histories.
    """
    y, rates, numbers, histories = read
    row = 0
    number = dim
    history = 0
    found = dict[str, Any]()
    for (name, kind), size in zip(arguments.items(), sizes, strict=True):
        if kind == "place":
            at, moving = (
                part[row : row + dim * (size + 1)].reshape(-1, dim) for part in (y, rates)
            )
            found[name] = own_symbols.PlaceSymbols(
                at[0] + numbers[:dim], moving[0], tuple(at[1:]), tuple(moving[1:])
            )
            row += dim * (size + 1)
        elif kind == "history":
            found[name] = float(histories[history])
            history += 1
        else:
            found[name] = numbers[number : number + size] if size else float(numbers[number])
            number += max(size, 1)
    return found
