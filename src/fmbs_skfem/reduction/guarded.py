r"""A guarded run: a reduced model as long as its indicator holds, the full one elsewhere, whose states go into the basis.

    I(t) = c |R(t)|_g (49),      int_0^T I dt <= B,      B = s int I dt of the training / (its error over the accuracy)
    reduced from t0:   goes on while the mean of I over a window is at most (B - int I dt so far) / (T - t)
    full from there:   X = its states,   U' = [U, V],   V = left singular vectors of what U lacks of X (50)
    reduced again:     where the enriched model, run over the same window, keeps the indicator and stays beside the full one

Errors follow the integral of the indicator by a factor that hardly depends on loads: that of the training is known from its own
motion, of which the full model was run (a double pendulum of eps 1e-12, 1e-10, 1e-8: 28, 50, 115 1/(m s) over the range of the
outputs, at 1.5 times the weight 37, 61, 169). The share s of the accuracy leaves room for that. A window that fails is taken again
from its begin, so that nothing that is not trusted is part of the motion. Windows of the full model double from one to the next,
so that a motion that the reduced model never holds is soon one of the full model alone.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, equations (39), (49), (50), doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Annotated

import numpy as np

from ..core.algebra.linalg import evenly
from ..core.errors import InputError, SolverError, say
from ..core.notices import Progress
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.storage.validation import Reals
from ..dynamics.handover import Handed, Leg
from ..dynamics.integration import kept_steps
from ..dynamics.outputs import body_coordinates, lifted
from ..dynamics.scheme import GeneralizedAlpha, steps_in
from ..dynamics.tracing import FEW, Tracer, joined_parts, tracer_of
from ..dynamics.trajectory import Statistics, Trajectory
from ..systems.compiled import Compiled, compile_system
from ..systems.system import System, project, projector, sizes
from . import reduced_models
from .accuracy import errors
from .cases import Case
from .full_runs import TrainingTask
from .hyper import hyper_reduction, sampling
from .hyper.ecsw import Selection
from .hyper.hyper_reduction import Rule, TrainingRun
from .reduced_models import PLAIN, ReducedModel, TrainedReduction
from .spaces import kept_rows, pod
from .spaces.component import inner_constraints, mass_of, metric_of, rows_of, satisfy
from .spaces.galerkin import OPENED
from .spaces.pod import Basis

NOTE = "guard"  #: of a file, what guarded runs need to know
SHARE = 0.3  #: of the accuracy that the factor between indicator and error of the training is trusted with
PERTURBED = 1e-4  #: change of velocities over the size of the mechanism [1/s], far above what Newton leaves, and linear
# double pendulum, 6000 steps: a look costs 0.6 of a full step, so that all of them take 2 % of a full run
LOOKS = 4  #: at the indicator in a window
# the rest of the budget falls with the power RATE of the rest of the time, and is never used up; with 1 a start is as bad as an end
RATE = 2.0
WINDOW = 128  #: steps after which the indicator is judged, fewer in short runs
FEWEST = 50  #: windows of a run
AT_ONCE = 2  #: windows that a reduced model runs before it is judged
FIRST = 2  #: windows of the first visit to the full model: twice as many make fewer, larger bases
SNAPSHOTS = 40  #: of a visit to the full model, as many as its modes are few
MARGIN = 3.0  #: by which an enriched model is to stay below what is allowed, at the states that it knows
FINEST = 1e-18  #: eps of what is added: less is round-off of snapshots
TRIES = 3  #: visits to the full model, one behind another, whose enriched models do not follow: then it runs alone
MOST = 0.5  #: of the unknowns of the full model, beyond which a reduced one is not made any larger
STATES = 40  #: training states that hyper-reductions are trained on again, with those of the visits


@storable
@dataclass(frozen=True)
class Known:
    """What a reduced model knows of its training, for guarded runs."""

    components: dict[str, tuple[str, ...]]
    selections: tuple[Selection, ...]
    left_out: tuple[str, ...]  #: constraint rows, as joint.row
    eliminate: bool
    invariant: bool
    indicator: float  #: int I dt of its own motion [m s]
    distance: float  #: largest distance from the full one [m]
    growth: float  #: of errors, see `growth`
    states: Annotated[np.ndarray, Reals("s r")]  #: of this motion


def know(task: TrainingTask, model: ReducedModel, motion: Trajectory, distance: float, growth: float, case: Case) -> Known:
    """What is noted of a model in its file, from its motion over the training, which is `distance` [m] from that of `case`."""
    looks = LOOKS * max(round(case.duration / case.scheme.step) // WINDOW, FEWEST)
    few = evenly(0, len(motion.times) - 1, min(len(motion.times), looks))
    return Known(
        {name: tuple(members) for name, members in task.plan.components.items()},
        model.selections,
        tuple(model.left_out),
        task.plan.eliminate,
        task.plan.invariant,
        errors.indicator(case.system, motion.part(few), case.scheme),
        distance,
        growth,
        motion.x[evenly(0, len(motion.times) - 1, min(len(motion.times), STATES))],
    )


def growth(
    case: Case, x: np.ndarray | None = None, v: np.ndarray | None = None, kept: np.ndarray | None = None
) -> tuple[float, float]:
    """Largest displacement over time that a change of the first velocities makes in a reduced model, over that of a free flight.

    max_t |dx(t)| / (|dx'(0)| T) of a change along a random direction, always the same, in the norm of the modes. Where it is larger
    than in the training, errors grow faster than they did there. The motion without the change is found, or known: x (s, n) after
    the steps `kept` (s,) and its first velocities v (n,). Also the CPU time [s] of the motion with the change, which costs what the
    model costs. NaN where a motion fails, and in scenes with events and controllers, which have no guarded runs.
    """
    steps, lift = steps_in(case.scheme, case.duration), case.system.lift
    change = np.random.default_rng(0).normal(size=case.system.size)
    change *= PERTURBED * case.system.scale / float(np.linalg.norm(change))
    try:
        leg = Leg(case.system, replace(case.scheme, start="reference"), case.newton, steps, steps)
        start = leg.now
        if x is None or v is None:
            x = leg.take(steps).x.copy()
        else:
            start = start._replace(q=lift(x[0]), rate=np.asarray(lift.matrix @ v))
        leg.put(start._replace(rate=start.rate + np.asarray(lift.matrix @ change)), case.scheme.start == "equilibrium")
        before, rows = leg.cpu_s, np.arange(steps + 1) if kept is None else kept
        apart = leg.take(steps).x[rows] - x
    except (SolverError, InputError):
        return math.nan, math.nan
    largest = float(np.linalg.norm(apart, axis=1).max())
    return largest / (PERTURBED * case.system.scale * case.duration), leg.cpu_s - before


@dataclass(frozen=True)
class Window:
    """A span of the motion that one of the models ran."""

    model: str  #: "reduced" or "full"
    begin: float  #: [s]
    end: float
    steps: int
    unknowns: int
    why: str = ""  #: why it ended


@dataclass(frozen=True)
class Enrichment:
    """What a visit to the full model added."""

    time: float  #: [s]
    modes: Mapping[str, int]  #: by component
    unknowns: int  #: of the reduced model then
    cpu_s: float
    taken: bool  #: whether the reduced model went on with it


@dataclass(frozen=True)
class Guarded:
    """A guarded run: its motion in the full system's unknowns, and how it came about."""

    motion: Trajectory
    windows: tuple[Window, ...]
    enrichments: tuple[Enrichment, ...]
    full: Statistics
    reduced: Statistics
    indicator: float  #: int I dt of the reduced windows [m s]
    budget: float  #: largest one [m s]
    growth: float  #: of errors, over that of the training, see `growth`; NaN where the reduced model alone has no motion
    looking_s: float  #: CPU time of the indicator


def reduction_of(task: TrainingTask, system: System, known: Known) -> TrainedReduction:
    """What makes the reduced system of a file of the full system of a task; InputError where that has other bodies or joints."""
    raw, names = task.family({}).system, set(system.constraints.names)
    require_same("bodies", {name for name, *_ in system.coordinates}, {name for name, *_ in raw.coordinates})
    if spans := [name for name, *span in system.coordinates if [name, *span] not in [list(one) for one in raw.coordinates]]:
        got = f"others of {', '.join(spans)}"
        raise InputError(say("--guard", "the meshes on which the model was trained", got, "give the scene of its training"))
    if lost := sorted({joint for joint, _ in names - set(raw.constraints.names)}):
        got = f"a scene without {', '.join(lost)}"
        raise InputError(say("--guard", "the joints of the reduced model", got, "give the scene of its training"))
    lift = system.lift
    V, apart, found = np.asarray(lift.matrix), lift.offset - lift(system.x0), dict[str, Basis]()
    for name, members in known.components.items():
        rows = rows_of(raw, members)
        first, last = next(((k, m) for key, k, m in system.components if key == name), (0, V.shape[1]))
        W, modes = metric_of(raw, rows), V[rows, first:last]
        if known.eliminate:  # columns of other components are among them
            u, s = pod.left_singular(W, modes)
            modes = u[:, s > pod.SAME * s[0]]
        against = 0 if known.eliminate else count_against(modes, inner_constraints(raw, rows)[0])
        found[name] = Basis(np.ascontiguousarray(modes), apart[rows], np.ones(modes.shape[1]), against=against)
    q = (V @ known.states.T).T + lift.offset
    bare = TrainedReduction(found, frozenset(names), left_out=dict.fromkeys(known.left_out, ""))
    if not known.selections:
        return with_rule(task, bare, q)
    plain = reduced_models.with_rows(reduced_models.project(task, found, raw), bare.rows)
    rule = Rule(partial(sampling.apply, selections=known.selections), known.selections)
    return replace(bare, rule=rule, runs=(TrainingRun(raw, plain, lambda: q),))


def require_same(what: str, own: set[str], other: set[str]) -> None:
    """InputError where a scene has not the bodies of a model."""
    if own != other:
        lost, more = sorted(own - other), sorted(other - own)
        parts = [*([f"no {', '.join(lost)}"] if lost else []), *([f"also {', '.join(more)}"] if more else [])]
        expected = f"the {what} of the reduced model ({', '.join(sorted(own))})"
        raise InputError(say("--guard", expected, " and ".join(parts), "give the scene of its training"))


def count_against(modes: np.ndarray, A: np.ndarray) -> int:
    """How many of modes (n, r), the last ones, open the linear rows A (m, n) inside of their component."""
    if not len(A):
        return 0
    opens = np.abs(A @ modes).max(axis=0) > OPENED * np.abs(modes).max() * np.abs(A).max()
    return int(np.sum(opens))


def with_rule(task: TrainingTask, bare: TrainedReduction, q: np.ndarray) -> TrainedReduction:
    """The reduction with its hyper-reduction trained on states q (s, q); with all points where no weights keep its tolerance."""
    raw = task.family({}).system
    run = TrainingRun(raw, reduced_models.with_rows(reduced_models.project(task, bare.bases, raw), bare.rows), lambda: q)
    try:
        rule = hyper_reduction.train(task.plan.hyper, [run])
    except SolverError:
        rule = PLAIN
    return replace(bare, rule=rule, runs=(run,))


def enriched(
    task: TrainingTask, own: TrainedReduction, tolerance: float, times: np.ndarray, q: np.ndarray, others: Sequence[np.ndarray]
) -> TrainedReduction:
    """The reduction with what its bases lack of states q (s, q) at times (s,) [s], but for eps = `tolerance` of their square.

    Hyper-reductions are trained on these and on `others` (k, q).
    """
    raw, found = task.family({}).system, {}
    start = raw.lift(raw.x0)
    for name, members in task.plan.components.items():
        rows = rows_of(raw, members)
        A, a = inner_constraints(raw, rows)
        X = satisfy(q[:, rows] - start[rows] - own.bases[name].mean, A, 0 * a).T
        found[name] = pod.extended(own.bases[name], X, tolerance, metric_of(raw, rows), mass_of(raw, rows))
    plain = reduced_models.project(task, found, raw)
    names, few = plain.constraints.names, slice(None, None, max(1, len(q) // kept_rows.FEW))
    free = kept_rows.independent_rows([kept_rows.sample_rows(raw, plain, q[few], times[few])]) if names else ()
    rows_kept = own.rows | {names[k] for k in free if ".".join(names[k]) not in own.left_out}
    return with_rule(task, replace(own, bases=found, rows=rows_kept), np.vstack([*others, q]))


class Record:
    """The motion so far: what outputs read of every stored state, and some states in the unknowns of the full system."""

    def __init__(self, form: System, raw: System, scheme: GeneralizedAlpha, kept: np.ndarray, states: int | None) -> None:
        self.form, self.raw, self.scheme, self.kept = form, raw, scheme, kept
        self.chosen = np.arange(len(kept)) if states is None else evenly(0, len(kept) - 1, min(states, len(kept)))
        self.nearest = projector(form.lift.matrix)  #: unknowns of body coordinates; factors took a fifth of a run, block by block
        self.start = np.empty(0)  #: (q,) the first state
        self.done = 0  #: steps
        self.parts = list[Trajectory]()
        self.readers = dict[int, tuple[Compiled, Tracer]]()

    def add(self, leg: Leg, block: Trajectory, done: int) -> None:
        """Add a block of steps, whose first state, after `done` steps, is known but at the start of the motion."""
        self.done = done + len(block.times) - 1
        model, tracer = self.reader(leg)
        numbers = done + np.arange(len(block.times))
        rows = np.flatnonzero(np.isin(numbers, self.kept) & ((numbers > done) | (done == 0)))
        if not len(rows):
            return
        every = len(rows) == rows[-1] - rows[0] + 1  # views cost nothing, rows by number a copy
        stored = replace(block.part(slice(rows[0], rows[-1] + 1) if every else rows), system=model.system)
        tracer.last = block.part(slice(0, 1))
        mine = np.flatnonzero(np.isin(np.searchsorted(self.kept, numbers[rows]), self.chosen))
        part, work = self.lifted(stored.part(mine)), None if stored.work is None else stored.work.copy()
        self.parts.append(replace(part, times=stored.times, work=work, trace=tracer.trace(model, stored), kept=mine))
        tracer.clear = tracer.clear or tracer.is_clear(self.parts[-1])

    def reader(self, leg: Leg) -> tuple[Compiled, Tracer]:
        """What reads the states of a model: reactions by the rows of the full system."""
        if id(leg) not in self.readers:
            system, lift = replace(leg.system, full=self.raw), leg.system.lift
            tracer, _ = tracer_of(leg.run.model, self.scheme, int(self.kept[-1]), len(self.kept), 1)
            tracer.start = project(lift.matrix, self.start - lift.offset)
            self.readers[id(leg)] = replace(leg.run.model, system=system), tracer
        return self.readers[id(leg)]

    def lifted(self, motion: Trajectory) -> Trajectory:
        """States in the unknowns of the full system; multipliers that a model does not know are 0."""
        lift = self.form.lift
        q, v, a = lifted(motion)
        x, v, a = (np.ascontiguousarray(self.nearest(part.T).T) for part in (q - lift.offset, v, a))
        known = {name: motion.multipliers[:, k] for k, name in enumerate(motion.system.constraints.names)}
        none = np.zeros(len(q))
        forces = [known.get(name, none) for name in self.form.constraints.names]
        multipliers = np.stack(forces, axis=1) if forces else np.zeros((len(q), 0))
        return Trajectory(self.form, motion.times, x, v, a, multipliers, memory=motion.memory)

    def motion(self, statistics: Statistics) -> Trajectory:
        """The whole motion so far."""
        return replace(joined_parts(self.parts, self.parts[-1]), statistics=statistics)


class Guard:
    """A run by a reduced model where its indicator holds, and by the full one elsewhere."""

    def __init__(
        self,
        task: TrainingTask,
        own: TrainedReduction,
        known: Known,
        budget: float,
        record: Record,
        trained: np.ndarray,
        progress: Progress,
    ) -> None:
        self.task, self.own, self.known, self.budget, self.record = task, own, known, budget, record
        self.case, self.progress = task.family({}), progress
        self.raw, self.steps = self.case.system, int(record.kept[-1])
        self.window = max(LOOKS, min(WINDOW, self.steps // FEWEST // LOOKS * LOOKS))  #: steps
        self.visit = FIRST * self.window  #: steps of the next visit to the full model
        self.weights = np.sqrt(self.raw.weight * self.raw.metric.diagonal())
        self.used, self.looking_s, self.failed = 0.0, 0.0, 0
        self.excess = 1.0  #: of the indicator that was not trusted last, over what was allowed
        self.windows, self.enrichments, self.legs = list[Window](), list[Enrichment](), list[Leg]()
        self.ahead = dict[int, tuple[Trajectory, Handed]]()  #: what the reduced model does alone, by the first step of a block
        self.masks = dict[int, np.ndarray]()  #: rows of the residual that count, over their weights, by model
        self.seen = [trained]  #: (k, q) states that hyper-reductions are trained on
        self.cpu, self.wall = clock.process_time(), clock.perf_counter()

    @cached_property
    def full(self) -> Leg:
        """The full model, once it is needed."""
        return Leg(self.record.form, self.case.scheme, self.case.newton, self.steps, AT_ONCE * self.window)

    def reduced(self) -> Leg:
        """The reduced model, as its bases are now."""
        case = reduced_models.reduced_case(self.task, self.own, {})
        scheme = replace(case.scheme, start="reference")  # where a motion starts is told by the full model
        self.legs.append(Leg(case.system, scheme, case.newton, self.steps, AT_ONCE * self.window))
        return self.legs[-1]

    def run(self) -> Guarded:
        """The whole motion; SolverError, with the motion so far, where the full model has none."""
        own = self.reduced()
        self.growth = errors.over(self.look_ahead(own), self.known.growth)
        if not self.growth <= 1.0:
            self.budget *= 1.0 / self.growth if self.growth > 0.0 else 0.0  # nothing where that motion fails
        handed = self.full.now if self.case.scheme.start == "equilibrium" else own.now
        leg: Leg | None = own
        self.record.start = handed.q
        try:
            while handed.done < self.steps:
                if leg is not None:
                    handed = self.hold(leg, handed)
                if handed.done < self.steps:
                    leg, handed = self.leave(handed, leg is not None)
        except SolverError as error:
            error.partial = self.record.motion(self.cost) if self.record.parts else None
            raise
        full = self.full.cost if "full" in self.__dict__ else Statistics()
        reduced = total([leg.cost for leg in self.legs])
        found = self.record.motion(self.cost), tuple(self.windows), tuple(self.enrichments), full, reduced
        return Guarded(*found, self.used, self.budget, self.growth, self.looking_s)

    def look_ahead(self, leg: Leg) -> float:
        """`growth` of the reduced model alone, whose motion is kept: what is trusted of it need not be run again."""
        case = reduced_models.reduced_case(self.task, self.own, {})
        if self.case.scheme.start == "equilibrium":
            return growth(case)[0]
        start = leg.now
        try:
            while (done := leg.run.done) < self.steps:
                found = leg.take(AT_ONCE * self.window)
                self.ahead[done] = found.part(np.arange(len(found.times))), leg.now
        except SolverError:
            return math.nan
        finally:
            leg.put(start)
        blocks = [block for block, _ in self.ahead.values()]
        return growth(case, np.vstack([*(block.x[:-1] for block in blocks), blocks[-1].x[-1:]]), blocks[0].v[0])[0]

    def allowed(self, done: int) -> float:
        """The largest mean of the indicator [m] over the next window: RATE times that which uses up the budget by the end."""
        left = self.steps - done
        return max(self.budget - self.used, 0.0) / (self.case.scheme.step * max(left / RATE, min(left, self.window)))

    def indicators(self, leg: Leg, block: Trajectory) -> Iterator[tuple[int, float]]:
        """Steps of the windows of a block, and the mean of the indicator [m] over each."""
        begun, stride, last = clock.process_time(), self.window // LOOKS, len(block.times) - 1
        rows = np.union1d(np.arange(stride, last, stride), last)
        if id(leg) not in self.masks:
            self.masks[id(leg)] = errors.mask(self.raw, leg.system) / self.weights
        R = errors.full_residual(compile_system(self.raw), block.part(rows)) * self.masks[id(leg)]
        found = errors.scaling(self.case.scheme) * np.linalg.norm(R, axis=1)
        self.looking_s += clock.process_time() - begun
        for k in range(0, len(rows), LOOKS):
            mine = slice(k, k + LOOKS)
            yield int(rows[mine][-1] - (rows[k - 1] if k else 0)), float(found[mine].mean())

    def hold(self, leg: Leg, handed: Handed) -> Handed:
        """Go on with a reduced model as far as it is trusted: the state there."""
        begin, why = handed.done, ""
        if begin or self.case.scheme.start == "equilibrium":
            leg.put(handed, consistent=True)
        while not why and handed.done < self.steps:
            trusted = 0
            try:
                known = self.ahead.get(handed.done)
                block, after = known or (leg.take(AT_ONCE * self.window), leg.now)
                for many, mean in self.indicators(leg, block):
                    if not mean <= (most := self.allowed(handed.done + trusted)):
                        why, self.excess = f"its indicator of {mean:.2g} m is above {most:.2g} m", errors.over(mean, most)
                        break
                    self.used += mean * many * self.case.scheme.step
                    trusted += many
            except SolverError as error:
                why, self.excess = f"a step of it fails: {error.reason.value}", 1.0
            if why and trusted:
                leg.put(handed)
                block, after = leg.take(trusted), leg.now
            if trusted:
                self.record.add(leg, block, handed.done)
                self.seen.append(body_coordinates(block.part(np.array([-1]))))
                handed = after
            self.progress(handed.done / self.steps)
        self.ahead.clear()
        self.note("reduced", begin, handed.done, leg, why)
        return handed

    @property
    def tolerance(self) -> float:
        """eps of what the basis lacks that brings the indicator below what is allowed: errors follow its root."""
        return self.task.plan.tolerance * min(1.0, (MARGIN * self.excess) ** -2) if self.excess < math.inf else 0.0

    def leave(self, handed: Handed, anew: bool) -> tuple[Leg | None, Handed]:
        """Go on with the full model, whose states go into the basis: a reduced model that follows it, or None, and the state.

        It is where it was, or set `anew` to the state of a reduced model.
        """
        full = self.full
        if anew and handed.done:
            full.put(handed)
        large = self.legs[-1].system.size > MOST * full.system.size
        last = self.failed >= TRIES or large or self.tolerance < FINEST
        states, times = list[np.ndarray](), list[np.ndarray]()
        end = self.steps if last else min(handed.done + self.visit, self.steps)
        while full.run.done < end:
            done = full.run.done
            block = full.take(min(AT_ONCE * self.window, end - done))
            self.record.add(full, block, done)
            few = block.part(evenly(0, len(block.times) - 1, max(2, SNAPSHOTS * AT_ONCE * self.window // self.visit)))
            states.append(body_coordinates(few))
            times.append(few.times)
            self.progress(full.run.done / self.steps)
        self.note("full", handed.done, end, full, "" if end == self.steps else "its states are in the basis")
        self.visit *= 2
        if end == self.steps:
            return None, full.now
        found = self.follow(handed, np.concatenate(times), np.concatenate(states))
        self.failed = self.failed + 1 if found is None else 0
        return found, full.now

    def follow(self, handed: Handed, times: np.ndarray, q: np.ndarray) -> Leg | None:
        """The reduced model with states q (s, q) in its basis, if it follows the full one over the steps that gave them."""
        begun, before = clock.process_time(), {name: basis.modes.shape[1] for name, basis in self.own.bases.items()}
        self.own = enriched(self.task, self.own, self.tolerance, times, q, self.seen)
        self.seen.append(q)
        leg, end = self.reduced(), self.full.now
        leg.put(handed, consistent=True)
        taken = True
        try:
            while taken and (done := leg.run.done) < end.done:
                block = leg.take(min(AT_ONCE * self.window, end.done - done))
                self.excess = max(errors.over(mean, self.allowed(end.done)) for _, mean in self.indicators(leg, block))
                taken = self.excess <= 1.0
        except SolverError:
            taken = False
        if taken:
            apart = float(sizes(self.raw, (leg.now.q - end.q)[None])[0])
            taken = apart <= self.known.distance * self.budget / self.known.indicator
        more = {name: basis.modes.shape[1] - before[name] for name, basis in self.own.bases.items()}
        spent = clock.process_time() - begun
        self.enrichments.append(Enrichment(end.done * self.case.scheme.step, more, leg.system.size, spent, taken))
        return leg if taken else None

    def note(self, model: str, begin: int, end: int, leg: Leg, why: str) -> None:
        """Add a window to the report."""
        h = self.case.scheme.step
        self.windows.append(Window(model, h * begin, h * end, end - begin, leg.system.size, why))

    @property
    def cost(self) -> Statistics:
        """What all models cost so far, and all else."""
        found = total([*([self.full.cost] if "full" in self.__dict__ else []), *(leg.cost for leg in self.legs)])
        seconds = clock.process_time() - self.cpu, clock.perf_counter() - self.wall
        return replace(found, cpu_s=seconds[0], wall_s=seconds[1])


def total(costs: Sequence[Statistics]) -> Statistics:
    """The sum of the costs of some runs."""
    names = "steps", "iterations", "factorisations", "halved", "cpu_s", "wall_s"
    sums = {name: sum(getattr(one, name) for one in costs) for name in names}
    return Statistics(**sums, solver=costs[-1].solver)


def run(
    task: TrainingTask,
    own: TrainedReduction,
    known: Known,
    budget: float,
    every: int | np.ndarray = 1,
    states: int | None = FEW,
    progress: Progress | None = None,
) -> Guarded:
    """The motion of the full system of a task by its own reduction, see `reduction_of`, as far as that holds.

    `budget` [m s] bounds the integral of the indicator, `every` and `states` are those of `dynamics.integrate`. SolverError, with
    the motion so far, where the full model has none.
    """
    case = task.family({})
    record = Record(
        task.form(case.system), case.system, case.scheme, kept_steps(every, steps_in(case.scheme, case.duration)), states
    )
    trained = own.runs[0].motion()
    return Guard(task, own, known, budget, record, trained, progress or (lambda part: None)).run()
