"""Reduced models as files: a model that runs again without the meshes and the full model it came from.

    512 bytes    text: format, version, size and SHA-256 of all that follows
    HDF5         /tree: the System and the notes as JSON text;  /arrays/k: the arrays, which stand in the tree by number

Nothing is read before size and checksum have been found right. Only the types listed in `TYPES` are ever made from a file, and no
text of a file is executed: functions of time are postfix programs of core.expressions. Arrays must fit each other, even where the
checksum is right: `soundness`. Other programs read the file as HDF5 with a user block. `write` and `contents` serve other kinds of
files too, each with a first line of its own.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any, TypeAlias

import h5py
import numpy as np
from scipy.sparse import csr_array, eye_array

from ..bodies import laws
from ..bodies.body import Cells
from ..bodies.laws import Law
from ..core import durable, hdf5
from ..core.errors import CorruptFile, InputError, NoRoom, say
from ..core.expressions import Expression
from ..core.linalg import is_sparse
from ..core.problems import shown
from ..dynamics.integration import integrate
from ..dynamics.scheme import GeneralizedAlpha, Newton
from ..dynamics.trajectory import Trajectory
from ..systems import quartic
from ..systems.quartic import Quartic
from ..systems.signals import Cosine, Sine
from ..systems.system import Affine, Constraints, Elastic, Line, LoadKind, Loads, Output, PointLaw, Sampled, Skin, System
from . import extent, soundness
from .affine import Order, ParametricCase, Varying
from .cases import Case
from .ecsw import Sample
from .parameters import Parameter, Scale
from .sampling import Level, Selection
from .soundness import Unsound

FORMAT = "fmbs_skfem reduced model"
VERSION = 2
HEADER = 512  #: size of the text in front, a user block of HDF5 [bytes]
ENUMS: dict[str, type[Enum]] = {kind.__name__: kind for kind in (LoadKind, Level, Scale)}
TYPES: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        *(System, Affine, Cells, Sampled, Quartic, Elastic, Constraints, PointLaw, Loads, Line, Skin, Output),
        *(Expression, Cosine, Sine, Selection, Sample),
        *(Case, GeneralizedAlpha, Newton, Parameter, Order, Varying, ParametricCase),
    )
}

Arrays: TypeAlias = list[np.ndarray]


@dataclass(frozen=True)
class Saved:
    """What a file holds."""

    system: System
    notes: dict[str, Any]


def save(system: System, path: str | Path, **notes: Any) -> Path:
    """Write a reduced system and notes about it (numbers, texts, arrays, tuples, lists, dicts, selections) to a file.

    The form with all multipliers, `system.full`, is left out. The file appears under its name when it is complete.
    """
    return write(path, FORMAT, system=replace(system, full=None), notes=notes)


def case_of(
    saved: Saved, duration: float | None = None, step: float | None = None, where: str = "reduced model"
) -> tuple[Case, list[str]]:
    """The case of a model, and where it leaves the training, with a notice; times [s] not given are those of the training."""
    times = trained_times(saved.notes, where)
    missing = [name for name, value in (("duration", duration), ("step", step)) if value is None and name not in times]
    if missing:
        raise InputError(say(where, "a duration and a step", f"no {' and no '.join(missing)}", "give both in seconds"))
    end, h = duration or times["duration"], step or times["step"]
    scheme = GeneralizedAlpha(times.get("step", h), times.get("rho_inf", 0.8))
    trained = Case(saved.system, scheme, times.get("duration", end))
    case = extent.timed(trained, duration, step, where)
    found = extent.departures(trained, case)
    extent.warn(found)
    return case, found


def run(saved: Saved, every: int | np.ndarray = 1, duration: float | None = None, step: float | None = None) -> Trajectory:
    """The motion of a model over the times of its training, or others [s]; a longer run or another step with a notice."""
    case, _ = case_of(saved, duration, step)
    return integrate(case.system, case.scheme, case.duration, case.newton, every)


def trained_times(notes: Mapping[str, Any], where: str) -> dict[str, float]:
    """Duration, step and spectral radius of the training, as far as the notes of a file have them."""
    known = notes.get("report", {})
    found = {key: known[key] for key in ("duration", "step", "rho_inf") if isinstance(known, Mapping) and key in known}
    wrong = [key for key, value in found.items() if type(value) not in (int, float) or not math.isfinite(value)]
    if wrong:
        remedy = "copy the file again, or train and save the model anew"
        raise CorruptFile(say(f"{where}: notes.report.{wrong[0]}", "a number", shown(found[wrong[0]]), remedy))
    return {key: float(value) for key, value in found.items()}


def write(path: str | Path, kind: str, **parts: Any) -> Path:
    """A file of a kind, its first line, with named parts."""
    target, arrays = Path(path), list[np.ndarray]()
    tree = {name: encode(part, arrays, name) for name, part in parts.items()}
    try:
        with durable.room(target), durable.place(target) as part:
            part.write_bytes(image(json.dumps(tree), arrays, kind))
    except NoRoom:
        raise
    except OSError as problem:
        raise InputError(say(str(target), "a place that can be written", problem)) from problem
    return target


def image(tree: str, arrays: Arrays, kind: str) -> memoryview:
    """The bytes of a file; made in memory, because HDF5 ends the process where it has no room on the disk."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=HEADER) as file:
        file["tree"] = np.frombuffer(tree.encode(), dtype=np.uint8)
        group = file.create_group("arrays")
        for number, array in enumerate(arrays):
            group[str(number)] = array
    found = buffer.getbuffer()
    found[:HEADER] = header(found[HEADER:], kind)
    return found


