"""The JSON schema of scene files as a page for people: every section, every type, every key with
what it takes (Markdown).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

from ..core.declared import WORD

Node: TypeAlias = Mapping[str, Any]

TAGS = ("type", "shape")  #: keys that say which of several models a mapping is
#: the last line of a description
EXAMPLE = re.compile(r"\n*^(\{(?:type|shape|profile): .*\})$", re.MULTILINE)
HEAD = """# Scene files: reference

Every section and every type with an example and its keys, as `fmbs` checks them (`fmbs schema --page`); [scene files](scenes.md)
says how they fit together.
Keys without a default are required; (none) marks keys that may be left out. Quantities are numbers in SI units, texts with a
unit, or expressions of parameters: `0.01`, `10 mm`, `d / 2`.
"""


def page(schema: Node) -> str:
    """The whole schema as Markdown."""
    schema = by_words(schema)
    known = schema["$defs"]
    parts = [HEAD]
    sections = {key: models(value) for key, value in schema["properties"].items()}
    plain = {key: schema["properties"][key] for key, own in sections.items() if not own}
    parts += ["## The file", table(plain, schema.get("required", ()))]
    told: set[str] = set()
    for key, own in sections.items():
        if not own:
            continue
        parts.append(f"## `{key}`")
        wanted = list(own)
        if "additionalProperties" in schema["properties"][key]:
            parts.append("A mapping of names, each with one of these:")
        while wanted:
            name = wanted.pop(0)
            if name not in told:
                told.add(name)
                model = known[name]
                parts += describe(model, name, own != [name])
                wanted += [
                    one for entry in model.get("properties", {}).values() for one in models(entry)
                ]
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def by_words(schema: Node) -> Node:
    """The schema with models under their first word, as their headings are, where no other model
    has it.
    """
    known = schema["$defs"]
    text = json.dumps(schema)
    first = {name: tagged(model)[0] for name, model in known.items() if tagged(model)}
    taken = [plain(name) for name in known] + list(first.values())
    for name, word in first.items():
        if plain(name) != word and taken.count(word) == 1:
            text = text.replace(f'"#/$defs/{name}"', f'"#/$defs/{word}"').replace(
                f'"{name}": {{"title"', f'"{word}": {{"title"'
            )
    found: Node = json.loads(text)
    return found


def tagged(model: Node) -> list[str]:
    """The words of a model."""
    return [word for key in TAGS for word in words(model.get("properties", {}).get(key, {}))]


def describe(model: Node, name: str, titled: bool) -> Iterator[str]:
    """Title, description, example and keys of a model."""
    entries = {key: value for key, value in model.get("properties", {}).items() if key not in TAGS}
    known = tagged(model)
    text = model.get("description", "")
    if titled:
        yield f"### {', '.join(f'`{word}`' for word in known or [plain(name)])}"
    yield EXAMPLE.sub("", text)
    yield from (f"```yaml\n{example}\n```" for example in EXAMPLE.findall(text))
    if entries:
        yield table(entries, model.get("required", ()))


def table(entries: Mapping[str, Node], required: Any) -> str:
    """Keys, what they take, and their defaults."""
    lines = ["| key | takes | default |", "|---|---|---|"]
    for key, value in entries.items():
        default = (
            ""
            if key in required
            else "(none)"
            if value.get("default") is None
            else f"`{json.dumps(value['default'])}`"
        )
        lines.append(f"| `{key}` | {takes(value)} | {default} |".replace(" |  |", " | |"))
    return "\n".join(lines)


def takes(value: Node) -> str:
    """What a key takes, in words: its description, after the words or whole numbers that it may be."""
    if "properties" in value:
        return kind(value)
    options = [
        one for one in value.get("anyOf", value.get("oneOf", ())) if one.get("type") != "null"
    ]
    known = " or ".join(f"`{word}`" for word in words(value)) or (
        kind(value) if value.get("type") == "integer" else ""
    )
    if known or "description" in value:
        inside = options[0].get("description") if len(options) == 1 else ""
        return ": ".join(part for part in (known, value.get("description"), inside) if part)
    if options:
        return " or ".join(dict.fromkeys(takes(one) for one in options))
    if "$ref" in value:
        return f"[{plain(reference(value))}](#{plain(reference(value))})"
    return kind(value)


def kind(value: Node) -> str:
    """What a value of a JSON type is, in words."""
    match value.get("type"):
        case "array":
            return f"a list of: {takes(value['items'])}"
        case "object" if "properties" in value:
            return (
                "{"
                + ", ".join(f"{key}: {takes(part)}" for key, part in value["properties"].items())
                + "}"
            )
        case "object":
            return f"names, each with {takes(value['additionalProperties'])}"
        case "integer":
            return f"a whole number{bounds(value)}"
        case "number":
            return f"a number{bounds(value)}"
        case "boolean":
            return "true or false"
        case _:
            return f"a text of {value['pattern']}" if "pattern" in value else "a text"


def bounds(value: Node) -> str:
    """The interval of a number."""
    if {"minimum", "maximum"} <= set(value):
        return f" from {value['minimum']} to {value['maximum']}"
    signs = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    return "".join(f" {sign} {value[key]:g}" for key, sign in signs.items() if key in value)


def models(value: Node) -> list[str]:
    """Names of the models that a key refers to, each once."""
    found = [reference(value)] if "$ref" in value else []
    for one in (*value.get("anyOf", ()), *value.get("oneOf", ())):
        found += models(one)
    for inside in (value.get("items"), value.get("additionalProperties")):
        found += models(inside) if isinstance(inside, Mapping) else []
    return list(dict.fromkeys(found))


def reference(value: Node) -> str:
    """Name of the model behind a `$ref`."""
    return str(value["$ref"]).rpartition("/")[2]


def plain(name: str) -> str:
    """The name of a model as the words of scenes are written."""
    return WORD.sub("_", name).lower()


def words(value: Node) -> list[str]:
    """The words that a key may be."""
    found = [value["const"]] if "const" in value else value.get("enum", [])
    return [str(word) for word in found]
