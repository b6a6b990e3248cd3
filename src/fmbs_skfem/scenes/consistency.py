"""What ties the parts of a scene together: names that must exist, sizes that must agree, values that are hardly meant.

Problems stop a scene and are listed together; warnings do not. A problem is a pair of the path of keys and the `Problem`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator

from ..bodies import laws
from ..bodies.body import BENDS_ALIKE, BENDS_ALIKE_REMEDY
from ..bodies.sections import Given
from ..core import units
from ..core.errors import closest, listed
from ..core.expressions import Expression
from ..core.problems import Problem, shown
from ..systems.joints import DrivenAngle
from ..systems.loads import TorsionSpring
from ..systems.places import At
from ..systems.probes import Reaction, Stress
from . import plausibility, surfaces, times, unused, yamlfile
from .fields import Spans
from .models import Found, Told
from .schema import Cable, Dynamic, PlacedPart, Plate, PointMass, Rigid, RigidPlate, Scene, Shell
from .training import Allowed, without_ranges

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
PARTS = ("joints", "loads", "outputs")
SINE = re.compile(r"\b(sin|cos|tan)\(\s*([-+]?[0-9]+(?:\.[0-9]*)?)\s*\)")


def problems(scene: Scene) -> Iterator[Found]:
    """Everything wrong between the parts of a scene whose parts are right."""
    yield from _names(scene)
    yield from _bodies(scene)
    yield from _places(scene)
    yield from _surfaces(scene)
    yield from _declared(scene)
    yield from _references(scene)
    yield from _times(scene)
    yield from _components(scene)
    yield from _training(scene)
    yield from _comparisons(scene)


def notices(scene: Scene) -> Iterator[Told]:
    """Values that are allowed but hardly meant: paths of keys and what is odd about them."""
    for name, limits in scene.ranges.items():
        if not limits.low <= scene.parameters[name] <= limits.high:
            text = f"the value {scene.parameters[name]:g} {limits.unit}".strip()
            yield ("parameters", name), f"{text} is outside the range of {limits}, where reduced models are trained"
    yield from ((finding.keys, str(finding)) for finding in plausibility.materials(scene))
    yield from unused.notices(scene)
    yield from _degrees(() if scene._node is None else yamlfile.plain(scene._node), ())
    for keys, angle in _angles(scene):
        if abs(angle) > 2 * math.pi * (1 + 1e-12):
            yield keys, f"an angle of {angle:g} rad is more than one turn: write '{angle:g} deg' if degrees are meant"


def _angles(scene: Scene) -> Iterator[tuple[tuple[str, ...], float]]:
    """Angles [rad] of the file that do not change with time."""
    for name, body in scene.bodies.items():
        if (rotation := getattr(body, "rotation", None)) is not None:
            yield ("bodies", name, "rotation"), rotation.angle
    for name, joint in scene.joints.items():
        angle = joint.angle if isinstance(joint, DrivenAngle) else None
        if isinstance(angle, Expression) and len(angle.program) == 1:
            yield ("joints", name, "angle"), angle(0.0)
    for name, load in scene.loads.items():
        if isinstance(load, TorsionSpring):
            yield ("loads", name, "rest_angle"), load.rest_angle


def _degrees(value: object, keys: tuple[str | int, ...]) -> Iterator[Told]:
    """Sines of plain numbers beyond one turn anywhere in a file."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in inside:
        yield from _degrees(entry, (*keys, key))
    for name, number in SINE.findall(value) if isinstance(value, str) else ():
        if abs(float(number)) > 2 * math.pi:
            degrees = f"a parameter 'a: {number} deg' gives {name}(a) if degrees are meant"
            yield keys, f"{name}({number}) takes radians, more than one turn: {degrees}"


def _names(scene: Scene) -> Iterator[Found]:
    """Names of bodies, joints, loads and outputs are words; `ground` is taken."""
    for part in ("bodies", "joints", "loads", "outputs"):
        for name in getattr(scene, part):
            if not NAME.fullmatch(name):
                yield (part, name), Problem("a name of letters, digits, _ and -, beginning with a letter", shown(name))
            elif part == "bodies" and name == "ground":
                yield (part, name), Problem("the name of a body", "'ground'", "it stands for the fixed frame; choose another name")


def _bodies(scene: Scene) -> Iterator[Found]:
    for name, body in scene.bodies.items():
        key = ("bodies", name)
        if isinstance(body, Cable):
            yield from _cable(key, body, scene.dimension)
        if isinstance(body, Plate) and body.arcs is not None and not surfaces.INTERPOLATIONS[body.interpolation].arcs:
            got = f"arcs with {body.interpolation}, whose sides are straight"
            yield (*key, "arcs"), Problem("arcs with ancf only", got, "delete them")
        for rim in getattr(body, "rims", ()):
            if not NAME.fullmatch(rim):
                yield (*key, "rims", rim), Problem("a name of letters, digits, _ and -, beginning with a letter", shown(rim))
        if isinstance(body, Rigid):
            for point in {"center", "frame"} & body.points.keys():
                yield (
                    (*key, "points", point),
                    Problem("another name than 'center' and 'frame', which every rigid body has", shown(point)),
                )


