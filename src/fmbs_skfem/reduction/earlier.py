"""What files of earlier releases say in other words: types of theirs, and what becomes of them.

version 1     lengths by the norm of all coordinates, from the origin of the scene
version 2     loads in columns and laws by number, or forces of fixed direction apart; angles of gears as constraint terms; position
              gradients of sampled points by the name of jets
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import IntEnum

import numpy as np

from ..core.storage.container import MENDS, Tree, storable
from ..core.storage.records import dataclass
from ..systems import row_laws
from ..systems.connections import constraint_laws
from ..systems.forces import force_laws
from ..systems.system import Loads, System
from .affine import Varying


@storable
class LoadKind(IntEnum):
    """Laws of loads by number."""

    MOMENT = 0
    TANGENTIAL = 1
    SPRING = 2


@storable
@dataclass(frozen=True)
class PointLaw:
    """A force on slope rows and position rows from these numbers on; of a spring both are arms, -1 the ground."""

    kind: LoadKind
    slope: int
    position: int
    signal: int
    vector: np.ndarray  #: moment, follower force along slope and normal, or stiffness, damping and rest angle


@storable
@dataclass(frozen=True)
class DeadLoads:
    """Forces coefficient s(t) on t probe rows, with their own place in a file."""

    row: np.ndarray
    coefficient: np.ndarray
    signal: np.ndarray


def of_law(law: PointLaw, dim: int) -> force_laws.LawForces:
    """The force of a law by number."""

    def rows(first: int, count: int) -> Sequence[int]:
        return range(first, first + count)

    if law.kind is LoadKind.SPRING:
        arms = [first for first in (law.slope, law.position) if first >= 0]
        name = ("torsion_spring", "relative_torsion_spring")[len(arms) - 1]
        return force_laws.one(name, [row for first in arms for row in rows(first, 2)], law.vector)
    if law.kind is LoadKind.MOMENT:
        return force_laws.one(f"moment_{dim}", rows(law.slope, dim), law.vector[2:] if dim == 2 else law.vector, [law.signal])
    both = [*rows(law.slope, dim), *rows(law.position, dim)]
    return force_laws.one(f"follower_{dim}", both, law.vector[: 2 if dim == 2 else 1], [law.signal])


def mend_constraints(values: Tree) -> None:
    """Angles among the terms, by the signal -2, become laws of gears; terms without effect keep the places of the others."""
    values.setdefault("loose", ())
    if "laws" in values:
        return
    angles, found = values["signal"] == -2, []
    for row in np.unique(values["row"][angles]):
        coefficient, i, j = (values[name][angles & (values["row"] == row)] for name in ("coefficient", "i", "j"))
        arms = i >= 0
        rows, ratios = np.stack([i[arms], j[arms]], axis=1).ravel(), [*coefficient[arms], *coefficient[~arms]]
        found.append(constraint_laws.one(f"gear_{int(arms.sum())}", int(row), rows.tolist(), ratios))
    values["laws"] = row_laws.join(found)
    for name, none in (("signal", -1), ("i", -1), ("j", -1), ("coefficient", 0.0)):
        values[name] = np.where(angles, none, values[name])


def mend_loads(values: Tree) -> None:
    """Columns become dead loads; laws wait for the system, which knows the dimension."""
    if "laws" in values:
        columns = (values.pop(name) for name in ("row", "coefficient", "signal"))
        values["forces"] = (DeadLoads(*columns), *values.pop("laws"))


def mend_system(values: Tree) -> None:
    """Laws by number become forces; there are no events."""
    values |= {name: () for name in ("locks", "triggers", "readings") if name not in values}
    loads = values.get("loads")
    if isinstance(loads, Loads):
        found = [of_law(one, values["dim"]) if isinstance(one, PointLaw) else one for one in loads.forces]
        found = [force_laws.dead(one.row, one.coefficient, one.signal) if isinstance(one, DeadLoads) else one for one in found]
        values["loads"] = replace(loads, forces=tuple(found))


def mend_varying(values: Tree) -> None:
    """Numbers of loads are in other places."""
    values["varying"] = tuple(moved(one, values["nominal"].system) for one in values["varying"])


def moved(part: Varying, system: System) -> Varying:
    """The polynomial of numbers of loads where these are now."""
    match part.place:
        case ("system", "loads", "coefficient"):
            return replace(part, place=("system", "loads", "forces", 0, "numbers"))
        case ("system", "loads", "forces", int(number), "coefficient"):
            return replace(part, place=("system", "loads", "forces", number, "numbers"))
        case ("system", "loads", "laws", int(number), "vector"):
            place = ("system", "loads", "forces", number + 1, "numbers")
            alone = system.loads.forces[number + 1].numbers.size == 1  # of a vector along one axis
            return replace(part, place=place, positions=0 * part.positions if alone else part.positions)
    return part


MENDS.update(Constraints=mend_constraints, Loads=mend_loads, System=mend_system, ParametricCase=mend_varying)
