"""The pages on FMPy and Simulink: their commands, their Python and their C, with the model that
they make.
"""

from __future__ import annotations

import csv
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from fmbs_skfem.control.live import start
from fmbs_skfem.reduction import files
from tests import pages
from tests.exports.c_library import COMPILER
from tests.exports.held import held

pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(COMPILER is None or sys.platform == "win32", reason="no C compiler")

WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror")

#: what an S-function needs of Simulink, in the names of its manual
SIMSTRUC = """
#include <stdio.h>
#include <stdlib.h>
typedef double real_T;
typedef int int_T;
enum { SS_UINT8, SS_DOUBLE };
typedef struct { int inputs, outputs, feeds, contiguous, width, type; double step, *work, *in, *out; const char *error; } SimStruct;
#define ssSetNumSFcnParams(S, n) ((void)(S))
#define ssSetNumInputPorts(S, n) ((S)->inputs = -(n))
#define ssSetNumOutputPorts(S, n) ((S)->outputs = -(n))
#define ssSetInputPortWidth(S, k, n) ((S)->inputs = (n))
#define ssSetOutputPortWidth(S, k, n) ((S)->outputs = (n))
#define ssSetInputPortRequiredContiguous(S, k, on) ((S)->contiguous = (on))
#define ssSetInputPortDirectFeedThrough(S, k, on) ((S)->feeds = (on))
#define ssSetNumSampleTimes(S, n) ((void)(S))
#define ssSetNumDWork(S, n) ((void)(S))
#define ssSetDWorkWidth(S, k, n) ((S)->width = (int)(n))
#define ssSetDWorkDataType(S, k, kind) ((S)->type = (kind))
#define ssSetSampleTime(S, k, h) ((S)->step = (h))
#define ssSetOffsetTime(S, k, t) ((void)(S))
#define ssGetDWork(S, k) ((void *)(S)->work)
#define ssGetInputPortRealSignal(S, k) ((const real_T *)(S)->in)
#define ssGetOutputPortRealSignal(S, k) ((S)->out)
#define ssSetErrorStatus(S, text) ((S)->error = (text))
"""
#: 100 steps as Simulink takes them; then an input that is not finite, and the same steps again
SIMULINK = """
static void run(SimStruct *S)
{
    int k;
    mdlInitializeConditions(S);
    for (k = 0; k < 100 && !S->error; k++) {
        mdlOutputs(S, 0);
        S->in[0] = 0.2;
        mdlUpdate(S, 0);
    }
    mdlOutputs(S, 0);
    printf("%.17g\\n", S->out[plant_OUTPUT_TIP]);
}

int main(void)
{
    SimStruct S = {0};
    mdlInitializeSizes(&S);
    mdlInitializeSampleTimes(&S);
    if (S.feeds || !S.contiguous || S.type != SS_DOUBLE || S.step != plant_STEP)
        return 1;
    S.work = calloc(S.width, sizeof(double));
    S.in = calloc(S.inputs, sizeof(double));
    S.out = calloc(S.outputs, sizeof(double));
    run(&S);
    S.in[0] = 1.0 / (S.work[0] - S.work[0]);
    mdlUpdate(&S, 0);
    printf("%s\\n", S.error ? S.error : "no error");
    S.error = NULL;
    run(&S);
    mdlTerminate(&S);
    return 0;
}
"""
CALLER = """
#include <stdio.h>
#include "arm.h"
int main(void)
{
    double outputs[4];
    int status = arm_start(), k;
    for (k = 0; k <= 100; k++)
        status += arm_step(0.2, outputs);
    printf("%.17g\\n", outputs[2]);
    return status;
}
"""


def shell(lines: str, folder: Path) -> None:
    """Commands of a page, but for the installation."""
    for words in (shlex.split(line, comments=True) for line in lines.splitlines()):
        if words and words[0] != "pip":
            program = {"fmbs": "fmbs_skfem", "fmpy": "fmpy"}[words[0]]
            done = subprocess.run(
                [sys.executable, "-m", program, *words[1:]],
                cwd=folder,
                capture_output=True,
                text=True,
            )
            assert done.returncode == 0, (words, done.stdout, done.stderr)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the commands of the page on FMPy were typed."""
    found = tmp_path_factory.mktemp("typed")
    for name in ("examples", "meshes"):
        (found / name).symlink_to(pages.ROOT / name)
    shell(pages.blocks("docs/fmpy.md", "sh")[0], found)
    return found


def test_the_page_on_fmpy_runs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A rising torque moves the arm less than the whole one; states come back bit for bit; a slope
    is that of its step.
    """
    monkeypatch.chdir(folder)
    known = pages.run("docs/fmpy.md")
    with Path("result.csv").open(newline="") as file:
        whole = float(list(csv.DictReader(file))[-1]["tip"])
    assert 0.5 * whole < known["result"]["tip"][-1] < whole
    assert known["first"] == known["again"]
    assert len(known["stored"]) > 1000
    assert 0.0 < known["slope"] < 10.0


@pytest.fixture(scope="module")
def c_folder(folder: Path) -> Path:
    """Beside it the C files of the page on Simulink: its command, its sources, and the stand-in."""
    text = (pages.ROOT / "docs" / "simulink.md").read_text(encoding="utf-8")
    (command,) = [
        line.strip() for line in text.splitlines() if line.startswith("    ") and "--c " in line
    ]
    shell(command, folder)
    arm, header, function = pages.blocks("docs/simulink.md", "c")
    stand_in = {"simstruc.h": SIMSTRUC, "cg_sfun.h": SIMULINK, "caller.c": CALLER}
    for name, code in (
        {"arm.c": arm, "arm.h": header, "plant_sfun.c": function} | stand_in
    ).items():
        (folder / name).write_text(code)
    return folder


@pytest.mark.parametrize(("sources", "lines"), [(("arm.c", "caller.c"), 1), (("plant_sfun.c",), 3)])
def test_the_c_code_for_simulink_moves_as_the_model(
    c_folder: Path, sources: tuple[str, ...], lines: int
) -> None:
    """In a loop as that of Simulink; an S-function reports what is not finite, and starts again
    from the same state.
    """
    assert COMPILER is not None
    program = c_folder / sources[0].removesuffix(".c")
    command = [
        COMPILER,
        *WARNINGS,
        "-O1",
        "-Iplant_c",
        "-I.",
        *sources,
        "plant_c/plant.c",
        "-o",
        program,
    ]
    subprocess.run(command, cwd=c_folder, check=True)
    printed = subprocess.run(
        [program], check=True, capture_output=True, text=True
    ).stdout.splitlines()
    assert len(printed) == lines
    case, _ = files.case_of(files.read(c_folder / "plant.h5"))
    system = held(case.system, case.scheme.step, {"u": lambda t: 0.2})
    run = start(system, case.scheme, case.newton)
    run.step(count=100)
    assert float(printed[0]) == pytest.approx(run.outputs(["tip"])["tip"], rel=1e-9)
    if lines == 3:
        assert "finite" in printed[1]
        assert printed[2] == printed[0]
