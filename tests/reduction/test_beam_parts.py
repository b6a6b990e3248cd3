"""Beams with torsion and shear: parts, trained alone, in another frame, and as files; frames that
are reduced as a whole.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import reduction
from fmbs_skfem.bodies import Body, Circular, Material, Rectangular
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import probe
from fmbs_skfem.bodies.sections import Section
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    integrate,
    outputs,
    solve_statics,
)
from fmbs_skfem.dynamics.outputs import body_coordinates
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts import departures
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.parts.excitation import Excitation, excite
from fmbs_skfem.reduction import Plan, cases, task_of
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, System, assemble, eliminate, lengths
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import beam_sections, probes, stresses

LENGTH = 0.5
SCHEME, DURATION = GeneralizedAlpha(2e-3), 0.2
UP = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  #: x becomes z
STRIP = Rectangular(0.02, 0.004)


def bar(
    name: str,
    section: Section = STRIP,
    origin: np.ndarray | None = None,
    rotation: np.ndarray | None = None,
) -> Body:
    """A beam of six cells from `left` to `right`, along x in a frame of its own."""
    start, R = (
        np.zeros(3) if origin is None else origin,
        np.eye(3) if rotation is None else rotation,
    )
    curve = curves.Straight(start, start + LENGTH * R[:, 0], LENGTH)
    line = curves.Line(np.linspace(0.0, LENGTH, 7), curve, {"left": 0.0, "right": LENGTH}, None)
    return beam(name, line, section, Material(70e9, 2700.0, 0.3), direction=R[:, 1])


@cache
def states() -> np.ndarray:
    """States (s, b, c) of a bar that is moved alone."""
    return excite(
        bar("bar"),
        Excitation(
            force=2.0, moment=0.1, duration=0.3, step=1e-3, slowest=2.0, fastest=15.0, samples=150
        ),
    )


@cache
def trained(tolerance: float) -> part_files.Part:
    """The bar, trained alone."""
    return part_files.train(bar("bar"), states(), tolerance)


def frame(first: Body, second: Body) -> System:
    """Two bars at a right angle, clamped, under weight and a force out of their plane: the first is
    twisted.
    """
    held = [
        joints.Clamp("root", At("one", "left")),
        joints.Weld("corner", At("one", "right"), At("two", "left")),
    ]
    push = loads.PointForce(
        "F",
        At("two", "right"),
        (0.0, 0.5, 0.0),
        lambda t: np.sin(20.0 * t) * np.clip(t / 0.1, 0.0, 1.0),
    )
    read = {"tip": probes.Position(At("two", "right"))}
    return assemble([first, second], held, [loads.Gravity((0.0, 3.0, -9.81)), push], outputs=read)


def elbow(first: Body, second: Body) -> Trajectory:
    """The motion of this frame."""
    return integrate(eliminate(frame(first, second)), SCHEME, DURATION, Newton(tolerance=1e-12))


def of_part(body: Body) -> Trajectory:
    """The elbow of one part, twice."""
    return elbow(
        parts.placed(body, "one"), parts.placed(body, "two", np.array([LENGTH, 0.0, 0.0]), UP)
    )


def bars() -> tuple[Body, Body]:
    """The full bodies of the elbow."""
    return bar("one"), bar("two", origin=np.array([LENGTH, 0.0, 0.0]), rotation=UP)


@cache
def full() -> Trajectory:
    """The elbow of full bodies."""
    return elbow(*bars())


def error(found: Trajectory) -> float:
    """Largest distance of tips over the largest way of the full one."""
    a, b = (
        np.stack([outputs(motion)[f"tip_{axis}"] for axis in "xyz"]) for motion in (full(), found)
    )
    return float(np.linalg.norm(b - a, axis=0).max() / np.linalg.norm(a - a[:, :1], axis=0).max())


def test_a_part_of_all_functions_is_the_body() -> None:
    body = bar("bar")
    S = parts.with_places(body, np.eye(len(body.reference)))
    assert error(of_part(parts.reduced_body(body, S))) < 1e-7


def pushed(body: Body) -> System:
    """A bar that is clamped, under a force at its end, with its section forces at two places."""
    seen = {
        name: stresses.SectionForces(At("one", place))
        for name, place in (("a", "left"), ("b", 0.3))
    }
    held, push = (
        joints.Clamp("root", At("one", "left")),
        loads.PointForce("F", At("one", "right"), (0.02, 0.03, 0.1)),
    )
    return eliminate(assemble([body], [held], [push], outputs=seen))


def forces_of(body: Body) -> np.ndarray:
    """N, Vy, Vz, T, My, Mz (2, 6) at these places."""
    found = outputs(solve_statics(pushed(body), 1))
    return np.array(
        [[found[f"{name}_{word}"][-1] for word in beam_sections.FORCES] for name in "ab"]
    )


def test_parts_have_section_forces() -> None:
    """Those of the body where the part has all its functions; what a trained one leaves out of them
    is said.
    """
    whole, body = bar("one", origin=np.array([0.1, 0.2, 0.3]), rotation=UP), bar("bar")
    part = parts.reduced_body(body, parts.with_places(body, np.eye(len(body.reference))))
    part = parts.placed(
        parts.ranged(part, part.reference * np.array([[[1.0]], [[1.1]]])),
        "one",
        np.array([0.1, 0.2, 0.3]),
        UP,
    )
    assert_allclose(forces_of(part), forces_of(whole), atol=2e-5)
    assert part.shapes is not None
    coarse = replace(part, shapes=replace(part.shapes, strain_errors=np.array([0.1, 0.01])))
    with pytest.warns(
        Notice,
        match=r"leave out 0\.021 of axial strain \(N: 1\.2e\+05 N\) .* 0\.1 of the largest axial",
    ):
        pushed(coarse)


def test_parts_trained_alone_stand_in_another_frame() -> None:
    """With shapes between their places; with their states alone they are 36 % off, and say so."""
    rough = part_files.train(bar("bar"), states(), 1e-9, shapes=states()[:0])
    with pytest.warns(Notice, match="do not stand for their bodies"):
        assert error(of_part(rough.body)) > 0.1
    assert error(of_part(trained(1e-9).body)) < 1e-2
    assert error(of_part(trained(1e-13).body)) < 2e-4
    assert trained(1e-13).notes["functions"] < len(bar("bar").reference)


def test_directors_at_places_are_coordinates() -> None:
    body = trained(1e-11).body
    system = eliminate(
        assemble([parts.placed(body, "one")], [joints.Clamp("root", At("one", "left"))])
    )
    assert not len(system.constraints.names)
    assert system.size == body.reference.size - 12


def test_files_keep_beams(tmp_path: Path) -> None:
    path = part_files.save(trained(1e-11), tmp_path / "bar.part.h5")
    body, same = part_files.load(path).body, trained(1e-11).body
    assert body.directors is not None
    assert_allclose(body.directors.toarray(), same.directors.toarray())  # type: ignore[union-attr]
    small = part_files.coarsen(part_files.resume(path), None, 12)
    assert small.notes["functions"] == 12
    assert small.body.shapes is not None
    assert small.body.shapes.missing is not None
    more = part_files.train(
        bar("bar"), states()[::4], 1e-11, None, part_files.ETA, part_files.resume(path)
    )
    assert more.notes["states"] == len(states()) + len(states()[::4])


def test_trained_strains_of_beams_have_torsion() -> None:
    found = trained(1e-11)
    assert list(found.notes["strains"]) == list(departures.OF_BEAMS)
    low, high = found.notes["strains"]["torsion [1/m]"]
    assert low < -1e-4
    assert high > 1e-4
    assert found.notes["missing_shapes"] == "known"


@pytest.mark.parametrize(
    "invariant,eps,bend,twist", [(False, 1e-12, 1e-3, 4e-3), (True, 1e-10, 5e-3, 2e-2)]
)
def test_a_reduced_frame_twists_as_well_as_it_bends(
    invariant: bool, eps: float, bend: float, twist: float
) -> None:
    """Where directors count by their small mass, modes hold them so badly that the frame locks:
    errors are 3 to 20 times larger.
    """
    raw = frame(*bars())
    plan = Plan({"frame": ("one", "two")}, eps, invariant=invariant)
    model = reduction.train(task_of(Case(raw, SCHEME, DURATION), plan, 2e-3), motion=full()).model
    found = cases.run(model.cases({}))
    assert error(found) < bend
    rows = probe(bar("one"), LENGTH, 2)  # d_2 at the corner
    a, b = (
        body_coordinates(one)[:, : rows.shape[1] * 3].reshape(len(one.times), -1, 3)
        for one in (full(), found)
    )
    own, other = (np.einsum("b,sbc->sc", rows.toarray()[0], states) for states in (a, b))
    assert np.abs(other - own).max() < twist * np.abs(own - own[0]).max()


def test_eps_holds_for_mass_and_for_directors() -> None:
    """A bar that is twisted far and bends by a thousandth: what is left out is eps of either, to
    which the modes are as many.
    """
    body = bar("bar")
    system = assemble([body])
    turned, s = np.linspace(0.0, 1.0, 60), np.linspace(0.0, 1.0, body.reference.shape[0] // 4)
    states = np.repeat(body.reference[None], len(turned), axis=0)
    angle = 2.0 * turned[:, None] * s
    states[:, 2::4] = np.stack([0.0 * angle, np.cos(angle), np.sin(angle)], axis=2)
    states[:, 3::4] = np.stack([0.0 * angle, -np.sin(angle), np.cos(angle)], axis=2)
    states[:, ::4, 2] += 1e-3 * LENGTH * np.sin(np.outer(20.0 * turned, 1.0 + s))
    q = states.reshape(len(turned), -1)
    basis = galerkin.bases(system, galerkin.Snapshots(turned, q), {"bar": ("bar",)}, 1e-6)["bar"]
    rows = np.arange(system.size)
    W, deviations = component.metric_of(system, rows), (q - basis.mean).T
    assert_allclose(W.toarray()[::3, ::3], parts.metric(body).toarray(), atol=1e-15)
    left = deviations - basis.modes @ (basis.modes.T @ (W @ deviations))
    mass = component.mass_of(system, rows)
    assert mass is not None
    for metric in (W, mass):
        assert np.sum(left * (metric @ left)) <= 1e-6 * np.sum(deviations * (metric @ deviations))


@pytest.mark.parametrize("diameter", [1e-3, 1e-1])
def test_directors_count_by_the_size_of_a_beam(diameter: float) -> None:
    """The metric of a beam that is thin is that of one that is thick: n coefficients of each
    director count as the body does.
    """
    body = bar("bar", Circular(diameter))
    W = parts.metric(body).toarray()
    turned = np.zeros(len(body.reference))
    turned[2::4] = 1.0
    inertia = diameter**2 / 16.0
    assert_allclose(
        turned @ W @ turned, lengths.spread(body.reference[::4]) ** 2 + inertia, rtol=1e-12
    )
