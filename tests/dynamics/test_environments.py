"""Plants as environments: the interface of gymnasium, episodes to the bit, side by side in threads."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.control.environments import Box, Plant, Plants
from fmbs_skfem.control.live import start
from fmbs_skfem.control.spaces import Box as OwnBox
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, energies
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import System, eliminate
from fmbs_skfem.systems.compiled import gap
from fmbs_skfem.systems.system import sizes

from .. import pages
from .test_live import PLANT, driven, fed

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
TURNING = """
schema: 1
dimension: 2
inputs: {u: {range: [-40 N m, 60 N m]}, w: {unit: N, start: 1 N, range: [0, 1]}}
bodies:
  disc: {type: rigid, mass: 2 kg, inertia: 0.01 kg m^2, center: [0, 0], points: {rim: [0.1, 0]}}
  cart: {type: point_mass, mass: 1 kg, position: [0, -1]}
joints: {axle: {type: revolute, at: disc.frame}}
loads:
  drive: {type: control_torque, at: disc.frame, torque: u}
  push: {type: control_force, at: cart, direction: [1, 0], force: w}
  rope: {type: spring_damper, at: cart, to: disc.rim, stiffness: 900 N/m, damping: 2 N s/m}
outputs:
  cart: {type: position, at: cart, component: x}
  bob: {type: angle, at: disc.frame}
  spin: {type: angular_velocity, at: disc.frame}
  energy: {type: energy}
