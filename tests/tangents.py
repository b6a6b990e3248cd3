"""Tangents of contacts that stick and slide, against differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.testing import assert_allclose

from fmbs_skfem.systems import System, compiled


def check_tangent_behind(system: System, sizes: Sequence[float]) -> None:
    """The tangent of positions and of velocities (0.3 of them), after the accepted state of the
    start, at ways of some sizes.
    """
    model, random = compiled.compile_system(system), np.random.default_rng(1)
    memory, none = compiled.accepted(model, system.x0), np.zeros(0)
    for size in sizes:
        d, way, v = random.normal(size=(3, system.size))
        x = system.x0 + size * way
        K = compiled.tangent(model, x, none, 0.0, 0.3, memory, 0.1 * v)
        ends = [
            compiled.forces(model, x + k * 1e-7 * d, 0.1 * v + 3e-8 * k * d, 0.0, memory)
            for k in (1, -1)
        ]
        assert np.abs(K @ d).max() > 0.0
        assert_allclose(K @ d, (ends[0] - ends[1]) / 2e-7, atol=1e-5 * np.abs(K @ d).max())
