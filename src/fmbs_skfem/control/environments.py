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
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..core.errors import InputError, SolverError, listed, say
from ..core.values import arguments, arrays
from ..core.values.arguments import checked
from ..dynamics.scheme import GeneralizedAlpha, Newton
from ..systems.signals import inputs_of
from ..systems.system import System
from .live import is_count, start
from .side_by_side import Found, SideBySide

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
#: reward, whether the episode has ended, and at its time limit, reasons
Judgement: TypeAlias = tuple[float, bool, bool, dict[str, Any]]
Answer: TypeAlias = tuple[np.ndarray, float, bool, bool, dict[str, Any]]
BEGUN: Judgement = 0.0, False, False, {}  #: of an episode that has begun


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
            return self.observation, *self.judge(given, error)
        answer = self.judge(given, self.run.outputs(self.observed))
        return self.observation, *answer

    def judge(self, given: Columns, found: Found) -> Judgement:
        """Reward, end, time limit and reasons after a step with inputs by name, of which the outputs
        or an error are found.
        """
        if isinstance(found, SolverError):
            return self.worth(given), True, False, {"error": str(found)}
        self.last = found
        late = self.run.time > self.duration - 0.5 * self.run.run.scheme.step
        return self.worth(given), self.run.ended or self.is_over(), late, {}

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
        runs = [plant.run for plant in self.plants]
        self.together = SideBySide(runs, one.observed, threads)
        self.closed_threads = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """The observations (p, k) at the start."""
        self.done[:] = False
        for k in range(self.num_envs):
            self.begin(k, seed)
        return self.observations, {}

    def begin(self, k: int, seed: int | None = None) -> None:
        """Begin an episode of the plant with a number."""
        self.plants[k].reset(seed=seed)
        self.together.put(k, self.plants[k].run)

    @property
    def observations(self) -> np.ndarray:
        """Of the last states that were reached, (p, k)."""
        return np.array([list(plant.last.values()) for plant in self.plants])

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
        given = dict[int, Columns]()
        values = np.clip(actions, self.action_space.low, self.action_space.high).tolist()
        for k, (plant, over) in enumerate(zip(self.plants, self.done.tolist(), strict=True)):
            if over:
                self.begin(k)
            else:
                given[k] = dict(zip(plant.names, values[k], strict=True))
        found = self.together.step(given, self.plants[0].every)
        rewards, ended, late, told = zip(
            *(
                plant.judge(given[k], found[k]) if k in found else BEGUN
                for k, plant in enumerate(self.plants)
            ),
            strict=True,
        )
        self.done = np.array(ended) | np.array(late)
        errors = (
            {"error": np.array([one.get("error", "") for one in told], object)} if any(told) else {}
        )
        return self.observations, np.array(rewards), np.array(ended), np.array(late), errors

    def close(self, **more: Any) -> None:
        """End the threads."""
        self.closed_threads = True
        self.together.close()
