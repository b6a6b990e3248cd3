"""IGES 5.3 files: rational B-spline surfaces (entity 128), placed by transformations (124), in the
unit of the file.

    x_file -> R x + t       for the transformation of a surface, then for those that it names itself

A trimmed surface (144) or bounded one (143) is read where its outer boundary is that of the surface
itself, and refused with its place in the file else, as are all other surfaces, solids and copies.
Curves, points and drawings are passed over. Source: IGES 5.3 (US PRO/IPO-100, 1996): section 2.2
(file structure), and the entities 102, 110, 124, 126, 128, 142 to 144.
"""

from __future__ import annotations

import json
from dataclasses import field
from pathlib import Path
from typing import NoReturn

import numpy as np

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.problems import printable
from .exchange import Floats

#: flag of the Global section -> length of the unit [m]; flag 3 says its name
_UNITS = {
    1: 0.0254,
    2: 1e-3,
    4: 0.3048,
    5: 1609.344,
    6: 1.0,
    7: 1e3,
    8: 2.54e-5,
    9: 1e-6,
    10: 1e-2,
    11: 2.54e-8,
}
_NAMES = {
    "IN": 1,
    "INCH": 1,
    "MM": 2,
    "FT": 4,
    "MI": 5,
    "M": 6,
    "KM": 7,
    "MIL": 8,
    "UM": 9,
    "CM": 10,
    "UIN": 11,
}
#: entities that are or place surfaces, and are not read
_OTHERS = {
    114: "a parametric spline surface", 118: "a ruled surface", 120: "a surface of revolution", 122: "a tabulated cylinder",
    140: "an offset surface", 150: "a block", 152: "a wedge", 154: "a cylinder", 156: "a cone", 158: "a sphere", 160: "a torus",
    162: "a solid of revolution", 164: "a solid of extrusion", 168: "an ellipsoid", 180: "a Boolean tree",
    184: "an assembly of solids", 186: "a solid by its boundary", 190: "a plane surface", 192: "a cylindrical surface",
    194: "a conical surface", 196: "a spherical surface", 198: "a toroidal surface", 308: "a subfigure",
    408: "a copy of a subfigure", 412: "a rectangular array", 414: "a circular array", 416: "a reference to another file",
    430: "a copy of a solid", 510: "a face of a solid",
}  # fmt: skip
_REMEDY = "export untrimmed surfaces as NURBS (entity 128) in IGES 5.3"
_DEPTH = 20  #: transformations on one surface
#: of the range of parameters: a boundary this near to the edge of the surface is its edge
_CLOSE = 1e-6


@dataclass(frozen=True, eq=False)
class _Entity:
    """A directory entry with its parameters, the first of which is the number of its kind."""

    kind: int
    form: int
    matrix: int  #: the directory entry of its transformation, or 0
    values: list[str]
    line: int  #: number of its line in the directory section


@dataclass(eq=False)
class _IgesFile:
    where: str
    unit: float | None = None  #: [m]
    entities: dict[int, _Entity] = field(default_factory=dict)  #: by line of the directory section

    def refuse(self, at: int, expected: str, got: str, remedy: str = _REMEDY) -> NoReturn:
        raise InputError(
            say(f"{self.where}: directory line {at}" if at else self.where, expected, got, remedy)
        )

    def of(self, pointer: int, at: int) -> _Entity:
        if pointer not in self.entities:
            self.refuse(at, "the directory line of an entity", f"{pointer}", "export it again")
        return self.entities[pointer]


def read(path: Path, target: Path, where: str) -> None:
    """Write the surfaces as JSON, see `nurbs_file`."""
    file = _IgesFile(where)
    try:
        _parse(file, path.read_text(encoding="latin-1").splitlines())
        surfaces = [_surface(file, entity, outer) for entity, outer in _chosen(file)]
    except (IndexError, ValueError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            say(where, "an IGES file", str(error), "export the surfaces again as IGES 5.3")
        ) from None
    target.write_text(json.dumps({"unit": file.unit, "patches": surfaces}), encoding="utf-8")


