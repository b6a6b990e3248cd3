r"""Contact of places, nodes, beams and plates with shapes: planes, spheres, cylinders, boxes,
height fields.

    floor: {type: contact_plane, body: hoop, point: [0 m, 0 m], normal: [0, 1], friction: 0.4}

What touches is one place (`at`) or a whole body (`body`): points along a beam with its radius,
points of a plate with half its thickness, in the plane of its edges, the places of a rigid body.
The shape stands still, or is carried by a place (`on`), with whose axes it turns. Forces are those
of `contact_forces`; where nothing is said of them,

    d = L / PRESSED,  k = m g / d     the weight m g of what touches would press one point in by d; L its size, g = 9.81 m/s2
    kt = k,  ct = sqrt(kt m / t)  so that what sticks comes to rest, t the number of points

Points of beams and plates stand so close that the shape does not pass between them: what is round
of a radius r is missed by 3 % of r and the radius of the body together; too few `points` are
refused.

A line carries its thickness along in the plane, and a beam with directors in space: friction turns
its sections. On a cable in space it acts on the centre line. Steps in which forces begin or end are
divided, by up to 64, until the change of N in one changes no speed by more than resolution^2 times
the largest so far: a mass that vibrates on the contact moves on by about `resolution` radians a
step.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.fields import whole
from ..core.values.problems import Problem
from ..systems import fields
from ..systems.connections.constraint_functions import needs_axis, normals, size_of, unit
from ..systems.forces.loads import Load, where
from ..systems.places import At, Draft, Gauge, Ground, vector
from . import shapes as contact_shapes
from .facet_points import facet_gaps, facets
from .forces import ContactForces
from .law import LAW
from .outlines import mark_outline
from .points import carrier_rows, find_points, overlaps

# a body of 1 m vibrates on such a contact by sqrt(1e4 g / L) = 313 rad/s; half of it lets things
# sink in twice as deep, twice of it asks for steps 0.7 times as long
#: size of the bodies over the depth to which their weight presses one point in, by default
PRESSED = 1e4
GRAVITY = 9.81  #: [m/s2]
CLEAR = 1e-9  #: overlap at the start, over the size of the bodies, that is round-off

Length = Annotated[float, fields.quantity("m", "> 0")]
Stiffness = Annotated[float, fields.quantity("N/m", "> 0")]
Damping = Annotated[float, fields.quantity("N s/m", ">= 0")]


@dataclass(frozen=True)
class ContactGauge(Gauge):
    """What a contact measures."""

    terms: tuple[Any, ...]  #: ContactForces, FacetContacts or BeamContacts


@dataclass(frozen=True)
class Shape:
    """A shape in the reference, see `contact_shapes`."""

    kind: int
    sizes: Sequence[float]
    origin: np.ndarray | None  #: (c,) in the scene [m]; None for the place that carries it
    axes: np.ndarray  #: (c, c)
    heights: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  #: (i, j) on the grid [m]


@dataclass(frozen=True)
class Touch(Load, ABC):
    """The law of the forces of a contact."""

    name: str
    stiffness: Stiffness | None = None
    damping: Damping = 0.0
    dissipation: Annotated[float, fields.quantity("s/m", ">= 0"), "of Hunt and Crossley"] = 0.0
    smoothing: Annotated[
        float, fields.quantity("m", ">= 0"), "over which it begins, 0 for at once"
    ] = 0.0
    exponent: Annotated[
        float, fields.quantity("", ">= 1"), "of the overlap, 1.5 for spheres of Hertz"
    ] = 1.0
    depth: Annotated[
        Length | None, "overlap at which the force is stiffness times overlap, with an exponent"
    ] = None
    cut: Annotated[bool, "whether it never pulls"] = True
    friction: Annotated[float, fields.quantity("", ">= 0"), "coefficient of Coulomb"] = 0.0
    sticking: Annotated[Stiffness | None, "of what sticks"] = None
    sticking_damping: Annotated[Damping | None, "of what sticks"] = None
    resolution: Annotated[
        float,
        fields.quantity("", ">= 0"),
        "radians of its vibration per divided step; with 0 only steps that would jump through a thin body are divided",
    ] = 0.05
    shared: Annotated[
        bool,
        "whether stiffness and damping are those of the whole body, of which points have shares",
    ] = False
    resists: ClassVar[bool] = True

    def unread(self, dim: int) -> Iterator[tuple[str, str]]:
        for key in ("sticking", "sticking_damping"):
            if self.friction == 0.0 and getattr(self, key) is not None:
                yield key, "does nothing without friction"
        if self.exponent == 1.0 and self.depth is not None:
            yield "depth", "does nothing without an exponent"

    def weights(self, shares: np.ndarray, count: int) -> np.ndarray:
        """Factors (t,) of the law of so many points with shares (t,) in a body, none of places."""
        if self.shared and not len(shares):
            raise InputError(
                say(
                    f"{where(self)}.shared",
                    "points all over a beam or a plate, or beams along one another",
                    "others",
                    "leave it out",
                )
            )
        return shares if self.shared else np.ones(count)

    def law(self, size: float, mass: float, count: int) -> np.ndarray:
        """Numbers in the order of `contact_law.LAW`, for bodies of a size [m] of which a mass [kg]
        touches in so many points.
        """
        k = self.stiffness
        if k is None and not size > 0.0:
            raise InputError(
                say(
                    f"{where(self)}.stiffness",
                    "a stiffness, as points have no size to choose it by",
                    "none",
                )
            )
        k = PRESSED * mass * GRAVITY / size if k is None else k
        kt = k if self.sticking is None else self.sticking
        ct = (
            float(np.sqrt(kt * mass / (1 if self.shared else count)))
            if self.sticking_damping is None
            else self.sticking_damping
        )
        numbers = (
            k,
            self.damping,
            self.dissipation,
            self.smoothing,
            float(self.cut),
            self.friction,
            kt,
            ct,
        )
        for key, value in zip(LAW, numbers, strict=True):
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(
                    say(f"{where(self)}.{key}", "a number that is not negative", value)
                )
        return np.array(numbers)

    def power(self, size: float) -> np.ndarray:
        """Numbers in the order of `contact_law.POWER`, for bodies of a size [m]."""
        linear = self.exponent == 1.0
        depth = size / PRESSED if self.depth is None else self.depth
        if (self.depth is None) != (linear or self.stiffness is None):
            expected = (
                "no depth without an exponent"
                if linear
                else "stiffness and depth, at which it holds, or neither"
            )
            remedy = "of spheres of Hertz the depth is their radius R where stiffness is 4/3 E* R"
            raise InputError(
                say(
                    f"{where(self)}.depth",
                    expected,
                    "one alone" if self.depth is None else depth,
                    remedy,
                )
            )
        if not (1.0 <= self.exponent < np.inf and (linear or 0.0 < depth < np.inf)):
            raise InputError(
                say(
                    f"{where(self)}.exponent",
                    "an exponent from 1 on and a depth > 0",
                    (self.exponent, depth),
                )
            )
        return np.ones(2) if linear else np.array([self.exponent, depth])

    def share(self, mass: float) -> float:
        """Change of speed that a change of force makes in a second, over the one allowed a step.

            1 / (mass resolution^2)

        0 where no step is divided.
        """
        return 1.0 / (mass * self.resolution**2) if self.resolution else 0.0

    def tell_overlaps(self, gaps: np.ndarray, size: float, what: str, remedy: str) -> None:
        """A notice where gaps (t,) are negative by more than round-off of a size [m]."""
        if gaps.min() < -CLEAR * size:
            deep = -gaps.min()
            count = int(np.count_nonzero(gaps < 0.0))
            told = f"{where(self)}: {count} of {len(gaps)} points overlap {what} at the start, by up to {deep:.3g} m"
            notify(f"{told}: they are pushed apart; {remedy}")


@dataclass(frozen=True)
class Contact(Touch, ABC):
    """Contact with a shape: what touches, who carries the shape, and the law of the forces."""

    at: fields.Carrier = None
    body: fields.BodyName | None = None
    on: fields.Carrier = None
    points: Annotated[
        int | None,
        whole(1, 100_000),
        "along a beam, or parts of a side of plates' cells; as the shape needs",
    ] = None
    radius: Annotated[
        float | None,
        fields.quantity("m", ">= 0"),
        "of what touches, by default that of the section",
    ] = None
    overlap: Annotated[
        Literal["push", "keep"], "at the start: pushed apart, or gaps count from there"
    ] = "push"

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if (self.at is None) == (self.body is None):
            yield (
                "at",
                Problem("one place (at) or one body (body)", "both" if self.at else "neither"),
            )

    @abstractmethod
    def shape(self, name: str, dim: int) -> Shape:
        """The shape in the reference, for messages about `name`."""

    def push(self, draft: Draft) -> None:
        name = where(self)
        dim = draft.layout.dim
        shape = self.shape(name, dim)
        round_as = contact_shapes.roundness(shape.kind, shape.sizes, shape.heights, dim)
        touching = find_points(
            name, draft, self.at, self.body, self.points, self.radius, round_as, self.friction > 0.0
        )
        placed = np.vstack([self.center_of(draft, shape) - draft.layout.origin, shape.axes])
        carriers = {self.on.body} if isinstance(self.on, At) else set[str]()
        size = size_of(draft.layout, {touching.body, *carriers})
        term = ContactForces(
            shape.kind,
            np.array(shape.sizes, dtype=float),
            shape.heights,
            placed,
            carrier_rows(name, draft, self.on, placed),
            touching.rows,
            touching.radius,
            self.law(size, touching.mass, len(touching.rows)),
            self.share(touching.mass),
            self.power(size),
            self.weights(touching.shares, len(touching.rows)),
            touching.beside,
        )
        gaps = overlaps(term, touching.places, placed)
        between = facets(name, draft, self.body, term)
        beside = [facet_gaps(draft, one) for one in between]
        if self.overlap == "keep":
            term = replace(term, radius=term.radius + np.minimum(gaps, 0.0))
            between = [
                replace(one, radius=one.radius + np.minimum(gap, 0.0))
                for one, gap in zip(between, beside, strict=True)
            ]
        else:
            reach = max(size, float(np.abs(touching.places - placed[0]).max()))
            self.tell_overlaps(
                np.concatenate([gaps, *beside]),
                reach,
                "the shape",
                "move the bodies, or write 'overlap: keep'",
            )
        draft.forces.terms += [term, *between]
        mark_outline(self.name, draft, term)
        draft.gauges[self.name] = ContactGauge("contact", (), 0.0, (term, *between))

    def center_of(self, draft: Draft, shape: Shape) -> np.ndarray:
        """The origin of the shape, by default the place that carries it."""
        if shape.origin is not None:
            return shape.origin
        if self.on is None:
            raise InputError(
                say(
                    where(self),
                    "the center of the shape, or a place that carries it",
                    "neither",
                    "give center or on",
                )
            )
        return draft.layout.reference(where(self), self.on) + draft.layout.origin


@dataclass(frozen=True)
class ContactPlane(Contact):
    """Contact with a plane through a point; bodies are where its normal points to.

    {type: contact_plane, body: hoop, point: [0, 0], normal: [0, 1], stiffness: 20 kN/m}
    """

    point: Annotated[Ground, fields.vector("m")] = field(kw_only=True)
    normal: fields.Direction = field(kw_only=True)

    def shape(self, name: str, dim: int) -> Shape:
        return Shape(
            contact_shapes.PLANE,
            (),
            vector(name, self.point, dim),
            upright(f"{name}.normal", self.normal, dim),
        )


@dataclass(frozen=True)
class Round(Contact, ABC):
    """Contact with what is round, from outside or inside; without a center it is around the place
    that carries it.
    """

    diameter: Length = field(kw_only=True)
    center: Annotated[Ground | None, fields.vector("m")] = None
    inside: Annotated[bool, "whether bodies are in it"] = False

    def sizes(self) -> tuple[float, float]:
        """Radius [m], and the direction of its normal."""
        return self.diameter / 2, -1.0 if self.inside else 1.0

    def origin(self, name: str, dim: int) -> np.ndarray | None:
        return None if self.center is None else vector(f"{name}.center", self.center, dim)


@dataclass(frozen=True)
class ContactSphere(Round):
    """Contact with a sphere, in the plane a circle.

    {type: contact_sphere, at: finger.right, on: ball, diameter: 60 mm, friction: 0.5}
    """

    def shape(self, name: str, dim: int) -> Shape:
        return Shape(contact_shapes.SPHERE, self.sizes(), self.origin(name, dim), np.eye(dim))


@dataclass(frozen=True)
class ContactCylinder(Round):
    """Contact with a cylinder, without end if it has no length, else with flat ends (none inside);
    in the plane a circle.

    {type: contact_cylinder, body: cable, center: [0, -0.3 m], diameter: 0.5 m, friction: 0.3}
    """

    axis: fields.Axis | None = None
    length: Length | None = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from super().problems(dim)
        yield from needs_axis(self.axis, dim)

    def unread(self, dim: int) -> Iterator[tuple[str, str]]:
        yield from super().unread(dim)
        if dim == 2 and self.length is not None:
            yield "length", "does nothing in the plane, where the cylinder is a circle"

    def shape(self, name: str, dim: int) -> Shape:
        half = contact_shapes.FAR if self.length is None else self.length / 2
        axes = np.eye(2) if self.axis is None else upright(f"{name}.axis", self.axis, dim)
        return Shape(contact_shapes.CYLINDER, (*self.sizes(), half), self.origin(name, dim), axes)


@dataclass(frozen=True)
class ContactBox(Contact):
    """Contact with a box from outside: its full sides, the first one along a direction, by default
    x.

    {type: contact_box, body: hoop, sides: [1 m, 0.2 m], center: [2 m, 0.1 m], friction: 0.4}
    """

    sides: Annotated[Ground, fields.vector("m")] = field(kw_only=True)
    center: Annotated[Ground | None, fields.vector("m")] = None
    along: fields.Direction | None = None
    across: Annotated[fields.Direction | None, "of the second side, in space"] = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from super().problems(dim)
        if min(self.sides) <= 0.0:
            yield "sides", Problem("lengths > 0", f"{min(self.sides):g}")
        if dim == 3 and (self.along is None) != (self.across is None):
            yield "across", Problem("directions of two sides, along and across", "one of them")

    def unread(self, dim: int) -> Iterator[tuple[str, str]]:
        yield from super().unread(dim)
        if dim == 2 and self.across is not None:
            yield "across", "does nothing in the plane, where 'along' says both sides"

    def shape(self, name: str, dim: int) -> Shape:
        axes = np.eye(dim)
        if self.along is not None:
            axes[0] = unit(f"{name}.along", self.along, dim)
            axes[1] = normals(axes[0])[0] if dim == 2 else unit(f"{name}.across", self.across, dim)
            if dim == 3:
                axes[1] = unit(f"{name}.across", axes[1] - (axes[1] @ axes[0]) * axes[0], dim)
                axes[2] = np.cross(axes[0], axes[1])
        origin = None if self.center is None else vector(f"{name}.center", self.center, dim)
        return Shape(
            contact_shapes.BOX, tuple(0.5 * vector(f"{name}.sides", self.sides, dim)), origin, axes
        )


@dataclass(frozen=True)
class ContactHeights(Contact):
    """Contact with heights over x and y, in the plane a profile over x, at steps from a corner on,
    smooth between them.

    {type: contact_heights, body: wheel, corner: [0, 0], step: [0.5 m], heights: [0 m, 0.1 m, 0 m]}
    """

    corner: Annotated[Ground, fields.vector("m")] = field(kw_only=True)
    step: tuple[Length, ...] = field(kw_only=True)
    heights: fields.Heights = field(kw_only=True)

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from super().problems(dim)
        expected = (
            "a list of two heights or more"
            if dim == 2
            else "two lists or more, each of as many heights, two or more"
        )
        if np.ndim(self.heights) != dim - 1 or min(np.shape(self.heights)) < 2:
            yield "heights", Problem(expected, "others")
        if len(self.step) != dim - 1:
            yield "step", Problem(f"a list of {dim - 1} lengths > 0", f"{self.step}")

    def shape(self, name: str, dim: int) -> Shape:
        heights = np.asarray(self.heights, dtype=float).reshape(len(self.heights), -1)
        return Shape(
            contact_shapes.HEIGHTS,
            self.step,
            vector(f"{name}.corner", self.corner, dim),
            np.eye(dim),
            heights,
        )


def upright(name: str, direction: object, dim: int) -> np.ndarray:
    """Axes (c, c), the last one along a direction."""
    last = unit(name, direction, dim)
    return np.vstack([normals(last), last[None, :]])
