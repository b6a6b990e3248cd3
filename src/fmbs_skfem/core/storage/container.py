"""Everything that is stored: arrays, texts and structs as one HDF5 file, whole under its name or
not there, damage found and named.

    512 bytes    text: kind, version, size and SHA-256 of all that follows
    HDF5         /tree: structs as JSON text;  /arrays/k: the arrays, which stand in the tree by number

`write` and `read` serve structs: dataclasses that are `storable`, arrays, sparse arrays, numbers,
texts, tuples, lists, dicts. Only those types are ever made from a file, and nothing in it is
executed. `image` and `unpack` serve plain HDF5 for other programs.

Files may come from anywhere. An HDF5 file may name other files, by links, by external storage and
by virtual datasets, and claim arrays without storing them: all that is refused, so that reading
takes no other file and no more memory than this one has bytes. Nothing is read before size and
checksum have been found right, and arrays must fit each other even then (`validation`).
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, Field, field, fields, is_dataclass
from enum import Enum
from functools import lru_cache, singledispatch
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias, TypeVar

import numpy as np
from scipy.sparse import csr_array

from ..algebra.linalg import is_sparse
from ..errors import CorruptFile, InputError, say
from . import durable, validation
from .records import dataclass
from .validation import Misfit, require

if TYPE_CHECKING:
    import h5py

FAMILY = "fmbs_skfem "  #: how the first line of every kind of file begins
HEADER = 512  #: size of the text in front, a user block of HDF5 [bytes]
LINE = 64  #: of the cache, at which arrays begin that are read from a file [bytes]
#: what reading a bad file raises
DAMAGE = (OSError, LookupError, MemoryError, RuntimeError, ValueError, TypeError, AttributeError)

T = TypeVar("T")
Arrays: TypeAlias = list[np.ndarray]
Tree: TypeAlias = dict[str, Any]


@dataclass(frozen=True)
class FileKind:
    """A kind of file."""

    title: str  #: its first line
    name: str  #: in messages, with its article
    remedy: str  #: for a damaged one
    anew: str = "save it anew"  #: how to get one of this version
    version: int = 4  #: the newest that this release knows
    oldest: int = 4  #: that it reads: 4 is the version of release 0.2.0, before which files had none that lasts


@dataclass(frozen=True)
class Dataset:
    """An array or a list of texts of a plain HDF5 file, with its attributes and the options of its
    storage.
    """

    values: np.ndarray | list[str]
    attributes: Mapping[str, Any] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)


@contextmanager
def reading(path: Path, kind: FileKind) -> Iterator[None]:
    """Whatever is wrong with the content of a file is a CorruptFile that names the file, what was
    expected and what was found.
    """
    try:
        yield
    except CorruptFile:
        raise
    except Misfit as problem:
        where = f"{path}: {problem.name}" if problem.name else f"{path}"
        raise CorruptFile(
            say(where, problem.expected, problem.got, problem.remedy or kind.remedy)
        ) from problem
    except DAMAGE as problem:
        got = str(problem).strip("'\"") or type(problem).__name__
        raise CorruptFile(
            say(f"{path}", f"{kind.name} of version {kind.version}", got, kind.remedy)
        ) from problem


# ------------------------------------------------------------------------------------------------------------ files of structs
def write(path: str | Path, kind: FileKind, remedy: str = durable.AGAIN, /, **parts: Any) -> Path:
    """A file of a kind with named parts; InputError names what it cannot hold; NoRoom and
    InputError as of `durable`.

    `remedy`: what to do where the disk is full.
    """
    arrays: Arrays = []
    tree = {name: encode(part, arrays, name) for name, part in parts.items()}
    content = {
        "tree": text(tree),
        "arrays": {str(number): array for number, array in enumerate(arrays)},
    }
    return put(path, kind, content, remedy)


def put(
    path: str | Path, kind: FileKind, content: Mapping[str, Any], remedy: str = durable.AGAIN
) -> Path:
    """A file of a kind whose content is plain HDF5 for other programs, see `image`; NoRoom and
    InputError as of `durable`.
    """
    data = image(content, HEADER)
    data[:HEADER] = header(data[HEADER:], kind)
    return durable.write(path, data, remedy)


def get(path: Path, kind: FileKind) -> dict[str, Any]:
    """What `put` has written; CorruptFile where it is not as it was written."""
    data = path.read_bytes()
    with reading(path, kind):
        check_header(data, kind)
        return unpack(data)


def require_file(path: Path, name: str, remedy: str) -> None:
    """InputError where there is no file; of a folder it says which of its files may be meant."""
    if path.is_dir():
        meant = next((f", such as {one}" for one in sorted(path.glob("*.h5"))), "")
        raise InputError(
            say(f"{path}", f"a file of {name}", "a folder", f"give the file itself{meant}")
        )
    if not path.is_file():
        raise InputError(say(f"{path}", f"a file of {name}", "no file", remedy))


def read(path: str | Path, kind: FileKind, **types: type) -> dict[str, Any]:
    """The named parts of a file of a kind, each of the given type; CorruptFile where it is not as
    it was written.
    """
    place = Path(path)
    require_file(place, kind.name, "save one first")
    content = get(place, kind)
    with reading(place, kind):
        arrays = [content["arrays"][str(number)] for number in range(len(content["arrays"]))]
        tree = json.loads(content["tree"].tobytes())
        parts = {name: decode(tree[name], arrays, name) for name in types}
        for name, part in parts.items():
            validation.check(part, name)
            require(
                isinstance(part, types[name]),
                "",
                f"{types[name].__name__} under '{name}'",
                type(part).__name__,
            )
    return parts


def text(content: Any) -> np.ndarray:
    """JSON text as an array of bytes."""
    return np.frombuffer(json.dumps(content).encode(), dtype=np.uint8)


def header(body: bytes | memoryview, kind: FileKind) -> bytes:
    """The text in front of a body."""
    facts = {"version": kind.version, **seal(body)}
    return (
        "\n".join([kind.title, *(f"{name} {value}" for name, value in facts.items()), ""])
        .encode()
        .ljust(HEADER)
    )


def seal(data: bytes | memoryview) -> dict[str, str]:
    """Size and checksum of bytes."""
    return {"bytes": str(len(data)), "sha256": hashlib.sha256(data).hexdigest()}


def check_header(data: bytes, kind: FileKind) -> None:
    """Kind, version, size and checksum of a file's bytes."""
    title, *lines = data[:HEADER].decode("ascii", "replace").split("\n")
    remedy = f"is it the file that you mean? {kind.remedy}"
    require(title == kind.title, "", f"'{kind.title}' in its first line", f"{title[:40]!r}", remedy)
    facts = dict(line.split(" ", 1) for line in lines if line.count(" ") == 1)
    check_version(facts.get("version"), kind)
    rest = lines[-1].strip(" ")
    require(not rest, "", "spaces behind its first lines", f"{rest[:40]!r}")
    check_seal(data[HEADER:], facts)


