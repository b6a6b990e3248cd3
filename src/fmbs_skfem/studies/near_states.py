"""Vibration modes and buckling loads of a scene: about the equilibrium of its loads, in a turning frame, or about the reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import dynamics
from ..core.errors import InputError, say
from ..core.notices import notify
from ..dynamics import Linear, Newton
from ..results import segments
from ..scenes import build, where
from ..systems import System, compile_system, compiled, free_motions
from . import recording, reports
from .job import Job
from .result import Table, list_files
from .runs import MODES, Run, heading, sizes

if TYPE_CHECKING:
    from ..scenes import Scene

FACTORS = "factors.csv"
GROWS = 1e-6  #: real part of an eigenvalue, over the largest one listed, from which a motion grows


@dataclass(frozen=True)
class Motions:
    """What is listed of modes, slowest first."""

    omega: np.ndarray  #: (i,) angular frequencies [rad/s]
    growth: np.ndarray  #: (i,) real parts of the eigenvalues [1/s]
    damping: np.ndarray | None  #: (i,) damping ratios, None of undamped modes


def solve_modes(job: Job, scene: Scene) -> Run:
    """Vibration modes of a scene: frequencies, and where they are complex damping ratios and growth, also in modes.csv."""
    mark = reports.fingerprint(scene)
    with recording.place(job, (MODES, reports.REPORT), mark) as out:
        raw, reduced, about = model_of(scene, job.allow_outside)
        found = find(scene, linear_equations(scene, reduced, about), about)
        report = {
            **begin(scene, raw, reduced, mark),
            "about": about,
            "frequencies_hz": found.omega / (2 * np.pi),
            "notices": job.notices,
        }
        columns = {
            "mode": np.arange(1, len(found.omega) + 1),
            "frequency_hz": report["frequencies_hz"],
            "omega_rad_per_s": found.omega,
        }
        heads = ["mode", "frequency [Hz]", "omega [rad/s]"]
        if found.damping is not None:
            report |= {"damping_ratios": found.damping, "growth_per_s": found.growth}
            columns |= {"damping_ratio": found.damping, "growth_per_s": found.growth}
            heads += ["damping ratio", "growth [1/s]"]
        write(job, report, out, MODES, columns)
    rows = list(zip(*(values.tolist() for values in columns.values()), strict=True))
    table = Table(f"{report['scene']}: vibration modes about the {about}", tuple(heads), rows)
    title = f"{report['scene']}: {len(found.omega)} vibration modes"
    return Run(about=title, report=report, view=[table, *list_files(report)], frequencies=report["frequencies_hz"])


def solve_buckling(job: Job, scene: Scene) -> Run:
    """Load factors at which the loads of a scene take its stiffness away, also in factors.csv."""
    analysis: Any = scene.analysis
    mark = reports.fingerprint(scene)
    with recording.place(job, (FACTORS, reports.REPORT), mark) as out:
        raw = build.system(scene, allow_outside=job.allow_outside)
        reduced = build.chosen_form(scene, raw)
        factors = dynamics.buckling(reduced, analysis.count, analysis.time).factors
        report = {**begin(scene, raw, reduced, mark), "load_factors": factors, "notices": job.notices}
        columns = {"mode": np.arange(1, len(factors) + 1), "load_factor": factors}
        write(job, report, out, FACTORS, columns)
    rows = list(zip(*(values.tolist() for values in columns.values()), strict=True))
    table = Table(f"{report['scene']}: buckling", ("mode", "load factor"), rows)
    return Run(about=f"{report['scene']}: {len(factors)} load factors", report=report, view=[table, *list_files(report)])


def model_of(scene: Scene, allow_outside: bool) -> tuple[System, System, str]:
    """The system with all coordinates, the one that is solved, and what its modes are about: the equilibrium or the reference.

    The equilibrium of a scene without loads and spin is the reference.
    """
    analysis: Any = scene.analysis
    springs = {name: load for name, load in scene.loads.items() if load.resists}
    loaded = analysis.spin is not None or not all(load.rests for load in scene.loads.values())
    about = analysis.about if loaded else "reference"
    if about == "reference":
        scene = scene.model_copy(update={"loads": springs})
    raw = build.system(scene, allow_outside=allow_outside)
    if about == "reference":
        free_motions.refuse_limp(where(scene, "analysis"), raw)
    elif free := free_motions.unsupported(raw)[0]:
        got = "; ".join(map(str, free))
        remedy = "hold them by joints, or take the modes about the reference"
        raise InputError(say(where(scene, "analysis"), "bodies that joints and springs hold", f"free motions: {got}", remedy))
    turned = raw if analysis.spin is None else dynamics.in_turning_frame(raw, analysis.spin)
    return raw, build.chosen_form(scene, turned), about


def linear_equations(scene: Scene, system: System, about: str) -> Linear:
    """The equations about the equilibrium or the reference."""
    analysis: Any = scene.analysis
    if about == "reference":
        return dynamics.linearise(system)
    path = dynamics.solve_statics(system, analysis.load_steps, Newton(analysis.tolerance), analysis.time)
    kept = compiled.memories(compile_system(path.system), path.times, path.x, path.v, path.a)[-1]
    return dynamics.linearise(path.system, path.x[-1], path.multipliers[-1], 1.0, kept)


def find(scene: Scene, linear: Linear, about: str) -> Motions:
    """Modes of linear equations; motions that grow are told."""
    analysis: Any = scene.analysis
    complete = analysis.damped or analysis.spin is not None or not dynamics.is_symmetric(linear)
    if complete:
        modes = dynamics.complex_modes(linear, analysis.count)
        found = Motions(modes.frequencies, modes.eigenvalues.real, modes.damping_ratios)
    else:
        squares = dynamics.real_modes(linear, analysis.count).squares
        found = Motions(np.sqrt(np.maximum(squares, 0.0)), np.sqrt(np.maximum(-squares, 0.0)), None)
    size = float(np.hypot(found.omega, found.growth).max())
    if growing := np.flatnonzero(found.growth > GROWS * size).tolist():
        listed = ", ".join(f"mode {k + 1} by {found.growth[k]:.3g} 1/s" for k in growing[:3])
        kind = "flutter" if (found.omega[growing] > GROWS * size).any() else "divergence"
        notify(f"{where(scene, 'analysis')}: the {about} is unstable ({kind}): {listed}{' ...' if len(growing) > 3 else ''}")
    return found


def begin(scene: Scene, raw: System, reduced: System, mark: str) -> dict[str, Any]:
    """What every report says first."""
    return {"status": "ok", **heading(scene), **sizes(raw, reduced), "fingerprint": mark, "provenance": reports.provenance(scene)}


def write(job: Job, report: dict[str, Any], out: Any, name: str, columns: Mapping[str, np.ndarray]) -> None:
    """A table and the report, where there is a folder."""
    if out is not None:
        with segments.room(out):
            reports.write_csv(out / name, columns, ["%d", *["%.15g"] * (len(columns) - 1)])
        report["files"] = [out / name, out / reports.REPORT]
        reports.write_report(out, report)
