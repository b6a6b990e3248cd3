"""Laws in symbols: the functions of cables are those of their symbols, and a user's own law is one
like any other.
"""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Given, cable, check_law, laws, own_laws, symbolic
from fmbs_skfem.bodies.laws import CABLES, Law
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs, solve_statics
from fmbs_skfem.reduction import files
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from tests.bodies import law_symbols

from .. import pages
from ..models import segment


def stiffening_energy(r: Any, EA: Any, EI: Any, c: Any) -> Any:
    """EA/2 (eps^2 + c eps^4 / 2) + EI/2 |r''|^2."""
    eps = (r[0].dot(r[0]) - 1) / 2
    return EA / 2 * (eps**2 + c * eps**4 / 2) + EI / 2 * r[1].dot(r[1])


def planar_twin(r: Any, EA: Any, EI: Any, kappa0: Any) -> Any:
    return law_symbols.planar_energy(3, r, EA, EI, kappa0)


STIFFENING = own_laws.define("stiffening", 2, ("EA", "EI", "c"), stiffening_energy)
TWIN = own_laws.define("twin", 2, ("EA", "EI", "kappa0"), planar_twin, dims=(2,))


@pytest.mark.parametrize(
    "law, dim",
    [*((law, dim) for law in CABLES for dim in (2, 3)), (Law.MEMBRANE, 2), (Law.SHELL, 3)],
)
def test_functions_of_laws_are_those_of_their_symbols(law: Law, dim: int) -> None:
    """Energy, stress and modulus, damped or not, and what damping dissipates, at random gradients
    against SymPy's own numbers.
    """
    given = law_symbols.symbols_of(law, dim)
    assert given is not None
    random, rows = np.random.default_rng(dim), law.vectors * dim
    u, v, section = (
        random.normal(size=(rows, 1, 3)),
        random.normal(size=(rows, 1, 3)),
        random.uniform(0.5, 2.0, (law.rows, 1, 3)),
    )
    u[0] += 2.0
    found = {
        "energy": np.array(
            [
                laws.energy(law, u[:, :, k : k + 1].copy(), section[:, :, k : k + 1].copy())
                for k in range(3)
            ]
        )
    }
    parts = [
        (u[:, :, k : k + 1].copy(), v[:, :, k : k + 1].copy(), section[:, :, k : k + 1].copy())
        for k in range(3)
    ]
    found["dissipation"] = np.array([laws.dissipation(law, *part) for part in parts])
    for beta, kind in ((0.0, ""), (0.3, "damped_")):
        S, D = np.zeros((rows, 1, 3)), np.zeros((rows, rows, 1, 3))
        laws.stress(law, u, v, beta, section, S)
        laws.modulus(law, u, beta, section, D)
        found |= {
            f"{kind}stress": S[:, 0],
            "modulus viscosity" if kind else "modulus": D[np.tril_indices(rows)][:, 0],
        }
    for kind, numbers in found.items():
        parts = [symbolic.results(given, dim, part) for part in kind.split()]
        wanted, symbols = (
            [sum(one) for one in zip(*(part for part, _ in parts), strict=True)],
            parts[0][1],
        )
        values = sympy.lambdify(symbols, wanted, "numpy", cse=True)(
            *u[:, 0], *v[:, 0], *section[:, 0], 0.3
        )
        expected = np.array([np.broadcast_to(value, 3) for value in values]).reshape(numbers.shape)
        assert_allclose(numbers, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_a_law_of_ones_own_stretches_as_it_says() -> None:
    """F = dW/dl = EA (eps + c eps^3) l with eps = (l^2 - 1)/2 at the stretch l."""
    rod = cable(
        "rod",
        segment(4),
        Given(EA=100.0, EI=1.0, rhoA=1.0),
        dim=2,
        law=STIFFENING,
        numbers={"c": 40.0},
    )
    held = [
        joints.Clamp("wall", At("rod", "left")),
        joints.Slider("guide", At("rod", "right"), (1.0, 0.0)),
    ]
    force = 30.0
    system = assemble(
        [rod],
        held,
        [loads.PointForce("pull", At("rod", "right"), (force, 0.0))],
        outputs={"tip": probes.Position(At("rod", "right"))},
    )
    tip = outputs(solve_statics(eliminate(system), 5))["tip_x"][-1]
    eps = (tip**2 - 1) / 2
    assert 100.0 * (eps + 40.0 * eps**3) * tip == pytest.approx(force, rel=1e-8)


def test_names_of_a_section_are_not_those_of_the_loops() -> None:
    """Numbers called like other variables, and an exponential: W = u0/2 eps^2 + w (exp(x0 eps) - 1
    - x0 eps) + beta/2 |r''|^2.
    """

    def energy(r: Any, u0: Any, w: Any, x0: Any, beta: Any) -> Any:
        eps = (r[0].dot(r[0]) - 1) / 2
        return (
            u0 / 2 * eps**2 + w * (sympy.exp(x0 * eps) - 1 - x0 * eps) + beta / 2 * r[1].dot(r[1])
        )

    law = own_laws.define("confusing", 2, ("u0", "w", "x0", "beta"), energy)
    check_law(law, 2)
    check_law(law, 3)
    u, section, S = (
        np.array([1.2, 0.0, 0.0, 0.5]),
        np.array([3.0, 2.0, 0.7, 5.0, 0.25]),
        np.zeros((4, 1, 1)),
    )
    laws.stress(law, u[:, None, None], np.zeros((4, 1, 1)), 0.0, section[:, None, None], S)
    pull = 3.0 * 0.22 + 2.0 * 0.7 * (np.exp(0.7 * 0.22) - 1)
    assert_allclose(S[:, 0, 0], 0.25 * np.array([pull * 1.2, 0.0, 0.0, 5.0 * 0.5]), rtol=1e-13)


def test_a_law_of_ones_own_moves_as_its_twin_among_the_built_in() -> None:
    def swing(law: Law) -> np.ndarray:
        rod = cable("rod", segment(6), Given(EA=1e4, EI=2.0, rhoA=1.0), dim=2, law=law)
        system = assemble(
            [rod], [joints.Pin("pin", At("rod", "left"))], [loads.Gravity((0.0, -9.81))]
        )
        return integrate(eliminate(system), GeneralizedAlpha(1e-3), 0.3).x

    check_law(TWIN, 2)
    check_law(STIFFENING, 3)
    assert_allclose(swing(TWIN), swing(Law.EXACT), atol=1e-9)


def test_a_model_with_a_law_of_ones_own_is_saved_and_sent(tmp_path: Any) -> None:
    rod = cable("rod", segment(4), Given(EA=100.0, EI=1.0, rhoA=1.0), dim=2, law=TWIN)
    system = eliminate(assemble([rod], [joints.Clamp("wall", At("rod", "left"))]))
    files.save(system, tmp_path / "model.h5")
    for found in (files.load(tmp_path / "model.h5"), pickle.loads(pickle.dumps(system))):
        assert found.elastic[0].gather.law is TWIN


def test_the_recipe_for_an_own_law_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """docs/own_law.md: its code calls the contract, and holds the stretch against the exact force."""
    monkeypatch.setattr(laws, "KNOWN", dict(laws.KNOWN))  # what the page declares is forgotten
    names = pages.run("docs/own_law.md", __name__="own_law")
    assert names["stretch"] > 1.1


def test_wrong_definitions_are_refused() -> None:
    with pytest.raises(InputError, match="a name of its own"):
        own_laws.define("twin", 2, ("EA",), stiffening_energy)
    with pytest.raises(InputError, match="a word of letters"):
        own_laws.define("my law", 2, ("EA",), stiffening_energy)
    with pytest.raises(InputError, match="numbers of the law: c"):
        cable("rod", segment(4), Given(EA=100.0, EI=1.0, rhoA=1.0), dim=2, law=STIFFENING)
    with pytest.raises(InputError, match="in 3 dimensions"):
        cable("rod", segment(4), Given(EA=100.0, EI=1.0, rhoA=1.0), dim=3, law=TWIN)
    with pytest.raises(InputError, match=r"one of .*EXACT"):
        laws.find("exakt")
