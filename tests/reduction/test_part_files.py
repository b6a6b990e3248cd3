"""Parts trained alone, as files, and in scenes: what they hold, what is refused, and where a motion
leaves their training.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import brentq

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Body, Circular, Material, Rim, cable
from fmbs_skfem.bodies.body import point_mass
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.algebra.linalg import as_dense, evenly
from fmbs_skfem.core.errors import CorruptFile, InputError
from fmbs_skfem.core.notices import Notice, Remark
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts import departures, excitation, rescaling
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.parts.excitation import Excitation, excite, settle
from fmbs_skfem.reduction import affine
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.shapes import line, surface
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, Motion, System, assemble, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.measures.stresses import SectionForces
from tests import models
from verification.plates import rectangle
from verification.vibration import ring

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
SHARP = Newton(tolerance=1e-12)


@cache
def arm() -> Body:
    """A beam of 16 cells along x from `left` to `right`."""
    return cable("arm", models.segment(16), models.SECTION, models.MATERIAL)


@cache
def states() -> np.ndarray:
    """States (s, b, c) of the arm that is moved alone."""
    return excite(arm(), Excitation(step=1e-3))


@cache
def alone() -> part_files.Part:
    """The arm trained alone: it never saw a second one."""
    return part_files.train(arm(), states())


def of_states(body: Body, states: np.ndarray, *more: Any, **notes: Any) -> part_files.Part:
    """A part that knows nothing but its states: none of the shapes between its places."""
    return part_files.train(body, states, *more, shapes=states[:0], **notes)


def unknown(body: Body) -> Body:
    """A part of which nothing is known but its strains."""
    assert body.shapes is not None
    return replace(body, shapes=replace(body.shapes, missing=None))


def two(body: Body, weight: tuple[float, ...], other: bool) -> System:
    """The double pendulum of example 2 with one body twice, hung at I.left, or at II.right."""
    bodies = [parts.placed(body, "I"), parts.placed(body, "II", np.array([1.0, 0.0, 0.0]), QUARTER)]
    hung, free = (
        (At("II", "right"), At("I", "left")) if other else (At("I", "left"), At("II", "right"))
    )
    held = [joints.Pin("A", hung), joints.Pin("B", At("I", "right"), At("II", "left"))]
    return eliminate(
        assemble(bodies, held, [loads.Gravity(weight)], outputs={"free": probes.Position(free)})
    )


def path(run: Trajectory) -> np.ndarray:
    values = outputs(run)
    return np.stack([values[f"free_{axis}"] for axis in "xyz"], axis=1)


@pytest.mark.parametrize(
    ("weight", "other"),
    [((0.0, 0.0, -9.81), False), ((0.0, -6.937, 6.937), False), ((0.0, 0.0, -9.81), True)],
)
def test_a_part_trained_alone_serves_mechanisms_that_it_never_saw(
    weight: tuple[float, ...], other: bool
) -> None:
    """The table of the training of example 2, on 16 cells and over 1 s: 1.5e-4 m of two metres."""
    full, reduced = (
        integrate(two(one, weight, other), GeneralizedAlpha(1e-3), 1.0, SHARP)
        for one in (arm(), alone().body)
    )
    assert reduced.system.size <= 0.5 * full.system.size
    assert np.linalg.norm(path(full)[-1] - path(full)[0]) > 1.0
    assert np.linalg.norm(path(reduced) - path(full), axis=1).max() < 1.5e-4
    assert departures.find(reduced) == []


@pytest.mark.parametrize(
    ("material", "wanted"), [(models.MATERIAL, 5e-4), (Material(2e11, 7800.0), 1e-3)]
)
def test_loads_are_scaled_until_the_states_of_a_training_reach_a_strain(
    material: Material, wanted: float
) -> None:
    """Smaller and larger than by its weight; on the same paths, with the ratios of forces, moments
    and weight as they are.
    """
    rod = cable("rod", models.segment(16), models.SECTION, material)
    states, told = excitation.run(rod, Excitation(runs=1, samples=200, strain=wanted))
    assert 0.9 * wanted <= parts.largest_strains(rod, states).max() <= 1.1 * wanted
    plain = settle(Excitation(), rod)
    assert told.strain == wanted
    scale = told.gravity / plain.gravity
    assert (scale < 1.0) == (material is models.MATERIAL)
    assert told.force == pytest.approx(scale * plain.force)
    assert told.moment == pytest.approx(scale * plain.moment)
    assert told.duration == pytest.approx(plain.duration / np.sqrt(scale), rel=1e-3)
    part = part_files.train(rod, states)
    assert part.notes["largest_strain"] == parts.largest_strains(rod, states).max()


def test_a_strain_that_no_loads_reach_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(excitation, "TRIALS", 1)
    asked = Excitation(runs=1, step=1e-3, duration=0.1, strain=1e-9)
    with pytest.raises(
        InputError, match=r"largest strain of 1e-09, got .* by loads times .*take a smaller strain"
    ):
        excite(arm(), asked)
    with pytest.raises(InputError, match="expected loads that are scaled to a strain, got none"):
        excite(arm(), replace(asked, force=0.0, moment=0.0, gravity=0.0))


def test_the_strain_of_fibres_is_that_of_stretched_bent_and_turned_bodies() -> None:
    """On a circle or cylinder of radius R half the thickness over R; stretched by 1.01 it is
    0.01005; turned none.
    """
    t, R = 2e-3, 2.0
    strip = plate("strip", rectangle("bfs", 8, 1, 1.0, 0.1), t, models.MATERIAL, dim=3)
    rims = {"hub": Rim(("inner",)), "edge": Rim(("outer",))}
    disk = plate("ring", ring(0.1, 0.3, 12), 0.01, models.MATERIAL, dim=2, rims=rims)
    for body in (arm(), strip, disk):
        x = body.reference
        turned = parts.largest_strains(
            body, np.stack([x @ QUARTER[: body.dim, : body.dim], 1.01 * x])
        )
        assert turned[0] < 1e-12
        assert turned[1] == pytest.approx(0.5 * (1.01**2 - 1.0), rel=1e-9)
    for body, half in ((arm(), 0.5 * models.SECTION.diameter), (strip, 0.5 * t)):
        x = body.reference
        points = as_dense(probe_matrix(body))
        at = points @ x
        bent = np.stack(
            [R * np.sin(at[:, 0] / R), at[:, 1], R * (1.0 - np.cos(at[:, 0] / R))], axis=1
        )
        coordinates = np.linalg.lstsq(points, bent, rcond=None)[0]
        assert parts.largest_strains(body, coordinates[None])[0] == pytest.approx(
            half / R, rel=2e-2
        )


def probe_matrix(body: Body) -> np.ndarray:
    """Rows of positions at many points of a body (x, b)."""
    if isinstance(body.space, surface.Surface):
        cells, xi = np.arange(len(body.space.nodes)), np.linspace(0.0, 1.0, 7)
        pairs = [(e, (a, b)) for e in cells for a in xi for b in xi]
        return as_dense(
            surface.sample(
                body.space, np.array([e for e, _ in pairs]), np.array([p for _, p in pairs])
            )
        )
    return as_dense(line.sample(body.space, np.linspace(0.0, line.breaks(body.space)[-1], 200)))


def test_an_excitation_begins_at_all_places_and_is_the_same_with_the_same_seed() -> None:
    told = settle(Excitation(), arm())
    weight = float(arm().constant @ (arm().mass @ arm().constant)) * 9.81
    assert told.force == pytest.approx(weight)
    assert told.duration == pytest.approx(10.0 / np.sqrt(9.81))
    short = Excitation(runs=2, step=2e-3, duration=0.1)
    first, again, other = (
        excite(arm(), one)
        for one in (short, short, Excitation(runs=2, step=2e-3, duration=0.1, seed=1))
    )
    assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-4
    slow, sudden = (
        excite(arm(), Excitation(runs=1, step=2e-4, duration=0.01, rise=rise))
        for rise in (1.0, 0.0)
    )
    assert np.abs(sudden[5] - arm().reference).max() > 2.0 * np.abs(slow[5] - arm().reference).max()
    with warnings.catch_warnings(
        record=True
    ) as said:  # its moments about the line act once that has turned
        warnings.simplefilter("always")
        excite(arm(), Excitation(runs=1, step=1e-2, duration=0.02))
    assert not [one for one in said if "about the line" in str(one.message)]
    ends = [arm().constant @ arm().mass @ state for state in (first[0], first[len(first) // 2])]
    assert np.abs(ends[0] - ends[1]).max() < 1e-12  # every run begins in the reference


def test_a_body_may_turn_at_the_start() -> None:
    """Spun alone about its pinned end a bar stretches by rho w^2 L^2 / 2 E at the root, and twice
    as far on its way about that.
    """
    bar, w = cable("bar", models.segment(8), models.SECTION, models.MATERIAL, dim=2), 20.0
    told = Excitation(runs=2, force=0.0, moment=0.0, gravity=0.0, duration=0.2, step=2e-4, spin=w)
    states = excite(bar, told)
    assert_allclose(states[0], bar.reference, atol=1e-12)
    ends = states[125][np.argmax(bar.reference[:, 0])] @ np.array([1.0, 1.0j])
    assert abs(np.angle(ends)) == pytest.approx(1.0, abs=2e-3)  # w t, whole lines turn
    high = part_files.train(bar, states).body.shapes.trained[1, 0]
    stretched = models.MATERIAL.density * w**2 / (2.0 * models.MATERIAL.young_modulus)
    assert 1.8 * stretched < high < 2.2 * stretched


def test_strains_outside_of_the_training_are_told_with_time_and_place() -> None:
    bob, spin = (
        point_mass("bob", 5.0, np.array([1.0, 0.0, 0.0])),
        Motion(angular_velocity=(0.0, 0.0, 30.0)),
    )
    held = [joints.Pin("A", At("arm", "left")), joints.Pin("B", At("arm", "right"), At("bob"))]
    spun = eliminate(
        assemble([unknown(alone().body), bob], held, initial={"arm": spin, "bob": spin})
    )
    with pytest.warns(UserWarning, match="part 'arm': axial strain .* trained from"):
        run = integrate(spun, GeneralizedAlpha(1e-3), 0.1, SHARP)
    (one, *_) = departures.find(run)
    assert one.value > 2.0 * one.trained[1]
    assert 0.0 < one.time < 0.1


def test_a_tenth_beyond_the_trained_range_is_told_since_the_first_state_there() -> None:
    """The arm stretched along itself by parts of the trained range beyond it: below a tenth nothing
    is said.
    """
    system = eliminate(assemble([alone().body], []))
    shapes = alone().body.shapes
    assert shapes is not None
    L, offset = as_dense(system.lift.matrix), system.lift.offset

    def stretched(size: float) -> np.ndarray:
        q = system.lift.matrix @ system.x0 + offset
        return np.asarray(np.linalg.lstsq(L, q * (1.0 + size) - offset, rcond=None)[0])

    def excess(x: np.ndarray) -> float:
        q = (system.lift.matrix @ x + offset).reshape(1, -1, shapes.dim)
        low, high = shapes.trained[:, 0]
        return float((departures.strains(shapes, q)[0, :, 0].max() - high) / (high - low))

    def beyond(by: float) -> np.ndarray:
        return stretched(brentq(lambda size: excess(stretched(size)) - by, 0.0, 1.0))

    times = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    assert departures.find_in(system, times[:2], np.array([beyond(0.03), beyond(0.09)])) == []
    found = departures.find_in(
        system, times, np.array([beyond(by) for by in (0.09, 0.11, 0.3, 0.45, 0.2)])
    )
    (one,) = [each for each in found if each.kind == "axial strain"]
    assert one.time == 0.2
    assert one.excess == pytest.approx(0.45, abs=1e-9)


def test_a_file_holds_the_part_and_runs_without_the_mesh(tmp_path: Path) -> None:
    """To the bit; where arrays lie in memory, by which some processors sum otherwise, leaves
    round-off in the motion.
    """
    file = part_files.save(alone(), tmp_path / "arm.part.h5")
    again = part_files.load(file)
    assert again.notes == alone().notes
    scheme = GeneralizedAlpha(1e-3)
    one, other = (
        integrate(two(body, (0.0, 0.0, -9.81), False), scheme, 0.05, SHARP)
        for body in (alone().body, again.body)
    )
    assert_allclose(one.x, other.x, rtol=0.0, atol=1e-11)
    body, held = alone().body, again.body
    for here, there in (
        (body.reference, held.reference),
        (body.mass.data, held.mass.data),
        (body.cells.table, held.cells.table),  # type: ignore[union-attr]
        (body.cells.section, held.cells.section),  # type: ignore[union-attr]
    ):
        assert_array_equal(here, there)
        assert (
            here.strides == there.strides
        )  # products of what lies otherwise in memory differ in the last digits
    assert file.stat().st_size < 200_000


def left_out(part: part_files.Part, states: np.ndarray) -> float:
    """Energy of states that the functions of a part leave out, over that of the deviations from the
    field 1.
    """
    S, W, one = part.memory.functions, parts.metric(arm()), arm().constant  # type: ignore[union-attr]
    Y = np.moveaxis(states, 0, 1).reshape(len(S), -1)
    rest = Y - S @ np.linalg.solve(S.T @ (W @ S), S.T @ (W @ Y))
    Y = Y - np.outer(one, one @ (W @ Y) / (one @ (W @ one)))
    return float(np.sum(rest * (W @ rest)) / np.sum(Y * (W @ Y)))


def test_a_training_goes_on_without_the_states_of_before(tmp_path: Path) -> None:
    """Pinned first, then bent at the ends: the part of both is as good as one that was trained on
    both at once.
    """
    pinned, bent = (
        excite(arm(), Excitation(runs=2, step=1e-3, duration=1.5, moment=m)) for m in (0.0, 0.14)
    )
    first = of_states(arm(), pinned, 1e-10)
    file = part_files.save(first, tmp_path / "arm.part.h5")
    both = of_states(arm(), bent, 1e-10, None, 1e-4, part_files.resume(file))
    once = of_states(arm(), np.concatenate([pinned, bent]), 1e-10)
    assert left_out(first, bent) > 1e-8
    for states in (pinned, bent):
        assert left_out(both, states) < 3e-10
    assert abs(both.notes["functions"] - once.notes["functions"]) <= 1
    assert both.notes["states"] == once.notes["states"]
    for part in (first, once):
        low, high = part.body.shapes.trained  # type: ignore[union-attr]
        assert (both.body.shapes.trained[0] <= low + 0.05 * (high - low)).all()  # type: ignore[union-attr]
        assert (both.body.shapes.trained[1] >= high - 0.05 * (high - low)).all()  # type: ignore[union-attr]


def test_what_two_trainings_have_met_is_known_of_both() -> None:
    """Strains of the first one that the second does not reach; errors of strains are those of the
    part of both.
    """
    much, little = (
        Excitation(runs=1, step=1e-3, duration=1.0, moment=m, force=f)
        for m, f in ((0.2, 2.0), (0.02, 0.2))
    )
    first = part_files.train(arm(), excite(arm(), much), 1e-7)
    both = part_files.train(arm(), excite(arm(), little), 1e-13, None, 1e-4, first)
    alone_so = part_files.train(arm(), excite(arm(), little), 1e-13, None, 1e-4)
    wide, found, narrow = (one.body.shapes for one in (first, both, alone_so))
    assert wide is not None
    assert found is not None
    assert narrow is not None
    reach = (wide.trained[1] - wide.trained[0]) / (narrow.trained[1] - narrow.trained[0])
    assert reach.min() > 2.0
    assert (found.trained[0] <= wide.trained[0]).all()
    assert (found.trained[1] >= wide.trained[1]).all()
    assert wide.strain_errors[1] > 20.0 * found.strain_errors[1]
    assert both.notes["strain_errors"]["curvature"] == found.strain_errors[1]


def test_a_training_goes_on_with_the_same_mesh_and_a_file_that_knows_it(tmp_path: Path) -> None:
    bare = replace(
        alone(), notes={key: value for key, value in alone().notes.items() if key != "states_kept"}
    )
    with pytest.raises(
        InputError, match="keeps factors of its training, got one without; train the part anew"
    ):
        part_files.resume(part_files.save(bare, tmp_path / "bare.part.h5"))
    other = cable("arm", models.segment(8), models.SECTION, models.MATERIAL)
    with pytest.raises(InputError, match="take the mesh of before"):
        part_files.train(other, other.reference[None], 1e-10, None, None, alone())
    moved = replace(
        arm(), reference=arm().reference @ QUARTER + np.outer(arm().constant, [200.0, 0.0, -3.0])
    )
    part_files.recall(alone(), moved)
    with pytest.raises(
        InputError, match="got one of another size or shape; take the mesh of before"
    ):
        part_files.recall(alone(), replace(arm(), reference=0.9999 * arm().reference))
    with pytest.raises(InputError, match=r"read it with part_files\.resume"):
        part_files.train(
            arm(), arm().reference[None], 1e-10, None, None, replace(alone(), memory=None)
        )


def test_a_part_that_does_not_bend_is_told() -> None:
    """With the functions 1 and x alone nothing that it lacks is seen in a run: it is at rest where
    it is clamped.
    """
    with pytest.warns(
        Notice, match="part 'arm': its 2 shape functions .* cannot bend; take more of them"
    ):
        assert len(part_files.coarsen(alone(), None, 2).body.reference) == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        part_files.coarsen(alone(), None, 3)


def test_a_part_that_is_as_large_as_its_body_is_told() -> None:
    """The few states of the arm of 34 functions leave 20 of them; 11 are silent."""
    short = states()[::60]
    with pytest.warns(
        Notice,
        match=r"part 'arm': it has \d\d of the 34 functions of its body and will not be faster than it",
    ):
        part_files.train(arm(), short, 1e-30, None, None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        part_files.train(arm(), short, 1e-12, None, None)


def test_a_part_is_made_coarser_where_it_is_used(tmp_path: Path) -> None:
    """Leading functions and fewer of its points: errors grow with eps as those of a part that was
    trained to it, points fall.
    """
    file = part_files.save(of_states(arm(), states()), tmp_path / "arm.part.h5")
    whole, weight = part_files.resume(file), (0.0, -6.937, 6.937)
    wanted = path(integrate(two(arm(), weight, False), GeneralizedAlpha(1e-3), 0.5, SHARP))
    made = [part_files.coarsen(whole, eps) for eps in (1e-10, 1e-7)]
    runs = [
        integrate(two(one.body, weight, False), GeneralizedAlpha(1e-3), 0.5, SHARP) for one in made
    ]
    errors = [float(np.linalg.norm(path(run) - wanted, axis=1).max()) for run in runs]
    assert errors[0] < 2e-4 < errors[1] < 2e-2
    counts = [(one.notes["functions"], one.notes["points"]) for one in (whole, *made)]
    assert counts[0] > counts[1] > counts[2]
    assert [len(one.body.reference) for one in made] == [count for count, _ in counts[1:]]
    assert_array_equal(made[1].body.shapes.trained, whole.body.shapes.trained)  # type: ignore[union-attr]
    fewer = part_files.coarsen(whole, None, 5, 1e-2)
    assert len(fewer.body.reference) == 5
    assert len(fewer.body.shapes.cell) < counts[2][1]  # type: ignore[union-attr]
    again = part_files.train(
        arm(),
        excite(arm(), Excitation(runs=1, duration=0.2, step=1e-3)),
        1e-11,
        None,
        1e-3,
        made[0],
    )
    assert again.notes["functions"] >= counts[1][0]
    check_system(two(made[1].body, weight, False))
    with pytest.raises(InputError, match=r"read it with part_files\.resume"):
        part_files.coarsen(part_files.load(file), 1e-9)


def errors_at_points(S: np.ndarray) -> np.ndarray:
    """Largest errors (2,) of axial strains and curvatures at all quadrature points in the states
    nearest in functions S.
    """
    whole, some = np.eye(len(S)), states()[evenly(0, len(states()) - 1, part_files.LOOKED_AT)]
    true, near = (
        departures.strains(parts.reduced_body(arm(), T).shapes, parts.coordinates(arm(), T, some))  # type: ignore[arg-type]
        for T in (whole, S)
    )
    return np.asarray(np.abs(near - true).max(axis=(0, 1)) / np.abs(true).max(axis=(0, 1)))


def test_what_functions_leave_out_of_strains_is_known_and_said_where_forces_are_asked_for(
    tmp_path: Path,
) -> None:
    """Of a part, and of a coarser one from its file, which adds what the finer one leaves out;
    forces err by as much.
    """
    whole = of_states(arm(), states(), 1e-15, None, 1e-3)
    fine = part_files.resume(part_files.save(whole, tmp_path / "arm.part.h5"))
    small = part_files.coarsen(fine, 1e-8)
    errors = [one.body.shapes.strain_errors for one in (fine, small)]  # type: ignore[union-attr]
    for one, found in zip((fine, small), errors, strict=True):
        assert_allclose(found, errors_at_points(one.memory.functions), rtol=0.3)  # type: ignore[union-attr]
    assert fine.notes["strain_errors"] == {"strain": errors[0][0], "curvature": errors[0][1]}
    assert errors[0].max() < 0.1 < errors[1][0]
    same = part_files.coarsen(
        fine, None, fine.notes["functions"]
    ).body.shapes  # which leaves out what the part itself does
    assert_allclose(same.strain_errors, errors[0], rtol=1e-2)  # type: ignore[union-attr]

    def hung(body: Body) -> System:
        seen = {"middle": SectionForces(At("arm", 0.5))}
        return assemble(
            [body],
            [joints.Pin("A", At("arm", "left"))],
            [loads.Gravity((0.0, 0.0, -9.81))],
            outputs=seen,
        )

    for one in (fine, small):
        points, EA = one.body.shapes, models.SECTION.of_cable(models.MATERIAL).EA
        force = points.strain_errors[0] * np.abs(points.trained[:, 0]).max() * EA  # type: ignore[union-attr]
        said = "output 'middle': the shape functions of part 'arm' leave out .* " + re.escape(
            f"(N: {force:.2g} N)"
        )
        with pytest.warns(Remark, match=said):
            hung(one.body)


def test_a_scene_says_how_fine_its_parts_are(tmp_path: Path) -> None:
    part_files.save(alone(), tmp_path / "arm.part.h5")
    text = SCENE.format(dimension=3, place="left")
    sizes = []
    for more in ("", ", tolerance: 1e-9", ", modes: 6", ", hyper: 1e-2"):
        system = build.system(
            reading.loads(
                text.replace(
                    "I: {type: part, file: arm.part.h5", "I: {type: part, file: arm.part.h5" + more
                ),
                tmp_path,
            )
        )
        sizes.append((system.size, sum(len(one.gather.cell) for one in system.elastic)))
    assert sizes[0] > sizes[1] > sizes[2]
    assert sizes[3][0] == sizes[0][0]
    assert sizes[3][1] < sizes[0][1]
    both = text.replace("h5}", "h5, modes: 5, tolerance: 1e-9}")
    with pytest.raises(InputError, match="a tolerance or a number of modes"):
        build.system(reading.loads(both, tmp_path))


def test_a_plate_with_a_rim_is_a_part_as_well(tmp_path: Path) -> None:
    steel = Material(young_modulus=2e8, density=7800.0, poisson_ratio=0.3)
    rims = {"hub": Rim(("inner",)), "edge": Rim(("outer",))}
    full = plate("ring", ring(0.1, 0.3, 12), 0.01, steel, dim=2, rims=rims)
    told = Excitation(runs=2, duration=0.2, step=1e-3, moment=100.0, force=2000.0)
    file = part_files.save(part_files.train(full, excite(full, told), 1e-12), tmp_path / "ring.h5")
    body = part_files.load(file).body
    check_system(
        assemble(
            [body],
            [joints.Pin("hub", At("ring", "hub"))],
            [loads.Torque("motor", At("ring", "edge"), 5.0)],
        )
    )


def test_damaged_files_and_files_of_another_kind_are_refused(tmp_path: Path) -> None:
    file = part_files.save(alone(), tmp_path / "arm.part.h5")
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "bad.part.h5").write_bytes(data)
    with pytest.raises(CorruptFile, match="copy the file again, or train the part anew"):
        part_files.load(tmp_path / "bad.part.h5")
    wrong = replace(alone(), body=replace(alone().body, mass=alone().body.mass[:3, :3]))
    with pytest.raises(
        CorruptFile,
        match=r"body\.mass: expected an array \((\d+), \1\) of float64, got a sparse array \(3, 3\)",
    ):
        part_files.load(part_files.save(wrong, tmp_path / "wrong.part.h5"))
    (tmp_path / "other.h5").write_bytes(b"fmbs_skfem reduced model\n" + bytes(data[25:]))
    with pytest.raises(CorruptFile, match="'fmbs_skfem part' in its first line"):
        part_files.load(tmp_path / "other.h5")
    with pytest.raises(InputError, match="no file; save one first"):
        part_files.load(tmp_path / "none.part.h5")


@pytest.mark.parametrize(
    ("place", "change", "message"),
    [
        ("reference", lambda x: x[:, :, None], r"body\.reference: expected an array of 2 axes"),
        (
            "reference",
            lambda x: np.nan * x,
            r"body\.reference: expected finite numbers, got \[nan\]",
        ),
        (
            "constant",
            lambda x: x.astype(np.float32),
            r"body\.constant: expected an array .* of float64",
        ),
        ("mass", lambda M: np.inf * M, r"body\.mass: expected finite numbers, got \[inf\]"),
        (
            "mass",
            lambda M: 0.0 * M,
            r"body\.mass: expected a positive definite matrix, got another one",
        ),
        (
            "spread",
            lambda S: 0.0 * S,
            r"body\.spread: expected shape functions over a body of some size",
        ),
    ],
)
def test_forged_arrays_are_refused(
    place: str, change: Callable[[Any], Any], message: str, tmp_path: Path
) -> None:
    body = alone().body
    wrong = replace(alone(), body=replace(body, **{place: change(getattr(body, place))}))
    with pytest.raises(CorruptFile, match=message):
        part_files.load(part_files.save(wrong, tmp_path / "wrong.part.h5"))


def test_a_training_of_nothing_is_refused(tmp_path: Path) -> None:
    """Arrays of the right shapes from which no coarser part follows: states in which nothing moves
    or stands anywhere.
    """
    memory = alone().memory
    assert memory is not None
    wrong = replace(alone(), memory=replace(memory, states=0.0 * memory.states))
    path = part_files.save(wrong, tmp_path / "wrong.part.h5")
    with pytest.raises(
        CorruptFile, match="expected shape functions and states of a training, got others"
    ):
        part_files.used(path, tolerance=1e-3)


def test_numbers_far_from_the_training_are_refused() -> None:
    """The mass per length grows as the square of the diameter, which overflows."""
    with pytest.raises(
        InputError,
        match=r"'arm': diameter: expected a number like that of its training, .*, got 1e\+200; look at",
    ):
        rescaling.rescale(alone().body, {"diameter": 1e200})


SCENE = """
schema: 1
units: SI
dimension: {dimension}
bodies:
  I: {{type: part, file: arm.part.h5}}
  II: {{type: part, file: arm.part.h5, origin: [1 m, 0, 0], rotation: {{axis: [0, 0, 1], angle: 90 deg}}}}
