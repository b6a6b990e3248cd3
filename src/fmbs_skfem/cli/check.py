"""`fmbs check`: a scene and its meshes, read, assembled and judged before any run."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from ..core.errors import InputError, Reason, SolverError, say
from ..core.notices import notify
from . import common, reports, screen
from .common import Result, Session

if TYPE_CHECKING:
    from ..bodies.body import Body
    from ..scenes import Scene
    from ..scenes.plausibility import Figures
    from ..systems import System
    from ..systems.mechanism import Dependence, Mechanism

NAME = "check.json"
LOST = 0.5  #: part of the kinetic energy of the given initial motion that joints may take away
AGREE = 1e-9  #: of the size of the scene: linear rows that miss each other by less agree
#: orders of magnitude of a usual computer: seconds a number read, solved with, factored, factored by SuperLU, and seconds a call
FORCE_S, SOLVE_S, FACTOR_S, LU_S, CALL_S = 1.2e-9, 1e-9, 5e-10, 1.5e-7, 2e-6
ITERATIONS, FACTORED = 2.5, 0.2  #: of a time step
CYCLES = 150.0  #: products with the matrix in a solution by multigrid
STATIC_ITERATIONS, LANCZOS = 6.0, 60.0  #: a load step: iterations; modes: solutions


@common.command("check")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of a dynamic analysis.")
def command(session: Session, duration: float | None) -> Result:
    """Read SCENE and its meshes, assemble it in the form it is solved in, check the initial state, and say what it is.

    Told are: masses, units, slenderness and cells that are hardly meant, joints that are redundant or contradict each other,
    degrees of freedom, bodies that no joint ties to the ground, initial motion that joints forbid, solver, memory and time. Notices
    stop nothing unless --strict is given. Nothing is solved; --out writes check.json. SCENE may also be a folder with results:
    every file in it that a report or a history vouches for is held against its checksum (exit code 8).
    """
    from ..scenes import build, plausibility
    from . import solving

    if session.path.is_dir():
        return checksums(session.path)
    scene = common.read_scene(session, duration)
    build.check_functions(scene)
    parts = {part.name: part for part in build.parts(scene, None, session.allow_outside)}
    raw = lighter(build.of_parts(scene, list(parts.values()), pictures=False))
    known = plausibility.figures(scene, parts)
    tell_findings(scene, known)
    screen.announce_compiling()
    redundant = contradictions(raw)
    counted = mechanism(scene, raw)
    reduced, initial = solved_form(scene, raw)
    eliminated = raw.size - reduced.size
    found: dict[str, Any] = {
        "status": "ok",
        **solving.heading(scene),
        **solving.sizes(raw, reduced),
        "redundant_constraints": len(raw.constraints.names) - eliminated - len(reduced.constraints.names),
        "redundant": [{"row": dependence.row, "follows_from": dependence.on} for dependence in redundant],
        "mass": sum(figure.mass for figure in known.values()),
        "bodies": [described(figure, parts[name], counted) for name, figure in known.items()],
        "joints": dict(Counter(joint for joint, _ in raw.constraints.names)),
        "mechanism": mechanism_report(counted),
        "initial": initial,
        "estimates": estimates(scene, raw, reduced),
        "outputs": [column for output in raw.outputs.values() for column in output.columns],
        "fingerprint": reports.fingerprint(scene),
        "provenance": reports.provenance(scene),
    }
    if session.out is not None:
        out = reports.folder(session, session.out, [NAME], found["fingerprint"], record=NAME)
        reports.keep(session, out, found, NAME)
    return Result(found, view(found))


def checksums(folder: Path) -> Result:
    """The results in a folder, every byte as it was written."""
    from ..results import segments

    found = reports.verified(folder)
    if segments.exists(folder):
        segments.read(folder)
        found.append(folder / segments.FOLDER)
    if not found:
        raise InputError(say(f"{folder}", "a scene, or a folder with results", "a folder without a report"))
    return Result({"status": "ok", "verified": found}, ["as written: " + ", ".join(map(str, found))])


def tell_findings(scene: Scene, known: Mapping[str, Figures]) -> None:
    """Notices of what is hardly meant and was not told when the scene was read."""
    from ..scenes import consistency, plausibility, where

    told = {keys for keys, _ in consistency.notices(scene)}
    for finding in plausibility.findings(scene, known):
        if finding.keys not in told:
            notify(f"{where(scene, *finding.keys)}: {finding}")


def contradictions(raw: System) -> tuple[Dependence, ...]:
    """Redundant rows; those that contradict what they follow from, or drive what is held already, stop the check."""
    from ..systems import mechanism

    found = mechanism.redundant(raw)
    wrong = sorted((one for one in found if one.gap > AGREE * raw.scale), key=lambda one: -one.gap)
    if wrong:
        listed = ", ".join(f"{one.row} by {one.gap:.3g} m with {' and '.join(one.on)}" for one in wrong)
        worst = tuple((one.row, one.gap) for one in wrong)
        raise SolverError(f"joints contradict each other: {listed}; remove or move one", Reason.INCONSISTENT, 0.0, worst)
    if driven := mechanism.driven_against(raw, found):
        raise mechanism.conflict(driven)
    return found


def mechanism(scene: Scene, raw: System) -> Mechanism:
    """Degrees of freedom; floating bodies are told, and stop a static problem with every motion that nothing resists."""
    from ..scenes import where
    from ..systems import free_motions, mechanism

    if scene.analysis.type == "modes":
        free_motions.refuse_limp(where(scene, "analysis"), raw)
    found = mechanism.analyse(raw)
    if scene.analysis.type == "static":
        free, hung = free_motions.unsupported(raw)
        for motion in hung:
            notify(f"{where(scene, 'analysis')}: weight alone holds this motion, so that the first iteration is singular: {motion}")
        if free:
            listed = "".join(f"\n  {number}. {motion}" for number, motion in enumerate(free, start=1))
            got = f"{len(free)} rigid motion{'s' if len(free) > 1 else ''} that nothing resists:{listed}"
            raise InputError(say(where(scene, "analysis"), "bodies that joints and springs hold", got, "\nhold them by joints"))
    for group in found.floating if scene.analysis.type != "static" else ():
        named, hang = " and ".join(f"'{name}'" for name in group.bodies), len(group.bodies) > 1
        text = f"{named} hang{'' if hang else 's'} on no joint to the ground: {'they move' if hang else 'it moves'} freely"
        notify(f"{where(scene, 'bodies', group.bodies[0])}: {text}")
    if found.at_start > found.mobility:
        notify(f"the start is a singular position: {found.at_start} degrees of freedom there, {found.mobility} near it")
    if scene.analysis.type == "dynamic" and not raw.elastic and not found.mobility:
        notify("nothing can move: all bodies are rigid, and joints leave no degree of freedom")
    return found


def lighter(raw: System) -> System:
    """A wide system at rest without its mass, of which check reads nothing, and which would fill the memory."""
    from ..systems import compiled

    if raw.size < compiled.WIDE or raw.v0.any() or (raw.constraints.signal >= 0).any():
        return raw
    empty = type(raw.mass)(raw.mass.shape)
    return replace(raw, mass=empty, metric=empty)


def solved_form(scene: Scene, raw: System) -> tuple[System, dict[str, Any]]:
    """The form the scene is solved in, and what its joints make of the initial state; velocities are those of motions alone."""
    from ..dynamics import loading, start
    from ..dynamics.scheme import GeneralizedAlpha
    from ..scenes import build
    from ..systems.redundancy import without_redundant

    reduced = without_redundant(build.chosen_form(scene, raw))
    if scene.analysis.type != "dynamic":
        start.hold(loading.ramped(reduced, scene.analysis.time) if scene.analysis.type == "static" else reduced)
        return reduced, {"position_change": float(np.abs(reduced.lift(reduced.x0) - raw.x0).max(initial=0.0))}
    gaps = velocity_gaps(raw)
    x, v = start.admissible(reduced, GeneralizedAlpha(scene.analysis.step))
    taken = np.asarray(reduced.lift.matrix @ v)
    given, left = (float(u @ (raw.mass @ u)) for u in (raw.v0, taken))
    lost = max(0.0, 1.0 - left / given) if given > 0.0 else 0.0
    if lost > LOST:
        from ..scenes import where

        listed = ", ".join(f"{name} by {gap:.3g} m/s" for name, gap in gaps[:3])
        got = f"{100 * lost:.3g} % of their kinetic energy against {listed}"
        raise InputError(
            say(where(scene, "initial"), "velocities that the joints permit", got, "give motions of all joined bodies")
        )
    moved = float(np.abs(reduced.lift(x) - raw.x0).max(initial=0.0))
    return (
        reduced,
        {
            "position_change": moved,
            "velocity_change": float(np.abs(taken - raw.v0).max(initial=0.0)),
            "energy_lost": lost,
            "worst_velocities": [{"row": name, "gap": gap} for name, gap in gaps[:5]],
        },
    )


def velocity_gaps(raw: System) -> list[tuple[str, float]]:
    """Rows that the given velocities break, Phi_q v + Phi_t, the largest first; Phi_t by differences over 2 us."""
    from ..systems.compiled import signal_table
    from ..systems.redundancy import rows_of

    if not raw.constraints.names:
        return []
    (rows, z), d = rows_of(raw), 1e-6
    first, second, third = (replace(rows, signals=signal_table(raw, np.array([k * d]))[0])(z)[0] for k in range(3))
    gap = np.abs(rows(z)[1] @ raw.v0[rows.used] + (4 * second - 3 * first - third) / (2 * d))
    bound = 1e-6 * max(1.0, float(np.abs(raw.v0).max(initial=0.0)))
    return [(".".join(raw.constraints.names[k]), float(gap[k])) for k in np.argsort(-gap) if gap[k] > bound]


def described(figure: Figures, part: Body, counted: Mechanism) -> dict[str, Any]:
    """A body in the report."""
    cells = figure.cells
    return {
        "name": figure.name,
        "cells": 0 if cells is None else cells.count,
        "dofs": part.reference.size,
        "mass": figure.mass,
        "rigid_motions": counted.bodies[figure.name],
        "extent": figure.extent,
        "wave_speed": figure.wave_speed,
        "slenderness": figure.slenderness,
        "sag": figure.sag,
        "weight_strain": figure.weight_strain,
        "mesh": None if cells is None else asdict(cells),
    }


def mechanism_report(found: Mechanism) -> dict[str, Any]:
    """Degrees of freedom in the report: by rank and by Gruebler's formula, with every joint."""
    return {
        "rigid_motions": sum(found.bodies.values()),
        "joints": [asdict(joint) for joint in found.joints],
        "degrees_of_freedom": found.mobility,
        "gruebler": found.gruebler,
        "overconstrained": [{"row": one.row, "follows_from": one.on} for one in found.overconstrained],
        "at_start": found.at_start,
        "left_by_drives": found.free,
        "floating": [group.bodies for group in found.floating],
    }


