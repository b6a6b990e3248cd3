"""Points of bodies as linear functions of the unknowns, for viewers of an FMU.

    p = offset + matrix x [m]

of centre lines and middle surfaces, in space, x y z one after the other; and the bodies at the
start with skins around these points.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError, say
from ..dynamics.outputs import centre_lines, skins
from ..dynamics.trajectory import Trajectory
from ..reduction.affine import ParametricCase
from ..reduction.cases import Case
from ..results import frames as frames_
from ..results import gltf, motion
from ..results.frames import Mark, Shown
from ..results.motion import spatial
from ..systems import compiled
from ..systems.system import System, in_scene
from .numbers import Numbers

MOST = 500  #: points; each costs 24 n bytes in a binary
#: leaves of a case that points depend on
SHOWN = "lift", "lines", "skins", "unit", "origin"
FILE = "resources/shape.json"
SKIN = "resources/shape.glb"


class ShownPoints(NamedTuple):
    """Points (x, 3) of bodies, x of them, of n unknowns in the order of the step."""

    matrix: np.ndarray  #: (3 x, n)
    offset: np.ndarray  #: (3 x,) [m]
    bodies: dict[str, dict[str, Any]]  #: first point, number of points, and cells of surfaces
    skin: bytes  #: of all bodies at the start, binary glTF


def find_shape(case: Case | ParametricCase, system: System, where: str) -> ShownPoints:
    """The points of all bodies with lines or surfaces, of the system at the start of its motion;
    InputError, after `where`, where there are none or too many, or where parameters move them in
    their bodies.
    """
    given = Numbers(case) if isinstance(case, Case) else Numbers(case.nominal, case)
    moved = () if given.model is None else given.model.varying
    if any(one.place[0] == "system" and one.place[1] in SHOWN for one in moved):
        expected = "bodies whose shapes no parameter changes"
        raise InputError(say(where, expected, "a range of shapes", "fix them with --set"))
    zero = np.zeros(system.size)
    found = points_at(system, zero)
    bodies: dict[str, dict[str, Any]] = {}
    first = 0
    cells = {one.name: one.cells.tolist() for one in system.skins}
    for name, points in found.items():
        about = {"first": first, "points": len(points)}
        bodies[name] = about | ({"cells": cells[name]} if name in cells else {})
        first += len(points)
    if not 0 < first <= MOST:
        raise InputError(say(where, f"1 to {MOST} points of lines and surfaces", first))
    offset = np.concatenate([*found.values()]).ravel()
    columns = [
        np.concatenate([*points_at(system, unit).values()]).ravel() - offset
        for unit in np.eye(system.size)
    ]
    order = compiled.compile_system(system).order
    matrix = np.stack(columns, axis=1)[:, order]
    return ShownPoints(matrix, offset, bodies, skin_of(system, bodies))


def skin_of(system: System, bodies: Mapping[str, Mapping[str, Any]]) -> bytes:
    """Bodies with points at the start, as binary glTF; extras of a node say which points are its."""
    start, still = system.x0[None], np.zeros((1, system.size))
    none = np.zeros((1, len(system.constraints.names)))
    shown = motion.frames(Trajectory(system, np.zeros(1), start, still, still, none), wanted=())
    radius = {line.name: line.radius for line in system.lines}
    meshes = {}
    extras = {}
    for name, about in bodies.items():
        body = (
            shown.bodies[name] if name in shown.bodies else alone(shown.marks[name], radius[name])
        )
        meshes[name] = gltf.make_mesh(body, about["points"])
        extras[name] = {key: about[key] for key in ("first", "points")}
    return gltf.write(meshes, extras, system.dim == 2)


def alone(mark: Mark, radius: float) -> Shown:
    """A body of one point."""
    return frames_.line(mark.points[:, None], {}, radius, mark.points[:1])


def points_at(system: System, x: np.ndarray) -> dict[str, np.ndarray]:
    """Points (x, 3) [m] of every body at unknowns (n,)."""
    q = in_scene(system, system.lift(x))
    lines = {name: spatial(one[0, 0]) for name, one in centre_lines(system, q[None]).items()}
    return lines | {name: spatial(one[0]) for name, one in skins(system, q).items()}


def text_of(shape: ShownPoints) -> str:
    """Which points of the array are those of a body, and cells of surfaces, as JSON."""
    return json.dumps({"bodies": shape.bodies}, indent=1)
