"""A file is in its place complete and flushed, or the place is as it was."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fmbs_skfem.core.storage import durable


def test_a_file_is_flushed_before_it_has_its_name_and_its_folder_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, seen = tmp_path / "a.txt", list[tuple[str, bool]]()
    flush = durable.flush

    def told(place: Path) -> None:
        seen.append((place.name, path.exists()))
        flush(place)

    monkeypatch.setattr(durable, "flush", told)
    with durable.place(path) as part:
        part.write_text("new")
    assert seen == [("a.txt.part", False), (tmp_path.name, True)]
    assert path.read_text() == "new"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_an_error_leaves_the_place_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(UnicodeEncodeError), durable.place(path) as part:
        part.write_text("new, up to here \ud800", encoding="utf-8")
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_a_checksum_is_that_of_the_bytes(tmp_path: Path) -> None:
    """FIPS 180-2, example B.1."""
    (tmp_path / "a").write_bytes(b"abc")
    assert (
        durable.sha256(tmp_path / "a")
        == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    )
