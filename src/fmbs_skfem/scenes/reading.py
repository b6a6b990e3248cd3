"""From the text of a scene file to a Scene: all problems at once, each with file, line and key path."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias

from pydantic import ValidationError

from ..core.errors import InputError, closest, say
from ..core.fields import Context
from ..core.notices import notify
from ..core.problems import Problem, printable, shown
from . import consistency, extensions, parameters, schema, yamlfile
from .models import Found
from .parameters import Changes

Keys: TypeAlias = tuple[str | int, ...]

MOST = 50  #: problems that one message lists


def read(path: Path | str, parameters: Changes | None = None, repair: bool = False) -> schema.Scene:
    """The scene in a file, all its quantities in SI units.

    `parameters` replace values of the scene's own parameters, as numbers in SI units or as text with a unit (a sweep changes
    nothing else). With `repair`, nodes of its meshes that are at one place are merged. Raises InputError, which lists every problem
    with file, line and path of keys; what is hardly meant is a Python warning of the class `Notice`. Meshes are not read yet.
    """
    path = Path(path)
    return _warn(_scene(yamlfile.read(path), str(path), path, path.parent, parameters or {}, repair))


def loads(text: str, folder: Path | str = ".", parameters: Changes | None = None) -> schema.Scene:
    """The scene in a text, as `read`; mesh paths are relative to `folder`."""
    return _warn(_scene(yamlfile.parse(text, "scene"), "scene", None, Path(folder), parameters or {}))


def again(scene: schema.Scene, changed: Changes) -> schema.Scene:
    """The same scene with other values of parameters, on top of those it was read with; warnings are not repeated."""
    if scene._node is None:
        raise InputError(say("scene", "one that was read from a file or a text", "one made in Python"))
    known = {**scene._changed, **changed}
    return _scene(scene._node, str(scene.path or "scene"), scene.path, scene.folder, known, scene.repair)


def _scene(node: yamlfile.Node, name: str, path: Path | None, folder: Path, changed: Changes, repair: bool = False) -> schema.Scene:
    data = yamlfile.plain(node)
    _stop(name, node, _version(data))
    _stop(name, node, extensions.load(data.get("extensions"), folder))
    known = parameters.resolve(data.get("parameters"), changed)
    _stop(name, node, known.found)
    values = {key: value.value for key, value in known.values.items()}
    analysis = data.get("analysis")
    clock = not (isinstance(analysis, dict) and analysis.get("type") == "static")
    context = Context(2 if data.get("dimension") == 2 else 3, known.values, known.ranges, clock)
    data = data | ({"parameters": values} if values else {})
    schema.refresh()
    try:
        scene = schema.Scene.model_validate(data, context=context)
    except ValidationError as error:
        _stop(name, node, [_describe_error(dict(item), data) for item in error.errors(include_url=False)])
        raise
    scene._path, scene._folder, scene._node, scene._ranges, scene._changed = path, folder, node, known.ranges, dict(changed)
    scene._used, scene._repair = known.used(), repair
    _stop(name, node, consistency.problems(scene))
    return scene


def _warn(scene: schema.Scene) -> schema.Scene:
    """The scene, after warnings of what is hardly meant."""
    for keys, text in consistency.notices(scene):
        notify(f"{schema.where(scene, *keys)}: {text}")
    return scene


def _stop(name: str, node: yamlfile.Node, found: Iterable[Found]) -> None:
    """Raise one InputError for all problems, in the order of their lines."""
    listed = sorted(found, key=lambda item: yamlfile.line(node, item[0]))
    if listed:
        more = [f"{name}: and {len(listed) - MOST} more problems"] if len(listed) > MOST else []
        told = [printable(problem.at(schema.location(name, node, keys))) for keys, problem in listed[:MOST]]
        raise InputError("\n".join(told + more))


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


def _describe_error(error: dict[str, Any], data: Any) -> Found:
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
    if kind == "too_short":
        return keys, Problem(f"at least {context['min_length']} entry of '{keys[-1]}'", "none", "write 'name: {...}' for each")
    original = context.get("error")
    if isinstance(original, Problem):
        return keys, original
    expected = _EXPECTED.get(kind, "").format(**context) or error["msg"]
    hint = closest(str(error["input"]), _read_quoted(expected)) if kind == "literal_error" else ""
    return keys, Problem(expected, shown(error["input"]) + hint, _REMEDIES.get(kind, ""))


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
    "less_than": "a number < {lt:g}",
    "less_than_equal": "a number <= {le:g}",
}


_REMEDIES = {"dict_type": "write 'name: ...' for each"}


def _read_quoted(text: str) -> list[str]:
    return [part for part in text.split("'") if part.strip() and part.strip() not in (",", "or")]


def _tags(node: dict[str, Any]) -> list[str]:
    return sorted(node.get("discriminator", {}).get("mapping", {}))


def _hint(node: dict[str, Any]) -> str:
    return f"add {node['description']}" if "description" in node and "$ref" not in node else ""


def _keys(place: Keys, data: Any) -> tuple[Keys, dict[str, Any]]:
    """Keys of the file on the way to an error, and the JSON schema of the last mapping on it.

    pydantic's path also names the member of a union (after the mapping it chose) and union branches; the file does not.
    """
    whole = schema.whole()
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
