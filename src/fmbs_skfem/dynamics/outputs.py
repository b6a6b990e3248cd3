r"""Named outputs of a trajectory: positions, velocities, deflections, energies, reactions.

Energy balance of M q'' + f + Phi_q^T lambda = 0 with conservative constant loads in V:

    d(T + V)/dt = lambda . Phi_t + v . Q(t) - v . f_damping
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Sized
from functools import partial
from typing import NamedTuple

import numpy as np

from ..core.algebra.linalg import distinct, is_zero, narrowed, rows_at
from ..core.compiling.structs import Routine
from ..core.errors import InputError, closest, listed, say
from ..core.values.arguments import checked
from ..systems import evaluation, work
from ..systems.compiled import Compiled, compile_system, memories, signal_table
from ..systems.evaluation import Samples
from ..systems.measures.probes import Sensed, kind_of, require_distinct_columns
from ..systems.prepared import remembered
from ..systems.system import LineSamples, System, sizes
from . import recovery, vanishing
from .trajectory import Trajectory

STILL = 1e-12  #: energy, over that of crossing the model once in the run, that is the round-off of a model at rest
UNSURE = 3.0  #: error of the work over its difference from that of every second state
FEW = 9  #: stored states, below which nothing is said of a rise or fall of the energy balance
DELTA = 1e-6  #: relative time difference for Phi_t


@checked
def energies(trajectory: Trajectory) -> np.ndarray:
    """Energies of a motion [J], from those of its start.

        balance = kinetic + strain + potential - work + lost

    the columns kinetic, strain, potential and balance (s, 4); `lost` is what events have taken.

        >>> import numpy as np
        >>> from fmbs_skfem import dynamics, systems
        >>> from fmbs_skfem.bodies import point_mass
        >>> ball = point_mass("ball", 2.0, np.zeros(2))
        >>> falling = systems.assemble([ball], [], [systems.loads.Gravity((0.0, -10.0))])
        >>> motion = dynamics.integrate(falling, dynamics.GeneralizedAlpha(0.01), 1.0)
        >>> kinetic, strain, potential, balance = dynamics.energies(motion)[-1].round(6)
        >>> float(kinetic), float(potential)
        (100.0, -100.0)
    """
    found = balance_of(trajectory)
    return np.column_stack([found.stored, found.balance])


class Balance(NamedTuple):
    """Energies of a motion and what has been done to it, at all of its times [J]."""

    stored: np.ndarray  #: (s, 3) as of `survey_of`
    work: np.ndarray  #: (s,) of all that has no potential
    doubt: np.ndarray  #: (s,) about it
    balance: np.ndarray  #: (s,)
    rest: float  #: round-off of a model at rest


def balance_of(trajectory: Trajectory) -> Balance:
    """The energy balance of a motion."""
    stored, power = survey_of(trajectory)
    done, doubt = work_of(trajectory, power)
    rest = rest_of(trajectory.system, float(np.ptp(trajectory.times)))
    return Balance(stored, done, doubt, stored.sum(axis=1) - done + lost(trajectory), rest)


def rest_of(system: System, span: float) -> float:
    """Energy [J] that is the round-off of a model at rest for a span of time [s]."""
    return STILL * system.weight * (system.scale / span) ** 2 if span > 0.0 else 0.0


def work_of(trajectory: Trajectory, power: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Work of all that has no potential (s,) [J], and the doubt about it: none where the steps of
    the run have summed it.

    Else it is that of its power (s,) [W] at the stored states, in doubt by what every second of
    them gives differently.
    """
    times = trajectory.times
    if is_work_known(trajectory):
        return np.asarray(trajectory.work), np.zeros(len(times))
    found = work_done(times, power)
    every_second = np.abs(found[::2] - work_done(times[::2], power[::2]))
    return found, UNSURE * np.maximum.accumulate(np.repeat(every_second, 2)[: len(times)])


def lost(trajectory: Trajectory) -> np.ndarray:
    """Kinetic energy that events have taken so far, (s,) [J]."""
    found = np.zeros(len(trajectory.times))
    for one in trajectory.events:
        found[trajectory.times >= one.time] += one.loss
    return found


