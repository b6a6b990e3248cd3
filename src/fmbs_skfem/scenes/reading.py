"""From the text of a scene file to a Scene: all problems at once, each with file, line and key
path.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from ..core import consents, own_words
from ..core.errors import InputError
from ..core.notices import notify, remark
from ..core.values.arguments import checked
from ..core.values.fields import Context
from ..core.values.mappings import read_struct
from ..core.values.problems import Found, Problem, located, printable, shown
from . import consistency, inputs, parameters, schema, yamlfile
from . import extensions as python_files
from .analyses.analysis import Analysis
from .parameters import Changes
from .yamlfile import location, where

MOST = 50  #: problems that one message lists


@checked
def read(
    path: Path | str,
    parameters: Changes | None = None,
    repair: bool = False,
    *,
    extensions: str | None = None,
) -> schema.Scene:
    """The scene in a file, all its quantities in SI units.

    `parameters` replace values of the scene's own parameters, as numbers in SI units or as text
    with a unit (a sweep changes nothing else). With `repair`, nodes of its meshes that are at one
    place are merged. Python files that the scene names are run where `extensions` is "allow", see
    `core.consents`. Raises InputError, which lists every problem with file, line and path of keys;
    what is hardly meant is a Python warning of the class `Notice`. Meshes are not read yet.

        >>> from fmbs_skfem import scenes
        >>> scene = scenes.read("examples/double_pendulum.yaml")
        >>> [*scene.bodies], scene.analysis.step
        (['I', 'II'], 0.0005)
    """
    path = Path(path)
    with consents.given(extensions):
        return _warn(
            _scene(yamlfile.read(path), str(path), path, path.parent, parameters or {}, repair)
        )


@checked
def loads(
    text: str,
    folder: Path | str = ".",
    parameters: Changes | None = None,
    *,
    extensions: str | None = None,
) -> schema.Scene:
    """The scene in a text, as `read`.

    Mesh paths are relative to `folder`.

        >>> from fmbs_skfem import scenes
        >>> scene = scenes.loads('''
        ... schema: 1
        ... dimension: 2
        ... bodies: {ball: {type: point_mass, mass: 500 g, position: [0, 2]}}
        ... analysis: {type: dynamic, duration: 1 s, step: 1 ms}
        ... ''')
        >>> scene.bodies["ball"].mass  # in SI units
        0.5
    """
    with consents.given(extensions):
        return _warn(
            _scene(yamlfile.parse(text, "scene"), "scene", None, Path(folder), parameters or {})
        )


def _scene(
    node: yamlfile.Node,
    name: str,
    path: Path | None,
    folder: Path,
    changed: Changes,
    repair: bool = False,
    modules: tuple[str, ...] | None = None,
) -> schema.Scene:
    data = yamlfile.plain(node)
    _stop(name, node, _version(data))
    _stop(name, node, python_files.load(data.get("extensions"), folder))
    modules = python_files.modules(data.get("extensions"), folder) if modules is None else modules
    known = parameters.resolve(data.get("parameters"), changed)
    _stop(name, node, known.found)
    values = {key: value.value for key, value in known.values.items()}
    context = Context(
        2 if data.get("dimension") == 2 else 3,
        known.values,
        known.ranges,
        _clock(data.get("analysis"), modules),
        modules=modules,
    )
    told, wrong = inputs.inputs(data.get("inputs"), context)
    given, more = inputs.steered(data.get("controllers"), context)
    listed, odd = inputs.tables(data.get("tables"), context, folder)
    _stop(name, node, [*wrong, *more, *odd])
    context = replace(
        context,
        inputs=told | given | {one.table.name: one.table for one in listed.values() if one.table},
    )
    ready = {
        key: value
        for key, value in (("parameters", values), ("inputs", told), ("tables", listed))
        if value
    }
    try:
        found = read_struct(schema.Scene, data | ready, context)
    except InputError as error:
        _stop(name, node, located(error))
        raise
    origin: dict[str, Any] = {"path": path, "folder": folder, "node": node, "repair": repair}
    origin["read"] = partial(_scene, node, name, path, folder, repair=repair, modules=modules)
    scene: schema.Scene = replace(
        found,
        **origin,
        ranges=known.ranges,
        parameter_units=known.si_units(),
        changed=dict(changed),
        used=known.used(),
    )
    _stop(name, node, consistency.problems(scene))
    return scene


def _clock(analysis: Any, modules: tuple[str, ...]) -> bool:
    """Whether t is a time in an analysis that is not read yet."""
    word = analysis.get(Analysis.tag) if isinstance(analysis, dict) else None
    found = (
        Analysis.known.get(own_words.meant(word, Analysis.known, modules))
        if isinstance(word, str)
        else None
    )
    return True if found is None else found.clock


def _warn(scene: schema.Scene) -> schema.Scene:
    """The scene, after warnings of what is hardly meant."""
    for keys, text in consistency.notices(scene):
        notify(f"{where(scene, *keys)}: {text}")
    for text in python_files.own_words_in(scene):
        remark(f"{where(scene, 'extensions')}: {text}")
    return scene


def _stop(name: str, node: yamlfile.Node, found: Iterable[Found]) -> None:
    """Raise one InputError for all problems, in the order of their lines."""
    listed = sorted(found, key=lambda item: yamlfile.line(node, item[0]))
    if listed:
        more = [f"{name}: and {len(listed) - MOST} more problems"] if len(listed) > MOST else []
        told = [
            printable(problem.at(location(name, node, keys))) for keys, problem in listed[:MOST]
        ]
        raise InputError("\n".join(told + more))


def _version(data: Any) -> list[Found]:
    """The scene is a mapping of a version this release reads."""
    supported = f"schema version {schema.VERSION}"
    if not isinstance(data, dict):
        return [
            (
                (),
                Problem(
                    "a mapping of schema, bodies, joints, ...",
                    shown(data),
                    "start with 'schema: 1'",
                ),
            )
        ]
    if "schema" not in data:
        return [
            (
                (),
                Problem(
                    f"the key 'schema' ({supported})",
                    "no such key",
                    f"add 'schema: {schema.VERSION}' as the first line",
                ),
            )
        ]
    version = data["schema"]
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        return [
            (("schema",), Problem(supported, shown(version), f"write 'schema: {schema.VERSION}'"))
        ]
    if version > schema.VERSION:
        return [
            (
                ("schema",),
                Problem(
                    supported,
                    shown(version),
                    "install a newer fmbs_skfem, or write the scene for this version",
                ),
            )
        ]
    return []
