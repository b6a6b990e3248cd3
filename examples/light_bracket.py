"""The lightest bracket that bends by no more than 20 mm: scipy.optimize around a study, a run of a scene for every design.

    minimise  rho b h L    with    w(b, h) <= 20 mm,    5 mm <= b,    h <= 30 mm,    h <= 2 b

A slender beam of small deflection has w = 4 P L^3 / (E b h^3): the optimum is as slender as it may be, h = 2 b, with
h^4 = 8 P L^3 / (E w).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from fmbs_skfem import studies

SCENE = Path(__file__).parent / "light_bracket.yaml"
DENSITY, LENGTH, ALLOWED = 1200.0, 1.0, 0.02


def deflection(design: np.ndarray) -> float:
    """w [m] of a design b, h [mm]."""
    run = studies.run(
        SCENE, parameters={"b": f"{design[0]} mm", "h": f"{design[1]} mm"}, plots=False
    )
    return -float(run.outputs["tip"][-1])


def main() -> dict[str, float]:
    """Width and height [m], mass [kg] and deflection [m] of the lightest bracket, and the number of runs."""
    runs = 0

    def room(design: np.ndarray) -> float:
        nonlocal runs
        runs += 1
        return 1.0 - deflection(design) / ALLOWED

    found = minimize(
        lambda design: design[0] * design[1] / 400.0,
        np.array([20.0, 20.0]),
        bounds=[(5.0, 60.0), (5.0, 30.0)],
        constraints=[
            {"type": "ineq", "fun": room},
            {"type": "ineq", "fun": lambda design: 2.0 * design[0] / design[1] - 1.0},
        ],
        options={"ftol": 1e-9},
    )
    b, h = (float(side) / 1000.0 for side in found.x)
    return {
        "b": b,
        "h": h,
        "mass": DENSITY * b * h * LENGTH,
        "deflection": deflection(found.x),
        "runs": float(runs),
    }


if __name__ == "__main__":
    print(
        "b {b:.4g} m, h {h:.4g} m: {mass:.4g} kg, bends by {deflection:.4g} m; {runs:.0f} runs".format(
            **main()
        )
    )
