"""A cantilever rolled up by an end moment, the exact pure-bending elastica: an arc of curvature k =
M / EI at every instant.

r(s) = (sin(k s) / k, (1 - cos(k s)) / k, 0),    s in [0, 1] m
"""

from __future__ import annotations

import numpy as np

from fmbs_skfem.results.frames import Array, Frames, joint, line

S, X = 7, 41


def arc(curvature: Array) -> Array:
    """Points (s,x,3) of unit arcs of the curvatures (s,) [1/m]."""
    along = np.linspace(0.0, 1.0, X)
    turn = curvature[:, None] * along / 2
    chord = along * np.sinc(turn / np.pi)
    return np.stack([chord * np.cos(turn), chord * np.sin(turn), np.zeros_like(turn)], axis=-1)


def planar(largest: float = np.pi) -> Frames:
    """From straight to half a circle (for `largest` = pi) in one second, clamped at the origin."""
    times = np.linspace(0.0, 1.0, S)
    curvature = largest * times
    step = 1e-6
    velocity = (arc(curvature + step * largest) - arc(curvature - step * largest)) / (2 * step)
    fields = {
        "curvature": np.repeat(curvature[:, None], X, axis=1),
        "velocity": velocity,
        "strain": np.zeros((S, X)),
    }
    lines = line(points=arc(curvature), fields=fields, radius=0.005, reference=arc(np.zeros(1))[0])
    return Frames(times, {"beam": lines}, {"root": joint("clamp", np.zeros((S, 3)))})


def spatial() -> Frames:
    """Two beams in a row, the second turned out of the plane, with a pin between; only the first
    knows its strain.
    """
    first = planar()
    lines = first.bodies["beam"]
    tip = lines.points[:, -1]
    turned = lines.points[:, :, [1, 2, 0]] * np.array([1.0, 1.0, -1.0])
    second = line(
        tip[:, None] + turned, {"curvature": lines.fields["curvature"]}, 0.01, tip[0] + turned[0]
    )
    return Frames(
        first.times,
        {"I": lines, "II": second},
        {"A": first.marks["root"], "B": joint("revolute joint", tip)},
    )
