"""Wrong arguments of public functions are bad input, said with the name of the argument, and right
ones are let in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike

from fmbs_skfem import bodies, dynamics, reduction, scenes, studies, systems
from fmbs_skfem.control.environments import Plant
from fmbs_skfem.control.live import start
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.arguments import blamed, checked, rule_of
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton
from fmbs_skfem.families import parametric_model
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import curves, meshes
from fmbs_skfem.systems import At, joints, loads, probes

TEXT = """
schema: 1
dimension: 2
inputs: {u: {range: [-1 N, 1 N]}}
bodies: {cart: {type: point_mass, mass: 2 kg, position: [0, 0]}}
loads: {push: {type: control_force, at: cart, direction: [1, 0], force: u}}
outputs: {cart: {type: position, at: cart}}
analysis: {type: dynamic, duration: 10 ms, step: 1 ms}
"""
NAN = math.nan


def cart() -> systems.System:
    return build.system(scenes.loads(TEXT))


@pytest.mark.parametrize(
    ("kind", "right", "wrong"),
    [
        (
            float,
            [1.0, 1, np.float32(1.0), np.int64(1), np.array(1.0)],
            [None, "1", NAN, math.inf, 1j, True, [1.0], np.ones(1)],
        ),
        (int, [1, np.int32(1)], [1.0, "1", True, None]),
        (bool, [True, np.bool_(True)], [1, "yes", None]),
        (str, ["a", ""], [5, b"a", Path("a"), "a\0b", "\ud800"]),
        (str | Path, ["a", Path("a")], [5, None, Path("a\0b")]),
        (
            np.ndarray,
            [np.ones(2), [1.0, 2.0], (1, 2)],
            [5, None, "ab", [1.0, NAN], [[1], [1, 2]], ["a"], {}, [1j]],
        ),
        (ArrayLike | None, [5, [1.0], None], ["a", [[1], [1, 2]], object()]),
        (float | np.ndarray, [1.0, np.ones(2)], ["a", NAN, {}]),
        (
            Sequence[float],
            [[1.0], (1,), np.ones(2), []],
            ["ab", 5, {}, ["a"], [None], [[1.0]], np.array(2.0)],
        ),
        (Iterable[str], [["a"], {"a": 5}, iter("ab")], ["ab", 5, [5], np.array(2.0)]),
        (tuple[float, float], [(1.0, 2.0), [1, 2]], [(1.0,), (1.0, "a"), 5]),
        (Mapping[str, float], [{}, {"a": 1.0}], [["a"], {"a": "b"}, {5: 1.0}]),
        (Callable[[float], float] | None, [abs, None], [5, "abs"]),
        (Literal["own", "pardiso"], ["own"], ["none", None, [], 5]),
        (Newton, [Newton()], [Newton, None, 5]),
        (Any, [None, 5, object()], []),
    ],
)
def test_kinds(kind: Any, right: list[Any], wrong: list[Any]) -> None:
    assert [rule_of(kind)(one) for one in right] == [""] * len(right)
    assert all(rule_of(kind)(one) for one in wrong)


def test_a_checked_function_says_which_argument_is_wrong() -> None:
    @checked
    def size(x: np.ndarray, limit: float = math.inf, name: str | None = None) -> Any:
        return x.sum(), limit, name

    assert size([1.0, 2.0]) == (3.0, math.inf, None)
    assert size(np.ones(2), limit=math.inf) == (2.0, math.inf, None)
    with pytest.raises(InputError, match=r"size: limit: expected a finite number, got '3'"):
        size(np.ones(2), "3")
    with pytest.raises(
        InputError, match=r"size: x: expected an array of finite numbers, got nothing"
    ):
        size(x=None)
    with pytest.raises(TypeError, match="unexpected keyword"):
        size(np.ones(2), y=1)  # type: ignore[call-arg]


MASS = bodies.point_mass("m", 1.0, np.zeros(2))
PUSH = loads.PointForce("F", At("m"), (1.0, 0.0))
CALLS: dict[str, tuple[Callable[..., Any], str]] = {
    "no system": (lambda: dynamics.integrate(5, GeneralizedAlpha(1e-3), 1.0), "integrate: system"),
    "no scheme": (lambda: dynamics.integrate(cart(), 1e-3, 1.0), "integrate: scheme"),
    "text for a time": (
        lambda: dynamics.integrate(cart(), GeneralizedAlpha(1e-3), "1"),
        "integrate: duration",
    ),
    "broken every": (
        lambda: dynamics.integrate(cart(), GeneralizedAlpha(1e-3), 0.01, every=1.5),
        "integrate: every",
    ),
    "times for steps": (
        lambda: dynamics.integrate(cart(), GeneralizedAlpha(1e-3), 0.01, every=np.array([0.5])),
        "steps to keep",
    ),
    "text for a step": (lambda: GeneralizedAlpha("1e-3"), "GeneralizedAlpha.step"),
    "no iterations": (lambda: Newton(iterations=-1), "newton: iterations"),
    "no trajectory": (lambda: dynamics.outputs(None), "outputs: trajectory"),
    "unknown output": (
        lambda: dynamics.outputs(dynamics.integrate(cart(), GeneralizedAlpha(1e-3), 1e-3), ["x"]),
        "outputs",
    ),
    "no counts": (lambda: dynamics.vibration_modes(cart(), "3"), "vibration_modes: count"),
    "multipliers": (lambda: dynamics.linearise(cart(), multipliers=[1.0]), "multipliers"),
    "center": (lambda: dynamics.Spin(1.0, center="origin"), "Spin.center"),
    "text for a size": (lambda: bodies.Circular("10 mm"), "Circular.diameter"),
    "no modulus": (lambda: bodies.Material(None, 1e3), "Material.young_modulus"),
    "nan position": (lambda: bodies.point_mass("m", 1.0, [NAN, 0.0]), "point_mass: position"),
    "one coordinate": (lambda: bodies.point_mass("m", 1.0, [1.0]), "body 'm': position"),
    "no mesh": (lambda: bodies.cable("b", None, bodies.Circular(0.1)), "cable: mesh"),
    "zero in a path": (lambda: scenes.read("a\0b"), "read: path"),
    "no bodies": (lambda: systems.assemble([5]), "assemble: bodies"),
    "no place": (lambda: systems.assemble([MASS], [joints.Pin("A", "m")]), "joint 'A'.at"),
    "no name": (
        lambda: systems.assemble([MASS], loads=[loads.PointForce(5, At("m"), (1.0, 0.0))]),
        "load.*name",
    ),
    "text in a force": (
        lambda: systems.assemble([MASS], loads=[loads.PointForce("F", At("m"), ("a", 0.0))]),
        "load 'F'.force",
    ),
    "mapping for a force": (
        lambda: systems.assemble([MASS], loads=[loads.PointForce("F", At("m"), {})]),
        "load 'F'.force",
    ),
    "no output": (
        lambda: systems.assemble([MASS], outputs={"t": probes.Position(5)}),
        "output 't'.at",
    ),
    "shape of x": (lambda: systems.force(cart(), [0.0]), "x"),
    "shape of V": (
        lambda: systems.change_coordinates(cart(), [[1.0]], [0.0]),
        "change_coordinates",
    ),
    "reduced coordinates": (
        lambda: reduction.reduce_floating(systems.eliminate(cart()), -1),
        "reduce_floating",
    ),
    "interval": (
        lambda: reduction.snapshots(
            dynamics.integrate(cart(), GeneralizedAlpha(1e-3), 0.01), 1e300
        ),
        "snapshots",
    ),
    "seed": (lambda: systems.check_force([MASS], PUSH, seed=-1), "seed"),
    "no file": (lambda: files.read(None), "read: path"),
    "no model": (lambda: parametric_model.case_of(None, {}), "case_of: rom"),
    "no run": (lambda: start("scene.yaml", GeneralizedAlpha(1e-3)), "start: system"),
    "no state": (lambda: setattr(start(cart(), GeneralizedAlpha(1e-3)), "state", 5), "run.state"),
    "no names": (lambda: start(cart(), GeneralizedAlpha(1e-3)).outputs(5), "run.outputs"),
    "no reward": (
        lambda: Plant(cart(), GeneralizedAlpha(1e-3), ["cart"], None, 1.0),
        "Plant: reward",
    ),
    "source": (lambda: studies.run(5), "source"),
    "text for a duration": (lambda: studies.run("a.yaml", duration="1"), "run: duration"),
    "flag": (lambda: studies.run("a.yaml", plots="no"), "run: plots"),
    "parameters": (lambda: studies.run("a.yaml", parameters=["E"]), "run: parameters"),
    "folder": (lambda: studies.run("a.yaml", out=5), "run: out"),
    "no scene": (lambda: build.system(5), "system: scene: expected a Scene"),
    "nothing prepared": (lambda: systems.prepare(5), "system: expected a System"),
    "no list of names": (
        lambda: start(cart(), GeneralizedAlpha(1e-3)).outputs([[]]),  # type: ignore[list-item]
        "run.outputs",
    ),
    "states": (
        lambda: dynamics.integrate(cart(), GeneralizedAlpha(1e-3), 0.01, states=-1),
        "integrate: states",
    ),
    "memory": (lambda: dynamics.linearise(cart(), memory=[1.0]), "memory"),
    "begin": (lambda: dynamics.solve_statics(cart(), begin=[1.0]), "begin"),
    "captions": (
        lambda: dynamics.Shapes(cart(), np.zeros(2), np.zeros((2, 1)), None),
        "Shapes: captions",
    ),
    "two spins in the plane": (
        lambda: systems.assemble([MASS], initial={"m": systems.Motion(None, (1.0, 2.0))}),
        "angular_velocity",
    ),
    "no motions": (
        lambda: dynamics.campbell([0.0, 1.0], lambda value, count: None),
        "campbell: find",
    ),
    "no points": (lambda: curves.through("abc"), "through: points: expected finite numbers"),
    "negative radius": (
        lambda: bodies.point_mass("m", 1.0, np.zeros(2), -1.0),
        "point_mass: radius: expected a length .* > 0",
    ),
    "no cells": (lambda: meshes.segment(0), "segment: cells: expected a number >= 1"),
    "too large": (
        lambda: bodies.Circular(1e300),
        "Circular.diameter: expected a length .* of a size",
    ),
    "few instants": (lambda: studies.view("a.yaml", instants=1), "view: instants"),
    "choice": (lambda: studies.reduce("a.yaml", level="beam"), "reduce: level"),
    "infinite": (
        lambda: studies.train_part("a.yaml", alone=True, gravity=math.inf),
        "train_part: gravity",
    ),
    "range": (lambda: studies.sweep("a.yaml", samples=2, ranges={"E": (1.0,)}), "sweep: ranges"),
    "listener": (
        lambda: studies.run("a.yaml", listener=studies.Listener(progress=5)),
        "Listener.progress",
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_wrong_calls_are_bad_input(name: str) -> None:
    call, place = CALLS[name]
    with pytest.raises(InputError, match=place):
        call()


def test_a_reward_is_a_number() -> None:
    plant = Plant(cart(), GeneralizedAlpha(1e-3), ["cart"], lambda outputs, inputs: None, 1.0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="what it gives: expected a finite number, got nothing"):
        plant.step([0.1])


def test_an_end_is_yes_or_no() -> None:
    plant = Plant(cart(), GeneralizedAlpha(1e-3), ["cart"], lambda outputs, inputs: 0.0, 1.0)
    plant.ends = lambda outputs: np.array([True, False])  # type: ignore[assignment,return-value]
    with pytest.raises(InputError, match="ends, what it gives: expected true or false"):
        plant.step([0.1])


def test_an_option_that_a_study_has_not_is_named_with_the_study() -> None:
    with pytest.raises(TypeError, match=r"run\(\) got .* 'plot'; did you mean 'plots'"):
        studies.run("a.yaml", plot=False)  # type: ignore[call-arg]


def test_words_of_its_own_go_before_those_on_arguments() -> None:
    @blamed
    def size(x: Sequence[float], limit: float = 1.0) -> float:
        if len(x) > 2:
            raise InputError("too many")
        return limit * len(x)

    assert size([1.0]) == 1.0
    with pytest.raises(InputError, match="too many"):
        size("abc")
    with pytest.raises(InputError, match="size: x: expected a sequence, got 5"):
        size(5)  # type: ignore[arg-type]
