"""Plates that are clamped by the frame of a straight rim without slopes: they hang there on a
hinge.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import build
from fmbs_skfem.scenes.family import equilibria
from fmbs_skfem.systems.connections import hinged_rims

MESHES = Path(__file__).parents[2] / "meshes"
PLATE = """
schema: 1
dimension: 3
bodies:
  p:
    type: plate
    mesh: plate_8x8.msh
    thickness: 5 mm
    material: {young_modulus: 70 GPa, density: 2700, poisson_ratio: 0.3}
    rims: RIMS
joints: JOINTS
loads: {weight: {type: gravity, acceleration: [0, 0, -9.81]}}
analysis: ANALYSIS
"""
LEFT = "root: {edges: left, slopes: SLOPES}"
RIGHT = "tip: {edges: right, slopes: false}"
HELD = "a: {type: clamp, at: p.root}"
STATIC = "{type: static, load_steps: 1}"


def plate(
    slopes: str = "false", more: bool = False, joint: str = HELD, analysis: str = STATIC
) -> scenes.Scene:
    rims, joints = (
        f"{{{first}{', ' + second if more else ''}}}"
        for first, second in ((LEFT, RIGHT), (joint, "b: {type: clamp, at: p.tip}"))
    )
    text = (
        PLATE.replace("RIMS", rims)
        .replace("JOINTS", joints)
        .replace("ANALYSIS", analysis)
        .replace("SLOPES", slopes)
    )
    return scenes.loads(text, MESHES)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("scene", "count"),
    [
        (plate(), 1),
        (plate(slopes="true"), 0),
        (plate(more=True), 0),
        (
            plate(joint="a: {type: revolute, at: p.root, axis: [0, 1, 0]}"),
            0,
        ),  # counted as the motion of the joint
        (plate(joint="a: {type: revolute, at: p.root, axis: [1, 0, 0]}"), 1),
    ],
    ids=["hinged", "clamped", "at both sides", "hinge along the rim", "hinge across the rim"],
)
def test_what_swings_about_a_rim_is_counted(scene: scenes.Scene, count: int) -> None:
    assert hinged_rims.find(build.system(scene)).shape[1] == count


@pytest.mark.filterwarnings("ignore")
def test_equilibria_of_such_plates_are_refused() -> None:
    """Under its weight it would swing from horizontal to hanging."""
    with pytest.raises(
        InputError,
        match=r"p turns about the axis \(0, 1, 0\) through \(0, .*\); `slopes: true` of the rim",
    ):
        plate().run()
    with pytest.raises(InputError, match="1 rigid motion that nothing resists"):
        studies.check(plate())
    plate(slopes="true").run()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "analysis",
    ["{type: buckling}", "{type: dynamic, duration: 2 ms, step: 1 ms, start: equilibrium}"],
)
def test_other_doors_to_such_equilibria_are_shut(analysis: str) -> None:
    with pytest.raises(
        InputError,
        match=r"p turns about the axis \(0, 1, 0\) through \(0, .*\); `slopes: true` of the rim",
    ):
        plate(analysis=analysis).run()


@pytest.mark.filterwarnings("ignore")
def test_sweeps_over_such_equilibria_are_refused() -> None:
    with pytest.raises(InputError, match="1 rigid motion that nothing resists"):
        equilibria({}, plate())


@pytest.mark.filterwarnings("ignore")
def test_check_counts_such_motions() -> None:
    found = studies.check(plate(analysis="{type: dynamic, duration: 0.01, step: 1 ms}")).report[
        "mechanism"
    ]
    assert (found["degrees_of_freedom"], found["left_by_drives"]) == (1, 1)
    assert found["free_motions"][0].startswith("p turns about the axis (0, 1, 0)")
