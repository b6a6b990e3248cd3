"""Lengths by the mass: root mean square displacements in metres, and coordinates that count from
near by.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import bodies
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate, lengths
from fmbs_skfem.systems.compiled import compile_system, size
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.system import in_scene, sizes
from tests import models

GRAVITY = 9.81
FAR = 1e4  #: [m]


def beams(cells: int, ancf: bool = False) -> System:
    return models.double_pendulum(cells, all_multipliers=True, ancf=ancf)


def mixed() -> System:
    """A beam, a rigid body with inertia about one axis only, and a mass point."""
    beam = bodies.cable("beam", models.segment(8), models.SECTION, models.MATERIAL)
    rod = rigid(
        "rod", 0.5, np.diag([0.0, 0.02, 0.02]), (1.0, 0.5, 0.0), places={"end": (0.3, 0.0, 0.0)}
    )
    return assemble([beam, rod, bodies.point_mass("mass", 2.0, np.array([0.0, 0.0, 1.0]))])


@pytest.mark.parametrize(
    "system", [beams(4), beams(37), beams(6, True), mixed()], ids=["4", "37", "ancf", "mixed"]
)
def test_a_translation_is_as_long_as_it_is(system: System) -> None:
    """Massless axes do not move with it, and masses share it."""
    shift = np.array([0.3, -0.4, 1.2])
    assert sizes(system, np.kron(system.unit, shift))[0] == pytest.approx(1.3, rel=1e-12)


@pytest.mark.parametrize("cells", [3, 20])
def test_a_small_rotation_of_a_beam(cells: int) -> None:
    """About its middle by an angle a: a L / sqrt(12)."""
    beam = bodies.cable("beam", models.segment(cells), models.SECTION, models.MATERIAL, dim=2)
    system = assemble([beam])
    turned = (beam.reference - np.outer(beam.constant, [0.5, 0.0])) @ np.array(
        [[0.0, 1e-3], [-1e-3, 0.0]]
    )
    assert sizes(system, turned.ravel())[0] == pytest.approx(1e-3 / np.sqrt(12.0), rel=1e-12)


@pytest.mark.parametrize("cells", [4, 40])
def test_the_norm_of_the_iteration_is_that_of_the_mass_up_to_a_factor(cells: int) -> None:
    """It takes the diagonal of the mass: smooth displacements count alike on every mesh."""
    system = beams(cells)
    ratio = size(compile_system(system), np.kron(system.unit, [1.0, 0.0, 0.0]))
    assert 0.4 < ratio < 1.0


def test_an_axis_without_inertia_has_a_weight() -> None:
    system = mixed()
    assert (system.metric.diagonal() > 0.0).all()
    assert (system.mass.diagonal() == 0.0).any()


@pytest.mark.parametrize("length", [1e-7, 1.0, 1e7])
def test_slopes_and_axes_of_a_body_of_any_size_have_their_mass(length: float) -> None:
    """Those of a beam of 0.1 micrometres are 1e-15 of its mass in kg, and no less a part of it."""
    beam = bodies.cable(
        "beam",
        models.segment(3, (0.0, 0.0, 0.0), (length, 0.0, 0.0)),
        models.SECTION,
        models.MATERIAL,
        ancf=True,
    )
    rod = rigid(
        "rod",
        1e-3 * beam.total_mass,
        1e-3 * beam.total_mass * length**2 * np.eye(3),
        (length, 0.0, 0.0),
    )
    system = assemble([beam, rod])
    assert (system.metric.diagonal() == system.mass.diagonal()).all()


def test_the_size_of_a_mechanism() -> None:
    """The middle of the two beams at right angles is (0.75, 0.25); of a single point the link that
    holds it is taken.
    """
    assert beams(10).scale == pytest.approx(np.hypot(0.75, 0.25), rel=1e-2)
    assert conical((0.0, 0.0, 0.0), 0.25).scale == pytest.approx(0.25, rel=0.5)
    assert lengths.extent([bodies.point_mass("m", 1.0, np.zeros(3))]) == 1.0


def conical(
    place: tuple[float, float, float], length: float = 1.0, angle: float = np.pi / 6
) -> System:
    """A mass of 2 kg on a massless rod runs round on a circle: tension m g / cos(angle)."""
    foot, radius = np.array(place), length * np.sin(angle)
    start = foot + np.array([radius, 0.0, -length * np.cos(angle)])
    speed = radius * np.sqrt(GRAVITY / (length * np.cos(angle)))
    spun = {"mass": Motion(velocity=(0.0, speed, 0.0))}
    at = At("mass", "center")
    sensed = {"rod": probes.Reaction("rod"), "mass": probes.Position(at)}
    mass = bodies.point_mass("mass", 2.0, start)
    return assemble(
        [mass],
        [joints.RigidLink("rod", at, place)],
        [loads.Gravity((0, 0, -GRAVITY))],
        outputs=sensed,
        initial=spun,
    )


@pytest.mark.parametrize("step", [1e-3, 2.5e-4])
@pytest.mark.parametrize("rho_inf", [0.8, 0.9, 0.95, 1.0])
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (FAR, -FAR, FAR)], ids=["near", "far"])
def test_reactions_of_a_conical_pendulum_are_steady(
    step: float, rho_inf: float, place: tuple[float, float, float]
) -> None:
    """The noise of Newton's iteration in the tension, which once grew to a fifth of it, stays below
    a thousandth.
    """
    found = outputs(integrate(eliminate(conical(place)), GeneralizedAlpha(step, rho_inf), 2.0))[
        "rod_length"
    ]
    late = found[len(found) // 4 :]
    exact = -2.0 * GRAVITY / np.cos(np.pi / 6)
    assert np.abs(late / exact - 1.0).max() < (3e-3 if rho_inf == 1.0 else 1e-4)


@pytest.mark.parametrize("length", [1e-3, 0.25, 40.0])
def test_the_reaction_of_a_link_is_its_force(length: float) -> None:
    """A mass that hangs at rest pulls with m g at a link of any length."""
    hung = eliminate(conical((0.0, 0.0, 0.0), length, 0.0))
    found = outputs(integrate(hung, GeneralizedAlpha(1e-4), 3e-4))["rod_length"]
    assert_allclose(found, -2.0 * GRAVITY, rtol=1e-9)
    assert probes.Reaction.units("rod", hung.outputs["rod"]) == ("N",)


def pendulum(shift: float) -> System:
    """Example 2 with 10 cells a beam, moved along all axes."""
    place = np.full(3, shift)
    corner, end = tuple(place + np.array([1.0, 0.0, 0.0])), tuple(place + np.array([1.0, 1.0, 0.0]))
    first = bodies.cable(
        "I", models.segment(10, tuple(place), corner), models.SECTION, models.MATERIAL
    )
    second = bodies.cable("II", models.segment(10, corner, end), models.SECTION, models.MATERIAL)
    held = [
        joints.Pin("A", At("I", "left"), tuple(place)),
        joints.Pin("B", At("I", "right"), At("II", "left")),
    ]
    sensed = {"C": probes.Position(At("II", "right")), "A": probes.Reaction("A")}
    return eliminate(
        assemble([first, second], held, [loads.Gravity((0, 0, -GRAVITY))], outputs=sensed)
    )


def test_nothing_depends_on_the_origin() -> None:
    """Example 2 moves at 100 m and 10 km from the origin as there: to 1e-7 m, its reactions to 1e-4
    of the largest.
    """
    near = outputs(integrate(pendulum(0.0), GeneralizedAlpha(5e-4), 1.0, every=100))
    noise = 1e-4 * max(float(np.abs(near[f"A_{c}"]).max()) for c in "xyz")
    for shift in (100.0, FAR):
        far = outputs(integrate(pendulum(shift), GeneralizedAlpha(5e-4), 1.0, every=100))
        for name, values in near.items():
            moved, allowed = (values + shift, 1e-7) if name.startswith("C_") else (values, noise)
            np.testing.assert_allclose(far[name], moved, rtol=0.0, atol=allowed, err_msg=name)


def test_coordinates_far_away_count_from_the_middle_of_the_bodies() -> None:
    near, far = pendulum(0.0), pendulum(FAR)
    assert not near.origin.any()
    assert np.abs(far.x0).max() < 2.0
    q = far.full.lift(far.full.x0) if far.full else far.lift(far.x0)
    places = in_scene(far, q).reshape(-1, 3)[far.unit != 0.0]
    assert places.min() >= FAR - 1e-9
    assert places.max() <= FAR + 1.0 + 1e-9
