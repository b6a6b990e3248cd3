"""Reduced models in C against their runs in Python, and what a caller in C does with them."""

from __future__ import annotations

import ctypes
import subprocess
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import control, dynamics, reduction, scenes
from fmbs_skfem.bodies import body, own_laws, sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.from_matrices import from_matrices
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.errors import InputError, say
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.expressions import Expression, of_time
from fmbs_skfem.core.values.inputs import Input
from fmbs_skfem.core.values.profiles import MotionLimits, Move, Word, motion
from fmbs_skfem.core.values.ranges import Parameter
from fmbs_skfem.core.values.tables import Table
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton
from fmbs_skfem.exports import c_files, refusals
from fmbs_skfem.exports.numbers import Numbers
from fmbs_skfem.parts.condensation import condense, damp
from fmbs_skfem.reduction import affine
from fmbs_skfem.reduction.affine import ParametricCase
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.hyper import polynomial
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.studies import reducing
from fmbs_skfem.studies.job import Job, Listener
from fmbs_skfem.studies.running import exportable
from fmbs_skfem.systems import At, Rayleigh, System, assemble, compile_system, signals
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads, springs
from fmbs_skfem.systems.measures import probes
from tests import models
from tests.cli.calls import fmbs
from tests.dynamics import test_events
from tests.exports.c_library import COMPILER, STRICT, CRun
from tests.exports.held import held
from tests.exports.test_c_control import SERVOS, rod
from tests.reduction.conftest import full_of, hyper_reduced, projected, reduced
from verification import solids
from verification.plates import rectangle

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

STEP = GeneralizedAlpha(1e-3)
MATERIAL, ROUND = models.MATERIAL, sections.Circular(0.01)


def pendulum(**options: object) -> System:
    """Two beams in space in few modes, with some points."""
    full = full_of(models.double_pendulum(8, all_multipliers=True, **options), STEP, 0.4)
    return hyper_reduced(reduced(full, reduction.body_level(full.raw), 1e-8))[0]


def arm(load: object, dim: int = 2, **more: object) -> System:
    """A beam on a hinge under a load, in few modes, with all points."""
    beam = body.cable("beam", segment(6), ROUND, MATERIAL, dim=dim)
    tip, root = At("beam", "right"), At("beam", "left")
    outputs = {"tip": probes.Position(tip), "slope": probes.Slope(tip), "energy": probes.Energy()}
    if dim == 2:
        outputs |= {
            "turn": probes.Angle(root),
            "rate": probes.AngularVelocity(root),
            "root": probes.Reaction("hinge"),
        }
    weight = [loads.Gravity((0, -9.81) if dim == 2 else (0, 0, -9.81))]
    raw = assemble([beam], [joints.Pin("hinge", root)], [*weight, load], outputs=outputs, **more)
    full = full_of(replace_inputs(raw), STEP, 0.4)
    made = reduced(full, reduction.body_level(full.raw), 1e-8).system
    return replace(made, signals=raw.signals)


def planets() -> System:
    """A sun, planets and a ring in space, rigid, on their gears."""
    return build.system(scenes.read(Path(__file__).parents[2] / "examples" / "planetary_gear.yaml"))


def touching(load: str, points: str = "") -> System:
    """A body that a slanting weight moves, beside what it touches."""
    text = f"""
schema: 1
dimension: 2
bodies:
  body: {{type: rigid, mass: 1 kg, inertia: 4e-3 kg m^2, center: [0, 0.1 m]{points}}}
loads:
  weight: {{type: gravity, acceleration: [3 m/s^2, -9.81 m/s^2]}}
{load}
outputs: {{place: {{type: position, at: body.frame}}}}
analysis: {{type: dynamic, duration: 0.3 s, step: 1 ms}}
"""
    return build.system(scenes.loads(text))


FLOOR = "  {name}: {{type: contact_plane, at: body.{at}, point: [0, {y}], normal: [0, 1], friction: 0.3, stiffness: 1e5 N/m, {more}}}"


def bouncing() -> System:
    """A ball that falls onto a floor with friction."""
    floor = FLOOR.format(name="floor", at="low", y=0, more="dissipation: 0.1 s/m")
    return touching(floor, ", points: {low: [0, 0.05 m]}")


def sliding() -> System:
    """A box that stands on two corners, and slides where it just does not stick."""
    floors = (FLOOR.format(name=f"on_{at}", at=at, y=0, more="damping: 100 N s/m") for at in "ab")
    return touching("\n".join(floors), ", points: {a: [-0.1 m, 0], b: [0.1 m, 0]}")


def chain(count: int = 10) -> System:
    """Rigid bodies on hinges, a full model whose matrices are banded."""
    bodies = [
        f"  b{k}: {{type: rigid, mass: 1 kg, inertia: 2e-3 kg m^2, center: [{0.2 * k} m, 0], "
        f"points: {{left: [{0.2 * k - 0.1} m, 0], right: [{0.2 * k + 0.1} m, 0]}}}}"
        for k in range(count)
    ]
    hinges = [
        f"  j{k}: {{type: revolute, at: b{k - 1}.right, to: b{k}.left}}" for k in range(1, count)
    ]
    lines = [
        *("schema: 1", "dimension: 2", "bodies:", *bodies, "joints:"),
        *("  wall: {type: revolute, at: b0.left}", *hinges, "loads:"),
        "  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}",
        f"outputs: {{end: {{type: position, at: b{count - 1}.right}}}}",
        "analysis: {type: dynamic, duration: 0.3 s, step: 1 ms}",
    ]
    return build.system(scenes.loads("\n".join(lines)))


def caught() -> System:
    """A body that a rope catches."""
    return touching(
        "  rope: {type: rope, at: body.frame, to: [0.3 m, 0.1 m], stiffness: 2e4 N/m, damping: 20 N s/m, length: 0.4 m}"
    )


def replace_inputs(system: System) -> System:
    return signals.with_inputs(
        system, {name: of_time("sin(20*t)") for name in signals.inputs_of(system)}
    )


def case_of(system: System, scheme: GeneralizedAlpha = STEP, **newton: float) -> Case:
    return Case(system, scheme, 0.3, Newton(**newton))


