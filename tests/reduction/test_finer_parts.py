"""Parts are held against finer ones: what they err by is known and told in every door, and parts
that are good are silent.
"""

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

from fmbs_skfem.bodies import Body, Circular, Material, cable, finer
from fmbs_skfem.bodies.body import locate, probe
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.bodies.spare_shapes import MissingShapes
from fmbs_skfem.control.events import Event
from fmbs_skfem.control.live import LiveRun
from fmbs_skfem.core.errors import Reason, SolverError
from fmbs_skfem.core.notices import Labelled, Notice, Progress, Remark
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import (
    ArcLength,
    GeneralizedAlpha,
    Newton,
    Trajectory,
    buckling,
    follow_path,
    integrate,
    outputs,
    solve_equilibria,
    solve_statics,
    start,
    vibration_modes,
)
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.parts import finer_parts, static_states, unbent_places
from fmbs_skfem.parts.excitation import Excitation, excite
from fmbs_skfem.parts.files import Part
from fmbs_skfem.parts.rescaling import rescale
from fmbs_skfem.reduction.accuracy import output_errors, runs
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.systems import At, Rayleigh, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from tests import models
from tests.cli.calls import fmbs
from verification.plates import rectangle
from verification.vibration import ring

from .. import solids
from .test_part_files import arm, of_states, unknown

SCHEME, SHARP = GeneralizedAlpha(2e-3), Newton(tolerance=1e-12)
WEIGHT = 9.81 * np.array([0.0, 0.0, -0.02])
TOLD = "do not stand for their bodies here, .* is off by"


@cache
def states() -> np.ndarray:
    """Motions of the arm without moments at its ends."""
    return excite(arm(), Excitation(runs=2, step=2e-3, moment=0.0))


@cache
def pinned() -> Part:
    """The arm trained on them: its ends are never bent."""
    return of_states(arm(), states())


@cache
def alone() -> Part:
    """The arm trained with moments."""
    return of_states(arm(), excite(arm(), Excitation(runs=4, step=1e-3)))


def hung(
    body: Body, weight: np.ndarray = WEIGHT, *more: loads.Load, damping: Rayleigh | None = None
) -> System:
    """The arm clamped at its left end, bent by little."""
    held, seen = (
        [joints.Weld("A", At("arm", "left"))],
        {"free": probes.Position(At("arm", "right"))},
    )
    return eliminate(assemble([body], held, [loads.Gravity(tuple(weight)), *more], damping, seen))


def clamped(
    body: Body, weight: np.ndarray = WEIGHT, *more: loads.Load, damping: Rayleigh | None = None
) -> Trajectory:
    return integrate(hung(body, weight, *more, damping=damping), SCHEME, 0.6, SHARP, 3)


def errors(full: Trajectory, part: Trajectory) -> dict[str, float]:
    """True errors of outputs by column, over the ranges that count here."""
    found = output_errors.between(
        output_errors.columns(full),
        output_errors.columns(part),
        full.system.outputs,
        finer_parts.QUIET,
    )
    return {name: one.relative for name, one in found.items() if np.isfinite(one.relative)}


def check_known(full: Trajectory, part: Trajectory, rel: float = 0.2) -> float:
    """The errors of a part are the true ones, by a fifth where they are told; the largest one."""
    true, said = errors(full, part), part.part_errors
    assert said is not None
    worst = max(true, key=lambda name: true[name])
    assert said[worst] == pytest.approx(true[worst], rel=rel)
    return true[worst]


