r"""Motions of a single body under what it can meet at its places, to train it alone: no mechanism
is needed.

    run k:   place k (in turn) held, weight m g in a random direction, forces at every other place, moments at all
             F_i(t) = F sin(phi_i(t)) w(t),   phi_i' = 2 pi (f_0 + (f_1 - f_0) t/T),   along every axis i
             v = w x r at the start, w = spin in a random direction

The frequencies f_0 and f_1 [Hz] of every sweep are those of the excitation times a random factor,
and so is its phase; w rises smoothly from 0 to 1 over the first part of a run, so that nothing
jumps, or is 1, for machines whose loads begin as steps. Directions of loads, of weights and of the
motions that follow are all there, and a basis of vectors holds them turned in any way. Moments bend
the ends, as welds and clamps do; points of surfaces take none. Places are pinned; those of beams
with torsion are clamped, and pinned without moments when they are in turn again.

With a `strain` all loads are multiplied by a number s, for which the largest strain of a fibre in
all states is that,

    e(s) = strain (1 +- WITHIN),    F, M, g -> s F, s M, s g,    w -> sqrt(s) w,    times that are not given -> 1/sqrt(s)

so that the rigid motion follows the same paths, and strains grow as s where they are small. It is
found by e(s) of trials, whose steps are COARSE times as long as those that are given, then of the
motions themselves; states beyond the strain are left out, as far as they are the fewer.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Annotated

import numpy as np

from ..bodies.body import Body, extent, reference_at
from ..core.errors import InputError, SolverError, say
from ..core.notices import Notice, Progress
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.values import fields
from ..dynamics.diagnoses.stability import unstable
from ..dynamics.integration import integrate
from ..dynamics.scheme import GeneralizedAlpha, Newton
from ..reduction.spaces.galerkin import snapshots
from ..shapes.surface import Surface
from ..systems import At, Motion, assemble, eliminate
from ..systems.connections import joints
from ..systems.forces import loads
from ..systems.places import directions
from . import bodies as parts

GRAVITY = 9.81  #: where the excitation says none [m/s2]
LONG = 10.0  #: usual duration, in units of sqrt(L/g)
SLOW, FAST = 0.1, 1.6  #: usual frequencies, in units of sqrt(g/L)
BENDING = 0.1  #: usual moment, in units of F L
# shapes are wanted, not paths
STEPS = 1500  #: usual ones, in all
PERIOD = 60.0  #: steps in a period of the last frequency, or in a turn
FINER = 4  #: factor by which they are more where the motion fails with these
WITHIN = 0.1  #: part of a strain that is asked for, by which that of a training may differ
#: strain that is tried for, over the one asked for, and the least part of the states that is inside
AIM, LEAST = (
    1.2,
    0.5,
)
TRIALS = 8
#: motions that are tried, at most; steps that are given are longer by this factor at first
COARSE = 4.0
SMALLEST = 1e-300  #: strain that counts as none
FARTHEST = 30.0  #: factor by which loads change from one trial to the next, at most
RISE = 0.05  #: usual part of a run over which sweeps rise
SHARP = Newton(tolerance=1e-12)
#: of surfaces, which bend in every step: new factors cost as much as twenty corrections with old
#: ones that contract less
THRIFTY = Newton(tolerance=1e-12, slow=0.1)
TRIED = "take smaller forces (--push), another duration or frequencies that its motion can follow, or a smaller step"


@storable
@dataclass(frozen=True)
class Excitation:
    """What a body is moved by; None: forces as large as its weight, times and frequencies of a
    pendulum of its size L in g.

    Usual values for a body of mass m and size L are

        F = m g,    moments F L / 10,    10 sqrt(L/g) long,    sweeps up to 1.6 sqrt(g/L)

    Random numbers follow from `seed` alone.
    """

    # interface functions and modes are in the basis: one, two and four of an arm err alike
    runs: Annotated[int, "number of motions, which begin at the places in turn"] = 2
    force: Annotated[float, fields.quantity("N", ">= 0")] | None = None
    #: at slopes of lines and at frames; None: a tenth of F L
    moment: Annotated[float, fields.quantity("N m", ">= 0")] | None = None
    gravity: Annotated[float, fields.quantity("m/s^2", ">= 0")] = GRAVITY
    duration: Annotated[float, fields.quantity("s", "> 0")] | None = None
    #: first frequency of sweeps
    slowest: Annotated[float, fields.quantity("Hz", ">= 0")] | None = None
    #: last frequency of sweeps
    fastest: Annotated[float, fields.quantity("Hz", ">= 0")] | None = None
    step: Annotated[float, fields.quantity("s", "> 0")] | None = None
    samples: int = 600  #: states kept of every run
    rise: Annotated[
        float, "part of a run over which loads rise; 0: they begin as steps, which send waves"
    ] = RISE
    seed: int = 0
    #: at which it turns about the place that is pinned, at the start
    spin: Annotated[float, fields.quantity("rad/s", ">= 0")] = 0.0
    #: largest one of a fibre in the states, to which all loads are scaled; None: as they are
    strain: Annotated[float, fields.quantity("", "> 0")] | None = None


def settle(excitation: Excitation, part: Body, scale: float = 1.0) -> Excitation:
    """The excitation with what it leaves open, for a body, its loads times `scale`.

        force, moment, gravity ~ s,    spin ~ sqrt(s),    times ~ 1/sqrt(s)

    with s = `scale`; times that are given stay.
    """
    pace = np.sqrt(scale * (excitation.gravity or GRAVITY) / extent(part))
    duration = LONG / pace if excitation.duration is None else excitation.duration
    fastest = FAST * float(pace) if excitation.fastest is None else excitation.fastest
    periods = duration * max(fastest, np.sqrt(scale) * excitation.spin / (2.0 * np.pi))
    step = (
        duration / max(STEPS, np.ceil(PERIOD * periods))
        if excitation.step is None
        else excitation.step
    )
    weight = part.total_mass * (excitation.gravity or GRAVITY)
    force = scale * (weight if excitation.force is None else excitation.force)
    return replace(
        excitation,
        force=force,
        moment=BENDING * force * extent(part)
        if excitation.moment is None
        else scale * excitation.moment,
        gravity=scale * excitation.gravity,
        spin=float(np.sqrt(scale)) * excitation.spin,
        duration=float(step * round(duration / step)),
        slowest=SLOW * float(pace) if excitation.slowest is None else excitation.slowest,
        fastest=fastest,
        step=float(step),
    )


def excite(part: Body, excitation: Excitation, progress: Progress | None = None) -> np.ndarray:
    """States (s, b, c) of all runs of a full body; InputError where it has no named place,
    SolverError where a run fails.

    States of all runs stand behind each other, about `samples` of each; `progress` is told the
    finished part.
    """
    return run(part, excitation, progress)[0]


def run(
    part: Body, excitation: Excitation, progress: Progress | None = None
) -> tuple[np.ndarray, Excitation]:
    """As `excite`, states (s, b, c), with the excitation that made them: its loads scaled, and what
    it leaves open.

    Where a motion fails and no step was given, it is tried once more with steps a quarter as long.
    Errors are those of `excite`, and InputError where no loads reach the strain that is asked for.
    """
    if excitation.strain is not None:
        return reach(part, excitation, progress)
    try:
        return move(part, excitation, progress)
    except SolverError:
        if excitation.step is not None:
            raise
    usual = settle(excitation, part).step
    assert usual is not None
    return move(part, replace(excitation, step=usual / FINER), progress)


def reach(
    part: Body, excitation: Excitation, progress: Progress | None = None
) -> tuple[np.ndarray, Excitation]:
    """States (s, b, c) whose largest strain is the one that is asked for, and the excitation with
    loads that make it.

    InputError where no loads do.
    """
    wanted = excitation.strain
    scale = 1.0
    assert wanted is not None
    if (
        not excitation.gravity
        and not excitation.spin
        and excitation.force == 0.0
        and not excitation.moment
    ):
        raise InputError(
            say(
                f"training of '{part.name}' alone",
                "loads that are scaled to a strain",
                "none",
                "leave one as it is",
            )
        )
    for longer in (1.0,) if excitation.step is None else (COARSE, 1.0):
        tried: list[tuple[float, float]] = []
        for _ in range(TRIALS):
            told = replace(settle(excitation, part, scale), strain=None)
            assert told.step is not None
            try:
                states, _ = move(part, replace(told, step=longer * told.step), progress)
                strains = parts.largest_strains(part, states)
                strains[~np.isfinite(strains)] = np.inf
            except SolverError:
                strains = np.array([np.inf])
            tried.append((scale, float(strains.max())))
            kept = strains <= (1.0 + WITHIN) * wanted
            if kept.mean() >= LEAST and strains[kept].max() >= (1.0 - WITHIN) * wanted:
                break
            scale = next_scale(tried, AIM * wanted)
        else:
            if longer == 1.0:
                raise unreached(part, wanted, tried)
            scale = min(tried, key=lambda one: abs(np.log(max(one[1], SMALLEST) / wanted)))[0]
    return states[kept], replace(told, strain=wanted)


def next_scale(tried: list[tuple[float, float]], wanted: float) -> float:
    """The scale of loads to try next, of pairs of a scale and the strain that it gave, infinite
    where the motion failed.
    """
    scale, strain = tried[-1]
    below = max((one for one in tried if one[1] < wanted), default=None)
    above = min((one for one in tried if one[1] >= wanted), default=None)
    if below is None or above is None:
        factor = (
            wanted / strain
            if 0.0 < strain < np.inf
            else FARTHEST
            if strain == 0.0
            else 1.0 / FARTHEST
        )
        return scale * float(np.clip(factor, 1.0 / FARTHEST, FARTHEST))
    share = 0.5
    if above[1] < np.inf and below[1] > 0.0:
        share = float(np.clip(np.log(wanted / below[1]) / np.log(above[1] / below[1]), 0.1, 0.9))
    return float(below[0] * (above[0] / below[0]) ** share)


def unreached(part: Body, wanted: float, tried: list[tuple[float, float]]) -> InputError:
    """The error of a strain that no loads reach, with what was tried."""
    found = [
        f"{strain:.3g} by loads times {scale:.3g}" for scale, strain in tried if strain < np.inf
    ]
    failed = [scale for scale, strain in tried if strain == np.inf]
    more = f"; the motion fails with loads times {min(failed):.3g}" if failed else ""
    got = f"{', '.join(found[-3:]) or 'none'}{more}"
    remedy = "take a smaller strain, other frequencies or a smaller step"
    return InputError(
        say(f"training of '{part.name}' alone", f"a largest strain of {wanted:g}", got, remedy)
    )


def move(
    part: Body, excitation: Excitation, progress: Progress | None = None
) -> tuple[np.ndarray, Excitation]:
    """States (s, b, c) of all runs with loads as they are, and the excitation with what it leaves
    open.

    InputError for a body without named places; SolverError, with the number of the run, where one
    fails.
    """
    told = settle(excitation, part)
    random = np.random.default_rng(excitation.seed)
    names = [*part.frames, *part.places]
    if not names:
        remedy = "name its ends or holes in the mesh, or as rims: joints and loads of mechanisms need them, too"
        raise InputError(
            say(f"body '{part.name}'", "named places, at which it is excited", "none", remedy)
        )
    assert told.step is not None
    assert told.duration is not None
    scheme = GeneralizedAlpha(told.step)
    newton = THRIFTY if isinstance(part.space, Surface) else SHARP
    found = []
    every = max(1, round(told.duration / told.step / told.samples))
    for run in range(told.runs):
        turn, number = divmod(run, len(names))
        held = names[number]
        hold = holding(part, held, turn)
        begin = {part.name: rotating_motion(part, told, held, run)}
        with warnings.catch_warnings():  # a moment about a line acts as soon as the line has turned
            warnings.filterwarnings("ignore", ".* are about the line itself", Notice)
            system = eliminate(
                assemble([part], [hold], pushes(part, told, hold, random), initial=begin)
            )
        done = None if progress is None else partial(advance, progress, run, told.runs)
        try:
            motion = integrate(system, scheme, told.duration, newton, every, done)
            if broken := unstable(motion, told.step):
                raise broken
        except SolverError as error:
            error.args = (
                f"training of '{part.name}' alone, run {run + 1} of {told.runs}, pinned at '{held}': {error}; {TRIED}",
            )
            raise
        found.append(snapshots(motion).q.reshape(len(motion.times), -1, part.dim))
    return np.concatenate(found), told


def holding(part: Body, held: str, turn: int) -> joints.Joint:
    """The joint at the place that is held, when all places are in turn for the `turn`-th time.

    Beams have little inertia about themselves, which moments would spin: they are clamped, and
    swing without moments every other time.
    """
    return (joints.Pin if part.directors is None or turn % 2 else joints.Clamp)(
        held, At(part.name, held)
    )


def rotating_motion(part: Body, told: Excitation, held: str, run: int) -> Motion:
    """Rotation about the place that is held, in a direction of its own in every run."""
    center = reference_at(part, held)
    axis = np.random.default_rng((told.seed, run)).normal(size=3)
    rate = told.spin * (np.sign(axis[2]) if part.dim == 2 else axis / np.linalg.norm(axis))
    return Motion(
        angular_velocity=float(rate) if part.dim == 2 else tuple(rate), center=tuple(center)
    )


def advance(progress: Progress, run: int, runs: int, done: float) -> None:
    """Report the finished part of all runs."""
    progress((run + done) / runs)


def pushes(
    part: Body, told: Excitation, hold: joints.Joint, random: np.random.Generator
) -> Iterator[loads.Load]:
    """Weight in a random direction, sweeps of forces at all places but the one that is held, of
    moments at all that turn.
    """
    still = part.directors is not None and isinstance(hold, joints.Pin)
    direction = random.normal(size=part.dim)
    yield loads.Gravity(tuple(told.gravity * direction / np.linalg.norm(direction)))
    for name in (*part.frames, *part.places):
        at = At(part.name, name)
        if name != hold.name and told.force:
            for axis, unit in enumerate(np.eye(part.dim)):
                yield loads.PointForce(
                    f"force {name} {axis}", at, tuple(told.force * unit), sweep(told, random)
                )
        if told.moment and turns(part, name) and not still:
            for axis, moment in enumerate(
                told.moment * np.eye(3) if part.dim == 3 else [told.moment]
            ):
                yield loads.Moment(f"moment {name} {axis}", at, moment, sweep(told, random))


def turns(part: Body, place: str) -> bool:
    """Whether a moment can act at a place: at slopes of lines and at frames.

    Not at points of surfaces in space.
    """
    axes = directions(part, place)
    return axes > 0 and not (axes == 2 and part.dim == 3)


def sweep(told: Excitation, random: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """A history over times (s,) [s], with a phase and frequencies of its own.

        sin(phi(t)) w(t)

    with a window w.
    """
    assert told.slowest is not None
    assert told.fastest is not None
    assert told.duration is not None
    low = told.slowest * random.uniform(0.7, 1.3)
    high = told.fastest * random.uniform(0.7, 1.0)
    phase = random.uniform(0, 2 * np.pi)
    end = told.duration

    def history(t: np.ndarray) -> np.ndarray:
        rise = np.clip(t / (told.rise * end), 0.0, 1.0) if told.rise > 0.0 else np.ones_like(t)
        return np.asarray(
            np.sin(2.0 * np.pi * (low * t + 0.5 * (high - low) * t * t / end) + phase)
            * rise**2
            * (3.0 - 2.0 * rise)
        )

    return history
