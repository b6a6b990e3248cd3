r"""Constraint functions of joints: positions, and vectors that bodies carry along, as polynomials
in probe rows.

    r_a - r_b = 0            u_a . w_b = 0            n_b . (r_a - r_b) = s

A place carries a vector u as the combination of its own vectors v_k that equals u in the reference:
axes e_k of a frame or rigid body, the slope t of a line (in the plane also its normal), tangents of
a surface. The ground carries every vector.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import csr_array, vstack

from ...bodies.body import Body, extent, positions
from ...core.algebra import ranks
from ...core.declared import Declared
from ...core.errors import InputError, say
from ...core.notices import notify
from ...core.values.fields import AXES
from ...core.values.problems import Problem
from ..measures.resultants import Resultant
from ..places import QUARTER, At, Coordinates, Draft, Ground, directions, vector

Vector: TypeAlias = int | np.ndarray  #: first of c probe rows, or a fixed vector (c,)
Term: TypeAlias = tuple[float, int, int, int]  #: coefficient, signal, i, j
End: TypeAlias = At | Ground | None  #: None and fixed points belong to the ground
ALONG = 1e-9  #: sine of an angle that counts as zero
#: gaps, relative to the size of the bodies, that joints close: with a notice, without one
CLOSE, FINE = (
    1e-6,
    1e-9,
)
#: markers that are drawn from one place to the other, or to all others
LINKS = (
    "spring",
    "line",
    "outline",
    "plane",
)
#: markers that are a place, but for gravity, and a direction, of pressures two tangents
ARROWS = ("force", "moment", "gravity", "axis", "pressure")
ROUND = 64 * float(np.finfo(np.float64).eps)  #: of the coordinates, in gaps


class Joint(Declared, ABC):
    """A joint: a frozen dataclass with a name, see `core.declared`, which adds constraint rows.

        Phi(q, t) = 0

    `check_joint` tests one.
    """

    name: str

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates that it brings, none of most joints."""
        return ()

    @property
    def share_basis(self) -> tuple[str, ...]:
        """Bodies that are one component unless components are given: their ties are more than two
        bases have modes.
        """
        return ()

    def unknowns(self, layout: Coordinates) -> Iterable[Body]:
        """Its own `coordinates`, behind those of the bodies: parts without positions and without
        mass.

        InputError, with the name of the joint, where it does not fit the bodies.
        """
        return ()

    @abstractmethod
    def constrain(self, draft: Draft) -> None:
        """Add the joint's probe rows and constraint terms to the draft.

        InputError, with the name of the joint, where its fields do not fit the bodies.
        """


def needs_axis(axis: Ground | None, dim: int) -> Iterator[tuple[str, Problem]]:
    """The problem of what turns in space (`dim` 3) without an axis; none in the plane."""
    if dim == 3 and axis is None:
        yield (
            "axis",
            Problem("the axis of rotation in space", "nothing", "write for instance [0, 0, 1]"),
        )
    elif axis is not None and len(axis) != 3:
        yield "axis", Problem("an axis of 3 numbers", f"{len(axis)} of them")


def needs_other_side(to: At | Ground | None) -> Iterator[tuple[str, Problem]]:
    """The problem of what keeps a distance and has no other side."""
    if to is None:
        yield (
            "to",
            Problem(
                "a place or the coordinates of a fixed point",
                "ground",
                "write for instance [0, 0, 1]",
            ),
        )


def where(joint: Any) -> str:
    """How messages name a joint."""
    return f"joint '{joint.name}'"


def mark(joint: Any, draft: Draft, kind: str, *ends: End) -> None:
    """Let pictures show the joint as a marker of a kind at the given ends: places, and of `LINKS`
    fixed points (c,) [m] as well.
    """
    if not draft.pictured:
        return
    rows: list[int] = []
    for end in ends:
        if isinstance(end, At):
            first = draft.sensors.add(draft.layout.read(where(joint), end))
        elif end is not None and kind in LINKS:
            first = draft.sensors.add(
                csr_array((draft.layout.dim, draft.layout.size)), np.asarray(end, float)
            )
        else:
            continue
        rows += range(first, first + draft.layout.dim)
    draft.markers.append((joint.name, kind, tuple(rows)))


