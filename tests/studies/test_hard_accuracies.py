"""Accuracies of motions that are hard to judge: what is promised is held against exact answers, or
runs that are much finer.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.dynamics import Trajectory, output_errors
from fmbs_skfem.studies.planning import planned
from fmbs_skfem.studies.planning.pilots import PilotOutputs, ScenePilots
from fmbs_skfem.systems import fields
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.on_rows import OfPython
from fmbs_skfem.systems.places import Draft

from ..cli.calls import ROOT, fmbs
from ..hard_cases import child, ended

BEAM = """\
  beam: {type: cable, mesh: beam_20.msh, section: {shape: circular, diameter: 10 mm},
         material: {young_modulus: 1 GPa, density: 1800 kg/m^3}}
"""
WEIGHT = "  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}\n"
BLOCK = "mass: 1 kg, inertia: 0.002 kg m^2"


def written(
    folder: Path, bodies: str, joints: str, acting: str, analysis: str, outputs: str, more: str = ""
) -> Path:
    """A scene in the plane."""
    (folder / "beam_20.msh").write_bytes((ROOT / "meshes" / "beam_20.msh").read_bytes())
    parts = {"bodies": bodies, "joints": joints, "loads": acting, "outputs": outputs}
    text = "".join(f"{key}:\n{lines}" for key, lines in parts.items() if lines)
    path = folder / "scene.yaml"
    path.write_text(
        f"schema: 1\ndimension: 2\n{text}{more}analysis: {{type: dynamic, {analysis}}}\n"
    )
    return path


def columns(run: studies.Run) -> PilotOutputs:
    assert run.motion is not None
    return PilotOutputs(run.times, run.outputs, tuple(one.time for one in run.motion.events))


def true_part(path: Path, run: studies.Run) -> float:
    """The largest error of a run over what is wanted, at the ends of its steps: beside four times
    its cells and finest steps.
    """
    pilots, plan = ScenePilots(scenes.read(path)), run.report["accuracy"]
    parts = math.ceil(
        4 * max(plan["steps"], *(one["steps"] for one in plan["pilots"])) / plan["steps"]
    )
    system = pilots.system(4 * (plan["cells"] or 0))
    finer = pilots.analysis.piloted(parts * plan["steps"], parts).solve_for_outputs(system)
    reference = PilotOutputs(
        finer.times, output_errors.columns(finer), tuple(one.time for one in finer.events)
    )
    return float(pilots.differ(columns(run), reference)[0].max())


def run_within(path: Path) -> studies.Run:
    """The run of a scene that says its accuracy is met, and errs by no more than that."""
    run = studies.run(path, plots=False)
    assert run.report["accuracy"]["met"]
    assert true_part(path, run) <= 1.0
    return run


def test_stick_and_slip(tmp_path: Path) -> None:
    """A hand pulls a block by a spring, 0.3 t^2: it slips from 60 N/m 0.3 t^2 = mu m g on."""
    path = written(
        tmp_path,
        f"  box: {{type: rigid, {BLOCK}, center: [0, 0]}}\n  hand: {{type: rigid, {BLOCK}, center: [0.3, 0]}}\n",
        "  pull: {type: driven_position, at: hand.center, displacement: [0.3 * t**2, 0]}\n"
        "  hold: {type: driven_angle, at: hand.frame, angle: 0}\n",
        WEIGHT + "  s: {type: spring_damper, at: box.center, to: hand.center, stiffness: 60 N/m}\n"
        "  f: {type: contact_plane, at: box.center, radius: 0 m, point: [0, 0], normal: [0, 1], stiffness: 50 kN/m, "
        "dissipation: 1 s/m, friction: 0.2}\n",
        "duration: 0.6 s, accuracy: {x: 1e-3}",
        "  x: {type: position, at: box.center, component: x}\n  f: {type: contact, load: f}\n",
    )
    run = run_within(path)
    slip = math.sqrt(0.2 * 9.81 / (60 * 0.3))  # about: it is not yet settled on the floor then
    assert np.abs(run.outputs["x"][run.times < 0.9 * slip]).max() < 1e-3 * np.ptp(run.outputs["x"])
    assert run.outputs["x"][-1] > 0.02


def test_a_ball_that_bounces_to_rest(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "  ball: {type: point_mass, mass: 0.1 kg, position: [0, 0.3 m]}\n",
        "",
        WEIGHT
        + "  f: {type: contact_plane, at: ball, radius: 30 mm, point: [0, 0], normal: [0, 1], stiffness: 20 kN/m, "
        "dissipation: 2 s/m}\n",
        "duration: 2 s, accuracy: 1e-2",
        "  y: {type: position, at: ball, component: y}\n  f: {type: contact, load: f}\n",
    )
    path.write_text(path.read_text().replace("accuracy: 1e-2", "accuracy: {y: 1e-2}"))
    run = run_within(path)
    rest = 0.03 - 0.1 * 9.81 / 20e3
    assert run.outputs["y"][-1] == pytest.approx(rest, abs=1e-2 * np.ptp(run.outputs["y"]))
    assert np.sum(np.diff(np.sign(np.diff(run.outputs["y"]))) > 0) >= 4  # it has bounced


def test_a_stiff_stop(tmp_path: Path) -> None:
    """A rod falls on a stop of 1 MN/m: contacts of 2 ms or so, in 0.6 s."""
    path = written(
        tmp_path,
        "  rod: {type: rigid, mass: 1 kg, inertia: 0.08 kg m^2, center: [0.5 m, 0], points: {left: [0, 0], right: [1 m, 0]}}\n",
        "  O: {type: pin, at: rod.left, to: ground}\n",
        WEIGHT
        + "  s: {type: stop, at: rod.right, to: [1 m, -0.3 m], direction: [0, 1], stiffness: 1 MN/m, damping: 100 N s/m}\n",
        "duration: 0.6 s, accuracy: 1e-2",
        "  tip: {type: position, at: rod.right}\n",
    )
    run = run_within(path)
    assert -0.305 < run.outputs["tip_y"].min() < -0.3  # it has touched


def test_a_drive_by_a_table_with_corners(tmp_path: Path) -> None:
    """Corners at 0.1234 s and 0.31 s, where the rate of the drive jumps."""
    (tmp_path / "turn.csv").write_text("time [s],angle [rad]\n0,0\n0.1234,0\n0.31,0.3\n0.6,0.3\n")
    path = written(
        tmp_path,
        BEAM,
        "  O: {type: pin, at: beam.left, to: ground}\n  d: {type: driven_angle, at: beam.left, angle: turn(t)}\n",
        "",
        "duration: 0.6 s, accuracy: 1e-2",
        "  tip: {type: position, at: beam.right}\n",
        "tables: {turn: {file: turn.csv, unit: rad}}\ndamping: {stiffness: 5 ms}\n",
    )
    run_within(path)


def test_a_force_that_is_switched_off_between_steps(tmp_path: Path) -> None:
    """A mass on a spring: x = F/k (1 - cos wt) up to t1, then free; 2 ms off the grid would cost
    0.4 % of the range.
    """
    path = written(
        tmp_path,
        "  m: {type: point_mass, mass: 1 kg, position: [0, 0]}\n",
        "  rail: {type: slider, at: m, direction: [1, 0]}\n",
        "  s: {type: spring_damper, at: m, to: [-1 m, 0], stiffness: 100 N/m}\n"
        '  f: {type: point_force, at: m, force: [5 N, 0], history: "where(t < 0.4321, 1, 0)"}\n',
        "duration: 1 s, accuracy: 1e-3",
        "  x: {type: position, at: m, component: x}\n",
    )
    run = studies.run(path, plots=False)
    t, w, t1 = run.times, 10.0, 0.4321
    free = 0.05 * (
        (1 - np.cos(w * t1)) * np.cos(w * (t - t1)) + np.sin(w * t1) * np.sin(w * (t - t1))
    )
    exact = np.where(t < t1, 0.05 * (1 - np.cos(w * t)), free)
    assert run.report["accuracy"]["met"]
    assert np.abs(run.outputs["x"] - exact).max() <= 1e-3 * np.ptp(exact)


def test_what_crosses_zero_counts_with_its_range(tmp_path: Path) -> None:
    """x = sin(10 t) / 10: in its mean it is nothing."""
    path = written(
        tmp_path,
        "  m: {type: point_mass, mass: 1 kg, position: [0, 0]}\n",
        "  rail: {type: slider, at: m, direction: [1, 0]}\n",
        "  s: {type: spring_damper, at: m, to: [-1 m, 0], stiffness: 100 N/m}\n",
        "duration: 3 s, accuracy: 1e-3",
        "  x: {type: position, at: m, component: x}\n  v: {type: velocity, at: m, component: x}\n",
        "initial: {bodies: {m: {velocity: [1 m/s, 0]}}}\n",
    )
    run = studies.run(path, plots=False)
    assert run.report["accuracy"]["met"]
    exact = {"x": 0.1 * np.sin(10 * run.times), "v": np.cos(10 * run.times)}
    for name, values in exact.items():
        assert 1e-5 < np.abs(run.outputs[name] - values).max() / np.ptp(values) <= 1e-3


def test_a_scene_at_rest(tmp_path: Path) -> None:
    """Nothing acts: no range is there to be a part of, and nothing is asked for."""
    outputs = "  tip: {type: position, at: beam.right}\n  O: {type: reaction, joint: O}\n"
    path = written(
        tmp_path,
        BEAM,
        "  O: {type: clamp, at: beam.left}\n",
        "",
        "duration: 1 s, accuracy: 1e-4",
        outputs,
    )
    run = studies.run(path, plots=False)
    plan = run.report["accuracy"]
    assert plan["met"]
    assert (plan["cells"], plan["steps"]) == (2, 200)
    assert max(np.ptp(run.outputs["tip_x"]), np.ptp(run.outputs["tip_y"])) < 1e-15


def test_a_snap_through(tmp_path: Path) -> None:
    """A deep arch snaps at about 0.9 s: meshes that differ a little snap at other times, and their
    pilots differ by chance.
    """
    (tmp_path / "deep_arc_60.msh").write_bytes((ROOT / "meshes" / "deep_arc_60.msh").read_bytes())
    path = written(
        tmp_path,
        "  arch: {type: cable, mesh: deep_arc_60.msh, "
        "section: {shape: given, EA: 1 MN, EI: 1 N m^2, rhoA: 1 kg/m, radius: 15 mm}}\n",
        "  clamp: {type: clamp, at: arch.left}\n  hinge: {type: pin, at: arch.right, to: ground}\n",
        "  crown: {type: point_force, at: arch.middle, force: [0, -10 N], history: t}\n",
        "duration: 2 s, accuracy: 1e-2",
        "  crown: {type: position, at: arch.middle}\n",
        "damping: {mass: 1 1/s, stiffness: 1 ms}\n",
    )
    run_within(path)


def test_a_mesh_is_found_beside_a_step_that_is_given(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        BEAM,
        "  O: {type: clamp, at: beam.left}\n",
        "  f: {type: point_force, at: beam.right, force: [0, -1 N], history: sin(pi * t)**2}\n",
        "duration: 1 s, step: 1 ms, accuracy: 5e-3",
        "  tip: {type: position, at: beam.right}\n  root: {type: section_forces, at: beam.left}\n",
    )
    run = studies.run(path, plots=False)
    plan = run.report["accuracy"]
    assert plan["met"]
    assert plan["steps"] == 1000
    assert {one["steps"] for one in plan["pilots"]} <= {200, 500, 1000, 2000}
    assert true_part(path, run) <= 1.0


def test_reactions_are_judged_right_behind_what_is_caught(tmp_path: Path) -> None:
    """A beam is caught in flight: the force there has no bound, as more steps see more of it. That
    is said, with the time.
    """
    path = written(
        tmp_path,
        BEAM,
        "  hand: {type: latch, at: beam.right}\n",
        WEIGHT,
        "duration: 0.3 s, accuracy: 1e-2",
        "  tip: {type: position, at: beam.right}\n  held: {type: reaction, joint: hand}\n",
        "damping: {stiffness: 1 ms}\nevents:\n  catch: {when: tip.y + 5 cm, direction: falling, lock: hand, once: true}\n",
    )
    plan = planned.find(scenes.read(path))
    assert plan.why_not == "sensitive"
    assert plan.driven_by.startswith("held")
    assert plan.trusted_until == pytest.approx(math.sqrt(2 * 0.05 / 9.81), abs=2e-3)


@dataclass(frozen=True)
class Gust(loads.Load, word="test_gust"):
    """A force by a function of Python that jumps in time: 1 N along y up to 0.2345 s, and drag."""

    name: str
    at: fields.Place
    factor: Annotated[float, fields.quantity("N s/m", ">= 0")]

    def push(self, draft: Draft) -> None:
        dim = draft.layout.dim
        first = draft.probes.add(draft.layout.read(f"load '{self.name}'", self.at))

        def force(y: np.ndarray, rates: np.ndarray, h: np.ndarray) -> np.ndarray:
            return h[0] * np.eye(dim)[1] - self.factor * rates

        def slopes(
            y: np.ndarray, rates: np.ndarray, h: np.ndarray
        ) -> tuple[np.ndarray, np.ndarray]:
            return np.zeros((dim, dim)), -self.factor * np.eye(dim)

        blowing = draft.signal(lambda t: np.where(t < 0.2345, 1.0, 0.0))
        draft.forces.terms.append(OfPython(first + np.arange(dim), force, (blowing,), slopes))


del loads.Load.known["test_gust"]


@pytest.fixture
def gust() -> Iterator[None]:
    loads.Load.known["test_gust"] = Gust
    yield
    del loads.Load.known["test_gust"]


@pytest.mark.usefixtures("gust")
def test_a_force_of_python(tmp_path: Path) -> None:
    """m v' = F - c v up to t1, then - c v: x = F/c (t - (1 - exp(-ct/m)) m/c), and from there on by
    what is left of v.
    """
    path = written(
        tmp_path,
        "  m: {type: point_mass, mass: 0.1 kg, position: [0, 0]}\n",
        "",
        "  g: {type: test_gust, at: m, factor: 0.3}\n",
        "duration: 0.5 s, accuracy: 1e-2",
        "  y: {type: position, at: m, component: y}\n",
    )
    run = studies.run(path, plots=False)
    t, t1, rate = run.times, 0.2345, 0.3 / 0.1
    before = (t - (1 - np.exp(-rate * t)) / rate) / 0.3
    at = (t1 - (1 - np.exp(-rate * t1)) / rate) / 0.3
    behind = at + (1 - np.exp(-rate * t1)) / 0.3 * (1 - np.exp(-rate * (t - t1))) / rate
    exact = np.where(t < t1, before, behind)
    assert run.report["accuracy"]["met"]
    assert np.abs(run.outputs["y"] - exact).max() <= 1e-2 * np.ptp(exact)


BOUNCING = (
    "  ball: {type: point_mass, mass: 0.1 kg, position: [0, 0.1 m]}\n",
    "",
    WEIGHT
    + "  f: {type: contact_plane, at: ball, radius: 30 mm, point: [0, 0], normal: [0, 1], stiffness: 20 kN/m}\n",
    "duration: 0.5 s, local_error: 1e-6, accuracy: 1e-3",
    "  y: {type: position, at: ball, component: y}\n",
)


def test_a_run_of_changing_steps_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    path, out = written(tmp_path, *BOUNCING), tmp_path / "out"
    whole = studies.run(path, out=tmp_path / "whole", plots=False)
    motion = whole.motion
    assert isinstance(motion, Trajectory)
    assert motion.statistics.iterations > 0
    stopped = fmbs(
        "run", path, "--out", out, "--no-plots", "--checkpoint", "0.001", "--time-limit", "0.001"
    )
    assert stopped.code == 6
    gone_on = studies.resume(out, plots=False)
    assert json.loads((out / "report.json").read_text())["accuracy"]["tolerance"] > 0.0
    for name, values in whole.outputs.items():
        np.testing.assert_array_equal(values, gone_on.outputs[name])


def test_threads_and_processes_find_the_same(tmp_path: Path) -> None:
    """Plans count work and never ask a clock: two threads at once, and another process, choose the
    same and run the same.
    """
    path = written(tmp_path, *BOUNCING)

    def found(_: Any = None) -> tuple[dict[str, Any], np.ndarray]:
        scene = scenes.read(path)
        plan = planned.find(scene)
        return asdict(plan), studies.run(scene, plots=False).outputs["y"]

    def write() -> None:
        plan, values = found()
        (tmp_path / "plan.json").write_text(json.dumps(plan))
        np.save(tmp_path / "y.npy", values)

    alone, values = found()
    with ThreadPoolExecutor(2) as pool:
        for plan, same in pool.map(found, range(2)):
            assert plan == alone
            np.testing.assert_array_equal(same, values)
    assert ended(child(write)) == 0
    assert json.loads((tmp_path / "plan.json").read_text()) == alone
    np.testing.assert_array_equal(np.load(tmp_path / "y.npy"), values)
