r"""From trajectories to frames: centre lines and middle surfaces with the fields that pictures and
VTK series show.

    lines       strain (r'.r' - 1) / 2 [-],    curvature |r' x r''| / |r'|^3 [1/m],    velocity dr/dt [m/s]
                axial_force N [N] and bending_moment M [N m], with its sign in the plane, of `cable_sections`;
                von_mises |N|/A + |M| c/I [Pa] in the outermost fibre, where the section is known
    beams       their sections swept along the line, with what `swept` has
    surfaces    strain and curvature: principal value of largest size, with its sign;  membrane_strain, curvature_change: 11, 22, 12
                stress_top, stress_bottom [Pa] at z = t/2, -t/2: 11, 22, 12;  principal_top, principal_bottom [Pa]: s1 >= s2
                von_mises_top, von_mises_bottom [Pa];  von_mises: the larger of the two,
                von_mises_recovered: of stresses recovered from patches of cells;  velocity
                membrane_forces [N/m], bending_moments [N]: 11, 22, 12;  axis_1, axis_2: the axes 1 and 2, carried along
    solids      strain, von_mises, principal, stress_normal, stress_shear on the boundary, velocity (`solid_fields`)

r' and r'' are derivatives with respect to the reference arc length; components refer to reference
tangents of `stress_recovery`, stresses and forces are those of Piola and Kirchhoff, which are the
true ones where strains are small. Planar scenes lie in z = 0.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from ..bodies.solids import solid_law
from ..bodies.stress_recovery import principal, recover
from ..dynamics import Trajectory
from ..dynamics.outputs import centre_lines, skins
from ..systems import System
from ..systems.connections.constraint_functions import ARROWS, LINKS
from ..systems.measures.beam_sections import SweptLine
from ..systems.measures.cable_sections import CableLine
from ..systems.system import LineSamples, Skin, in_scene
from . import frames as frames_
from . import solid_fields, stress_errors, swept
from .frames import Frames, Mark, Shown
from .marks import MARKERS

#: made where it is asked for only: it takes longer than all others
RECOVERED = "von_mises_recovered"
WINDINGS = 5  #: of springs in pictures
WIDTH = 0.05  #: half of that of springs, over their length


def frames(
    trajectory: Trajectory, rows: np.ndarray | None = None, wanted: Collection[str] | None = None
) -> Frames:
    """Bodies and joints of a trajectory, full or reduced, at the stored times `rows`, with the
    fields `wanted` (all by default).

    Surfaces are evaluated one instant after the other, and only what is wanted is kept.
    """
    rows = np.arange(len(trajectory.times)) if rows is None else rows
    system = trajectory.system
    x = trajectory.x[rows]
    shown, masses = line_bodies(trajectory, rows, wanted)
    bodies = {**shown, **skin_bodies(trajectory, rows, wanted)}
    order = [name for name, _, _ in system.coordinates if name in bodies]
    moving = np.concatenate(
        [
            *(body.points for body in bodies.values()),
            *(mark.points[:, None] for mark in masses.values()),
        ],
        axis=1,
    )
    found = {name: bodies[name] for name in order} | links(
        system, x, {name for name, _, _ in system.coordinates}, moving
    )
    return Frames(
        trajectory.times[rows], found, {**joints(system, x), **masses, **arrows(system, x)}
    )


def expand(system: System, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Body coordinates and their rates of unknowns x (..., n) and rates v."""
    lift = system.lift
    return in_scene(system, np.asarray(lift.matrix @ x.T).T + lift.offset), np.asarray(
        lift.matrix @ v.T
    ).T


