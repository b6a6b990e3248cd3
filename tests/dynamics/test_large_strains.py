"""Strains beyond what the laws mean are told, with body, size and place: beams, plates, statics, motions, full, reduced."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.optimize import brentq

from fmbs_skfem import scenes, studies
from fmbs_skfem.bodies import body, sections
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
        studies.run(scenes.loads(text.replace("FORCE", f"{force:.9g}").replace("ANALYSIS", analysis), MESHES), plots=False)
    return [str(one.message) for one in caught if "is strained by" in str(one.message)]


def stretch(part: float) -> float:
    """Of a bar under `part` EA: stretch (stretch^2 - 1) / 2 = part."""
    return float(brentq(lambda s: 0.5 * s * (s * s - 1.0) - part, 0.6, 4.0))


@pytest.mark.parametrize(("part", "told"), [(1.0, True), (0.15, True), (-0.12, True), (0.08, False), (-0.05, False)])
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


def pulled(part: float) -> System:
    beam = body.cable("b", segment(10), sections.Given(1.0, 1e-4, 1.0), dim=2)
    load = loads.PointForce("P", At("b", "right"), (part, 0.0))
    return assemble([beam], [joints.Clamp("c", At("b", "left"))], [load])


def test_reduced_models_know_where() -> None:
    raw = pulled(1.0)
    path = solve_statics(eliminate(raw), 10)
    data = galerkin.snapshots(path)
    level = component.body_level(raw)
    bases = {name: pod.basis(data.q[:, component.rows_of(raw, rows)].T, 1e-10) for name, rows in level.items()}
    reduced = solve_statics(galerkin.reduce_system(raw, level, bases, configurations=data.q), 10)
    (full,), (found,) = large_strains.find(path), large_strains.find(reduced)
    s = stretch(1.0)
    assert (found.body, found.at) == ("b", 1.0)
    assert found.strain == pytest.approx(0.5 * (s * s - 1.0), rel=1e-3)
    assert full.strain == pytest.approx(found.strain, rel=1e-3)
    assert len(found.place) == 2
