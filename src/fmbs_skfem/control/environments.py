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

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..core.errors import InputError, SolverError, listed, say
from ..core.values import arguments, arrays
from ..core.values.arguments import checked
from ..dynamics.scheme import GeneralizedAlpha, Newton
from ..systems.signals import inputs_of
from ..systems.system import System
from .live import LiveRun, is_count, start
from .side_by_side import SideBySide

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
Drawn: TypeAlias = Callable[[np.random.Generator], System]  #: the system of an episode
Reward: TypeAlias = Callable[[Columns, Columns], float]  #: of outputs and inputs by name, SI
Answer: TypeAlias = tuple[np.ndarray, float, bool, bool, dict[str, Any]]


def ranges_of(system: System) -> dict[str, tuple[float, float]]:
    """Ranges of the inputs that have some."""
    return {name: one.range for name, one in inputs_of(system).items() if one.range is not None}


class Plant(Env):
    """One plant: inputs with ranges are its action, `observed` outputs its observation, both in the
    order of their names.

    An action acts for `every` steps of the scheme. Episodes end (`truncated`) after `duration` [s],
    and (`terminated`) where `ends(outputs)` holds, an event stops the run or a step cannot be
    taken, with the reason as `info["error"]`. Every episode begins with the start of the system,
    and follows from its actions to the bit. InputError without inputs that have ranges.

    Domain randomisation: a function of a random generator in place of the system is asked for one
    before every episode, with the same inputs and outputs. Random starts: `start_noise` are the
    largest displacement [m] and speed [m/s], root mean squares, by which an episode begins beside
    the start of its system, see `dynamics.perturbed_starts`. Both follow from the seed of `reset`.

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
        system: System | Drawn,
        scheme: GeneralizedAlpha,
        observed: Sequence[str],
        reward: Reward,
        duration: float,
        every: int = 1,
        ends: Callable[[Columns], bool] = lambda outputs: False,
        newton: Newton | None = None,
        start_noise: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.draw = None if isinstance(system, System) else system
        first = system if isinstance(system, System) else self.drawn(np.random.default_rng(0))
        known = inputs_of(first)
        ranges = ranges_of(first)
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
        if len(start_noise) != 2 or not all(0.0 <= one < np.inf for one in start_noise):
            expected = "a displacement [m] and a speed [m/s], 0 or more"
            raise InputError(say("Plant: start_noise", expected, start_noise))
        self.scheme, self.newton, self.start_noise = scheme, newton, start_noise
        self.names, self.observed = tuple(ranges), tuple(observed)
        self.reward, self.ends, self.duration, self.every = reward, ends, duration, every
        #: tells the run what it has done, where plants side by side take its steps, and these where
        #: it is
        self.sync: Callable[[], None] = lambda: None
        self.show: Callable[[LiveRun], None] = lambda run: None
        #: ranges of actions and columns of observations
        self.facts: tuple[dict[str, tuple[float, float]], list[str]] | None = None
        self.begin(first)
        self.first = self.live.state
        self.low, self.high = np.array(list(ranges.values())).T
        self.action_space = Box(self.low, self.high, dtype=np.float64)
        self.observation_space = Box(-np.inf, np.inf, (len(self.last),), np.float64)

    @checked
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """The observation at the start, which follows from a `seed` and the number of resets since;
        InputError for a seed below 0.
        """
        if seed is not None and seed < 0:
            raise InputError(say("Plant.reset: seed", "0 or more", seed))
        super().reset(seed=seed)
        if self.draw is None:
            self.live.state = self.first
        else:
            self.begin(self.drawn(self.np_random))
        if any(self.start_noise):
            self.live.perturb(self.np_random, self.start_noise, self.every * self.scheme.step)
        self.last = self.live.outputs(self.observed)
        self.show(self.live)
        return self.observation, {}

    def drawn(self, random: np.random.Generator) -> System:
        """A system of an episode; InputError where it is none."""
        assert self.draw is not None
        found = self.draw(random)
        arguments.require("Plant: system, what it gives", found, System)
        return found

    def begin(self, system: System) -> None:
        """Begin with a system; InputError where its actions or observations are not those of the one
        before.
        """
        live = start(system, self.scheme, self.newton)
        last = live.outputs(self.observed)
        ranges = ranges_of(system)
        facts = ranges, [*last]
        if self.facts not in (None, facts):
            expected = f"inputs and outputs as those before, {self.facts}"
            raise InputError(say("Plant: system, what it gives", expected, facts))
        # what is cut to its range rises as no loop does
        live.feed.rising.clear()
        self.live, self.facts, self.last = live, facts, last

    @property
    def run(self) -> LiveRun:
        """The run, which may be read at any time."""
        self.sync()
        return self.live

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
        self.last = self.live.outputs(self.observed)
        self.show(self.live)
        late = self.live.time > self.duration - 0.5 * self.live.run.scheme.step
        return self.observation, self.worth(given), self.live.ended or self.is_over(), late, {}

    def is_over(self) -> bool:
        """Whether the episode ends with the last outputs; InputError where that is no yes or no."""
        found: Any = self.ends(self.last)
        if type(found) is not bool:  # a check takes as long as a step of a small plant
            arguments.require("Plant: ends, what it gives", found, bool)
        return bool(found)

    def worth(self, given: Columns) -> float:
        """The reward of the last outputs and of inputs that led to them; InputError for one that is
        no finite number.
        """
        found: Any = self.reward(self.last, given)
        if type(found) is not float or not math.isfinite(found):
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
        alike = lambda plant: (plant.facts, plant.scheme, plant.every, plant.duration)  # noqa: E731
        if any(alike(plant) != alike(one) for plant in self.plants):
            expected = "plants with the same actions, observations and times"
            raise InputError(say("Plants: make", expected, "others"))
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
        runs = [plant.live for plant in self.plants]
        self.together = SideBySide(runs, one.names, one.observed, threads)
        for k, plant in enumerate(self.plants):
            plant.sync, plant.show = partial(self.together.sync, k), partial(self.together.put, k)
        #: names of the columns of observations
        self.columns = (*one.last,)
        self.closed_threads = False

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """The observations (p, k) at the start; of a single `seed` plant k has seed + k."""
        p = self.num_envs
        seeds = (
            [None] * p
            if seed is None
            else [seed + k for k in range(p)]
            if isinstance(seed, int | np.integer)
            else [*seed]
        )
        if len(seeds) != p:
            raise InputError(say("Plants.reset: seed", f"one, or {p} of them", len(seeds)))
        self.done[:] = False
        for plant, one in zip(self.plants, seeds, strict=True):
            plant.reset(seed=one)
        return self.together.columns.T.copy(), {}

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
        values = np.clip(actions, self.action_space.low, self.action_space.high)
        for k in np.flatnonzero(self.done).tolist():
            self.plants[k].reset()
        moved, one, runs = ~self.done, self.plants[0], self.together
        failed = runs.step(values, moved, one.every)
        seen = runs.columns.T.copy()
        rewards, ended = np.zeros(p), np.zeros(p, bool)
        late = moved & (runs.time > one.duration - 0.5 * runs.h)
        given, found = values.tolist(), seen.tolist()
        for k in np.flatnonzero(moved).tolist():
            plant = self.plants[k]
            plant.last = dict(zip(self.columns, found[k], strict=True))
            rewards[k] = plant.worth(dict(zip(one.names, given[k], strict=True)))
            ended[k] = k in failed or runs.stopped[k] or plant.is_over()
        told = np.array([str(failed.get(k, "")) for k in range(p)], object) if failed else None
        late[list(failed)] = False
        self.done = ended | late
        return seen, rewards, ended, late, {} if told is None else {"error": told}

    def close(self, **more: Any) -> None:
        """End the threads."""
        self.closed_threads = True
        self.together.close()
