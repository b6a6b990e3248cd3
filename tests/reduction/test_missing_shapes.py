"""Shapes that a part lacks: seen in runs whose strains stay inside of the training, as much as is missing, and nowhere else."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Body, Circular, Material, cable
from fmbs_skfem.bodies.body import locate, probe
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.bodies.values import changed
from fmbs_skfem.core.linalg import as_dense
from fmbs_skfem.core.notices import Notice, Remark
from fmbs_skfem.core.responses import of_state
from fmbs_skfem.core.rotations import rotation
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    buckling,
    departures,
    integrate,
    missing_shapes,
    outputs,
    solve_equilibria,
    solve_statics,
    vibration_modes,
)
from fmbs_skfem.reduction import part_files, parts
from fmbs_skfem.reduction.excitation import Excitation, excite
from fmbs_skfem.reduction.part_files import Part
from fmbs_skfem.systems import At, Rayleigh, assemble, eliminate, joints, loads, probes
from fmbs_skfem.systems.events import Event
from fmbs_skfem.verification.plates import rectangle
from tests import models
from tests.cli.calls import fmbs

from .test_part_files import alone, arm

SCHEME, SHARP = GeneralizedAlpha(2e-3), Newton(tolerance=1e-12)
WEIGHT = 9.81 * np.array([0.0, 0.0, -0.02])


@cache
def states() -> np.ndarray:
    """Motions of the arm without moments at its ends."""
    return excite(arm(), Excitation(runs=2, step=2e-3, moment=0.0))


@cache
def pinned() -> Part:
    """The arm trained on them: its ends are never bent."""
    return part_files.train(arm(), states())


def clamped(body: Body, weight: np.ndarray = WEIGHT, *more: loads.Load, damping: Rayleigh | None = None) -> Trajectory:
    """The arm clamped at its left end, bent by little."""
    held = [joints.Weld("A", At("arm", "left"))]
    system = assemble([body], held, [loads.Gravity(tuple(weight)), *more], damping=damping)
    return integrate(eliminate(system), SCHEME, 0.6, SHARP, 3)


def missing(run: Trajectory) -> list[departures.Departure]:
    return [one for one in departures.find(run) if one.kind == missing_shapes.KIND]


def left_out(S: np.ndarray, states: np.ndarray) -> float:
    """Largest root mean square of what S leaves out of states (s, b, c) [m]."""
    rest = states - S @ parts.coordinates(arm(), S, states)
    return float(np.sqrt(np.einsum("sbc,bd,sdc->s", rest, parts.metric(arm()).toarray(), rest).max()))


@pytest.mark.parametrize("damping", [None, Rayleigh(20.0, 0.1)])
def test_a_clamp_that_the_training_has_not_seen_is_told_where_no_strain_leaves_it(damping: Rayleigh | None) -> None:
    """By about as much as is missing in the full motion; near the clamp; not of a part that was trained with moments."""
    with pytest.warns(Notice, match=r"part 'arm': missing displacement \[m\] .* near .* since .* other forces and moments"):
        run = clamped(pinned().body, damping=damping)
    (one,) = departures.find(run)
    assert 0.0 < one.place[0] < 0.1
    S, full = pinned().memory.functions, clamped(arm(), damping=damping)  # type: ignore[union-attr]
    q = (full.system.lift.matrix @ full.x.T).T + full.system.lift.offset
    wanted = left_out(S, q.reshape(len(q), -1, 3))
    assert 0.3 * wanted < one.value < 5.0 * wanted
    assert one.value > 2.0 * missing_shapes.BAND * one.trained[1]
    assert departures.find(clamped(alone().body, damping=damping)) == []


@pytest.mark.parametrize(("eps", "error", "told"), [(1e-6, 0.4, True), (1e-8, 0.004, False)])
def test_a_motion_that_is_too_stiff_where_no_displacement_is_missing_is_told(eps: float, error: float, told: bool) -> None:
    """Few functions stretch an arm that bends: its end falls by 40 % too little, and all strains are those of the training."""
    small = part_files.coarsen(alone(), eps)

    def fall(body: Body) -> np.ndarray:
        run = clamped(body, 10.0 * WEIGHT)
        q, at = run.system.lift.matrix @ run.x.T, as_dense(probe(body, locate(body, "right")))
        return np.asarray(np.kron(at, np.eye(3)) @ (q - q[:, :1]))

    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always", Notice)
        found = fall(small.body)
    wanted = fall(arm())
    distance = np.linalg.norm(found - wanted, axis=0).max() / np.linalg.norm(wanted, axis=0).max()
    assert distance == pytest.approx(error, rel=0.1)
    said = [str(one.message) for one in seen if issubclass(one.category, Notice)]
    assert [text.startswith("part 'arm': it bends too little, at least 0.0") for text in said] == [True] * told


def test_a_plate_that_stretches_where_it_bends_is_told_where_it_has_many_functions() -> None:
    """Three corners are held of a plate that was trained with one: 78 of its 144 functions err by 5 % of what it moves."""
    full = plate("sheet", rectangle("bfs", 5, 5, 0.5, 0.5), 3e-3, Material(2e9, 1200.0, 0.3), dim=3)
    part = part_files.train(full, excite(full, Excitation(runs=1, duration=0.4, samples=200, step=1e-3)), 1e-10, None, None)

    def corner(body: Body) -> np.ndarray:
        held = [joints.Pin(name, At("sheet", name)) for name in "abd"]
        seen = {"c": probes.Position(At("sheet", "c"))}
        system = eliminate(assemble([body], held, [loads.Gravity((0.0, 0.0, -9.81))], outputs=seen))
        return np.asarray(outputs(integrate(system, GeneralizedAlpha(1e-3), 0.2, SHARP))["c_z"])

    wanted = corner(full)
    with pytest.warns(Notice, match="part 'sheet': it bends too little, at least 0.0"):
        found = corner(part.body)
    assert np.abs(found - wanted).max() == pytest.approx(0.05 * np.ptp(wanted), rel=0.2)


def test_an_equilibrium_that_needs_shapes_is_told() -> None:
    def bent(body: Body, weight: np.ndarray) -> Trajectory:
        held = [joints.Weld("A", At("arm", "left"))]
        return solve_statics(eliminate(assemble([body], held, [loads.Gravity(tuple(weight))])), 3)

    with pytest.warns(Notice, match="missing displacement"):
        run = bent(pinned().body, WEIGHT)
    (one,) = missing(run)
    S, full = pinned().memory.functions, bent(arm(), WEIGHT)  # type: ignore[union-attr]
    q = full.system.lift.matrix @ full.x[-1] + full.system.lift.offset
    wanted = left_out(S, q.reshape(1, -1, 3))
    assert 0.3 * wanted < one.value < 5.0 * wanted
    assert one.time == pytest.approx(1 / 3)
    assert departures.find(bent(alone().body, 10.0 * WEIGHT)) == []
    _, seen = departures.looks(run)
    half = departures.looks(bent(pinned().body, WEIGHT / 3))[1]["arm"]
    assert_allclose([seen["arm"].sizes[1], seen["arm"].shares[1]], [half.sizes[-1], half.shares[-1]], rtol=1e-6)


def late(t: np.ndarray) -> np.ndarray:
    return np.asarray(np.maximum(t - 2.5, 0.0))


def passing(t: np.ndarray) -> np.ndarray:
    return np.asarray(np.sin(np.pi * t / 3.0))


@pytest.mark.parametrize(("history", "worst"), [(late, 3.0), (passing, 1.5)])
def test_the_worst_of_equilibria_over_time_is_told(history: Callable[[np.ndarray], np.ndarray], worst: float) -> None:
    """At the last one, or in the middle of a load that goes and comes back."""
    held, pull = [joints.Weld("A", At("arm", "left"))], loads.PointForce("F", At("arm", "right"), (0.0, 0.0, 0.1), history)
    system = eliminate(assemble([pinned().body], held, [pull]))
    with pytest.warns(Notice, match="missing displacement"):
        run = solve_equilibria(system, np.linspace(0.0, 3.0, 5))
    (one,) = missing(run)
    times, seen = departures.looks(run)
    sizes = seen["arm"].sizes
    assert one.value == sizes.max() == sizes[int(np.argmin(np.abs(times - worst)))]
    assert one.value > 10.0 * sizes.min()


def said_of(looks: dict[str, missing_shapes.MissingDisplacements]) -> float:
    """By how much the arm bends too little; nothing of a full body."""
    return float(looks["arm"].shares[0]) if looks else 0.0


SCENE = """\
schema: 1
bodies: {arm: {type: part, file: arm.part.h5}}
joints: {clamp: {type: weld, at: arm.left, to: ground}}
loads: {weight: {type: gravity, acceleration: [0, 0, -0.2]}}
outputs: {tip: {type: position, at: arm.right}}
analysis: {type: ANALYSIS}
"""


@pytest.mark.parametrize("analysis", ["dynamic, duration: 0.2 s, step: 2 ms", "static"])
def test_strict_keeps_the_results_of_a_run_that_is_found_outside_when_it_is_over(tmp_path: Path, analysis: str) -> None:
    part_files.save(pinned(), tmp_path / "arm.part.h5")
    (tmp_path / "scene.yaml").write_text(SCENE.replace("ANALYSIS", analysis), encoding="utf-8")
    done, strict = (
        fmbs("run", tmp_path / "scene.yaml", "--json", "--no-plots", "--out", tmp_path / f"out{k}", *options)
        for k, options in enumerate(((), ("--strict",)))
    )
    assert done.code == 0, done.err
    assert [one["kind"] for one in done.json["beyond_training"]] == [missing_shapes.KIND]
    assert (strict.code, strict.json["status"], strict.json["reason"]) == (3, "error", "notice")
    assert "missing displacement" in strict.json["message"]
    for key in ("end", "steps", "beyond_training", "outputs"):
        assert strict.json[key] == done.json[key]
    assert json.loads((tmp_path / "out1" / "report.json").read_text(encoding="utf-8"))["status"] == "error"
    assert (tmp_path / "out1" / "outputs.csv").read_bytes() == (tmp_path / "out0" / "outputs.csv").read_bytes()


@pytest.mark.filterwarnings("error::fmbs_skfem.core.notices.Notice")
def test_a_run_that_is_stopped_by_a_warning_keeps_what_there_is() -> None:
    with pytest.raises(Notice, match="outside since") as caught:
        clamped(pinned().body, 100.0 * WEIGHT)
    assert caught.value.partial.times[-1] > 0.0
    assert missing(caught.value.partial)


def test_a_hinge_that_is_locked_in_a_swing_is_told_where_the_training_had_no_moments() -> None:
    """Velocities jump by M^-1 Phi_q^T, and the arm goes on from a clamp."""
    lock = {"stop": Event(when=of_state("free.z + 0.4"), lock=("hinge",))}
    free = {"free": probes.Position(At("arm", "right"))}

    def swing(body: Body) -> Trajectory:
        held, damping = [joints.Pin("hinge", At("arm", "left"))], Rayleigh(0.0, 2e-4)
        system = assemble([body], held, [loads.Gravity((0.0, 0.0, -9.81))], damping, free, events=lock)
        return integrate(eliminate(system), SCHEME, 0.6, SHARP)

    def path(run: Trajectory) -> np.ndarray:
        return np.stack([outputs(run)[f"free_{axis}"] for axis in "xyz"])

    wanted = swing(arm())
    assert 0.2 < wanted.events[0].time < 0.4
    assert np.abs(path(swing(alone().body)) - path(wanted)).max() < 1e-4
    with pytest.warns(Notice, match="missing displacement"):
        run = swing(pinned().body)
    assert np.abs(path(run) - path(wanted)).max() > 2e-2


def test_a_clamp_where_a_training_had_no_moments_is_told_before_the_run(tmp_path: Path) -> None:
    """As a remark, which --strict does not take for an error; not of pins, of forces, of trainings with moments or unknown ones."""
    record, moments = {"alone": {"moment": 0.0}}, {"alone": {"moment": 0.1}}
    pin = SCENE.replace("weld", "spherical").replace("ANALYSIS", "dynamic, duration: 0.2 s, step: 2 ms")
    weld = pin.replace("spherical", "weld")
    motor = pin.replace("loads: {", "loads: {M: {type: torque, at: arm.right, torque: [0, 1 N mm, 0]}, ")
    short = states()[::40]
    trained = part_files.train(arm(), short, 1e-9, None, 1e-2, **record)
    more = part_files.train(arm(), short, 1e-9, None, 1e-2, trained, **moments)
    other = part_files.train(arm(), short, 1e-9, None, 1e-2, **moments)
    unknown = part_files.train(arm(), short, 1e-9, None, 1e-2)
    cases = [(trained, weld, "left"), (trained, motor, "right"), (trained, pin, ""), (more, weld, ""), (other, weld, "")]
    for number, (part, text, place) in enumerate([*cases, (unknown, weld, "")]):
        folder = tmp_path / f"{number}"
        folder.mkdir()
        part_files.save(part, folder / "arm.part.h5")
        (folder / "scene.yaml").write_text(text, encoding="utf-8")
        done = fmbs("check", folder / "scene.yaml", "--json", "--strict")
        assert done.code == 0, done.err
        told = [one for one in done.json["notices"] if "had no moments" in one]
        assert [f"act on its direction at {place}, where" in one for one in told] == [True] * bool(place)


def test_a_point_of_a_rim_is_not_told_for_the_axes_of_its_rim() -> None:
    """Equations of a frame act on the directions of the points that it carries; a clamp at a point off all rims is told."""
    rim = Rim(("left",), slopes=True)
    full = plate("sheet", rectangle("ancf", 3, 2, 0.3, 0.1), 2e-3, Material(3e9, 1200.0, 0.3), dim=3, rims={"A": rim})
    moved = excite(full, Excitation(runs=1, duration=0.02, samples=20, step=1e-3))
    part = part_files.train(full, moved, 1e-6, None, None, alone={"moment": 0.1}).body
    pin, clamp = joints.Pin("pin", At("sheet", "A")), joints.Clamp("clamp", At("sheet", "b"))
    assert missing_shapes.unbent_places(assemble([part], [pin]), part) == []
    assert missing_shapes.unbent_places(assemble([part], [clamp]), part) == ["b"]


def test_a_part_of_which_nothing_can_be_said_is_named_with_the_reason() -> None:
    old = replace(pinned().body, shapes=replace(pinned().body.shapes, missing=None))  # type: ignore[type-var]
    between = loads.PointForce("F", At("arm", 0.4), (0.0, 0.0, 1e-4))
    for body, more, why in ((old, (), "they know none"), (pinned().body, (between,), "act elsewhere than at their places")):
        with pytest.warns(Remark, match=f"parts 'arm': nothing can be said of shapes that they lack, as .*{why}.*fmbs part check"):
            clamped(body, WEIGHT, *more)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        warnings.simplefilter("error", Remark)
        clamped(alone().body)


def test_equilibria_that_bend_too_little_are_told() -> None:
    """Coarse functions carry what they lack along the line: errors of 2e-4 to 0.2 are said within a factor of five."""

    def sag(body: Body) -> tuple[float, float]:
        held, pull = [joints.Weld("A", At("arm", "left"))], loads.PointForce("F", At("arm", "right"), (0.0, 0.0, -0.2))
        seen = {"free": probes.Position(At("arm", "right"))}
        system = eliminate(assemble([body], held, [pull], outputs=seen))
        run = solve_statics(system, 4)
        return float(outputs(run)["free_z"][-1]), said_of(missing_shapes.look(system, run.x[-1:]))

    wanted, none = sag(arm())
    assert none == 0.0
    whole = part_files.coarsen(alone(), 1e-12)
    for eps in (1e-9, 1e-8):
        z, said = sag(part_files.coarsen(whole, eps).body)
        true = 1.0 - z / wanted
        assert 0.2 * true < said < 5.0 * true
    with pytest.warns(Notice, match="part 'arm': it bends too little, at least .* of itself"):
        z, said = sag(part_files.coarsen(whole, 1e-6).body)
    assert 0.2 * (1.0 - z / wanted) < said < 1.0 - z / wanted
    assert sag(alone().body)[1] < 1e-5


def test_what_is_missing_depends_on_no_place_and_no_direction() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    (one,) = missing(clamped(pinned().body))
    origin = np.array([300.0, -3.0, 2.0])
    (other,) = missing(clamped(parts.placed(pinned().body, "arm", origin, turn), turn @ WEIGHT))
    assert other.value == pytest.approx(one.value, rel=1e-6)
    assert_allclose(other.place, turn @ one.place + origin, atol=1e-9)


def test_what_is_missing_is_a_length_in_any_units() -> None:
    """The arm in millimetres, tonnes and newtons."""
    mesh = models.straight(16, end=(1000.0, 0.0, 0.0))
    full = cable("arm", mesh, Circular(1e3 * models.SECTION.diameter), Material(1e3, 1.8e-9))
    body = part_files.train(full, 1e3 * states()).body
    assert Material(1e9, 1800.0) == models.MATERIAL
    (one,), (other,) = missing(clamped(pinned().body)), missing(clamped(body, 1e3 * WEIGHT))
    assert other.value == pytest.approx(1e3 * one.value, rel=1e-3)
    assert other.trained[1] == pytest.approx(1e3 * one.trained[1], rel=1e-3)


def functions_of(body: Body, *more: loads.Load) -> missing_shapes.Tests | None:
    """The test functions of the clamped arm."""
    held = [joints.Weld("A", At("arm", "left"))]
    system = eliminate(assemble([body], held, [loads.Gravity(tuple(WEIGHT)), *more]))
    return missing_shapes.tests(system, system.elastic[0])


def test_test_functions_vanish_where_joints_and_loads_act() -> None:
    """A force at the free end takes functions away; one between the places leaves none that is known."""
    one = functions_of(pinned().body)
    two = functions_of(pinned().body, loads.PointForce("F", At("arm", "right"), (0.0, 0.0, 1.0)))
    assert one is not None
    assert two is not None
    assert functions_of(pinned().body, loads.PointForce("F", At("arm", 0.4), (0.0, 0.0, 1.0))) is None
    run = clamped(alone().body, WEIGHT, loads.PointForce("F", At("arm", "right"), (0.0, 0.1, 0.0)))
    assert missing(run) == []


def check_estimates(find: Callable[[Body], tuple[np.ndarray, np.ndarray | None]], least: float) -> None:
    """Numbers that are too high without moments in the training: at least a part of that is said, and no more than 1.1 of it."""
    (wanted, none), (high, said), (_, little) = find(arm()), find(pinned().body), find(alone().body)
    assert none is None
    assert said is not None
    assert little is not None
    true = high / wanted - 1.0
    assert true.min() > 0.02
    assert (said > least * true).all()
    assert (said < 1.1 * true).all()
    assert little.max() < 1e-5


def test_frequencies_of_a_clamp_that_the_training_has_not_seen_are_too_high_by_as_much_as_is_said() -> None:
    """An estimate from below by some shapes: 0.6 of it; nothing of a part that was trained with moments, or of a full body."""

    def modes(body: Body) -> tuple[np.ndarray, np.ndarray | None]:
        system = eliminate(assemble([body], [joints.Weld("A", At("arm", "left"))]))
        found = vibration_modes(system, 6)
        return found.frequencies, missing_shapes.too_high(system, system.x0, found.frequencies, found.shapes)

    check_estimates(modes, 0.5)


def test_load_factors_of_buckling_are_too_large_by_as_much_as_is_said() -> None:
    def column(body: Body) -> tuple[np.ndarray, np.ndarray | None]:
        push = loads.PointForce("F", At("arm", "right"), (-1.0, 0.0, 0.0))
        system = eliminate(assemble([body], [joints.Weld("A", At("arm", "left"))], [push]))
        found = buckling(system, 4)
        return found.factors, missing_shapes.too_strong(system, found)

    check_estimates(column, 0.4)


def test_parts_made_of_other_numbers_miss_the_same_where_all_forces_grow_alike() -> None:
    stiff = changed(pinned().body, {"young_modulus": 4e9, "density": 7200.0})
    one, other = functions_of(pinned().body), functions_of(stiff)
    assert one is not None
    assert other is not None
    z, a = pinned().memory.states[50], 0.1 * pinned().memory.states[60]  # type: ignore[union-attr]
    first, second = (missing_shapes.look_at(tests, z[None], (0.0 * z[None], a[None])).sizes[0] for tests in (one, other))
    assert first > 0.0
    assert second == pytest.approx(first, rel=1e-9)


def test_the_stiffness_of_the_start_is_used_where_it_shows_that_little_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """It says at least half of what is missing in all states of the training, however they are turned."""
    tests, z = functions_of(pinned().body), pinned().memory.states  # type: ignore[union-attr]
    assert tests is not None

    def sizes(sure: float, turn: np.ndarray) -> np.ndarray:
        monkeypatch.setattr(missing_shapes, "SURE", sure)
        return missing_shapes.look_at(tests, z @ turn, (0.0 * z, 0.2 * z @ turn)).sizes

    usual, exact, rough = (sizes(sure, np.eye(3)) for sure in (missing_shapes.SURE, 0.0, np.inf))
    assert (rough > 0.5 * exact).all()
    much = rough > 0.25 * missing_shapes.BAND * pinned().body.shapes.missing.left_out  # type: ignore[union-attr]
    assert 0 < much.sum() < len(z)
    assert_allclose(usual, np.where(much, exact, rough), rtol=1e-9)
    tests = replace(tests, weight=0.0 * tests.weight)
    assert_allclose(sizes(np.inf, rotation([0.3, -2.0, 1.0])), sizes(np.inf, np.eye(3)), rtol=1e-6, atol=1e-15)


def test_coarser_parts_and_files_know_what_they_miss(tmp_path: Path) -> None:
    part = part_files.resume(part_files.save(pinned(), tmp_path / "arm.part.h5"))
    small = part_files.coarsen(part, 1e-8)
    known = small.body.shapes.missing  # type: ignore[union-attr]
    S = small.memory.functions  # type: ignore[union-attr]
    wanted = left_out(S, states())
    assert 0.5 * wanted < known.left_out < 1.1 * wanted
    own = known.metric.shape[0] - S.shape[1]
    assert_allclose(known.metric[:, -own:], np.eye(len(known.metric))[:, -own:], atol=1e-9)
    assert missing(clamped(part.body))[0].value == missing(clamped(pinned().body))[0].value
    more = excite(arm(), Excitation(runs=1, step=2e-3, duration=0.5))
    again = part_files.train(arm(), more, 1e-10, None, 1e-4, part)
    assert again.body.shapes.missing.left_out >= part.body.shapes.missing.left_out  # type: ignore[union-attr]
    old = replace(part.body, shapes=replace(part.body.shapes, missing=None))  # type: ignore[type-var]
    assert departures.find(clamped(old)) == []
