"""Families of scenes: a member with other values is the scene in which these values are written as
numbers.
"""

from __future__ import annotations

import pickle
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.storage import container
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.parameters import Parameter, Scale

EXAMPLES = Path(__file__).parents[2] / "examples"

BEAMS = """\
schema: 1
dimension: 2
parameters:
{parameters}
bodies:
  beam:
    type: cable
    mesh: ../meshes/beam_5.msh
    section: {{shape: circular, diameter: d}}
    material: {{young_modulus: 2 * E, density: rho}}
    origin: [x, 0]
  ball: {{type: point_mass, mass: m, position: [x + 1, 0]}}
  stone: {{type: point_mass, mass: 1 kg, position: [0, 1]}}
joints:
  drive: {{type: driven_angle, at: beam.left, angle: "where(t < Ts, w * t**2 / (2 * Ts), w * (t - Ts / 2))"}}
  hinge: {{type: pin, at: beam.left, to: ground}}
  rail: {{type: pin, at: ball, to: beam.right}}
loads:
  weight: {{type: gravity, acceleration: [0, -g]}}
  push: {{type: point_force, at: beam.right, force: [0, F], history: 1 + a * t}}
damping: {{mass: c, stiffness: 2 * h}}
initial: {{bodies: {{stone: {{velocity: [0, v]}}}}}}
analysis: {{type: dynamic, duration: n * h, step: h, rho_inf: r, tolerance: e}}
reduction: {{snapshots: 2 * h}}
"""
VALUES = {
    "E": (1e9, 1.5e9), "rho": (1800.0, 1500.0), "d": (0.01, 0.02), "x": (0.0, 0.25), "m": (2.0, 3.0),
    "Ts": (1.5, 1.25), "w": (6.0, 7.0), "g": (9.81, 5.0), "F": (1.0, -2.0), "a": (0.5, 0.75), "c": (0.1, 0.2), "v": (0.0, 2.0),
    "h": (1e-3, 5e-4), "n": (20.0, 40.0), "r": (0.8, 0.6), "e": (1e-10, 1e-9),
}  # fmt: skip

PLATE = """\
schema: 1
dimension: 2
parameters:
{parameters}
bodies:
  plate:
    type: plate
    mesh: ../meshes/plate_8x8.msh
    interpolation: bfs
    thickness: t0
    material: {{young_modulus: E, density: 2700, poisson_ratio: nu}}
  disc: {{type: rigid, mass: m, inertia: 0.5 * m * b**2, center: [2 * b, 0]}}
loads:
  pull: {{type: point_force, at: disc.center, force: [F, 0]}}
analysis: {{type: dynamic, duration: 1 ms, step: 1e-5 s}}
"""
PLATE_VALUES = {
    "nu": (0.3, 0.2),
    "t0": (0.01, 0.02),
    "E": (7e10, 4e10),
    "m": (1.0, 2.0),
    "b": (1.0, 1.5),
    "F": (1.0, 2.0),
}


TURNED = """\
schema: 1
dimension: 3
parameters:
{parameters}
bodies:
  beam: {{type: cable, mesh: ../meshes/beam_5.msh, section: {{shape: given, EA: EA, EI: EI, rhoA: mu}}, origin: [0, y, 0],
    rotation: {{axis: [0, 0, 1], angle: q}}}}
joints: {{hinge: {{type: spherical, at: beam.left}}}}
loads: {{weight: {{type: gravity, acceleration: [0, -g, 0]}}}}
analysis: {{type: dynamic, duration: 20 ms, step: 1 ms}}
reduction: {{snapshots: 2 ms}}
"""
TURNED_VALUES = {
    "EA": (1e5, 2e5),
    "EI": (2.0, 3.0),
    "mu": (0.5, 0.25),
    "y": (0.0, 0.5),
    "q": (0.25, 0.75),
    "g": (9.81, 5.0),
}
PLANAR = (
    TURNED.replace("dimension: 3", "dimension: 2")
    .replace("{{axis: [0, 0, 1], angle: q}}", "q")
    .replace(", 0]}}}}", "]}}}}")
)
PLANAR = PLANAR.replace("[0, y, 0]", "[0, y]").replace("spherical", "pin")


def ranged(values: dict[str, tuple[float, float]]) -> str:
    """The section `parameters` with a range about both values of each."""
    return "\n".join(
        f"  {name}: {{value: {a}, range: [{min(a, b) - 1}, {max(a, b) + 1}]}}"
        for name, (a, b) in values.items()
    )


def literal(values: dict[str, float]) -> str:
    return "\n".join(f"  {name}: {value!r}" for name, value in values.items())


def written(case: Case) -> tuple[Any, list[np.ndarray]]:
    """All of a case: its structure, and its arrays."""
    arrays: list[np.ndarray] = []
    return container.encode(case.system, arrays, "system"), arrays


