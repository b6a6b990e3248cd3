"""Gmsh `.msh` files, formats 2.2 and 4.1, text and binary, as plain arrays.

    node numbers (n,) -> points (n,3)        cells (e,b) in node numbers of the file        groups {name: members}

Numbers stay those of the file, so that an audit can name them. Every count that the file claims is
compared with the bytes left in it before anything is allocated. meshio writes these files but does
not read them here: it takes node number 0 for the last node, keeps one group of a cell that has
several, and trusts every count. Format: gmsh reference manual, section "MSH file format"; C.
Geuzaine, J.-F. Remacle, doi 10.1002/nme.2579.
"""

from __future__ import annotations

import mmap
import re
import shlex
import warnings
from dataclasses import field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..core import errors
from ..core.algebra.linalg import distinct
from ..core.storage.records import dataclass
from ..core.values.problems import printable

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Array = NDArray[Any]

MAX_COUNT = 1_000_000  #: nodes or cells of one file

_SECTION = re.compile(r"\$\w{1,80}", re.ASCII)
_NONE: Ints = np.zeros(0, np.int64)

#: element code of gmsh -> (name, nodes)
_ELEMENTS = {
    1: ("line", 2), 2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4), 5: ("hexahedron", 8), 6: ("wedge", 6), 7: ("pyramid", 5),
    8: ("line3", 3), 9: ("triangle6", 6), 10: ("quad9", 9), 11: ("tetra10", 10), 12: ("hexahedron27", 27), 13: ("wedge18", 18),
    14: ("pyramid14", 14), 15: ("vertex", 1), 16: ("quad8", 8), 17: ("hexahedron20", 20), 18: ("wedge15", 15),
    19: ("pyramid13", 13), 21: ("triangle10", 10), 23: ("triangle15", 15), 26: ("line4", 4), 27: ("line5", 5), 28: ("line6", 6),
    29: ("tetra20", 20), 36: ("quad16", 16), 37: ("quad25", 25),
}  # fmt: skip

#: surface cells of second order, which bound solids
CURVED = ("triangle6", "quad8", "quad9")
SOLID = (
    *("tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27"),
    *("wedge", "wedge15", "wedge18", "pyramid", "pyramid13", "pyramid14"),
)  #: cells of solids


@dataclass(frozen=True, eq=False)
class MshCells:
    """Cells of one type."""

    nodes: Ints  #: (e,b) node numbers of the file
    numbers: Ints  #: (e,) cell numbers of the file
    groups: dict[str, Ints]  #: name -> rows of `nodes`


