"""`start: equilibrium` of dynamic analyses in all that is done with a scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import dynamics, scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.reduction import cases, files
from fmbs_skfem.results import sweep_files

from ..cli.calls import CANTILEVER, scene

REST = "{type: dynamic, duration: 50 ms, step: 1 ms, start: equilibrium}"
RANGED = CANTILEVER.replace("{{load: 0.5 N}}", "{{load: {{value: 0.5 N, range: [0.3 N, 0.8 N]}}}}")
SWAYING = "1 + 0.5 * sin(60 * t)"
ARM = """\
schema: 1
dimension: 2
bodies:
  arm: {{type: rigid, mass: 3 kg, inertia: 0.16 kg m^2, center: [0.4, 0], points: {{pin: [0, 0]}}}}
joints:
  pin: {{type: revolute, at: arm.pin}}
loads:
  weight: {{type: gravity, acceleration: [0, -9.81]}}
analysis: {analysis}
"""


def drawn(folder: Path, load: float) -> np.ndarray:
    """Tip (c,) in a static analysis with this load at the end [N]."""
    text = CANTILEVER.replace("load: 0.5 N", f"load: {load} N")
    found = studies.run(scene(folder, "{type: static, tolerance: 1e-13}", text=text)).outputs
    return np.array([found["tip_x"][-1], found["tip_y"][-1]])


def tip(motion: dynamics.Trajectory) -> np.ndarray:
    found = dynamics.outputs(motion, ["tip"])
    return np.stack([found["tip_x"], found["tip_y"]], axis=1)


def test_a_run_and_a_check_of_a_scene(tmp_path: Path) -> None:
    place = drawn(tmp_path, 0.5)
    path = scene(tmp_path, REST)
    assert_allclose(tip(studies.run(path).trajectory), np.tile(place, (51, 1)), rtol=0, atol=1e-10)
    initial = studies.check(path).report["initial"]
    assert initial["position_change"] == pytest.approx(abs(place[1]), rel=1e-6)
    assert initial["velocity_change"] == 0.0
    assert (
        studies.check(scene(tmp_path, REST.replace("equilibrium", "reference"))).report["initial"][
            "position_change"
        ]
        < 1e-12
    )


def test_every_member_of_a_family_starts_from_its_own(tmp_path: Path) -> None:
    places = {load: drawn(tmp_path, load) for load in (0.3, 0.8)}
    family = scenes.family(scenes.read(scene(tmp_path, REST, text=RANGED)))[1]
    for load, place in places.items():
        assert_allclose(
            tip(cases.run(family({"load": load}))), np.tile(place, (51, 1)), rtol=0, atol=1e-10
        )
    found = studies.sweep(
        scene(tmp_path, REST, text=RANGED), samples=2, design="grid", workers=1, plots=False
    )
    assert_allclose(
        np.sort(sweep_files.extremes(found.samples, "tip_y")["max"]),
        np.sort([place[1] for place in places.values()]),
        rtol=0,
        atol=1e-10,
    )


def test_a_reduced_model_and_its_file_start_there(tmp_path: Path) -> None:
    place = drawn(tmp_path, 0.5)
    text = CANTILEVER + "reduction: {{snapshots: 1 ms, hyper_reduction: {{tolerance: 1e-6}}}}\n"
    studies.reduce(scene(tmp_path, REST, SWAYING, text), out=tmp_path / "out")
    case = files.case_of(files.read(tmp_path / "out" / "cantilever.h5"))[0]
    assert case.scheme.start == "equilibrium"
    assert_allclose(tip(cases.run(case))[0], place, rtol=0, atol=1e-5)


def test_a_mechanism_that_is_free_to_move_is_named(tmp_path: Path) -> None:
    path = scene(tmp_path, REST, text=ARM)
    for study in (studies.check, studies.run):
        with pytest.raises(
            InputError,
            match=r"arm turns about \(0, 0\)[^?]*hold them by joints, or start from the reference",
        ):
            study(path)
