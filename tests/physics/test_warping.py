"""Torsion of sections that warp, against Vlasov's theory and that of strips under tension."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import dynamics, scenes, studies
from fmbs_skfem.bodies import Body, Circular, Material, Rectangular, Section
from fmbs_skfem.bodies.beams import saint_venant, section_shapes
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.beams.drawn_sections import ISection, PolygonSection
from fmbs_skfem.bodies.beams.matrices import Matrices
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics.near_state.buckling import buckling
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, assemble, check_system, eliminate, joints, loads
from fmbs_skfem.systems.measures import line_stresses, probes, stresses

STEEL = Material(210e9, 7850.0, 0.3)
PROFILE = ISection(0.1, 0.2, 0.0056, 0.0085)
STRIP = Rectangular(0.05, 0.001)
X = (1.0, 0.0, 0.0)
HOLE = ((0.003, 0.003), (0.057, 0.003), (0.057, 0.037), (0.003, 0.037))
LEFT, RIGHT = At("b", "left"), At("b", "right")


def bar(
    section: Section,
    length: float,
    cells: int = 8,
    name: str = "b",
    start: float = 0.0,
    twist: float = 0.0,
) -> Body:
    line = segment(cells, (start, 0, 0), (start + length, 0, 0))
    return beam(name, line, section, STEEL, direction=(0.0, 1.0, 0.0), twist=twist, warping=True)


def constants(body: Body) -> tuple[float, float, float]:
    """GJ, E I_w, and 1/k of Vlasov."""
    assert body.profile is not None
    C = body.profile.stiffness[0]
    return C[3, 3], C[6, 6], float(np.sqrt(C[6, 6] / C[3, 3]))


def static(
    bodies: list[Body],
    held: list[joints.Joint],
    *acting: loads.Load,
    steps: int = 1,
    **sensed: probes.Probe,
) -> dict[str, float]:
    system = eliminate(assemble(bodies, held, acting, outputs=sensed))
    found = dynamics.outputs(dynamics.solve_statics(system, steps))
    return {name: float(values[-1]) for name, values in found.items()}


def test_warping_constants_of_thin_walls() -> None:
    """b^3 t h^2 / 24 of an I, b^3 t^3 / 144 of a strip, and of a channel by its middle lines."""
    shapes = (
        section_shapes.i_shape(0.1, 0.2, 0.0056, 0.0085),
        section_shapes.rectangle(0.1, 0.001),
    )
    I, strip = (saint_venant.solve(one).over.fibres for one in shapes)
    assert_allclose(I[3, 3], 0.1**3 * 0.0085 * (0.2 - 0.0085) ** 2 / 24.0, rtol=2e-3)
    assert_allclose(strip[3, 3], 0.1**3 * 0.001**3 / 144.0, rtol=1e-3)
    assert np.abs(I[3, :3]).max() < 1e-9 * I[3, 3] ** 0.5
    b, h, t, w = 0.0475, 0.092, 0.008, 0.005
    channel = saint_venant.solve(section_shapes.c_shape(0.05, 0.1, w, t)).over.fibres[3, 3]
    exact = t * b**3 * h**2 / 12.0 * (3 * b * t + 2 * h * w) / (6 * b * t + h * w)
    assert_allclose(channel, exact, rtol=0.04)


def test_a_cantilever_whose_warping_is_held() -> None:
    """T/GJ (L - tanh(kL)/k), B = -T tanh(kL)/k at the clamp, and the stress E omega kappa_1'."""
    body = bar(PROFILE, 2.0)
    GJ, EIw, reach = constants(body)
    T = 100.0
    sensed: dict[str, probes.Probe] = {
        "turn": probes.Angle(RIGHT, X),
        "root": stresses.SectionForces(LEFT),
        "mid": stresses.SectionForces(At("b", 1.0)),
        "all": line_stresses.HighestStress("b"),
    }
    torque = loads.Moment("T", RIGHT, (T, 0.0, 0.0))
    held = static([body], [joints.Clamp("c", LEFT)], torque, **sensed)
    fall = np.tanh(2.0 / reach) * reach
    assert_allclose(held["turn"], T / GJ * (2.0 - fall), rtol=5e-4)
    assert_allclose(held["root_B"], -T * fall, rtol=5e-4)
    assert_allclose(held["mid_T"], T, rtol=5e-3)
    # omega of the tips of the flanges is b h / 4
    assert_allclose(held["all_max"], T * fall / EIw * 210e9 * 0.1 * 0.1915 / 4.0, rtol=0.06)
    free = static([body], [joints.Clamp("c", LEFT, warping="free")], torque, **sensed)
    assert_allclose(free["turn"], T * 2.0 / GJ, rtol=1e-3)
    assert abs(free["root_B"]) < 1e-6 * T * fall