@dataclass(frozen=True, eq=False)
class Raw:
    """What a mesh file says, before any audit."""

    points: Floats  #: (n,3) [m]
    numbers: Ints  #: (n,) node numbers of the file
    point_groups: dict[str, Ints]  #: name -> node numbers
    lines: MshCells
    triangles: MshCells
    quads: MshCells
    kinds: dict[str, int]  #: cell type -> how many
    #: half a unit of the last digit of the coordinates [m], see `meshes.resolution`
    resolution: float = 0.0
    others: dict[str, MshCells] = field(default_factory=dict)  #: cells of all other kinds
    #: Young's modulus, Poisson's ratio and density of groups of solid cells, in units of the file
    materials: dict[str, list[float]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Block:
    """Cells of one type: `nodes` (e,b) and, for each physical tag, the rows that carry it."""

    code: int
    numbers: Ints
    nodes: Ints
    tags: dict[int, Ints]


@dataclass
class _MshContent:
    names: dict[tuple[int, int], str] = field(default_factory=dict)
    entities: dict[tuple[int, int], list[int]] = field(default_factory=dict)
    nodes: list[tuple[Ints, Floats]] = field(default_factory=list)
    blocks: list[_Block] = field(default_factory=list)


@dataclass
class _Cursor:
    """Takes numbers one after another, in text as in binary, and never more than there are."""

    where: str
    data: Any  #: mapped bytes of the file
    at: int = 0  #: byte
    order: Literal["", "<", ">"] = ""  #: byte order; empty: text
    size: int = 8  #: bytes of a size_t
    text: Floats | None = None  #: numbers of the open text section
    taken: int = 0

    def line(self) -> str:
        end = self.data.find(b"\n", self.at)
        end = len(self.data) if end < 0 else end
        text = self.data[self.at : end]
        self.at = end + 1
        return str(text.decode("utf-8", errors="replace")).strip()

    def left(self) -> int:
        """Numbers left in a text section, bytes left in a binary file."""
        return len(self.text) - self.taken if self.text is not None else len(self.data) - self.at

    def take(self, kind: str, count: int) -> Array:
        """The next `count` numbers; kind i (int), n (size_t), d (double) or b (byte)."""
        dtype = np.dtype({"i": "i4", "n": f"u{self.size}", "d": "f8", "b": "u1"}[kind])
        width, of = (1, "numbers") if self.text is not None else (dtype.itemsize, "bytes")
        if count < 0 or count * width > self.left():
            got = f"{max(self.left(), 0)} {of} up to its end"
            raise bad(
                self.where,
                f"{count * width} {of} as its counts claim",
                got,
                "is it cut off, or its header damaged?",
            )
        if self.text is not None:
            values = self.text[self.taken : self.taken + count]
            self.taken += count
            return values if kind == "d" else _whole(self.where, values)
        start = self.at
        self.at = self.at + count * width
        values = np.frombuffer(self.data[start : self.at], dtype.newbyteorder(self.order or "="))
        return values.astype({"d": np.float64, "b": np.uint8}.get(kind, np.int64))

    def count(self, of: str, value: int) -> int:
        """A number of things claimed by the file, if it is believable."""
        if not 0 <= value <= min(MAX_COUNT, len(self.data)):
            most = f"at most {MAX_COUNT} {of}, and no more than fit into its {len(self.data)} bytes"
            raise bad(
                self.where, most, f"a claim of {value}" if value >= 0 else "a count that is none"
            )
        return value

    def open(self, name: str) -> None:
        """Start a section; a text section is turned into numbers at once."""
        self.text = None
        self.taken = 0
        if self.order:
            return
        end = self.end_of(name)
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)
            try:
                self.text = np.fromstring(self.data[self.at : end], sep=" ")
            except (ValueError, DeprecationWarning):
                raise bad(self.where, f"numbers in ${name}", "text that is none") from None

    def close(self, name: str) -> None:
        """Go behind the end of a section."""
        self.at = self.end_of(name)
        self.text = None
        self.line()

    def end_of(self, name: str) -> int:
        """Where a section ends."""
        end = self.data.find(b"$End" + name.encode(), self.at)
        if end < 0:
            raise bad(self.where, f"$End{name}", "the end of the file", "is it cut off?")
        return end


