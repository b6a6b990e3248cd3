"""`fmbs run`: what it prints and writes, output folders, partial results, every analysis."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.results.plots import PANELS
from fmbs_skfem.studies.running import panels, solving
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.system import Output

from .calls import CANTILEVER, EXAMPLES, ROOT, fmbs, scene

STATIC = "{type: static, load_steps: 4}"
SHORT = "{type: dynamic, duration: 10 ms, step: 1 ms}"
KEYS = {
    "status",
    "dofs",
    "constraints",
    "steps",
    "newton_iterations",
    "cpu_s",
    "wall_s",
    "energy_drift",
    "outputs",
    "notices",
    "scene",
}


def table(path: Path) -> tuple[list[str], np.ndarray]:
    """Columns and numbers of a CSV file."""
    return path.read_text().splitlines()[0].split(","), np.loadtxt(path, delimiter=",", skiprows=1)


def test_the_step_that_compiles_a_model_warns_of_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a single step t**2 is wrong by half; in all of them it is not."""
    monkeypatch.setattr(solving.compiling, "announce", lambda _: True)
    done = fmbs(
        "run", scene(tmp_path, SHORT, "t**2"), "--no-plots", "--json", "--out", tmp_path / "out"
    )
    assert (done.code, done.json["notices"]) == (0, [])


