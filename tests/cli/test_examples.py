"""The Python scripts of `examples` give the numbers of the scene files, and the scenes of plates
those of the literature.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes, studies
from fmbs_skfem.scenes import build
from verification import rigid

from .calls import EXAMPLES, fmbs


def script(name: str) -> Callable[..., dict[str, float]]:
    """The function `main` of a script."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found: Callable[..., dict[str, float]] = module.main
    return found


def test_spin_up_is_its_scene(tmp_path: Path) -> None:
    found = script("spin_up")(duration=0.1)
    other = fmbs(
        "run",
        EXAMPLES / "spin_up.yaml",
        "--json",
        "--out",
        tmp_path / "out",
        "--duration",
        "0.1",
        "--no-plots",
    ).json
    assert (
        (found["dofs"], found["constraints"]) == (other["dofs"], other["constraints"]) == (404, 3)
    )
    assert found["final_deflection"] == pytest.approx(
        other["outputs"]["tip_deflection"]["final"], abs=1e-9
    )
    assert found["final_deflection"] < -1e-6


def test_double_pendulum_is_its_scene_and_its_reduced_model_follows(tmp_path: Path) -> None:
    found = script("double_pendulum")(duration=0.2)
    other = fmbs(
        "run",
        EXAMPLES / "double_pendulum.yaml",
        "--json",
        "--out",
        tmp_path / "out",
        "--duration",
        "0.2",
        "--no-plots",
    ).json
    assert found["dofs"] == other["dofs"] == 1212
    assert [found[f"C_{axis}"] for axis in "xyz"] == pytest.approx(
        [other["outputs"][f"C_{axis}"]["final"] for axis in "xyz"], abs=1e-6
    )
    assert found["modes"] < 60
    assert found["max_error"] < 1e-4


def test_plate_bends_as_published(tmp_path: Path) -> None:
    """Sze, Liu, Lo 2004, doi 10.1016/j.finel.2003.11.001, section 3.1, without shear strains: W =
    6.6999, -U = 3.2895 at P = 4.
    """
    found = fmbs(
        "run", EXAMPLES / "plate.yaml", "--json", "--out", tmp_path / "out", "--no-plots"
    ).json
    assert found["outputs"]["W"]["final"] == pytest.approx(6.6999, abs=3e-4)
    assert 10.0 - found["outputs"]["x"]["final"] == pytest.approx(3.2895, abs=3e-4)


def test_the_lightest_bracket_is_that_of_beam_theory() -> None:
    """h = 2 b and h^4 = 8 P L^3 / (E w), 0.02857 m; scipy's SLSQP around runs of the scene. Large
    deflection counts for 0.05 %.
    """
    found, h = script("light_bracket")(), (8.0 * 5.0 / (3e9 * 0.02)) ** 0.25
    assert (found["h"], found["b"]) == pytest.approx((h, h / 2.0), rel=1e-3)
    assert found["deflection"] == pytest.approx(0.02, rel=1e-5)
    assert found["runs"] < 100


def test_an_arm_under_lqr_comes_to_rest() -> None:
    """As the linear loop predicts with four modes, within 1 %; from 1 rad/s, with an amplitude
    above 5 % of the length.
    """
    found = script("lqr_arm")(duration=1.2)
    assert found["most"] > 0.05
    assert abs(found["end"]) < 0.02 * found["most"]
    assert found["error"] < 1e-2


def test_an_arm_learns_to_swing() -> None:
    """Random search over a feedback: the best of the last round stays nearer to the goal than that
    of the first.
    """
    found = script("reinforcement")()
    assert found["last"] < 0.9 * found["first"]
    assert script("reinforcement")(rounds=1, threads=1)["first"] == found["first"]


def test_roof_sinks_as_published(tmp_path: Path) -> None:
    """Scordelis, Lo 1964 by thin-shell theory: 0.3006 m under the whole load, to 0.5 per mille."""
    found = fmbs(
        "run", EXAMPLES / "roof.yaml", "--json", "--out", tmp_path / "out", "--no-plots"
    ).json
    edge = found["outputs"]["edge"]
    assert 1e4 * (edge["max"] - edge["final"]) == pytest.approx(0.3006, rel=5e-4)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_scene_is_sound(path: Path) -> None:
    """Its system is built, in the form in which it is solved."""
    scene = scenes.read(path)
    system = build.chosen_form(scene, build.system(scene))
    assert system.size > 0
    assert (
        bool([column for output in system.outputs.values() for column in output.columns])
        == scene.analysis.has_outputs
    )