joints:
  A: {{type: spherical, at: I.left, to: ground}}
  B: {{type: spherical, at: I.right, to: II.{place}}}
loads:
  weight: {{type: gravity, acceleration: [0, 0, -9.81 m/s^2]}}
analysis: {{type: dynamic, duration: 0.05 s, step: 1 ms}}
outputs:
  free: {{type: position, at: II.right}}
"""


def test_scenes_place_parts_as_often_as_wanted(tmp_path: Path) -> None:
    part_files.save(alone(), tmp_path / "arm.part.h5")
    scene = reading.loads(SCENE.format(dimension=3, place="left"), tmp_path)
    system = build.chosen_form(scene, build.system(scene))
    reference = two(alone().body, (0.0, 0.0, -9.81), False)
    runs = (integrate(one, GeneralizedAlpha(1e-3), 0.05, SHARP) for one in (system, reference))
    one, other = (path(run) for run in runs)
    np.testing.assert_allclose(one, other, atol=1e-9)
    assert {line.name for line in system.lines} == {"I", "II"}


def test_a_file_of_a_part_is_read_once_as_long_as_it_stays(tmp_path: Path) -> None:
    file = part_files.save(alone(), tmp_path / "arm.part.h5")
    scene = reading.loads(SCENE.format(dimension=3, place="left"), tmp_path)
    first, second = (one.gather for one in build.system(scene).elastic)
    assert first.table is second.table
    part_files.save(part_files.coarsen(alone(), 1e-7), file)
    assert all(one.gather.table.size < first.table.size for one in build.system(scene).elastic)
    file.unlink()
    with pytest.raises(InputError, match="no file; save one first"):
        part_files.used(file)


def other_arm() -> Body:
    """The arm of another diameter and modulus."""
    return cable("arm", models.segment(16), Circular(0.012), Material(2e9, models.MATERIAL.density))


def test_parts_of_a_scene_take_other_numbers_than_those_of_their_training(tmp_path: Path) -> None:
    """Young's modulus and diameter: the motion is that of the full bodies made of them, and far
    from that of the training.
    """
    part_files.save(alone(), tmp_path / "arm.part.h5")
    text = SCENE.format(dimension=3, place="left").replace(
        "h5", "h5, young_modulus: 2 GPa, diameter: 12 mm"
    )
    text = text.replace("duration: 0.05 s", "duration: 0.5 s")
    scene = reading.loads(text, tmp_path)
    reduced = integrate(
        build.chosen_form(scene, build.system(scene)), GeneralizedAlpha(1e-3), 0.5, SHARP
    )
    full = (two(one, (0.0, 0.0, -9.81), False) for one in (other_arm(), arm()))
    wanted, trained = (integrate(one, GeneralizedAlpha(1e-3), 0.5, SHARP) for one in full)
    assert np.linalg.norm(path(reduced) - path(wanted), axis=1).max() < 1.5e-4
    assert np.linalg.norm(path(trained) - path(wanted), axis=1).max() > 1e-2
    with pytest.raises(
        InputError, match=r"body 'I': expected a number that scales it .*, got 'thickness'"
    ):
        build.system(reading.loads(text.replace("diameter", "thickness"), tmp_path))


def test_numbers_of_parts_are_parameters_of_families(tmp_path: Path) -> None:
    """A reduced model of parts over Young's modulus: polynomials of it, exact at a value that took
    no part.
    """
    part_files.save(alone(), tmp_path / "arm.part.h5")
    text = SCENE.format(dimension=3, place="left").replace(
        "h5", "h5, tolerance: 1e-8, young_modulus: E"
    )
    text = text.replace(
        "dimension: 3", "dimension: 3\nparameters: {E: {value: 1 GPa, range: [0.7 GPa, 1.4 GPa]}}"
    )
    parameters, family = scenes.family(reading.loads(text, tmp_path))
    fitted = affine.fit(family, parameters)
    one, other = fitted({"E": 1.1e9}).system, family({"E": 1.1e9}).system
    for first, second in zip(one.elastic, other.elastic, strict=True):
        np.testing.assert_allclose(first.gather.section, second.gather.section, rtol=1e-12)
    assert (
        other.elastic[0].gather.section[0].max()
        > 1.05 * family({"E": 1e9}).system.elastic[0].gather.section[0].max()
    )


def test_places_and_dimensions_of_parts_are_checked_at_the_door(tmp_path: Path) -> None:
    part_files.save(alone(), tmp_path / "arm.part.h5")
    scene = reading.loads(SCENE.format(dimension=3, place="middle"), tmp_path)
    with pytest.raises(InputError, match="body 'II': expected one of its points"):
        build.system(scene)


def test_a_body_without_places_cannot_be_trained_alone() -> None:
    with pytest.raises(InputError, match="name its ends or holes"):
        excite(replace(arm(), places={}), Excitation())


def test_cells_of_parts_have_all_of_their_axial_stiffness() -> None:
    """Single points of smooth cubics have next to none of EA, and outputs of parts read one point a
    cell.
    """
    part = cable("b", segment(12), Circular(1e-3), Material(1e9, 1000.0), continuity=2)
    found = parts.one_point(part.cells).section[0]
    assert_allclose(found, 1e9 * np.pi / 4 * 1e-6, rtol=1e-9)
