"""`fmbs check` and `fmbs schema`."""

from __future__ import annotations

import inspect
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from fmbs_skfem.core import machine_memory
from fmbs_skfem.core.declared import Declared
from fmbs_skfem.core.values import fields, mappings, units
from fmbs_skfem.core.values.problems import Problem, Problems
from fmbs_skfem.scenes import json_schema, reference

from .calls import CANTILEVER, EXAMPLES, ROOT, fmbs, scene

STATIC = "{type: static, load_steps: 4}"
SHORT = "{type: dynamic, duration: 10 ms, step: 1 ms}"


@pytest.mark.parametrize(
    ("name", "dofs", "constraints", "multipliers"),
    [
        ("spin_up", 404, 3, 1),
        ("double_pendulum", 1212, 6, 0),
        ("four_bar", 232, 9, 1),
        ("hanging_mass", 249, 9, 3),
    ],
)
def test_examples_are_sound(name: str, dofs: int, constraints: int, multipliers: int) -> None:
    done = fmbs("check", EXAMPLES / f"{name}.yaml", "--json")
    assert done.code == 0
    found = done.json
    assert (found["dofs"], found["constraints"], found["multipliers"]) == (
        dofs,
        constraints,
        multipliers,
    )
    assert found["unknowns"] == dofs - (constraints - multipliers)
    assert found["redundant_constraints"] == 0
    assert found["notices"] == []


