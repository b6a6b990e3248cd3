r"""Loads: probe rows and forces.

    gravity       Q = M (1 x g)                         point force    Q = P^T f s(t)
    moment        Q = P_t^T s(t) m x t / |t|^2          follower       Q = P_r^T s(t) (f_t t + f_n n) / |t|
    on a frame    Q = sum_k P_k^T s(t) m/2 x e_k                       Q = P_r^T s(t) sum_k f_k e_k
    surface       Q = s(t) int N^T f dA                 pressure       Q = s(t) int N^T p n0 dA
    edge          Q = s(t) int N^T f ds                 spring         torque - k (theta - theta0) - d theta'
    following pressure   Q = p int N^T (r,1 x r,2) dA   following edge load   Q = f int N^T J^T r,s ds

with the slope t = dr/dS, its normal n (t turned by 90 degrees in the plane), axes e_k of a frame,
the unit normal n0 of the reference, and a history s(t), 1 by default. Power of m/2 on all axes: 1/2
sum_k (m x e_k) . (w x e_k) = m . w.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np
from scipy.sparse import csr_array

from ...bodies.body import Body
from ...bodies.plate import edge
from ...core.declared import Declared
from ...core.errors import InputError, say
from ...core.notices import notify
from ...core.storage.records import dataclass
from ...core.values.problems import Problem
from ...shapes import surface
from ...shapes.surface import Surface
from .. import fields
from ..connections import edges
from ..connections.constraint_functions import basis, needs_axis, point
from ..places import At, Draft, Ground, directions, vector
from . import pressure, responses

ALONG = 1e-6  #: part of a moment about a line that is no round-off
TORSION = {
    "torque": "torsion_spring",
    "relative torque": "relative_torsion_spring",
    "torque in space": "spatial_torsion_spring",
}
Spin: TypeAlias = Annotated[float | Ground, fields.spin("N m")]


class Load(Declared, ABC):
    """A load: a frozen dataclass with a name, see `core.declared`, which adds forces to the system.

    `check_force` tests one.
    """

    name: str
    #: whether it is a spring or damper, which acts in modes about the unloaded reference
    resists: ClassVar[bool] = False
    strengths: ClassVar[tuple[str, ...]] = ()  #: fields of which one at least makes it act
    drives: ClassVar[bool] = False  #: whether what reads velocities may bring energy, as a motor

    @property
    def rests(self) -> bool:
        """Whether it is known to push nothing in the reference.

        False where that is not known.
        """
        return False

    def idle(self, undamped: str) -> Iterator[tuple[str, str]]:
        """Names of fields, "" for the load, that do nothing, and why; damping because it is
        `undamped`, "" where it is damped.
        """
        if self.strengths and not any(
            np.any(getattr(self, name) or 0.0) for name in self.strengths
        ):
            yield "", f"does nothing without {' or '.join(self.strengths)}"
        elif undamped and vars(self).get("damping"):
            yield "damping", undamped

    def unread(self, dim: int) -> Iterator[tuple[str, str]]:
        """Names of fields that were given and do nothing in a scene of this dimension beside the
        others, and why.
        """
        return iter(())

    @abstractmethod
    def push(self, draft: Draft) -> None:
        """Add the load's probe rows and forces to the draft.

        InputError, with the name of the load, where its fields do not fit the bodies.
        """


def where(load: Load) -> str:
    """How messages name a load."""
    return f"load '{load.name}'"


@dataclass(frozen=True)
class Gravity(Load):
    """Uniform acceleration of all bodies.

        dF = acceleration dm

    {type: gravity, acceleration: [0, 0, -9.81 m/s^2]}
    """

    acceleration: Annotated[Ground, fields.vector("m/s^2")]
    name: str = "gravity"

    def push(self, draft: Draft) -> None:
        acceleration = vector(where(self), self.acceleration, draft.layout.dim)
        point(where(self), draft, "gravity", None, acceleration)
        draft.forces.field.append(acceleration)


@dataclass(frozen=True)
class PointForce(Load):
    """A force of fixed direction at a point.

        force history(t)

    {type: point_force, at: beam.right, force: [0, -5 N], history: sin(10 * t)}
    """

    name: str
    at: fields.Place
    force: Annotated[Ground, fields.vector("N")]
    history: fields.History | None = None

    def push(self, draft: Draft) -> None:
        first = draft.probes.add(draft.layout.read(where(self), self.at))
        signal = draft.signal(self.history)
        force = vector(where(self), self.force, draft.layout.dim)
        point(where(self), draft, "force", self.at, force)
        draft.forces.dead(range(first, first + len(force)), force, signal)


@dataclass(frozen=True)
class Follower(Load):
    """A force that turns with a slope, [tangential, normal] in the plane, tangential in space; or
    with a frame, along its axes.

    {type: follower, at: beam.right, force: [0, 10 N]}
    """

    name: str
    at: fields.Place
    force: fields.FollowerForce
    history: fields.History | None = None

    def push(self, draft: Draft) -> None:
        layout = draft.layout
        axes = directions(layout.body(where(self), self.at), self.at.place)
        parts = vector(where(self), self.force, layout.dim if layout.dim == 2 or axes == 3 else 1)
        add_follower(where(self), draft, self.at, parts, draft.signal(self.history))
        point(
            where(self),
            draft,
            "force",
            self.at,
            parts @ basis(where(self), layout, self.at)[1][: len(parts)],
            self.at,
        )


def add_follower(name: str, draft: Draft, at: At, parts: np.ndarray, signal: int) -> None:
    """Add a force that turns with a place: parts (c,) along its slope and normal in the plane, (k,)
    along its directions in space [N].
    """
    layout = draft.layout
    position = draft.probes.add(layout.read(name, at))
    for k, numbers in enumerate(parts[:, None] if layout.dim == 3 else parts[None, :]):
        slope = draft.probes.add(layout.read(name, at, k + 1))
        rows = [first + c for first in (slope, position) for c in range(layout.dim)]
        draft.forces.act(f"follower_{layout.dim}", rows, numbers, [signal])


def add_following_moment(name: str, draft: Draft, at: At, parts: np.ndarray, signal: int) -> None:
    """Add a moment with parts m_k (3,) about the axes e_k of a frame, which turns with them.

    sum_k m_k e_k = sum_k m_k / 2 (e_i x e_j of force on e_i and e_j),    k, i, j cyclic
    """
    rows = [draft.probes.add(draft.layout.read(name, at, k + 1)) for k in range(3)]
    for k, size in enumerate(parts):
        i, j = rows[(k + 1) % 3], rows[(k + 2) % 3]
        if size:
            for along, on, sign in ((j, i, 1.0), (i, j, -1.0)):
                both = [first + c for first in (along, on) for c in range(3)]
                draft.forces.act("follower_3", both, [0.5 * sign * size], [signal])


@dataclass(frozen=True)
class Moment(Load):
    """A moment on a slope or frame: about z in the plane, a fixed vector in space (along a slope it
    does nothing).

    {type: moment, at: strip.right, moment: 2 N m}
    """

    name: str
    at: fields.Place
    moment: Spin
    history: fields.History | None = None

    def push(self, draft: Draft) -> None:
        push_moment(self, draft, self.moment)


@dataclass(frozen=True)
class Torque(Load):
    """A moment on a rigid frame: about z in the plane, a vector in space, in fixed directions or,
    as `follower`, about the axes of the frame, which turn with it.

    {type: torque, at: crank.frame, torque: 15 N m}
    """

    name: str
    at: fields.Place
    torque: Spin
    history: fields.History | None = None
    follower: bool = False

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if self.follower and dim == 2:
            yield "follower", Problem("no `follower` in the plane", "one", "about z it is the same")

    def push(self, draft: Draft) -> None:
        if not self.follower:
            return push_moment(self, draft, self.torque)
        layout = draft.layout
        axes = basis(where(self), layout, self.at)[1]
        if len(axes) != 3:
            got = f"{self.at}, which has no axes"
            raise InputError(say(where(self), "a frame, whose axes it follows", got))
        parts = vector(where(self), self.torque, 3)
        add_following_moment(where(self), draft, self.at, parts, draft.signal(self.history))
        point(where(self), draft, "moment", self.at, parts @ axes, self.at)


def warn_of_torsion(load: Moment | Torque, slope: np.ndarray, moment: np.ndarray) -> None:
    """A notice of the part of a moment (3,) [N m] about the line that it acts on, whose slope (3,)
    has no rotation about itself.

    That part does nothing; below `ALONG` of the moment it is round-off.
    """
    about = float(moment @ slope / np.linalg.norm(slope))
    if abs(about) > ALONG * np.linalg.norm(moment):
        notify(
            f"{where(load)}: {about:.4g} N m of the moment are about the line itself and do nothing: a cable has no torsion"
        )


def push_moment(load: Moment | Torque, draft: Draft, size: float | Ground) -> None:
    """Add a moment [N m] on the vectors that turn with a place: a number in the plane, (3,) in
    space.

        Q = P_t^T m x t / |t|^2 on a slope t,    Q = sum_k P_k^T m/2 x e_k on axes e_k of a frame

    Axes of a frame share it. InputError where the place has neither a slope nor a frame.
    """
    layout = draft.layout
    given = size if layout.dim == 3 or np.ndim(size) else [size]
    moment = vector(where(load), given, 1 if layout.dim == 2 else 3)
    axes = directions(layout.body(where(load), load.at), load.at.place)
    if axes == 2 and layout.dim == 3:
        raise InputError(
            say(
                where(load),
                "a slope or a frame",
                f"{load.at} on a surface",
                "name a rigid frame of the plate",
            )
        )
    turn = np.array([moment[0], 0.0]) if layout.dim == 2 else moment
    if axes == 1 and layout.dim == 3:
        warn_of_torsion(load, layout.reference(where(load), load.at, 1), moment)
    point(where(load), draft, "moment", load.at, turn)
    add_moment(where(load), draft, load.at, moment, draft.signal(load.history))


def add_moment(name: str, draft: Draft, at: At, moment: np.ndarray, signal: int) -> None:
    """Add a moment of fixed direction, (1,) about z in the plane, (3,) in space, on the slope or the
    axes of a place.
    """
    layout = draft.layout
    axes = max(directions(layout.body(name, at), at.place), 1)
    for k in range(axes):
        first = draft.probes.add(layout.read(name, at, k + 1))
        rows = range(first, first + layout.dim)
        draft.forces.act(f"moment_{layout.dim}", rows, moment / min(axes, 2), [signal])


@dataclass(frozen=True)
class TorsionSpring(Load):
    """Torque about z, in space about `axis`, against `to` or the ground.

        - stiffness (theta - rest_angle) - damping dtheta/dt

    In space `to` carries the axis, which is that of the reference. theta is the angle turned since
    the reference, its turns counted: of less than half a turn a step.

    {type: torsion_spring, at: lid.frame, stiffness: 3 N m/rad, damping: 0.1 N m s/rad}
    """

    name: str
    at: fields.Place
    to: fields.Carrier = None
    stiffness: Annotated[float, fields.quantity("N m/rad", ">= 0")] = 0.0
    damping: Annotated[float, fields.quantity("N m s/rad", ">= 0")] = 0.0
    rest_angle: Annotated[float, fields.quantity("rad")] = 0.0
    axis: fields.Axis | None = None
    resists: ClassVar[bool] = True
    strengths: ClassVar[tuple[str, ...]] = ("stiffness", "damping")

    @property
    def rests(self) -> bool:
        return self.rest_angle == 0.0

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_axis(self.axis, dim)

    def push(self, draft: Draft) -> None:
        for name, value in (("stiffness", self.stiffness), ("damping", self.damping)):
            if not (np.isfinite(value) and value >= 0):
                raise InputError(
                    say(f"{where(self)}.{name}", "a number that is not negative", value)
                )
        gauge, coordinate = responses.angle_between(draft, where(self), self.at, self.to, self.axis)
        gauge = draft.gauges[self.name] = replace(gauge, free=self.rest_angle)
        draft.forces.act(
            TORSION[coordinate], gauge.rows, (self.stiffness, self.damping, self.rest_angle)
        )


@dataclass(frozen=True)
class SurfaceLoad(Load):
    """A force per area of the reference surface [N/m2] on a plate, shell or solid, or on named faces
    of it.

    {type: surface_load, body: roof, force: [0, 0, -90 Pa]}
    """

    name: str
    body: fields.Body
    force: Annotated[Ground, fields.vector("Pa")]
    history: fields.History | None = None
    faces: fields.Names = ()

    def push(self, draft: Draft) -> None:
        part, shape = edges.shape_of(where(self), draft, self.body)
        cells = edges.chosen(where(self), shape, self.faces)
        force = vector(where(self), self.force, draft.layout.dim)
        push_whole(self, draft, edges.surface_weights(part, shape, cells, False) * force)
        show_spread(
            self, draft, edges.sensed(draft, part, shape, *edges.middles(shape, cells)), force
        )


@dataclass(frozen=True)
class Pressure(Load):
    """A pressure along the normal of the reference surface on a plate or shell in space, or on
    named faces of it. On the boundary of a solid it presses, against the outward normal.

    With `follower` it is constant, and keeps the direction and the area of the deformed surface.

    {type: pressure, body: shell, pressure: 2 kPa, follower: true}
    """

    name: str
    body: fields.Body
    pressure: Annotated[float, fields.quantity("Pa")]
    history: fields.History | None = None
    faces: fields.Names = ()
    follower: bool = False

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if dim == 2:
            yield (
                "",
                Problem(
                    "a pressure in a scene of dimension 3", "one of dimension 2", "use an edge_load"
                ),
            )
        if self.follower and self.history is not None:
            remedy = "a pressure that follows has none: take out one of the two"
            yield "follower", Problem("a constant pressure", "a history", remedy)

    def push(self, draft: Draft) -> None:
        part, shape = edges.shape_of(where(self), draft, self.body)
        cells = edges.chosen(where(self), shape, self.faces)
        if self.follower:
            found = pressure.surface_cells(part, shape, cells, finite(self, self.pressure))
            draft.forces.cells.append((where(self), part, found))
        else:
            push_whole(self, draft, self.pressure * edges.surface_weights(part, shape, cells, True))
        show_pressure(self, draft, part, shape, cells)


@dataclass(frozen=True)
class EdgeLoad(Load):
    """A force per length of named edges of a plate or shell in the reference [N/m].

    {type: edge_load, body: plate, edges: right, force: [0, 0, 4 N/m]}
    """

    name: str
    body: fields.Body
    edges: fields.Names
    force: Annotated[Ground, fields.vector("N/m")]
    history: fields.History | None = None

    def push(self, draft: Draft) -> None:
        part, shape = edges.shape_of(where(self), draft, self.body)
        sides = edge(where(self), shape, self.edges)
        force = vector(where(self), self.force, draft.layout.dim)
        push_whole(self, draft, edges.edge_weights(part, shape, sides) * force)
        show_spread(
            self, draft, edges.sensed(draft, part, shape, *edges.middles(shape, sides)), force
        )


@dataclass(frozen=True)
class NormalEdgeLoad(Load):
    """A constant force per length [N/m] of named edges of a planar plate along their outward
    normal, which turns with them.

    {type: normal_edge_load, body: plate, edges: top, force: -3 kN/m}
    """

    name: str
    body: fields.Body
    edges: fields.Names
    force: Annotated[float, fields.quantity("N/m")]

    def push(self, draft: Draft) -> None:
        part, shape = edges.shape_of(where(self), draft, self.body)
        if draft.layout.dim == 3:
            remedy = "an edge in space has no normal; use an edge load"
            raise InputError(say(where(self), "a planar scene", "a spatial one", remedy))
        sides = edge(where(self), shape, self.edges)
        found = pressure.edge_cells(part, shape, sides, finite(self, self.force))
        draft.forces.cells.append((where(self), part, found))
        places = edges.sensed(draft, part, shape, *edges.middles(shape, sides))
        aims = edges.outward(draft, part, shape, sides, self.force)
        draft.markers += [
            (self.name, "force", tuple(rows)) for rows in np.hstack([places, aims]).tolist()
        ]


def show_spread(
    load: SurfaceLoad | EdgeLoad | Pressure, draft: Draft, places: np.ndarray, force: np.ndarray
) -> None:
    """Let pictures show a force (c,) at several places, whose sensor rows are (x, c)."""
    aim = draft.sensors.add(csr_array((len(force), draft.layout.size)), force) + np.arange(
        len(force)
    )
    draft.markers += [(load.name, "force", (*place.tolist(), *aim.tolist())) for place in places]


def show_pressure(
    load: Pressure, draft: Draft, part: Body, shape: Surface, cells: np.ndarray
) -> None:
    """Let pictures show a pressure on cells (i,): along the normal, by tangents that are read, or
    along that of the reference.
    """
    cell, xi = edges.middles(shape, cells)
    places = edges.sensed(draft, part, shape, cell, xi)
    if load.follower:
        tangents = [
            edges.sensed(draft, part, shape, cell, xi, k, factor)
            for k, factor in ((1, load.pressure), (2, 1.0))
        ]
        draft.markers += [
            (load.name, "pressure", tuple(rows)) for rows in np.hstack([places, *tangents]).tolist()
        ]
        return
    first, second = (
        np.asarray(surface.sample(shape, cell, xi, k) @ part.shape_reference) for k in (1, 2)
    )
    for place, normal in zip(places, load.pressure * np.cross(first, second), strict=True):
        show_spread(load, draft, place[None], normal)


def finite(load: Load, size: float) -> float:
    """A number of a load as it is; InputError where it is not finite."""
    if not np.isfinite(size):
        raise InputError(say(where(load), "a finite number", size))
    return size


def push_whole(load: Any, draft: Draft, values: np.ndarray) -> None:
    """Add one probe row that holds all nodal forces (b, c) [N] of a load on a plate or shell, times
    its history.

        sum_bc values_bc q_bc

    is the row, its force 1. InputError where a value is not finite.
    """
    if not np.isfinite(values).all():
        raise InputError(say(where(load), "finite numbers", "others"))
    row = draft.probes.add(draft.layout.widen(load.body, csr_array(values.reshape(1, -1))))
    draft.forces.dead([row], [1.0], draft.signal(load.history))
