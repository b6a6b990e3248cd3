"""A case as the packed step that kernels of C are printed for: its records, and its arrays by their
places in the records.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from ..core.compiling import structs
from ..core.storage.records import dataclass
from ..dynamics import initial, loose_rows, scheme
from ..dynamics.compiled_step.packing import Lengths, PackedStep
from ..dynamics.compiled_step.step import Step
from ..reduction.cases import Case
from ..systems import compiled

#: arrays that follow from others at the start, or that decide on nothing but when to stop
FOLLOWING = frozenset(["norm", "corotation"])


@dataclass(frozen=True)
class PackedCase:
    """A case at its start, with no rows for a motion: nothing counts its work.

    `own` are arrays of the program beside those of the step, by their names.
    """

    case: Case
    step: Step
    packed: PackedStep
    lengths: Lengths
    own: Mapping[str, np.ndarray]

    def address_of_number(self, place: tuple[Any, ...]) -> int:
        """Where a number of the record of a piece is."""
        _, k, name = place
        piece = self.packed.model.pieces[k]
        return piece.address + 8 * structs.place_of(type(piece.record), name)

    @property
    def tables(self) -> list[int]:
        """Addresses of the step and of its parts in all lengths."""
        return [self.packed.address, *(int(one) for one in self.lengths.levels.tables)]

    @cached_property
    def numbers(self) -> dict[tuple[Any, ...], Any]:
        """All arrays and numbers that the step reads and does not write, by their places."""
        found = dict[tuple[Any, ...], Any]()
        for name, part in self.step.arrays._asdict().items():
            if name not in FOLLOWING:
                found.update(leaves(part, (name,)))
        for k, piece in enumerate(self.packed.model.pieces):
            found.update(leaves(piece.record, ("piece", k)))
        found["state", "x"], found["state", "v"] = self.step.state.x, self.step.state.v
        return found | {("own", name): one for name, one in self.own.items()}


def leaves(value: Any, place: tuple[Any, ...]) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Arrays of numbers, and numbers, in a record."""
    if hasattr(value, "_fields"):
        for name in value._fields:
            yield from leaves(getattr(value, name), (*place, name))
    elif isinstance(value, float) or (isinstance(value, np.ndarray) and value.dtype == np.float64):
        yield place, value


def admissible_velocities(case: Case) -> np.ndarray:
    """v0, or where joints that hold at the start are against it what they leave of it."""
    open_rows = loose_rows.open_at_start(compiled.compile_system(case.system), case.system.x0)
    system = initial.held(case.system, ~open_rows)
    _, gap = initial.velocity_gaps(system, case.scheme)
    if np.abs(gap).max(initial=0.0) <= initial.least_rate(system.v0, case.scheme.step):
        return case.system.v0
    return initial.admissible(system, case.scheme)[1]


def pack(
    case: Case, v: np.ndarray, memory: np.ndarray | None, own: Mapping[str, np.ndarray]
) -> PackedCase:
    """A case whose system can start, see `c_files.at_start`, with velocities v (n,); `memory` is
    what forces keep there.
    """
    system = case.system
    model = compiled.compile_system(system)
    method = scheme.method_of(case.scheme, case.newton, case.scheme.step, model)
    step = initial.first_step(model, system.x0, v, method, 0)
    if memory is not None:
        step.state.memory[:] = memory
    step.space.off[:] = loose_rows.open_at_start(model, system.x0)
    packed = PackedStep(model, step, None)
    packed.lengths = lengths = Lengths(packed)
    packed.give(lengths.signals[:1], np.array([-1]))
    arrays = {name: np.ascontiguousarray(one, dtype=float) for name, one in own.items()}
    return PackedCase(case, step, packed, lengths, arrays)
