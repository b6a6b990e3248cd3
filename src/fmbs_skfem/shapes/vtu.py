"""VTK `.vtu` files (unstructured grids in XML) as plain arrays.

Groups are integer arrays of zeros and ones: an array `left` in PointData marks the points of the
point group `left`, an array `beam` in CellData the cells of the group `beam`: lines, triangles or
quads. Other arrays, and those whose names start with `vtk`, are not groups. Arrays are text or
binary, inline or appended (base64 or raw), plain or packed by zlib; nothing is unpacked beyond
`MAX_BYTES`. Format: VTK file formats,
https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
"""

from __future__ import annotations

import base64
import contextlib
import warnings
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.storage.records import dataclass
from ..core.values.problems import printable
from .msh import CURVED, MAX_COUNT, SOLID, Array, Ints, MshCells, Raw, bad

if TYPE_CHECKING:
    from xml.etree import ElementTree

MAX_BYTES = 64 * 2**20  #: unpacked size of one array

_TYPES = {
    f"{word}{8 * size}": f"{word[0].lower()}{size}"
    for word in ("Int", "UInt")
    for size in (1, 2, 4, 8)
}
_TYPES |= {"Float32": "f4", "Float64": "f8"}
_LINE, _TRIANGLE, _QUAD = 3, 5, 9
#: cell code of VTK -> name
_CELLS = {
    1: "vertex",
    2: "poly_vertex",
    _LINE: "line",
    4: "poly_line",
    _TRIANGLE: "triangle",
    8: "pixel",
    _QUAD: "quad",
    10: "tetra",
}
_CELLS |= {
    12: "hexahedron",
    13: "wedge",
    14: "pyramid",
    21: "line3",
    22: "triangle6",
    23: "quad8",
    24: "tetra10",
    25: "hexahedron20",
    26: "wedge15",
    27: "pyramid13",
    28: "quad9",
    29: "hexahedron27",
    35: "line4",
}


@dataclass(frozen=True, eq=False)
class _VtuFile:
    where: str
    root: ElementTree.Element
    appended: bytes  #: what follows the underscore
    raw: bool  #: appended bytes are raw, not base64
    order: str  #: byte order
    header: np.dtype[Any]  #: type of the sizes before binary arrays
    packed: bool


def read(path: Path, where: str) -> Raw:
    """The points, cells and groups of a `.vtu` file; `where` opens every error message."""
    file = _open(path.read_bytes(), where)
    piece, points, cells = _piece(file)
    xyz = (
        _array(file, piece.find("Points/DataArray"), 3 * points, "Points")
        .reshape(points, 3)
        .astype(np.float64)
    )
    arrays = {
        name: piece.find(f"Cells/DataArray[@Name='{name}']")
        for name in ("types", "offsets", "connectivity")
    }
    types = _array(file, arrays["types"], cells, "types").astype(np.int64)
    offsets = _array(file, arrays["offsets"], cells, "offsets").astype(np.int64)
    nodes = _array(
        file, arrays["connectivity"], int(offsets[-1]) if cells else 0, "connectivity"
    ).astype(np.int64)
    sizes = np.diff(offsets, prepend=0)
    if np.any(sizes < 0):
        raise bad(where, "offsets that rise", "others")
    marked = _groups(file, piece.find("CellData"), cells)

    def of(code: int, width: int) -> MshCells:
        rows = np.flatnonzero(types == code)
        if np.any(sizes[rows] != width):
            raise bad(where, f"offsets that rise by {width} at a {_CELLS[code]}", "others")
        groups = {
            name: np.flatnonzero(values[rows])
            for name, values in marked.items()
            if values[rows].any() or not values.any()
        }
        return MshCells(nodes[offsets[rows][:, None] + np.arange(-width, 0)], rows, groups)

    codes, counts = np.unique(types, return_counts=True)
    return Raw(
        points=xyz,
        numbers=np.arange(points),
        point_groups={
            name: np.flatnonzero(values)
            for name, values in _groups(file, piece.find("PointData"), points).items()
        },
        lines=of(_LINE, 2),
        triangles=of(_TRIANGLE, 3),
        quads=of(_QUAD, 4),
        kinds={
            _CELLS.get(int(code), f"VTK type {code}"): int(count)
            for code, count in zip(codes, counts, strict=True)
        },
        others={
            kind: of(code, int(sizes[np.argmax(types == code)]))
            for code in codes.tolist()
            if (kind := _CELLS.get(code, "")) in (*CURVED, *SOLID)
        },
    )


def marks(groups: dict[str, Ints], count: int) -> dict[str, Array]:
    """Groups as arrays of zeros and ones, as they are written."""
    arrays = {name: np.zeros(count, np.uint8) for name in groups}
    for name, members in groups.items():
        arrays[name][members] = 1
    return arrays


def _open(data: bytes, where: str) -> _VtuFile:
    """Parse the XML and check how the arrays are stored."""
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise bad(where, "plain XML", "a document type or entity declaration", "remove it")
    root, appended = _tree(data)
    if root is None or root.tag != "VTKFile":
        raise bad(where, "an XML file with root VTKFile", repr(data[:40]))
    for key, known in {
        "type": ("UnstructuredGrid",),
        "byte_order": ("LittleEndian", "BigEndian"),
        "header_type": ("UInt32", "UInt64"),
        "compressor": ("vtkZLibDataCompressor",),
    }.items():
        if root.get(key, known[0]) not in known:
            raise bad(
                where,
                f"{key} {' or '.join(known)}",
                f"{root.get(key)}",
                "export it so, as an unstructured grid",
            )
    text = (root.findtext("AppendedData") or "").strip()
    order = ">" if root.get("byte_order") == "BigEndian" else "<"
    header = np.dtype(order + ("u8" if root.get("header_type") == "UInt64" else "u4"))
    body = text[1:].encode() if appended is None else appended
    return _VtuFile(
        where, root, body, appended is not None, order, header, root.get("compressor") is not None
    )


