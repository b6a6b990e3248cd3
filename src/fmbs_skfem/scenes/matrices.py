"""Bodies of a scene that come as matrices: files of a stiffness, a mass, nodes and sets of them.

rod: {type: matrices, stiffness: rod_K.mtx, mass: rod_M.mtx, nodes: rod.csv, interfaces: {...}, modes: 10}
"""

from __future__ import annotations

import json
import warnings
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from scipy.sparse import csr_array

from ..bodies.body import Body
from ..bodies.from_matrices import Coupling, from_matrices, rigidity
from ..core.errors import InputError, closest, listed, say
from ..core.notices import Notice
from ..core.storage.records import dataclass
from ..core.values.fields import FileUnit, Position, quantity, whole
from ..core.values.mappings import inline, names
from ..core.values.problems import Problem
from ..foreign import matrices as foreign
from ..foreign.exchange import Floats, Groups, Ints
from ..shapes import meshes
from ..systems.places import At
from . import field_kinds as fields
from .bodies import Mass, SceneBody, placed

if TYPE_CHECKING:
    from .schema import Scene


@dataclass(frozen=True)
class Bundle:
    """A body as matrices: nodes (n, 3) with `numbers` (n,), sets of numbers, K, M and C (3 n, 3 n)
    node by node.

    `unit` (n,) is 1 for positions and 0 for gradients, None where all are positions.
    """

    nodes: Floats
    numbers: Ints
    sets: Groups
    stiffness: csr_array
    mass: csr_array
    damping: csr_array | None
    unit: Floats | None
    prestress: csr_array | None = None


LARGEST = 1000  #: nodes of a body that keeps all of them: its matrix is dense
STATED = 1e-3  #: difference of a mass, a centre or an inertia from what is stated, over the size


@dataclass(frozen=True, kw_only=True)
class InterfaceModel:
    """Nodes at which a body of matrices is joined and loaded: a `set` of its file, or `nodes` by
    their numbers there.

    `rigid` ones move as one frame (RBE2), an `average` follows their mean motion and leaves them
    their own (RBE3); joints and loads act at `center`, by default the mean of the nodes.
    """

    set: str | None = None
    nodes: list[int] | None = None
    couple: Literal["rigid", "average"] = "rigid"
    center: Position | None = None


@dataclass(frozen=True, kw_only=True)
class Expected:
    """What a body is known to weigh, with its centre of mass and principal or full inertia there."""

    mass: Mass | None = None
    center: Position | None = None
    inertia: fields.Inertia | None = None