def compare(
    case: Case, folder: Path, steps: int = 300, told: Mapping[str, float] | None = None
) -> float:
    """Largest difference of an output, over its range."""
    model = c_files.write(case, "model under test", "a model")
    found = CRun(model, folder)
    for name, value in (told or {}).items():
        found.set("input", list(model.inputs).index(name), value)
    got = found.run(steps, 10)
    system = signals.with_inputs(
        case.system, {name: of_time(value) for name, value in (told or {}).items()}
    )
    columns = dynamics.outputs(
        dynamics.integrate(system, case.scheme, steps * case.scheme.step, case.newton, 10)
    )
    exact = np.stack([columns[one.name] for one in model.columns], axis=1)
    return float((np.abs(got - exact).max(axis=0) / np.maximum(np.ptp(exact, axis=0), 1e-9)).max())


def by_tables() -> Expression:
    """Functions of time and of an expression, straight and smooth, read beyond their ends as well."""
    rise = Table("rise(t)", "", (0.02, 0.1, 0.15, 0.2), (0.0, 1.0, -0.4, 0.3))
    bend = Table(
        "bend", "", (-0.5, 0.0, 0.4, 0.8), (0.2, 0.0, 0.5, 2.0), smooth=True, of="", hold=True
    )
    return of_time(
        "rise(t) + bend(sin(9*t)) - 2*rise(t/2)*rise(t)", None, {"rise": rise, "bend": bend}
    )


def turning(t: np.ndarray) -> np.ndarray:
    return 3.0 * t


def shaft() -> System:
    """A bent beam that twists, under a moment at its end, in few modes with all points."""
    section = sections.BeamSection(
        np.diag([2e4, 1e4, 1e4, 2.0, 3.0, 4.0]), np.diag([0.2, 1e-5, 1e-5])
    )
    part = beam("beam", segment(4), section, direction=(0.0, 0.0, 1.0))
    tip = At("beam", "right")
    turn = loads.Moment("turn", tip, (0.3, 0.2, 0.1), history=of_time("sin(15*t)"))
    outputs = {"tip": probes.Position(tip), "energy": probes.Energy()}
    raw = assemble(
        [part],
        [joints.Clamp("wall", At("beam", "left"))],
        [turn],
        outputs=outputs,
        damping=Rayleigh(stiffness=1e-4),
    )
    full = full_of(raw, STEP, 0.4)
    return reduced(full, reduction.body_level(full.raw), 1e-8).system


def given(profile: Word) -> System:
    """A beam in few modes whose root is driven by a profile, with corners within steps."""
    limits = MotionLimits(6.0, 60.0) if profile == "trapezoidal" else MotionLimits(speed=8.0)
    moves = [Move(0.6, dwell=0.03), Move(0.1)]
    raw = models.turned_by(motion(profile, moves, start=0.0213, limits=limits))
    full = full_of(raw, STEP, 0.3)
    return reduced(full, reduction.body_level(full.raw), 1e-8).system


def sheet(exact: bool = False) -> System:
    """A plate in its plane that swings, in few modes, with all points or as a polynomial."""
    part = plate(
        "sheet",
        rectangle("nurbs", 4, 2, 0.4, 0.1),
        0.01,
        sections.Material(1e7, 1000.0, 0.3),
        dim=2,
    )
    corner = At("sheet", "c")
    outputs = {"corner": probes.Position(corner), "energy": probes.Energy()}
    raw = assemble(
        [part], [joints.Pin("pin", At("sheet", "a"))], [loads.Gravity((0, -9.81))], outputs=outputs
    )
    full = full_of(raw, STEP, 0.4)
    made = reduced(full, reduction.body_level(full.raw), 1e-8).system
    return polynomial.exact(made) if exact else made


def of_matrices() -> System:
    """A pendulum by its stiffness and mass matrices, hung at a node, damped."""
    nodes, K, M = solids.bar((2, 1, 1), E=1e9)
    ends = {"left": solids.at(nodes, 0.0)[0], "right": solids.at(nodes, 1.0)[0]}
    part = damp(condense(from_matrices("rod", nodes, K, M, places=ends), 1, False), 0.01)
    outputs = {"tip": probes.Position(At("rod", "right")), "energy": probes.Energy()}
    pin = joints.Pin("pin", At("rod", "left"))
    raw = assemble([part], [pin], [loads.Gravity((0, 0, -9.81))], outputs=outputs)
    full = full_of(raw, STEP, 0.3)
    return reduced(full, reduction.body_level(full.raw), 1e-10).system


