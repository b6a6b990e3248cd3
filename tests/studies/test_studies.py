"""Studies from Python: arrays and figures come back, nothing is written without a folder, errors
carry what there is.
"""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from matplotlib.figure import Figure

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError, SolverError, SweepFailure
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.families import members
from fmbs_skfem.results import sweep_files

from .. import pages
from ..cli.calls import EXAMPLES, fmbs, scene
from ..shortened import shorten_examples

SHORT = "{type: dynamic, duration: 10 ms, step: 1 ms}"
JUMP = "where(t < 0.0055, 1, 1e12)"
STUDIES = (
    "run",
    "resume",
    "render",
    "export",
    "check",
    "reduce",
    "train",
    "run_model",
    "train_part",
    "describe_part",
    "check_part",
    "info",
    "sweep",
    "compare",
    "demo",
    "verify",
)


def test_a_run_gives_arrays_and_figures_and_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = scene(tmp_path, SHORT)
    before = set(tmp_path.iterdir())
    monkeypatch.chdir(tmp_path)
    found = studies.run(path)
    assert found.times == pytest.approx(np.linspace(0.0, 0.01, 11))
    assert set(found.outputs) == {"tip_x", "tip_y", "clamp_x", "clamp_y", "clamp_slope_1"}
    assert all(values.shape == (11,) for values in found.outputs.values())
    assert found.trajectory.x.shape[0] == 11
    assert found.report["outputs"]["tip_y"]["final"] == found.outputs["tip_y"][-1]
    assert isinstance(found.figures["outputs"], Figure)
    assert list(found.figures) == ["outputs"]
    assert repr(found) == f"<Run cantilever: 11 instants, {', '.join(found.outputs)}>"
    assert "\nOutputs\n" in str(found)
    assert found.files == []
    assert set(tmp_path.iterdir()) == before


def test_a_folder_gets_what_the_command_writes(tmp_path: Path) -> None:
    """The same numbers and files; only times and places differ."""
    path = scene(tmp_path, SHORT)
    found = studies.run(path, out=tmp_path / "python", parameters={"load": 0.25})
    done = fmbs("run", path, "--out", tmp_path / "command", "--set", "load=0.25 N", "--json")
    assert done.code == 0, done.err
    ours, theirs = (
        {file.name for file in (tmp_path / name).iterdir()} for name in ("python", "command")
    )
    assert ours == theirs == {file.name for file in found.files}
    table = np.loadtxt(tmp_path / "command" / "outputs.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(
        np.column_stack([found.times, *found.outputs.values()]), table, rtol=1e-12, atol=1e-15
    )
    assert set(done.json) == set(found.report)
    assert studies.checksums(tmp_path / "python").report["status"] == "ok"


def test_vibration_modes_have_frequencies_and_no_motion(tmp_path: Path) -> None:
    found = studies.run(scene(tmp_path, "{type: modes, count: 2}"))
    assert found.frequencies.shape == (2,)
    assert found.report["frequencies_hz"] is found.frequencies
    with pytest.raises(InputError, match="vibration modes"):
        _ = found.trajectory


def test_a_scene_may_be_given_as_it_was_read(tmp_path: Path) -> None:
    path = scene(tmp_path, SHORT)
    mine = scenes.read(path, {"load": "0.1 N"})
    assert (
        studies.run(mine).outputs["tip_y"][-1]
        == studies.run(path, parameters={"load": 0.1}).outputs["tip_y"][-1]
    )
    with pytest.raises(InputError, match="read it with them"):
        studies.run(mine, parameters={"load": 1.0})


def test_a_failed_solve_carries_what_it_reached(tmp_path: Path) -> None:
    with pytest.raises(SolverError) as caught:
        studies.run(scene(tmp_path, SHORT, JUMP))
    found = caught.value.result
    assert isinstance(found, studies.Run)
    assert found.times[-1] == pytest.approx(0.005)
    assert found.report["status"] == "error"
    assert found.error is caught.value


