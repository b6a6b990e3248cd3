"""Runs that many tests of reduction share: the two examples of Hou, Liu, Hu (2020) in full, and
example 2 reduced.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from fmbs_skfem import reduction
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.reduction import Level
from fmbs_skfem.reduction.hyper import sampling
from fmbs_skfem.reduction.hyper.sampling import Selection
from fmbs_skfem.reduction.spaces.component import projected
from fmbs_skfem.reduction.spaces.pod import Basis
from fmbs_skfem.systems import System, compile_system, compiled, eliminate
from tests import models

SCHEME = GeneralizedAlpha(5e-4)
NEWTON = Newton(tolerance=1e-12)  #: well below the smallest truncation errors


@dataclass(frozen=True)
class Full:
    """A full model, its run, and its snapshots every 5 ms."""

    raw: System
    run: Trajectory
    data: reduction.Snapshots


@dataclass(frozen=True)
class Reduced:
    """A reduced system with what it was made from."""

    components: Mapping[str, tuple[str, ...]]
    bases: dict[str, Basis]
    system: System
    states: np.ndarray  #: (s, n) projected snapshots


def full_of(
    raw: System, scheme: GeneralizedAlpha = SCHEME, duration: float = 3.0, interval: float = 5e-3
) -> Full:
    every = round(interval / scheme.step)
    run = integrate(eliminate(raw), scheme, duration, NEWTON, every)
    return Full(raw, run, reduction.snapshots(run))


def reduced(
    full: Full, components: Mapping[str, tuple[str, ...]], tolerance: float = 1e-12, **options: bool
) -> Reduced:
    bases = reduction.bases(full.raw, full.data, components, tolerance)
    system = reduction.reduce_system(full.raw, components, bases, **options)
    return Reduced(components, bases, system, projected(system, full.data.q))


def hyper_reduced(
    model: Reduced, level: Level = Level.ELEMENTS, eta: float = 1e-3
) -> tuple[System, tuple[Selection, ...]]:
    selections = sampling.train([(model.system, model.states)], eta, level)
    return sampling.apply(model.system, selections), selections


def error(full: Full, system: System, scheme: GeneralizedAlpha = SCHEME) -> float:
    """Largest distance of a reduced model from the full one over the largest displacement, in the
    norm of the mass.
    """
    every = round(full.run.times[1] / scheme.step)
    run = integrate(system, scheme, float(full.run.times[-1]), NEWTON, every)
    return reduction.compare(full.run, run).maximum


def strain_energy(system: System, x: np.ndarray) -> float:
    """Strain energy [J] of sampled points."""
    return compiled.strain_energy(compile_system(system), x)


@pytest.fixture(scope="session")
def example_2() -> Full:
    return full_of(models.double_pendulum(100, all_multipliers=True))


@pytest.fixture(scope="session")
def by_component(example_2: Full) -> Reduced:
    return reduced(example_2, reduction.body_level(example_2.raw))


@pytest.fixture(scope="session")
def by_system(example_2: Full) -> Reduced:
    return reduced(example_2, reduction.system_level(example_2.raw))


@pytest.fixture(scope="session")
def coarse() -> Full:
    """Example 2 with 16 cells a beam."""
    return full_of(models.double_pendulum(16, all_multipliers=True))


@pytest.fixture(scope="session")
def small(coarse: Full) -> Reduced:
    return reduced(coarse, reduction.body_level(coarse.raw))


@pytest.fixture(scope="session")
def example_1() -> Full:
    return full_of(models.spin_up(100, all_multipliers=True))


@pytest.fixture(scope="session")
def example_2_hermite() -> Full:
    """Example 2 in the coordinates of the ANCF cable."""
    return full_of(models.double_pendulum(100, ancf=True, all_multipliers=True))
