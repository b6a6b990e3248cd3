"""The memory that a packed struct leads to, as a program in C has it.

Arrays that kernels write become fields of one struct, all others constants. Whole numbers that
nobody writes are known, and with them all sizes and addresses.
"""

from __future__ import annotations

import bisect
import ctypes
import functools
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from ..compiling import structs
from .values import (
    ITEMS,
    Array,
    Base,
    Const,
    Number,
    OutsideError,
    Pointer,
    Scalar,
    Struct,
    text_of,
)

#: around the name of a region, whose place in C is known once everything is printed
MARK = "\x01"


class Region(Base):
    """Numbers side by side."""

    def __init__(self, name: str, item: np.dtype, start: int, size: int) -> None:
        super().__init__()
        self.name, self.dtype, self.start, self.size = name, item, start, size
        self.number = 0  #: in the order in which they were found, which no address changes
        self.folded = False  #: whether its numbers were taken for known ones

    @property
    def item(self) -> str:
        return ITEMS[self.dtype.name]

    @property
    def end(self) -> int:
        """The address behind it."""
        return self.start + self.size * self.dtype.itemsize

    def numbers(self) -> np.ndarray:
        """The numbers that are there now, no copy of them."""
        memory: Any = (ctypes.c_char * (self.end - self.start)).from_address(self.start)
        return np.ndarray((self.size,), self.dtype, memory)


