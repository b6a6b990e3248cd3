r"""How far stresses of plates and shells are off, by those that are recovered from patches of
cells.

    s* = sum_v N_v p_v,    p_v = argmin sum_x w_x |p(x) - s(x)|^2 over the patch of vertex v,    e = |s* - s| / max |s*|

s are the stresses on both faces, tensors in space, at the points of a picture; p_v are polynomials
of a degree above that of s in a cell, on the cells that meet at v (and their neighbours, where
these are few or one side is free), N_v bilinear. Where s jumps from cell to cell or bends there, s*
is nearer to the exact stress. O. C. Zienkiewicz and J. Z. Zhu, A simple error estimator and
adaptive procedure for practical engineering analysis, Int. J. Numer. Meth. Engng. 24 (1987)
337-357, doi:10.1002/nme.1620240206. Axes: e cell, p point of it, x = e p, v vertex, m monomial.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy.sparse import csr_array

from ..bodies.laws import Law
from ..bodies.solids import solid_law
from ..bodies.stress_recovery import recover
from ..core.storage.records import dataclass
from ..dynamics.outputs import skins
from ..dynamics.trajectory import Trajectory
from ..systems.system import Output, Skin, System, in_scene
from . import solid_fields
from .frames import Array, Indices
from .surfaces import places

FEW = 3  #: cells at a vertex up to which its patch has their neighbours too
REACH = 2.0  #: sizes of a cell around a place within which cells are looked at
LARGE = 0.05  #: error over the stress from which a warning is shown: beyond it stresses at a point say little
LITTLE = 1e-2  #: of the largest stress of a body, with which that of a place counts at least
AT_ONCE = 500  #: patches that are fitted together


@dataclass(frozen=True, eq=False)
class Recovered:
    """Stresses of a surface at an instant."""

    raw: Array  #: (x, k) on the faces -t/2 and t/2, tensors in space [Pa]
    smooth: Array  #: (x, k) recovered [Pa]
    weights: Array  #: (x,) parts of the area
    place: Indices  #: (x,) coinciding points have the same number
    points: int  #: of a cell
    largest: float  #: max |s| of the surface [Pa]

    @property
    def errors(self) -> Array:
        """Errors of the stresses (x,) [Pa].

            |s* - s|

        of the recovered stresses s*, the larger one of both faces.
        """
        return _size(self.smooth - self.raw)

    @property
    def mean(self) -> float:
        """Mean error of the stresses of a surface.

            sqrt(mean |s* - s|^2) / largest stress

        over the surface; 0 without a stress.
        """
        square = float(np.average(self.errors**2, weights=self.weights))
        return float(np.sqrt(square)) / self.largest if self.largest > 0.0 else 0.0

    def at(self, point: Array, reference: Array) -> float:
        """The largest error at a point (3,) of the surface with the reference (x, 3), of all cells
        there, as a part of the stress there.
        """
        nearest = int(np.linalg.norm(reference - point, axis=1).argmin())
        there = self.place == self.place[nearest]
        return part_of(self.errors[there].max(), _size(self.smooth[there]).max(), self.largest)

    @property
    def von_mises(self) -> Array:
        """Of the recovered stresses (x,), the larger one of both faces [Pa]."""
        s = self.smooth.reshape(-1, 2, 3, 3)
        return np.asarray(
            np.sqrt(1.5 * np.sum(s**2, axis=(2, 3)) - 0.5 * np.trace(s, axis1=2, axis2=3) ** 2).max(
                axis=1
            )
        )


def part_of(error: float, stress: float, largest: float) -> float:
    """An error as a part of a stress, which counts with LITTLE of the `largest` of its body at least;
    0 of none.
    """
    size = max(float(stress), LITTLE * largest)
    return float(error) / size if size > 0.0 else 0.0


def _size(tensors: Array) -> Array:
    """Norms (x,) of tensors (x, 2 6) on two faces, the larger one."""
    return np.asarray(np.linalg.norm(tensors.reshape(len(tensors), 2, -1), axis=2).max(axis=1))


def of_outputs(trajectory: Trajectory, values: Mapping[str, Array]) -> dict[str, float]:
    """Errors of the stresses, strains and forces that outputs of plates and shells read, by name,
    at the instant of the largest.

    They are parts of the stress there then; `values` (s,) are those of all columns.
    """
    system = trajectory.system
    found = dict[str, float]()
    for name in recovered_at(system):
        output = system.outputs[name]
        size = np.linalg.norm([values[column] for column in output.columns[:3]], axis=0)
        if np.isfinite(size).all() and size.max() > 0.0:
            if output.law is not None:
                found[name] = of_solid(trajectory, int(size.argmax()), output)
                continue
            # from which it counts, as coordinates do
            place = np.asarray(output.place) + system.origin
            surface, reference = of_body(
                trajectory, int(size.argmax()), output.body, place.tolist()
            )
            found[name] = surface.at(np.pad(place, (0, 3 - len(place))), reference)
    return found


def of_solid(trajectory: Trajectory, row: int, output: Output) -> float:
    """Error of the largest von Mises stress that an output reads of a solid at an instant, as a part
    of the stress there.
    """
    from scipy.spatial import cKDTree

    skin, now, start = at_instant(trajectory, row, output.body)
    found, stress = solid_fields.errors(skin, now, start[0])
    wanted = np.reshape(output.place, (-1, 3)) + trajectory.system.origin
    nodes = cKDTree(start[0]).query(wanted)[1]
    worst = nodes[np.argmax(solid_law.von_mises(stress[:, nodes]))]
    sizes = solid_fields.tensor_size(stress)
    return part_of(found[worst], sizes[worst], sizes.max())


def recovered_at(system: System) -> list[str]:
    """Outputs of stresses, strains and forces at places of plates and shells, of which the states
    are read when all are known.
    """
    surfaces = {skin.name for skin in system.skins}
    return [
        name for name, output in system.outputs.items() if output.place and output.body in surfaces
    ]


def summarise(errors: Mapping[str, float], system: System) -> Iterator[str]:
    """A warning of outputs of a system with large errors."""
    if large := [name for name, part in errors.items() if part > LARGE]:
        listed = ", ".join(f"{name} ({100.0 * errors[name]:.0f} %)" for name in large)
        text = f"stresses of cells around differ at the place of {listed}, as a part of the stress there: take a finer mesh there"
        plates = any(system.outputs[name].law is None for name in large)
        yield (
            f"{text}, cells nearer to parallelograms, or another interpolation" if plates else text
        )


def of_body(
    trajectory: Trajectory, row: int, body: str, near: Sequence[float] = ()
) -> tuple[Recovered, Array]:
    """Stresses of a plate or shell at an instant, near a place (c,) of the reference or everywhere,
    and the reference (x, 3).
    """
    return recover_stresses(*at_instant(trajectory, row, body), near)


def at_instant(trajectory: Trajectory, row: int, body: str) -> tuple[Skin, Array, Array]:
    """The samples of a body, and its gradients (1 + k, x, c) at an instant and in the reference."""
    system = trajectory.system
    (skin,) = (one for one in system.skins if one.name == body)
    q = in_scene(system, np.asarray(system.lift.matrix @ trajectory.x[row]) + system.lift.offset)
    now, start = (skins(system, one)[body] for one in (q, in_scene(system, system.lift(system.x0))))
    return skin, now, start


def of_picture(trajectory: Trajectory, row: int = -1) -> float:
    """Largest mean error of the stresses of all plates and shells at an instant, as a part of the
    largest stress of the body.
    """
    found = [0.0]
    for skin in trajectory.system.skins:
        if solid_law.is_solid(skin.law):
            _, now, start = at_instant(trajectory, row, skin.name)
            errors, stress = solid_fields.errors(skin, now, start[0])
            mean = float(np.sqrt(np.mean(errors**2)))
            found.append(part_of(mean, solid_fields.tensor_size(stress).max(), 0.0))
        else:
            found.append(of_body(trajectory, row, skin.name)[0].mean)
    return max(found)


def recover_stresses(
    skin: Skin, gradients: Array, reference: Array, near: Sequence[float] = ()
) -> tuple[Recovered, Array]:
    """Stresses of a surface from its gradients (1 + k, x, c) now and in the reference, and the
    recovered ones; positions (x, 3).

    With a place `near` (c,) these are of cells around it only.
    """
    u = gradients[1:].transpose(0, 2, 1).reshape(-1, gradients.shape[1])
    levels = recover(skin.law, u, skin.section[:, 0], skin.thickness).stress[[0, 2]]
    position, one, two = (np.pad(part, [(0, 0), (0, 3 - part.shape[1])]) for part in reference[:3])
    frames = [np.einsum("xi,xj->xij", *pair) for pair in ((one, one), (two, two), (one, two))]
    basis = np.stack([frames[0], frames[1], frames[2] + frames[2].swapaxes(1, 2)]).reshape(3, -1, 9)
    raw = np.einsum("lkx,kxj->xlj", levels, basis).reshape(-1, 18)
    points = len(skin.thickness) // _cells(skin)
    some = _around(position, points, np.asarray(near)) if len(near) else slice(None)
    smooth, weights, place = _smooth(
        raw[some], position[some], np.stack([one, two], axis=1)[some], points, _degree(skin)
    )
    return Recovered(raw[some], smooth, weights, place, points, float(_size(raw).max())), position[
        some
    ]


def _around(position: Array, points: int, place: Array) -> Indices:
    """Points (x,) of the cells within REACH sizes of a cell from the one at a place (c,)."""
    cells = position.reshape(-1, points, 3)
    away = np.linalg.norm(cells - np.pad(place, (0, 3 - len(place))), axis=2).min(axis=1)
    size = np.linalg.norm(
        np.ptp(cells[away <= away.min() + 1e-9 * np.ptp(position)], axis=1), axis=1
    ).max()
    return (np.flatnonzero(away <= REACH * size)[:, None] * points + np.arange(points)).ravel()


def _cells(skin: Skin) -> int:
    """Number of cells, each with facets in rows and columns of its own."""
    side = int(skin.cells[0, 1])  # points of a row: the first facet has the points 0, n, n + 1, 1
    return len(skin.thickness) // side**2


def _degree(skin: Skin) -> int:
    """Degree of the polynomials: about that of the derivatives in the energy, plus one; from the
    number of functions in a cell.
    """
    rows = csr_array(skin.samples)
    functions = float(np.median(np.diff(rows.indptr)[-len(skin.thickness) :]))
    return int(np.sqrt(functions) - 1.4) + (skin.law is Law.MEMBRANE)


def _smooth(
    raw: Array, x: Array, axes: Array, points: int, degree: int
) -> tuple[Array, Array, Indices]:
    """Recovered stresses, parts of the area and places of cells with `points` points (x, 3) each,
    and tangents (x, 2, 3) there.
    """
    cells = len(x) // points
    side = int(np.sqrt(points))
    place = places(x)
    corners = np.array([0, (side - 1) * side, side - 1, points - 1])
    _, vertex = np.unique(place.reshape(cells, points)[:, corners], return_inverse=True)
    vertex = vertex.reshape(cells, 4)
    count = int(vertex.max()) + 1
    touch = csr_array(
        (np.ones(4 * cells), (vertex.ravel(), np.repeat(np.arange(cells), 4))), shape=(count, cells)
    )
    powers = np.array([(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)])
    first = np.zeros(count, np.int64)
    first[vertex.ravel()] = (np.arange(cells)[:, None] * points + corners).ravel()
    size = np.sqrt(np.abs(_area(x.reshape(cells, side, side, 3))))
    scale = np.zeros(count)
    np.maximum.at(scale, vertex.ravel(), np.repeat(size.max(axis=(1, 2)) * side, 4))
    weights = np.sqrt(_area_of_points(x.reshape(cells, side, side, 3)).reshape(cells, points))
    fits = np.zeros((count, len(powers), raw.shape[1]))
    near = _patches(touch)
    for number in np.unique(np.diff(near.indptr)):
        chosen = np.flatnonzero(np.diff(near.indptr) == number)
        for some in np.array_split(chosen, max(1, len(chosen) // AT_ONCE)):
            own = near.indices[near.indptr[some][:, None] + np.arange(number)]
            at = (own[:, :, None] * points + np.arange(points)).reshape(len(some), -1)
            A = _monomials(x[at], x[first[some]], axes[first[some]], scale[some], powers)
            w = weights.ravel()[at]
            fits[some] = np.linalg.pinv(A * w[..., None], rcond=1e-8) @ (raw[at] * w[..., None])
    s = np.linspace(0.0, 1.0, side)
    a, b = (one.ravel() for one in np.meshgrid(s, s, indexing="ij"))
    shares = np.stack([(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b])
    smooth = np.zeros((cells, points, raw.shape[1]))
    for k in range(4):
        v = vertex[:, k]
        A = _monomials(x.reshape(cells, points, 3), x[first[v]], axes[first[v]], scale[v], powers)
        smooth += shares[k][None, :, None] * (A @ fits[v])
    return smooth.reshape(raw.shape), weights.ravel() ** 2, place


def _monomials(x: Array, origin: Array, axes: Array, scale: Array, powers: Indices) -> Array:
    """Monomials (v, x, m) of points (v, x, 3) in the plane of the axes (v, 2, 3) at the origins (v,
    3).
    """
    y = np.einsum("vxc,vac->vxa", x - origin[:, None], axes) / scale[:, None, None]
    return np.asarray((y[:, :, None, :] ** powers).prod(axis=3))


def _patches(touch: csr_array) -> csr_array:
    """Cells of the patch of every vertex (v, e): those at it, and those that touch them where these
    are few.
    """
    around = csr_array(touch @ (touch.T @ touch))
    few = np.diff(touch.indptr) <= FEW
    found = (
        csr_array(np.where(few, 1.0, 0.0)[:, None] * around)
        if few.any()
        else csr_array(touch.shape)
    )
    found = csr_array(found + touch)
    found.eliminate_zeros()
    found.sort_indices()
    return found


def _area(x: Array) -> Array:
    """Areas (e, i, j) of the facets of cells with points (e, i, j, 3)."""
    return 0.5 * np.linalg.norm(
        np.cross(x[:, 1:, 1:] - x[:, :-1, :-1], x[:, 1:, :-1] - x[:, :-1, 1:]), axis=3
    )


def _area_of_points(x: Array) -> Array:
    """Parts (e, i, j) of the area of cells at their points (e, i, j, 3): a quarter of every facet
    around, in Simpson's shares.
    """
    area = 0.25 * _area(x)
    found = np.zeros(x.shape[:3])
    for i in (0, 1):
        for j in (0, 1):
            found[:, i : i + area.shape[1], j : j + area.shape[2]] += area
    if x.shape[1] == 3:  # Simpson's rule for that of trapezia
        found *= np.outer([2.0, 4.0, 2.0], [2.0, 4.0, 2.0]) / 9.0
    return found
