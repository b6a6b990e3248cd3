r"""Rigid bodies in natural coordinates: the centre of mass c and unit axes e_k, with constant mass.

    r = c + sum_k X_k e_k,    M = [[m, 0], [0, G]],    G_kl = int X_k X_l dm = 1/2 tr(J) delta_kl - J_kl

The axes stay orthonormal by quadratic constraints. In the plane J is one number and G = J/2 for
both axes: the product of inertia does no work. In space G has no negative directions where J obeys
the triangle inequality; laminae and rods have massless axes.

Source: J. Garcia de Jalon, Multibody Syst. Dyn. 18 (2007) 15-33, doi:10.1007/s11044-007-9068-0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import csr_array

from ..core.errors import InputError, require_positive, say
from ..core.notices import notify
from ..core.values.arguments import blamed
from ..shapes import plate_audit, plate_meshes
from ..shapes.plate_meshes import PlateMesh
from .body import Body, place

LIGHT = 1e-12  #: second moment, relative to the largest, that counts as none
CENTERED = 1e-6  #: distance from the centre of mass, relative to the size, that is none
SLIM = 0.02  #: drawn radius over the extent of a body
Numbers = float | Sequence[float] | Sequence[Sequence[float]] | np.ndarray


@blamed
def rigid(
    name: str,
    mass: float,
    inertia: Numbers,
    center: Sequence[float] | np.ndarray,
    *,
    dim: int = 3,
    rotation: np.ndarray | None = None,
    places: Mapping[str, Sequence[float]] | None = None,
    outline: np.ndarray | None = None,
) -> Body:
    """A rigid body with the frame `frame`, the place `center` and named places, points (c,) of the
    scene in the reference [m].

    `inertia` [kg m2] about the centre of mass: a number in the plane, in space 3 principal moments
    or a 3 x 3 tensor, in the axes e_k = rotation[:, k], by default those of the scene. Laminae and
    rods take their principal axes instead, so that what has no mass is an axis of its own. Pictures
    show the line through the points `outline` (x, c) of the scene, by default through the places
    and, where these are one or two, the centre.

    InputError where the mass [kg] is not positive, the inertia is none of a body (a principal
    moment above the sum of the others), the `rotation` (c, c) is not orthonormal or mirrors, a
    point has not c finite coordinates, or a place `center` or `frame` is elsewhere.

    Source: J. Garcia de Jalon, Multibody Syst. Dyn. 18 (2007) 15-33, doi:10.1007/s11044-007-9068-0.

        >>> from fmbs_skfem.bodies import rigid
        >>> ends = {"left": (0.0, 0.0), "right": (1.0, 0.0)}
        >>> rod = rigid.rigid("rod", 0.6, 0.05, (0.5, 0.0), dim=2, places=ends)
        >>> rod.total_mass, sorted(rod.places)
        (0.6, ['center', 'left', 'right'])
    """
    where = f"body '{name}'"
    require_positive(where, mass=mass)
    axes = orthonormal(
        where, np.eye(dim) if rotation is None else np.asarray(rotation, dtype=float), dim
    )
    c = point(where, center, dim)
    spread, turn = second_moments(where, inertia, dim)
    axes = axes @ turn
    if not np.array_equal(turn, np.eye(dim)):
        listed = ", ".join("({:.3g}, {:.3g}, {:.3g})".format(*(axis + 0.0)) for axis in axes.T)
        text = "has no thickness in a slanted direction; its axes, along which follower forces act, are principal"
        notify(f"{where}: {text}: {listed}")
    named = {
        key: tuple(float(x) for x in (point(where, at, dim) - c) @ axes)
        for key, at in (places or {}).items()
    }
    shown = (
        through(np.array(list(named.values())).reshape(-1, dim))
        if outline is None
        else (outline - c) @ axes
    )
    check_names(where, named, float(np.linalg.norm(shown, axis=1).max()))
    return Body(
        name,
        np.vstack([c, axes.T]),
        csr_array(block_diag(np.array([[float(mass)]]), spread)),
        np.array([1.0] + [0.0] * dim),
        {"center": (0.0,) * dim, **named},
        radius=SLIM * float(np.ptp(shown, axis=0).max()),
        frames={"frame": 0},
        outline=np.hstack([np.ones((len(shown), 1)), shown]),
    )


def check_names(where: str, places: Mapping[str, tuple[float, ...]], size: float) -> None:
    """InputError where a place is called `center` or `frame` and is not the centre of mass, about
    which places (c,) [m] are given.

    Up to `CENTERED` of the `size` [m] of the body it is.
    """
    for key in ("center", "frame"):
        apart = float(np.linalg.norm(places.get(key, 0.0)))
        if apart > CENTERED * size:
            got = f"'{key}' {apart:.6g} m away from it"
            raise InputError(
                say(
                    where,
                    "no other place than the centre of mass with that name",
                    got,
                    "rename the point",
                )
            )


def through(places: np.ndarray) -> np.ndarray:
    """The line (x, c) that stands for a body with these places (k, c) about its centre: a rod, an
    angle, or a closed polygon [m].

    Places that follow one another at one point are left out.
    """
    center = np.zeros((1, places.shape[1]))
    closed = (
        np.vstack([places, places[:1]])
        if len(places) > 2
        else np.vstack([places[:1], center, places[1:]])
    )
    moved = np.linalg.norm(np.diff(closed, axis=0), axis=1) > 0.0
    return closed[np.concatenate([[True], moved])]


def rigid_from_mesh(
    name: str,
    mesh: PlateMesh | str | Path,
    thickness: float,
    density: float,
    *,
    dim: int = 3,
    origin: np.ndarray | None = None,
    rotation: np.ndarray | None = None,
) -> Body:
    """The rigid body that a plate of constant thickness [m] and density [kg/m3] makes; points of
    the mesh are its places.

        m = rho t A,   S = rho t int (x x^T + t^2/12 n n^T) dA,   J = tr(S) 1 - S          in the plane J = tr(S), without n n^T

    with x from the centroid and unit normals n.

    `origin` (c,) [m] and `rotation` (c, c) place the mesh, x -> origin + rotation x. Places are
    groups of one node. InputError where a thickness or density is not positive, points are out of
    the plane of a planar scene, and as of `rigid`.
    """
    where = f"body '{name}'"
    require_positive(where, thickness=thickness, density=density)
    mesh = plate_meshes.read(mesh, dim == 2) if isinstance(mesh, (str, Path)) else mesh
    points = place(where, mesh.points, dim, origin, rotation)
    area, center, moments = area_moments(points[mesh.cells])
    heavy = density * thickness
    if dim == 3:
        moments = moments + thickness**2 / 12 * normal_moments(points[mesh.cells])
    places = {key: points[ids[0]] for key, ids in mesh.point_groups.items() if len(ids) == 1}
    spread = heavy * moments
    inertia = np.trace(spread) if dim == 2 else np.trace(spread) * np.eye(3) - spread
    named = {key: tuple(at) for key, at in places.items()}
    return rigid(
        name, heavy * area, inertia, center, dim=dim, places=named, outline=rim(points, mesh.cells)
    )


def rim(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The longest of the closed lines (x, c) [m] around the cells (e, 3 or 4) of a mesh with points
    (j, c) [m].

    Its last point is its first.
    """
    after = dict(plate_audit.border(cells, len(points))[0].tolist())
    lines = []
    while after:
        loop = list(after.popitem())
        while loop[-1] in after:
            loop.append(after.pop(loop[-1]))
        lines.append(points[loop])
    return max(lines, key=lambda line: float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()))


