"""What is kept of a solve that failed, and what is drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib import image

from fmbs_skfem.core.errors import SolverError
from fmbs_skfem.studies import reports
from fmbs_skfem.studies.running import failures, panels

from .. import models
from ..dynamics.test_diagnosis import WAYS


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_fail_leaves_its_facts_and_a_picture(way: str, tmp_path: Path) -> None:
    """The picture is that of the last good state, also of point masses; a solve that fails before
    its first step has none.
    """
    with pytest.raises(SolverError) as caught:
        WAYS[way][0]()
    found, files = failures.write_failure(tmp_path, caught.value, reports.provenance())
    assert found["failure"]["causes"]
    names = (
        {"failure.json"}
        if caught.value.partial is None
        else {"failure.json", "failure.h5", "failure.png"}
    )
    assert (
        {path.name for path in tmp_path.iterdir()} == names == {Path(path).name for path in files}
    )
    if caught.value.partial is not None:
        shown = image.imread(tmp_path / "failure.png")[..., :3]
        assert (shown != shown[0, 0]).any(axis=-1).mean() > 0.002


def test_outputs_that_are_not_finite_are_not_drawn(tmp_path: Path) -> None:
    system, times = models.spin_up(2), np.array([0.0, 1e-3, 2e-3])
    first, second, *_ = (column for output in system.outputs.values() for column in output.columns)
    assert not panels.figures_of(system.outputs, times, {first: np.array([1.0, np.nan, 1.0])})
    assert list(
        panels.figures_of(
            system.outputs, times, {first: np.array([1.0, np.nan, 1.0]), second: np.ones(3)}
        )
    ) == ["outputs"]