def test_a_strip_is_rolled_up_to_a_circle() -> None:
    """By M = 2 pi E I / L, closed form: its end comes back to the clamp."""
    found = studies.run(EXAMPLES / "rolled_up.yaml")
    assert max(abs(found.outputs[f"tip_{axis}"][-1]) for axis in "xy") < 1e-5


def test_a_deep_arch_falls_over_at_its_published_load() -> None:
    """DaDeppo, Schmidt 1975, doi 10.1115/1.3423734: 8.97 E I / R^2; the scene pushes with ten times
    E I / R^2.
    """
    motion = studies.run(EXAMPLES / "deep_arch.yaml").trajectory
    first = int(dynamics.limit_points(motion)[0])
    assert 10.0 * motion.times[first] == pytest.approx(8.97, rel=2e-3)


def test_becks_column_flutters_at_its_published_load() -> None:
    """Beck 1952, doi 10.1007/BF02008828: 20.05 E I / L^2."""
    grown = []
    for load in (20.0, 20.1):
        scene = scenes.read(EXAMPLES / "beck_column.yaml", parameters={"P": load})
        pressed = dynamics.solve_statics(build.chosen_form(scene, build.system(scene)), 1)
        linear = dynamics.linearise(pressed.system, pressed.x[-1], t=1.0)
        grown.append(float(dynamics.complex_modes(linear, 2).eigenvalues.real.max()))
    assert grown[0] < 1e-6
    assert grown[1] > 0.1


def test_a_heavy_top_precesses_as_published() -> None:
    """Bruels, Cardona 2010, doi 10.1115/1.4001370: its centre over 0.5 s, to the error of the step."""
    found = studies.run(EXAMPLES / "heavy_top.yaml", duration=0.5)
    for time in (0.1, 0.2, 0.5):
        sample = int(np.argmin(np.abs(found.times - time)))
        center = [found.outputs[f"center_{axis}"][sample] for axis in "xyz"]
        assert center == pytest.approx(rigid.TOP[time][0], abs=2e-3)


def test_gears_turn_in_the_ratio_of_their_teeth() -> None:
    found = studies.run(EXAMPLES / "planetary_gear.yaml", duration=0.3)
    np.testing.assert_allclose(
        found.outputs["carrier"], found.outputs["sun"] / (1 + 60 / 20), atol=1e-9
    )
    assert found.outputs["sun"][-1] > 0.5
    geared = studies.run(EXAMPLES / "geared_arm.yaml")
    assert geared.outputs["wheel"][-1] == pytest.approx(-300 * np.pi / 30 / 5, rel=1e-3)


def test_a_trolley_bends_its_girder() -> None:
    """At rest P a (3 L^2 - 4 a^2) / 48 EI + 5 q L^4 / 384 EI, and a little shear; it stops where
    its drive says.
    """
    found = studies.run(EXAMPLES / "overhead_crane.yaml", duration=3.6)
    EI, P, q = (
        210e9 * (0.1 * 0.16**3 - 0.094 * 0.142**3) / 12.0,
        650.0 * 9.81,
        7850.0 * (2 * 9e-4 + 0.142 * 6e-3) * 9.81,
    )
    deflection = P * (3 * 6.0**2 - 4) / (48 * EI) + 5 * q * 6.0**4 / (384 * EI)
    assert found.outputs["middle"][0] == pytest.approx(-deflection, rel=2e-2)
    assert found.outputs["place"][-1] == pytest.approx(5.0, abs=1e-9)
    assert found.outputs["wheels_z"][0] == pytest.approx(P, rel=1e-6)


def test_a_frame_with_a_motor_is_reduced() -> None:
    """Points of beams are chosen by the energy of forces: chosen by forces the same number of them
    errs by half of a range.
    """
    found = studies.reduce(EXAMPLES / "frame_with_motor.yaml", duration=0.4)
    assert found.report["points"]["frame"] < 60
    errors = found.report["output_errors"]
    assert (
        max(errors[f"{name}_{axis}"]["relative"] for name in ("tip", "corner") for axis in "xyz")
        < 5e-3
    )


