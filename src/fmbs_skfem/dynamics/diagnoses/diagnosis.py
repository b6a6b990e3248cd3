r"""Why a solve failed: measured facts by the names of the model, likely causes, and what to try.

    SolverError -> StoppedSolve (`stopped`), `replay` -> facts -> rules -> Diagnosis

Every rule looks at facts only and gives a sentence with their numbers, or nothing. The rules stand
in the order of how sure they are: a signal that is no number explains everything that follows from
it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from typing import Any

import numpy as np

from ...bodies.body import LIMP, STIFF
from ...core.algebra.linalg import is_sparse
from ...core.errors import Reason, SolverError
from ...core.storage.records import dataclass
from ...core.values.arguments import checked
from ...systems import free_motions
from ...systems.system import sizes
from ..integration import FailedStep
from ..names import owners, row_names
from ..outputs import reactions
from ..trajectory import Trajectory
from . import stopped
from .replay import Attempt, replay
from .stability import last_sound
from .stopped import StoppedSolve

LISTED = 5  #: names in a list
WIDE_TURN = 0.5  #: turn in one step that is too much to predict [rad]
UNRESOLVED = 3.0  #: h omega of a spring, above which a step spans half a period
SHARE = 0.2  #: of the stiffest wave, below which a spring is not what is stiff
LARGE = 0.5  #: strain beyond which thin-beam and plate laws mean nothing [-]
#: strain of a reduced model that beams and plates would have avoided by bending [-]
SQUEEZED = 0.02
CLOSE = 0.02  #: smallest singular value of unit rows near a dead centre, relative to the start
WEAK = 1e-12  #: relative singular value of a matrix that counts as singular
SOFT = 0.05  #: part of the smallest eigenvalue that is left near a bifurcation
WHOLE = 0.3  #: way that a load moves its place, or accelerations the mechanism, in one step, in sizes of the system


@dataclass(frozen=True)
class Cause:
    """A likely cause and what to try."""

    name: str  #: of the rule
    what: str
    remedy: str


@dataclass(frozen=True)
class Diagnosis:
    """A failed solve in facts and likely causes. Lists of pairs (name, value) begin with the
    largest.

    What is not known is None or empty: eigenvalues of large models, joints of a system without any,
    attempts of statics. `causes` stand in the order of how sure they are, one at least where
    `explain` made it.
    """

    reason: Reason
    message: str
    at: float  #: time [s] or load factor that was not reached
    good: float | None = None  #: of the last good state
    unit: str = "s"  #: of both; "load factor" in statics
    step: int | None = None  #: number of the step
    residuals: tuple[tuple[str, float], ...] = ()  #: by coordinate or mode [N], joint rows [m]
    #: norm of the force residual by body, component and joint
    by_body: tuple[tuple[str, float], ...] = ()
    #: reactions of joints in the last good state [N, N m]
    multipliers: tuple[tuple[str, float], ...] = ()
    attempts: tuple[Attempt, ...] = ()  #: residual histories of the step sizes that were tried
    #: smallest singular value of the balanced matrix of the iteration, relative
    weakness: float | None = None
    #: share of the weakest direction by body, component and joint
    null: tuple[tuple[str, float], ...] = ()
    null_at: str = ""  #: coordinate or mode that it moves most
    #: negative eigenvalues of the matrix of the whole step on the joints' null space
    negative: int | None = None
    #: lowest eigenvalue there, at the start and in the last good state
    lowest: tuple[float, float] | None = None
    #: smallest and largest in the last good state [-]
    strains: dict[str, tuple[float, float]] = field(default_factory=dict)
    stiffest: float | None = None  #: h omega of the stiffest wave
    #: in one step by body, in the last state whose energy is sound [rad]
    turns: dict[str, float] = field(default_factory=dict)
    way: float | None = None  #: root mean square of h^2 q'' in that state [m]
    sound: float | None = None  #: time of that state behind which the energy balance rises [s]
    #: smallest singular value of the joints' unit rows, at the start and now
    singular: tuple[float, float] | None = None
    causes: tuple[Cause, ...] = ()


@checked
def explain(error: SolverError) -> Diagnosis:
    """The diagnosis of a failed time step, static solution or start: facts by the names of the
    model, and likely causes.

    The error carries what it needs: its run, or the motion found so far. A solve that never started
    has a cause and no measured facts. A failed step is replayed for the course of its iterations.
    """
    found = Diagnosis(error.reason, str(error), float(error.time), residuals=error.worst)
    stop = stopped.stop_of(error)
    known = self_explained(error)
    if stop is None:
        return replace(found, causes=known or (at_start(found),))
    with np.errstate(all="ignore"):
        found = measure(stop, error, found)
        causes = known or tuple(cause for rule in RULES if (cause := rule(stop, found)))
    return replace(found, causes=causes or (long_way(stop, found) or UNKNOWN,))


def self_explained(error: SolverError) -> tuple[Cause, ...]:
    """The cause that an error names itself: what an event or a controller reads, or an unstable
    loop; all else follows from it.
    """
    what, _, remedy = str(error).rpartition("; ")
    if error.reason is Reason.GROWING:
        return (Cause("unstable loop", what, remedy),)
    read = [
        name
        for name, value in error.worst
        if name.startswith(("event ", "controller ")) and not np.isfinite(value)
    ]
    return (Cause("signal", what, remedy),) if read else ()


def measure(stop: StoppedSolve, error: SolverError, found: Diagnosis) -> Diagnosis:
    """All facts."""
    system = stop.system
    names = owners(system)
    labels = row_names(system)
    sizes = {
        name: float(
            np.linalg.norm(stop.residual[[k for k in range(len(names)) if names[k] == name]])
        )
        for name in set(names)
    }
    weak = stopped.weakest(stop)
    now = stopped.eigenvalues(stop, stop.x, stop.multipliers, stop.good)
    start = stopped.eigenvalues(stop, system.x0, 0.0 * stop.multipliers, 0.0)
    joints = len(system.constraints.names) > 0
    return replace(
        found,
        good=stop.good,
        unit="s" if stop.h else "load factor",
        step=error.run.done + 1 if isinstance(error, FailedStep) else None,
        residuals=largest(dict(zip(labels, np.abs(stop.residual), strict=True)))
        if np.isfinite(stop.residual).any()
        else (),
        by_body=largest(sizes),
        multipliers=largest_reactions(error),
        attempts=replay(error.run) if isinstance(error, FailedStep) else (),
        weakness=weak[0] if weak else None,
        null=largest(stopped.shares(names, weak[1])) if weak else (),
        null_at=labels[int(np.abs(weak[1]).argmax())] if weak else "",
        negative=None if now is None else int((now < -WEAK).sum()),
        lowest=None if now is None or start is None else (float(start[0]), float(now[0])),
        strains=stopped.strains(system, stop.x),
        stiffest=stopped.stiffest(stop) if stop.h else None,
        **measure_sound_state(stop, error),
        singular=(stopped.closeness(stop, system.x0)[0], nearest(stop)[0]) if joints else None,
    )


def measure_sound_state(stop: StoppedSolve, error: SolverError) -> dict[str, Any]:
    """Turns and way in one step in the last state whose energy can be believed, and its time where
    it is not the last one.
    """
    x = stop.x
    v = stop.v
    motion = error.partial
    since = None
    if not stop.h:
        return {"turns": {}}
    if (last := last_sound(motion)) < len(motion.times) - 1 or error.reason is Reason.UNSTABLE:
        motion = motion.part(slice(last + 1)).states
        x = motion.x[-1]
        v = motion.v[-1]
        since = float(motion.times[-1])
    turned = {name: stop.h * rate for name, rate in stopped.turns(stop.system, x, v).items()}
    return {
        "turns": turned,
        "way": stop.h**2 * float(sizes(stop.system, motion.a[-1])[0]),
        "sound": since,
    }


def largest(values: dict[str, float]) -> tuple[tuple[str, float], ...]:
    """The largest few of some values, those that are no numbers first."""
    size = {name: abs(value) if np.isfinite(value) else np.inf for name, value in values.items()}
    return tuple(
        (name, float(values[name])) for name in sorted(size, key=lambda name: -size[name])[:LISTED]
    )


def largest_reactions(error: SolverError) -> tuple[tuple[str, float], ...]:
    """The largest reactions of the last stored state; of a reduced model those that it knows."""
    whole: Trajectory = error.partial
    last = reactions(whole.part(slice(-1, None)).states)
    return largest(
        {f"joint {joint}.{row}": float(force[0]) for (joint, row), force in last.items()}
    )


def nearest(stop: StoppedSolve) -> tuple[float, np.ndarray]:
    """The position at the failure, or ahead of it on the way that the last velocities go, that is
    nearest to a dead centre.
    """
    places = (stop.x, stop.trial, stopped.ahead(stop))
    return min((stopped.closeness(stop, x) for x in places), key=lambda found: found[0])


def at_start(found: Diagnosis) -> Cause:
    """A solve that never started: histories without a value, contradictory joints, a wrong initial
    state, or no mass.
    """
    listed = ", ".join(name for name, _ in found.residuals[:LISTED]) or "the joints"
    if found.reason is Reason.NOT_FINITE:
        return not_finite(found.message)
    if found.reason is Reason.NO_EQUILIBRIUM:
        what = "the loads at t = 0 have no equilibrium that load steps reach"
        return Cause(
            "equilibrium",
            what,
            "solve it as `analysis: {type: static}`, which shows how far the loads go, or start in the reference",
        )
    if found.reason is Reason.SINGULAR_TANGENT:
        return Cause(
            "massless",
            f"nothing holds or weighs down {listed}",
            "give the body a density or a mass, or hold it by joints",
        )
    if found.residuals and found.residuals[0][1] > 0.0:
        what = f"the initial state misses {listed}, the worst by {found.residuals[0][1]:.3g}"
        return Cause(
            "closure",
            what,
            "move the bodies or the joint's places until they meet; fmbs check names lengths and places",
        )
    return Cause(
        "contradiction",
        f"joints and drives that ask for different motions of one place: {listed}",
        "remove one of the joints, or the drive against them: a driven motion must be free",
    )


def broken_signal(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """A history that is no number."""
    names = stopped.broken_signals(stop)
    return (
        not_finite(f"the history of {', '.join(names)} is no finite number at t = {stop.at:.6g} s")
        if names
        else None
    )


def broken_force(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """A load whose law is no number in some state there."""
    if found.reason is not Reason.NOT_FINITE or stopped.broken_signals(stop):
        return None
    names = stopped.broken_forces(stop)
    what = f"a load on {' and '.join(names)} is no finite number near the state at t = {stop.good:.6g} s"
    return Cause("force", what, FINITE) if names else None


def not_finite(what: str) -> Cause:
    return Cause("signal", what, FINITE)


def free_body(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """In statics: a direction without any stiffness, also at the start."""
    if (
        stop.h
        or found.weakness is None
        or found.lowest is None
        or found.weakness > WEAK
        or abs(found.lowest[0]) > 1e-9
    ):
        return None
    return Cause(
        "free",
        f"{list_names(found.null)} can move freely (most: {found.null_at})",
        "hold it by joints or springs, or use dynamics",
    )


def buckling(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """In statics: the lowest eigenvalue of the tangent has nearly gone, or has changed its sign."""
    if (
        stop.h
        or found.lowest is None
        or found.lowest[0] <= 1e-9
        or found.lowest[1] > SOFT * found.lowest[0]
    ):
        return None
    what = f"the structure buckles or snaps near load factor {stop.good:.4g}: the lowest eigenvalue of its tangent fell from "
    what += f"{found.lowest[0]:.3g} to {found.lowest[1]:.3g}; {list_names(found.null)} gives way (most: {found.null_at})"
    remedy = "follow the path by arc length (dynamics.follow_path), prescribe the displacement, or use dynamics"
    return Cause("buckling", what, remedy)


def dead_centre(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """Rows of the joints become dependent although they were not at the start: a locked or singular
    position.
    """
    if (
        found.singular is None
        or found.singular[1] > CLOSE * max(found.singular[0], 1e-300)
        or found.singular[0] < 1e-8
    ):
        return None
    names = owners(stop.system)[stop.system.size :]
    joints = largest(stopped.shares(names, nearest(stop)[1]))
    what = f"the joints are at a dead centre or at the end of their reach: their rows are dependent to {found.singular[1]:.2g} "
    what += f"(start: {found.singular[0]:.2g}), above all {list_names(joints)}"
    remedy = "drive another joint, shorten the driven motion, or let a body bend; through a dead centre start with some speed"
    return Cause("dead centre", what, remedy)


def load_jump(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """A load or drive that jumps in the failed step."""
    listed = stopped.jumps(stop)
    if not listed:
        return None
    what = "; ".join(
        f"{name} jumps from {before:.4g} to {after:.4g}" for name, before, after in listed[:LISTED]
    )
    return Cause(
        "jump",
        f"between t = {stop.good:.6g} and {stop.good + stop.h:.6g} s {what}",
        "let it rise over some ten steps",
    )


def huge_load(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """A load that would move its place far within one step."""
    free = not stop.h and found.lowest is not None and found.lowest[0] <= 1e-9
    if free or stopped.broken_signals(stop):
        return None
    name, way = stopped.push(stop)
    size = stop.system.scale
    if not way > WHOLE * size:
        return None
    what = (
        f"loads on {name} would move it by {way:.3g} m in a step (size of the system: {size:.3g} m)"
    )
    return Cause(
        "huge load",
        what,
        "look at the unit and the history of the load; if it is meant, take shorter steps",
    )


def limp(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """Cables curved in space that are not under tension all along."""
    names = limp_names(stop, found)
    if not names:
        return None
    strains = ", ".join(
        f"{name} {100 * found.strains[name][0]:.3g} to {100 * found.strains[name][1]:.3g} %"
        for name in names
    )
    return Cause("limp", f"{' and '.join(names)} {LIMP} (strains of {strains})", STIFF)


def limp_names(stop: StoppedSolve, found: Diagnosis) -> list[str]:
    return [
        name
        for name in free_motions.limp_bodies(stop.system)
        if found.strains.get(name, (0.0, 0.0))[0] < 0.0
    ]


def stiff_spring(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """A spring whose vibration the step passes over, and which is stiffer than anything else."""
    if not stop.h:
        return None
    name, pace = stopped.stiffest_force(stop)
    if not pace > UNRESOLVED or pace < SHARE * (found.stiffest or 0.0):
        return None
    what = f"a {name} vibrates with h omega = {pace:.3g}, which a step of {stop.h:.3g} s does not resolve"
    remedy = f"try a step of {stop.h * 0.1 / pace:.1g} s, a softer spring, or a joint or a driven angle in its place"
    return Cause("stiff spring", what, remedy)


def large_step(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """A turn in one step that no predictor meets."""
    if not found.turns or not stop.h:
        return None
    name, turn = max(found.turns.items(), key=lambda item: item[1])
    if turn <= WIDE_TURN or name in limp_names(stop, found):
        return None
    what = f"{name} turns by {turn:.3g} rad in a step of {stop.h:.3g} s (stiffest wave: h omega = {found.stiffest:.3g})"
    return Cause(
        "large step", what, f"try a step of {stop.h * 0.1 / turn:.1g} s, a turn of 0.1 rad"
    )


def unstable(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """A motion that gains energy in steps that converge, before one of them fails or not."""
    if found.sound is None:
        return None
    what = f"the energy balance rises from t = {found.sound:.6g} s on, in steps of {stop.h:.3g} s that converge"
    return Cause("unstable", what, "halve the step and compare, or take a smaller rho_inf")


def strains_too_much(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """A reduced model that stretches or compresses where the full one would bend: outside of its
    training.
    """
    if is_sparse(stop.system.lift.matrix) or not found.strains:
        return None
    name, (low, high) = max(found.strains.items(), key=lambda item: max(-item[1][0], item[1][1]))
    if max(-low, high) <= SQUEEZED:
        return None
    what = f"the reduced model strains {name} from {low:.2g} to {high:.2g}: its modes do not hold this motion"
    if found.negative:
        what += f", and {found.negative} eigenvalues of its matrix are negative"
    remedy = "train it on such a motion, keep the initial state in the basis, keep more modes (a smaller eps), or run the full model"
    return Cause("outside training", what, remedy)


def large_strain(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """Strains beyond what the laws mean."""
    bad = {
        name: max(-low, high)
        for name, (low, high) in found.strains.items()
        if not max(-low, high) <= LARGE
    }
    if not bad:
        return None
    listed = ", ".join(
        f"{name} {100 * found.strains[name][0]:.3g} to {100 * found.strains[name][1]:.3g} %"
        for name in bad
    )
    remedy = "check units of load, stiffness and section: thin beams and plates bear a few per cent"
    return Cause("large strain", f"strains above {100 * LARGE:.0f} %: {listed}", remedy)


def indefinite(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """Negative eigenvalues of the iteration matrix: compressed bodies at this step."""
    if not found.negative or not stop.h or not found.strains:
        return None
    low, name = min((low, name) for name, (low, _) in found.strains.items())
    if name in limp_names(stop, found):
        return None
    what = f"the last good state is unstable for a step of {stop.h:.3g} s ({found.negative} negative eigenvalues of its matrix): "
    what += f"{name} is compressed by {100 * max(0.0, -low):.3g} %"
    return Cause(
        "indefinite",
        what,
        "begin without compression (see the initial state), or with a step ten times shorter",
    )


def long_way(stop: StoppedSolve, found: Diagnosis) -> Cause | None:
    """An acceleration that alone moves the mechanism far in one step, from rest too; looked at
    where no other rule holds.
    """
    size = stop.system.scale
    if found.way is None or not found.way > WHOLE * size:
        return None
    what = f"its acceleration moves the mechanism by {found.way:.3g} m in a step of {stop.h:.3g} s (its size: {size:.3g} m)"
    remedy = f"try a step of {stop.h * float(np.sqrt(0.01 * size / found.way)):.1g} s, or look at the units of loads"
    return Cause("large step", what, remedy)


FINITE = (
    "correct its expression there: a division by zero, the root of a negative number, an overflow"
)
UNKNOWN = Cause(
    "unknown",
    "no rule explains it",
    "try a step ten times shorter or more load steps, and look at what happens before",
)
Rule = Callable[[StoppedSolve, Diagnosis], Cause | None]
RULES: tuple[Rule, ...] = (
    broken_signal,
    broken_force,
    free_body,
    buckling,
    dead_centre,
    load_jump,
    huge_load,
    limp,
    stiff_spring,
    large_step,
    strains_too_much,
    large_strain,
    indefinite,
    unstable,
)


def list_names(listed: tuple[tuple[str, float], ...]) -> str:
    """Names with a share above a tenth."""
    return ", ".join(name for name, share in listed if share > 0.1) or "nothing in particular"