def test_straight_welds_pass_warping_on() -> None:
    """Two halves turn as the whole does; a weld that leaves it free does not."""
    T = loads.Moment("T", At("c", "right"), (50.0, 0.0, 0.0))
    whole = static(
        [bar(PROFILE, 2.0, 16)],
        [joints.Clamp("o", LEFT)],
        loads.Moment("T", RIGHT, (50.0, 0.0, 0.0)),
        a=probes.Angle(RIGHT, X),
    )
    halves = [bar(PROFILE, 1.0), bar(PROFILE, 1.0, name="c", start=1.0)]
    turns = {}
    for warping in ("held", "free"):
        weld = joints.Weld("w", RIGHT, At("c", "left"), warping=warping)  # type: ignore[arg-type]
        turns[warping] = static(
            halves, [joints.Clamp("o", LEFT), weld], T, a=probes.Angle(At("c", "right"), X)
        )["a"]
    assert_allclose(turns["held"], whole["a"], rtol=1e-4)
    assert turns["free"] > 1.0001 * whole["a"]


def test_what_a_weld_or_a_cell_cannot_pass_on() -> None:
    """A section that is turned, or another one, holds both; a tube's warping dies away in a cell."""
    turned = beam(
        "c", segment(4, (1, 0, 0), (2, 0, 0)), PROFILE, STEEL, direction=(0, 0, 1.0), warping=True
    )
    weld = joints.Weld("w", RIGHT, At("c", "left"))
    with pytest.warns(Notice, match="in line, but not of one section"):
        assemble([bar(PROFILE, 1.0), turned], [weld])
    with pytest.warns(
        Notice, match="dies away within .* delete .warping. where a section is closed"
    ):
        bar(
            PolygonSection(
                ((0, 0), (0.06, 0), (0.06, 0.04), (0, 0.04)),
                (HOLE,),
            ),
            1.0,
        )


def test_a_clamp_in_a_band_and_its_reaction() -> None:
    """Two coordinates of a cell that are one unknown by the clamp: both their entries count."""
    sensed: dict[str, probes.Probe] = {"r": probes.Reaction("c")}
    torque = loads.Moment("T", RIGHT, (50.0, 0.0, 0.0))
    check_system(eliminate(assemble([bar(PROFILE, 3.0, 20)], [joints.Clamp("c", LEFT)])))
    found = static([bar(PROFILE, 3.0, 20)], [joints.Clamp("c", LEFT)], torque, **sensed)
    assert_allclose(found["r_mx"], -50.0, rtol=1e-9)
    assert abs(found["r_x"]) < 1e-6


def test_lateral_buckling_of_a_beam_in_forks() -> None:
    """pi/L sqrt(EI_y GJ (1 + pi^2 E I_w / (G J L^2))), of moments at its ends."""
    body = bar(ISection(0.1, 0.3, 0.007, 0.011), 3.0)
    assert body.profile is not None
    EI = body.profile.stiffness[0, 5, 5]
    GJ, EIw, _ = constants(body)
    held: list[joints.Joint] = [joints.Pin("l", LEFT), joints.Slider("r", RIGHT, X)]
    held += [
        joints.DrivenAngle(f"fork {at}", at, lambda t: 0.0 * t, axis=X) for at in (LEFT, RIGHT)
    ]
    pair = [loads.Moment("l", LEFT, (0, 1e4, 0)), loads.Moment("r", RIGHT, (0, -1e4, 0))]
    exact = np.pi / 3.0 * np.sqrt(EI * GJ * (1.0 + np.pi**2 * EIw / (GJ * 9.0)))
    found = buckling(eliminate(assemble([body], held, pair)), 1)
    assert_allclose(1e4 * abs(found.factors[0]), exact, rtol=1e-5)


