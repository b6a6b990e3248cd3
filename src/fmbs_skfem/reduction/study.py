r"""Study of a system: the full model once, then every reduced, coarser and larger-step model against it, error beside cost.

    e_max = max_t |q - (qbar + U xi)| / |q|   (53),      e_mean   (48),      d = max_t max_S |r - r_full|
    error of h from halving the step:  e_h = 4/3 |q_h - q_h/2|,   order = log2 |q_h - q_h/2| / |q_h/2 - q_h/4|
    training pays after  (training + its full run) / (full run - reduced run)  runs

Models on other meshes have other coordinates: their e_max and e_mean are those of the centre lines, |r - r_full| / |r_full|.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.integrate import trapezoid

from ..core.errors import FmbsError, InputError, say
from ..dynamics.integration import GeneralizedAlpha, Newton, Trajectory, integrate
from ..dynamics.outputs import centre_lines, lifted
from ..systems.assembly import eliminate
from ..systems.system import System
from . import costs, files
from .errors import Errors, common_times, compare
from .ffrf import reduce_floating
from .galerkin import Snapshots, snapshots, system_level
from .hyper import Level
from .training import Components, Plan, Trained, newton_for, reduced, sampled

SAMPLES = 2000  #: instants that are compared, at least, where a run has as many steps
PATIENCE = 1.5  #: runs that cost more are not repeated [s]
MAIN = ("system", "component", "system+ecsw", "component+ecsw", "component+ecsw-points")


@dataclass(frozen=True)
class Options:
    """What is run and compared."""

    scheme: GeneralizedAlpha
    duration: float  #: [s]
    interval: float  #: between snapshots [s]
    plan: Plan  #: component level; its eta and eps are those of the main models
    newton: Newton = field(default_factory=Newton)
    tolerances: tuple[float, ...] = ()  #: further eps
    hyper_tolerances: tuple[float, ...] = ()  #: further eta
    steps: tuple[float, ...] = ()  #: other steps of the full model [s]
    ffrf_modes: int | None = None
    repeat: int = 2  #: runs of which the fastest counts
    order: bool = True  #: observe the order in time by a quarter of the step


@dataclass(frozen=True)
class Record:
    """One model: sizes, cost, errors against the full model. NaN or None where it has no such number."""

    name: str
    family: str
    status: str = "done"  #: or the reason why there are no errors
    dofs: int = 0  #: unknowns; of full models all coordinates
    modes: Mapping[str, int] = field(default_factory=dict)  #: by component
    elements: Mapping[str, int] = field(default_factory=dict)  #: cells in use, by component
    points: Mapping[str, int] = field(default_factory=dict)  #: quadrature points in use, by component
    dofs_kept: Mapping[str, int] = field(default_factory=dict)  #: coordinates touched by the cells in use, by component
    bandwidth: int = 0
    multiplications: int = 0  #: p
    speed_up: float = math.nan  #: s in theory, against the system level
    step: float = math.nan  #: [s]
    tolerance: float | None = None  #: eps
    hyper_tolerance: float | None = None  #: eta
    cpu_s: float = math.nan
    wall_s: float = math.nan
    kr_us: float = math.nan  #: CPU time of one elastic tangent [us]
    snnls_s: Mapping[str, float] = field(default_factory=dict)  #: CPU time, by component
    training_s: float = 0.0  #: CPU time, without the full run
    max_error: float = math.nan
    mean_error: float = math.nan
    position_error: float = math.nan  #: [m]
    iterations: int = 0
    factorisations: int = 0
    pays_after_runs: float | None = None  #: None: never, or nothing was trained


@dataclass(frozen=True)
class TimeError:
    """Error of the full model's own step, from halving it."""

    step: float  #: [s]
    difference: float  #: largest distance of centre lines at h and h/2 [m]
    position: float  #: error of h, 4/3 of it [m]
    relative: float  #: the same for the coordinates, largest over time
    order: float | None  #: observed, with h/4


@dataclass(frozen=True)
class Study:
    """All models, and the motions of those that pictures show."""

    records: tuple[Record, ...]
    full: Trajectory
    motions: Mapping[str, Trajectory]
    errors: Mapping[str, Errors]
    trained: Mapping[str, Trained]
    time_error: TimeError

    def __getitem__(self, name: str) -> Record:
        return next(record for record in self.records if record.name == name)


@dataclass(frozen=True)
class Job:
    """A model to be run."""

    name: str
    family: str
    step: float
    make: Callable[[], Trained]
    ready: Trajectory | None = None
    tolerance: float | None = None
    hyper_tolerance: float | None = None


