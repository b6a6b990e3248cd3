"""What annotations of dataclasses say: reading, problems with their places, JSON schema, and the
way back.
"""

from __future__ import annotations

import json
from abc import ABC
from dataclasses import dataclass, field
from typing import Annotated, Literal

import pytest

from fmbs_skfem.core.declared import Declared
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values import mappings
from fmbs_skfem.core.values.fields import Context, quantity, whole
from fmbs_skfem.core.values.problems import Problems


class Shape(Declared, ABC):
    """A family."""


@dataclass(frozen=True)
class Ball(Shape, word=("ball", "sphere")):
    """A ball."""

    name: str
    radius: Annotated[float, quantity("m", "> 0"), "of the ball"]


@dataclass(frozen=True)
class Point:
    """A point."""

    x: float
    y: float = 0.0


@dataclass(frozen=True)
class Whole:
    """Everything."""

    shapes: dict[str, Shape]
    kind: Literal["fine", "coarse"] = "fine"
    count: Annotated[int, whole(1, 9)] = field(default=3, metadata={"note": "of its own"})
    points: tuple[Point, ...] = ()
    flag: bool | None = None
    hidden: int = field(default=7, metadata=mappings.HIDDEN)


BALL = {"type": "sphere", "radius": "10 mm"}
GIVEN = {
    "shapes": {"a": BALL},
    "kind": "coarse",
    "points": [{"x": 1}, {"x": 2, "y": 3}],
    "flag": True,
}


def read(**changed: object) -> Whole:
    found: Whole = mappings.read_struct(Whole, GIVEN | changed, Context())
    return found


def test_a_mapping_becomes_a_dataclass_and_plain_data_again() -> None:
    found = read()
    assert found == Whole({"a": Ball("a", 0.01)}, "coarse", 3, (Point(1.0), Point(2.0, 3.0)), True)
    assert found.shapes["a"].word == "sphere"
    plain = mappings.plain(found)
    assert plain["shapes"] == {"a": {"type": "sphere", "radius": 0.01}}
    assert "hidden" not in plain
    again = mappings.read_struct(Whole, json.loads(json.dumps(plain)), Context())
    assert again == found
    assert "flag" not in mappings.plain(read(flag=None))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (
            {"shapes": {"a": {"type": "bal"}}},
            "shapes.a.type: expected one of ball, sphere, got 'bal'; did you mean 'ball'",
        ),
        (
            {"shapes": {"a": {"radius": 1}}},
            "shapes.a: expected the key 'type', got no such key; write one of ball, sphere",
        ),
        (
            {"shapes": {"a": {"type": "ball"}}},
            r"shapes.a.radius: expected the key 'radius', .* add of the ball: a length",
        ),
        (
            {"shapes": {"a": {"type": "ball", "radius": 0}}},
            r"shapes.a.radius: expected a length \[m\] > 0, got 0",
        ),
        (
            {"shapes": {"1a": {"type": "ball", "radius": 1}}},
            "shapes.1a: expected a name of letters",
        ),
        ({"shapes": 3}, "shapes: expected a mapping of names, got 3"),
        ({"kind": "finer"}, "kind: expected 'fine' or 'coarse', got 'finer'; did you mean 'fine'"),
        ({"count": 10}, "count: expected a number <= 9, got 10"),
        ({"count": True}, "count: expected a whole number, got True"),
        ({"points": [{"x": 1}, {"y": "1 m"}]}, "points.1.x: expected the key 'x'"),
        ({"points": {}}, "points: expected a list, got a mapping"),
        ({"flag": 1}, "flag: expected true or false, got 1"),
        (
            {"hidden": 1},
            "hidden: expected one of the keys count, flag, kind, points, shapes, got 'hidden'",
        ),
    ],
)
def test_problems_stand_with_their_keys(changed: dict[str, object], message: str) -> None:
    with pytest.raises(Problems, match=message):
        read(**changed)


def test_all_problems_at_once() -> None:
    with pytest.raises(Problems) as caught:
        read(count=0, flag=1, shapes={"a": {"type": "ball", "radius": "1 s"}, "b": {}})
    assert [keys for keys, _ in caught.value.found] == [
        ("shapes", "a", "radius"),
        ("shapes", "b"),
        ("count",),
        ("flag",),
    ]


def test_the_schema_names_all_it_refers_to() -> None:
    schema = mappings.json_schema(Whole)
    assert set(schema["$defs"]) == {"Ball", "Point"}
    assert schema["required"] == ["shapes"]
    assert "hidden" not in schema["properties"]
    assert schema["properties"]["count"] == {
        "type": "integer",
        "minimum": 1,
        "maximum": 9,
        "default": 3,
    }
    assert (
        schema["properties"]["shapes"]["additionalProperties"]["discriminator"]["mapping"]["sphere"]
        == "#/$defs/Ball"
    )
    ball = schema["$defs"]["Ball"]
    assert ball["properties"]["type"]["enum"] == ["ball", "sphere"]
    assert ball["required"] == ["type", "radius"]


def test_what_no_rule_takes_is_refused() -> None:
    with pytest.raises(InputError, match="annotation: expected"):
        mappings.takes(complex)