analysis: {type: dynamic, duration: 1 s, step: 2 ms}
"""


@functools.cache
def system(text: str = SCENE) -> System:
    return eliminate(build.system(reading.loads(text)))


def plant(
    duration: float = 0.2,
    far: float = np.inf,
    text: str = SCENE,
    observed: Sequence[str] = ("cart", "bob"),
    of: Any = None,
    **more: Any,
) -> Plant:
    reward = lambda outputs, inputs: outputs["cart"] - 0.1 * inputs["u"] ** 2  # noqa: E731
    ends = lambda now: now["cart"] > far  # noqa: E731
    scheme = GeneralizedAlpha(H)
    given = system(text) if of is None else of
    return Plant(given, scheme, observed, reward, duration, 5, ends, **more)


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


KINDS = {
    "expressions": {"text": SCENE},
    "turns": {"text": TURNING, "observed": ("spin", "bob", "cart")},
    "turns that nobody sees": {"text": TURNING, "observed": ("cart",)},
    "energies": {"text": TURNING, "observed": ("cart", "energy")},
    "parts": {"text": TURNING, "newton": Newton(iterations=3)},
}
TOGETHER = {"expressions", "turns", "turns that nobody sees", "parts"}  #: in one call


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_plants_side_by_side_move_as_alone(kind: str, threads: int) -> None:
    """To the bit; one that has ended begins anew with its next action, whatever that is."""
    make = functools.partial(plant, 0.1, 0.003, **KINDS[kind])
    many, alone = Plants(make, 5, threads), [make() for _ in range(5)]
    random, ways = np.random.default_rng(1), set[tuple[bool, bool]]()
    seen, _ = many.reset()
    assert many.together.fast.all() == (kind in TOGETHER)
    for one in alone:
        one.reset()
    over = np.zeros(5, bool)
    for step in range(25):
        actions = random.uniform(alone[0].low, alone[0].high, (5, 2))
        seen, rewards, ended, late, _ = many.step(actions)
        for k, one in enumerate(alone):
            found = (one.reset()[0], 0.0, False, False) if over[k] else one.step(actions[k])[:4]
            np.testing.assert_array_equal(seen[k], found[0])
            assert (rewards[k], ended[k], late[k]) == found[1:]
            ways.add(found[2:])
        if step % 7 == 6:  # what they have done is told when somebody asks
            for one, other in zip(many.plants, alone, strict=True):
                held, expected = one.run.state.arrays, other.run.state.arrays
                assert held.keys() == expected.keys()
                # turns may have been counted at other instants
                for key in (key for key in held if not key.startswith(("columns", "shown"))):
                    np.testing.assert_array_equal(held[key], expected[key], err_msg=key)
                assert one.run.outputs() == other.run.outputs()
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
        for one in (plant(), plant(start_noise=(1e-3, 1e-2)), plant(of=drawn)):
            check_env(one, skip_render_check=True)
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


def test_turns_are_counted_whoever_reads_them() -> None:
    """A disc at rest that a torque turns ten times before its angle is read."""
    run, other = (start(system(TURNING), GeneralizedAlpha(H)) for _ in range(2))
    for step in range(60):
        run.step({"u": 40.0 if step < 30 else -40.0})
        if step % 30 == 29:
            other.step({"u": 40.0 if step < 30 else -40.0}, 30)
        angle = run.outputs(["bob"])["bob"]
    assert angle > 9.0
    assert other.outputs(["bob"])["bob"] == angle


ROD = "joints: {axle: {type: revolute, at: disc.frame}, rod: {type: distance, at: cart, to: disc.rim}}"
TIED = "\n".join(
    ROD if line.startswith("joints") else line
    for line in TURNING.splitlines()
    if "rope" not in line
)


def test_starts_are_drawn_near_that_of_the_system() -> None:
    """Within the sizes that are allowed, on the joints, and as the seed says."""
    one = plant(text=TIED, start_noise=(0.02, 0.3))
    model, start_of = one.live.run.model, one.live.begin
    sizes_of = lambda found: float(sizes(model.system, found)[0])  # noqa: E731
    found = list[np.ndarray]()
    for seed in (0, 1, 1, None):
        one.reset(seed=seed)
        x, v = one.live.begin.x[0], one.live.begin.v[0]
        phi, J = gap(model, x)
        assert np.abs(phi).max() < 1e-12
        assert np.abs(J @ v).max() < 1e-6  # with what (4) of the first step adds
        assert 1e-3 < sizes_of(x - start_of.x[0]) < 0.0202
        assert 1e-2 < sizes_of(v - start_of.v[0]) < 0.303
        found.append(np.concatenate([one.step([0.5, 0.5])[0] for _ in range(4)]))
    np.testing.assert_array_equal(found[1], found[2])
    assert not (found[0] == found[1]).any()
    assert not (found[2] == found[3]).any()


def test_what_is_stiff_stays_at_rest_in_random_starts() -> None:
    """An arm whose tip moves by 1 cm has not the energy of its fastest modes."""
    scene = reading.loads(PLANT.read_text(), PLANT.parent)
    arm = build.chosen_form(scene, build.system(scene))
    reward = lambda outputs, inputs: 0.0  # noqa: E731
    one = Plant(arm, GeneralizedAlpha(1e-3), ["tip"], reward, 1.0, 10, start_noise=(0.01, 0.0))
    one.reset(seed=4)
    assert 1e-8 < energies(one.run.motion())[0, 1] < 0.1


def drawn(random: np.random.Generator) -> System:
    """Another mass of the cart and another stiffness of the rope."""
    mass, stiffness = random.uniform(0.5, 2.0), random.uniform(500.0, 1500.0)
    text = TURNING.replace("mass: 1 kg", f"mass: {mass!r} kg")
    return system(text.replace("900 N/m", f"{stiffness!r} N/m"))


@pytest.mark.parametrize("threads", [1, 2])
def test_systems_of_episodes_are_drawn(threads: int) -> None:
    """Every episode is that of a plant of the drawn system, also side by side."""
    reward = lambda outputs, inputs: 0.0  # noqa: E731

    def make(of: Any = drawn) -> Plant:
        noise = (0.01, 0.1)
        return Plant(of, GeneralizedAlpha(H), ["cart", "bob"], reward, 0.05, 5, start_noise=noise)

    many = Plants(make, 3, threads)
    seen, _ = many.reset(seed=7)
    streams = [np.random.default_rng(7 + k) for k in range(3)]
    masses = set[float]()
    for _ in range(2):
        systems = [drawn(stream) for stream in streams]
        alone = [make(one) for one in systems]
        for k, one in enumerate(alone):
            one.np_random = streams[k]
            np.testing.assert_array_equal(one.reset()[0], seen[k])
            masses.add(systems[k].weight)
        late = np.zeros(3, bool)
        while not late.all():
            seen, _, _, late, _ = many.step(np.full((3, 2), 0.5))
            for k, one in enumerate(alone):
                np.testing.assert_array_equal(one.step([0.5, 0.5])[0], seen[k])
        seen = many.step(np.zeros((3, 2)))[0]
    assert many.together.fast.all()
    assert len(masses) == 6
    many.close()


def test_systems_of_other_plants_are_refused() -> None:
    texts = iter([TURNING, TURNING.replace("60 N m", "50 N m")])
    one = plant(text=TURNING)
    one.draw = lambda random: system(next(texts))
    one.reset(seed=1)
    with pytest.raises(InputError, match=r"Plant: system, what it gives: expected inputs"):
        one.reset()
    with pytest.raises(InputError, match=r"Plant: system, what it gives: expected a System"):
        Plant(lambda random: 1.0, GeneralizedAlpha(H), ["cart"], lambda a, b: 0.0, 1.0)  # type: ignore[arg-type, return-value]
    for noise in ((0.1,), (-1.0, 0.0), (np.nan, 0.0), (0.0, np.inf)):
        with pytest.raises(InputError, match=r"Plant: start_noise"):
            plant(start_noise=noise)
    many = Plants(plant, 2)
    with pytest.raises(InputError, match=r"Plants.reset: seed: expected one, or 2 of them, got 3"):
        many.reset(seed=[1, 2, 3])
    many.close()


def test_plants_that_are_moved_by_themselves_go_on_side_by_side() -> None:
    """One of them takes a step, and one begins anew, without the others."""
    many, alone = Plants(lambda: plant(text=TURNING), 3), [plant(text=TURNING) for _ in range(3)]
    many.reset()
    for one in alone:
        one.reset()
    actions = np.array([[30.0, 0.2], [-20.0, 0.4], [10.0, 0.9]])
    for step in range(6):
        if step == 2:
            many.plants[0].step([5.0, 0.1])
            alone[0].step([5.0, 0.1])
        if step == 4:
            many.plants[1].reset()
            alone[1].reset()
        seen = many.step(actions)[0]
        expected = [one.step(action)[0] for one, action in zip(alone, actions, strict=True)]
        np.testing.assert_array_equal(seen, expected)
        assert [one.run.time for one in many.plants] == [one.run.time for one in alone]
    many.close()


def test_plants_that_differ_are_refused() -> None:
    durations = iter([0.2, 0.3])
    with pytest.raises(InputError, match=r"Plants: make: expected plants with the same actions"):
        Plants(lambda: plant(next(durations)), 2)
