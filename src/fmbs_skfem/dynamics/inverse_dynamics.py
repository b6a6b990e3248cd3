r"""Inverse dynamics: forces and torques of drives for the motion that they prescribe, of mechanisms
without a motion of their own.

    Phi(q, t) = 0,    Phi_q q' = -Phi_t,    Phi_q q'' = -D2,    Phi_q^T lambda = -(M q'' + f(q, q', t))

at every instant by itself, D2 = d2Phi/dt2 - Phi_q q'': there is no step, and no error of one.
Derivatives of texts, tables and profiles are exact (`core.values.jets`).

Source: E. J. Haug, Computer aided kinematics and dynamics of mechanical systems, Allyn and Bacon
1989, sections 3.6 and 11.2.
"""

from __future__ import annotations

import numpy as np

from ..core.algebra import ranks
from ..core.errors import InputError, Reason, SolverError, listed, say
from ..core.notices import Progress
from ..core.values.arguments import checked
from ..systems import compiled, free_motions
from ..systems.compiled import compile_system
from ..systems.connections import mechanism
from ..systems.connections.redundancy import scale_of, without_redundant
from ..systems.signals import jet
from ..systems.system import System
from .compiled_step import starting
from .compiled_step.packing import UNSTORED, PackedStep
from .equilibria import loading
from .histories import SIDE, finite_signals
from .initial import first_step, flags_of, jacobian_at_start, large_of, weightless
from .scheme import GeneralizedAlpha, Newton, method_of, round_off
from .trajectory import Statistics, Trajectory

ITERATIONS = 25  #: of a position; from one instant to the next three are usual
NO_MORE = 10.0  #: round-offs of a position, up to which a correction is the last one
DYNAMIC = "a motion that is not all given is found by `type: dynamic`, where the output `reaction` of a drive gives its torque as well"


@checked
def solve_inverse_dynamics(
    system: System, times: np.ndarray, progress: Progress | None = None
) -> Trajectory:
    """Positions, velocities, accelerations and multipliers at increasing times (s,) [s], from joints
    and drives alone.

    InputError where a motion is left that no joint and no drive determines; SolverError, with what
    was found before, where the mechanism cannot follow its drives, or in a singular position.

        >>> import numpy as np
        >>> from fmbs_skfem import dynamics, systems
        >>> from fmbs_skfem.bodies.rigid import rigid
        >>> from fmbs_skfem.core.values.expressions import of_time
        >>> from fmbs_skfem.systems import At, joints, probes
        >>> wheel = rigid("wheel", 1.0, 0.5, (0.0, 0.0), dim=2)
        >>> hub = joints.Pin("hub", At("wheel", "frame"))
        >>> motor = joints.DrivenAngle("motor", At("wheel", "frame"), of_time("3 * t**2"))
        >>> torque = {"motor": probes.Reaction("motor")}
        >>> turned = systems.assemble([wheel], [hub, motor], outputs=torque)
        >>> found = dynamics.solve_inverse_dynamics(turned, np.linspace(0.0, 1.0, 3))
        >>> dynamics.outputs(found)["motor_torque"].round(9).tolist()  # 0.5 kg m2 times 6 rad/s2
        [3.0, 3.0, 3.0]
    """
    if times.ndim != 1 or not len(times) or not (np.diff(times) > 0.0).all():
        raise InputError(say("times", "increasing times [s]", times))
    refuse_free(system.full or system)
    system = without_redundant(system)
    jacobian_at_start(system)
    signals = signals_at(system, times)
    model = compile_system(system)
    h = float(np.ptp(times)) / max(len(times) - 1, 1) or 1.0
    method = method_of(GeneralizedAlpha(step=h), Newton(), h, model)
    step = first_step(model, system.x0, system.v0, method)
    packed = PackedStep(model, step, large_of(model))
    step.state.memory[:] = model.memory
    count = len(times)
    x, v, a = np.zeros((3, count, system.size))
    multipliers = np.zeros((count, model.constraints))
    memory = np.zeros((count, len(model.memory)))
    iterations = 0

    def motion(end: int) -> Trajectory:
        cost = Statistics(steps=max(end - 1, 0), iterations=iterations)
        own = times[:end], x[:end], v[:end], a[:end], multipliers[:end]
        return Trajectory(system, *own, statistics=cost, memory=memory[:end])

    try:
        for k, time in enumerate(times.tolist()):
            begin = float(times[max(k - 1, 0)])
            x[k] = x[k - 1] if k else system.x0
            # angles are known but for half turns
            ways = loading.parts(system, begin, time)
            if k and ways == 1:
                x[k] += (time - begin) * (v[k - 1] + 0.5 * (time - begin) * a[k - 1])
            for part in np.linspace(begin, time, ways + 1)[1:]:
                x[k], J, tries = close(model, x[k], float(part))
                iterations += tries
            v[k], a[k], multipliers[k] = balance(packed, x[k], J, signals[k : k + 1], time)
            memory[k] = step.state.memory
            if progress:
                progress((k + 1) / count)
    except SolverError as error:
        error.partial = motion(k) if k else None
        raise
    return motion(count)


