r"""What a page shows: motions as shapes in few numbers, fields, joints, arrows, and outputs over
time.

film(name, trajectory)  ->  Film  ->  describe(title, films)  ->  JSON and a block of arrays
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values import display as display_units
from ..core.values.display import SI, DisplayUnits
from ..dynamics import Trajectory
from ..results import colour_scales, motion, surfaces
from ..results import frames as frames_
from ..results.colour_scales import ColourScale
from ..results.frames import Array, Frames, Mark, Shown
from ..results.marks import RADIUS, REACH, SYMBOLS, THIN
from ..results.palette import colour
from ..results.plots import Panel
from . import compression, grid, live
from .compression import PageShape
from .live import LiveModel
from .packing import Block

INSTANTS = 601  #: of a motion, at most; the page goes through them smoothly
VALUES = 4_000_000  #: points times instants, at most
TOLERANCE = 1e-4  #: of positions, over the longest side of the scene: a tenth of a pixel
SHADES = 250  #: of a colour scale that are told apart
DRAWN = 500  #: bins of a curve, more than it has pixels, of which its smallest and largest values are drawn
#: what bodies can be coloured by: scalars that pictures have a name for, without what needs a
#: vector or a second motion
FIELDS = tuple(
    name
    for name in colour_scales.LABELS
    if name not in ("displacement", "velocity", "von_mises_recovered")
)


@dataclass(frozen=True)
class Film:
    """A motion as it is shown, with the panels of its outputs at times (t,)."""

    name: str
    frames: Frames
    times: Array = field(default_factory=lambda: np.zeros(0))  #: (t,) of the panels
    panels: Sequence[Panel] = ()
    basis: PageBasis | None = None  #: of a reduced model
    live: LiveModel | None = None  #: the model itself, to run in the page


@dataclass(frozen=True)
class PageBasis:
    """Where unknowns x (n,) put bodies and joints that are linear in them: frames of x = 0 and of
    every unknown alone.
    """

    frames: Frames  #: n + 1 instants
    derivatives: Mapping[str, Array]  #: r' and r'' (n + 1, 2, x, 3) of lines that stretch and bend
    sizes: Array  #: (n,) of each unknown alone
    x: Array  #: (s, n) of the motion

    def linear(self, values: Array) -> Array:
        """The map (i, 1 + n) of values (n + 1, i) of these frames, its first column for x = 0."""
        return np.column_stack([values[0], ((values[1:] - values[0]) / self.sizes[:, None]).T])

    def follow(self, linear: Array) -> Array:
        """Values (s, i) of the motion by such a map."""
        return np.asarray(linear[:, 0] + self.x @ linear[:, 1:].T)


def film(
    name: str,
    trajectory: Trajectory,
    panels: Sequence[Panel] = (),
    instants: int = INSTANTS,
    full: Trajectory | None = None,
) -> Film:
    """A motion, full or reduced, at evenly spread instants; with the distance from a `full` one as
    the field `error`.
    """
    states = trajectory.states
    if not np.isfinite(states.x).all():
        raise InputError(
            say(
                "page",
                "states that are finite",
                "some that are not",
                "show a run that did not fail",
            )
        )
    one = motion.frames(states, np.array([0]), ())
    points = sum(len(body.reference) for body in one.bodies.values())
    rows = frames_.spread(states.times, int(np.clip(VALUES // max(points, 1), 2, instants)))
    shown = motion.frames(states, rows, FIELDS)
    if full is not None:
        others = full.states
        same = frames_.nearest(others.times, shown.times.tolist())
        if len(same) == len(rows):
            shown = frames_.with_error(shown, motion.frames(others, same, ()))
    return Film(name, shown, trajectory.times, panels, basis_of(states, rows))


def basis_of(states: Trajectory, rows: np.ndarray) -> PageBasis | None:
    """The basis of a reduced model, at the sizes that its unknowns have; None of others, and of
    very many unknowns.
    """
    system = states.system
    x = states.x[rows]
    if not system.components or system.size >= compression.SNAPSHOTS:
        return None
    largest = np.abs(x).max(axis=0)
    sizes = np.where(largest > 1e-9 * largest.max(), largest, largest.max() or 1.0)
    alone = np.vstack([np.zeros(system.size), np.diag(sizes)])
    still = np.zeros_like(alone)
    none = np.zeros((len(alone), len(system.constraints.names)))
    one = Trajectory(system, np.arange(len(alone), dtype=float), alone, still, still, none)
    return PageBasis(
        motion.frames(one, np.arange(len(alone)), ()),
        motion.derivatives(one) if system.lines else {},
        sizes,
        x,
    )


def describe(
    title: str,
    films: Sequence[Film],
    shade: str | None = None,
    clock: str = "s",
    about: Sequence[str] = (),
    display: DisplayUnits = SI,
) -> tuple[dict[str, Any], Block]:
    """The content of a page, coloured by the field `shade` at first; `clock` is the unit of times,
    or `load factor`.

    What is seen has the units of `display`; times of the motion and positions, with which the page
    computes, are in SI units.
    """
    block = Block()
    every = [film.frames for film in films]
    flat = all(frames_.planar(one) for one in every)
    middle, side, box = grid.surround(
        np.concatenate([frames_.points(one) for one in every]), flat, display
    )
    scales = [scale for name in FIELDS if (scale := scale_of(every, name, display))]
    shown = [describe_film(one, middle, TOLERANCE * side, scales, block) for one in films]
    content = {
        "title": title,
        "about": list(about),
        "planar": flat,
        "clock": clock,
        "time": time_unit(clock, [film.times for film in films], display),
        "middle": middle.tolist(),
        "box": box,
        "thin": THIN * side,
        "glyph": RADIUS,
        "reach": REACH,
        "shades": [
            {
                "name": one.field,
                "label": one.label,
                "limits": list(one.limits),
                "diverging": one.diverges,
                "size": one.unit,
            }
            for one in scales
        ],
        "shade": shade if shade in [one.field for one in scales] else None,
        "films": shown,
        "panels": describe_panels([(film.times, film.panels) for film in films], display, block),
    }
    running = next(
        (film.live for film, one in zip(films, shown, strict=True) if film.live and one["live"]),
        None,
    )
    return (
        content if running is None else {**content, "live": live.describe(running, display)}
    ), block


def describe_plots(
    title: str,
    times: Array,
    panels: Sequence[Panel],
    clock: str = "s",
    about: Sequence[str] = (),
    display: DisplayUnits = SI,
) -> tuple[dict[str, Any], Block]:
    """The content of a page without bodies: panels at times (t,), none for no panels."""
    block = Block()
    found = describe_panels([(times, panels)], display, block)
    time = time_unit(clock, [times], display)
    return {
        "title": title,
        "about": list(about),
        "clock": clock,
        "time": time,
        "films": [],
        "panels": found,
    }, block


def time_unit(clock: str, times: Sequence[Array], display: DisplayUnits) -> dict[str, Any]:
    """The unit in which times are read, and its size [s]; none of load factors."""
    unit, size = (
        display.find(clock, display_units.largest_of(np.concatenate(times)))
        if clock == "s"
        else ("", 1.0)
    )
    return {"unit": unit, "size": size}


def scale_of(every: Sequence[Frames], name: str, display: DisplayUnits) -> ColourScale | None:
    """The colour scale of a field over the motions that show it, None where no one does."""
    found = [one for one in every if colour_scales.shows(one, name)]
    return colour_scales.make_scale(found, name, display) if found else None


def describe_film(
    film: Film, middle: Array, tolerance: float, scales: Sequence[ColourScale], block: Block
) -> dict[str, Any]:
    """A motion in a page, its fields in the units of these `scales`.

    `live` has maps from unknowns to coordinates of bodies, places of joints and loads that keep
    their direction, and derivatives along lines, if bodies and joints are linear.
    """
    frames = film.frames
    steady = bool((np.diff(frames.times) > 0.0).all())
    shapes, maps = shapes_of(film, middle, tolerance)
    return {
        "name": film.name,
        "times": block.put(frames.times if steady else np.arange(len(frames.times))),
        "shown": block.put(frames.times),
        "bodies": [
            describe_body(name, body, shapes[name], number, middle, scales, block)
            for number, (name, body) in enumerate(frames.bodies.items())
        ],
        "marks": [
            describe_mark(name, mark, middle, block)
            for name, mark in frames_.acting(frames).items()
        ],
        "live": maps
        and {
            part: [None if one is None else block.put(one) for one in found]
            for part, found in maps.items()
        },
    }


def describe_mark(name: str, mark: Mark, middle: Array, block: Block) -> dict[str, Any]:
    """A joint or an arrow in a page, and how it is drawn."""
    symbol = SYMBOLS[mark.kind]
    return {
        "name": name,
        "kind": mark.kind,
        "colour": symbol.colour,
        "form": symbol.form,
        "sizes": list(symbol.sizes),
        "axis": symbol.axis,
        "places": block.put(mark.points - middle if mark.points.size else mark.points),
        "directions": None if mark.is_joint else block.put(mark.directions),
    }


def shapes_of(
    film: Film, middle: Array, tolerance: float
) -> tuple[dict[str, PageShape], dict[str, list[Array | None]] | None]:
    """Shapes of all bodies, and maps (12 + m, 1 + n) of bodies and (3, 1 + n) of joints where the
    unknowns tell all of them.

    What is not linear in the unknowns, as sections that are swept and springs that are drawn bent,
    is told by its points.
    """
    bodies = film.frames.bodies
    if film.basis is not None:
        shapes, maps = linear_shapes(film.basis, film.frames, middle, tolerance)
        if max((one.error for one in shapes.values()), default=0.0) <= tolerance and maps:
            return shapes, maps
    return {
        name: compression.of_points(body.points - middle, body.reference - middle, tolerance)
        for name, body in bodies.items()
    }, None


def linear_shapes(
    basis: PageBasis, frames: Frames, middle: Array, tolerance: float
) -> tuple[dict[str, PageShape], dict[str, list[Array | None]] | None]:
    """Shapes and maps by the basis alone, with the error that they have for the motion."""
    shapes: dict[str, PageShape] = {}
    maps: list[Array | None] = []
    for name, body in frames.bodies.items():
        reference = body.reference - middle
        found = compression.of_points(
            basis.frames.bodies[name].points - middle, reference, 0.1 * tolerance
        )
        linear = basis.linear(found.coordinates)
        shape = compression.PageShape(found.modes, basis.follow(linear), 0.0)
        error = np.linalg.norm(
            compression.points_of(shape, reference) - (body.points - middle), axis=2
        ).max()
        shapes[name] = replace(shape, error=float(error))
        maps.append(linear)
    along = {
        name: basis.linear(values.reshape(len(values), -1))
        for name, values in basis.derivatives.items()
    }
    lines = [along.get(name) for name in frames.bodies]
    marks = {
        name: mark_map(basis, name, mark, middle, tolerance)
        for name, mark in frames_.acting(frames).items()
    }
    if any(marks[name] is None for name in marks if frames.marks[name].is_joint):
        return shapes, None
    return shapes, {"bodies": maps, "lines": lines, "marks": list(marks.values())}


def mark_map(
    basis: PageBasis, name: str, mark: Mark, middle: Array, tolerance: float
) -> Array | None:
    """Where a mark is (3, 1 + n), (0, 1 + n) of gravity; None of a load that turns, and of a place
    that is not linear.
    """
    sizes = np.linalg.norm(mark.directions, axis=1, keepdims=True)
    if not mark.is_joint and (
        not sizes.all() or np.ptp(mark.directions / sizes, axis=0).max() > 1e-9
    ):
        return None
    if not mark.points.size:
        return np.zeros((0, 1 + len(basis.sizes)))
    found = basis.linear(basis.frames.marks[name].points - middle)
    return (
        found if np.abs(basis.follow(found) - (mark.points - middle)).max() <= tolerance else None
    )


def describe_body(
    name: str,
    body: Shown,
    shape: PageShape,
    number: int,
    middle: Array,
    scales: Sequence[ColourScale],
    block: Block,
) -> dict[str, Any]:
    """A body in a page: its reference, modes and coordinates, and the same of its fields."""
    fields = {}
    for scale in scales:
        if scale.field in body.fields:
            values = scale.values(body)
            found = compression.of_values(values, max(float(np.ptp(values)) / SHADES, 1e-300))
            fields[scale.field] = {
                "modes": block.put(found.modes, "f2"),
                "coordinates": block.put(found.coordinates),
            }
    return {
        "name": name,
        "kind": "surface" if body.is_surface else "line",
        "lit": not body.is_shell or bool(np.ptp(body.points[..., 2]) > 0.0),
        "colour": colour(number),
        "size": float(np.mean(body.size)),
        "reference": block.put(body.reference - middle),
        "cells": block.put(body.cells, "u4"),
        "edges": block.put(surfaces.edges(body), "u4"),
        "modes": block.put(shape.modes, "f2"),
        "coordinates": block.put(shape.coordinates),
        "error": shape.error,
        "fields": fields,
    }


def describe_panels(
    motions: Sequence[tuple[Array, Sequence[Panel]]], display: DisplayUnits, block: Block
) -> list[dict[str, Any]]:
    """Times (t,) [s] and panels of all motions, those of one label together, in the unit in which
    that is read.
    """
    largest: dict[str, list[float]] = {}
    for panel in (one for _, panels in motions for one in panels):
        largest.setdefault(panel.label, []).extend(
            map(display_units.largest_of, panel.curves.values())
        )
    heads = {label: display.head(label, values) for label, values in largest.items()}
    found: dict[str, list[dict[str, Any]]] = {}
    for number, (times, panels) in enumerate(motions):
        for panel in panels:
            label, size = heads[panel.label]
            for name, values in panel.curves.items():
                drawn = thin_out(values)
                curve = {
                    "name": name,
                    "column": panel.columns.get(name, name),
                    "film": number,
                    "times": block.put(times[drawn]),
                    "values": block.put(values[drawn] / size),
                    "band": float(panel.bands.get(name, 0.0)) / size,
                    "size": size,
                }
                found.setdefault(label, []).append(curve)
    return [{"label": label, "curves": curves} for label, curves in found.items()]


def thin_out(values: Array) -> np.ndarray:
    """Numbers of the values (t,) that a curve is drawn through: the smallest and largest one of
    every bin, and both ends.
    """
    count = len(values)
    if count <= 2 * DRAWN:
        return np.arange(count)
    bins = np.array_split(np.arange(count), DRAWN)
    ends = [[one[0] + values[one].argmin(), one[0] + values[one].argmax()] for one in bins]
    return np.unique(np.concatenate([[0, count - 1], *ends]))
