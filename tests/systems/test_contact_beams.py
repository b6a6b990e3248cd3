"""Contact of beams with beams against exact impacts, what they conserve, and in every form of a
model.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem.bodies import Body, Given, cable
from fmbs_skfem.contact.beams import ContactBeam
from fmbs_skfem.contact.contacts import ContactPlane
from fmbs_skfem.contact.states import ContactState
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts.excitation import Excitation, excite
from fmbs_skfem.scenes import build
from fmbs_skfem.scenes import reading as scenes
from fmbs_skfem.systems import (
    At,
    Motion,
    Rayleigh,
    System,
    assemble,
    check_force,
    compiled,
    eliminate,
    layouts,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from ..dynamics.test_checkpoint import stopped
from ..forms import forms
from ..models import polyline, segment
from ..tangents import check_tangent_behind

SOFT, STIFF = Given(EA=2000.0, EI=3.0, rhoA=0.5), Given(EA=1e7, EI=1e6, rhoA=0.5)
TIGHT = Newton(tolerance=1e-12)


def pair(
    angle: float, up: tuple[float, ...], dim: int = 3, section: Given = SOFT, cells: int = 4
) -> list[Body]:
    """Beams of 1 m and 1.1 m: one along x about the origin, the other one at an angle about a
    point, each with its own mesh.
    """
    along, at = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([*up, 0.0])[:3]
    ends = {
        "lower": ((-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)),
        "upper": (at - 0.55 * along, at + 0.55 * along),
    }
    return [
        cable(n, segment(cells + (n == "upper"), *map(tuple, e)), section, dim=dim)
        for n, e in ends.items()
    ]


def touch(**more: Any) -> ContactBeam:
    return ContactBeam(
        "touch", body="lower", other="upper", radius=0.05, **{"stiffness": 500.0, **more}
    )


OVERLAPS = [
    (2, 0.0, (0.3, 0.0955)),
    (2, 0.03, (0.3, 0.097)),
    (3, 0.02, (0.05, 0.02, 0.096)),
    (3, 0.5, (0.05, 0.02, 0.09)),
    (3, 1.57, (0.4, 0.1, 0.09)),
]


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("dim, angle, up", OVERLAPS)
def test_contract(dim: int, angle: float, up: tuple[float, ...]) -> None:
    """Tangents of a smooth law, and after an accepted state of all of it, where beams stick and
    slide.
    """
    parts, smooth = (
        pair(angle, up, dim),
        {"stiffness": 50.0, "damping": 0.4, "dissipation": 0.3, "smoothing": 0.002},
    )
    check_force(parts, touch(**smooth))
    check_force(parts, touch(**smooth, exponent=1.5, depth=0.003))
    system = replace(assemble(parts, loads=[touch(friction=0.3, **smooth)]), elastic=())
    check_tangent_behind(system, (1e-5, 3e-3))


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("dim, angle, up", OVERLAPS[1:4])
def test_forces_have_a_potential(dim: int, angle: float, up: tuple[float, ...]) -> None:
    """Without friction and damping the tangent is symmetric, whatever moves where beams touch."""
    system = replace(assemble(pair(angle, up, dim), loads=[touch()]), elastic=())
    x = system.x0 + 1e-3 * np.random.default_rng(2).normal(size=system.size)
    K = compiled.tangent(compiled.compile_system(system), x, np.zeros(0)).toarray()
    assert np.abs(K).max() > 0.0
    assert_allclose(K, K.T, atol=1e-11 * np.abs(K).max())


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("dim", [2, 3])
def test_a_shared_stiffness_is_that_of_the_whole_beam(dim: int) -> None:
    """Parallel beams with a uniform overlap d push each other with k d, whatever number of nodes
    they have.
    """
    parts, read = pair(0.0, (0.0, 0.0, 0.099)[3 - dim :], dim), {"touch": ContactState("touch")}
    for points in (12, 15, 18):
        system = assemble(parts, loads=[touch(points=points, shared=True)], outputs=read)
        assert outputs(integrate(system, GeneralizedAlpha(1e-9), 1e-9))["touch_force"][
            0
        ] == pytest.approx(0.5, rel=1e-9)


@pytest.mark.filterwarnings("ignore:load .* overlap")
def test_nodes_that_are_not_looked_at_are_away() -> None:
    """After leaps of any size, over accepted states between, forces are those of a model that knows
    of no earlier state.
    """
    system, met = (
        replace(assemble(pair(0.7, (0.1, 0.0, 0.2)), loads=[touch(friction=0.3)]), elastic=()),
        0,
    )
    random = np.random.default_rng(4)
    for size in (0.01, 0.03, 0.1):
        model, x = compiled.compile_system(replace(system)), system.x0
        memory = compiled.accepted(model, x)
        for _ in range(10):
            x = x + size * random.normal(size=system.size)
            expected = compiled.forces(
                compiled.compile_system(replace(system)), x, 0.0 * x, 0.0, memory
            )
            assert_allclose(
                compiled.forces(model, x, 0.0 * x, 0.0, memory), expected, rtol=1e-13, atol=1e-13
            )
            met += bool(np.any(expected))
            memory = compiled.accepted(model, x, memory=memory)
    assert met > 3


def fly(
    parts: list[Body], law: ContactBeam, v: tuple[float, ...], h: float, duration: float
) -> tuple[Trajectory, dict[str, np.ndarray]]:
    """The motion of two beams of which the upper one has a speed."""
    measured = {"E": probes.Energy(), "touch": ContactState("touch")}
    system = assemble(parts, loads=[law], outputs=measured, initial={"upper": Motion(velocity=v)})
    motion = integrate(system, GeneralizedAlpha(h, 1.0), duration, TIGHT)
    return motion, outputs(motion)


def momenta(motion: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Momentum [kg m/s] and its moment about the origin [kg m2/s] over time, (s, c) and (s, 3)."""
    system = motion.system
    x, p = (
        part.reshape(len(motion.times), -1, system.dim)
        for part in (motion.x, np.asarray(system.mass @ motion.v.T).T)
    )
    p3, x3 = (np.pad(part, ((0, 0), (0, 0), (0, 3 - system.dim))) for part in (p, x))
    return np.einsum("snc,n->sc", p, system.unit), np.cross(x3, p3).sum(axis=1)


