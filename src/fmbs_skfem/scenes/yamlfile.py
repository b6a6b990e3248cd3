"""YAML 1.2 text -> a tree of nodes that know their lines; nothing is constructed but text, numbers,
booleans, lists and mappings.

The tree is built from the parser's events, so nesting, size and aliases are counted before anything
is expanded. `<<: *name` takes the entries of another mapping, as YAML 1.1 had it, those of the
mapping itself going first. Refused: tags, duplicate keys (both lines are named), keys that are not
text, several documents, aliases to an enclosing node.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
)
from ruamel.yaml.events import SequenceStartEvent as ListStartEvent

from ..core.errors import InputError, say
from ..core.storage import container
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.problems import Keys, printable

if TYPE_CHECKING:
    from .schema import Scene

BYTES = 2 * 1024 * 1024  #: largest file
WIDTH = 100_000  #: longest line [characters]; a parser in Python would take seconds for longer ones
LEVELS = 64  #: deepest nesting
MERGE = "<<"  #: key of entries that stand elsewhere, those of the mapping itself go first
NODES = 100_000  #: most values, aliases counted as expanded

Oddity: TypeAlias = tuple[Keys, str]  #: path of keys, and what is odd about what stands there
Scalar: TypeAlias = str | int | float | bool | None
_LONG = re.compile(rf"(?:^|\r)([^\r\n]{{{WIDTH + 1},}})", re.MULTILINE)
#: brackets that the parser would look through again and again
_DEEP = re.compile(rf"(?:[\[{{][ \t]{{0,3}}){{{LEVELS + 1}}}")
#: what XML 1.0 has no place for, and DEL to 9f
_CONTROL = re.compile(r"[^\t\n\r\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PARTS = re.compile(r"expected (.+), but (?:found|got) (.+)", re.DOTALL)  #: what the parser says
_INTEGER = re.compile(r"[-+]?\d{1,300}", re.ASCII)
_FLOAT = re.compile(r"[-+]?(\.\d+|\d+(\.\d*)?)([eE][-+]?\d+)?", re.ASCII)
_WORDS: dict[str, Scalar] = {"": None, "~": None}
_WORDS |= {
    form: value
    for word, value in (("null", None), ("true", True), ("false", False))
    for form in (word, word.title(), word.upper())
}
_WORDS |= {
    sign + form: float(sign + "inf") for sign in ("", "+", "-") for form in (".inf", ".Inf", ".INF")
}
_WORDS |= {form: float("nan") for form in (".nan", ".NaN", ".NAN")}


@dataclass(frozen=True, slots=True)
class Node:
    """A value with the line of its key (or its own, in lists); `size` and `height` count values and
    levels, aliases expanded.
    """

    value: Scalar | dict[str, Node] | list[Node]
    line: int
    size: int = 1
    height: int = 0


def read(path: Path) -> Node:
    """The tree of a file."""
    try:
        if path.exists() and not path.is_file():
            raise InputError(
                say(
                    str(path),
                    "a file",
                    "a folder" if path.is_dir() else "something else",
                    "give the scene itself",
                )
            )
        if (title := container.title(path)) is not None:
            raise InputError(
                say(
                    str(path),
                    "a scene",
                    f"a file of kind '{title}'",
                    "look at it with fmbs rom info or fmbs part info",
                )
            )
        size = path.stat().st_size
        if size > BYTES:
            raise InputError(
                say(
                    str(path),
                    f"a file of at most {BYTES // 2**20} MB",
                    f"{size / 2**20:.1f} MB",
                    "meshes belong into mesh files",
                )
            )
        return parse(path.read_bytes().decode("utf-8-sig"), str(path))
    except OSError as error:
        remedy = "look at its name and folder"
        raise InputError(
            say(str(path), "a readable file", error.strerror or type(error).__name__, remedy)
        ) from error
    except UnicodeDecodeError as error:
        got = f"byte 0x{error.object[error.start]:02x} at {error.start}"
        raise InputError(
            say(str(path), "text in UTF-8", got, "save it in this coding, or is it no scene?")
        ) from error


def parse(text: str, name: str) -> Node:
    """The tree of a text; `name` stands for the file in messages."""
    if len(text) > BYTES:
        raise InputError(
            say(
                name,
                f"a text of at most {BYTES // 2**20} MB",
                f"{len(text) / 2**20:.1f} MB",
                "meshes belong into mesh files",
            )
        )
    if (long := _LONG.search(text)) is not None:
        got = f"{long.end(1) - long.start(1)}"
        raise InputError(
            say(
                _place(name, text, long),
                f"lines of at most {WIDTH} characters",
                got,
                "break it into several",
            )
        )
    if (deep := _DEEP.search(text)) is not None:
        raise InputError(
            say(
                _place(name, text, deep),
                f"at most {LEVELS} nested levels",
                "more brackets in a row",
            )
        )
    events = _events(text, name)
    builder = _Builder(name, events, {})
    root: Node | None = None
    for event in events:
        if isinstance(event, DocumentStartEvent):
            if root is not None:
                raise _refuse(
                    name,
                    event,
                    "one document",
                    "a second one",
                    "delete everything from the second '---' on",
                )
            root = builder.node(next(events), 0)
    if root is None:
        raise InputError(say(name, "a scene", "an empty file", "start with 'schema: 1'"))
    return root


def _place(name: str, text: str, found: re.Match[str]) -> str:
    """File and line of a match."""
    return f"{name}:{text.count(chr(10), 0, found.start()) + 1}"


def plain(node: Node) -> Any:
    """The tree as dicts, lists and scalars."""
    if isinstance(node.value, dict):
        return {key: plain(value) for key, value in node.value.items()}
    if isinstance(node.value, list):
        return [plain(value) for value in node.value]
    return node.value


def line(node: Node, path: Sequence[str | int]) -> int:
    """The line of the value at a path of keys and indices, or of its nearest ancestor that exists."""
    for step in path:
        if isinstance(node.value, dict) and step in node.value:
            node = node.value[str(step)]
        elif isinstance(node.value, list) and isinstance(step, int) and step < len(node.value):
            node = node.value[step]
        else:
            break
    return node.line


@checked
def where(scene: Scene, *keys: str | int) -> str:
    """`file:line: key.key` of the value at a path of keys and indices of the scene, for messages."""
    return location(str(scene.path or "scene"), scene.node, keys)


def location(name: str, node: Node | None, keys: Keys) -> str:
    """`file:line: key.key` of a path of keys in the tree of a file."""
    path = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(
        "."
    )
    place = name if node is None else f"{name}:{line(node, keys)}"
    return f"{place}: {path}" if path else place


def scalar(text: str) -> Scalar:
    """A plain scalar by the core schema of YAML 1.2, decimal numbers only."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    return float(text) if _FLOAT.fullmatch(text) else text


