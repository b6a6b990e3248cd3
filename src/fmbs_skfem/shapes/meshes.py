"""Meshes of lines in files: read and audited, written, followed as one open polyline.

    read: file -> points (n,3) [m], cells (e,2), groups of points and of cells by name
    chain: cells of one body -> node ids (j,) such that (chain[i], chain[i+1]) is a cell

Files are gmsh `.msh` (2.2 or 4.1; groups are its physical groups of points and curves, unnamed ones
are called `tag_n`) or VTK `.vtu` (groups are integer arrays of zeros and ones, see `vtu`); `.inp`,
`.bdf`, `.nas`, `.med` and `.vtk` come through `foreign`. A mesh that comes out of `read` has finite points, every
one used by a cell, no cell of zero length and none twice; a `Notice` says what is dropped on the
way.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from scipy.sparse import coo_array, csgraph, csr_array

from ..core import errors, remembered_files
from ..core.algebra.linalg import distinct
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.fields import Count
from ..foreign import door, exchange
from . import msh, vtu
from .msh import Floats, Ints, MshCells, Raw
from .repair import merge_points

if TYPE_CHECKING:
    from skfem import Mesh

MAX_FILE = 256 * 2**20  #: bytes of a mesh file
#: decimal digits of coordinates that are rounded: fewer are meant as they are, more err by less
#: than matters
FEWEST, MOST = (
    5,
    11,
)
WHOLE = 1e-3  #: distance from a whole number of MOST digits that is round-off, 1e-5 of it
NOTHING = 1e-12  #: coordinate, over the largest, that is zero with some round-off


@dataclass(frozen=True, eq=False)
class LineMesh:
    """Straight two-node cells in space."""

    points: Floats  #: (n,3) [m]
    cells: Ints  #: (e,2) node ids
    point_groups: dict[str, Ints] = field(default_factory=dict)  #: name -> (i,) node ids
    line_groups: dict[str, Ints] = field(default_factory=dict)  #: name -> (i,) cell ids
    path: Path | None = None  #: the file it was read from


Named: TypeAlias = dict[str, Ints]  #: name -> members of a group
Groups: TypeAlias = dict[str, Named]  #: kind of groups -> name -> members
Curve: TypeAlias = Callable[[Floats], Floats]  #: coordinate along a line (n,) -> points (n,3) [m]


@checked
def polyline(points: Floats) -> LineMesh:
    """One cell between neighbouring points (n, 3) [m], with the point groups `left` and `right`."""
    count = len(points) - 1
    ends = {"left": np.array([0]), "right": np.array([count])}
    cells = np.stack([np.arange(count), np.arange(1, count + 1)], 1)
    return LineMesh(points=np.asarray(points, dtype=float), cells=cells, point_groups=ends)


@checked
def segment(
    cells: Count, start: Sequence[float] = (0.0, 0.0, 0.0), end: Sequence[float] = (1.0, 0.0, 0.0)
) -> LineMesh:
    """Equal cells along a line from `start` to `end` (3,) [m].

    Its point groups are `left` and `right`.

        >>> from fmbs_skfem.shapes.meshes import segment
        >>> segment(2).points.tolist()
        [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]]
    """
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    return polyline(a + (b - a) * np.linspace(0.0, 1.0, cells + 1)[:, None])


def _foreign(path: Path, where: str) -> Raw:
    """The points, cells and groups of a file of another program."""
    with door.converted(path, where, "export it again, or as .msh 4.1") as target:
        found = exchange.load(target)

    def of(kind: str, width: int) -> MshCells:
        rows = found.cells.get(kind, np.zeros((0, width), np.int64))
        return MshCells(
            found.numbers[rows],
            found.cell_numbers.get(kind, rows[:, 0]),
            found.cell_groups.get(kind, {}),
        )

    return Raw(
        points=found.points,
        numbers=found.numbers,
        point_groups={name: found.numbers[ids] for name, ids in found.point_groups.items()},
        lines=of("line", 2),
        triangles=of("triangle", 3),
        quads=of("quad", 4),
        kinds={kind: len(rows) for kind, rows in found.cells.items()},
        others={
            kind: of(kind, rows.shape[1])
            for kind, rows in found.cells.items()
            if kind in (*msh.CURVED, *msh.SOLID)
        },
        materials=found.materials,
    )


_READERS = {".msh": msh.read, ".vtu": vtu.read} | dict.fromkeys(
    (".inp", ".bdf", ".nas", ".med", ".vtk"), _foreign
)


def straight(s: Floats) -> Floats:
    """Points (n, 3) at the arc lengths s (n,) along +x."""
    return np.column_stack([s, 0.0 * s, 0.0 * s])


def path(text: str, folder: Path, allow_outside: bool = False, what: str = "mesh") -> Path:
    """The file, by default a mesh, that a scene in `folder` calls `text`.

    Rule: `text` is relative to `folder`, and the file it leads to, symbolic links followed, lies in
    the parent of `folder` or below: a scene `project/examples/a.yaml` may say `b.msh` or
    `../meshes/b.msh` and can reach nothing outside `project`. Where the parent is the root of the
    file system, `folder` itself is the bound. Absolute paths are refused even when they lead
    inside, because a scene with one works on one machine only. `allow_outside=True` lifts the whole
    rule.
    """
    where = f"{what} path {text!r}"
    try:
        base = folder.resolve()
        target = (base / text).resolve()
        inside = target.is_relative_to(base if base.parent == Path(base.anchor) else base.parent)
    except (OSError, RuntimeError, ValueError) as error:
        raise errors.InputError(errors.say(where, "a path to a file", str(error))) from None
    if not text.strip():
        raise errors.InputError(errors.say(where, "a path to a file", "no text"))
    if not allow_outside and (Path(text).is_absolute() or not inside):
        bound = f"a path relative to {base} that stays in its parent folder"
        raise errors.InputError(
            errors.say(
                where,
                bound,
                str(target),
                "copy the file there"
                + (", or allow meshes outside the project" if what == "mesh" else ""),
            )
        )
    return target


@checked
def read(path: Path | str, repair: bool = False, unit: float = 1.0) -> LineMesh:
    """The audited mesh in a `.msh` or `.vtu` file; InputError names the file, and the ids and
    positions of what is wrong.

    `repair` merges nodes at one place, see `repair`; `unit` is the length of the file's unit [m]. A
    file that has not changed is read once, see `core.remembered_files`; the arrays are the caller's
    own.

        >>> from fmbs_skfem.shapes import meshes
        >>> mesh = meshes.read("meshes/beam_10.msh")
        >>> mesh.points.shape, mesh.cells.shape, sorted(mesh.point_groups)
        ((11, 3), (10, 2), ['left', 'right'])
    """
    path = Path(path)
    where = f"mesh {path}"
    found = remembered_files.once(
        path,
        ("mesh of lines", repair, unit),
        lambda: _audit(load(path, where, repair, unit), where, path),
    )
    return deepcopy(found)


def load(path: Path, where: str, repair: bool = False, unit: float = 1.0) -> Raw:
    """What a `.msh` or `.vtu` file says, before any audit; `where` opens every error message."""
    try:
        reader = _READERS.get(path.suffix.lower())
        if reader is None:
            *known, last = _READERS
            raise errors.InputError(
                errors.say(
                    where,
                    f"a {', '.join(known)} or {last} file",
                    f"'{path.suffix}'",
                    "export it as .msh 4.1",
                )
            )
        present(path, where)
        size = path.stat().st_size
        if not 0 < size <= MAX_FILE:
            got = f"{size} bytes" if size else "an empty file"
            raise errors.InputError(errors.say(where, f"a file of at most {MAX_FILE} bytes", got))
        raw = reader(path, where)
        raw = replace(raw, resolution=unit * resolution(raw.points))
        raw = replace(raw, points=unit * raw.points) if unit != 1.0 else raw
        return merge_points(raw, where) if repair else raw
    except OSError as error:
        raise errors.InputError(
            errors.say(where, "a readable file", error.strerror or str(error))
        ) from None


def resolution(points: Floats) -> float:
    """Half a unit of the last digit of the largest of some coordinates (n, c); 0 where they have
    all digits.

    Digits are decimal, from FEWEST on, or those of single precision: numbers of fewer digits, such
    as multiples of 0.1, are exact.
    """
    size = np.abs(points[np.isfinite(points)])
    largest = float(size.max(initial=0.0))
    size = size[size > NOTHING * largest]
    power = np.floor(np.log10(size))
    for digits in range(FEWEST - 1, MOST + 1):
        whole = size * 10.0 ** (digits - 1 - power)
        if np.abs(whole - np.rint(whole)).max(initial=0.0) < WHOLE:
            return (
                0.5 * 10.0 ** (np.floor(np.log10(largest)) - digits + 1)
                if digits >= FEWEST
                else 0.0
            )
    with np.errstate(over="ignore"):
        single = bool((size.astype(np.float32) == size).all())
    return 0.5 * float(np.spacing(np.float32(largest))) if single else 0.0


def present(path: Path, where: str, remedy: str = "") -> None:
    """InputError where a path leads to no file, with the name of one that is called alike, or else
    with a remedy.
    """
    if not path.is_file():
        there = "a folder" if path.is_dir() else "something else" if path.exists() else ""
        got, near = (there, "") if there else ("no such file", _neighbour(path))
        raise errors.InputError(errors.say(where, "a file", got + near, "" if near else remedy))


def _neighbour(path: Path) -> str:
    with contextlib.suppress(OSError):
        return errors.closest(
            path.name, (p.name for p in path.parent.iterdir() if p.suffix == path.suffix)
        )
    return ""


@checked
def from_skfem(mesh: Mesh, curve: Curve = straight) -> LineMesh:
    """The mesh of a scikit-fem MeshLine laid along a curve: its boundaries are point groups, its
    subdomains line groups.
    """
    if mesh.p.shape[0] != 1 or mesh.t.shape[0] != 2:
        got = f"a {type(mesh).__name__} in {mesh.p.shape[0]} dimensions"
        raise errors.InputError(errors.say("from_skfem", "a MeshLine of first order", got))
    points = {
        name: mesh.facets[0, np.asarray(ids)].astype(np.int64)
        for name, ids in (mesh.boundaries or {}).items()
    }
    lines = {name: np.asarray(ids, np.int64) for name, ids in (mesh.subdomains or {}).items()}
    return LineMesh(curve(mesh.p[0]), mesh.t.T.astype(np.int64), points, lines)


@checked
def write(mesh: LineMesh, path: Path | str) -> None:
    """Write a `.msh` file (gmsh 2.2, binary; cells ordered by group) or a `.vtu` file; `read`
    returns the same mesh.
    """
    export(
        Path(path),
        mesh.points,
        "line",
        mesh.cells,
        {"point": mesh.point_groups, "line": mesh.line_groups},
    )


def export(
    path: Path, points: Floats, kind: str, cells: Ints, groups: Groups, sides: str = "line"
) -> None:
    """Write cells (e, b) of a kind with groups of points (i,), where there are any of edges (i, 2),
    or other `sides` (i, j) of cells, and of cells (i,).

    InputError where names of groups do not survive in a file, and where two groups have one name.
    """
    import meshio

    where = f"mesh {path}"
    suffix = path.suffix.lower()
    silence = io.StringIO()
    forms: dict[str, tuple[str, Callable[..., Any]]] = {
        ".msh": ("gmsh22", _physical),
        ".vtu": ("vtu", _marked),
    }
    names = [name for named in groups.values() for name in named]
    for name in names:
        if (
            not name
            or any(letter in name for letter in '"\\\r\n')
            or name != name.strip()
            or name.startswith("vtk")
        ):
            expected = "group names without quotes, backslashes, line ends or outer blanks, and not starting with 'vtk'"
            raise errors.InputError(errors.say(where, expected, repr(name)))
    if suffix not in forms:
        raise errors.InputError(
            errors.say(where, f"a name in {' or '.join(forms)}", f"'{path.suffix}'")
        )
    vertices, *others, members = groups.values()
    if (suffix == ".msh" or others) and (
        twice := sorted({name for name in names if names.count(name) > 1})
    ):
        *kinds, last = groups
        expected = f"different names for {', '.join(kinds)} and {last} groups"
        raise errors.InputError(errors.say(where, expected, f"{twice}", "rename one"))
    form, make = forms[suffix]
    out = make(points, kind, cells, vertices, others[0] if others else {}, members, sides)
    try:
        with contextlib.redirect_stdout(silence), contextlib.redirect_stderr(silence):
            meshio.write(path, out, file_format=form)
    except (OSError, SystemExit) as error:
        raise errors.InputError(
            errors.say(where, "a file that can be written", str(error))
        ) from None


def _physical(
    points: Floats,
    kind: str,
    cells: Ints,
    vertices: Named,
    edges: Named,
    members: Named,
    sides: str,
) -> Any:
    """The meshio mesh of physical groups: each cell is written once for every group it belongs to,
    as gmsh does.
    """
    import meshio

    free = cells[np.setdiff1d(np.arange(len(cells)), np.concatenate([[], *members.values()]))]
    named = [("vertex", 0, name, ids[:, None]) for name, ids in vertices.items()]
    dimension = 1 if kind == "line" else 2 if sides == "line" else 3
    named += [(sides, dimension - 1, name, pairs) for name, pairs in edges.items()]
    named += [(kind, dimension, name, cells[ids]) for name, ids in members.items()]
    names = {
        name: np.array([tag, dimension]) for tag, (_, dimension, name, _) in enumerate(named, 1)
    }
    blocks = [(shape, rows, tag) for tag, (shape, _, _, rows) in enumerate(named, 1) if len(rows)]
    blocks += [(kind, free, 0)] if len(free) else []
    tags = [np.full(len(rows), tag) for _, rows, tag in blocks]
    cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    return meshio.Mesh(
        points, [block[:2] for block in blocks], cell_data=cell_data, field_data=names
    )


def _marked(
    points: Floats,
    kind: str,
    cells: Ints,
    vertices: Named,
    edges: Named,
    members: Named,
    sides: str,
) -> Any:
    """The meshio mesh of groups as `vtu` has them: the cells, then each edge of a group once."""
    import meshio

    pairs = np.concatenate([*edges.values()] or [np.zeros((0, 2), np.int64)])
    _, first, same = np.unique(
        np.sort(pairs, axis=1), axis=0, return_index=True, return_inverse=True
    )
    parts = np.split(same.ravel(), np.cumsum([len(part) for part in edges.values()])[:-1])
    blocks = [
        (kind, cells, members),
        (sides, pairs[first], dict(zip(edges, parts, strict=False))),
    ][: 1 + bool(len(first))]
    none = np.zeros(0, np.int64)
    marks = [
        vtu.marks({name: own.get(name, none) for name in [*members, *edges]}, len(rows))
        for _, rows, own in blocks
    ]
    data = {name: [part[name] for part in marks] for name in [*members, *edges]}
    return meshio.Mesh(
        points, [block[:2] for block in blocks], vtu.marks(vertices, len(points)), data
    )


def _audit(raw: Raw, where: str, path: Path) -> LineMesh:
    """Check what the file says; keep the points that cells use, and each cell once."""
    require_cells(raw, where, ("line",), "export a mesh of two-node lines", "lines")
    check_points(raw, where)
    cells = rows(raw, raw.lines.nodes, where, "cells", raw.lines.numbers)
    _check_lengths(raw, cells, where)
    kept, line_groups = once(raw, raw.lines, cells, where)
    used, compact = np.unique(cells[kept], return_inverse=True)
    points, lines = without_empty(where, points_of(raw, used, where), line_groups)
    return LineMesh(raw.points[used], compact.reshape(-1, 2).astype(np.int64), points, lines, path)


def require_cells(raw: Raw, where: str, kinds: tuple[str, ...], remedy: str, used: str) -> None:
    """Refuse a mesh without points, without cells of these kinds, or with curved ones of them; a
    notice of the others.
    """
    if not len(raw.points):
        raise errors.InputError(
            errors.say(where, "points", "none", "export the mesh with its nodes")
        )
    parts = {"line": raw.lines, "triangle": raw.triangles, "quad": raw.quads}
    if not any(len(parts[kind].nodes) for kind in kinds):
        got = (
            ", ".join(f"{count} {kind}" for kind, count in sorted(raw.kinds.items()) if count)
            or "no cells at all"
        )
        raise errors.InputError(
            errors.say(where, f"cells of type {' or '.join(kinds)}", got, remedy)
        )
    others = {
        kind: count
        for kind, count in raw.kinds.items()
        if kind not in ("vertex", "line", *kinds) and count
    }
    for kind in kinds:
        refuse_curved(others, kind, where)
    if others:
        notify(
            f"{where}: {', '.join(f'{count} {kind} cells' for kind, count in others.items())} ignored, only {used} are used"
        )


def points_of(raw: Raw, used: Ints, where: str) -> dict[str, Ints]:
    """Point groups as places in the sorted rows of points that are `used`."""
    found = {
        name: distinct(rows(raw, ids, where, f"point group '{name}'"))
        for name, ids in raw.point_groups.items()
    }
    return {name: np.searchsorted(used, ids[np.isin(ids, used)]) for name, ids in found.items()}


def without_empty(where: str, *groups: dict[str, Ints], tell: bool = True) -> list[dict[str, Ints]]:
    """Groups without those that have no members, which notices name."""
    for name in [name for named in groups for name, ids in named.items() if tell and not len(ids)]:
        notify(f"{where}: group '{name}' is named but has no members in the mesh, and is dropped")
    return [{name: ids for name, ids in named.items() if len(ids)} for named in groups]


def refuse_curved(others: dict[str, int], kind: str, where: str) -> None:
    """Refuse a file whose cells of a kind are of first order in a part of it only: the others would
    be lost.
    """
    lost = [f"{count} {name}" for name, count in others.items() if name.startswith(kind)]
    if lost:
        got = ", ".join(lost) + " among them"
        raise errors.InputError(
            errors.say(
                where,
                f"all cells of type {kind}, of first order",
                got,
                "export a mesh of first order",
            )
        )


def several(texts: list[str], count: int) -> str:
    """The first few of `count` things, and how many more there are."""
    return ", ".join(texts) + (f" and {count - len(texts)} more" if count > len(texts) else "")


def position(point: Floats) -> str:
    """A point (c,) as text."""
    return "(" + ", ".join(f"{x:.6g}" for x in point) + ")"


def list_ids(raw: Raw, ids: Ints) -> str:
    """The first few points by number and position."""
    return several(
        [f"node {raw.numbers[i]} at {position(raw.points[i])}" for i in ids[:3]], len(ids)
    )


def check_points(raw: Raw, where: str) -> None:
    """Finite points, one a node number."""
    bad = np.flatnonzero(~np.isfinite(raw.points).all(axis=1))
    if len(bad):
        raise errors.InputError(
            errors.say(where, "finite coordinates", list_ids(raw, bad), "export the mesh again")
        )
    numbers, counts = np.unique(raw.numbers, return_counts=True)
    if counts.max() > 1:
        again = np.flatnonzero(np.isin(raw.numbers, numbers[counts > 1]))
        raise errors.InputError(
            errors.say(where, "one point a node number", list_ids(raw, again), "renumber the nodes")
        )


def rows(raw: Raw, numbers: Ints, where: str, what: str, cells: Ints | None = None) -> Ints:
    """Node numbers of the file -> rows of `points`, same shape; `cells` numbers the rows of a table
    of cells.
    """
    order = np.argsort(raw.numbers, kind="stable")
    at = order[np.minimum(np.searchsorted(raw.numbers, numbers, sorter=order), len(order) - 1)]
    bad = np.argwhere(raw.numbers[at] != numbers)
    if len(bad):
        found = [
            f"node {numbers[tuple(i)]}" + ("" if cells is None else f" in cell {cells[i[0]]}")
            for i in bad[:3]
        ]
        expected = f"{what} on the nodes {raw.numbers.min()} to {raw.numbers.max()} of the file"
        raise errors.InputError(
            errors.say(where, expected, several(found, len(bad)), "export the mesh again")
        )
    return at


def _check_lengths(raw: Raw, cells: Ints, where: str) -> None:
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(raw.points[cells[:, 1]] - raw.points[cells[:, 0]], axis=1)
        size = np.linalg.norm(np.ptp(raw.points, axis=0))
    if not np.isfinite(size):
        raise errors.InputError(
            errors.say(
                where, "coordinates in metres", f"an extent of {np.abs(raw.points).max():.3g}"
            )
        )
    bad = np.flatnonzero(lengths <= 1e-12 * size)
    if len(bad):
        found = [
            f"cell {raw.lines.numbers[i]} at {position(raw.points[cells[i, 0]])}" for i in bad[:3]
        ]
        remedy = "remove them and merge nodes that coincide"
        raise errors.InputError(
            errors.say(
                where, "cells longer than zero", "length 0 in " + several(found, len(bad)), remedy
            )
        )


def once(raw: Raw, part: MshCells, cells: Ints, where: str) -> tuple[Ints, dict[str, Ints]]:
    """Rows that hold each cell of `part` once, in file order, and its groups as places in these
    rows; `cells` are rows of points.

    A gmsh file repeats a cell for every physical group it belongs to. Repeated in one group, or
    without a group, it is an error.
    """
    _, first, same = np.unique(
        np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True
    )
    same = same.ravel()
    free = np.setdiff1d(np.arange(len(cells)), np.concatenate([[], *part.groups.values()]))
    lonely = np.bincount(same)[same[free]] > 1
    doubled = [free[lonely]]
    for members in part.groups.values():
        members = distinct(members)
        doubled.append(members[np.bincount(same[members], minlength=len(first))[same[members]] > 1])
    bad = distinct(np.concatenate(doubled))
    if len(bad):
        found = [
            f"cell {part.numbers[i]} at {position(raw.points[cells[i]].mean(axis=0))}"
            for i in bad[:4]
        ]
        got = f"repeated {several(found, len(bad))}"
        raise errors.InputError(errors.say(where, "each cell once", got, "remove duplicate cells"))
    order = np.argsort(first)
    place = np.argsort(order)
    return first[order], {
        name: distinct(place[same[members]]) for name, members in part.groups.items()
    }


def group(mesh: LineMesh, name: str) -> Ints:
    """Node ids (i,) of a point group."""
    return member(mesh.path, name, "point", {"point": mesh.point_groups, "line": mesh.line_groups})


def line_group(mesh: LineMesh, name: str) -> Ints:
    """Cell ids (i,) of a line group."""
    return member(mesh.path, name, "line", {"point": mesh.point_groups, "line": mesh.line_groups})


def member(path: Path | None, name: str, kind: str, kinds: Groups) -> Ints:
    """Members of a group of a kind; InputError says which groups there are, and of what kind one of
    that name is.
    """
    if name in kinds[kind]:
        return kinds[kind][name]
    other = "".join(
        f", which is {'an' if word == 'edge' else 'a'} {word} group"
        for word, named in kinds.items()
        if name in named
    )
    present = (
        f"{kind} groups present: {errors.listed(sorted(kinds[kind]), name, 'none')}"
        + errors.closest(name, kinds[kind])
    )
    where = f"mesh {path or 'in memory'}"
    expected = f"the name of {'an' if kind == 'edge' else 'a'} {kind} group"
    raise errors.InputError(errors.say(where, expected, f"'{name}'{other}", present))


def chain(mesh: LineMesh, group: str | None = None) -> Ints:
    """Node ids (j,) along the one open polyline that the cells of a line group (or all cells) form.

    It runs the way most of its cells run; where they do not agree, it starts at the end with the
    lower node id.
    """
    where = f"mesh {mesh.path or 'in memory'}" + (f", line group '{group}'" if group else "")
    cells = mesh.cells if group is None else mesh.cells[line_group(mesh, group)]
    if not len(cells):
        raise errors.InputError(errors.say(where, "cells", "none"))
    along = np.arange(len(mesh.points))
    # points in the order of the line, as most meshes have them: no graph is searched
    if np.array_equal(cells[:, 0], along[:-1]) and np.array_equal(cells[:, 1], along[1:]):
        return along
    degree = np.bincount(cells.ravel(), minlength=len(mesh.points))
    _check_chain(mesh, cells, degree, where)
    ends = np.flatnonzero(degree == 1)
    nodes: Ints = csgraph.depth_first_order(
        _links(cells, len(mesh.points)), int(ends[0]), directed=False, return_predecessors=False
    ).astype(np.int64)
    place = np.zeros(len(mesh.points), np.int64)
    place[nodes] = np.arange(len(nodes))
    backwards = np.count_nonzero(place[cells[:, 1]] < place[cells[:, 0]])
    return nodes[::-1].copy() if 2 * backwards > len(cells) else nodes


def _links(cells: Ints, count: int) -> csr_array:
    """(n,n) with a one for each cell."""
    return coo_array(
        (np.ones(len(cells)), (cells[:, 0], cells[:, 1])), shape=(count, count)
    ).tocsr()


def _check_chain(mesh: LineMesh, cells: Ints, degree: Ints, where: str) -> None:
    """One piece, two ends, no branch."""

    def fail(expected: str, nodes: Ints, what: str, remedy: str) -> errors.InputError:
        texts = [f"node {i} at {position(mesh.points[i])}" for i in nodes[:4]]
        return errors.InputError(
            errors.say(where, expected, f"{what} {several(texts, len(nodes))}", remedy)
        )

    branches = np.flatnonzero(degree > 2)
    if len(branches):
        raise fail(
            "one line without branches",
            branches,
            "three or more cells at",
            "give each body a line group of its own",
        )
    used = np.flatnonzero(degree)
    _, label = csgraph.connected_components(_links(cells, len(mesh.points)), directed=False)
    _, first = np.unique(label[used], return_index=True)
    if len(first) > 1:
        ends = np.flatnonzero(degree == 1)
        _, same, times = np.unique(
            mesh.points[ends], axis=0, return_inverse=True, return_counts=True
        )
        touching = ends[times[same.ravel()] > 1]
        remedy = "give each body a line group of its own"
        if len(touching):
            remedy = (
                f"merge nodes at one place ({', '.join(str(i) for i in touching[:4])}), or {remedy}"
            )
        raise fail("one piece", used[first], f"{len(first)} pieces, with", remedy)
    if not np.any(degree == 1):
        remedy = "leave one cell out, or split it into two bodies"
        raise fail("an open line with two ends", used[:1], "a closed loop through", remedy)