@dataclass(frozen=True, kw_only=True)
class MatricesBody(SceneBody, word="matrices"):
    """A body by its stiffness and mass matrices, those of a finite-element program, at large
    rotations and small strains.

    Matrices are read from Matrix Market, .npz, Abaqus, Nastran DMIG and CalculiX files, `nodes`
    from a mesh file or a table of `number, x, y, z`; `file` is one of `fmbs export --matrices` with
    all of it. Unknowns without labels stand node by node, or all x before all y (`order:
    components`). `unit` is that of lengths in all files; forces are in N and times in s, so that
    masses of files in mm are in tonnes. `matrix_names` says which of several matrices of a file is
    the `stiffness`, and which the `mass`.

    Joints and loads act at `interfaces` and at `points`, which are numbers of single nodes. Between
    them the body has its interface functions and `modes` fixed-interface modes (Craig and Bampton);
    `reduce: false` keeps all nodes. Everything is found once more with twice the modes, by which
    the error is known, unless `check: false`. `damping_ratio` damps every one of its free
    vibrations; `prestress` is what stresses of a steady spin add to its stiffness. Files of
    `recovery` have rows of stresses (six a point: xx, yy, zz, xy, yz, zx) by the unknowns, x, y, z
    of every node, for outputs of the type `recovered_stress`. What is `expected` of mass, centre
    and inertia, in the frame of the file, is compared.

    {type: matrices, stiffness: rod_K.mtx, mass: rod_M.mtx, nodes: rod.csv, interfaces: {left: {set: LEFT}}, modes: 10}
    """

    name: str
    file: str | None = None
    stiffness: str | None = None
    mass: str | None = None
    damping: str | None = None
    nodes: str | None = None
    matrix_names: dict[str, str] = field(default_factory=dict)
    unit: FileUnit = 1.0
    order: Literal["nodes", "components"] = "nodes"
    interfaces: Annotated[
        dict[str, InterfaceModel], names(Annotated[InterfaceModel, inline(InterfaceModel)])
    ] = field(default_factory=dict)
    points: dict[str, int] = field(default_factory=dict)
    prestress: str | None = None
    recovery: dict[str, str] = field(default_factory=dict)
    modes: Annotated[int, whole(0, 1000)] = 10
    reduce: bool = True
    check: bool = True
    damping_ratio: Annotated[float, quantity("", ">= 0", "< 1")] = 0.0
    expected: Expected | None = None
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    made_of: ClassVar[str] = "stiffness"

    def finer(self, times: int) -> None:
        return None

    def files(self) -> dict[str, str]:
        keys = ("file", "stiffness", "mass", "damping", "prestress", "nodes")
        given = {key: name for key in keys if (name := getattr(self, key)) is not None}
        return given | {f"recovery.{key}": name for key, name in self.recovery.items()}

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        if dim == 2:
            yield "type", Problem("dimension 3", "2", "matrices are those of bodies in space")
        given = [key for key in ("stiffness", "mass", "nodes") if getattr(self, key) is not None]
        if self.file is not None and given:
            yield "file", Problem("one file, or several", "both", f"delete {given[0]}")
        elif self.file is None and len(given) < 3:
            missing = next(key for key in ("stiffness", "mass", "nodes") if key not in given)
            yield missing, Problem("a file", "none", "or give one `file` with all of them")
        for name, one in self.interfaces.items():
            if (one.set is None) == (one.nodes is None):
                got = "neither" if one.set is None else "both"
                yield ("interfaces", name), Problem("a set or numbers of nodes", got)
        if shared := self.interfaces.keys() & self.points.keys():
            yield ("points", min(shared)), Problem("a name of its own", "that of an interface")

    def misplaced(self, place: At) -> Problem | None:
        if isinstance(place.place, str) and place.place:
            return None
        known = ", ".join([*self.interfaces, *self.points]) or "none yet"
        return Problem(
            f"an interface or point of '{self.name}'",
            f"'{self.name}'",
            f"write {self.name}.name with one of {known}",
        )

    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        def path(key: str, name: str = "") -> Path:
            found = meshes.path(name or getattr(self, key), scene.folder, allow_outside, "matrix")
            meshes.present(found, f"{key} {found}")
            return found

        where = f"body '{self.name}'"
        known = read_bundle(path("file"), where) if self.file else self.read_files(path, where)
        known = in_metres(known, self.unit)
        body = from_matrices(
            self.name,
            known.nodes,
            known.stiffness,
            known.mass,
            known.damping,
            unit=known.unit,
            prestress=known.prestress,
            interfaces={
                key: self.interface(f"{where}: interface '{key}'", one, known)
                for key, one in self.interfaces.items()
            },
            recovery={
                key: foreign.read_rows(path(key, name), f"{where}: recovery '{key}'") / self.unit**3
                for key, name in self.recovery.items()
            },
            places={
                key: int(rows_of(np.array([node]), known, f"{where}: point '{key}'")[0])
                for key, node in self.points.items()
            },
            **placed(self),
        )
        self.compare(where, body, float(np.ptp(known.nodes, axis=0).max()))
        from ..parts import condensation

        if self.reduce:
            body = condensation.condense(body, self.modes, self.check)
        elif len(body.reference) > LARGEST:
            got = f"{len(body.reference)}"
            remedy = "leave out `reduce: false`"
            raise InputError(say(where, f"at most {LARGEST} nodes that are kept", got, remedy))
        else:
            body = condensation.judged(body, body)
        return condensation.damp(body, self.damping_ratio) if self.damping_ratio else body

    def read_files(self, path: Callable[[str], Path], where: str) -> Bundle:
        """What the files of the scene hold, nodes without unknowns left out."""
        found = {
            key: foreign.read(path(key), f"{where}: {key}", self.matrix_names.get(key, ""))
            for key in ("stiffness", "mass", "damping", "prestress")
            if getattr(self, key) is not None
        }
        nodes, numbers, sets = read_nodes(path("nodes"), f"{where}: nodes")
        labels = found["stiffness"].labels
        if labels is not None:
            used = np.isin(numbers, labels[:, 0])
            nodes, numbers = nodes[used], numbers[used]
        made = {
            key: foreign.by_nodes(one, numbers, f"{where}: {key}")
            if one.labels is not None
            else by_order(one.matrix, self.order)
            for key, one in found.items()
        }
        return Bundle(
            nodes,
            numbers,
            sets,
            made["stiffness"],
            made["mass"],
            made.get("damping"),
            None,
            made.get("prestress"),
        )

    def interface(self, where: str, one: InterfaceModel, known: Bundle) -> Coupling:
        """An interface by rows of nodes."""
        if one.set is not None:
            if one.set not in known.sets:
                got = f"'{one.set}'{closest(one.set, known.sets)}"
                expected = f"one of the sets {listed(sorted(known.sets), one.set, 'none')}"
                raise InputError(say(where, expected, got))
            ids = known.sets[one.set]
            ids = ids[np.isin(ids, known.numbers)]
        else:
            ids = np.array(one.nodes, dtype=np.int64)
        rows = rows_of(ids, known, where)
        center = None if one.center is None else tuple(one.center)
        return Coupling(tuple(rows.tolist()), one.couple == "rigid", center)  # type: ignore[arg-type]

    def compare(self, where: str, body: Body, size: float) -> None:
        """InputError where mass, centre or inertia in the frame of the file are not those that are
        expected of a body of a size [m].
        """
        if self.expected is None:
            return
        center, inertia = rigidity(body)
        center = center - (np.zeros(3) if self.origin is None else np.array(self.origin))
        if self.rotation:
            turn = self.rotation.matrix
            center, inertia = center @ turn, turn.T @ inertia @ turn
        wanted = self.expected.inertia
        moments = None if wanted is None else np.asarray(wanted, dtype=float)
        for what, stated, found, scale in (
            ("mass [kg]", self.expected.mass, body.total_mass, body.total_mass),
            ("center [m]", self.expected.center, center, size),
            (
                "inertia [kg m2]",
                None if moments is None else np.diag(moments) if moments.ndim == 1 else moments,
                inertia,
                float(np.abs(inertia).max()),
            ),
        ):
            if stated is not None and np.abs(np.asarray(stated) - found).max() > STATED * scale:
                remedy = "look at the units of the files (`unit`) and the order of the nodes"
                expected = f"{what} {np.asarray(stated).tolist()}"
                raise InputError(say(where, expected, np.asarray(found).round(9).tolist(), remedy))


