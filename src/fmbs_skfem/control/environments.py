"""Plants as environments of reinforcement learning, with the interface of gymnasium: one, or many
side by side.

    observation, _ = plant.reset()
    observation, reward, terminated, truncated, info = plant.step(action)

Actions are the inputs of the system that have ranges, held for some steps, observations are columns
of outputs. Where gymnasium is installed these are a `gymnasium.Env` and a
`gymnasium.vector.VectorEnv`, elsewhere they have the same methods and spaces.

Source: M. Towers et al., Gymnasium: a standard interface for reinforcement learning environments,
arXiv 2407.17032 (2024).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..core.errors import InputError, SolverError, listed, say
from ..core.values import arguments, arrays
from ..core.values.arguments import checked
from ..dynamics.scheme import GeneralizedAlpha, Newton
from ..systems.signals import inputs_of
from ..systems.system import System
from .live import is_count, start

if TYPE_CHECKING:
    from .spaces import NEXT_STEP, Box, Env, VectorEnv
else:
    try:
        from gymnasium import Env
        from gymnasium.spaces import Box
        from gymnasium.vector import AutoresetMode, VectorEnv

        NEXT_STEP = AutoresetMode.NEXT_STEP
    except ImportError:
        from .spaces import NEXT_STEP, Box, Env, VectorEnv

Columns: TypeAlias = Mapping[str, float]
Reward: TypeAlias = Callable[[Columns, Columns], float]  #: of outputs and inputs by name, SI
Answer: TypeAlias = tuple[np.ndarray, float, bool, bool, dict[str, Any]]


class Plant(Env):
    """One plant: inputs with ranges are its action, `observed` outputs its observation, both in the
    order of their names.

    An action acts for `every` steps of the scheme. Episodes end (`truncated`) after `duration` [s],
    and (`terminated`) where `ends(outputs)` holds, an event stops the run or a step cannot be
    taken, with the reason as `info["error"]`. Every episode begins with the start of the system,
    and follows from its actions to the bit. InputError without inputs that have ranges.

        >>> from fmbs_skfem import scenes
        >>> from fmbs_skfem.control.environments import Plant
        >>> from fmbs_skfem.dynamics import GeneralizedAlpha
        >>> from fmbs_skfem.scenes import build
        >>> cart = '''
        ... schema: 1
        ... dimension: 2
        ... inputs: {u: {unit: N, range: [-1 N, 1 N]}}
        ... bodies: {cart: {type: point_mass, mass: 2 kg, position: [0, 0]}}
        ... analysis: {type: dynamic, duration: 1 s, step: 10 ms}
        ... loads: {push: {type: control_force, at: cart, direction: [1, 0], force: u}}
        ... outputs: {x: {type: position, at: cart, component: x}}
        ... '''
        >>> system = build.system(scenes.loads(cart))
        >>> reward = lambda outputs, inputs: -abs(outputs["x"] - 1.0)
        >>> plant = Plant(system, GeneralizedAlpha(0.01), ["x"], reward, duration=1.0, every=10)
        >>> plant.reset()
        (array([0.]), {})
        >>> seen, reward, ended, late, info = plant.step([1.0])
        >>> seen.round(3), round(reward, 3), ended, late
        (array([0.002]), -0.998, False, False)
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  (as gymnasium declares it)

    @checked
    def __init__(
        self,
        system: System,
        scheme: GeneralizedAlpha,
        observed: Sequence[str],
        reward: Reward,
        duration: float,
        every: int = 1,
        ends: Callable[[Columns], bool] = lambda outputs: False,
        newton: Newton | None = None,
    ) -> None:
        known = inputs_of(system)
        ranges = {name: one.range for name, one in known.items() if one.range is not None}
        if not ranges:
            got = f"none of {listed(known, '', 'no inputs')}"
            raise InputError(
                say(
                    "Plant",
                    "inputs that have ranges, as actions",
                    got,
                    "write `inputs: {u: {range: [-5 N m, 5 N m]}}`",
                )
            )
        if not is_count(every):
            raise InputError(say("Plant: every", "a whole number of steps, 1 or more", every))
        if not duration > 0.0:
            raise InputError(say("Plant: duration", "a positive time [s]", duration))
        self.names, self.observed = tuple(ranges), tuple(observed)
        self.reward, self.ends, self.duration, self.every = reward, ends, duration, every
        self.run = start(system, scheme, newton)
        self.first, self.last = self.run.state, self.run.outputs(self.observed)
        self.low, self.high = np.array(list(ranges.values())).T
        self.action_space = Box(self.low, self.high, dtype=np.float64)
        self.observation_space = Box(-np.inf, np.inf, (len(self.last),), np.float64)

    @checked
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """The observation at the start; InputError for a seed below 0."""
        if seed is not None and seed < 0:
            raise InputError(say("Plant.reset: seed", "0 or more", seed))
        super().reset(seed=seed)
        self.run.state = self.first
        self.last = self.run.outputs(self.observed)
        return self.observation, {}

    @property
    def observation(self) -> np.ndarray:
        """Of the last state that was reached, (k,)."""
        return np.array(list(self.last.values()))

    def step(self, action: np.ndarray | Sequence[float]) -> Answer:
        """The plant after an action (j,), which is cut to its range [SI]."""
        expected = f"an action of {len(self.low)} finite numbers, {', '.join(self.names)}"
        values = arrays.finite(action, "Plant.step", expected, len(self.low))
        given = dict(zip(self.names, np.clip(values, self.low, self.high).tolist(), strict=True))
        try:
            self.run.step(given, self.every)
        except SolverError as error:
            return self.observation, self.worth(given), True, False, {"error": str(error)}
        self.last = self.run.outputs(self.observed)
        late = self.run.time > self.duration - 0.5 * self.run.run.scheme.step
        return (
            self.observation,
            self.worth(given),
            self.run.ended or self.is_over(),
            late,
            {},
        )

    def is_over(self) -> bool:
        """Whether the episode ends with the last outputs; InputError where that is no yes or no."""
        found = self.ends(self.last)
        arguments.require("Plant: ends, what it gives", found, bool)
        return bool(found)

    def worth(self, given: Columns) -> float:
        """The reward of the last outputs and of inputs that led to them; InputError for one that is
        no finite number.
        """
        found = self.reward(self.last, given)
        arguments.require("Plant: reward, what it gives", found, float)
        return float(found)


