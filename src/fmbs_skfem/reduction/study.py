r"""Study of a system: the full model once, then every reduced, coarser and larger-step model against it, error beside cost.

    e_max = max_t |q - (qbar + U xi)|_M / max_t |q - q0|_M,      e_mean,      d = max_t max_S |r - r_full|      (`errors`)
    training pays after  (training + its full run) / (full run - reduced run)  runs

Models on other meshes have other coordinates: they are compared along the centre lines.
Planar membranes without stiffness damping have their exact polynomial beside ECSW; another hyper-reduction that
the plan names stands beside them.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.errors import FmbsError
from ..dynamics.integration import integrate
from ..dynamics.trajectory import Trajectory
from ..systems.assembly import eliminate
from ..systems.system import System
from . import costs, output_errors, polynomial
from .errors import Errors, compare
from .ffrf import reduce_floating
from .galerkin import Snapshots, snapshots, system_level
from .hyper_reduction import NONE, USUAL, HyperReduction
from .output_errors import OutputError
from .polynomial import Exact
from .runs import Options, TimeError, kept_steps, other_steps, sharp_newton, step_error, stored, timed
from .sampling import Elements, Points
from .training import Components, Plan, Trained, hyper_reduced, newton_of_reduced, reduced

LEVELS = ("system", "component")
FULL = ("full", "coarse", "step")  #: families of full models


@dataclass(frozen=True)
class Record:
    """One model: sizes, cost, errors against the full model. NaN or None where it has no such number."""

    name: str
    family: str
    status: str = "done"  #: or the reason why there are no errors
    level: str = ""  #: "system" or "component" of reduced models with bases
    hyper: str = ""  #: name of their hyper-reduction
    main: bool = False  #: of the plan's own eps and eta, as the floating frame is
    dofs: int = 0  #: unknowns; of full models all coordinates
    modes: Mapping[str, int] = field(default_factory=dict)  #: by component
    elements: Mapping[str, int] = field(default_factory=dict)  #: cells in use, by component
    points: Mapping[str, int] = field(default_factory=dict)  #: quadrature points in use, by component
    kept: Mapping[str, int] = field(default_factory=dict)  #: what a hyper-reduction that samples has chosen, by component
    dofs_kept: Mapping[str, int] = field(default_factory=dict)  #: coordinates touched by the cells in use, by component
    bandwidth: int = 0
    multiplications: int = 0  #: p
    speed_up: float = math.nan  #: s in theory, against the system level
    constraints: int = 0  #: rows with multipliers
    step: float = math.nan  #: [s]
    newton: float = math.nan  #: tolerance of Newton's iteration
    tolerance: float | None = None  #: eps
    hyper_tolerance: float | None = None  #: eta
    cpu_s: float = math.nan
    wall_s: float = math.nan
    force_s: float = math.nan  #: of these elastic forces and tangents: time of a call, measured apart, times the calls
    solve_s: float = math.nan  #: the same for factors and solutions
    product_s: float = math.nan  #: the same for products with the modes
    kr_us: float = math.nan  #: CPU time of one elastic tangent [us]
    snnls_s: Mapping[str, float] = field(default_factory=dict)  #: CPU time, by component
    training_s: float = 0.0  #: CPU time, without the full run
    max_error: float = math.nan
    mean_error: float = math.nan
    median_error: float = math.nan
    position_error: float = math.nan  #: [m]
    outputs: Mapping[str, OutputError] = field(default_factory=dict)  #: errors by column
    distance_error: float = math.nan  #: largest, root mean square over the mass [m]
    coordinates_error: float = math.nan  #: largest of eq. (53)
    coordinates_mean: float = math.nan  #: eq. (48)
    iterations: int = 0
    factorisations: int = 0
    pays_after_runs: float | None = None  #: None: never, or nothing was trained


@dataclass(frozen=True)
class Study:
    """All models, and the motions of those that pictures show."""

    records: tuple[Record, ...]
    full: Trajectory
    motions: Mapping[str, Trajectory]
    errors: Mapping[str, Errors]
    trained: Mapping[str, Trained]
    time_error: TimeError | None  #: None where the full model was run with one step only

    def __getitem__(self, name: str) -> Record:
        return next(record for record in self.records if record.name == name)


@dataclass(frozen=True)
class Job:
    """A model to be run."""

    record: Record  #: as far as it is known before
    make: Callable[[], Trained]
    ready: Trajectory | None = None


def run(
    raw: System,
    options: Options,
    coarse: Mapping[int, System] | None = None,
    progress: Callable[[float], None] | None = None,
    form: Callable[[System], System] = eliminate,
) -> Study:
    """Everything about one system (with all multipliers); `coarse` are the same on coarser meshes, by cells a body.

    `form` makes the system that is run as the full model. A reduced or coarse model that fails is a record with its reason; a
    failure of the full model is raised. It runs twice where its snapshots need a sharper iteration than itself: the sharp motion is
    the reference, the other one is timed, as the models are, when nothing is left to compile.
    """
    system, h, kept = form(raw), options.scheme.step, kept_steps(options)
    sharp, own = sharp_newton(options), options.newton
    integrate(system, options.scheme, 2 * h, own)  # compiles, so that no run is charged for it
    full = timed(system, options if sharp == own else replace(options, repeat=1), h, kept, sharp)
    data = snapshots(full, options.interval)
    fine = other_steps(system, options, kept)
    jobs = [*reduced_jobs(raw, data, options), *competitors(raw, system, options, coarse or {}, fine, form)]
    records, motions, found, trained = [], {}, {}, {}
    for number, job in enumerate(jobs):
        record, model, motion, errors = evaluate(job, raw, full, options, kept)
        records.append(record)
        if record.main and model and motion and errors:
            motions[record.name], found[record.name], trained[record.name] = motion, errors, model
        if progress:
            progress((number + 1) / (len(jobs) + 1))
    own_run = full if sharp == own else timed(system, options, h, kept, own)
    itself = evaluate(Job(Record("full", "full", step=h), lambda: Trained(system), own_run), raw, own_run, options, kept)[0]
    told = tuple(with_ratios([itself, *records], full.statistics.cpu_s))
    return Study(told, full, motions, found, trained, step_error(full, fine, h))


def variants(raw: System, plan: Plan) -> list[tuple[str, HyperReduction]]:
    """Levels and hyper-reductions that are compared, with the eta of the plan."""
    eta, exact = plan.hyper.tolerance or USUAL, polynomial.possible(raw)
    found: list[tuple[str, HyperReduction]] = [(level, NONE) for level in LEVELS]
    found += [*((level, Elements(eta)) for level in LEVELS), ("component", Points(eta))]
    found += [("system", Points(eta)), *((level, Exact()) for level in LEVELS)] if exact else []
    known = {hyper.name for _, hyper in found}
    return found + [(level, plan.hyper) for level in LEVELS if plan.hyper.name not in known]


def reduced_jobs(raw: System, data: Snapshots, options: Options) -> Iterator[Job]:
    """The main models, then those of the other eps and eta (named `model eps/eta`), then the floating frame."""
    plan, h = options.plan, options.scheme.step
    levels: dict[str, Components] = {"system": system_level(raw), "component": plan.components}

    @functools.cache
    def base(level: str, tolerance: float) -> Trained:
        modes = None if level == "system" and isinstance(plan.modes, Mapping) else plan.modes
        return reduced(raw, data, replace(plan, components=levels[level], tolerance=tolerance, modes=modes))

    def job(level: str, eps: float, hyper: HyperReduction, main: bool) -> Job:
        family, eta = (f"{level}+{hyper.label}" if hyper.label else level), hyper.tolerance
        name = family if main else f"{family} {short(eps)}" + (f"/{short(eta)}" if eta else "")
        record = Record(
            name, family, level=level, hyper=hyper.name, main=main, step=h, tolerance=eps, hyper_tolerance=hyper.tolerance
        )
        return Job(record, lambda: hyper_reduced(base(level, eps), raw, data, hyper))

    with contextlib.suppress(FmbsError):  # compiles training and steps; what fails here is told by the models themselves
        few = replace(data, times=data.times[:2], q=data.q[:2])
        model = hyper_reduced(base("component", plan.tolerance), raw, few, Elements(0.5))
        integrate(model.system, options.scheme, 2 * h, options.newton)
    found = variants(raw, plan)
    if not options.plain and polynomial.possible(raw):
        found = [(level, hyper) for level, hyper in found if hyper is not NONE]
    for level, hyper in found:
        yield job(level, plan.tolerance, hyper, True)
    for eps in dict.fromkeys(options.tolerances):
        for level, hyper in found:
            for eta in dict.fromkeys((hyper.tolerance, *options.hyper_tolerances)) if hyper.tolerance else (None,):
                if (eps, eta) != (plan.tolerance, hyper.tolerance):
                    yield job(level, eps, replace(hyper, tolerance=eta), False)
    if options.ffrf_modes:
        count = options.ffrf_modes
        yield Job(Record("ffrf", "ffrf", main=True, step=h), lambda: Trained(reduce_floating(raw, count)))


def competitors(
    raw: System,
    system: System,
    options: Options,
    coarse: Mapping[int, System],
    fine: Mapping[float, Trajectory],
    form: Callable[[System], System],
) -> Iterator[Job]:
    """Full models on coarser meshes and with other steps."""
    h = options.scheme.step
    for cells, other in coarse.items():
        yield Job(Record(f"coarse-{cells}", "coarse", step=h), functools.partial(formed, form, other))
    for step in options.steps:
        ready = next((motion for known, motion in fine.items() if math.isclose(known, step)), None)
        yield Job(Record(f"step-{short(step)}", "step", step=step), lambda: Trained(system), ready)


def formed(form: Callable[[System], System], raw: System) -> Trained:
    """A full model as it is run."""
    return Trained(form(raw))


def evaluate(
    job: Job, raw: System, full: Trajectory, options: Options, kept: np.ndarray
) -> tuple[Record, Trained | None, Trajectory | None, Errors | None]:
    """Make a model, run it, and compare it with the full one."""
    eps, step = job.record.tolerance, job.record.step
    newton = newton_of_reduced(options.newton, eps) if eps else options.newton
    record = replace(job.record, newton=newton.tolerance)
    try:
        model = job.make()
    except FmbsError as error:
        return replace(record, status=str(error)), None, None, None
    record = sizes(record, model, raw)
    try:
        motion = job.ready or timed(model.system, options, step, stored(step, options.scheme.step, kept), newton)
        errors, outputs = compare(full, motion), output_errors.compare(full, motion)
    except FmbsError as error:
        return replace(record, status=str(error)), model, None, None
    cost, parts = motion.statistics, costs.shares(motion, replace(options.scheme, step=step))
    record = replace(
        record,
        constraints=len(motion.system.constraints.names),
        cpu_s=cost.cpu_s,
        wall_s=cost.wall_s,
        force_s=parts.force_s,
        solve_s=parts.solve_s,
        product_s=parts.product_s,
        kr_us=1e6 * costs.tangent_seconds(model.system),
        max_error=errors.maximum,
        mean_error=errors.mean,
        median_error=errors.median,
        position_error=errors.position_maximum,
        outputs=outputs,
        distance_error=errors.distance_maximum,
        coordinates_error=errors.coordinates_maximum,
        coordinates_mean=errors.coordinates_mean,
        iterations=cost.iterations,
        factorisations=cost.factorisations,
    )
    return record, model, motion, errors


def sizes(record: Record, model: Trained, raw: System) -> Record:
    """Modes, cells, points and products of a model."""
    system = model.system
    if not model.components:
        return replace(record, dofs=len(system.lift.offset) if record.family in FULL else system.size)
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
        kept={selection.component: len(selection.sample.indices) for selection in model.selections},
        snnls_s={selection.component: selection.snnls_s for selection in model.selections},
        training_s=model.training_s,
    )


def with_ratios(records: Sequence[Record], taught: float) -> Iterator[Record]:
    """Records with the speed-up in theory and the runs after which training, on a full run of CPU time `taught`, pays."""
    full = records[0].cpu_s
    system = next((record.multiplications for record in records if record.name == LEVELS[0]), 0)
    for record in records:
        ratio = system / record.multiplications if record.multiplications and system else math.nan
        gain = full - record.cpu_s
        pays = (record.training_s + taught) / gain if record.training_s and gain > 0 else None
        yield replace(record, speed_up=ratio, pays_after_runs=pays)


def short(x: float) -> str:
    """A number as `1.25e-4`."""
    mantissa, exponent = f"{x:.3e}".split("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"