@pytest.mark.parametrize("arm", [0.0, 0.1, 0.25])
def test_impact_of_stiff_rods(arm: float) -> None:
    """Peak force v sqrt(k m), duration pi sqrt(m / k), impulse 2 m v with 1 / m = 1 / m_1 + 1 / m_2
    + arm^2 / I_1.
    """
    k, v, m1, m2, h = 8000.0, 1.0, 0.5, 0.55, 5e-5
    m = 1.0 / (1.0 / m1 + 1.0 / m2 + arm**2 / (m1 / 12.0))
    parts = pair(np.pi / 2, (arm, 0.0, 0.101), section=STIFF)
    motion, found = fly(parts, touch(stiffness=k, resolution=0.0), (0.0, 0.0, -v), h, 0.025)
    force, (P, L) = found["touch_force"], momenta(motion)
    assert force.max() == pytest.approx(v * np.sqrt(k * m), rel=1e-3)
    assert np.count_nonzero(force) * h == pytest.approx(np.pi * np.sqrt(m / k), rel=1e-2)
    lower = len(parts[0].constant)
    p = np.asarray(motion.system.mass @ motion.v[-1]).reshape(-1, 3)[:lower]
    assert motion.system.unit[:lower] @ p[:, 2] == pytest.approx(-2.0 * m * v, rel=1e-3)
    assert np.ptp(P, axis=0).max() < 1e-12
    assert np.ptp(L, axis=0).max() < 1e-6
    assert np.ptp(found["E_balance"]) < 1e-4


