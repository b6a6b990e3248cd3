r"""Loads: probe rows and forces.

    gravity       Q = M (1 x g)                         point force    Q = P^T f s(t)
    moment        Q = P_t^T s(t) m x t / |t|^2          follower       Q = P_r^T s(t) (f_t t + f_n n) / |t|
    on a frame    Q = sum_k P_k^T s(t) m/2 x e_k                       Q = P_r^T s(t) sum_k f_k e_k
    surface       Q = s(t) int N^T f dA                 pressure       Q = s(t) int N^T p n0 dA
    edge          Q = s(t) int N^T f ds                 spring         torque - k (theta - theta0) - d theta'
    following pressure   Q = p int N^T (r,1 x r,2) dA   following edge load   Q = f int N^T J^T r,s ds

with the slope t = dr/dS, its normal n (t turned by 90 degrees in the plane), axes e_k of a frame, the unit normal n0 of the
reference, and a history s(t), 1 by default. Power of m/2 on all axes: 1/2 sum_k (m x e_k) . (w x e_k) = m . w.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from ..bodies.body import Body, Cells
from ..bodies.plate import edge
from ..core.errors import InputError, say
from . import edges, pressure
from .gaps import arm
from .places import At, Draft, Ground, directions, vector
from .system import LoadKind, PointLaw, Signal


@dataclass(frozen=True)
class Gravity:
    """Uniform acceleration of all bodies (c,) [m/s2]."""

    acceleration: Ground


@dataclass(frozen=True)
class PointForce:
    """A force of fixed direction (c,) [N]."""

    name: str
    at: At
    force: Ground
    history: Signal | None = None


@dataclass(frozen=True)
class Follower:
    """A force [N] that turns with the slope: (tangential, normal) in the plane, tangential in space; (c,) along a frame's axes."""

    name: str
    at: At
    force: Ground
    history: Signal | None = None


@dataclass(frozen=True)
class Moment:
    """A moment [N m] on a slope or frame: about z in the plane, a fixed vector (3,) in space (along a slope it does nothing)."""

    name: str
    at: At
    moment: float | Ground
    history: Signal | None = None


@dataclass(frozen=True)
class SurfaceLoad:
    """Force per area of the reference surface (c,) [N/m2], on all of a plate or on named faces."""

    name: str
    body: str
    force: Ground
    history: Signal | None = None
    faces: tuple[str, ...] = ()


@dataclass(frozen=True)
class NormalPressure:
    """Dead pressure [Pa] along the normal n0 = r,1 x r,2 of the reference of a shell in space, or of named faces."""

    name: str
    body: str
    pressure: float
    history: Signal | None = None
    faces: tuple[str, ...] = ()


@dataclass(frozen=True)
class FollowerPressure:
    """Constant pressure [Pa] along the normal r,1 x r,2 of the deformed shell in space, on all of it or on named faces."""

    name: str
    body: str
    pressure: float
    faces: tuple[str, ...] = ()


@dataclass(frozen=True)
class FollowerEdgeLoad:
    """Constant force per length [N/m] of deformed edges of a planar plate, along their outward normal."""

    name: str
    body: str
    edges: tuple[str, ...]
    force: float


@dataclass(frozen=True)
class EdgeLoad:
    """Force per length of edges in the reference (c,) [N/m]."""

    name: str
    body: str
    edges: tuple[str, ...]
    force: Ground
    history: Signal | None = None


@dataclass(frozen=True)
class TorsionSpring:
    """Torque - k (theta - angle0) - d theta' about z, in space about `axis`, on `at` against `to` (None: the ground).

    theta is the angle turned since the reference, its turns counted (see `springs`). In space `to` is the ground.
    """

    name: str
    at: At
    to: At | None = None
    stiffness: float = 0.0  #: k [N m/rad]
    damping: float = 0.0  #: d [N m s/rad]
    angle0: float = 0.0  #: angle without torque [rad]
    axis: Ground | None = None


Load = (
    Gravity
    | PointForce
    | Follower
    | Moment
    | SurfaceLoad
    | NormalPressure
    | FollowerPressure
    | EdgeLoad
    | FollowerEdgeLoad
    | TorsionSpring
)
Force = tuple[list[tuple[int, float, int]], list[PointLaw]]  #: terms (probe row, coefficient, signal) and point laws


@singledispatch
def force(load: object, draft: Draft) -> Force:
    """Terms and laws of a load; the rule for every load type.

    Gravity has none: it is the constant M (1 x g). What follows a surface or an edge has none: it has cells, see `following`.
    """
    raise InputError(say("loads", "a load", type(load).__name__))


def history(draft: Draft, function: Signal | None) -> int:
    return -1 if function is None else draft.signal(function)


@force.register
def _(load: Gravity | FollowerPressure | FollowerEdgeLoad, draft: Draft) -> Force:
    return [], []


@force.register
def _(load: PointForce, draft: Draft) -> Force:
    where = f"load '{load.name}'"
    first, signal = draft.probes.add(draft.layout.read(where, load.at)), history(draft, load.history)
    return [(first + c, float(f), signal) for c, f in enumerate(vector(where, load.force, draft.layout.dim))], []


