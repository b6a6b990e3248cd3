"""Shells: Scordelis-Lo roof, thin curved shells without membrane locking, snap-through of a hinged
roof.

Sources: `verification.statics_shells` (Scordelis-Lo roof); Sabir and Lock, Variational Methods in
Engineering, Southampton 1973, and Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, doi
10.1016/j.finel.2003.11.001 (hinged roofs: geometry and material; loads are our own).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import Newton, outputs, solve_statics
from fmbs_skfem.dynamics.equilibria.statics import solve_equilibria
from fmbs_skfem.shapes import nurbs
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification.statics_shells import ROOF_FREE, scordelis_lo

TIGHT = Newton(tolerance=1e-12)
# corners belong to two edges
pytestmark = pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")


def test_refinement_of_the_roof() -> None:
    """The deflection of the free edge converges at least with order 2 (p - 1)."""
    coarse, fine = (abs(scordelis_lo(n)[0] / ROOF_FREE - 1) for n in (4, 8))
    assert np.log2(coarse / fine) > 4


def test_thin_roof_does_not_lock() -> None:
    """R/t = 1000 in place of 100: cubics on 16 x 16 cells agree with quartics on 24 x 24 to 1 per
    mille.
    """
    assert scordelis_lo(16, 3, 0.025)[0] == pytest.approx(scordelis_lo(24, 4, 0.025)[0], rel=1e-3)


def hinged(cells: int, t: float, degree: int = 3) -> Body:
    """R = 2540, 508 x 508 with hinged straight edges, E = 3102.75, nu = 0.3; its point `centre` is
    in the middle.
    """
    shape = nurbs.surface(*nurbs.cylinder_panel(2540.0, 508.0, -0.1, 0.1, cells, cells, degree))
    return plate(
        "roof",
        replace(shape, points={"centre": nurbs.place(shape, 0.5, 0.5)}),
        t,
        Material(3102.75, 1.0, 0.3),
    )


HINGES = joints.Edge("hinges", "roof", ("xi1_min", "xi1_max"))
CENTRE = At("roof", "centre")


def rest(t: np.ndarray) -> np.ndarray:
    return 0.0 * t


def pushed(cells: int, t: float, depths: np.ndarray, degree: int = 3) -> np.ndarray:
    """Load on the centre for given deflections of it."""
    push = joints.DrivenPosition("push", CENTRE, (rest, rest, np.negative))
    system = eliminate(
        assemble([hinged(cells, t, degree)], [HINGES, push], outputs={"P": probes.Reaction("push")})
    )
    found = outputs(solve_equilibria(system, depths, TIGHT))
    side = np.abs([found["P_x"], found["P_y"]]).max()
    assert side < 1e-6 * np.abs(found["P_z"]).max()
    return -np.asarray(found["P_z"])


def loaded(cells: int, t: float, load: float, steps: int) -> np.ndarray:
    """Deflections of the centre under the load in equal steps."""
    sensed = {"centre": probes.Position(CENTRE)}
    force = loads.PointForce("P", CENTRE, (0.0, 0.0, -load))
    system = eliminate(assemble([hinged(cells, t)], [HINGES], [force], outputs=sensed))
    found = outputs(solve_statics(system, steps, TIGHT))["centre_z"]
    return np.asarray(found[0] - found)


SNAP = {  # deflection: loads of the roofs of thickness 12.7 and 6.35; figures of this package, 1 % from those of 20 x 20 cells
    4.0: (1317.30, 296.19),
    8.0: (2064.07, 471.17),
    12.0: (2173.99, 577.02),
    16.0: (1149.91, 391.50),
    20.0: (520.94, -313.29),
    24.0: (1170.49, -77.48),
    28.0: (2681.61, 403.44),
}


@pytest.mark.parametrize("column,t", [(0, 12.7), (1, 6.35)])
def test_snap_through_by_prescribed_deflection(column: int, t: float) -> None:
    """The whole path: limit load, falling branch (below zero for the thin roof), second rising
    branch.
    """
    depths = np.arange(4.0, 30.0, 4.0)
    stored = np.array([SNAP[depth][column] for depth in depths])
    found = pushed(12, t, depths, 4)
    np.testing.assert_allclose(found, stored, rtol=1e-4)
    assert found[:3].max() > found[3] > found[4] < found[5]


def test_load_control_reaches_the_limit_point() -> None:
    """Both controls give the same path below the limit load of about 2.2 kN; above it load control
    jumps to the far branch.
    """
    w = loaded(8, 12.7, 2000.0, 4)
    np.testing.assert_allclose(pushed(8, 12.7, w[1:]), [500.0, 1000.0, 1500.0, 2000.0], rtol=1e-8)
    beyond = float(loaded(8, 12.7, 2400.0, 6)[-1])
    assert beyond > 25.0
    assert pushed(8, 12.7, np.array([beyond]))[0] == pytest.approx(2400.0, rel=1e-8)


def test_times_of_equilibria_increase() -> None:
    system = eliminate(assemble([hinged(2, 12.7)], [HINGES]))
    with pytest.raises(InputError, match=r"analysis\.times: expected increasing times"):
        solve_equilibria(system, np.array([0.0, 2.0, 1.0]))
