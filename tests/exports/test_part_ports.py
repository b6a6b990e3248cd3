"""Parts whose places are ports: in C, against the package with the same forces, and as an FMU that
another program holds.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fmbs_skfem import dynamics, studies
from fmbs_skfem.bodies.body import Body, reference_at
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.bodies.sections import Material
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton
from fmbs_skfem.exports import c_files, fmu, part_ports, terminals
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.parts.excitation import Excitation, excite
from fmbs_skfem.systems import At, Motion, assemble, eliminate, signals
from fmbs_skfem.systems.forces import loads, springs
from fmbs_skfem.systems.measures import orientations, probes
from tests.exports.c_library import COMPILER, CRun
from tests.exports.test_fmu import Instance, made_by
from tests.reduction.test_beam_parts import bar
from verification.vibration import ring

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

ARM = Path(__file__).resolve().parents[2] / "examples" / "parts" / "arm.part.h5"
# at 1e-15 corrections are the round-off of positions: a step of some runs was divided by it, which
# changed the motion by 1e-5; at 1e-14 C and Python differ by 5e-11 of the motion in 90 runs moved
# by 1e-15, and no step is divided
SHARP = Newton(tolerance=1e-14)


def trained(full: Body, modes: int, step: float) -> Body:
    """A full body with few functions, moved alone for a moment."""
    states = excite(full, Excitation(runs=2, duration=100 * step, step=step, samples=50))
    return parts.reduced_body(full, parts.shape_functions(full, states, None, modes))


@cache
def arm() -> Body:
    return part_files.load(ARM).body


@cache
def link() -> Body:
    """A curved shell, whose corners do not turn: they take forces alone."""
    return part_files.load(ARM.with_name("link.part.h5")).body


@cache
def bent() -> Body:
    """A beam with torsion, whose sections turn."""
    return trained(bar("bar"), 12, 1e-3)


@cache
def wheel() -> Body:
    """A ring in the plane with rigid frames at both of its rims."""
    rims = {"hub": Rim(("inner",), (0.0, 0.0)), "tyre": Rim(("outer",), (0.0, 0.0))}
    return trained(
        plate("wheel", ring(0.1, 0.3, 8), 0.01, Material(2e8, 7800.0, 0.3), dim=2, rims=rims),
        8,
        1e-3,
    )


@cache
def washer() -> Body:
    """A thin ring in space on rigid frames, whose third axes have no mass."""
    rims = {"hub": Rim(("inner",)), "edge": Rim(("outer",))}
    part = plate("washer", ring(0.1, 0.3, 8), 5e-3, Material(2e8, 1000.0, 0.3), dim=3, rims=rims)
    return trained(part, 8, 2e-3)


PUSHED = {
    "left.force_y": 0.4,
    "left.torque_z": -0.02,
    "right.force_x": -0.2,
    "right.force_z": 0.3,
    "right.torque_y": 0.03,
}
CASES = {
    "a cable in space": (arm, (0.0, 0.0, -9.81), PUSHED, 1e-3),
    "a shell": (
        link,
        (0.0, 0.0, -9.81),
        {"corner_00.force_z": 2.0, "corner_11.force_x": -1.0, "corner_10.force_y": 0.5},
        5e-4,
    ),
    "a beam with torsion": (bent, (), PUSHED | {"right.torque_x": 1e-3}, 4e-4),
    "a plate with rims in the plane": (
        wheel,
        (0.0, -9.81),
        {"hub.torque": 3.0, "tyre.force_x": 5.0, "tyre.torque": -1.0},
        1e-4,
    ),
    "a plate with rims in space": (
        washer,
        (0.0, 0.0, -9.81),
        {"hub.force_z": 3.0, "edge.force_x": 2.0, "edge.torque_y": 0.1},
        2e-4,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_part_moves_in_c_as_in_python(name: str, tmp_path: Path) -> None:
    """Waves along a part follow no step: rates of sections repeat to 1e-7 in Python itself, with
    other storages of one system.
    """
    make, gravity, told, step = CASES[name]
    case = replace(part_ports.case_of(make(), GeneralizedAlpha(step), 0.3, gravity), newton=SHARP)
    model = c_files.write(case, "part", "a part")
    run = CRun(model, tmp_path)
    for key, value in told.items():
        run.set("input", list(model.inputs).index(key), value)
    got = run.run(200, 10)
    given = signals.with_inputs(case.system, {key: of_time(value) for key, value in told.items()})
    columns = dynamics.outputs(dynamics.integrate(given, case.scheme, 200 * step, case.newton, 10))
    for unit, largest in {"m": 1e-9, "m/s": 1e-8, "": 1e-6, "rad": 1e-9, "rad/s": 1e-6}.items():
        some = [k for k, one in enumerate(model.columns) if one.unit == unit]
        exact = (
            np.stack([columns[model.columns[k].name] for k in some], axis=1)
            if some
            else np.zeros((1, 1))
        )
        size = np.ptp(exact, axis=0).max()
        assert not some or np.abs(got[:, some] - exact).max() < largest * size, unit


def test_places_have_units_and_start_in_the_reference() -> None:
    case = part_ports.case_of(arm(), GeneralizedAlpha(1e-3), 0.3)
    model = c_files.write(case, "part", "a part")
    assert model.inputs["left.force_x"] == ("N", 0.0)
    assert model.inputs["right.torque_z"] == ("N m", 0.0)
    assert len(model.inputs) == 12
    units = {one.name: one.unit for one in model.columns}
    assert units["left.position_x"] == "m"
    assert units["left.velocity_y"] == "m/s"
    assert units["right.slope_z"] == ""
    assert units["right.angular_velocity_z"] == "rad/s"
    assert model.left_out == ()
    start = dynamics.outputs(dynamics.integrate(case.system, case.scheme, 1e-3, case.newton))
    for place in ("left", "right"):
        found = [start[f"{place}.position_{axis}"][0] for axis in "xyz"]
        np.testing.assert_allclose(found, reference_at(arm(), place), atol=1e-14)


def test_the_rotation_of_a_frame_is_that_of_its_axes() -> None:
    """A rigid body that turns about an axis, against Rodrigues' formula; its angular velocity is
    the one it was given.
    """
    spin = np.array([1.0, -2.0, 0.5])
    body = rigid("top", 2.0, np.eye(3) * 0.1, (0.1, 0.2, 0.3))
    read = {
        "R": orientations.Rotation(At("top", "frame")),
        "w": probes.AngularVelocity(At("top", "frame")),
    }
    start = {"top": Motion(angular_velocity=tuple(spin), center=(0.1, 0.2, 0.3))}
    found = dynamics.outputs(
        dynamics.integrate(
            assemble([body], outputs=read, initial=start), GeneralizedAlpha(1e-4), 0.5, SHARP
        )
    )
    exact = Rotation.from_rotvec(0.5 * spin).as_matrix()
    got = np.array([[found[f"R_{i}{j}"][-1] for j in "xyz"] for i in "xyz"])
    np.testing.assert_allclose(got, exact, atol=1e-7)
    np.testing.assert_allclose(
        [found[f"w_{i}"] for i in "xyz"], np.outer(spin, np.ones(5001)), atol=1e-6
    )


def held(
    unit: Instance, span: float, steps: int, anchor: np.ndarray, k: float, d: float
) -> np.ndarray:
    """Positions (s, 3) of the right end of an arm whose left end a spring and a damper hold, forces
    constant over each span.
    """
    names = [one.name for one in unit.description.modelVariables]
    push = [names.index(f"left.force_{axis}") for axis in "xyz"]
    place, speed = (
        [names.index(f"left.{what}_{axis}") for axis in "xyz"] for what in ("position", "velocity")
    )
    tip, found = [names.index(f"right.position_{axis}") for axis in "xyz"], []
    unit.start()
    for n in range(steps):
        arm = np.array(unit.get(place)) - anchor
        length = np.linalg.norm(arm)
        rate = np.array(unit.get(speed)) @ arm / length
        unit.set(push, (-(k * (length - LENGTH) + d * rate) * arm / length).tolist())
        unit.unit.doStep(n * span, span)
        found.append(unit.get(tip))
    unit.unit.terminate()
    unit.unit.reset()
    return np.array(found)


LENGTH = 0.2  #: of a spring without force [m]


def test_an_arm_that_another_program_holds_by_a_spring_hangs_as_in_the_package(
    tmp_path: Path,
) -> None:
    """An explicit coupling is of first order in its step; FMPy steps the arm, the spring is the
    program's own.
    """
    step, duration, k, d, g = 1e-4, 0.3072, 60.0, 0.4, (0.0, 0.0, -9.81)
    anchor = reference_at(arm(), "left") + np.array([0.0, 0.0, LENGTH])
    spring = springs.SpringDamper(
        "spring", At("arm", "left"), tuple(anchor), stiffness=k, damping=d
    )
    read = {"tip": probes.Position(At("arm", "right"))}
    whole = eliminate(
        assemble(
            [parts.placed(arm(), "arm", check=False)], [], [loads.Gravity(g), spring], outputs=read
        )
    )
    columns = dynamics.outputs(dynamics.integrate(whole, GeneralizedAlpha(step), duration))
    exact = np.stack([columns[f"tip_{axis}"] for axis in "xyz"], axis=1)
    made = c_files.write(
        part_ports.case_of(arm(), GeneralizedAlpha(step), duration, g), "arm", "an arm"
    )
    unit = Instance(made_by(fmu.write(made, 2, "an arm"), tmp_path / "arm.fmu"), tmp_path / "unit")
    errors = []
    for many in (32, 16, 8):
        found = held(unit, many * step, round(duration / step / many), anchor, k, d)
        errors.append(np.abs(found - exact[many::many]).max())
    assert np.ptp(exact, axis=0).max() > 0.3
    assert errors[-1] < 5e-4
    # a force is known H late at most, H / 2 in the mean
    assert np.allclose(np.array(errors[:-1]) / errors[1:], 2.0, rtol=0.02)


def test_places_are_terminals() -> None:
    """With forces in and motions out; a model without such ports has none."""
    made = c_files.write(part_ports.case_of(arm(), GeneralizedAlpha(1e-4), 0.1), "arm", "an arm")
    for version in (2, 3):
        unit = fmu.write(made, version, "an arm")
        root = ElementTree.fromstring(unit.files["terminalsAndIcons/terminalsAndIcons.xml"])
        found = {
            one.get("name"): {
                member.get("memberName"): member.get("variableKind") for member in one
            }
            for one in root.iter("Terminal")
        }
        assert list(found) == ["left", "right"]
        assert found["left"]["force_x"] == found["left"]["torque_z"] == "inflow"
        assert found["left"]["position_x"] == found["left"]["velocity_y"] == "signal"
        names = {one.name for one in unit.variables}
        members = {one.get("variableName") for one in root.iter("TerminalMemberVariable")}
        assert members == {name for name in names if "." in name}
    assert terminals.describe([("u", "input"), ("tip.position_x", "output")]) is None


def test_the_command_exports_a_part(tmp_path: Path) -> None:
    told = studies.export_model(
        ARM,
        c=tmp_path,
        step=1e-3,
        gravity="0, 0, -9.81 m/s^2",
        parameters={"young_modulus": "2 GPa"},
    )
    assert told.report["step"] == 1e-3
    assert told.report["name"] == "arm"
    header = (tmp_path / "arm.h").read_text()
    assert "#define arm_INPUT_LEFT_TORQUE_X 3 /* [N m] */" in header
    assert "gravity [0.0, 0.0, -9.81] m/s^2 acts on it" in header
    for wrong, said in (
        ({"gravity": "0, -9.81"}, "3 accelerations, x, y, z"),
        ({"gravity": "0, 0, 1 kg"}, "--gravity"),
        ({"parameters": {"E": "2 GPa"}}, "a number that scales it"),
        ({"parameters": {"young_modulus": "2 m"}}, "--set young_modulus"),
    ):
        with pytest.raises(InputError, match=said):
            studies.export_model(ARM, c=tmp_path / "other", **wrong)  # type: ignore[arg-type]


def test_what_is_no_part_with_mass_and_places_is_refused() -> None:
    with pytest.raises(InputError, match="named places, which are its ports"):
        part_ports.system_of(replace(arm(), places={}))
    with pytest.raises(InputError, match="--c"):
        studies.export_model(ARM)