def point(
    name: str, draft: Draft, kind: str, at: At | None, direction: np.ndarray, *carriers: End
) -> None:
    """Let pictures show a direction (c,) at a place: as the first of the carriers that can takes it
    along, or fixed without any.

    It may have any length, 0 included, and be a force or a moment itself, (M, 0) in the plane: the
    rows of a family of systems are polynomials of a force then, wherever it points.
    """
    if not draft.pictured:
        return
    layout = draft.layout
    first = []
    if at is not None:
        first.append(draft.sensors.add(layout.read(name, at)))
    taken = next(
        (
            end
            for end in carriers
            if not isinstance(end, At) or carries(name, layout, end, direction)
        ),
        None,
    )
    if isinstance(taken, At):
        first.append(draft.sensors.add(rows_of(name, layout, taken, direction)))
    else:
        first.append(draft.sensors.add(csr_array((layout.dim, layout.size)), direction))
    draft.markers.append((name, kind, tuple(row + c for row in first for c in range(layout.dim))))


def fixed(joint: Any, draft: Draft, at: At, target: np.ndarray) -> None:
    """Rows that hold a place at a point (c,) from the origin of the coordinates.

        r - target = 0    [m]

    c of them.
    """
    first = draft.probes.add(draft.layout.read(where(joint), at))
    for c in range(draft.layout.dim):
        draft.constraints.row(
            joint.name, AXES[c], (1.0, -1, first + c, -1), (-float(target[c]), -1, -1, -1)
        )


def joined(joint: Any, draft: Draft, at: At, to: At) -> None:
    """Rows that hold two places together.

        r_a - r_b = 0    [m]

    c of them.
    """
    layout = draft.layout
    first = draft.probes.add(layout.read(where(joint), at) - layout.read(where(joint), to))
    for c in range(layout.dim):
        draft.constraints.row(joint.name, AXES[c], (1.0, -1, first + c, -1))


def coincide(joint: Any, draft: Draft, at: At, to: End) -> None:
    """Rows of equal positions; `to` None: of the position in the reference.

        r_at - r_to = 0    [m]

    InputError where the places are apart in the reference, see `check_meeting`.
    """
    reference = draft.layout.reference(where(joint), at)
    target = reference if to is None else draft.layout.reference(where(joint), to)
    check_meeting(joint, draft.layout, at, to, np.stack([reference, target]))
    if isinstance(to, At):
        return joined(joint, draft, at, to)
    fixed(joint, draft, at, target)


def check_meeting(joint: Any, layout: Coordinates, at: At, to: End, points: np.ndarray) -> None:
    """Places that a joint puts together, points (2, c), are at one point in the reference.

    A gap above CLOSE of the size of the bodies is refused, one that rounded coordinates leave is
    closed with a notice.
    """
    apart = float(np.linalg.norm(points[1] - points[0]))
    size = size_of(layout, {end.body for end in (at, to) if isinstance(end, At)})
    points = points + layout.origin
    exact = ROUND * float(np.abs(points).max())
    other = (
        str(to)
        if isinstance(to, At)
        else f"the fixed point ({', '.join(f'{x:g}' for x in points[1])})"
    )
    if apart > CLOSE * size + exact:
        remedy = (
            "move a body, or use a distance"
            if isinstance(to, At)
            else "move the body or the point, or leave 'to' out"
        )
        raise InputError(
            say(where(joint), f"{at} and {other} at one point", f"a gap of {apart:.6g} m", remedy)
        )
    if apart > FINE * size + exact:
        notify(
            f"{where(joint)} closes a gap of {apart:.3g} m between {at} and {other}: give their coordinates more digits"
        )