def test_a_listener_hears_progress_and_notices(tmp_path: Path) -> None:
    heard: list[tuple[str, float]] = []
    notices: list[str] = []
    listener = studies.Listener(
        progress=lambda label, part: heard.append((label, part)), notice=notices.append
    )
    path = EXAMPLES / "four_bar.yaml"
    found = studies.check(path, parameters={}, listener=listener)
    studies.run(scene(tmp_path, SHORT), listener=listener)
    assert heard[0] == ("integrating", 0.0)
    assert heard[-1] == ("integrating", 1.0)
    assert found.report["notices"] == notices


def test_notices_are_warnings_where_nobody_listens(tmp_path: Path) -> None:
    path = scene(tmp_path, "{type: dynamic, duration: 10.5 ms, step: 1 ms}")
    with pytest.warns(Notice, match="no whole number of steps"):
        found = studies.run(path)
    assert len(found.report["notices"]) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(Notice):
            studies.run(path, listener=studies.Listener(strict=True))


def test_members_that_fail_leave_the_others(tmp_path: Path) -> None:
    path = scene(tmp_path, SHORT, "where(load < 1, 1, where(t < 0.0055, 1, 1e12))")
    with pytest.raises(SweepFailure, match="1 of 2 samples failed") as caught:
        studies.sweep(
            path,
            samples=2,
            design="grid",
            scheduler=ThreadPoolExecutor(1),
            ranges={"load": ("0.5 N", "2 N")},
        )
    found = caught.value.result
    assert found.points[:, 0] == pytest.approx([0.5, 2.0])
    assert np.isfinite(found.outputs["tip_y"][0]).all()
    assert np.isnan(found.outputs["tip_y"][1]).all()


def test_what_limits_a_run_needs_a_folder_to_go_on_from(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a folder for the results"):
        studies.run(scene(tmp_path, SHORT), time_limit=1.0)


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_takes_the_shared_options_and_explains_itself(name: str) -> None:
    study = getattr(studies, name)
    assert name in studies.__all__
    assert set(
        get_args(inspect.signature(study).parameters["shared"].annotation)[0].__annotations__
    ) >= {
        "out",
        "force",
        "listener",
    }
    assert study.__doc__


def test_the_door_opens_without_what_is_behind_it() -> None:
    code = "import sys; from fmbs_skfem import studies; print(sorted({'numba', 'scipy', 'matplotlib', 'numpy'} & set(sys.modules)))"
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.strip()
        == "[]"
    )


def test_the_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """docs/python.md, block after block."""
    shorten_examples(tmp_path)
    monkeypatch.chdir(tmp_path)
    names = pages.run("docs/python.md")
    assert "integrating: 100%" in capsys.readouterr().out
    stiff = names["stiff"]
    assert isinstance(stiff, studies.Run)
    assert {path.name for path in stiff.files} == {
        "outputs.csv",
        "outputs.units.json",
        "report.json",
        "outputs.png",
    }
    assert all(path.is_file() for path in stiff.files)
    assert json.loads((tmp_path / "family" / "report.json").read_text())["status"] in (
        "ok",
        "no promise",
    )
    assert names["pendulum"].size > 400


SWING = """\
schema: 1
dimension: 2
parameters: {k: {value: 100 N/m, range: [80 N/m, 160 N/m]}}
bodies: {mass: {type: point_mass, mass: 1 kg, position: [0, 0]}}
loads:
  spring: {type: spring_damper, at: mass, to: [-1 m, 0], stiffness: k}
  push: {type: point_force, at: mass, force: [2 N, 0]}
analysis: {type: dynamic, duration: 0.8 s, step: 1 ms}
outputs: {mass: {type: position, at: mass}}
"""


