"""`fmbs check`: a scene and its meshes, read, assembled and judged before any run."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from . import common
from .common import Result, Session

if TYPE_CHECKING:
    from ..scenes import Scene
    from ..systems import System

NAME = "check.json"
SECONDS_A_STEP, SECONDS_A_CELL = 5e-6, 1.5e-6  #: of a usual computer [s]; for orders of magnitude only


@common.command("check")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of a dynamic analysis.")
def command(session: Session, duration: float | None) -> Result:
    """Read SCENE and its meshes, assemble it in the form it is solved in, check the initial state, and say what it is.

    Nothing is solved; --out writes check.json.
    """
    from ..dynamics.integration import GeneralizedAlpha, consistent_start
    from ..scenes import build
    from ..systems import compile_system
    from ..systems.redundancy import without_redundant
    from . import solving

    scene = common.read_scene(session, duration)
    raw = solving.system(session, scene)
    common.announce_compiling()
    form = build.chosen_form(scene, raw)
    reduced = without_redundant(form)
    consistent_start(compile_system(reduced), GeneralizedAlpha(getattr(scene.analysis, "step", 1e-3)))
    parts = bodies(session, scene)
    eliminated = len(raw.constraints.names) - len(form.constraints.names)
    dropped = len(form.constraints.names) - len(reduced.constraints.names)
    found: dict[str, Any] = {
        "status": "ok",
        **solving.heading(scene),
        **solving.sizes(raw, reduced),
        "redundant_constraints": eliminated - (raw.size - reduced.size) + dropped,
        "mass": sum(part["mass"] for part in parts),
        "bodies": parts,
        "joints": dict(Counter(joint for joint, _ in raw.constraints.names)),
        "estimates": estimates(scene, reduced, sum(part["cells"] for part in parts)),
        "outputs": [column for output in raw.outputs.values() for column in output.columns],
        "fingerprint": common.fingerprint(scene),
        "versions": common.versions(),
    }
    if session.out is not None:
        out = common.folder(session, session.out, [NAME], found["fingerprint"], record=NAME)
        common.write_json(out / NAME, {**found, "notices": session.notices})
    return Result(found, view(found))


def bodies(session: Session, scene: Scene) -> list[dict[str, Any]]:
    """Cells, coordinates and mass [kg] of every body."""
    from ..scenes import build

    found = []
    for name, model in scene.bodies.items():
        part = build.part(model, scene, name, None, session.allow_outside)
        cells = 0 if part.cells is None else part.cells.section.shape[2]
        mass = float(part.constant @ (part.mass @ part.constant))
        found.append({"name": name, "cells": int(cells), "dofs": part.reference.size, "mass": mass})
    return found


def estimates(scene: Scene, reduced: System, cells: int) -> dict[str, float]:
    """Steps, stored states, memory of the trajectory [MB] and order of magnitude of the time [s] of a dynamic analysis."""
    from ..scenes import build

    analysis = scene.analysis
    if analysis.type != "dynamic":
        return {}
    steps = round(analysis.duration / analysis.step)
    every = build.kept_steps(scene)
    stored = len(every) if isinstance(every, np.ndarray) else steps // every + 1
    return {
        "steps": steps,
        "stored_states": stored,
        "memory_mb": round(3 * 8e-6 * stored * reduced.size, 3),
        "wall_s": float(f"{steps * (SECONDS_A_STEP + cells * SECONDS_A_CELL):.1g}"),
    }


def view(found: dict[str, Any]) -> list[Any]:
    """The tables of a checked scene."""
    bodies = [tuple(body.values()) for body in found["bodies"]]
    facts = [(key, found[key]) for key in ("dofs", "constraints", "unknowns", "multipliers", "redundant_constraints", "mass")]
    return [
        f"{found['scene']} ({found['analysis']}): the scene is sound",
        common.table("Bodies", ("body", "cells", "dofs", "mass [kg]"), bodies),
        common.table("Joints", ("joint", "constraints"), found["joints"].items()),
        common.table("System", ("", ""), [*facts, *((f"estimated {key}", value) for key, value in found["estimates"].items())]),
    ]
