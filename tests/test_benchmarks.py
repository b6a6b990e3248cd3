"""Every benchmark script runs at its smallest size and writes what it should."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from fmbs_skfem.dynamics import integration, run

from .clocks import wind
from .shortened import shorten_examples

FOLDER = Path(__file__).resolve().parents[1] / "benchmarks"


def script(name: str, results: Path, monkeypatch: pytest.MonkeyPatch, **smaller: Any) -> ModuleType:
    """A benchmark as a module that writes into `results`, with smaller sizes."""
    monkeypatch.syspath_prepend(str(FOLDER))  # some import others
    spec = importlib.util.spec_from_file_location(f"benchmark_{name}", FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    if hasattr(module, "RESULTS"):
        monkeypatch.setattr(module, "RESULTS", results)
    for key, value in smaller.items():
        assert hasattr(module, key)
        monkeypatch.setattr(module, key, value)
    return module


def test_full_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wind(monkeypatch, integration, run)
    rows = script("full_models", tmp_path, monkeypatch, STEPS=1700, FINER=2).main(1)
    assert {row.example for row in rows} == {"spin_up", "double_pendulum"}
    assert all(row.cpu_s > 0.0 for row in rows)
    assert (tmp_path / "full_models.md").read_text(encoding="utf-8").startswith("# ")


@pytest.mark.parametrize(
    "name",
    [
        "resting",
        "switched_off",
        "corners",
        "with_a_mass",
        "rigid_pendulum",
        "free_flight",
        "quintic",
        "energy",
        "hum",
        "pulse",
        "many_swings",
        "drive_torque",
        "sliding_block",
    ],
)
def test_accuracy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """What is promised is kept, beside four times the cells and steps.

    Scenes at rest, forces off the grid, corners; a force that repeats as often as the first steps,
    one that is shorter than they are, forty swings, moments at a place inside of cells; what slides
    and lifts off, compared at the ends of all steps.
    """
    rows = script("accuracy", tmp_path, monkeypatch).main([name], [1e-2])
    assert len(rows) == 1
    assert rows[0].why_not == ""
    assert rows[0].true <= 1.0
    assert (tmp_path / "accuracy.md").read_text(encoding="utf-8").startswith("# ")


@pytest.mark.parametrize("name", ["released_between", "bent_moments"])
def test_promises(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """A force that is let go between the ends of steps, and moments of an equilibrium: every `+-`
    holds.
    """
    (one,) = script("promises", tmp_path, monkeypatch).main([name], [1e-2])
    assert one.met
    assert one.true <= 1.0
    assert one.held == one.columns == 4
    assert "1 of which are promised: 1 are kept" in (tmp_path / "promises.md").read_text(
        encoding="utf-8"
    )


def test_the_cheapest_run_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (row,) = script("accuracy", tmp_path, monkeypatch).main(["pendulum"], [1e-3], try_all=True)
    assert row.cheapest is not None
    assert 1.0 < row.over_cheapest < 4.0  # three cells and 300 steps are enough
    assert "times the work of the cheapest" in (tmp_path / "accuracy.md").read_text(
        encoding="utf-8"
    )


def test_time_to_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Our own runs stand in place of Exudyn's."""
    module = script(
        "time_to_error",
        tmp_path,
        monkeypatch,
        WANTED=(1e-2,),
        MESHES=(4, 16),
        STEPS=(200, 400, 6400),
    )
    scenes = dict(module.written(module.SCENES, tmp_path))

    def same(name: str, settings: Any, duration: float) -> tuple[float, Any]:
        pilots = module.ScenePilots(module.wanting(scenes[name], 1e-4))
        return module.own_run(pilots, settings.elements, settings.steps)

    monkeypatch.setattr(module, "exudyn_run", same)
    monkeypatch.setattr(module, "exudyn_version", lambda: "0")
    (row,) = module.main(1, ["tip_mass"])
    assert row.error <= 1.0
    assert row.exudyn_error <= 1.0
    assert (tmp_path / "time_to_error.md").read_text(encoding="utf-8").count("| tip_mass |") == 1


def test_beams_to_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Our own runs stand in place of Exudyn's."""
    sizes = {
        "WANTED": (1e-2,),
        "CELLS": (4,),
        "ELEMENTS": (4,),
        "STEPS": (200, 400, 800),
        "OURS": (6, 800),
        "THEIRS": (8, 800),
    }
    module = script(
        "beams_to_error", tmp_path, monkeypatch, **sizes, NEWTON=(1e-8,), PROBE=400, EACH=4
    )
    monkeypatch.setattr(
        module,
        "exudyn_run",
        lambda frame, cells, steps, way: module.our_run(frame, cells, steps, 1e-8),
    )
    monkeypatch.setattr(module, "exudyn_version", lambda: "0")
    (row,) = module.main(1, ["driven_shaft"])
    assert row.ours[3] <= 1e-2
    assert row.theirs[3] <= 1e-2
    assert (tmp_path / "beams_to_error.md").read_text(encoding="utf-8").count(
        "| driven_shaft |"
    ) == 1


