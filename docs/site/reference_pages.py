"""The reference of the public objects of the package: which they are, and a page of Sphinx for every public module."""

from __future__ import annotations

import importlib
import inspect
import itertools
import re
import types
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypeVar

import docstrings

FLOORS = (
    "studies",
    "scenes",
    "results",
    "families",
    "control",
    "parts",
    "contact",
    "reduction",
    "dynamics",
    "systems",
    "bodies",
    "shapes",
    "core",
    "core.values",
    "core.algebra",
    "core.compiling",
    "extend",
)


def public_names(module: types.ModuleType) -> list[str]:
    """What a module offers: its `__all__`, or what it defines without an underscore."""
    if hasattr(module, "__all__"):
        return list(module.__all__)
    own = {
        name: value
        for name, value in vars(module).items()
        if getattr(value, "__module__", None) == module.__name__
    }
    return [
        name
        for name, value in own.items()
        if not name.startswith("_") and not isinstance(value, TypeVar)
    ]


def public_modules() -> Iterator[tuple[str, list[str]]]:
    """Every public module, `floor` or `floor.module`, with the names of its objects in their order."""
    for floor in FLOORS:
        package = importlib.import_module(f"fmbs_skfem.{floor}")
        known = {
            name: getattr(package, name, None)
            or importlib.import_module(f"{package.__name__}.{name}")
            for name in package.__all__
        }
        yield floor, [name for name, own in known.items() if not isinstance(own, types.ModuleType)]
        for own in known.values():
            if isinstance(own, types.ModuleType):
                yield own.__name__.removeprefix("fmbs_skfem."), public_names(own)


def summary(own: object, ends: str = ".:;") -> str:
    """A docstring up to the first of these marks, for reStructuredText."""
    text = " ".join((inspect.getdoc(own) or "").split("\n\n")[0].split())
    return docstrings.escape(re.split(rf"(?<=\w\w[{ends}]) ", text)[0].rstrip(ends))


def directive(own: object) -> str:
    """What of autodoc describes an object."""
    return (
        "class"
        if isinstance(own, type)
        else "function"
        if inspect.isroutine(inspect.unwrap(own))
        else "data"
    )  # type: ignore[arg-type]


def homes(pages: dict[str, list[str]]) -> dict[int, str]:
    """Full names of classes and functions on the first page that has them, by their identity: there they are described."""
    found: dict[int, str] = {}
    for path, names in pages.items():
        module = importlib.import_module(f"fmbs_skfem.{path}")
        for name in names:
            if directive(own := getattr(module, name)) != "data":
                found.setdefault(id(own), f"fmbs_skfem.{path}.{name}")
    return found


def reference_page(path: str, names: list[str], known: dict[int, str]) -> str:
    """The page of one module in reStructuredText: its docstring, a table of its objects, then those at home here by autodoc."""
    full = f"fmbs_skfem.{path}"
    module = importlib.import_module(full)
    objects = {name: getattr(module, name) for name in names}
    places = {name: known.get(id(own), f"{full}.{name}") for name, own in objects.items()}
    lines = [path, "=" * len(path), "", f".. automodule:: {full}", ""]
    if names:
        lines += [".. list-table::", ""]
        # all that Python has to say about a number or a tuple is what tuples are
        texts = {
            name: "" if directive(own) == "data" else summary(own) for name, own in objects.items()
        }
        lines += [
            f"   * - :py:obj:`~{place}`\n     - {texts[name]}" for name, place in places.items()
        ]
    for name, own in objects.items():
        if places[name] == f"{full}.{name}":
            lines += ["", f".. auto{directive(own)}:: {full}.{name}"]
            if isinstance(own, type):
                lines += [
                    "   :members:",
                    f"   :exclude-members: {', '.join(getattr(own, '__dataclass_fields__', ()))}",
                ]
    return "\n".join(lines) + "\n"


def index(pages: Iterable[str]) -> str:
    """The pages by packages, with a line on each."""
    title = "API reference"
    lines = [
        title,
        "=" * len(title),
        "",
        ".. toctree::",
        "   :hidden:",
        "",
        *(f"   {path}" for path in pages),
    ]
    for package, own in itertools.groupby(pages, lambda path: path.split(".")[0]):
        lines += ["", package, "-" * len(package), "", ".. list-table::", ""]
        for path in own:
            lines += [
                f"   * - :doc:`{path}`",
                f"     - {summary(importlib.import_module(f'fmbs_skfem.{path}'), '.')}",
            ]
    return "\n".join(lines) + "\n"


def write(folder: Path) -> None:
    """A page for every public module, and their index."""
    folder.mkdir()
    pages = dict(public_modules())
    known = homes(pages)
    for path, names in pages.items():
        (folder / f"{path}.rst").write_text(reference_page(path, names, known), encoding="utf-8")
    (folder / "index.rst").write_text(index(pages), encoding="utf-8")
