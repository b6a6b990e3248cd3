r"""The reduced model of a family: one basis a component for all parameters, trained on several full runs.

    U^b = left singular vectors of [U_1 S_1, U_2 S_2, ...],   truncated to eps                                            (50), (14)
    G = [G_1 / |b_1|; G_2 / |b_2|; ...],   G_k: forces of the system at mu_k on the states of run k                           (45)

Which constraint rows are dropped is decided once for all parameters. The reduced systems of all parameters are polynomials of them
(`affine`), so that a new value neither assembles nor projects anything; where they are none, as where a length turns the modes, the
full system of every value is assembled and projected.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, section 4, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..core.errors import InputError, say
from ..core.notices import notify
from ..dynamics.integration import integrate
from ..dynamics.trajectory import Trajectory
from ..systems.system import System, keep_constraints
from . import affine, errors, pod
from .affine import ParametricCase
from .cases import Case, Family
from .full_runs import FullRun, Setting, states, steps
from .galerkin import (
    FEW,
    RowSamples,
    all_directions,
    inner_constraints,
    is_rigid,
    metric_of,
    reduce_system,
    row_samples,
    rows_of,
    rows_to_keep,
    satisfying,
)
from .hyper_reduction import NONE, Rule, TrainingRun
from .parameters import Parameter
from .pod import Basis
from .sampling import Selection
from .training import newton_of_reduced

Modes = Mapping[str, Basis]
Names = frozenset[tuple[str, str]]

PLAIN = NONE.train([])
KEEPS = 1e-10  #: modes that violate a linear constraint by less keep it to round-off


@dataclass(frozen=True)
class FamilyModel:
    """A reduced model for all parameters, and what it took to make it."""

    cases: ParametricCase | Family  #: reduced cases: polynomials of the parameters, or made from the full ones
    modes: Mapping[str, int]  #: by component
    selections: tuple[Selection, ...] = ()
    training_s: float = 0.0  #: CPU time of bases, projection, hyper-reduction and polynomials [s]
    bases: Modes = field(default_factory=dict)  #: about the initial state; empty where the model was read from a file
    obstacle: str = ""  #: why the cases are no polynomials of the parameters

    @property
    def parametric(self) -> ParametricCase:
        """The polynomials, of which a file can be made; refused where there are none."""
        if isinstance(self.cases, ParametricCase):
            return self.cases
        remedy = "run its members in this process"
        raise InputError(say("reduced model", "numbers that are polynomials of the parameters", "others", remedy))

    @property
    def problems(self) -> int:
        """Sparse least-squares problems that were solved, one a component."""
        return len(self.selections)


def quick(setting: Setting) -> Setting:
    """The setting with a family that assembles nothing, where its full systems are polynomials of the parameters."""
    try:
        fitted = affine.fit(setting.family, setting.parameters)
    except InputError:
        return setting
    return replace(setting, family=partial(affine.at, fitted))


def model_of(setting: Setting, runs: Sequence[FullRun]) -> FamilyModel:
    """The reduced model of all runs, as the setting's plan says."""
    begun = clock.process_time()
    members = trained(setting, runs)
    sizes = {name: basis.modes.shape[1] for name, basis in members.bases.items()}
    cases, obstacle = polynomials_of(partial(member, setting, members), setting.parameters)
    return FamilyModel(cases, sizes, members.hyper.selections, clock.process_time() - begun, members.bases, obstacle)


def polynomials_of(family: Family, parameters: Sequence[Parameter]) -> tuple[ParametricCase | Family, str]:
    """The polynomials of a family; or the family where it has none, with a notice, and the reason."""
    try:
        return affine.fit(family, parameters), ""
    except InputError as problem:
        notify(f"the reduced model is no polynomial of its parameters, every value assembles the full system: {problem}")
        return family, str(problem)


@dataclass(frozen=True)
class Members:
    """What makes a reduced system of the full system at any parameters."""

    bases: Modes
    rows: Names  #: constraint rows that are kept
    hyper: Rule = PLAIN


def trained(setting: Setting, runs: Sequence[FullRun]) -> Members:
    """Bases, constraint rows and hyper-reduction of all runs."""
    systems = [setting.family(run.values).system for run in runs]
    found = bases(setting, systems[0], runs)
    members = Members(found, kept_rows(setting, systems, runs, found))
    return replace(members, hyper=setting.plan.hyper.train(training_runs(setting, systems, runs, members)))


