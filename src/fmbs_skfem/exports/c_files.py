"""A reduced model as one C99 file and one header: the equations of a system, written out, and the
time step of `dynamics`.

    [ c W  J^T ; J  0 ] (dq, dlambda) = - (c (M q'' + C q' + K q + f - Q) + J^T lambda, Phi)

Everything has a fixed size, no library is called, and all memory is in one struct. The step accepts
corrections as that of `dynamics.compiled_step.stepping` does, so that both go the same way but for
round-off.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain, count
from typing import Any, NamedTuple

import numpy as np

from .. import __version__
from ..control import locating
from ..control.events import with_locks
from ..core.algebra import small
from ..core.algebra.linalg import as_dense
from ..core.compiling import jit, programs, structs
from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.printing.memory import PackedMemory
from ..core.printing.printer import KernelPrinter
from ..core.printing.program import PrintedProgram, array, region
from ..core.printing.values import ZERO, Const, OutsideError, Scalar, Value
from ..core.storage.records import dataclass
from ..core.values.inputs import Input
from ..dynamics import initial, rest, scheme
from ..dynamics.compiled_step import impulses, jumps, pieces, starting, stepping, touching
from ..dynamics.compiled_step.step import LEAST, State, Step
from ..reduction import cases
from ..reduction.affine import ParametricCase
from ..reduction.cases import Case
from ..systems import change_coordinates, compiled, row_programs
from ..systems.layouts import Storage
from ..systems.signals import driving_inputs, inputs_of
from ..systems.system import System
from . import controllers, events, numbers, outputs, refusals, signals
from .events import EventsInC
from .numbers import Numbers
from .outputs import Column
from .packing import PackedCase, admissible_velocities, pack
from .signals import Timed
from .text import comment, maths, number, replaced, template

HUGE = 1e300
LARGEST = 300  #: unknowns of a full model, whose matrices become dense
BESIDE = ("fmi2.c", "fmi3.c", "fmu.c", "windows.c")  #: files that a model may have beside its own
#: of C and of POSIX, which a header of the same name would hide
HEADERS = frozenset(
    [
        "aio",
        "assert",
        "complex",
        "cpio",
        "ctype",
        "dirent",
        "dlfcn",
        "errno",
        "fcntl",
        "fenv",
        "float",
        "fmtmsg",
        "fnmatch",
        "ftw",
        "glob",
        "grp",
        "iconv",
        "inttypes",
        "iso646",
        "langinfo",
        "libgen",
        "limits",
        "locale",
        "malloc",
        "math",
        "memory",
        "monetary",
        "mqueue",
        "ndbm",
        "netdb",
        "nl_types",
        "poll",
        "pthread",
        "pwd",
        "regex",
        "sched",
        "search",
        "semaphore",
        "setjmp",
        "signal",
        "spawn",
        "stdalign",
        "stdarg",
        "stdatomic",
        "stdbool",
        "stddef",
        "stdint",
        "stdio",
        "stdlib",
        "stdnoreturn",
        "string",
        "strings",
        "stropts",
        "syslog",
        "tar",
        "termios",
        "tgmath",
        "threads",
        "time",
        "trace",
        "uchar",
        "ulimit",
        "unistd",
        "utime",
        "utmpx",
        "values",
        "varargs",
        "wchar",
        "wctype",
        "windows",
        "wordexp",
    ]
)
#: that Windows takes for devices, whatever the ending of a file
DEVICES = frozenset(
    ["aux", "con", "nul", "prn", *(f"{port}{k}" for port in ("com", "lpt") for k in range(10))]
)
#: numbers of the method that depend on the step, and names of arrays that the program itself writes
VARYING = frozenset(f"method_{name}" for name in ("h", "c", "bh", "gh", "sharp", "allowed"))
WRITTEN = frozenset(
    f"state_{name}" for name in ("x", "v", "acceleration", "multipliers", "past", "known", "order", "change", "signals")
) | frozenset(
    f"space_{name}" for name in ("x", "v", "acceleration", "multipliers", "signals", "c", "f")
) | {"job_signals", "job_counters", "job_done", "levels_found", "levels_spans", "work_kind"}  # fmt: skip
#: kernels whose loops over tables are written out: programs of expressions
SPELLED = (programs.run, row_programs.act)
STATUSES = (
    {
        name: getattr(stepping, name)
        for name in ("DONE", "NOT_FINITE", "SINGULAR", "TOUCHES", "TOO_FEW")
    }
    | {name: getattr(locating, name) for name in ("BROKEN", "REPEATED", "CONTRADICTED")}
    | {name: getattr(impulses, name) for name in ("OPEN", "AGAINST")}
)
#: what the begin of a division and the start fill
FOUND = "before_", "held_", "kept_", "space_gradients"
APART = "\n/* kernels */\n"
HEAD = """typedef long long whole;
typedef struct { double real, imag; } pair;
#if defined(__GNUC__)
#define INLINED static inline __attribute__((always_inline))
#else
#define INLINED static inline
#endif
#define ENDLESS (1e308 * 10.0)
#define NO_NUMBER (ENDLESS - ENDLESS)
#define ROOM(n) ((n) > 0 ? (n) : 1)"""