def silent(make: Callable[[], Trajectory]) -> Trajectory:
    """What is made without a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        return make()


@pytest.mark.parametrize("damping", [None, Rayleigh(20.0, 0.1)])
def test_a_clamp_that_the_training_has_not_seen_is_told_with_its_error(
    damping: Rayleigh | None,
) -> None:
    """Where no strain leaves the training; not of a part that was trained with moments."""
    with pytest.warns(
        Notice, match=rf"parts 'arm' {TOLD}.* --alone --push .* --moment .* --fastest .* --continue"
    ):
        run = clamped(pinned().body, damping=damping)
    full = clamped(arm(), damping=damping)
    assert check_known(full, run) > 0.02
    good = silent(lambda: clamped(alone().body, damping=damping))
    assert max(errors(full, good).values()) < 0.01


@pytest.mark.parametrize(("eps", "error", "told"), [(1e-6, 0.4, True), (1e-8, 0.004, False)])
def test_a_motion_that_is_too_stiff_is_told_without_outputs_as_well(
    eps: float, error: float, told: bool
) -> None:
    """Few functions stretch an arm that bends: its end falls by 40 % too little, and all strains
    are those of the training.
    """
    small = part_files.coarsen(alone(), eps)

    def fall(body: Body) -> Trajectory:
        return integrate(replace(hung(body, 10.0 * WEIGHT), outputs={}), SCHEME, 0.6, SHARP, 3)

    def path(run: Trajectory) -> np.ndarray:
        body = small.body if run.part_errors is not None else arm()
        at = np.kron(probe(body, locate(body, "right")).toarray(), np.eye(3))
        q = run.system.lift.matrix @ run.x.T
        return np.asarray(at @ (q - q[:, :1]))

    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always", Notice)
        found = fall(small.body)
    wanted = path(fall(arm()))
    distance = (
        np.linalg.norm(path(found) - wanted, axis=0).max() / np.linalg.norm(wanted, axis=0).max()
    )
    assert distance == pytest.approx(error, rel=0.1)
    assert found.part_errors == {"arm places": pytest.approx(distance, rel=0.2)}
    said = [str(one.message) for one in seen if one.category is Notice]
    assert [
        "'arm' do not stand for their bodies here, arm places is off by" in text for text in said
    ] == [True] * told


def test_a_plate_that_stretches_where_it_bends_is_told_where_it_has_many_functions() -> None:
    """Three corners are held of a plate that was trained with one: 78 of its 144 functions err by 5
    % of what it moves.
    """
    full = plate("sheet", rectangle("bfs", 5, 5, 0.5, 0.5), 3e-3, Material(2e9, 1200.0, 0.3), dim=3)
    part = of_states(
        full,
        excite(full, Excitation(runs=1, duration=0.4, samples=200, step=1e-3)),
        1e-10,
        None,
        None,
    )

    def corner(body: Body) -> Trajectory:
        held = [joints.Pin(name, At("sheet", name)) for name in "abd"]
        seen = {"c": probes.Position(At("sheet", "c"))}
        system = eliminate(assemble([body], held, [loads.Gravity((0.0, 0.0, -9.81))], outputs=seen))
        return integrate(system, GeneralizedAlpha(1e-3), 0.2, SHARP)

    with pytest.warns(Notice, match=f"parts 'sheet' {TOLD}"):
        found = corner(part.body)
    wanted = corner(full)
    c = outputs(wanted)["c_z"]
    assert np.abs(outputs(found)["c_z"] - c).max() == pytest.approx(0.05 * np.ptp(c), rel=0.2)
    check_known(wanted, found, 0.3)


def test_an_equilibrium_that_needs_shapes_is_told() -> None:
    def bent(body: Body, weight: np.ndarray) -> Trajectory:
        return solve_statics(hung(body, weight), 3)

    with pytest.warns(Notice, match=TOLD):
        run = bent(pinned().body, WEIGHT)
    assert check_known(bent(arm(), WEIGHT), run) > 0.02
    silent(lambda: bent(alone().body, 10.0 * WEIGHT))


def test_a_load_path_by_arc_length_is_held_against_that_of_a_finer_part() -> None:
    def bent(body: Body) -> Trajectory:
        return follow_path(hung(body), ArcLength(0.3))

    with pytest.warns(Notice, match=TOLD):
        found = bent(pinned().body)
    wanted = bent(arm())
    ends = [outputs(one)["free_z"][-1] for one in (found, wanted)]
    assert (found.part_errors or {})["free_z"] == pytest.approx(
        abs(ends[0] / ends[1] - 1.0), rel=0.2
    )
    silent(lambda: bent(alone().body))


def late(t: np.ndarray) -> np.ndarray:
    return np.asarray(np.maximum(t - 2.5, 0.0))


def passing(t: np.ndarray) -> np.ndarray:
    return np.asarray(np.sin(np.pi * t / 3.0))


@pytest.mark.parametrize("history", [late, passing])
def test_the_worst_of_equilibria_over_time_is_told(
    history: Callable[[np.ndarray], np.ndarray],
) -> None:
    """At the last one, or in the middle of a load that goes and comes back."""
    held, pull = (
        [joints.Weld("A", At("arm", "left"))],
        loads.PointForce("F", At("arm", "right"), (0.0, 0.0, 0.1), history),
    )
    seen = {"free": probes.Position(At("arm", "right"))}

    def bent(body: Body) -> Trajectory:
        return solve_equilibria(
            eliminate(assemble([body], held, [pull], outputs=seen)), np.linspace(0.0, 3.0, 5)
        )

    with pytest.warns(Notice, match=TOLD):
        run = bent(pinned().body)
    check_known(bent(arm()), run)


SCENE = """\
schema: 1
bodies: {arm: {type: part, file: arm.part.h5}}
joints: {clamp: {type: weld, at: arm.left, to: ground}}
loads: {weight: {type: gravity, acceleration: [0, 0, -0.2]}}
outputs: {tip: {type: position, at: arm.right}}
analysis: {type: ANALYSIS}
"""


@pytest.mark.parametrize("analysis", ["dynamic, duration: 0.2 s, step: 2 ms", "static"])
def test_strict_keeps_the_results_of_a_run_that_is_found_outside_when_it_is_over(
    tmp_path: Path, analysis: str
) -> None:
    part_files.save(pinned(), tmp_path / "arm.part.h5")
    (tmp_path / "scene.yaml").write_text(SCENE.replace("ANALYSIS", analysis), encoding="utf-8")
    done, strict = (
        fmbs(
            "run",
            tmp_path / "scene.yaml",
            "--json",
            "--no-plots",
            "--out",
            tmp_path / f"out{k}",
            *options,
        )
        for k, options in enumerate(((), ("--strict",)))
    )
    assert done.code == 0, done.err
    assert max(done.json["part_errors"].values()) > 0.01
    assert (strict.code, strict.json["status"], strict.json["reason"]) == (3, "error", "notice")
    assert "do not stand for their bodies" in strict.json["message"]
    for key in ("end", "steps", "part_errors", "outputs"):
        assert strict.json[key] == done.json[key]
    assert (
        json.loads((tmp_path / "out1" / "report.json").read_text(encoding="utf-8"))["status"]
        == "error"
    )
    assert (tmp_path / "out1" / "outputs.csv").read_bytes() == (
        tmp_path / "out0" / "outputs.csv"
    ).read_bytes()


@pytest.mark.filterwarnings("error::fmbs_skfem.core.notices.Notice")
def test_a_run_that_ends_with_a_warning_keeps_what_there_is() -> None:
    with pytest.raises(Notice, match=TOLD) as caught:
        clamped(pinned().body)
    assert caught.value.partial.times[-1] == pytest.approx(0.6)
    assert max(caught.value.partial.part_errors.values()) > 0.02


def test_a_hinge_that_is_locked_in_a_swing_is_told_where_the_training_had_no_moments() -> None:
    """Velocities jump by M^-1 Phi_q^T, and the arm goes on from a clamp."""
    lock = {"stop": Event(when=of_state("free.z + 0.4"), lock=("hinge",))}
    free = {"free": probes.Position(At("arm", "right"))}

    def swing(body: Body) -> Trajectory:
        held, damping = [joints.Pin("hinge", At("arm", "left"))], Rayleigh(0.0, 2e-4)
        system = assemble(
            [body], held, [loads.Gravity((0.0, 0.0, -9.81))], damping, free, events=lock
        )
        return integrate(eliminate(system), SCHEME, 0.6, SHARP)

    def path(run: Trajectory) -> np.ndarray:
        return np.stack([outputs(run)[f"free_{axis}"] for axis in "xyz"])

    wanted = swing(arm())
    assert 0.2 < wanted.events[0].time < 0.4
    good = silent(lambda: swing(alone().body))
    assert np.abs(path(good) - path(wanted)).max() < 1e-4
    with pytest.warns(Notice, match=TOLD):
        run = swing(pinned().body)
    assert np.abs(path(run) - path(wanted)).max() > 2e-2


def test_velocities_that_jump_a_step_earlier_are_no_error() -> None:
    """Of impacts; a jump of another height is."""
    t = np.linspace(0.0, 1.0, 200)
    fall = np.where(t < 0.5, -t, 0.3)
    assert np.abs(finer_parts.settled(fall, np.roll(fall, 1)) - np.roll(fall, 1))[1:].max() < 0.02
    other = np.where(t < 0.5, -t, 0.4)
    assert np.abs(finer_parts.settled(fall, other) - other).max() == pytest.approx(0.1)


def test_a_clamp_where_a_training_had_no_moments_is_told_before_the_run(tmp_path: Path) -> None:
    """As a remark, which --strict does not take for an error; not of pins, of forces, of trainings
    with moments or unknown ones.
    """
    record, moments = {"alone": {"moment": 0.0}}, {"alone": {"moment": 0.1}}
    pin = SCENE.replace("weld", "spherical").replace(
        "ANALYSIS", "dynamic, duration: 0.2 s, step: 2 ms"
    )
    weld = pin.replace("spherical", "weld")
    motor = pin.replace(
        "loads: {", "loads: {M: {type: torque, at: arm.right, torque: [0, 1 N mm, 0]}, "
    )
    short = states()[::40]
    trained = of_states(arm(), short, 1e-9, None, 1e-2, **record)
    more = of_states(arm(), short, 1e-9, None, 1e-2, trained, **moments)
    other = of_states(arm(), short, 1e-9, None, 1e-2, **moments)
    unknown = of_states(arm(), short, 1e-9, None, 1e-2)
    cases = [
        (trained, weld, "left"),
        (trained, motor, "right"),
        (trained, pin, ""),
        (more, weld, ""),
        (other, weld, ""),
    ]
    for number, (part, text, place) in enumerate([*cases, (unknown, weld, "")]):
        folder = tmp_path / f"{number}"
        folder.mkdir()
        part_files.save(part, folder / "arm.part.h5")
        (folder / "scene.yaml").write_text(text, encoding="utf-8")
        done = fmbs("check", folder / "scene.yaml", "--json", "--strict")
        assert done.code == 0, done.err
        told = [one for one in done.json["notices"] if "had no moments" in one]
        assert [f"act on its direction at {place}, where" in one for one in told] == [True] * bool(
            place
        )


def test_a_point_of_a_rim_is_not_told_for_the_axes_of_its_rim() -> None:
    """Equations of a frame act on the directions of the points that it carries; a clamp at a point
    off all rims is told.
    """
    rim = Rim(("left",), slopes=True)
    full = plate(
        "sheet",
        rectangle("ancf", 3, 2, 0.3, 0.1),
        2e-3,
        Material(3e9, 1200.0, 0.3),
        dim=3,
        rims={"A": rim},
    )
    moved = excite(full, Excitation(runs=1, duration=0.02, samples=20, step=1e-3))
    part = of_states(full, moved, 1e-6, None, None, alone={"moment": 0.1}).body
    pin, clamp = joints.Pin("pin", At("sheet", "A")), joints.Clamp("clamp", At("sheet", "b"))
    assert unbent_places.unbent_places(assemble([part], [pin]), part) == []
    assert unbent_places.unbent_places(assemble([part], [clamp]), part) == ["b"]


def test_a_part_of_which_nothing_can_be_said_is_named() -> None:
    with pytest.warns(
        Remark,
        match="parts 'arm': nothing can be said of shapes that they lack, as they know no others.*fmbs part check",
    ):
        run = clamped(unknown(pinned().body))
    assert run.part_errors is None


def test_a_load_between_the_places_of_a_part_is_held_against_its_body_as_well() -> None:
    between = loads.PointForce("F", At("arm", 0.4), (0.0, 0.0, 1e-2))
    with pytest.warns(Notice, match=TOLD):
        run = clamped(pinned().body, WEIGHT, between)
    check_known(clamped(arm(), WEIGHT, between), run)


def test_equilibria_that_bend_too_little_err_by_what_is_said() -> None:
    def sag(body: Body) -> Trajectory:
        return solve_statics(
            hung(body, 0.0 * WEIGHT, loads.PointForce("F", At("arm", "right"), (0.0, 0.0, -0.2))), 4
        )

    wanted, whole = sag(arm()), part_files.coarsen(alone(), 1e-12)
    for eps, told in ((1e-9, False), (1e-8, False), (1e-6, True)):
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            check_known(wanted, sag(part_files.coarsen(whole, eps).body), 0.3)
        assert bool([one for one in seen if one.category is Notice]) == told


def test_a_part_that_cannot_bend_is_told() -> None:
    """With four functions an arm of the plane that is clamped at both ends is at rest."""
    full = cable("arm", models.segment(16), models.SECTION, models.MATERIAL, dim=2)
    part = of_states(full, excite(full, Excitation(runs=2, step=2e-3)))
    held = [joints.Clamp("A", At("arm", "left")), joints.Clamp("B", At("arm", "right"))]
    stiff = part_files.coarsen(part, None, 4).body
    system = eliminate(
        assemble([stiff], held, [loads.Gravity((0.0, -9.81))], outputs={"energy": probes.Energy()})
    )
    with pytest.warns(Notice, match="energy_strain is off by 100 %"):
        integrate(system, GeneralizedAlpha(1e-3), 0.1)


def test_errors_depend_on_no_place_and_no_direction() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    origin = np.array([300.0, -3.0, 2.0])
    with pytest.warns(Notice):
        one, other = (
            clamped(pinned().body),
            clamped(parts.placed(pinned().body, "arm", origin, turn), turn @ WEIGHT),
        )
    assert max((other.part_errors or {}).values()) == pytest.approx(
        max((one.part_errors or {}).values()), rel=1e-3
    )


def test_errors_are_the_same_in_any_units() -> None:
    """The arm in millimetres, tonnes and newtons."""
    mesh = models.segment(16, end=(1000.0, 0.0, 0.0))
    full = cable("arm", mesh, Circular(1e3 * models.SECTION.diameter), Material(1e3, 1.8e-9))
    body = of_states(full, 1e3 * states()).body
    assert Material(1e9, 1800.0) == models.MATERIAL
    with pytest.warns(Notice):
        one, other = clamped(pinned().body), clamped(body, 1e3 * WEIGHT)
    assert (other.part_errors or {})["free_z"] == pytest.approx(
        (one.part_errors or {})["free_z"], rel=1e-2
    )


def check_sizes(again: Callable[[System], np.ndarray], make: Callable[[Body], System]) -> None:
    """Numbers that are too high without moments in the training are said to be, by a tenth; nothing
    of a full body.
    """
    wanted = again(make(arm()))
    assert finer_parts.of_finer(make(arm()), again) is None
    for body, least in ((pinned().body, 0.02), (alone().body, 0.0)):
        found, known = again(make(body)), finer_parts.of_finer(make(body), again)
        assert known is not None
        said, true = finer_parts.too_high(found, known), found / wanted - 1.0
        assert true.min() > (least or -1e-3)
        assert_allclose(said, true, rtol=0.1, atol=1e-3)


def test_frequencies_of_a_clamp_that_the_training_has_not_seen_are_too_high_by_as_much_as_is_said() -> (
    None
):
    check_sizes(
        lambda system: vibration_modes(system, 6).angular_frequencies,
        lambda body: replace_loads(body),
    )


def replace_loads(body: Body) -> System:
    """The arm clamped, without loads."""
    return eliminate(assemble([body], [joints.Weld("A", At("arm", "left"))]))


def test_load_factors_of_buckling_are_too_large_by_as_much_as_is_said() -> None:
    def column(body: Body) -> System:
        push = loads.PointForce("F", At("arm", "right"), (-1.0, 0.0, 0.0))
        return eliminate(assemble([body], [joints.Weld("A", At("arm", "left"))], [push]))

    check_sizes(lambda system: buckling(system, 4).factors, column)


def test_a_live_run_says_what_it_errs_by() -> None:
    """As the whole run does; steps that a finer part cannot take end what can be said."""

    def steps(body: Body) -> LiveRun:
        run = start(hung(body), SCHEME)
        for _ in range(300):
            run.step()
        return run

    with pytest.warns(Notice, match=TOLD):
        steps(pinned().body)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        good = steps(alone().body)
    assert good.beside
    good.state = good.state
    assert not good.beside


def test_the_second_run_may_fail() -> None:
    def fails(system: System, progress: Progress | None) -> Trajectory:
        raise SolverError("Newton's iteration diverged", Reason.DIVERGED)

    motion = clamped(alone().body)
    with pytest.warns(
        Notice, match="it fails .Newton's iteration diverged.: their error is not known"
    ):
        found = finer_parts.hold_against(motion, hung(alone().body), fails)
    assert found.part_errors == motion.part_errors


def test_the_second_run_is_shown_and_its_cost_is_known() -> None:
    shown: list[tuple[str, float]] = []
    system = hung(alone().body)
    run = integrate(
        system,
        SCHEME,
        0.6,
        SHARP,
        3,
        Labelled(lambda label, done: shown.append((label, done)), "integrating"),
    )
    assert list(dict.fromkeys(label for label, _ in shown)) == ["integrating", "checking parts"]
    assert shown[-1] == ("checking parts", 1.0)
    other = finer_parts.finer(system)
    assert other is not None
    assert (run.part_check or {})["unknowns"] == other.size > system.size
    plain: list[float] = []
    integrate(system, SCHEME, 0.6, SHARP, 3, plain.append)
    assert plain == sorted(plain), "a progress without a name does not begin again"


def test_a_part_that_is_not_to_be_checked_says_nothing_but_of_its_strains() -> None:
    given = parts.placed(pinned().body, "arm", check=False)
    run = silent(lambda: clamped(given))
    assert (run.part_errors, run.part_check) == (None, None)
    with pytest.warns(Notice, match="outside since"):
        clamped(given, 30.0 * WEIGHT)


def test_a_scene_may_ask_for_no_check(tmp_path: Path) -> None:
    part_files.save(pinned(), tmp_path / "arm.part.h5")
    text = SCENE.replace("ANALYSIS", "dynamic, duration: 0.2 s, step: 2 ms")
    for name, asked in (("with", ""), ("without", ", check: false")):
        (tmp_path / f"{name}.yaml").write_text(
            text.replace("arm.part.h5", f"arm.part.h5{asked}"), encoding="utf-8"
        )
    checked, plain = (
        fmbs(
            "run", tmp_path / f"{name}.yaml", "--json", "--no-plots", "--out", tmp_path / name
        ).json
        for name in ("with", "without")
    )
    assert set(checked["part_check"]) == {"unknowns", "cpu_s", "wall_s"}
    assert "part_errors" not in plain
    assert not any("parts" in line for line in plain["notices"])
    assert plain["outputs"] == checked["outputs"]


def test_runs_that_differ_in_their_step_alone_are_checked_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Neither the run that says how far the step is off nor a repeated one finds the errors of
    parts again.
    """
    found: list[float] = []
    errors_of = finer_parts.errors
    monkeypatch.setattr(
        finer_parts, "errors", lambda *given: found.append(1.0) or errors_of(*given)
    )
    case = Case(hung(alone().body), SCHEME, 0.2, SHARP)
    kept = np.arange(0, 101, 5)
    full = runs.run_fastest(case, kept, 3)
    assert full.part_errors is not None
    assert len(found) == 1
    others = runs.run_other_steps(case, kept, [], order=True, expensive=False)
    assert len(found) == 1
    assert runs.step_error(full, others, SCHEME.step) is not None


