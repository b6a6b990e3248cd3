"""Events in C as live runs have them: instants, rows that are released and locked, stops, pauses."""

from __future__ import annotations

import ctypes
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes
from fmbs_skfem.control.events import Event
from fmbs_skfem.core.errors import Contradiction, InputError, SolverError
from fmbs_skfem.core.values.display import SI
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.core.values.ranges import Parameter
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.exports import c_files
from fmbs_skfem.exports.c_files import CModel
from fmbs_skfem.exports.outputs import columns_of
from fmbs_skfem.reduction import affine
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.spaces import component, galerkin, pod
from fmbs_skfem.scenes import build
from fmbs_skfem.studies.exporting import ExportedModel, reference_of
from fmbs_skfem.systems import System, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from tests.dynamics import test_events
from tests.dynamics.test_events import ANGLE, PIN, ROD, event, rod
from tests.exports.c_library import COMPILER, CRun, compiled

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

STEP = 5e-3
STOPPED = "an event has stopped the motion: the state is that at its instant"
PAUSED = "an event has happened: the state is that behind it, the rest of the span is not taken"
EVENTS = """
#include "NAME.h"
long long happened_of(const NAME_memory *m, int k) { return m->happened[k]; }
double instant_of(const NAME_memory *m) { return m->instant; }
void set_pause(NAME_memory *m, int pause) { m->pause = pause; }
"""


class EventRun(CRun):
    """A model in C with its events."""

    def __init__(self, model: CModel, folder: Path) -> None:
        super().__init__(model, folder)
        text = EVENTS.replace("NAME", model.name)
        self.events = compiled(folder, [text], f"{model.name}_events")
        self.events.instant_of.restype = ctypes.c_double

    def happened(self, number: int) -> int:
        return int(self.events.happened_of(self.memory, number))

    @property
    def instant(self) -> float:
        return float(self.events.instant_of(self.memory))

    def named(self) -> dict[str, float]:
        columns = [one.name for one in self.model.columns]
        return dict(zip(columns, self.outputs.tolist(), strict=True))


def both(
    system: System, folder: Path, span: float, step: float = STEP, tolerance: float = 1e-12
) -> tuple[EventRun, Trajectory, str]:
    """The same motion in C and in Python, and the last status of C."""
    case = Case(system, GeneralizedAlpha(step), span, Newton(tolerance=tolerance))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        motion = integrate(system, case.scheme, span, case.newton)
        run = EventRun(c_files.write(case, "eventful", "a model"), folder)
    assert run.call("start") == 0
    status = 0
    for _ in range(round(span / step)):
        status = run.step(step)
        if status:
            break
    return run, motion, run.message(status).decode()


def difference(run: EventRun, motion: Trajectory) -> float:
    """The largest one of outputs at the end, over the ranges of each, or over 1 where these are less."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        wanted = dynamics.outputs(motion)
    found = run.named()
    names = [name for name in wanted if name in found]
    assert len(names) > 2
    assert run.time == pytest.approx(motion.times[-1], abs=1e-14)
    apart = [abs(found[name] - wanted[name][-1]) / max(np.ptp(wanted[name]), 1.0) for name in names]
    return float(max(apart))


def brake_and_go() -> System:
    told = {
        "brake": event(f"angle - {ANGLE}", lock=("pin",)),
        "go": event("t - 0.3", release=("pin",)),
    }
    return rod(told)


def reduced_arm(dim: int) -> System:
    """A beam that is released by its hinge and caught by its tip, in some modes."""
    raw = test_events.arm(dim)
    full = integrate(eliminate(raw), GeneralizedAlpha(1e-3), 0.5, Newton(tolerance=1e-12))
    data, level = galerkin.snapshots(full), component.body_level(raw)
    bases = {
        name: pod.basis(data.q[:, component.rows_of(raw, part)].T, 1e-9)
        for name, part in level.items()
    }
    return galerkin.reduce_system(raw, level, bases, configurations=data.q)


def of_scene(text: str) -> System:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return build.system(scenes.loads(f"schema: 1\ndimension: 2\n{text}"))


def servo() -> System:
    """A rod on a hinge that a controller turns, and that locks to the ground for a while."""
    return of_scene("""
bodies:
  rod: {type: rigid, mass: 1 kg, inertia: 0.04 kg m^2, center: [0.25 m, 0], points: {end: [0, 0], tip: [0.5 m, 0]}}