def test_linkage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All kinds of bodies have one stress."""
    rows = script("linkage", tmp_path, monkeypatch, CELLS=4, STEPS=200, DURATION=0.2).main(0)
    assert len(rows) == 4
    assert all(abs(row.error) < 0.1 for row in rows if row.error is not None)
    assert (tmp_path / "linkage.md").read_text(encoding="utf-8").startswith("# ")


def test_contacts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Landing takes place after 0.2 s on a floor that is near; the reduced model follows."""
    rows = script(
        "contacts", tmp_path, monkeypatch, DURATION=0.3, REPEATS=1, NEAR=-0.2, CELLS=(10,)
    ).main(10)
    assert [row.model.split(",")[0] for row in rows] == ["full"] * 3 + ["reduced"]
    assert rows[2].iterations > rows[0].iterations
    assert rows[3].difference < 0.05
    assert (tmp_path / "contacts.md").exists()


def test_many(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = script("many", tmp_path, monkeypatch, DURATION=0.1).main(2)
    assert [row.difference for row in rows] == [0.0, 0.0]
    assert (tmp_path / "many.md").exists()


def test_large_plates(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = script("large_plates", tmp_path, monkeypatch).main([6], 4)
    assert text == (tmp_path / "large_plates.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) > 4


def test_snnls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (figures,) = script("snnls", tmp_path, monkeypatch, CASES=((20, 6, 30, 1e-3),)).main()
    assert figures.residual <= 1e-3


def test_stability(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["stability.py"])
    script("stability", tmp_path, monkeypatch, TRAINING=0.2, HORIZON=2, CELLS=25).main()
    assert "|" in capsys.readouterr().out


def test_paper(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With scenes of a tenth of the time; published figures stand beside ours."""
    shorten_examples(tmp_path)
    reports = script("paper", tmp_path, monkeypatch, ROOT=tmp_path).main(["double_pendulum"])
    assert reports["double_pendulum"]["status"] == "ok"
    assert (tmp_path / "compare_double_pendulum.png").exists()
    text = capsys.readouterr().out
    wanted = (
        "Table 1",
        "Table 2",
        "Table 3",
        "33+32",
        "5.506",
        "0.709",
        "7.76",
        "2.348e-03",
        "8.84",
        "0.1685+0.1344",
    )
    for one in (*wanted, "10.1016/j.cma.2019.112690"):
        assert one in text, one


def test_greedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (row,) = script("greedy", tmp_path, monkeypatch).main("spin_up", every=1000)
    assert row.name == "spin_up"


def test_sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With scenes of a tenth of the time."""
    shorten_examples(tmp_path)
    module = script(
        "sweep", tmp_path, monkeypatch, EXAMPLES=tmp_path / "examples", CALLS=2, STEPS=(50,)
    )
    assert "| tolerance 1e-4 | 50 |" in module.main(3, workers=1)


def test_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = script("parts", tmp_path, monkeypatch)
    found = module.example_2(0.1 / 3.0, 8, 1)
    assert found["error part, hung at the other end [m]"] < 1e-4
    assert module.chain(0.025, 3, 8)["error part"] < 1e-4


def test_control(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = script("control", tmp_path, monkeypatch, STEPS=200, TIMES=1, CELLS=(50,)).main()
    assert text == (tmp_path / "control.md").read_text(encoding="utf-8")
    assert "run.step" in text


def test_freeze(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Answers of two runs agree but for times; another number, word or key is listed with its
    place.
    """
    module, names = (
        script("freeze", tmp_path, monkeypatch),
        ["check.plate_modes", "run.plate_modes", "refused.command"],
    )
    for folder in ("before", "after"):
        module.freeze(tmp_path / folder, names)
    assert not module.compare(tmp_path / "before", tmp_path / "after")
    run, refused = (tmp_path / "after" / f"{name}.json" for name in names[1:])
    found = json.loads(run.read_text(encoding="utf-8"))
    assert found["exit"] == 0
    assert set(found["files"]) == {"modes.csv", "report.json"}
    found["files"]["modes.csv"]["lines"] += 1
    found["out"]["dofs"] *= 1.0 + 2e-9
    found["out"]["added"] = {"tip": "m"}
    found["out"]["cpu_s"] = 1e9
    run.write_text(json.dumps(found), encoding="utf-8")
    refused.write_text(
        refused.read_text(encoding="utf-8").replace("did you mean", "perhaps"), encoding="utf-8"
    )
    capsys.readouterr()
    assert module.compare(tmp_path / "before", tmp_path / "after")
    assert [line.split(":")[0] for line in capsys.readouterr().out.splitlines()] == [
        ".refused.command.err[3]",
        ".run.plate_modes.out.dofs",
        ".run.plate_modes.out.added",
        ".run.plate_modes.files.modes.csv.lines",
    ]


def test_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Docstrings, comments and blank lines do not count; other strings do, with all their lines."""
    text = '"""About\n\nit."""\n\n# why\nx = """a\nb"""\n\n\ndef f():\n    """What."""\n    return x  # this\n'
    (tmp_path / "core").mkdir()
    (tmp_path / "core" / "a.py").write_text(text, encoding="utf-8")
    (tmp_path / "b.py").write_text("x = 1\n", encoding="utf-8")
    rows = [
        line.split() for line in script("lines", tmp_path, monkeypatch).main(tmp_path).splitlines()
    ]
    assert [rows[0], rows[1], rows[-1]] == [
        ["core", "1", "4"],
        ["engine", "1", "4"],
        ["all", "2", "5"],
    ]


def test_families(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = script("families", tmp_path, monkeypatch).main(("spin_up",))
    assert [one.family for one in found] == ["spin_up"]
    assert found[0].training_s > found[0].full_s > 0.0
    assert found[0].pays == (found[0].error is not None and found[0].speedup >= 1.5)
    table = (tmp_path / "families.md").read_text(encoding="utf-8")
    assert found[0].words in table
