"""What a beam keeps of its section along its line: stiffness, contour, and stresses of unit forces there.

All are linear between stations; one station serves a beam of one section. Cells hold the stiffness too, with the shares of their
points that do not lock (`shapes.locking`), from which it cannot be read.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import numpy as np

from ...core.errors import InputError, say
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Indices, Reals, Sizes, also, require
from ...shapes.table import Floats, Ints

if TYPE_CHECKING:
    from ..sections import BeamSection


@storable
@dataclass(frozen=True)
class Profile:
    """Sections at k stations of a line, with n points of their contours each, none where these are not known.

    Components are along and about the directors, y and z along d_2 and d_3 from where the line passes.
    """

    stations: Annotated[Floats, Reals("k")]  #: parameters xi of the line, ascending
    stiffness: Annotated[Floats, Reals("k 6 6")]  #: of N, V_y, V_z, T, M_y, M_z by their strains [N, N m, N m2]
    points: Annotated[Floats, Reals("k n 2")]  #: of all loops in a row, the outer one first, with the material on the left [m]
    first: Annotated[Ints, Indices("l")]  #: first points of the loops
    unit_stresses: Annotated[Floats, Reals("k 3 6 n")]  #: sigma_x, tau_xy, tau_xz of N, V_y, V_z, T, M_y, M_z = 1 [1/m2, 1/m3]
    young_modulus: float  #: [Pa], 0 without a contour
    poisson_ratio: float

    @property
    def loops(self) -> list[slice]:
        """The points of every loop."""
        ends = [*self.first[1:].tolist(), self.points.shape[1]]
        return [slice(a, b) for a, b in zip(self.first.tolist(), ends, strict=True)]

    def at(self, xi: Floats) -> tuple[Floats, Floats, Floats]:
        """Stiffness (x, 6, 6), points (x, n, 2) and unit stresses (x, 3, 6, n) at parameters xi (x,).

        Beyond the stations those of the nearest.
        """
        last = len(self.stations) - 1
        k = np.clip(np.searchsorted(self.stations, xi, side="right") - 1, 0, max(last - 1, 0))
        after = np.minimum(k + 1, last)
        share = (xi - self.stations[k]) / np.where(after > k, self.stations[after] - self.stations[k], 1.0)
        share = share.clip(0.0, 1.0)

        def between(part: Floats) -> Floats:
            return np.asarray(np.einsum("wx,wx...->x...", [1.0 - share, share], part[[k, after]]))

        return between(self.stiffness), between(self.points), between(self.unit_stresses)


@also.register(Profile)
def check_loops(found: Profile, name: str, sizes: Sizes) -> None:
    """Loops begin within the points, one behind the other."""
    inside = bool((np.diff(found.first) > 0).all() and (found.first < found.points.shape[1]).all())
    require(inside, f"{name}.first", f"ascending numbers below {found.points.shape[1]}", found.first)


def profile(name: str, stations: Floats, sections: Sequence[BeamSection]) -> Profile:
    """The profile of a beam with sections at stations (k,), of one material; its contour where all have one.

    InputError where contours have other numbers of points.
    """
    stiffness, made = np.stack([section.stiffness for section in sections]), sections[0].material
    if made is None or not all(section.outline for section in sections):
        none = np.zeros((len(sections), 0, 2)), np.zeros(0, np.int64), np.zeros((len(sections), 3, 6, 0))
        return Profile(np.asarray(stations, dtype=float), stiffness, *none, 0.0, 0.0)
    counts = [tuple(map(len, section.outline)) for section in sections]
    if len(set(counts)) > 1:
        raise InputError(say(f"body '{name}'.section", "contours with the same points along the line", counts))
    points = np.stack([np.concatenate(section.outline) for section in sections])
    first, unit = np.cumsum([0, *counts[0][:-1]]), np.stack([section.unit_stresses for section in sections])
    return Profile(np.asarray(stations, dtype=float), stiffness, points, first, unit, made.young_modulus, made.poisson_ratio)
