"""Results in the units that were typed: tables, plots, pages' content and reports of one run; files
and Python keep SI units.
"""

from __future__ import annotations

import csv
import json
import math
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.display import DisplayUnits
from fmbs_skfem.core.values.fields import Context
from fmbs_skfem.pages import live
from fmbs_skfem.pages.live import LiveModel, PageParameter
from fmbs_skfem.scenes import accuracy
from fmbs_skfem.studies import folder_report

RPM = math.pi / 30.0
#: a rotor of 2 kg m^2 about its bearing, driven by 4 N m from 300 rpm: w = 10 pi + 2 t
SCENE = """\
schema: 1
dimension: 2
{more}parameters: {{speed: {{value: 300 rpm, range: [100 rpm, 600 rpm]}}}}
bodies: {{rotor: {{type: rigid, mass: 3 kg, center: [0, 0], inertia: 2 kg m^2, points: {{hub: [0, 0], rim: [25 mm, 0]}}}}}}
joints: {{bearing: {{type: pin, at: rotor.hub}}}}
loads: {{drive: {{type: moment, at: rotor.frame, moment: 4 N m}}}}
initial: {{bodies: {{rotor: {{angular_velocity: speed}}}}}}
analysis: {{type: dynamic, duration: 40 ms, step: 1 ms}}
outputs:
  w: {{type: angular_velocity, at: rotor.frame}}
  angle: {{type: angle, at: rotor.frame}}
  rim: {{type: position, at: rotor.rim}}
  drive: {{type: power, of: drive}}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[studies.Run, Path]:
    folder = tmp_path_factory.mktemp("rotor")
    (folder / "rotor.yaml").write_text(SCENE.format(more=""), encoding="utf-8")
    return studies.run(folder / "rotor.yaml", out=folder / "out"), folder / "out"


def cells(found: studies.Run, name: str) -> dict[str, list[float]]:
    """The rows of a table by their first column."""
    table = next(
        one for one in found.lines if isinstance(one, studies.ReportTable) and one.title == name
    )
    return {str(row[0]): [float(str(one)) for one in row[1:]] for row in table.rows}


def test_a_table_is_in_the_units_that_were_typed(run: tuple[studies.Run, Path]) -> None:
    rows = cells(run[0], "Outputs")
    assert list(rows) == ["w [rpm]", "angle [rad]", "rim_x [mm]", "rim_y [mm]", "drive [W]"]
    assert rows["w [rpm]"] == pytest.approx(
        [300.0, *[300.0 + 2.0 * 0.04 / RPM] * 2], rel=2e-5
    )  # the rest is the error of the step
    assert rows["w [rpm]"][0] == pytest.approx(300.0, rel=1e-13)
    assert rows["w [rpm]"][2] * 2.0 * math.pi / 60.0 == pytest.approx(
        run[0].outputs["w"][-1], rel=1e-14
    )
    assert rows["rim_x [mm]"][1] == pytest.approx(25.0)
    assert rows["drive [W]"][2] == pytest.approx(4.0 * (10.0 * math.pi + 0.08), rel=2e-5)
    assert "w [rpm]" in str(run[0])
    assert "<td>w [rpm]</td>" in run[0]._repr_html_()


def test_plots_have_axes_in_them(run: tuple[studies.Run, Path]) -> None:
    """The values of a line and those of the run differ by 2 pi / 60, and its times are
    milliseconds.
    """
    axes = {one.get_ylabel(): one for one in run[0].plot().axes}
    assert list(axes) == ["w [rpm]", "angle [rad]", "rim [mm]", "drive [W]"]
    times, values = (np.asarray(one) for one in axes["w [rpm]"].lines[0].get_data())
    np.testing.assert_allclose(values * 2.0 * math.pi / 60.0, run[0].outputs["w"], rtol=1e-14)
    np.testing.assert_allclose(times, 1000.0 * run[0].times, rtol=1e-14)
    assert {one.get_xlabel() for one in axes.values()} >= {"time [ms]"}


def test_files_and_python_keep_si_units(run: tuple[studies.Run, Path]) -> None:
    found, out = run
    with (out / "outputs.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    columns = dict(zip(head, np.array(rows, dtype=float).T, strict=True))
    # written with 15 digits
    np.testing.assert_allclose(columns["w"], found.outputs["w"], rtol=5e-15)
    assert columns["w"][0] == pytest.approx(10.0 * math.pi)
    assert columns["t"][-1] == pytest.approx(0.04)
    assert columns["rim_x"][0] == pytest.approx(0.025)
    assert json.loads((out / "outputs.units.json").read_text())["w"] == "rad/s"
    report = json.loads((out / "report.json").read_text())
    assert report["outputs"]["w"]["min"] == pytest.approx(10.0 * math.pi)
    assert report["units"]["w"] == "rad/s"
    assert report["display_units"] == {
        "asked": [],
        "typed": ["rpm", "kg", "kg m^2", "mm", "N m", "ms"],
    }


def content(page: Path) -> dict[str, Any]:
    """What a page shows, without its arrays."""
    text = page.read_text(encoding="utf-8").partition('id="content">')[2].partition("</script>")[0]
    found: dict[str, Any] = json.loads(text)
    return found


def test_reports_of_a_folder_read_alike(run: tuple[studies.Run, Path], tmp_path: Path) -> None:
    studies.report(run[1], html=tmp_path / "report.html", bodies=False)
    found, text = (
        content(tmp_path / "report.html"),
        (tmp_path / "report.html").read_text(encoding="utf-8"),
    )
    assert [one["label"] for one in found["panels"]] == [
        "w [rpm]",
        "angle [rad]",
        "rim [mm]",
        "drive [W]",
    ]
    assert found["time"] == {"unit": "ms", "size": 1e-3}
    assert "w [rpm]</td>" in text or "w [rpm]</th>" in text


def test_sliders_and_words_have_them_too() -> None:
    """A page's slider from 40 to 70 GPa gives the model pascals; a value in words has six digits."""
    display, stress = DisplayUnits((), ("GPa", "rpm")), PageParameter("E", "Pa", 40e9, 70e9, 50e9)
    (told,) = live.describe(LiveModel(b"", 1e-3, 3, parameters=(stress,)), display)["parameters"]
    assert (told["unit"], told["size"], told["low"], told["value"]) == ("GPa", 1e9, 40e9, 50e9)
    assert display.text("E", 5.5e10, "Pa") == "E = 55 GPa"
    assert display.text("n", 3.0, "") == "n = 3"


