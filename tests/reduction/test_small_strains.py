"""Parts of solids for small strains: a constant stiffness that turns with them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem import dynamics
from fmbs_skfem.bodies import Body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.parts import static_states
from fmbs_skfem.parts.excitation import Excitation
from fmbs_skfem.parts.files import Part
from fmbs_skfem.parts.rescaling import rescale
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.measures.recovered import RecoveredStress

from .. import solids
from .test_part_files import arm

TURN = Rotation.from_rotvec([0.3, 1.0, -0.4]).as_matrix()
HERE = np.eye(3)
FALL, AXIS = np.array([0.0, 0.0, -9.81]), np.array([0.0, 1.0, 0.0])


@cache
def bar() -> Body:
    """A bar of 1 m between two rigid ends."""
    return solids.bar(solids.box((3, 1, 1), (1.0, 0.1, 0.1)), "left right")


@cache
def part() -> Part:
    """The part of it, trained at rest."""
    states = static_states.find(bar(), Excitation(runs=2, strain=1e-3))[0]
    return part_files.train(bar(), states, small_strains=True)


def swung(body: Body, turn: np.ndarray) -> dict[str, np.ndarray]:
    """A pendulum that falls for 0.4 s: its end, and the stress at its hinge."""
    hinge = joints.Revolute("hinge", At("bar", "left"), axis=tuple(turn @ AXIS))
    weight = loads.Gravity(tuple(turn @ FALL))
    out = {"r": probes.Position(At("bar", "right")), "s": RecoveredStress("bar", "left")}
    system = eliminate(assemble([body], [hinge], [weight], outputs=out))
    return dynamics.outputs(dynamics.integrate(system, GeneralizedAlpha(1e-2), 0.4))


def test_it_swings_as_its_body_wherever_it_stands(tmp_path: Path) -> None:
    """Also from a file, and turned: the stress within 6 % of the range, as with all strains."""
    read = part_files.load(part_files.save(part(), tmp_path / "bar.part.h5")).body
    full, own = swung(bar(), HERE), swung(parts.placed(read, "bar", check=False), HERE)
    ends = [np.stack([one[f"r_{k}"] for k in "xyz"]) for one in (full, own)]
    assert_allclose(ends[1], ends[0], atol=1e-4)
    assert_allclose(
        own["s_von_mises"], full["s_von_mises"], atol=0.06 * np.ptp(full["s_von_mises"])
    )
    away = parts.placed(read, "bar", np.array([20.0, 3.0, -5.0]), TURN, check=False)
    moved = swung(away, TURN)
    end = np.stack([moved[f"r_{k}"] for k in "xyz"])
    assert_allclose(end, TURN @ ends[1] + [[20.0], [3.0], [-5.0]], atol=1e-8)
    assert_allclose(moved["s_1"], own["s_1"], atol=1e-6 * np.ptp(own["s_1"]))


def test_it_is_held_against_more_shapes_and_told_where_it_bends_far() -> None:
    hold = joints.Clamp("hold", At("bar", "left"))
    push = [loads.PointForce("push", At("bar", "right"), (0.0, 0.0, 300.0))]
    out = {"r": probes.Position(At("bar", "right"))}
    raw = assemble([part().body], [hold], push, outputs=out)
    with pytest.warns(Notice, match="linear strains are off by about"):
        dynamics.integrate(eliminate(raw), GeneralizedAlpha(5e-3), 0.1)
    assert raw.elastic[0].gather.checked  # type: ignore[union-attr]
    assert part().body.spare is not None
    assert part().notes["energy"] == "small strains"


def test_a_stiffer_material_bends_less() -> None:
    hold = joints.Clamp("hold", At("bar", "left"))
    push = [loads.PointForce("push", At("bar", "right"), (0.0, 0.0, 1.0))]
    out = {"r": probes.Position(At("bar", "right"))}
    ends = []
    for modulus in (200e6, 400e6):
        body = rescale(part().body, {"young_modulus": modulus})
        system = eliminate(assemble([body], [hold], push, outputs=out))
        found = dynamics.outputs(dynamics.solve_statics(system, 1))["r_z"]
        ends.append(float(found[-1]) - 0.05)
    assert ends[0] == pytest.approx(2.0 * ends[1], rel=1e-4)


def test_a_coarser_one_is_linear_as_well() -> None:
    """With fewer functions; its stiffness is that of the larger one, held against what it left."""
    small = part_files.coarsen(part(), modes=24).body
    assert small.linear is not None
    assert small.spare is not None
    count = len(small.reference)
    assert count < min(len(part().body.reference), len(small.spare.reference))
    assert small.linear.stiffness.shape == (3 * count, 3 * count)
    hold = joints.Clamp("hold", At("bar", "left"))
    push = [loads.PointForce("push", At("bar", "right"), (0.0, 0.0, 1.0))]
    out = {"r": probes.Position(At("bar", "right"))}
    ends = []
    for body in (bar(), part().body, small, replace(small, linear=None)):
        system = eliminate(assemble([body], [hold], push, outputs=out))
        ends.append(float(dynamics.outputs(dynamics.solve_statics(system, 1))["r_z"][-1]) - 0.05)
    assert ends[1] == pytest.approx(ends[0], rel=1e-3)
    assert ends[2] == pytest.approx(ends[3], rel=1e-3)
    assert 0.8 * ends[0] < ends[2] < ends[0]


def test_it_is_of_solids() -> None:
    with pytest.raises(InputError, match="expected a solid, for small strains"):
        part_files.train(arm(), arm().reference[None], small_strains=True)
