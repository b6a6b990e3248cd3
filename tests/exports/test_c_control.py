"""What acts on a run in C as in Python: sampled controllers, loads that jump, tables that drive,
steps by their local error.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, reduction, scenes
from fmbs_skfem.control.controllers import Controlled, Program
from fmbs_skfem.control.laws import NumberLaw
from fmbs_skfem.control.monitors import Monitor
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.storage.container import storable
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.core.values.ranges import Parameter
from fmbs_skfem.core.values.tables import Table
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton
from fmbs_skfem.dynamics.observers import Observer
from fmbs_skfem.exports import c_files
from fmbs_skfem.exports.c_files import CModel
from fmbs_skfem.reduction import affine
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import System
from fmbs_skfem.systems.system import Signal
from tests.exports.c_library import COMPILER, CRun, compiled
from tests.reduction.conftest import full_of, reduced
from tests.systems import test_controllers

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

STEP = GeneralizedAlpha(1e-3)
COUNTS = """
#include "NAME.h"
int corrections(const NAME_memory *m) { return (int)m->corrections; }
int factorisations(const NAME_memory *m) { return (int)m->factorisations; }
"""
EXAMPLES = Path(__file__).parents[2] / "examples"
TAIL = "analysis: {type: dynamic, duration: 0.3 s, step: 1 ms}\n"
SERVOS = {
    "pid": "type: pid, error: 0.4 - hinge.angle, kp: 8 N m, ki: 30 N m/s, kd: 0.3 N m s, limits: [-6 N m, 6 N m]",
    "pid with a rate": "type: pid, error: 0.4 - hinge.angle, rate: -hinge.rate, kp: 8 N m, kd: 0.3 N m s",
    "feedback": "type: state_feedback, states: [hinge.angle - 0.4, hinge.rate], gains: [8 N m, 0.3 N m s], offset: 1 N m, "
    "limits: [-2 N m, 4 N m]",
    "table": "type: table, of: hinge.angle - 0.4 + 0.1*t, points: [[-1, 3 N m], [-0.1, 1 N m], [0, 0 N m], [0.2, -4 N m]]",
    "measurement": "type: measurement, of: -0.05 m * axle.y + 0.3 * shape(hinge.angle)",
}


def scene(folder: Path, text: str) -> System:
    """The system of a scene, with a table beside it."""
    (folder / "shape.csv").write_text("angle [rad], torque [N m]\n-1,-0.5\n0,0.2\n0.5,1\n1,0\n")
    (folder / "path.csv").write_text("time [s], angle [rad]\n0,0\n0.0502,0.1\n0.12,-0.2\n0.3,0.1\n")
    (path := folder / "scene.yaml").write_text(f"schema: 1\ndimension: 2\n{text}{TAIL}")
    return build.system(scenes.read(path))


def rod(folder: Path, servo: str, turn: float = 0.0, kick: str = "0") -> System:
    """A rod on a hinge under a torque of a controller every 4 ms, its weight and a kick; turned, and
    away from the origin.
    """
    c, s = math.cos(turn), math.sin(turn)
    x, y = (0.0, 0.0) if turn == 0.0 else (3.0, -2.0)
    places = f"end: [{x} m, {y} m], tip: [{x + 0.5 * c} m, {y + 0.5 * s} m]"
    text = f"""
bodies:
  rod: {{type: rigid, mass: 1 kg, inertia: 0.04 kg m^2, center: [{x + 0.25 * c} m, {y + 0.25 * s} m], points: {{{places}}}}}
{"" if "shape" not in servo else "tables: {shape: {file: shape.csv, unit: N m, of: rad, hold: true}}"}
joints: {{axle: {{type: revolute, at: rod.end}}}}
controllers:
  servo: {{{servo}, unit: N m, sample: 4 ms}}
loads:
  motor: {{type: control_torque, at: rod, torque: servo - 0.01 N m s * hinge.rate}}
  weight: {{type: gravity, acceleration: [{9.81 * s} m/s^2, {-9.81 * c} m/s^2]}}
  kick: {{type: point_force, at: rod.tip, force: [{-10 * s} N, {10 * c} N], history: "{kick}"}}
