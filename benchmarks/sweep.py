"""A thousand reduced runs of example 2 by `fmbs sweep`, as a user calls it: wall and CPU seconds, and what the engine adds.

    python benchmarks/sweep.py [members]

The model is that of examples/pendulum_family.yaml (E, diameter and gravity of the flexible double pendulum, tolerance 1e-4) and is
trained first; every member has 6000 steps of 5e-4 s. Wall seconds mean something on an idle machine only: the load is told, too.
Writes benchmarks/results/sweep.md.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"


def fmbs(*words: str | Path) -> dict[str, Any]:
    """The JSON object of a command."""
    done = subprocess.run([sys.executable, "-m", "fmbs_skfem.cli.main", *map(str, words), "--json"], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    return dict(json.loads(done.stdout))


def main(members: int = 1000) -> str:
    """Train, sweep, and write what it took."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        model = fmbs("train", ROOT / "examples" / "pendulum_family.yaml", "--holdout", "0", "--out", folder / "train")
        load = os.getloadavg()[0]
        found = fmbs("sweep", folder / "train" / "model.h5", "--samples", str(members), "--out", folder / "sweep")
    modes = " + ".join(str(count) for count in model["modes"].values())
    row = [members, found["ok"], modes, found["workers"], f"{found['wall_s']:.1f}", f"{found['cpu_s']:.1f}"]
    cells = [*map(str, row), f"{100 * found['overhead']:.1f} %"]
    lines = [
        "# A sweep of example 2",
        "",
        "| members | done | modes | workers | wall [s] | CPU [s] | overhead of the engine |",
        "|---:|---:|---:|---:|---:|---:|---:|",
        f"| {' | '.join(cells)} |",
        "",
        f"6000 steps a member, {os.cpu_count()} cores ({platform.machine()}), load {load:.1f} at the start.",
    ]
    text = "\n".join(lines) + "\n"
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / "sweep.md").write_text(text, encoding="utf-8")
    return text


if __name__ == "__main__":
    print(main(*map(int, sys.argv[1:2])))
