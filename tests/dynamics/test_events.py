"""Events: located to the order of the step, exact behind them, the same in reduced and saved
models, and hard cases.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad

from fmbs_skfem.bodies import cable, sections
from fmbs_skfem.bodies.body import point_mass
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.control.events import Event, Latch
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.notices import Notice, Remark
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    energies,
    energy_errors,
    integrate,
    outputs,
    start,
)
from fmbs_skfem.dynamics.checkpoint import Checkpoint, Resumed, Rows
from fmbs_skfem.reduction import files
from fmbs_skfem.reduction.hyper import sampling
from fmbs_skfem.reduction.spaces import component, galerkin, pod
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import At, Motion, Rayleigh, System, assemble, eliminate, layouts
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import models

TIGHT = Newton(tolerance=1e-12)
G, M, J, SPIN, ANGLE = 9.81, 1.5, 0.1, 4.0, 0.7
ROD, PIN = At("rod", "frame"), At("rod", "O")
H = 5e-3


def event(when: str, **more: object) -> Event:
    return Event(when=of_state(when), **more)  # type: ignore[arg-type]


def rod(
    events: Mapping[str, Event],
    form: Callable[[System], System] = eliminate,
    weight: tuple[float, float] = (0.0, -G),
    spin: float = SPIN,
    more: Sequence[joints.Joint] = (),
    pushed: Sequence[loads.Load] = (),
) -> System:
    """A rigid rod on a pin at the origin, 1 m below which is its centre."""
    outputs = {
        "tip": probes.Position(ROD),
        "angle": probes.Angle(ROD),
        "rate": probes.AngularVelocity(ROD),
    }
    return form(
        assemble(
            [rigid("rod", M, J, (0.0, -1.0), dim=2, places={"O": (0.0, 0.0)})],
            [joints.Pin("pin", PIN), *more],
            [loads.Gravity(weight), *pushed],
            outputs=outputs | {"pin": probes.Reaction("pin"), "E": probes.Energy()},
            initial={"rod": Motion((0.0, 0.0), spin)},
            events=events,
        )
    )


def rate(angle: float) -> float:
    """Of the rod on its pin, by its energy."""
    return float(np.sqrt(SPIN**2 - 2 * M * G * (1 - np.cos(angle)) / (J + M)))


TIME, RATE = quad(lambda angle: 1 / rate(angle), 0.0, ANGLE)[0], rate(ANGLE)


def flight(t: np.ndarray) -> np.ndarray:
    """Place of the centre and angle of the rod (3, s) after it has been released at ANGLE."""
    s = t - TIME
    x, y = (
        np.sin(ANGLE) + RATE * np.cos(ANGLE) * s,
        -np.cos(ANGLE) + RATE * np.sin(ANGLE) * s - G * s**2 / 2,
    )
    return np.array([x, y, ANGLE + RATE * s])


@pytest.mark.parametrize(
    "form", [eliminate, lambda system: system], ids=["eliminated", "multipliers"]
)
def test_a_released_body_flies_on_a_parabola(form: Callable[[System], System]) -> None:
    """With errors of second order, from that of the time of the release on; the pin carries nothing
    then.
    """
    errors = []
    for h in (H, H / 2):
        motion = integrate(
            rod({"fly": event(f"angle - {ANGLE}", release=("pin",))}, form),
            GeneralizedAlpha(h),
            0.6,
            TIGHT,
        )
        found, (one,) = outputs(motion), motion.events
        free = motion.times > TIME + h
        away = zip(("tip_x", "tip_y", "angle"), flight(motion.times[free]), strict=True)
        errors.append(
            [abs(one.time - TIME), *(np.abs(found[name][free] - part).max() for name, part in away)]
        )
        assert not found["pin_x"][free].any()
        assert one.loss == 0.0
    assert (np.array(errors[1]) < [3e-6, 1e-5, 3e-5, 1e-5]).all()
    assert_allclose(np.log2(np.divide(errors[0], errors[1]))[[0, 2]], 2.0, atol=0.1)


def test_a_locked_hinge_stands_still_and_lets_go() -> None:
    """All kinetic energy is lost and told in the balance; reactions are those at rest, and the
    released rod falls from there.
    """
    told = {
        "brake": event(f"angle - {ANGLE}", lock=("pin",)),
        "go": event("t - 0.3", release=("pin",)),
    }
    motion = integrate(rod(told), GeneralizedAlpha(H), 0.5, TIGHT)
    found, (brake, go) = outputs(motion), motion.events
    held = (motion.times > TIME + H) & (motion.times < 0.3 - H)
    assert_allclose(found["angle"][held], ANGLE, atol=1e-12)
    assert_allclose(found["pin_y_locked"][held], M * G, atol=1e-9)
    assert_allclose(found["pin_angle_locked"][held], M * G * np.sin(ANGLE), atol=1e-9)
    assert brake.loss == pytest.approx((J + M) * RATE**2 / 2, rel=2e-4)
    assert go.time == pytest.approx(0.3, abs=1e-12)
    assert found["tip_y"][-1] == pytest.approx(-np.cos(ANGLE) - G * 0.2**2 / 2, abs=1e-9)
    assert energy_errors(motion)[0] < 1e-3
    assert_allclose(found["E_balance"], energies(motion)[:, 3])


@pytest.mark.parametrize("every", [1, 7])
def test_the_balance_is_the_same_step_by_step(every: int) -> None:
    """With what a lock loses, and the work of a force in all steps between two looks."""
    wind = loads.PointForce("wind", ROD, (3.0, 0.0), lambda t: 1.0 + np.sin(40.0 * t))
    system = rod(
        {"brake": event("t - 0.213", lock=("pin",)), "go": event("t - 0.3", release=("pin",))},
        pushed=[wind],
    )
    motion = integrate(system, GeneralizedAlpha(H), 0.42)
    run, seen = start(system, GeneralizedAlpha(H)), []
    for k in range(85):
        if k % every == 0:
            seen.append(run.outputs()["E_balance"])
        run.step()
    assert motion.events[0].loss > 1.0
    assert np.ptp(outputs(motion)["E_balance"]) < 1e-3  # with the work before an event, of 2 J
    assert_allclose(seen, outputs(motion)["E_balance"][:85:every], rtol=1e-9)


def captured(dim: int, h: float = H) -> tuple[Trajectory, float]:
    """Two bodies of which one overtakes the other and is latched to it, and the kinetic energy that
    momenta leave.
    """
    rest = (0.0,) * (dim - 2)
    spin = np.array([0.3, -0.2, 0.7])
    parts = [
        rigid(
            "a",
            2.0,
            0.1 if dim == 2 else 0.1 * np.eye(3),
            (0.0, 0.0, *rest),
            dim=dim,
            places={"p": (0.1, 0.2, *rest)},
        ),
        rigid(
            "b",
            3.0,
            0.2 if dim == 2 else 0.2 * np.eye(3),
            (1.0, 0.3, *rest),
            dim=dim,
            places={"p": (1.1, 0.1, *rest)},
        ),
    ]
    ends = [At(name, place) for name in "ab" for place in ("frame", "p")]
    system = assemble(
        parts,
        [Latch("latch", ends[0], ends[2])],
        outputs={str(end).replace(".", ""): probes.Position(end) for end in ends},
        initial={"a": Motion((3.0, 0.0, *rest), 0.7 if dim == 2 else tuple(spin))},
        events={"dock": event("bframe.x - aframe.x - 0.5", lock=("latch",))},
    )
    r, v = np.array([0.5, 0.3, 0.0]), np.array([-3.0, 0.0, 0.0])
    L = 0.1 * (spin if dim == 3 else np.array([0.0, 0.0, 0.7])) + 1.2 * np.cross(r, v)
    inertia = 0.3 * np.eye(3) + 1.2 * (r @ r * np.eye(3) - np.outer(r, r))
    return integrate(system, GeneralizedAlpha(h), 0.5, TIGHT), 2.5 * 1.2**2 + 0.5 * float(
        L @ np.linalg.solve(inertia, L)
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_two_bodies_that_latch_keep_their_momenta(dim: int) -> None:
    """And their gap as well: between the positions at the lock, and the angle by which the first
    one has turned till then.
    """
    with pytest.warns(
        Notice,
        match=r"event 'dock', t = 0.166667 s: latch 'latch' locks its places 0.583 m apart and keeps them so",
    ):
        motion, expected = captured(dim)
    (gap,) = motion.events[0].gaps
    turned = 0.7 if dim == 2 else np.linalg.norm([0.3, -0.2, 0.7])
    assert gap.joint == "latch"
    assert gap.distance == pytest.approx(np.hypot(0.5, 0.3), abs=1e-9)
    assert gap.angle == pytest.approx(turned / 6, abs=1e-5)
    found, after = outputs(motion), motion.times > 1 / 6 + H
    kinetic = energies(motion)[:, 0]
    assert motion.events[0].time == pytest.approx(1 / 6, abs=1e-9)
    assert kinetic[0] - motion.events[0].loss == pytest.approx(expected, abs=1e-6)
    assert_allclose(kinetic[after], expected, atol=2e-5)
    place = {
        name: np.stack([found[f"{name}_{c}"] for c in "xyz"[:dim]], axis=1)[after]
        for name in ("aframe", "ap", "bframe", "bp")
    }
    for one in ("aframe", "ap"):
        for other in ("bframe", "bp"):
            apart = np.linalg.norm(place[one] - place[other], axis=1)
            assert_allclose(apart, apart[0], atol=1e-10)
    centre = (2 * place["aframe"] + 3 * place["bframe"]) / 5
    assert_allclose(
        np.diff(centre, axis=0) / H,
        np.tile([1.2, *(0.0,) * (dim - 1)], (len(centre) - 1, 1)),
        atol=1e-9,
    )


@pytest.mark.parametrize(
    "when, direction, times",
    [
        ("angle", "both", [0.0]),
        ("angle", "rising", [0.0]),
        ("angle", "falling", []),
        ("t - 0.05 s", "both", [0.05]),
        ("t - 0.1 s", "rising", [0.1]),
        ("where(t < 0.0512 s, -1, 1)", "both", [0.0512]),
        ("sin(20 * pi * t)", "falling", [0.05, 0.15]),
        ("rate - 3 rad/s", "both", []),
    ],
)
def test_when_events_happen(when: str, direction: str, times: list[float]) -> None:
    """At the first instant, at the end of a step, at a jump, again and again, in one direction."""
    motion = integrate(
        rod({"e": event(when, direction=direction, release=("pin",))}, weight=(0.0, 0.0)),
        GeneralizedAlpha(1e-2),
        0.2,
    )
    assert_allclose([one.time for one in motion.events], times, atol=1e-9)
    assert_allclose(outputs(motion)["rate"], SPIN, rtol=5e-5)


@pytest.mark.parametrize("once, times", [(True, [0.025]), (False, [0.025, 0.075, 0.125, 0.175])])
def test_events_that_happen_once_and_what_changes_nothing(once: bool, times: list[float]) -> None:
    """Resumed runs know what has happened; a remark says, once a joint, that it is locked or free
    already.
    """
    told = {
        "brake": event("cos(20 * pi * t)", lock=("pin",), once=once),
        "open": event("t - 0.01", release=("latch",)),
        "never": event("t - 9", lock=("latch",)),
    }
    system, scheme = rod(told, more=[Latch("latch", ROD)]), GeneralizedAlpha(H)
    found: list[tuple[Rows, Checkpoint]] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        motion = integrate(
            system,
            scheme,
            0.2,
            record=lambda moment: found.append((moment.rows(0, moment.kept), moment.checkpoint())),
        )
        again = integrate(system, scheme, 0.2, resume=Resumed(found[0][1], found[0][0]))
    assert_allclose([one.time for one in motion.events if one.name == "brake"], times, atol=1e-9)
    assert again.events == motion.events
    remarks = {str(one.message) for one in caught if one.category is Remark}
    free = "event 'open' releases joint 'latch', which is free already, at t = 0.01 s"
    locked = "event 'brake' locks joint 'pin', which is locked already, at t = 0.075 s; say 'once: true' if it is to happen once"
    assert {text for text in remarks if "0.01 s" in text or "0.075 s" in text} == (
        {free} if once else {free, locked}
    )


def test_several_in_one_step_and_at_one_instant() -> None:
    """The first one stands first; a value that jumps over zero by what another one does has crossed
    it, its own action does not.
    """
    told = {
        "late": event("t - 0.1037 s", release=("pin",)),
        "early": event("t - 0.1022 s", lock=("pin",)),
        "with it": event("0.1022 s - t", lock=("pin",)),
        "stopped": event("rate - 0.1", direction="falling", release=("pin",)),
        "own": event("t - 0.1022 - 0.01 * where(abs(rate) < 0.1, 1, 0)", lock=("pin",)),
    }
    motion = integrate(rod(told, weight=(0.0, 0.0)), GeneralizedAlpha(H), 0.2)
    found = [(one.name, round(one.time, 9)) for one in motion.events]
    assert found[:3] == [("early", 0.1022), ("with it", 0.1022), ("own", 0.1022)]
    assert found[3:] == [("stopped", 0.1022), ("late", 0.1037), ("own", 0.1122)]


@pytest.mark.parametrize("last, end", [("lock", 0.4), ("release", 2.0)])
def test_a_lock_and_a_release_at_one_instant_are_told(last: str, end: float) -> None:
    """The last one counts: the rod stands, or flies on with what a lock alone would have taken."""
    first = {"lock": "release", "release": "lock"}[last]
    told = {"a": event("t - 0.1", **{first: ("pin",)}), "b": event("0.1 - t", **{last: ("pin",)})}
    with pytest.warns(
        Notice,
        match=rf"joint 'pin' is locked and released by .* at one instant, t = 0.1 s, and event 'b' .* {last}s",
    ):
        motion = integrate(rod(told, weight=(0.0, 0.0)), GeneralizedAlpha(H), 0.5)
    assert outputs(motion)["angle"][-1] == pytest.approx(end, abs=1e-3)


def test_a_run_that_is_stopped_ends_there() -> None:
    """Its last state is that of the event, also where nothing else is stored, and of a run step by
    step.
    """
    system, scheme = (
        rod(
            {
                "fly": event(f"angle - {ANGLE}", release=("pin",)),
                "end": event("tip.y + 0.6", stop=True),
            }
        ),
        GeneralizedAlpha(H),
    )
    motion = integrate(system, scheme, 2.0, TIGHT, every=1000)
    (_, end) = motion.events
    assert_allclose(motion.times, [0.0, end.time])
    assert outputs(motion)["tip_y"][-1] == pytest.approx(-0.6, abs=1e-10)
    assert outputs(motion)["tip_x"][-1] == pytest.approx(
        flight(np.array([end.time]))[0, 0], abs=3e-5
    )
    run = start(system, scheme, TIGHT)
    while not run.ended:
        run.step()
    assert run.time == end.time
    assert run.events == motion.events
    assert run.outputs()["tip_x"] == outputs(motion)["tip_x"][-1]
    with pytest.raises(
        InputError,
        match=r"run.step: expected a run that goes on, got one that an event has stopped at t = ",
    ):
        run.step()


@pytest.mark.parametrize(
    "apart, warned", [(0.001, False), (0.0134, False), (0.0136, True), (0.1, True)]
)
@pytest.mark.parametrize("word", ["latch", "pin"])
def test_a_gap_is_told_and_warned_of_where_a_latch_keeps_it(
    apart: float, warned: bool, word: str
) -> None:
    """A point that moves at a rate of 1 m/s up to the rod; a brake of what holds its places has
    none, and none to the ground.

    The mechanism has a size of 0.674 m, the warning is due beyond a fiftieth of it.
    """
    ball = point_mass("ball", 1.0, np.array([-0.3, -1.0]))
    here = assemble(
        [rigid("rod", M, J, (0.0, -1.0), dim=2, places={"O": (0.0, 0.0)}), ball],
        [joints.Pin("pin", PIN), Latch("latch", At("ball"), ROD)],
        outputs={"ball": probes.Position(At("ball"))},
        initial={"ball": Motion((1.0, 0.0))},
        events={
            "grab": event(f"ball.x + {apart}", lock=(word,)),
            "never": event("t - 9", lock=("latch",)),
        },
    )
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        motion = integrate(eliminate(here), GeneralizedAlpha(H), 0.4)
    gap = motion.events[0].gaps[0]
    assert gap.angle is None
    assert gap.distance == (pytest.approx(apart, abs=1e-9) if word == "latch" else None)
    assert any("keeps them so" in str(one.message) for one in told) == (warned and word == "latch")


def test_resumed_runs_have_the_same_bits() -> None:
    """From before, between and behind events."""
    system, scheme = (
        rod(
            {
                "brake": event("angle - 0.3", lock=("pin", "latch")),
                "go": event("t - 0.2", release=("pin",)),
            },
            more=[Latch("latch", ROD, PIN)],
        ),
        GeneralizedAlpha(H),
    )
    found: list[tuple[Rows, Checkpoint]] = []
    motion = integrate(
        system,
        scheme,
        0.4,
        record=lambda moment: found.append((moment.rows(0, moment.kept), moment.checkpoint())),
    )
    assert len({len(held.arrays["events"]) for _, held in found}) == 3
    for rows, held in found:
        again = integrate(system, scheme, 0.4, resume=Resumed(held, rows))
        assert_array_equal(again.x, motion.x)
        assert again.events == motion.events
        assert [gap.distance for gap in again.events[0].gaps] == [None, pytest.approx(1.0)]
        assert_array_equal(outputs(again)["pin_y_locked"], outputs(motion)["pin_y_locked"])


def test_a_lock_at_the_start_loses_its_energy_once() -> None:
    """The state at the start is that before it; the balance says so."""
    motion = integrate(rod({"hold": event("t", lock=("pin",))}), GeneralizedAlpha(H), 0.05)
    assert motion.events[0].loss == pytest.approx((J + M) * SPIN**2 / 2)
    assert_allclose(outputs(motion)["E_balance"], (J + M) * SPIN**2 / 2, rtol=1e-9)


def test_a_live_run_that_goes_back_has_its_events_before_it() -> None:
    """What has stopped it, and what was to happen once, happens again at the same instants."""
    told = {
        "once": event("angle - 0.2", lock=("pin",), once=True),
        "go": event("t - 0.1", release=("pin",), once=True),
        "end": event("tip.y < -1.02", stop=True),
    }
    run = start(rod(told), GeneralizedAlpha(H))
    begin = run.state
    seen = []
    for _ in range(2):
        for _ in range(60):
            if not run.ended:
                run.step()
        seen.append([(one.name, one.time) for one in run.events])
        run.state = begin
        assert not run.ended
        assert run.events == ()
    assert [name for name, _ in seen[0]] == [*told]
    assert seen[0] == seen[1]


def arm(dim: int, cells: int = 4) -> System:
    """A beam that falls from its hinge, is released, and latched to the ground by its other end."""
    rest = (0.0,) * (dim - 2)
    beam = cable(
        "beam",
        models.segment(cells),
        sections.Circular(0.02),
        sections.Material(1e9, 2300.0),
        dim=dim,
    )
    root, tip = At("beam", "left"), At("beam", "right")
    return assemble(
        [beam],
        [joints.Pin("hinge", root), Latch("latch", tip)],
        [loads.Gravity((0.0, -G, *rest))],
        outputs={
            "tip": probes.Position(tip),
            "root": probes.Position(root),
            "hinge": probes.Reaction("hinge"),
            "latch": probes.Reaction("latch"),
        },
        events={
            "fly": event("tip.y + 0.2", release=("hinge",)),
            "catch": event("tip.y < -0.6", lock=("latch",)),
        },
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_reduced_hyper_reduced_and_saved_models(dim: int, tmp_path: Path) -> None:
    raw, scheme = arm(dim), GeneralizedAlpha(1e-3)
    full = integrate(eliminate(raw), scheme, 0.5, TIGHT)
    data, level = galerkin.snapshots(full), component.body_level(raw)
    bases = {
        name: pod.basis(data.q[:, component.rows_of(raw, part)].T, 1e-13)
        for name, part in level.items()
    }
    reduced = galerkin.reduce_system(raw, level, bases, configurations=data.q)
    hyper_reduced = sampling.apply(
        reduced, sampling.train([(reduced, component.projected(reduced, data.q))], 1e-8)
    )
    saved = files.load(files.save(hyper_reduced, tmp_path / "model.h5"))
    expected = outputs(full)
    assert [one.name for one in full.events] == ["fly", "catch"]
    assert abs(np.diff(expected["tip_y"][-100:])).max() < 1e-12
    assert np.ptp(expected["root_x"][-100:]) > 1e-2
    for system in (reduced, hyper_reduced, saved):
        motion = integrate(system, scheme, 0.5, TIGHT)
        assert_allclose(
            [one.time for one in motion.events], [one.time for one in full.events], atol=1e-5
        )
        assert motion.events[1].loss == pytest.approx(full.events[1].loss, rel=1e-3)
        for name in ("tip_x", "tip_y", "root_x", "root_y"):
            assert_allclose(outputs(motion)[name], expected[name], atol=1e-3)
        for name in [
            name for name in expected if "_locked" in name and np.ptp(expected[name]) > 0.0
        ]:
            assert outputs(motion)[name][-100:].mean() == pytest.approx(
                expected[name][-100:].mean(), rel=1e-5
            )


def test_a_space_that_knows_no_open_joint_says_so() -> None:
    raw, scheme = arm(2), GeneralizedAlpha(1e-3)
    data, level = (
        galerkin.snapshots(integrate(eliminate(raw), scheme, 0.1, TIGHT)),
        component.body_level(raw),
    )
    bases = {
        name: pod.basis(data.q[:, component.rows_of(raw, part)].T, 1e-10)
        for name, part in level.items()
    }
    reduced = galerkin.reduce_system(raw, level, bases)
    motion = integrate(reduced, scheme, 0.05)
    assert abs(motion.multipliers).max() == 0.0
    with pytest.warns(Notice, match=r"the reaction of joint 'hinge' is given as NaN"):
        assert np.isnan(outputs(motion)["hinge_y"]).all()
    with pytest.raises(
        SolverError,
        match=r"event 'fly' releases joint 'hinge', which holds in all motions that the reduced",
    ) as caught:
        integrate(reduced, scheme, 0.5)
    assert caught.value.reason is Reason.INCONSISTENT


def test_large_models(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sparse factors, and bands, as those of dense matrices."""
    found = []
    for dense, band in ((100, 96), (48, 96), (48, 1)):
        monkeypatch.setattr(layouts, "DENSE", dense)
        monkeypatch.setattr(layouts, "BAND", band)
        found.append(integrate(eliminate(arm(2, 14)), GeneralizedAlpha(5e-4), 0.305, TIGHT))
    assert [one.statistics.solver.split()[0] for one in found] == ["dense", "band", "sparse"]
    for one in found[1:]:
        assert_allclose(one.x[-1], found[0].x[-1], atol=1e-6)