@pytest.mark.parametrize("dim", [2, 3])
def test_beams_do_not_leap_over_one_another(dim: int) -> None:
    """A rod that moves three times the thickness of what it meets in a step of 2 ms leaves it as of
    an elastic impact.
    """
    m1, m2, v = 0.5, 0.55, 150.0
    parts = pair(
        np.pi / 2 if dim == 3 else 0.0, (0.0, 0.0, 0.75) if dim == 3 else (0.0, 0.75), dim, STIFF
    )
    motion, _ = fly(
        parts, touch(stiffness=2e6), ((0.0, 0.0, -v) if dim == 3 else (0.0, -v)), 2e-3, 0.02
    )
    p = np.asarray(motion.system.mass @ motion.v[-1]).reshape(-1, dim)[len(parts[0].constant) :, -1]
    assert parts[1].constant @ p == pytest.approx(m2 * v * (m1 - m2) / (m1 + m2), abs=0.02 * m2 * v)


@pytest.mark.parametrize("dim", [2, 3])
def test_beams_that_pass_through_one_another_are_told(dim: int) -> None:
    """In the first step; and where the force is too weak, which a run without divided steps shows
    as well.
    """
    parts = pair(
        np.pi / 2 if dim == 3 else 0.0, (0.0, 0.0, 0.75) if dim == 3 else (0.0, 0.75), dim, STIFF
    )
    for stiffness, speed, duration in ((2e6, 1.5e4, 2e-3), (2e3, 150.0, 8e-3)):
        with pytest.warns(match="went through to the other side"):
            fly(
                parts,
                touch(stiffness=stiffness, resolution=0.0),
                (0.0, 0.0, -speed)[3 - dim :],
                2e-3,
                duration,
            )


@pytest.mark.parametrize("aside", [0.03, 0.06, 0.09])
def test_parallel_beams_that_pass_off_their_middles_are_told(aside: float) -> None:
    """Half of what a hard one turns aside; one that goes by at more than both radii, or is thrown
    back, is not.
    """
    for at, stiffness, speed, told in (
        (aside, 2e3, 150.0, True),
        (aside, 2e6, 15.0, False),
        (0.101, 2e3, 1.5e4, False),
    ):
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            fly(
                pair(0.0, (0.0, at, 0.35), 3, STIFF),
                touch(stiffness=stiffness),
                (0.0, 0.0, -speed),
                0.3 / speed,
                0.6 / speed,
            )
        assert any("went through to the other side" in str(one.message) for one in found) == told, (
            at,
            stiffness,
        )


@pytest.mark.parametrize(
    "angle, along", [(1.2, None), (0.4, None), (0.15, None), (0.0, None), (1.2, True)]
)
def test_crossing_and_parallel_beams_keep_momentum_and_energy(
    angle: float, along: bool | None
) -> None:
    motion, found = fly(
        pair(angle, (0.03, 0.02, 0.11)), touch(along=along), (0.0, 0.0, -1.0), 1e-3, 0.15
    )
    P, L = momenta(motion)
    assert found["touch_force"].max() > 5.0
    assert np.ptp(P, axis=0).max() < 1e-12
    assert np.ptp(L, axis=0).max() < 1e-6
    assert np.ptp(found["E_balance"]) < 1e-3 * found["E_kinetic"][0]


def test_friction_acts_where_planar_beams_touch() -> None:
    """A beam slides along another one: friction is mu N, momentum stays, and so does its moment, as
    its arm is the radius.
    """
    motion, found = fly(pair(0.0, (0.3, 0.105), 2), touch(friction=0.3), (1.0, -0.5), 5e-4, 0.06)
    P, L = momenta(motion)
    pressed = found["touch_force"] > 5.0
    assert pressed.sum() > 20
    assert_allclose(
        found["touch_friction"][pressed], 0.3 * found["touch_force"][pressed], rtol=2e-2
    )
    assert np.ptp(P, axis=0).max() < 1e-12
    assert np.ptp(L[:, 2]) < 1e-5 * np.abs(L[:, 2]).max()


