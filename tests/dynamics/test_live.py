"""Runs that are taken step by step: the bits of `integrate`, states that are put back, inputs in
scenes and files.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.core.errors import CorruptFile, InputError, Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values import expressions
from fmbs_skfem.core.values.inputs import GivenInput, Input
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs, start
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.controls import ControlForce
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.signals import inputs_of, with_inputs
from fmbs_skfem.systems.system import change_coordinates

from ..systems.parts import A0, A1, B1, beams
from .test_large import hanging

PLANT = Path(__file__).parents[2] / "examples" / "plant.yaml"
H, COUNT = 1e-3, 120
U, W = Input("u", "N", 0.5), Input("w", "rad", 0.0)


def fed(dim: int = 2) -> System:
    """Beams with an input in an expression of the state, beside functions of time."""
    push = ControlForce(
        "f", A1, (0.0, 1.0, 0.0)[:dim], of_state("u - k*stretch + sin(9 * t)", "", {"k": 3.0})
    )
    return assemble(
        beams(dim),
        [joints.Clamp("clamp", A0)],
        [push],
        outputs={"tip": probes.Position(A1)},
        inputs=[U],
    )


def driven() -> System:
    """A hinge driven by an input and a function of time, and a force that both scale."""
    turn = expressions.of_time("w + 0.1 * t**3", inputs={"w": W})
    force = loads.PointForce(
        "p", B1, (0.0, 1.0), expressions.of_time("u * cos(t)", inputs={"u": U})
    )
    parts = [joints.Pin("pin", A0), joints.DrivenAngle("drive", A0, turn)]
    return assemble(beams(2), parts, [force], outputs={"root": probes.Angle(A0)}, inputs=[U, W])


def values(count: int = COUNT) -> dict[str, np.ndarray]:
    """What starts a run reads of the first step: an input that drives a joint stands still in it."""
    t = H * np.arange(count + 1)
    return {"u": np.append(0.5, np.sin(30 * t[1:])), "w": 0.2 * np.maximum(t - H, 0.0) ** 2}


MODELS = {
    "full": lambda: eliminate(fed()),
    "space": lambda: eliminate(fed(3)),
    "reduced": lambda: change_coordinates(
        one := eliminate(fed()), np.eye(one.size), np.zeros(one.size)
    ),
    "driven": lambda: eliminate(driven()),
}


@pytest.mark.parametrize("name", MODELS)
def test_the_bits_of_integrate(name: str) -> None:
    """With the same histories; and a state that is put back gives the same bits again."""
    system, scheme = MODELS[name](), GeneralizedAlpha(H)
    told, known = values(), inputs_of(system)
    smooth = {"w"}
    histories = {key: GivenInput(H, told[key].tolist(), smooth=key in smooth) for key in known}
    expected = integrate(with_inputs(system, histories), scheme, COUNT * H)
    run = start(system, scheme)
    for k in range(1, COUNT + 1):
        run.step({key: told[key][k] for key in known})
        if k == COUNT - 30:
            held = run.state
    np.testing.assert_array_equal(run.motion().x[0], expected.x[-1])
    np.testing.assert_array_equal(run.motion().a[0], expected.a[-1])
    column, found = next(iter(outputs(expected).items()))
    assert run.outputs()[column] == pytest.approx(found[-1], abs=1e-13)
    for other in (run, start(system, scheme)):
        other.state = held
        assert other.time == pytest.approx((COUNT - 30) * H)
        for k in range(COUNT - 29, COUNT + 1):
            other.step({key: told[key][k] for key in known})
        np.testing.assert_array_equal(other.motion().x[0], expected.x[-1])


def test_large_models(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)
    system, scheme = hanging(4), GeneralizedAlpha(H)
    expected = integrate(system, scheme, 24 * H)
    assert expected.statistics.solver.startswith("sparse")
    run = start(system, scheme)
    for _ in range(24):
        run.step()
    np.testing.assert_array_equal(run.motion().x[0], expected.x[-1])


def test_angles_count_their_turns() -> None:
    run = start(eliminate(driven()), GeneralizedAlpha(H))
    for k in range(1, 301):
        run.step({"w": 40.0 * (k * H) ** 2 * 3.0})
        run.outputs()
    assert run.outputs()["root"] == pytest.approx(120.0 * 0.3**2 + 0.1 * 0.3**3, abs=1e-9)


SCENE = """
schema: 1
dimension: 2
parameters: {k: 18 N/m}
inputs: {u: {unit: kN, start: 10 N}, w: {start: 1}}
bodies: {ball: {type: point_mass, mass: 2 kg, position: [0, 0]}}
loads:
  f: {type: control_force, at: ball, direction: [1, 0], force: "u - k * tip.x"}
  p: {type: point_force, at: ball, force: [0 N, 3 N], history: "w * 2"}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
