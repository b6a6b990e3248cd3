r"""What gears pass on, where their wheels turn far in a step.

    axes e of a wheel:   e'' = -w^2 e + w' n,   of which a step gives the first part turned by LAG theta^3,   theta = w h
    that turn accelerates the wheel by  r = LAG theta^3 w^2,   and the gear holds it back:   M x'' + J^T l = 0,   J x'' = r

The motion keeps its second order, as all wheels are held back by as much, but the moment l errs
whatever the gear passes on.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import csr_array

from ...core.algebra import saddle
from ...systems import compiled
from ...systems.compiled import Compiled
from ..observers import Judge, RunSetting, offered
from ..trajectory import Trajectory

GEAR = "gear_"  #: how the laws of gears begin
LAG = 0.05  #: as measured with rho_inf of 0.5 to 1, a fifth of what it is after a start; nearer to 1 where rho_inf is 0
SMALL_TURN = 0.02  #: in a step, up to which a wheel is not looked at [rad]
# at 0.2 rad a step a moment of 0.25 N m comes out as 0.34 N m at 200 rad/s
#: error of a moment, of the root mean square of the gear's, from which a warning is shown
SHARE = 0.05


@offered
def _(setting: RunSetting) -> Iterator[Judge]:
    if any(laws.law.name.startswith(GEAR) for laws in setting.system.constraints.laws):
        yield Judge(lambda run, motion: find_fast_wheels(run.model, motion, run.scheme.step))


def find_fast_wheels(model: Compiled, motion: Trajectory, step: float) -> Iterator[str]:
    """Gears whose moment errs by SHARE of its usual size or more, as a wheel turns far in a step [s]."""
    system = motion.system
    for laws in system.constraints.laws:
        if not laws.law.name.startswith(GEAR):
            continue
        for row, rows, numbers in zip(laws.row, laws.rows, laws.numbers, strict=True):
            P = csr_array(system.probes.matrix)[rows]
            arms = (P @ motion.x.T).T + system.probes.offset[rows]
            rates = (P @ motion.v.T).T
            w = np.imag((rates[:, ::2] + 1j * rates[:, 1::2]) / (arms[:, ::2] + 1j * arms[:, 1::2]))
            turns = np.abs(w * step)
            pushes = LAG * (turns**3 * np.abs(w) * w) @ numbers[: w.shape[1]]
            if turns.max() > SMALL_TURN:
                at = int(np.abs(pushes).argmax())
                error = moment_of(model, motion, row, pushes[at], at)
                if error > SHARE * (usual := np.sqrt(np.mean(motion.multipliers[:, row] ** 2))):
                    wrong = f"its moment is wrong by about {error:.2g} N m (root mean square {usual:.2g} N m)"
                    why = f"a wheel turns by up to {turns.max():.2g} rad a step"
                    gear = f"the step is too large for gear '{system.constraints.names[row][0]}'"
                    yield f"{gear}: {wrong}, since {why}; half the step makes an eighth of the error"


def moment_of(model: Compiled, motion: Trajectory, row: int, push: float, at: int) -> float:
    """The moment of a gear that holds back an acceleration `push` of its row; 0 where the joints
    determine no moments.
    """
    system = motion.system
    J = compiled.gap(model, motion.x[at], float(motion.times[at]))[1]
    wanted = np.zeros(system.size + len(J))
    wanted[system.size + row] = push
    found = saddle.regular_solution(saddle.matrix(system.mass, J), wanted)
    return 0.0 if found is None else float(abs(found[system.size + row]))