def size_of(layout: Coordinates, names: set[str]) -> float:
    """Size of the largest of some bodies [m], or, where those are points, of all bodies or of what
    these reach over.
    """
    own = max(extent(layout.bodies[name]) for name in names)
    if own:
        return own
    points = np.concatenate([positions(part) for part in layout.bodies.values()])
    return max(*map(extent, layout.bodies.values()), float(np.linalg.norm(np.ptp(points, axis=0))))


def unit(place: str, values: object, size: int) -> np.ndarray:
    """A direction (size,) of length 1.

        d / |d|

    InputError, after `place`, for another number of values, zeros alone, or values that are not
    finite.
    """
    direction = vector(place, values, size)
    length = float(np.linalg.norm(direction))
    if not length > 0:
        raise InputError(say(place, "a non-zero vector", values))
    return direction / length


def normals(direction: np.ndarray) -> np.ndarray:
    """Unit vectors normal to a direction (c,) and to one another, (c - 1, c); in the plane the
    direction turned by 90 degrees.
    """
    if len(direction) == 2:
        return (QUARTER @ direction)[None, :]
    return np.asarray(np.linalg.svd(direction[None, :])[2][1:])


def basis(name: str, layout: Coordinates, end: At) -> tuple[list[csr_array], np.ndarray]:
    """Vectors that a place carries: rows (c, q) of each, k of them, and their reference values (k,
    c).

    They are the axes of a frame or rigid body, tangents of a surface, the slope of a line (in the
    plane also its normal).
    """
    rows = layout.vectors(name, end)
    count = directions(layout.body(name, end), end.place)
    own = [layout.reference(name, end, k + 1) for k in range(count)]
    if len(rows) > count:
        own.append(QUARTER @ own[0])
    return rows, np.array(own).reshape(len(rows), layout.dim)


def carries(name: str, layout: Coordinates, end: End, direction: np.ndarray) -> bool:
    """Whether a place carries a vector (c,), as a combination of its own ones; the ground carries
    all.
    """
    if not isinstance(end, At):
        return True
    own = basis(name, layout, end)[1]
    rest = direction - own.T @ np.linalg.lstsq(own.T, direction)[0] if len(own) else direction
    return bool(np.linalg.norm(rest) <= ALONG * np.linalg.norm(direction))


def rows_of(name: str, layout: Coordinates, end: At, direction: np.ndarray) -> csr_array:
    """Rows (c, q) of a vector (c,) that a place carries: the combination of its own ones that
    equals it in the reference.

    InputError, after `name`, where the place does not carry it.
    """
    rows, own = basis(name, layout, end)
    if not carries(name, layout, end, direction):
        kind = ("a mere point", "a slope", "two tangents", "three axes")[len(own)]
        remedy = "name a rigid frame"
        raise InputError(
            say(
                name,
                f"a place that carries the direction {np.round(direction, 6)}",
                f"{end} with {kind}",
                remedy,
            )
        )
    parts = zip(np.linalg.lstsq(own.T, direction)[0], rows, strict=True)
    return csr_array(
        sum(
            (float(factor) * row for factor, row in parts if abs(factor) > 1e-14),
            csr_array(rows[0].shape),
        )
    )


def carried(joint: Any, draft: Draft, end: End, direction: np.ndarray) -> Vector:
    """The first of c probe rows of a vector (c,) that an end carries along; on the ground the
    vector itself.

    InputError where the place does not carry it.
    """
    if not isinstance(end, At):
        return direction
    return draft.probes.add(rows_of(where(joint), draft.layout, end, direction))


def dot(u: Vector, w: Vector, dim: int, factor: float = 1.0, signal: int = -1) -> list[Term]:
    """Terms (coefficient, signal, i, j) of a scalar product.

        factor s(t) u . w

    u and w are the first of c = `dim` probe rows, or fixed vectors (c,); `signal` is the number of
    s, -1 for 1.
    """
    if isinstance(u, np.ndarray):
        if isinstance(w, np.ndarray):
            return [(factor * float(u @ w), signal, -1, -1)]
        return [(factor * float(u[c]), signal, w + c, -1) for c in range(dim)]
    if isinstance(w, np.ndarray):
        return [(factor * float(w[c]), signal, u + c, -1) for c in range(dim)]
    return [(factor, signal, u + c, w + c) for c in range(dim)]