def estimates(scene: Scene, raw: System, reduced: System) -> dict[str, Any]:
    """Solver, steps, memory [MB] and order of magnitude of the time [s] of an analysis, by counts of numbers read and written."""
    from ..scenes import build

    analysis, (label, fill, once, each) = scene.analysis, solver(scene, raw, reduced)
    numbers = numbers_read(reduced)
    tables = 8e-6 * numbers / max(reduced.dim, 1)
    found: dict[str, Any] = {"solver": label, "solver_memory_mb": round(fill + tables, 3)}
    if analysis.type == "static":
        seconds = analysis.load_steps * STATIC_ITERATIONS * (4 * FORCE_S * numbers + once)
        return {**found, "load_steps": analysis.load_steps, "wall_s": float(f"{seconds:.1g}")}
    if analysis.type == "modes":
        return {**found, "modes": analysis.count, "wall_s": float(f"{4 * FORCE_S * numbers + once + LANCZOS * each:.1g}")}
    steps, every = round(analysis.duration / analysis.step), build.kept_steps(scene)
    stored = len(every) if isinstance(every, np.ndarray) else steps // every + 1
    step = ITERATIONS * (FORCE_S * numbers + each + CALL_S) + FACTORED * (4 * FORCE_S * numbers + once)
    return {
        **found,
        "steps": steps,
        "stored_states": stored,
        "memory_mb": round(3 * 8e-6 * stored * reduced.size, 3),
        "step_s": float(f"{step:.1g}"),
        "wall_s": float(f"{steps * step:.1g}"),
    }