def _cable(key: tuple[str, str], body: Cable, dimension: int) -> Iterator[Found]:
    if dimension == 3 and not body.section.bends_alike:
        yield (*key, "section"), Problem(BENDS_ALIKE, f"one that is {body.section.word}", BENDS_ALIKE_REMEDY)
    if not isinstance(body.section, Given) and body.material is None:
        yield (*key, "material"), Problem("a material for a solid section", "nothing", "or give EA, EI and rhoA (shape: given)")
    if body.continuity >= body.degree:
        yield (*key, "continuity"), Problem(f"a continuity below the degree {body.degree}", str(body.continuity))
    if body.law is not None and body.law not in laws.KNOWN:
        yield (*key, "law"), _unknown("law", "laws", body.law, laws.KNOWN)
    if body.law is not None and body.curvature != "exact":
        yield (*key, "curvature"), Problem("no curvature beside a law", f"'{body.curvature}'", "delete one of the two")
    if body.interpolation == "ancf" and (body.degree, body.continuity) != (3, 1):
        got = f"degree {body.degree}, continuity {body.continuity}"
        yield (*key, "interpolation"), Problem("degree 3 and continuity 1 with ancf", got, "leave them out, or use bspline")


def _places(scene: Scene) -> Iterator[Found]:
    """Every place names a body that exists, and a point where the body has several."""
    for key, place in places(scene):
        yield from _place(scene, key, place)


def places(scene: Scene) -> Iterator[tuple[tuple[str, ...], At]]:
    """All places of joints, loads and outputs with their paths of keys."""
    for part in PARTS:
        for name, item in getattr(scene, part).items():
            yield from (((part, name, key), value) for key, value in vars(item).items() if isinstance(value, At))


def _place(scene: Scene, key: tuple[str, ...], place: At) -> Iterator[Found]:
    if place.body not in scene.bodies:
        yield key, _unknown("body", "bodies", place.body, scene.bodies)
        return
    body, got, measured = scene.bodies[place.body], shown(place.place), not isinstance(place.place, str)
    if isinstance(body, PointMass) and place.place not in ("", "center"):
        yield key, Problem(f"the point mass '{place.body}' as a whole", got, f"write {place.body}")
    if isinstance(body, Rigid | RigidPlate) and measured:
        yield (
            key,
            Problem(f"the rigid body '{place.body}' or one of its points", got, f"write {place.body}.frame or {place.body}.point"),
        )
    if isinstance(body, Cable) and place.place == "":
        remedy = f"write {place.body}.group with a point group of its mesh, or {{body: {place.body}, s: 0.3 m}}"
        yield key, Problem(f"a point of the body '{place.body}'", f"'{place.body}'", remedy)
    if isinstance(body, Plate | Shell) and (measured or not place.place):
        named = ", ".join(body.rims) or "none yet"
        remedy = f"write {place.body}.name with one of its rims ({named}) or named points"
        yield key, Problem(f"a rim or named point of '{place.body}'", got if measured else f"'{place.body}'", remedy)


def _surfaces(scene: Scene) -> Iterator[Found]:
    """What acts on whole surfaces and edges names a plate or shell."""
    for part in ("joints", "loads"):
        for name, item in getattr(scene, part).items():
            body = getattr(item, "body", None)
            if isinstance(body, str):
                yield from _plate(scene, (part, name, "body"), body)
    for name, output in scene.outputs.items():
        if isinstance(output, Stress) and output.at.body in scene.bodies:
            yield from _plate(scene, ("outputs", name, "at"), output.at.body)


def _plate(scene: Scene, key: tuple[str, ...], name: str) -> Iterator[Found]:
    known = [body for body, model in scene.bodies.items() if isinstance(model, Plate | Shell | PlacedPart)]
    if name not in scene.bodies:
        yield key, _unknown("body", "plates and shells", name, known)
    elif name not in known:
        expected = f"one of the plates and shells ({listed(known, name, 'there are none')})"
        yield key, Problem(expected, f"'{name}', a {scene.bodies[name].type}")


def _declared(scene: Scene) -> Iterator[Found]:
    """What joints, loads and outputs say themselves, and joints between a point and itself."""
    for part in PARTS:
        for name, item in getattr(scene, part).items():
            for key, problem in item.problems(scene.dimension):
                yield (part, name, *([key] if key else [])), problem
    for name, joint in scene.joints.items():
        to = getattr(joint, "to", None)
        if isinstance(to, At) and to == getattr(joint, "at", None):
            yield ("joints", name, "to"), Problem("another point than 'at'", "the same")


def _references(scene: Scene) -> Iterator[Found]:
    """Names in outputs and initial motion."""
    for name, output in scene.outputs.items():
        if isinstance(output, Reaction) and output.joint not in scene.joints:
            yield ("outputs", name, "joint"), _unknown("joint", "joints", output.joint, scene.joints)
    for name in scene.initial.bodies:
        if name not in scene.bodies:
            yield ("initial", "bodies", name), _unknown("body", "bodies", name, scene.bodies)


