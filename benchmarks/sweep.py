"""A thousand reduced runs of example 2, 6000 steps of 5e-4 s each, on all cores: wall and CPU
seconds, and what the engine adds.

    python benchmarks/sweep.py [members]

Two families, trained first: over E and diameter as examples/sweep_pendulum.py does it in Python,
with eps and eta of the source; and over E, diameter and gravity with the tolerance 1e-4 by the
studies `train` and `sweep` of examples/pendulum_family.yaml. Wall seconds mean something on an idle
machine only: the load is told, too. What a call costs beside its compiled steps, over 1500 and all
steps, and what a sample of a sweep does: CPU times, the least of CALLS. Writes
benchmarks/results/sweep.md.
"""

from __future__ import annotations

import os
import platform
import runpy
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import studies
from fmbs_skfem.dynamics import integration
from fmbs_skfem.dynamics.observers import RunSetting
from fmbs_skfem.families import members, parametric_model

CALLS, STEPS = 20, (1500, 6000)
ROOT = Path(__file__).resolve().parents[1]
EXAMPLES, RESULTS = ROOT / "examples", ROOT / "benchmarks" / "results"


def row(name: str, model: Path, folder: Path, members: int, workers: int | None) -> str:
    """A sweep over the box of a model, as a line of the table."""
    saved = parametric_model.summary(parametric_model.load(model))
    modes = " + ".join(map(str, saved["components"].values()))
    load = os.getloadavg()[0]
    found = studies.sweep(model, samples=members, workers=workers, out=folder, plots=False).report
    cells = [
        name,
        ", ".join(saved["parameters"]),
        modes,
        str(members),
        str(found["ok"]),
        str(found["workers"]),
    ]
    cells += [
        f"{found['wall_s']:.1f}",
        f"{found['cpu_s']:.1f}",
        f"{saved['steps'] * members / found['wall_s']:.0f}",
        f"{100 * found['overhead']:.1f} %",
        f"{load:.1f}",
    ]
    return f"| {' | '.join(cells)} |"


def beside(name: str, path: Path, steps: int) -> str:
    """A call of a model over some steps, and a sample of a sweep, beside the compiled steps, as a
    line of the table.
    """
    rom, found = parametric_model.load(path), list[list[float]]()
    step = rom.model.nominal.scheme.step
    for part in np.linspace(0.0, 1.0, CALLS + 1):
        values = {
            one.name: float(one.low + part * (one.high - one.low)) for one in rom.model.parameters
        }
        case = parametric_model.case_of(rom, values, steps * step, step)[0]
        run = integration.begun(
            RunSetting(case.system, case.scheme, case.newton, steps, case.system),
            np.array([0, steps]),
        )
        calls = (
            partial(integration.advance, run),
            partial(parametric_model.run, rom, steps, steps * step, step, **values),
            partial(
                members.run_case,
                parametric_model.case_of(rom, values, steps * step, step)[0],
                members.INSTANTS,
            ),
        )
        found.append([cpu_ms(call) for call in calls])
    bare, call, sample = np.min(found[1:], axis=0)
    cells = [
        name,
        str(steps),
        f"{bare:.1f}",
        f"{call:.1f}",
        f"{call / bare:.2f}",
        f"{sample:.1f}",
        f"{sample / bare:.2f}",
    ]
    return f"| {' | '.join(cells)} |"


def cpu_ms(call: Callable[[], object]) -> float:
    """CPU time of a call [ms]."""
    begin = time.process_time()
    call()
    return 1e3 * (time.process_time() - begin)


def main(count: int = 1000, workers: int | None = None) -> str:
    """Train, sweep, and write what it took."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        two, three = folder / "pendulum.h5", folder / "train" / "model.h5"
        runpy.run_path(str(EXAMPLES / "sweep_pendulum.py"))["train"](two, None, None, 5)
        studies.train(EXAMPLES / "pendulum_family.yaml", holdout=0, out=three.parent, plots=False)
        trained = (("eps 1e-12, eta 1e-3", two), ("tolerance 1e-4", three))
        rows = [row(label, model, folder / model.stem, count, workers) for label, model in trained]
        with threadpool_limits(limits=1):
            ratios = [beside(label, model, steps) for label, model in trained for steps in STEPS]
    head = [
        "model",
        "parameters",
        "modes",
        "members",
        "done",
        "workers",
        "wall [s]",
        "CPU [s]",
        "steps a second",
        "overhead of the engine",
        "load before",
    ]
    lines = [
        "# Sweeps of example 2",
        "",
        f"| {' | '.join(head)} |",
        "|" + "---|" * len(head),
        *rows,
        "",
    ]
    lines += [f"6000 steps a member, {os.cpu_count()} cores ({platform.machine()}).", ""]
    lines += [
        "| model | steps | steps alone [ms] | a call [ms] | over its steps | a sample [ms] | over its steps |"
    ]
    lines += ["|---|---:|---:|---:|---:|---:|---:|", *ratios, ""]
    kept = f"a sample keeps {members.INSTANTS} instants and the extremes of all steps"
    text = "\n".join([*lines, f"CPU times with one thread, the least of {CALLS}; {kept}."]) + "\n"
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "sweep.md").write_text(text, encoding="utf-8")
    return text


if __name__ == "__main__":
    print(main(*map(int, sys.argv[1:2])))
