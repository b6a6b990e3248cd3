"""Linear systems from inputs to outputs: closed forms, a motion with a small chirp, reduced
systems, files.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from fmbs_skfem import dynamics, scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, StateSpace, integrate
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build
from fmbs_skfem.scenes.analyses.analysis import StateTable
from fmbs_skfem.systems.signals import with_inputs
from fmbs_skfem.systems.system import change_coordinates

MESHES = Path(__file__).parents[2] / "meshes"
HANGING = """\
schema: 1
name: hanging
dimension: 3
inputs: {u: {unit: N}, angle: {unit: rad}}
bodies:
  I: &beam
    type: cable
    mesh: beam_5.msh
    section: {shape: circular, diameter: 10 mm}
    material: {young_modulus: 1 GPa, density: 1800 kg/m^3}
    rotation: {axis: [0, 1, 0], angle: 90 deg}
  II: {<<: *beam, origin: [0, 0, -1]}
joints:
  A: {type: spherical, at: I.left}
  B: {type: spherical, at: I.right, to: II.left}
loads:
  weight: {type: gravity, acceleration: [0, 0, -9.81 m/s^2]}
  push: {type: control_force, at: I.right, direction: [1, 0, 0], force: u}
damping: {mass: 2.5}
analysis: {type: linearise}
outputs:
  C: {type: position, at: II.right, component: x}
  R: {type: reaction, joint: A}
"""
MASS = """\
schema: 1
name: mass
dimension: 2
parameters: {one: 1 N}
inputs: {u: {unit: N, start: 2}}
bodies: {block: {type: point_mass, mass: 3 kg, position: [1, 0]}}
joints: {rail: {type: slider, at: block, direction: [1, 0]}}
loads:
  spring: {type: spring_damper, at: block, to: [0, 0], stiffness: 50 N/m, damping: 1.5 N s/m}
  push: {type: control_force, at: block, direction: [1, 0], force: "u + 0.1 * u**2 / one"}
analysis: {type: linearise, about: reference}
outputs:
  x: {type: position, at: block, component: x}
  v: {type: velocity, at: block, component: x}
  push: {type: load, load: push}
