"""Reports of folders in a real browser: every kind of study, tables that sort, commands that
repeat, texts that are no HTML.
"""

from __future__ import annotations

import json
import os
import shlex
from pathlib import Path

import pytest

from fmbs_skfem import studies
from fmbs_skfem.pages import report
from fmbs_skfem.studies import folder_report, reports

from ..browser import DRAWS, PROGRAM, browser
from ..cli.calls import EXAMPLES, fmbs
from .test_page import NASTY, SCENE, opened

in_browser = pytest.mark.skipif(PROGRAM is None and "CI" not in os.environ, reason="no Chromium")
FAMILY = f"""\
schema: 1
name: family
dimension: 2
parameters: {{E: {{value: 1 GPa, range: [0.8 GPa, 1.2 GPa]}}}}
bodies:
  arm:
    type: cable
    mesh: {EXAMPLES.parent / "meshes" / "beam_20.msh"}
    cells: 4
    section: {{shape: circular, diameter: 10 mm}}
    material: {{young_modulus: E, density: 1800 kg/m^3}}
joints: {{hinge: {{type: pin, at: arm.left}}}}
loads: {{weight: {{type: gravity, acceleration: [0, -9.81 m/s^2]}}}}
analysis: {{type: dynamic, duration: 0.05 s, step: 5 ms}}
outputs: {{tip: {{type: position, at: arm.right}}}}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run at a changed parameter, whose report has a warning of tags."""
    base = tmp_path_factory.mktemp("results")
    text = SCENE.replace("bodies:", "parameters: {m: 50 MPa}\nbodies:").replace(
        "young_modulus: 50 MPa", "young_modulus: m"
    )
    (base / "rod's.yaml").write_text(
        text.replace("duration: 0.5", "duration: 0.05"), encoding="utf-8"
    )
    done = fmbs(
        "run",
        base / "rod's.yaml",
        "--set",
        "m=60 MPa",
        "--duration",
        "0.1",
        "--out",
        base / "out",
        "--allow-outside",
    )
    assert done.code == 0, done.err
    path = base / "out" / "report.json"
    found = json.loads(path.read_text(encoding="utf-8"))
    del found[reports.CHECKSUMS]
    reports.write_report(path.parent, {**found, "notices": [NASTY]})
    return base / "out"


