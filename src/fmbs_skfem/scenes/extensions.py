"""Python files that a scene names: they declare joints, loads, outputs, sections, laws and
interpolations of its author's own.

    extensions: [my_joint.py]            beside the scene, or anywhere in its project folder, as meshes

The files are run before the scene is checked, with the rights of whoever reads it, and only by
consent: see `core.consents`. A warning names them. A file is run once a process; one that has
changed since is refused, because its classes may be in use. Worker processes find its classes by
the name of its module.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import importlib.util
import sys
import traceback
from collections.abc import Iterator, Sequence
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import TYPE_CHECKING

from ..core import consents, own_words
from ..core.errors import InputError
from ..core.notices import remark
from ..core.own_words import PREFIX, file_of
from ..core.values.problems import Found, Problem, shown
from ..shapes import meshes
from . import yamlfile

if TYPE_CHECKING:
    from .schema import Scene

RUN: dict[str, str] = {}  #: SHA-256 of the files that were run, by module


class SourceLoader(SourceFileLoader):
    """Runs the text of a file, never bytecode that lies beside it: consent is to what can be read."""

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


class ExtensionFinder:
    """Modules of files by the path in their name, so that what they declare can be sent to other
    processes.

    It is no `importlib.abc.MetaPathFinder`, which loads a dozen modules that a check of a scene has
    no use for.
    """

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not name.startswith(PREFIX):
            return None
        file = file_of(name)
        return importlib.util.spec_from_file_location(name, file, loader=SourceLoader(name, file))


sys.meta_path.append(ExtensionFinder())


def load(named: object, folder: Path) -> list[Found]:
    """Run the files that the section `extensions` of a scene in `folder` names; what is wrong with
    them.
    """
    if named is None:
        return []
    if not isinstance(named, list) or not all(isinstance(text, str) for text in named):
        return [
            (
                ("extensions",),
                Problem(
                    "a list of Python files, their paths from the folder of the scene", shown(named)
                ),
            )
        ]
    found: list[Found] = []
    files = dict[int, Path]()
    digests = dict[Path, str]()
    for k, text in enumerate(named):
        with listing(found, k, "a Python file of the project"):
            files[k] = meshes.path(text, folder, what="extension")
            digests[files[k]] = digest_of(files[k])
    if found:
        return found
    try:
        consents.require(
            {path: digest for path, digest in digests.items() if RUN.get(module_of(path)) != digest}
        )
    except Problem as problem:
        return [(("extensions",), problem)]
    for k, path in files.items():
        with listing(found, k, "a Python file that runs"):
            run(path)
    return found


@contextlib.contextmanager
def listing(found: list[Found], k: int, expected: str) -> Iterator[None]:
    """Add what is wrong with file number k to `found`: errors that are no problems stand against
    what was `expected`.
    """
    try:
        yield
    except Problem as problem:
        found.append((("extensions", k), problem))
    except InputError as error:
        found.append((("extensions", k), Problem(expected, str(error))))


def modules(named: Sequence[str] | None, folder: Path) -> tuple[str, ...]:
    """Modules of the files that a scene lists, once they have been run, and of those that a call
    has named.
    """
    listed = (module_of(meshes.path(text, folder, what="extension")) for text in named or ())
    return tuple(dict.fromkeys([*listed, *sorted(own_words.EVERYWHERE)]))


def module_of(path: Path) -> str:
    """The name of the module of a file."""
    return PREFIX + str(path).encode().hex()


def own_words_in(scene: Scene) -> Iterator[str]:
    """Words in a scene that mean those of its files, although the package has them as well."""
    typed = set(texts_in(None if scene.node is None else yamlfile.plain(scene.node)))
    for module in modules(scene.extensions, scene.folder):
        if shared := sorted(own_words.SHARED.get(module, set()) & typed):
            quoted = ", ".join(f"'{word}'" for word in shared)
            yield f"{quoted} {'is that' if len(shared) == 1 else 'are those'} of {Path(file_of(module)).name}, not of the package"


def texts_in(value: object) -> Iterator[str]:
    """All texts that are values in what was read of a file."""
    if isinstance(value, str):
        yield value
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    for part in inside:
        yield from texts_in(part)


def digest_of(path: Path) -> str:
    """SHA-256 of a file; Problem where it is no Python file."""
    if path.suffix != ".py" or not path.is_file():
        raise Problem(
            "a Python file (.py)", str(path) if path.exists() else f"{path}, which is not there"
        )
    return hashlib.sha256(path.read_bytes()).hexdigest()


def place_of(error: BaseException) -> str:
    """File and line of an extension that an exception comes from or has passed, or its class that
    lacks something; else nothing.
    """
    chain = [one.__traceback__ for one in (error, error.__cause__) if one is not None]
    frames = [frame for one in chain for frame in reversed(traceback.extract_tb(one))]
    files = {file_of(name) for name in sys.modules if name.startswith(PREFIX)}
    if line := next(
        (f"{frame.filename}, line {frame.lineno}" for frame in frames if frame.filename in files),
        "",
    ):
        return line
    owner = type(getattr(error, "obj", None))  # of an AttributeError
    return (
        f"{file_of(owner.__module__)}, class {owner.__qualname__}"
        if owner.__module__.startswith(PREFIX)
        else ""
    )


def class_of(error: BaseException) -> str:
    """The class or function of an extension that was at hand where an exception came, the innermost
    first; else nothing.

    That what it returned is of no use shows only where the package goes on with it, in no line of
    its file.
    """
    for frame, _ in reversed(list(traceback.walk_tb(error.__traceback__))):
        for value in frame.f_locals.values():
            owner = value if isinstance(value, type | FunctionType) else type(value)
            if str(owner.__module__).startswith(PREFIX):
                what = "class" if isinstance(owner, type) else "function"
                return f"{file_of(owner.__module__)}, {what} {owner.__qualname__}"
    return ""


def run(path: Path) -> None:
    """Run a file, once a process."""
    name = module_of(path)
    digest = digest_of(path)
    if RUN.get(name, digest) != digest:
        raise Problem(
            "a file that stays the same while it is in use",
            f"{path}, which has changed",
            "start Python anew",
        )
    if name in RUN:
        return
    if name not in sys.modules:  # as in a worker process that has found its classes
        remark(f"runs the Python file {path}")
    try:
        importlib.import_module(name)
    except (Exception, SystemExit) as error:
        last = next(
            (
                frame
                for frame in reversed(traceback.extract_tb(error.__traceback__))
                if frame.filename == str(path)
            ),
            None,
        )
        where = f" in {path.name}, line {last.lineno}" if last is not None else ""
        raise Problem(
            "a Python file that runs", f"{type(error).__name__}{where}: {error}"
        ) from error
    RUN[name] = digest
