"""Parallel projection.

    pixel = centre of the picture + ((p - focus) . right, -(p - focus) . up) / metres_per_pixel

Planar scenes are seen from +z, spatial ones along (-1, 1, -1) / sqrt(3): isometric, x and y to the
right, z up.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.storage.records import dataclass
from ..frames import Array
from ..marks import THIN

Margins = tuple[float, float, float, float]
SMALLEST = 1e-280  #: size that a camera can divide by [m]


@dataclass(frozen=True)
class Camera:
    """Where the scene is seen from, in metres and pixels."""

    axes: Array  #: (3,3): unit vectors to the right, up and towards the eye
    focus: Array  #: (3,) point in the middle of the picture [m]
    extent: Array  #: (3,) of what it shows, along these axes [m]
    metres_per_pixel: float
    size: tuple[int, int]  #: width, height [pixel]

    @property
    def thinnest(self) -> float:
        """Smallest radius of a tube that is still seen well [m]."""
        return max(THIN * float(self.extent.max()), 1.7 * self.metres_per_pixel)


def axes(planar: bool) -> Array:
    """Unit vectors to the right, up and towards the eye, (3,3)."""
    if planar:
        return np.eye(3)
    return np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 2.0], [1.0, -1.0, 1.0]]) / np.sqrt(
        [[2.0], [6.0], [3.0]]
    )


def fit(points: Array, planar: bool, size: tuple[int, int], margins: Margins) -> Camera:
    """The camera that shows points (n,3) as large as they fit inside the margins (left, right, top,
    bottom) [pixel].
    """
    view = axes(planar)
    seen = points @ view.T
    extent = np.ptp(seen, axis=0)
    middle = seen.min(axis=0) + extent / 2.0
    largest = float(np.abs(points).max())
    # coinciding points are still seen
    least = 1e-6 * largest if extent.any() else largest
    extent = np.maximum(extent, least if least > SMALLEST else 1.0)
    left, right, top, bottom = margins
    scale = max(
        extent[0] / max(size[0] - left - right, 1.0), extent[1] / max(size[1] - top - bottom, 1.0)
    )
    middle += np.array([right - left, top - bottom, 0.0]) / 2.0 * scale
    return Camera(view, middle @ view, extent, float(scale), size)


def project(camera: Camera, points: Array) -> Array:
    """Pixels (..., 2) of `points` (..., 3), counted from the upper left corner."""
    offset = (points - camera.focus) @ camera.axes[:2].T / camera.metres_per_pixel
    return np.asarray(np.array(camera.size) / 2.0 + offset * [1.0, -1.0])


def round_length(longest: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `longest`."""
    power = 10.0 ** math.floor(math.log10(longest))
    return power * max(
        factor for factor in (1.0, 2.0, 5.0) if factor * power <= longest * (1 + 1e-9)
    )