def test_units_that_are_asked_for_go_first(tmp_path: Path) -> None:
    (tmp_path / "rotor.yaml").write_text(
        SCENE.format(more="display_units: [deg, m, rad/s, kW]\n"), encoding="utf-8"
    )
    rows = cells(studies.run(tmp_path / "rotor.yaml"), "Outputs")
    assert list(rows) == ["w [rad/s]", "angle [deg]", "rim_x [m]", "rim_y [m]", "drive [kW]"]
    assert rows["angle [deg]"][2] == pytest.approx(
        math.degrees(10.0 * math.pi * 0.04 + 0.04**2), rel=2e-4
    )
    assert scenes.read(tmp_path / "rotor.yaml").display.asked == ("deg", "m", "rad/s", "kW")


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("[mm, furlong]", "a unit such as mm, MPa or rpm, got 'furlong'"),
        ("[mm, rpm, m]", "one unit of each dimension, got 'mm' and 'm'"),
        ("3", "a name or a list of names"),
    ],
)
def test_units_that_are_none_are_refused(wrong: str, told: str) -> None:
    with pytest.raises(InputError, match=r"scene:3: display_units.*: expected") as caught:
        scenes.loads(SCENE.format(more=f"display_units: {wrong}\n"))
    assert told in str(caught.value)


def test_a_scene_without_units_has_prefixes_alone() -> None:
    plain = re.sub(r"(\d) (?:rpm|mm|ms|kg m\^2|N m|kg)", r"\1", SCENE.format(more=""))
    assert scenes.loads(plain).display == DisplayUnits()


def test_a_sweep_is_read_in_the_unit_of_its_range(tmp_path: Path) -> None:
    """Points from 100 to 600 rpm, responses in rpm, and files in rad/s."""
    (tmp_path / "rotor.yaml").write_text(SCENE.format(more=""), encoding="utf-8")
    shared: dict[str, Any] = {"samples": 6, "design": "grid", "workers": 1, "surfaces": True}
    found = studies.sweep(tmp_path / "rotor.yaml", out=tmp_path / "out", **shared)
    axes = found.figures["response"].axes[0]
    assert axes.get_ylabel() == "w [rpm]"
    assert [one.get_xlabel() for one in found.figures["response"].axes if one.get_xlabel()] == [
        "speed [rpm]"
    ]
    points = np.sort(np.asarray(axes.collections[0].get_offsets())[:, 0])
    np.testing.assert_allclose(points, [100.0, 200.0, 300.0, 400.0, 500.0, 600.0], rtol=1e-13)
    row = next(line for line in str(found).splitlines() if "w [rpm]" in line).split()
    assert [float(one) for one in row[2:4]] == pytest.approx(
        [100.0, 600.0 + 2.0 * 0.04 / RPM], rel=1e-4
    )
    surface = next(
        one for one in found.figures["surfaces"].axes if one.get_ylabel() == "w final [rpm]"
    )
    x, y = (np.asarray(one) for one in surface.lines[0].get_data())
    assert surface.get_xlabel() == "speed [rpm]"
    np.testing.assert_allclose(y, x + 2.0 * 0.04 / RPM, rtol=1e-3)
    fan = found.figures["histories"].axes[0]
    assert np.asarray(fan.lines[0].get_data()[0])[-1] == pytest.approx(40.0)  # ms
    with (tmp_path / "out" / "sweep.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    assert [float(row[head.index("speed [rad/s]")]) for row in rows] == pytest.approx(
        np.linspace(100.0, 600.0, 6) * RPM
    )
    studies.report(tmp_path / "out")
    text = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert ">speed [rpm]</button>" in text


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        ({"tip": "1 mm", "clamp": "5 %"}, "tip: 1 mm, clamp: 0.05 of the range"),
        ("0.2 mm", "0.2 mm"),
        ("2 %", "0.02 of the range"),
    ],
)
def test_an_accuracy_reads_as_typed_and_is_repeated_by_the_report(typed: Any, words: str) -> None:
    """What a report says can be given again."""
    found = accuracy.accuracy(typed, Context())
    assert str(found) == words
    call = shlex.split(
        folder_report.repeat("report.json", {"file": "a.yaml", "accuracy": {"wanted": words}})
    )
    again = call[call.index("--accuracy") + 1]
    pairs = [one.split("=") for one in again.split(", ")]
    assert accuracy.accuracy(dict(pairs) if "=" in again else again, Context()) == found
