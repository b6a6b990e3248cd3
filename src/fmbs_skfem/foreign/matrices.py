r"""Stiffness, mass and damping of other programs: entries by unknowns, (node, x, y or z) or numbers.

| program | file | by |
|---|---|---|
| any | Matrix Market, `.mtx` | numbers |
| SciPy | `.npz` of `scipy.sparse.save_npz` | numbers |
| Abaqus `*MATRIX GENERATE`, `*MATRIX OUTPUT` | `.mtx`, MATRIX INPUT or LABELS (node, dof, node, dof, value) | labels |
| the same, COORDINATE | `.mtx`, (row, column, value) | numbers |
| Nastran `DMIG`, of EXTSEOUT or a punch file | `.pch`, `.bdf`, `.dmig` | labels |
| CalculiX `*FREQUENCY, SOLVER=MATRIXSTORAGE` | `.sti`, `.mas`, with `.dof` beside them | labels |

Of a symmetric matrix most of them write one half, which is mirrored. Sources: Abaqus Analysis
User's Guide, "Generating matrices"; MSC Nastran Quick Reference Guide, "DMIG"; G. Dhondt, CalculiX
CrunchiX User's Manual, "*FREQUENCY".
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.io import mmread
from scipy.sparse import coo_array, csr_array, load_npz, sparray

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from .exchange import Floats, Ints

TRANSLATIONS = 3  #: unknowns 1 to 3 of a node
CUT = "is it cut off?"
#: 1.0D+05 and 1.0+5, for 1.0E+05
EXPONENT = re.compile(r"(?<=[\d.])(?:[DdEe]?)([+-]\d+)$")


@dataclass(frozen=True, eq=False)
class LabelledMatrix:
    """A matrix, and what its unknowns are where the file says it."""

    matrix: csr_array  #: (i, i)
    labels: Ints | None = None  #: (i, 2) node and unknown 1 to 6 of it


def read(path: Path, where: str, name: str = "") -> LabelledMatrix:
    """The matrix of a file; of several in one (DMIG) the one that is called `name`, such as KAAX.

    InputError, after `where`, where the file is of no known kind, cut off, or not square.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(READERS)
        raise InputError(say(where, f"a file of a matrix ({known})", f"'{path.suffix}'"))
    try:
        found = reader(path, where, name)
    except (OSError, ValueError, zipfile.BadZipFile) as problem:
        if isinstance(problem, InputError):
            raise
        raise InputError(say(where, "a file of a matrix", f"{problem}", CUT)) from problem
    rows, columns = found.matrix.shape
    if rows != columns:
        raise InputError(say(where, "a square matrix", f"({rows}, {columns})"))
    return found


def read_rows(path: Path, where: str) -> csr_array:
    """A matrix (i, j) of Matrix Market or `scipy.sparse.save_npz`; InputError of anything else."""
    if path.suffix.lower() not in (".mtx", ".npz"):
        raise InputError(say(where, "a .mtx or .npz file", f"'{path.suffix}'"))
    try:
        found = mmread(path) if path.suffix.lower() == ".mtx" else load_npz(path)
    except (OSError, ValueError, zipfile.BadZipFile) as problem:
        raise InputError(say(where, "a file of a matrix", f"{problem}", CUT)) from problem
    return csr_array(coo_array(found))


def of_market(path: Path, where: str, _: str) -> LabelledMatrix:
    """Matrix Market, or what Abaqus writes with the same ending."""
    with path.open(encoding="utf-8", errors="replace") as file:
        first = file.readline()
    if not first.startswith("%%MatrixMarket"):
        return of_abaqus(path, where)
    found = mmread(path)
    return LabelledMatrix(csr_array(found if isinstance(found, sparray) else coo_array(found)))


def of_numpy(path: Path, where: str, _: str) -> LabelledMatrix:
    """A matrix of `scipy.sparse.save_npz`."""
    return LabelledMatrix(csr_array(load_npz(path)))


