"""Small motions about a state as frames, pictures, animations and VTK fields.

r(x, phase) = r_state(x) + a Re(v(x) exp(i phase)),   a: the largest displacement is REACH of the size of what is drawn

Colours are w / a of surfaces in space, the deflection w = n . (r - r_state) along the normal n of
the state, from -1 to 1, so that lobes to both sides differ; where all is in one plane or only lines
are drawn |r - r_state| / a, from 0 to 1.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..core.values.arguments import checked
from ..core.values.display import SI, DisplayUnits
from ..dynamics import Shapes, Trajectory
from . import frames as frames_
from . import motion, pictures
from .frames import Frames, Shown
from .pictures import PictureOptions

REACH = 0.12
PHASES = 24  #: instants of a period in an animation, at most
RATE = 12.0  #: of them a second
#: fields of pictures, over the largest displacement of all points
SHAPE, DEFLECTION = (
    "mode shape",
    "normal deflection",
)
TANGENTS = ("axis_1", "axis_2")  #: fields of surfaces, whose cross product is along the normal


def moved(shapes: Shapes, displacements: np.ndarray) -> Frames:
    """The state, then the state with displacements of the unknowns (s, n)."""
    x = shapes.x + np.concatenate([np.zeros((1, len(shapes.x))), displacements])
    still = np.zeros_like(x)
    times = np.arange(len(x), dtype=float)
    none = np.zeros((len(x), len(shapes.system.constraints.names)))
    return motion.frames(Trajectory(shapes.system, times, x, still, still, none), wanted=TANGENTS)


def longest(real: Frames, imaginary: Frames) -> np.ndarray:
    """Largest displacements (i,) [m] over a period of bodies and joints, from the state and its
    displacements by Re v and Im v.

        max |Re (a - i b) exp(i phase)|^2 = ((a.a + b.b) + sqrt((a.a - b.b)^2 + 4 (a.b)^2)) / 2

    over all phases.
    """
    found = []
    for a, b in zip(frames_.places(real), frames_.places(imaginary), strict=True):
        a, b = a[1:] - a[:1], b[1:] - b[:1]
        aa, bb, ab = (
            np.einsum("ixc,ixc->ix", one, other) for one, other in ((a, a), (b, b), (a, b))
        )
        found.append(np.sqrt(0.5 * (aa + bb + np.hypot(aa - bb, 2.0 * ab))).max(axis=1))
    return np.asarray(np.max(found, axis=0))


def size(frames: Frames) -> float:
    """Largest extent of the first instant [m], 1 of a single point."""
    return (
        float(
            np.ptp(np.concatenate([points[0] for points in frames_.places(frames)]), axis=0).max()
        )
        or 1.0
    )


def unit_vectors(shapes: Shapes) -> tuple[np.ndarray, float]:
    """The motions (n, i) with the largest displacement 1 m, and the size of what is drawn [m]."""
    v = shapes.vectors.T
    real, imaginary = moved(shapes, v.real), moved(shapes, v.imag)
    far = longest(real, imaginary)
    return shapes.vectors / np.where(far > 0.0, far, 1.0), size(real)


def coloured(frames: Frames, largest: float) -> tuple[Frames, PictureOptions]:
    """Frames with the one field that colours them, the displacement over the largest one [m], and
    the options that show it.
    """
    if any(body.is_shell for body in frames.bodies.values()) and not frames_.planar(frames):
        name = DEFLECTION
        low = -1.0
        value = deflection
    else:
        name = SHAPE
        low = 0.0
        value = distance
    bodies = {
        key: replace(body, fields={name: value(body) / largest})
        for key, body in frames.bodies.items()
    }
    return replace(frames, bodies=bodies), PictureOptions(
        name, f"{name} [-]", (low, 1.0), behind=True
    )


def distance(body: Shown) -> np.ndarray:
    """Distances (s, x) [m] from the first instant.

        |r - r_state|

    which is the state about which shapes are.
    """
    return np.asarray(np.linalg.norm(body.points - body.points[:1], axis=2))


def deflection(body: Shown) -> np.ndarray:
    """n . (r - r_state) (s, x) [m] of a surface, n from its TANGENTS at the first instant; NaN of a
    line, which has no normal.
    """
    if not body.is_shell:
        return np.full(body.points.shape[:2], np.nan)
    n = np.cross(*(body.fields[name][0] for name in TANGENTS))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return np.einsum("xc,sxc->sx", n, body.points - body.points[:1])


@checked
def picture(shapes: Shapes, path: Path, title: str = "", display: DisplayUnits = SI) -> Path:
    """Every motion at its largest beside the outline of the state, side by side in a PNG."""
    vectors, extent = unit_vectors(shapes)
    frames, options = coloured(moved(shapes, REACH * extent * vectors.real.T), REACH * extent)
    options = replace(options, title=title, captions=shapes.captions, display=display)
    return pictures.render(
        frames, path, frames.times.tolist(), options, pictures.Arrangement.MULTIPLES
    )


def animate(
    shapes: Shapes,
    number: int,
    path: Path,
    title: str = "",
    count: int = PHASES,
    display: DisplayUnits = SI,
) -> Path:
    """A period of one motion beside the outline of the state as a GIF or MP4; growth and damping
    are left out.
    """
    caption = shapes.captions[number]
    one = replace(shapes, vectors=shapes.vectors[:, [number]], captions=(caption,))
    vectors, extent = unit_vectors(one)
    count = min(count, PHASES)
    phases = np.exp(2j * np.pi * np.arange(count) / count)
    frames, options = coloured(
        moved(shapes, REACH * extent * np.real(phases[:, None] * vectors[:, 0])), REACH * extent
    )
    head = f"{title}, {caption}" if title else caption
    options = replace(options, captions=(head,) * count, size=(800, 600), display=display)
    return pictures.animate(frames, path, count + 1, RATE, options)


def fields(shapes: Shapes) -> Frames:
    """The state with every motion as a field, of largest displacement 1: `mode_1`, of complex ones
    `mode_1_imaginary` too.
    """
    vectors, _ = unit_vectors(shapes)
    real, imaginary = moved(shapes, vectors.real.T), moved(shapes, vectors.imag.T)
    parts = {"": real, "_imaginary": imaginary} if np.iscomplexobj(vectors) else {"": real}
    bodies = {}
    for name, body in real.bodies.items():
        found = {
            f"mode_{k + 1}{word}": (part.bodies[name].points[[k + 1]] - body.points[:1])
            for k in range(vectors.shape[1])
            for word, part in parts.items()
        }
        bodies[name] = replace(body, points=body.points[:1], fields=found)
    return replace(frames_.select(real, np.array([0])), bodies=bodies)
