r"""From trajectories to frames: centre lines with the fields that pictures and VTK series show.

    strain eps = (r'.r' - 1) / 2 [-],    curvature kappa = |r' x r''| / |r'|^3 [1/m],    velocity dr/dt [m/s]

r' and r'' are derivatives with respect to the reference arc length. Planar scenes lie in z = 0.
"""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError, say
from ..core.notices import notify
from ..dynamics import Trajectory
from ..dynamics.outputs import centre_lines
from ..results.frames import Frames, Kind, Lines
from ..scenes import Scene
from ..systems import System

#: kind of a marker of the system -> what is drawn
KINDS = {
    "pin": Kind.PIN,
    "spherical": Kind.SPHERICAL,
    "clamp": Kind.CLAMP,
    "distance": Kind.DISTANCE,
    "slider": Kind.SLIDER,
    "driven": Kind.DRIVEN_POSITION,
}


def frames(trajectory: Trajectory, rows: np.ndarray | None = None) -> Frames:
    """Centre lines, point masses and joints of a trajectory, full or reduced, at the stored times `rows` (all by default)."""
    rows = np.arange(len(trajectory.times)) if rows is None else rows
    system, x, v = trajectory.system, trajectory.x[rows], trajectory.v[rows]
    q = np.asarray(system.lift.matrix @ x.T).T + system.lift.offset
    rate = np.asarray(system.lift.matrix @ v.T).T
    now, moving, start = centre_lines(system, q), centre_lines(system, rate), centre_lines(system, system.lift(system.x0)[None])
    radius = {line.name: line.radius for line in system.lines}
    cables = [name for name, jets in now.items() if jets.shape[2] > 1]
    if not cables:
        raise InputError(say("picture", "a scene with at least one cable", "point masses only"))
    bodies = {name: lines(now[name], moving[name], start[name], radius[name]) for name in cables}
    masses = {name: (Kind.MASS.value, spatial(jets[:, 0, 0])) for name, jets in now.items() if jets.shape[2] == 1}
    return Frames(trajectory.times[rows], bodies, {**joints(system, x), **masses})


def lines(jets: np.ndarray, rates: np.ndarray, start: np.ndarray, radius: float) -> Lines:
    """One cable from its jets (s, 3, x, c): positions, slopes, curvature vectors."""
    position, slope, bend = (spatial(jets[:, k]) for k in range(3))
    square = np.einsum("sxc,sxc->sx", slope, slope)
    fields = {
        "strain": 0.5 * (square - 1.0),
        "curvature": np.linalg.norm(np.cross(slope, bend), axis=2) / square**1.5,
        "velocity": spatial(rates[:, 0]),
    }
    return Lines(position, fields, radius, spatial(start[0, 0]))


def spatial(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., c) with three components; planar ones get z = 0."""
    missing = 3 - vectors.shape[-1]
    return np.pad(vectors, [(0, 0)] * (vectors.ndim - 1) + [(0, missing)])


def joints(system: System, x: np.ndarray) -> dict[str, tuple[str, np.ndarray]]:
    """Every marked point of every joint: name -> kind and positions (s, 3); further points of a joint carry a number."""
    y = np.asarray(system.sensors.matrix @ x.T).T + system.sensors.offset
    found: dict[str, tuple[str, np.ndarray]] = {}
    for name, kind, rows in system.markers:
        for number in range(len(rows) // system.dim):
            own = list(rows[number * system.dim : (number + 1) * system.dim])
            found[name if number == 0 else f"{name} {number + 1}"] = (shown(system, name, kind), spatial(y[:, own]))
    return found


def shown(system: System, name: str, kind: str) -> str:
    """What is drawn for a joint; its constraint rows tell a driven angle from a driven position."""
    turned = (name, "angle") in (system.full or system).constraints.names
    return (Kind.DRIVEN_ANGLE if kind == "driven" and turned else KINDS[kind]).value


def spread(trajectory: Trajectory, count: int) -> np.ndarray:
    """Indices of `count` stored times evenly spread in time, each once."""
    return nearest(trajectory, np.linspace(trajectory.times[0], trajectory.times[-1], count).tolist())


def instants(scene: Scene, trajectory: Trajectory) -> list[float] | None:
    """The scene's instants that the trajectory reaches; None where there are none."""
    wanted = list(scene.pictures.instants) if scene.pictures else []
    reached = [float(time) for time in wanted if time <= trajectory.times[-1] * (1 + 1e-9)]
    if len(reached) < len(wanted):
        notify(f"pictures: {len(wanted) - len(reached)} instants after the end at {trajectory.times[-1]:g} s are left out")
    return reached or None


def color(scene: Scene, compared: bool = False) -> str:
    """The field that colours the bodies; the error only where there is a full model to compare with."""
    wanted = scene.pictures.color if scene.pictures else "curvature"
    if wanted == "error" and not compared:
        notify("pictures: the full model has no error; coloured by curvature")
        return "curvature"
    return wanted


def nearest(trajectory: Trajectory, wanted: list[float]) -> np.ndarray:
    """Indices of the stored times nearest to the wanted ones, each once."""
    return np.unique(np.abs(trajectory.times[None, :] - np.asarray(wanted)[:, None]).argmin(axis=1))
