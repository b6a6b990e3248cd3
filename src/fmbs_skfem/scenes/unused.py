"""What a scene says without effect: keys that its analysis or body does not read, changed parameters that nothing uses."""

from __future__ import annotations

from collections.abc import Iterator

from ..bodies.sections import Given
from ..systems.loads import TorsionSpring
from .models import Told
from .schema import Buckling, Cable, Dynamic, Modes, Scene, Static
from .times import NEAR


def notices(scene: Scene) -> Iterator[Told]:
    """Notices of everything in a scene that does nothing."""
    for name, body in scene.bodies.items():
        if isinstance(body, Cable) and isinstance(body.section, Given) and body.material is not None:
            yield ("bodies", name, "material"), "does nothing beside a given section, whose EA, EI and rhoA are complete"
    if isinstance(scene.analysis, Static):
        yield from _at_rest(scene, "an equilibrium")
    if isinstance(scene.analysis, Buckling):
        yield from _at_rest(scene, "a buckling load")
    if isinstance(scene.analysis, Modes):
        yield from _modes(scene, scene.analysis)
    if isinstance(scene.analysis, Modes | Buckling) and scene.outputs:
        yield ("outputs",), f"do nothing, an analysis of {scene.analysis.type} has none: {', '.join(scene.outputs)}"
    for name, load in scene.loads.items():
        if isinstance(load, TorsionSpring) and not (load.stiffness or load.damping):
            yield ("loads", name), "does nothing, it has neither stiffness nor damping"
    if isinstance(scene.analysis, Dynamic):
        yield from _ends(("analysis", "every"), scene.analysis.every, scene.analysis.duration)
        if scene.reduction is not None:
            yield from _ends(("reduction", "snapshots"), scene.reduction.snapshots, scene.analysis.duration)
            yield from _alone(scene.reduction.snapshots, scene.analysis.duration)
    for name in scene.parameters:
        if name not in scene.used and (name in scene.ranges or name in scene.changed):
            yield ("parameters", name), "nothing in the scene uses this parameter, so that its value changes nothing"


def _modes(scene: Scene, analysis: Modes) -> Iterator[Told]:
    """What modes do not read: undamped ones no damping, those about the reference no loads."""
    if not analysis.damped and analysis.spin is None:
        yield from _at_rest(scene, "a vibration mode", "damped: true counts damping")
    elif scene.initial.bodies:
        yield ("initial",), "does nothing, a vibration mode has no initial motion"
    idle = [name for name, load in scene.loads.items() if not load.resists]
    if analysis.about == "reference" and idle:
        yield ("loads",), f"modes are those of the unloaded reference, in which these do nothing: {', '.join(idle)}"
    if analysis.about == "reference" and analysis.spin is not None:
        yield ("analysis", "about"), "the reference is no equilibrium in a turning frame, whose pull stretches the bodies"


def _ends(key: tuple[str, ...], spans: object, duration: float) -> Iterator[Told]:
    """The last span lasts to the end of the motion."""
    last = spans[-1].until if isinstance(spans, tuple) else None
    if last is not None and last < duration:
        yield key, f"'until: {last:g} s' of the last span does nothing, it lasts to the end at {duration:g} s"


def _alone(interval: object, duration: float) -> Iterator[Told]:
    """A time between snapshots that is longer than the motion."""
    if isinstance(interval, float) and interval > duration * (1.0 + NEAR):
        yield ("reduction", "snapshots"), f"{interval:g} s leave no snapshot but the start of a motion of {duration:g} s"


def _at_rest(scene: Scene, what: str, remedy: str = "") -> Iterator[Told]:
    """What belongs to motions alone."""
    undamped = f"does nothing, {what} is not damped" + (f"; {remedy}" if remedy else "")
    if scene.initial.bodies:
        yield ("initial",), f"does nothing, {what} has no initial motion"
    if scene.damping.mass or scene.damping.stiffness:
        yield ("damping",), undamped
    for name, load in scene.loads.items():
        if isinstance(load, TorsionSpring) and load.damping:
            yield ("loads", name, "damping"), undamped
