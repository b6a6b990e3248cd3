"""Steps that are printed from their kernels against those that numba compiles: the same motion, by as
many corrections.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from fmbs_skfem import scenes
from fmbs_skfem.scenes import build
from tests.exports import printed
from tests.exports.c_library import COMPILER, STRICT
from tests.exports.test_c_files import CASES, STEP

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK = "a rope", "a plate as a polynomial"
#: full models with friction, contact of beams and shapes, gears, line joints
SCENES = "cable_over_drum", "geared_arm", "gripper", "heavy_top", "overhead_crane", "crossing_beams"


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in CASES],
)
def test_a_printed_step_of_a_reduced_model_is_that_of_the_package(
    name: str, tmp_path: Path
) -> None:
    off, more = printed.compare(CASES[name](), STEP, 150, tmp_path, STRICT)
    assert off < 1e-11
    assert more == 0


@pytest.mark.slow  # compilers take 2 s each
@pytest.mark.parametrize("name", SCENES)
def test_a_printed_step_of_a_full_model_is_that_of_the_package(name: str, tmp_path: Path) -> None:
    system = build.system(scenes.read(EXAMPLES / f"{name}.yaml"))
    off, more = printed.compare(system, STEP, 100, tmp_path, STRICT)
    assert off < 1e-10
    assert abs(more) <= 2