def crossing(cells: int = 6, height: float = 0.12) -> System:
    """A cantilever falls on another one, below and across, and slides."""
    lower = cable("lower", segment(cells, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), SOFT)
    upper = cable("upper", segment(cells, (0.7, -0.5, height), (0.7, 0.5, height)), SOFT)
    held = [joints.Clamp("root", At("lower", "left")), joints.Pin("hinge", At("upper", "left"))]
    start, measured = (
        {"upper": Motion(velocity=(0.0, 0.0, -0.2))},
        {"tip": probes.Position(At("upper", "right")), "touch": ContactState("touch")},
    )
    forces = [touch(friction=0.2), loads.Gravity((0.0, 0.0, -9.81))]
    return assemble([lower, upper], held, forces, Rayleigh(stiffness=2e-3), measured, start)


@pytest.mark.filterwarnings("ignore:.*projected")
def test_every_form(tmp_path: Path) -> None:
    """Full, reduced, hyper-reduced and saved models meet alike."""
    raw, scheme = crossing(), GeneralizedAlpha(1e-3, 0.8)
    full = integrate(eliminate(raw), scheme, 0.25, TIGHT)
    expected = outputs(full)
    assert expected["touch_force"].max() > 2.0
    assert expected["touch_friction"].max() > 0.1
    for system in forms(raw, full, 1e-12, tmp_path / "model.h5"):
        found = outputs(integrate(system, scheme, 0.25, TIGHT))
        for name in ("tip_z", "tip_x", "touch_gap"):
            assert_allclose(found[name], expected[name], atol=2e-3)


EXAMPLE = Path(__file__).parents[2] / "examples" / "crossing_beams.yaml"


def test_the_example() -> None:
    """The gap at the start is the one written there; what falls is caught, and slides with all of
    its friction.
    """
    scene = scenes.read(EXAMPLE)
    system = build.chosen_form(scene, build.system(scene))
    found = outputs(integrate(system, GeneralizedAlpha(scene.analysis.step), 0.5))
    pressed = found["cross_force"] > 1.0
    assert found["cross_gap"][0] == pytest.approx(0.010, rel=1e-9)
    assert pressed.sum() > 50
    assert_allclose(
        found["cross_friction"][pressed], 0.2 * found["cross_force"][pressed], rtol=1e-2
    )
    assert found["cross_gap"].min() > -2e-3


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "other: low",
            "other: low, apart: 1 m",
            "loads.cross.apart: expected a length for a beam that touches itself, .*got two",
        ),
        (
            "other: low",
            "other: low, along: false",
            "load 'cross'.along: expected beams that cross .*, got parallel ones",
        ),
        ("other: low", "other: lo", "loads.cross.other: expected .*did you mean 'low'"),
    ],
)
def test_wrong_scenes_are_named(old: str, new: str, message: str) -> None:
    text = (
        EXAMPLE.read_text(encoding="utf-8")
        .replace(old, new)
        .replace("90 deg", "1 deg" if "along" in new else "90 deg")
    )
    with pytest.raises(InputError, match=message):
        build.system(scenes.loads(text, EXAMPLE.parent))


