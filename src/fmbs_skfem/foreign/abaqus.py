"""Abaqus `.inp`: nodes, line and surface elements and sets, flat or as parts that instances place.

    instance:  x -> R (x + t - a) + a,     t the first data line, R by an angle [deg] about the axis a -> b of the second

Sets add up over all cards of their name; `generate`, sets of sets, `instance=`, `I.5` and `I.NAME`
are followed. A set of a part has its own name where one instance only has it, else `INSTANCE.NAME`.
Nodes of a set along the boundary of a surface, by which Abaqus names an edge, also become line
cells, as do sides of elements under *SURFACE: the side i from corner i to the next is Ei of shells
and membranes, Si of plane elements, all free sides of these where none is named. Faces SPOS and
SNEG are no sides. Sides Si of solids become triangles or quadrilaterals, and the material that *SOLID
SECTION names comes along in the units of the file. What makes or moves nodes in other ways is
refused, other elements are skipped with a notice. Source: Abaqus Analysis User's Guide, "Defining a model
in Abaqus", "Node definition", "Element definition", "Assembly definition", "Element-based surface
definition".
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import field, replace
from pathlib import Path
from typing import NoReturn, TypeVar

import numpy as np

from ..core.errors import InputError, listed, say
from ..core.notices import notify, remark
from ..core.storage.records import dataclass
from ..core.values.problems import printable
from . import exchange
from .exchange import Floats, Ints

#: names of element types -> kind of cell and its nodes
_KINDS = [
    (re.compile(names), kind, count)
    for names, kind, count in (
        (r"(T[23]D2|B[23][13]|PIPE[23]1|ELBOW31|FRAME[23]D)[A-Z]*", "line", 2),
        (r"(T[23]D3|B[23]2|PIPE[23]2|ELBOW32)[A-Z]*", "line3", 3),
        (r"(S3|STRI3|CPS3|CPE3|CPEG3|M3D3|SFM3D3)[A-Z]*", "triangle", 3),
        (r"(S4|CPS4|CPE4|CPEG4|M3D4|SFM3D4)[A-Z]*5?", "quad", 4),
        (r"(STRI65|CPS6|CPE6|CPEG6|M3D6|SFM3D6)[A-Z]*", "triangle6", 6),
        (r"(S8|CPS8|CPE8|CPEG8|M3D8|SFM3D8)[A-Z]*5?", "quad8", 8),
        (r"(S9R5|M3D9)[A-Z]*", "quad9", 9),
        (r"C3D4[A-Z]*", "tetra", 4),
        (r"C3D10[A-Z]*", "tetra10", 10),
        (r"C3D8[A-Z]*", "hexahedron", 8),
        (r"C3D20[A-Z]*", "hexahedron20", 20),
        (r"C3D27[A-Z]*", "hexahedron27", 27),
        (r"C3D6[A-Z]*", "wedge", 6),
        (r"C3D15[A-Z]*", "wedge15", 15),
    )
]
#: corners of the sides S1, S2, ... of solids
_FACES = {
    "tetra": [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
    "hexahedron": [
        [0, 1, 2, 3],
        [4, 7, 6, 5],
        [0, 4, 5, 1],
        [1, 5, 6, 2],
        [2, 6, 7, 3],
        [3, 7, 4, 0],
    ],
}
_SIDES = 8  #: numbers kept for the sides of an element
#: cards that make, move or fetch nodes, elements and sets by rules that are not followed here
#: cards of what scenes say in their own words, which are told to be left out
_OF_SCENES = {
    *("BOUNDARY", "CLOAD", "DLOAD", "DSLOAD", "TEMPERATURE", "AMPLITUDE", "INITIAL CONDITIONS"),
    *("TIE", "COUPLING", "KINEMATIC COUPLING", "DISTRIBUTING COUPLING", "MPC", "EQUATION"),
    *("RIGID BODY", "CONTACT PAIR", "CONTACT", "CONNECTOR SECTION", "SPRING", "MASS"),
    *("PLASTIC", "HYPERELASTIC", "VISCOELASTIC", "CREEP", "EXPANSION", "DAMPING"),
}
_UNREAD = {
    *(
        "ELCOPY",
        "ELGEN",
        "IMPORT",
        "INCLUDE",
        "MANIFEST",
        "MAP SOLUTION",
        "NCOPY",
        "NFILL",
        "NGEN",
        "NMAP",
    ),
    *("PARAMETER", "SUBSTRUCTURE", "SYMMETRIC MODEL GENERATION", "SYSTEM"),
}
_FLAT = "write a flat file: in Abaqus/CAE, Model > Edit Attributes > Do not use parts and assemblies in input files"

_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class _Card:
    """A keyword line and its data."""

    keyword: str
    options: dict[str, str]
    line: int
    data: list[tuple[int, list[str]]]  #: line numbers and entries


@dataclass(frozen=True, eq=False)
class _Members:
    """What one card adds to a set."""

    kind: str  #: NSET, ELSET or SURFACE
    name: str
    line: int
    numbers: list[int] = field(default_factory=list)
    ranges: list[tuple[int, int, int]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)  #: of sets, or `INSTANCE.5`
    instance: str = ""
    elements: str = ""  #: the set whose elements' nodes are meant
    face: str = ""  #: of SURFACE: E1, S1, SPOS, ...

    @property
    def of(self) -> str:
        """What its numbers and names are."""
        return "NSET" if self.kind == "NSET" else "ELSET"


@dataclass(eq=False)
class _Level:
    """What stands outside of parts, in a part, or in an instance."""

    nodes: dict[int, list[float]] = field(default_factory=dict)
    #: type, kind of cell, nodes
    elements: dict[int, tuple[str, str, list[int]]] = field(default_factory=dict)
    skipped: set[int] = field(default_factory=set)  #: elements of other types
    sets: list[_Members] = field(default_factory=list)

    def joined(self, other: _Level) -> _Level:
        return _Level(
            self.nodes | other.nodes,
            self.elements | other.elements,
            self.skipped | other.skipped,
            self.sets + other.sets,
        )


@dataclass(eq=False)
class _Instance:
    part: str
    line: int
    placed: Callable[[Floats], Floats]
    own: _Level = field(default_factory=_Level)


@dataclass(eq=False)
class _Placed:
    """A level whose nodes and elements have their rows in the whole mesh; sets by kind and upper
    name.
    """

    nodes: dict[int, int]
    elements: dict[int, int]
    skipped: set[int]
    sets: dict[tuple[str, str], Ints] = field(default_factory=dict)
    names: dict[tuple[str, str], str] = field(default_factory=dict)  #: as they are spelt first
    #: of nodes and elements, made once for all ranges
    numbers: dict[str, Ints] = field(default_factory=dict)

    def labels(self, kind: str) -> Ints:
        if kind not in self.numbers:
            self.numbers[kind] = np.array(
                list(self.nodes if kind == "NSET" else self.elements), np.int64
            )
        return self.numbers[kind]


@dataclass(eq=False)
class _Whole:
    """The mesh as it grows, instance by instance."""

    points: list[Floats] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    types: list[str] = field(default_factory=list)
    kinds: list[str] = field(default_factory=list)
    rows: list[list[int]] = field(default_factory=list)
    labels: list[int] = field(default_factory=list)


def read(path: Path, target: Path, where: str) -> None:
    """Write the mesh of a file for `exchange.load`."""
    exchange.save(_Reader(where).mesh(path), target)


@dataclass(eq=False)
class _Reader:
    """Walks through the cards and keeps what each level says."""

    where: str
    top: _Level = field(default_factory=_Level)
    parts: dict[str, _Level] = field(default_factory=dict)
    instances: dict[str, _Instance] = field(default_factory=dict)
    #: upper name of an instance -> as it is written
    spelt: dict[str, str] = field(default_factory=dict)
    other_types: Counter[str] = field(default_factory=Counter)
    #: name -> card -> numbers
    materials: dict[str, dict[str, list[float]]] = field(default_factory=dict)
    #: sets of elements and materials of solids, upper
    sections: list[tuple[str, str]] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)  #: cards of `_OF_SCENES`
    material: str = ""  #: the one that cards belong to
    assembly: bool = False
    whole: _Whole = field(default_factory=_Whole)

    def mesh(self, path: Path) -> exchange.Mesh:
        level = self.top
        with path.open(encoding="utf-8", errors="replace") as file:
            for card in self._cards(file):
                level = self._take(card, level)
        if not self.assembly:  # nothing places the parts: they are where their nodes are
            for name in self.parts:
                self.instances[name], self.spelt[name] = _Instance(name, 0, lambda x: x), name
        return self._assembled()

    def _cards(self, lines: Iterator[str]) -> Iterator[_Card]:
        card: _Card | None = None
        unfinished = ""
        for number, text in enumerate(lines, 1):
            text = unfinished + text.strip()
            if text.startswith("**") or not text:
                continue
            unfinished = text if text.startswith("*") and text.endswith(",") else ""
            if unfinished:
                continue
            if text.startswith("*"):
                if card is not None:
                    yield card
                keyword, *options = (word.strip() for word in text[1:].split(","))
                pairs = (word.partition("=") for word in options)
                named = {_key(key): printable(value.strip().strip('"')) for key, _, value in pairs}
                card = _Card(_key(keyword), named, number, [])
            elif card is not None:
                card.data.append((number, [word.strip().strip('"') for word in text.split(",")]))
        if card is not None:
            yield card

    def _take(self, card: _Card, level: _Level) -> _Level:
        """Keep what a card says; the level that the next card belongs to."""
        if card.keyword in _UNREAD or (
            card.keyword in ("NODE", "ELEMENT", "NSET", "ELSET") and "INPUT" in card.options
        ):
            self._refuse(
                card.line,
                "nodes, elements and sets written out",
                f"*{card.keyword} {_shown(card.options)}".strip(),
                _FLAT,
            )
        if card.keyword == "PART":
            level = self.parts[self._name(card, "NAME").upper()] = _Level()
        elif card.keyword == "ASSEMBLY":
            self.assembly = True
        elif card.keyword == "INSTANCE":
            level = self._open_instance(card)
        elif card.keyword in ("END PART", "END INSTANCE"):
            level = self.top
        elif card.keyword == "NODE":
            self._nodes(card, level)
        elif card.keyword == "ELEMENT":
            self._elements(card, level)
        elif card.keyword in ("NSET", "ELSET"):
            level.sets.append(self._members(card))
        elif card.keyword == "SURFACE":
            level.sets.extend(self._surface(card))
        elif card.keyword == "MATERIAL":
            self.material = self._name(card, "NAME").upper()
            self.materials[self.material] = {}
        elif card.keyword in ("ELASTIC", "DENSITY") and self.material and card.data:
            self._numbers_of_material(card)
        elif card.keyword in _OF_SCENES:
            self.left_out[card.keyword] += 1
        elif card.keyword == "SOLID SECTION":
            of = card.options
            self.sections.append((of.get("ELSET", "").upper(), of.get("MATERIAL", "").upper()))
        return level

    def _numbers_of_material(self, card: _Card) -> None:
        """Young's modulus and Poisson's ratio, or the density; other elasticity is left out."""
        if card.options.get("TYPE", "ISOTROPIC").upper() not in ("ISO", "ISOTROPIC"):
            notify(
                f"{self.where}: line {card.line}: *{card.keyword} {_shown(card.options)} is left out"
            )
            return
        if len(card.data) > 1:
            rows = f"{len(card.data)} lines of *{card.keyword} at temperatures"
            notify(f"{self.where}: line {card.line}: the first of {rows} is taken")
        line, words = card.data[0]
        numbers = [self._number(float, line, word) for word in _trimmed(words)]
        self.materials[self.material][card.keyword] = numbers

    def _open_instance(self, card: _Card) -> _Level:
        name = self._name(card, "NAME")
        part = card.options.get("PART", "")
        if {"INSTANCE", "LIBRARY"} & card.options.keys():
            self._refuse(
                card.line,
                "an instance of a part in the file",
                f"one of {_shown(card.options)}",
                _FLAT,
            )
        if part and part.upper() not in self.parts:
            known = f"parts before it: {listed(self.parts, part.upper())}"
            self._refuse(card.line, "an instance of a part of the file", f"'{part}'", known)
        if name.upper() in self.instances:
            self._refuse(
                card.line, "a name of its own for each instance", f"'{name}' again", "rename one"
            )
        self.spelt[name.upper()] = name
        self.instances[name.upper()] = _Instance(part.upper(), card.line, self._placement(card))
        return self.instances[name.upper()].own

    def _placement(self, card: _Card) -> Callable[[Floats], Floats]:
        """Translation, then rotation."""
        rows = [
            [self._number(float, line, word or "0") for word in _trimmed(words)]
            for line, words in card.data
        ]
        if not rows:
            return lambda x: x
        if len(rows) > 2 or len(rows[0]) > 3 or (len(rows) == 2 and len(rows[1]) != 7):
            expected = "a translation of 3 numbers, then perhaps a rotation of 7: a point a, a point b, an angle"
            self._refuse(
                card.data[0][0],
                expected,
                f"lines of {', '.join(str(len(row)) for row in rows)} numbers",
            )
        t = np.array([*rows[0], 0.0, 0.0, 0.0][:3])
        if len(rows) == 1:
            return lambda x: x + t
        a = np.array(rows[1][:3])
        b = np.array(rows[1][3:6])
        angle = np.radians(rows[1][6])
        if not np.linalg.norm(b - a) > 0.0:
            self._refuse(
                card.data[1][0], "two different points of the axis of a rotation", "one point twice"
            )
        u = (b - a) / np.linalg.norm(b - a)
        cross = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
        # Rodrigues
        turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
        return lambda x: (x + t - a) @ turn.T + a

    def _nodes(self, card: _Card, level: _Level) -> None:
        if card.options.get("SYSTEM", "R").upper() != "R":
            self._refuse(
                card.line,
                "nodes in rectangular coordinates",
                f"SYSTEM={card.options['SYSTEM']}",
                _FLAT,
            )
        numbers = []
        for line, words in card.data:
            number = self._number(int, line, words[0])
            if number in level.nodes:
                self._refuse(line, "each node once", f"node {number} again", "renumber the nodes")
            level.nodes[number] = [
                self._number(float, line, word or "0") for word in [*words[1:4], "", "", ""][:3]
            ]
            numbers.append(number)
        if "NSET" in card.options:
            level.sets.append(_Members("NSET", card.options["NSET"], card.line, numbers))

    def _elements(self, card: _Card, level: _Level) -> None:
        """Rows of a number and nodes, which may go on in the next line; a beam may have one more
        node for its direction.
        """
        name = self._name(card, "TYPE").upper()
        kind, count = next(
            ((kind, count) for names, kind, count in _KINDS if names.fullmatch(name)), ("", 0)
        )
        numbers: list[int] = []
        row: list[int] = []
        for line, words in card.data:
            more = [self._number(int, line, word) for word in _trimmed(words)] if kind else []
            if not kind:  # only their numbers are of use, which sets may hold
                numbers += [int(words[0])] if words[0].isdigit() else []
                continue
            row += more
            if len(row) < 1 + count and words[-1] == "":
                continue
            most = 1 + count + (name[0] in "BPE" or name.startswith("FRAME"))
            if not 1 + count <= len(row) <= most:
                self._refuse(
                    line,
                    f"a number and {count} nodes of an element of type {name}",
                    f"{len(row)} numbers",
                )
            if row[0] in level.elements or row[0] in level.skipped:
                self._refuse(
                    line, "each element once", f"element {row[0]} again", "renumber the elements"
                )
            level.elements[row[0]] = (name, kind, row[1 : 1 + count])
            numbers.append(row[0])
            row = []
        if row:
            self._refuse(
                card.data[-1][0],
                f"a number and {count} nodes of an element of type {name}",
                f"{len(row)} numbers",
            )
        if not kind:
            self.other_types[name] += len(numbers)
            level.skipped.update(numbers)
        if "ELSET" in card.options:
            level.sets.append(_Members("ELSET", card.options["ELSET"], card.line, numbers))

    def _members(self, card: _Card) -> _Members:
        found = _Members(
            card.keyword,
            self._name(card, card.keyword),
            card.line,
            instance=card.options.get("INSTANCE", ""),
            elements=card.options.get("ELSET", "") if card.keyword == "NSET" else "",
        )
        for line, words in card.data:
            if "GENERATE" in card.options:
                first, last, *step = (
                    self._number(int, line, word)
                    for word in _trimmed([*words, ""]) or self._empty(line)
                )
                if len(step) > 1 or (step and step[0] < 1) or last < first:
                    self._refuse(line, "a first number, a last one and a step", ", ".join(words))
                found.ranges.append((first, last, step[0] if step else 1))
            else:
                found.numbers.extend(int(word) for word in words if _whole(word))
                found.names.extend(word for word in words if word and not _whole(word))
        return found

    def _surface(self, card: _Card) -> list[_Members]:
        """One entry a data line: a number or set of elements, and which of their sides."""
        name = self._name(card, "NAME")
        kind = card.options.get("TYPE", "ELEMENT").upper()
        if kind != "ELEMENT" or "COMBINE" in card.options:
            if "INTERNAL" not in card.options:
                notify(
                    f"{self.where}: line {card.line}: surface '{name}' is left out: {_shown(card.options)}"
                )
            return []
        return [
            _Members(
                "SURFACE",
                name,
                line,
                [int(words[0])] if _whole(words[0]) else [],
                names=[] if _whole(words[0]) else words[:1],
                face=[*words, ""][1].upper(),
            )
            for line, words in card.data
        ]

    # ------------------------------------------------------------------------------------------------------------ assembly
    def _assembled(self) -> exchange.Mesh:
        placed: dict[str, _Placed] = {}
        for name, instance in self.instances.items():
            level = (
                self.parts[instance.part].joined(instance.own) if instance.part else instance.own
            )
            placed[name] = self._place(level, instance.placed)
            self._resolve(level.sets, placed[name], {})
        top = self._place(self.top, lambda x: x)
        self._resolve(self.top.sets, top, placed)
        unplaced = self.parts.keys() - {instance.part for instance in self.instances.values()}
        for name in sorted(unplaced):
            notify(f"{self.where}: part {name} has no instance in the assembly, and is left out")
        if self.left_out:
            cards = ", ".join(f"*{name}" for name in self.left_out)
            remark(
                f"{self.where}: {cards} are left out: scenes have joints and loads of their own, and elastic materials"
            )
        if self.other_types:
            found = ", ".join(f"{count} of type {name}" for name, count in self.other_types.items())
            if not self.whole.rows:
                expected = "elements of lines, plates or solids (B31, T3D2, S4, CPS4, C3D10, ...)"
                raise InputError(say(self.where, expected, found, "export other elements"))
            notify(
                f"{self.where}: elements that are no lines, plates or solids are left out: {found}"
            )
        return self._output(*self._named(top, placed))

    def _place(self, level: _Level, move: Callable[[Floats], Floats]) -> _Placed:
        whole = self.whole
        start = len(self.whole.numbers)
        nodes = {number: start + i for i, number in enumerate(level.nodes)}
        whole.points.append(move(np.array(list(level.nodes.values())).reshape(-1, 3)))
        whole.numbers.extend(level.nodes)
        elements = {}
        for number, (name, kind, corners) in level.elements.items():
            missing = [corner for corner in corners if corner not in nodes]
            if missing:
                got = f"node {missing[0]} in element {number}"
                raise InputError(
                    say(
                        self.where,
                        "elements on nodes of their part or instance",
                        got,
                        "export it again",
                    )
                )
            elements[number] = len(whole.rows)
            whole.rows.append([nodes[corner] for corner in corners])
            whole.types.append(name)
            whole.kinds.append(kind)
            whole.labels.append(number)
        return _Placed(nodes, elements, level.skipped)

    def _resolve(
        self, cards: list[_Members], level: _Placed, instances: dict[str, _Placed]
    ) -> None:
        """Sets as rows; a card may name those before it, a surface all."""
        for card in sorted(cards, key=lambda card: card.kind == "SURFACE"):
            of = level
            if card.instance:
                if card.instance.upper() not in instances:
                    known = f"instances: {listed(self.spelt.values(), card.instance)}"
                    self._refuse(
                        card.line, "an instance of the assembly", f"'{card.instance}'", known
                    )
                of = instances[card.instance.upper()]
            key = (card.kind, card.name.upper())
            parts = [
                self._rows(card, of),
                *(self._of_name(card, word, of, level, instances) for word in card.names),
            ]
            if card.elements:
                self._refuse_unknown(
                    card, card.elements, ("ELSET", card.elements.upper()) in of.sets
                )
                corners = [
                    self.whole.rows[row] for row in of.sets["ELSET", card.elements.upper()].tolist()
                ]
                parts.append(np.array([node for nodes in corners for node in nodes], np.int64))
            if card.kind == "SURFACE":
                parts = [self._sides(card, np.concatenate(parts))]
            level.names.setdefault(key, card.name)
            level.sets[key] = np.unique(
                np.concatenate([level.sets.get(key, np.zeros(0, np.int64)), *parts])
            )

    def _sides(self, card: _Members, rows: Ints) -> Ints:
        """Sides of elements as _SIDES row + i."""
        found = []
        unread: set[str] = set()
        for row in rows.tolist():
            name = self.whole.types[row]
            kind = self.whole.kinds[row]
            corners = len(_faces(kind)) or _corners(kind)
            letter = "S" if name.startswith("C") else "E"
            words = [f"{letter}{i}" for i in range(1, corners + 1)]
            if card.face in words:
                found.append(_SIDES * row + words.index(card.face))
            elif letter == "S" and not card.face:
                found += [_SIDES * row + i for i in range(corners)]
            elif card.face not in ("", "SPOS", "SNEG"):
                sides = f"sides are {words[0]} to {words[-1]}" if words else "lines have no sides"
                unread.add(f"{card.face} of elements of type {name} ({sides})")
        if unread:
            notify(
                f"{self.where}: line {card.line}: surface '{card.name}' is read without {', '.join(sorted(unread))}"
            )
        return np.array(found, np.int64)

    def _rows(self, card: _Members, of: _Placed) -> Ints:
        """Rows of numbers and ranges; numbers of elements that were skipped have none, nor have
        gaps of ranges.
        """
        known = of.nodes if card.of == "NSET" else of.elements
        skipped = of.skipped if card.of == "ELSET" else set()
        for number in card.numbers:
            if number not in known and number not in skipped:
                what = "nodes" if card.of == "NSET" else "elements"
                self._refuse(
                    card.line,
                    f"{what} of the part in the set '{card.name}'",
                    f"{number}",
                    "export it again",
                )
        rows = [known[number] for number in card.numbers if number in known]
        ids = of.labels(card.of) if card.ranges else np.zeros(0, np.int64)
        for first, last, step in card.ranges:
            wanted = (ids >= first) & (ids <= last) & ((ids - first) % step == 0)
            rows.extend(known[number] for number in ids[wanted].tolist())
        return np.array(rows, np.int64)

    def _of_name(
        self, card: _Members, word: str, of: _Placed, level: _Placed, instances: dict[str, _Placed]
    ) -> Ints:
        """The rows of a set, or of what an instance calls so."""
        for found in (of, level):
            if (card.of, word.upper()) in found.sets:
                return found.sets[card.of, word.upper()]
        owner, _, rest = word.partition(".")
        inside = instances.get(owner.upper(), _Placed({}, {}, set()))
        if owner.upper() in instances and _whole(rest):
            return self._rows(_Members(card.kind, card.name, card.line, [int(rest)]), inside)
        self._refuse_unknown(card, word, (card.of, rest.upper()) in inside.sets)
        return inside.sets[card.of, rest.upper()]

    def _refuse_unknown(self, card: _Members, word: str, known: bool) -> None:
        if not known:
            expected = f"numbers and sets that stand before it in the set '{card.name}'"
            self._refuse(card.line, expected, f"'{word}'", "write out its members, or move it")

    def _named(
        self, top: _Placed, placed: dict[str, _Placed]
    ) -> tuple[exchange.Groups, exchange.Groups, exchange.Groups]:
        """Groups of points, of cells and of sides; sets of instances by their own name where that
        is the only one.
        """
        found: dict[str, exchange.Groups] = {"NSET": {}, "ELSET": {}, "SURFACE": {}}
        often = Counter(key for level in (top, *placed.values()) for key in level.sets)
        for owner, level in (("", top), *placed.items()):
            for key, rows in level.sets.items():
                own = level.names[key]
                found[key[0]][
                    own if often[key] == 1 or not owner else f"{self.spelt[owner]}.{own}"
                ] = rows
        return found["NSET"], found["ELSET"], found["SURFACE"]

    def _output(
        self, nsets: exchange.Groups, elsets: exchange.Groups, surfaces: exchange.Groups
    ) -> exchange.Mesh:
        whole = self.whole
        blocks: list[tuple[str, Ints, Ints]] = []
        order: list[int] = []
        for kind in dict.fromkeys(whole.kinds):
            ids = [i for i, k in enumerate(whole.kinds) if k == kind]
            labels = np.array([whole.labels[i] for i in ids], np.int64)
            blocks.append((kind, np.array([whole.rows[i] for i in ids], np.int64), labels))
            order += ids
        place = np.argsort(np.array(order, np.int64))
        members = {name: place[rows] for name, rows in elsets.items()}
        blocks, members = self._with_faces(blocks, surfaces, members)
        blocks, cells = _with_edges(
            blocks, nsets, {name: self._pairs(ids) for name, ids in surfaces.items()}, members
        )
        found = exchange.gathered(
            np.concatenate(whole.points), np.array(whole.numbers, np.int64), blocks, nsets, cells
        )
        return replace(found, materials=self._used_materials(elsets))

    def _used_materials(self, groups: Iterable[str]) -> dict[str, list[float]]:
        """Young's modulus, Poisson's ratio and density, 0 without one, of groups of solids; none of
        those that two sections name.
        """
        found = {}
        for group in groups:
            own = group.upper()
            names = {name for of, name in self.sections if own == of or own.endswith(f".{of}")}
            numbers = self.materials.get(names.pop(), {}) if len(names) == 1 else {}
            elastic, density = numbers.get("ELASTIC", []), numbers.get("DENSITY", [])
            if len(elastic) >= 2:
                found[group] = [*elastic[:2], *(density[:1] or [0.0])]
        return found

    def _with_faces(
        self,
        blocks: list[tuple[str, Ints, Ints]],
        surfaces: exchange.Groups,
        cells: exchange.Groups,
    ) -> tuple[list[tuple[str, Ints, Ints]], exchange.Groups]:
        """Blocks and groups of cells with triangles and quadrilaterals on the sides of solids that
        surfaces name.
        """
        count = sum(len(rows) for _, rows, _ in blocks)
        for name, sides in surfaces.items():
            faces: dict[str, list[list[int]]] = {"triangle": [], "quad": []}
            for row, i in zip(*divmod(sides, _SIDES), strict=True):
                if loops := _faces(self.whole.kinds[row]):
                    nodes = [self.whole.rows[row][corner] for corner in loops[i]]
                    faces["triangle" if len(nodes) == 3 else "quad"].append(nodes)
            for kind, found in faces.items():
                if found:
                    added = np.arange(count, count + len(found))
                    before = cells.get(name, np.zeros(0, np.int64))
                    cells = {**cells, name: np.concatenate([before, added])}
                    blocks = [*blocks, (kind, np.array(found, np.int64), added + 1)]
                    count += len(found)
        return blocks, cells

    def _pairs(self, sides: Ints) -> Ints:
        """Rows of points (i, 2) at the ends of sides of surface elements."""
        ends = []
        for row, i in zip(*divmod(sides, _SIDES), strict=True):
            corners = self.whole.rows[row][: _corners(self.whole.kinds[row])]
            if corners:
                ends.append((corners[i], corners[(i + 1) % len(corners)]))
        return np.array(ends, np.int64).reshape(-1, 2)

    # --------------------------------------------------------------------------------------------------------------- words
    def _name(self, card: _Card, option: str) -> str:
        if not card.options.get(option):
            self._refuse(
                card.line,
                f"*{card.keyword}, {option}=...",
                f"options {_shown(card.options) or 'none'}",
                "name it",
            )
        return card.options[option]

    def _number(self, kind: Callable[[str], _T], line: int, word: str) -> _T:
        try:
            if kind is int and len(word) > 18:
                raise ValueError
            return kind(word.upper().replace("D", "E") if kind is float else word)
        except ValueError:
            self._refuse(line, "a whole number" if kind is int else "a number", repr(word[:40]))

    def _empty(self, line: int) -> NoReturn:
        self._refuse(line, "a first number, a last one and a step", "nothing")

    def _refuse(
        self, line: int, expected: str, got: str, remedy: str = "export it again"
    ) -> NoReturn:
        raise InputError(say(f"{self.where}: line {line}", expected, got, remedy))


def _with_edges(
    blocks: list[tuple[str, Ints, Ints]],
    points: exchange.Groups,
    surfaces: exchange.Groups,
    cells: exchange.Groups,
) -> tuple[list[tuple[str, Ints, Ints]], exchange.Groups]:
    """Blocks and groups of cells with line cells on sides of the boundary: those of surfaces, and
    between nodes of one set.
    """
    outline = _boundary(blocks)
    count = sum(len(rows) for _, rows, _ in blocks)
    chosen = [(name, outline[np.isin(outline, ids).all(axis=1)]) for name, ids in points.items()]
    free = set(map(tuple, outline.tolist()))
    for name, pairs in surfaces.items():
        kept = [pair for pair in np.sort(pairs, axis=1).tolist() if tuple(pair) in free]
        chosen.append((name, np.array(kept, np.int64).reshape(-1, 2)))
    for name, sides in chosen:
        if len(sides):
            added = np.arange(count, count + len(sides))
            cells = {**cells, name: np.concatenate([cells.get(name, np.zeros(0, np.int64)), added])}
            blocks = [*blocks, ("line", sides, added + 1)]
            count = count + len(sides)
    return blocks, cells


def _boundary(blocks: list[tuple[str, Ints, Ints]]) -> Ints:
    """Sides (i, 2) of triangles and quadrilaterals that have one cell only."""
    corners = [rows[:, : _corners(kind)] for kind, rows, _ in blocks if _corners(kind)]
    sides = [np.stack([each, np.roll(each, -1, axis=1)], axis=2).reshape(-1, 2) for each in corners]
    found, count = np.unique(
        np.sort(np.concatenate([np.empty((0, 2), np.int64), *sides]), axis=1),
        axis=0,
        return_counts=True,
    )
    return np.asarray(found[count == 1])


def _corners(kind: str) -> int:
    """Of a triangle or quadrilateral; lines and solids have none."""
    return 3 if kind.startswith("tri") else 4 if kind.startswith("quad") else 0


def _faces(kind: str) -> list[list[int]]:
    """Corners of the sides of a solid; surfaces and lines have none."""
    return next((loops for name, loops in _FACES.items() if kind.startswith(name)), [])


def _trimmed(words: list[str]) -> list[str]:
    """Entries without the empty ones behind a last comma."""
    words = list(words)
    while words and not words[-1]:
        words.pop()
    return words


def _key(word: str) -> str:
    return " ".join(word.upper().split())


def _whole(word: str) -> bool:
    return word.isascii() and word.isdigit() and len(word) < 18


def _shown(options: dict[str, str]) -> str:
    return ", ".join(f"{key}={value}" if value else key for key, value in options.items())