def test_joints_that_hold_the_same_take_turns() -> None:
    """What follows from others rests until these are released: two pins at one place."""
    system = assemble(
        [rigid("rod", M, J, (0.0, -1.0), dim=2, places={"O": (0.0, 0.0)})],
        [joints.Pin("one", PIN), joints.Pin("other", PIN)],
        [loads.Gravity((0.0, -G))],
        outputs={"hook": probes.Position(PIN)},
        initial={"rod": Motion((0.0, 0.0), SPIN)},
        events={
            "first": event("t - 0.05", release=("one",)),
            "second": event("t - 0.1", release=("other",)),
        },
    )
    motion = integrate(eliminate(system), GeneralizedAlpha(H), 0.2)
    fall = np.hypot(*(outputs(motion)[f"hook_{c}"] for c in "xy"))
    assert fall[motion.times <= 0.1].max() < 1e-12
    assert fall[-1] > 0.1


@pytest.mark.parametrize("size", [1.0, 1e-7])
def test_a_lock_holds_bodies_of_any_size(size: float) -> None:
    """A rod on a pin, without weight, whose pin is locked: it stands still, and the energy of its
    rotation is lost.
    """
    part = rigid("rod", M, J * size**2, (0.0, -size), dim=2, places={"O": (0.0, 0.0)})
    outputs = {"angle": probes.Angle(ROD)}
    stop = {"stop": event("angle - 0.2", lock=("pin",))}
    system = assemble(
        [part],
        [joints.Pin("pin", PIN)],
        outputs=outputs,
        initial={"rod": Motion((0.0, 0.0), SPIN)},
        events=stop,
    )
    found = integrate(eliminate(system), GeneralizedAlpha(H), 20 * H)
    assert found.events[0].loss == pytest.approx(0.5 * (J + M) * (size * SPIN) ** 2, rel=1e-5)
    assert np.abs(found.v[-1]).max() < 1e-9


