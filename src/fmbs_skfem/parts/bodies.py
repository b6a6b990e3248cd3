r"""Reduced parts: a body with few shape functions, which is a body again.

    r(s) = sum_b N_b(s) c_b,   Y = [x, y, z rows of all c (n, d s)]:    S = [1, c0, left singular vectors of the rest of Y]     (1)
    c = (S (x) I_d) z,    r(s) = sum_a Nbar_a(s) z_a,    Nbar = S^T N,    mass S^T M S

The basis acts on every component alike: it holds all translations, and with a state every rotation
of it, so that a part does not know in which direction it was trained. Joints are kept out of it: a
part that was trained with one end pinned can be pinned at the other. Law, section and places are
those of the full body, so that `systems.assemble` takes both alike.

Positions at the places of a part are coordinates of their own, as far as they are independent (S ->
[S B^+, S null(B)] with the rows B of the places): joints there leave out or share unknowns, and
link no others.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh, qr
from scipy.sparse import csr_array, eye_array, kron, vstack

from ..bodies import stress_recovery as fields
from ..bodies.body import (
    Body,
    Cells,
    LinearElasticity,
    ShapePoints,
    directors,
    extent,
    locate,
    own,
    positions,
    probe,
    read_by_cells,
)
from ..core.algebra import ranks
from ..core.algebra.linalg import Array, alike, as_dense, squares
from ..core.errors import InputError, say
from ..dynamics.near_state.linear import linearise
from ..dynamics.near_state.modes import real_modes
from ..reduction.hyper import sampling
from ..reduction.hyper.ecsw import Level
from ..reduction.hyper.hyper_reduction import USUAL
from ..reduction.hyper.sampling import Measure
from ..reduction.spaces import invariant, pod
from ..shapes import line, surface
from ..shapes.solids import solid
from ..shapes.solids.solid import Solid
from ..shapes.surface import Parent, Surface
from ..systems import assemble, lengths
from ..systems.compiled import Compiled, compile_system, elastic_tangent
from ..systems.system import Elastic
from ..systems.terms import elastic as terms
from ..systems.terms import shape_points
from ..systems.terms.cells import gradient_rows
from ..systems.terms.points import dense_rows
from . import departures

# stretching of second order is 1e-13 there, bending of a bar of 1:1000 1e-9 of its energy
SMALL = 1e-6  #: displacements, over the size of a body, that are linear
STATES = 20  #: states whose strains are found at a time
SAME = 1e-6  #: part of shapes in a direction, over the largest, that is round-off
MISSES = 1e-9  #: distance of the reference from the shape functions, over the size of the body, from which it is refused


def metric(part: Body) -> csr_array:
    """W (b, b) over the mass of the body, alike for every component: coordinates of massless axes
    count by the body's size.

        u^T W u    is a mean square displacement of one component [m2]

    Directors of a beam hold its section and its shear, however thin it is, so that their small mass
    says nothing of them: the n coefficients of each count together as a displacement by that size.
    """
    if part.directors is not None:
        d = part.directors
        size = lengths.spread(positions(part))
        return csr_array(
            part.mass / part.total_mass + size**2 * directors(part) / d.shape[0] * (d.T @ d)
        )
    W = lengths.metric([part], alike(part.mass, part.dim)) / lengths.weight([part])
    return csr_array(W[:: part.dim, :: part.dim])


def shape_functions(
    part: Body,
    states: np.ndarray,
    tolerance: float | None = 1e-12,
    modes: int | None = None,
    earlier: np.ndarray | None = None,
    shapes: np.ndarray | None = None,
) -> np.ndarray:
    """S (b, m) of (1) from states (s, b, c) of a full body; eps = `tolerance` refers to the
    deviations from the field 1, or m.

    Coordinates at the places of the body come first, the others are orthonormal in the mass over
    that of the body. Factors U_1 S_1 (b, k) of `earlier` states stand for them, by the left
    singular vectors of [U_1 S_1, Y]. Displacements `shapes` (j, b, c) are among the functions, as
    far as m allows: see `interface_shapes`.
    """
    columns = as_columns(states) if earlier is None else np.hstack([earlier, as_columns(states)])
    return with_places(
        part, leading(part, columns, shapes, None if modes else tolerance, modes).modes
    )


def leading(
    part: Body,
    columns: np.ndarray,
    shapes: np.ndarray | None,
    tolerance: float | None,
    modes: int | None,
) -> pod.Basis:
    """Functions (b, m) of columns (b, k), one a component: the field 1, the reference, those of
    `shapes` (j, b, c), and the leading ones of the rest.

    A number of `modes` that is too small for all shapes is that of leading functions alone: they
    serve the motions of the training better.
    """
    W = metric(part)
    affine = np.column_stack([part.constant, part.reference])
    kept = affine if shapes is None else np.hstack([affine, functions_of(part, W, affine, shapes)])
    if modes is not None and modes < kept.shape[1] - affine.shape[1] + np.linalg.matrix_rank(
        affine
    ):
        kept = affine
    return pod.of_vectors(columns, kept, tolerance, modes, W)


def functions_of(part: Body, W: csr_array, affine: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Functions (b, k) of the components of displacements (j, b, c) outside of affine motions (b,
    i), orthonormal in W (b, b), those that most of them have first.
    """
    if not len(shapes):
        return affine[:, :0]
    columns = as_columns(shapes)
    sizes = squares(columns, W).reshape(len(shapes), -1).sum(axis=1)
    columns = columns / np.repeat(np.sqrt(sizes), shapes.shape[2])
    found, s = pod.left_singular(W, pod.outside(W, columns, orthonormal(W, affine)))
    return np.asarray(found[:, s > SAME * s[0]])


