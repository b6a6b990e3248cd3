"""Damaged and random scenes, expressions, meshes, NURBS files and saved models: each is read, or
refused with exit code 3 or 8.

Every call has a limit of processor time; what is read at all is looked at: its numbers are finite
and its cells have their nodes. The tries are the same in every run; FMBS_FUZZ=20 makes twenty times
as many, other ones every time.
"""

from __future__ import annotations

import copy
import functools
import json
import os
import re
import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import CorruptFile, InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.storage import container
from fmbs_skfem.core.values import expressions
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import yamlfile
from fmbs_skfem.shapes import meshes, nurbs_file, plate_meshes
from tests.cli.calls import EXAMPLES, fmbs

from .inputs import HOUSE, MESHES, STRIP

LIMIT = 20.0  #: processor time of one call, beyond which it hangs [s]
TEXTS = {path.name: path.read_text(encoding="utf-8") for path in sorted(EXAMPLES.glob("*.yaml"))}

FACTOR = int(os.environ.get("FMBS_FUZZ", "1"))


def tries(count: int) -> settings:
    """So many tries, without a deadline of the clock: another process may have the processor."""
    checks = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
    return settings(
        max_examples=FACTOR * count,
        deadline=None,
        derandomize=FACTOR == 1,
        database=None,
        suppress_health_check=checks,
    )


@contextmanager
def guarded() -> Iterator[None]:
    """A call that may not hang: SIGPROF ends it after LIMIT seconds of processor time; notices are
    let pass.
    """

    def expired(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"no answer after {LIMIT:g} s")

    before = signal.signal(signal.SIGPROF, expired)
    signal.setitimer(signal.ITIMER_PROF, LIMIT)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Notice)
            yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def told(read: Callable[[], Any]) -> Any:
    """What is read, or None where the input is refused in the house form, and not at length."""
    try:
        with guarded():
            return read()
    except InputError as error:
        message, code = str(error), error.exit_code
    assert all(HOUSE.match(line) or "more problems" in line for line in message.splitlines()), (
        message
    )
    assert (code, len(message) < 100_000) == (3, True)
    return None


