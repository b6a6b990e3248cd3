"""Docstrings and signatures of the package for Sphinx.

A docstring is plain text: paragraphs, and blocks of equations or code that are indented by four. Those of dataclasses get a table
of fields, with the types and the comments of their declarations; those of studies one of options.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Iterator
from typing import Any

from sphinx.pycode import ModuleAnalyzer
from sphinx.util.inspect import stringify_signature
from sphinx.util.typing import stringify_annotation

from fmbs_skfem.core.declared import Declared
from fmbs_skfem.core.storage import validation
from fmbs_skfem.core.values import mappings
from fmbs_skfem.scenes import reference
from fmbs_skfem.studies.options import Option

LONG = 30  #: characters of a default above which a signature shows dots


def escape(text: str) -> str:
    """A text for reStructuredText: `code` between backticks, everything else as it stands."""
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(
        f"`{part}`" if re.fullmatch(r"`[^`]+`", part) else re.sub(r"([\\*|_`])", r"\\\1", part)
        for part in parts
    )


def paragraphs(lines: list[str]) -> Iterator[str]:
    """The lines of a docstring in reStructuredText."""
    was_code = False
    for line in [*lines, ""]:
        line = f"    {line}" if reference.EXAMPLE.match(line) else line
        is_code = line.startswith("    ") and bool(line.strip())
        if is_code and not was_code:
            yield from ("", "::", "")
        elif line.strip() and was_code and not is_code:
            yield ""
        was_code = is_code or (was_code and not line.strip())
        yield (
            line.rstrip()
            if is_code
            else re.sub(r"^([-+\d]+)([.)])", r"\1\\\2", escape(line.strip()))
        )


def rows(titles: tuple[str, ...], found: list[tuple[str, ...]]) -> Iterator[str]:
    """A table in reStructuredText."""
    yield from ("", ".. list-table::", "   :header-rows: 1", "")
    for row in (titles, *found):
        for k, cell in enumerate(row):
            yield f"   {'*' if k == 0 else ' '} - {cell}".rstrip()
    yield ""


def type_of(hint: Any) -> str:
    """A type as it is written, without what a scene takes for it."""
    return re.sub(
        r"\bfmbs_skfem\.[\w.]*\.|\bnumpy\.|\bcollections\.abc\.|\bscipy\.sparse\.[\w.]*\.",
        "",
        stringify_annotation(hint, "fully-qualified-except-typing"),
    )


def plain_hints(obj: Any, extras: bool = False) -> dict[str, Any]:
    """Types of fields or arguments, none where one of them is known to type checkers alone."""
    try:
        return typing.get_type_hints(obj, include_extras=extras)
    except (NameError, TypeError):
        return {}


def comments(kind: type) -> dict[str, str]:
    """Texts of `#:` beside the fields of a class and of those that it inherits."""
    found: dict[str, str] = {}
    for own in reversed(kind.__mro__):
        if own.__module__.startswith("fmbs_skfem"):
            known = ModuleAnalyzer.for_module(own.__module__).find_attr_docs()
            found |= {
                name: " ".join(lines).strip()
                for (owner, name), lines in known.items()
                if owner == own.__qualname__
            }
    return found


def meanings(kind: type) -> dict[str, str]:
    """What a scene takes for the fields of a class that it can name."""
    declared = (
        bool(vars(kind).get("words"))
        if issubclass(kind, Declared)
        else "Takes(" in repr(plain_hints(kind, extras=True))
    )
    if not declared:
        return {}
    return {
        name: reference.takes(value)
        for name, value in mappings.object_schema(kind)["properties"].items()
    }


def shapes(kind: type) -> dict[str, str]:
    """Shapes that the declarations of stored arrays have, in axis letters."""
    found = {}
    for name, hint in plain_hints(kind, extras=True).items():
        for note in getattr(hint, "__metadata__", ()):
            if isinstance(note, validation.Reals | validation.Indices):
                letters = note.axes.split()
                found[name] = f"({', '.join(letters)}{',' if len(letters) == 1 else ''})"
    return found


def default_of(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= LONG and " at 0x" not in text else "..."


def fields(kind: type) -> Iterator[str]:
    """The fields of a dataclass: type, default, and what stands beside them."""
    hints, beside, taken, sizes = plain_hints(kind), comments(kind), meanings(kind), shapes(kind)
    found = []
    for field in dataclasses.fields(kind):
        if field.name.startswith("_") or not field.init:
            continue
        text = " ".join(
            filter(None, [known.get(field.name, "") for known in (sizes, taken, beside)])
        )
        default = "" if field.default is dataclasses.MISSING else f" = {default_of(field.default)}"
        found.append(
            (
                f"``{field.name}{default}``",
                f"``{type_of(hints.get(field.name, field.type))}``",
                escape(text),
            )
        )
    if found:
        yield from rows(("field", "type", "meaning"), found)


def options(function: Any) -> Iterator[str]:
    """The options of a study, which its command has as well."""
    hints = plain_hints(function, extras=True)
    found = [
        (f"``{name}``", escape(note.help))
        for name, hint in hints.items()
        for note in getattr(hint, "__metadata__", ())
        if isinstance(note, Option)
    ]
    if found:
        yield from rows(("option", "meaning"), found)


def rewrite(app: object, what: str, name: str, obj: Any, _: object, lines: list[str]) -> None:
    """A docstring as reStructuredText, with the table of its fields or options."""
    described = isinstance(obj, type) and dataclasses.is_dataclass(obj)
    if described and (obj.__doc__ or "").startswith(f"{obj.__name__}("):
        lines[:] = []
    if what == "data" and lines and lines[0] == (inspect.getdoc(type(obj)) or "").split("\n")[0]:
        lines[:] = []  # of its type, not of what it is
    text = list(paragraphs(lines))
    if described:
        text += fields(obj)
    elif what == "function":
        text += options(obj)
    lines[:] = text


def sign(app: object, what: str, name: str, obj: Any, *_: object) -> tuple[str, str | None] | None:
    """Signatures without what scenes and commands take; those of dataclasses are names and defaults, types are in the table."""
    if isinstance(obj, type):
        if not dataclasses.is_dataclass(obj):
            return None
        known = [
            field
            for field in dataclasses.fields(obj)
            if field.init and not field.name.startswith("_")
        ]
        parts = [
            field.name
            if field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
            else f"{field.name}={default_of(field.default) if field.default is not dataclasses.MISSING else '...'}"
            for field in known
        ]
        return f"({', '.join(parts)})", None
    if what not in ("function", "method") or not inspect.isroutine(obj):
        return None
    hints = plain_hints(inspect.unwrap(obj))
    if not hints:
        return None
    signature = inspect.signature(obj)
    known_parameters = [
        own.replace(
            annotation=hints.get(own.name, own.annotation),
            default=Shown(own.default) if own.default is not own.empty else own.default,
        )
        for own in signature.parameters.values()
    ]
    text = stringify_signature(
        signature.replace(
            parameters=known_parameters,
            return_annotation=hints.get("return", signature.return_annotation),
        ),
        unqualified_typehints=True,
    )
    arguments, _, result = text.rpartition(" -> ") if " -> " in text else (text, "", "")
    return arguments, result or None


class Shown:
    """A default in a signature."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __repr__(self) -> str:
        return default_of(self.value)