joints: {axle: {type: revolute, at: rod.end}}
controllers:
  servo: {type: pid, error: 0.4 - hinge.angle, kp: 8 N m, kd: 0.3 N m s, unit: N m, sample: 20 ms}
loads:
  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}
  motor: {type: control_torque, at: rod, torque: servo}
events:
  stop: {when: hinge.angle < -0.1, lock: [axle]}
  go: {when: t > 0.2317 s, release: [axle], once: true}
outputs: {hinge: {type: angle, at: rod}, tip: {type: position, at: rod.tip}}
analysis: {type: dynamic, duration: 0.4 s, step: 5 ms}
""")


def driven() -> System:
    """A crank that is driven, with a rod that leaves it."""
    return of_scene("""
bodies:
  crank: {type: rigid, mass: 1 kg, inertia: 0.02 kg m^2, center: [0, 0], points: {pin: [0.2 m, 0]}}
  rod: {type: rigid, mass: 1 kg, inertia: 0.02 kg m^2, center: [0.4 m, 0], points: {pin: [0.2 m, 0], tip: [0.6 m, 0]}}
joints:
  base: {type: revolute, at: crank.frame}
  drive: {type: driven_angle, at: crank.frame, angle: 3*t**2}
  hinge: {type: revolute, at: crank.pin, to: rod.pin}
loads: {weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}}
events:
  hold: {when: turn.angle - 0.11, lock: [hinge]}
  fly: {when: t - 0.3127 s, release: [hinge]}
outputs:
  turn: {type: angle, at: crank}
  tip: {type: position, at: rod.tip}
  base: {type: reaction, joint: base}