@dataclass(frozen=True)
class CModel:
    """A model in C: its two texts, and its ports."""

    name: str  #: of the model and of its files, a C identifier
    header: str
    source: str
    step: float  #: [s]
    duration: float  #: of the motion that it was made for [s]
    #: unit, least, largest and nominal value by name
    parameters: Mapping[str, tuple[str, float, float, float]]
    tunable: tuple[str, ...]  #: those that may change in a motion
    inputs: Mapping[str, tuple[str, float]]  #: unit and start value by name
    ranges: Mapping[str, tuple[float, float]]  #: of the inputs that have one
    columns: tuple[Column, ...]  #: outputs
    drives: bool  #: whether inputs drive joints, by which there are no derivatives
    events: int  #: how many there are
    counted: tuple[str, ...]  #: columns that count them
    left_out: tuple[str, ...]  #: columns and monitors that the model has and a C file has not
    system: System  #: at the start of its motion


def identifier(name: str) -> str:
    """A name that C knows: letters, digits and _."""
    found = re.sub(r"\W", "_", name, flags=re.ASCII).strip("_") or "model"
    return f"model_{found}" if found[0].isdigit() else found


def model_name(name: str, texts: Iterable[str]) -> str:
    """A name for a model and its files: one with which words of their texts begin, that of a header
    or a device, is prefixed.

    Windows and macOS take large and small letters of files for the same.
    """
    found = identifier(name)
    code = (
        re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL) for text in (*texts, *map(template, BESIDE))
    )
    # names that a whole file knows stand in lines that begin with the line
    own = found.lower() in HEADERS | DEVICES or any(
        re.search(rf"^\S.*\b{found}_", text, re.MULTILINE) for text in code
    )
    return f"model_{found}" if own else found


def distinct(names: Iterable[str]) -> list[str]:
    """Names as words of C in capitals; one that is taken gets a number."""
    found: list[str] = []
    for name in names:
        word = identifier(name).upper()
        found.append(
            next(
                one for one in chain([word], (f"{word}_{k}" for k in count(2))) if one not in found
            )
        )
    return found


def check(given: Numbers, where: str) -> None:
    """InputError for what a C file cannot do."""
    case = given.case
    system = given.case.system
    if (
        not isinstance(system.mass, np.ndarray)
        and system.size > 0
        and len(system.components) == 0
        and system.elastic
    ):
        raise InputError(say(where, "a reduced model", "a full one", "reduce it with fmbs reduce"))
    if found := [
        problem.at(f"{where}: {subject}")
        for subject, problem in refusals.find(system, case.scheme, given.model is not None)
    ]:
        raise InputError("\n".join(found))


