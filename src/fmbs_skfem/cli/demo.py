"""`fmbs demo`: the flexible double pendulum in full and with all reduced models: tables, plots, pictures, a VTK series."""

from __future__ import annotations

from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.errors import MissingFeature
from . import common, reports, screen
from .common import Result, Session

if TYPE_CHECKING:
    from ..reduction.comparison import Comparison
    from ..scenes import Scene

SCENE = "double_pendulum.yaml"
FOLDER = "fmbs-demo"
COARSE, STEPS = [10, 20], [2.5e-3]  #: cells a body and steps [s] of the full models that compete
SHOWN = "component+ecsw"  #: the reduced model whose error is drawn
PICTURES = ("full.png", "reduced.png", "motion.gif")
SERIES = "motion"
FRAMES, RATE = 41, 14.0  #: instants of the animation and of the VTK series, and how many the animation shows a second


@common.command("demo", scene=False)
def command(session: Session) -> Result:
    """Compute a flexible double pendulum in full and with all reduced models.

    Shows time beside error, and writes report, plots, pictures, an animation and a VTK series into ./fmbs-demo (or --out). Files of
    an earlier demo in ./fmbs-demo are replaced.
    """
    from . import compare

    scene = lean(common.read_scene(replace(session, path=examples() / SCENE, changes={})))
    mark, names = reports.fingerprint(scene), (compare.RECORD, *compare.figure_names(scene), *PICTURES, f"{SERIES}.pvd")
    out = reports.folder(replace(session, force=session.force or session.out is None), FOLDER, names, mark, compare.RECORD)
    screen.announce_compiling(scene.path)
    with screen.progress("full and reduced models") as advance:
        study = compare.run(scene, True, session.allow_outside, advance)
    report = compare.report_of(scene, study)
    with ThreadPoolExecutor(2) as pool:
        pictures = draw(scene, study, out, pool)
        files = [out / compare.RECORD, *compare.draw(scene, study, out)]
        try:
            error = None
            files += [picture.result() for picture in pictures]
        except MissingFeature as missing:
            error = missing
    files += [export(study, out)]
    found = {
        **report,
        "fingerprint": mark,
        "provenance": reports.provenance(scene),
        "files": files,
        **({} if error is None else common.failed(error)),
    }
    reports.keep(session, out, found, compare.RECORD)
    view = [*compare.tables(scene, study), *compare.words(report), "written: " + ", ".join(map(str, files))]
    return Result(found, view, error)


def examples() -> Path:
    """The scenes that travel with the package; in a source tree those of the repository."""
    package = Path(__file__).resolve().parents[1]
    packed = package / "_demo" / "examples"
    return packed if packed.is_dir() else package.parents[1] / "examples"


def lean(scene: Scene) -> Scene:
    """The scene with few competitors."""
    if scene.compare is None:
        return scene
    return scene.model_copy(update={"compare": scene.compare.model_copy(update={"coarse": COARSE, "steps": STEPS})})


def draw(scene: Scene, study: Comparison, out: Path, pool: Executor) -> list[Future[Path]]:
    """The full model moving and coloured by curvature, a reduced one by its error; each is drawn by a process of its own."""
    from ..results import frames, pictures
    from ..results.pictures import Look
    from . import picture

    color = picture.color(scene, study.full.system, SHOWN in study.motions)
    wanted = picture.instants(scene, study.full)
    moving = picture.frames(study.full, picture.spread(study.full, FRAMES))
    look = Look(color, title="double pendulum", size=(640, 480))
    files = [pool.submit(pictures.animate, moving, out / "motion.gif", FRAMES, RATE, look)]
    files.append(
        pool.submit(pictures.render, picture.frames(study.full), out / "full.png", wanted, Look(color, title="full model"))
    )
    if SHOWN in study.motions:
        reduced = frames.with_error(picture.frames(study.motions[SHOWN]), picture.frames(study.full))
        files.append(pool.submit(pictures.render, reduced, out / "reduced.png", wanted, Look("error", title=f"{SHOWN}: error")))
    return files


def export(study: Comparison, out: Path) -> Path:
    """The VTK series of the full model."""
    from ..results import series
    from . import picture

    return series.write(picture.frames(study.full, picture.spread(study.full, FRAMES)), out, SERIES)