def header(body: bytes | memoryview, kind: str = FORMAT) -> bytes:
    """The text in front of a body."""
    text = f"{kind}\nversion {VERSION}\nbytes {len(body)}\nsha256 {hashlib.sha256(body).hexdigest()}\n"
    return text.encode().ljust(HEADER)


def load(path: str | Path) -> System:
    """The system of a file."""
    return read(path).system


def read(path: str | Path) -> Saved:
    """The system of a file and its notes; CorruptFile names what is wrong with a file that is not as it was written."""
    return Saved(**contents(path, FORMAT, system=System, notes=dict))


def contents(path: str | Path, kind: str, **types: type) -> dict[str, Any]:
    """The named parts of a file of a kind, each of the given type."""
    place = str(path)
    if not Path(path).is_file():
        raise InputError(say(place, "a file of a reduced model", "no file", "save one first"))
    check_header(Path(path).read_bytes(), place, kind)
    try:
        with h5py.File(path, "r") as file:
            text, group = hdf5.array(file, "tree").tobytes(), hdf5.member(file, "arrays")
            arrays = [hdf5.array(group, str(number)) for number in range(len(group))]
        tree = json.loads(text)
        parts = {name: decode(tree[name], arrays, name) for name in types}
        for name, part in parts.items():
            soundness.check(part, name)
    except Unsound as problem:
        raise corrupt(f"{place}: {problem.name}", problem.expected, problem.got) from problem
    except hdf5.DAMAGE as problem:
        raise corrupt(place, f"content of version {VERSION}", str(problem).strip("'\"") or type(problem).__name__) from problem
    for name, part in parts.items():
        if not isinstance(part, types[name]):
            raise corrupt(place, f"{types[name].__name__} under '{name}'", type(part).__name__)
    return parts


def check_header(data: bytes, place: str, kind: str = FORMAT) -> None:
    """Kind, version, size and checksum of a file's bytes."""
    lines = data[:HEADER].decode("ascii", "replace").split("\n")
    if lines[0] != kind:
        raise corrupt(place, f"'{kind}' in its first line", f"{lines[0][:40]!r}")
    facts = dict(line.split(" ", 1) for line in lines[1:] if line.count(" ") == 1)
    version = facts.get("version", "")
    if version.isdigit() and int(version) > VERSION:
        remedy = "it was written by a newer release; install that, or save the model with this one"
        raise CorruptFile(say(place, f"version {VERSION} of the format", f"version {version}", remedy))
    body = data[HEADER:]
    known = version if version.isdigit() and 1 <= int(version) <= VERSION else str(VERSION)
    found = {"version": known, "bytes": str(len(body)), "sha256": hashlib.sha256(body).hexdigest()}
    for name, value in found.items():
        if facts.get(name) != value:
            raise corrupt(place, f"{name} {facts.get(name, 'in the first lines')}", value)


def corrupt(place: str, expected: str, got: object) -> CorruptFile:
    return CorruptFile(say(place, expected, got, "copy the file again, or train and save the model anew"))


def encode(value: Any, arrays: Arrays, where: str) -> Any:
    """A value as JSON; arrays are appended to `arrays` and stand by number."""
    if isinstance(value, Enum):
        return {"enum": type(value).__name__, "value": value.value}
    if isinstance(value, Law):
        return {"enum": "Law", "value": laws.number(value)} if value in laws.NUMBERS.values() else {"law": value.name}
    if isinstance(value, np.generic):
        return encode(value.item(), arrays, where)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return stored(value, arrays)
    if is_sparse(value):
        matrix = csr_array(value)
        parts = [stored(part, arrays) for part in (matrix.data, matrix.indices, matrix.indptr)]
        return {"csr": parts, "shape": list(matrix.shape)}
    if isinstance(value, slice):
        return {"slice": [value.start, value.stop, value.step]}
    if isinstance(value, tuple):
        return {"tuple": [encode(item, arrays, f"{where}[{k}]") for k, item in enumerate(value)]}
    if isinstance(value, list):
        return [encode(item, arrays, f"{where}[{k}]") for k, item in enumerate(value)]
    if isinstance(value, Mapping):
        pairs = [(encode(name, arrays, where), encode(item, arrays, f"{where}.{name}")) for name, item in value.items()]
        return {"dict": [list(pair) for pair in pairs]}
    name = type(value).__name__
    if is_dataclass(value) and TYPES.get(name) is type(value):
        parts_of = {field.name: encode(getattr(value, field.name), arrays, f"{where}.{field.name}") for field in fields(value)}
        return {"type": name, "fields": parts_of}
    if callable(value):
        remedy = "write it as a text, core.expressions.of_time('sin(2*pi*t)'), or in the scene file"
        raise InputError(say(where, "a function of time that a file can hold", f"the Python function {value!r}", remedy))
    raise InputError(say(where, "numbers, texts, arrays, tuples, lists or dicts", name))