def orthonormal(W: csr_array, columns: np.ndarray) -> np.ndarray:
    """Columns (b, i), orthonormal in W (b, b), that span the same space as others (b, k)."""
    U, s = pod.left_singular(W, columns)
    return np.asarray(U[:, s > MISSES * s[0]])


def as_columns(states: np.ndarray) -> np.ndarray:
    """States (s, b, c) as columns (b, s c), one a component.

    From column to column the components change first.
    """
    return np.moveaxis(states, 0, 1).reshape(states.shape[1], -1)


def with_places(part: Body, S: np.ndarray) -> np.ndarray:
    """The space of S (b, m), its first coordinates positions, directors of beams and axes of bodies
    of matrices, at places, where the others vanish: (b, m).

    What has no mass, as the third axes of rims of a flat plate have none, is a coordinate of its
    own, the last ones.
    """
    read = [
        (name, k)
        for name in [*part.places, *part.frames]
        for k in range(1 + vectors_kept(part, name))
    ]
    if read:
        rows = vstack([probe(part, locate(part, name), k) for name, k in read])
        sizes = np.array([extent(part) if k else 1.0 for _, k in read])
        S = invariant.with_rows(S, csr_array(rows).toarray(), sizes)
    inertia, V = eigh(S.T @ (part.mass @ S), S.T @ (metric(part) @ S))
    empty = V[:, inertia <= lengths.LIGHT * inertia[-1]]
    if not empty.shape[1]:
        return S
    mixed = np.abs(empty).max(axis=1) > MISSES * np.abs(empty).max()
    others = qr(empty[mixed])[0][:, empty.shape[1] :]
    return np.hstack([S[:, ~mixed], S[:, mixed] @ others, S @ empty])


def vectors_kept(part: Body, name: str) -> int:
    """How many vectors at a place are coordinates: directors of beams, axes of bodies of matrices,
    by which joints there leave out unknowns.
    """
    framed = part.linear is not None and name in part.frames
    return part.dim if framed else directors(part)


