"""Beams and cables whose section changes along the line, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import (
    Circular,
    Given,
    ISection,
    Material,
    Matrices,
    Rectangular,
    Section,
    Tapered,
    cable,
)
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import outputs, solve_statics, vibration_modes
from fmbs_skfem.scenes import reading
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures import line_stresses, probes, stresses

ROOT, TIP = At("beam", "left"), At("beam", "right")
E, NU = 210e9, 0.3
STEEL, G = Material(E, 7850.0, NU), E / (2 * (1 + NU))
D0, D1, L = 0.02, 0.01, 1.0
CONE = Tapered({0.0: Circular(D0), 1.0: Circular(D1)})


def straight(section: Section, kind: str, cells: int = 8, **more: object) -> Body:
    """A beam or cable along x, thick at its left end; y of its section along y."""
    curve = curves.Straight(np.zeros(3), np.array([L, 0.0, 0.0]), L)
    line = curves.Line(np.linspace(0.0, L, cells + 1), curve, {"left": 0.0, "right": L}, None)
    if kind == "cable":
        return cable("beam", line, section, STEEL, **more)  # type: ignore[arg-type]
    return beam("beam", line, section, STEEL, direction=np.array([0.0, 1.0, 0.0]))


def held(part: Body, *acting: loads.Load, **sensed: probes.Probe) -> dict[str, float]:
    """Outputs of the equilibrium of a body that is clamped at its left end."""
    system = assemble(
        [part],
        [joints.Clamp("root", ROOT)],
        acting,
        outputs={"tip": probes.Position(TIP), **sensed},
    )
    return {
        name: float(values[-1])
        for name, values in outputs(solve_statics(eliminate(system), 1)).items()
    }


@pytest.mark.parametrize("kind", ["beam", "cable"])
def test_a_tapered_cantilever(kind: str) -> None:
    """Of a cone 64 P L^3 / (3 pi E d1 d0^3) by bending, 4 P L / (pi k G d0 d1) by shear and 4 N L /
    (pi E d0 d1) by tension.
    """
    P, N, k = 1e-3, 1.0, (6 + 6 * NU) / (7 + 6 * NU)
    bent = 64 * P * L**3 / (3 * np.pi * E * D1 * D0**3) + (kind == "beam") * 4 * P * L / (
        np.pi * k * G * D0 * D1
    )
    found = held(straight(CONE, kind, 32), loads.PointForce("F", TIP, (0.0, 0.0, P)))
    assert_allclose(found["tip_z"], bent, rtol=2e-5)
    found = held(straight(CONE, kind, 32), loads.PointForce("F", TIP, (N, 0.0, 0.0)))
    assert_allclose(found["tip_x"] - L, 4 * N * L / (np.pi * E * D0 * D1), rtol=2e-5)


def test_a_tapered_shaft_twists() -> None:
    """32 T L / (3 pi G) (1/d1^3 - 1/d0^3) / (d0 - d1) of a cone, and its moments, strains and
    stresses at a place.
    """
    T, at = 1e-2, 0.37
    place, d = At("beam", at * L), D0 + at * (D1 - D0)
    moment = loads.Moment("M", TIP, (T, 0.0, 0.0))
    found = held(
        straight(CONE, "beam", 16),
        moment,
        turn=probes.Angle(TIP, (1.0, 0.0, 0.0)),
        at=stresses.SectionForces(place),
    )
    assert_allclose(
        found["turn"], 32 * T * L / (3 * np.pi * G) * (D1**-3 - D0**-3) / (D0 - D1), rtol=2e-5
    )
    assert_allclose(found["at_T"], T, rtol=1e-5)
    sensed = {
        "at": stresses.SectionForces(place),
        "side": line_stresses.Stress(place, point=(0.0, 0.5 * d)),
    }
    found = held(straight(CONE, "beam", 16), loads.PointForce("F", TIP, (0.0, 0.0, 1e-3)), **sensed)
    assert_allclose(found["side_normal"], -32 * 1e-3 * (1 - at) * L / (np.pi * d**3), rtol=1e-3)


@pytest.mark.parametrize("kind", ["beam", "cable"])
def test_moments_of_tapered_lines(kind: str) -> None:
    """P (L - s) at a place within a cell, to the error of the curvature there."""
    found = held(
        straight(CONE, kind, 16),
        loads.PointForce("F", TIP, (0.0, 0.0, 1e-3)),
        at=stresses.SectionForces(At("beam", 0.37 * L)),
    )
    assert_allclose(found["at_My"], -0.63e-3, rtol=5e-4)


def first(section: Section, kind: str, cells: int = 24) -> float:
    """Lowest angular frequency of a cantilever over sqrt(EI0 / (rhoA0 L^4))."""
    system = eliminate(assemble([straight(section, kind, cells)], [joints.Clamp("root", ROOT)]))
    root = section.at(0.0).of_cable(STEEL)
    return float(
        vibration_modes(system, 1).angular_frequencies[0] / np.sqrt(root.EI / root.rhoA) * L**2
    )


def test_frequencies_of_a_cone_and_a_wedge() -> None:
    """Kirchhoff 1879: 8.719 of a cone, 5.315 of a wedge that moves across its edge; from tips of 1
    and 2 thousandths.
    """
    cones = [
        first(Tapered({0.0: Circular(D1), 1.0: Circular(tip * D1)}), "cable")
        for tip in (1e-3, 2e-3)
    ]
    assert 2 * cones[0] - cones[1] == pytest.approx(8.719, abs=5e-4)
    wedges = [
        first(Tapered({0.0: Rectangular(0.05, D1), 1.0: Rectangular(0.05, tip * D1)}), "beam")
        for tip in (1e-3, 2e-3)
    ]
    assert 2 * wedges[0] - wedges[1] == pytest.approx(5.315, abs=1e-3)


def test_pictures_have_the_stiffness_of_their_place() -> None:
    """EA and EI of a cone at the samples, to round-off."""
    line = assemble([straight(CONE, "cable")]).lines[0]
    EA, EI = line.swept.sections.stiffness.T
    d = D0 + (D1 - D0) * np.linspace(0.0, 1.0, len(EA))
    assert_allclose(EA, E * np.pi / 4 * d**2, rtol=1e-12)
    assert_allclose(EI, E * np.pi / 64 * d**4, rtol=1e-10)
    assert_allclose(line.swept.sections.fibres, np.column_stack([0.0 * d + E, 0.5 * d]), rtol=1e-12)


@pytest.mark.parametrize("kind", ["beam", "cable"])
def test_mass_of_tapered_lines(kind: str) -> None:
    assert straight(CONE, kind).total_mass == pytest.approx(
        7850 * np.pi * L * (D0**2 + D0 * D1 + D1**2) / 12, rel=1e-12
    )


def test_sections_in_between() -> None:
    """Matrices and given stiffnesses are linear; walls and points of drawings, too, with one number
    of points in the contour.
    """
    one, two = (
        Matrices((9.0, 3.0, 4.0, 5.0, 6.0, 7.0), (1.0,) * 6),
        Matrices((5.0, 3.0, 4.0, 5.0, 6.0, 7.0), (3.0,) * 6),
    )
    assert Tapered({0.0: one, 1.0: two}).at(0.25) == Matrices(
        (8.0, 3.0, 4.0, 5.0, 6.0, 7.0), (1.5,) * 6
    )
    assert (
        Tapered({0.0: Given(4.0, 2.0, 1.0), 0.5: Given(2.0, 2.0, 1.0), 1.0: Given(2.0, 2.0, 2.0)})
        .at(0.25)
        .of_cable(None)
        .EA
        == 3.0
    )
    part = straight(
        Tapered({0.0: ISection(0.1, 0.2, 0.006, 0.009), 1.0: ISection(0.1, 0.1, 0.006, 0.009)}),
        "beam",
        3,
    )
    assert part.profile is not None
    stiffness, points, unit = part.profile.at(np.array([0.3]))
    here = ISection(0.1, 0.17, 0.006, 0.009).of_beam(
        STEEL, None, tuple(tuple(np.full(12, 2)) for _ in "1")
    )
    assert_allclose(np.diag(stiffness[0]), np.diag(here.stiffness), rtol=2e-5)
    assert_allclose(points[0].max(axis=0), [0.05, 0.085], rtol=1e-12)
    assert_allclose(np.abs(unit[0, 0, 4]).max(), np.abs(here.unit_stresses[0, 4]).max(), rtol=2e-5)


@pytest.mark.parametrize(
    "sections, named",
    [
        ({0.0: Circular(1.0)}, "section.sections: expected sections from the fraction 0 to 1"),
        (
            {0.0: Circular(1.0), 0.9: Circular(2.0)},
            "section.sections: expected sections from the fraction 0 to 1",
        ),
        (
            {0.0: Circular(1.0), 1.0: Rectangular(2.0, 1.0)},
            "section.sections: expected sections of one shape",
        ),
        ({0.0: CONE, 1.0: CONE}, "section.sections: expected sections that are even"),
    ],
)
def test_what_is_no_taper(sections: dict[float, Section], named: str) -> None:
    with pytest.raises(InputError, match=named):
        Tapered(sections)


SCENE = """
schema: 1
parameters: {{d: 20 mm}}
bodies:
  arm:
    type: {type}
    mesh: none.msh
    section: {{shape: tapered, sections: {sections}}}
    {more}
