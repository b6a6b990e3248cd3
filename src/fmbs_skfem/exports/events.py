"""Events in C: the search for them as live runs have it, and what it reads."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, NamedTuple

from ..control import crossings, locating, row_changes
from ..control.crossings import EventSearch, numbers_read
from ..control.happenings import EventObserver
from ..control.live import LiveRun
from ..control.row_changes import RowChanges, changes_of, signals_of
from ..core.compiling import structs
from ..core.errors import InputError, say
from ..core.printing.memory import PackedMemory
from ..core.printing.printer import KernelPrinter
from ..core.printing.program import array
from ..core.printing.values import Const, HostFunctions, Scalar, Struct
from ..core.values.tables import Table
from ..dynamics import vanishing
from ..dynamics.compiled_step import impulses, parts, stepping
from ..dynamics.compiled_step.impulses import Impulse
from ..dynamics.compiled_step.packing import Copy
from ..dynamics.compiled_step.step import State
from ..dynamics.initial import impulse_of
from ..systems import compiled, evaluation
from ..systems.forces import responses
from ..systems.system import System
from . import controllers
from .outputs import Column
from .packing import PackedCase
from .text import block, replaced, template

#: functions of the program that the search calls, see `control.crossings.SearchedRun`: what they give, and
#: how they are declared
SHELL = HostFunctions(
    (
        ("read_values", ""),
        ("find_rates", ""),
        ("keep_state", ""),
        ("put_state", ""),
        ("take_part", "whole"),
        ("let_happen", "whole"),
    )
)
DECLARED = """
static void read_values(NAME_memory *m, double place);
static void find_rates(NAME_memory *m, double place);
static void keep_state(NAME_memory *m, int which);
static void put_state(NAME_memory *m, int which);
static long long take_part(NAME_memory *m, double place, double to);
static long long let_happen(NAME_memory *m, double place);
"""
#: arrays that these write
WRITTEN = {
    "watch_values",
    "watch_rates",
    "watch_told",
    "watch_reached",
    "change_probes",
    "space_off",
}
STATES = "BEGIN", "PIECE", "END"


class EventsInC(NamedTuple):
    """All events of a model in C."""

    watch: EventSearch
    changes: RowChanges
    copies: list[Copy]  #: rooms for the states of the search
    text: str  #: functions of the program
    table: str  #: where forces keep values
    columns: tuple[Column, ...]  #: how often they have happened


def held_names(system: System) -> list[str]:
    """The inputs whose values locks hold, in the order of their numbers."""
    signals: tuple[Any, ...] = system.signals
    return [signals[k].name for k in signals_of(system.locks)]


def counts_of(system: System) -> dict[str, int]:
    """What the program counts of events."""
    numbers = numbers_read(system.triggers)
    return {
        "EVENTS": len(system.triggers),
        "EVENT_VALUES": len(numbers),
        "LATCHED": len(held_names(system)),
        "PROBES": len(system.probes.offset),
        "LATE_READINGS": int(any(k < 0 for k in numbers)),
    }


def require_free(system: System, where: str) -> None:
    """InputError for an event that releases a joint which holds in all motions that a reduced model
    knows.
    """
    model = compiled.compile_system(system)
    noise = vanishing.empty(model, vanishing.lengths(model, system.x0, 0.0))
    closed = ~vanishing.rows_of_locks(system)
    for one in system.triggers:
        for joint in one.release:
            mine = closed & [name == joint for name, _ in system.constraints.names]
            if mine.any() and noise[mine].all():
                got = f"'{joint}', which holds in all motions that the reduced model knows"
                expected = f"joints that event '{one.name}' can release"
                remedy = "train it with a run in which the event happens"
                raise InputError(say(where, expected, got, remedy))


def write(
    base: PackedCase, known: Collection[str], curves: dict[str, Table], where: str
) -> EventsInC | None:
    """All events of a case whose system has the rows of locks; None where there are none.

    Curves that they read are added; InputError, after `where`, for joints that cannot be released.

    How often one has happened becomes an output where neither an output has its name nor what is
    `known`.
    """
    case = base.case
    system = case.system
    if not system.triggers:
        return None
    require_free(system, where)
    # what stands behind its addresses is known then
    impulse_of(base.packed)
    run = LiveRun(system, case.scheme, case.newton).run
    watch = run.find(EventObserver).watch
    numbers = numbers_read(system.triggers)
    kept = [int(k) for k in responses.kept(compiled.compile_system(system))]
    lines = controllers.read(system, numbers, kept, "@watch_values@", curves)
    text = replaced(template("events.c"), {"    READ": block(lines)})
    taken = {*known, *(column for one in system.outputs.values() for column in one.columns)}
    columns = tuple(
        Column(one.name, "", f"(double)m->happened[{k}]")
        for k, one in enumerate(system.triggers)
        if one.name not in taken
    )
    places = [kept[k] if k >= 0 else -1 for k in numbers]
    table = array("KEPT_VALUE", "int", places)
    copies = [Copy(base.step.state) for _ in STATES]
    return EventsInC(watch, changes_of(system), copies, text, table, columns)


def name(memory: PackedMemory, found: EventsInC) -> tuple[Struct, Struct]:
    """Name all that the search reads and writes; the records of events and of rows."""
    records = []
    for word, record in (("watch", found.watch), ("change", found.changes)):
        table = structs.packed(record)
        memory.enclosed.append(table)
        start = structs.address_of(table)
        memory.add(type(record), start, word)
        records.append(Struct(type(record), (start,), Const(0)))
    for word, copy in zip(STATES, found.copies, strict=True):
        memory.add(State, structs.address_of(copy.packed), f"kept_{word.lower()}")
    return records[0], records[1]


def calls(
    printer: KernelPrinter, memory: PackedMemory, base: PackedCase, found: EventsInC
) -> dict[str, str]:
    """Calls in C of what is printed for events, by the words that stand for them."""
    watch, changes = name(memory, found)
    memory.add(Impulse, base.packed.beside, "impulse")
    table = memory.pointer(base.tables[0])
    record = memory.pointer(base.packed.beside)
    asked: dict[str, tuple[Any, list[Any]]] = {
        "LOOK": (locating.look, [watch, SHELL]),
        "WATCH": (crossings.begin, [watch, SHELL]),
        "CHANGE": (row_changes.change_rows, [watch, changes]),
        "PROBES": (evaluation.read_probes, [table]),
        "ANEW": (impulses.begin_anew, [table, record]),
        "BALANCE": (impulses.balance_known, [table, record]),
        "BESIDE": (stepping.accept_beside, [table, Scalar("", "whole")]),
    }
    for word, copy in zip(STATES, found.copies, strict=True):
        rooms = memory.enclose(copy.addresses, f"kept_{word.lower()}_places")
        asked[f"COPY_{word}"] = parts.copy_state, [rooms, Scalar("", "whole")]
    return {key: printer.entry(kernel, values).name for key, (kernel, values) in asked.items()}
