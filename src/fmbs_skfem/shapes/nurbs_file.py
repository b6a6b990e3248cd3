"""NURBS surfaces in files: JSON of this package, IGES, and 3dm with the extra `cad`
(`foreign.iges`, `foreign.rhino`).

    {"format": "fmbs-nurbs", "version": 1,
     "patches": [{"name": "roof",                                  optional; places are then `roof.xi1_min`, ...
                  "degree": [2, 1],
                  "knots": [[0, 0, 0, 1, 1, 1], [0, 0, 1, 1]],     open, not decreasing
                  "control": [[[x, y, z], ...], ...],              [m], n1 rows of n2 points of 2 or 3 coordinates
                  "weights": [[w, ...], ...]}],                    optional, n1 rows of n2 positive numbers
     "join": true,                                                 optional: whether sides that coincide are tied, see `surface`
     "points": {"tip": {"patch": "roof", "xi": [0.5, 1.0]}},       optional, knot parameters; one patch needs no "patch"
     "edges": {"rim": ["roof.xi1_min", "roof.xi1_max"]}}           optional

Named places are those of `nurbs.surface` and the ones of the file. Several patches without names
are patch1, patch2, ...
"""

from __future__ import annotations

import json
import re
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..core import remembered_files
from ..core.errors import InputError, closest, say
from ..core.storage.records import dataclass
from ..core.values.arguments import blamed
from ..core.values.problems import shown
from ..foreign import door
from . import line, nurbs, plate_audit
from .surface import Surface
from .table import Floats, Ints

FORMAT = "fmbs-nurbs"
VERSION = 1
MAX_BYTES = 64 * 2**20  #: size of a file
MAX_PATCHES = 1000
MAX_FUNCTIONS = 1_000_000  #: control points after refinement
MAX_DEGREE = 10

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
_Shape = tuple[nurbs.Patch, Floats]


@dataclass(frozen=True)
class _NurbsContent:
    """What a file says."""

    patches: dict[str, _Shape]
    join: bool | None
    points: dict[str, tuple[str, float, float]]  #: patch and knot parameters
    edges: dict[str, list[str]]
    unit: float | None = None  #: length of the file's unit, where it has one [m]


@blamed
def read(
    path: str | Path,
    *,
    cells: int = 1,
    degree: int | None = None,
    scale: float | None = None,
    join: bool | None = None,
) -> Surface:
    """The surface of a `.json`, `.igs`, `.iges` or `.3dm` file.

    `scale` is the length of the file's unit [m]; without it that which IGES and 3dm files name,
    else 1. InputError where it is another one than the file names.

    Every patch is raised to `degree` (by default the highest of the file) and each of its spans
    split into `cells` equal ones; `join` stands above that of the file. A file that has not changed
    is read once, see `core.remembered_files`; the arrays are the caller's own.
    """
    path = Path(path)
    readers = {".json": _read_json, ".igs": _foreign, ".iges": _foreign, ".3dm": _foreign}
    if path.suffix.lower() not in readers:
        raise InputError(
            say(
                str(path),
                f"a file {', '.join(readers)}",
                f"'{path.suffix}'",
                "export NURBS surfaces as IGES",
            )
        )
    try:
        size = path.stat().st_size
    except OSError as error:
        raise InputError(
            say(str(path), "a readable file", error.strerror, "look at its name and folder")
        ) from error
    if size > MAX_BYTES:
        raise InputError(
            say(
                str(path),
                f"at most {MAX_BYTES} bytes",
                size,
                "split the surface into several files",
            )
        )

    def made() -> Surface:
        content = readers[path.suffix.lower()](path)
        return _surface(
            path, content if join is None else replace(content, join=join), cells, degree, scale
        )

    # seams between sides take as long as a thousand steps of a small shell
    return deepcopy(
        remembered_files.once(path, ("NURBS surface", cells, degree, scale, join), made)
    )


