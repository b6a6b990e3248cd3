"""Strains beyond what the laws mean are told, with body, size and place: beams, plates, statics,
motions, full, reduced.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.optimize import brentq

from fmbs_skfem import scenes, studies
from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import solve_statics
from fmbs_skfem.dynamics.diagnoses import large_strains
from fmbs_skfem.reduction.spaces import component, galerkin, pod
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from ..models import segment
from .test_state_space import MESHES

BEAM = """
schema: 1
dimension: 2
bodies:
  b:
    {type: cable, mesh: beam_10.msh, section: {shape: circular, diameter: 10 mm}, material: {young_modulus: 10 MPa, density: 1000}}
joints: {c: {type: clamp, at: b.left}}
loads: {P: {type: point_force, at: b.right, force: [FORCE, 0]}}
analysis: ANALYSIS
outputs: {x: {type: position, at: b.right}}
"""
PLATE = """
schema: 1
dimension: 3
bodies:
  p: {type: plate, mesh: plate_8x8.msh, thickness: 5 mm, material: {young_modulus: 1 MPa, density: 1000, poisson_ratio: 0.3},
      rims: {root: {edges: left, slopes: true}, tip: {edges: right, slopes: true}}}
joints: {c: {type: clamp, at: p.root}}
loads: {P: {type: point_force, at: p.tip, force: [FORCE, 0, 0]}}
analysis: {type: static, load_steps: 2}
"""
EA = 1e7 * np.pi * 0.01**2 / 4.0


def said(text: str, force: float, analysis: str = "{type: static, load_steps: 5}") -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", Notice)
        studies.run(
            scenes.loads(
                text.replace("FORCE", f"{force:.9g}").replace("ANALYSIS", analysis), MESHES
            ),
            plots=False,
        )
    return [str(one.message) for one in caught if "is strained by" in str(one.message)]


def stretch(part: float) -> float:
    """Of a bar under `part` EA: stretch (stretch^2 - 1) / 2 = part."""
    return float(brentq(lambda s: 0.5 * s * (s * s - 1.0) - part, 0.6, 4.0))


@pytest.mark.parametrize(
    ("part", "told"), [(1.0, True), (0.15, True), (-0.12, True), (0.08, False), (-0.05, False)]
)
def test_a_bar_that_is_stretched_or_pressed(part: float, told: bool) -> None:
    found = said(BEAM, part * EA)
    assert len(found) == told
    if told:
        s = stretch(part)
        assert found[0].startswith(f"'b' is strained by {50.0 * (s * s - 1.0):.3g} % near (")
        assert f"stretch of {s:.3g} has {0.5 * s * (s + 1.0):.2g} times the force" in found[0]


def test_motions_are_looked_at() -> None:
    """A load that begins at once stretches a bar by twice as much as it does at rest."""
    analysis = "{type: dynamic, duration: 0.04, step: 0.5 ms}"
    assert len(said(BEAM, 0.08 * EA, analysis)) == 1
    assert not said(BEAM, 0.03 * EA, analysis)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("force", "told"), [(1500.0, True), (20.0, False)])
def test_plates(force: float, told: bool) -> None:
    assert len(said(PLATE, force)) == told


@pytest.mark.parametrize(
    ("force", "strain", "shear"),
    [
        ((0.5, 0.0, 0.0), 0.625, 0.0),  # stretch 1 + N / EA
        ((-0.2, 0.0, 0.0), -0.18, 0.0),
        ((0.0, 0.03, 0.04), 0.14160, 0.25),  # V / GA, and (gamma^2 + sqrt(gamma^4 + 4 gamma^2)) / 4
        ((0.08, 0.0, 0.0), None, None),
        ((0.0, 0.0, 0.03), None, None),
    ],
)
def test_beams_with_torsion(
    force: tuple[float, ...], strain: float | None, shear: float | None
) -> None:
    """What is stretched, or sheared, by more than 10 %, with its place; one so stiff in bending
    that it shears alone.
    """
    section = sections.BeamSection(np.diag([1.0, 0.2, 0.2, 1e3, 1e3, 1e3]), np.eye(3))
    bar = beam("b", segment(3), section, origin=np.array([0.0, 5.0, 0.0]))
    held, load = joints.Clamp("c", At("b", "left")), loads.PointForce("P", At("b", "right"), force)
    found = large_strains.find(solve_statics(eliminate(assemble([bar], [held], [load])), 1))
    assert len(found) == (strain is not None)
    for one in found:
        assert one.strain == pytest.approx(strain, rel=2e-3)
        assert one.shear == pytest.approx(shear, abs=1e-3)
        assert 0.0 <= one.place[0] <= 1.0 + force[0]
        assert one.place[1] == pytest.approx(5.0, abs=0.3)
        assert f"{100 * one.strain:.3g} % near ({one.place[0]:.3g}, " in str(one)
        assert f"with a shear of {one.shear:.2g}" in str(one)


def pulled(part: float) -> System:
    bar = body.cable("b", segment(10), sections.Given(1.0, 1e-4, 1.0), dim=2)
    load = loads.PointForce("P", At("b", "right"), (part, 0.0))
    return assemble([bar], [joints.Clamp("c", At("b", "left"))], [load])


def test_reduced_models_know_where() -> None:
    raw = pulled(1.0)
    path = solve_statics(eliminate(raw), 10)
    data = galerkin.snapshots(path)
    level = component.body_level(raw)
    bases = {
        name: pod.basis(data.q[:, component.rows_of(raw, rows)].T, 1e-10)
        for name, rows in level.items()
    }
    reduced = solve_statics(galerkin.reduce_system(raw, level, bases, configurations=data.q), 10)
    (full,), (found,) = large_strains.find(path), large_strains.find(reduced)
    s = stretch(1.0)
    assert (found.body, found.at) == ("b", 1.0)
    assert found.strain == pytest.approx(0.5 * (s * s - 1.0), rel=1e-3)
    assert full.strain == pytest.approx(found.strain, rel=1e-3)
    assert len(found.place) == 2