"""


def found(text: str) -> StateTable:
    scene = scenes.loads(text, MESHES)
    analysis = scene.analysis
    assert isinstance(analysis, scenes.analyses.linearisation.Linearise)
    return analysis.find(scene)


@pytest.fixture(scope="module")
def hanging() -> StateTable:
    return found(HANGING.replace(", angle: {unit: rad}", ""))


def space_of(table: StateTable) -> StateSpace:
    assert table.linear is not None
    return table.linear


def chirp(t: np.ndarray) -> np.ndarray:
    """0.1 mN that sweeps from 0.1 to 4 Hz in 6 s, and rests after that [N]."""
    s = np.clip(np.asarray(t, dtype=float) / 6.0, 0.0, 1.0)
    return 1e-4 * np.sin(2.0 * np.pi * 6.0 * (0.1 * s + 0.5 * 3.9 * s * s)) * np.sin(np.pi * s) ** 2


def test_a_double_pendulum_that_hangs_answers_a_small_chirp(hanging: StateTable) -> None:
    """Example 2 under its weight: transfer functions of the nonlinear motion, within 1 % of the
    largest.
    """
    space, h = space_of(hanging), 4e-3
    system = replace(
        with_inputs(hanging.reduced, {"u": chirp}), x0=space.x, v0=np.zeros_like(space.x)
    )
    motion = integrate(system, GeneralizedAlpha(h, rho_inf=0.95), 12.0)
    columns = dynamics.outputs(motion)
    omega = 2.0 * np.pi * np.linspace(0.3, 3.0, 40)
    waves = np.exp(-1j * np.outer(omega, motion.times))
    exact = space.transfer(omega)[:, :, 0]
    for name, number in (("C", 0), ("R_x", 1)):
        answer = waves @ (columns[name] - columns[name][0]) / (waves @ chirp(motion.times))
        assert np.abs(answer - exact[:, number]).max() < 1e-2 * np.abs(exact[:, number]).max()


def test_a_mass_on_a_spring_has_its_closed_form() -> None:
    """x / u = (1 + 0.2 u0) / (m s^2 + c s + k) with a force u + 0.1 u^2 about u0 = 2."""
    space = space_of(found(MASS))
    omega = np.array([0.0, 1.0, 4.0, 30.0])
    exact = 1.4 / (3.0 * (1j * omega) ** 2 + 1.5j * omega + 50.0)
    np.testing.assert_allclose(space.transfer(omega)[:, 0, 0], exact, rtol=1e-7)
    np.testing.assert_allclose(
        space.transfer(omega)[:, 1, 0], 1j * omega * exact, rtol=1e-7, atol=1e-12
    )
    assert space.outputs[2] == "push_force"
    assert space.D[2, 0] == pytest.approx(1.4, rel=1e-9)
    assert space.scipy().to_tf().den[-1] == pytest.approx(50.0 / 3.0, rel=1e-9)
    assert space.units == {
        "u": "N",
        "x": "m",
        "v": "m/s",
        "push_force": "N",
        "push_stretch": "m",
        "push_rate": "m/s",
    }


def test_reduced_systems_and_few_modes_keep_slow_answers(hanging: StateTable) -> None:
    full, omega = space_of(hanging), 2.0 * np.pi * np.linspace(0.3, 3.0, 7)
    V = full.basis[:, :24]
    small = change_coordinates(hanging.reduced, V, full.x)
    reduced = dynamics.state_space(
        small, dynamics.linearise(small, np.zeros(24)), time=1.0, outputs=["C"]
    )
    exact = full.transfer(omega)[:, 0, 0]
    np.testing.assert_allclose(reduced.transfer(omega)[:, 0, 0], exact, rtol=2e-3)
    few = found(
        HANGING.replace(", angle: {unit: rad}", "").replace(
            "{type: linearise}", "{type: linearise, modes: 16, outputs: C}"
        )
    )
    assert space_of(few).A.shape == (32, 32)
    np.testing.assert_allclose(space_of(few).transfer(omega)[:, 0, 0], exact, rtol=1e-2)


def test_saved_models_with_sampled_points_answer_as_the_full_one(tmp_path: Path) -> None:
    """The arm of the example, trained under a chirp of its torque: 2e-5 at 1, 5 and 10 Hz."""
    (tmp_path / "scenes").mkdir()
    (tmp_path / "beam_20.msh").write_bytes((MESHES / "beam_20.msh").read_bytes())
    text = (MESHES.parent / "examples" / "lqr_arm.yaml").read_text().replace("../meshes", "..")
    text = text.replace("torque: u", 'torque: "u + one * sin(40*t + 60*t**2)"').replace(
        "inputs:", "parameters: {one: 1 N m}\ninputs:"
    )
    text += "reduction: {snapshots: 5 ms, tolerance: 1e-12, hyper_reduction: {tolerance: 1e-4, sample: points}}\n"
    path = tmp_path / "scenes" / "arm.yaml"
    path.write_text(text)
    scene = scenes.read(path)
    full = build.chosen_form(scene, build.system(scene))
    studies.reduce(path, duration=0.5, out=tmp_path / "arm.h5")
    saved = files.load(tmp_path / "arm.h5")
    one, other = (
        dynamics.state_space(system, dynamics.linearise(system), outputs=["hinge", "tip"])
        for system in (full, saved)
    )
    assert len(other.A) < 0.2 * len(one.A)
    omega = 2.0 * np.pi * np.array([1.0, 5.0, 10.0])
    np.testing.assert_allclose(other.transfer(omega), one.transfer(omega), rtol=1e-4)


def test_files_hold_the_system(tmp_path: Path) -> None:
    (tmp_path / "mass.yaml").write_text(MASS)
    run = studies.run(tmp_path / "mass.yaml", out=tmp_path / "out")
    assert [path.name for path in run.files] == [
        "eigenvalues.csv",
        "linear.npz",
        "linear.mat",
        "report.json",
        "transfer.png",
    ]
    assert run.linear is not None
    npz, mat = (
        np.load(tmp_path / "out" / "linear.npz"),
        loadmat(tmp_path / "out" / "linear.mat", simplify_cells=True),
    )
    for key in ("A", "B", "C", "D"):
        np.testing.assert_array_equal(npz[key], getattr(run.linear, key))
        np.testing.assert_array_equal(np.reshape(mat[key], npz[key].shape), npz[key])
    assert npz["outputs"].tolist() == list(mat["outputs"]) == list(run.linear.outputs)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            "{type: linearise}",
            "{type: linearise, inputs: push}",
            r"linearise, inputs: expected one of .*u.*'push'",
        ),
        (
            "{type: linearise}",
            "{type: linearise, outputs: [C, D]}",
            r"linearise, outputs: expected one of .*'D'",
        ),
        (
            "loads:\n",
            "  drive: {type: driven_angle, at: I.left, angle: angle, axis: [0, 1, 0]}\nloads:\n",
            "drives a joint",
        ),
    ],
)
def test_what_is_no_input_or_output_is_named(before: str, after: str, message: str) -> None:
    text = HANGING if "drive" in after else HANGING.replace(", angle: {unit: rad}", "")
    with pytest.raises(InputError, match=message):
        found(text.replace(before, after))


def test_few_modes_with_static_correction() -> None:
    """Transfer functions about rest are those of all modes, reactions too; the error grows with the
    square of the frequency.
    """
    text = HANGING.replace(", angle: {unit: rad}", "").replace(
        "position, at: II.right", "position, at: I.right"
    )
    scene = scenes.loads(text.replace("damping: {mass: 2.5}\n", ""), MESHES)
    system = build.chosen_form(scene, build.system(scene))
    hanging = dynamics.solve_statics(system, 4)
    linear = dynamics.linearise(hanging.system, hanging.x[-1], hanging.multipliers[-1], t=1.0)
    omega = np.array([0.1, 0.2])
    exact = dynamics.state_space(system, linear, 1.0).transfer(omega)
    plain, static = (
        dynamics.state_space(system, linear, 1.0, count=2, static=one) for one in (False, True)
    )
    errors = [
        np.abs(one.transfer(omega) - exact).max(axis=(1, 2)) / np.abs(exact).max()
        for one in (plain, static)
    ]
    assert errors[0].min() > 0.3
    assert errors[1].max() < 1e-3
    assert errors[1][1] / errors[1][0] == pytest.approx(4.0, rel=0.05)


TURNED = """\
schema: 1
dimension: 2
inputs: {w: {unit: N m, start: START}}
bodies:
  beam:
    type: cable
    mesh: beam_10.msh
    section: {shape: rectangular, width: 20 mm, height: 6 mm}
    material: {young_modulus: 5 GPa, density: 1500}
