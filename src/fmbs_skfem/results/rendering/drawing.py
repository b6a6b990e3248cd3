"""The scene in VTK: tubes, surfaces, joints and grid lines; runs only in the child process of `pictures`."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from .. import palette, surfaces
from ..frames import Array
from . import camera as camera_
from . import decor
from .camera import Box, Camera
from .decor import Pixels
from .job import Arrays, PictureJob

GLYPH = 3.1  #: radius of a joint, over the smallest radius of a tube
REACH = 22.0  #: length of an arrow, over the smallest radius of a tube
GRAVITY = 0.14  #: length of the arrow of gravity, over the longest side of the scene
RAISED = 0.25  #: distance of flat surfaces in a planar scene, which lie in one plane, over the smallest radius of a tube
EYE = np.array([1.0, -1.0, 1.0])  #: direction from a spatial scene to the eye, in which shapes stand before the reference
DEPTH = 10.0  #: distance of one instant of a planar overlay in front of the one before, over the radius of a joint
SIDES = {"gear": (6, 1.6), "joint": (5, 1.3)}  #: of joints that are prisms: sides, radius over that of a ball
SHARP = 0.5  #: cosine of the turn of a line at a corner
LAYERS = {"slider": 1, "point mass": 2, "gear": 2}  #: of joints in planar scenes, from the back; the others are in front
INK = "#262626"  #: of the outline of surfaces
MATT = {"ambient": 0.5, "diffuse": 0.55, "specular": 0.1}
FLAT = {"lighting": False}
STILL = {"reset_camera": False, "render": False}


def stage(camera: Camera, box: Box, planar: bool) -> Any:
    """An off-screen plotter with camera and grid."""
    import pyvista

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(camera.size), lighting="light kit")
    plotter.set_background("white")
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    for lines, tint in _grid(box, planar):
        plotter.add_mesh(pyvista.line_segments_from_points(lines), color=tint, lighting=False, line_width=1)
    if not planar:
        lower, upper = box.lower, box.upper
        floor = np.array(
            [[x, y, lower[2]] for x, y in ((lower[0], lower[1]), (upper[0], lower[1]), upper[:2], (lower[0], upper[1]))]
        )
        plotter.add_mesh(pyvista.PolyData(floor, faces=[4, 0, 1, 2, 3]), color="#F3F1EC", lighting=False)
    reach = 4 * float(np.linalg.norm(box.upper - box.lower))
    plotter.camera.parallel_projection = True
    plotter.camera.focal_point = tuple(camera.focus)
    plotter.camera.position = tuple(camera.focus + reach * camera.towards)
    plotter.camera.up = tuple(camera.up)
    plotter.camera.parallel_scale = camera.metres_per_pixel * camera.size[1] / 2
    plotter.camera.clipping_range = (0.1 * reach, 2 * reach)
    return plotter


def shot(plotter: Any) -> Pixels:
    """The scene as it is now, (height, width, 3)."""
    plotter.render()
    return np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)


def _grid(box: Box, planar: bool) -> list[tuple[Array, str]]:
    """Pairs (end points of segments (n,3), colour): one plane behind a planar scene, floor and two walls of a spatial one."""
    lower, upper = box.lower, box.upper
    if planar:
        behind = lower[2] - 0.1 * float(np.max(upper - lower))
        return [(_mesh_lines(box, (0, 1), 2, behind), "#DCDCDC")]
    lift = 1e-3 * float(np.max(upper - lower))
    walls = np.concatenate([_mesh_lines(box, (1, 2), 0, lower[0]), _mesh_lines(box, (0, 2), 1, upper[1])])
    return [(_mesh_lines(box, (0, 1), 2, lower[2] + lift), "#C8C4BC"), (walls, "#E6E6E6")]


def _mesh_lines(box: Box, axes: tuple[int, int], normal: int, height: float) -> Array:
    """Grid lines in the plane of two axes, (n,3): each pair of rows is one segment."""
    rows = []
    for along, across in (axes, axes[::-1]):
        for value in camera_.ticks(box, across):
            for end in (box.lower[along], box.upper[along]):
                row = np.empty(3)
                row[along], row[across], row[normal] = end, value, height
                rows.append(row)
    return np.array(rows)


def configuration(
    plotter: Any, job: PictureJob, arrays: Arrays, sample: int, thinnest: float, strength: float = 1.0, slot: int = 0
) -> None:
    """Draw all bodies and joints at one instant, replacing what was in `slot`.

    No tube has a radius below `thinnest` [m]; `strength` < 1 is paler.
    """
    nearer = np.array([0.0, 0.0, slot * DEPTH * GLYPH * thinnest]) if job.planar else slot * job.look.behind * thinnest * EYE
    for i in range(len(job.bodies)):
        points, values = arrays[f"points_{i}"][sample] + nearer, arrays[f"values_{i}"][sample]
        colours = _fade(_colours(job, i, values), strength)
        name = f"body {slot} {i}"
        if f"quads_{i}" in arrays:
            raised = points + np.array([0.0, 0.0, RAISED * thinnest * (i + 1) if job.planar else 0.0])
            surface, rim = _surface(arrays, i, raised, colours, shaded=not job.planar)
            ink = _fade(_rgb(INK)[None], strength)[0].tolist()
            plotter.add_mesh(rim, color=ink, lighting=False, line_width=1.6, name=f"rim {slot} {i}", **STILL)
            actor = plotter.add_mesh(surface, scalars="tint", rgb=True, name=name, **STILL, **(FLAT if job.planar else MATT))
            actor.mapper.resolve = "polygon_offset"
            actor.prop.interpolation = "Flat" if job.planar else "Phong"
            continue
        tube = _tube(points, colours, max(job.radii[i], thinnest))
        actor = plotter.add_mesh(tube, scalars="tint", rgb=True, name=name, **STILL, **MATT)
        actor.prop.interpolation = "Phong"
    _arrows(plotter, job, arrays, sample, nearer, thinnest, strength, slot)
    _joints(
        plotter, job, {key: arrays[key][sample] + nearer for key in arrays if key.startswith("joint_")}, thinnest, strength, slot
    )


def outline(plotter: Any, job: PictureJob, arrays: Arrays) -> None:
    """The first instant as lines alone, which hide nothing: edges of surfaces, centre lines of the others."""
    for i in range(len(job.bodies)):
        lines = _edges(arrays, i, arrays[f"points_{i}"][0])
        plotter.add_mesh(lines, color=palette.GREY, lighting=False, line_width=1.6, name=f"outline {i}", **STILL)


def _arrows(
    plotter: Any, job: PictureJob, arrays: Arrays, sample: int, nearer: Array, thinnest: float, strength: float, slot: int
) -> None:
    """Forces as of `begins`, moments as rings about their place, axes of joints as lines through it."""
    front = nearer + np.array([0.0, 0.0, 8 * GLYPH * thinnest if job.planar else 0.0])
    for j, kind in enumerate(job.arrows):
        aim = arrays[f"aim_{j}"][sample]
        if kind == "gravity" or not np.linalg.norm(aim) > 0.0:
            continue
        aim, reach = aim / np.linalg.norm(aim), REACH * thinnest
        ahead = (1.0 + begins(job, aim)) * reach * aim if kind == "force" else np.zeros(3)
        shape = _arrow(kind, arrays[f"place_of_{j}"][sample] + front + ahead, aim, reach)
        tint = _fade(_rgb(decor.ARROWS[kind][1])[None], strength)[0].tolist()
        plotter.add_mesh(shape, color=tint, name=f"arrow {slot} {j}", **FLAT, **STILL)


def shafts(job: PictureJob, arrays: Arrays, thinnest: float) -> list[Array]:
    """Points (s, x, 3) along every arrow of a force, over the instants."""
    along = REACH * thinnest * np.linspace(0.0, 1.0, 9)[:, None]
    found = []
    for j, kind in enumerate(job.arrows):
        if kind == "force":
            aims = arrays[f"aim_{j}"]
            units = aims / np.maximum(np.linalg.norm(aims, axis=1), 1e-300)[:, None]
            first = REACH * thinnest * begins(job, units)[:, None] * units
            found.append((arrays[f"place_of_{j}"] + first)[:, None] + along * units[:, None])
    return found


def begins(job: PictureJob, aim: Array) -> Array:
    """Where the arrow of a force along `aim` (..., 3) begins, over its length: at its place, -1 if it ends there.

    It ends there unless it points to the eye in space: from behind a plate it would be hidden by what it pushes.
    """
    return np.where(aim @ EYE > 0.0, 0.0, -1.0) if not job.planar else np.full(aim.shape[:-1], -1.0)


def _arrow(kind: str, place: Array, aim: Array, reach: float) -> Any:
    """An arrow of length `reach` [m] to a place, an arc about it, or a line through it; `aim` is of length 1."""
    import pyvista

    if kind == "axis":
        return pyvista.Line(place - 0.6 * reach * aim, place + 0.6 * reach * aim).tube(radius=0.012 * reach)
    if kind != "moment":
        sizes = {"tip_length": 0.3, "tip_radius": 0.1, "shaft_radius": 0.03}
        return pyvista.Arrow(start=place - reach * aim, direction=aim, scale=reach, **sizes)
    across = np.cross(aim, np.eye(3)[int(np.argmin(np.abs(aim)))])
    across /= np.linalg.norm(across)
    angles = np.linspace(0.0, 1.5 * np.pi, 40)[:, None]
    ring = place + 0.45 * reach * (np.cos(angles) * across + np.sin(angles) * np.cross(aim, across))
    end = ring[-1] - ring[-2]
    head = pyvista.Cone(
        center=ring[-1] + 0.1 * reach * end / np.linalg.norm(end), direction=end, height=0.3 * reach, radius=0.1 * reach
    )
    return pyvista.lines_from_points(ring).tube(radius=0.03 * reach).merge(head)


def gravities(job: PictureJob, arrays: Arrays) -> list[Array]:
    """Directions (3,) of length 1 of the gravities that act."""
    aims = [arrays[f"aim_{j}"][0] for j, kind in enumerate(job.arrows) if kind == "gravity"]
    return [aim / np.linalg.norm(aim) for aim in aims if np.linalg.norm(aim) > 0.0]


def gravity_at(aim: Array, box: Box, sides: tuple[int, int]) -> Array:
    """Start and end (2, 3) [m] of the arrow of a gravity in a corner of the scene, at its lower (0) or upper (1) x and y."""
    size = GRAVITY * float(np.max(box.upper - box.lower))
    ahead, behind = np.maximum(aim, 0.0) * size, np.maximum(-aim, 0.0) * size
    high, low = box.upper - 0.3 * size - ahead, box.lower + 0.3 * size + behind
    start = np.array([*(high[k] if sides[k] else low[k] for k in range(2)), box.upper[2] - ahead[2]])
    return np.array([start, start + size * aim])


def gravity(plotter: Any, job: PictureJob, arrays: Arrays, box: Box, sides: tuple[int, int]) -> None:
    """The direction of gravity as an arrow in a corner of the scene."""
    import pyvista

    sizes = {"tip_length": 0.3, "tip_radius": 0.09, "shaft_radius": 0.03}
    for j, aim in enumerate(gravities(job, arrays)):
        start, end = gravity_at(aim, box, sides)
        shape = pyvista.Arrow(start=start, direction=aim, scale=float(np.linalg.norm(end - start)), **sizes)
        plotter.add_mesh(shape, color=decor.ARROWS["gravity"][1], name=f"gravity {j}", **FLAT, **STILL)


def _joints(plotter: Any, job: PictureJob, centres: Arrays, thinnest: float, strength: float, slot: int) -> None:
    """Joints; in planar scenes in front of all surfaces, and sliders, masses and gears behind what else lies there."""
    for j, kind in enumerate(job.kinds):
        tint = _fade(_rgb(decor.GLYPHS[kind][1])[None], strength)[0]
        layer = LAYERS.get(kind, max(LAYERS.values()) + 1) if job.planar else 0
        front = np.array([0.0, 0.0, layer * 2 * GLYPH * thinnest])
        glyph = _glyph(kind, centres[f"joint_{j}"] + front, GLYPH * thinnest)
        plotter.add_mesh(glyph, color=tint.tolist(), smooth_shading=False, name=f"joint {slot} {j}", **STILL)


def _surface(arrays: Arrays, i: int, points: Array, colours: Pixels, shaded: bool) -> tuple[Any, Any]:
    """Facets of a surface, with smooth normals where it is shaded, and the lines around it."""
    import pyvista

    quads = arrays[f"quads_{i}"]
    surface = pyvista.PolyData(points, faces=np.column_stack([np.full(len(quads), 4), quads]).ravel())
    surface.point_data["tint"] = colours
    if shaded:
        surface.point_data.active_normals = surfaces.normals(points, quads, arrays[f"place_{i}"])
    return surface, _edges(arrays, i, points)


def _edges(arrays: Arrays, i: int, points: Array) -> Any:
    """The lines around a surface, or the centre line of any other body, through points (x, 3)."""
    import pyvista

    along = np.arange(len(points))
    edges = arrays.get(f"edges_{i}", np.column_stack([along[:-1], along[1:]]))
    return pyvista.PolyData(points, lines=np.column_stack([np.full(len(edges), 2), edges]).ravel())


def _tube(points: Array, colours: Pixels, radius: float) -> Any:
    """A tube along a line; pieces between sharp corners have tubes of their own, which keep their width there."""
    import pyvista

    along = np.diff(points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    corners = 1 + np.flatnonzero(np.sum(along[1:] * along[:-1], axis=1) < SHARP)
    ends = np.concatenate([[0], corners, [len(points) - 1]])
    pieces = [[last - first + 1, *range(first, last + 1)] for first, last in itertools.pairwise(ends)]
    line = pyvista.PolyData(points, lines=np.concatenate(pieces))
    line.point_data["tint"] = colours
    return line.tube(radius=radius, n_sides=14, capping=True)


def _glyph(kind: str, centre: Array, radius: float) -> Any:
    """Cube: clamp; small: what ties frames; cone: driven; bar: what slides; cross: universal; prisms: SIDES; ball: all others."""
    import pyvista

    x, y, z = (float(value) for value in centre)
    if kind in ("clamp", "weld", "held edge", "bushing", "latch"):
        side = (1.9 if kind == "clamp" else 1.4) * radius
        return pyvista.Cube(center=(x, y, z), x_length=side, y_length=side, z_length=side)
    if kind in ("driven angle", "driven position"):
        up = (0.0, 1.0, 0.0) if kind == "driven angle" else (1.0, 0.0, 0.0)
        return pyvista.Cone(center=(x, y, z), direction=up, height=2.6 * radius, radius=1.3 * radius, resolution=24)
    if kind in ("slider", "prismatic joint", "cylindrical joint"):
        return pyvista.Cube(center=(x, y, z), x_length=4.2 * radius, y_length=2.2 * radius, z_length=1.3 * radius)
    if kind == "universal joint":
        bars = [pyvista.Cube((x, y, z), *(radius * np.roll([3.4, 1.0, 1.0], turn))) for turn in range(3)]
        return bars[0].merge(bars[1:])
    if kind in SIDES:  # wide and flat, so that it is seen around the ball of the joint that its wheel turns on
        sides, size = SIDES[kind]
        return pyvista.Cylinder((x, y, z), (0.0, 0.0, 1.0), size * radius, 0.8 * radius, resolution=sides)
    size = {"point mass": 1.5, "distance": 0.7}.get(kind, 1.0) * radius
    return pyvista.Sphere(radius=size, center=(x, y, z), theta_resolution=20, phi_resolution=20)


def _colours(job: PictureJob, body: int, values: Array) -> Pixels:
    """Red, green, blue in 0..255 of every point (x,3); grey where there is no value."""
    if not job.look.label:
        return np.repeat(_rgb(palette.colour(body))[None], values.size, axis=0)
    safe = np.where(np.isfinite(values), values, job.limits[0])
    colours = decor.cmap(job)(np.asarray(decor.norm(job)(safe)))[:, :3]
    colours[~np.isfinite(values)] = 0.6
    return np.round(255 * colours).astype(np.uint8)


def _rgb(text: str) -> Pixels:
    return np.array([int(text[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.uint8)


def _fade(colours: Pixels, strength: float) -> Pixels:
    """Mixed with white; strength 1 leaves them as they are."""
    return np.round(255 - strength * (255.0 - colours)).astype(np.uint8)
