"""Plates and shells of standard NURBS circles: rings, tubes and slits, by closed forms and
published numbers.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import outputs, solve_statics, vibration_modes
from fmbs_skfem.shapes import nurbs
from fmbs_skfem.systems import At, assemble, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from ..shapes.test_smoothing import annulus, tube

STEEL = Material(2e11, 7800.0, 0.3)
T = 0.01


def ring(cells: int, degree: int, closed: bool = True, stacked: bool = False) -> Body:
    """A tube of radius 1 and length 1 with `cells` an arc, one or two nine-point patches."""
    patch, control = nurbs.refine(*tube(), cells, 1, degree)
    if not stacked:
        return plate("tube", nurbs.surface(patch, control, join=closed), T, STEEL)
    both = {"a": control * [1.0, 1.0, 0.5], "b": control * [1.0, 1.0, 0.5] + [0.0, 0.0, 0.5]}
    return plate("tube", nurbs.surface(dict.fromkeys(both, patch), both, join=True), T, STEEL)


def plane_strain(body: Body, *edges: str) -> np.ndarray:
    """Two pairs of elastic frequencies [rad/s] of a ring whose edges stay in their planes."""
    held = joints.Edge("planes", "tube", edges, "z", "xy")
    return np.asarray(
        vibration_modes(eliminate(assemble([body], [held])), 7).angular_frequencies[3:7]
    )


def exact(n: int) -> float:
    """Frequency [rad/s] of the motions w = W cos n phi, v = V sin n phi of a ring of radius 1 in
    plane strain.

    Energies of eps = w + v', kappa = w'' - w - 2 v' with stiffnesses A and A t^2/12, A = E t / (1 -
    nu^2); without stretching omega^2 = A t^2 / (12 rho t) n^2 (n^2 - 1)^2 / (n^2 + 1): Soedel,
    Vibrations of Shells and Plates, 3rd ed., CRC 2004, ch. 5.
    """
    eps, kappa = np.array([1.0, n]), np.array([-(n**2) - 1.0, -2.0 * n])
    K = np.outer(eps, eps) + T**2 / 12 * np.outer(kappa, kappa)
    return float(
        np.sqrt(
            np.linalg.eigvalsh(K)[0]
            * STEEL.young_modulus
            / (1 - STEEL.poisson_ratio**2)
            / STEEL.density
        )
    )


def test_a_tube_of_one_patch_rings_as_the_closed_form_says() -> None:
    """Three rigid motions in the plane, then n = 2 twice and n = 3 twice; hinges at the knots gave
    15.3 instead of 41.1 rad/s.
    """
    found = plane_strain(ring(8, 4), "xi2_min", "xi2_max")
    assert exact(2) == pytest.approx(41.1, abs=0.05)
    assert_allclose(found, [exact(2), exact(2), exact(3), exact(3)], rtol=4e-4)
    assert_allclose(found[:2], exact(2), rtol=1e-4)


def test_frequencies_of_the_tube_converge() -> None:
    """Errors of cubics in the stretching govern on a thin tube: (R/t)^2 h^2p, order 6."""
    errors = [
        abs(plane_strain(ring(n, 3), "xi2_min", "xi2_max")[:2].mean() / exact(2) - 1.0)
        for n in (8, 16)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(6.0, abs=0.4)


def test_patches_that_share_a_circle_are_held_by_springs() -> None:
    """Two tubes on top of each other: the circle in common keeps its functions, the knots are stiff
    all the same.
    """
    body = ring(6, 4, stacked=True)
    assert body.stiffness is not None
    assert_allclose(plane_strain(body, "a.xi2_min", "b.xi2_max")[:2], exact(2), rtol=2e-3)


def test_a_rim_of_a_tied_tube_keeps_the_contract() -> None:
    patch, control = nurbs.refine(*tube(), 1, 1, 3)
    body = plate(
        "tube",
        nurbs.surface(patch, control, join=True),
        T,
        STEEL,
        rims={"end": Rim(("xi2_min",), slopes=True)},
    )
    assert body.stiffness is None
    check_system(assemble([body]))


@pytest.mark.parametrize("load,expected", [(0.025, (1.30334, 1.78598))])
def test_a_slit_ring_of_one_patch(load: float, expected: tuple[float, float]) -> None:
    """Sze, Liu and Lo (2004), 3.3, at 0.025 P, without shear (quartic splines in polar coordinates,
    48 x 6 cells).
    """
    shape = nurbs.surface(*nurbs.refine(*annulus(6.0, 10.0), 5, 3, 4), join=False)
    body = plate("ring", shape, 0.03, Material(2.1e7, 1.0, 0.0))
    held = joints.Edge("clamp", "ring", ("xi1_min",), slope="z")
    lift = loads.EdgeLoad("P", "ring", ("xi1_max",), (0.0, 0.0, 0.8 * load))
    sensors = {
        name: probes.Position(At("ring", place))
        for name, place in (("A", "corner_10"), ("B", "corner_11"))
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)  # rows of the clamp that its corners say twice
        found = outputs(
            solve_statics(eliminate(assemble([body], [held], [lift], outputs=sensors)), 1)
        )
    assert_allclose([found["A_z"][-1], found["B_z"][-1]], expected, rtol=2e-4)


# -------------------------------------------------------------------------------------------------------- closed or slit
def test_a_patch_that_closes_on_itself_is_told_unless_somebody_asked() -> None:
    patch, control = tube()
    with pytest.warns(
        Notice,
        match=r"body 'tube': the edges 'xi1_max' and 'xi1_min' of one patch coincide.*'join: false'",
    ):
        plate("tube", nurbs.surface(patch, control), T, STEEL)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        for join in (True, False):
            plate("tube", nurbs.surface(patch, control, join=join), T, STEEL)


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
def test_supports_and_loads_on_edges_that_were_joined_away_are_refused() -> None:
    """Of one patch, and of two; whoever asks for `join` means the line inside the surface."""
    patch, control = nurbs.refine(*annulus(6.0, 10.0), 1, 1, 3)
    flat, square = nurbs.rectangle(1.0, 1.0, 1, 1)
    halves = {"a": flat, "b": flat}, {"a": square, "b": square + np.array([1.0, 0.0, 0.0])}
    for shape, edge, other in (
        (nurbs.surface(patch, control), "xi1_min", "xi1_max"),
        (nurbs.surface(*halves), "b.xi1_min", "a.xi1_max"),
    ):
        body = plate("p", shape, T, STEEL)
        message = rf"expected an edge, got '{edge}', which is joined to '{other}'.*'join: false'.*'join: true'"
        with pytest.raises(InputError, match=message):
            assemble([body], [joints.Edge("clamp", "p", (edge,))])
        with pytest.raises(InputError, match=message):
            assemble([body], [], [loads.EdgeLoad("P", "p", (edge,), (0.0, 0.0, 1.0))])
        with pytest.raises(InputError, match=message):
            plate("p", shape, T, STEEL, rims={"grip": Rim((edge,))})
    body = plate("p", nurbs.surface(*halves, join=True), T, STEEL)
    assemble([body], [joints.Edge("support", "p", ("b.xi1_min",), "z")])


def test_bending_needs_a_degree_of_two_where_cells_meet() -> None:
    shape = nurbs.surface(*nurbs.rectangle(1.0, 1.0, 3, 1, 1))
    with pytest.raises(
        InputError,
        match=r"degree 2 or more where cells meet.*got degrees 1 and 1 over 3 x 1 cells; raise 'degree'",
    ):
        plate("p", shape, T, STEEL)
    assert plate("p", shape, T, STEEL, dim=2).stiffness is None