def _times(scene: Scene) -> Iterator[Found]:
    """Steps that fit into the duration, and spans of time that fit to the steps."""
    analysis = scene.analysis
    if not isinstance(analysis, Dynamic):
        return
    if analysis.step > analysis.duration:
        yield (
            ("analysis", "step"),
            Problem(f"a step of at most the duration {analysis.duration:g} s", f"{analysis.step:g} s"),
        )
    if analysis.duration > times.STEPS * analysis.step:
        got = f"{analysis.step:g} s for {analysis.duration:g} s"
        yield ("analysis", "step"), Problem(f"at most {times.STEPS} steps", got, "shorten the duration, or lengthen the step")
    if isinstance(analysis.every, tuple):
        yield from _spans(("analysis", "every"), analysis.every, analysis.step)
    if scene.reduction is not None:
        yield from _snapshots(scene.reduction.snapshots, analysis)


def _snapshots(interval: float | Spans, analysis: Dynamic) -> Iterator[Found]:
    """Snapshots at whole numbers of steps."""
    key = ("reduction", "snapshots")
    if isinstance(interval, tuple):
        yield from _spans(key, interval, analysis.step)
    elif times.count_steps(interval, analysis.step) is None:
        yield key, Problem(f"a multiple of the step {analysis.step:g} s", f"{interval:g} s")


def _spans(key: tuple[str, str], spans: Spans, step: float) -> Iterator[Found]:
    for i, span in enumerate(spans):
        for name, time in (("every", span.every), ("until", span.until)):
            if time is not None and times.count_steps(time, step) is None:
                yield (*key, i, name), Problem(f"a multiple of the step {step:g} s", f"{time:g} s")


def _components(scene: Scene) -> Iterator[Found]:
    """Components share out the bodies: each in exactly one."""
    reduction = scene.reduction
    if reduction is None:
        return
    if reduction.components is not None:
        owner: dict[str, str] = {}
        for component, names in reduction.components.items():
            for i, name in enumerate(names):
                if name not in scene.bodies:
                    yield ("reduction", "components", component, i), _unknown("body", "bodies", name, scene.bodies)
                elif name in owner:
                    twice = f"'{name}' in '{owner[name]}' and '{component}'"
                    yield ("reduction", "components", component, i), Problem("every body in one component", twice)
                owner.setdefault(name, component)
        left = [name for name in scene.bodies if name not in owner]
        if left:
            yield ("reduction", "components"), Problem("every body in a component", f"none for {', '.join(left)}")
    if isinstance(reduction.modes, dict):
        known = reduction.components or scene.bodies
        for name in reduction.modes:
            if name not in known:
                yield ("reduction", "modes", name), _unknown("component", "components", name, known)


def _training(scene: Scene) -> Iterator[Found]:
    """Training needs ranges to train over, snapshots and a motion."""
    if scene.training is None:
        return
    if not scene.ranges:
        yield ("training",), without_ranges()
    if scene.reduction is None or not isinstance(scene.analysis, Dynamic):
        got = f"analysis {scene.analysis.type}" if scene.reduction else "none"
        yield ("training",), Problem("a section 'reduction' and a dynamic analysis", got, "add them")
    if isinstance(scene.training.tolerance, Allowed):
        yield from _tolerances(scene, scene.training.tolerance)


def _tolerances(scene: Scene, wanted: Allowed) -> Iterator[Found]:
    """Tolerances belong to outputs, in their units."""
    for name, given in wanted.units.items():
        key = ("training", "tolerance", name)
        if name not in scene.outputs:
            yield key, _unknown("output", "outputs", name, scene.outputs)
            continue
        output = scene.outputs[name]
        if given not in ("", units.unit(units.find_dimension(output.unit).exponents)):
            expected = f"an error in {output.unit}" if output.unit else "a number"
            yield key, Problem(expected, f"one in {given}", f"output '{name}' is of the type {output.word}")


def _comparisons(scene: Scene) -> Iterator[Found]:
    """Coarser meshes are made of cables only, stresses are shown on plates only."""
    kinds = {type(body) for body in scene.bodies.values()}
    if scene.compare is not None and scene.compare.coarse and Cable not in kinds:
        remedy = "compare with a scene of its own that reads a coarser mesh"
        yield ("compare", "coarse"), Problem("a scene with cables, which can be divided anew", "one without", remedy)
    if scene.pictures is not None and scene.pictures.color == "von_mises" and not kinds & {Plate, Shell, PlacedPart}:
        yield ("pictures", "color"), Problem("a scene with plates or shells", "one without", "take curvature or strain")


def _unknown(kind: str, many: str, name: str, known: Collection[str]) -> Problem:
    hint = closest(name, known).removeprefix("; ")
    return Problem(f"one of the {many} {listed(sorted(known), name)}", f"the {kind} {shown(name)}", hint)