def _surface(
    path: Path, content: _NurbsContent, cells: int, degree: int | None, scale: float | None
) -> Surface:
    degrees = [max(patch.degree1, patch.degree2) for patch, _ in content.patches.values()]
    if (
        degree is None
        and len({(patch.degree1, patch.degree2) for patch, _ in content.patches.values()}) > 1
    ):
        degree = max(degrees)
    if (
        scale is not None
        and content.unit is not None
        and not np.isclose(scale, content.unit, rtol=1e-6)
    ):
        got = f"{scale:g} m"
        remedy = "leave out the unit, or correct that of the file"
        raise InputError(say(f"{path}: unit", f"{content.unit:g} m as the file says", got, remedy))
    scale = scale if scale is not None else content.unit or 1.0
    if not (np.isfinite(scale) and scale > 0.0):
        raise InputError(
            say("nurbs_file.read, scale", "a positive length [m]", scale, "0.001 for millimetres")
        )
    _check_size(path, content, cells, degree)
    for name, (patch, control) in content.patches.items():
        plate_audit.check_regular(
            f"{path}: " + (f"patch '{name}'" if name else "patch"),
            nurbs.surface(patch, control, join=False),
        )
    try:
        shapes = {}
        for name, (patch, control) in content.patches.items():
            shapes[name] = nurbs.refine(patch, scale * control, cells, cells, degree)
        patches = {name: patch for name, (patch, _) in shapes.items()}
        shape = nurbs.surface(
            patches, {name: control for name, (_, control) in shapes.items()}, join=content.join
        )
        points = {
            name: nurbs.place(shape, xi1, xi2, patch)
            for name, (patch, xi1, xi2) in content.points.items()
        }
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    edges = {
        name: _union(f"{path}: edges.{name}", shape, parts) for name, parts in content.edges.items()
    }
    return replace(shape, points={**shape.points, **points}, edges={**shape.edges, **edges})


def _check_size(path: Path, content: _NurbsContent, cells: int, degree: int | None) -> None:
    """Bound on the number of functions before anything is refined: continuity 0 costs most."""
    where = f"{path}: control points after refinement"
    if degree is not None and (
        isinstance(degree, bool) or not isinstance(degree, int) or not 1 <= degree <= MAX_DEGREE
    ):
        raise InputError(
            say("nurbs_file.read, degree", f"a whole number from 1 to {MAX_DEGREE}", degree)
        )
    if isinstance(cells, bool) or not isinstance(cells, int) or cells < 1:
        raise InputError(
            say(
                "nurbs_file.read, cells", "a whole number of at least 1", cells, "1 keeps the spans"
            )
        )
    total = 0
    for patch, _ in content.patches.values():
        one, two = ((len(line.breaks(s)) - 1) * (cells + (degree or s.degree)) for s in patch.lines)
        total += one * two
    if total > MAX_FUNCTIONS:
        raise InputError(
            say(
                where,
                f"at most {MAX_FUNCTIONS}",
                f"up to {total}",
                "take fewer cells or a lower degree",
            )
        )


def _union(where: str, shape: Surface, parts: list[str]) -> Ints:
    for part in parts:
        if part not in shape.edges:
            raise InputError(
                say(
                    where,
                    f"edges of {sorted(shape.edges)}",
                    f"'{part}'{closest(part, shape.edges)}",
                )
            )
    return np.unique(np.concatenate([shape.edges[part] for part in parts]), axis=0)


# -------------------------------------------------------------------------------------------------------------------- JSON
def _read_json(path: Path) -> _NurbsContent:
    data = _parse(path)
    where = f"{path}:"
    _keys(
        str(path),
        data,
        required=("format", "version", "patches"),
        optional=("join", "points", "edges"),
    )
    if data["format"] != FORMAT or data["version"] != VERSION or isinstance(data["version"], bool):
        got = f"{shown(data['format'])}, version {shown(data['version'])}"
        raise InputError(
            say(
                f"{where} format",
                f"'{FORMAT}', version {VERSION}",
                got,
                "write it with nurbs_file.write",
            )
        )
    items = data["patches"]
    if not isinstance(items, list) or not 1 <= len(items) <= MAX_PATCHES:
        raise InputError(
            say(f"{where} patches", f"a list of 1 to {MAX_PATCHES} patches", shown(items))
        )
    patches: dict[str, _Shape] = {}
    for i, item in enumerate(items):
        place = f"{where} patches[{i}]"
        _keys(place, item, required=("degree", "knots", "control"), optional=("name", "weights"))
        name = (
            _name(f"{place}.name", item["name"])
            if "name" in item
            else ""
            if len(items) == 1
            else f"patch{i + 1}"
        )
        if name in patches:
            raise InputError(
                say(
                    f"{place}.name",
                    "a name of its own",
                    f"'{name}' again",
                    "rename one of the patches",
                )
            )
        patches[name] = _patch(place, item)
    join = data.get("join")
    if "join" in data and not isinstance(join, bool):
        raise InputError(say(f"{where} join", "true or false", shown(join)))
    return _NurbsContent(
        patches,
        join,
        _points(where, data.get("points", {}), patches),
        _edges(where, data.get("edges", {})),
    )


def _parse(path: Path) -> Any:
    """JSON as Python objects; refuses NaN, Infinity, keys given twice."""

    def constant(text: str) -> NoReturn:
        raise InputError(say(str(path), "finite numbers", text, "NaN and Infinity are no JSON"))

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            keys = [key for key, _ in pairs]
            twice = next(key for key in keys if keys.count(key) > 1)
            raise InputError(
                say(str(path), "every key once", f"'{twice}' twice", "remove one of them")
            )
        return found

    try:
        text = path.read_text(encoding="utf-8")
        return json.loads(
            text, parse_constant=constant, parse_int=_integer, object_pairs_hook=unique
        )
    except json.JSONDecodeError as error:
        raise InputError(
            say(
                f"{path}:{error.lineno}:{error.colno}",
                "JSON",
                error.msg,
                "look for a missing comma",
            )
        ) from error
    except (UnicodeDecodeError, RecursionError, OSError) as error:
        raise InputError(
            say(str(path), "JSON text in UTF-8", error, "write it with nurbs_file.write")
        ) from error