def test_parts_made_of_other_numbers_err_alike_where_all_forces_grow_alike() -> None:
    stiff = rescale(pinned().body, {"young_modulus": 4e9, "density": 7200.0})
    with pytest.warns(Notice):
        one, other = clamped(pinned().body), clamped(stiff)
    assert (other.part_errors or {})["free_z"] == pytest.approx(
        (one.part_errors or {})["free_z"], rel=1e-3
    )


def check_is_reduced(full: Body, part: Body, functions: np.ndarray) -> None:
    """A finer part is the full body with functions (b, f), at all points, places and frames."""
    fine, wanted = finer.finer(part), parts.reduced_body(full, functions)
    assert fine.shapes is not None
    assert wanted.shapes is not None
    assert_allclose(fine.mass.toarray(), wanted.mass.toarray(), atol=1e-9 * abs(wanted.mass).max())
    assert_allclose(
        fine.shapes.table, wanted.shapes.table, atol=1e-9 * np.abs(wanted.shapes.table).max()
    )
    assert_allclose(fine.reference, wanted.reference, atol=1e-9)
    assert_allclose(fine.constant, wanted.constant, atol=1e-9)
    for name in (*part.places, *part.frames):
        for vector in range(2):
            rows = [probe(body, locate(body, name), vector).toarray() for body in (fine, wanted)]
            assert_allclose(*rows, atol=1e-9 * np.abs(rows[1]).max())