outputs:
  hinge: {{type: angle, at: rod}}
  tip: {{type: position, at: rod.tip}}
  axle: {{type: reaction, joint: axle}}
  drive: {{type: load, load: motor}}
"""
    return scene(folder, text)


def written(system: System, scheme: GeneralizedAlpha = STEP, **newton: float) -> CModel:
    options = {"tolerance": 1e-15, **newton}
    return c_files.write(Case(system, scheme, 0.3, Newton(**options)), "tested", "a model")


def exact(model: CModel, system: System, scheme: GeneralizedAlpha, steps: int) -> np.ndarray:
    """Outputs of Python (s, c) in all columns that it has, nan in others."""
    motion = dynamics.integrate(system, scheme, steps * scheme.step, Newton(tolerance=1e-15))
    columns = dynamics.outputs(motion)
    none = np.full(len(motion.times), np.nan)
    return np.stack([columns.get(one.name, none) for one in model.columns], axis=1)


def require_alike(model: CModel, got: np.ndarray, wanted: np.ndarray) -> None:
    """Columns that Python has as well differ by 1e-10 of their ranges, and by 1e-6 N of reactions
    of some N: the round-off of q, divided by beta h^2 of parts of steps, is in these.
    """
    for k, one in enumerate(model.columns):
        if not np.isnan(wanted[:, k]).any():
            size = max(float(np.ptp(wanted[:, k])), 1e-6)
            least = 1e-6 if one.name.startswith("axle") else 1e-10 * size
            assert np.abs(got[:, k] - wanted[:, k]).max() < least, one.name


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("name", SERVOS)
def test_controllers_act_in_c_as_in_python(name: str, turn: float, tmp_path: Path) -> None:
    """At t = 0 and at every fourth step, in a model that is turned and moved as well."""
    system = rod(tmp_path, SERVOS[name], turn)
    model = written(system)
    run = CRun(model, tmp_path)
    got = run.run(200)
    require_alike(model, got, exact(model, system, STEP, 200))
    given = got[1:, [one.name for one in model.columns].index("servo")]
    assert len(np.unique(given)) > 30
    np.testing.assert_array_equal(given.reshape(-1, 4), np.repeat(given[::4, None], 4, axis=1))
    np.testing.assert_array_equal(run.run(200), got)


SCHEME = GeneralizedAlpha(5e-3)


def test_controllers_act_at_their_instants_whatever_the_spans_are(tmp_path: Path) -> None:
    """A mass under forces that are held moves exactly: at 140 ms it is where the rule says, after
    spans that are some steps of the model, none, or other ones than those before.
    """
    error = test_controllers.on_a_line(test_controllers.ERROR)
    system = test_controllers.ball(replace(test_controllers.PID, error=error))
    run = CRun(written(system, SCHEME), tmp_path)
    wanted = test_controllers.moved(test_controllers.pid_rule(), 7)[7]
    for span in (5e-3, 7e-3, 20e-3, 35e-3, 70e-3, 3.1e-3):
        assert run.call("start") == 0
        for _ in range(math.floor(0.14 / span + 1e-9)):
            assert run.step(span) == 0
        if 0.14 - run.time > 1e-9:
            assert run.step(0.14 - run.time) == 0
        assert run.time == pytest.approx(0.14, rel=1e-14)
        assert run.outputs[0] == pytest.approx(wanted, abs=1e-9)


def test_a_controller_that_gives_no_number_is_a_status(tmp_path: Path) -> None:
    """The state stays, as after any step that fails."""
    system = rod(tmp_path, "type: measurement, of: '1 N m / where(t < 0.05, 1, 0)'")
    run = CRun(written(system), tmp_path)
    before = run.run(52)[-1]
    status = run.step(1e-3)
    assert b"controller gives no finite number" in run.message(status)
    np.testing.assert_array_equal(run.outputs, before)
    assert run.time == 52 * 1e-3


def test_a_controller_of_a_thousand_reads(tmp_path: Path) -> None:
    read = ", ".join(["hinge.angle - 0.4", "hinge.rate"] * 500)
    gains = ", ".join(["16e-3 N m", "0.6e-3 N m s"] * 500)
    system = rod(tmp_path, f"type: state_feedback, states: [{read}], gains: [{gains}]")
    model = written(system)
    require_alike(model, CRun(model, tmp_path).run(60), exact(model, system, STEP, 60))


def test_a_controller_drives_a_joint(tmp_path: Path) -> None:
    """Its joint goes along the cubic through what it gives at the ends of steps."""
    text = """