@pytest.mark.parametrize("at", [(0.5, 0.0), (0.505, 0.004)])
@pytest.mark.parametrize("step", [5e-4, 2.5e-4, 1e-4])
@pytest.mark.parametrize("damping, unbalanced", [(5e-3, 0.02), (0.0, 0.06)])
def test_a_bar_that_catches_a_mass(
    damping: float, unbalanced: float, step: float, at: tuple[float, float]
) -> None:
    """With its end, or beside it: momenta are kept, the balance holds, and both end as one rigid
    body where strains are damped.

    By the mass alone an impulse strains single cells, at rates whose damping forces are those of no
    motion: runs fail at any step. Without damping they leave waves that no step resolves, which the
    scheme damps by 8 to 15 % of the energy.
    """
    size, mass, load, speed = 0.5, 2700.0 * 0.03 * 0.005 * 0.5, 0.2, np.array([1.0, 2.0])
    line, section = models.segment(10, end=(size, 0.0, 0.0)), sections.Rectangular(0.03, 0.005)
    system = assemble(
        [
            cable("bar", line, section, sections.Material(70e9, 2700.0), dim=2),
            point_mass("load", load, np.array(at)),
        ],
        [Latch("catch", At("load"), At("bar", "right"))],
        outputs={"E": probes.Energy()},
        initial={"bar": Motion((1.0, 2.0))},
        damping=Rayleigh(stiffness=damping),
        events={"grab": event("t - 2.3e-3", lock=("catch",))},
    )
    motion = integrate(eliminate(system), GeneralizedAlpha(step), 0.1, TIGHT)
    found, total = (
        outputs(motion),
        motion.v @ system.mass @ np.kron(system.unit[:, None], np.eye(2)),
    )
    assert_allclose(total, np.tile(mass * speed, (len(total), 1)), rtol=1e-9)
    assert_allclose(found["E_balance"], 0.5 * mass * speed @ speed, rtol=unbalanced)
    # the mass from the centre of the bar
    apart = np.array(at) - (
        size / 2 + 2.3e-3 * speed[0],
        2.3e-3 * speed[1],
    )
    shared = mass * load / (mass + load)
    spin, inertia = (
        shared * (apart[0] * speed[1] - apart[1] * speed[0]),
        mass * size**2 / 12 + shared * apart @ apart,
    )
    rigid_energy = 0.5 * (mass * speed) @ (mass * speed) / (mass + load) + 0.5 * spin**2 / inertia
    assert not damping or found["E_kinetic"][-1] == pytest.approx(rigid_energy, rel=2e-3)