def _tree(data: bytes) -> tuple[ElementTree.Element | None, bytes | None]:
    """The XML tree, and the appended bytes where they are raw (raw bytes are not XML)."""
    from xml.etree import ElementTree

    tag = data.find(b"<AppendedData")
    start = data.find(b">", tag)
    stop = data.rfind(b"</AppendedData>")
    raw = 0 <= tag < start < stop and b'"raw"' in data[tag:start]
    with contextlib.suppress(ElementTree.ParseError, LookupError, ValueError):
        if raw:
            return ElementTree.fromstring(data[: start + 1] + data[stop:]), data[
                data.find(b"_", start) + 1 : stop
            ]
        return ElementTree.fromstring(data), None
    return None, None


def _piece(file: _VtuFile) -> tuple[ElementTree.Element, int, int]:
    """The one piece, its number of points and of cells, if they are believable."""
    pieces = file.root.findall("UnstructuredGrid/Piece")
    if len(pieces) != 1:
        raise bad(file.where, "one Piece", f"{len(pieces)}", "merge the pieces before export")
    claims = []
    for name in ("NumberOfPoints", "NumberOfCells"):
        claim = pieces[0].get(name, "")
        if not (claim.isascii() and claim.isdigit() and len(claim) < 20) or int(claim) > MAX_COUNT:
            raise bad(file.where, f"{name} of at most {MAX_COUNT}", claim[:40] or "nothing")
        claims.append(int(claim))
    return pieces[0], claims[0], claims[1]


def _groups(file: _VtuFile, parent: ElementTree.Element | None, count: int) -> dict[str, Array]:
    """The arrays of zeros and ones, one number a point or cell."""
    found = {}
    for array in () if parent is None else parent.iter("DataArray"):
        name = printable(array.get("Name", ""))
        whole = array.get("type", "").startswith(("Int", "UInt")) and array.get(
            "NumberOfComponents", "1"
        ) in ("", "1")
        if whole and name and not name.startswith("vtk"):
            values = _array(file, array, count, f"array '{name}'")
            if np.all((values == 0) | (values == 1)):
                found[name] = values
    return found


def _array(file: _VtuFile, array: ElementTree.Element | None, count: int, what: str) -> Array:
    """The `count` numbers of a DataArray."""
    if array is None:
        if count:
            raise bad(file.where, f"{what} of {count} numbers", "no such array")
        return np.zeros(0)
    if array.get("type") not in _TYPES:
        raise bad(file.where, f"{what} of type {', '.join(_TYPES)}", f"type {array.get('type')}")
    kind = np.dtype(file.order + _TYPES[array.get("type", "")])
    try:
        if array.get("format", "ascii") == "ascii":
            with warnings.catch_warnings():
                warnings.simplefilter("error", DeprecationWarning)
                text = (array.text or "").strip()
                values = (
                    np.fromstring(text, kind.newbyteorder("="), sep=" ")
                    if text
                    else np.zeros(0, kind)
                )
        else:
            values = np.frombuffer(_bytes(file, array), kind)
    except (ValueError, OverflowError, IndexError, DeprecationWarning, zlib.error) as error:
        raise bad(file.where, f"readable {what}", f"{error}") from None
    if len(values) != count:
        raise bad(file.where, f"{what} of {count} numbers", f"{len(values)}")
    return values


def _bytes(file: _VtuFile, array: ElementTree.Element) -> bytes:
    """The bytes of a binary array; a header of sizes comes before them."""
    if array.get("format") == "appended":
        data = file.appended[int(array.get("offset", "")) :]
        raw = file.raw
    else:
        data = (array.text or "").strip().encode()
        raw = False

    def piece(start: int, stop: int) -> bytes:
        """Bytes of a stream that begins at `data`; it holds fewer where the file ends."""
        return (
            data[start:stop]
            if raw
            else base64.b64decode(data[: -(-stop // 3) * 4], validate=True)[start:stop]
        )

    width = file.header.itemsize
    first = int(np.frombuffer(piece(0, width), file.header)[0]) if data else 0
    if first > len(data) or first > MAX_BYTES:
        raise ValueError(f"a size of {first} in {len(data)} bytes")
    if not file.packed:
        return piece(width, width + first)
    if not first:
        return b""
    end = (3 + first) * width
    header = [int(size) for size in np.frombuffer(piece(0, end), file.header)]
    if len(header) != 3 + first:
        raise ValueError(f"the sizes of {first} packed blocks, which the file does not hold")
    data = data[end if raw else -(-end // 3) * 4 :]  # the blocks are a base64 stream of their own
    return _unpacked(piece(0, sum(header[3:])), header[1], header[3:])


def _unpacked(data: bytes, size: int, packed: list[int]) -> bytes:
    """Blocks of at most `size` bytes, unpacked one after another."""
    blocks: list[bytes] = []
    at = total = 0
    if size > MAX_BYTES:
        raise ValueError(f"blocks of {size} bytes, above {MAX_BYTES}")
    for length in packed:
        blocks.append(zlib.decompressobj().decompress(data[at : at + length], size + 1))
        at, total = at + length, total + len(blocks[-1])
        if len(blocks[-1]) > size or total > MAX_BYTES:
            raise ValueError(f"more than the {size} bytes a block, or {MAX_BYTES} in all")
    return b"".join(blocks)
