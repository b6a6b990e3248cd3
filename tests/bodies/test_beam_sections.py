"""Sections that are drawn or given by matrices: what beams and cables take of them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import (
    BoxSection,
    Circular,
    CSection,
    Hollow,
    ISection,
    LSection,
    Material,
    Matrices,
    PolygonSection,
    Rectangular,
    Section,
    TSection,
    Tube,
    ZSection,
)
from fmbs_skfem.bodies.beams import section_constants, section_shapes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import reading

STEEL = Material(210e9, 7850.0, 0.3)
BOX = PolygonSection(
    ((0, 0), (0.04, 0), (0.04, 0.06), (0, 0.06)),
    (((0.002, 0.002), (0.038, 0.002), (0.038, 0.058), (0.002, 0.058)),),
)
DRAWN = [
    Tube(0.03, 0.002),
    ISection(0.1, 0.2, 0.006, 0.009),
    CSection(0.05, 0.1, 0.005, 0.008),
    LSection(0.04, 0.06, 0.005, 0.004),
    BOX,
    TSection(0.06, 0.08, 0.006, 0.008),
    ZSection(0.06, 0.12, 0.005, 0.006),
    BoxSection(0.06, 0.1, 0.004, 0.006),
    Hollow(0.06, 0.04, 0.003, 0.006),
]


@pytest.mark.parametrize("section", DRAWN, ids=lambda one: one.word)
def test_moments_are_those_of_the_mesh(section: Section) -> None:
    """Area, centroid and second moments by Green's theorem, and by quadrature on the mesh of
    `saint_venant`.
    """
    outline = section.outline()
    assert outline is not None
    area, centroid, inertia = section_shapes.moments(outline)
    found = section_constants.constants(outline, 0.3, origin=(0.0, 0.0))
    assert_allclose([area, *centroid], [found.area, *found.centroid], rtol=1e-10, atol=1e-12)
    assert_allclose(inertia, found.inertia, rtol=1e-9, atol=1e-9 * inertia.max())


def test_planar_cables_bend_about_the_y_axis() -> None:
    """Steel tables by hand: an I of two flanges and a web, the box of two rectangles, the tube of
    two circles.
    """
    web, flange = 0.006 * 0.182**3 / 12, 2 * (0.1 * 0.009**3 / 12 + 0.1 * 0.009 * 0.0955**2)
    assert (
        pytest.approx(210e9 * (web + flange), rel=1e-12)
        == ISection(0.1, 0.2, 0.006, 0.009).of_cable(STEEL).EI
    )
    box = BOX.of_cable(STEEL)
    assert_allclose(
        [box.EI / 210e9, box.radius], [(0.04 * 0.06**3 - 0.036 * 0.056**3) / 12, 0.03], rtol=1e-12
    )
    tube = Tube(0.03, 0.002).of_cable(STEEL)
    exact = [math.pi / 64 * (0.03**4 - 0.026**4), math.pi / 4 * (0.03**2 - 0.026**2), 0.015]
    assert_allclose([tube.EI / 210e9, tube.EA / 210e9, tube.radius], exact, rtol=1e-12)
    assert [one.bends_alike for one in DRAWN] == [True] + 8 * [False]
    assert Hollow(0.05, 0.05, 0.003, 0.006).bends_alike
    hexagon = np.column_stack(
        [np.cos(np.arange(6) * math.pi / 3), np.sin(np.arange(6) * math.pi / 3)]
    )
    assert PolygonSection(tuple(map(tuple, hexagon.tolist()))).bends_alike


def test_shapes_of_walls_are_sums_of_rectangles() -> None:
    """Centroid and second moments by Steiner's theorem, J of a thin box by Bredt's formula, and round
    corners by (4 - pi) r^2; arcs of 18 degrees have 1.6 % less than that.
    """
    _, (y, z), inertia = section_shapes.moments(TSection(0.06, 0.08, 0.006, 0.008).outline())
    web, flange = 0.006 * 0.072, 0.06 * 0.008
    foot = (web * 0.036 + flange * 0.076) / (web + flange)
    strong = 0.006 * 0.072**3 / 12 + web * (foot - 0.036) ** 2
    strong += 0.06 * 0.008**3 / 12 + flange * (0.076 - foot) ** 2
    weak = (0.072 * 0.006**3 + 0.008 * 0.06**3) / 12
    assert_allclose([z, inertia[1, 1], inertia[0, 0]], [foot, strong, weak], rtol=1e-12)
    assert [y, inertia[0, 1]] == pytest.approx([0.0, 0.0], abs=1e-15)

    area, middle, inertia = section_shapes.moments(ZSection(0.06, 0.12, 0.005, 0.006).outline())
    # flanges without the web are 0.055 long, their middles at (0.03, 0.057) and opposite
    mixed = 2.0 * 0.055 * 0.006 * 0.03 * 0.057
    assert_allclose([area, inertia[0, 1]], [0.12 * 0.005 + 2 * 0.055 * 0.006, mixed], rtol=1e-12)
    assert_allclose(middle, 0.0, atol=1e-15)

    box = section_constants.constants(BoxSection(0.06, 0.1, 0.001, 0.002).outline(), 0.3)
    outside, inside = 0.06 * 0.1**3, 0.058 * 0.096**3
    assert pytest.approx((outside - inside) / 12, rel=1e-12) == box.Iyy
    bredt = 4.0 * (0.059 * 0.098) ** 2 / (2 * 0.098 / 0.001 + 2 * 0.059 / 0.002)
    assert box.torsion == pytest.approx(bredt, rel=0.01)

    sharp, _, _ = section_shapes.moments(Hollow(0.06, 0.04, 0.003).outline())
    assert sharp == pytest.approx(0.06 * 0.04 - 0.054 * 0.034, rel=1e-12)
    round_one, _, _ = section_shapes.moments(Hollow(0.06, 0.04, 0.003, 0.006).outline())
    cut = (4.0 - math.pi) * (0.006**2 - 0.003**2)
    assert sharp - round_one == pytest.approx(cut, rel=0.07)


def test_offsets_move_the_line() -> None:
    """Through the shear centre forces do not twist, through the centroid they do not bend; a point
    is one of the drawing.
    """
    section = CSection(0.05, 0.1, 0.005, 0.008)
    about = {
        offset: section.of_beam(STEEL, offset)
        for offset in ("centroid", "shear_centre", (0.0, 0.0))
    }
    centroid, shear, back = (np.linalg.inv(one.stiffness) for one in about.values())
    assert_allclose(centroid[0, 4:], 0.0, atol=1e-9 * abs(back[0, 5]))
    assert_allclose(shear[1:3, 3], 0.0, atol=1e-9 * abs(back[2, 3]))
    area, (y, z), _ = section_shapes.moments(section.outline())
    assert_allclose(
        about[0.0, 0.0].mass[0], 7850.0 * area * np.array([1.0, y, z]), rtol=1e-9, atol=1e-9
    )
    assert_allclose(about["centroid"].mass[0, 1:], 0.0, atol=1e-12)
    assert section.of_beam(STEEL).stiffness == pytest.approx(about["centroid"].stiffness)


def test_matrices_of_a_drawn_section_are_that_section() -> None:
    """Moved to another line, stiffness and mass as matrices are what the drawing gives there."""
    section, at = LSection(0.04, 0.06, 0.005, 0.004), (0.012, -0.03)
    corner, there = section.of_beam(STEEL, (0.0, 0.0)), section.of_beam(STEEL, at)
    m, y, z = corner.mass[0]
    Iz, Iyz, Iy = corner.mass[1, 1], corner.mass[1, 2], corner.mass[2, 2]
    # momentum of v + omega x c, and angular momentum of a plane section with the axes along the
    # line first
    whole = np.zeros((6, 6))
    whole[:3, :3] = m * np.eye(3)
    whole[3:, :3] = [[0.0, -z, y], [z, 0.0, 0.0], [-y, 0.0, 0.0]]
    whole[:3, 3:] = whole[3:, :3].T
    whole[3:, 3:] = [[Iy + Iz, 0.0, 0.0], [0.0, Iy, -Iyz], [0.0, -Iyz, Iz]]
    for mass in (corner.mass, whole):
        given = Matrices(tuple(map(tuple, corner.stiffness)), tuple(map(tuple, mass)))
        found = given.of_beam(None, at)
        assert_allclose(
            found.stiffness, there.stiffness, rtol=1e-9, atol=1e-9 * there.stiffness.max()
        )
        places = [0, 2, 3] if len(found.mass) == 4 else [0, 1, 2]
        assert_allclose(found.mass[np.ix_(places, places)], there.mass, rtol=1e-9, atol=1e-12)


def test_diagonals_are_matrices() -> None:
    """rhoA and the inertia about x, y, z: J_xx below J_yy + J_zz has a part along the beam."""
    found = Matrices((9.0, 3.0, 4.0, 5.0, 6.0, 7.0), (2.0, 2.0, 2.0, 10.0, 10.0, 10.0)).of_beam(
        None
    )
    assert_allclose(found.stiffness, np.diag([9.0, 3.0, 4.0, 5.0, 6.0, 7.0]))
    assert_allclose(found.mass, np.diag([2.0, 5.0, 5.0, 5.0]))
    flat = Matrices((9.0, 3.0, 4.0, 5.0, 6.0, 7.0), (2.0, 2.0, 2.0, 3.0, 1.0, 2.0)).of_beam(None)
    assert_allclose(flat.mass, np.diag([2.0, 0.0, 2.0, 1.0]))


STIFF = (9.0, 3.0, 4.0, 5.0, 6.0, 7.0)
LOOSE = np.eye(6) - np.ones((6, 6)) / 3


@pytest.mark.parametrize(
    "make, named",
    [
        (
            lambda: Matrices((9.0, 3.0, 4.0, 5.0, 6.0, 0.0), (1.0,) * 6),
            r"section\.stiffness: expected a symmetric 6 x 6 matrix",
        ),
        (
            lambda: Matrices(tuple(map(tuple, LOOSE)), (1.0,) * 6),
            r"section\.stiffness: expected a symmetric 6 x 6 matrix that is pos",
        ),
        (
            lambda: Matrices(STIFF[:5], (1.0,) * 6),
            r"section\.stiffness: expected 6 rows of 6 or the 6 of the diagonal, got shape",
        ),
        (
            lambda: Matrices(STIFF, (1.0, 1.0, 2.0, 1.0, 1.0, 1.0)),
            r"section\.mass: expected m in the first three of the diagonal",
        ),
        (
            lambda: Matrices(STIFF, (1.0, 1.0, 1.0, 3.0, 1.0, 1.0)),
            r"section\.mass: expected J_xx up to J_yy \+ J_zz = 2 kg m",
        ),
        (lambda: Matrices(STIFF, (0.0,) * 6), r"section\.mass: .* a positive mass first"),
        (
            lambda: Matrices(STIFF, ((1.0, 2.0, 0.0), (2.0, 1.0, 0.0), (0.0, 0.0, 0.0))),
            r"section\.mass: .* without negative",
        ),
        (
            lambda: Matrices(STIFF, (1.0,) * 6).of_beam(None, "centroid"),
            r"offset: expected a point \[y, z\]",
        ),
        (
            lambda: Matrices(STIFF, (1.0,) * 6).of_cable(None),
            r"section: expected EA, EI and rhoA of a cable",
        ),
        (lambda: Tube(0.02, 0.02), r"section\.wall"),
        (
            lambda: PolygonSection(((0.0, 0.0), (1.0, 0.0))),
            r"section\.points: expected three or more points",
        ),
    ],
)
def test_bad_values_are_named(make: Callable[[], object], named: str) -> None:
    with pytest.raises(InputError, match=named):
        make()


SCENE = """
schema: 1
bodies:
  arm:
    type: {type}
    mesh: none.msh
    section: {section}
    material: {{young_modulus: 210 GPa, density: 7850}}
