"""Where reduced parts leave their training: strains beyond those of it.

    e(s, p) < low - r  or  e(s, p) > high + r,    r = BEYOND (high - low)

Strains of lines are axial, (r'.r' - 1)/2 or Gamma_1, and the curvature [1/m], of beams torsion
[1/m], too; of surfaces and solids the smallest and the largest one, of a surface in its middle. Their range is that
of the training at the sampled points. Whether a part errs there is said by `finer_parts`; nothing
else is known of parts that know no more shapes, and stored states of a run are looked at while it
goes on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..bodies.body import ShapePoints
from ..bodies.cable_law import curvatures
from ..bodies.finer import knows_shapes
from ..bodies.laws import Law
from ..bodies.stress_recovery import beam_strains, extreme_strains
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..dynamics.observers import Observer, RunSetting, offered
from ..dynamics.run import OpenRun, count_stored, states
from ..dynamics.trajectory import Trajectory
from ..systems import finer_systems
from ..systems.system import Elastic, System

BLOCK = 200  #: states whose strains are found at a time
BEYOND = 0.1  #: part of the trained range that strains may leave it by
LOOK = 50  #: stored states between two looks at a run: the clock decides nothing, so that every run shows the same warnings
#: of lines, of surfaces
KINDS = (
    ("axial strain", "curvature [1/m]"),
    ("smallest strain", "largest strain"),
)
OF_BEAMS = (*KINDS[0], "torsion [1/m]")
SHOWN = 3  #: names that a message lists
REMEDY = "its error is not known there: train it on such motions, or with other forces and moments (fmbs part train --alone)"


@dataclass(frozen=True)
class Departure:
    """Where a reduced body leaves its training.

    `value` lies outside of `trained` by more than a tenth of that range; `excess` says by how much
    of it.
    """

    body: str
    kind: str
    value: float
    trained: tuple[float, float]
    time: float  #: of the first state outside [s]
    #: where the value is, in the reference [m]; nothing in files that do not know it
    place: tuple[float, ...] = ()

    @property
    def excess(self) -> float:
        """How far the value is outside of what was trained.

            max(value - high, low - value) / (high - low)

        infinite where the trained range is a single value.
        """
        low, high = self.trained
        return max(self.value - high, low - self.value) / (high - low) if high > low else np.inf

    def __str__(self) -> str:
        (low, high) = self.trained
        place = ", ".join(f"{x:.3g}" for x in self.place)
        found = (
            f"{self.kind} {self.value:.3g} near ({place}) m of the reference"
            if place
            else f"{self.kind} {self.value:.3g}"
        )
        return f"part '{self.body}': {found}, outside since {self.time:.4g} s, trained from {low:.3g} to {high:.3g}"


def shape_points(elastic: Elastic) -> ShapePoints | None:
    """The points of a body that is reduced by shape functions; None of others.

    A body of `parts.reduced_body` has them, a full one has cells.
    """
    return elastic.gather if isinstance(elastic.gather, ShapePoints) else None


def trained_parts(system: System) -> list[Elastic]:
    """The reduced bodies that know the strains of their training.

    In the order of the elastic terms of the system.
    """
    return [
        one
        for one in system.elastic
        if (points := shape_points(one)) is not None and points.trained.size
    ]


def unknown_parts(system: System) -> list[Elastic]:
    """Those whose errors nothing finds: that know no shapes beside their own, or are not to be held
    against them.

    A part may say that it is not to be held against its finer one, see `bodies.placed`.
    """
    known = finer_systems.maker(system.full or system) is not None
    return [
        one
        for one in trained_parts(system)
        if not (known and one.gather.checked and knows_shapes(one.gather))
    ]


def first_of(names: list[str]) -> str:
    """The first names of a list, and how many there are.

    Three at most.
    """
    return ", ".join(names[:SHOWN]) + (f" ... ({len(names)} in all)" if len(names) > SHOWN else "")


def gradients(table: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Gradients (k c, s, g) of coordinates z (s, b, c) at the points of a table (k, g, b).

        u[k c, s, g] = sum_b table[k, g, b] z[s, b, c]

    k c rows, derivative by derivative.
    """
    (K, P, b) = table.shape
    (s, _, dim) = z.shape
    return np.asarray(z.transpose(2, 0, 1).reshape(dim * s, b) @ table.transpose(0, 2, 1)).reshape(
        K * dim, s, P
    )


def kinds_of(points: ShapePoints) -> tuple[str, ...]:
    """Names of the strains of a law."""
    return OF_BEAMS if points.law.fields > 1 else KINDS[points.law.tangents > 0]


def strains(points: ShapePoints, states: np.ndarray) -> np.ndarray:
    """Strains (s, p, j) at the points of a reduced body in the states (s, m, c).

    Lines: axial strain [-] and curvature [1/m], of beams torsion [1/m], too. Surfaces: smallest and
    largest principal strain [-] of the middle surface.
    """
    return np.concatenate(
        [strains_of_block(points, states[k : k + BLOCK]) for k in range(0, len(states), BLOCK)]
    )


