"""Scenes that ask for an accuracy: mechanisms of beams, rigid bodies and shells, by name.

Every one leaves its step, and the cells of its lines, to be found. Half of them are meant to be
hard: outputs that settle slowly, what jumps, what is short beside a step of a two-hundredth of the
motion, and what repeats as often as such steps.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from fmbs_skfem import scenes
from fmbs_skfem.scenes.schema import Scene

ROOT = Path(__file__).resolve().parents[1]
MESHES = ROOT / "meshes"
MESH = MESHES / "beam_20.msh"  #: one metre along x, left to right
PLASTIC = "{young_modulus: 1 GPa, density: 1800 kg/m^3}"
STEEL = "{young_modulus: 210 GPa, density: 7850 kg/m^3}"
GRAVITY = "  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}"
#: a flat strip of 1 m by 0.1 m
STRIP_OF_SHELL = {
    "format": "fmbs-nurbs",
    "version": 1,
    "patches": [
        {
            "degree": [1, 1],
            "knots": [[0, 0, 1, 1], [0, 0, 1, 1]],
            "control": [[[0, 0, 0], [0, 0.1, 0]], [[1, 0, 0], [1, 0.1, 0]]],
        }
    ],
}
IN_SPACE = "  weight: {type: gravity, acceleration: [0, 0, -9.81 m/s^2]}"


def beam(
    name: str, length: float = 1.0, x: float = 0.0, y: float = 0.0, turn: float = 0.0, **more: str
) -> str:
    """A cable of a length [m] from (x, y), turned by an angle [deg]."""
    shape = {"section": "{shape: circular, diameter: 10 mm}", "material": PLASTIC} | more
    place = f"origin: [{x}, {y}], rotation: {turn} deg"
    return (
        f"  {name}: {{type: cable, mesh: {MESH.name}, unit: {length} m, {place}, "
        + ", ".join(f"{k}: {v}" for k, v in shape.items())
        + "}"
    )


def in_space(name: str, x: float = 0.0, y: float = 0.0, turn: float = 0.0, **more: str) -> str:
    """The same in space, in the plane of x and y."""
    return (
        beam(name, x=x, y=y, turn=turn, **more)
        .replace(f"[{x}, {y}]", f"[{x}, {y}, 0]")
        .replace(f"rotation: {turn} deg", f"rotation: {{axis: [0, 0, 1], angle: {turn} deg}}")
    )


def mechanism(
    duration: float,
    bodies: list[str],
    joints: list[str],
    loads: list[str],
    outputs: list[str],
    dim: int = 2,
    more: str = "",
) -> str:
    """The text of a scene."""
    parts = {"bodies": bodies, "joints": joints, "loads": loads, "outputs": outputs}
    text = "".join(f"{key}:\n" + "\n".join(lines) + "\n" for key, lines in parts.items() if lines)
    return f"schema: 1\ndimension: {dim}\n{text}{more}analysis: {{type: dynamic, duration: {duration} s, step: auto}}\n"


def pin(name: str, at: str, to: str = "ground") -> str:
    return f"  {name}: {{type: pin, at: {at}, to: {to}}}"


TIP = "  tip: {type: position, at: beam.right}"
HELD = "  O: {type: clamp, at: beam.left}"
PINNED = pin("O", "beam.left")
STRIP = {"section": "{shape: rectangular, width: 20 mm, height: 3 mm}"}
RUN_UP = "where(t < 0.5, 4 * t**2 * (1.5 - t), 1 + 3 * (t - 0.5))"

#: bodies, joints, loads and outputs
CRANK_SLIDER = (
    [beam("crank", 0.15, **STRIP), beam("rod", 0.5, 0.15, **STRIP)],
    [
        pin("O", "crank.left"),
        pin("A", "crank.right", "rod.left"),
        "  S: {type: slider, at: rod.right, direction: [1, 0]}",
        "  motor: {type: driven_angle, at: crank.left, angle: 10 * t**2}",
    ],
    [],
    [
        "  middle: {type: position, at: {body: rod, s: 0.25 m}}",
        "  S: {type: position, at: rod.right}",
    ],
)

SCENES: dict[str, str] = {
    "cantilever_step": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        ["  f: {type: point_force, at: beam.right, force: [0, -0.5 N]}"],
        [TIP],
    ),
    "cantilever_ramp": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        ["  f: {type: point_force, at: beam.right, force: [0, -1 N], history: sin(pi * t / 1)**2}"],
        [TIP],
    ),
    "follower": mechanism(
        0.6,
        [beam("beam")],
        [HELD],
        ["  f: {type: follower, at: beam.right, force: [0, 0.4 N], history: sin(3 * t)}"],
        [TIP],
    ),
    "pendulum": mechanism(1.5, [beam("beam")], [PINNED], [GRAVITY], [TIP]),
    "stiff_pendulum": mechanism(1.5, [beam("beam", material=STEEL)], [PINNED], [GRAVITY], [TIP]),
    "rope_swing": mechanism(
        1.5,
        [beam("beam", section="{shape: circular, diameter: 3 mm}", turn=-30)],
        [PINNED],
        [GRAVITY],
        [TIP],
        more="damping: {mass: 0.5 1/s, stiffness: 0.2 ms}\n",
    ),
    "double_plane": mechanism(
        1.5,
        [beam("first"), beam("second", x=1.0)],
        [pin("O", "first.left"), pin("A", "first.right", "second.left")],
        [GRAVITY],
        ["  tip: {type: position, at: second.right}"],
    ),
    "double_reaction": mechanism(
        1.0,
        [beam("first"), beam("second", x=1.0)],
        [pin("O", "first.left"), pin("A", "first.right", "second.left")],
        [GRAVITY],
        ["  tip: {type: position, at: second.right}", "  O: {type: reaction, joint: O}"],
    ),
    "double_space": mechanism(
        1.5,
        [in_space("first"), in_space("second", x=1.0, turn=90)],
        [
            "  O: {type: spherical, at: first.left}",
            "  A: {type: spherical, at: first.right, to: second.left}",
        ],
        [IN_SPACE],
        ["  tip: {type: position, at: second.right}"],
        3,
    ),
    "chain_of_three": mechanism(
        1.2,
        [beam("a"), beam("b", x=1.0), beam("c", x=2.0)],
        [pin("O", "a.left"), pin("A", "a.right", "b.left"), pin("B", "b.right", "c.left")],
        [GRAVITY],
        ["  tip: {type: position, at: c.right}"],
    ),
    "chain_of_five": mechanism(
        4.0,
        [beam(n, length=0.4, x=0.4 * k) for k, n in enumerate("abcde")],
        [
            pin("O", "a.left"),
            *(
                pin(p.upper(), f"{p}.right", f"{q}.left")
                for p, q in zip("abcd", "bcde", strict=True)
            ),
        ],
        [GRAVITY],
        ["  tip: {type: position, at: e.right}"],
    ),
    "spin_up": mechanism(
        2.0,
        [beam("beam")],
        [PINNED, f'  drive: {{type: driven_angle, at: beam.left, angle: "{RUN_UP}"}}'],
        [],
        ["  deflection: {type: deflection, tip: beam.right, root: beam.left}"],
    ),
    "spin_position": mechanism(
        2.0,
        [beam("beam")],
        [PINNED, f'  drive: {{type: driven_angle, at: beam.left, angle: "{RUN_UP}"}}'],
        [],
        [TIP],
    ),
    "four_bar": mechanism(
        1.5,
        [
            beam("crank", 0.2, **STRIP),
            beam("coupler", 0.5, 0.2, turn=53.13010235415598, **STRIP),
            beam("rocker", 0.4, 0.5, turn=90, **STRIP),
        ],
        [
            pin("O", "crank.left"),
            pin("A", "crank.right", "coupler.left"),
            pin("C", "coupler.right", "rocker.right"),
            pin("D", "rocker.left"),
            '  motor: {type: driven_angle, at: crank.left, angle: "where(t < 0.5, 8 * t**2 * (1.5 - t), 2 + 6 * (t - 0.5))"}',
        ],
        [GRAVITY],
        ["  C: {type: position, at: coupler.right}"],
        more="damping: {stiffness: 1 ms}\n",
    ),
    "crank_slider": mechanism(1.0, *CRANK_SLIDER),
    "sprung": mechanism(
        1.0,
        [beam("beam")],
        [PINNED],
        [
            GRAVITY,
            "  s: {type: spring_damper, at: beam.right, to: [1 m, 0.3 m], stiffness: 40 N/m, damping: 0.4 N s/m}",
        ],
        [TIP],
    ),
    "with_a_mass": mechanism(
        1.5,
        [beam("beam"), "  bob: {type: point_mass, mass: 0.3 kg, position: [1 m, 0]}"],
        [PINNED, "  hook: {type: spherical, at: bob, to: beam.right}"],
        [GRAVITY],
        [TIP],
    ),
    "rigid_pendulum": mechanism(
        1.5,
        [
            "  rod: {type: rigid, mass: 1 kg, inertia: 0.08 kg m^2, center: [0.5 m, 0], points: {left: [0, 0], right: [1 m, 0]}}"
        ],
        [pin("O", "rod.left")],
        [GRAVITY],
        ["  tip: {type: position, at: rod.right}"],
    ),
    "arm_regulated": mechanism(
        1.0,
        [beam("beam", **STRIP)],
        [PINNED],
        [
            "  m: {type: control_torque, at: beam.left, torque: -8 N m * (angle - 0.5) - 0.8 N m s * rate}"
        ],
        [TIP],
    ),
    "arm_jump": mechanism(
        1.0,
        [beam("beam", **STRIP)],
        [PINNED],
        [
            "  m: {type: torsion_spring, at: beam.left, stiffness: 10 N m/rad, rest_angle: 1 rad, damping: 0.05 N m s/rad}"
        ],
        [TIP],
    ),
    "stop": mechanism(
        1.0,
        [beam("beam")],
        [PINNED],
        [
            GRAVITY,
            "  s: {type: stop, at: beam.right, to: [1 m, -0.4 m], direction: [0, 1], stiffness: 1 kN/m}",
        ],
        [TIP],
    ),
    "floor": mechanism(
        0.8,
        [beam("beam", y=0.3)],
        [],
        [
            GRAVITY,
            "  f: {type: contact_plane, body: beam, point: [0, 0], normal: [0, 1], stiffness: 5 kN/m, damping: 5 N s/m}",
        ],
        [TIP],
    ),
    "rope_taut": mechanism(
        1.0,
        [beam("beam")],
        [PINNED],
        [
            GRAVITY,
            "  r: {type: rope, at: beam.right, to: [1 m, 0.5 m], stiffness: 1 kN/m, length: 0.7 m}",
        ],
        [TIP],
    ),
    "switched_off": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        [
            '  f: {type: point_force, at: beam.right, force: [0, -0.5 N], history: "where(t < 0.3337, 1, 0)"}'
        ],
        [TIP],
    ),
    "corners": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        [
            '  f: {type: point_force, at: beam.right, force: [0, -1 N], history: "max(0, 1 - abs(t / 0.3 - 1))"}'
        ],
        [TIP],
    ),
    "corner_drive": mechanism(
        1.0,
        [beam("beam", **STRIP)],
        [
            PINNED,
            '  d: {type: driven_angle, at: beam.left, angle: "where(t < 0.4, 2 * t**2, 0.32 + 1.6 * (t - 0.4))"}',
        ],
        [],
        [TIP],
    ),
    "motor": mechanism(
        1.5,
        [beam("beam", 0.5, **STRIP)],
        [PINNED],
        ["  m: {type: motor, at: beam.left, stall_torque: 0.3 N m, no_load_speed: 120 rpm}"],
        [TIP],
    ),
    "resting": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        ["  f: {type: point_force, at: beam.right, force: [0, 0 N]}"],
        [TIP],
    ),
    "velocity": mechanism(
        1.0, [beam("beam")], [PINNED], [GRAVITY], ["  v: {type: velocity, at: beam.right}"]
    ),
    "section": mechanism(
        1.0,
        [beam("beam")],
        [PINNED],
        [GRAVITY],
        ["  s: {type: section_forces, at: {body: beam, s: 0.5 m}}"],
    ),
    "energy": mechanism(1.5, [beam("beam")], [PINNED], [GRAVITY], ["  e: {type: energy}"]),
    "free_flight": mechanism(
        1.0,
        [beam("beam")],
        [],
        [GRAVITY],
        [TIP],
        more="initial:\n  bodies:\n    beam: {velocity: [2 m/s, 5 m/s], angular_velocity: 8 rad/s}\n",
    ),
    "swing_fast": mechanism(
        1.0,
        [beam("beam", material=STEEL)],
        [PINNED],
        [],
        [TIP],
        more="initial:\n  bodies:\n    beam: {angular_velocity: 10 rad/s}\n",
    ),
    "quintic": mechanism(
        1.5, [beam("beam", degree="5", continuity="4")], [PINNED], [GRAVITY], [TIP]
    ),
    "smooth_cubic": mechanism(
        1.5, [beam("beam", degree="3", continuity="2")], [PINNED], [GRAVITY], [TIP]
    ),
}
#: an angle that begins and ends without a jump [rad]
RUN_UP_SOFT = "1.5 * (t - sin(2 * pi * t) / (2 * pi))"
WHOLE_TURNS = "where(t < 2, 10 * pi * t - 20 * sin(pi * t / 2), 20 * pi * (t - 1))"  #: up to ten turns a second


def block(
    name: str, x: float, y: float, points: str = "", mass: float = 1.0, inertia: float = 0.01
) -> str:
    """A rigid body in the plane, with its centre at (x, y)."""
    return f"  {name}: {{type: rigid, mass: {mass} kg, inertia: {inertia} kg m^2, center: [{x}, {y}], points: {{{points}}}}}"


def moving(**bodies: str) -> str:
    """Velocities of bodies at the start."""
    return "initial:\n  bodies:\n" + "".join(
        f"    {name}: {{{motion}}}\n" for name, motion in bodies.items()
    )


SCENES |= {
    "root_forces": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        ["  f: {type: point_force, at: beam.right, force: [0, -1 N], history: sin(pi * t)**2}"],
        ["  O: {type: reaction, joint: O}", "  root: {type: section_forces, at: beam.left}"],
    ),
    "drive_torque": mechanism(
        1.0,
        [beam("beam", **STRIP)],
        [PINNED, f"  drive: {{type: driven_angle, at: beam.left, angle: {RUN_UP_SOFT}}}"],
        [],
        [
            "  drive: {type: reaction, joint: drive}",
            "  middle: {type: section_forces, at: {body: beam, s: 0.3 m}}",
        ],
    ),
    "slopes": mechanism(
        1.5,
        [beam("beam", turn=-45)],
        [PINNED],
        [GRAVITY],
        ["  slope: {type: slope, at: beam.right}", "  a: {type: angle, at: beam.left}"],
    ),
    "between_beams": mechanism(
        1.2,
        [beam("one"), beam("two", 0.8, y=0.3, material=STEEL)],
        [pin("O", "one.left"), pin("P", "two.left")],
        [
            GRAVITY,
            "  s: {type: spring_damper, at: one.right, to: two.right, stiffness: 60 N/m, damping: 0.2 N s/m}",
        ],
        ["  s: {type: load, load: s}", "  d: {type: distance, at: one.right, to: two.right}"],
    ),
    "rigid_double": mechanism(
        2.0,
        [
            block("one", 0.25, 0, "a: [0, 0], b: [0.5 m, 0]"),
            block("two", 0.75, 0, "a: [0.5 m, 0], b: [1 m, 0]"),
        ],
        [pin("O", "one.a"), pin("A", "one.b", "two.a")],
        [GRAVITY],
        [
            "  one: {type: angle, at: one}",
            "  w: {type: angular_velocity, at: two}",
            "  A: {type: reaction, joint: A}",
        ],
    ),
    "rigid_chaos": mechanism(
        20.0,
        [
            block("one", 0.25, 0, "a: [0, 0], b: [0.5 m, 0]"),
            block("two", 0.75, 0, "a: [0.5 m, 0], b: [1 m, 0]"),
        ],
        [pin("O", "one.a"), pin("A", "one.b", "two.a")],
        [GRAVITY],
        ["  tip: {type: position, at: two.b}"],
    ),
    "many_swings": mechanism(
        60.0,
        [block("rod", 0.5, 0, "left: [0, 0], right: [1 m, 0]", inertia=0.08)],
        [pin("O", "rod.left")],
        [GRAVITY],
        ["  tip: {type: position, at: rod.right}"],
    ),
    "whole_turns": mechanism(
        10.0,
        [beam("beam", 0.3, section="{shape: circular, diameter: 3 mm}")],
        [PINNED, f'  drive: {{type: driven_angle, at: beam.left, angle: "{WHOLE_TURNS}"}}'],
        ['  f: {type: follower, at: beam.right, force: [0, 20 mN], history: "sin(t)"}'],
        ["  w: {type: deflection, tip: beam.right, root: beam.left}"],
        more="damping: {stiffness: 2 ms}\n",
    ),
    "hum": mechanism(
        5.0,
        [beam("beam")],
        [HELD],
        [
            "  f: {type: point_force, at: beam.right, force: [0, 2 N], history: sin(2 * pi * 20 * t)}"
        ],
        [TIP],
        more="damping: {stiffness: 2 ms}\n",
    ),
    "pulse": mechanism(
        1.0,
        [beam("beam")],
        [HELD],
        [
            '  f: {type: point_force, at: beam.right, force: [0, 20 N], history: "where(abs(t - 0.503) < 0.002, 1, 0)"}'
        ],
        [TIP],
        more="damping: {stiffness: 2 ms}\n",
    ),
    "short_blow": mechanism(
        1.0,
        [beam("beam"), "  bob: {type: point_mass, mass: 0.1 kg, position: [1 m, 0]}"],
        [HELD, "  hook: {type: spherical, at: bob, to: beam.right}"],
        [
            '  f: {type: point_force, at: bob, force: [0, 100 N], history: "where(t < 0.004, sin(pi * t / 0.004)**2, 0)"}'
        ],
        [TIP, "  v: {type: velocity, at: bob}"],
        more="damping: {stiffness: 2 ms}\n",
    ),
    "bushing": mechanism(
        1.0,
        [block("engine", 0.1, 0, "foot: [0, 0]", 20, 0.5)],
        [],
        [
            "  m: {type: bushing, at: engine.foot, stiffness: [40 kN/m, 80 kN/m], damping: [60 N s/m, 90 N s/m], "
            "torsional_stiffness: 900 N m/rad, torsional_damping: 2 N m s/rad}",
            "  f: {type: point_force, at: engine.center, force: [0, 300 N], history: sin(40 * t)}",
        ],
        ["  m: {type: load, load: m.y}", "  c: {type: position, at: engine.center}"],
    ),
    "linked": mechanism(
        1.2,
        [beam("beam", **STRIP), "  bob: {type: point_mass, mass: 0.2 kg, position: [1 m, -0.4 m]}"],
        [
            PINNED,
            "  link: {type: distance, at: beam.right, to: bob}",
            "  s: {type: driven_angle, at: beam.left, angle: 0.3 * (1 - cos(4 * t))}",
        ],
        [GRAVITY],
        ["  bob: {type: position, at: bob}", "  link: {type: reaction, joint: link}"],
        more="damping: {stiffness: 1 ms}\n",
    ),
    "engine": mechanism(
        0.6,
        [
            block("crank", 0.05, 0, "O: [0, 0], A: [0.1 m, 0]", 2, 0.01),
            beam("rod", 0.3, 0.1, **STRIP),
            block("piston", 0.4, 0, "", 0.4, 0.001),
        ],
        [
            pin("O", "crank.O"),
            pin("A", "crank.A", "rod.left"),
            pin("B", "rod.right", "piston.center"),
            "  guide: {type: prismatic, at: piston.frame, direction: [1, 0]}",
            "  motor: {type: driven_angle, at: crank.frame, angle: 30 * t**2}",
        ],
        [],
        [
            "  x: {type: position, at: piston.center, component: x}",
            "  guide: {type: reaction, joint: guide}",
            "  middle: {type: deflection, tip: {body: rod, s: 0.15 m}, root: rod.left}",
        ],
        more="damping: {stiffness: 1 ms}\n",
    ),
    "saw_drive": mechanism(
        1.2,
        [beam("beam", **STRIP)],
        [
            '  O: {type: driven_position, at: beam.left, displacement: [0, "0.1 * abs(2 * (t / 0.4 - floor(t / 0.4 + 0.5)))"]}',
            "  hold: {type: driven_angle, at: beam.left, angle: 0}",
        ],
        [GRAVITY],
        [TIP],
        more="damping: {stiffness: 2 ms}\n",
    ),
    "pid": mechanism(
        2.0,
        [block("hub", 0, 0, "", 1, 0.02), beam("arm", **STRIP)],
        [pin("O", "hub.center"), "  A: {type: weld, at: arm.left, to: hub.frame}"],
        ["  drive: {type: control_torque, at: hub.frame, torque: servo}", GRAVITY],
        [
            "  a: {type: angle, at: hub.frame}",
            "  u: {type: load, load: drive}",
            "  tip: {type: position, at: arm.right}",
        ],
        more="controllers:\n  servo: {type: pid, unit: N m, sample: 4 ms, error: 0.4 * sin(3 * t) - a, kp: 12 N m, "
        "ki: 20 N m/s, kd: 0.1 N m s, limits: [-4 N m, 4 N m]}\n",
    ),
    "cart": mechanism(
        2.0,
        [block("cart", 0, 0, "", 1), beam("pole", 0.6, turn=80, **STRIP)],
        [
            "  rail: {type: prismatic, at: cart.frame, direction: [1, 0]}",
            pin("A", "cart.center", "pole.left"),
        ],
        [
            GRAVITY,
            "  f: {type: control_force, at: cart.center, direction: [1, 0], force: -20 N/m * stretch - 2 N s/m * rate}",
        ],
        [
            "  x: {type: position, at: cart.center, component: x}",
            "  tip: {type: position, at: pole.right}",
            "  e: {type: energy}",
        ],
    ),
    "let_go": mechanism(
        1.2,
        [beam("beam")],
        [PINNED],
        [GRAVITY],
        [TIP, "  e: {type: energy}"],
        more="events:\n  go: {when: tip.y + 0.7 m, direction: falling, release: O, once: true}\n",
    ),
    "catch": mechanism(
        1.2,
        [beam("beam"), block("hand", 1.0, -0.2, "", 0.2, 0.001)],
        [
            PINNED,
            "  grip: {type: latch, at: beam.right, to: hand.frame}",
            "  rail: {type: revolute, at: hand.frame}",
        ],
        [GRAVITY],
        [TIP],
        more="events:\n  catch: {when: tip.y + 0.2 m, direction: falling, lock: grip, once: true}\n",
    ),
    "sliding_block": mechanism(
        1.0,
        [block("box", 0, 0.05, "p: [-50 mm, 0], q: [50 mm, 0]", 1, 0.002)],
        [],
        [
            GRAVITY,
            *(
                f"  {n}: {{type: contact_plane, at: box.{n}, point: [0, 0], normal: [0, 1], stiffness: 20 kN/m, "
                f"dissipation: 1 s/m, friction: 0.3}}"
                for n in "pq"
            ),
        ],
        ["  x: {type: position, at: box.center}", "  p: {type: contact, load: p}"],
        more=moving(box="velocity: [1.5 m/s, 0]") + "",
    ),
    "stick_slip": mechanism(
        2.0,
        [block("box", 0, 0.0, "", 1, 0.002), block("hand", 0.3, 0.0, "", 0.1, 0.001)],
        [
            "  pull: {type: driven_position, at: hand.center, displacement: [0.3 * t**2, 0]}",
            "  hold: {type: driven_angle, at: hand.frame, angle: 0}",
        ],
        [
            GRAVITY,
            "  s: {type: spring_damper, at: box.center, to: hand.center, stiffness: 60 N/m, damping: 0.5 N s/m}",
            "  f: {type: contact_plane, at: box.center, radius: 0 m, point: [0, 0], normal: [0, 1], stiffness: 50 kN/m, "
            "dissipation: 1 s/m, friction: 0.4}",
        ],
        ["  x: {type: position, at: box.center, component: x}", "  f: {type: contact, load: f}"],
    ),
    "ball": mechanism(
        3.0,
        [block("ball", 0, 0.5, "", 0.1, 1e-5)],
        [],
        [
            GRAVITY,
            "  f: {type: contact_plane, at: ball.center, radius: 30 mm, point: [0, 0], normal: [0, 1], "
            "stiffness: 20 kN/m, dissipation: 0.5 s/m}",
        ],
        ["  y: {type: position, at: ball.center, component: y}"],
    ),
    "snap_through": mechanism(
        2.0,
        [
            "  arch: {type: cable, mesh: deep_arc_60.msh, section: {shape: given, EA: 1 MN, EI: 1 N m^2, rhoA: 1 kg/m, "
            "radius: 15 mm}}"
        ],
        ["  clamp: {type: clamp, at: arch.left}", pin("hinge", "arch.right")],
        ["  crown: {type: point_force, at: arch.middle, force: [0, -10 N], history: t}"],
        ["  crown: {type: position, at: arch.middle}"],
        more="damping: {mass: 1 1/s, stiffness: 1 ms}\n",
    ),
    "actuator": mechanism(
        1.0,
        [beam("boom", **STRIP)],
        [pin("O", "boom.left")],
        [
            GRAVITY,
            "  a: {type: actuator, at: {body: boom, s: 0.4 m}, to: [0, -0.5 m], "
            "force: 500 N/m * stretch + 20 N s/m * rate - 20 N * sin(3 * t)}",
        ],
        ["  tip: {type: position, at: boom.right}", "  a: {type: load, load: a}"],
    ),
    "thick_and_thin": mechanism(
        1.0,
        [
            beam("thick", 0.5, section="{shape: circular, diameter: 20 mm}"),
            beam("thin", 0.5, 0.5, section="{shape: circular, diameter: 3 mm}"),
        ],
        [pin("O", "thick.left"), pin("A", "thick.right", "thin.left")],
        [GRAVITY],
        ["  tip: {type: position, at: thin.right}", "  a: {type: position, at: thick.right}"],
        more="damping: {mass: 0.2 1/s, stiffness: 0.5 ms}\n",
    ),
    "velocity_in_flight": mechanism(
        1.0,
        [beam("beam", section="{shape: circular, diameter: 5 mm}")],
        [],
        [GRAVITY],
        ["  v: {type: velocity, at: beam.right}", "  e: {type: energy}"],
        more=moving(beam="velocity: [1 m/s, 3 m/s], angular_velocity: 12 rad/s"),
    ),
    "shell_strip": mechanism(
        0.5,
        [
            "  strip: {type: shell, nurbs: strip.json, cells: 4, degree: 3, thickness: 5 mm, material: {young_modulus: 1 GPa, "
            "density: 1800 kg/m^3}}"
        ],
        ["  root: {type: edge, body: strip, edges: xi1_min, slope: xyz}"],
        [
            "  f: {type: edge_load, body: strip, edges: xi1_max, force: [0, 0, -6 N/m], history: sin(2 * pi * t)**2}"
        ],
        ["  tip: {type: position, at: strip.corner_11}"],
        3,
    ),
    "constant_output": mechanism(
        1.0, [beam("beam")], [PINNED], [GRAVITY], ["  root: {type: position, at: beam.left}", TIP]
    ),
    "straight_fall": mechanism(
        1.0,
        [beam("beam", turn=-90)],
        [PINNED],
        [GRAVITY],
        [TIP, "  N: {type: section_forces, at: {body: beam, s: 0.5 m}}"],
    ),
    "gyro": mechanism(
        1.5,
        [
            "  top: {type: rigid, mass: 1 kg, inertia: [0.01 kg m^2, 0.01 kg m^2, 0.02 kg m^2], center: [0, 0, 0.2 m], "
            "points: {foot: [0, 0, 0], tip: [0, 0, 0.3 m]}}"
        ],
        ["  foot: {type: spherical, at: top.foot}"],
        [IN_SPACE],
        [
            "  tip: {type: position, at: top.tip}",
            "  w: {type: angular_velocity, at: top.frame, axis: [0, 0, 1]}",
        ],
        3,
        more=moving(top="angular_velocity: [0.5 rad/s, 0, 60 rad/s]"),
    ),
}
EXAMPLES = (
    "spin_up",
    "double_pendulum",
    "four_bar",
    "hanging_mass",
    "crossing_beams",
    "heavy_top",
    "controlled_arm",
    "geared_arm",
    "sampled_arm",
    "trapeze",
)


def written(texts: Mapping[str, str], folder: Path) -> Iterator[tuple[str, Scene]]:
    """Scenes by name, from their texts, with the files that they read in a folder."""
    for mesh in MESH, MESHES / "deep_arc_60.msh":
        (folder / mesh.name).write_bytes(mesh.read_bytes())
    (folder / "strip.json").write_text(json.dumps(STRIP_OF_SHELL), encoding="utf-8")
    for name, text in texts.items():
        path = folder / f"{name}.yaml"
        path.write_text(text, encoding="utf-8")
        yield name, scenes.read(path)


def of_names(names: Sequence[str], folder: Path) -> Iterator[tuple[str, Scene]]:
    """Scenes by name, all without: those of this page, and examples, with `example_` before their
    names.
    """
    yield from written(
        {name: text for name, text in SCENES.items() if not names or name in names}, folder
    )
    for name in EXAMPLES:
        if not names or f"example_{name}" in names:
            found = scenes.read(ROOT / "examples" / f"{name}.yaml")
            yield f"example_{name}", replace(found, reduction=None, compare=None)