def limbs(angle: float) -> System:
    """A part of few functions falls on another one, held below at an angle, and slides."""
    full = cable("low", segment(8, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), SOFT)
    low = parts.reduced_body(
        full,
        parts.shape_functions(
            full, excite(full, Excitation(runs=1, duration=0.1, step=1e-3)), None, 5
        ),
    )
    c, s = np.cos(angle), np.sin(angle)
    place = np.array([0.7 * s, -0.5 * s, 0.1001])
    high = parts.placed(low, "high", place, np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
    held = [joints.Clamp("root", At("low", "left")), joints.Pin("hinge", At("high", "left"))]
    law = ContactBeam("touch", body="high", other="low", radius=0.05, stiffness=500.0, friction=0.2)
    start = {"high": Motion(velocity=(0.0, 0.0, -0.5))}
    return eliminate(
        assemble([low, high], held, [law], outputs={"touch": ContactState("touch")}, initial=start)
    )


@pytest.mark.parametrize(
    "name, angle", [("band", np.pi / 2), ("blocks", np.pi / 2), ("blocks", 0.0)]
)
def test_factors_without_contact_and_a_term_of_low_rank_for_it(
    name: str, angle: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Narrow bands and blocks, corrected for what touches, move as a dense matrix with all of it,
    and resumed in the same bits.

    Parallel parts touch at so many nodes that the rank is larger than the number of unknowns.
    """
    scheme, steps = GeneralizedAlpha(1e-3, 0.8), 200
    monkeypatch.setattr(layouts, "WORTH", 10.0 if name == "blocks" else 0.0)

    def make() -> System:
        return limbs(angle) if name == "blocks" else eliminate(crossing(height=0.1001))

    system = make()
    assert compiled.storage(system).storage is layouts.Storage(name)
    motion = integrate(system, scheme, steps * scheme.step, TIGHT)
    part = stopped(system, 16, scheme, steps, newton=TIGHT)
    assert np.count_nonzero(outputs(motion)["touch_friction"]) > 20
    assert_array_equal(
        integrate(make(), scheme, steps * scheme.step, TIGHT, resume=part).x, motion.x
    )
    monkeypatch.setattr(layouts, "DENSE", 10_000)
    monkeypatch.setattr(layouts, "WORTH", 0.0)
    dense = make()
    assert compiled.storage(dense).storage is layouts.Storage.DENSE
    assert_allclose(integrate(dense, scheme, steps * scheme.step, TIGHT).x, motion.x, atol=1e-9)


def test_contact_leaves_the_band_as_narrow_as_it_is() -> None:
    beams, up = pair(1.2, (0.0, 0.0, 0.2), cells=20), (0.0, 0.0, 1.0)
    floor = ContactPlane("floor", body="lower", point=(0.0, 0.0, 0.0), normal=up, friction=0.2)
    free, both = (
        compiled.storage(eliminate(assemble(beams, loads=found)))
        for found in ([], [touch(friction=0.2), floor])
    )
    assert (both.storage, both.width) == (layouts.Storage.BAND, free.width)


HARD = Given(EA=1e8, EI=1e8, rhoA=0.5)  #: of what stands still


def slide(
    ground: list[Body],
    beam: Body,
    laws: list[ContactBeam],
    speed: tuple[float, ...],
    duration: float,
) -> Trajectory:
    """The motion of a beam that lies on others, which are clamped, and slides."""
    weight = loads.Gravity((0.0, 0.0, -9.81) if len(speed) == 3 else (0.0, -9.81))
    held = [
        joints.Clamp(f"{end} of {part.name}", At(part.name, end))
        for part in ground
        for end in ("left", "right")
    ]
    out = {"left": probes.Position(At("up", "left")), "E": probes.Energy()} | {
        law.name: ContactState(law.name) for law in laws
    }
    system = assemble(
        [*ground, beam], held, [weight, *laws], outputs=out, initial={"up": Motion(velocity=speed)}
    )
    return integrate(eliminate(system), GeneralizedAlpha(1e-3, 0.8), duration, TIGHT)


def assert_slides(motion: Trajectory, names: list[str], v: float, mu: float, mass: float) -> None:
    """It stops after v^2 / (2 mu g), pressed by its weight, in which no change of cells is felt; no
    energy comes from nowhere.
    """
    found, weight = outputs(motion), 9.81 * mass
    N = np.sum([found[f"{name}_force"] for name in names], axis=0)
    assert np.ptp(found["left_x"][[0, -1]]) == pytest.approx(v**2 / (2 * mu * 9.81), rel=2e-3)
    assert_allclose(N, weight, rtol=2e-3)
    assert np.abs(np.diff(N))[5:].max() < 2e-4 * weight
    assert np.ptp(found["E_balance"]) < 1e-4 * 0.5 * mass * v**2
    assert np.ptp(found["left_x"][-50:]) < 2e-3 * np.ptp(found["left_x"])


@pytest.mark.filterwarnings("ignore:load .* overlap")
@pytest.mark.parametrize("dim", [2, 3])
def test_a_beam_slides_along_another_one(dim: int) -> None:
    """Its nodes pass from cell to cell of the other one."""
    stiffness, v, mu = 500.0, 1.0, 0.2
    high = 0.1 - 0.5 * 9.81 / (16 * stiffness)
    low = cable("low", segment(14, (-0.3, 0.0, 0.0), (2.0, 0.0, 0.0)), HARD, dim=dim)
    ends = [((x, 0.0, high) if dim == 3 else (x, high, 0.0)) for x in (0.0, 1.0)]
    up = cable("up", segment(5, *ends), Given(EA=1e6, EI=1e4, rhoA=0.5), dim=dim)
    law = ContactBeam(
        "touch", body="up", other="low", points=16, radius=0.05, stiffness=stiffness, friction=mu
    )
    assert_slides(slide([low], up, [law], (v, 0.0, 0.0)[:dim], 0.6), ["touch"], v, mu, 0.5)


@pytest.mark.filterwarnings("ignore:load .* overlap")
def test_a_beam_slides_across_rails() -> None:
    """Its closest points pass from cell to cell of the rails."""
    stiffness, v, mu = 2000.0, 1.0, 0.2
    high = 0.1 - 0.5 * 9.81 / (2 * stiffness)
    rails = [
        cable(n, segment(14, (-0.2, y, 0.0), (1.0, y, 0.0)), HARD)
        for n, y in (("port", -0.3), ("starboard", 0.3))
    ]
    up = cable("up", segment(5, (0.0, -0.5, high), (0.0, 0.5, high)), STIFF)
    laws = [
        ContactBeam(
            f"on {part.name}",
            body="up",
            other=part.name,
            radius=0.05,
            stiffness=stiffness,
            friction=mu,
        )
        for part in rails
    ]
    assert_slides(
        slide(rails, up, laws, (v, 0.0, 0.0), 0.6), [law.name for law in laws], v, mu, 0.5
    )


def test_a_cable_on_a_beam() -> None:
    """A limp cable, drawn over a quarter of a beam as thick as a drum: T2 / T1 = exp(mu phi) (Euler
    and Eytelwein).
    """
    mu, phi, radius, thin, period = 0.3, np.pi / 2, 0.1, 1e-4, 0.3
    angle, ends = np.linspace(0.0, phi, 11)[:, None], np.linspace(0.0, 0.1, 6)[1:, None]
    arc = (radius + thin) * np.hstack([np.sin(angle), -np.cos(angle)])
    points = np.concatenate([arc[0] - ends[::-1] * [1.0, 0.0], arc, arc[-1] + ends * [0.0, 1.0]])
    limp, thick = (
        Given(EA=2e4, EI=2e-5, rhoA=0.1, radius=thin),
        Given(EA=1e9, EI=1e6, rhoA=1.0, radius=radius),
    )
    bodies = [
        cable("c", polyline(np.pad(points, ((0, 0), (0, 1)))), limp),
        cable("b", segment(3, (0, 0, -0.1), (0, 0, 0.1)), thick),
    ]

    def drawn(t: np.ndarray) -> np.ndarray:
        return np.asarray(0.006 * (t / period - np.sin(2 * np.pi * t / period) / (2 * np.pi)))

    still = [joints.Clamp(end, At("b", end)) for end in ("left", "right")]
    pull = joints.DrivenPosition(
        "pull", At("c", "right"), (lambda t: 0.0 * t, drawn, lambda t: 0.0 * t)
    )
    weight = loads.PointForce(
        "weight", At("c", "left"), (-10.0, 0.0, 0.0), lambda t: np.minimum(t / 0.05, 1.0)
    )
    law = ContactBeam(
        "touch", body="c", other="b", stiffness=2e5, friction=mu, resolution=0.0, along=True
    )
    out = {"pull": probes.Reaction("pull"), "touch": ContactState("touch")}
    system = eliminate(
        assemble(
            bodies, [pull, *still], [weight, law], Rayleigh(mass=40.0, stiffness=1e-4), outputs=out
        )
    )
    found = outputs(integrate(system, GeneralizedAlpha(2e-3, 0.5), 0.22, Newton(1e-10)))
    assert found["touch_slip"][-8:].min() > 1e-3
    assert found["pull_y"][-8:].mean() == pytest.approx(10.0 * np.exp(mu * phi), rel=1e-2)
