"""Colour scales of fields: name, unit and range, one rule for pictures and pages.

number beside the scale = value [SI] / unit,        position in the scale = (value - low) / (high - low)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.storage.records import dataclass
from ..core.values.display import DisplayUnits
from . import frames as frames_
from .frames import Frames, Shown

#: text beside the colour scale of well-known fields
LABELS = {
    "displacement": "displacement [m]",
    "velocity": "speed [m/s]",
    "strain": "axial strain [-]",
    "curvature": "curvature [1/m]",
    "error": "position error [m]",
    "von_mises": "von Mises stress [Pa]",
    "von_mises_recovered": "von Mises stress, recovered [Pa]",
    "von_mises_top": "von Mises stress, top [Pa]",
    "von_mises_bottom": "von Mises stress, bottom [Pa]",
    "axial_force": "axial force [N]",
    "bending_moment": "bending moment [N m]",
    "shear_force": "shear force [N]",
    "torque": "torque [N m]",
    "torsion": "torsion [1/m]",
    "normal_stress": "stress along the beam [Pa]",
}
STRESSES = frozenset(name for name, label in LABELS.items() if "[Pa]" in label)
SILENT = ", round-off"  #: said of what is drawn as zero
#: round-off of a position, relative to the largest coordinate
DIGITS = 8.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class ColourScale:
    """The field that colours bodies, with its range over all instants."""

    field: str
    label: str  #: with the unit in which its numbers are read
    limits: tuple[float, float]  #: in that unit
    unit: float  #: size of that in SI
    silent: bool = False  #: all of it is round-off, and drawn as zero
    logarithmic: bool = False  #: by decades

    @property
    def diverges(self) -> bool:
        """Whether it has both signs."""
        return self.limits[0] < 0.0 < self.limits[1]

    def values(self, body: Shown) -> np.ndarray:
        """Numbers (s, x) of a body in the unit of the scale, NaN where it does not have the field."""
        return frames_.magnitude(body, self.field) / self.unit * (not self.silent)


def make_scale(
    every: Sequence[Frames],
    name: str,
    display: DisplayUnits,
    label: str = "",
    given: tuple[float, float] | None = None,
    logarithmic: bool = False,
) -> ColourScale:
    """The scale of a field over all motions, with its name and its limits [SI] where they are
    given.
    """
    silent = all(is_round_off(one, name) for one in every)
    low, high = given or limits(every, name, logarithmic)
    text, unit = display.head(label or LABELS.get(name, name), [0.0] if silent else [low, high])
    return ColourScale(
        name, text + SILENT * silent, (low / unit, high / unit), unit, silent, logarithmic
    )


def shows(frames: Frames, name: str) -> bool:
    """Whether some body has a field that is not zero, nor round-off."""
    found = [body.fields[name] for body in frames.bodies.values() if name in body.fields]
    return any(np.any(values) for values in found) and not is_round_off(frames, name)


def is_round_off(frames: Frames, name: str) -> bool:
    """Whether strains or curvatures, not all zero, are those that the round-off of positions makes
    of straight or flat bodies.

        DIGITS |x| / h,    DIGITS |x| / h^2

    Strains [-] and curvatures [1/m] are off by so much, for positions x at a distance h.
    """
    power = {"strain": 1, "curvature": 2}.get(name, 0)
    found = False
    for body in frames.bodies.values():
        if power and name in body.fields:
            largest = float(np.abs(frames_.magnitude(body, name)).max())
            if largest * spacing(body) ** power > DIGITS * float(np.abs(body.points).max()):
                return False
            found |= largest > 0.0
    return found


def spacing(body: Shown) -> float:
    """Mean distance of the points of a cell in the reference [m]."""
    ends = body.reference[body.cells]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())


def limits(every: Sequence[Frames], name: str, logarithmic: bool = False) -> tuple[float, float]:
    """Limits of the colour scale over all motions, instants and bodies: symmetric where the field
    has both signs, five decades at most.

    Stresses start at zero; what is round-off does not count, and alone it is zero on a scale up to
    1.
    """
    clear = [one for one in every if not is_round_off(one, name)]
    if not clear:
        return 0.0, 1.0
    bodies = [body for one in clear for body in one.bodies.values()]
    values = np.concatenate([frames_.magnitude(body, name).ravel() for body in bodies])
    values = values[np.isfinite(values) & ((values > 0) | (not logarithmic))]
    if values.size == 0:
        return (1e-5, 1.0) if logarithmic else (0.0, 1.0)
    low, high = float(values.min()), float(values.max())
    if logarithmic:
        return min(max(low, 1e-5 * high), 0.5 * high), high
    if name in STRESSES and low >= 0.0 < high:
        return 0.0, high
    if low < 0 < high:
        largest = max(-low, high)
        return -largest, largest
    pad = 0.5 * (abs(low) or 1.0) if high - low <= 1e-12 * max(abs(low), abs(high)) else 0.0
    return low - pad, high + pad
