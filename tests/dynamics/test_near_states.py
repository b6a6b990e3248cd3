"""What a system does near a state: exact eigenvalues about loaded, following and turning states,
exact buckling loads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.linalg import lsqr

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Material, body, sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import (
    ComplexModes,
    GeneralizedAlpha,
    Spin,
    buckling,
    complex_modes,
    in_rotating_frame,
    integrate,
    linearise,
    solve_statics,
    vibration_modes,
)
from fmbs_skfem.dynamics.near_state import modes, shapes
from fmbs_skfem.dynamics.near_state.linear import Linear
from fmbs_skfem.dynamics.scheme import Newton
from fmbs_skfem.reduction.spaces import component, galerkin, pod
from fmbs_skfem.systems import At, Rayleigh, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from tests import models
from tests.models import segment
from verification.statics_shells import cantilever as strip
from verification.statics_shells import interpolated, spaced

TIGHT = Newton(1e-13)


def cantilever(cells: int, *forces: loads.Load, EA: float = 1e7, dim: int = 2) -> System:
    """EI = rhoA = L = 1 along x, clamped on the left."""
    part = body.cable(
        "beam", segment(cells), sections.Given(EA=EA, EI=1.0, rhoA=1.0), dim=dim, degree=5
    )
    return eliminate(assemble([part], [joints.Clamp("root", At("beam", "left"))], list(forces)))


def frequencies_about(system: System, count: int, steps: int = 4) -> np.ndarray:
    motion = solve_statics(system, steps, TIGHT)
    linear = linearise(motion.system, motion.x[-1], motion.multipliers[-1], 1.0)
    return complex_modes(linear, count).angular_frequencies


def test_modes_about_a_bent_cantilever() -> None:
    """Dead tip force F L^2/EI = 1; a chain of rigid links, three times extrapolated, gives nine
    digits.
    """
    system = cantilever(24, loads.PointForce("tip", At("beam", "right"), (0.0, -1.0)))
    np.testing.assert_allclose(
        frequencies_about(system, 4), [3.77092591, 21.7517582, 60.5149876, 119.702445], rtol=1e-5
    )


def test_hanging_chain() -> None:
    """Bending stiffness next to nothing under its own weight: j0,n / 2 sqrt(g/L)."""
    part = body.cable(
        "chain", segment(60), sections.Given(EA=1e5, EI=1e-8, rhoA=1.0), dim=2, degree=3
    )
    down = loads.Gravity((9.81, 0.0))
    system = eliminate(assemble([part], [joints.Pin("top", At("chain", "left"))], [down]))
    exact = np.array([1.20241278, 2.76003906, 4.32686396]) * np.sqrt(9.81)
    np.testing.assert_allclose(frequencies_about(system, 3), exact, rtol=1e-4)


def beck(load: float, cells: int = 12) -> ComplexModes:
    system = cantilever(cells, loads.Follower("push", At("beam", "right"), (-load, 0.0)), EA=1e8)
    motion = solve_statics(system, 4, TIGHT)
    return complex_modes(linearise(motion.system, motion.x[-1], motion.multipliers[-1], 1.0), 2)


@pytest.mark.parametrize(
    ("load", "exact"),
    [
        (5.0, (4.2176752348, 20.435622435)),
        (15.0, (6.6274066835, 16.2598297625)),
        (19.5, (9.4497809312, 12.6728704024)),
    ],
)
def test_becks_column_before_flutter(load: float, exact: tuple[float, float]) -> None:
    found = beck(load)
    np.testing.assert_allclose(found.angular_frequencies, exact, rtol=1e-5)
    assert np.abs(found.damping_ratios).max() < 1e-6


def test_becks_column_flutters() -> None:
    """The two lowest frequencies meet at 20.0509536 EI/L^2, omega 11.0155576 sqrt(EI/(m L^4))."""
    low, high = 19.0, 21.0
    assert beck(low).eigenvalues.real.max() < 1e-6
    for _ in range(22):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if beck(middle).eigenvalues.real.max() > 1e-4 else (middle, high)
    assert high == pytest.approx(20.0509536, rel=1e-4)
    assert beck(high).angular_frequencies[0] == pytest.approx(11.0155576, rel=1e-3)


def test_blades_in_a_turning_frame_agree_with_published_frequencies() -> None:
    """Wright et al. (1982): flapping at Omega = 6 is 7.3604; lagging sqrt(flapping^2 - Omega^2)."""
    part = body.cable(
        "beam", segment(16), sections.Given(EA=1e9, EI=1.0, rhoA=1.0), dim=3, degree=5
    )
    raw = assemble([part], [joints.Clamp("root", At("beam", "left"))], [])
    turning = eliminate(in_rotating_frame(raw, Spin(6.0)))
    found = frequencies_about(turning, 4, 1)
    flap = np.array([7.3604, 26.8091])
    np.testing.assert_allclose(
        np.sort(found), np.sort([*flap, *np.sqrt(flap**2 - 36.0)]), rtol=1e-4
    )


def test_reduced_models_in_a_turning_frame() -> None:
    """A blade that is reduced to motions at rest has the frequencies of the full one while it
    turns.
    """
    part = body.cable("beam", segment(8), sections.Given(EA=1e4, EI=1.0, rhoA=1.0), dim=2)
    push = loads.PointForce(
        "push", At("beam", "right"), (1.0, 0.3), lambda t: 0.3 * np.sin(20.0 * t**2)
    )
    raw = assemble([part], [joints.Clamp("root", At("beam", "left"))], [push])
    data = galerkin.snapshots(integrate(eliminate(raw), GeneralizedAlpha(1e-2), 3.0))
    level = component.body_level(raw)
    bases = {
        name: pod.basis(data.q[:, component.rows_of(raw, rows)].T, 1e-9)
        for name, rows in level.items()
    }
    turning = in_rotating_frame(raw, Spin(rate=4.0))
    reduced = galerkin.reduce_system(turning, level, bases, configurations=data.q)
    assert reduced.size <= eliminate(turning).size // 2
    still = frequencies_about(eliminate(raw), 2)
    found = frequencies_about(eliminate(turning), 2)
    assert found[0] > 1.05 * still[0]
    np.testing.assert_allclose(frequencies_about(reduced, 2), found, rtol=1e-3)


def test_the_frame_may_turn_about_any_axis_through_any_point() -> None:
    """A blade from (3, 1, 2) on that turns about an axis along y there."""
    place = np.array([3.0, 1.0, 2.0])
    part = body.cable(
        "beam", segment(12), sections.Given(EA=1e9, EI=1.0, rhoA=1.0), dim=3, degree=5, origin=place
    )
    raw = assemble([part], [joints.Clamp("root", At("beam", "left"))], [])
    turning = eliminate(in_rotating_frame(raw, Spin(4.0, (0.0, 2.0, 0.0), tuple(place))))
    flap = 5.5850
    np.testing.assert_allclose(
        frequencies_about(turning, 2, 1), [np.sqrt(flap**2 - 16.0), flap], rtol=1e-4
    )


def shaft(spin: float, outside: float = 0.0, inside: float = 0.0) -> ComplexModes:
    """A simply supported shaft EI = rhoA = L = 1 along x that turns about itself."""
    part = body.cable(
        "shaft", segment(10), sections.Given(EA=1e4, EI=1.0, rhoA=1.0), dim=3, degree=5
    )
    ends = [joints.Spherical("a", At("shaft", "left")), joints.Spherical("b", At("shaft", "right"))]
    raw = assemble([part], ends, [], Rayleigh(outside, inside))
    return complex_modes(
        linearise(eliminate(in_rotating_frame(raw, Spin(spin, (1.0, 0.0, 0.0))))), 4
    )


def test_whirling_of_a_shaft() -> None:
    """A motion of w in space is one of w - Omega or w + Omega in the rotating frame; at pi^2 no
    stiffness is left.
    """
    w = np.pi**2 * np.array([1.0, 4.0])
    np.testing.assert_allclose(
        shaft(3.0).angular_frequencies, np.sort([*(w - 3.0), *(w + 3.0)]), rtol=1e-6
    )
    assert shaft(np.pi**2).angular_frequencies[0] == pytest.approx(0.0, abs=1e-3)


def test_damping_inside_of_a_shaft_makes_it_unstable() -> None:
    """Jeffcott: stable below w (1 + c_outside / c_inside), here 1.5 w, c_inside = beta w^2 m and
    c_outside = alpha m.
    """
    w, inside = np.pi**2, 1e-3
    outside = 0.5 * inside * w**2
    assert shaft(1.499 * w, outside, inside).eigenvalues.real.max() < 0.0
    assert shaft(1.501 * w, outside, inside).eigenvalues.real.max() > 0.0
    still = shaft(0.0, outside, inside)
    np.testing.assert_allclose(
        still.damping_ratios[:2], (outside / w + inside * w) / 2.0, rtol=1e-6
    )


@pytest.mark.parametrize(("sine", "exact"), [(False, (2.35, 3.3)), (True, (1.0, 4.05, 5.95))])
def test_spinning_membrane_disk(sine: bool, exact: tuple[float, ...]) -> None:
    """A free disk without bending stiffness, nu = 0.3: omega^2 / Omega^2 of Lamb and Southwell
    (1921); a quarter of it.

    About x it is symmetric (n even) or antisymmetric (n odd), about y symmetric. It is held across
    only where it is spun up.
    """
    spin, E, t = 1.0, 1e4, 1e-5
    shape = interpolated(
        lambda phi, r: np.stack([r * np.cos(phi), r * np.sin(phi), 0.0 * phi], -1),
        (spaced(np.pi / 2, 6), 0.005 + spaced(0.995, 8, 2.5)),
    )
    part = plate("disk", shape, t, Material(E, 1.0, 0.3), dim=3)
    planes = [
        joints.Edge("x", "disk", ("xi1_max",), "x", "yz"),
        joints.Edge("y", "disk", ("xi1_min",), "yz" if sine else "y", "x" if sine else "xz"),
    ]
    flat = joints.Edge("flat", "disk", ("xi2_min", "xi2_max"), "z")

    def turning(*more: joints.Joint) -> System:
        return in_rotating_frame(assemble([part], [*planes, *more], []), Spin(spin))

    held, free = eliminate(turning(flat)), eliminate(turning())
    spun = solve_statics(held, 1, TIGHT)
    q = held.lift(spun.x[-1])
    x = lsqr(free.lift.matrix, q - free.lift.offset, atol=1e-15, btol=1e-15)[0]
    np.testing.assert_allclose(free.lift(x), q, atol=1e-12)
    found = complex_modes(linearise(free, x), 40)
    across = np.abs((free.lift.matrix @ found.shapes).reshape(-1, 3, 40))[:, 2].max(axis=0) > 0.5
    ratios = found.angular_frequencies[across] ** 2 / spin**2
    for value in exact:
        assert np.abs(ratios / value - 1.0).min() < 1e-3


def test_column_buckles_at_eulers_load() -> None:
    """Clamped and free: pi^2/4, 9 pi^2/4; a load of 3 has the factors of a third."""
    found = buckling(
        cantilever(16, loads.PointForce("push", At("beam", "right"), (-3.0, 0.0)), EA=1e8), 2
    )
    np.testing.assert_allclose(found.factors, np.pi**2 / 4 * np.array([1.0, 9.0]) / 3.0, rtol=3e-6)


@pytest.mark.parametrize("cells", [6, 8, 10, 12])
def test_becks_column_has_no_factor(cells: int) -> None:
    """It flutters at 20.05 EI/L^2 and never loses its stiffness: what round-off predicts is not
    told.
    """
    with pytest.raises(
        InputError,
        match="loads at which the system loses its stiffness, got none; look at `complex_modes`",
    ):
        buckling(cantilever(cells, loads.Follower("push", At("beam", "right"), (-1.0, 0.0))), 2)


def test_loads_without_a_potential_are_known() -> None:
    """Of a push whose part s = 0.3 follows the tip: w'' + k^2 (w - w_L + (L - x) s w'_L) = 0, so
    cos(kL) = -s / (1 - s).
    """
    tip = At("beam", "right")
    pushes = [
        loads.Follower("following", tip, (-0.3, 0.0)),
        loads.PointForce("dead", tip, (-0.7, 0.0)),
    ]
    found = buckling(cantilever(16, *pushes), 1)
    np.testing.assert_allclose(found.factors, np.arccos(-0.3 / 0.7) ** 2, rtol=3e-6)
    assert not found.conservative
    assert buckling(cantilever(8, pushes[1]), 1).conservative


def test_factors_do_not_depend_on_the_size_of_the_load() -> None:
    """A load of a thousand buckling loads is tried in small parts."""
    found = [
        buckling(
            cantilever(8, loads.PointForce("push", At("beam", "right"), (-force, 0.0)), EA=1e6), 1
        ).factors
        * force
        for force in (1.0, 2.4, 2000.0)
    ]
    np.testing.assert_allclose(found, np.mean(found), rtol=1e-6)


@pytest.mark.parametrize("history", [lambda t: 2.0 * t, lambda t: np.minimum(t, 2.0)])
def test_histories_in_proportion_to_time_are_factors(
    history: Callable[[np.ndarray], np.ndarray],
) -> None:
    """A load of 0.5 at t = 2 s has the factor of Euler's load over 0.5, whatever its history does
    beyond.
    """
    push = loads.PointForce(
        "push", At("beam", "right"), (-0.5 / float(history(np.array(2.0))), 0.0), history
    )
    np.testing.assert_allclose(
        buckling(cantilever(16, push, EA=1e8), time=2.0).factors, np.pi**2 / 2.0, rtol=3e-6
    )


@pytest.mark.parametrize(
    "history",
    [
        lambda t: np.sin(0.5 * np.pi * t),
        lambda t: t**2,
        lambda t: 0.5 + 0.5 * t,
        lambda t: t + 0.1 * t * (1.0 - t),  # the factor would be 9 % off
        lambda t: t + 1e-6 * t * (1.0 - t),
    ],
)
def test_other_histories_have_no_factor(history: Callable[[np.ndarray], np.ndarray]) -> None:
    """Predicted from small loads, sin(pi t/2) would buckle at 2/pi of the load that buckles, and
    t^2 never.
    """
    push = loads.PointForce("push", At("beam", "right"), (-1.0, 0.0), history)
    with pytest.raises(
        InputError, match="in proportion to t, got another history of a load on beam up to t = 1 s"
    ):
        buckling(cantilever(8, push))


def test_large_and_small_solutions_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    """Arnoldi's iteration and the dense solution, with gyroscopic terms, damping and constraints
    with multipliers.
    """
    part = body.cable(
        "beam", segment(16), sections.Given(EA=1e4, EI=1.0, rhoA=1.0), dim=3, degree=5
    )
    raw = assemble([part], [joints.Clamp("root", At("beam", "left"))], [], Rayleigh(0.1, 1e-3))
    linear = linearise(in_rotating_frame(raw, Spin(1.5)))
    few = complex_modes(linear, 6)
    monkeypatch.setattr(modes, "SMALL", 0)
    many = complex_modes(linear, 6)
    np.testing.assert_allclose(many.eigenvalues, few.eigenvalues, rtol=1e-7)
    assert few.eigenvalues.real.max() < 0.0
    for found in (few, many):
        for s, v in zip(found.eigenvalues, found.shapes.T, strict=True):
            rest = s * s * (linear.mass @ v) + s * (linear.damping @ v) + linear.stiffness @ v
            free = (
                rest
                - linear.rows.T
                @ np.linalg.lstsq(linear.rows.T.astype(complex), rest, rcond=None)[0]
            )
            assert np.linalg.norm(free) < 1e-6 * np.linalg.norm(linear.stiffness @ v)


@pytest.mark.parametrize(
    ("last", "damping", "unknown"),
    [
        (36.0, 0.1 * np.eye(6), 0),
        (36.0, np.eye(6, k=1) - np.eye(6, k=-1), 0),  # gyroscopic
        (0.0, np.zeros((6, 6)), 0),  # free
        (-100.0, np.zeros((6, 6)), 4),  # e^(10 t)
        (36.0, np.diag([0.0, 0.0, 0.0, 0.0, 0.0, -0.1]), 4),  # e^(0.05 t)
    ],
)
def test_whether_faster_motions_can_grow(
    last: float, damping: np.ndarray, unknown: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of six oscillators the slowest one is asked for, and two are found: of the other four
    something is known, or not.
    """
    monkeypatch.setattr(modes, "SMALL", 0)
    K = csr_array(np.diag([1.0, 4.0, 9.0, 16.0, 25.0, last]))
    found = complex_modes(
        Linear(np.zeros(6), csr_array(np.eye(6)), csr_array(damping), K, np.zeros((0, 6))), 1
    )
    assert (found.unknown > 0) == (unknown > 0)
    assert found.unknown in (0, unknown)
    # not symmetric, as of follower forces
    turned = csr_array(K.toarray() + np.eye(6, k=1) - np.eye(6, k=-1))
    assert complex_modes(
        Linear(np.zeros(6), csr_array(np.eye(6)), csr_array(damping), turned, np.zeros((0, 6))), 1
    ).unknown


def test_free_motions_have_the_eigenvalue_zero() -> None:
    part = body.cable("beam", segment(8), sections.Given(EA=1e3, EI=1.0, rhoA=1.0), dim=2, degree=5)
    found = complex_modes(linearise(assemble([part], [], [])), 4)
    assert np.abs(found.eigenvalues[:3]).max() < 1e-3
    assert found.angular_frequencies[3] == pytest.approx(22.3732854, rel=1e-6)


def test_double_zeros_cost_a_large_free_body_no_digits() -> None:
    part = body.cable(
        "beam", segment(120), sections.Given(EA=1e3, EI=1.0, rhoA=1.0), dim=2, degree=5
    )
    system = assemble([part], [], [])
    linear = linearise(system)
    found = complex_modes(linear, 5)
    assert (np.abs(found.eigenvalues[:3]) < 0.1).all()
    np.testing.assert_allclose(found.angular_frequencies[3:], [22.3732854, 61.6728229], rtol=1e-4)
    free = shapes.find_free(system, linear)
    assert shapes.stands_alone(linear, free)
    np.testing.assert_allclose(
        complex_modes(shapes.apart_from(linear, free), 2).angular_frequencies,
        [22.3732854, 61.6728229],
        rtol=1e-7,
    )


def test_free_motions_that_are_damped_do_not_stand_alone() -> None:
    part = body.cable("beam", segment(4), sections.Given(EA=1e3, EI=1.0, rhoA=1.0), dim=2)
    system = assemble([part], [], [])
    linear = linearise(replace(system, damping=csr_array(0.1 * system.mass)))
    assert not shapes.stands_alone(linear, shapes.find_free(system, linear))
    found = complex_modes(linear, 6).eigenvalues
    np.testing.assert_allclose(np.sort(found.real), [-0.1, -0.1, -0.1, 0.0, 0.0, 0.0], atol=1e-6)


@pytest.mark.parametrize("length, beta", [(1.0, 1e-4), (1e-6, 1e-10)])
def test_damping_ratios_of_beams_of_any_size(length: float, beta: float) -> None:
    """beta omega / 2 with damping in proportion to the stiffness, of unknowns in metres beside
    slopes.
    """
    section = sections.Given(EA=1e6, EI=length**2, rhoA=1.0)
    system = models.cantilever(
        4, length=length, section=section, damping=Rayleigh(0.0, beta), ancf=True
    )
    found, ratios = (
        complex_modes(linearise(system), 2),
        0.5 * beta * vibration_modes(system, 2).angular_frequencies,
    )
    np.testing.assert_allclose(found.damping_ratios, ratios, rtol=1e-7)


def test_no_damping_is_a_plain_zero() -> None:
    """Tables print a negative zero as -0."""
    undamped = complex_modes(linearise(cantilever(1)), 2)
    assert not undamped.damping_ratios.any()
    assert not np.signbit(undamped.damping_ratios).any()


def test_bad_input_is_named() -> None:
    beam = cantilever(4)
    with pytest.raises(InputError, match="all coordinates of full bodies"):
        in_rotating_frame(beam, Spin(1.0))
    with pytest.raises(InputError, match="loads that change the stiffness, got none"):
        buckling(beam)
    with pytest.raises(InputError, match="modes, count: expected 1 or more, got 0"):
        complex_modes(linearise(beam), 0)


def test_a_strip_that_bends_first_buckles_sideways() -> None:
    """P L^2 = 4.0125993 sqrt(EI GJ) (Prandtl, Michell 1899), of a shell 2 % more: its clamp lets no
    section warp.
    """
    pushes = [loads.PointForce(place, At("plate", place), (0.0, -0.5, 0.0)) for place in ("b", "c")]
    found = buckling(strip("bfs", (40, 2), 20.0, pushes), 1)
    EI, GJ = 1.2e6 * 0.1**3 / 12.0, 0.6e6 * 0.1**3 / 3.0
    assert found.factors[0] == pytest.approx(4.0125993435789 * np.sqrt(EI * GJ) / 20.0**2, rel=0.03)


NET = """\
schema: 1
name: net
parameters: {stretch: {value: 1 mm, range: [0.5 mm, 1 mm]}}
bodies:
  a: {type: cable, mesh: beam_10.msh, section: &s {shape: given, EA: 100 kN, EI: 1e-4 N m^2, rhoA: 0.1 kg/m}}
joints:
  a0: {type: pin, at: a.left}
  a1: {type: driven_position, at: a.right, displacement: [stretch * t / (1 s), 0, 0]}
analysis: {type: modes, count: 2, load_steps: 1}
"""


def scene_of(text: str) -> scenes.Scene:
    return scenes.loads(text, Path(__file__).parents[2] / "meshes")


SHORT = """a1: {type: slider, at: a.right, direction: [1, 0, 0]}
  short: {type: distance, at: a.right, to: [3 m, 0, 0], length: 1.999 m}"""


@pytest.mark.parametrize("more, joint", [("", ""), ("damped: true, ", ""), ("", SHORT)])
def test_a_string_that_only_joints_stretch(more: str, joint: str) -> None:
    """sqrt(N/rhoA)/2L, N = EA e: joints that are driven, or have another length, leave the
    reference, without any load.
    """
    drive = "a1: {type: driven_position, at: a.right, displacement: [stretch * t / (1 s), 0, 0]}"
    scene = scene_of(NET.replace("count", f"{more}count").replace(drive, joint or drive))
    found = scene.analysis.find(scene)
    exact = np.sqrt(100e3 * 1e-3 / 0.1 / 1.001) / 2.0  # of a string that is longer and lighter
    assert found.facts["about"] == "equilibrium"
    np.testing.assert_allclose(found.frequencies, exact, rtol=1e-3)


def test_a_diagram_over_the_stretch_of_a_string() -> None:
    scene = scene_of(
        NET.replace("modes, count: 2", "campbell, parameter: stretch, count: 2, steps: 2")
    )
    hertz = np.array(scene.analysis.find(scene).facts["frequencies_hz"])
    np.testing.assert_allclose(hertz[:, 1] / hertz[:, 0], np.sqrt(2.0), rtol=2e-3)


def test_drives_that_have_not_begun_leave_the_reference() -> None:
    scene = scene_of(NET.replace("stretch * t / (1 s)", "stretch * sin(pi * t / (1 s))"))
    assert scene.analysis.find(scene).facts["about"] == "reference"


def bar(cells: int = 3, damping: Rayleigh | None = None) -> System:
    """A beam with torsion, clamped; its first director has no mass."""
    part = beam("bar", segment(cells), sections.Circular(0.01), Material(1e9, 1800.0))
    return eliminate(
        assemble([part], [joints.Clamp("root", At("bar", "left"))], damping=damping or Rayleigh())
    )


def test_all_modes_of_a_beam_are_those_of_a_clamped_bar() -> None:
    """Bending (Euler and Bernoulli, twice), torsion and stretch of the whole list; few of them by
    another iteration.
    """
    system = bar(cells=4)
    linear = linearise(system)
    found = modes.real_modes(linear, len(linear.x))
    hertz, V = found.angular_frequencies / (2.0 * np.pi), found.shapes
    assert len(hertz) == 3 * len(linear.x) // 4  # positions, and two directors of three
    bend = np.array([1.875104, 4.694091]) ** 2 * np.sqrt(1e9 * 0.0025**2 / 1800.0) / (2.0 * np.pi)
    np.testing.assert_allclose(hertz[:4], np.repeat(bend, 2), rtol=3e-3)
    twist, stretch = np.sqrt(np.array([1e9 / 2.6, 1e9]) / 1800.0) / 4.0
    for exact in (twist, stretch):
        assert np.abs(hertz / exact - 1.0).min() < 2e-3
    np.testing.assert_allclose(modes.real_modes(linear, 2).squares, found.squares[:2], rtol=1e-7)
    np.testing.assert_allclose(V.T @ (linear.mass @ V), np.eye(len(hertz)), atol=1e-9)
    residual = linear.stiffness @ V - (linear.mass @ V) * found.squares
    assert np.abs(residual).max() < 1e-9 * found.squares[-1]


def test_damped_modes_of_a_beam_without_mass_in_a_director() -> None:
    """C = a M + b K: s^2 + (a + b w^2) s + w^2 = 0 of every mode; what has no mass follows, or
    comes to rest with -1/b.
    """
    a, b = 0.3, 1e-5
    system = bar(damping=Rayleigh(a, b))
    linear = linearise(system)
    squares = modes.real_modes(linear, len(linear.x)).squares
    values = complex_modes(linear, len(linear.x)).eigenvalues
    exact = -0.5 * (a + b * squares) + np.sqrt(0.25 * (a + b * squares) ** 2 - squares + 0j)
    for one in exact[:12]:
        assert np.abs(values - one).min() < 1e-5 * abs(one)
    assert (np.abs(values + 1.0 / b) < 1e-3 / b).sum() >= len(linear.x) // 4
    still = replace(linear, damping=csr_array(linear.damping.shape))
    np.testing.assert_allclose(
        complex_modes(still, 6).angular_frequencies, np.sqrt(squares[:6]), rtol=1e-6
    )
    assert not complex_modes(still, 6).beyond.size


def test_a_direction_with_neither_mass_nor_stiffness_is_refused() -> None:
    linear = linearise(bar())
    light = np.flatnonzero(linear.mass.diagonal() == 0.0)
    kept = np.ones(len(linear.x))
    kept[light] = 0.0
    limp = csr_array(linear.stiffness.multiply(kept).multiply(kept[:, None]))
    with pytest.raises(InputError, match="a mass or a stiffness in every direction"):
        modes.real_modes(replace(linear, stiffness=limp), len(linear.x))
