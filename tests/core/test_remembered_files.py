"""Files that do not change are read once, changed ones anew, and what reading says is said each
time.
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.core import remembered_files
from fmbs_skfem.core.notices import Notice, notify, recorded
from fmbs_skfem.shapes import curves, meshes

LINE = Path(__file__).parents[2] / "meshes" / "beam_10.msh"


@pytest.fixture
def settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files of a test are as old as those that users have."""
    monkeypatch.setattr(remembered_files, "SETTLED", -1.0)


def _reader(path: Path, times: list[str]) -> str:
    def read() -> str:
        times.append(path.read_text())
        if "odd" in times[-1]:
            notify("an odd file")
        return times[-1]

    return remembered_files.once(path, "text", read)


@pytest.mark.usefixtures("settled")
def test_a_file_is_read_once_until_it_changes(tmp_path: Path) -> None:
    path, times = tmp_path / "a.txt", list[str]()
    path.write_text("one")
    assert [_reader(path, times), _reader(path, times)] == ["one", "one"]
    assert times == ["one"]
    path.write_text("another")
    assert _reader(path, times) == "another"
    other = tmp_path / "b.txt"
    other.write_text("instead")
    os.replace(other, path)
    assert _reader(path, times) == "instead"


def test_a_file_that_was_changed_just_now_is_read_again(tmp_path: Path) -> None:
    """Within one step of the clock of a file system two changes have one time."""
    path, times = tmp_path / "a.txt", list[str]()
    path.write_text("one")
    state = path.stat()
    assert _reader(path, times) == "one"
    path.write_text("two")
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
    assert _reader(path, times) == "two"
    assert _reader(path, times) == "two"
    assert times == ["one", "two", "two"]


@pytest.mark.usefixtures("settled")
def test_notices_are_shown_at_every_reading(tmp_path: Path) -> None:
    path, times = tmp_path / "a.txt", list[str]()
    path.write_text("odd")
    for _ in range(2):
        with pytest.warns(Notice, match="an odd file"):
            _reader(path, times)
    assert len(times) == 1
    with warnings.catch_warnings(record=True), recorded() as found:
        _reader(path, times)
    assert [str(one) for one in found] == ["an odd file"]


@pytest.mark.usefixtures("settled")
def test_no_more_files_than_wanted_are_remembered(tmp_path: Path) -> None:
    times = list[str]()
    for k in range(2 * remembered_files.MOST):
        (tmp_path / f"{k}").write_text(str(k))
        _reader(tmp_path / f"{k}", times)
    assert len(remembered_files.KNOWN) == remembered_files.MOST


@pytest.mark.usefixtures("settled")
def test_meshes_that_are_handed_out_are_the_callers_own() -> None:
    first, second = meshes.read(LINE), meshes.read(LINE)
    kept = first.points.copy()
    second.points[:] = 0.0
    second.cells[:] = 0
    second.point_groups.clear()
    third = meshes.read(LINE)
    np.testing.assert_array_equal(third.points, kept)
    np.testing.assert_array_equal(third.cells, first.cells)
    assert third.point_groups.keys() == first.point_groups.keys()


@pytest.mark.usefixtures("settled")
def test_lines_are_cut_as_those_of_meshes_that_were_read(tmp_path: Path) -> None:
    path = tmp_path / "line.msh"
    path.write_bytes(LINE.read_bytes())
    for length in (1.0, 2.0):
        mesh = meshes.read(LINE, unit=length)
        meshes.write(mesh, path)
        known, anew = (
            curves.cut(curves.read(path, None), 7),
            curves.cut(curves.follow(mesh, None), 7),
        )
        np.testing.assert_array_equal(known.breaks, anew.breaks)
        np.testing.assert_array_equal(known.curve(known.breaks), anew.curve(anew.breaks))
        assert known.names == anew.names
        known.breaks[:] = np.nan
        np.testing.assert_array_equal(curves.cut(curves.read(path, None), 7).breaks, anew.breaks)