@in_browser
def test_a_report_of_a_run_is_whole(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "report.html"
    done = fmbs("report", folder, "--html", page, "--json")
    assert done.code == 0, done.err
    assert (
        "bodies are not shown" in done.json["notices"][0]
    )  # their mesh lies outside of the folder, which `report` does not allow
    with browser(tmp_path / "profile", DRAWS) as tab:
        opened(tab, page)
        assert tab.run("document.querySelector('.notices li').textContent") == NASTY
        headings = tab.run("[...document.querySelectorAll('h2')].map((one) => one.textContent)")
        assert headings == [
            "Warnings",
            "How to repeat it",
            "What was solved",
            "Pictures",
            "Provenance of report.json",
        ]
        assert tab.run("document.querySelectorAll('#plots polyline').length") == 3
        assert tab.run("document.querySelector('img').naturalWidth") > 300
        call = tab.run("document.querySelector('code').textContent")
        column = "[...document.querySelectorAll('table.sorts')[0].tBodies[0].rows].map((row) => Number(row.cells[2].dataset.value))"
        for _, order in ((0, 1), (1, -1)):
            tab.run(
                "document.querySelectorAll('table.sorts')[0].querySelectorAll('th button')[2].click()"
            )
            found = tab.run(column)
            assert found == sorted(found, reverse=order < 0)
        assert len(set(found)) > 1
        tab.resize(390)
        assert tab.run("document.documentElement.scrollWidth") <= 390
        assert tab.wrong == []
    again = tmp_path / "again"
    words = shlex.split(call)
    assert words[:2] == ["fmbs", "run"]
    monkeypatch.chdir(page.parent)  # files are named from the folder of the page
    assert fmbs(*words[1:], "--allow-outside", "--no-plots", "--out", again).code == 0
    assert (again / "outputs.csv").read_bytes() == (folder / "outputs.csv").read_bytes()


@in_browser
def test_reports_of_sweeps_checks_models_and_verification(tmp_path: Path) -> None:
    """One folder each; all in one browser."""
    scene = tmp_path / "family.yaml"
    scene.write_text(FAMILY, encoding="utf-8")
    calls = {
        "sweep": (
            "sweep",
            scene,
            "--samples",
            "3",
            "--design",
            "grid",
            "--workers",
            "1",
            "--no-plots",
        ),
        "check": ("check", scene),
        "verify": ("verify", "--case", "catenary-equations"),
    }
    wanted = {"sweep": "sweep.csv", "check": "check.json", "verify": "verification.json"}
    with browser(tmp_path / "profile", DRAWS) as tab:
        for name, call in calls.items():
            done = fmbs(
                *call, *([] if name == "verify" else ["--allow-outside"]), "--out", tmp_path / name
            )
            assert done.code == 0, done.err
            shown = fmbs("report", tmp_path / name)
            assert shown.code == 0, shown.err
            opened(tab, tmp_path / name / "report.html", 800, 900)
            assert wanted[name] in tab.run(
                "[...document.querySelectorAll('h2')].map((one) => one.textContent)"
            )
            assert tab.run("document.getElementById('stage').hidden")
            assert tab.run("document.documentElement.scrollWidth") <= 800
            assert tab.wrong == []
        assert tab.run("document.querySelectorAll('code')[0].textContent") == "fmbs verify"


@in_browser
def test_a_training_shows_its_model_and_is_reported(tmp_path: Path) -> None:
    """Its page runs the model at Young's moduli of the reader's choice; its report and that of a
    reduction have tables.
    """
    scene = tmp_path / "family.yaml"
    training = (
        "reduction: {snapshots: 5 ms}\ntraining: {candidates: 4, iterations: 2, holdout: 2}\n"
    )
    scene.write_text(FAMILY + training, encoding="utf-8")
    done = fmbs(
        "train",
        scene,
        "--html",
        "--allow-outside",
        "--no-plots",
        "--out",
        tmp_path / "trained",
        "--json",
    )
    assert done.code == 0, done.err
    assert str(tmp_path / "trained" / "page.html") in done.json["files"]
    assert fmbs("reduce", scene, "--allow-outside", "--out", tmp_path / "reduced").code == 0
    with browser(tmp_path / "profile", DRAWS) as tab:
        opened(tab, tmp_path / "trained" / "page.html")
        high = done.json["predicted_error"]["high"]
        about = tab.run("document.getElementById('about').textContent")
        assert f"{high:.2g} of their ranges" in about
        assert "At most, anywhere in its ranges: " in about
        assert f" to {high:.2g}." in about
        tab.run(
            "loadModel(fmbs.content.live).then((model) => { fmbs.attach(model); fmbs.state.model = model; })"
        )
        ends = []
        for value in (0.8e9, 1.2e9):
            move = f"bar.value = {value}; bar.dispatchEvent(new Event('input'));"
            tab.run(f"((bar) => {{ {move} }})(document.querySelector('#sliders input'))")
            tab.run(
                "(() => { for (let k = 0; k < 10; k++) fmbs.state.live.advance(0.005); fmbs.draw(); })()"
            )
            at, found = tab.run("[fmbs.state.live.time, [...fmbs.state.model.outputs()]]")
            run = studies.run_model(tmp_path / "trained" / "model.h5", parameters={"E": value})
            assert at == pytest.approx(0.05)
            assert found == pytest.approx(
                [run.outputs[f"tip_{axis}"][-1] for axis in "xy"], abs=1e-7
            )
            ends.append(found)
        assert abs(ends[0][1] - ends[1][1]) > 1e-6
        assert tab.wrong == []
        trained = "trained", "model.h5", "report.json", "fmbs train ../family.yaml"
        reduced = (
            "reduced",
            "family.h5",
            "family.h5",
            "fmbs reduce family.yaml --set E=1000000000.0 --tolerance 1e-12 --hyper 0.001",
        )
        for name, heading, record, call in (trained, reduced):
            told = fmbs("report", tmp_path / name)
            assert told.code == 0, told.err
            opened(tab, tmp_path / name / "report.html", 800, 900)
            headings = tab.run("[...document.querySelectorAll('h2')].map((one) => one.textContent)")
            assert {"How to repeat it", heading, "Provenance of " + record} <= set(headings)
            assert tab.run("document.querySelector('code').textContent") == call
            assert tab.run("document.querySelectorAll('table').length") > 3
            assert tab.run("document.documentElement.scrollWidth") <= 800
            assert tab.wrong == []


def test_a_report_is_for_others_to_read(tmp_path: Path) -> None:
    """Parameters are in the units of their scene, and files are named from the folder of the page,
    also in warnings.
    """
    scene, out = tmp_path / "family.yaml", tmp_path / "out"
    scene.write_text(FAMILY, encoding="utf-8")
    done = fmbs("check", scene, "--set", "E=1.1 GPa", "--allow-outside", "--out", out, "--json")
    assert done.code == 0, done.err
    record = json.loads((out / "check.json").read_text(encoding="utf-8"))
    record.pop(reports.CHECKSUMS)
    reports.write_report(out, {**record, "notices": [f"{scene}:7: bodies.arm: odd"]}, "check.json")
    assert fmbs("report", out).code == 0
    text = (out / "report.html").read_text(encoding="utf-8")
    assert "<td>E 1.1 GPa</td>" in text
    assert "<li>../family.yaml:7: bodies.arm: odd</li>" in text
    assert str(tmp_path) not in text.replace(str(EXAMPLES), "")


WRITTEN = {
    "status": "ok",
    "scene": "arm",
    "file": "arm.yaml",
    "end": 1.0,
    "units": {"t": "s", "tip": "m"},
    "outputs": {"tip": {"min": 0.0, "max": 1.0, "final": 1.0}},
    "notices": [],
    "provenance": {"file": "arm.yaml", "files": {}, "scene": {"analysis": {"duration": 1.0}}},
    "files": ["outputs.csv", "outputs.units.json"],
}


def results(folder: Path, **changes: object) -> Path:
    """A folder of a run, whose record has other values, and their checksum."""
    (folder / "outputs.csv").write_text("t,tip\n0,0\n1,1\n")
    (folder / "outputs.units.json").write_text('{"t": "s", "tip": "m"}')
    reports.write_report(folder, {**WRITTEN, **changes})
    return folder


def test_results_that_are_not_as_they_were_written_make_no_page(tmp_path: Path) -> None:
    """`report` and `view` read what `check` calls damaged as little as it does."""
    assert fmbs("report", results(tmp_path)).code == 0
    for name, content in (
        ("outputs.csv", "t,tip\n0,0\n1,2\n"),
        ("outputs.units.json", "{"),
        ("report.json", "[" * 100_000),
        ("outputs.units.json", '{"t": "\\ud800"}'),
    ):
        results(tmp_path)
        (tmp_path / name).write_text(content)
        for command in ("check", "report", "view"):
            done = fmbs(command, tmp_path, *(["--force"] if command != "check" else []))
            assert (done.code, f"{tmp_path / name}: expected " in done.err) == (8, True), (
                command,
                name,
                done.err,
            )


WRONG = {
    "notices": [None],
    "file": "a\0",
    "model": [1],
    "end": [[]],
    "units": 1.0,
    "outputs": {"tip": None},
    "parameter_units": {"E": [1]},
    "provenance": {"files": []},
}


@pytest.mark.parametrize("key", WRONG)
@pytest.mark.parametrize("command", ["report", "view"])
def test_records_with_values_of_another_kind_are_corrupt(
    command: str, key: str, tmp_path: Path
) -> None:
    done = fmbs(command, results(tmp_path, **{key: WRONG[key]}), "--force")
    assert (
        done.code,
        f"{tmp_path / 'report.json'}: expected a " in done.err,
        f" as {key}" in done.err,
    ) == (8, True, True), done.err


UNLIKE = {
    "accuracy": {"wanted": 1.0},
    "events": [{"name": "stop"}],
    "parameter_units": {"E": "Pa"},
}


@pytest.mark.parametrize("key", UNLIKE)
def test_records_without_what_their_readers_look_for_are_corrupt(key: str, tmp_path: Path) -> None:
    """Whichever part of the page reads it: the command that repeats it, its facts, its tables."""
    done = fmbs("report", results(tmp_path, **{key: UNLIKE[key]}), "--no-bodies")
    told = "report.json: expected a record as a study writes it" in done.err
    assert (done.code, told) == (8, True), done.err


@pytest.mark.parametrize("key", ["step", "cells", "wanted"])
def test_a_plan_of_another_kind_is_corrupt(key: str, tmp_path: Path) -> None:
    """What was found for an accuracy, with which a scene is run again for its page."""
    done = fmbs("view", results(tmp_path, accuracy={key: [1]}), "--no-open")
    assert (done.code, f" as accuracy.{key}, got " in done.err) == (8, True), done.err


def test_outputs_without_a_title_are_corrupt(tmp_path: Path) -> None:
    results(tmp_path, files=[])
    (tmp_path / "outputs.csv").write_text("")
    done = fmbs("report", tmp_path, "--no-bodies")
    assert (done.code, "expected a table with titles" in done.err) == (8, True), done.err


def test_outputs_that_are_no_numbers_are_reported(tmp_path: Path) -> None:
    """The balance of energy of an equilibrium: files have null for it, and pages a dash."""
    ends = {"min": None, "max": None, "final": None}
    columns = {"output_columns": {"tip": ["tip"]}, "round_off": [], "labels": {}}
    done = fmbs("report", results(tmp_path, outputs={"tip": ends}, **columns), "--no-bodies")
    assert done.code == 0, done.err
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<td>tip [m]</td><td>-</td><td>-</td><td>-</td>" in text


def test_a_record_of_what_no_scene_made_is_reported(tmp_path: Path) -> None:
    """Of the exact cases, and of a saved model."""
    results(tmp_path, provenance={"file": None, "files": {}, "scene": None})
    done = fmbs("report", tmp_path)
    assert done.code == 0, done.err


def test_a_table_of_somebody_else_is_named_where_it_is_no_text(tmp_path: Path) -> None:
    (results(tmp_path) / "measured.csv").write_bytes(b"t,Kr\xe4fte\n0,1\n")
    done = fmbs("report", tmp_path)
    assert (done.code, "measured.csv: expected a table of text in UTF-8" in done.err) == (3, True)


def test_a_table_with_rows_of_other_lengths_is_named(tmp_path: Path) -> None:
    """Lines without any cell, as at the end of files of other programs, are no rows."""
    table = results(tmp_path) / "measured.csv"
    table.write_text("\na,b\n1,2\n\n")
    assert fmbs("report", tmp_path, "--no-bodies").code == 0
    table.write_text("a,b\n1,2\n1,2,3\n")
    done = fmbs("report", tmp_path, "--no-bodies", "--force")
    told = "measured.csv: expected 2 cells in every row, as there are titles, got 3 in row 2"
    assert (done.code, told in done.err) == (3, True), done.err


def test_a_folder_without_results_is_refused(tmp_path: Path) -> None:
    assert "no report in it" in fmbs("report", tmp_path).err
    (tmp_path / "report.json").write_text("{", encoding="utf-8")
    assert fmbs("report", tmp_path).code == 8
    assert "a folder of results" in fmbs("report", tmp_path / "none").err


def test_texts_are_escaped_wherever_they_stand() -> None:
    pieces = (
        report.section(
            NASTY, report.notices([NASTY]), report.code(NASTY), report.hidden(NASTY, NASTY)
        ),
        report.table(NASTY, [NASTY], [[NASTY], [{NASTY: NASTY}], [[NASTY]]]),
        report.facts(
            NASTY, {NASTY: NASTY, "many": [{NASTY: NASTY}], "named": {NASTY: {NASTY: NASTY}}}
        ),
        report.picture(NASTY, ".png", b"1"),
    )
    for text in pieces:
        assert "<b>" not in text
        assert "<!--" not in text
        assert "</script>" not in text
        assert "it's" not in text


def test_nested_values_become_tables() -> None:
    text = report.facts(
        "", {"plain": 1.5, "list": [1, 2], "rows": [{"a": 1, "b": None}, {"a": 2, "c": True}]}
    )
    assert text.count("<table") == 2
    assert "<td>1; 2</td>" in text
    assert '<td class=number data-value="2">2</td>' in text
    assert "<td>yes</td>" in text


def test_tables_within_tables_stand_behind_them() -> None:
    """Errors of outputs by model: a row a model, and what is nested opens below, by the name of its
    row.
    """
    models = [
        {"name": name, "cpu_s": 1.0, "outputs": {"tip": {"error": 1e-3, "unit": "m"}}}
        for name in ("full", "reduced")
    ]
    text = report.facts("", {"models": models})
    assert text.count("<table") == 3
    assert "<summary>models: outputs</summary>" in text
    assert text.index("<details>") > text.index("</table>")


def test_a_comparison_is_repeated_as_it_was_made() -> None:
    told = {
        "file": None,
        "quick": True,
        "truth": "a run of 80 cells",
        "provenance": {"file": "my scene.yaml"},
        "parameters": {"E": 2e9},
    }
    assert (
        folder_report.repeat("compare.json", told)
        == "fmbs compare 'my scene.yaml' --quick --true --set E=2000000000.0"
    )