def far(first: int, dim: int, length: float) -> list[Term]:
    """Terms of the distance l = `length` [m] of the probe rows u (dim,) from `first` on.

        (|u|^2 - l^2) / (2 l) = 0    [m]

    Its derivative by u is u / l: the multiplier is the force along u [N].
    """
    return [(0.5 / length, -1, first + c, first + c) for c in range(dim)] + [
        (-0.5 * length, -1, -1, -1)
    ]


def sorted_ends(joint: Any, draft: Draft, at: At, to: End) -> tuple[End, End]:
    """The end that carries every vector, and the other one."""
    name = where(joint)
    layout = draft.layout
    for full, other in ((to, at), (at, to)):
        if not isinstance(full, At) or ranks.rank(basis(name, layout, full)[1]) == layout.dim:
            return full, other
    raise InputError(
        say(name, "a rigid frame or the ground at one end", f"{at} and {to}", "name a frame")
    )


def pushed(at: At, full: End, u: np.ndarray, n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vectors (c,) whose product is the axis of the moment on `at` of a row u . n = 0, where the
    end `full` carries n.
    """
    return (n, u) if full is at else (u, n)


def parallel(joint: Any, draft: Draft, at: At, to: End, axis: np.ndarray) -> None:
    """Rows by which the axis (c,), as one end carries it, stays parallel to that of the other.

        u . n_i = 0,    u the axis of one end, n_i the c - 1 normals to it that the other end carries

    Of an end with a slope alone that is normal to the axis, the slope stays normal to it: one row.
    InputError where no end has axes in all directions, or one does not carry its vector.
    """
    name = where(joint)
    layout = draft.layout
    full, other = sorted_ends(joint, draft, at, to)
    if not carries(name, layout, other, axis):
        own = basis(name, layout, other)[1] if isinstance(other, At) else np.eye(layout.dim)
        if len(own) == 1 and abs(float(own[0] @ axis)) < ALONG:
            terms = dot(
                carried(joint, draft, other, own[0]), carried(joint, draft, full, axis), layout.dim
            )
            return draft.constraints.row(
                joint.name, "axis 1", *terms, about=pushed(at, full, own[0], axis)
            )
    u = carried(joint, draft, other, axis)
    for k, normal in enumerate(normals(axis)):
        terms = dot(u, carried(joint, draft, full, normal), layout.dim)
        draft.constraints.row(
            joint.name, f"axis {k + 1}", *terms, about=pushed(at, full, axis, normal)
        )


def locked(joint: Any, draft: Draft, at: At, to: End) -> None:
    """No relative rotation, by a direction u of one end and its normals on the other.

        u . n_i = 0,    and n_1 . n_2 = 0 in space

    The slope of a line is held in direction only: its stretch is free, and it carries no torsion.
    """
    name = where(joint)
    layout = draft.layout
    full, other = sorted_ends(joint, draft, at, to)
    own = basis(name, layout, other)[1] if isinstance(other, At) else np.eye(layout.dim)
    if not len(own):
        raise InputError(
            say(name, "a place with a direction", f"{other}, a mere point", "use a pin")
        )
    first = own[0] / np.linalg.norm(own[0])
    u = carried(joint, draft, other, first)
    if layout.dim == 2:
        normal = np.array([-first[1], first[0]])
        terms = dot(u, carried(joint, draft, full, normal), 2)
        return draft.constraints.row(
            joint.name, "angle", *terms, about=pushed(at, full, first, normal)
        )
    second = normals(first)[0] if len(own) == 1 else own[1] - first * float(first @ own[1])
    second = second / np.linalg.norm(second)
    both = (second, np.cross(first, second))
    across = [carried(joint, draft, full, n) for n in both]
    for k, n in enumerate(across):
        draft.constraints.row(
            joint.name, f"angle {k + 1}", *dot(u, n, 3), about=pushed(at, full, first, both[k])
        )
    if len(own) > 1:
        terms = dot(carried(joint, draft, other, second), across[1], 3)
        draft.constraints.row(
            joint.name, "angle 3", *terms, about=pushed(at, full, second, both[1])
        )


def tied(joint: Any, draft: Draft, at: At, to: End) -> None:
    """Rows by which positions and all three vectors of two places are tied, or those of one to the
    reference: of beams.

        r_a = r_b,   a_i = sum_j c_ij b_j,   c_ij constant

    All are linear, and the section stays as rigid as its beam holds it; the reaction is a force and
    a moment about the place.
    """
    name = where(joint)
    layout = draft.layout
    coincide(joint, draft, at, to)
    rows, own = basis(name, layout, at)
    others, theirs = basis(name, layout, to) if isinstance(to, At) else ([], np.zeros((0, 3)))
    target = np.zeros_like(own) if others else own
    factors = np.linalg.solve(theirs.T, own.T).T if others else np.zeros((3, 0))
    for k, row in enumerate(rows):
        apart = csr_array(
            row
            - sum(
                (f * other for f, other in zip(factors[k], others, strict=True)),
                csr_array(row.shape),
            )
        )
        first = draft.probes.add(apart)
        for c in range(3):
            draft.constraints.row(
                joint.name,
                f"e{k + 1} {AXES[c]}",
                (1.0, -1, first + c, -1),
                (-float(target[k, c]), -1, -1, -1),
            )
    arms = csr_array(
        vstack([csr_array((9, layout.size)), *(csr_array(vstack([row] * 3)) for row in rows)])
    )
    axes = np.tile(np.arange(3), 4)
    parts = np.repeat([1.0, 0.0, 0.0, 0.0], 3)
    draft.constraints.resultants[joint.name] = Resultant(arms, axes, parts, np.zeros(3))


def guided(joint: Any, draft: Draft, at: At, to: At | None, direction: np.ndarray) -> None:
    """Rows that guide a place along a direction (c,), by its c - 1 normals n_i, which move with the
    end `to`.

        n_i . (r_at - r_to) = const    [m]

    Values are those of the reference; to None: normals are fixed. InputError where `to` does not
    carry them.
    """
    name = where(joint)
    layout = draft.layout
    rows = layout.read(name, at)
    apart = layout.reference(name, at)
    if to is not None:
        rows, apart = rows - layout.read(name, to), apart - layout.reference(name, to)
    first = draft.probes.add(csr_array(rows))
    for k, normal in enumerate(normals(direction)):
        terms = dot(first, carried(joint, draft, to, normal), layout.dim)
        draft.constraints.row(
            joint.name,
            f"normal {k + 1}",
            *terms,
            (-float(normal @ apart), -1, -1, -1),
            along=normal,
        )


def arm(
    name: str, layout: Coordinates, at: At, axis: Ground | None, wanted: np.ndarray | None = None
) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Rows (2, q) whose argument is the angle turned about an axis of the ground, a direction u
    normal to it, and axis x u.

    In the plane the axis is z; in space u is the first direction normal to the axis that the place
    carries, or the wanted one (3,) of a frame.
    """
    own = basis(name, layout, at)[1]
    if not len(own):
        raise InputError(
            say(name, "a place with a direction", f"{at}, a mere point", "name a rigid frame")
        )
    if layout.dim == 2:
        u = own[0] / np.linalg.norm(own[0])
        normal = np.array([-u[1], u[0]])
    else:
        a = unit(f"{name}, axis", (0.0, 0.0, 0.0) if axis is None else axis, 3)
        if len(own) == 1:
            u = own[0]
        else:
            u = normals(own @ a)[0] @ own if wanted is None or len(own) < 3 else wanted
        u = u / np.linalg.norm(u)
        if abs(float(u @ a)) > ALONG:
            raise InputError(
                say(name, "a place with a direction normal to the axis", at, "name a rigid frame")
            )
        normal = np.cross(a, u)
    return csr_array(csr_array(np.stack([u, normal])) @ rows_of(name, layout, at, u)), u, normal