def triangles(cells: np.ndarray) -> np.ndarray:
    """Triangles (i, 3, c) that make up the cells (e, 3 or 4, c).

    Triangles are themselves; quadrilaterals are parted into their corners 0, 1, 2 and 0, 2, 3.
    """
    return (
        cells if cells.shape[1] == 3 else np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
    )


def areas(corners: np.ndarray) -> np.ndarray:
    """Areas (i,) of triangles [m2] by two of their sides a and b.

        sqrt(|a|^2 |b|^2 - (a.b)^2) / 2

    of corners (i, 3, c) [m].
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    gram = np.sum(a * a, axis=1) * np.sum(b * b, axis=1) - np.sum(a * b, axis=1) ** 2
    return np.asarray(0.5 * np.sqrt(gram))


def area_moments(cells: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Area [m2], centroid (c,) [m] and second moments (c, c) [m4] of cells (e, 3 or 4, c) [m].

        int (x - centroid) (x - centroid)^T dA

    Exact for flat triangles; quadrilaterals are parted into two.
    """
    corners = triangles(cells)
    size = areas(corners)
    total = float(size.sum())
    middle = corners.mean(axis=1)
    center = size @ middle / total
    apart = corners - center
    sums = apart.sum(axis=1)
    moments = np.einsum("i,ivc,ivd->cd", size, apart, apart) + np.einsum(
        "i,ic,id->cd", size, sums, sums
    )
    return total, center, moments / 12


