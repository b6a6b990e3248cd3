"""C files as libraries that tests call."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fmbs_skfem.exports.c_files import CModel

COMPILER = shutil.which("cc") or shutil.which("gcc")
STRICT = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O1", "-ffp-contract=off")

HARNESS = """
#include "NAME.h"
unsigned long memory_size(void) { return sizeof(NAME_memory); }
void set_input(NAME_memory *m, int k, double value) { m->inputs[k] = value; }
double input_of(const NAME_memory *m, int k) { return m->inputs[k]; }
void set_rate(NAME_memory *m, int order, int k, double value) { m->rates[order][k] = value; }
void set_parameter(NAME_memory *m, int k, double value) { m->parameters[k] = value; }
void set_fixed(NAME_memory *m, int many) { m->fixed = many; }
void set_steps(NAME_memory *m, long long whole) { m->whole = whole; }
double time_of(const NAME_memory *m) { return m->time; }
double left_of(const NAME_memory *m) { return m->left; }
int enough_of(const NAME_memory *m) { return m->enough; }
int divided_of(const NAME_memory *m) { return (int)m->divided; }
const double *state_of(const NAME_memory *m) { return m->state_x; }
"""


def compiled(
    folder: Path, texts: Sequence[str], name: str, flags: Sequence[str] = STRICT
) -> ctypes.CDLL:
    """A library of some texts of C."""
    assert COMPILER is not None
    places = []
    for k, text in enumerate(texts):
        places.append(folder / f"{name}_{k}.c")
        places[-1].write_text(text)
    library = folder / f"{name}.so"
    command = [
        COMPILER,
        *flags,
        "-shared",
        "-fPIC",
        f"-I{folder}",
        *map(str, places),
        "-o",
        str(library),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(library))


class CRun:
    """A model in C with its memory."""

    def __init__(self, model: CModel, folder: Path, flags: Sequence[str] = STRICT) -> None:
        self.model, name = model, model.name
        (folder / f"{name}.h").write_text(model.header)
        self.library = compiled(folder, [model.source, HARNESS.replace("NAME", name)], name, flags)
        for one, result in (
            ("memory_size", ctypes.c_ulong),
            ("time_of", ctypes.c_double),
            ("left_of", ctypes.c_double),
            ("input_of", ctypes.c_double),
        ):
            getattr(self.library, one).restype = result
        self.message = getattr(self.library, f"{name}_message")
        self.message.restype = ctypes.c_char_p
        self.memory = self.room()
        self.call("init")

    def room(self) -> ctypes.Array[ctypes.c_char]:
        return ctypes.create_string_buffer(self.library.memory_size())

    def call(self, name: str, *arguments: object) -> int:
        return int(getattr(self.library, f"{self.model.name}_{name}")(self.memory, *arguments))

    def step(self, span: float) -> int:
        return self.call("step", ctypes.c_double(span))

    def set(self, kind: str, number: int, value: float) -> None:
        getattr(self.library, f"set_{kind}")(self.memory, number, ctypes.c_double(value))

    def input(self, number: int) -> float:
        return float(self.library.input_of(self.memory, number))

    def rate(self, order: int, number: int, value: float) -> None:
        """Set a derivative of an input, of order 0 the first one."""
        self.library.set_rate(self.memory, order, number, ctypes.c_double(value))

    @property
    def time(self) -> float:
        return float(self.library.time_of(self.memory))

    @property
    def divided(self) -> int:
        """Trials of steps that failed as a whole."""
        return int(self.library.divided_of(self.memory))

    def state(self, unknowns: int) -> np.ndarray:
        """Unknowns x (n,) in the order of the step."""
        call = self.library.state_of
        call.restype = ctypes.POINTER(ctypes.c_double)
        return np.ctypeslib.as_array(call(self.memory), (unknowns,)).copy()

    @property
    def outputs(self) -> np.ndarray:
        found = np.zeros(len(self.model.columns))
        self.call("outputs", found.ctypes.data_as(ctypes.c_void_p))
        return found

    def derivative(self, number: int) -> np.ndarray:
        found = np.zeros(len(self.model.columns))
        assert self.call("derivative", number, found.ctypes.data_as(ctypes.c_void_p)) == 0
        return found

    def run(self, steps: int, every: int = 1) -> np.ndarray:
        """Outputs (s, c) from the start on."""
        assert self.call("start") == 0
        found = [self.outputs]
        for k in range(steps):
            assert (status := self.step(self.model.step)) == 0, self.message(status)
            if (k + 1) % every == 0:
                found.append(self.outputs)
        return np.array(found)