def title(path: Path) -> str | None:
    """The first line of a file of this package, whatever its kind; None of any other file. OSError
    where it cannot be read.
    """
    with path.open("rb") as file:
        start = file.read(HEADER).split(b"\n")[0].decode("ascii", "replace")
    return start if start.startswith(FAMILY) else None


def check_version(got: object, kind: FileKind) -> None:
    """A version, a number or its text, that this release reads."""
    number = int(str(got)) if str(got).isdigit() else 0
    if number > kind.version:
        remedy = f"it was written by a newer release; install that, or {kind.anew}"
    else:
        remedy = f"it was written before release 0.2.0: {kind.anew}" if number else ""
    require(
        kind.oldest <= number <= kind.version,
        "",
        f"version {kind.version} of the format",
        f"version {got}",
        remedy,
    )


def check_seal(data: bytes, facts: Mapping[str, str]) -> None:
    """Bytes of the size and with the checksum that stand in `facts`."""
    for name, value in seal(data).items():
        require(
            facts.get(name) == value, "", f"{name} {facts.get(name, 'in the first lines')}", value
        )


# ------------------------------------------------------------------------------------------------------------------ plain HDF5
def image(content: Mapping[str, Any], room: int = 0) -> memoryview:
    """The bytes of an HDF5 file, with room for a text in front; made in memory, because HDF5 ends
    the process on a full disk.

    Arrays and lists of texts become datasets, mappings groups, and other values attributes.
    """
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=room) as file:
        fill(file, content)
    return buffer.getbuffer()


def fill(group: h5py.Group, content: Mapping[str, Any]) -> None:
    """Put a content into a group."""
    import h5py

    for name, value in content.items():
        if isinstance(value, Mapping):
            fill(group.create_group(name), value)
        elif isinstance(value, np.ndarray) and value.ndim and value.dtype.kind in "biuf":
            put_array(group, name, value)
        elif isinstance(value, np.ndarray | list | Dataset):
            item = value if isinstance(value, Dataset) else Dataset(value)
            kind = {"dtype": h5py.string_dtype()} if isinstance(item.values, list) else {}
            group.create_dataset(name, data=item.values, **kind, **item.options).attrs.update(
                item.attributes
            )
        else:
            group.attrs[name] = value


def put_array(group: h5py.Group, name: str, values: np.ndarray) -> None:
    """As `create_dataset`, to the byte, in a quarter of the time: a record of a sweep has some
    twenty arrays.
    """
    from h5py import h5d, h5s

    made = h5d.create(group.id, name.encode(), *kind_of(values.dtype, values.shape))
    made.write(h5s.ALL, h5s.ALL, np.ascontiguousarray(values))


