"""Legacy VTK `.vtk` files, versions 1 to 5.1, text and binary: unstructured, structured and
rectilinear grids, polygonal data.

Integer arrays of zeros and ones are groups, as in `.vtu`. Polylines become lines, strips triangles,
pixels quads. A structured grid of n = (nx, ny, nz) points, x fastest, has a cell between neighbours
along every axis with more than one point. Source: VTK file formats,
https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html
"""

from __future__ import annotations

from dataclasses import field
from pathlib import Path
from typing import Any, NoReturn
from urllib.parse import unquote

import numpy as np

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.problems import printable
from . import exchange
from .exchange import Floats, Ints

_TYPES = {
    "bit": "u1", "char": "i1", "signed_char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2", "int": "i4",
    "unsigned_int": "u4", "long": "i8", "unsigned_long": "u8", "vtkidtype": "i4", "float": "f4", "double": "f8",
}  # fmt: skip
_TYPES |= {
    f"vtktype{word}{8 * size}": f"{word[0]}{size}"
    for word in ("int", "uint")
    for size in (1, 2, 4, 8)
}
#: code of a cell -> kind and number of nodes
_KINDS = {
    1: ("vertex", 1), 3: ("line", 2), 5: ("triangle", 3), 9: ("quad", 4), 10: ("tetra", 4), 12: ("hexahedron", 8), 13: ("wedge", 6),
    14: ("pyramid", 5), 21: ("line3", 3), 22: ("triangle6", 6), 23: ("quad8", 8), 24: ("tetra10", 10), 28: ("quad9", 9),
    25: ("hexahedron20", 20), 26: ("wedge15", 15), 27: ("pyramid13", 13), 29: ("hexahedron27", 27),
}  # fmt: skip
_VERTICES, _POLYLINE, _STRIP, _POLYGON, _PIXEL = 2, 4, 6, 7, 8
#: words of polygonal data -> codes of their cells; they are counted in this order
_POLYDATA = {
    "VERTICES": _VERTICES,
    "LINES": _POLYLINE,
    "POLYGONS": _POLYGON,
    "TRIANGLE_STRIPS": _STRIP,
}
_STRUCTURED = ("STRUCTURED_POINTS", "STRUCTURED_GRID", "RECTILINEAR_GRID")
#: words of sections that such a data set has beside those of all
_OF_GRIDS = (
    "DIMENSIONS",
    "ORIGIN",
    "SPACING",
    "ASPECT_RATIO",
    "X_COORDINATES",
    "Y_COORDINATES",
    "Z_COORDINATES",
)
MOST_POINTS = 1_000_000  #: of a structured grid, whose few words may claim any number
_COMPONENTS = {
    "VECTORS": 3,
    "NORMALS": 3,
    "TENSORS": 9,
    "TENSORS6": 6,
    "GLOBAL_IDS": 1,
    "PEDIGREE_IDS": 1,
    "EDGE_FLAGS": 1,
}


def read(path: Path, target: Path, where: str) -> None:
    """Write the mesh of a file for `exchange.load`."""
    file = _VtkFile(where, path.read_bytes())
    title = file.line()
    if not title.startswith("# vtk DataFile Version"):
        file.refuse("a first line '# vtk DataFile Version ...'", repr(title[:40]))
    file.line(blank=True)
    coding = file.line().upper()
    dataset = file.line().upper().split()
    if coding not in ("ASCII", "BINARY") or dataset[:1] != ["DATASET"]:
        file.refuse("ASCII or BINARY, then DATASET", repr(f"{coding} {' '.join(dataset)}"[:60]))
    file.binary = coding == "BINARY"
    if dataset[1:] not in ([name] for name in (*_STRUCTURED, "UNSTRUCTURED_GRID", "POLYDATA")):
        file.refuse(
            f"a data set {', '.join(_STRUCTURED)}, UNSTRUCTURED_GRID or POLYDATA",
            repr(" ".join(dataset[1:])[:60]),
        )
    content = _VtkContent()
    while line := file.line():
        _section(file, content, line.split())
    if dataset[1] in _STRUCTURED:
        _fill_structured(file, content, dataset[1])
    exchange.save(_mesh(file, content), target)


