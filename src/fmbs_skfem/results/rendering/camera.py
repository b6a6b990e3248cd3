"""Parallel projection and the box of grid lines around a scene.

    pixel = centre of the picture + ((p - focus) . right, -(p - focus) . up) / metres_per_pixel

Planar scenes are seen from +z, spatial ones along (-1, 1, -1) / sqrt(3): isometric, x and y to the right, z up.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.storage.records import dataclass
from ...core.values.display import SI, DisplayUnits
from ..frames import Array

Margins = tuple[float, float, float, float]


@dataclass(frozen=True)
class Box:
    """Grid planes at multiples of one step [m]: lower and upper corner (3,); flat in z for planar scenes."""

    lower: Array
    upper: Array
    step: float  #: [m]
    unit: str = "m"  #: in which lengths are read
    scale: float = 1.0  #: size of that [m]

    @property
    def corners(self) -> Array:
        """The eight corners, (8,3)."""
        return np.stack(np.meshgrid(*zip(self.lower, self.upper, strict=True)), axis=-1).reshape(8, 3)

    @property
    def size(self) -> float:
        """The longest side [m]."""
        return float((self.upper - self.lower).max())

    @property
    def cells(self) -> np.ndarray:
        """Steps along x, y and z, (3,)."""
        return np.rint((self.upper - self.lower) / self.step).astype(int)


@dataclass(frozen=True)
class Camera:
    """Where the scene is seen from, in metres and pixels."""

    box: Box  #: what it shows
    right: Array  #: (3,) unit vector
    up: Array  #: (3,) unit vector
    focus: Array  #: (3,) point in the middle of the picture [m]
    metres_per_pixel: float
    size: tuple[int, int]  #: width, height [pixel]

    @property
    def towards(self) -> Array:
        """Unit vector from the scene to the eye, (3,)."""
        return np.cross(self.right, self.up)

    @property
    def thinnest(self) -> float:
        """Smallest radius of a tube that is still seen well [m]."""
        return max(0.0045 * self.box.size, 1.7 * self.metres_per_pixel)


def nice_step(extent: float, cells: int) -> float:
    """The largest of 1, 2, 5 times a power of ten that cuts `extent` into at least `cells` pieces."""
    raw = extent / cells
    power = 10.0 ** math.floor(math.log10(raw))
    return power * max(factor for factor in (1.0, 2.0, 5.0) if factor * power <= raw * (1 + 1e-9))


def box(points: Array, planar: bool, cells: int = 4, display: DisplayUnits = SI) -> Box:
    """The box of whole steps around `points` (n,3); the longest side has at least `cells`, each at least two.

    Steps are round numbers in the unit in which lengths are read.
    """
    lower, upper = points.min(axis=0), points.max(axis=0)
    extent = max(float((upper - lower).max()), 1e-6 * float(np.abs(points).max()))  # coinciding points still get a box
    unit, scale = display.find("m", float(np.abs(points).max()))
    step = nice_step(extent / scale if extent > 1e-12 else 1.0, cells) * scale
    low, high = np.floor(lower / step + 1e-6), np.ceil(upper / step - 1e-6)
    thin = high - low < 2
    low, high = np.where(thin, low - 1, low) * step, np.where(thin, high + 1, high) * step
    if planar:
        low[2], high[2] = lower[2], upper[2]
    return Box(low, high, step, unit, scale)


def axes(planar: bool) -> tuple[Array, Array]:
    """Unit vectors (3,) to the right and up in the picture."""
    if planar:
        return np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    return np.array([1.0, 1.0, 0.0]) / math.sqrt(2), np.array([-1.0, 1.0, 2.0]) / math.sqrt(6)


def fit(box: Box, planar: bool, size: tuple[int, int], margins: Margins) -> Camera:
    """The camera that shows a box as large as it fits inside the margins (left, right, top, bottom) [pixel]."""
    right, up = axes(planar)
    left, rest, top, bottom = margins
    across, along = box.corners @ right, box.corners @ up
    scale = max(np.ptp(across) / (size[0] - left - rest), np.ptp(along) / (size[1] - top - bottom))
    sideways, upwards = (rest - left) / 2 * scale, (top - bottom) / 2 * scale
    return Camera(box, right, up, (box.lower + box.upper) / 2 + sideways * right + upwards * up, float(scale), size)


def project(camera: Camera, points: Array) -> Array:
    """Pixels (..., 2) of `points` (..., 3), counted from the upper left corner."""
    offset = (points - camera.focus) / camera.metres_per_pixel
    return np.stack([camera.size[0] / 2 + offset @ camera.right, camera.size[1] / 2 - offset @ camera.up], axis=-1)