def jumps_of(given: Numbers, where: str) -> list[tuple[float, float, float]]:
    """Instants just before and just behind each jump of loads [s] in the duration of the case, and
    whether drives bend there, 1 or 0.

    A notice says where there are more behind it, and where parameters move them: such jumps act at
    the ends of steps.
    """
    case = given.case
    step = case.scheme.step
    steps = scheme.steps_in(case.scheme, case.duration)

    def instants(system: System, steps: int) -> list[tuple[float, float, float]]:
        found = jumps.jumps_of_loads(system, step, steps)
        every = (one for _, places in sorted(found.items()) for one in places)
        return [(one.before, one.behind, float(one.bends)) for one in every]

    found = instants(case.system, steps)
    late = "C files take them at the ends of steps, late by up to one of them"
    if moved(given, found, lambda system: instants(system, steps)):
        notify(f"{where}: loads jump when parameters say; {late}")
        return []
    if later := [at for at, *_ in instants(case.system, 2 * steps) if at > steps * step]:
        end = f"the end of its duration at {steps * step:g} s"
        notify(f"{where}: loads jump behind {end}, at t = {later[0]:.6g} s; {late}")
    return found


def moved(
    given: Numbers,
    found: Sequence[tuple[float, float, float]],
    instants: Callable[[System], Sequence[tuple[float, float, float]]],
) -> bool:
    """Whether jumps are at other instants with other parameters."""
    if given.model is None or not any(
        given.varies(("system", one)) for one in ("signals", "loads")
    ):
        return False
    for share in numbers.SHARES:
        row = {one.name: one.low + share * (one.high - one.low) for one in given.model.parameters}
        if instants(given.model(row).system) != found:
            return True
    return False


class Kernels(NamedTuple):
    """Printed kernels of a step, and how the program calls them."""

    printer: KernelPrinter
    calls: dict[str, str]  #: names in C


def print_kernels(
    base: PackedCase,
    changing: Mapping[int, str],
    changed: Sequence[int],
    turning: bool,
    rooms: Mapping[str, np.ndarray],
    jumping: bool,
    kicked: bool,
    happening: EventsInC | None,
) -> Kernels:
    """The step of a case, its start and its energies, how it jumps where forces do (`jumping`), and
    its pieces where loads jump (`kicked`) or events are `happening`.

    `changing` are numbers in records that parameters change, by their addresses, `changed` addresses
    of such arrays; the tangents of bodies that are `turning` are then found at the start. `rooms` are
    arrays that the program writes.
    """
    own = {**base.own, **rooms}
    mutable = WRITTEN | {f"own_{name}" for name in rooms} | (events.WRITTEN if happening else set())
    step = base.step
    doors = step.doors
    callbacks = (one.address for one in base.lengths.doors)
    behind = jit.BEHIND | dict(zip(callbacks, ("fill_signals", "set_parts"), strict=True))
    while True:
        memory = PackedMemory(mutable, VARYING, changing, changed)
        memory.join(base.tables)
        memory.add(Step, base.tables[0])
        for name, copy in (("before", base.lengths.before), ("held", base.lengths.held)):
            if copy is not None:
                memory.add(State, structs.address_of(copy.packed), name)
        for name, numbers_of in own.items():
            memory.name(numbers_of, f"own_{name}")
        printer = KernelPrinter(memory, behind, small.STANDS, small.PRODUCTS, SPELLED)
        table = memory.pointer(base.tables[0])
        asked: dict[str, tuple[Any, Value]] = {
            "TAKE": (stepping.take_row, ZERO),
            "TAKE_FIXED": (stepping.take_fixed, Scalar("", "whole")),
            "START": (starting.start, Const(initial.flags_of(base.packed.model))),
            "ENERGIES": (starting.energies, Scalar("", "whole")),
            "RESIDUAL": (behind[doors.residual], ZERO),
            "FACTORISE": (behind[doors.factorise], ZERO),
            "SOLVE": (behind[doors.solve], ZERO),
        }
        if turning:
            asked["TURN"] = starting.turned_tangents, ZERO
        if jumping:
            asked["JUMP"] = stepping.jump, Scalar("", "whole")
        if kicked or happening:
            asked["TAKE_SPAN"] = touching.take_span, ZERO
            asked["TAKE_SERIES"] = touching.take_series, ZERO
        if (kicked or happening) and step.method.locating:
            asked["TOUCH"] = touching.take, ZERO
        calls = {
            name: printer.entry(kernel, [table, more]).name
            for name, (kernel, more) in asked.items()
        }
        calls |= controllers.calls(printer, memory, base.case.system, own)
        if happening:
            calls |= events.calls(printer, memory, base, happening)
        printer.finish()
        wrong = {one.name for one in memory.regions if one.folded and one.written}
        if not wrong <= mutable:
            mutable = mutable | wrong
            continue
        return Kernels(printer, calls)