outputs: {tip: {type: position, at: ball}}
"""


def test_scenes_and_files(tmp_path: Path) -> None:
    """A scene holds its inputs at their start; saved models have them."""
    system = build.system(reading.loads(SCENE))
    assert inputs_of(system) == {"u": Input("u", "N", 10.0), "w": Input("w", "", 1.0)}
    scheme = GeneralizedAlpha(1e-3)
    motion = integrate(system, scheme, 1.0)
    np.testing.assert_allclose(
        outputs(motion)["tip_x"], 10 / 18 * (1 - np.cos(3 * motion.times)), atol=1e-5
    )
    np.testing.assert_allclose(outputs(motion)["tip_y"], 1.5 * motion.times**2, atol=1e-6)
    one, other = (
        start(system, scheme),
        start(files.load(files.save(eliminate(system), tmp_path / "model.h5")), scheme),
    )
    for run in (one, other):
        for k in range(50):
            run.step({"u": 0.1 * k, "w": -1.0})
    assert one.outputs() == other.outputs()
    assert one.outputs()["tip_y"] < 0


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("u - k", "v - k", r"force: expected one of .* got 'v'"),
        ("unit: kN", "unit: kg", r"inputs.u.start: expected a mass .* got '10 N'"),
        (
            "unit: kN, start: 10 N",
            "unit: m",
            r"loads.f.force: expected all parts of '-' of one dimension, got length and force",
        ),
        ("w * 2", "u * 2", r"loads.p.history: expected a number as a function of t, got .*force"),
        ("w: {", "k: {", r"inputs.k: expected a name"),
        ("w: {", "tip: {}, w: {", r"inputs.tip: expected another name"),
        ("{start: 1}", "{begin: 1}", r"inputs.w.begin: expected one of the keys"),
    ],
)
def test_what_does_not_fit_is_named(old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        reading.loads(SCENE.replace(old, new))


def test_errors() -> None:
    run = start(eliminate(fed()), GeneralizedAlpha(H))
    with pytest.raises(InputError, match=r"run.step: expected one of the inputs u, got 'v'"):
        run.step({"v": 1.0})
    with pytest.raises(InputError, match=r"input 'u': expected a finite number, got 'nan'|got nan"):
        run.step({"u": np.nan})
    with pytest.raises(CorruptFile, match="unknowns: "):
        run.state = start(eliminate(fed(3)), GeneralizedAlpha(H)).state


def test_outputs_that_read_inputs_are_those_of_the_present_however_seldom_they_are_read() -> None:
    """Forces of inputs that change, after every 20 steps, and energies over states that were put
    back.
    """
    text = (
        SCENE.replace("0 N, 3 N", "1 N, 0 N")
        .replace("18 N/m", "0 N/m")
        .replace("{tip:", "{f: {type: load, load: f}, E: {type: energy}, tip:")
    )
    run = start(build.system(reading.loads(text)), GeneralizedAlpha(H))
    for k in range(1, 41):
        run.step({"u": float(k), "w": 0.0})
        if k % 20 == 0:
            found = run.outputs()
            assert found["f_force"] == k
            held = run.state
            assert abs(found["E_balance"]) < 1e-5 * found["E_kinetic"]
    run.step({"u": -100.0})
    run.state = held
    assert run.outputs() == found


def test_states_that_are_put_back_keep_their_turns() -> None:
    run = start(eliminate(driven()), GeneralizedAlpha(H))
    for k in range(1, 301):
        run.step({"w": 40.0 * (k * H) ** 2 * 3.0})
        found = run.outputs()
    held, other = run.state, start(eliminate(driven()), GeneralizedAlpha(H))
    other.state = held
    assert other.outputs()["root"] == found["root"] > 2 * np.pi


ARM = """
schema: 1
dimension: 2
inputs: {u: {unit: N m}}
bodies:
  arm: {type: rigid, mass: 1 kg, inertia: 0.1 kg m^2, center: [0, 0], points: {end: [1, 0]}}
  wheel: {type: rigid, mass: 100 g, inertia: 1e-3 kg m^2, center: [1, 0]}
  load: {type: point_mass, mass: 2 kg, position: [2, 0]}
joints:
  hinge: {type: revolute, at: arm.center}
  axle: {type: revolute, at: wheel.center, to: arm.end}
loads:
  drive: {type: control_torque, at: arm.center, torque: u}
  spring: {type: spring_damper, at: load, to: arm.end, stiffness: 30 N/m, damping: 1 N s/m}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
outputs:
  turn: {type: angle, at: arm.center}
  against: {type: angle, at: wheel.center, to: arm.center}
  spin: {type: angular_velocity, at: arm.center}
  place: {type: position, at: load}
  height: {type: position, at: arm.end, component: y}
  speed: {type: velocity, at: load}
  pull: {type: acceleration, at: load}
  apart: {type: distance, at: load, to: arm.end}
  E: {type: energy}
