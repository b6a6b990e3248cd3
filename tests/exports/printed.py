"""Packed steps of models, printed as C and compiled, beside those that numba compiles."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fmbs_skfem.core.algebra import small
from fmbs_skfem.core.compiling import jit, programs
from fmbs_skfem.core.printing.memory import Memory
from fmbs_skfem.core.printing.printer import Printer
from fmbs_skfem.core.printing.program import Program, region
from fmbs_skfem.core.printing.values import ZERO
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integration
from fmbs_skfem.dynamics.compiled_step import stepping
from fmbs_skfem.dynamics.compiled_step.step import Step
from fmbs_skfem.dynamics.histories import leading_signals
from fmbs_skfem.dynamics.initial import begin_steps
from fmbs_skfem.dynamics.observers import RunSetting
from fmbs_skfem.dynamics.run import OpenRun
from fmbs_skfem.exports.text import maths
from fmbs_skfem.systems import System, row_programs
from tests.exports.c_library import compiled

HEAD = """
typedef long long whole;
typedef struct { double real, imag; } pair;
#define INLINED static inline __attribute__((always_inline))
#define ENDLESS (1e308 * 10.0)
#define NO_NUMBER (ENDLESS - ENDLESS)
"""
OWN = """
void begin(NAME_memory *m) {
STARTS
}
unsigned long size(void) { return sizeof(NAME_memory); }
int take(NAME_memory *m, const double *signals) {
    for (int i = 0; i < COUNT; i++)
        SIGNALS[i] = signals[i];
    return (int)TAKE;
}
double *position(NAME_memory *m) { return STATE; }
long long corrections(NAME_memory *m) { return COUNTERS[1]; }
"""


def opened(system: System, scheme: GeneralizedAlpha, steps: int) -> OpenRun:
    """A run at its start, and the row that its steps take their signals from."""
    run = integration.begun(
        RunSetting(system, scheme, Newton(), steps, system), np.arange(steps + 1)
    )
    begin_steps(run.step.state)
    return run


def printed(run: OpenRun, row: np.ndarray) -> tuple[Printer, str, str]:
    """The step of a run: its kernels, the call of it, and the name of its signals."""
    run.packed.give(row, np.array([-1]))
    mutable = {"job_signals"}
    while True:
        memory = Memory(mutable)
        memory.add(Step, run.packed.address)
        spelled = (programs.run, row_programs.act)
        printer = Printer(memory, jit.BEHIND, small.STANDS, small.PRODUCTS, spelled)
        take = printer.entry(stepping.take, [memory.pointer(run.packed.address), ZERO])
        printer.finish()
        wrong = {one.name for one in memory.regions if one.folded and one.written}
        if not wrong:
            return printer, f"{take.name}({printer.memory_mark(take.name, False)})", "job_signals"
        mutable |= wrong


class Steps:
    """A printed step, compiled."""

    def __init__(self, run: OpenRun, width: int, folder: Path, flags: Sequence[str]) -> None:
        row = np.zeros((1, width))
        printer, take, signals = printed(run, row)
        words = {
            "STATE": region("state_x"),
            "COUNTERS": region("job_counters"),
            "SIGNALS": region(signals),
            "COUNT": str(width),
        }
        own = OWN
        for word, place in words.items():
            own = own.replace(word, place)
        program = Program(printer, own)
        constants, starts = program.starts()
        own = program.own.replace("STARTS", starts).replace("TAKE", take.partition("(")[0] + "(m)")
        text = "\n".join(
            [
                *(HEAD, program.constants, constants, "typedef struct {", program.declared),
                *("} NAME_memory;", program.structs, maths(program.code), program.code, own),
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
    system: System, scheme: GeneralizedAlpha, steps: int, folder: Path, flags: Sequence[str]
) -> tuple[float, int]:
    """How far both are apart over the size of the motion at most, and by how many corrections."""
    run = opened(system, scheme, steps)
    times = scheme.step * np.arange(1, steps + 1)
    signals, _ = leading_signals(run.model.system, times, scheme.step)
    width = signals.shape[1]
    other = Steps(run, width, folder, flags)
    row = run.packed.given[0]
    worst, largest = 0.0, 0.0
    for k in range(steps):
        row[0] = signals[k]
        assert run.packed.call(stepping.take) == stepping.DONE
        assert other.take(signals[k]) == stepping.DONE
        x = run.step.state.x
        worst = max(worst, float(np.abs(other.position(len(x)) - x).max()))
        largest = max(largest, float(np.abs(x).max()))
    corrections = int(run.step.job.counters[1])
    return worst / largest, int(other.library.corrections(other.memory)) - corrections