def run(
    raw: System, options: Options, coarse: Mapping[int, System] | None = None, progress: Callable[[float], None] | None = None
) -> Study:
    """Everything about one system (with all multipliers); `coarse` are the same on coarser meshes, by cells a body.

    A reduced or coarse model that fails is a record with its reason; a failure of the full model is raised.
    """
    every = stride(options)
    system, h = eliminate(raw), options.scheme.step
    integrate(system, options.scheme, 2 * h, options.newton)  # compiles, so that no run is charged for it
    full = timed(system, options, h, every)
    newton = newton_for(options.newton, min((options.plan.tolerance, *options.tolerances)))
    taught = full if newton == options.newton else timed(system, replace(options, newton=newton, repeat=1), h, every)
    data = snapshots(taught, options.interval)
    fine = {h / k: timed(system, replace(options, repeat=1), h / k, every * k) for k in ((2, 4) if options.order else (2,))}
    time_error = step_error(full, [fine[step] for step in fine], h)
    jobs = [Job("full", "full", h, lambda: Trained(system), full)]
    jobs += [*reduced_jobs(raw, data, options), *competitors(raw, system, options, coarse or {}, fine)]
    records, motions, found, trained = [], {}, {}, {}
    for number, job in enumerate(jobs):
        record, model, motion, errors = evaluate(job, raw, full, options, every)
        records.append(record)
        if job.name == job.family and job.family != "full" and model and motion and errors:
            motions[job.name], found[job.name], trained[job.name] = motion, errors, model
        if progress:
            progress((number + 1) / len(jobs))
    return Study(tuple(with_ratios(records, taught.statistics.cpu_s)), full, motions, found, trained, time_error)


def stride(options: Options) -> int:
    """Steps between stored states: as many as leave enough samples and divide the interval of the snapshots."""
    between, steps = max(1, round(options.interval / options.scheme.step)), options.duration / options.scheme.step
    return max(d for d in range(1, between + 1) if between % d == 0 and (d == 1 or steps / d >= SAMPLES))


def timed(system: System, options: Options, step: float, every: int) -> Trajectory:
    """The motion, with the least CPU and wall time of several runs."""
    scheme = replace(options.scheme, step=step)
    best = integrate(system, scheme, options.duration, options.newton, every)
    for _ in range(options.repeat - 1 if best.statistics.cpu_s < PATIENCE else 0):
        again = integrate(system, scheme, options.duration, options.newton, every).statistics
        cpu, wall = min(again.cpu_s, best.statistics.cpu_s), min(again.wall_s, best.statistics.wall_s)
        best = replace(best, statistics=replace(best.statistics, cpu_s=cpu, wall_s=wall))
    return best


def step_error(full: Trajectory, fine: Sequence[Trajectory], step: float) -> TimeError:
    """Error of the step from runs with h/2 and, for the order, h/4."""
    first = compare(full, fine[0])
    order = math.log2(first.position_maximum / compare(fine[0], fine[1]).position_maximum) if len(fine) > 1 else None
    return TimeError(step, first.position_maximum, 4 / 3 * first.position_maximum, 4 / 3 * first.maximum, order)


def reduced_jobs(raw: System, data: Snapshots, options: Options) -> Iterator[Job]:
    """The main models, then those of the other eps and eta (named `model eps/eta`), then the floating frame."""
    plan, h = options.plan, options.scheme.step
    levels: dict[str, Components] = {"system": system_level(raw), "component": plan.components}

    @functools.cache
    def base(level: str, tolerance: float) -> Trained:
        modes = None if level == "system" and isinstance(plan.modes, Mapping) else plan.modes
        return reduced(raw, data, replace(plan, components=levels[level], tolerance=tolerance, modes=modes))

    def job(name: str, level: str, sample: Level, eps: float, eta: float | None, suffix: str = "") -> Job:
        def make() -> Trained:
            return base(level, eps) if eta is None else sampled(base(level, eps), data, eta, sample)

        return Job(name + suffix, name, h, make, None, eps, eta)

    main_eta = plan.hyper_tolerance or 1e-3
    with contextlib.suppress(FmbsError):  # compiles the training; what fails here is told by the models themselves
        sampled(base("component", plan.tolerance), replace(data, times=data.times[:2], q=data.q[:2]), 0.5, Level.ELEMENTS)
    kinds = [(name, name.split("+")[0], Level.POINTS if name.endswith("points") else Level.ELEMENTS) for name in MAIN]
    for name, level, sample in kinds:
        yield job(name, level, sample, plan.tolerance, main_eta if "+" in name else None)
    for eps in dict.fromkeys(options.tolerances):
        for name, level, sample in kinds:
            for eta in dict.fromkeys((main_eta, *options.hyper_tolerances)) if "+" in name else (None,):
                if (eps, eta or main_eta) != (plan.tolerance, main_eta):
                    yield job(name, level, sample, eps, eta, f" {short(eps)}" + (f"/{short(eta)}" if eta else ""))
    if options.ffrf_modes:
        count = options.ffrf_modes
        yield Job("ffrf", "ffrf", h, lambda: Trained(reduce_floating(raw, count)))


