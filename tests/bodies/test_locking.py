"""Smooth cubic lines that are slender: they bend as freely as others, to fourth order, however
stiff their axis is.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Given, cable, sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.dynamics import (
    ArcLength,
    Newton,
    follow_path,
    limit_points,
    outputs,
    solve_statics,
    vibration_modes,
)
from fmbs_skfem.shapes import line, locking
from fmbs_skfem.systems import At, assemble, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from ..models import polyline, segment

SMOOTH = {"continuity": 2}
LEFT, RIGHT = At("beam", "left"), At("beam", "right")


def bent_arc(cells: int, EA: float, force: tuple[float, float], **options: int) -> np.ndarray:
    """Displacement of the end of a quarter circle of radius 1 m, EI = 1 N m2, under a small force,
    per force [m/N].
    """
    angle = np.linspace(0.0, np.pi / 2, cells + 1)
    mesh = polyline(np.column_stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle]))
    body = cable("beam", mesh, Given(EA=EA, EI=1.0, rhoA=1.0), dim=2, **options)
    small = 1e-5
    push = loads.PointForce("push", RIGHT, (small * force[0], small * force[1]))
    system = eliminate(
        assemble(
            [body], [joints.Clamp("clamp", LEFT)], [push], outputs={"end": probes.Position(RIGHT)}
        )
    )
    found = outputs(solve_statics(system, 1, Newton(tolerance=1e-12)))
    return np.array([(found[f"end_{axis}"][-1] - found[f"end_{axis}"][0]) / small for axis in "xy"])


@pytest.mark.parametrize("EA", [1e6, 1e8])
def test_a_slender_arc_bends_to_fourth_order(EA: float) -> None:
    """Castigliano: pi/4 and -1/2 under a force along x; the Gauss rule was off by 12 % on 10 cells
    at EA = 1e8 N.
    """
    exact = bent_arc(20, EA, (1.0, 0.0), degree=5)
    assert_allclose(exact, [np.pi / 4, -0.5], atol=2e-5)
    errors = [np.abs(bent_arc(n, EA, (1.0, 0.0), **SMOOTH) - exact).max() for n in (10, 20)]
    assert errors[0] < 1e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.6)


def test_the_error_of_a_slender_arc_does_not_grow_with_its_stiffness() -> None:
    soft, stiff = (
        abs(bent_arc(10, EA, (1.0, 0.0), **SMOOTH)[0] / (np.pi / 4) - 1.0) for EA in (1e7, 1e10)
    )
    assert stiff < 1.1 * soft


def test_a_deep_arch_has_its_limit_point() -> None:
    """8.97 EI/R^2 on 48 cells, to 1.5 % on 24, where there was none: DaDeppo and Schmidt, J. Appl.
    Mech. 42 (1975) 737-742.
    """
    half = np.radians(107.5)
    for cells, tolerance in ((24, 0.015), (48, 1.5e-3)):
        angle = np.linspace(-half, half, cells + 1)
        mesh = polyline(100.0 * np.column_stack([np.sin(angle), np.cos(angle), 0.0 * angle]))
        body = cable("beam", mesh, Given(EA=1e8, EI=1e6, rhoA=1.0), dim=2, **SMOOTH)
        push = loads.PointForce("push", At("beam", 100.0 * half), (0.0, -1000.0))
        system = eliminate(
            assemble([body], [joints.Clamp("clamp", LEFT), joints.Pin("hinge", RIGHT)], [push])
        )
        path = follow_path(system, ArcLength(0.05, wanted=5))
        assert 1000.0 * path.times[limit_points(path)[0]] == pytest.approx(897.0, rel=tolerance)


def test_a_slender_smooth_bar_has_no_other_motions_than_rigid_ones() -> None:
    """Three frequencies of zero in the plane; the first axial one is pi/2 sqrt(EA/rhoA)/L."""
    body = cable("beam", segment(8), Given(EA=1e8, EI=1.0, rhoA=1.0), dim=2, **SMOOTH)
    found = vibration_modes(assemble([body]), 5).angular_frequencies
    assert found[2] < 1e-3 * found[3]
    assert found[3] == pytest.approx(4.7300407**2, rel=1e-3)
    held = [
        joints.DrivenPosition("hold", LEFT, (np.zeros_like, np.zeros_like)),
        joints.Slider("rail", RIGHT, (1.0, 0.0)),
    ]
    modes = vibration_modes(eliminate(assemble([body], held)), 18).angular_frequencies
    assert np.abs(modes / (np.pi / 2 * 1e4) - 1.0).min() < 1e-5


def test_the_rule_keeps_the_contract() -> None:
    check_system(
        assemble([cable("beam", segment(3), Given(EA=1e8, EI=1.0, rhoA=1.0), dim=2, **SMOOTH)])
    )


# ------------------------------------------------------------------------------------------------------------ the weights
@pytest.mark.parametrize("growth", [1.0, 1.3, 2.0, 5.0, 100.0])
def test_weights_are_positive_and_exact_on_quadratic_splines(growth: float) -> None:
    """Cells of lengths that differ by up to the square of `growth` beside each other, one to thirty
    of them.
    """
    random = np.random.default_rng(3)
    for cells in (1, 2, 3, 7, 30):
        ends = np.concatenate([[0.0], np.cumsum(growth ** random.uniform(-1.0, 1.0, cells))])
        space = line.uniform(ends, 3, 2)
        table = line.tabulate(space, 3)
        weights = locking.reduced_weights(space, table)
        used = weights != 0.0
        strains = line.uniform(ends, 2, 1)
        assert weights[used].min() > 0.0
        assert np.count_nonzero(used) >= strains.count
        integrals = (strains.knots[3:] - strains.knots[:-3]) / 3.0
        assert_allclose(
            line.sample(strains, table.points[used]).T @ weights[used],
            integrals,
            atol=1e-12 * ends[-1],
        )


def test_equal_cells_have_one_point_each() -> None:
    space = line.uniform(12, 3, 2)
    weights = locking.reduced_weights(space, line.tabulate(space, 3)) * 12
    assert np.count_nonzero(weights) == 16
    assert_allclose(weights[4:-4, 1], 1.0, atol=1e-3)


@pytest.mark.parametrize(
    "space",
    [
        line.uniform(4, 3, 1),
        line.uniform(4, 2, 1),
        line.uniform(4, 5, 4),
        line.Hermite(np.linspace(0.0, 1.0, 5)),
    ],
)
def test_other_lines_keep_their_gauss_rule(space: line.BSpline | line.Hermite) -> None:
    table = line.tabulate(space, 3)
    assert np.all(locking.axial_shares(space, table, 1e9) == 1.0)


def test_fine_cells_keep_their_gauss_rule() -> None:
    """EA h^2 / EI = 100 and below."""
    space = line.uniform(10, 3, 2)
    table = line.tabulate(space, 3)
    assert np.all(locking.axial_shares(space, table, 100.0) == 1.0)
    assert np.ptp(locking.axial_shares(space, table, 101.0)) > 0.0


@pytest.mark.parametrize("unit", [1.0, 1e3])
def test_what_keeps_the_gauss_rule_has_no_unit_of_length(unit: float) -> None:
    """Of a beam with torsion the part LIMIT EI / (EA h^2), with its softest EI and cells of length
    h: 0.16 here.
    """
    EI = np.array([3e-4, 2e-4, 1e-4]) * unit**2
    section = sections.BeamSection(np.diag([1.0, 0.4, 0.4, *EI]), np.diag([1.0, unit**2, unit**2]))
    cells = beam("beam", segment(4, end=(unit, 0.0, 0.0)), section).cells
    assert cells is not None
    stiffness = cells.section[0]  # zero but for that part between the points that do not lock
    assert stiffness.min() == pytest.approx(0.16, rel=1e-2)