def _integer(text: str) -> int | float:
    """A whole number; one beyond 18 digits as a float, which Python reads at any length."""
    return int(text) if len(text) < 19 else float(text)


def _keys(where: str, data: Any, required: tuple[str, ...], optional: tuple[str, ...]) -> None:
    if not isinstance(data, dict):
        raise InputError(say(where, f"an object with the keys {', '.join(required)}", shown(data)))
    for key in required:
        if key not in data:
            raise InputError(
                say(
                    where,
                    f"the key '{key}'",
                    f"the keys {', '.join(map(shown, data)) or 'none'}",
                    "add it",
                )
            )
    for key in data:
        if key not in required + optional:
            known = ", ".join(required + optional)
            raise InputError(
                say(
                    where,
                    f"keys of {known}",
                    f"{shown(key)}{closest(key, required + optional)}",
                    "remove it",
                )
            )


def _name(where: str, value: Any) -> str:
    if not isinstance(value, str) or not _NAME.fullmatch(value) or len(value) > 100:
        raise InputError(
            say(
                where,
                "a name of letters, digits, _ and -, first a letter",
                shown(value),
                "dots divide names of places",
            )
        )
    return value


def _patch(where: str, item: dict[str, Any]) -> _Shape:
    degrees = item["degree"]
    whole = (
        isinstance(degrees, list)
        and len(degrees) == 2
        and all(type(d) is int and 1 <= d <= MAX_DEGREE for d in degrees)
    )
    if not whole:
        got = degrees if isinstance(degrees, list) and len(degrees) < 9 else shown(degrees)
        raise InputError(say(f"{where}.degree", f"two whole numbers from 1 to {MAX_DEGREE}", got))
    if not isinstance(item["knots"], list) or len(item["knots"]) != 2:
        raise InputError(
            say(f"{where}.knots", "two lists of knots, one a direction", shown(item["knots"]))
        )
    knots = [_array(f"{where}.knots[{i}]", item["knots"][i], 1) for i in (0, 1)]
    control = _array(f"{where}.control", item["control"], 3)
    weights = (
        _array(f"{where}.weights", item["weights"], 2) if item.get("weights") is not None else None
    )
    try:
        patch = nurbs.Patch(knots[0], knots[1], degrees[0], degrees[1], weights)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
    if control.shape not in ((*patch.shape, 2), (*patch.shape, 3)):
        n1, n2 = patch.shape
        expected = (
            f"{n1} rows of {n2} points of 2 or 3 coordinates, len(knots) - degree - 1 a direction"
        )
        raise InputError(
            say(
                f"{where}.control",
                expected,
                f"shape {control.shape}",
                "give one point for each function",
            )
        )
    return patch, control


def _array(where: str, value: Any, depth: int) -> Floats:
    """Nested lists of finite numbers as an array; the place of the first wrong entry."""
    if not isinstance(value, list) or not value:
        raise InputError(
            say(where, "a list of numbers" if depth == 1 else "a list of lists", shown(value))
        )
    if depth > 1:
        rows = [_array(f"{where}[{i}]", row, depth - 1) for i, row in enumerate(value)]
        for i, row in enumerate(rows):
            if row.shape != rows[0].shape:
                expected = f"shape {rows[0].shape} as in row 0"
                raise InputError(
                    say(
                        f"{where}[{i}]",
                        expected,
                        f"shape {row.shape}",
                        "make the rows equally long",
                    )
                )
        return np.stack(rows)
    for i, number in enumerate(value):
        if type(number) not in (int, float) or not np.isfinite(number):
            raise InputError(say(f"{where}[{i}]", "a finite number", shown(number)))
    return np.array(value, dtype=float)


def _points(
    where: str, data: Any, patches: dict[str, _Shape]
) -> dict[str, tuple[str, float, float]]:
    found = {}
    for name, item in _mapping(f"{where} points", data).items():
        place = f"{where} points.{name}"
        _keys(place, item, required=("xi",), optional=("patch",))
        xi = _array(f"{place}.xi", item["xi"], 1)
        if len(xi) != 2:
            raise InputError(say(f"{place}.xi", "two knot parameters", f"{len(xi)}"))
        patch = item.get("patch", next(iter(patches)) if len(patches) == 1 else None)
        if not isinstance(patch, str) or patch not in patches:
            raise InputError(
                say(
                    f"{place}.patch",
                    f"a patch of {sorted(patches)}",
                    shown(patch) + closest(str(patch), patches),
                )
            )
        found[name] = (patch, float(xi[0]), float(xi[1]))
    return found


