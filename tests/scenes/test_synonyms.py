"""Words and units of other codes: each leads to one that exists here, and none stands for two
things.
"""

from __future__ import annotations

import re
from collections import Counter

import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.declared import Declared
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values import mappings, synonyms, units
from fmbs_skfem.core.values.fields import Context
from fmbs_skfem.scenes import schema

QUOTED = re.compile(r"'([^']+)'")
FAMILIES = {
    family.__name__: family
    for family in Declared.__subclasses__()
    if family.__name__ in synonyms.WORDS
}
SECTIONS = {"joints": "Joint", "loads": "Load"}
WORDS = [
    (family, text, word)
    for family, table in synonyms.WORDS.items()
    for text, words in table.items()
    for word in words.split()
]


def test_every_family_of_the_table_is_one_of_scenes() -> None:
    assert schema.Scene is not None
    assert FAMILIES.keys() == synonyms.WORDS.keys()


@pytest.mark.parametrize(("family", "text", "word"), WORDS)
def test_a_word_of_others_leads_to_one_that_exists(family: str, text: str, word: str) -> None:
    kind = FAMILIES[family]
    assert word == synonyms.normal(word)
    assert word not in kind.known, "a word of its own needs no remark"
    for name, section in re.findall(r"'(\w+)'(?:[^']*? under (\w+))?", text):
        known = FAMILIES[SECTIONS[section]] if section else kind
        keys = {key for one in known.known.values() for key in one.__dataclass_fields__}
        assert name in known.known or name in keys, name
    with pytest.raises(InputError, match=re.escape(f"did you mean {text}?")):
        mappings.read_family(kind, {kind.tag: word}, Context())


@pytest.mark.parametrize("table", [*synonyms.WORDS.values(), synonyms.UNITS])
def test_a_word_means_one_thing(table: dict[str, str]) -> None:
    counted = Counter(word for words in table.values() for word in words.split())
    assert [word for word, times in counted.items() if times > 1] == []


@pytest.mark.parametrize(
    ("text", "unit"),
    [(text, unit) for text, words in synonyms.UNITS.items() for unit in words.split()],
)
def test_a_unit_of_others_leads_to_one_that_is_taken(text: str, unit: str) -> None:
    assert unit not in units.UNITS
    for one in QUOTED.findall(text):
        assert units.measure(one if one[0].isdigit() else f"1 {one}").value > 0.0
    if unit.isalpha():
        with pytest.raises(InputError, match=re.escape(f"did you mean {text}?")):
            units.measure(f"2 {unit}")


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            "type: pin",
            "type: hinge",
            r"scene:10: joints.a.type: .* got 'hinge'; did you mean 'revolute', or 'pin' for points",
        ),
        (
            "type: pin",
            "type: Ball-Joint",
            "scene:10: joints.a.type: .* did you mean 'pin' or 'spherical'",
        ),
        ("3 kg", "3 lb", "scene:7: .* did you mean 'lbf' for forces, 'lbm' for masses"),
        ("9.81 m/s^2", "1 g", "scene:12: .* g is a gram, 1 g is 9.80665 m/s"),
    ],
)
def test_scenes_say_what_was_meant(before: str, after: str, message: str) -> None:
    text = """schema: 1
name: pendulum
dimension: 2
bodies:
  bob:
    type: rigid
    mass: 3 kg
    inertia: 1 kg m^2
    center: [1, 0]
joints: {a: {type: pin, at: bob.frame}}
loads:
  g: {type: gravity, acceleration: [0, -9.81 m/s^2]}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
"""
    scenes.loads(text)
    with pytest.raises(InputError, match=message):
        scenes.loads(text.replace(before, after))
