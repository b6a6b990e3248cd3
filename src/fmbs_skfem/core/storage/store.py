"""The files of one piece of work that may be killed at any moment and goes on later: a run, a
training, a sweep.

    name00001.h5       or name.h5: a struct, or arrays as plain HDF5 for other programs; its size and SHA-256 stand in front

Every file is complete under its name or not there, whatever ends the process: what was there stays
as it is (`durable`). Files hold numbers and texts only, and nothing in them is executed. Whoever
goes on reads what is there and makes what is missing.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from ..errors import CorruptFile, say
from . import container, durable, validation
from .container import FileKind
from .records import dataclass


@dataclass(frozen=True)
class Store:
    """A folder of numbered files; without one nothing is stored."""

    folder: Path | None
    kind: FileKind
    digits: int = 5  #: of numbers in names
    remedy: str = durable.AGAIN  #: where the disk is full

    def path(self, name: str, number: int | None) -> Path:
        """Where a file is, or would be; without a number that of which there is one."""
        digits = "" if number is None else f"{number:0{self.digits}d}"
        return (self.folder or Path()) / f"{name}{digits}.h5"

    def there(self, name: str, number: int | None) -> bool:
        """Whether there is a file of this number."""
        return self.folder is not None and self.path(name, number).is_file()

    def numbers(self, name: str) -> list[int]:
        """Those of which there is a file, in their order."""
        stems = (
            [path.stem.removeprefix(name) for path in self.folder.glob(f"{name}*.h5")]
            if self.folder
            else []
        )
        return sorted(int(stem) for stem in stems if stem.isdigit())

    def append(self, name: str, number: int | None, content: Any) -> None:
        """Store a struct, or arrays and facts by name as plain HDF5, in place of what had this
        number.

        NoRoom and InputError as of `durable`.
        """
        if self.folder is None:
            return
        path = self.path(name, number)
        with durable.writing(path, self.remedy):
            self.folder.mkdir(parents=True, exist_ok=True)
        if isinstance(content, Mapping):
            container.put(path, self.kind, content, self.remedy)
        else:
            container.write(path, self.kind, self.remedy, tree=plain(content))

    def read(self, name: str, number: int | None, kind: Any = None, needed: bool = False) -> Any:
        """What was stored: a struct of this kind, or arrays and facts; None where there is none,
        CorruptFile where it is damaged.

        One that is `needed` and is not there is damage as well.
        """
        path = self.path(name, number)
        if not self.there(name, number):
            if needed:
                raise CorruptFile(say(f"{path}", "the file", "none", self.kind.remedy))
            return None
        if kind is None:
            return container.get(path, self.kind)
        with container.reading(path, self.kind):
            return validation.build(
                kind, container.read(path, self.kind, tree=dict)["tree"], "content"
            )

    def series(self, name: str, kind: Any) -> tuple[Any, ...]:
        """The structs of this name, from number 1 to the first that is not there."""
        each = (self.read(name, number, kind) for number in itertools.count(1))
        return tuple(itertools.takewhile(lambda found: found is not None, each))

    def forget(self, name: str, number: int | None = None, but: int | None = None) -> None:
        """Remove the file of a number, or all of this name `but` one."""
        for one in self.numbers(name) if number is None else [number]:
            if one != but and self.folder:
                self.path(name, one).unlink(missing_ok=True)


def plain(value: Any) -> Any:
    """A struct by its fields, and an enumeration by its value, wherever they stand."""
    if isinstance(value, Enum):
        return value.value
    if is_dataclass(value):
        return {part.name: plain(getattr(value, part.name)) for part in fields(value)}
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    return type(value)(map(plain, value)) if type(value) in (tuple, list) else value