def balance(
    packed: PackedStep, x: np.ndarray, J: np.ndarray, signals: np.ndarray, time: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Velocities and accelerations (n,) in a position x (n,) on joints and drives, by Phi_x (m, n)
    and signals (1, 4 k), and multipliers (m,); SolverError in a singular position.
    """
    model, state, space = packed.model, packed.step.state, packed.step.space
    system, order = model.system, model.order
    rows = ranks.independent_rows(J, units=scale_of(system))
    if len(rows) < system.size:
        expected = "a position in which they determine all motions"
        raise failure(time, expected, "a singular one, as a dead centre")
    state.x[:], state.v[:], state.a[:] = x[order], 0.0, 0.0
    packed.give(signals, UNSTORED)
    packed.call(starting.find_rates)
    v = np.linalg.solve(J[rows], -space.rhs[0, system.size :][rows])
    state.v[:] = v[order]
    # without rows that follow from others in this position alone
    space.off[:] = 1.0
    space.off[rows] = 0.0
    failed = packed.call(starting.start, flags_of(model))
    space.off[:] = 0.0
    packed.check()
    if failed != 0:
        raise weightless(system, system.mass)
    held = state.multipliers / packed.step.method.c
    if len(rows) < len(J):
        held = ranks.least(J.T, J[rows].T @ held[rows], len(rows))
    return v, state.acceleration[np.argsort(order)], held


def refuse_free(system: System) -> None:
    """InputError where bodies bend, or motions are left that joints and drives do not determine; of
    a system with all multipliers.
    """
    if system.elastic:
        got = f"bodies that bend ({listed(sorted({part.name for part in system.elastic}))})"
        raise InputError(say("inverse dynamics", "rigid bodies", got, DYNAMIC))
    if left := free_motions.left_by_drives(system):
        got = f"{len(left)} left free: {'; '.join(map(str, left))}"
        expected, remedy = "drives that determine every motion", f"add drives; {DYNAMIC}"
        if not mechanism.analyse(system).free:
            expected, got = (
                "a start in which drives determine every motion",
                f"a dead centre with {got}",
            )
            remedy = "begin beside it, or drive another joint"
        raise InputError(say("inverse dynamics", expected, got, remedy))


def signals_at(system: System, times: np.ndarray) -> np.ndarray:
    """Histories of all signals with their first three derivatives (s, 4 k), zero for the third,
    which no force reads; SolverError where a value is no number.
    """
    finite_signals(system, times)
    if not system.signals:
        return np.zeros((len(times), 0))
    near = SIDE * float(np.ptp(times)) / max(len(times) - 1, 1) or SIDE
    # at a corner what comes, as motions have it, but at the end, where a table may end
    sides = (times[:-1], near), (times[-1:], -near)
    parts = [np.stack([jet(one, *side) for one in system.signals], axis=2) for side in sides]
    found = np.concatenate(parts, axis=1)
    if not np.isfinite(found).all():
        at = float(times[np.argwhere(~np.isfinite(found))[0, 1]])
        text = say(
            f"drives at t = {at:.6g} s", "finite rates and accelerations", "one that is none"
        )
        raise SolverError(text, Reason.NOT_FINITE, at)
    return np.concatenate([*found, np.zeros(found.shape[1:])], axis=1)


def close(
    model: compiled.Compiled, x: np.ndarray, time: float
) -> tuple[np.ndarray, np.ndarray, int]:
    """The position x (n,) on all joints and drives at a time [s] that is nearest to a guess, Phi_x
    (m, n) there, and the iterations.
    """
    # what is left behind a correction of this size is its square
    least = NO_MORE * round_off(model.system)
    for k in range(ITERATIONS):
        phi, J = compiled.gap(model, x, time)
        change = np.linalg.lstsq(J, -phi, rcond=None)[0]
        moved = compiled.size(model, change)
        x = x + change * min(1.0, model.system.scale / max(moved, least))
        if moved <= least:
            return x, compiled.gap(model, x, time)[1], k + 1
    raise failure(
        time, "a position that the mechanism can take", f"none in {ITERATIONS} iterations"
    )


def failure(time: float, expected: str, got: str) -> SolverError:
    """The error of drives that the mechanism does not follow at a time [s]."""
    remedy = "let the drives stay within its reach, or drive another joint"
    where = f"drives at t = {time:.6g} s"
    return SolverError(say(where, expected, got, remedy), Reason.NOT_CONVERGED, float(time))