def at_rest(body: Body) -> Part:
    """A part of a solid, trained by forces."""
    states = static_states.find(body, Excitation(runs=2, strain=1e-3))[0]
    return of_states(body, states, 1e-8, None, None)


def of_body(full: Body, missing: MissingShapes) -> np.ndarray:
    """The functions T (b, t) of a full body, by what they are over its space and at its frames."""
    spread = np.eye(len(full.reference)) if full.spread is None else full.spread.toarray()
    if full.axes is None:
        return np.linalg.lstsq(spread, missing.over_space, rcond=None)[0]
    both = np.vstack([spread, full.axes.toarray()])
    return np.linalg.lstsq(both, np.vstack([missing.over_space, missing.axes]), rcond=None)[0]


def test_a_finer_part_is_its_body_with_more_functions(tmp_path: Path) -> None:
    """Also from a file, of a body with rims, of a solid, whose frames are read by nodes, and of a
    part that was made coarser, whose finer part has what it left.
    """
    rims = {"hub": Rim(("inner",), slopes=True), "edge": Rim(("outer",), slopes=True)}
    steel = Material(young_modulus=2e8, density=1000.0, poisson_ratio=0.3)
    washer = plate("washer", ring(0.1, 0.3, 8), 5e-3, steel, dim=3, rims=rims)
    moved = excite(washer, Excitation(runs=1, step=2e-3, duration=0.05, samples=25))
    for full, part in (
        (arm(), pinned()),
        (washer, of_states(washer, moved, 1e-8, None, None)),
        (block := solids.bar(solids.box((2, 1, 1)), "left right"), at_rest(block)),
    ):
        read = part_files.resume(part_files.save(part, tmp_path / f"{full.name}.part.h5"))
        assert read.memory is not None
        missing = read.body.shapes.missing  # type: ignore[union-attr]
        assert missing is not None
        check_is_reduced(
            full, read.body, np.hstack([read.memory.functions, of_body(full, missing)])
        )
        small = part_files.coarsen(read, 1e-6)
        less = small.body.shapes.missing  # type: ignore[union-attr]
        assert small.memory is not None
        assert less is not None
        check_is_reduced(full, small.body, np.hstack([small.memory.functions, of_body(full, less)]))
