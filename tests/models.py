"""Systems that many tests use: the two examples of Hou, Liu, Hu (2020), a cantilever, a pendulum of
one mass, and their meshes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.parts.bodies import reduced_body
from fmbs_skfem.shapes.meshes import polyline, segment
from fmbs_skfem.systems import At, Motion, Rayleigh, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification.integrator import mass_pendulum
from verification.plates import rectangle

__all__ = ["mass_pendulum", "polyline", "segment"]

SECTION = sections.Circular(0.01)  #: section of both examples
MATERIAL = sections.Material(1e9, 1800.0)  #: material of both examples
GRAVITY = 9.81  #: [m/s2]
SPIN_TIME, SPIN_RATE = 1.5, 2 * np.pi  #: Ts [s] and ws [rad/s] of example 1


def spin_angle(time: np.ndarray) -> np.ndarray:
    """Driven angle of example 1 [rad]: spun up over Ts to the rate ws."""
    rising = (
        SPIN_RATE
        / SPIN_TIME
        * (
            time**2 / 2
            + (SPIN_TIME / (2 * np.pi)) ** 2 * (np.cos(2 * np.pi * time / SPIN_TIME) - 1)
        )
    )
    return np.where(time < SPIN_TIME, rising, SPIN_RATE * (time - SPIN_TIME / 2))


def spin_up(
    cells: int = 25,
    *,
    section: object = SECTION,
    damping: Rayleigh | None = None,
    all_multipliers: bool = False,
    **options: Any,
) -> System:
    """Example 1: planar cantilever on a driven hinge; output `tip_deflection`."""
    beam = body.cable("beam", segment(cells), section, MATERIAL, dim=2, **options)
    tip, root = At("beam", "right"), At("beam", "left")
    system = assemble(
        [beam],
        [joints.Pin("hinge", root), joints.DrivenAngle("drive", root, spin_angle)],
        damping=damping,
        outputs={"tip_deflection": probes.Deflection(tip, root), "tip": probes.Position(tip)},
    )
    return system if all_multipliers else eliminate(system)


def turned_by(angle: Any, cells: int = 4) -> System:
    """A planar cantilever on a hinge that is driven; outputs of its tip and of the torque."""
    beam = body.cable("beam", segment(cells), SECTION, MATERIAL, dim=2)
    tip, root = At("beam", "right"), At("beam", "left")
    return assemble(
        [beam],
        [joints.Pin("hinge", root), joints.DrivenAngle("drive", root, angle)],
        damping=Rayleigh(stiffness=1e-3),
        outputs={"tip": probes.Position(tip), "drive": probes.Reaction("drive")},
    )


def double_pendulum(
    cells: int = 25,
    *,
    section: object = SECTION,
    damping: Rayleigh | None = None,
    all_multipliers: bool = False,
    **options: Any,
) -> System:
    """Example 2: spatial double pendulum of two beams at right angles; outputs `B` and `C`."""
    first = body.cable("I", segment(cells), section, MATERIAL, **options)
    second = body.cable("II", segment(cells, (1, 0, 0), (1, 1, 0)), section, MATERIAL, **options)
    system = assemble(
        [first, second],
        [joints.Pin("A", At("I", "left")), joints.Pin("B", At("I", "right"), At("II", "left"))],
        [loads.Gravity((0, 0, -GRAVITY))],
        damping=damping,
        outputs={
            "B": probes.Position(At("I", "right")),
            "C": probes.Position(At("II", "right")),
        },
    )
    return system if all_multipliers else eliminate(system)


def cantilever(
    cells: int = 20,
    loads_at_tip: Callable[[At], list[Any]] = lambda tip: [],
    *,
    length: float = 1.0,
    section: object = sections.Given(EA=1e6, EI=1.0, rhoA=1.0),
    material: sections.Material | None = None,
    dim: int = 2,
    damping: Rayleigh | None = None,
    initial: Mapping[str, Motion] | None = None,
    all_multipliers: bool = False,
    **options: Any,
) -> System:
    """Beam along x clamped at its start, with the loads that `loads_at_tip` makes for its end;
    outputs `tip`, `slope`, `clamp`.
    """
    beam = body.cable(
        "beam", segment(cells, end=(length, 0, 0)), section, material, dim=dim, **options
    )
    tip = At("beam", "right")
    system = assemble(
        [beam],
        [joints.Clamp("clamp", At("beam", "left"))],
        loads_at_tip(tip),
        damping,
        {
            "tip": probes.Position(tip),
            "slope": probes.Slope(tip),
            "clamp": probes.Reaction("clamp"),
        },
        initial,
    )
    return system if all_multipliers else eliminate(system)


def platform(
    cells: int,
    inertia: np.ndarray,
    push: tuple[float, float, float] = (0.0, 0.0, 0.0),
    corners: str = "abc",
) -> System:
    """A rigid platform falls into the cables at its corners, its centre pushed by a force [N];
    output `place` of the centre.
    """
    places = {"a": (0.2, 0.0, 0.0), "b": (-0.1, 0.17, 0.0), "c": (-0.1, -0.17, 0.0)}
    parts, held = [rigid("platform", 2.0, inertia, (0, 0, 0), places=places)], list[joints.Joint]()
    for name in corners:
        x, y, _ = places[name]
        parts.append(body.cable(name, segment(cells, (x, y, 0), (x, y, 1)), SECTION, MATERIAL))
        held += [
            joints.Spherical(f"low {name}", At("platform", name), At(name, "left")),
            joints.Spherical(f"high {name}", At(name, "right")),
        ]
    center = At("platform", "center")
    forces = [loads.Gravity((0.0, 0.0, -GRAVITY)), loads.PointForce("push", center, push)]
    return assemble(parts, held, forces, outputs={"place": probes.Position(center)})


def thrown_plate_part() -> System:
    """A thin plate of four cells with seven functions, hung at a corner and thrown round."""
    full = plate(
        "sheet", rectangle("bfs", 2, 2, 0.5, 0.4), 2e-3, sections.Material(2e9, 1200.0, 0.3), dim=3
    )
    random = np.random.default_rng(5).normal(size=(len(full.reference), 4))
    columns = np.column_stack([full.constant, full.reference[:, :2], random])
    part = reduced_body(full, np.linalg.qr(columns)[0])
    start = {"sheet": Motion(angular_velocity=(0.0, 9.0, 2.0))}
    return eliminate(
        assemble(
            [part],
            [joints.Pin("A", At("sheet", "a"))],
            [loads.Gravity((0, 0, -GRAVITY))],
            initial=start,
        )
    )
