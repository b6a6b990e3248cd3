"""Full, reduced, coarser and larger-step models of one scene, the error beside the time."""

from __future__ import annotations

import contextlib
import math
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import InputError, say
from ..core.notices import Progress
from ..core.storage.records import dataclass
from ..reduction import training_signals
from ..reduction.accuracy import comparison as comparisons
from ..reduction.accuracy.comparison import Comparison, ModelRecord
from ..results import frames as frames_
from ..results import motion, series, speed
from ..results.rendering import painter
from ..scenes import Scene, build, examples, read
from ..systems.signals import with_inputs
from . import figures, plans, reports, tables
from . import job as jobs
from .job import Job
from .planning import truth
from .result import ReportTable, Result, conclude, list_files
from .running import compiling, pictures, webpages
from .running.outcome import SERIES
from .running.solving import extremes

if TYPE_CHECKING:
    from ..dynamics import Trajectory

RECORD = "compare.json"
SECOND = 1.5  #: smallest observed order in time that counts as second
DISTANCES = "the largest distances from the full model [m]"
#: factor to the smallest error of a hyper-reduced model within which the fastest is chosen
AS_GOOD = 2.0

DEMO_WANTED = 1e-2, 1e-3  #: accuracies whose choices stand beside the models of the demo
COARSE = [10, 20]
STEPS = [2.5e-3]  #: cells a body and steps [s] of the full models that compete in the demo


@dataclass(frozen=True)
class ComparisonPictures:
    """Pictures of a comparison: of the full motion, which are drawn while the other models run, and
    of an error.
    """

    still: str = pictures.PICTURE
    moving: str = pictures.ANIMATION
    error: str = pictures.ERROR
    frames: int = pictures.FRAMES  #: instants of the animation, and of the VTK series
    rate: float = 15.0  #: how many of them the animation shows a second
    series: bool = False  #: whether there is a VTK series

    @property
    def names(self) -> list[str]:
        """Names of all files."""
        return [self.still, self.moving, self.error, *([f"{SERIES}.pvd"] if self.series else [])]


PICTURES = (".png", ".gif")
DEMO_SHOWN = ComparisonPictures(
    "full.png", "motion.gif", "reduced.png", frames=41, rate=14.0, series=True
)


@dataclass(frozen=True, repr=False, kw_only=True)
class ComparisonResult(Result):
    """All models of a scene, with time and error."""

    study: Comparison

    def __getitem__(self, name: str) -> ModelRecord:
        """Sizes, times and errors of a model."""
        return self.study[name]


def compare_scene(
    job: Job, quick: bool, picture: bool, true: bool, html: bool = False
) -> ComparisonResult:
    """All models of a scene, with pictures of its full model and of an error; `true` errors beside
    those against that model.
    """

    scene = jobs.read_scene(job)
    shown = ComparisonPictures() if picture else None
    return conclude(comparison(job, scene, quick, shown, truth.WANTED if true else (), html))


def demo_scene() -> Scene:
    """The scene of the demo."""
    return lean(read(examples.folder() / examples.DEMO))


def show_demo(job: Job, tables: bool) -> ComparisonResult:
    """All models of the scene of the demo, with pictures of its own and a VTK series; all `tables`,
    or the gist of them.
    """
    found = comparison(job, jobs.read_scene(job), True, DEMO_SHOWN, DEMO_WANTED)
    return conclude(found if tables else replace(found, lines=gist(found)))


def gist(found: ComparisonResult) -> list[Any]:
    """Time and error of the full and the best reduced model, the error of the step, places of
    pictures, the cheapest models.
    """
    study, report = found.study, found.report
    full = study["full"]
    best = choice(study)
    times = report["time_error"]
    rows = [("full model", str(full.dofs), f"{full.cpu_s:.2g}", "1", "-")]
    if best is not None:
        gain = f"{full.cpu_s / best.cpu_s:.2g}"
        rows.append(
            (
                f"reduced ({best.name})",
                str(best.dofs),
                f"{best.cpu_s:.2g}",
                gain,
                f"{best.position_error:.1e}",
            )
        )
    if times is not None:
        rows.append(
            (f"error of the step, {times['step']:g} s", "", "", "", f"{times['position']:.1e}")
        )
    moved = f"A flexible double pendulum swings for {study.full.times[-1]:g} s: {len(study.records)} models of it."
    table = ReportTable(
        moved, ("", "unknowns", "CPU [s]", "times as fast", "error [m]"), rows, names=True
    )
    places = [place for place in found.files if place.suffix in PICTURES]
    shown = f"Pictures: {places[0].parent}." if places else "No pictures."
    return [
        table,
        f"{shown} All tables: fmbs demo --tables. Scenes: fmbs demo --copy.",
        *cheapest_words(report),
    ]


