"""Learn to swing a flexible arm by 0.3 rad, without a model: random search over linear feedback, on plants side by side.

    u = k . (goal - hinge, -spin, -speed),    reward = -|tip - goal|,    k <- mean of the best quarter, in rounds

The environment has gymnasium's interface, so that any library of reinforcement learning takes it as it is.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fmbs_skfem import scenes
from fmbs_skfem.control.environments import Plant, Plants
from fmbs_skfem.scenes import build

SCENE = Path(__file__).parent / "plant.yaml"
GOAL = 0.3  # [rad]


def main(
    rounds: int = 6, count: int = 16, threads: int = 2, duration: float = 1.0, seed: int = 0
) -> dict[str, float]:
    """Mean distance of the tip from its goal over the last episode [m]: of the best feedback of the first round and the last."""
    scene = scenes.read(SCENE)
    system, scheme = build.chosen_form(scene, build.system(scene)), build.dynamic(scene).scheme

    def make() -> Plant:
        reward = lambda outputs, inputs: -abs(outputs["tip"] - np.sin(GOAL))  # noqa: E731
        return Plant(system, scheme, ["hinge", "spin", "tip", "speed"], reward, duration, every=10)

    plants, random = Plants(make, count, threads), np.random.default_rng(seed)
    mean, spread, best = np.zeros(3), np.array([5.0, 1.0, 0.5]), []
    for _ in range(rounds):
        gains, total, over = mean + spread * random.normal(size=(count, 3)), np.zeros(count), False
        seen, _ = plants.reset()
        while not over:
            told = np.stack([GOAL - seen[:, 0], -seen[:, 1], -seen[:, 3]], axis=1)
            seen, rewards, ended, late, _ = plants.step(np.sum(gains * told, axis=1)[:, None])
            total, over = total + rewards, bool((ended | late).all())
        chosen = gains[np.argsort(total)[-count // 4 :]]
        mean, spread = chosen.mean(axis=0), chosen.std(axis=0) + 0.05
        best.append(-total.max() * plants.plants[0].every * scheme.step / duration)
    plants.close()
    return {"first": best[0], "last": best[-1]}


if __name__ == "__main__":
    print(
        "the tip is {first:.3g} m from its goal at first, {last:.3g} m at last, over an episode".format(
            **main()
        )
    )
