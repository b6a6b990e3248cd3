"""The studies: every function is a command of `fmbs` as well, with its keywords as options and its
docstring as help.

A study opens its source as a `Job`; what does the work is imported when it is called. Annotations
are kept as they are, for the command line, so that those of results stand in quotes.
"""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Unpack

from . import job as jobs
from . import reports
from .options import (
    Argument,
    Duration,
    Html,
    Option,
    OutputOptions,
    Picture,
    Plots,
    Ranges,
    SceneSource,
    Shared,
    Step,
    TimeLimit,
    Units,
    ViewSource,
    examples,
    ranges,
    statistics,
    study,
)
from .result import Result

if TYPE_CHECKING:
    from .checking import Check
    from .comparison import ComparisonResult
    from .greedy_training import TrainingResult
    from .reducing import ReductionResult
    from .running.outcome import Run
    from .sweeping import SweepResult

SCHEMA = "scene.schema.json"
Folder = Annotated[str | Path, Argument("DIR")]


@study
def check(
    source: SceneSource,
    *,
    target: Annotated[
        str | None,
        Option(
            "List what keeps a model of the scene from being exported so.",
            name="for",
            choices=("c", "fmu", "page"),
        ),
    ] = None,
    tables: Annotated[
        bool, Option("Show all tables: bodies, meshes, places, joints, solver.", name="all")
    ] = False,
    duration: Duration = None,
    **shared: Unpack[Shared],
) -> "Check":
    """Read a scene and its meshes, assemble it, and say what it is.

    SCENE is assembled in the form in which it is solved, and its initial state is checked; nothing
    is solved. Some lines say what the model is, what is doubtful and what to do next; with `tables`
    all masses, sizes, places, joints, degrees of freedom, solver, memory and time are shown. A
    warning is shown for units, slenderness and cells that are hardly meant, for redundant joints
    and for bodies that no joint ties to the ground; joints that contradict each other, and initial
    motion that joints forbid, are errors. `out` gets check.json. SCENE may also be a folder with
    results, whose files are compared with their checksums (exit code 8 where one is not as it was
    written). With `target` everything of SCENE is an error that a model of it could not have
    outside: contact, controllers, events, joints by a law.

    In Python `checksums` compares those of a folder.

        >>> from fmbs_skfem import studies
        >>> found = studies.check("examples/double_pendulum.yaml")
        >>> found.report["unknowns"], f"{found.report['mass']:.3f} kg"
        (1206, '0.283 kg')
    """
    from . import checking

    with jobs.begin(source, duration=duration, **shared) as job:
        return checking.check_scene(job, jobs.read_scene(job, plans=False), target, tables)


@study
def checksums(folder: Folder, **shared: Unpack[OutputOptions]) -> Result:
    """Compare the results in a folder with their checksums.

    CorruptFile (exit code 8) names a file that is not as it was written.
    """
    from . import checking

    with jobs.begin(folder, **shared) as job:
        return checking.compare_checksums(job)


@study
def run(
    source: SceneSource,
    *,
    duration: Duration = None,
    step: Step = None,
    plots: Plots = True,
    units: Units = False,
    picture: Picture = False,
    html: Html = False,
    checkpoint: Annotated[
        float | None,
        Option(
            "Store the motion and a checkpoint every so many seconds of wall time and at the end, instead of every 10, which only "
            "runs that take longer need.",
            "SECONDS",
            least=0.0,
        ),
    ] = None,
    time_limit: TimeLimit = inf,
    check: Annotated[
        bool, Option("Run the motion again in half the steps, and say what its step makes wrong.")
    ] = False,
    **shared: Unpack[Shared],
) -> "Run":
    """Solve a scene, or run a saved reduced model.

    SCENE becomes a motion, an equilibrium or vibration modes, as its `analysis` says. `out` gets
    outputs.csv (time in column t), report.json and outputs.png. What a solve that fails has reached
    is kept (exit code 4). A motion that takes long is stored in the folder `history` while it runs:
    `fmbs resume` goes on with one that was stopped. SCENE may also be a reduced model saved by
    `fmbs reduce` or `fmbs train` (NAME.h5), as of `fmbs rom run`.

    In Python a solve that fails raises SolverError, whose `result` is what was reached; `run_model`
    runs saved models.

        >>> from fmbs_skfem import scenes, studies
        >>> fall = '''
        ... schema: 1
        ... dimension: 2
        ... bodies: {ball: {type: point_mass, mass: 2 kg, position: [0, 0]}}
        ... loads: {weight: {type: gravity, acceleration: [0, -10]}}
        ... outputs: {height: {type: position, at: ball, component: y}}
        ... analysis: {type: dynamic, duration: 1 s, step: 10 ms}
        ... '''
        >>> found = studies.run(scenes.loads(fall))
        >>> found.times.shape, f"{found.outputs['height'][-1]:.3f} m"
        ((101,), '-5.000 m')
    """
    from .running import runs

    with jobs.begin(
        source,
        duration=duration,
        plots=plots,
        units=units,
        checkpoint=checkpoint,
        time_limit=time_limit,
        check=check,
        **shared,
    ) as job:
        return runs.run_source(job, step, picture, html)


