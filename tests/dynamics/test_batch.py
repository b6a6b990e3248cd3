"""Members that advance together against single runs: the same motion, the same steps, and errors that stay with their member."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import null_space

from fmbs_skfem.bodies import body, laws, sections
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, array_laws, array_step, arrays, integrate
from fmbs_skfem.dynamics.arrays import integrate_arrays
from fmbs_skfem.dynamics.batch import integrate_many, prepared
from fmbs_skfem.reduction import galerkin
from fmbs_skfem.reduction.pod import Basis
from fmbs_skfem.systems import At, Rayleigh, System, assemble, eliminate, joints, loads

from .. import models

FORMS = pytest.mark.parametrize("many", [integrate_many, integrate_arrays], ids=["compiled", "arrays"])
SCHEME, NEWTON = GeneralizedAlpha(5e-4), Newton(tolerance=1e-12)


def complete(raw: System) -> System:
    """A full system in a dense basis of all motions that its inner constraints allow."""
    components = galerkin.body_level(raw)
    found = {}
    for name, members in components.items():
        rows = galerkin.rows_of(raw, members)
        inner, _ = galerkin.inner_constraints(raw, rows)
        found[name] = Basis(null_space(inner) if len(inner) else np.eye(len(rows)), raw.x0[rows], np.zeros(0))
    return galerkin.reduce_system(raw, components, found)


def pendulum(E: float = 1e9, diameter: float = 0.01, gravity: float = 9.81, beta: float = 0.0) -> System:
    """Example 2 on 3 cells a beam in a complete basis: 40 unknowns and 3 multipliers."""
    section, material = sections.Circular(diameter), sections.Material(E, 1800.0)
    first = body.cable("I", models.straight(3), section, material)
    second = body.cable("II", models.straight(3, (1, 0, 0), (1, 1, 0)), section, material)
    held = [joints.Pin("A", At("I", "left")), joints.Pin("B", At("I", "right"), At("II", "left"))]
    damping = Rayleigh(0.1, beta) if beta else None
    return complete(assemble([first, second], held, [loads.Gravity((0, 0, -gravity))], damping))


def driven(rate: float, growth: float = 0.0, end: float = np.inf) -> System:
    """Planar beam on 4 cells, turned by a driven angle; the force at its tip may grow, and is no number after `end`."""
    beam = body.cable("beam", models.straight(4), models.SECTION, models.MATERIAL, dim=2)
    root, tip = At("beam", "left"), At("beam", "right")
    held: list[joints.Joint] = [joints.Pin("pin", root), joints.DrivenAngle("drive", root, lambda t: rate * t**3)]

    def history(t: np.ndarray) -> np.ndarray:
        return np.where(t > end, np.nan, np.sin(rate * t) * np.exp(growth * t))

    push = loads.PointForce("push", tip, (0.0, 0.02), history)
    return complete(assemble([beam], held, [push]))


def suited(many: object, systems: list[System]) -> list[System]:
    """The form over arrays assembles all tangents: parts with the name of no body have no turned ones in the other forms either."""
    if many is integrate_many:
        return systems
    return [replace(one, elastic=tuple(replace(part, name=f"{part.name} part") for part in one.elastic)) for one in systems]


@cache
def pendulums() -> tuple[System, ...]:
    """Members with different stiffness, section and gravity."""
    values = [(1e9, 0.01, 9.81), (0.7e9, 0.01, 9.81), (1.3e9, 0.012, 9.0), (1e9, 0.008, 12.0), (2e9, 0.01, 5.0)]
    return tuple(pendulum(*row) for row in values)


@cache
def alone(duration: float) -> tuple[Trajectory, ...]:
    return tuple(integrate(system, SCHEME, duration, NEWTON, every=20) for system in pendulums())


def assert_same(found: object, wanted: Trajectory, tolerance: float = 1e-10) -> None:
    """The same steps and corrections, and equal motion relative to the largest coordinates."""
    assert isinstance(found, Trajectory)
    one, other = found.statistics, wanted.statistics
    assert (one.steps, one.iterations, one.factorisations) == (other.steps, other.iterations, other.factorisations)
    np.testing.assert_array_equal(found.times, wanted.times)
    for name in ("x", "v"):
        size = np.abs(getattr(wanted, name)).max()
        np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), rtol=0, atol=tolerance * size)
    size = np.abs(wanted.multipliers).max(initial=0.0)
    np.testing.assert_allclose(found.multipliers, wanted.multipliers, rtol=0, atol=1e3 * tolerance * size)


@FORMS
def test_members_move_as_if_they_were_alone(many: object) -> None:
    """Stiffness, section and gravity differ; one step's worth of round-off is 1e-15 of x, and 1e-12 of v."""
    found = many(pendulums(), SCHEME, 0.2, NEWTON, every=20)  # type: ignore[operator]
    moved = [np.abs(wanted.x[-1] - wanted.x[0]).max() for wanted in alone(0.2)]
    assert min(moved) > 1e-2
    for one, wanted in zip(found, alone(0.2), strict=True):
        assert_same(one, wanted)