def coordinates(part: Body, S: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Coordinates z (s, m, c) of the states (s, b, c) of a full body, nearest in the mass.

        z = (S^T W S)^-1 S^T W q

    as of `projected`.
    """
    if not len(states):
        return np.zeros((0, S.shape[1], part.dim))
    found = projected(part, S, as_columns(states))
    return found.reshape(S.shape[1], len(states), -1).transpose(1, 0, 2)


def projected(part: Body, S: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Coordinates (m, j) of columns Y (b, j) of a component.

        (S^T W S)^-1 S^T W Y

    The columns nearest in the mass are S times these.
    """
    W = metric(part)
    return np.asarray(np.linalg.solve(S.T @ (W @ S), S.T @ (W @ columns)))


def reduced_body(part: Body, S: np.ndarray) -> Body:
    """The body with the shape functions of S (b, m), its elastic energy at all quadrature points.

        Nbar = S^T N

    Of a body that is reduced already, fewer functions S over its own, its energy at the points that
    it has.
    """
    if part.cells is None:
        raise InputError(say(f"body '{part.name}'", "an elastic body", "one without cells"))
    if len(S) != len(part.reference):
        raise InputError(
            say(
                f"body '{part.name}'",
                f"shape functions over its {len(part.reference)} functions",
                f"over {len(S)}",
            )
        )
    fields = np.column_stack([part.constant, part.reference])
    found = coordinates(part, S, fields[None])[0]
    if np.abs(S @ found - fields).max() > MISSES * np.abs(fields).max():
        raise InputError(
            say(
                f"body '{part.name}'",
                "shape functions that hold the reference and the field 1",
                "others",
            )
        )
    spread = csr_array(S) if part.spread is None else csr_array(part.spread @ S)
    if part.shapes is None:
        points = shape_points.of_cells(part.cells, over_cells(part, S))
        points = replace(points, positions=cell_centres(part)[points.cell])
    else:
        table = np.ascontiguousarray(part.shapes.table @ S)
        columns = slice(0, S.shape[1] * part.dim)
        points = replace(part.shapes, table=table, columns=columns, missing=None)
    first = sorted(part.frames.items(), key=lambda one: one[1])
    axes = frames_of(part, S)
    return replace(
        part,
        reference=np.ascontiguousarray(found[:, 1:]),
        constant=np.ascontiguousarray(found[:, 0]),
        mass=symmetric(part.mass, S),
        stiffness=None if part.stiffness is None else symmetric(part.stiffness, S),
        cells=one_point(part.cells),
        spread=spread,
        directors=None if part.directors is None else csr_array(part.directors @ S),
        frames={name: k * (1 + part.dim) for k, (name, _) in enumerate(first)},
        axes=csr_array(axes) if first else None,
        shapes=points,
        linear=part.linear and transformed(part.linear, alike(csr_array(S), part.dim)),
        spare=None,
    )


def transformed(linear: LinearElasticity, V: csr_array) -> LinearElasticity:
    """Stiffness and damping V^T A V of coordinates z in place of q = V z, V (b c, m c)."""

    def reduced(A: Array) -> np.ndarray:
        found = as_dense(V.T @ (A @ V))
        return 0.5 * (found + found.T)

    return replace(
        linear,
        stiffness=reduced(linear.stiffness),
        damping=None if linear.damping is None else reduced(linear.damping),
        prestress=None if linear.prestress is None else reduced(linear.prestress),
    )


def elasticity(part: Body) -> LinearElasticity:
    """The stiffness of a reduced solid in its reference, and its lowest angular frequency; InputError
    for other bodies.
    """
    if not isinstance(part.space, Solid):
        expected = "a solid, for small strains in a frame that turns"
        raise InputError(say(f"body '{part.name}'", expected, "another body", "leave them out"))
    linear = linearise(assemble([part], pictures=False))
    rigid = part.dim * (part.dim + 1) // 2
    slowest = real_modes(linear, rigid + 1).angular_frequencies[-1]
    return LinearElasticity(as_dense(linear.stiffness), slowest=float(slowest))


def of_small_strains(part: Body, linear: LinearElasticity, more: Body | None) -> Body:
    """A part of a solid with a stiffness that turns with it, held against one of `more` functions."""
    spare = None if more is None else replace(more, linear=elasticity(more), shapes=None)
    return replace(part, linear=linear, spare=spare)


def over_cells(part: Body, S: np.ndarray) -> np.ndarray:
    """Functions S (b, m) of a full body over those that its cells read."""
    read = read_by_cells(part)
    return S if read is None else np.asarray(read @ S)


def frames_of(part: Body, S: np.ndarray) -> np.ndarray:
    """What functions S (b, m) of a full body are at its frames (4 a, m), frame by frame."""
    if part.axes is not None:
        return np.asarray(part.axes @ S)
    rows = [at + k for at in sorted(part.frames.values()) for k in range(1 + part.dim)]
    return np.asarray(S[rows])


def cell_centres(part: Body) -> np.ndarray:
    """Positions of the centres of the cells of a line, surface or solid in the reference (e, c) [m].

    In their order; of triangles the centroids.
    """
    if isinstance(part.space, Solid):
        rows = solid.centres(part.space)
    elif isinstance(part.space, Surface):
        xi = (0.5, 0.5) if part.space.parent is Parent.SQUARE else (1.0 / 3.0, 1.0 / 3.0)
        rows = surface.sample(
            part.space, np.arange(len(part.space.nodes)), np.tile(xi, (len(part.space.nodes), 1))
        )
    else:
        assert part.space is not None
        breaks = line.breaks(part.space)
        rows = line.sample(part.space, 0.5 * (breaks[1:] + breaks[:-1]))
    return np.asarray(own(part, rows) @ part.reference)


def symmetric(A: csr_array, S: np.ndarray) -> csr_array:
    """A matrix of the body in the coordinates of S (b, m).

        S^T A S    (m, m)

    Entries below 1e-15 of the largest are left out.
    """
    product = S.T @ (A @ S)
    product[np.abs(product) <= 1e-15 * np.abs(product).max()] = 0.0
    return csr_array(0.5 * (product + product.T))


def one_point(cells: Cells) -> Cells:
    """One quadrature point of every cell, which says law and section to pictures and outputs.

    A line of one section has its mean EA there: at single points it may have next to none of it,
    see `shapes.locking`.
    """
    table, section = (
        np.ascontiguousarray(cells.table[:, :1]),
        np.ascontiguousarray(cells.section[:, :1]),
    )
    rows = cells.law.section
    if {"EA", "EI"} <= set(rows) and not np.ptp(cells.section[rows.index("EI")]):
        EA = cells.section[rows.index("EA")]
        if np.ptp(EA):
            section[rows.index("EA")] = (EA * cells.section[-1]).sum() / cells.section[-1].sum()
    return Cells(cells.law, table, cells.nodes, cells.dim, section, cells.spread)


def sampled(
    part: Body, states: np.ndarray, tolerance: float = USUAL, shapes: np.ndarray | None = None
) -> Body:
    """A reduced body whose energy is that of few weighted points (ECSW), to the relative tolerance
    eta at its states (s, m, c).

    Forces are measured by the energy of the displacements that they make, see `compliance`.
    Displacements `shapes` (j, m, c) count as much as all states, and each as much as any other.
    """
    if part.shapes is None:
        raise InputError(
            say(
                f"body '{part.name}'",
                "a reduced body",
                "a full one",
                "reduce it first: parts.reduced_body",
            )
        )
    model = compile_system(assemble([part], pictures=False))
    member = Elastic(part.name, 0.0, dense_rows(part.shapes))
    runs = [([member], states.reshape(len(states), -1))]
    if shapes is not None and len(shapes):
        runs.append(([member], model.system.x0 + small(part, model, shapes)))
    sample, _, _ = sampling.solve(runs, 0, tolerance, Level.POINTS, compliance(model))
    return ranged(
        replace(part, shapes=terms.choose_points(part.shapes, sample.indices, sample.weights)),
        states,
    )


def small(part: Body, model: Compiled, shapes: np.ndarray) -> np.ndarray:
    """Displacements (j, n) along shapes (j, m, c) of a reduced body, all of one strain energy, the
    largest `SMALL` of the body; rigid ones are left out.
    """
    u = shapes.reshape(len(shapes), -1)
    W = as_dense(model.system.metric)
    K = as_dense(elastic_tangent(model, model.system.x0, 0.0))
    size = np.einsum("ji,ik,jk->j", u, W, u)
    energy = np.einsum("ji,ik,jk->j", u, K, u)
    held = energy > ranks.EXACT * size * (energy / size).max()
    u = u[held] / np.sqrt(energy[held])[:, None]
    longest = np.sqrt((size[held] / energy[held]).max() / model.system.weight)
    return np.asarray(u * (SMALL * extent(part) / longest))


def compliance(model: Compiled) -> Measure:
    """States (s, n) of a reduced body -> roots of their compliance (s, n, n).

        C^(1/2),    C = sum_i v_i v_i^T / (|l_i| + w^2),    K v_i = l_i W v_i

    K is the elastic tangent in a state, W the mass, w [rad/s] the lowest elastic frequency of the
    free body: what changes slowly moves the body by K^-1 f. A beam that is sampled by its forces
    alone keeps its axial ones, which are large and move it little.
    """
    W = as_dense(model.system.metric)
    rigid = model.system.dim * (model.system.dim + 1) // 2

    def modes(state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found: tuple[np.ndarray, np.ndarray] = eigh(as_dense(elastic_tangent(model, state, 0.0)), W)
        return found

    square = np.sort(np.abs(modes(model.system.x0)[0]))
    least = max(float(square[min(rigid, len(square) - 1)]), ranks.EXACT * float(square[-1]))

    def measure(states: np.ndarray) -> np.ndarray:
        pairs = [modes(state) for state in states]
        return np.stack([sampling.compliance_root(l, V, least) for l, V in pairs])

    return measure


def ranged(part: Body, states: np.ndarray) -> Body:
    """A reduced body that knows the strains of its training, those of the states (s, m, c).

    The body is as before, but for `shapes.trained` (2, j).
    """
    assert part.shapes is not None
    return replace(part, shapes=replace(part.shapes, trained=extremes(part.shapes, states)))


def extremes(points: ShapePoints, states: np.ndarray) -> np.ndarray:
    """Lowest and highest strains (2, j) of states (s, m, c).

    The first row has the lowest ones; j kinds of strains, see `departures`.
    """
    found = departures.strains(points, states)
    return np.stack([found.min(axis=(0, 1)), found.max(axis=(0, 1))])


def largest_strains(part: Body, states: np.ndarray) -> np.ndarray:
    """Largest strain of a fibre (s,) of a full body in states (s, b, c).

    The outer fibres of lines are those of a round bar,

        h = 2 sqrt(EI / EA)

    the half diameter, 1.15 times half the height of a bar.
    """
    assert part.cells is not None
    cells = part.cells
    found = [np.zeros(0)]
    rows = rows_of(part)
    h = 0.5 * np.asarray(part.thickness)
    if not cells.law.tangents:
        EA, EI = (np.sum(row * cells.section[-1]) for row in cells.section[:2])
        h = np.asarray(2.0 * np.sqrt(EI / EA))
        if part.profile is not None:
            breaks = line.breaks(part.space)
            stiffness = part.profile.at(0.5 * (breaks[1:] + breaks[:-1]))[0]
            h = 2.0 * np.sqrt(stiffness[:, [4, 5], [4, 5]].max(axis=1) / stiffness[:, 0, 0])
    shape = (-1, *cells.section.shape[1:])
    start = (rows @ part.reference.ravel()).reshape(*shape, 1)
    for k in range(0, len(states), STATES):
        block = states[k : k + STATES].reshape(-1, part.reference.size).T
        u = np.asarray(rows @ block).reshape(*shape, block.shape[1])
        found.append(fields.fibre_strains(cells.law, u, start, cells.section, h).max(axis=0))
    return np.concatenate(found)


def rows_of(part: Body) -> csr_array:
    """Rows (k c p e, b c) of the gradients at the quadrature points of a full body on its
    coordinates.
    """
    assert part.cells is not None
    read = read_by_cells(part)
    rows = gradient_rows(
        part.cells, part.dim * (len(part.reference) if read is None else read.shape[0])
    )
    return rows if read is None else csr_array(rows @ alike(read, part.dim))


def strain_errors(part: Body, S: np.ndarray, states: np.ndarray) -> np.ndarray:
    """What S (b, m) misses of strains and curvatures (2,) in states (s, b, c) of a full body, over
    the largest ones.

    The largest errors over the largest values, of strains first and then of curvatures; 0 where
    there are none.
    """
    assert part.cells is not None
    rows = rows_of(part)
    section = part.cells.section
    found = np.zeros((2, 2))
    flat = section.reshape(len(section), -1)
    for k in range(0, len(states), STATES):
        some = states[k : k + STATES]
        own = np.einsum("bm,smc->sbc", S, coordinates(part, S, some))
        u, v = (
            np.asarray(rows @ one.reshape(len(one), -1).T).reshape(-1, flat.shape[1], len(one))
            for one in (some, own)
        )
        found = np.maximum(found, fields.strain_errors(part.cells.law, u, v, flat))
    return relative(found)


def relative(found: np.ndarray) -> np.ndarray:
    """Errors (2,) over the largest values that stand over them, (2, 2); zero where there are none."""
    return np.divide(found[1], found[0], out=np.zeros(2), where=found[0] > 0.0)


def placed(
    part: Body,
    name: str,
    origin: np.ndarray | None = None,
    rotation: np.ndarray | None = None,
    check: bool = True,
) -> Body:
    """A reduced body elsewhere under another name, by an origin (c,) [m] and a proper rotation (c,
    c).

        x <- origin + rotation x

    Without `check` what it takes part in is not held against the shapes that it lacks, see
    `parts.finer_parts`.
    """
    R = np.eye(part.dim) if rotation is None else np.asarray(rotation, dtype=float)
    if (
        R.shape != (part.dim, part.dim)
        or np.abs(R @ R.T - np.eye(part.dim)).max() > MISSES
        or np.linalg.det(R) < 0.0
    ):
        remedy = "a mirrored part is another part: train it from a mirrored mesh"
        raise InputError(
            say(
                f"part '{name}'",
                f"a rotation ({part.dim}, {part.dim}) that mirrors nothing",
                R.tolist(),
                remedy,
            )
        )
    shift = np.zeros(part.dim) if origin is None else np.asarray(origin, dtype=float)
    points = part.shapes if part.shapes is None else replace(part.shapes, checked=check)
    if points is not None and points.positions.size:
        points = replace(points, positions=points.positions @ R.T + shift)
    if points is not None and points.missing is not None:
        points = replace(
            points,
            missing=replace(points.missing, positions=points.missing.positions @ R.T + shift),
        )
    return replace(
        part,
        name=name,
        shapes=points,
        linear=part.linear
        and transformed(part.linear, csr_array(kron(eye_array(len(part.reference)), R.T))),
        spare=part.spare and placed(part.spare, name, origin, rotation, check),
        reference=part.reference @ R.T + np.outer(part.constant, shift),
    )
