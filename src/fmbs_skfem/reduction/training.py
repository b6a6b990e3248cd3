r"""Training: from the motion of a full model to a reduced model, as one plan says.

    full motion -> snapshots -> bases, eps (14) -> projection (21) -> hyper-reduction, eta (44)

The snapshots have to be sharper than the modes that are kept: the Newton tolerance of the training run is at most 1e-6 sqrt(eps),
relative to the size of the mechanism. Above that the smallest modes are noise. Reduced models iterate to 2e-5 sqrt(eps): what they
leave adds up over the steps, and has to stay below the error of truncation.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from ..dynamics.scheme import Newton
from ..systems.system import System
from .galerkin import Snapshots, bases, reduce_system
from .hyper_reduction import NONE, HyperReduction, TrainingRun
from .pod import Basis
from .sampling import Selection

Components = Mapping[str, Sequence[str]]
Modes = int | Mapping[str, int] | None

SHARP = 1e-6  #: Newton tolerance of the training run over sqrt(eps)
ENOUGH = 2e-5  #: Newton tolerance of a reduced run over sqrt(eps)
FINEST = 1e-13  #: smallest Newton tolerance asked for


@dataclass(frozen=True)
class Plan:
    """How a reduced model is trained."""

    components: Components
    tolerance: float = 1e-12  #: eps of equation (14)
    modes: Modes = None  #: instead of eps, for all components or by name
    hyper: HyperReduction = NONE  #: how elastic forces are evaluated
    eliminate: bool = False  #: linear constraints between components


@dataclass(frozen=True)
class Trained:
    """A reduced system and what it took to make it."""

    system: System
    components: Components = field(default_factory=dict)
    bases: Mapping[str, Basis] = field(default_factory=dict)
    selections: tuple[Selection, ...] = ()
    training_s: float = 0.0  #: CPU time of bases, projection and hyper-reduction [s]


def newton_for(newton: Newton, tolerance: float) -> Newton:
    """Newton's iteration, sharp enough for snapshots of which modes are kept to eps = `tolerance`."""
    return replace(newton, tolerance=min(newton.tolerance, max(SHARP * math.sqrt(tolerance), FINEST)))


def newton_of_reduced(newton: Newton, tolerance: float) -> Newton:
    """Newton's iteration of a reduced model with modes kept to eps = `tolerance`."""
    return replace(newton, tolerance=max(ENOUGH * math.sqrt(tolerance), FINEST))


def reduced(raw: System, data: Snapshots, plan: Plan) -> Trained:
    """POD and projection of a full system (with all multipliers), without hyper-reduction."""
    start = clock.process_time()
    found: dict[str, Basis] = {}
    for name, members in plan.components.items():
        modes = plan.modes.get(name) if isinstance(plan.modes, Mapping) else plan.modes
        found |= bases(raw, data, {name: members}, plan.tolerance, modes)
    system = reduce_system(raw, plan.components, found, plan.eliminate, data.q)
    return Trained(system, plan.components, found, (), clock.process_time() - start)


def hyper_reduced(model: Trained, raw: System, data: Snapshots, hyper: HyperReduction) -> Trained:
    """Hyper-reduction of a reduced model, trained on the snapshots of its full system."""
    start = clock.process_time()
    rule = hyper.train([TrainingRun(raw, model.system, lambda: data.q)])
    system = rule.apply(model.system)
    spent = clock.process_time() - start
    return replace(model, system=system, selections=rule.selections, training_s=model.training_s + spent)


def train(raw: System, data: Snapshots, plan: Plan) -> Trained:
    """The reduced model of a plan."""
    return hyper_reduced(reduced(raw, data, plan), raw, data, plan.hyper)
