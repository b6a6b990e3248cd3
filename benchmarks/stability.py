"""Figures of docs/stability.md: reduced models of example 2 beyond their training, energy, DEIM,
condition numbers, noise floor.

    python benchmarks/stability.py [--write]

`--write` puts the tables between the marks of docs/stability.md and into
benchmarks/results/stability.md and .json.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import reduction, scenes
from fmbs_skfem.core.algebra import saddle
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.errors import SolverError
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    energies,
    energy_drift,
    integrate,
)
from fmbs_skfem.dynamics.scheme import DYNAMIC, method_of
from fmbs_skfem.reduction import Level
from fmbs_skfem.reduction.hyper import sampling
from fmbs_skfem.reduction.spaces.component import projected
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import System, compile_system, compiled, eliminate

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "examples"))
import deim  # noqa: E402  an example

PAGE, RESULTS = ROOT / "docs" / "stability.md", ROOT / "benchmarks" / "results"
BEGIN, END = "<!-- figures of benchmarks/stability.py -->", "<!-- end of figures -->"
SCHEME, SHARP = GeneralizedAlpha(5e-4), Newton(1e-12)
EPS, ETA, TRAINING, EVERY = 1e-12, 1e-3, 3.0, 10
HORIZON = 10  #: times the training
CELLS: int | None = None  #: cells a beam of the compared models, those of the mesh file for None
FEW = 16  #: cells a beam of the runs that differ in step and damping


@dataclass(frozen=True)
class Trained:
    """Example 2 in full and reduced."""

    full: System
    run: Trajectory
    raw: System
    reduced: dict[str, System]
    galerkin: System
    data: reduction.Snapshots


def trained() -> Trained:
    """Component level with eps = 1e-12, without ECSW and with it over elements and over points."""
    raw = build.system(scenes.read(ROOT / "examples" / "double_pendulum.yaml"), CELLS)
    full = eliminate(raw)
    run = integrate(full, SCHEME, TRAINING, SHARP, EVERY)
    data, parts = reduction.snapshots(run), reduction.body_level(raw)
    plain = reduction.reduce_system(raw, parts, reduction.bases(raw, data, parts, EPS))
    states, found = projected(plain, data.q), {"reduced": plain}
    for level in Level:
        found[f"reduced, ECSW over {level.value}"] = sampling.apply(
            plain, sampling.train([(plain, states)], ETA, level)
        )
    return Trained(full, run, raw, found, plain, data)


def long_runs(model: Trained) -> list[dict[str, Any]]:
    """Ten times the training horizon: how far every model gets, and its energy."""
    rows = []
    for name, system in {"full": model.full, **model.reduced}.items():
        run, failed = attempted(system, HORIZON * TRAINING, SCHEME)
        rows.append(
            {"model": name, "end [s]": float(run.times[-1]), "failed": failed, **energy(run)}
        )
    return rows


def losses() -> list[dict[str, Any]]:
    """The energy of the full model on a coarser mesh over ten times the training horizon, by step
    and algorithmic damping.
    """
    system = eliminate(build.system(scenes.read(ROOT / "examples" / "double_pendulum.yaml"), FEW))
    rows = []
    for step, rho in (
        (SCHEME.step, 0.8),
        (SCHEME.step / 2, 0.8),
        (SCHEME.step, 0.95),
        (SCHEME.step, 1.0),
    ):
        run, failed = attempted(system, HORIZON * TRAINING, GeneralizedAlpha(step, rho))
        rows.append(
            {
                "h [s]": step,
                "rho_inf": rho,
                "end [s]": float(run.times[-1]),
                "failed": failed,
                **energy(run),
            }
        )
    return rows


def attempted(system: System, duration: float, scheme: GeneralizedAlpha) -> tuple[Trajectory, bool]:
    """The motion, or its part up to a failure."""
    try:
        return integrate(system, scheme, duration, Newton(), EVERY), False
    except SolverError as error:
        return error.partial, True


def energy(run: Trajectory) -> dict[str, float]:
    """Largest kinetic energy [J], what the balance has lost at the end and gained at most [J],
    halved steps.
    """
    found = energies(run)
    change = found[:, 3] - found[0, 3]
    return {
        "largest kinetic energy [J]": float(found[:, 0].max()),
        "lost at the end [J]": -float(change[-1]),
        "gained at most [J]": float(change.max()),
        "halved steps": run.statistics.halved,
    }


def errors_in_training(model: Trained) -> list[dict[str, Any]]:
    """Largest error and energy drift over the training horizon."""
    rows = [{"model": "full", "error": 0.0, **energy(model.run)}]
    for name, system in model.reduced.items():
        run = integrate(system, SCHEME, TRAINING, Newton(), EVERY)
        rows.append(
            {"model": name, "error": reduction.compare(model.run, run).maximum, **energy(run)}
        )
    return rows


def interpolated(model: Trained) -> list[dict[str, Any]]:
    """DEIM with more and more force modes on the same Galerkin basis."""
    rows = []
    for tolerance in (1e-8, 1e-12, 1e-16, 1e-20):
        found = deim.train(
            model.raw, model.galerkin, reduction.body_level(model.raw), model.data, tolerance
        )
        try:
            run, failed = integrate(found, SCHEME, TRAINING, Newton(), EVERY), False
        except SolverError as error:
            run, failed = error.partial, True
        parts = found.elastic[0].gather.parts.values()
        rows.append(
            {
                "force modes": " + ".join(str(len(one.rows)) for one in parts),
                "of rows": " + ".join(str(len(one.modes)) for one in parts),
                "amplification": max(one.amplification for one in parts),
                "end [s]": float(run.times[-1]),
                "failed": failed,
                "error": float("nan") if failed else reduction.compare(model.run, run).maximum,
                "energy drift [J]": float("nan") if failed else energy_drift(run),
            }
        )
    return rows


def conditions(model: Trained) -> list[dict[str, Any]]:
    """Condition numbers of the matrix of Newton's iteration at the start: as it stands, scaled by c
    = h^2 beta, and balanced.
    """
    rows = []
    for name, system in {
        "full, all multipliers": model.raw,
        "full": model.full,
        "reduced": model.galerkin,
    }.items():
        for h in (5e-4, 5e-6):
            rows.append({"model": name, "h [s]": h, **condition(system, h)})
    return rows


def condition(system: System, h: float) -> dict[str, float]:
    built = compile_system(system)
    method = method_of(SCHEME, Newton(), h, built)
    J = compiled.gap(built, system.x0)[1]
    W = as_dense(compiled.tangent(built, system.x0, np.zeros(len(J)))) + method.bh * as_dense(
        system.mass
    )
    plain, scaled = saddle.matrix(W, J), saddle.matrix(method.c * W, J)
    size = 1.0 / np.sqrt(np.abs(scaled).max(axis=1))
    return {
        "unscaled": float(np.linalg.cond(plain)),
        "c W": float(np.linalg.cond(scaled)),
        "balanced": float(np.linalg.cond(size[:, None] * scaled * size)),
    }


def noise(model: Trained) -> list[dict[str, Any]]:
    """What Newton's tolerance leaves: error of a run against one at 1e-13; smaller reduced errors
    mean nothing.
    """
    rows = []
    for name, system in (("full", model.full), ("reduced", model.galerkin)):
        sharp = integrate(system, SCHEME, TRAINING, Newton(1e-13), EVERY)
        for tolerance in (1e-8, 1e-10, DYNAMIC, 1e-12):
            found = reduction.compare(
                sharp, integrate(system, SCHEME, TRAINING, Newton(tolerance), EVERY)
            ).maximum
            rows.append({"model": name, "Newton tolerance": tolerance, "noise": found})
    return rows


def measured() -> dict[str, list[dict[str, Any]]]:
    """All tables."""
    model = trained()
    return {
        "Over the training horizon": errors_in_training(model),
        f"Over {HORIZON} times the training horizon": long_runs(model),
        f"The full model with {FEW} cells a beam over the same time": losses(),
        "DEIM on the same basis": interpolated(model),
        "Condition numbers": conditions(model),
        "Noise floor": noise(model),
    }


def table(rows: list[Mapping[str, Any]]) -> str:
    """A table in Markdown."""
    head = list(rows[0])
    lines = [head, ["---"] * len(head), *([text(row[name]) for name in head] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.3g}" if np.isfinite(value) else "-"
    return str(value)


def page(found: Mapping[str, list[dict[str, Any]]]) -> str:
    """The tables as a part of a page."""
    head = f"Example 2, 100 cells a beam, h = 5e-4 s, component level, eps = {EPS:g}, eta = {ETA:g}, trained on {TRAINING:g} s. "
    head += (
        "The error is the largest distance over the largest displacement, in the norm of the mass."
    )
    return "\n\n".join(
        [head, *(f"**{title}**\n\n{table(list(rows))}" for title, rows in found.items())]
    )


def write(body: str, found: Mapping[str, Any]) -> None:
    """Into the page and the results."""
    before, _, rest = PAGE.read_text().partition(BEGIN)
    PAGE.write_text(before + BEGIN + "\n\n" + body + "\n\n" + END + rest.partition(END)[2])
    (RESULTS / "stability.md").write_text(body + "\n")
    (RESULTS / "stability.json").write_text(json.dumps(found, indent=1) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    with threadpool_limits(1, user_api="blas"):
        found = measured()
    body = page(found)
    print(body)
    if options.write:
        write(body, found)


if __name__ == "__main__":
    main()
