"""Which tests a run takes: shares of what several of them make, parts of the slow ones, what a name
on the command line does.
"""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from . import durations


def config(*args: str, **options: Any) -> Any:
    given = {
        "keyword": "",
        "markexpr": "",
        "all": False,
        "slow": None,
        "slow_in": [],
        "budget": 400.0,
        **options,
    }
    return SimpleNamespace(args=list(args), option=SimpleNamespace(**given))


def collected(
    own: dict[str, float], uses: dict[str, list[str]], made: dict[str, list[float]]
) -> durations.Collected:
    found = durations.Collected()
    found.own = own
    found.uses = {test: uses.get(test, []) for test in own}
    found.made.update(made)
    return found


def test_tests_bear_what_they_make_together() -> None:
    """A run of 0.6 s that two tests need costs each 0.3; two processes that made it, once."""
    found = collected(
        {"a": 0.05, "b": 0.0, "c": 0.5}, {"a": ["run"], "b": ["run"]}, {"run": [0.6, 0.5]}
    )
    assert found.seconds() == pytest.approx({"a": 0.35, "b": 0.3, "c": 0.5})


def test_what_slow_tests_share_with_a_quick_one_makes_it_slow() -> None:
    """Without the slow ones, it would have to make the run alone."""
    found = collected({"a": 0.2, "b": 0.0}, {"a": ["run"], "b": ["run"]}, {"run": [0.8]})
    assert found.seconds() == pytest.approx({"a": 0.6, "b": 0.8})


def test_a_meter_counts_what_lies_inside_once(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 1.0, 2.0, 5.0, 6.0, 7.5])
    monkeypatch.setattr(durations, "cpu", lambda: next(clock))
    meter = durations.Meter()
    meter.begin = 0.0
    with meter.apart("outer"), meter.apart("inner"):
        pass
    assert meter.made == {"inner": 3.0, "outer": 2.0}
    assert meter.own() == 7.5 - 5.0


def test_parts_of_the_slow_tests_are_all_of_them_once() -> None:
    slow = {
        f"tests/{folder}/test_{k}.py::test_{n}": 1.0 + k
        for folder in "ab"
        for k in range(5)
        for n in range(3)
    }
    parts = [durations.part_of(slow, config(slow=f"{k}/4")) for k in range(4)]
    assert sorted(test for part in parts for test in part) == sorted(slow)
    spent = [sum(slow[test] for test in part) for part in parts]
    assert max(spent) - min(spent) <= 15.0  # the longest file
    assert durations.part_of(slow, config(slow="4/4")) == parts[0]


def test_a_part_takes_touched_folders_as_far_as_its_budget_goes() -> None:
    slow = {
        "tests/systems/test_a.py::a": 500.0,
        "tests/systems/test_b.py::b": 300.0,
        "tests/cli/test_c.py::c": 2.0,
    }
    without = durations.part_of(slow, config(slow="2/3"))
    assert without == {"tests/cli/test_c.py::c"}
    assert durations.part_of(slow, config(slow="2/3", slow_in=["contact"])) == without | {
        "tests/systems/test_b.py::b"
    }


def test_a_test_that_is_named_is_taken() -> None:
    assert not durations.is_named(config("tests"))
    assert not durations.is_named(config("tests/physics/test_example_1.py"))
    assert durations.is_named(config("tests/physics/test_example_1.py::test_order"))
    assert durations.is_named(config("tests", markexpr="slow"))
    assert durations.is_named(config("tests", keyword="order"))


def test_the_file_keeps_what_was_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(durations, "FILE", tmp_path / "durations.json")
    assert durations.read() == {}
    durations.write(
        {
            "tests/a.py::one": 2.0,
            "tests/a.py::gone": 3.0,
            "tests/b.py::two[x::y]": 4.04,
            "tests/b.py::short": 0.1,
        }
    )
    durations.write({"tests/a.py::one": 2.5})
    assert durations.read() == {"tests/a.py::one": 2.5, "tests/b.py::two[x::y]": 4.0}


def test_tests_that_every_run_takes_are_there() -> None:
    """A test that has another name now would be slow, and nobody would see it."""
    folder = Path(durations.FILE).parent
    for test in {f"tests/{one}" for one in durations.SMOKE} | durations.ALWAYS:
        file, _, name = test.partition("::")
        assert f"def {name.partition('[')[0]}(" in (folder.parent / file).read_text(
            encoding="utf-8"
        ), test


def test_the_file_lists_tests_of_files_that_are_there() -> None:
    """A full run leaves them behind where a file has moved."""
    folder = durations.FILE.parent
    assert [
        file
        for file in json.loads(durations.FILE.read_text(encoding="utf-8"))
        if not (folder / file).exists()
    ] == []