@FORMS
def test_driven_joints_and_loads_with_histories(many: object) -> None:
    """The two agree to the error that Newton's tolerance leaves in either, which a hundredth of it shows."""
    systems, every = suited(many, [driven(rate) for rate in (3.0, 5.0, 8.0)]), np.array([100, 250, 600])
    found = many(systems, SCHEME, 0.3, NEWTON, every=every)  # type: ignore[operator]
    sharp = replace(NEWTON, tolerance=0.01 * NEWTON.tolerance)
    for one, system in zip(found, systems, strict=True):
        wanted, exact = (integrate(system, SCHEME, 0.3, newton, every=every) for newton in (NEWTON, sharp))
        for name in ("x", "v", "multipliers"):
            left = np.abs(getattr(wanted, name) - getattr(exact, name)).max()
            assert 0.0 < left < 1e-5 * np.abs(getattr(wanted, name)).max()
            np.testing.assert_allclose(getattr(one, name), getattr(wanted, name), rtol=0, atol=left)
    assert found[0].times.tolist() == pytest.approx([0.0, 0.05, 0.125, 0.3])


@FORMS
@pytest.mark.parametrize("step", [2e-3, 1e-3])
def test_second_order_in_the_step(many: object, step: float) -> None:
    """Errors of the tip against a step of h / 8 fall by four when the step is halved."""
    exact = integrate(driven(4.0), GeneralizedAlpha(step / 8), 0.4, NEWTON, every=np.array([round(3.2 / step)]))
    errors = []
    for h in (step, step / 2):
        motion = many([driven(4.0)] * 2, GeneralizedAlpha(h), 0.4, NEWTON, every=np.array([round(0.4 / h)]))[1]  # type: ignore[operator]
        errors.append(np.abs(motion.x[-1] - exact.x[-1]).max())
    # with the reference at h/8 the ratio of a second-order method is (1 - 1/64) / (1/4 - 1/64) = 4.2
    assert errors[0] / errors[1] == pytest.approx(4.2, rel=0.05)


@FORMS
def test_every_member_may_have_its_own_step(many: object) -> None:
    """Two step sizes with equal numbers of steps advance together; the duration is that of each member."""
    schemes = [GeneralizedAlpha(5e-4, 0.8), GeneralizedAlpha(5e-4, 0.2)]
    systems = suited(many, [driven(3.0), driven(4.0)])
    found = many(systems, schemes, 0.1, NEWTON, every=50)  # type: ignore[operator]
    for one, system, scheme in zip(found, systems, schemes, strict=True):
        assert_same(one, integrate(system, scheme, 0.1, NEWTON, every=50))


def test_members_with_other_numbers_of_steps_form_their_own_block() -> None:
    schemes = [GeneralizedAlpha(h) for h in (1e-3, 5e-4, 1e-3, 5e-4)]
    found = integrate_many([driven(3.0)] * 4, schemes, 0.1, NEWTON, every=50)
    assert [len(one.times) for one in found] == [3, 5, 3, 5]  # type: ignore[union-attr]
    np.testing.assert_array_equal(found[0].x, found[2].x)  # type: ignore[union-attr]