@study
def resume(
    folder: Folder,
    *,
    plots: Plots = True,
    units: Units = False,
    time_limit: TimeLimit = inf,
    **shared: Unpack[OutputOptions],
) -> "Run":
    """Go on with a run that was stopped.

    The run whose output folder is DIR goes on from its last checkpoint; the numbers are those of a
    run that was never stopped. Every byte that is read is verified, and a scene or mesh that has
    changed since then is refused (exit code 8).

    In Python that raises CorruptFile.
    """
    from .running import resuming

    with jobs.begin(folder, plots=plots, units=units, time_limit=time_limit, **shared) as job:
        return resuming.resume_run(job)


@study
def reduce(
    source: SceneSource,
    *,
    level: Annotated[
        str,
        Option(
            "A basis for each component, or one for the system.", choices=("component", "system")
        ),
    ] = "component",
    tolerance: Annotated[
        float | None, Option("Truncation eps of the bases, instead of the scene's.", "EPS")
    ] = None,
    modes: Annotated[
        int | None,
        Option("Number of modes of each component, instead of a tolerance.", "R", least=1),
    ] = None,
    hyper: Annotated[
        float | None,
        Option("Tolerance eta of the hyper-reduction, instead of the scene's; 0 for none.", "ETA"),
    ] = None,
    sample: Annotated[
        str | None,
        Option(
            "Hyper-reduction instead of the scene's: elements, points, none, exact, the polynomial of planar plates, or one of its "
            "extensions.",
            "NAME",
        ),
    ] = None,
    basis: Annotated[
        str | None,
        Option(
            "Modes of coordinates, or invariant ones, which hold with a state all its rotations, instead of the scene's.",
            "NAME",
            choices=("coordinates", "invariant"),
        ),
    ] = None,
    duration: Duration = None,
    **shared: Unpack[Shared],
) -> "ReductionResult":
    """Train a reduced model of a scene and save it.

    `out` is a file ending in .h5, or a folder for NAME.h5 where NAME.yaml is the scene. The reduced
    model is run over the training time; its errors against the full model there are printed and
    saved with it, and first whether it pays. With an accuracy eps and eta that neither SCENE nor
    options give are the coarsest whose outputs err by at most 0.3 of it.

    In Python the result has the systems and their motions:

        >>> from fmbs_skfem import scenes, studies
        >>> pendulum = '''
        ... schema: 1
        ... dimension: 2
        ... bodies:
        ...   arm: {type: cable, mesh: meshes/beam_5.msh, section: {shape: given, EA: 100 kN, EI: 0.5 N m^2, rhoA: 0.1 kg/m}}
        ... joints: {hinge: {type: pin, at: arm.left}}
        ... loads: {weight: {type: gravity, acceleration: [0, -9.81]}}
        ... analysis: {type: dynamic, duration: 0.2 s, step: 5 ms}
        ... reduction: {snapshots: 5 ms}
        ... '''
        >>> found = studies.reduce(scenes.loads(pendulum), modes=6)
        >>> found.system
        <System 6 unknowns, 0 constraints: arm>
        >>> found.report["position_error"] < 1e-3  # [m]
        True
    """
    from . import plans, reducing

    with jobs.begin(source, duration=duration, **shared) as job:
        scene = jobs.read_scene(job)
        path = jobs.settle_file(job, f"{job.path.stem}.h5")
        plan = plans.plan_with(scene, level, tolerance, modes, hyper, sample, basis)
        return reducing.reduce_scene(
            job, scene, path, plan, plans.goal(scene, job.wanted, tolerance, modes, hyper)
        )


