"""Speed against error of the examples: `fmbs compare` with all variants, written to benchmarks/results.

    python benchmarks/compare.py [double_pendulum] [spin_up] [crank_slider] [crank_slider_coarse]

CPU and wall seconds are with one BLAS thread, the best of several runs where they are short, training excluded; errors stand
beside. `crank_slider` is Table 4 of doi 10.1016/j.cma.2019.112690 at full size and takes the better part of an hour; both
crank-sliders are also run with as many modes as were published.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from fmbs_skfem import scenes, studies
from fmbs_skfem.reduction import Exact, cases, full_runs, reduced_models
from fmbs_skfem.reduction.accuracy import errors
from fmbs_skfem.reduction.accuracy.comparison import Comparison
from fmbs_skfem.reduction.accuracy.runs import kept_steps
from fmbs_skfem.results import plots
from fmbs_skfem.scenes import Scene, build
from fmbs_skfem.studies import comparison, plans, reports, tables

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
SCENES = ("spin_up", "double_pendulum")


def main(names: list[str]) -> dict[str, dict[str, Any]]:
    """Run the studies and write compare_*.json, compare_*.md and the picture of speed against error; the reports by scene."""
    written = {}
    RESULTS.mkdir(parents=True, exist_ok=True)
    for name in names:
        scene = scenes.read(ROOT / "examples" / f"{name}.yaml")
        found = studies.compare(scene)
        written[name] = report = {**found.report, "provenance": provenance(scene)}
        reports.write_json(RESULTS / f"compare_{name}.json", report)
        shown = [part if isinstance(part, str) else f"```\n{part}\n```" for part in tables.tables(scene, found.study)]
        text = page(report, [*shown, *gap_with_published_modes(scene, found.study)])
        (RESULTS / f"compare_{name}.md").write_text(text, encoding="utf-8")
        plots.save(found.figures["speed_error"], RESULTS / f"compare_{name}.png")
        print(text)
    return written


def provenance(scene: Scene) -> dict[str, Any]:
    """What the numbers depend on, files by their place in the repository."""
    found = reports.provenance(scene)
    files = {str(Path(name).relative_to(ROOT)): mark for name, mark in found["files"].items()}
    return {**found, "file": str(Path(found["file"]).relative_to(ROOT)), "files": files}


def gap_with_published_modes(scene: Scene, study: Comparison) -> list[str]:
    """The largest error of the exact polynomial with the numbers of modes that were published, at both levels."""
    known = tables.read_published().get(scene.name.removesuffix("-coarse"), {}).get("models", {})
    found = {}
    for level in ("system", "component"):
        if (model := study.models.get(f"{level}+exact")) is not None:
            counts = dict(zip(model.bases, known[level]["r"], strict=True))
            found[level] = counts, error_of(scene, study, model, counts)
    told = [f"{' + '.join(map(str, counts.values()))} modes by {level}: {error:.1e}" for level, (counts, error) in found.items()]
    return [f"Largest errors with as many modes as were published: {'; '.join(told)}."] if told else []


def error_of(scene: Scene, study: Comparison, model: reduced_models.ReducedModel, counts: Mapping[str, int]) -> float:
    """The largest error of the exact polynomial with so many modes of every basis."""
    plan = replace(plans.plan(scene), components=model.components, modes=dict(counts), hyper=Exact())
    task = plans.task(scene, build.system(scene), plan)
    made = reduced_models.make_model(task, [full_runs.run_of_motion(task, study.full)])
    motion = cases.run(made.cases({}), kept_steps(task.family({}), task.interval))
    return errors.compare(study.full, motion).maximum


def page(report: dict[str, Any], parts: list[str]) -> str:
    """All models as a Markdown table, who is on the front, the outputs of the full model, then further parts."""
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
    ends = "; ".join(f"{name} {found['final']:.7g}, largest {found['max']:.7g}" for name, found in report["outputs"].items())
    words = [*comparison.summarise(report), f"Outputs of the full model at the end, SI units: {ends}.", *parts]
    return "\n".join([*lines, "", *(f"{text}\n" for text in words)])


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
