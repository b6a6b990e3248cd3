"""The process that reads one foreign file, see `door`: it limits its memory, reads, and writes what
`exchange` or JSON holds.

Notices go out as a JSON list on stdout, the message of a refusal as a JSON text on stderr.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import sys
import warnings
from pathlib import Path

from ..core.errors import InputError, MissingFeature
from ..core.notices import Notice
from . import door

#: ending of a file -> module of this folder whose `read(path, target, where)` writes the target
FORMATS = {
    ".inp": "abaqus",
    ".bdf": "nastran",
    ".nas": "nastran",
    ".med": "med",
    ".vtk": "vtk",
    ".igs": "iges",
    ".iges": "iges",
    ".3dm": "rhino",
}


def main(source: str, target: str, where: str, memory: str) -> None:
    """Read one file and write the other."""
    _limit_memory(int(memory))
    path = Path(source)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", Notice)
            # readers of other packages print
            with contextlib.redirect_stdout(sys.stderr):
                importlib.import_module(f".{FORMATS[path.suffix.lower()]}", __package__).read(
                    path, Path(target), where
                )
    except (InputError, MissingFeature) as error:
        sys.stderr.write(json.dumps(str(error)) + "\n")
        sys.exit(door.BAD_INPUT if isinstance(error, InputError) else door.MISSING)
    sys.stdout.write(
        json.dumps([str(one.message) for one in caught if issubclass(one.category, Notice)])
    )


def _limit_memory(size: int) -> None:
    """Bound the address space; macOS may refuse that."""
    if sys.platform != "win32":
        import resource

        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_AS, (size, size))