def in_metres(known: Bundle, unit: float) -> Bundle:
    """A bundle whose lengths are in `unit` [m], forces in N and times in s, in SI.

    x -> unit x,    K, C, M -> 1 / unit
    """
    if unit == 1.0:
        return known
    K, M, C, Kg = (
        None if one is None else csr_array(one / unit)
        for one in (known.stiffness, known.mass, known.damping, known.prestress)
    )
    assert K is not None
    assert M is not None
    nodes = unit * known.nodes
    return replace(known, nodes=nodes, stiffness=K, mass=M, damping=C, prestress=Kg)


def by_order(matrix: csr_array, order: str) -> csr_array:
    """A matrix (3 n, 3 n) node by node, of one whose unknowns stand so, or component by component."""
    if order == "nodes":
        return matrix
    place = np.arange(matrix.shape[0]).reshape(3, -1).T.ravel()
    return csr_array(matrix[place][:, place])


def rows_of(numbers: Ints, known: Bundle, where: str) -> Ints:
    """Rows of nodes by their numbers; InputError for one that is not there."""
    order = np.argsort(known.numbers, kind="stable")
    place = np.searchsorted(known.numbers[order], numbers)
    rows = order[np.minimum(place, len(order) - 1)]
    missing = np.flatnonzero(known.numbers[rows] != numbers)
    if len(missing):
        expected = f"nodes {known.numbers.min()} to {known.numbers.max()} of its file"
        raise InputError(say(where, expected, f"{numbers[missing[0]]}"))
    return np.asarray(rows)