# ---------------------------------------------------------------------------------------------------------------------- scenes
def paths(value: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Keys on the way to every value."""
    items = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    for key, inner in items:
        yield (*path, key)
        yield from paths(inner, (*path, key))


@functools.cache
def scene(name: str) -> Any:
    """An example as plain values."""
    return yamlfile.plain(yamlfile.parse(TEXTS[name], name))


@functools.cache
def places() -> list[tuple[str, tuple[str | int, ...]]]:
    """Every value of every example, read by the process that asks for it first and not by all that
    collect tests.
    """
    return [(name, path) for name in TEXTS for path in paths(scene(name))]


PLACES = st.deferred(lambda: st.sampled_from(places()))
ODD: st.SearchStrategy[Any] = st.one_of(
    st.sampled_from(
        [
            None,
            True,
            False,
            0,
            -1,
            10**30,
            1e-320,
            1e300,
            float("nan"),
            float("inf"),
            "",
            [],
            {},
            [[]],
            {"": None},
        ]
    ),
    st.sampled_from(
        [
            "t",
            "ground",
            "1 m",
            "E",
            "9**9**9",
            "1 / 0",
            "beam",
            "beam.left",
            "210 GPa",
            "linear",
            "~",
            "\0",
            "é" * 9,
            ".",
            "a.b.c",
        ]
    ),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.lists(st.integers(-1, 3), max_size=4),
    st.dictionaries(
        st.sampled_from(
            ["type", "at", "s", "body", "axis", "angle", "value", "range", "every", "edges"]
        ),
        st.text(max_size=3),
    ),
    PLACES.map(lambda place: inside(scene(place[0]), place[1])),
)


def inside(data: Any, path: tuple[str | int, ...]) -> Any:
    for key in path:
        data = data[key]
    return data


def damaged(name: str, path: tuple[str | int, ...], how: str, value: Any) -> str:
    """A scene as JSON, which is YAML, with one value replaced, dropped, renamed, given twice or
    moved.
    """
    data = copy.deepcopy(scene(name))
    parent, last = inside(data, path[:-1]), path[-1]
    old = parent[last]
    if how == "replace":
        parent[last] = value
    elif how == "drop" or isinstance(parent, list):
        del parent[last]
    elif how == "rename":
        parent[f"{last}_"] = parent.pop(last)
    elif how == "move":
        data[str(last)] = parent.pop(last)
    text = json.dumps(data, indent=1).replace("NaN", ".nan").replace("Infinity", ".inf")
    if how == "twice":
        key = json.dumps(last)
        text = text.replace(f"{key}:", f"{key}: {json.dumps(old)},\n{key}:", 1)
    return text


@tries(400)
@given(
    st.lists(PLACES, min_size=1, max_size=1),
    st.sampled_from(["replace", "drop", "rename", "move", "twice"]),
    ODD,
)
def test_scenes_with_a_damaged_value(
    place: list[tuple[str, tuple[str | int, ...]]], how: str, value: Any
) -> None:
    name, path = place[0]
    found = told(lambda: scenes.loads(damaged(name, path, how, value), EXAMPLES))
    if found is not None:
        assert all(np.isfinite(value) for value in found.parameters.values())
        assert found.bodies


@tries(200)
@given(st.sampled_from(sorted(TEXTS)), st.data())
def test_scenes_with_damaged_text(name: str, data: st.DataObject) -> None:
    """Characters replaced, lines dropped, doubled and shifted."""
    rows = TEXTS[name].splitlines()
    for _ in range(data.draw(st.integers(1, 3))):
        i = data.draw(st.integers(0, len(rows) - 1))
        how = data.draw(st.sampled_from(["drop", "twice", "shift", "cut", "insert"]))
        row = rows[i]
        at = data.draw(st.integers(0, max(len(row) - 1, 0)))
        sign = data.draw(st.sampled_from(list("{}[]:,&*!|>'\"%@`#-?\t\0\u2028é0 ~<")))
        new = {
            "drop": [],
            "twice": [row, row],
            "shift": [" " + row],
            "cut": [row[:at]],
            "insert": [row[:at] + sign + row[at:]],
        }[how]
        rows[i : i + 1] = new
        rows = rows or [""]
    told(lambda: scenes.loads("\n".join(rows), EXAMPLES))


#: of some coordinates
CHECKED = (
    "controlled_arm.yaml",
    "geared_arm.yaml",
    "heavy_top.yaml",
    "spin_up.yaml",
    "trapeze.yaml",
)


@tries(3)
@given(st.data(), st.sampled_from(["replace", "drop", "rename", "move", "twice"]), ODD)
def test_scenes_with_a_damaged_value_are_checked(
    tmp_path: Path, data: st.DataObject, how: str, value: Any
) -> None:
    """Assembled as well: what is read and is nonsense all the same is refused with its place, or
    has no equilibrium or solution.
    """
    name, path = data.draw(st.sampled_from([place for place in places() if place[0] in CHECKED]))
    (tmp_path / "meshes").mkdir(exist_ok=True)
    (tmp_path / "examples").mkdir(exist_ok=True)
    for mesh in re.findall(r"meshes/(\w+\.msh)", TEXTS[name]):
        (tmp_path / "meshes" / mesh).write_bytes((MESHES / mesh).read_bytes())
    (scene_file := tmp_path / "examples" / "scene.yaml").write_text(
        damaged(name, path, how, value), encoding="utf-8"
    )
    with guarded():
        done = fmbs("check", scene_file)
    assert done.code in (0, 3, 4), done.err
    assert done.code == 0 or ": expected " in done.err or done.code == 4, done.err


YAML = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text(max_size=6),
        st.sampled_from(["cable", "pin", "beam", "1 m"]),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(
            st.one_of(
                st.text(max_size=5),
                st.sampled_from(["schema", "bodies", "type", "analysis", "joints"]),
            ),
            inner,
            max_size=5,
        ),
    ),
    max_leaves=20,
)


@tries(150)
@given(YAML, st.booleans())
def test_random_trees(value: Any, add_unit: bool) -> None:
    tree = {"schema": 1, "bodies": {"a": value}, "analysis": value} if add_unit else value
    assert (
        told(
            lambda: scenes.loads(
                json.dumps(tree).replace("NaN", ".nan").replace("Infinity", ".inf")
            )
        )
        is None
    )


@tries(150)
@given(st.one_of(st.text(max_size=200), st.text("{}[]:,&*!|>'\"%@`#-? \n\tab01.~<", max_size=120)))
@example("? ")
@example("&a [*a]")
@example("a: &x 1\n*x : 2")
@example("%YAML 9.9\n---\na")
@example("--- !<tag:yaml.org,2002:python/object:os.system> x")
def test_random_yaml(text: str) -> None:
    assert told(lambda: scenes.loads(text)) is None


# ------------------------------------------------------------------------------------------------------------------ expressions
WORDS = [
    *expressions.FUNCTIONS,
    *expressions.BINARY,
    "t",
    "pi",
    "E",
    "(",
    ")",
    ",",
    "1",
    "2.5e3",
    ".5",
    " ",
    "1e999",
    "__import__",
    ".",
    "^",
    "lambda",
]


@tries(300)
@given(
    st.one_of(
        st.lists(st.sampled_from(WORDS), max_size=30).map("".join),
        st.text(max_size=60),
        st.lists(st.sampled_from(WORDS), max_size=30).map(" ".join),
    )
)
def test_expressions(text: str) -> None:
    found = told(lambda: expressions.of_time(text, {"E": 2.0}))
    if found is not None:
        times = np.array([0.0, 0.25, 1e9])
        values = found(times)
        assert values.shape == (3,)
        one = np.array([found(float(t)) for t in times])
        np.testing.assert_allclose(values, one, rtol=1e-9)


# ----------------------------------------------------------------------------------------------------------------------- meshes
READERS: dict[str, Callable[[Path], Any]] = {
    "beam_5.msh": meshes.read,
    "arc_40.vtu": meshes.read,
    "plate_16x1.msh": lambda path: plate_meshes.read(path, planar=True),
    "plate_crank_coarse.vtu": lambda path: plate_meshes.read(path, planar=True),
    "lug_tri.msh": lambda path: plate_meshes.read(path, planar=False, repair=True),
    "beam_10.msh": lambda path: meshes.read(path, repair=True),
}


def mutated(content: bytes, data: st.DataObject) -> bytes:
    """Bytes replaced, digits swapped, pieces cut out, doubled or moved, the end cut off."""
    for _ in range(data.draw(st.integers(1, 4))):
        at, size = data.draw(st.integers(0, len(content) - 1)), data.draw(st.integers(1, 16))
        piece = content[at : at + size]
        new = data.draw(
            st.one_of(
                st.binary(min_size=1, max_size=8),
                st.sampled_from(
                    [
                        b"",
                        b"0",
                        b"-1",
                        b"9" * 30,
                        b"nan",
                        b"1e400",
                        b"\n",
                        b"$",
                        b"<",
                        b"\xff" * 8,
                        piece + piece,
                        piece[::-1],
                    ]
                ),
            )
        )
        content = content[:at] + new + content[at + (size if len(new) != size else len(new)) :]
    end = data.draw(st.one_of(st.just(len(content)), st.integers(0, len(content))))
    return content[:end]


@pytest.mark.parametrize("name", READERS)
@tries(60)
@given(data=st.data())
def test_mesh_files(name: str, tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / name
    path.write_bytes(mutated((MESHES / name).read_bytes(), data))
    mesh = told(lambda: READERS[name](path))
    if mesh is not None:
        assert np.isfinite(mesh.points).all()
        assert np.array_equal(np.unique(mesh.cells), np.arange(len(mesh.points)))


# ------------------------------------------------------------------------------------------------------------------ NURBS files
ENTRIES = list(paths(STRIP))


@tries(150)
@given(st.sampled_from(ENTRIES), ODD, st.booleans(), st.data())
def test_nurbs_files(
    tmp_path: Path, path: tuple[str | int, ...], value: Any, as_bytes: bool, data: st.DataObject
) -> None:
    file = tmp_path / "roof.json"
    content = json.dumps(STRIP).encode()
    if as_bytes:
        content = mutated(content, data)
    else:
        changed = copy.deepcopy(STRIP)
        inside(changed, path[:-1])[path[-1]] = value
        content = json.dumps(changed).encode()
    file.write_bytes(content)
    shape = told(lambda: nurbs_file.read(file, cells=2))
    if shape is not None:
        assert np.isfinite(shape.reference).all()
        assert shape.nodes.max() < shape.count


# --------------------------------------------------------------------------------------------------------------- reduced models
@tries(150)
@given(data=st.data())
def test_saved_models(model: Path, tmp_path: Path, data: st.DataObject) -> None:
    """Any damage is found by the checksum; with a checksum that fits, by what is read."""
    content, sealed = model.read_bytes(), data.draw(st.booleans())
    body = content[container.HEADER :] if sealed else content
    wrong = mutated(body, data)
    path = tmp_path / "model.h5"
    path.write_bytes(container.header(wrong, files.KIND) + wrong if sealed else wrong)
    message = ""
    try:
        with guarded():
            found = files.read(path)
    except CorruptFile as error:
        message = str(error)
    if message:
        assert HOUSE.match(message)
    else:
        assert sealed or wrong[container.HEADER :] == content[container.HEADER :]
        assert found.system.size > 0
