"""A run that keeps few states has the outputs, energies and continuations of one that keeps all, to
the bit.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Trajectory,
    energies,
    integrate,
    integration,
    outputs,
    reactions,
    tracing,
)
from fmbs_skfem.dynamics.diagnoses.stability import last_sound
from fmbs_skfem.dynamics.observers import Judge, Observer
from fmbs_skfem.dynamics.outputs import sizes_of
from fmbs_skfem.extend import Draft, Output, Probe, Sensed
from fmbs_skfem.extend import fields as fields_of
from fmbs_skfem.results import segments
from fmbs_skfem.results.segments import Recorder
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import System
from fmbs_skfem.systems.compiled import compile_system

H, STEPS, FEW = 1e-3, 1000, 7
SCENE = """
schema: 1
dimension: 2
bodies:
  arm: {type: rigid, mass: 2, inertia: 0.1, center: [0.5, 0], points: {pin: [0, 0], tip: [1, 0]}}
  ball: {type: point_mass, mass: 1, position: [1.5, 0]}
joints: {pin: {type: revolute, at: arm.pin, to: ground}}
loads:
  weight: {type: gravity, acceleration: [0, -9.81]}
  spring: {type: spring_damper, at: arm.tip, to: ball, stiffness: 400, damping: 1}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
outputs:
  tip: {type: position, at: arm.tip}
  turned: {type: angle, at: arm.frame}
  energy: {type: energy}
  force: {type: reaction, joint: pin}
  spring: {type: load, load: spring}
"""
FREE = """
schema: 1
dimension: 2
bodies: {ball: {type: point_mass, mass: 1, position: [1.5, 0]}}
loads: {spring: {type: spring_damper, at: ball, to: [0, 0], stiffness: 400, length: 1}}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
outputs: {power: {type: power, of: spring}, held: {type: held_by, at: ball}}
"""
BARE = """
schema: 1
dimension: 2
bodies: {ball: {type: point_mass, mass: 1, position: [1.5, 0]}}
initial: {bodies: {ball: {velocity: [1, 0]}}}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
outputs: {held: {type: held_by, at: ball}}
"""
EVENT = "events: {low: {when: tip.y + 0.5, stop: true}}\n"


@dataclass(frozen=True)
class HeldBy(Probe):
    """The number of forces that hold a scene, and their sum: an output of one's own, which may call
    all there is.
    """

    at: fields_of.Place

    def sense(self, name: str, draft: Draft) -> Output:
        return self.output(
            draft,
            (f"{name}_joints", f"{name}_loads"),
            [draft.layout.read(f"output '{name}'", self.at)],
        )

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        joints = np.sum([np.zeros(len(sensed.times)), *sensed.reactions().values()], axis=0)
        return [joints, sensed.pushes().sum(axis=1)]


del Probe.known["held_by"]  # known to the tests below alone, see `blocks`


@pytest.fixture(autouse=True)
def blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of 16 states, runs that are looked at often, and an output that no other test sees."""
    monkeypatch.setitem(Probe.known, "held_by", HeldBy)
    monkeypatch.setattr(tracing, "MOST", 16)
    monkeypatch.setattr(integration, "PACE", 1e-3)


def system_of(text: str) -> System:
    scene = scenes.loads(text)
    return build.chosen_form(scene, build.system(scene))


def run(system: System, states: int | None = FEW, **options: Any) -> Trajectory:
    return integrate(system, GeneralizedAlpha(H), STEPS * H, states=states, **options)


def count(value: object) -> int:
    """Numbers in the arrays of a motion, without those of its system."""
    if isinstance(value, np.ndarray):
        return value.size
    if is_dataclass(value) and not isinstance(value, System):
        return sum(count(getattr(value, one.name)) for one in fields(value))
    return 0


@pytest.mark.parametrize("text", [FREE, BARE])
def test_outputs_read_reactions_where_nothing_has_any(text: str) -> None:
    """Power of a spring, and an output of one's own, of bodies without joints, and without loads."""
    system = system_of(text)
    assert not system.constraints.names
    few, whole = run(system), run(system, None)
    same_outputs(few, whole)
    assert not outputs(few)["held_joints"].any()
    if text is FREE:
        power = outputs(few)["power"]
        assert np.abs(power).max() > 1.0


def same_outputs(few: Trajectory, whole: Trajectory) -> None:
    assert_array_equal(few.times, whole.times)
    assert_array_equal(energies(few), energies(whole))
    wanted = outputs(whole)
    for name, column in outputs(few).items():
        assert_array_equal(column, wanted[name], err_msg=name)