analysis: {{type: dynamic, duration: 1 s, step: 1 ms}}
"""
BAR, FLAT = "{shape: circular, diameter: 1 m}", "{shape: rectangular, width: 2 m, height: 1 m}"
MATERIAL = "material: {young_modulus: 210 GPa, density: 7850}"


def test_tapers_of_a_scene() -> None:
    sections = "{0: {shape: circular, diameter: d}, 1: {shape: circular, diameter: d / 2}}"
    for kind in ("beam", "cable"):
        scene = reading.loads(SCENE.format(type=kind, sections=sections, more=MATERIAL))
        assert scene.bodies["arm"].section == CONE  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "kind, sections, more, named",
    [
        ("beam", f"{{0: {BAR}, 2: {BAR}}}", MATERIAL, "sections.2: expected"),
        ("beam", f"{{root: {BAR}}}", MATERIAL, "sections.root: expected"),
        (
            "beam",
            f"{{0: {{shape: circular, dia: 1 m}}, 1: {BAR}}}",
            MATERIAL,
            "sections.0.dia: expected one of the keys diameter",
        ),
        ("beam", "[1, 2]", MATERIAL, "sections: expected a mapping of values at fractions"),
        ("beam", f"{{0: {BAR}, 1: {BAR}}}", "", "material: expected a material"),
        (
            "cable",
            f"{{0: {FLAT}, 1: {FLAT}}}",
            MATERIAL,
            "expected a section of the same bending stiffness",
        ),
    ],
)
def test_tapers_that_are_refused(kind: str, sections: str, more: str, named: str) -> None:
    with pytest.raises(InputError, match=named):
        reading.loads(SCENE.format(type=kind, sections=sections, more=more))