CASES = {
    "a body of matrices": of_matrices,
    "planets on gears": planets,
    "a ball that bounces": bouncing,
    "a box that slides": sliding,
    "a body that a rope catches": caught,
    "a beam that twists": shaft,
    "a plate in its plane": sheet,
    "a plate as a polynomial": lambda: sheet(True),
    "points in space": pendulum,
    "damped, in space": lambda: pendulum(damping=Rayleigh(stiffness=1e-4, mass=0.1)),
    "a force": lambda: arm(
        loads.PointForce("push", At("beam", "right"), (0.3, 0.2), history=of_time("sin(9*t)"))
    ),
    "a profile of the least jerk": lambda: given("minimum_jerk"),
    "a trapezoid that drives": lambda: given("trapezoidal"),
    "a force by tables": lambda: arm(
        loads.PointForce("push", At("beam", "right"), (0.3, 0.2), history=by_tables())
    ),
    "a moment": lambda: arm(loads.Moment("turn", At("beam", "right"), 0.05)),
    "a moment in space": lambda: arm(
        loads.Moment("turn", At("beam", "right"), (0.0, 0.05, 0.02)), 3
    ),
    "a follower": lambda: arm(loads.Follower("jet", At("beam", "right"), (0.3, 0.2))),
    "a spring": lambda: arm(
        springs.SpringDamper("spring", At("beam", "right"), (0.5, 0.8), stiffness=40.0, damping=0.2)
    ),
    "a torsion spring": lambda: arm(
        loads.TorsionSpring("spring", At("beam", "left"), stiffness=3.0, damping=0.1)
    ),
    "a rope": lambda: arm(
        springs.Rope(
            "rope",
            At("beam", "right"),
            (0.8, 0.4),
            stiffness=200.0,
            damping=1.0,
            smoothing=0.02,
            resolution=0.0,
        )
    ),
    "a constant pull": lambda: arm(
        springs.ConstantForce("pull", At("beam", "right"), (0.5, 0.8), force=0.3)
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_model_moves_in_c_as_in_python(name: str, tmp_path: Path) -> None:
    """Solved to round-off; with the tolerance of a run both leave as much, and go apart where one
    of them is more exact.
    """
    case = case_of(CASES[name](), tolerance=1e-15)
    assert compare(case, tmp_path) < 1e-10


#: without functions of time, and with no products that are left to BLAS or regrouped
EXACT = {
    *("a ball that bounces", "a box that slides", "a body that a rope catches"),
    *("a plate in its plane", "points in space", "damped, in space", "a moment"),
    *("a moment in space", "a follower", "a spring", "a rope", "a constant pull"),
}


@pytest.mark.parametrize("name", sorted(EXACT))
def test_states_in_c_are_those_of_python_to_the_bit(name: str, tmp_path: Path) -> None:
    """Where the compiler contracts no products into sums, whatever the tolerance is."""
    case = case_of(CASES[name]())
    found = CRun(c_files.write(case, "model under test", "a model"), tmp_path)
    started, _ = c_files.at_start(Numbers(case), name)
    steps = 100
    span = steps * case.scheme.step
    motion = dynamics.integrate(started.system, case.scheme, span, case.newton, 10)
    order = compile_system(started.system).order
    assert found.call("start") == 0
    for k in range(steps):
        assert found.step(case.scheme.step) == 0
        if (k + 1) % 10 == 0:
            wanted = motion.x[(k + 1) // 10, order]
            np.testing.assert_array_equal(found.state(len(order)), wanted)


@pytest.fixture(scope="module")
def small() -> System:
    return pendulum()


@pytest.fixture(scope="module")
def plant() -> System:
    """A beam on a hinge with a torque that is given from outside."""
    torque = Input("torque", "N m", 0.0)
    return arm(loads.Moment("motor", At("beam", "left"), 1.0, history=torque))


def test_a_compressed_beam_begins_as_in_python(plant: System, tmp_path: Path) -> None:
    """At half of its length nothing holds what begins to move: steps begin with M^-1 f."""
    short = replace(plant, x0=projected(plant, 0.5 * plant.lift(plant.x0)[None])[0])
    assert compare(case_of(short, GeneralizedAlpha(1e-5), tolerance=1e-15), tmp_path, 10) < 1e-10


def test_a_drive_moves_its_joint_with_derivatives_of_its_text(tmp_path: Path) -> None:
    """Derivatives of histories are exact in C, differences in Python."""
    full = full_of(models.spin_up(8, all_multipliers=True), STEP, 0.4)
    made = reduced(full, reduction.body_level(full.raw), 1e-8).system
    angle = of_time("2*pi/1.5*(t**2/2 + (1.5/(2*pi))**2*(cos(2*pi*t/1.5) - 1))")
    made = replace(made, signals=tuple(replace(one, angle=angle) for one in made.signals))
    assert compare(case_of(made), tmp_path) < 1e-8


def test_a_table_drives_as_in_python(tmp_path: Path) -> None:
    """A spline with its derivatives, read by another argument than t as well."""
    t = np.linspace(0.0, 0.6, 13)
    table = Table("path", "rad", tuple(t), tuple(2.0 * (1.0 - np.cos(3.0 * t))), True)
    full = full_of(models.spin_up(8, all_multipliers=True), STEP, 0.4)
    made = reduced(full, reduction.body_level(full.raw), 1e-8).system
    angle = of_time("path(t) + 0.2*path(0.3*t)", inputs={table.name: table})
    driven = tuple(signals.as_drive(replace(one, angle=angle)) for one in made.signals)
    assert compare(case_of(replace(made, signals=driven)), tmp_path) < 1e-8


def test_a_law_of_ones_own_is_written_from_its_energy(tmp_path: Path) -> None:
    def energy(r, EA, EI, kappa0):  # type: ignore[no-untyped-def]
        eps = (r[0].dot(r[0]) - 1) / 2
        return EA / 2 * eps**2 * (1 + eps**2) + EI / 2 * r[1].dot(r[1])

    law = own_laws.define("stiffening_in_c", 2, ("EA", "EI", "kappa0"), energy)
    assert compare(case_of(pendulum(law=law), tolerance=1e-15), tmp_path) < 1e-10


@pytest.mark.parametrize(
    "kind",
    [
        *("as it is", "with divided steps", "with a driven joint", "with an input", "of a range"),
        *("with a controller and a kick", "with events"),
    ],
)
def test_the_source_is_clean_and_its_memory_sound(
    kind: str, small: System, plant: System, tmp_path: Path
) -> None:
    """No warning, and no access outside of an array or undefined operation in some steps, as a
    program of its own.
    """
    step = GeneralizedAlpha(2e-2) if kind == "with divided steps" else STEP
    systems = {
        "with a driven joint": lambda: servo(False),
        "with an input": lambda: plant,
        "with a controller and a kick": lambda: rod(
            tmp_path, SERVOS["measurement"], kick="where(t < 0.0105, 0, 1)"
        ),
        "with events": lambda: test_events.rod(
            {
                "brake": test_events.event("angle > 0.05", lock=("pin",)),
                "go": test_events.event("pin.x_locked + t - 0.0233", release=("pin",)),
            }
        ),
    }
    case: Case | ParametricCase = case_of(systems.get(kind, lambda: small)(), step)
    if kind == "of a range":
        FIXED["system"] = small
        parameters = (
            Parameter("E", 0.5e9, 2e9, value=1e9, unit="Pa"),
            Parameter("g", 5.0, 12.0, value=9.81, unit="m/s^2"),
        )
        case = affine.fit(family, parameters)
    model = c_files.write(case, "clean", "a model")
    (tmp_path / "clean.h").write_text(model.header)
    (tmp_path / "clean.c").write_text(model.source)
    main = """
#include "clean.h"
static clean_memory m;
int main(void)
{
    double out[clean_OUTPUTS];
    clean_init(&m);
    if (clean_start(&m) != clean_OK)
        return 1;
    for (int k = 0; k < 50; k++) {
        if (clean_EVENTS == 0) { /* else it is what a lock holds */
            m.inputs[0] = 0.01 * k * k / 50;
            m.rates[0][0] = k % 3 == 0 ? 0.02 * k / 50 : 0.0;
        }
        if (clean_PARAMETERS > 1 && k == 20)
            m.parameters[1] = 6.0;
        if (clean_step(&m, k == 40 ? 2.5 * clean_STEP : clean_STEP) != clean_OK)
            return 2;
    }
    if (clean_derivative(&m, 0, out) == clean_SINGULAR)
        return 4;
    clean_outputs(&m, out);
    return out[0] == out[0] ? 0 : 3;
}
"""
    (tmp_path / "main.c").write_text(main)
    flags = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-pedantic",
        "-Werror",
        "-O1",
        "-g",
        "-fsanitize=address,undefined",
    ]
    flags += ["-fno-sanitize-recover"]
    subprocess.run(
        [str(COMPILER), *flags, "main.c", "clean.c", "-o", "main"], cwd=tmp_path, check=True
    )
    subprocess.run([str(tmp_path / "main")], check=True, timeout=120)
    assert "malloc" not in model.source
    assert '#include "clean.h"' in model.source
    assert model.source.count("#include") == 1


def test_inputs_act_and_are_held(plant: System, tmp_path: Path) -> None:
    assert compare(case_of(plant, tolerance=1e-15), tmp_path, told={"torque": 0.03}) < 1e-10


CART = """
schema: 1
dimension: 2
inputs: {u: {unit: N}}
bodies: {cart: {type: point_mass, mass: 2 kg, position: [0, 0]}}
loads:
  push: {type: control_force, at: cart, direction: [1, 0], force: u}
  spring: {type: spring_damper, at: cart, to: [-1 m, 0], stiffness: 50 N/m}
outputs: {place: {type: position, at: cart, component: x}, speed: {type: velocity, at: cart, component: x}}
analysis: {type: dynamic, duration: 1 s, step: 10 ms}
"""
RATE = 5.0  #: of its free vibration [1/s]


def pushed(t: float) -> float:
    """A force that jumps at the ends of steps [N]."""
    return 4.0 if t < 0.3 - 1e-9 else -3.0 if t < 0.7 - 1e-9 else 1.5


def driven_cart(folder: Path, step: float, tell: Callable[[CRun, float], None]) -> np.ndarray:
    """Place and speed of the cart after 1 s, whose inputs are told before every step."""
    case = Case(build.system(scenes.loads(CART)), GeneralizedAlpha(step), 1.0, Newton(1e-15))
    run = CRun(c_files.write(case, f"cart_{round(1 / step)}", "a cart"), folder)
    assert run.call("start") == 0
    for k in range(round(1.0 / step)):
        tell(run, k * step)
        assert run.step(step) == 0
    return run.outputs


def test_a_held_input_acts_from_the_begin_of_its_step(tmp_path: Path) -> None:
    """Of second order against the exact motion under it, and that of a controller in Python."""
    x, v = 0.0, 0.0
    for begin, end in pairwise((0.0, 0.3, 0.7, 1.0)):
        rest, s, c = (
            pushed(begin) / 50.0,
            np.sin(RATE * (end - begin)),
            np.cos(RATE * (end - begin)),
        )
        x, v = rest + (x - rest) * c + v / RATE * s, -RATE * (x - rest) * s + v * c
    errors = []
    for step in (0.02, 0.01, 0.005):
        got = driven_cart(tmp_path, step, lambda run, t: run.set("input", 0, pushed(t)))
        system = held(build.system(scenes.loads(CART)), step, {"u": pushed})
        columns = dynamics.outputs(
            dynamics.integrate(system, GeneralizedAlpha(step), 1.0, Newton(1e-15))
        )
        np.testing.assert_allclose(
            got, [columns["place"][-1], columns["speed"][-1]], rtol=0, atol=1e-12
        )
        errors.append(np.abs(got - [x, v]))
    assert errors[1].max() < 1e-3
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.abs(orders - 2.0).max() < 0.1


def test_an_input_with_derivatives_changes_within_its_step(tmp_path: Path) -> None:
    """Of second order against a force that is a parabola, which one span follows in many steps."""

    def told(run: CRun, t: float) -> None:
        run.set("input", 0, 3.0 * t * t)
        run.rate(0, 0, 6.0 * t)
        run.rate(1, 0, 6.0)

    # x'' + 25 x = 1.5 t^2
    t = 1.0
    exact = 0.06 * (t * t - 0.08 * (1.0 - np.cos(RATE * t)))
    speed = 0.06 * (2.0 * t - 0.08 * RATE * np.sin(RATE * t))
    errors = [
        np.abs(driven_cart(tmp_path, step, told) - [exact, speed]).max() for step in (0.02, 0.01)
    ]
    assert errors[1] < 1e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
    # one span of the same steps: the same motion, and the input where it ends
    case = Case(build.system(scenes.loads(CART)), GeneralizedAlpha(0.01), 1.0, Newton(1e-15))
    run = CRun(c_files.write(case, "span", "a cart"), tmp_path)
    assert run.call("start") == 0
    told(run, 0.0)
    assert run.step(1.0) == 0
    assert np.abs(run.outputs - [exact, speed]).max() == pytest.approx(errors[1], rel=1e-6)
    assert run.input(0) == pytest.approx(3.0, rel=1e-12)
    assert run.step(0.01) == 0
    assert run.input(0) == pytest.approx(3.0, rel=1e-12)
    run.rate(0, 0, np.nan)
    assert run.message(run.step(0.01)) == b"an input is not finite"


def test_two_models_are_two_memories_and_a_copy_is_a_saved_state(
    plant: System, tmp_path: Path
) -> None:
    model = c_files.write(case_of(plant), "plant", "a plant")
    run = CRun(model, tmp_path)
    first = run.run(50)
    saved = ctypes.string_at(run.memory, run.library.memory_size())
    run.set("input", 0, 0.1)
    for _ in range(20):
        assert run.step(model.step) == 0
    later = run.outputs
    other, run.memory = run.memory, run.room()
    run.call("init")
    np.testing.assert_array_equal(run.run(50), first)  # another instance, bit for bit
    ctypes.memmove(other, saved, len(saved))
    run.memory = other
    np.testing.assert_array_equal(run.outputs, first[-1])
    run.set("input", 0, 0.1)
    for _ in range(20):
        assert run.step(model.step) == 0
    np.testing.assert_array_equal(run.outputs, later)


def test_a_start_begins_again_bit_for_bit(small: System, tmp_path: Path) -> None:
    run = CRun(c_files.write(case_of(small), "again", "a model"), tmp_path)
    np.testing.assert_array_equal(run.run(60), run.run(60))
    assert run.time == pytest.approx(0.06, rel=1e-14)


def test_spans_that_are_no_step_of_the_model_are_divided(small: System, tmp_path: Path) -> None:
    """A span of some steps is these steps; another one is divided into shorter ones, whose error is
    smaller.
    """
    model = c_files.write(case_of(small), "spans", "a model")
    run = CRun(model, tmp_path)
    whole = run.run(60)[::4]
    run.call("start")
    for k in range(15):
        assert run.step(4 * model.step) == 0
        np.testing.assert_allclose(run.outputs, whole[k + 1], rtol=0, atol=1e-12)
    run.call("start")
    for _ in range(24):
        assert run.step(2.5 * model.step) == 0
    assert run.time == pytest.approx(0.06)
    np.testing.assert_allclose(run.outputs, whole[-1], rtol=0, atol=2e-5)
    assert np.abs(run.outputs - whole[-1]).max() > 1e-12


def test_bad_input_is_told_and_nothing_is_lost(plant: System, tmp_path: Path) -> None:
    model = c_files.write(case_of(plant), "bad", "a plant")
    run = CRun(model, tmp_path)
    before = run.run(20)[-1]
    for value in (np.nan, np.inf, -np.inf):
        run.set("input", 0, value)
        assert run.message(run.step(model.step)) == b"an input is not finite"
        np.testing.assert_array_equal(run.outputs, before)
    run.set("input", 0, 0.0)
    for span in (0.0, -1e-3, np.nan, np.inf):
        assert run.message(run.step(span)) == b"the span of a step is not positive"
    assert run.step(model.step) == 0


def test_a_step_that_fails_keeps_the_last_good_state(plant: System, tmp_path: Path) -> None:
    model = c_files.write(case_of(plant), "failing", "a plant")
    run = CRun(model, tmp_path)
    before, time = run.run(20)[-1], run.time
    run.set("input", 0, 1e12)
    status = run.step(model.step)
    assert status != 0
    assert b"the state is that of the last good one" in run.message(status)
    np.testing.assert_array_equal(run.outputs, before)
    assert run.time == time
    run.set("input", 0, 0.0)
    assert run.step(model.step) == 0


def test_derivatives_are_those_of_a_step(plant: System, tmp_path: Path) -> None:
    """Of all outputs by the input of the last step, against differences of two steps from one
    state.
    """
    model = c_files.write(case_of(plant, tolerance=1e-14), "slopes", "a plant")
    run = CRun(model, tmp_path)
    run.run(40)
    saved, change, found = ctypes.string_at(run.memory, run.library.memory_size()), 1e-4, []
    for side in (change, -change, 0.0):
        ctypes.memmove(run.memory, saved, len(saved))
        run.set("input", 0, side)
        assert run.step(model.step) == 0
        found.append(run.outputs)
    for number in (-1, 1, 1000):
        assert run.message(run.call("derivative", number, None)) == b"there is no such input"
    exact, slopes = (found[0] - found[1]) / (2 * change), run.derivative(0)
    assert np.abs(exact).max() > 1e-4
    # forces of joints are of another kind
    steady = [k for k, one in enumerate(model.columns) if not one.name.startswith("root")]
    np.testing.assert_allclose(
        slopes[steady], exact[steady], rtol=1e-3, atol=1e-6 * np.abs(exact[steady]).max()
    )


def test_a_fixed_number_of_corrections_goes_the_same_way(small: System, tmp_path: Path) -> None:
    """Every step has new factors and three corrections then: as good as the tolerance, at the same
    cost each.
    """
    model = c_files.write(case_of(small), "fixed", "a model")
    run = CRun(model, tmp_path)
    whole = run.run(200, 50)
    run.library.set_fixed(run.memory, 4)
    np.testing.assert_allclose(run.run(200, 50), whole, rtol=0, atol=1e-7)
    assert run.library.left_of(run.memory) < 1e-12


def test_a_fixed_number_of_corrections_is_bounded(plant: System, tmp_path: Path) -> None:
    """A push that two corrections cannot follow is a status, with how many can, and the state
    stays.
    """
    model = c_files.write(case_of(plant), "bounded", "a plant")
    run = CRun(model, tmp_path)
    run.run(20)
    run.library.set_fixed(run.memory, 2)
    run.set("input", 0, 50.0)
    time, before = run.time, run.outputs
    status = run.step(model.step)
    assert b"too few" in run.message(status)
    assert run.time == time
    np.testing.assert_array_equal(run.outputs, before)
    enough = run.library.enough_of(run.memory)
    assert 2 < enough < 30
    run.library.set_fixed(run.memory, enough)
    assert run.step(model.step) == 0


def test_inputs_beyond_their_range_are_a_status_once(tmp_path: Path) -> None:
    """Before the step, which the next call takes."""
    torque = Input("torque", "N m", 0.0, range=(-1.0, 1.0))
    model = c_files.write(
        case_of(arm(loads.Moment("motor", At("beam", "left"), 1.0, history=torque))),
        "beyond",
        "a plant",
    )
    run = CRun(model, tmp_path)
    assert run.call("start") == 0
    statuses = []
    for value in (1.0, 1.001, 1.001, 0.5, -1.2):
        run.set("input", 0, value)
        statuses.append(run.step(model.step))
    assert b"outside of the range" in run.message(statuses[1])
    assert np.flatnonzero(statuses).tolist() == [1]
    assert run.time == 4 * model.step


def test_time_is_a_number_of_steps(small: System, tmp_path: Path) -> None:
    """After a thousand million of them as well, and from a step that is none of the model on."""
    model = c_files.write(case_of(small), "clock", "a model")
    run = CRun(model, tmp_path)
    run.run(3)
    assert run.time == 3 * model.step
    run.library.set_steps(run.memory, ctypes.c_longlong(10**9))
    for k in range(1, 4):
        assert run.step(model.step) == 0
        assert run.time == (10**9 + k) * model.step
    assert run.step(1.5 * model.step) == 0
    begin = run.time
    for k in range(1, 4):
        assert run.step(model.step) == 0
        assert run.time == begin + k * model.step


def test_what_a_few_corrections_leave_does_not_grow(plant: System, tmp_path: Path) -> None:
    """Under torques that jump every 5 ms, of a body that turns fast: what is left is none of the
    motion.
    """
    model = c_files.write(case_of(plant), "jumps", "a plant")
    few, exact = CRun(model, tmp_path), CRun(model, tmp_path)
    assert few.call("start") == exact.call("start") == 0
    few.library.set_fixed(few.memory, 3)
    torques = np.random.default_rng(3).uniform(-1.0, 1.0, 40)
    for torque in 0.03 * torques:
        for run in (few, exact):
            run.set("input", 0, torque)
            for _ in range(5):
                assert run.step(model.step) == 0
        np.testing.assert_allclose(few.outputs[:2], exact.outputs[:2], atol=1e-4)


def family(values: Mapping[str, float]) -> Case:
    """The beams of the pendulum in few modes, over Young's modulus and gravity."""
    made = FIXED["system"]
    E, g = values["E"] / 1e9, values["g"] / 9.81
    elastic = []
    for one in made.elastic:
        section = one.gather.section.copy()
        section[:2] *= E
        elastic.append(replace(one, gather=replace(one.gather, section=section)))
    changed = replace(
        made, elastic=tuple(elastic), loads=replace(made.loads, constant=g * made.loads.constant)
    )
    return Case(changed, STEP, 0.3)


FIXED: dict[str, System] = {}


def test_parameters_of_a_box_are_variables(small: System, tmp_path: Path) -> None:
    FIXED["system"] = small
    parameters = (
        Parameter("E", 0.5e9, 2e9, value=1e9, unit="Pa"),
        Parameter("g", 5.0, 12.0, value=9.81, unit="m/s^2"),
    )
    rom = affine.fit(family, parameters)
    model = c_files.write(rom, "family", "a family")
    assert model.parameters["g"] == ("m/s^2", 5.0, 12.0, 9.81)
    run = CRun(model, tmp_path)
    for E, g in ((1e9, 9.81), (0.7e9, 11.0), (1.9e9, 5.5)):
        run.set("parameter", 0, E)
        run.set("parameter", 1, g)
        case = rom({"E": E, "g": g})
        columns = dynamics.outputs(dynamics.integrate(case.system, STEP, 0.2, case.newton, 10))
        exact = np.stack([columns[one.name] for one in model.columns], axis=1)
        np.testing.assert_allclose(run.run(200, 10), exact, rtol=0, atol=1e-9)
    run.set("parameter", 1, 12.5)
    assert (
        run.message(run.call("start"))
        == b"a parameter is outside of the range that the model was trained for"
    )


def test_parameters_of_forces_change_in_a_motion(small: System, tmp_path: Path) -> None:
    """Young's modulus and gravity, which no parameter of mass is: the motion goes on from the state
    that there is, as in Python, and a step that fails has changed nothing.
    """
    FIXED["system"] = small

    def weighed(values: Mapping[str, float]) -> Case:
        case = family(values)
        heavy = values["m"] * case.system.mass
        return Case(replace(case.system, mass=heavy), STEP, 0.3, Newton(1e-14))

    rom = affine.fit(
        weighed,
        (
            Parameter("E", 0.5e9, 2e9, value=1e9, unit="Pa"),
            Parameter("g", 5.0, 12.0, value=9.81, unit="m/s^2"),
            Parameter("m", 0.5, 2.0, value=1.0),
        ),
    )
    model = c_files.write(rom, "tuned", "a family")
    assert model.tunable == ("E", "g")
    assert "[Pa] 5e+08 to 2e+09, 1e+09, tunable" in model.header
    run = CRun(model, tmp_path)
    live = control.live.start(rom({"E": 1e9, "g": 9.81, "m": 1.0}).system, STEP, Newton(1e-14))
    assert run.call("start") == 0
    for E, g in ((1e9, 9.81), (0.7e9, 9.81), (0.7e9, 6.0), (1.9e9, 11.0)):
        before = live.run.step.state
        live = control.live.start(rom({"E": E, "g": g, "m": 1.0}).system, STEP, Newton(1e-14))
        if E != 1e9:
            for one, other in zip(live.run.step.state, before, strict=True):
                one[...] = other
            live.feed.jump(live.run)
        run.set("parameter", 0, E)
        run.set("parameter", 1, g)
        live.step(count=50)
        for _ in range(50):
            assert run.step(STEP.step) == 0
        np.testing.assert_allclose(
            run.outputs, [live.outputs()[one.name] for one in model.columns], rtol=0, atol=1e-10
        )
    outputs = run.outputs
    run.set("parameter", 2, 1.5)
    assert b"a parameter is fixed" in run.message(run.step(STEP.step))
    run.set("parameter", 2, 1.0)
    run.set("parameter", 1, 12.5)
    assert b"outside of the range" in run.message(run.step(STEP.step))
    np.testing.assert_array_equal(run.outputs, outputs)


def test_a_parameter_that_no_number_in_c_follows_is_refused(small: System) -> None:
    """The step of a model is one: a family whose steps differ has no C."""

    def steps(values: Mapping[str, float]) -> Case:
        return Case(small, GeneralizedAlpha(values["h"]), 0.3)

    family_of_steps = affine.fit(steps, (Parameter("h", 5e-4, 2e-3, value=1e-3, unit="s"),))
    with pytest.raises(InputError, match=r"got scheme\.step; fix it with --set"):
        c_files.write(family_of_steps, "steps", "a family")


def test_velocities_that_joints_change_stay_beside_parameters(
    small: System, tmp_path: Path
) -> None:
    """What they leave of the given ones is that of the nominal model."""
    wrong = replace(small, v0=small.v0 + 1e-3)

    def weighed(values: Mapping[str, float]) -> Case:
        load = values["g"] / 9.81 * wrong.loads.constant
        return Case(replace(wrong, loads=replace(wrong.loads, constant=load)), STEP, 0.3)

    rom = affine.fit(weighed, (Parameter("g", 5.0, 12.0, value=9.81, unit="m/s^2"),))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        model = c_files.write(rom, "family", "a family")
        run = CRun(model, tmp_path)
        run.set("parameter", 0, 7.0)
        columns = dynamics.outputs(dynamics.integrate(rom({"g": 7.0}).system, STEP, 0.1))
    exact = np.stack([columns[one.name] for one in model.columns], axis=1)
    np.testing.assert_allclose(run.run(100, 1), exact, rtol=0, atol=1e-7)


def test_a_full_model_of_few_unknowns_moves_in_c_as_in_python(tmp_path: Path) -> None:
    """Its matrices become dense: Python itself repeats to 1e-9 with these."""
    assert compare(case_of(chain(), tolerance=1e-15), tmp_path) < 5e-9


def test_what_has_no_c_is_refused() -> None:
    with pytest.raises(InputError, match="a reduced model, got a full one"):
        c_files.write(case_of(models.spin_up(4)), "full", "a model")
    with pytest.raises(InputError, match="300 unknowns at most, got 360 unknowns"):
        c_files.write(case_of(chain(60)), "long", "a model")
    full = full_of(models.double_pendulum(4, all_multipliers=True), STEP, 0.1)
    made = reduced(full, reduction.body_level(full.raw), 1e-6).system
    python = replace(made, signals=(turning,), loads=replace(made.loads, forces=()))
    with pytest.raises(InputError, match="expressions of t and of inputs"):
        c_files.write(case_of(python), "python", "a model")


@pytest.mark.parametrize(
    "name", ['a "quoted" name', "*/ int x; /*", "</script>", "3 beams", "pendel-mit-ö", ""]
)
def test_names_end_no_comment_and_are_identifiers(name: str, small: System, tmp_path: Path) -> None:
    model = c_files.write(case_of(small), name, name, name)
    assert model.name.isidentifier()
    assert model.name.isascii()
    CRun(model, tmp_path).run(1)


def test_the_program_of_the_guide_runs(small: System, tmp_path: Path) -> None:
    text = (Path(__file__).resolve().parents[2] / "docs" / "c_code.md").read_text(encoding="utf-8")
    program = text.partition("```c\n")[2].partition("```")[0]
    model = c_files.write(case_of(small), "pendulum", "a pendulum")
    for name, content in (
        ("main.c", program),
        ("pendulum.c", model.source),
        ("pendulum.h", model.header),
    ):
        (tmp_path / name).write_text(content)
    subprocess.run(
        [str(COMPILER), *STRICT, "main.c", "pendulum.c", "-o", "main"], cwd=tmp_path, check=True
    )
    told = subprocess.run(
        [str(tmp_path / "main")], capture_output=True, text=True, check=True
    ).stdout
    exact = dynamics.outputs(dynamics.integrate(small, STEP, 0.1, Newton()))["C_x"][-1]
    assert float(told.split()[2]) == pytest.approx(exact, rel=1e-9)


def test_steps_that_fail_are_divided_as_in_python(small: System, tmp_path: Path) -> None:
    """Of 60 steps of 20 ms, forty times as long as its motion needs, some fail as a whole: the same
    trials, the same path.

    What a start that is moved by 1e-15 of itself changes has grown to 2e-13 m by then, and to 6e-6
    m after 100 steps.
    """
    case = case_of(small, GeneralizedAlpha(2e-2), tolerance=1e-13)
    model = c_files.write(case, "divided", "a model")
    run = CRun(model, tmp_path)
    got = run.run(60)
    motion = dynamics.integrate(small, case.scheme, 1.2, case.newton)
    columns = dynamics.outputs(motion)
    exact = np.stack([columns[one.name] for one in model.columns], axis=1)
    assert motion.statistics.halved > 5
    assert run.divided == motion.statistics.halved
    assert np.abs(got - exact).max() < 1e-9 * np.ptp(exact, axis=0).max()


def servo(position: bool) -> System:
    """A beam that an input turns at its root, or moves along y there, in few modes with all points."""
    root = At("beam", "left")
    angle, hinge = Input("angle", "rad", 0.0), joints.Pin("hinge", root)
    held: list[joints.Joint] = [hinge, joints.DrivenAngle("drive", root, angle)]
    if position:
        held = [joints.DrivenPosition("drive", root, (of_time("0*t"), replace(angle, unit="m")))]
    beam = body.cable("beam", segment(6), ROUND, MATERIAL, dim=2)
    outputs = {
        "tip": probes.Position(At("beam", "right")),
        "turn": probes.Angle(root),
        "rate": probes.AngularVelocity(root),
    }
    raw = assemble([beam], held, [loads.Gravity((0, -9.81))], outputs=outputs)
    full = full_of(signals.with_inputs(raw, {"angle": of_time("0.1*sin(20*t)")}), STEP, 0.4)
    return replace(reduced(full, reduction.body_level(full.raw), 1e-8).system, signals=raw.signals)


@pytest.mark.parametrize("position", [False, True])
def test_inputs_drive_joints_smoothly_as_in_python(position: bool, tmp_path: Path) -> None:
    """The cubic through the last four values; its derivatives are exact in C, in Python those of
    cubics of cos and sin of it.
    """
    system = servo(position)
    case = case_of(system, tolerance=1e-14)
    model = c_files.write(case, "servo", "a servo")
    run = CRun(model, tmp_path)
    live = control.live.start(system, case.scheme, case.newton)
    assert run.call("start") == 0
    got, exact = [], []
    for k in range(300):
        value = 0.1 * float(np.sin(0.02 * k) ** 3)
        live.step({"angle": value})
        run.set("input", 0, value)
        assert run.step(model.step) == 0
        got.append(run.outputs)
        exact.append([live.outputs()[one.name] for one in model.columns])
    errors = np.abs(np.array(got) - exact).max(axis=0) / np.ptp(exact, axis=0)
    assert errors[:3].max() < 1e-9
    assert errors[3] < 1e-7
    assert (
        run.message(run.call("derivative", 0, None))
        == b"an input that drives a joint has no derivatives"
    )
    # a program that gives the input at every fourth step: the same path, but for the cubics between
    # its values
    run.call("start")
    for k in range(3, 300, 4):
        run.set("input", 0, 0.1 * float(np.sin(0.02 * k) ** 3))
        assert run.step(4.0 * model.step) == 0
    assert 1e-9 < np.abs(run.outputs - exact[-1])[:2].max() / np.ptp(exact, axis=0)[:2].max() < 1e-2
    assert position or run.outputs[2] == pytest.approx(exact[-1][2], abs=1e-12)


def test_names_that_are_alike_in_c_stay_distinct(plant: System, tmp_path: Path) -> None:
    first, second = (
        replace(plant.outputs["tip"], columns=columns) for columns in (("a b", "a_b"), ("A.B", "c"))
    )
    model = c_files.write(
        case_of(replace(plant, outputs={"first": first, "second": second})), "alike", "a model"
    )
    words = [
        line.split()[1:3]
        for line in model.header.splitlines()
        if line.startswith("#define alike_OUTPUT_")
    ]
    assert words == [
        ["alike_OUTPUT_A_B", "0"],
        ["alike_OUTPUT_A_B_2", "1"],
        ["alike_OUTPUT_A_B_3", "2"],
        ["alike_OUTPUT_C", "3"],
    ]
    CRun(model, tmp_path).run(1)


@pytest.mark.parametrize(
    "name", ["set", "take", "stddef", "math", "stepping", "Math", "con", "LPT1"]
)
def test_names_that_collide_are_prefixed(name: str, small: System, tmp_path: Path) -> None:
    """Words of the file begin with them, or they are headers or devices: the file compiles and
    moves as with any name.
    """
    model = c_files.write(case_of(small), name, "a model")
    assert model.name == f"model_{name}"
    run = CRun(model, tmp_path, ("-std=c99", "-O0"))
    assert run.call("start") == 0


def test_texts_end_no_comment(plant: System, tmp_path: Path) -> None:
    """Names and units of files are texts of somebody else: none of them is code."""
    hostile = "m */ int evil(void) { return 1; } /*\n#error evil\x01"
    torque = Input("torque", hostile, 0.0)
    system = arm(loads.Moment("motor", At("beam", "left"), 1.0, history=torque))
    model = c_files.write(case_of(system), "bad", hostile, hostile)
    run = CRun(model, tmp_path)
    assert not hasattr(run.library, "evil")
    assert "\x01" not in model.header + model.source


MACHINE = """\
schema: 1
dimension: 2
bodies:
  pinion: {type: rigid, mass: 100 g, inertia: 1e-5 kg m^2, center: [-60 mm, 0], points: {mark: [-50 mm, 0]}}
  wheel: {type: rigid, mass: 1 kg, inertia: 2e-3 kg m^2, center: [0, 0], points: {mark: [50 mm, 0]}}
  slide: {type: rigid, mass: 1 kg, inertia: 2e-3 kg m^2, center: [1 m, 0]}
tables:
  path: {file: path.csv, unit: rad, hold: true}
joints:
  pinion: {type: revolute, at: pinion.frame}
  wheel: {type: revolute, at: wheel.frame}
  teeth: {type: gear, at: pinion.frame, to: wheel.frame, teeth: [12, 60]}
  slide: {type: revolute, at: slide.frame}
  drive: {type: driven_angle, at: slide.frame, angle: path(t)}
controllers:
  servo: {type: pid, unit: N m, sample: 1 ms, error: 1 - turn.angle, kp: 1 N m, limits: [-1 N m, 1 N m]}
  late: {type: measurement, unit: N m, sample: 1 ms, of: drive.torque}
loads:
  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}
  floor: {type: contact_plane, at: wheel.mark, point: [0, -1 m], normal: [0, 1], friction: 0.3}
  motor: {type: control_torque, at: wheel, torque: servo - late}
  spring: {type: spring_damper, at: wheel.mark, to: [1 m, 0], stiffness: 1 N/m}
events: {hit: {when: drive.torque - 1 N m, stop: true}}
outputs: {turn: {type: angle, at: wheel}, drive: {type: load, load: motor}}
analysis: {type: dynamic, duration: 10 ms, step: 1 ms}
reduction: {snapshots: 1 ms}
"""
IN_THE_WAY = {"controllers.late": 17, "events.hit": 23}


def machine(folder: Path, text: str) -> Path:
    """A scene with its table."""
    (folder / "path.csv").write_text("time [s], angle [rad]\n0,0\n1,1\n2,0\n")
    (path := folder / "machine.yaml").write_text(text)
    return path


def test_what_has_no_c_is_said_of_a_scene_before_a_training(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By `check --for`, with file, line and keys of all of it, and in the first line of a training;
    the rest is none of it.
    """
    path = machine(tmp_path, MACHINE)
    assert fmbs("check", path).code == 0
    for target in ("c", "page"):
        done = fmbs("check", path, "--for", target)
        assert done.code == 3
        places = [
            line.removeprefix("error: ").partition(": expected")[0]
            for line in done.err.splitlines()
        ]
        assert sorted(places) == sorted(
            f"{path}:{line}: {keys}" for keys, line in IN_THE_WAY.items()
        )
    monkeypatch.setattr(reducing, "train", lambda *_: pytest.fail("stopped"))
    with pytest.raises(pytest.fail.Exception, match="stopped"):
        fmbs("reduce", path)
    with warnings.catch_warnings(record=True):
        job, scene = Job(listener=Listener(tell=(told := []).append)), scenes.read(path)
        exportable.announce(job, scene, build.system(scene))
    words = "controller 'late' (line 17), event 'hit' (line 23)"
    assert told == [f"this model cannot be exported to C, as an FMU or into a page: {words}"]


def test_what_has_c_is_refused_by_no_check(tmp_path: Path) -> None:
    """The same scene without what is in the way: a table of straight lines drives, a controller acts."""
    lines = MACHINE.replace(" - late", "").splitlines()
    kept = [line for k, line in enumerate(lines, 1) if k not in IN_THE_WAY.values()]
    assert fmbs("check", machine(tmp_path, "\n".join(kept)), "--for", "c").code == 0


def test_a_family_from_equilibria_is_said_to_have_no_c() -> None:
    """A start that parameters change, which one model of it is free to have."""
    system, scheme = models.double_pendulum(4), GeneralizedAlpha(1e-3, start="equilibrium")
    assert not [*refusals.find(system, scheme)]
    (found,) = refusals.find(system, scheme, ranged=True)
    assert found.problem.at("x") == say(
        "x", "a start that no parameter changes", "`start: equilibrium`", found.problem.remedy
    )


def test_a_scene_with_events_leaves_the_house() -> None:
    """The trapeze, whose hands let go and catch."""
    path = Path(__file__).parents[2] / "examples" / "trapeze.yaml"
    assert fmbs("check", path, "--for", "c").code == 0
