"""Studies of motions that an event stops, each member's at an instant of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import reduction, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics.trajectory import Trajectory
from fmbs_skfem.reduction import full_runs

SCENE = """\
schema: 1
dimension: 2
parameters: {E: {value: 1 GPa, range: [0.5 GPa, 1.5 GPa]}, h: {value: 20 cm, range: [10 cm, 30 cm]}}
bodies:
  bar: {type: cable, mesh: beam_10.msh, section: {shape: circular, diameter: 20 mm}, material: {young_modulus: E, density: 1800}}
joints: {hook: {type: pin, at: bar.left}}
loads: {weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}}
events: {end: {when: tip.y + h, direction: falling, stop: true}}
outputs: {tip: {type: position, at: bar.right}}
analysis: {type: dynamic, duration: 0.4 s, step: 1 ms}
reduction: {snapshots: 4 ms, tolerance: 1e-10, hyper_reduction: {tolerance: 1e-4}}
training: {candidates: 12, samples: 4, iterations: 2, holdout: 2}
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stopped")
    (folder / "beam_10.msh").write_bytes(
        (Path(__file__).parents[2] / "meshes" / "beam_10.msh").read_bytes()
    )
    (folder / "bar.yaml").write_text(SCENE)
    return folder / "bar.yaml"


def test_families(path: Path, tmp_path: Path) -> None:
    """Hold-out runs end elsewhere than their reduced ones; the model meets the event, tip.y = -h,
    at every point.
    """
    found = studies.train(path, out=tmp_path / "family")
    assert found.holdout is not None
    assert 0.0 < found.holdout.true.max() < 5e-3
    motion = studies.run(
        tmp_path / "family" / "model.h5", parameters={"h": "15 cm", "E": "0.7 GPa"}
    )
    assert motion.outputs["tip_y"][-1] == pytest.approx(-0.15, abs=1e-9)
    full = studies.run(path, parameters={"h": "15 cm", "E": "0.7 GPa"})
    assert motion.times[-1] == pytest.approx(full.times[-1], rel=1e-3)


def stopped(motion: Trajectory, last: int) -> Trajectory:
    """A motion that ends within the step after the state `last`."""
    short = motion.part(slice(0, last + 2))
    return replace(
        short, times=np.append(short.times[:-1], 0.5 * (short.times[-2] + short.times[-1]))
    )


def test_other_ends(path: Path) -> None:
    motion = studies.run(path).trajectory
    other = stopped(motion, len(motion.times) // 2)
    with pytest.warns(
        Notice,
        match=r"a compared motion ends at 0\.08\d* s, the full one at 0\.16\d* s: errors are those until",
    ):
        assert reduction.compare(motion, other).position.max() == 0.0
    run = full_runs.FullRun({}, motion.times, {}, 0.0, q=motion.x)
    with pytest.warns(Notice, match="until the earlier end"):
        mine, others = full_runs.while_both_run(run, other)
    assert len(mine.times) == len(others.times) == len(mine.q) == len(other.times) - 1  # type: ignore[arg-type]
    with pytest.raises(InputError, match="expected the times of the full run, got 11 of"):
        full_runs.while_both_run(run, motion.part(slice(0, 101, 10)))