def test_a_trapeze_is_let_go_and_caught(tmp_path: Path) -> None:
    """The report has its events, and outputs follow: the hand has no force in flight, and does not
    move after the catch.
    """
    found = studies.run(EXAMPLES / "trapeze.yaml", out=tmp_path / "out")
    fly, catch, end = found.report["events"]
    assert [one["name"] for one in (fly, catch, end)] == ["fly", "catch", "end"]
    assert found.times[-1] == end["time"] == pytest.approx(1.1, abs=1e-12)
    at = [int(np.searchsorted(found.times, one["time"])) for one in (fly, catch)]
    assert found.outputs["swing"][at[0]] == pytest.approx(np.deg2rad(-150.0), abs=2e-2)
    assert np.ptp(found.outputs["grip_y"][at[1] :]) < 1e-10
    assert not found.outputs["held_y_locked"][: at[1]].any()
    assert (
        np.ptp(found.outputs["E_balance"]) < 5e-3 * found.outputs["E_kinetic"].max()
    )  # damping behind the catch is faster than a step
    assert "Events" in [view.title for view in found.lines if hasattr(view, "title")]


def test_a_sampled_arm_holds_its_goal() -> None:
    """At the end, with the torque that its weight asks for about the hinge."""
    found = studies.run(EXAMPLES / "sampled_arm.yaml")
    assert found.outputs["hinge"][-1] == pytest.approx(0.9, abs=1e-3)
    mass = 1800 * np.pi * 0.01**2
    weight = 9.81 * (mass * 0.5 + 0.1) * found.outputs["tip_x"][-1]
    assert found.outputs["drive_torque"][-1] == pytest.approx(weight, rel=3e-2)


RING = np.sqrt(3e9 * 2e-3**2 / 12 / (1200 * 0.2**4))  #: sqrt(E I / (rho A R^4)) of the hoop [rad/s]
MOUNTS = 4.0 * np.array(
    [1e5 / 100, 1e5 / 100, 2e5 / 100, 1e5 * 0.13 / 6, 2e5 * 0.04 / 3, 2e5 * 0.09 / 5]
)


@pytest.mark.parametrize(
    ("name", "expected", "tolerance"),
    [
        (
            "hoop_modes",
            [RING * n * (n**2 - 1) / np.sqrt(n**2 + 1) for n in (2, 2, 3, 3, 4, 4)],
            1e-3,
        ),
        (
            "plate_modes",
            np.array([13.468, 19.596, 24.270, 34.801, 34.801])
            * np.sqrt(70e9 * 2e-3**2 / (12 * 0.91 * 2700)),
            4e-3,
        ),
        ("engine_mounts", np.sqrt(MOUNTS), 1e-9),
    ],
)
def test_frequencies_are_those_of_theory(
    name: str, expected: Sequence[float], tolerance: float
) -> None:
    """Ring: Hoppe 1871; square plate: Leissa 1973, doi 10.1016/S0022-460X(73)80371-2; mounts:
    sqrt(k/m) and sqrt(k r^2/I).
    """
    found = 2 * np.pi * np.asarray(studies.run(EXAMPLES / f"{name}.yaml").frequencies)
    np.testing.assert_allclose(found[-len(expected) :], expected, rtol=tolerance)


def test_a_controlled_arm_reduced(tmp_path: Path) -> None:
    """Reduced and hyper-reduced arms follow the full one to 1e-3 of the stroke; all of them reach
    their goal.
    """
    run = fmbs(
        "run", EXAMPLES / "controlled_arm.yaml", "--json", "--out", tmp_path / "run", "--no-plots"
    ).json
    assert run["outputs"]["hinge"]["final"] == pytest.approx(0.9, abs=2e-3)
    done = fmbs(
        "compare",
        EXAMPLES / "controlled_arm.yaml",
        "--json",
        "--no-picture",
        "--out",
        tmp_path / "out",
    ).json
    assert len(done["models"]) > 2
    for model in done["models"]:
        assert model["status"] == "done"
        for name in ("hinge", "tip_x", "tip_y", "drive_torque"):
            assert model["outputs"][name]["relative"] <= 1e-3