def strains_of_block(points: ShapePoints, states: np.ndarray) -> np.ndarray:
    """As `strains`, all at once."""
    P = points.table.shape[1]
    s = len(states)
    dim = points.dim
    flat = gradients(points.table, states).reshape(-1, s * P)
    if points.law.tangents:
        return (
            extreme_strains(points.law, points.section, flat, dim).reshape(2, -1).T.reshape(s, P, 2)
        )
    if points.law.fields > 1:
        e = beam_strains(flat.reshape(-1, s, P), points.section)
        return np.stack([e[0], np.linalg.norm(e[4:], axis=0), e[3]], axis=2)
    axial = 0.5 * (np.sum(flat[:dim] ** 2, axis=0) - 1.0)
    option = (points.law if points.law.bends else Law.EXACT).option
    kappa = curvatures(option, dim, flat.T[None])[0]
    return np.stack([axial, kappa], axis=1).reshape(s, P, 2)


def copies(parts: list[Elastic]) -> list[list[Elastic]]:
    """Parts that are copies of one, each with its copies."""
    alike: dict[tuple[int, int], list[Elastic]] = {}
    for one in parts:
        alike.setdefault((id(one.gather.table), id(one.gather.section)), []).append(one)
    return list(alike.values())


def find(trajectory: Trajectory) -> list[Departure]:
    """What leaves the training in a motion, every body and kind once, with the value that is
    farthest away.

    At most two for every part, one a kind, in the order of the parts; stored states alone are
    looked at.
    """
    return find_in(trajectory.system, trajectory.times, trajectory.x)


def count_parts(trajectory: Trajectory) -> int | None:
    """How many parts leave their training in a motion; None where no part knows its own.

    A part counts once, whichever strains leave it.
    """
    return len({one.body for one in find(trajectory)}) if trained_parts(trajectory.system) else None


def find_in(
    system: System, times: np.ndarray, x: np.ndarray, parts: list[Elastic] | None = None
) -> list[Departure]:
    """The same of some parts, by default all, in states (s, n) at times (s,)."""
    found = list[Departure]()
    mine = trained_parts(system) if parts is None else parts
    if not mine or not len(x):
        return found
    q = np.asarray(system.lift.matrix @ x.T).T + system.lift.offset
    for members in copies(mine):
        points: ShapePoints = members[0].gather
        states = np.concatenate(
            [q[:, one.gather.columns].reshape(len(q), -1, points.dim) for one in members]
        )
        each = strains(points, states)
        values = each.reshape(len(members), len(q), *each.shape[1:])
        low, high = points.trained
        over = np.maximum(values - high, low - values) - BEYOND * (high - low)
        for i, j in np.argwhere(over.max(axis=(1, 2)) > 0.0):
            found.append(departure(members[i], int(j), times, values[i, :, :, j], over[i, :, :, j]))
    order = {one.name: k for k, one in enumerate(mine)}
    return sorted(found, key=lambda one: order[one.body])


def departure(
    part: Elastic, kind: int, times: np.ndarray, values: np.ndarray, over: np.ndarray
) -> Departure:
    """Where strains of a kind (s, p) of a part leave its training, farthest and first, by how far
    they are `over` it (s, p).
    """
    points: ShapePoints = part.gather
    s, p = np.unravel_index(int(over.argmax()), over.shape)
    first = float(times[int(np.argmax((over > 0.0).any(axis=1)))])
    place = tuple(points.positions[p].tolist()) if points.positions.size else ()
    low, high = points.trained[:, kind]
    return Departure(
        part.name,
        kinds_of(points)[kind],
        float(values[s, p]),
        (float(low), float(high)),
        first,
        place,
    )


def summarise(found: list[Departure]) -> str:
    """The departure farthest outside, over its trained range, with what else of its part is
    outside, and the other parts.

    `found` has one departure at least.
    """
    ordered = sorted(found, key=lambda one: -one.excess)
    worst = ordered[0]
    kinds = [one.kind.partition(" [")[0] for one in ordered if one.body == worst.body][1:]
    others = list(dict.fromkeys(f"'{one.body}'" for one in ordered if one.body != worst.body))
    more = [f"its {' and '.join(kinds)}"] * bool(kinds)
    more += [f"part{'s' * (len(others) > 1)} {first_of(others)}"] * bool(others)
    return f"{worst}{'; outside as well: ' if more else ''}{', '.join(more)}; {REMEDY}"


def warn(found: list[Departure]) -> None:
    """One notice of all.

    Nothing where nothing left its training.
    """
    if found:
        notify(summarise(found))


class Watch(Observer):
    """A notice when strains first leave the training of parts of which nothing else is known, and
    one that sums up at the end.

    A caller that takes notices for errors stops the run with the first. Looks are taken after every
    LOOK stored states and at the end, however often the run makes a pause.
    """

    looks = "pause"

    def __init__(self, parts: list[Elastic]) -> None:
        self.parts = parts
        self.seen = 0
        self.told = 0
        self.known = dict[tuple[str, str], Departure]()

    def after(self, run: OpenRun) -> None:
        kept = count_stored(run)
        last = run.done >= run.steps
        known = self.known
        for end in (
            [*range(self.seen + LOOK, kept, LOOK), kept]
            if last
            else range(self.seen + LOOK, kept + 1, LOOK)
        ):
            rows = states(run, self.seen, end)
            for one in find_in(run.model.system, rows.times, rows.x, self.parts):
                before = known.get((one.body, one.kind), one)
                farthest = max(before, one, key=lambda each: each.excess)
                known[one.body, one.kind] = replace(farthest, time=before.time)
            self.seen = end
            if len(known) > self.told and (not self.told or (last and end == kept)):
                self.told = len(known)
                warn(list(known.values()))


@offered
def _(setting: RunSetting) -> Iterator[Observer]:
    if not setting.live and (parts := unknown_parts(setting.system)):
        yield Watch(parts)