def normal_moments(cells: np.ndarray) -> np.ndarray:
    """Second moments (3, 3) [m2] of the unit normals of cells.

        int n n^T dA

    of corners (e, 3 or 4, 3) [m].
    """
    corners = triangles(cells)
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.einsum("ic,id,i->cd", n, n, 0.5 / np.linalg.norm(n, axis=1)))


def second_moments(where: str, inertia: Numbers, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """G (c, c) [kg m2] of an inertia, which must belong to a body of positive mass, and its axes
    (c, c) in those of the inertia.

        G = tr(J) 1 / 2 - J in space,    G = J 1 / 2 in the plane

    The axes are the same but for a body without mass in a direction that is none of them: it gets
    its principal axes. `inertia` as of `rigid`; InputError where it has another shape, is not
    finite or not symmetric, or G has a negative direction.
    """
    J = np.asarray(inertia, dtype=float)
    if not np.isfinite(J).all():
        raise InputError(say(f"{where}.inertia", "finite numbers", inertia))
    if dim == 2:
        if J.shape != () or not J > 0:
            raise InputError(
                say(f"{where}.inertia", "one positive number in the plane [kg m2]", inertia)
            )
        return 0.5 * float(J) * np.eye(2), np.eye(2)
    J = np.diag(J) if J.shape == (3,) else J
    if J.shape != (3, 3) or np.abs(J - J.T).max() > 1e-12 * np.abs(J).max():
        raise InputError(
            say(
                f"{where}.inertia",
                "3 principal moments or a symmetric 3 x 3 tensor [kg m2]",
                inertia,
            )
        )
    G = 0.5 * np.trace(J) * np.eye(3) - 0.5 * (J + J.T)
    values, vectors = np.linalg.eigh(G)
    if not values[-1] > 0 or values[0] < -1e-9 * values[-1]:
        principal = np.round(np.linalg.eigvalsh(J), 12).tolist()
        remedy = "each principal moment is at most the sum of the others"
        raise InputError(
            say(f"{where}.inertia", "moments of a body", f"principal moments {principal}", remedy)
        )
    slanted = np.abs(G - np.diag(np.diag(G))).max() > LIGHT * values[-1]
    if slanted and values[0] <= LIGHT * values[-1]:
        return np.diag(
            np.where(values <= LIGHT * values[-1], 0.0, values)
        ), vectors * np.linalg.det(vectors)
    values[values < 1e-14 * values[-1]] = 0.0
    return np.asarray((vectors * values) @ vectors.T), np.eye(3)


def orthonormal(where: str, rotation: np.ndarray, dim: int) -> np.ndarray:
    """A rotation matrix (c, c); InputError where it is not orthonormal or mirrors."""
    good = rotation.shape == (dim, dim) and bool(np.isfinite(rotation).all())
    if (
        not good
        or np.abs(rotation.T @ rotation - np.eye(dim)).max() > 1e-9
        or np.linalg.det(rotation) < 0
    ):
        raise InputError(
            say(f"{where}.rotation", f"a {dim} x {dim} rotation matrix", rotation.tolist())
        )
    return rotation


def point(where: str, values: Sequence[float] | np.ndarray, dim: int) -> np.ndarray:
    """A point (c,) [m], c = `dim`; InputError, after `where`, for another number of coordinates, or
    ones that are not finite.
    """
    array = np.asarray(values, dtype=float)
    if array.shape != (dim,) or not np.isfinite(array).all():
        raise InputError(say(where, f"points with {dim} finite coordinates", values))
    return array