def comparison(
    job: Job,
    scene: Scene,
    quick: bool,
    shown: ComparisonPictures | None,
    wanted: Sequence[float] = (),
    html: bool = False,
) -> ComparisonResult:
    """All models of a scene; figures, what is to be `shown`, and a page for the browser (`html`) in
    the output folder.

    Where accuracies are `wanted`, what these choose stands beside them, and all have their true
    errors.
    """
    mark = reports.fingerprint(scene)
    names = [
        *(f"{name}.png" for name in figures.names(scene)),
        *(shown.names if shown else ()),
        *([webpages.PAGE] if html else []),
    ]
    out = jobs.settle_folder(job, (RECORD, *names), mark, RECORD)
    compiling.announce(job, reduces=True)
    with drawing_beside(scene, shown if out else None) as gallery:
        study = run(
            scene,
            quick,
            job.allow_outside,
            job.progress("comparing"),
            gallery.begin if gallery else None,
            wanted,
        )
        report = report_of(scene, study, wanted)
        drawn = figures.draw(scene, study)
        report |= {
            "quick": quick,
            "fingerprint": mark,
            "provenance": reports.provenance(scene),
            "notices": job.notices,
        }

        def orders(folder: Path) -> list[pictures.Order]:
            page = (
                [partial(webpages.compared, scene, study, folder / webpages.PAGE)] if html else []
            )
            return [*page, *(gallery.go_on(study, folder) if gallery else [])]

        missing = jobs.deliver(
            job, report, figures=drawn, orders=orders if html or gallery else None, record=RECORD
        )
    view = [*tables.compared(study, scene.display), *summarise(report), *list_files(report)]
    about = f"{report['scene']}: {', '.join(record.name for record in study.records)}"
    return ComparisonResult(
        about=about, report=report, lines=view, figures=drawn, error=missing, study=study
    )


@dataclass(frozen=True)
class Gallery:
    """Pictures of a comparison that are drawn while it goes on, by a thread that waits for the
    process that draws.
    """

    scene: Scene
    shown: ComparisonPictures
    place: Path  #: for those of the full motion, until the comparison has its results
    pool: ThreadPoolExecutor
    waiting: list[Future[Path]] = field(default_factory=list)

    def begin(self, full: Trajectory) -> None:
        """Order the pictures of the full motion."""
        shown = self.shown
        orders = pictures.scene(
            self.scene, full, self.place, shown.frames, (shown.still, shown.moving), shown.rate
        )
        self.waiting.extend(map(self.pool.submit, orders))

    def go_on(self, study: Comparison, out: Path) -> list[pictures.Order]:
        """Order those of all models, in a folder; all of them are given, where they hang when they
        are drawn.
        """
        orders = pictures.error(self.scene, study, out / self.shown.error)
        if self.shown.series:
            frames = motion.frames(study.full, frames_.spread(study.full.times, self.shown.frames))
            orders.append(partial(series.write, frames, out, SERIES))
        self.waiting.extend(map(self.pool.submit, orders))
        return [partial(self.hang, out, picture) for picture in self.waiting]

    def hang(self, out: Path, picture: Future[Path]) -> Path:
        """A picture, when it is drawn, in a folder; MissingFeature where nothing can be drawn."""
        path = picture.result()
        return Path(shutil.move(path, out / path.name)) if path.parent == self.place else path