class PackedMemory:
    """All regions, by their addresses.

    `mutable` are names of regions that the program's own code writes, `varying` labels of numbers
    in structs that it changes, `changing` names of single ones by their addresses, and `changed`
    addresses of arrays that it writes at the start.
    """

    def __init__(
        self,
        mutable: Collection[str] = (),
        varying: Collection[str] = (),
        changing: Mapping[int, str] | None = None,
        changed: Sequence[int] = (),
    ) -> None:
        self.mutable, self.varying = set(mutable), set(varying)
        self.changing, self.changed = changing or {}, tuple(changed)
        self.regions: list[Region] = []
        self.groups: dict[int, tuple[tuple[int, ...], int]] = {}
        self.names: dict[str, int] = {}
        self.tables: dict[str, tuple[str, list[Any]]] = {}  #: of numbers of structs that differ
        self.fields: dict[str, list[float]] = {}  #: values of those that vary
        self.enclosed: list[np.ndarray] = []  #: arrays of Python

    def unique(self, name: str) -> str:
        """A name that nothing else has."""
        count = self.names[name] = self.names.get(name, 0) + 1
        return name if count == 1 else f"{name}_{count}"

    def join(self, starts: Sequence[int]) -> None:
        """Structs at these addresses are alike but for some numbers: one code serves all of them."""
        for number, start in enumerate(starts):
            self.groups[start] = tuple(starts), number

    def pointer(self, start: int) -> Pointer:
        """An address that is known."""
        starts, number = self.groups.get(start, ((start,), 0))
        return Pointer(starts, Const(number))

    def add(self, kind: type, start: int, name: str = "") -> None:
        """Name all arrays of a struct, those of structs in it after these."""
        for field, (part, first) in places(kind).items():
            at = start + 8 * first
            if isinstance(part, structs.ArrayKind):
                self.find(part, at, f"{name}_{field}" if name else field)
            elif part not in structs.SCALARS:
                self.add(part, at, field)

    def is_field(self, region: Region) -> bool:
        """Whether a region is written: a field of the memory of the program."""
        if region.written or region.name in self.mutable:
            return True
        return any(region.start <= one < region.end for one in self.changed)

    def name(self, array: np.ndarray, name: str) -> None:
        """Name an array of the program, which keeps it."""
        if array.size:
            self.region(structs.address_of(array), array.size, array.dtype, name)

    def at(self, start: int) -> tuple[Region, int] | None:
        """The region that has the number at an address, and its place; None where none has."""
        before = self.before(start)
        if before < 0 or start >= self.regions[before].end:
            return None
        found = self.regions[before]
        return found, (start - found.start) // found.dtype.itemsize

    def before(self, start: int) -> int:
        """The number of the last region that begins up to an address; -1 where none does."""
        return bisect.bisect_right(self.regions, start, key=lambda one: one.start) - 1

    def find(
        self, kind: structs.ArrayKind, at: int, name: str
    ) -> tuple[Region | None, int, tuple[int, ...]]:
        """The region of an array whose integers are at an address, the place in it, and the shape."""
        shape = tuple(integer(at + 8 + 8 * k) for k in range(kind.ndim))
        size = int(np.prod(shape))
        if size == 0:
            return None, 0, shape
        region, place = self.region(integer(at), size, np.dtype(kind.item), name)
        return region, place, shape

    def region(self, start: int, size: int, item: np.dtype, name: str) -> tuple[Region, int]:
        """The region of some numbers, which grows with them, and their place in it."""
        end = start + size * item.itemsize
        before = self.before(start)
        if before >= 0 and start < self.regions[before].end:
            found = self.regions[before]
            if item.itemsize != found.dtype.itemsize:
                raise OutsideError(f"{name} and {found.name} are numbers of other sizes")
            found.size = max(found.size, (end - found.start) // item.itemsize)
        else:
            found = Region(self.unique(name), item, start, size)
            found.number = len(self.regions)
            self.regions.insert(before + 1, found)
            before += 1
        if before + 1 < len(self.regions) and self.regions[before + 1].start < found.end:
            raise OutsideError(f"{name} holds {self.regions[before + 1].name}, which came first")
        return found, (start - found.start) // item.itemsize

    def field(self, struct: Struct, name: str) -> Any:
        """A field of a struct."""
        known = places(struct.kind)
        if name not in known:
            raise OutsideError(f"{struct.kind.__name__} has no field '{name}'")
        part, first = known[name]
        starts = tuple(start + 8 * first for start in struct.starts)
        label = f"{struct.kind.__name__.lower()}_{name}"
        if isinstance(part, structs.ArrayKind):
            return self.array(part, starts, struct.number, label)
        if part not in structs.SCALARS:
            return Struct(part, starts, struct.number)
        if part is float:
            reals = [ctypes.c_double.from_address(one).value for one in starts]
            if label in self.varying:
                self.fields[label] = reals
                return Scalar(f"m->{label}[{text_of(struct.number)}]", "double")
            if starts[0] in self.changing:
                self.fields[self.changing[starts[0]]] = reals[:1]
                return Scalar(f"m->{self.changing[starts[0]]}[0]", "double")
            return self.choose(reals, struct.number, label)
        return self.choose([part(integer(one)) for one in starts], struct.number, label)

    def choose(self, values: Sequence[Any], number: Number, label: str) -> Number:
        """One of several numbers: known where all are the same, else that of a table."""
        if isinstance(number, Const):
            return Const(values[number.value])
        if len({repr(one) for one in values}) == 1:
            return Const(values[0])
        kind = "double" if isinstance(values[0], float) else "whole"
        table = kind, list(values)
        name = next((name for name, one in self.tables.items() if one == table), None)
        if name is None:
            name = self.unique(f"{label}_of")
            self.tables[name] = table
        return Scalar(f"{name}[{text_of(number)}]", kind)

    def array(
        self, kind: structs.ArrayKind, starts: Sequence[int], number: Number, label: str
    ) -> Array:
        """An array of a struct."""
        found = [self.find(kind, start, label) for start in starts]
        shape = tuple(
            self.choose([one[k] for *_, one in found], number, f"{label}_size")
            for k in range(kind.ndim)
        )
        if isinstance(number, Const):
            found = [found[number.value]]
        region, place, _ = found[0]
        if any(one is not region or at != place for one, at, _ in found):
            raise OutsideError(f"{label} is in several memories")
        item = ITEMS[kind.item]
        if region is None:
            return Array(Base(), f"(({item} *)0)", item, shape)
        return Array(region, moved(region, place), region.item, shape, place=Const(place))

    def enclose(self, array: np.ndarray, name: str) -> Array:
        """An array of Python that a kernel encloses, a constant."""
        part = np.ascontiguousarray(array)
        if part.dtype.name not in ITEMS:
            raise OutsideError(f"'{name}', an array of {part.dtype}")
        self.enclosed.append(part)
        start = part.__array_interface__["data"][0]
        region, place = self.region(start, part.size, part.dtype, name)
        shape = tuple(map(Const, part.shape))
        return Array(region, moved(region, place), region.item, shape, place=Const(place))

    def is_fixed(self, one: Any) -> bool:
        """Whether a value is an array of whole numbers that nobody writes, as far as is known."""
        return (
            isinstance(one, Array)
            and isinstance(one.base, Region)
            and one.item in ("whole", "int")
            and one.place is not None
            and not one.base.written
            and one.base.name not in self.mutable
        )

    def number_at(self, array: Array, place: Number) -> Const | None:
        """A number of such an array; None of others."""
        if not self.is_fixed(array) or not isinstance(place, Const):
            return None
        assert isinstance(array.base, Region)
        assert array.place is not None
        array.base.folded = True
        return Const(int(array.base.numbers()[array.place.value + place.value]))

    def numbers_of(self, array: Array) -> list[int] | None:
        """All numbers of such an array; None of others."""
        if not all(isinstance(one, Const) for one in array.shape):
            return None
        size = int(np.prod([one.value for one in array.shape if isinstance(one, Const)]))
        found = [self.number_at(array, Const(k)) for k in range(size)]
        return None if None in found else [one.value for one in found if one is not None]


def moved(region: Region, place: int) -> str:
    """Pointer to a place in a region."""
    text = f"{MARK}{region.name}{MARK}"
    return f"({text} + {place})" if place else text


def integer(address: int) -> int:
    """The integer at an address."""
    return ctypes.c_int64.from_address(address).value


@functools.cache
def places(kind: type) -> dict[str, tuple[Any, int]]:
    """Fields of a struct, and where their integers begin."""
    return {name: (part, structs.place_of(kind, name)) for name, part in structs.fields(kind)}
