"""Structs of one's own are stored as they are declared, and what does not fit its declaration is
named.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array

from fmbs_skfem.core.errors import CorruptFile, InputError
from fmbs_skfem.core.storage import container, validation
from fmbs_skfem.core.storage.container import FileKind, storable
from fmbs_skfem.core.storage.validation import Attributes, Indices, Inside, Number, Range, Reals

KIND = FileKind("a test", "a truss", "make it again")


@storable
@dataclass(frozen=True)
class Bars:
    """Bars between nodes."""

    ends: Annotated[np.ndarray, Indices("b 2", end="w", reach="c")]
    stiffness: Annotated[np.ndarray, Reals("b")]
    columns: Annotated[slice, Range("r", end="n")]
    modes: Annotated[np.ndarray, Reals("cb r")]
    spread: Annotated[csr_array | None, Reals("w n")] = None


@storable
@dataclass(frozen=True)
class Truss:
    """A struct of structs."""

    dim: Annotated[int, Attributes("c", among=(2, 3))]
    parts: Annotated[tuple[Bars, ...], Inside("c n")]
    x0: Annotated[np.ndarray, Reals("n")]
    mass: Annotated[np.ndarray | csr_array, Reals("n n")]
    scale: Annotated[float, Number(0.0)]
    names: Annotated[tuple[str, ...], Attributes("n")]
    grids: Annotated[dict[str, np.ndarray], Reals("*")]


BARS = Bars(np.array([[0, 2], [2, 4]]), np.ones(2), slice(1, 4), np.zeros((4, 3)))
TRUSS = Truss(
    2,
    (BARS,),
    np.zeros(6),
    csr_array(eye_array(6)),
    1.0,
    tuple("abcdef"),
    {"u": np.zeros(3), "v": np.zeros(0)},
)


def bars(**changes: Any) -> dict[str, Any]:
    return {"parts": (BARS, replace(BARS, **changes))}


def test_a_struct_comes_back(tmp_path: Path) -> None:
    spread = replace(BARS, spread=csr_array(eye_array(5, 6)), ends=np.array([[0, 3], [2, 3]]))
    path = container.write(tmp_path / "truss", KIND, truss=replace(TRUSS, parts=(BARS, spread)))
    found = container.read(path, KIND, truss=Truss)["truss"]
    assert (found.dim, found.scale, found.names, found.parts[0].columns) == (
        2,
        1.0,
        tuple("abcdef"),
        slice(1, 4),
    )
    np.testing.assert_array_equal(found.parts[1].ends, spread.ends)
    np.testing.assert_array_equal(found.parts[1].spread.toarray(), np.eye(5, 6))
    assert all(array.ctypes.data % 64 == 0 for array in (found.x0, found.parts[0].stiffness))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"dim": 4}, r"truss\.dim: expected 2 or 3, got 4"),
        ({"dim": "a"}, r"truss\.dim: expected an integer, got 'a'"),
        (
            {"x0": np.zeros((6, 1))},
            r"truss\.x0: expected an array of 1 axes, got an array \(6, 1\) of float64",
        ),
        (
            {"mass": np.eye(6, 5)},
            r"truss\.mass: expected an array \(6, 6\) of float64, got an array \(6, 5\)",
        ),
        (
            {"mass": np.eye(6, dtype=np.float32)},
            r"truss\.mass: expected an array \(6, 6\) of float64, got an array \(6, 6\) of float32",
        ),
        (
            {"mass": csr_array(np.full((6, 6), np.nan))},
            r"truss\.mass: expected finite numbers, got \[nan\] as number \[0\]",
        ),
        ({"scale": -1.0}, r"truss\.scale: expected a positive number, got -1"),
        ({"scale": np.inf}, r"truss\.scale: expected a positive number, got inf"),
        (
            {"names": ("a",)},
            r"truss\.x0: expected an array \(1,\) of float64|truss\.names: expected 6, got 1",
        ),
        ({"grids": {"u": np.zeros((1, 1))}}, r"truss\.grids\.u: expected an array of 1 axes"),
        (
            bars(ends=np.array([[0, 2], [2, 5]])),
            r"truss\.parts\[1\]\.ends: expected indices from 0 to 4, got 0 to 5",
        ),
        (
            bars(ends=np.array([[0, 2], [2, -1]])),
            r"truss\.parts\[1\]\.ends: expected indices from 0 to 4, got -1 to 2",
        ),
        (
            bars(ends=np.array([[0, 2]])),
            r"truss\.parts\[1\]\.ends: expected an array \(2, 2\) of int64",
        ),
        (bars(columns=slice(1, 9)), r"truss\.parts\[1\]\.columns: expected a range within 0 to 6"),
        (
            bars(columns=slice(1, 3)),
            r"truss\.parts\[1\]\.modes: expected an array \(4, 2\) of float64",
        ),
        (
            bars(spread=csr_array(eye_array(5, 5))),
            r"truss\.parts\[1\]\.spread: expected an array \(5, 6\) of float64",
        ),
    ],
)
def test_what_does_not_fit_is_named(changes: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = container.write(tmp_path / "truss", KIND, truss=replace(TRUSS, **changes))
    with pytest.raises(CorruptFile, match=message) as caught:
        container.read(path, KIND, truss=Truss)
    assert "make it again" in str(caught.value)


def test_what_is_no_struct_of_a_file_is_refused(tmp_path: Path) -> None:
    @dataclass(frozen=True)
    class Other:
        x: float = 1.0

    with pytest.raises(
        InputError,
        match=r"truss: expected numbers, texts, arrays, tuples, lists or dicts, got Other",
    ):
        container.write(tmp_path / "truss", KIND, truss=Other())
    with pytest.raises(CorruptFile, match="expected Truss under 'truss', got Run"):
        container.read(container.write(tmp_path / "run", KIND, truss=ALONE), KIND, truss=Truss)
    with pytest.raises(validation.Misfit, match=r"x\.run\.factors: expected a dict"):
        validation.build(Run, {"factors": 3}, "x.run")


@storable
@dataclass(frozen=True)
class Run:
    """A struct that is built of plain values."""

    factors: dict[str, float]


ALONE = Run({"a": 1.0})
