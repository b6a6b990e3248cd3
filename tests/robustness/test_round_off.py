"""The hardest small equilibria with inputs moved by 1e-15 of themselves: what a kernel of another
processor does to a model.

Behind branch and limit points, where hardly anything resists, with ends rolled up or twisted, and
buckling loads of what is stiff: the last digit decides neither whether a solve converges, nor where
it ends, nor what is said of the way.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem.bodies import sections
from fmbs_skfem.bodies.body import Body, Cells
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    ArcLength,
    Trajectory,
    buckling,
    follow_path,
    solve_equilibria,
    solve_statics,
)
from fmbs_skfem.dynamics.equilibria import equilibrium
from fmbs_skfem.dynamics.scheme import STATIC, Newton
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.compiled import compile_system
from fmbs_skfem.systems.forces import loads
from verification.statics import lee_frame, truss

from ..dynamics.test_paths import column
from ..physics.test_beam_problems import arch
from ..physics.test_torsion_beams import CLAMP, STRIP, TIP, square, straight
from ..physics.test_torsion_frames import angled, leg, twisted_ring

MOVED = 1e-15
Answer = tuple[np.ndarray, object]  #: numbers, and what has to be the same


def moved(system: System) -> System:
    """A system whose nodes, shapes, stiffnesses and constant loads have other last digits."""
    rng = np.random.default_rng(0)

    def near(a: np.ndarray) -> np.ndarray:
        return np.asarray(a * (1.0 + MOVED * rng.standard_normal(np.shape(a))))

    def cells(one: Cells) -> Cells:
        return replace(one, table=near(one.table), section=near(one.section))

    elastic = tuple(replace(one, gather=cells(one.gather)) for one in system.elastic)
    pushes = replace(system.loads, constant=near(system.loads.constant))
    return replace(system, elastic=elastic, loads=pushes, x0=near(system.x0))


def end(path: Trajectory) -> Answer:
    """The last state, its negative pivots, and what was crossed."""
    assert path.negative is not None
    return path.x[-1], (
        str(path.negative[-1]),
        [(one.kind, one.negative) for one in path.crossings],
    )


def loaded(steps: int) -> Callable[[System], Answer]:
    return lambda system: end(solve_statics(system, steps))


def followed(first: float, branch: str = "straight") -> Callable[[System], Answer]:
    return lambda system: end(follow_path(system, ArcLength(first, branch=branch), Newton(1e-10)))  # type: ignore[arg-type]


def driven(*times: float) -> Callable[[System], Answer]:
    return lambda system: end(solve_equilibria(system, np.array(times)))


def settled(time: float) -> Callable[[System], Answer]:
    """Downhill to what a ring comes to that its mesh alone holds against a tilt."""

    def solve(system: System) -> Answer:
        model = compile_system(system)
        newton = Newton(STATIC)
        first = equilibrium.newton_statics(model, equilibrium.unloaded(model), newton, 0.0, "time")
        found = equilibrium.settle(model, first, newton, time, "time")
        assert found is not None
        return found.x, found.negative

    return solve


def factors(count: int, *kept: int) -> Callable[[System], Answer]:
    """Load factors at which a structure buckles."""
    return lambda system: (buckling(system, count).factors[list(kept)], "")


def clamped(part: Body, *push: loads.Load) -> System:
    return eliminate(assemble([part], [CLAMP], list(push)))


def rolled(cells: int, slender: float, turns: float) -> System:
    """A beam with torsion under a moment at its end."""
    section = square(1.0 / slender)
    return clamped(
        straight(cells, section),
        loads.Moment("M", TIP, (0.0, 2.0 * np.pi * turns * section.stiffness[4, 4], 0.0)),
    )


def twisted(cells: int, turns: float) -> System:
    """A shaft under a moment at its end."""
    section = square(1e-2)
    return clamped(
        straight(cells, section),
        loads.Moment("M", TIP, (2.0 * np.pi * turns * section.stiffness[3, 3], 0.0, 0.0)),
    )


def blade(push: tuple[float, float, float]) -> System:
    """A beam that is stiff in the plane of z, under a force at its end."""
    return clamped(straight(8, STRIP), loads.PointForce("F", TIP, push))


def frame() -> System:
    """A right-angle frame of thin legs, pulled along the first one (Argyris 1979)."""
    section = sections.Rectangular(0.6, 30.0).of_beam(sections.Material(71240.0, 1e-9, 0.31))
    legs = (
        leg("one", (0, 0, 0), (240, 0, 0), 4, section),
        leg("two", (240, 0, 0), (240, -240, 0), 4, section),
    )
    return eliminate(
        assemble(
            list(legs), angled(*legs), [loads.PointForce("F", At("two", "right"), (1.0, 0.0, 0.0))]
        )
    )


#: models, how they are solved, and by how much answers may differ over their size: some ten times
#: of what they do
CASES: dict[str, tuple[Callable[[], System], Callable[[System], Answer], float]] = {
    "a column behind Euler's load in one step": (lambda: column(1e-4, cells=8), loaded(1), 1e-11),
    "a column pushed to the other side": (lambda: column(-1e-2, cells=8), loaded(5), 1e-11),
    "a straight column past two branch points": (
        lambda: column(0.0, 12.0, cells=8),
        loaded(24),
        1e-12,
    ),
    "a column along the branch that turns off": (
        lambda: column(0.0, cells=8),
        followed(0.3, "other"),
        1e-10,
    ),
    "a column straight on at its branch point": (
        lambda: column(0.0, cells=8),
        followed(0.1),
        1e-12,
    ),
    "a column around a sharp bend of its path": (
        lambda: column(-1e-5, cells=8),
        followed(0.5),
        1e-11,
    ),
    "a truss that snaps through in one step": (lambda: truss(load=4.0), loaded(1), 1e-12),
    "a truss that snaps through in two": (lambda: truss(load=8.0), loaded(2), 1e-12),
    "a truss along its path": (lambda: truss(load=8.0), followed(0.1), 1e-12),
    "Lee's frame behind its limit load": (lambda: lee_frame(2), loaded(1), 1e-12),
    "a ring of 8 cells that its mesh holds": (lambda: twisted_ring(8), settled(0.5), 1e-9),
    "a ring of 16 cells that its mesh holds": (lambda: twisted_ring(16), settled(1.0), 1e-8),
    "a ring behind its branch point": (lambda: twisted_ring(8), driven(0.0, 1.0, 2.2, 3.0), 1e-10),
    "a slender beam rolled up": (lambda: rolled(8, 1000.0, 0.25), loaded(2), 1e-11),
    "a shaft twisted by a turn": (lambda: twisted(8, 1.0), loaded(4), 1e-11),
    "a blade past its buckling load": (lambda: blade((0.0, 1e-3, -6.0)), loaded(4), 1e-11),
    "factors of an arch that hardly bends": (lambda: arch(0.8 * np.pi), factors(4, 0, 2), 5e-6),
    "factors of a flat arch": (lambda: arch(0.5 * np.pi), factors(4, 0, 2), 1e-6),
    "a factor of a blade": (lambda: blade((0.0, 0.0, -1.0)), factors(1, 0), 5e-6),
    "factors of a frame": (frame, factors(2, 0, 1), 5e-6),
}


@pytest.mark.parametrize("name", CASES)
def test_the_last_digit_decides_nothing(name: str) -> None:
    make, solve, within = CASES[name]
    system = make()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        numbers, same = solve(system)
        other, alike = solve(moved(system))
    assert alike == same
    np.testing.assert_allclose(other, numbers, rtol=within, atol=within * np.abs(numbers).max())
