"""What ties the parts of a scene together: names that must exist, sizes that must agree, values that are hardly meant.

Problems stop a scene and are listed together; notices do not. A problem is a pair of the path of keys and the `Problem`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from typing import TypeAlias

from ..core.errors import closest
from ..core.problems import Problem, shown
from .fields import Place
from .schema import Cable, DeflectionOutput, Distance, DrivenAngle, Dynamic, Given, Pin, PointMass, ReactionOutput, Scene

Found: TypeAlias = tuple[tuple[str | int, ...], Problem]

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
WAVE_SPEEDS = (10.0, 3e4)  #: plausible sqrt(E / rho) [m/s]: soft rubber to diamond


def problems(scene: Scene) -> Iterator[Found]:
    """Everything wrong between the parts of a scene whose parts are right."""
    yield from _names(scene)
    yield from _bodies(scene)
    yield from _places(scene)
    yield from _joints(scene)
    yield from _references(scene)
    yield from _components(scene)


def notices(scene: Scene) -> Iterator[tuple[tuple[str, ...], str]]:
    """Values that are allowed but hardly meant: paths of keys and what is odd about them."""
    for name, body in scene.bodies.items():
        if not isinstance(body, Cable):
            continue
        if body.material is not None:
            speed = math.sqrt(body.material.young_modulus / body.material.density)
            if not WAVE_SPEEDS[0] <= speed <= WAVE_SPEEDS[1]:
                yield (
                    ("bodies", name, "material"),
                    f"the wave speed sqrt(E / rho) = {speed:.3g} m/s is outside {WAVE_SPEEDS[0]:g} to {WAVE_SPEEDS[1]:g} m/s: "
                    "are Young's modulus and density in SI units?",
                )
        if body.rotation is not None and abs(body.rotation.angle) > 2 * math.pi * (1 + 1e-12):
            yield ("bodies", name, "rotation"), _turns(body.rotation.angle)
    for name, joint in scene.joints.items():
        if (
            isinstance(joint, DrivenAngle)
            and len(joint.angle.program) == 1
            and abs(float(joint.angle(0.0))) > 2 * math.pi * (1 + 1e-12)
        ):
            yield ("joints", name, "angle"), _turns(float(joint.angle(0.0)))


def _turns(angle: float) -> str:
    return f"an angle of {angle:g} rad is more than one turn: write '{angle:g} deg' if degrees are meant"


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
        if not isinstance(body, Cable):
            continue
        key = ("bodies", name)
        if not isinstance(body.section, Given) and body.material is None:
            yield (*key, "material"), Problem("a material for a solid section", "nothing", "or give EA, EI and rhoA (shape: given)")
        if body.continuity >= body.degree:
            yield (*key, "continuity"), Problem(f"a continuity below the degree {body.degree}", str(body.continuity))
        if body.interpolation == "ancf" and (body.degree, body.continuity) != (3, 1):
            got = f"degree {body.degree}, continuity {body.continuity}"
            yield (*key, "interpolation"), Problem("degree 3 and continuity 1 with ancf", got, "leave them out, or use bspline")


def _places(scene: Scene) -> Iterator[Found]:
    """Every place names a body that exists, and a point where the body has several."""
    for part in ("joints", "loads", "outputs"):
        for name, item in getattr(scene, part).items():
            for key in ("at", "to", "tip", "root"):
                place = getattr(item, key, None)
                if isinstance(place, Place):
                    yield from _place(scene, (part, name, key), place)


def _place(scene: Scene, key: tuple[str, ...], place: Place) -> Iterator[Found]:
    if place.body not in scene.bodies:
        yield key, _unknown("body", "bodies", place.body, scene.bodies)
        return
    mass = isinstance(scene.bodies[place.body], PointMass)
    if mass and (place.s is not None or place.group not in (None, "center")):
        yield key, Problem(f"the point mass '{place.body}' as a whole", shown(place.group or place.s), f"write {place.body}")
    if not mass and place.group is None and place.s is None:
        remedy = f"write {place.body}.group with a point group of its mesh, or {{body: {place.body}, s: 0.3 m}}"
        yield key, Problem(f"a point of the body '{place.body}'", f"'{place.body}'", remedy)


def _joints(scene: Scene) -> Iterator[Found]:
    """Joints that need more than their fields say."""
    for name, joint in scene.joints.items():
        if isinstance(joint, DrivenAngle) and (joint.axis is None) != (scene.dimension == 2):
            wanted = "no axis in the plane" if scene.dimension == 2 else "the axis of rotation in space"
            yield ("joints", name, "axis"), Problem(wanted, "one" if joint.axis else "nothing")
        if isinstance(joint, Distance) and joint.to is None:
            yield (
                ("joints", name, "to"),
                Problem("a place or the coordinates of a fixed point", "ground", "write for instance [0, 0, 1]"),
            )
        if isinstance(joint, Pin | Distance) and isinstance(joint.to, Place) and joint.to == joint.at:
            yield ("joints", name, "to"), Problem("another point than 'at'", "the same")


def _references(scene: Scene) -> Iterator[Found]:
    """Names in outputs, initial motion and analysis."""
    for name, output in scene.outputs.items():
        if isinstance(output, ReactionOutput) and output.joint not in scene.joints:
            yield ("outputs", name, "joint"), _unknown("joint", "joints", output.joint, scene.joints)
        if isinstance(output, DeflectionOutput) and output.tip == output.root:
            yield ("outputs", name, "root"), Problem("another point than the tip", "the same")
    for name in scene.initial.bodies:
        if name not in scene.bodies:
            yield ("initial", "bodies", name), _unknown("body", "bodies", name, scene.bodies)
    if isinstance(scene.analysis, Dynamic) and scene.analysis.step > scene.analysis.duration:
        yield (
            ("analysis", "step"),
            Problem(f"a step of at most the duration {scene.analysis.duration:g} s", f"{scene.analysis.step:g} s"),
        )


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


def _unknown(kind: str, many: str, name: str, known: Collection[str]) -> Problem:
    hint = closest(name, known).removeprefix("; ")
    return Problem(f"one of the {many} {', '.join(sorted(known)) or '(there are none)'}", f"the {kind} {shown(name)}", hint)