@study
def train(
    source: SceneSource,
    *,
    tolerance: Annotated[
        float | None,
        Option(
            "Wanted error of the outputs as a part of their ranges; eps, eta and the end of the training follow.",
            "ERROR",
        ),
    ] = None,
    iterations: Annotated[
        int | None, Option("Largest number of full runs, instead of the scene's.", "N", least=1)
    ] = None,
    holdout: Annotated[
        int | None,
        Option("Number of hold-out points, instead of the scene's; 0 for none.", "N", least=0),
    ] = None,
    resume: Annotated[
        bool, Option("Only continue an interrupted training; fail if there is none.")
    ] = False,
    duration: Duration = None,
    plots: Plots = True,
    html: Annotated[
        bool,
        Option(
            "Write a page with the model in it, which runs at parameters of its reader's choice."
        ),
    ] = False,
    **shared: Unpack[Shared],
) -> "TrainingResult":
    """Train a reduced model over the ranges of a scene's parameters.

    The sections `training` and `reduction` of SCENE say how. `out` gets model.h5 (run it with
    `fmbs rom run`), report.json and figures, and every run and iteration in the folder `training`
    there: the same call again goes on where it was interrupted, and computes nothing twice. With an
    accuracy 0.3 of it is the wanted error where there is no other, and a training ends without a
    model, with exit code 0, as soon as none can be faster than the full one. The exit code is 4
    where there can be no model.

    In Python that raises NoModel, and `model` is None where none can be faster.
    """
    from . import greedy_training

    with jobs.begin(source, duration=duration, plots=plots, **shared) as job:
        scene = jobs.read_scene(job)
        order = greedy_training.prepare(job, scene, tolerance, iterations, holdout)
        return greedy_training.train_order(
            job, order, greedy_training.folder(job, scene, resume), html
        )


@study
def compare(
    source: SceneSource,
    *,
    quick: Annotated[
        bool,
        Option("Only the main models, coarser meshes and larger steps; every model runs once."),
    ] = False,
    duration: Duration = None,
    picture: Annotated[
        bool, Option("Draw the bodies, moving, and the error of a reduced model.")
    ] = True,
    true: Annotated[
        bool,
        Option(
            "True errors, of mesh, step and model together, and the full models that accuracies of 1e-2 to 1e-4 choose."
        ),
    ] = False,
    html: Html = False,
    **shared: Unpack[Shared],
) -> "ComparisonResult":
    """Compare full and reduced models of a scene: time beside error.

    The reduced models of SCENE stand beside its full model and cheaper full models: coarser meshes,
    larger steps. `out` gets compare.json and figures.
    """
    from . import comparison

    with jobs.begin(source, duration=duration, **shared) as job:
        return comparison.compare_scene(job, quick, picture, true, html)


