"""Dataclasses whose methods are written when they are first asked for are those of Python."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import threading
from collections.abc import Callable
from typing import Any

import pytest

from fmbs_skfem.core.storage import records

OPTIONS = [
    {},
    {"frozen": True},
    {"frozen": True, "eq": False},
    {"frozen": True, "repr": False, "kw_only": True},
    {"init": False},
]
MADE = (
    "__init__",
    "__repr__",
    "__eq__",
    "__hash__",
    "__setattr__",
    "__delattr__",
    "__match_args__",
    "__dataclass_fields__",
)


def declared(decorate: Callable[[type], type]) -> type:
    class Sample:
        a: int
        b: float = 1.0
        c: list[int] = dataclasses.field(default_factory=list)
        d: str = dataclasses.field(default="d", repr=False, compare=False)

        def area(self) -> float:
            return self.a * self.b

    return decorate(Sample)


def pending(kind: type) -> bool:
    """Whether something waits but for texts, comparisons and hashes."""
    return any(
        isinstance(value, records.Pending) and name not in records.LATER
        for name, value in vars(kind).items()
    )


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_what_is_made_is_what_python_makes(options: dict[str, bool]) -> None:
    late, early = declared(records.dataclass(**options)), declared(dataclasses.dataclass(**options))
    assert pending(late)
    assert (late.b, late.d, hasattr(late, "c")) == (1.0, "d", False)  # as of a dataclass
    assert list(map(repr, dataclasses.fields(late))) == list(map(repr, dataclasses.fields(early)))
    assert not pending(late)
    assert inspect.signature(late) == inspect.signature(early)
    assert {name: getattr(late, name) is None for name in MADE if name in vars(late)} == {
        name: getattr(early, name) is None for name in MADE if name in vars(early)
    }
    assert str(late.__dataclass_params__) == str(early.__dataclass_params__)
    if options.get("init", True):
        assert late(a=2, b=3.0).area() == 6.0
        assert late(a=2).c is not late(a=2).c
    if options.get("repr", True) and options.get("init", True):
        assert repr(late(a=2)) == repr(early(a=2))


@pytest.mark.parametrize("name", MADE)
def test_any_of_its_attributes_makes_a_class(name: str) -> None:
    kind = declared(records.dataclass(frozen=True))
    assert isinstance(vars(kind)[name], records.Pending)
    getattr(kind, name)
    assert not pending(kind)
    left = {key for key in records.LATER if isinstance(vars(kind)[key], records.Pending)}
    assert left == set(records.LATER) - {name}


@pytest.mark.parametrize("options", [{"frozen": True}, {}, {"frozen": True, "eq": False}], ids=str)
@pytest.mark.parametrize(
    "own", [(), ("__eq__",), ("__hash__",), ("__eq__", "__hash__", "__repr__")], ids=str
)
def test_what_a_class_says_itself_stays(options: dict[str, bool], own: tuple[str, ...]) -> None:
    """Its text, and how it compares; its hash follows as Python's do."""
    said = {
        "__eq__": lambda one, other: True,
        "__hash__": lambda one: 7,
        "__repr__": lambda one: "own",
    }
    found = []
    for decorator in (records.dataclass, dataclasses.dataclass):
        names = {"__annotations__": {"x": float}, "__qualname__": "One"}
        kind: Any = decorator(**options)(
            type("One", (), names | {name: said[name] for name in own})
        )
        hashed = (
            "none"
            if kind.__hash__ is None
            else "own"
            if "__hash__" in own
            else kind.__hash__ is object.__hash__
        )
        found.append(
            (repr(kind(1.0)) if options.get("eq", True) or "__repr__" in own else "", hashed)
        )
        found[-1] += (kind(1.0) == kind(1.0), kind(1.0) == kind(2.0), kind(1.0) == 1.0)
        if hashed is False:
            found[-1] += (hash(kind(1.0)),)
    assert found[0] == found[1]


def without_init(kind: type, **values: Any) -> Any:
    """An instance as one that comes from another process."""
    made = object.__new__(kind)
    vars(made).update(values)
    return made


@pytest.mark.parametrize(
    "use",
    [
        repr,
        hash,
        lambda one: one == without_init(type(one), x=1.0, y=3.0),
        lambda one: repr(dataclasses.replace(one, y=2.0)),
        lambda one: copy.deepcopy(one) == one,
        dataclasses.asdict,
    ],
)
def test_instances_that_nothing_has_called(use: Callable[[Any], object]) -> None:
    found = []
    for decorator in (records.dataclass, dataclasses.dataclass):
        kind = decorator(frozen=True)(
            type(
                "Point", (), {"__annotations__": {"x": float, "y": float}, "__qualname__": "Point"}
            )
        )
        found.append(use(without_init(kind, x=1.0, y=3.0)))
    assert found[0] == found[1]


def test_what_is_frozen_stays() -> None:
    kind = declared(records.dataclass(frozen=True))
    one = without_init(kind, a=1)
    with pytest.raises(dataclasses.FrozenInstanceError):
        one.a = 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        del one.a


def test_inheritance() -> None:
    @records.dataclass(frozen=True)
    class Base:
        a: int

        def __eq__(self, other: object) -> bool:
            return True

    @records.dataclass(frozen=True)
    class Late(Base):
        b: int = 2

    @dataclasses.dataclass(frozen=True)
    class Early(Late):
        c: int = 3

    assert [one.name for one in dataclasses.fields(Early)] == ["a", "b", "c"]
    assert Early(1).b == 2
    assert Late(1) != Late(2)
    assert Base(1) == Base(2)
    match Late(1):
        case Late(a, b):
            assert (a, b) == (1, 2)
    with pytest.raises(TypeError, match="cannot inherit non-frozen"):
        dataclasses.dataclass(type("Odd", (Base,), {}))


def test_an_init_of_its_own_and_other_options_make_a_class_at_once() -> None:
    assert not pending(declared(records.dataclass(frozen=True, slots=True)))
    assert not pending(records.dataclass(type("Own", (), {"__init__": lambda self: None})))


def test_threads_make_a_class_once() -> None:
    for _ in range(20):
        kind, found = declared(records.dataclass(frozen=True)), list[Any]()
        start = threading.Barrier(4)

        def make(
            kind: Any = kind, found: list[Any] = found, start: threading.Barrier = start
        ) -> None:
            start.wait()
            found.append(kind(3))

        threads = [threading.Thread(target=make) for _ in range(4)]
        for one in threads:
            one.start()
        for one in threads:
            one.join()
        assert found == [kind(3)] * 4