def write(case: Case | ParametricCase, name: str, title: str, description: str = "") -> CModel:
    """The C file and the header of a reduced system with its step; of a whole range of parameters
    with these as variables.

    `name` is that of the model, `title` and `description` are comments. InputError for what has no
    C: functions of Python, and what else runs beside the steps.
    """
    given = Numbers(case) if isinstance(case, Case) else Numbers(case.nominal, case)
    check(given, title)
    kicks = jumps_of(given, title)
    case, memory = at_start(given, title)
    given = replace(given, case=case)
    system = case.system
    controlled = [one.name for one in controllers.controlled_of(system)]
    held = events.held_names(system)
    inputs = {
        name: one for name, one in inputs_of(system).items() if name not in (*controlled, *held)
    }
    places = {name: k for k, name in enumerate([*inputs, *controlled, *held])}
    timed = signals.write_signals(system, places, given)
    v = admissible_velocities(case)
    given_as_they_are = v is system.v0

    def packed(one: Case) -> PackedCase:
        # those that joints have changed follow no parameter
        velocities = one.system.v0 if given_as_they_are else v
        return pack(one, velocities, memory, own_arrays(one, timed))

    base = packed(case)
    changes = numbers.changes_of(base, given, packed, title)
    turning = bool(changes) and len(base.step.arrays.corotation.table) > 0
    known = {*inputs, *numbers.parameters_of(given)}
    acting = controllers.write(system, case.scheme, len(inputs), known)
    known |= {one.name for one in acting.columns}
    happening = events.write(base, known, acting.curves, title)
    own_columns = (*acting.columns, *(happening.columns if happening else ()))
    reading, columns, left_out = outputs.write_outputs(system, own_columns)
    tunable = numbers.tunable_of(given)
    forced = [name for name in inputs if name not in driving_inputs(system)]
    jumping = bool(forced or tunable or controlled or kicks)
    try:
        kernels = print_kernels(
            base,
            *numbers.places_of(base, changes),
            turning,
            acting.rooms,
            jumping,
            bool(kicks),
            happening,
        )
    except OutsideError as error:
        raise InputError(say(title, "a model whose kernels have C", str(error))) from error
    constants, setting = numbers.write(base, given, changes, kernels.printer.memory)
    counts = {
        "UNKNOWNS": system.size, "EQUATIONS": len(system.constraints.names), "SENSORS": len(system.sensors.offset),
        "INPUTS": len(inputs), "PARAMETERS": len(numbers.parameters_of(given)), "DRIVEN": len(places) if driving_inputs(system) else 0,
        "TURNED": sum(bool(one.turns) for one in columns), "LENGTHS": len(base.tables), "WIDTH": base.lengths.signals.shape[1],
        "SIGNALS": len(base.step.state.signals), "TURNING": int(turning), "LOCATING": int(base.step.method.locating),
        **controllers.counts_of(system), "JUMPING": int(jumping), "JUMPS": len(kicks),
        **events.counts_of(system),
    }  # fmt: skip
    before = placed(
        replaced(
            template("inputs.c"),
            {
                "READ": "\n".join(f"    {line}" for line in timed.lines),
                "ROUGH": "\n".join(timed.rough),
                "SEARCH": events.DECLARED if happening else "",
            },
        )
    )
    search = {"SEARCH_OF_EVENTS": happening.text if happening else ""}
    model = replaced(template("model.c"), search)
    behind = placed(
        replaced(
            "\n".join([template("ports.c"), reading, setting, acting.text, model]),
            {f"CALL_{key}": name for key, name in kernels.calls.items()},
        )
    )
    program = PrintedProgram(kernels.printer, f"{before}{APART}{behind}")
    before, behind = program.own.split(APART)
    starts, starting_lines = program.starts(FOUND)
    text = "\n".join(
        [
            before,
            program.code,
            f"static void set_start(NAME_memory *m)\n{{\n{starting_lines}\n}}\n",
            behind,
        ]
    )
    fixed = "\n".join(
        [
            HEAD,
            *(f"#define {key} {number(value)}" for key, value in controls(base).items()),
            *(f"#define {key} {value}" for key, value in (STATUSES | counts).items()),
            tables_of(base, inputs, given),
            *([array("JUMP", "double", kicks)] if kicks else []),
            *([happening.table] if happening else []),
            program.constants,
            *(
                array(key, "double", table.numbers)
                for key, table in (timed.curves | acting.curves).items()
            ),
            constants,
            starts,
            program.structs,
        ]
    )
    head = f'/* {comment(title)}: the equations of NAME.h. */\n#include "NAME.h"\n'
    source = "\n".join([head, fixed, maths(text), text])
    words = {"TITLE": title, "DESCRIPTION": description, "FIELDS": program.declared}
    header = header_of(counts, columns, inputs, given, case.scheme.step, words)
    ports = {key: (one.unit, one.start) for key, one in inputs.items()}
    name = model_name(name, (source, header))
    return CModel(
        name,
        replaced(header, {"NAME": name}),
        re.sub(r"\n{3,}", "\n\n", replaced(source, {"NAME": name})),
        case.scheme.step,
        case.duration,
        numbers.parameters_of(given),
        tunable,
        ports,
        {key: one.range for key, one in inputs.items() if one.range is not None},
        tuple(columns),
        bool(driving_inputs(system)),
        len(system.triggers),
        tuple(one.name for one in happening.columns) if happening else (),
        (*left_out, *(f"monitor '{one.name}'" for one in system.monitors)),
        system,
    )


