"""LQR of a flexible arm: linearise, solve the Riccati equation, close the loop on the nonlinear model.

    x' = A x + B u,    u = -K x,    K = R^-1 B^T P,    A^T P + P A - P B R^-1 B^T P + Q = 0

The states are amplitudes of the four slowest modes, the rigid swing among them, and their rates.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.linalg import solve_continuous_are

from fmbs_skfem import dynamics, scenes
from fmbs_skfem.scenes import build

SCENE = Path(__file__).parent / "lqr_arm.yaml"


def main(duration: float = 1.5, modes: int = 4) -> dict[str, float]:
    """Tip at most and at the end [m], largest torque [N m], and how far the tip is from the linear prediction, over the most."""
    scene = scenes.read(SCENE)
    system = build.chosen_form(scene, build.system(scene))
    plant = dynamics.state_space(system, dynamics.linearise(system), outputs=["tip"], count=modes)
    Q, R = 100.0 * plant.C.T @ plant.C + 0.01 * np.eye(2 * modes), np.eye(1)
    K = np.linalg.solve(R, plant.B.T @ solve_continuous_are(plant.A, plant.B, Q, R))
    run = dynamics.start(system, build.dynamic(scene).scheme)
    times, tip, states = [0.0], [0.0], [plant.states(run.motion())[0]]
    while run.time < duration:
        run.step({"u": float(-K[0] @ states[-1])})
        times.append(run.time)
        tip.append(run.outputs()["tip"])
        states.append(plant.states(run.motion())[0])
    values, vectors = np.linalg.eig(plant.A - plant.B @ K)
    predicted = np.real(
        plant.C @ (vectors * np.linalg.solve(vectors, states[0])) @ np.exp(np.outer(values, times))
    )[0]
    most = float(np.abs(tip).max())
    error = float(np.abs(tip - predicted).max()) / most
    return {
        "most": most,
        "end": tip[-1],
        "torque": float(np.abs(np.array(states) @ K[0]).max()),
        "error": error,
    }


if __name__ == "__main__":
    found = main()
    print(
        "the tip goes to {most:.3g} m and is at {end:.1g} m at the end; torque up to {torque:.3g} N m".format(
            **found
        )
    )
