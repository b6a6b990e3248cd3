r"""A motion that changes its model between two steps, as from a reduced model of a mechanism to the full one and back.

    q = V x + qbar:    x = argmin |V x + qbar - q|,   Phi(x) = 0,   Phi_x x' + Phi_t = 0,   and the same for q', q'' and a

All models of a mechanism have its body coordinates q in common. A state is handed over with q, q', q'' and the algorithmic
acceleration a of the method, which makes the steps behind a change of second order: what the other model cannot represent is lost,
and what its joints ask for is closed. Factors, and the history of the predictor, begin anew.

Shift of the algorithmic acceleration: Arnold, Hante, J. Comput. Nonlinear Dynam. 12 (2017) 021002, doi 10.1115/1.4033441.
"""

from __future__ import annotations

import time as clock
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..core.errors import InputError, say
from ..systems import compiled as compilation
from ..systems.system import System, project
from .dividing import put, restart
from .initial import Instant, Start, change_of, consistent_start, first_state, held, kkt_solver
from .integration import begun, march
from .observers import Observer, Setting
from .run import block, cost_of
from .scheme import GeneralizedAlpha, Newton
from .trajectory import Statistics, Trajectory

CLOSINGS = 2  #: Newton steps onto the joints: gaps of 1e-4 of the size, more than a basis leaves, fall to 1e-16


class Handed(NamedTuple):
    """A state between two steps, in the coordinates that all models of a mechanism have."""

    done: int  #: steps
    q: np.ndarray  #: (q,) body coordinates
    rate: np.ndarray  #: (q,) q'
    acceleration: np.ndarray  #: (q,) q''
    algorithmic: np.ndarray  #: (q,) a of generalized-alpha
    multipliers: dict[tuple[str, str], float]  #: by constraint row
    memory: np.ndarray  #: (l,) what forces keep
    work: float  #: done so far by all that has no potential [J]


class Leg:
    """One model of a mechanism, which takes some of the steps of a motion, block by block of at most `length` steps.

    `steps` are those of the whole motion. InputError where something has to look at every step, as events and controllers.
    """

    def __init__(self, system: System, scheme: GeneralizedAlpha, newton: Newton, steps: int, length: int) -> None:
        setting = Setting(system, scheme, newton, steps, system)
        rows = np.arange(min(length, steps) + 1)
        self.run = begun(setting, rows)
        if self.run.close:
            names = ", ".join(sorted({type(one).__name__ for one in self.run.close}))
            remedy = "run it with fmbs run, or leave these out"
            raise InputError(say("a run that changes its model", "a scene without events and controllers", names, remedy))
        self.run.observers = list[Observer]()
        self.cpu_s = self.wall_s = 0.0  #: of its steps
        every = np.arange(steps + 1)
        self.run.kept, self.run.times, self.run.rows = every, scheme.step * every, every

    @property
    def system(self) -> System:
        """The system that is run."""
        return self.run.model.system

    @property
    def cost(self) -> Statistics:
        """What its steps cost so far."""
        return replace(cost_of(self.run), cpu_s=self.cpu_s, wall_s=self.wall_s)

    @property
    def now(self) -> Handed:
        """The present state."""
        run, state, lift = self.run, self.run.step.state, self.system.lift
        back = np.argsort(run.model.order)
        columns = np.stack([state.x[back], state.v[back], state.acceleration[back], state.a[back]], axis=1)
        q, rate, acceleration, algorithmic = np.asarray(lift.matrix @ columns).T
        forces = dict(zip(self.system.constraints.names, state.multipliers / run.step.method.c, strict=True))
        own = state.memory.copy(), float(state.work[0])
        return Handed(run.done, q + lift.offset, rate, acceleration, algorithmic, forces, *own)

    def put(self, handed: Handed, consistent: bool = False) -> None:
        """Go on from a state; where it is to be `consistent`, q'' and a are those of the equations of this model there."""
        run, model, lift = self.run, self.run.model, self.system.lift
        columns = np.stack([handed.q - lift.offset, handed.rate, handed.acceleration, handed.algorithmic], axis=1)
        x, v, a, algorithmic = project(lift.matrix, columns).T
        time, off = run.scheme.step * handed.done, run.step.space.off > 0.0
        memory = handed.memory if handed.memory.shape == run.step.state.memory.shape else None
        x = self.closed(x, ~off, time)
        forces = np.array([handed.multipliers.get(name, 0.0) for name in self.system.constraints.names])
        start = Start(x, v, a, forces, np.stack([np.zeros_like(v), algorithmic - a]))
        if consistent:
            start = consistent_start(model, run.scheme, Instant(time, x, v, off, memory))
        put(run.step.state, first_state(model, start, run.step.method.c, memory, time))
        run.step.state.work[0] = handed.work
        restart(run.step.state, run.step.work)
        run.done = run.base = handed.done
        run.store()

    def closed(self, x: np.ndarray, on: np.ndarray, time: float) -> np.ndarray:
        """The state nearest to x (n,) in the mass, in which the joints that are `on` (m,) hold at a time [s]."""
        model, system = self.run.model, self.system
        for _ in range(CLOSINGS if on.any() else 0):
            gap, J = (part[on] for part in compilation.gap(model, x, time))
            if np.abs(gap).max() <= self.run.step.method.tolerance:
                break
            x = x + change_of(kkt_solver(held(system, on), system.mass, J, first=False), np.zeros(len(x)), gap)
        return x

    def take(self, many: int) -> Trajectory:
        """Take some steps: the motion from the present state on, at every step; SolverError where one cannot be taken."""
        run, cpu, wall = self.run, clock.process_time(), clock.perf_counter()
        run.base = run.done
        run.store()
        try:
            march(run, min(many, run.steps - run.done))
        finally:
            self.cpu_s, self.wall_s = self.cpu_s + clock.process_time() - cpu, self.wall_s + clock.perf_counter() - wall
        return block(run, run.done + 1)
