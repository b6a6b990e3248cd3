"""Steps of exported models at a fixed number of corrections, in C: how much the longest ones take
over the usual ones.

    python benchmarks/real_time.py [steps of the first] [MODEL.h5 ...]

Without files examples 2 and 3 (coarse meshes) are reduced first. Every step has the same number of
operations: factors at its guess, then CORRECTIONS corrections. The process is pinned to a processor
where the system allows it, and times are those of a monotonic clock: what lies above the usual step
is of the operating system, which interrupts it, and not of the model. The second and further models
take a twentieth of the steps.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from fmbs_skfem import studies
from fmbs_skfem.exports import c_files
from fmbs_skfem.reduction import files

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = "double_pendulum", "crank_slider_coarse"
STEPS, CORRECTIONS, SHARE = 10_000_000, 4, 20
FLAGS = ("-std=gnu99", "-O3", "-march=native", "-fno-math-errno")

DRIVER = r"""
#define _GNU_SOURCE
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "NAME.h"
#define BINS 2000000 /* of 10 ns: 20 ms, and what is longer in the last one */
static NAME_memory m;
static long long bins[BINS];

int main(int argc, char **argv)
{
    const long long steps = atoll(argv[1]);
    double longest = 0.0, left = 0.0, energy = 0.0;
    long long at = 0, seen = 0;
    struct timespec a, b;
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(argc > 3 ? atoi(argv[3]) : 1, &set);
    const int pinned = sched_setaffinity(0, sizeof set, &set) == 0;
    NAME_init(&m);
    if (NAME_start(&m))
        return 1;
    m.fixed = atoi(argv[2]);
    for (long long k = 0; k < steps; k++) {
        clock_gettime(CLOCK_MONOTONIC, &a);
        const int status = NAME_step(&m, NAME_STEP);
        clock_gettime(CLOCK_MONOTONIC, &b);
        if (status) {
            fprintf(stderr, "step %lld: %s\n", k, NAME_message(status));
            return 2;
        }
        const double taken = (b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec);
        const long long bin = taken / 10.0;
        bins[bin < BINS ? bin : BINS - 1]++;
        longest = taken > longest ? taken : longest;
        left = m.left > left ? m.left : left;
        if (k % 1000 == 0) {
            const double now = NAME_kinetic_energy(&m) + NAME_strain_energy(&m);
            energy = now > energy ? now : energy;
        }
    }
    double median = 0.0, most = 0.0;
    for (at = 0; at < BINS; at++) {
        seen += bins[at];
        if (median == 0.0 && 2 * seen >= steps)
            median = 10.0 * at;
        if (most == 0.0 && (double)seen >= 0.99999 * (double)steps)
            most = 10.0 * at;
    }
    printf("{\"steps\": %lld, \"median_us\": %.3f, \"p99999_us\": %.3f, \"longest_us\": %.3f, \"left_m\": %.3g, "
           "\"largest_energy_J\": %.6g, \"energy_at_end_J\": %.6g, \"pinned\": %s, \"factorisations\": %lld, "
           "\"corrections\": %lld}\n",
           steps, median / 1e3, most / 1e3, longest / 1e3, left, energy, NAME_kinetic_energy(&m) + NAME_strain_energy(&m),
           pinned ? "true" : "false", m.factorisations, m.corrections);
    return 0;
}
"""


def measure(path: Path, steps: int) -> dict[str, Any]:
    """Times of the steps of one model."""
    saved = files.read(path)
    case, _ = files.case_of(saved)
    model = c_files.write(case, path.stem, path.stem)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name, text in ((f"{model.name}.c", model.source), (f"{model.name}.h", model.header)):
            (folder / name).write_text(text, encoding="utf-8")
        (folder / "driver.c").write_text(DRIVER.replace("NAME", model.name), encoding="utf-8")
        subprocess.run(
            ["cc", *FLAGS, "driver.c", f"{model.name}.c", "-o", "driver"], cwd=folder, check=True
        )
        done = subprocess.run(
            [str(folder / "driver"), str(steps), str(CORRECTIONS)],
            capture_output=True,
            text=True,
            check=True,
        )
    found: dict[str, Any] = json.loads(done.stdout)
    return {
        "model": path.stem,
        "unknowns": case.system.size,
        "step_us": 1e6 * case.scheme.step,
        **found,
    }


def page(rows: list[dict[str, Any]]) -> str:
    """All models as a table."""
    heads = (
        "model",
        "unknowns",
        "step [us]",
        "steps",
        "median [us]",
        "99.999 % [us]",
        "longest [us]",
        "longest / median",
        "left [m]",
    )
    heads = (*heads, "largest energy [J]", "at the end [J]")
    lines = [
        f"# Steps in C with {CORRECTIONS} corrections each: the usual and the longest ones",
        "",
        "The same number of operations each; a process of an operating system that interrupts it, on shared processors.",
        "",
        f"| {' | '.join(heads)} |",
        "|" + "---|" * len(heads),
    ]
    for one in rows:
        ratio = one["longest_us"] / one["median_us"]
        cells = [
            one["model"],
            one["unknowns"],
            f"{one['step_us']:g}",
            one["steps"],
            f"{one['median_us']:.1f}",
            f"{one['p99999_us']:.1f}",
        ]
        cells += [
            f"{one['longest_us']:.0f}",
            f"{ratio:.0f}",
            f"{one['left_m']:.1e}",
            f"{one['largest_energy_J']:.4g}",
        ]
        cells.append(f"{one['energy_at_end_J']:.4g}")
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join([*lines, ""])


def main(steps: int = STEPS, paths: list[Path] | None = None) -> list[dict[str, Any]]:
    """Measure models, by default examples 2 and 3, and write real_time.md and .json into
    benchmarks/results.
    """
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    rows = []
    with tempfile.TemporaryDirectory() as place:
        found = paths or []
        for name in EXAMPLES if not paths else ():
            found.append(Path(place) / f"{name}.h5")
            studies.reduce(ROOT / "examples" / f"{name}.yaml", out=found[-1])
        for k, path in enumerate(found):
            rows.append(measure(path, steps if k == 0 else steps // SHARE))
            print(rows[-1], flush=True)
    results = ROOT / "benchmarks" / "results" / "real_time"
    results.with_suffix(".md").write_text(page(rows), encoding="utf-8")
    results.with_suffix(".json").write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")
    return rows


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else STEPS, [Path(one) for one in sys.argv[2:]])
