r"""Pressure that follows a surface in space, or an edge in the plane: a force along the normal of
the deformed configuration.

    surface   f = p r,1 x r,2          edge   f = p J^T r,1,   J^T (x, y) = (y, -x)          force per reference area or length

The force acts on r alone. Its moduli are the symmetric part of -weight df/du; what is left out of
the tangent is an integral along the rim alone: it vanishes where the surface is closed or the rim
is held, and the matrix is exact there. So does the work that is not the change of -p V,

    V = 1/3 int r . (r,1 x r,2) dA         edge   V = 1/2 int r . J^T r,1 ds

which is counted from its value v0 in the reference. At a rim that is free to move the force is
exact as well, Newton's iteration converges linearly, and -p V depends on the origin: energies of
systems have the work of the force in its place (`systems.work`).

Arrays: gradients `u` (9, p, e) hold r, r,1, r,2 (3 rows each), those of an edge (4, p, e) r and r,1
(2 rows each); `S` the same, `D` with one more axis; `section` (3, p, e) holds p [Pa] (of an edge
[N/m]), v0 (integrand of 3 V, 2 V) and the weight of each point.

Source of the load stiffness: Abaqus Theory Manual 6.6, section 6.5.1, Pressure load stiffness
(Dassault Systemes).
"""

from __future__ import annotations

from typing import Any

from ..core.compiling.entries import entry
from ..core.compiling.jit import carray
from .vectors import cross, dot, vector

LINES = 3  #: rows of a section
ROWS, EDGE_ROWS = 9, 4  #: of gradients


@entry
def energy_at(
    u: Any, _: Any, section: Any, W: Any, way: int, points: int, cells: int, law: int, beta: float
) -> None:
    """Energy of a pressure that follows a surface [J].

        -p (V - V0),    V = 1/3 int r . (r,1 x r,2) dA

    summed over all points: W[0].
    """
    count = points * cells
    total = 0.0
    u, section = carray(u, (ROWS, count)), carray(section, (LINES, count))
    for q in range(count):
        volume = dot(vector(u, 0, q), cross(1.0, vector(u, 1, q), vector(u, 2, q)))
        total -= section[2, q] * section[0, q] * (volume - section[1, q]) / 3.0
    carray(W, 1)[0] = total


@entry
def stress_at(
    u: Any, _: Any, section: Any, S: Any, way: int, points: int, cells: int, law: int, beta: float
) -> None:
    """Stress of a pressure that follows a surface.

        S = -weight (p r,1 x r,2, 0, 0)

    (9, p, e), as the gradients.
    """
    count = points * cells
    u, section, S = (
        carray(u, (ROWS, count)),
        carray(section, (LINES, count)),
        carray(S, (ROWS, count)),
    )
    S[3:] = 0.0
    for q in range(count):
        S[0, q], S[1, q], S[2, q] = cross(
            -section[2, q] * section[0, q], vector(u, 1, q), vector(u, 2, q)
        )


@entry
def modulus_at(
    u: Any, _: Any, section: Any, D: Any, way: int, points: int, cells: int, law: int, beta: float
) -> None:
    """Modulus of a pressure that follows a surface (9, 9, p, e): the symmetric part, without the
    integral along the rim.

        D(r r,1) = weight p/2 [r,2 x],    D(r r,2) = -weight p/2 [r,1 x]
    """
    count = points * cells
    u, section, D = (
        carray(u, (ROWS, count)),
        carray(section, (LINES, count)),
        carray(D, (ROWS, ROWS, count)),
    )
    D[:] = 0.0
    for q in range(count):
        half = 0.5 * section[2, q] * section[0, q]
        for k in range(2):
            sign = half if k == 0 else -half
            a = vector(u, 2 - k, q)
            row = 3 + 3 * k
            for i in range(3):
                j, l = (i + 1) % 3, (i + 2) % 3
                D[i, row + j, q] = D[row + j, i, q] = -sign * a[l]
                D[i, row + l, q] = D[row + l, i, q] = sign * a[j]


@entry
def edge_energy_at(
    u: Any, _: Any, section: Any, W: Any, way: int, points: int, cells: int, law: int, beta: float
) -> None:
    """-p (V - V0) [J] summed over all points, V the area beside the edge: W[0]."""
    count = points * cells
    total = 0.0
    u, section = carray(u, (EDGE_ROWS, count)), carray(section, (LINES, count))
    for q in range(count):
        area = u[0, q] * u[3, q] - u[1, q] * u[2, q]
        total -= 0.5 * section[2, q] * section[0, q] * (area - section[1, q])
    carray(W, 1)[0] = total


@entry
def edge_stress_at(
    u: Any, _: Any, section: Any, S: Any, way: int, points: int, cells: int, law: int, beta: float
) -> None:
    """Stress of a pressure that follows an edge in the plane.

        S = -weight (p J^T r,1, 0),    J^T (x, y) = (y, -x)

    (4, p, e), as the gradients.
    """
    count = points * cells
    u, section, S = (
        carray(u, (EDGE_ROWS, count)),
        carray(section, (LINES, count)),
        carray(S, (EDGE_ROWS, count)),
    )
    S[2:] = 0.0
    for q in range(count):
        load = section[2, q] * section[0, q]
        S[0, q], S[1, q] = -load * u[3, q], load * u[2, q]


@entry
def edge_modulus_at(
    u: Any, _: Any, section: Any, D: Any, way: int, points: int, cells: int, law: int, beta: float
) -> None:
    """Modulus of a pressure that follows an edge in the plane.

        D(r r,1) = -weight p/2 J^T,    J^T (x, y) = (y, -x)

    (4, 4, p, e), the symmetric part.
    """
    count = points * cells
    section, D = carray(section, (LINES, count)), carray(D, (EDGE_ROWS, EDGE_ROWS, count))
    D[:] = 0.0
    for q in range(count):
        half = 0.5 * section[2, q] * section[0, q]
        D[0, 3, q] = D[3, 0, q] = -half
        D[1, 2, q] = D[2, 1, q] = half


FUNCTIONS = {"energy": energy_at, "stress": stress_at, "modulus": modulus_at}
FUNCTIONS |= {
    "edge_energy": edge_energy_at,
    "edge_stress": edge_stress_at,
    "edge_modulus": edge_modulus_at,
}
