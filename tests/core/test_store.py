"""Stores: what is kept comes back, what is damaged is named, and without a folder nothing is kept."""

from __future__ import annotations

from enum import Enum
from pathlib import Path

import h5py
import numpy as np
import pytest

from fmbs_skfem.core.errors import CorruptFile
from fmbs_skfem.core.storage.container import FileKind
from fmbs_skfem.core.storage.records import dataclass
from fmbs_skfem.core.storage.store import Store

KIND = FileKind("fmbs_skfem work", "a part of the work", "make it again")


class State(Enum):
    """How far."""

    BEGUN = "begun"


@dataclass(frozen=True)
class Inner:
    """A part of a step."""

    matrix: np.ndarray


@dataclass(frozen=True)
class Step:
    """A step of the work."""

    state: State
    inner: tuple[Inner, ...]
    values: dict[int, float]
    next: int | None = None


STEP = Step(
    State.BEGUN, (Inner(np.asfortranarray(np.arange(6.0).reshape(2, 3))),), {7: 1 / 3, 11: np.inf}
)


def test_structs_and_plain_arrays_come_back(tmp_path: Path) -> None:
    """To the bit, with the order of memory; plain arrays by their names for other programs."""
    store = Store(tmp_path / "work", KIND, 3)
    store.append("step", None, STEP)
    store.append("rows-", 12, {"x": np.arange(3.0), "more": {"y": np.arange(2)}, "fact": "text"})
    found = store.read("step", None, Step)
    assert (found.state, found.values, found.next) == (STEP.state, STEP.values, None)
    assert found.inner[0].matrix.flags.f_contiguous
    np.testing.assert_array_equal(found.inner[0].matrix, STEP.inner[0].matrix)
    assert (store.path("step", None).name, store.there("step", None), store.numbers("step")) == (
        "step.h5",
        True,
        [],
    )
    assert store.path("rows-", 12) == tmp_path / "work" / "rows-012.h5"
    with h5py.File(store.path("rows-", 12)) as file:
        np.testing.assert_array_equal(file["x"], np.arange(3.0))
    rows = store.read("rows-", 12)
    assert (list(rows), rows["fact"]) == (["fact", "more", "x"], "text")


def test_files_are_numbered_replaced_and_forgotten(tmp_path: Path) -> None:
    store = Store(tmp_path, KIND, 1)
    for number in (12, 3, 3, 0):
        store.append("a-", number, {"x": np.zeros(number)})
    (tmp_path / "a-5.h5.part").touch()  # what a kill leaves
    (tmp_path / "a-b.h5").touch()
    assert store.numbers("a-") == [0, 3, 12]
    assert (store.there("a-", 12), store.there("a-", 5), store.numbers("b-")) == (True, False, [])
    store.forget("a-", 3)
    store.forget("a-", 3)
    store.forget("a-", but=12)
    for number in (1, 2, 4):
        store.append("step-", number, STEP)
    assert [one.next for one in store.series("step-", Step)] == [None, None]
    assert store.numbers("a-") == [12]


def test_what_is_missing_or_damaged_is_named(tmp_path: Path) -> None:
    store = Store(tmp_path, KIND)
    assert store.read("step-", 1, Step) is None
    with pytest.raises(
        CorruptFile, match=r"step-00001\.h5: expected the file, got none; make it again"
    ):
        store.read("step-", 1, Step, needed=True)
    store.append("step-", 1, STEP)
    with pytest.raises(
        CorruptFile,
        match=r"step-00001\.h5: content\.matrix: expected a value, got none; make it again",
    ):
        store.read("step-", 1, Inner)
    path = store.path("step-", 1)
    data = path.read_bytes()
    for k in (len(data) - 1, 500):  # of the last array, and of the spaces behind the first lines
        path.write_bytes(data[:k] + bytes([data[k] ^ 1]) + data[k + 1 :])
        with pytest.raises(
            CorruptFile, match=r"step-00001\.h5: expected (sha256|spaces behind its first lines)"
        ):
            store.read("step-", 1, Step)


def test_without_a_folder_nothing_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (store := Store(None, KIND)).append("step-", 1, STEP)
    Store(tmp_path, KIND).append("step-", 1, STEP)  # in the current folder, which is not meant
    assert store.read("step-", 1, Step) is None
    assert (store.numbers("step-"), store.there("step-", 1)) == ([], False)
    store.forget("step-")
    store.forget("step-", 1)
    assert [path.name for path in tmp_path.iterdir()] == ["step-00001.h5"]