# ------------------------------------------------------------------------------------------------------------- file structure
def _parse(file: _IgesFile, lines: list[str]) -> None:
    """Sections by the letter in column 73; other text, and compressed or binary files, have none."""
    sections: dict[str, list[str]] = {letter: [] for letter in "SGDPT"}
    for line in lines:
        letter = line[72:73]
        if letter not in sections:
            if line.strip():
                raise InputError(
                    say(
                        file.where,
                        "an IGES file in text, lines of 80 columns",
                        repr(line[:40]),
                        _REMEDY,
                    )
                )
            continue
        sections[letter].append(line)
    if not sections["D"]:
        raise InputError(say(file.where, "an IGES file with a directory section", "none", _REMEDY))
    marks = _global(file, "".join(line[:72] for line in sections["G"]))
    for at in range(0, len(sections["D"]) - 1, 2):
        first, second = sections["D"][at : at + 2]
        fields = [first[i : i + 8].strip() for i in range(0, 64, 8)]
        start, count = int(fields[1]), int(second[24:32].strip() or 1)
        text = "".join(line[:64].ljust(64) for line in sections["P"][start - 1 : start - 1 + count])
        entity = _Entity(
            int(fields[0]),
            int(second[32:40].strip() or 0),
            abs(int(fields[6] or 0)),
            _words(text, *marks),
            at + 1,
        )
        if not entity.values or int(entity.values[0]) != entity.kind:
            file.refuse(
                at + 1, f"parameters of an entity {entity.kind}", repr(text[:20]), "export it again"
            )
        file.entities[at + 1] = entity


def _global(file: _IgesFile, text: str) -> tuple[str, str]:
    """Delimiters of parameters and of records; the unit [m] goes into the file."""
    marks = [",", ";"]
    for i in (0, 1):
        if text.startswith("1H"):
            marks[i], text = text[2], text[3:]
        text = text[1:]
    words = _words(text, *marks)
    words += [""] * (13 - len(words))
    scale = words[10]
    flag = words[11]
    name = words[12].strip().upper()
    if scale and _number(scale) != 1.0:
        raise InputError(
            say(
                f"{file.where}: global section",
                "a model scale of 1",
                scale,
                "export it in real size",
            )
        )
    number = int(flag) if flag else 0
    number = _NAMES.get(name, 3) if number == 3 else number
    if number and number not in _UNITS:
        got = f"flag {number}" + (f" with the name '{printable(name)}'" if name else "")
        raise InputError(
            say(
                f"{file.where}: global section", "a unit of length", got, "export it in millimetres"
            )
        )
    file.unit = _UNITS.get(number)
    return marks[0], marks[1]


def _words(text: str, comma: str, end: str) -> list[str]:
    """The parameters of one record; texts are written as their length, H, and themselves."""
    words: list[str] = []
    at = 0
    while at < len(text):
        stop = at
        while stop < len(text) and text[stop] not in (comma, end):
            if text[stop] == "H" and text[at:stop].strip().isdigit():
                length = int(text[at:stop])
                words.append(text[stop + 1 : stop + 1 + length])
                stop += 1 + length
                break
            stop += 1
        else:
            words.append(text[at:stop].strip())
        while stop < len(text) and text[stop] not in (comma, end):  # blanks behind a text
            stop += 1
        if text[stop : stop + 1] in (end, ""):
            break
        at = stop + 1
    return words


def _number(word: str) -> float:
    return float(word.upper().replace("D", "E")) if word else 0.0


# ------------------------------------------------------------------------------------------------------------------- surfaces
def _chosen(file: _IgesFile) -> list[tuple[_Entity, _Entity | None]]:
    """Surfaces to be read, each with the trimmed one that it is the whole of."""
    found: list[tuple[_Entity, _Entity | None]] = []
    held: set[int] = set()
    for entity in file.entities.values():
        what = _OTHERS.get(entity.kind) or (
            "a bounded plane" if entity.kind == 108 and entity.form else ""
        )
        if what:
            file.refuse(
                entity.line,
                "rational B-spline surfaces (entity 128)",
                f"entity {entity.kind}, {what}",
            )
        if entity.kind in (143, 144):
            inner = _trimmed(file, entity)
            held.add(inner.line)
            found.append((inner, entity))
    found += [
        (entity, None)
        for entity in file.entities.values()
        if entity.kind == 128 and entity.line not in held
    ]
    return sorted(found, key=lambda pair: pair[0].line)


def _trimmed(file: _IgesFile, entity: _Entity) -> _Entity:
    """The surface of which a trimmed one is the whole; others are refused."""
    values = [int(_number(word)) for word in entity.values[1:]]
    bounded = entity.kind == 143
    surface = file.of(values[1] if bounded else values[0], entity.line)
    if surface.kind != 128:
        file.refuse(
            entity.line,
            "a rational B-spline surface (entity 128) below it",
            f"entity {surface.kind}",
        )
    holes, outer = (values[2], values[2]) if bounded else (values[2], values[1])
    what = "bounded" if bounded else "trimmed"
    if (holes and not bounded) or (
        outer and (bounded or not _is_whole(file, surface, file.of(values[3], entity.line)))
    ):
        got = f"entity {entity.kind}, a {what} one" + (
            f" with {holes} holes" if holes and not bounded else ""
        )
        file.refuse(entity.line, "untrimmed surfaces", got)
    return surface


