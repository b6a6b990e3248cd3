"""From the text of a scene file to a Scene: all problems at once, each with file, line and key path."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

from pydantic import ValidationError

from ..core import expressions
from ..core.errors import InputError, closest
from ..core.notices import notify
from ..core.problems import Problem, shown
from . import consistency, schema, units, yamlfile
from .consistency import Found
from .fields import Context

Keys: TypeAlias = tuple[str | int, ...]
Parameters: TypeAlias = Mapping[str, float | str]


def read(path: Path | str, parameters: Parameters | None = None) -> schema.Scene:
    """The scene in a file; `parameters` replace values of the scene's own parameters (a sweep changes nothing else)."""
    path = Path(path)
    return _scene(yamlfile.read(path), str(path), path, path.parent, parameters or {})


def loads(text: str, folder: Path | str = ".", parameters: Parameters | None = None) -> schema.Scene:
    """The scene in a text; mesh paths are relative to `folder`."""
    return _scene(yamlfile.parse(text, "scene"), "scene", None, Path(folder), parameters or {})


def _scene(node: yamlfile.Node, name: str, path: Path | None, folder: Path, changed: Parameters) -> schema.Scene:
    data = yamlfile.plain(node)
    _stop(name, node, _version(data))
    values, found = _parameters(data, changed)
    _stop(name, node, found)
    context = Context(2 if data.get("dimension") == 2 else 3, values)
    data = data | ({"parameters": {key: value.value for key, value in values.items()}} if values else {})
    try:
        scene = schema.Scene.model_validate(data, context=context)
    except ValidationError as error:
        _stop(name, node, [_found(dict(item), data) for item in error.errors(include_url=False)])
        raise
    _stop(name, node, consistency.problems(scene))
    scene._path, scene._folder, scene._node = path, folder, node
    for keys, text in consistency.notices(scene):
        notify(f"{schema.where(scene, *keys)}: {text}")
    return scene


def _stop(name: str, node: yamlfile.Node, found: Iterable[Found]) -> None:
    """Raise one InputError for all problems, in the order of their lines."""
    listed = sorted(found, key=lambda item: yamlfile.line(node, item[0]))
    if listed:
        raise InputError("\n".join(problem.at(schema.location(name, node, keys)) for keys, problem in listed))


def _version(data: Any) -> list[Found]:
    """The scene is a mapping of a version this release reads."""
    supported = f"schema version {schema.VERSION}"
    if not isinstance(data, dict):
        return [((), Problem("a mapping of schema, bodies, joints, ...", shown(data), "start with 'schema: 1'"))]
    if "schema" not in data:
        return [
            ((), Problem(f"the key 'schema' ({supported})", "no such key", f"add 'schema: {schema.VERSION}' as the first line"))
        ]
    version = data["schema"]
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        return [(("schema",), Problem(supported, shown(version), f"write 'schema: {schema.VERSION}'"))]
    if version > schema.VERSION:
        return [
            (("schema",), Problem(supported, shown(version), "install a newer fmbs_skfem, or write the scene for this version"))
        ]
    return []


def _parameters(data: dict[str, Any], changed: Parameters) -> tuple[dict[str, units.Quantity], list[Found]]:
    """Parameters in file order; each may use those before it."""
    raw = data.get("parameters")
    raw = {} if raw is None else raw
    if not isinstance(raw, dict):
        return {}, [(("parameters",), Problem("a mapping of names and quantities", shown(raw)))]
    values: dict[str, units.Quantity] = {}
    found: list[Found] = []
    for name, text in raw.items():
        try:
            if not name.isascii() or not name.isidentifier() or name in expressions.RESERVED:
                taken = ", ".join(sorted(expressions.RESERVED))
                raise Problem(f"a name of letters, digits and _ that is not taken ({taken})", shown(name))
            own = units.read(text, values)
            values[name] = _changed(own, changed[name], values) if name in changed else own
        except Problem as problem:
            found.append((("parameters", name), problem))
    for name in changed:
        if name not in raw:
            got = f"{shown(name)}{closest(name, raw)}"
            found.append((("parameters",), Problem(f"one of the parameters {', '.join(raw) or '(there are none)'}", got)))
    return values, found


