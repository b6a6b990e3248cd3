"""Tables of time: lines and smooth curves, units of files, what is refused; in scenes, forces and
histories.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import studies
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.compiling import curves
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values import tables
from fmbs_skfem.core.values.expressions import Expression, of_time
from fmbs_skfem.core.values.inputs import Input
from fmbs_skfem.core.values.tables import Table, read_columns
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.dynamics.diagnoses import step_size
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.loads import Load
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.signals import with_inputs

CSV = "\ufefftime [ms], force [kN], turn [deg]\n0, 0, 0\n\n500, 1e-3, 90\n1000, 1e-3, 180\n2000, -3e-3, 180\n"


def test_lines_and_smooth_curves() -> None:
    """Lines are exact on lines; the smooth curve goes through the points, overshoots nowhere and
    has no kinks.
    """
    t = np.linspace(-1, 4, 501)
    lines = Table("f(t)", "N", (0.0, 1.0, 3.0), (0.0, 2.0, 2.0))
    assert_allclose(lines(t), np.clip(2 * t, 0, 2), atol=1e-14)
    smooth = Table("f(t)", "N", (0.0, 1.0, 3.0), (0.0, 2.0, 2.0), True)
    assert_allclose(smooth(np.array([0.0, 1.0, 3.0])), [0.0, 2.0, 2.0], atol=1e-14)
    assert smooth(t).max() <= 2.0 + 1e-14
    inside = smooth(np.linspace(0.0, 3.0, 3001))
    assert np.abs(np.diff(inside, 2)).max() < 1e-5


def path_of(points: int, **more: object) -> Table:
    """A path of minimum jerk from 0 to 1 in 1 s."""
    t = np.linspace(0.0, 1.0, points)
    return Table(
        "q(t)", "rad", tuple(t), tuple(10 * t**3 - 15 * t**4 + 6 * t**5), True, drives=True, **more
    )  # type: ignore[arg-type]


def bends(table: Table) -> np.ndarray:
    """Second derivatives at the begin and the end of every piece, (s - 1, 2)."""
    h, c = np.diff(table.times), table.cubics
    return np.stack([2.0 * c[:, 1], 2.0 * c[:, 1] + 6.0 * c[:, 0] * h], axis=1)


@pytest.mark.parametrize(
    ("ends", "error"),
    [("automatic", 0.0025), ("clamped", 0.0025), ("natural", 0.0025), ("not-a-knot", 0.0085)],
)
def test_curves_that_drive_have_continuous_second_derivatives(ends: str, error: float) -> None:
    """Of a path of minimum jerk in 51 points, whose second derivative is 60 t - 180 t^2 + 120 t^3
    (its range 11.55).
    """
    table = path_of(51, ends=ends)
    found, t = bends(table), np.array(table.times)
    assert_allclose(found[1:, 0], found[:-1, 1], atol=1e-10)
    assert np.abs(found[:, 0] - (60 * t - 180 * t**2 + 120 * t**3)[:-1]).max() < error * 11.55
    assert_allclose(table(t), table.values, atol=1e-15)
    assert (
        np.abs(bends(Table("q(t)", "rad", table.times, table.values, True))[:, 0]).max() > 6.0
    )  # of 5.77


def test_ends_are_at_rest_where_points_say_so() -> None:
    """1 - cos begins at rest, sin does not; one end may, and a table of few points says nothing."""
    t = tuple(np.linspace(0.0, 2.0, 41).tolist())

    def rates(values: np.ndarray, **more: object) -> list[float]:
        table = Table("q(t)", "rad", t[: len(values)], tuple(values), True, drives=True, **more)  # type: ignore[arg-type]
        h, c = table.times[-1] - table.times[-2], table.cubics[-1]
        return [float(table.cubics[0, 2]), float(c[2] + h * (2.0 * c[1] + 3.0 * h * c[0]))]

    x = np.array(t)
    assert rates(1 - np.cos(np.pi * x)) == pytest.approx([0.0, 0.0], abs=1e-14)
    assert rates(np.sin(np.pi * x)) == pytest.approx([np.pi, np.pi], rel=1e-3)
    assert rates(1 - np.cos(3 * x)) == pytest.approx([0.0, 3 * np.sin(6.0)], rel=3e-3, abs=1e-14)
    assert rates(0.01 * x + x**2) == pytest.approx([0.01, 4.01])
    assert rates(np.array([0.0, 0.0, 1.0, 1.0, 1.0])) == pytest.approx([0.0, 0.0], abs=1e-14)
    assert rates(np.array([0.0, 1.0])) == pytest.approx([20.0, 20.0])
    assert rates(np.array([0.0, 1.0, 4.0]), ends="clamped") == pytest.approx([0.0, 0.0], abs=1e-12)
    assert rates(np.array([0.0, 1.0, 4.0]))[0] == pytest.approx(0.0, abs=1e-12)  # a parabola


def test_overshoot_and_noise_of_curves_that_drive() -> None:
    """Against values in between; of noise, rounding and corners only noise is called so, and
    round-off of a line is none.
    """
    dwell = Table(
        "q(t)",
        "rad",
        (0.0, 1.0, 2.0, 3.0, 4.0, 5.0),
        (0.0, 0.0, 1.0, 1.0, 1.0, 1.0),
        True,
        drives=True,
    )
    size, place = tables.overshoot(dwell)
    assert size == pytest.approx(dwell(np.linspace(0.0, 5.0, 100001)).max() - 1.0, rel=1e-6)
    assert float(dwell(np.array(place))) - 1.0 == pytest.approx(size)
    falls = replace(dwell, values=tuple(-np.array(dwell.values)))
    assert tables.overshoot(falls)[0] == pytest.approx(size)
    assert tables.overshoot(path_of(21))[0] < 1e-12
    t = np.linspace(0.0, 1.0, 401)
    rough = np.random.default_rng(1).normal(size=401)
    smooth = np.array(path_of(401).values)

    def noise(values: np.ndarray) -> tuple[float, float]:
        return tables.noise(Table("q(t)", "rad", tuple(t), tuple(values), True, drives=True))

    own, other = noise(smooth + 1e-4 * rough)
    assert own == pytest.approx(
        6.0 * 1e-4 * 400**2 * 3.3, rel=0.3
    )  # the largest of 401 is about three times the mean one
    assert other == pytest.approx(5.77, rel=0.5)
    for quiet in (
        smooth,
        smooth + 1e-10 * rough,
        0.3 * t,
        0.3 * t + 1e-16 * rough,
        np.where(t < 0.5, 0.0, 1.0),
        np.abs(t - 0.5),
    ):
        assert noise(quiet) == (0.0, 0.0)


def crank(angle: Expression, *more: Load) -> System:
    """A wheel of 1 kg m^2 on a shaft that is driven."""
    wheel = rigid("wheel", 1.0, 1.0, (0.0, 0.0), dim=2, places={"A": (0.0, 0.0)})
    at = At("wheel", "A")
    drives = [joints.Revolute("A", at), joints.DrivenAngle("m", at, angle)]
    return assemble([wheel], drives, list(more), outputs={"m": probes.Reaction("m")})


def torque_error(system: System) -> float:
    """Of a crank on 1 - cos(2 pi t), the torque is 4 pi^2 cos(2 pi t), 39.478 N m."""
    motion = integrate(eliminate(system), GeneralizedAlpha(2e-3), 1.0)
    return float(
        np.abs(outputs(motion)["m_torque"] - 4 * np.pi**2 * np.cos(2 * np.pi * motion.times)).max()
    )


def test_drives_read_the_spline_and_forces_the_monotone_cubic(tmp_path: Path) -> None:
    """One table for both, in a system and in its file; the monotone cubic gave 109.6 N m for 39.5
    with 401 points.
    """
    t = np.linspace(0.0, 1.0, 101)
    table = Table("q(t)", "rad", tuple(t), tuple(1 - np.cos(2 * np.pi * t)), True)
    angle = of_time("q(t)", inputs={"q(t)": table})
    push = loads.PointForce("push", At("wheel", "A"), (1.0, 0.0), history=angle)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        system = crank(angle, push)
        assert torque_error(system) < 0.02
    assert angle.inputs[0] == table
    drive, force = (
        system.signals[k].angle.inputs[0] if k < 2 else system.signals[k].inputs[0] for k in (0, 2)
    )
    assert (drive.drives, force.drives) == (True, False)
    assert (
        files.load(files.save(eliminate(system), tmp_path / "crank.h5")).signals == system.signals
    )


def test_inputs_that_drive_are_given_splines() -> None:
    t = np.linspace(0.0, 1.0, 101)
    table = Table("q(t)", "rad", tuple(t), tuple(1 - np.cos(2 * np.pi * t)), True)
    system = crank(of_time("u", inputs={"u": Input("u", "rad")}))
    assert torque_error(with_inputs(system, {"u": of_time("q(t)", inputs={"q(t)": table})})) < 0.02
    assert torque_error(with_inputs(system, {"u": table})) < 0.02


def test_what_speaks_against_tables_that_drive_is_told() -> None:
    steps = Table(
        "q(t)", "rad", (0.0, 0.2, 0.4, 0.6, 0.8, 1.0), (0.0, 0.0, 0.1, 0.1, 0.1, 0.1), True
    )
    with pytest.warns(
        Notice,
        match=r"table 'q', whose curve .* at 0\.4\d+ s it goes beyond .* by 0\.0\d+ rad, 0\.\d+ of their range",
    ):
        crank(of_time("q(t)", inputs={"q(t)": steps}))
    lines = Table("q(t)", "rad", (0.0, 0.3, 0.5, 1.0, 2.0), (0.0, 0.3, 0.5, 0.8, 0.0))
    with pytest.warns(Notice) as told:
        integrate(
            eliminate(crank(of_time("q(t)", inputs={"q(t)": lines}))), GeneralizedAlpha(1e-2), 1.0
        )
    found = [str(one.message) for one in told if "straight lines" in str(one.message)]
    assert len(found) == 1
    assert (
        "joint m is driven by the straight lines of table 'q', whose rate jumps at each point, first at t = 0.51 s"
        in found[0]
    )


@pytest.mark.parametrize("text", ["0.3 * q(0.45 * t)", "where(t < 2, t**2, q(t))", "q(0.5) * t**2"])
def test_corners_that_are_not_met_are_not_told(text: str) -> None:
    lines = Table("q(t)", "rad", (0.0, 0.3, 0.5, 1.0), (0.0, 0.3, 0.5, 0.8))
    system = crank(of_time(text, inputs={"q(t)": lines}))
    assert not step_size.corners(system.signals[0], np.linspace(0.0, 1.0, 101))
    if "0.45" in text:
        assert step_size.corners(system.signals[0], np.linspace(0.0, 3.0, 301)) == {
            lines: pytest.approx(1.12)
        }


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
        (
            "time [ms], force [kN], turn [deg]\n",
            "",
            r"expected a first line of titles, such as .*, got '0,0,0'",
        ),
        (
            "time [ms], force [kN], turn [deg]",
            "time [ms];force [kN]",
            r"columns separated by commas, got semicolons in 'time",
        ),
    ],
)
def test_bad_files(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(
        CSV.replace(old, new).replace(", 90", "" if new == "500" else ", 90"), encoding="utf-8"
    )
    with pytest.raises(InputError, match=message):
        read_columns(
            path, ("time", "turn" if new == "500" else "force"), "rad" if new == "500" else "N"
        )
    with pytest.raises(
        InputError,
        match=r"one of the columns time, force, turn, got 'fore'; did you mean 'force'|titles|commas",
    ):
        read_columns(path, ("", "fore"), "N")


@pytest.mark.parametrize(
    "text, message",
    [
        (
            "t, F\n0, " + 140000 * "1",
            r"a.csv, line 2: expected cells of comma-separated values, got field larger .*; close every quote",
        ),
        (
            "t [s], F [N]\n0,5,1,5\n",
            r"row 2: expected 2 cells, one under each title, got 4; numbers are written with points",
        ),
        ("t, F, F\n0, 1, 2\n", "expected one of the columns t, F, F, got 'F' 2 times"),
        (
            "t (ms), F\n0, 1\n",
            r"expected the unit of a title in brackets, such as '... \[ms\]', got 't \(ms\)'",
        ),
        ("t_ms, F\n0, 1\n", r"'... \[ms\]', got 't_ms'"),
        ("t, F / kN, F\n0, 1, 2\n", ""),
        ("t in s, F (2)\n0, 1\n", ""),
    ],
)
def test_numbers_and_units_that_would_be_read_as_others_are_refused(
    tmp_path: Path, text: str, message: str
) -> None:
    """Commas in numbers, two columns of one title, units that are not in brackets and not those of
    SI.
    """
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


DRIVEN = """
schema: 1
dimension: 2
tables: {turn: {file: a.csv, unit: rad, smooth: true, ends: natural}}
bodies: {wheel: {type: rigid, mass: 1, inertia: 1, center: [0, 0], points: {A: [0, 0]}}}
joints: {A: {type: revolute, at: wheel.A}, m: {type: driven_angle, at: wheel.A, angle: turn(t)}}
analysis: {type: dynamic, duration: 1 s, step: 5 ms}
outputs: {m: {type: reaction, joint: m}}
"""


def test_scenes_say_how_splines_end(tmp_path: Path) -> None:
    t = np.linspace(0.0, 1.0, 21)
    rows = "".join(f"{one}, {value}\n" for one, value in zip(t, np.sin(np.pi * t), strict=True))
    (tmp_path / "a.csv").write_text(f"t [s], turn [rad]\n{rows}", encoding="utf-8")
    drive = build.system(reading.loads(DRIVEN, tmp_path)).signals[0].angle.inputs[0]
    assert bends(drive)[[0, -1], [0, 1]] == pytest.approx([0.0, 0.0], abs=1e-10)
    assert np.abs(bends(drive)[:, 0] + np.pi**2 * np.sin(np.pi * t[:-1])).max() < 0.03
    with pytest.raises(InputError, match=r"tables.turn.ends: expected .*not-a-knot"):
        reading.loads(DRIVEN.replace("natural", "loose"), tmp_path)
    with pytest.warns(Notice, match=r"tables.turn.ends: are those of smooth curves"):
        reading.loads(DRIVEN.replace("smooth: true, ", ""), tmp_path)


def test_a_check_names_what_a_run_does(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "t [s], turn [rad]\n0, 0\n0.3, 0\n0.4, 1\n2, 1\n", encoding="utf-8"
    )
    (tmp_path / "scene.yaml").write_text(DRIVEN.replace(", ends: natural", ""), encoding="utf-8")
    with pytest.warns(
        Notice,
        match=r"table 'turn', whose curve drives a joint: at .* s it goes beyond the points beside it",
    ):
        studies.check(tmp_path / "scene.yaml")
    (tmp_path / "scene.yaml").write_text(
        DRIVEN.replace("smooth: true, ends: natural", "smooth: false"), encoding="utf-8"
    )
    with pytest.warns(Notice, match=r"joint m is driven by the straight lines of table 'turn'"):
        studies.check(tmp_path / "scene.yaml")


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "duration: 1 s",
            "duration: 3 s",
            r"tables.pull: expected a table from 0 to 3 s, .* got one from 0 to 2 s; 'hold: true'",
        ),
        (
            "pull(t) -",
            "push(t) -",
            r"loads.f.force: expected one of .* got 'push\(t\)'; did you mean 'pull\(t\)'",
        ),
        ("pull(t) -", "turn(t) -", r"of one dimension, got angle and force"),
        (
            "pull(t) -",
            "pull(2 m) -",
            r"loads.f.force: expected a time \[s\] in pull\(...\), got length",
        ),
        (
            "file: a.csv, unit: N",
            "file: b.csv, unit: N",
            r"tables.pull: .*table .*b.csv: expected a CSV file",
        ),
        (
            "file: a.csv, unit: N",
            "file: ../../b.csv, unit: N",
            r"tables.pull: .*table path .*stays in its parent folder",
        ),
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
def test_a_table_that_is_left_by_its_argument_is_warned_of(
    tmp_path: Path, history: str, start: str
) -> None:
    """Where the value there counts: not in a branch that is not taken."""
    (tmp_path / "a.csv").write_text(CSV, encoding="utf-8")
    text = SCENE.replace("duration: 1 s", "duration: 2 s").replace(
        "cos(turn(t))", f'"cos({history})"'
    )
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
def test_a_short_table_serves_a_run_that_never_leaves_it(
    tmp_path: Path, force: str, history: str, allowed: bool
) -> None:
    """A period of a signal drives a run of many; where one of its readers gets beyond it, also
    between samples, it is refused.
    """
    (tmp_path / "a.csv").write_text(CSV, encoding="utf-8")
    text = (
        SCENE.replace("duration: 1 s", "duration: 1 h")
        .replace("pull(t)", force)
        .replace("cos(turn(t))", f'"{history}"')
    )
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
    assert [
        curves.beyond(x, straight) for x in (-6e-17, 0.02, 0.05 + 1e-17, 0.06, -1e-3)
    ] == pytest.approx([0.0, 0.0, 0.0, 0.01, 1e-3])


@pytest.mark.parametrize("smooth", [False, True])
def test_values_whose_slopes_are_no_numbers_are_refused(smooth: bool) -> None:
    with pytest.raises(InputError, match="points between which slopes are finite"):
        Table("goal", "N", (0.0, 0.1), (1e308, -1e308), smooth)
    with pytest.raises(InputError, match="points between which slopes are finite"):
        Table("goal", "N", (0.0, 1e-200, 2e-200), (0.0, 1e150, 0.0), smooth)