joints: {root: {type: pin, at: beam.left}}
loads:
  weight: {type: gravity, acceleration: [0, -9.81]}
  hold: {type: torsion_spring, at: beam.left, stiffness: 60}
  stay: {type: spring_damper, at: beam.right, to: [0.8, 0.9], stiffness: 100, length: 0.5}
  turn: {type: control_torque, at: beam.left, torque: w}
outputs: {R: {type: reaction, joint: root}, root: {type: angle, at: beam.left}}
analysis: {type: linearise}
"""


LEVER = """
schema: 1
dimension: 2
inputs: {u: {unit: N}}
bodies: {lever: {type: cable, mesh: beam_5.msh, unit: 0.1 mm, section: {shape: given, EA: 1 N, EI: 3.3e-14, rhoA: 1e-7}}}
joints: {root: {type: clamp, at: lever.left}}
loads: {push: {type: control_force, at: lever.right, direction: [0, 1], force: u}}
outputs: {tip: {type: position, at: lever.right, component: y}, turn: {type: angle, at: lever.right}}
analysis: {type: linearise, about: reference, modes: 1, static: true}
"""


def test_static_correction_of_a_soft_lever() -> None:
    """0.1 mm long, it would bend by ten times its length under the input that is nudged: L^3 / 3 EI
    and L^2 / 2 EI at rest.
    """
    scene = scenes.loads(LEVER, MESHES)
    found, L, EI = scene.analysis.find(scene).linear.transfer([0.0])[0, :, 0], 1e-4, 3.3e-14  # type: ignore[attr-defined]
    np.testing.assert_allclose(found.real, [L**3 / (3 * EI), L**2 / (2 * EI)], rtol=1e-5)


def test_reactions_at_rest_are_those_of_equilibria_nearby() -> None:
    """A torque on the slope of a beam moves its stiffest modes, over which outputs are
    differentiated by small differences.
    """
    space = space_of(found(TURNED.replace("START", "0")))
    gain = space.transfer([0.0])[0, :, 0].real
    sides = [
        studies.run(
            scenes.loads(TURNED.replace("START", str(w)).replace("linearise", "static"), MESHES),
            plots=False,
        ).outputs
        for w in (0.05, -0.05)
    ]
    for name, value in zip(space.outputs, gain, strict=True):
        assert value == pytest.approx((sides[0][name][-1] - sides[1][name][-1]) / 0.1, rel=1e-4)


def test_reactions_hold_those_of_the_equilibrium_which_turn_with_the_body() -> None:
    """J a'' + k a + m g l sin a = u, hinge m l (a'' cos a - a'^2 sin a), m (g + l (a'' sin a + a'^2
    cos a)), about a = 0.3.
    """
    m, moment, l, k, g, a = 2.0, 0.3, 0.7, 8.0, 9.81, 0.3
    scene = scenes.loads(f"""
