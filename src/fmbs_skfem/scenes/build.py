"""From a Scene to a System: mesh files become bodies, names become places.

Strings of the scene are resolved here, once; whatever does not fit is reported with file, line and key path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import singledispatch

import numpy as np
from scipy.spatial.transform import Rotation

from ..bodies import body as bodies
from ..bodies import sections
from ..bodies.body import Body
from ..bodies.cable_law import Curvature
from ..core import expressions
from ..core.errors import InputError, say
from ..core.expressions import Expression
from ..shapes import curves, meshes
from ..systems import assembly, joints, loads, probes
from ..systems.places import At
from ..systems.system import System
from . import schema
from .fields import Place, Turn, Vector

CURVATURES = {"exact": Curvature.EXACT, "material": Curvature.MATERIAL, "quadratic": Curvature.QUADRATIC}


def system(scene: schema.Scene, cells: int | None = None, allow_outside: bool = False) -> System:
    """The system of a scene with all multipliers; `cells` remeshes every cable with that many cells.

    `allow_outside` permits meshes outside the scene's project folder.
    """
    _check_functions(scene)
    parts = [_body(scene, name, cells, allow_outside) for name in scene.bodies]
    _check_places(scene, {part.name: part for part in parts})
    initial = {name: _motion(motion) for name, motion in scene.initial.bodies.items()}
    return assembly.assemble(
        parts,
        [joint(model, name) for name, model in scene.joints.items()],
        [load(model, name) for name, model in scene.loads.items()],
        assembly.Rayleigh(scene.damping.mass, scene.damping.stiffness),
        {name: probe(model) for name, model in scene.outputs.items()},
        initial,
    )


def chosen_form(scene: schema.Scene, full: System) -> System:
    """The form in which the scene wants its full system solved: without its linear constraints, or with all multipliers."""
    return full if scene.analysis.constraints == "multipliers" else assembly.eliminate(full)


@singledispatch
def part(model: object, scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    """The body of a model; a rule for every body type of the schema."""
    raise InputError(say(f"body '{name}'", "a body", type(model).__name__))


@part.register
def _(model: schema.Cable, scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    mesh = meshes.read(meshes.path(model.mesh, scene.folder, allow_outside))
    if cells is not None or model.refine > 1:
        mesh = remeshed(mesh, model.line, cells, model.refine)
        group = None
    else:
        group = model.line
    return bodies.cable(
        name,
        mesh,
        section(model.section),
        None if model.material is None else sections.Material(model.material.young_modulus, model.material.density),
        dim=scene.dimension,
        group=group,
        degree=model.degree,
        continuity=model.continuity,
        ancf=model.interpolation == "ancf",
        curvature=CURVATURES[model.curvature],
        origin=None if model.origin is None else np.array(model.origin),
        rotation=None if model.rotation is None else matrix(model.rotation),
    )


@part.register
def _(model: schema.PointMass, scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    return bodies.point_mass(name, model.mass, np.array(model.position))


@singledispatch
def section(model: object) -> sections.Given | sections.Circular | sections.Rectangular:
    """The section of a model; a rule for every shape."""
    raise InputError(say("section", "a section", type(model).__name__))


@section.register
def _(model: schema.Circular) -> sections.Circular:
    return sections.Circular(model.diameter)


@section.register
def _(model: schema.Rectangular) -> sections.Rectangular:
    return sections.Rectangular(model.width, model.height)


@section.register
def _(model: schema.Given) -> sections.Given:
    return sections.Given(model.EA, model.EI, model.rhoA)


@singledispatch
def joint(model: object, name: str) -> joints.Joint:
    """The joint of a model; a rule for every joint type."""
    raise InputError(say(f"joint '{name}'", "a joint", type(model).__name__))


@joint.register
def _(model: schema.Pin, name: str) -> joints.Pin:
    return joints.Pin(name, at(model.at), _to(model.to))


@joint.register
def _(model: schema.Clamp, name: str) -> joints.Clamp:
    return joints.Clamp(name, at(model.at))


@joint.register
def _(model: schema.Weld, name: str) -> joints.Weld:
    return joints.Weld(name, at(model.at), at(model.to))


@joint.register
def _(model: schema.DrivenAngle, name: str) -> joints.DrivenAngle:
    return joints.DrivenAngle(name, at(model.at), model.angle, model.axis)


@joint.register
def _(model: schema.DrivenPosition, name: str) -> joints.DrivenPosition:
    return joints.DrivenPosition(name, at(model.at), model.displacement)


@joint.register
def _(model: schema.Distance, name: str) -> joints.Distance:
    to = _to(model.to)
    if to is None:
        raise InputError(say(f"joint '{name}'", "a place or a fixed point in 'to'", "ground"))
    return joints.Distance(name, at(model.at), to, model.length)


@joint.register
def _(model: schema.Slider, name: str) -> joints.Slider:
    return joints.Slider(name, at(model.at), model.direction)


@singledispatch
def load(model: object, name: str) -> loads.Load:
    """The load of a model; a rule for every load type."""
    raise InputError(say(f"load '{name}'", "a load", type(model).__name__))


@load.register
def _(model: schema.Gravity, name: str) -> loads.Gravity:
    return loads.Gravity(model.acceleration)


@load.register
def _(model: schema.PointForce, name: str) -> loads.PointForce:
    return loads.PointForce(name, at(model.at), model.force, model.history)


@load.register
def _(model: schema.Follower, name: str) -> loads.Follower:
    return loads.Follower(name, at(model.at), model.force, model.history)


@load.register
def _(model: schema.Moment, name: str) -> loads.Moment:
    return loads.Moment(name, at(model.at), model.moment, model.history)


@singledispatch
def probe(model: object) -> probes.Probe:
    """The probe of a model; a rule for every output type."""
    raise InputError(say("outputs", "an output", type(model).__name__))


@probe.register
def _(model: schema.PointOutput) -> probes.Probe:
    kinds: dict[str, Callable[[At], probes.Probe]] = {
        "position": probes.Position, "velocity": probes.Velocity, "slope": probes.Slope,
    }  # fmt: skip
    return kinds[model.type](at(model.at))


@probe.register
def _(model: schema.DeflectionOutput) -> probes.Deflection:
    return probes.Deflection(at(model.tip), at(model.root))


@probe.register
def _(model: schema.EnergyOutput) -> probes.Energy:
    return probes.Energy()


@probe.register
def _(model: schema.ReactionOutput) -> probes.Reaction:
    return probes.Reaction(model.joint)


def at(place: Place) -> At:
    """A place of the scene as a place of the system; a point mass has the one place `center`."""
    if place.s is not None:
        return At(place.body, place.s)
    return At(place.body, place.group or "center")


def matrix(rotation: Turn) -> np.ndarray:
    """Rotation matrix (c, c): about z in the plane, about the axis in space."""
    if rotation.axis is None:
        c, s = np.cos(rotation.angle), np.sin(rotation.angle)
        return np.array([[c, -s], [s, c]])
    axis = np.array(rotation.axis)
    return np.asarray(Rotation.from_rotvec(rotation.angle * axis / np.linalg.norm(axis)).as_matrix())


def remeshed(mesh: meshes.LineMesh, group: str | None, cells: int | None = None, refine: int = 1) -> meshes.LineMesh:
    """One body of a mesh with other cells: `cells` of equal length, or every cell split into `refine`.

    Points lie on the smooth curve through the old ones. Named points stay points of the mesh: the nearest inner cut moves to them,
    and the cells beside them differ in length where they do not divide the line evenly.
    """
    order = meshes.chain(mesh, group)
    breaks, curve = curves.through(mesh.points[order])
    where = {int(node): float(xi) for node, xi in zip(order, breaks, strict=True)}
    names = {name: where[int(ids[0])] for name, ids in mesh.point_groups.items() if len(ids) == 1 and int(ids[0]) in where}
    if cells is None:
        steps = np.arange(refine) / refine
        cuts = np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel(), breaks[-1])
    else:
        cuts = _cuts(breaks[-1], cells, sorted(set(names.values())))
    nodes = np.arange(len(cuts))
    groups = {name: np.array([np.argmin(np.abs(cuts - xi))]) for name, xi in names.items()}
    return meshes.LineMesh(curve(cuts, 0), np.column_stack([nodes[:-1], nodes[1:]]), groups, {}, mesh.path)


def _cuts(length: float, cells: int, kept: list[float]) -> np.ndarray:
    """Equal cuts of [0, length] of which the nearest move to the values to be kept."""
    inner = [xi for xi in kept if 1e-9 * length < xi < (1 - 1e-9) * length]
    if len(inner) >= cells:
        raise InputError(say("mesh", f"at least {len(inner) + 1} cells, one more than named inner points", cells))
    cuts = np.linspace(0.0, length, cells + 1)
    free = np.arange(1, cells)
    for xi in inner:
        nearest = free[np.argmin(np.abs(cuts[free] - xi))]
        cuts[nearest] = xi
        free = free[free != nearest]
    return np.sort(cuts)


def _to(to: Place | Vector | None) -> At | Vector | None:
    return at(to) if isinstance(to, Place) else to


def _motion(model: schema.Motion) -> assembly.Motion:
    return assembly.Motion(model.velocity or (), () if model.angular_velocity is None else model.angular_velocity)


def _body(scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    try:
        return part(scene.bodies[name], scene, name, cells, allow_outside)
    except InputError as error:
        raise InputError(f"{schema.where(scene, 'bodies', name)}: {error}") from error


def _check_places(scene: schema.Scene, parts: dict[str, Body]) -> None:
    """Every place of joints, loads and outputs lies on its body; all that do not are listed."""
    wrong: list[str] = []
    for keys, place in _places(scene):
        try:
            bodies.locate(parts[place.body], at(place).place)
        except InputError as error:
            wrong.append(f"{schema.where(scene, *keys)}: {error}")
    if wrong:
        raise InputError("\n".join(wrong))


def _places(scene: schema.Scene) -> Iterator[tuple[tuple[str, ...], Place]]:
    for group, items in (("joints", scene.joints), ("loads", scene.loads), ("outputs", scene.outputs)):
        for name, item in items.items():
            for key in ("at", "to", "tip", "root"):
                place = getattr(item, key, None)
                if isinstance(place, Place):
                    yield (group, name, key), place


def _check_functions(scene: schema.Scene) -> None:
    """Histories and drives are finite at every step of the analysis."""
    analysis = scene.analysis
    if not isinstance(analysis, schema.Dynamic):
        return
    times = np.minimum(np.arange(int(np.ceil(analysis.duration / analysis.step)) + 1) * analysis.step, analysis.duration)
    for name, model in scene.loads.items():
        history = getattr(model, "history", None)
        if isinstance(history, Expression):
            expressions.check(history, times, f"load '{name}'")
    for name, drive in scene.joints.items():
        found = getattr(drive, "angle", getattr(drive, "displacement", ()))
        for function in found if isinstance(found, tuple) else (found,):
            expressions.check(function, times, f"joint '{name}'")
