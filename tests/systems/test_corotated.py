"""Bodies of matrices at large rotations: a plate's own K and M against the plate, rigid motions,
tangents, and momentum.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.body import LinearElasticity
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, solve_statics, vibration_modes
from fmbs_skfem.dynamics.near_state.linear import Spin, in_rotating_frame, linearise
from fmbs_skfem.systems import At, Motion, Rayleigh, System, assemble, check_system, eliminate
from fmbs_skfem.systems.compiled import compile_system, elastic_tangent, strain_energy
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification.plates import rectangle

TURN = Rotation.from_rotvec([1.0, -2.0, 0.5]).as_matrix()


@cache
def lug() -> Body:
    """A strip with a rigid rim at its left end."""
    rims = {"left": Rim(("left",), slopes=True)}
    made = rectangle("bfs", 6, 2, 0.6, 0.2)
    return plate("lug", made, 5e-3, Material(70e9, 2700.0, 0.3), dim=3, rims=rims)


@cache
def linear() -> Body:
    """The same by its stiffness and mass alone."""
    K = linearise(assemble([lug()], pictures=False)).stiffness
    return replace(lug(), cells=None, linear=LinearElasticity(K))


def of(body: Body, *more: loads.Load, damping: Rayleigh | None = None) -> System:
    held = [joints.Weld("root", At("lug", "left"))]
    seen = {"tip": probes.Position(At("lug", "c"))}
    return assemble([body], held, more, damping, outputs=seen, pictures=False)


def test_frequencies_are_those_of_the_body() -> None:
    for held in ([], [joints.Weld("root", At("lug", "left"))]):
        wanted, found = (
            vibration_modes(assemble([one], held, pictures=False), 14).squares[6:]
            for one in (lug(), linear())
        )
        assert_allclose(found, wanted, rtol=1e-8)


@pytest.mark.parametrize("damping", [Rayleigh(), Rayleigh(0.1, 1e-3)])
def test_forces_and_tangents_are_those_of_its_energy(damping: Rayleigh) -> None:
    """In any rotation, and of a body that comes with a damping of its own."""
    check_system(of(linear(), damping=damping))
    assert linear().linear is not None
    K = csr_array(linear().linear.stiffness)  # type: ignore[union-attr]
    own = replace(linear(), linear=LinearElasticity(K, csr_array(1e-4 * K)))
    turned = replace(own, reference=own.reference @ TURN.T)
    wide = csr_array(np.kron(np.eye(len(own.reference)), TURN))
    K = csr_array(wide @ K @ wide.T)
    turned = replace(turned, linear=LinearElasticity(K, csr_array(1e-4 * K)))
    for body in (own, turned):
        check_system(assemble([body], damping=damping, pictures=False), seed=1)


def test_rigid_motions_cost_nothing() -> None:
    """1e-12 of the work of gravity, whatever the rounding of K; momentum stays to 1e-10."""
    body = linear()
    assert body.linear is not None
    rough = csr_array(np.float32(body.linear.stiffness.toarray()).astype(float))  # type: ignore[union-attr]
    body = replace(body, linear=LinearElasticity(csr_array(0.5 * (rough + rough.T))))
    model = compile_system(assemble([body], pictures=False))
    work = 9.81 * body.total_mass
    for k in range(4):
        turn = Rotation.random(random_state=k).as_matrix()
        moved = body.reference @ turn.T + np.outer(body.constant, [3.0, -2.0, 1.0])
        assert strain_energy(model, moved.ravel()) < 1e-12 * work
    thrown = {"lug": Motion(velocity=(1.0, 2.0, 3.0))}
    fall = assemble([body], [], [loads.Gravity((0.0, 0.0, -9.81))], initial=thrown, pictures=False)
    run = integrate(fall, GeneralizedAlpha(0.01), 0.5, Newton(tolerance=1e-12))
    model = compile_system(fall)
    assert max(strain_energy(model, x) for x in run.x) < 1e-12 * work
    heavy = np.asarray(body.mass @ body.constant)
    speed = np.array([heavy @ v.reshape(-1, 3) for v in run.v]) / body.total_mass
    exact = np.array([1.0, 2.0, 3.0]) - np.outer(run.times, [0.0, 0.0, 9.81])
    assert_allclose(speed, exact, atol=1e-10)


def test_a_blade_that_spins_knows_its_stresses_where_they_are_given() -> None:
    """At 0.63 of its first frequency: by itself it bends by 8 % too much, with the stiffness of its
    stresses by 2.5 %.
    """
    weight = loads.Gravity((0.0, 0.0, -0.01))
    fast = Spin(0.63 * float(vibration_modes(of(lug()), 1).angular_frequencies[0]))

    def tip(body: Body) -> tuple[float, np.ndarray]:
        system = eliminate(in_rotating_frame(of(body, weight), fast))
        x = solve_statics(system).x[-1]
        return float(system.sensors(x)[2]), system.lift(x)

    exact, q = tip(lug())
    model = compile_system(assemble([lug()], pictures=False))
    own = linear().linear
    assert own is not None
    Kg = csr_array(elastic_tangent(model, q, 0.0) - own.stiffness)
    stressed = replace(linear(), linear=replace(own, prestress=csr_array(0.5 * (Kg + Kg.T))))
    assert 0.05 < tip(linear())[0] / exact - 1.0 < 0.1
    assert abs(tip(stressed)[0] / exact - 1.0) < 0.03


def test_the_difference_from_the_body_falls_with_the_square_of_the_amplitude() -> None:
    """Of a strip in bending whose strains the body of matrices takes as linear."""
    apart = []
    for force in (4.0, 2.0, 1.0):
        push = loads.PointForce("P", At("lug", "c"), (0.0, 0.0, force))
        tips = []
        for body in (lug(), linear()):
            system = eliminate(of(body, push))
            tips.append(system.sensors(solve_statics(system).x[-1]))
        apart.append(float(np.abs(tips[0] - tips[1]).max()))
    orders = np.log2(np.array(apart[:-1]) / apart[1:])
    assert orders.min() > 1.95
