"""Tables of time: lines and smooth curves, units of files, what is refused; in scenes, forces and histories."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.core.compiling import curves
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.tables import Table, read_columns
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import eliminate

CSV = "\ufefftime [ms], force [kN], turn [deg]\n0, 0, 0\n\n500, 1e-3, 90\n1000, 1e-3, 180\n2000, -3e-3, 180\n"


def test_lines_and_smooth_curves() -> None:
    """Lines are exact on lines; the smooth curve goes through the points, overshoots nowhere and has no kinks."""
    t = np.linspace(-1, 4, 501)
    lines = Table("f(t)", "N", (0.0, 1.0, 3.0), (0.0, 2.0, 2.0))
    assert_allclose(lines(t), np.clip(2 * t, 0, 2), atol=1e-14)
    smooth = Table("f(t)", "N", (0.0, 1.0, 3.0), (0.0, 2.0, 2.0), True)
    assert_allclose(smooth(np.array([0.0, 1.0, 3.0])), [0.0, 2.0, 2.0], atol=1e-14)
    assert smooth(t).max() <= 2.0 + 1e-14
    inside = smooth(np.linspace(0.0, 3.0, 3001))
    assert np.abs(np.diff(inside, 2)).max() < 1e-5


def test_files_have_units(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(CSV, encoding="utf-8")
    assert read_columns(path, ("", ""), "N") == ((0.0, 0.5, 1.0, 2.0), (0.0, 1.0, 1.0, -3.0))
    assert_allclose(read_columns(path, ("time", "turn"), "rad")[1], [0, np.pi / 2, np.pi, np.pi])
    path.write_text("time, force [N]\n0, 0\n500, 2", encoding="utf-8")
    assert read_columns(path, ("", ""), "kN", "ms") == ((0.0, 0.5), (0.0, 2.0))
    path.write_text("time, force\n0, 0\n500, 2", encoding="utf-8")
    assert read_columns(path, ("", ""), "kN", "ms") == ((0.0, 0.5), (0.0, 2000.0))
    assert read_columns(path, ("", ""), "N") == ((0.0, 500.0), (0.0, 2.0))
    path.write_text("time, x[1] [mm], force\n0, 5, 1\n2, 5, 3", encoding="utf-8")
    assert read_columns(path, ("time", "force"), "N") == ((0.0, 2.0), (1.0, 3.0))
    assert read_columns(path, ("time", "x[1]"), "m")[1] == (0.005, 0.005)


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("kN", "kg", r"expected a force \[N\], got '1 kg'"),
        ("500,", "5x0,", r"row 3: expected a number in column 1, got '5x0'"),
        ("500, 1e-3", "500", r"expected"),
        ("time [ms], force [kN], turn [deg]", "0", r"expected a first line of titles"),
        ("time [ms], force [kN], turn [deg]\n", "", r"expected a first line of titles, such as .*, got '0,0,0'"),
        ("time [ms], force [kN], turn [deg]", "time [ms];force [kN]", r"columns separated by commas, got semicolons in 'time"),
    ],
)
def test_bad_files(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(CSV.replace(old, new).replace(", 90", "" if new == "500" else ", 90"), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_columns(path, ("time", "turn" if new == "500" else "force"), "rad" if new == "500" else "N")
    with pytest.raises(InputError, match=r"one of the columns time, force, turn, got 'fore'; did you mean 'force'|titles|commas"):
        read_columns(path, ("", "fore"), "N")


@pytest.mark.parametrize(
    "text, message",
    [
        (
            "t, F\n0, " + 140000 * "1",
            r"a.csv, line 2: expected cells of comma-separated values, got field larger .*; close every quote",
        ),
        ("t [s], F [N]\n0,5,1,5\n", r"row 2: expected 2 cells, one under each title, got 4; numbers are written with points"),
        ("t, F, F\n0, 1, 2\n", "expected one of the columns t, F, F, got 'F' 2 times"),
        ("t (ms), F\n0, 1\n", r"expected the unit of a title in brackets, such as '... \[ms\]', got 't \(ms\)'"),
        ("t_ms, F\n0, 1\n", r"'... \[ms\]', got 't_ms'"),
        ("t, F / kN, F\n0, 1, 2\n", ""),
        ("t in s, F (2)\n0, 1\n", ""),
    ],
)
def test_numbers_and_units_that_would_be_read_as_others_are_refused(tmp_path: Path, text: str, message: str) -> None:
    """Commas in numbers, two columns of one title, units that are not in brackets and not those of SI."""
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    columns = ("", "F (2)" if "F (2)" in text else "F")
    if not message:
        assert read_columns(path, columns, "N")[0] == (0.0,)
        return
    with pytest.raises(InputError, match=message):
        read_columns(path, columns, "N")


def test_bad_points() -> None:
    with pytest.raises(InputError, match="growing times"):
        Table("f(t)", "N", (0.0, 1.0, 1.0), (0.0, 2.0, 2.0))
    with pytest.raises(InputError, match="a value for each time"):
        Table("f(t)", "N", (0.0, 1.0), (0.0,))


SCENE = """
schema: 1
dimension: 2
tables: {pull: {file: a.csv, unit: N}, turn: {file: a.csv, value: turn, unit: rad, smooth: true}}
bodies: {ball: {type: point_mass, mass: 2 kg, position: [0, 0]}}
loads:
  f: {type: control_force, at: ball, direction: [1, 0], force: "pull(t) - 0 N s/m * ball.vx"}
  g: {type: point_force, at: ball, force: [0 N, 3 N], history: cos(turn(t))}