@study
def sweep(
    source: SceneSource,
    *,
    samples: Annotated[
        int | str | None,
        Option("Number of samples; of a grid also N1xN2x...: values of each parameter.", "N"),
    ] = None,
    design: Annotated[
        str | None,
        Option(
            "How the samples are distributed, sobol by default; saltelli gives Sobol indices of N (d + 2) samples of d parameters.",
            choices=("sobol", "lhs", "grid", "list", "saltelli"),
        ),
    ] = None,
    table: Annotated[str | Path | None, Option("Samples from a table.", "FILE.csv", "list")] = None,
    seed: Annotated[int, Option("Seed of sobol and lhs.", least=0)] = 0,
    ranges: Annotated[
        Ranges | None, Option("Range of a parameter.", "NAME=LOW:HIGH[:log]", "range", read=ranges)
    ] = None,
    scheduler: Annotated[
        str | Executor | None,
        Option(
            "Run on a dask cluster (tcp://host:port) that sees the same files; DASK_SCHEDULER_ADDRESS by default.",
            "ADDRESS",
        ),
    ] = None,
    workers: Annotated[
        int | None, Option("Processes on this machine, one a core by default.", least=1)
    ] = None,
    timeout: Annotated[
        float | None, Option("Give up a sample that takes longer.", "SECONDS")
    ] = None,
    resume: Annotated[
        bool, Option("Go on: with samples that are missing, took too long or were killed.")
    ] = False,
    surfaces: Annotated[
        bool, Option("Fit response surfaces of all outputs: surfaces.json, surfaces.png.")
    ] = False,
    statistics: Annotated[
        Mapping[str, Sequence[str]] | None,
        Option(
            "A statistic of an output over the parameters, as a column of sweep.csv and in statistics.png: min, max, final, range, "
            "mean or rms; may be given several times.",
            "OUTPUT:STATISTIC",
            "statistic",
            read=statistics,
        ),
    ] = None,
    duration: Duration = None,
    instants: Annotated[int, Option("Stored instants of a history, at most.", least=2)] = 601,
    plots: Plots = True,
    **shared: Unpack[Shared],
) -> "SweepResult":
    """Run many samples of a scene or of a saved reduced model, on all cores or on a cluster.

    SCENE is a scene whose parameters have ranges, or a reduced model (NAME.h5) saved by
    `fmbs train`. `out` gets every sample in the folder members when it is done, and at the end
    sweep.csv and sweep.h5 with plots. Samples that fail, hang or lose their process are listed, the
    others finish (exit code 5). Smallest and largest values of outputs are those of all steps, also
    between the stored instants; a warning tells where memory has room for fewer. A column says how
    many reduced parts leave their training.

    In Python a range is ("0.7 GPa", "1.3 GPa", "log"), the scheduler may be any executor of
    concurrent.futures, and samples without a result raise SweepFailure, whose `result` has the
    others.

        >>> from concurrent.futures import ThreadPoolExecutor
        >>> from fmbs_skfem import scenes, studies
        >>> push = '''
        ... schema: 1
        ... dimension: 2
        ... parameters: {m: {value: 2 kg, range: [1 kg, 4 kg]}}
        ... bodies: {ball: {type: point_mass, mass: m, position: [0, 0]}}
        ... loads: {push: {type: point_force, at: ball, force: [8 N, 0]}}
        ... outputs: {way: {type: position, at: ball, component: x}}
        ... analysis: {type: dynamic, duration: 1 s, step: 10 ms}
        ... '''
        >>> threads = ThreadPoolExecutor(1)
        >>> found = studies.sweep(scenes.loads(push), samples=2, design="grid", scheduler=threads)
        >>> found.points.T.tolist(), found.outputs["way"][:, -1].round(3).tolist()  # F t^2 / (2 m)
        ([[1.0, 4.0]], [4.0, 1.0])
    """
    from ..families import response_surfaces, sweeps
    from . import sweep_sources, sweeping

    with jobs.begin(source, duration=duration, plots=plots, **shared) as job:
        members = sweep_sources.members(job, ranges or {}, instants)
        points = sweep_sources.spread(members.parameters, samples, design, table, seed)
        given = scheduler or (None if workers else os.environ.get("DASK_SCHEDULER_ADDRESS"))
        executor, address = (given, None) if isinstance(given, Executor) else (None, given)
        options = sweeps.SweepOptions(workers, address, timeout, executor=executor)
        if surfaces:
            response_surfaces.check_count(members.parameters, len(points))
        indices = design == sweep_sources.SALTELLI
        wanted = statistics or {}
        sweeping.check_statistics(wanted, members.scene)
        return sweeping.sweep_points(
            job, members, points, seed, options, resume, indices, surfaces, wanted
        )


