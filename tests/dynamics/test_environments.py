"""Plants as environments: the interface of gymnasium, episodes to the bit, side by side in threads."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.control.environments import Box, Plant, Plants
from fmbs_skfem.control.live import start
from fmbs_skfem.control.spaces import Box as OwnBox
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import System, eliminate

from .. import pages
from .test_live import driven, fed

ROOT = Path(__file__).parents[2]
SCENE = """
schema: 1
dimension: 2
inputs: {u: {range: [-2 N, 3 N]}, w: {unit: N, start: 1 N, range: [0, 1]}}
bodies: {cart: {type: point_mass, mass: 2 kg, position: [0, 0]}, bob: {type: point_mass, mass: 1 kg, position: [0, -1]}}
joints: {rail: {type: slider, at: cart, direction: [1, 0]}}
loads:
  push: {type: control_force, at: cart, direction: [1, 0], force: u + w}
  rope: {type: spring_damper, at: bob, to: cart, stiffness: 900 N/m, damping: 2 N s/m}
  weight: {type: gravity, acceleration: [0, -9.81]}
outputs: {cart: {type: position, at: cart, component: x}, bob: {type: velocity, at: bob}}
analysis: {type: dynamic, duration: 1 s, step: 2 ms}
"""
H = 2e-3


def system() -> System:
    return eliminate(build.system(reading.loads(SCENE)))


def plant(duration: float = 0.2, far: float = np.inf) -> Plant:
    reward = lambda outputs, inputs: outputs["cart"] - 0.1 * inputs["u"] ** 2  # noqa: E731
    return Plant(
        system(),
        GeneralizedAlpha(H),
        ["cart", "bob"],
        reward,
        duration,
        5,
        lambda now: now["cart"] > far,
    )


def test_boxes_follow_from_ranges() -> None:
    one = plant()
    np.testing.assert_array_equal(one.action_space.low, [-2.0, 0.0])
    np.testing.assert_array_equal(one.action_space.high, [3.0, 1.0])
    assert one.observation_space.shape == (3,)
    assert one.action_space.contains(one.action_space.sample())
    many = Plants(plant, 4)
    assert (many.action_space.shape, many.observation_space.shape) == ((4, 2), (4, 3))
    many.close()


def test_an_episode_is_a_live_run_whose_inputs_are_cut_to_their_ranges() -> None:
    one, run = plant(), start(system(), GeneralizedAlpha(H))
    seen, told = one.reset(seed=3)
    assert (seen.tolist(), told) == ([0.0, 0.0, 0.0], {})
    for k in range(20):
        seen, reward, ended, late, told = one.step(np.array([9.0, 0.5 * np.cos(k)]))
        for _ in range(5):
            run.step({"u": 3.0, "w": max(0.5 * np.cos(k), 0.0)})
        expected = run.outputs(["cart", "bob"])
        np.testing.assert_array_equal(seen, list(expected.values()))
        assert reward == expected["cart"] - 0.9
        assert (ended, late, told) == (False, k == 19, {})


def test_episodes_are_the_same_to_the_bit_after_a_reset() -> None:
    one, random = plant(), np.random.default_rng(0)
    actions = [one.action_space.low + random.random(2) * 2.0 for _ in range(20)]
    runs = []
    for _ in range(2):
        one.reset()
        runs.append([one.step(action)[0] for action in actions])
    np.testing.assert_array_equal(*runs)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_plants_side_by_side_move_as_alone(threads: int) -> None:
    """To the bit; one that has ended begins anew with its next action, whatever that is."""
    many, alone = (
        Plants(lambda: plant(0.1, 0.003), 5, threads),
        [plant(0.1, 0.003) for _ in range(5)],
    )
    random, ways = np.random.default_rng(1), set[tuple[bool, bool]]()
    seen, _ = many.reset()
    for one in alone:
        one.reset()
    over = np.zeros(5, bool)
    for _ in range(25):
        actions = random.uniform([-2.0, 0.0], [3.0, 1.0], (5, 2))
        seen, rewards, ended, late, _ = many.step(actions)
        for k, one in enumerate(alone):
            found = (one.reset()[0], 0.0, False, False) if over[k] else one.step(actions[k])[:4]
            np.testing.assert_array_equal(seen[k], found[0])
            assert (rewards[k], ended[k], late[k]) == found[1:]
            ways.add(found[2:])
        over = ended | late
    many.close()
    assert ways >= {(False, False), (True, False), (False, True)}  # plants have ended in both ways


MODELS = {
    "histories": lambda: eliminate(fed()),
    "drives": lambda: eliminate(driven()),
    "inputs": system,
}


@pytest.mark.parametrize("model", MODELS)
def test_several_steps_at_once_are_those_one_by_one(model: str) -> None:
    """The bits of states and of all that the next step reads, where they are one call and where
    they are not.
    """
    one, other = (start(MODELS[model](), GeneralizedAlpha(H)) for _ in range(2))
    name = next(iter(one.inputs))
    for k in range(12):
        value = one.feed.inputs[name].start * (1.0 + 0.1 * k)
        for _ in range(7):
            one.step({name: value})
        other.step({name: value}, 7)
        held, found = one.state.arrays, other.state.arrays
        assert held.keys() == found.keys()
        for key in held:
            np.testing.assert_array_equal(held[key], found[key], err_msg=key)
        assert one.time == other.time


def test_what_ends_an_episode() -> None:
    one = plant(far=0.01)
    one.reset()
    ended = False
    while not ended:
        seen, _, ended, late, _ = one.step([3.0, 1.0])
        assert not late
    assert 0.01 < seen[0] < 0.012


def test_wrong_plants_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"Plant: expected inputs that have ranges, as actions, got none of u"
    ):
        Plant(eliminate(fed()), GeneralizedAlpha(H), ["tip"], lambda outputs, inputs: 0.0, 1.0)
    with pytest.raises(InputError, match=r"run.outputs: expected one of the outputs"):
        Plant(system(), GeneralizedAlpha(H), ["tip"], lambda outputs, inputs: 0.0, 1.0)
    with pytest.raises(
        InputError, match=r"Plant: every: expected a whole number of steps, 1 or more, got 0"
    ):
        Plant(system(), GeneralizedAlpha(H), ["cart"], lambda outputs, inputs: 0.0, 1.0, 0)


def test_gymnasium_takes_them() -> None:
    """Its own check of environments, and of its vectors."""
    gymnasium = pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=UserWarning)
        check_env(plant(), skip_render_check=True)
    many = Plants(plant, 3, 2)
    assert isinstance(many, gymnasium.vector.VectorEnv)
    wrapped = gymnasium.wrappers.vector.RecordEpisodeStatistics(many)
    seen, _ = wrapped.reset(seed=1)
    for _ in range(22):
        seen, *_ = wrapped.step(wrapped.action_space.sample())
    assert many.observation_space.contains(seen)
    many.close()


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """docs/plant.md: the arm is reduced, held by LQR at its goal, and learns nothing."""
    for folder in ("examples", "meshes"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    found = pages.run("docs/plant.md")
    assert found["run"].outputs(["tip"])["tip"] == pytest.approx(0.1, abs=1e-3)
    assert max(found["errors"][name]["relative"] for name in ("hinge", "tip")) < 0.01
    assert found["seen"].shape == (8, 2)


def test_boxes_without_gymnasium() -> None:
    own, other = (
        OwnBox([-2.0, 0.0], [3.0, 1.0], dtype=np.float64),
        Box(np.array([-2.0, 0.0]), np.array([3.0, 1.0]), dtype=np.float64),
    )
    own.seed(1)
    samples = np.array([own.sample() for _ in range(200)])
    assert all(other.contains(one) for one in samples)
    assert np.abs(samples.mean(axis=0) - [0.5, 0.5]).max() < 0.3
    assert (own.shape, own.dtype) == (other.shape, other.dtype)
    assert not own.contains([4.0, 0.0])
    assert not own.contains([0.0])
    assert OwnBox(-np.inf, np.inf, (3,)).sample().shape == (3,)


@pytest.mark.parametrize(
    "given",
    [
        {"duration": np.nan},
        {"duration": np.inf},
        {"duration": 0.0},
        {"every": 0},
        {"every": 1.5},
        {"reward": None},
    ],
)
def test_plants_without_an_end_or_a_reward_are_refused(given: dict[str, Any]) -> None:
    options = {"duration": 0.2, "every": 5, "reward": lambda outputs, inputs: 0.0} | given
    with pytest.raises(InputError, match=f"Plant: {next(iter(given))}"):
        Plant(
            system(),
            GeneralizedAlpha(H),
            ["cart"],
            options["reward"],
            options["duration"],
            options["every"],
        )


def test_steps_and_actions_that_are_none_are_refused() -> None:
    one, run = plant(), start(system(), GeneralizedAlpha(H))
    for action in ([1.0], [1.0, np.nan], 1.0):
        with pytest.raises(
            InputError, match=r"Plant.step: expected an action of 2 finite numbers, u, w"
        ):
            one.step(np.array(action))
    for count in (-1, 0, 1.5, None):
        with pytest.raises(InputError, match=r"run.step: count: expected a whole number of steps"):
            run.step({}, count)  # type: ignore[arg-type]
    with pytest.raises(
        InputError, match=r"run.step: inputs: expected numbers by the names of inputs"
    ):
        run.step(5.0)  # type: ignore[arg-type]
    run.step({}, np.int64(2))
    assert run.time == 2 * H
