"""A user's own law in symbols is one like any other."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Given, cable, check_law, laws, own_laws
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs, solve_statics
from fmbs_skfem.reduction import files
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import pages
from ..models import segment


def stiffening_energy(r: Any, EA: Any, EI: Any, c: Any) -> Any:
    """EA/2 (eps^2 + c eps^4 / 2) + EI/2 |r''|^2."""
    eps = (r[0].dot(r[0]) - 1) / 2
    return EA / 2 * (eps**2 + c * eps**4 / 2) + EI / 2 * r[1].dot(r[1])


def planar_twin(r: Any, EA: Any, EI: Any, kappa0: Any) -> Any:
    """The exact curvature."""
    (a, b), (c, d) = r
    kappa = (a * d - b * c) / (a**2 + b**2) ** sympy.Rational(3, 2)
    return EA / 8 * (a**2 + b**2 - 1) ** 2 + EI / 2 * (kappa - kappa0) ** 2


STIFFENING = own_laws.define("stiffening", 2, ("EA", "EI", "c"), stiffening_energy)
TWIN = own_laws.define("twin", 2, ("EA", "EI", "kappa0"), planar_twin, dims=(2,))


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
    with pytest.raises(InputError, match=r"law: expected one of .*'exakt'"):
        laws.find("exakt")
