"""Kernels in C against the same kernels in Python: what the subset has, and what is refused."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from fmbs_skfem.core.algebra import small
from fmbs_skfem.core.compiling.jit import inlined, jit
from fmbs_skfem.core.compiling.structs import (
    Integers,
    Matrix,
    Vector,
    address_of,
    invoke,
    opener,
    packed,
    routine,
)
from fmbs_skfem.core.printing.memory import PackedMemory
from fmbs_skfem.core.printing.printer import KernelPrinter
from fmbs_skfem.core.printing.program import PrintedProgram, region
from fmbs_skfem.core.printing.values import ZERO, Const, OutsideError
from fmbs_skfem.exports.c_files import HEAD
from fmbs_skfem.exports.text import maths
from tests.exports.c_library import COMPILER, STRICT, compiled

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")


class Numbers(NamedTuple):
    x: Vector
    A: Matrix
    out: Vector
    table: Integers  #: addresses and places, which nobody writes
    count: Integers
    factor: float
    wanted: bool


opened = opener(Numbers)
KERNELS: dict[str, Any] = {}


def kernel(function: Callable[[Any, Any], int]) -> Any:
    """A routine that is compared."""
    KERNELS[function.__name__] = found = routine(function)
    return found


@inlined
def vector(x: np.ndarray, first: int) -> tuple[float, float, float]:
    """Three numbers of an array."""
    return x[first], x[first + 1], x[first + 2]


@jit
def turned(a: tuple[float, float, float], f: float) -> tuple[float, tuple[float, float]]:
    """A number and a tuple."""
    if f < 0.0:
        return 0.0, (a[0], f)
    return a[0] * f, (a[1], a[2] / f)


@jit
def rest(A: np.ndarray, k: int) -> np.ndarray:
    """What is behind a number of each row, by strides."""
    return A[:, k:]


@jit
def clear(x: np.ndarray) -> None:
    """x = 0."""
    for i in range(len(x)):
        x[i] = 0.0


@kernel
def numbers(table: Any, _: Any) -> int:
    """Sums, powers, choices, and whole numbers below zero."""
    S = opened(table)
    out = S.out
    low, high = 0, 0.0
    for i in range(len(S.x)):
        x = S.x[i]
        low = min(low, -i)
        high = max(high, abs(x)) if i % 2 == 0 else high
        out[i] = x**2 - 2.0 * x**0.5 if x > 0.0 and not S.wanted else x / 3
    out[0] += (low - 1) // 2 + (low - 1) % 4 + 7 // 2 + int(high) + float(low)
    out[1], out[2] = out[2], out[1]
    return low


@kernel
def tuples(table: Any, _: Any) -> int:
    """Several numbers from kernels, and names that take others."""
    S = opened(table)
    a = vector(S.x, 0)
    for k in range(2):
        p, (q, r) = turned(a, S.factor - 3.0 * k)
        S.out[k] = p + q - r
        a = (a[1], a[2], p) if k == 0 else a
    S.out[2] = a[2]
    return 0


@kernel
def unread(table: Any, more: Any) -> int:
    """A name that nobody reads: loops inside of each other, results of several kinds."""
    S = opened(table)
    rounds = 0
    for _ in range(2):
        for _ in range(3):
            S.out[rounds], _ = turned(vector(S.x, 1), 2.0 + rounds)
            rounds += 1
    _, _, S.out[0] = vector(S.x, 0)
    return rounds


@kernel
def slices(table: Any, _: Any) -> int:
    """Rows, columns, parts, and arrays of the kernel itself."""
    S = opened(table)
    room = np.zeros((2, 3))
    part = rest(S.A, 1)
    for i in range(len(part)):
        for j in range(part.shape[1]):
            room[j % 2, i] += part[i, j]
    S.out[:3] = room[0]
    S.out[3:5] = room[1, 1:]
    clear(S.A[1])
    S.A[0, -1] = S.A[:, 1][2]
    for x in S.x:
        S.out[5] += x
    return len(part)


@kernel
def complex_numbers(table: Any, _: Any) -> int:
    """A complex step."""
    S = opened(table)
    w = np.zeros(2, np.complex128)
    w[0] = complex(S.x[1], 1e-30)
    w[1] = w[0] * w[0] / (w[0] + 1.0) - 2.0 * np.sqrt(w[0] * w[0] + 1.0)
    S.out[0], S.out[1] = w[1].real, w[1].imag / 1e-30
    S.out[2] = abs(w[0].conjugate())
    return 0


@kernel
def counted(table: Any, more: Any) -> int:
    """Called by its address."""
    S = opened(table)
    S.count[0] += more
    return S.count[0]


@kernel
def called(table: Any, _: Any) -> int:
    """A loop over addresses, which is written out; one that is zero is left out."""
    S = opened(table)
    total = 0
    for k in range(2):
        if S.table[k] != 0:
            total += invoke(S.table[k], table, 5 + k)
    while total < 100:
        total = total * 2
        if total == 40:
            break
    return total


@kernel
def products(table: Any, _: Any) -> int:
    """Products, and a search."""
    S = opened(table)
    found = np.dot(S.A.T, S.A)
    other = np.dot(S.A, found)
    S.out[0], S.out[1] = found[1, 2], other[2, 1]
    return int(np.searchsorted(S.x[:2], 0.7, "right"))


def packed_numbers() -> tuple[Numbers, np.ndarray]:
    """A struct, and its integers."""
    A = np.array([[1.0, 2.0, 3.0], [0.5, -1.0, 4.0], [2.0, 7.0, -3.0]])
    found = Numbers(
        np.array([0.5, 0.7, 2.0, -1.5, 4.0, 0.25]),
        A,
        np.zeros(6),
        np.array([0, counted.address]),
        np.zeros(1, np.int64),
        1.5,
        False,
    )
    return found, packed(found)


@pytest.fixture(scope="module")
def in_c(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[int, np.ndarray]]:
    """What a kernel returns in C, and all that it writes."""
    _, integers = given = packed_numbers()
    functions = {counted.address: counted}
    memory = PackedMemory({"out", "count", "A"})
    memory.add(Numbers, address_of(integers))
    printer = KernelPrinter(memory, functions, small.STANDS, small.PRODUCTS)
    calls = []
    for name, one in KERNELS.items():
        more = Const(2) if name == "counted" else ZERO
        found = printer.entry(one, [memory.pointer(address_of(integers)), more])
        calls.append(f"long long call_{name}(NAME_memory *m) {{ return {found.name}(m); }}")
    own = f"double *outs(NAME_memory *m) {{ return {region('out')}; }}"
    own += f"double *of_A(NAME_memory *m) {{ return {region('A')}; }}"
    program = PrintedProgram(printer, own)
    constants, starts = program.starts()
    parts = (
        HEAD,
        program.constants,
        constants,
        "typedef struct {",
        program.declared,
        "} NAME_memory;",
    )
    text = "\n".join(
        [*parts, program.structs, maths(program.code), program.code, program.own, *calls]
    )
    text += f"\nvoid begin(NAME_memory *m) {{\n{starts}\n}}\nint size(void) {{ return sizeof(NAME_memory); }}"
    folder = tmp_path_factory.mktemp("printed")
    library = compiled(folder, [text.replace("NAME", "model")], "kernels", STRICT)
    library.outs.restype = library.of_A.restype = ctypes.POINTER(ctypes.c_double)

    def run(name: str) -> tuple[int, np.ndarray]:
        room = ctypes.create_string_buffer(library.size())
        library.begin(room)
        call = getattr(library, f"call_{name}")
        call.restype = ctypes.c_longlong
        result = int(call(room))
        arrays = (
            np.ctypeslib.as_array(library.outs(room), (6,)),
            np.ctypeslib.as_array(library.of_A(room), (9,)),
        )
        return result, np.concatenate(arrays)

    assert given  # its memory is read until the text is there
    return run


@pytest.mark.parametrize("name", KERNELS)
def test_kernels_give_the_same_in_c(name: str, in_c: Any) -> None:
    found, integers = packed_numbers()
    result = KERNELS[name](integers, 2 if name == "counted" else 0)
    got, numbers_in_c = in_c(name)
    assert got == result
    np.testing.assert_allclose(
        numbers_in_c, np.concatenate([found.out, found.A.ravel()]), rtol=4e-15, atol=1e-15
    )


@routine
def grows(table: Any, more: Any) -> int:
    """An array of a size that is known when it runs."""
    S = opened(table)
    room = np.zeros(S.count[0])
    return len(room)


@routine
def lists(table: Any, more: Any) -> int:
    """A list of Python."""
    S = opened(table)
    return len([x for x in S.x])  # noqa: C416


@routine
def moves(table: Any, more: Any) -> int:
    """A row that is changed as a whole."""
    S = opened(table)
    S.A[1] += 1.0
    return 0


@routine
def names(table: Any, more: Any) -> int:
    """An argument by its name."""
    return len(np.zeros(3, dtype=np.int64))


@routine
def searches(table: Any, more: Any) -> int:
    """What follows a loop that nothing left."""
    for x in opened(table).x:
        if x > 0.0:
            break
    else:
        return 1
    return 0


@routine
def counts(table: Any, more: Any) -> int:
    """A number that counts a loop, and is another one behind it."""
    S = opened(table)
    for k in range(3):
        S.out[k] = 0.0
    k = S.x[0]
    return int(k)


@pytest.mark.parametrize(
    ("kernel", "why"),
    [
        (grows, "the size of an array"),
        (lists, "ListComp has no C"),
        (moves, "an array that is changed as a whole"),
        (names, "'dtype' by its name"),
        (counts, "'k' counts a loop, and is a double"),
        (searches, "what follows a loop"),
    ],
)
def test_what_is_outside_of_the_subset_is_told_with_its_place(kernel: Any, why: str) -> None:
    found, integers = packed_numbers()
    memory = PackedMemory({"count"})
    memory.add(Numbers, address_of(integers))
    printer = KernelPrinter(memory, {}, small.STANDS, small.PRODUCTS)
    with pytest.raises(OutsideError, match=rf"test_printer\.py:\d+: {why}"):
        printer.entry(kernel, [memory.pointer(address_of(integers)), ZERO])
    assert found


def factors(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """A matrix as LAPACK has it, and the dense one that it stands for."""
    rng = np.random.default_rng(3)
    n, d = 7, 2
    A = rng.standard_normal((n, n))
    if kind in ("potrf", "pbtrf"):
        A = A @ A.T + n * np.eye(n)
    if kind in ("pbtrf", "gbtrf"):
        A = np.where(np.abs(np.subtract.outer(range(n), range(n))) <= d, A, 0.0)
    if kind == "getrf":
        return A.T.copy(), A
    if kind == "gbtrf":
        band = np.zeros((n, 3 * d + 1))
        for j in range(n):
            for i in range(max(0, j - d), min(n, j + d + 1)):
                band[j, 2 * d + i - j] = A[i, j]
        return band, A
    width = n if kind == "potrf" else d + 1
    half = np.zeros((n, width + (kind == "potrf")))
    for j in range(n):
        for i in range(j, min(n, j + width)):
            half[j, i - j] = A[i, j]
    return half, A


@pytest.mark.parametrize("kind", ["potrf", "pbtrf", "getrf", "gbtrf"])
def test_small_factors_are_those_of_lapack(kind: str) -> None:
    from fmbs_skfem.core.compiling import lapack

    pivots = np.zeros(7, np.int32), np.zeros(7, np.int32)
    more = {"getrf": (), "gbtrf": (2, 2)}.get(kind)
    results = []
    for one, mine in zip((lapack, small), pivots, strict=True):
        stored, A = factors(kind)
        arguments = (*(more or ()), *(() if more is None else (mine,)))
        assert getattr(one, kind)(lapack.ADDRESSES, stored, *arguments) == 0
        results.append(stored)
    np.testing.assert_array_equal(*pivots)
    np.testing.assert_allclose(results[1], results[0], rtol=1e-12, atol=1e-13)
    if more is not None:
        b = np.arange(7.0)[None, :].copy()
        solve = small.getrs if kind == "getrf" else small.gbtrs
        assert solve(lapack.ADDRESSES, results[1], *more, pivots[1], b) == 0
        np.testing.assert_allclose(A @ b[0], np.arange(7.0), atol=1e-12)