def test_endless_events() -> None:
    """Two that bring each other about within a step."""
    told = {
        "lock": event("rate - 1e-5", direction="rising", lock=("latch",)),
        "go": event("rate - 5e-6", direction="falling", release=("latch",)),
    }
    with pytest.raises(
        SolverError,
        match=r"events happen more than 100 times in the step from t = .* s, the last of them '",
    ) as caught:
        integrate(
            rod(told, spin=0.0, weight=(G, 0.0), more=[Latch("latch", ROD)]),
            GeneralizedAlpha(H),
            0.1,
        )
    assert caught.value.partial is not None


SCENE = """
schema: 1
dimension: 2
bodies: {rod: {type: rigid, mass: 1.5 kg, inertia: 0.1 kg m^2, center: [0, -1], points: {O: [0, 0]}}}
joints: {pin: {type: pin, at: rod.O}, latch: {type: latch, at: rod}}
loads: {weight: {type: gravity, acceleration: [0, -9.81]}}
initial: {bodies: {rod: {angular_velocity: 4}}}
events:
  fly: {when: angle - 0.7, direction: rising, release: pin}
  catch: {when: "tip.y + 90 cm", direction: falling, lock: [latch]}
  end: {when: t - 1 s, stop: true}
analysis: {type: dynamic, duration: 2 s, step: 5 ms}
outputs: {tip: {type: position, at: rod}, angle: {type: angle, at: rod}}
"""


