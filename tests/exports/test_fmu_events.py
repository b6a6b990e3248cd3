"""Events of a model as those of its FMU: steps that end behind them, and motions that stop."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs
from fmbs_skfem.exports import c_files, fmu
from fmbs_skfem.reduction.cases import Case
from tests.dynamics.test_events import event, rod
from tests.exports.c_library import COMPILER

fmpy = pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(COMPILER is None or sys.platform == "win32", reason="no C compiler")

from tests.exports.test_fmu import DISCARD, Instance, made_by, refused  # noqa: E402

STEP, SPAN = 5e-3, 0.02
EVENTS = {
    "brake": event("angle - 0.3", lock=("pin",)),
    "go": event("t - 0.1217", release=("pin",)),
    "end": event("tip.y < -1.02", stop=True),
}


@pytest.fixture(scope="module")
def case() -> Case:
    return Case(rod(EVENTS), GeneralizedAlpha(STEP), 0.3, Newton(tolerance=1e-12))


@pytest.fixture(scope="module")
def instants(case: Case) -> list[float]:
    motion = integrate(case.system, case.scheme, 0.3, case.newton)
    found = [one.time for one in motion.events]
    assert [one.name for one in motion.events] == [*EVENTS]
    return found


@pytest.fixture(scope="module", params=[2, 3])
def archive(request: pytest.FixtureRequest, case: Case, tmp_path_factory) -> Path:  # type: ignore[no-untyped-def]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        unit = fmu.write(c_files.write(case, "eventful", "a rod"), request.param, "a rod")
    return made_by(unit, tmp_path_factory.mktemp("fmu") / "rod.fmu")


def named(one: Instance) -> dict[str, float]:
    names = [one.description.modelVariables[k].name for k in one.outputs_at]
    return dict(zip(names, one.outputs.tolist(), strict=True))


def test_a_master_without_events_sees_a_motion_that_stops(
    archive: Path, instants: list[float], tmp_path: Path
) -> None:
    """Counts of events are discrete outputs; the motion ends at the instant of the last one."""
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(archive)) == []
    one = Instance(archive, tmp_path).start()
    brake = next(each for each in one.description.modelVariables if each.name == "brake")
    assert brake.variability == "discrete"
    time = 0.0
    counts = []
    while time + SPAN < instants[-1]:
        one.unit.doStep(time, SPAN)
        time += SPAN
        counts.append((named(one)["brake"], named(one)["go"]))
    assert counts == [
        (float(t > instants[0]), float(t > instants[1]))
        for t in SPAN * np.arange(1, len(counts) + 1)
    ]
    if one.old:
        refused(DISCARD, one.unit.doStep, time, SPAN)
        assert one.unit.getBooleanStatus(3)
        assert one.unit.getRealStatus(2) == pytest.approx(instants[-1], abs=1e-12)
    else:
        event, ends, early, reached = one.unit.doStep(time, SPAN)
        assert (event, ends, early) == (False, True, False)  # which nobody has allowed
        assert reached == pytest.approx(instants[-1], abs=1e-12)
    assert one.time == pytest.approx(instants[-1], abs=1e-12)
    assert named(one)["tip_y"] == pytest.approx(-1.02, abs=1e-9)
    one.unit.terminate()
    one.unit.freeInstance()


def test_a_master_with_events_comes_to_each_of_them(
    archive: Path, case: Case, instants: list[float], tmp_path: Path
) -> None:
    if "2.0" in fmpy.read_model_description(str(archive)).fmiVersion:
        with pytest.raises(AttributeError):
            fmpy.fmi2.FMU2Slave.enterEventMode  # noqa: B018
        return
    one = Instance(archive, tmp_path, event_mode_used=True, early_return_allowed=True).start()
    assert one.description.coSimulation.hasEventMode
    seen = []
    time, ends = 0.0, False
    one.unit.updateDiscreteStates()
    one.unit.enterStepMode()
    while not ends:
        event, ends, early, reached = one.unit.doStep(time, SPAN)
        if event and not ends:
            seen.append(reached)
            one.unit.enterEventMode()
            assert named(one)["brake"] == 1.0
            assert one.unit.updateDiscreteStates()[:2] == (False, False)
            one.unit.enterStepMode()
        assert early == (reached < time + SPAN - 1e-12)
        time = reached
    np.testing.assert_allclose([*seen, time], instants, atol=1e-12)
    wanted = outputs(integrate(case.system, case.scheme, 0.3, case.newton))
    # pieces of a step are taken as steps of their own
    assert named(one)["tip_x"] == pytest.approx(wanted["tip_x"][-1], abs=1e-6)
    one.unit.freeInstance()