@contextlib.contextmanager
def drawing_beside(scene: Scene, shown: ComparisonPictures | None) -> Iterator[Gallery | None]:
    """A gallery for what is shown of a scene; None where nothing is."""
    if shown is None:
        yield None
        return
    with (
        painter.at_hand(True),
        tempfile.TemporaryDirectory(prefix="fmbs-") as place,
        ThreadPoolExecutor(1) as pool,
    ):
        yield Gallery(scene, shown, Path(place), pool)


def run(
    scene: Scene,
    quick: bool = False,
    allow_outside: bool = False,
    progress: Progress | None = None,
    see: Callable[[Trajectory], None] | None = None,
    wanted: Sequence[float] = (),
) -> Comparison:
    """The comparison of a scene, as its sections `reduction` and `compare` say; `see` gets the full
    motion before others run.

    With accuracies `wanted` all errors are true ones beside: see `planning.truth`. All models of a
    plant, whose inputs have ranges, have the same signals for them.
    """
    raw = build.system(scene, allow_outside=allow_outside)
    settings = plans.options(scene, quick, build.has_large_plates(scene, raw))
    coarse = {
        cells: build.system(scene, cells, allow_outside)
        for cells in (scene.compare.coarse if scene.compare else [])
    }
    task = plans.task(scene, raw, plans.plan(scene))
    if signals := training_signals.of_box(task, plans.sections(scene)[1].signals):
        if wanted:
            remedy = "leave the option out, or give the inputs no ranges"
            raise InputError(
                say(
                    "--true",
                    "a scene with a motion of its own",
                    "inputs with ranges, which signals excite",
                    remedy,
                )
            )
        told = signals.histories(task.family({}))
        task = plans.task(scene, with_inputs(raw, told), plans.plan(scene))
        coarse = {cells: with_inputs(system, told) for cells, system in coarse.items()}
    sharpest = truth.find(scene, wanted, allow_outside) if wanted else None
    found = comparisons.run(task, settings, coarse, progress, see, sharpest)
    return replace(found, signals=signals.facts(raw)) if signals else found


def lean(scene: Scene) -> Scene:
    """The scene with few competitors."""
    if scene.compare is None:
        return scene
    return replace(scene, compare=replace(scene.compare, coarse=COARSE, steps=STEPS))


def report_of(scene: Scene, study: Comparison, wanted: Sequence[float]) -> dict[str, Any]:
    """The JSON object of a study, with the cheapest models of the true errors that are `wanted`."""

    best = fastest_that_pays(study)
    chosen = choice(study)
    return {
        "status": "ok",
        "scene": jobs.title(scene),
        **scene.display.note,
        "models": [asdict(record) for record in study.records],
        "outputs": {
            name: extremes(values) for name, values in figures.drawn_outputs(study.full).items()
        },
        "time_error": asdict(study.time_error) if study.time_error else None,
        "truth": study.truth,
        **({"training_signals": study.signals} if study.signals else {}),
        "front": speed.front_in_words(figures.points(study)),
        "pays_after": best.name if best else None,
        "pays_after_runs": best.pays_after_runs if best else None,
        "choice": chosen.name if chosen else None,
        **({"cheapest": cheapest_by_error(study, wanted)} if wanted else {}),
    }


def cheapest_by_error(study: Comparison, wanted: Sequence[float]) -> dict[str, str | None]:
    """Error, as text -> name of the fastest model, full or reduced, whose true error is no larger;
    None where there is none.
    """
    points = figures.points(study)
    best = {f"{error:g}": speed.cheapest(points, error) for error in wanted}
    return {error: point.name if point else None for error, point in best.items()}


def fastest_that_pays(study: Comparison) -> ModelRecord | None:
    """The fastest of the main reduced models whose training pays."""
    paying = [
        record for record in study.records if record.main and record.pays_after_runs is not None
    ]
    return min(paying, key=lambda record: record.cpu_s, default=None)


def choice(study: Comparison) -> ModelRecord | None:
    """The fastest hyper-reduced model, ECSW or exact polynomial, of those about as exact as the
    best of them.
    """
    found = [
        r
        for r in study.records
        if r.main and r.hyper not in ("", "none") and math.isfinite(r.max_error)
    ]
    best = min((r.max_error for r in found), default=0.0)
    return min(
        (r for r in found if r.max_error <= AS_GOOD * best), key=lambda r: r.cpu_s, default=None
    )