def of_abaqus(path: Path, where: str) -> LabelledMatrix:
    """Rows of five numbers (node, unknown, node, unknown, value) or three (row, column, value)."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    lines = [one for one in lines if one.strip() and not one.startswith("*")]
    if not lines:
        raise InputError(say(where, "numbers", "none"))
    width = len(re.split(r"[,\s]+", lines[0].strip().strip(",")))
    numbers = numbers_of(lines, width, where)
    if width == 3:
        place = numbers[:, :2].astype(np.int64) - 1
        return LabelledMatrix(
            mirrored(place[:, 0], place[:, 1], numbers[:, 2], int(place.max()) + 1)
        )
    if width != 5:
        expected = "node, unknown, node, unknown and value, or row, column and value, in every line"
        raise InputError(say(where, expected, f"{width} numbers"))
    return labelled(numbers[:, :2], numbers[:, 2:4], numbers[:, 4])


def numbers_of(lines: list[str], width: int, where: str) -> Floats:
    """Numbers (i, width) of lines; InputError where one has more or fewer."""
    text = " ".join(lines).replace(",", " ").replace("D", "E")
    numbers = np.array(text.split(), dtype=float)
    if len(numbers) != width * len(lines):
        got = f"{len(numbers)} in {len(lines)} lines"
        raise InputError(say(where, f"{width} numbers in every line", got, CUT))
    return numbers.reshape(-1, width)


def labelled(rows: Floats, columns: Floats, values: Floats) -> LabelledMatrix:
    """A matrix of values (z,) at unknowns (z, 2) and (z, 2)."""
    both = np.concatenate([rows, columns]).astype(np.int64)
    labels, place = np.unique(both, axis=0, return_inverse=True)
    i, j = np.split(place.ravel(), 2)
    return LabelledMatrix(mirrored(i, j, values, len(labels)), labels)


def mirrored(i: Ints, j: Ints, values: Floats, size: int) -> csr_array:
    """A matrix (size, size) of entries (z,); the other half of one that has one half alone."""
    A = csr_array(coo_array((values, (i, j)), shape=(size, size)))
    lower, upper = bool((i >= j).all()), bool((i <= j).all())
    if lower == upper:
        return A if lower or not one_sided(A) else csr_array(A + A.T - diagonal(A))
    return csr_array(A + A.T - diagonal(A))


def one_sided(A: csr_array) -> bool:
    """Whether of no pair of entries ij and ji both are there, in any order of the unknowns."""
    off = A - diagonal(A)
    off.eliminate_zeros()
    return bool(off.nnz) and not (abs(off).multiply(abs(off.T))).nnz


def diagonal(A: csr_array) -> csr_array:
    k = np.arange(A.shape[0])
    return csr_array((A.diagonal(), (k, k)), shape=A.shape)


def of_nastran(path: Path, where: str, name: str) -> LabelledMatrix:
    """The matrix that is called `name` among DMIG cards, by default the only one."""
    found = dict[str, list[tuple[int, int, int, int, float]]]()
    at = "", 0, 0
    with path.open(encoding="utf-8", errors="replace") as file:
        for text in file:
            line = text.rstrip("\n")
            if line.upper().startswith("DMIG"):
                called, node, unknown, *rest = fields_of(line)
                if node == "0":
                    form = int(rest[0] if unknown == "" else unknown)
                    if form not in (1, 6):
                        raise InputError(say(where, f"a square {called} (form 1 or 6)", form))
                    found[called] = []
                    continue
                at = called, int(node), int(unknown or 0)
                entries = rest[1:] if not line[:8].rstrip().endswith("*") else []
            elif line[:1] in ("*", "+", " ") and at[0] and line.strip():
                entries = fields_of(line)
            else:
                at = "", 0, 0
                continue
            for k in range(0, len(entries) - 2, 4):
                node, unknown, value = entries[k : k + 3]
                if node:
                    found[at[0]].append((*at[1:], int(node), int(unknown or 0), real(value)))
    names = [one for one in found if not name or one.upper() == name.upper()]
    if len(names) != 1:
        expected = f"the matrix {name}" if name else "one matrix, or the name of one"
        raise InputError(say(where, expected, ", ".join(found) or "no DMIG card"))
    numbers = np.array(found[names[0]], dtype=float)
    if not len(numbers):
        raise InputError(say(where, f"entries of {names[0]}", "none", CUT))
    return labelled(numbers[:, 2:4], numbers[:, :2], numbers[:, 4])


def fields_of(line: str) -> list[str]:
    """The fields of a card behind its first one: of 8 letters, of 16 where that ends in a star."""
    if "," in line:
        return [one.strip() for one in line.split(",")[1:]]
    width = 16 if "*" in line[:8] else 8
    body = line[8:72]
    return [body[k : k + width].strip() for k in range(0, len(body), width)]


def real(text: str) -> float:
    """A number of Nastran, whose exponent may have no letter."""
    return float(EXPONENT.sub(r"E\1", text))


def of_calculix(path: Path, where: str, _: str) -> LabelledMatrix:
    """Rows of (row, column, value), of unknowns that the file `.dof` beside it lists as node.unknown."""
    lines = [one for one in path.read_text(encoding="utf-8").splitlines() if one.strip()]
    numbers = numbers_of(lines, 3, where)
    beside = path.with_suffix(".dof")
    if not beside.is_file():
        raise InputError(say(where, f"the file {beside.name} beside it", "none"))
    listed = [one.strip().split(".") for one in beside.read_text(encoding="utf-8").splitlines()]
    labels = np.array(
        [[int(node), int(unknown)] for node, unknown in (one for one in listed if len(one) == 2)]
    )
    place = numbers[:, :2].astype(np.int64) - 1
    if not len(labels) or place.max() >= len(labels):
        got = f"{len(labels)} for row {int(place.max()) + 1}"
        raise InputError(say(where, f"as many unknowns in {beside.name}", got, CUT))
    return LabelledMatrix(mirrored(place[:, 0], place[:, 1], numbers[:, 2], len(labels)), labels)


READERS: dict[str, Callable[[Path, str, str], LabelledMatrix]] = {
    ".mtx": of_market,
    ".npz": of_numpy,
    ".pch": of_nastran,
    ".bdf": of_nastran,
    ".dmig": of_nastran,
    ".sti": of_calculix,
    ".mas": of_calculix,
}


def by_nodes(found: LabelledMatrix, numbers: Ints, where: str) -> csr_array:
    """A matrix (3 n, 3 n) of labelled unknowns in the order of nodes with `numbers` (n,).

    InputError for rotations, modal coordinates, and nodes that lack a translation or are not known.
    """
    assert found.labels is not None
    nodes, unknowns = found.labels.T
    if (unknowns < 1).any():
        got = f"{int((unknowns < 1).sum())} scalar ones, as modal coordinates are"
        remedy = "export the matrices of the whole mesh, not those of a superelement"
        raise InputError(say(where, "unknowns of nodes", got, remedy))
    if (unknowns > TRANSLATIONS).any():
        turned = np.unique(nodes[unknowns > TRANSLATIONS])
        got = f"rotations at {len(turned)} nodes, the first of them {turned[0]}"
        remedy = "condense them in the program that made it, or take solid elements"
        raise InputError(say(where, "translations alone (unknowns 1 to 3)", got, remedy))
    order = np.argsort(numbers, kind="stable")
    place = order[np.minimum(np.searchsorted(numbers[order], nodes), len(numbers) - 1)]
    unknown = np.flatnonzero(numbers[place] != nodes)
    if len(unknown):
        got = f"node {nodes[unknown[0]]}, which is not among them"
        raise InputError(say(where, f"unknowns of the {len(numbers)} nodes", got))
    at = TRANSLATIONS * place + unknowns - 1
    count = np.bincount(place, minlength=len(numbers))
    if (held := np.flatnonzero((count > 0) & (count < TRANSLATIONS))).size:
        missing = np.setdiff1d([1, 2, 3], unknowns[place == held[0]])
        got = (
            f"{len(held)} nodes without one; node {numbers[held[0]]} lacks {'xyz'[missing[0] - 1]}"
        )
        remedy = "export the free body, without boundary conditions"
        raise InputError(say(where, "x, y and z of every node", got, remedy))
    A = coo_array(found.matrix)
    i, j = A.coords
    size = TRANSLATIONS * len(numbers)
    return csr_array(coo_array((A.data, (at[i], at[j])), shape=(size, size)))
