"""What a beam keeps of its section along its line: stiffness, contour, and stresses of unit forces
there.

Between stations they are polynomials, see `stations`: points, stiffness, and stresses of unit
strains, which are those of unit forces times the stiffness, and as smooth as it; one station serves
a beam of one section. Cells hold the stiffness too, with the shares of their points that do not
lock (`shapes.locking`), from which it cannot be read. Cables have a profile where their section
changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Annotated

import numpy as np

from ...core.errors import InputError, say
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Indices, Reals, Sizes, also, require
from ...shapes.table import Floats, Ints
from ..stations import shares

if TYPE_CHECKING:
    from ..sections import BeamSection, Given


@storable
@dataclass(frozen=True)
class Profile:
    """Sections at k stations of a line, with n points of their contours each, none where these are
    not known.

    Components are along and about the directors, y and z along d_2 and d_3 from where the line
    passes.
    """

    stations: Annotated[Floats, Reals("k")]  #: parameters xi of the line, ascending
    #: of N, V_y, V_z, T, M_y, M_z by their strains [N, N m, N m2]; of beams that warp B and W behind
    stiffness: Annotated[Floats, Reals("k f f")]
    #: of all loops in a row, the outer one first, with the material on the left [m]
    points: Annotated[Floats, Reals("k n 2")]
    first: Annotated[Ints, Indices("l")]  #: first points of the loops
    #: sigma_x, tau_xy, tau_xz of N, V_y, V_z, T, M_y, M_z = 1 [1/m2, 1/m3]
    unit_stresses: Annotated[Floats, Reals("k 3 f n")]
    young_modulus: float  #: [Pa], 0 without a contour
    poisson_ratio: float
    radius: Annotated[Floats, Reals("k")]  #: of the round line that it is to others [m]
    degree: int = 0  #: of the polynomials through degree + 1 stations in turn
    #: from where it is held, within which warping dies away, (k,) or none where it is not known [m]
    reach: Annotated[Floats, Reals("*")] = field(default_factory=lambda: np.zeros(0))

    @property
    def loops(self) -> list[slice]:
        """The points of every loop."""
        ends = [*self.first[1:].tolist(), self.points.shape[1]]
        return [slice(a, b) for a, b in zip(self.first.tolist(), ends, strict=True)]

    def shares(self, xi: Floats) -> Floats:
        """Shares (..., k) of the stations at parameters xi (...)."""
        return shares(self.stations, self.degree, xi)

    def radii(self, xi: Floats) -> Floats:
        """Radii (...) at parameters xi (...) [m]."""
        return np.asarray(self.shares(xi) @ self.radius)

    def at(self, xi: Floats) -> tuple[Floats, Floats, Floats]:
        """Stiffness (x, f, f), points (x, n, 2) and unit stresses (x, 3, f, n) at parameters xi
        (x,).

        Beyond the stations those of the nearest.
        """
        L = self.shares(xi)
        stiffness, points = np.tensordot(L, self.stiffness, 1), np.tensordot(L, self.points, 1)
        if not (self.degree and self.points.size):
            return stiffness, points, np.tensordot(L, self.unit_stresses, 1)
        of_strains = np.einsum("kifn,kfg->kign", self.unit_stresses, self.stiffness)
        return (
            stiffness,
            points,
            np.einsum("xign,xgf->xifn", np.tensordot(L, of_strains, 1), np.linalg.inv(stiffness)),
        )


@also.register(Profile)
def check_loops(found: Profile, name: str, sizes: Sizes) -> None:
    """Loops begin within the points, one behind the other."""
    inside = bool((np.diff(found.first) > 0).all() and (found.first < found.points.shape[1]).all())
    require(
        inside, f"{name}.first", f"ascending numbers below {found.points.shape[1]}", found.first
    )


def profile(name: str, stations: Floats, sections: Sequence[BeamSection], degree: int) -> Profile:
    """The profile of a beam with sections at stations (k,), of one material; its contour where all
    have one.

    InputError where contours have other numbers of points.
    """
    stiffness = np.stack([section.stiffness for section in sections])
    made = sections[0].material
    radius = np.array([section.radius for section in sections])
    if made is None or not all(section.outline for section in sections):
        none = (
            np.zeros((len(sections), 0, 2)),
            np.zeros(0, np.int64),
            np.zeros((len(sections), 3, 6, 0)),
        )
        return Profile(
            np.asarray(stations, dtype=float), stiffness, *none, 0.0, 0.0, radius, degree
        )
    counts = [tuple(map(len, section.outline)) for section in sections]
    if len(set(counts)) > 1:
        raise InputError(
            say(f"body '{name}'.section", "contours with the same points along the line", counts)
        )
    points = np.stack([np.concatenate(section.outline) for section in sections])
    first = np.cumsum([0, *counts[0][:-1]])
    unit = np.stack([section.unit_stresses for section in sections])
    elastic = made.young_modulus, made.poisson_ratio
    reach = np.array([section.reach for section in sections])
    return Profile(
        np.asarray(stations, dtype=float),
        stiffness,
        points,
        first,
        unit,
        *elastic,
        radius,
        degree,
        reach,
    )


def of_cable(stations: Floats, degree: int, sections: Sequence[Given]) -> Profile:
    """The profile of a cable: EA and EI on the diagonal, no contour."""
    stiffness = np.stack([np.diag([one.EA, 0.0, 0.0, 0.0, one.EI, one.EI]) for one in sections])
    none = (
        np.zeros((len(sections), 0, 2)),
        np.zeros(0, np.int64),
        np.zeros((len(sections), 3, 6, 0)),
    )
    return Profile(
        stations, stiffness, *none, 0.0, 0.0, np.array([one.radius for one in sections]), degree
    )
