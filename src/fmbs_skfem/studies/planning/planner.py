r"""Which mesh and which step meet an accuracy: chains of pilot runs, of which only differences are
known.

Errors are in units of what is wanted, so that 1 is met. Along a chain of levels n, 2n, 4n, ...
(steps, or cells) the differences d_i of neighbours fall by a ratio r, and

    e(n) = d_last / (r - 1) (n_last / n)^(log2 r)                                                                             (1)

is the error at n. The chain of steps runs on a coarse mesh, that of cells with the coarsest steps
that are resolved: neither ratio depends much on the other knob. The chain of cells begins with half
of them: two cells cost little, and tell the ratio. The step may use `SHARE` of the accuracy and the
mesh the rest. What is chosen is run, with half its steps as well: their difference proves the error
of the step on this mesh. Nothing here asks a clock, so that a plan can be made again.

Source of the estimate: Roache, J. Fluids Eng. 116 (1994) 405-413, doi 10.1115/1.2910291 (grid
convergence, measured ratios).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import field, replace
from typing import Any, Protocol, TypeAlias

import numpy as np

from ...core.storage.records import dataclass

SHARE = 0.6  #: of the accuracy, for the step; cheapest runs of ten mechanisms leave 25 to 40 % to the mesh
SAFETY = 0.9  #: of the accuracy that is aimed at
SURE = 0.25  #: of the share, below which one difference is enough
REACH = 4.0  #: how many times more steps a chain may foretell beyond its last pilot
#: ratio of a chain of steps from which it foretells so far, and ratio of two ratios that are even
SETTLED, EVEN = 3.0, 1.3
#: the same of cells: the finest mesh of a chain tells the error of the one that is chosen
STRETCH = 1.0
#: ratios of a chain of steps that are believed; a difference does not fall that falls by less
FALLS = 1.6, 4.0
# corners and supports at points leave meshes no more than the first order; errors of forces that
# jump are even where they fall faster, and runs that are nearer by one more order than any method
# allows are no proof for each other
#: ratio of the first order: of a chain of cells, and of meshes that are given, at least
LEAST = 2.0
FIRST = 4.0  #: ratio that a first difference of meshes is believed to fall by
# of what is foretold, too: proofs of thirty scenes differ by 0.04 to 0.98 of it, those of two that
# missed by 1.8
ROACHE = 1.25  #: factor of safety of an error that a difference tells, as grid convergence has it
WHOLE = 1e-9  #: of a unit of steps, by which it may be missed
# starts that jump, stops and ropes have plateaus of up to six halvings before their stiffness is
# resolved, and then settle
PLATEAU, PLATEAU_OF_CELLS = 7, 5  #: differences, after which those that do not fall are believed
MESHES = 4  #: on which steps may not settle, up to 32 cells, before that is said of the motion
FINER = 4  #: times the steps with which a chain of cells begins anew where its differences grow
FEW = 8  #: times the steps of the chain of cells, above which the error of the mesh is measured with those of the run
#: times the steps or cells that a proof asks for at least, and from which a difference tells the
#: error of the finer run
MORE = 1.4
TWICE = 2.0  #: cells that a proof asks for at most, of those that it doubts
DOUBTS = 6  #: proofs that are tried
MANY = 40  #: units of steps, above which four of them are rounded to
THIRD = 3.0  #: ratio of cells up to which a difference tells the error of the finer mesh
TINY = 1e-12  #: of a goal, that errors count with at least where a level is sought between two


class Pilots(Protocol):
    """Runs that a plan can make, and how they differ."""

    @property
    def rough(self) -> bool:
        """Whether errors fall without an even ratio, as those of contact do."""

    @property
    def order(self) -> np.ndarray | int:
        """By 2^order at most differences of meshes fall, of every column (k,) or of all alike."""

    def run(self, cells: int, steps: int) -> Any:
        """What a run gives; None where the steps do not resolve it."""

    def differ(self, one: Any, other: Any) -> np.ndarray:
        """Differences of two runs, (2, k): in units of the accuracy, 0 where nothing is wanted; and
        in units of their own.
        """


Pair: TypeAlias = tuple[tuple[int, int], tuple[int, int]]  #: cells and steps of two runs


NOTHING = np.zeros((2, 1))  #: errors of what has none


def size(differences: np.ndarray) -> float:
    """The largest of what is wanted."""
    return float(differences[0].max(initial=0.0))


@dataclass(frozen=True)
class Chain:
    """Differences of neighbours, each twice as fine as the one before."""

    fine: int  #: the level of the last run
    differences: tuple[np.ndarray, ...]  #: (2, k) each, see `Pilots.differ`
    least: float  #: the ratio is at least this
    most: np.ndarray | float  #: and at most this, of every column (k,) or of all alike
    first: float  #: the ratio where one difference is known
    rough: bool = False
    proved: bool = True  #: what it foretells is run in half its steps, too

    @property
    def sizes(self) -> list[float]:
        return [size(one) for one in self.differences]

    @property
    def own(self) -> list[np.ndarray]:
        """Differences (k,) of the last three pairs, or of as many as there are, in units of their
        own.
        """
        return [one[1] for one in self.differences[-3:]]

    @property
    def ratios(self) -> np.ndarray:
        """(k,): by what the differences of every column fall; one that settles late falls by less
        than the others do.
        """
        own = self.own
        if len(own) < 2:
            return np.full(len(own[-1]), self.first)
        return np.clip(over(own[-2], own[-1], self.most), self.least, self.most)

    @property
    def uneven(self) -> np.ndarray:
        """(k,): which columns of a rough chain have not shown in two ratios that they fall as those
        of a smooth one do.
        """
        own = self.own
        even = len(own) == 3 and np.all(
            [a >= LEAST * b for a, b in itertools.pairwise(own)], axis=0
        )
        return ~(even & np.ones(len(own[-1]), bool)) & self.rough

    def settles(self, goal: float) -> bool:
        """Whether the columns that err by more than `goal` fall by a ratio that they keep: nearly
        that of their order, or that of the pair before.

        Steps that are too long for the motion make differences fall by less, and foretell too many.
        """
        above = self.known()[0][1][0] > goal
        ratios = [over(one, other, self.most)[above] for one, other in itertools.pairwise(self.own)]
        if not ratios:
            return self.first >= SETTLED
        near = np.maximum(ratios[-1], ratios[0]) <= EVEN * np.minimum(ratios[-1], ratios[0])
        even = near & (ratios[0] >= self.least) & (len(ratios) > 1)
        return bool(np.all((ratios[-1] >= SETTLED) | even))

    @property
    def powers(self) -> np.ndarray:
        """(k,): errors fall with the level to these powers."""
        return np.where(self.uneven, 1.0, np.log2(self.ratios))

    def known(self) -> list[tuple[int, np.ndarray]]:
        """Levels of all runs, the finest first, with errors (2, k): at most those of the next one
        and the difference from it.
        """
        even = ROACHE * self.differences[-1] / (self.ratios - 1.0) * self.luck
        found = [(self.fine, np.where(self.uneven, np.maximum.reduce(self.differences[-2:]), even))]
        for difference in reversed(self.differences):
            level, error = found[-1]
            found.append((level // 2, error + difference))
        return found

    def errors(self, level: float) -> np.ndarray:
        """Errors (2, k) at a level: above the finest run (1), below the coarsest as fast as they
        can grow, even between two.
        """
        known = self.known()
        if level >= known[0][0]:
            return known[0][1] * (known[0][0] / level) ** self.powers
        for (fine, small), (coarse, large) in itertools.pairwise(known):
            if level >= coarse:
                part = math.log(fine / level) / math.log(fine / coarse)
                return small ** (1.0 - part) * large**part
        return known[-1][1] * (known[-1][0] / level) ** np.log2(self.most)

    def error(self, level: float | None = None) -> float:
        return size(self.errors(self.fine if level is None else level))

    def needed(self, goal: float) -> float:
        """The level at which no column errs by more than `goal`."""
        known = self.known()
        fine, error = known[0]
        if size(error) > goal:
            above = error[0] > goal
            return float(fine * ((error[0][above] / goal) ** (1.0 / self.powers[above])).max())
        for (fine, small), (coarse, large) in itertools.pairwise(known):
            if size(large) > goal:
                above = large[0] > goal
                less = np.maximum(small[0][above], TINY * goal)
                more = large[0][above]
                part = np.log(goal / less) / np.log(more / less)
                return float(fine * (coarse / fine) ** part.min())
        level, error = known[-1]
        return float((level * (error[0] / goal) ** (1.0 / np.log2(self.most))).max())

    def more(self, errors: np.ndarray, goal: float) -> float:
        """How many times as fine a level is that errs by `goal`, of one with errors (2, k)."""
        return float(((errors[0] / goal) ** (1.0 / self.powers)).max())

    @property
    def luck(self) -> np.ndarray:
        """(k,): by how much the last two runs are nearer to each other than an order allows, 1 at
        least: that may be by chance.

        A chain of cells has then been on meshes too coarse to tell (without this it foretold a
        third of the error of a moment). Chains of steps pass 1.5 times the ratio of their order
        before they settle, and are proved.
        """
        own = self.own[-2:]
        if len(own) < 2 or self.proved:
            return np.ones(len(own[-1]))
        return np.maximum(1.0, over(own[0], own[1], 0.0) / np.max(self.most))


def over(one: np.ndarray, other: np.ndarray, none: np.ndarray | float) -> np.ndarray:
    """The ratios of columns (k,), `none` where the other one is zero."""
    return np.where(other > 0.0, one / np.where(other > 0.0, other, 1.0), none)


@dataclass(frozen=True)
class Pilot:
    """One run of a plan."""

    cells: int
    steps: int
    resolved: bool
    #: from the run that it was first held against, in units of the accuracy
    difference: float | None = None
    local_error: float = 0.0  #: of its steps where these have several lengths; its difference is that from equal ones


@dataclass(frozen=True)
class AccuracyPlan:
    """What is chosen, and why."""

    cells: int
    steps: int
    time: np.ndarray  #: (2, k) errors of the step, see `Pilots.differ`
    mesh: np.ndarray  #: (2, k) those of the mesh
    pilots: tuple[Pilot, ...]
    why: str = ""  #: it falls short: `sensitive`, `steps`, `cells`, `doubt`
    #: of runs of a sensitive motion, the time up to which all agree can be trusted
    pairs: tuple[tuple[Any, Any], ...] = ()
    apart: str = ""  #: of how many steps, or cells, these are
    #: of steps of several lengths over the size of the mechanism, 0 for equal ones
    local_error: float = 0.0
    parts: np.ndarray | None = None  #: (2, k) those of parts, None where nothing is known of any
    run: Any = None  #: what the run gave that is chosen, where it was made

    @property
    def errors(self) -> np.ndarray:
        """(2, k) of all together."""
        return self.time + self.mesh + (NOTHING if self.parts is None else self.parts)

    @property
    def met(self) -> bool:
        return not self.why and size(self.errors) <= 1.0


@dataclass(frozen=True)
class Limits:
    """How far a plan may go."""

    steps: int = 10_000_000
    cells: int = 512
    unit: int = 2  #: numbers of steps are multiples of it, and have a half
    whole: int = 1  #: those of proofs are multiples of this
    fewest: int = 1  #: cells that a mesh may have
    usual: int = 10_000_000  #: with which meshes are compared, where more are given
    share: float = 1.0  #: of the accuracy, for the step where no mesh is judged here

    def rounded(self, steps: float) -> int:
        """Whole steps, at least so many."""
        return min(math.ceil(steps / self.unit - WHOLE) * self.unit, self.steps)

    def half(self, steps: int) -> int:
        """Half of some steps, or a little more."""
        return math.ceil(steps / (2 * self.whole)) * self.whole


@dataclass
class Planner:
    """The runs of one plan so far."""

    pilots: Pilots
    limits: Limits
    see: Callable[[Pilot], None]
    log: list[Pilot] = field(default_factory=list)
    known: dict[tuple[int, int], Any] = field(default_factory=dict)

    def run(self, cells: int, steps: int) -> Any:
        if (cells, steps) not in self.known:
            self.known[cells, steps] = found = self.pilots.run(cells, steps)
            self.log.append(Pilot(cells, steps, found is not None))
            self.see(self.log[-1])
        return self.known[cells, steps]

    def rounded(self, steps: float) -> int:
        """Whole steps, at least so many; many of forces that jump can be halved twice, see `fewer`."""
        found = self.limits.rounded(steps)
        if self.pilots.rough and found > MANY * self.limits.unit:
            return replace(self.limits, unit=4 * self.limits.unit).rounded(steps)
        return found

    def proved(
        self,
        chosen: tuple[int, int],
        time: Chain,
        mesh: Chain | None,
        why: str,
        free: tuple[bool, bool],
        known: int = 0,
    ) -> AccuracyPlan:
        """The plan of what is chosen, with the error of the step on its own mesh, from a run with
        half as many.

        More steps are taken where that is larger than the coarsest mesh has foretold. Where the run
        is farther than foretold from the nearest pilot, and its steps are proved or given, it is
        the mesh that is doubted, and more cells are taken; equilibria have no steps. The chain of
        cells has so many steps as are `known`.
        """
        (cells, steps), (free_cells, free_steps) = chosen, free
        errors = lambda n, m: time.errors(m) + (mesh.errors(n) if mesh else 0.0)  # noqa: E731
        found = time.errors(steps)
        of_mesh = mesh.errors(cells) if mesh else NOTHING
        last = steps, math.inf
        for attempt in range(DOUBTS):
            if self.run(cells, steps) is None and free_steps and 2 * steps <= self.limits.steps:
                steps *= 2
                continue
            far = self.is_far((cells, steps), errors)
            measured = self.measured(cells, steps, time)
            if measured is not None:
                # a force right behind what is caught grows with cells and steps alike: no run is
                # its limit, and each costs eight times the one before
                if size(measured) > max(last[1], 1.0) and steps >= REACH * last[0]:
                    pair = (cells, self.limits.half(steps)), (cells, steps)
                    apart = f"{pair[0][1]} and {steps} steps"
                    return self.unsettled((cells, steps), time, of_mesh, apart, pair)
                last = steps, size(measured)
            found = (
                time.errors(steps) if measured is None else np.maximum(time.errors(steps), measured)
            )
            if mesh:
                of_mesh = (
                    self.of_mesh(cells, steps, mesh, known) if free_cells else mesh.errors(cells)
                )
            # a given mesh that errs by more than is wanted is no reason for more steps
            together = size(found + of_mesh if free_cells or size(of_mesh) <= 1.0 else found)
            if not (far or measured is None or together > 1.0):
                break
            more_steps = free_steps and steps < self.limits.steps
            more_cells = (
                mesh is not None
                and free_cells
                and cells < self.limits.cells
                and (more_steps or size(found) < SAFETY)
            )
            if not more_steps and not more_cells:
                break
            if attempt == DOUBTS - 1:
                why = why or "doubt"
                break
            cells, steps = self.finer(
                (cells, steps),
                (time if more_steps else None, found),
                (mesh if more_cells else None, of_mesh),
                measured is not None,
            )
        if free_steps and self.pilots.rough:
            steps, found = self.fewer(cells, steps, found, of_mesh)
        plan = AccuracyPlan(cells, steps, found, of_mesh, tuple(self.log), why)
        plan = self.cheapest(plan, free, time.known()[-1][0]) if plan.met else plan
        return replace(plan, run=self.known.get((plan.cells, plan.steps)))

    def cheapest(self, found: AccuracyPlan, free: tuple[bool, bool], least: int) -> AccuracyPlan:
        """The plan with the cheapest run so far, of the `least` steps or more, that errs by no more
        than is wanted, with what it differs by from the one that is proved.

        First of those with as many steps, then of those on that mesh.
        """
        free_cells, free_steps = free
        for of_cells in (True, False):
            if not (free_cells if of_cells else free_steps):
                continue
            proved = found.cells, found.steps
            others = sorted(
                one
                for one, run in self.known.items()
                if run is not None
                and one[of_cells] == proved[of_cells]
                and one < proved
                and one[1] >= least
            )
            for cells, steps in others:
                apart = self.differ((cells, steps), proved)
                if apart is None or size(found.errors + apart) > SAFETY:
                    continue
                mesh, time = (apart, 0.0) if of_cells else (0.0, apart)
                found = replace(
                    found, cells=cells, steps=steps, time=found.time + time, mesh=found.mesh + mesh
                )
                break
        return replace(found, pilots=tuple(self.log))

    def finer(
        self,
        chosen: tuple[int, int],
        of_step: tuple[Chain | None, np.ndarray],
        of_mesh: tuple[Chain | None, np.ndarray],
        proved: bool,
    ) -> tuple[int, int]:
        """More cells, more steps or both, where what is chosen errs too much: by the errors of step
        and mesh along their chains; no more of what has None in place of a chain.

        As long as no run has `proved` the error of the step there are more steps.
        """
        cells, steps = chosen
        (time, time_error), (mesh, mesh_error) = of_step, of_mesh
        share = SAFETY * SHARE
        error = size(time_error)
        left = SAFETY - (min(error, share) if time else error)
        by_steps = time is not None and (not proved or error > share or mesh is None)
        if time and by_steps:
            steps = self.rounded(np.clip(time.more(time_error, share), MORE, REACH) * steps)
        if mesh and (not by_steps or size(mesh_error) > left):
            more = np.clip(mesh.more(mesh_error, left), MORE, TWICE)
            cells = min(math.ceil(more * cells), self.limits.cells)
        return cells, steps

    def is_far(self, one: tuple[int, int], errors: Callable[[int, int], np.ndarray]) -> bool:
        """Whether a run differs from the nearest other one by more than both are foretold to err,
        by `errors` (2, k) of cells and steps; Unresolved where it has no motion.
        """
        others = [other for other, run in self.known.items() if run is not None and other != one]
        nearest = min(others, key=lambda other: size(errors(*other)))
        difference = self.differ(nearest, one)
        if difference is None:
            raise Unresolved(*one)
        foretold = size(errors(*nearest) + errors(*one))
        return size(difference) > ROACHE * max(foretold, SURE)

    def fewer(
        self, cells: int, steps: int, error: np.ndarray, of_mesh: np.ndarray
    ) -> tuple[int, np.ndarray]:
        """Half of the steps, again and again, while twice the difference from these is within the
        share of the step.

        Chains of forces that jump foretell many times too much where a coarse mesh does not settle
        as the chosen one does. Errors that fall by two or more with every halving add up to twice
        the last difference.
        """
        while (
            steps % (2 * self.limits.unit) == 0
            and (apart := self.differ((cells, steps // 2), (cells, steps))) is not None
        ):
            if size(2.0 * apart) > SAFETY * SHARE or size(2.0 * apart + of_mesh) > 1.0:
                break
            steps = steps // 2
            error = 2.0 * apart
        return steps, error

    def of_mesh(self, cells: int, steps: int, mesh: Chain, known: int) -> np.ndarray:
        """Errors (2, k) of a mesh: at least what its chain foretells, and what runs with other
        cells and as many steps tell.

        Beside the finest mesh of the chain nothing has to be foretold: both err together by what
        they differ. Where the run has many more steps than the chain, it resolves what the chain
        could not see, such as waves: a mesh of half as many cells tells that, with half of these
        steps, which prove the step as well. Meshes of less than a third of the cells do not: what
        they miss is of another kind.
        """
        found = mesh.errors(cells)
        half = self.limits.half(steps)
        finer = self.differ((cells, known), (mesh.fine, known)) if mesh.fine > cells else None
        if finer is not None:
            found = finer + mesh.errors(mesh.fine)
        coarser = max(cells // 2, self.limits.fewest)
        many = steps > FEW * known and coarser < cells
        if many:
            self.differ((coarser, half), (cells, half))
        for (other, same), run in list(self.known.items()):
            beside = (same == steps and (finer is None or steps > known)) or (many and same == half)
            if run is None or not beside or not MORE * other <= cells <= THIRD * other:
                continue
            if (apart := self.differ((other, same), (cells, same))) is not None:
                # what differs by more than the chain has foretold is not what the chain has seen
                # fall
                foretold = ROACHE * (mesh.errors(other) - mesh.errors(cells))
                powers = np.where(apart[1] <= foretold[1], mesh.powers, math.log2(LEAST))
                found = np.maximum(found, ROACHE * apart / ((cells / other) ** powers - 1.0))
        return found

    def measured(self, cells: int, steps: int, time: Chain) -> np.ndarray | None:
        """Errors (2, k) of a number of steps on a mesh, from a run with half as many; None where
        these do not resolve it.

        What runs with other steps on this mesh tell counts too. Given steps that have no half are
        held against twice as many.
        """
        half = self.limits.half(steps)
        foretold = time.errors(steps)
        if half == steps:
            return foretold
        if 2 * half != steps:
            difference = self.differ((cells, steps), (cells, 2 * steps))
            # nobody knows by which ratio it falls
            return foretold if difference is None else 2.0 * ROACHE * difference
        difference = self.differ((cells, half), (cells, steps))
        if difference is None and half < time.known()[-1][0]:
            return foretold  # nobody has said that so few resolve it
        if difference is not None and self.pilots.rough:
            return difference  # forces that jump fall evenly on one mesh, and not on the next
        if difference is None:
            return None
        found = ROACHE * difference / ((steps / half) ** time.powers - 1.0)
        for other, fewer in [one for one, run in self.known.items() if run is not None]:
            if (
                other == cells
                and half < fewer <= steps / MORE
                and (apart := self.differ((cells, fewer), (cells, steps))) is not None
            ):
                found = np.maximum(found, ROACHE * apart / ((steps / fewer) ** time.powers - 1.0))
        return found

    def unsettled(
        self, chosen: tuple[int, int], time: Chain, mesh: np.ndarray, apart: str, *pairs: Pair
    ) -> AccuracyPlan:
        """The plan of a motion that pairs of runs do not settle."""
        known = [tuple(self.run(*one) for one in pair) for pair in pairs]
        resolved = tuple(
            (one, other) for one, other in known if one is not None and other is not None
        )
        return AccuracyPlan(
            *chosen, time.errors(chosen[1]), mesh, tuple(self.log), "sensitive", resolved, apart
        )

    def unsettled_steps(
        self, cells: int, time: Chain, given: int | None, free_cells: bool
    ) -> AccuracyPlan:
        """The plan of a motion that more steps do not settle; another mesh tells the error of this
        one all the same.
        """
        fine = time.fine
        some = time.fine // FINER
        pairs = [((cells, fine // 2), (cells, fine))]
        chosen = (cells, given or fine)
        mesh = NOTHING
        if free_cells:
            pairs.append(((cells // 2, some), (cells, some)))
            apart = self.differ(*pairs[-1])
            mesh = time.differences[-1] if apart is None else ROACHE * apart / (LEAST - 1.0)
        return self.unsettled(chosen, time, mesh, f"{fine // 2} and {fine} steps", *pairs)

    def coarsest(self, cells: int, steps: int) -> int:
        """The fewest steps, by doubling, that resolve the motion."""
        while self.run(cells, steps) is None and 2 * steps <= self.limits.steps:
            steps *= 2
        return steps

    def differ(self, one: tuple[int, int], other: tuple[int, int]) -> np.ndarray | None:
        """Differences (2, k) between two runs, the later one in the log with their size; None where
        one is not resolved.
        """
        found = self.run(*one), self.run(*other)
        if found[0] is None or found[1] is None:
            return None
        difference = self.pilots.differ(*found)
        index = next(i for i, pilot in enumerate(self.log) if (pilot.cells, pilot.steps) == other)
        if self.log[index].difference is None:
            self.log[index] = replace(self.log[index], difference=size(difference))
        return difference

    def chain_of_steps(
        self, cells: int, steps: int, goal: float, single: bool
    ) -> tuple[Chain, int, str]:
        """The chain of steps on one mesh, the fewest steps that are resolved, and why it falls
        short of its goal, if it does.

        A `single` pair tells the error of steps that are given, and one with half of these how it
        falls.
        """
        first = steps = self.coarsest(cells, steps)
        differences: list[np.ndarray] = []
        if (
            single
            and 2 * self.limits.half(steps) == steps
            and (one := self.differ((cells, steps // 2), (cells, steps))) is not None
        ):
            differences.append(one)
        while True:
            found = self.differ((cells, steps), (cells, 2 * steps))
            steps *= 2
            if found is None:  # what was resolved by chance
                if steps > self.limits.steps or single:
                    raise Unresolved(cells, first)
                first = steps
                differences = []
                continue
            differences.append(found)
            chain = Chain(
                steps, tuple(differences), *FALLS, first=FALLS[1], rough=self.pilots.rough
            )
            why = "steps" if 2 * steps > self.limits.steps else None
            if (why := "" if single else judge(chain, goal, REACH, PLATEAU, why)) is not None:
                return chain, first, why

    def settling(
        self, cells: int, steps: int, goal: float, single: bool, free_cells: bool
    ) -> tuple[int, Chain, int, str]:
        """The first of MESHES meshes, each twice as fine as the one before, whose chain of steps
        settles, and that chain.

        What few cells do is no motion of the body: it may have no end of steps.
        """
        found = None
        for level in [
            cells * 2**k
            for k in range(MESHES if free_cells else 1)
            if not k or cells * 2**k <= self.limits.cells
        ]:
            try:
                found = level, *self.chain_of_steps(level, steps, goal, single)
            except Unresolved as error:
                failed = error
                continue
            if found[-1] != "sensitive":
                break
        if found is None:
            raise failed
        return found

    def chain_of_cells(
        self, cells: int, steps: int, enough: int, goal: float, single: bool
    ) -> tuple[Chain, int, str]:
        """The chain of meshes at one step, the steps that it took, and why it falls short of its
        goal, if it does.

        Where differences grow or do not fall, steps may not resolve what finer meshes do: more are
        taken, up to `enough`.
        """
        differences: list[np.ndarray] = []
        while True:
            found = self.differ((cells, steps), (2 * cells, steps))
            if found is None:  # finer meshes are faster: they ask for more steps
                if 2 * steps > self.limits.steps:
                    raise Unresolved(2 * cells, steps)
                steps *= 2
                if differences:
                    cells = cells // 2 ** len(differences)
                    differences = []
                continue
            cells *= 2
            differences.append(found)
            most = np.exp2(self.pilots.order)
            chain = Chain(
                cells, tuple(differences), LEAST, most, LEAST if single else FIRST, proved=False
            )
            why = "cells" if 2 * cells > self.limits.cells else None
            why = "" if single else judge(chain, goal, STRETCH, PLATEAU_OF_CELLS, why)
            grow = len(differences) > 1 and size(found) > size(differences[-2])
            if (grow or why == "sensitive") and steps < enough:
                steps = min(FINER * steps, enough)
                cells = cells // 2 ** len(differences)
                differences = []
            elif why is not None:
                return chain, steps, why


class Unresolved(Exception):
    """No number of steps resolves a motion on a mesh."""

    def __init__(self, cells: int, steps: int) -> None:
        super().__init__(cells, steps)
        self.cells, self.steps = cells, steps


def is_enough(chain: Chain, goal: float, reach: float) -> bool:
    """Whether a chain meets its goal, or foretells the level that does; one difference alone has to
    be far below it.
    """
    if len(chain.differences) == 1:
        return chain.error() <= SURE * goal
    if np.any((chain.luck > LEAST) & (chain.differences[-2][0] > goal)):
        return False
    reach = reach if chain.settles(goal) else STRETCH
    return chain.error() <= goal or chain.needed(goal) <= reach * chain.fine


def is_wild(chain: Chain, plateau: int) -> bool:
    """Whether the last three of `plateau` halvings or more have together made differences hardly
    smaller.
    """
    sizes = chain.sizes[-4:]
    return len(chain.differences) >= plateau and sizes[0] < FALLS[0] ** 3 * sizes[-1]


def judge(chain: Chain, goal: float, reach: float, plateau: int, limit: str | None) -> str | None:
    """Why a chain ends, nothing where it meets its goal; None where it goes on, which a `limit`
    does not let it.
    """
    if is_enough(chain, goal, reach):
        return ""
    return "sensitive" if is_wild(chain, plateau) else limit


FAR = Limits()
#: of an equilibrium, where every run counts as one step
NO_STEPS = (
    Chain(1, (NOTHING,), *FALLS, first=FALLS[1]),
    1,
    "",
)


def plan(
    pilots: Pilots,
    cells: int,
    steps: int,
    free_cells: bool = True,
    free_steps: bool = True,
    limits: Limits = FAR,
    see: Callable[[Pilot], None] = lambda pilot: None,
) -> AccuracyPlan:
    """Cells and steps that meet an accuracy, from chains that begin with so many of them; what is
    not free stays.

    `cells` are twice the fewest, and 0 where a scene has none to choose: its mesh is not judged.
    `steps` are 0 of an equilibrium. Unresolved where no number of steps is enough.
    """
    done = Planner(pilots, limits, see)
    open_mesh = bool(cells) and free_cells
    share = SAFETY * (SHARE if open_mesh else limits.share)
    time, first, why = NO_STEPS
    if steps:
        cells, time, first, why = done.settling(cells, steps, share, not free_steps, open_mesh)
    if why == "sensitive":
        return done.unsettled_steps(cells, time, None if free_steps else steps, open_mesh)
    chosen = (
        cells,
        max(steps, 1) if not free_steps else max(first, done.rounded(time.needed(share))),
    )
    if not cells:
        return done.proved(chosen, time, None, why, (free_cells, free_steps))
    rest = SAFETY - min(time.error(chosen[1]), SAFETY * SHARE)
    fewest = cells // 2 if free_cells else cells
    first = first if free_steps else min(first, limits.usual)
    mesh, first, short = done.chain_of_cells(fewest, first, chosen[1], rest, single=not free_cells)
    if short == "sensitive":
        fine = mesh.fine
        pairs = [
            ((fine // 2, first), (fine, first)),
            *([((fine // 2, first), (fine // 2, 2 * first))] if free_steps else []),
        ]
        delivered = fine, first if free_steps else chosen[1]
        return done.unsettled(
            delivered, time, mesh.errors(fine), f"{fine // 2} and {fine} cells", *pairs
        )
    if free_cells:
        chosen = int(np.clip(math.ceil(mesh.needed(rest)), fewest, limits.cells)), chosen[1]
    return done.proved(chosen, time, mesh, why or short, (free_cells, free_steps), first)