bodies:
  rod: {type: rigid, mass: 1 kg, inertia: 0.04 kg m^2, center: [0.25 m, 0], points: {end: [0, 0], tip: [0.5 m, 0]}}
  bob: {type: rigid, mass: 1 kg, inertia: 0.04 kg m^2, center: [0.75 m, 0], points: {end: [0.5 m, 0]}}
joints:
  axle: {type: revolute, at: rod.end}
  elbow: {type: revolute, at: bob.end, to: rod.tip}
  drive: {type: driven_angle, at: rod, angle: servo}
controllers:
  servo: {type: measurement, unit: rad, sample: 2 ms, of: 0.2 * sin(20*t) - 0.1 * bend.angle}
loads: {weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}}
outputs: {bend: {type: angle, at: bob}, place: {type: position, at: bob.frame}}
"""
    system = scene(tmp_path, text)
    model = written(system)
    run = CRun(model, tmp_path)
    got, wanted = run.run(150), exact(model, system, STEP, 150)
    known = ~np.isnan(wanted).any(axis=0)
    assert np.abs(got - wanted)[:, known].max() < 1e-9
    # a caller that gives longer spans finds the same
    assert run.call("start") == 0
    for _ in range(15):
        assert run.step(10e-3) == 0
    np.testing.assert_allclose(run.outputs, got[-1], rtol=0, atol=1e-12)


def test_gains_follow_parameters(tmp_path: Path) -> None:
    """Those of a law, and what it gives at the start."""
    base = rod(tmp_path, SERVOS["pid"])

    def family(values: Mapping[str, float]) -> Case:
        servo = {
            one: replace(one, law=replace(one.law, kp=values["kp"], kd=0.1 * values["kp"]))
            for one in base.signals
            if isinstance(one, Controlled)
        }
        return Case(
            replace(base, signals=tuple(servo.get(one, one) for one in base.signals)), STEP, 0.3
        )

    rom = affine.fit(family, (Parameter("kp", 4.0, 12.0, value=8.0, unit="N m"),))
    model = c_files.write(rom, "family", "a family")
    run = CRun(model, tmp_path)
    for kp in (4.5, 11.0):
        run.set("parameter", 0, kp)
        got = run.run(100)
        wanted = exact(model, rom({"kp": kp}).system, STEP, 100)
        known = ~np.isnan(wanted).any(axis=0)
        assert np.abs(got - wanted)[:, known].max() < 1e-6


@pytest.mark.parametrize("sampled", [True, False])
def test_numbers_of_controllers_and_tables_that_c_does_not_follow_are_refused(
    sampled: bool, tmp_path: Path
) -> None:
    """A sample time, and points of a table: no number of the nominal model stands in silently."""
    base = rod(tmp_path, SERVOS["feedback"], kick="0*t + 1")
    table = Table("push", "", (0.0, 1.0), (0.0, 1.0))

    def other(one: Signal, value: float) -> Signal:
        if isinstance(one, Controlled):
            return replace(one, sample=1e-3 * value) if sampled else one
        points = replace(table, values=(0.0, 1.0 if sampled else value))
        return of_time("push(t)", inputs={table.name: points}) if one.text == "0*t + 1" else one

    def family(values: Mapping[str, float]) -> Case:
        signals = tuple(other(one, values["p"]) for one in base.signals)
        return Case(replace(base, signals=signals), STEP, 0.3)

    rom = affine.fit(family, (Parameter("p", 2.0, 4.0, value=2.0, unit=""),))
    with pytest.raises(InputError, match="parameters that change numbers of C files, got"):
        c_files.write(rom, "family", "a family")


def alternate(numbers: np.ndarray, values: np.ndarray, memory: np.ndarray) -> float:
    """A push towards zero, of the other half at every second sample."""
    memory[0] = 1.0 - memory[0]
    return -numbers[0] * math.tanh(values[0] - 0.4) * (0.5 + memory[0])


@storable
@dataclass(frozen=True)
class Alternating(NumberLaw):
    """A law of one's own with a memory."""

    push: float
    memory: tuple[float, ...] = (0.0,)
    kernel = alternate

    def listed(self) -> tuple[float, ...]:
        return (self.push,)