"""


def arm() -> System:
    return eliminate(build.system(reading.loads(ARM)))


def test_outputs_by_name_are_those_of_all_outputs() -> None:
    """Each by formulas of its rows, or where it has none as all of them are found: turns and
    energies count alike.
    """
    run, names = (
        start(arm(), GeneralizedAlpha(H)),
        ["turn", "against", "spin", "place", "height", "speed"],
    )
    for k in range(400):
        run.step({"u": 40.0})
        some, more = run.outputs(names), run.outputs(["E", "pull", "apart"])
        expected = run.outputs()
        assert list(some) == [
            "turn",
            "against",
            "against_rate",
            "spin",
            "place_x",
            "place_y",
            "height",
            "speed_x",
            "speed_y",
        ]
        for column, value in (some | more).items():
            assert value == pytest.approx(expected[column], rel=1e-12, abs=1e-12), (k, column)
        assert run.outputs("height") == {"height": some["height"]}
    assert some["turn"] > 2 * np.pi  # beyond a turn
    assert len(some | more) == len(expected)


def test_outputs_by_name_after_a_state_was_put_back() -> None:
    run = start(arm(), GeneralizedAlpha(H))
    for _ in range(400):
        run.step({"u": 40.0})
        found, energies = run.outputs(["turn", "place"]), run.outputs(["E"])
    held, other = run.state, start(arm(), GeneralizedAlpha(H))
    for _ in range(20):
        run.step({"u": -40.0})
        run.outputs(["turn", "place"])
    for one in (run, other):
        one.state = held
        assert one.outputs(["turn", "place"]) == found
        assert one.outputs(["E"]) == pytest.approx(energies, rel=1e-12)


def test_outputs_of_no_name() -> None:
    with pytest.raises(
        InputError,
        match=r"run.outputs: expected one of the outputs .*, got 'turns'; did you mean 'turn'",
    ):
        start(arm(), GeneralizedAlpha(H)).outputs(["turns"])


def test_a_class_of_its_own_that_evaluates_otherwise_has_no_formula() -> None:
    """Accelerations are points whose rows are evaluated in another way: a formula that they inherit
    is not theirs.
    """
    outputs = arm().outputs
    assert probes.formula_of(outputs["pull"], 2) is None
    assert probes.formula_of(outputs["apart"], 2) is None
    y = probes.formula_of(outputs["speed"], 2)
    assert y is not None
    assert list(y([1.0, 2.0], [3.0, 4.0], [5.0, 6.0])) == [3.0, 4.0]


def closed(gain: float, steps: int, most: float = np.inf) -> None:
    """An arm held by a torque that is a multiple of its angle and rate."""
    run = start(arm(), GeneralizedAlpha(H))
    run.step({"u": 1e-6})
    for _ in range(steps):
        now = run.outputs(["turn", "spin"])
        run.step({"u": float(np.clip(gain * (now["turn"] + 0.05 * now["spin"]), -most, most))})


def test_an_unstable_loop_is_told_once() -> None:
    with pytest.warns(
        Notice,
        match=r"'u' rose from .* N m in \d+ steps, ever faster: the loop that sets it is unstable",
    ) as told:
        closed(30.0, 900)
    assert len([one for one in told if "ever faster" in str(one.message)]) == 1


def test_a_step_that_fails_names_the_unstable_loop() -> None:
    """A derivative at a light end, held for a step: it turns from step to step, eight times as
    large.
    """
    scene = reading.loads(PLANT.read_text(), PLANT.parent)
    run = start(build.chosen_form(scene, build.system(scene)), GeneralizedAlpha(H))

    def go_on() -> None:
        for _ in range(30):
            now = run.outputs(["hinge", "spin"])
            run.step({"u": 20.0 * (0.02 - now["hinge"]) - 3.0 * now["spin"]})

    with pytest.raises(
        SolverError, match=r"'u' rose from .* ever faster: the loop that sets it is unstable"
    ) as told:
        go_on()
    assert told.value.reason is Reason.GROWING


def test_stable_loops_and_signals_that_rise_are_not() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        closed(-30.0, 900)
        closed(30.0, 300, most=1e-9)
        for signal in (
            lambda t: 9.0 * t**4,
            lambda t: np.sin(40.0 * t**2),
            lambda t: 5.0 * (t > 0.3),
            lambda t: t * np.sin(90.0 * t),
        ):
            run = start(arm(), GeneralizedAlpha(H))
            for k in range(1, 700):
                run.step({"u": float(signal(k * H))})


def driven_by_a_sine(
    step: float, accuracy: float | None = None, wanted: float = 0.5
) -> tuple[np.ndarray, list[str]]:
    """The height of the load of the arm at multiples of 2 ms, under a torque that changes, and what
    the run says.
    """
    said = list[str]()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", Notice)
        run, heights = start(arm(), GeneralizedAlpha(step), accuracy=accuracy), [0.0]
        for k in range(round(wanted / step)):
            run.step({"u": 40.0 * np.sin(15.0 * (k + 0.5) * step)})
            if (k + 1) % round(2e-3 / step) == 0:
                heights.append(run.outputs(["height"])["height"])
        said = [str(one.message) for one in caught]
    return np.array(heights), said


def test_a_step_is_watched_by_steps_twice_as_long() -> None:
    """What is said of the step is its error against a fourth of it, and nothing is said of an error
    that is wanted.
    """
    fine, _ = driven_by_a_sine(2.5e-4)
    rough, said = driven_by_a_sine(1e-3, 1e-7)
    plain, silent = driven_by_a_sine(1e-3, 0.5)
    np.testing.assert_array_equal(rough, plain)
    assert silent == []
    assert len(said) == 1
    found = re.fullmatch(
        r"the step of 0.001 s errs by (\S+) of the range of (\S+) so far, (\S+) times what is wanted; .*",
        said[0],
    )
    assert found
    assert float(found[3]) == pytest.approx(float(found[1]) / 1e-7, rel=0.1)
    only, said = driven_by_a_sine_of("height")
    true = np.abs(rough - fine)[: only + 1].max() / np.ptp(rough[: only + 1])
    assert said == pytest.approx(true, rel=0.5)


def driven_by_a_sine_of(name: str) -> tuple[int, float]:
    """The instant of 2 ms at which an output of the arm is told to be off, and by how much."""
    run = start(arm(), GeneralizedAlpha(1e-3), accuracy={name: 1e-9})
    for k in range(1000):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", Notice)
            run.step({"u": 40.0 * np.sin(15.0 * (k + 0.5) * 1e-3)})
        if caught:
            found = re.search(rf"errs by (\S+) of the range of {name}", str(caught[0].message))
            assert found
            return (k + 1) // 2, float(found[1])
    raise AssertionError("nothing was said")


def test_a_step_without_inputs_is_of_second_order() -> None:
    """The error of what is told is that against a fourth of the step, of a force that is a function
    of time and the state.
    """
    system, ends = eliminate(fed()), {}
    for step in (H, H / 4):
        ends[step] = outputs(
            integrate(system, GeneralizedAlpha(step), 0.4, every=round(2 * H / step))
        )
    run, said = start(system, GeneralizedAlpha(H), accuracy={"tip": 1e-12}), None
    for _ in range(400):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", Notice)
            run.step()
        said = said or (
            re.search(r"errs by (\S+) of the range of (\S+)", str(caught[0].message))
            if caught
            else None
        )
    assert said
    rough, fine = (ends[step][said[2]] for step in (H, H / 4))
    true = np.abs(rough - fine).max() / np.ptp(rough)
    assert float(said[1]) == pytest.approx(true, rel=0.3)


@pytest.mark.parametrize(
    ("accuracy", "said"),
    [
        (2.0, "between 0 and 1"),
        ({"hight": 1e-3}, "'hight'"),
        (0.0, "between 0 and 1"),
        ("1 mm", "accuracy: expected .* a finite number, got '1 mm'"),
    ],
)
def test_an_accuracy_is_of_outputs_and_below_one(accuracy: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        start(arm(), GeneralizedAlpha(H), accuracy=accuracy)


def test_turns_are_those_of_the_motion_whoever_reads_them_and_how_often() -> None:
    """Of an arm that turns often: read in every step, by all outputs, at the end alone, and after
    many steps in one call.
    """
    torque = [60.0 if k % 100 < 60 else -30.0 for k in range(1500)]
    every, seldom, late = (start(arm(), GeneralizedAlpha(H)) for _ in range(3))
    for k, u in enumerate(torque):
        every.step({"u": u})
        seen = every.outputs(["turn", "against"])
        if k % 250 == 17:
            assert every.outputs()["turn"] == seen["turn"]
        seldom.step({"u": u})
        late.step({"u": u})
    assert abs(seen["turn"]) > 4 * np.pi
    assert abs(seen["against"]) > 2 * np.pi
    for found in (seldom.outputs(), late.outputs(["against", "turn"])):
        assert found["turn"] == seen["turn"]
        assert found["against"] == seen["against"]
    one, many = (start(arm(), GeneralizedAlpha(H)) for _ in range(2))
    for _ in range(1500):
        one.step({"u": 60.0})
        turned = one.outputs(["turn"])["turn"]
    many.step({"u": 60.0}, 1500)
    assert many.outputs(["turn"])["turn"] == turned
    held = many.state
    again = start(arm(), GeneralizedAlpha(H))
    again.state = held
    assert again.outputs(["turn"])["turn"] == turned == again.outputs()["turn"]