def summarise(report: Mapping[str, Any]) -> list[str]:
    """Who is on the Pareto front, how large the error of the time step is, and when training pays."""
    pays = report["pays_after_runs"]
    gain = (
        "Training does not pay."
        if pays is None
        else f"Training of {report['pays_after']} pays after {math.ceil(pays)} runs."
    )
    note = "Names end in eps, or eps/eta, where these are not the scene's. "
    kind = (
        f"true ones, as parts of the ranges of outputs, against {report['truth']}"
        if report["truth"]
        else DISTANCES
    )
    note += f"Errors on the Pareto front are {kind}; training is not in the CPU times."
    excited = tables.excitation(report["training_signals"]) if "training_signals" in report else []
    return [
        report["front"],
        note,
        *excited,
        time_words(report["time_error"]),
        gain,
        *choice_words(report),
        *cheapest_words(report),
    ]


def cheapest_words(report: Mapping[str, Any]) -> list[str]:
    """A line for every true error that was wanted: which model meets it in the least time, and what
    it errs by itself.
    """
    if "cheapest" not in report:
        return []
    models = {model["name"]: model for model in report["models"]}
    lines = ["Cheapest model for each true error (of mesh, step and model, over the range):"]
    for error, name in report["cheapest"].items():
        if name is None:
            lines.append(f"  {error}: none of these models")
            continue
        model = models[name]
        trained = "" if model["family"] in speed.FULL else " after training"
        lines.append(
            f"  {error}: {kind_of(model)}, {model['cpu_s']:.2g} s{trained}, error {model['true_error']:.1e}"
        )
    return lines


def kind_of(model: Mapping[str, Any]) -> str:
    """A model in words: a full one, with the accuracy that chose it, on another mesh, or with
    another step; or a reduced one.
    """
    if model["family"] == "chosen":
        return f"full model with {model['name']}"
    if model["family"] == "full":
        return "full model of the scene"
    return f"{'full model' if model['family'] in speed.FULL else 'reduced'} ({model['name']})"


def time_words(found: Mapping[str, Any] | None) -> str:
    """The error of the time step, beside which errors of reduced models have to be read."""
    if found is None:
        return "The error of the full model's own step is unknown: list half or twice the step under compare.steps."
    order = found["order"]
    text = f"Error of the full model's own step {found['step']:g} s: {found['position']:.2g} m"
    text += "" if order is None else f", observed order {order:.2f}"
    slow = order is not None and order < SECOND
    return (
        f"{text}; below 2, so that a part of the motion is faster than the step resolves."
        if slow
        else f"{text}."
    )


def choice_words(report: Mapping[str, Any]) -> list[str]:
    """Exact polynomial or ECSW, and what happens to the gap between the two levels."""
    models = {model["name"]: model for model in report["models"] if model["status"] == "done"}
    chosen, exact = models.get(report["choice"]), models.get("component+exact")
    if chosen is None or exact is None:
        return []
    text = f"Choice: {chosen['name']}, {chosen['cpu_s']:.3g} s CPU at an error of {chosen['max_error']:.1e}; "
    text += f"the exact polynomial by component takes {exact['cpu_s']:.3g} s at {exact['max_error']:.1e}, without training."
    parts = "Seconds for force and tangent, solves and products are the time of one call, measured apart, times the calls counted; "
    parts += "the total also holds mass, joints, predictor and storing."
    return [text, *gap_words(models), parts]


def gap_words(models: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Whether the system level is less exact than the component level at one eps."""
    pair = [models.get(f"{level}+exact") for level in ("system", "component")]
    if pair[0] is None or pair[1] is None:
        return []
    ratio = pair[0]["max_error"] / pair[1]["max_error"]
    modes = [" + ".join(str(count) for count in model["modes"].values()) for model in pair if model]
    text = f"System against component level at one eps: errors {ratio:.2g} to 1, with {modes[0]} and {modes[1]} modes. "
    return [
        text
        + "Both spaces are cut at the same energy, so neither has to be worse; the source's 40 to 1 is with 46 and 20 + 45."
    ]
