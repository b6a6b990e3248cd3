"""FMUs of FMI 2.0 and 3.0: valid, loaded, run and compared with the run in Python, by FMPy."""

from __future__ import annotations

import csv
import ctypes
import hashlib
import io
import json
import platform
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from fmbs_skfem import dynamics, studies
from fmbs_skfem.core import extras
from fmbs_skfem.core.errors import InputError, MissingFeature
from fmbs_skfem.core.values.display import SI, DisplayUnits
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.core.values.inputs import Input
from fmbs_skfem.core.values.ranges import Parameter
from fmbs_skfem.dynamics.outputs import centre_lines
from fmbs_skfem.exports import binaries, c_files, fmu
from fmbs_skfem.exports.binaries import ZIG
from fmbs_skfem.exports.fmu import FMU
from fmbs_skfem.exports.text import template
from fmbs_skfem.reduction import affine
from fmbs_skfem.reduction.affine import ParametricCase
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.studies import exporting
from fmbs_skfem.systems import At, System, signals
from fmbs_skfem.systems.forces import loads
from tests.exports.c_library import COMPILER
from tests.exports.held import held
from tests.exports.test_c_control import SERVOS, rod
from tests.exports.test_c_files import STEP, arm
from tests.results.test_gltf import read

fmpy = pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(COMPILER is None or sys.platform == "win32", reason="no C compiler")

h = STEP.step
TORQUE, WEIGHT = 'torque "M" <&>', "g '\\?"  #: names with all that XML and C have for themselves
PARAMETER, INPUT, TIP_X = 1, 2, 3  #: value references
DISCARD, ERROR = 2, 3


@pytest.fixture(scope="module")
def plant() -> System:
    """A beam on a hinge with a torque that is given from outside."""
    torque = Input(TORQUE, "N m", 0.0, range=(-0.5, 0.5))
    made = arm(loads.Moment("motor", At("beam", "left"), 1.0, history=torque))
    renamed = {
        name: replace(one, columns=tuple(f'"{column}" <&>' for column in one.columns))
        for name, one in made.outputs.items()
    }
    return replace(made, outputs=renamed)


@pytest.fixture(scope="module")
def model(plant: System) -> ParametricCase:
    """The same over gravity."""

    def family(values: Mapping[str, float]) -> Case:
        scaled = replace(
            plant, loads=replace(plant.loads, constant=values[WEIGHT] / 9.81 * plant.loads.constant)
        )
        return Case(scaled, STEP, 0.3)

    return affine.fit(family, (Parameter(WEIGHT, 5.0, 12.0, value=9.81, unit="m/s^2"),))