analysis: {type: dynamic, duration: 0.4 s, step: 5 ms}
""")


SYSTEMS: dict[str, Callable[[], System]] = {
    "released": lambda: rod({"fly": event(f"angle - {ANGLE}", release=("pin",))}),
    "released with multipliers": lambda: rod(
        {"fly": event(f"angle - {ANGLE}", release=("pin",))}, lambda system: system
    ),
    "again and again": lambda: rod(
        {"hold": event("sin(40 * t)", lock=("pin",)), "go": event("cos(40 * t)", release=("pin",))}
    ),
    "by a reaction": lambda: rod({"fly": event("pin.y > 20 N", release=("pin",))}),
    "by an energy": lambda: rod({"fly": event("E.kinetic < 4 J", release=("pin",))}),
    "a touch": lambda: rod({"fly": event("(angle - 0.402)**2", release=("pin",))}),
    "two pins": lambda: rod(
        {"fly": event("angle - 0.3", release=("pin",)), "off": event("t - 0.15", release=("two",))},
        more=[joints.Pin("two", PIN)],
    ),
    "an arm in few modes": lambda: reduced_arm(2),
    "an arm in space": lambda: reduced_arm(3),
    "a controller": servo,
    "a load that jumps": lambda: rod(
        {"fly": event("angle - 0.35", release=("pin",))},
        pushed=[loads.PointForce("kick", ROD, (9.0, 0.0), of_time("where(t < 0.0917, 0, 1)"))],
    ),
    "a joint that is driven": driven,
}


@pytest.fixture(scope="module")
def braked(tmp_path_factory: pytest.TempPathFactory) -> tuple[EventRun, Trajectory]:
    """A rod that is locked on its way, and released, at its end."""
    run, motion, status = both(brake_and_go(), tmp_path_factory.mktemp("braked"), 0.4)
    assert status == "done"
    return run, motion


@pytest.mark.parametrize("name", SYSTEMS)
def test_events_in_c_are_those_of_python(name: str, tmp_path: Path) -> None:
    """Their instants, their number, and the motion behind them."""
    run, motion, status = both(SYSTEMS[name](), tmp_path, 0.4)
    assert status == "done"
    names = [one.name for one in motion.events]
    assert names
    for k, one in enumerate(motion.system.triggers):
        assert run.happened(k) == names.count(one.name)
        assert run.named()[one.name] == names.count(one.name)
    assert run.instant == pytest.approx(motion.events[-1].time, abs=1e-13)
    # derivatives of what drives are differences in Python
    assert difference(run, motion) < (1e-6 if name == "a joint that is driven" else 1e-10)


@pytest.mark.parametrize("when", ["angle - 0.3", "angle > 0", "(angle > 0.2) * (angle < 0.4)"])
def test_a_motion_stops_at_the_instant_of_its_event(when: str, tmp_path: Path) -> None:
    """Also at the first one; no step is taken behind it, until the motion starts again."""
    run, motion, status = both(rod({"e": event(when, stop=True)}), tmp_path, 0.2)
    assert status == STOPPED
    assert run.time == run.instant == pytest.approx(motion.events[0].time, abs=1e-13)
    assert difference(run, motion) < 1e-10
    here = run.outputs
    assert run.message(run.step(STEP)).decode() == STOPPED
    assert run.time == run.instant
    np.testing.assert_array_equal(run.outputs, here)
    assert run.call("start") == 0
    assert run.time == run.happened(0) == 0


def test_a_caller_may_want_to_see_events(braked: tuple[EventRun, Trajectory]) -> None:
    """A step ends behind each of them, and the rest of it leads to the same motion."""
    run, motion = braked
    assert run.call("start") == 0
    run.events.set_pause(run.memory, 1)
    seen = []
    for k in range(80):
        while run.time < (k + 1) * STEP - 1e-12:
            status = run.step((k + 1) * STEP - run.time)
            if status:
                assert run.message(status).decode() == PAUSED
                seen.append(run.time)
    np.testing.assert_allclose(seen, [one.time for one in motion.events], atol=1e-12)
    run.events.set_pause(run.memory, 0)
    # pieces of a step are taken as steps of their own
    assert difference(run, motion) < 1e-6


def test_a_saved_state_goes_on_with_its_events(braked: tuple[EventRun, Trajectory]) -> None:
    """All memory is in one struct: what has happened is part of it."""
    run, _ = braked
    assert run.call("start") == 0
    for _ in range(40):
        assert run.step(STEP) == 0
    kept = bytes(run.memory)
    ends = []
    for _ in range(2):
        for _ in range(40):
            assert run.step(STEP) == 0
        ends.append(run.outputs)
        ctypes.memmove(run.memory, kept, len(kept))
    np.testing.assert_array_equal(*ends)
    assert (run.happened(0), run.happened(1)) == (1, 0)


def test_a_step_that_pauses_goes_on_as_it_was(tmp_path: Path) -> None:
    """Values that cross zero twice in it, and touch it at its end, as without a pause."""
    told = {
        "twice": event("(t - 0.0203) * (t - 0.0226)", release=("pin",)),
        "touch": event("abs(t - 0.06)", release=("pin",)),
        "within": event("(t - 0.0712)**2", release=("pin",)),
    }
    run, motion, _ = both(rod(told), tmp_path, 0.1)
    names = [one.name for one in motion.events]
    assert names == ["twice", "twice", "touch", "within"]
    run.events.set_pause(run.memory, 1)
    assert run.call("start") == 0
    seen = []
    for k in range(20):
        while run.time < (k + 1) * STEP - 1e-12:
            if run.step((k + 1) * STEP - run.time):
                seen.append(run.time)
    np.testing.assert_allclose(seen, [one.time for one in motion.events], atol=1e-9)


def test_values_that_are_no_numbers_are_a_status(tmp_path: Path) -> None:
    """The state is the last one known before it; a parameter of a range may lead there."""
    system = rod({"e": event("log(0.3 - angle) + 20", release=("pin",))}, weight=(0.0, 0.0))
    case = Case(system, GeneralizedAlpha(STEP), 0.2, Newton())
    with pytest.raises(SolverError, match="is no number"):
        integrate(system, case.scheme, 0.2)
    run = EventRun(c_files.write(case, "eventful", "a model"), tmp_path)
    assert run.call("start") == 0
    statuses = [run.step(STEP) for _ in range(20)]
    (status,) = {one for one in statuses if one}
    assert "the value of an event is no number" in run.message(status).decode()
    assert run.time == pytest.approx(0.075, abs=STEP)
    assert np.isfinite(run.outputs).all()


AGAINST = """
bodies: {crank: {type: rigid, mass: 1 kg, inertia: 0.02 kg m^2, center: [0, 0]}}
joints:
  base: {type: revolute, at: crank.frame}
  drive: {type: driven_angle, at: crank.frame, angle: 3*t**2}
