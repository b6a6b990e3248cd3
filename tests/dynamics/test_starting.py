"""Starts of motions in compiled code against matrices of SciPy, and the same printed as C."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from fmbs_skfem import dynamics
from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.algebra import small
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.compiling import jit, programs
from fmbs_skfem.core.compiling.structs import Routine, address_of, packed
from fmbs_skfem.core.printing.memory import PackedMemory
from fmbs_skfem.core.printing.printer import KernelPrinter
from fmbs_skfem.core.printing.program import PrintedProgram, region
from fmbs_skfem.core.printing.values import Const
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, initial, integration
from fmbs_skfem.dynamics.compiled_step import starting, stepping
from fmbs_skfem.dynamics.compiled_step.packing import UNSTORED, PackedStep
from fmbs_skfem.dynamics.compiled_step.step import State, Step
from fmbs_skfem.dynamics.histories import BEND, JERK, leading_signals, signals_at_start
from fmbs_skfem.dynamics.observers import RunSetting
from fmbs_skfem.dynamics.outputs import survey_of
from fmbs_skfem.dynamics.run import OpenRun
from fmbs_skfem.dynamics.scheme import method_of
from fmbs_skfem.exports.text import maths
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import (
    At,
    Motion,
    Rayleigh,
    System,
    assemble,
    compile_system,
    row_programs,
    work,
)
from fmbs_skfem.systems import compiled as compilation
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.evaluation import NOW
from fmbs_skfem.systems.forces import loads, springs
from fmbs_skfem.systems.forces.along_lines import SlidingFriction
from tests import models
from tests.exports import printed
from tests.exports.c_library import COMPILER, STRICT, compiled
from tests.systems.test_corotation import complete
from tests.systems.test_sliding import incline

STEP, STEPS = GeneralizedAlpha(1e-3), 20
ROOT, TIP = At("beam", "left"), At("beam", "right")
DOWN, DOWN_IN_SPACE = loads.Gravity((0.0, -9.81)), loads.Gravity((0.0, 0.0, -9.81))
SPIN = Motion(angular_velocity=(0.0, 0.0, 3.0))
pytestmark = pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")


def cable(dim: int = 2, cells: int = 2) -> body.Body:
    return body.cable("beam", segment(cells), models.SECTION, models.MATERIAL, dim=dim)


def arm(*push: loads.Load, **more: Any) -> System:
    """A beam on a hinge under loads."""
    return complete(assemble([cable()], [joints.Pin("hinge", ROOT)], [DOWN, *push], **more))


def turning(damping: Rayleigh | None = None) -> System:
    """A beam in space that turns on a revolute joint, with a rigid rod hung to it that turns in
    another plane.
    """
    rod = rigid("rod", 0.3, (0.01, 0.02, 0.02), (1.2, 0.0, 0.0), places={"end": (1.0, 0.0, 0.0)})
    held = [
        joints.Revolute("hinge", ROOT, axis=(0.0, 0.0, 1.0)),
        joints.Revolute("knee", At("rod", "end"), TIP, axis=(0.0, 1.0, 0.0)),
    ]
    spin = {"beam": SPIN, "rod": Motion((0.0, 3.0, 0.0), (0.0, 2.0, 3.0), (1.0, 0.0, 0.0))}
    return complete(assemble([cable(3), rod], held, [DOWN_IN_SPACE], damping, initial=spin))


def driven() -> System:
    """A beam whose angle at the root follows a history that begins with a rate and curved."""
    angle = of_time("0.3*t + 2*t**2 - t**3")
    held = [joints.Pin("hinge", ROOT), joints.DrivenAngle("drive", ROOT, angle)]
    return complete(assemble([cable()], held, [DOWN], initial={"beam": Motion(None, 0.3)}))


def twisted() -> System:
    """A beam with directors, the first of which have no mass."""
    section = sections.BeamSection(
        np.diag([2e4, 1e4, 1e4, 2.0, 3.0, 4.0]), np.diag([0.2, 1e-5, 1e-5])
    )
    part = beam("beam", segment(3), section, direction=(0.0, 0.0, 1.0))
    turn = loads.Moment("turn", TIP, (0.003, 0.002, 0.001))
    return complete(
        assemble([part], [joints.Clamp("wall", ROOT)], [turn], Rayleigh(stiffness=1e-4))
    )


def compressed() -> System:
    """A beam at half of its length, of which nothing holds what begins to move."""
    whole = arm()
    x = 0.5 * whole.lift(whole.x0)
    matrix = np.asarray(whole.lift.matrix)
    return initial.replace(whole, x0=np.linalg.lstsq(matrix, x - whole.lift.offset, rcond=None)[0])


def on_a_rope(**more: float) -> System:
    """A beam that hangs on a rope that is taut."""
    rope = springs.Rope("rope", TIP, (0.8, 0.4), length=0.3, stiffness=200.0, damping=1.0, **more)
    return arm(rope, initial={"beam": Motion(None, -0.2)})


CASES: dict[str, Callable[[], System]] = {
    "a force": lambda: arm(loads.PointForce("push", TIP, (0.3, 0.2), of_time("1 + sin(9*t)"))),
    "a spring and a damper": lambda: arm(
        springs.SpringDamper("spring", TIP, (0.5, 0.8), stiffness=40.0, damping=0.2),
        initial={"beam": Motion(None, 2.0)},
    ),
    "joints that turn in space": turning,
    "damped": lambda: turning(Rayleigh(stiffness=1e-4, mass=0.1)),
    "damped in the plane": lambda: arm(
        damping=Rayleigh(stiffness=1e-4), initial={"beam": Motion(None, 2.0)}
    ),
    "a driven angle": driven,
    "directors": twisted,
    "a free body": lambda: complete(
        assemble([cable(3)], [], [DOWN_IN_SPACE], initial={"beam": SPIN})
    ),
    "compressed": compressed,
    "a rope": on_a_rope,
    "a rope that ends no step": lambda: on_a_rope(resolution=0.0),
    "friction in a joint": lambda: incline(more=[SlidingFriction("rub", "slide", 0.3)], start=1.0),
    "points": lambda: models.double_pendulum(2, all_multipliers=True),
}

#: what moves joints as functions of time or of a place on a line errs most by differences
BY_DIFFERENCES, DIFFERENCES = ("a driven angle", "friction in a joint"), 2e-8


class Begun(NamedTuple):
    """A step in a state with x, v and what forces keep alone."""

    step: Step
    packed: PackedStep
    v: np.ndarray  #: that joints admit, in the order of the system


def begun(system: System, scheme: GeneralizedAlpha = STEP) -> Begun:
    """A step before its start, with numbers of no meaning in what follows."""
    system = initial.startable(system, scheme)
    model = compile_system(system)
    assert model.arrays.dense
    _, v = initial.admissible(system, scheme)
    step = initial.first_step(model, system.x0, v, method_of(scheme, Newton(), scheme.step, model))
    for part in step.state:
        part[...] = 7
    s = step.state
    s.x[:], s.v[:], s.memory[:] = system.x0[model.order], v[model.order], model.memory
    packed = PackedStep(model, step, None)
    packed.give(signals_at_start(system, 0.0, scheme.step), UNSTORED)
    return Begun(step, packed, v)


def found_by_matrices(begin: Begun) -> dict[str, np.ndarray]:
    """The start by the equations of `starting` in matrices, derivatives of the joints by
    differences.
    """
    step, packed, v = begin
    model, method = packed.model, step.method
    system = model.system
    x, d, n = system.x0, 0.25 * method.h, system.size
    _, J = compilation.gap(model, x)
    f = compilation.forces(model, x, v)
    k = np.arange(5.0)[:, None]

    def along(*rates: np.ndarray) -> np.ndarray:
        path = x + sum((k * d) ** (i + 1) * rate / (i + 1) for i, rate in enumerate(rates))
        return compilation.constraints_at(model, path, k.ravel() * d)[0]

    def solve(M: Any, f: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        A = np.block([[as_dense(M), J.T], [J, np.zeros((len(J), len(J)))]])
        z = np.linalg.solve(A, np.concatenate([f, g]))
        return z[:n], z[n:]

    def begun_by(M: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        g = -BEND @ along(v) / (12 * d * d)
        a, held = solve(M, -f, g)
        for _ in range(20 if any(force.reacts for force in model.forces) else 0):
            pushed = compilation.evaluate(model, x, v, 0.0, None, held)[0] - J.T @ held
            a, held = solve(M, -pushed, g)
        change = solve(M, 0.0 * f, -JERK @ along(v, a) / (2 * d**3))[0]
        return a, held, change

    more = initial.flags_of(model)
    M = system.mass
    state = model, x, np.zeros(len(J)), 0.0, method.gh, None, v
    if starting.has(more, starting.FILTERED):
        K = compilation.tangent(*state)
        found = begun_by(M + K / method.bh)
        held = starting.has(more, starting.MASSLESS) or found[0] @ (K @ found[0]) >= 0.0
    elif starting.has(more, starting.TOUCHES):
        found, held = begun_by(M + compilation.probe_tangent(*state) / method.bh), True
    else:
        found, held = begun_by(M), False
    balance = found
    if not starting.has(more, starting.MASSLESS):
        touches = starting.has(more, starting.TOUCHES) and not held
        near = compilation.probe_tangent(*state) / method.bh if touches else 0.0 * M
        balance = begun_by(M + near)
        found = found if held else balance
    elif starting.has(more, starting.SOFTENED):
        balance = begun_by(M + 1e-8 * K / method.bh)
        light = M.diagonal() <= 1e-12 * M.diagonal().max()
        balance[0][light] = found[0][light]
    h, late, order = method.h, method.am - method.af, model.order
    memory = compilation.accepted(model, x, v)
    placed, table = compilation.place(model, x, v, 0.0, memory, found[1])
    work.forces(table)
    return {
        "acceleration": balance[0][order],
        "multipliers": method.c * balance[1],
        "v": (v + h * h * (1 / 6 - method.beta - 0.5 * late) * found[2])[order],
        "a": (found[0] + late * h * found[2])[order],
        "history": np.vstack([found[0][order], np.zeros((2, n))]),
        "past": np.vstack([method.c * found[1], np.zeros((2, len(J)))]),
        "memory": memory,
        "push": placed.space.f.copy(),
        "gradients": placed.space.gradients[NOW].copy(),
        "speed": np.array([compilation.size(model, v)]),
    }


@pytest.mark.parametrize("name", CASES)
def test_a_start_is_that_of_matrices(name: str) -> None:
    begin = begun(CASES[name]())
    step = begin.step
    exact = found_by_matrices(begin)
    kind = step.work.kind[1]
    assert begin.packed.call(starting.start, initial.flags_of(begin.packed.model)) == 0
    assert step.work.kind.tolist() == [0, kind, 0, 0]
    for field, wanted in exact.items():
        size = float(np.abs(wanted).max(initial=0.0))
        off = DIFFERENCES if name in BY_DIFFERENCES else 1e-9
        got = getattr(step.state, field)
        np.testing.assert_allclose(got, wanted, rtol=0, atol=off * size + 1e-24, err_msg=field)


def moving(system: System, scheme: GeneralizedAlpha = STEP, tolerance: float = 1e-14) -> OpenRun:
    """A run whose next step is the first one."""
    newton = Newton(tolerance=tolerance)
    setting = RunSetting(system, scheme, newton, STEPS, system)
    run = integration.begun(setting, np.arange(STEPS + 1))
    initial.begin_steps(run.step.state)
    return run


def signals_of(run: OpenRun, first: int, many: int) -> np.ndarray:
    """Rows of signals at the ends of steps."""
    times = run.scheme.step * np.arange(first, first + many)
    return np.ascontiguousarray(leading_signals(run.model.system, times, run.scheme.step)[0])


def stepped(run: OpenRun, routine: Routine, more: int = 0, steps: int = STEPS) -> list[int]:
    """Take some steps by a routine; its statuses."""
    found = []
    for k in range(steps):
        run.packed.give(signals_of(run, 1 + k, 1), np.array([-1]))
        found.append(run.packed.call(routine, more))
    return found


@pytest.mark.parametrize("name", ["a force", "a spring and a damper", "a driven angle", "damped"])
def test_a_fixed_number_of_corrections_goes_the_same_way(name: str) -> None:
    """With the factors of the guess velocities settle on the joints but for a hundredth."""
    system = CASES[name]()
    one, other = moving(system), moving(system)
    assert not any(stepped(one, stepping.take_fixed, 6))
    assert not any(stepped(other, stepping.take))
    for part in ("x", "v", "acceleration", "multipliers", "work", "memory"):
        got, wanted = (getattr(run.step.state, part) for run in (one, other))
        size = float(np.abs(wanted).max(initial=0.0))
        np.testing.assert_allclose(got, wanted, rtol=0, atol=3e-6 * size, err_msg=part)
    assert one.step.job.counters.tolist() == [STEPS, 6 * STEPS, STEPS, 0]
    assert one.step.job.left[0] < 1e-10
    assert one.step.job.left[1] == 6


def test_too_few_corrections_are_a_status_with_how_many_would_do() -> None:
    push = loads.Moment("push", TIP, 0.3)
    run, other = (moving(arm(push), GeneralizedAlpha(5e-3), 1e-9) for _ in range(2))
    before = run.step.state.x.copy()
    assert stepped(run, stepping.take_fixed, 3, 1) == [stepping.TOO_FEW]
    np.testing.assert_array_equal(run.step.state.x, before)
    enough = int(run.step.job.left[1])
    assert 3 < enough < 40
    assert stepped(other, stepping.take_fixed, enough, 1) == [stepping.DONE]


@pytest.mark.parametrize("name", ["a spring and a damper", "damped", "a rope that ends no step"])
def test_energies_are_those_of_outputs_and_disturb_no_step(name: str) -> None:
    system = CASES[name]()
    run, other = moving(system), moving(system)
    other.packed.give(signals_of(run, 0, 1), np.array([-1]))
    motion = dynamics.integrate(system, STEP, STEPS * STEP.step, Newton(tolerance=1e-14))
    exact, _ = survey_of(motion)
    for k in range(STEPS):
        for one in (run, other):
            one.packed.give(signals_of(run, 1 + k, 1), np.array([-1]))
            assert one.packed.call(stepping.take) == stepping.DONE
        for which in (starting.KINETIC, starting.STRAIN):
            run.packed.call(starting.energies, which)
            size = np.abs(exact[:, which]).max()
            assert run.step.space.energy[0] == pytest.approx(exact[k + 1, which], abs=1e-9 * size)
    for got, wanted in zip(run.step.state, other.step.state, strict=True):
        np.testing.assert_array_equal(got, wanted)


def test_work_that_nobody_wants_changes_no_step() -> None:
    system = CASES["damped"]()
    run, other = moving(system), moving(system)
    job = other.step.job._replace(work=np.zeros(0), signals=signals_of(run, 1, STEPS))
    step = other.step._replace(job=job)
    table = packed(step)
    assert not any(stepped(run, stepping.take))
    assert not any(stepping.take(table, k) for k in range(STEPS))
    assert step.state.work.tolist() == [0.0, 0.0]
    for name in ("x", "v", "acceleration", "multipliers", "gradients"):
        got, wanted = (getattr(one.state, name) for one in (step, run.step))
        np.testing.assert_array_equal(got, wanted, err_msg=name)


def test_turned_tangents_are_found_in_a_step() -> None:
    planar, spatial = begun(CASES["damped in the plane"]()), begun(CASES["damped"]())
    step = planar.step
    wanted = step.arrays.corotation.numbers.copy()
    step.arrays.corotation.numbers[:] = 0.0
    step.work.kind[1] = 0
    assert planar.packed.call(starting.turned_tangents) == 1
    assert step.work.kind[1] == 1
    assert np.abs(wanted).max() > 0.0
    np.testing.assert_array_equal(step.arrays.corotation.numbers, wanted)
    assert spatial.packed.call(starting.turned_tangents) == 0


OWN = """
void begin(NAME_memory *m) {
STARTS
}
unsigned long size(void) { return sizeof(NAME_memory); }
double *signals(NAME_memory *m) { return SIGNALS; }
"""
SHOWN = "x", "v", "a", "acceleration", "multipliers", "history", "past", "memory"


class InC:
    """Routines of a packed step, each with its integer, printed and compiled; those of another
    struct `beside` it have its address.
    """

    def __init__(
        self,
        address: int,
        calls: Mapping[str, tuple[Routine, int]],
        folder: Path,
        beside: tuple[type, int] | None = None,
    ) -> None:
        mutable = {"job_signals"}
        while True:
            memory = PackedMemory(mutable)
            memory.add(Step, address)
            if beside:
                memory.add(*beside, "beside")
            spelled = (programs.run, row_programs.act)
            printer = KernelPrinter(memory, jit.BEHIND, small.STANDS, small.PRODUCTS, spelled)
            names = {
                name: printer.entry(
                    one,
                    [
                        memory.pointer(address),
                        memory.pointer(told) if beside and told == beside[1] else Const(told),
                    ],
                )
                for name, (one, told) in calls.items()
            }
            printer.finish()
            wrong = {one.name for one in memory.regions if one.folded and one.written}
            if not wrong:
                break
            mutable |= wrong
        own = OWN.replace("SIGNALS", region("job_signals"))
        for one in memory.regions:
            shown = one.name.startswith(("state_", "beside_", "space_energy", "space_off"))
            if shown and one.item == "double" and memory.is_field(one):
                own += f"double *{one.name}(NAME_memory *m) {{ return {region(one.name)}; }}\n"
        program = PrintedProgram(printer, own)
        constants, starts = program.starts()
        tail = program.own.replace("STARTS", starts)
        for name, one in names.items():
            result = one.result.value if one.silent else f"{one.name}(m)"
            tail += f"long long {name}(NAME_memory *m) {{ return {result}; }}\n"
        parts = [printed.HEAD, program.constants, constants, "typedef struct {", program.declared]
        parts += ["} NAME_memory;", program.structs, maths(program.code), program.code, tail]
        self.text = "\n".join(parts).replace("NAME", "model")
        self.library = compiled(folder, [self.text], "printed", STRICT)
        self.memory = ctypes.create_string_buffer(self.library.size())
        self.library.begin(self.memory)

    def array(self, name: str, count: int) -> np.ndarray:
        """Numbers of the memory."""
        call = getattr(self.library, name)
        call.restype = ctypes.POINTER(ctypes.c_double)
        found: np.ndarray = np.ctypeslib.as_array(call(self.memory), (count,))
        return found

    def begin_steps(self, state: State) -> None:
        """As `initial.begin_steps`."""
        for name in ("acceleration", "multipliers"):
            numbers = getattr(state, name)
            if numbers.size:
                self.array(f"state_{name}", numbers.size)[:] = numbers

    def call(self, name: str) -> int:
        return int(getattr(self.library, name)(self.memory))


#: and for how many steps both go the same way: five corrections leave more of beams with directors
PRINTED = {
    "damped in the plane": 4,
    "joints that turn in space": 4,
    "a driven angle": 4,
    "directors": 1,
}
QUICK = "a driven angle"


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=() if one == QUICK else pytest.mark.slow) for one in PRINTED],
)
def test_what_is_printed_starts_and_goes_the_same_way(name: str, tmp_path: Path) -> None:
    begin = begun(CASES[name]())
    more = initial.flags_of(begin.packed.model)
    signals = begin.packed.given[0]
    job = begin.step.job._replace(work=np.zeros(0), signals=signals)
    step = begin.step._replace(job=job)
    table = packed(step)
    turns = bool(step.work.kind[1])
    step.arrays.corotation.numbers[:] = 0.0
    calls = {
        "turn": (starting.turned_tangents, 0),
        "start": (starting.start, more),
        "kinetic": (starting.energies, starting.KINETIC),
        "strain": (starting.energies, starting.STRAIN),
        "take": (stepping.take_fixed, 5),
    }
    other = InC(address_of(table), calls, tmp_path)
    assert starting.turned_tangents(table) == other.call("turn") == turns
    assert starting.start(table, more) == other.call("start") == 0
    for k in range(PRINTED[name]):
        for field in SHOWN:
            wanted = getattr(step.state, field).ravel()
            if wanted.size:
                off = 1e-10 * np.abs(wanted).max()
                got = other.array(f"state_{field}", wanted.size)
                np.testing.assert_allclose(got, wanted, rtol=0, atol=off, err_msg=f"{field} {k}")
        for which, called in ((starting.KINETIC, "kinetic"), (starting.STRAIN, "strain")):
            starting.energies(table, which)
            other.call(called)
            energy = step.space.energy[0]
            assert other.array("space_energy", 1)[0] == pytest.approx(energy, rel=1e-9, abs=1e-12)
        initial.begin_steps(step.state)
        if k == 0:
            other.begin_steps(step.state)
        assert stepping.take_fixed(table, 5) == other.call("take") == stepping.DONE