def placed(text: str) -> str:
    """A text with the arrays of records, written @name@, at their places."""
    return re.sub(r"@(\w+)@", lambda found: region(found[1]), text)


def at_start(given: Numbers, where: str) -> tuple[Case, np.ndarray | None]:
    """The case at the state in which its motion starts, without rows that follow from others, and
    what forces keep there.
    """
    case = given.case
    alone = initial.startable(case.system, case.scheme)
    system = in_dense_unknowns(with_locks(alone), where)
    if len(alone.constraints.row) < len(case.system.constraints.row) and given.varies(
        ("system", "constraints")
    ):
        raise InputError(
            say(
                where,
                "joints of which none follows from others",
                "redundant ones that parameters change",
            )
        )
    if case.scheme.start != "equilibrium":
        return replace(case, system=system), None
    x, v, memory = rest.in_equilibrium(system, case.newton)
    return replace(case, system=replace(system, x0=x, v0=v)), memory


def in_dense_unknowns(system: System, where: str) -> System:
    """The system with dense matrices, as starts in C have them; InputError for a large one."""
    if compiled.storage(system).storage is Storage.DENSE:
        return system
    n = system.size
    if n > LARGEST:
        expected = f"a reduced model, or one of {LARGEST} unknowns at most"
        raise InputError(say(where, expected, f"{n} unknowns", "reduce it with fmbs reduce"))
    return change_coordinates(system, np.eye(n), np.zeros(n))


def own_arrays(case: Case, timed: Timed) -> dict[str, np.ndarray]:
    """Arrays that the program itself reads: rows of outputs, and numbers in functions of time."""
    order = compiled.compile_system(case.system).order
    sensors = case.system.sensors
    return {
        "sensor_rows": as_dense(sensors.matrix)[:, order],
        "sensor_offset": sensors.offset,
        **controllers.numbers_of(case.system),
        **{
            f"varied_{k}": np.atleast_1d(cases.leaf_at(case, place))
            for k, place in enumerate(timed.changed)
        },
    }