events: {hold: {when: t - 0.1213 s, lock: [base]}}
outputs: {turn: {type: angle, at: crank}}
analysis: {type: dynamic, duration: 0.4 s, step: 5 ms}
"""


def test_a_lock_against_a_drive_that_moves_is_an_error(tmp_path: Path) -> None:
    """It follows from the drive where both meet, and holds nothing behind it."""
    case = Case(of_scene(AGAINST), GeneralizedAlpha(STEP), 0.4, Newton())
    with pytest.raises(Contradiction, match=r"at t = 0\.1213 s.*base\.angle locked, against which"):
        integrate(case.system, case.scheme, 0.4)
    run = EventRun(c_files.write(case, "eventful", "a model"), tmp_path)
    assert run.call("start") == 0
    statuses = [run.step(STEP) for _ in range(25)]
    assert not any(statuses[:-1])
    assert "locks what a drive moves" in run.message(statuses[-1]).decode()
    assert run.time == pytest.approx(0.12)


def test_accelerations_have_no_form_in_c() -> None:
    """They are no functions of positions and velocities: outputs, events and controllers say so."""
    system = of_scene(
        AGAINST.replace("outputs: {", "outputs: {a: {type: acceleration, at: crank}, ")
    )
    assert columns_of(system, "a", system.outputs["a"]) == []
    assert [one.name for one in columns_of(system, "turn", system.outputs["turn"])] == ["turn"]


def test_the_motion_of_a_training_counts_no_events(tmp_path: Path) -> None:
    """An FMU holds it with the outputs that Python has."""
    case = Case(brake_and_go(), GeneralizedAlpha(STEP), 0.4, Newton())
    made = ExportedModel(c_files.write(case, "eventful", "a model"), "", "", SI, case)
    found = reference_of(made)
    assert found is not None
    assert "brake" not in found.columns
    assert found.columns["angle"][-1] == pytest.approx(ANGLE, abs=1e-6)


def test_what_a_model_cannot_release_is_refused(tmp_path: Path) -> None:
    """A space that was trained without the event knows no motion behind it."""
    raw = test_events.arm(2)
    full = integrate(eliminate(raw), GeneralizedAlpha(1e-3), 0.1, Newton(tolerance=1e-12))
    data, level = galerkin.snapshots(full), component.body_level(raw)
    bases = {
        name: pod.basis(data.q[:, component.rows_of(raw, part)].T, 1e-10)
        for name, part in level.items()
    }
    made = galerkin.reduce_system(raw, level, bases)
    with pytest.raises(
        InputError, match="event 'fly' can release, got 'hinge', which holds in all"
    ):
        c_files.write(Case(made, GeneralizedAlpha(1e-3), 0.1, Newton()), "bad", "a model")


def test_a_lock_and_a_release(braked: tuple[EventRun, Trajectory]) -> None:
    run, motion = braked
    assert run.call("start") == 0
    for _ in range(80):
        assert run.step(STEP) == 0
    assert (run.happened(0), run.happened(1)) == (1, 1)
    assert difference(run, motion) < 1e-10


def test_events_of_a_family(tmp_path: Path) -> None:
    """At parameters that are not the nominal ones, which events read, with its own instants."""

    def family(values: Mapping[str, float]) -> Case:
        weight = (0.0, -values["g"])
        lim = {"lim": values["lim"]}
        told = {
            "brake": Event(when=of_state("angle - lim", "", lim), lock=("pin",)),
            "go": Event(when=of_state("t > lim", "", lim), release=("pin",)),
        }
        return Case(rod(told, weight=weight), GeneralizedAlpha(STEP), 0.4, Newton(tolerance=1e-12))

    ranges = (
        Parameter("g", 5.0, 12.0, value=9.81, unit="m/s^2"),
        Parameter("lim", 0.2, 0.35, value=0.25),
    )
    model = affine.fit(family, ranges)
    run = EventRun(c_files.write(model, "eventful", "a family"), tmp_path)
    for g, lim in ((5.5, 0.21), (11.0, 0.34)):
        run.set("parameter", 0, g)
        run.set("parameter", 1, lim)
        assert run.call("start") == 0
        for _ in range(80):
            assert run.step(STEP) == 0
        case = family({"g": g, "lim": lim})
        motion = integrate(case.system, case.scheme, 0.4, case.newton)
        assert [one.name for one in motion.events] == ["brake", "go"]
        assert run.instant == pytest.approx(lim, abs=1e-11)
        assert difference(run, motion) < 1e-9


def test_events_with_a_fixed_number_of_corrections(braked: tuple[EventRun, Trajectory]) -> None:
    run, motion = braked
    run.library.set_fixed(run.memory, 5)
    assert run.call("start") == 0
    for _ in range(80):
        assert run.step(STEP) == 0
    run.library.set_fixed(run.memory, 0)
    assert difference(run, motion) < 1e-7
