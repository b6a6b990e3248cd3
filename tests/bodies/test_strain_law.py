"""The law of beams with directors keeps its contract, and what it holds."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Law, check_law, laws
from fmbs_skfem.bodies.beams.beam import strains
from fmbs_skfem.bodies.checks import beam_samples


@pytest.mark.parametrize("seed", [0, 1])
def test_contract(seed: int) -> None:
    check_law(Law.BEAM, 3, seed=seed)


def test_energy_is_that_of_its_strains() -> None:
    rng = np.random.default_rng(1)
    section, _ = beam_samples(rng)
    u = rng.normal(size=(24, *section.shape[1:]))
    e = strains(u.reshape(8, 3, *section.shape[1:])) - section[22:34]
    C = np.zeros((6, 6, *section.shape[1:]))
    C[np.triu_indices(6)] = section[:21]
    parts = np.array([0.25] * 3 + [0.5] * 3)
    W = np.einsum("ipe,ijpe,jpe->pe", e[:6], C, e[:6]) * 0.5
    W += 0.5 * np.einsum("ipe,ijpe,ipe->pe", e[:6], C * np.eye(6)[:, :, None, None], e[:6]) * 0.0
    off = np.einsum("ipe,ijpe,jpe->pe", e[:6], C * (1.0 - np.eye(6))[:, :, None, None], e[:6])
    W = W + 0.5 * off + 0.5 * section[21] * np.einsum("i,ipe->pe", parts, e[6:] ** 2)
    assert_allclose(laws.energy(Law.BEAM, u, section), np.sum(section[-1] * W), rtol=1e-12)


def test_a_modulus_takes_the_stresses_of_other_gradients() -> None:
    """D(u, held) - D(u) = sum_k (s_k(held) - s_k(u)) A_k: as the curvature of stresses is."""
    rng = np.random.default_rng(2)
    section, _ = beam_samples(rng)
    u, held = rng.normal(size=(2, 24, *section.shape[1:]))
    calls, found = laws.addresses(Law.BEAM, 3, False), []
    for one, other in ((u, u), (u, held), (held, held), (held, u)):
        D = np.zeros((24, *u.shape))
        laws.call_modulus(calls, one, other, 0.0, section, D)
        found.append(D)
    assert_allclose(found[1] - found[0], found[2] - found[3], atol=1e-10 * np.abs(found[0]).max())
    assert np.abs(found[1] - found[0]).max() > 0.1
