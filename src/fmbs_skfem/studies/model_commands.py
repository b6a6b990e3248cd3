"""Studies of saved reduced models and of parts; as all studies, commands of `fmbs` as well, see
`commands`.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Unpack

from ..core import extras
from ..core.errors import InputError, say
from . import job as jobs
from .options import (
    Argument,
    Duration,
    Html,
    ModelFile,
    Option,
    OutputOptions,
    Picture,
    Plots,
    SceneSource,
    Shared,
    Step,
    Units,
    ValueOptions,
    study,
)
from .result import Result

if TYPE_CHECKING:
    from .parts import PartResult
    from .running.outcome import Run

PlacedIn = Annotated[str | Path, Argument("SCENE")]
BodyName = Annotated[str, Option("Name of the body in the scene.", "NAME")]


@study
def info(path: ModelFile, **shared: Unpack[OutputOptions]) -> Result:
    """Say what a saved reduced model is.

    The tables show parameters with their ranges, sizes, training and errors of the model in FILE;
    `out` gets info.json.
    """
    from . import models

    with jobs.begin(path, **shared) as job:
        return models.describe(job)


@study
def run_model(
    path: ModelFile,
    *,
    duration: Duration = None,
    step: Step = None,
    plots: Plots = True,
    units: Units = False,
    picture: Picture = False,
    html: Html = False,
    **shared: Unpack[Shared],
) -> "Run":
    """Run a saved reduced model at values of its parameters, and predict its error there.

    Neither meshes nor the full model are needed. `out` gets outputs.csv (time in column t),
    report.json and outputs.png.
    """
    from . import models

    with jobs.begin(path, duration=duration, plots=plots, units=units, **shared) as job:
        models.require_own_accuracy(job)
        return models.run_saved(job, step, picture, html)


@study
def export_model(
    path: ModelFile,
    *,
    c: Annotated[str | Path | None, Option("Folder for NAME.c and NAME.h.", "DIR")] = None,
    fmu: Annotated[
        str | Path | None, Option("File of an FMU for co-simulation, NAME.fmu.", "FILE")
    ] = None,
    fmi: Annotated[int, Option("Version of FMI, 2 or 3.", "N", least=2, most=3)] = 2,
    name: Annotated[
        str, Option("Name of the model in C, by default that of its file.", "NAME")
    ] = "",
    step: Annotated[
        float | None,
        Option(
            "Time step of a part, by default that of its training alone.",
            "SECONDS",
            least=0.0,
            above=True,
        ),
    ] = None,
    gravity: Annotated[
        str, Option("Acceleration on a part, such as '0, 0, -9.81'; by default none.", "X,Y,Z")
    ] = "",
    shape: Annotated[
        bool, Option("Give an FMU of FMI 3 points of all bodies as an array, and skins as glTF.")
    ] = False,
    **shared: Unpack[ValueOptions],
) -> Result:
    """Write a saved reduced model or a part as C source or as an FMU, for controllers and other
    programs.

    The model in FILE becomes one C99 file and one header: no library, no dynamic memory, the time
    step of this package. An FMU for co-simulation holds these files, and binaries for Windows,
    Linux and macOS with the extra `fmu`, else for this machine. Parameters of a model of a whole
    range are variables, whose range is checked, or have the values of --set.

    A part in FILE (.part.h5) flies freely: forces and torques at its places are inputs, their
    positions, velocities and rotations outputs. Numbers of it may be others than in its training,
    --set young_modulus='2 GPa'.
    """
    extras.need("symbols", "rom export")
    from . import exporting

    with jobs.begin(path, **shared) as job:
        places = None if c is None else Path(c), None if fmu is None else Path(fmu)
        return exporting.export(job, name, *places, fmi, step, gravity, shape)


@study
def train_part(
    source: SceneSource,
    *,
    body: BodyName = "",
    alone: Annotated[
        bool, Option("Train the body alone, with random forces at its connection points.")
    ] = False,
    tolerance: Annotated[
        float | None,
        Option(
            "Truncation eps of the shape functions, by default 1e-12, or from the accuracy.",
            "EPS",
            least=0.0,
            above=True,
        ),
    ] = None,
    modes: Annotated[
        int | None,
        Option(
            "Number of shape functions, rigid motions included, instead of a tolerance.",
            "R",
            least=1,
        ),
    ] = None,
    hyper: Annotated[
        float | None,
        Option(
            "Tolerance eta of the weighted points, by default 3e-5, or from the accuracy; 0 for all points.",
            "ETA",
            least=0.0,
        ),
    ] = None,
    small_strains: Annotated[
        bool,
        Option(
            "Of a solid: a constant stiffness that turns with it, many times as fast as all strains."
        ),
    ] = False,
    runs: Annotated[
        int, Option("Motions of the body alone, pinned at its places in turn.", "N", least=1)
    ] = 2,
    push: Annotated[
        float | None, Option("Forces at its places, by default its weight.", "NEWTON", least=0.0)
    ] = None,
    moment: Annotated[
        float | None,
        Option(
            "Moments at its rims and at ends of lines, by default force times size / 10.",
            "NEWTON-METRE",
            least=0.0,
        ),
    ] = None,
    gravity: Annotated[
        float, Option("Its acceleration, in random directions.", "M/S2", least=0.0)
    ] = 9.81,
    duration: Annotated[
        float | None,
        Option(
            "Of a motion of the body alone, by default 10 sqrt(L/g).",
            "SECONDS",
            least=0.0,
            above=True,
        ),
    ] = None,
    step: Annotated[
        float | None,
        Option(
            "Its step, by default a part in 1500, or in 60 of a period; a quarter where that fails.",
            "SECONDS",
            least=0.0,
            above=True,
        ),
    ] = None,
    slowest: Annotated[
        float | None,
        Option("First frequency of sweeps, by default 0.1 sqrt(g/L).", "HZ", least=0.0),
    ] = None,
    fastest: Annotated[
        float | None, Option("Last frequency of sweeps, by default 1.6 sqrt(g/L).", "HZ", least=0.0)
    ] = None,
    rise: Annotated[
        float,
        Option(
            "Part of a motion over which forces and moments rise; 0: they begin as steps.",
            "PART",
            least=0.0,
            most=1.0,
        ),
    ] = 0.05,
    spin: Annotated[
        float, Option("Its angular velocity at the start, about random axes.", "RAD/S", least=0.0)
    ] = 0.0,
    strain: Annotated[
        float | None,
        Option(
            "Scale all loads until the largest strain of a fibre in its states is this, within 10 %.",
            "VALUE",
            least=0.0,
            above=True,
        ),
    ] = None,
    samples: Annotated[int, Option("States that are kept of a motion.", "N", least=10)] = 600,
    seed: Annotated[int, Option("Of random directions, phases and frequencies.", "N", least=0)] = 0,
    before: Annotated[
        str | Path | None,
        Option(
            "Go on with the training of a part: nothing that it has seen is run again.",
            "FILE",
            "continue",
        ),
    ] = None,
    **shared: Unpack[Shared],
) -> "PartResult":
    """Reduce one body of a scene as a part, which stands in any mechanism.

    The part of `body` is saved into `out`, a file ending in .h5 or a folder for NAME.part.h5. With
    `alone` the body is moved by itself, by its weight, forces and moments; else it is trained on
    the motion of the scene. With `before` the part knows both. With an accuracy eps and eta that
    are not given are the coarsest with which the outputs of the scene err by at most 0.3 of it.
    """
    from ..parts.excitation import Excitation
    from . import parts

    with jobs.begin(source, **shared) as job:
        told = Excitation(
            runs,
            push,
            moment,
            gravity,
            duration,
            slowest,
            fastest,
            step,
            samples,
            rise,
            seed,
            spin,
            strain,
        )
        if not alone and told != Excitation():
            remedy = "give --alone, or leave out what moves the body by itself"
            raise InputError(say("--alone", "it beside the sizes of its motions", "none", remedy))
        known = None if before is None else Path(before)
        excited = told if alone else None
        scene = jobs.read_scene(job)
        return parts.train(job, scene, body, excited, tolerance, modes, hyper, known, small_strains)


@study
def describe_part(path: ModelFile, **shared: Unpack[OutputOptions]) -> "PartResult":
    """Say what a part is.

    The table shows sizes, training, the range of strains and the places of the part in FILE; `out`
    gets info.json.
    """
    from . import parts

    with jobs.begin(path, **shared) as job:
        return parts.describe(job)


@study
def check_part(
    path: ModelFile,
    scene: PlacedIn,
    *,
    body: BodyName = "",
    tolerance: Annotated[
        float | None,
        Option(
            "Use the leading shape functions alone, to this eps; without it all.",
            "EPS",
            least=0.0,
            above=True,
        ),
    ] = None,
    modes: Annotated[
        int | None, Option("Number of these functions, instead of a tolerance.", "R", least=1)
    ] = None,
    hyper: Annotated[
        float | None,
        Option(
            "Tolerance eta of its points, by default by the functions.",
            "ETA",
            least=0.0,
            above=True,
        ),
    ] = None,
    **shared: Unpack[Shared],
) -> "PartResult":
    """Check a part against the full body of a scene.

    SCENE is run with its full `body` and with the part in FILE in its place; the table shows the
    errors of the outputs. With a `tolerance`, `modes` or `hyper` it shows what a scene gets that
    asks for them.
    """
    from ..parts import files as part_files
    from . import parts

    with jobs.begin(scene, **shared) as job:
        return parts.check(
            job,
            jobs.read_scene(job),
            part_files.used(Path(path), tolerance, modes, hyper),
            Path(path),
            body,
        )