def same(a: Case, b: Case) -> bool:
    (tree, arrays), (other, others) = written(a), written(b)
    equal = len(arrays) == len(others) and all(
        np.array_equal(x, y) for x, y in zip(arrays, others, strict=True)
    )
    return (
        equal
        and tree == other
        and (a.scheme, a.duration, a.newton) == (b.scheme, b.duration, b.newton)
    )


@pytest.mark.parametrize(
    ("text", "values"),
    [(BEAMS, VALUES), (PLATE, PLATE_VALUES), (TURNED, TURNED_VALUES), (PLANAR, TURNED_VALUES)],
    ids=["beams", "plate", "turned in space", "turned in the plane"],
)
def test_a_member_is_the_scene_with_these_numbers(
    text: str, values: dict[str, tuple[float, float]]
) -> None:
    """Every number a parameter is written for follows it, one by one and all together, to the bit."""
    _, family = scenes.family(scenes.loads(text.format(parameters=ranged(values)), EXAMPLES))
    nominal = {name: a for name, (a, _) in values.items()}
    base = family({})
    assert same(base, family(nominal))
    changes = [{name: b} for name, (_, b) in values.items()] + [
        {name: b for name, (_, b) in values.items()}
    ]
    for change in changes:
        _, literally = scenes.family(
            scenes.loads(text.format(parameters=literal(nominal | change)), EXAMPLES)
        )
        found = family(change)
        assert same(found, literally({})), change
        assert not same(found, base), change


def test_step_duration_and_newton_depend_on_parameters() -> None:
    _, family = scenes.family(scenes.loads(BEAMS.format(parameters=ranged(VALUES)), EXAMPLES))
    case = family({"h": 5e-4, "n": 40.0, "r": 0.6, "e": 1e-9})
    assert case.scheme == GeneralizedAlpha(5e-4, 0.6)
    assert case.duration == 40.0 * 5e-4
    assert case.newton == Newton(tolerance=1e-9)
    assert family({"h": 5e-4}).duration == 20.0 * 5e-4


def test_masses_are_those_of_the_formulas() -> None:
    """Mass of the beam rho pi d^2 / 4 L with L = 1 m, and of the mass points: exactly what the
    parameters say.
    """
    scene = scenes.loads(BEAMS.format(parameters=ranged(VALUES)), EXAMPLES)
    system = scenes.family(scene)[1]({"rho": 1500.0, "d": 0.02, "m": 3.0}).system
    move = np.zeros(system.size)
    for name, first, last in system.coordinates:
        # all control points one metre along x
        move[first : last if name == "beam" else first + 1 : 2] = 1.0
    mass = move @ (system.mass @ move)
    assert mass == pytest.approx(1500.0 * np.pi * 0.02**2 / 4 + 3.0 + 1.0, rel=1e-12)


def test_parameters_of_a_scene() -> None:
    scene = scenes.read(EXAMPLES / "pendulum_family.yaml")
    parameters, _ = scenes.family(scene)
    assert parameters == (
        Parameter("E", 0.7e9, 1.3e9, Scale.LINEAR, "Pa", 1e9),
        Parameter("d", 0.008, 0.012, Scale.LINEAR, "m", 0.01),
        Parameter("g", 5.0, 12.0, Scale.LINEAR, "m/s^2", 9.81),
    )


def test_changes_of_the_scene_stay_and_unknown_names_are_refused() -> None:
    scene = scenes.read(EXAMPLES / "pendulum_family.yaml", {"rho": 1500.0})
    _, family = scenes.family(scene, cells=4, duration=0.05)
    own = family({"E": 1.2e9})
    _, other = scenes.family(
        scenes.read(EXAMPLES / "pendulum_family.yaml", {"rho": 1500.0, "E": "1.2 GPa"}), cells=4
    )
    assert own.duration == 0.05
    assert written(own)[0] == written(other({}))[0]
    assert all(
        np.array_equal(x, y) for x, y in zip(written(own)[1], written(other({}))[1], strict=True)
    )
    with pytest.raises(InputError, match="expected one of the parameters E, rho, d, g, got 'dd'"):
        family({"dd": 0.01})


def test_values_outside_are_told_once_and_the_nominal_value_is_the_middle() -> None:
    with pytest.warns(Notice, match="outside the range"):
        scene = scenes.read(EXAMPLES / "pendulum_family.yaml", {"E": "2 GPa"})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parameters, family = scenes.family(scene, cells=2)
        family({})
    assert parameters[0].value is None
    assert parameters[0].nominal == pytest.approx(1e9)


def test_a_family_travels_to_other_processes() -> None:
    parameters, family = scenes.family(scenes.read(EXAMPLES / "pendulum_family.yaml"), cells=2)
    again_parameters, again = pickle.loads(pickle.dumps((parameters, family)))
    assert again_parameters == parameters
    assert same(again({"d": 0.009}), family({"d": 0.009}))
