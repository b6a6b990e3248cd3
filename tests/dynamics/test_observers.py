"""Observers of runs: the monitor of docs/extensions.md from a scene and from Python, stops, shorter
steps, resumed runs.
"""

from __future__ import annotations

import json
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fmbs_skfem import scenes, studies
from fmbs_skfem.bodies import point_mass
from fmbs_skfem.control.monitors import Monitor
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, LiveRun, integrate, start
from fmbs_skfem.dynamics.checkpoint import Resumed, RunState
from fmbs_skfem.dynamics.observers import Observer
from fmbs_skfem.systems import At, System, assemble
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import pages
from ..forgotten import forget

TEXT = next(
    block for block in pages.blocks("docs/extensions.md") if block.startswith("# my_fence.py")
)
H, G = 1e-2, 9.81
SCENE = """schema: 1
name: fall
dimension: 2
extensions: [my_fence.py]
bodies: {ball: {type: point_mass, mass: 1 kg, position: [0, 0]}}
loads: {weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}}
analysis: {type: dynamic, duration: 1 s, step: 10 ms}
outputs: {tip: {type: position, at: ball}}
monitors: {fence: {type: leaves_box, of: tip, low: [-1 m, -1 m], high: [1 m, 1 m]}}
"""


@pytest.fixture(autouse=True)
def _apart(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What a test declares is forgotten after it."""
    yield from forget(monkeypatch, Monitor)


def own() -> Any:
    """The module of the page."""
    found = types.ModuleType("my_fence")
    sys.modules["my_fence"] = found
    exec(compile(TEXT, "my_fence.py", "exec"), found.__dict__)
    return found


def fall(*monitors: Monitor) -> System:
    """A ball that falls."""
    return assemble(
        [point_mass("ball", 1.0, (0.0, 0.0))],
        loads=[loads.Gravity((0.0, -G))],
        outputs={"tip": probes.Position(At("ball"))},
        monitors=monitors,
    )


LEFT = int(np.sqrt(2.0 / G) / H) + 1  #: the first step below -1 m
MORE = 100  #: steps outside in a run that makes pauses there
ENDS = LEFT + 10  #: and the one that is too many


def walk(system: System) -> LiveRun:
    """A live run to its end."""
    run = start(system, GeneralizedAlpha(H))
    while not run.ended:
        run.step()
    return run


def test_a_monitor_warns_and_stops_in_a_run_and_live() -> None:
    fence = own().LeavesBox("fence", "tip", (-1.0, -1.0), (1.0, 1.0))
    with pytest.warns(Notice, match=f"'tip' leaves its box at t = {LEFT * H:g} s"):
        motion = integrate(fall(fence), GeneralizedAlpha(H), 1.0)
    assert motion.times[-1] == pytest.approx(ENDS * H)
    assert [(one.name, one.stop) for one in motion.events] == [("fence", True)]
    whole = integrate(fall(), GeneralizedAlpha(H), 1.0)
    assert_array_equal(motion.x, whole.x[: ENDS + 1])
    with pytest.warns(Notice, match="leaves its box"):
        run = walk(fall(fence))
    assert run.time == pytest.approx(ENDS * H)


def test_a_monitor_survives_a_resume() -> None:
    """From a checkpoint at which some steps outside are counted, and from the one behind the stop."""
    fence = own().LeavesBox("fence", "tip", (-1.0, -1.0), (1.0, 1.0), steps=MORE)
    found: list[Any] = []

    def record(moment: RunState) -> None:
        found.append((moment.rows(0, moment.kept), moment.checkpoint()))

    with pytest.warns(Notice, match="leaves its box"):
        whole = integrate(fall(fence), GeneralizedAlpha(H), 2.0, record=record)
    assert whole.times[-1] == pytest.approx((LEFT + MORE) * H)
    middle = next(one for one in found if one[1].done > LEFT)
    assert middle[1].arrays["observer fence: outside"] == [middle[1].done - LEFT + 1]
    for rows, held in (middle, found[-1]):
        again = integrate(fall(fence), GeneralizedAlpha(H), 2.0, resume=Resumed(held, rows))
        assert again.events == whole.events
        assert_array_equal(again.x, whole.x)


@pytest.mark.filterwarnings("ignore:.*runs the Python file:UserWarning", "ignore:.*my_fence.py")
def test_a_monitor_of_a_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_fence.py").write_text(TEXT, encoding="utf-8")
    (tmp_path / "fall.yaml").write_text(SCENE, encoding="utf-8")
    with pytest.warns(Notice, match="monitor 'fence': 'tip' leaves its box"):
        found = studies.run(tmp_path / "fall.yaml", out=tmp_path / "out", extensions="allow")
    assert found.report["end"] == pytest.approx(ENDS * H)
    assert (
        json.loads((tmp_path / "out" / "report.json").read_text())["events"][0]["name"] == "fence"
    )
    (tmp_path / "fall.yaml").write_text(SCENE.replace("of: tip", "of: top"), encoding="utf-8")
    with pytest.raises(
        InputError,
        match=r"fall.yaml:\d+: monitors.fence: .*expected one of the outputs tip, got 'top'",
    ):
        studies.run(tmp_path / "fall.yaml", out=tmp_path / "other", extensions="allow")
    (tmp_path / "none.yaml").write_text(
        SCENE.replace("extensions: [my_fence.py]\n", ""), encoding="utf-8"
    )
    expected = r"none.yaml:8: monitors.fence: expected a monitor of an extension, got none that is declared; name the Python file"
    with monkeypatch.context() as patch:
        patch.setattr(Monitor, "known", {})
        with pytest.raises(InputError, match=expected):
            scenes.read(tmp_path / "none.yaml")
    (tmp_path / "fall.yaml").write_text(
        SCENE.replace("dynamic, duration: 1 s, step: 10 ms", "modes, count: 1"), encoding="utf-8"
    )
    with pytest.warns(Notice, match="monitors: do nothing in an analysis of modes"):
        scenes.read(tmp_path / "fall.yaml", extensions="allow")


class Shorter(Observer):
    """Asks for a quarter of the step from half way on."""

    def after(self, run: Any) -> None:
        if run.done >= 5:
            run.shorten(2)


class Enough(Observer):
    """Ends a run, and has no name."""

    def after(self, run: Any) -> None:
        if run.done == 3:
            run.stop(self)


def test_a_stop_without_a_name_is_that_of_its_class() -> None:
    found: list[Any] = []

    def record(moment: RunState) -> None:
        found.append((moment.rows(0, moment.kept), moment.checkpoint()))

    motion = integrate(fall(), GeneralizedAlpha(H), 1.0, record=record, observers=[Enough()])
    assert [(one.name, one.time) for one in motion.events] == [("Enough", pytest.approx(3 * H))]
    rows, held = found[-1]
    assert (
        integrate(fall(), GeneralizedAlpha(H), 1.0, resume=Resumed(held, rows)).events
        == motion.events
    )


class Seen(Observer):
    """Counts its calls."""

    def __init__(self) -> None:
        self.calls = list[str]()

    def begin(self, run: Any) -> None:
        self.calls.append("begin")

    def before(self, run: Any) -> None:
        self.calls.append("before")

    def after(self, run: Any) -> None:
        self.calls.append("after")

    def finish(self, run: Any, motion: Any) -> Any:
        self.calls.append("finish")
        return motion


def pendulum() -> System:
    """A point mass on a massless rod."""
    ball = point_mass("ball", 1.0, (1.0, 0.0))
    return assemble(
        [ball], [joints.RigidLink("rod", At("ball"), (0.0, 0.0))], [loads.Gravity((0.0, -G))]
    )


def test_an_observer_is_called_in_order_and_changes_nothing() -> None:
    seen, scheme = Seen(), GeneralizedAlpha(H)
    motion = integrate(pendulum(), scheme, 10 * H, observers=[seen])
    assert seen.calls == ["begin", *["before", "after"] * 10, "finish"]
    assert_array_equal(motion.x, integrate(pendulum(), scheme, 10 * H).x)


def test_an_observer_asks_for_shorter_steps() -> None:
    """The error of the second half falls as that of steps of a quarter does."""
    exact = integrate(pendulum(), GeneralizedAlpha(H / 32), 10 * H, every=32).x
    plain, shorter = (
        integrate(pendulum(), GeneralizedAlpha(H), 10 * H, observers=more).x
        for more in ([], [Shorter()])
    )
    assert_array_equal(plain[:6], shorter[:6])
    change = [
        np.abs((found[-1] - exact[-1]) - (found[5] - exact[5])).max() for found in (plain, shorter)
    ]
    assert change[1] < 0.5 * change[0]
