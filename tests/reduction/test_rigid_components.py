"""Components of rigid bodies keep all their directions: platforms on cables and sliders need no
components of their own making.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem import reduction
from fmbs_skfem.bodies import body
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.reduction import body_level
from fmbs_skfem.reduction.spaces import component, galerkin, kept_rows, pod
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from .. import models

STEP, TIGHT = GeneralizedAlpha(1e-3), Newton(tolerance=1e-11)


def platform() -> System:
    """A platform on three parallel cables, pushed aside: it moves on a sphere and hardly turns."""
    return models.platform(12, np.diag([0.02, 0.02, 0.03]), (3.0, 1.0, 0.0))


def slider() -> System:
    """A beam whose tip carries a mass on a rail."""
    beam = body.cable("beam", models.segment(20), models.SECTION, models.MATERIAL, dim=2)
    parts = [beam, body.point_mass("slider", 0.5, np.array([1.0, 0.0]))]
    held = [
        joints.Pin("root", At("beam", "left")),
        joints.Pin("tip", At("beam", "right"), At("slider", "center")),
        joints.Slider("rail", At("slider", "center"), (1.0, 0.0)),
    ]
    return assemble(parts, held, [loads.Gravity((0.0, -9.81))])


@functools.cache
def full(make: object) -> tuple[System, galerkin.Snapshots, object]:
    raw = make()  # type: ignore[operator]
    motion = integrate(eliminate(raw), STEP, 0.3, TIGHT)
    return raw, reduction.snapshots(motion, 5e-3), motion


@pytest.mark.parametrize(
    "make,rigid_modes", [(platform, {"platform": 12}), (slider, {"slider": 1})]
)
@pytest.mark.parametrize("together", [True, False])
def test_rigid_bodies_keep_their_directions(
    make: object, rigid_modes: dict[str, int], together: bool
) -> None:
    """Twelve coordinates of a body in space, one of a mass on a rail; the reduced motion is as good
    as its basis of the beams.
    """
    raw, data, motion = full(make)
    parts = body_level(raw)
    found = reduction.bases(raw, data, parts, 1e-12)
    for name, count in rigid_modes.items():
        modes = found[name].modes
        assert modes.shape[1] == count
        W = component.metric_of(raw, component.rows_of(raw, (name,)))
        np.testing.assert_allclose(modes.T @ (W @ modes), np.eye(count), atol=1e-13)
    small = reduction.reduce_system(raw, parts, found, together, data.q)
    assert small.size < raw.size
    assert reduction.compare(motion, integrate(small, STEP, 0.3, TIGHT)).maximum < 2e-5  # type: ignore[arg-type]


def swinging() -> System:
    """A cantilever from whose tip a rigid bar swings in space."""
    beam = body.cable("beam", models.segment(20), models.SECTION, models.MATERIAL)
    bar = rigid(
        "bar", 0.2, np.diag([1e-4, 4e-3, 4e-3]), (1.25, 0.0, 0.0), places={"end": (1.0, 0.0, 0.0)}
    )
    held = [
        joints.Pin("root", At("beam", "left")),
        joints.Pin("tip", At("beam", "right"), At("bar", "end")),
    ]
    return assemble([beam, bar], held, [loads.Gravity((0.0, 2.0, -9.81))])


@pytest.mark.parametrize("invariant", [False, True])
def test_a_rigid_body_keeps_its_directions_beside_a_flexible_one(invariant: bool) -> None:
    """In one component: few modes of the training do not let it deform, all six rows of its frame
    are there, and hold.
    """
    raw, data, motion = full(swinging)
    together = {"all": ("beam", "bar")}
    found = reduction.bases(raw, data, together, 1e-8, invariant=invariant)
    small = reduction.reduce_system(raw, together, found, True, data.q)
    assert sum(name[0] == "bar.frame" for name in small.constraints.names) == 6
    run = integrate(small, STEP, 0.3, TIGHT)
    assert reduction.compare(motion, run).maximum < 3e-4  # type: ignore[arg-type]
    last = next(first for name, first, _ in small.coordinates if name == "bar")
    axes = np.asarray([small.lift(x) for x in run.x])[:, last + 3 : last + 12].reshape(-1, 3, 3)
    np.testing.assert_allclose(
        axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=1e-9
    )
    assert np.abs(axes[-1] - axes[0]).max() > 0.05


def test_the_rigid_directions_are_those_of_the_joints_inside() -> None:
    """The mass on its rail moves along x alone."""
    raw, data, _ = full(slider)
    modes = reduction.bases(raw, data, body_level(raw), 1e-12)["slider"].modes
    np.testing.assert_allclose(modes[:, 0] / modes[0, 0], [1.0, 0.0], atol=1e-15)


def test_a_mechanism_of_rigid_bodies_is_its_own_reduced_model() -> None:
    """One body turns, another one stands still on the ground: nothing is left out at either level."""
    parts = [
        rigid("crank", 1.0, 1e-2, (0.1, 0.0), dim=2, places={"A": (0.0, 0.0), "B": (0.2, 0.0)}),
        rigid("block", 1.0, 1e-2, (1.0, 0.0), dim=2),
        body.point_mass("tip", 0.5, np.array([0.2, 0.0])),
    ]
    held = [
        joints.Revolute("A", At("crank", "A")),
        joints.Weld("hold", At("block", "frame")),
        joints.Pin("B", At("crank", "B"), At("tip", "center")),
    ]
    raw = assemble(parts, held, [loads.Gravity((0.0, -9.81))])
    motion = integrate(eliminate(raw), STEP, 0.3, TIGHT)
    data = reduction.snapshots(motion, 5e-3)
    for components in (body_level(raw), {"all": tuple(body_level(raw))}):
        small = reduction.reduce_system(
            raw, components, reduction.bases(raw, data, components, 1e-12), True, data.q
        )
        assert reduction.compare(motion, integrate(small, STEP, 0.3, TIGHT)).maximum < 1e-8


def test_a_rigid_body_with_fewer_directions_is_refused() -> None:
    """Its axes stay orthonormal: what a few modes of it can do hangs on round-off."""
    raw, data, _ = full(platform)
    found = reduction.bases(raw, data, body_level(raw), 1e-12)
    rows = component.rows_of(raw, ("platform",))
    few = pod.basis(data.q[:, rows].T, 1e-10)
    assert few.modes.shape[1] < 12
    with pytest.raises(
        InputError,
        match=r"'platform': expected all 12 directions of its rigid bodies, got \d modes",
    ):
        reduction.reduce_system(raw, body_level(raw), found | {"platform": few})


def test_noise_of_the_snapshots_costs_no_rows() -> None:
    """A complete basis misses nothing, and joints close to Newton's tolerance: that is no reason to
    leave their rows out.
    """
    raw, data, _ = full(platform)
    noisy = data.q + 1e-10 * np.random.default_rng(0).normal(size=data.q.shape)
    parts = body_level(raw)
    found = reduction.bases(raw, data, parts, 1e-12)
    found |= {name: replace(basis, modes=np.eye(len(basis.mean))) for name, basis in found.items()}
    small = reduction.reduce_system(raw, parts, found, False, noisy)
    assert {name for name in small.constraints.names if name[0] == "platform.frame"} == {
        name for name in raw.constraints.names if name[0] == "platform.frame"
    }


def hub() -> System:
    """A beam that is welded to a hub on an axle."""
    beam = body.cable("beam", models.segment(10), models.SECTION, models.MATERIAL, dim=2)
    held = [
        joints.Revolute("axle", At("hub", "frame")),
        joints.Weld("root", At("beam", "left"), At("hub", "frame")),
    ]
    return assemble(
        [beam, rigid("hub", 0.5, 0.02, (0.0, 0.0), dim=2)], held, [loads.Gravity((0.0, -9.81))]
    )


def test_joints_between_components_are_never_let_go() -> None:
    """However much smaller the error without them is said to be; the same of the axes of rigid
    bodies, which all bases hold.
    """
    raw, data, motion = full(hub)
    bases = galerkin.bases(raw, data, body_level(raw), 1e-12)
    every = galerkin.reduce_system(raw, body_level(raw), bases)
    reduced = galerkin.reduce_system(raw, body_level(raw), bases, configurations=data.q)
    names, samples = every.constraints.names, [kept_rows.sample_rows(raw, every, data.q)]
    found = kept_rows.choose(names, samples, lambda out: 1.0 / (1 + len(out)) ** 9, lambda: 0.0)
    assert {name for name in names if name[0] == "hub.frame"} | {("root", "angle")} <= found.rows
    assert reduction.compare(motion, integrate(reduced, STEP, 0.3, TIGHT)).maximum < 1e-4  # type: ignore[arg-type]