@pytest.mark.filterwarnings("ignore:scene.*no joint ties")
def test_extremes_of_a_sweep_are_those_between_its_instants(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mass that is pushed against a spring goes to 2 F / k, however few instants are stored.

    Where memory has room for fewer steps a warning says so, also of samples that were there before.
    """
    swing, told = scenes.loads(SWING), "one step in 6 or of the stored instants"
    with ThreadPoolExecutor(2) as pool:
        found = studies.sweep(swing, samples=5, design="grid", instants=2, scheduler=pool)
        monkeypatch.setattr(members, "NUMBERS", 800)
        with pytest.warns(Notice, match=told):
            coarse = studies.sweep(
                swing, samples=2, design="grid", instants=2, scheduler=pool, out=tmp_path
            )
        with pytest.warns(Notice, match=told):
            again = studies.sweep(
                swing,
                samples=2,
                design="grid",
                instants=2,
                scheduler=pool,
                out=tmp_path,
                resume=True,
            )
    assert found.outputs["mass_x"].shape == (5, 2)
    largest = sweep_files.extremes(found.samples, "mass_x")["max"]
    assert largest == pytest.approx(4.0 / found.points[:, 0], rel=2e-5)
    assert found.outputs["mass_x"][0].max() < 0.2 * largest[0]
    assert found.report["outputs"]["mass_x"]["max"]["max"] == largest.max()
    assert sweep_files.extremes(coarse.samples, "mass_x")["max"] == pytest.approx(
        4.0 / coarse.points[:, 0], rel=1e-3
    )
    assert again.report["computed"] == 0
    assert (tmp_path / "sweep.csv").read_text().count("ok") == 2


@pytest.mark.filterwarnings("ignore:scene.*no joint ties")
def test_a_sweep_over_a_table_that_is_named_by_a_text(tmp_path: Path) -> None:
    (table := tmp_path / "points.csv").write_text("k [N/mm]\n0.1\n0.125\n")
    with ThreadPoolExecutor(1) as pool:
        found = studies.sweep(scenes.loads(SWING), table=str(table), scheduler=pool)
    assert found.points == pytest.approx(np.array([[100.0], [125.0]]))
    columns = found.table()
    assert columns["k [N/m]"] == pytest.approx([100.0, 125.0])
    assert columns["mass_x max [m]"] == pytest.approx([0.04, 0.032], rel=2e-5)
    run = studies.run(scenes.loads(SWING, parameters={"k": 100.0}))
    assert columns["mass_x final [m]"][0] == run.table()["mass_x [m]"][-1]


@pytest.mark.filterwarnings("ignore:scene.*no joint ties")
def test_statistics_of_outputs_over_the_parameters_of_a_sweep(tmp_path: Path) -> None:
    """x = F / k (1 - cos w t) over k, of its stored steps; what is no statistic stops before
    anything runs, what is no output is left out with a warning.
    """
    wanted = {"mass_x": ["rms", "range"], "mass_u": ["mean"]}
    with ThreadPoolExecutor(1) as pool:
        with pytest.warns(Notice, match="'mass_u'; did you mean 'mass_"):
            found = studies.sweep(
                scenes.loads(SWING),
                samples=2,
                design="grid",
                scheduler=pool,
                statistics=wanted,
                out=tmp_path,
            )
        with pytest.raises(InputError, match="one of min, max, final, range, mean, rms, got 'rsm'"):
            studies.sweep(scenes.loads(SWING), samples=2, statistics={"mass_x": ["rsm"]})
        with pytest.raises(InputError, match="a column of mass, got 'mas_x'; did you mean 'mass'"):
            studies.sweep(scenes.loads(SWING), samples=2, statistics={"mas_x": ["rms"]})
    columns = found.table()
    for k, values in enumerate(found.outputs["mass_x"]):
        times = found.times[k]
        rms = np.sqrt(np.trapezoid(values**2, times) / times[-1])
        assert columns["mass_x rms [m]"][k] == pytest.approx(rms, rel=1e-3)
        assert columns["mass_x range [m]"][k] == pytest.approx(np.ptp(values), rel=1e-3)
    assert (tmp_path / "statistics.png").stat().st_size > 5000
    assert "mass_x rms [m]" in (tmp_path / "sweep.csv").read_text()
