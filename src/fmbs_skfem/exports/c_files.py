"""A reduced model as one C99 file and one header: the equations of a system, written out, and the time step of `dynamics`.

    [ c W  J^T ; J  0 ] (dq, dlambda) = - (c (M q'' + C q' + K q + f - Q) + J^T lambda, Phi)

Everything has a fixed size, no library is called, and all memory is in one struct. The step accepts corrections as that of
`dynamics.compiled_step.stepping` does, so that both go the same way but for round-off.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

from .. import __version__
from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..dynamics import initial, scheme
from ..dynamics.compiled_step import settling, stepping
from ..dynamics.scheme import SHARP
from ..reduction.cases import Case
from ..systems import compiled
from ..systems.compiled import Compiled
from ..systems.layouts import Storage
from ..systems.signals import inputs_of
from ..systems.system import System
from . import forces, outputs, signals, terms
from .outputs import Column
from .pieces import Piece, joined
from .text import array, maths, number, replaced, template

HUGE = 1e300


@dataclass(frozen=True)
class CModel:
    """A model in C: its two texts, and its ports."""

    name: str  #: of the model and of its files, a C identifier
    header: str
    source: str
    step: float  #: [s]
    parameters: Mapping[str, tuple[str, float, float, float]]  #: unit, least, largest and nominal value by name
    inputs: Mapping[str, tuple[str, float]]  #: unit and start value by name
    columns: tuple[Column, ...]  #: outputs
    left_out: tuple[str, ...]  #: columns that the model has and a C file has not


def identifier(name: str) -> str:
    """A name that C knows: letters, digits and _."""
    found = re.sub(r"\W", "_", name, flags=re.ASCII).strip("_") or "model"
    return f"model_{found}" if found[0].isdigit() else found


def check(system: System, where: str) -> None:
    """InputError for what a C file cannot do."""
    if not isinstance(system.mass, np.ndarray) and system.size > 0 and len(system.components) == 0 and system.elastic:
        raise InputError(say(where, "a reduced model", "a full one", "reduce it with fmbs reduce"))
    for what, there in (("events", system.triggers), ("joints that are let loose", system.locks), ("monitors", system.monitors)):
        if there:
            raise InputError(say(where, f"a model without {what}", f"{len(there)}", "leave them out of the scene"))
    if system.constraints.laws:
        names = sorted({own.law.name.partition("|")[0] for own in system.constraints.laws})
        raise InputError(say(where, "joints that are polynomials of positions", f"the joint law {', '.join(names)}"))


def blocks_of(model: Compiled) -> np.ndarray:
    """First unknowns (b + 1,) of blocks that nothing but joints couples."""
    system, n = model.system, model.system.size
    near = sum((np.asarray(abs(dense(A)) > 0.0) for A in (system.mass, system.damping, system.stiffness)), np.zeros((n, n), bool))
    for elastic in system.elastic:
        columns = getattr(elastic.gather, "columns", slice(0, n))
        near[columns, columns] = True
    P = abs(dense(system.probes.matrix)) > 0.0
    for i, j in model.pairs:
        near |= np.outer(P[i], P[j]) | np.outer(P[j], P[i])
    count, of = connected_components(near, directed=False)
    last = np.array([np.flatnonzero(of == k)[-1] for k in range(count)])
    # ranges of unknowns: components that lie in each other are one
    ends, reach = [], -1
    for k in range(n):
        reach = max(reach, last[of[k]])
        if k == reach:
            ends.append(k + 1)
    return np.array([0, *ends])


def dense(A: Any) -> np.ndarray:
    return A if isinstance(A, np.ndarray) else A.toarray()


def by_blocks(A: Any, blocks: np.ndarray) -> np.ndarray:
    """The blocks of a symmetric matrix (n, n), column by column, behind each other."""
    A = dense(A)
    return np.concatenate([np.zeros(0), *(A[a:b, a:b].T.ravel() for a, b in pairwise(blocks))])


def write(case: Case, name: str, title: str, description: str = "") -> CModel:
    """The C file and the header of a case, a reduced system with its step.

    `name` is that of the model, `title` and `description` are comments. InputError for what has no C: functions of Python, events,
    contact, and joints by a law.
    """
    system = case.system
    check(system, title)
    name = identifier(name)
    model = compiled.compile_system(system)
    method = scheme.method_of(case.scheme, case.newton, case.scheme.step, model)
    blocks = blocks_of(model)
    sizes = np.diff(blocks)
    places = np.concatenate([[0], np.cumsum(sizes**2)])

    def place(first: int) -> tuple[int, int]:
        b = int(np.searchsorted(blocks, first, side="right")) - 1
        return int(places[b] + (first - blocks[b]) * (sizes[b] + 1)), int(sizes[b])

    found = [
        terms.write_term(
            one.gather, terms.Setting(k, one.name, system.dim, one.beta, system.lift, place, ("system", "elastic", k, "gather"))
        )
        for k, one in enumerate(system.elastic)
    ]
    kept = 0
    for k, force in enumerate(system.loads.forces):
        found.append(forces.write_force(force, k, kept, title))
        kept += found[-1].kept
    whole, given = joined(found), inputs_of(system)
    numbers = {one: k for k, one in enumerate(given)}
    reading, columns, left_out, rows, offsets = outputs.write_outputs(system)
    fixed = constants(model, case, method, blocks, places, place, whole, (rows, offsets), given, columns)
    words = {"NAME": name}
    parts = [
        *(array(key, one.values) for key, one in whole.arrays.items()),
        *whole.functions.values(),
        hooks(whole),
        signals.write_signals(system, numbers),
    ]
    before, after = split_template()
    text = "\n".join([before, *parts, template("ports.c"), energies(whole), reading, after, template("start.c")])
    helpers = maths(text)
    head = f'/* {title}: the equations of NAME.h. */\n#include "NAME.h"\n'
    source = replaced("\n".join([head, fixed, helpers, text]), words)
    source = re.sub(r"\n{3,}", "\n\n", source)
    ports = [f"#define NAME_INPUT_{identifier(one).upper()} {k} /* [{given[one].unit or '-'}] */" for one, k in numbers.items()]
    ports += [f"#define NAME_OUTPUT_{identifier(one.name).upper()} {k} /* [{one.unit or '-'}] */" for k, one in enumerate(columns)]
    lengths = {
        "N_": system.size, "M_": model.constraints, "I_": len(given), "P_": 0, "K_": whole.kept, "S_": 4 * len(system.signals),
        "R_": system.size + model.constraints, "J_": len(system.probes.offset), "O_": len(offsets), "ROOM_": whole.room,
        "MODULI_": whole.moduli, "ENTRIES_": places[-1], "MM_": model.constraints**2, "Q_": secants_of(model),
        "T_": sum(bool(one.turns) for one in columns),
    }  # fmt: skip
    header = re.sub(r"\[([A-Z]+_)\]", lambda one: f"[{max(1, lengths[one.group(1)])}]", template("header.h"))
    header = replaced(
        header,
        {
            "TITLE": clean(title), "DESCRIPTION": clean(description), "VERSION": __version__, "PORTS": "\n".join(ports) + "\n",
            "N_PARAMETERS": 0, "N_INPUTS": len(given), "N_OUTPUTS": len(columns), " STEP ": f" {number(case.scheme.step)} ",
        },
    )  # fmt: skip
    header = replaced(header, words)
    ports_of = {one: (source_.unit, source_.start) for one, source_ in given.items()}
    return CModel(name, header, source, case.scheme.step, {}, ports_of, tuple(columns), tuple(left_out))


def clean(text: str) -> str:
    """A text that ends no comment."""
    return text.replace("*/", "* /").replace("\n", "\n * ")


def split_template() -> tuple[str, str]:
    """What of `step.c` stands before the parts of a system, and what behind them."""
    text = template("step.c")
    cut = text.index("/* Numbers of the method")
    pair = text.index("/* W += P^T H P of one pair")
    end = text.index("/* Factors of W at the trial state")
    return text[:cut] + text[pair:end], text[cut:pair] + text[end:]


def hooks(whole: Piece) -> str:
    """The functions by which the step reaches all parts."""

    def function(head: str, calls: tuple[str, ...], unread: str = "(void)m;") -> str:
        return "\n".join([head, "{", *(f"    {one}" for one in calls or (unread,)), "}\n"])

    held = "held" in " ".join(whole.calls["tangent"])
    return "\n".join(
        [
            function("static void elastic_forces(NAME_memory *m)", whole.calls["force"]),
            function(
                "static void elastic_tangents(NAME_memory *m, int held)",
                (*whole.calls["tangent"], *(() if held else ("(void)held;",))),
                "(void)m;\n    (void)held;",
            )
            if whole.calls["tangent"]
            else function("static void elastic_tangents(NAME_memory *m, int held)", (), "(void)m;\n    (void)held;"),
            function("static void push_rows(NAME_memory *m)", whole.calls["push"]),
            function("static void push_slopes(NAME_memory *m)", whole.calls["slopes"]),
            function("static void keep_forces(NAME_memory *m)", whole.calls["accept"]),
        ]
    )


def energies(whole: Piece) -> str:
    """Kinetic energy, and that of strains and springs."""
    lines = "\n".join(f"    {one}" for one in whole.calls["energy"])
    return f"""static double quadratic(const double *A, const double *x)
{{
    double total = 0.0;
    for (int b = 0; b < BLOCKS; b++) {{
        const int first = BLOCK[b], size = BLOCK[b + 1] - first;
        for (int j = 0; j < size; j++)
            total += 0.5 * x[first + j] * dot(A + j * size, x + first, size);
        A += size * size;
    }}
    return total;
}}

