"""Many runs side by side: threads over `integrate`, whose compiled steps hold no interpreter lock.

Every run is that of `integrate` alone, bit by bit: members know nothing of each other. What follows
from parts that systems have in common is found once, see `systems.prepared`.
"""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from threadpoolctl import threadpool_limits

from ..core.errors import InputError, SolverError, say
from ..core.notices import Progress
from ..core.values.arguments import checked
from ..systems.prepared import prepare, share
from ..systems.system import System
from .integration import integrate
from .scheme import GeneralizedAlpha, Newton
from .trajectory import Trajectory

Result: TypeAlias = Trajectory | SolverError


@checked
def integrate_many(
    systems: Sequence[System],
    schemes: GeneralizedAlpha | Sequence[GeneralizedAlpha],
    duration: float,
    newton: Newton | None = None,
    every: int | np.ndarray = 1,
    threads: int = 1,
    progress: Progress | None = None,
) -> list[Result]:
    """Trajectories of all systems from t = 0 over `duration` [s], in their order; the SolverError
    of a system that failed.

    `schemes` is one for all or one for each, `every` as in `integrate`, a number or steps (s,);
    `progress` receives the part of the runs that is done.

        >>> import numpy as np
        >>> from fmbs_skfem import dynamics, systems
        >>> from fmbs_skfem.bodies import point_mass
        >>> pull = systems.loads.PointForce("pull", systems.At("ball"), (1.0, 0.0))
        >>> balls = [point_mass("ball", mass, np.zeros(2)) for mass in (1.0, 2.0)]
        >>> family = [systems.assemble([ball], [], [pull]) for ball in balls]
        >>> found = dynamics.integrate_many(family, dynamics.GeneralizedAlpha(0.01), 1.0)
        >>> [f"{motion.x[-1, 0]:.3f} m" for motion in found]  # F t^2 / (2 m)
        ['0.500 m', '0.250 m']
    """
    chosen = [schemes] * len(systems) if isinstance(schemes, GeneralizedAlpha) else list(schemes)
    if len(chosen) != len(systems):
        raise InputError(
            say("integrate_many: schemes", f"one for all or {len(systems)}", len(chosen))
        )
    if threads < 1:
        raise InputError(say("integrate_many: threads", "at least 1", threads))

    # half of the preparation of a run
    for system in systems[1:]:
        share(prepare(systems[0]), system)

    def run(system: System, scheme: GeneralizedAlpha) -> Result:
        begin = clock.thread_time()
        try:
            found = integrate(system, scheme, duration, newton, every)
        except SolverError as error:
            return error
        return replace(
            found, statistics=replace(found.statistics, cpu_s=clock.thread_time() - begin)
        )

    found: list[Result] = []
    with threadpool_limits(limits=1, user_api="blas"), ThreadPoolExecutor(threads) as pool:
        for one in pool.map(run, systems, chosen):
            found.append(one)
            if progress:
                progress(len(found) / len(systems))
    return found
