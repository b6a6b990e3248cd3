"""The loops of laws are those that their symbols give, and compute what SymPy finds of the energy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import law_symbols, laws, symbolic
from fmbs_skfem.bodies.laws import CABLES, Law

CASES = [*((law, dim) for law in CABLES for dim in (2, 3)), (Law.MEMBRANE, 2), (Law.SHELL, 3)]
CASES += [(Law.PLANAR_BEAM, 2)]
#: by the vector of the curvature itself, of which the loops are not made
BY_VECTOR = replace(law_symbols.VECTOR, dissipation=law_symbols.quadratic_dissipation)


def symbols_of(law: Law, dim: int) -> symbolic.LawSymbols:
    word = "quadratic" if law is Law.QUADRATIC else "curved" if law in CABLES else law.name.lower()
    names = f"{word}_{dim}_" if law in CABLES else f"{word}_"
    return BY_VECTOR if names == "curved_3_" else law_symbols.KNOWN[names][0]


def expected(law: Law, dim: int) -> tuple[dict[str, list[Any]], list[Any]]:
    """Results of all kinds and what they are functions of, by derivatives of the whole energy."""
    given = symbols_of(law, dim)
    count = law.vectors * dim
    u, v = (sympy.symbols(f"{name}:{count}", real=True) for name in "uv")
    *section, w = sympy.symbols(f"s:{law.rows}", real=True)
    beta = sympy.Symbol("beta")
    r = [sympy.Matrix(u[k * dim : (k + 1) * dim]) for k in range(law.vectors)]
    strains = list(given.strains(lambda value: value, r, *section))
    rates = [sum(sympy.diff(one, x) * y for x, y in zip(u, v, strict=True)) for one in strains]
    assert given.dissipation is not None
    W, R = given.energy(strains, *section), given.dissipation(strains, rates, *section)
    W, R = (
        one.replace(law_symbols.fall, lambda a, n: a ** (-n / 2)).subs(law_symbols.N, law.option)
        for one in (W, R)
    )
    S = [sympy.diff(W, x) for x in u]
    pull = [sympy.diff(R, y) for y in v]
    pairs = [(i, j) for i in range(count) for j in range(i + 1)]
    D = [sympy.diff(S[i], u[j]) for i, j in pairs]
    viscous = [sympy.diff(pull[i], v[j]) for i, j in pairs]
    found = {
        "energy": [W],
        "dissipation": [2 * R],
        "stress": S,
        "damped_stress": [a + beta * b for a, b in zip(S, pull, strict=True)],
        "modulus": D,
        "damped_modulus": [a + beta * b for a, b in zip(D, viscous, strict=True)],
    }
    return {kind: [w * one for one in part] for kind, part in found.items()}, [
        *u,
        *v,
        *section,
        w,
        beta,
    ]


@pytest.mark.parametrize("law, dim", CASES)
def test_functions_of_laws_are_those_of_their_symbols(law: Law, dim: int) -> None:
    """Energy, stress and modulus, damped or not, and what damping dissipates, at random gradients
    against SymPy's own numbers.
    """
    random, rows = np.random.default_rng(dim), law.vectors * dim
    u, v = random.normal(size=(2, rows, 1, 3))
    section = random.uniform(0.5, 2.0, (law.rows, 1, 3))
    u[0] += 2.0
    parts = [tuple(one[:, :, k : k + 1].copy() for one in (u, v, section)) for k in range(3)]
    found = {
        "energy": np.array([laws.energy(law, x, s) for x, _, s in parts]),
        "dissipation": np.array([laws.dissipation(law, *part) for part in parts]),
    }
    for beta, kind in ((0.0, ""), (0.3, "damped_")):
        S, D = np.zeros((rows, 1, 3)), np.zeros((rows, rows, 1, 3))
        laws.stress(law, u, v, beta, section, S)
        laws.modulus(law, u, beta, section, D)
        found |= {f"{kind}stress": S[:, 0], f"{kind}modulus": D[np.tril_indices(rows)][:, 0]}
    wanted, symbols = expected(law, dim)
    for kind, numbers in found.items():
        values = sympy.lambdify(symbols, wanted[kind], "numpy", cse=True)(
            *u[:, 0], *v[:, 0], *section[:, 0], 0.3
        )
        exact = np.array([np.broadcast_to(value, 3) for value in values]).reshape(numbers.shape)
        assert_allclose(numbers, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


def test_loops_are_those_of_their_symbols() -> None:
    """`python -m fmbs_skfem.bodies.law_symbols` writes them anew."""
    assert law_symbols.LOOPS.read_text(encoding="utf-8") == law_symbols.text()
