"""From bodies, joints and loads to a System with all multipliers, and from there to the form
without linear constraints.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Annotated, Any

import numpy as np
from scipy.sparse import csr_array, diags_array, vstack
from scipy.sparse.linalg import spsolve

from ..bodies.body import Body, Cells, ShapePoints, own, read_by_cells
from ..bodies.finer import finer, knows_more
from ..bodies.laws import CABLES, Law
from ..bodies.plate import local_table
from ..core.algebra import ranks
from ..core.algebra.linalg import alike, as_dense, diagonal, entries, others
from ..core.declared import require_sound
from ..core.errors import InputError, listed, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values import arguments, arrays, fields
from ..core.values.arguments import checked
from ..core.values.problems import shown
from ..shapes import line, surface
from ..shapes.solids import elements
from ..shapes.solids.recovery import boundary_nodes, node_gradients
from ..shapes.solids.solid import Solid
from ..shapes.surface import Surface
from . import finer_systems, lengths
from .additions import Addition, additions_of
from .affine import Affine
from .connections import echelon, redundancy
from .connections.constraint_functions import Joint
from .forces import responses
from .forces.loads import Load
from .forces.on_rows import joined
from .measures import probes as probe_rules
from .measures import readings
from .measures.beam_sections import SweptLine, swept_line
from .measures.cable_sections import CableLine, cable_line
from .places import At, Coordinates, Draft, Origin, ProbeRows, TermCollector, vector
from .prepared import remembered
from .signals import as_drive
from .system import (
    Constraints,
    Elastic,
    LineSamples,
    Loads,
    Output,
    Skin,
    System,
    change_coordinates,
    driven_rows,
    driving,
    is_linear,
    keep_constraints,
    linear_part,
)
from .terms import corotated
from .terms.corotated import Corotated

FACETS = 2  #: quadrilaterals a direction that picture a cell of a surface
SAMPLES = 201  #: points of a centre line in pictures and position errors
LIGHT = 1e-9  #: part of the metric of unknowns without mass in the kinetic energy of changes of initial velocities
KEPT = "kept linear rows"  #: under which a system remembers them
ORIGINS = "origins"  #: the same of what joints and loads have put into it
#: gap of a linear constraint at the start, over the size of the mechanism, that is named
MOVED = 1e-6
SAME_PLACE = 1e-12  #: differences of functions at two places of a body that are one
SNAP = 1e-12  #: distance from a break, over the length of a line, that is round-off


@dataclass(frozen=True)
@checked
class Rayleigh:
    """Rayleigh damping of all bodies; stiffness-proportional damping acts on strains only.

        C = mass M + stiffness K

    `mass` [1/s], `stiffness` [s].
    """

    mass: Annotated[float, fields.quantity("1/s", ">= 0")] = 0.0
    stiffness: Annotated[float, fields.quantity("s", ">= 0")] = 0.0

    def __post_init__(self) -> None:
        if not (self.mass >= 0 and self.stiffness >= 0):
            raise InputError(say("damping", "non-negative factors", (self.mass, self.stiffness)))


@dataclass(frozen=True)
@checked
class Motion:
    """Rigid velocity field of a body at the start.

        v = velocity + angular_velocity x (r - center)

    The `center`, by default the origin of the scene, is the point that has the velocity: state it
    where a body moves and turns.
    """

    velocity: Annotated[tuple[float, ...], fields.vector("m/s")] | None = None
    angular_velocity: Annotated[float | tuple[float, ...], fields.spin("rad/s")] | None = None
    center: Annotated[tuple[float, ...], fields.vector("m")] | None = None


def assemble(
    bodies: Iterable[Body],
    joints: Iterable[Joint] = (),
    loads: Iterable[Load] = (),
    damping: Rayleigh | None = None,
    outputs: Mapping[str, probe_rules.Probe] | None = None,
    initial: Mapping[str, Motion] | None = None,
    pictures: bool = True,
    **more: Any,
) -> System:
    """System in body coordinates with every constraint kept as a multiplier row; without `pictures`
    it has no lines and skins, and no marks of joints.

        M q'' + C q' + K q + sum_j L_j^T phi_j(L_j q) - Q(q, t) + Phi_q^T lambda = 0,     Phi(q, t) = 0

    `outputs` by name, `initial` velocities by the name of a body; a body without one starts at
    rest. Expressions of the state read outputs, and what stands beside them (`inputs`, ...), by
    their names: see `additions`. `eliminate` takes out what is linear. InputError for no body,
    bodies of different dimensions or of one name, joints of one name, columns of one name, places
    and names that do not exist, and keywords that nothing registers.

        >>> from fmbs_skfem.bodies import Circular, Material, cable
        >>> from fmbs_skfem.shapes.meshes import segment
        >>> from fmbs_skfem.systems import At, assemble, joints, loads, probes
        >>> arm = cable("arm", segment(10), Circular(0.01), Material(1e9, 1800.0), dim=2)
        >>> hinge = joints.Pin("hinge", At("arm", "left"))
        >>> weight = loads.Gravity((0.0, -9.81))
        >>> tip = {"tip": probes.Position(At("arm", "right"))}
        >>> assemble([arm], [hinge], [weight], outputs=tip)
        <System 44 unknowns, 2 constraints: arm>
    """
    for name, value, kind in (
        ("bodies", bodies, Iterable[Body]),
        ("joints", joints, Iterable),
        ("loads", loads, Iterable),
    ):
        arguments.require(f"assemble: {name}", value, kind)
    arguments.require("assemble: outputs", outputs, Mapping[str, Any] | None)
    arguments.require("assemble: initial", initial, Mapping[str, Any] | None)
    bodies, joints, loads = list(bodies), list(joints), list(loads)
    damping = Rayleigh() if damping is None else damping
    require_kind("damping", damping, Rayleigh)
    draft, layout = empty_draft(bodies)
    if brought := unknowns_of(joints, layout):
        draft, layout = empty_draft([*bodies, *brought])
    draft.pictured = pictures
    constrain(draft, joints)
    draft.outputs = dict(outputs or {})
    wanted, reading = read_by(additions_of(more, draft), draft)
    push(draft, loads)
    own = dict[str, Any]()
    for one, numbers in reading:
        own |= one.add(draft, joints, numbers)
    responses.keep(draft, wanted.kept)
    draft.acting = [*places_of("joint", joints), *places_of("load", loads)]
    sensed = sense(draft)
    parts = list(layout.bodies.values())
    forces = draft.forces
    pictured = [part for part in parts if part.constant.any()] if pictures else []
    probes = draft.probes.affine()
    sensors = draft.sensors.affine()
    constraints = replace(draft.constraints.arrays(), loose=draft.loose)
    driven = {k for _, k in driving(constraints)} if draft.signals else set()
    mass = diagonal([alike(part.mass, layout.dim) for part in parts])
    q0, unit = (
        np.concatenate([part.reference.ravel() for part in parts]),
        np.concatenate([part.constant for part in parts]),
    )
    system = System(
        dim=layout.dim,
        lift=Affine(csr_array(diags_array(np.ones(layout.size))), np.zeros(layout.size)),
        mass=mass,
        damping=csr_array(damping.mass * mass) if damping.mass else csr_array(mass.shape),
        stiffness=springs(parts, layout.dim),
        elastic=(
            *(
                Elastic(part.name, damping.stiffness, energy(part, layout))
                for part in parts
                if part.is_elastic
            ),
            *(
                Elastic(name, 0.0, gather(part, cells, layout))
                for name, part, cells in forces.cells
            ),
        ),
        probes=probes,
        constraints=constraints,
        loads=Loads(
            constant=mass @ uniform_field(layout, parts, forces.field),
            forces=joined(forces.terms),
        ),
        signals=tuple(
            as_drive(signal) if k in driven else signal for k, signal in enumerate(draft.signals)
        ),
        sensors=replace(sensors, offset=sensors.offset + sensors.matrix @ layout.shift),
        outputs=sensed,
        lines=tuple(
            picture_line(part, layout)
            for part in pictured
            if not isinstance(part.space, Surface | Solid)
        ),
        skins=tuple(
            picture_skin(part, layout)
            if isinstance(part.space, Surface)
            else solid_skin(part, layout)
            for part in pictured
            if isinstance(part.space, Surface | Solid)
        ),
        markers=tuple(draft.markers),
        coordinates=tuple(
            (p.name, layout.first[p.name], layout.first[p.name] + p.reference.size) for p in parts
        ),
        components=(),
        x0=q0,
        v0=initial_velocity(layout, parts, initial or {}),
        unit=unit,
        metric=lengths.metric(parts, mass),
        weight=lengths.weight(parts),
        scale=lengths.extent(parts, probes(q0)),
        origin=layout.origin,
        readings=readings.collect(
            wanted,
            sensed,
            responses.known(draft),
            responses.tables_of(draft),
            (gain for one, _ in reading for gain in one.gains()),
        ),
        **own,
    )
    if brought:
        system = replace(
            system, v0=rates_of_unknowns(system, sum(one.reference.size for one in brought))
        )
    remembered(system, ORIGINS, lambda: tuple(draft.origins))
    if any(knows_more(part) for part in bodies):
        given = joints, loads, damping, outputs, initial, False
        make = lambda: assemble(map(finer, bodies), *given, **more)  # noqa: E731
        finer_systems.note(system, make)
    return system


def origins_of(system: System) -> tuple[Origin, ...]:
    """What joints and loads have put into a system as it was assembled; of one that was changed
    since, nothing is known.
    """
    return remembered(system, ORIGINS, tuple)


def unknowns_of(joints: Sequence[Joint], layout: Coordinates) -> list[Body]:
    """Coordinates that joints bring; InputError for joints that are none, that have problems, or
    one name.
    """
    for joint in joints:
        require_sound("joint", getattr(joint, "name", ""), joint, Joint, layout.dim)
    unique("joints", [joint.name for joint in joints])
    return [one for joint in joints for one in joint.unknowns(layout)]


def constrain(draft: Draft, joints: Sequence[Joint]) -> None:
    """Add the rows of all joints to a draft, and those that keep frames of bodies orthonormal."""
    for joint in joints:
        require_two_places(f"joint '{joint.name}'", joint, draft)
        with draft.origin(f"joint '{joint.name}'"):
            joint.constrain(draft)
    for part in draft.layout.bodies.values():
        orthonormal(part, draft)


def require_two_places(where: str, one: Joint | Load | probe_rules.Probe, draft: Draft) -> None:
    """InputError for what is between a place and itself, however that is called: `right`, or an arc
    length.

    Where `on` carries what `at` meets, both are read.
    """
    at = getattr(one, "at", None)
    for key in ("to", "on"):
        other = getattr(one, key, None)
        if not (isinstance(at, At) and isinstance(other, At) and at.body == other.body):
            continue
        if (
            at == other
            or abs(draft.layout.read(where, at) - draft.layout.read(where, other)).max()
            <= SAME_PLACE
        ):
            got = f"'{other}', which is '{at}' itself"
            raise InputError(
                say(f"{where}: {key}", "another place", got, "take a place of another body")
            )


def read_by(
    additions: Iterable[Addition], draft: Draft
) -> tuple[readings.WantedReadings, list[tuple[Addition, list[int]]]]:
    """What additions read of accepted states, and each with the numbers of its values; expressions
    know what they give.
    """
    added = [(one, list(one.reads())) for one in additions]
    wanted = readings.sort(
        [value for _, values in added for value in values], draft.outputs, draft.layout.dim
    )
    counted = iter(wanted.numbers)
    reading = [(one, list(islice(counted, len(values)))) for one, values in added]
    known = [source for one, numbers in reading for source in one.sources(numbers)]
    draft.inputs = {one.name: one for one in known}
    unique(
        "outputs, and what else expressions know", [*draft.outputs, *(one.name for one in known)]
    )
    return wanted, reading


def push(draft: Draft, loads: Iterable[Load]) -> None:
    """Add the forces of all loads to a draft."""
    for load in loads:
        require_sound("load", getattr(load, "name", ""), load, Load, draft.layout.dim)
        require_two_places(f"load '{load.name}'", load, draft)
        first = draft.probes.count
        with draft.origin(f"load '{load.name}'"):
            load.push(draft)
        draft.pushed[load.name] = range(first, draft.probes.count)
    draft.require_rows()


def sense(draft: Draft) -> dict[str, Output]:
    """What the outputs of a draft read, by name; InputError for units that are no texts, and
    columns of one name.
    """
    sensed = dict[str, Output]()
    for name, probe in draft.outputs.items():
        require_sound("output", name, probe, probe_rules.Probe, draft.layout.dim)
        require_two_places(f"output '{name}'", probe, draft)
        sensed[name] = probe.sense(name, draft)
        if not all(isinstance(unit, str) for unit in probe.units(name, sensed[name])):
            raise InputError(
                say(
                    f"output '{name}': unit",
                    "a text such as 'm'",
                    repr(probe.units(name, sensed[name])),
                )
            )
    probe_rules.require_distinct_columns(sensed)
    return sensed


def places_of(kind: str, items: Iterable[Joint | Load]) -> Iterator[tuple[str, At]]:
    """Joints or loads, as messages name them, and the places that they act on."""
    for one in items:
        yield from (
            (f"{kind} '{one.name}'", end) for end in vars(one).values() if isinstance(end, At)
        )


def springs(parts: list[Body], dim: int) -> csr_array:
    """Constant stiffness K (q, q) [N/m] of all bodies, alike in every component."""
    if all(part.stiffness is None for part in parts):
        size = dim * sum(len(part.reference) for part in parts)
        return csr_array((size, size))
    own = [
        csr_array(part.mass.shape) if part.stiffness is None else part.stiffness for part in parts
    ]
    return diagonal([alike(matrix, dim) for matrix in own])


def energy(part: Body, layout: Coordinates) -> Cells | ShapePoints | Corotated:
    """The storage of a body's elastic energy: its cells, the points of a reduced body, or matrices
    that turn with it.
    """
    first = layout.first[part.name]
    columns = slice(first, first + part.reference.size)
    if part.linear is not None:
        made = corotated.of_body(part.linear, part.mass, part.reference, part.constant)
        return replace(made, columns=columns, checked=knows_more(part))
    assert part.cells is not None
    if part.shapes is None:
        return gather(part, part.cells, layout)
    return replace(part.shapes, columns=columns)


def gather(part: Body, cells: Cells, layout: Coordinates) -> Cells:
    """Cells of a body that read all coordinates q, or the coordinates of its space where frames
    slave some of them.
    """
    read = read_by_cells(part)
    return (
        cells.moved(layout.first[part.name])
        if read is None
        else cells.moved(0, layout.spread(part, read))
    )


def orthonormal(part: Body, draft: Draft) -> None:
    """The axes of every frame of a body stay unit vectors at right angles, and those that follow
    nodes turn as these do.

        (e_i . e_j - delta_ij) / (1 + delta_ij) = 0,    e_i . a_j - e_j . a_i = 0

    one row a pair i <= j, and i < j.
    """
    dim = part.dim
    for frame in part.frames:
        rows = [
            draft.probes.add(draft.layout.read(f"body '{part.name}'", At(part.name, frame), k + 1))
            for k in range(dim)
        ]
        for i in range(dim):
            for j in range(i + 1):
                factor = 0.5 if i == j else 1.0
                terms = [(factor, -1, rows[i] + c, rows[j] + c) for c in range(dim)] + [
                    (-0.5 * (i == j), -1, -1, -1)
                ]
                draft.constraints.row(f"{part.name}.{frame}", f"e{j + 1}.e{i + 1}", *terms)
        if frame in part.fits:
            follow(f"{part.name}.{frame}", part, frame, rows, draft)


def follow(name: str, part: Body, frame: str, axes: list[int], draft: Draft) -> None:
    """The axes of a frame, with the first probe rows (3,) of each, turn as the mean axes of its
    nodes.

        e_i . a_j - e_j . a_i = 0
    """
    first = draft.probes.add(draft.layout.spread(part, own(part, part.fits[frame])))
    for i in range(3):
        for j in range(i + 1, 3):
            terms = [(1.0, -1, axes[i] + c, first + 3 * j + c) for c in range(3)]
            terms += [(-1.0, -1, axes[j] + c, first + 3 * i + c) for c in range(3)]
            draft.constraints.row(name, f"e{i + 1}.a{j + 1}", *terms)


def empty_draft(parts: list[Body]) -> tuple[Draft, Coordinates]:
    """A draft with nothing but bodies, and where their coordinates are, from the origin that suits
    them (`lengths.origin`).

    InputError for no body, bodies of one name, or of different dimensions.
    """
    if not parts:
        raise InputError(say("bodies", "at least one body", "none"))
    unique("bodies", [part.name for part in parts])
    dims = {part.dim for part in parts}
    if len(dims) > 1:
        raise InputError(say("bodies", "one dimension for all", sorted(dims)))
    first = dict(
        zip(
            (p.name for p in parts),
            np.cumsum([0] + [p.reference.size for p in parts[:-1]]).tolist(),
            strict=True,
        )
    )
    origin = lengths.origin(parts)
    moved = {
        p.name: replace(p, reference=p.reference - np.outer(p.constant, origin)) for p in parts
    }
    layout = Coordinates(dims.pop(), moved, first, sum(p.reference.size for p in parts), origin)
    return Draft(layout, ProbeRows(layout.size), ProbeRows(layout.size)), layout


def unique(where: str, names: list[str]) -> None:
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InputError(say(where, "different names", f"{twice[0]!r} more than once"))


def terms_of(known: Constraints) -> TermCollector:
    """The terms and rows by laws of constraints as a collector, to which others can be added.

    Directions and axes of reactions are not among what is known of them.
    """
    columns = (
        part.tolist() for part in (known.row, known.coefficient, known.signal, known.i, known.j)
    )
    return TermCollector(list(known.names), list(zip(*columns, strict=True)), laws=list(known.laws))


def uniform_field(
    layout: Coordinates, parts: list[Body], accelerations: list[np.ndarray]
) -> np.ndarray:
    """Coordinates (q,) of the sum g of all gravity fields (c,) [m/s2].

        1 (x) g

    with the coordinates of the field 1 of every body.
    """
    total = sum(accelerations, np.zeros(layout.dim))
    return np.concatenate([np.kron(part.constant, total) for part in parts])


def require_kind(where: str, item: object, kind: type[Rayleigh | Motion]) -> None:
    """Refuse a mapping, or whatever else is no such struct, in its place."""
    if not isinstance(item, kind):
        keys = [one.name for one in dataclasses.fields(kind)]
        given = [key for key in keys if isinstance(item, Mapping) and key in item] or keys
        call = f"{kind.__name__}({', '.join(f'{key}=...' for key in given)})"
        raise InputError(
            say(where, f"a {kind.__name__} of systems", shown(item), f"write systems.{call}")
        )


def initial_velocity(
    layout: Coordinates, parts: list[Body], initial: Mapping[str, Motion]
) -> np.ndarray:
    """v (q,) [m/s] of the bodies that move at the start, the center in the scene; zeros of the
    others.

        v = v0 + omega x (r - center)

    InputError for a name that is no body, and for what is no `Motion`.
    """
    for name, given in initial.items():
        require_kind(f"initial '{name}'", given, Motion)
        if name not in layout.bodies:
            raise InputError(
                say("initial", f"one of the bodies {listed(layout.bodies, name)}", f"'{name}'")
            )
    v = []
    for part in parts:
        motion = initial.get(part.name, Motion())
        field = np.zeros_like(part.reference)
        center = (
            np.zeros(layout.dim)
            if motion.center is None
            else vector(f"initial '{part.name}'", motion.center, layout.dim)
        )
        places = part.reference + np.outer(part.constant, layout.origin - center)
        if motion.velocity is not None:
            field += np.outer(
                part.constant, vector(f"initial '{part.name}'", motion.velocity, layout.dim)
            )
        if motion.angular_velocity is not None:
            omega = arrays.finite(
                np.atleast_1d(motion.angular_velocity),
                f"initial '{part.name}': angular_velocity",
                "a number [rad/s]" if layout.dim == 2 else "3 numbers [rad/s]",
                1 if layout.dim == 2 else 3,
            )
            if layout.dim == 2:
                field += omega[0] * places @ np.array([[0.0, 1.0], [-1.0, 0.0]])
            else:
                field += np.cross(omega, places)
        v.append(field.ravel())
    return np.concatenate(v)


def rates_of_unknowns(system: System, count: int) -> np.ndarray:
    """v0 (q,) in which the last `count` coordinates, which joints bring, follow from the motion of
    the bodies.

        Phi_q v0 = 0

    Drives are left out: where they begin with another rate, they change velocities.
    """
    rows, z = redundancy.rows_of(
        keep_constraints(system, np.flatnonzero(~driven_rows(system.constraints)))
    )
    mine = rows.used >= system.size - count
    v = system.v0.copy()
    J = as_dense(rows(z)[1])
    v[rows.used[mine]] = ranks.least(J[:, mine], -J @ v[rows.used])
    return v


def picture_line(part: Body, layout: Coordinates) -> LineSamples:
    """Samples of the centre line for pictures and position errors, at the same places on every
    mesh.
    """
    if not isinstance(part.space, line.BSpline | line.Hermite) or part.cells is None:
        return LineSamples(
            part.name, layout.spread(part, rigid_samples(part)), part.radius, Law.EXACT
        )
    samples = partial(line_samples, part, layout)
    return LineSamples.later(
        part.name,
        samples,
        part.radius,
        part.cells.law,
        partial(sections, part, layout),
    )


def sections(part: Body, layout: Coordinates) -> SweptLine | CableLine | None:
    """Sections along a beam in full that carries directors, or along a cable with a law of this
    package; None of other lines.
    """
    spread = partial(layout.spread, part)
    if part.directors is not None:
        return None if part.shapes is not None else swept_line(part, spread)
    assert part.cells is not None
    return cable_line(part, sampled(part), spread) if part.cells.law in CABLES else None


def solid_skin(part: Body, layout: Coordinates) -> Skin:
    """Samples of the boundary of a solid: of every face its nodes, with the gradients of its cell."""
    shape, cells = part.space, part.cells
    assert isinstance(shape, Solid)
    assert cells is not None
    nodes, local, owner = boundary_nodes(shape)
    slopes = node_gradients(shape, owner, local)
    columns = np.concatenate([nodes, *[shape.nodes[owner].ravel()] * 3])
    count = len(nodes)
    points = elements.face_nodes(shape.kind).shape[1]
    sizes = np.concatenate([np.ones(count, np.int64), np.full(3 * count, shape.nodes.shape[1])])
    values = np.concatenate([np.ones(count), slopes.transpose(1, 0, 2).ravel()])
    indptr = np.append(0, np.cumsum(sizes))
    rows = csr_array((values, columns, indptr), shape=(4 * count, shape.count))
    facets = elements.facets(shape.kind)
    first = layout.first[part.name]
    section = np.repeat(cells.section[:, :1, :1], count, axis=2)
    return Skin(
        part.name,
        own(part, rows),
        slice(first, first + part.reference.size),
        (facets[None] + np.arange(0, count, points)[:, None, None]).reshape(-1, 4),
        np.zeros(count),
        cells.law,
        section,
        points,
    )


def line_samples(part: Body, layout: Coordinates) -> csr_array:
    """Rows (3 c x, q) of a centre line: positions, then first and second derivatives by the arc
    length.
    """
    value, first, second = (
        layout.remember(part, ("line", k), partial(line_rows, part, k)) for k in range(3)
    )
    r1, r2 = first @ part.reference, second @ part.reference
    J = np.linalg.norm(r1, axis=1)
    slope = scale_rows(first, 1 / J)
    bend = scale_rows(second, 1 / J**2) - scale_rows(first, np.einsum("xc,xc->x", r1, r2) / J**4)
    return layout.spread(part, csr_array(vstack([value, slope, bend])))


def line_rows(part: Body, derivative: int) -> csr_array:
    """Rows (x, b) of derivatives by the parameter of a line at the samples of pictures."""
    return own(part, line.sample(part.space, sampled(part), derivative))


def sampled(part: Body) -> np.ndarray:
    """Parameters (x,) of a line at the samples of pictures."""
    assert isinstance(part.space, line.BSpline | line.Hermite)
    breaks = line.breaks(part.space)
    return snapped(np.linspace(breaks[0], breaks[-1], SAMPLES), breaks)


def scale_rows(rows: csr_array, factors: np.ndarray) -> csr_array:
    """Rows times factors (x,)."""
    return csr_array(
        (rows.data * np.repeat(factors, np.diff(rows.indptr)), rows.indices, rows.indptr),
        shape=rows.shape,
    )


def snapped(xi: np.ndarray, breaks: np.ndarray) -> np.ndarray:
    """Places (x,) of a line, those at breaks there to the bit, so that round-off of a length does
    not choose their cell.
    """
    near = breaks[
        np.clip(np.searchsorted(0.5 * (breaks[1:] + breaks[:-1]), xi), 0, len(breaks) - 1)
    ]
    return np.asarray(np.where(np.abs(xi - near) <= SNAP * (breaks[-1] - breaks[0]), near, xi))


def rigid_samples(part: Body) -> csr_array:
    """Points of the outline, unit vectors along it and no curvature, (3 x, b); the centre alone
    where there is no outline.
    """
    if part.outline is None or len(part.outline) < 2:
        return csr_array(([1.0], ([0], [0])), shape=(3, len(part.reference)))
    along = np.diff(part.outline, axis=0)
    along = along / np.linalg.norm(along @ part.reference, axis=1)[:, None]
    return csr_array(np.vstack([part.outline, along, along[-1:], np.zeros_like(part.outline)]))


def picture_skin(part: Body, layout: Coordinates) -> Skin:
    """Samples of a middle surface for pictures and stresses, FACETS x FACETS quadrilaterals a cell
    (triangles: degenerate ones).
    """
    shape, cells = part.space, part.cells
    assert isinstance(shape, Surface)
    assert cells is not None
    s = np.linspace(0.0, 1.0, FACETS + 1)
    a, b = (x.ravel() for x in np.meshgrid(s, s, indexing="ij"))
    xi = np.column_stack([a, b if shape.parent is surface.Parent.SQUARE else b * (1.0 - a)])
    count, points = len(shape.nodes), len(xi)
    values = surface.basis(
        shape.space, np.repeat(np.arange(count), points), np.tile(xi, (count, 1))
    )
    reference = part.shape_reference
    local, _, curved = local_table(
        values.reshape(count, points, 6, -1), np.ones((count, points)), reference[shape.nodes]
    )
    vectors = cells.law.vectors
    tables = np.concatenate(
        [values.reshape(count, points, 6, -1)[:, :, :1], local[:, :, :vectors]], axis=2
    )
    tables = tables.transpose(2, 0, 1, 3).reshape((1 + vectors) * count * points, -1)
    columns = np.tile(np.repeat(shape.nodes, points, axis=0), (1 + vectors, 1))
    indptr = np.arange(len(tables) + 1) * tables.shape[1]
    rows = csr_array((tables.ravel(), columns.ravel(), indptr), shape=(len(tables), shape.count))
    rows = own(part, rows)
    corner = (np.arange(FACETS)[:, None] * (FACETS + 1) + np.arange(FACETS)[None, :]).ravel()
    facets = corner[:, None] + np.array([0, FACETS + 1, FACETS + 2, 1])
    facets = (facets[None] + points * np.arange(count)[:, None, None]).reshape(-1, 4)
    section = np.repeat(cells.section[:, :1].transpose(0, 2, 1), points, axis=2).reshape(
        len(cells.section), 1, -1
    )
    if cells.law is Law.SHELL:
        section[3:6, 0] = curved.reshape(-1, 3).T
    thickness = np.repeat(np.broadcast_to(part.thickness, count), points)
    first = layout.first[part.name]
    return Skin(
        part.name,
        rows,
        slice(first, first + part.reference.size),
        facets,
        thickness,
        cells.law,
        section,
    )


@checked
def eliminate(system: System, tolerance: fields.Tolerance = ranks.EXACT) -> System:
    """The system without its time-independent linear constraints, with sparse T (n, r), found by
    `echelon.solve`.

        x = T y + d

    Redundant rows are dropped with a notice; contradictory rows raise Contradiction with the joints
    by name. An initial state that does not satisfy the rows is moved onto them with a notice,
    velocities by the least kinetic energy of the change. Pivots are larger than `tolerance`,
    relative; `full` of the result is the system itself, from which reactions are recovered.

        >>> import numpy as np
        >>> from fmbs_skfem.bodies import point_mass
        >>> from fmbs_skfem.systems import At, assemble, eliminate, joints
        >>> bead = point_mass("bead", 2.0, np.zeros(2))
        >>> raw = assemble([bead], [joints.Slider("rail", At("bead"), (1.0, 0.0))])
        >>> raw, eliminate(raw)
        (<System 2 unknowns, 1 constraints: bead>, <System 1 unknowns, 0 constraints: bead>)
    """
    rows, A, a = linear_part(system)
    if len(rows) == 0:
        return replace(system, full=system)
    found = echelon.solve(A, a, tolerance, redundancy.scale_of(system))
    dropped = [system.constraints.names[rows[k]] for k in found.left]
    redundancy.refuse_gaps(dropped, found.gap, tolerance * system.scale)
    left = redundancy.keep_held(system.constraints, rows, A, found.left)
    remembered(system, KEPT, lambda: np.setdiff1d(np.arange(len(rows)), left))
    if dropped:
        redundancy.notify_left_out(system.constraints, rows[left])
    kept = others(system.size, found.dependent)
    if not len(kept):
        return without_motion(system, rows, found, A @ system.x0 + a)
    place = np.full(system.size, -1)
    place[kept] = np.arange(len(kept))
    row, column, values = entries(found.solution)
    T = csr_array(
        (
            np.concatenate([np.ones(len(kept)), values]),
            (
                np.concatenate([kept, found.dependent[row]]),
                np.concatenate([place[kept], place[column]]),
            ),
        ),
        shape=(system.size, len(kept)),
    )
    d = np.zeros(system.size)
    d[found.dependent] = found.fixed
    report_moved(system, rows, A @ system.x0 + a)
    rest = np.flatnonzero(~is_linear(system.constraints))
    free = change_coordinates(keep_constraints(system, rest), T, d)
    return replace(free, v0=admissible_velocity(system, T, free), full=system)


def kept_rows(system: System) -> np.ndarray:
    """Linear constraints (i,), numbered as in `linear_part`, that `eliminate` solves: the others
    follow from them.
    """

    def find() -> np.ndarray:
        rows, A, a = linear_part(system)
        left = echelon.solve(A, a, units=redundancy.scale_of(system)).left
        return np.setdiff1d(
            np.arange(len(rows)), redundancy.keep_held(system.constraints, rows, A, left)
        )

    return remembered(system, KEPT, find)


def without_motion(
    system: System, rows: np.ndarray, found: echelon.Echelon, gap: np.ndarray
) -> System:
    """The system where linear constraints `rows` (i,) hold all unknowns: it keeps those that do,
    for their reactions.

    `gap` (i,) is what the rows miss in the initial state.
    """
    report_moved(system, rows, gap)
    x0 = np.zeros(system.size)
    x0[found.dependent] = found.fixed
    held = keep_constraints(
        system, np.setdiff1d(np.arange(len(system.constraints.names)), rows[found.left])
    )
    return replace(held, x0=x0, full=system)


def report_moved(system: System, rows: np.ndarray, gap: np.ndarray) -> None:
    """Notice linear constraints `rows` (i,) that the initial state does not satisfy, by `gap` (i,).

    Gaps up to `MOVED` of the size of the system are left out.
    """
    wrong = [k for k in np.argsort(-np.abs(gap)) if abs(gap[k]) > MOVED * system.scale]
    if wrong:
        listed = ", ".join(
            f"{'.'.join(system.constraints.names[rows[k]])} by {abs(gap[k]):.3g}" for k in wrong
        )
        notify(f"the initial state is moved, because it does not satisfy the joints: {listed}")


def mass_of_speeds(system: System) -> csr_array:
    """M (n, n) in which axes without mass, of laminae and rods, weigh next to nothing.

        M + 1e-9 (W - M),    W the metric

    Where initial velocities change by the least kinetic energy, such axes keep velocities that
    joints let be.
    """
    return csr_array(system.mass + LIGHT * (system.metric - system.mass))


def admissible_velocity(system: System, T: csr_array, free: System) -> np.ndarray:
    """Initial velocities (r,) in the unknowns of `free`, x = T y + d, T (n, r): those of least
    kinetic energy of the change.

        (T^T M T) v = T^T M v0

    A notice names a change.
    """
    if not system.v0.any():
        return free.v0
    M = mass_of_speeds(system)
    v = np.asarray(spsolve(csr_array(T.T @ M @ T).tocsc(), T.T @ (M @ system.v0))).reshape(
        free.size
    )
    change = T @ v - system.v0
    if np.abs(change).max() > 1e-9 * max(1.0, float(np.abs(system.v0).max())):
        redundancy.notify_projected(system, change)
    return v