@study
def render(
    source: SceneSource,
    *,
    duration: Duration = None,
    frames: Annotated[int, Option("Frames of the animation.", least=1, most=1000)] = 60,
    gif: Annotated[bool, Option("Draw the animation.")] = True,
    mp4: Annotated[
        bool, Option("Write the animation as MP4 in place of GIF; takes the program ffmpeg.")
    ] = False,
    scale: Annotated[
        float, Option("Draw displacements so many times as large.", "FACTOR", least=0.0, above=True)
    ] = 1.0,
    diagram: Annotated[
        bool, Option("Draw the section forces N, Q, M, T along all cables and beams, diagram.png.")
    ] = False,
    at: Annotated[
        float | None, Option("Instant or load factor of the diagram, in place of the end.", "TIME")
    ] = None,
    html: Html = False,
    **shared: Unpack[Shared],
) -> "Run":
    """Solve a scene and draw pictures (PNG) and an animation (GIF, or MP4).

    `out` gets picture.png, at the instants of the scene's section `pictures`, and animation.gif
    beside what `run` writes; of modes and buckling modes.png with all shapes, and mode_1.gif, ...
    with a period of each; with `diagram` also diagram.png and diagram.csv. Without OpenGL, or for
    MP4 without ffmpeg, these numbers are kept (exit code 7).

    In Python that raises MissingFeature.
    """
    from ..results import video
    from .running import runs

    with jobs.begin(source, duration=duration, **shared) as job:
        ending = video.SUFFIX if mp4 else ".gif"
        return runs.render_scene(job, frames if gif else 0, ending, scale, html, diagram, at)


@study
def view(
    source: ViewSource,
    *,
    html: Annotated[
        str | Path | None,
        Option(
            "The page to write, and not to open; page.html in a folder of results, else SCENE.html.",
            "FILE",
        ),
    ] = None,
    open: Annotated[
        bool, Option("Open the page in the browser, where there are a terminal and a display.")
    ] = True,
    duration: Duration = None,
    instants: Annotated[
        int, Option("Instants of the motion in the page, at most.", least=2, most=5000)
    ] = 601,
    **shared: Unpack[Shared],
) -> Result:
    """Show a motion as a page in the browser.

    SCENE is a scene, a saved reduced model (NAME.h5), or a folder with results of `fmbs run`. The
    page is one file, which needs no network and no server: bodies in space, to turn, scrub and
    play, with the outputs over time beside them. Motions that are not stored in a folder, as those
    of short runs, are run again. The page opens in the browser of who is at the screen; elsewhere
    the path of it is said.
    """
    from .running import viewing

    with jobs.begin(source, duration=duration, **shared) as job:
        return viewing.view(job, None if html is None else Path(html), instants, open)


@study
def report(
    folder: Folder,
    *,
    html: Annotated[
        str | Path | None,
        Option("The page to write; report.html in the folder where it is left out.", "FILE"),
    ] = None,
    bodies: Annotated[
        bool,
        Option(
            "Show the bodies of a motion, which is run again where the folder has no states of it."
        ),
    ] = True,
    instants: Annotated[
        int, Option("Instants of the motion in the page, at most.", least=2, most=5000)
    ] = 601,
    **shared: Unpack[OutputOptions],
) -> Result:
    """Write a folder of results as one page for the browser.

    DIR is a folder of `fmbs run`, reduce, train, sweep, compare, verify or check. The page is one
    file, which needs no network: what was solved, the command that repeats it, warnings, plots, the
    moving bodies of a motion, tables that sort, pictures, versions and checksums.
    """
    from . import folder_report

    with jobs.begin(folder, **shared) as job:
        return folder_report.write(job, None if html is None else Path(html), bodies, instants)


@study
def export(
    source: SceneSource,
    *,
    duration: Duration = None,
    frames: Annotated[int, Option("Instants of the series.", least=1, most=100_000)] = 201,
    matrices: Annotated[
        str | None, Option("Write stiffness, mass and nodes of a body, and solve nothing.", "BODY")
    ] = None,
    **shared: Unpack[Shared],
) -> "Result":
    """Solve a scene and write a VTK series.

    `out` gets motion.pvd with one .vtu for each instant, and motion.vtkhdf with all of them and the
    mesh once, beside what `run` writes: displacement, velocity, strain, curvature and section
    forces, of plates also stress with its axes. Modes and buckling become fields of modes.pvd.

    With `matrices` it gets a body of the scene for other programs and for `type: matrices`:
    BODY.npz, and BODY_K.mtx, BODY_M.mtx (Matrix Market) and BODY_nodes.csv. Unknowns stand node by
    node; gradients, which plates and beams have beside positions, count as nodes of their own.
    """
    from .running import matrices as bodies
    from .running import runs

    with jobs.begin(source, duration=duration, **shared) as job:
        return runs.export_scene(job, frames) if matrices is None else bodies.export(job, matrices)


