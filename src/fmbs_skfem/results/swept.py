r"""Beams with torsion in pictures: the contour of the section swept along the line, with strains,
section forces and stresses.

    p(s, x) = r + y e_2 + z e_3,    e_i = d_i / |d_i|

of the contour points y, z of the section at x places; both ends are closed. Fields are

    strain, torsion, shear_strain       of the line [-], a length [1/m], and sqrt(gamma_y^2 + gamma_z^2) [-]
    axial_force, shear_force            N and sqrt(V_y^2 + V_z^2) [N]
    torque, bending_moment              T and sqrt(M_y^2 + M_z^2) [N m]
    normal_stress, von_mises            at the contour [Pa]
    axis_1, axis_2, axis_3              directors, unit vectors
    curvature, velocity                 of the line [1/m], and of the point [m/s]

Beams whose contour is not known stay lines, with the same fields but stresses; so do those in the
plane, with the largest stresses of the contour.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..bodies.beams.section_constants import von_mises
from ..bodies.beams.section_shapes import distances, sides, triangulated
from ..bodies.laws import Law
from ..core.storage.records import dataclass
from ..systems.measures.beam_sections import SweptLine, gradients
from ..systems.system import LineSamples
from . import frames as frames_
from .frames import Array, Indices, Shown


@dataclass(frozen=True)
class SweptMesh:
    """A contour of n points at x places as a surface, its ends closed by triangles between points
    of their own.
    """

    ends: Array  #: (m, n) points of each end from those of the contour there
    cells: Indices  #: (f, 4)

    def spread(self, values: Array) -> Array:
        """Values (s, x, n, ...) at all points, (s, x n + 2 m, ...)."""
        closed = [np.einsum("mn,sn...->sm...", self.ends, values[:, k]) for k in (0, -1)]
        return np.concatenate([values.reshape(len(values), -1, *values.shape[3:]), *closed], axis=1)


def skin(shown: Shown, line: LineSamples, q: Array, rate: Array, reference: Array) -> Shown:
    """The skin of a beam of which the line is shown, from samples q and rates (s, q), and the
    reference (1, q).
    """
    swept: SweptLine = line.swept
    every = (len(shown.reference) - 1) // (len(swept.places) - 1)
    profile = swept.profile
    u, moving, before = (np.asarray(swept.rows @ part.T).T for part in (q, rate, reference))
    strains, forces = swept.sections.read(u)
    now, start = (gradients(swept.sections, part)[0] for part in (u, before))
    change = gradients(swept.sections, moving, rates=True)[0]
    size = np.linalg.norm(now[1:4], axis=-1, keepdims=True)
    along = {
        "strain": strains[0],
        "curvature": shown.fields["curvature"][:, ::every],
        "torsion": strains[3],
        "shear_strain": np.hypot(*strains[1:3]),
        "axial_force": forces[0],
        "shear_force": np.hypot(*forces[1:3]),
        "torque": forces[3] + swept.sections.torques(u, forces),
        "bending_moment": np.hypot(*forces[4:6]),
        **{f"axis_{k + 1}": now[1 + k] / size[k] for k in range(3)},
    }
    _, contour, unit = profile.at(swept.places)
    stress = np.einsum("xkfn,fsx->ksxn", unit, forces)
    if not profile.points.size or line.law is Law.PLANAR_BEAM:
        fields = along | {"velocity": change[0]}
        if profile.points.size:
            fields["von_mises"] = von_mises(stress).max(axis=2)
            fields["normal_stress"] = largest(stress[0])
        return frames_.line(shown.points[:, ::every], fields, line.radius, shown.reference[::every])
    mesh = closed(profile.points[0], profile.first, len(swept.places))
    everywhere = {
        name: np.repeat(values[:, :, None], contour.shape[1], axis=2)
        for name, values in along.items()
    }
    fields = everywhere | {
        "normal_stress": stress[0],
        "von_mises": von_mises(stress),
        "velocity": placed(contour, change, size),
    }
    points = mesh.spread(placed(contour, now, size))
    still = mesh.spread(placed(contour, start, np.linalg.norm(start[1:4], axis=-1, keepdims=True)))[
        0
    ]
    radius = np.full(len(still), line.radius)
    return Shown(
        points,
        {name: mesh.spread(one) for name, one in fields.items()},
        radius,
        still,
        mesh.cells,
        contour.shape[:2],
    )


def largest(values: Array) -> Array:
    """The value of largest size (s, x), with its sign, of those at the points (s, x, n)."""
    low, high = values.min(axis=2), values.max(axis=2)
    return np.asarray(np.where(-low > high, low, high))


def placed(contour: Array, vectors: Array, size: Array) -> Array:
    """Points (s, x, n, 3) of contours (x, n, 2), of r, d_i (8, s, x, 3) with directors of a size
    (3, s, x, 1); or their rates.
    """
    across = np.stack([vectors[2] / size[1], vectors[3] / size[2]])
    return np.asarray(vectors[0][:, :, None] + np.einsum("xna,asxc->sxnc", contour, across))


def closed(contour: Array, first: Indices, places: int) -> SweptMesh:
    """The mesh of a contour (n, 2), whose loops have these `first` points, at so many places."""
    count = len(contour)
    around = [
        np.column_stack([one, np.roll(one, -1)]) for one in np.split(np.arange(count), first[1:])
    ]
    side = np.concatenate(around)
    # of the first and the second place
    pair = np.concatenate([side, count + side[:, ::-1]], axis=1)
    quads = (pair[None] + count * np.arange(places - 1)[:, None, None]).reshape(-1, 4)
    ends, triangles = cap(contour.tobytes(), first.tobytes(), count)
    facets = np.column_stack([triangles, triangles[:, -1]])
    begin = count * places
    return SweptMesh(
        ends, np.concatenate([quads, begin + facets[:, ::-1], begin + len(ends) + facets])
    )


@lru_cache(maxsize=64)  # pictures of long motions come instant by instant
def cap(points: bytes, first: bytes, count: int) -> tuple[Array, Indices]:
    """Points (m, n) of a contour's inside, as shares of those of the contour, and triangles (e, 3)
    between them.

    `points` (n, 2) and the `first` points of loops are the bytes of their arrays.
    """
    contour = np.frombuffer(points).reshape(count, 2)
    starts = np.frombuffer(first, dtype=np.int64)
    start, end, after = sides(np.split(contour, starts[1:]))
    found, triangles = triangulated(start, end, after)
    nearest = distances(found, start, end).argmin(axis=1)
    along = (end - start)[nearest]
    share = np.sum((found - start[nearest]) * along, axis=1) / np.sum(along**2, axis=1)
    shares = np.zeros((len(found), count))
    rows = np.arange(len(found))
    shares[rows, nearest], shares[rows, after[nearest]] = 1.0 - share, share
    return shares, triangles