def line_bodies(
    trajectory: Trajectory, rows: np.ndarray, wanted: Collection[str] | None
) -> tuple[dict[str, Shown], dict[str, Mark]]:
    """Cables and rigid bodies as lines, these without strain and curvature; bodies of one point as
    joints.
    """
    system = trajectory.system
    if not system.lines:
        return {}, {}
    q, rate = expand(system, trajectory.x[rows], trajectory.v[rows])
    reference = in_scene(system, system.lift(system.x0))[None]
    now, moving, start = (centre_lines(system, one) for one in (q, rate, reference))
    known = {line.name: line for line in system.lines}
    bodies = {
        name: with_section_forces(
            lines(now[name], moving[name], start[name], line.radius), line, now[name], q
        )
        for name, line in known.items()
        if now[name].shape[2] > 1
    }
    for name in bodies:
        if isinstance(known[name].swept, SweptLine):
            bodies[name] = swept.skin(bodies[name], known[name], q, rate, reference)
    for name in bodies.keys() & rigid(system):
        bodies[name] = replace(bodies[name], fields=choose(bodies[name].fields, ("velocity",)))
    masses = {
        name: frames_.joint(MARKERS["mass"].kind, spatial(gradients[:, 0, 0]))
        for name, gradients in now.items()
        if gradients.shape[2] == 1
    }
    return {
        name: replace(body, fields=choose(body.fields, wanted)) for name, body in bodies.items()
    }, masses


def derivatives(trajectory: Trajectory) -> dict[str, np.ndarray]:
    """r' and r'' (s, 2, x, 3) along lines that stretch and bend, by their names; none of beams with
    torsion and rigid bodies.
    """
    system = trajectory.system
    q, _ = expand(system, trajectory.x, trajectory.v)
    own = {line.name for line in system.lines if not isinstance(line.swept, SweptLine)} - rigid(
        system
    )
    return {
        name: spatial(values[:, 1:])
        for name, values in centre_lines(system, q).items()
        if name in own
    }


