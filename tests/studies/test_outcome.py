"""What people ask of a run: a short text, a table with units, a plot, bodies to look at, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.studies.result import ReportTable

from ..cli.calls import scene

SHORT = "{type: dynamic, duration: 10 ms, step: 1 ms}"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> studies.Run:
    found: studies.Run = scenes.read(scene(tmp_path_factory.mktemp("run"), SHORT)).run()
    return found


def test_a_scene_runs_and_says_little(run: studies.Run) -> None:
    assert isinstance(run, studies.Run)
    assert len(repr(run)) < 200
    assert (
        repr(run.trajectory)
        == f"<Trajectory 11 instants from 0 to 0.01, {run.trajectory.x.shape[1]} unknowns>"
    )
    assert len(repr(run.trajectory.system)) < 200
    assert "<td>tip_x [mm]</td>" in run._repr_html_()


def test_a_table_has_units(run: studies.Run) -> None:
    table = run.table()
    assert list(table)[:3] == ["t [s]", "tip_x [m]", "tip_y [m]"]
    np.testing.assert_array_equal(table["tip_y [m]"], run.outputs["tip_y"])
    assert isinstance(run.plot(), Figure)


def test_bodies_are_blocks(run: studies.Run) -> None:
    found = run.view()
    assert found.keys() == ["beam"]
    tip = found["beam"].points[-1]
    np.testing.assert_allclose(
        tip[:2], [run.outputs["tip_x"][-1], run.outputs["tip_y"][-1]], atol=1e-12
    )
    assert np.abs(run.view(0.0)["beam"]["displacement"]).max() == 0.0


def test_files_are_written_once(run: studies.Run, tmp_path: Path) -> None:
    names = {path.name for path in run.save(tmp_path / "out")}
    assert names == {"outputs.csv", "outputs.units.json", "report.json", "outputs.png"}
    assert studies.checksums(tmp_path / "out").report["status"] == "ok"
    with pytest.raises(InputError, match="force=True"):
        run.save(tmp_path / "out")


def test_modes_have_a_table_and_fields(tmp_path: Path) -> None:
    found = studies.run(scene(tmp_path, "{type: modes, count: 2, about: reference}"))
    assert found.table()["frequency_hz [Hz]"] == pytest.approx(found.frequencies)
    assert np.linalg.norm(found.view()["beam"]["mode_2"], axis=1).max() == pytest.approx(1.0)
    with pytest.raises(InputError, match="draw modes with fmbs render"):
        found.plot()


def test_wide_tables_cut_no_digit() -> None:
    values = [10.559591 + number for number in range(16)]
    text = str(
        ReportTable(
            "wide", ["row", *(f"frequency {number}" for number in range(16))], [["1", *values]]
        )
    )
    assert "…" not in text
    found = text.split()
    assert all(f"{value:.6g}" in found for value in values)