@lru_cache(64)
def kind_of(dtype: np.dtype, shape: tuple[int, ...]) -> tuple[Any, Any, Any]:
    """Kind of numbers, room and options of an array of an HDF5 file."""
    from h5py import h5p, h5s, h5t

    plain = h5p.create(h5p.DATASET_CREATE)
    plain.set_obj_track_times(False)
    return h5t.py_create(dtype, logical=True), h5s.create_simple(shape), plain


def unpack(data: bytes) -> dict[str, Any]:
    """Attributes, arrays and groups of arrays of an HDF5 file; ValueError where one is not in these
    bytes.
    """
    import h5py

    with h5py.File(io.BytesIO(data), "r") as file:
        found = dict(file.attrs)
        for name in file:
            item = member(file, name)
            found[name] = (
                {key: array(item, key) for key in item}
                if isinstance(item, h5py.Group)
                else array(file, name)
            )
    return found


def member(group: h5py.Group, name: str) -> h5py.Group | h5py.Dataset:
    """What stands under a name in a group of this file itself; ValueError for links to elsewhere."""
    import h5py

    link = group.get(name, getlink=True)
    if not isinstance(link, h5py.HardLink):
        raise ValueError(
            f"'{name}' that is {'not there' if link is None else 'a link to elsewhere'}"
        )
    return group[name]


def array(group: h5py.Group, name: str) -> np.ndarray:
    """The numbers under a name, whose every byte is in the file; ValueError where they are
    elsewhere, or nowhere.
    """
    import h5py

    item = member(group, name)
    if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "biuf":
        raise ValueError(f"'{name}' that is no array of numbers")
    if item.external or item.is_virtual:
        raise ValueError(f"'{name}' whose numbers are in another file")
    if item.id.get_storage_size() < item.nbytes:
        raise ValueError(
            f"'{name}' of {item.nbytes} bytes of {item.dtype}, of which {item.id.get_storage_size()} are stored"
        )
    room = np.empty(item.nbytes + LINE, dtype=np.uint8)
    first = -room.ctypes.data % LINE
    found: np.ndarray = room[first : first + item.nbytes].view(item.dtype).reshape(item.shape)
    if found.size:
        item.read_direct(found)
    return found


# --------------------------------------------------------------------------------------------------------------------- structs
TYPES: dict[str, Any] = {}  #: dataclasses that a file may hold, by name
#: their fields that files of earlier releases have, which nothing reads any more
GONE = {"LineSamples": {"EA", "EI"}}
ENUMS: dict[str, Callable[[Any], Any]] = {}  #: name of an enumeration -> its member of a value


def storable(kind: type[T]) -> type[T]:
    """Let files hold a dataclass or an enumeration."""
    if issubclass(kind, Enum):
        ENUMS[kind.__name__] = kind
    else:
        other = TYPES.get(kind.__name__, kind)
        if (other.__module__, other.__qualname__) != (kind.__module__, kind.__qualname__):
            known = (
                f"{kind.__name__}, as {other.__module__}.{other.__qualname__} is called in files"
            )
            raise InputError(
                say(f"class {kind.__qualname__}", "a name of its own", known, "give it another one")
            )
        TYPES[kind.__name__] = kind
    return kind