def competitors(
    raw: System, system: System, options: Options, coarse: Mapping[int, System], fine: Mapping[float, Trajectory]
) -> Iterator[Job]:
    """Full models on coarser meshes and with other steps."""
    h = options.scheme.step
    for cells, other in coarse.items():
        yield Job(f"coarse-{cells}", "coarse", h, functools.partial(eliminated, other))
    for step in options.steps:
        ready = next((motion for known, motion in fine.items() if math.isclose(known, step)), None)
        yield Job(f"step-{short(step)}", "step", step, lambda: Trained(system), ready)


def eliminated(raw: System) -> Trained:
    """A full model as it is run."""
    return Trained(eliminate(raw))


def evaluate(
    job: Job, raw: System, full: Trajectory, options: Options, every: int
) -> tuple[Record, Trained | None, Trajectory | None, Errors | None]:
    """Make a model, run it, and compare it with the full one."""
    record = Record(job.name, job.family, step=job.step, tolerance=job.tolerance, hyper_tolerance=job.hyper_tolerance)
    try:
        model = job.make()
    except FmbsError as error:
        return replace(record, status=str(error)), None, None, None
    record = sizes(record, model, raw)
    try:
        motion = job.ready or timed(model.system, options, job.step, stored(job.step, options.scheme.step, every))
        errors = line_errors(compare(full, motion), full, motion)
    except FmbsError as error:
        return replace(record, status=str(error)), model, None, None
    cost = motion.statistics
    record = replace(
        record,
        cpu_s=cost.cpu_s,
        wall_s=cost.wall_s,
        kr_us=1e6 * costs.tangent_seconds(model.system),
        max_error=errors.maximum,
        mean_error=errors.mean,
        position_error=errors.position_maximum,
        iterations=cost.iterations,
        factorisations=cost.factorisations,
    )
    return record, model, motion, errors


def stored(step: float, h: float, every: int) -> int:
    """Steps between stored states of a run with another step, so that it shares instants with the full run."""
    ratio = every * h / step
    return round(ratio) if ratio >= 1 and math.isclose(ratio, round(ratio)) else 1


def line_errors(errors: Errors, full: Trajectory, other: Trajectory) -> Errors:
    """Errors of the centre lines in the place of those of coordinates that differ in kind."""
    if math.isfinite(errors.maximum):
        return errors
    i, j = common_times(full.times, other.times)
    one, two = positions(full, i), positions(other, j)
    apart, size = np.linalg.norm(one - two, axis=1), np.linalg.norm(one, axis=1)
    mean = float(trapezoid(apart, errors.times) / trapezoid(size, errors.times))
    return replace(errors, relative=apart / size, maximum=float((apart / size).max()), mean=mean)


def positions(motion: Trajectory, samples: np.ndarray) -> np.ndarray:
    """Positions of all centre lines at some samples, (s, x c)."""
    lines = centre_lines(motion.system, lifted(motion)[0][samples])
    return np.hstack([part[:, 0].reshape(len(part), -1) for part in lines.values()])


def sizes(record: Record, model: Trained, raw: System) -> Record:
    """Modes, cells, points and products of a model."""
    system = model.system
    if not model.components:
        full = record.family in ("full", "coarse", "step")
        return replace(record, dofs=len(system.lift.offset) if full else system.size)
    width, cells = costs.bandwidth(raw), costs.kept_cells(system)
    dofs = costs.by_component(costs.touched(raw, cells), model.components)
    modes = {name: basis.modes.shape[1] for name, basis in model.bases.items()}
    return replace(
        record,
        dofs=system.size,
        modes=modes,
        elements=costs.by_component({name: len(numbers) for name, numbers in cells.items()}, model.components),
        points=costs.by_component(costs.kept_points(system), model.components),
        dofs_kept=dofs,
        bandwidth=width,
        multiplications=costs.multiplications(dofs, modes, width),
        snnls_s={selection.component: selection.snnls_s for selection in model.selections},
        training_s=model.training_s,
    )


def with_ratios(records: Sequence[Record], taught: float) -> Iterator[Record]:
    """Records with the speed-up in theory and the runs after which training, on a full run of CPU time `taught`, pays."""
    full = records[0].cpu_s
    system = next((record.multiplications for record in records if record.name == "system"), 0)
    for record in records:
        ratio = system / record.multiplications if record.multiplications and system else math.nan
        gain = full - record.cpu_s
        pays = (record.training_s + taught) / gain if record.training_s and gain > 0 else None
        yield replace(record, speed_up=ratio, pays_after_runs=pays)


def short(x: float) -> str:
    """A number as `1.25e-4`."""
    mantissa, exponent = f"{x:.3e}".split("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"


def run_saved(
    path: Path | str, duration: float, step: float, rho_inf: float = 0.8, newton: Newton | None = None, every: int = 1
) -> Trajectory:
    """The motion of a reduced model that was saved; neither mesh nor full model is needed."""
    if not duration >= step > 0:
        raise InputError(say(f"{path}", "a positive step and a duration of at least one step", f"{step} s and {duration} s"))
    return integrate(files.load(path), GeneralizedAlpha(step, rho_inf), duration, newton or Newton(), every)