def test_a_law_of_ones_own_has_c(tmp_path: Path) -> None:
    system = rod(tmp_path, "type: measurement, of: hinge.angle * 1 N m")
    law = Alternating(9.0)
    changed = (
        replace(one, law=law) if isinstance(one, Controlled) else one for one in system.signals
    )
    system = replace(system, signals=tuple(changed))
    model = written(system)
    require_alike(model, CRun(model, tmp_path).run(100), exact(model, system, STEP, 100))


def test_what_has_no_c_of_controllers_is_refused(tmp_path: Path) -> None:
    """Functions of Python, and what reads an output without C; both by name."""
    ball = test_controllers.ball(Program(name="servo", sample=0.02, function=lambda t: t))
    with pytest.raises(InputError, match="a law in numbers, got 'servo', a function of Python"):
        written(ball, SCHEME)
    system = rod(tmp_path, "type: measurement, of: drive.torque")
    with pytest.raises(InputError, match=r"controller 'servo': .* got 'drive.torque'"):
        written(system)


@pytest.mark.parametrize("name", ["corners", "a hold"])
def test_tables_drive_in_c_as_in_python(name: str, tmp_path: Path) -> None:
    """Straight lines through points, one of which is inside of a step, and a text that bends."""
    path = "path(t)" if name == "corners" else "where(t < 0.0604, 0, 2*(t - 0.0604))"
    tables = "tables: {path: {file: path.csv, unit: rad, hold: true}}" if name == "corners" else ""
    text = f"""
bodies:
  rod: {{type: rigid, mass: 1 kg, inertia: 0.04 kg m^2, center: [0.25 m, 0], points: {{end: [0, 0], tip: [0.5 m, 0]}}}}
  bob: {{type: rigid, mass: 1 kg, inertia: 0.04 kg m^2, center: [0.75 m, 0], points: {{end: [0.5 m, 0]}}}}
{tables}
joints:
  axle: {{type: revolute, at: rod.end}}
  elbow: {{type: revolute, at: bob.end, to: rod.tip}}
  drive: {{type: driven_angle, at: rod, angle: "{path}"}}
loads: {{weight: {{type: gravity, acceleration: [0, -9.81 m/s^2]}}}}
outputs: {{bend: {{type: angle, at: bob}}, place: {{type: position, at: bob.frame}}, axle: {{type: reaction, joint: axle}}}}
"""
    system = scene(tmp_path, text)
    model = written(system)
    wanted = exact(model, system, STEP, 200)
    off = np.abs(CRun(model, tmp_path).run(200) - wanted).max(axis=0)
    assert (off / np.ptp(wanted, axis=0)).max() < 1e-10


JUMPS = {
    "within steps": "where(t < 0.0505, 1, -2) + 0.5*where(t < 0.0508, 0, 1)",
    "at the start and the ends of steps": "where(t <= 0, 0, 2) - where(t < 0.02, 0, 1)",
    "a short pulse": "30*where(t < 0.0321, 0, 1)*where(t < 0.0324, 1, 0)",
}