@force.register
def _(load: Follower, draft: Draft) -> Force:
    where, layout = f"load '{load.name}'", draft.layout
    axes = directions(layout.body(where, load.at), load.at.place)
    size = layout.dim if layout.dim == 2 or axes == 3 else 1
    parts = vector(where, load.force, size)
    position, signal = draft.probes.add(layout.read(where, load.at)), history(draft, load.history)

    def law(derivative: int, *values: float) -> PointLaw:
        slope = draft.probes.add(layout.read(where, load.at, derivative))
        return PointLaw(LoadKind.TANGENTIAL, slope, position, signal, np.array([*values, 0.0, 0.0])[:3])

    return [], [law(k + 1, f) for k, f in enumerate(parts)] if layout.dim == 3 else [law(1, *parts)]


@force.register
def _(load: Moment, draft: Draft) -> Force:
    where, layout = f"load '{load.name}'", draft.layout
    planar = layout.dim == 2
    moment = np.array([0.0, 0.0, float(np.asarray(load.moment))]) if planar else vector(where, load.moment, 3)
    axes = directions(layout.body(where, load.at), load.at.place)
    if axes == 2 and not planar:
        raise InputError(say(where, "a slope or a frame", f"{load.at} on a surface", "name a rigid frame of the plate"))
    slopes = [draft.probes.add(layout.read(where, load.at, k + 1)) for k in range(max(axes, 1))]
    signal, part = history(draft, load.history), moment / (2.0 if axes > 1 else 1.0)
    return [], [PointLaw(LoadKind.MOMENT, slope, -1, signal, part) for slope in slopes]


@force.register
def _(load: SurfaceLoad, draft: Draft) -> Force:
    where = f"load '{load.name}'"
    part, shape = edges.shape_of(where, draft, load.body)
    weights = edges.surface_weights(part, shape, edges.chosen(where, shape, load.faces), False)
    return whole(load, draft, weights * vector(where, load.force, draft.layout.dim))


@force.register
def _(load: NormalPressure, draft: Draft) -> Force:
    where = f"load '{load.name}'"
    part, shape = edges.shape_of(where, draft, load.body)
    if draft.layout.dim == 2:
        raise InputError(say(where, "a spatial scene", "a planar one", "use an edge load"))
    cells = edges.chosen(where, shape, load.faces)
    return whole(load, draft, load.pressure * edges.surface_weights(part, shape, cells, True))


@force.register
def _(load: EdgeLoad, draft: Draft) -> Force:
    where = f"load '{load.name}'"
    part, shape = edges.shape_of(where, draft, load.body)
    weights = edges.edge_weights(part, shape, edge(where, shape, load.edges))
    return whole(load, draft, weights * vector(where, load.force, draft.layout.dim))


def whole(load: SurfaceLoad | NormalPressure | EdgeLoad, draft: Draft, values: np.ndarray) -> Force:
    """One probe row that holds all nodal forces (b, c) [N] of a load; finite ones."""
    if not np.isfinite(values).all():
        raise InputError(say(f"load '{load.name}'", "finite numbers", "others"))
    row = edges.one_row(draft, f"load '{load.name}'", load.body, values)
    return [(row, 1.0, history(draft, load.history))], []


def following(loads: list[Load], draft: Draft) -> list[tuple[str, Body, Cells]]:
    """Name, body and cells of the loads that follow a surface or an edge."""
    found = [load for load in loads if isinstance(load, FollowerPressure | FollowerEdgeLoad)]
    return [(f"load '{load.name}'", *cells_of(load, draft)) for load in found]


def cells_of(load: FollowerPressure | FollowerEdgeLoad, draft: Draft) -> tuple[Body, Cells]:
    """Body and cells of one load."""
    where, dim = f"load '{load.name}'", draft.layout.dim
    part, shape = edges.shape_of(where, draft, load.body)
    size = load.pressure if isinstance(load, FollowerPressure) else load.force
    if not np.isfinite(size):
        raise InputError(say(where, "a finite number", size))
    if isinstance(load, FollowerPressure):
        if dim == 2:
            raise InputError(say(where, "a spatial scene", "a planar one", "use an edge load that follows"))
        return part, pressure.surface_cells(part, shape, edges.chosen(where, shape, load.faces), size)
    if dim == 3:
        raise InputError(say(where, "a planar scene", "a spatial one", "an edge in space has no normal; use an edge load"))
    return part, pressure.edge_cells(part, shape, edge(where, shape, load.edges), size)


@force.register
def _(load: TorsionSpring, draft: Draft) -> Force:
    where = f"load '{load.name}'"
    for name, value in (("stiffness", load.stiffness), ("damping", load.damping)):
        if not (np.isfinite(value) and value >= 0):
            raise InputError(say(f"{where}.{name}", "a number that is not negative", value))
    if load.to is not None and draft.layout.dim == 3:
        raise InputError(say(f"{where}.to", "the ground in space", load.to))
    first = draft.probes.add(arm(where, draft.layout, load.at, load.axis)[0])
    second = -1 if load.to is None else draft.probes.add(arm(where, draft.layout, load.to, load.axis)[0])
    return [], [PointLaw(LoadKind.SPRING, first, second, -1, np.array([load.stiffness, load.damping, load.angle0]))]
