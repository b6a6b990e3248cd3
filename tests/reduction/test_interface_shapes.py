"""Interface functions and fixed-interface modes: parts vibrate as their bodies, however these are
held.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Body, Material, Rectangular, cable
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.dynamics import energies, solve_statics, vibration_modes
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.parts import interface_shapes
from fmbs_skfem.parts.excitation import Excitation, excite
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from verification.vibration import ring

from .. import solids

SECTION, METAL = Rectangular(0.02, 0.01), Material(70e9, 2700.0)
SUPPORTS = {
    "clamped_free": [joints.Clamp("a", At("bar", "left"))],
    "clamped_clamped": [
        joints.Clamp("a", At("bar", "left")),
        joints.Clamp("b", At("bar", "right")),
    ],
    "pinned_pinned": [joints.Pin("a", At("bar", "left")), joints.Pin("b", At("bar", "right"))],
    "free": [],
}
#: errors of modes 1 to 4 [%], own computation by linear algebra of the full body: references/solids
TABLE = {
    "clamped_free": [0.001, 0.014, 0.07, 0.16],
    "clamped_clamped": [0.0, 0.0, 0.0, 0.0],
    "pinned_pinned": [0.0, 0.004, 0.17, 0.28],
    "free": [0.04, 0.09, 0.43, 0.39],
}


def bar(dim: int) -> Body:
    """1 m x 20 x 10 mm of aluminium."""
    return cable("bar", segment(20), SECTION, METAL, dim=dim)


def frequencies(body: Body, held: list[joints.Joint], count: int = 4) -> np.ndarray:
    """The lowest elastic ones [rad/s]."""
    found = vibration_modes(assemble([body], held), count + 6).angular_frequencies
    return np.asarray(found[found > 1.0][:count])


@pytest.mark.parametrize("support", SUPPORTS)
def test_a_bar_of_eight_functions_vibrates_as_its_body_in_all_supports(support: str) -> None:
    """The table of Craig and Bampton: its training bends it by slow motions alone."""
    part = part_files.train(bar(2), excite(bar(2), Excitation(runs=1, samples=100)), modes=8)
    held = SUPPORTS[support]
    errors = 100.0 * (frequencies(part.body, held) / frequencies(bar(2), held) - 1.0)
    assert_allclose(errors, TABLE[support], atol=0.01, rtol=0.05)


@pytest.mark.parametrize("support", ["clamped_free", "clamped_clamped", "free"])
def test_a_beam_with_torsion_does_as_well(support: str) -> None:
    """Its directors are 1e14 times as stiff as it bends."""
    body = beam("bar", segment(12), SECTION, METAL)
    part = part_files.train(body, body.reference[None], modes=30, eta=None)
    held = SUPPORTS[support]
    assert_allclose(frequencies(part.body, held), frequencies(body, held), rtol=5e-3)


def test_a_coarser_part_keeps_its_shapes(tmp_path: Path) -> None:
    """In its functions and in its points; a file says them, and one of before has none."""
    states = excite(bar(2), Excitation(runs=1, samples=100))
    path = part_files.save(part_files.train(bar(2), states, 1e-15), tmp_path / "bar.part.h5")
    small = part_files.coarsen(part_files.resume(path), 1e-3)
    assert small.notes["functions"] == 8 < part_files.load(path).notes["functions"]
    for held in SUPPORTS.values():
        assert_allclose(frequencies(small.body, held), frequencies(bar(2), held), rtol=5e-3)
    none = part_files.train(bar(2), states, 1e-9, shapes=states[:0])
    assert none.notes["functions"] < 8


def test_a_solid_bends_under_its_inertia_as_its_body() -> None:
    """Held at both ends under its weight, as a part of its shapes alone: the strain energy, which
    vibrations sum up to slowly.
    """
    body = solids.bar(solids.box((6, 1, 1)), "left", "right")
    part = part_files.train(body, body.reference[None], eta=None).body
    found = []
    for one in (body, part):
        held = [joints.Pin("a", At("bar", "left")), joints.Clamp("b", At("bar", "right"))]
        weight = [loads.Gravity((0.02, 0.01, -0.03))]
        path = solve_statics(eliminate(assemble([one], held, weight)), 1)
        found.append(float(energies(path)[-1, 1]))
    assert found[1] == pytest.approx(found[0], rel=1e-6)


def test_shapes_hold_the_places_that_they_do_not_move() -> None:
    """Fixed-interface modes move no place, and nothing else bends a ring that is held once."""
    rims = {"hub": Rim(("inner",), slopes=True)}
    body = plate("ring", ring(0.05, 0.1, 12), 2e-3, Material(2e9, 1200.0, 0.3), dim=3, rims=rims)
    J = interface_shapes.rows_of_interfaces(body)
    found = interface_shapes.find(body).reshape(-1, body.reference.size)
    assert len(found) == interface_shapes.MODES * 3
    assert np.abs(found @ J.T).max() < 1e-8 * np.abs(found).max()
