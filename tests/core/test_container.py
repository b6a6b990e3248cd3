"""HDF5 files that point outside of themselves, or claim what they do not hold, are refused."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from fmbs_skfem.core.storage import container

SECRET = np.arange(4.0)


def outside(path: Path) -> Path:
    """Another file, whose numbers nobody was asked to read."""
    with h5py.File(path.with_name("secret.h5"), "w") as file:
        file["x"] = SECRET
    path.with_name("secret.bin").write_bytes(SECRET.tobytes())
    return path


def soft(file: h5py.File, path: Path) -> None:
    file["y"] = SECRET
    file["x"] = h5py.SoftLink("/y")


def linked(file: h5py.File, path: Path) -> None:
    file["x"] = h5py.ExternalLink(str(path.with_name("secret.h5")), "/x")


def external(file: h5py.File, path: Path) -> None:
    file.create_dataset(
        "x", shape=(4,), dtype="f8", external=[(str(path.with_name("secret.bin")), 0, 32)]
    )


def virtual(file: h5py.File, path: Path) -> None:
    layout = h5py.VirtualLayout(shape=(4,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(path.with_name("secret.h5")), "x", shape=(4,))
    file.create_virtual_dataset("x", layout)


def claimed(file: h5py.File, path: Path) -> None:
    file.create_dataset("x", shape=(10**9,), dtype="f8", chunks=(10**6,))


def packed(file: h5py.File, path: Path) -> None:
    file.create_dataset("x", data=np.zeros(10**6), compression="gzip")


def texts(file: h5py.File, path: Path) -> None:
    file["x"] = "a text"


@pytest.mark.parametrize("make", [soft, linked, external, virtual, claimed, packed, texts])
def test_what_is_not_in_the_file_is_refused(
    make: Callable[[h5py.File, Path], None], tmp_path: Path
) -> None:
    path = outside(tmp_path / "file.h5")
    with h5py.File(path, "w") as file:
        make(file, path)
    with h5py.File(path, "r") as file, pytest.raises(ValueError, match="'x' "):
        container.array(file, "x")


def test_what_is_in_the_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "file.h5"
    with h5py.File(path, "w") as file:
        file["a/x"] = SECRET
        file.create_dataset("checked", data=SECRET, fletcher32=True)
    with h5py.File(path, "r") as file:
        np.testing.assert_array_equal(container.array(container.member(file, "a"), "x"), SECRET)
        np.testing.assert_array_equal(container.array(file, "checked"), SECRET)
        with pytest.raises(ValueError, match="not there"):
            container.array(file, "b")


@pytest.mark.parametrize(
    "values",
    [
        np.arange(6.0).reshape(2, 3)[:, ::2],
        np.arange(5),
        np.array([True, False]),
        np.zeros((0, 3)),
        np.arange(3, dtype=np.int32),
    ],
    ids=["columns", "integers", "booleans", "none", "shorts"],
)
def test_arrays_are_written_as_h5py_writes_them(values: np.ndarray) -> None:
    """To the byte."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file.create_dataset("x", data=values)
    assert bytes(container.image({"x": values})) == buffer.getvalue()
