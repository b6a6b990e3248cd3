r"""The known ways to a reduced model of a whole family, each a comparator: full runs, modes, cost
and errors.

    q(t; mu) = q0(mu) + V(mu) xi(t)                q0: initial state of the sample,   X_j = q(t_s; mu_j) - q0(mu_j)
    fast to slow     V = POD of X at the fastest parameter
    uniform grid     V = POD of [X_1, X_2, ...]
    greedy           the same, mu_j where the indicator (49) is largest                                   (`families.training`)
    nearest basis    V = POD of X_j,   j = argmin |mu - mu_j| in the unit box
    Grassmann        span V(mu) = exp_V0( sum_j l_j(mu) log_V0 span V_j )                                 (`grassmann`)

A comparator is a family of reduced cases. The initial state is the origin of every basis and all
modes keep the linear constraints inside their component at every parameter, so that neither is
interpolated. Sampled weights belong to one basis: a basis that is interpolated runs with all cells,
or with the exact polynomial where the plan asks for it, and is projected anew for every parameter.
The others are polynomials of the parameters (`affine`) where the members are.

Sources: K. Luo, H. Hu, C. Liu, Q. Tian, CMAME 324 (2017) 573-594, doi 10.1016/j.cma.2017.06.029
(fast to slow); D. Amsallem, C. Farhat, AIAA J. 46 (2008) 1803-1813, doi 10.2514/1.35374; Y. Hou, C.
Liu, H. Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690, Figs. 13 and 14.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import replace

import grassmann
import numpy as np

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics.outputs import lifted
from fmbs_skfem.families import training
from fmbs_skfem.families.greedy import Options
from fmbs_skfem.families.training import FinishedTraining
from fmbs_skfem.families.trials import Comparator
from fmbs_skfem.reduction import affine, full_runs, parameters, reduced_models
from fmbs_skfem.reduction.cases import Case, Family
from fmbs_skfem.reduction.full_runs import Full, FullRun, TrainingTask
from fmbs_skfem.reduction.hyper import hyper_reduction
from fmbs_skfem.reduction.hyper.hyper_reduction import NONE
from fmbs_skfem.reduction.parameters import Search
from fmbs_skfem.reduction.plan import with_components
from fmbs_skfem.reduction.reduced_models import TrainedReduction
from fmbs_skfem.reduction.spaces import component
from fmbs_skfem.reduction.spaces.pod import Basis
from fmbs_skfem.systems.system import System


def fast_to_slow(task: TrainingTask, full: Full, fastest: Mapping[str, float]) -> Comparator:
    """The basis of one full run at the parameters of the fastest motion, for all others.

    Source: Luo, Hu, Liu, Tian 2017, doi 10.1016/j.cma.2017.06.029.
    """
    return fixed(task, "fast to slow", [full(fastest)])


def uniform(task: TrainingTask, full: Full, counts: Sequence[int]) -> Comparator:
    """One basis from all runs of a uniform grid of the box, both ends included.

    `counts` (d,) are the numbers of values a parameter; one value is the middle of its range.
    """
    return fixed(task, f"uniform grid {shape(counts)}", run_at_nodes(task, full, counts)[1])


def fixed(task: TrainingTask, name: str, given: Sequence[FullRun]) -> Comparator:
    """One basis from several full runs."""
    begun = clock.process_time()
    family: Family = functools.partial(
        reduced_models.reduced_case, task, reduced_models.train_reduction(task, given)
    )
    with contextlib.suppress(
        InputError
    ):  # what is no polynomial of the parameters is projected anew for each of them
        family = affine.fit(family, task.parameters)
    return Comparator(
        name, family, len(given), clock.process_time() - begun + sum(run.cpu_s for run in given)
    )


def nearest(task: TrainingTask, full: Full, counts: Sequence[int]) -> Comparator:
    """Of the bases of single runs on a uniform grid the one nearest to the parameters.

    V = POD of X_j with j = argmin |mu - mu_j| in the unit box; `counts` (d,) as of `uniform`.
    """
    places, given = run_at_nodes(task, full, counts)
    local = [fixed(task, "", [run]) for run in given]

    def family(values: Mapping[str, float]) -> Case:
        return local[find_closest(places, in_box(task, values))].family(values)

    return Comparator(
        f"nearest basis {shape(counts)}", family, len(given), sum(part.offline_s for part in local)
    )


def interpolated(task: TrainingTask, full: Full, counts: Sequence[int]) -> Comparator:
    """Local bases of a uniform grid interpolated on the Grassmann manifold, all with as many modes
    as the largest needs.

    span V(mu) = exp_V0(sum_j l_j(mu) log_V0 span V_j), see `grassmann`. InputError where bases are
    a right angle apart.

    Source: Amsallem and Farhat 2008, doi 10.2514/1.35374.
    """
    places, given = run_at_nodes(task, full, counts)
    begun = clock.process_time()
    systems = [task.family(run.values).system for run in given]
    local = local_bases(task, systems, given)
    axes = [np.unique(column.round(12)) for column in places.T]
    charts = {
        name: grassmann.chart(axes, [basis[name].modes for basis in local])
        for name in task.plan.components
    }
    rows = [
        reduced_models.find_kept_rows(
            task, [system], [run], [reduced_models.project(task, basis, system)]
        ).rows
        for system, run, basis in zip(systems, given, local, strict=True)
    ]
    hyper = NONE if task.plan.hyper.tolerance else task.plan.hyper
    offline = clock.process_time() - begun + sum(run.cpu_s for run in given)

    def family(values: Mapping[str, float]) -> Case:
        here = in_box(task, values)
        modes = {
            name: np.ascontiguousarray(grassmann.interpolate(chart, here))
            for name, chart in charts.items()
        }
        # about the initial state
        found = {name: Basis(one, np.zeros(len(one)), np.zeros(0)) for name, one in modes.items()}
        rule = hyper_reduction.train(hyper, [])
        return reduced_models.reduced_case(
            task, TrainedReduction(found, rows[find_closest(places, here)], rule), values
        )

    return Comparator(f"Grassmann {shape(counts)}", family, len(given), offline)


def local_bases(
    task: TrainingTask, systems: Sequence[System], given: Sequence[FullRun]
) -> list[dict[str, Basis]]:
    """The basis of every run alone, all with as many modes as the largest needs, by component."""
    own = [
        reduced_models.bases(task, system, [run])
        for system, run in zip(systems, given, strict=True)
    ]
    sizes = {
        name: max(basis[name].modes.shape[1] - basis[name].against for basis in own)
        for name in task.plan.components
    }
    equal = replace(task, plan=replace(task.plan, modes=sizes))
    found = [
        reduced_models.bases(equal, system, [run])
        for system, run in zip(systems, given, strict=True)
    ]
    return [{name: without_directions(one) for name, one in local.items()} for local in found]


def without_directions(basis: Basis) -> Basis:
    """The basis without directions against joints, which are no points of a manifold of motions."""
    return replace(basis, modes=basis.modes[:, : basis.modes.shape[1] - basis.against], against=0)


def greedy(
    task: TrainingTask, search: Search, options: Options | None = None, name: str = "greedy"
) -> Comparator:
    """Algorithm 1, by component or, with the task `at_system_level`, for the system as a whole; it
    makes its own full runs.

    `offline_s` is the CPU time of the whole training in this process.
    """
    begun = clock.process_time()
    found = training.train(task, search, options)
    family = found.model.cases
    return Comparator(
        name, family, len(found.runs), clock.process_time() - begun, found.reduced_runs
    )


def at_system_level(task: TrainingTask) -> TrainingTask:
    """The same with all bodies in one component.

    Numbers of modes by name are left out of the plan, as components have other names.
    """
    raw, plan = task.family(parameters.completed(task.parameters, {})).system, task.plan
    return replace(task, plan=with_components(plan, component.system_level(raw)))


def run_at_nodes(
    task: TrainingTask, full: Full, counts: Sequence[int]
) -> tuple[np.ndarray, list[FullRun]]:
    """Points (j, d) of a uniform grid of the unit box, the last parameter fastest, and the full
    runs there.
    """
    rows = parameters.grid(task.parameters, counts)
    runs = [full(parameters.named(task.parameters, row)) for row in rows]
    return parameters.to_box(task.parameters, rows), runs


def find_closest(places: np.ndarray, here: np.ndarray) -> int:
    """Number of the place (j, d) nearest to a point (d,) of the unit box."""
    return int(np.argmin(np.linalg.norm(places - here, axis=1)))


def in_box(task: TrainingTask, values: Mapping[str, float]) -> np.ndarray:
    """Values as a point (d,) of the unit box."""
    return np.asarray(
        parameters.to_box(task.parameters, parameters.row_of(task.parameters, values)[None])[0]
    )


def shape(counts: Sequence[int]) -> str:
    return " x ".join(str(count) for count in counts)


def fastest(found: FinishedTraining) -> dict[str, float]:
    """The corner of the box at which the reduced model moves fastest."""
    known = found.task.parameters
    speeds: list[tuple[float, dict[str, float]]] = []
    for ends in itertools.product(*((p.low, p.high) for p in known)):
        values = parameters.named(known, ends)
        motion = full_runs.run_formed(found.task, found.model.cases(values))
        speeds.append((float(np.linalg.norm(lifted(motion)[1], axis=1).max()), values))
    return max(speeds, key=lambda pair: pair[0])[1]
