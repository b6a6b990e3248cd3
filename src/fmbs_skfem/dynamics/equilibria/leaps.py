r"""Load steps that leave their path: the way from one equilibrium to the next, beside what both of
them expect.

    c = x1 - x0,    f = - K0^-1 R(x0, s1),    g = K1^-1 R(x1, s0),    |min(1, |c|/|v|) v - c| <= RESOLVED |c|,   v = f, g

R(x, s) are the forces and gaps of a state at a load factor: f is the first correction of Newton's
iteration, g what the equilibrium that it found expects of the same change of loads. On a path both
agree with c up to its curvature. Behind a limit point there is no equilibrium near, and the
iteration finds another one: c is then against one of them, or longer than both would have it,
however short the step. f may be longer than c, as where a thin plate begins to stretch, or close to
a limit point.

Lengths are those of the diagonal of the metric, so that they depend neither on the mesh nor on the
choice of coordinates.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...systems import compiled
from ...systems.compiled import Compiled
from ...systems.system import System
from ..names import places
from ..scheme import round_off
from ..trajectory import Crossing, Trajectory
from .equilibrium import FLOOR, Equilibrium

# a roll-up in 12 load steps goes its way with anything from 0.35 to 0.95
#: part of c by which f and g may miss it: 3.3 times as short, or 41 degrees to the side
RESOLVED = 0.7
SMALL = 0.01  #: of the displacement so far: what is shorter is no leap, as a contact that closes in the step
STILL = 0.02  #: displacement over the size of the system that counts as one so far
# an angle that turns by pi may have turned either way: what is left of it is for the error of the
# one expected
WIDE = 2.0  #: most that an angle of an output turns in a step [rad], of which turns are counted
LISTED = 3  #: leaps in a warning


class Verdict(NamedTuple):
    """What is found of a load step.

    A step that is not resolved, or crosses, is made shorter (`statics.march`); what stays is among
    the `crossings` of the path.
    """

    resolved: bool  #: whether it follows its path
    crossed: bool  #: whether the number of negative pivots changes
    soft: bool  #: whether the state before expects far more than what it found: shorter steps will tell
    leaps: bool  #: whether it is a leap, if it is not made any shorter


def judge(model: Compiled, before: Equilibrium, after: Equilibrium, start: np.ndarray) -> Verdict:
    """What is to be said of a step from one equilibrium to another, of a path that began in `start`
    (n,); `model` at the former.

    Lengths and the rule of RESOLVED are those of the module. A step that is as short as round-off,
    or one whose first correction or last tangent is not known, counts as resolved.
    """
    system = model.system
    n = len(after.x)
    c = after.x - before.x
    w = system.metric.diagonal() / system.weight
    length = norm(w, c)
    crossed = None not in (before.negative, after.negative) and before.negative != after.negative
    if length <= FLOOR * round_off(system) or after.first is None or after.tangent is None:
        return Verdict(True, crossed, False, False)
    f = after.first
    found = after.tangent.solve(
        compiled.residual(model, after.x, after.multipliers, before.at, before.memory)
    )
    far = max(norm(w, after.x - start), norm(w, before.x - start), length, STILL * system.scale)
    missed = [
        norm(w, min(1.0, length / max(norm(w, v), 1e-300)) * v - c)
        for v in (f, *([found[:n]] if found is not None else []))
    ]
    resolved = max(missed) <= RESOLVED * length
    return Verdict(resolved, crossed, norm(w, f) > length, not resolved and length > SMALL * far)


def norm(w: np.ndarray, u: np.ndarray) -> float:
    """Length of a displacement u (n,) with weights w (n,) [m].

        sqrt(sum_i w_i u_i^2)

    with w_i the diagonal of the metric over the mass of the system.
    """
    return float(np.sqrt(max(float(w @ (u * u)), 0.0)))


def crossing(
    system: System, before: Equilibrium, after: Equilibrium, verdict: Verdict
) -> tuple[Crossing, ...]:
    """What a step that is kept has passed, if anything.

    A leap stands before a branch point: of a step that is both it is the one that is told. Nothing
    for a step that is neither.
    """
    if not (verdict.leaps or verdict.crossed):
        return ()
    distance, place = longest(system, after.x - before.x)
    pivots = before.negative, after.negative
    sign = "the way is against what one of both ends expects, or far longer"
    if verdict.leaps:
        return (Crossing("leap", before.at, after.at, distance, place, pivots, sign),)
    return (
        Crossing(
            "branch point",
            before.at,
            after.at,
            distance,
            place,
            pivots,
            "the number of negative pivots changes",
        ),
    )


def longest(system: System, u: np.ndarray) -> tuple[float, str]:
    """How far a displacement (n,) takes a point at most [m], and which one that is.

    Of a component that is saved without its bodies it is the root mean square over the mass, of
    "the whole model".
    """
    base = system.full or system
    moved = np.asarray(system.lift.matrix @ u)
    if len(base.unit) * base.dim != len(moved):  # a component that is saved without its bodies
        return norm(system.metric.diagonal() / system.weight, u), "the whole model"
    ways = np.linalg.norm(moved.reshape(-1, base.dim), axis=1) * (base.unit > 0.5)
    node = int(ways.argmax())
    body = next(name for name, first, last in base.coordinates if first <= node * base.dim < last)
    return float(ways[node]), places(base).get(node * base.dim, body).rpartition(",")[0] or body


def summarise(states: Trajectory) -> Iterator[str]:
    """All leaps of a path of equilibria."""
    found = [one for one in states.crossings if one.kind == "leap"]
    if not found:
        return
    listed = [
        f"by {one.distance:.3g} m ({one.place}) between {one.before:.6g} and {one.after:.6g}"
        for one in found[:LISTED]
    ]
    more = f" and {len(found) - LISTED} more" if len(found) > LISTED else ""
    text = f"the equilibrium jumps {', '.join(listed)}{more}: the load steps skip a part of its path there"
    yield f"{text}; follow it by `method: arc_length`, or take the motion (`type: dynamic`) to see where it comes to rest"
