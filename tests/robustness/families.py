"""Families of small mechanisms with one to three parameters, each near something that reduced
models find hard.

A builder makes a case of numbers; a family is a builder, numbers that stay, and ranges of those
that do not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fmbs_skfem import bodies
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.parameters import Parameter, Scale
from fmbs_skfem.shapes.meshes import LineMesh
from fmbs_skfem.systems import At, Rayleigh, assemble
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.connections.edges import Edge
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import models
from ..systems.rigid_parts import grid

Place = tuple[float, float]
HERE, AWAY, FAR = (0.0, 0.0), (200.0, 0.0), (1e4, -1e4)  #: origins [m]
RAMP = "min(t/0.4, 1)"


@dataclass(frozen=True)
class Family:
    """What is trained: cases over ranges, to a wanted error or with the tolerances that a scene has
    by default.
    """

    build: Callable[..., Case]
    ranges: Mapping[str, tuple[float, float]]
    fixed: Mapping[str, Any] = field(default_factory=dict)
    tolerance: float | None = None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """On a logarithmic scale where a range spans a decade."""
        wide = {name: low > 0.0 and high >= 10.0 * low for name, (low, high) in self.ranges.items()}
        scales = {name: Scale.LOG if wide[name] else Scale.LINEAR for name in wide}
        return tuple(
            Parameter(name, low, high, scales[name]) for name, (low, high) in self.ranges.items()
        )

    def __call__(self, values: Mapping[str, float]) -> Case:
        return self.build(**self.fixed, **values)


def between(start: Place, end: Place, cells: int, rise: float = 0.0) -> LineMesh:
    """A line that bulges by a rise [m] in its middle, with the points `left`, `middle` and `right`."""
    s = np.linspace(0.0, 1.0, cells + 1)[:, None]
    a, b = np.array([*start, 0.0]), np.array([*end, 0.0])
    across = np.array([a[1] - b[1], b[0] - a[0], 0.0]) / np.linalg.norm(b - a)
    mesh = models.polyline(a + (b - a) * s + rise * np.sin(np.pi * s) * across)
    return replace(mesh, point_groups={**mesh.point_groups, "middle": np.array([cells // 2])})


def rod(
    name: str,
    start: Place,
    end: Place,
    E: float,
    d: float,
    cells: int = 6,
    rise: float = 0.0,
    dim: int = 2,
) -> bodies.Body:
    """A round cable of plastic, d [m] thick."""
    return bodies.cable(
        name,
        between(start, end, cells, rise),
        bodies.Circular(d),
        bodies.Material(E, 1500.0),
        dim=dim,
    )


def link(name: str, start: Place, end: Place, mass: float) -> bodies.Body:
    """A rigid rod in the plane with the places `a` and `b`."""
    a, b = np.array(start), np.array(end)
    return rigid(
        name,
        mass,
        mass * float((b - a) @ (b - a)) / 12.0,
        0.5 * (a + b),
        dim=2,
        places={"a": start, "b": end},
    )


def case(step: float, steps: int, *parts: Any) -> Case:
    return Case(assemble(*parts), GeneralizedAlpha(step), steps * step)


def column(P: float, E: float = 1e9, q: float = 1e-3, at: Place = HERE) -> Case:
    """A column of 1 m under an axial force P [N]; it buckles at 1.98 N where E is 1 GPa, by a side
    force q [N].
    """
    x, y = at
    body = rod("col", at, (x + 1.0, y), E, 8e-3, 8)
    held = [
        joints.Pin("low", At("col", "left")),
        joints.Slider("high", At("col", "right"), (1.0, 0.0)),
    ]
    forces = [
        loads.PointForce("P", At("col", "right"), (-P, 0.0), of_time("min(t/0.5, 1)")),
        loads.PointForce("q", At("col", "middle"), (0.0, q)),
    ]
    outputs = {
        "mid": probes.Position(At("col", "middle")),
        "end": probes.Position(At("col", "right")),
    }
    return case(5e-3, 240, [body], held, forces, Rayleigh(mass=4.0), outputs)


def arch(P: float, E: float = 1e9, rise: float = 0.02, at: Place = HERE) -> Case:
    """A flat arch on two pins, its middle pushed down by a force P [N] that rises slowly."""
    x, y = at
    body = rod("arch", at, (x + 1.0, y), E, 8e-3, 8, rise)
    held = [joints.Pin(end, At("arch", end)) for end in ("left", "right")]
    push = loads.PointForce("P", At("arch", "middle"), (0.0, -P), of_time(RAMP))
    return case(
        4e-3,
        200,
        [body],
        held,
        [push],
        Rayleigh(mass=3.0),
        {"mid": probes.Position(At("arch", "middle"))},
    )


def cantilever(
    F: float, w: float = 0.0, E: float = 1e9, d: float = 10e-3, damping: float = 0.0, history: str = "", length: float = 1.0,
    at: Place = HERE, step: float = 1e-2, steps: int = 250,
) -> Case:  # fmt: skip
    """A clamped beam of 7.2 rad/s under a force F [N] at its end, of frequency w [rad/s] or over a
    history of time.
    """
    body = rod("beam", at, (at[0] + length, at[1]), E, d)
    force = loads.PointForce(
        "F", At("beam", "right"), (0.0, F), of_time(history or "sin(w*t)", {"w": w})
    )
    outputs = {"tip": probes.Position(At("beam", "right")), "clamp": probes.Reaction("clamp")}
    return case(
        step,
        steps,
        [body],
        [joints.Clamp("clamp", At("beam", "left"))],
        [force],
        Rayleigh(mass=damping),
        outputs,
    )


def rolled(M: float, E: float = 1e9) -> Case:
    """A cantilever rolled up by a moment M [N m] at its end."""
    turn = loads.Moment("M", At("beam", "right"), M, of_time(RAMP))
    outputs = {"tip": probes.Position(At("beam", "right"))}
    body, clamp = rod("beam", HERE, (1.0, 0.0), E, 10e-3), joints.Clamp("clamp", At("beam", "left"))
    return case(4e-3, 200, [body], [clamp], [turn], Rayleigh(mass=2.0), outputs)


def spun(
    E: float = 1e9, turn: float = 4.0, Ts: float = 1.0, arm: float = 0.0, at: Place = HERE
) -> Case:
    """A beam on a crank, at once or at the end of a rigid arm [m], driven to `turn` [rad/s] within
    Ts [s]; its deflection.
    """
    x, y = at
    root, tip = (x + arm, y), (x + arm + 1.0, y)
    parts, hinge = [rod("beam", root, tip, E, 10e-3)], At("beam", "left")
    held: list[Any] = []
    if arm:
        parts, hinge = [link("arm", at, root, 100.0), *parts], At("arm", "a")
        held = [joints.Weld("grip", At("beam", "left"), At("arm", "b"))]
    angle = of_time(
        "turn*where(t < Ts, t**2/(2*Ts) + Ts/(2*pi)**2*(cos(2*pi*t/Ts) - 1), t - Ts/2)",
        {"turn": turn, "Ts": Ts},
    )
    held += [joints.Pin("hinge", hinge), joints.DrivenAngle("drive", hinge, angle)]
    outputs = {"bend": probes.Deflection(At("beam", "right"), At("beam", "left"))}
    return case(1e-2, 200, parts, held, [], Rayleigh(), outputs)


def pendulum(
    g: float = 9.81,
    E: float = 1e9,
    d: float = 10e-3,
    links: int = 2,
    dim: int = 2,
    at: Place = HERE,
) -> Case:
    """Links of 0.5 m, each a right turn from the one before, fall from rest; in space the second
    one sideways.
    """
    ways = [(0.5, 0.0), (0.0, 0.5), (0.5, 0.0)]
    foot, parts, held = at, list[Any](), list[Any]()
    last: Any = None
    for k in range(links):
        end = (foot[0] + ways[k][0], foot[1] + ways[k][1])
        parts.append(rod(f"l{k}", foot, end, E, d, 4, dim=dim))
        held.append(joints.Pin(f"p{k}", At(f"l{k}", "left"), last))
        foot, last = end, At(f"l{k}", "right")
    down = (0.0, -g) if dim == 2 else (0.0, 0.0, -g)
    outputs = {"tip": probes.Position(last), "hold": probes.Reaction("p0")}
    return case(4e-3, 150, parts, held, [loads.Gravity(down)], Rayleigh(), outputs)


def crank_slider(E: float = 1e9, turn: float = 6.0, mass: float = 0.3, at: Place = HERE) -> Case:
    """A rigid crank of 0.2 m, driven, a flexible rod of 0.6 m, a mass on a slide."""
    x, y = at
    knee, end = (x, y + 0.2), (x + 0.6, y + 0.2)
    parts = [
        link("crank", at, knee, 0.3),
        rod("rod", knee, end, E, 20e-3),
        bodies.point_mass("block", mass, end),
    ]
    hinge = At("crank", "a")
    held = [
        joints.Pin("hinge", hinge),
        joints.DrivenAngle("drive", hinge, of_time("turn*(t - sin(pi*t)/pi)", {"turn": turn})),
        joints.Pin("knee", At("rod", "left"), At("crank", "b")),
        joints.Pin("pin", At("block", "center"), At("rod", "right")),
        joints.Slider("slide", At("block", "center"), (1.0, 0.0)),
    ]
    outputs = {
        "block": probes.Position(At("block", "center")),
        "mid": probes.Position(At("rod", "middle")),
    }
    return case(5e-3, 200, parts, held, [], Rayleigh(), outputs)


def four_bar(E: float = 1e9, M: float = 1.0, at: Place = HERE) -> Case:
    """Rigid crank and rocker with a flexible coupler; a moment M [N m] turns the crank."""
    x, y = at
    knee, hand, foot = (x, y + 0.2), (x + 0.6, y + 0.4), (x + 0.6, y)
    parts = [
        link("crank", at, knee, 0.5),
        rod("coupler", knee, hand, E, 8e-3),
        link("rocker", foot, hand, 1.0),
    ]
    held = [
        joints.Pin("A", At("crank", "a")),
        joints.Pin("B", At("coupler", "left"), At("crank", "b")),
        joints.Pin("C", At("coupler", "right"), At("rocker", "b")),
        joints.Pin("D", At("rocker", "a")),
    ]
    turn = loads.Moment("M", At("crank", "frame"), M, of_time("sin(6*t)"))
    outputs = {
        "hand": probes.Position(At("rocker", "b")),
        "mid": probes.Position(At("coupler", "middle")),
    }
    return case(4e-3, 150, parts, held, [turn], Rayleigh(), outputs)


def sprung(k: float = 2.0, c: float = 0.0, rest: float = 0.5, E: float = 1e9) -> Case:
    """A rigid arm on a torsion spring k [N m/rad], damped by c [N m s/rad], with a beam at its end."""
    parts = [link("arm", HERE, (0.5, 0.0), 0.5), rod("beam", (0.5, 0.0), (1.0, 0.0), E, 8e-3)]
    held = [
        joints.Pin("hinge", At("arm", "a")),
        joints.Weld("grip", At("beam", "left"), At("arm", "b")),
    ]
    spring = loads.TorsionSpring(
        "spring", At("arm", "frame"), stiffness=k, damping=c, rest_angle=rest
    )
    outputs = {
        "tip": probes.Position(At("beam", "right")),
        "angle": probes.Angle(At("arm", "frame")),
    }
    return case(5e-3, 200, parts, held, [spring], Rayleigh(), outputs)


def shaken(w: float = 6.0, mass: float = 0.2, E: float = 1e8, a: float = 0.05) -> Case:
    """A cable with a mass [kg] at its end hangs from a support that is moved by a sin(w t) [m]."""
    parts = [
        rod("cable", HERE, (0.0, -0.8), E, 6e-3),
        bodies.point_mass("load", mass, np.array([0.0, -0.8])),
    ]
    moved = of_time("a*(1 - cos(w*t))", {"a": a, "w": w})
    held = [
        joints.DrivenPosition("support", At("cable", "left"), (moved, of_time(0.0))),
        joints.Pin("hook", At("load", "center"), At("cable", "right")),
    ]
    outputs = {"load": probes.Position(At("load", "center"))}
    return case(5e-3, 200, parts, held, [loads.Gravity((0.0, -9.81))], Rayleigh(), outputs)


def sheet(F: float = 0.5, E: float = 1e9, t: float = 4e-3, history: str = RAMP) -> Case:
    """A square plate, clamped at one edge, pushed across at a corner by a force F [N]."""
    body = plate("sheet", grid(2, 2), t, bodies.Material(E, 1500.0))
    held = [Edge("clamp", "sheet", ("left",), slope="z")]
    force = loads.PointForce("F", At("sheet", "corner"), (0.0, 0.0, F), of_time(history))
    return case(
        1e-2,
        100,
        [body],
        held,
        [force],
        Rayleigh(),
        {"corner": probes.Position(At("sheet", "corner"))},
    )


PENDULUM = {"g": (6.0, 12.0)}
#: thirty families by name
FAMILIES: dict[str, Family] = {
    "buckling": Family(column, {"P": (1.19, 2.38)}, tolerance=1e-3),
    "buckling, 200 m away": Family(column, {"P": (1.19, 2.38)}, {"at": AWAY}, tolerance=1e-3),
    "below buckling": Family(column, {"P": (0.5, 1.9)}),
    "buckling, side force": Family(column, {"q": (1e-4, 1e-2)}, {"P": 2.1}),
    "buckling, two parameters": Family(column, {"P": (1.2, 2.2), "E": (0.9e9, 1.1e9)}),
    "snap-through": Family(arch, {"P": (0.5, 2.0)}),
    "snap-through, wanted": Family(arch, {"P": (0.5, 2.0)}, tolerance=1e-2),
    "below snap-through": Family(arch, {"P": (0.2, 0.8), "E": (0.9e9, 1.1e9)}, tolerance=1e-3),
    "snap-through, 10 km away": Family(arch, {"P": (0.5, 2.0)}, {"at": FAR}),
    "resonance": Family(cantilever, {"w": (5.0, 9.0)}, {"F": 0.05}),
    "resonance, damped": Family(
        cantilever,
        {"w": (5.0, 9.0), "E": (0.9e9, 1.1e9)},
        {"F": 0.05, "damping": 0.5},
        tolerance=1e-3,
    ),
    "small motion, 10 km away": Family(cantilever, {"F": (1e-5, 1e-4)}, {"w": 6.0, "at": FAR}),
    "slow load": Family(
        cantilever,
        {"F": (0.1, 1.0)},
        {"history": "t/10", "damping": 8.0, "step": 4e-2},
        tolerance=1e-3,
    ),
    "sudden load": Family(cantilever, {"F": (0.1, 2.0), "d": (8e-3, 12e-3)}, {"history": "1"}),
    "long beam": Family(
        cantilever,
        {"E": (0.5e9, 2e9)},
        {"F": 0.5, "w": 1.0, "length": 5.0, "d": 0.04, "step": 2e-2},
    ),
    "rolled up": Family(rolled, {"M": (0.2, 2.0)}),
    "rolled up, two parameters": Family(
        rolled, {"M": (0.2, 1.0), "E": (0.8e9, 1.2e9)}, tolerance=1e-3
    ),
    "driven crank": Family(spun, {"E": (0.5e9, 1.5e9)}),
    "driven crank, three parameters": Family(
        spun, {"E": (0.8e9, 1.2e9), "turn": (2.0, 5.0), "Ts": (0.8, 1.2)}
    ),
    "small beam on a large machine": Family(
        spun, {"turn": (0.01, 0.03)}, {"arm": 20.0}, tolerance=1e-3
    ),
    "pendulum": Family(pendulum, PENDULUM, {"links": 1}, tolerance=1e-3),
    "double pendulum": Family(pendulum, {**PENDULUM, "E": (0.7e9, 1.3e9)}),
    "double pendulum in space, 10 km away": Family(
        pendulum, PENDULUM, {"dim": 3, "at": FAR}, tolerance=1e-3
    ),
    "triple pendulum": Family(pendulum, {"E": (0.5e9, 2e9)}, {"links": 3}),
    "crank and slider": Family(crank_slider, {"E": (0.5e9, 2e9), "mass": (0.1, 0.5)}),
    "crank and slider, 200 m away": Family(
        crank_slider, {"turn": (3.0, 8.0)}, {"at": AWAY}, tolerance=1e-3
    ),
    "four-bar linkage": Family(four_bar, {"M": (0.2, 1.0), "E": (0.5e9, 1.5e9)}, tolerance=1e-3),
    "torsion spring": Family(sprung, {"k": (1.0, 4.0), "c": (0.0, 0.2), "rest": (0.2, 1.0)}),
    "shaken cable": Family(shaken, {"w": (3.0, 9.0), "mass": (0.1, 0.4)}),
    "plate": Family(sheet, {"F": (0.1, 2.0)}, tolerance=1e-3),
}
