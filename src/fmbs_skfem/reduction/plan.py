r"""Plans of training: what is kept of the full model, and how sharply both models iterate.

    full motion -> snapshots -> bases, eps (14) -> projection (21) -> hyper-reduction, eta (44)

The snapshots have to be sharper than the modes that are kept: the Newton tolerance of the training
run is at most 1e-6 sqrt(eps), relative to the size of the mechanism. Above that the smallest modes
are noise. Reduced models iterate to 2e-5 sqrt(eps): what they leave adds up over the steps, and has
to stay below the error of truncation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..dynamics.scheme import Newton
from .hyper.hyper_reduction import NONE, HyperReduction

Components = Mapping[str, Sequence[str]]
ModeCounts = int | Mapping[str, int] | None

# double pendulum of 24 cells, eps 1e-12: at half the full run takes 3007 corrections in place of
# 2947, at twice 2867, and the reduced model errs by 1.4e-5 with each
SHARP = 1e-6  #: Newton tolerance of the training run over sqrt(eps)
# the same: 2700 corrections in 1000 reduced steps, 2900 at half, 2510 at twice, with one error; at
# 2e-3 a reduced crank-slider was 5e-7 late at its end
ENOUGH = 2e-5  #: Newton tolerance of a reduced run over sqrt(eps)
FINEST = 1e-13  #: smallest Newton tolerance asked for
USUAL = 1e-12  #: eps where nothing is said


@dataclass(frozen=True)
@checked
class Plan:
    """How a reduced model is trained.

    `components` names the bodies of each, see `system_level` and `body_level`. The tolerance is

        eps = sum_{i>r} s_i^2 / sum_i s_i^2

    the part of the motion's square that modes leave out: 1e-12 leaves out 1e-6 of its size.
    """

    components: Components
    tolerance: float = USUAL  #: eps of equation (14)
    modes: ModeCounts = None  #: instead of eps, for all components or by name
    hyper: HyperReduction = NONE  #: how elastic forces are evaluated
    eliminate: bool = False  #: linear constraints between components
    invariant: bool = False  #: bases that hold with a state all its rotations, see `invariant`


def modes_of(modes: ModeCounts, component: str) -> int | None:
    """The wanted number of modes of a component; None where eps decides.

    A number for all components, or by name.
    """
    return modes.get(component) if isinstance(modes, Mapping) else modes


def with_components(plan: Plan, components: Components) -> Plan:
    """The plan with other components; numbers of modes by name belong to the components that it
    had.

    A number of modes for all components stays.
    """
    return replace(
        plan, components=components, modes=None if isinstance(plan.modes, Mapping) else plan.modes
    )


def newton_for(newton: Newton, tolerance: float) -> Newton:
    """Newton's iteration, sharp enough for snapshots of which modes are kept to eps = `tolerance`.

        max(1e-6 sqrt(eps), 1e-13)

    is its tolerance, or what it was where that is less.
    """
    return replace(
        newton, tolerance=min(newton.tolerance, max(SHARP * math.sqrt(tolerance), FINEST))
    )


def newton_of_reduced(newton: Newton, tolerance: float) -> Newton:
    """Newton's iteration of a reduced model with modes kept to eps = `tolerance`.

        max(2e-5 sqrt(eps), 1e-13)

    is its tolerance, whatever it was.
    """
    return replace(newton, tolerance=max(ENOUGH * math.sqrt(tolerance), FINEST))
