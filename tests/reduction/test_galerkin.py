"""Galerkin projection: exact limits, classes of constraints, hard cases, and the sizes and errors
of example 2.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import null_space

from fmbs_skfem import reduction
from fmbs_skfem.bodies import body, sections
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs
from fmbs_skfem.dynamics.outputs import lifted
from fmbs_skfem.reduction.spaces import component, galerkin, pod
from fmbs_skfem.reduction.spaces.pod import Basis
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.system import linear_part
from tests import models
from tests.reduction.conftest import (
    NEWTON,
    SCHEME,
    Full,
    Reduced,
    error,
    full_of,
    reduced,
    strain_energy,
)


def complete(system: System, components: dict[str, tuple[str, ...]]) -> dict[str, Basis]:
    """Bases of all motions that satisfy the linear constraints inside each component."""
    found = {}
    for name, members in components.items():
        rows = component.rows_of(system, members)
        inner, _ = component.inner_constraints(system, rows)
        found[name] = Basis(
            null_space(inner) if len(inner) else np.eye(len(rows)), system.x0[rows], np.zeros(0)
        )
    return found


@pytest.mark.parametrize("level", [reduction.body_level, reduction.system_level])
@pytest.mark.parametrize("eliminated", [False, True])
def test_a_complete_basis_gives_the_full_model(level: object, eliminated: bool) -> None:
    raw = models.double_pendulum(4, all_multipliers=True)
    components = level(raw)  # type: ignore[operator]
    system = reduction.reduce_system(
        raw, components, complete(raw, components), eliminate=eliminated
    )
    # with 1e-12 dense factors leave 3.7e-9 of the motion, those of the full model 4e-10
    full, other = (
        integrate(s, SCHEME, 0.5, Newton(tolerance=1e-13), every=10)
        for s in (eliminate(raw), system)
    )
    assert system.size == raw.size - (3 if len(components) == 2 and not eliminated else 6)
    assert reduction.compare(full, other).maximum < 2e-9  # 1000 steps of tolerance 1e-13


def test_modes_and_errors_of_example_2(
    example_2: Full, by_component: Reduced, by_system: Reduced
) -> None:
    # 23 + 23 and 41 in an independent implementation, errors 9.6e-5 and 7.0e-5; the kept state may
    # cost a mode
    sizes = [b.modes.shape[1] for b in by_component.bases.values()]
    assert np.abs(np.subtract(sizes, 23)).max() <= 2
    assert abs(by_system.system.size - 41) <= 2
    assert error(example_2, by_component.system) < 1.2e-4
    assert error(example_2, by_system.system) < 1.2e-4


def test_the_initial_state_is_represented(by_component: Reduced, example_2: Full) -> None:
    assert np.abs(by_component.system.lift(by_component.system.x0) - example_2.raw.x0).max() < 1e-14


def test_errors_fall_with_the_tolerance(coarse: Full) -> None:
    errors = []
    for exponent in (8, 10, 12, 14, 16, 18):
        model = reduced(coarse, reduction.body_level(coarse.raw), 10.0**-exponent)
        assert model.system.constraints.names == (("B", "x"), ("B", "y"), ("B", "z"))
        errors.append(error(coarse, model.system))
    assert errors[0] < 6e-2
    assert all(later < earlier for earlier, later in pairwise(errors)), errors
    assert errors[2] < 2e-4
    assert errors[-1] < 1e-6


def test_rows_that_look_like_zero_are_dropped_by_structure(coarse: Full) -> None:
    raw = coarse.raw
    noisy = replace(
        coarse.data,
        q=coarse.data.q + 1e-9 * np.random.default_rng(0).standard_normal(coarse.data.q.shape),
    )
    for level, left in ((reduction.body_level, {"B"}), (reduction.system_level, set())):
        components = level(raw)
        bases = reduction.bases(raw, noisy, components, 1e-18)
        system = reduction.reduce_system(raw, components, bases)
        assert {joint for joint, _ in system.constraints.names} == left
        _, A, a = linear_part(raw)
        names = np.array([joint for joint, _ in raw.constraints.names])
        dropped = ~np.isin(names, list(left))
        x = np.random.default_rng(1).standard_normal((system.size, 5))
        gaps = (
            A[np.flatnonzero(dropped)] @ (system.lift.matrix @ x + system.lift.offset[:, None])
            + a[dropped, None]
        )
        assert np.abs(gaps).max() < 1e-12


def test_eliminated_interfaces_give_the_same_motion(coarse: Full) -> None:
    components = reduction.body_level(coarse.raw)
    kept, free = (reduced(coarse, components, eliminate=flag).system for flag in (False, True))
    assert free.size == kept.size - 3
    assert not free.constraints.names
    one, two = (integrate(s, SCHEME, 1.0, NEWTON, every=20) for s in (kept, free))
    assert reduction.compare(one, two).maximum < 2e-8  # 2000 steps of tolerance 1e-12


def test_a_basis_too_small_for_its_interfaces_is_refused(coarse: Full) -> None:
    components = reduction.body_level(coarse.raw)
    bases = reduction.bases(coarse.raw, coarse.data, components, modes=3)
    with pytest.raises(
        InputError,
        match=r"component 'I': expected more than 3 modes for its 3 constraints .* got 3 modes",
    ):
        reduction.reduce_system(coarse.raw, components, bases)
    enough = reduction.bases(coarse.raw, coarse.data, components, modes=4)
    assert reduction.reduce_system(coarse.raw, components, enough).size == 8


def test_a_slender_beam_needs_its_initial_state_in_the_basis() -> None:
    thin = sections.Circular(0.003)
    full = full_of(models.double_pendulum(16, section=thin, all_multipliers=True), duration=1.0)
    components = reduction.body_level(full.raw)
    kept = reduced(full, components, 1e-10)
    assert strain_energy(kept.system, kept.system.x0) < 1e-20
    assert error(full, kept.system) < 1e-3

    def plain(tolerance: float) -> System:
        """Reduced with bases that do not keep the initial state."""
        bases = {}
        for name, members in components.items():
            rows = component.rows_of(full.raw, members)
            states = component.satisfy(
                full.data.q[:, rows], *component.inner_constraints(full.raw, rows)
            )
            bases[name] = pod.basis(states.T, tolerance)
        return reduction.reduce_system(full.raw, components, bases)

    # the projected start is strained, and apart in the joints where the tolerance is wide
    spurious = plain(1e-10)
    assert strain_energy(spurious, spurious.x0) > 1e-9
    with pytest.raises(
        SolverError, match=r"the initial state does not satisfy the joints: .*B\."
    ) as caught:
        integrate(plain(1e-8), SCHEME, 0.1)
    assert caught.value.reason is Reason.INCONSISTENT
    assert error(full, reduced(full, components, 1e-8).system) < 2e-2


def test_stiff_beams() -> None:
    stiff = sections.Given(
        EA=100 * 1e9 * np.pi * 0.01**2 / 4,
        EI=1e9 * np.pi * 0.01**4 / 64,
        rhoA=1800 * np.pi * 0.01**2 / 4,
    )
    full = full_of(models.double_pendulum(16, section=stiff, all_multipliers=True), duration=1.0)
    assert error(full, reduced(full, reduction.body_level(full.raw)).system) < 2e-3


def test_large_steps() -> None:
    scheme = GeneralizedAlpha(2.5e-3)
    full = full_of(models.double_pendulum(16, all_multipliers=True), scheme)
    assert error(full, reduced(full, reduction.body_level(full.raw)).system, scheme) < 3e-4


def test_hermite_coordinates_reproduce_the_published_sizes(example_2_hermite: Full) -> None:
    # Hou, Liu, Hu (2020), example 2 with ANCF: 33 + 32 modes, 59 at system level
    full = example_2_hermite
    sizes = {}
    for level in (reduction.body_level, reduction.system_level):
        for name, members in level(full.raw).items():
            rows = component.rows_of(full.raw, members)
            sizes[name] = pod.basis(full.data.q[:, rows].T, 1e-12).modes.shape[1]
    assert abs(sizes["I"] - 33) <= 3
    assert abs(sizes["II"] - 32) <= 3
    assert abs(sizes["system"] - 59) <= 4


def chain(cells: int = 8) -> System:
    """Three planar beams in a row, hung at both ends of the first, free at the last."""
    bodies = [
        body.cable(
            name,
            models.segment(cells, (k, 0, 0), (k + 1, 0, 0)),
            models.SECTION,
            models.MATERIAL,
            dim=2,
        )
        for k, name in enumerate("abc")
    ]
    pins = [
        joints.Pin("ground", At("a", "left")),
        joints.Pin("ab", At("a", "right"), At("b", "left")),
        joints.Pin("bc", At("b", "right"), At("c", "left")),
    ]
    return assemble(bodies, pins, [loads.Gravity((0.0, -9.81))])


def test_a_component_of_several_bodies() -> None:
    full = full_of(chain(), duration=1.0)
    components = {"pair": ("a", "b"), "last": ("c",)}
    classes = galerkin.classify(full.raw, components)
    names = [full.raw.constraints.names[k][0] for k in classes.linking]
    assert names == ["bc", "bc"]
    assert len(classes.inside) == 4
    assert not len(classes.others)
    model = reduced(full, components)
    assert [name for name, _, _ in model.system.components] == ["pair", "last"]
    assert error(full, model.system) < 1e-4


def test_bodies_belong_to_exactly_one_component(coarse: Full) -> None:
    for components, message in (
        ({"I": ("I",)}, "every body of I, II in exactly one"),
        ({"I": ("I",), "both": ("I", "II")}, "every body of I, II in exactly one"),
    ):
        with pytest.raises(InputError, match=message):
            reduction.reduce_system(coarse.raw, components, {})
    with pytest.raises(InputError, match="bodies among I, II"):
        reduction.bases(coarse.raw, coarse.data, {"x": ("III",)})


def test_a_basis_of_another_mesh_is_refused(coarse: Full, by_component: Reduced) -> None:
    with pytest.raises(InputError, match="component 'I': expected a basis with 102 rows, got 606"):
        reduction.reduce_system(coarse.raw, by_component.components, by_component.bases)


def test_dependent_rows_are_dropped() -> None:
    # both rods have one length, so in a basis of motions common to the two masses one of their
    # constraints implies the other
    masses = [body.point_mass(name, 1.0, np.array([1.0, 0.0])) for name in ("one", "two")]
    rods = [
        joints.RigidLink(f"rod {name}", At(name, "center"), (0.0, 0.0)) for name in ("one", "two")
    ]
    raw = assemble(masses, rods)
    angles = np.linspace(0.0, 1.0, 20)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    data = reduction.Snapshots(angles, np.hstack([circle, circle]))
    components = reduction.system_level(raw)
    bases = {name: pod.basis(data.q.T, 1e-12, keep=data.q[0]) for name in components}
    assert len(reduction.reduce_system(raw, components, bases).constraints.names) == 2
    left = reduction.reduce_system(raw, components, bases, configurations=data.q)
    assert len(left.constraints.names) == 1


def test_snapshots_at_intervals(coarse: Full) -> None:
    run = coarse.run
    every = reduction.snapshots(run, 0.02)
    assert np.allclose(every.times, np.arange(0.0, 3.0 + 1e-9, 0.02))
    assert np.array_equal(every.q, lifted(run)[0][::4])
    assert np.array_equal(reduction.snapshots(run).q, lifted(run)[0])
    for wrong in (0.012, 0.001, 0.0, -0.005):
        with pytest.raises(InputError, match=r"a multiple of the stored interval 0\.005 s"):
            reduction.snapshots(run, wrong)


def test_snapshots_at_listed_times(coarse: Full) -> None:
    run = coarse.run
    wanted = np.array([0.0, 0.005, 0.02, 2.995, 3.0])
    found = reduction.snapshots(run, wanted + 1e-12)
    assert np.array_equal(found.q, lifted(run)[0][[0, 1, 4, 599, 600]])
    for wrong in (np.array([0.0, 0.0125]), np.array([3.1]), np.array([])):
        with pytest.raises(InputError, match="times of stored states"):
            reduction.snapshots(run, wrong)


def test_a_drive_that_has_not_moved_is_no_equation_of_the_modes() -> None:
    """Of its row round-off is left, 1e-14 of the others: kept, it held a combination of all modes
    (a third of the motion).
    """
    root = At("beam", "left")
    beam = body.cable("beam", models.segment(6), models.SECTION, models.MATERIAL, dim=2)
    drive = joints.DrivenPosition("drive", root, (of_time("0*t"), of_time("0.1*sin(20*t)")))
    raw = assemble(
        [beam],
        [drive],
        [loads.Gravity((0.0, -9.81))],
        outputs={"tip": probes.Position(At("beam", "right"))},
    )
    scheme, components = GeneralizedAlpha(1e-3), reduction.body_level(raw)
    full = integrate(eliminate(raw), scheme, 0.3, every=5)
    system = reduction.reduce_system(
        raw, components, reduction.bases(raw, reduction.snapshots(full), components, 1e-10)
    )
    assert [".".join(name) for name in system.constraints.names] == ["drive.y"]
    found, exact = outputs(integrate(system, scheme, 0.3, every=5)), outputs(full)
    assert np.abs(found["tip_y"] - exact["tip_y"]).max() < 5e-3 * np.ptp(exact["tip_y"])