def bases(setting: Setting, raw: System, runs: Sequence[FullRun]) -> dict[str, Basis]:
    """Modes of every component from the factors of all runs, about the initial state."""
    plan, found = setting.plan, {}
    for name, members in plan.components.items():
        rows = rows_of(raw, members)
        W, (A, a) = metric_of(raw, rows), inner_constraints(raw, rows)
        if is_rigid(raw, members):
            values = np.concatenate([run.factors[name].values for run in runs])
            found[name] = Basis(all_directions(W, A), np.zeros(len(rows)), np.sort(values)[::-1])
            continue
        wanted = plan.modes.get(name) if isinstance(plan.modes, Mapping) else plan.modes
        known = [(run.factors[name].modes, run.factors[name].values) for run in runs]
        basis = pod.update(known, np.zeros(len(rows)), plan.tolerance if wanted is None else None, wanted, metric=W)
        found[name] = replace(basis, modes=pod.orthonormal(W, satisfying(basis.modes.T, A, 0 * a).T))
    return found


def about_start(setting: Setting, raw: System, found: Modes) -> dict[str, Basis]:
    """The bases of one member: its own initial state, and modes that keep its linear constraints inside components."""
    mine, start = {}, raw.lift(raw.x0)
    for name, members in setting.plan.components.items():
        rows, modes = rows_of(raw, members), found[name].modes
        A, a = inner_constraints(raw, rows)
        if len(a) and np.abs(A @ modes).max() > KEEPS * np.abs(A).max():
            modes = np.ascontiguousarray(satisfying(modes.T, A, 0 * a).T)
        mine[name] = replace(found[name], modes=modes, mean=start[rows])
    return mine


def projection(setting: Setting, found: Modes, rows: Names | None, raw: System) -> System:
    """The reduced system of a full one, with the constraint rows of these names where they are given."""
    plan = setting.plan
    system = reduce_system(raw, plan.components, about_start(setting, raw, found), plan.eliminate)
    if rows is None:
        return system
    kept = [k for k, name in enumerate(system.constraints.names) if name in rows]
    return keep_constraints(system, np.array(kept, dtype=np.int64))


def kept_rows(setting: Setting, systems: Sequence[System], runs: Sequence[FullRun], found: Modes) -> Names:
    """Names of the constraint rows that are independent in the reduced space, at states of all runs."""
    samples: list[RowSamples] = []
    names: tuple[tuple[str, str], ...] = ()
    for raw, run in zip(systems, runs, strict=True):
        reduced = projection(setting, found, None, raw)
        names = reduced.constraints.names
        few = np.unique(np.linspace(0, len(run.times) - 1, FEW).round().astype(np.int64))
        samples.append(row_samples(raw, reduced, states(setting, raw, run, few), run.times[few]))
    return frozenset(names[k] for k in rows_to_keep(samples)) if names else frozenset()


def training_runs(setting: Setting, systems: Sequence[System], runs: Sequence[FullRun], members: Members) -> list[TrainingRun]:
    """What a hyper-reduction is trained on: every run with its full and its reduced system."""
    return [
        TrainingRun(raw, projection(setting, members.bases, members.rows, raw), partial(states, setting, raw, run))
        for raw, run in zip(systems, runs, strict=True)
    ]


def member(setting: Setting, members: Members, values: Mapping[str, float]) -> Case:
    """The reduced case at some parameters, made from the full one."""
    case = setting.family(values)
    system = members.hyper.apply(projection(setting, members.bases, members.rows, case.system))
    return replace(case, system=system, newton=newton_of_reduced(case.newton, setting.plan.tolerance))


def reduced_case(model: FamilyModel, values: Mapping[str, float]) -> Case:
    """The reduced case at some parameters, in milliseconds where it is a polynomial of them."""
    return affine.at(model.cases, values) if isinstance(model.cases, ParametricCase) else model.cases(values)


def reduced_run(setting: Setting, case: Case) -> Trajectory:
    """The motion of a reduced case, stored at the snapshots."""
    return integrate(case.system, case.scheme, case.duration, case.newton, steps(case, setting.interval))


def indicator(setting: Setting, motion: Trajectory, values: Mapping[str, float]) -> float:
    """I of equation (49) of a reduced motion; `setting.family` gives the full system whose residual is taken."""
    case = setting.family(values)
    return errors.indicator(case.system, motion, case.scheme)