@study
def verify(
    names: Annotated[
        Sequence[str], Option("A case; may be given several times.", "NAME", "case", read=tuple)
    ] = (),
    groups: Annotated[
        Sequence[str],
        Option("A group of cases; may be given several times.", "GROUP", "group", read=tuple),
    ] = (),
    listed: Annotated[bool, Option("List the cases and solve nothing.", name="list")] = False,
    **shared: Unpack[OutputOptions],
) -> Result:
    """Compare the solver with published and exact results.

    All cases of the verification suite are solved by default. `out` gets verification.md,
    verification.json and a picture of each group. The exit code is 4 when a quantity is off.

    In Python that raises VerificationFailure.
    """
    from .running import verifying

    verification = verifying.load()
    if listed:
        return verification.cases(names, groups)
    with jobs.begin(**shared) as job:
        return verification.verify_cases(job, names, groups)


@study
def cases(names: Sequence[str] = (), groups: Sequence[str] = ()) -> Result:
    """The cases of the verification suite and what they are; nothing is solved."""
    return verify(names, groups, listed=True)


@study
def demo(
    *,
    copy: Annotated[
        bool,
        Option("Copy the example scenes and their meshes into the folder instead, to begin from."),
    ] = False,
    tables: Annotated[bool, Option("Print all tables, with the errors of all outputs.")] = False,
    **shared: Unpack[OutputOptions],
) -> Result:
    """Show an example: a flexible double pendulum in full and reduced.

    Time and error of the full model and of the best reduced one are printed, those of all models
    with `tables`. `out` (fmbs-demo on the command line, where files of an earlier demo are
    replaced) gets report, plots, pictures, an animation and a VTK series. With `copy` it
    (fmbs-examples) gets the scenes that travel with the package, in the folder examples, and the
    meshes that they read.
    """
    from . import comparison, projects

    if copy:
        with jobs.begin(**shared) as job:
            return projects.copy_examples(job)
    with jobs.begin(comparison.demo_scene(), **shared) as job:
        return comparison.show_demo(job, tables)


@study
def new(
    folder: Annotated[str | Path, Argument("NAME")],
    *,
    like: Annotated[
        str | None,
        Option(
            "The example that it is a copy of: NAME where there is one, else double_pendulum.",
            "EXAMPLE",
            choices=examples,
        ),
    ] = None,
    **shared: Unpack[OutputOptions],
) -> Result:
    """Begin a project: copy an example scene and its meshes.

    The folder NAME gets NAME.yaml, which is the example under this name, and the files that it
    reads. Change it, and look at it with `fmbs check`.
    """
    from . import projects

    with jobs.begin(folder, **shared) as job:
        return projects.copy_example(job, like)


@study
def warm(**shared: Unpack[OutputOptions]) -> Result:
    """Compile ahead what ordinary scenes need, so that no first run has to.

    Every kind of model takes some steps: beams, plates, shells, contact, controllers, reduced
    models. It takes some minutes after an installation or update, and seconds where all is
    compiled; the functions are named as they are compiled. What a scene needs beside them is
    compiled at its first run.
    """
    from .running import warming

    with jobs.begin(**shared) as job:
        return warming.compile_ahead(job)


@study
def describe_scenes(
    *,
    page: Annotated[
        bool, Option("Print a page for people (Markdown) instead: every key with what it takes.")
    ] = False,
    **shared: Unpack[OutputOptions],
) -> Result:
    """Print the JSON schema of scene files.

    Editors complete and check YAML by it; `out` gets it as scene.schema.json.
    """
    from ..scenes import json_schema, reference

    with jobs.begin(**shared) as job:
        found = json_schema()
        if (out := jobs.settle_folder(job, [SCHEMA], "schema", SCHEMA)) is not None:
            reports.write_json(out / SCHEMA, found)
        text = reference.page(found).rstrip("\n") if page else reports.dumps(found)
        return Result(about="JSON schema of scene files", report=found, lines=[text])
