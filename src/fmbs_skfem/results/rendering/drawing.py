"""The scene in VTK: tubes, surfaces, joints and grid lines; runs only in the process that draws."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...core.storage.records import dataclass
from .. import palette, surfaces
from ..frames import Array, Indices, Shown
from . import decor
from .camera import Box, Camera
from .decor import Pixels
from .job import PictureJob

GLYPH = 3.1  #: radius of a joint, over the smallest radius of a tube
REACH = 22.0  #: length of an arrow, over the smallest radius of a tube
RAISED = 0.25  #: distance of flat surfaces in a planar scene, which lie in one plane, over the smallest radius of a tube
EYE = np.array([1.0, -1.0, 1.0])  #: direction from a spatial scene to the eye, in which shapes stand before the reference
DEPTH = 10.0  #: distance of one instant of a planar overlay in front of the one before, over the radius of a joint
SIDES = {"gear": (6, 1.6), "joint": (5, 1.3)}  #: of joints that are prisms: sides, radius over that of a ball
SPLIT = 40.0  #: angle between facets of a skin from which they are shaded apart [degrees]
SHARP = 0.5  #: cosine of the turn of a line at a corner
LAYERS = {"slider": 1, "point mass": 2, "gear": 2}  #: of joints in planar scenes, from the back; the others are in front
INK = "#262626"  #: of the outline of surfaces
NONE = "#999999"  #: of points without a value
STILL = {"reset_camera": False, "render": False}
FLAT = {"lighting": False, **STILL}
MATT = {**STILL, "ambient": 0.5, "diffuse": 0.55, "specular": 0.1}


@dataclass(frozen=True)
class Stage:
    """A scene with its camera and grid, on which instants are drawn."""

    job: PictureJob
    camera: Camera
    plotter: Any
    places: Sequence[Indices]  #: (x,) of the points of every body, see `surfaces`
    rims: Sequence[Indices]  #: (i,2) of every body: edges of a surface, segments of a line


def stage(job: PictureJob, camera: Camera) -> Stage:
    """Off the screen, with one plane behind a planar scene, floor and two walls of a spatial one."""
    import pyvista

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(camera.size), lighting="light kit")
    plotter.set_background("white")
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    box, grid = camera.box, {"style": "wireframe", "line_width": 1, **FLAT}
    if job.planar:
        plotter.add_mesh(_wall(box, 2, box.lower[2] - 0.1 * box.size), color="#DCDCDC", **grid)
    else:
        floor = _wall(box, 2, box.lower[2])
        plotter.add_mesh(floor, color="#F3F1EC", **FLAT)
        plotter.add_mesh(floor.translate((0.0, 0.0, 1e-3 * box.size)), color="#C8C4BC", **grid)
        for wall in (_wall(box, 0, box.lower[0]), _wall(box, 1, box.upper[1])):
            plotter.add_mesh(wall, color="#E6E6E6", **grid)
    reach = 4 * float(np.linalg.norm(box.upper - box.lower))
    plotter.camera_position = [camera.focus + reach * camera.towards, camera.focus, camera.up]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = camera.metres_per_pixel * camera.size[1] / 2
    plotter.camera.clipping_range = (0.1 * reach, 2 * reach)
    bodies = job.frames.bodies.values()
    places = [surfaces.places(body.reference) if body.is_surface else np.arange(len(body.reference)) for body in bodies]
    rims = [
        surfaces.outline(body.reference, body.cells, place) if body.is_surface else body.cells
        for body, place in zip(bodies, places, strict=True)
    ]
    return Stage(job, camera, plotter, places, rims)


def shot(plotter: Any) -> Pixels:
    """The scene as it is now, (height, width, 3)."""
    plotter.render()
    return np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)


def _wall(box: Box, normal: int, height: float) -> Any:
    """Squares of a side of the box, at a `height` along its normal."""
    import pyvista

    origin, points = box.lower.copy(), box.cells + 1
    origin[normal], points[normal] = height, 1
    return pyvista.ImageData(dimensions=points.tolist(), spacing=[box.step] * 3, origin=origin.tolist())


def instant(stage: Stage, sample: int, strength: float = 1.0, slot: int = 0) -> None:
    """Draw all bodies, arrows and joints at one instant, replacing what was in `slot`; `strength` < 1 is paler."""
    job, thin = stage.job, stage.camera.thinnest
    nearer = np.array([0.0, 0.0, slot * DEPTH * GLYPH * thin]) if job.planar else slot * job.look.behind * thin * EYE
    for i, body in enumerate(job.frames.bodies.values()):
        _body(stage, i, body, sample, nearer, strength, slot)
    for j, arrow in enumerate(job.frames.arrows.values()):
        aim, size = arrow.directions[sample], float(np.linalg.norm(arrow.directions[sample]))
        if arrow.kind in SHAPES and size > 0.0:  # gravity is in the key
            place = arrow.points[sample] + nearer + (0.0, 0.0, 8 * GLYPH * thin * job.planar)
            shape, tint = SHAPES[arrow.kind](place, aim / size, REACH * thin, job.planar), decor.ARROWS[arrow.kind][1]
            stage.plotter.add_mesh(shape, color=fade(tint, strength), name=f"arrow {slot} {j}", **FLAT)
    for j, (kind, centres) in enumerate(job.frames.joints.values()):
        layer = LAYERS.get(kind, max(LAYERS.values()) + 1) * job.planar  # in the plane in front of all surfaces
        glyph = _glyph(kind, centres[sample] + nearer + (0.0, 0.0, layer * 2 * GLYPH * thin), GLYPH * thin)
        tint = fade(decor.GLYPHS[kind][1], strength)
        stage.plotter.add_mesh(glyph, color=tint, name=f"joint {slot} {j}", **STILL)


def _body(stage: Stage, i: int, body: Shown, sample: int, nearer: Array, strength: float, slot: int) -> None:
    """A tube, or facets with lines around them."""
    job, thin, points = stage.job, stage.camera.thinnest, body.points[sample] + nearer
    values = decor.norm(job)(body.fields[job.look.field][sample]) if job.look.field else np.zeros(len(points))
    style = {"name": f"body {slot} {i}", **_tint(job, i, strength)}
    if not body.is_surface:
        shape = _tube(points, max(float(np.mean(body.size)), thin), values)
        stage.plotter.add_mesh(shape, **MATT, **style).prop.interpolation = "Phong"
        return
    points[:, 2] += RAISED * thin * (i + 1) * job.planar
    if body.sections[0]:
        points = thickened(body, points, thin)
    rim = _mesh(points, lines=stage.rims[i])
    stage.plotter.add_mesh(rim, color=fade(INK, strength), line_width=1.6, name=f"rim {slot} {i}", **FLAT)
    shape = _mesh(points, values, faces=body.cells)
    if body.sections[0]:
        shape = shape.compute_normals(feature_angle=SPLIT, split_vertices=True, cell_normals=False, consistent_normals=False)
    elif not job.planar:
        shape.point_data.active_normals = surfaces.normals(points, body.cells, stage.places[i])
    actor = stage.plotter.add_mesh(shape, **(FLAT if job.planar else MATT), **style)
    actor.mapper.resolve = "polygon_offset"
    actor.prop.interpolation = "Flat" if job.planar else "Phong"


def thickened(body: Shown, points: Array, thin: float) -> Array:
    """Points (x, 3) of a skin, its sections made as large as a tube that is still seen well."""
    factor = thin / float(body.size[0])
    if factor <= 1.0:
        return points
    count, around = body.sections
    sections, ends = np.split(points, [count * around])
    centres = sections.reshape(count, around, 3).mean(axis=1)
    of = np.concatenate([np.repeat(centres, around, axis=0), np.repeat(centres[[0, -1]], len(ends) // 2, axis=0)])
    return of + factor * (points - of)


def outline(stage: Stage) -> None:
    """The first instant as lines alone, which hide nothing: edges of surfaces, centre lines of the others."""
    for i, (body, rim) in enumerate(zip(stage.job.frames.bodies.values(), stage.rims, strict=True)):
        lines = _mesh(body.points[0], lines=rim)
        stage.plotter.add_mesh(lines, color=palette.GREY, line_width=1.6, name=f"outline {i}", **FLAT)


def fade(colours: Any, strength: float) -> Any:
    """Red, green, blue (..., 3) in [0, 1] mixed with white; strength 1 leaves them as they are."""
    from matplotlib.colors import to_rgb

    return 1.0 - strength * (1.0 - np.array(to_rgb(colours) if isinstance(colours, str) else colours))


def _tint(job: PictureJob, body: int, strength: float) -> dict[str, Any]:
    """How a body is coloured: by its values in [0, 1], grey where there is none, or by its own colour."""
    from matplotlib.colors import ListedColormap

    if not job.look.field:
        return {"color": fade(palette.colour(body), strength)}
    colours = ListedColormap(fade(decor.cmap(job)(np.linspace(0.0, 1.0, 256))[:, :3], strength))
    scale = {"clim": (0.0, 1.0), "cmap": colours, "nan_color": fade(NONE, strength)}
    return {"scalars": "values", "show_scalar_bar": False, **scale}


def _axis(place: Array, aim: Array, reach: float, planar: bool) -> Any:
    import pyvista

    return pyvista.Line(place - 0.6 * reach * aim, place + 0.6 * reach * aim).tube(radius=0.012 * reach)


def _force(place: Array, aim: Array, reach: float, planar: bool) -> Any:
    import pyvista

    start = place + begins(aim, planar) * reach * aim
    return pyvista.Arrow(start=start, direction=aim, scale=reach, tip_length=0.3, tip_radius=0.1, shaft_radius=0.03)


def begins(aim: Array, planar: bool) -> float:
    """Where the arrow of a force along `aim` (3,) begins, over its length: at its place, or -1: it ends there.

    It ends there unless it points to the eye in space: from behind a plate it would be hidden by what it pushes.
    """
    return -1.0 if planar or aim @ EYE <= 0.0 else 0.0


def _ring(place: Array, aim: Array, reach: float, planar: bool) -> Any:
    import pyvista

    across = np.cross(aim, np.eye(3)[int(np.argmin(np.abs(aim)))])
    across /= np.linalg.norm(across)
    angles = np.linspace(0.0, 1.5 * np.pi, 40)[:, None]
    ring = place + 0.45 * reach * (np.cos(angles) * across + np.sin(angles) * np.cross(aim, across))
    end = (ring[-1] - ring[-2]) / np.linalg.norm(ring[-1] - ring[-2])
    head = pyvista.Cone(center=ring[-1] + 0.1 * reach * end, direction=end, height=0.3 * reach, radius=0.1 * reach)
    return pyvista.lines_from_points(ring).tube(radius=0.03 * reach).merge(head)


#: of arrows, by their kind: from place, unit vector, length and whether the scene is planar
SHAPES: dict[str, Callable[[Array, Array, float, bool], Any]] = {"axis": _axis, "moment": _ring, "force": _force}


def _mesh(points: Array, values: Array | None = None, **cells: Indices) -> Any:
    """Points (x,3) with `lines` or `faces` (f,i), and values in [0, 1] of points."""
    import pyvista

    counted = {kind: np.column_stack([np.full(len(each), each.shape[1]), each]).ravel() for kind, each in cells.items()}
    found = pyvista.PolyData(points, **counted)
    if values is not None:
        found.point_data["values"] = np.ma.filled(values, np.nan)
    return found


def _tube(points: Array, radius: float, values: Array) -> Any:
    """A tube along a line; pieces between sharp corners have tubes of their own, which keep their width there."""
    import pyvista

    along = np.diff(points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    corners = 1 + np.flatnonzero(np.sum(along[1:] * along[:-1], axis=1) < SHARP)
    ends = np.concatenate([[0], corners, [len(points) - 1]])
    pieces = [[last - first + 1, *range(first, last + 1)] for first, last in itertools.pairwise(ends)]
    line = pyvista.PolyData(points, lines=np.concatenate(pieces))
    line.point_data["values"] = np.ma.filled(values, np.nan)
    return line.tube(radius=radius, n_sides=14, capping=True)


def _glyph(kind: str, centre: Array, radius: float) -> Any:
    """Cube: clamp; small: what ties frames; cone: driven; bar: what slides; cross: universal; prisms: SIDES; ball: all others."""
    import pyvista

    if kind in ("clamp", "weld", "held edge", "bushing", "latch"):
        side = (1.9 if kind == "clamp" else 1.4) * radius
        return pyvista.Cube(centre, side, side, side)
    if kind in ("driven angle", "driven position"):
        up = (0.0, 1.0, 0.0) if kind == "driven angle" else (1.0, 0.0, 0.0)
        return pyvista.Cone(center=centre, direction=up, height=2.6 * radius, radius=1.3 * radius, resolution=24)
    if kind in ("slider", "prismatic joint", "cylindrical joint"):
        return pyvista.Cube(centre, 4.2 * radius, 2.2 * radius, 1.3 * radius)
    if kind == "universal joint":
        bars = [pyvista.Cube(centre, *(radius * np.roll([3.4, 1.0, 1.0], turn))) for turn in range(3)]
        return bars[0].merge(bars[1:])
    if kind in SIDES:  # wide and flat, so that it is seen around the ball of the joint that its wheel turns on
        sides, size = SIDES[kind]
        return pyvista.Cylinder(centre, (0.0, 0.0, 1.0), size * radius, 0.8 * radius, resolution=sides)
    size = {"point mass": 1.5, "distance": 0.7}.get(kind, 1.0) * radius
    return pyvista.Sphere(radius=size, center=centre, theta_resolution=20, phi_resolution=20)
