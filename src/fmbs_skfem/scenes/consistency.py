"""What ties the parts of a scene together: names that must exist, sizes that must agree, values
that are hardly meant.

Problems stop a scene and are listed together; warnings do not. A problem is a pair of the path of
keys and the `Problem`.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..core.errors import listed
from ..core.values.expressions import Expression
from ..core.values.inputs import calls_of, timed
from ..core.values.mappings import rules
from ..core.values.problems import Found, Keys, Problem, unknown
from ..core.values.responses import OfState, require
from ..systems.connections import joints
from ..systems.forces import responses
from ..systems.measures import readings
from ..systems.places import At
from . import plausibility, yamlfile
from .accuracy import unit_of
from .bodies import PointMass, Rigid, RigidPlate, SceneBody
from .inputs import ends_early, leaves
from .training_options import Allowed, without_ranges
from .yamlfile import Oddity

if TYPE_CHECKING:
    from ..systems.forces.loads import Load
    from .schema import Scene

PARTS = ("joints", "loads", "outputs")
#: sections -> what they do in an analysis without motion
UNMOVED = {
    "controllers": "hold their start in an analysis of {}",
    "events": "do not happen in an analysis of {}",
    "monitors": "do nothing in an analysis of {}, which has no motion",
}
SINE = re.compile(r"\b(sin|cos|tan)\(\s*([-+]?[0-9]+(?:\.[0-9]*)?)\s*\)")


def problems(scene: Scene) -> Iterator[Found]:
    """Everything wrong between the parts of a scene whose parts are right."""
    if "ground" in scene.bodies:
        remedy = "it stands for the fixed frame; choose another name"
        yield ("bodies", "ground"), Problem("the name of a body", "'ground'", remedy)
    yield from _places(scene)
    yield from _declared(scene)
    yield from _references(scene)
    yield from _responses(scene)
    yield from scene.analysis.problems_in(scene)
    yield from _components(scene)
    yield from _training(scene)
    yield from _comparisons(scene)


def notices(scene: Scene) -> Iterator[Oddity]:
    """Values that are allowed but hardly meant: paths of keys and what is odd about them."""
    for name, limits in scene.ranges.items():
        if not limits.low <= scene.parameters[name] <= limits.high:
            text = f"the value {scene.parameters[name]:g} {limits.unit}".strip()
            yield (
                ("parameters", name),
                f"{text} is outside the range of {limits}, where reduced models are trained",
            )
    yield from ((finding.keys, str(finding)) for finding in plausibility.of_text(scene))
    yield from _idle(scene)
    yield from _leaving(scene)
    yield from _tilting(scene)
    yield from _degrees(() if scene.node is None else yamlfile.plain(scene.node), ())
    for keys, angle in _angles(scene):
        if abs(angle) > 2 * math.pi * (1 + 1e-12):
            yield (
                keys,
                f"an angle of {angle:g} rad is more than one turn: write '{angle:g} deg' if degrees are meant",
            )


def _tilting(scene: Scene) -> Iterator[Oddity]:
    """Drives in space of bodies that spherical joints alone hold: they prescribe one angle, and the
    others are free.
    """
    for name, drive in scene.joints.items():
        if scene.dimension == 2 or not isinstance(drive, joints.DrivenAngle):
            continue
        holding = [
            key
            for key, one in scene.joints.items()
            if key != name
            and any(isinstance(end, At) and end.body == drive.at.body for end in vars(one).values())
        ]
        if holding and all(isinstance(scene.joints[key], joints.Pin) for key in holding):
            text = f"drives one angle of '{drive.at.body}', which '{holding[0]}' holds at a point only: in space it can tilt about "
            yield ("joints", name), f"{text}the other axes; a revolute joint holds the axis as well"


def _angles(scene: Scene) -> Iterator[tuple[tuple[str, ...], float]]:
    """Angles [rad] of the file that do not change with time."""
    for part in ("bodies", *PARTS):
        for name, item in getattr(scene, part).items():
            for key, rule, value in rules(item):
                if rule.angle is not None and (angle := rule.angle(value)) is not None:
                    yield (part, name, key), angle


def functions(scene: Scene, sections: Iterable[str], kind: Any) -> Iterator[tuple[Keys, Any]]:
    """Functions of a kind, of time or of the state, in declarations, with their paths of keys."""
    for section in sections:
        for name, item in getattr(scene, section).items():
            for key, value in vars(item).items():
                parts = enumerate(value) if isinstance(value, tuple) else ()
                each = [((), value), *(((k,), one) for k, one in parts)]
                yield from (
                    ((section, name, key, *place), one)
                    for place, one in each
                    if isinstance(one, kind)
                )


def _leaving(scene: Scene) -> Iterator[Oddity]:
    """Functions of time that read tables beyond their ends."""
    instants = scene.analysis.instants()
    for keys, one in functions(scene, ("joints", "loads"), Expression):
        if text := leaves(one, instants):
            yield keys[:3], text


def _idle(scene: Scene) -> Iterator[Oddity]:
    """What a scene says without effect: keys that its analysis or body does not read, changed
    parameters that nothing uses.
    """
    for name, body in scene.bodies.items():
        yield from ((("bodies", name, key), text) for key, text in body.idle())
    # by analyses that read outputs themselves
    named = [value for value in vars(scene.analysis).values() if isinstance(value, str)]
    idle = (
        [] if scene.analysis.has_outputs else [name for name in scene.outputs if name not in named]
    )
    if idle:
        yield (
            ("outputs",),
            f"do nothing, an analysis of {scene.analysis.word} has none: {', '.join(idle)}",
        )
    yield from scene.analysis.idle(scene)
    yield from _idle_loads(scene)
    yield from _unread(scene)
    for name, one in scene.tables.items():
        if not one.smooth and one.ends != "automatic":
            yield ("tables", name, "ends"), "are those of smooth curves, write `smooth: true`"
    if not scene.analysis.moves:
        for section, text in UNMOVED.items():
            if getattr(scene, section):
                yield (section,), text.format(scene.analysis.word)
    for name in scene.parameters:
        if name not in scene.used and (name in scene.ranges or name in scene.changed):
            yield (
                ("parameters", name),
                "nothing in the scene uses this parameter, so that its value changes nothing",
            )


def _idle_loads(scene: Scene) -> Iterator[Oddity]:
    """Loads without effect, and keys that they do not read."""
    for name, load in scene.loads.items():
        yield from ((("loads", name), text) for key, text in load.idle("") if not key)
        yield from ((("loads", name, key), text) for key, text in load.unread(scene.dimension))
        if rigid := _within_a_rigid_body(scene, load):
            yield (
                ("loads", name),
                f"does nothing, as both of its places are on the rigid body '{rigid}'",
            )


def _unread(scene: Scene) -> Iterator[Oddity]:
    """Inputs, controllers and tables that no expression reads."""
    parts = scene.joints, scene.loads, scene.controllers, scene.events
    read = {
        name for part in parts for item in part.values() for name in inputs_in(vars(item).values())
    }
    for section, call in (("inputs", ""), ("controllers", ""), ("tables", "(t)")):
        for name in getattr(scene, section):
            if name + call not in read:
                yield (section, name), "nothing in the scene reads it"


def _within_a_rigid_body(scene: Scene, load: Load) -> str:
    """The rigid body that carries both places of a load, or what touches and the shape; nothing
    where there is none.
    """
    ends = [vars(load).get(key) for key in ("at", "body", "to", "on")]
    carriers = [end.body if isinstance(end, At) else end for end in ends if end is not None]
    if len(carriers) != 2 or carriers[0] != carriers[1] or not isinstance(carriers[0], str):
        return ""
    return (
        carriers[0]
        if isinstance(scene.bodies.get(carriers[0]), PointMass | Rigid | RigidPlate)
        else ""
    )


def inputs_in(values: Iterable[Any]) -> Iterator[str]:
    """Names that expressions among values read beside t and parameters: inputs, and outputs."""
    for value in values:
        if isinstance(value, tuple):
            yield from inputs_in(value)
        elif isinstance(value, OfState):
            yield from value.outputs
            yield from (call.replace("()", "(t)") for call in value.calls)
        elif isinstance(value, Expression):
            yield from (one.name for one in value.inputs)


def _degrees(value: object, keys: tuple[str | int, ...]) -> Iterator[Oddity]:
    """Sines of plain numbers beyond one turn anywhere in a file."""
    inside = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    for key, entry in inside:
        yield from _degrees(entry, (*keys, key))
    for name, number in SINE.findall(value) if isinstance(value, str) else ():
        if abs(float(number)) > 2 * math.pi:
            degrees = f"a parameter 'a: {number} deg' gives {name}(a) if degrees are meant"
            yield keys, f"{name}({number}) takes radians, more than one turn: {degrees}"


def _places(scene: Scene) -> Iterator[Found]:
    """Every place names a body that exists, and a point where the body has several."""
    for key, place in places(scene):
        if place.body not in scene.bodies:
            yield key, unknown("body", "bodies", place.body, scene.bodies)
        elif (problem := scene.bodies[place.body].misplaced(place)) is not None:
            yield key, problem


def places(scene: Scene) -> Iterator[tuple[tuple[str, ...], At]]:
    """All places of joints, loads and outputs with their paths of keys."""
    for part in PARTS:
        for name, item in getattr(scene, part).items():
            yield from (
                ((part, name, key), value)
                for key, value in vars(item).items()
                if isinstance(value, At)
            )


def _declared(scene: Scene) -> Iterator[Found]:
    """What bodies, joints, loads and outputs say themselves, and joints between a point and itself."""
    for part in ("bodies", *PARTS, "controllers", "monitors"):
        for name, item in getattr(scene, part).items():
            for key, problem in item.problems(scene.dimension):
                yield (
                    (part, name, *(key if isinstance(key, tuple) else (key,) if key else ())),
                    problem,
                )
    for name, event in scene.events.items():
        yield from (
            (("events", name, *((key,) if key else ())), problem)
            for key, problem in event.problems()
        )
    for name, joint in scene.joints.items():
        to = getattr(joint, "to", None)
        if isinstance(to, At) and to == getattr(joint, "at", None):
            yield ("joints", name, "to"), Problem("another point than 'at'", "the same")


def _references(scene: Scene) -> Iterator[Found]:
    """Names of joints, and of plates and shells, in joints, loads and outputs; joints of events;
    bodies of the initial motion.
    """
    for part in PARTS:
        for name, item in getattr(scene, part).items():
            for key, rule, value in rules(item):
                yield from _reference(scene, (part, name, key), rule.names, value)
    for name, event in scene.events.items():
        for key in ("release", "lock"):
            for one in getattr(event, key):
                yield from _reference(scene, ("events", name, key), "joints", one)
    for name in scene.initial.bodies:
        yield from _reference(scene, ("initial", "bodies", name), "bodies", name)


def _reference(scene: Scene, key: Keys, kind: str, value: Any) -> Iterator[Found]:
    """A value names what there is of the kind that its rule wants; other values name nothing."""
    bodies = scene.bodies
    if kind == "joints" and value not in scene.joints:
        yield key, unknown("joint", "joints", value, scene.joints)
    if kind == "bodies" and value is not None and value not in bodies:
        yield key, unknown("body", "bodies", value, bodies)
    if kind == "surfaces":
        known = [name for name, body in bodies.items() if body.has_surface]
        yield from _surface(scene, key, value, known, "plates and shells")
    if kind == "stressed" and value is not None:
        known = [name for name, body in bodies.items() if "von_mises" in body.shows]
        yield from _surface(scene, key, value, known, "plates, shells, beams and cables")


def _surface(
    scene: Scene, key: Keys, value: str | At, known: list[str], kinds: str
) -> Iterator[Found]:
    """What acts on whole surfaces and edges, or reads stresses, names a body that has them.

    That a place has a body is checked with all places.
    """
    name = value.body if isinstance(value, At) else value
    if name in scene.bodies and name not in known:
        expected = f"one of the {kinds} ({listed(known, name, 'there are none')})"
        yield key, Problem(expected, f"'{name}', a {scene.bodies[name].word}")
    elif name not in known and not isinstance(value, At):
        yield key, unknown("body", kinds, name, known)


def _responses(scene: Scene) -> Iterator[Found]:
    """Expressions of the state name outputs of the scene, or what their load measures, and have the
    dimension that is wanted.
    """
    names = Counter([*scene.outputs, *scene.inputs, *scene.controllers])
    for section in ("inputs", "controllers"):
        for name in getattr(scene, section):
            if names[name] > 1:
                yield (
                    (section, name),
                    Problem(
                        "another name than those of outputs, inputs and controllers", f"'{name}'"
                    ),
                )
    read = [
        one
        for _, one in functions(
            scene, ("joints", "loads", "controllers", "events"), Expression | OfState
        )
    ]
    for name, table in scene.tables.items():
        if problem := ends_early(table, scene.analysis.instants(), read):
            yield ("tables", name), problem
    known = responses.variables(scene.outputs, scene.dimension)
    tables = [one.table for one in scene.tables.values() if one.table is not None]
    known |= timed(tables) | {
        name: one.unit for group in (scene.inputs, scene.controllers) for name, one in group.items()
    }
    steered = (
        (("controllers", name, key), one)
        for name, item in scene.controllers.items()
        for key, one in item.products()
    )
    for keys, value in (*functions(scene, ("loads", "controllers", "events"), OfState), *steered):
        if keys[0] != "loads" and any(
            readings.follows(one, scene.outputs, scene.dimension) for one in value.outputs
        ):
            continue  # columns of outputs are known when the system is made, and looked at there
        try:
            readings.refuse(value, scene.outputs, scene.dimension)
            require(
                value,
                known | getattr(getattr(scene, str(keys[0]))[keys[1]], "own", {}),
                calls_of(tables),
            )
        except Problem as problem:
            yield keys, problem


def _components(scene: Scene) -> Iterator[Found]:
    """Components share out the bodies, and modes are those of components."""
    reduction = scene.reduction
    if reduction is None:
        return
    if reduction.components is not None:
        yield from _shares(scene, reduction.components)
    if isinstance(reduction.modes, dict):
        known = reduction.components or scene.bodies
        for name in reduction.modes:
            if name not in known:
                yield ("reduction", "modes", name), unknown("component", "components", name, known)


def _shares(scene: Scene, components: Mapping[str, Sequence[str]]) -> Iterator[Found]:
    """Every component has bodies, and every body is in one component."""
    owner: dict[str, str] = {}
    for component, names in components.items():
        keys = ("reduction", "components", component)
        if not names:
            yield keys, Problem("a list of bodies", "an empty one", "delete the component")
        for i, name in enumerate(names):
            if name not in scene.bodies:
                yield (*keys, i), unknown("body", "bodies", name, scene.bodies)
            elif name in owner:
                twice = f"'{name}' in '{owner[name]}' and '{component}'"
                yield (*keys, i), Problem("every body in one component", twice)
            owner.setdefault(name, component)
    left = [name for name in scene.bodies if name not in owner]
    if left:
        none = f"none for {', '.join(left)}"
        yield ("reduction", "components"), Problem("every body in a component", none)


def _training(scene: Scene) -> Iterator[Found]:
    """Training needs ranges to train over, snapshots and a motion."""
    if scene.training is None:
        return
    if not scene.ranges:
        yield ("training",), without_ranges()
    if scene.reduction is None or not scene.analysis.moves:
        got = f"analysis {scene.analysis.word}" if scene.reduction else "none"
        yield (
            ("training",),
            Problem("a section 'reduction' and a dynamic analysis", got, "add them"),
        )
    if isinstance(scene.training.tolerance, Allowed):
        yield from _tolerances(scene, scene.training.tolerance)


def _tolerances(scene: Scene, wanted: Allowed) -> Iterator[Found]:
    """Tolerances belong to outputs, in their units."""
    for name, given in wanted.units.items():
        key = ("training", "tolerance", name)
        if name not in scene.outputs:
            yield key, unknown("output", "outputs", name, scene.outputs)
            continue
        output = scene.outputs[name]
        if given not in ("", unit_of(output.unit)):
            expected = f"an error in {output.unit}" if output.unit else "a number"
            yield (
                key,
                Problem(
                    expected, f"one in {given}", f"output '{name}' is of the type {output.word}"
                ),
            )


def _comparisons(scene: Scene) -> Iterator[Found]:
    """Coarser meshes are made of cables only, and fields colour bodies that have them."""
    bodies = scene.bodies.values()
    if (
        scene.compare is not None
        and scene.compare.coarse
        and not any(body.divisible for body in bodies)
    ):
        remedy = "compare with a scene of its own that reads a coarser mesh"
        yield (
            ("compare", "coarse"),
            Problem("a scene with cables, which can be divided anew", "one without", remedy),
        )
    color = "curvature" if scene.pictures is None else scene.pictures.color
    showing = sorted({kind.word for kind in SceneBody.known.values() if color in kind.shows})
    if showing and not any(color in body.shows for body in bodies):
        expected = f"a scene with a body of the types {', '.join(showing)}"
        yield ("pictures", "color"), Problem(expected, "one without", "take curvature or strain")
