"""What a study leaves: JSON reports with checksums, and all that their numbers depend on."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import platform
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..core import installed
from ..core.errors import CorruptFile, FmbsError, InputError, say
from ..core.storage import durable
from ..core.values.problems import shown

if TYPE_CHECKING:
    import numpy as np

    from ..scenes import Scene

REPORT, CHECKSUMS = "report.json", "sha256"
ALL = "*"
#: what readers of records take for granted of values that are there: kinds, lists of a kind, and
#: mappings of kinds by name; of two, the second one is nothing, which may stand there too
RECORD: dict[str, Any] = {
    **dict.fromkeys(("scene", "name", "file", "model", "fingerprint"), str),
    "end": float,
    "notices": [str],
    "parameters": {ALL: object},
    "units": {ALL: str},
    "parameter_units": {ALL: str},
    "provenance": {
        "file": str,
        "files": {ALL: str},
        "scene": ({"analysis": {"duration": float}}, None),
    },
    CHECKSUMS: {ALL: str},
}
#: what shows that a record has not what its readers look for
UNREADABLE = LookupError, TypeError, ValueError, AttributeError, ArithmeticError
EXTREMES: dict[str, Any] = {"outputs": {ALL: {ALL: float}}}  #: of records that have units
VERSIONS = ("numpy", "scipy", "numba", "scikit-fem", "scikit-learn", "pyamg", "h5py", "meshio")


def make_folder(out: Path) -> Path:
    """A folder that can be written, made where there is none, before anything is solved for it."""
    if out.exists() and not out.is_dir():
        raise InputError(say(f"--out {out}", "a folder", "a file", "choose another name"))
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise InputError(
            say(
                f"--out {out}",
                "a folder that can be made",
                problem.strerror,
                "choose another place",
            )
        ) from problem
    if not os.access(out, os.W_OK):
        raise InputError(
            say(
                f"--out {out}",
                "a folder that can be written",
                "one that is read-only",
                "choose another place",
            )
        )
    return out


def read_fingerprint(path: Path) -> str:
    """The fingerprint in a JSON file of a run; empty where there is none."""
    try:
        return str(json.loads(path.read_text(encoding="utf-8"))["fingerprint"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def write_json(path: Path, report: Mapping[str, Any]) -> Path:
    """Write a report, complete or not at all."""
    with durable.place(path) as part:
        part.write_text(dumps(report) + "\n", encoding="utf-8")
    return path


def write_csv(path: Path, columns: Mapping[str, np.ndarray]) -> Path:
    """Columns (s,) with their names, complete or not at all."""
    import numpy as np

    with durable.place(path) as part:
        np.savetxt(
            part,
            np.column_stack([*columns.values()]),
            delimiter=",",
            header=",".join(columns),
            comments="",
            fmt="%.15g",
        )
    return path


def write_report(out: Path | None, found: Mapping[str, Any], record: str = REPORT) -> None:
    """Write the report of a study, and the SHA-256 of its own content and of the other files in
    `files`.
    """
    if out is None:
        return
    others = [
        name for name in (Path(path).name for path in found.get("files", ())) if name != record
    ]
    sums = {record: checksum(found), **{name: durable.sha256(out / name) for name in others}}
    write_json(out / record, {**found, CHECKSUMS: sums})


def read_record(path: Path) -> dict[str, Any] | None:
    """The record of a study in a JSON file, None of other files; CorruptFile where its readers
    could not go on with a value.
    """
    found = read_json(path)
    if not isinstance(found, dict) or "status" not in found:
        return None
    require_shape(path, found, RECORD | (EXTREMES if "units" in found else {}))
    return found


def require_shape(path: Path, value: Any, shape: Any, *place: str) -> None:
    """CorruptFile where the value at a place of a file does not have a shape as in `RECORD`."""
    for keys, expected, got in misfits(value, shape):
        name = ".".join((*place, *keys)) or "its content"
        raise corrupt(path, f"{expected} as {name}", shown(got))


@contextlib.contextmanager
def reading(path: Path) -> Iterator[None]:
    """Whatever reads the record at a path: CorruptFile where that has not what a study writes."""
    try:
        yield
    except FmbsError:
        raise
    except UNREADABLE as problem:
        got = f"{type(problem).__name__} {problem}"
        raise corrupt(path, "a record as a study writes it", got) from problem


def read_json(path: Path) -> Any:
    """What is in a JSON file; CorruptFile where that is none, or has halves of letters, which no
    file of text can hold.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        json.dumps(found, ensure_ascii=False).encode()
        return found
    except (ValueError, RecursionError) as problem:
        raise corrupt(path, "JSON", problem) from problem
    except OSError as problem:
        raise corrupt(path, "a file that can be read", problem.strerror) from problem


def misfits(value: Any, shape: Any) -> Iterator[tuple[tuple[str, ...], str, Any]]:
    """Keys, what is expected, and what is there instead, of all that does not have the shape that
    it has in `RECORD`.
    """
    if isinstance(shape, tuple):
        if value is None:
            return
        shape = shape[0]
    if isinstance(shape, dict | list):
        if not isinstance(value, type(shape)):
            yield (), "a mapping" if isinstance(shape, dict) else "a list", value
            return
        inside = value.items() if isinstance(value, dict) else enumerate(value)
        for key, one in inside:
            inner = shape.get(key, shape.get(ALL)) if isinstance(shape, dict) else shape[0]
            if one is None and isinstance(shape, list):
                yield (str(key),), "a value", one
            yield from (
                ((str(key), *keys), expected, got) for keys, expected, got in misfits(one, inner)
            )
    elif shape is float and (isinstance(value, bool) or not isinstance(value, int | float | None)):
        yield (), "a number", value
    elif shape is str and (not isinstance(value, str | None) or "\0" in (value or "")):
        yield (), "a text", value