def _fill_structured(file: _VtkFile, content: _VtkContent, dataset: str) -> None:
    """Points and cells that the dimensions stand for."""
    n = content.dimensions
    count = n[0] * n[1] * n[2]
    if not 1 < count <= MOST_POINTS:
        file.refuse(
            f"DIMENSIONS nx ny nz of 2 to {MOST_POINTS} points together", f"{n[0]} {n[1]} {n[2]}"
        )
    if dataset != "STRUCTURED_GRID":
        if dataset == "STRUCTURED_POINTS":
            axes = [
                x0 + h * np.arange(m)
                for x0, h, m in zip(content.origin, content.spacing, n, strict=True)
            ]
        else:
            axes = content.axes
        if [len(axis) for axis in axes] != n:
            file.refuse(
                f"{n[0]}, {n[1]} and {n[2]} coordinates as DIMENSIONS says",
                ", ".join(str(len(axis)) for axis in axes),
            )
        z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
        content.points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    if content.points is None or len(content.points) != count:
        found = 0 if content.points is None else len(content.points)
        file.refuse(f"{count} points as DIMENSIONS says", f"{found}")
    # (b, z, y, x): corners of a cell, then where it is
    corners = np.arange(count).reshape(n[::-1])[None]
    for axis in (3, 2, 1):
        if corners.shape[axis] > 1:
            low, high = np.moveaxis(corners, axis, 0)[:-1], np.moveaxis(corners, axis, 0)[1:]
            # a quadrilateral runs around: its second side goes back
            both = np.concatenate([low, high[:, ::-1] if corners.shape[0] == 2 else high], axis=1)
            corners = np.moveaxis(both, 0, axis)
    rows = corners.reshape(corners.shape[0], -1).T
    code = {2: 3, 4: 9, 8: 12}[rows.shape[1]]
    content.types = np.full(len(rows), code)
    content.cells = [(0, rows.shape[1] * np.arange(len(rows) + 1), rows.ravel())]


@dataclass(eq=False)
class _VtkContent:
    points: Floats | None = None
    #: code, or 0: see `types`; offsets (e+1,); nodes
    cells: list[tuple[int, Ints, Ints]] = field(default_factory=list)
    types: Ints | None = None
    #: nx, ny, nz of a structured grid
    dimensions: list[int] = field(default_factory=lambda: [0, 0, 0])
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    spacing: Floats = field(default_factory=lambda: np.ones(3))
    #: coordinates of a rectilinear grid
    axes: list[Floats] = field(default_factory=lambda: [np.zeros(0)] * 3)
    data: dict[str, dict[str, Any]] = field(
        default_factory=lambda: {"POINT_DATA": {}, "CELL_DATA": {}, "": {}}
    )
    active: str = ""  #: what the next arrays belong to
    count: int = 0  #: their length


