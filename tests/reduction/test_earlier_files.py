"""Files of earlier releases are read, and run as then to the tolerance of Newton's iteration then.

In version 1 lengths were not measured by the mass. Steps began with M^-1 f, whatever of it they resolve.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.errors import SolverError
from fmbs_skfem.core.storage import container
from fmbs_skfem.dynamics import GeneralizedAlpha, initial
from fmbs_skfem.families import parametric_model
from fmbs_skfem.families import training_store as store
from fmbs_skfem.reduction import earlier, files
from fmbs_skfem.reduction.accuracy.error_budget import BudgetChoice
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

DATA = Path(__file__).parent / "data"
EXPECTED_2 = {"tip_x": 0.9996596661261077, "tip_y": 0.0012644108693586503}
EXPECTED_3 = {"tip_x": 0.9994336937383668, "tip_y": 0.007435409254333478, "tip_z": 3.526430731904917e-05}
FAMILY = {"tip_x": 0.9996836315721795, "tip_y": 0.0013724289956470546}


@pytest.fixture(autouse=True)
def start_as_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(initial, "is_filtered", lambda system: False)


def test_a_single_model() -> None:
    system = files.load(DATA / "single_version_1.h5")
    motion = dynamics.integrate(system, GeneralizedAlpha(1e-3), 0.01)
    found = dynamics.outputs(motion)
    assert found["tip_x"][-1] == pytest.approx(0.999977920139542, abs=1e-9)
    assert found["tip_y"][-1] == pytest.approx(0.00273363847352872, abs=5e-8)


def test_a_model_of_a_family() -> None:
    model = parametric_model.load(DATA / "family_version_1.h5")
    found = dynamics.outputs(parametric_model.run(model, E=1e9))
    assert found["tip_x"][-1] == pytest.approx(0.998949919966806, abs=1e-8)
    assert found["tip_y"][-1] == pytest.approx(0.00271925634469862, abs=1e-8)


def test_a_single_model_of_version_2() -> None:
    saved = files.read(DATA / "single_version_2.h5")
    assert saved.notes == {"report": {"duration": 0.01, "step": 1e-3}, "pair": (1, 2.5)}
    found = dynamics.outputs(files.run(saved))
    assert found["tip_x"][-1] == pytest.approx(1.0000000843195829, abs=1e-9)
    assert found["tip_y"][-1] == pytest.approx(1.7889771816995788e-07, abs=1e-9)


@pytest.mark.parametrize("dim, expected", [(2, EXPECTED_2), (3, EXPECTED_3)])
def test_loads_in_columns(dim: int, expected: dict[str, float]) -> None:
    """Dead loads, moments, followers and springs by laws with numbers."""
    motion = dynamics.integrate(files.load(DATA / f"loads_{dim}_version_2.h5"), GeneralizedAlpha(1e-3), 0.05)
    found = dynamics.outputs(motion)
    assert {name: found[name][-1] for name in expected} == pytest.approx(expected, abs=1e-9)


def test_loads_in_columns_of_a_family() -> None:
    """Polynomials of a force, a moment, a follower and springs are where these numbers are now."""
    model = parametric_model.load(DATA / "loads_family_version_2.h5")
    found = dynamics.outputs(parametric_model.run(model, force=1.5, moment=0.45, follow=1.7, k=0.7))
    assert {name: found[name][-1] for name in FAMILY} == pytest.approx(FAMILY, abs=1e-9)


def test_forces_of_fixed_direction_apart(tmp_path: Path) -> None:
    """Dead loads that were a struct of their own are a law as others are."""
    load = loads.PointForce("pull", At("a", "center"), (1.5, -2.0), np.sin)
    system = assemble([rigid("a", 1.0, 0.1, (0.0, 0.0), dim=2)], [], [load])
    (force,) = system.loads.forces
    old = earlier.DeadLoads(force.rows[:, 0], force.numbers[:, 0], np.array([-1, -1]))
    apart = replace(system, loads=replace(system.loads, forces=(old,)), signals=())
    (found,) = files.load(container.write(tmp_path / "old.h5", files.KIND, system=apart, notes={})).loads.forces
    assert found.law is force.law
    assert (found.rows.tolist(), found.numbers.tolist(), found.signals.tolist()) == (
        force.rows.tolist(),
        [[1.5], [-2.0]],
        [[-1], [-1]],
    )


def test_gears_by_angles() -> None:
    """Constraint terms that are angles are laws of gears, of two wheels and with a carrier; the motion is that of a new model."""
    found, expected = files.load(DATA / "gears_version_2.h5"), gears()
    assert [own.law.name for own in found.constraints.laws] == [own.law.name for own in expected.constraints.laws]
    moved, other = (dynamics.outputs(dynamics.integrate(one, GeneralizedAlpha(1e-3), 1.0)) for one in (found, expected))
    for name in other:
        np.testing.assert_allclose(moved[name], other[name], atol=1e-9)
    a, b, arm, planet = (moved[name][-1] for name in ("a", "b", "arm", "planet"))
    assert abs(a) > 1.0
    assert b == pytest.approx(-0.4 * a, abs=1e-9)
    assert planet - arm == pytest.approx(-0.4 * (a - arm), abs=1e-9)


def gears() -> System:
    """Two wheels that mesh, and a planet on an arm about the first one: what the file holds."""
    wheels = [("a", (0.0, 0.0)), ("b", (1.0, 0.0)), ("arm", (0.0, 0.0)), ("planet", (0.0, 1.0))]
    parts = [rigid(name, 1.0, 0.1, place, dim=2, places={"top": (0.0, 1.0)} if name == "arm" else {}) for name, place in wheels]
    a, b, arm, planet = (At(name, "frame") for name, _ in wheels)
    held = [
        *(joints.Revolute(f"pin of {one.body}", one) for one in (a, b, arm)),
        joints.Revolute("pin of planet", planet, At("arm", "top")),
        joints.Gear("gear", a, b, (20, 50)),
        joints.Gear("planetary gear", a, planet, (12, 30), arm),
    ]
    pushed = [loads.Moment("on a", a, 0.5), loads.Moment("on the arm", arm, 0.2)]
    sensed = {name: probes.Angle(At(name, "frame")) for name, _ in wheels}
    return eliminate(assemble(parts, held, pushed, outputs=sensed))


def test_a_training() -> None:
    folder = store.open_folder(DATA / "training_version_2", "mark")
    found = store.read(folder)
    (stored,), (iteration,) = found.runs, found.iterations
    run = stored.run
    assert (stored.point, found.indicators) == (4, {1: 1e-3, 2: 2e-3})
    assert (run.values, run.cpu_s) == ({"E": 1e9}, 0.5)
    np.testing.assert_array_equal(run.factors["beam"].coefficients, np.arange(6.0).reshape(2, 3))
    assert (iteration.next, iteration.failed, iteration.samples) == (7, ((5, "diverged"),), (1, 2))
    notes = store.Notes((store.Pair(0, 1, 1e-3, 2e-3),), BudgetChoice(1e-3, 1e-6, None, 1e-4, 0.0, None), 1, 2)
    assert store.notes_of(folder, 1) == notes
    assert list(store.read_checks(folder)) == [7]
    with pytest.raises(SolverError, match="no"):
        store.read_or_make(folder / "check-00008.h5", lambda: run)