def work_done(times: np.ndarray, power: np.ndarray) -> np.ndarray:
    """Integral of a power (s,) [W] over time, (s,) [J].

        int P dt

    by the trapezoidal rule.
    """
    return np.append(0.0, np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(times)))


def survey_of(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Kinetic energy, that of strains and springs, potential one (s, 3) [J], and the power (s,) [W]
    of the rest.

    That is: of drives and damping, and of loads without a potential; not a number where the work
    is known. Linear springs, which rest in
    the reference x0, have

        1/2 u^T K u + u . (K x0 - c),    u = x - x0

    with the part c of the constant force that a change of coordinates has made theirs.
    """
    if trajectory.trace is not None:
        return trajectory.trace.survey[:, :3], trajectory.trace.survey[:, 3]
    model, powered = compile_system(trajectory.system), not is_work_known(trajectory)
    found = survey(model, trajectory, trajectory.x[0], float(trajectory.times[-1]), powered)
    return found[:, :3], found[:, 3]


def survey(
    model: Compiled, part: Trajectory, start: np.ndarray, end: float, powered: bool = True
) -> np.ndarray:
    """Energies and power (s, 4) as of `survey_of`, of a part of a motion that begins with `start`
    (n,) and lasts up to `end` [s]; the power is not a number unless it is asked for.

    Every row is that of its state alone, to the bit, so that parts of any lengths make the same
    numbers: BLAS sums in an order that depends on their number.
    """
    system = model.system
    times = part.times
    delta = DELTA * max(end, 1e-12)
    span = (np.maximum(times - delta, 0.0), times + delta) if powered else None
    states = part.x, part.v, part.a, part.multipliers
    found = on_samples(work.survey, model, 2 + powered, times, *states, span, part.memory)
    loads = system.loads.constant
    K = system.stiffness
    springs = system.loads.springs if len(system.loads.springs) else np.zeros_like(loads)
    if not is_zero(K) or springs.any():
        u = part.x - system.x0
        forces = 0.5 * np.asarray(K @ u.T).T + (np.asarray(K @ system.x0) - springs)
        found[:, 1] += np.sum(u * forces, axis=1)
    potential = np.einsum("sn,n->s", part.x - start, springs - loads)
    power = found[:, 2] if powered else np.full(len(times), np.nan)
    return np.column_stack([found[:, :2], potential, power])


def is_work_known(part: Trajectory) -> bool:
    """Whether the steps of a run have summed the work of all that has no potential."""
    return part.work is not None and len(part.work) == len(part.times)


def on_samples(
    routine: Routine,
    model: Compiled,
    width: int,
    times: np.ndarray,
    x: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    multipliers: np.ndarray | None = None,
    span: tuple[np.ndarray, np.ndarray] | None = None,
    memory: np.ndarray | None = None,
) -> np.ndarray:
    """What a routine of `evaluation` makes of all states of a motion, (s, width); `span` are
    instants before and after them.

    Without `memory` (s, l), what forces kept of the states follows from them.
    """
    x, v, a = (np.ascontiguousarray(part) for part in (x, v, a))
    held = (
        np.zeros((len(times), model.constraints))
        if multipliers is None
        else np.ascontiguousarray(multipliers)
    )
    before, after = span or (times, times)
    # drives are evaluated in Python: the same instants are asked for once
    signals = signal_table(model.system, times)
    samples = Samples(
        space=model.evaluation[0].space,
        arrays=model.arrays,
        order=model.order,
        x=x,
        v=v,
        a=a,
        multipliers=held,
        signals=signals,
        before=signal_table(model.system, before) if span else signals,
        after=signal_table(model.system, after) if span else signals,
        span=after - before,
        memory=memories(model, times, x, v, a, memory),
        out=np.zeros((len(times), width)),
    )
    routine(samples)
    return samples.out


def sizes_of(trajectory: Trajectory) -> np.ndarray:
    """Largest entry of v, size of its change since the state before over the time [m/s2], and
    displacement [m], (s, 3).

    Those that were read while the motion ran have zeros from where accelerations are clear of
    round-off, see `tracing`.
    """
    if trajectory.trace is not None:
        return trajectory.trace.sizes
    system, v = trajectory.system, trajectory.v
    changes = sizes(system, np.diff(v, axis=0) / np.diff(trajectory.times)[:, None])
    return np.column_stack(
        [fastest(v), np.append(0.0, changes), sizes(system, trajectory.x - trajectory.x[0])]
    )


def fastest(v: np.ndarray) -> np.ndarray:
    """Largest entries (s,) of velocities (s, n), by their size."""
    return np.asarray(np.maximum(v.max(axis=1, initial=0.0), -v.min(axis=1, initial=0.0)))


def size_of(stored: np.ndarray) -> float:
    """The largest kinetic energy, or change of the strain or potential energy [J]: a steady motion
    exchanges none.
    """
    return max(float(stored[:, 0].max()), float(np.ptp(stored[:, 1:], axis=0).max()))


@checked
def energy_drift(trajectory: Trajectory) -> float:
    """Largest change of the energy balance of a motion [J].

        max_t |balance(t) - balance(0)|

    See `energies`.
    """
    return energy_errors(trajectory).drift


class EnergyErrors(NamedTuple):
    """What is off in the energy balance of a motion."""

    drift: float  #: largest change [J]
    rise: float  #: largest rise, over the size of the energies
    fall: float  #: largest fall, over that size


@checked
def energy_errors(trajectory: Trajectory) -> EnergyErrors:
    """Errors of the energy balance: a rise is one of the step, a fall is what the method damps,
    unasked.

        rise = max_t (b(t) - b(0)) / scale,    fall = max_t (b(0) - b(t)) / scale

    of the balance b, over the largest energy or work. A fall is also beside what elastic damping
    takes: where loads put in what damping takes, as in a limit cycle, energies stay while both grow
    with time, and so does what the method damps. Where the work of loads is that of the stored
    states alone, rise and fall are less by three times what every second of them gives differently,
    so that few states feign none.
    """
    found = balance_of(trajectory)
    change = found.balance - found.balance[0]
    doubt = float(found.doubt.max())
    # what damping takes as it comes is stored nowhere
    scale = max(size_of(found.stored), float(np.abs(found.work).max()))
    drift = float(np.abs(change).max())
    if len(change) < FEW or scale <= found.rest:
        return EnergyErrors(drift, 0.0, 0.0)
    rise, fall = (max(float(part.max()) - doubt, 0.0) for part in (change, -change))
    return EnergyErrors(drift, rise / scale, fall / max(scale, trajectory.heat))


def residual_samples(
    model: Compiled,
    times: np.ndarray,
    x: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    multipliers: np.ndarray | None = None,
    memory: np.ndarray | None = None,
) -> np.ndarray:
    """Residual (s, n) of a system on any motion; without multipliers (s, m) the last part is left
    out.

        M q'' + f - Q + Phi_q^T lambda
    """
    found = on_samples(
        evaluation.residuals, model, model.system.size, times, x, v, a, multipliers, memory=memory
    )
    return found[:, np.argsort(model.order)]


@checked
def reactions(trajectory: Trajectory) -> dict[tuple[str, str], np.ndarray]:
    """Force of every constraint row on the system, - lambda (s,), by (joint, coordinate).

    Rows that were eliminated are recovered from the residual of the full system by least squares,
    see `recovery`:

        Phi_q^T lambda = - (M q'' + f - Q)

    Those that follow from others share what they carry. What joints with multipliers leave out as
    redundant carries nothing. Rows that hold in all motions which a reduced model knows are NaN,
    where events release them.
    """
    system = trajectory.system
    if (trace := trajectory.trace) is not None:
        names = (system.full or system).constraints.names
        require_read(names, trace.reactions, "reactions")
        return dict(zip(names, trace.reactions.T, strict=True))
    full = system.full
    if full is None or full is system:
        held = -trajectory.multipliers
        if system.constraints.loose:
            held = np.where(vanishing.unknown(trajectory), np.nan, held)
        return {name: held[:, k] for k, name in enumerate(system.constraints.names)}
    known = {name: -trajectory.multipliers[:, k] for k, name in enumerate(system.constraints.names)}
    if known.keys() >= set(full.constraints.names):
        return {name: known[name] for name in full.constraints.names}
    q, v, a = lifted(trajectory)
    model = compile_system(full)
    held = np.zeros((len(q), len(full.constraints.names)))
    for k, name in enumerate(full.constraints.names):
        held[:, k] = -known.get(name, 0.0)
    if trajectory.system.size != full.size:
        r = residual_samples(model, trajectory.times, q, v, a, held, trajectory.memory)
        rows, C = recovery.of_rows(full, frozenset(known))
        known |= {
            full.constraints.names[row]: values
            for row, values in zip(rows, np.asarray(C.T @ r.T), strict=True)
        }
    none = np.zeros(len(trajectory.times))
    return {name: known.get(name, none) for name in full.constraints.names}


def require_read(expected: Sized, read: np.ndarray, call: str) -> None:
    """InputError where an output asks for what was not read of states that are gone."""
    if read.shape[1] < len(expected):
        raise InputError(
            say(
                f"an output that calls {call}()",
                f"a class with '{call}' in its `calls`",
                "one without",
            )
        )


def pushes(trajectory: Trajectory) -> np.ndarray:
    """Forces F (s, j) on the probe rows y of the system, those of loads alone.

        P = F . y'

    is their power [W].
    """
    if trajectory.trace is not None:
        require_read(trajectory.system.probes.offset, trajectory.trace.pushes, "pushes")
        return trajectory.trace.pushes
    motion = trajectory.times, trajectory.x, trajectory.v, trajectory.a, trajectory.multipliers
    return on_samples(
        evaluation.pushes,
        compile_system(trajectory.system),
        len(trajectory.system.probes.offset),
        *motion,
        memory=trajectory.memory,
    )


def lifted(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Body coordinates, velocities and accelerations of a trajectory, (s, q) each."""
    lift = trajectory.system.lift.matrix
    v, a = (np.asarray(lift @ part.T).T for part in (trajectory.v, trajectory.a))
    return body_coordinates(trajectory), v, a


def body_coordinates(trajectory: Trajectory) -> np.ndarray:
    """Body coordinates of a trajectory, (s, q)."""
    lift = trajectory.system.lift
    return np.asarray(lift.matrix @ trajectory.x.T).T + lift.offset


def rows_read(system: System) -> np.ndarray:
    """Sensor rows (i,) that outputs read, ascending: those of loads that none measures are among
    the others.
    """
    return distinct(
        np.array([row for one in system.outputs.values() for row in one.rows], np.int64)
    )


def read_sensors(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sensor rows that outputs read, of a motion, their rates and accelerations, (s, i) each.

        y = S x + s

    with the rows S (i, n) and s (i,).
    """
    system = trajectory.system
    if (trace := trajectory.trace) is not None:
        return trace.values, trace.rates, trace.accelerations
    rows = rows_read(system)
    matrix, used = remembered(
        system, "sensors", lambda: narrowed(rows_at(system.sensors.matrix, rows))
    )
    y, rate, change = (
        np.asarray(matrix @ part[:, used].T).T
        for part in (trajectory.x, trajectory.v, trajectory.a)
    )
    return y + system.sensors.offset[rows], rate, change


def require_known(where: str, outputs: Iterable[str], names: Iterable[str]) -> None:
    """InputError for a name that is none of the outputs."""
    known = list(outputs)
    for name in names:
        if name not in known:
            expected = f"one of the outputs {listed(known, name, 'of which there are none')}"
            raise InputError(say(where, expected, f"'{name}'") + closest(name, known))


@checked
def outputs(trajectory: Trajectory, names: Sequence[str] | None = None) -> dict[str, np.ndarray]:
    """Named outputs, all by default: column name -> values (s,).

    InputError for a name that is none of the outputs.

        >>> import numpy as np
        >>> from fmbs_skfem import dynamics, systems
        >>> from fmbs_skfem.bodies import point_mass
        >>> place = {"ball": systems.probes.Position(systems.At("ball"))}
        >>> rest = systems.assemble([point_mass("ball", 2.0, np.ones(2))], outputs=place)
        >>> motion = dynamics.integrate(rest, dynamics.GeneralizedAlpha(0.01), 0.02)
        >>> dynamics.outputs(motion)
        {'ball_x': array([1., 1., 1.]), 'ball_y': array([1., 1., 1.])}
    """
    columns = dict[str, np.ndarray]()
    system = trajectory.system
    require_known("outputs", system.outputs, names or ())
    y, rate, change = read_sensors(trajectory)
    read = rows_read(system)
    require_distinct_columns(system.outputs)
    for name, output in system.outputs.items():
        if names is not None and name not in names:
            continue
        rows = list(output.rows)
        at = np.searchsorted(read, output.rows)
        sensed = Sensed(
            name=name,
            dim=system.dim,
            times=trajectory.times,
            values=y[:, at],
            rates=rate[:, at],
            accelerations=change[:, at],
            energies=partial(energies, trajectory),
            reactions=partial(reactions, trajectory),
            pushes=partial(pushes, trajectory),
            forces=system.loads.forces,
            signals=partial(signal_table, system, trajectory.times),
            way=None
            if trajectory.way is None
            else (trajectory.way.values[:, rows], trajectory.way.kept),
        )
        kind = kind_of(output)
        values = [np.asarray(one) for one in kind.evaluate(output, sensed)]
        if len(values) != len(output.columns):
            expected = f"as many values as columns ({', '.join(output.columns)})"
            raise InputError(say(f"output '{name}': evaluate", expected, f"{len(values)} values"))
        for one in values:
            if one.shape != trajectory.times.shape or one.dtype.kind not in "biuf":
                expected = f"{len(trajectory.times)} numbers a column, one an instant"
                got = f"an array {one.shape} of {one.dtype}"
                raise InputError(say(f"output '{name}': evaluate", expected, got))
        columns.update(zip(output.columns, values, strict=True))
    return columns


def centre_lines(system: System, q: np.ndarray) -> dict[str, np.ndarray]:
    """Positions, slopes and curvature vectors along every body for samples q (s, q): (s, 3, x, c)
    by body name.
    """
    found = {}
    for line in system.lines:
        values = np.asarray(line.samples @ q.T).T
        found[line.name] = values.reshape(len(q), 3, -1, system.dim)
    return found


def positions(line: LineSamples, q: np.ndarray, dim: int) -> np.ndarray:
    """Positions along one body for samples q (s, q): (s, x, c)."""
    rows = line.samples.shape[0] // 3
    return np.asarray(line.samples[:rows] @ q.T).T.reshape(len(q), -1, dim)


def skins(system: System, q: np.ndarray) -> dict[str, np.ndarray]:
    """Positions, then the vectors of the law in local coordinates, on every plate and shell for one
    q (q,): (1 + k, x, c) by name.

    The samples of a large body are many: take one instant after the other.
    """
    found = {}
    for skin in system.skins:
        values = np.asarray(skin.samples @ q[skin.columns].reshape(-1, system.dim))
        found[skin.name] = values.reshape(-1, len(skin.thickness), system.dim)
    return found


def distances(one: System, q: np.ndarray, other: System, p: np.ndarray) -> np.ndarray:
    """Largest distance (s,) [m] of corresponding points of two motions q (s, q) and p (s, p):
    centre lines and middle surfaces.

    Surfaces correspond where both have the same cells; NaN where no body of the two corresponds.
    """
    worst = np.full(len(q), np.nan)
    b = {line.name: line for line in other.lines}
    for line in one.lines:
        if line.name in b:
            if line.samples is b[line.name].samples:
                apart = positions(line, q - p, one.dim)
            else:
                apart = positions(line, q, one.dim) - positions(b[line.name], p, other.dim)
            worst = np.fmax(worst, np.linalg.norm(apart, axis=2).max(axis=1))
    for s in range(len(q)):
        first, second = skins(one, q[s]), skins(other, p[s])
        for name in first.keys() & second.keys():
            if first[name].shape == second[name].shape:
                worst[s] = np.fmax(
                    worst[s], np.linalg.norm(first[name][0] - second[name][0], axis=1).max()
                )
    return worst
