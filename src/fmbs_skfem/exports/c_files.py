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
from functools import partial
from itertools import chain, count, pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse.csgraph import connected_components

from .. import __version__
from ..core.algebra.linalg import as_dense
from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.inputs import Input
from ..dynamics import initial, rest, scheme
from ..dynamics.compiled_step import jumps, settling, stepping, touching
from ..reduction.affine import ParametricCase
from ..reduction.cases import Case
from ..systems import compiled
from ..systems.layouts import Storage
from ..systems.signals import driving_inputs, inputs_of
from ..systems.system import System
from ..systems.terms import turning
from ..systems.terms.turning import Turning
from . import forces, numbers, outputs, refusals, signals, terms
from .numbers import Numbers
from .outputs import Column
from .pieces import Array, CodePiece, joined
from .text import array, comment, maths, number, replaced, template

HUGE = 1e300
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
    inputs: Mapping[str, tuple[str, float]]  #: unit and start value by name
    ranges: Mapping[str, tuple[float, float]]  #: of the inputs that have one
    columns: tuple[Column, ...]  #: outputs
    drives: bool  #: whether inputs drive joints, by which there are no derivatives
    left_out: tuple[str, ...]  #: columns that the model has and a C file has not


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
    own = found.lower() in HEADERS | DEVICES or any(
        re.search(rf"\b{found}_", text) for text in code
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
    """InputError for what a C file cannot do, and a notice where it does it less well: loads that
    jump within a step.
    """
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
    if jumping := jumps.jumps_of_loads(
        system, case.scheme.step, scheme.steps_in(case.scheme, case.duration)
    ):
        first = min(before for places in jumping.values() for _, before, _ in places)
        text = f"{where}: loads jump, first at t = {first:.6g} s; C files take them at the ends of steps, late by up to one of them"
        notify(f"{text}, where runs end a step at each jump")


def blocks_of(system: System, pairs: np.ndarray) -> np.ndarray:
    """First unknowns (b + 1,) of blocks that nothing but joints couples; `pairs` (h, 2) are probe
    rows with second derivatives.
    """
    n = system.size
    near = np.zeros((n, n), bool)
    for A in (system.mass, system.damping, system.stiffness):
        near |= as_dense(A) != 0.0
    for elastic in system.elastic:
        columns = getattr(elastic.gather, "columns", slice(0, n))
        near[columns, columns] = True
    P = abs(as_dense(system.probes.matrix)) > 0.0
    for i, j in pairs:
        near |= np.outer(P[i], P[j]) | np.outer(P[j], P[i])
    count, of = connected_components(near, directed=False)
    last = np.array([np.flatnonzero(of == k)[-1] for k in range(count)])
    # ranges of unknowns: components that lie in each other are one
    ends = []
    reach = -1
    for k in range(n):
        reach = max(reach, last[of[k]])
        if k == reach:
            ends.append(k + 1)
    return np.array([0, *ends])


def by_blocks(blocks: np.ndarray, A: Any) -> np.ndarray:
    """The blocks of a symmetric matrix (n, n), column by column, behind each other."""
    A = as_dense(A)
    return np.concatenate([np.zeros(0), *(A[a:b, a:b].T.ravel() for a, b in pairwise(blocks))])


class Frame(NamedTuple):
    """What the parts of a C file have to know of its system."""

    case: Case
    blocks: np.ndarray  #: (b + 1,) first unknowns
    places: np.ndarray  #: (b + 1,) first entries of the blocks in W
    smooth: bool
    damped: bool

    def place(self, first: int) -> tuple[int, int]:
        """Entry of the diagonal of an unknown in W, and the size of its block."""
        b = int(np.searchsorted(self.blocks, first, side="right")) - 1
        size = int(self.blocks[b + 1] - self.blocks[b])
        return int(self.places[b] + (first - self.blocks[b]) * (size + 1)), size


def frame_of(case: Case, where: str) -> Frame:
    """Blocks of a system, and what its forces are like; InputError where W is not dense, or
    singular beside joints.
    """
    system = case.system
    _, _, pushing, pairs = compiled.attached(system)
    layout = compiled.storage(system)
    blocks = blocks_of(system, pairs)
    if layout.loose:
        remedy = "third axes of rims of thin plates have none: take places without a rim"
        raise InputError(
            say(
                where,
                "unknowns that all have mass or stiffness",
                "some that joints alone determine",
                remedy,
            )
        )
    if layout.storage is not Storage.DENSE:
        raise InputError(
            say(where, "a reduced model of dense unknowns", layout.storage.name.lower())
        )
    places = np.concatenate([[0], np.cumsum(np.diff(blocks) ** 2)])
    return Frame(
        case, blocks, places, all(one.smooth for one in pushing), any(one.damped for one in pushing)
    )


def write(case: Case | ParametricCase, name: str, title: str, description: str = "") -> CModel:
    """The C file and the header of a reduced system with its step; of a whole range of parameters
    with these as variables.

    `name` is that of the model, `title` and `description` are comments. InputError for what has no
    C: functions of Python, events, contact, and joints by a law.
    """
    given = Numbers(case) if isinstance(case, Case) else Numbers(case.nominal, case)
    check(given, title)
    case, memory = at_start(given, title)
    given = replace(given, case=case)
    system = case.system
    frame = frame_of(case, title)
    inputs = inputs_of(system)
    pieces = [write_elastic(frame, given, k) for k in range(len(system.elastic))]
    for k, force in enumerate(system.loads.forces):
        pieces.append(forces.write_force(force, k, sum(one.kept for one in pieces), given))
    reading, columns, left_out = outputs.write_outputs(system)
    numbered = {one: k for k, one in enumerate(inputs)}
    timed = signals.write_signals(system, numbered, given)
    whole = joined([*pieces, timed])
    turn = turning.turning_of(system)
    turn = (
        None
        if turn is None or given.varies(("system", "x0")) or given.varies(("system", "lift"))
        else turn
    )
    arrays = {
        **arrays_of(frame),
        "START_KEPT": Array(np.zeros(whole.kept) if memory is None else memory),
        **whole.arrays,
    }
    constants, fields, setting = numbers.write(given, arrays, title)
    parts = [*whole.functions.values(), hooks(whole, len(system.elastic))]
    text = "\n".join(
        [template("begin.c"), *parts, template("ports.c"), reading, stepped(), energies(whole)]
    )
    text = "\n".join([text, setting, template("start.c")])
    fixed = "\n".join(
        [
            controls(frame, whole, columns, inputs, given, turn),
            tables_of(frame, inputs, given, turn),
            constants,
        ]
    )
    head = f'/* {comment(title)}: the equations of NAME.h. */\n#include "NAME.h"\n'
    source = "\n".join([head, fixed, maths(text), text])
    header = header_of(
        frame,
        whole,
        columns,
        inputs,
        given,
        turn,
        {"TITLE": title, "DESCRIPTION": description, "NUMBERS": fields},
    )
    ports = {key: (one.unit, one.start) for key, one in inputs.items()}
    name = model_name(name, (source, header))
    return CModel(
        name,
        replaced(header, {"NAME": name}),
        re.sub(r"\n{3,}", "\n\n", replaced(source, {"NAME": name})),
        case.scheme.step,
        case.duration,
        numbers.parameters_of(given),
        ports,
        {key: one.range for key, one in inputs.items() if one.range is not None},
        tuple(columns),
        bool(driving_inputs(system)),
        tuple(left_out),
    )


def at_start(given: Numbers, where: str) -> tuple[Case, np.ndarray | None]:
    """The case at the state in which its motion starts, without rows that follow from others, and
    what forces keep there.
    """
    case = given.case
    system = initial.startable(case.system, case.scheme)
    if len(system.constraints.row) < len(case.system.constraints.row) and given.varies(
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


def write_elastic(frame: Frame, given: Numbers, k: int) -> CodePiece:
    """An elastic term in C."""
    system = frame.case.system
    one = system.elastic[k]
    leaf = ("system", "elastic", k)
    setting = terms.TermPlace(
        k,
        one.name,
        system.dim,
        one.beta,
        system.lift,
        frame.place,
        leaf,
        given.varies((*leaf, "beta")),
    )
    return terms.write_term(one.gather, setting)


def arrays_of(frame: Frame) -> dict[str, Array]:
    """Constant numbers of the system beside those of its parts."""
    system = frame.case.system
    P = as_dense(system.probes.matrix)
    begins, ends = support(P)

    def of(*place: str, make: Callable[[Any], np.ndarray] = as_dense) -> Array:
        leaf: Any = system
        for one in place:
            leaf = getattr(leaf, one)
        return Array(make(leaf), ("system", *place), make)

    def rows(P: np.ndarray) -> np.ndarray:
        return np.concatenate(
            [np.zeros(0), *(row[a:b] for row, a, b in zip(as_dense(P), begins, ends, strict=True))]
        )

    square = partial(by_blocks, frame.blocks)
    return {
        "MASS": of("mass", make=square),
        "DAMPING": of("damping", make=square)
        if as_dense(system.damping).any()
        else Array(np.zeros(0)),
        "SPRINGS": of("stiffness", make=square)
        if as_dense(system.stiffness).any()
        else Array(np.zeros(0)),
        "LOAD": of("loads", "constant"),
        "PROBE_ROWS": of("probes", "matrix", make=rows),
        "PROBE_OFFSET": of("probes", "offset"),
        "TERM_VALUE": of("constraints", "coefficient"),
        "SENSOR_ROWS": of("sensors", "matrix"),
        "SENSOR_OFFSET": of("sensors", "offset"),
        "START_X": of("x0"),
        "START_V": start_velocities(frame),
        "NORM": Array(as_dense(system.metric).diagonal() / system.weight),
    }


def start_velocities(frame: Frame) -> Array:
    """v0, or where joints are against it what they leave of it."""
    system = frame.case.system
    _, gap = initial.velocity_gaps(system, frame.case.scheme)
    if np.abs(gap).max(initial=0.0) <= initial.ROUND_OFF * initial.speed_of(system.v0):
        return Array(system.v0, ("system", "v0"))
    return Array(initial.admissible(system, frame.case.scheme)[1])


def hooks(whole: CodePiece, elastic: int) -> str:
    """The functions by which the step reaches all parts."""

    def function(head: str, calls: Iterable[str], *arguments: str) -> str:
        body = "\n".join(f"    {one}" for one in calls)
        unread = [
            f"    (void){one};" for one in ("m", *arguments) if not re.search(rf"\b{one}\b", body)
        ]
        return "\n".join([f"static void {head}", "{", *unread, *([body] if body else []), "}\n"])

    one_by_one = [
        f"case {k}: {call} break;" for k, call in enumerate(whole.calls["tangent"][:elastic])
    ]
    return "\n".join(
        [
            function("elastic_forces(NAME_memory *m)", whole.calls["force"]),
            function("elastic_tangents(NAME_memory *m, int held)", whole.calls["tangent"], "held"),
            function(
                "elastic_tangent(NAME_memory *m, int part)",
                ["const int held = 0;", "switch (part) {", *one_by_one, "}"],
            )
            if one_by_one
            else function("elastic_tangent(NAME_memory *m, int part)", [], "part"),
            function("push_rows(NAME_memory *m)", whole.calls["push"]),
            function("push_slopes(NAME_memory *m)", whole.calls["slopes"]),
            function("keep_forces(NAME_memory *m)", whole.calls["accept"]),
            function("read_signals(NAME_memory *m, double t)", whole.calls["signals"], "t"),
        ]
    )


def stepped() -> str:
    """The time step; a step that fails is divided as that of `dynamics` is."""
    trials = ", ".join(
        f"{{{halvings}, {int(judging)}}}" for halvings, judging in touching.TRIALS[1:]
    )
    return template("step.c").replace("PARTS_OF_TRIALS", trials)


def energies(whole: CodePiece) -> str:
    """Kinetic energy, and that of strains and springs."""
    return template("energies.c").replace(
        "    ENERGIES\n", "".join(f"    {one}\n" for one in whole.calls["energy"])
    )


def controls(
    frame: Frame,
    whole: CodePiece,
    columns: Sequence[Column],
    inputs: Mapping[str, Any],
    given: Numbers,
    turn: Turning | None,
) -> str:
    """Numbers of the method and of the iteration, and sizes."""
    case = frame.case
    system = frame.case.system
    method = scheme.method_for(case.scheme, case.newton, case.scheme.step, system, dense=True)
    own = system.constraints
    reals = {
        "ALPHA_M": method.am, "ALPHA_F": method.af, "GAMMA": method.gamma, "BETA": method.beta, "TOLERANCE": method.tolerance,
        "SLOW": method.slow, "ROUND_OFF": method.floor, "SHARP": scheme.SHARP, "SHARE": method.share, "UNSEEN": method.unseen,
        "FLOOR": stepping.FLOOR, "SURELY": stepping.SURELY,
        "CLEAR": stepping.CLEAR, "CHEAP": stepping.CHEAP, "OLD": settling.OLD, "HUGE_NUMBER": HUGE, "PROOF": turning.PROOF,
        "ALIKE": turning.ALIKE,
        "GAIN": stepping.GAIN, "NEAR": stepping.NEAR, "SHRINKS": stepping.SHRINKS, "UNCERTAIN": stepping.UNCERTAIN,
    }  # fmt: skip
    steady = not own.laws and not (own.j >= 0).any() and not (own.signal >= 0).any()
    counts = {
        "UNKNOWNS": system.size, "EQUATIONS": len(own.names), "PROBES": len(system.probes.offset),
        "SENSORS": len(system.sensors.offset), "SIGNALS": len(system.signals), "INPUTS": len(inputs),
        "PARAMETERS": len(numbers.parameters_of(given)), "KEPT": whole.kept, "TERMS": len(own.row),
        "DRIVEN": len(inputs) if driving_inputs(system) else 0,
        "TURNED": sum(bool(one.turns) for one in columns), "BLOCKS": len(frame.blocks) - 1, "ENTRIES": frame.places[-1],
        "SECANTS": secants_of(system), "ITERATIONS": method.iterations, "PATIENT": stepping.PATIENT,
        "HELD": stepping.HELD if whole.holds else 0,
        "MANY": stepping.MANY,
        "TRIALS": len(touching.TRIALS) - 1,
        "SMOOTH": int(frame.smooth), "STEADY": int(steady), "READS_RATES": int(frame.damped),
        "HAS_DAMPING": int(as_dense(system.damping).any()), "HAS_SPRINGS": int(as_dense(system.stiffness).any()),
        "FILTERED": int(initial.is_filtered(system)), "MASSLESS": int(initial.has_massless_directors(system)),
        "TURNING": 0 if turn is None else len(turn.table),
    }  # fmt: skip
    lines = [f"#define {key} {number(value)}" for key, value in reals.items()]
    lines += [f"#define {key} {int(value)}" for key, value in counts.items()]
    return "\n".join([*lines, "#define ROOM(n) ((n) > 0 ? (n) : 1)", ""])


def secants_of(system: System) -> int:
    return initial.SECANTS if scheme.are_factors_dear(system, dense=True) else 0


def tables_of(frame: Frame, inputs: Mapping[str, Any], given: Numbers, turn: Turning | None) -> str:
    """Tables of a system whose numbers no parameter changes."""
    own = frame.case.system.constraints
    P = as_dense(frame.case.system.probes.matrix)
    begins, ends = support(P)
    lines = [
        array("BLOCK", frame.blocks, "int"), array("BLOCK_AT", frame.places, "int"),
        array("PROBE_FIRST", np.concatenate([[0], np.cumsum(ends - begins)]), "int"), array("PROBE_BEGIN", begins, "int"),
        table("TERM", np.stack([own.row, own.signal, own.i, own.j], axis=1)), numbers.table_of(given),
        array("INPUT_START", np.array([one.start for one in inputs.values()])),
        array("INPUT_LEAST", np.array([(one.range or (-HUGE, HUGE))[0] for one in inputs.values()])),
        array("INPUT_MOST", np.array([(one.range or (-HUGE, HUGE))[1] for one in inputs.values()])),
        array("DRIVES", np.array([name in driving_inputs(frame.case.system) for name in inputs], int), "int"),
    ]  # fmt: skip
    rows, at, places, beta = np.zeros((0, 3), int), np.zeros(0), np.zeros(0), np.zeros(0)
    offset = np.zeros(0)
    if turn is not None:
        rows = np.array([[count, *frame.place(first)] for first, count, _ in turn.table.tolist()])
        at, offset = turn.rows, turn.offset
        places = turn.places
        beta = np.array([one.beta for one in frame.case.system.elastic])
    return "\n".join(
        [
            *lines,
            table("TURN", rows),
            array("TURN_ROWS", at),
            array("TURN_OFFSET", offset),
            array("TURN_PLACES", places),
            array("TURN_BETA", beta),
        ]
    )


def header_of(
    frame: Frame,
    whole: CodePiece,
    columns: Sequence[Column],
    inputs: Mapping[str, Any],
    given: Numbers,
    turn: Turning | None,
    texts: Mapping[str, str],
) -> str:
    """The header, with the name still to be put in."""
    system = frame.case.system
    m = len(frame.case.system.constraints.names)
    parameters = numbers.parameters_of(given)
    lengths = {
        "N_": system.size, "M_": m, "I_": len(inputs),
        "D_": len(inputs) if driving_inputs(system) else 0, "P_": len(parameters), "K_": whole.kept, "S_": 4 * len(system.signals),
        "R_": system.size + m, "J_": len(system.probes.offset), "O_": len(system.sensors.offset), "ROOM_": whole.room,
        "MODULI_": whole.moduli, "ENTRIES_": frame.places[-1], "MM_": m**2, "Q_": secants_of(system),
        "T_": sum(bool(one.turns) for one in columns), "C_": 0 if turn is None else 3 * int((turn.table[:, 1] ** 2).sum()),
    }  # fmt: skip
    told = {
        "PARAMETER": [
            (key, f"[{one[0] or '-'}] {one[1]:g} to {one[2]:g}, {one[3]:g}")
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
        "N_OUTPUTS": len(columns), " STEP ": f" {number(frame.case.scheme.step)} ",
    }  # fmt: skip
    return replaced(text, words | {"NUMBERS": texts["NUMBERS"]})


def spanned(one: Input) -> str:
    """The range of an input as a comment, outside of which a model was not trained."""
    return "" if one.range is None else f" trained from {one.range[0]:g} to {one.range[1]:g}"


def table(name: str, rows: np.ndarray) -> str:
    """Rows of whole numbers."""
    some = rows if len(rows) else np.zeros((1, rows.shape[1]), int)
    lines = ",\n    ".join("{" + ", ".join(map(str, row)) + "}" for row in some.tolist())
    return f"static const int {name}[{len(some)}][{rows.shape[1]}] = {{\n    {lines}}};"


def support(P: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the numbers of every row begin and end that are not zero."""
    on = [np.flatnonzero(row) for row in P]
    return np.array([one[0] if len(one) else 0 for one in on], int), np.array(
        [one[-1] + 1 if len(one) else 0 for one in on], int
    )
