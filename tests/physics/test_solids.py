"""Solids against published and exact numbers.

R. H. MacNeal, R. L. Harder, Finite Elem. Anal. Des. 1 (1985) 3-20, doi:10.1016/0168-874X(85)90003-4,
with the values of converged solids where those of the paper are of beams; NAFEMS, Selected benchmarks
for natural frequency analysis (1987), test 52, for this mesh of bricks (code_aster v2.03.502);
NAFEMS, The standard NAFEMS benchmarks, LE10.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import dynamics
from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.sections import Rectangular
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.shapes.solids.solid import Solid
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.measures.stresses import StressTensor

from ..solids import HEXA, TETRA, bar, box

SMALL = 1e-4  #: of a unit load: large rotations are none then


def tip(mesh: Solid, material: Material, load: loads.Load, held: str = "left") -> np.ndarray:
    """Displacement (3,) of the middle of the end of a cantilever, and its rotation (3,), over the
    load.
    """
    body = bar(mesh, "", "right", material)
    system = eliminate(assemble([body], [joints.HeldFace("hold", "bar", (held,))], [load]))
    last = dynamics.solve_statics(system, 1).x[-1]
    assert body.axes is not None
    rows = body.axes.toarray()
    u = (system.lift(last) - system.lift(system.x0)).reshape(-1, 3)
    position, *axes = rows @ u
    spin = 0.5 * np.array(
        [axes[1][2] - axes[2][1], axes[2][0] - axes[0][2], axes[0][1] - axes[1][0]]
    )
    return np.concatenate([position, spin]) / SMALL


def force(*unit: float) -> loads.Load:
    return loads.PointForce("push", At("bar", "right"), tuple(SMALL * x for x in unit))


TWIST = loads.Torque("push", At("bar", "right"), (SMALL, 0.0, 0.0))


@pytest.mark.parametrize(
    "load, component, wanted",
    [
        (force(1.0, 0.0, 0.0), 0, 3.0e-5),
        (force(0.0, 1.0, 0.0), 1, 0.1081),
        (force(0.0, 0.0, 1.0), 2, 0.4321),
        (TWIST, 3, 0.0341),
    ],
)
def test_straight_cantilever(load: loads.Load, component: int, wanted: float) -> None:
    mesh = box((12, 4, 2), (6.0, 0.2, 0.1), HEXA)
    found = tip(mesh, Material(1e7, 1.0, 0.3), load)
    assert found[component] == pytest.approx(wanted, rel=0.02)


def ring(x: np.ndarray) -> np.ndarray:
    a, r = x[:, 0], 4.32 - x[:, 1]
    return np.column_stack([r * np.cos(a), r * np.sin(a), x[:, 2]])


@pytest.mark.parametrize("component, wanted", [(1, 0.0885), (2, 0.497)])
def test_curved_cantilever(component: int, wanted: float) -> None:
    mesh = box((24, 3, 2), (0.5 * np.pi, 0.2, 0.1), HEXA, shape=ring)
    found = tip(mesh, Material(1e7, 1.0, 0.25), force(*np.eye(3)[component]))
    assert found[component] == pytest.approx(wanted, rel=0.02)


def twisted(x: np.ndarray) -> np.ndarray:
    a, y, z = x[:, 0] / 12.0 * 0.5 * np.pi, x[:, 1] - 0.55, x[:, 2] - 0.16
    return np.column_stack([x[:, 0], y * np.cos(a) - z * np.sin(a), y * np.sin(a) + z * np.cos(a)])


@pytest.mark.parametrize("kind, cells", [(HEXA, (12, 2, 1)), (TETRA, (24, 2, 1))])
@pytest.mark.parametrize("component, wanted", [(1, 0.001754), (2, 0.005424)])
def test_twisted_cantilever(
    kind: type, cells: tuple[int, int, int], component: int, wanted: float
) -> None:
    mesh = box(cells, (12.0, 1.1, 0.32), kind, shape=twisted)
    found = tip(mesh, Material(29e6, 1.0, 0.22), force(*np.eye(3)[component]))
    assert found[component] == pytest.approx(wanted, rel=0.02)


def test_a_thick_plate_on_its_lower_edges_vibrates() -> None:
    """FV52: within 0.3 %."""
    mesh = box((4, 4, 1), (10.0, 10.0, 1.0), HEXA)
    x, y, z = mesh.reference.T
    edge = (z == 0.0) & ((np.abs(x - 5.0) == 5.0) | (np.abs(y - 5.0) == 5.0))
    mesh = replace(mesh, sets={"edge": np.flatnonzero(edge)})
    body = bar(mesh, material=Material(200e9, 8000.0, 0.3))
    held = [joints.HeldFace("hold", "bar", ("edge",), "z")]
    modes = dynamics.vibration_modes(eliminate(assemble([body], held)), 10)
    found = modes.angular_frequencies / (2.0 * np.pi)
    assert_allclose(found[:3], 0.0, atol=1e-3)
    wanted = [44.762, 110.52, 110.52, 169.08, 193.93, 206.64, 206.64]
    assert_allclose(found[3:], wanted, rtol=3e-3)


def ellipse(x: np.ndarray) -> np.ndarray:
    a, t = 0.5 * np.pi * x[:, 0], 1.0 - x[:, 1]
    inner = np.column_stack([2.0 * np.cos(a), np.sin(a)])
    outer = np.column_stack([3.25 * np.cos(a), 2.75 * np.sin(a)])
    return np.column_stack([(1.0 - t)[:, None] * inner + t[:, None] * outer, x[:, 2]])


def test_an_elliptic_plate_under_pressure() -> None:
    """LE10: sigma_yy = -5.38 MPa at D within 2 %."""
    flat = box((8, 6, 3), (1.0, 1.0, 0.6), HEXA)
    x, y, z = flat.reference.T
    sets = {
        "middle": np.flatnonzero((y == 0.0) & (np.abs(z - 0.3) < 1e-9)),
        "D": np.flatnonzero((x == 0.0) & (y == 1.0) & (z == 0.6)),
    }
    mesh = replace(flat, reference=ellipse(flat.reference), sets=sets)
    body = bar(mesh, material=Material(210e9, 8000.0, 0.3))
    held = [("left", "y"), ("right", "x"), ("front", "xy"), ("middle", "z")]
    supports = [joints.HeldFace(name, "bar", (name,), fixed) for name, fixed in held]
    press = loads.Pressure("press", "bar", 1e6 * SMALL, faces=("top",))
    out = {"s": StressTensor(At("bar", "D"))}
    system = eliminate(assemble([body], supports, [press], outputs=out))
    found = dynamics.outputs(dynamics.solve_statics(system, 1))["s_yy"][-1] / SMALL
    assert found == pytest.approx(-5.38e6, rel=0.02)


@pytest.mark.parametrize("kind, cells", [(HEXA, (4, 4, 4)), (TETRA, (8, 4, 4))])
def test_a_square_bar_is_twisted(kind: type, cells: tuple[int, int, int]) -> None:
    """J = 0.140577 a^4 (Saint-Venant), of two middle sections of a bar whose ends warp, within 1 %."""
    mesh = box(cells, (0.4, 0.1, 0.1), kind)
    body = bar(mesh, "", "left right", Material(200e6, 1000.0, 0.3))
    held = [joints.Clamp("hold", At("bar", "left"))]
    T = 1e-3
    push = [loads.Torque("push", At("bar", "right"), (T, 0.0, 0.0))]
    system = eliminate(assemble([body], held, push))
    last = dynamics.solve_statics(system, 1).x[-1]
    q = np.asarray(system.lift(last)).reshape(-1, 3)
    X = mesh.reference
    nodes = q if body.spread is None else body.spread @ q
    angles = []
    for at in (0.1, 0.3):
        here = np.abs(X[:, 0] - at) < 1e-9
        about = X[here, 1:] - 0.05
        u = nodes[here, 1:] - X[here, 1:]
        angles.append(np.sum(about[:, 0] * u[:, 1] - about[:, 1] * u[:, 0]) / np.sum(about**2))
    G = 200e6 / 2.6
    found = T * 0.2 / (G * (angles[1] - angles[0]))
    assert found == pytest.approx(0.140577 * 0.1**4, rel=0.012)


def test_a_cantilever_at_large_rotation_beside_a_beam() -> None:
    """Its end goes where that of a beam with shear goes, within 1 % of the way."""
    steel = Material(200e6, 1000.0, 0.3)
    load = (-10.0, 15.0, 120.0)
    solid = bar(box((16, 2, 2), (1.0, 0.05, 0.05), HEXA), "left", "right", steel)
    line = beam("bar", segment(16), Rectangular(0.05, 0.05), steel)
    ends = []
    for body, shift in ((solid, [0.0, 0.025, 0.025]), (line, [0.0, 0.0, 0.0])):
        held = [joints.Clamp("hold", At("bar", "left"))]
        push = [loads.PointForce("push", At("bar", "right"), load)]
        out = {"r": probes.Position(At("bar", "right"))}
        system = eliminate(assemble([body], held, push, outputs=out))
        found = dynamics.outputs(dynamics.solve_statics(system, 4))
        ends.append(np.array([found[f"r_{k}"][-1] for k in "xyz"]) - shift)
    way = np.linalg.norm(ends[1] - [1.0, 0.0, 0.0])
    assert way > 0.3
    assert np.linalg.norm(ends[0] - ends[1]) < 0.01 * way
