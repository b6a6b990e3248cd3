"""Sheets of quadrilaterals with exact geometry: a flat unit square with a hole, and half a cylinder
of radius 1 and length 2.

Every cell has four points of its own.
"""

from __future__ import annotations

import numpy as np

from fmbs_skfem.results.frames import Array, Frames, Shown, joint

from . import rollup


def split(points: Array, quads: np.ndarray) -> tuple[Array, np.ndarray]:
    """The same quadrilaterals with points of their own."""
    return points[quads].reshape(-1, 3), np.arange(quads.size).reshape(-1, 4)


def grid(n: int, m: int) -> tuple[Array, np.ndarray]:
    """Points of [0, 1]^2 and n x m quadrilaterals, counter-clockwise."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, m + 1), indexing="ij")
    number = np.arange((n + 1) * (m + 1)).reshape(n + 1, m + 1)
    quads = np.stack(
        [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1
    ).reshape(-1, 4)
    return np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), quads


def holed() -> tuple[Array, np.ndarray]:
    """3 x 3 squares without the middle one: 12 outer edges and 4 around the hole."""
    points, quads = grid(3, 3)
    return split(points, np.delete(quads, 4, axis=0))


def cylinder(n: int = 24) -> tuple[Array, np.ndarray]:
    """Half a cylinder around the x-axis; exact normals are (0, y, z)."""
    points, quads = grid(4, n)
    angle = np.pi * points[:, 1]
    return split(np.column_stack([2 * points[:, 0], np.cos(angle), np.sin(angle)]), quads)


def turning() -> Frames:
    """The holed square turned from 0 to 90 degrees about the origin in one second, with stress
    growing to 100 MPa.
    """
    points, quads = holed()
    times = np.linspace(0.0, 1.0, 5)
    turn = np.exp(0.5j * np.pi * times)[:, None] * (points[:, 0] + 1j * points[:, 1])
    moved = np.stack([turn.real, turn.imag, 0 * turn.real], axis=-1)
    stress = 1e8 * times[:, None] * points[None, :, 0]
    body = Shown(moved, {"von_mises": stress}, np.full(len(points), 0.01), points, quads)
    return Frames(times, {"plate": body}, {"A": joint("revolute joint", np.zeros((5, 3)))})


def mixed() -> Frames:
    """Half a cylinder at rest beside the rolled-up beam."""
    beam = rollup.planar()
    points, quads = cylinder()
    points = points + np.array([0.0, -2.0, 0.0])
    count, instants = len(points), beam.times.size
    still = np.repeat(points[None], instants, axis=0)
    shell = Shown(
        still, {"von_mises": np.full((instants, count), 5e7)}, np.full(count, 0.02), points, quads
    )
    return Frames(beam.times, {"beam": beam.bodies["beam"], "roof": shell})
