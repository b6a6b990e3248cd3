r"""Beams with torsion and shear: a centre line r(S) and three directors d_i(S) as splines, see
`strain_law`.

    r = sum_b N_b r_b,   d_i = sum_b N_b d_ib,   i = 1 (along the line), 2, 3 (in the section)

    T = 1/2 int (v, w_2, w_3) m (v, w_2, w_3)^T dS,     m = int rho (1, y, z)^T (1, y, z) dA

with v and w_i the rates of r and d_i: the mass is constant, and d_1 has none unless m is given so.
In the plane a beam has r and d_1 alone, see `planar`. Splines are quartics that are as smooth as they
can be; a cell has three Gauss points, and stretch, shear and section those that do not lock
(`shapes.locking`). Functions of a body are r, d_1, d_2, d_3 (in the plane r, d_1) of the first
spline, then those of the next.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag
from scipy.sparse import csr_array, eye_array, kron, vstack

from ...core.algebra.linalg import as_csr
from ...core.errors import InputError, say
from ...core.notices import notify
from ...shapes import curves, line, locking, meshes
from ...shapes.table import Curve
from .. import stations
from ..body import Body, Cells, along_curve, arc_length_table, mass_matrix, placed_line, unit_field
from ..laws import Law
from ..sections import BeamSection, Material, Offset, Section
from ..strain_law import strains
from . import planar, section_shapes
from .orientation import Everywhere, Orientation
from .profiles import Profile, profile

DEGREE = 4
FIELDS = {2: planar.FIELDS, 3: 4}  #: r, d_1, d_2, d_3, in the plane r and d_1
LAWS = {2: Law.PLANAR_BEAM, 3: Law.BEAM}
#: compliance of directors to Gamma, over that of their stiffness
YIELD = {2: (1.0, 0.0), 3: (1.0, 0.5, 0.5)}
FEWEST = 3  #: cells: fewer leave motions without energy
# tip of a 45 degree bend 53.4858 with 1, 53.4771 with 10, 53.4762 with 100 and 10 000; the third
# frequency of a free shaft with L/d = 10 is 1.3e-4 too low with 100, 1e-5 with 1000; Newton's
# iteration of equilibria takes half as many corrections more
RIGID = 1000.0  #: stiffness R that holds the section, over the largest of EA and GA
SQUARE = 1e-3  #: error of d_i . d_j: 55 degrees a cell have it, 90 degrees 1.8e-2, 120 degrees 0.12
TWISTED = 0.1  #: error of d_i . d_j that is refused
FAR = np.radians(55.0)  #: turn in a cell that has an error of SQUARE [rad]
# a slender helical spring is 1.7 % too stiff where axes are off by 0.13 % (60 degrees a cell), 7.8
# % by 0.4 %, 32 % by 1.6 % (90 degrees); 0.2 % at 45 degrees
STIFFER = 20.0  #: error of stiffnesses of what is curved, over that of d_i . d_j, at most

#: length of a cell over that in which warping dies away: with 0.6 T beside a held end is 3 % off, with
#: 1.2 it is 12 % and B 2 %, with 2.5 40 % and 11 %
WITHIN = 0.75

#: origin (3,) [m] and rotation (3, 3) of a mesh
Place: TypeAlias = tuple[np.ndarray | None, np.ndarray]


def beam(
    name: str,
    mesh: meshes.LineMesh | curves.Line | str | Path,
    section: BeamSection | Section,
    material: Material | None = None,
    *,
    offset: Offset = None,
    group: str | None = None,
    direction: ArrayLike | Everywhere | None = None,
    towards: ArrayLike | None = None,
    twist: float | Mapping[float, float] = 0.0,
    origin: np.ndarray | None = None,
    rotation: np.ndarray | None = None,
    dim: int = 3,
    warping: bool = False,
) -> Body:
    """Beam along the polyline of a mesh file, one cell a mesh cell, or along a line, free of stress
    in the reference.

    `offset` says where the line passes through a section that has a material, see
    `Section.of_beam`. d_2 is the part of `direction` (3,) across the line, or points `towards` a
    point (3,) [m]; `twist` [rad] turns it about the line, see `orientation`. `group` picks a named
    group of lines. `origin` (3,) [m] and `rotation` (3, 3) place the mesh with all that is given in
    it:

        x <- origin + rotation x

    With `warping` the section warps with the torsion, which ends may hold, and tension stiffens that;
    its fibres know it, see `section_constants`. In the plane (`dim` 2) z of the section lies in it, to
    the left of the line, which passes through the centres of mass. The section turns with its line,
    and so do `direction` and the point `towards`. Where the axes turn by more in a cell than splines
    follow, a notice says how many cells do.
    """
    curve, breaks, places, arcs = placed_line(name, mesh, group, dim, origin, rotation)
    if len(breaks) <= FEWEST:
        raise InputError(
            say(
                f"body '{name}'",
                f"at least {FEWEST} cells",
                len(breaks) - 1,
                "give it more `cells`",
            )
        )
    space = line.uniform(breaks, DEGREE, DEGREE - 1)
    centre = line.fit(space, curve)
    lengths = along_curve(curve, breaks)
    orientation = Orientation(direction, towards, twist)
    turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=float)
    axes = line.fit(
        space,
        partial(tangents, curve)
        if dim == 2
        else partial(directors, name, curve, orientation, lengths, (origin, turn)),
    ).reshape(len(centre), -1, dim)
    check_axes(name, space, axes, orientation.turns)
    reference = np.concatenate([centre[:, None], axes], axis=1).reshape(-1, dim)
    fractions, sections, degree = along(section, material, offset, warping)
    masses = [one.mass for one in sections]
    if dim == 2:
        masses = planar.masses(name, masses)
        planar.tell_skew(name, [one.stiffness for one in sections])
    elif warping:
        sizes = np.linalg.norm(np.diff(curve(breaks, 0), axis=0), axis=1)
        reach = min(one.reach for one in sections)
        tell_decay(name, reach, float(sizes.max()), float(sizes.sum()))
    fields = FIELDS[dim]
    own = profile(name, np.interp(fractions, lengths[1], lengths[0]), sections, degree)
    made = partial(beam_numbers, space, reference, own)
    nodes = np.ascontiguousarray(line.functions(space).T * dim * fields)
    r, *d = (kron(eye_array(space.count), np.eye(fields)[[k]]) for k in range(fields))
    return Body(
        name=name,
        reference=reference,
        mass=beam_mass(space, centre, own, masses),
        constant=np.kron(line.fit(space, unit_field)[:, 0], np.eye(fields)[0]),
        places=places,
        arcs=arcs,
        space=space,
        cells=Cells.later(
            Law.WARPED_BEAM if warping else LAWS[dim], nodes, dim * fields, locking.POINTS, made
        ),
        radius=max(one.radius for one in sections),
        spread=as_csr(r),
        directors=as_csr(vstack(d)),
        profile=own,
        yield_strength=0.0 if material is None else material.yield_strength or 0.0,
    )


def along(
    section: BeamSection | Section, material: Material | None, offset: Offset, warping: bool
) -> tuple[np.ndarray, Sequence[BeamSection], int]:
    """Fractions (k,) of the length, what the beam has there, and the degree in between, see
    `stations`.
    """
    if isinstance(section, BeamSection):
        return np.zeros(1), [section], 0

    pieces = section_shapes.alike([section.at(x).outline() for x in section.stations])

    def numbers(one: Section) -> np.ndarray:
        made = one.of_beam(material, offset, pieces, warping)
        return np.asarray(block_diag(made.stiffness, made.mass))

    fractions, sections, degree = stations.choose(section, numbers)
    return fractions, [one.of_beam(material, offset, pieces, warping) for one in sections], degree


def tangents(curve: Curve, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
    """d_1 of the reference at parameters xi (x,), unit tangents (x, c)."""
    slope = curve(xi, 1)
    return np.asarray(slope / np.linalg.norm(slope, axis=1, keepdims=True))


def directors(
    name: str,
    curve: Curve,
    orientation: Orientation,
    lengths: np.ndarray,
    place: Place,
    xi: np.ndarray,
    derivative: int = 0,
) -> np.ndarray:
    """d_1, d_2, d_3 of the reference at parameters xi (x,), in one row (x, 9); `lengths` as of
    `along_curve`.

    The orientation is given where the mesh is: its axes are turned with the mesh to the `place` of
    the curve.
    """
    origin, turn = place
    tangent = tangents(curve, xi)
    points = curve(xi, 0) if origin is None else curve(xi, 0) - origin
    axes = orientation.axes(name, points @ turn, tangent @ turn, np.interp(xi, *lengths))
    return np.asarray(axes.reshape(-1, 3, 3) @ turn.T).reshape(-1, 9)


def check_axes(name: str, space: line.BSpline, axes: np.ndarray, turns: float) -> None:
    """A notice where the axes (n, k, c) over the functions of a beam are not orthonormal in its
    cells, and InputError where by far.

    Their error falls with the fifth power of the cells, unless cells are so long that a pre-twist
    of `turns` [rad] is not seen.
    """
    d = np.asarray(
        line.sample(space, line.gauss_table(space, locking.POINTS, 0).points.ravel())
        @ axes.reshape(len(axes), -1)
    )
    d = d.reshape(-1, *axes.shape[1:])
    error = float(np.abs(np.einsum("xic,xjc->xij", d, d) - np.eye(axes.shape[1])).max())
    cells = len(line.breaks(space)) - 1
    # whole turns between points where axes are taken would be none
    unseen = turns > 2.0 * FAR * cells
    if error > SQUARE or unseen:
        wanted = max(int(np.ceil(cells * (error / SQUARE) ** 0.2)), int(np.ceil(turns / FAR)))
        text = f"its axes turn so far in a cell that they are off by {100.0 * error:.2g} %"
        if error > TWISTED or unseen:
            raise InputError(say(f"body '{name}'", f"{wanted} cells or more", cells, text))
        notify(
            f"body '{name}': {text}, and its stiffnesses by up to {STIFFER:.0f} times as much; take {wanted} cells"
        )


def tell_decay(name: str, reach: float, cell: float, length: float) -> None:
    """A notice where the warping of a section dies away within a cell [m] of a beam."""
    if cell > WITHIN * reach:
        cells = int(np.ceil(length / (WITHIN * reach)))
        far = (
            f"the warping of its section dies away within {1e3 * reach:.3g} mm of where it is held"
        )
        notify(
            f"body '{name}': {far}, in cells of {1e3 * cell:.3g} mm: T, B and stresses there are wrong; "
            f"take {cells} cells, or delete `warping` where a section is closed, and hardly warps"
        )


def beam_mass(
    space: line.BSpline, centre: np.ndarray, section: Profile, masses: Sequence[np.ndarray]
) -> csr_array:
    """M (b, b) of all functions, of masses m, (3, 3) or (4, 4), in the plane (2, 2), at the
    stations; `centre` (n, c) are the line [m].
    """
    found = []
    count = FIELDS[centre.shape[1]]
    for k, mass in enumerate(masses):
        wide = np.zeros((count, count))
        fields = [k for k in range(count) if k != 1 or len(mass) == count]
        wide[np.ix_(fields, fields)] = mass
        share = lambda xi, k=k: section.shares(xi)[..., k]  # noqa: E731
        found.append(
            kron(mass_matrix(space, centre, share if section.degree else 1.0), csr_array(wide))
        )
    return csr_array(sum(found[1:], found[0]))


def beam_numbers(
    space: line.BSpline, reference: np.ndarray, section: Profile
) -> tuple[np.ndarray, np.ndarray]:
    """Table (k, p, b, e) and section (i, p, e) of the cells of a beam, in space or in the plane.

    Directors yield by 1/R to an axial force and in space by 1/(2 R) to a shear force, in series with
    the section: its compliance is less by that, so that both together have the given one. The shares
    of points that do not lock act on Gamma and E; where Gamma and kappa are coupled, on all of C but
    the latter of

        C = (A, B; B^T, D),    D - B^T A^-1 B

    of kappa: what both leave has no negative directions.
    """
    dim = reference.shape[1]
    count = FIELDS[dim]
    fields = reference.reshape(-1, count, dim)
    table, values, weights = arc_length_table(space, fields[:, 0], locking.POINTS)
    C = np.tensordot(section.shares(table.points), section.stiffness, 1)
    rigid = RIGID * np.linalg.eigvalsh(C[..., :3, :3])[..., -1]
    if dim == 2:
        C = planar.TAKEN.T @ C @ planar.TAKEN
    orders = 3 if C.shape[-1] > 6 else 2  # a beam that warps reads second derivatives
    yields = np.zeros(C.shape[-1])
    yields[:dim] = YIELD[dim]
    C = np.linalg.inv(np.linalg.inv(C) - np.diag(yields) / rigid[..., None, None])
    alone = np.zeros_like(C)
    A, B, D = C[..., :dim, :dim], C[..., :dim, dim:], C[..., dim:, dim:]
    alone[..., dim:, dim:] = D - np.swapaxes(B, 2, 3) @ np.linalg.solve(A, B)
    softest = np.linalg.eigvalsh(alone[..., dim : 2 * dim, dim : 2 * dim])[..., 0]
    shares = locking.shares(
        space, table, float((C[..., 0, 0] * weights.sum(axis=1).max() ** 2 / softest).max())
    )
    u = np.einsum("epkb,ebfc->kfcep", values[:, :, :orders], fields[table.nodes]).reshape(
        orders * count, dim, *weights.shape
    )
    measured = (planar.strains if dim == 2 else strains)(u)
    numbers = np.moveaxis((C - alone) * shares[..., None, None] + alone, (0, 1), (-2, -1))
    upper = np.triu_indices(len(numbers))
    rows = np.concatenate([numbers[upper], (rigid * shares)[None], measured, weights[None]])
    return np.ascontiguousarray(values[:, :, :orders].transpose(2, 1, 3, 0)), np.ascontiguousarray(
        rows.transpose(0, 2, 1)
    )
