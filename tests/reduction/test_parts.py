"""Reduced parts: bases of vectors, bodies with few shape functions, and mechanisms that none of
them was trained in.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Body, Material, Rim, cable
from fmbs_skfem.bodies.body import probe
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.dynamics.outputs import lifted
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.reduction import snapshots
from fmbs_skfem.systems import (
    At,
    Motion,
    Rayleigh,
    System,
    assemble,
    change_coordinates,
    check_system,
    compile_system,
    compiled,
    eliminate,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from tests import models
from verification.vibration import ring

SCHEME, SHARP = GeneralizedAlpha(1e-3), Newton(tolerance=1e-12)
DOWN = (0.0, 0.0, -9.81)


@cache
def arm() -> Body:
    """A beam of 16 cells along x from `left` to `right`."""
    return cable("arm", models.segment(16), models.SECTION, models.MATERIAL)


@cache
def motion() -> np.ndarray:
    """States (s, b, c) of the arm that falls about its left end with a mass at the other one."""
    bob = models.body.point_mass("bob", 0.1, np.array([1.0, 0.0, 0.0]))
    held = [joints.Pin("A", At("arm", "left")), joints.Pin("B", At("arm", "right"), At("bob"))]
    forces = [loads.Gravity(DOWN), loads.PointForce("push", At("arm", "right"), (0.0, 0.3, 0.0))]
    found = snapshots(
        integrate(eliminate(assemble([arm(), bob], held, forces)), SCHEME, 0.6, SHARP, 2)
    ).q
    return found[:, : arm().reference.size].reshape(len(found), -1, 3)


@cache
def functions(tolerance: float = 1e-11) -> np.ndarray:
    return parts.shape_functions(arm(), motion(), tolerance)


@cache
def part(eta: float | None = None) -> Body:
    found = parts.reduced_body(arm(), functions())
    return (
        found
        if eta is None
        else parts.sampled(found, parts.coordinates(arm(), functions(), motion()), eta)
    )


@cache
def turn() -> np.ndarray:
    """A rotation (3, 3)."""
    Q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    return np.asarray(Q * np.sign(np.linalg.det(Q)))


def strain_energy(body: Body) -> float:
    """Of the reference."""
    system = assemble([body])
    return compiled.strain_energy(compile_system(system), system.x0)


def two(made: Body, weight: np.ndarray, R: np.ndarray, other: bool = False) -> System:
    """A double pendulum of one part twice in the directions (x, y) of the turned axes R, hung at
    I.left, or at II.right.
    """
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    bodies = [parts.placed(made, "I", rotation=R), parts.placed(made, "II", R[:, 0], R @ quarter)]
    hung, free = (
        (At("II", "right"), At("I", "left")) if other else (At("I", "left"), At("II", "right"))
    )
    held = [joints.Pin("A", hung), joints.Pin("B", At("I", "right"), At("II", "left"))]
    return eliminate(
        assemble(
            bodies, held, [loads.Gravity(tuple(weight))], outputs={"free": probes.Position(free)}
        )
    )


def path(run: Trajectory) -> np.ndarray:
    """Positions (s, c) of the free end."""
    values = outputs(run)
    return np.stack([values[f"free_{axis}"] for axis in "xyz"], axis=1)


def test_the_basis_holds_the_field_one_and_the_reference_and_is_as_accurate_as_asked_for() -> None:
    S, W = functions(), parts.metric(arm())
    fields = np.column_stack([arm().constant, arm().reference])
    states = np.moveaxis(motion(), 0, 1).reshape(len(fields), -1)
    found = S @ np.linalg.solve(S.T @ (W @ S), S.T @ (W @ np.column_stack([fields, states])))
    assert_allclose(found[:, :4], fields, atol=1e-13)
    deviation = states - np.outer(
        arm().constant, arm().constant @ (W @ states) / (arm().constant @ (W @ arm().constant))
    )
    rest = found[:, 4:] - states
    assert np.sum(rest * (W @ rest)) <= 1e-11 * np.sum(deviation * (W @ deviation))
    assert S.shape[1] <= 9


def test_positions_at_places_are_coordinates_and_the_others_vanish_there() -> None:
    for number, place in enumerate(("left", "right")):
        row = probe(part(), part().places[place])
        assert (row.nnz, row.data[0], row.indices[0]) == (1, 1.0, number)
    assert_allclose((as_dense(part().mass)[2:, :2]), 0.0, atol=1e-13 * as_dense(part().mass).max())


@pytest.mark.parametrize("eta", [None, 1e-3])
def test_a_system_of_reduced_bodies_keeps_the_contract(eta: float | None) -> None:
    held = [
        joints.Weld("weld", At("I", "right"), At("II", "left")),
        joints.Pin("pin", At("I", "left")),
    ]
    bodies = [
        replace(part(eta), name="I"),
        parts.placed(part(eta), "II", np.array([1.0, 0.0, 0.0])),
    ]
    system = assemble(bodies, held, [loads.Gravity(DOWN)], Rayleigh(0.1, 1e-3))
    check_system(system)
    check_system(eliminate(system))


def test_many_reduced_bodies_keep_the_contract_in_a_band() -> None:
    places = [np.array([float(k), 0.0, 0.0]) for k in range(12)]
    bodies = [parts.placed(part(1e-3), f"{k}", place) for k, place in enumerate(places)]
    held = [joints.Pin(f"{k}", At(f"{k}", "right"), At(f"{k + 1}", "left")) for k in range(11)]
    system = eliminate(
        assemble(bodies, [joints.Pin("root", At("0", "left")), *held], [loads.Gravity(DOWN)])
    )
    assert not compile_system(system).arrays.dense
    check_system(system)


def test_the_kronecker_form_equals_dense_rows() -> None:
    system = assemble([part()], damping=Rayleigh(0.0, 1e-3))
    dense = change_coordinates(system, np.eye(system.size), np.zeros(system.size))
    random = np.random.default_rng(0)
    x, v = system.x0 + 0.01 * random.normal(size=system.size), random.normal(size=system.size)
    one, other = compile_system(system), compile_system(dense)
    f = compiled.forces(one, x, v)
    assert_allclose(f, compiled.forces(other, x, v), atol=1e-12 * np.abs(f).max())
    K = as_dense(compiled.tangent(one, x, np.zeros(0), gh=0.2))
    assert_allclose(
        K, as_dense(compiled.tangent(other, x, np.zeros(0), gh=0.2)), atol=1e-12 * np.abs(K).max()
    )
    assert_allclose(compiled.strain_energy(one, x), compiled.strain_energy(other, x), rtol=1e-13)


def test_forces_of_sampled_points_are_as_good_as_asked_for_in_the_energy_of_what_they_move() -> (
    None
):
    """Measured by the compliance of every state, so that a beam's small bending forces count beside
    its large axial ones.
    """
    full, few = part(), part(1e-3)
    z = parts.coordinates(arm(), functions(), motion()).reshape(len(motion()), -1)
    systems = [compile_system(assemble([one])) for one in (full, few)]
    f, g = (np.array([compiled.forces(one, state, 0.0 * state) for state in z]) for one in systems)
    measure = parts.compliance(compile_system(assemble([full])))(z)
    error, whole = (np.einsum("sij,sj->si", measure, one) for one in (g - f, f))
    assert np.linalg.norm(error) <= 1e-3 * np.linalg.norm(whole)
    assert few.shapes is not None
    assert full.shapes is not None
    assert few.shapes.table.shape[1] < 0.5 * full.shapes.table.shape[1]


@pytest.mark.parametrize("eta", [None, 1e-3])
def test_rigid_motions_cost_nothing(eta: float | None) -> None:
    bent = replace(
        part(eta),
        reference=part(eta).reference
        + 0.02 * np.sin(np.arange(part(eta).reference.size)).reshape(-1, 3),
    )
    for R in (turn(), np.diag([-1.0, -1.0, 1.0])):
        assert strain_energy(
            parts.placed(part(eta), "arm", np.array([3.0, -2.0, 1.0]), R)
        ) <= 1e-20 * strain_energy(bent)
        assert strain_energy(parts.placed(bent, "arm", None, R)) == pytest.approx(
            strain_energy(bent), rel=1e-10
        )


@pytest.mark.parametrize("eta", [None, 1e-3])
def test_a_turned_scene_moves_alike_to_round_off(eta: float | None) -> None:
    straight = integrate(two(part(eta), np.array(DOWN), np.eye(3)), SCHEME, 0.3, SHARP)
    turned = integrate(two(part(eta), turn() @ DOWN, turn()), SCHEME, 0.3, SHARP)
    assert_allclose(path(turned) @ turn(), path(straight), atol=1e-9)


@pytest.mark.filterwarnings("ignore:part 'I.*outside since")
@pytest.mark.parametrize("other", [False, True])
@pytest.mark.parametrize("weight", [DOWN, (0.0, -6.9, 6.9)])
def test_a_part_trained_as_a_pendulum_swings_in_a_double_pendulum(
    other: bool, weight: tuple[float, ...]
) -> None:
    made = (arm(), part(), part(1e-3))
    full, reduced, small = (
        integrate(two(one, np.array(weight), np.eye(3), other), SCHEME, 0.5, SHARP) for one in made
    )
    assert np.linalg.norm(path(full)[-1] - path(full)[0]) > 0.5
    assert np.linalg.norm(path(reduced) - path(full), axis=1).max() < 2e-4
    assert np.linalg.norm(path(small) - path(full), axis=1).max() < 4e-4
    assert len(part(1e-3).shapes.cell) < len(part().shapes.cell)  # type: ignore[union-attr]


def test_momentum_and_energy_of_a_free_flying_part() -> None:
    """Linear momentum is kept to round-off, angular momentum and energy as well as the scheme does:
    their drift falls with h^2.
    """
    start = {"arm": Motion((0.3, 0.0, 0.1), (0.5, 4.0, 2.0))}
    system = assemble([part(1e-3)], outputs={"energy": probes.Energy()}, initial=start)
    drifts = []
    for h in (2e-3, 1e-3):
        run = integrate(system, GeneralizedAlpha(h, rho_inf=1.0), 0.4, SHARP)
        q, rate, _ = lifted(run)
        x, p = q.reshape(len(q), -1, 3), (rate @ system.mass).reshape(len(q), -1, 3)
        linear, angular = np.einsum("b,sbc->sc", part().constant, p), np.cross(x, p).sum(axis=1)
        assert_allclose(
            linear, linear[:1].repeat(len(q), axis=0), atol=1e-10 * np.abs(linear).max()
        )
        energy = outputs(run)["energy_balance"]
        drifts.append(
            (
                np.abs(angular - angular[0]).max() / np.linalg.norm(angular[0]),
                np.ptp(energy) / energy[0],
            )
        )
    (a, e), (b, f) = drifts
    assert a / b == pytest.approx(4.0, abs=0.5)
    assert e / f == pytest.approx(4.0, abs=0.8)
    assert max(b, f) < 1e-4


def test_rims_of_a_reduced_plate_are_places_and_its_frames_stay_orthonormal() -> None:
    """A ring in the plane, pulled at its outer rim, turns about its inner one."""
    steel = Material(young_modulus=2e8, density=7800.0, poisson_ratio=0.3)
    rims = {"hub": Rim(("inner",), (0.0, 0.0))}
    full = plate("ring", ring(0.1, 0.3), 0.01, steel, dim=2, rims=rims)

    def scene(body: Body) -> System:
        hinge = joints.Pin("hinge", At("ring", "hub"))
        forces = [loads.Gravity((0.0, -9.81)), loads.Torque("motor", At("ring", "hub"), 200.0)]
        seen = {"angle": probes.Angle(At("ring", "hub")), "axis": probes.Slope(At("ring", "hub"))}
        return eliminate(assemble([body], [hinge], forces, outputs=seen))

    run = integrate(scene(full), SCHEME, 0.1, SHARP)
    states = snapshots(run).q.reshape(len(run.times), -1, 2)
    S = parts.shape_functions(full, states, 1e-14)
    body = parts.reduced_body(full, S)
    reduced = integrate(scene(body), SCHEME, 0.1, SHARP)
    seen, wanted = outputs(reduced), outputs(run)
    assert wanted["angle"][-1] > 0.5
    assert len(S.T) < 0.5 * len(S)
    assert_allclose(seen["angle"], wanted["angle"], atol=1e-5 * wanted["angle"][-1])
    # fewer functions than rows of its frame
    few = scene(parts.reduced_body(full, parts.shape_functions(full, states, None, 3)))
    assert_allclose(few.x0.reshape(-1, 2).shape, (2, 2))
    with pytest.raises(
        InputError, match="at least 3 modes, which hold the fields that are kept, got 2"
    ):
        parts.shape_functions(full, states, None, 2)
    assert_allclose(np.hypot(seen["axis_x"], seen["axis_y"]), 1.0, atol=1e-10)


def test_what_cannot_be_a_part_is_refused_with_the_reason() -> None:
    with pytest.raises(InputError, match="a mirrored part is another part"):
        parts.placed(part(), "arm", rotation=np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(InputError, match=r"shape functions over its .* functions, got over"):
        parts.reduced_body(part(), functions())
    with pytest.raises(InputError, match="reduce it first"):
        parts.sampled(arm(), motion())
    with pytest.raises(InputError, match="hold the reference and the field 1"):
        parts.reduced_body(arm(), functions()[:, 2:])