def _is_whole(file: _IgesFile, surface: _Entity, boundary: _Entity) -> bool:
    """Whether a curve on a surface (142) runs once around its parameters: every piece on one side,
    the area that of all.
    """
    if boundary.kind != 142 or not int(_number(boundary.values[3])):
        return False
    low, high = _ranges(surface).T
    pieces = _pieces(file, file.of(int(_number(boundary.values[3])), boundary.line), 0)
    for piece in pieces:
        near = [np.abs(piece - side) <= _CLOSE * (high - low) for side in (low, high)]
        if not any(side.all(axis=0).any() for side in near):
            return False
    x, y = np.concatenate([np.zeros((0, 2)), *pieces]).T
    area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))
    return abs(area - float(np.prod(high - low))) <= 4 * _CLOSE * float(np.prod(high - low))


def _pieces(file: _IgesFile, curve: _Entity, depth: int) -> list[Floats]:
    """Points (i, 2), in the plane of the parameters, between which the lines and splines of a
    boundary lie.
    """
    numbers = [_number(word) for word in curve.values[1:]]
    if curve.kind == 102 and depth < _DEPTH:
        parts = [file.of(int(pointer), curve.line) for pointer in numbers[1 : 1 + int(numbers[0])]]
        return [piece for part in parts for piece in _pieces(file, part, depth + 1)]
    if curve.kind == 110:
        return [np.array([numbers[0:2], numbers[3:5]])]
    if curve.kind == 106 and curve.form in (1, 11, 63):
        points = np.array(numbers[3 : 3 + 2 * int(numbers[1])]).reshape(-1, 2)
        return list(np.stack([points[:-1], points[1:]], axis=1))
    if curve.kind == 126:
        k, degree = int(numbers[0]), int(numbers[1])
        start = 6 + (k + degree + 2) + (k + 1)
        points = np.array(numbers[start : start + 3 * (k + 1)]).reshape(k + 1, 3)[:, :2]
        return [points] if degree > 1 else list(np.stack([points[:-1], points[1:]], axis=1))
    return [np.full((1, 2), np.inf)]  # on no side


def _ranges(surface: _Entity) -> Floats:
    """The ranges (2, 2) of the parameters of a surface, its last four numbers that are used."""
    k1, k2, m1, m2 = (int(_number(word)) for word in surface.values[1:5])
    start = 10 + (k1 + m1 + 2) + (k2 + m2 + 2) + 4 * (k1 + 1) * (k2 + 1)
    return np.array([_number(word) for word in surface.values[start : start + 4]]).reshape(2, 2)


def _surface(file: _IgesFile, entity: _Entity, outer: _Entity | None) -> dict[str, object]:
    """Degrees, knots, control points (n1, n2, 3) and weights of an entity 128."""
    values = entity.values
    k1, k2, m1, m2 = (int(_number(word)) for word in values[1:5])
    counts = [k1 + m1 + 2, k2 + m2 + 2, (k1 + 1) * (k2 + 1), 3 * (k1 + 1) * (k2 + 1), 4]
    if min(k1, k2, m1, m2) < 1 or len(values) < 10 + sum(counts):
        file.refuse(
            entity.line,
            "a surface of as many numbers as it claims",
            f"{len(values)}",
            "export it again",
        )
    parts = np.split(
        np.array([_number(word) for word in values[10 : 10 + sum(counts)]]), np.cumsum(counts)[:-1]
    )
    knots = parts[:2]
    spans = np.array([[knot[m], knot[-1 - m]] for knot, m in zip(knots, (m1, m2), strict=True)])
    if np.any(np.abs(parts[4].reshape(2, 2) - spans) > _CLOSE * np.ptp(spans, axis=1)[:, None]):
        got = f"entity 128 of which the range {parts[4].tolist()} of its parameters is used"
        file.refuse(entity.line, "a whole surface", got)
    points = parts[3].reshape(k2 + 1, k1 + 1, 3).swapaxes(0, 1)
    for one in (entity, outer):
        points = _placed(file, points, one.matrix) if one is not None else points
    weights = parts[2].reshape(k2 + 1, k1 + 1).T
    item: dict[str, object] = {
        "degree": [m1, m2],
        "knots": [knot.tolist() for knot in knots],
        "control": points.tolist(),
    }
    return item if np.ptp(weights) == 0.0 else {**item, "weights": weights.tolist()}


def _placed(file: _IgesFile, points: Floats, pointer: int) -> Floats:
    """Points after a transformation, and after those that it has itself."""
    for _ in range(_DEPTH):
        if not pointer:
            return points
        entity = file.of(pointer, pointer)
        if entity.kind != 124:
            file.refuse(pointer, "a transformation (entity 124)", f"entity {entity.kind}")
        rows = np.array([_number(word) for word in entity.values[1:13]]).reshape(3, 4)
        points = points @ rows[:, :3].T + rows[:, 3]
        pointer = entity.matrix
    file.refuse(pointer, f"at most {_DEPTH} transformations on one another", "more")