@pytest.mark.parametrize("twist", [0.0, 0.2])
def test_tension_stiffens_a_strip_and_untwists_it(twist: float) -> None:
    """T = (GJ + N I_p/A) kappa, and N I_p/A twist / (GJ + N I_p/A + E (I_pp - I_p^2/A) twist^2)."""
    body = bar(STRIP, 1.0, 12, twist=twist)
    GJ, _, _ = constants(body)
    area, polar = 5e-5, (0.05**3 * 0.001 + 0.05 * 0.001**3) / 12.0
    N = 2000.0 if twist == 0.0 else 20.0
    acting: list[loads.Load] = [loads.PointForce("N", RIGHT, (N, 0.0, 0.0))]
    if twist == 0.0:
        acting.append(loads.Moment("T", RIGHT, (0.01, 0.0, 0.0)))
    clamp = joints.Clamp("c", LEFT, warping="free")
    found = static([body], [clamp], *acting, steps=2, a=probes.Angle(RIGHT, X))["a"]
    stiff = GJ + N * polar / area
    if twist == 0.0:
        return assert_allclose(found, 0.01 / stiff, rtol=1e-4)
    assert body.profile is not None
    wagner = 4.0 * body.profile.stiffness[0, 7, 7] - 210e9 * polar**2 / area
    exact = -N * polar / area * twist / (stiff + wagner * twist**2)
    assert_allclose(found, exact, rtol=2e-3)


def test_it_moves_and_is_reduced_as_all_beams(tmp_path: Path) -> None:
    """A channel that is let go swings with the energy it had; its reduced model follows it."""
    path = tmp_path / "channel.yaml"
    path.write_text(
        """\
schema: 1
name: channel
bodies:
  b:
    type: beam
    line: {start: [0, 0, 0], end: [1, 0, 0]}
    cells: 4
    section: {shape: c_section, width: 50 mm, height: 100 mm, web: 3 mm, flange: 3 mm}
    material: steel
    direction: [0, 1, 0]
    warping: true
joints: {hold: {type: clamp, at: b.left}}
loads: {F: {type: point_force, at: b.right, force: [0, 0, 100], history: "where(t < 5e-3, 1, 0)"}}
analysis: {type: dynamic, duration: 20 ms, step: 0.1 ms, rho_inf: 1}
outputs:
  tip: {type: displacement, at: b.right}
  turn: {type: angle, at: b.right, axis: [1, 0, 0]}
  E: {type: energy}
  root: {type: section_forces, at: b.left}
reduction: {snapshots: 0.2 ms, tolerance: 1e-13, hyper_reduction: {sample: none}}
""",
        encoding="utf-8",
    )
    full = studies.run(path).outputs
    assert np.ptp(full["turn"]) > 1e-4  # the force at the centroid turns it about the shear centre
    after = full["E_balance"][60:]
    assert np.ptp(after) < 1e-3 * np.abs(full["E_strain"]).max()
    small = dynamics.outputs(studies.reduce(path, out=tmp_path / "channel.h5").reduced)
    for name in ("tip_z", "turn", "root_B"):
        assert np.abs(small[name] - full[name]).max() < 1e-2 * np.ptp(full[name])


def test_what_does_not_warp() -> None:
    with pytest.raises(InputError, match="one that warps"):
        bar(Circular(0.02), 1.0)
    text = """\
schema: 1
dimension: 2
bodies:
  b:
    type: beam
    line: {start: [0, 0], end: [1, 0]}
    section: {shape: rectangular, width: 10 mm, height: 20 mm}
    material: steel
    warping: true
analysis: {type: static}
"""
    with pytest.raises(InputError, match=r"warping: expected none, got warping in the plane"):
        scenes.loads(text)
    given = Matrices((1e6, 1e6, 1e6, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 0.1, 0.1, 0.1))
    with pytest.raises(InputError, match="a contour, for `warping`, got matrices alone"):
        bar(given, 1.0)