def made_by(unit: FMU, place: Path) -> Path:
    """An FMU for this machine, with its own compiler."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(extras, "there", lambda extra: False)
        built = binaries.build(unit.files, unit.version)
    assert built.compiler
    assert not built.failed
    assert [one.folder for one in built.binaries] == [
        one[1 if unit.version == 2 else 0] for one in [binaries.this_machine()] if one
    ]
    place.write_bytes(fmu.pack(unit, built.binaries))
    return place


@pytest.fixture(scope="module", params=[2, 3])
def archive(
    request: pytest.FixtureRequest, model: ParametricCase, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    unit = fmu.write(
        c_files.write(model, "an arm", "an arm"), request.param, 'an "arm" <&>', "of a test"
    )
    return made_by(unit, tmp_path_factory.mktemp("fmu") / "arm.fmu")


class Instance:
    """An instance of an FMU, by the same calls for both versions."""

    def __init__(self, archive: Path, folder: Path, **more: object) -> None:
        self.description = fmpy.read_model_description(str(archive))
        self.messages: list[str] = []
        self.old = self.description.fmiVersion == "2.0"
        logger: Callable[..., None] = self.hear2 if self.old else self.hear3
        self.unit = fmpy.instantiate_fmu(
            fmpy.extract(str(archive), str(folder)), self.description, logger=logger, **more
        )
        if self.old:
            self.get, self.set = self.unit.getReal, self.unit.setReal
        else:
            self.get, self.set = self.unit.getFloat64, self.unit.setFloat64
        self.outputs_at = [
            k for k, one in enumerate(self.description.modelVariables) if one.causality == "output"
        ]

    def hear2(
        self, environment: object, name: bytes, status: int, category: bytes, text: bytes
    ) -> None:
        self.messages.append(text.decode())

    def hear3(self, environment: object, status: int, category: bytes, text: bytes) -> None:
        self.messages.append(text.decode())

    def enter(self, begin: float = 0.0) -> None:
        if self.old:
            self.unit.setupExperiment(startTime=begin)
            self.unit.enterInitializationMode()
        else:
            self.unit.enterInitializationMode(startTime=begin)

    def start(self, begin: float = 0.0) -> Instance:
        self.enter(begin)
        self.unit.exitInitializationMode()
        return self

    @property
    def outputs(self) -> np.ndarray:
        return np.array(self.get(self.outputs_at))

    @property
    def time(self) -> float:
        return float(self.get([0])[0])

    def run(self, spans: list[float], torque: Callable[[float], float] | None = None) -> np.ndarray:
        """Outputs (s, c) after steps from the present time on, the torque that at the begin of a
        step.
        """
        found, begin = [self.outputs], self.time
        for before, after in pairwise(np.cumsum([begin, *spans]).tolist()):
            if torque is not None:
                self.set([INPUT], [torque(before)])
            self.unit.doStep(before, after - before)
            found.append(self.outputs)
        return np.array(found)


@pytest.fixture
def instance(archive: Path, tmp_path: Path) -> Iterator[Instance]:
    made = Instance(archive, tmp_path)
    yield made
    made.unit.freeInstance()


def torque(t: float) -> float:
    # sums of steps and multiples differ by round-off
    return 0.2 * float(np.sin(20.0 * round(t, 9)))


def in_python(
    model: ParametricCase, g: float, text: str | None, steps: int, every: int = 1
) -> np.ndarray:
    """Outputs (s, c) under a torque that is an expression of time, or without one held over steps."""
    system = model({WEIGHT: g}).system
    given = (
        signals.with_inputs(system, {TORQUE: of_time(text)})
        if text
        else held(system, h, {TORQUE: torque})
    )
    columns = dynamics.outputs(
        dynamics.integrate(given, STEP, steps * h, model({WEIGHT: g}).newton, every)
    )
    return np.stack([columns[one.name] for one in c_files.write(model, "m", "m").columns], axis=1)


def refused(status: int, call: Callable[..., Any], *arguments: object) -> None:
    with pytest.raises(fmpy.fmi1.FMICallException) as told:
        call(*arguments)
    assert told.value.status == status


def test_fmpy_finds_no_problem(archive: Path, plant: System) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(archive)) == []
    told = fmpy.read_model_description(str(archive))
    weight, moment, tip = (told.modelVariables[k] for k in (PARAMETER, INPUT, TIP_X))
    assert (
        weight.name,
        weight.unit,
        float(weight.start),
        float(weight.min),
        float(weight.max),
    ) == (
        WEIGHT,
        "m/s^2",
        9.81,
        5.0,
        12.0,
    )
    assert (moment.name, moment.unit, float(moment.min), float(moment.max)) == (
        TORQUE,
        "N m",
        -0.5,
        0.5,
    )
    assert tip.name.startswith('"')
    powers = {
        one.name: (one.baseUnit.kg, one.baseUnit.m, one.baseUnit.s, one.baseUnit.rad)
        for one in told.unitDefinitions
    }
    assert powers["N m"] == (1, 2, -2, 0)
    assert powers["rad/s"] == (0, 0, -1, 1)
    assert float(told.defaultExperiment.stepSize) == h
    assert float(told.defaultExperiment.stopTime) == 0.3
    # outputs of the start depend on the parameter, and no output on the input of the same instant:
    # no algebraic loop
    assert all(
        [one.name for one in known.dependencies] == [WEIGHT] for known in told.initialUnknowns
    )
    assert all(known.dependencies == [] for known in told.outputs)


def test_tools_show_the_units_that_people_read(model: ParametricCase, tmp_path: Path) -> None:
    """Degrees and turns per minute, prefixes that ranges ask for, and what was typed before these;
    value = factor x value in SI.
    """
    made = c_files.write(model, "m", "m")
    made = replace(made, parameters={"E": ("Pa", 0.5e9, 2e9, 1e9)}, ranges={TORQUE: (-0.05, 0.05)})
    for display, torque, speed in (
        (SI, ("mN m", 1e3), ("rpm", 30 / np.pi)),
        (DisplayUnits((), ("N mm", "deg/s")), ("N mm", 1e3), ("deg/s", 180 / np.pi)),
    ):
        unit = fmu.write(made, 2, "m", "", display)
        told = fmpy.read_model_description(str(made_by(unit, tmp_path / f"{speed[0][0]}.fmu")))
        shown = {one.name: one.displayUnit for one in told.modelVariables}
        factors = {
            each.name: float(each.factor)
            for one in told.unitDefinitions
            for each in one.displayUnits
        }
        names = {
            kind: next(one.name for one in told.modelVariables if one.unit == kind)
            for kind in ("rad", "rad/s", "N m", "m")
        }
        assert shown["E"] == "GPa"
        assert shown[names["rad"]] == "deg"
        assert shown[names["m"]] is None
        assert (shown[names["N m"]], shown[names["rad/s"]]) == (torque[0], speed[0])
        for name, factor in (("GPa", 1e-9), ("deg", 180 / np.pi), torque, speed):
            assert factors[name] == pytest.approx(factor, rel=1e-14)


def test_it_moves_as_in_python(model: ParametricCase, archive: Path, instance: Instance) -> None:
    """Both keep the tolerance of a run: in FMPy's own loop, at another value of the parameter, and
    under an input.
    """
    found = fmpy.simulate_fmu(
        str(archive), stop_time=0.3, step_size=h, output_interval=h, start_values={WEIGHT: 11.0}
    )
    exact = in_python(model, 11.0, "0*t", 300)
    got = np.stack([found[name] for name in found.dtype.names[1:]], axis=1)
    assert got.shape == exact.shape
    assert np.abs(got - exact).max() < 2e-7 * np.abs(exact).max()
    exact = in_python(model, 9.81, None, 300)
    assert (
        np.abs(instance.start().run([h] * 300, torque) - exact).max() < 2e-7 * np.abs(exact).max()
    )


def test_inputs_go_on_within_a_communication_step(
    model: ParametricCase, archive: Path, instance: Instance, tmp_path: Path
) -> None:
    """FMI 2 by derivatives, of second order with the first one; FMI 3 by values that the model asks
    for, of which the motion is that of the smooth torque itself.
    """
    if instance.old:
        exact = in_python(model, 9.81, "0.02*sin(20*t)", 200, 20)
        assert instance.description.coSimulation.canInterpolateInputs
        errors = []
        for many, orders in ((10, 1), (5, 1), (10, 3)):
            instance.start()
            slopes = [instance.outputs]
            for k in range(200 // many):
                t = k * many * h
                sine, cosine = 0.02 * np.sin(20.0 * t), 0.02 * np.cos(20.0 * t)
                given = [20.0 * cosine, -400.0 * sine, -8000.0 * cosine][:orders]
                instance.set([INPUT], [sine])
                instance.unit.setRealInputDerivatives([INPUT] * orders, range(1, orders + 1), given)
                instance.unit.doStep(t, many * h)
                slopes.append(instance.outputs)
            # of places: rates show the waves of jumps as well
            errors.append(np.abs(np.array(slopes)[:: 20 // many] - exact)[:, :2].max())
            instance.unit.reset()
        assert 1e-6 < errors[0] < 1e-4
        assert 3.3 < errors[0] / errors[1] < 4.5
        assert errors[2] < 0.02 * errors[0]
        for at, order in ((TIP_X, 1), (INPUT, 0), (INPUT, 4)):
            refused(ERROR, instance.unit.setRealInputDerivatives, [at], [order], [0.0])
        refused(DISCARD, instance.unit.setRealInputDerivatives, [INPUT], [1], [np.inf])
        # a ramp is followed as it is
        exact = in_python(model, 9.81, "2*t", 100, 20)
        instance.start()
        for k in range(5):
            instance.set([INPUT], [2.0 * k * 20 * h])
            instance.unit.setRealInputDerivatives([INPUT], [1], [2.0])
            instance.unit.doStep(k * 20 * h, 20 * h)
            assert np.abs(instance.outputs - exact[k + 1]).max() < 2e-7 * np.abs(exact).max()
        assert instance.get([INPUT]) == [pytest.approx(0.2)]
        return
    exact = in_python(model, 9.81, "0.2*sin(20*t)", 200, 20)
    asked: list[tuple[float, bool]] = []
    ends = 1.0

    def update(
        environment: object, t: float, sets: bool, gets: bool, taken: bool, may: bool, *end: Any
    ) -> None:
        asked.append((t, taken))
        assert (sets, gets, taken) in ((True, False, False), (False, True, True))
        if sets:
            asking.set([INPUT], [torque(t)])
        elif may and t >= ends:
            assert asking.time == t
            end[0][0], end[1][0] = True, t

    asking = Instance(
        archive,
        tmp_path / "asking",
        intermediate_update=update,
        required_intermediate_variables=[INPUT],
        early_return_allowed=True,
    )
    asking.start()
    got = [asking.outputs]
    for k in range(10):
        assert not asking.unit.doStep(20 * k * h, 20 * h)[2]
        got.append(asking.outputs)
    assert np.abs(np.array(got) - exact).max() < 2e-7 * np.abs(exact).max()
    assert len(asked) == 400
    ends = 0.205 - 1e-9
    _, _, early, reached = asking.unit.doStep(0.2, 20 * h)
    assert early
    assert reached == asking.time == pytest.approx(0.205)
    assert not asking.unit.doStep(reached, h)[2]
    asking.unit.freeInstance()


def test_a_reset_model_runs_again_bit_for_bit(instance: Instance) -> None:
    first = instance.start().run([h] * 50, torque)
    instance.unit.reset()
    instance.set([PARAMETER], [6.0])
    other = instance.start().run([h] * 50, torque)
    assert not np.array_equal(first, other)
    instance.unit.reset()
    np.testing.assert_array_equal(instance.start().run([h] * 50, torque), first)


def test_two_instances_do_not_know_each_other(
    archive: Path, tmp_path: Path, instance: Instance
) -> None:
    alone = instance.start().run([h] * 30, torque)
    instance.unit.reset()
    instance.start()
    other = Instance(archive, tmp_path / "other")
    other.set([PARAMETER], [6.0])
    other.start()
    for k in range(30):
        other.run([h], lambda t: -0.3)
        np.testing.assert_array_equal(instance.run([h], torque)[-1], alone[k + 1])
    other.unit.freeInstance()


def test_states_are_saved_and_serialised(archive: Path, tmp_path: Path, instance: Instance) -> None:
    instance.start().run([h] * 20, torque)
    state = instance.unit.getFMUState()
    first = instance.run([h] * 20, torque)
    instance.unit.setFMUState(state)
    assert instance.time == pytest.approx(20 * h)
    np.testing.assert_array_equal(instance.run([h] * 20, torque), first)
    write = instance.unit.serializeFMUstate if instance.old else instance.unit.serializeFMUState
    read = (
        (lambda one: one.deSerializeFMUstate)
        if instance.old
        else (lambda one: one.deserializeFMUState)
    )
    held = write(state)
    instance.unit.freeFMUState(state)
    other = Instance(archive, tmp_path / "other")
    other.unit.setFMUState(read(other.unit)(held))
    np.testing.assert_array_equal(other.run([h] * 20, torque), first)
    for damaged in (held[:-1], b"x" + held[1:], held[:200] + bytes([held[200] ^ 1]) + held[201:]):
        refused(ERROR, read(other.unit), damaged)
    other.unit.freeInstance()


def test_other_communication_steps_are_divided_and_told(
    model: ParametricCase, instance: Instance
) -> None:
    """Three steps of the model; then 1.5 of them, in two steps of 0.75, as exact as a method of
    second order is.
    """
    whole = instance.start().run([h] * 60)
    assert instance.messages == []
    instance.unit.reset()
    got = instance.start().run([3 * h] * 20)
    np.testing.assert_array_equal(got, whole[::3])
    assert instance.messages == [
        "a communication step of 0.003 s is taken as 3 steps of 0.001 s; the step of the model is 0.001 s"
    ]
    instance.unit.reset()
    fine = instance.start().run([1.5 * h] * 40)
    assert instance.messages[1:] == [
        "a communication step of 0.0015 s is taken as 2 steps of 0.00075 s; the step of the model is 0.001 s"
    ]
    assert 0 < np.abs(fine[::2, :2] - whole[::3, :2]).max() < 1e-5


def test_steps_of_times_with_round_off_are_whole(instance: Instance) -> None:
    """At 1e4 s a step is known to 1e-9 of it: it neither begins anew nor drifts."""
    exact = instance.start().run([h] * 50)
    instance.unit.reset()
    far = instance.start(1e4).run([h] * 50)
    assert instance.messages == [
        "the motion begins at 10000 s: functions of time of the model count from there"
    ]
    np.testing.assert_array_equal(far, exact)


def test_a_master_that_adds_up_steps_is_followed(instance: Instance) -> None:
    """Its sums drift by the round-off of time, here as much in 200 steps as from zero in a hundred
    million.
    """
    begin = 1e9
    far = instance.start(begin).run([h] * 200)
    assert abs(np.cumsum([begin, *[h] * 200])[-1] - (begin + 200 * h)) > 5e-6
    instance.unit.reset()
    np.testing.assert_array_equal(far, instance.start().run([h] * 200))
    refused(ERROR, instance.unit.doStep, 0.201, h)


def test_values_outside_are_refused_with_a_message(instance: Instance) -> None:
    refused(DISCARD, instance.set, [PARAMETER], [12.5])
    assert instance.messages == [
        f"{WEIGHT} = 12.5 m/s^2 is refused, outside of what the model was trained for, 5 to 12"
    ]
    assert instance.get([PARAMETER]) == [9.81]
    instance.start()
    for value, shown in ((np.nan, "nan"), (np.inf, "inf")):
        refused(DISCARD, instance.set, [INPUT], [value])
        assert (
            instance.messages[-1] == f"{TORQUE} = {shown} N m is not finite: the value before stays"
        )
    assert instance.get([INPUT]) == [0.0]
    instance.set([INPUT], [0.75])
    told = f"{TORQUE} = 0.75 N m is outside of what the model was trained for, -0.5 to 0.5"
    assert instance.messages[-1] == told
    instance.set([INPUT], [0.8])
    assert instance.messages.count(told) == 1
    refused(ERROR, instance.set, [TIP_X], [0.0])
    refused(ERROR, instance.get, [99])


def test_points_of_bodies_are_an_array(plant: System, tmp_path: Path) -> None:
    """In FMI 3, for viewers: the centre line, as in Python; `resources` says whose points they are."""
    case = Case(plant, STEP, 0.3)
    made = exporting.ExportedModel(c_files.write(case, "an arm", "an arm"), "an arm", "", SI, case)
    unit = fmu.write(made.model, 3, "an arm", shape=exporting.shape_of(made, True))
    archive = made_by(unit, tmp_path / "arm.fmu")
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(archive)) == []
    one = Instance(archive, tmp_path / "one")
    (shape,) = (known for known in one.description.modelVariables if known.name == "shape")
    (size,) = (int(known.start) for known in shape.dimensions)
    bodies = json.loads(unit.files["resources/shape.json"])["bodies"]
    assert bodies == {"beam": {"first": 0, "points": size // 3}}
    one.start()
    found = np.array(one.unit.getFloat64([shape.valueReference], nValues=size)).reshape(-1, 3)
    with zipfile.ZipFile(archive) as files:
        tube = read(files.read("resources/shape.glb"))["beam"]
    np.testing.assert_allclose(tube.centres(), found, rtol=0, atol=1e-6)
    one.unit.doStep(0.0, 50 * h)
    found = np.array(one.unit.getFloat64([shape.valueReference], nValues=size)).reshape(-1, 3)
    motion = dynamics.integrate(held(plant, h, {TORQUE: lambda t: 0.0}), STEP, 50 * h)
    exact = centre_lines(plant, plant.lift(motion.x[-1])[None])["beam"][0, 0]
    np.testing.assert_allclose(found[:, :2], exact, rtol=0, atol=1e-7)
    assert np.abs(exact[-1] - [1.0, 0.0]).max() > 1e-3
    both = one.unit.getFloat64([0, shape.valueReference], nValues=1 + size)
    assert both[0] == pytest.approx(50 * h)
    refused(ERROR, one.unit.getFloat64, [shape.valueReference])
    one.unit.freeInstance()


def test_tunable_parameters_change_in_a_motion(
    model: ParametricCase, archive: Path, instance: Instance
) -> None:
    """Between steps; one that is not tunable is fixed when the motion has started."""
    assert instance.description.modelVariables[PARAMETER].variability == "tunable"
    whole = instance.start().run([h] * 20)
    instance.unit.reset()
    instance.start().run([h] * 10)
    instance.set([PARAMETER], [6.0])
    changed = instance.run([h] * 10)
    np.testing.assert_array_equal(changed[0], whole[10])
    assert np.abs(changed[-1] - whole[-1]).max() > 1e-6
    written = replace(c_files.write(model, "an arm", "an arm"), tunable=())
    unit = fmu.write(written, 2, "an arm")
    assert 'variability="fixed"' in unit.files["modelDescription.xml"]
    assert '"m/s^2", 1},' in unit.files[f"sources/{unit.name}_fmi2.c"]


def test_a_step_that_fails_keeps_the_last_good_state(instance: Instance) -> None:
    instance.start().run([h] * 10)
    before, time = instance.outputs, instance.time
    instance.set([INPUT], [1e30])
    refused(DISCARD, instance.unit.doStep, time, h)
    assert "the state is that of the last good one" in instance.messages[-1]
    np.testing.assert_array_equal(instance.outputs, before)
    assert instance.time == time
    if instance.old:
        assert instance.unit.getRealStatus(2) == time
    instance.set([INPUT], [0.0])
    assert np.isfinite(instance.run([h] * 10)).all()


def test_calls_out_of_turn_are_errors(instance: Instance) -> None:
    refused(ERROR, instance.unit.doStep, 0.0, h)
    instance.start()
    refused(ERROR, instance.unit.exitInitializationMode)
    refused(ERROR, instance.unit.doStep, 0.5, h)
    assert (
        instance.messages[-1] == "the communication point 0.5 s is not the time of the model, 0 s"
    )
    for span in (0.0, -h, np.nan):
        refused(ERROR, instance.unit.doStep, 0.0, span)
    instance.unit.terminate()
    refused(ERROR, instance.unit.doStep, 0.0, h)


def test_directional_derivatives_are_those_of_the_last_step(instance: Instance) -> None:
    """Against differences of the step itself."""
    instance.start().run([h] * 10, torque)
    state, found = instance.unit.getFMUState(), []
    for value in (0.2 - 1e-3, 0.2 + 1e-3, 0.2):
        instance.unit.setFMUState(state)
        found.append(instance.run([h], lambda t, value=value: value)[-1])  # type: ignore[misc]
    difference = (found[1] - found[0]) / 2e-3
    slopes = (
        np.array(instance.unit.getDirectionalDerivative(instance.outputs_at, [INPUT], [3.0])) / 3.0
    )
    assert np.abs(slopes - difference).max() < 1e-3 * np.abs(difference).max()
    np.testing.assert_array_equal(instance.outputs, found[2])
    if not instance.old:
        seed = np.arange(1.0, 1.0 + len(instance.outputs_at)).tolist()
        (back,) = instance.unit.getAdjointDerivative(instance.outputs_at, [INPUT], seed, 1)
        assert back == pytest.approx(slopes @ seed, rel=1e-12)


def test_a_description_of_another_model_makes_no_instance(
    archive: Path, tmp_path: Path, instance: Instance
) -> None:
    told = fmpy.read_model_description(str(archive))
    told.guid = "{another}"
    if instance.old:
        instance.unit.guid = told.guid
    with pytest.raises(Exception, match="instantiate"):
        fmpy.instantiate_fmu(
            fmpy.extract(str(archive), str(tmp_path / "b")),
            told,
            logger=instance.hear2 if instance.old else None,
        )


def test_sources_alone_build_and_load(archive: Path, tmp_path: Path) -> None:
    """As an importer compiles them, which finds them in the description; with a prefix, functions
    have other names.
    """
    import subprocess

    folder = Path(fmpy.extract(str(archive), str(tmp_path / "unit"))) / "sources"
    told = fmpy.read_model_description(str(archive))
    version = int(float(told.fmiVersion))
    if version == 2:
        listed = [
            one.get("name")
            for one in ElementTree.parse(folder.parent / "modelDescription.xml").iter("File")
        ]
    else:
        (one,) = fmpy.model_description.read_build_description(str(tmp_path / "unit"))
        listed = one.sourceFileSets[0].sourceFiles
    assert sorted(listed) == sorted(one.name for one in folder.glob("*.c"))
    strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O1", "-shared", "-fPIC"]
    for flags, name in (
        ([], f"fmi{version}DoStep"),
        ([f"-DFMI{version}_FUNCTION_PREFIX=arm_"], f"arm_fmi{version}DoStep"),
    ):
        assert COMPILER is not None
        library = folder / f"{name}.so"
        subprocess.run(
            [COMPILER, *strict, *flags, *listed, "-o", str(library)], cwd=folder, check=True
        )
        assert getattr(ctypes.CDLL(str(library)), name)


def test_descriptions_have_no_control_characters(model: ParametricCase) -> None:
    """A title of a file of somebody else is text of XML as well."""
    found = fmu.write(
        c_files.write(model, "arm", "an arm"), 3, "an \x01 arm\x1b", "with \x00 and <tags> & \ufffe"
    )
    root = ElementTree.fromstring(found.files["modelDescription.xml"])
    assert root.get("description") == r"an \x01 arm\x1b. with \x00 and <tags> & \ufffe"


def test_names_that_are_taken_stay_distinct(plant: System) -> None:
    outputs = {"time": next(iter(plant.outputs.values()))}
    model = c_files.write(Case(replace(plant, outputs=outputs), STEP, 0.3), "m", "m")
    doubled = replace(
        model,
        inputs={"a": ("N", 0.0), "a\tb": ("", 0.0), "\t": ("", 0.0)},
        columns=tuple(one._replace(name="a") for one in model.columns[:1]),
    )
    names = [one.name for one in fmu.variables_of(doubled)]
    assert names == ["time", "a", "a b", "input", "a (output)"]


def test_the_same_model_gives_the_same_bytes(model: ParametricCase) -> None:
    first, second = (
        fmu.pack(fmu.write(c_files.write(model, "m", "m"), 3, "m"), ()) for _ in range(2)
    )
    assert first == second


def test_without_a_compiler_there_are_sources_only(
    model: ParametricCase, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(extras, "there", lambda extra: False)
    monkeypatch.setattr(binaries.shutil, "which", lambda name: None)
    unit = fmu.write(c_files.write(model, "m", "m"), 2, "m")
    built = binaries.build(unit.files, 2)
    assert (built.compiler, built.binaries) == ("", ())
    names = zipfile.ZipFile(io.BytesIO(fmu.pack(unit, built.binaries))).namelist()
    assert names == ["modelDescription.xml", "sources/m.c", "sources/m.h", "sources/m_fmi2.c"]


@pytest.mark.parametrize("version", [2, 3])
def test_zig_makes_libraries_of_all_machines(
    version: int, model: ParametricCase, tmp_path: Path
) -> None:
    """What they are, what they show, and that Windows needs no library of C; that of this machine
    runs.
    """
    unit = fmu.write(c_files.write(model, "m", "m"), version, "m")
    built = binaries.build(unit.files, version)
    assert (built.compiler, built.failed) == ("zig", {})
    found = {one.folder: one.content for one in built.binaries}
    windows = found["win64" if version == 2 else "x86_64-windows"]
    place = struct.unpack("<I", windows[60:64])[0]
    assert windows[place : place + 6] == b"PE\0\0" + struct.pack("<H", 0x8664)
    assert b"msvcrt" not in windows.lower()
    assert b"api-ms-win-crt" not in windows.lower()
    for name, machine in (
        ("linux64" if version == 2 else "x86_64-linux", 62),
        ("aarch64-linux", 183),
    ):
        assert found[name][:4] == b"\x7fELF"
        assert struct.unpack("<H", found[name][18:20])[0] == machine
    if version == 2:  # one file for both processors
        magic, count, *rows = struct.unpack(">12I", found["darwin64"][:48])
        assert (magic, count) == (0xCAFEBABE, 2)
        assert (rows[0], rows[5]) == (0x01000007, 0x0100000C)
        parts = [found["darwin64"][row[2] : row[2] + row[3]] for row in (rows[:5], rows[5:])]
    else:
        parts = [found["x86_64-darwin"], found["aarch64-darwin"]]
    assert [part[:8] for part in parts] == [
        struct.pack("<II", 0xFEEDFACF, kind) for kind in (0x01000007, 0x0100000C)
    ]
    assert all(f"fmi{version}DoStep".encode() in content for content in found.values())
    archive = tmp_path / "m.fmu"
    archive.write_bytes(fmu.pack(unit, built.binaries))
    got = Instance(archive, tmp_path / "unit").start().run([h] * 50)
    assert np.abs(got - in_python(model, 9.81, "0*t", 50)).max() < 2e-7 * np.abs(got).max()


def test_the_command_says_which_binaries_there_are(
    model: ParametricCase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        exporting,
        "written",
        lambda job, name, *_: exporting.ExportedModel(c_files.write(model, name, "m"), "m", "", SI),
    )
    monkeypatch.setattr(extras, "there", lambda extra: False)
    own = binaries.this_machine()
    assert own is not None
    (tmp_path / "m.h5").touch()
    place = tmp_path / "new" / "m.fmu"
    told = studies.export_model(tmp_path / "m.h5", fmu=place, fmi=3, name="arm")
    assert (told.report["fmi"], told.report["binaries"], told.report["files"]) == (
        3,
        [own.folder],
        [place],
    )
    lines = [one for one in told.lines if isinstance(one, str)]
    assert any(line.startswith("binaries by ") and own.folder in line for line in lines)
    assert any('pip install "fmbs_skfem[fmu]"' in line for line in lines)
    with pytest.raises(InputError, match="a place without these files"):
        studies.export_model(tmp_path / "m.h5", fmu=place)
    for given in ({}, {"fmu": place, "c": tmp_path}):
        with pytest.raises(InputError, match="--c DIR, or a file for an FMU, --fmu FILE"):
            studies.export_model(tmp_path / "m.h5", **given)


def test_the_motion_of_the_training_is_in_it_with_its_errors(
    model: ParametricCase, tmp_path: Path
) -> None:
    """As related files of FMI-LS-REF, whose checksums hold: the FMU repeats the motion."""
    known = {'"tip_x" <&>': {"unit": "m", "error": 1.25e-5, "relative": 3e-4}}
    notes = {"report": {"output_errors": known}}
    written = c_files.write(model, "an arm", "an arm")
    made = exporting.ExportedModel(written, "an arm", "", SI, model.nominal, notes)
    for version in (2, 3):
        unit = fmu.write(written, version, "an arm", motion=exporting.reference_of(made))
        folder = tmp_path / str(version)
        folder.mkdir()
        archive = made_by(unit, folder / "arm.fmu")
        with zipfile.ZipFile(archive) as files:
            files.extractall(folder)
        extra = folder / "extra" / "org.fmi-standard.fmi-ls-ref"
        root = ElementTree.parse(extra / "fmi-ls-manifest.xml").getroot()
        assert root.get("{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-name") == extra.name
        related = {one.get("source"): one for one in root.iter("Related")}
        assert set(related) == {"training.exp", "training.csv", "errors.csv"}
        for name, one in related.items():
            content = (extra / str(name)).read_bytes()
            assert one.get("checksum") == hashlib.sha3_256(content).hexdigest()
        (motion,) = ElementTree.parse(extra / "training.exp").getroot().iter("TransientSimulation")
        head, *rows = csv.reader((extra / "training.csv").read_text().splitlines())
        reference = dict(zip(head, np.array(rows, float).T, strict=True))
        step = float(motion.get("stepSize", 0))
        found = fmpy.simulate_fmu(
            str(archive),
            stop_time=float(motion.get("stopTime", 0)),
            step_size=step,
            output_interval=reference["time"][1],
        )
        assert len(rows) == 301
        assert len(head) > 5
        for name, values in reference.items():
            assert np.abs(found[name] - values).max() < 1e-6 * np.abs(values).max() + 1e-9
        errors = (extra / "errors.csv").read_text().splitlines()
        assert errors[1] == '"""tip_x"" <&>",m,1.25e-05,0.0003'
    assert exporting.reference_of(made._replace(case=None)) is None


