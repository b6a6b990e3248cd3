"""From a Scene to a System: files become bodies, names become places, times become numbers of
steps.

Strings of the scene are resolved here, once; whatever does not fit is reported with file, line and
key path.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..bodies import body as bodies
from ..bodies import plate as plates
from ..bodies.body import Body
from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.values import expressions
from ..core.values.arguments import checked
from ..core.values.expressions import Expression
from ..core.values.fields import Count
from ..core.values.inputs import Source
from ..shapes import meshes
from ..shapes.solids import solid
from ..shapes.solids.skin import surface_of
from ..shapes.solids.solid import Solid
from ..systems import assembly
from ..systems.connections import edges
from ..systems.system import System, is_linear
from . import plausibility, times
from .analyses.analysis import History
from .consistency import functions, places
from .yamlfile import where

if TYPE_CHECKING:
    from .analyses.dynamic import Dynamic
    from .schema import Scene

LARGE = 500  #: functions of a plate above which sparse factors are used, which turn with it where constraints are multipliers
MANY = 500  #: linear constraints, a dense column of the factors' inverse each, above which they are eliminated all the same
SUBJECT = re.compile(r"(body|joint|load|output|controller|event|monitor) '([^']*)'")


@checked
def system(
    scene: Scene, cells: Count | None = None, allow_outside: bool = False, pictures: bool = True
) -> System:
    """The system of a scene with all multipliers; `chosen_form` makes of it the one that is solved.

    `cells` remeshes every cable with that many cells, `allow_outside` permits meshes outside the
    scene's project folder; without `pictures` it has nothing that only these show. Raises
    InputError for meshes, places, edges and functions of time that do not fit, with file, line and
    path of keys.

        >>> from fmbs_skfem import scenes, systems
        >>> from fmbs_skfem.scenes import build
        >>> raw = build.system(scenes.read("examples/double_pendulum.yaml"))
        >>> raw
        <System 1212 unknowns, 6 constraints: I, II>
        >>> systems.eliminate(raw)
        <System 1206 unknowns, 0 constraints: I, II>
    """
    check_functions(scene)  # before meshes are read
    return of_parts(scene, parts(scene, cells, allow_outside), pictures)


def check_files(scene: Scene, allow_outside: bool = False) -> None:
    """Files of bodies are there, and within the project: before anything of them is read."""
    for body, model in scene.bodies.items():
        try:
            for key, name in model.files().items():
                path = meshes.path(name, scene.folder, allow_outside)
                if not path.is_file():
                    remedy = "paths count from the folder of the scene; `fmbs demo --copy` copies the meshes of the examples"
                    meshes.present(path, f"{key} {path}", remedy)
        except InputError as error:
            raise InputError(f"{where(scene, 'bodies', body)}: {error}") from error


def parts(scene: Scene, cells: int | None = None, allow_outside: bool = False) -> list[Body]:
    """The bodies of a scene; arguments as those of `system`.

    A warning is shown of files that look as if they were in mm, and of bodies that move and turn
    about an origin that is not their centre of mass.
    """
    found = [_body(scene, name, cells, allow_outside) for name in scene.bodies]
    looks = plausibility.file_unit, plausibility.file_material, plausibility.without_center
    for look, part in itertools.product(looks, found):
        if (odd := look(scene, part.name, part)) is not None:
            notify(f"{where(scene, *odd.keys)}: {odd}")
    return found


def of_parts(scene: Scene, parts: list[Body], pictures: bool = True) -> System:
    """The system of a scene with its bodies made; without `pictures` for those who look at numbers
    only.
    """
    _check_places(scene, {part.name: part for part in parts})
    initial = scene.initial.bodies if scene.analysis.moves else {}
    joints = scene.joints.values()
    loads = scene.loads.values()
    more: dict[str, Any] = {"inputs": sources(scene), "controllers": scene.controllers.values()}
    if scene.analysis.moves:
        more |= {"events": scene.events, "monitors": scene.monitors.values()}
    try:
        system = assembly.assemble(
            parts, joints, loads, scene.damping, scene.outputs, initial, pictures, **more
        )
    except InputError as error:
        raise InputError(locate_message(scene, str(error))) from error
    if any(part.shapes for part in parts):
        from ..parts import unbent_places

        unbent_places.warn_unbent(system, parts)
    return system


def sources(scene: Scene) -> list[Source]:
    """Inputs and tables of a scene."""
    return [
        *scene.inputs.values(),
        *(one.table for one in scene.tables.values() if one.table is not None),
    ]


def locate_message(scene: Scene, message: str) -> str:
    """A message of the assembly, which begins with the joint, load or output that it is about, with
    its file and line.
    """
    keys = subject(scene, message)
    return f"{where(scene, *keys)}: {message}" if keys and keys[0] != "bodies" else message


def subject(scene: Scene, message: str) -> tuple[str, ...]:
    """Keys of what a message begins with, such as "joint 'gear'"; none where that is nothing of the
    scene.
    """
    if (found := SUBJECT.match(message)) is None:
        return ()
    section = "bodies" if found[1] == "body" else f"{found[1]}s"
    return (section, found[2]) if found[2] in getattr(scene, section) else ()


def chosen_form(scene: Scene, full: System) -> System:
    """The form in which the scene wants its full system solved: without its linear constraints, or
    with all multipliers.

    Unless the scene chooses, motions of plates of more than LARGE functions keep multipliers, up to
    MANY linear constraints, and everything else is eliminated.
    """
    few = int(is_linear(full.constraints).sum()) <= MANY
    multipliers = few and scene.analysis.moves and has_large_plates(scene, full)
    form = scene.analysis.constraints or ("multipliers" if multipliers else "eliminate")
    return full if form == "multipliers" else assembly.eliminate(full)


def has_large_plates(scene: Scene, full: System) -> bool:
    """Whether a plate or shell of the scene has more than LARGE functions."""
    sizes = {name: (last - first) // full.dim for name, first, last in full.coordinates}
    return any(model.has_surface and sizes[name] > LARGE for name, model in scene.bodies.items())


def snapshot_steps(scene: Scene) -> np.ndarray:
    """Numbers of the steps, 0 first, whose states train the reduced models."""
    analysis = dynamic(scene)
    if scene.reduction is None:
        raise InputError(say(f"{scene.path or 'scene'}", "a section 'reduction'", "none", "add it"))
    return times.snapshots(scene.reduction.snapshots, analysis.step, analysis.duration)


def dynamic(scene: Scene) -> Dynamic:
    """The analysis of a scene that has steps."""
    if not scene.analysis.moves:
        raise InputError(
            say(f"{scene.path or 'scene'}: analysis.type", "dynamic", scene.analysis.word)
        )
    return cast("Dynamic", scene.analysis)


def stepped(scene: Scene) -> Dynamic:
    """The analysis of a scene whose motion its scheme alone makes, as that of families and reduced
    models.
    """
    from .analyses.dynamic import Dynamic

    analysis = dynamic(scene)
    if type(analysis).solve is not Dynamic.solve:
        got = f"{analysis.word}, whose class has a 'solve' of its own"
        remedy = "families, sweeps and reduced models run without it: give the class a 'scheme' instead, or use fmbs run"
        raise InputError(
            say(where(scene, "analysis"), "a motion by the steps of its scheme", got, remedy)
        )
    return analysis


def history(scene: Scene) -> History:
    """The analysis of a scene that finds states over time or over the load factor."""
    if not isinstance(scene.analysis, History):
        wanted = "one with outputs, such as dynamic or static"
        raise InputError(
            say(f"{scene.path or 'scene'}: analysis.type", wanted, scene.analysis.word)
        )
    return scene.analysis


def _body(scene: Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    try:
        found = scene.bodies[name].build(scene, cells, allow_outside)
        if not isinstance(found, Body):
            raise InputError(
                say(f"class {type(scene.bodies[name]).__qualname__}: build", "a Body", repr(found))
            )
        return found
    except InputError as error:
        raise InputError(f"{where(scene, 'bodies', name)}: {error}") from error


def _check_places(scene: Scene, parts: dict[str, Body]) -> None:
    """Every place, edge and face of joints, loads and outputs is one of its body; all that are not
    are listed.
    """
    wrong: list[str] = []
    for keys, place in places(scene):
        try:
            bodies.locate(parts[place.body], place.place)
        except InputError as error:
            wrong.append(f"{where(scene, *keys)}: {error}")
    for keys, name, found in _groups(scene):
        try:
            _check_groups(parts[name], keys[-1], found)
        except InputError as error:
            wrong.append(f"{where(scene, *keys)}: {error}")
    if wrong:
        raise InputError("\n".join(wrong))


def _groups(scene: Scene) -> Iterator[tuple[tuple[str, ...], str, tuple[str, ...]]]:
    """Key path, body and names of all edges and faces."""
    for group, items in (("joints", scene.joints), ("loads", scene.loads)):
        for name, item in items.items():
            for key in ("edges", "faces"):
                if getattr(item, key, ()):
                    yield (group, name, key), getattr(item, "body", ""), getattr(item, key)


def _check_groups(part: Body, key: str, names: tuple[str, ...]) -> None:
    where = f"body '{part.name}'"
    shape = surface_of(part.space)
    if shape is None:
        raise InputError(say(where, "a plate, shell or solid", "another body"))
    if key == "edges":
        plates.edge(where, shape, names)
    elif isinstance(part.space, Solid):
        solid.nodes_of(where, part.space, names)
    else:
        edges.chosen(where, shape, names)


def check_functions(scene: Scene) -> None:
    """Histories and drives are finite at every step of the analysis."""
    instants = scene.analysis.instants()
    for keys, function in functions(scene, ("loads", "joints"), Expression):
        expressions.check(
            function, instants, f"{where(scene, *keys)}: {str(keys[0])[:-1]} '{keys[1]}'"
        )
