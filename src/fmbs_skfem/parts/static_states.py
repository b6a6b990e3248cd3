r"""States of a solid at rest under what it can meet at its places, to train it alone: no motion is
run.

    one frame held,    forces and moments at all others and its weight, in random directions,    f(x) = s Q

The factor s makes the largest strain of the linear answer that which is wanted, or is 1; states at
s / 2 and s are equilibria of the full body. How it vibrates and what single places do to it are in
the basis by `interface_shapes`; these states add what large forces bend it to beyond that, and the
points of its energy are weighted on them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..bodies.body import Body
from ..core.errors import InputError, say
from ..core.notices import Progress
from ..dynamics.equilibria.statics import solve_statics
from ..reduction.spaces.galerkin import snapshots
from ..systems import At, assemble, eliminate
from ..systems.connections import joints
from ..systems.forces import loads
from . import bodies as parts
from .excitation import Excitation, settle, turns

LEVELS = 2  #: load steps, whose states are all kept
PROBE = 1e-3  #: part of the loads that shows by how much they strain


def find(
    part: Body, excitation: Excitation, progress: Progress | None = None
) -> tuple[np.ndarray, Excitation]:
    """States (s, b, c) of a full solid, and the excitation with what it leaves open.

    InputError where it has no rim or average to be held by, or where it is to spin.
    """
    where = f"training of '{part.name}' alone"
    if not part.frames:
        remedy = "name a face among `rims` or `averages`"
        raise InputError(say(where, "a rim or an average, by which it is held", "none", remedy))
    if excitation.spin:
        raise InputError(say(f"{where}: spin", "none of a solid, which is trained at rest", "one"))
    told = settle(excitation, part)
    random = np.random.default_rng(told.seed)
    names = list(part.frames)
    found = [part.reference[None]]
    for run in range(told.runs):
        held = names[run % len(names)]
        acting = list(pushes(part, told, held, random))
        if told.strain is not None:
            acting = [scaled(one, PROBE) for one in acting]
            (small,) = equilibria(part, held, acting, 1)
            strain = float(parts.largest_strains(part, small[None]).max())
            acting = [scaled(one, told.strain / strain) for one in acting]
        found.append(equilibria(part, held, acting, LEVELS))
        if progress is not None:
            progress((run + 1) / told.runs)
    return np.concatenate(found), told


def equilibria(part: Body, held: str, acting: list[loads.Load], steps: int) -> np.ndarray:
    """States (steps, b, c) of a body under loads that grow, held at a frame."""
    hold = joints.Clamp(held, At(part.name, held))
    motion = solve_statics(eliminate(assemble([part], [hold], acting, pictures=False)), steps)
    q = snapshots(motion).q
    return q.reshape(len(q), -1, part.dim)[1:]


def pushes(
    part: Body, told: Excitation, held: str, random: np.random.Generator
) -> Iterator[loads.Load]:
    """The weight, forces at all places but the one that is held, and moments at frames, of random
    sizes and directions.
    """

    def vector(size: float) -> tuple[float, float, float]:
        x, y, z = size * random.uniform(-1.0, 1.0, 3)
        return (x, y, z)

    yield loads.Gravity(vector(told.gravity))
    for name in (*part.frames, *part.places):
        if name == held:
            continue
        at = At(part.name, name)
        if told.force:
            yield loads.PointForce(f"force {name}", at, vector(told.force))
        if told.moment and turns(part, name):
            yield loads.Torque(f"moment {name}", at, vector(told.moment))


def scaled(load: loads.Load, factor: float) -> loads.Load:
    """A load of `pushes` times a factor."""
    for name in ("acceleration", "force", "torque"):
        if (size := getattr(load, name, None)) is not None:
            return replace(load, **{name: tuple(factor * x for x in size)})  # type: ignore[type-var]
    return load
