"""Declarations in a scene: pydantic models made of dataclasses, see `core.declared`, and dataclasses made of what was read.

joints: Annotated[dict[str, Joint], Named(Joint)]         names, each with one of a family as its word says
section: Annotated[Section, Made(Section)]                one of a family
material: Annotated[Material, Made(Material)]             a dataclass
"""

from __future__ import annotations

import dataclasses
import functools
import types
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import AfterValidator, Field, PlainSerializer, StrictBool, StrictInt, StrictStr, create_model

from ..core.declared import Declared
from ..core.errors import InputError, say
from ..core.expressions import Expression
from ..core.fields import Takes, quantity
from ..systems.places import At
from .models import Model

NAME = "name"  #: the field that is the key of a scene before a declaration
STRICT: dict[Any, Any] = {int: StrictInt, bool: StrictBool, str: StrictStr}


@dataclasses.dataclass(frozen=True, eq=False)
class Made:
    """A value is made of a mapping: a dataclass, or one of a family by its word."""

    kind: type

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return handler.generate_schema(Annotated[models(self.kind), AfterValidator(made), PlainSerializer(plain)])


@dataclasses.dataclass(frozen=True, eq=False)
class Named:
    """Names, each with one of a family."""

    kind: type[Declared]

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        each = Annotated[Any, Made(self.kind)]
        return handler.generate_schema(Annotated[dict[str, each], AfterValidator(named), PlainSerializer(plain)])


def models(kind: Any) -> Any:
    """The model of a dataclass; of a family the models of all its classes, which a key tells apart."""
    if Declared not in kind.__bases__:
        return model(kind)
    found = tuple(model(one) for one in sorted(set(kind.known.values()), key=lambda one: one.__name__))
    return Annotated[Union[found], Field(discriminator=kind.tag)]  # noqa: UP007  (a union of a tuple)


@functools.cache
def model(kind: Any) -> type[Model]:
    """The model of a dataclass: its fields but the name, with a tag in front where it is one of a family."""
    if "__dataclass_fields__" not in vars(kind):
        raise InputError(say(f"class {kind.__qualname__}", "a dataclass", "none", "write @dataclass(frozen=True) above it"))
    hints, keys = get_type_hints(kind, include_extras=True), dict[str, Any]()
    if issubclass(kind, Declared):
        keys[kind.tag] = (Literal[kind.words], ...)
    for field in dataclasses.fields(kind):
        if field.name != NAME:
            keys[field.name] = (taken(hints[field.name]), default_of(field))
    found: type[Model] = create_model(kind.__name__, __base__=Model, __doc__=kind.__doc__, __module__=kind.__module__, **keys)
    MADE[found] = kind
    return found


MADE: dict[type[Model], type] = {}  #: dataclasses by their models


def default_of(field: dataclasses.Field[Any]) -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return Field(default_factory=field.default_factory)
    return ... if field.default is dataclasses.MISSING else field.default


def taken(hint: Any) -> Any:
    """The annotation of a field for pydantic: texts in it are its description, and numbers of no unit are quantities too."""
    if get_origin(hint) is Annotated:
        inner, *notes = get_args(hint)
        known = [note for note in notes if isinstance(note, Takes)]
        told = [note for note in notes if isinstance(note, str)] + [note.told.get("description", "") for note in known]
        return Annotated[inner if known else taken(inner), *known, Field(description=": ".join(filter(None, told)) or None)]
    if get_origin(hint) in (Union, types.UnionType):
        return Union[tuple(taken(one) for one in get_args(hint))]  # noqa: UP007  (a union of a tuple)
    return Annotated[float, quantity("")] if hint is float else STRICT.get(hint, hint)


def made(found: Model) -> Any:
    """The dataclass of a model that was read."""
    values = {key: getattr(found, key) for key in type(found).model_fields}
    kind = MADE[type(found)]
    if not issubclass(kind, Declared):
        return kind(**values)
    word = values.pop(kind.tag)
    return worded(kind(**values, **({NAME: ""} if has_name(kind) else {})), word)


def named(found: dict[str, Any]) -> dict[str, Any]:
    """Declarations with their names."""
    return {key: worded(dataclasses.replace(one, name=key), one.word) if has_name(type(one)) else one for key, one in found.items()}


def worded(item: Any, word: str) -> Any:
    """A declaration that knows by which of its words a scene has called it."""
    if word != type(item).word:
        object.__setattr__(item, "word", word)
    return item


def has_name(kind: type) -> bool:
    return NAME in kind.__dataclass_fields__  # type: ignore[attr-defined]


def plain(value: Any) -> Any:
    """What was made as plain data, in SI units: what is None is left out."""
    if isinstance(value, Expression):
        return value.text
    if isinstance(value, At):
        place = {"s" if isinstance(value.place, float) else "group": value.place} if value.place != "" else {}
        return {"body": value.body, **place}
    if dataclasses.is_dataclass(value):
        tag: dict[str, Any] = {value.tag: value.word} if isinstance(value, Declared) else {}
        parts = {field.name: getattr(value, field.name) for field in dataclasses.fields(value) if field.name != NAME}
        return tag | {key: plain(part) for key, part in parts.items() if part is not None}
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    return [plain(part) for part in value] if isinstance(value, list | tuple) else value