analysis: {{type: dynamic, duration: 1 s, step: 1 ms}}
"""


def read(section: str, kind: str = "beam") -> Section:
    found: Section = reading.loads(SCENE.format(section=section, type=kind)).bodies["arm"].section  # type: ignore[attr-defined]
    return found


def test_sections_of_a_scene() -> None:
    assert read("{shape: tube, diameter: 30 mm, wall: 2 mm}", "cable") == Tube(0.03, 0.002)
    assert read(
        "{shape: i_section, width: 10 cm, height: 20 cm, web: 6 mm, flange: 9 mm}"
    ) == ISection(0.1, 0.2, 0.006, 0.009)
    points, hole = (
        "[[0, 0], [4 cm, 0], [4 cm, 6 cm], [0, 6 cm]]",
        "[[2 mm, 1 mm], [38 mm, 1 mm], [3 mm, 5 mm]]",
    )
    found = read(f"{{shape: polygon, points: {points}, holes: [{hole}]}}")
    assert isinstance(found, PolygonSection)
    assert found.holes == (((0.002, 0.001), (0.038, 0.001), (0.003, 0.005)),)


@pytest.mark.parametrize(
    "section, named",
    [
        ("{shape: pipe, diameter: 3 cm, wall: 2 mm}", "did you mean 'tube'"),
        ("{shape: I, width: 3 cm}", "did you mean 'i_section'"),
        ("{shape: H, width: 3 cm}", "did you mean 'i_section'"),
        ("{shape: i_beam, width: 3 cm}", "did you mean 'i_section'"),
        ("{shape: L, width: 3 cm}", "did you mean 'l_section'"),
        ("{shape: C, width: 3 cm}", "did you mean 'c_section'"),
        ("{shape: channel, width: 3 cm}", "did you mean 'c_section'"),
        ("{shape: U, width: 3 cm}", "did you mean 'c_section'"),
        ("{shape: tee, width: 3 cm}", "did you mean 't_section'"),
        ("{shape: rhs, width: 3 cm}", "did you mean 'hollow'"),
        (
            "{shape: box, width: 3 cm, height: 9 cm, web: 15 mm, flange: 1 mm}",
            r"section.web: expected less than half the width, 0.015 m, got 0.015 m; take thinner",
        ),
        (
            "{shape: hollow, width: 3 cm, height: 1 cm, wall: 6 mm}",
            "section.wall: expected less than half the height, 0.005 m, got 0.006 m",
        ),
        (
            "{shape: hollow, width: 3 cm, height: 1 cm, wall: 1 mm, radius: 5 mm}",
            "section.radius: expected radii of corners below 0.005 m.* got 0.005 m; take a smaller",
        ),
        (
            "{shape: hollow, width: 3 cm, height: 1 cm, wall: 1 mm, radius: -1 mm}",
            r"section.radius: expected a length \[m\] >= 0, got '-1 mm'",
        ),
        (
            "{shape: t_section, width: -3 cm, height: 9 cm, web: 1 mm, flange: 1 mm}",
            r"section.width: expected a length \[m\] > 0, got '-3 cm'",
        ),
        (
            "{shape: z_section, width: 3 cm, height: 1 cm, web: 30 mm, flange: 1 mm}",
            "section.web: expected less than the width, 0.03 m, got 0.03 m",
        ),
        ("{shape: round, diameter: 3 cm}", "did you mean 'circular'"),
        (
            "{shape: c_section, width: 3 cm, height: 1 cm, web: 1 mm, flange: 5 mm}",
            "arm.section: .*flange: expected less than half the height",
        ),
        (
            "{shape: given, EA: 1 kN, EI: 1, rhoA: 1}",
            r"section: expected a section whose shape is known, or matrices",
        ),
        (
            "{shape: matrices, stiffness: [1 N, 1 N, 1 N, 1, 1], mass: [1, 1, 1, 0, 0, 0]}",
            "stiffness: expected 6 rows of 6.*list of 5",
        ),
        (
            "{shape: matrices, stiffness: [1 m, 1, 1, 1, 1, 1], mass: [1, 1, 1, 0, 0, 0]}",
            r"stiffness: expected a force \[N\], got '1 m'",
        ),
        (
            "{shape: polygon, points: [[0, 0], [1 cm], [0, 1 cm]]}",
            r"points\[1\]: expected a point \[y, z\]",
        ),
    ],
)
def test_words_that_lead_to_sections(section: str, named: str) -> None:
    with pytest.raises(InputError, match=named):
        read(section)


def test_cables_have_no_matrices() -> None:
    with pytest.raises(
        InputError,
        match=r"section: expected EA, EI and rhoA \(shape: given\), got one that is matrices",
    ):
        read("{shape: matrices, stiffness: [1, 1, 1, 1, 1, 1], mass: [1, 1, 1, 0, 0, 0]}", "cable")
    with pytest.raises(InputError, match="expected a section of the same bending stiffness"):
        read("{shape: l_section, width: 3 cm, height: 4 cm, web: 1 mm, flange: 1 mm}", "cable")
    assert read("{shape: circular, diameter: 1 cm}") == Circular(0.01)
    assert read("{shape: rectangular, width: 1 cm, height: 2 cm}") == Rectangular(0.01, 0.02)