@pytest.mark.parametrize("every", [1, 7])
def test_outputs_are_those_of_all_states(every: int) -> None:
    system = system_of(SCENE)
    few, whole = run(system, every=every), run(system, None, every=every)
    same_outputs(few, whole)
    assert few.kept is not None
    assert [len(few.kept), few.kept[0], few.kept[-1]] == [FEW, 0, len(whole.times) - 1]
    for name in ("x", "v", "a", "multipliers", "memory"):
        assert_array_equal(getattr(few.states, name), getattr(whole, name)[few.kept])
    assert_array_equal(few.work, whole.work)
    assert_array_equal(reactions(few.states)["pin", "x"], outputs(whole)["force_x"][few.kept])


def test_a_run_keeps_few_numbers() -> None:
    """A chain of 40 balls: what outputs ask for, a block of states, and those that are kept,
    however many steps it takes.
    """
    balls = "".join(
        f"  b{k}: {{type: point_mass, mass: 1, position: [{k}, 0]}}\n" for k in range(40)
    )
    rods = "".join(
        f"  r{k}: {{type: spring_damper, at: b{k}, to: b{k + 1}, stiffness: 1e3}}\n"
        for k in range(39)
    )
    text = f"schema: 1\ndimension: 2\nbodies:\n{balls}loads:\n{rods}analysis: {{type: dynamic, duration: 1, step: 1 ms}}\n"
    system = system_of(
        text
        + "outputs: {tip: {type: position, at: b39}}\ninitial: {bodies: {b39: {velocity: [0, 1]}}}\n"
    )
    room: list[int] = []

    class Room(Observer):
        looks, reads_states = "end", False

        def begin(self, run: Any) -> None:
            room.append(count(run.step.job.out))

    motion = run(system, observers=[Room()])
    assert system.size == 80
    assert room == [3 * 16 * system.size]
    # times, work, sensor rows with both derivatives, energies, sizes; states that are kept
    assert count(motion) <= (2 + 3 * 2 + 4 + 3) * (STEPS + 1) + FEW * (3 * system.size + 1)
    assert count(run(system, None)) > 3 * system.size * STEPS


def test_unknowns_in_another_order() -> None:
    """A chain whose links are listed in disorder is solved in an order of its own, and stored in
    that of its unknowns.
    """
    numbers = [(7 * k) % 60 for k in range(60)]
    balls = "".join(f"  b{k}: {{type: point_mass, mass: 1, position: [{k}, 0]}}\n" for k in numbers)
    rods = "".join(
        f"  r{k}: {{type: spring_damper, at: b{k}, to: b{k + 1}, stiffness: 1e3}}\n"
        for k in range(59)
    )
    text = f"schema: 1\ndimension: 2\nbodies:\n{balls}loads:\n{rods}analysis: {{type: dynamic, duration: 1, step: 1 ms}}\n"
    wanted = "outputs: {tip: {type: position, at: b59}, energy: {type: energy}}\n"
    system = system_of(text + wanted + "initial: {bodies: {b59: {velocity: [0.2, 1]}}}\n")
    order = compile_system(system).order
    assert (order != np.arange(system.size)).any()
    few, whole = run(system), run(system, None)
    same_outputs(few, whole)
    assert_allclose(whole.v[1], system.v0, atol=5e-3)
    assert_array_equal(few.states.x, whole.x[few.kept])


def test_what_reads_states_has_all_of_them() -> None:
    seen: list[int] = []
    system = system_of(SCENE)
    motion = run(system, observers=[Judge(lambda run, motion: seen.append(len(motion.x)) or ())])
    assert motion.kept is None
    assert seen == [STEPS + 1]
    assert (
        run(system, observers=[Judge(lambda run, motion: (), reads_states=False)]).kept is not None
    )


def test_an_event_stops_it_early() -> None:
    system = system_of(
        SCENE.replace(
            "  force: {type: reaction, joint: pin}\n  spring: {type: load, load: spring}\n", ""
        )
        + EVENT
    )
    few, whole = run(system), run(system, None)
    same_outputs(few, whole)
    assert few.events == whole.events
    assert few.events[0].stop
    assert few.kept is not None
    assert few.kept[-1] == len(whole.times) - 1 < STEPS
    assert_array_equal(few.states.x[-1], whole.x[-1])


def stop_at(share: float) -> Any:
    def listen(done: float) -> None:
        if done >= share:
            raise KeyboardInterrupt

    return listen