def verify_checksums(folder: Path) -> list[Path]:
    """The files that reports in a folder vouch for, every byte as it was written; CorruptFile names
    one that is not.
    """
    found = []
    for record in sorted(folder.glob("*.json")):
        content = read_json(record)
        if not isinstance(content, dict) or not isinstance(content.get(CHECKSUMS), dict):
            continue
        for name, told in content.pop(CHECKSUMS).items():
            path = folder / name
            if not path.is_file():
                raise corrupt(path, "the file", "none")
            got = checksum(content) if path == record else durable.sha256(path)
            if got != told:
                raise corrupt(path, f"sha256 {told}", got)
            found.append(path)
    return found


def checksum(content: Mapping[str, Any]) -> str:
    """SHA-256 of a JSON object."""
    return hashlib.sha256(dumps(content).encode()).hexdigest()


def corrupt(path: Path, expected: str, got: object) -> CorruptFile:
    return CorruptFile(
        say(
            f"{path}",
            expected,
            got,
            "restore the file from a copy, or run the scene anew with --force",
        )
    )


def plain(value: Any) -> Any:
    """A value that JSON can hold: arrays as lists, numbers that are not finite as null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def dumps(value: Any) -> str:
    """JSON text."""
    return json.dumps(plain(value), indent=2, ensure_ascii=False, allow_nan=False)


def fingerprint(scene: Scene) -> str:
    """Hash of the scene with its parameters and of the files it reads; equal for runs that compute
    the same.
    """
    kind = type(scene.analysis).__name__
    word = scene.analysis.word
    analysis = f"{kind}(type={word!r}, {repr(scene.analysis).removeprefix(f'{kind}(')}"
    digest = hashlib.sha256(f"({sorted(scene.parameters.items())!r}, {analysis})".encode())
    if scene.choice is not None:  # which stands in no file
        digest.update(repr(scene.choice).encode())
    for path in scene_files(scene):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def hash_of_code(scene: Scene) -> str:
    """Hash of the Python files that a scene runs, empty where it has none."""
    from ..shapes import meshes

    read = [meshes.path(name, scene.folder, True).read_bytes() for name in scene.extensions or ()]
    return hashlib.sha256(b"".join(read)).hexdigest() if read else ""


def scene_files(scene: Scene) -> list[Path]:
    """The file of a scene and the mesh, surface, Python and table files it reads, each once."""
    from ..shapes import meshes

    names = {name for body in scene.bodies.values() for name in body.files().values()}
    names |= {*(scene.extensions or ()), *(table.file for table in scene.tables.values())}
    read = [meshes.path(name, scene.folder, allow_outside=True) for name in sorted(names)]
    return [path.absolute() for path in ([scene.path] if scene.path else []) + read]


def provenance(
    scene: Scene | None = None,
    files: Iterable[Path] = (),
    seeds: Mapping[str, int] | None = None,
    workers: int | None = 1,
) -> dict[str, Any]:
    """All that the numbers of a result depend on: values of the scene, contents of files,
    libraries, machine, threads, seeds.

    `files` and `seeds` are those beside the ones of the scene; `workers` processes shared the work,
    None where that is not known yet. On one machine with one thread, the same provenance gives the
    same bits.
    """
    from ..core.values import mappings

    read = [*(scene_files(scene) if scene else ()), *(path.absolute() for path in files)]
    training = {"training": scene.training.seed} if scene and scene.training else {}
    return {
        "scene": mappings.plain(scene) if scene else None,
        "file": str(scene.path.absolute()) if scene and scene.path else None,
        "files": {str(path): durable.sha256(path) for path in read},
        **environment(workers),
        "seeds": {"solver": 0, **training, **(seeds or {})},
    }


def provenance_to_keep(origin: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    """The provenance `origin` of a scene as a part or a reduced model keeps it: files are named
    from the folder of the scene.

    Such files are passed on, and whoever gets one has other folders. Files that stand elsewhere
    have their names alone.
    """
    found = plain(origin)
    assert isinstance(found, dict)
    root = Path(found["file"]).parent if found["file"] else scene.folder.absolute()
    file = None if found["file"] is None else name_from(root, found["file"])
    return {
        **found,
        "file": file,
        "files": {name_from(root, path): digest for path, digest in found["files"].items()},
    }


def name_from(root: Path, path: str) -> str:
    """The name of a file for somebody who has the folder `root`; its last part where it stands two
    folders above or elsewhere.
    """
    try:
        relative = Path(os.path.relpath(path, root))
    except ValueError:  # on another drive
        return Path(path).name
    return Path(path).name if relative.parts[:2] == ("..", "..") else relative.as_posix()


def environment(workers: int | None = 1) -> dict[str, Any]:
    """Libraries, machine and threads."""
    from threadpoolctl import threadpool_info

    blas = max(
        (info["num_threads"] for info in threadpool_info() if info["user_api"] == "blas"), default=1
    )
    return {
        "versions": versions(),
        "machine": {
            "system": platform.platform(),
            "processor": processor(),
            "cores": os.cpu_count(),
        },
        "threads": {"blas": blas, "workers": workers},
    }


def versions() -> dict[str, str]:
    """Versions that a result depends on, of what is installed."""
    known = {name: text for name in VERSIONS if (text := installed.version(name))}
    return {"fmbs_skfem": __version__, "python": sys.version.split()[0], **known}


def processor() -> str:
    """The name of the processor."""
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(
            line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")
        )
    return platform.machine()