def test_scenes() -> None:
    scene = reading.loads(SCENE)
    motion = scene.analysis.solve(build.chosen_form(scene, build.system(scene)))  # type: ignore[attr-defined]
    assert [one.name for one in motion.events] == ["fly", "catch", "end"]
    assert motion.events[0].time == pytest.approx(TIME, abs=2e-5)
    assert motion.times[-1] == pytest.approx(1.0, abs=1e-12)
    assert outputs(motion)["tip_y"][-1] == pytest.approx(-0.9, abs=1e-10)
    with pytest.warns(Notice, match=r"events: do not happen in an analysis of static"):
        reading.loads(SCENE.replace("type: dynamic, duration: 2 s, step: 5 ms", "type: static"))


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "release: pin",
            "release: pan",
            r"events.fly.release: expected one of the joints latch, pin, got the joint 'pan'",
        ),
        (", release: pin", "", r"events.fly: expected something that happens, got nothing"),
        (
            "release: pin",
            "release: pin, lock: pin",
            r"events.fly.lock: expected a joint to be released or to be locked, got 'pin' for both",
        ),
        (
            "angle - 0.7",
            "angel - 0.7",
            r"events.fly.when: expected one of .* got 'angel'; did you mean 'angle'",
        ),
        ("90 cm", "90 s", r"events.catch.when: expected all parts of '.' of one dimension"),
        (
            "rising",
            "upward",
            r"events.fly.direction: expected 'rising', 'falling' or 'both', got 'upward'",
        ),
        (
            "lock: [latch]",
            "stop: true",
            r"joint 'latch': expected an event that locks it, got none",
        ),
    ],
)
def test_what_does_not_fit_is_named(old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        build.system(reading.loads(SCENE.replace(old, new)))