def test_a_resumed_run_has_the_same_bits(tmp_path: Path) -> None:
    """Stopped in the middle of a block and gone on with, twice; segments hold what was read, and
    few states.
    """
    system, kept = system_of(SCENE), None
    whole = run(system)
    for share in (0.3, 0.6, 2.0):
        there = segments.exists(tmp_path)
        found = segments.manifest(tmp_path) if there else None
        record = Recorder(tmp_path, {}, 0.0, found)
        try:
            kept = run(
                system,
                record=record,
                resume=segments.read(tmp_path) if there else None,
                progress=stop_at(share),
            )
        except KeyboardInterrupt:
            assert segments.manifest(tmp_path).done < STEPS
    assert kept is not None
    same_outputs(kept, whole)
    for name in ("kept", "x", "v", "a", "multipliers"):
        assert_array_equal(getattr(kept, name), getattr(whole, name))
    parts = sorted((tmp_path / segments.FOLDER).glob("segment-*"))
    assert len(parts) > 1
    with h5py.File(parts[0]) as file:
        assert len(file["x"]) == len(file["kept"]) < len(file["times"]) == len(file["trace/values"])


def test_a_history_of_all_states_is_gone_on_with_as_it_began(tmp_path: Path) -> None:
    system = system_of(SCENE)
    with pytest.raises(KeyboardInterrupt):
        run(system, None, record=Recorder(tmp_path, {}, 0.0), progress=stop_at(0.4))
    motion = run(system, resume=segments.read(tmp_path))
    assert motion.kept is None
    same_outputs(motion, run(system, None))


def test_the_last_sound_state_is_kept() -> None:
    """Negative damping makes energy out of nothing: the state before it rises is kept, wherever the
    others are.
    """
    text = SCENE.replace("damping: 1", "damping: 0").replace("step: 1 ms", "step: 1 ms, rho_inf: 1")
    system = system_of(text)
    whole = run(system, None)
    parts, late = tracing.Tracer(np.zeros(1, np.int64), STEPS * H, 0.0), whole.times > 0.6
    grown = Trajectory(
        system,
        whole.times,
        whole.x,
        whole.v * np.where(late, 4.0, 1.0)[:, None],
        whole.a,
        whole.multipliers,
    )
    grown = replace(grown, work=whole.work, memory=whole.memory)
    model = compile_system(system)
    for first in range(0, 960, 16):
        parts.take(model, grown.part(slice(first, first + 16)), first)
    found = parts.motion(model, grown.part(slice(960, None)), 960)
    sound = last_sound(grown)
    assert 0.5 < grown.times[sound] < 0.7
    assert found.kept is not None
    assert found.kept.tolist() == [0, sound, STEPS]
    assert_array_equal(found.states.x[1], grown.x[sound])
    assert last_sound(found) == sound


def test_sizes_of_a_motion_are_read_until_it_is_clear_of_noise() -> None:
    """All of a motion that never is, as one at rest."""
    system = system_of(SCENE)
    few, whole = sizes_of(run(system)), sizes_of(run(system, None))
    assert_array_equal(few[:, 0], whole[:, 0])
    assert_allclose(few[:16], whole[:16], rtol=1e-12)
    assert not few[16:, 1:].any()
    text = SCENE.replace("-9.81", "0")
    still = system_of(text)
    assert_allclose(sizes_of(run(still)), sizes_of(run(still, None)), rtol=1e-12, atol=1e-15)


def test_an_output_says_what_it_calls() -> None:
    """What it does not say is not found of states that are gone."""
    system = system_of(SCENE.replace("  force: {type: reaction, joint: pin}\n", ""))
    with pytest.raises(
        InputError,
        match=r"an output that calls reactions\(\): expected a class with 'reactions' in its `calls`",
    ):
        reactions(run(system))


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    base = tmp_path_factory.mktemp("runs")
    (base / "scene.yaml").write_text(SCENE, encoding="utf-8")
    for states in (True, False):
        studies.run(base / "scene.yaml", out=base / str(states), plots=False, states=states)
    return base / "True", base / "False"


def test_a_study_writes_the_same(folders: tuple[Path, Path]) -> None:
    one, other = folders
    assert (one / "outputs.csv").read_bytes() == (other / "outputs.csv").read_bytes()
    first, second = (json.loads((folder / "report.json").read_text()) for folder in folders)
    for report in (first, second):
        for name in ("cpu_s", "wall_s", "files", "sha256"):
            del report[name]
    assert first == second


def test_a_study_keeps_states_for_python_alone(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    whole, few = (studies.run(tmp_path / "scene.yaml", states=states) for states in (True, False))
    assert len(whole.trajectory.x) == len(whole.times) == len(few.times) == STEPS + 1
    assert len(few.trajectory.x) == len(few.trajectory.times) == tracing.FEW
    assert_array_equal(outputs(few.trajectory)["tip_x"], whole.outputs["tip_x"][few.motion.kept])