def _events(text: str, name: str) -> Iterator[Any]:
    """The parser's events; its errors in the house form."""
    try:
        yield from YAML(typ="safe", pure=True).parse(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{name}:{mark.line + 1}" if mark else name
        got = error.problem or error.context or "something else"
        remedy = (
            "indent with spaces in place of tabs"
            if "'\\t'" in got
            else "look for a missing quote or bracket"
        )
        parts = _PARTS.fullmatch(got)
        wanted, got = parts.groups() if parts else ("YAML 1.2", got.removeprefix("found "))
        raise InputError(say(where, wanted, got, remedy)) from error
    except (
        YAMLError,
        ValueError,
        OverflowError,
        AttributeError,
        TypeError,
        IndexError,
        AssertionError,
        NotImplementedError,
    ) as error:
        raise InputError(
            say(
                name, "YAML 1.2", str(error).splitlines()[0] if str(error) else type(error).__name__
            )
        ) from error


def _refuse(name: str, event: Any, expected: str, got: str, remedy: str = "") -> InputError:
    return InputError(
        printable(say(f"{name}:{event.start_mark.line + 1}", expected[:200], got[:200], remedy))
    )


@dataclass(frozen=True)
class _Builder:
    name: str
    events: Iterator[Any]
    anchors: dict[str, Node | None]  # None while the anchored node is being built

    def node(self, event: Any, level: int) -> Node:
        if isinstance(event, AliasEvent):
            return self._alias(event, level)
        if getattr(event, "tag", None) is not None:
            raise _refuse(
                self.name,
                event,
                "a value without a tag",
                f"the tag '{event.tag}'",
                "delete it; scenes hold plain values only",
            )
        self._depth(level, event)
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        node = self._build(event, level)
        if node.size > NODES:
            raise _refuse(
                self.name,
                event,
                f"at most {NODES} values",
                f"{node.size}, aliases counted as expanded",
                "use fewer aliases",
            )
        if event.anchor is not None:
            self.anchors[event.anchor] = node
        return node

    def _alias(self, event: Any, level: int) -> Node:
        node = self.anchors.get(event.anchor)
        if node is None:
            state = (
                "a reference to an enclosing value"
                if event.anchor in self.anchors
                else "no such anchor"
            )
            raise _refuse(self.name, event, f"an anchor '&{event.anchor}' before its alias", state)
        self._depth(level + node.height, event)
        return node

    def _depth(self, level: int, event: Any) -> None:
        if level > LEVELS:
            raise _refuse(
                self.name,
                event,
                f"at most {LEVELS} nested levels",
                "more",
                "aliases count as written out",
            )

    def _build(self, event: Any, level: int) -> Node:
        line = event.start_mark.line + 1
        if isinstance(event, ScalarEvent):
            return Node(scalar(event.value) if event.style is None else self._text(event), line)
        if isinstance(event, ListStartEvent):
            return self._list(line, level)
        if isinstance(event, MappingStartEvent):
            return self._mapping(line, level)
        raise _refuse(self.name, event, "a value", type(event).__name__)

    def _text(self, event: Any) -> str:
        """A text without control characters, which no name, unit or title of what is written from
        it can hold.
        """
        text = str(event.value)
        if found := _CONTROL.search(text):
            raise _refuse(
                self.name,
                event,
                "text without control characters",
                repr(found.group()),
                "delete it",
            )
        return text

    def _list(self, line: int, level: int) -> Node:
        items: list[Node] = []
        size = 1
        while not isinstance(event := next(self.events), SequenceEndEvent):
            items.append(self.node(event, level + 1))
            size = self._count(size + items[-1].size, event)
        return Node(items, line, size, 1 + max((item.height for item in items), default=0))

    def _mapping(self, line: int, level: int) -> Node:
        entries: dict[str, Node] = {}
        merge = None  # the event of the key <<
        size = 1
        while not isinstance(event := next(self.events), MappingEndEvent):
            if (
                not isinstance(event, ScalarEvent)
                or event.anchor is not None
                or event.tag is not None
            ):
                raise _refuse(self.name, event, "a key that is plain text", "something else")
            key = self._text(event)
            key_line = event.start_mark.line + 1
            if key in entries:
                raise _refuse(
                    self.name,
                    event,
                    f"the key '{key}' once",
                    f"twice, in lines {entries[key].line} and {key_line}",
                    "delete one",
                )
            if key == MERGE and event.style is None:
                merge = event
            entries[key] = replace(self.node(next(self.events), level + 1), line=key_line)
            size = self._count(size + entries[key].size, event)
        if merge is not None:
            entries = {**self._merge(entries.pop(MERGE), merge), **entries}
        return Node(
            entries, line, size, 1 + max((entry.height for entry in entries.values()), default=0)
        )

    def _merge(self, node: Node, event: Any) -> dict[str, Node]:
        """Entries of a mapping, or of a list of them of which the earlier ones count, whose place
        is in the mapping around <<.
        """
        parts = node.value if isinstance(node.value, list) else [node]
        found: dict[str, Node] = {}
        for part in reversed(parts):
            if not isinstance(part.value, dict):
                raise _refuse(
                    self.name,
                    event,
                    "a mapping, or a list of mappings, behind <<",
                    "something else",
                    "write <<: *anchor",
                )
            found |= part.value
        return found

    def _count(self, size: int, event: Any) -> int:
        if size > NODES:
            raise _refuse(
                self.name,
                event,
                f"at most {NODES} values",
                "more, aliases counted as expanded",
                "use fewer aliases",
            )
        return size