@FORMS
def test_a_member_that_fails_does_not_hurt_the_others(many: object) -> None:
    """A force that grows e-fold every 0.5 ms ends its member with the error of a single run; the others do not notice."""
    systems = suited(many, [driven(3.0), driven(3.0, 2000.0), driven(5.0)])
    found = many(systems, GeneralizedAlpha(1e-3), 0.4, every=10)  # type: ignore[operator]
    with pytest.raises(SolverError) as caught:
        integrate(systems[1], GeneralizedAlpha(1e-3), 0.4, every=10)
    wanted, error = caught.value, found[1]
    assert isinstance(error, SolverError)
    assert {error.reason, wanted.reason} <= {Reason.NOT_CONVERGED, Reason.DIVERGED}  # at 1e10 m the last bits decide which part of
    assert error.time == pytest.approx(wanted.time, abs=1e-3)  # the step fails first, and how
    assert error.worst[0][0] == wanted.worst[0][0]
    np.testing.assert_array_equal(error.partial.times, wanted.partial.times)
    np.testing.assert_allclose(error.partial.x, wanted.partial.x, atol=1e-6)
    for k in (0, 2):
        assert_same(found[k], integrate(systems[k], GeneralizedAlpha(1e-3), 0.4, every=10), 1e-9)


@FORMS
def test_a_history_that_is_no_number_ends_its_member(many: object) -> None:
    """From a time on, where the motion up to there is kept, or from the beginning, where there is no start."""
    systems = [driven(3.0), driven(3.0, end=0.0305), driven(5.0), driven(np.nan)]
    found = many(systems, GeneralizedAlpha(1e-3), 0.05)  # type: ignore[operator]
    assert [type(one) for one in found] == [Trajectory, SolverError, Trajectory, SolverError]
    assert [found[k].reason for k in (1, 3)] == [Reason.NOT_FINITE] * 2
    assert [len(motion.times) for motion in (found[0], found[1].partial, found[2])] == [51, 31, 51]


def test_a_step_that_fails_is_halved_for_its_member() -> None:
    """Example 2 with 40 times its step: the same steps are halved as in a single run."""
    scheme, newton = GeneralizedAlpha(0.02), Newton(tolerance=1e-12)
    single = [integrate(system, scheme, 0.6, newton) for system in pendulums()[:3]]
    assert max(one.statistics.halved for one in single) > 0
    for found, wanted in zip(integrate_many(pendulums()[:3], scheme, 0.6, newton), single, strict=True):
        assert found.statistics.halved == wanted.statistics.halved  # type: ignore[union-attr]
        assert_same(found, wanted, 1e-8)


def test_stiffness_proportional_damping() -> None:
    systems = [pendulum(beta=beta) for beta in (1e-3, 2e-3)]
    for found, system in zip(integrate_many(systems, SCHEME, 0.1, NEWTON, every=20), systems, strict=True):
        assert_same(found, integrate(system, SCHEME, 0.1, NEWTON, every=20))


def test_members_of_other_structure_run_alone() -> None:
    """Full models, other bases and reduced models in one list, in their order, in two threads."""
    full = eliminate(models.double_pendulum(3))
    systems = [full, pendulums()[0], driven(3.0), pendulums()[1], driven(4.0)]
    done: list[float] = []
    found = integrate_many(systems, SCHEME, 0.02, NEWTON, threads=2, progress=done.append)
    for one, system in zip(found, systems, strict=True):
        assert_same(one, integrate(system, SCHEME, 0.02, NEWTON))
    assert done == sorted(done)
    assert done[-1] == 1.0


def test_more_members_than_a_block_holds() -> None:
    """Blocks and threads change nothing: 40 members, of which every one is a copy of one of five."""
    systems = [pendulums()[k % 5] for k in range(40)]
    found = integrate_many(systems, SCHEME, 0.02, NEWTON, threads=2)
    for k, one in enumerate(found):
        np.testing.assert_allclose(one.x, found[k % 5].x, rtol=0, atol=1e-13)  # type: ignore[union-attr]


@FORMS
def test_no_members_and_wrong_arguments(many: object) -> None:
    assert many([], SCHEME, 1.0) == []  # type: ignore[operator]
    with pytest.raises(InputError, match="schemes"):
        many(pendulums()[:2], [SCHEME], 0.1)  # type: ignore[operator]
    with pytest.raises(InputError, match="at least one step"):
        many([pendulums()[0]], SCHEME, 1e-5)  # type: ignore[operator]