def read(path: Path, where: str) -> Raw:
    """The points, lines and groups of a `.msh` file; `where` opens every error message."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        cursor = _Cursor(where, data)
        content = _MshContent()
        version = _header(cursor)
        while cursor.at < len(data):
            line = cursor.line()
            if not line:
                continue
            if not _SECTION.fullmatch(line):
                raise bad(where, "a section that opens with $ and its name", repr(line[:40]))
            _section(cursor, content, version, line[1:])
    return _raw(content)


def bad(
    where: str, expected: str, got: str, remedy: str = "export the mesh again"
) -> errors.InputError:
    return errors.InputError(errors.say(where, expected, got, remedy))


def _whole(where: str, values: Floats) -> Ints:
    if not np.all(np.isfinite(values) & (values == np.rint(values)) & (np.abs(values) < 2.0**53)):
        raise bad(where, "whole numbers as counts, node numbers and tags", "others")
    return values.astype(np.int64)


def _header(cursor: _Cursor) -> int:
    """Read $MeshFormat; 2 or 4."""
    line = cursor.line()
    while line == "$Comments":
        cursor.close("Comments")
        line = cursor.line()
    words = cursor.line().split() if line == "$MeshFormat" else []
    if len(words) != 3 or words[1] not in ("0", "1"):
        raise bad(
            cursor.where,
            "a gmsh file, which opens with $MeshFormat",
            repr(line[:40]),
            "export it as .msh 2.2 or 4.1",
        )
    if words[0] not in ("2", "2.0", "2.1", "2.2", "4.1") or words[2] not in ("4", "8"):
        raise bad(
            cursor.where,
            "gmsh format 2.2 or 4.1",
            f"format {' '.join(words)}",
            "export it as .msh 4.1",
        )
    cursor.size = int(words[2])
    if words[1] == "1":
        cursor.order = "<"
        start = cursor.at
        if cursor.take("i", 1)[0] != 1:
            cursor.at = start
            cursor.order = ">"
            if cursor.take("i", 1)[0] != 1:
                raise bad(cursor.where, "the number 1 after a binary header", "another")
    cursor.close("MeshFormat")
    return int(words[0][0])


def _section(cursor: _Cursor, content: _MshContent, version: int, name: str) -> None:
    if name == "PhysicalNames":
        _physical_names(cursor, content)
    elif name == "Entities" and version == 4:
        _entities(cursor, content)
    elif name == "PartitionedEntities" and version == 4:
        _partitioned_entities(cursor, content)
    elif name == "Nodes":
        content.nodes += _nodes_4(cursor) if version == 4 else _nodes_2(cursor)
    elif name == "ParametricNodes" and version == 2:
        content.nodes += _parametric_nodes(cursor)
    elif name == "Elements":
        content.blocks += _elements_4(cursor, content) if version == 4 else _elements_2(cursor)
    cursor.close(name)


def _claimed(cursor: _Cursor, name: str, of: str) -> int:
    """Open a section of format 2 and read its count, which is text even in binary files."""
    if not cursor.order:
        cursor.open(name)
        return cursor.count(of, int(cursor.take("i", 1)[0]))
    line = cursor.line()
    return cursor.count(of, _number(line))


def _number(line: str) -> int:
    """A count written as text, or -1."""
    return int(line) if line.isascii() and line.isdigit() and len(line) < 20 else -1


def _physical_names(cursor: _Cursor, content: _MshContent) -> None:
    line = cursor.line()
    for _ in range(cursor.count("physical names", _number(line))):
        line = cursor.line()
        try:
            dimension, tag, name = shlex.split(line)
            content.names[int(dimension), int(tag)] = printable(name)
        except ValueError:
            raise bad(
                cursor.where, 'lines <dimension> <tag> "<name>" in $PhysicalNames', repr(line[:60])
            ) from None


def _entities(cursor: _Cursor, content: _MshContent) -> None:
    cursor.open("Entities")
    for dimension, entities in enumerate(cursor.take("n", 4)):
        for _ in range(cursor.count("entities", int(entities))):
            tag = int(cursor.take("i", 1)[0])
            cursor.take("d", 6 if dimension else 3)
            physical = cursor.take("i", int(cursor.take("n", 1)[0]))
            content.entities[dimension, tag] = [abs(int(p)) for p in physical]
            if dimension:
                cursor.take("i", int(cursor.take("n", 1)[0]))


def _partitioned_entities(cursor: _Cursor, content: _MshContent) -> None:
    """Pieces of entities in partitions, which nodes and cells belong to; each has the physical tags
    of the entity it is of.
    """
    cursor.open("PartitionedEntities")
    cursor.take("n", 1)
    cursor.take("i", 2 * cursor.count("ghost entities", int(cursor.take("n", 1)[0])))
    for dimension, entities in enumerate(cursor.take("n", 4)):
        for _ in range(cursor.count("entities", int(entities))):
            tag, _, _ = (int(v) for v in cursor.take("i", 3))
            cursor.take("i", int(cursor.take("n", 1)[0]))
            cursor.take("d", 6 if dimension else 3)
            physical = cursor.take("i", int(cursor.take("n", 1)[0]))
            content.entities[dimension, tag] = [abs(int(p)) for p in physical]
            if dimension:
                cursor.take("i", int(cursor.take("n", 1)[0]))


def _parametric_nodes(cursor: _Cursor) -> list[tuple[Ints, Floats]]:
    """Rows of a number, a point, dimension and tag of the entity it is on, and parameters, of
    curves one, of surfaces two.
    """
    count = _claimed(cursor, "ParametricNodes", "nodes")
    numbers, points = np.zeros(count, np.int64), np.zeros((count, 3))
    for i in range(count):
        numbers[i] = int(cursor.take("i", 1)[0])
        points[i] = cursor.take("d", 3)
        dimension = int(cursor.take("i", 2)[0])
        cursor.take("d", dimension if dimension in (1, 2) else 0)
    return [(numbers, points)]


def _nodes_2(cursor: _Cursor) -> list[tuple[Ints, Floats]]:
    count = _claimed(cursor, "Nodes", "nodes")
    if not cursor.order:
        table = cursor.take("d", 4 * count).reshape(count, 4)
        return [(_whole(cursor.where, table[:, 0]), table[:, 1:].copy())]
    record = np.dtype([("number", cursor.order + "i4"), ("point", cursor.order + "f8", (3,))])
    table = cursor.take("b", record.itemsize * count).view(record)
    return [(table["number"].astype(np.int64), table["point"].astype(np.float64))]


def _nodes_4(cursor: _Cursor) -> list[tuple[Ints, Floats]]:
    cursor.open("Nodes")
    blocks, total = (int(v) for v in cursor.take("n", 4)[:2])
    cursor.count("nodes", total)
    nodes = []
    for _ in range(cursor.count("blocks of nodes", blocks)):
        dimension, _, parametric = cursor.take("i", 3)
        count = cursor.count("nodes", int(cursor.take("n", 1)[0]))
        numbers = cursor.take("n", count)
        columns = 3 + (int(dimension) if parametric else 0)
        nodes.append(
            (numbers, cursor.take("d", columns * count).reshape(count, columns)[:, :3].copy())
        )
    if sum(len(numbers) for numbers, _ in nodes) != total:
        raise bad(
            cursor.where,
            f"{total} nodes as $Nodes claims",
            f"{sum(len(numbers) for numbers, _ in nodes)}",
        )
    return nodes


def _element(cursor: _Cursor, code: int) -> int:
    """The number of nodes of an element type."""
    if code not in _ELEMENTS:
        raise bad(
            cursor.where,
            "element types of gmsh up to order 5",
            f"code {code}",
            "export a mesh of line cells",
        )
    return _ELEMENTS[code][1]


def _tagged(tags: Ints) -> dict[int, Ints]:
    """Rows by physical tag; 0 means none."""
    return {int(tag): np.flatnonzero(np.abs(tags) == tag) for tag in distinct(np.abs(tags)) if tag}


def _elements_2(cursor: _Cursor) -> list[_Block]:
    count = _claimed(cursor, "Elements", "cells")
    if not cursor.order:
        return _elements_2_text(cursor, count)
    blocks = []
    done = 0
    while done < count:
        code, cells, tags = (int(v) for v in cursor.take("i", 3))
        if not 0 < cells <= count - done or tags < 0:
            raise bad(
                cursor.where,
                f"{count} cells as $Elements claims",
                f"a block of {cells} with {tags} tags after {done}",
            )
        nodes = _element(cursor, code)
        table = cursor.take("i", cells * (1 + tags + nodes)).reshape(cells, 1 + tags + nodes)
        physical = table[:, 1] if tags else np.zeros(cells, np.int64)
        blocks.append(_Block(code, table[:, 0], table[:, 1 + tags :], _tagged(physical)))
        done += cells
    return blocks


def _elements_2_text(cursor: _Cursor, count: int) -> list[_Block]:
    """Rows number, code, tags, ..., nodes: gathered by row shape."""
    values: Ints = cursor.take("i", cursor.left())
    stream: list[int] = values.tolist()
    shapes: dict[tuple[int, int], list[int]] = {}
    at = 0
    for _ in range(count):
        if at + 3 > len(stream):
            raise bad(cursor.where, f"{count} cells as $Elements claims", "fewer rows")
        code, tags = stream[at + 1], stream[at + 2]
        shapes.setdefault((code, tags), []).append(at)
        at += 3 + max(tags, 0) + _element(cursor, code)
    if at > len(stream) or any(tags < 0 for _, tags in shapes):
        raise bad(cursor.where, f"{count} cells as $Elements claims", "rows that are too short")
    blocks = []
    for (code, tags), starts in shapes.items():
        rows = values[np.array(starts)[:, None] + np.arange(3 + tags + _element(cursor, code))]
        physical = rows[:, 3] if tags else np.zeros(len(rows), np.int64)
        blocks.append(_Block(code, rows[:, 0], rows[:, 3 + tags :], _tagged(physical)))
    return blocks


def _elements_4(cursor: _Cursor, content: _MshContent) -> list[_Block]:
    cursor.open("Elements")
    claimed, total = (int(v) for v in cursor.take("n", 4)[:2])
    cursor.count("cells", total)
    blocks = []
    for _ in range(cursor.count("blocks of cells", claimed)):
        dimension, entity, code = (int(v) for v in cursor.take("i", 3))
        cells = cursor.count("cells", int(cursor.take("n", 1)[0]))
        nodes = _element(cursor, code)
        table = cursor.take("n", cells * (1 + nodes)).reshape(cells, 1 + nodes)
        physical = content.entities.get((dimension, entity), [])
        blocks.append(
            _Block(code, table[:, 0], table[:, 1:], {tag: np.arange(cells) for tag in physical})
        )
    if sum(len(block.numbers) for block in blocks) != total:
        raise bad(
            cursor.where,
            f"{total} cells as $Elements claims",
            f"{sum(len(block.numbers) for block in blocks)}",
        )
    return blocks


def _raw(content: _MshContent) -> Raw:
    kinds: dict[str, int] = {}
    for block in content.blocks:
        kinds[_ELEMENTS[block.code][0]] = kinds.get(_ELEMENTS[block.code][0], 0) + len(block.nodes)
    vertices = _cells(content, 15, 0)
    return Raw(
        points=np.concatenate([np.zeros((0, 3)), *(points for _, points in content.nodes)]),
        numbers=np.concatenate([_NONE, *(numbers for numbers, _ in content.nodes)]),
        point_groups={name: vertices.nodes[rows, 0] for name, rows in vertices.groups.items()},
        lines=_cells(content, 1, 1),
        triangles=_cells(content, 2, 2),
        quads=_cells(content, 3, 2),
        kinds=kinds,
        others={
            kind: _cells(content, code, 2 if kind in CURVED else 3)
            for code, (kind, _) in _ELEMENTS.items()
            if kind in kinds and kind in (*CURVED, *SOLID)
        },
    )


def _cells(content: _MshContent, code: int, dimension: int) -> MshCells:
    """All cells of one type; every physical name of their dimension is a group, also without
    members.
    """
    blocks = [block for block in content.blocks if block.code == code]
    groups: dict[str, list[Ints]] = {
        name: [] for (of, _), name in content.names.items() if of == dimension
    }
    first = 0
    for block in blocks:
        for tag, rows in block.tags.items():
            groups.setdefault(content.names.get((dimension, tag), f"tag_{tag}"), []).append(
                rows + first
            )
        first += len(block.nodes)
    return MshCells(
        nodes=np.concatenate(
            [np.zeros((0, _ELEMENTS[code][1]), np.int64), *(block.nodes for block in blocks)]
        ),
        numbers=np.concatenate([_NONE, *(block.numbers for block in blocks)]),
        groups={name: np.concatenate([_NONE, *parts]) for name, parts in groups.items()},
    )
