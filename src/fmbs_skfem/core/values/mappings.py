"""What annotations of declarations say: how values of a scene become dataclasses, their JSON
schema, and the way back.

    stiffness: Annotated[float, fields.quantity("N/m"), "of the spring"]   what `fields.Takes` reads, with its description
    size: float;  count: int;  law: str;  damped: bool                     a quantity of no unit, a whole number, a text, a flag
    about: Literal["equilibrium", "reference"]                             one of these
    spin: Spin | None;  coarse: tuple[int, ...];  points: dict[str, Place] nothing or a mapping, a list, names
    section: Section                                                       one of a family, as its word says

A value that does not fit raises `Problem`; one with parts raises `Problems`, all of them with their
paths of keys.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import re
import types
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from .. import own_words
from ..declared import Declared
from ..errors import InputError, closest, say
from . import synonyms
from .expressions import Expression
from .fields import Context, Schema, Takes, mapping_schema, quantity, read_text, whole
from .problems import Problem, Problems, read_all, shown
from .responses import OfState
from .units import Quantity

NAME = "name"  #: the field that is the key of a scene before a declaration
WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
HIDDEN = types.MappingProxyType({"hidden": True})  #: metadata of fields that are no keys
REFERENCE = "#/$defs/"


@dataclasses.dataclass(frozen=True, eq=False)
class Entry:
    """What a key of a mapping takes, and its default."""

    rule: Takes
    default: Any = dataclasses.MISSING
    needed: bool = True
    field: str = ""  #: its name in Python, `from_` of the key `from`


@functools.cache
def entries(kind: Any) -> dict[str, Entry]:
    """The keys of a dataclass: its fields but hidden ones, and the name of a declaration."""
    require_dataclass(kind)
    hints = get_type_hints(kind, include_extras=True)
    found = dict[str, Entry]()
    for field in dataclasses.fields(kind):
        if "hidden" not in field.metadata and not (
            field.name == NAME and issubclass(kind, Declared)
        ):
            made: Any = field.default_factory
            default = (
                made()
                if isinstance(made, type) and dataclasses.is_dataclass(made)
                else field.default
            )
            needed = default is dataclasses.MISSING and made is dataclasses.MISSING
            rule = takes(hints[field.name])
            found[field.name.removesuffix("_")] = Entry(rule, default, needed, field.name)
    return found


def require_dataclass(kind: type) -> None:
    """Refuse a class that inherits fields and has none of its own, or lacks methods."""
    where = f"class {kind.__qualname__}"
    if "__dataclass_fields__" not in vars(kind):
        raise InputError(
            say(where, "a dataclass", "none", "write @dataclass(frozen=True) above it")
        )
    if missing := sorted(getattr(kind, "__abstractmethods__", ())):
        raise InputError(say(where, f"the methods {', '.join(missing)}", "none of these"))


def rules(item: Any) -> Iterator[tuple[str, Takes, Any]]:
    """Key, rule and value of every field of a dataclass."""
    kind: Any = type(item)
    for key, entry in entries(kind).items():
        yield key, entry.rule, getattr(item, entry.field)


# ------------------------------------------------------------------------------------------------------------------- takes
def takes(hint: Any) -> Takes:
    """What an annotation takes."""
    origin = get_origin(hint)
    parts = get_args(hint)
    if origin is Annotated:
        return described(parts[0], parts[1:])
    if origin in (Union, types.UnionType):
        return any_of(
            [takes(one) for one in parts if one is not types.NoneType], types.NoneType in parts
        )
    if origin is Literal:
        return one_of(parts)
    if origin is dict:
        return names(parts[1])
    if isinstance(origin, type) and issubclass(origin, Sequence):
        return list_of(takes(parts[0]), origin)
    if hint in PLAIN:
        return PLAIN[hint]
    if isinstance(hint, type) and Declared in hint.__bases__:
        return Takes(functools.partial(read_family, hint), functools.partial(family_schema, hint))
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return Takes(functools.partial(read_struct, hint), functools.partial(refer, hint))
    raise InputError(
        say(
            "annotation",
            "one of core.values.mappings",
            hint,
            "say what it takes: Annotated[..., Takes(...)]",
        )
    )


PLAIN = {
    float: quantity(""),
    int: whole(),
    str: Takes(read_text, {"type": "string"}),
    bool: Takes(lambda value, context: read_flag(value), {"type": "boolean"}),
}


def read_flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise Problem("true or false", shown(value))
    return value


def described(inner: Any, notes: Sequence[Any]) -> Takes:
    """The rule among the notes of an annotation, or that of its type, with the texts among them as
    its description.
    """
    known = next((note for note in notes if isinstance(note, Takes)), None)
    rule = known or takes(inner)
    texts = [note for note in notes if isinstance(note, str)]
    if not texts:
        return rule

    def schema() -> Schema:
        told = rule.schema
        return told | {
            "description": ": ".join(
                filter(None, [*texts, told.get("description", "") if known else ""])
            )
        }

    return dataclasses.replace(rule, describe=schema)


def any_of(options: Sequence[Takes], none: bool) -> Takes:
    """What one of several rules takes, or nothing."""

    def read(value: object, context: Context) -> Any:
        if value is None and none:
            return None
        for option in options[:-1]:
            try:
                return option.read(value, context)
            except InputError:
                pass
        return options[-1].read(value, context)

    def schema() -> Schema:
        return {
            "anyOf": [*(option.schema for option in options), *([{"type": "null"}] if none else [])]
        }

    return dataclasses.replace(options[-1], read=read, describe=schema)


def one_of(options: Sequence[Any]) -> Takes:
    """One of some words or numbers."""
    *others, last = map(repr, options)
    told = f"{', '.join(others)} or {last}" if others else last

    def read(value: object, context: Context) -> Any:
        for option in options:
            if value == option and not isinstance(value, bool):
                return option
        raise Problem(
            told,
            shown(value) + closest(str(value), (one for one in options if isinstance(one, str))),
        )

    kind = {"type": "integer" if isinstance(options[0], int) else "string"}
    return Takes(read, {"enum": list(options), **kind} if others else {"const": options[0], **kind})


def list_of(each: Takes, kind: type) -> Takes:
    """A list of values, as a tuple where its type is none that can be made."""

    def read(value: object, context: Context) -> Any:
        if not isinstance(value, list | tuple):
            raise Problem("a list", shown(value))
        found = read_all(
            (k, functools.partial(each.read, one, context)) for k, one in enumerate(value)
        )
        return found if kind is list else tuple(found)

    return Takes(read, lambda: {"type": "array", "items": each.schema})


def names(hint: Any, least: int = 0, words: bool = False) -> Takes:
    """A mapping of names, at least so many; those of declarations, and `words`, begin with a
    letter.
    """
    each = takes(hint)
    named = isinstance(hint, type) and issubclass(hint, Declared)

    def read(value: object, context: Context) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise Problem("a mapping of names", shown(value), "write 'name: ...' for each")
        if len(value) < least:
            raise Problem(f"at least {least} entry", "none", "write 'name: {...}' for each")
        odd = [key for key in value if (named or words) and not WORD.fullmatch(key)]
        found = [
            (
                (key,),
                Problem("a name of letters, digits, _ and -, beginning with a letter", shown(key)),
            )
            for key in odd
        ]
        read = read_all(
            ((key, functools.partial(each.read, one, context)) for key, one in value.items()), found
        )
        return {
            key: with_name(one, key) if named else one for key, one in zip(value, read, strict=True)
        }

    return Takes(
        read,
        lambda: (
            {"type": "object", "additionalProperties": each.schema}
            | ({"minProperties": least} if least else {})
        ),
    )


def at_fractions(each: Takes) -> Takes:
    """Values at fractions of a length, {0: ..., 0.5: ..., 1: ...}."""
    told = "at fractions of the length, 0 to 1"

    def read(value: object, context: Context) -> dict[float, Any]:
        if not isinstance(value, dict):
            raise Problem(f"a mapping of values {told}, such as {{0: ..., 1: ...}}", shown(value))
        place = quantity("", ">= 0", "<= 1").read
        keys = read_all((key, functools.partial(place, key, context)) for key in value)
        found = read_all(
            (key, functools.partial(each.read, one, context)) for key, one in value.items()
        )
        return dict(zip(keys, found, strict=True))

    return Takes(
        read, lambda: {"type": "object", "additionalProperties": each.schema, "description": told}
    )


# ------------------------------------------------------------------------------------------------------- dataclasses, families
def read_struct(kind: type, value: object, context: Context) -> Any:
    """A dataclass of a mapping of its fields."""
    return make(kind, value, context, {})


def make(kind: type, value: object, context: Context, tagged: Mapping[str, Any]) -> Any:
    """A dataclass of a mapping of its fields, beside which stands a tag that was read."""
    known = entries(kind)
    if not isinstance(value, dict):
        raise Problem(f"a mapping of {', '.join(known)}", shown(value))
    found = [
        ((key,), Problem(f"the key '{key}'", "no such key", hint_of(entry.rule.schema)))
        for key, entry in known.items()
        if entry.needed and key not in value
    ]
    keys = sorted({*known, *tagged})
    found += [
        (
            (key,),
            Problem(f"one of the keys {', '.join(keys)}", f"{shown(key)}{closest(str(key), keys)}"),
        )
        for key in value
        if key not in keys
    ]
    given = [key for key in known if key in value]
    values = read_all(
        ((key, functools.partial(known[key].rule.read, value[key], context)) for key in given),
        found,
    )
    more = {NAME: ""} if issubclass(kind, Declared) and has_name(kind) else {}
    return kind(**{known[key].field: one for key, one in zip(given, values, strict=True)}, **more)


def inline(kind: type) -> Takes:
    """What makes a dataclass, with its schema where it stands."""
    return Takes(functools.partial(read_struct, kind), functools.partial(object_schema, kind))


def hint_of(told: Schema) -> str:
    return f"add {told['description']}" if "description" in told and "$ref" not in told else ""


def read_family(family: type[Declared], value: object, context: Context) -> Any:
    """One of a family, of the class of its word."""
    if not isinstance(value, dict):
        raise Problem("a mapping", shown(value))
    known: Mapping[str, Any] = family.known
    for kind in known.values():
        require_dataclass(kind)
    words = sorted(known)
    if not words:
        remedy = "name the Python file that declares one under 'extensions' (docs/extensions.md)"
        raise Problem(
            f"a {family.__name__.lower()} of an extension", "none that is declared", remedy
        )
    if family.tag not in value:
        raise Problem(f"the key '{family.tag}'", "no such key", f"write one of {', '.join(words)}")
    word = own_words.meant(str(value[family.tag]), known, context.modules)
    if word not in family.known:
        near = synonyms.meant(word, synonyms.WORDS.get(family.__name__, {}), known) or meant(
            word, family
        )
        raise Problems(
            [((family.tag,), Problem(f"one of {', '.join(words)}", f"{shown(word)}{near}"))]
        )
    return with_word(make(family.known[word], value, context, {family.tag: word}), word)


def meant(word: str, family: type[Declared]) -> str:
    """`; perhaps 'cable': a thin cable or beam ...` for the class of a family that alone has a word
    in its first sentence.
    """
    texts = {
        name: re.split(r"[.;] |\n\n", kind.__doc__ or "")[0] for name, kind in family.known.items()
    }
    found = [
        name
        for name, text in texts.items()
        if re.search(rf"\b{re.escape(word)}s?\b", text, re.IGNORECASE)
    ]
    return (
        f"; perhaps '{found[0]}': {' '.join(texts[found[0]].split()).rstrip('.')}"
        if len(found) == 1 and word
        else ""
    )


def with_name(item: Any, name: str) -> Any:
    """A declaration with its name, where its class has one."""
    return (
        with_word(dataclasses.replace(item, name=name), item.word) if has_name(type(item)) else item
    )


def with_word(item: Any, word: str) -> Any:
    """A declaration that knows by which of its words a scene has called it."""
    if word != type(item).word:
        object.__setattr__(item, "word", word)
    return item


def has_name(kind: type) -> bool:
    return NAME in kind.__dataclass_fields__  # type: ignore[attr-defined]


# ------------------------------------------------------------------------------------------------------------- JSON schemas
STRUCTS: dict[str, type] = {}  #: dataclasses that a schema in the making refers to


def json_schema(kind: type) -> Schema:
    """The JSON schema of a dataclass with all that it refers to."""
    STRUCTS.clear()
    whole = object_schema(kind)
    found = dict[str, Schema]()
    wanted = references(whole)
    while wanted:
        if (name := wanted.pop()) not in found:
            found[name] = object_schema(STRUCTS[name])
            wanted |= references(found[name])
    return {"$defs": dict(sorted(found.items())), **whole}


def references(schema: Any) -> set[str]:
    """Names of the dataclasses that a schema refers to."""
    if isinstance(schema, dict):
        own = (
            {schema["$ref"].removeprefix(REFERENCE)}
            if isinstance(schema.get("$ref"), str)
            else set()
        )
        return own.union(*map(references, schema.values()))
    return set().union(*map(references, schema)) if isinstance(schema, list) else set()


def object_schema(kind: type) -> Schema:
    """The JSON schema of a dataclass, which refers to others."""
    known = entries(kind)
    keys = {key: entry.rule.schema | shown_default(entry) for key, entry in known.items()}
    required = [key for key, entry in known.items() if entry.needed]
    if issubclass(kind, Declared):
        keys = {kind.tag: one_of(kind.words).schema, **keys}
        required = [kind.tag, *required]
    return {
        "title": kind.__name__,
        "description": inspect.cleandoc(kind.__doc__ or ""),
        **mapping_schema(tuple(required), **keys),
    }


def shown_default(entry: Entry) -> Schema:
    """The default of a key; none of what is made anew each time."""
    if entry.default is dataclasses.MISSING:
        return {}
    return {"default": (entry.rule.show or plain)(entry.default)}


def refer(kind: type) -> Schema:
    """A reference to the schema of a dataclass; with its module where another one has its name."""
    name = kind.__name__
    if STRUCTS.setdefault(name, kind) is not kind:
        name = f"{kind.__module__}.{kind.__qualname__}".replace(".", "__")
        STRUCTS[name] = kind
    return {"$ref": REFERENCE + name}


def family_schema(family: type[Declared]) -> Schema:
    """One of all classes of a family, which a key tells apart."""
    kinds = sorted(set(family.known.values()), key=lambda one: one.__name__)
    words = {word: refer(kind)["$ref"] for word, kind in sorted(family.known.items())}
    return {
        "oneOf": [refer(kind) for kind in kinds],
        "discriminator": {"mapping": words, "propertyName": family.tag},
    }


# ------------------------------------------------------------------------------------------------------------ the way back
@functools.singledispatch
def plain(value: Any) -> Any:
    """What was read as plain data, in SI units: what is None is left out."""
    if dataclasses.is_dataclass(value):
        tag: dict[str, Any] = {value.tag: value.word} if isinstance(value, Declared) else {}
        parts = {
            field.name: getattr(value, field.name)
            for field in dataclasses.fields(value)
            if "hidden" not in field.metadata and not (tag and field.name == NAME)
        }
        return tag | {key: plain(part) for key, part in parts.items() if part is not None}
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    return [plain(part) for part in value] if isinstance(value, list | tuple) else value


@plain.register
def _(value: Expression | OfState) -> str:
    return value.text


@plain.register
def _(value: Quantity) -> float:
    return value.value