def numbers_read(system: System) -> float:
    """Products of a table entry with a coordinate, over all cells, in one evaluation of the forces."""
    from ..bodies.body import Cells

    found = 0.0
    for part in system.elastic:
        if isinstance(part.gather, Cells):
            found += math.prod(part.gather.shape) * part.gather.dim**2
    return found


def solver(scene: Scene, raw: System, reduced: System) -> tuple[str, float, float, float]:
    """Name, memory [MB], and seconds of a factorisation and of a solution of the linear systems of an analysis."""
    from ..systems import compiled

    n, m = reduced.size, len(reduced.constraints.names)
    form, width = compiled.storage(reduced)
    fill = float(n * width) if form is compiled.Storage.BAND else 0.5 * n**2
    if form is compiled.Storage.SPARSE:
        fill, label, memory, each = sparse_solver(raw)
    elif form is compiled.Storage.DENSE:
        label, memory, each = "dense LU", 16e-6 * (n + m) ** 2, 2 * SOLVE_S * (n + m) ** 2
    else:
        label, memory, each = f"band of half width {width}", 32e-6 * n * (width + 1), 4 * SOLVE_S * fill
    if scene.analysis.type != "dynamic":
        return "sparse LU", 16e-6 * fill, LU_S * fill, 4 * SOLVE_S * fill
    sparse = form is compiled.Storage.SPARSE
    once = FACTOR_S * fill * (np.sqrt(fill / n) * 8 if sparse else n if form is compiled.Storage.DENSE else width)
    return label, memory, once / (20 if sparse else 1), each