def test_no_threads_are_refused() -> None:
    with pytest.raises(InputError, match="threads"):
        integrate_many(pendulums()[:2], SCHEME, 0.1, threads=0)


def test_what_is_not_written_over_arrays_is_refused() -> None:
    end = At("beam", "right")
    follower = complete(models.cantilever(4, lambda tip: [loads.Follower("P", end, (0.0, 1.0))], all_multipliers=True))
    refused = {
        "sampled points": [eliminate(models.double_pendulum(3))],
        "stiffness-proportional": [pendulum(beta=1e-3)],
        "tangential": [follower],
        "same basis": [pendulums()[0], driven(3.0)],
    }
    for text, systems in refused.items():
        with pytest.raises(InputError, match=text):
            integrate_arrays(systems, SCHEME, 0.01)


def test_a_namespace_of_single_precision_is_refused() -> None:
    single = SimpleNamespace(asarray=lambda numbers: np.asarray(numbers, dtype=np.float32))
    with pytest.raises(InputError, match="jax_enable_x64"):
        integrate_arrays(pendulums()[:1], SCHEME, 0.01, xp=single)


def test_a_singular_matrix_is_that_of_its_member() -> None:
    """A member without mass and stiffness has no inverse; those of the others are the same as without it."""
    entries = [prepared(k, pendulums()[k], SCHEME, 10) for k in range(3)]
    structure, data = arrays.flattened([entry for entry in entries if entry], NEWTON, np)
    left = np.array([1.0, 0.0, 1.0])[:, None, None]
    groups = tuple(group._replace(section=left * group.section) for group in data.groups)
    broken = data._replace(mass=left * data.mass, groups=groups)
    functions = arrays.Functions(*(lambda *a, rule=rule: rule(structure, *a) for rule in arrays.RULES))
    x = np.stack([system.x0 for system in pendulums()[:3]])
    q, signals = array_step.Trial(x, 0 * x, 0 * x, np.zeros((3, 3))), np.ones((3, data.terms.shape[1]))
    found = arrays.renewed(functions, np, broken, np.zeros((3, x.shape[1] + 3, x.shape[1] + 3)), q, signals, np.ones(3, dtype=bool))
    assert np.isnan(found[1]).all()
    np.testing.assert_allclose(found[[0, 2]], array_step.inverses(structure, data, q, signals)[[0, 2]], rtol=1e-12)


@pytest.mark.parametrize(
    "law,dim", [(k, c) for k in (Law.QUADRATIC, Law.MATERIAL, Law.EXACT) for c in (2, 3)] + [(Law.MEMBRANE, 2)]
)
def test_laws_over_arrays_are_the_compiled_laws(law: Law, dim: int) -> None:
    rng = np.random.default_rng(3)
    u, section = rng.normal(size=(3, 2, dim, 5)), rng.random((3, laws.rows(law), 5))
    S, D = array_laws.stress(np, law, u, section), array_laws.modulus(np, law, u, section)
    for b in range(3):
        jets, rows = np.ascontiguousarray(u[b].reshape(-1, 1, 5)), np.ascontiguousarray(section[b][:, None])
        stress, modulus = np.zeros_like(jets), np.zeros((len(jets), *jets.shape))
        laws.stress(int(law), jets, jets, 0.0, rows, stress)
        laws.modulus(int(law), jets, 0.0, rows, modulus)
        np.testing.assert_allclose(S[b].reshape(jets.shape), stress, rtol=0, atol=1e-13 * np.abs(stress).max())
        np.testing.assert_allclose(D[b].reshape(modulus.shape), modulus, rtol=0, atol=1e-13 * np.abs(modulus).max())


def test_the_same_code_runs_on_jax() -> None:
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    found = integrate_arrays(pendulums()[:3], SCHEME, 0.02, NEWTON, xp=jax.numpy, compiled=jax.jit)
    for one, system in zip(found, pendulums()[:3], strict=True):
        assert_same(one, integrate(system, SCHEME, 0.02, NEWTON))
