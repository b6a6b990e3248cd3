"""Declarations: joints, loads, outputs, sections, each a frozen dataclass that Python makes and
scenes name by a word.

    @dataclass(frozen=True)
    class Spring(Load):                                           "type: spring" in a scene; word="..." another one, None no one
        name: str
        at: Annotated[At, fields.PLACE]                           core.values.fields, systems.fields: what a key of the scene takes
        stiffness: Annotated[float, fields.quantity("N/m", ">= 0"), "along x"] = 0.0

A direct subclass of `Declared` is a family, such as `Joint`; a class of a family is known by its
words as soon as it is declared. The keys of scenes, their JSON schema and reference page follow
from the fields, `name` from the key that stands before them.
"""

from __future__ import annotations

import re
from abc import ABC
from collections.abc import Iterator
from dataclasses import fields
from typing import Any, ClassVar

from . import own_words
from .errors import InputError, say
from .values import arguments
from .values.problems import Problem

WORD = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


class Declared:
    """Base of families; abstract classes, those with the base `ABC`, have no word."""

    known: ClassVar[dict[str, type[Any]]]  #: classes of a family by word
    tag: ClassVar[str] = "type"  #: key of a scene that holds the word
    words: ClassVar[tuple[str, ...]] = ()
    #: the first of the words, of what a scene has made the one that it wrote
    word: ClassVar[str] = ""

    def __init_subclass__(cls, word: str | tuple[str, ...] | None = "", **more: Any) -> None:
        super().__init_subclass__(**more)
        if Declared in cls.__bases__:
            cls.known = {}
        if ABC in cls.__bases__ or word is None:
            return
        words = (
            ((word,) if isinstance(word, str) else word)
            if word
            else (WORD.sub("_", cls.__name__).lower(),)
        )
        cls.words = tuple(
            own_words.free(cls.known, one, cls.__module__, lambda kind: kind.__module__)
            for one in words
        )
        cls.word = cls.words[0]
        for one in cls.words:
            other = cls.known.get(one)
            if other is not None and (other.__module__, other.__qualname__) != (
                cls.__module__,
                cls.__qualname__,
            ):
                known = f"'{one}', which is that of {other.__module__}.{other.__qualname__}"
                raise InputError(
                    say(
                        f"class {cls.__qualname__}",
                        "a word of its own",
                        known,
                        "give it another one, word='...'",
                    )
                )
            cls.known[one] = cls

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        """What is wrong with it in `dim` dimensions beyond single fields: names of fields, or paths
        of keys, and problems.
        """
        return iter(())


def words_with(key: str) -> list[str]:
    """First words of all that is declared, of whatever family, with this key."""
    every = (one for family in Declared.__subclasses__() for one in family.known.values())
    return sorted({one.word for one in every if any(field.name == key for field in fields(one))})


def require_sound(what: str, name: str, item: Any, family: type[Declared], dim: int) -> None:
    """Refuse what is no joint, load or output, and those with problems."""
    if not isinstance(item, family):
        raise InputError(
            say(
                f"{what} '{name}'" if name else f"{what}s",
                f"a {family.__name__.lower()}",
                type(item).__name__,
            )
        )
    where = f"{what} '{name}'"
    for key, problem in problems_of(item, where, dim):
        raise InputError(
            problem.at(
                where + (f".{key if isinstance(key, str) else '.'.join(key)}" if key else "")
            )
        )
    arguments.check_fields(item, where)


def problems_of(item: Any, where: str, dim: int) -> list[tuple[str | tuple[str, ...], Problem]]:
    """The problems that an item knows of, which may not stand what its fields cannot hold."""
    with arguments.blaming(lambda: arguments.check_fields(item, where)):
        return list(item.problems(dim))
