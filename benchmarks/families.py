"""Trainings of families by an accuracy: what they cost in full runs, and whether they end with a
model or say that none pays.

    python benchmarks/families.py [family ...]

Examples over ranges of their parameters, with the step and the cells that the accuracy chooses:
beams and their mechanisms, whose full models of that error are small, and thin plates on given
meshes. Speeds are CPU times of reduced and full runs at hold-out points, where the full model is
the cheapest one of that error. Every family is trained twice, and the second time counts: the first
one loads and compiles. Writes benchmarks/results/families.md.
"""

from __future__ import annotations

import os
import platform
import shutil
import sys
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path

from threadpoolctl import threadpool_limits

from fmbs_skfem import studies
from fmbs_skfem.core.notices import Notice

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES, RESULTS = ROOT / "examples", ROOT / "benchmarks" / "results"
ACCURACY = 1e-2
TRAINING = "training: {candidates: {design: sobol, count: 128}, samples: 8, iterations: 8, max_samples: 16, holdout: 4}\n"
REDUCTION = "reduction: {snapshots: 5 ms}\n"
#: by name: the example, what replaces what in it, and how it is reduced; sections from `reduction`
#: on are those of here
FAMILIES: dict[str, tuple[str, dict[str, str], str]] = {
    "spin_up": (
        "spin_up",
        {
            "ws: 2 * pi ": "E: {value: 1 GPa, range: [0.7 GPa, 1.3 GPa]}\n  ws: {value: 6.283, range: [4, 6.5]} ",
            "young_modulus: 1 GPa": "young_modulus: E",
            "step: 5e-4 s": "step: auto",
        },
        REDUCTION,
    ),
    "four_bar": (
        "four_bar",
        {
            "speed: 150 rpm ": "E: {value: 2.4 GPa, range: [2 GPa, 3 GPa]}\n  speed: {value: 150 rpm, range: [100 rpm, 160 rpm]} ",
            "young_modulus: 2.4 GPa": "young_modulus: E",
            "step: 1 ms": "step: auto",
        },
        REDUCTION,
    ),
    "double_pendulum": ("pendulum_family", {"step: 5e-4 s": "step: auto"}, REDUCTION),
    "plates": (
        "crank_slider_young",
        {
            "duration: 0.2 s": "duration: 0.05 s",
            "step: 1e-5 s": "step: 5e-5 s",
            "[{until: 0.15 s, every: 3e-4 s}, {until: 0.2 s, every: 5e-5 s}]": "[{every: 3e-4 s}]",
        },
        "reduction: {snapshots: 0.3 ms, components: {crank: [crank], linkage: [linkage, slider]}}\n",
    ),
}


@dataclass(frozen=True)
class Row:
    """What a training by an accuracy has ended with."""

    family: str
    full_s: float  #: of a run [s]
    training_s: float
    pays: bool
    speedup: float | None
    #: largest one at hold-out points, over the ranges of the outputs; None without a model
    error: float | None
    why: str

    @property
    def words(self) -> str:
        """Its line of the table."""
        speed = "" if self.speedup is None else f"{self.speedup:.2g}"
        error = "" if self.error is None else f"{self.error:.1e}"
        cost = (
            f"{1e3 * self.full_s:.0f} | {self.training_s:.2f} | {self.training_s / self.full_s:.0f}"
        )
        return f"| {self.family} | {cost} | {'pays' if self.pays else 'does not pay'} | {speed} | {error} | {self.why} |"


def written(name: str, folder: Path) -> Path:
    """The scene of a family, beside the meshes of the examples."""
    example, changes, reduction = FAMILIES[name]
    text = (EXAMPLES / f"{example}.yaml").read_text(encoding="utf-8").partition("\nreduction:")[0]
    for before, after in changes.items():
        if before not in text:
            raise ValueError(f"{example}.yaml: expected '{before}', got a scene without it")
        text = text.replace(before, after)
    path = folder / "examples" / f"{name}.yaml"
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"{text}\n{reduction}{TRAINING}", encoding="utf-8")
    return path


def row(name: str, path: Path) -> Row:
    """Train a family, once for all that is loaded then."""
    for _ in range(2):
        found = studies.train(path, accuracy=ACCURACY, plots=False)
    report = found.report
    errors = report["holdout"]["max_error"] if "holdout" in report else None
    told = report["cpu_s_full"], report["training_s"], report["pays"], report["speedup"], errors
    return Row(name, *told, report.get("reason", ""))


def main(names: tuple[str, ...] = tuple(FAMILIES)) -> list[Row]:
    """All families, as a table."""
    with (
        tempfile.TemporaryDirectory() as place,
        threadpool_limits(limits=1, user_api="blas"),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore", Notice)
        shutil.copytree(ROOT / "meshes", Path(place) / "meshes")
        rows = [row(name, written(name, Path(place))) for name in names]
    lines = [f"# Families trained for an accuracy of {ACCURACY:g}", ""]
    lines += [
        "| family | full run [ms] | training [s] | in full runs | | times as fast | largest error | why |"
    ]
    lines += ["|---|---|---|---|---|---|---|---|", *(one.words for one in rows), ""]
    lines += [f"CPU seconds, {platform.machine()}, load {os.getloadavg()[0]:.1f}.", ""]
    (RESULTS / "families.md").write_text("\n".join(lines), encoding="utf-8")
    return rows


if __name__ == "__main__":
    for one in main(tuple(sys.argv[1:]) or tuple(FAMILIES)):
        print(one.words)
