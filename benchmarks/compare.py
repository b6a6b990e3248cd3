"""Speed against error of the examples: `fmbs compare` with all variants, written to benchmarks/results.

    python benchmarks/compare.py [double_pendulum] [spin_up] [crank_slider] [crank_slider_coarse]

CPU and wall seconds are with one BLAS thread, the best of several runs where they are short, training excluded; errors stand
beside. `crank_slider` is Table 4 of doi 10.1016/j.cma.2019.112690 at full size and takes the better part of an hour.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from fmbs_skfem import scenes
from fmbs_skfem.cli import common, compare, reports

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
SCENES = ("spin_up", "double_pendulum")


def main(names: list[str]) -> dict[str, dict[str, Any]]:
    """Run the studies and write compare_*.json, compare_*.md and the picture of speed against error; the reports by scene."""
    written = {}
    RESULTS.mkdir(parents=True, exist_ok=True)
    for name in names:
        scene = scenes.read(ROOT / "examples" / f"{name}.yaml")
        with common.one_thread():
            study = compare.run(scene)
        written[name] = report = {**compare.report_of(scene, study), "versions": reports.versions()}
        reports.write_json(RESULTS / f"compare_{name}.json", report)
        (RESULTS / f"compare_{name}.md").write_text(page(report), encoding="utf-8")
        compare.cloud(scene, study, RESULTS, f"compare_{name}.png")
        print(page(report))
    return written


def page(report: dict[str, Any]) -> str:
    """All models as a Markdown table, then who is on the front."""
    head = (
        "model",
        "dofs",
        "modes",
        "cells",
        "points",
        "force, tangent [s]",
        "solves [s]",
        "products [s]",
        "CPU [s]",
        "wall [s]",
        "sNNLS [s]",
        "training [s]",
        "K_r [us]",
        "max error",
        "median error",
        "mean error",
        "position [m]",
        "pays after",
    )
    lines = [
        f"# {report['scene']}: time beside error",
        "",
        "| " + " | ".join(head) + " |",
        "|---" + "|---:" * (len(head) - 1) + "|",
    ]
    lines += ["| " + " | ".join(row(model)) + " |" for model in report["models"]]
    return "\n".join([*lines, "", *(f"{text}\n" for text in compare.words(report))])


def row(model: dict[str, Any]) -> list[str]:
    """One model; where it failed, the reason."""
    sizes = [" + ".join(map(str, model[key].values())) for key in ("modes", "elements", "points")]
    if model["status"] != "done":
        return [model["name"], str(model["dofs"]), *sizes, model["status"], *[""] * 12]
    seconds = [f"{model[key]:.3g}" for key in ("force_s", "solve_s", "product_s", "cpu_s", "wall_s")]
    trained = [" + ".join(f"{value:.2g}" for value in model["snnls_s"].values()), f"{model['training_s']:.3g}"]
    errors = ("kr_us", "max_error", "median_error", "mean_error", "position_error")
    numbers = [*seconds, *trained, *(f"{model[key]:.3g}" for key in errors)]
    pays = "" if model["pays_after_runs"] is None else f"{model['pays_after_runs']:.1f}"
    return [model["name"], str(model["dofs"]), *sizes, *numbers, pays]


if __name__ == "__main__":
    main(sys.argv[1:] or list(SCENES))