def sparse_solver(raw: System) -> tuple[float, str, float, float]:
    """Numbers in the factors of a large model, and name, memory [MB] and seconds a solution of what solves it.

    Factors of the pattern of functions, each of which stands for a vector of unknowns.
    """
    from ..core import direct, krylov
    from ..systems import sparse

    W, dim = sparse.function_pattern(raw), raw.dim
    n, fill = dim * W.shape[0], float(dim**2 * direct.entries(direct.analyse(W)))
    if krylov.choose(n, fill, krylov.free_memory(), 4.0) == "direct":
        return fill, f"sparse LDL^T with {fill:.3g} numbers", 1e-6 * (5.2 * fill + krylov.BYTES_PER_UNKNOWN * n), SOLVE_S * fill
    return fill, "conjugate gradients with multigrid", 36e-6 * dim**2 * W.nnz, CYCLES * SOLVE_S * dim**2 * W.nnz


def view(found: dict[str, Any]) -> list[Any]:
    """The tables of a checked scene."""
    columns = ("name", "cells", "dofs", "mass", "rigid_motions", "extent", "wave_speed", "slenderness", "sag")
    titles = ("body", "cells", "dofs", "mass [kg]", "rigid motions", "size [m]", "wave speed [m/s]", "slenderness", "sag / length")
    rows = [[dash(body[key]) for key in columns] for body in found["bodies"]]
    keys = ("count", "size_ratio", "aspect", "angle", "jacobian")
    meshes = [(body["name"], *(body["mesh"][key] for key in keys)) for body in found["bodies"] if body["mesh"]]
    counted = {joint["name"]: joint for joint in found["mechanism"]["joints"]}
    joints = [joint_row(name, count, counted.get(name)) for name, count in found["joints"].items()]
    facts = [(key, found[key]) for key in ("dofs", "constraints", "unknowns", "multipliers", "redundant_constraints", "mass")]
    facts += [(f"initial {key}", value) for key, value in found["initial"].items() if isinstance(value, float) and value > 1e-9]
    parts = [
        f"{found['scene']} ({found['analysis']}): the scene is sound",
        screen.table("Bodies", titles, rows),
        screen.table("Joints", ("joint", "constraints", "rigid motions taken", "ties"), joints),
        mechanism_table(found["mechanism"]),
        screen.table("System", ("", ""), [*facts, *((f"estimated {key}", value) for key, value in found["estimates"].items())]),
    ]
    redundant = [(one["row"], ", ".join(one["follows_from"])) for one in found["redundant"]]
    parts += [screen.table("Redundant rows", ("row", "follows from"), redundant)] if redundant else []
    heads = ("mesh of", "cells", "largest / smallest", "aspect", "angle [deg]", "Jacobian ratio")
    return [*parts[:2], *([screen.table("Meshes", heads, meshes)] if meshes else []), *parts[2:]]


def dash(value: object) -> object:
    return "-" if value is None else value


def joint_row(name: str, constraints: int, counted: dict[str, Any] | None) -> tuple[object, ...]:
    """A joint, or the axes of a frame, in the table."""
    if counted is None:
        return name, constraints, "-", "axes of a frame"
    ends = [*counted["bodies"], *(["ground"] if counted["ground"] else [])]
    return name, constraints, counted["rows"], " - ".join(ends) + (" (driven)" if counted["driven"] else "")


def mechanism_table(found: dict[str, Any]) -> Any:
    """Gruebler's count beside the count by rank."""
    taken = sum(joint["rows"] for joint in found["joints"] if not joint["driven"])
    involved = {name.partition(".")[0]: None for one in found["overconstrained"] for name in (one["row"], *one["follows_from"])}
    excess = f"{len(found['overconstrained'])} ({', '.join(involved)})" if involved else "0"
    rows = [
        ("rigid motions of all bodies", found["rigid_motions"]),
        ("taken by joints, one by one", taken),
        ("degrees of freedom by Gruebler's count", found["gruebler"]),
        ("conditions too many for rigid bodies", excess),
        ("degrees of freedom by rank", found["degrees_of_freedom"]),
        ("left by drives", found["left_by_drives"]),
    ]
    return screen.table("Mechanism", ("", ""), rows)