static double kinetic_energy(NAME_memory *m)
{{
    return quadratic(MASS, m->v);
}}

static double strain_energy(NAME_memory *m)
{{
    double energy = HAS_SPRINGS ? quadratic(SPRINGS, m->x) : 0.0;
{lines}
    return energy;
}}
"""


def secants_of(model: Compiled) -> int:
    return initial.SECANTS if model.arrays.dense and scheme.has_dear_factors(model) else 0


def constants(
    model: Compiled,
    case: Case,
    method: Any,
    blocks: np.ndarray,
    places: np.ndarray,
    place: Callable[[int], tuple[int, int]],
    whole: Piece,
    sensors: tuple[np.ndarray, np.ndarray],
    given: Mapping[str, Any],
    columns: list[Column],
) -> str:
    """Numbers of a model as constants of C."""
    system, m = model.system, model.constraints
    if model.layout.storage is not Storage.DENSE:
        raise InputError(say("C file", "a reduced model of dense unknowns", str(model.layout.storage.name).lower()))
    start = initial.consistent_start(model, case.scheme)
    first = initial.first_state(model, start, method.c)
    order = np.argsort(model.order)
    P = dense(system.probes.matrix)
    begins, ends = support(P)
    numbers = {
        "ALPHA_M": method.am, "ALPHA_F": method.af, "GAMMA": method.gamma, "BETA": method.beta, "TOLERANCE": method.tolerance,
        "SLOW": method.slow, "ROUND_OFF": method.floor, "SHARP": SHARP, "SHARE": method.share, "UNSEEN": method.unseen,
        "LARGEST_MASS": float(dense(system.mass).diagonal().max(initial=0.0)), "FLOOR": stepping.FLOOR, "SURELY": stepping.SURELY,
        "CLEAR": stepping.CLEAR, "CHEAP": stepping.CHEAP, "OLD": settling.OLD, "HUGE_NUMBER": HUGE,
    }  # fmt: skip
    own = system.constraints
    steady = not own.laws and not (own.j >= 0).any() and not (own.signal >= 0).any()
    counts = {
        "UNKNOWNS": system.size, "EQUATIONS": m, "PROBES": len(P), "SENSORS": len(sensors[1]), "SIGNALS": len(system.signals),
        "INPUTS": len(given), "PARAMETERS": 0, "KEPT": whole.kept, "TERMS": len(own.row),
        "TURNED": sum(bool(one.turns) for one in columns),
        "BLOCKS": len(blocks) - 1, "ENTRIES": places[-1], "SECANTS": secants_of(model), "ITERATIONS": method.iterations,
        "PATIENT": stepping.PATIENT, "HELD": stepping.HELD, "SMOOTH": int(model.arrays.forces.smooth), "STEADY": int(steady),
        "READS_RATES": int(model.arrays.forces.damped), "HAS_DAMPING": int(dense(system.damping).any()),
        "HAS_SPRINGS": int(dense(system.stiffness).any()),
    }  # fmt: skip
    norm = dense(system.metric).diagonal() / system.weight
    arrays = [
        array("BLOCK", blocks, "int"), array("BLOCK_AT", places, "int"), array("MASS", by_blocks(system.mass, blocks)),
        array("DAMPING", by_blocks(system.damping, blocks) if counts["HAS_DAMPING"] else np.zeros(0)),
        array("SPRINGS", by_blocks(system.stiffness, blocks) if counts["HAS_SPRINGS"] else np.zeros(0)),
        array("LOAD", system.loads.constant), array("NORM", norm),
        array("PROBE_FIRST", np.concatenate([[0], np.cumsum(ends - begins)]), "int"), array("PROBE_BEGIN", begins, "int"),
        array("PROBE_ROWS", np.concatenate([np.zeros(0), *(row[a:b] for row, a, b in zip(P, begins, ends, strict=True))])),
        array("PROBE_OFFSET", system.probes.offset),
        table("TERM", np.stack([own.row, own.signal, own.i, own.j], axis=1)), array("TERM_VALUE", own.coefficient),
        array("SENSOR_ROWS", sensors[0]), array("SENSOR_OFFSET", sensors[1]),
        "static const double PARAMETER[1][3] = {{0.0, 0.0, 0.0}};",
        array("INPUT_START", np.array([one.start for one in given.values()])),
        array("START_X", first.x[order]), array("START_V", first.v[order]), array("START_ALGORITHMIC", first.a[order]),
        array("START_ACCELERATION", first.acceleration[order]), array("START_MULTIPLIERS", start.multipliers),
        array("START_KEPT", first.memory),
    ]  # fmt: skip
    turn, counts["TURNING"] = model.arrays.corotation, len(model.arrays.corotation.table)
    rows = np.array([[count, *place(first)] for first, count, _ in turn.table.tolist()], int).reshape(-1, 3)
    arrays += [
        table("TURN", rows), array("TURN_ROWS", turn.rows[:, :, order]), array("TURN_OFFSET", turn.offset),
        array("TURN_BETA", turn.beta), array("TURNED_TANGENTS", turn.numbers),
    ]  # fmt: skip
    text = [*(f"#define {key} {number(value)}" for key, value in numbers.items())]
    text += [f"#define {key} {int(value)}" for key, value in counts.items()]
    return "\n".join([*text, "#define ROOM(n) ((n) > 0 ? (n) : 1)", "", *arrays, ""])


def table(name: str, rows: np.ndarray) -> str:
    """Rows of whole numbers."""
    some = rows if len(rows) else np.zeros((1, rows.shape[1]), int)
    lines = ",\n    ".join("{" + ", ".join(map(str, row)) + "}" for row in some.tolist())
    return f"static const int {name}[{len(some)}][{rows.shape[1]}] = {{\n    {lines}}};"


def support(P: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the numbers of every row begin and end that are not zero."""
    on = [np.flatnonzero(row) for row in P]
    return np.array([one[0] if len(one) else 0 for one in on], int), np.array([one[-1] + 1 if len(one) else 0 for one in on], int)
