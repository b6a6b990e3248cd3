"""From a Scene to a System: files become bodies, names become places, times become numbers of steps.

Strings of the scene are resolved here, once; whatever does not fit is reported with file, line and key path.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..bodies import body as bodies
from ..bodies import plate as plates
from ..bodies.body import Body
from ..core import expressions
from ..core.errors import InputError, say
from ..core.expressions import Expression
from ..shapes.surface import Surface
from ..systems import assembly, edges
from ..systems.system import Output, System
from . import schema, times
from .consistency import PLACES
from .fields import Place
from .parts import part, remeshed
from .rules import at, joint, load, probe

__all__ = ["system", "chosen_form", "kept_steps", "snapshot_steps", "part", "remeshed", "joint", "load", "probe", "at"]

LARGE = 500  #: functions of a plate above which sparse factors are used, which need constraints as multipliers


def system(scene: schema.Scene, cells: int | None = None, allow_outside: bool = False) -> System:
    """The system of a scene with all multipliers; `cells` remeshes every cable with that many cells.

    `allow_outside` permits meshes outside the scene's project folder.
    """
    _check_functions(scene)
    parts = [_body(scene, name, cells, allow_outside) for name in scene.bodies]
    _check_places(scene, {part.name: part for part in parts})
    initial = {name: _motion(motion) for name, motion in scene.initial.bodies.items()}
    found = assembly.assemble(
        parts,
        [joint(model, name) for name, model in scene.joints.items()],
        [load(model, name) for name, model in scene.loads.items()],
        assembly.Rayleigh(scene.damping.mass, scene.damping.stiffness),
        {name: probe(model) for name, model in scene.outputs.items()},
        initial,
    )
    return replace(found, outputs={name: narrowed(scene, name, output) for name, output in found.outputs.items()})


def narrowed(scene: schema.Scene, name: str, output: Output) -> Output:
    """An output of the system with the one component that the scene wants, in a column of the output's name."""
    model = scene.outputs[name]
    if not isinstance(model, schema.PointOutput) or model.component is None:
        return output
    return replace(output, rows=(output.rows["xyz".index(model.component)],), columns=(name,))


def chosen_form(scene: schema.Scene, full: System) -> System:
    """The form in which the scene wants its full system solved: without its linear constraints, or with all multipliers.

    Unless the scene chooses, motions of plates of more than LARGE functions keep multipliers and everything else is eliminated.
    """
    multipliers = isinstance(scene.analysis, schema.Dynamic) and has_large_plates(scene, full)
    form = scene.analysis.constraints or ("multipliers" if multipliers else "eliminate")
    return full if form == "multipliers" else assembly.eliminate(full)


def has_large_plates(scene: schema.Scene, full: System) -> bool:
    """Whether a plate or shell of the scene has more than LARGE functions."""
    sizes = {name: (last - first) // full.dim for name, first, last in full.coordinates}
    return any(isinstance(model, schema.Plate | schema.Shell) and sizes[name] > LARGE for name, model in scene.bodies.items())


def kept_steps(scene: schema.Scene) -> int | np.ndarray:
    """What `dynamics.integrate` takes as `every`: states to be kept of a dynamic analysis."""
    analysis = dynamic(scene)
    return times.kept(analysis.every, analysis.step, analysis.duration)


def snapshot_steps(scene: schema.Scene) -> np.ndarray:
    """Numbers of the steps, 0 first, whose states train the reduced models."""
    analysis = dynamic(scene)
    if scene.reduction is None:
        raise InputError(say(f"{scene.path or 'scene'}", "a section 'reduction'", "none", "add it"))
    return times.snapshots(scene.reduction.snapshots, analysis.step, analysis.duration)


def dynamic(scene: schema.Scene) -> schema.Dynamic:
    """The analysis of a scene that has steps."""
    if not isinstance(scene.analysis, schema.Dynamic):
        raise InputError(say(f"{scene.path or 'scene'}: analysis.type", "dynamic", scene.analysis.type))
    return scene.analysis


def _motion(model: schema.Motion) -> assembly.Motion:
    return assembly.Motion(model.velocity or (), () if model.angular_velocity is None else model.angular_velocity)


def _body(scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    try:
        return part(scene.bodies[name], scene, name, cells, allow_outside)
    except InputError as error:
        raise InputError(f"{schema.where(scene, 'bodies', name)}: {error}") from error


def _check_places(scene: schema.Scene, parts: dict[str, Body]) -> None:
    """Every place, edge and face of joints, loads and outputs is one of its body; all that are not are listed."""
    wrong: list[str] = []
    for keys, place in _places(scene):
        try:
            bodies.locate(parts[place.body], at(place).place)
        except InputError as error:
            wrong.append(f"{schema.where(scene, *keys)}: {error}")
    for keys, name, found in _groups(scene):
        try:
            _check_groups(parts[name], keys[-1], found)
        except InputError as error:
            wrong.append(f"{schema.where(scene, *keys)}: {error}")
    if wrong:
        raise InputError("\n".join(wrong))


def _places(scene: schema.Scene) -> Iterator[tuple[tuple[str, ...], Place]]:
    for group, items in (("joints", scene.joints), ("loads", scene.loads), ("outputs", scene.outputs)):
        for name, item in items.items():
            for key in PLACES:
                place = getattr(item, key, None)
                if isinstance(place, Place):
                    yield (group, name, key), place


def _groups(scene: schema.Scene) -> Iterator[tuple[tuple[str, ...], str, tuple[str, ...]]]:
    """Key path, body and names of all edges and faces."""
    for group, items in (("joints", scene.joints), ("loads", scene.loads)):
        for name, item in items.items():
            for key in ("edges", "faces"):
                if getattr(item, key, ()):
                    yield (group, name, key), getattr(item, "body", ""), getattr(item, key)


def _check_groups(part: Body, key: str, names: tuple[str, ...]) -> None:
    where = f"body '{part.name}'"
    if not isinstance(part.space, Surface):
        raise InputError(say(where, "a plate or shell", "another body"))
    if key == "edges":
        plates.edge(where, part.space, names)
    else:
        edges.chosen(where, part.space, names)


def _check_functions(scene: schema.Scene) -> None:
    """Histories and drives are finite at every step of the analysis."""
    analysis = scene.analysis
    if not isinstance(analysis, schema.Dynamic):
        return
    if analysis.duration > times.STEPS * analysis.step:
        got = f"{analysis.duration:g} s in steps of {analysis.step:g} s"
        raise InputError(say("duration", f"at most {times.STEPS} steps", got, "shorten it, or lengthen the step"))
    instants = np.minimum(np.arange(int(np.ceil(analysis.duration / analysis.step)) + 1) * analysis.step, analysis.duration)
    for name, model in scene.loads.items():
        history = getattr(model, "history", None)
        if isinstance(history, Expression):
            expressions.check(history, instants, f"load '{name}'")
    for name, drive in scene.joints.items():
        found = getattr(drive, "angle", getattr(drive, "displacement", ()))
        for function in found if isinstance(found, tuple) else (found,):
            expressions.check(function, instants, f"joint '{name}'")