class Plants(VectorEnv):
    """Many plants, whose compiled steps run in threads beside each other; one that has ended begins
    anew with its next action.

    `make()` makes one. All of them know nothing of each other, and move as alone, to the bit.
    """

    metadata: dict[str, Any] = {"autoreset_mode": NEXT_STEP}  # noqa: RUF012

    @checked
    def __init__(self, make: Callable[[], Plant], count: int, threads: int = 1) -> None:
        if count < 1 or threads < 1:
            raise InputError(
                say("Plants: count and threads", "at least 1 of each", f"{count} and {threads}")
            )
        self.plants = [make() for _ in range(count)]
        self.num_envs = count
        if bad := [plant for plant in self.plants if not isinstance(plant, Plant)]:
            raise InputError(
                say("Plants: make", "a function that makes a Plant", f"one that makes {bad[0]!r}")
            )
        one = self.plants[0]
        self.single_action_space, self.single_observation_space = (
            one.action_space,
            one.observation_space,
        )
        self.action_space = Box(
            np.tile(one.low, (count, 1)), np.tile(one.high, (count, 1)), dtype=np.float64
        )
        self.observation_space = Box(
            -np.inf, np.inf, (count, *one.observation_space.shape), np.float64
        )
        self.done = np.zeros(count, bool)
        self.shares = [
            share.tolist() for share in np.array_split(np.arange(count), min(threads, count))
        ]
        self.pool = ThreadPoolExecutor(len(self.shares))
        self.closed_threads = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """The observations (p, k) at the start."""
        self.done[:] = False
        return np.stack([plant.reset(seed=seed)[0] for plant in self.plants]), {}

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """All plants after their actions (p, j): observations (p, k), rewards, ends and time limits
        (p,), and reasons.
        """
        p, j = self.action_space.shape
        actions = arrays.finite(
            actions, "Plants.step", f"actions of {p} plants, ({p}, {j}) finite numbers", p, j
        )
        if self.closed_threads:
            raise InputError(
                say(
                    "Plants.step",
                    "plants whose threads are there",
                    "those that were closed",
                    "make them anew",
                )
            )
        found: list[Answer] = [
            answer
            for part in self.pool.map(lambda share: self.take(share, actions), self.shares)
            for answer in part
        ]
        observations, rewards, ended, late, told = (list(part) for part in zip(*found, strict=True))
        self.done = np.array(ended) | np.array(late)
        errors = (
            {"error": np.array([one.get("error", "") for one in told], object)} if any(told) else {}
        )
        return (
            np.stack(observations),
            np.array(rewards, float),
            np.array(ended),
            np.array(late),
            errors,
        )

    def take(self, share: Sequence[int], actions: np.ndarray) -> list[Answer]:
        """One action of some plants, one after the other."""
        return [
            (self.plants[k].reset()[0], 0.0, False, False, {})
            if self.done[k]
            else self.plants[k].step(actions[k])
            for k in share
        ]

    def close(self, **more: Any) -> None:
        """End the threads."""
        self.closed_threads = True
        self.pool.shutdown()
