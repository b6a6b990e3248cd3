"""The scene in VTK: tubes, surfaces, joints and arrows; runs only in the process that draws."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap, to_rgb

from ...core.storage.records import dataclass
from .. import palette, surfaces
from ..frames import Array, Indices, Shown, mesh
from ..marks import RADIUS, REACH, SYMBOLS, Symbol
from . import decor
from .camera import Camera
from .decor import Pixels
from .job import PictureJob

RAISED = 0.25  #: distance of flat surfaces in a planar scene, which lie in one plane, over the smallest radius of a tube
#: direction from a spatial scene to the eye, in which shapes stand before the reference
EYE = np.array([1.0, -1.0, 1.0])
DEPTH = 10.0  #: distance of one instant of a planar overlay in front of the one before, over the radius of a joint
SPLIT = 40.0  #: angle between facets of a skin from which they are shaded apart [degrees]
SHARP = 0.5  #: cosine of the turn of a line at a corner
INK = "#262626"  #: of the outline of surfaces
NONE = "#999999"  #: of points without a value
STILL = {"reset_camera": False, "render": False}
FLAT = {"lighting": False, **STILL}
MATT = {**STILL, "ambient": 0.5, "diffuse": 0.55, "specular": 0.1}


@dataclass(frozen=True)
class Stage:
    """A scene with its camera, on which instants are drawn."""

    job: PictureJob
    camera: Camera
    plotter: Any
    rims: Sequence[Indices]  #: (i,2) of every body, see `surfaces.edges`
    places: Sequence[Indices]  #: (x,) of the points of shells, see `surfaces`


def stage(job: PictureJob, camera: Camera) -> Stage:
    """An empty one, off the screen."""
    import pyvista

    plotter: Any = pyvista.Plotter(
        off_screen=True, window_size=list(camera.size), lighting="light kit"
    )
    plotter.set_background("white")
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    slots = job.frames.times.size if job.layout == "overlay" else 1
    reach = 4 * float(np.linalg.norm(camera.extent)) + slots * DEPTH * RADIUS * camera.thinnest
    _, up, towards = camera.axes
    plotter.camera_position = [camera.focus + reach * towards, camera.focus, up]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = camera.metres_per_pixel * camera.size[1] / 2
    plotter.camera.clipping_range = (0.01 * reach, 2 * reach)
    bodies = job.frames.bodies.values()
    places = [
        surfaces.places(body.reference) if body.is_shell else np.empty(0, np.int64)
        for body in bodies
    ]
    return Stage(job, camera, plotter, [surfaces.edges(body) for body in bodies], places)


def shot(plotter: Any) -> Pixels:
    """The scene as it is now, (height, width, 3)."""
    plotter.render()
    return np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)


def instant(stage: Stage, sample: int, strength: float = 1.0, slot: int = 0) -> None:
    """Draw all bodies, arrows and joints at one instant, replacing what was in `slot`; `strength` <
    1 is paler.
    """
    job = stage.job
    thin = stage.camera.thinnest
    nearer = (
        np.array([0.0, 0.0, slot * DEPTH * RADIUS * thin])
        if job.planar
        else slot * job.options.behind * thin * EYE
    )
    for i, body in enumerate(job.frames.bodies.values()):
        _body(stage, i, body, sample, nearer, strength, slot)
    for j, mark in enumerate(job.frames.marks.values()):
        symbol = SYMBOLS[mark.kind]
        name = f"mark {slot} {j}"
        layer = 2 * symbol.layer if mark.is_joint else 8  # in the plane in front of all surfaces
        lift = nearer + np.array([0.0, 0.0, layer * RADIUS * thin * job.planar])
        tint = fade(symbol.colour, strength)
        if mark.is_joint:
            stage.plotter.add_mesh(
                glyph(symbol, mark.points[sample] + lift, RADIUS * thin),
                color=tint,
                name=name,
                **STILL,
            )
        elif mark.points.size and mark.directions[sample].any():  # gravity is in the key
            shape = arrow(
                symbol,
                mark.points[sample] + lift,
                mark.directions[sample],
                REACH * thin,
                job.planar,
            )
            stage.plotter.add_mesh(shape, color=tint, name=name, **FLAT)
        else:
            stage.plotter.remove_actor(name, render=False)


def _body(
    stage: Stage, i: int, body: Shown, sample: int, nearer: Array, strength: float, slot: int
) -> None:
    """A tube, or facets with lines around them."""
    job = stage.job
    thin = stage.camera.thinnest
    points = body.points[sample] + nearer
    values = (
        decor.norm(job.scale)(body.fields[job.scale.field][sample])
        if job.scale
        else np.zeros(len(points))
    )
    values = np.ma.filled(values, np.nan)
    style = {"name": f"body {slot} {i}", **_tint(job, i, strength)}
    if not body.is_surface:
        shape = _tube(points, max(float(np.mean(body.size)), thin), values)
        stage.plotter.add_mesh(shape, **MATT, **style).prop.interpolation = "Phong"
        return
    points[:, 2] += RAISED * thin * (i + 1) * job.planar
    if body.sections[0]:
        points = thickened(body, points, thin)
    rim = mesh(points, stage.rims[i], {})
    stage.plotter.add_mesh(
        rim, color=fade(INK, strength), line_width=1.6, name=f"rim {slot} {i}", **FLAT
    )
    shape = mesh(points, body.cells, {"values": values})
    if body.sections[0]:
        shape = shape.compute_normals(
            feature_angle=SPLIT, split_vertices=True, cell_normals=False, consistent_normals=False
        )
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
    of = np.concatenate(
        [np.repeat(centres, around, axis=0), np.repeat(centres[[0, -1]], len(ends) // 2, axis=0)]
    )
    return of + factor * (points - of)


def outline(stage: Stage) -> None:
    """The first instant as lines alone, which hide nothing: edges of surfaces, centre lines of the
    others.
    """
    for i, (body, rim) in enumerate(zip(stage.job.frames.bodies.values(), stage.rims, strict=True)):
        lines = mesh(body.points[0], rim, {})
        stage.plotter.add_mesh(
            lines, color=palette.GREY, line_width=1.6, name=f"outline {i}", **FLAT
        )


def fade(colours: Any, strength: float) -> Any:
    """Red, green, blue (..., 3) in [0, 1] mixed with white; strength 1 leaves them as they are."""
    return 1.0 - strength * (
        1.0 - np.array(to_rgb(colours) if isinstance(colours, str) else colours)
    )


def _tint(job: PictureJob, body: int, strength: float) -> dict[str, Any]:
    """How a body is coloured: by its values in [0, 1], grey where there is none, or by its own
    colour.
    """
    if not job.scale:
        return {"color": fade(palette.colour(body), strength)}
    colours = ListedColormap(
        fade(decor.cmap(job.scale)(np.linspace(0.0, 1.0, 256))[:, :3], strength)
    )
    scale = {"clim": (0.0, 1.0), "cmap": colours, "nan_color": fade(NONE, strength)}
    return {"scalars": "values", "show_scalar_bar": False, **scale}


def arrow(symbol: Symbol, place: Array, direction: Array, reach: float, planar: bool) -> Any:
    """The form of a force, a moment or an axis along a direction (3,), of a length."""
    import pyvista

    aim = direction / np.linalg.norm(direction)
    if symbol.form == "axis":
        return pyvista.Line(place - 0.6 * reach * aim, place + 0.6 * reach * aim).tube(
            radius=0.012 * reach
        )
    if symbol.form == "arrow":
        start = place + begins(aim, planar) * reach * aim
        return pyvista.Arrow(
            start=start,
            direction=aim,
            scale=reach,
            tip_length=0.3,
            tip_radius=0.1,
            shaft_radius=0.03,
        )
    across = np.cross(aim, np.eye(3)[int(np.argmin(np.abs(aim)))])
    across /= np.linalg.norm(across)
    angles = np.linspace(0.0, 1.5 * np.pi, 40)[:, None]
    ring = place + 0.45 * reach * (np.cos(angles) * across + np.sin(angles) * np.cross(aim, across))
    end = (ring[-1] - ring[-2]) / np.linalg.norm(ring[-1] - ring[-2])
    head = pyvista.Cone(
        center=ring[-1] + 0.1 * reach * end, direction=end, height=0.3 * reach, radius=0.1 * reach
    )
    return pyvista.lines_from_points(ring).tube(radius=0.03 * reach).merge(head)


def begins(aim: Array, planar: bool) -> float:
    """Where the arrow of a force along `aim` (3,) begins, over its length: at its place, or -1: it
    ends there.

    It ends there unless it points to the eye in space: from behind a plate it would be hidden by
    what it pushes.
    """
    return -1.0 if planar or aim @ EYE <= 0.0 else 0.0


def _tube(points: Array, radius: float, values: Array) -> Any:
    """A tube along a line; pieces between sharp corners have tubes of their own, which keep their
    width there.
    """
    import pyvista

    along = np.diff(points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    corners = 1 + np.flatnonzero(np.sum(along[1:] * along[:-1], axis=1) < SHARP)
    ends = np.concatenate([[0], corners, [len(points) - 1]])
    pieces = [
        [last - first + 1, *range(first, last + 1)] for first, last in itertools.pairwise(ends)
    ]
    line = pyvista.PolyData(points, lines=np.concatenate(pieces))
    line.point_data["values"] = values
    return line.tube(radius=radius, n_sides=14, capping=True)


def glyph(symbol: Symbol, centre: Array, radius: float) -> Any:
    """The form of a joint whose ball has a radius."""
    import pyvista

    sizes = radius * np.array(symbol.sizes)
    turned = {"center": centre, "direction": np.eye(3)[symbol.axis]}
    if symbol.form == "box":
        return box(centre, sizes)
    if symbol.form == "cross":
        bars = [box(centre, np.roll([sizes[0], sizes[1], sizes[1]], turn)) for turn in range(3)]
        return bars[0].merge(bars[1:])
    if symbol.form == "cone":
        return pyvista.Cone(radius=sizes[0], height=sizes[1], resolution=24, **turned)
    if symbol.form == "prism":
        return pyvista.Cylinder(
            radius=sizes[0], height=2.0 * sizes[1], resolution=int(symbol.sizes[2]), **turned
        )
    return pyvista.Sphere(radius=sizes[0], center=centre, theta_resolution=20, phi_resolution=20)


def box(centre: Array, half: Array) -> Any:
    """A box of half its sides (3,)."""
    import pyvista

    return pyvista.Cube(bounds=np.column_stack([centre - half, centre + half]).ravel())