def test_beams_are_checked_without_compiled_code(tmp_path: Path) -> None:
    given = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", "from fmbs_skfem.cli.main import main; main()", "check"]
    done = subprocess.run(
        [*command, EXAMPLES / "double_pendulum.yaml"],
        env=given,
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "the scene is valid" in done.stdout
    assert not [*tmp_path.rglob("*.nbi"), *tmp_path.rglob("*.code")]


def test_masses_are_those_of_solid_cylinders() -> None:
    """rho pi d^2 L / 4 = 1800 * pi * 1e-4 / 4 kg for a beam of 1 m."""
    found = fmbs("check", EXAMPLES / "double_pendulum.yaml", "--json").json
    expected = 1800 * 3.141592653589793e-4 / 4
    assert [part["mass"] for part in found["bodies"]] == pytest.approx(
        [expected, expected], rel=1e-10
    )
    assert found["estimates"]["steps"] == 6000


def test_a_table_names_bodies_and_joints() -> None:
    done = fmbs("check", EXAMPLES / "spin_up.yaml", "--all")
    assert done.code == 0
    assert all(word in done.out for word in ("beam", "hinge", "drive", "404", "mass [kg]"))


def test_few_lines_say_what_a_scene_is(tmp_path: Path) -> None:
    """Three bodies in ten lines at most, a scene of many in few more; a warning is shown in full,
    counted, and the next command has the parameters that were set.
    """
    path = EXAMPLES / "four_bar.yaml"
    short = fmbs("check", path, "--set", "speed=250 rpm")
    lines = short.out.splitlines()
    assert len(lines) <= 10
    assert lines[0] == "four-bar (dynamic): the scene is valid"
    assert re.search(r"^  coupler +0.0342 kg, 500 mm long, 25 cells$", short.out, re.M)
    assert re.search(r"^  joints +O, A, C, D, motor \(driven\)$", short.out, re.M)
    assert re.search(
        r"^  motion +1 degree of freedom of rigid bodies, 0 after drives$", short.out, re.M
    )
    assert re.search(r"^  doubtful +nothing$", short.out, re.M)
    assert f"fmbs run {path} --set 'speed=250 rpm'; all tables: fmbs check --all" in short.out
    assert fmbs("check", path, "--json").json == fmbs("check", path, "--json", "--all").json
    floating = fmbs("check", EXAMPLES / "engine_mounts.yaml")
    assert "warning: " in floating.err
    assert "no joint ties 'engine' to the ground: it moves freely" in floating.err
    assert re.search(r"^  doubtful +1 warning, shown before$", floating.out, re.M)
    assert len(fmbs("check", EXAMPLES / "planetary_gear.yaml").out.splitlines()) <= 12


def test_redundant_rows_are_counted_and_named(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    path.write_text(
        path.read_text().replace(
            "joints:\n", "joints:\n  second: {type: pin, at: beam.left, to: ground}\n"
        )
    )
    done = fmbs("check", path, "--json")
    assert done.code == 0
    assert done.json["redundant_constraints"] == 2
    assert "redundant constraint rows" in done.err
    assert fmbs("check", path, "--strict").code == 3


def test_contradicting_joints_stop_the_check_by_name(tmp_path: Path) -> None:
    path = scene(tmp_path, DYNAMIC)
    drive = "drive: {type: driven_position, at: beam.left, displacement: [0.1 * t, 0]}"
    path.write_text(path.read_text().replace("joints:\n", f"joints:\n  {drive}\n"))
    done = fmbs("check", path, "--json")
    assert done.code == 3
    place = f"{path}:13: joints.drive, {path}:14: joints.clamp: joints contradict each other: "
    assert done.json["message"].startswith(place)
    assert "a driven motion must be free" in done.json["message"]
    assert "drive.x" in done.json["message"]


@pytest.mark.parametrize(
    ("analysis", "joint", "message"),
    [
        (
            SHORT,
            "at: beam.left, angle: t",
            "joints.drive, {path}:14: joints.clamp: joints contradict each other",
        ),
        (
            STATIC,
            "at: beam.left, angle: t",
            "joints.drive, {path}:14: joints.clamp: joints contradict each other",
        ),
        (
            "{type: modes}",
            "at: beam.left, angle: t",
            "joints.drive, {path}:14: joints.clamp: joints contradict each other",
        ),
        (
            SHORT,
            "at: beam.right, angle: 0.1 + t",
            "joints.drive: the initial state does not satisfy the joints: expected no gaps",
        ),
    ],
)
def test_no_run_begins_with_joints_that_contradict_each_other(
    analysis: str, joint: str, message: str, tmp_path: Path
) -> None:
    """Equilibria and modes made of them the state in which the slope is nothing; nothing is left in
    the folder of a run.
    """
    path = scene(tmp_path, analysis)
    path.write_text(
        path.read_text().replace(
            "joints:\n", f"joints:\n  drive: {{type: driven_angle, {joint}}}\n"
        )
    )
    done = fmbs("run", path, "--json", "--out", tmp_path / "out")
    assert done.code == 3
    assert done.json["message"].startswith(f"{path}:13: {message.format(path=path)}")
    assert not (tmp_path / "out").exists()


def test_a_gap_to_a_fixed_point_stops_the_check_with_its_line(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    path.write_text(
        path.read_text().replace(
            "joints:\n", "joints:\n  second: {type: pin, at: beam.left, to: [5 mm, 0]}\n"
        )
    )
    done = fmbs("check", path, "--json")
    assert done.code == 3
    assert (
        ":13: joints.second: joint 'second': expected beam.left and the fixed point (0.005, 0) at one"
        in done.json["message"]
    )


def test_a_misspelt_key_is_bad_input_with_a_hint(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    path.write_text(path.read_text().replace("analysis:", "analisys:"))
    done = fmbs("check", path)
    assert done.code == 3
    assert "did you mean 'analysis'?" in done.err


def test_a_mesh_outside_the_project_needs_permission(tmp_path: Path) -> None:
    folder = tmp_path / "project" / "scenes"
    folder.mkdir(parents=True)
    path = scene(folder, STATIC)
    (folder / "beam_20.msh").rename(tmp_path / "beam_20.msh")
    path.write_text(path.read_text().replace("beam_20.msh", "../../beam_20.msh"))
    assert fmbs("check", path).code == 3
    assert fmbs("check", path, "--allow-outside").code == 0


def test_check_writes_only_into_out(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    before = sorted(tmp_path.iterdir())
    assert fmbs("check", path).code == 0
    assert sorted(tmp_path.iterdir()) == before
    out = tmp_path / "out"
    assert fmbs("check", path, "--out", out).code == 0
    assert json.loads((out / "check.json").read_text())["dofs"] == 84


RIGID = """\
schema: 1
name: linkage
dimension: {dim}
bodies:
{bodies}
joints:
{joints}
loads: {{weight: {{type: gravity, acceleration: {down}}}}}
initial: {{bodies: {initial}}}
analysis: {analysis}
"""
DYNAMIC = "{type: dynamic, duration: 1 s, step: 1 ms}"


def rigid_scene(
    folder: Path,
    bodies: dict[str, str],
    joints: dict[str, str],
    dim: int = 2,
    analysis: str = DYNAMIC,
    initial: str = "{}",
) -> Path:
    """A scene of rigid links from A to B, given as `ax, ay -> bx, by`, and joints."""
    lines = []
    for name, ends in bodies.items():
        a, b = ([float(x) for x in end.split(",")] for end in ends.split("->"))
        a, b = ([*end, *[0.0] * (dim - len(end))] for end in (a, b))
        middle = [0.5 * (x + y) for x, y in zip(a, b, strict=True)]
        inertia = "0.1" if dim == 2 else "[0.1, 0.1, 0.1]"
        lines.append(
            f"  {name}: {{type: rigid, mass: 1, inertia: {inertia}, center: {middle}, points: {{A: {a}, B: {b}}}}}"
        )
    ties = "\n".join(f"  {name}: {text}" for name, text in joints.items())
    path = folder / "linkage.yaml"
    down = [0.0] * (dim - 1) + [-9.81]
    text = RIGID.format(
        dim=dim, bodies="\n".join(lines), joints=ties, down=down, analysis=analysis, initial=initial
    )
    path.write_text(text if joints else text.replace("joints:\n\n", ""))
    return path


LINKS = {
    "crank": "0, 0 -> 0.1, 0.2",
    "coupler": "0.1, 0.2 -> 0.6, 0.4",
    "rocker": "0.6, 0.4 -> 0.5, 0",
}


def four_bar(dim: int) -> dict[str, str]:
    """Hinges of a four-bar linkage, in space with parallel axes."""
    axis = ", axis: [0, 0, 1]" if dim == 3 else ""
    ends = {
        "O": "crank.A",
        "A": "crank.B, to: coupler.A",
        "C": "coupler.B, to: rocker.A",
        "D": "rocker.B",
    }
    return {name: f"{{type: revolute, at: {at}{axis}}}" for name, at in ends.items()}


@pytest.mark.parametrize(
    ("name", "motions", "gruebler", "freedom", "left"),
    [
        ("spin_up", 3, 1, 1, 0),
        ("double_pendulum", 10, 4, 4, 4),
        ("four_bar", 9, 1, 1, 0),
        ("hanging_mass", 8, 2, 2, 0),
        ("crank_slider_coarse", 8, 1, 1, 1),
    ],
)
def test_degrees_of_freedom_of_the_examples(
    name: str, motions: int, gruebler: int, freedom: int, left: int
) -> None:
    """Straight beams in space have 5 rigid motions, mass points 2 or 3; a drive takes the freedom
    of its hinge.
    """
    found = fmbs("check", EXAMPLES / f"{name}.yaml", "--json").json
    counted = found["mechanism"]
    assert [
        counted[key]
        for key in ("rigid_motions", "gruebler", "degrees_of_freedom", "left_by_drives", "at_start")
    ] == [
        motions,
        gruebler,
        freedom,
        left,
        freedom,
    ]
    assert (counted["overconstrained"], counted["floating"], found["notices"]) == ([], [], [])


@pytest.mark.parametrize(
    ("name", "count"), [("four_bar", 0), ("double_pendulum", 4), ("crank_slider_coarse", 1)]
)
def test_the_motions_that_drives_leave_are_named(name: str, count: int) -> None:
    found = fmbs("check", EXAMPLES / f"{name}.yaml", "--json").json["mechanism"]["free_motions"]
    assert len(found) == count
    assert all("turns about" in text for text in found)


def test_a_bar_on_a_hinge_is_free_to_turn_about_it(tmp_path: Path) -> None:
    path = rigid_scene(tmp_path, {"bar": "0, 0 -> 1, 0"}, {"A": "{type: revolute, at: bar.A}"})
    assert fmbs("check", path, "--json").json["mechanism"]["free_motions"] == [
        "bar turns about (0, 0)"
    ]
    assert "bar turns about (0, 0)" in fmbs("check", path).out


def test_gruebler_and_rank_stand_side_by_side(tmp_path: Path) -> None:
    """A planar four-bar of revolutes in space: 3 * 6 - 4 * 5 = -2 by the formula, 1 by rank, 3
    redundant constraints.
    """
    path = rigid_scene(tmp_path, LINKS, four_bar(3), dim=3)
    done = fmbs("check", path, "--json")
    counted = done.json["mechanism"]
    assert (
        done.code,
        counted["gruebler"],
        counted["degrees_of_freedom"],
        len(counted["overconstrained"]),
    ) == (0, -2, 1, 3)
    assert len(done.json["redundant"]) == 3
    assert "redundant constraints (rigid bodies)     3 (" in fmbs("check", path, "--all").out
    assert "1 degree of freedom of rigid bodies, 3 redundant constraints" in fmbs("check", path).out
    assert fmbs("check", rigid_scene(tmp_path, LINKS, four_bar(2)), "--strict").code == 0


def test_bodies_without_a_joint_are_told(tmp_path: Path) -> None:
    joints = {name: text for name, text in four_bar(2).items() if name in "AC"}
    path = rigid_scene(tmp_path, {**LINKS, "alone": "2, 0 -> 3, 0"}, joints)
    done = fmbs("check", path, "--json")
    assert done.code == 0
    assert done.json["mechanism"]["floating"] == [["crank", "coupler", "rocker"], ["alone"]]
    assert len(done.json["notices"]) == 2
    assert (
        "bodies.crank: no joint ties 'crank' and 'coupler' and 'rocker' to the ground"
        in done.json["notices"][0]
    )
    assert (
        "bodies.alone: no joint ties 'alone' to the ground: it moves freely"
        in done.json["notices"][1]
    )
    assert fmbs("check", path, "--strict").code == 3


def test_rigid_modes_of_a_static_problem_are_refused_by_name(tmp_path: Path) -> None:
    done = fmbs("check", rigid_scene(tmp_path, LINKS, four_bar(2), analysis=STATIC), "--json")
    assert done.code == 3
    message = done.json["message"]
    assert (
        "analysis: expected bodies that joints and springs hold, got 1 rigid motion that nothing resists"
        in message
    )
    assert "crank turns about (0, 0)" in message
    assert "rocker turns about (0.5, 0)" in message


def test_a_static_problem_without_joints_has_all_rigid_motions(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    text = path.read_text()
    path.write_text(
        text.replace("joints:\n  clamp: {type: clamp, at: beam.left}\n", "").replace(
            ", joint: clamp", ", at: beam.left"
        )
    )
    path.write_text(path.read_text().replace("  clamp: {type: reaction, at: beam.left}\n", ""))
    done = fmbs("check", path, "--json")
    assert done.code == 3
    assert "got 3 rigid motions that nothing resists" in done.json["message"]


def test_a_spring_holds_a_static_problem(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    pinned = path.read_text().replace("type: clamp", "type: pin")
    path.write_text(pinned)
    assert fmbs("check", path).code == 3
    path.write_text(
        pinned.replace(
            "loads:\n",
            "loads:\n  spring: {type: torsion_spring, at: beam.left, stiffness: 1 N m/rad}\n",
        )
    )
    assert fmbs("check", path).code == 0


def test_a_weight_that_hangs_on_a_spring_is_held(tmp_path: Path) -> None:
    """The spring resists across once the weight pulls it; a weight across it finds no equilibrium."""
    text = """
schema: 1
bodies: {load: {type: point_mass, mass: 500 kg, position: [1 m, 0, -2.8 m]}}
loads:
  weight: {type: gravity, acceleration: [0, 0, -9.81 m/s^2]}
  rope: {type: spring_damper, at: load, to: [1 m, 0, -0.3 m], stiffness: 1 MN/m, damping: 5 kN s/m}
analysis: {type: dynamic, duration: 1 s, step: 5 ms, start: equilibrium}
"""
    (path := tmp_path / "hung.yaml").write_text(text)
    assert fmbs("check", path).code == 0
    path.write_text(text.replace("acceleration: [0, 0, -9.81 m/s^2]", "acceleration: [0, 0, 0]"))
    assert "load moves along (1, 0, 0)" in fmbs("check", path).err
    path.write_text(text.replace(", stiffness: 1 MN/m", ", stiffness: 0 N/m"))
    done = fmbs("check", path, "--json")
    assert done.code == 3
    assert "3 rigid motions that nothing resists" in done.json["message"]


def test_redundant_rows_say_what_they_follow_from(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    path.write_text(
        path.read_text().replace("joints:\n", "joints:\n  second: {type: pin, at: beam.left}\n")
    )
    rows = {
        one["row"]: one["follows_from"] for one in fmbs("check", path, "--json").json["redundant"]
    }
    assert len(rows) == 2
    pairs = {frozenset((row, *others)) for row, others in rows.items()}
    assert pairs == {frozenset((f"clamp.{c}", f"second.{c}")) for c in "xy"}


def test_contradicting_joints_are_named_in_pairs(tmp_path: Path) -> None:
    path = scene(tmp_path, DYNAMIC)
    drives = "".join(
        f"  d{k}: {{type: driven_angle, at: beam.left, angle: {k} * t}}\n" for k in (1, 2)
    )
    path.write_text(
        path.read_text().replace("  clamp: {type: clamp,", f"{drives}  clamp: {{type: pin,")
    )
    done = fmbs("check", path, "--json")
    assert done.code == 3
    (row,) = (one["name"] for one in done.json["worst"])
    other = {"d1.angle": "d2.angle", "d2.angle": "d1.angle"}[row]
    assert f"{row} with {other}" in done.json["message"]


def test_mixed_units_are_told_and_strict_stops(tmp_path: Path) -> None:
    """7.85e-9 is steel in t/mm3."""
    path = scene(tmp_path, STATIC)
    path.write_text(
        path.read_text().replace("1 GPa, density: 1800 kg/m^3", "2.1e11, density: 7.85e-9")
    )
    done = fmbs("check", path, "--json")
    assert done.code == 0
    notices = "\n".join(done.json["notices"])
    assert "is it 7850 kg/m3, given in t/mm3?" in notices
    assert "wave speed" in notices
    assert "the mass 6.17e-13 kg is outside" in notices
    assert fmbs("check", path, "--strict").code == 3


def test_a_right_angle_without_its_unit_is_told(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    path.write_text(
        path.read_text().replace("    line: beam\n", "    line: beam\n    rotation: 90\n")
    )
    done = fmbs("check", path, "--json")
    assert done.code == 0
    assert "write '90 deg' if degrees are meant" in done.json["notices"][0]
    assert fmbs("check", path, "--strict").code == 3


def test_velocities_that_joints_change_are_reported_with_their_size(tmp_path: Path) -> None:
    """A link on a pin at its end, thrown along y with 1 m/s and inertia 0.1: L = m v l = 0.5 = (0.1
    + 0.25) w.
    """
    path = rigid_scene(
        tmp_path,
        {"bar": "0, 0 -> 1, 0"},
        {"pin": "{type: revolute, at: bar.A}"},
        initial="{bar: {velocity: [0, 1]}}",
    )
    found = fmbs("check", path, "--json").json
    assert found["initial"]["worst_velocities"] == [
        {"row": "pin.y", "gap": pytest.approx(1.0, rel=1e-12)}
    ]
    rate = 0.5 / 0.35
    left = (0.5 * rate) ** 2 + 0.1 * rate**2
    assert found["initial"]["energy_lost"] == pytest.approx(1 - left, rel=1e-9)
    changed = ((1 - 0.5 * rate) ** 2 + 0.1 * rate**2) ** 0.5
    linear, rest = (
        float(notice.split("projected onto the joints; that changes them by ")[1].split()[0])
        for notice in found["notices"]
    )
    assert (linear**2 + rest**2) ** 0.5 == pytest.approx(
        changed, rel=5e-3
    )  # linear joints first, then the axes that follow


def test_velocities_that_joints_stop_are_refused(tmp_path: Path) -> None:
    path = rigid_scene(
        tmp_path,
        {"bar": "0, 0 -> 1, 0"},
        {"pin": "{type: revolute, at: bar.A}"},
        initial="{bar: {velocity: [1, 0]}}",
    )
    done = fmbs("check", path, "--json")
    assert done.code == 3
    assert (
        "initial: expected velocities that the joints permit, got 100 % of their kinetic energy against pin.x by 1 m/s"
        in done.json["message"]
    )


def test_velocities_that_fit_are_not_changed(tmp_path: Path) -> None:
    motion = "{bar: {angular_velocity: 2}}"
    path = rigid_scene(
        tmp_path, {"bar": "0, 0 -> 1, 0"}, {"pin": "{type: revolute, at: bar.A}"}, initial=motion
    )
    found = fmbs("check", path, "--json").json
    assert found["initial"]["worst_velocities"] == []
    assert found["initial"]["energy_lost"] < 1e-12
    assert found["notices"] == []


@pytest.mark.parametrize("analysis", ["{type: static}", "{type: modes, count: 2}"])
def test_velocities_are_those_of_motions_alone(analysis: str, tmp_path: Path) -> None:
    """A drive moves at once, and the joints stop the initial motion: of an equilibrium and of modes
    neither is told.
    """
    text = CANTILEVER.replace(
        "outputs:", "initial: {{bodies: {{beam: {{velocity: [1, 0]}}}}}}\noutputs:"
    )
    drive = "  lift: {{type: driven_position, at: beam.right, displacement: [0, 0.1*t]}}\nloads:"
    for written in (text, text.replace("loads:", drive)):
        done = fmbs("check", scene(tmp_path, analysis, text=written), "--json")
        assert done.code == 0, done.err
        assert set(done.json["initial"]) == {"position_change"}
        assert not [notice for notice in done.json["notices"] if "initial velocities" in notice]
        assert [notice for notice in done.json["notices"] if "initial: does nothing" in notice]


def test_a_linkage_at_its_change_point_is_told(tmp_path: Path) -> None:
    """A parallelogram folded onto a line can go on as one or as its mirror image: two motions
    there, one beside it.
    """
    links = {"crank": "0, 0 -> 0.3, 0", "coupler": "0.3, 0 -> 1.3, 0", "rocker": "1.3, 0 -> 1, 0"}
    done = fmbs("check", rigid_scene(tmp_path, links, four_bar(2)), "--json")
    assert done.json["mechanism"]["at_start"] == 2
    assert any("2 degrees of freedom there, 1 near it" in notice for notice in done.json["notices"])


@pytest.mark.parametrize(
    ("name", "solver"),
    [
        ("double_pendulum", "band of half width 11"),
        ("crank_slider_coarse", "sparse LDL^T"),
        ("plate", "sparse LU"),
    ],
)
def test_the_solver_is_named(name: str, solver: str) -> None:
    found = fmbs("check", EXAMPLES / f"{name}.yaml", "--json").json["estimates"]
    assert found["solver"].startswith(solver)
    assert found["solver_memory_mb"] > 0
    assert found["wall_s"] > 0


def test_large_models_go_to_multigrid_where_factors_do_not_fit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(machine_memory, "free", lambda: 1e5)
    found = fmbs("check", EXAMPLES / "crank_slider_coarse.yaml", "--json").json["estimates"]
    assert found["solver"] == "conjugate gradients with multigrid"


def test_frames_without_mass_in_space(tmp_path: Path) -> None:
    """A link whose holes are rigid frames swings on one of them; a frame has neither mass nor
    stiffness of its own.
    """
    (tmp_path / "link.msh").write_bytes(
        (EXAMPLES.parent / "meshes" / "plate_crank_coarse.msh").read_bytes()
    )
    path = tmp_path / "link.yaml"
    path.write_text(
        "schema: 1\nname: link\ndimension: 3\nbodies:\n  link: {type: plate, mesh: link.msh, thickness: 3 mm, rims: {A: A, B: B},\n"
        "         material: {young_modulus: 70 GPa, density: 2700, poisson_ratio: 0.3}}\n"
        "joints:\n  A: {type: revolute, at: link.A, axis: [0, 0, 1]}\nanalysis: " + SHORT + "\n"
    )
    done = fmbs("check", path, "--json")
    assert done.code == 0, done.err
    assert done.json["mechanism"]["degrees_of_freedom"] == 1
    assert done.json["estimates"]["solver"].startswith("sparse LDL^T")


def test_modes_of_a_free_body_are_no_error(tmp_path: Path) -> None:
    path = rigid_scene(tmp_path, {"bar": "0, 0 -> 1, 0"}, {}, analysis="{type: modes, count: 3}")
    done = fmbs("check", path, "--json")
    assert (
        done.code,
        done.json["estimates"]["modes"],
        done.json["mechanism"]["degrees_of_freedom"],
    ) == (0, 3, 3)
    assert any("no joint ties" in notice for notice in done.json["notices"])


def test_a_cable_curved_in_space_is_named(tmp_path: Path) -> None:
    """Its modes about the reference would have frequency 0, eight of them with exit code 0 before;
    a run is told why it is limp.
    """
    text = """\
schema: 1
bodies:
  beam: {type: cable, mesh: arc_40.msh, section: {shape: given, EA: 10 kN, EI: 1 N m^2, rhoA: 1 kg/m}}
joints:
  clamp: {type: clamp, at: beam.left}
analysis: {type: modes, count: 8}
"""
    shutil.copy(ROOT / "meshes" / "arc_40.msh", tmp_path)
    path = tmp_path / "arc.yaml"
    path.write_text(text, encoding="utf-8")
    for command in ("check", "run"):
        done = fmbs(command, path, "--out", tmp_path / "out")
        assert done.code == 3
        assert re.search(
            r"arc\.yaml:6: analysis: expected straight cables.*'beam', which is curved in space.*dimension 2",
            done.err,
        )
    path.write_text(
        text.replace("modes, count: 8", "dynamic, duration: 10 ms, step: 1 ms"), encoding="utf-8"
    )
    for command in ("check", "run"):
        done = fmbs(command, path, "--json", "--out", tmp_path / "out")
        assert done.code == 0
        assert any("body 'beam' is curved in space" in notice for notice in done.json["notices"])
    path.write_text(text.replace("schema: 1", "schema: 1\ndimension: 2"), encoding="utf-8")
    assert fmbs("run", path, "--json", "--out", tmp_path / "flat").json["frequencies_hz"][0] > 0.1


def test_a_locked_rigid_linkage_is_told(tmp_path: Path) -> None:
    """3 * 3 - 4 * 2 - 3 = -2, nothing is left."""
    joints = {**four_bar(2), "lock": "{type: weld, at: coupler.A, to: ground}"}
    done = fmbs("check", rigid_scene(tmp_path, LINKS, joints), "--json")
    assert (done.json["mechanism"]["gruebler"], done.json["mechanism"]["degrees_of_freedom"]) == (
        -2,
        0,
    )
    assert {one["row"].partition(".")[0] for one in done.json["redundant"]} <= set(joints)
    assert any("nothing can move" in notice for notice in done.json["notices"])


def test_small_systems_are_dense_and_their_trajectory_is_three_arrays(tmp_path: Path) -> None:
    """1001 states of q, q', q'' with 18 - 8 = 10 unknowns of 8 bytes."""
    found = fmbs("check", rigid_scene(tmp_path, LINKS, four_bar(2)), "--json").json
    assert found["estimates"]["solver"] == "dense Cholesky or LU"
    assert found["unknowns"] == 10
    assert found["estimates"]["memory_mb"] == pytest.approx(3 * 8e-6 * 1001 * 10, abs=5e-4)


def test_the_mesh_of_a_plate_is_measured() -> None:
    """plate_16x1.msh: rectangles of 10/16 by 1 m."""
    (plate,) = fmbs("check", EXAMPLES / "plate.yaml", "--json").json["bodies"]
    assert plate["mesh"]["aspect"] == pytest.approx(1.6, rel=1e-9)
    assert plate["mesh"]["angle"] == pytest.approx(90.0, rel=1e-9)
    assert plate["rigid_motions"] == 6


def test_schema_is_that_of_the_scenes(tmp_path: Path) -> None:
    expected = json.loads(json.dumps(json_schema()))
    assert fmbs("schema").json == expected
    assert fmbs("schema", "--json", "--out", tmp_path).json == expected
    assert json.loads((tmp_path / "scene.schema.json").read_text()) == expected
    assert fmbs("schema", "--out", tmp_path).code == 3


def is_own(kind: type) -> bool:
    """Whether a class is one of the package, beside those that other tests declare."""
    return kind.__module__.startswith("fmbs_skfem.")


def test_the_example_of_every_word_is_read() -> None:
    """The last line of each docstring is what a scene says, in the plane or in space."""
    parameters = {"speed": units.measure("1 rad/s")}
    for family in Declared.__subclasses__():
        for word, kind in family.known.items():
            if is_own(kind):
                (example,) = reference.EXAMPLE.findall(inspect.cleandoc(kind.__doc__ or ""))
                assert any(
                    reads(family, kind, example, fields.Context(dim, parameters)) for dim in (2, 3)
                ), (word, example)


def reads(family: type[Declared], kind: type, text: str, context: fields.Context) -> bool:
    try:
        found = mappings.read_family(family, YAML(typ="safe").load(text), context)
    except (Problem, Problems):
        return False
    return type(found) is kind and not list(found.problems(context.dimension))


def test_the_page_of_the_schema_is_the_one_in_the_documentation() -> None:
    """Made anew by `fmbs schema --page > docs/scene_reference.md`."""
    page = fmbs("schema", "--page").out
    assert page == (ROOT / "docs" / "scene_reference.md").read_text(encoding="utf-8")
    titles = {
        word
        for line in page.splitlines()
        if line.startswith("### ")
        for word in re.findall("`([^`]*)`", line)
    }
    assert titles >= {
        word
        for family in Declared.__subclasses__()
        for word, kind in family.known.items()
        if is_own(kind)
    }
    assert {"material", "motion", "spin", "hyper_reduction_choice"} < titles
    assert "| `diameter` | a length [m] > 0 | |" in page
    assert "| `interpolation` | `ancf` or `fvs` or `bfs` or `argyris` | (none) |" in page
    sections = [
        "box",
        "c_section",
        "circular",
        "given",
        "hollow",
        "i_section",
        "l_section",
        "matrices",
        "polygon",
        "rectangular",
        "rolled",
        "t_section",
        "tapered",
        "tube",
        "z_section",
    ]
    assert f"| `section` | {' or '.join(f'[{one}](#{one})' for one in sections)} | |" in page


def test_a_plate_with_a_rim_is_one_piece(tmp_path: Path) -> None:
    """The axis of a rim across the plate has no mass, and is no piece."""
    shutil.copy(ROOT / "meshes" / "plate_crank_coarse.msh", tmp_path)
    (tmp_path / "crank.yaml").write_text(
        "schema: 1\ndimension: 3\nbodies:\n"
        "  c: {type: plate, mesh: plate_crank_coarse.msh, thickness: 5 mm, rims: {hole: {edges: A}},\n"
        "    material: {young_modulus: 70 GPa, density: 2700, poisson_ratio: 0.3}}\njoints: {j: {type: clamp, at: c.hole}}\n"
        "analysis: {type: static}\n"
    )
    assert [
        one["pieces"] for one in fmbs("check", tmp_path / "crank.yaml", "--json").json["bodies"]
    ] == [1]


def test_check_says_where_bodies_are(tmp_path: Path) -> None:
    """Two squares of one shell that stand apart, in millimetres, and a mass point."""
    square = {"degree": [1, 1], "knots": [[0, 0, 1, 1], [0, 0, 1, 1]]}
    corners = [[[[x + i, y, 2] for y in (0, 1)] for x in (0, 1)] for i in (0, 5)]
    patches = [{"name": f"p{i}", **square, "control": control} for i, control in enumerate(corners)]
    (tmp_path / "two.json").write_text(
        json.dumps({"format": "fmbs-nurbs", "version": 1, "patches": patches})
    )
    path = tmp_path / "two.yaml"
    path.write_text(
        "schema: 1\nname: two\ndimension: 3\nbodies:\n"
        "  sheet: {type: shell, nurbs: two.json, unit: mm, join: false, degree: 2, thickness: 0.1 mm,\n"
        "    material: {young_modulus: 1 GPa, density: 1000}}\n"
        "  ball: {type: point_mass, mass: 1 kg, position: [1, 2, 3]}\n"
        "analysis: {type: dynamic, duration: 1 ms, step: 1 ms}\n"
    )
    sheet, ball = fmbs("check", path, "--json").json["bodies"]
    assert [*sheet["box"][0], *sheet["box"][1]] == pytest.approx([0, 0, 0.002, 0.006, 0.001, 0.002])
    assert sheet["area"] == pytest.approx(2e-6)
    assert (sheet["length"], sheet["pieces"], len(sheet["places"])) == (None, 2, 8)
    assert sheet["places"]["p1.corner_10"] == pytest.approx([0.006, 0, 0.002])
    assert ball["places"] == {"center": [1, 2, 3]}
    assert (ball["box"], ball["area"], ball["pieces"]) == ([[1, 2, 3], [1, 2, 3]], None, 1)
    text = fmbs("check", path, "--all").out
    assert re.search(r"sheet +\(0, 0, 2\) +\(6, 1, 2\) +2e-06 m2 +2\n", text)
    assert re.search(r"sheet\.p1\.corner_10 +\(6, 0, 2\)\n", text)