def stored(array: np.ndarray, arrays: Arrays) -> dict[str, Any]:
    """An array by number; the memory order is kept, because it decides the order of summation in products."""
    fortran = array.ndim > 1 and array.flags.f_contiguous and not array.flags.c_contiguous
    arrays.append(array.T if fortran else array)
    return {"array": len(arrays) - 1, "order": "F" if fortran else "C"}


def decode(tree: Any, arrays: Sequence[np.ndarray], where: str) -> Any:
    """The value of a JSON tree; ValueError, LookupError or TypeError where it is none."""
    if isinstance(tree, list):
        return [decode(item, arrays, where) for item in tree]
    if not isinstance(tree, dict):
        return tree
    for key, rule in RULES.items():
        if key in tree:
            return rule(tree, arrays, where)
    raise ValueError(f"an unknown kind of value at {where} with the keys {sorted(tree)}")


def decode_array(tree: dict[str, Any], arrays: Sequence[np.ndarray], where: str) -> np.ndarray:
    array = arrays[tree["array"]]
    return array.T if tree["order"] == "F" else array


def decode_csr(tree: dict[str, Any], arrays: Sequence[np.ndarray], where: str) -> csr_array:
    data, indices, indptr = (decode(part, arrays, where) for part in tree["csr"])
    if (data.dtype, indices.dtype.kind, indptr.dtype.kind) != (np.float64, "i", "i"):
        raise Unsound(where, "float64 numbers and integer indices", f"{data.dtype}, {indices.dtype} and {indptr.dtype}")
    if indptr.ndim != 1 or not len(indptr) or (np.diff(indptr) < 0).any() or indptr[-1] != len(indices):
        raise Unsound(where, f"row pointers that rise to {len(indices)}", soundness.told(indptr))
    try:
        matrix = csr_array((data, indices, indptr), shape=tuple(tree["shape"]))
        matrix.check_format(full_check=True)
    except ValueError as problem:
        raise Unsound(where, "a sparse array", problem) from problem
    return matrix


def decode_type(tree: dict[str, Any], arrays: Sequence[np.ndarray], where: str) -> Any:
    """A listed dataclass with exactly its own fields."""
    kind = TYPES.get(tree["type"])
    if kind is None:
        raise ValueError(f"the unknown type {tree['type']} at {where}")
    values = {name: decode(item, arrays, f"{where}.{name}") for name, item in tree["fields"].items()}
    values = with_lengths(values) if kind is System and "metric" not in values else values
    expected, got = {field.name for field in fields(kind)}, set(values)
    if expected != got:
        lists = f"missing {sorted(expected - got)}, unknown {sorted(got - expected)}"
        raise ValueError(f"other fields of {tree['type']} at {where}: {lists}")
    found = kind(**values)
    return aligned(found, where) if isinstance(found, Quartic) else found


def with_lengths(values: dict[str, Any]) -> dict[str, Any]:
    """The fields of a system of version 1: its tolerance refers to the norm of all coordinates, from the origin of the scene."""
    return values | {"metric": csr_array(eye_array(len(values["x0"]))), "weight": 1.0, "origin": np.zeros(values["dim"])}


def aligned(polynomial: Quartic, where: str) -> Quartic:
    """The polynomial with its coefficients where they are read fastest."""
    modes = soundness.span(polynomial.columns, f"{where}.columns", polynomial.columns.start + len(polynomial.coefficients))
    soundness.numbers(polynomial.coefficients, f"{where}.coefficients", quartic.length(modes))
    coefficients = quartic.aligned(len(polynomial.coefficients))
    coefficients[:] = polynomial.coefficients
    return replace(polynomial, coefficients=coefficients)


def decode_enum(kind: str, value: Any) -> Enum | Law:
    return laws.NUMBERS[value] if kind == "Law" else ENUMS[kind](value)


def decode_dict(tree: dict[str, Any], arrays: Sequence[np.ndarray], where: str) -> dict[Any, Any]:
    return {decode(name, arrays, where): decode(item, arrays, f"{where}.{name}") for name, item in tree["dict"]}


RULES: dict[str, Callable[[dict[str, Any], Sequence[np.ndarray], str], Any]] = {
    "array": decode_array,
    "csr": decode_csr,
    "type": decode_type,
    "enum": lambda tree, arrays, where: decode_enum(tree["enum"], tree["value"]),
    "law": lambda tree, arrays, where: laws.find(tree["law"]),
    "slice": lambda tree, arrays, where: slice(*tree["slice"]),
    "tuple": lambda tree, arrays, where: tuple(decode(item, arrays, where) for item in tree["tuple"]),
    "dict": decode_dict,
}