analysis: {type: dynamic, duration: 1 s, step: 5 ms}
outputs: {ball: {type: position, at: ball}}
"""


def test_scenes(tmp_path: Path) -> None:
    """x = t^3 / 6 up to 0.5 s, under 1 N after it; saved models have their tables."""
    (tmp_path / "a.csv").write_text(CSV, encoding="utf-8")
    system = build.system(reading.loads(SCENE, tmp_path))
    t, v, x = 0.5, 0.125, 1 / 48
    for one in (system, files.load(files.save(eliminate(system), tmp_path / "model.h5"))):
        found = outputs(integrate(one, GeneralizedAlpha(5e-3), 1.0))
        assert found["ball_x"][100] == pytest.approx(x, abs=2e-6)
        assert found["ball_x"][-1] == pytest.approx(x + v * t + t**2 / 4, abs=4e-6)
        assert found["ball_y"].max() > 0.1


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("duration: 1 s", "duration: 3 s", r"tables.pull: expected a table from 0 to 3 s, .* got one from 0 to 2 s; 'hold: true'"),
        ("pull(t) -", "push(t) -", r"loads.f.force: expected one of .* got 'push\(t\)'; did you mean 'pull\(t\)'"),
        ("pull(t) -", "turn(t) -", r"of one dimension, got angle and force"),
        ("pull(t) -", "pull(2 m) -", r"loads.f.force: expected a time \[s\] in pull\(...\), got length"),
        ("file: a.csv, unit: N", "file: b.csv, unit: N", r"tables.pull: .*table .*b.csv: expected a CSV file"),
        ("file: a.csv, unit: N", "file: ../../b.csv, unit: N", r"tables.pull: .*table path .*stays in its parent folder"),
        ("{pull:", "{sin:", r"tables.sin: expected a name"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    (tmp_path / "a.csv").write_text(CSV, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        reading.loads(SCENE.replace(old, new), tmp_path)
    held = (
        SCENE.replace("unit: N}", "unit: N, hold: true}")
        .replace("smooth: true", "hold: true")
        .replace("duration: 1 s", "duration: 3 s")
    )
    assert reading.loads(held, tmp_path).tables["pull"].hold


@pytest.mark.parametrize(
    "history, start",
    [
        ("turn(2 * t)", "1"),
        ("turn(3 * t - 0.2 s)", "0"),
        ("turn(1.5 * t)", "1.33"),
        ("where(t < 0.9 s, turn(2 * t), 1 rad)", ""),
        ("turn(mod(t, 1 s))", ""),
        ("turn(t / 2)", ""),
    ],
)
def test_a_table_that_is_left_by_its_argument_is_warned_of(tmp_path: Path, history: str, start: str) -> None:
    """Where the value there counts: not in a branch that is not taken."""
    (tmp_path / "a.csv").write_text(CSV, encoding="utf-8")
    text = SCENE.replace("duration: 1 s", "duration: 2 s").replace("cos(turn(t))", f'"cos({history})"')
    assert history in text
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", Notice)
        reading.loads(text, tmp_path)
    told = [str(one.message) for one in caught if "outside of its table" in str(one.message)]
    assert len(told) == bool(start)
    assert all(f"from 0 to 2 s, from t = {start}" in one and "hold: true" in one for one in told)


@pytest.mark.parametrize(
    "force, history, allowed",
    [
        ("pull(mod(t, 2 s))", "cos(turn(mod(t, 0.7 s)))", True),
        ("pull(mod(t, 2 s))", "where(t < 1 s, cos(turn(t)), 1)", True),
        ("pull(t)", "cos(turn(mod(t, 2 s)))", False),
        ("pull(mod(t, 2 s))", "cos(turn(mod(t, 2.01 s)))", False),
        ("pull(mod(t, 2 s))", "cos(turn(t))", False),
        ("pull(mod(t, 2 s))", "where(t > 1 s, cos(turn(t)), 1)", False),
    ],
)
def test_a_short_table_serves_a_run_that_never_leaves_it(tmp_path: Path, force: str, history: str, allowed: bool) -> None:
    """A period of a signal drives a run of many; where one of its readers gets beyond it, also between samples, it is refused."""
    (tmp_path / "a.csv").write_text(CSV, encoding="utf-8")
    text = SCENE.replace("duration: 1 s", "duration: 1 h").replace("pull(t)", force).replace("cos(turn(t))", f'"{history}"')
    assert force in text
    assert history in text
    if allowed:
        assert reading.loads(text, tmp_path).analysis.instants()[-1] == 3600.0
    else:
        with pytest.raises(InputError, match=r"mod\(t, 2 s\)\) repeats"):
            reading.loads(text, tmp_path)


def test_round_off_is_not_beyond_the_ends_of_a_curve() -> None:
    """mod(t, 0.05) is -6e-17 where t is three times 0.05 but for round-off."""
    straight = np.array([0.0, 2.0, 0.0, 0.05, 0.0, 0.0, 20.0, 0.0])
    assert [curves.beyond(x, straight) for x in (-6e-17, 0.02, 0.05 + 1e-17, 0.06, -1e-3)] == pytest.approx(
        [0.0, 0.0, 0.0, 0.01, 1e-3]
    )