@dataclass(eq=False)
class _VtkFile:
    where: str
    data: bytes
    at: int = 0
    binary: bool = False

    def line(self, blank: bool = False) -> str:
        """The next line that is not empty; none at the end."""
        while self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            text = self.data[self.at : end].decode("utf-8", errors="replace").strip()
            self.at = end + 1
            if text or blank:
                return text
        return ""

    def numbers(self, kind: str, count: int) -> Any:
        """The next `count` numbers of a type."""
        name = _TYPES.get(kind.lower())
        if name is None:
            self.refuse(
                f"arrays of numbers ({', '.join(_TYPES)})",
                f"one of type {printable(kind)}",
                "save it without this array",
            )
        size = np.dtype(name).itemsize
        if count < 0 or count * (size if self.binary and kind != "bit" else 1) > 8 * (
            len(self.data) - self.at
        ):
            self.refuse(
                f"{count} numbers as the file claims",
                f"its end {len(self.data) - self.at} bytes later",
            )
        if not self.binary:
            return self._text(name, count)
        width = -(-count // 8) if kind == "bit" else count * size
        block = self.data[self.at : self.at + width]
        if len(block) < width:
            self.refuse(f"{count} numbers as the file claims", f"its end after {len(block)} bytes")
        self.at += width
        if kind == "bit":
            return np.unpackbits(np.frombuffer(block, np.uint8))[:count]
        return np.frombuffer(block, np.dtype(name).newbyteorder(">")).astype(name)

    def _text(self, name: str, count: int) -> Any:
        words: list[bytes] = []
        while len(words) < count and self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            words += self.data[self.at : end].split()
            self.at = end + 1
        try:
            values = (
                np.array(words, dtype="S").astype(np.float64 if name.startswith("f") else np.int64)
                if words
                else np.zeros(0)
            )
        except (ValueError, OverflowError) as error:
            self.refuse("numbers", str(error))
        if len(values) != count:
            self.refuse(f"{count} numbers as the file claims", f"{len(values)}")
        return values

    def whole(self, word: str) -> int:
        if not (word.isascii() and word.isdigit() and len(word) < 12):
            self.refuse("a count", repr(word[:40]))
        return int(word)

    def triple(self, words: list[str]) -> Floats:
        try:
            return np.array([float(word) for word in words])
        except ValueError:
            self.refuse("three numbers", repr(" ".join(words)[:40]))

    def refuse(
        self, expected: str, got: str, remedy: str = "export it again, or as .msh 4.1"
    ) -> NoReturn:
        raise InputError(say(self.where, expected, got, remedy))


def _section(file: _VtkFile, content: _VtkContent, words: list[str]) -> None:
    """Read what stands behind the `words` of a line that begins a section."""
    name = words[0].upper()
    words = [*words, "", "", "", ""]
    if name == "METADATA":
        while file.line(blank=True):
            pass
    elif name == "POINTS":
        count = file.whole(words[1])
        content.points = file.numbers(words[2], 3 * count).reshape(count, 3).astype(np.float64)
    elif name in _OF_GRIDS:
        _of_grid(file, content, name, words)
    elif name == "CELLS" or name in _POLYDATA:
        content.cells.append(
            (_POLYDATA.get(name, 0), *_cells(file, file.whole(words[1]), file.whole(words[2])))
        )
    elif name == "CELL_TYPES":
        content.types = file.numbers("int", file.whole(words[1])).astype(np.int64)
    elif name in ("POINT_DATA", "CELL_DATA"):
        content.active, content.count = name, file.whole(words[1])
    elif name == "FIELD":
        for _ in range(file.whole(words[2])):
            _array_of_field(file, content)
    else:
        _attribute(file, content, name, words)


def _of_grid(file: _VtkFile, content: _VtkContent, name: str, words: list[str]) -> None:
    """What a structured grid says in place of its points and cells."""
    if name == "DIMENSIONS":
        content.dimensions = [file.whole(word) for word in words[1:4]]
    elif name == "ORIGIN":
        content.origin = file.triple(words[1:4])
    elif name in ("SPACING", "ASPECT_RATIO"):
        content.spacing = file.triple(words[1:4])
    else:
        axis = file.numbers(words[2], file.whole(words[1])).astype(np.float64)
        content.axes["XYZ".index(name[0])] = axis


def _cells(file: _VtkFile, first: int, second: int) -> tuple[Ints, Ints]:
    """Offsets (e+1,) and nodes; since version 5 as arrays of their own, before as rows of a size
    and its nodes.
    """
    start = file.at
    head = file.line().split()
    if head[:1] == ["OFFSETS"]:
        offsets = file.numbers([*head, ""][1], first).astype(np.int64)
        head = file.line().split()
        if head[:1] != ["CONNECTIVITY"]:
            file.refuse("CONNECTIVITY after OFFSETS", repr(" ".join(head)[:40]))
        nodes = file.numbers([*head, ""][1], second).astype(np.int64)
        offsets = offsets if len(offsets) else np.zeros(1, np.int64)
    else:
        file.at = start
        stream = file.numbers("int", second).astype(np.int64)
        starts = []
        at = 0
        for _ in range(first):
            starts.append(at)
            at += (
                1 + int(stream[at])
                if 0 <= at < len(stream) and stream[at] >= 0
                else len(stream) + 1
            )
        if at != len(stream):
            file.refuse(f"{first} cells in {second} numbers as the file claims", "others")
        nodes = np.delete(stream, starts)
        offsets = np.array([*starts, at]) - np.arange(first + 1)
    if offsets[0] != 0 or offsets[-1] != len(nodes) or np.any(np.diff(offsets) < 0):
        file.refuse("offsets of cells that rise from 0 to their number of nodes", "others")
    return offsets, nodes


def _array_of_field(file: _VtkFile, content: _VtkContent) -> None:
    """`name components tuples type`, perhaps after the METADATA of the array before."""
    words = file.line().split()
    while words[:1] == ["METADATA"]:
        _section(file, content, words)
        words = file.line().split()
    if len(words) != 4:
        file.refuse("an array as <name> <components> <tuples> <type>", repr(" ".join(words)[:60]))
    width, count = file.whole(words[1]), file.whole(words[2])
    _keep(content, words[0], file.numbers(words[3], width * count), width)


def _attribute(file: _VtkFile, content: _VtkContent, name: str, words: list[str]) -> None:
    """Arrays of POINT_DATA and CELL_DATA; tables of colours are passed over."""
    if name == "SCALARS":
        width = file.whole(words[3]) if words[3] else 1
        start = file.at
        if not file.line().upper().startswith("LOOKUP_TABLE"):
            file.at = start
    elif name == "LOOKUP_TABLE":
        file.numbers("unsigned_char" if file.binary else "float", 4 * file.whole(words[2]))
        return
    elif name == "COLOR_SCALARS":
        file.numbers(
            "unsigned_char" if file.binary else "float", content.count * file.whole(words[2])
        )
        return
    elif name == "TEXTURE_COORDINATES":
        width = file.whole(words[2])
        words[2] = words[3]
    elif name in _COMPONENTS:
        width = _COMPONENTS[name]
    else:
        file.refuse("a section of a legacy VTK file", repr(name[:40]))
    _keep(content, words[1], file.numbers(words[2], width * content.count), width)


def _keep(content: _VtkContent, name: str, values: Any, width: int) -> None:
    if width == 1:
        content.data[content.active][printable(unquote(name))] = values


def _mesh(file: _VtkFile, content: _VtkContent) -> exchange.Mesh:
    points = np.zeros((0, 3)) if content.points is None else content.points
    order = list(_POLYDATA.values())
    parts = sorted(content.cells, key=lambda part: order.index(part[0]) if part[0] else 0)
    codes = [np.full(len(offsets) - 1, code) for code, offsets, _ in parts]
    if content.types is not None and len(parts) == 1:
        codes = [content.types]
    if any(
        len(code) != len(offsets) - 1 for code, (_, offsets, _) in zip(codes, parts, strict=True)
    ):
        file.refuse("CELL_TYPES of as many cells as CELLS", "others")
    blocks: list[tuple[str, Ints, Ints]] = []
    first = 0
    for code, (_, offsets, nodes) in zip(codes, parts, strict=True):
        if len(nodes) and (nodes.min() < 0 or nodes.max() >= len(points)):
            file.refuse(
                f"cells on points 0 to {len(points) - 1}", f"{nodes.min()} to {nodes.max()}"
            )
        for each in np.unique(code).tolist():
            ids = np.flatnonzero(code == each)
            blocks += _blocks(
                file, each, ids + first, offsets[ids], offsets[ids + 1] - offsets[ids], nodes
            )
        first += len(code)
    owner = np.concatenate([np.zeros(0, np.int64), *(ids for _, _, ids in blocks)])
    marked = {
        name: np.isin(owner, ids) for name, ids in _marked(content.data["CELL_DATA"], first).items()
    }
    groups = {name: np.flatnonzero(found) for name, found in marked.items()}
    return exchange.gathered(
        points,
        np.arange(len(points)),
        blocks,
        _marked(content.data["POINT_DATA"], len(points)),
        groups,
    )


def _blocks(
    file: _VtkFile, code: int, ids: Ints, starts: Ints, sizes: Ints, nodes: Ints
) -> list[tuple[str, Ints, Ints]]:
    """Cells of one code as (kind, rows, number in the file), by size; longer ones fall into lines
    or triangles.
    """
    found = []
    for size in np.unique(sizes).tolist():
        of = sizes == size
        rows = nodes[starts[of][:, None] + np.arange(size)]
        own = ids[of]
        if code in (_POLYLINE, _VERTICES):
            width = 2 if code == _POLYLINE else 1
            pairs = (
                np.stack([rows[:, i : i + width] for i in range(size + 1 - width)], axis=1)
                if size >= width
                else rows[:0, None]
            )
            found.append(
                (
                    "line" if width == 2 else "vertex",
                    pairs.reshape(-1, width),
                    np.repeat(own, max(size + 1 - width, 0)),
                )
            )
        elif code == _STRIP:
            sides = [
                rows[:, [i, i + 1, i + 2] if i % 2 == 0 else [i + 1, i, i + 2]]
                for i in range(size - 2)
            ]
            found.append(
                ("triangle", np.stack(sides, axis=1).reshape(-1, 3), np.repeat(own, size - 2))
            )
        elif code == _POLYGON and size in (3, 4):
            found.append(("triangle" if size == 3 else "quad", rows, own))
        elif code == _PIXEL and size == 4:
            found.append(("quad", rows[:, [0, 1, 3, 2]], own))
        elif code in _KINDS and _KINDS[code][1] != size:
            file.refuse(
                f"{_KINDS[code][1]} nodes of a {_KINDS[code][0]}", f"{size} in cell {own[0]}"
            )
        else:
            kind = (
                _KINDS[code][0]
                if code in _KINDS
                else f"polygon of {size} sides"
                if code == _POLYGON
                else f"VTK type {code}"
            )
            found.append((kind, rows, own))
    return found


def _marked(data: dict[str, Any], count: int) -> exchange.Groups:
    """Arrays of zeros and ones as groups; names of VTK's own arrays begin with `vtk`."""
    found = {}
    for name, values in data.items():
        array = np.asarray(values)
        whole = np.issubdtype(array.dtype, np.integer) and array.ndim == 1 and len(array) == count
        if whole and not name.startswith("vtk") and np.all((array == 0) | (array == 1)):
            found[name] = np.flatnonzero(array)
    return found
