"""Stresses of planar cables and along lines, against N/A +- M c/I."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import dynamics
from fmbs_skfem.bodies import Body, Circular, Given, Material, Rectangular, Section, cable
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.beams.drawn_sections import LSection, PolygonSection, Tube
from fmbs_skfem.bodies.tapered import Tapered
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.parts import rescaling
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads
from fmbs_skfem.systems.forces.line_loads import LineLoad
from fmbs_skfem.systems.measures.line_stresses import HighestStress, Stress
from fmbs_skfem.systems.measures.probes import Probe, kind_of
from fmbs_skfem.systems.measures.utilisation import Utilisation

STEEL = Material(210e9, 7850.0, 0.3, yield_strength=235e6)
FLAT = Rectangular(0.02, 0.01)
AREA, MODULUS = 0.02 * 0.01, 0.02 * 0.01**2 / 6.0  #: of the section, M / MODULUS is its stress


def held(body: Body, *acting: loads.Load, **sensed: Probe) -> dict[str, float]:
    """Outputs of a cantilever under small loads."""
    root = joints.Clamp("root", At("b", "left"))
    system = eliminate(assemble([body], [root], acting, outputs=sensed))
    found = dynamics.outputs(dynamics.solve_statics(system, 1))
    return {name: float(values[-1]) for name, values in found.items()}


def strip(section: Section = FLAT, dim: int = 2, cells: int = 16, turn: float = 0.0) -> Body:
    c, s = np.cos(turn), np.sin(turn)
    way = np.array([[c, -s], [s, c]]) if dim == 2 else np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    start = np.array([3.0, -7.0, 2.0])[:dim]
    return cable("b", segment(cells), section, STEEL, dim=dim, origin=start, rotation=way)


@pytest.mark.parametrize("turn", [0.0, 2.3])
def test_a_cantilever_that_is_pulled_and_bent(turn: float) -> None:
    """N/A +- F (L - s) c/I at a place, and at the clamp the highest of all."""
    pull, push = 500.0, 0.2
    c, s = np.cos(turn), np.sin(turn)
    force = (pull * c + push * s, pull * s - push * c)
    found = held(
        strip(turn=turn),
        loads.PointForce("F", At("b", "right"), force),
        here=Stress(At("b", 0.3)),
        all=HighestStress("b"),
        used=Utilisation(of="b"),
    )
    assert_allclose(found["used"], found["all_von_mises"] / 235e6, rtol=1e-12)
    for name, arm in (("here", 0.7), ("all", 1.0)):
        # the pull straightens it by 3 %: the arm is that of the tension's cantilever
        k = np.sqrt(pull / (210e9 * MODULUS * 0.005))
        bent = push / k * np.sinh(k * arm) / np.cosh(k) / MODULUS
        assert_allclose(found[f"{name}_max"], pull / AREA + bent, rtol=1e-3)
        assert_allclose(found[f"{name}_von_mises"], pull / AREA + bent, rtol=1e-3)
    assert_allclose(found["here_min"], 2 * pull / AREA - found["here_max"], rtol=1e-6)


def test_the_highest_stress_is_that_of_a_beam_in_space() -> None:
    """A beam with torsion and a planar cable under the same load along their line."""
    q = LineLoad("q", "b", (0.0, -3.0, 0.0))
    body = beam("b", segment(32), FLAT, STEEL, direction=(0.0, 0.0, 1.0))
    in_space = held(body, q, all=HighestStress("b"))
    planar = held(strip(cells=32), LineLoad("q", "b", (0.0, -3.0)), all=HighestStress("b"))
    for name in ("all_max", "all_min"):
        assert_allclose(planar[name], np.sign(planar[name]) * 1.5 / MODULUS, rtol=2e-3)
        assert_allclose(in_space[name], planar[name], rtol=2e-3)


def test_a_bar_that_tapers_is_stressed_where_it_is_thin() -> None:
    """Of a bar from 20 to 10 mm, M/W of the formula at 2001 places."""
    body = strip(Tapered({0.0: Circular(0.02), 1.0: Circular(0.01)}), cells=32)
    found = held(body, loads.PointForce("F", At("b", "right"), (0.0, 0.5)), all=HighestStress("b"))
    s = np.linspace(0.0, 1.0, 2001)
    exact = (0.5 * (1.0 - s) * 32.0 / (np.pi * (0.02 - 0.01 * s) ** 3)).max()
    assert_allclose(found["all_max"], exact, rtol=2e-3)


def test_other_numbers_scale_stresses() -> None:
    """A part with another modulus and diameter has the stresses of a body made of them."""
    force = loads.PointForce("F", At("b", "right"), (0.0, 0.1))
    body = rescaling.rescale(
        strip(Circular(0.01)), {"young_modulus": 70e9, "diameter": 0.02, "density": 2700.0}
    )
    exact = 0.1 * 32.0 / (np.pi * 0.02**3)
    assert_allclose(held(body, force, all=HighestStress("b"))["all_max"], exact, rtol=1e-3)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: strip(Given(1e6, 10.0, 0.1)), "a section with a shape and a material"),
        (lambda: strip(Rectangular(0.01, 0.01), 3), "round in space, got that of 'b'"),
    ],
)
def test_fibres_that_nobody_knows(make: Callable[[], Body], told: str) -> None:
    for one in (HighestStress("b"), Stress(At("b", 0.5))):
        with pytest.raises(InputError, match=told):
            held(make(), out=one)


def test_round_cables_in_space_and_sections_of_other_sides() -> None:
    """A tube in space; of an angle the farther fibre counts."""
    force = loads.PointForce("F", At("b", "right"), (0.0, 0.03, 0.04))
    tube = held(strip(Tube(0.01, 0.001), 3), force, all=HighestStress("b"))
    second = np.pi / 64 * (0.01**4 - 0.008**4)
    assert_allclose(tube["all_max"], 0.05 * 0.005 / second, rtol=1e-3)
    angle = LSection(0.02, 0.03, 0.003, 0.003)
    given = angle.of_cable(STEEL)
    push = loads.PointForce("F", At("b", "right"), (0.0, 0.05))
    found = held(strip(angle), push, all=HighestStress("b"))
    assert_allclose(found["all_max"], 0.05 * given.radius / given.EI * 210e9, rtol=1e-3)
    assert given.radius > 0.015
    square = PolygonSection(((0.0, 0.0), (0.02, 0.0), (0.02, 0.01), (0.0, 0.01)))
    assert_allclose(
        held(strip(square), push, all=HighestStress("b"))["all_max"], 0.05 / MODULUS, rtol=1e-3
    )


def test_what_files_keep() -> None:
    """Rows, columns and parameters of outputs are those that files are checked for."""
    for body in (strip(), beam("b", segment(8), FLAT, STEEL)):
        system = assemble([body], outputs={"all": HighestStress("b"), "one": Stress(At("b", 0.2))})
        for output in system.outputs.values():
            rows, columns, _ = kind_of(output).sizes(output, body.dim)
            assert (rows, columns) == (len(output.rows), len(output.columns))
        broken = system.outputs["all"].parameters[:-3]
        with pytest.raises((LookupError, ValueError)):
            kind_of(output).sizes(
                type(output)(output.kind, (), output.columns, parameters=broken), body.dim
            )
