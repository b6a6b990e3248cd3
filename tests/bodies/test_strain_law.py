"""The law of beams with directors keeps its contract, and what it holds."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Law, check_law, laws
from fmbs_skfem.bodies.checks import beam_samples
from fmbs_skfem.bodies.strain_law import strains


@pytest.mark.parametrize("seed", [0, 1])
def test_contract(seed: int) -> None:
    check_law(Law.BEAM, 3, seed=seed)
    check_law(Law.PLANAR_BEAM, 2, seed=seed)
    check_law(Law.WARPED_BEAM, 3, seed=seed)


def test_strains_are_those_of_directors() -> None:
    u = np.random.default_rng(3).normal(size=(8, 3, 4))
    d, slope, turn = u[1:4], u[4], u[5:]
    dot = lambda a, b: np.sum(a * b, axis=0)  # noqa: E731
    gamma, square = [dot(d[i], slope) for i in range(3)], [dot(d[i], d[i]) for i in range(3)]
    kappa = [0.5 * (dot(d[k], turn[j]) - dot(d[j], turn[k])) for j, k in ((1, 2), (2, 0), (0, 1))]
    mixed = [dot(d[1], d[2]), dot(d[2], d[0]), dot(d[0], d[1])]
    assert_allclose(strains(u), [*gamma, *kappa, *square, *mixed], rtol=1e-12)


def test_energy_is_that_of_its_strains() -> None:
    rng = np.random.default_rng(1)
    section, _ = beam_samples(rng, Law.BEAM, 3)
    u = rng.normal(size=(24, *section.shape[1:]))
    e = strains(u.reshape(8, 3, *section.shape[1:])) - section[22:34]
    C, parts = np.zeros((6, 6, *section.shape[1:])), np.array([0.25] * 3 + [0.5] * 3)
    C[np.triu_indices(6)] = section[:21]
    C += np.triu(np.ones((6, 6)), 1)[:, :, None, None].transpose(1, 0, 2, 3) * C.transpose(
        1, 0, 2, 3
    )
    W = 0.5 * np.einsum("ipe,ijpe,jpe->pe", e[:6], C, e[:6]) + 0.5 * section[21] * np.einsum(
        "i,ipe->pe", parts, e[6:] ** 2
    )
    assert_allclose(laws.energy(Law.BEAM, u, section), np.sum(section[-1] * W), rtol=1e-12)