def rigid(system: System) -> set[str]:
    """Names of lines that never curve."""
    return {
        line.name
        for line in system.lines
        if csr_array(line.samples)[2 * (line.samples.shape[0] // 3) :].nnz == 0
    }


def choose(
    fields: Mapping[str, np.ndarray], wanted: Collection[str] | None
) -> dict[str, np.ndarray]:
    """The wanted ones of these fields."""
    return {name: values for name, values in fields.items() if wanted is None or name in wanted}


def skin_bodies(
    trajectory: Trajectory, rows: np.ndarray, wanted: Collection[str] | None
) -> dict[str, Shown]:
    """Plates and shells as surfaces."""
    system = trajectory.system
    if not system.skins:
        return {}
    points: dict[str, list[np.ndarray]] = {skin.name: [] for skin in system.skins}
    found: dict[str, list[dict[str, np.ndarray]]] = {skin.name: [] for skin in system.skins}
    start = skins(system, in_scene(system, system.lift(system.x0)))
    for row in rows:
        q, rate = expand(system, trajectory.x[row], trajectory.v[row])
        now, moving = skins(system, q), skins(system, rate)
        for skin in system.skins:
            points[skin.name].append(spatial(now[skin.name][0]))
            if solid_law.is_solid(skin.law):
                rate, reference = moving[skin.name][0], start[skin.name][0]
                fields = solid_fields.fields(skin, now[skin.name], rate, reference)
                found[skin.name].append(choose(fields, wanted))
                continue
            fields = skin_fields(skin, now[skin.name], moving[skin.name][0])
            if wanted is not None and RECOVERED in wanted:
                fields[RECOVERED] = stress_errors.recover_stresses(
                    skin, now[skin.name], start[skin.name]
                )[0].von_mises
            found[skin.name].append(choose(fields, wanted))
    bodies = {}
    for skin in system.skins:
        name = skin.name
        each = found[skin.name]
        stacked = {key: np.stack([one[key] for one in each]) for key in each[0]}
        bodies[name] = Shown(
            np.stack(points[name]), stacked, skin.thickness, spatial(start[name][0]), skin.cells
        )
    return bodies


def skin_fields(skin: Skin, gradients: np.ndarray, rate: np.ndarray) -> dict[str, np.ndarray]:
    """Fields of a surface at one instant from its gradients (1 + k, x, c) and the velocity (x, c):
    (x,) or (x, 3) each.
    """
    u = gradients[1:].transpose(0, 2, 1).reshape(-1, gradients.shape[1])
    section = skin.section[:, 0]
    found = recover(skin.law, u, section, skin.thickness)
    bottom, top = found.von_mises
    below, middle, above = found.stress
    axes = gradients[1:3] / np.linalg.norm(gradients[1:3], axis=2, keepdims=True)
    return {
        "velocity": spatial(rate),
        "strain": largest_principal(found.strain),
        "curvature": largest_principal(found.curvature),
        "von_mises": np.maximum(bottom, top),
        "von_mises_top": top,
        "von_mises_bottom": bottom,
        "membrane_strain": found.strain.T,
        "curvature_change": found.curvature.T,
        "stress_top": above.T,
        "stress_bottom": below.T,
        "principal_top": both_principal(above),
        "principal_bottom": both_principal(below),
        "membrane_forces": (skin.thickness * middle).T,
        "bending_moments": (skin.thickness**2 * (above - below) / 12.0).T,
        "axis_1": spatial(axes[0]),
        "axis_2": spatial(axes[1]),
    }


def both_principal(tensor: np.ndarray) -> np.ndarray:
    """Principal values s1 >= s2 of symmetric tensors 11, 22, 12 (3, x), and zero for the third
    direction: (x, 3).
    """
    first, second = principal(tensor)
    return np.stack([first, second, 0.0 * first], axis=1)


def largest_principal(tensor: np.ndarray) -> np.ndarray:
    """The principal value of largest size (x,), with its sign, of symmetric tensors 11, 22, 12 (3,
    x).
    """
    first, second = principal(tensor)
    return np.where(tensor[0] + tensor[1] < 0, second, first)


def lines(gradients: np.ndarray, rates: np.ndarray, start: np.ndarray, radius: float) -> Shown:
    """One cable from its gradients (s, 3, x, c): positions, slopes, curvature vectors."""
    position, slope, bend = (spatial(gradients[:, k]) for k in range(3))
    square = np.einsum("sxc,sxc->sx", slope, slope)
    fields = {
        "strain": 0.5 * (square - 1.0),
        "curvature": np.linalg.norm(np.cross(slope, bend), axis=2) / square**1.5,
        "velocity": spatial(rates[:, 0]),
    }
    return frames_.line(position, fields, radius, spatial(start[0, 0]))


def with_section_forces(
    shown: Shown, line: LineSamples, gradients: np.ndarray, q: np.ndarray
) -> Shown:
    """A cable with N and M, of its gradients (s, 3, x, c) and samples q (s, q); others as they are."""
    if not isinstance(line.swept, CableLine):
        return shown
    there = np.asarray(line.swept.rows @ q.T).T
    here = gradients[:, 1:].reshape(len(q), -1)
    found = line.swept.sections
    N, M, _, _ = found.read(np.concatenate([here, there], axis=1))
    forces = {"axial_force": N, "bending_moment": M}
    if found.fibres.size:
        mean, bent = found.stresses(N, M)
        forces["von_mises"] = np.abs(mean) + bent
    return replace(shown, fields={**shown.fields, **forces})


def spatial(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., c) with three components; planar ones get z = 0."""
    missing = 3 - vectors.shape[-1]
    return np.pad(vectors, [(0, 0)] * (vectors.ndim - 1) + [(0, missing)])


def sense(system: System, x: np.ndarray) -> np.ndarray:
    """What markers are placed by (s, i), of unknowns (s, n)."""
    return np.asarray(system.sensors.matrix @ x.T).T + system.sensors.offset


def joints(system: System, x: np.ndarray) -> dict[str, Mark]:
    """Every marked point of every joint; further points of a joint carry a number."""
    y = sense(system, x)
    found = {}
    for name, kind, rows in system.markers:
        if kind in LINKS or kind in ARROWS:
            continue
        for number in range(len(rows) // system.dim):
            own = list(rows[number * system.dim : (number + 1) * system.dim])
            mark = frames_.joint(shown(system, name, kind), spatial(y[:, own]))
            found[name if number == 0 else f"{name} {number + 1}"] = mark
    return found


def arrows(system: System, x: np.ndarray) -> dict[str, Mark]:
    """Loads at places and gravity, and in space the axes of joints; moments in the plane are about
    z.
    """
    y = sense(system, x)
    found = {}
    for number, (name, kind, rows) in enumerate(system.markers):
        if kind not in ARROWS or (kind == "axis" and system.dim == 2):
            continue
        *place, direction = np.split(y[:, list(rows)], len(rows) // system.dim, axis=1)
        if kind == "pressure":
            kind = "force"
            direction = np.cross(place[1], direction)
        aim = (
            np.pad(direction[:, :1], [(0, 0), (2, 0)])
            if kind == "moment" and system.dim == 2
            else spatial(direction)
        )
        points = spatial(place[0]) if place else np.empty((len(y), 0))
        found[f"{kind} {number} of {name}"] = Mark(MARKERS[kind].kind, points, aim)
    return found


def links(
    system: System, x: np.ndarray, taken: Collection[str], moving: np.ndarray
) -> dict[str, Shown]:
    """Springs as zigzags, ropes and stops as straight lines, shapes of contacts; `load NAME` where
    a body has that name.

    Planes reach as far as points (s, x, 3) that move.
    """
    y = sense(system, np.vstack([x, system.x0]))
    found = {}
    for name, kind, rows in system.markers:
        if kind in LINKS:
            points = spatial(y[:, list(rows)].reshape(len(y), -1, system.dim))
            if kind == "spring":
                points = zigzag(points[:, :1], points[:, 1:])
            if kind == "plane":
                points = reaching(points, moving)
            found[f"load {name}" if name in taken else name] = frames_.line(
                points[:-1], {}, 0.0, points[-1]
            )
    return found


def reaching(plane: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Corners (s + 1, x, 3) of a plane, two or those of a rectangle, with sides so long that they
    pass points (s, y, 3).
    """
    first = plane[:, :1]
    sides = plane[:, [1] if plane.shape[1] == 2 else [1, 3]] - first
    sides /= np.einsum("skc,skc->sk", sides, sides)[:, :, None]
    own, others = (
        np.einsum("sxc,skc->sxk", plane - first, sides),
        np.einsum("sxc,skc->sxk", points - first[:-1], sides[:-1]),
    )
    low = np.minimum(others.min(axis=(0, 1)), 0.0)
    high = np.maximum(others.max(axis=(0, 1)), 1.0)
    sides /= np.einsum("skc,skc->sk", sides, sides)[:, :, None]
    return np.asarray(first + np.einsum("sxk,skc->sxc", low + (high - low) * own, sides))


def zigzag(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Points (s, x, 3) of a bent line from a to b (s, 1, 3)."""
    part = np.concatenate([[0.0], np.linspace(0.2, 0.8, 2 * WINDINGS + 1), [1.0]])
    side = np.where((part > 0.2) & (part < 0.8), np.where(np.arange(len(part)) % 2, -1.0, 1.0), 0.0)
    apart = b - a
    flat = np.stack([-apart[..., 1], apart[..., 0], 0.0 * apart[..., 2]], axis=-1)
    upright = np.linalg.norm(flat, axis=-1, keepdims=True) <= 1e-9 * np.linalg.norm(
        apart, axis=-1, keepdims=True
    )
    size = np.linalg.norm(apart[-1])  # of the last one, the reference
    flat = np.where(upright, [1.0, 0.0, 0.0], flat)
    across = flat / np.linalg.norm(flat, axis=-1, keepdims=True)
    return np.asarray(a + part[None, :, None] * apart + WIDTH * size * side[None, :, None] * across)


def shown(system: System, name: str, kind: str) -> str:
    """What is drawn for a joint; its constraint rows distinguish a driven angle from a driven
    position.
    """
    if kind == "driven":
        kind = (
            "driven_angle"
            if (name, "angle") in (system.full or system).constraints.names
            else "driven_position"
        )
    return MARKERS.get(kind, MARKERS["pin"]).kind


def usual_color(system: System) -> str | None:
    """The field that colours a system without a scene: von Mises stress of plates and shells,
    curvature; None for rigid bodies.
    """
    if system.skins:
        return "von_mises"
    return "curvature" if {line.name for line in system.lines} - rigid(system) else None


def pieces(trajectory: Trajectory, rows: np.ndarray) -> Iterator[Frames]:
    """`frames` with all fields, one instant after the other, for VTK series of large bodies."""
    return (frames(trajectory, rows[i : i + 1]) for i in range(len(rows)))


def errors(
    full: Trajectory, other: Trajectory, wanted: list[float] | None = None, count: int = 6
) -> Frames:
    """A reduced model at the instants `wanted` (or `count` evenly spread ones) with the field
    error, its distance from `full`.
    """
    rows = (
        frames_.spread(full.times, count) if wanted is None else frames_.nearest(full.times, wanted)
    )
    mine = frames_.nearest(other.times, full.times[rows].tolist())
    return frames_.with_error(frames(other, mine, ()), frames(full, rows, ()))
