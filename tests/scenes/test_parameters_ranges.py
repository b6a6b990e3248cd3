"""Parameters with ranges: what is read, and every problem with file, line and key path."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path

import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.ranges import Parameter, Scale

SCENE = """\
schema: 1
dimension: 2
parameters:
  E: {value: 60 GPa, range: [40 GPa, 70 GPa]}
  d: {range: [1 mm, 100 mm], scale: log}
  r: {range: [-1, 3]}
  g: 9.81 m/s^2
  m: {value: 2 * w, range: [0.5 * w, 4 * w]}
bodies:
  ball: {type: point_mass, mass: m, position: [0, 0]}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
""".replace("  m:", "  w: 2 kg\n  m:")


def changed(before: str, after: str) -> str:
    assert SCENE.count(before) == 1
    return SCENE.replace(before, after)


def refused(text: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        scenes.loads(text)
    return str(caught.value).splitlines()


def test_values_and_ranges_are_si() -> None:
    scene = scenes.loads(SCENE)
    assert scene.ranges == {
        "E": Parameter("E", 40e9, 70e9, unit="Pa"),
        "d": Parameter("d", 1e-3, 0.1, Scale.LOG, "m"),
        "r": Parameter("r", -1.0, 3.0),
        "m": Parameter("m", 1.0, 8.0, unit="kg"),
    }
    assert list(scene.ranges) == ["E", "d", "r", "m"]
    assert scene.parameters["E"] == 60e9
    assert scene.parameters["d"] == pytest.approx(0.01, rel=1e-15)
    assert (scene.parameters["r"], scene.parameters["g"], scene.parameters["m"]) == (1.0, 9.81, 4.0)
    assert getattr(scene.bodies["ball"], "mass", None) == 4.0
    assert str(scene.ranges["E"]) == "4e+10 to 7e+10 Pa"


def test_a_range_without_unit_takes_the_unit_of_the_value() -> None:
    scene = scenes.loads(
        changed("{value: 60 GPa, range: [40 GPa, 70 GPa]}", "{value: 60 GPa, range: [4e10, 7e10]}")
    )
    assert scene.ranges["E"] == Parameter("E", 40e9, 70e9, unit="Pa")
    scene = scenes.loads(
        changed("{value: 60 GPa, range: [40 GPa, 70 GPa]}", "{value: 6e10, range: [0, 70 GPa]}")
    )
    assert scene.ranges["E"] == Parameter("E", 0.0, 70e9, unit="Pa")


def test_other_values_keep_the_range() -> None:
    scene = scenes.loads(SCENE, parameters={"E": "50 GPa", "d": 0.02})
    assert (scene.parameters["E"], scene.parameters["d"]) == (50e9, 0.02)
    assert scene.ranges == scenes.loads(SCENE).ranges
    with pytest.raises(
        InputError,
        match=r"parameters\.E: expected a value of the dimension of the parameter \(pressure\)",
    ):
        scenes.loads(SCENE, parameters={"E": "50 mm"})


@pytest.mark.parametrize("where", ["file", "change"])
def test_a_value_outside_its_range_is_a_notice(where: str) -> None:
    text = changed("value: 60 GPa", "value: 80 GPa") if where == "file" else SCENE
    with pytest.warns(
        Notice,
        match=r"scene:4: parameters\.E: the value 8e\+10 Pa is outside the range of 4e\+10 to 7e\+10 Pa",
    ):
        scenes.loads(text, parameters={} if where == "file" else {"E": "80 GPa"})


def test_ends_of_a_range_are_inside() -> None:
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert scenes.loads(changed("value: 60 GPa", "value: 70 GPa")).parameters["E"] == 70e9
        assert scenes.loads(SCENE, parameters={"E": 40e9}).parameters["E"] == 40e9
    assert not [one for one in told if "outside the range" in str(one.message)]


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            "value: 60 GPa",
            "value: 60 mm",
            r"scene:4: parameters.E.range\[0\]: |scene:4: parameters.E.value: expected value and range",
        ),
        (
            "40 GPa, 70 GPa",
            "40 GPa, 70 mm",
            r"scene:4: parameters.E.range\[1\]: expected value and range of one dimension",
        ),
        (
            "40 GPa, 70 GPa",
            "40 GPz, 70 GPa",
            r"scene:4: parameters.E.range\[0\]: expected a known unit",
        ),
        (
            "40 GPa, 70 GPa",
            "70 GPa, 40 GPa",
            r"scene:4: parameters.E.range: .* smaller than its second, got \[70 GPa, 40 GPa\]",
        ),
        (
            "40 GPa, 70 GPa",
            "40 GPa, 40 GPa",
            r"scene:4: parameters.E.range: .* smaller than its second",
        ),
        (
            "40 GPa, 70 GPa",
            "40, 70 GPa",
            r"scene:4: parameters.E.range: expected both ends .* got \[40, 70 GPa\]; write the unit",
        ),
        (
            "40 GPa, 70 GPa",
            "40 GPa",
            r"scene:4: parameters.E.range: expected a list of two quantities, .* got a list of 1",
        ),
        (
            "40 GPa, 70 GPa",
            ".nan, 70 GPa",
            r"scene:4: parameters.E.range\[0\]: expected a finite number, got nan",
        ),
        (
            "40 GPa, 70 GPa",
            "1 / 0, 70 GPa",
            r"scene:4: parameters.E.range\[0\]: expected a quantity",
        ),
        (
            "range: [1 mm, 100 mm]",
            "range: [0, 100 mm]",
            "scene:5: parameters.d.range: expected a range above zero for the scale log",
        ),
        (
            "scale: log",
            "scale: lgo",
            "scene:5: parameters.d.scale: expected one of linear, log, got 'lgo'; did you mean 'log'",
        ),
        (
            "scale: log",
            "scale: [log]",
            "scene:5: parameters.d.scale: expected one of linear, log, got a list of 1",
        ),
        (
            "scale: log",
            "scal: log",
            "scene:5: parameters.d.scal: expected one of the keys range, .* did you mean 'scale'",
        ),
        (
            "{range: [-1, 3]}",
            "{value: 3}",
            "scene:6: parameters.r.range: expected the key 'range', got no .* write the value alone",
        ),
        (
            "{range: [-1, 3]}",
            "{range: 3}",
            "scene:6: parameters.r.range: expected a list of two quantities",
        ),
        (
            "{range: [-1, 3]}",
            "{range: [q, 3]}",
            r"scene:6: parameters.r.range\[0\]: expected one of the names E, d, pi, got 'q'",
        ),
        (
            "[-1, 3]",
            "[-1e308, 1e308]",
            "scene:6: parameters.r.range: expected a range whose width is a finite number",
        ),
        (
            "1 mm, 100 mm",
            "1e-300 m, 1e300 m",
            "scene:5: parameters.d.range: expected a range whose width is a finite number",
        ),
        ("  r: ", "  t: ", "scene:6: parameters.t: expected a name of letters"),
        (
            "mass: m",
            "mass: d",
            r"scene:11: bodies.ball.mass: expected a mass \[kg\], got 'd' \(length\)",
        ),
        (
            "parameters:\n",
            "parameters: 3\nrest:\n",
            "scene:3: parameters: expected a mapping of names and quantities, got 3",
        ),
    ],
)
def test_refused_with_place(before: str, after: str, message: str) -> None:
    lines = refused(changed(before, after))
    expected = pytest.RaisesExc(InputError, match=message)
    assert any(expected.matches(InputError(line)) for line in lines), lines


def test_all_problems_at_once() -> None:
    text = (
        changed("40 GPa, 70 GPa", "70 GPa, 40 GPa")
        .replace("scale: log", "scale: ln")
        .replace("[-1, 3]", "[a, b]")
    )
    assert [line.split(": expected")[0] for line in refused(text)] == [
        "scene:4: parameters.E.range",
        "scene:5: parameters.d.scale",
        "scene:6: parameters.r.range[0]",
        "scene:6: parameters.r.range[1]",
    ]


def test_published_schema_knows_both_forms() -> None:
    published = scenes.json_schema()
    assert json.loads(json.dumps(published)) == published
    forms = published["properties"]["parameters"]["additionalProperties"]["anyOf"]
    assert [form["type"] for form in forms] == ["number", "string", "object"]
    assert forms[2]["required"] == ["range"]
    assert set(forms[2]["properties"]) == {"value", "range", "scale"}
    assert set(published["$defs"]["Training"]["properties"]) == {
        "candidates", "samples", "first", "iterations", "max_samples", "tolerance", "holdout", "seed",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["crank_slider_young", "crank_slider_torque", "pendulum_family"])
def test_examples_state_ranges(name: str) -> None:
    """The paper's ranges: E in [40, 70] GPa with 101 candidates, torque in [5, 15] N m; doi
    10.1016/j.cma.2019.112690.
    """
    scene = scenes.read(Path(__file__).resolve().parents[2] / "examples" / f"{name}.yaml")
    ends = {key: (limits.low, limits.high) for key, limits in scene.ranges.items()}
    expected = {
        "crank_slider_young": {"E": (40e9, 70e9)},
        "crank_slider_torque": {"torque": (5.0, 15.0)},
        "pendulum_family": {"E": (0.7e9, 1.3e9), "d": (0.008, 0.012), "g": (5.0, 12.0)},
    }
    assert ends == expected[name]
    assert scene.training is not None
    assert math.isclose(scene.parameters["E"], 1e9 if name == "pendulum_family" else 70e9)