@pytest.mark.parametrize(
    ("name", "duration", "columns"),
    [
        ("spin_up", "0.05", ["tip_deflection", "tip_x", "tip_y"]),
        ("double_pendulum", "0.02", ["B_x", "B_y", "B_z", "C_x", "C_y", "C_z"]),
        ("four_bar", "0.05", ["C_x", "C_y", "coupler_slope_x", "coupler_slope_y", "motor_torque"]),
        ("hanging_mass", "0.05", ["mass_x", "mass_y", "mass_z", "speed_x"]),
    ],
)
def test_examples_run(name: str, duration: str, columns: list[str], tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = fmbs(
        "run",
        EXAMPLES / f"{name}.yaml",
        "--json",
        "--out",
        out,
        "--duration",
        duration,
        "--no-plots",
    )
    assert done.code == 0
    found = done.json
    assert found["status"] == "ok"
    assert set(found) >= KEYS
    head, numbers = table(out / "outputs.csv")
    assert head[0] == "t"
    assert head[1 : 1 + len(columns)] == columns
    assert head[1:] == list(found["outputs"])
    assert numbers[-1, 0] == pytest.approx(float(duration))
    for column, values in zip(head[1:], numbers.T[1:], strict=True):
        extremes = found["outputs"][column]
        assert (values.min(), values.max(), values[-1]) == pytest.approx(
            tuple(extremes[key] for key in ("min", "max", "final"))
        )
    assert json.loads((out / "report.json").read_text())["outputs"] == found["outputs"]


def test_every_column_has_its_unit_and_a_drive_a_torque(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = fmbs("run", EXAMPLES / "four_bar.yaml", "--out", out, "--duration", "0.01")
    found = json.loads((out / "report.json").read_text())
    assert found["units"].keys() == found["outputs"].keys()
    assert (
        found["units"]["C_x"],
        found["units"]["coupler_slope_x"],
        found["units"]["motor_torque"],
    ) == ("m", "", "N m")
    assert json.loads((out / "outputs.units.json").read_text()) == {"t": "s", **found["units"]}
    assert found["labels"] == {"motor_torque": "moment about z"}
    assert "motor_torque: moment about z [mN m]" in done.out
    assert "C_x [mm]" in done.out


@pytest.mark.parametrize("wanted", [False, True])
def test_the_head_of_outputs_has_units_on_request(wanted: bool, tmp_path: Path) -> None:
    """Of a run; the same of one that is resumed is one more flag."""
    shared = [
        "--out",
        tmp_path / "out",
        "--duration",
        "0.01",
        "--no-plots",
        *(["--units"] if wanted else []),
    ]
    assert fmbs("run", EXAMPLES / "four_bar.yaml", *shared).code == 0
    head, numbers = table(tmp_path / "out" / "outputs.csv")
    units = json.loads((tmp_path / "out" / "outputs.units.json").read_text())
    assert head == [f"{name} [{unit}]" if wanted and unit else name for name, unit in units.items()]
    assert ("motor_torque [N m]" in head, "C_x [m]" in head, "coupler_slope_x" in head) == (
        wanted,
        wanted,
        True,
    )
    assert numbers.shape[1] == len(head)


def test_a_vector_is_one_panel_and_a_figure_has_the_first_ones_of_every_output() -> None:
    """The components of a vector share axes, but for one that would be flat there; 91 columns leave
    room for others.
    """
    outputs = {
        "edge": Output("reaction", (), tuple(f"edge_{k}" for k in range(91))),
        "tip": Output("position", (), ("tip_x", "tip_y", "tip_z")),
        "energy": Output(
            "energy", (), ("energy_kinetic", "energy_strain", "energy_potential", "energy_balance")
        ),
    }
    swing = np.sin(np.linspace(0.0, 6.0, 50))
    known = {column: swing for one in outputs.values() for column in one.columns} | {
        "energy_balance": 1e-4 * swing
    }
    drawn = panels.arrange(outputs, known)
    assert len(drawn) == PANELS
    assert [panel.label for panel in drawn[:22]] == [f"edge_{k}" for k in range(21)] + ["tip [m]"]
    assert [list(panel.curves) for panel in drawn[21:]] == [
        ["x", "y", "z"],
        ["kinetic", "strain", "potential"],
        ["balance"],
    ]


def test_example_1_has_the_published_deflection(tmp_path: Path) -> None:
    """Tip deflection 0.3176 m at 0.83 s: doi 10.1016/j.cma.2019.112690, section 5.1; converged in
    mesh and step 0.3176188 m.
    """
    done = fmbs(
        "run",
        EXAMPLES / "spin_up.yaml",
        "--json",
        "--out",
        tmp_path / "out",
        "--duration",
        "0.83",
        "--no-plots",
    )
    assert done.json["steps"] == 1660
    assert done.json["outputs"]["tip_deflection"]["final"] == pytest.approx(-0.3176188, abs=2e-6)


def test_static_deflection_of_a_cantilever(tmp_path: Path) -> None:
    """Small load: w = F L^3 / (3 E I), E I = 1e9 pi d^4 / 64; doubled by --set."""
    path, stiffness = scene(tmp_path, STATIC), 1e9 * np.pi * 0.01**4 / 64
    for load in (1e-4, 2e-4):
        done = fmbs(
            "run",
            path,
            "--json",
            "--no-plots",
            "--out",
            tmp_path / f"{load}",
            "--set",
            f"load={load} N",
        )
        assert done.code == 0
        final = done.json["outputs"]
        assert final["tip_y"]["final"] == pytest.approx(load / (3 * stiffness), rel=1e-5)
        assert final["clamp_y"]["final"] == pytest.approx(-load, rel=1e-6)
        assert done.json["energy_drift"] is None


def test_a_ramp_of_the_load_is_its_load_factor(tmp_path: Path) -> None:
    """History t and the load alone are one static problem; `time` stretches the history."""
    found = {}
    for name, analysis, history in (
        ("ramp", STATIC, "t"),
        ("late", "{type: static, load_steps: 4, time: 2 s}", "t / 2"),
        ("alone", STATIC, "1"),
    ):
        (tmp_path / name).mkdir()
        done = fmbs(
            "run",
            scene(tmp_path / name, analysis, history),
            "--out",
            tmp_path / name / "out",
            "--no-plots",
        )
        assert done.code == 0, done.err
        found[name] = table(tmp_path / name / "out" / "outputs.csv")[1]
    assert found["alone"][-1, 2] > 0.1
    np.testing.assert_allclose(found["ramp"], found["alone"], atol=1e-9)
    np.testing.assert_allclose(found["late"], found["alone"], atol=1e-9)


def test_modes_leave_loads_out_and_say_so(tmp_path: Path) -> None:
    """A follower force turns with the slope, but the modes of the unloaded beam are those without
    it.
    """
    text = CANTILEVER.replace(
        "type: point_force, at: beam.right, force: [0, load]",
        "type: follower, at: beam.right, force: [-30, 0]",
    )
    found = []
    for name, scene_text in (("pushed", text), ("free", CANTILEVER)):
        (tmp_path / name).mkdir()
        path = scene(tmp_path / name, "{type: modes, count: 2, about: reference}", text=scene_text)
        done = fmbs("run", path, "--json", "--out", tmp_path / name / "out")
        assert any(
            "modes are those of the unloaded reference" in notice for notice in done.json["notices"]
        )
        found.append(done.json["frequencies_hz"])
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("analysis", "times", "told"),
    [
        (
            "{type: dynamic, duration: 10 ms, step: 4 ms}",
            np.linspace(0.0, 0.01, 4),
            "steps of 0.00333333 s are taken",
        ),
        (
            "{type: dynamic, duration: 10 ms, step: 1 ms, every: 3}",
            1e-3 * np.array([0, 3, 6, 9, 10]),
            None,
        ),
        (
            "{type: dynamic, duration: 10 ms, step: 4 ms, every: [{every: 4 ms}]}",
            4e-3 * np.arange(3),
            "end at 0.008 s",
        ),
    ],
)
def test_the_end_is_the_end(
    analysis: str, times: np.ndarray, told: str | None, tmp_path: Path
) -> None:
    """The last state is that of the duration; where the times that a scene asks for forbid it, the
    end is told.
    """
    done = fmbs("run", scene(tmp_path, analysis), "--json", "--out", tmp_path / "out", "--no-plots")
    assert done.code == 0, done.err
    np.testing.assert_allclose(table(tmp_path / "out" / "outputs.csv")[1][:, 0], times, atol=1e-12)
    notices = done.json["notices"]
    assert len(notices) == (told is not None)
    assert all(str(told) in notice for notice in notices)


def test_frequencies_of_a_cantilever(tmp_path: Path) -> None:
    """omega_i = (beta_i L)^2 sqrt(E I / (rho A L^4)), beta_i L = 1.875104, 4.694091:
    Euler-Bernoulli, clamped and free.
    """
    done = fmbs(
        "run",
        scene(tmp_path, "{type: modes, count: 2, about: reference}"),
        "--json",
        "--out",
        tmp_path / "out",
    )
    scale = np.sqrt(1e9 * (0.01**2 / 16) / 1800.0)
    expected = np.array([1.8751040687, 4.6940911330]) ** 2 * scale / (2 * np.pi)
    assert done.json["frequencies_hz"] == pytest.approx(expected, rel=1e-5)
    head, numbers = table(tmp_path / "out" / "modes.csv")
    assert head[:3] == ["mode", "frequency_hz", "omega_rad_per_s"]
    assert numbers[:, 2] == pytest.approx(2 * np.pi * numbers[:, 1])


def test_a_table_and_plots_without_json(tmp_path: Path) -> None:
    done = fmbs("run", scene(tmp_path, SHORT), "--out", tmp_path / "out")
    assert done.code == 0
    assert all(
        word in done.out for word in ("84 dofs", "10 steps", "tip_y", "clamp_x", "outputs.csv")
    )
    assert (tmp_path / "out" / "outputs.png").read_bytes().startswith(b"\x89PNG")


def test_results_of_another_run_are_kept(tmp_path: Path) -> None:
    """The same run may be repeated; another one needs a folder of its own, or --force."""
    path, out = scene(tmp_path, SHORT), tmp_path / "out"
    call = ("run", path, "--out", out, "--no-plots")
    assert fmbs(*call).code == 0
    assert fmbs(*call).code == 0
    first = (out / "outputs.csv").read_bytes()
    refused = fmbs(*call, "--set", "load=2 N")
    assert refused.code == 3
    assert "--force" in refused.err
    assert (out / "outputs.csv").read_bytes() == first
    assert fmbs(*call, "--set", "load=2 N", "--force").code == 0
    assert (out / "outputs.csv").read_bytes() != first


def test_files_of_the_user_are_kept(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "outputs.csv").write_text("mine")
    assert fmbs("run", scene(tmp_path, SHORT), "--out", out).code == 3
    assert (out / "outputs.csv").read_text() == "mine"
    assert fmbs("run", scene(tmp_path, SHORT), "--out", out / "outputs.csv").code == 3


@pytest.mark.parametrize(
    ("command", "name"),
    [("run", "taken/below"), ("reduce", "taken/below/model.h5"), ("run", "/proc/self")],
)
def test_a_place_that_cannot_be_written_is_refused_before_anything_is_solved(
    command: str, name: str, tmp_path: Path
) -> None:
    """Below a file, and where even the administrator may not write."""
    (tmp_path / "taken").write_text("a file in the way")
    done = fmbs(command, scene(tmp_path, SHORT), "--out", tmp_path / name, "--json")
    assert done.code == 3
    assert (
        f"--out {tmp_path / name.removesuffix('/model.h5')}: expected a folder that can be"
        in done.err
    )
    assert "choose another place" in done.json["message"]


def test_the_default_folder_has_the_name_of_the_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert fmbs("run", scene(tmp_path, SHORT), "--no-plots").code == 0
    assert (tmp_path / "fmbs-cantilever" / "outputs.csv").is_file()


def test_a_failed_solve_keeps_what_it_reached(tmp_path: Path) -> None:
    """A force of 1e12 N from 5 ms on cannot be followed with a step of 1 ms."""
    path, out = scene(tmp_path, SHORT, history="where(t < 0.0055, 1, 1e12)"), tmp_path / "out"
    done = fmbs("run", path, "--json", "--out", out)
    assert done.code == 4
    found = done.json
    assert found["status"] == "error"
    assert found["reason"]
    assert 0.005 <= found["time"] <= 0.0061
    assert found["worst"]
    assert "Traceback" not in done.err
    _, numbers = table(out / "outputs.csv")
    assert numbers[:, 0] == pytest.approx(np.arange(6) * 1e-3)
    assert np.isfinite(numbers).all()


def test_duration_needs_a_dynamic_scene_and_a_step(tmp_path: Path) -> None:
    assert fmbs("run", scene(tmp_path, STATIC), "--duration", "1").code == 3
    assert fmbs("run", scene(tmp_path, SHORT), "--duration", "1e-5").code == 3
    assert fmbs("run", scene(tmp_path, SHORT), "--step", "1e-3").code == 3


SPINNING = """\
schema: 1
name: spinning
dimension: 2
bodies:
  beam:
    type: cable
    mesh: beam_10.msh
    section: {shape: given, EA: 1e4 N, EI: 1 N m^2, rhoA: 1 kg/m}
joints:
  pin: {type: pin, at: beam.left}
loads:
  slack: {type: rope, at: beam.right, to: [0, 0], length: 5 m, stiffness: 1 N/m}
initial:
  bodies: {beam: {angular_velocity: 10 rad/s}}
analysis: {type: dynamic, duration: 2 s, step: 20 ms, rho_inf: 1}
outputs:
  tip: {type: position, at: beam.right}
"""


@pytest.mark.parametrize("step,told", [("12 ms", True), ("5 ms", False)])
def test_energy_from_nowhere_is_told(step: str, told: bool, tmp_path: Path) -> None:
    """A beam turns at 10 rad/s. Steps of 0.12 rad converge without numerical damping, and nearly
    double its energy.

    Beside a rope, whose derivatives jump where it becomes taut, steps are not judged by their
    corrections; without it they are divided.
    """
    (tmp_path / "beam_10.msh").write_bytes((ROOT / "meshes" / "beam_10.msh").read_bytes())
    path = tmp_path / "spinning.yaml"
    path.write_text(SPINNING.replace("20 ms", step).replace("2 s", "1.52 s"))
    done = fmbs("run", path, "--out", tmp_path / "out", "--json", "--no-plots")
    assert done.code == 0, done.err
    assert any("energy balance rises" in notice for notice in done.json["notices"]) == told


GEARED = """\
schema: 1
dimension: 2
bodies:
  pinion: {type: rigid, mass: 2 kg, inertia: 0.02 kg m^2, center: [0, 0]}
  wheel: {type: rigid, mass: 3 kg, inertia: 0.05 kg m^2, center: [0.3 m, 0]}
joints:
  A: {type: revolute, at: pinion}
  B: {type: revolute, at: wheel}
  gear: {type: gear, at: pinion, to: wheel, teeth: [20, 50]}
initial:
  bodies:
    pinion: {angular_velocity: 1 rad/s}
    wheel: {angular_velocity: -0.4 rad/s, center: [0.3 m, 0]}
analysis: {type: dynamic, duration: 20 s, step: 250 ms, rho_inf: 0.5}
"""


@pytest.mark.parametrize("step,told", [("250 ms", True), ("62.5 ms", False)])
def test_energy_that_goes_nowhere_is_told(step: str, told: bool, tmp_path: Path) -> None:
    """Wheels in mesh that nothing brakes: steps of a quarter of a radian damp 2 % of their energy,
    of a sixteenth 6e-4.
    """
    path = tmp_path / "geared.yaml"
    path.write_text(GEARED.replace("250 ms", step))
    done = fmbs("run", path, "--out", tmp_path / "out", "--json", "--no-plots")
    assert done.code == 0, done.err
    assert (
        any(
            "energy balance falls by 2.0% of the largest" in notice
            for notice in done.json["notices"]
        )
        == told
    )
    assert 0.5 * (0.02 + 0.05 * 0.4**2) * (0.02 if told else 6e-4) == pytest.approx(
        done.json["energy_drift"], rel=0.05
    )


def test_an_unknown_parameter_is_refused(tmp_path: Path) -> None:
    done = fmbs("run", scene(tmp_path, SHORT), "--set", "laod=1 N")
    assert done.code == 3
    assert "did you mean 'load'?" in done.err


TOP = """\
schema: 1
dimension: 3
bodies:
  mass: {type: point_mass, mass: 2 kg, position: [0.5, 0, -0.8660254037844386]}
joints:
  rod: {type: distance, at: mass, to: [0, 0, 0]}
loads:
  weight: {type: gravity, acceleration: [0, 0, -9.81]}
initial:
  bodies: {mass: {velocity: [0, 1.6828, 0]}}
analysis: {type: dynamic, duration: 5 ms, step: 0.1 us, rho_inf: 1.0, every: 100}
outputs:
  tension: {type: reaction, joint: rod}
"""


def test_noise_of_reactions_is_told(tmp_path: Path) -> None:
    """Round-off of positions, over the square of a tiny step, shows in reactions: at 10 us it does
    not, though nothing damps it.
    """
    scene = tmp_path / "scene.yaml"
    scene.write_text(TOP)
    noisy = fmbs("run", scene, "--json", "--no-plots", "--out", tmp_path / "noisy")
    assert noisy.code == 0, noisy.err
    assert "of noise in accelerations and reactions" in noisy.err
    scene.write_text(
        TOP.replace(
            "5 ms, step: 0.1 us, rho_inf: 1.0, every: 100",
            "0.5 s, step: 10 us, rho_inf: 1.0, every: 100",
        )
    )
    quiet = fmbs("run", scene, "--json", "--no-plots", "--out", tmp_path / "quiet")
    assert "noise" not in quiet.err
    assert quiet.json["acceleration_noise"] == pytest.approx(
        1e-4 * noisy.json["acceleration_noise"], rel=1e-6
    )
    tension = quiet.json["outputs"]["tension_length"]
    assert tension["max"] - tension["min"] < 1e-4 * 22.655


@pytest.mark.parametrize("command", ["run", "render", "export"])
def test_a_folder_of_another_run_is_refused_before_anything_is_solved(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("solved")

    monkeypatch.setattr(solving, "finish", never)
    path = scene(tmp_path, "{type: static, load_steps: 1}")
    out = tmp_path / "out"
    out.mkdir()
    (out / "outputs.csv").write_text("mine")
    done = fmbs(command, path, "--out", out)
    assert done.code == 3
    assert "another run's outputs.csv" in done.err
    (out / "file").write_text("")
    assert fmbs(command, path, "--out", out / "file").code == 3


TWO_CELLS = """\
$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
0 1 "left"
0 2 "right"
1 3 "line"
$EndPhysicalNames
$Nodes
3
1 0 0 0
2 0.5 0 0
3 1 0 0
$EndNodes
$Elements
4
1 15 2 1 1 1
2 15 2 2 2 3
3 1 2 3 3 1 2
4 1 2 3 3 2 3
$EndElements
"""


@pytest.mark.parametrize("duration,code", [("4 s", 4), ("0.4 s", 0)])
def test_an_energy_that_rises_tenfold_ends_with_exit_code_4(
    duration: str, code: int, tmp_path: Path
) -> None:
    """Two soft cells turn by 0.25 rad a step; all steps converge: the motion is kept up to where
    its energy is sound.
    """
    (tmp_path / "beam_10.msh").write_text(TWO_CELLS)
    path = tmp_path / "spinning.yaml"
    soft = (
        SPINNING.replace("EA: 1e4 N", "EA: 3e3 N")
        .replace("rho_inf: 1", "rho_inf: 0.99")
        .replace("20 ms", "25 ms")
    )
    path.write_text(soft.replace("2 s", duration))
    done = fmbs("run", path, "--out", tmp_path / "out", "--json", "--no-plots")
    assert done.code == code, done.err
    if code == 0:
        assert "failure" not in done.json
        return
    failure, end = done.json["failure"], done.json["end"]
    assert done.json["status"] == "error"
    assert failure["reason"] == "the energy balance rises"
    assert 0.0 < end < 4.0
    assert 0.25 < failure["turns"]["beam"] < 0.5
    assert [cause["name"] for cause in failure["causes"]] == ["unstable"]
    assert np.loadtxt(tmp_path / "out" / "outputs.csv", delimiter=",", skiprows=1)[
        -1, 0
    ] == pytest.approx(end)


@pytest.mark.parametrize("length, force", [(1.0, 1.0), (1e3, 1.0), (1.0, 1e-6), (1e-3, 1e6)])
def test_reactions_that_are_round_off_are_drawn_as_zero_in_every_unit(
    length: float, force: float
) -> None:
    """Beside larger forces and moments of the model, at its size, or within the noise of
    accelerations; displacements never are.
    """
    numbers = force * np.sin(np.linspace(0.0, 6.0, 50))
    known = {
        "hinge_x": numbers,
        "hinge_y": 1e-10 * numbers,
        "hinge_mz": 1e-10 * length * numbers,
        "hinge_my": 1e-8 * length * numbers,
        "free_x": 3e-10 * numbers,
        "tip_x": length * numbers,
        "tip_y": 1e-10 * length * numbers,
    }
    outputs = {
        "hinge": Output("reaction", (), ("hinge_x", "hinge_y", "hinge_mz", "hinge_my")),
        "free": Output("reaction", (), ("free_x",)),
        "tip": Output("position", (), ("tip_x", "tip_y")),
    }
    units = {
        column: unit
        for column, unit in probes.column_units(outputs).items()
        if column.startswith("hinge")
    }
    assert units == {"hinge_x": "N", "hinge_y": "N", "hinge_mz": "N m", "hinge_my": "N m"}
    noise = panels.find_noise(outputs, known, length, 0.0)
    assert noise == {"hinge_y", "hinge_mz", "free_x"}
    drawn = {panel.label: panel.curves for panel in panels.arrange(outputs, known, noise)}
    assert list(drawn) == [
        "hinge [N]",
        "hinge [N m]",
        "free_x [N], round-off",
        "tip_x [m]",
        "tip_y [m]",
    ]
    assert not drawn["hinge [N]"]["y, round-off"].any()
    assert not drawn["free_x [N], round-off"]["x"].any()
    alone = {"free": outputs["free"]}
    assert panels.find_noise(alone, known, length, 1e-9 * force) == {"free_x"}
    assert panels.find_noise(alone, known, length, 1e-10 * force) == frozenset()
