"""At default settings Newton's iteration leaves less than a hundredth of the error of the step, in
positions and in reactions.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.systems.system import System, sizes
from verification import CASES

SHARP = Newton(tolerance=1e-15)


@pytest.mark.parametrize(
    "module, name, steps",
    [
        ("rigid", "heavy-top", (1e-4,)),
        ("rigid", "free-top", (0.01, 0.005)),
        ("integrator", "pendulum-errors", (0.04, 0.02, 0.01)),
        ("integrator", "golden-steps", (0.05,)),
        (
            "dynamics",
            "spin-up",
            (1.25e-3,),
        ),  # in steps of 2.5 ms what round-off changes grows 600 times more over 20 s
        ("dynamics", "free-flight", (1e-3, 5e-4)),
        ("dynamics", "double-pendulum-beams", (1e-3,)),
    ],
)
def test_the_iteration_is_exact_beside_the_step(
    module: str, name: str, steps: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Differences of the runs of a verification case from ones that iterate to round-off, and of
    those from half the step.
    """
    runs: dict[tuple[float, float], tuple[System, float]] = {}

    def seen(
        system: System, scheme: GeneralizedAlpha, duration: float, *options: Any, **more: Any
    ) -> Trajectory:
        runs[scheme.step, scheme.rho_inf] = system, duration
        return integrate(system, scheme, duration, *options, **more)

    cases = import_module(f"verification.{module}")
    monkeypatch.setattr(cases, "integrate", seen)
    for function in vars(cases).values():
        getattr(function, "cache_clear", int)()  # runs that other tests have made are made again
    CASES[name].solve()
    tried = {key: run for key, run in runs.items() if any(abs(key[0] - h) < 1e-9 for h in steps)}
    assert {h for h, _ in tried} == set(steps)
    for (h, rho), (system, duration) in tried.items():
        own, sharp = (
            integrate(system, GeneralizedAlpha(h, rho), duration, newton)
            for newton in (None, SHARP)
        )
        half = integrate(system, GeneralizedAlpha(h / 2, rho), duration, SHARP, every=2)
        place = sizes(system, own.x - sharp.x).max(), sizes(system, sharp.x - half.x).max()
        assert place[0] < 0.01 * place[1] * 4 / 3
        left, method = (
            np.linalg.norm(a.multipliers - b.multipliers, axis=1)[1:]
            for a, b in ((own, sharp), (sharp, half))
        )
        assert left.max() <= 0.01 * method.max() * 4 / 3