def _edges(where: str, data: Any) -> dict[str, list[str]]:
    found = _mapping(f"{where} edges", data)
    for name, parts in found.items():
        if (
            not isinstance(parts, list)
            or not parts
            or not all(isinstance(part, str) for part in parts)
        ):
            raise InputError(say(f"{where} edges.{name}", "a list of names of edges", shown(parts)))
    return found


def _mapping(where: str, data: Any) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise InputError(say(where, "an object of names", shown(data)))
    for name in data:
        _name(where, name)
    return data


@blamed
def write(path: str | Path, shape: Surface) -> None:
    """A surface of `nurbs.surface` as JSON: patches, control points, named points and edges made of
    whole sides.

    InputError for a surface of another interpolation.
    """
    space = shape.space
    if not isinstance(space, nurbs.Nurbs):
        raise InputError(
            say(
                "nurbs_file.write",
                "a surface of nurbs.surface",
                type(space).__name__,
                "export others as meshes",
            )
        )
    control = {name: nurbs.control_points(shape, name) for name in space.patches}
    plain = nurbs.surface(space.patches, control, join=False)
    items = [_item(name, patch, control[name]) for name, patch in space.patches.items()]
    data: dict[str, Any] = {"format": FORMAT, "version": VERSION, "patches": items}
    data |= {} if space.join is None else {"join": space.join}
    data["points"] = {
        name: _parameters(space, at)
        for name, at in shape.points.items()
        if name not in plain.points
    }
    data["edges"] = {
        name: _parts(name, rows, plain)
        for name, rows in shape.edges.items()
        if name not in plain.edges
    }
    Path(path).write_text(json.dumps(data, allow_nan=False) + "\n", encoding="utf-8")


def _item(name: str, patch: nurbs.Patch, control: Floats) -> dict[str, Any]:
    item: dict[str, Any] = {"name": name} if name else {}
    item["degree"] = [int(patch.degree1), int(patch.degree2)]
    item["knots"] = [patch.knots1.tolist(), patch.knots2.tolist()]
    item["control"] = control.tolist()
    return item if patch.weights is None else {**item, "weights": patch.weights.tolist()}


def _parameters(space: nurbs.Nurbs, at: tuple[int, float, float]) -> dict[str, Any]:
    """Patch and knot parameters of a cell's parent point: the inverse of `nurbs.place`."""
    begins = np.cumsum([0] + [patch.cells[0] * patch.cells[1] for patch in space.patches.values()])
    i = int(np.searchsorted(begins, at[0], side="right")) - 1
    name, patch = list(space.patches.items())[i]
    span2, span1 = divmod(at[0] - int(begins[i]), patch.cells[0])
    ends = [line.breaks(spline) for spline in patch.lines]
    xi = [
        float((1.0 - s) * e[j] + s * e[j + 1])
        for e, j, s in zip(ends, (span1, span2), at[1:], strict=True)
    ]
    return {"patch": name, "xi": xi} if name else {"xi": xi}


def _parts(name: str, rows: Ints, plain: Surface) -> list[str]:
    """Names of the sides of patches of which an edge is made."""
    wanted = set(map(tuple, rows.tolist()))
    parts = {part: set(map(tuple, side.tolist())) for part, side in plain.edges.items()}
    inside = [part for part, side in parts.items() if side <= wanted]
    if set().union(*(parts[part] for part in inside)) != wanted:
        where = f"nurbs_file.write, edge '{name}'"
        remedy = "split the patch where the edge ends"
        raise InputError(
            say(where, "whole sides of patches", f"{len(rows)} sides of cells", remedy)
        )
    return inside


# -------------------------------------------------------------------------------------------------------------- CAD files
def _foreign(path: Path) -> _NurbsContent:
    """What another program wrote."""
    with door.converted(path, str(path), "export the surfaces again as IGES 5.3") as target:
        data = json.loads(target.read_text(encoding="utf-8"))
    shapes = [
        _patch(str(path) if len(data["patches"]) == 1 else f"{path}: surface {i + 1}", item)
        for i, item in enumerate(data["patches"])
    ]
    if not 1 <= len(shapes) <= MAX_PATCHES:
        remedy = "export untrimmed NURBS surfaces"
        raise InputError(
            say(str(path), f"1 to {MAX_PATCHES} NURBS surfaces", f"{len(shapes)}", remedy)
        )
    names = [""] if len(shapes) == 1 else [f"patch{i + 1}" for i in range(len(shapes))]
    return _NurbsContent(dict(zip(names, shapes, strict=True)), None, {}, {}, data["unit"])