def controls(base: PackedCase) -> dict[str, float]:
    """Numbers of the method that the program reads."""
    method = base.step.method
    return {
        "ALPHA_M": method.am, "ALPHA_F": method.af, "GAMMA": method.gamma, "BETA": method.beta, "SHARP": scheme.SHARP,
        "HUGE_NUMBER": HUGE, "FALLING": scheme.FALLING, "LEAST": LEAST, "TINY": touching.TINY, "SAME": jumps.SAME, "AHEAD": pieces.AHEAD,
        "BESIDE": stepping.BESIDE, "LATE": locating.LATE,
    }  # fmt: skip


def tables_of(base: PackedCase, inputs: Mapping[str, Any], given: Numbers) -> str:
    """Tables of a model whose numbers no parameter changes."""
    driving = driving_inputs(base.case.system)
    tunable = numbers.tunable_of(given)
    ranges = [one.range or (-HUGE, HUGE) for one in inputs.values()]
    halvings = [0, *base.lengths.levels.halvings.tolist()]
    return "\n".join(
        [
            array("HALVINGS", "int", halvings),
            numbers.table_of(given),
            array("INPUT_START", "double", [one.start for one in inputs.values()]),
            array("INPUT_LEAST", "double", [low for low, _ in ranges]),
            array("INPUT_MOST", "double", [high for _, high in ranges]),
            array("DRIVES", "int", [name in driving for name in inputs]),
            array("TUNABLE", "int", [name in tunable for name in numbers.parameters_of(given)]),
        ]
    )


def header_of(
    counts: Mapping[str, int],
    columns: Sequence[Column],
    inputs: Mapping[str, Any],
    given: Numbers,
    step: float,
    texts: Mapping[str, str],
) -> str:
    """The header, with the name still to be put in."""
    parameters = numbers.parameters_of(given)
    tunable = numbers.tunable_of(given)
    lengths = {
        "I_": len(inputs) + counts["CONTROLLED"] + counts["LATCHED"],
        "E_": counts["EVENTS"], "C_": counts["CONTROLLED"], "D_": counts["DRIVEN"], "P_": len(parameters),
        "O_": counts["SENSORS"], "T_": counts["TURNED"], "B_": 3 * counts["UNKNOWNS"] + counts["EQUATIONS"],
    }  # fmt: skip
    told = {
        "PARAMETER": [
            (
                key,
                f"[{one[0] or '-'}] {one[1]:g} to {one[2]:g}, {one[3]:g}{', tunable' * (key in tunable)}",
            )
            for key, one in parameters.items()
        ]
    }
    told["INPUT"] = [(key, f"[{one.unit or '-'}]{spanned(one)}") for key, one in inputs.items()]
    told["OUTPUT"] = [(one.name, f"[{one.unit or '-'}]") for one in columns]
    ports = [
        f"#define NAME_{kind}_{word} {k} /* {comment(about)} */"
        for kind, found in told.items()
        for k, (word, (_, about)) in enumerate(
            zip(distinct(key for key, _ in found), found, strict=True)
        )
    ]
    text = re.sub(
        r"\[([A-Z]+_)\]", lambda one: f"[{max(1, lengths[one.group(1)])}]", template("header.h")
    )
    words: dict[str, Any] = {key: comment(value) for key, value in texts.items()} | {
        "VERSION": __version__, "PORTS": "\n".join(ports) + "\n", "N_PARAMETERS": len(parameters), "N_INPUTS": len(inputs),
        "N_OUTPUTS": len(columns), "N_EVENTS": counts["EVENTS"], " STEP ": f" {number(step)} ",
    }  # fmt: skip
    return replaced(text, words | {"FIELDS": texts["FIELDS"]})


def spanned(one: Input) -> str:
    """The range of an input as a comment, outside of which a model was not trained."""
    return "" if one.range is None else f" trained from {one.range[0]:g} to {one.range[1]:g}"