@singledispatch
def encode(value: Any, arrays: Arrays, where: str) -> Any:
    """A value as JSON; arrays are appended to `arrays` and stand by number. InputError where it is
    none that a file can hold.
    """
    kind = type(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return encode_array(value, arrays)
    if is_sparse(value):
        matrix = csr_array(value)
        return {
            "csr": [encode_array(a, arrays) for a in (matrix.data, matrix.indices, matrix.indptr)],
            "shape": list(matrix.shape),
        }
    if is_dataclass(value) and TYPES.get(kind.__name__) is kind:
        parts = {
            part.name: encode(getattr(value, part.name), arrays, f"{where}.{part.name}")
            for part in fields(value)
        }
        return {"type": kind.__name__, "fields": parts}
    return refuse(value, where)


@encode.register
def _(value: Enum, arrays: Arrays, where: str) -> Any:
    return {"enum": type(value).__name__, "value": value.value}


@encode.register
def _(value: np.generic, arrays: Arrays, where: str) -> Any:
    return value.item()


@encode.register
def _(value: slice, arrays: Arrays, where: str) -> Any:
    return {"slice": [value.start, value.stop, value.step]}


@encode.register
def _(value: list, arrays: Arrays, where: str) -> Any:
    return [encode(item, arrays, f"{where}[{k}]") for k, item in enumerate(value)]


@encode.register
def _(value: tuple, arrays: Arrays, where: str) -> Any:
    return {"tuple": encode([*value], arrays, where)}


@encode.register
def _(value: Mapping, arrays: Arrays, where: str) -> Any:
    pairs = [
        [encode(key, arrays, where), encode(item, arrays, f"{where}.{key}")]
        for key, item in value.items()
    ]
    return {"dict": pairs}


def refuse(value: Any, where: str) -> NoReturn:
    """InputError of what no file can hold."""
    if callable(value):
        remedy = "write it as a text, core.expressions.of_time('sin(2*pi*t)'), or in the scene file"
        raise InputError(
            say(
                where,
                "a function of time that a file can hold",
                f"the Python function {value!r}",
                remedy,
            )
        )
    called = is_dataclass(value) and any(
        callable(getattr(value, part.name)) for part in fields(value)
    )
    remedy = "no file holds its functions of Python: write them in symbols" if called else ""
    wanted = "numbers, texts, arrays, tuples, lists or dicts"
    raise InputError(say(where, wanted, type(value).__name__, remedy))


def can_hold(value: Any) -> bool:
    """Whether a file can hold a value: it is data, and no function of Python."""
    try:
        encode(value, [], "")
    except InputError:
        return False
    return True


def encode_array(value: np.ndarray, arrays: Arrays) -> Tree:
    """An array by number; the memory order is kept, because it decides the order of summation in
    products.
    """
    fortran = value.ndim > 1 and value.flags.f_contiguous and not value.flags.c_contiguous
    arrays.append(value.T if fortran else value)
    return {"array": len(arrays) - 1, "order": "F" if fortran else "C"}


def decode(tree: Any, arrays: Sequence[np.ndarray], where: str) -> Any:
    """The value of a JSON tree; an error of DAMAGE where it is none."""
    match tree:
        case list():
            return [decode(item, arrays, where) for item in tree]
        case {"array": number}:
            return arrays[number].T if tree["order"] == "F" else arrays[number]
        case {"csr": parts, "shape": shape}:
            return sparse([decode(part, arrays, where) for part in parts], tuple(shape), where)
        case {"type": name, "fields": parts}:
            return struct(
                name,
                {key: decode(item, arrays, f"{where}.{key}") for key, item in parts.items()},
                where,
            )
        case {"enum": name, "value": value}:
            return ENUMS[name](value)
        case {"slice": ends}:
            return slice(*ends)
        case {"tuple": items}:
            return tuple(decode(item, arrays, where) for item in items)
        case {"dict": pairs}:
            return {
                decode(key, arrays, where): decode(item, arrays, f"{where}.{key}")
                for key, item in pairs
            }
        case dict():
            raise ValueError(f"an unknown kind of value at {where} with the keys {sorted(tree)}")
    return tree


def sparse(parts: Sequence[np.ndarray], shape: tuple[int, ...], where: str) -> csr_array:
    """A sparse array of its data, indices and row pointers."""
    data, indices, indptr = parts
    kinds = data.dtype == np.float64 and indices.dtype.kind == indptr.dtype.kind == "i"
    require(
        kinds,
        where,
        "float64 numbers and integer indices",
        f"{data.dtype}, {indices.dtype} and {indptr.dtype}",
    )
    rises = (
        indptr.ndim == 1
        and len(indptr)
        and (np.diff(indptr) >= 0).all()
        and indptr[-1] == len(indices)
    )
    require(
        bool(rises), where, f"row pointers that rise to {len(indices)}", validation.describe(indptr)
    )
    try:
        matrix = csr_array((data, indices, indptr), shape=shape)
        matrix.check_format(full_check=True)
    except ValueError as problem:
        raise Misfit(where, "a sparse array", problem) from problem
    return matrix


def has_default(part: Field[Any]) -> bool:
    """Whether a field of a dataclass need not be given, as one that releases after a file have added."""
    return part.default is not MISSING or part.default_factory is not MISSING


def struct(name: str, values: Tree, where: str) -> Any:
    """A storable dataclass of its own fields, of which a file may lack those that have a default."""
    if name not in TYPES:
        remedy = (
            "import the Python file that declares it first, or name it: fmbs --extension FILE ..."
        )
        raise Misfit(
            where,
            "types of this package, or of Python files that were imported",
            f"the unknown type {name}",
            remedy,
        )
    kind = TYPES[name]
    values = {key: value for key, value in values.items() if key not in GONE.get(name, ())}
    expected = {part.name for part in fields(kind)}
    later = {part.name for part in fields(kind) if has_default(part)}
    got = set(values)
    if not expected - later <= got <= expected:
        raise ValueError(
            f"other fields of {name} at {where}: missing {sorted(expected - got)}, unknown {sorted(got - expected)}"
        )
    return kind(**values)
