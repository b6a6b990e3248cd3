"""YAML 1.2 with line numbers: values, refusals before expansion, random texts."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import yamlfile


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e3", 1000.0),
        ("2.1e11", 2.1e11),
        ("5e-4", 5e-4),
        ("-.5", -0.5),
        ("12", 12),
        ("+3", 3),
        ("no", "no"),
        ("on", "on"),
        ("true", True),
        ("~", None),
        ("'1'", "1"),
        ('"1e3"', "1e3"),
        ("012", 12),
        ("1:30", "1:30"),
        ("2026-01-01", "2026-01-01"),
        ("1_000", "1_000"),
        ("-.inf", -math.inf),
        ("210 GPa", "210 GPa"),
    ],
)
def test_scalars_of_yaml_1_2(text: str, value: object) -> None:
    got = yamlfile.plain(yamlfile.parse(f"a: {text}\n", "f"))["a"]
    assert got == value
    assert type(got) is type(value)


def test_lines_and_aliases() -> None:
    node = yamlfile.parse("a: &x\n  b: 1\n  c:\n    - 2\n    - 3\nd: *x\n", "f")
    assert yamlfile.plain(node) == {"a": {"b": 1, "c": [2, 3]}, "d": {"b": 1, "c": [2, 3]}}
    places = {
        ("a",): 1,
        ("a", "b"): 2,
        ("a", "c", 1): 5,
        ("d",): 6,
        ("d", "b"): 2,
        ("a", "nowhere", "else"): 1,
    }
    assert {path: yamlfile.line(node, path) for path in places} == places


def test_entries_of_another_mapping() -> None:
    """Own entries go first, then those of the earlier mappings of a list; every entry keeps its
    line.
    """
    text = "a: &x\n  p: 1\n  q: 2\nb: &y {q: 3, r: 4}\nc:\n  <<: *x\n  p: 5\nd: {<<: [*x, *y], s: 6}\ne: {'<<': 7}\n"
    node = yamlfile.parse(text, "f")
    found = yamlfile.plain(node)
    assert found["c"] == {"p": 5, "q": 2}
    assert found["d"] == {"p": 1, "q": 2, "r": 4, "s": 6}
    assert found["e"] == {"<<": 7}
    assert [yamlfile.line(node, path) for path in (("c", "p"), ("c", "q"), ("d", "r"))] == [7, 3, 4]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: &x {b: 1}\nc:\n  <<: *x\n  <<: *x\n", r"f:4: expected the key '<<' once"),
        ("a: {<<: 1}\n", r"f:1: expected a mapping, or a list of mappings, behind <<"),
        ("a: 1\nb: 2\na: 3\n", r"f:3: expected the key 'a' once, got twice, in lines 1 and 3"),
        ("b:\n  a: 1\n  'a': 3\n", r"lines 2 and 3"),
        (
            "a: !!python/object/apply:os.system ['true']\n",
            r"f:1: expected a value without a tag, got the tag",
        ),
        ("a: !!str 1\n", "tag"),
        ("a: ! 1\n", "tag"),
        ("!!map {a: 1}\n", "tag"),
        ("!!str a: 1\n", "plain text"),
        ("a: *b\n", "no such anchor"),
        ("a: &b [*b]\n", "enclosing"),
        ("a: 1\n---\nb: 2\n", "one document"),
        ("? [1]\n: 2\n", "plain text"),
        (
            "a: [1, 2\n",
            "f:2: expected ',' or ']', got '<stream end>'; look for a missing quote or bracket",
        ),
        (
            "a:\n\t- 1\n",
            r"f:2: expected YAML 1.2, got character '\\t' .*; indent with spaces in place of tabs",
        ),
        ('a: "\\U11111111"\n', "YAML 1.2"),
        ("a: \x00\n", "YAML 1.2"),
        ("", "an empty file"),
        ("# nothing\n", "an empty file"),
    ],
)
def test_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        yamlfile.parse(text, "f")
    assert caught.value.exit_code == 3


def test_nesting() -> None:
    assert yamlfile.parse("[" * 64 + "]" * 64, "f").height == 64
    for deep in ("[" * 66 + "]" * 66, "[" * 100_000, "{a: " * 5000, "- " * 5000):
        with pytest.raises(InputError, match="nested"):
            yamlfile.parse(deep, "f")


def test_nesting_through_aliases() -> None:
    with pytest.raises(InputError, match="nested"):
        yamlfile.parse(
            "a0: &a0 [1]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 300)), "f"
        )


def test_alias_bomb_is_counted_not_expanded() -> None:
    """Nine levels of nine references: 9**9 values if it were expanded."""
    text = "a: &a [x, x, x, x, x, x, x, x, x]\n"
    for name, before in zip("bcdefghi", "abcdefgh", strict=True):
        text += f"{name}: &{name} [{', '.join(['*' + before] * 9)}]\n"
    with pytest.raises(InputError, match="aliases"):
        yamlfile.parse(text, "f")


def test_too_many_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counted as they are read; `test_bombs` reads nearly as many as there may be."""
    assert yamlfile.NODES == 100_000
    monkeypatch.setattr(yamlfile, "NODES", 1_000)
    with pytest.raises(InputError, match="1000 values"):
        yamlfile.parse("[" + "1,\n" * 1_001 + "]", "f")


def test_large_file(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    with path.open("wb") as file:
        file.truncate(2 * 1024 * 1024 + 1)
    with pytest.raises(InputError, match="at most 2 MB"):
        yamlfile.read(path)


def test_files_that_are_no_text(tmp_path: Path) -> None:
    (tmp_path / "noise.yaml").write_bytes(b"a: \xff\xfe")
    for path, message in (("noise.yaml", "UTF-8"), ("missing.yaml", "readable"), (".", "a file")):
        with pytest.raises(InputError, match=message):
            yamlfile.read(tmp_path / path)


def test_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "bom.yaml").write_bytes(b"\xef\xbb\xbfa: 1\n")
    assert yamlfile.plain(yamlfile.read(tmp_path / "bom.yaml")) == {"a": 1}


@given(st.one_of(st.text(max_size=60), st.text("ab:-[]{},&*!|>'\"%@#? \n\t1.e~<\\", max_size=60)))
@settings(max_examples=300, deadline=None)
def test_any_text_is_a_tree_or_an_input_error(text: str) -> None:
    try:
        node = yamlfile.parse(text, "f")
    except InputError:
        return
    yamlfile.plain(node)


_plain = st.recursive(
    st.one_of(
        st.integers(-(10**6), 10**6),
        st.booleans(),
        st.none(),
        st.text("abc xyz", min_size=1, max_size=5),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.text("abcdef", min_size=1, max_size=4), inner, max_size=4),
    ),
    max_leaves=15,
)


@given(_plain)
@settings(max_examples=100, deadline=None)
def test_json_is_read_as_it_is(value: object) -> None:
    """JSON is a subset of YAML 1.2."""
    import json

    assert yamlfile.plain(yamlfile.parse(json.dumps(value), "f")) == value


@pytest.mark.parametrize(
    "text", ['name: "a\\x01b"', '"a\\x1b": 1', 'names: [x, "a\\x9f"]', '"\\uFFFE": 1']
)
def test_control_characters_are_refused(text: str) -> None:
    """No name, unit or title with them can be written into XML, C or a page."""
    with pytest.raises(InputError, match=r"f:2: expected text without control characters"):
        yamlfile.parse(f"schema: 1\n{text}\n", "f")