def test_a_machine_without_a_binary_is_an_error(
    model: ParametricCase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file is written with those that there are; who waits for Windows is told by the exit
    code.
    """
    monkeypatch.setattr(
        exporting,
        "written",
        lambda job, name, *_: exporting.ExportedModel(c_files.write(model, name, "m"), "m", "", SI),
    )
    made = binaries.Built(
        "zig", (binaries.Binary("linux64", "so", b"1"),), {"x86_64-windows": "undefined symbol: f"}
    )
    monkeypatch.setattr(binaries, "build", lambda *_: made)
    (tmp_path / "m.h5").touch()
    with pytest.raises(
        MissingFeature, match="got none for x86_64-windows; compile its sources there"
    ) as caught:
        studies.export_model(tmp_path / "m.h5", fmu=tmp_path / "m.fmu", name="arm")
    assert caught.value.exit_code == 7
    report = caught.value.result.report
    assert (report["status"], report["binaries"], report["files"]) == (
        "error",
        ["linux64"],
        [tmp_path / "m.fmu"],
    )
    assert any(
        "undefined symbol: f" in line for line in caught.value.result.lines if isinstance(line, str)
    )


FRAME = """
double sum_of(int n)
{
    volatile double x[4000];
    double sum = 0.0;
    for (int k = 0; k < n; k++) x[k] = k;
    for (int k = 0; k < n; k++) sum += x[k];
    return sum;
}
"""
PROBE = """
#include "windows.c"
int main(void)
{
    unsigned long size = 100000, count = 7, before, after;
    __asm__ volatile("movq %%rsp, %2\\n call ___chkstk_ms\\n movq %%rsp, %3"
                     : "+a"(size), "+c"(count), "=&r"(before), "=&r"(after) : : "memory", "cc");
    return size != 100000 || count != 7 || before != after;
}
"""


@pytest.mark.skipif(
    not extras.there("fmu") or platform.machine() != "x86_64",
    reason="needs zig (extra fmu) on x86-64",
)
def test_windows_has_functions_with_more_than_a_page_of_locals(tmp_path: Path) -> None:
    """They ask for their pages by a routine of the compiler's own library; the one here keeps all
    registers.
    """
    for name, text in (("m.c", FRAME), ("windows.c", template("windows.c")), ("probe.c", PROBE)):
        (tmp_path / name).write_text(text)
    made = binaries.compile_for(
        binaries.MACHINES[0], "zig", ZIG, [tmp_path / "m.c", tmp_path / "windows.c"], tmp_path
    )
    assert isinstance(made, bytes), made
    assert COMPILER is not None
    built = [COMPILER, "-mno-red-zone", "-fno-builtin", "-D__stdcall=", "-o", "probe", "probe.c"]
    subprocess.run(built, cwd=tmp_path, check=True, capture_output=True)
    subprocess.run([tmp_path / "probe"], check=True)


@pytest.mark.parametrize("version", [2, 3])
def test_controllers_act_inside_of_a_unit(version: int, tmp_path: Path) -> None:
    """What they give is an output and no input, whatever steps the master takes."""
    system = rod(tmp_path, SERVOS["pid"])
    found = c_files.write(Case(system, STEP, 0.3), "rod", "a rod")
    unit = Instance(made_by(fmu.write(found, version, "rod", ""), tmp_path / "rod.fmu"), tmp_path)
    names = {one.name: one.causality for one in unit.description.modelVariables}
    assert names["servo"] == "output"
    assert "input" not in names.values()
    got = unit.start().run([10 * h] * 20)[-1]
    unit.unit.freeInstance()
    columns = dynamics.outputs(dynamics.integrate(system, STEP, 0.2))
    place = [one.name for one in found.columns].index("tip_x")
    assert got[place] == pytest.approx(columns["tip_x"][-1], abs=1e-9)