def _changed(own: units.Quantity, text: float | str, values: Mapping[str, units.Quantity]) -> units.Quantity:
    """A new value of a parameter; a plain number has the dimension of the old one."""
    new = units.read(text, values)
    if new.exponents == units.NUMBER.exponents:
        return units.Quantity(new.value, own.exponents)
    if units.NUMBER.exponents != own.exponents != new.exponents:
        raise Problem(f"a value of the dimension of the parameter ({units.describe(own.exponents)})", shown(text))
    return new


def _found(error: dict[str, Any], data: Any) -> Found:
    """A pydantic error as path of keys and Problem."""
    keys, node = _keys(error["loc"], data)
    kind, context = error["type"], error.get("ctx", {})
    if kind == "extra_forbidden":
        known = sorted(node.get("properties", {}))
        return keys, Problem(f"one of the keys {', '.join(known)}", f"{shown(keys[-1])}{closest(str(keys[-1]), known)}")
    if kind == "missing":
        return keys, Problem(f"the key '{keys[-1]}'", "no such key", _hint(node.get("properties", {}).get(keys[-1], {})))
    if kind == "union_tag_not_found":
        return keys, Problem(f"the key {context['discriminator']}", "no such key", f"write one of {', '.join(_tags(node))}")
    if kind == "union_tag_invalid":
        tag = str(context["tag"])
        return (*keys, context["discriminator"].strip("'")), Problem(
            f"one of {', '.join(_tags(node))}", f"{shown(tag)}{closest(tag, _tags(node))}"
        )
    original = context.get("error")
    if isinstance(original, Problem):
        return keys, original
    expected = _EXPECTED.get(kind, "").format(**context) or error["msg"]
    hint = closest(str(error["input"]), _quoted(expected)) if kind == "literal_error" else ""
    return keys, Problem(expected, shown(error["input"]) + hint)


_EXPECTED = {
    "literal_error": "{expected}",
    "model_type": "a mapping",
    "model_attributes_type": "a mapping",
    "dict_type": "a mapping of names",
    "list_type": "a list",
    "string_type": "a text",
    "int_type": "a whole number",
    "greater_than": "a number > {gt:g}",
    "greater_than_equal": "a number >= {ge:g}",
    "less_than_equal": "a number <= {le:g}",
    "too_short": "at least {min_length}",
}


def _quoted(text: str) -> list[str]:
    return [part for part in text.split("'") if part.strip() and part.strip() not in (",", "or")]


def _tags(node: dict[str, Any]) -> list[str]:
    return sorted(node.get("discriminator", {}).get("mapping", {}))


def _hint(node: dict[str, Any]) -> str:
    return f"add {node['description']}" if "description" in node and "$ref" not in node else ""


_whole = functools.cache(schema.json_schema)


def _keys(place: Keys, data: Any) -> tuple[Keys, dict[str, Any]]:
    """Keys of the file on the way to an error, and the JSON schema of the last mapping on it.

    pydantic's path also names the member of a union (after the mapping it chose) and union branches; the file does not.
    """
    whole = _whole()
    node, keys = _resolve(whole, whole, data), list[str | int]()
    tagged = False
    for step in place:
        if isinstance(data, dict) and "discriminator" in node and not tagged:
            node, tagged = _member(whole, node, str(step)), True
            continue
        if isinstance(step, str) and (step == "[key]" or (not isinstance(data, dict) and data is not None)):
            continue
        keys.append(step)
        inside = isinstance(data, dict) and step in data
        if not inside and not (isinstance(data, list) and isinstance(step, int) and step < len(data)):
            return tuple(keys), node
        data = data[step]
        below = node.get("properties", {}).get(step) or node.get("additionalProperties") or node.get("items")
        if not isinstance(below, dict):
            return tuple(keys), node
        node, tagged = _resolve(whole, below, data), False
    return tuple(keys), node


def _resolve(whole: dict[str, Any], node: dict[str, Any], data: Any) -> dict[str, Any]:
    """The schema behind references, and the branch of a union that fits the kind of data."""
    if "$ref" in node:
        return _resolve(whole, whole["$defs"][node["$ref"].rsplit("/", 1)[1]], data)
    branches = [_resolve(whole, branch, data) for branch in node.get("anyOf", ())]
    fitting = [
        branch for branch in branches if isinstance(data, dict) == ("properties" in branch or "additionalProperties" in branch)
    ]
    return fitting[0] if fitting else node


def _member(whole: dict[str, Any], node: dict[str, Any], tag: str) -> dict[str, Any]:
    reference = node["discriminator"]["mapping"].get(tag)
    return _resolve(whole, {"$ref": reference}, {}) if reference else node
