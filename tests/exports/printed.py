"""Packed steps of models, printed as C and compiled, beside those that numba compiles."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fmbs_skfem.core.algebra import small
from fmbs_skfem.core.compiling import jit, programs
from fmbs_skfem.core.compiling.structs import address_of
from fmbs_skfem.core.printing.memory import PackedMemory
from fmbs_skfem.core.printing.printer import KernelPrinter
from fmbs_skfem.core.printing.program import PrintedProgram, region
from fmbs_skfem.core.printing.values import ZERO, Const, Scalar, Struct
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integration, scheme
from fmbs_skfem.dynamics.compiled_step import stepping
from fmbs_skfem.dynamics.compiled_step.packing import METHOD, Lengths
from fmbs_skfem.dynamics.compiled_step.step import NUMBER, Method, State, Step
from fmbs_skfem.dynamics.histories import leading_signals
from fmbs_skfem.dynamics.initial import begin_steps
from fmbs_skfem.dynamics.observers import RunSetting
from fmbs_skfem.dynamics.run import OpenRun
from fmbs_skfem.exports.c_files import HEAD
from fmbs_skfem.exports.text import maths
from fmbs_skfem.systems import System, row_programs
from tests.exports.c_library import compiled

OWN = """
void begin(NAME_memory *m) {
STARTS
}
unsigned long size(void) { return sizeof(NAME_memory); }
int take(NAME_memory *m, const double *signals) {
    for (int i = 0; i < COUNT; i++)
        SIGNALS[i] = signals[i];
    const whole status = TAKE;
    COUNT_STEP
    return (int)status;
}
double *position(NAME_memory *m) { return STATE; }
long long corrections(NAME_memory *m) { return COUNTERS[1]; }
"""
#: what a step in parts calls: signals that are one history, and coefficients
FORWARD = """
whole signals(NAME_memory *m, whole count);
whole set_span(NAME_memory *m, whole more);
"""
LENGTHS = """
whole signals(NAME_memory *m, whole count) {
    for (int k = 0; k < (count ? count : 1); k++) {
        const double t = SPANS[2] + SPANS[3] * (count ? (k + 1.0) / count : 0.0);
        (void)t;
        HISTORY;
    }
    FOUND[0] = count ? count : 1;
    return 0;
}
whole set_span(NAME_memory *m, whole more) {
    (void)more;
    for (int k = 0; k < TRIALS; k++) {
        const double h = SPANS[1] / (1 << HALVINGS[k]);
        const KIND one = NUMBERS;
        m->method_h[k + 1] = one.n0;
        m->method_bh[k + 1] = one.n1;
        m->method_gh[k + 1] = one.n2;
        m->method_c[k + 1] = one.n3;
        m->method_sharp[k + 1] = one.n4;
        m->method_allowed[k + 1] = ALLOWED;
    }
    return 0;
}
"""


def opened(system: System, scheme: GeneralizedAlpha, steps: int) -> OpenRun:
    """A run at its start, and the row that its steps take their signals from."""
    run = integration.begun(
        RunSetting(system, scheme, Newton(), steps, system), np.arange(steps + 1)
    )
    begin_steps(run.step.state)
    return run


class Calls:
    """The kernels of a step of a run, and the calls of them in C; `row` has its signals.

    With lengths of parts it goes from touch to touch: all of them share the row.
    """

    def __init__(self, run: OpenRun, row: np.ndarray) -> None:
        run.packed.give(row, np.array([-1]))
        mutable = {"job_signals"}
        while wrong := self.print(run, mutable):
            mutable |= wrong

    def print(self, run: OpenRun, mutable: set[str]) -> set[str]:
        """Names of regions of which numbers were taken for known ones that are not."""
        lengths = run.packed.lengths
        start = run.packed.address
        functions = dict(jit.BEHIND)
        varying = list[str]()
        if lengths:
            functions[lengths.levels.histories] = "signals"
            functions[lengths.levels.set_span] = "set_span"
            varying = [f"method_{name}" for name in (*scheme.OF_LENGTH, "allowed")]
        memory = PackedMemory(mutable, varying)
        memory.join([start, *(lengths.levels.tables.tolist() if lengths else ())])
        memory.add(Step, start)
        # copies are of numbers of eight bytes: what these are is said here
        for copy in (lengths.before, lengths.held) if lengths else ():
            memory.add(State, address_of(copy.packed), "copy")
        spelled = (programs.run, row_programs.act)
        self.printer = KernelPrinter(memory, functions, small.STANDS, small.PRODUCTS, spelled)
        step = memory.pointer(start)
        kernel = stepping.take_row if lengths else stepping.take
        take = self.printer.entry(kernel, [step, ZERO])
        self.words = {"TAKE": f"{take.name}(m{', 0' if lengths else ''})"}
        if lengths:
            h = Scalar("h", "double")
            method = Struct(Method, (start + 8 * METHOD,), ZERO)
            numbers = self.printer.entry(scheme.coefficients, [method, h])
            whole = Const(float(run.step.method.h))
            allowed = self.printer.entry(scheme.allowed_change, [h, whole])
            self.words |= {
                "KIND": numbers.result.struct,
                "NUMBERS": f"{numbers.name}(h)",
                "ALLOWED": f"{allowed.name}(h, {whole.value!r})",
                "TRIALS": str(len(lengths.levels.tables)),
                "FOUND": region("levels_found"),
                "SPANS": region("levels_spans"),
                "HALVINGS": region("levels_halvings"),
            }
        self.printer.finish()
        return {one.name for one in memory.regions if one.folded and one.written}


class Steps:
    """A printed step, compiled; HISTORY in C sets the signals of a row `k` at a time `t`."""

    def __init__(
        self, run: OpenRun, row: np.ndarray, folder: Path, flags: Sequence[str], history: str = ""
    ) -> None:
        calls = Calls(run, row)
        lengths = run.packed.lengths
        words = (
            {"HISTORY": history}
            | calls.words
            | {
                "STATE": region("state_x"),
                "COUNTERS": region("job_counters"),
                "SIGNALS": region("job_signals"),
                "COUNT": str(row.shape[1]),
                "COUNT_STEP": "COUNTED++;" if lengths else "",
                "COUNTED": f"{region('levels_found')}[{NUMBER}]",
            }
        )
        own = OWN + LENGTHS if lengths else OWN
        for word, place in words.items():
            own = re.sub(rf"\b{word}\b", place, own)
        program = PrintedProgram(calls.printer, own)
        constants, starts = program.starts()
        own = program.own.replace("STARTS", starts)
        text = "\n".join(
            [
                *(HEAD, program.constants, constants, "typedef struct {", program.declared),
                *("} NAME_memory;", program.structs, FORWARD if lengths else ""),
                *(maths(program.code + own), program.code, own),
            ]
        ).replace("NAME", "model")
        self.text = text
        self.library = compiled(folder, [text], "printed", flags)
        for name, kind in {
            "size": ctypes.c_ulong,
            "position": ctypes.POINTER(ctypes.c_double),
            "corrections": ctypes.c_longlong,
        }.items():
            getattr(self.library, name).restype = kind
        self.memory = ctypes.create_string_buffer(self.library.size())
        self.library.begin(self.memory)

    def take(self, signals: np.ndarray) -> int:
        row = np.ascontiguousarray(signals)
        return int(self.library.take(self.memory, row.ctypes.data_as(ctypes.c_void_p)))

    def position(self, count: int) -> np.ndarray:
        found: np.ndarray = np.ctypeslib.as_array(self.library.position(self.memory), (count,))
        return found


def compare(
    system: System,
    method: GeneralizedAlpha,
    steps: int,
    folder: Path,
    flags: Sequence[str],
    history: str | None = None,
) -> tuple[float, int]:
    """How far both are apart over the size of the motion at most, and by how many corrections.

    With a `history` in C, that of their one signal or none, steps go from touch to touch.
    """
    run = opened(system, method, steps)
    times = method.step * np.arange(1, steps + 1)
    signals, _ = leading_signals(run.model.system, times, method.step)
    row = np.zeros((1, signals.shape[1]))
    lengths = None if history is None else Lengths(run.packed)
    start = run.step.state.x.copy()
    if lengths is not None:
        run.packed.lengths, row = lengths, lengths.signals[:1]
    other = Steps(run, row, folder, flags, history or "")
    worst, largest = 0.0, 0.0
    for k in range(steps):
        row[0] = signals[k]
        if lengths is None:
            assert run.packed.call(stepping.take) == stepping.DONE
        else:
            assert run.packed.advance(row, run.packed.given[1], times[k] - method.step) == 0
        assert other.take(signals[k]) == stepping.DONE
        x = run.step.state.x
        worst = max(worst, float(np.abs(other.position(len(x)) - x).max()))
        largest = max(largest, float(np.abs(x).max()))
    if lengths is not None:
        # what a step that goes from touch to touch began with
        assert lengths.held is not None
        assert np.any(lengths.held.state.x != start)
    corrections = int(run.step.job.counters[1])
    return worst / largest, int(other.library.corrections(other.memory)) - corrections