schema: 1
dimension: 2
inputs: {{u: {{unit: N m, start: {m * g * l * np.sin(a) + k * a} N m}}}}
bodies: {{bob: {{type: rigid, mass: {m}, inertia: {moment}, center: [0, {-l}], points: {{top: [0, 0]}}}}}}
joints: {{hinge: {{type: revolute, at: bob.top}}}}
loads:
  weight: {{type: gravity, acceleration: [0, {-g}]}}
  drive: {{type: control_torque, at: bob.frame, torque: u}}
  spring: {{type: torsion_spring, at: bob.frame, stiffness: {k}}}
analysis: {{type: linearise}}
outputs: {{hinge: {{type: reaction, joint: hinge}}}}
""")
    assert isinstance(scene.analysis, scenes.analyses.linearisation.Linearise)
    space, omega = scene.analysis.find(scene).linear, np.array([0.0, 2.0, 30.0])
    assert space is not None
    # a'' of a unit torque
    turned = -(omega**2) / (m * g * l * np.cos(a) + k - (moment + m * l**2) * omega**2)
    exact = m * l * turned[:, None] * np.array([np.cos(a), np.sin(a)])
    np.testing.assert_allclose(space.transfer(omega)[:, :, 0], exact, rtol=1e-6, atol=1e-7)


def test_energies_change_as_between_equilibria(tmp_path: Path) -> None:
    """A mass of 1 kg on springs of 50 and 30 N/m, y0 = (0.8 u - 2) / 30 under 2 m/s^2: U = 2 y, E =
    (50 x^2 + 30 y^2) / 2.
    """
    scene = scenes.loads("""
schema: 1
dimension: 2
inputs: {u: {unit: N, start: 2 N}}
bodies: {block: {type: point_mass, mass: 1, position: [1, 0]}}
loads:
  push: {type: control_force, at: block, direction: [0.6, 0.8], force: u}
  weight: {type: gravity, acceleration: [0, -2]}
  springs: {type: bushing, at: block, stiffness: [50, 30]}
analysis: {type: linearise}
outputs: {energy: {type: energy}}
""")
    run = studies.run(scene, out=tmp_path / "out")
    assert run.linear is not None
    found = dict(zip(run.linear.outputs, run.linear.transfer([0.0])[0, :, 0], strict=True))
    x, y = 0.6 * 2.0 / 50.0, (0.8 * 2.0 - 2.0) / 30.0
    assert found["energy_potential"] == pytest.approx(2.0 * 0.8 / 30.0, rel=1e-7)
    assert found["energy_strain"] == pytest.approx(0.6 * x + 0.8 * y, rel=1e-6)
    assert np.isnan(
        found["energy_balance"]
    )  # as of equilibria, between which nothing is known to have worked
    assert (tmp_path / "out" / "transfer.png").is_file()


BAR = """\
schema: 1
name: bar
inputs: {u: {unit: N}, w: {unit: N m}}
bodies:
  b: {type: beam, mesh: beam_5.msh, section: {shape: circular, diameter: 10 mm}, material: {young_modulus: 1 GPa, density: 1800}}
joints:
  c: {type: clamp, at: b.left}
loads:
  push: {type: control_force, at: b.right, direction: [0, 0, 1], force: u}
  turn: {type: control_torque, at: b.right, axis: [0, 1, 0], torque: w}
outputs:
  tip: {type: position, at: b.right, component: z}
analysis: {type: linearise, load_steps: 1}
"""


def test_a_beam_with_torsion_has_the_poles_of_its_modes_and_the_answers_of_statics() -> None:
    """F L^3 / 3 EI + F L / k G A, -M L^2 / 2 EI: also what has no mass moves with the inputs."""
    space = found(BAR).linear
    assert space is not None
    poles = np.sort(np.abs(np.linalg.eigvals(space.A)))
    bend = 1.875104**2 * np.sqrt(1e9 * 0.0025**2 / 1800.0)
    np.testing.assert_allclose(poles[:4], bend, rtol=1e-3)
    gain = space.transfer([0.0])[0].real
    EI = 1e9 * np.pi * 0.01**4 / 64.0
    shear = 1.0 / (1e9 / 2.6 * np.pi * 0.005**2)
    np.testing.assert_allclose(
        gain, [[1.0 / (3.0 * EI) + 1.15 * shear, -1.0 / (2.0 * EI)]], rtol=1e-5
    )
