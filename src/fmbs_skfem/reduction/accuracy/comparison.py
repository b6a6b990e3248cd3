r"""Comparison of the models of one system: the full one, then every reduced, coarser and
larger-step one, error beside cost.

    e_max = max_t |q - (qbar + U xi)|_M / max_t |q - q0|_M,      e_mean,      d = max_t max_S |r - r_full|      (`errors`)
    training with its full run pays after so many runs      (`costs.Payoff`)

Models on other meshes have other coordinates: they are compared along the centre lines. Planar
membranes without stiffness damping have their exact polynomial beside ECSW; another hyper-reduction
that the plan names stands beside them.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from ...core.errors import FmbsError, InputError, say
from ...core.notices import Progress
from ...core.storage.records import dataclass
from ...dynamics.trajectory import Trajectory
from ...systems.system import System
from .. import cases, full_runs, reduced_models
from ..cases import Case
from ..full_runs import FullRun, TrainingTask
from ..hyper import polynomial
from ..hyper.hyper_reduction import NONE, USUAL, HyperReduction
from ..hyper.polynomial import Exact
from ..hyper.sampling import Elements, Points
from ..plan import newton_for, newton_of_reduced, with_components
from ..reduced_models import ReducedModel, TrainedReduction
from ..spaces.component import system_level
from ..spaces.ffrf import reduce_floating
from . import costs, output_errors
from .errors import Errors, compare
from .output_errors import OutputError
from .runs import TimeError, common_steps, kept_steps, run_fastest, run_other_steps, step_error

LEVELS = ("system", "component")
FEW = 20  #: stored states at which models are compared, at least, or all
FULL = ("full", "coarse", "step", "chosen")  #: families of full models


@dataclass(frozen=True)
class ComparisonOptions:
    """What is compared beside the models of the task's plan.

    Further eps and eta make more reduced models of every level, steps more full runs.
    """

    tolerances: tuple[float, ...] = ()  #: further eps
    hyper_tolerances: tuple[float, ...] = ()  #: further eta
    steps: tuple[float, ...] = ()  #: other steps of the full model [s]
    ffrf_modes: int | None = None
    repeat: int = 2  #: runs of which the fastest counts
    order: bool = True  #: observe the order in time by a quarter of the step
    #: only the steps in `steps` give the error of the step, which is not halved twice
    expensive: bool = False
    #: also run models without hyper-reduction where there is an exact polynomial
    plain: bool = True


@dataclass(frozen=True)
class ModelRecord:
    """One model: sizes, cost, errors against the full model. NaN or None where it has no such
    number.

    Errors are those of `errors.compare` against the full motion; `cpu_s` and `wall_s` [s] are the
    least of its runs.
    """

    name: str
    family: str
    status: str = "done"  #: or the reason why there are no errors
    level: str = ""  #: "system", "component" or "invariant" of reduced models with bases
    hyper: str = ""  #: name of their hyper-reduction
    main: bool = False  #: of the plan's own eps and eta, as the floating frame is
    dofs: int = 0  #: unknowns; of full models all coordinates
    modes: Mapping[str, int] = field(default_factory=dict)  #: by component
    elements: Mapping[str, int] = field(default_factory=dict)  #: cells in use, by component
    #: quadrature points in use, by component
    points: Mapping[str, int] = field(default_factory=dict)
    #: what a hyper-reduction that samples has chosen, by component
    kept: Mapping[str, int] = field(default_factory=dict)
    #: coordinates touched by the cells in use, by component
    dofs_kept: Mapping[str, int] = field(default_factory=dict)
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
    #: of these elastic forces and tangents: time of a call, measured apart, times the calls
    force_s: float = math.nan
    solve_s: float = math.nan  #: the same for factors and solutions
    product_s: float = math.nan  #: the same for products with the modes
    kr_us: float = math.nan  #: CPU time of one elastic tangent [us]
    snnls_s: Mapping[str, float] = field(default_factory=dict)  #: CPU time, by component
    training_s: float = 0.0  #: CPU time, without the full run
    max_error: float = math.nan
    mean_error: float = math.nan
    median_error: float = math.nan
    position_error: float = math.nan  #: [m]
    #: largest error of an output over its range, against a finer mesh and step: that of mesh, step
    #: and model together
    true_error: float = math.nan
    outputs: Mapping[str, OutputError] = field(default_factory=dict)  #: errors by column
    distance_error: float = math.nan  #: largest, root mean square over the mass [m]
    coordinates_error: float = math.nan  #: largest of eq. (53)
    coordinates_mean: float = math.nan  #: eq. (48)
    iterations: int = 0
    factorisations: int = 0
    pays_after_runs: float | None = None  #: None: never, or nothing was trained
    #: whether its mesh or step is finer than that of the full model, whose own error is then what
    #: they differ by
    finer: bool = False


@dataclass(frozen=True)
class Comparison:
    """All models, and the motions of those that pictures show.

    `comparison["system"]` is the record of that name. `motions`, `errors` and `models` are those of
    the main models that ran.
    """

    records: tuple[ModelRecord, ...]
    full: Trajectory
    motions: Mapping[str, Trajectory]
    errors: Mapping[str, Errors]
    models: Mapping[str, ReducedModel]
    time_error: TimeError | None  #: None where the full model was run with one step only
    truth: str = ""  #: what true errors are against
    #: that excite the inputs of a plant, see `training_signals`
    signals: Mapping[str, object] = field(default_factory=dict)

    def __getitem__(self, name: str) -> ModelRecord:
        return next(record for record in self.records if record.name == name)


@dataclass(frozen=True)
class Truth:
    """The reference of true errors, and full models that accuracies choose."""

    motion: Trajectory
    about: str  #: its cells and steps, in words
    #: systems by name, with their steps [s], the error above which one is divided, see
    #: `dynamics.GeneralizedAlpha`, and Newton's tolerance
    chosen: Mapping[str, tuple[System, float, float, float]]


@dataclass(frozen=True)
class Model:
    """What is run, and the reduced model that it comes from, if any."""

    case: Case
    reduced: ReducedModel | None = None


@dataclass(frozen=True)
class ModelJob:
    """A model to be made, run and compared."""

    record: ModelRecord  #: as far as it is known before
    make: Callable[[], Model]
    ready: Trajectory | None = None


@dataclass(frozen=True)
class Reference:
    """What all models are compared with."""

    raw: System  #: with all multipliers
    full: Trajectory
    outputs: Mapping[str, np.ndarray]  #: columns (s,) of the full run
    step: float  #: [s]
    kept: np.ndarray  #: numbers of the steps that are stored
    repeat: int  #: runs of which the fastest counts
    #: what true errors are against, with its columns
    truth: tuple[Trajectory, Mapping[str, np.ndarray]] | None = None


def run(
    task: TrainingTask,
    options: ComparisonOptions,
    coarse: Mapping[int, System] | None = None,
    progress: Progress | None = None,
    see: Callable[[Trajectory], None] | None = None,
    truth: Truth | None = None,
) -> Comparison:
    """Everything about one system, a task without parameters; `coarse` are the same on coarser
    meshes, by cells a body.

    `see` gets the full motion before any other model runs. With a `truth` all models have their
    true errors beside those against the full one.

    A reduced or coarse model that fails is a record with its reason; a failure of the full model is
    raised. It runs twice where its snapshots need a sharper iteration than itself: the sharp motion
    is the reference, the other one is timed, as the models are, when nothing is left to compile.
    """
    raw = task.family({})
    own = replace(raw, system=task.form(raw.system))
    kept = kept_steps(raw, task.interval)
    h = raw.scheme.step
    check_steps(options.steps, h, kept)
    sharp = replace(
        own, newton=newton_for(own.newton, min((task.plan.tolerance, *options.tolerances)))
    )
    cases.run(replace(own, duration=2 * h))  # compiles, so that no run is charged for it
    full = run_fastest(sharp, kept, options.repeat if sharp == own else 1)
    if see:
        see(full)
    sharpest = (truth.motion, output_errors.columns(truth.motion)) if truth else None
    reference = Reference(
        raw.system, full, output_errors.columns(full), h, kept, options.repeat, sharpest
    )
    fine = run_other_steps(own, kept, options.steps, options.order, options.expensive)
    jobs = [
        *reduced_jobs(task, options, full_runs.run_of_motion(task, full)),
        *competitors(task, own, options, coarse or {}, fine),
    ]
    jobs += chosen_models(task, own, truth) if truth else []
    records = []
    motions = {}
    found = {}
    models = {}
    for number, job in enumerate(jobs):
        record, model, motion, errors = evaluate(job, reference)
        records.append(record)
        if record.main and model and motion and errors:
            motions[record.name], found[record.name] = motion, errors
            if model.reduced:
                models[record.name] = model.reduced
        if progress:
            progress((number + 1) / (len(jobs) + 1))
    own_run = full if sharp == own else run_fastest(own, kept, options.repeat)
    job = ModelJob(ModelRecord("full", "full", step=h), lambda: Model(own), own_run)
    itself = evaluate(
        job, replace(reference, full=own_run, outputs=output_errors.columns(own_run))
    )[0]
    shown = tuple(add_ratios([itself, *records], full.statistics.cpu_s))
    return Comparison(
        shown, full, motions, found, models, step_error(full, fine, h), truth.about if truth else ""
    )


def variants(task: TrainingTask) -> list[tuple[str, HyperReduction]]:
    """Levels and hyper-reductions that are compared, with the eta of the plan; invariant bases are
    a level where it has them.
    """
    hyper = task.plan.hyper
    exact = polynomial.possible(task.family({}).system)
    eta = hyper.tolerance or USUAL
    found: list[tuple[str, HyperReduction]] = [(level, NONE) for level in LEVELS]
    found += [*((level, Elements(eta)) for level in LEVELS), ("component", Points(eta))]
    found += [("system", Points(eta)), *((level, Exact()) for level in LEVELS)] if exact else []
    if task.plan.invariant:
        found += [
            ("invariant", NONE),
            ("invariant", Points(eta)),
            *([("invariant", Exact())] if exact else []),
        ]
    known = {one.name for _, one in found}
    return found + [(level, hyper) for level in LEVELS if hyper.name not in known]


def reduced_jobs(
    task: TrainingTask, options: ComparisonOptions, data: FullRun
) -> Iterator[ModelJob]:
    """The main models, then those of the other eps and eta (named `model eps/eta`), then the
    floating frame.
    """
    raw = task.family({})
    plan = task.plan
    h = task.family({}).scheme.step
    usual = replace(plan, invariant=False)
    plans = {
        "system": with_components(usual, system_level(raw.system)),
        "component": usual,
        "invariant": plan,
    }

    @functools.cache
    def base(level: str, eps: float) -> tuple[TrainingTask, TrainedReduction]:
        mine = replace(task, plan=replace(plans[level], tolerance=eps))
        return mine, reduced_models.project_runs(mine, [data])

    def model(level: str, eps: float, hyper: HyperReduction) -> Model:
        mine, reduction = base(level, eps)
        made = reduced_models.finish(mine, reduced_models.hyper_reduce(reduction, hyper))
        return Model(made.cases({}), made)

    def job(level: str, eps: float, hyper: HyperReduction, main: bool) -> ModelJob:
        family = f"{level}+{hyper.label}" if hyper.label else level
        eta = hyper.tolerance
        name = family if main else f"{family} {short(eps)}" + (f"/{short(eta)}" if eta else "")
        newton = newton_of_reduced(raw.newton, eps).tolerance
        record = ModelRecord(
            name,
            family,
            "done",
            level,
            hyper.name,
            main,
            step=h,
            newton=newton,
            tolerance=eps,
            hyper_tolerance=eta,
        )
        return ModelJob(record, lambda: model(level, eps, hyper))

    with contextlib.suppress(FmbsError):  # what fails here, the models themselves will say
        compile_training(*base("component", plan.tolerance))
    found = variants(task)
    if not options.plain and polynomial.possible(raw.system):
        found = [(level, hyper) for level, hyper in found if hyper is not NONE]
    for level, hyper in found:
        yield job(level, plan.tolerance, hyper, True)
    for level, eps, hyper in with_other_tolerances(found, plan.tolerance, options):
        yield job(level, eps, hyper, False)
    if options.ffrf_modes:
        count = options.ffrf_modes
        yield ModelJob(
            ModelRecord("ffrf", "ffrf", main=True, step=h),
            lambda: Model(replace(raw, system=reduce_floating(raw.system, count))),
        )


def with_other_tolerances(
    found: Sequence[tuple[str, HyperReduction]], tolerance: float, options: ComparisonOptions
) -> Iterator[tuple[str, float, HyperReduction]]:
    """Levels and hyper-reductions with the other eps and eta, but for the main ones, whose eps is
    the `tolerance`.
    """
    for eps in dict.fromkeys(options.tolerances):
        for level, hyper in found:
            for other in other_tolerances(hyper, options):
                if (eps, other.tolerance) != (tolerance, hyper.tolerance):
                    yield level, eps, other


def other_tolerances(hyper: HyperReduction, options: ComparisonOptions) -> Iterator[HyperReduction]:
    """A hyper-reduction with its own eta and further ones; one without eta as it is."""
    etas = (hyper.tolerance, *options.hyper_tolerances) if hyper.tolerance else (None,)
    for eta in dict.fromkeys(etas):
        yield replace(hyper, tolerance=eta)


def compile_training(task: TrainingTask, reduction: TrainedReduction) -> None:
    """Compile the training on two snapshots, and the steps."""
    few = tuple(replace(run, motion=lambda run=run: run.motion()[:2]) for run in reduction.runs)  # type: ignore[misc]
    rough = reduced_models.hyper_reduce(replace(reduction, runs=few), Elements(0.5))
    case = reduced_models.finish(task, rough).cases({})
    cases.run(replace(case, duration=2 * case.scheme.step))


def check_steps(steps: Sequence[float], h: float, kept: np.ndarray) -> None:
    """Refuse other steps that meet the stored states of the full run at few instants: their errors
    would be those of few states.
    """
    for step in steps:
        if (common := len(common_steps(step, h, kept))) < min(FEW, len(kept)):
            expected = f"a step that meets at least {min(FEW, len(kept))} of the {len(kept)} stored states of the full model"
            remedy = (
                f"take {h:g} s times or over a whole number, or {h:g} s times a simple fraction"
            )
            raise InputError(
                say("compare: steps", expected, f"{step:g} s, which meets {common}", remedy)
            )


def competitors(
    task: TrainingTask,
    own: Case,
    options: ComparisonOptions,
    coarse: Mapping[int, System],
    fine: Mapping[float, Trajectory],
) -> Iterator[ModelJob]:
    """Full models on coarser meshes and with other steps."""
    for cells, other in coarse.items():
        make = lambda other=other: Model(replace(own, system=task.form(other)))  # noqa: E731
        finer = other.size > len(own.system.lift.offset)
        yield ModelJob(
            ModelRecord(f"coarse-{cells}", "coarse", finer=finer, step=own.scheme.step), make
        )
    for step in options.steps:
        ready = next((motion for known, motion in fine.items() if math.isclose(known, step)), None)
        make = functools.partial(Model, cases.with_step(own, step))
        finer = step < own.scheme.step
        yield ModelJob(
            ModelRecord(f"step-{short(step)}", "step", finer=finer, step=step), make, ready
        )


def chosen_models(task: TrainingTask, own: Case, truth: Truth) -> Iterator[ModelJob]:
    """Full models with the cells and the step that accuracies choose."""
    for name, (system, step, local_error, tolerance) in truth.chosen.items():
        make = functools.partial(chosen_model, task, own, system, step, local_error, tolerance)
        yield ModelJob(ModelRecord(name, "chosen", step=step), make)


def chosen_model(
    task: TrainingTask, own: Case, system: System, step: float, local_error: float, tolerance: float
) -> Model:
    case = cases.with_step(replace(own, system=task.form(system)), step)
    scheme, newton = (
        replace(case.scheme, local_error=local_error),
        replace(case.newton, tolerance=tolerance),
    )
    return Model(replace(case, scheme=scheme, newton=newton))


def evaluate(
    job: ModelJob, reference: Reference
) -> tuple[ModelRecord, Model | None, Trajectory | None, Errors | None]:
    """Make a model, run it, and compare it with the full one."""
    record = job.record
    full = reference.full
    try:
        model = job.make()
    except FmbsError as error:
        return replace(record, status=str(error)), None, None, None
    case = model.case
    record = add_sizes(replace(record, newton=case.newton.tolerance), model, reference.raw)
    try:
        motion = job.ready or run_fastest(
            case, common_steps(case.scheme.step, reference.step, reference.kept), reference.repeat
        )
        errors = compare(full, motion)
        outputs = output_errors.compare(full, motion, reference.outputs)
        true = (
            output_errors.measure(
                output_errors.compare(reference.truth[0], motion, reference.truth[1])
            )
            if reference.truth
            else math.nan
        )
    except FmbsError as error:
        return replace(record, status=str(error)), model, None, None
    cost = motion.statistics
    parts = costs.shares(motion, case.scheme)
    record = replace(
        record,
        constraints=len(motion.system.constraints.names),
        cpu_s=cost.cpu_s,
        wall_s=cost.wall_s,
        force_s=parts.force_s,
        solve_s=parts.solve_s,
        product_s=parts.product_s,
        kr_us=1e6 * costs.tangent_seconds(case.system),
        outputs=outputs,
        true_error=true,
        **errors.summary,
        iterations=cost.iterations,
        factorisations=cost.factorisations,
    )
    return record, model, motion, errors


def add_sizes(record: ModelRecord, model: Model, raw: System) -> ModelRecord:
    """Modes, cells, points and products of a model."""
    system = model.case.system
    made = model.reduced
    if made is None:
        return replace(
            record, dofs=len(system.lift.offset) if record.family in FULL else system.size
        )
    width = costs.bandwidth(raw)
    cells = costs.kept_cells(system)
    dofs = costs.by_component(costs.touched(raw, cells), made.components)
    return replace(
        record,
        dofs=system.size,
        modes=dict(made.modes),
        **costs.kept_by_component(system, made.components),
        dofs_kept=dofs,
        bandwidth=width,
        multiplications=costs.multiplications(dofs, made.modes, width),
        kept={selection.component: len(selection.sample.indices) for selection in made.selections},
        snnls_s={selection.component: selection.snnls_s for selection in made.selections},
        training_s=made.training_s,
    )


def add_ratios(records: Sequence[ModelRecord], full_s: float) -> Iterator[ModelRecord]:
    """Records with the speed-up in theory and the runs after which training, on a full run of CPU
    time `full_s`, pays.
    """
    full = records[0].cpu_s
    system = next((record.multiplications for record in records if record.name == LEVELS[0]), 0)
    for record in records:
        ratio = system / record.multiplications if record.multiplications and system else math.nan
        pays = (
            costs.Payoff(full, record.training_s + full_s, record.cpu_s).runs
            if record.training_s
            else None
        )
        yield replace(record, speed_up=ratio, pays_after_runs=pays)


def short(x: float) -> str:
    """A number as `1.25e-4`."""
    mantissa, exponent = f"{x:.3e}".split("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"
