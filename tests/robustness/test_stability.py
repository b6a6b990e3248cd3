"""Reduced models far beyond their training keep their energy, and every test that docs/stability.md
names is there.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import reduction
from fmbs_skfem.core.algebra import saddle
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, energies, integrate
from fmbs_skfem.dynamics.scheme import method_of
from fmbs_skfem.reduction import Level
from fmbs_skfem.reduction.hyper import sampling
from fmbs_skfem.reduction.spaces.component import projected
from fmbs_skfem.systems import System, compile_system, compiled, eliminate
from verification import registry

from .. import models

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "stability.md"
SCHEME, TRAINING = GeneralizedAlpha(1e-3), 0.4
KINDS = ("reduced", "elements", "points")


@pytest.fixture(scope="module")
def family() -> dict[str, System]:
    """Example 2 with 8 cells a beam, trained on its first 0.4 s."""
    raw = models.double_pendulum(8, all_multipliers=True)
    data = reduction.snapshots(integrate(eliminate(raw), SCHEME, TRAINING, Newton(1e-12)))
    parts = reduction.body_level(raw)
    plain = reduction.reduce_system(raw, parts, reduction.bases(raw, data, parts, 1e-12))
    found = {"full": eliminate(raw), "reduced": plain}
    for level in Level:
        found[level.value] = sampling.apply(
            plain, sampling.train([(plain, projected(plain, data.q))], 1e-3, level)
        )
    return found


@pytest.fixture(scope="module")
def runs(family: dict[str, System]) -> dict[str, Trajectory]:
    """Ten times the training."""
    return {
        name: integrate(system, SCHEME, 10 * TRAINING, every=10) for name, system in family.items()
    }


@pytest.mark.parametrize("kind", KINDS)
def test_ten_times_the_training_horizon(kind: str, runs: dict[str, Trajectory]) -> None:
    """No blow-up: the balance never rises by more than 1 % of the energy that the full model
    exchanges.
    """
    exchanged = energies(runs["full"])[:, 0].max()
    found = energies(runs[kind])
    assert runs[kind].times[-1] == pytest.approx(10 * TRAINING)
    assert runs[kind].statistics.halved == 0
    assert (found[:, 3] - found[0, 3]).max() < 0.01 * exchanged
    assert found[:, 0].max() < 1.1 * exchanged


@pytest.mark.parametrize("level", Level)
def test_sampling_keeps_the_energy_as_the_reduced_model_does(
    level: Level, family: dict[str, System]
) -> None:
    """Over the training horizon the drift with ECSW is that without, which falls with the square of
    the step.
    """
    drifts = []
    for name in ("reduced", level.value):
        for h in (1e-3, 5e-4):
            balance = energies(
                integrate(family[name], GeneralizedAlpha(h), TRAINING, Newton(1e-12))
            )[:, 3]
            drifts.append(np.abs(balance - balance[0]).max())
    assert drifts[2] == pytest.approx(drifts[0], rel=0.1)
    assert drifts[0] / drifts[1] == pytest.approx(4.0, rel=0.25)
    assert drifts[2] / drifts[3] == pytest.approx(4.0, rel=0.25)


def condition(system: System, h: float, scaled: bool) -> float:
    built = compile_system(system)
    method = method_of(SCHEME, Newton(), h, built)
    J = compiled.gap(built, system.x0)[1]
    W = as_dense(compiled.tangent(built, system.x0, np.zeros(len(J)))) + method.bh * as_dense(
        system.mass
    )
    return float(np.linalg.cond(saddle.matrix((method.c if scaled else 1.0) * W, J)))


def test_the_scaling_makes_the_condition_number_independent_of_the_step() -> None:
    """Bottasso, Bauchau, Cardona 2007, doi 10.1137/050638503: without it, it grows like h^-2 or
    more.
    """
    system = models.double_pendulum(8, all_multipliers=True)
    coarse, fine = (condition(system, h, True) for h in (1e-5, 1e-7))
    assert fine == pytest.approx(coarse, rel=0.1)
    assert condition(system, 1e-7, False) > 1e3 * condition(system, 1e-5, False)


def test_the_noise_floor_lies_below_truncation(family: dict[str, System]) -> None:
    """What Newton's usual tolerance leaves is a tenth of the error of truncation at most, and a
    sharp one leaves less.
    """
    sharp = integrate(family["reduced"], SCHEME, TRAINING, Newton(1e-13))
    usual, tight = (
        reduction.compare(
            sharp, integrate(family["reduced"], SCHEME, TRAINING, Newton(tolerance))
        ).maximum
        for tolerance in (1e-10, 1e-12)
    )
    truncation = reduction.compare(
        integrate(family["full"], SCHEME, TRAINING, Newton(1e-13)), sharp
    ).maximum
    assert tight < 0.2 * usual
    assert usual < 0.1 * truncation


def test_every_proof_of_the_page_exists() -> None:
    text = PAGE.read_text()
    tests, cases = (
        re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", text),
        re.findall(r"case `([\w-]+)`", text),
    )
    missing = [
        f"{file}::{name}" for file, name in tests if f"def {name}(" not in (ROOT / file).read_text()
    ]
    assert missing == []
    assert {found.name for found in registry.find(cases)} == set(cases)
    rows = [line for line in text.splitlines() if line.startswith("| ") and line.count("|") == 5]
    assert len(rows) > 50
    assert all("proof" in row or re.search(r"::\w+`|case `", row) for row in rows)
