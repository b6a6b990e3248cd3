"""Pictures of verification cases with load paths."""

from __future__ import annotations

from pathlib import Path

import pytest

from fmbs_skfem.results import plots
from verification.plots import LoadPath, group

LINE = LoadPath(((0.0, 0.0), (1.0, 2.0), (2.0, 1.0)), ((1.0, 2.0),), "w [m]", "P [N]")
ERRORS = ((0.2, 1e-2), (0.1, 1e-3))


@pytest.mark.parametrize(
    "found", [{"path": LINE}, {"order": ERRORS, "path": LINE}, {"order": ERRORS}, {}]
)
def test_errors_and_load_paths_get_axes_of_their_own(
    found: dict[str, LoadPath], tmp_path: Path
) -> None:
    path = plots.save(group("title", {"a": [(1e-3, 1e-2)]}, {"a": found}), tmp_path / "p.png")
    assert path.read_bytes()[:4] == b"\x89PNG"
