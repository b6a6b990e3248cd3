"""Plates of several NURBS patches: springs along the seams keep them one plate, and cost rigid
motions nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import energies, solve_statics, vibration_modes
from fmbs_skfem.shapes import nurbs
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import assemble, change_coordinates, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from ..shapes.test_nurbs import LEISSA, halves
from .test_plate import turn

MATERIAL = Material(young_modulus=7e10, density=2700.0, poisson_ratio=0.3)
T = 1e-3  #: thickness [m] of unit squares, at which rotary inertia plays no part
SPATIAL = ([0.5, -1.0, 2.0], [3.0, 1.0, -2.0])


def bending_frequencies(body: Body) -> np.ndarray:
    """Six rigid and six elastic frequencies of a unit square, omega a^2 sqrt(rho t/D)."""
    E, nu, rho = MATERIAL.young_modulus, MATERIAL.poisson_ratio, MATERIAL.density
    found = vibration_modes(assemble([body]), 12).angular_frequencies
    return np.asarray(found * np.sqrt(12.0 * rho * (1.0 - nu**2) / (E * T**2)))


@pytest.mark.parametrize("slant", [0.0, 0.15])
def test_two_patches_bend_as_one(slant: float) -> None:
    """Against one patch 0.1 %, and Leissa's frequencies (NASA SP-160, 1969); six rigid modes and
    not a seventh.
    """
    one = bending_frequencies(
        plate("plate", nurbs.surface(*nurbs.rectangle(1.0, 1.0, 8, 8)), T, MATERIAL)
    )
    two = bending_frequencies(plate("plate", halves(4, slant), T, MATERIAL))
    assert two[:6].max() < 1e-2
    assert_allclose(two[6:], one[6:], rtol=1e-3)
    assert_allclose(two[6:], LEISSA, rtol=1e-3)


def test_rigid_motions_cost_nothing_and_folds_do() -> None:
    """The springs' force in the body turned and moved, against that of a fold of 0.001 along the
    slanted seam.
    """
    body = plate(
        "plate", halves(3, 0.15), T, MATERIAL, rotation=turn(3), origin=np.array(SPATIAL[0])
    )
    K = assemble([body]).stiffness
    moved = body.reference @ turn(3) + np.outer(body.constant, SPATIAL[1])
    normal = np.array([1.0, -0.3, 0.0]) / np.hypot(1.0, 0.3)
    distance = (halves(3, 0.15).reference - [0.5, 0.5]) @ normal[:2]
    folded = body.reference + 1e-3 * np.outer(np.abs(distance), turn(3)[:, 2])
    fold = np.abs(K @ folded.ravel()).max()
    for q in (body.reference, moved):
        assert np.abs(K @ q.ravel()).max() < 1e-10 * fold


def test_seams_with_rims_keep_the_contract() -> None:
    shape = halves(2)
    body = plate("plate", shape, T, MATERIAL, rims={"grip": Rim(("left.xi1_min",))})
    assert body.stiffness is not None
    assert body.stiffness.shape == body.mass.shape
    moved = body.reference @ turn(3).T + np.outer(body.constant, SPATIAL[0])
    assert np.abs(body.stiffness @ moved).max() < 1e-11 * abs(body.stiffness).max()
    check_system(assemble([body]))


@pytest.mark.parametrize("form", ["eliminated", "reduced"])
def test_strain_energy_of_a_plate_held_at_its_seam(form: str) -> None:
    """A unit square pulled by f per length, its lower side on a rail up to the seam: f^2 / (2 E t),
    and none at rest.
    """
    f, body = 1e3, plate("plate", halves(2), T, MATERIAL, origin=np.array([0.2, 0.7, 0.3]))
    rail = joints.Edge("rail", "plate", ("left.xi2_min",), "yz", "z")
    held = [joints.Edge("wall", "plate", ("left.xi1_min",), "x"), rail]
    pull = loads.EdgeLoad("pull", "plate", ("right.xi1_max",), (f, 0.0, 0.0))
    system = eliminate(assemble([body], held, [pull]))
    if form == "reduced":
        system = change_coordinates(
            system,
            np.linalg.qr(np.random.default_rng(3).normal(size=(system.size,) * 2))[0],
            0.9 * system.x0,
        )
    strain = energies(solve_statics(system, 2))[:, 1]
    assert_allclose(
        strain,
        0.5 * f**2 / (MATERIAL.young_modulus * T) * np.array([0.0, 0.25, 1.0]),
        rtol=1e-4,
        atol=1e-8,
    )


@pytest.mark.parametrize("load", [1e-2, 1e-4])
def test_strain_energy_under_small_loads(load: float) -> None:
    """Half of the work of a dead load, down to 0.3 nJ: stiff springs along the seam leave no
    round-off of their own.
    """
    body = plate("plate", halves(3, 0.15), T, MATERIAL, origin=np.array([3.0, 2.0, 0.0]))
    hold = joints.Edge("clamp", "plate", ("left.xi1_min",), slope="z")
    bent = eliminate(assemble([body], [hold], [loads.Gravity((0.0, 0.0, -load))]))
    _, strain, potential, _ = energies(solve_statics(bent, 1))[-1]
    assert strain == pytest.approx(-0.5 * potential, rel=1e-4)


def test_springs_follow_the_thickness_of_the_cells_at_the_seam() -> None:
    """D = E t^3/(12 (1 - nu^2)), the mean of both sides."""
    shape = halves(2)
    t = np.full(len(shape.nodes), T)
    t[shape.faces["right"]] *= 2.0
    thin, both = (plate("plate", shape, thickness, MATERIAL).stiffness for thickness in (T, t))
    assert thin is not None
    assert both is not None
    assert_allclose(
        both.toarray(), (1.0 + 8.0) / 2.0 * thin.toarray(), rtol=1e-12, atol=1e-12 * abs(thin).max()
    )


@pytest.mark.parametrize("shape", [halves(2), nurbs.surface(*nurbs.rectangle(1.0, 1.0, 2, 2))])
def test_no_springs_without_bending_or_seams(shape: Surface) -> None:
    dim = 2 if len(shape.space.patches) > 1 else 3
    assert plate("plate", shape, T, MATERIAL, dim=dim).stiffness is None


def test_a_fold_of_the_reference_is_refused() -> None:
    patch, control = nurbs.rectangle(1.0, 1.0, 2, 2, 2)
    shape = nurbs.surface({"a": patch, "b": patch}, {"a": control, "b": control[..., [2, 1, 0]]})
    with pytest.raises(
        InputError, match=r"a surface without a kink.*make two bodies that are joined there"
    ):
        plate("plate", shape, T, MATERIAL)


@pytest.mark.parametrize("kind", ["flat", "curved"])
def test_a_plate_far_away_keeps_its_digits(kind: str) -> None:
    """Law data and mass have the same bits wherever the origin lies."""
    flat = nurbs.rectangle(1.0, 1.0, 3, 2), nurbs.cylinder_panel(1.0, 1.0, -0.5, 0.5, 3, 2)
    shape = nurbs.surface(*flat[kind == "curved"])
    here, there = (
        plate("plate", shape, T, MATERIAL, origin=np.array(x))
        for x in ([0.0, 0.0, 0.0], [1e6, -2e6, 3e6])
    )
    assert here.cells is not None
    assert there.cells is not None
    assert_array_equal(here.cells.table, there.cells.table)
    assert_array_equal(here.cells.section, there.cells.section)
    assert_array_equal(here.mass.toarray(), there.mass.toarray())
