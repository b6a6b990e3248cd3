"""A reduced model as a WebAssembly module, for pages: the C file behind a few functions."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from ..core import extras
from ..core.errors import InputError, say
from .binaries import ZIG
from .c_files import CModel

EXPORTED = "init", "start", "step", "stopped", "inputs", "parameters", "unknowns", "outputs", "now"
DOOR = """
#include "NAME.h"
static NAME_memory m;
static double outs[NAME_OUTPUTS > 0 ? NAME_OUTPUTS : 1];
void init(void) { NAME_init(&m); }
int start(void) { return NAME_start(&m); }
int step(double span)
{
    const NAME_status found = NAME_step(&m, span);
    return found == NAME_INPUT_OUTSIDE ? NAME_step(&m, span) : found; /* pages show ranges beside their inputs */
}
int stopped(int status) { return status == NAME_STOPPED; } /* by an event */
double *inputs(void) { return m.inputs; }
double *parameters(void) { return m.parameters; }
double *unknowns(void) { return m.state_x; }
double *outputs(void) { NAME_outputs(&m, outs); return outs; }
double now(void) { return m.time; }
"""
# vectors of 128 bits are in all browsers since 2023; products and sums stay apart, as in the C file
# elsewhere
FLAGS = (
    "-target",
    "wasm32-freestanding",
    "-std=c99",
    "-O3",
    "-msimd128",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-nostdlib",
    "-Wl,--no-entry",
)


def module(model: CModel) -> bytes:
    """The module of a model; InputError without the extra `fmu`, and where its compiler fails."""
    if not extras.there("fmu"):
        compiler = extras.install("fmu")
        raise InputError(f"the model itself runs in it with a compiler, {compiler}")
    with tempfile.TemporaryDirectory(prefix="fmbs_wasm_") as place:
        folder = Path(place)
        (folder / f"{model.name}.h").write_text(model.header, encoding="utf-8")
        (folder / "model.c").write_text(model.source, encoding="utf-8")
        (folder / "door.c").write_text(DOOR.replace("NAME", model.name), encoding="utf-8")
        exported = [f"-Wl,--export={name}" for name in EXPORTED]
        done = subprocess.run(
            [*ZIG, *FLAGS, *exported, "model.c", "door.c", "-o", "model.wasm"],
            cwd=folder,
            capture_output=True,
            text=True,
        )
        if done.returncode != 0:
            raise InputError(
                say("C compiler", "a model that it compiles", done.stderr.strip()[:500])
            )
        return (folder / "model.wasm").read_bytes()
