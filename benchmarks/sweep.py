"""A thousand reduced runs of example 2, 6000 steps of 5e-4 s each, on all cores: wall and CPU seconds, and what the engine adds.

    python benchmarks/sweep.py [members]

Two families, trained first: over E and diameter as examples/sweep_pendulum.py does it in Python, with eps and eta of the source;
and over E, diameter and gravity with the tolerance 1e-4 by the studies `train` and `sweep` of examples/pendulum_family.yaml. Wall
seconds mean something on an idle machine only: the load is told, too. Writes benchmarks/results/sweep.md.
"""

from __future__ import annotations

import os
import platform
import runpy
import sys
import tempfile
from pathlib import Path

from fmbs_skfem import studies
from fmbs_skfem.families import parametric_model

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES, RESULTS = ROOT / "examples", ROOT / "benchmarks" / "results"


def row(name: str, model: Path, folder: Path, members: int, workers: int | None) -> str:
    """A sweep over the box of a model, as a line of the table."""
    saved = parametric_model.summary(parametric_model.load(model))
    modes = " + ".join(map(str, saved["components"].values()))
    load = os.getloadavg()[0]
    found = studies.sweep(model, samples=members, workers=workers, out=folder, plots=False).report
    cells = [name, ", ".join(saved["parameters"]), modes, str(members), str(found["ok"]), str(found["workers"])]
    cells += [f"{found['wall_s']:.1f}", f"{found['cpu_s']:.1f}", f"{100 * found['overhead']:.1f} %", f"{load:.1f}"]
    return f"| {' | '.join(cells)} |"


def main(members: int = 1000, workers: int | None = None) -> str:
    """Train, sweep, and write what it took."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        two, three = folder / "pendulum.h5", folder / "train" / "model.h5"
        runpy.run_path(str(EXAMPLES / "sweep_pendulum.py"))["train"](two, None, None, 5)
        studies.train(EXAMPLES / "pendulum_family.yaml", holdout=0, out=three.parent, plots=False)
        trained = (("eps 1e-12, eta 1e-3", two), ("tolerance 1e-4", three))
        rows = [row(label, model, folder / model.stem, members, workers) for label, model in trained]
    head = [
        "model",
        "parameters",
        "modes",
        "members",
        "done",
        "workers",
        "wall [s]",
        "CPU [s]",
        "overhead of the engine",
        "load before",
    ]
    lines = ["# Sweeps of example 2", "", f"| {' | '.join(head)} |", "|" + "---|" * len(head), *rows, ""]
    text = "\n".join([*lines, f"6000 steps a member, {os.cpu_count()} cores ({platform.machine()})."]) + "\n"
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "sweep.md").write_text(text, encoding="utf-8")
    return text


if __name__ == "__main__":
    print(main(*map(int, sys.argv[1:2])))
