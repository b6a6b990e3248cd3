"""Equilibria and buckling of bodies that nothing holds: loads may balance, but where the bodies are
is arbitrary.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from fmbs_skfem.bodies import sections
from fmbs_skfem.bodies.body import cable
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import buckling, find_free, linearise, outputs, real_modes, solve_statics
from fmbs_skfem.dynamics.equilibria import statics
from fmbs_skfem.systems import At, System, assemble, eliminate, free_motions
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.bushing import Bushing
from fmbs_skfem.systems.forces.springs import SpringDamper
from fmbs_skfem.systems.measures import probes
from tests.models import segment

PULL = 3.0  #: [N]


def pulled(
    held: list[joints.Joint], pull: float = PULL, more: tuple[loads.Load, ...] = ()
) -> System:
    """A beam of 1 m with EA = 1e5 N, pulled at both ends."""
    beam = cable("beam", segment(5), sections.Given(1e5, 1.0, 0.1), dim=2)
    ends = [
        loads.PointForce(end, At("beam", end), (way * pull, 0.0))
        for end, way in (("left", -1.0), ("right", 1.0))
    ]
    sought = {end: probes.Position(At("beam", end)) for end in ("left", "right")}
    return assemble([beam], held, [*ends, *more], outputs=sought)


def test_an_equilibrium_of_a_free_body_says_what_is_arbitrary() -> None:
    """The stretch is N L / EA, to first order; tension holds the beam against turning, and nothing
    its place.
    """
    with pytest.warns(
        Notice,
        match=r"free motions without stiffness: beam moves along \(1, 0\); beam moves along \(0, 1\); positions",
    ):
        found = outputs(solve_statics(pulled([])))
    assert found["right_x"][-1] - found["left_x"][-1] == pytest.approx(1.0 + PULL / 1e5, abs=1e-8)


@pytest.mark.parametrize(
    "system",
    [
        pulled([joints.Pin("pin", At("beam", "left"))]),
        pulled([], more=(Bushing("bushing", At("beam", "left"), stiffness=(5.0, 5.0)),)),
    ],
    ids=["tension", "spring"],
)
def test_what_joints_springs_or_tension_hold_is_not_spoken_of(system: System) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        solve_statics(system)


@pytest.mark.parametrize("x", [0.0, 300.0])
def test_rigid_bodies_that_weight_alone_holds(x: float) -> None:
    """Two equal masses on rods of 1 m that hang: w^2 = (2 -+ sqrt 2) g / L; where free ones turn is
    said in the scene.
    """
    rods = [
        rigid(name, 2.0, np.array(1e-12), (x, y), dim=2, places={"top": (x, y + 1.0)})
        for name, y in (("one", 4.0), ("two", 3.0))
    ]
    ties = [joints.Pin("a", At("one", "top")), joints.Pin("b", At("two", "top"), At("one"))]
    path = solve_statics(eliminate(assemble(rods, ties, [loads.Gravity((0.0, -9.81))])))
    found = real_modes(
        linearise(path.system, path.x[-1], path.multipliers[-1], 1.0), 2
    ).angular_frequencies
    np.testing.assert_allclose(found**2, 9.81 * (2 + np.sqrt(2) * np.array([-1, 1])), rtol=1e-8)
    still = assemble(rods[:1], ties[:1])
    assert find_free(still, linearise(still)).names == (f"one turns about ({x:g}, 5)",)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e8])
def test_what_turns_is_told_from_what_moves_at_every_size(size: float) -> None:
    """A turn of 1 rad over the size of a large mechanism is no small number of its own."""
    rod = rigid("rod", 1.0, np.array(size**2), (0.0, 0.0), dim=2, places={"tip": (size, 0.0)})
    for joint, text in (
        (joints.Pin("pin", At("rod", "frame")), "rod turns about (0, 0)"),
        (joints.Slider("rail", At("rod", "frame"), (1.0, 0.0)), "rod moves along (1, 0)"),
    ):
        (found, *more), _ = free_motions.unsupported(assemble([rod], [joint]))
        assert text in (str(found), *map(str, more))


def test_buckling_of_a_free_body_is_refused() -> None:
    with pytest.raises(
        InputError,
        match=r"expected a system that its joints hold, got .*beam turns about .*; hold it by joints",
    ):
        buckling(pulled([], -PULL))
    joined = [
        joints.Pin("pin", At("beam", "left")),
        joints.Slider("slider", At("beam", "right"), (1.0, 0.0)),
    ]
    factor = buckling(pulled(joined, -PULL)).factors[0]
    assert factor * PULL == pytest.approx(np.pi**2, rel=1e-3)  # that of Euler


def sprung(a: float, gravity: float) -> System:
    """A rigid body of 1 kg and 0.2 a^2 kg m2 on springs of 10 N/m and length 0, at -a and 2 a from
    its centre.
    """
    places = {"near": (-a, 0.0), "far": (2.0 * a, 0.0)}
    body = rigid("body", 1.0, 0.2 * a**2, (0.0, 0.0), dim=2, places=places)
    held = [
        SpringDamper(name, At("body", name), place, stiffness=10.0, length=0.0)
        for name, place in places.items()
    ]
    return assemble([body], [], [*held, loads.Gravity((0.0, -gravity))])


@pytest.mark.parametrize("a", [1e-9, 1.0, 1e8])
def test_springs_alone_hold_a_rigid_body_of_any_size(a: float) -> None:
    """The weight turns the body by tan = m g / (9 k a), whatever a is."""
    motion = solve_statics(sprung(a, 9.0 * a), 2)
    q = motion.system.lift(motion.x[-1])
    assert q[3] / q[2] == pytest.approx(0.1, rel=1e-9)
    assert q[:2] / a == pytest.approx(
        [0.5 - 0.5 / np.sqrt(1.01), -0.45 - 0.05 / np.sqrt(1.01)], rel=1e-9
    )


@pytest.mark.parametrize("a", [1e-9, 1e-6, 1.0, 1e8])
def test_modes_of_a_rigid_body_of_any_size(a: float) -> None:
    """omega^2 of K = k (2, a; a, 5 a^2) and M = (m, 0; 0, 0.2 m a^2), and 2 k / m along the line of
    the springs.
    """
    root = np.sqrt(13725.0)
    assert real_modes(linearise(sprung(a, 0.0)), 3).squares == pytest.approx(
        [135.0 - root, 20.0, 135.0 + root], rel=1e-9
    )


def test_a_chain_under_tension_is_not_searched_for_free_motions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The search takes dense factors of all joints, minutes for 300 bodies; weight holds a chain,
    as its pivots say.
    """
    links = [
        rigid(
            f"b{k}",
            0.01,
            np.array(1e-7),
            (0.0, y),
            dim=2,
            places={"t": (0.0, y + 0.005), "e": (0.0, y - 0.005)},
        )
        for k, y in enumerate(-0.01 * np.arange(30))
    ]
    ties = [
        joints.Pin(f"j{k}", At(f"b{k}", "t"), At(f"b{k - 1}", "e") if k else None)
        for k in range(30)
    ]
    searched: list[System] = []
    monkeypatch.setattr(
        statics,
        "find_free",
        lambda system, linear: searched.append(system) or find_free(system, linear),
    )
    path = solve_statics(eliminate(assemble(links, ties, [loads.Gravity((0.0, -9.81))])))
    assert path.times[-1] == 1.0
    assert not searched