def read_nodes(path: Path, where: str) -> tuple[Floats, Ints, Groups]:
    """Nodes (n, 3) of a file, their numbers (n,), and sets of numbers by name."""
    if path.suffix.lower() in (".csv", ".txt", ".dat"):
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
        kept = [one.replace(",", " ").replace(";", " ").split() for one in lines]
        try:
            table = np.array([one for one in kept if one and one[0][0].isdigit()], dtype=float)
        except ValueError as problem:
            raise InputError(say(where, "rows of number, x, y, z", f"{problem}")) from problem
        if table.ndim != 2 or table.shape[1] != 4:
            raise InputError(say(where, "rows of number, x, y, z", f"an array {table.shape}"))
        return table[:, 1:], table[:, 0].astype(np.int64), {}
    with warnings.catch_warnings():  # of cells that are neither lines nor plates: nodes are wanted
        warnings.simplefilter("ignore", Notice)
        raw = meshes.load(path, where)
    sets = dict(raw.point_groups)
    for part in (raw.lines, raw.triangles, raw.quads):
        for name, cells in part.groups.items():
            nodes = np.unique(part.nodes[cells])
            sets[name] = np.union1d(sets[name], nodes) if name in sets else nodes
    return raw.points, raw.numbers, sets


def write_bundle(path: Path, known: Bundle) -> None:
    """A bundle as one .npz, which `read_bundle` reads: CSR parts of matrices, names as JSON."""
    arrays = {"nodes": known.nodes, "numbers": known.numbers}
    if known.unit is not None:
        arrays["unit"] = known.unit
    for key in ("stiffness", "mass", "damping"):
        matrix = getattr(known, key)
        if matrix is not None:
            arrays |= {
                f"{key}_{part}": getattr(matrix, part) for part in ("data", "indices", "indptr")
            }
    arrays |= {f"set{k}": ids for k, ids in enumerate(known.sets.values())}
    head = np.frombuffer(json.dumps({"sets": list(known.sets)}).encode(), np.uint8)
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, head=head, **arrays)


def read_bundle(path: Path, where: str) -> Bundle:
    """The bundle of a file; InputError where it is none."""
    try:
        with np.load(path, allow_pickle=False) as data:
            sets = json.loads(data["head"].tobytes())["sets"]
            size = data["nodes"].size

            def matrix(key: str) -> csr_array:
                parts = (data[f"{key}_{part}"] for part in ("data", "indices", "indptr"))
                return csr_array(tuple(parts), shape=(size, size))

            return Bundle(
                data["nodes"],
                data["numbers"],
                {name: data[f"set{k}"] for k, name in enumerate(sets)},
                matrix("stiffness"),
                matrix("mass"),
                matrix("damping") if "damping_data" in data else None,
                data.get("unit"),
            )
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as problem:
        remedy = "write it with fmbs export --matrices, or give stiffness, mass and nodes"
        raise InputError(
            say(f"{where}: {path}", "a file of matrices", f"{problem}", remedy)
        ) from problem
