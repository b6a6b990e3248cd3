r"""Sections of beams by their matrices of stiffness and mass, as beam codes and programs for blades
give them.

    (N, V_y, V_z, T, M_y, M_z) = C (gamma_x, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z)                                     (1)

    T = 1/2 (v, omega)^T M (v, omega),    M = (m 1, -m c~; m c~, J)                                                             (2)

with the x axis along the beam. The directors' rates have T = 1/2 (v, w_1, w_2, w_3) P (v, w_1, w_2,
w_3)^T with

    P = (m, m c^T; m c, tr(J)/2 1 - J)

which is int rho (1, x, y, z)^T (1, x, y, z) dA: x counts where J_xx < J_yy + J_zz, as it does for
sections that are no plane.

O. A. Bauchau, Flexible Multibody Dynamics, Springer 2011, doi:10.1007/978-94-007-0335-3, ch. 16
(both matrices).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values import units
from ...core.values.arguments import checked
from ...core.values.fields import (
    Context,
    Takes,
    array_schema,
    number_schema,
    quantity,
    read_quantity,
)
from ...core.values.problems import Problem, shown
from ..sections import BeamSection, Given, Material, Offset, Pieces, Section

Matrix = tuple[float, ...] | tuple[tuple[float, ...], ...]  #: rows, or the diagonal of a matrix
ROUND_OFF = 1e-9  #: of given numbers
SKEW = np.zeros((3, 3, 3))  #: (v~) = SKEW v
SKEW[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = -1.0
SKEW[[0, 1, 2], [2, 0, 1], [1, 2, 0]] = 1.0


def matrix(told: str, sizes: dict[int, int], kinds: Sequence[str]) -> Takes:
    """Rows of a matrix (n, n), or its diagonal, for the sizes n; entries whose row and column are
    angles have the last unit.

    `sizes` are n and the first row or column of an angle, `kinds` the units of entries with none,
    one and two of them.
    """
    dimensions = [units.find_dimension(unit) for unit in kinds]
    schema = array_schema(
        {"anyOf": [number_schema(units.NUMBER), array_schema(number_schema(units.NUMBER), 1)]},
        min(sizes),
    )

    def read(value: object, context: Context) -> Matrix:
        rows = list(value) if isinstance(value, list | tuple) else []
        size = len(rows)
        lists = [row for row in rows if isinstance(row, list | tuple)]
        if size not in sizes or (lists and [len(row) for row in lists] != [size] * size):
            raise Problem(
                told, f"{shown(value)}" + (f", the first one {shown(lists[0])}" if lists else "")
            )

        def entry(i: int, j: int, one: object) -> float:
            return read_quantity(one, dimensions[(i >= sizes[size]) + (j >= sizes[size])], context)

        if not lists:
            return tuple(entry(i, i, one) for i, one in enumerate(rows))
        return tuple(
            tuple(entry(i, j, one) for j, one in enumerate(row)) for i, row in enumerate(lists)
        )

    return Takes(read, schema | {"description": told})


STIFFNESS = matrix(
    "6 rows of 6, or the 6 of the diagonal [N, N m, N m^2]", {6: 3}, ("N", "N m", "N m^2")
)
MASS = matrix(
    "6 rows of 6, or the 6 of the diagonal, or 3 rows of 3 [kg/m, kg, kg m]",
    {6: 3, 3: 1},
    ("kg/m", "kg", "kg m"),
)


@dataclass(frozen=True)
@checked
class Matrices(Section):
    """Stiffness and mass of a beam as matrices, in the order N, Vy, Vz, T, My, Mz, along and about
    x (the line), y and z.

    `stiffness` [N, N m, N m^2] takes the strains gamma_x (axial), gamma_y, gamma_z (shear) and the
    curvatures kappa_x (twist), kappa_y, kappa_z to forces and moments, with the axial strain at a
    point

        gamma_x + z kappa_y - y kappa_z

    Its diagonal is EA, GAy, GAz, GJ, EIy, EIz. `mass` [kg/m, kg, kg m] takes velocities and angular
    velocities to momenta, its diagonal is rhoA three times and the moments of inertia about x, y,
    z; or it is 3 x 3,

        int rho (1, y, z)^T (1, y, z) dA

    Inertia may be zero.

    {shape: matrices, stiffness: [1 MN, 0.3 MN, 0.3 MN, 40 N m^2, 60 N m^2, 60 N m^2], mass: [1, 1, 1, 2 g m, 1 g m, 1 g m]}
    """

    stiffness: Annotated[Matrix, STIFFNESS]
    mass: Annotated[Matrix, MASS]
    radius: Annotated[float, quantity("m", "> 0"), "as it is drawn, and touches others"] = 0.01
    needs_material: ClassVar[bool] = False
    serves_cables: ClassVar[bool] = False

    def __post_init__(self) -> None:
        self.of_beam(None)

    def of_cable(self, material: Material | None) -> Given:
        raise InputError(
            say("section", "EA, EI and rhoA of a cable (shape: given)", "matrices of a beam")
        )

    def of_beam(
        self,
        material: Material | None,
        offset: Offset = None,
        pieces: Pieces = (),
        warping: bool = False,
    ) -> BeamSection:
        """Its matrices, about a point (y, z) of their axes [m] where that is given."""
        if warping:
            remedy = "give it a shape and a material"
            raise InputError(say("section", "a contour, for `warping`", "matrices alone", remedy))
        C, mass = square("stiffness", self.stiffness), square("mass", self.mass)
        P = mass if len(mass) == 3 else moments(mass)
        if isinstance(offset, str):
            raise InputError(
                say(
                    "offset",
                    "a point [y, z] in the axes of the matrices",
                    f"'{offset}'",
                    "the matrices imply it",
                )
            )
        if offset is not None:
            from_line = np.array([0.0, -offset[0], -offset[1]])
            move, shift = np.eye(6), np.eye(len(P))
            move[:3, 3:] = -SKEW @ from_line
            shift[1:, 0] = from_line[-len(P) + 1 :]
            C, P = move.T @ C @ move, shift @ P @ shift.T
        return BeamSection(C, P, self.radius)


def square(what: str, given: Matrix) -> np.ndarray:
    """A matrix (n, n) of its rows or its diagonal."""
    try:
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape not in ((6,), (6, 6)) + (((3, 3),) if what == "mass" else ()):
        raise InputError(
            say(f"section.{what}", "6 rows of 6 or the 6 of the diagonal", f"shape {found.shape}")
        )
    return np.diag(found) if found.ndim == 1 else found


def moments(mass: np.ndarray) -> np.ndarray:
    """P (4, 4) of M (6, 6); InputError where that is not of the form (2), or has more inertia about
    an axis than about both others.

        J_xx = J_yy + J_zz

    of sections in a plane.
    """
    m, first, J = mass[0, 0], mass[3:, :3], mass[3:, 3:]
    center = 0.5 * np.array(
        [first[2, 1] - first[1, 2], first[0, 2] - first[2, 0], first[1, 0] - first[0, 1]]
    )
    rigid = np.block([[m * np.eye(3), -SKEW @ center], [SKEW @ center, J]])
    if not (
        np.isfinite(mass).all() and np.abs(rigid - mass).max() <= ROUND_OFF * np.abs(mass).max()
    ):
        expected = "m in the first three of the diagonal, m c~ beside it, which is skew, as of a rigid slice"
        raise InputError(
            say("section.mass", expected, mass.tolist(), "take the mass of all motions of a slice")
        )
    second = 0.5 * np.trace(J) * np.eye(3) - J
    second[np.abs(second) <= ROUND_OFF * np.trace(J)] = 0.0
    if second[0, 0] < 0.0:
        expected = f"J_xx up to J_yy + J_zz = {J[1, 1] + J[2, 2]:g} kg m, as all bodies have"
        raise InputError(say("section.mass", expected, f"{J[0, 0]:g} kg m"))
    return np.block([[np.full((1, 1), m), center[None]], [center[:, None], second]])