def kicked(folder: Path, force: str, turn: float = 0.0, floor: str = "") -> System:
    """A rod that is kicked at its tip, and may hang on a rope; turned, and away from the origin."""
    c, s = math.cos(turn), math.sin(turn)
    x, y = (0.0, 0.0) if turn == 0.0 else (3.0, -2.0)
    places = f"end: [{x} m, {y} m], tip: [{x + 0.5 * c} m, {y + 0.5 * s} m]"
    middle = f"[{x + 0.25 * c} m, {y + 0.25 * s} m]"
    text = f"""
bodies:
  rod: {{type: rigid, mass: 1 kg, inertia: 0.04 kg m^2, center: {middle}, points: {{{places}}}}}
joints: {{pin: {{type: revolute, at: rod.end}}}}
loads:
  kick: {{type: point_force, at: rod.tip, force: [{-10 * s} N, {10 * c} N], history: "{force}"}}
  weight: {{type: gravity, acceleration: [{9.81 * s} m/s^2, {-9.81 * c} m/s^2]}}
{floor}
outputs: {{hinge: {{type: angle, at: rod}}, tip: {{type: position, at: rod.tip}}, axle: {{type: reaction, joint: pin}}}}
"""
    return scene(folder, text)


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("name", JUMPS)
def test_steps_end_where_loads_jump_as_in_python(name: str, turn: float, tmp_path: Path) -> None:
    """Two jumps in a step, some at the begin and at the end of one; nothing is said of them."""
    system = kicked(tmp_path, JUMPS[name], turn)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        model = written(system)
    run = CRun(model, tmp_path)
    got = run.run(100)
    require_alike(model, got, exact(model, system, STEP, 100))
    # in steps of another length, and by fixed corrections, as near as these are
    for fixed, span, near in ((0, 2.5e-3, 2e-6), (4, 1e-3, 1e-6)):
        assert run.call("start") == 0
        run.library.set_fixed(run.memory, fixed)
        for _ in range(round(0.1 / span)):
            assert run.step(span) == 0, run.message(run.step(span))
        np.testing.assert_allclose(run.outputs[:3], got[-1, :3], rtol=0, atol=near)


@pytest.mark.parametrize("force", ["where(t < 0.04, 0, 1)", "where(t <= 0.04, 0, 1)"])
def test_a_load_that_jumps_at_a_sample_instant(force: str, tmp_path: Path) -> None:
    """The state jumps by both, in Python and in C, however the instant is written: the motion is as
    near to one in eighths of the steps as with a jump elsewhere, 4e-7 rad.
    """
    system = rod(tmp_path, SERVOS["pid"], kick=force)
    model = written(system)
    wanted = exact(model, system, STEP, 80)
    require_alike(model, CRun(model, tmp_path).run(80), wanted)
    fine = exact(model, system, GeneralizedAlpha(STEP.step / 8), 640)[::8]
    assert np.abs(wanted - fine)[:, 0].max() < 1e-6


def test_a_rope_and_a_kick_in_one_step(tmp_path: Path) -> None:
    """Pieces between jumps go from touch to touch."""
    rope = "  rope: {type: rope, at: rod.tip, to: [0.5 m, 0.4 m], stiffness: 2e4 N/m, damping: 20 N s/m, length: 0.41 m}"
    system = kicked(tmp_path, "where(t < 0.0405, 0, -1) + where(t < 0.0452, 0, 2)", floor=rope)
    model = written(system)
    require_alike(model, CRun(model, tmp_path).run(100), exact(model, system, STEP, 100))


def test_jumps_that_c_does_not_end_steps_at_are_told(tmp_path: Path) -> None:
    """Behind the duration of the model, and where a parameter moves them."""
    with pytest.warns(
        Notice, match=r"loads jump behind the end of its duration at 0\.3 s, at t = 0\.4 s"
    ):
        written(kicked(tmp_path, "where(t < 0.4, 0, 1)"))

    def family(values: Mapping[str, float]) -> Case:
        return Case(kicked(tmp_path, f"where(t < {values['T']!r}, 0, 1)"), STEP, 0.3)

    rom = affine.fit(family, (Parameter("T", 0.01, 0.02, value=0.015, unit="s"),))
    with pytest.warns(Notice, match="loads jump when parameters say"):
        c_files.write(rom, "family", "a family")


def test_steps_in_parts_by_their_error_are_those_of_python(tmp_path: Path) -> None:
    """As many parts, on the same path."""
    scheme = GeneralizedAlpha(5e-3, local_error=1e-7)
    system = kicked(tmp_path, "sin(40*t)")
    model = written(system, scheme)
    run = CRun(model, tmp_path)
    got = run.run(60)
    motion = dynamics.integrate(system, scheme, 0.3, Newton(tolerance=1e-15))
    require_alike(model, got, exact(model, system, scheme, 60))
    whole = dynamics.integrate(system, replace(scheme, local_error=0.0), 0.3)
    assert motion.statistics.iterations > 1.5 * whole.statistics.iterations


@pytest.mark.parametrize("fixed", [0, 3])
def test_a_loop_that_diverges_ends_in_a_status(fixed: int, tmp_path: Path) -> None:
    """As long as a step says that all is well its numbers are some; the last good ones stay."""
    gains = "type: state_feedback, states: [hinge.angle - 0.1, hinge.rate], gains: [-9e4 N m, -9e3 N m s]"
    run = CRun(written(rod(tmp_path, gains), tolerance=1e-10), tmp_path)
    assert run.call("start") == 0
    run.library.set_fixed(run.memory, fixed)
    status, steps = 0, 0
    while status == 0 and steps < 5000:
        before, time = run.outputs, run.time
        assert np.isfinite(before).all()
        status = run.step(1e-3)
        steps += 1
    assert status != 0
    assert run.time == time
    np.testing.assert_array_equal(run.outputs[:3], before[:3])


def test_the_work_of_a_step_by_fixed_corrections_is_bounded(tmp_path: Path) -> None:
    """One factorisation and so many corrections, and one factorisation more where a controller gives
    another value: counted in the memory of the program.
    """
    model = written(rod(tmp_path, SERVOS["pid"]), tolerance=1e-10)
    run = CRun(model, tmp_path)
    assert run.call("start") == 0
    run.library.set_fixed(run.memory, 3)
    count = compiled(tmp_path, [COUNTS.replace("NAME", model.name)], "counts")
    for k in range(40):
        before = count.corrections(run.memory), count.factorisations(run.memory)
        assert run.step(1e-3) == 0
        assert count.corrections(run.memory) == before[0] + 3
        assert count.factorisations(run.memory) == before[1] + (2 if k % 4 == 0 else 1)


def test_a_start_without_numbers_is_a_status(tmp_path: Path) -> None:
    """A torque that is infinite there."""
    text = (tmp_path / "scene.yaml").write_text
    rod(tmp_path, SERVOS["pid"])
    given = (tmp_path / "scene.yaml").read_text()
    text(given.replace("servo - 0.01 N m s * hinge.rate", "servo + 1 N m / hinge.angle"))
    system = build.system(scenes.read(tmp_path / "scene.yaml"))
    with np.errstate(all="ignore"):
        run = CRun(written(system), tmp_path)
    assert b"no finite numbers" in run.message(run.call("start"))


@storable
@dataclass(frozen=True, kw_only=True)
class Watch(Monitor, word=None):
    """Looks at nothing."""

    name: str

    def observer(self) -> Observer:
        return Observer()


def test_monitors_are_left_out_and_listed(tmp_path: Path) -> None:
    system = replace(kicked(tmp_path, "1"), monitors=(Watch(name="fence"),))
    assert "monitor 'fence'" in written(system).left_out


def test_the_example_of_a_sampled_arm_moves_in_c_as_in_python(tmp_path: Path) -> None:
    """Reduced, with some hundred samples at both limits, between which the loop passes on what it
    reads: in Python alone loads that differ by 1e-14 of themselves end 3e-7 of the range apart.
    """
    model = scenes.read(EXAMPLES / "sampled_arm.yaml")
    scheme = build.stepped(model).scheme
    full = full_of(build.system(model), scheme, 1.0)
    system = reduced(full, reduction.body_level(full.raw), 1e-8).system
    found = written(system, scheme)
    got, wanted = CRun(found, tmp_path).run(600), exact(found, system, scheme, 600)
    require_alike(found, got[:40], wanted[:40])
    known = ~np.isnan(wanted).any(axis=0)
    off = np.abs(got - wanted)[:, known].max(axis=0)
    assert (off < 3e-6 * np.ptp(wanted[:, known], axis=0)).all()
